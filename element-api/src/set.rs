//! [`ElementClass`] and [`ElementSet`]: what the host holds, whether an element is linked in or loaded.
//!
//! A set belongs to one model and holds all its instances of one class. Two models never share a set, so nothing is
//! shared between them.

use std::sync::Arc;
use std::sync::atomic::AtomicU32;

use serde::{Deserialize, Serialize};

use crate::descriptor::Descriptor;
use crate::params::{ParamError, Table};
use crate::recording::Recording;

/// A kind of joint, force or control element that can be instantiated.
pub trait ElementClass: Send + Sync {
    /// Names, parameters, sizes.
    fn descriptor(&self) -> &Descriptor;
    /// An empty set of instances.
    fn new_set(&self) -> Box<dyn ElementSet>;
}

/// The instances of one class in one model.
pub trait ElementSet: Send {
    /// `[create]` The name in the scene of the instance that is added next, for messages. The host's own; it crosses no
    /// interface.
    fn announce(&mut self, name: &str) {
        let _ = name;
    }

    /// Where the number of the instance under evaluation can be read from another thread, if anywhere. The host's own.
    fn progress(&self) -> Option<Arc<AtomicU32>> {
        None
    }

    /// `[create]` Adds an instance and gives its number, counting from 0. The table is complete and in SI units.
    ///
    /// # Errors
    /// [`CreateError::Parameter`] for parameters the element refuses.
    fn add(&mut self, params: &Table) -> Result<usize, CreateError>;

    /// `[create]` The equations of an instance. An opaque element records no equations, only its initial states and which
    /// results it gives (each output refers to operation 0).
    ///
    /// # Errors
    /// When the element panics, or does not set a row or coordinate that it declares.
    fn record(&self, instance: usize) -> Result<Recording, Fault>;

    /// `[hot]` Evaluates the instances numbered in `batch` with plain numbers. The adapters of this crate
    /// allocate only in the first call.
    ///
    /// # Errors
    /// When the element panics or lengths do not fit.
    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault>;

    /// `[between steps]` A step was accepted; opaque elements may change their memory. `inputs` as in [`Batch`].
    ///
    /// # Errors
    /// When the element panics.
    fn accept(&mut self, instance: usize, inputs: &[f64]) -> Result<(), Fault>;

    /// Whether instances hold discrete states that the host lets them compute, between their samples, by [`ElementSet::communicate`]:
    /// models of other tools. The host's own; it crosses no interface.
    fn communicates(&self) -> bool {
        false
    }

    /// `[between steps]` Computes from the last communication point of an instance up to the time `t`, s, and writes what it gives
    /// into its discrete states, which hold what it takes. With `begins` it starts there, which may be asked again while inputs and
    /// outputs settle. No other step is ever repeated. The host's own; it crosses no interface.
    ///
    /// # Errors
    /// What went wrong; the run ends.
    fn communicate(&mut self, instance: usize, t: f64, begins: bool, memory: &mut [f64]) -> Result<(), Fault> {
        let _ = (t, begins, memory);
        Err(Fault { instance, message: "it does not communicate".into() })
    }

    /// `[between steps]` The private memory of an instance.
    ///
    /// # Errors
    /// When the element panics.
    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault>;

    /// `[between steps]` Restores a private memory.
    ///
    /// # Errors
    /// When the element panics or does not know the bytes.
    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault>;
}

/// Something an element did wrong while it was called.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// Which instance.
    pub instance: usize,
    /// What happened, in words: the panic's message and place, or the length that did not fit.
    pub message: String,
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Fault {}

/// Why an instance could not be created.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum CreateError {
    /// The parameters can't be used.
    Parameter(ParamError),
    /// The element failed.
    Fault(String),
}

/// A batch of evaluations of one class.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// Numbers of the instances, in any order.
    pub instances: &'a [u32],
    /// Their inputs, instance after instance, laid out by [`Layout`].
    pub inputs: &'a [f64],
    /// Which results are wanted; the others may be left as they are.
    pub wanted: Wanted,
}

/// Which results of a batch are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Wanted {
    /// Derivatives with respect to the frames and time.
    pub jacobian: bool,
    /// Second derivative along the motion.
    pub second: bool,
}

/// Where inputs and results of an opaque instance lie in its part of a batch.
///
/// Inputs: time; angle references; states; memory; signals; per joint reaction force (3) and torque (3); then per frame
/// position (3), rotation (9, row after row), velocity (3), angular velocity (3).
///
/// Results of a joint, with R = rows used + joint coordinates: values (R); derivatives (R x 6 per frame: shift of the
/// origin in ground directions, rotation about the frame's own axes); derivative with respect to time (R); second
/// derivative along the motion at zero acceleration of all frames (R); angles.
/// Results of a force or (with zeros for what it has not) of a control element: forces (3 per frame); torques (3 per frame); rates; next memory; channels; potential; dissipation;
/// angles. What the element does not give is NaN.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Number of frames.
    pub frames: usize,
    /// Number of angles.
    pub angles: usize,
    /// Number of continuous states.
    pub states: usize,
    /// Number of discrete states.
    pub memory: usize,
    /// Number of signals taken.
    pub signals: usize,
    /// Number of joints whose reactions are taken.
    pub joints: usize,
    /// Rows used plus coordinates of a joint; channels of a force; signals given by a control element.
    pub values: usize,
}

impl Layout {
    /// Numbers per instance in.
    #[must_use]
    pub const fn inputs(&self) -> usize {
        self.frames_at() + 18 * self.frames
    }
    /// Where the first frame begins.
    #[must_use]
    pub const fn frames_at(&self) -> usize {
        1 + self.angles + self.states + self.memory + self.signals + 6 * self.joints
    }
    /// Numbers per instance out, for a joint.
    #[must_use]
    pub const fn joint_results(&self) -> usize {
        self.values * (3 + 6 * self.frames) + self.angles
    }
    /// Numbers per instance out, for a force.
    #[must_use]
    pub const fn force_results(&self) -> usize {
        6 * self.frames + self.states + self.memory + self.values + 2 + self.angles
    }
}
