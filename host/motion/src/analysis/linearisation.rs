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
//!
//! Where loads depend on some of the accelerations and multipliers, z = F(x, z) (see [`Coupling`](super::coupling::Coupling)), each of
//! these is a direction as well, along which the loads alone change. With the derivatives of all results and of F along the directions
//! of x and z, what z follows with is (I - F_z) dz = F_x dx.

use std::ops::Range;

use super::closing::{Closing, solved_at, units};
use super::formulation::{AnalysisError, Entries};
use super::motion::parameter_rates;
use crate::plan::{Coordinates, Layout};
use crate::program::{Equations, Graph, JointEquations, Node, Row, Seeds, Sets, Tangents, Used, turned_parameters};

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
    rows: Option<Vec<usize>>,
    /// The number of the power among the functions. Behind it is F, or where residuals are solved for, loads and power without reactions.
    power: usize,
    /// Inputs that are z. Their directions are behind those of the state.
    coupled: Vec<usize>,
    closing: Closing,
    /// Accelerations and multipliers among the inputs.
    solved: [Range<usize>; 2],
    tangents: Tangents,
    /// Derivatives along each direction, those that are zero left out: of accelerations, multipliers, state rates, power by number.
    along: Vec<Vec<Slope>>,
    /// By function: the entry of the state whose rate it is.
    row_of: Vec<usize>,
    /// A column of the matrix, zero between uses, and its entries that were touched.
    column: Vec<f64>,
    touched: Vec<usize>,
    right: Vec<f64>,
    accelerations: Vec<f64>,
    multipliers: Vec<f64>,
}

/// A function's number, and its derivative.
type Slope = (u32, f64);

impl Linearisation {
    /// Of accelerations, rates of states and power as they are written in joint coordinates: these nodes of a graph.
    pub(super) fn of_solution(
        joint: &JointEquations,
        layout: &Layout,
        (mut graph, functions): (Graph, Vec<Node>),
    ) -> Self {
        let coupled = joint.dependence.as_ref().map_or_else(Vec::new, |found| found.slots.clone());
        Self::new(&mut graph, &functions, (&joint.coordinates, &joint.rotations), layout, (None, coupled))
    }

    /// Of the residuals of the equations of motion in coordinates of bodies, with the rows in use.
    pub(super) fn of_residuals(equations: &Equations, layout: &Layout, rows: &[usize]) -> Self {
        let mut graph = equations.graph.clone();
        let coordinates = Coordinates::of_bodies(layout);
        let mut functions = residuals(&mut graph, equations, &coordinates, layout, rows);
        let coupled = equations.solved_for();
        if !coupled.is_empty() {
            functions.extend(&equations.loads);
            functions.push(equations.power);
        }
        let rotations: Vec<Matrix> = equations.bodies.iter().map(|body| body.a).collect();
        Self::new(&mut graph, &functions, (&coordinates, &rotations), layout, (Some(rows.to_vec()), coupled))
    }

    fn new(
        graph: &mut Graph,
        functions: &[Node],
        (coordinates, rotations): (&Coordinates, &[Matrix]),
        layout: &Layout,
        (rows, coupled): (Option<Vec<usize>>, Vec<usize>),
    ) -> Self {
        let mut directions: Vec<Seeds> = (0..coordinates.directions(layout))
            .map(|direction| seeds(graph, coordinates, rotations, layout, direction))
            .collect();
        let one = graph.constant(1.0);
        directions.extend(coupled.iter().map(|slot| Seeds::from_iter([(graph.input(*slot), one)])));
        let rows_in_use = rows.as_ref().map_or(0, Vec::len);
        let solved = coordinates.columns + rows_in_use;
        let mut row_of: Vec<usize> =
            (0..functions.len()).map(|k| (coordinates.motion + k).saturating_sub(solved)).collect();
        coordinates.lines.iter().for_each(|line| row_of[line.column] = line.velocity);
        for rotation in &coordinates.rotations {
            (0..3).for_each(|k| row_of[rotation.column + k] = rotation.velocity + k);
        }
        Self {
            rows,
            states: layout.states,
            power: solved + layout.states,
            closing: Closing::new(coupled.len()),
            coupled,
            solved: layout.solved(),
            along: vec![Vec::new(); directions.len()],
            row_of,
            column: vec![0.0; coordinates.motion + layout.states + 1],
            touched: Vec::new(),
            tangents: Tangents::new(graph, functions, &directions),
            right: vec![0.0; solved],
            accelerations: vec![0.0; coordinates.columns],
            multipliers: vec![0.0; rows_in_use],
            coordinates: coordinates.clone(),
        }
    }

    /// The program of partial derivatives, with how often it was run.
    pub(super) fn used(&mut self) -> Used<'_> {
        self.tangents.used()
    }

    /// Gives the derivatives of the rates at `state`: row, column, value of all entries that are not zero, column after column; `false`
    /// where there are none. `inputs` holds the state, with the accelerations and multipliers that loads depend on; where residuals are
    /// solved for with all of them, `times` Phi_t of the rows in use, and `solve` uses the factorisation at `state`.
    pub(super) fn fill(
        &mut self,
        inputs: &[f64],
        sets: &Sets,
        state: &[f64],
        times: &[f64],
        solve: &mut SolveMotion<'_>,
        found: Entries<'_>,
    ) -> Result<bool, AnalysisError> {
        self.along.iter_mut().for_each(Vec::clear);
        let along = &mut self.along;
        self.tangents
            .run(inputs, sets, |direction, function, value| along[direction].push((function as u32, value)))
            .map_err(|(set, fault)| AnalysisError::Element { set, fault })?;
        self.solve(times, solve)?;
        if !self.coupled.is_empty() && !self.close(inputs)? {
            return Ok(false);
        }
        self.assemble(state, found);
        Ok(true)
    }

    /// Residuals along each direction, where there are any, become accelerations; so do those along z, where loads change alone. F is
    /// behind the power then.
    fn solve(&mut self, times: &[f64], solve: &mut SolveMotion<'_>) -> Result<(), AnalysisError> {
        let Some(rows) = &self.rows else { return Ok(()) };
        let (columns, power) = (self.coordinates.columns, self.power);
        let own = self.along.len() - self.coupled.len();
        let mut solved: Vec<Slope> = Vec::new();
        for (direction, along) in self.along.iter_mut().enumerate() {
            let (first, count, power_at) = if direction < own {
                (0, columns + rows.len(), power)
            } else {
                (power + 1, columns, power + 1 + columns)
            };
            let residual = |function: u32| (function as usize).checked_sub(first).filter(|number| *number < count);
            let is_loaded = along.iter().any(|(function, value)| residual(*function).is_some() && *value != 0.0);
            if is_loaded {
                self.right.fill(0.0);
            }
            let mut work = 0.0;
            solved.clear();
            for (function, value) in along.iter() {
                let number = *function as usize;
                if let Some(place) = residual(*function) {
                    self.right[place] = *value;
                } else if (power - self.states..power).contains(&number) {
                    solved.push((*function, *value));
                } else if number == power_at {
                    work = *value;
                }
            }
            if is_loaded {
                let (loads, gammas) = self.right.split_at(columns);
                solve(loads, gammas, &mut self.accelerations, &mut self.multipliers)?;
                let accelerations = self.accelerations.iter().enumerate().map(|(k, value)| (k as u32, *value));
                solved.extend(accelerations.filter(|(_, value)| *value != 0.0));
                // The power of constraints that depend on time: lambda . Phi_t.
                work += times.iter().zip(&self.multipliers).map(|(time, change)| time * change).sum::<f64>();
                for (slot, function) in self.coupled.iter().zip(power as u32 + 1..) {
                    let found = (&rows[..], &self.accelerations[..], &self.multipliers[..]);
                    solved.push((function, solved_at(*slot, &self.solved, found)));
                }
            }
            solved.push((power as u32, work));
            std::mem::swap(along, &mut solved);
        }
        Ok(())
    }

    /// What z follows with, into the derivatives along the directions of the state; `false` where it is not determined.
    fn close(&mut self, inputs: &[f64]) -> Result<bool, AnalysisError> {
        let n = self.coupled.len();
        let own = self.along.len() - n;
        let (along, of_coupled) = self.along.split_at_mut(own);
        let place = |function: u32| (function as usize).checked_sub(self.power + 1);
        let slopes = self.closing.slopes_mut();
        slopes.fill(0.0);
        for (column, along) in slopes.chunks_exact_mut(n).zip(&*of_coupled) {
            for (k, value) in along.iter().filter_map(|(function, value)| Some((place(*function)?, value))) {
                column[k] = *value;
            }
        }
        if !self.closing.factor(units(&self.coupled, &self.solved, inputs))? || !self.closing.is_regular() {
            return Ok(false);
        }
        let mut changes = vec![0.0; n];
        for along in along {
            changes.fill(0.0);
            along.retain(|(function, value)| {
                let place = place(*function);
                place.into_iter().for_each(|k| changes[k] = *value);
                place.is_none()
            });
            if changes.iter().all(|value| *value == 0.0) {
                continue;
            }
            self.closing.solve(&mut changes)?;
            for (change, of_coupled) in changes.iter().zip(&*of_coupled).filter(|(change, _)| **change != 0.0) {
                let own = of_coupled.iter().filter(|(function, _)| place(*function).is_none());
                along.extend(own.map(|(function, value)| (*function, change * value)));
            }
        }
        Ok(true)
    }

    /// From directions to the entries of the state.
    fn assemble(&mut self, state: &[f64], found: Entries<'_>) {
        let motion = self.coordinates.motion;
        let velocities = self.coordinates.columns;
        for number in 0..self.coordinates.lines.len() {
            let line = self.coordinates.lines[number];
            self.column(line.position, &[(line.column, 1.0)], found);
            found(line.position, line.velocity, 1.0);
            self.column(line.velocity, &[(velocities + line.column, 1.0)], found);
        }
        for number in 0..self.coordinates.rotations.len() {
            let rotation = self.coordinates.rotations[number];
            let (at, spin_at) = (rotation.position, rotation.velocity);
            let p = [state[at], state[at + 1], state[at + 2], state[at + 3]];
            let w = [state[spin_at], state[spin_at + 1], state[spin_at + 2]];
            let unit = |k: usize| std::array::from_fn(|i| f64::from(u8::from(i == k)));
            // p' = G^T omega' / 2, dpi' = 2 G dp.
            let turns: [[f64; 4]; 3] = std::array::from_fn(|k| parameter_rates(p, unit(k)));
            for e in 0..4 {
                let unit: [f64; 4] = std::array::from_fn(|i| f64::from(u8::from(i == e)));
                let rates = parameter_rates(unit, w);
                rates.into_iter().enumerate().for_each(|(i, rate)| found(at + i, at + e, rate));
                let factors = turns.map(|turn| 4.0 * turn[e]);
                let parts: [(usize, f64); 3] = std::array::from_fn(|k| (rotation.column + k, factors[k]));
                self.column(at + e, &parts, found);
            }
            for (k, turn) in turns.into_iter().enumerate() {
                turn.into_iter().enumerate().for_each(|(i, rate)| found(at + i, spin_at + k, rate));
                self.column(spin_at + k, &[(velocities + rotation.column + k, 1.0)], found);
            }
        }
        for k in 0..self.states {
            self.column(motion + k, &[(2 * velocities + k, 1.0)], found);
        }
    }

    /// Gives the entries of a column that are derivatives along directions, each with a factor.
    fn column(&mut self, number: usize, parts: &[(usize, f64)], found: &mut dyn FnMut(usize, usize, f64)) {
        for (direction, factor) in parts {
            for (function, value) in &self.along[*direction] {
                let row = self.row_of[*function as usize];
                self.touched.push(row);
                self.column[row] += factor * value;
            }
        }
        for row in self.touched.drain(..) {
            let value = std::mem::take(&mut self.column[row]);
            if value != 0.0 {
                found(row, number, value);
            }
        }
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
    // Orientations that are signals are seen as they are.
    let parameters: [Node; 4] = std::array::from_fn(|e| g.input(coordinates.slot_of(rotation.position + e)));
    seeds.extend(parameters.into_iter().zip(turned_parameters(g, &parameters)[k]));
    seeds
}
