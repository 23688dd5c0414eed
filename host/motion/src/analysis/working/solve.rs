//! Accelerations of [`WorkingForm`], and which of its engines is trusted with them.

use super::*;

impl WorkingForm {
    /// Accelerations and multipliers at the inputs' state: [M Phi_q^T; Phi_q 0] [a; lambda] = [Q; gamma].
    pub(super) fn solve(&mut self) -> Result<Used, AnalysisError> {
        self.note_position();
        let used = self.solve_without_drives()?;
        // Constraints that depend on time do work too: the power of -Phi_q^T lambda is lambda . Phi_t.
        let (dynamics, multipliers) = self.solved(used);
        let driven: f64 = dynamics.function(1).iter().zip(multipliers).map(|(time, lambda)| time * lambda).sum();
        self.motion.rates[self.motion.layout.states] += driven;
        Ok(used)
    }

    fn solve_without_drives(&mut self) -> Result<Used, AnalysisError> {
        if let Some(engine) = &mut self.regular {
            engine.dynamics.evaluate(&self.motion.inputs, &self.sets)?;
            let health = engine.factor(Source::Dynamics, &self.key, &mut self.motion.counters);
            if self.is_trusted(Source::Dynamics, &health)
                && let Some(engine) = &mut self.regular
            {
                let solution =
                    Solution { accelerations: &mut self.motion.accelerations, rates: &mut self.motion.rates };
                let coupling = self.coupling.as_mut();
                engine.solve_motion(
                    coupling,
                    &mut self.motion.inputs,
                    &self.sets,
                    solution,
                    &mut self.motion.counters,
                )?;
                return Ok(Used::Regular);
            }
        }
        if self.regular.is_some() {
            self.refuse_far_off()?;
            self.motion.counters.rank_safe += 1;
        }
        let engine = &mut self.safe;
        engine.dynamics.evaluate(&self.motion.inputs, &self.sets)?;
        engine.factor(Source::Dynamics, &self.key, &mut self.motion.counters)?;
        let solution = Solution { accelerations: &mut self.motion.accelerations, rates: &mut self.motion.rates };
        engine.solve_motion(
            self.coupling.as_mut(),
            &mut self.motion.inputs,
            &self.sets,
            solution,
            &mut self.motion.counters,
        )?;
        if self.coupling.is_none() {
            let loads = &engine.dynamics.further(FUNCTIONS)[..self.motion.accelerations.len()];
            self.balance.take_motion(&engine.dynamics, loads, &self.motion.accelerations, &engine.multipliers);
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
        if self.watch == Watch::Nothing || !self.motion.careful && ratio >= self.least_health {
            return ratio >= ACCURATE_REFINED;
        }
        let least = if self.motion.careful { self.start_independence.max(1.0) } else { self.start_independence };
        ratio >= ACCURATE_REFINED && self.independence_of(from) >= SICK_SHARE * least
    }

    /// Pivot ratio of the rows in use where they were evaluated last, whatever the masses.
    pub(super) fn independence_of(&mut self, from: Source) -> f64 {
        let (Some(engine), Some(alike)) = (&self.regular, &mut self.alike) else { return 1.0 };
        let jacobian = match from {
            Source::Dynamics => engine.dynamics.jacobian(),
            Source::Geometry => engine.geometry.jacobian(),
        };
        let (key, ratio) = &mut self.alike_at;
        if *key != self.key {
            self.motion.counters.factorisations += 1;
            *ratio = alike.refactor(jacobian).map_or(0.0, |health| health.smallest_pivot_ratio);
            key.clone_from(&self.key);
        }
        *ratio
    }
}
