//! [`Limb`]: a body of a tree as six numbers see it.
//!
//! Motions, momenta and loads of the bodies of a tree are taken at one point, their reference, in ground axes (Featherstone,
//! Rigid Body Dynamics Algorithms, 2008, ch. 2): so they add without being carried over. Angular parts come first. This holds
//! for an instant, so the point may itself move.
//!
//! About a point at n times its own size, an inertia is n^2 times the one that counts, and as much of it is round-off. So
//! bodies far out take a reference of their own, the origin of their joint; [`references`] says which.

use nalgebra::Vector3;
use odyn_graph::{Graph, M3, M6, Node, V3, V6};

use super::joint::Carried;
use crate::model::{Body, Marker, Model, rotation};
use crate::plan::SpanningTree;

/// A body, hung on its joint.
pub(super) struct Limb {
    /// The limb that carries it; `None`: the ground. It comes before.
    pub(super) parent: Option<usize>,
    /// The joint's own velocities: number, and how the body moves with it, rad/s and m/s (of the point of the body that is at
    /// the reference) per unit.
    pub(super) columns: Vec<(usize, V6)>,
    /// From the reference of the limb that carries it to its own, where they differ.
    shift: Option<V3>,
    /// Inertia about the reference: kg m2, kg m, kg.
    pub(super) inertia: M6,
    /// What drives the body while all joints keep their velocities: applied loads less the inertia of that motion; moment
    /// about the reference, N m, then force, N.
    pub(super) load: V6,
}

/// A body has a reference of its own if the one before it is further away than so many times its size. The square of this is
/// what round-off of its inertia may grow by. Seen on stretched chains of 160 and 640 hinged rods, in all accelerations: 5.7e-11
/// and 8.6e-9 of the largest about one reference, 7.6e-13 and 2.1e-11 about changing ones; operations per rod do not grow.
pub const FAR: f64 = 16.0;

/// For each joint of a tree, whether the body on it takes its quantities at the joint's origin, not where the body before does:
/// if the way there, along the tree at the start, is more than `far` times the body's size.
pub(super) fn references(model: &Model, tree: &SpanningTree, far: f64) -> Vec<bool> {
    let mut way = vec![0.0; model.bodies.len()];
    let mut anew = Vec::with_capacity(tree.joints.len());
    for joint in &tree.joints {
        let Some(markers) = joint.markers(model) else {
            // A body that floats has its reference at its own centre.
            anew.push(false);
            continue;
        };
        let body = &model.bodies[joint.child];
        let (near, own) = if joint.reversed { (&markers[1], &markers[0]) } else { (&markers[0], &markers[1]) };
        let slide = (place(model, near) - place(model, own)).norm();
        // On the ground, the reference is the origin of the joint's frame.
        let to_joint = slide + joint.parent.map_or(0.0, |parent| way[parent] + near.position.norm());
        let arm = own.position.norm();
        let is_far = to_joint > far * arm.max(body.gyration());
        way[joint.child] = if is_far { arm } else { to_joint + arm };
        anew.push(is_far);
    }
    anew
}

/// Where a marker is at the start as given, m.
fn place(model: &Model, marker: &Marker) -> Vector3<f64> {
    marker.body.map_or(marker.position, |body| {
        let body = &model.bodies[body];
        body.position + rotation(&body.orientation) * marker.position
    })
}

impl Limb {
    /// An inertia of this limb about the reference of the one that carries it. With s from there to here, and the blocks
    /// [J H; H^T M]: H + s~ M, and J + s~ H^T - (H + s~ M) s~ (Featherstone, eq. 2.66, for any symmetric matrix).
    pub(super) fn inertia_at_parent(&self, g: &mut Graph, inertia: &M6) -> M6 {
        let Some(s) = self.shift else { return *inertia };
        let block = |row: usize, column: usize| -> M3 {
            std::array::from_fn(|i| std::array::from_fn(|j| inertia[row + i][column + j]))
        };
        let (second, first, mass) = (block(0, 0), block(0, 3), block(3, 3));
        let carried = crossed_columns(g, s, &mass);
        let first_here: M3 = std::array::from_fn(|i| g.add3(first[i], carried[i]));
        let transposed: M3 = std::array::from_fn(|i| std::array::from_fn(|j| first[j][i]));
        let left = crossed_columns(g, s, &transposed);
        // A row r of H times -s~ is s x r.
        let right: M3 = std::array::from_fn(|i| g.cross(s, first_here[i]));
        let mut whole = *inertia;
        for i in 0..3 {
            for j in 0..=i {
                let part = g.add(left[i][j], right[i][j]);
                whole[i][j] = g.add(second[i][j], part);
                whole[j][i] = whole[i][j];
            }
            for j in 0..3 {
                whole[i][3 + j] = first_here[i][j];
                whole[3 + j][i] = first_here[i][j];
            }
        }
        whole
    }

    /// A load or momentum on this limb about the reference of the one that carries it.
    pub(super) fn load_at_parent(&self, g: &mut Graph, load: V6) -> V6 {
        let Some(s) = self.shift else { return load };
        let force = [load[3], load[4], load[5]];
        let lever = g.cross(s, force);
        six(g.add3([load[0], load[1], load[2]], lever), force)
    }

    /// A motion of the limb that carries this one, at this one's reference.
    pub(super) fn motion_of_parent(&self, g: &mut Graph, motion: V6) -> V6 {
        let Some(s) = self.shift else { return motion };
        let angular = [motion[0], motion[1], motion[2]];
        let swept = g.cross(angular, s);
        six(angular, g.add3([motion[3], motion[4], motion[5]], swept))
    }
}

/// s~ M
fn crossed_columns(g: &mut Graph, s: V3, m: &M3) -> M3 {
    let columns: [V3; 3] = std::array::from_fn(|j| g.cross(s, [m[0][j], m[1][j], m[2][j]]));
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))
}

/// The bodies of a tree in its order, for loads on their centres of mass (force in ground axes, moment in body axes).
pub(super) fn limbs(
    g: &mut Graph,
    model: &Model,
    tree: &SpanningTree,
    bodies: &[Carried],
    body_loads: &[Node],
) -> Vec<Limb> {
    let mut place = vec![0; bodies.len()];
    tree.joints.iter().enumerate().for_each(|(at, joint)| place[joint.child] = at);
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
            parent: joint.parent.map(|parent| place[parent]),
            columns,
            shift: carried.shift,
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
