//! [`Copies`]: the numbers that functions copy before and behind their operations.

use super::super::super::tape::{Program, Register};
use super::super::Copied;

/// The most outputs that are copied one by one.
const MOST_OUTPUTS: usize = 40;

/// What the functions of a program copy themselves.
pub(in super::super) fn copied(program: &Program) -> Copied {
    Copied { inputs: true, outputs: program.outputs.len() <= MOST_OUTPUTS }
}

/// What the function of a list copies besides.
pub(super) struct Copies<'p> {
    /// Inputs, with their registers, before all else.
    pub(super) inputs: &'p [(u32, Register)],
    /// Registers of angles, at the end, to those from the second on.
    pub(super) angles: (&'p [Register], Register),
    /// Registers of outputs, at the end.
    pub(super) outputs: &'p [Register],
}

impl<'p> Copies<'p> {
    pub(super) fn of(program: &'p Program, list: usize) -> Self {
        let Copied { inputs, outputs } = copied(program);
        let turns = program.stages.get(list).map(|stage| &stage.turns).filter(|turns| turns.lanes > 0);
        Self {
            inputs: if inputs && list == 0 { &program.single_inputs } else { &[] },
            angles: turns.map_or((&[], 0), |turns| (&turns.angles, turns.gathered_at())),
            outputs: if outputs && list == program.stages.len() { &program.outputs } else { &[] },
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.inputs.is_empty() && self.angles.0.is_empty() && self.outputs.is_empty()
    }
}
