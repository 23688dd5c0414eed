//! Friction at rest: whether there are reactions that hold a place and that friction can give.
//!
//! Rows that hold up to a limit are taken to stick while an equilibrium is looked for, as rows of joints. Where it is found, the
//! reactions lambda = lambda_0 + K z that balance it (K from redundant rows) must be such that contacts push, N >= 0, and that no friction
//! exceeds its limit, |T| <= b or |T| <= mu N. These conditions are convex: z is found by Newton's method on the sum of the squares of
//! what exceeds them. Where rigid bodies leave the shares of several open, the least share s at which |T| <= s b can be met by all says
//! how much of the friction is needed. (Alart & Curnier 1991 for the cone; for limit analysis with it, Livesley 1978.)

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::search::{Look, Search};
use crate::analysis::Evaluator;
use crate::program::{Equations, Friction};

/// Excess that is none, as a share of all reactions that take part.
const NONE: f64 = 1e-9;
/// Newton steps, and halvings of each.
const STEPS: usize = 200;
const HALVINGS: usize = 40;
/// Halvings of the share that is needed.
const SHARES: usize = 45;
/// Speed of a row at rest above which it slides, in sizes of the scene per second.
const SLIDES: f64 = 1e-12;

/// A friction at rest.
#[derive(Debug, Clone, Serialize)]
pub struct Held {
    /// The element and its row.
    pub name: String,
    /// What it holds as a share of its limit; of what was overcome, of the limit it would have needed; infinite (`null`) where it has none.
    pub share: f64,
    /// Whether it holds. What does not is taken as none.
    pub holds: bool,
}

/// The frictions of a scene.
pub(super) struct Grips {
    frictions: Vec<Friction>,
    limits: Evaluator,
    rates: Evaluator,
    /// Those that do not take part.
    pub(super) released: Vec<bool>,
}

/// What reactions must meet.
enum Cone {
    Push { row: usize },
    Known { rows: Vec<usize>, limit: f64 },
    Share { rows: Vec<usize>, normal: usize, mu: f64 },
}

/// The conditions on reactions p = p_0 + K z, in sizes that can be compared.
struct Cones {
    list: Vec<Cone>,
    p: DVector<f64>,
    k: DMatrix<f64>,
    size: f64,
}

impl Grips {
    pub(super) fn new(equations: &Equations) -> Self {
        let frictions = equations.frictions.clone();
        let rates: Vec<_> = frictions.iter().flat_map(|one| one.rates.iter().copied()).collect();
        let limits: Vec<_> = frictions.iter().map(|one| one.limit).collect();
        Self {
            limits: Evaluator::new(&equations.graph, &limits),
            rates: Evaluator::new(&equations.graph, &rates),
            released: vec![true; frictions.len()],
            frictions,
        }
    }

    /// Those that stick where these contacts are closed.
    pub(super) fn sticking(&self, closed: &[usize]) -> Vec<usize> {
        let sticks = |number: &usize| {
            !self.released[*number] && self.frictions[*number].contact.is_none_or(|contact| closed.contains(&contact))
        };
        (0..self.frictions.len()).filter(sticks).collect()
    }
}

impl Search<'_> {
    /// Frictions take part, or none; those that slide though nothing moves, on what drivers move, do not stick.
    pub(super) fn grip(&mut self, inputs: &mut [f64], wanted: bool) -> Result<(), String> {
        let sets = &self.session.model.sets;
        let rates = self.grips.rates.run(inputs, sets).map_err(|error| error.to_string())?.to_vec();
        let limits = self.grips.limits.run(inputs, sets).map_err(|error| error.to_string())?;
        let mut rates = rates.as_slice();
        for (number, friction) in self.grips.frictions.iter().enumerate() {
            let (own, rest) = rates.split_at(friction.rows.len());
            rates = rest;
            let speed = own.iter().map(|rate| rate * rate).sum::<f64>().sqrt();
            let slides = speed > SLIDES * self.length;
            // What may hold nothing is a brake that is off.
            self.grips.released[number] = slides || !wanted || limits[number] == 0.0;
            for (k, rate) in own.iter().enumerate() {
                inputs[self.layout.discrete_slot() + friction.direction_at + k] =
                    if slides { rate / speed } else { 0.0 };
            }
        }
        Ok(())
    }

    fn friction_name(&self, number: usize) -> String {
        self.row_name(self.grips.frictions[number].rows[0])
    }

    /// The rows of frictions that stick, of the Jacobian of all rows.
    pub(super) fn sticking_rows(&self, jacobian: &DMatrix<f64>) -> DMatrix<f64> {
        let numbers = self.grips.sticking(&self.closed);
        let rows: Vec<usize> =
            numbers.iter().flat_map(|number| self.grips.frictions[*number].rows.iter().copied()).collect();
        let places: Vec<usize> =
            (0..jacobian.nrows()).filter(|place| rows.contains(&self.local.rows()[*place])).collect();
        jacobian.select_rows(places.iter())
    }

    /// Whether friction holds the place, with reactions that it can give where there are some: they are put into the inputs.
    pub(super) fn held(&mut self, look: &Look, inputs: &mut [f64]) -> Result<Vec<Held>, String> {
        let sticking = self.grips.sticking(&self.closed);
        if sticking.is_empty() {
            return Ok(Vec::new());
        }
        let sets = &self.session.model.sets;
        let limits = self.grips.limits.run(inputs, sets).map_err(|error| error.to_string())?.to_vec();
        let rows = self.local.rows().to_vec();
        let place = |row: usize| rows.iter().position(|one| *one == row);
        let jacobian = look.expansion.jacobian();
        let length = |row: usize| jacobian.row(row).transpose().component_mul(&look.expansion.scales).norm();
        let mut list = Vec::new();
        for contact in &self.closed {
            let normal = place(self.session.equations.contacts[*contact].row);
            list.extend(normal.map(|row| Cone::Push { row }));
        }
        for number in &sticking {
            let friction = &self.grips.frictions[*number];
            let own: Vec<usize> = friction.rows.iter().filter_map(|row| place(*row)).collect();
            let limit = limits[*number];
            let normal = friction.contact.and_then(|contact| place(self.session.equations.contacts[contact].row));
            list.push(match normal {
                Some(normal) => Cone::Share { rows: own, normal, mu: limit },
                None => Cone::Known { rows: own, limit },
            });
        }
        let first = self.layout.multiplier_slot();
        let p = DVector::from_fn(rows.len(), |k, _| -inputs[first + rows[k]]);
        let sizes: Vec<f64> = (0..rows.len()).map(length).collect();
        let size = (0..rows.len()).map(|k| p[k].abs() * sizes[k]).fold(look.expansion.sizes.amax(), f64::max);
        let mut cones = Cones { list, p, k: self.redundant(look), size: size.max(f64::MIN_POSITIVE) };
        cones.keep_what_takes_part();
        let pushes = self.closed.len();
        let mut z = DVector::zeros(cones.k.ncols());
        let exceeds = cones.nearest(&mut z, 1.0);
        let held = exceeds <= NONE * cones.size;
        if held {
            let (mut low, mut high) = (0.0, 1.0);
            let mut best = z.clone();
            for _ in 0..SHARES {
                let middle = 0.5 * (low + high);
                let mut trial = best.clone();
                if cones.nearest(&mut trial, middle) <= NONE * cones.size {
                    (high, best) = (middle, trial);
                } else {
                    low = middle;
                }
            }
            z = best;
        }
        let found = cones.at(&z);
        let share = |cone: &Cone| {
            let (rows, limit) = match cone {
                Cone::Known { rows, limit } => (rows, *limit),
                Cone::Share { rows, normal, mu } => (rows, mu * found[*normal].max(0.0)),
                Cone::Push { .. } => return 0.0,
            };
            let taken = norm(rows, &found);
            if taken <= NONE * cones.size {
                0.0
            } else if limit > 0.0 {
                taken / limit
            } else {
                f64::INFINITY
            }
        };
        let shares: Vec<f64> = cones.list[pushes..].iter().map(share).collect();
        if held {
            for (k, row) in rows.iter().enumerate() {
                inputs[first + row] = -found[k];
            }
        }
        let result = sticking.iter().zip(shares).map(|(number, share)| {
            let share = if held { share.min(1.0) } else { share };
            let holds = (held || share <= 1.0 + NONE) && limits[*number] > 0.0;
            Held { name: self.friction_name(*number), share, holds }
        });
        let mut result: Vec<Held> = result.collect();
        // Contacts that would have to pull leave nothing to blame: then none of them holds.
        if !held && result.iter().all(|one| one.holds) {
            result.iter_mut().for_each(|one| one.holds = false);
        }
        for (number, one) in sticking.iter().zip(&result) {
            self.grips.released[*number] |= !one.holds;
        }
        Ok(result)
    }

    /// Changes of reactions that change nothing on any body, column by column.
    fn redundant(&self, look: &Look) -> DMatrix<f64> {
        let jacobian = look.expansion.jacobian();
        let independent = &look.freedom.independent;
        let dependent: Vec<usize> = (0..look.rows).filter(|row| !independent.contains(row)).collect();
        let mut k = DMatrix::zeros(look.rows, dependent.len());
        for (column, row) in dependent.iter().enumerate() {
            let shares = jacobian.row(*row) * &look.freedom.lift;
            k[(*row, column)] = 1.0;
            for (place, share) in independent.iter().zip(shares.iter()).filter(|(place, _)| **place < look.rows) {
                k[(*place, column)] = -share;
            }
            let length = k.column(column).norm();
            k.column_mut(column).unscale_mut(length);
        }
        k
    }
}

fn norm(rows: &[usize], p: &DVector<f64>) -> f64 {
    rows.iter().map(|row| p[*row] * p[*row]).sum::<f64>().sqrt()
}

impl Cones {
    /// Leaves out redundancies of rows without a condition.
    fn keep_what_takes_part(&mut self) {
        let mut rows: Vec<usize> = Vec::new();
        for cone in &self.list {
            match cone {
                Cone::Push { row } => rows.push(*row),
                Cone::Known { rows: own, .. } | Cone::Share { rows: own, .. } => rows.extend(own),
            }
        }
        let part: Vec<usize> =
            (0..self.k.ncols()).filter(|k| rows.iter().any(|row| self.k[(*row, *k)].abs() > 1e-12)).collect();
        self.k = self.k.select_columns(part.iter());
    }

    fn at(&self, z: &DVector<f64>) -> DVector<f64> {
        &self.p + &self.k * z
    }

    /// Half the sum of the squares of what exceeds the conditions, with gradient and Hessian by reactions where these are wanted; and
    /// the largest excess.
    fn excess(
        &self,
        z: &DVector<f64>,
        share: f64,
        slopes: Option<(&mut DVector<f64>, &mut DMatrix<f64>)>,
    ) -> (f64, f64) {
        let p = self.at(z);
        let (mut sum, mut most) = (0.0, 0.0_f64);
        let n = p.len();
        let (mut gradient, mut hessian) = (DVector::zeros(n), DMatrix::zeros(n, n));
        for cone in &self.list {
            let (rows, excess, normal) = match cone {
                Cone::Push { row } => {
                    let excess = -p[*row];
                    if excess > 0.0 {
                        (sum, most) = (sum + 0.5 * excess * excess, most.max(excess));
                        gradient[*row] -= excess;
                        hessian[(*row, *row)] += 1.0;
                    }
                    continue;
                }
                Cone::Known { rows, limit } => (rows, norm(rows, &p) - share * limit, None),
                Cone::Share { rows, normal, mu } => {
                    (rows, norm(rows, &p) - share * mu * p[*normal], Some((*normal, share * mu)))
                }
            };
            if excess <= 0.0 {
                continue;
            }
            (sum, most) = (sum + 0.5 * excess * excess, most.max(excess));
            let size = norm(rows, &p);
            let mut along = DVector::zeros(n);
            for row in rows.iter().filter(|_| size > 0.0) {
                along[*row] = p[*row] / size;
            }
            // Of |T|: (1 - t t^T) / |T|.
            for a in rows.iter().filter(|_| size > 0.0) {
                hessian[(*a, *a)] += excess / size;
                rows.iter().for_each(|b| hessian[(*a, *b)] -= excess / size * along[*a] * along[*b]);
            }
            if let Some((normal, mu)) = normal {
                along[normal] -= mu;
            }
            gradient += &along * excess;
            hessian += &along * along.transpose();
        }
        if let Some((by_z, twice)) = slopes {
            *by_z = self.k.transpose() * gradient;
            *twice = self.k.transpose() * hessian * &self.k;
        }
        (sum, most)
    }

    /// Brings z to where the least is exceeded; gives the largest excess there.
    fn nearest(&self, z: &mut DVector<f64>, share: f64) -> f64 {
        let count = z.len();
        let (mut gradient, mut hessian) = (DVector::zeros(count), DMatrix::zeros(count, count));
        let (mut sum, mut most) = self.excess(z, share, Some((&mut gradient, &mut hessian)));
        if count == 0 {
            return most;
        }
        for _ in 0..STEPS {
            if most <= 0.1 * NONE * self.size {
                break;
            }
            let ridge = 1e-10 * hessian.diagonal().amax().max(f64::MIN_POSITIVE);
            let system = &hessian + DMatrix::identity(count, count) * ridge;
            let Some(step) = system.lu().solve(&gradient) else { break };
            let mut factor = 1.0;
            let mut better = None;
            for _ in 0..HALVINGS {
                let trial = &*z - &step * factor;
                let found = self.excess(&trial, share, None);
                if found.0 < sum {
                    better = Some(trial);
                    break;
                }
                factor *= 0.5;
            }
            let Some(trial) = better else { break };
            let before = sum;
            *z = trial;
            (sum, most) = self.excess(z, share, Some((&mut gradient, &mut hessian)));
            if before - sum <= 1e-15 * before {
                break;
            }
        }
        most
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Two feet share what rigid bodies leave open by what each can give; the share needed is that of both together.
    #[test]
    fn shares_that_are_open_go_to_what_can_give_them() {
        // Normals 3 and 1, tangential 1 in all, first all on the second foot.
        let foot = |tangential: usize, normal: usize| Cone::Share { rows: vec![tangential], normal, mu: 0.5 };
        let list = vec![Cone::Push { row: 0 }, Cone::Push { row: 1 }, foot(2, 0), foot(3, 1)];
        let p = DVector::from_vec(vec![3.0, 1.0, 0.0, 1.0]);
        let k = DMatrix::from_column_slice(4, 1, &[0.0, 0.0, 1.0, -1.0]);
        let cones = Cones { list, p, k, size: 3.0 };
        for (share, held) in [(1.0, true), (0.51, true), (0.49, false)] {
            let mut z = DVector::zeros(1);
            assert_eq!(cones.nearest(&mut z, share) <= NONE * 3.0, held, "{share}");
        }
    }

    /// A wedge between two walls: what presses it is open, and more of it holds more.
    #[test]
    fn what_wedges_itself_holds_any_load_or_none() {
        // Walls at +-x with normals n, frictions t along y: n1 = n2 = z, t1 + t2 = 1.
        for mu in [0.1, 0.7] {
            let foot = |tangential: usize, normal: usize| Cone::Share { rows: vec![tangential], normal, mu };
            let list = vec![Cone::Push { row: 0 }, Cone::Push { row: 1 }, foot(2, 0), foot(3, 1)];
            let p = DVector::from_vec(vec![0.0, 0.0, 0.5, 0.5]);
            let k = DMatrix::from_column_slice(4, 1, &[1.0, 1.0, 0.0, 0.0]);
            let cones = Cones { list, p, k, size: 1.0 };
            let mut z = DVector::zeros(1);
            assert!(cones.nearest(&mut z, 1.0) <= NONE, "{mu}");
            assert!(z[0] >= 0.5 / mu * (1.0 - 1e-6), "{mu} {z}");
        }
    }
}
