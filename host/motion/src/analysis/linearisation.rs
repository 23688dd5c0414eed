//! [`Linearisation`]: exact derivatives of the rates of a formulation with respect to its state.
//!
//! Directions are those of the velocities for positions (a rotation turns about the axes of what turns), the velocities
//! themselves, then the element states. Derivatives along them come from the recorded operations ([`Tangents`]).
//!
//! In coordinates of joints accelerations are written down, and are differentiated like the rest. In coordinates of bodies
//! accelerations a and multipliers lambda follow from 0 = r1 with r1 = Q - M a - Phi_q^T lambda, and 0 = r2 with
//! r2 = gamma - Phi_q a. Along a direction of the state, with a and lambda held in r1 and r2,
//!
//! [M Phi_q^T; Phi_q 0] [da; dlambda] = [dr1; dr2]:
//!
//! the matrix of the equations of motion once more, so that its factorisation is used again.

use super::formulation::AnalysisError;
use super::motion::parameter_rates;
use crate::plan::{Coordinates, Layout};
use crate::program::{Equations, Graph, JointEquations, Node, Row, Seeds, Sets, Tangents, Used};

/// Time to prepare the derivatives, ns per operation of the equations. Measured.
pub(super) const PREPARATION: f64 = 300.0;

/// Solves the equations of motion for a right side, with the factorisation in force: (loads, rows, accelerations,
/// multipliers).
pub(super) type SolveMotion<'a> = dyn FnMut(&[f64], &[f64], &mut [f64], &mut [f64]) -> Result<(), AnalysisError> + 'a;

/// The rotation matrix of something, as nodes.
type Matrix = [[Node; 3]; 3];

/// See the module documentation.
pub(super) struct Linearisation {
    coordinates: Coordinates,
    /// Element states.
    states: usize,
    /// Rows whose residuals follow those of the velocities, where these are to be solved for.
    rows: Option<usize>,
    tangents: Tangents,
    /// Derivatives along all directions, column by column: accelerations, multipliers, state rates, power.
    columns: Vec<f64>,
    right: Vec<f64>,
    multipliers: Vec<f64>,
}

impl Linearisation {
    /// Of accelerations, rates of states and power as they are written in joint coordinates: these nodes of a graph.
    pub(super) fn of_solution(
        joint: &JointEquations,
        layout: &Layout,
        (mut graph, functions): (Graph, Vec<Node>),
    ) -> Self {
        Self::new(&mut graph, &functions, (&joint.coordinates, &joint.rotations), layout, None)
    }

    /// Of the residuals of the equations of motion in coordinates of bodies, with the rows in use.
    pub(super) fn of_residuals(equations: &Equations, layout: &Layout, rows: &[usize]) -> Self {
        let mut graph = equations.graph.clone();
        let coordinates = Coordinates::of_bodies(layout);
        let functions = residuals(&mut graph, equations, &coordinates, layout, rows);
        let rotations: Vec<Matrix> = equations.bodies.iter().map(|body| body.a).collect();
        Self::new(&mut graph, &functions, (&coordinates, &rotations), layout, Some(rows.len()))
    }

    fn new(
        graph: &mut Graph,
        functions: &[Node],
        (coordinates, rotations): (&Coordinates, &[Matrix]),
        layout: &Layout,
        rows: Option<usize>,
    ) -> Self {
        let directions: Vec<Seeds> = (0..coordinates.directions(layout))
            .map(|direction| seeds(graph, coordinates, rotations, layout, direction))
            .collect();
        Self {
            rows,
            states: layout.states,
            columns: vec![0.0; functions.len() * directions.len()],
            tangents: Tangents::new(graph, functions, &directions),
            right: vec![0.0; coordinates.columns + rows.unwrap_or(0)],
            multipliers: vec![0.0; rows.unwrap_or(0)],
            coordinates: coordinates.clone(),
        }
    }

    /// The program of partial derivatives, with how often it was run.
    pub(super) fn used(&mut self) -> Used<'_> {
        self.tangents.used()
    }

    /// Fills `matrix` (column by column) with the derivatives of the rates at `state`. `inputs` holds the state; where residuals
    /// are solved for also its accelerations and multipliers, `times` Phi_t of the rows in use, and `solve` uses the
    /// factorisation at `state`.
    pub(super) fn fill(
        &mut self,
        inputs: &[f64],
        sets: &Sets,
        state: &[f64],
        times: &[f64],
        solve: &mut SolveMotion<'_>,
        matrix: &mut [f64],
    ) -> Result<(), AnalysisError> {
        let height = self.height();
        self.columns.fill(0.0);
        let columns = &mut self.columns;
        self.tangents
            .run(inputs, sets, |direction, function, value| columns[height * direction + function] = value)
            .map_err(|(set, fault)| AnalysisError::Element { set, fault })?;
        if let Some(rows) = self.rows {
            let velocities = self.coordinates.columns;
            let solved = velocities + rows;
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
        }
        self.assemble(state, height, matrix);
        Ok(())
    }

    /// Functions along each direction.
    fn height(&self) -> usize {
        self.coordinates.columns + self.rows.unwrap_or(0) + self.states + 1
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
        let rates = &direction[self.coordinates.columns + self.rows.unwrap_or(0)..];
        let from = self.coordinates.motion;
        column[from..].iter_mut().zip(rates).for_each(|(entry, value)| *entry += factor * value);
    }
}

/// r1 without M a, which does not depend on the state; r2 of the rows in use, state rates, power with that of the constraints.
fn residuals(
    g: &mut Graph,
    equations: &Equations,
    coordinates: &Coordinates,
    layout: &Layout,
    rows: &[usize],
) -> Vec<Node> {
    let mut functions = equations.loads.clone();
    let (mut gammas, mut power) = (Vec::with_capacity(rows.len()), equations.power);
    for index in rows {
        let row: &Row = &equations.rows[*index];
        let multiplier = g.input(layout.multiplier_slot() + index);
        let mut gamma = row.gamma;
        for (column, slope) in &row.jacobian {
            let reaction = g.mul(*slope, multiplier);
            functions[*column] = g.sub(functions[*column], reaction);
            let acceleration = g.input(coordinates.acceleration_slot + column);
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
pub(super) fn seeds(
    g: &mut Graph,
    coordinates: &Coordinates,
    rotations: &[Matrix],
    layout: &Layout,
    direction: usize,
) -> Seeds {
    let one = g.constant(1.0);
    let velocities = coordinates.columns;
    if direction >= 2 * velocities {
        let state = g.input(layout.state_slot() + direction - 2 * velocities);
        return Seeds::from_iter([(state, one)]);
    }
    if direction >= velocities {
        let velocity = g.input(coordinates.velocity_slots[direction - velocities]);
        return Seeds::from_iter([(velocity, one)]);
    }
    // Lines and rotations are in the order of their columns.
    let line = coordinates.lines.binary_search_by_key(&direction, |line| line.column);
    if let Ok(line) = line {
        let position = g.input(coordinates.slot_of(coordinates.lines[line].position));
        return Seeds::from_iter([(position, one)]);
    }
    // dA = A e_k~: two columns change places, one with its sign turned.
    let before = coordinates.rotations.partition_point(|rotation| rotation.column <= direction);
    let (rotation, a) = (&coordinates.rotations[before - 1], &rotations[before - 1]);
    let k = direction - rotation.column;
    let (next, last) = ((k + 1) % 3, (k + 2) % 3);
    let zero = g.constant(0.0);
    let mut seeds = Seeds::default();
    for row in a {
        seeds.insert(row[next], row[last]);
        seeds.insert(row[last], g.neg(row[next]));
        seeds.insert(row[k], zero);
    }
    seeds
}
