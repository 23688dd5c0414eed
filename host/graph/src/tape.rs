//! [`Program`]: a part of the graph in running order, and the interpreter that runs it.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use element_api::Table;
use element_api::set::{Batch, ElementSet, Fault, Wanted};

use super::interpreter::interpret;
use super::machine::{Copied, MachineCode};
use super::turn;

/// A register: an index into the workspace's numbers.
pub(super) type Register = u32;
/// None.
pub(super) const NO_REGISTER: Register = Register::MAX;

/// One instruction: the register that receives the result, then the operands. Large scenes have millions of them: those that need more
/// than sixteen bytes, which are few, have the rest elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Instruction {
    Add(Register, Register, Register),
    Sub(Register, Register, Register),
    Mul(Register, Register, Register),
    Div(Register, Register, Register),
    Neg(Register, Register),
    Sqrt(Register, Register),
    Sin(Register, Register),
    Cos(Register, Register),
    /// The sine; a [`Instruction::Turned`] of the same number follows.
    Turn(Register, Register),
    /// The cosine, which came out of the [`Instruction::Turn`] before.
    Turned(Register, Register),
    Atan2(Register, Register, Register),
    Exp(Register, Register),
    Ln(Register, Register),
    Tanh(Register, Register),
    Powi(Register, Register, i32),
    /// The operand and the exponent.
    Powf(Register, Box<(Register, f64)>),
    Select(Register, Box<[Register; 4]>),
    /// The operand, which table, the order of its derivative.
    Table(Register, Register, u32, u16),
}

const _: () = assert!(size_of::<Instruction>() == 16);

#[cfg(feature = "jit")]
impl Instruction {
    /// The register that receives the result.
    pub(super) fn result(&self) -> Register {
        match *self {
            Self::Add(d, ..) | Self::Sub(d, ..) | Self::Mul(d, ..) | Self::Div(d, ..) | Self::Atan2(d, ..) => d,
            Self::Neg(d, _) | Self::Sqrt(d, _) | Self::Sin(d, _) | Self::Cos(d, _) => d,
            Self::Turn(d, _) | Self::Turned(d, _) => d,
            Self::Exp(d, _) | Self::Ln(d, _) | Self::Tanh(d, _) => d,
            Self::Powi(d, ..) | Self::Powf(d, ..) | Self::Select(d, _) | Self::Table(d, ..) => d,
        }
    }

    /// Calls `read` with each register that is read.
    pub(super) fn operands(&self, mut read: impl FnMut(Register)) {
        match *self {
            Self::Add(_, a, b)
            | Self::Sub(_, a, b)
            | Self::Mul(_, a, b)
            | Self::Div(_, a, b)
            | Self::Atan2(_, a, b) => {
                read(a);
                read(b);
            }
            Self::Neg(_, a) | Self::Sqrt(_, a) | Self::Sin(_, a) | Self::Cos(_, a) => read(a),
            Self::Turn(_, a) | Self::Turned(_, a) => read(a),
            Self::Exp(_, a) | Self::Ln(_, a) | Self::Tanh(_, a) => read(a),
            Self::Powi(_, a, _) | Self::Table(_, a, ..) => read(a),
            Self::Powf(_, ref power) => read(power.0),
            Self::Select(_, ref all) => all.iter().copied().for_each(read),
        }
    }
}

/// Opaque instances of one set that are evaluated in one call.
#[derive(Debug, Clone)]
pub(super) struct BatchPlan {
    pub(super) set: usize,
    pub(super) instances: Vec<u32>,
    pub(super) wanted: Wanted,
    pub(super) arguments: Vec<Register>,
    /// Register of each result of each instance; `None` where nothing uses it.
    pub(super) results: Vec<Option<Register>>,
}

/// Sines and cosines that are computed at once.
#[derive(Debug, Clone, Default)]
pub(super) struct Turns {
    pub(super) angles: Vec<Register>,
    /// Register of the first sine; the others follow, then the cosines from `first + lanes` on. Before them, from `first - lanes` on,
    /// the angles are gathered; what makes them up to whole vectors is zero.
    pub(super) first: Register,
    /// Number of angles, made up to whole vectors.
    pub(super) lanes: usize,
    /// How many of the sines and cosines are used.
    pub(super) used: usize,
}

impl Turns {
    /// The registers of all results.
    #[cfg(feature = "jit")]
    pub(super) fn results(&self) -> impl Iterator<Item = Register> {
        self.first..self.first + 2 * self.lanes as Register
    }

    /// Where the angles are gathered: the first register.
    pub(super) fn gathered_at(&self) -> Register {
        self.first - self.lanes as Register
    }

    /// Computes them; the angles are `gathered` already, or that is done here. `[hot, no allocation]`
    fn run(&self, numbers: &mut [f64], gathered: bool) {
        if self.lanes == 0 {
            return;
        }
        let from = self.gathered_at() as usize;
        if !gathered {
            for (place, register) in self.angles.iter().enumerate() {
                numbers[from + place] = numbers[*register as usize];
            }
        }
        let (angles, results) = numbers[from..][..3 * self.lanes].split_at_mut(self.lanes);
        let (sines, cosines) = results.split_at_mut(self.lanes);
        turn::all(angles, sines, cosines);
    }
}

/// Operations, then sines, cosines and calls that need them and none of which needs another.
#[derive(Debug, Clone)]
pub(super) struct Stage {
    pub(super) operations: Arc<Vec<Instruction>>,
    pub(super) turns: Turns,
    pub(super) batches: Vec<BatchPlan>,
}

/// Operations in running order, constant. Numbers live in a [`Workspace`]. Copies have their operations in common.
#[derive(Debug, Clone)]
pub struct Program {
    pub(super) id: u64,
    pub(super) constants: Vec<f64>,
    /// The inputs in use, by their slots in the graph.
    pub(super) taken: Vec<u32>,
    /// Slot of each input in use, ascending, and its register.
    pub(super) inputs: Vec<(u32, Register)>,
    /// The same, many side by side: first slot, first register, length; and the others.
    pub(super) input_ranges: Vec<(u32, Register, u32)>,
    pub(super) single_inputs: Vec<(u32, Register)>,
    pub(super) stages: Vec<Stage>,
    pub(super) after_calls: Arc<Vec<Instruction>>,
    /// By output; [`NO_REGISTER`] for those that no register becomes ([`super::Wired`]).
    pub(super) outputs: Arc<[Register]>,
    /// Inputs that are outputs as they are: slot, output.
    pub(super) passed: Vec<(u32, u32)>,
    /// Registers that are read after a run, none of them an output.
    pub(super) kept: Vec<Register>,
    /// Registers of all outputs in their order, where there are many: what is computed for an output is computed into its own.
    pub(super) block: Range<usize>,
    /// Those of them that are in another register: constants, inputs, results of calls, and what is an output twice.
    pub(super) elsewhere: Vec<(u32, Register)>,
    pub(super) registers: usize,
    pub(super) tables: Vec<Table>,
    /// What runs instead of the interpreter, once there is any.
    pub(super) code: Option<Arc<MachineCode>>,
}

/// Programs that were made so far.
static PROGRAMS: AtomicU64 = AtomicU64::new(0);

/// The scratch numbers of one program.
#[derive(Debug, Clone)]
pub struct Workspace {
    pub(super) numbers: Vec<f64>,
    call_inputs: Vec<f64>,
    call_results: Vec<f64>,
    runs: u64,
}

impl Workspace {
    /// How often a program was run with it.
    #[must_use]
    pub fn runs(&self) -> u64 {
        self.runs
    }
}

/// A program in use.
pub struct Used<'a> {
    /// The program.
    pub program: &'a mut Program,
    /// How often it has been run.
    pub runs: u64,
    /// Whether it stands in for another one where that fails, and may never be run.
    pub spare: bool,
    /// Whether every sample of results runs it.
    pub sampled: bool,
    /// Whether every step runs it, at each of its evaluations or once.
    pub stepped: bool,
}

impl<'a> Used<'a> {
    /// One that samples have nothing to do with.
    #[must_use]
    pub fn new(program: &'a mut Program, runs: u64, spare: bool) -> Self {
        Self { program, runs, spare, sampled: false, stepped: false }
    }

    /// The same, run by every sample unless it is a spare one.
    #[must_use]
    pub fn by_samples(self) -> Self {
        Self { sampled: !self.spare, ..self }
    }

    /// The same, run by every step unless it is a spare one.
    #[must_use]
    pub fn by_steps(self) -> Self {
        Self { stepped: !self.spare, ..self }
    }
}

/// Access to the opaque elements of a model while a program runs.
pub type Sets = [Box<dyn ElementSet>];

impl Program {
    /// The scratch numbers for this program.
    #[must_use]
    pub fn workspace(&self) -> Workspace {
        let mut numbers = vec![0.0; self.registers];
        numbers[..self.constants.len()].copy_from_slice(&self.constants);
        let largest = |f: fn(&BatchPlan) -> usize| self.batches().map(f).max().unwrap_or(0);
        Workspace {
            numbers,
            call_inputs: vec![0.0; largest(|b| b.arguments.len())],
            call_results: vec![0.0; largest(|b| b.results.len())],
            runs: 0,
        }
    }

    /// The lists of operations: one per stage, then the one after all calls.
    #[cfg(feature = "jit")]
    pub(super) fn lists(&self) -> impl Iterator<Item = &[Instruction]> {
        self.stages.iter().map(|stage| &stage.operations[..]).chain([&self.after_calls[..]])
    }

    /// An id that no program has yet.
    pub(super) fn next_id() -> u64 {
        PROGRAMS.fetch_add(1, Ordering::Relaxed)
    }

    /// The same operations with other constants and tables, as many of each: a program of its own, without machine code.
    pub(super) fn with_numbers(&self, constants: Vec<f64>, tables: Vec<Table>) -> Self {
        assert_eq!(constants.len(), self.constants.len(), "constants of another program");
        Self { id: Self::next_id(), constants, tables, code: None, ..self.clone() }
    }

    /// Tells it and its copies from all other programs.
    #[must_use]
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Runs machine code that was made from this program from now on, instead of interpreting it. Results stay the same,
    /// bit for bit.
    pub fn install(&mut self, code: Arc<MachineCode>) {
        self.code = Some(code);
    }

    /// Whether machine code is run.
    #[must_use]
    pub fn is_machine_code(&self) -> bool {
        self.code.is_some()
    }

    /// Runs list number `list`, by machine code where there is any.
    #[inline]
    fn run_list(
        &self,
        list: usize,
        operations: &[Instruction],
        inputs: &[f64],
        numbers: &mut [f64],
        outputs: &mut [f64],
    ) {
        match &self.code {
            Some(code) => code.run(list, &self.tables, inputs, numbers, outputs),
            None => interpret(operations, &self.tables, numbers),
        }
    }

    fn batches(&self) -> impl Iterator<Item = &BatchPlan> {
        self.stages.iter().flat_map(|stage| &stage.batches)
    }

    /// Number of operations run per evaluation.
    #[must_use]
    pub fn operations(&self) -> usize {
        self.listed() + self.stages.iter().map(|stage| stage.turns.used).sum::<usize>()
    }

    /// Number of these that machine code would run: sines and cosines that are computed at once are none of them.
    #[must_use]
    pub fn listed(&self) -> usize {
        self.stages.iter().map(|stage| stage.operations.len()).sum::<usize>() + self.after_calls.len()
    }

    /// Number of calls of opaque elements per evaluation.
    #[must_use]
    pub fn calls(&self) -> usize {
        self.batches().count()
    }

    /// The least length of its inputs.
    #[cfg(feature = "jit")]
    pub(super) fn slots(&self) -> usize {
        let read = self.inputs.iter().chain(&self.passed).map(|(slot, _)| *slot as usize + 1);
        read.max().unwrap_or(0)
    }

    /// Number of outputs.
    #[must_use]
    pub fn output_count(&self) -> usize {
        self.outputs.len()
    }

    /// Whether any output depends on an input in the given range of slots.
    #[must_use]
    pub fn uses_inputs(&self, slots: Range<usize>) -> bool {
        self.taken.iter().any(|slot| slots.contains(&(*slot as usize)))
    }

    /// Number of inputs in the given range of slots that any output depends on.
    #[must_use]
    pub fn input_count(&self, slots: Range<usize>) -> usize {
        self.taken.iter().filter(|slot| slots.contains(&(**slot as usize))).count()
    }

    /// Runs its lists one after the other, with sines, cosines and calls between them. `[hot, no allocation]`
    fn run_lists(
        &self,
        (inputs, sets): (&[f64], &Sets),
        workspace: &mut Workspace,
        outputs: &mut [f64],
        copied: Copied,
    ) -> Result<(), (usize, Fault)> {
        let numbers = &mut workspace.numbers[..];
        for (list, stage) in self.stages.iter().enumerate() {
            self.run_list(list, &stage.operations, inputs, numbers, outputs);
            stage.turns.run(numbers, copied.inputs);
            for batch in &stage.batches {
                let given = &mut workspace.call_inputs[..batch.arguments.len()];
                for (slot, register) in given.iter_mut().zip(&batch.arguments) {
                    *slot = numbers[*register as usize];
                }
                let found = &mut workspace.call_results[..batch.results.len()];
                // A result the element forgets to write must not look like a number.
                found.fill(f64::NAN);
                let call = Batch { instances: &batch.instances, inputs: given, wanted: batch.wanted };
                sets[batch.set].evaluate(&call, found).map_err(|fault| (batch.set, fault))?;
                for (value, register) in found.iter().zip(&batch.results) {
                    if let Some(register) = register {
                        numbers[*register as usize] = *value;
                    }
                }
            }
        }
        self.run_list(self.stages.len(), &self.after_calls, inputs, numbers, outputs);
        Ok(())
    }

    /// Evaluates the program. `[hot, no allocation]`
    ///
    /// # Errors
    /// What an opaque element did wrong, with the set it belongs to.
    #[inline(always)]
    pub fn run(
        &self,
        inputs: &[f64],
        sets: &Sets,
        workspace: &mut Workspace,
        outputs: &mut [f64],
    ) -> Result<(), (usize, Fault)> {
        workspace.runs += 1;
        if let Some(code) = &self.code {
            if !self.input_ranges.is_empty() {
                self.load_ranges(inputs, &mut workspace.numbers);
            }
            if code.run_whole(&self.tables, inputs, &mut workspace.numbers, outputs) {
                return Ok(());
            }
        }
        self.run_in_parts(inputs, sets, workspace, outputs)
    }

    /// Copies inputs that lie side by side to their registers.
    #[inline(never)]
    fn load_ranges(&self, inputs: &[f64], numbers: &mut [f64]) {
        for &(slot, register, length) in &self.input_ranges {
            let given = &inputs[slot as usize..][..length as usize];
            numbers[register as usize..][..given.len()].copy_from_slice(given);
        }
    }

    /// The same where one function does not do all.
    #[inline(never)]
    fn run_in_parts(
        &self,
        inputs: &[f64],
        sets: &Sets,
        workspace: &mut Workspace,
        outputs: &mut [f64],
    ) -> Result<(), (usize, Fault)> {
        // What machine code copies itself.
        let copied = self.code.as_ref().map_or(Copied::default(), |code| code.copied());
        self.load_ranges(inputs, &mut workspace.numbers);
        if !copied.inputs {
            for (slot, register) in &self.single_inputs {
                workspace.numbers[*register as usize] = inputs[*slot as usize];
            }
        }
        self.run_lists((inputs, sets), workspace, outputs, copied)?;
        if copied.outputs {
            return Ok(());
        }
        let numbers = &workspace.numbers[..];
        self.passed.iter().for_each(|(slot, output)| outputs[*output as usize] = inputs[*slot as usize]);
        if self.block.is_empty() {
            let computed =
                outputs.iter_mut().zip(self.outputs.iter()).filter(|(_, register)| **register != NO_REGISTER);
            computed.for_each(|(slot, register)| *slot = numbers[*register as usize]);
            return Ok(());
        }
        outputs[..self.block.len()].copy_from_slice(&numbers[self.block.clone()]);
        for (slot, register) in &self.elsewhere {
            outputs[*slot as usize] = numbers[*register as usize];
        }
        Ok(())
    }
}
