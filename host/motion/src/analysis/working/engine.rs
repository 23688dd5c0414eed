//! The engines of [`WorkingForm`]: a choice of rows with the factorisation that solves for them.

use super::*;

/// A choice of rows with the engine that solves for them.
pub(super) struct Engine<S> {
    /// Jacobian, gamma, Phi_t of the rows; then loads, state rates, power.
    pub(super) dynamics: Constraints,
    /// Jacobian, values, Phi_t of the rows.
    pub(super) geometry: Constraints,
    pub(super) solver: S,
    pub(super) multipliers: Vec<f64>,
    pub(super) right: Vec<f64>,
    /// Position and time of the factorisation in force.
    pub(super) factored_at: Vec<f64>,
    pub(super) health: Health,
}

/// The index of each function in [`Engine::dynamics`] and [`Engine::geometry`].
pub(super) const FUNCTIONS: usize = 2;

impl<S: KktSolver> Engine<S> {
    pub(super) fn new(equations: &Equations, masses: &[f64], rows: &[usize], solver: S) -> Result<Self, AnalysisError> {
        let gamma: fn(&Row) -> _ = |row| row.gamma;
        let time: fn(&Row) -> _ = |row| row.time;
        let value: fn(&Row) -> _ = |row| row.value;
        let mut further = equations.loads.clone();
        further.extend(&equations.state_rates);
        further.push(equations.power);
        let mut engine = Self {
            dynamics: Constraints::new(equations, rows, &[gamma, time], &further)?,
            geometry: Constraints::new(equations, rows, &[value, time], &[])?,
            solver,
            multipliers: vec![0.0; rows.len()],
            right: vec![0.0; rows.len()],
            factored_at: Vec::new(),
            health: Health { rank: 0, smallest_pivot_ratio: 0.0 },
        };
        engine.solver.set_mass(masses)?;
        Ok(engine)
    }

    /// The same rows by another solver.
    pub(super) fn with<T: KktSolver>(&self, masses: &[f64], solver: T) -> Result<Engine<T>, AnalysisError> {
        let mut engine = Engine {
            dynamics: self.dynamics.clone(),
            geometry: self.geometry.clone(),
            multipliers: self.multipliers.clone(),
            right: self.right.clone(),
            factored_at: Vec::new(),
            health: Health { rank: 0, smallest_pivot_ratio: 0.0 },
            solver,
        };
        engine.solver.set_mass(masses)?;
        Ok(engine)
    }

    /// Accelerations, multipliers, state rates and power from the functions evaluated and the factorisation in force.
    pub(super) fn solve_motion(
        &mut self,
        coupling: Option<&mut BodyCoupling>,
        inputs: &mut [f64],
        sets: &[Box<dyn ElementSet>],
        solution: Solution<'_>,
        counters: &mut Counters,
    ) -> Result<(), AnalysisError> {
        let Solution { accelerations, rates } = solution;
        match coupling {
            None => {
                let (loads, further) = self.dynamics.further(FUNCTIONS).split_at(accelerations.len());
                rates.copy_from_slice(further);
                self.solver.solve(loads, self.dynamics.function(0), accelerations, &mut self.multipliers)?;
            }
            Some(coupling) => {
                self.right.fill(0.0);
                let mut solver = Solver { dynamics: &self.dynamics, solver: &mut self.solver, zero: &self.right };
                coupling.solve(inputs, sets, &mut solver, accelerations, &mut self.multipliers, counters)?;
                rates.copy_from_slice(coupling.rates());
            }
        }
        Ok(())
    }

    /// Adds the solution for what `balance` says is left of the equations.
    pub(super) fn refine(&mut self, balance: &Balance, accelerations: &mut [f64]) -> Result<(), LinalgError> {
        let (f, g) = balance.left(self.multipliers.len());
        let (mut da, mut dlambda) = (vec![0.0; f.len()], vec![0.0; g.len()]);
        self.solver.solve(f, g, &mut da, &mut dlambda)?;
        accelerations.iter_mut().zip(&da).for_each(|(a, d)| *a += d);
        self.multipliers.iter_mut().zip(&dlambda).for_each(|(lambda, d)| *lambda += d);
        Ok(())
    }

    /// Factors the Jacobian unless the one of this very position is in force.
    pub(super) fn factor(&mut self, from: Source, key: &[f64], counters: &mut Counters) -> Result<Health, LinalgError> {
        if self.factored_at == key {
            counters.reused += 1;
            return Ok(self.health);
        }
        self.factored_at.clear();
        let jacobian = match from {
            Source::Dynamics => self.dynamics.jacobian(),
            Source::Geometry => self.geometry.jacobian(),
        };
        counters.factorisations += 1;
        self.health = self.solver.refactor(jacobian)?;
        self.factored_at.extend_from_slice(key);
        Ok(self.health)
    }
}

/// Where the solution of the equations of motion goes.
pub(super) struct Solution<'a> {
    pub(super) accelerations: &'a mut [f64],
    /// Rates of the element states, then the power.
    pub(super) rates: &'a mut [f64],
}

/// An engine as the coupling sees it.
pub(super) struct Solver<'a, S> {
    pub(super) dynamics: &'a Constraints,
    pub(super) solver: &'a mut S,
    pub(super) zero: &'a [f64],
}

impl<S: KktSolver> Solve for Solver<'_, S> {
    fn solve(
        &mut self,
        loads: &[f64],
        with_gamma: bool,
        accelerations: &mut [f64],
        multipliers: &mut [f64],
    ) -> Result<(), AnalysisError> {
        let right = if with_gamma { self.dynamics.function(0) } else { self.zero };
        Ok(self.solver.solve(loads, right, accelerations, multipliers)?)
    }
    fn rows(&self) -> &[usize] {
        &self.dynamics.rows
    }
}

#[derive(Clone, Copy)]
pub(super) enum Source {
    Dynamics,
    Geometry,
}

/// One cluster per body, and one per joint.
pub(in crate::analysis) fn clusters(layout: &Layout, rows: &[usize]) -> Clusters {
    Clusters {
        velocities: (0..layout.velocities()).map(|k| k / 6).collect(),
        rows: rows.iter().map(|row| layout.element_of_row(*row).0).collect(),
    }
}

/// The sparse engine for a choice of rows: one cluster per body and per joint.
///
/// # Errors
/// When the patterns are inconsistent, which would be a defect of the equations.
pub fn sparse_engine(equations: &Equations, rows: &[usize], layout: &Layout) -> Result<SparseLdl, LinalgError> {
    let structure = structure(equations, rows)?;
    SparseLdl::with_computed_order(&structure, Some(&clusters(layout, rows)))
}
