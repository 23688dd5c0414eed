//! [`JointEquations`]: the equations of motion in the coordinates of joints.
//!
//! Bodies hang on the joints of a spanning tree; each joint gives the pose of its second frame in its first for its own
//! coordinates q. So positions, rotations and velocities of all bodies are functions of q and q', and with the partial
//! velocities T (Kane) per body, [v; omega'] = T u and [v'; omega''] = T u' + b,
//!
//! sum T^T M T u' + (Phi_q T)^T lambda = sum T^T (Q - M b),   (Phi_q T) u' = gamma - Phi_q b
//!
//! with M, Q, Phi_q, gamma of the working form. Where Q depends on [v'; omega''] by the inertia of elements, it is linear in u' with
//! them, and what u' is multiplied with goes over into the mass matrix. The rows of the tree's joints hold by themselves; those of all
//! other joints stay. Operations on what folds to a constant vanish: of planar mechanisms nothing spatial is left, and rows that hold
//! wherever the tree is have no derivative and are dropped.

mod folded;
mod writer;

use std::collections::BTreeMap;
use std::sync::OnceLock;

use element_api::recording::{Input, Role};
use odyn_graph::{
    Expr, Graph, M3, Node, Program, Rewriting, Seeds, V3, Workspace, derivatives, derivatives_along_each, import,
};
use rustc_hash::FxHashMap;

use self::folded::folded;
use self::writer::Writer;
use super::articulated::{Articulated, articulated};
use super::coupling::Dependence;
use super::equations::{Equations, Form, Row};
use super::kinematics::{BodyNodes, entries, rotation_nodes};
use super::projection::{Projecting, composite_loads, composite_mass, project};
use super::spatial::{FAR, Limb, limbs, references};
use super::turned_rows::turn_rows;
use crate::model::{Marker, Model, rotation};
use crate::plan::{Coordinates, Layout, Measure, SpanningTree, TreeJoint};

/// See the module documentation.
pub struct JointEquations {
    /// All operations.
    pub graph: Graph,
    /// Where coordinates lie.
    pub coordinates: Coordinates,
    /// Rotation matrices of [`Coordinates::rotations`].
    pub rotations: Vec<M3>,
    /// Positions, rotations and velocities of the bodies.
    pub bodies: Vec<BodyNodes>,
    /// Lower triangle of the mass matrix: (row, column, node), by columns, then rows; entries that vanish are left out.
    /// Not numbers, on the diagonal only, until [`JointEquations::write_mass`] where that is for later.
    pub mass: Vec<(usize, usize, Node)>,
    /// Whether the mass matrix is written.
    mass_is_written: bool,
    /// The rows of the scene; those of the tree's joints are empty.
    pub rows: Vec<Row>,
    /// Right side of the equations of motion, one per velocity.
    pub loads: Vec<Node>,
    /// Rates of the continuous element states.
    pub state_rates: Vec<Node>,
    /// Power of everything that has no potential, without that of constraints, W.
    pub power: Node,
    /// Nodes that all of the above depend on, themselves included.
    pub size: usize,
    /// The bodies at their references, in the tree's order; `None` where coordinates follow others.
    limbs: Option<Vec<Limb>>,
    /// Loads on the bodies, six each, as functions of the joints' coordinates.
    pub(super) body_loads: Vec<Node>,
    /// Derivatives of the rows that close loops along the coordinates of bodies: (column, node).
    pub(super) row_slopes: Vec<Vec<(usize, Node)>>,
    /// Velocities that move all that a row is about together, by row, ascending.
    pub(super) common: Vec<Vec<usize>>,
    /// Whether some of these rows are in ground axes, see [`JointEquations::build_turned`].
    pub(super) turned: bool,
    /// Accelerations of bodies and multipliers that loads, rates of states or power depend on.
    pub dependence: Option<Dependence>,
    /// Whether the mass matrix has the inertia of elements, which loads depended on accelerations by.
    pub has_inertia: bool,
}

/// Twelve numbers that tell how a body moves with one velocity: along (ground axes) and about (body axes).
#[derive(Debug, Clone, Copy)]
pub(super) struct Partial {
    pub(super) column: usize,
    pub(super) along: V3,
    pub(super) about: V3,
}

/// A body on its tree.
#[derive(Clone)]
pub(super) struct Carried {
    pub(super) nodes: BodyNodes,
    /// From the tree's first reference point to the centre of mass.
    whole: V3,
    /// From the body's reference point to the centre of mass.
    pub(super) d: V3,
    /// From the reference point of the body before to the body's, where they differ.
    pub(super) shift: Option<V3>,
    /// Angular velocity, ground axes.
    spin: V3,
    /// Of the centre of mass: those of the body before, then those of its own joint. None where nothing asks for them.
    pub(super) partials: Vec<Partial>,
    /// Those of its own joint, at the origin of the joint's second frame.
    pub(super) own: Vec<Partial>,
    /// From the reference point to that origin.
    pub(super) at_joint: V3,
    /// Acceleration of the centre of mass with all u' zero, ground axes.
    pub(super) bias: V3,
    /// Angular acceleration with all u' zero, body axes.
    pub(super) spin_bias: V3,
    /// The same, ground axes.
    spin_bias_ground: V3,
    /// The tree's first reference point.
    reference: V3,
}

impl JointEquations {
    /// Writes the equations of motion of the working form in the coordinates of a tree.
    #[must_use]
    pub fn build(cartesian: &Equations, model: &Model, layout: &Layout, tree: &SpanningTree) -> Self {
        Self::build_by(cartesian, model, layout, tree, Projecting::Fewest)
    }

    /// The same with rows that are a vector in the axes of a frame taken in ground axes instead, which is shorter; `None`
    /// where there are none. Their multipliers are in ground axes, too.
    #[must_use]
    pub fn build_turned(cartesian: &Equations, model: &Model, layout: &Layout, tree: &SpanningTree) -> Option<Self> {
        // What depends on multipliers takes them in the axes that their rows are written in.
        if tree.closes_no_loop(layout) || cartesian.needs_solution() {
            return None;
        }
        let mut turned = Equations { of_rows: OnceLock::new(), ..cartesian.clone() };
        let any = turn_rows(&mut turned, model, layout, tree) > 0;
        any.then(|| Self { turned: true, ..Self::build_by(&turned, model, layout, tree, Projecting::Fewest) })
    }

    /// The same with mass matrix and right side written in a given way.
    #[must_use]
    pub fn build_by(
        cartesian: &Equations,
        model: &Model,
        layout: &Layout,
        tree: &SpanningTree,
        how: Projecting,
    ) -> Self {
        Self::build_about(cartesian, model, layout, tree, how, FAR)
    }

    /// The same with references as [`references`] chooses them for `far`.
    pub(crate) fn build_about(
        cartesian: &Equations,
        model: &Model,
        layout: &Layout,
        tree: &SpanningTree,
        how: Projecting,
        far: f64,
    ) -> Self {
        let measures: Vec<(Vec<Measure>, bool)> =
            tree.joints.iter().map(|joint| (measures(model, joint), joint.rotates)).collect();
        let coordinates = Coordinates::of_joints(&measures, layout);
        let used = tree.used(model.elements.len());
        let of_tree = |row: usize| used[layout.element_of_row(row).0];
        // Trees that no rows close are solved body by body where elimination would take long.
        let short =
            !(tree.closes_no_loop(layout) && how == Projecting::Fewest && elimination_of(tree) > LONG_ELIMINATION);
        let mut writer = Writer::new(coordinates, model, short);
        for (joint, anew) in tree.joints.iter().zip(references(model, tree, far)) {
            writer.hang(joint, model, anew);
        }
        let bodies: Vec<Carried> = writer.carried.into_iter().flatten().collect();
        let (mut g, coordinates, rotations) = (writer.g, writer.coordinates, writer.rotations);
        let mut replaced: FxHashMap<Node, Node> = FxHashMap::default();
        for (old, new) in cartesian.bodies.iter().zip(&bodies) {
            replaced.extend(old.r.into_iter().zip(new.nodes.r));
            replaced.extend(entries(&old.a).zip(entries(&new.nodes.a)));
            replaced.extend(old.v.into_iter().zip(new.nodes.v));
            replaced.extend(old.w.into_iter().zip(new.nodes.w));
        }
        let has_inertia = short && tree.followers.is_empty() && cartesian.is_coupling_inertia(layout);
        let rates: Vec<Node> = match has_inertia {
            true => (0..coordinates.columns).map(|column| g.input(coordinates.acceleration_slot + column)).collect(),
            false => Vec::new(),
        };
        if has_inertia {
            replaced.extend(accelerations_in_joints(&mut g, cartesian, &bodies, &rates, layout));
        }
        let mut rewriting = Rewriting::new(&cartesian.graph, &mut g, replaced);
        let zero = g.constant(0.0);
        let mut rows = Vec::with_capacity(cartesian.rows.len());
        let mut row_slopes = Vec::with_capacity(cartesian.rows.len());
        let mut common = Vec::with_capacity(cartesian.rows.len());
        for (number, row) in cartesian.rows.iter().enumerate() {
            let slopes = row.jacobian.iter().filter(|_| !of_tree(number));
            row_slopes.push(slopes.map(|(column, slope)| (*column, rewriting.carry(&mut g, *slope))).collect());
            let markers = &model.elements[layout.element_of_row(number).0].markers;
            common.push(if of_tree(number) { Vec::new() } else { common_velocities(markers, &bodies) });
            rows.push(match of_tree(number) {
                true => Row { value: zero, time: zero, gamma: zero, jacobian: Vec::new(), of_velocities: false },
                false => row_in_joints(&mut g, &mut rewriting, row, &bodies),
            });
        }
        let body_loads = rewriting.carry_all(&mut g, &cartesian.loads);
        let state_rates = rewriting.carry_all(&mut g, &cartesian.state_rates);
        let power = rewriting.carry(&mut g, cartesian.power);
        let limbs = limbs(&mut g, model, tree, &bodies, &body_loads);
        let mut shared = state_rates.clone();
        shared.push(power);
        for row in &rows {
            shared.push(row.gamma);
            shared.extend(row.jacobian.iter().map(|(_, slope)| *slope));
        }
        let (mut mass, mut loads) = match short {
            true => project(&mut g, model, &bodies, &limbs, &body_loads, &shared, how),
            false => {
                let missing = g.constant(f64::NAN);
                let mass = (0..coordinates.columns).map(|column| (column, column, missing)).collect();
                (mass, composite_loads(&mut g, &limbs, coordinates.columns))
            }
        };
        if has_inertia {
            move_inertia(&mut g, &mut mass, &mut loads, &rates);
        }
        shared.extend(mass.iter().map(|(_, _, node)| *node));
        shared.extend(&loads);
        let size = g.live(&shared).len();
        let bodies = bodies.into_iter().map(|body| body.nodes).collect();
        let all = Self {
            graph: g,
            mass_is_written: short,
            coordinates,
            rotations,
            bodies,
            mass,
            rows,
            loads,
            state_rates,
            power,
            size,
            // Accelerations body by body do not know of it.
            limbs: (!has_inertia).then_some(limbs),
            body_loads,
            row_slopes,
            common,
            turned: false,
            dependence: None,
            has_inertia,
        };
        if tree.followers.is_empty() { all } else { folded(all, tree, &measures, layout) }
    }

    /// Whether the mass matrix is written. Of large trees that no rows close it is not, since accelerations are found body by
    /// body: it would take the square of their number of operations.
    #[must_use]
    pub fn mass_is_written(&self) -> bool {
        self.mass_is_written
    }

    /// Writes the mass matrix, unless it is written.
    pub fn write_mass(&mut self) {
        if let Some(limbs) = self.limbs.as_ref().filter(|_| !self.mass_is_written) {
            self.mass = composite_mass(&mut self.graph, limbs);
            self.mass_is_written = true;
            self.size += self.mass.len();
        }
    }

    /// Whether elimination of the mass matrix from the tips inwards takes so long that it is not even tried where bodies can
    /// be taken one by one. There is no fill: a velocity meets those it has entries with.
    #[must_use]
    pub fn long_to_eliminate(&self) -> bool {
        let mut entries = vec![0; self.coordinates.columns];
        self.mass.iter().for_each(|(row, ..)| entries[*row] += 1);
        !self.mass_is_written || entries.iter().map(|met: &usize| met * met).sum::<usize>() > LONG_ELIMINATION
    }

    /// Whether a velocity changes nothing that a row constrains wherever the row holds: it moves all bodies of its joint together.
    #[must_use]
    pub fn is_blind(&self, row: usize, column: usize) -> bool {
        self.common[row].binary_search(&column).is_ok()
    }

    /// Accelerations body by body, for trees that no rows close; `None` where coordinates follow others. `g` is
    /// [`JointEquations::graph`] or a copy of it.
    #[must_use]
    pub fn articulated(&self, g: &mut Graph) -> Option<Articulated> {
        Some(articulated(g, self.limbs.as_ref()?, self.coordinates.columns))
    }
}

/// What the accelerations that loads depend on are in the coordinates of joints, whose own are `rates`: T u' + b.
fn accelerations_in_joints(
    g: &mut Graph,
    cartesian: &Equations,
    bodies: &[Carried],
    rates: &[Node],
    layout: &Layout,
) -> Vec<(Node, Node)> {
    let mut found = Vec::new();
    for node in cartesian.graph.live(&cartesian.loads) {
        let Expr::Input(slot) = cartesian.graph.expr(node) else { continue };
        let Some(at) = (slot as usize).checked_sub(layout.acceleration_slot()) else { continue };
        let (body, k) = (&bodies[at / 6], at % 6);
        let of = |along: V3, about: V3| if k < 3 { along[k] } else { about[k - 3] };
        let mut sum = of(body.bias, body.spin_bias);
        for partial in &body.partials {
            let part = g.mul(of(partial.along, partial.about), rates[partial.column]);
            sum = g.add(sum, part);
        }
        found.push((node, sum));
    }
    found
}

/// Moves what loads are by accelerations over to the mass matrix.
fn move_inertia(g: &mut Graph, mass: &mut Vec<(usize, usize, Node)>, loads: &mut Vec<Node>, rates: &[Node]) {
    let mut entries: BTreeMap<(usize, usize), Node> =
        mass.iter().map(|(row, column, node)| ((*column, *row), *node)).collect();
    for (column, slopes) in derivatives_along_each(g, loads, rates).into_iter().enumerate() {
        for (row, slope) in slopes.into_iter().enumerate().skip(column) {
            let before = entries.get(&(column, row)).copied().unwrap_or_else(|| g.constant(0.0));
            entries.insert((column, row), g.sub(before, slope));
        }
    }
    *mass = entries.into_iter().map(|((column, row), node)| (row, column, node)).collect();
    mass.retain(|(_, _, node)| !g.is_zero(*node));
    let zero = g.constant(0.0);
    let whole = g.clone();
    let still = rates.iter().map(|rate| (*rate, zero)).collect();
    *loads = Rewriting::new(&whole, g, still).carry_all(g, loads);
}

/// Velocities, ascending, that all bodies of these markers move with; none where one of them is on the ground.
fn common_velocities(markers: &[Marker], bodies: &[Carried]) -> Vec<usize> {
    let moving = |marker: &Marker| marker.body.map(|body| bodies[body].partials.iter().map(|partial| partial.column));
    let mut all = markers.iter().map(moving);
    let Some(Some(first)) = all.next() else { return Vec::new() };
    let mut common: Vec<usize> = first.collect();
    common.sort_unstable();
    for one in all {
        let Some(one) = one else { return Vec::new() };
        let own: Vec<usize> = one.collect();
        common.retain(|column| own.contains(column));
    }
    common
}

/// Operations of an elimination beyond which it is not even tried where bodies can be taken one by one.
const LONG_ELIMINATION: usize = 100_000;

/// As [`JointEquations::long_to_eliminate`] counts, before anything is written: all velocities on the way to the ground meet.
fn elimination_of(tree: &SpanningTree) -> usize {
    let bodies = tree.joints.iter().map(|joint| joint.child + 1).max().unwrap_or(0);
    let (mut path, mut operations) = (vec![0_usize; bodies], 0);
    for joint in &tree.joints {
        let before = joint.parent.map_or(0, |parent| path[parent]);
        path[joint.child] = before + joint.coordinates + 3 * usize::from(joint.rotates);
        operations += (before + 1..=path[joint.child]).map(|met| met * met).sum::<usize>();
    }
    operations
}

/// What the coordinates of a tree joint are: a length where the pose does not turn with it.
fn measures(model: &Model, joint: &TreeJoint) -> Vec<Measure> {
    let Some(element) = joint.element else { return vec![Measure::Length; joint.coordinates] };
    let mut g = Graph::default();
    let q: Vec<Node> = (0..joint.coordinates).map(|k| g.input(k)).collect();
    let pose = pose_nodes(&mut g, model, element, &q);
    let turn: Vec<Node> = entries(&pose.1).collect();
    let measure = |at: &Node| {
        let one = g.constant(1.0);
        let slopes = derivatives(&mut g, &turn, &Seeds::from_iter([(*at, one)]));
        if slopes.iter().all(|slope| g.is_zero(*slope)) { Measure::Length } else { Measure::Angle }
    };
    q.iter().map(measure).collect()
}

/// The pose of a joint's second frame in its first.
pub(super) fn pose_nodes(g: &mut Graph, model: &Model, element: usize, q: &[Node]) -> (V3, M3) {
    let recording = &model.elements[element].recording;
    let provide = |g: &mut Graph, input: Input| match input {
        Input::Coordinate(k) => q[k as usize],
        _ => g.constant(0.0),
    };
    let nodes = import(g, recording, provide);
    let missing = g.constant(f64::NAN);
    let (mut position, mut turn) = ([missing; 3], [[missing; 3]; 3]);
    for output in &recording.outputs {
        let node = nodes[output.node as usize];
        match output.role {
            Role::PosePosition(k) => position[k as usize] = node,
            Role::PoseRotation(k) => turn[k as usize / 3][k as usize % 3] = node,
            _ => {}
        }
    }
    (position, turn)
}

/// A row of the working form in joint coordinates.
fn row_in_joints(g: &mut Graph, rewriting: &mut Rewriting<'_>, row: &Row, bodies: &[Carried]) -> Row {
    let value = rewriting.carry(g, row.value);
    let time = rewriting.carry(g, row.time);
    let mut gamma = rewriting.carry(g, row.gamma);
    let mut slopes: FxHashMap<usize, Node> = FxHashMap::default();
    for (column, slope) in &row.jacobian {
        let slope = rewriting.carry(g, *slope);
        let (body, k) = (&bodies[column / 6], column % 6);
        let of = |along: V3, about: V3| if k < 3 { along[k] } else { about[k - 3] };
        let part = g.mul(slope, of(body.bias, body.spin_bias));
        gamma = g.sub(gamma, part);
        for partial in &body.partials {
            let part = g.mul(slope, of(partial.along, partial.about));
            let sum = slopes.get(&partial.column).copied();
            let sum = sum.map_or(part, |sum| g.add(sum, part));
            slopes.insert(partial.column, sum);
        }
    }
    let mut jacobian: Vec<(usize, Node)> = slopes.into_iter().filter(|(_, slope)| !g.is_zero(*slope)).collect();
    jacobian.sort_unstable_by_key(|(column, _)| *column);
    Row { value, time, gamma, jacobian, of_velocities: row.of_velocities }
}

/// The pose of a joint as a program of its own, with its derivatives.
pub struct JointPose {
    program: Program,
    workspace: Workspace,
    outputs: Vec<f64>,
}

impl JointPose {
    /// The pose that an element's mobility with so many coordinates gives.
    #[must_use]
    pub fn new(model: &Model, element: usize, coordinates: usize) -> Self {
        let mut g = Graph::default();
        let q: Vec<Node> = (0..coordinates).map(|k| g.input(k)).collect();
        let (position, turn) = pose_nodes(&mut g, model, element, &q);
        let values: Vec<Node> = position.into_iter().chain(entries(&turn)).collect();
        let mut nodes = values.clone();
        let one = g.constant(1.0);
        for at in &q {
            nodes.extend(derivatives(&mut g, &values, &Seeds::from_iter([(*at, one)])));
        }
        let program = Program::compile(&g, &nodes);
        Self { workspace: program.workspace(), outputs: vec![0.0; nodes.len()], program }
    }

    /// Whether the coordinates are two displacements and a turn in the x-y plane of the first frame, all that there are.
    pub fn is_of_a_plane(&mut self) -> bool {
        [[0.0_f64; 3], [0.3, -0.2, 0.7]].iter().all(|q| {
            let (sine, cosine) = q[2].sin_cos();
            let pose = [q[0], q[1], 0.0, cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0];
            let mut along = [[0.0; 12]; 2];
            (along[0][0], along[1][1]) = (1.0, 1.0);
            let turned = [0.0, 0.0, 0.0, -sine, -cosine, 0.0, cosine, -sine, 0.0, 0.0, 0.0, 0.0];
            let expected = pose.iter().chain(along.iter().flatten()).chain(&turned);
            let found = self.at(q);
            found.len() == 48 && found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-14)
        })
    }

    /// Position (3) and rotation (9, by rows) at `q`, then their derivatives along each coordinate, twelve each.
    pub fn at(&mut self, q: &[f64]) -> &[f64] {
        // Mobilities are recorded, so that there are no calls that could fail.
        let _ = self.program.run(q, &[], &mut self.workspace, &mut self.outputs);
        &self.outputs
    }
}
