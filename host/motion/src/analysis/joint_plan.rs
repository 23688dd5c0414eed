//! [`JointPlan`]: the equations of motion in the coordinates of joints, and which of their rows are needed.

use super::assembly::{Assembly, start_inputs};
use super::constraints::{Constraints, mass_entries, mass_values};
use super::followers::followers;
use super::formulation::{AnalysisError, Counters};
use super::joint_engines::{Look, Safe, Solving, Unrolled, pivot_ratio};
use super::joint_start::JointStart;
use super::overshadowed::overshadowed;
use crate::linalg::Health;
use crate::model::Model;
use crate::plan::{Layout, Measure, SpanningTree};
use crate::program::{Dependence, Equations, JointEquations, JointPose, Program, Working};

/// Share of its gradient along the bodies' own coordinates below which the gradient of a row along the joints' is round-off:
/// the row holds wherever the joints are.
const NO_GRADIENT: f64 = 1e-11;
/// Places where that is looked at, besides the start.
const PROBES: usize = 3;
/// Share of the largest pivot below which a row counts as dependent at the start.
const RANK_TOLERANCE: f64 = 1e-9;
/// Below this pivot ratio at the start, elimination without pivoting is not trusted with a scene at all.
pub(super) const LEAST_HEALTH: f64 = 1e-8;

/// What becomes of coordinates that follow others wherever the mechanism is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Folding {
    /// The rows that they make up for are solved with.
    Never,
    /// They are written out, and those rows hold by themselves.
    WherePossible,
    /// The same, if no row is left to be solved with; otherwise there is no plan.
    Wholly,
}

/// See the module documentation.
pub struct JointPlan {
    /// The tree.
    pub tree: SpanningTree,
    /// The equations.
    pub equations: JointEquations,
    /// Rows that close loops.
    pub rows: Vec<usize>,
    /// Rows beyond those of the tree's joints that hold wherever the joints are.
    pub met: Vec<usize>,
    /// Which of [`JointPlan::rows`] are independent at the start, as places in that list.
    pub independent: Vec<usize>,
    /// The equations with the independent rows, solved.
    pub(super) regular: Unrolled,
    /// Gradients of [`JointPlan::rows`] along the bodies' coordinates, rotations taken on the scene's length.
    pub(super) sizes: Vec<f64>,
    /// Rank and pivot ratio of the rank-revealing factorisation at the start.
    pub(super) at_start: Health,
    /// All rows at the start, where they were looked at.
    pub(super) all: Option<Safe>,
    /// From bodies to the coordinates of the tree.
    pub(super) places: JointStart,
    /// The elimination at the start.
    pub(super) start: Look,
    pub(super) length: f64,
}

impl JointPlan {
    /// The tree for a model at its assembled position; `None` where something might turn a particle.
    #[must_use]
    pub fn tree(equations: &Equations, model: &Model, assembly: &Assembly) -> Option<SpanningTree> {
        if turns_particles(equations, model) {
            return None;
        }
        let mut refused: Vec<usize> = Vec::new();
        if equations.may_need_solution() {
            // Their reactions are found only where the coordinates make up for all rows.
            let tree = SpanningTree::new(model, |_| true);
            refused.extend(tree.joints.iter().filter_map(|joint| {
                let rows = model.elements[joint.element?].rows.len();
                (rows + joint.coordinates + 3 * usize::from(joint.rotates) != 6).then_some(joint.element?)
            }));
        }
        loop {
            let mut tree = SpanningTree::new(model, |element| !refused.contains(&element));
            centre(&mut tree, model);
            let mut start = JointStart::new(model, &tree, assembly.scales.length);
            let found = start.find(&assembly.working);
            let failed = tree.joints.iter().zip(&found).filter(|(_, state)| state.is_none());
            let before = refused.len();
            refused.extend(failed.filter_map(|(joint, _)| joint.element));
            if refused.len() == before && !equations.may_need_solution() {
                refused.extend(overshadowed(model, &tree, &mut start, &assembly.working));
            }
            if refused.len() == before {
                return Some(tree);
            }
        }
    }

    /// The right side, the solution of the equations included.
    #[must_use]
    pub fn program(&self) -> &Program {
        self.regular.motion.program()
    }

    /// Whether accelerations are solved for body by body, not by elimination of the mass matrix.
    #[must_use]
    pub fn solves_by_bodies(&self) -> bool {
        self.regular.by_bodies
    }

    /// Leaves no choice of rows: all stay in use, and the rank-safe engine solves throughout.
    pub fn use_all_rows(&mut self) {
        // A large tree that no rows close has none to choose from.
        if self.equations.mass_is_written() {
            self.start.kept = 0.0;
        }
    }

    /// Writes the equations on a tree and finds out which rows are needed, and which of them are independent, at the
    /// assembled position at time `t`. `None` where forces or states depend on what the coordinates of joints do not tell: on Euler
    /// parameters, or on accelerations or reactions that are not found along the tree; or as [`Folding::Wholly`] says.
    ///
    /// # Errors
    /// When the linear algebra refuses the model, or an opaque element fails.
    pub fn new(
        equations: &Equations,
        model: &Model,
        layout: &Layout,
        mut tree: SpanningTree,
        (assembly, t): (&Assembly, f64),
        folding: Folding,
    ) -> Result<Option<Self>, AnalysisError> {
        let write = |tree: &SpanningTree| Chosen::best(equations, model, (layout, tree), assembly, t);
        let Some(mut chosen) = write(&tree)? else { return Ok(None) };
        // Reactions that forces depend on are those of rows that are solved for.
        let folds = folding != Folding::Never;
        if folds && !equations.switches_rows() && !chosen.rows.is_empty() && !equations.needs_solution() {
            let Chosen { equations: joint, rows, sizes, inputs, length, .. } = &chosen;
            tree.followers = followers(joint, (layout, &model.sets), (rows, sizes), inputs, *length)?;
            if !tree.followers.is_empty() {
                let Some(folded) = write(&tree)? else { return Ok(None) };
                chosen = folded;
            }
        }
        if folding == Folding::Wholly && !chosen.rows.is_empty() {
            return Ok(None);
        }
        chosen.plan(model, layout, tree).map(Some)
    }
}

/// Equations in joint coordinates, with the rows that are needed.
struct Chosen {
    equations: JointEquations,
    /// As [`Equations::enforced`].
    enforced: Vec<usize>,
    /// The inputs of their programs at the start.
    inputs: Vec<f64>,
    rows: Vec<usize>,
    independent: Vec<usize>,
    /// As [`JointPlan::sizes`].
    sizes: Vec<f64>,
    /// The gradients' lengths in the metric of M^-1.
    lengths: Vec<f64>,
    at_start: Health,
    /// All rows at the start, where they are looked at.
    all: Option<Safe>,
    /// As [`JointPlan::places`].
    places: JointStart,
    /// Accelerations body by body, where nothing else is written.
    regular: Option<Unrolled>,
    length: f64,
}

impl Chosen {
    /// In the axes in which fewer rows are needed; `None` as for [`JointPlan::new`].
    fn best(
        equations: &Equations,
        model: &Model,
        (layout, tree): (&Layout, &SpanningTree),
        assembly: &Assembly,
        t: f64,
    ) -> Result<Option<Self>, AnalysisError> {
        let choose = |joint: JointEquations| Self::new(equations, joint, model, (layout, tree), assembly, t);
        let plain = || JointEquations::build(equations, model, layout, tree);
        // Whichever contacts are closed, the coordinates and their axes are the same.
        let may_turn = !equations.switches_rows();
        let turned = if may_turn { JointEquations::build_turned(equations, model, layout, tree) } else { None };
        let was_turned = turned.is_some();
        let mut joint = turned.unwrap_or_else(plain);
        if joint.take_parameters(layout) {
            return Ok(None);
        }
        if equations.needs_solution() && !joint.has_inertia {
            let mass = mass_entries(&mass_values(model));
            let working = Working { equations, layout, mass: &mass };
            joint.dependence = Dependence::new(&joint, &working, tree, assembly.scales.length);
            if joint.dependence.is_none() {
                return Ok(None);
            }
        }
        let mut chosen = choose(joint)?;
        if was_turned && chosen.independent.len() < chosen.rows.len() {
            // A frame's axes may lie in the plane that a loop moves in where the ground's do not: then more rows hold by
            // themselves.
            let other = choose(plain())?;
            if other.rows.len() < chosen.rows.len() {
                chosen = other;
            }
        }
        Ok(Some(chosen))
    }

    fn new(
        equations: &Equations,
        mut joint: JointEquations,
        model: &Model,
        (layout, tree): (&Layout, &SpanningTree),
        assembly: &Assembly,
        t: f64,
    ) -> Result<Self, AnalysisError> {
        let length = assembly.scales.length;
        let mut places = JointStart::new(model, tree, length);
        let inputs = inputs_at_start(&joint, &mut places, layout, assembly, t);
        let by_bodies = if joint.mass_is_written() { None } else { Unrolled::by_bodies(&mut joint) };
        let mut chosen = Self {
            equations: joint,
            enforced: equations.enforced().collect(),
            inputs,
            rows: Vec::new(),
            independent: Vec::new(),
            sizes: Vec::new(),
            lengths: Vec::new(),
            at_start: Health { rank: 0, smallest_pivot_ratio: 1.0 },
            all: None,
            places,
            regular: None,
            length,
        };
        if let Some(mut regular) = by_bodies {
            let outputs = regular.motion.run(&chosen.inputs, &model.sets)?;
            let columns = chosen.equations.coordinates.columns;
            if pivot_ratio(outputs, columns, &regular.squares) >= LEAST_HEALTH {
                chosen.regular = Some(regular);
                return Ok(chosen);
            }
        }
        // If it is for later, that is now.
        chosen.equations.write_mass();
        chosen.choose_rows(equations, model, &start_inputs(layout, t, assembly))?;
        Ok(chosen)
    }

    /// Which rows are needed, and which of them are independent; `start` are the inputs at the start in coordinates of bodies.
    fn choose_rows(&mut self, equations: &Equations, model: &Model, start: &[f64]) -> Result<(), AnalysisError> {
        let (joint, length) = (&self.equations, self.length);
        let closes = |row: &usize| !joint.rows[*row].jacobian.is_empty();
        let candidates: Vec<usize> = self.enforced.iter().copied().filter(closes).collect();
        let (sizes, lengths) = gradients(equations, model, &candidates, start, length)?;
        let mut all = Safe::new(joint, &candidates, &sizes, length, RANK_TOLERANCE)?;
        let share = shares(&mut all, joint, model, &sizes, &self.inputs, length)?;
        let needed = |k: &usize| share[*k] > NO_GRADIENT || share[*k].is_nan();
        let kept: Vec<usize> = (0..candidates.len()).filter(needed).collect();
        self.rows = kept.iter().map(|k| candidates[*k]).collect();
        self.sizes = kept.iter().map(|k| sizes[*k]).collect();
        self.lengths = kept.iter().map(|k| lengths[*k]).collect();
        if self.rows.len() < candidates.len() {
            all = Safe::new(joint, &self.rows, &self.sizes, length, RANK_TOLERANCE)?;
        }
        self.at_start = all.factor(&self.inputs, &model.sets, &mut Counters::default())?;
        self.independent = all.rows_to_keep(&self.lengths)?;
        self.independent.sort_unstable();
        self.all = Some(all);
        Ok(())
    }

    /// The plan, with the equations of the independent rows solved.
    fn plan(self, model: &Model, layout: &Layout, tree: SpanningTree) -> Result<JointPlan, AnalysisError> {
        let eliminated = || {
            let chosen: Vec<usize> = self.independent.iter().map(|k| self.rows[*k]).collect();
            let squares = self.independent.iter().map(|k| self.lengths[*k] * self.lengths[*k]).collect();
            let sizes: Vec<f64> = self.independent.iter().map(|k| self.sizes[*k]).collect();
            Unrolled::new(&self.equations, &chosen, (squares, &sizes), self.length, Solving::Fewest)
        };
        let mut regular = self.regular.unwrap_or_else(eliminated);
        let columns = self.equations.coordinates.columns;
        let start = if regular.by_bodies {
            // Where nothing is to be corrected, the pivots are those of the motion.
            let outputs = regular.motion.run(&self.inputs, &model.sets)?;
            let ratio = pivot_ratio(outputs, columns, &regular.squares);
            Look { ratio, kept: ratio, independence: 1.0 }
        } else {
            regular.velocity.run(&self.inputs, &model.sets)?;
            regular.look(columns)
        };
        let used = tree.used(model.elements.len());
        let of_tree = |row: usize| used[layout.element_of_row(row).0];
        let is_met = |row: &usize| !of_tree(*row) && !self.rows.contains(row);
        Ok(JointPlan {
            met: self.enforced.iter().copied().filter(is_met).collect(),
            regular,
            start,
            at_start: self.at_start,
            all: self.all,
            places: self.places,
            independent: self.independent,
            sizes: self.sizes,
            rows: self.rows,
            length: self.length,
            equations: self.equations,
            tree,
        })
    }
}

/// Lets joints of all displacements in a plane follow the centres of mass of the bodies on their second frames.
fn centre(tree: &mut SpanningTree, model: &Model) {
    for joint in tree.joints.iter_mut().filter(|joint| joint.coordinates == 3 && !joint.rotates && !joint.reversed) {
        let Some(element) = joint.element else { continue };
        let marker = &model.elements[element].markers[1];
        let is_beside = marker.position.cross(&marker.rotation.column(2)).norm() > 0.0;
        joint.centred = is_beside && JointPose::new(model, element, 3).is_of_a_plane();
    }
}

/// Whether a row or a force acts on the rotation of a body that has none.
fn turns_particles(equations: &Equations, model: &Model) -> bool {
    let particle = |body: usize| model.bodies[body].particle;
    let by_row =
        |row: &crate::program::Row| row.jacobian.iter().any(|(column, _)| column % 6 >= 3 && particle(column / 6));
    let by_force = model.elements.iter().zip(equations.elements.iter()).any(|(element, found)| {
        element.markers.iter().zip(&found.loads).any(|(marker, load)| {
            let zero = |nodes: &[crate::program::Node; 3]| nodes.iter().all(|node| equations.graph.is_zero(*node));
            let off_centre = marker.position.amax() > 0.0 && !zero(&load.force);
            marker.body.is_some_and(particle) && (off_centre || !zero(&load.torque))
        })
    });
    equations.rows.iter().any(by_row) || by_force
}

/// The inputs of programs in the coordinates of joints.
fn inputs_at_start(
    joint: &JointEquations,
    places: &mut JointStart,
    layout: &Layout,
    assembly: &Assembly,
    t: f64,
) -> Vec<f64> {
    let coordinates = &joint.coordinates;
    let mut inputs = start_inputs(layout, t, assembly);
    inputs.resize(coordinates.input_count, 0.0);
    let found = places.find(&assembly.working);
    let (mut position, mut velocity) = (0, coordinates.motion - coordinates.columns);
    for state in found.into_iter().map(Option::unwrap_or_default) {
        for (at, values) in [(&mut position, state.positions), (&mut velocity, state.velocities)] {
            for value in values {
                inputs[coordinates.slot_of(*at)] = value;
                *at += 1;
            }
        }
    }
    inputs
}

/// Lengths of the gradients of rows (ascending) along the bodies' coordinates: with rotations taken on the scene's length, and in the
/// metric of M^-1.
fn gradients(
    equations: &Equations,
    model: &Model,
    rows: &[usize],
    inputs: &[f64],
    length: f64,
) -> Result<(Vec<f64>, Vec<f64>), AnalysisError> {
    let mut constraints = Constraints::of_all(equations)?;
    constraints.evaluate(inputs, &model.sets)?;
    let all = constraints.rows.len();
    let (mut sizes, mut lengths) = (vec![0.0_f64; all], vec![0.0_f64; all]);
    for ((row, column), slope) in constraints.structure.jacobian.iter().zip(constraints.jacobian()) {
        let (body, k) = (&model.bodies[column / 6], column % 6);
        sizes[*row] += if k < 3 { slope * slope } else { (slope / length).powi(2) };
        // The inertia's own axes do not matter for a size.
        let inertia = if k < 3 { body.mass } else { body.inertia[(k - 3, k - 3)] };
        lengths[*row] += if inertia > 0.0 { slope * slope / inertia } else { 0.0 };
    }
    let root = |square: f64| if square > 0.0 { square.sqrt() } else { 1.0 };
    let wanted = |row: &usize| rows.binary_search(row).is_ok();
    let of_wanted = |squares: &[f64]| {
        let squares = constraints.rows.iter().zip(squares).filter(|(row, _)| wanted(row));
        squares.map(|(_, square)| root(*square)).collect()
    };
    Ok((of_wanted(&sizes), of_wanted(&lengths)))
}

/// The largest share of its gradient along the bodies' coordinates that each row of `probe` has along the joints', at the start and at
/// some places around it.
fn shares(
    probe: &mut Safe,
    joint: &JointEquations,
    model: &Model,
    sizes: &[f64],
    start: &[f64],
    length: f64,
) -> Result<Vec<f64>, AnalysisError> {
    let coordinates = &joint.coordinates;
    let scales = coordinates.scales(length);
    let mut shares = vec![0.0_f64; sizes.len()];
    for place in 0..=PROBES {
        let mut inputs = start.to_vec();
        for line in &coordinates.lines {
            // Anywhere near the start, but the same at each call.
            let away = place as f64 * 0.1 * (1.0 + 3.0 * line.column as f64).sin();
            let size = if line.measure == Measure::Length { length } else { 1.0 };
            inputs[coordinates.slot_of(line.position)] += away * size;
        }
        probe.terms.run(&inputs, &model.sets)?;
        let mut squares = vec![0.0_f64; sizes.len()];
        for ((row, column), slope) in probe.structure.jacobian.iter().zip(probe.jacobian()) {
            squares[*row] += (slope * scales[*column]).powi(2);
        }
        for (share, (square, size)) in shares.iter_mut().zip(squares.iter().zip(sizes)) {
            *share = share.max(square.sqrt() / size);
        }
    }
    Ok(shares)
}
