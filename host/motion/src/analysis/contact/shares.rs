//! [`Shares`]: what frictions that stick take of what rigid bodies leave open.
//!
//! Forces in balance with each other change nothing of the motion: along the line through two feet that stick, one may push as much as
//! the other pulls; across a plane in which joints hold a body, friction need hold nothing. All stick as long as there is any way to
//! share within their limits. The shares that are taken make the sum of the squares of force over limit least; where one of these goes
//! beyond its limit, those that make the largest force over limit least.

use nalgebra::{DMatrix, DVector};

use super::friction::{Grip, norm};
use super::indeterminate::TAKES_PART;
use super::{Meeting, RANK_TOLERANCE, smallest};

/// The least limit, as a share of the largest, to compare a force with.
const LEAST_LIMIT: f64 = 1e-9;
/// Rounds of searches along each of the balances, and steps of each search.
const ROUNDS: usize = 8;
const STEPS: usize = 80;

/// Forces in balance with each other, of frictions that stick together: a basis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shares {
    frictions: Vec<usize>,
    /// A force of each of them, along its one row or its two.
    balances: Vec<Vec<[f64; 2]>>,
}

impl Shares {
    /// Those of some frictions where contacts meet.
    pub(super) fn new(meeting: &Meeting, grips: &[&Grip]) -> Self {
        let rows: Vec<usize> = grips.iter().flat_map(|grip| grip.rows.iter().copied()).collect();
        let in_pairs = |balance: DVector<f64>| {
            let mut rest = balance.as_slice();
            let mut force = |grip: &&Grip| {
                let (own, others) = rest.split_at(grip.rows.len());
                rest = others;
                [own[0], own.get(1).copied().unwrap_or(0.0)]
            };
            grips.iter().map(&mut force).collect()
        };
        let found = if rows.is_empty() { Vec::new() } else { meeting.balanced(&rows) };
        Self {
            frictions: grips.iter().map(|grip| grip.number).collect(),
            balances: found.into_iter().map(in_pairs).collect(),
        }
    }

    /// Numbers of the frictions.
    #[must_use]
    pub fn frictions(&self) -> &[usize] {
        &self.frictions
    }

    /// Whether nothing is open.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.balances.is_empty()
    }

    /// Whether one of them could take less where others take more.
    pub(super) fn takes_part(&self, grip: &Grip) -> bool {
        let Some(place) = self.frictions.iter().position(|number| *number == grip.number) else { return false };
        self.balances.iter().any(|balance| {
            let largest = balance.iter().fold(0.0, |largest, part| f64::max(largest, norm(*part)));
            norm(grip.free(balance[place])) > TAKES_PART * largest
        })
    }

    /// Those in which a friction has no part, which sticks no longer.
    pub fn leave_out(&mut self, friction: usize) {
        let Some(place) = self.frictions.iter().position(|number| *number == friction) else { return };
        for part in [0, 1] {
            let size = |balance: &Vec<[f64; 2]>| balance[place][part].abs();
            let found =
                (0..self.balances.len()).max_by(|a, b| size(&self.balances[*a]).total_cmp(&size(&self.balances[*b])));
            let Some(pivot) = found.filter(|k| size(&self.balances[*k]) > RANK_TOLERANCE) else { continue };
            let pivot = self.balances.swap_remove(pivot);
            for balance in &mut self.balances {
                let share = -balance[place][part] / pivot[place][part];
                add(balance, &pivot, share);
            }
        }
        self.frictions.remove(place);
        self.balances.iter_mut().for_each(|balance| {
            balance.remove(place);
        });
    }

    /// Chooses among the forces that have the same effect.
    pub fn choose(&self, forces: &mut [[f64; 2]], limits: &[f64]) {
        let largest = limits.iter().copied().fold(0.0, f64::max);
        let inverse: Vec<f64> = limits.iter().map(|limit| 1.0 / limit.max(LEAST_LIMIT * largest)).collect();
        if self.is_empty() || largest <= 0.0 {
            return;
        }
        self.make_squares_least(forces, &inverse);
        if most(forces, &inverse) <= 1.0 {
            return;
        }
        for balance in (0..ROUNDS).flat_map(|_| &self.balances) {
            lower(forces, balance, &inverse);
        }
    }

    fn make_squares_least(&self, forces: &mut [[f64; 2]], inverse: &[f64]) {
        let n = self.balances.len();
        let product = |a: &[[f64; 2]], b: &[[f64; 2]]| -> f64 {
            let of_pair = |((a, b), unit): ((&[f64; 2], &[f64; 2]), &f64)| (a[0] * b[0] + a[1] * b[1]) * unit * unit;
            a.iter().zip(b).zip(inverse).map(of_pair).sum()
        };
        let matrix = DMatrix::from_fn(n, n, |i, j| product(&self.balances[i], &self.balances[j]));
        let right = DVector::from_fn(n, |i, _| -product(&self.balances[i], forces));
        let found = smallest(&matrix, &right);
        self.balances.iter().zip(found.iter()).for_each(|(balance, share)| add(forces, balance, *share));
    }
}

/// The largest force over limit.
fn most(forces: &[[f64; 2]], inverse: &[f64]) -> f64 {
    forces.iter().zip(inverse).fold(0.0, |most, (force, unit)| f64::max(most, norm(*force) * unit))
}

fn add(forces: &mut [[f64; 2]], balance: &[[f64; 2]], share: f64) {
    for (force, part) in forces.iter_mut().zip(balance) {
        force.iter_mut().zip(part).for_each(|(value, part)| *value += share * part);
    }
}

/// Makes the largest force over limit least by adding some of a balance: a convex function of how much.
fn lower(forces: &mut [[f64; 2]], balance: &[[f64; 2]], inverse: &[f64]) {
    let size = most(balance, inverse);
    let bound = 2.0 * most(forces, inverse);
    if size <= 0.0 || !bound.is_finite() {
        return;
    }
    let with = |share: f64| {
        let pairs = forces.iter().zip(balance).zip(inverse);
        pairs.fold(0.0_f64, |most, ((f, b), unit)| most.max(norm([0, 1].map(|k| f[k] + share * b[k])) * unit))
    };
    let (mut low, mut high) = (-bound / size, bound / size);
    for _ in 0..STEPS {
        let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
        if with(a) <= with(b) { high = b } else { low = a }
    }
    add(forces, balance, 0.5 * (low + high));
}
