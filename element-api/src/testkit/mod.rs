//! What an author needs to test an element in unit tests (feature `testkit`): one instance to try out, random settings
//! for it, and checks of what every joint or force must fulfil.
//!
//! ```
//! use element_api::prelude::*;
//! use element_api::testkit;
//! # struct Rod;
//! # impl Element for Rod {
//! #     const NAME: &'static str = "rod";
//! #     const SUMMARY: &'static str = "rod of 1 m";
//! #     const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
//! #     type Parameters = NoParameters;
//! #     fn new(_: NoParameters) -> Result<Self, ParamError> { Ok(Self) }
//! # }
//! # impl Constraint for Rod {
//! #     const ROWS: &'static [&'static str] = &["distance"];
//! #     fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
//! #         rows.push(length(at.frames[1].position - at.frames[0].position) - 1.0);
//! #     }
//! # }
//! // Panics with the report when something is found.
//! testkit::check_joint::<Rod>("");
//!
//! // The same with what the author claims beyond what is usual; and the report as data.
//! let options = testkit::Options { symmetric: Some(true), scleronomic: Some(true), ..Default::default() };
//! let report = testkit::examine_joint_with::<Rod>("", &options);
//! assert!(report.is_sound(), "{report}");
//! assert!(report.examined.contains(&testkit::Check::BodySwap));
//! ```
//!
//! The properties are the variants of [`Check`]; [`Options`] say which of them an element is exempt from, which more its
//! author claims, and where an element is defined that is not defined everywhere. Everything is random but the same in
//! every run.
//!
//! For tests only: mistakes of the caller (parameters that are not TOML, settings that do not fit) panic.

mod acting;
mod assembly;
mod checks;
mod differences;
mod examine;
mod interpreter;
mod joints;
mod report;
mod setting;
mod unknowns;
mod variation;
mod velocity_rows;

pub use checks::{check_control, check_force, check_internal, check_joint, check_power};
pub use examine::{
    examine_class, examine_control, examine_control_with, examine_force, examine_force_with, examine_joint,
    examine_joint_with,
};
pub use interpreter::{interpret, interpret_with};
pub use joints::assembled_setting;
pub use report::{Check, CountAllocations, Finding, MakeSetting, Options, Report};
pub use setting::{Random, Setting, on_common_axis, turn};

use std::cell::RefCell;

use crate::adapt;
use crate::descriptor::{Descriptor, Kind, Named};
use crate::element::{Constraint, Control, Force, Reaction};
use crate::geometry::Vec3;
use crate::params::{FRAME_COUNT, ParamSpec, Table};
use crate::recording::{Recording, Role};
use crate::set::{Batch, CreateError, ElementClass, ElementSet, Layout, Wanted};

/// One instance of an element, as the host holds it.
pub struct Probe {
    /// The element's class.
    pub descriptor: Descriptor,
    /// The instance's equations; results in the order of [`Layout`], then angles, then the pose of a mobility.
    pub recording: Recording,
    set: Box<dyn ElementSet>,
    /// What the last evaluation that failed says.
    fault: RefCell<Option<String>>,
}

impl std::fmt::Debug for Probe {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Probe").field("descriptor", &self.descriptor).field("recording", &self.recording).finish()
    }
}

/// What a joint gives for one setting.
#[derive(Debug, Clone, PartialEq)]
pub struct JointValues {
    /// Rows in use, then joint coordinates.
    pub values: Vec<f64>,
    /// Number of rows in use.
    pub rows: usize,
    /// Per value the derivatives, six per frame: shifts in ground directions, rotations about the frame's own axes.
    pub jacobian: Vec<Vec<f64>>,
    /// Per value the derivative with respect to time, frames held.
    pub time_derivative: Vec<f64>,
    /// Per value the second derivative along the motion, frames unaccelerated.
    pub second: Vec<f64>,
    /// Multi-turn angles, rad.
    pub angles: Vec<f64>,
}

impl JointValues {
    /// The residual rows in use.
    #[must_use]
    pub fn residual(&self) -> &[f64] {
        &self.values[..self.rows]
    }
    /// The joint coordinates.
    #[must_use]
    pub fn coordinates(&self) -> &[f64] {
        &self.values[self.rows..]
    }
}

/// What a force element gives for one setting.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceValues {
    /// Force on the body of each frame, at the frame's origin, N, ground frame.
    pub forces: Vec<Vec3<f64>>,
    /// Torque on the body of each frame, N m, ground frame.
    pub torques: Vec<Vec3<f64>>,
    /// Rates of the continuous states.
    pub rates: Vec<f64>,
    /// Discrete states after the step.
    pub memory: Vec<f64>,
    /// Reported values.
    pub channels: Vec<f64>,
    /// Potential energy, J, if given.
    pub potential: Option<f64>,
    /// Dissipated power, W, if given.
    pub dissipation: Option<f64>,
    /// Multi-turn angles, rad.
    pub angles: Vec<f64>,
}

impl Probe {
    /// A joint with the parameters written as TOML text in SI units; defaults are filled in as the host does.
    ///
    /// # Errors
    /// What the element says about the parameters.
    ///
    /// # Panics
    /// When the text is not TOML, has keys that the element doesn't know, or numbers outside their ranges.
    pub fn joint<T: Constraint>(params: &str) -> Result<Self, CreateError> {
        Self::of(adapt::joint::<T>().as_ref(), params)
    }

    /// A force element; see [`Probe::joint`].
    ///
    /// # Errors
    /// What the element says about the parameters.
    pub fn force<T: Force>(params: &str) -> Result<Self, CreateError> {
        Self::of(adapt::force::<T>().as_ref(), params)
    }

    /// A control element; see [`Probe::joint`].
    ///
    /// # Errors
    /// What the element says about the parameters.
    pub fn control<T: Control>(params: &str) -> Result<Self, CreateError> {
        Self::of(adapt::control::<T>().as_ref(), params)
    }

    /// An instance of any class; see [`Probe::joint`].
    ///
    /// # Errors
    /// What the element says about the parameters.
    pub fn of(class: &dyn ElementClass, params: &str) -> Result<Self, CreateError> {
        Self::from_table(class, &complete(&class.descriptor().params, params))
    }

    fn from_table(class: &dyn ElementClass, params: &Table) -> Result<Self, CreateError> {
        // As many frames as the parameters say; the fewest where they do not.
        let count = params.get(FRAME_COUNT).and_then(toml::Value::as_integer);
        let count = count.and_then(|count| usize::try_from(count).ok()).unwrap_or(class.descriptor().frames.len());
        let mut set = class.new_set();
        let during = |what: &str, text: String| {
            CreateError::Fault(if crate::fence::is_panic(&text) { format!("{what} {text}") } else { text })
        };
        let instance = set.add(params).map_err(|error| match error {
            CreateError::Fault(text) => during("`new`", text),
            refused => refused,
        })?;
        let mut recording = set.record(instance).map_err(|fault| during("recording its equations", fault.message))?;
        // The number is one that the element takes, as it was added.
        let descriptor = class.descriptor().with_frames(count);
        recording.check(&descriptor.limits()).map_err(CreateError::Fault)?;
        let flexible = recording.flexible() as u32;
        recording.outputs.sort_by_key(|output| place(output.role, flexible));
        Ok(Self { descriptor, recording, set, fault: RefCell::new(None) })
    }

    /// What the evaluation that failed says, once.
    fn take_fault(&self) -> Option<String> {
        self.fault.borrow_mut().take()
    }

    /// What the joint gives, evaluated with plain numbers.
    ///
    /// # Panics
    /// For a force element, or when the setting does not fit.
    #[must_use]
    pub fn joint_values(&self, setting: &Setting) -> JointValues {
        assert_eq!(self.descriptor.kind, Kind::Joint, "{} is not a joint", self.descriptor.name);
        let rows = self.rows();
        let layout = self.layout();
        let (count, per_row) = (layout.values, 6 * layout.frames);
        let numbers = self.raw(setting);
        let (values, rest) = numbers.split_at(count);
        let (jacobian, rest) = rest.split_at(count * per_row);
        let (time_derivative, rest) = rest.split_at(count);
        let (second, angles) = rest.split_at(count);
        JointValues {
            values: values.to_vec(),
            rows,
            jacobian: jacobian.chunks(per_row).map(<[f64]>::to_vec).collect(),
            time_derivative: time_derivative.to_vec(),
            second: second.to_vec(),
            angles: angles.to_vec(),
        }
    }

    /// Rows in use, then joint coordinates; no derivatives.
    fn joint_plain(&self, setting: &Setting) -> Vec<f64> {
        let mut numbers = self.evaluate(setting, Wanted { jacobian: false, second: false });
        numbers.truncate(self.layout().values);
        numbers
    }

    /// Angles, then coordinates or channels; those that are not in rad as not-a-number.
    fn angles_and_results(&self, setting: &Setting) -> Vec<f64> {
        let (mut angles, results) = match self.descriptor.kind {
            Kind::Joint => {
                let numbers = self.evaluate(setting, Wanted { jacobian: false, second: false });
                let (values, rest) = numbers.split_at(self.layout().values);
                (rest[rest.len() - self.descriptor.angles..].to_vec(), values[self.rows()..].to_vec())
            }
            Kind::Force | Kind::Control => {
                let found = self.force_values(setting);
                (found.angles, found.channels)
            }
        };
        let in_rad = self.descriptor.channels.iter().map(|channel| channel.unit == "rad");
        angles.extend(results.iter().zip(in_rad).map(|(value, in_rad)| if in_rad { *value } else { f64::NAN }));
        angles
    }

    /// What the force or control element gives, evaluated with plain numbers.
    ///
    /// # Panics
    /// For a joint, or when the setting does not fit.
    #[must_use]
    pub fn force_values(&self, setting: &Setting) -> ForceValues {
        assert_ne!(self.descriptor.kind, Kind::Joint, "{} is a joint", self.descriptor.name);
        let layout = self.layout();
        let numbers = self.raw(setting);
        let vectors = |list: &[f64]| list.chunks(3).map(Vec3::from_column_slice).collect();
        let given = |x: f64| if x.is_nan() { None } else { Some(x) };
        let (forces, rest) = numbers.split_at(3 * layout.frames);
        let (torques, rest) = rest.split_at(3 * layout.frames);
        let (rates, rest) = rest.split_at(layout.states);
        let (memory, rest) = rest.split_at(layout.memory);
        let (channels, rest) = rest.split_at(layout.values);
        ForceValues {
            forces: vectors(forces),
            torques: vectors(torques),
            rates: rates.to_vec(),
            memory: memory.to_vec(),
            channels: channels.to_vec(),
            potential: given(rest[0]),
            dissipation: given(rest[1]),
            angles: rest[2..].to_vec(),
        }
    }

    /// All results of the recording, evaluated operation by operation. `coordinates` are those of the joint's mobility.
    ///
    /// # Panics
    /// When the setting does not fit.
    #[must_use]
    pub fn recorded(&self, setting: &Setting, coordinates: &[f64]) -> Vec<(Role, f64)> {
        interpret(&self.recording, setting, coordinates)
    }

    /// A random setting of this element, its angle references at the angles.
    #[must_use]
    pub fn random_setting(&self, random: &mut Random) -> Setting {
        let mut setting = Setting::at_rest((0..self.descriptor.frames.len()).map(|_| random.frame()).collect());
        setting.time = random.between(0.0, 1.0);
        setting.twists = setting.frames.iter().map(|_| random.twist()).collect();
        setting.signals = self.descriptor.inputs.iter().map(|_| random.between(-1.0, 1.0)).collect();
        let reaction = |_: &Named| Reaction { force: random.vector(1.0), torque: random.vector(1.0) };
        setting.reactions = self.descriptor.joints.iter().map(reaction).collect();
        self.settle(&mut setting);
        setting
    }

    /// Fills in angle references (the angles themselves) and states (those at the start), as the host does at the start.
    /// Signals and reactions that are not given take their defaults, or zero.
    pub fn settle(&self, setting: &mut Setting) {
        let given = setting.signals.len().min(self.descriptor.inputs.len());
        setting.signals.extend(self.descriptor.inputs[given..].iter().map(|input| input.default.unwrap_or(0.0)));
        let nothing = Reaction { force: Vec3::zeros(), torque: Vec3::zeros() };
        setting.reactions.resize(self.descriptor.joints.len(), nothing);
        setting.references = vec![0.0; self.descriptor.angles];
        setting.states = self.recording.initial_states.clone();
        // Plain numbers have the unknowns behind the states, the last one first.
        setting.states.extend(self.recording.guesses().into_iter().rev());
        setting.memory = self.recording.initial_discrete.clone();
        self.refer(setting);
    }

    /// The angles become the references, as the host does after a step.
    fn refer(&self, setting: &mut Setting) {
        let angles = self.angles_and_results(setting);
        for (reference, angle) in setting.references.iter_mut().zip(angles) {
            // An angle that this instance does not compute.
            if !angle.is_nan() {
                *reference = angle;
            }
        }
    }

    /// Number of rows in use.
    fn rows(&self) -> usize {
        self.recording.outputs.iter().filter(|output| matches!(output.role, Role::Residual(_))).count()
    }

    /// Where inputs and results of the instance lie in a batch.
    #[must_use]
    pub fn layout(&self) -> Layout {
        let rows = if self.descriptor.kind == Kind::Joint { self.rows() } else { 0 };
        Layout {
            frames: self.descriptor.frames.len(),
            angles: self.descriptor.angles,
            states: self.recording.initial_states.len() + self.recording.unknowns(),
            memory: self.recording.initial_discrete.len(),
            signals: self.descriptor.inputs.len(),
            joints: self.descriptor.joints.len(),
            values: rows + self.descriptor.channels.len(),
        }
    }

    /// Room for all results, filled with what is not a number, so that a result that is not written is seen.
    fn room(&self) -> Vec<f64> {
        let layout = self.layout();
        let joint = self.descriptor.kind == Kind::Joint;
        vec![f64::NAN; if joint { layout.joint_results() } else { layout.force_results() }]
    }

    /// All results as they lie in a batch.
    fn raw(&self, setting: &Setting) -> Vec<f64> {
        self.evaluate(setting, Wanted { jacobian: true, second: true })
    }

    fn evaluate(&self, setting: &Setting, wanted: Wanted) -> Vec<f64> {
        let inputs = setting.inputs();
        let mut out = self.room();
        if let Err(fault) = self.set.evaluate(&Batch { instances: &[0], inputs: &inputs, wanted }, &mut out) {
            *self.fault.borrow_mut() = Some(fault.message.clone());
            panic!("{} fails, or the setting does not fit it: {fault}", self.descriptor.name);
        }
        out
    }
}

/// Where a result stands among those of a recording, as [`Layout`] has them: an element in C gives them in any order.
fn place(role: Role, flexible: u32) -> (u8, Role) {
    // Forces on flexible coordinates stand where the rates of their velocities would.
    let role = if let Role::FlexibleForce(k) = role { Role::StateRate(flexible + k) } else { role };
    let group = match role {
        Role::Angle(_) => 1,
        Role::PosePosition(_) | Role::PoseRotation(_) => 2,
        _ => 0,
    };
    (group, role)
}

/// The parameters an element gets for a scene's `params`: every default filled in.
///
/// # Panics
/// When the text is not TOML, has keys that the element doesn't know, or numbers outside their ranges.
#[must_use]
pub fn complete(specs: &[ParamSpec], params: &str) -> Table {
    let mut table: Table = params.parse().expect("parameters are TOML");
    for (key, value) in table.iter().filter(|(key, _)| *key != FRAME_COUNT) {
        let spec = specs.iter().find(|s| s.name == *key).unwrap_or_else(|| panic!("unknown parameter {key}"));
        let number = value.as_float().or_else(|| value.as_integer().map(|i| i as f64));
        assert!(number.is_none_or(|x| spec.contains(x)), "{key} = {value} must be {}", spec.range_text());
    }
    for spec in specs {
        if let (Some(default), false) = (&spec.default, table.contains_key(&spec.name)) {
            table.insert(spec.name.clone(), default.clone());
        }
    }
    table
}
