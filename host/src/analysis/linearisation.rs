//! [`Linearisation`]: exact derivatives of the rates of the working form with respect to its state.
//!
//! Accelerations a and multipliers lambda follow from M a = r1 with r1 = Q - Phi_q^T lambda, and 0 = r2 with
//! r2 = gamma - Phi_q a. M is constant in the working form. Along a direction of the state, with a and lambda held in r1
//! and r2,
//!
//! [M Phi_q^T; Phi_q 0] [da; dlambda] = [dr1; dr2]:
//!
//! the matrix of the equations of motion once more, so that its factorisation is used again. The derivatives on the right
//! are nodes of the graph. Directions are (dr, dpi', dv, domega') per body, then the element states, then time.

use super::formulation::AnalysisError;
use super::working::{BODY_STATES, parameter_rates};
use crate::plan::Layout;
use crate::program::{Equations, Graph, Node, Program, Seeds, Sets, Workspace, derivatives};

/// Directions per body.
const DIRECTIONS: usize = 12;
/// Directions times operations up to which derivatives are written down. Finding them takes about 50 ns each.
const MOST_WORK: usize = 20_000_000;

/// Solves the equations of motion for a right side, with the factorisation in force: (loads, rows, accelerations,
/// multipliers).
pub(super) type SolveMotion<'a> = dyn FnMut(&[f64], &[f64], &mut [f64], &mut [f64]) -> Result<(), AnalysisError> + 'a;

/// See the module documentation.
pub(super) struct Linearisation {
    layout: Layout,
    /// Rows in use.
    rows: usize,
    program: Program,
    workspace: Workspace,
    outputs: Vec<f64>,
    /// What each output is a derivative of, and along which direction: outputs that are always zero are left out.
    entries: Vec<(usize, usize)>,
    /// Derivatives along all directions, column by column: accelerations, multipliers, state rates, power.
    columns: Vec<f64>,
    right: Vec<f64>,
    multipliers: Vec<f64>,
    /// Derivatives of the rates with respect to time, and the time they belong to.
    slopes: Vec<f64>,
    slopes_at: f64,
}

impl Linearisation {
    /// Directions of a model.
    pub(super) fn directions(layout: &Layout) -> usize {
        DIRECTIONS * layout.bodies + layout.states
    }

    /// Operations to be looked at for the derivatives, one by one and in each direction.
    pub(super) fn work(equations: &Equations, layout: &Layout) -> usize {
        Self::directions(layout) * equations.graph.len()
    }

    /// Whether the derivatives are known (not with opaque elements, nor with forces that depend on accelerations or
    /// reactions), and not too many.
    pub(super) fn is_possible(equations: &Equations, layout: &Layout) -> bool {
        equations.graph.calls.is_empty()
            && equations.coupling.is_empty()
            && !equations.rates_need_solution(layout)
            && Self::work(equations, layout) <= MOST_WORK
    }

    /// Writes down the derivatives for the rows in use, where [`Linearisation::is_possible`].
    pub(super) fn new(equations: &Equations, layout: &Layout, rows: &[usize]) -> Self {
        let directions = Self::directions(layout);
        let mut graph = equations.graph.clone();
        let residuals = residuals(&mut graph, equations, layout, rows);
        let (mut nodes, mut entries) = (Vec::new(), Vec::new());
        for direction in 0..=directions {
            let seeds = seeds(&mut graph, equations, layout, direction);
            for (function, slope) in derivatives(&mut graph, &residuals, &seeds).into_iter().enumerate() {
                if !graph.is_zero(slope) {
                    nodes.push(slope);
                    entries.push((function, direction));
                }
            }
        }
        let program = Program::compile(&graph, &nodes);
        Self {
            rows: rows.len(),
            workspace: program.workspace(),
            outputs: vec![0.0; nodes.len()],
            program,
            entries,
            columns: vec![0.0; residuals.len() * (directions + 1)],
            right: vec![0.0; layout.velocities() + rows.len()],
            multipliers: vec![0.0; rows.len()],
            slopes: vec![0.0; BODY_STATES * layout.bodies + layout.states + 1],
            slopes_at: f64::NAN,
            layout: layout.clone(),
        }
    }

    /// Fills `matrix` (column by column) with the derivatives of the rates at `state`. `inputs` holds the state and its
    /// accelerations and multipliers, `times` Phi_t of the rows in use; `solve` uses the factorisation at `state`.
    pub(super) fn fill(
        &mut self,
        inputs: &[f64],
        sets: &Sets,
        state: &[f64],
        times: &[f64],
        solve: &mut SolveMotion<'_>,
        matrix: &mut [f64],
    ) -> Result<(), AnalysisError> {
        self.program
            .run(inputs, sets, &mut self.workspace, &mut self.outputs)
            .map_err(|(set, fault)| AnalysisError::Element { set, fault })?;
        self.columns.fill(0.0);
        let height = self.layout.velocities() + self.rows + self.layout.states + 1;
        for ((function, direction), value) in self.entries.iter().zip(&self.outputs) {
            self.columns[height * direction + function] = *value;
        }
        let (velocities, solved) = (self.layout.velocities(), self.layout.velocities() + self.rows);
        for column in self.columns.chunks_exact_mut(height) {
            if column[..solved].iter().all(|value| *value == 0.0) {
                continue;
            }
            self.right.copy_from_slice(&column[..solved]);
            let (loads, gammas) = self.right.split_at(velocities);
            solve(loads, gammas, &mut column[..velocities], &mut self.multipliers)?;
            // The power of constraints that depend on time: lambda . Phi_t.
            let driven: f64 = times.iter().zip(&self.multipliers).map(|(time, change)| time * change).sum();
            column[height - 1] += driven;
        }
        self.assemble(state, height, matrix);
        let mut slopes = std::mem::take(&mut self.slopes);
        slopes.fill(0.0);
        self.add(&self.columns[height * Self::directions(&self.layout)..], 1.0, &mut slopes);
        (self.slopes, self.slopes_at) = (slopes, inputs[Layout::TIME]);
        Ok(())
    }

    /// The derivatives of the rates with respect to time, where [`Linearisation::fill`] was last, if that was at time `t`.
    pub(super) fn slopes(&self, t: f64) -> Option<&[f64]> {
        (self.slopes_at == t).then_some(&self.slopes)
    }

    /// From directions to the entries of the state.
    fn assemble(&self, state: &[f64], height: usize, matrix: &mut [f64]) {
        let n = BODY_STATES * self.layout.bodies + self.layout.states + 1;
        matrix.fill(0.0);
        for body in 0..self.layout.bodies {
            let at = BODY_STATES * body;
            let y = &state[at..at + BODY_STATES];
            let p = [y[3], y[4], y[5], y[6]];
            let w = [y[10], y[11], y[12]];
            let direction = |k: usize| &self.columns[height * (DIRECTIONS * body + k)..][..height];
            for k in 0..3 {
                self.add(direction(k), 1.0, &mut matrix[n * (at + k)..][..n]);
                let axis = std::array::from_fn(|i| f64::from(u8::from(i == k)));
                // p' = G^T omega' / 2, dpi' = 2 G dp.
                let turn = parameter_rates(p, axis);
                for (e, factor) in turn.iter().enumerate() {
                    self.add(direction(3 + k), 4.0 * factor, &mut matrix[n * (at + 3 + e)..][..n]);
                }
                let column = &mut matrix[n * (at + 7 + k)..][..n];
                self.add(direction(6 + k), 1.0, column);
                column[at + k] = 1.0;
                let column = &mut matrix[n * (at + 10 + k)..][..n];
                self.add(direction(9 + k), 1.0, column);
                column[at + 3..at + 7].copy_from_slice(&turn);
            }
            for e in 0..4 {
                let axis = std::array::from_fn(|i| f64::from(u8::from(i == e)));
                matrix[n * (at + 3 + e)..][..n][at + 3..at + 7].copy_from_slice(&parameter_rates(axis, w));
            }
        }
        for k in 0..self.layout.states {
            let column = &self.columns[height * (DIRECTIONS * self.layout.bodies + k)..][..height];
            self.add(column, 1.0, &mut matrix[n * (BODY_STATES * self.layout.bodies + k)..][..n]);
        }
    }

    /// Adds a direction's derivatives to a column of the matrix.
    fn add(&self, direction: &[f64], factor: f64, column: &mut [f64]) {
        let (accelerations, others) = direction.split_at(self.layout.velocities());
        for (body, part) in accelerations.chunks_exact(6).enumerate() {
            let at = BODY_STATES * body + 7;
            column[at..at + 6].iter_mut().zip(part).for_each(|(entry, value)| *entry += factor * value);
        }
        let rates = &others[self.rows..];
        let from = BODY_STATES * self.layout.bodies;
        column[from..].iter_mut().zip(rates).for_each(|(entry, value)| *entry += factor * value);
    }
}

/// r1, r2 of the rows in use, state rates, power with that of the constraints.
fn residuals(g: &mut Graph, equations: &Equations, layout: &Layout, rows: &[usize]) -> Vec<Node> {
    let mut functions = equations.loads.clone();
    let (mut gammas, mut power) = (Vec::with_capacity(rows.len()), equations.power);
    for index in rows {
        let row = &equations.rows[*index];
        let multiplier = g.input(layout.multiplier_slot() + index);
        let mut gamma = row.gamma;
        for (column, slope) in &row.jacobian {
            let reaction = g.mul(*slope, multiplier);
            functions[*column] = g.sub(functions[*column], reaction);
            let acceleration = g.input(layout.acceleration_slot() + column);
            let part = g.mul(*slope, acceleration);
            gamma = g.sub(gamma, part);
        }
        gammas.push(gamma);
        let driven = g.mul(row.time, multiplier);
        power = g.add(power, driven);
    }
    functions.extend(gammas);
    functions.extend(&equations.state_rates);
    functions.push(power);
    functions
}

/// What changes along a direction.
fn seeds(g: &mut Graph, equations: &Equations, layout: &Layout, direction: usize) -> Seeds {
    let one = g.constant(1.0);
    let body = direction / DIRECTIONS;
    if direction == Linearisation::directions(layout) {
        let time = g.input(Layout::TIME);
        return Seeds::from_iter([(time, one)]);
    }
    if body >= layout.bodies {
        let state = g.input(layout.state_slot() + direction - DIRECTIONS * layout.bodies);
        return Seeds::from_iter([(state, one)]);
    }
    let nodes = &equations.bodies[body];
    match direction % DIRECTIONS {
        k @ 0..3 => Seeds::from_iter([(nodes.r[k], one)]),
        k @ 3..6 => {
            // dA = A e_k~: two columns change places, one with its sign turned.
            let (next, last) = ((k - 2) % 3, (k - 1) % 3);
            let zero = g.constant(0.0);
            let mut seeds = Seeds::default();
            for row in &nodes.a {
                seeds.insert(row[next], row[last]);
                seeds.insert(row[last], g.neg(row[next]));
                seeds.insert(row[k - 3], zero);
            }
            seeds
        }
        k @ 6..9 => Seeds::from_iter([(nodes.v[k - 6], one)]),
        k => Seeds::from_iter([(nodes.w[k - 9], one)]),
    }
}
