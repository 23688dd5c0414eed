//! In place of `cranelift.rs` where Cranelift is not built in: what the assembler does not know is interpreted.

use std::sync::atomic::AtomicBool;

use super::super::costs::MachineError;
use super::super::tape::Program;
use super::Made;

pub(super) const PIECE: usize = 0;

/// There is none.
pub(super) enum Memory {}

pub(super) fn is_available() -> bool {
    false
}

pub(super) fn make(_: &Program, _: &AtomicBool, _: usize) -> Result<Made<Memory>, MachineError> {
    Err(MachineError::Unavailable)
}
