//! In place of `machine.rs` where the feature `jit` is off: programs are interpreted.

use std::sync::atomic::AtomicBool;

use element_api::Table;

use super::costs::{MachineError, Maker};
use super::tape::Program;

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

    pub(super) fn run(&self, _: usize, _: &[Table], _: &mut [f64]) {
        match *self {}
    }
}
