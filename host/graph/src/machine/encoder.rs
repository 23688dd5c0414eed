//! [`Code`]: the few instructions of x86-64 with AVX that the assembler needs, as bytes (Intel's manual, volume 2).

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

    /// Whether the prefix of two bytes says all, where the second operand is no register beyond 7.
    #[inline(always)]
    const fn has_short_prefix(self) -> bool {
        self.page == 1 && !self.wide
    }

    /// The instruction with the prefix of two bytes; `second` is the lower six bits of how the second operand is said, and its mode.
    #[inline(always)]
    const fn behind_short_prefix(self, to: u8, first: u8, second: u8) -> u32 {
        // Bits of registers beyond 7, and of `first`, are stored inverted.
        let none = 0xC5 | (0xF8 | self.prefix as u32) << 8 | (self.opcode as u32) << 16;
        let (to, first) = (to as u32, first as u32);
        none ^ (to >> 3) << 15 ^ first << 11 ^ (to & 7) << 27 ^ (second as u32) << 24
    }

    /// The same with the prefix of three bytes, which has room for everything; `far` is 1 for a second register beyond 7.
    #[inline(always)]
    const fn behind_long_prefix(self, to: u8, first: u8, far: u8, second: u8) -> u64 {
        let pages = (to as u64 >> 3 ^ 1) << 7 | 1 << 6 | (far as u64 ^ 1) << 5 | self.page as u64;
        let rest = (self.wide as u64) << 7 | (!first as u64 & 15) << 3 | self.prefix as u64;
        let operands = second as u64 | (to as u64 & 7) << 3;
        0xC4 | pages << 8 | rest << 16 | (self.opcode as u64) << 24 | operands << 32
    }
}

/// How an offset is said, and in how many bytes. Without one, [`RBP`] would mean something else.
#[inline]
fn mode(base: u8, offset: i32) -> (u8, usize) {
    match i8::try_from(offset) {
        Ok(0) if base != RBP => (0, 0),
        Ok(_) => (0x40, 1),
        Err(_) => (0x80, 4),
    }
}

/// Machine code that is being written.
#[derive(Debug, Default)]
pub(super) struct Code {
    /// What is beyond `end` is nothing.
    bytes: Vec<u8>,
    end: usize,
}

/// Bytes that an operation takes, on average, with what it has to move: measured on the right sides of the benchmark scenes.
const BYTES_PER_OPERATION: usize = 10;

impl Code {
    /// With room for about so many operations.
    pub(super) fn with_room_for(operations: usize) -> Self {
        Self { bytes: vec![0; BYTES_PER_OPERATION * operations + ROOM], end: 0 }
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
            self.bytes.resize(2 * self.bytes.len() + 8 * ROOM, 0);
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
        if second < 8 && operation.has_short_prefix() {
            let start = operation.behind_short_prefix(to, first, 0xC0 | second);
            return self.put_some(u64::from(start), 4);
        }
        let start = operation.behind_long_prefix(to, first, second >> 3, 0xC0 | second & 7);
        self.put_some(start, 5);
    }

    /// The same, the second operand so many bytes behind the address in a register.
    #[inline(always)]
    pub(super) fn of_memory(&mut self, operation: Operation, to: u8, first: u8, (base, offset): (u8, i32)) {
        let (mode, length) = mode(base, offset);
        let offset = u64::from(offset as u32);
        if operation.has_short_prefix() {
            let start = operation.behind_short_prefix(to, first, mode | base);
            return self.put_some(u64::from(start) | offset << 32, 4 + length);
        }
        let start = operation.behind_long_prefix(to, first, 0, mode | base);
        self.put_some(start | offset << 40, 5 + length.min(3));
        if length > 3 {
            self.put([(offset >> 24) as u8]);
        }
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
