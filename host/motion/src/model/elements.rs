//! Joints, force elements and control elements: markers, creation, recording.

use std::sync::Arc;

use element_api::params::FRAME_COUNT;
use element_api::recording::{Op, Role};
use element_api::set::{CreateError, ElementSet};
use element_api::{Descriptor, Kind, Recording};
use nalgebra::{Matrix3, Vector3};
use rustc_hash::FxHashMap;

use super::bodies::{Bodies, Target, quoted};
use super::channels::switched_off;
use super::together::{needs_distance, origins, together};
use super::types::{Body, Instance, Marker, rotation};
use super::{declared, fmus, idle, inertia, margins, parameters, tables};
use crate::catalog::{Catalog, ElementHandle, LibraryInfo, fault_code};
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::scene::{ElementKind, ElementRecord, LocalFrame, Placement, Scene};

/// Parameters beyond this size, SI, are no fault of an element that cannot compute with them: squares are next to the largest number.
const OVERFLOWS: f64 = 1e150;

/// The elements of a scene, those that are switched on.
pub(super) struct Elements {
    pub(super) instances: Vec<Instance>,
    pub(super) sets: Vec<Box<dyn ElementSet>>,
    /// The FMUs among the elements, one for each file.
    pub(super) fmus: Vec<LibraryInfo>,
    /// Full class name of each set.
    set_names: Vec<String>,
    /// Class of each set.
    classes: Vec<Arc<Descriptor>>,
    /// What was recorded last of each set.
    recordings: Vec<Arc<Recording>>,
    /// The instances of each name.
    named: FxHashMap<String, Vec<usize>>,
}

pub(super) fn resolve(
    scene: &Scene,
    catalog: &Catalog,
    bodies: &Bodies,
    thoroughly: bool,
    found: &mut Vec<Diagnostic>,
) -> Elements {
    let mut elements = Elements {
        instances: Vec::new(),
        sets: Vec::new(),
        fmus: Vec::new(),
        set_names: Vec::new(),
        classes: Vec::new(),
        recordings: Vec::new(),
        named: FxHashMap::default(),
    };
    let mut idle = idle::Found::default();
    let mut judged: FxHashMap<String, bool> = FxHashMap::default();
    for record in scene.elements.iter().filter(|record| record.enabled) {
        let before = found.len();
        let handle = class_of(scene, record, catalog, found);
        let flat = handle.as_ref().and_then(|handle| fmus::flattened(record, handle));
        let record = flat.as_ref().unwrap_or(record);
        let targets: Vec<&Target> = record
            .bodies
            .value
            .iter()
            .filter_map(|name| bodies.find(name).map_err(|diagnostic| found.push(diagnostic)).ok())
            .collect();
        let Some(handle) = handle else { continue };
        let sound = *judged.entry(handle.full_name()).or_insert_with(|| {
            let refused = declared::refused(record, &handle);
            let sound = refused.is_empty();
            found.extend(refused);
            sound
        });
        if !sound {
            continue;
        }
        let class = handle.descriptor();
        let mut table = parameters::resolve(
            scene,
            record,
            (&class.params, &class.catalog),
            &record.type_name.value,
            class.kind,
            found,
        );
        let joints = elements.joints_of(scene, record, &handle, found);
        if joints.len() < record.joints.len() {
            continue;
        }
        let borrowed = record.bodies.value.is_empty().then(|| joints.first()).flatten();
        let markers = match borrowed {
            Some(joint) => elements.markers_of(*joint, record, &handle),
            None => {
                check_bodies(record, &handle, &targets, found);
                if found.len() > before { Ok(Vec::new()) } else { markers(record, &targets, bodies) }
            }
        };
        let markers = match markers {
            Ok(markers) => markers,
            Err(diagnostic) => {
                found.push(*diagnostic);
                continue;
            }
        };
        if found.len() > before {
            continue;
        }
        if class.more_frames.is_some() {
            table.insert(FRAME_COUNT.into(), (markers.len() as i64).into());
        }
        match elements.create(record, &handle, &table, markers, (joints, &bodies.movable)) {
            Ok(instance) => {
                found.extend(tables::check(scene, record, class, &table, &instance.recording));
                if thoroughly {
                    found.extend(idle::check(record, &handle, &table, &instance.recording, &mut idle));
                }
                elements.push(instance);
            }
            Err(diagnostic) => found.push(*diagnostic),
        }
    }
    elements
}

fn class_of(
    scene: &Scene,
    record: &ElementRecord,
    catalog: &Catalog,
    found: &mut Vec<Diagnostic>,
) -> Option<ElementHandle> {
    if fmus::is_one(record, catalog) {
        return fmus::class_of(scene, record, catalog).map_err(|diagnostic| found.push(*diagnostic)).ok();
    }
    let kind = match record.kind {
        ElementKind::Joint => Kind::Joint,
        ElementKind::Force => Kind::Force,
        ElementKind::Control => Kind::Control,
    };
    match catalog.find(&record.type_name.value, Some(kind)) {
        Ok(handle) => Some(handle),
        Err(error) => {
            let mut diagnostic = Diagnostic::error(error.code(), error.to_string())
                .at(record.type_name.span.clone(), format!("the type of {} `{}`", kind.word(), record.name.value));
            for line in error.help() {
                diagnostic = diagnostic.help(line);
            }
            found.push(diagnostic);
            None
        }
    }
}

/// The right number of bodies, and not all of them the same.
fn check_bodies(record: &ElementRecord, handle: &ElementHandle, targets: &[&Target], found: &mut Vec<Diagnostic>) {
    let class = handle.descriptor();
    let (given, (least, most)) = (record.bodies.value.len(), class.frame_counts());
    let needed = if least == most { least.to_string() } else { format!("{least} to {most}") };
    if !(least..=most).contains(&given) {
        let frames = class.frames.iter().chain(&class.more_frames).map(|frame| frame.name.as_str());
        let frames: Vec<&str> = frames.collect();
        let more = if least < most { ", the last any number of times" } else { "" };
        found.push(
            Diagnostic::error(
                codes::BODY_COUNT,
                format!(
                    "`{}` connects {given} bod{}, `{}` needs {needed}",
                    record.name.value,
                    if given == 1 { "y" } else { "ies" },
                    class.name
                ),
            )
            .at(record.bodies.span.clone(), format!("expected {needed} names"))
            .help(format!("one body for each of {}{more}; `ground` counts as a body", quoted(&frames))),
        );
        return;
    }
    let index = |target: &Target| match target {
        Target::Movable(body) => Some(*body),
        Target::Fixed { .. } => None,
    };
    if let Some(first) = targets.first().filter(|_| targets.len() == given && given > 1)
        && targets.iter().all(|target| index(target) == index(first))
    {
        let what = if index(first).is_some() { "the same body twice" } else { "ground to ground" };
        found.push(
            Diagnostic::error(codes::SELF_JOINT, format!("`{}` connects {what}", record.name.value))
                .at(record.bodies.span.clone(), "has no effect on any motion")
                .help("name two different bodies, at least one of which can move"),
        );
    }
}

/// Share of what a number is a difference of that is round-off.
const ROUND_OFF: f64 = 4.0 * f64::EPSILON;

/// Where the element's frames are on their bodies.
fn markers(record: &ElementRecord, targets: &[&Target], bodies: &Bodies) -> Result<Vec<Marker>, Box<Diagnostic>> {
    let count = targets.len();
    let span = record.placement.span.clone();
    let poses: Vec<(Vector3<f64>, Matrix3<f64>)> = match &record.placement.value {
        Placement::Global { points, axes, x_axes } => {
            for (list, what) in [(points, "points"), (axes, "axes"), (x_axes, "x_axes")] {
                if list.len() > 1 && list.len() != count {
                    return Err(Box::new(
                        Diagnostic::error(
                            codes::BAD_PLACEMENT,
                            format!("`{}` has {} {what} for {count} frames", record.name.value, list.len()),
                        )
                        .at(span, format!("give one for all frames, or {count}")),
                    ));
                }
            }
            let pick = |list: &[[f64; 3]], k: usize| list.get(if list.len() == 1 { 0 } else { k }).copied();
            let mut poses = Vec::with_capacity(count);
            for (k, target) in targets.iter().enumerate() {
                let triad = triad(pick(axes, k), pick(x_axes, k));
                let triad = triad.ok_or_else(|| parallel_axes(record, span.clone()))?;
                let (origin, attitude) = body_frame(target, bodies);
                // Not given: the origin of the body's own frame.
                let point = pick(points, k).map_or(origin, Vector3::from);
                let offset = point - origin;
                // Two numbers that are one but for round-off.
                let is_there = offset.norm() <= ROUND_OFF * origin.norm();
                let offset = if is_there { Vector3::zeros() } else { offset };
                poses.push((attitude.tr_mul(&offset), attitude.tr_mul(&triad)));
            }
            poses
        }
        Placement::Local(frames) => {
            if frames.len() != count {
                return Err(Box::new(
                    Diagnostic::error(
                        codes::BAD_PLACEMENT,
                        format!("`{}` has {} frames for {count} bodies", record.name.value, frames.len()),
                    )
                    .at(span, format!("expected {count}, one per body")),
                ));
            }
            let local = |frame: &LocalFrame| {
                let triad = triad(frame.axis, frame.x_axis);
                let triad = triad.ok_or_else(|| parallel_axes(record, frame.span.clone()))?;
                Ok::<_, Box<Diagnostic>>((Vector3::from(frame.position), triad))
            };
            frames.iter().map(local).collect::<Result<_, _>>()?
        }
        Placement::Absent => vec![(Vector3::zeros(), Matrix3::identity()); count],
    };
    let marker = |((position, triad), target): ((Vector3<f64>, Matrix3<f64>), &&Target)| match target {
        Target::Movable(body) => {
            // That of the whole body, its point masses included.
            let position = position - bodies.movable[*body].center_of_mass;
            Marker { body: Some(*body), position, rotation: triad }
        }
        Target::Fixed { origin, rotation } => {
            Marker { body: None, position: origin + rotation * position, rotation: rotation * triad }
        }
    };
    Ok(poses.into_iter().zip(targets).map(marker).map(without_round_off).collect())
}

/// Zeros and ones that round-off has blurred are zeros and ones again: where an axis lies along another one, whole terms of
/// the equations are known to vanish.
fn without_round_off(mut marker: Marker) -> Marker {
    for entry in marker.rotation.iter_mut() {
        if entry.abs() <= ROUND_OFF {
            *entry = 0.0;
        } else if (entry.abs() - 1.0).abs() <= ROUND_OFF {
            *entry = entry.signum();
        }
    }
    let least = ROUND_OFF * marker.position.norm();
    marker.position.iter_mut().filter(|entry| entry.abs() <= least).for_each(|entry| *entry = 0.0);
    marker
}

fn parallel_axes(record: &ElementRecord, span: std::ops::Range<usize>) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::error(codes::BAD_PLACEMENT, format!("the axes of `{}` make no frame", record.name.value))
            .at(span, "`x_axis` is parallel to `axis`")
            .help("leave `x_axis` out, or give a direction across the axis"),
    )
}

/// Frame of a body at the start, as given.
fn body_frame(target: &Target, bodies: &Bodies) -> (Vector3<f64>, Matrix3<f64>) {
    match target {
        Target::Movable(body) => bodies.frames[*body],
        Target::Fixed { origin, rotation } => (*origin, *rotation),
    }
}

/// A right-handed triad with the given z axis and an x axis near the hint. Without a hint, x is the direction across z
/// that is nearest to the x axis (to the y axis where z is nearly along x). `None` when hint and axis are parallel.
pub(super) fn triad(axis: Option<[f64; 3]>, hint: Option<[f64; 3]>) -> Option<Matrix3<f64>> {
    let z = axis.map_or(Vector3::z(), Vector3::from).normalize();
    let hint = match hint {
        Some(hint) => Vector3::from(hint),
        None if z.x.abs() < 0.9 => Vector3::x(),
        None => Vector3::y(),
    };
    let across = hint - z * z.dot(&hint);
    if across.norm() <= 1e-9 * hint.norm() {
        return None;
    }
    // Once more against the round-off of the first subtraction.
    let x = across.normalize();
    let x = (x - z * z.dot(&x)).normalize();
    Some(Matrix3::from_columns(&[x, z.cross(&x), z]))
}

impl Elements {
    fn push(&mut self, instance: Instance) {
        self.named.entry(instance.name.clone()).or_default().push(self.instances.len());
        self.instances.push(instance);
    }

    /// The element of a kind with a name.
    pub(super) fn find(&self, name: &str, kind: Kind) -> Option<usize> {
        let mut named = self.named.get(name)?.iter().copied();
        named.find(|index| self.instances[*index].class.kind == kind)
    }

    /// The joints whose reactions an element takes. They come before it, as all joints come before all forces.
    fn joints_of(
        &self,
        scene: &Scene,
        record: &ElementRecord,
        handle: &ElementHandle,
        found: &mut Vec<Diagnostic>,
    ) -> Vec<usize> {
        let class = handle.descriptor();
        if record.joints.len() != class.joints.len() {
            let names: Vec<&str> = class.joints.iter().map(|joint| joint.name.as_str()).collect();
            let (given, needed) = (record.joints.len(), class.joints.len());
            let place = record.joints.first().map_or(record.span.clone(), |joint| joint.span.clone());
            let diagnostic = Diagnostic::error(
                codes::BODY_COUNT,
                format!(
                    "`{}` names {given} joints, `{}` takes the reactions of {needed}",
                    record.name.value, class.name
                ),
            )
            .at(place, format!("expected {needed}"));
            found.push(match names.as_slice() {
                [] => diagnostic.help(format!("`{}` depends on no joint: leave `joints` out", class.name)),
                _ => diagnostic.help(format!("joints = [...]   # the names of {}", quoted(&names))),
            });
            return Vec::new();
        }
        let mut joints = Vec::with_capacity(record.joints.len());
        for name in &record.joints {
            if let Some(index) = self.find(&name.value, Kind::Joint) {
                joints.push(index);
                continue;
            }
            if let Some(off) = switched_off(scene, name, "its reaction is wanted here") {
                found.push(*off);
                continue;
            }
            let known: Vec<&str> =
                self.instances.iter().filter(|e| e.class.kind == Kind::Joint).map(|e| e.name.as_str()).collect();
            let nearest = suggest(&name.value, known.iter().copied()).map(|n| format!("did you mean `{n}`?"));
            found.push(
                Diagnostic::error(codes::UNKNOWN_TARGET, format!("there is no joint `{}`", name.value))
                    .at(name.span.clone(), "its reaction is wanted here")
                    .help_if(nearest),
            );
        }
        joints
    }

    /// The frames of a joint, for an element that has as many and says nothing about its own.
    fn markers_of(
        &self,
        joint: usize,
        record: &ElementRecord,
        handle: &ElementHandle,
    ) -> Result<Vec<Marker>, Box<Diagnostic>> {
        let joint = &self.instances[joint];
        let (least, most) = handle.descriptor().frame_counts();
        if (least..=most).contains(&joint.markers.len()) {
            return Ok(joint.markers.clone());
        }
        let needed = if least == most { least.to_string() } else { format!("{least} to {most}") };
        Err(Box::new(
            Diagnostic::error(
                codes::BODY_COUNT,
                format!("`{}` has {} frames, `{}` needs {needed}", joint.name, joint.markers.len(), record.name.value),
            )
            .at(record.span.clone(), "takes its frames from the joint")
            .help("name `bodies` and their frames"),
        ))
    }

    /// The element behind a record, created, recorded and checked.
    fn create(
        &mut self,
        record: &ElementRecord,
        handle: &ElementHandle,
        table: &element_api::params::Table,
        markers: Vec<Marker>,
        (joints, bodies): (Vec<usize>, &[Body]),
    ) -> Result<Instance, Box<Diagnostic>> {
        let full_name = handle.full_name();
        let set = self.set_names.iter().position(|name| *name == full_name).unwrap_or_else(|| {
            self.set_names.push(full_name.clone());
            let set = handle.class.new_set();
            if set.communicates() {
                self.fmus.push(LibraryInfo::clone(&handle.library));
            }
            self.sets.push(set);
            self.classes.push(Arc::new(handle.descriptor().clone()));
            self.recordings.push(Arc::default());
            self.sets.len() - 1
        });
        let shared = &self.classes[set];
        let class = match &shared.more_frames {
            Some(_) => Arc::new(shared.with_frames(markers.len())),
            None => Arc::clone(shared),
        };
        self.sets[set].announce(&record.name.value);
        let overflows = |value: &toml::Value| value.as_float().is_some_and(|number| number.abs() > OVERFLOWS);
        let remedy = match table.iter().find(|(_, value)| overflows(value)) {
            Some((key, _)) => format!("`{key}` is too large to be computed with"),
            None => format!("this is a defect of {} {}", handle.library.package, handle.library.version),
        };
        let index = self.sets[set].add(table).map_err(|error| refusal(record, &full_name, error))?;
        let failed = |message: &str| {
            Box::new(
                Diagnostic::error(
                    fault_code(message),
                    format!("`{full_name}` failed while recording its equations: {message}"),
                )
                .at(record.type_name.span.clone(), format!("for `{}`", record.name.value))
                .help(remedy.as_str()),
            )
        };
        let recording = self.sets[set].record(index).map_err(|fault| failed(&fault.message))?;
        let misbehaved = |message: String| {
            Box::new(
                Diagnostic::error(
                    codes::PLUGIN_MISBEHAVED,
                    format!("`{full_name}` gives unusable equations: {message}"),
                )
                .at(record.type_name.span.clone(), format!("for `{}`", record.name.value))
                .help(remedy.as_str()),
            )
        };
        if let Some(row) = unset_row(&recording) {
            let name = class.rows.get(row).map_or("?", String::as_str);
            return Err(misbehaved(format!("its row `{name}` is never set")));
        }
        recording.check(&class.limits()).map_err(misbehaved)?;
        inertia::check(&recording, &markers, bodies).map_err(|message| {
            let points = origins(&markers, |body| (bodies[body].position, rotation(&bodies[body].orientation)));
            // Whoever reads that a number is none learns why, where it is the scene's doing.
            let size = points.iter().map(|point| point.norm()).fold(0.0, f64::max);
            let needs = |pair: &[usize; 2]| needs_distance(&recording, &points, *pair, size.max(1.0));
            match together(&points, size).filter(needs) {
                None => misbehaved(message),
                Some(_) => Box::new(
                    Diagnostic::error(codes::BAD_PLACEMENT, format!("points of `{}` lie together", record.name.value))
                        .at(
                            record.type_name.span.clone(),
                            "acts along the line between its points, which has no direction there",
                        )
                        .help("put one of them further out along the line of motion"),
                ),
            }
        })?;
        let mut rows: Vec<usize> = recording
            .outputs
            .iter()
            .filter_map(|output| match output.role {
                Role::Residual(row) | Role::VelocityResidual(row) => Some(row as usize),
                _ => None,
            })
            .collect();
        rows.sort_unstable();
        if rows.is_empty() && class.kind == Kind::Joint {
            return Err(misbehaved("it has no constraint row".into()));
        }
        let grids = margins::grids(&class, table, &recording);
        let last = &mut self.recordings[set];
        if **last != recording {
            *last = Arc::new(recording);
        }
        let recording = Arc::clone(last);
        Ok(Instance {
            name: record.name.value.clone(),
            class,
            library: handle.library.package.clone(),
            set,
            index: index as u32,
            markers,
            recording,
            rows,
            inputs: Vec::new(),
            joints,
            release: None,
            grids,
        })
    }
}

/// A row that the author forgot: the adapter records NaN for it.
fn unset_row(recording: &Recording) -> Option<usize> {
    recording.outputs.iter().find_map(|output| {
        let (Role::Residual(row) | Role::VelocityResidual(row)) = output.role else { return None };
        let op = recording.ops.get(output.node as usize).and_then(|raw| Op::decode(*raw))?;
        let Op::Constant(k) = op else { return None };
        recording.constants.get(k as usize).filter(|value| value.is_nan()).map(|_| row as usize)
    })
}

fn refusal(record: &ElementRecord, full_name: &str, error: CreateError) -> Box<Diagnostic> {
    Box::new(match error {
        CreateError::Parameter(error) => {
            let place = match error.path.as_str() {
                "bodies" => record.bodies.span.clone(),
                path => parameters::place(record, path),
            };
            let what = if error.path.is_empty() { String::new() } else { format!("`{}` ", error.path) };
            Diagnostic::error(
                codes::ELEMENT_REFUSES,
                format!("`{}` ({full_name}): {what}{}", record.name.value, error.message),
            )
            .at(place, "refused by the element")
        }
        CreateError::Fault(message) => {
            Diagnostic::error(fault_code(&message), format!("`{full_name}` failed while it was created: {message}"))
                .at(record.type_name.span.clone(), format!("for `{}`", record.name.value))
                .help("this is a defect of the library; its author will want this message")
        }
    })
}
