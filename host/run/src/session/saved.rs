//! [`Saved`]: a run at one of its times, to which it can be brought back.

use serde::{Deserialize, Serialize};

use super::checkpoint::Carried;

/// A run at one of its times: everything that its future depends on. See [`super::Run::save`].
///
/// It is plain data and can be kept in a file by whatever `serde` writes every bit of a number with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// See [`super::Session::fingerprint`]; only runs with the same one can be brought back to it.
    pub(super) fingerprint: String,
    /// The formulation that the state is written in.
    pub(super) formulation: String,
    /// s.
    pub(super) time: f64,
    /// What is integrated.
    pub(super) state: Vec<f64>,
    pub(super) system: SystemState,
}

/// What a simulation has besides the state that is integrated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct SystemState {
    /// Positions and velocities of the bodies in working coordinates, whose Euler parameters have signs; then element states, work.
    pub(super) working: Vec<f64>,
    /// References of the multi-turn angles, rad.
    pub(super) references: Vec<f64>,
    /// Discrete element states, then signals from outside.
    pub(super) discrete: Vec<f64>,
    /// Private memories of opaque elements: their set, their number in it, bytes.
    pub(super) memories: Vec<(usize, usize, Vec<u8>)>,
    /// Sizes, audit, size and number of steps.
    pub(super) carried: Carried,
    /// Accepted states so far.
    pub(super) watched: u64,
    /// Largest kinetic energy so far, J.
    pub(super) largest_kinetic: f64,
    /// Samples so far.
    pub(super) samples: usize,
    /// Events so far.
    #[serde(default)]
    pub(super) events: usize,
    /// Sizes of the last two steps, s.
    pub(super) last_steps: [f64; 2],
}
