//! How fast a linear model changes along the motion that it is of, and the axes in which it changes least.
//!
//! Eigenvalues say what becomes of small changes where the model stays the same while the scene moves: in axes of the ground, as those
//! of rotors about axes of symmetry and of what travels straight on, or in axes that turn, where the scene turns as one (a relative
//! equilibrium: Marsden, "Lectures on Mechanics", 1992, ch. 4), as a governor, a rotor with blades, a satellite on its orbit or a
//! vehicle in a steady bend. So it is made once more a little later and compared, whatever bases the two have: with S displacements and
//! velocities of all bodies and element states by states, in these axes, S1 P = S0 must have a solution, and S1 (P A0 - A1 P) be nothing.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, Rotation3, Vector3, Vector4};

use super::{Linear, reduce};
use crate::analysis::{Direction, Expansion, Function, Local};
use crate::linalg::{DEFAULT_RANK_TOLERANCE, PivotedQr};
use crate::plan::Layout;
use crate::session::Instant;

/// How far ahead: turns in rad, displacements in sizes of the scene.
const AHEAD: f64 = 0.02;
/// Changes below this are round-off.
const NONE: f64 = 1e-8;
/// Share of the fastest motion up to which bodies may move otherwise than with axes that are worth a look, and of what changes in axes of
/// the ground up to which it may change in others that are better.
const NEARLY: f64 = 1e-2;
/// Share of the largest below which a direction of the turning is not determined by how bodies move.
const DETERMINED: f64 = 1e-6;
/// Angular velocities of axes that are looked at.
const MOST_AXES: usize = 8;

/// Axes, and the model in them.
#[derive(Default)]
pub(super) struct Axes {
    /// Their angular velocity, rad/s.
    pub(super) turning: Vector3<f64>,
    /// Rates of states by states in them, where they turn.
    pub(super) turned: Option<DMatrix<f64>>,
    /// The change of the model in a unit of time on its size, 1/s.
    pub(super) unsteadiness: f64,
}

impl Linear {
    /// Rates of states by states that are seen in axes with this angular velocity W: less W x (delta x, delta v).
    fn in_axes(&self, turning: Vector3<f64>) -> DMatrix<f64> {
        let (mut a, mut first) = (self.a.clone(), 0);
        if turning == Vector3::zeros() {
            return a;
        }
        for (components, of) in self.components.iter().zip([&self.positions, &self.velocities]) {
            let mut with_axes = of.clone();
            for at in (0..of.nrows()).step_by(3) {
                with_axes.rows_mut(at, 3).copy_from(&(turning.cross_matrix() * of.rows(at, 3)));
            }
            let mut rates = a.rows_mut(first, components.nrows());
            rates -= components * with_axes;
            first += components.nrows();
        }
        a
    }
}

/// How bodies move: velocity, angular velocity and their rates, ground axes, turns times the size of the scene.
struct Motion([Vector3<f64>; 4]);

/// The axes in which a model changes least, at an instant of a scene of a size, m; `rows` are those of `local`. Those of the ground
/// where it stays the same in them.
pub(super) fn axes(
    here: &Linear,
    instant: &Instant,
    (local, rows): (&mut Local, &[usize]),
    layout: &Layout,
    length: f64,
) -> Axes {
    if here.a.is_empty() {
        return Axes::default();
    }
    let inputs = &instant.inputs;
    let motions = motions(inputs, layout, length);
    let fastest = motions.iter().map(|motion| motion.speed(length) / length).fold(0.0, f64::max);
    let step = AHEAD / fastest;
    let mut look = |turning: Vector3<f64>, a: &DMatrix<f64>| {
        let mut ahead = advanced(inputs, &here.expansion, local.states(), layout, (step, turning));
        let there = balanced(&mut ahead, (&mut *local, rows), layout);
        let there = there.and_then(|expansion| reduce(&expansion).ok());
        there.map_or(f64::INFINITY, |there| {
            let left = if turning == Vector3::zeros() { 0.0 } else { left(&there.expansion, &ahead, layout, length) };
            rate(change((here, a), &there, length, (step, turning)).max(left), step)
        })
    };
    let mut best = Axes { unsteadiness: look(Vector3::zeros(), &here.a), ..Axes::default() };
    let with = |turning: &Vector3<f64>, motion: &Motion| {
        let [v, spin, a, alpha] = &motion.0;
        let off = |rate: &Vector3<f64>, of: &Vector3<f64>| (rate - turning.cross(of)).norm();
        off(a, v).max(off(alpha, spin)) <= NEARLY * length * fastest.powi(2)
    };
    let candidates = turnings(&motions, length).into_iter().filter(|turning| turning.norm() > NONE * fastest);
    for turning in candidates.filter(|turning| motions.iter().all(|motion| with(turning, motion))).take(MOST_AXES) {
        if best.unsteadiness == 0.0 {
            break;
        }
        let turned = here.in_axes(turning);
        let unsteadiness = look(turning, &turned);
        if unsteadiness < NEARLY * best.unsteadiness {
            best = Axes { turning, turned: Some(turned), unsteadiness };
        }
    }
    best
}

fn motions(inputs: &[f64], layout: &Layout, length: f64) -> Vec<Motion> {
    let vector = |slot: usize| Vector3::new(inputs[slot], inputs[slot + 1], inputs[slot + 2]);
    let of = |body: usize| {
        let turn = crate::model::rotation(&std::array::from_fn(|k| inputs[layout.body_slot(body, 3 + k)]));
        let at = layout.acceleration_slot() + 6 * body;
        let [spin, alpha] = [layout.body_slot(body, 10), at + 3].map(|slot| turn * vector(slot) * length);
        Motion([vector(layout.body_slot(body, 7)), spin, vector(at), alpha])
    };
    (0..layout.bodies).map(of).collect()
}

impl Motion {
    /// The larger of its speeds, m/s, or what its accelerations make of it.
    fn speed(&self, length: f64) -> f64 {
        let [v, spin, a, alpha] = self.0.each_ref().map(Vector3::norm);
        v.max(spin).max((a.max(alpha) * length).sqrt())
    }
}

/// The angular velocities W with which bodies may turn as one: a = W x v and alpha = W x omega of all, as nearly as may be. Where all
/// that moves so is along one direction, W is along it, too, and as that of one of the bodies.
fn turnings(motions: &[Motion], length: f64) -> Vec<Vector3<f64>> {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for Motion([v, spin, a, alpha]) in motions {
        for (of, rate) in [(v, a), (spin, alpha)] {
            matrix += Matrix3::identity() * of.norm_squared() - of * of.transpose();
            right += of.cross(rate);
        }
    }
    // Where speeds have no square.
    if !(matrix.sum() + right.sum()).is_finite() {
        return Vec::new();
    }
    let found = matrix.symmetric_eigen();
    let largest = found.eigenvalues.max();
    let (mut own, mut open) = (Vector3::zeros(), None);
    for (value, direction) in found.eigenvalues.iter().zip(found.eigenvectors.column_iter()) {
        if *value > DETERMINED * largest {
            own += direction * (direction.dot(&right) / value);
        } else {
            open = Some(direction.into_owned());
        }
    }
    let clean = |turning: Vector3<f64>| turning.map(|part| if part.abs() > NONE * turning.norm() { part } else { 0.0 });
    let Some(open) = open else { return vec![clean(own)] };
    let mut found: Vec<Vector3<f64>> = Vec::new();
    for Motion([_, spin, ..]) in motions {
        let turning = clean(own + open * (open.dot(spin) / length));
        if !found.iter().any(|known| (known - turning).norm() <= DETERMINED * turning.norm()) {
            found.push(turning);
        }
    }
    found
}

/// A change on its size in a time, by the time; zero where it is round-off.
fn rate(change: f64, step: f64) -> f64 {
    if change > NONE { change / step } else { 0.0 }
}

/// What is not in balance although the scene turns on as one, on the size of loads and inertia.
fn left(e: &Expansion, ahead: &[f64], layout: &Layout, length: f64) -> f64 {
    let left = e.value(Function::Balance);
    let share = |body: usize| {
        let (row, at) = (6 * body, layout.acceleration_slot() + 6 * body);
        let [a, alpha] = [at, at + 3].map(|slot| Vector3::new(ahead[slot], ahead[slot + 1], ahead[slot + 2]).norm());
        let inertia = [e.mass[(row, row)] * a, e.mass.fixed_view::<3, 3>(row + 3, row + 3).norm() * alpha];
        let both = |of: &DVector<f64>, [force, moment]: [f64; 2]| {
            (of.rows(row, 3).norm() + force) * length + of.rows(row + 3, 3).norm() + moment
        };
        let size = both(&e.sizes, inertia);
        if size > 0.0 { both(&left, [0.0; 2]) / size } else { 0.0 }
    };
    (0..layout.bodies).map(share).fold(0.0, f64::max)
}

/// The change of a model on its way to another, on its size: as seen in axes with this angular velocity.
fn change(
    (here, a): (&Linear, &DMatrix<f64>),
    there: &Linear,
    length: f64,
    (step, turning): (f64, Vector3<f64>),
) -> f64 {
    let back = Rotation3::new(-turning * step);
    let (s0, s1) = (seen(here, length, step, &Rotation3::identity()), seen(there, length, step, &back));
    if s0.ncols() != s1.ncols() {
        return f64::INFINITY;
    }
    let Some(p) = closest(&s1, &s0) else { return f64::INFINITY };
    let left = &s0 - &s1 * &p;
    let rates = &s0 * a;
    let moved = &s1 * (&p * a - there.in_axes(turning) * &p);
    (0..s0.ncols())
        .map(|k| {
            let size = s0.column(k).norm();
            (left.column(k).norm() / size).max(moved.column(k).norm() / (rates.column(k).norm() + size / step))
        })
        .fold(0.0, f64::max)
}

/// Displacements and velocities of all bodies, turned, and element states, by states; turns on the size of the scene, velocities in a
/// time.
fn seen(linear: &Linear, length: f64, time: f64, turn: &Rotation3<f64>) -> DMatrix<f64> {
    let (bodies, states) = (linear.positions.nrows(), linear.a.nrows());
    let mut all = DMatrix::zeros(2 * bodies + linear.element_states, states);
    all.rows_mut(0, bodies).copy_from(&linear.positions);
    all.rows_mut(bodies, bodies).copy_from(&(&linear.velocities * time));
    for at in (0..2 * bodies).step_by(3) {
        let turned = turn.matrix() * all.rows(at, 3) * if at % 6 == 3 { length } else { 1.0 };
        all.rows_mut(at, 3).copy_from(&turned);
    }
    let first = states - linear.element_states;
    (0..linear.element_states).for_each(|k| all[(2 * bodies + k, first + k)] = 1.0);
    all
}

/// The inputs after a time in which bodies continue to move as they do, seen in axes with this angular velocity W: v there changes by
/// a - W x v, and omega by alpha - W x omega.
fn advanced(
    inputs: &[f64],
    e: &Expansion,
    states: &[usize],
    layout: &Layout,
    (time, turning): (f64, Vector3<f64>),
) -> Vec<f64> {
    let vector = |slot: usize| Vector3::new(inputs[slot], inputs[slot + 1], inputs[slot + 2]);
    let with_axes = Rotation3::new(turning * time);
    let half_way = Rotation3::new(turning * (0.5 * time));
    // The mean of what turns with the axes: along their axis, and across it by the sine of half the turn.
    let half = 0.5 * time * turning.norm();
    let share = if half > 0.0 { half.sin() / half } else { 1.0 };
    let mean = |of: Vector3<f64>| {
        let axis = turning.try_normalize(0.0).unwrap_or_default();
        let along = axis * axis.dot(&of);
        along + half_way * (of - along) * share
    };
    let mut ahead = inputs.to_vec();
    ahead[Layout::TIME] += time;
    for body in 0..layout.bodies {
        let at = layout.acceleration_slot() + 6 * body;
        let p = Vector4::from_fn(|k, _| inputs[layout.body_slot(body, 3 + k)]);
        let to_body = crate::model::rotation(&p.into()).transpose();
        let (v, spin) = (vector(layout.body_slot(body, 7)), vector(layout.body_slot(body, 10)));
        let own_turning = to_body * turning;
        let (a, alpha) = (vector(at) - turning.cross(&v), vector(at + 3) - own_turning.cross(&spin));
        let moved = mean(v) * time + with_axes * a * (0.5 * time * time);
        // With the axes, and beside them by what it turns more: p' = p (W in axes of the body).
        let turned = by_turn(own_turning * time) * p;
        let beside = spin - own_turning + alpha * (0.5 * time);
        let turned = by_turn(beside * time) * turned;
        let as_body = Rotation3::new(beside * -time);
        let (v, spin) = (with_axes * (v + a * time), as_body * (spin + alpha * time));
        let (a, alpha) = (with_axes * vector(at), as_body * vector(at + 3));
        let rates = by_spin(spin) * turned;
        for k in 0..3 {
            ahead[layout.body_slot(body, k)] += moved[k];
            ahead[layout.body_slot(body, 7 + k)] = v[k];
            ahead[layout.body_slot(body, 10 + k)] = spin[k];
            ahead[at + k] = a[k];
            ahead[at + 3 + k] = alpha[k];
        }
        for k in 0..4 {
            ahead[layout.body_slot(body, 3 + k)] = turned[k];
            ahead[layout.body_slot(body, 13 + k)] = rates[k];
        }
    }
    let rates = e.value(Function::States);
    states.iter().enumerate().for_each(|(k, state)| ahead[layout.state_slot() + state] += time * rates[k]);
    ahead
}

/// The matrix of the product of Euler parameters with those of a turn in axes of the body.
fn by_turn(turn: Vector3<f64>) -> Matrix4<f64> {
    let half = 0.5 * turn.norm();
    let share = if half > 0.0 { half.sin() / half } else { 1.0 };
    Matrix4::identity() * half.cos() + by_spin(turn) * share
}

/// Half the matrix of the product of Euler parameters with an angular velocity in axes of the body.
fn by_spin(spin: Vector3<f64>) -> Matrix4<f64> {
    let [x, y, z] = spin.into();
    0.5 * Matrix4::new(0.0, -x, -y, -z, x, 0.0, z, -y, y, -z, 0.0, x, z, y, -x, 0.0)
}

/// The equations there, with reactions that are in balance: those of rows in axes of a body that turns are others.
fn balanced(ahead: &mut [f64], (local, rows): (&mut Local, &[usize]), layout: &Layout) -> Option<Expansion> {
    let first = local.at(ahead).ok()?;
    if rows.is_empty() {
        return Some(first);
    }
    let left = first.value(Function::Balance);
    let change = closest(&first.slope(Function::Balance, Direction::Multipliers), &DMatrix::from_columns(&[left]))?;
    rows.iter().zip(change.iter()).for_each(|(row, change)| ahead[layout.multiplier_slot() + row] -= change);
    local.at(ahead).ok()
}

/// The least squares solution of A X ~ B, zero where columns of A follow from others; none of numbers that are not finite.
fn closest(a: &DMatrix<f64>, b: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let mut factored = PivotedQr::new(a.nrows(), a.ncols(), DEFAULT_RANK_TOLERANCE);
    factored.clear();
    (0..a.ncols()).for_each(|column| (0..a.nrows()).for_each(|row| factored.set(row, column, a[(row, column)])));
    factored.factor().ok()?;
    let mut x = DMatrix::zeros(a.ncols(), b.ncols());
    for (column, mut own) in b.column_iter().zip(x.column_iter_mut()) {
        factored.least_squares(column.into_owned().as_slice(), own.as_mut_slice()).ok()?;
    }
    x.iter().all(|value| value.is_finite()).then_some(x)
}
