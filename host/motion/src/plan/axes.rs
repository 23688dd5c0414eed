//! Directions that joints leave free, and elements that act about or along others.

use std::f64::consts::FRAC_PI_2;

use element_api::Kind;
use element_api::recording::{Input, Op, Role};
use nalgebra::{DMatrix, Matrix3, Vector3};
use rustc_hash::FxHashMap;

use super::decide::Probe;
use super::layout::Layout;
use super::undetermined::{SIZES, drawn};
use crate::linalg::SingularValues;
use crate::model::{FramePose, Instance, Marker, Model, mass_at, operations_behind};

/// Share of the largest part of a freedom below which another part is round-off.
const NOTHING: f64 = 1e-9;
/// Axes that are nearer than this to parallel are, rad.
const PARALLEL: f64 = 1e-6;

/// An element that acts about or along the z axes of its frames where joints leave its bodies other motions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crosswise {
    /// Which element.
    pub element: usize,
    /// Two of its frames.
    pub frames: [usize; 2],
    /// A joint that moves their bodies about or along another axis than the first frame's z; `None`: the z axes are not parallel at the start.
    pub joint: Option<usize>,
    /// Whether the joint slides there, other than about an axis.
    pub slides: bool,
    /// Between z and what joints leave free, or between the two axes, rad.
    pub angle: f64,
}

/// The elements that act about or along axes which are not those of the joints beside them.
pub(super) fn crosswise(model: &Model, layout: &Layout, probe: &Probe<'_>) -> Vec<Crosswise> {
    let pairs = |element: &Instance| match (&element.class.parallel_axes[..], &element.markers[..]) {
        ([], [_, _]) if element.class.kind == Kind::Force && !element.class.opaque => vec![[0, 1]],
        (pairs, _) => pairs.to_vec(),
    };
    let mut joints = Beside::new(model, layout, probe);
    let mut found = Vec::new();
    for (element, instance) in model.elements.iter().enumerate() {
        let keeps_parallel = !instance.class.parallel_axes.is_empty();
        for frames in pairs(instance) {
            let [Some(first), Some(second)] = frames.map(|frame| instance.markers.get(frame)) else { continue };
            let axis = joints.z(first);
            let apart = off(&axis, &joints.z(second));
            if keeps_parallel && apart > PARALLEL {
                found.push(Crosswise { element, frames, joint: None, slides: false, angle: apart });
                continue;
            }
            // One that says nothing of its axes is certain to do nothing only along z, across all that slides and does not turn.
            let (acts, least) = match keeps_parallel {
                true => (Acts::of(instance, frames), PARALLEL),
                false if acts_along_z_alone(instance, &joints) => (Acts::SLIDING, FRAC_PI_2 - PARALLEL),
                false => continue,
            };
            let misfit = joints.misfit(element, [first.body, second.body], &axis, (acts, least));
            found.extend(misfit.map(|(joint, slides, angle)| Crosswise {
                element,
                frames,
                joint: Some(joint),
                slides,
                angle,
            }));
        }
    }
    found
}

/// Between two lines, rad.
fn off(one: &Vector3<f64>, other: &Vector3<f64>) -> f64 {
    one.cross(other).norm().min(1.0).asin()
}

/// How an element acts on the motion of two frames.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Acts {
    about: bool,
    along: bool,
    /// Only where bodies slide, and do not turn.
    sliding_only: bool,
}

impl Acts {
    const SLIDING: Self = Self { about: false, along: true, sliding_only: true };

    fn of(instance: &Instance, frames: [usize; 2]) -> Self {
        let recording = &instance.recording;
        let reads = |node: u32, wanted: &dyn Fn(Input) -> bool| {
            let is_wanted = |op: Op| matches!(op, Op::Input(input) if wanted(input));
            operations_behind(recording, [node]).into_iter().any(|(_, op)| is_wanted(op))
        };
        let moves = |input: Input| match input {
            Input::Position { frame, .. } | Input::Velocity { frame, .. } => frames.contains(&(frame as usize)),
            _ => false,
        };
        let [mut about, mut along] = [false; 2];
        for output in &recording.outputs {
            match output.role {
                // Where there is none, a constant stands for it.
                Role::Force(k) if frames.contains(&(k as usize / 3)) => along |= reads(output.node, &|_| true),
                Role::Residual(_) | Role::VelocityResidual(_) | Role::Kinetic => {
                    *(if reads(output.node, &moves) { &mut along } else { &mut about }) = true;
                }
                _ => {}
            }
        }
        Self { about: about || !along, along, sliding_only: false }
    }
}

/// The joints between two bodies, the smaller number first.
struct Beside<'a> {
    model: &'a Model,
    layout: &'a Layout,
    probe: &'a Probe<'a>,
    between: FxHashMap<[Option<usize>; 2], Vec<usize>>,
    neighbours: FxHashMap<Option<usize>, Vec<Option<usize>>>,
    known: FxHashMap<usize, Option<Directions>>,
}

impl<'a> Beside<'a> {
    fn new(model: &'a Model, layout: &'a Layout, probe: &'a Probe<'a>) -> Self {
        let mut between: FxHashMap<[Option<usize>; 2], Vec<usize>> = FxHashMap::default();
        for (joint, instance) in model.elements.iter().enumerate() {
            if let (Kind::Joint, [first, second]) = (instance.class.kind, &instance.markers[..])
                && !layout.rows_of(joint).is_empty()
            {
                between.entry(in_order(first.body, second.body)).or_default().push(joint);
            }
        }
        let mut neighbours: FxHashMap<Option<usize>, Vec<Option<usize>>> = FxHashMap::default();
        for [first, second] in between.keys() {
            neighbours.entry(*first).or_default().push(*second);
            neighbours.entry(*second).or_default().push(*first);
        }
        neighbours.values_mut().for_each(|bodies| bodies.sort_unstable());
        Self { model, layout, probe, between, neighbours, known: FxHashMap::default() }
    }

    fn pose(&self, marker: &Marker) -> FramePose {
        marker.body.map_or((marker.position, marker.rotation), |body| {
            let turn = self.probe.rotations[body];
            (self.probe.positions[body] + turn * marker.position, turn * marker.rotation)
        })
    }

    fn z(&self, marker: &Marker) -> Vector3<f64> {
        self.pose(marker).1.column(2).into_owned()
    }

    /// What the joints between two bodies leave free, each by itself.
    fn directions(&mut self, bodies: [Option<usize>; 2], without: usize) -> Vec<Directions> {
        let (model, layout, probe) = (self.model, self.layout, self.probe);
        let joints = self.between.get(&in_order(bodies[0], bodies[1])).into_iter().flatten();
        let known = &mut self.known;
        joints
            .filter(|joint| **joint != without)
            .filter_map(|joint| known.entry(*joint).or_insert_with(|| directions(model, layout, probe, *joint)).clone())
            .collect()
    }

    /// A joint whose motion is about or along another axis by more than `least`, whether it slides, and the angle.
    fn misfit(
        &mut self,
        element: usize,
        bodies: [Option<usize>; 2],
        axis: &Vector3<f64>,
        (acts, least): (Acts, f64),
    ) -> Option<(usize, bool, f64)> {
        let turned = |found: &(usize, bool, f64)| found.2 > least;
        let direct: Vec<_> =
            self.directions(bodies, element).iter().filter_map(|joint| joint.off(axis, acts)).collect();
        if !direct.is_empty() {
            return direct.into_iter().find(turned);
        }
        // The motion of each against a third body: together they leave no more than both.
        let of = |body: &Option<usize>| self.neighbours.get(body).map_or(&[][..], Vec::as_slice);
        let [of_first, of_second] = bodies.each_ref().map(of);
        for third in if of_first.len() < of_second.len() { of_first } else { of_second }.to_vec() {
            let [first, second] = bodies.map(|body| self.directions([third, body], element));
            let pairs = first.iter().flat_map(|a| second.iter().map(move |b| [a, b]));
            if let Some(found) = pairs.filter_map(|pair| Directions::off_both(pair, axis, acts)).find(turned) {
                return Some(found);
            }
        }
        None
    }
}

/// Two bodies, the smaller number first.
fn in_order(first: Option<usize>, second: Option<usize>) -> [Option<usize>; 2] {
    [first.min(second), first.max(second)]
}

/// The directions in which a joint leaves its bodies free, ground axes.
#[derive(Clone)]
pub(super) struct Directions {
    pub(super) joint: usize,
    /// The one axis that it turns about.
    pub(super) axis: Option<Vector3<f64>>,
    /// The one direction that it slides in without turning.
    pub(super) slide: Option<Vector3<f64>>,
    /// How many axes it turns about.
    turns: usize,
    /// All directions that it slides in without turning, orthonormal.
    slides: Vec<Vector3<f64>>,
}

impl Directions {
    /// The joint, whether it slides, and the angle of an axis off what it leaves free. `None` where that is no question of an axis.
    fn off(&self, axis: &Vector3<f64>, acts: Acts) -> Option<(usize, bool, f64)> {
        if acts.sliding_only && self.turns > 0 {
            return None;
        }
        let about = || Some((self.joint, false, off(axis, &self.axis.or(self.slide)?)));
        let along = || match self.slides.len() {
            0 => Some((self.joint, false, off(axis, &self.axis?))),
            1 | 2 => Some((self.joint, true, off_all(axis, &self.slides))),
            _ => None,
        };
        match (acts.about, acts.along) {
            (true, true) => {
                Some([about()?, along()?]).map(|both| if both[0].2 < both[1].2 { both[0] } else { both[1] })
            }
            (true, false) => about(),
            (false, _) => along(),
        }
    }

    /// The same for what two joints leave free together, each of which turns about one axis at most, or slides.
    fn off_both(pair: [&Self; 2], axis: &Vector3<f64>, acts: Acts) -> Option<(usize, bool, f64)> {
        let most = usize::from(!acts.along);
        if pair.iter().any(|joint| joint.turns > most) || (acts.about && acts.along) {
            return None;
        }
        let own = |joint: &Self| if acts.along { joint.slides.clone() } else { joint.axis.into_iter().collect() };
        let moving = pair.iter().find(|joint| !own(joint).is_empty())?.joint;
        let all: Vec<Vector3<f64>> = pair.into_iter().flat_map(own).collect();
        Some((moving, acts.along, off_all(axis, &all)))
    }
}

/// Between an axis and the plane, or the line, of directions, rad.
fn off_all(axis: &Vector3<f64>, directions: &[Vector3<f64>]) -> f64 {
    let mut basis: Vec<Vector3<f64>> = Vec::new();
    directions.iter().for_each(|direction| extend(&mut basis, *direction, NOTHING));
    across(&basis, *axis).norm().min(1.0).asin()
}

/// What of a vector is across all of an orthonormal basis.
fn across(basis: &[Vector3<f64>], vector: Vector3<f64>) -> Vector3<f64> {
    basis.iter().fold(vector, |rest, known| rest - known * known.dot(&rest))
}

/// Adds to an orthonormal basis what a vector has across it, if that is longer than `least`.
pub(super) fn extend(basis: &mut Vec<Vector3<f64>>, vector: Vector3<f64>, least: f64) {
    let rest = across(basis, vector);
    if rest.norm() > least {
        basis.push(rest.normalize());
    }
}

/// From the motions of one of its bodies that its rows allow while the others stand still.
pub(super) fn directions(model: &Model, layout: &Layout, probe: &Probe<'_>, joint: usize) -> Option<Directions> {
    let rows = layout.rows_of(joint);
    let markers = &model.elements[joint].markers;
    let body = markers.iter().rev().find_map(|marker| marker.body).filter(|_| markers.len() == 2)?;
    let mut matrix = DMatrix::zeros(rows.len(), 6);
    for (row, column, value) in probe.entries(rows.clone()).filter(|(_, column, _)| column / 6 == body) {
        // Lengths in those of the scene, so that all rows are of one size.
        let scale = if column % 6 < 3 { 1.0 } else { probe.length };
        matrix[(row - rows.start, column % 6)] = value / scale;
    }
    for mut row in matrix.row_iter_mut() {
        let size = row.norm();
        row.unscale_mut(if size > 0.0 { size } else { 1.0 });
    }
    let free = SingularValues::of(&matrix)?.null_space(NOTHING);
    let turning = SingularValues::of(&free.rows(3, 3).into_owned())?;
    let rotation: &Matrix3<f64> = &probe.rotations[body];
    let turns = turning.rank(NOTHING);
    let axis = (turns == 1).then(|| rotation * turning.left().fixed_view::<3, 1>(0, 0));
    let sliding = SingularValues::of(&(free.rows(0, 3) * turning.null_space(NOTHING)))?;
    let slides: Vec<Vector3<f64>> =
        (0..sliding.rank(NOTHING)).map(|k| sliding.left().fixed_view::<3, 1>(0, k).into_owned()).collect();
    let slide = Some(&slides).filter(|slides| slides.len() == 1).map(|slides| slides[0]);
    Some(Directions { joint, axis, slide, turns, slides })
}

/// Whether an element pushes along the z axis of its first frame whatever happens, or carries inertia along it alone.
fn acts_along_z_alone(instance: &Instance, joints: &Beside<'_>) -> bool {
    let poses: Vec<FramePose> = instance.markers.iter().map(|marker| joints.pose(marker)).collect();
    let z: Vector3<f64> = poses[0].1.column(2).into_owned();
    let mut acts = false;
    for (k, size) in SIZES.into_iter().enumerate() {
        let found = instance.recording.evaluate(|input| match input {
            Input::Rotation { frame, row, column } => poses[frame as usize].1[(row as usize, column as usize)],
            _ => size * drawn(input, k),
        });
        let mut forces = vec![Vector3::zeros(); poses.len()];
        for (role, value) in found {
            if let Role::Force(k) = role {
                forces[k as usize / 3][k as usize % 3] = value;
            }
        }
        for force in forces.into_iter().filter(|force: &Vector3<f64>| force.iter().all(|part| part.is_finite())) {
            if force.cross(&z).norm() > NOTHING * force.norm() {
                return false;
            }
            acts |= force.norm() > 0.0;
        }
        let position = |frame: u32| {
            Vector3::from_fn(|component, _| drawn(Input::Position { frame, component: component as u32 }, k))
        };
        let elsewhere: Vec<FramePose> = (0..).zip(&poses).map(|(frame, (_, turn))| (position(frame), *turn)).collect();
        if let Some(mass) = mass_at(&instance.recording, &elsewhere, &instance.recording.initial_states) {
            let of_points = mass.fixed_view::<3, 3>(6, 6);
            if (of_points * (Matrix3::identity() - z * z.transpose())).norm() > NOTHING * of_points.norm() {
                return false;
            }
            acts |= of_points.norm() > 0.0;
        }
    }
    acts
}
