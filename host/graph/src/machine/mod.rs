//! [`MachineCode`]: a program as functions of the processor, made while the program runs.
//!
//! The same operations in the same order as the interpreter, none fused, and the same Rust functions for what is no single
//! instruction: the results are the interpreter's, bit for bit. There are two makers:
//!
//! - the [`assembler`], for x86-64 with AVX on systems with the System V calling convention: a list of operations without
//!   branches becomes instructions in one pass, at about a hundredth of the cost of a compiler;
//! - [`cranelift`] elsewhere, and as the twin in the tests (feature `cranelift`).
//!
//! With x the registers of the workspace, an operation reads a register from x only where the function has not computed it
//! itself, and writes one back only if it is read after the function ends, or meanwhile, where the processor's registers
//! do not suffice.

#![allow(unsafe_code, reason = "the only way to call machine code; each use says why it holds")]

mod assembler;
mod calls;
#[cfg_attr(all(not(feature = "cranelift"), target_arch = "x86_64", unix), path = "no_cranelift.rs")]
mod cranelift;
mod encoder;
mod liveness;

use std::sync::atomic::AtomicBool;

use element_api::Table;

use super::costs::{MachineError, Maker};
use super::tape::Program;

/// A list of instructions, or a part of one, as a function: takes the registers, the tables, the program's inputs and outputs.
type Piece = unsafe extern "C" fn(*mut f64, *const Table, *const f64, *mut f64);

/// What the functions copy themselves, so that it need not be done around them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Copied {
    /// Single inputs into their registers, before all else; angles of sines computed at once to where they are gathered.
    pub(super) inputs: bool,
    /// All outputs, at the end.
    pub(super) outputs: bool,
    /// One function does what all lists do, has the sines between them computed, and writes the outputs.
    pub(super) whole: bool,
}

/// Functions that do what the lists of instructions of one program do.
pub struct MachineCode {
    /// For each list (one per stage, then the one after all calls) its functions in running order; or one for all of them.
    lists: Vec<Vec<Piece>>,
    /// The function that does what all lists do, where there is one.
    whole: Option<Piece>,
    registers: usize,
    tables: usize,
    /// The least lengths of the slices of inputs and outputs.
    inputs: usize,
    outputs: usize,
    copied: Copied,
    /// Size of the code, bytes.
    bytes: usize,
    _memory: Memory,
}

/// What the functions lie in; given back when the last code in it is dropped.
#[expect(dead_code, reason = "held, not read")]
enum Memory {
    Assembled(assembler::Memory),
    Cranelift(Box<cranelift::Memory>),
}

/// Functions by list, the size of their code in bytes, and what they lie in.
type Made<M> = (Vec<Vec<Piece>>, usize, M);

impl MachineCode {
    /// Makes the functions of a program. `cancel` is looked at now and then.
    ///
    /// # Errors
    /// See [`MachineError`]; the program can always be interpreted instead.
    pub fn compile(program: &Program, maker: Maker, cancel: &AtomicBool) -> Result<Self, MachineError> {
        let mut made = Self::compile_all(&[program], maker, cancel)?;
        Ok(made.pop().expect("one code per program"))
    }

    /// The same of several programs, in their order. The assembler puts all into one piece of memory: what the system charges for
    /// memory that may be run is paid once.
    ///
    /// # Errors
    /// See [`MachineCode::compile`]; then there is code for none.
    pub fn compile_all(programs: &[&Program], maker: Maker, cancel: &AtomicBool) -> Result<Vec<Self>, MachineError> {
        if maker == Maker::Compiler {
            return programs.iter().map(|program| Self::in_pieces(program, cancel, cranelift::PIECE)).collect();
        }
        let made = assembler::make(programs, cancel)?;
        let code = programs.iter().zip(made);
        Ok(code
            .map(|(program, (lists, bytes, memory))| {
                Self::new(program, lists, bytes, Memory::Assembled(memory), assembler::copied(program))
            })
            .collect())
    }

    /// Whether this machine runs what the assembler makes.
    #[must_use]
    pub fn can_assemble() -> bool {
        assembler::is_available()
    }

    /// Whether Cranelift is built in and knows this machine.
    #[must_use]
    pub fn can_compile() -> bool {
        cranelift::is_available()
    }

    /// By Cranelift, with functions of `piece` operations.
    pub fn in_pieces(program: &Program, cancel: &AtomicBool, piece: usize) -> Result<Self, MachineError> {
        let (lists, bytes, memory) = cranelift::make(program, cancel, piece)?;
        Ok(Self::new(program, lists, bytes, Memory::Cranelift(Box::new(memory)), Copied::default()))
    }

    fn new(program: &Program, lists: Vec<Vec<Piece>>, bytes: usize, memory: Memory, copied: Copied) -> Self {
        Self {
            whole: lists.first().and_then(|list| list.first()).copied().filter(|_| copied.whole),
            lists,
            registers: program.registers,
            tables: program.tables.len(),
            inputs: program.slots(),
            outputs: program.outputs.len(),
            copied,
            bytes,
            _memory: memory,
        }
    }

    /// What its functions copy.
    pub(super) fn copied(&self) -> Copied {
        self.copied
    }

    /// Size of the code, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Runs list number `list` of the program that this was made from. `[hot, no allocation]`
    #[inline]
    pub(super) fn run(&self, list: usize, tables: &[Table], inputs: &[f64], x: &mut [f64], outputs: &mut [f64]) {
        self.lists[list].iter().for_each(|piece| self.call(*piece, tables, inputs, x, outputs));
    }

    /// Runs all lists by one function; `false` where there is none. `[hot, no allocation]`
    #[inline]
    pub(super) fn run_whole(&self, tables: &[Table], inputs: &[f64], x: &mut [f64], outputs: &mut [f64]) -> bool {
        if let Some(piece) = self.whole {
            self.call(piece, tables, inputs, x, outputs);
        }
        self.whole.is_some()
    }

    #[inline]
    fn call(&self, piece: Piece, tables: &[Table], inputs: &[f64], x: &mut [f64], outputs: &mut [f64]) {
        let of_this = (x.len() >= self.registers) & (tables.len() >= self.tables);
        let given = (inputs.len() >= self.inputs) & (outputs.len() >= self.outputs);
        assert!(of_this & given, "registers, tables, inputs or outputs of another program");
        // SAFETY: the functions read and write registers below `self.registers`, pass table numbers below
        // `self.tables`, read inputs below `self.inputs` and write outputs below `self.outputs`, which the makers found
        // for every instruction and copy, and the assertion above finds within the slices; `x` and `outputs` are borrowed
        // mutably, and nothing keeps the pointers.
        unsafe { piece(x.as_mut_ptr(), tables.as_ptr(), inputs.as_ptr(), outputs.as_mut_ptr()) };
    }
}

impl std::fmt::Debug for MachineCode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MachineCode").field("bytes", &self.bytes).finish_non_exhaustive()
    }
}
