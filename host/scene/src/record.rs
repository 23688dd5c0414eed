//! The records of a scene. Every number is SI, every direction a unit vector, every orientation a set of
//! normalised Euler parameters; names are as written and not resolved.

use super::bodies::PointMass;
use super::raw::{RawTable, RawValue, Spanned};
use super::release::ReleaseRecord;
use super::rounding::round_to_15_digits;
use super::shapes::ShapeRecord;
use super::unit_system::UnitSystem;
use super::{Dimension, Formula, Parameters};
use odyn_diagnostics::Source;
use std::ops::Range;
use std::path::PathBuf;

/// A scene as written: what later rooms resolve and compute.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The text that all spans point into.
    pub source: Source,
    /// Files of curves and grids, as named in the scene.
    pub files: Vec<String>,
    /// Title for reports; may be empty.
    pub title: String,
    /// Units of plain numbers and of results.
    pub units: UnitSystem,
    /// Named quantities, already computed.
    pub parameters: Parameters,
    /// Libraries asked for.
    pub plugins: PluginRequest,
    /// What to compute.
    pub simulation: Simulation,
    /// Bodies in the order of the text, without the ground.
    pub bodies: Vec<BodyRecord>,
    /// Joints, then forces, then control elements, each in the order of the text.
    pub elements: Vec<ElementRecord>,
    /// Signals that are given from outside while the scene runs, in the order of the text.
    pub inputs: Vec<ExternalInput>,
    /// Channels asked for, in the order of the text.
    pub outputs: Vec<OutputRecord>,
    /// Derived figures, in the order of the text.
    pub figures: Vec<FigureRecord>,
    /// Comparisons with known results, in the order of the text.
    pub checks: Vec<CheckRecord>,
    /// What the scene verifies, if it is a page of the verification manual.
    pub verification: Option<VerificationRecord>,
}

/// `[plugins]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PluginRequest {
    /// Libraries by name.
    pub libraries: Vec<LibraryRecord>,
    /// Further folders, relative to the scene's folder.
    pub paths: Vec<Spanned<String>>,
}

/// A library asked for: a name, or `{ name = "...", version = "^1.2", sha256 = "..." }`.
#[derive(Clone, Debug, PartialEq)]
pub struct LibraryRecord {
    /// Name, or path of a file.
    pub name: Spanned<String>,
    /// Versions that will do; any where absent.
    pub version: Option<semver::VersionReq>,
    /// SHA-256 of the file that will do, in lower case; any where absent.
    pub sha256: Option<String>,
    /// Named in `trust`: its code may run in the process of the solver.
    pub trusted: bool,
    /// Byte range of the whole entry.
    pub span: Range<usize>,
}

/// `[simulation]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// Byte range of the header.
    pub span: Range<usize>,
    /// Acceleration of gravity, m/s^2, ground axes; zero by default.
    pub gravity: [f64; 3],
    /// Start, s; zero by default.
    pub t_start: f64,
    /// Where the bodies are at the start: `given`, `equilibrium`.
    pub start: Option<Spanned<String>>,
    /// End, s; after the start.
    pub t_end: f64,
    /// When results are wanted.
    pub output: OutputTimes,
    /// Relative tolerance of the integration, positive.
    pub tolerance: Option<f64>,
    /// Integration method.
    pub method: Option<Spanned<String>>,
    /// How the equations are evaluated.
    pub engine: Option<Spanned<String>>,
    /// Which coordinates the equations of motion are written in.
    pub formulation: Option<Spanned<String>>,
    /// Whether parts that share nothing take common steps or each its own: `together`, `apart`.
    pub islands: Option<Spanned<String>>,
    /// Largest step, s, positive.
    pub max_step: Option<f64>,
    /// Steps of this size without error control, s.
    pub fixed_step: Option<f64>,
    /// First step, s, positive.
    pub first_step: Option<f64>,
    /// Number of steps after which to give up, positive.
    pub max_steps: Option<u64>,
    /// Simulated time between two checkpoints of a run that writes results, s, positive.
    pub checkpoint_every: Option<f64>,
    /// Whether poses and loads are written for pictures of the motion.
    pub motion: bool,
    /// What the audit may find; limits that belong to the tolerance where it is left out.
    pub audit_tolerance: Option<AuditTolerance>,
    /// Savings of the plan that are switched off.
    pub without: Vec<Spanned<String>>,
}

/// What the audit of a run may find before its results are suspect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AuditTolerance {
    /// At most this for every measure, positive, relative.
    Limit(f64),
    /// Anything: the audit is not judged.
    None,
}

/// When results are wanted.
#[derive(Clone, Debug, PartialEq)]
pub enum OutputTimes {
    /// At the start, then every so many s, up to the end; positive.
    Step(f64),
    /// At these times, s, ascending.
    Times(Vec<f64>),
}

/// A time at which results are wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleTime {
    /// In the scene's unit, rounded to 15 digits, so that 3 steps of 0.1 give 0.3.
    pub scene: f64,
    /// The same in s.
    pub si: f64,
}

/// Most samples a run may ask for.
pub(super) const MOST_SAMPLES: f64 = 1e7;

impl Simulation {
    /// Times of the checkpoints, ascending, neither start nor end among them; none where none are wanted.
    pub fn checkpoint_times(&self, units: &UnitSystem) -> Vec<f64> {
        let Some(every) = self.checkpoint_every else { return Vec::new() };
        let times = Self { output: OutputTimes::Step(every), ..self.clone() }.sample_times(units);
        let end = self.t_end - 1e-9 * every;
        times.iter().skip(1).map(|time| time.si).filter(|time| *time < end).collect()
    }

    /// Number of [`Simulation::sample_times`], without making them.
    #[must_use]
    pub fn sample_count(&self) -> usize {
        match &self.output {
            OutputTimes::Times(times) => times.len(),
            OutputTimes::Step(step) => self.steps(*step) as usize + 1,
        }
    }

    /// Whole steps between start and end.
    fn steps(&self, step: f64) -> u64 {
        ((self.t_end - self.t_start) / step + 1e-9).floor().min(MOST_SAMPLES) as u64
    }

    /// All times at which results are wanted, ascending. Of a step, the end belongs to them if it is a multiple
    /// to within a billionth of the step.
    pub fn sample_times(&self, units: &UnitSystem) -> Vec<SampleTime> {
        let unit = units.factor(Dimension::TIME);
        match &self.output {
            OutputTimes::Times(times) => {
                times.iter().map(|&si| SampleTime { scene: round_to_15_digits(si / unit), si }).collect()
            }
            OutputTimes::Step(step) => {
                let number = self.steps(*step);
                let start = round_to_15_digits(self.t_start / unit);
                let step = step / unit;
                (0..=number)
                    .map(|k| {
                        let scene = round_to_15_digits(start + step * k as f64);
                        let si = (scene * unit).clamp(self.t_start, self.t_end);
                        SampleTime { scene, si }
                    })
                    .collect()
            }
        }
    }
}

/// `[[body]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyRecord {
    /// Its name.
    pub name: Spanned<String>,
    /// Byte range of the header.
    pub span: Range<usize>,
    /// Mass, kg; absent only if the body is fixed. Not checked here.
    pub mass: Option<Spanned<f64>>,
    /// Inertia tensor about the centre of mass in body axes, kg m^2: xx, yy, zz, xy, yz, zx (entries of the
    /// tensor); absent only if the body is fixed. Not checked here.
    pub inertia: Option<Spanned<[f64; 6]>>,
    /// Centre of mass in the body frame, m.
    pub com: [f64; 3],
    /// Origin of the body frame in ground at the start, m.
    pub position: [f64; 3],
    /// Euler parameters e0, e1, e2, e3 of the body frame in ground at the start, normalised.
    pub orientation: [f64; 4],
    /// Velocity of the origin at the start, m/s, ground axes; `None` where assembly finds it.
    pub velocity: Spanned<[Option<f64>; 3]>,
    /// Angular velocity at the start, rad/s, ground axes; `None` where assembly finds it.
    pub angular_velocity: Spanned<[Option<f64>; 3]>,
    /// True for a body that is part of the ground.
    pub fixed: bool,
    /// A point mass: no rotation, no inertia; no torque may act on it.
    pub particle: bool,
    /// Point masses that are part of the body: mass, kg, and position in the body frame, m.
    pub point_masses: Vec<PointMass>,
    /// What it looks like.
    pub shapes: Vec<ShapeRecord>,
}

impl BodyRecord {
    /// Makes it one of several copies of the body, with an equal share of its mass.
    pub fn share_mass(&mut self, copies: usize) {
        let share = 1.0 / copies as f64;
        self.mass.iter_mut().for_each(|mass| mass.value *= share);
        self.inertia.iter_mut().flat_map(|inertia| &mut inertia.value).for_each(|moment| *moment *= share);
        self.point_masses.iter_mut().for_each(|point| point.mass.value *= share);
    }
}

/// Which of the three tables an element stands in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ElementKind {
    /// `[[joint]]`
    Joint,
    /// `[[force]]`
    Force,
    /// `[[control]]`
    Control,
}

impl ElementKind {
    /// The key of the table: `joint`, `force` or `control`.
    pub fn key(self) -> &'static str {
        match self {
            ElementKind::Joint => "joint",
            ElementKind::Force => "force",
            ElementKind::Control => "control",
        }
    }
}

/// `[[joint]]`, `[[force]]` or `[[control]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct ElementRecord {
    /// The table it stands in.
    pub kind: ElementKind,
    /// Its name.
    pub name: Spanned<String>,
    /// `type`: a short or full type name.
    pub type_name: Spanned<String>,
    /// Names of the bodies it connects, in order; the span is that of the list, or of the header. A force element
    /// with [`ElementRecord::joints`] and any control element may have none.
    pub bodies: Spanned<Vec<Spanned<String>>>,
    /// Joints whose reactions it depends on, in order; force and control elements only.
    pub joints: Vec<Spanned<String>>,
    /// Signals it receives, in the order of the text; force and control elements only.
    pub inputs: Vec<InputRecord>,
    /// When it lets go; joints only.
    pub release: Option<ReleaseRecord>,
    /// Where its frames are; the span is that of the decisive key, or of the header.
    pub placement: Spanned<Placement>,
    /// Parameters as written; its span is that of the value, or of the header.
    pub params: RawTable,
    /// Byte range of the header.
    pub span: Range<usize>,
    /// False for an element that is to be left out.
    pub enabled: bool,
}

/// `[[input]]`: a signal that is given from outside while the scene runs, and stays as it is from one change to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct ExternalInput {
    /// Its name, by which elements take it as a signal.
    pub name: Spanned<String>,
    /// Its value until another is given, SI.
    pub value: f64,
    /// Its dimension.
    pub dimension: Dimension,
    /// The unit that values are given in.
    pub unit: String,
    /// One of these in SI.
    pub factor: f64,
}

/// An entry of `inputs`: `set_point = "1500 rpm"`, `measured = "omega"`.
#[derive(Clone, Debug, PartialEq)]
pub struct InputRecord {
    /// Name of the element's input.
    pub name: Spanned<String>,
    /// What it is fed with.
    pub source: Spanned<InputSource>,
}

/// What an input is fed with.
#[derive(Clone, Debug, PartialEq)]
pub enum InputSource {
    /// The signal of that name: an output, or `ELEMENT.CHANNEL`. Not resolved here.
    Reference(String),
    /// Such a signal times a quantity, which gives a plain number the dimension that is asked for.
    Scaled {
        /// The name of the signal.
        signal: Spanned<String>,
        /// What it is multiplied by: see [`Scene::quantity`].
        gain: RawValue,
    },
    /// A constant: see [`Scene::quantity`] and [`Scene::any_quantity`].
    Value(RawValue),
}

/// Where the frames of an element are. Directions are unit vectors.
#[derive(Clone, Debug, PartialEq)]
pub enum Placement {
    /// In ground at the start. Each list is empty (not given), has one entry (for all frames), or one per
    /// frame.
    Global {
        /// Origins, m.
        points: Vec<[f64; 3]>,
        /// z axes.
        axes: Vec<[f64; 3]>,
        /// Directions near the x axes, never parallel to the z axis.
        x_axes: Vec<[f64; 3]>,
    },
    /// In the frame of each body, one per body.
    Local(Vec<LocalFrame>),
    /// Not given.
    Absent,
}

/// A frame on a body.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalFrame {
    /// Origin in the body frame, m; zero by default.
    pub position: [f64; 3],
    /// z axis in body axes.
    pub axis: Option<[f64; 3]>,
    /// Direction near the x axis in body axes, not parallel to the z axis.
    pub x_axis: Option<[f64; 3]>,
    /// Byte range of the table.
    pub span: Range<usize>,
}

/// `[[output]]`. No word is checked here.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputRecord {
    /// Name of the channel.
    pub name: Spanned<String>,
    /// What to output.
    pub quantity: Spanned<String>,
    /// Body or element it belongs to.
    pub of: Option<Spanned<String>>,
    /// Component of a vector.
    pub component: Option<Spanned<String>>,
    /// Body that a reaction acts on.
    pub on: Option<Spanned<String>>,
    /// Point in body coordinates, m.
    pub point: Option<Spanned<[f64; 3]>>,
    /// Frame whose axes are used: `ground` or a body.
    pub frame: Option<Spanned<String>>,
    /// Channel of an element.
    pub channel: Option<Spanned<String>>,
    /// Byte range of the header.
    pub span: Range<usize>,
}

/// Which figure of a channel is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Take {
    /// The value at the last crossing of another channel, [`FigureRecord::at`].
    At,
    /// The value of largest magnitude, with its sign.
    Peak,
    /// The smallest value.
    Min,
    /// The largest value.
    Max,
    /// The last value.
    Final,
    /// The mean over time.
    Mean,
    /// The root of the mean square over time.
    Rms,
}

/// `[[figure]]`: a number derived from channels, printed beside a published one.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureRecord {
    /// Its name.
    pub name: Spanned<String>,
    /// The channel it is taken from.
    pub channel: Spanned<String>,
    /// Which figure.
    pub take: Take,
    /// True to take the magnitude of the figure.
    pub absolute: bool,
    /// Where, exactly for [`Take::At`].
    pub at: Option<Crossing>,
    /// Channel whose same figure divides this one.
    pub over: Option<Spanned<String>>,
    /// Earlier samples are left out, s.
    pub from: Option<f64>,
    /// Published number in scene units of the channel.
    pub published: Option<f64>,
    /// Unit to print; empty for the channel's own.
    pub unit: Spanned<String>,
    /// Remark to print; may be empty.
    pub note: String,
    /// Byte range of the header.
    pub span: Range<usize>,
}

/// The last crossing of a channel with a value.
#[derive(Clone, Debug, PartialEq)]
pub struct Crossing {
    /// The channel.
    pub channel: Spanned<String>,
    /// The value, whose dimension is the channel's: see [`Scene::quantity`].
    pub equals: RawValue,
    /// The value repeats with this period.
    pub period: Option<RawValue>,
}

/// `[verification]`: makes the scene a page of the verification manual.
#[derive(Clone, Debug, PartialEq)]
pub struct VerificationRecord {
    /// Full names of the elements that it verifies.
    pub elements: Vec<Spanned<String>>,
    /// The problem, the derivation of its solution and its source, as Markdown.
    pub text: String,
    /// The analysis that is judged, where that is not a run.
    pub analysis: Option<AnalysisRecord>,
    /// Numbers that it must find.
    pub numbers: Vec<NumberRecord>,
    /// Byte range of the header.
    pub span: Range<usize>,
}

/// An analysis that a scene is asked for: rooms above know which there are, and their options.
#[derive(Clone, Debug, PartialEq)]
pub struct AnalysisRecord {
    /// Its options, with its name under `analysis`.
    pub question: serde_json::Value,
    /// Byte range of the name.
    pub span: Range<usize>,
}

/// `[[verification.number]]`: what an analysis must find.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberRecord {
    /// Its name, free text.
    pub name: Spanned<String>,
    /// Its place in the answer.
    pub of: Spanned<String>,
    /// What must stand there.
    pub expected: Expected,
    /// Its unit, to be shown.
    pub unit: String,
}

/// What must stand at a place of an answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Expected {
    /// A word.
    Word(String),
    /// A number.
    Value {
        /// A formula of parameters.
        reference: Formula,
        /// Largest allowed magnitude of the difference; not negative.
        tolerance: f64,
    },
}

/// `[[check]]`: a value that must agree with a known one at all samples.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckRecord {
    /// Its name, free text.
    pub name: Spanned<String>,
    /// What kind of quantity is compared.
    pub kind: CheckKind,
    /// The value.
    pub value: Formula,
    /// What it should be.
    pub reference: Reference,
    /// Largest allowed magnitude of the difference, in the unit of the value; not negative.
    pub tolerance: f64,
    /// Earlier samples are left out; scene units.
    pub from: Option<f64>,
    /// Later samples are left out; scene units.
    pub to: Option<f64>,
    /// Byte range of the header.
    pub span: Range<usize>,
}

/// What a check compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CheckKind {
    /// `position`
    Position,
    /// `velocity`, also an angular one
    Velocity,
    /// `acceleration`, also an angular one
    Acceleration,
    /// `orientation`
    Orientation,
    /// `reaction-force`
    ReactionForce,
    /// `reaction-torque`
    ReactionTorque,
    /// `energy`
    Energy,
    /// `other`
    Other,
}

impl CheckKind {
    /// The word of the scene.
    pub fn word(self) -> &'static str {
        match self {
            CheckKind::Position => "position",
            CheckKind::Velocity => "velocity",
            CheckKind::Acceleration => "acceleration",
            CheckKind::Orientation => "orientation",
            CheckKind::ReactionForce => "reaction-force",
            CheckKind::ReactionTorque => "reaction-torque",
            CheckKind::Energy => "energy",
            CheckKind::Other => "other",
        }
    }
}

/// What a checked value should be.
#[derive(Clone, Debug, PartialEq)]
pub enum Reference {
    /// A closed form.
    Formula(Formula),
    /// A column of a table with times, in scene units. Not read here.
    Csv {
        /// The file, relative to the scene's folder.
        path: Spanned<PathBuf>,
        /// The column.
        column: String,
    },
}
