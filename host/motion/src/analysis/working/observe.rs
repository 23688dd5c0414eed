//! What [`WorkingForm`] reports: accelerations and multipliers, and how well they balance.

use super::*;

impl WorkingForm {
    /// Accelerations and multipliers next to a singular position into the inputs; `false` where the velocity does not lead
    /// through it, and nothing is done.
    pub(super) fn observe_between(&mut self, t: f64, state: &[f64]) -> Result<bool, AnalysisError> {
        // They follow each other among the inputs.
        let slots = self.motion.layout.acceleration_slot()..self.motion.layout.inputs();
        let (mut passage, mut forces) = (std::mem::take(&mut self.motion.passage), std::mem::take(&mut self.forces));
        let passed = passage.interpolate(self, t, state, &mut forces, |form, t, place, forces| {
            project_plainly(form, t, place, false)?;
            form.motion.load(t, place);
            let used = form.solve_dynamics()?;
            form.publish(used);
            forces.copy_from_slice(&form.motion.inputs[slots.clone()]);
            Ok(())
        });
        (self.motion.passage, self.forces) = (passage, forces);
        self.motion.load(t, state);
        // A state is what it is, whatever comes after it.
        let passed = match passed {
            Err(AnalysisError::OutOfReach { .. }) => Way::Round,
            passed => passed?,
        };
        if passed != Way::Through {
            // As it was before.
            self.solve_dynamics()?;
            return Ok(false);
        }
        self.motion.inputs[slots].copy_from_slice(&self.forces);
        if self.unbalanced()? > BALANCED {
            // Reactions may have a pole there. What is solved for next to it is the better for that.
            self.solve_dynamics()?;
            return Ok(false);
        }
        self.motion.counters.interpolated += 1;
        Ok(true)
    }

    /// How far accelerations and multipliers in the inputs miss all equations, see [`Balance::of_all`].
    pub(super) fn unbalanced(&mut self) -> Result<f64, AnalysisError> {
        let dynamics = &mut self.safe.dynamics;
        dynamics.evaluate(&self.motion.inputs, &self.sets)?;
        let (a, lambda) =
            self.motion.inputs[self.motion.layout.acceleration_slot()..].split_at(self.motion.layout.velocities());
        let lambda: Vec<f64> = dynamics.rows.iter().map(|row| lambda[*row]).collect();
        self.balance.take(dynamics, &dynamics.further(FUNCTIONS)[..a.len()], a, &lambda);
        Ok(self.balance.of_all())
    }

    /// How far what was solved for and published misses the equations of motion of a body, forces that depend on the solution
    /// evaluated with it. Where it misses them by more than round-off, the solution is refined once.
    pub(super) fn certify(&mut self, used: Used) -> Result<Imbalance, AnalysisError> {
        let found = self.left_of_bodies(used, Balance::take_motion)?;
        if found.share <= REFINED {
            return Ok(found);
        }
        self.left_of_bodies(used, Balance::take)?;
        match (used, &mut self.regular) {
            (Used::Regular, Some(engine)) => engine.refine(&self.balance, &mut self.motion.accelerations)?,
            _ => self.safe.refine(&self.balance, &mut self.motion.accelerations)?,
        }
        self.publish(used);
        self.left_of_bodies(used, Balance::take_motion)
    }

    pub(super) fn left_of_bodies(
        &mut self,
        used: Used,
        take: fn(&mut Balance, &Constraints, &[f64], &[f64], &[f64]),
    ) -> Result<Imbalance, AnalysisError> {
        let (dynamics, lambda) = match (used, &self.regular) {
            (Used::Regular, Some(engine)) => (&engine.dynamics, &engine.multipliers),
            _ => (&self.safe.dynamics, &self.safe.multipliers),
        };
        let loads = match &mut self.coupling {
            Some(coupling) => coupling.loads(&self.motion.inputs, &self.sets)?,
            None => &dynamics.further(FUNCTIONS)[..self.motion.accelerations.len()],
        };
        take(&mut self.balance, dynamics, loads, &self.motion.accelerations, lambda);
        if let Some(coupling) = &mut self.coupling {
            self.balance.take_terms(coupling.made_of(&self.motion.inputs, &self.sets)?);
        }
        Ok(self.balance.of_bodies())
    }

    /// The rows that an engine solved for, and their multipliers.
    pub(super) fn solved(&self, used: Used) -> (&Constraints, &[f64]) {
        match (used, &self.regular) {
            (Used::Regular, Some(engine)) => (&engine.dynamics, &engine.multipliers),
            _ => (&self.safe.dynamics, &self.safe.multipliers),
        }
    }

    /// Accelerations and multipliers into the inputs.
    pub(super) fn publish(&mut self, used: Used) {
        let (rows, multipliers) = match (used, &self.regular) {
            (Used::Regular, Some(engine)) => (&engine.dynamics.rows, &engine.multipliers),
            _ => (&self.safe.dynamics.rows, &self.safe.multipliers),
        };
        self.motion.publish(&self.safe.dynamics.rows, rows, multipliers);
    }
}
