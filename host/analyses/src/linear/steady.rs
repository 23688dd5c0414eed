//! How fast a linear model changes along the motion that it is of.
//!
//! Eigenvalues say what becomes of small changes where the model stays the same while the scene moves: in axes of the ground, as those
//! of rotors about axes of symmetry and of what travels straight on. So it is made once more a little later and compared, whatever bases
//! the two have: with S displacements and velocities of all bodies and element states by states, S1 P = S0 must have a solution, and
//! S1 (P A0 - A1 P) be nothing.

use nalgebra::{DMatrix, Matrix4, Vector3, Vector4};

use super::{Linear, reduce};
use crate::analysis::{Direction, Expansion, Function, Local};
use crate::plan::Layout;
use crate::session::Instant;

/// How far ahead: turns in rad, displacements in sizes of the scene.
const AHEAD: f64 = 0.02;
/// Changes below this are round-off.
const NONE: f64 = 1e-8;
/// Share of the largest singular value below which a direction is none.
const SPANS: f64 = 1e-11;

/// The change of a linear model in a unit of time on its size, 1/s, at an instant of a scene of a size, m; `rows` are those of `local`.
pub(super) fn unsteadiness(
    here: &Linear,
    instant: &Instant,
    (local, rows): (&mut Local, &[usize]),
    layout: &Layout,
    length: f64,
) -> f64 {
    let inputs = &instant.inputs;
    let vector = |slot: usize| Vector3::new(inputs[slot], inputs[slot + 1], inputs[slot + 2]);
    let fastest = (0..layout.bodies)
        .map(|body| {
            let at = layout.acceleration_slot() + 6 * body;
            let speed =
                vector(layout.body_slot(body, 10)).norm().max(vector(layout.body_slot(body, 7)).norm() / length);
            speed.max(vector(at + 3).norm().sqrt()).max((vector(at).norm() / length).sqrt())
        })
        .fold(0.0, f64::max);
    let step = AHEAD / fastest;
    let mut ahead = advanced(inputs, &here.expansion, local.states(), layout, step);
    let Some(there) = balanced(&mut ahead, (local, rows), layout).and_then(|expansion| reduce(&expansion).ok()) else {
        return f64::INFINITY;
    };
    let (s0, s1) = (seen(here, length, step), seen(&there, length, step));
    if s0.ncols() != s1.ncols() {
        return f64::INFINITY;
    }
    let decomposed = s1.clone().svd(true, true);
    let Ok(p) = decomposed.solve(&s0, SPANS * decomposed.singular_values.max()) else { return f64::INFINITY };
    let left = &s0 - &s1 * &p;
    let rates = &s0 * &here.a;
    let moved = &s1 * (&p * &here.a - &there.a * &p);
    let change = (0..s0.ncols())
        .map(|k| {
            let size = s0.column(k).norm();
            (left.column(k).norm() / size).max(moved.column(k).norm() / (rates.column(k).norm() + size / step))
        })
        .fold(0.0, f64::max);
    if change > NONE { change / step } else { 0.0 }
}

/// Displacements and velocities of all bodies, and element states, by states; turns on the size of the scene, velocities in a time.
fn seen(linear: &Linear, length: f64, time: f64) -> DMatrix<f64> {
    let (bodies, states) = (linear.positions.nrows(), linear.a.nrows());
    let mut all = DMatrix::zeros(2 * bodies + linear.element_states, states);
    all.rows_mut(0, bodies).copy_from(&linear.positions);
    all.rows_mut(bodies, bodies).copy_from(&(&linear.velocities * time));
    (0..2 * bodies).filter(|row| row % 6 >= 3).for_each(|row| all.row_mut(row).scale_mut(length));
    let first = states - linear.element_states;
    (0..linear.element_states).for_each(|k| all[(2 * bodies + k, first + k)] = 1.0);
    all
}

/// The inputs after a time in which bodies go on as they move.
fn advanced(inputs: &[f64], e: &Expansion, states: &[usize], layout: &Layout, time: f64) -> Vec<f64> {
    let mut ahead = inputs.to_vec();
    ahead[Layout::TIME] += time;
    for body in 0..layout.bodies {
        let at = layout.acceleration_slot() + 6 * body;
        for k in 0..3 {
            ahead[layout.body_slot(body, k)] +=
                time * (inputs[layout.body_slot(body, 7 + k)] + 0.5 * time * inputs[at + k]);
            ahead[layout.body_slot(body, 7 + k)] += time * inputs[at + k];
            ahead[layout.body_slot(body, 10 + k)] += time * inputs[at + 3 + k];
        }
        // p' = W p with W of the angular velocity in axes of the body; its square is -|omega'|^2 / 4.
        let spin: [f64; 3] =
            std::array::from_fn(|k| inputs[layout.body_slot(body, 10 + k)] + 0.5 * time * inputs[at + 3 + k]);
        let p = Vector4::from_fn(|k, _| inputs[layout.body_slot(body, 3 + k)]);
        let half = 0.5 * time * Vector3::from(spin).norm();
        let share = if half > 0.0 { half.sin() / half } else { 1.0 };
        let turned = p * half.cos() + by_spin(spin) * p * (share * time);
        let rates = by_spin(std::array::from_fn(|k| ahead[layout.body_slot(body, 10 + k)])) * turned;
        for k in 0..4 {
            ahead[layout.body_slot(body, 3 + k)] = turned[k];
            ahead[layout.body_slot(body, 13 + k)] = rates[k];
        }
    }
    let rates = e.value(Function::States);
    states.iter().enumerate().for_each(|(k, state)| ahead[layout.state_slot() + state] += time * rates[k]);
    ahead
}

/// Half the matrix of the product of Euler parameters with an angular velocity in axes of the body.
fn by_spin([x, y, z]: [f64; 3]) -> Matrix4<f64> {
    0.5 * Matrix4::new(0.0, -x, -y, -z, x, 0.0, z, -y, y, -z, 0.0, x, z, y, -x, 0.0)
}

/// The equations there, with reactions that are in balance: those of rows in axes of a body that turns are others.
fn balanced(ahead: &mut [f64], (local, rows): (&mut Local, &[usize]), layout: &Layout) -> Option<Expansion> {
    let first = local.at(ahead).ok()?;
    if rows.is_empty() {
        return Some(first);
    }
    let decomposed = first.slope(Function::Balance, Direction::Multipliers).svd(true, true);
    let largest = decomposed.singular_values.max();
    let change = decomposed.solve(&first.value(Function::Balance), SPANS * largest).ok()?;
    rows.iter().zip(change.iter()).for_each(|(row, change)| ahead[layout.multiplier_slot() + row] -= change);
    local.at(ahead).ok()
}
