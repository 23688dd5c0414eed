//! What is said of places: other starts than the scene's, reactions that are not unique, why there is no balance.

use std::f64::consts::PI;

use nalgebra::DVector;
use odyn_numerics::draw::SplitMix64;

use super::Equilibrium;
use super::search::{Look, Search};
use crate::modes::Mode;

/// Parts in which bodies are moved to another start.
const PARTS: usize = 20;
/// Turn, rad, or displacement on the size of the scene, of a start beside an unstable equilibrium.
const BESIDE: f64 = 0.02;

impl Search<'_> {
    /// Another start: bodies moved at random as far as the joints let them, so that the largest turn may be anything up to half a
    /// revolution.
    pub(super) fn elsewhere(&mut self, start: &[f64], seed: u64) -> Result<Vec<f64>, String> {
        let mut inputs = start.to_vec();
        self.rest(&mut inputs);
        self.grips.released.fill(true);
        self.close(Vec::new());
        self.project(&mut inputs)?;
        let mut numbers = SplitMix64::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let n = self.layout.velocities();
        let mut wish = DVector::from_fn(n, |k, _| numbers.either_way() * if k % 6 < 3 { self.length } else { 1.0 });
        let share = numbers.either_way().abs();
        let allowed = self.allowed(&mut inputs, &wish)?;
        // What the joints leave of a wish depends on how many there are.
        wish *= share * PI / self.reach(&allowed).max(f64::MIN_POSITIVE);
        for _ in 0..PARTS {
            let mut next = inputs.clone();
            let part = self.allowed(&mut next, &wish)? / PARTS as f64;
            self.go(&mut next, &part);
            if self.project(&mut next).is_err() {
                break;
            }
            inputs = next;
        }
        Ok(inputs)
    }

    /// What rows allow of a displacement.
    fn allowed(&mut self, inputs: &mut [f64], wish: &DVector<f64>) -> Result<DVector<f64>, String> {
        let look = self.look(inputs)?;
        Ok(&look.freedom.basis * (&look.freedom.components * wish))
    }

    /// Largest turn, rad, or displacement on the size of the scene.
    fn reach(&self, step: &DVector<f64>) -> f64 {
        let sized = |(k, part): (usize, &f64)| if k % 6 < 3 { part.abs() / self.length } else { part.abs() };
        step.iter().enumerate().map(sized).fold(0.0, f64::max)
    }

    /// Starts beside an unstable equilibrium, to both sides along what grows, the fastest first.
    pub(super) fn beside(&self, found: &Equilibrium) -> Vec<Vec<f64>> {
        let mut growing: Vec<&Mode> = found.modes.modes.iter().filter(|mode| mode.decided && mode.real > 0.0).collect();
        // What grows and swings as well has no potential to go down in.
        growing.retain(|mode| mode.imaginary == 0.0);
        growing.sort_by(|a, b| b.real.total_cmp(&a.real));
        let sides = growing.into_iter().flat_map(|mode| {
            let parts = mode.shape.iter().flat_map(|body| body.displacement.into_iter().chain(body.turn));
            let shape = DVector::from_iterator(self.layout.velocities(), parts);
            let step = &shape * (BESIDE / self.reach(&shape).max(f64::MIN_POSITIVE));
            [step.clone(), -step]
        });
        let start = |step: DVector<f64>| {
            let mut inputs = found.instant.inputs.clone();
            self.go(&mut inputs, &step);
            inputs
        };
        sides.map(start).collect()
    }

    /// Rows that take part in a combination that rigid bodies do not determine.
    pub(super) fn not_unique(&self, look: &Look) -> Vec<String> {
        let jacobian = look.expansion.jacobian();
        let own: Vec<usize> = look.freedom.independent.iter().copied().filter(|row| *row < look.rows).collect();
        let mut open = vec![false; look.rows];
        for row in (0..look.rows).filter(|row| !own.contains(row)) {
            open[row] = true;
            let shares = jacobian.row(row) * &look.freedom.lift;
            for (k, place) in look.freedom.independent.iter().enumerate().filter(|(_, place)| **place < look.rows) {
                open[*place] |= (shares[k] * jacobian.row(*place).norm()).abs() > 1e-9 * jacobian.row(row).norm();
            }
        }
        (0..look.rows).filter(|row| open[*row]).map(|row| self.row_name(self.local.rows()[row])).collect()
    }

    /// Why there is no balance, with the body that accelerates most.
    pub(super) fn why(&self, look: &Look, inputs: &[f64], reason: &str) -> String {
        let worst = self.fastest(&look.left).filter(|(_, most)| *most > 0.0);
        let still = worst.map_or_else(String::new, |(body, most)| {
            let name = &self.session.model.bodies[body].name;
            format!("; `{name}` still accelerates most, by {most:.1e} m/s^2 (turns on the size of the scene)")
        });
        let states: Vec<&str> = (self.session.model.elements.iter().enumerate())
            .filter(|(element, _)| {
                let own = self.local.states().iter().enumerate();
                own.filter(|(_, state)| self.layout.states_of(*element).contains(state)).any(|(k, state)| {
                    let (rate, value) = (look.rates[k].abs(), inputs[self.layout.state_slot() + state].abs());
                    rate > 1e-6 * value.max(1e-6)
                })
            })
            .map(|(_, element)| element.name.as_str())
            .collect();
        let states =
            if states.is_empty() { String::new() } else { format!("; states still change: {}", states.join(", ")) };
        format!("{reason}{still}{states}")
    }
}
