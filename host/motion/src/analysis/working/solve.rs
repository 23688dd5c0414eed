//! Accelerations of [`WorkingForm`], and which of its engines is trusted with them.

use super::*;

impl WorkingForm {
    /// Accelerations and multipliers at the inputs' state: [M Phi_q^T; Phi_q 0] [a; lambda] = [Q; gamma].
    pub(super) fn solve_dynamics(&mut self) -> Result<Used, AnalysisError> {
        if let Some(engine) = &mut self.regular {
            engine.dynamics.evaluate(&self.inputs, &self.sets)?;
            let health = engine.factor(Source::Dynamics, &self.key, &mut self.counters);
            if self.is_trusted(Source::Dynamics, &health)
                && let Some(engine) = &mut self.regular
            {
                let solution = Solution { accelerations: &mut self.accelerations, rates: &mut self.rates };
                let coupling = self.coupling.as_mut();
                engine.solve_motion(coupling, &mut self.inputs, &self.sets, solution, &mut self.counters)?;
                return Ok(Used::Regular);
            }
        }
        self.counters.rank_safe += u64::from(self.regular.is_some());
        let engine = &mut self.safe;
        engine.dynamics.evaluate(&self.inputs, &self.sets)?;
        engine.factor(Source::Dynamics, &self.key, &mut self.counters)?;
        let solution = Solution { accelerations: &mut self.accelerations, rates: &mut self.rates };
        engine.solve_motion(self.coupling.as_mut(), &mut self.inputs, &self.sets, solution, &mut self.counters)?;
        if self.coupling.is_none() {
            let loads = &engine.dynamics.further(FUNCTIONS)[..self.accelerations.len()];
            self.balance.take_motion(&engine.dynamics, loads, &self.accelerations, &engine.multipliers);
            self.balance.accept()?;
        }
        Ok(Used::Safe)
    }

    /// Whether the sparse engine is trusted with what it factored last. Far from singular positions a pivot ratio that has not
    /// fallen by far is enough; where it has, or next to them, what counts is the ratio that masses have no part in, and how many
    /// digits elimination keeps. Next to a singular position that is a ratio of whole rows: a small one at the start may be that
    /// of rows that have nothing to do with it.
    pub(super) fn is_trusted(&mut self, from: Source, health: &Result<Health, LinalgError>) -> bool {
        let Ok(health) = health else { return false };
        let ratio = health.smallest_pivot_ratio;
        if self.watch == Watch::Nothing || !self.careful && ratio >= self.least_health {
            return ratio >= ACCURATE_REFINED;
        }
        let least = if self.careful { self.start_independence.max(1.0) } else { self.start_independence };
        ratio >= ACCURATE_REFINED && self.independence(from) >= SICK_SHARE * least
    }

    /// Pivot ratio of the rows in use where they were evaluated last, whatever the masses.
    pub(super) fn independence(&mut self, from: Source) -> f64 {
        let (Some(engine), Some(alike)) = (&self.regular, &mut self.alike) else { return 1.0 };
        let jacobian = match from {
            Source::Dynamics => engine.dynamics.jacobian(),
            Source::Geometry => engine.geometry.jacobian(),
        };
        let (key, ratio) = &mut self.alike_at;
        if *key != self.key {
            self.counters.factorisations += 1;
            *ratio = alike.refactor(jacobian).map_or(0.0, |health| health.smallest_pivot_ratio);
            key.clone_from(&self.key);
        }
        *ratio
    }
}
