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
        self.force.fill(0.0);
        if let Some(engine) = &mut self.regular {
            engine.geometry.evaluate(&self.inputs, &self.sets)?;
            let worst = residual(engine, velocity, &self.layout, &self.inputs, self.length);
            // A residual that is not a number is for the caller to report, with its row.
            if !velocity && ((!finely && worst.0 <= ROUND_OFF * self.length) || !worst.0.is_finite()) {
                self.accelerations.fill(0.0);
                return Ok(worst);
            }
            let health = engine.factor(Source::Geometry, &self.key, &mut self.counters);
            if self.is_trusted(Source::Geometry, &health)
                && let Some(engine) = &mut self.regular
            {
                engine.solver.solve(&self.force, &engine.right, &mut self.accelerations, &mut engine.multipliers)?;
                self.corrected_safely = false;
                return Ok(worst);
            }
        }
        self.corrected_safely = true;
        let engine = &mut self.safe;
        engine.geometry.evaluate(&self.inputs, &self.sets)?;
        let worst = residual(engine, velocity, &self.layout, &self.inputs, self.length);
        if !velocity && !worst.0.is_finite() {
            return Ok(worst);
        }
        engine.factor(Source::Geometry, &self.key, &mut self.counters)?;
        engine.solver.solve(&self.force, &engine.right, &mut self.accelerations, &mut engine.multipliers)?;
        Ok(worst)
    }
}

impl Correcting for WorkingForm {
    fn load(&mut self, t: f64, state: &[f64]) {
        Self::load(self, t, state);
    }

    fn length(&self) -> f64 {
        self.length
    }

    fn was_next_to_singular(&self) -> bool {
        self.corrected_safely && self.is_singular(NEAR_SINGULAR)
    }

    fn name_of(&self, row: Option<usize>) -> String {
        self.row_name(row)
    }

    fn correct_positions(&mut self, finely: bool) -> Result<(f64, Option<usize>), AnalysisError> {
        self.solve_correction(false, finely)
    }

    fn move_along(&self, state: &mut [f64]) -> f64 {
        let mut size = 0.0_f64;
        for body in 0..self.layout.bodies {
            let d = &self.accelerations[6 * body..6 * body + 6];
            move_body(&mut state[BODY_STATES * body..BODY_STATES * body + 7], d);
            for k in 0..3 {
                size = size.max(d[k].abs()).max(d[3 + k].abs() * self.length);
            }
        }
        size
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
