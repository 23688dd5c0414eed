//! The interpreter of lists of operations.

use element_api::Table;

use super::tape::Instruction;
use super::turn::{cos, sin, sin_cos};

/// Runs a list of operations on the registers `x`. `[hot, no allocation]`
pub(super) fn interpret(instructions: &[Instruction], tables: &[Table], x: &mut [f64]) {
    let mut turned = f64::NAN;
    for instruction in instructions {
        match *instruction {
            Instruction::Add(d, a, b) => x[d as usize] = x[a as usize] + x[b as usize],
            Instruction::Sub(d, a, b) => x[d as usize] = x[a as usize] - x[b as usize],
            Instruction::Mul(d, a, b) => x[d as usize] = x[a as usize] * x[b as usize],
            Instruction::Div(d, a, b) => x[d as usize] = x[a as usize] / x[b as usize],
            Instruction::Neg(d, a) => x[d as usize] = -x[a as usize],
            Instruction::Sqrt(d, a) => x[d as usize] = x[a as usize].sqrt(),
            Instruction::Sin(d, a) => x[d as usize] = sin(x[a as usize]),
            Instruction::Cos(d, a) => x[d as usize] = cos(x[a as usize]),
            Instruction::Turn(d, a) => (x[d as usize], turned) = sin_cos(x[a as usize]),
            Instruction::Turned(d, _) => x[d as usize] = turned,
            Instruction::Atan2(d, a, b) => x[d as usize] = x[a as usize].atan2(x[b as usize]),
            Instruction::Exp(d, a) => x[d as usize] = x[a as usize].exp(),
            Instruction::Ln(d, a) => x[d as usize] = x[a as usize].ln(),
            Instruction::Tanh(d, a) => x[d as usize] = x[a as usize].tanh(),
            Instruction::Powi(d, a, n) => x[d as usize] = x[a as usize].powi(n),
            Instruction::Powf(d, ref power) => x[d as usize] = x[power.0 as usize].powf(power.1),
            Instruction::Select(d, ref all) => {
                let [a, b, c, e] = **all;
                x[d as usize] = if x[a as usize] < x[b as usize] { x[c as usize] } else { x[e as usize] };
            }
            Instruction::Table(d, a, table, order) => {
                x[d as usize] = tables[table as usize].derivative(x[a as usize], u32::from(order));
            }
        }
    }
}
