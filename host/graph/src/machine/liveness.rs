//! Which results of a list of instructions are read after it.

use super::super::tape::{Instruction, Program, Register};

/// The instructions of a program are its own work; that they stay within it is what the machine code relies on.
pub(super) fn check(instructions: &[Instruction], program: &Program) {
    let within = |register: Register| assert!((register as usize) < program.registers, "a register too many");
    for instruction in instructions {
        within(instruction.result());
        instruction.operands(within);
        if let Instruction::Table(_, _, table, _) = instruction {
            assert!((*table as usize) < program.tables.len(), "a table too many");
        }
    }
}

/// Walks through the lists of a program from the last to the first, and tells for each its number, its instructions, and by
/// register whether it is read after them; `told` may split the list if it keeps that up to date, as [`before`] does.
///
/// # Errors
/// The first that `told` has.
pub(super) fn backwards<E>(
    program: &Program,
    mut told: impl FnMut(usize, &[Instruction], &mut [bool]) -> Result<(), E>,
) -> Result<(), E> {
    let lists: Vec<&[Instruction]> = program.lists().collect();
    let mut live = vec![false; program.registers];
    program.outputs.iter().for_each(|register| live[*register as usize] = true);
    for (number, list) in lists.iter().enumerate().rev() {
        // A stage's list is followed by its sines, cosines and calls.
        if let Some(stage) = program.stages.get(number) {
            stage.turns.results().for_each(|register| live[register as usize] = false);
            stage.turns.angles.iter().for_each(|register| live[*register as usize] = true);
            for batch in &stage.batches {
                batch.results.iter().flatten().for_each(|register| live[*register as usize] = false);
            }
            for batch in &stage.batches {
                batch.arguments.iter().for_each(|register| live[*register as usize] = true);
            }
        }
        check(list, program);
        told(number, list, &mut live)?;
    }
    Ok(())
}

/// Which instructions must leave their result in the workspace: the last ones to write a register that is read later.
pub(super) fn stored(instructions: &[Instruction], live_after: &[bool]) -> Vec<bool> {
    let mut wanted = live_after.to_vec();
    let mut stored: Vec<bool> = instructions
        .iter()
        .rev()
        .map(|instruction| std::mem::take(&mut wanted[instruction.result() as usize]))
        .collect();
    stored.reverse();
    stored
}

/// Turns the registers read after the instructions into those read by them or after.
pub(super) fn before(instructions: &[Instruction], live: &mut [bool]) {
    for instruction in instructions.iter().rev() {
        live[instruction.result() as usize] = false;
        instruction.operands(|register| live[register as usize] = true);
    }
}
