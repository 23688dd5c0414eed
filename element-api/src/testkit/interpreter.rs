//! The plainest evaluation of a [`Recording`]: the oracle of the host's programs.

use crate::recording::{Input, Op, Recording, Role};
use crate::scalar::Scalar;
use crate::testkit::Setting;

/// Carries out a recording operation by operation and gives its results with their meaning.
///
/// # Panics
/// When the recording refers to something that is not there; [`Recording::check`] finds that beforehand.
#[must_use]
pub fn interpret(recording: &Recording, setting: &Setting, coordinates: &[f64]) -> Vec<(Role, f64)> {
    interpret_with(recording, |input| setting.read(input, coordinates))
}

/// [`interpret`] with any scalar, for example with [`crate::Jet`], which differentiates the recording.
///
/// # Panics
/// As [`interpret`].
#[must_use]
pub fn interpret_with<S: Scalar>(recording: &Recording, read: impl Fn(Input) -> S) -> Vec<(Role, S)> {
    let mut values: Vec<S> = Vec::with_capacity(recording.ops.len());
    for raw in &recording.ops {
        let op = Op::decode(*raw).expect("known operation");
        let v = |k: u32| values[k as usize];
        let constant = |k: u32| recording.constants[k as usize];
        let value = match op {
            Op::Constant(k) => S::from(constant(k)),
            Op::Input(input) => read(input),
            Op::Add(a, b) => v(a) + v(b),
            Op::Sub(a, b) => v(a) - v(b),
            Op::Mul(a, b) => v(a) * v(b),
            Op::Div(a, b) => v(a) / v(b),
            Op::Neg(a) => -v(a),
            Op::Sqrt(a) => v(a).sqrt(),
            Op::Sin(a) => v(a).sin(),
            Op::Cos(a) => v(a).cos(),
            Op::Atan2(a, b) => v(a).atan2(v(b)),
            Op::Exp(a) => v(a).exp(),
            Op::Ln(a) => v(a).ln(),
            Op::Tanh(a) => v(a).tanh(),
            Op::Powi(a, n) => v(a).powi(n),
            Op::Powf(a, k) => v(a).powf(constant(k)),
            Op::Select(a, b, x, y) => S::select(v(a), v(b), v(x), v(y)),
            Op::Table(table, a) => v(a).lookup(&recording.tables[table as usize]),
        };
        values.push(value);
    }
    recording.outputs.iter().map(|output| (output.role, values[output.node as usize])).collect()
}
