//! Machine code in one pass, for x86-64 with AVX on systems with the System V calling convention.
//!
//! A list of operations has no branches, so that the next use of every number is known when it is computed. Numbers stay in
//! the processor's registers as long as there is room; the one whose next use is farthest makes way (Belady 1966), into the
//! register of the workspace that the list gives it anyway. What is in the workspace already is read from there, mostly as
//! the operand of the instruction that needs it.

use std::sync::atomic::{AtomicBool, Ordering};

use cranelift_assembler_x64::{Amode, AmodeOffset, AmodeOffsetPlusKnownOffset, Registers, XmmMem, inst};

use super::super::costs::MachineError;
use super::super::tape::{Instruction, Program, Register};
use super::calls::{INLINE_POWER, Pair, atan2, cos, exp, ln, look_up, powf, powi, sin, sin_cos, tanh};
use super::{Made, Piece, liveness};

/// The mapping that the code lies in; none for no code.
pub(super) type Memory = Option<memmap2::Mmap>;

/// Functions begin at multiples of this, bytes.
const ALIGNMENT: usize = 16;

/// Whether this machine runs what the assembler makes.
pub(super) fn is_available() -> bool {
    #[cfg(all(target_arch = "x86_64", unix))]
    return std::arch::is_x86_feature_detected!("avx");
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    false
}

/// Makes the functions of a program, one per list. `cancel` is looked at between lists.
pub(super) fn make(program: &Program, cancel: &AtomicBool) -> Result<Made<Memory>, MachineError> {
    if !is_available() {
        return Err(MachineError::Unavailable);
    }
    let mut code: Vec<u8> = Vec::new();
    let mut entries = vec![None; program.lists().count()];
    liveness::backwards(program, |number, list, live| {
        if cancel.load(Ordering::Relaxed) {
            return Err(MachineError::Cancelled);
        }
        if !list.is_empty() {
            code.resize(code.len().next_multiple_of(ALIGNMENT), 0);
            entries[number] = Some(code.len());
            let stored = liveness::stored(list, live);
            Writer::new(list, program.registers, &mut code).function(&stored);
            liveness::before(list, live);
        }
        Ok(())
    })?;
    if code.is_empty() {
        return Ok((vec![Vec::new(); entries.len()], 0, None));
    }
    let refused = |error: std::io::Error| MachineError::Refused(format!("no memory for machine code: {error}"));
    let mut memory = memmap2::MmapMut::map_anon(code.len()).map_err(refused)?;
    memory.copy_from_slice(&code);
    let memory = memory.make_exec().map_err(refused)?;
    let piece = |entry: usize| {
        // SAFETY: `Writer::function` put a function of this signature and of the System V calling convention there; the
        // mapping may be run, and lives as long as the `MachineCode`.
        unsafe { std::mem::transmute::<*const u8, Piece>(memory[entry..].as_ptr()) }
    };
    let lists = entries.into_iter().map(|entry| entry.map(piece).into_iter().collect()).collect();
    Ok((lists, code.len(), Some(memory)))
}

/// Registers of the processor, by their number in its encoding.
#[derive(Debug, Clone, Copy)]
struct Numbered;

impl Registers for Numbered {
    type ReadGpr = u8;
    type ReadWriteGpr = u8;
    type WriteGpr = u8;
    type ReadXmm = u8;
    type ReadWriteXmm = u8;
    type WriteXmm = u8;
}

type Location = XmmMem<u8, u8>;
type Address = Amode<u8>;

// General registers.
const RAX: u8 = 0;
const RDX: u8 = 2;
const RBX: u8 = 3;
const RSP: u8 = 4;
const RSI: u8 = 6;
const RDI: u8 = 7;
const R12: u8 = 12;

/// Vector registers that hold numbers: 0 to 14.
const HOLDERS: usize = 15;
/// The vector register for passing use within one operation.
const SCRATCH: u8 = 15;
/// The predicate "less, false where one is not a number" of comparisons.
const LESS: u8 = 1;

/// No vector register; no value.
const NOWHERE: u8 = u8::MAX;
const NOBODY: u32 = u32::MAX;
/// Not used again.
const NEVER: u32 = u32::MAX;

/// A number that an instruction reads. Values are numbered: first the results of the list's instructions, then what the
/// registers of the workspace hold when the function begins.
#[derive(Debug, Clone, Copy)]
struct Read {
    value: u32,
    /// The next instruction that reads it.
    next: u32,
}

/// Functions that are called, by what they take besides numbers.
enum Called {
    One(extern "C" fn(f64) -> f64),
    Both(extern "C" fn(f64) -> Pair),
    Two(extern "C" fn(f64, f64) -> f64),
    Power(f64),
    Whole(i32),
    Table(u32, u32),
}

/// Writes one function.
struct Writer<'l> {
    list: &'l [Instruction],
    code: &'l mut Vec<u8>,
    /// What each instruction reads: a range of `reads`.
    reads: Vec<Read>,
    ranges: Vec<u32>,
    /// By instruction: the first that reads its result.
    first_use: Vec<u32>,
    /// By value: the next instruction that reads it.
    next_use: Vec<u32>,
    /// By value: the vector register that holds it.
    holder: Vec<u8>,
    /// By value: whether the workspace has it.
    saved: Vec<bool>,
    /// By vector register: the value it holds.
    held: [u32; HOLDERS],
    /// Vector registers that the instruction at hand needs besides, one bit each.
    pinned: u16,
    /// The general register with the address of the workspace.
    base: u8,
}

impl<'l> Writer<'l> {
    fn new(list: &'l [Instruction], registers: usize, code: &'l mut Vec<u8>) -> Self {
        let outside = list.len() as u32;
        let mut writer_of: Vec<u32> = (0..registers as u32).map(|register| outside + register).collect();
        let (mut reads, mut ranges) = (Vec::with_capacity(2 * list.len()), Vec::with_capacity(list.len() + 1));
        for (at, instruction) in list.iter().enumerate() {
            ranges.push(reads.len() as u32);
            instruction.operands(|register| reads.push(Read { value: writer_of[register as usize], next: NEVER }));
            writer_of[instruction.result() as usize] = at as u32;
        }
        ranges.push(reads.len() as u32);
        let values = list.len() + registers;
        let mut next_use = vec![NEVER; values];
        let mut first_use = vec![NEVER; list.len()];
        for at in (0..list.len()).rev() {
            first_use[at] = next_use[at];
            let range = ranges[at] as usize..ranges[at + 1] as usize;
            for read in &mut reads[range.clone()] {
                read.next = next_use[read.value as usize];
            }
            for read in &reads[range] {
                next_use[read.value as usize] = at as u32;
            }
        }
        let mut saved = vec![true; values];
        saved[..list.len()].fill(false);
        Self {
            list,
            code,
            reads,
            ranges,
            first_use,
            next_use,
            holder: vec![NOWHERE; values],
            saved,
            held: [NOBODY; HOLDERS],
            pinned: 0,
            base: RDI,
        }
    }

    /// The whole function; `stored` says which results must be in the workspace at its end.
    fn function(mut self, stored: &[bool]) {
        let calls = self.list.iter().any(|instruction| self.called(instruction).is_some());
        if calls {
            // rbx and r12 survive calls; the stack pointer must be a multiple of 16 at each.
            inst::pushq_o::<Numbered>::new(RBX).encode(self.code);
            inst::pushq_o::<Numbered>::new(R12).encode(self.code);
            inst::subq_mi_sxb::<Numbered>::new(RSP, 8_i8).encode(self.code);
            inst::movq_rm::<Numbered>::new(RBX, RDI).encode(self.code);
            inst::movq_rm::<Numbered>::new(R12, RSI).encode(self.code);
            self.base = RBX;
        }
        for (at, stored) in stored.iter().enumerate() {
            let result = self.instruction(at);
            let value = at as u32;
            self.next_use[at] = self.first_use[at];
            if *stored {
                self.save(value, result);
            }
            if self.first_use[at] != NEVER {
                self.hold(value, result);
            }
        }
        if calls {
            inst::addq_mi_sxb::<Numbered>::new(RSP, 8_i8).encode(self.code);
            inst::popq_o::<Numbered>::new(R12).encode(self.code);
            inst::popq_o::<Numbered>::new(RBX).encode(self.code);
        }
        inst::retq_zo::new().encode(self.code);
    }

    /// One operation; gives the vector register with its result.
    fn instruction(&mut self, at: usize) -> u8 {
        let range = self.ranges[at] as usize..self.ranges[at + 1] as usize;
        let mut reads = [Read { value: NOBODY, next: NEVER }; 4];
        let count = range.len();
        reads[..count].copy_from_slice(&self.reads[range]);
        let instruction = self.list[at];
        self.pinned = 0;
        if let Some(called) = self.called(&instruction) {
            return self.call(&called, &reads[..count]);
        }
        if let Instruction::Turned(..) = instruction {
            // The second result of the call before, which left all other vector registers empty.
            self.used(&reads[..count]);
            return 1;
        }
        let [mut a, mut b, c, d] = reads;
        match instruction {
            Instruction::Add(..) | Instruction::Mul(..) if self.holder(a) == NOWHERE => (a, b) = (b, a),
            _ => {}
        }
        match instruction {
            Instruction::Add(..) | Instruction::Sub(..) | Instruction::Mul(..) | Instruction::Div(..) => {
                let first = self.in_register(a);
                let second = self.anywhere(b);
                let result = self.result(&reads[..count]);
                match instruction {
                    Instruction::Add(..) => {
                        inst::vaddsd_b::<Numbered>::new(result, first, second).encode(self.code);
                    }
                    Instruction::Sub(..) => {
                        inst::vsubsd_b::<Numbered>::new(result, first, second).encode(self.code);
                    }
                    Instruction::Mul(..) => {
                        inst::vmulsd_b::<Numbered>::new(result, first, second).encode(self.code);
                    }
                    _ => inst::vdivsd_b::<Numbered>::new(result, first, second).encode(self.code),
                }
                result
            }
            Instruction::Neg(..) => {
                let a = self.in_register(a);
                self.constant(SCRATCH, -0.0);
                let result = self.result(&reads[..count]);
                inst::vxorpd_b::<Numbered>::new(result, a, SCRATCH).encode(self.code);
                result
            }
            Instruction::Sqrt(..) => {
                let a = self.in_register(a);
                let result = self.result(&reads[..count]);
                inst::vsqrtsd_b::<Numbered>::new(result, a, a).encode(self.code);
                result
            }
            Instruction::Select(..) => {
                let (a, c, d) = (self.in_register(a), self.in_register(c), self.in_register(d));
                let b = self.anywhere(b);
                inst::vcmpsd_b::<Numbered>::new(SCRATCH, a, b, LESS).encode(self.code);
                let result = self.result(&reads[..count]);
                inst::vblendvpd_rvmr::<Numbered>::new(result, d, c, SCRATCH).encode(self.code);
                result
            }
            Instruction::Powi(_, _, n) => {
                let a = self.in_register(a);
                inst::vmovapd_a::<Numbered>::new(SCRATCH, a).encode(self.code);
                let result = self.result(&reads[..count]);
                self.power(result, n);
                result
            }
            _ => unreachable!("everything else is called"),
        }
    }

    /// The products that `f64::powi` forms (`__powidf2` of the compiler's run time) of the number in the scratch register:
    /// squares, multiplied where the exponent has a bit; then the reciprocal of a negative power.
    fn power(&mut self, result: u8, n: i32) {
        let mut bits = n.unsigned_abs();
        let mut begun = false;
        while bits != 0 {
            if bits & 1 == 1 {
                if begun {
                    inst::vmulsd_b::<Numbered>::new(result, result, SCRATCH).encode(self.code);
                } else {
                    inst::vmovapd_a::<Numbered>::new(result, SCRATCH).encode(self.code);
                    begun = true;
                }
            }
            bits >>= 1;
            if bits != 0 {
                inst::vmulsd_b::<Numbered>::new(SCRATCH, SCRATCH, SCRATCH).encode(self.code);
            }
        }
        if !begun {
            self.constant(result, 1.0);
        }
        if n < 0 {
            self.constant(SCRATCH, 1.0);
            inst::vdivsd_b::<Numbered>::new(result, SCRATCH, result).encode(self.code);
        }
    }

    /// What is called for an operation that is no instruction of the processor.
    fn called(&self, instruction: &Instruction) -> Option<Called> {
        match *instruction {
            Instruction::Sin(..) => Some(Called::One(sin)),
            Instruction::Cos(..) => Some(Called::One(cos)),
            Instruction::Turn(..) => Some(Called::Both(sin_cos)),
            Instruction::Exp(..) => Some(Called::One(exp)),
            Instruction::Ln(..) => Some(Called::One(ln)),
            Instruction::Tanh(..) => Some(Called::One(tanh)),
            Instruction::Atan2(..) => Some(Called::Two(atan2)),
            Instruction::Powf(_, _, exponent) => Some(Called::Power(exponent)),
            Instruction::Powi(_, _, n) if n.unsigned_abs() > INLINE_POWER => Some(Called::Whole(n)),
            Instruction::Table(_, _, table, order) => Some(Called::Table(table, order)),
            _ => None,
        }
    }

    /// Calls a function; the result is in vector register 0, a second one in 1. No vector register survives a call.
    fn call(&mut self, called: &Called, reads: &[Read]) -> u8 {
        let at: Vec<Location> = reads.iter().map(|read| self.anywhere(*read)).collect();
        self.used(reads);
        for register in 0..HOLDERS as u8 {
            self.vacate(register);
        }
        match at[..] {
            [a] => self.fetch(0, a),
            [XmmMem::Xmm(1), XmmMem::Xmm(0)] => {
                self.fetch(SCRATCH, XmmMem::Xmm(1));
                self.fetch(1, XmmMem::Xmm(0));
                self.fetch(0, XmmMem::Xmm(SCRATCH));
            }
            [a, b @ XmmMem::Xmm(0)] => {
                self.fetch(1, b);
                self.fetch(0, a);
            }
            [a, b] => {
                self.fetch(0, a);
                self.fetch(1, b);
            }
            _ => unreachable!("functions of one or two numbers"),
        }
        let address = match *called {
            Called::One(function) => function as *const () as usize,
            Called::Both(function) => function as *const () as usize,
            Called::Two(function) => function as *const () as usize,
            Called::Power(exponent) => {
                self.constant(1, exponent);
                powf as *const () as usize
            }
            Called::Whole(n) => {
                inst::movl_oi::<Numbered>::new(RDI, n).encode(self.code);
                powi as *const () as usize
            }
            Called::Table(table, order) => {
                inst::movq_rm::<Numbered>::new(RDI, R12).encode(self.code);
                inst::movl_oi::<Numbered>::new(RSI, table).encode(self.code);
                inst::movl_oi::<Numbered>::new(RDX, order).encode(self.code);
                look_up as *const () as usize
            }
        };
        inst::movabsq_oi::<Numbered>::new(RAX, address as u64).encode(self.code);
        inst::callq_m::<Numbered>::new(RAX).encode(self.code);
        0
    }

    /// The vector register that holds a value.
    fn holder(&self, read: Read) -> u8 {
        self.holder[read.value as usize]
    }

    /// Where a value is: in a vector register or else in the workspace.
    fn anywhere(&mut self, read: Read) -> Location {
        match self.holder(read) {
            NOWHERE => XmmMem::Mem(self.home(read.value)),
            register => XmmMem::Xmm(register),
        }
    }

    /// Brings a value into a vector register, which the operation at hand then keeps.
    fn in_register(&mut self, read: Read) -> u8 {
        let mut register = self.holder(read);
        if register == NOWHERE {
            register = self.take();
            self.fetch(register, XmmMem::Mem(self.home(read.value)));
            if read.next != NEVER {
                self.hold(read.value, register);
            }
        }
        self.pinned |= 1 << register;
        register
    }

    /// A vector register for the result of the operation at hand, the operands of which have been located: it may be one
    /// of theirs.
    fn result(&mut self, reads: &[Read]) -> u8 {
        self.used(reads);
        self.pinned = 0;
        self.take()
    }

    /// Counts the operands as read: those that are not read again give back their vector register.
    fn used(&mut self, reads: &[Read]) {
        for read in reads {
            self.next_use[read.value as usize] = read.next;
            let register = self.holder(*read);
            if read.next == NEVER && register != NOWHERE {
                self.held[register as usize] = NOBODY;
                self.holder[read.value as usize] = NOWHERE;
            }
        }
    }

    /// A vector register, made free if need be.
    fn take(&mut self) -> u8 {
        let mut best = NOWHERE;
        let mut farthest = 0;
        for register in (0..HOLDERS as u8).filter(|register| self.pinned & (1 << register) == 0) {
            let value = self.held[register as usize];
            if value == NOBODY {
                return register;
            }
            let next = self.next_use[value as usize];
            if best == NOWHERE || next > farthest {
                (best, farthest) = (register, next);
            }
        }
        self.vacate(best);
        best
    }

    /// Frees a vector register; what it holds stays in the workspace.
    fn vacate(&mut self, register: u8) {
        let value = std::mem::replace(&mut self.held[register as usize], NOBODY);
        if value != NOBODY {
            self.holder[value as usize] = NOWHERE;
            self.save(value, register);
        }
    }

    /// Writes a value to the workspace, unless it is there.
    fn save(&mut self, value: u32, register: u8) {
        if !std::mem::replace(&mut self.saved[value as usize], true) {
            inst::vmovsd_c_m::<Numbered>::new(self.home(value), register).encode(self.code);
        }
    }

    fn hold(&mut self, value: u32, register: u8) {
        self.held[register as usize] = value;
        self.holder[value as usize] = register;
    }

    /// Copies a number into a vector register.
    fn fetch(&mut self, register: u8, from: Location) {
        match from {
            XmmMem::Xmm(from) if from == register => {}
            XmmMem::Xmm(_) => inst::vmovapd_a::<Numbered>::new(register, from).encode(self.code),
            XmmMem::Mem(address) => inst::vmovsd_d::<Numbered>::new(register, address).encode(self.code),
        }
    }

    /// Puts a constant into a vector register. Overwrites rax.
    fn constant(&mut self, register: u8, value: f64) {
        inst::movabsq_oi::<Numbered>::new(RAX, value.to_bits()).encode(self.code);
        inst::vmovq_a::<Numbered>::new(register, RAX).encode(self.code);
    }

    /// The place of a value in the workspace.
    fn home(&self, value: u32) -> Address {
        let register: Register = match self.list.get(value as usize) {
            Some(instruction) => instruction.result(),
            None => value - self.list.len() as u32,
        };
        let offset = i32::try_from(u64::from(register) * 8).expect("fewer than 2^28 registers");
        let simm32 = AmodeOffsetPlusKnownOffset { simm32: AmodeOffset::new(offset), offset: None };
        Amode::ImmReg { base: self.base, simm32, trap: None }
    }
}
