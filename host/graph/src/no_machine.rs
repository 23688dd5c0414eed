//! In place of `machine.rs` where the feature `jit` is off: programs are interpreted.

use std::sync::atomic::AtomicBool;

use element_api::Table;

use super::costs::{MachineError, Maker};
use super::tape::Program;

/// What machine code copies itself: nothing.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Copied {
    pub(super) inputs: bool,
    pub(super) outputs: bool,
}

/// There is none of these.
#[derive(Debug)]
pub enum MachineCode {}

impl MachineCode {
    /// Says that there is no machine code.
    ///
    /// # Errors
    /// Always [`MachineError::Unavailable`].
    pub fn compile(_: &Program, _: Maker, _: &AtomicBool) -> Result<Self, MachineError> {
        Err(MachineError::Unavailable)
    }

    /// The same of several programs.
    ///
    /// # Errors
    /// Always [`MachineError::Unavailable`].
    pub fn compile_all(_: &[&Program], _: Maker, _: &AtomicBool) -> Result<Vec<Self>, MachineError> {
        Err(MachineError::Unavailable)
    }

    /// No machine runs what is not made.
    #[must_use]
    pub fn can_assemble() -> bool {
        false
    }

    /// Nor a compiler.
    #[must_use]
    pub fn can_compile() -> bool {
        false
    }

    /// Size of the code, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match *self {}
    }

    pub(super) fn copied(&self) -> Copied {
        match *self {}
    }

    pub(super) fn run(&self, _: usize, _: &[Table], _: &[f64], _: &mut [f64], _: &mut [f64]) {
        match *self {}
    }

    pub(super) fn run_whole(&self, _: &[Table], _: &[f64], _: &mut [f64], _: &mut [f64]) -> bool {
        match *self {}
    }
}
