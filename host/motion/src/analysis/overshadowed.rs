//! [`overshadowed`]: joints of a tree by which bodies carry so much that next to nothing is left of their own inertia.
//!
//! A heavy load on a ball joint at the end of a thin rod does not keep the rod from spinning: what the rod's spin feels is its own inertia
//! about its axis. In coordinates of joints that is what elimination leaves of all that the rod carries, m L^2 for the load, and as
//! inaccurate as round-off times their ratio: for 1 t on a steel rod of 10 mm and 0.5 m, 6e7. Where the load floats, held by rows,
//! their inertias do not mix.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::joint_start::{JointStart, Motions};
use crate::model::{Body, Model, rotation};
use crate::plan::{SpanningTree, TreeJoint};

/// So many times what is left may be in its way: errors are some times round-off times that, 1e-11 (seen, at 1e6: 2e-8).
const LARGEST: f64 = 1e4;

/// A joint that should not be of the tree, by its element, at a working state; `None` where all may be.
pub(super) fn overshadowed(
    model: &Model,
    tree: &SpanningTree,
    start: &mut JointStart,
    working: &[f64],
) -> Option<usize> {
    let centre = |body: usize| Vector3::from_column_slice(&working[13 * body..][..3]);
    let own = |(number, body): (usize, &Body)| own_inertia(body, &working[13 * number..]);
    // About the centres of mass, ground axes, angular parts first.
    let mut inertia: Vec<Matrix6<f64>> = model.bodies.iter().enumerate().map(own).collect();
    // What bodies carry: the joint that brings most against turning, and against moving, and how much.
    let mut brought: Vec<[(f64, Option<usize>); 2]> = vec![[(0.0, None); 2]; model.bodies.len()];
    let found = start.find(working);
    for (number, joint) in tree.joints.iter().enumerate().rev() {
        let child = joint.child;
        let state = found[number].as_ref()?;
        let (origin, motions) =
            start.motions(number, &state.positions, working).unwrap_or_else(|| floating(centre(child), joint));
        let whole = inertia[child];
        let motion = |[spin, velocity]: &[Vector3<f64>; 2]| {
            let moved = velocity + spin.cross(&(centre(child) - origin));
            Vector6::from_iterator(spin.iter().chain(moved.iter()).copied())
        };
        // Against what the joint lets the body do, of turns and of displacements alone.
        let mut most = [0.0_f64; 2];
        for one in &motions {
            let kind = usize::from(one[0] == Vector3::zeros());
            let own = motion(one).fixed_rows::<3>(3 * kind).into_owned();
            most[kind] = most[kind].max(own.dot(&(whole.fixed_view::<3, 3>(3 * kind, 3 * kind) * own)));
        }
        let mut left = whole;
        for one in &motions {
            let kind = usize::from(one[0] == Vector3::zeros());
            let motion = motion(one);
            let push = left * motion;
            let pivot = motion.dot(&push);
            let (share, by) = brought[child][kind];
            if pivot * LARGEST < most[kind] && share > 0.5 * most[kind] {
                return by;
            }
            left -= push * push.transpose() / pivot;
        }
        let Some(parent) = joint.parent else { continue };
        let carried = moved_by(&left, &(centre(child) - centre(parent)));
        for (kind, most) in brought[parent].iter_mut().enumerate() {
            let share = carried.diagonal().fixed_rows::<3>(3 * kind).max();
            if share > most.0 {
                *most = (share, joint.element);
            }
        }
        inertia[parent] += carried;
    }
    None
}

/// How a body that floats moves.
fn floating(centre: Vector3<f64>, joint: &TreeJoint) -> Motions {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let along = axes.map(|axis| [Vector3::zeros(), axis]);
    let about = axes.map(|axis| [axis, Vector3::zeros()]);
    (centre, along.into_iter().chain(about.into_iter().filter(|_| joint.rotates)).collect())
}

/// The inertia of a body about its centre of mass, from its part of a working state.
fn own_inertia(body: &Body, state: &[f64]) -> Matrix6<f64> {
    let turn = rotation(&[state[3], state[4], state[5], state[6]]);
    let mut inertia = Matrix6::zeros();
    inertia.fixed_view_mut::<3, 3>(0, 0).copy_from(&(turn * body.inertia * turn.transpose()));
    inertia.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * body.mass));
    inertia
}

/// An inertia about a point, about another one, from which the first is away by `arm`.
fn moved_by(inertia: &Matrix6<f64>, arm: &Vector3<f64>) -> Matrix6<f64> {
    // The first point moves by v + omega x arm.
    let mut moved = Matrix6::identity();
    moved.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-arm.cross_matrix()));
    moved.transpose() * inertia * moved
}
