//! [`WorkingForm`] next to singular positions.

use super::*;

impl Refusing for WorkingForm {
    fn passage(&mut self) -> &mut Passage {
        &mut self.passage
    }

    fn counted(&mut self) -> &mut Counters {
        &mut self.counters
    }

    fn is_careful(&self) -> bool {
        self.careful
    }

    fn normalise(&self, state: &mut [f64]) {
        for body in 0..self.layout.bodies {
            normalise(&mut state[BODY_STATES * body + 3..BODY_STATES * body + 7]);
        }
    }

    fn project_plainly(&mut self, t: f64, state: &mut [f64], keep_away: bool) -> Result<(), AnalysisError> {
        self.normalise(state);
        if self.layout.rows == 0 {
            return Ok(());
        }
        project_positions(self, t, state, keep_away)?;
        self.load(t, state);
        self.solve_correction(true, false)?;
        for body in 0..self.layout.bodies {
            for k in 0..6 {
                state[BODY_STATES * body + 7 + k] += self.accelerations[6 * body + k];
            }
        }
        Ok(())
    }

    fn miss(&mut self, t: f64, state: &[f64]) -> Result<(f64, String), AnalysisError> {
        self.load(t, state);
        self.safe.geometry.evaluate(&self.inputs, &self.sets)?;
        let (violation, row) = self.safe.geometry.worst(self.safe.geometry.function(0), self.length);
        Ok((violation / self.length, self.row_name(row)))
    }

    fn try_rates(&mut self, t: f64, state: &[f64], rates: &[f64]) -> Result<(), AnalysisError> {
        self.load(t, state);
        let dynamics = &mut self.safe.dynamics;
        dynamics.evaluate(&self.inputs, &self.sets)?;
        let bodies = BODY_STATES * self.layout.bodies;
        let of_bodies = |entries: &[f64]| -> Vec<f64> {
            entries[..bodies].chunks_exact(BODY_STATES).flat_map(|body| &body[7..13]).copied().collect()
        };
        let (velocities, accelerations) = (of_bodies(state), of_bodies(rates));
        let (loads, further) = dynamics.further(FUNCTIONS).split_at(accelerations.len());
        let work = self.layout.states;
        let driven = rates[bodies + work] - further[work];
        let trial = Trial {
            structure: &dynamics.structure,
            values: (self.balance.mass(), dynamics.jacobian()),
            gamma: dynamics.function(0),
            velocities: &velocities,
            accelerations: &accelerations,
            loads,
            driven: self.coupling.is_none().then_some(driven),
        };
        trial.accept(|row| self.row_names[row].clone())
    }

    fn rates_plainly(
        &mut self,
        t: f64,
        state: &[f64],
        rates: &mut [f64],
        keep_away: bool,
    ) -> Result<(), AnalysisError> {
        self.load(t, state);
        let used = self.solve_dynamics()?;
        if matches!(used, Used::Safe) && keep_away && self.is_singular(NEAR_SINGULAR) {
            return Err(AnalysisError::NextToSingular);
        }
        let (times, multipliers) = match (used, &self.regular) {
            (Used::Regular, Some(engine)) => (engine.dynamics.function(1), &engine.multipliers),
            _ => (self.safe.dynamics.function(1), &self.safe.multipliers),
        };
        for body in 0..self.layout.bodies {
            let y = &state[BODY_STATES * body..BODY_STATES * (body + 1)];
            let dy = &mut rates[BODY_STATES * body..BODY_STATES * (body + 1)];
            dy[..3].copy_from_slice(&y[7..10]);
            let p_rate = parameter_rates([y[3], y[4], y[5], y[6]], [y[10], y[11], y[12]]);
            dy[3..7].copy_from_slice(&p_rate);
            dy[7..13].copy_from_slice(&self.accelerations[6 * body..6 * body + 6]);
        }
        let states = BODY_STATES * self.layout.bodies;
        rates[states..states + self.layout.states].copy_from_slice(&self.rates[..self.layout.states]);
        // Constraints that depend on time do work too: the power of -Phi_q^T lambda is lambda . Phi_t.
        let driven: f64 = times.iter().zip(multipliers).map(|(time, lambda)| time * lambda).sum();
        rates[states + self.layout.states] = self.rates[self.layout.states] + driven;
        Ok(())
    }
}

impl Passing for WorkingForm {
    fn fastest(&self, state: &[f64]) -> f64 {
        let bodies = state[..BODY_STATES * self.layout.bodies].chunks_exact(BODY_STATES);
        let speeds = bodies.flat_map(|y| y[7..13].iter().enumerate());
        speeds.fold(0.0, |most, (k, speed)| most.max(speed.abs() / if k < 3 { self.length } else { 1.0 }))
    }

    fn shift(&self, state: &[f64], s: f64, moved: &mut [f64]) {
        moved.copy_from_slice(state);
        for body in moved[..BODY_STATES * self.layout.bodies].chunks_exact_mut(BODY_STATES) {
            let (pose, velocity) = body.split_at_mut(7);
            let d = [0, 1, 2, 3, 4, 5].map(|k| s * velocity[k]);
            move_body(pose, &d);
        }
    }

    fn share(&mut self, t: f64, state: &[f64]) -> Result<f64, AnalysisError> {
        self.load(t, state);
        self.safe.geometry.evaluate(&self.inputs, &self.sets)?;
        let health = self.safe.factor(Source::Geometry, &self.key, &mut self.counters)?;
        let lost = health.rank < self.start.rank;
        Ok(if lost { 0.0 } else { health.smallest_pivot_ratio / self.start.smallest_pivot_ratio })
    }
}
