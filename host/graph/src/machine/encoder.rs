//! [`Code`]: the few instructions of x86-64 with AVX that the assembler needs, as bytes (Intel's manual, volume 2).

use std::hint::select_unpredictable;

use memmap2::{Mmap, MmapMut};

/// Bytes that are always free behind the end, for one operation with all that it may have to move.
const ROOM: usize = 512;

/// The function's argument that the workspace is, and where it is kept across calls: bases of addresses. All bases take no further
/// byte (SIB) to say so.
pub(super) const RDI: u8 = 7;
pub(super) const RBX: u8 = 3;
/// The function's arguments that the program's inputs and outputs are, and where the latter is kept across calls.
pub(super) const RDX: u8 = 2;
pub(super) const RCX: u8 = 1;
pub(super) const RBP: u8 = 5;

/// Where an operand is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// In a vector register, 0 to 15.
    Vector(u8),
    /// Bytes behind the address in [`RDI`], [`RBX`], [`RDX`], [`RCX`] or [`RBP`].
    Memory { base: u8, offset: i32 },
}

/// An instruction on vector registers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Operation {
    /// Its page of opcodes: 1 is 0F, 3 is 0F 3A.
    page: u8,
    /// What stands for a prefix: 1 is 66, 3 is F2.
    prefix: u8,
    /// The bit W.
    wide: bool,
    opcode: u8,
}

impl Operation {
    /// The root of the second operand.
    pub(super) const SQRT: Self = Self::of_numbers(0x51);
    /// Reads a number from memory; `first` is 0.
    pub(super) const LOAD: Self = Self::of_numbers(0x10);
    /// Writes `to` to memory; `first` is 0.
    pub(super) const STORE: Self = Self::of_numbers(0x11);
    /// The same for two numbers side by side.
    pub(super) const LOAD_TWO: Self = Self { page: 1, prefix: 1, wide: false, opcode: 0x10 };
    pub(super) const STORE_TWO: Self = Self { page: 1, prefix: 1, wide: false, opcode: 0x11 };
    /// All bits where the predicate holds; a byte with the predicate follows.
    pub(super) const COMPARE: Self = Self::of_numbers(0xC2);
    pub(super) const XOR: Self = Self { page: 1, prefix: 1, wide: false, opcode: 0x57 };
    /// Copies a register; `first` is 0.
    pub(super) const COPY: Self = Self { page: 1, prefix: 1, wide: false, opcode: 0x28 };
    /// The second operand where the register in the byte that follows, times 16, has its sign set, else `first`.
    pub(super) const BLEND: Self = Self { page: 3, prefix: 1, wide: false, opcode: 0x4B };
    /// From a general register, number of which stands for the second operand; `first` is 0.
    const FROM_GENERAL: Self = Self { page: 1, prefix: 1, wide: true, opcode: 0x6E };

    /// `to := first + second` of numbers, or what else the opcode says.
    pub(super) const fn of_numbers(opcode: u8) -> Self {
        Self { page: 1, prefix: 3, wide: false, opcode }
    }
}

/// How a second operand is said, in one number, so that one of two is taken at once: from the lowest on a byte with its mode and the
/// lower bits of a register, the bytes of its offset, and 1 for a register beyond 7.
#[derive(Debug, Clone, Copy)]
struct Second(u32);

impl Second {
    #[inline(always)]
    fn in_register(register: u8) -> Self {
        let register = u32::from(register);
        Self(0xC0 | register & 7 | register >> 3 << 16)
    }

    /// So many bytes behind the address in a register. Without an offset, [`RBP`] would mean something else.
    #[inline(always)]
    fn in_memory(base: u8, offset: i32) -> Self {
        let is_short = offset == i32::from(offset as i8);
        let mode = select_unpredictable(is_short, 0x0140, 0x0480);
        Self(u32::from(base) | if offset == 0 && base != RBP { 0 } else { mode })
    }
}

/// Machine code that is being written, where it is to be run.
#[derive(Debug)]
pub(super) struct Code {
    /// What is beyond `end` is nothing: pages that nothing was written to take no memory.
    bytes: MmapMut,
    end: usize,
}

/// Bytes for an operation with what it has to move: it takes 10 on average in the right sides of the benchmark scenes, and up to
/// twice that in long ones.
const BYTES_PER_OPERATION: usize = 20;

impl Code {
    /// With room for about so many operations.
    pub(super) fn with_room_for(operations: usize) -> std::io::Result<Self> {
        Ok(Self { bytes: MmapMut::map_anon(BYTES_PER_OPERATION * operations + ROOM)?, end: 0 })
    }

    /// From now on it may be run, and no longer written.
    pub(super) fn finish(self) -> std::io::Result<Mmap> {
        self.bytes.make_exec()
    }

    /// What was written.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.end]
    }

    /// Goes on at a multiple of so many bytes; gives where.
    pub(super) fn align(&mut self, alignment: usize) -> usize {
        self.end = self.end.next_multiple_of(alignment);
        self.make_room();
        self.end
    }

    /// To be called before each operation.
    pub(super) fn make_room(&mut self) {
        if self.bytes.len() < self.end + ROOM {
            let longer = MmapMut::map_anon(2 * self.bytes.len() + 8 * ROOM);
            let shorter = std::mem::replace(&mut self.bytes, longer.expect("memory for machine code"));
            self.bytes[..self.end].copy_from_slice(&shorter[..self.end]);
        }
    }

    /// Any instruction, ready made.
    pub(super) fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        self.bytes[self.end..self.end + N].copy_from_slice(&bytes);
        self.end += N;
    }

    /// `operation to, first, second`.
    #[inline]
    pub(super) fn vector(&mut self, operation: Operation, to: u8, first: u8, second: Place) {
        match second {
            Place::Vector(register) => self.of_registers(operation, to, first, register),
            Place::Memory { base, offset } => self.of_memory(operation, to, first, (base, offset)),
        }
    }

    /// The same, the second operand in a register.
    #[inline(always)]
    pub(super) fn of_registers(&mut self, operation: Operation, to: u8, first: u8, second: u8) {
        self.instruction(operation, to, first, (Second::in_register(second), 0));
    }

    /// The same, the second operand so many bytes behind the address in a register.
    #[inline(always)]
    pub(super) fn of_memory(&mut self, operation: Operation, to: u8, first: u8, (base, offset): (u8, i32)) {
        self.instruction(operation, to, first, (Second::in_memory(base, offset), offset));
    }

    /// The same, the second operand in a register if it is there, else in memory.
    #[inline(always)]
    pub(super) fn of_either(
        &mut self,
        operation: Operation,
        to: u8,
        first: u8,
        (is_there, register): (bool, u8),
        (base, offset): (u8, i32),
    ) {
        let (there, else_where) = (Second::in_register(register).0, Second::in_memory(base, offset).0);
        self.instruction(operation, to, first, (Second(select_unpredictable(is_there, there, else_where)), offset));
    }

    /// An instruction, with the offset where its second operand has one. Of both prefixes the shorter one that will do is taken
    /// without a branch, which could not be foreseen.
    #[inline(always)]
    fn instruction(&mut self, operation: Operation, to: u8, first: u8, (second, offset): (Second, i32)) {
        let [operands, length, far, _] = second.0.to_le_bytes();
        let Operation { page, prefix, wide, opcode } = operation;
        // Bits of registers beyond 7, and of `first`, are stored inverted.
        let beyond = (to >> 3 ^ 1) << 7;
        let rest = (!first & 15) << 3 | prefix;
        let tail = u64::from(opcode) | u64::from(operands | (to & 7) << 3) << 8 | u64::from(offset as u32) << 16;
        let long =
            u64::from(beyond | 1 << 6 | (far ^ 1) << 5 | page) << 8 | u64::from(u8::from(wide) << 7 | rest) << 16;
        let long = 0xC4 | long | tail << 24;
        let length = usize::from(length);
        if page != 1 || wide {
            self.put_some(long, 5 + length.min(3));
            if length > 3 {
                self.put([(tail >> 40) as u8]);
            }
            return;
        }
        let short = 0xC5 | u64::from(beyond | rest) << 8 | tail << 16;
        self.put_some(select_unpredictable(far == 0, short, long), 4 + usize::from(far) + length);
    }

    /// So many of these bytes; lower ones first.
    #[inline(always)]
    fn put_some(&mut self, bytes: u64, length: usize) {
        self.bytes[self.end..self.end + 8].copy_from_slice(&bytes.to_le_bytes());
        self.end += length;
    }

    /// Puts the bits of a number into a vector register. Overwrites rax.
    pub(super) fn constant(&mut self, to: u8, value: f64) {
        self.load_rax(value.to_bits());
        self.vector(Operation::FROM_GENERAL, to, 0, Place::Vector(0));
    }

    /// Calls the function at an address. Overwrites rax.
    pub(super) fn call(&mut self, address: u64) {
        self.load_rax(address);
        self.put([0xFF, 0xD0]);
    }

    fn load_rax(&mut self, value: u64) {
        self.put([0x48, 0xB8]);
        self.put(value.to_le_bytes());
    }

    /// The beginning of a function that calls others: rdi, rsi and rcx go to rbx, r12 and rbp, which survive calls, and the stack
    /// pointer to a multiple of 16.
    pub(super) fn enter(&mut self) {
        self.put([0x53]);
        self.put([0x41, 0x54]);
        self.put([0x55]);
        self.put([0x48, 0x8B, 0xDF]);
        self.put([0x4C, 0x8B, 0xE6]);
        self.put([0x48, 0x8B, 0xE9]);
    }

    /// Undoes [`Code::enter`].
    pub(super) fn leave(&mut self) {
        self.put([0x5D]);
        self.put([0x41, 0x5C]);
        self.put([0x5B]);
    }

    pub(super) fn ret(&mut self) {
        self.put([0xC3]);
    }

    /// `edi := value`
    pub(super) fn load_edi(&mut self, value: i32) {
        self.put([0xBF]);
        self.put(value.to_le_bytes());
    }

    /// `rdi := rbx + offset; esi := count`
    pub(super) fn load_place(&mut self, offset: i32, count: u32) {
        self.put([0x48, 0x8D, 0xBB]);
        self.put(offset.to_le_bytes());
        self.put([0xBE]);
        self.put(count.to_le_bytes());
    }

    /// `rdi := r12; esi := a; edx := b`
    pub(super) fn load_table(&mut self, a: u32, b: u32) {
        self.put([0x49, 0x8B, 0xFC]);
        self.put([0xBE]);
        self.put(a.to_le_bytes());
        self.put([0xBA]);
        self.put(b.to_le_bytes());
    }
}

#[cfg(test)]
mod tests;
