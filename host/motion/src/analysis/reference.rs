//! [`ReferenceForm`]: the paper's Eq. (6) as printed, seven coordinates per body, dense. The twin of everything faster.
//!
//! [M Phi_q^T; Phi_q 0] [q''; lambda] = [Q; gamma], q = (r, p) of all bodies, the normalisation p.p - 1 of each body among
//! the constraints (requirement R-OBJ-4). The paper's own example has redundant rows, which makes this matrix singular: the
//! rows that the plan found redundant are left out (their multipliers are zero), always the same ones, since off the
//! constraints it makes a difference which; and a factorisation with complete pivoting finds the rank where it falls further
//! and sets what is left open to zero.

use element_api::ElementSet;

use super::balance::Imbalance;
use super::formulation::{AnalysisError, Counters, Formulation, Group, Observed, Traces};
use super::motion::{normalise, parameter_rates};
use super::working::BODY_STATES;
use crate::linalg::FullPivLu;
use crate::model::Model;
use crate::plan::{Layout, Plan};
use crate::program::{Equations, Form, Program, Workspace};

/// Numbers per body in the state: r (3), p (4), r' (3), p' (4).
const STATES: usize = 14;
/// Rank tolerance of the complete factorisation.
const TOLERANCE: f64 = 1e-11;
/// Iterations for forces that depend on accelerations and multipliers, and the relative change at which they end.
const MOST_ITERATIONS: usize = 500;
const CLOSE: f64 = 1e-13;
/// The same where round-off prevents a smaller change, and the step of difference quotients, for elements that bring kinetic energy.
const CLOSE_ENOUGH: f64 = 1e-9;
const DIFFERENCE: f64 = 1e-3;
/// Newton corrections per projection.
const MOST_CORRECTIONS: usize = 12;

/// See the module documentation.
pub struct ReferenceForm {
    layout: Layout,
    sets: Vec<Box<dyn ElementSet>>,
    masses: Vec<f64>,
    groups: Vec<Group>,
    program: Program,
    workspace: Workspace,
    outputs: Vec<f64>,
    pattern: Vec<(usize, usize)>,
    /// Rows left out.
    redundant: Vec<usize>,
    inputs: Vec<f64>,
    matrix: FullPivLu,
    /// Units of the unknowns and equations, so that pivots can be compared: per coordinate 1 / sqrt(mass) or
    /// 1 / sqrt(4 J), per row 1 / (its largest entry in these units).
    scale: Vec<f64>,
    right: Vec<f64>,
    solution: Vec<f64>,
    length: f64,
    counters: Counters,
    /// Whether forces, state rates or power depend on accelerations or multipliers.
    coupled: bool,
    /// The inputs that forces depend on although they follow from them, where elements bring kinetic energy: plain iteration
    /// ends nowhere if an element's mass is more than a body's.
    inertial: Option<Vec<usize>>,
}

/// Where each kind of output begins.
struct Parts<'a> {
    jacobian: &'a [f64],
    value: &'a [f64],
    time: &'a [f64],
    gamma: &'a [f64],
    loads: &'a [f64],
    rates: &'a [f64],
    power: f64,
}

impl ReferenceForm {
    /// Writes down the equations in the paper's coordinates. The opaque elements of the model move in.
    #[must_use]
    pub fn new(model: &mut Model, plan: &Plan, length: f64) -> Self {
        let layout = &plan.layout;
        let equations = Equations::build(model, layout, Form::Reference);
        let mut pattern = Vec::new();
        let mut nodes = Vec::new();
        for (k, row) in equations.rows.iter().enumerate() {
            for (column, node) in &row.jacobian {
                pattern.push((k, *column));
                nodes.push(*node);
            }
        }
        nodes.extend(equations.rows.iter().map(|row| row.value));
        nodes.extend(equations.rows.iter().map(|row| row.time));
        nodes.extend(equations.rows.iter().map(|row| row.gamma));
        nodes.extend(&equations.loads);
        nodes.extend(&equations.mass_p);
        nodes.extend(&equations.state_rates);
        nodes.push(equations.power);
        let program = Program::compile(&equations.graph, &nodes);
        let size = 8 * layout.bodies + layout.rows;
        let mut scale = Vec::with_capacity(size);
        for body in &model.bodies {
            scale.extend([1.0 / body.mass.sqrt(); 3]);
            scale.extend([1.0 / (4.0 * body.inertia.diagonal().max()).sqrt(); 4]);
        }
        scale.resize(size, 1.0);
        let mut groups = Vec::new();
        for _ in 0..layout.bodies {
            groups.extend([Group::Position; 3]);
            groups.extend([Group::Parameter; 4]);
            groups.extend([Group::Velocity; 3]);
            groups.extend([Group::AngularVelocity; 4]);
        }
        groups.extend(std::iter::repeat_n(Group::State, layout.states));
        groups.push(Group::Work);
        Self {
            sets: std::mem::take(&mut model.sets),
            masses: model.bodies.iter().map(|body| body.mass).collect(),
            groups,
            workspace: program.workspace(),
            outputs: vec![0.0; nodes.len()],
            program,
            pattern,
            inputs: vec![0.0; layout.inputs()],
            matrix: FullPivLu::new(size, TOLERANCE),
            scale,
            redundant: plan.redundant_rows.iter().map(|row| row.row).collect(),
            right: vec![0.0; size],
            solution: vec![0.0; size],
            length,
            layout: layout.clone(),
            counters: Counters::default(),
            coupled: equations.needs_solution(),
            inertial: equations.inertial.then(|| equations.coupling.iter().map(|input| input.slot).collect()),
        }
    }

    fn load(&mut self, t: f64, state: &[f64]) {
        self.inputs[Layout::TIME] = t;
        for body in 0..self.layout.bodies {
            let y = &state[STATES * body..STATES * (body + 1)];
            let slot = self.layout.body_slot(body, 0);
            self.inputs[slot..slot + 10].copy_from_slice(&y[..10]);
            self.inputs[slot + 10..slot + 13].copy_from_slice(&angular_velocity(&y[3..7], &y[10..14]));
            self.inputs[slot + 13..slot + 17].copy_from_slice(&y[10..14]);
        }
        let states = STATES * self.layout.bodies;
        let slot = self.layout.state_slot();
        self.inputs[slot..slot + self.layout.states].copy_from_slice(&state[states..states + self.layout.states]);
    }

    fn evaluate(&mut self) -> Result<(), AnalysisError> {
        self.program
            .run(&self.inputs, &self.sets, &mut self.workspace, &mut self.outputs)
            .map_err(|(set, fault)| AnalysisError::Element { set, fault })
    }

    fn parts(&self) -> Parts<'_> {
        let rows = self.layout.rows;
        let (jacobian, rest) = self.outputs.split_at(self.pattern.len());
        let (value, rest) = rest.split_at(rows);
        let (time, rest) = rest.split_at(rows);
        let (gamma, rest) = rest.split_at(rows);
        let (loads, rest) = rest.split_at(7 * self.layout.bodies);
        let (_mass, rest) = rest.split_at(10 * self.layout.bodies);
        let (rates, power) = rest.split_at(self.layout.states);
        Parts { jacobian, value, time, gamma, loads, rates, power: power[0] }
    }

    /// Fills and factors the matrix of Eq. (6) at the inputs' state.
    fn factor(&mut self) -> Result<(), AnalysisError> {
        let bodies = self.layout.bodies;
        let rows = self.layout.rows;
        let size = self.right.len();
        let coordinates = 7 * bodies;
        self.scale[coordinates..].fill(0.0);
        for ((row, column), value) in self.pattern.iter().zip(&self.outputs) {
            let entry = (value * self.scale[*column]).abs();
            let largest = &mut self.scale[coordinates + row];
            *largest = largest.max(entry);
        }
        for body in 0..bodies {
            self.scale[coordinates + rows + body] = 2.0 * self.scale[7 * body + 3];
        }
        self.scale[coordinates..].iter_mut().for_each(|x| *x = if *x > 0.0 { 1.0 / *x } else { 1.0 });
        let scale = &self.scale;
        let entries = self.matrix.entries_mut();
        entries.fill(0.0);
        let mut set = |i: usize, j: usize, value: f64| {
            let value = value * scale[i] * scale[j];
            entries[i + size * j] = value;
            entries[j + size * i] = value;
        };
        let mass_p = &self.outputs[self.pattern.len() + 3 * rows + coordinates..];
        for body in 0..bodies {
            let at = 7 * body;
            (0..3).for_each(|k| set(at + k, at + k, self.masses[body]));
            let mut next = 10 * body;
            for i in 0..4 {
                for j in 0..=i {
                    set(at + 3 + i, at + 3 + j, mass_p[next]);
                    next += 1;
                }
            }
            // Normalisation p.p - 1 = 0: Jacobian 2 p^T.
            let slot = self.layout.body_slot(body, 3);
            (0..4).for_each(|k| set(coordinates + rows + body, at + 3 + k, 2.0 * self.inputs[slot + k]));
        }
        for ((row, column), value) in self.pattern.iter().zip(&self.outputs) {
            if self.redundant.binary_search(row).is_err() {
                set(coordinates + row, *column, *value);
            }
        }
        for row in &self.redundant {
            let at = coordinates + row;
            entries[at + size * at] = 1.0;
        }
        self.counters.factorisations += 1;
        Ok(self.matrix.factor()?)
    }

    fn solve(&mut self) -> Result<(), AnalysisError> {
        let coordinates = 7 * self.layout.bodies;
        self.redundant.iter().for_each(|row| self.right[coordinates + row] = 0.0);
        self.right.iter_mut().zip(&self.scale).for_each(|(x, scale)| *x *= scale);
        self.matrix.solve(&self.right, &mut self.solution)?;
        self.solution.iter_mut().zip(&self.scale).for_each(|(x, scale)| *x *= scale);
        Ok(())
    }

    /// q'' and lambda at the inputs' state, left in `solution`; together with the forces that depend on them, by plain
    /// iteration.
    fn solve_dynamics(&mut self) -> Result<(), AnalysisError> {
        let solved = self.layout.acceleration_slot()..self.layout.inputs();
        if self.coupled {
            self.inputs[solved].fill(0.0);
        }
        self.evaluate()?;
        self.factor()?;
        self.solve_once()?;
        if !self.coupled {
            return Ok(());
        }
        if let Some(slots) = self.inertial.take() {
            let solved = self.solve_with_inertia(&slots);
            self.inertial = Some(slots);
            return solved;
        }
        let mut least = f64::INFINITY;
        for _ in 0..MOST_ITERATIONS {
            let before = self.solution.clone();
            self.publish();
            self.evaluate()?;
            self.solve_once()?;
            let size = self.solution.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
            let pairs = self.solution.iter().zip(&before);
            let own = pairs.clone().map(|(a, b)| (a - b).abs() / a.abs().max(f64::MIN_POSITIVE)).fold(0.0, f64::max);
            let whole = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // What is small beside the rest may consist of round-off.
            if own <= CLOSE || (whole <= CLOSE * size && own >= least) {
                return Ok(());
            }
            least = least.min(own);
            self.counters.coupling_iterations += 1;
        }
        Err(AnalysisError::NoCommonSolution)
    }

    /// The same by Newton's method, with difference quotients: exact to round-off for what is linear in accelerations.
    fn solve_with_inertia(&mut self, slots: &[usize]) -> Result<(), AnalysisError> {
        let n = slots.len();
        let mut z = vec![0.0; n];
        let mut matrix = FullPivLu::new(n, 1e-14);
        let (mut step, mut least) = (vec![0.0; n], f64::INFINITY);
        for _ in 0..MOST_ITERATIONS {
            let found = self.answer(slots, &z)?;
            let difference: Vec<f64> = found.iter().zip(&z).map(|(found, z)| found - z).collect();
            // Nothing is all that is found where nothing moves the bodies.
            let change = if found == z { 0.0 } else { largest(&difference) / largest(&found) };
            if change <= CLOSE || (change <= CLOSE_ENOUGH && change >= least) {
                return Ok(());
            }
            least = least.min(change);
            self.counters.coupling_iterations += 1;
            let h = DIFFERENCE * largest(&found).max(1.0);
            for k in 0..n {
                let mut there = z.clone();
                there[k] += h;
                let moved = self.answer(slots, &there)?;
                for (row, (moved, found)) in moved.iter().zip(&found).enumerate() {
                    matrix.entries_mut()[row + n * k] = f64::from(u8::from(row == k)) - (moved - found) / h;
                }
            }
            matrix.factor()?;
            matrix.solve(&difference, &mut step)?;
            z.iter_mut().zip(&step).for_each(|(z, step)| *z += step);
        }
        Err(AnalysisError::NoCommonSolution)
    }

    /// What the equations of motion answer to forces for these values of inputs at `slots`; the solution stays.
    fn answer(&mut self, slots: &[usize], z: &[f64]) -> Result<Vec<f64>, AnalysisError> {
        slots.iter().zip(z).for_each(|(slot, z)| self.inputs[*slot] = *z);
        self.evaluate()?;
        self.solve_once()?;
        self.publish();
        Ok(slots.iter().map(|slot| self.inputs[*slot]).collect())
    }

    /// Writes accelerations and multipliers into the inputs.
    fn publish(&mut self) {
        for body in 0..self.layout.bodies {
            let slot = self.layout.acceleration_slot() + 6 * body;
            let q = &self.solution[7 * body..7 * body + 7];
            self.inputs[slot..slot + 3].copy_from_slice(&q[..3]);
            // omega'' = 2 G p'' since G' p' = 0.
            let at = self.layout.body_slot(body, 3);
            let spin = angular_velocity(&self.inputs[at..at + 4], &q[3..7]);
            self.inputs[slot + 3..slot + 6].copy_from_slice(&spin);
        }
        let slot = self.layout.multiplier_slot();
        let from = 7 * self.layout.bodies;
        self.inputs[slot..slot + self.layout.rows].copy_from_slice(&self.solution[from..from + self.layout.rows]);
    }

    /// Solves Eq. (6) with the factorisation in force and the right side of the last evaluation.
    fn solve_once(&mut self) -> Result<(), AnalysisError> {
        let coordinates = 7 * self.layout.bodies;
        let rows = self.layout.rows;
        let mut right = std::mem::take(&mut self.right);
        let parts = self.parts();
        right[..coordinates].copy_from_slice(parts.loads);
        right[coordinates..coordinates + rows].copy_from_slice(parts.gamma);
        for body in 0..self.layout.bodies {
            // gamma of the normalisation: -2 p'.p'.
            let slot = self.layout.body_slot(body, 13);
            let rate = &self.inputs[slot..slot + 4];
            right[coordinates + rows + body] = -2.0 * rate.iter().map(|x| x * x).sum::<f64>();
        }
        self.right = right;
        self.solve()
    }

    /// Smallest move (metric of the mass) that removes the residual of all rows; gives the largest residual.
    fn solve_correction(&mut self, velocity: bool) -> Result<f64, AnalysisError> {
        self.evaluate()?;
        self.factor()?;
        let coordinates = 7 * self.layout.bodies;
        let rows = self.layout.rows;
        let mut right = std::mem::take(&mut self.right);
        right.fill(0.0);
        let parts = self.parts();
        let residual = &mut right[coordinates..];
        residual[..rows].copy_from_slice(if velocity { parts.time } else { parts.value });
        if velocity {
            for ((row, column), value) in self.pattern.iter().zip(parts.jacobian) {
                residual[*row] += value * self.inputs[self.rate_slot(*column)];
            }
        }
        for body in 0..self.layout.bodies {
            let p = &self.inputs[self.layout.body_slot(body, 3)..][..4];
            let p_rate = &self.inputs[self.layout.body_slot(body, 13)..][..4];
            residual[rows + body] = if velocity {
                2.0 * p.iter().zip(p_rate).map(|(a, b)| a * b).sum::<f64>()
            } else {
                p.iter().map(|x| x * x).sum::<f64>() - 1.0
            };
        }
        let worst = residual.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        residual.iter_mut().for_each(|x| *x = -*x);
        self.right = right;
        self.solve()?;
        Ok(worst)
    }

    /// Input slot of the rate of a coordinate.
    fn rate_slot(&self, column: usize) -> usize {
        let (body, k) = (column / 7, column % 7);
        if k < 3 { self.layout.body_slot(body, 7 + k) } else { self.layout.body_slot(body, 13 + k - 3) }
    }
}

fn largest(list: &[f64]) -> f64 {
    list.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()))
}

/// omega' = 2 G p' (Haug 1989, eq. 9.3.32).
fn angular_velocity(p: &[f64], p_rate: &[f64]) -> [f64; 3] {
    let [e0, e1, e2, e3] = [p[0], p[1], p[2], p[3]];
    let [f0, f1, f2, f3] = [p_rate[0], p_rate[1], p_rate[2], p_rate[3]];
    [
        2.0 * (-e1 * f0 + e0 * f1 + e3 * f2 - e2 * f3),
        2.0 * (-e2 * f0 - e3 * f1 + e0 * f2 + e1 * f3),
        2.0 * (-e3 * f0 + e2 * f1 - e1 * f2 + e0 * f3),
    ]
}

impl Formulation for ReferenceForm {
    fn name(&self) -> &'static str {
        "reference, Eq. (6) dense"
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn state_of(&mut self, working: &[f64], state: &mut [f64]) {
        for body in 0..self.layout.bodies {
            let from = &working[BODY_STATES * body..BODY_STATES * (body + 1)];
            let to = &mut state[STATES * body..STATES * (body + 1)];
            to[..10].copy_from_slice(&from[..10]);
            let rates = parameter_rates([from[3], from[4], from[5], from[6]], [from[10], from[11], from[12]]);
            to[10..14].copy_from_slice(&rates);
        }
        let (from, to) = (BODY_STATES * self.layout.bodies, STATES * self.layout.bodies);
        state[to..].copy_from_slice(&working[from..]);
    }

    /// Nothing is learned on the way.
    fn forget(&mut self, _: &[f64]) {}

    fn set_discrete(&mut self, references: &[f64], discrete: &[f64]) {
        self.layout.write_discrete(&mut self.inputs, references, discrete);
    }

    fn rates(&mut self, t: f64, state: &[f64], rates: &mut [f64]) -> Result<(), AnalysisError> {
        self.counters.evaluations += 1;
        self.load(t, state);
        self.solve_dynamics()?;
        for body in 0..self.layout.bodies {
            let from = STATES * body;
            rates[from..from + 7].copy_from_slice(&state[from + 7..from + 14]);
            rates[from + 7..from + 14].copy_from_slice(&self.solution[7 * body..7 * body + 7]);
        }
        let parts = self.parts();
        let states = STATES * self.layout.bodies;
        rates[states..states + self.layout.states].copy_from_slice(parts.rates);
        let multipliers = &self.solution[7 * self.layout.bodies..];
        let driven: f64 = parts.time.iter().zip(multipliers).map(|(time, lambda)| time * lambda).sum();
        rates[states + self.layout.states] = parts.power + driven;
        if rates.iter().all(|x| x.is_finite()) {
            return Ok(());
        }
        Err(AnalysisError::NotFinite { what: "an acceleration or the rate of a state".into() })
    }

    fn project(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
        for _ in 0..MOST_CORRECTIONS {
            self.load(t, state);
            self.solve_correction(false)?;
            self.counters.position_corrections += 1;
            let mut size = 0.0_f64;
            for body in 0..self.layout.bodies {
                for k in 0..7 {
                    let d = self.solution[7 * body + k];
                    state[STATES * body + k] += d;
                    size = size.max(d.abs() * if k < 3 { 1.0 / self.length } else { 1.0 });
                }
            }
            if size * size <= f64::EPSILON {
                break;
            }
        }
        self.load(t, state);
        self.solve_correction(true)?;
        for body in 0..self.layout.bodies {
            for k in 0..7 {
                state[STATES * body + 7 + k] += self.solution[7 * body + k];
            }
        }
        Ok(())
    }

    fn leaves_rows_out(&self) -> bool {
        !self.redundant.is_empty()
    }

    fn observe(&mut self, t: f64, state: &[f64], dynamics: bool) -> Result<Observed<'_>, AnalysisError> {
        self.load(t, state);
        if dynamics {
            self.solve_dynamics()?;
            self.publish();
        }
        // Reports are written in working coordinates, which expect Euler parameters of length one.
        for body in 0..self.layout.bodies {
            let slot = self.layout.body_slot(body, 3);
            normalise(&mut self.inputs[slot..slot + 4]);
        }
        Ok(Observed { inputs: &self.inputs, imbalance: Imbalance::default() })
    }

    fn traces(&self) -> Traces {
        Traces { counters: [self.counters, Counters::default()], ..Traces::default() }
    }

    fn forget_since(&mut self, traces: &Traces) {
        self.counters = traces.counters[0];
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn trade_sets(&mut self, sets: &mut Vec<Box<dyn ElementSet>>) {
        std::mem::swap(&mut self.sets, sets);
    }

    fn sets_mut(&mut self) -> &mut [Box<dyn ElementSet>] {
        &mut self.sets
    }

    fn sets(&self) -> &[Box<dyn ElementSet>] {
        &self.sets
    }
}
