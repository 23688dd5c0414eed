//! Kinetic energies that elements bring: whether the mass matrix behind one is that of masses, and what bodies feel of it.

use element_api::recording::{Input, Role};
use element_api::{Jet, Recording};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector3};

use super::types::{Body, Instance, Lent, Marker};

/// Share of the coordinates that it was computed from up to which an arm is round-off.
pub(crate) const NO_ARM: f64 = 1e-14;
/// Share of the largest by which an eigenvalue of a matrix with ones on its diagonal may be negative, or is none.
const ROUND_OFF: f64 = 1e-9;

/// Checks the mass matrix of a recording's kinetic energy where the bodies are given: never negative, and positive for the flexible
/// coordinates alone, since the host solves for these.
///
/// # Errors
/// In words.
pub(super) fn check(recording: &Recording, markers: &[Marker], bodies: &[Body]) -> Result<(), String> {
    let frames = poses(markers, bodies);
    let Some(mut mass) = mass_at(recording, &frames, &recording.initial_states) else { return Ok(()) };
    let (flexible, n) = (recording.flexible(), mass.nrows());
    if mass.iter().any(|entry| !entry.is_finite()) {
        return Err("its kinetic energy has no value where the bodies are".into());
    }
    // In units in which each entry of the diagonal is one, or less where round-off has a share in it.
    let round_off = round_off(&mass, &frames);
    let size = |k: usize| (mass[(k, k)].abs() + round_off[k]).max(f64::MIN_POSITIVE);
    let scale: Vec<f64> = (0..n).map(|k| size(k).sqrt().recip()).collect();
    for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
        mass[(row, column)] *= if mass[(row, column)] == 0.0 { 1.0 } else { scale[row] * scale[column] };
    }
    let own = mass.view((n - flexible, n - flexible), (flexible, flexible)).into_owned();
    let least =
        |matrix: DMatrix<f64>| matrix.symmetric_eigen().eigenvalues.iter().copied().fold(f64::INFINITY, f64::min);
    if flexible > 0 && least(own) <= ROUND_OFF {
        return Err("its kinetic energy does not grow with the velocity of each of its flexible coordinates".into());
    }
    if n > 0 && least(mass) < -ROUND_OFF * n as f64 {
        return Err("its kinetic energy is negative for some velocities".into());
    }
    Ok(())
}

/// Moments of inertia below which round-off decides the sign, for each entry of the diagonal: terms that cancel leave the largest mass an
/// arm of round-off, which is no more than `ROUND_OFF` of the arm of these.
fn round_off(mass: &DMatrix<f64>, frames: &[FramePose]) -> Vec<f64> {
    let arm = NO_ARM / ROUND_OFF * frames.iter().map(|(position, _)| position.norm()).fold(0.0, f64::max);
    let of_frame = |k: usize| 6 * k..6 * k + 3;
    let moved = (0..frames.len()).flat_map(of_frame).map(|k| mass[(k, k)].abs()).fold(0.0, f64::max);
    let is_turn = |k: usize| k < 6 * frames.len() && k % 6 >= 3;
    (0..mass.nrows()).map(|k| if is_turn(k) { moved * arm * arm } else { 0.0 }).collect()
}

/// Where frames are when the bodies are where they are given.
fn poses(markers: &[Marker], bodies: &[Body]) -> Vec<FramePose> {
    markers.iter().map(|marker| pose(marker, &|body| bodies[body].given())).collect()
}

/// Where a frame is with bodies there.
fn pose(marker: &Marker, bodies: &dyn Fn(usize) -> FramePose) -> FramePose {
    marker.body.map_or((marker.position, marker.rotation), |body| {
        let (position, turn) = bodies(body);
        (position + turn * marker.position, turn * marker.rotation)
    })
}

/// Position and rotation of a frame.
pub type FramePose = (Vector3<f64>, Matrix3<f64>);

/// The mass matrix of a recording's kinetic energy with its frames there and flexible coordinates as the states begin: six velocities of each
/// frame, ground axes, then those of flexible coordinates. `None` where it brings none.
#[must_use]
pub fn mass_at(recording: &Recording, frames: &[FramePose], states: &[f64]) -> Option<DMatrix<f64>> {
    recording.output(Role::Kinetic)?;
    let n = 6 * frames.len() + recording.flexible();
    let energy = |moved| energy_at(recording, frames, states, moved);
    let mut mass = DMatrix::zeros(n, n);
    for k in 0..n {
        mass[(k, k)] = 2.0 * energy([(k, 1.0); 2]);
    }
    // A quadratic form gives its matrix: 4 a'Mb = 2 T(a + b) - 2 T(a - b), at speeds whose energies are alike, so that of velocities that
    // take a very small part nothing is lost, and those that take none but round-off are not made of it.
    let round_off = round_off(&mass, frames);
    let size = |k: usize| Some(mass[(k, k)].abs() + round_off[k]).filter(|m| m.is_normal());
    let speed = |k: usize| size(k).map_or(1.0, |m| m.sqrt().recip());
    let speeds: Vec<f64> = (0..n).map(speed).collect();
    for (row, column) in (0..n).flat_map(|row| (0..row).map(move |column| (row, column))) {
        let (a, b) = (speeds[row], speeds[column]);
        let entry = (energy([(row, a), (column, b)]) - energy([(row, a), (column, -b)])) / (2.0 * a * b);
        (mass[(row, column)], mass[(column, row)]) = (entry, entry);
    }
    Some(mass)
}

/// The kinetic energy when these coordinates of [`mass_at`] move at these speeds.
fn energy_at(recording: &Recording, frames: &[FramePose], states: &[f64], moved: [(usize, f64); 2]) -> f64 {
    let flexible = recording.flexible();
    let speed = |k: usize| moved.iter().find(|(of, _)| *of == k).map_or(0.0, |(_, speed)| *speed);
    let read = |input: Input| match input {
        Input::Position { frame, component } => frames[frame as usize].0[component as usize],
        Input::Rotation { frame, row, column } => frames[frame as usize].1[(row as usize, column as usize)],
        Input::Velocity { frame, component } => speed(6 * frame as usize + component as usize),
        Input::AngularVelocity { frame, component } => speed(6 * frame as usize + 3 + component as usize),
        Input::State(k) if (k as usize) < flexible => states[k as usize],
        Input::State(k) => speed(6 * frames.len() + k as usize - flexible),
        _ => 0.0,
    };
    let found = recording.evaluate(read).into_iter().find(|(role, _)| *role == Role::Kinetic);
    found.map_or(f64::NAN, |(_, energy)| energy)
}

/// Derivatives of an element's own loads, on frames and on flexible coordinates, along displacements, small turns and these coordinates.
/// Nothing moves, and no signals change.
#[must_use]
pub fn loads_along(recording: &Recording, poses: &[FramePose], states: &[f64]) -> DMatrix<f64> {
    let size = 6 * poses.len() + recording.flexible();
    let mut slopes = DMatrix::zeros(size, size);
    for along in 0..size {
        slopes.set_column(along, &loads_along_one(recording, poses, states, along));
    }
    slopes
}

/// One column of [`loads_along`].
fn loads_along_one(recording: &Recording, poses: &[FramePose], states: &[f64], along: usize) -> DVector<f64> {
    let (frames, n) = (poses.len(), recording.flexible());
    let moves = |of: usize| f64::from(u8::from(of == along));
    let read = |input: Input| match input {
        Input::Position { frame, component } => {
            let (frame, component) = (frame as usize, component as usize);
            Jet::new(poses[frame].0[component], moves(6 * frame + component), 0.0)
        }
        Input::Rotation { frame, row, column } => {
            let (frame, place) = (frame as usize, (row as usize, column as usize));
            let axis = Vector3::from_fn(|k, _| moves(6 * frame + 3 + k));
            Jet::new(poses[frame].1[place], (axis.cross_matrix() * poses[frame].1)[place], 0.0)
        }
        Input::State(k) if (k as usize) < n => Jet::new(states[k as usize], moves(6 * frames + k as usize), 0.0),
        Input::State(k) if (k as usize) < 2 * n => Jet::from(0.0),
        Input::State(k) => Jet::from(states[k as usize]),
        _ => Jet::from(0.0),
    };
    let mut slopes = DVector::zeros(6 * frames + n);
    for (role, value) in recording.evaluate(read) {
        let row = match role {
            Role::Force(k) => 6 * (k as usize / 3) + k as usize % 3,
            Role::Torque(k) => 6 * (k as usize / 3) + 3 + k as usize % 3,
            Role::FlexibleForce(k) => 6 * frames + k as usize,
            _ => continue,
        };
        slopes[row] = value.first;
    }
    slopes
}

/// The stiffness and the mass of each flexible coordinate of an element by itself, with the others and all frames held where they are given.
#[must_use]
pub fn flexible_diagonals(element: &Instance, bodies: &[Body]) -> [Vec<f64>; 2] {
    let (recording, frames) = (&element.recording, poses(&element.markers, bodies));
    let first = 6 * frames.len();
    let own = first..first + recording.flexible();
    let states = &recording.initial_states;
    let stiffness = own.clone().map(|k| -loads_along_one(recording, &frames, states, k)[k]);
    let mass = own.clone().map(|k| 2.0 * energy_at(recording, &frames, states, [(k, 1.0); 2]));
    [stiffness.collect(), mass.collect()]
}

/// The mass matrix of an element's kinetic energy by pairs of bodies: velocity of the centre of mass, ground axes, and angular velocity, body
/// axes. `bodies` gives the centre of mass of each and its rotation to the ground, `states` are the element's; flexible velocities are zero.
#[must_use]
pub fn mass_of_element(
    element: &Instance,
    bodies: &dyn Fn(usize) -> FramePose,
    states: &[f64],
) -> Vec<([usize; 2], Matrix6<f64>)> {
    let poses: Vec<FramePose> = element.markers.iter().map(|marker| pose(marker, bodies)).collect();
    let Some(mass) = mass_at(&element.recording, &poses, states) else { return Vec::new() };
    // From the motion of the body to that of a frame of it.
    let carried = |frame: usize| {
        let marker = &element.markers[frame];
        let turn = bodies(marker.body?).1;
        let mut carried = Matrix6::identity();
        carried.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-(turn * marker.position).cross_matrix() * turn));
        carried.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
        Some((frame, marker.body?, carried))
    };
    let frames: Vec<_> = (0..element.markers.len()).filter_map(carried).collect();
    let pairs = frames.iter().flat_map(|left| frames.iter().map(move |right| (left, right)));
    let block = |((i, body, left), (j, other, right)): (&(_, _, Matrix6<f64>), &(_, _, Matrix6<f64>))| {
        let (i, j): (usize, usize) = (*i, *j);
        ([*body, *other], left.transpose() * mass.fixed_view::<6, 6>(6 * i, 6 * j) * right)
    };
    pairs.map(block).collect()
}

/// Counts to each body what it feels of the elements' mass where it is given: the mean of its mass in all directions, and its inertia
/// about the centre of mass.
pub(super) fn lend(bodies: &mut [Body], elements: &[Instance]) {
    let mut lent = vec![(0.0, Matrix3::zeros()); bodies.len()];
    for element in elements {
        for ([body, other], part) in
            mass_of_element(element, &|body| bodies[body].given(), &element.recording.initial_states)
        {
            if body == other {
                lent[body].0 += part.fixed_view::<3, 3>(0, 0).trace() / 3.0;
                lent[body].1 += part.fixed_view::<3, 3>(3, 3);
            }
        }
    }
    for (body, (mass, inertia)) in bodies.iter_mut().zip(lent) {
        let inertia = if body.particle { Matrix3::zeros() } else { 0.5 * (inertia + inertia.transpose()) };
        if mass > 0.0 || inertia != Matrix3::zeros() {
            body.lent = Some(Lent { mass, inertia, own_mass: body.mass, own_inertia: body.inertia });
            body.mass += mass;
            body.inertia += inertia;
        }
    }
}
