//! [`Limb`]: a body of a tree as six numbers see it.
//!
//! Motions, momenta and loads of all bodies of a tree are taken at one point, its reference, in ground axes (Featherstone,
//! Rigid Body Dynamics Algorithms, 2008, ch. 2): so they add without being carried over. Angular parts come first. This holds
//! for an instant, so the point may itself move.

use super::graph::{Graph, Node};
use super::joint::Carried;
use super::vector::{M3, V3};
use crate::model::{Body, Model};
use crate::plan::SpanningTree;

/// Angular, then linear.
pub(super) type V6 = [Node; 6];
/// Rows of six.
pub(super) type M6 = [V6; 6];

/// A body, hung on its joint.
pub(super) struct Limb {
    /// The limb that carries it; `None`: the ground. It comes before.
    pub(super) parent: Option<usize>,
    /// The joint's own velocities: number, and how the body moves with it, rad/s and m/s (of the point of the body that is at
    /// the reference) per unit.
    pub(super) columns: Vec<(usize, V6)>,
    /// Inertia about the reference: kg m2, kg m, kg.
    pub(super) inertia: M6,
    /// What drives the body while all joints keep their velocities: applied loads less the inertia of that motion; moment
    /// about the reference, N m, then force, N.
    pub(super) load: V6,
}

/// The bodies of a tree in its order, for loads on their centres of mass (force in ground axes, moment in body axes).
pub(super) fn limbs(
    g: &mut Graph,
    model: &Model,
    tree: &SpanningTree,
    bodies: &[Carried],
    body_loads: &[Node],
) -> Vec<Limb> {
    let place = |body: usize| tree.joints.iter().position(|joint| joint.child == body);
    let mut list = Vec::with_capacity(tree.joints.len());
    for joint in &tree.joints {
        let (body, carried) = (&model.bodies[joint.child], &bodies[joint.child]);
        let mut columns = Vec::with_capacity(carried.own.len());
        for partial in &carried.own {
            let axis = g.apply(&carried.nodes.a, partial.about);
            let swept = g.cross(axis, carried.at_joint);
            let along = g.sub3(partial.along, swept);
            columns.push((partial.column, six(axis, along)));
        }
        let loads = &body_loads[6 * joint.child..6 * joint.child + 6];
        list.push(Limb {
            parent: joint.parent.and_then(place),
            columns,
            inertia: inertia(g, body, carried),
            load: load(g, body, carried, loads),
        });
    }
    list
}

fn six(angular: V3, linear: V3) -> V6 {
    [angular[0], angular[1], angular[2], linear[0], linear[1], linear[2]]
}

/// Applied loads less inertia, at the reference.
fn load(g: &mut Graph, body: &Body, carried: &Carried, loads: &[Node]) -> V6 {
    let mass = g.constant(body.mass);
    let carry = g.scale3(mass, carried.bias);
    let force = g.sub3([loads[0], loads[1], loads[2]], carry);
    let lever = g.cross(carried.d, force);
    if body.particle {
        return six(lever, force);
    }
    let matrix = g.matrix(&body.inertia);
    let turn = g.apply(&matrix, carried.spin_bias);
    let moment = g.sub3([loads[3], loads[4], loads[5]], turn);
    let moment = g.apply(&carried.nodes.a, moment);
    six(g.add3(moment, lever), force)
}

/// The inertia of a body about the reference (Featherstone, eq. 2.63).
fn inertia(g: &mut Graph, body: &Body, carried: &Carried) -> M6 {
    let zero = g.constant(0.0);
    let mass = g.constant(body.mass);
    let d = carried.d;
    let first = g.scale3(mass, d);
    let squares: V3 = std::array::from_fn(|k| g.mul(first[k], d[k]));
    let mut second = if body.particle { [[zero; 3]; 3] } else { turned(g, body, &carried.nodes.a) };
    for i in 0..3 {
        let others = g.add(squares[(i + 1) % 3], squares[(i + 2) % 3]);
        second[i][i] = g.add(second[i][i], others);
        for j in 0..i {
            let product = g.mul(first[i], d[j]);
            second[i][j] = g.sub(second[i][j], product);
            second[j][i] = second[i][j];
        }
    }
    let mut whole = [[zero; 6]; 6];
    for i in 0..3 {
        whole[i][..3].copy_from_slice(&second[i]);
        whole[3 + i][3 + i] = mass;
        // The matrix of the first moment: linear momentum is m v + omega x h.
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let negative = g.neg(first[i]);
        for (row, column, entry) in [(k, j, first[i]), (j, k, negative)] {
            whole[row][3 + column] = entry;
            whole[3 + column][row] = entry;
        }
    }
    whole
}

/// The inertia about the centre of mass in ground axes, A J' A^T. Along body axes it is a sphere's and what is left along the
/// axes that differ from it.
fn turned(g: &mut Graph, body: &Body, a: &M3) -> M3 {
    let zero = g.constant(0.0);
    let m = &body.inertia;
    if m[(0, 1)] != 0.0 || m[(0, 2)] != 0.0 || m[(1, 2)] != 0.0 {
        let matrix = g.matrix(m);
        let half = g.product(a, &matrix);
        let mut whole = [[zero; 3]; 3];
        for i in 0..3 {
            for j in 0..=i {
                whole[i][j] = g.dot3(half[i], a[j]);
                whole[j][i] = whole[i][j];
            }
        }
        return whole;
    }
    let sphere = if m[(0, 0)] == m[(1, 1)] { m[(0, 0)] } else { m[(2, 2)] };
    let mut whole = [[zero; 3]; 3];
    for (i, row) in whole.iter_mut().enumerate() {
        row[i] = g.constant(sphere);
    }
    for axis in (0..3).filter(|k| m[(*k, *k)] != sphere) {
        let excess = g.constant(m[(axis, axis)] - sphere);
        for i in 0..3 {
            let scaled = g.mul(excess, a[i][axis]);
            for j in 0..=i {
                let part = g.mul(scaled, a[j][axis]);
                whole[i][j] = g.add(whole[i][j], part);
                whole[j][i] = whole[i][j];
            }
        }
    }
    whole
}

impl Graph {
    /// a + b
    pub(super) fn add6(&mut self, a: V6, b: V6) -> V6 {
        std::array::from_fn(|k| self.add(a[k], b[k]))
    }

    /// a . b
    pub(super) fn dot6(&mut self, a: V6, b: V6) -> Node {
        let left = self.dot3([a[0], a[1], a[2]], [b[0], b[1], b[2]]);
        let right = self.dot3([a[3], a[4], a[5]], [b[3], b[4], b[5]]);
        self.add(left, right)
    }

    /// M a
    pub(super) fn apply6(&mut self, m: &M6, a: V6) -> V6 {
        std::array::from_fn(|i| self.dot6(m[i], a))
    }

    /// M + N, both symmetric
    pub(super) fn add_symmetric(&mut self, m: &M6, n: &M6) -> M6 {
        let mut sum = *m;
        for i in 0..6 {
            for j in 0..=i {
                sum[i][j] = self.add(m[i][j], n[i][j]);
                sum[j][i] = sum[i][j];
            }
        }
        sum
    }
}
