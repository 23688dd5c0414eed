//! [`JointStart`]: from positions and velocities of bodies to the coordinates of the joints that carry them.

use std::sync::Arc;

use element_api::recording::Recording;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rustc_hash::FxHashMap;

use super::turns::{product, quaternion};
use crate::linalg::SingularValues;
use crate::model::{Marker, Model, euler_parameters, rotation};
use crate::plan::{SpanningTree, TreeJoint};
use crate::program::JointPose;

/// Largest mismatch of a pose, positions as a share of the scene's length.
const TOLERANCE: f64 = 1e-9;
/// Newton steps from each guess.
const MOST_STEPS: usize = 40;
/// Guesses per angle, a turn apart together.
const GUESSES: usize = 8;
/// Guesses in all.
const MOST_GUESSES: usize = 512;

/// Coordinates at which a joint is tried for whether it turns about axes one after the other, and how far it may be off.
const TRIED: [[f64; 3]; 3] = [[0.3, -1.2, 0.7], [2.9, 0.4, -3.6], [-7.1, 5.3, 1.9]];
const TURNS: f64 = 1e-12;

/// Position and rotation of a frame with the velocities of both, ground axes.
struct Placed {
    position: Vector3<f64>,
    axes: Matrix3<f64>,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
}

/// Coordinates and velocities of one joint, in the order of the state.
#[derive(Debug, Clone, Default)]
pub(super) struct JointState {
    pub(super) positions: Vec<f64>,
    pub(super) velocities: Vec<f64>,
}

/// See [`JointStart::motions`].
pub(super) type Motions = (Vector3<f64>, Vec<[Vector3<f64>; 2]>);

/// See the module documentation.
pub(super) struct JointStart {
    markers: Vec<[Marker; 2]>,
    joints: Vec<TreeJoint>,
    /// One for all joints whose equations are alike.
    poses: Vec<JointPose>,
    /// By joint: its place among these; `None` for a body that floats.
    pose_of: Vec<Option<usize>>,
    /// As [`SpanningTree::kept`].
    kept: Vec<Vec<bool>>,
    length: f64,
    /// The working state that coordinates were found for last, and these.
    last: Option<(Vec<f64>, Vec<Option<JointState>>)>,
}

impl JointStart {
    pub(super) fn new(model: &Model, tree: &SpanningTree, length: f64) -> Self {
        let centre = |body: Option<usize>| Marker { body, position: Vector3::zeros(), rotation: Matrix3::identity() };
        let floating = |joint: &TreeJoint| [centre(None), centre(Some(joint.child))];
        let markers = tree.joints.iter().map(|joint| joint.markers(model).unwrap_or_else(|| floating(joint)));
        let mut poses = Vec::new();
        let mut known: FxHashMap<(*const Recording, usize), usize> = FxHashMap::default();
        let pose_of = tree.joints.iter().map(|joint| {
            let element = joint.element?;
            let alike = (Arc::as_ptr(&model.elements[element].recording), joint.coordinates);
            let place = known.entry(alike).or_insert_with(|| {
                poses.push(JointPose::new(model, element, joint.coordinates));
                poses.len() - 1
            });
            Some(*place)
        });
        let (markers, pose_of) = (markers.collect(), pose_of.collect());
        Self { markers, poses, pose_of, joints: tree.joints.clone(), kept: tree.kept(), length, last: None }
    }

    /// The coordinates of all joints for a working state, without those that follow others; `None` for a joint whose pose does not
    /// reach the bodies'.
    pub(super) fn find(&mut self, working: &[f64]) -> Vec<Option<JointState>> {
        if let Some((_, found)) = self.last.as_ref().filter(|(known, _)| known == working) {
            return found.clone();
        }
        let joints = self.joints.len();
        let one = |joint: usize| {
            let mut state = self.find_joint(joint, working)?;
            for values in [&mut state.positions, &mut state.velocities] {
                let mut kept = self.kept[joint].iter();
                values.retain(|_| kept.next().is_none_or(|kept| *kept));
            }
            Some(state)
        };
        let found: Vec<_> = (0..joints).map(one).collect();
        self.last = Some((working.to_vec(), found.clone()));
        found
    }

    /// How the second frame of a joint moves against the first with each velocity, at its coordinates `q` and a working state: origin,
    /// m, and angular velocity and velocity of that per unit, ground axes. `None` for a body that floats.
    pub(super) fn motions(&mut self, number: usize, q: &[f64], working: &[f64]) -> Option<Motions> {
        let [first, second] = &self.markers[number];
        let (i, j) = (placed(first, working), placed(second, working));
        let (joint, place) = (&self.joints[number], self.pose_of[number]?);
        let outputs = self.poses[place].at(&q[..joint.coordinates]);
        let reached = matrix(&outputs[3..12]);
        let own = (0..joint.coordinates).map(|k| {
            let slope = &outputs[12 * (k + 1)..12 * (k + 2)];
            let axis = vee(&(matrix(&slope[3..12]) * reached.transpose()));
            [i.axes * axis, i.axes * Vector3::from_column_slice(&slope[..3])]
        });
        let mut motions: Vec<_> = own.collect();
        if joint.rotates {
            motions.extend((0..3).map(|k| [j.axes.column(k).into_owned(), Vector3::zeros()]));
        }
        Some((j.position, motions))
    }

    /// The axes, in its first frame, about which the second of a joint turns with each coordinate, one after the other, as far as they go for
    /// one rad; zero for those that do not turn it; and the Euler parameters of what they turn. `None` where it turns in another way.
    pub(super) fn turns(&mut self, number: usize) -> Option<([f64; 4], Vec<Vector3<f64>>)> {
        let (place, n) = (self.pose_of[number]?, self.joints[number].coordinates);
        let outputs = self.poses[place].at(&vec![0.0; n]);
        let rest = matrix(&outputs[3..12]);
        let axis = |k: usize| vee(&(matrix(&outputs[12 * (k + 1)..][3..12]) * rest.transpose()));
        let (axes, rest): (Vec<_>, _) = ((0..n).map(axis).collect(), euler_parameters(&rest));
        let holds = TRIED.iter().all(|tried| {
            let q: Vec<f64> = tried.iter().copied().cycle().take(n).enumerate().map(|(k, q)| q + k as f64).collect();
            let found = product(axes.iter().zip(q.iter().copied()), quaternion(&rest));
            let off = matrix(&self.poses[place].at(&q)[3..12]) - rotation(&[found.w, found.i, found.j, found.k]);
            off.amax() < TURNS
        });
        holds.then_some((rest, axes))
    }

    fn find_joint(&mut self, number: usize, working: &[f64]) -> Option<JointState> {
        let [first, second] = &self.markers[number];
        let (i, j) = (placed(first, working), placed(second, working));
        let joint = &self.joints[number];
        let Some(place) = self.pose_of[number] else { return Some(floating(&j, joint)) };
        let pose = &mut self.poses[place];
        let position = i.axes.tr_mul(&(j.position - i.position));
        let turn = i.axes.tr_mul(&j.axes);
        let q = match joint.coordinates {
            0 => Vec::new(),
            _ => find_pose(pose, joint, &position, &turn, self.length)?,
        };
        if mismatch(pose.at(&q), joint, &position, &turn, self.length) > TOLERANCE {
            return None;
        }
        let outputs = pose.at(&q);
        let reached = matrix(&outputs[3..12]);
        // Position and angular velocity of j in i, axes of i.
        let rate = i.axes.tr_mul(&(j.velocity - i.velocity - i.spin.cross(&(j.position - i.position))));
        let spin = i.axes.tr_mul(&(j.spin - i.spin));
        let n = joint.coordinates;
        let height = if joint.rotates { 3 } else { 6 };
        let mut slopes = DMatrix::zeros(height, n);
        let mut axes = Vec::with_capacity(n);
        for k in 0..n {
            let slope = &outputs[12 * (k + 1)..12 * (k + 2)];
            let axis = vee(&(matrix(&slope[3..12]) * reached.transpose()));
            axes.push(axis);
            for c in 0..3 {
                slopes[(c, k)] = slope[c] / self.length;
                if !joint.rotates {
                    slopes[(3 + c, k)] = axis[c];
                }
            }
        }
        let mut right = DVector::zeros(height);
        for c in 0..3 {
            right[c] = rate[c] / self.length;
            if !joint.rotates {
                right[3 + c] = spin[c];
            }
        }
        let mut state = JointState { positions: q, velocities: least_squares(&slopes, &right)? };
        if joint.rotates {
            let own: Vector3<f64> = axes.iter().zip(&state.velocities).map(|(axis, rate)| axis * *rate).sum();
            let free = reached.transpose() * turn;
            state.positions.extend(euler_parameters(&free));
            state.velocities.extend((turn.transpose() * (spin - own)).iter());
        }
        Some(state)
    }
}

/// A body that floats, by its own centre of mass.
fn floating(body: &Placed, joint: &TreeJoint) -> JointState {
    let mut state = JointState {
        positions: body.position.iter().copied().collect(),
        velocities: body.velocity.iter().copied().collect(),
    };
    if joint.rotates {
        state.positions.extend(euler_parameters(&body.axes));
        state.velocities.extend((body.axes.transpose() * body.spin).iter());
    }
    state
}

/// Joint coordinates that give a pose, by Gauss-Newton steps from several guesses.
fn find_pose(
    pose: &mut JointPose,
    joint: &TreeJoint,
    position: &Vector3<f64>,
    turn: &Matrix3<f64>,
    length: f64,
) -> Option<Vec<f64>> {
    let n = joint.coordinates;
    // Where a coordinate moves the frame, the position alone gives it, but for what the others do.
    let start = pose.at(&vec![0.0; n]).to_vec();
    let mut slopes = DMatrix::zeros(3, n);
    for k in 0..n {
        (0..3).for_each(|c| slopes[(c, k)] = start[12 * (k + 1) + c]);
    }
    let away = DVector::from_fn(3, |c, _| position[c] - start[c]);
    let base = least_squares(&slopes, &away).unwrap_or_else(|| vec![0.0; n]);
    let guesses = GUESSES.checked_pow(n as u32).map_or(MOST_GUESSES, |all| all.min(MOST_GUESSES));
    let mut best: Option<(f64, Vec<f64>)> = None;
    for guess in 0..guesses {
        let mut digits = guess;
        let mut q = base.clone();
        for value in &mut q {
            // 0, 1, -1, 2, -2, ... eighths of a turn.
            let digit = digits % GUESSES;
            let steps = digit.div_ceil(2) as f64 * if digit % 2 == 1 { 1.0 } else { -1.0 };
            *value += steps * std::f64::consts::TAU / GUESSES as f64;
            digits /= GUESSES;
        }
        let off = refine(pose, joint, position, turn, length, &mut q);
        if best.as_ref().is_none_or(|(least, _)| off < *least) {
            best = Some((off, q));
        }
        if best.as_ref().is_some_and(|(least, _)| *least <= TOLERANCE) {
            break;
        }
    }
    best.map(|(_, q)| q)
}

/// Gauss-Newton steps; gives the mismatch reached.
fn refine(
    pose: &mut JointPose,
    joint: &TreeJoint,
    position: &Vector3<f64>,
    turn: &Matrix3<f64>,
    length: f64,
    q: &mut [f64],
) -> f64 {
    let n = q.len();
    let height = if joint.rotates { 3 } else { 12 };
    let mut least = f64::INFINITY;
    for _ in 0..MOST_STEPS {
        let outputs = pose.at(q);
        let mut right = DVector::zeros(height);
        let mut slopes = DMatrix::zeros(height, n);
        for c in 0..height {
            let (wanted, scale) = if c < 3 { (position[c], length) } else { (turn[((c - 3) / 3, (c - 3) % 3)], 1.0) };
            right[c] = (wanted - outputs[c]) / scale;
            (0..n).for_each(|k| slopes[(c, k)] = outputs[12 * (k + 1) + c] / scale);
        }
        let off = right.amax();
        // Quadratic near a solution: what no longer gets smaller is round-off.
        if !off.is_finite() || (off <= 1e-13 && off >= least) || off == 0.0 {
            return off.min(least);
        }
        least = least.min(off);
        let Some(step) = least_squares(&slopes, &right) else { return off };
        q.iter_mut().zip(step).for_each(|(value, step)| *value += step);
    }
    least
}

/// How far a pose is from the wanted one.
fn mismatch(outputs: &[f64], joint: &TreeJoint, position: &Vector3<f64>, turn: &Matrix3<f64>, length: f64) -> f64 {
    let off = (0..3).map(|c| (outputs[c] - position[c]).abs() / length).fold(0.0, f64::max);
    if joint.rotates { off } else { off.max((matrix(&outputs[3..12]) - turn).amax()) }
}

fn least_squares(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<Vec<f64>> {
    let values = SingularValues::of(matrix)?;
    Some(values.solve(right, 1e-12 * values.largest()).as_slice().to_vec())
}

fn placed(marker: &Marker, working: &[f64]) -> Placed {
    let Some(body) = marker.body else {
        let still = Vector3::zeros();
        return Placed { position: marker.position, axes: marker.rotation, velocity: still, spin: still };
    };
    let y = &working[13 * body..13 * (body + 1)];
    let a = rotation(&[y[3], y[4], y[5], y[6]]);
    let (r, v, w) = (
        Vector3::from_column_slice(&y[..3]),
        Vector3::from_column_slice(&y[7..10]),
        Vector3::from_column_slice(&y[10..13]),
    );
    let (arm, spin) = (a * marker.position, a * w);
    Placed { position: r + arm, axes: a * marker.rotation, velocity: v + spin.cross(&arm), spin }
}

fn matrix(rows: &[f64]) -> Matrix3<f64> {
    Matrix3::from_row_slice(rows)
}

fn vee(m: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)]) * 0.5
}
