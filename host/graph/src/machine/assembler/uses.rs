//! [`Lookout`]: when the numbers that a list of operations computes and reads are read next.

use super::super::super::tape::{Instruction, Program};

/// Not used again.
pub(super) const NEVER: u32 = u32::MAX >> 1;

/// The bit of [`Uses::result`] that says that it is read after the list.
const STORED: u32 = 1 << 31;

/// What becomes of the numbers that an instruction has to do with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Uses {
    /// The next instruction that reads each of its operands; of a choice, which has four, its number among the choices.
    pub(super) next: [u32; 2],
    result: u32,
}

impl Uses {
    /// The first instruction that reads its result.
    pub(super) fn first(&self) -> u32 {
        self.result & !STORED
    }

    /// Whether its result is read after the list.
    pub(super) fn is_stored(&self) -> bool {
        self.result & STORED != 0
    }
}

/// The uses of all lists of one program after the other.
pub(super) struct Lookout {
    uses: Vec<Uses>,
    /// See [`Lookout::choices`].
    choices: Vec<[u32; 4]>,
    /// By list: where its uses begin; then where the last one's end.
    starts: Vec<usize>,
    /// By register: the next instruction of the list that reads it.
    next: Vec<u32>,
}

impl Lookout {
    pub(super) fn new(registers: usize) -> Self {
        Self { uses: Vec::new(), choices: Vec::new(), starts: Vec::new(), next: vec![NEVER; registers] }
    }

    /// Makes room for the lists of a program.
    pub(super) fn begin(&mut self, program: &Program) {
        self.starts.clear();
        self.starts.push(0);
        let mut end = 0;
        self.starts.extend(program.lists().map(|list| {
            end += list.len();
            end
        }));
        self.choices.clear();
        self.uses.clear();
        self.uses.reserve_exact(end);
        self.uses.resize(end, Uses { next: [NEVER; 2], result: NEVER });
    }

    /// The uses of a list.
    pub(super) fn of(&self, number: usize) -> &[Uses] {
        &self.uses[self.starts[number]..self.starts[number + 1]]
    }

    /// The next instructions that read the operands of each choice of the program, by its number.
    pub(super) fn choices(&self) -> &[[u32; 4]] {
        &self.choices
    }

    /// Looks at a list; turns the registers that are `live` after it, one flag each, into those live before. Fails on registers and
    /// tables that there are not: that instructions stay within the program's is what the machine code relies on.
    pub(super) fn look(&mut self, number: usize, list: &[Instruction], tables: usize, live: &mut [bool]) {
        self.next.fill(NEVER);
        let uses = &mut self.uses[self.starts[number]..self.starts[number + 1]];
        for (at, (instruction, uses)) in list.iter().zip(uses).enumerate().rev() {
            let at = at as u32;
            let result = instruction.result() as usize;
            let first = std::mem::replace(&mut self.next[result], NEVER);
            uses.result = first | if std::mem::take(&mut live[result]) { STORED } else { 0 };
            let next = &mut self.next[..];
            match *instruction {
                Instruction::Add(_, a, b)
                | Instruction::Sub(_, a, b)
                | Instruction::Mul(_, a, b)
                | Instruction::Div(_, a, b)
                | Instruction::Atan2(_, a, b) => {
                    (uses.next[0], uses.next[1]) = (next[a as usize], next[b as usize]);
                    (next[a as usize], next[b as usize]) = (at, at);
                }
                Instruction::Select(_, ref all) => {
                    uses.next[0] = self.choices.len() as u32;
                    self.choices.push(all.map(|register| next[register as usize]));
                    all.iter().copied().for_each(|register| next[register as usize] = at);
                }
                _ => {
                    instruction.operands(|register| uses.next[0] = std::mem::replace(&mut next[register as usize], at))
                }
            }
            if let Instruction::Table(_, _, table, _) = instruction {
                assert!((*table as usize) < tables, "a table too many");
            }
        }
        live.iter_mut().zip(&self.next).for_each(|(live, next)| *live |= *next != NEVER);
    }
}
