//! [`WorkingForm`] brought to its constraints.

use super::*;

impl WorkingForm {
    /// The smallest move (in the metric of the mass) that changes the rows by minus their residual: M d + Phi_q^T mu = 0,
    /// Phi_q d = -residual. Left in `accelerations`. Returns which residual was worst and by how much. Unless `finely`,
    /// residuals of positions that are round-off are left alone.
    pub(super) fn solve_correction(
        &mut self,
        velocity: bool,
        finely: bool,
    ) -> Result<(f64, Option<usize>), AnalysisError> {
        self.note_position();
        self.force.fill(0.0);
        if let Some(engine) = &mut self.regular {
            engine.geometry.evaluate(&self.motion.inputs, &self.sets)?;
            let worst = residual(engine, velocity, &self.motion.layout, &self.motion.inputs, self.motion.length);
            // A residual that is not a number is for the caller to report, with its row.
            if !velocity && ((!finely && worst.0 <= ROUND_OFF * self.motion.length) || !worst.0.is_finite()) {
                self.motion.accelerations.fill(0.0);
                return Ok(worst);
            }
            let health = engine.factor(Source::Geometry, &self.key, &mut self.motion.counters);
            if self.is_trusted(Source::Geometry, &health)
                && let Some(engine) = &mut self.regular
            {
                engine.solver.solve(
                    &self.force,
                    &engine.right,
                    &mut self.motion.accelerations,
                    &mut engine.multipliers,
                )?;
                self.motion.corrected_safely = false;
                return Ok(worst);
            }
        }
        self.motion.corrected_safely = true;
        let engine = &mut self.safe;
        engine.geometry.evaluate(&self.motion.inputs, &self.sets)?;
        let worst = residual(engine, velocity, &self.motion.layout, &self.motion.inputs, self.motion.length);
        if !velocity && !worst.0.is_finite() {
            return Ok(worst);
        }
        engine.factor(Source::Geometry, &self.key, &mut self.motion.counters)?;
        engine.solver.solve(&self.force, &engine.right, &mut self.motion.accelerations, &mut engine.multipliers)?;
        Ok(worst)
    }

    /// Takes out of a small difference of states the smallest one that violates the rows by as much, by the factors of the last
    /// evaluation. Trees keep theirs: there a violation stays with its joint. Around a loop, or along a row of them, those of all
    /// joints add up in what is solved for. Nor is anything done where these factors are not trusted, or where states are brought
    /// to the constraints before they are evaluated.
    pub(super) fn take_out_violation(&mut self, difference: &mut [f64]) {
        let Some(health) = self.regular.as_ref().filter(|engine| !engine.factored_at.is_empty()).map(|e| e.health)
        else {
            return;
        };
        if self.watch == Watch::Nothing || self.motion.careful || !self.is_trusted(Source::Dynamics, &Ok(health)) {
            return;
        }
        self.force.fill(0.0);
        let (Some(engine), motion) = (&mut self.regular, &mut self.motion) else { return };
        for velocity in [false, true] {
            motion.read_difference(velocity, difference);
            engine.right.fill(0.0);
            for ((row, column), value) in engine.dynamics.structure.jacobian.iter().zip(engine.dynamics.jacobian()) {
                engine.right[*row] += value * motion.accelerations[*column];
            }
            let found =
                engine.solver.solve(&self.force, &engine.right, &mut motion.accelerations, &mut engine.multipliers);
            if found.is_ok() {
                motion.take_from_difference(velocity, difference);
            }
        }
    }
}

/// Puts minus the residual of positions or velocities into `engine.right`; gives the worst violation.
fn residual<S>(
    engine: &mut Engine<S>,
    velocity: bool,
    layout: &Layout,
    inputs: &[f64],
    length: f64,
) -> (f64, Option<usize>) {
    if velocity {
        rate_residual(&engine.geometry, layout, inputs, &mut engine.right);
    } else {
        engine.right.copy_from_slice(engine.geometry.function(0));
    }
    let worst = engine.geometry.worst(&engine.right, length);
    engine.right.iter_mut().for_each(|x| *x = -*x);
    worst
}

/// Phi_q [v; omega'] + Phi_t.
fn rate_residual(geometry: &Constraints, layout: &Layout, inputs: &[f64], right: &mut [f64]) {
    right.copy_from_slice(geometry.function(1));
    for ((row, column), value) in geometry.structure.jacobian.iter().zip(geometry.jacobian()) {
        right[*row] += value * inputs[layout.body_slot(column / 6, 7 + column % 6)];
    }
}
