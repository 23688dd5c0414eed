//! [`Wired`]: a program whose caller has the inputs and wants the outputs in an order of its own.

use std::ops::Range;

use super::compile::in_ranges;
use super::tape::{NO_REGISTER, Program, Register, Sets, Used, Workspace};
use element_api::set::Fault;

/// What becomes an output of a [`Wired`] program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// An output of the program, by number.
    Output(usize),
    /// An entry of the vector given, as it is.
    Entry(usize),
    /// Nothing: it is left as it was.
    Nothing,
}

/// A program that reads most of its inputs from a vector of another order and writes its outputs to one, so that nobody has to
/// copy them. The operations are those of the program, and so are the results, bit for bit.
#[derive(Debug, Clone)]
pub struct Wired {
    program: Program,
    /// Inputs that are in no entry: slot and register.
    given: Vec<(u32, Register)>,
    /// Registers of the outputs that are kept, in their order.
    kept: Vec<Range<usize>>,
}

impl From<Program> for Wired {
    /// All inputs are entries, by their slots, and the outputs are those of the program.
    fn from(program: Program) -> Self {
        Self { program, given: Vec::new(), kept: Vec::new() }
    }
}

impl Wired {
    /// `entry_of` gives the entry of the vector that an input slot of the program is read from, if it is one; `outputs` what becomes
    /// of each entry of the vector of outputs; `kept` are outputs of the program that are asked for one by one ([`Wired::kept`]).
    /// `None` where one of these is among the outputs as well.
    #[must_use]
    pub fn new(
        program: &Program,
        entry_of: impl Fn(usize) -> Option<usize>,
        outputs: &[Source],
        kept: &[usize],
    ) -> Option<Self> {
        let mut passed = Vec::new();
        let registers = outputs.iter().zip(0..).map(|(source, place)| match source {
            Source::Output(output) => program.outputs[*output],
            Source::Entry(entry) => {
                passed.push((*entry as u32, place));
                NO_REGISTER
            }
            Source::Nothing => NO_REGISTER,
        });
        let mut wired = Program {
            id: Program::next_id(),
            outputs: registers.collect(),
            kept: kept.iter().map(|output| program.outputs[*output]).collect(),
            passed,
            inputs: Vec::new(),
            block: 0..0,
            elsewhere: Vec::new(),
            code: None,
            ..program.clone()
        };
        if wired.kept.iter().any(|register| wired.outputs.contains(register)) {
            return None;
        }
        let mut given = Vec::new();
        for (slot, register) in &program.inputs {
            match entry_of(*slot as usize) {
                Some(entry) => wired.inputs.push((entry as u32, *register)),
                None => given.push((*slot, *register)),
            }
        }
        wired.inputs.sort_unstable();
        (wired.input_ranges, wired.single_inputs) = in_ranges(&wired.inputs);
        let beside = |a: &Register, b: &Register| a + 1 == *b;
        let pieces = wired.kept.chunk_by(beside).map(|piece| piece[0] as usize..piece[0] as usize + piece.len());
        Some(Self { kept: pieces.collect(), program: wired, given })
    }

    /// The program, for its counts.
    #[must_use]
    pub fn program(&self) -> &Program {
        &self.program
    }

    /// The program, to be compiled.
    pub fn used<'w>(&'w mut self, workspace: &Workspace, spare: bool) -> Used<'w> {
        Used::new(&mut self.program, workspace.runs(), spare)
    }

    /// The scratch numbers for this program.
    #[must_use]
    pub fn workspace(&self) -> Workspace {
        self.program.workspace()
    }

    /// Evaluates the program; `given` are the inputs of the program it was made from, of which only those are read that are in no
    /// entry. `[hot, no allocation]`
    ///
    /// # Errors
    /// What an opaque element did wrong, with the set it belongs to.
    #[inline(always)]
    pub fn run(
        &self,
        (given, entries): (&[f64], &[f64]),
        sets: &Sets,
        workspace: &mut Workspace,
        outputs: &mut [f64],
    ) -> Result<(), (usize, Fault)> {
        for (slot, register) in &self.given {
            workspace.numbers[*register as usize] = given[*slot as usize];
        }
        self.program.run(entries, sets, workspace, outputs)
    }

    /// The outputs that were kept at the last run, in their order: as many as lie side by side at a time.
    #[inline]
    pub fn kept<'w>(&'w self, workspace: &'w Workspace) -> impl Iterator<Item = &'w [f64]> + 'w {
        self.kept.iter().map(|pieces| &workspace.numbers[pieces.clone()])
    }
}
