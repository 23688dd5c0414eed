//! [`JointForm`] brought to its constraints.

use super::*;

impl JointForm {
    /// The smallest change of velocities that meets the rows, left in `accelerations`.
    pub(super) fn correct_velocities(&mut self) -> Result<(), AnalysisError> {
        let columns = self.coordinates.columns;
        if let Some(regular) = &mut self.regular {
            let outputs = regular.velocity.run(&self.inputs, &self.bodies.sets)?;
            self.accelerations.copy_from_slice(&outputs[..columns]);
            self.take_look();
            if self.trusted || !self.careful && self.last.ratio >= self.least_health {
                self.corrected_safely = false;
                return Ok(());
            }
        }
        self.corrected_safely = true;
        self.safe.factor(&self.inputs, &self.bodies.sets, &mut self.counters)?;
        let mut right = std::mem::take(&mut self.safe.right);
        right.copy_from_slice(self.safe.function(Function::Time));
        for ((row, column), slope) in self.safe.structure.jacobian.iter().zip(self.safe.jacobian()) {
            right[*row] += slope * self.inputs[self.coordinates.velocity_slots[*column]];
        }
        right.iter_mut().for_each(|x| *x = -*x);
        self.safe.right = right;
        self.safe.solve_correction()?;
        self.accelerations.copy_from_slice(&self.safe.accelerations);
        Ok(())
    }
}

impl Correcting for JointForm {
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
        let columns = self.coordinates.columns;
        if let Some(regular) = &mut self.regular {
            regular.position.run(&self.inputs, &self.bodies.sets)?;
            let outputs = regular.position.outputs();
            let worst =
                worst(&outputs[columns..columns + regular.rows.len()], &regular.rows, &self.safe.rows, &self.row_sizes);
            if (!finely && worst.0 <= ROUND_OFF * self.length) || !worst.0.is_finite() {
                return Ok(worst);
            }
            let ratio = pivot_ratio(outputs, columns, &regular.squares);
            if self.is_trusted(ratio)?
                && let Some(regular) = &self.regular
            {
                self.accelerations.copy_from_slice(&regular.position.outputs()[..columns]);
                self.corrected_safely = false;
                return Ok(worst);
            }
        }
        self.corrected_safely = true;
        self.safe.factor(&self.inputs, &self.bodies.sets, &mut self.counters)?;
        let worst = worst(self.safe.function(Function::Value), &self.safe.rows, &self.safe.rows, &self.row_sizes);
        if !worst.0.is_finite() {
            return Ok(worst);
        }
        let mut right = std::mem::take(&mut self.safe.right);
        right.iter_mut().zip(self.safe.function(Function::Value)).for_each(|(x, value)| *x = -value);
        self.safe.right = right;
        self.safe.solve_correction()?;
        self.accelerations.copy_from_slice(&self.safe.accelerations);
        Ok(worst)
    }

    fn move_along(&self, state: &mut [f64]) -> f64 {
        let mut size = 0.0_f64;
        for line in &self.coordinates.lines {
            let step = self.accelerations[line.column];
            state[line.position] += step;
            let scale = if line.measure == Measure::Length { 1.0 } else { self.length };
            size = size.max(step.abs() * scale);
        }
        for rotation in &self.coordinates.rotations {
            let d = &self.accelerations[rotation.column..rotation.column + 3];
            let p = &mut state[rotation.position..rotation.position + 4];
            let rate = parameter_rates([p[0], p[1], p[2], p[3]], [d[0], d[1], d[2]]);
            p.iter_mut().zip(rate).for_each(|(e, step)| *e += step);
            normalise(p);
            size = d.iter().fold(size, |size, step| size.max(step.abs() * self.length));
        }
        size
    }
}

/// The worst of the violations of rows in use, and which it is. `sizes` belong to `all`.
pub(super) fn worst(values: &[f64], rows: &[usize], all: &[usize], sizes: &[f64]) -> (f64, Option<usize>) {
    let mut worst = (0.0, None);
    let mut at = 0;
    for (value, row) in values.iter().zip(rows) {
        // Both ascend.
        while all[at] != *row {
            at += 1;
        }
        let violation = value.abs() / sizes[at];
        if violation.is_nan() || violation > worst.0 {
            worst = (violation, Some(*row));
        }
    }
    worst
}
