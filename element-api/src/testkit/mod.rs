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
//! // Recording, derivatives, frame invariance, mobility.
//! testkit::check_joint::<Rod>("");
//! ```
//!
//! Everything here panics with a text that says what failed: it is for tests only.

mod checks;
mod interpreter;
mod setting;

pub use checks::{check_force, check_internal, check_joint, check_power};
pub use interpreter::interpret;
pub use setting::{Random, Setting, on_common_axis, turn};

use crate::adapt;
use crate::descriptor::{Descriptor, Kind};
use crate::element::{Constraint, Force};
use crate::geometry::Vec3;
use crate::params::{ParamSpec, Table};
use crate::recording::{Recording, Role};
use crate::set::{Batch, CreateError, ElementClass, ElementSet, Layout, Wanted};

/// One instance of an element, as the host holds it.
pub struct Probe {
    /// The element's class.
    pub descriptor: Descriptor,
    /// The instance's equations.
    pub recording: Recording,
    set: Box<dyn ElementSet>,
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

    /// An instance of any class; see [`Probe::joint`].
    ///
    /// # Errors
    /// What the element says about the parameters.
    pub fn of(class: &dyn ElementClass, params: &str) -> Result<Self, CreateError> {
        let descriptor = class.descriptor().clone();
        let mut set = class.new_set();
        let instance = set.add(&complete(&descriptor.params, params))?;
        let recording = set.record(instance).map_err(|fault| CreateError::Fault(fault.message))?;
        recording.check(&descriptor.limits()).map_err(CreateError::Fault)?;
        Ok(Self { descriptor, recording, set })
    }

    /// What the joint gives, evaluated with plain numbers.
    ///
    /// # Panics
    /// For a force element, or when the setting does not fit.
    #[must_use]
    pub fn joint_values(&self, setting: &Setting) -> JointValues {
        assert_eq!(self.descriptor.kind, Kind::Joint, "{} is not a joint", self.descriptor.name);
        let rows = self.recording.outputs.iter().filter(|o| matches!(o.role, Role::Residual(_))).count();
        let layout = self.layout(rows + self.descriptor.channels.len());
        let (count, per_row) = (layout.values, 6 * layout.frames);
        let numbers = self.evaluate(setting, layout.joint_results());
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

    /// What the force element gives, evaluated with plain numbers.
    ///
    /// # Panics
    /// For a joint, or when the setting does not fit.
    #[must_use]
    pub fn force_values(&self, setting: &Setting) -> ForceValues {
        assert_eq!(self.descriptor.kind, Kind::Force, "{} is not a force element", self.descriptor.name);
        let layout = self.layout(self.descriptor.channels.len());
        let numbers = self.evaluate(setting, layout.force_results());
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
        self.settle(&mut setting);
        setting
    }

    /// Fills in angle references (the angles themselves) and states (those at the start), as the host does at the start.
    pub fn settle(&self, setting: &mut Setting) {
        setting.references = vec![0.0; self.descriptor.angles];
        setting.states = self.recording.initial_states.clone();
        setting.memory = self.recording.initial_discrete.clone();
        setting.references = match self.descriptor.kind {
            Kind::Joint => self.joint_values(setting).angles,
            Kind::Force => self.force_values(setting).angles,
        };
    }

    fn layout(&self, values: usize) -> Layout {
        Layout {
            frames: self.descriptor.frames.len(),
            angles: self.descriptor.angles,
            states: self.descriptor.states.len(),
            memory: self.recording.initial_discrete.len(),
            values,
        }
    }

    fn evaluate(&self, setting: &Setting, results: usize) -> Vec<f64> {
        let inputs = setting.inputs();
        let wanted = Wanted { jacobian: true, second: true };
        let mut out = vec![f64::NAN; results];
        self.set
            .evaluate(&Batch { instances: &[0], inputs: &inputs, wanted }, &mut out)
            .expect("the setting fits the element");
        out
    }
}

/// The parameters an element gets for a scene's `params`: every default filled in.
///
/// # Panics
/// When the text is not TOML, has keys that the element doesn't know, or numbers outside their ranges.
#[must_use]
pub fn complete(specs: &[ParamSpec], params: &str) -> Table {
    let mut table: Table = params.parse().expect("parameters are TOML");
    for (key, value) in &table {
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
