//! How well a place meets the equations of an equilibrium.

use nalgebra::{DMatrix, DVector};

use super::Audit;
use super::search::{GOOD, Look, Search};
use crate::analysis::{Direction, Function};
use crate::moves;

/// What round-off leaves: of loads, and of places as a share of the scene's size.
const LOADS: f64 = 1e-11;
pub(super) const PLACES: f64 = 1e-13;
/// How far from balance a place may be along a direction by its stiffness, as a share of the scene's size, whatever the loads.
const NEAR: f64 = 1e-9;
/// What is nothing beside no loads at all, 1/s^2.
const NOTHING: f64 = 1e-30;
/// Iterations for each singular vector; two or three are what they take.
const MOST_ITERATIONS: usize = 100;

impl Search<'_> {
    /// How well the equations are met, in what round-off leaves; `fastest`: how fast states changed on the way.
    pub(super) fn audit(&self, look: &Look, inputs: &[f64], fastest: &DVector<f64>) -> Result<Audit, String> {
        let e = &look.expansion;
        let slopes = e.slope(Function::Balance, Direction::Positions);
        let weigh = |vector: &dyn Fn(usize) -> f64, body: usize| {
            (0..6).map(|k| (vector(6 * body + k) * e.scales[6 * body + k]).abs()).fold(0.0, f64::max)
        };
        let stiff = DVector::from_fn(slopes.nrows(), |k, _| {
            (0..slopes.ncols()).map(|j| (slopes[(k, j)] * e.scales[j]).abs()).sum::<f64>()
        });
        let noise = DVector::from_fn(stiff.len(), |k, _| LOADS * e.sizes[k] + PLACES * self.length * stiff[k]);
        let nothing = |body: usize| NOTHING * self.session.model.bodies[body].mass * self.length;
        let share = |allowed: &DVector<f64>| {
            let of = |body| weigh(&|k| look.left[k], body) / (weigh(&|k| allowed[k], body) + nothing(body));
            let all = (0..self.layout.bodies).map(|body| (of(body), body));
            all.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0))
        };
        let (mut balance, mut which) = share(&noise);
        let most =
            |vector: &DVector<f64>| vector.iter().zip(e.scales.iter()).map(|(v, s)| (v * s).abs()).fold(0.0, f64::max);
        // What is left is seen along free motions, in which bodies without loads of their own bear the noise of others.
        if balance > 1.0 && most(&look.left) <= most(&noise) * noise.len() as f64 {
            let seen = look.freedom.components.transpose() * look.freedom.basis.transpose();
            (balance, which) = share(&(&noise + seen.abs() * &noise));
        }
        // Where that is in balance, by its stiffest direction, others may not be.
        if balance <= GOOD
            && let Some((along, direction)) = self.along_each(look, &slopes, |k| LOADS * e.sizes[k])
            && along > balance
        {
            balance = along;
            let part = |body: usize| weigh(&|k| direction[k] / e.scales[k].powi(2), body);
            which = (0..self.layout.bodies).max_by(|a, b| part(*a).total_cmp(&part(*b))).unwrap_or(which);
        }
        let state = |k: usize| inputs[self.layout.state_slot() + self.local.states()[k]];
        let (by_states, by_places) =
            (e.slope(Function::States, Direction::States), e.slope(Function::States, Direction::Positions));
        let terms = |k: usize, of: &dyn Fn(usize) -> f64| -> f64 {
            (0..by_states.ncols()).map(|j| by_states[(k, j)].abs() * of(j)).sum()
        };
        // What states are like that its own rate weighs it against: one that is zero at rest (the rate in a filter of second order) is made
        // of the noise of others.
        let like = |j: usize| {
            let weight = terms(j, &|_| 1.0);
            if weight > 0.0 { terms(j, &|k| state(k).abs()) / weight } else { 0.0 }
        };
        let sizes: Vec<f64> = (0..by_states.ncols()).map(|j| state(j).abs() + like(j)).collect();
        let mut states = 0.0_f64;
        for (k, rate) in look.rates.iter().enumerate().filter(|(_, rate)| **rate != 0.0) {
            let places: f64 = (0..by_places.ncols()).map(|j| (by_places[(k, j)] * e.scales[j]).abs()).sum();
            let sizes = terms(k, &|j| sizes[j]).max(fastest[k]);
            states = states.max(rate.abs() / (LOADS * sizes + PLACES * self.length * places + NOTHING));
        }
        if balance.is_nan() || states.is_nan() {
            return Err("loads have no finite value on the way".into());
        }
        let holonomic = e.holonomic();
        let jacobian = e.jacobian().select_rows(holonomic.iter());
        let values = e.value(Function::Rows).select_rows(holonomic.iter());
        let rows = moves::violation(&jacobian, &values, &e.scales).0 / self.length;
        let body = self.session.model.bodies.get(which).map_or_else(String::new, |body| body.name.clone());
        Ok(Audit { balance, body, rows, states })
    }

    /// The largest share of what round-off leaves that a load has along a direction of its own stiffness (singular vectors of the stiffness
    /// of free motions), or of what moves the place by [`NEAR`], if that is less; and that direction, six displacements for each body.
    /// `noise`: of the loads, six for each body. `None` where nothing moves.
    fn along_each(
        &self,
        look: &Look,
        slopes: &DMatrix<f64>,
        noise: impl Fn(usize) -> f64,
    ) -> Option<(f64, DVector<f64>)> {
        let basis = &look.freedom.basis;
        if basis.ncols() == 0 {
            return None;
        }
        let pull = basis.transpose() * &look.left;
        let by_places = basis.transpose() * slopes;
        let stiffness = &by_places * basis;
        let by_places = by_places * DMatrix::from_diagonal(&look.expansion.scales);
        let found = stiffness.try_svd(true, false, f64::EPSILON, MOST_ITERATIONS * basis.ncols())?;
        let directions = found.u?;
        let share = |k: usize| {
            let direction = directions.column(k);
            let moved = basis * direction;
            let of_loads: f64 = moved.iter().enumerate().map(|(k, part)| part.abs() * noise(k)).sum();
            let of_places = PLACES * self.length * (direction.transpose() * &by_places).lp_norm(1);
            let near = NEAR * self.length * found.singular_values[k];
            direction.dot(&pull).abs() / (of_loads + of_places).max(near).max(f64::MIN_POSITIVE)
        };
        let all = (0..directions.ncols()).map(|k| (share(k), k));
        let (share, worst) = all.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((share, basis * directions.column(worst)))
    }
}
