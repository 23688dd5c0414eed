//! The plainest evaluation of a [`Recording`]: the oracle of the host's programs.

use crate::recording::{Input, Op, Recording, Role};
use crate::testkit::Setting;

/// Carries out a recording operation by operation and gives its results with their meaning.
///
/// # Panics
/// When the recording refers to something that is not there; [`Recording::check`] finds that beforehand.
#[must_use]
pub fn interpret(recording: &Recording, setting: &Setting, coordinates: &[f64]) -> Vec<(Role, f64)> {
    let mut values: Vec<f64> = Vec::with_capacity(recording.ops.len());
    for raw in &recording.ops {
        let op = Op::decode(*raw).expect("known operation");
        let v = |k: u32| values[k as usize];
        let constant = |k: u32| recording.constants[k as usize];
        let value = match op {
            Op::Constant(k) => constant(k),
            Op::Input(input) => read(input, setting, coordinates),
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
            Op::Select(a, b, x, y) => {
                if v(a) < v(b) {
                    v(x)
                } else {
                    v(y)
                }
            }
            Op::Table(table, a) => recording.tables[table as usize].derivative(v(a), 0),
        };
        values.push(value);
    }
    recording.outputs.iter().map(|output| (output.role, values[output.node as usize])).collect()
}

fn read(input: Input, setting: &Setting, coordinates: &[f64]) -> f64 {
    match input {
        Input::Time => setting.time,
        Input::Position { frame, component } => setting.frames[frame as usize].position[component as usize],
        Input::Rotation { frame, row, column } => {
            setting.frames[frame as usize].rotation[(row as usize, column as usize)]
        }
        Input::Velocity { frame, component } => setting.twists[frame as usize].velocity[component as usize],
        Input::AngularVelocity { frame, component } => {
            setting.twists[frame as usize].angular_velocity[component as usize]
        }
        Input::AngleReference(k) => setting.references[k as usize],
        Input::State(k) => setting.states[k as usize],
        Input::Discrete(k) => setting.memory[k as usize],
        Input::Signal(k) => panic!("signal {k} is reserved"),
        Input::Coordinate(k) => coordinates[k as usize],
    }
}
