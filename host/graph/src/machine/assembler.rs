//! Machine code in one pass, for x86-64 with AVX on systems with the System V calling convention.
//!
//! A list of operations has no branches, so that the next use of every number is known when it is computed. Numbers stay in
//! the processor's registers as long as there is room; the one whose next use is farthest makes way (Belady 1966), into the
//! register of the workspace that the list gives it anyway. What is in the workspace already is read from there, mostly as
//! the operand of the instruction that needs it.
//!
//! Each list is gone through twice: backwards for the next uses ([`uses`]), then forwards, writing. A value is known by its
//! register of the workspace: before another one is written there, it has been read for the last time.

mod copies;
mod uses;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::super::costs::MachineError;
use super::super::tape::{Instruction, Program, Register};
use super::calls::{INLINE_POWER, Pair, atan2, cos, exp, ln, look_up, powf, powi, sin, sin_cos, tanh};
use super::encoder::{Code, Operation, Place, RBX, RCX, RDI, RDX};
use super::{Made, Piece, liveness};
use copies::Copies;
pub(super) use copies::copied;
use uses::{Lookout, NEVER, Uses};

/// The mapping that the code lies in, with that of all programs made together; none for no code.
pub(super) type Memory = Option<Arc<memmap2::Mmap>>;

/// Functions begin at multiples of this, bytes.
const ALIGNMENT: usize = 16;

/// Whether this machine runs what the assembler makes.
pub(super) fn is_available() -> bool {
    #[cfg(all(target_arch = "x86_64", unix))]
    return std::arch::is_x86_feature_detected!("avx");
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    false
}

/// Makes the functions of programs, one per list, all in one mapping. `cancel` is looked at between lists.
pub(super) fn make(programs: &[&Program], cancel: &AtomicBool) -> Result<Vec<Made<Memory>>, MachineError> {
    if !is_available() {
        return Err(MachineError::Unavailable);
    }
    let mut code = Code::with_room_for(programs.iter().map(|program| program.listed()).sum());
    let registers = programs.iter().map(|program| program.registers).max().unwrap_or(0);
    let mut lookout = Lookout::new(registers);
    let mut homes = Homes::new(registers);
    let mut places = Vec::with_capacity(programs.len());
    for program in programs {
        let from = code.bytes().len();
        let mut entries = vec![None; program.lists().count()];
        liveness::backwards(program, |number, list, live| {
            if cancel.load(Ordering::Relaxed) {
                return Err(MachineError::Cancelled);
            }
            let copies = Copies::of(program, number);
            if !list.is_empty() || !copies.is_empty() {
                entries[number] = Some(code.align(ALIGNMENT));
                let calls = list.iter().any(|instruction| called(instruction).is_some());
                let uses = lookout.of(list, program.tables.len(), live);
                Writer::new(&mut code, &mut homes, calls).function(list, uses, &copies);
            }
            Ok(())
        })?;
        places.push((entries, code.bytes().len() - from));
    }
    let memory = executable(code.bytes())?;
    let piece = |entry: usize| {
        let memory = memory.as_ref().expect("what has an entry has a mapping");
        // SAFETY: `Writer::function` put a function of this signature and of the System V calling convention there; the
        // mapping may be run, and lives as long as the last `MachineCode` in it.
        unsafe { std::mem::transmute::<*const u8, Piece>(memory[entry..].as_ptr()) }
    };
    let lists = |entries: Vec<Option<usize>>| entries.into_iter().map(|entry| entry.map(piece).into_iter().collect());
    Ok(places.into_iter().map(|(entries, bytes)| (lists(entries).collect(), bytes, memory.clone())).collect())
}

/// A mapping with this code that may be run.
fn executable(code: &[u8]) -> Result<Memory, MachineError> {
    if code.is_empty() {
        return Ok(None);
    }
    let refused = |error: std::io::Error| MachineError::Refused(format!("no memory for machine code: {error}"));
    let mut memory = memmap2::MmapMut::map_anon(code.len()).map_err(refused)?;
    memory.copy_from_slice(code);
    Ok(Some(Arc::new(memory.make_exec().map_err(refused)?)))
}

/// Vector registers that hold numbers: 0 to 14.
const HOLDERS: usize = 15;
const ALL_HOLDERS: u16 = (1 << HOLDERS) - 1;
/// The vector register for passing use within one operation.
const SCRATCH: u8 = 15;
/// The predicate "less, false where one is not a number" of comparisons.
const LESS: u8 = 1;
/// No vector register.
const NOWHERE: u8 = u8::MAX;
/// Read by the operation at hand, so before everything else.
const NOW: u32 = 0;

/// A number that an instruction reads.
#[derive(Debug, Clone, Copy)]
struct Read {
    register: Register,
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

/// What is called for an operation that is no instruction of the processor.
fn called(instruction: &Instruction) -> Option<Called> {
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

/// Where the value of each register of the workspace is.
struct Homes {
    /// The vector register that holds it.
    holder: Vec<u8>,
    /// Whether the workspace has it, too.
    saved: Vec<bool>,
}

impl Homes {
    fn new(registers: usize) -> Self {
        Self { holder: vec![NOWHERE; registers], saved: vec![true; registers] }
    }
}

/// Writes one function.
struct Writer<'l> {
    code: &'l mut Code,
    homes: &'l mut Homes,
    /// By vector register: the register of the workspace whose value it holds, and the next instruction that reads it; that is
    /// [`NOW`] where it holds none.
    held: [Register; HOLDERS],
    until: [u32; HOLDERS],
    /// Vector registers that hold something, one bit each.
    occupied: u16,
    /// Those that the instruction at hand needs besides.
    pinned: u16,
    /// The general register with the address of the workspace.
    base: u8,
    /// Whether functions are called.
    calls: bool,
}

impl<'l> Writer<'l> {
    fn new(code: &'l mut Code, homes: &'l mut Homes, calls: bool) -> Self {
        homes.holder.fill(NOWHERE);
        homes.saved.fill(true);
        let base = if calls { RBX } else { RDI };
        Self { code, homes, held: [0; HOLDERS], until: [NOW; HOLDERS], occupied: 0, pinned: 0, base, calls }
    }

    /// The whole function.
    fn function(mut self, list: &[Instruction], uses: &[Uses], copies: &Copies<'_>) {
        if self.calls {
            self.code.enter();
        }
        for (slot, register) in copies.inputs {
            self.copy(Place::Memory { base: RDX, offset: offset(*slot) }, self.home(*register));
        }
        for (instruction, uses) in list.iter().zip(uses) {
            self.code.make_room();
            self.pinned = 0;
            let (register, result) = self.instruction(instruction, uses);
            self.homes.saved[register as usize] = false;
            if uses.stored {
                self.save(register, result);
            }
            if uses.first != NEVER {
                self.hold(register, result, uses.first);
            }
        }
        self.code.make_room();
        if self.calls {
            self.code.restore_rcx();
        }
        let (angles, gathered) = copies.angles;
        for (register, to) in angles.iter().zip(gathered..) {
            self.copy(self.home(*register), self.home(to));
        }
        for (register, slot) in copies.outputs.iter().zip(0..) {
            self.copy(self.home(*register), Place::Memory { base: RCX, offset: offset(slot) });
        }
        if self.calls {
            self.code.leave();
        }
        self.code.ret();
    }

    /// Copies a number from memory to memory.
    fn copy(&mut self, from: Place, to: Place) {
        self.code.make_room();
        self.code.vector(Operation::LOAD, SCRATCH, 0, from);
        self.code.vector(Operation::STORE, SCRATCH, 0, to);
    }

    /// One operation; gives the register of the workspace that its result belongs to, and the vector register that it is in.
    fn instruction(&mut self, instruction: &Instruction, uses: &Uses) -> (Register, u8) {
        let [a, b, c, d] = uses.next;
        let read = |register, next| Read { register, next };
        match *instruction {
            Instruction::Add(to, i, j) => (to, self.symmetric(Operation::ADD, read(i, a), read(j, b))),
            Instruction::Sub(to, i, j) => (to, self.arithmetic(Operation::SUB, read(i, a), read(j, b))),
            Instruction::Mul(to, i, j) => (to, self.symmetric(Operation::MUL, read(i, a), read(j, b))),
            Instruction::Div(to, i, j) => (to, self.arithmetic(Operation::DIV, read(i, a), read(j, b))),
            Instruction::Neg(to, i) => (to, self.negative(read(i, a))),
            Instruction::Sqrt(to, i) => (to, self.root(read(i, a))),
            Instruction::Select(to, [i, j, k, l]) => {
                (to, self.select([read(i, a), read(j, b), read(k, c), read(l, d)]))
            }
            Instruction::Turned(to, i) => {
                // The second result of the call before, which left all other vector registers empty.
                self.used(&[read(i, a)]);
                (to, 1)
            }
            Instruction::Powi(to, i, n) if n.unsigned_abs() <= INLINE_POWER => (to, self.power(read(i, a), n)),
            Instruction::Atan2(to, i, j) => (to, self.call(&Called::Two(atan2), &[read(i, a), read(j, b)])),
            _ => {
                let called = called(instruction).expect("everything else is called");
                let mut operand = None;
                instruction.operands(|register| operand = Some(read(register, a)));
                (instruction.result(), self.call(&called, operand.as_slice()))
            }
        }
    }

    /// An operation on two numbers that may trade places: better that the one in memory is the second.
    #[inline]
    fn symmetric(&mut self, operation: Operation, a: Read, b: Read) -> u8 {
        if self.holder(a) == NOWHERE { self.arithmetic(operation, b, a) } else { self.arithmetic(operation, a, b) }
    }

    /// An operation on two numbers.
    fn arithmetic(&mut self, operation: Operation, a: Read, b: Read) -> u8 {
        let first = self.in_register(a);
        let second = self.anywhere(b);
        let result = self.result(&[a, b]);
        self.code.vector(operation, result, first, second);
        result
    }

    fn negative(&mut self, a: Read) -> u8 {
        let first = self.in_register(a);
        self.code.constant(SCRATCH, -0.0);
        let result = self.result(&[a]);
        self.code.vector(Operation::XOR, result, first, Place::Vector(SCRATCH));
        result
    }

    fn root(&mut self, a: Read) -> u8 {
        let first = self.in_register(a);
        let result = self.result(&[a]);
        self.code.vector(Operation::SQRT, result, first, Place::Vector(first));
        result
    }

    /// The third number where the first is less than the second, else the fourth.
    fn select(&mut self, reads: [Read; 4]) -> u8 {
        let [a, b, c, d] = reads;
        let (a, c, d) = (self.in_register(a), self.in_register(c), self.in_register(d));
        let b = self.anywhere(b);
        self.code.vector(Operation::COMPARE, SCRATCH, a, b);
        self.code.put([LESS]);
        let result = self.result(&reads);
        self.code.vector(Operation::BLEND, result, d, Place::Vector(c));
        self.code.put([SCRATCH << 4]);
        result
    }

    /// The products that `f64::powi` forms (`__powidf2` of the compiler's run time): squares, multiplied where the exponent has a
    /// bit; then the reciprocal of a negative power.
    fn power(&mut self, a: Read, n: i32) -> u8 {
        let first = self.in_register(a);
        self.fetch(SCRATCH, Place::Vector(first));
        let result = self.result(&[a]);
        let mut bits = n.unsigned_abs();
        let mut begun = false;
        while bits != 0 {
            if bits & 1 == 1 {
                if begun {
                    self.code.vector(Operation::MUL, result, result, Place::Vector(SCRATCH));
                } else {
                    self.fetch(result, Place::Vector(SCRATCH));
                    begun = true;
                }
            }
            bits >>= 1;
            if bits != 0 {
                self.code.vector(Operation::MUL, SCRATCH, SCRATCH, Place::Vector(SCRATCH));
            }
        }
        if !begun {
            self.code.constant(result, 1.0);
        }
        if n < 0 {
            self.code.constant(SCRATCH, 1.0);
            self.code.vector(Operation::DIV, result, SCRATCH, Place::Vector(result));
        }
        result
    }

    /// Calls a function; the result is in vector register 0, which is told, a second one in 1. No vector register survives a call.
    fn call(&mut self, called: &Called, reads: &[Read]) -> u8 {
        let mut at = [Place::Vector(SCRATCH); 2];
        at.iter_mut().zip(reads).for_each(|(place, read)| *place = self.anywhere(*read));
        self.used(reads);
        for register in 0..HOLDERS as u8 {
            self.vacate(register);
        }
        match at[..reads.len()] {
            [a] => self.fetch(0, a),
            [Place::Vector(1), Place::Vector(0)] => {
                self.fetch(SCRATCH, Place::Vector(1));
                self.fetch(1, Place::Vector(0));
                self.fetch(0, Place::Vector(SCRATCH));
            }
            [a, b @ Place::Vector(0)] => {
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
                self.code.constant(1, exponent);
                powf as *const () as usize
            }
            Called::Whole(n) => {
                self.code.load_edi(n);
                powi as *const () as usize
            }
            Called::Table(table, order) => {
                self.code.load_table(table, order);
                look_up as *const () as usize
            }
        };
        self.code.call(address as u64);
        0
    }

    /// The vector register that holds a value.
    #[inline]
    fn holder(&self, read: Read) -> u8 {
        self.homes.holder[read.register as usize]
    }

    /// Where a value is: in a vector register or else in the workspace.
    #[inline]
    fn anywhere(&self, read: Read) -> Place {
        match self.holder(read) {
            NOWHERE => self.home(read.register),
            register => Place::Vector(register),
        }
    }

    /// Brings a value into a vector register, which the operation at hand then keeps.
    #[inline]
    fn in_register(&mut self, read: Read) -> u8 {
        let mut register = self.holder(read);
        if register == NOWHERE {
            register = self.take();
            self.fetch(register, self.home(read.register));
            if read.next != NEVER {
                self.hold(read.register, register, NOW);
            }
        }
        self.pinned |= 1 << register;
        register
    }

    /// A vector register for the result of the operation at hand, the operands of which have been located: it may be one
    /// of theirs.
    #[inline]
    fn result<const N: usize>(&mut self, reads: &[Read; N]) -> u8 {
        self.used(reads);
        self.pinned = 0;
        self.take()
    }

    /// Counts the operands as read: those that are not read again give back their vector register.
    #[inline]
    fn used(&mut self, reads: &[Read]) {
        for read in reads {
            let register = self.holder(*read);
            if register == NOWHERE {
                continue;
            }
            if read.next == NEVER {
                self.release(register);
            } else {
                self.until[register as usize] = read.next;
            }
        }
    }

    /// A vector register, made free if need be: the one whose value is not read for longest. Operands of the instruction at hand
    /// are read now.
    #[inline]
    fn take(&mut self) -> u8 {
        let free = ALL_HOLDERS & !(self.occupied | self.pinned);
        if free != 0 { free.trailing_zeros() as u8 } else { self.evict() }
    }

    #[cold]
    fn evict(&mut self) -> u8 {
        // The first of the farthest, by one number for both: registers fit into four bits.
        let key = |(register, until): (usize, &u32)| u64::from(*until) << 4 | (HOLDERS - register) as u64;
        let most = self.until.iter().enumerate().map(key).fold(0, u64::max);
        let best = (HOLDERS as u64 - (most & 15)) as u8;
        self.vacate(best);
        best
    }

    /// Frees a vector register; what it holds stays in the workspace.
    fn vacate(&mut self, register: u8) {
        if self.occupied & (1 << register) != 0 {
            self.release(register);
            self.save(self.held[register as usize], register);
        }
    }

    /// A vector register holds nothing any more.
    fn release(&mut self, register: u8) {
        self.occupied &= !(1 << register);
        self.until[register as usize] = NOW;
        self.homes.holder[self.held[register as usize] as usize] = NOWHERE;
    }

    /// Writes a value to the workspace, unless it is there.
    fn save(&mut self, register: Register, from: u8) {
        if !std::mem::replace(&mut self.homes.saved[register as usize], true) {
            self.code.vector(Operation::STORE, from, 0, self.home(register));
        }
    }

    fn hold(&mut self, register: Register, by: u8, until: u32) {
        self.occupied |= 1 << by;
        (self.held[by as usize], self.until[by as usize]) = (register, until);
        self.homes.holder[register as usize] = by;
    }

    /// Copies a number into a vector register.
    fn fetch(&mut self, register: u8, from: Place) {
        match from {
            Place::Vector(from) if from == register => {}
            Place::Vector(_) => self.code.vector(Operation::COPY, register, 0, from),
            Place::Memory { .. } => self.code.vector(Operation::LOAD, register, 0, from),
        }
    }

    /// The place of a value in the workspace.
    fn home(&self, register: Register) -> Place {
        Place::Memory { base: self.base, offset: offset(register) }
    }
}

/// Of a number in a list of such, bytes.
fn offset(number: u32) -> i32 {
    i32::try_from(u64::from(number) * 8).expect("fewer than 2^28 numbers")
}
