//! The interpreter of lists of operations, for one number and for many side by side.

use element_api::Table;

use super::kernels::LANES;
use super::tape::{Instruction, Register};
use super::turn::{cos, sin, sin_cos, turn};

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
            Instruction::Powf(d, a, e) => x[d as usize] = x[a as usize].powf(e),
            Instruction::Select(d, [a, b, c, e]) => {
                x[d as usize] = if x[a as usize] < x[b as usize] { x[c as usize] } else { x[e as usize] };
            }
            Instruction::Table(d, a, table, order) => {
                x[d as usize] = tables[table as usize].derivative(x[a as usize], order);
            }
        }
    }
}

/// The same for many cells at once, one on each lane.
pub(super) fn interpret_lanes(instructions: &[Instruction], tables: &[Table], x: &mut [[f64; LANES]]) {
    let mut turned = [f64::NAN; LANES];
    for instruction in instructions {
        match *instruction {
            Instruction::Add(d, a, b) => two(x, d, a, b, |a, b| a + b),
            Instruction::Sub(d, a, b) => two(x, d, a, b, |a, b| a - b),
            Instruction::Mul(d, a, b) => two(x, d, a, b, |a, b| a * b),
            Instruction::Div(d, a, b) => two(x, d, a, b, |a, b| a / b),
            Instruction::Neg(d, a) => one(x, d, a, |a| -a),
            Instruction::Sqrt(d, a) => one(x, d, a, f64::sqrt),
            Instruction::Sin(d, a) => one(x, d, a, sin),
            Instruction::Cos(d, a) => one(x, d, a, cos),
            Instruction::Turn(d, a) => (x[d as usize], turned) = turn(&x[a as usize]),
            Instruction::Turned(d, _) => x[d as usize] = turned,
            Instruction::Atan2(d, a, b) => two(x, d, a, b, f64::atan2),
            Instruction::Exp(d, a) => one(x, d, a, f64::exp),
            Instruction::Ln(d, a) => one(x, d, a, f64::ln),
            Instruction::Tanh(d, a) => one(x, d, a, f64::tanh),
            Instruction::Powi(d, a, n) => one(x, d, a, |a| a.powi(n)),
            Instruction::Powf(d, a, e) => one(x, d, a, |a| a.powf(e)),
            Instruction::Select(d, [a, b, c, e]) => {
                let (a, b, c, e) = (x[a as usize], x[b as usize], x[c as usize], x[e as usize]);
                x[d as usize] = std::array::from_fn(|lane| if a[lane] < b[lane] { c[lane] } else { e[lane] });
            }
            Instruction::Table(d, a, table, order) => one(x, d, a, |a| tables[table as usize].derivative(a, order)),
        }
    }
}

fn one(x: &mut [[f64; LANES]], d: Register, a: Register, f: impl Fn(f64) -> f64) {
    let a = x[a as usize];
    x[d as usize] = std::array::from_fn(|lane| f(a[lane]));
}

fn two(x: &mut [[f64; LANES]], d: Register, a: Register, b: Register, f: impl Fn(f64, f64) -> f64) {
    let (a, b) = (x[a as usize], x[b as usize]);
    x[d as usize] = std::array::from_fn(|lane| f(a[lane], b[lane]));
}
