//! [`Lanes`]: a program evaluated for several instances at once, a batch of parameter sets or of states.
//!
//! Every register holds the numbers of all instances side by side, so that an instruction is read and decoded once for all
//! of them and the compiler can turn its loop into vector instructions. Each lane sees the operations of the interpreter in
//! the same order, none fused: its results are those of [`Program::run`], bit for bit.
//!
//! Programs that call opaque elements have no lanes.

use element_api::Table;

use super::tape::{Instruction, Program};
use super::turn::{cos, sin, turn};

/// The scratch numbers of `L` instances of one program; 4 or 8 are sensible.
#[derive(Debug, Clone)]
pub struct Lanes<const L: usize> {
    numbers: Vec<[f64; L]>,
}

impl Program {
    /// The scratch numbers for `L` instances; `None` if the program calls opaque elements.
    #[must_use]
    pub fn lanes<const L: usize>(&self) -> Option<Lanes<L>> {
        if self.calls() > 0 {
            return None;
        }
        let mut numbers = vec![[0.0; L]; self.registers];
        for (register, constant) in numbers.iter_mut().zip(&self.constants) {
            *register = [*constant; L];
        }
        Some(Lanes { numbers })
    }

    /// Evaluates the program for `L` instances: `inputs[slot]` and `outputs[k]` have a number for each. `lanes` are those
    /// of this program. Interpreted, whether there is machine code or not. `[hot, no allocation]`
    pub fn run_lanes<const L: usize>(&self, inputs: &[[f64; L]], lanes: &mut Lanes<L>, outputs: &mut [[f64; L]]) {
        let numbers = &mut lanes.numbers[..];
        for (slot, register) in &self.inputs {
            numbers[*register as usize] = inputs[*slot as usize];
        }
        for operations in self.lists() {
            interpret(operations, &self.tables, numbers);
        }
        for (slot, register) in outputs.iter_mut().zip(&self.outputs) {
            *slot = numbers[*register as usize];
        }
    }
}

fn interpret<const L: usize>(instructions: &[Instruction], tables: &[Table], x: &mut [[f64; L]]) {
    let mut turned = [f64::NAN; L];
    for instruction in instructions {
        match *instruction {
            Instruction::Add(d, a, b) => x[d as usize] = both(&x[a as usize], &x[b as usize], |a, b| a + b),
            Instruction::Sub(d, a, b) => x[d as usize] = both(&x[a as usize], &x[b as usize], |a, b| a - b),
            Instruction::Mul(d, a, b) => x[d as usize] = both(&x[a as usize], &x[b as usize], |a, b| a * b),
            Instruction::Div(d, a, b) => x[d as usize] = both(&x[a as usize], &x[b as usize], |a, b| a / b),
            Instruction::Atan2(d, a, b) => x[d as usize] = both(&x[a as usize], &x[b as usize], f64::atan2),
            Instruction::Neg(d, a) => x[d as usize] = x[a as usize].map(|a| -a),
            Instruction::Sqrt(d, a) => x[d as usize] = x[a as usize].map(f64::sqrt),
            Instruction::Sin(d, a) => x[d as usize] = x[a as usize].map(sin),
            Instruction::Cos(d, a) => x[d as usize] = x[a as usize].map(cos),
            Instruction::Turn(d, a) => (x[d as usize], turned) = turn(&x[a as usize]),
            Instruction::Turned(d, _) => x[d as usize] = turned,
            Instruction::Exp(d, a) => x[d as usize] = x[a as usize].map(f64::exp),
            Instruction::Ln(d, a) => x[d as usize] = x[a as usize].map(f64::ln),
            Instruction::Tanh(d, a) => x[d as usize] = x[a as usize].map(f64::tanh),
            Instruction::Powi(d, a, n) => x[d as usize] = x[a as usize].map(|a| a.powi(n)),
            Instruction::Powf(d, a, e) => x[d as usize] = x[a as usize].map(|a| a.powf(e)),
            Instruction::Select(d, [a, b, yes, no]) => {
                let below = both(&x[a as usize], &x[b as usize], |a, b| a < b);
                let (yes, no) = (x[yes as usize], x[no as usize]);
                x[d as usize] = std::array::from_fn(|lane| if below[lane] { yes[lane] } else { no[lane] });
            }
            Instruction::Table(d, a, table, order) => {
                x[d as usize] = x[a as usize].map(|a| tables[table as usize].derivative(a, order));
            }
        }
    }
}

/// An operation with two operands in every lane.
#[inline(always)]
fn both<T, const L: usize>(a: &[f64; L], b: &[f64; L], operation: impl Fn(f64, f64) -> T) -> [T; L] {
    std::array::from_fn(|lane| operation(a[lane], b[lane]))
}
