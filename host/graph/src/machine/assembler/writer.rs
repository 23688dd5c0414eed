//! [`Writer`]: one function, forwards.

use std::hint::select_unpredictable;

use super::super::super::tape::{Instruction, NO_REGISTER, Register};
use super::super::calls::{INLINE_POWER, atan2, look_up, powf, powi, turns_of};
use super::super::encoder::{Code, Operation, Place, RBP, RBX, RCX, RDI, RDX};
use super::copies::Copies;
use super::room::{NONE, NOWHERE, Room};
use super::uses::{NEVER, Uses};
use super::{Called, called};

/// Vector registers that hold numbers: 0 to 14.
const HOLDERS: usize = 15;
/// One place more than there are of them: that of [`NOWHERE`].
const PLACES: usize = 16;
const ALL_HOLDERS: u16 = (1 << HOLDERS) - 1;
/// The vector register for passing use within one operation.
const SCRATCH: u8 = 15;
/// The predicate "less, false where one is not a number" of comparisons.
const LESS: u8 = 1;
/// What adds, subtracts, multiplies, divides.
const ADD: u8 = 0x58;
const SUB: u8 = 0x5C;
const MUL: u8 = 0x59;
const DIV: u8 = 0x5E;
/// Read by the operation at hand, so before everything else.
const NOW: u32 = 0;
/// A number that an instruction reads.
#[derive(Debug, Clone, Copy)]
struct Read {
    register: Register,
    /// The next instruction that reads it.
    next: u32,
}

/// Writes one function.
pub(super) struct Writer<'l> {
    code: &'l mut Code,
    room: &'l mut Room,
    /// By vector register: the register of the workspace whose value it holds, and the key of the next instruction that reads it
    /// ([`key`]); that is [`NOW`] where it holds none.
    held: [Register; PLACES],
    until: [u32; PLACES],
    /// Vector registers that hold nothing, one bit each.
    free: u16,
    /// Those whose value the workspace does not have.
    unsaved: u16,
    /// Those that hold nothing but are needed by the instruction at hand.
    pinned: u16,
    /// The general registers with the addresses of the workspace and of the outputs.
    base: u8,
    outputs: u8,
    /// See [`Lookout::choices`](super::uses::Lookout::choices).
    choices: &'l [[u32; 4]],
    /// Whether functions are called.
    calls: bool,
    /// Whether numbers that are read after the list are outputs.
    ends: bool,
}

/// Where a vector register stands among [`PLACES`].
#[inline(always)]
fn place(register: u8) -> usize {
    usize::from(register) % PLACES
}

/// The next use of what a vector register holds, made unique: of equals, lower registers make way first.
#[inline]
fn key(next: u32, register: u8) -> u32 {
    next << 4 | u32::from(15 - register)
}

/// Of a number in a list of such, bytes; there are fewer than 2^28.
#[inline]
fn offset(number: u32) -> i32 {
    (number * 8) as i32
}

impl<'l> Writer<'l> {
    pub(super) fn new(code: &'l mut Code, room: &'l mut Room, choices: &'l [[u32; 4]], calls: bool) -> Self {
        let (base, outputs) = if calls { (RBX, RBP) } else { (RDI, RCX) };
        if calls {
            code.enter();
        }
        Self {
            code,
            room,
            held: [0; PLACES],
            until: [NOW; PLACES],
            free: ALL_HOLDERS,
            unsaved: 0,
            pinned: 0,
            base,
            outputs,
            choices,
            calls,
            ends: false,
        }
    }

    /// The end of the function.
    pub(super) fn end(self) {
        self.code.make_room();
        if self.calls {
            self.code.leave();
        }
        self.code.ret();
    }

    /// A list, with what is copied before and behind it; `whole` if sines and cosines follow in this function.
    pub(super) fn list(&mut self, list: &[Instruction], uses: &[Uses], copies: &Copies<'_>, whole: bool) {
        // What is read after the list before is in the workspace.
        self.room.holder.fill(NOWHERE);
        self.until = [NOW; PLACES];
        (self.free, self.unsaved) = (ALL_HOLDERS, 0);
        self.ends = !copies.outputs.is_empty();
        self.copy_inputs(copies.inputs, self.base);
        self.copy_inputs(copies.passed, self.outputs);
        for (instruction, uses) in list.iter().zip(uses) {
            self.code.make_room();
            self.instruction(instruction, uses);
        }
        if let Some(turns) = copies.turns {
            for (register, to) in turns.angles.iter().zip(turns.gathered_at()..) {
                self.copy(self.home(*register), self.home(to));
            }
            if whole {
                self.turn(turns.gathered_at(), turns.lanes as u32);
            }
        }
        self.copy_outputs(copies.outputs);
    }

    /// Has sines and cosines computed.
    fn turn(&mut self, first: Register, lanes: u32) {
        let end = first as usize + 3 * lanes as usize;
        assert!(end <= self.room.registers, "angles, sines and cosines are in the workspace");
        self.code.make_room();
        self.code.load_place(offset(first), lanes);
        self.code.call(turns_of(lanes) as *const () as u64);
    }

    /// Outputs that no operation of the last list has computed, and those that are one twice.
    fn copy_outputs(&mut self, outputs: &[Register]) {
        for (register, slot) in outputs.iter().zip(0..).filter(|(register, _)| **register != NO_REGISTER) {
            let first = self.room.output[*register as usize];
            let written = self.room.written[*register as usize];
            if written && first == slot {
                continue;
            }
            let from = if written { (self.outputs, offset(first)) } else { self.home(*register) };
            self.copy(from, (self.outputs, offset(slot)));
        }
    }

    /// Copies inputs to their places behind a base, two at a time where they lie side by side.
    fn copy_inputs(&mut self, mut inputs: &[(u32, u32)], base: u8) {
        while let [(slot, place), rest @ ..] = inputs {
            let (from, to) = ((RDX, offset(*slot)), (base, offset(*place)));
            match rest {
                [next, others @ ..] if *next == (slot + 1, place + 1) => {
                    self.copy_by([Operation::LOAD_TWO, Operation::STORE_TWO], from, to);
                    inputs = others;
                }
                _ => {
                    self.copy(from, to);
                    inputs = rest;
                }
            }
        }
    }

    /// Copies a number from memory to memory.
    fn copy(&mut self, from: (u8, i32), to: (u8, i32)) {
        self.copy_by([Operation::LOAD, Operation::STORE], from, to);
    }

    fn copy_by(&mut self, [load, store]: [Operation; 2], from: (u8, i32), to: (u8, i32)) {
        self.code.make_room();
        self.code.of_memory(load, SCRATCH, 0, from);
        self.code.of_memory(store, SCRATCH, 0, to);
    }

    /// One operation.
    #[inline(always)]
    fn instruction(&mut self, instruction: &Instruction, uses: &Uses) {
        let (Instruction::Add(to, i, j)
        | Instruction::Sub(to, i, j)
        | Instruction::Mul(to, i, j)
        | Instruction::Div(to, i, j)) = *instruction
        else {
            let (to, result) = self.other(instruction, uses);
            return self.computed(to, result, uses);
        };
        // Which of them it is cannot be foreseen.
        let [adds, subtracts, multiplies] = [
            matches!(instruction, Instruction::Add(..)),
            matches!(instruction, Instruction::Sub(..)),
            matches!(instruction, Instruction::Mul(..)),
        ];
        let other = select_unpredictable(subtracts, SUB, DIV);
        let opcode = select_unpredictable(adds, ADD, select_unpredictable(multiplies, MUL, other));
        let [a, b] = uses.next;
        // Where they may trade places, it is better that the one in memory is the second.
        let trade = (adds | multiplies) & (self.room.holder[i as usize] == NOWHERE);
        let ((i, a), (j, b)) = select_unpredictable(trade, ((j, b), (i, a)), ((i, a), (j, b)));
        self.arithmetic(opcode, to, [(i, a), (j, b)], uses);
    }

    /// An operation on two numbers, each with the next instruction that reads it.
    #[inline(always)]
    fn arithmetic(&mut self, opcode: u8, to: Register, [(i, a), (j, b)]: [(Register, u32); 2], uses: &Uses) {
        let mut first = self.room.holder[i as usize];
        if first == NOWHERE {
            first = self.load(i);
            if a != NEVER {
                self.hold(i, first, a);
            }
        } else {
            self.read(first, a);
        }
        let second = self.room.holder[j as usize];
        self.read(second, b);
        let result = self.take();
        let home = self.home(j);
        self.code.of_either(Operation::of_numbers(opcode), result, first, (second != NOWHERE, second), home);
        self.computed(to, result, uses);
    }

    /// What becomes of a result.
    #[inline]
    fn computed(&mut self, to: Register, result: u8, uses: &Uses) {
        self.unsaved |= 1 << result;
        if uses.is_stored() {
            self.store(to, result);
        }
        if uses.first() != NEVER {
            self.hold(to, result, uses.first());
        }
    }

    /// Writes a result that is read after the list to where it is read: an output nobody reads in the workspace.
    #[inline]
    fn store(&mut self, register: Register, from: u8) {
        if self.ends && self.room.output[register as usize] != NONE {
            self.room.written[register as usize] = true;
            let slot = self.room.output[register as usize];
            return self.code.of_memory(Operation::STORE, from, 0, (self.outputs, offset(slot)));
        }
        self.unsaved &= !(1 << from);
        self.code.of_memory(Operation::STORE, from, 0, self.home(register));
    }

    /// An operation other than those on two numbers; gives the register of the workspace that its result belongs to, and the vector
    /// register that it is in.
    fn other(&mut self, instruction: &Instruction, uses: &Uses) -> (Register, u8) {
        let [a, b] = uses.next;
        let read = |register, next| Read { register, next };
        match *instruction {
            Instruction::Neg(to, i) => (to, self.negative(read(i, a))),
            Instruction::Sqrt(to, i) => (to, self.root(read(i, a))),
            Instruction::Select(to, ref all) => {
                let [i, j, k, l] = **all;
                let [a, b, c, d] = self.choices[a as usize];
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

    fn negative(&mut self, a: Read) -> u8 {
        let first = self.in_register(a);
        self.code.constant(SCRATCH, -0.0);
        let result = self.result(&[a]);
        self.code.of_registers(Operation::XOR, result, first, SCRATCH);
        result
    }

    fn root(&mut self, a: Read) -> u8 {
        let first = self.in_register(a);
        let result = self.result(&[a]);
        self.code.of_registers(Operation::SQRT, result, first, first);
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
        self.code.of_registers(Operation::BLEND, result, d, c);
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
                    self.code.vector(Operation::of_numbers(MUL), result, result, Place::Vector(SCRATCH));
                } else {
                    self.fetch(result, Place::Vector(SCRATCH));
                    begun = true;
                }
            }
            bits >>= 1;
            if bits != 0 {
                self.code.vector(Operation::of_numbers(MUL), SCRATCH, SCRATCH, Place::Vector(SCRATCH));
            }
        }
        if !begun {
            self.code.constant(result, 1.0);
        }
        if n < 0 {
            self.code.constant(SCRATCH, 1.0);
            self.code.vector(Operation::of_numbers(DIV), result, SCRATCH, Place::Vector(result));
        }
        result
    }

    /// Calls a function; the result is in vector register 0, which is given, a second one in 1. No vector register survives a call.
    fn call(&mut self, called: &Called, reads: &[Read]) -> u8 {
        let mut at = [Place::Vector(SCRATCH); 2];
        at.iter_mut().zip(reads).for_each(|(place, read)| *place = self.anywhere(*read));
        self.used(reads);
        let mut occupied = ALL_HOLDERS & !self.free;
        while occupied != 0 {
            self.vacate(occupied.trailing_zeros() as u8);
            occupied &= occupied - 1;
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
        self.room.holder[read.register as usize]
    }

    /// Where a value is: in a vector register or else in the workspace.
    #[inline]
    fn anywhere(&self, read: Read) -> Place {
        match self.holder(read) {
            NOWHERE => {
                let (base, offset) = self.home(read.register);
                Place::Memory { base, offset }
            }
            register => Place::Vector(register),
        }
    }

    /// Brings a value into a vector register, which the operation at hand then keeps.
    fn in_register(&mut self, read: Read) -> u8 {
        let mut register = self.holder(read);
        if register == NOWHERE {
            register = self.load(read.register);
            if read.next != NEVER {
                self.hold(read.register, register, NOW);
            }
        }
        self.pinned |= 1 << register;
        register
    }

    /// Copies a value from the workspace into a vector register that is free.
    #[inline]
    fn load(&mut self, register: Register) -> u8 {
        let to = self.take();
        self.code.of_memory(Operation::LOAD, to, 0, self.home(register));
        self.unsaved &= !(1 << to);
        to
    }

    /// A vector register for the result of the operation at hand, the operands of which have been located: it may be one
    /// of theirs.
    fn result(&mut self, reads: &[Read]) -> u8 {
        self.used(reads);
        self.pinned = 0;
        self.take()
    }

    /// Counts the operands as read.
    fn used(&mut self, reads: &[Read]) {
        for read in reads {
            let register = self.holder(*read);
            if register != NOWHERE {
                self.read(register, read.next);
            }
        }
    }

    /// What a vector register holds has been read: where it is not read again, it gives that back. Of [`NOWHERE`] that says nothing.
    #[inline(always)]
    fn read(&mut self, register: u8, next: u32) {
        let is_last = next == NEVER;
        self.free |= u16::from(is_last) << register & ALL_HOLDERS;
        self.until[place(register)] = select_unpredictable(is_last, NOW, key(next, register));
    }

    /// A vector register, made free if need be: the one whose value is not read for longest. Operands of the instruction at hand
    /// are read now.
    #[inline]
    fn take(&mut self) -> u8 {
        let free = self.free & !self.pinned;
        if free != 0 { free.trailing_zeros() as u8 } else { self.evict() }
    }

    #[inline(never)]
    fn evict(&mut self) -> u8 {
        let most = self.until[..HOLDERS].iter().fold(0, |most, key| u32::max(most, *key));
        let best = 15 - (most & 15) as u8;
        self.vacate(best);
        best
    }

    /// Frees a vector register that holds something; that stays in the workspace.
    fn vacate(&mut self, register: u8) {
        let held = self.held[place(register)];
        self.free |= 1 << register;
        self.until[place(register)] = NOW;
        self.room.holder[held as usize] = NOWHERE;
        if self.unsaved & (1 << register) != 0 {
            self.code.of_memory(Operation::STORE, register, 0, self.home(held));
        }
        self.unsaved &= !(1 << register);
    }

    /// From now on a vector register holds a value, which is in the workspace, too, unless it is marked as not.
    #[inline]
    fn hold(&mut self, register: Register, by: u8, until: u32) {
        self.free &= !(1 << by);
        self.held[place(by)] = register;
        self.until[place(by)] = key(until, by);
        self.room.holder[register as usize] = by;
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
    #[inline]
    fn home(&self, register: Register) -> (u8, i32) {
        (self.base, offset(register))
    }
}
