//! Points of an element that lie together: the line between them, along which many elements act, has no direction there.

use element_api::Recording;
use element_api::recording::Input;
use nalgebra::{Matrix3, Vector3};

use super::types::Marker;

/// Points closer than this share of the sizes around them lie together.
const NEAR: f64 = 1e-9;

/// Where the origins of markers are, with the centres of mass of bodies there, and turned so.
pub fn origins(markers: &[Marker], pose: impl Fn(usize) -> (Vector3<f64>, Matrix3<f64>)) -> Vec<Vector3<f64>> {
    let origin = |marker: &Marker| match marker.body.map(&pose) {
        None => marker.position,
        Some((center, turn)) => center + turn * marker.position,
    };
    markers.iter().map(origin).collect()
}

/// The first two of some points that lie together, among things of this size.
#[must_use]
pub fn together(points: &[Vector3<f64>], size: f64) -> Option<[usize; 2]> {
    let pairs = (0..points.len()).flat_map(|other| (0..other).map(move |one| [one, other]));
    pairs.into_iter().find(|[one, other]| (points[*other] - points[*one]).norm() <= NEAR * size)
}

/// Whether an element has no values because these two of its points lie together: it has where one of them is moved away.
#[must_use]
pub fn needs_distance(recording: &Recording, points: &[Vector3<f64>], [one, other]: [usize; 2], away: f64) -> bool {
    let has_values = |apart: Vector3<f64>| {
        let place = |frame: usize| if frame == other { points[one] + apart } else { points[frame] };
        let read = |input: Input| match input {
            Input::Position { frame, component } => place(frame as usize)[component as usize],
            Input::Rotation { row, column, .. } => f64::from(u8::from(row == column)),
            Input::Velocity { frame, component } => f64::from(frame + component) - 0.5,
            Input::AngularVelocity { .. } => 0.0,
            _ => 0.5,
        };
        recording.evaluate(read).iter().all(|(_, value): &(_, f64)| value.is_finite())
    };
    !has_values(Vector3::zeros()) && has_values(Vector3::new(0.48, 0.6, 0.64) * away)
}
