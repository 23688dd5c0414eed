//! Bodies and frames as nodes: positions, rotations, velocities.

use odyn_graph::{Graph, M3, Node, V3};

use super::equations::Form;
use crate::model::Marker;
use crate::plan::Layout;

/// A body's kinematics.
#[derive(Debug, Clone)]
pub struct BodyNodes {
    /// Centre of mass, ground frame.
    pub r: V3,
    /// Euler parameters.
    pub p: [Node; 4],
    /// Rotation body -> ground.
    pub a: M3,
    /// Velocity of the centre of mass, ground frame.
    pub v: V3,
    /// Angular velocity, body axes.
    pub w: V3,
    /// Rates of the Euler parameters (reference form only).
    pub p_rate: [Node; 4],
}

/// Position, rotation and motion of a marker.
pub(super) struct FrameNodes {
    pub(super) body: Option<usize>,
    pub(super) position: V3,
    pub(super) rotation: M3,
    pub(super) velocity: V3,
    pub(super) angular_velocity: V3,
    /// From the centre of mass to the marker, ground axes.
    pub(super) arm: V3,
}

pub(super) fn frame_nodes(g: &mut Graph, marker: &Marker, bodies: &[BodyNodes]) -> FrameNodes {
    let local = g.vector(&marker.position);
    let mounting = g.matrix(&marker.rotation);
    let zero = g.constant(0.0);
    let Some(body) = marker.body else {
        return FrameNodes {
            body: None,
            position: local,
            rotation: mounting,
            velocity: [zero; 3],
            angular_velocity: [zero; 3],
            arm: local,
        };
    };
    let nodes = &bodies[body];
    let arm = g.apply(&nodes.a, local);
    let swept = g.cross(nodes.w, local);
    let swept = g.apply(&nodes.a, swept);
    FrameNodes {
        body: Some(body),
        position: g.add3(nodes.r, arm),
        rotation: g.product(&nodes.a, &mounting),
        velocity: g.add3(nodes.v, swept),
        angular_velocity: g.apply(&nodes.a, nodes.w),
        arm,
    }
}

pub(super) fn body_nodes(g: &mut Graph, layout: &Layout, body: usize, form: Form) -> BodyNodes {
    let slot = |k| layout.body_slot(body, k);
    let r = g.input_vector(slot(0));
    let p: [Node; 4] = std::array::from_fn(|k| g.input(slot(3 + k)));
    let v = g.input_vector(slot(7));
    let zero = g.constant(0.0);
    match form {
        Form::Working => {
            BodyNodes { r, p, a: rotation_nodes(g, &p, form), v, w: g.input_vector(slot(10)), p_rate: [zero; 4] }
        }
        Form::Reference => {
            let p_rate: [Node; 4] = std::array::from_fn(|k| g.input(slot(13 + k)));
            // omega' = 2 G p_rate.
            let matrix = g_matrix(g, &p);
            let two = g.constant(2.0);
            let w = std::array::from_fn(|i| {
                let sum = dot4(g, &matrix[i], &p_rate);
                g.mul(two, sum)
            });
            BodyNodes { r, p, a: rotation_nodes(g, &p, form), v, w, p_rate }
        }
    }
}

/// The rotation matrix of the Euler parameters.
///
/// Reference form: Haug 1989, eq. 9.3.7, 2 [(e0^2 - 1/2) I + e e^T + e0 e~], as printed. Working form: the homogeneous
/// one divided by p.p, which is a rotation for any p, so that nothing depends on the length of p between normalisations.
pub(super) fn rotation_nodes(g: &mut Graph, p: &[Node; 4], form: Form) -> M3 {
    let square = p.map(|e| g.mul(e, e));
    let two = g.constant(2.0);
    let scale = match form {
        Form::Reference => None,
        Form::Working => {
            let (left, right) = (g.add(square[0], square[1]), g.add(square[2], square[3]));
            let length = g.add(left, right);
            let one = g.constant(1.0);
            Some(g.div(one, length))
        }
    };
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let entry = if i == j {
                let (k, l) = ((i + 1) % 3, (i + 2) % 3);
                match form {
                    Form::Working => {
                        let plus = g.add(square[0], square[1 + i]);
                        let minus = g.add(square[1 + k], square[1 + l]);
                        g.sub(plus, minus)
                    }
                    Form::Reference => {
                        let one = g.constant(1.0);
                        let sum = g.add(square[0], square[1 + i]);
                        let doubled = g.mul(two, sum);
                        g.sub(doubled, one)
                    }
                }
            } else {
                let other = 3 - i - j;
                let product = g.mul(p[1 + i], p[1 + j]);
                let turn = g.mul(p[0], p[1 + other]);
                // The sign of e0 e~: -e3 at (0, 1), +e2 at (0, 2), and so on round the cycle.
                let sum = if (i + 1) % 3 == j { g.sub(product, turn) } else { g.add(product, turn) };
                g.mul(two, sum)
            };
            match scale {
                Some(scale) => g.mul(scale, entry),
                None => entry,
            }
        })
    })
}

/// G(p) = [-e, -e~ + e0 I] with omega' = 2 G p_rate (Haug 1989, eq. 9.3.21 and 9.3.32).
pub(super) fn g_matrix(g: &mut Graph, p: &[Node; 4]) -> [[Node; 4]; 3] {
    let [e0, e1, e2, e3] = *p;
    let n = |g: &mut Graph, e| g.neg(e);
    let (n1, n2, n3) = (n(g, e1), n(g, e2), n(g, e3));
    [[n1, e0, e3, n2], [n2, n3, e0, e1], [n3, e2, n1, e0]]
}

/// How the Euler parameters change where the body turns about each of its axes: dp = G^T dpi' / 2 (Haug 1989, eq. 9.3.32 for small
/// turns).
pub fn turned_parameters(g: &mut Graph, p: &[Node; 4]) -> [[Node; 4]; 3] {
    let half = g.constant(0.5);
    g_matrix(g, p).map(|row| row.map(|entry| g.mul(half, entry)))
}

pub(super) fn transposed(m: &[[Node; 4]; 3]) -> [V3; 4] {
    std::array::from_fn(|k| [m[0][k], m[1][k], m[2][k]])
}

pub(super) fn dot4(g: &mut Graph, a: &[Node; 4], b: &[Node; 4]) -> Node {
    let mut sum = g.constant(0.0);
    for (x, y) in a.iter().zip(b) {
        let product = g.mul(*x, *y);
        sum = g.add(sum, product);
    }
    sum
}

pub(super) fn entries(m: &M3) -> impl Iterator<Item = Node> + use<> {
    let m = *m;
    (0..9).map(move |k| m[k / 3][k % 3])
}
