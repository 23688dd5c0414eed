//! Which results of a list of instructions are read after it.

use super::super::tape::{Instruction, NO_REGISTER, Program};

/// Walks through the lists of a program from the last to the first, and gives for each its number, its instructions, and by
/// register whether it is read after them; `told` may split the list if it keeps that up to date, as Cranelift does.
///
/// # Errors
/// The first that `told` has.
pub(super) fn backwards<E>(
    program: &Program,
    mut told: impl FnMut(usize, &[Instruction], &mut [bool]) -> Result<(), E>,
) -> Result<(), E> {
    let lists: Vec<&[Instruction]> = program.lists().collect();
    let mut live = vec![false; program.registers];
    let outputs = program.outputs.iter().filter(|register| **register != NO_REGISTER);
    outputs.chain(&program.kept).for_each(|register| live[*register as usize] = true);
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
        told(number, list, &mut live)?;
    }
    Ok(())
}
