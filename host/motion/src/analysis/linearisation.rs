//! [`Linearisation`]: exact derivatives of the rates of a formulation with respect to its state.
//!
//! Accelerations a and multipliers lambda follow from 0 = r1 with r1 = Q - M a - Phi_q^T lambda, and 0 = r2 with
//! r2 = gamma - Phi_q a. Along a direction of the state, with a and lambda held in r1 and r2,
//!
//! [M Phi_q^T; Phi_q 0] [da; dlambda] = [dr1; dr2]:
//!
//! the matrix of the equations of motion once more, so that its factorisation is used again. The derivatives on the right
//! are nodes of the graph. Directions are those of the velocities for positions (a rotation turns about the axes of what
//! turns), the velocities themselves, then the element states.

use super::formulation::AnalysisError;
use super::motion::parameter_rates;
use crate::plan::{Coordinates, Layout};
use crate::program::{Equations, Graph, JointEquations, Node, Program, Row, Seeds, Sets, Used, Workspace, derivatives};

/// Directions times operations up to which derivatives are written down. Finding them takes about 50 ns each.
const MOST_WORK: usize = 20_000_000;

/// Solves the equations of motion for a right side, with the factorisation in force: (loads, rows, accelerations,
/// multipliers).
pub(super) type SolveMotion<'a> = dyn FnMut(&[f64], &[f64], &mut [f64], &mut [f64]) -> Result<(), AnalysisError> + 'a;

/// The rotation matrix of something, as nodes.
type Matrix = [[Node; 3]; 3];

/// Equations of motion in some coordinates.
pub(super) struct Terms<'a> {
    graph: &'a Graph,
    coordinates: Coordinates,
    /// Rotation matrices of the coordinates' rotations.
    rotations: Vec<Matrix>,
    /// Lower triangle of the mass matrix, if it is not constant.
    mass: &'a [(usize, usize, Node)],
    rows: &'a [Row],
    loads: &'a [Node],
    state_rates: &'a [Node],
    power: Node,
}

impl<'a> Terms<'a> {
    /// In the coordinates of bodies; `None` where derivatives are not known (opaque elements, forces that depend on
    /// accelerations or reactions), or too many.
    pub(super) fn of_bodies(equations: &'a Equations, layout: &Layout) -> Option<Self> {
        let unknown = !equations.graph.calls.is_empty() || equations.needs_solution();
        let coordinates = Coordinates::of_bodies(layout);
        let possible = !unknown && work(&coordinates, equations.graph.len(), layout) <= MOST_WORK;
        possible.then(|| Self {
            graph: &equations.graph,
            coordinates,
            rotations: equations.bodies.iter().map(|body| body.a).collect(),
            mass: &[],
            rows: &equations.rows,
            loads: &equations.loads,
            state_rates: &equations.state_rates,
            power: equations.power,
        })
    }

    /// In the coordinates of joints; `None` where derivatives are not known (opaque elements, forces that depend on accelerations or
    /// reactions), or too many.
    pub(super) fn of_joints(joint: &'a JointEquations, layout: &Layout) -> Option<Self> {
        let known = joint.graph.calls.is_empty() && joint.dependence.is_none();
        let possible = known && work(&joint.coordinates, joint.size, layout) <= MOST_WORK;
        possible.then(|| Self {
            graph: &joint.graph,
            coordinates: joint.coordinates.clone(),
            rotations: joint.rotations.clone(),
            mass: &joint.mass,
            rows: &joint.rows,
            loads: &joint.loads,
            state_rates: &joint.state_rates,
            power: joint.power,
        })
    }
}

/// Operations to be looked at for the derivatives, one by one and in each direction.
pub(super) fn work(coordinates: &Coordinates, operations: usize, layout: &Layout) -> usize {
    coordinates.directions(layout) * operations
}

/// See the module documentation.
pub(super) struct Linearisation {
    coordinates: Coordinates,
    /// Element states.
    states: usize,
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
}

impl Linearisation {
    /// Writes down the derivatives for the rows in use.
    pub(super) fn new(terms: &Terms<'_>, layout: &Layout, rows: &[usize]) -> Self {
        let directions = terms.coordinates.directions(layout);
        let mut graph = terms.graph.clone();
        let residuals = residuals(&mut graph, terms, layout, rows);
        let (mut nodes, mut entries) = (Vec::new(), Vec::new());
        for direction in 0..directions {
            let seeds = seeds(&mut graph, terms, layout, direction);
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
            states: layout.states,
            workspace: program.workspace(),
            outputs: vec![0.0; nodes.len()],
            program,
            entries,
            columns: vec![0.0; residuals.len() * directions],
            right: vec![0.0; terms.coordinates.columns + rows.len()],
            multipliers: vec![0.0; rows.len()],
            coordinates: terms.coordinates.clone(),
        }
    }

    /// The program, with how often it was run.
    pub(super) fn used(&mut self) -> Used<'_> {
        Used { runs: self.workspace.runs(), program: &mut self.program, spare: true }
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
        let velocities = self.coordinates.columns;
        let solved = velocities + self.rows;
        let height = solved + self.states + 1;
        for ((function, direction), value) in self.entries.iter().zip(&self.outputs) {
            self.columns[height * direction + function] = *value;
        }
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
        Ok(())
    }

    /// From directions to the entries of the state.
    fn assemble(&self, state: &[f64], height: usize, matrix: &mut [f64]) {
        let motion = self.coordinates.motion;
        let n = motion + self.states + 1;
        let velocities = self.coordinates.columns;
        let direction = |k: usize| &self.columns[height * k..][..height];
        matrix.fill(0.0);
        for line in &self.coordinates.lines {
            self.add(direction(line.column), 1.0, &mut matrix[n * line.position..][..n]);
            let column = &mut matrix[n * line.velocity..][..n];
            self.add(direction(velocities + line.column), 1.0, column);
            column[line.position] = 1.0;
        }
        for rotation in &self.coordinates.rotations {
            let (at, spin_at) = (rotation.position, rotation.velocity);
            let p = [state[at], state[at + 1], state[at + 2], state[at + 3]];
            let w = [state[spin_at], state[spin_at + 1], state[spin_at + 2]];
            for k in 0..3 {
                let axis = std::array::from_fn(|i| f64::from(u8::from(i == k)));
                // p' = G^T omega' / 2, dpi' = 2 G dp.
                let turn = parameter_rates(p, axis);
                for (e, factor) in turn.iter().enumerate() {
                    self.add(direction(rotation.column + k), 4.0 * factor, &mut matrix[n * (at + e)..][..n]);
                }
                let column = &mut matrix[n * (spin_at + k)..][..n];
                self.add(direction(velocities + rotation.column + k), 1.0, column);
                column[at..at + 4].copy_from_slice(&turn);
            }
            for e in 0..4 {
                let axis = std::array::from_fn(|i| f64::from(u8::from(i == e)));
                matrix[n * (at + e)..][..n][at..at + 4].copy_from_slice(&parameter_rates(axis, w));
            }
        }
        for k in 0..self.states {
            self.add(direction(2 * velocities + k), 1.0, &mut matrix[n * (motion + k)..][..n]);
        }
    }

    /// Adds a direction's derivatives to a column of the matrix.
    fn add(&self, direction: &[f64], factor: f64, column: &mut [f64]) {
        for line in &self.coordinates.lines {
            column[line.velocity] += factor * direction[line.column];
        }
        for rotation in &self.coordinates.rotations {
            for k in 0..3 {
                column[rotation.velocity + k] += factor * direction[rotation.column + k];
            }
        }
        let rates = &direction[self.coordinates.columns + self.rows..];
        let from = self.coordinates.motion;
        column[from..].iter_mut().zip(rates).for_each(|(entry, value)| *entry += factor * value);
    }
}

/// r1, r2 of the rows in use, state rates, power with that of the constraints.
fn residuals(g: &mut Graph, terms: &Terms<'_>, layout: &Layout, rows: &[usize]) -> Vec<Node> {
    let mut functions = terms.loads.to_vec();
    let (mut gammas, mut power) = (Vec::with_capacity(rows.len()), terms.power);
    let acceleration_slot = terms.coordinates.acceleration_slot;
    for index in rows {
        let row = &terms.rows[*index];
        let multiplier = g.input(layout.multiplier_slot() + index);
        let mut gamma = row.gamma;
        for (column, slope) in &row.jacobian {
            let reaction = g.mul(*slope, multiplier);
            functions[*column] = g.sub(functions[*column], reaction);
            let acceleration = g.input(acceleration_slot + column);
            let part = g.mul(*slope, acceleration);
            gamma = g.sub(gamma, part);
        }
        gammas.push(gamma);
        let driven = g.mul(row.time, multiplier);
        power = g.add(power, driven);
    }
    for (row, column, entry) in terms.mass {
        let mut carry = |function: usize, acceleration: usize| {
            let acceleration = g.input(acceleration_slot + acceleration);
            let part = g.mul(*entry, acceleration);
            functions[function] = g.sub(functions[function], part);
        };
        carry(*row, *column);
        if row != column {
            carry(*column, *row);
        }
    }
    functions.extend(gammas);
    functions.extend(terms.state_rates);
    functions.push(power);
    functions
}

/// What changes along a direction.
fn seeds(g: &mut Graph, terms: &Terms<'_>, layout: &Layout, direction: usize) -> Seeds {
    let one = g.constant(1.0);
    let coordinates = &terms.coordinates;
    let velocities = coordinates.columns;
    if direction >= 2 * velocities {
        let state = g.input(layout.state_slot() + direction - 2 * velocities);
        return Seeds::from_iter([(state, one)]);
    }
    if direction >= velocities {
        let velocity = g.input(coordinates.velocity_slots[direction - velocities]);
        return Seeds::from_iter([(velocity, one)]);
    }
    if let Some(line) = coordinates.lines.iter().find(|line| line.column == direction) {
        let position = g.input(coordinates.slot_of(line.position));
        return Seeds::from_iter([(position, one)]);
    }
    // dA = A e_k~: two columns change places, one with its sign turned.
    let turning = coordinates.rotations.iter().zip(&terms.rotations);
    let mut seeds = Seeds::default();
    for (rotation, a) in turning {
        let Some(k) = direction.checked_sub(rotation.column).filter(|k| *k < 3) else { continue };
        let (next, last) = ((k + 1) % 3, (k + 2) % 3);
        let zero = g.constant(0.0);
        for row in a {
            seeds.insert(row[next], row[last]);
            seeds.insert(row[last], g.neg(row[next]));
            seeds.insert(row[k], zero);
        }
    }
    seeds
}
