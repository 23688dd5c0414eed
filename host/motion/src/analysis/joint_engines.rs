//! The two engines of [`super::JointForm`]: the equations of motion eliminated operation by operation, and a rank-revealing
//! factorisation of all rows.

use element_api::ElementSet;

use super::balance::{largest_share, solved};
use super::evaluator::Evaluator;
use super::formulation::{AnalysisError, Counters};
use crate::linalg::{DenseQr, Health, KktSolver, KktStructure};
use crate::plan::Measure;
use crate::program::{Articulated, Elimination, Graph, JointEquations, Node};

/// The equations of motion solved operation by operation.
pub(super) struct Unrolled {
    /// Accelerations, multipliers, rates of states, power; what [`Dependence`] has solved for with its slopes; then pivots.
    pub(super) motion: Evaluator,
    /// Correction of positions, values of the rows; then pivots.
    pub(super) position: Evaluator,
    /// Correction of velocities; then what [`Unrolled::look`] looks at: pivots with the magnitudes they are made of, and the
    /// pivots of the rows whatever the masses.
    pub(super) velocity: Evaluator,
    pub(super) rows: Vec<usize>,
    /// Squared lengths of the rows in the coordinates of bodies, in the metric of M^-1.
    pub(super) squares: Vec<f64>,
    /// The same with all bodies alike: squares of [`super::JointPlan::sizes`].
    square_sizes: Vec<f64>,
    /// Whether accelerations are solved for body by body.
    pub(super) by_bodies: bool,
}

/// Share of the best smallest pivot of a choice of rows from which on another choice is as good.
const SOUND_CHOICE: f64 = 0.3;

/// How accelerations are solved for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Solving {
    /// By whichever way takes fewer operations, counted.
    Fewest,
    /// By elimination of mass matrix and rows.
    Eliminated,
    /// Body by body, where there are no rows.
    Articulated,
}

/// What the pivots of the rows in use tell, next to each other in one position.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    /// As [`pivot_ratio`].
    pub(super) ratio: f64,
    /// The smallest share of a pivot in the magnitudes that it is made of: elimination is as inaccurate as round-off over this.
    pub(super) kept: f64,
    /// The smallest share of a row that is not in the span of those before it, squared, whatever the masses: zero where the rows
    /// are dependent.
    pub(super) independence: f64,
}

impl Unrolled {
    /// `squares` and `sizes` are those of the rows in the coordinates of bodies: squared lengths in the metric of M^-1, and
    /// lengths with rotations taken on `length`.
    pub(super) fn new(
        joint: &JointEquations,
        rows: &[usize],
        (squares, sizes): (Vec<f64>, &[f64]),
        length: f64,
        how: Solving,
    ) -> Self {
        let square_sizes = sizes.iter().map(|size| size * size).collect();
        let mut g = joint.graph.clone();
        let mut open = None;
        let tree = if rows.is_empty() && how != Solving::Eliminated { joint.articulated(&mut g) } else { None };
        if let Some(solved) = tree {
            if how == Solving::Articulated || joint.long_to_eliminate() {
                return Self::of_tree(joint, &mut g, solved);
            }
            open = Some(solved);
        }
        let chosen = || rows.iter().map(|row| &joint.rows[*row]);
        let jacobian = jacobian(joint, rows);
        let (elimination, (accelerations, multipliers)) = eliminate(joint, &mut g, rows, &jacobian);
        let mut pivots = elimination.mass_pivots.clone();
        pivots.extend(&elimination.row_pivots);
        if let Some(solved) = open {
            let rates = [&joint.state_rates[..], &[joint.power]].concat();
            let cost = |found: &[Node], pivots: &[Node]| g.live(&[found, &rates, pivots].concat()).len();
            if cost(&solved.accelerations, &solved.pivots) < cost(&accelerations, &pivots) {
                return Self::of_tree(joint, &mut g, solved);
            }
        }
        let outputs = motion_outputs(joint, &mut g, accelerations, (rows, multipliers), &pivots);
        let motion = Evaluator::condensed(&g, &outputs);

        let values: Vec<Node> = chosen().map(|row| row.value).collect();
        let mut outputs = position_correction(joint, &mut g, rows, &elimination);
        outputs.extend(values);
        outputs.extend(&pivots);
        let position = Evaluator::condensed(&g, &outputs);

        let mut outputs = velocity_correction(joint, &mut g, rows, &elimination);
        outputs.extend(&pivots);
        outputs.extend(&elimination.row_magnitudes);
        // With all bodies alike it is the rows alone that are eliminated.
        let scales = joint.coordinates.scales(length);
        let alike: Vec<(usize, usize, Node)> =
            scales.iter().enumerate().map(|(k, scale)| (k, k, g.constant(scale.powi(-2)))).collect();
        outputs.extend(&eliminated(joint, &mut g, &alike, rows, &jacobian).row_pivots);
        let velocity = Evaluator::condensed(&g, &outputs);
        Self { motion, position, velocity, rows: rows.to_vec(), squares, square_sizes, by_bodies: false }
    }

    /// A tree that no rows close, solved body by body, without a copy of its graph; `None` where coordinates follow others.
    pub(super) fn by_bodies(joint: &mut JointEquations) -> Option<Self> {
        let mut g = std::mem::take(&mut joint.graph);
        let before = g.len();
        let solved = joint.articulated(&mut g);
        let unrolled = solved.map(|solved| Self::of_tree(joint, &mut g, solved));
        g.cut(before);
        joint.graph = g;
        unrolled
    }

    /// Trees that no rows close: nothing is to be corrected, and nothing is solved for that.
    fn of_tree(joint: &JointEquations, g: &mut Graph, solved: Articulated) -> Self {
        let Articulated { accelerations, pivots } = solved;
        let outputs = motion_outputs(joint, g, accelerations, (&[], Vec::new()), &pivots);
        let motion = Evaluator::condensed(g, &outputs);
        let mut nothing = Graph::default();
        let mut outputs = vec![nothing.constant(0.0); joint.coordinates.columns];
        outputs.extend(vec![nothing.constant(1.0); joint.coordinates.columns]);
        let (position, velocity) = (Evaluator::new(&nothing, &outputs), Evaluator::new(&nothing, &outputs));
        let (rows, squares, square_sizes) = Default::default();
        Self { motion, position, velocity, rows, squares, square_sizes, by_bodies: true }
    }

    /// Squares of the gradients of the rows with all bodies alike.
    pub(super) fn square_sizes(&self) -> &[f64] {
        &self.square_sizes
    }

    /// The first of [`Unrolled::look`].
    pub(super) fn velocity_ratio(&self, columns: usize) -> f64 {
        let pivots = &self.velocity.outputs()[columns..][..columns + self.rows.len()];
        pivot_ratio(pivots, columns, &self.squares)
    }

    /// At the inputs that [`Unrolled::velocity`] was run for last.
    pub(super) fn look(&self, columns: usize) -> Look {
        let m = self.rows.len();
        let (pivots, others) = self.velocity.outputs()[columns..].split_at(columns + m);
        let (magnitudes, free) = others.split_at(others.len() - m);
        Look {
            ratio: pivot_ratio(pivots, columns, &self.squares),
            kept: pivot_ratio(pivots, columns, magnitudes),
            independence: pivot_ratio(free, 0, &self.square_sizes),
        }
    }
}

/// Accelerations, multipliers of the rows, rates of states and power as functions of state and time, as they are before they
/// are condensed: what [`Unrolled::motion`] computes first.
pub(super) fn motion_nodes(joint: &JointEquations, rows: &[usize], by_bodies: bool) -> (Graph, Vec<Node>) {
    let mut g = joint.graph.clone();
    let (accelerations, multipliers) = match if by_bodies { joint.articulated(&mut g) } else { None } {
        Some(solved) => (solved.accelerations, Vec::new()),
        None => eliminate(joint, &mut g, rows, &jacobian(joint, rows)).1,
    };
    let nodes = motion_outputs(joint, &mut g, accelerations, (rows, multipliers), &[]);
    (g, nodes)
}

/// The smallest move that meets rows to first order, then the smallest change of velocities that meets them.
pub(super) fn correction_nodes(joint: &JointEquations, rows: &[usize]) -> (Graph, [Vec<Node>; 2]) {
    let mut g = joint.graph.clone();
    let (elimination, _) = eliminate(joint, &mut g, rows, &jacobian(joint, rows));
    let position = position_correction(joint, &mut g, rows, &elimination);
    let velocity = velocity_correction(joint, &mut g, rows, &elimination);
    (g, [position, velocity])
}

fn position_correction(joint: &JointEquations, g: &mut Graph, rows: &[usize], elimination: &Elimination) -> Vec<Node> {
    let still = vec![g.constant(0.0); joint.coordinates.columns];
    let right: Vec<Node> = rows.iter().map(|row| g.neg(joint.rows[*row].value)).collect();
    elimination.solve(g, &still, &right).0
}

fn velocity_correction(joint: &JointEquations, g: &mut Graph, rows: &[usize], elimination: &Elimination) -> Vec<Node> {
    let still = vec![g.constant(0.0); joint.coordinates.columns];
    let mut right = Vec::with_capacity(rows.len());
    for row in rows.iter().map(|row| &joint.rows[*row]) {
        let mut rate = row.time;
        for (column, slope) in &row.jacobian {
            let velocity = g.input(joint.coordinates.velocity_slots[*column]);
            let part = g.mul(*slope, velocity);
            rate = g.add(rate, part);
        }
        right.push(g.neg(rate));
    }
    elimination.solve(g, &still, &right).0
}

/// The rows' derivatives along the coordinates.
fn jacobian(joint: &JointEquations, rows: &[usize]) -> Vec<Vec<(usize, Node)>> {
    rows.iter().map(|row| joint.rows[*row].jacobian.clone()).collect()
}

/// A mass matrix and rows eliminated.
fn eliminated(
    joint: &JointEquations,
    g: &mut Graph,
    mass: &[(usize, usize, Node)],
    rows: &[usize],
    jacobian: &[Vec<(usize, Node)>],
) -> Elimination {
    let is_blind = |row: usize, column: usize| joint.is_blind(rows[row], column);
    Elimination::with_blind_rows(g, joint.coordinates.columns, mass, jacobian, is_blind)
}

/// Mass matrix and rows eliminated; then accelerations and multipliers.
fn eliminate(
    joint: &JointEquations,
    g: &mut Graph,
    rows: &[usize],
    jacobian: &[Vec<(usize, Node)>],
) -> (Elimination, (Vec<Node>, Vec<Node>)) {
    let elimination = eliminated(joint, g, &joint.mass, rows, jacobian);
    let gammas: Vec<Node> = rows.iter().map(|row| joint.rows[*row].gamma).collect();
    let solution = elimination.solve(g, &joint.loads, &gammas);
    (elimination, solution)
}

/// The outputs of [`Unrolled::motion`].
fn motion_outputs(
    joint: &JointEquations,
    g: &mut Graph,
    accelerations: Vec<Node>,
    (rows, multipliers): (&[usize], Vec<Node>),
    pivots: &[Node],
) -> Vec<Node> {
    let dependence = joint.dependence.as_ref();
    let dependent = dependence.map(|found| found.write(g, joint, &accelerations, (rows, &multipliers)));
    let (state_rates, mut power) = match &dependent {
        Some(found) => (&found.state_rates, found.power),
        None => (&joint.state_rates, joint.power),
    };
    for (row, multiplier) in rows.iter().zip(&multipliers) {
        let driven = g.mul(joint.rows[*row].time, *multiplier);
        power = g.add(power, driven);
    }
    let mut outputs = accelerations;
    outputs.extend(multipliers);
    outputs.extend(state_rates);
    outputs.push(power);
    outputs.extend(dependent.iter().flat_map(|found| found.solved.iter().chain(&found.slopes)));
    outputs.extend(pivots);
    outputs
}

/// The smallest pivot of a row at the end of the outputs of one of the programs of [`Unrolled`], as a share of the squared
/// length of the row; zero where the mass matrix is not positive definite or something is not a number.
pub(super) fn pivot_ratio(outputs: &[f64], columns: usize, squares: &[f64]) -> f64 {
    let (mass, rows) = outputs[outputs.len() - columns - squares.len()..].split_at(columns);
    // Without ways out, several at a time. What is no number is not positive.
    if !mass.iter().fold(true, |sound, pivot| sound & (*pivot > 0.0)) {
        return 0.0;
    }
    let ratios = rows.iter().zip(squares).map(|(left, whole)| left / whole);
    let (least, sound) = ratios.fold((1.0, true), |(least, sound), ratio| {
        (if ratio < least { ratio } else { least }, sound & !ratio.is_nan())
    });
    if sound { least } else { 0.0 }
}

/// All rows by a rank-revealing factorisation.
pub(super) struct Safe {
    /// Mass matrix, Jacobian, then gamma, time derivative and value of each row, loads, rates of states, power.
    pub(super) terms: Evaluator,
    pub(super) solver: DenseQr,
    pub(super) structure: KktStructure,
    pub(super) rows: Vec<usize>,
    pub(super) accelerations: Vec<f64>,
    pub(super) multipliers: Vec<f64>,
    pub(super) right: Vec<f64>,
    pub(super) still: Vec<f64>,
    pub(super) health: Health,
    /// Forces, or torques: which kind of balance each column has.
    kinds: Vec<usize>,
    /// Length of the scene, m.
    length: f64,
    /// What a solution leaves of the equations of motion, and what these are made of.
    left: [Vec<f64>; 2],
}

/// What follows the Jacobian in [`Safe::terms`], per row.
#[derive(Clone, Copy)]
pub(super) enum Function {
    Gamma,
    Time,
    Value,
}

impl Safe {
    /// `sizes` are those of the rows in the coordinates of bodies, rotations taken on `length`: what vanishes in the coordinates
    /// of joints is noticed.
    pub(super) fn new(
        joint: &JointEquations,
        rows: &[usize],
        sizes: &[f64],
        length: f64,
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
        let jacobian = chosen()
            .enumerate()
            .flat_map(|(k, row)| row.jacobian.iter().map(move |(column, _)| (k, *column)))
            .collect();
        let structure = KktStructure::new(columns, rows.len(), mass, jacobian)?;
        let solver = solver(joint, &structure, sizes, length, tolerance)?;
        Ok(Self {
            terms: Evaluator::new(&joint.graph, &nodes),
            solver,
            structure,
            rows: rows.to_vec(),
            accelerations: vec![0.0; columns],
            multipliers: vec![0.0; rows.len()],
            right: vec![0.0; rows.len()],
            still: vec![0.0; columns],
            kinds: joint.coordinates.measures().iter().map(|measure| usize::from(*measure == Measure::Angle)).collect(),
            length,
            left: [vec![0.0; columns], vec![0.0; columns]],
            health: Health { rank: 0, smallest_pivot_ratio: 0.0 },
        })
    }

    /// The same before its first factorisation, with another tolerance.
    pub(super) fn anew(self, joint: &JointEquations, sizes: &[f64], tolerance: f64) -> Result<Self, AnalysisError> {
        let solver = solver(joint, &self.structure, sizes, self.length, tolerance)?;
        Ok(Self { solver, health: Health { rank: 0, smallest_pivot_ratio: 0.0 }, ..self })
    }

    pub(super) fn mass(&self) -> &[f64] {
        &self.terms.outputs()[..self.structure.mass.len()]
    }

    pub(super) fn jacobian(&self) -> &[f64] {
        &self.terms.outputs()[self.structure.mass.len()..][..self.structure.jacobian.len()]
    }

    pub(super) fn function(&self, function: Function) -> &[f64] {
        let m = self.rows.len();
        let from = self.structure.mass.len() + self.structure.jacobian.len() + function as usize * m;
        &self.terms.outputs()[from..from + m]
    }

    /// Loads; then rates of states and power.
    pub(super) fn loads(&self) -> (&[f64], &[f64]) {
        let from = self.structure.mass.len() + self.structure.jacobian.len() + 3 * self.rows.len();
        self.terms.outputs()[from..].split_at(self.structure.n)
    }

    /// Evaluates and factors.
    pub(super) fn factor(
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

    /// Where factored last, as many independent rows as there are: those that elimination in the metric of M^-1 goes best with, in
    /// which the rows have these lengths in the coordinates of bodies; the most independent ones where masses would keep rows that
    /// are close to dependent.
    pub(super) fn rows_to_keep(&mut self, lengths: &[f64]) -> Result<Vec<usize>, AnalysisError> {
        let best = self.solver.independent_rows().to_vec();
        if best.len() == self.rows.len() {
            return Ok(best);
        }
        let (mass, rest) = self.terms.outputs().split_at(self.structure.mass.len());
        let jacobian = &rest[..self.structure.jacobian.len()];
        let mut by_mass = DenseQr::new(&self.structure, 0.0)?;
        by_mass.set_row_lengths(lengths)?;
        by_mass.set_rank_limit(best.len());
        by_mass.set_mass(mass)?;
        by_mass.refactor(jacobian)?;
        let found = by_mass.independent_rows().to_vec();
        self.solver.set_first_rows(&found)?;
        let health = self.solver.refactor(jacobian)?;
        let kept = health.smallest_pivot_ratio >= SOUND_CHOICE * self.health.smallest_pivot_ratio
            && found.iter().all(|row| self.solver.independent_rows().contains(row));
        Ok(if kept { found } else { best })
    }

    /// Accelerations and multipliers for a motion, or with `right` the smallest change that makes it.
    pub(super) fn solve_motion(&mut self) -> Result<(), AnalysisError> {
        let from = self.structure.mass.len() + self.structure.jacobian.len();
        let m = self.rows.len();
        let outputs = self.terms.outputs();
        let loads = &outputs[from + 3 * m..from + 3 * m + self.structure.n];
        self.solver.solve(loads, &outputs[from..from + m], &mut self.accelerations, &mut self.multipliers)?;
        Ok(())
    }

    /// Refuses the motion solved for where its equations do not hold.
    ///
    /// # Errors
    /// [`AnalysisError::Uncertified`].
    pub(super) fn accept(&mut self) -> Result<(), AnalysisError> {
        let mut out = std::mem::take(&mut self.left);
        let [left, sizes] = &mut out;
        let solution = (&self.accelerations[..], &self.multipliers[..]);
        self.structure.residual_of_motion((self.mass(), self.jacobian()), self.loads().0, solution, [left, sizes]);
        let share = largest_share(left, sizes, self.length, |column| self.kinds[column]);
        self.left = out;
        solved(share)
    }

    pub(super) fn solve_correction(&mut self) -> Result<(), AnalysisError> {
        Ok(self.solver.solve(&self.still, &self.right, &mut self.accelerations, &mut self.multipliers)?)
    }
}

/// The solver of [`Safe`], before its first factorisation.
fn solver(
    joint: &JointEquations,
    structure: &KktStructure,
    sizes: &[f64],
    length: f64,
    tolerance: f64,
) -> Result<DenseQr, AnalysisError> {
    let mut solver = DenseQr::new(structure, tolerance)?;
    solver.set_measure(&joint.coordinates.scales(length))?;
    solver.set_row_lengths(sizes)?;
    Ok(solver)
}
