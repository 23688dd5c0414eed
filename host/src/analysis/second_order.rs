//! [`SecondOrderForm`]: the equations of motion with constraints on positions, for methods that solve them as they are.
//!
//! M a + Phi_q^T lambda - Q = 0, Phi = 0, six velocities per body. The matrix of Newton's method in the moves of a step, with
//! the equations of motion and the multipliers divided by the mass share, which goes with 1 / h^2 (Bottasso, Bauchau &
//! Cardona 2007, Multibody System Dynamics 18):
//!
//! \[M + (damping_share C + K) / mass_share, Phi_q^T; Phi_q, 0\] \[moves; changes / mass_share\] = -\[r / mass_share; Phi\].
//!
//! It tends to the matrix of the index-1 equations for small steps, whatever the units of time. C and K are exact derivatives,
//! nodes of the graph, where these are known and the matrix is small enough for a dense factorisation; otherwise they are left
//! out, and what remains is solved as sparse as the accelerations elsewhere.

use super::constraints::{Constraints, mass_values};
use super::evaluator::Evaluator;
use super::formulation::AnalysisError;
use super::linearisation::{Terms, residuals, seeds};
use super::working::{BODY_STATES, MOTION_RANK_TOLERANCE, normalise, parameter_rates, sparse_engine};
use crate::linalg::{DenseQr, FullPivLu, KktSolver};
use crate::model::Model;
use crate::plan::{Layout, Plan};
use crate::program::{Equations, Node, Row, Sets, Used, derivatives};

/// Unknowns up to which the matrix with C and K is factored, densely.
const MOST_UNKNOWNS: usize = 300;
/// Share of the largest pivot at or below which a pivot counts as zero. Rows and columns are scaled before.
const NO_PIVOT: f64 = 1e-14;

/// See the module documentation.
pub struct SecondOrderForm {
    layout: Layout,
    inputs: Vec<f64>,
    /// Jacobian, values, Phi_t of the rows in use; then loads and power.
    equations: Constraints,
    /// Values of the mass matrix, aligned with the pattern.
    mass: Vec<f64>,
    engine: Engine,
    mass_share: f64,
    forces: Vec<f64>,
    right: Vec<f64>,
    evaluations: u64,
    factorisations: u64,
}

/// How the equations of Newton's method are solved.
enum Engine {
    /// With C and K.
    Exact(Box<Exact>),
    /// Without them.
    Structure(Box<dyn KktSolver>),
}

/// The dense matrix with exact derivatives.
struct Exact {
    /// Derivatives of Q - Phi_q^T lambda that are not always zero, and where each belongs: row, direction (positions, then
    /// velocities).
    slopes: Evaluator,
    entries: Vec<(usize, usize)>,
    matrix: FullPivLu,
    /// Of unknowns and equations: both blocks on the diagonal get entries of the order of one.
    scales: Vec<f64>,
    side: Vec<f64>,
    found: Vec<f64>,
}

impl SecondOrderForm {
    /// Prepares programs and the matrix. Nothing that depends on accelerations or reactions may act, and no element may have
    /// continuous states: neither is in these equations.
    ///
    /// # Errors
    /// When the linear algebra refuses the model's mass matrix.
    pub fn new(equations: &Equations, model: &Model, plan: &Plan) -> Result<Self, AnalysisError> {
        let layout = plan.layout.clone();
        let rows = &plan.independent_rows;
        let value: fn(&Row) -> Node = |row| row.value;
        let time: fn(&Row) -> Node = |row| row.time;
        let mut further = equations.loads.clone();
        further.push(equations.power);
        let functions = Constraints::new(equations, rows, &[value, time], &further)?;
        let mass = mass_values(model);
        let unknowns = layout.velocities() + rows.len();
        let terms = Terms::of_bodies(equations, &layout).filter(|_| unknowns <= MOST_UNKNOWNS);
        let engine = match (terms, &plan.always_rank_safe) {
            (Some(terms), _) => Engine::Exact(Box::new(Exact::new(equations, &terms, &layout, rows))),
            (None, None) => Engine::Structure(Box::new(sparse_engine(equations, rows, &layout)?)),
            (None, Some(_)) => Engine::Structure(Box::new(DenseQr::new(&functions.structure, MOTION_RANK_TOLERANCE)?)),
        };
        let mut form = Self {
            inputs: vec![0.0; layout.inputs()],
            forces: vec![0.0; layout.velocities()],
            right: vec![0.0; rows.len()],
            equations: functions,
            mass,
            engine,
            mass_share: 1.0,
            evaluations: 0,
            factorisations: 0,
            layout,
        };
        if let Engine::Structure(solver) = &mut form.engine {
            solver.set_mass(&form.mass)?;
        }
        Ok(form)
    }

    /// The rows in use, by their number among all.
    #[must_use]
    pub fn rows_in_use(&self) -> &[usize] {
        &self.equations.rows
    }

    /// Angle references and discrete element states, which stay as they are during a step.
    pub fn set_discrete(&mut self, references: &[f64], discrete: &[f64]) {
        let slot = self.layout.reference_slot();
        self.inputs[slot..slot + references.len()].copy_from_slice(references);
        let slot = self.layout.discrete_slot();
        self.inputs[slot..slot + discrete.len()].copy_from_slice(discrete);
    }

    /// `forces` := M a + Phi_q^T lambda - Q, `rows` := Phi, and the rates of the state (per body r, p, v, omega'; then the
    /// work) with these accelerations. `[hot, no allocation]`
    ///
    /// # Errors
    /// What an opaque element did wrong.
    pub fn residual(
        &mut self,
        (t, state): (f64, &[f64]),
        (accelerations, multipliers): (&[f64], &[f64]),
        sets: &Sets,
        (forces, rows): (&mut [f64], &mut [f64]),
        rates: &mut [f64],
    ) -> Result<(), AnalysisError> {
        self.evaluations += 1;
        self.load(t, state, accelerations, multipliers);
        self.equations.evaluate(&self.inputs, sets)?;
        let further = self.equations.further(2);
        for (force, load) in forces.iter_mut().zip(further) {
            *force = -load;
        }
        for ((row, column), value) in self.equations.structure.mass.iter().zip(&self.mass) {
            forces[*row] += value * accelerations[*column];
            if row != column {
                forces[*column] += value * accelerations[*row];
            }
        }
        for ((row, column), value) in self.equations.structure.jacobian.iter().zip(self.equations.jacobian()) {
            forces[*column] += value * multipliers[*row];
        }
        rows.copy_from_slice(self.equations.function(0));
        for body in 0..self.layout.bodies {
            let y = &state[BODY_STATES * body..BODY_STATES * (body + 1)];
            let dy = &mut rates[BODY_STATES * body..BODY_STATES * (body + 1)];
            dy[..3].copy_from_slice(&y[7..10]);
            dy[3..7].copy_from_slice(&parameter_rates([y[3], y[4], y[5], y[6]], [y[10], y[11], y[12]]));
            dy[7..13].copy_from_slice(&accelerations[6 * body..6 * body + 6]);
        }
        // Constraints that depend on time do work too: the power of -Phi_q^T lambda is lambda . Phi_t.
        let driven: f64 = self.equations.function(1).iter().zip(multipliers).map(|(time, lambda)| time * lambda).sum();
        let power = further[self.layout.velocities()] + driven;
        rates[BODY_STATES * self.layout.bodies..].fill(power);
        Ok(())
    }

    /// Factors the matrix where the residual was evaluated last.
    ///
    /// # Errors
    /// What the linear algebra refuses; what an opaque element did wrong.
    pub fn factor(&mut self, mass_share: f64, damping_share: f64, sets: &Sets) -> Result<(), AnalysisError> {
        self.factorisations += 1;
        self.mass_share = mass_share;
        match &mut self.engine {
            Engine::Exact(exact) => {
                let shares = [1.0 / mass_share, damping_share / mass_share];
                exact.factor(&self.inputs, &self.equations, &self.mass, shares, sets)
            }
            Engine::Structure(solver) => {
                solver.refactor(self.equations.jacobian())?;
                Ok(())
            }
        }
    }

    /// The moves and the changes of the multipliers that take a residual away. `[hot, no allocation]`
    ///
    /// # Errors
    /// [`crate::linalg::LinalgError::NotFactored`].
    pub fn solve(
        &mut self,
        (forces, rows): (&[f64], &[f64]),
        (moves, changes): (&mut [f64], &mut [f64]),
    ) -> Result<(), AnalysisError> {
        for (right, force) in self.forces.iter_mut().zip(forces) {
            *right = -force / self.mass_share;
        }
        for (right, row) in self.right.iter_mut().zip(rows) {
            *right = -row;
        }
        match &mut self.engine {
            Engine::Exact(exact) => exact.solve(&self.forces, &self.right, moves, changes)?,
            Engine::Structure(solver) => solver.solve(&self.forces, &self.right, moves, changes)?,
        }
        changes.iter_mut().for_each(|change| *change *= self.mass_share);
        Ok(())
    }

    /// The programs that are run, for machine code to be made of them; always in the same order.
    pub fn programs(&mut self) -> Vec<Used<'_>> {
        let mut list = vec![self.equations.used(false)];
        if let Engine::Exact(exact) = &mut self.engine {
            list.push(exact.slopes.used(true));
        }
        list
    }

    /// Evaluations and factorisations so far.
    #[must_use]
    pub fn work(&self) -> (u64, u64) {
        (self.evaluations, self.factorisations)
    }

    fn load(&mut self, t: f64, state: &[f64], accelerations: &[f64], multipliers: &[f64]) {
        self.inputs[Layout::TIME] = t;
        for body in 0..self.layout.bodies {
            let (from, to) = (BODY_STATES * body, self.layout.body_slot(body, 0));
            self.inputs[to..to + BODY_STATES].copy_from_slice(&state[from..from + BODY_STATES]);
        }
        let slot = self.layout.acceleration_slot();
        self.inputs[slot..slot + accelerations.len()].copy_from_slice(accelerations);
        let slot = self.layout.multiplier_slot();
        for (row, value) in self.equations.rows.iter().zip(multipliers) {
            self.inputs[slot + row] = *value;
        }
    }
}

impl Exact {
    fn new(equations: &Equations, terms: &Terms<'_>, layout: &Layout, rows: &[usize]) -> Self {
        let velocities = layout.velocities();
        let mut graph = equations.graph.clone();
        let mut functions = residuals(&mut graph, terms, layout, rows);
        functions.truncate(velocities);
        let (mut nodes, mut entries) = (Vec::new(), Vec::new());
        for direction in 0..2 * velocities {
            let along = seeds(&mut graph, terms, layout, direction);
            for (function, slope) in derivatives(&mut graph, &functions, &along).into_iter().enumerate() {
                if !graph.is_zero(slope) {
                    nodes.push(slope);
                    entries.push((function, direction));
                }
            }
        }
        let unknowns = velocities + rows.len();
        Self {
            slopes: Evaluator::new(&graph, &nodes),
            entries,
            matrix: FullPivLu::new(unknowns, NO_PIVOT),
            scales: vec![1.0; unknowns],
            side: vec![0.0; unknowns],
            found: vec![0.0; unknowns],
        }
    }

    /// `shares`: of K and of C.
    fn factor(
        &mut self,
        inputs: &[f64],
        equations: &Constraints,
        mass: &[f64],
        shares: [f64; 2],
        sets: &Sets,
    ) -> Result<(), AnalysisError> {
        let slopes = self.slopes.run(inputs, sets)?;
        let (velocities, n) = (equations.structure.n, self.scales.len());
        self.scales.fill(0.0);
        for ((row, _), value) in equations.structure.mass.iter().zip(mass).filter(|((i, j), _)| i == j) {
            self.scales[*row] = 1.0 / value.sqrt();
        }
        for ((row, column), value) in equations.structure.jacobian.iter().zip(equations.jacobian()) {
            self.scales[velocities + row] += (value * self.scales[*column]).powi(2);
        }
        for scale in &mut self.scales[velocities..] {
            *scale = if *scale > 0.0 { 1.0 / scale.sqrt() } else { 1.0 };
        }
        let scales = &self.scales;
        let entries = self.matrix.entries_mut();
        entries.fill(0.0);
        let mut add = |row: usize, column: usize, value: f64| {
            entries[row + n * column] += value * scales[row] * scales[column];
        };
        for ((row, column), value) in equations.structure.mass.iter().zip(mass) {
            add(*row, *column, *value);
            if row != column {
                add(*column, *row, *value);
            }
        }
        for ((function, direction), slope) in self.entries.iter().zip(slopes) {
            add(*function, direction % velocities, -shares[direction / velocities] * slope);
        }
        for ((row, column), value) in equations.structure.jacobian.iter().zip(equations.jacobian()) {
            add(velocities + row, *column, *value);
            add(*column, velocities + row, *value);
        }
        self.matrix.factor()?;
        Ok(())
    }

    fn solve(
        &mut self,
        forces: &[f64],
        rows: &[f64],
        moves: &mut [f64],
        changes: &mut [f64],
    ) -> Result<(), AnalysisError> {
        for ((side, value), scale) in self.side.iter_mut().zip(forces.iter().chain(rows)).zip(&self.scales) {
            *side = value * scale;
        }
        self.matrix.solve(&self.side, &mut self.found)?;
        let found = self.found.iter().zip(&self.scales).map(|(value, scale)| value * scale);
        moves.iter_mut().chain(changes).zip(found).for_each(|(target, value)| *target = value);
        Ok(())
    }
}

/// The velocities of all bodies in a state; the accelerations in its rates.
pub fn velocities_of(state: &[f64], velocities: &mut [f64]) {
    for (body, own) in velocities.chunks_exact_mut(6).enumerate() {
        own.copy_from_slice(&state[BODY_STATES * body + 7..BODY_STATES * (body + 1)]);
    }
}

/// `state`: that of `before` with every body moved by (dr, theta'), r + dr and A exp(theta'~), and with other velocities.
pub fn place(before: &[f64], increment: &[f64], velocities: &[f64], state: &mut [f64]) {
    state.copy_from_slice(before);
    for (body, (d, own)) in increment.chunks_exact(6).zip(velocities.chunks_exact(6)).enumerate() {
        let y = &mut state[BODY_STATES * body..BODY_STATES * (body + 1)];
        for k in 0..3 {
            y[k] += d[k];
        }
        let angle = (d[3] * d[3] + d[4] * d[4] + d[5] * d[5]).sqrt();
        // p exp(theta' / 2) = cos(|theta'| / 2) p + sin(|theta'| / 2) / (|theta'| / 2) G^T theta' / 2.
        let half = 0.5 * angle;
        let (cos, share) = (half.cos(), if half > 0.0 { half.sin() / half } else { 1.0 });
        let turn = parameter_rates([y[3], y[4], y[5], y[6]], [d[3], d[4], d[5]]);
        for k in 0..4 {
            y[3 + k] = cos * y[3 + k] + share * turn[k];
        }
        normalise(&mut y[3..7]);
        y[7..13].copy_from_slice(own);
    }
}
