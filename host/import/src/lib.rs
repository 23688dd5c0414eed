//! Import: mechanisms of other programs as scenes.
//!
//! - **Takes**: a URDF or MJCF file.
//! - **Gives**: the text of a scene, as a person would write it, and what of the file it does not say.
//! - **May touch**: the file, and the meshes that it names.
//! - **Must not know**: how scenes are read or run. It writes the words of the standard elements, as scenes do.
//!
//! | file | content |
//! |---|---|
//! | `xml.rs` | elements, attributes, numbers, with their places |
//! | `include.rs` | files within files |
//! | `words.rs` | which words the formats have |
//! | `urdf.rs`, `mjcf/` | one format each |
//! | `mechanism.rs` | links, joints, shapes: what both formats say |
//! | `solid.rs` | mass and inertia of shapes and meshes |
//! | `place.rs` | one joint per body; where bodies are at the start |
//! | `write.rs` | the scene |

mod include;
mod mechanism;
mod mjcf;
mod place;
mod solid;
mod urdf;
mod words;
mod write;
mod xml;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

use std::collections::BTreeMap;
use std::path::Path;

use odyn_diagnostics::{Diagnostic, Source, codes, help_for};

use include::Whole;
use mechanism::{Coupling, Joint, Kind, Mechanism};

/// Bytes of a file that are read.
const LONGEST: u64 = 64 << 20;

/// How the first link of a URDF is held; an MJCF file says so itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Base {
    /// On the ground.
    #[default]
    Fixed,
    /// Not at all.
    Free,
}

/// What a coordinate measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// An angle, of a joint that turns.
    Angle,
    /// A length, of a joint that slides.
    Length,
}

/// What a file does not say.
#[derive(Debug, Clone)]
pub struct Options {
    /// How the first link is held.
    pub base: Base,
    /// Density of links whose mass follows from their shapes, kg/m^3.
    pub density: f64,
    /// Coordinates of joints at the start, by their names; rad, m.
    pub pose: BTreeMap<String, f64>,
    /// Their rates, rad/s, m/s.
    pub speeds: BTreeMap<String, f64>,
    /// Joints whose coordinates or rates were given with a unit, and what that measures; others are refused.
    pub measures: Vec<(String, Measure)>,
    /// Whether joints end at their limits.
    pub limits: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            base: Base::Fixed,
            density: 1000.0,
            pose: BTreeMap::new(),
            speeds: BTreeMap::new(),
            measures: Vec::new(),
            limits: true,
        }
    }
}

/// A scene, with what the file says beside it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Imported {
    /// The scene, TOML.
    pub scene: String,
    /// Names of its joints that have a coordinate.
    pub joints: Vec<String>,
    /// Number of its bodies.
    pub bodies: usize,
    /// What could not be carried over, or was decided, in words.
    pub left_out: Vec<String>,
}

/// Why there is no scene, with the text that places point into.
#[derive(Debug, Clone)]
pub struct Refused {
    /// At least one error.
    pub diagnostics: Vec<Diagnostic>,
    /// The file.
    pub source: Source,
}

/// Reads a file and writes it as a scene that will stand in `folder`, which meshes are named relative to.
///
/// # Errors
/// A file that cannot be read, is of neither format, is damaged, or describes no mechanism.
pub fn read(file: &Path, folder: &Path, options: &Options) -> Result<Imported, Box<Refused>> {
    let name = file.display().to_string();
    let text = file_text(file).map_err(|reason| {
        let diagnostics = vec![Diagnostic::error(codes::NOT_IMPORTED, reason)];
        Box::new(Refused { diagnostics, source: Source::new(name.clone(), "") })
    })?;
    from_source(Source::new(name, text), file.parent().unwrap_or(Path::new("")), folder, options)
}

/// The text of a file, or why there is none.
fn file_text(file: &Path) -> Result<String, String> {
    let name = file.display();
    let length = file.metadata().map_err(|error| format!("cannot read {name}: {error}"))?.len();
    if length > LONGEST {
        return Err(format!("{name} is longer than {} MB", LONGEST >> 20));
    }
    let text = std::fs::read_to_string(file).map_err(|error| format!("cannot read {name}: {error}"))?;
    Ok(xml::declared_late(text))
}

/// The same from a text, with the folder that its meshes and included files are relative to.
fn from_source(source: Source, beside: &Path, folder: &Path, options: &Options) -> Result<Imported, Box<Refused>> {
    let whole = Whole::read(source, beside)?;
    from_whole(&whole, beside, folder, options).map_err(|mut diagnostics| {
        diagnostics.iter_mut().for_each(|diagnostic| whole.place(diagnostic));
        Box::new(Refused { diagnostics, source: whole.source })
    })
}

/// The same from a text that has all that it includes.
fn from_whole(whole: &Whole, beside: &Path, folder: &Path, options: &Options) -> Result<Imported, Vec<Diagnostic>> {
    let document = xml::parse(&whole.text).map_err(|error| vec![error])?;
    let mut found = xml::Found::default();
    let root = document.root_element();
    let mut mechanism = match root.tag_name().name() {
        "robot" => urdf::read(root, beside, options, &mut found),
        "mujoco" => mjcf::read(root, beside, options, &mut found),
        _ => return Err(vec![urdf::not_known(root)]),
    };
    let wording = words::Wording::of(root);
    if !found.has_errors() {
        start(&mut mechanism, options, &mut found);
    }
    if !found.has_errors() && mechanism.links.is_empty() {
        let nothing = Diagnostic::error(codes::NOT_IMPORTED, "the file has no link that could move");
        found.diagnostics.push(nothing.at(xml::head(&root), ""));
    }
    if found.has_errors() {
        // What is missing may be there under a name that is misspelt.
        found.diagnostics.extend(wording.unknown.into_iter().map(words::Unknown::noted));
        return Err(found.diagnostics);
    }
    mechanism.left_out.splice(0..0, wording.listed(whole));
    mechanism.left_out.extend(wording.beside());
    if mechanism.links.iter().all(|link| matches!(link.hold, mechanism::Hold::Fixed)) {
        let all = "nothing moves: every link is held on the ground; `--base free` frees the first of a URDF";
        mechanism.left_out.push(all.into());
    }
    Ok(write::scene(place::of_bodies(mechanism), folder))
}

/// Values and speeds of the joints at the start: those that are wanted, and within the limits.
fn start(mechanism: &mut Mechanism, options: &Options, found: &mut xml::Found) {
    let mut outside = Vec::new();
    for joint in mechanism.joints_mut() {
        if !options.limits {
            joint.range = None;
        }
        joint.speed = options.speeds.get(&joint.name).copied().unwrap_or(0.0);
        outside.extend(place_within_limits(joint, options.pose.get(&joint.name).copied()));
    }
    mechanism.left_out.extend(outside);
    let (own, couplings) = mechanism.couplings.drain(..).partition(|coupling| coupling.first == coupling.second);
    mechanism.couplings = couplings;
    let of_itself = |coupling: Coupling| format!("`{}` follows itself: nothing is coupled", coupling.first);
    mechanism.left_out.extend(Vec::into_iter(own).map(of_itself));
    let known: Vec<&str> =
        mechanism.joints().filter(|joint| joint.has_coordinate()).map(|joint| &*joint.name).collect();
    for name in options.pose.keys().chain(options.speeds.keys()).filter(|name| !known.contains(&name.as_str())) {
        let unknown = Diagnostic::error(codes::NOT_IMPORTED, format!("there is no joint `{name}` with a coordinate"));
        found.diagnostics.push(unknown.help_if(help_for(name, &known, "joints")));
    }
    check_measures(mechanism, options, found);
    follow(mechanism, options);
    count_from_the_first_turn(mechanism);
}

/// Refuses angles of joints that slide, and lengths of joints that turn.
fn check_measures(mechanism: &Mechanism, options: &Options, found: &mut xml::Found) {
    for (name, given) in &options.measures {
        let Some(joint) = mechanism.joints().find(|joint| joint.name == *name) else { continue };
        let (what, help) = match (joint.kind, given) {
            (Kind::Slide, Measure::Angle) => (
                "slides: its coordinate is a length, no angle",
                "such as 5cm for --pose, 5cm/s for --speed; plain numbers are in m, m/s",
            ),
            (Kind::Hinge, Measure::Length) => (
                "turns: its coordinate is an angle, no length",
                "such as 30deg for --pose, 30deg/s for --speed; plain numbers are in rad, rad/s",
            ),
            _ => continue,
        };
        let wrong = Diagnostic::error(codes::NOT_IMPORTED, format!("joint `{name}` {what}"));
        found.diagnostics.push(wrong.help(help));
    }
}

/// Sets the coordinate at the start; one that nobody asked for is within the limits, which is said where it matters.
fn place_within_limits(joint: &mut Joint, wanted: Option<f64>) -> Option<String> {
    joint.value = wanted.unwrap_or(joint.reference);
    let (lower, upper) = joint.range?;
    if lower <= joint.value && joint.value <= upper {
        return None;
    }
    if wanted.is_some() {
        joint.range = None;
        return Some(format!("limits of joint `{}`: it begins outside of them", joint.name));
    }
    joint.value = (lower + upper) / 2.0;
    Some(format!(
        "joint `{}` begins at {}, in the middle of its limits: {} is outside of them",
        joint.name,
        write::number(joint.value),
        write::number(joint.reference)
    ))
}

/// Joints that follow others begin where these put them, unless they are given themselves.
fn follow(mechanism: &mut Mechanism, options: &Options) {
    let active: Vec<Coupling> = mechanism.couplings.iter().filter(|coupling| coupling.active).cloned().collect();
    // One that follows may be followed, and stand behind those that do.
    for coupling in active.iter().flat_map(|_| &active) {
        let Some(first) = mechanism.joints().find(|joint| joint.name == coupling.first) else { continue };
        let (value, speed) = (coupling.ratio * first.value + coupling.offset, coupling.ratio * first.speed);
        let Some(second) = mechanism.joints_mut().find(|joint| joint.name == coupling.second) else { continue };
        if !options.pose.contains_key(&second.name) {
            second.value = value;
        }
        if !options.speeds.contains_key(&second.name) {
            second.speed = speed;
        }
    }
}

/// How near to half a turn an angle counts as positive, rad, as where a run starts.
const HALF_TURN: f64 = 1e-6;

/// A scene says where bodies are, not how often they have turned: hinges that begin further than half a turn from zero, or half a
/// turn below it, are counted from as many turns later.
fn count_from_the_first_turn(mechanism: &mut Mechanism) {
    let turn = 2.0 * std::f64::consts::PI;
    let mut shifts = BTreeMap::new();
    for joint in mechanism.joints_mut().filter(|joint| joint.kind == Kind::Hinge) {
        let shift = turn * ((joint.value - HALF_TURN) / turn - 0.5).ceil();
        if shift != 0.0 {
            for angle in [&mut joint.value, &mut joint.reference, &mut joint.relaxed] {
                *angle -= shift;
            }
            joint.range = joint.range.map(|(lower, upper)| (lower - shift, upper - shift));
            shifts.insert(joint.name.clone(), shift);
        }
    }
    for coupling in &mut mechanism.couplings {
        let of = |name: &str| shifts.get(name).copied().unwrap_or(0.0);
        coupling.offset += coupling.ratio * of(&coupling.first) - of(&coupling.second);
    }
    let said = |(name, shift): (&String, &f64)| {
        format!("joint `{name}`: its coordinate is {} rad less than in the file, whole turns", write::number(*shift))
    };
    mechanism.left_out.extend(shifts.iter().map(said));
}
