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
