//! [`Room`]: what the writer of functions knows of the registers of the workspace.

use super::super::super::tape::{NO_REGISTER, Program};
use super::super::Copied;

/// No vector register that holds numbers; [`super::writer`] has places for it all the same, which say nothing.
pub(super) const NOWHERE: u8 = 15;
/// No output.
pub(super) const NONE: u32 = u32::MAX;

/// What is known of each register of the workspace.
pub(super) struct Room {
    /// The vector register that holds its value.
    pub(super) holder: Vec<u8>,
    /// The output that its value at the end is, the first of several; [`NONE`] where it is none or is not copied.
    pub(super) output: Vec<u32>,
    /// Whether that has been written.
    pub(super) written: Vec<bool>,
    /// Number of registers of the program at hand.
    pub(super) registers: usize,
}

impl Room {
    pub(super) fn new(registers: usize) -> Self {
        assert!(registers < 1 << 28, "offsets fit into 32 bits");
        Self {
            holder: vec![NOWHERE; registers],
            output: vec![NONE; registers],
            written: vec![false; registers],
            registers: 0,
        }
    }

    /// Prepares for the functions of a program.
    pub(super) fn take(&mut self, program: &Program, copied: Copied) {
        assert!(program.outputs.len() < 1 << 28, "offsets fit into 32 bits");
        self.registers = program.registers;
        self.output.fill(NONE);
        self.written.fill(false);
        if copied.outputs {
            for (slot, register) in program.outputs.iter().enumerate().rev() {
                if *register != NO_REGISTER {
                    self.output[*register as usize] = slot as u32;
                }
            }
        }
    }
}
