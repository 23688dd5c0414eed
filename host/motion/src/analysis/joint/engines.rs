//! What [`JointForm`] has its engines do.

use super::*;

impl Engines for JointForm {
    fn motion(&self) -> &Motion {
        &self.motion
    }

    fn motion_mut(&mut self) -> &mut Motion {
        &mut self.motion
    }

    fn rows(&self) -> usize {
        self.safe.rows.len()
    }

    fn safe_health(&self) -> Health {
        self.safe.health
    }

    fn solve_dynamics(&mut self) -> Result<Used, AnalysisError> {
        self.solve()
    }

    fn before_corrections(&mut self) -> Result<(), AnalysisError> {
        self.look().map(|_| ())
    }

    fn correct_positions(&mut self, finely: bool) -> Result<(f64, Option<usize>), AnalysisError> {
        let columns = self.motion.coordinates.columns;
        if let Some(regular) = &mut self.regular {
            regular.position.run(&self.motion.inputs, &self.bodies.sets)?;
            let outputs = regular.position.outputs();
            let worst = worst(&outputs[columns..columns + regular.rows.len()], &regular.rows, &self.regular_sizes);
            if (!finely && worst.0 <= ROUND_OFF * self.motion.length) || !worst.0.is_finite() {
                return Ok(worst);
            }
            let ratio = pivot_ratio(outputs, columns, &regular.squares);
            if self.is_trusted(ratio)?
                && let Some(regular) = &self.regular
            {
                self.motion.accelerations.copy_from_slice(&regular.position.outputs()[..columns]);
                self.motion.corrected_safely = false;
                return Ok(worst);
            }
        }
        self.motion.corrected_safely = true;
        self.safe.factor(&self.motion.inputs, &self.bodies.sets, &mut self.motion.counters)?;
        let worst = worst(self.safe.function(Function::Value), &self.safe.rows, &self.row_sizes);
        if !worst.0.is_finite() {
            return Ok(worst);
        }
        let mut right = std::mem::take(&mut self.safe.right);
        right.iter_mut().zip(self.safe.function(Function::Value)).for_each(|(x, value)| *x = -value);
        self.safe.right = right;
        self.safe.solve_correction()?;
        self.motion.accelerations.copy_from_slice(&self.safe.accelerations);
        Ok(worst)
    }

    fn correct_velocities(&mut self) -> Result<(), AnalysisError> {
        let columns = self.motion.coordinates.columns;
        if let Some(regular) = &mut self.regular {
            let outputs = regular.velocity.run(&self.motion.inputs, &self.bodies.sets)?;
            self.motion.accelerations.copy_from_slice(&outputs[..columns]);
            self.is_look_due = true;
            // Where that is enough, the rest of the look is for those who ask.
            let is_sound = !self.motion.careful && regular.velocity_ratio(columns) >= self.least_health;
            if is_sound || self.take_look() {
                self.motion.corrected_safely = false;
                return Ok(());
            }
        }
        self.motion.corrected_safely = true;
        self.safe.factor(&self.motion.inputs, &self.bodies.sets, &mut self.motion.counters)?;
        let mut right = std::mem::take(&mut self.safe.right);
        right.copy_from_slice(self.safe.function(Function::Time));
        for ((row, column), slope) in self.safe.structure.jacobian.iter().zip(self.safe.jacobian()) {
            right[*row] += slope * self.motion.inputs[self.motion.coordinates.velocity_slots[*column]];
        }
        right.iter_mut().for_each(|x| *x = -*x);
        self.safe.right = right;
        self.safe.solve_correction()?;
        self.motion.accelerations.copy_from_slice(&self.safe.accelerations);
        Ok(())
    }

    fn factor_safely(&mut self, anew: bool) -> Result<Health, AnalysisError> {
        if anew {
            self.safe.solver.set_rank_limit(usize::MAX);
        }
        self.safe.factor(&self.motion.inputs, &self.bodies.sets, &mut self.motion.counters)
    }

    fn limit_rank(&mut self, rank: usize) {
        self.safe.solver.set_rank_limit(rank);
    }

    fn independence(&mut self, was_careful: bool) -> Result<Option<Independence>, AnalysisError> {
        if self.regular.is_none() {
            return Ok(None);
        }
        if was_careful {
            // Positions may have been brought to the constraints without the regular engine.
            self.look()?;
        }
        self.take_look();
        self.least_health = least_health(&self.first, &self.last);
        Ok(Some(Independence { now: self.last.independence, at_start: self.first.independence }))
    }

    fn accept_independence(&mut self, now: f64) -> bool {
        if !self.choice {
            self.first.independence = now;
        }
        !self.choice
    }

    fn worst_violation(&mut self) -> Result<(f64, Option<usize>), AnalysisError> {
        self.safe.terms.run(&self.motion.inputs, &self.bodies.sets)?;
        Ok(worst(self.safe.function(Function::Value), &self.safe.rows, &self.row_sizes))
    }

    fn asked_by_time(&mut self) -> Result<Vec<(usize, f64)>, AnalysisError> {
        self.safe.terms.run(&self.motion.inputs, &self.bodies.sets)?;
        let times = self.safe.function(Function::Time).to_vec();
        if times.iter().all(|time| *time == 0.0) {
            return Ok(Vec::new());
        }
        self.factor_safely(false)?;
        self.safe.right.copy_from_slice(&times);
        self.safe.solve_correction()?;
        Ok(shares_of_time(&self.safe.rows, &times, &self.safe.multipliers))
    }

    fn try_motion(&mut self, accelerations: &[f64], power: f64) -> Result<(), AnalysisError> {
        self.safe.terms.run(&self.motion.inputs, &self.bodies.sets)?;
        let (loads, further) = self.safe.loads();
        let trial = Trial {
            structure: &self.safe.structure,
            values: (self.safe.mass(), self.safe.jacobian()),
            gamma: self.safe.function(Function::Gamma),
            velocities: &self.motion.velocities(),
            accelerations,
            loads,
            driven: self.coupling.is_none().then_some(power - further[self.motion.layout.states]),
        };
        trial.accept(|row| self.motion.row_names[self.safe.rows[row]].clone())
    }
}

/// The worst of the violations of rows, and which it is. Values and sizes are theirs.
fn worst(values: &[f64], rows: &[usize], sizes: &[f64]) -> (f64, Option<usize>) {
    let mut worst = (0.0, None);
    for ((value, row), size) in values.iter().zip(rows).zip(sizes) {
        let violation = value.abs() / size;
        if violation.is_nan() || violation > worst.0 {
            worst = (violation, Some(*row));
        }
    }
    worst
}
