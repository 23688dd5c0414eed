//! [`JointForm`]: the coordinates of joints along a spanning tree, eliminated operation by operation, and a rank-safe engine
//! where the rank falls.

use element_api::ElementSet;
use nalgebra::Matrix3;

use super::constraints::Constraints;
use super::evaluator::Evaluator;
use super::formulation::{AnalysisError, Counters, Formulation, Group, Observed};
use super::joint_start::{JointStart, JointState, parameters};
use super::linearisation::{Linearisation, Terms};
use super::working::{
    APPROACH, BODY_STATES, MOST_CORRECTIONS, MOTION_RANK_TOLERANCE, NEAR_SINGULAR, ROUND_OFF, SICK_SHARE, SICK_TREE,
    TOO_NEAR, WorkingForm, normalise, parameter_rates,
};
use crate::linalg::{DenseQr, Health, KktSolver, KktStructure};
use crate::model::Model;
use crate::plan::{Coordinates, Layout, Measure, Plan, SpanningTree};
use crate::program::{Elimination, Equations, JointEquations, Node, Used as Compiled};

/// Share of its gradient along the bodies' own coordinates below which the gradient of a row along the joints' is round-off:
/// the row holds wherever the joints are.
const NO_GRADIENT: f64 = 1e-11;
/// Places where that is looked at, besides the start.
const PROBES: usize = 3;
/// Share of the largest pivot below which a row counts as dependent at the start.
const RANK_TOLERANCE: f64 = 1e-9;
/// Below this pivot ratio at the start, elimination without pivoting is not trusted with a scene at all.
const LEAST_HEALTH: f64 = 1e-8;

/// The equations of motion solved operation by operation.
struct Unrolled {
    /// Accelerations, multipliers, rates of states, power; then pivots.
    motion: Evaluator,
    /// Correction of positions, values of the rows; then pivots.
    position: Evaluator,
    /// Correction of velocities; then pivots.
    velocity: Evaluator,
    rows: Vec<usize>,
    /// Squared lengths of the rows in the coordinates of bodies, in the metric of M^-1.
    squares: Vec<f64>,
}

impl Unrolled {
    fn new(joint: &JointEquations, rows: &[usize], squares: Vec<f64>) -> Self {
        let mut g = joint.graph.clone();
        let columns = joint.coordinates.columns;
        let chosen = || rows.iter().map(|row| &joint.rows[*row]);
        let jacobian: Vec<Vec<(usize, Node)>> = chosen().map(|row| row.jacobian.clone()).collect();
        let elimination = Elimination::new(&mut g, columns, &joint.mass, &jacobian);
        let gammas: Vec<Node> = chosen().map(|row| row.gamma).collect();
        let (accelerations, multipliers) = elimination.solve(&mut g, &joint.loads, &gammas);
        let mut power = joint.power;
        for (row, multiplier) in chosen().zip(&multipliers) {
            let driven = g.mul(row.time, *multiplier);
            power = g.add(power, driven);
        }
        let mut pivots = elimination.mass_pivots.clone();
        pivots.extend(&elimination.row_pivots);
        let mut outputs = accelerations;
        outputs.extend(multipliers);
        outputs.extend(&joint.state_rates);
        outputs.push(power);
        outputs.extend(&pivots);
        let motion = Evaluator::new(&g, &outputs);

        let still = vec![g.constant(0.0); columns];
        let values: Vec<Node> = chosen().map(|row| row.value).collect();
        let right: Vec<Node> = values.iter().map(|value| g.neg(*value)).collect();
        let (mut outputs, _) = elimination.solve(&mut g, &still, &right);
        outputs.extend(values);
        outputs.extend(&pivots);
        let position = Evaluator::new(&g, &outputs);

        let mut right = Vec::with_capacity(rows.len());
        for row in chosen() {
            let mut rate = row.time;
            for (column, slope) in &row.jacobian {
                let velocity = g.input(joint.coordinates.velocity_slots[*column]);
                let part = g.mul(*slope, velocity);
                rate = g.add(rate, part);
            }
            right.push(g.neg(rate));
        }
        let (mut outputs, _) = elimination.solve(&mut g, &still, &right);
        outputs.extend(&pivots);
        let velocity = Evaluator::new(&g, &outputs);
        Self { motion, position, velocity, rows: rows.to_vec(), squares }
    }
}

/// The smallest pivot of a row at the end of the outputs of one of the programs of [`Unrolled`], as a share of the squared
/// length of the row; zero where the mass matrix is not positive definite or something is not a number.
fn pivot_ratio(outputs: &[f64], columns: usize, squares: &[f64]) -> f64 {
    let (mass, rows) = outputs[outputs.len() - columns - squares.len()..].split_at(columns);
    if mass.iter().any(|pivot| pivot.is_nan() || *pivot <= 0.0) {
        return 0.0;
    }
    let ratios = rows.iter().zip(squares).map(|(left, whole)| left / whole);
    ratios.fold(1.0, |least, ratio| if ratio >= least { least } else if ratio.is_nan() { 0.0 } else { ratio })
}

/// All rows by a rank-revealing factorisation.
struct Safe {
    /// Mass matrix, Jacobian, then gamma, time derivative and value of each row, loads, rates of states, power.
    terms: Evaluator,
    solver: DenseQr,
    structure: KktStructure,
    rows: Vec<usize>,
    accelerations: Vec<f64>,
    multipliers: Vec<f64>,
    right: Vec<f64>,
    still: Vec<f64>,
    health: Health,
}

/// What follows the Jacobian and gamma in [`Safe::terms`], per row.
#[derive(Clone, Copy)]
enum Function {
    Time = 1,
    Value,
}

impl Safe {
    /// `lengths` are those of the rows in the coordinates of bodies, in the metric of M^-1: what vanishes in the coordinates of
    /// joints is noticed.
    fn new(
        joint: &JointEquations,
        rows: &[usize],
        lengths: &[f64],
        tolerance: f64,
    ) -> Result<Self, AnalysisError> {
        let columns = joint.coordinates.columns;
        let mut nodes: Vec<Node> = joint.mass.iter().map(|(_, _, node)| *node).collect();
        let chosen = || rows.iter().map(|row| &joint.rows[*row]);
        nodes.extend(chosen().flat_map(|row| row.jacobian.iter().map(|(_, node)| *node)));
        nodes.extend(chosen().map(|row| row.gamma));
        nodes.extend(chosen().map(|row| row.time));
        nodes.extend(chosen().map(|row| row.value));
        nodes.extend(&joint.loads);
        nodes.extend(&joint.state_rates);
        nodes.push(joint.power);
        let mass = joint.mass.iter().map(|(row, column, _)| (*row, *column)).collect();
        let jacobian =
            chosen().enumerate().flat_map(|(k, row)| row.jacobian.iter().map(move |(column, _)| (k, *column))).collect();
        let structure = KktStructure::new(columns, rows.len(), mass, jacobian)?;
        let mut solver = DenseQr::new(&structure, tolerance)?;
        solver.set_row_lengths(lengths)?;
        Ok(Self {
            terms: Evaluator::new(&joint.graph, &nodes),
            solver,
            structure,
            rows: rows.to_vec(),
            accelerations: vec![0.0; columns],
            multipliers: vec![0.0; rows.len()],
            right: vec![0.0; rows.len()],
            still: vec![0.0; columns],
            health: Health { rank: 0, smallest_pivot_ratio: 0.0 },
        })
    }

    fn jacobian(&self) -> &[f64] {
        &self.terms.outputs()[self.structure.mass.len()..][..self.structure.jacobian.len()]
    }

    fn function(&self, function: Function) -> &[f64] {
        let m = self.rows.len();
        let from = self.structure.mass.len() + self.structure.jacobian.len() + function as usize * m;
        &self.terms.outputs()[from..from + m]
    }

    /// Loads; then rates of states and power.
    fn loads(&self) -> (&[f64], &[f64]) {
        let from = self.structure.mass.len() + self.structure.jacobian.len() + 3 * self.rows.len();
        self.terms.outputs()[from..].split_at(self.structure.n)
    }

    /// Evaluates and factors.
    fn factor(
        &mut self,
        inputs: &[f64],
        sets: &[Box<dyn ElementSet>],
        counters: &mut Counters,
    ) -> Result<Health, AnalysisError> {
        self.terms.run(inputs, sets)?;
        counters.factorisations += 1;
        let (mass, rest) = self.terms.outputs().split_at(self.structure.mass.len());
        self.solver.set_mass(mass)?;
        self.health = self.solver.refactor(&rest[..self.structure.jacobian.len()])?;
        Ok(self.health)
    }

    /// Accelerations and multipliers for a motion, or with `right` the smallest change that makes it.
    fn solve_motion(&mut self) -> Result<(), AnalysisError> {
        let from = self.structure.mass.len() + self.structure.jacobian.len();
        let m = self.rows.len();
        let outputs = self.terms.outputs();
        let loads = &outputs[from + 3 * m..from + 3 * m + self.structure.n];
        self.solver.solve(loads, &outputs[from..from + m], &mut self.accelerations, &mut self.multipliers)?;
        Ok(())
    }

    fn solve_correction(&mut self) -> Result<(), AnalysisError> {
        Ok(self.solver.solve(&self.still, &self.right, &mut self.accelerations, &mut self.multipliers)?)
    }
}

/// Which engine solved.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Used {
    Regular,
    Safe,
}

/// See the module documentation.
pub struct JointForm {
    layout: Layout,
    coordinates: Coordinates,
    groups: Vec<Group>,
    start: JointStart,
    /// The same scene in the coordinates of the bodies, for what is reported.
    bodies: WorkingForm,
    kinematics: Evaluator,
    body_state: Vec<f64>,
    inputs: Vec<f64>,
    regular: Option<Unrolled>,
    safe: Safe,
    /// The rows in use, for right sides of all kinds.
    direct: Safe,
    accelerations: Vec<f64>,
    /// Rates of the element states, then the power.
    rates: Vec<f64>,
    /// Size of the gradient of each row in use, 1 for rows in metres.
    row_sizes: Vec<f64>,
    row_names: Vec<String>,
    length: f64,
    /// Whether rows are left out of the regular engine's choice.
    choice: bool,
    least_health: f64,
    start_health: f64,
    /// Rank and pivot ratio of the rank-safe engine at the start.
    at_start: Health,
    /// Pivot ratio of the regular engine where velocities were corrected last.
    last_health: f64,
    corrected_safely: bool,
    careful: bool,
    keep_away: bool,
    stage: Vec<f64>,
    counters: Counters,
    /// The equations, for their derivatives.
    equations: JointEquations,
    derivatives: Derivatives,
}

/// The derivatives of the rates. They are written down when first asked for.
enum Derivatives {
    Unknown,
    Possible,
    Known(Box<Linearisation>),
}

/// What a joint formulation would consist of, for the choice of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JointSizes {
    /// Velocities.
    pub velocities: usize,
    /// Rows in use.
    pub rows: usize,
    /// Rows that hold wherever the joints are.
    pub met: usize,
    /// Operations per evaluation, the solution of the equations included.
    pub operations: usize,
}

impl JointForm {
    /// The tree for a model at its assembled position; `None` where the equations of motion can't be written on one: forces
    /// depend on accelerations or reactions.
    #[must_use]
    pub fn tree(equations: &Equations, model: &Model, working: &[f64], length: f64) -> Option<SpanningTree> {
        if !equations.coupling.is_empty() {
            return None;
        }
        let mut refused: Vec<usize> = Vec::new();
        loop {
            let tree = SpanningTree::new(model, |element| !refused.contains(&element));
            let found = JointStart::new(model, &tree, length).find(working);
            let failed = tree.joints.iter().zip(&found).filter(|(_, state)| state.is_none());
            let before = refused.len();
            refused.extend(failed.filter_map(|(joint, _)| joint.element));
            if refused.len() == before {
                return Some(tree);
            }
        }
    }

    /// Prepares programs and engines around the form in the coordinates of bodies, which holds the opaque elements.
    /// `working` is the assembled state at time `t`.
    ///
    /// # Errors
    /// When the linear algebra refuses the model.
    #[expect(clippy::too_many_arguments, reason = "called once, where everything is at hand")]
    pub fn new(
        equations: &Equations,
        model: &Model,
        plan: &Plan,
        tree: &SpanningTree,
        joint: JointEquations,
        bodies: WorkingForm,
        length: f64,
        (t, working): (f64, &[f64]),
    ) -> Result<Self, AnalysisError> {
        let layout = plan.layout.clone();
        let coordinates = joint.coordinates.clone();
        let mut inputs = vec![0.0; coordinates.input_count];
        inputs[Layout::TIME] = t;
        let mut form = Self {
            groups: groups(&coordinates, &layout),
            start: JointStart::new(model, tree, length),
            kinematics: Evaluator::new(&joint.graph, &body_nodes(&joint)),
            body_state: vec![0.0; BODY_STATES * layout.bodies + layout.states + 1],
            accelerations: vec![0.0; coordinates.columns],
            rates: vec![0.0; layout.states + 1],
            row_names: bodies.row_names().to_vec(),
            stage: vec![0.0; coordinates.motion + layout.states + 1],
            safe: Safe::new(&joint, &[], &[], RANK_TOLERANCE)?,
            direct: Safe::new(&joint, &[], &[], RANK_TOLERANCE)?,
            regular: None,
            row_sizes: Vec::new(),
            choice: false,
            least_health: SICK_TREE,
            start_health: 1.0,
            at_start: Health { rank: 0, smallest_pivot_ratio: 0.0 },
            last_health: 1.0,
            corrected_safely: false,
            careful: false,
            keep_away: false,
            counters: Counters::default(),
            derivatives: Derivatives::Possible,
            equations: joint,
            inputs,
            length,
            bodies,
            coordinates,
            layout,
        };
        let mut state = form.stage.clone();
        form.state_of(working, &mut state);
        form.move_bodies(t, &state)?;
        form.choose_rows(equations, model, &state)?;
        Ok(form)
    }

    /// Finds out which rows are needed, and which of them are independent at the start.
    fn choose_rows(
        &mut self,
        equations: &Equations,
        model: &Model,
        state: &[f64],
    ) -> Result<(), AnalysisError> {
        let joint = &self.equations;
        let candidates: Vec<usize> = (0..joint.rows.len()).filter(|row| !joint.rows[*row].jacobian.is_empty()).collect();
        let (sizes, lengths) = self.row_sizes(equations, model, &candidates)?;
        let mut probe = Safe::new(joint, &candidates, &lengths, RANK_TOLERANCE)?;
        let mut share = vec![0.0_f64; candidates.len()];
        for place in 0..=PROBES {
            let mut inputs = self.inputs.clone();
            for line in &self.coordinates.lines {
                let scale = if line.measure == Measure::Length { self.length } else { 1.0 };
                // Anywhere near the start, but the same at each call.
                let away = place as f64 * 0.1 * (1.0 + 3.0 * line.column as f64).sin();
                inputs[self.coordinates.slot_of(line.position)] = state[line.position] + scale * away;
            }
            probe.terms.run(&inputs, self.bodies.sets())?;
            let mut norms = vec![0.0_f64; candidates.len()];
            for ((row, column), slope) in probe.structure.jacobian.iter().zip(probe.jacobian()) {
                norms[*row] += (slope * self.column_scale(*column)).powi(2);
            }
            for (share, (norm, size)) in share.iter_mut().zip(norms.iter().zip(&sizes)) {
                *share = share.max(norm.sqrt() / size);
            }
        }
        let needed = |k: &usize| share[*k] > NO_GRADIENT || share[*k].is_nan();
        let kept: Vec<usize> = (0..candidates.len()).filter(needed).collect();
        let rows: Vec<usize> = kept.iter().map(|k| candidates[*k]).collect();
        self.row_sizes = kept.iter().map(|k| sizes[*k]).collect();
        let lengths: Vec<f64> = kept.iter().map(|k| lengths[*k]).collect();

        let mut at_start = Safe::new(joint, &rows, &lengths, RANK_TOLERANCE)?;
        let health = at_start.factor(&self.inputs, self.bodies.sets(), &mut Counters::default())?;
        let mut independent: Vec<usize> = at_start.solver.independent_rows().to_vec();
        independent.sort_unstable();
        self.choice = independent.len() < rows.len();
        self.at_start = health;
        self.safe = Safe::new(joint, &rows, &lengths, MOTION_RANK_TOLERANCE)?;
        self.safe.solver.set_rank_limit(health.rank);
        let chosen: Vec<usize> = independent.iter().map(|k| rows[*k]).collect();
        let lengths: Vec<f64> = independent.iter().map(|k| lengths[*k]).collect();
        let mut regular = Unrolled::new(joint, &chosen, lengths.iter().map(|length| length * length).collect());
        let outputs = regular.velocity.run(&self.inputs, self.bodies.sets())?.to_vec();
        self.start_health = pivot_ratio(&outputs, self.coordinates.columns, &regular.squares);
        // Rows close to dependent at the start are for the rank-safe engine throughout.
        if self.start_health >= LEAST_HEALTH {
            self.direct = Safe::new(joint, &regular.rows, &lengths, MOTION_RANK_TOLERANCE)?;
            self.regular = Some(regular);
        }
        self.least_health = if independent.is_empty() { SICK_TREE } else { self.start_health * SICK_SHARE };
        self.last_health = self.start_health;
        Ok(())
    }

    /// Lengths of the gradients of rows along the bodies' coordinates: with rotations taken on the scene's length, and in the
    /// metric of M^-1.
    fn row_sizes(
        &self,
        equations: &Equations,
        model: &Model,
        rows: &[usize],
    ) -> Result<(Vec<f64>, Vec<f64>), AnalysisError> {
        let mut constraints = Constraints::new(equations, model, rows, &[], &[])?;
        constraints.evaluate(&self.bodies_inputs(), self.bodies.sets())?;
        let mut gradients: Vec<Vec<(usize, f64)>> = vec![Vec::new(); rows.len()];
        for ((row, column), slope) in constraints.structure.jacobian.iter().zip(constraints.jacobian()) {
            gradients[*row].push((*column, *slope));
        }
        let length_or_one = |square: f64| if square > 0.0 { square.sqrt() } else { 1.0 };
        let size = |gradient: &Vec<(usize, f64)>| {
            let scale = |column: usize| if column % 6 < 3 { 1.0 } else { 1.0 / self.length };
            length_or_one(gradient.iter().map(|(column, slope)| (slope * scale(*column)).powi(2)).sum())
        };
        let metric = |gradient: &Vec<(usize, f64)>| {
            let along = |(column, slope): &(usize, f64)| {
                let body = &model.bodies[column / 6];
                // The inertia's own axes do not matter for a size.
                let inertia = if column % 6 < 3 { body.mass } else { body.inertia[(column % 6 - 3, column % 6 - 3)] };
                if inertia > 0.0 { slope * slope / inertia } else { 0.0 }
            };
            length_or_one(gradient.iter().map(along).sum())
        };
        Ok((gradients.iter().map(size).collect(), gradients.iter().map(metric).collect()))
    }

    /// One over the length that a unit of a velocity stands for.
    fn column_scale(&self, column: usize) -> f64 {
        let line = self.coordinates.lines.iter().find(|line| line.column == column);
        match line.map(|line| line.measure) {
            Some(Measure::Length) => 1.0,
            _ => 1.0 / self.length,
        }
    }

    /// Sizes, for the choice of a formulation.
    #[must_use]
    pub fn sizes(&self, tree: &SpanningTree) -> JointSizes {
        let of_tree = (0..self.layout.rows).filter(|row| tree.uses(self.layout.element_of_row(*row).0)).count();
        JointSizes {
            velocities: self.coordinates.columns,
            rows: self.regular.as_ref().map_or(self.safe.rows.len(), |regular| regular.rows.len()),
            met: self.layout.rows - of_tree - self.safe.rows.len(),
            operations: self.regular.as_ref().map_or(0, |regular| regular.motion.program().operations()),
        }
    }

    fn load(&mut self, t: f64, state: &[f64]) {
        self.inputs[Layout::TIME] = t;
        for (range, slot) in &self.coordinates.inputs {
            self.inputs[*slot..slot + range.len()].copy_from_slice(&state[range.clone()]);
        }
        let slot = self.layout.state_slot();
        let from = self.coordinates.motion;
        self.inputs[slot..slot + self.layout.states].copy_from_slice(&state[from..from + self.layout.states]);
    }

    /// Accelerations, rates of states and power at the inputs' state.
    fn solve_dynamics(&mut self) -> Result<Used, AnalysisError> {
        let columns = self.coordinates.columns;
        if let Some(regular) = self.regular.as_mut().filter(|_| !self.careful) {
            regular.motion.run(&self.inputs, self.bodies.sets())?;
            let outputs = regular.motion.outputs();
            if pivot_ratio(outputs, columns, &regular.squares) >= self.least_health {
                self.accelerations.copy_from_slice(&outputs[..columns]);
                let from = columns + regular.rows.len();
                self.rates.copy_from_slice(&outputs[from..from + self.layout.states + 1]);
                return Ok(Used::Regular);
            }
        }
        self.counters.rank_safe += u64::from(self.regular.is_some());
        self.safe.factor(&self.inputs, self.bodies.sets(), &mut self.counters)?;
        self.safe.solve_motion()?;
        self.accelerations.copy_from_slice(&self.safe.accelerations);
        self.rates.copy_from_slice(self.safe.loads().1);
        // Constraints that depend on time do work too: the power of -Phi_q^T lambda is lambda . Phi_t.
        let times = self.safe.function(Function::Time).iter();
        let driven: f64 = times.zip(&self.safe.multipliers).map(|(time, lambda)| time * lambda).sum();
        self.rates[self.layout.states] += driven;
        Ok(Used::Safe)
    }

    /// The smallest move (in the metric of the mass) that meets the rows to first order, left in `accelerations`. Gives the
    /// worst violation and its row.
    fn correct_positions(&mut self) -> Result<(f64, Option<usize>), AnalysisError> {
        let columns = self.coordinates.columns;
        if let Some(regular) = self.regular.as_mut().filter(|_| !self.careful) {
            regular.position.run(&self.inputs, self.bodies.sets())?;
            let outputs = regular.position.outputs();
            let worst = worst(&outputs[columns..columns + regular.rows.len()], &regular.rows, &self.safe.rows, &self.row_sizes);
            if worst.0 <= ROUND_OFF * self.length || !worst.0.is_finite() {
                return Ok(worst);
            }
            if pivot_ratio(outputs, columns, &regular.squares) >= self.least_health {
                self.accelerations.copy_from_slice(&outputs[..columns]);
                self.corrected_safely = false;
                return Ok(worst);
            }
        }
        self.corrected_safely = true;
        self.safe.factor(&self.inputs, self.bodies.sets(), &mut self.counters)?;
        let worst = worst(self.safe.function(Function::Value), &self.safe.rows, &self.safe.rows, &self.row_sizes);
        if !worst.0.is_finite() {
            return Ok(worst);
        }
        let mut right = std::mem::take(&mut self.safe.right);
        right.iter_mut().zip(self.safe.function(Function::Value)).for_each(|(x, value)| *x = -value);
        self.safe.right = right;
        self.safe.solve_correction()?;
        self.accelerations.copy_from_slice(&self.safe.accelerations);
        Ok(worst)
    }

    /// The smallest change of velocities that meets the rows, left in `accelerations`.
    fn correct_velocities(&mut self) -> Result<(), AnalysisError> {
        let columns = self.coordinates.columns;
        if let Some(regular) = self.regular.as_mut().filter(|_| !self.careful) {
            regular.velocity.run(&self.inputs, self.bodies.sets())?;
            let outputs = regular.velocity.outputs();
            self.last_health = pivot_ratio(outputs, columns, &regular.squares);
            if self.last_health >= self.least_health {
                self.accelerations.copy_from_slice(&outputs[..columns]);
                self.corrected_safely = false;
                return Ok(());
            }
        }
        self.corrected_safely = true;
        self.safe.factor(&self.inputs, self.bodies.sets(), &mut self.counters)?;
        let mut right = std::mem::take(&mut self.safe.right);
        right.copy_from_slice(self.safe.function(Function::Time));
        for ((row, column), slope) in self.safe.structure.jacobian.iter().zip(self.safe.jacobian()) {
            right[*row] += slope * self.inputs[self.coordinates.velocity_slots[*column]];
        }
        right.iter_mut().for_each(|x| *x = -*x);
        self.safe.right = right;
        self.safe.solve_correction()?;
        self.accelerations.copy_from_slice(&self.safe.accelerations);
        Ok(())
    }

    /// Newton's method on the positions.
    fn project_positions(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
        for _ in 0..MOST_CORRECTIONS {
            self.load(t, state);
            let (violation, row) = self.correct_positions()?;
            if !violation.is_finite() {
                return Err(AnalysisError::NotFinite { what: format!("constraint {}", self.row_name(row)) });
            }
            if violation <= ROUND_OFF * self.length {
                return Ok(());
            }
            self.counters.position_corrections += 1;
            let size = self.advance(state);
            // Quadratic convergence: the next violation is about size^2 / length.
            if (size / self.length).powi(2) <= ROUND_OFF {
                self.load(t, state);
                return Ok(());
            }
        }
        self.load(t, state);
        let (violation, row) = self.correct_positions()?;
        if violation > 1e-9 * self.length {
            let violation = violation / self.length;
            return Err(AnalysisError::LeftConstraints { what: self.row_name(row), violation });
        }
        Ok(())
    }

    /// Moves along the correction in `accelerations`; gives its size, m.
    fn advance(&self, state: &mut [f64]) -> f64 {
        let mut size = 0.0_f64;
        for line in &self.coordinates.lines {
            let step = self.accelerations[line.column];
            state[line.position] += step;
            let scale = if line.measure == Measure::Length { 1.0 } else { self.length };
            size = size.max(step.abs() * scale);
        }
        for rotation in &self.coordinates.rotations {
            let d = &self.accelerations[rotation.column..rotation.column + 3];
            let p = &mut state[rotation.position..rotation.position + 4];
            let rate = parameter_rates([p[0], p[1], p[2], p[3]], [d[0], d[1], d[2]]);
            p.iter_mut().zip(rate).for_each(|(e, step)| *e += step);
            normalise(p);
            size = d.iter().fold(size, |size, step| size.max(step.abs() * self.length));
        }
        size
    }

    fn is_singular(&self, share: f64) -> bool {
        let health = self.safe.health;
        health.rank < self.at_start.rank || health.smallest_pivot_ratio < share * self.at_start.smallest_pivot_ratio
    }

    fn row_name(&self, row: Option<usize>) -> String {
        row.and_then(|row| self.row_names.get(row)).cloned().unwrap_or_default()
    }

    /// The inputs of programs in the coordinates of bodies.
    fn bodies_inputs(&self) -> Vec<f64> {
        let mut inputs = self.inputs[..self.layout.inputs()].to_vec();
        for body in 0..self.layout.bodies {
            let (from, to) = (BODY_STATES * body, self.layout.body_slot(body, 0));
            inputs[to..to + BODY_STATES].copy_from_slice(&self.body_state[from..from + BODY_STATES]);
        }
        inputs
    }

    /// Accelerations and multipliers of the regular engine into the inputs.
    fn publish(&mut self) {
        let Some(regular) = &self.regular else { return };
        let slot = self.coordinates.acceleration_slot;
        self.inputs[slot..slot + self.accelerations.len()].copy_from_slice(&self.accelerations);
        let slot = self.layout.multiplier_slot();
        let multipliers = &regular.motion.outputs()[self.coordinates.columns..];
        for (row, value) in regular.rows.iter().zip(multipliers) {
            self.inputs[slot + row] = *value;
        }
    }

    /// The state of the bodies.
    fn move_bodies(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        self.load(t, state);
        let outputs = self.kinematics.run(&self.inputs, self.bodies.sets())?;
        for (body, found) in outputs.chunks_exact(18).enumerate() {
            let y = &mut self.body_state[BODY_STATES * body..BODY_STATES * (body + 1)];
            y[..3].copy_from_slice(&found[..3]);
            let mut p = parameters(&Matrix3::from_row_slice(&found[3..12]));
            // Of the two sets of parameters the one that goes on from the last.
            if p.iter().zip(&y[3..7]).map(|(new, old)| new * old).sum::<f64>() < 0.0 {
                p.iter_mut().for_each(|e| *e = -*e);
            }
            y[3..7].copy_from_slice(&p);
            normalise(&mut y[3..7]);
            y[7..13].copy_from_slice(&found[12..18]);
        }
        let from = BODY_STATES * self.layout.bodies;
        self.body_state[from..].copy_from_slice(&state[self.coordinates.motion..]);
        Ok(())
    }
}

/// The worst of the violations of rows in use, and which it is. `sizes` belong to `all`.
fn worst(values: &[f64], rows: &[usize], all: &[usize], sizes: &[f64]) -> (f64, Option<usize>) {
    let mut worst = (0.0, None);
    let mut at = 0;
    for (value, row) in values.iter().zip(rows) {
        // Both ascend.
        while all[at] != *row {
            at += 1;
        }
        let violation = value.abs() / sizes[at];
        if violation.is_nan() || violation > worst.0 {
            worst = (violation, Some(*row));
        }
    }
    worst
}

/// r, A, v, omega' of every body.
fn body_nodes(joint: &JointEquations) -> Vec<Node> {
    let of = |body: &crate::program::BodyNodes| {
        let mut nodes = body.r.to_vec();
        nodes.extend(body.a.iter().flatten());
        nodes.extend(body.v);
        nodes.extend(body.w);
        nodes
    };
    joint.bodies.iter().flat_map(of).collect()
}

fn groups(coordinates: &Coordinates, layout: &Layout) -> Vec<Group> {
    let mut groups = vec![Group::Parameter; coordinates.motion];
    for line in &coordinates.lines {
        let (position, velocity) = match line.measure {
            Measure::Length => (Group::Position, Group::Velocity),
            Measure::Angle => (Group::Parameter, Group::AngularVelocity),
        };
        groups[line.position] = position;
        groups[line.velocity] = velocity;
    }
    for rotation in &coordinates.rotations {
        groups[rotation.velocity..rotation.velocity + 3].fill(Group::AngularVelocity);
    }
    groups.extend(std::iter::repeat_n(Group::State, layout.states));
    groups.push(Group::Work);
    groups
}

impl Formulation for JointForm {
    fn name(&self) -> &'static str {
        if self.regular.is_some() { "joint" } else { "joint, rank-safe" }
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn state_of(&mut self, working: &[f64], state: &mut [f64]) {
        let (mut position, mut velocity) = (0, self.coordinates.motion - self.coordinates.columns);
        for joint in self.start.find(working) {
            // Joints whose coordinates can't be found are not in the tree; a state of another branch is caught by the audit.
            let JointState { positions, velocities } = joint.unwrap_or_default();
            state[position..position + positions.len()].copy_from_slice(&positions);
            state[velocity..velocity + velocities.len()].copy_from_slice(&velocities);
            position += positions.len();
            velocity += velocities.len();
        }
        state[self.coordinates.motion..].copy_from_slice(&working[BODY_STATES * self.layout.bodies..]);
    }

    fn set_discrete(&mut self, references: &[f64], discrete: &[f64]) {
        self.bodies.set_discrete(references, discrete);
        let slot = self.layout.reference_slot();
        self.inputs[slot..slot + references.len()].copy_from_slice(references);
        let slot = self.layout.discrete_slot();
        self.inputs[slot..slot + discrete.len()].copy_from_slice(discrete);
    }

    fn rates(&mut self, t: f64, state: &[f64], rates: &mut [f64]) -> Result<(), AnalysisError> {
        self.counters.evaluations += 1;
        let mut stage = std::mem::take(&mut self.stage);
        stage.copy_from_slice(state);
        let projected = if self.careful { self.project(t, &mut stage) } else { Ok(()) };
        self.counters.stage_projections += u64::from(self.careful);
        self.load(t, &stage);
        self.stage = stage;
        projected?;
        let used = self.solve_dynamics()?;
        if used == Used::Safe && self.keep_away && self.is_singular(TOO_NEAR) {
            return Err(AnalysisError::NextToSingular);
        }
        for line in &self.coordinates.lines {
            rates[line.position] = self.stage[line.velocity];
            rates[line.velocity] = self.accelerations[line.column];
        }
        for rotation in &self.coordinates.rotations {
            let p = &self.stage[rotation.position..rotation.position + 4];
            let w = &self.stage[rotation.velocity..rotation.velocity + 3];
            let turn = parameter_rates([p[0], p[1], p[2], p[3]], [w[0], w[1], w[2]]);
            rates[rotation.position..rotation.position + 4].copy_from_slice(&turn);
            let spin = &self.accelerations[rotation.column..rotation.column + 3];
            rates[rotation.velocity..rotation.velocity + 3].copy_from_slice(spin);
        }
        rates[self.coordinates.motion..].copy_from_slice(&self.rates);
        if rates.iter().all(|x| x.is_finite()) {
            return Ok(());
        }
        Err(AnalysisError::NotFinite { what: "an acceleration or the rate of a state".into() })
    }

    fn project(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
        for rotation in &self.coordinates.rotations {
            normalise(&mut state[rotation.position..rotation.position + 4]);
        }
        if self.safe.rows.is_empty() {
            return Ok(());
        }
        self.project_positions(t, state)?;
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

    fn is_near_singular(&self) -> bool {
        self.corrected_safely && self.is_singular(NEAR_SINGULAR)
    }

    fn next_step(&mut self, t: f64, state: &[f64], keep_away: bool) -> Result<(), AnalysisError> {
        self.keep_away = keep_away;
        if self.safe.rows.is_empty() {
            return Ok(());
        }
        self.load(t, state);
        let was_careful = std::mem::take(&mut self.careful);
        self.careful = match &mut self.regular {
            Some(regular) => {
                if was_careful {
                    // Positions were brought to the constraints without the regular engine.
                    let outputs = regular.velocity.run(&self.inputs, self.bodies.sets())?;
                    self.last_health = pivot_ratio(outputs, self.coordinates.columns, &regular.squares);
                }
                self.last_health < APPROACH * APPROACH * self.start_health
            }
            None => self.safe.rows.len() > self.at_start.rank,
        };
        if self.careful {
            // On the constraints the rank is what it is; a scene that starts in a singular position may gain some.
            self.safe.solver.set_rank_limit(usize::MAX);
            self.safe.factor(&self.inputs, self.bodies.sets(), &mut self.counters)?;
            self.at_start.rank = self.at_start.rank.max(self.safe.health.rank);
            self.safe.solver.set_rank_limit(self.at_start.rank);
            if !self.choice && !self.is_singular(APPROACH) && self.last_health > SICK_TREE {
                // All rows are in use and independent: the regular engine's ratio fell for other reasons.
                self.start_health = self.last_health;
                self.least_health = self.last_health * SICK_SHARE;
                self.careful = false;
            }
        }
        Ok(())
    }

    fn observe(&mut self, t: f64, state: &[f64], dynamics: bool) -> Result<Observed<'_>, AnalysisError> {
        self.move_bodies(t, state)?;
        self.bodies.observe(t, &self.body_state, dynamics)
    }

    fn jacobian(&mut self, t: f64, state: &[f64], matrix: &mut [f64]) -> Result<bool, AnalysisError> {
        let Some(regular) = self.regular.as_ref().filter(|_| !self.careful) else { return Ok(false) };
        if matches!(self.derivatives, Derivatives::Possible) {
            let terms = Terms::of_joints(&self.equations);
            let known = terms.and_then(|terms| Linearisation::new(&terms, &self.layout, &regular.rows));
            self.derivatives = known.map_or(Derivatives::Unknown, |known| Derivatives::Known(Box::new(known)));
        }
        if matches!(self.derivatives, Derivatives::Unknown) {
            return Ok(false);
        }
        self.load(t, state);
        if self.solve_dynamics()? != Used::Regular {
            return Ok(false);
        }
        self.publish();
        let (Some(regular), Derivatives::Known(known)) = (&self.regular, &mut self.derivatives) else { return Ok(false) };
        let solver = &mut self.direct;
        solver.factor(&self.inputs, self.bodies.sets(), &mut self.counters)?;
        let times: Vec<f64> = solver.function(Function::Time).to_vec();
        debug_assert_eq!(solver.rows, regular.rows);
        let mut solve = |loads: &[f64], gammas: &[f64], accelerations: &mut [f64], multipliers: &mut [f64]| {
            Ok(solver.solver.solve(loads, gammas, accelerations, multipliers)?)
        };
        known.fill(&self.inputs, self.bodies.sets(), state, &times, &mut solve, matrix)?;
        Ok(true)
    }

    fn programs(&mut self) -> Vec<Compiled<'_>> {
        let mut list = Vec::new();
        let spare = self.regular.is_some();
        if let Some(regular) = &mut self.regular {
            list.extend([regular.motion.used(false), regular.position.used(false), regular.velocity.used(false)]);
        }
        list.push(self.kinematics.used(false));
        list.push(self.safe.terms.used(spare));
        list.push(self.direct.terms.used(true));
        list.extend(self.bodies.programs());
        // Comes into being during the run, so it must be the last one.
        if let Derivatives::Known(known) = &mut self.derivatives {
            list.push(known.used());
        }
        list
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn sets_mut(&mut self) -> &mut [Box<dyn ElementSet>] {
        self.bodies.sets_mut()
    }

    fn sets(&self) -> &[Box<dyn ElementSet>] {
        self.bodies.sets()
    }
}
