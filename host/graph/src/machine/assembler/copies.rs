//! [`Copies`]: the numbers that functions copy before and behind their operations.

use super::super::super::tape::{Program, Register, Turns};
use super::super::Copied;

/// What the functions of a program copy themselves.
pub(in super::super) fn copied(program: &Program) -> Copied {
    Copied { inputs: true, outputs: true, whole: program.stages.iter().all(|stage| stage.batches.is_empty()) }
}

/// What belongs to a list besides its operations.
pub(super) struct Copies<'p> {
    /// Inputs, with their registers, before all else.
    pub(super) inputs: &'p [(u32, Register)],
    /// Inputs that are outputs, slot and output, before all else.
    pub(super) passed: &'p [(u32, u32)],
    /// Sines and cosines, the angles of which are gathered at the end.
    pub(super) turns: Option<&'p Turns>,
    /// Registers of outputs, at the end.
    pub(super) outputs: &'p [Register],
}

impl<'p> Copies<'p> {
    pub(super) fn of(program: &'p Program, list: usize) -> Self {
        let Copied { inputs, outputs, .. } = copied(program);
        Self {
            inputs: if inputs && list == 0 { &program.single_inputs } else { &[] },
            passed: if outputs && list == 0 { &program.passed } else { &[] },
            turns: program.stages.get(list).map(|stage| &stage.turns).filter(|turns| turns.lanes > 0),
            outputs: if outputs && list == program.stages.len() { &program.outputs } else { &[] },
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.inputs.is_empty() && self.passed.is_empty() && self.turns.is_none() && self.outputs.is_empty()
    }
}
