//! What [`WorkingForm`] has its engines do.

use super::*;

impl Engines for WorkingForm {
    fn motion(&self) -> &Motion {
        &self.motion
    }

    fn motion_mut(&mut self) -> &mut Motion {
        &mut self.motion
    }

    fn rows(&self) -> usize {
        self.safe.dynamics.rows.len()
    }

    fn safe_health(&self) -> Health {
        self.safe.health
    }

    fn solve_dynamics(&mut self) -> Result<Used, AnalysisError> {
        self.solve()
    }

    fn correct_positions(&mut self, finely: bool) -> Result<(f64, Option<usize>), AnalysisError> {
        self.solve_correction(false, finely)
    }

    fn correct_velocities(&mut self) -> Result<(), AnalysisError> {
        self.solve_correction(true, false).map(|_| ())
    }

    fn factor_safely(&mut self, anew: bool) -> Result<Health, AnalysisError> {
        self.note_position();
        if anew {
            self.safe.solver.set_rank_limit(usize::MAX);
            self.safe.factored_at.clear();
        }
        self.safe.geometry.evaluate(&self.motion.inputs, &self.sets)?;
        Ok(self.safe.factor(Source::Geometry, &self.key, &mut self.motion.counters)?)
    }

    fn limit_rank(&mut self, rank: usize) {
        self.safe.solver.set_rank_limit(rank);
    }

    fn independence(&mut self, _: bool) -> Result<Option<Independence>, AnalysisError> {
        self.note_position();
        let Some(engine) = &mut self.regular else { return Ok(None) };
        if self.watch == Watch::Nothing {
            return Ok(Some(Independence { now: 1.0, at_start: 1.0 }));
        }
        engine.geometry.evaluate(&self.motion.inputs, &self.sets)?;
        let health = engine.factor(Source::Geometry, &self.key, &mut self.motion.counters);
        let ratio = health.map_or(0.0, |health| health.smallest_pivot_ratio);
        // It may have fallen because of masses.
        self.least_health = SICK_SHARE * self.start_health.min(ratio / (APPROACH * APPROACH));
        Ok(Some(Independence { now: self.independence_of(Source::Geometry), at_start: self.start_independence }))
    }

    fn accept_independence(&mut self, now: f64) -> bool {
        let all = self.watch == Watch::Loops;
        if all {
            self.start_independence = now;
        }
        all
    }

    fn worst_violation(&mut self) -> Result<(f64, Option<usize>), AnalysisError> {
        let geometry = &mut self.safe.geometry;
        geometry.evaluate(&self.motion.inputs, &self.sets)?;
        Ok(geometry.worst(geometry.function(0), self.motion.length))
    }

    fn asked_by_time(&mut self) -> Result<Vec<(usize, f64)>, AnalysisError> {
        self.safe.geometry.evaluate(&self.motion.inputs, &self.sets)?;
        let times = self.safe.geometry.function(1).to_vec();
        if times.iter().all(|time| *time == 0.0) {
            return Ok(Vec::new());
        }
        self.factor_safely(false)?;
        self.force.fill(0.0);
        let engine = &mut self.safe;
        engine.solver.solve(&self.force, &times, &mut self.motion.accelerations, &mut engine.multipliers)?;
        Ok(shares_of_time(&engine.geometry.rows, &times, &engine.multipliers))
    }

    fn try_motion(&mut self, accelerations: &[f64], power: f64) -> Result<(), AnalysisError> {
        let dynamics = &mut self.safe.dynamics;
        dynamics.evaluate(&self.motion.inputs, &self.sets)?;
        let (loads, further) = dynamics.further(FUNCTIONS).split_at(accelerations.len());
        let trial = Trial {
            structure: &dynamics.structure,
            values: (self.balance.mass(), dynamics.jacobian()),
            gamma: dynamics.function(0),
            velocities: &self.motion.velocities(),
            accelerations,
            loads,
            driven: self.coupling.is_none().then_some(power - further[self.motion.layout.states]),
        };
        trial.accept(|row| self.motion.row_names[dynamics.rows[row]].clone())
    }
}
