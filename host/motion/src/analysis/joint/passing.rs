//! [`JointForm`] next to singular positions.

use super::project::worst;
use super::*;

impl Refusing for JointForm {
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
        for rotation in &self.coordinates.rotations {
            normalise(&mut state[rotation.position..rotation.position + 4]);
        }
    }

    fn project_plainly(&mut self, t: f64, state: &mut [f64], keep_away: bool) -> Result<(), AnalysisError> {
        self.normalise(state);
        if self.safe.rows.is_empty() {
            return Ok(());
        }
        if self.careful {
            self.load(t, state);
            self.look()?;
        }
        project_positions(self, t, state, keep_away)?;
        self.correct_velocities()?;
        for line in &self.coordinates.lines {
            state[line.velocity] += self.accelerations[line.column];
        }
        for rotation in &self.coordinates.rotations {
            for k in 0..3 {
                state[rotation.velocity + k] += self.accelerations[rotation.column + k];
            }
        }
        Ok(())
    }

    fn miss(&mut self, t: f64, state: &[f64]) -> Result<(f64, String), AnalysisError> {
        self.load(t, state);
        self.safe.terms.run(&self.inputs, &self.bodies.sets)?;
        let (violation, row) =
            worst(self.safe.function(Function::Value), &self.safe.rows, &self.safe.rows, &self.row_sizes);
        Ok((violation / self.length, self.row_name(row)))
    }

    fn try_rates(&mut self, t: f64, state: &[f64], rates: &[f64]) -> Result<(), AnalysisError> {
        self.load(t, state);
        self.safe.terms.run(&self.inputs, &self.bodies.sets)?;
        let mut accelerations = vec![0.0; self.coordinates.columns];
        for line in &self.coordinates.lines {
            accelerations[line.column] = rates[line.velocity];
        }
        for rotation in &self.coordinates.rotations {
            let spin = &rates[rotation.velocity..rotation.velocity + 3];
            accelerations[rotation.column..rotation.column + 3].copy_from_slice(spin);
        }
        let velocities: Vec<f64> = self.coordinates.velocity_slots.iter().map(|slot| self.inputs[*slot]).collect();
        let (loads, further) = self.safe.loads();
        let work = self.layout.states;
        let trial = Trial {
            structure: &self.safe.structure,
            values: (self.safe.mass(), self.safe.jacobian()),
            gamma: self.safe.function(Function::Gamma),
            velocities: &velocities,
            accelerations: &accelerations,
            loads,
            driven: self.coupling.is_none().then_some(rates[self.coordinates.motion + work] - further[work]),
        };
        trial.accept(|row| self.row_names[self.safe.rows[row]].clone())
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
        if used == Used::Safe && keep_away && self.is_singular(NEAR_SINGULAR) {
            return Err(AnalysisError::NextToSingular);
        }
        for line in &self.coordinates.lines {
            rates[line.position] = state[line.velocity];
            rates[line.velocity] = self.accelerations[line.column];
        }
        for rotation in &self.coordinates.rotations {
            let p = &state[rotation.position..rotation.position + 4];
            let w = &state[rotation.velocity..rotation.velocity + 3];
            let turn = parameter_rates([p[0], p[1], p[2], p[3]], [w[0], w[1], w[2]]);
            rates[rotation.position..rotation.position + 4].copy_from_slice(&turn);
            let spin = &self.accelerations[rotation.column..rotation.column + 3];
            rates[rotation.velocity..rotation.velocity + 3].copy_from_slice(spin);
        }
        rates[self.coordinates.motion..].copy_from_slice(&self.rates);
        Ok(())
    }
}

impl Passing for JointForm {
    fn fastest(&self, state: &[f64]) -> f64 {
        let scale = |measure: Measure| if measure == Measure::Length { 1.0 / self.length } else { 1.0 };
        let lines = self.coordinates.lines.iter().map(|line| state[line.velocity].abs() * scale(line.measure));
        let spins = self.coordinates.rotations.iter().flat_map(|rotation| (0..3).map(|k| rotation.velocity + k));
        lines.chain(spins.map(|at| state[at].abs())).fold(0.0, f64::max)
    }

    fn shift(&self, state: &[f64], s: f64, moved: &mut [f64]) {
        moved.copy_from_slice(state);
        for line in &self.coordinates.lines {
            moved[line.position] += s * state[line.velocity];
        }
        for rotation in &self.coordinates.rotations {
            let p = &state[rotation.position..rotation.position + 4];
            let w = &state[rotation.velocity..rotation.velocity + 3];
            let turn = parameter_rates([p[0], p[1], p[2], p[3]], [w[0], w[1], w[2]]);
            moved[rotation.position..rotation.position + 4].iter_mut().zip(turn).for_each(|(e, rate)| *e += s * rate);
        }
        self.normalise(moved);
    }

    fn share(&mut self, t: f64, state: &[f64]) -> Result<f64, AnalysisError> {
        self.load(t, state);
        let health = self.safe.factor(&self.inputs, &self.bodies.sets, &mut self.counters)?;
        let lost = health.rank < self.at_start.rank;
        Ok(if lost { 0.0 } else { health.smallest_pivot_ratio / self.at_start.smallest_pivot_ratio })
    }
}
