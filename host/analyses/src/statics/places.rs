//! What is said of places: other starts than the scene's, reactions that are not unique, why there is no balance.

use nalgebra::DVector;
use odyn_numerics::draw::SplitMix64;

use super::search::{Look, Search};

impl Search<'_> {
    /// Another start: bodies moved at random as far as the joints let them.
    pub(super) fn elsewhere(&mut self, start: &[f64], seed: u64) -> Result<Vec<f64>, String> {
        let mut inputs = start.to_vec();
        self.rest(&mut inputs);
        self.grips.released.fill(true);
        self.close(Vec::new());
        self.project(&mut inputs)?;
        let mut numbers = SplitMix64::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let n = self.layout.velocities();
        let wish = DVector::from_fn(n, |k, _| numbers.either_way() * if k % 6 < 3 { self.length } else { 3.0 });
        for _ in 0..20 {
            let look = self.look(&mut inputs)?;
            let allowed = &look.freedom.basis * (&look.freedom.components * &wish) / 20.0;
            let mut next = inputs.clone();
            self.go(&mut next, &allowed);
            if self.project(&mut next).is_err() {
                break;
            }
            inputs = next;
        }
        Ok(inputs)
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
