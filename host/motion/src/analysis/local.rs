//! [`Local`]: the equations of motion in coordinates of bodies at one state, with all their first derivatives.
//!
//! What every analysis of small changes stands on, whatever formulation a run takes: loads, rows, rates of states and outputs are
//! differentiated along positions, velocities, element states, accelerations, multipliers and signals from outside, exactly, by the
//! recorded operations ([`Tangents`]). Accelerations and multipliers count as unknowns of their own, so that forces that depend on
//! them need nothing special.
//!
//! Rotations of bodies are small turns about the axes of the *ground*, and angular velocities and accelerations are those seen from
//! it: for a rotor that spins about an axis of symmetry the derivatives then stay the same while it turns.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::evaluator::Evaluator;
use super::formulation::AnalysisError;
use super::linearisation::seeds;
use super::mass_values;
use crate::linalg::{DEFAULT_RANK_TOLERANCE, LinalgError, PivotedQr};
use crate::model::{Model, Quantity, rotation};
use crate::plan::{Coordinates, Layout, body_scales};
use crate::program::{Equations, Expr, Graph, Node, Seeds, Tangents};

/// Share of its length by which a slope along an axis is none.
const NO_SLOPE: f64 = 1e-9;

/// What is differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Function {
    /// Q - M a - Phi_q^T lambda, six per body: N and N m, ground axes, moments about the centre of mass.
    Balance,
    /// gamma - Phi_q a, per row.
    Accelerations,
    /// The values of the rows; of rows on velocities zero.
    Rows,
    /// The rates of the rows.
    Rates,
    /// The rates of the element states, without the carried values of internal unknowns.
    States,
    /// The quantities that were asked for, SI.
    Outputs,
}

/// Along what.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Six per body: displacement of the centre of mass, small turn; ground axes.
    Positions,
    /// Six per body: velocity of the centre of mass, angular velocity; ground axes.
    Velocities,
    /// The same states. Internal unknowns follow them and the positions.
    States,
    /// Six per body, the same for accelerations.
    Accelerations,
    /// The multipliers of the rows.
    Multipliers,
    /// The signals from outside.
    Inputs,
}

/// See the module documentation. It is made once and evaluated at many states.
pub struct Local {
    layout: Layout,
    /// The rows, by their number among all; ascending.
    rows: Vec<usize>,
    of_velocities: Vec<bool>,
    /// The states that go their own way, ascending.
    states: Vec<usize>,
    outputs: usize,
    inputs: usize,
    values: Evaluator,
    tangents: Tangents,
    /// Six by six per body, body axes.
    mass: Vec<f64>,
    scales: Vec<f64>,
    /// Bodies whose rotation means nothing.
    particles: Vec<usize>,
    /// Axes without a moment of inertia: body, axis in its axes.
    thin: Vec<(usize, Vector3<f64>)>,
    switches: bool,
}

/// What [`Local::at`] found.
#[derive(Debug, Clone)]
pub struct Expansion {
    values: DVector<f64>,
    slopes: DMatrix<f64>,
    functions: [usize; 7],
    directions: [usize; 7],
    /// The mass matrix, ground axes.
    pub mass: DMatrix<f64>,
    /// The angular velocity of each body, ground axes.
    pub spins: Vec<Vector3<f64>>,
    /// How much a unit of each of the six motions of a body counts: displacements of points that elements hold, m.
    pub scales: DVector<f64>,
    /// Rows that are none of the joints: they hold rotations that mean nothing, of particles and of thin rods about their axes.
    pub idle: DMatrix<f64>,
    of_velocities: Vec<bool>,
    /// |Q| and |Phi_q^T lambda| of each body, added up entry by entry.
    pub sizes: DVector<f64>,
}

impl Local {
    /// Prepares the derivatives of the equations of a scene of a size, m, with a choice of rows, and of quantities.
    #[must_use]
    pub fn new(
        equations: &Equations,
        model: &Model,
        layout: &Layout,
        (rows, length): (&[usize], f64),
        outputs: &[Quantity],
    ) -> Self {
        let mut equations = equations.clone();
        let coordinates = Coordinates::of_bodies(layout);
        let outputs: Vec<Node> = outputs.iter().map(|quantity| equations.observe(quantity, model, layout)).collect();
        let carried: Vec<usize> = (equations.graph.solved.iter())
            .flat_map(|solved| (0..solved.unknowns.len()).map(|k| solved.slot - layout.state_slot() + k))
            .collect();
        let states: Vec<usize> = (0..layout.states).filter(|state| !carried.contains(state)).collect();
        let functions = functions(&mut equations, &coordinates, layout, (rows, &states), &outputs);
        let rotations: Vec<[[Node; 3]; 3]> = equations.bodies.iter().map(|body| body.a).collect();
        let graph = &mut equations.graph;
        let moved = 0..2 * layout.velocities();
        let mut directions: Vec<Seeds> = (moved.clone().chain(states.iter().map(|state| moved.end + state)))
            .map(|direction| seeds(graph, &coordinates, &rotations, layout, direction))
            .collect();
        let one = graph.constant(1.0);
        let accelerations = (0..layout.velocities()).map(|k| layout.acceleration_slot() + k);
        let multipliers = rows.iter().map(|row| layout.multiplier_slot() + row);
        let inputs = (0..model.inputs.len()).map(|input| layout.given_slot(input));
        for slot in accelerations.chain(multipliers).chain(inputs) {
            let input = graph.input(slot);
            directions.push(Seeds::from_iter([(input, one)]));
        }
        // Moments of constraint forces and of loads, for the sizes that residuals are held against.
        let mut with_sizes = functions.clone();
        with_sizes.extend(&equations.loads);
        let graph = &mut equations.graph;
        Self {
            switches: graph.live(&functions).iter().any(|node| matches!(graph.expr(*node), Expr::Select(..))),
            values: Evaluator::new(graph, &with_sizes),
            tangents: Tangents::new(graph, &functions, &directions),
            of_velocities: rows.iter().map(|row| equations.rows[*row].of_velocities).collect(),
            rows: rows.to_vec(),
            states,
            outputs: outputs.len(),
            inputs: model.inputs.len(),
            mass: mass_values(model),
            scales: body_scales(model, length),
            particles: (0..model.bodies.len()).filter(|body| model.bodies[*body].particle).collect(),
            thin: (model.bodies.iter().enumerate())
                .flat_map(|(body, record)| record.thin.iter().map(move |thin| (body, thin.axis)))
                .collect(),
            layout: layout.clone(),
        }
    }

    /// The elements whose derivatives are not known, by name: those that are called, not recorded.
    #[must_use]
    pub fn opaque(equations: &Equations, model: &Model) -> Vec<String> {
        let called = |set: usize, index: u32| {
            let element = model.elements.iter().find(|element| element.set == set && element.index == index);
            element.map_or_else(String::new, |element| element.name.clone())
        };
        let mut names: Vec<String> = equations.graph.calls.iter().map(|call| called(call.set, call.instance)).collect();
        names.sort();
        names.dedup();
        names
    }

    /// The rows, by their number among all.
    #[must_use]
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// The element states that are differentiated, by their number among all: those without internal unknowns.
    #[must_use]
    pub fn states(&self) -> &[usize] {
        &self.states
    }

    /// Whether any of the equations has branches: derivatives are those of the branch in force.
    #[must_use]
    pub fn has_branches(&self) -> bool {
        self.switches
    }

    fn counts(&self) -> ([usize; 7], [usize; 7]) {
        let (n, m, s) = (self.layout.velocities(), self.rows.len(), self.states.len());
        (ends([n, m, m, m, s, self.outputs]), ends([n, n, s, n, m, self.inputs]))
    }

    /// Values and derivatives where the inputs of all programs are these: time, state, accelerations and multipliers among them, and
    /// internal unknowns that meet their conditions.
    ///
    /// # Errors
    /// An element that fails.
    pub fn at(&mut self, inputs: &[f64]) -> Result<Expansion, AnalysisError> {
        let (functions, directions) = self.counts();
        let (n, m) = (self.layout.velocities(), self.rows.len());
        let found = self.values.run(inputs, &[])?;
        let mut values = DVector::from_column_slice(&found[..functions[6]]);
        let loads = DVector::from_column_slice(&found[functions[6]..]);
        let mut slopes = DMatrix::zeros(functions[6], directions[6]);
        self.tangents
            .run(inputs, &[], |direction, function, value| slopes[(function, direction)] = value)
            .map_err(|(set, fault)| AnalysisError::Element { set, fault })?;
        // Body axes until here. Sizes: what the loads and the constraints put on each body.
        let constraints = slopes.view((0, directions[4]), (n, m));
        let mut sizes = loads.map(f64::abs);
        for (k, row) in self.rows.iter().enumerate() {
            let multiplier = inputs[self.layout.multiplier_slot() + row];
            sizes += constraints.column(k).map(|slope| (slope * multiplier).abs());
        }
        let mass = self.mass_matrix();
        let accelerations = DVector::from_column_slice(&inputs[self.layout.acceleration_slot()..][..n]);
        let inertia = &mass * &accelerations;
        sizes += inertia.map(f64::abs);
        let mut balance = values.rows_mut(0, n);
        balance -= inertia;
        let mut along = slopes.view_mut((0, directions[3]), (n, n));
        along -= &mass;
        let mut expansion = Expansion {
            values,
            slopes,
            functions,
            directions,
            mass,
            spins: Vec::with_capacity(self.layout.bodies),
            scales: DVector::from_column_slice(&self.scales),
            idle: DMatrix::zeros(0, n),
            of_velocities: self.of_velocities.clone(),
            sizes,
        };
        let turns: Vec<Matrix3<f64>> = (0..self.layout.bodies)
            .map(|body| rotation(&std::array::from_fn(|k| inputs[self.layout.body_slot(body, 3 + k)])))
            .collect();
        expansion.in_ground_axes(&turns, inputs, &self.layout);
        expansion.idle = self.idle_rows(&expansion, &turns);
        Ok(expansion)
    }

    fn mass_matrix(&self) -> DMatrix<f64> {
        let n = self.layout.velocities();
        let mut mass = DMatrix::zeros(n, n);
        for (body, values) in self.mass.chunks_exact(9).enumerate() {
            let at = 6 * body;
            (0..3).for_each(|k| mass[(at + k, at + k)] = values[k]);
            let mut next = values[3..].iter();
            for column in 3..6 {
                for row in column..6 {
                    let value = next.next().copied().unwrap_or(0.0);
                    (mass[(at + row, at + column)], mass[(at + column, at + row)]) = (value, value);
                }
            }
        }
        mass
    }

    /// See [`Expansion::idle`]. An axis that a row holds, or that a load turns about, is not idle.
    fn idle_rows(&self, expansion: &Expansion, turns: &[Matrix3<f64>]) -> DMatrix<f64> {
        let mut axes: Vec<(usize, Vector3<f64>)> = Vec::new();
        for body in &self.particles {
            axes.extend((0..3).map(|k| (*body, Vector3::ith(k, 1.0))));
        }
        for (body, axis) in &self.thin {
            axes.push((*body, turns[*body] * axis));
        }
        let rows = expansion.slope(Function::Rates, Direction::Velocities);
        let touched = |(body, axis): &(usize, Vector3<f64>)| {
            let slopes = rows.columns(6 * body + 3, 3);
            (0..slopes.nrows()).any(|row| {
                let slope = Vector3::new(slopes[(row, 0)], slopes[(row, 1)], slopes[(row, 2)]);
                slope.dot(axis).abs() > NO_SLOPE * slope.norm()
            })
        };
        axes.retain(|axis| !touched(axis));
        let mut idle = DMatrix::zeros(axes.len(), self.layout.velocities());
        for (row, (body, axis)) in axes.iter().enumerate() {
            (0..3).for_each(|k| idle[(row, 6 * body + 3 + k)] = axis[k]);
        }
        idle
    }
}

/// Where each part ends, with a zero before the first.
fn ends(counts: [usize; 6]) -> [usize; 7] {
    let mut ends = [0; 7];
    counts.iter().enumerate().for_each(|(k, count)| ends[k + 1] = ends[k] + count);
    ends
}

/// The functions in the order of [`Function`], the balance without M a.
fn functions(
    equations: &mut Equations,
    coordinates: &Coordinates,
    layout: &Layout,
    (rows, states): (&[usize], &[usize]),
    outputs: &[Node],
) -> Vec<Node> {
    let mut balance = equations.loads.clone();
    let (mut gammas, mut values, mut rates) = (Vec::new(), Vec::new(), Vec::new());
    for index in rows {
        let row = equations.rows[*index].clone();
        let g: &mut Graph = &mut equations.graph;
        let multiplier = g.input(layout.multiplier_slot() + index);
        let (mut gamma, mut rate) = (row.gamma, row.time);
        for (column, slope) in &row.jacobian {
            let reaction = g.mul(*slope, multiplier);
            balance[*column] = g.sub(balance[*column], reaction);
            let acceleration = g.input(coordinates.acceleration_slot + column);
            let part = g.mul(*slope, acceleration);
            gamma = g.sub(gamma, part);
            let velocity = g.input(coordinates.velocity_slots[*column]);
            let part = g.mul(*slope, velocity);
            rate = g.add(rate, part);
        }
        gammas.push(gamma);
        values.push(row.value);
        rates.push(rate);
    }
    let mut functions = balance;
    functions.extend(gammas);
    functions.extend(values);
    functions.extend(rates);
    functions.extend(states.iter().map(|state| equations.state_rates[*state]));
    functions.extend(outputs);
    functions
}

impl Expansion {
    fn range(ends: &[usize; 7], part: usize) -> Range<usize> {
        ends[part]..ends[part + 1]
    }

    /// Values of functions.
    #[must_use]
    pub fn value(&self, of: Function) -> DVector<f64> {
        let range = Self::range(&self.functions, of as usize);
        self.values.rows(range.start, range.len()).into_owned()
    }

    /// Derivatives: functions by rows, directions by columns.
    #[must_use]
    pub fn slope(&self, of: Function, along: Direction) -> DMatrix<f64> {
        let (rows, columns) =
            (Self::range(&self.functions, of as usize), Self::range(&self.directions, along as usize));
        self.slopes.view((rows.start, columns.start), (rows.len(), columns.len())).into_owned()
    }

    /// The Jacobian of all rows.
    #[must_use]
    pub fn jacobian(&self) -> DMatrix<f64> {
        self.slope(Function::Rates, Direction::Velocities)
    }

    /// The rows that constrain positions, by their place.
    #[must_use]
    pub fn holonomic(&self) -> Vec<usize> {
        (0..self.of_velocities.len()).filter(|row| !self.of_velocities[*row]).collect()
    }

    /// From body axes to ground axes: with A of each body, omega' = A^T omega, and omega changes by delta theta x omega where the
    /// body turns and omega' stays.
    fn in_ground_axes(&mut self, turns: &[Matrix3<f64>], inputs: &[f64], layout: &Layout) {
        for (body, a) in turns.iter().enumerate() {
            let vector = |slot: usize| Vector3::new(inputs[slot], inputs[slot + 1], inputs[slot + 2]);
            let spin = a * vector(layout.body_slot(body, 10));
            let acceleration = a * vector(layout.acceleration_slot() + 6 * body + 3);
            self.spins.push(spin);
            let at = 6 * body + 3;
            let place = |along: Direction| self.directions[along as usize] + at;
            let (p, v, w) =
                (place(Direction::Positions), place(Direction::Velocities), place(Direction::Accelerations));
            for row in 0..self.slopes.nrows() {
                let take = |slopes: &DMatrix<f64>, at: usize| {
                    a * Vector3::new(slopes[(row, at)], slopes[(row, at + 1)], slopes[(row, at + 2)])
                };
                let along = [take(&self.slopes, p), take(&self.slopes, v), take(&self.slopes, w)];
                // s . (x x dtheta) = (s x x) . dtheta.
                let turned = along[0] + along[1].cross(&spin) + along[2].cross(&acceleration);
                for k in 0..3 {
                    self.slopes[(row, p + k)] = turned[k];
                    self.slopes[(row, v + k)] = along[1][k];
                    self.slopes[(row, w + k)] = along[2][k];
                }
            }
            // Moments are in body axes, too; what is left of them is zero where the motion is looked at.
            let moments = Vector3::new(self.values[at], self.values[at + 1], self.values[at + 2]);
            self.values.rows_mut(at, 3).copy_from(&(a * moments));
            let own = self.mass.fixed_view::<3, 3>(at, at).into_owned();
            self.mass.fixed_view_mut::<3, 3>(at, at).copy_from(&(a * own * a.transpose()));
            let size = self.sizes.fixed_rows::<3>(at).norm();
            self.sizes.fixed_rows_mut::<3>(at).fill(size);
        }
        // Moments are in body axes until here: column by column, as they lie in memory.
        for mut column in self.slopes.column_iter_mut() {
            for (body, a) in turns.iter().enumerate() {
                let mut moment = column.fixed_rows_mut::<3>(6 * body + 3);
                let turned = a * &moment;
                moment.copy_from(&turned);
            }
        }
    }
}

/// The rows of a Jacobian as columns, in coordinates that are scaled by what they move, factored.
fn factored(jacobian: &DMatrix<f64>, scales: &DVector<f64>) -> Result<PivotedQr, LinalgError> {
    let (m, n) = jacobian.shape();
    let entries = jacobian.iter().filter(|entry| **entry != 0.0).count();
    let mut rows = PivotedQr::with_entries(n, m, entries, DEFAULT_RANK_TOLERANCE);
    rows.clear();
    for row in 0..m {
        (0..n).for_each(|column| rows.set(column, row, jacobian[(row, column)] * scales[column]));
    }
    rows.factor()?;
    Ok(rows)
}

/// What a Jacobian leaves free, in coordinates that are scaled by what they move.
#[derive(Debug, Clone)]
pub struct Freedom {
    /// Columns span all motions that the rows allow; of unit length in those coordinates.
    pub basis: DMatrix<f64>,
    /// From a motion to its components along the columns: the inverse from the left.
    pub components: DMatrix<f64>,
    /// Rows that are independent, by their place; the others follow from them.
    pub independent: Vec<usize>,
    /// From values of the independent rows to the shortest motion that has them.
    pub lift: DMatrix<f64>,
    /// How far the independent rows are from being dependent: their smallest pivot on the largest.
    pub soundness: f64,
}

impl Freedom {
    /// Of the rows of a Jacobian, with the scales of its columns. Rank is found as everywhere: rows are compared by their lengths
    /// in scaled coordinates.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn of(jacobian: &DMatrix<f64>, scales: &DVector<f64>) -> Result<Self, LinalgError> {
        let (m, n) = jacobian.shape();
        let mut rows = factored(jacobian, scales)?;
        let mut independent = rows.independent_columns().to_vec();
        independent.sort_unstable();
        let free = DMatrix::from_vec(n, n - independent.len(), rows.complement()?);
        let mut lift = DMatrix::zeros(n, independent.len());
        let mut unit = vec![0.0; m];
        for (k, row) in independent.iter().enumerate() {
            unit[*row] = 1.0;
            rows.min_norm_solve(&unit, lift.column_mut(k).as_mut_slice())?;
            unit[*row] = 0.0;
        }
        let scale = |mut matrix: DMatrix<f64>| {
            matrix.row_iter_mut().zip(scales.iter()).for_each(|(mut row, scale)| row *= *scale);
            matrix
        };
        let mut components = free.transpose();
        components.column_iter_mut().zip(scales.iter()).for_each(|(mut column, scale)| column /= *scale);
        let soundness = rows.smallest_pivot_ratio();
        Ok(Self { basis: scale(free), components, independent, lift: scale(lift), soundness })
    }

    /// The shortest motion, in those coordinates, that gives the independent rows of a Jacobian these values: `lift` times them.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn shortest(
        jacobian: &DMatrix<f64>,
        scales: &DVector<f64>,
        values: &DVector<f64>,
    ) -> Result<DVector<f64>, LinalgError> {
        let mut motion = DVector::zeros(jacobian.ncols());
        factored(jacobian, scales)?.min_norm_solve(values.as_slice(), motion.as_mut_slice())?;
        Ok(motion.component_mul(scales))
    }

    /// The motions by which the first rows follow changes of their values, column by column; the rows behind stay met.
    #[must_use]
    pub fn moved_by(&self, values: &DMatrix<f64>) -> DMatrix<f64> {
        let right = DMatrix::from_fn(self.independent.len(), values.ncols(), |k, column| {
            let row = self.independent[k];
            if row < values.nrows() { -values[(row, column)] } else { 0.0 }
        });
        &self.lift * right
    }

    /// Number of free directions.
    #[must_use]
    pub fn count(&self) -> usize {
        self.basis.ncols()
    }
}
