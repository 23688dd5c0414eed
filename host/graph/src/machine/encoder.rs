//! [`Code`]: the few instructions of x86-64 with AVX that the assembler needs, as bytes (Intel's manual, volume 2).

/// Bytes that are always free behind the end, for one operation with all that it may have to move.
const ROOM: usize = 512;

/// The function's argument that the workspace is, and where it is kept across calls: bases of addresses. All bases take no further
/// byte (SIB) to say so.
pub(super) const RDI: u8 = 7;
pub(super) const RBX: u8 = 3;
/// The function's arguments that the program's inputs and outputs are.
pub(super) const RDX: u8 = 2;
pub(super) const RCX: u8 = 1;

/// Where an operand is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// In a vector register, 0 to 15.
    Vector(u8),
    /// Bytes behind the address in [`RDI`], [`RBX`], [`RDX`] or [`RCX`].
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
    /// `to := first + second` of numbers; the others alike.
    pub(super) const ADD: Self = Self::of_numbers(0x58);
    pub(super) const SUB: Self = Self::of_numbers(0x5C);
    pub(super) const MUL: Self = Self::of_numbers(0x59);
    pub(super) const DIV: Self = Self::of_numbers(0x5E);
    /// The root of the second operand.
    pub(super) const SQRT: Self = Self::of_numbers(0x51);
    /// Reads a number from memory; `first` is 0.
    pub(super) const LOAD: Self = Self::of_numbers(0x10);
    /// Writes `to` to memory; `first` is 0.
    pub(super) const STORE: Self = Self::of_numbers(0x11);
    /// All bits where the predicate holds; a byte with the predicate follows.
    pub(super) const COMPARE: Self = Self::of_numbers(0xC2);
    pub(super) const XOR: Self = Self { page: 1, prefix: 1, wide: false, opcode: 0x57 };
    /// Copies a register; `first` is 0.
    pub(super) const COPY: Self = Self { page: 1, prefix: 1, wide: false, opcode: 0x28 };
    /// The second operand where the register in the byte that follows, times 16, has its sign set, else `first`.
    pub(super) const BLEND: Self = Self { page: 3, prefix: 1, wide: false, opcode: 0x4B };
    /// From a general register, number of which stands for the second operand; `first` is 0.
    const FROM_GENERAL: Self = Self { page: 1, prefix: 1, wide: true, opcode: 0x6E };

    const fn of_numbers(opcode: u8) -> Self {
        Self { page: 1, prefix: 3, wide: false, opcode }
    }
}

/// How an offset is said, and in how many bytes.
fn mode(offset: i32) -> (u8, usize) {
    match i8::try_from(offset) {
        Ok(0) => (0, 0),
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
        // Bits of registers beyond 7, and of `first`, are stored inverted.
        let near = (to >> 3 ^ 1) << 7;
        let rest = (!first & 15) << 3 | operation.prefix;
        let (far, of_second, offset, length) = match second {
            Place::Vector(register) => (register >> 3, 0xC0 | register & 7, 0, 0),
            Place::Memory { base, offset } => {
                let (mode, length) = mode(offset);
                (0, mode | base, offset as u32, length)
            }
        };
        let operands = of_second | (to & 7) << 3;
        if operation.page == 1 && !operation.wide && far == 0 {
            let start = u32::from_le_bytes([0xC5, near | rest, operation.opcode, operands]);
            return self.put_some(u128::from(start) | u128::from(offset) << 32, 4 + length);
        }
        // The longer prefix, which has room for everything.
        let pages = near | 1 << 6 | (far ^ 1) << 5 | operation.page;
        let start = [0xC4, pages, u8::from(operation.wide) << 7 | rest, operation.opcode, operands, 0, 0, 0];
        self.put_some(u128::from(u64::from_le_bytes(start)) | u128::from(offset) << 40, 5 + length);
    }

    /// So many of these bytes, at most 16; lower ones first.
    #[inline]
    fn put_some(&mut self, bytes: u128, length: usize) {
        self.bytes[self.end..self.end + 16].copy_from_slice(&bytes.to_le_bytes());
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

    /// The beginning of a function that calls others: rdi and rsi go to rbx and r12, which survive calls, rcx to the stack, and
    /// the stack pointer to a multiple of 16.
    pub(super) fn enter(&mut self) {
        self.put([0x53]);
        self.put([0x41, 0x54]);
        self.put([0x51]);
        self.put([0x48, 0x8B, 0xDF]);
        self.put([0x4C, 0x8B, 0xE6]);
    }

    /// Takes rcx from the stack again, after the last call.
    pub(super) fn restore_rcx(&mut self) {
        self.put([0x59]);
    }

    /// Undoes the rest of [`Code::enter`].
    pub(super) fn leave(&mut self) {
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
