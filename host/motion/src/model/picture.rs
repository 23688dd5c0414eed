//! What a picture of the motion is made of: shapes of bodies, frames of elements, and the loads that are drawn.

use nalgebra::{Matrix3, Vector3};

use super::elements::triad;
use super::types::{Model, rotation};
use crate::scene::{BodyRecord, Placement, Scene, ShapeRecord};
use element_api::Kind;

/// A load that a picture shows: that of a joint or force element on the body of one of its frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shown {
    /// Which element.
    pub element: usize,
    /// Which of its frames, on a body that can move.
    pub frame: usize,
}

/// Where something is on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Origin in the frame of the body as the scene has it; of a fixed body, in ground, m.
    pub origin: Vector3<f64>,
    /// Rotation to that frame.
    pub rotation: Matrix3<f64>,
}

impl Model {
    /// The loads that a picture shows: per joint and force element one on each body that can move, at its first frame there.
    #[must_use]
    pub fn shown_loads(&self) -> Vec<Shown> {
        let mut shown = Vec::new();
        for (element, instance) in self.elements.iter().enumerate() {
            let bodies: Vec<Option<usize>> = instance.markers.iter().map(|marker| marker.body).collect();
            for (frame, body) in bodies.iter().enumerate() {
                // A joint's reaction on a body is one, however many of its frames are there.
                let again = instance.class.kind == Kind::Joint && bodies[..frame].contains(body);
                if body.is_some() && instance.class.kind != Kind::Control && !again {
                    shown.push(Shown { element, frame });
                }
            }
        }
        shown
    }

    /// Where a frame of an element is: the body, `None` for the ground, and the place on it.
    #[must_use]
    pub fn place_of_frame(&self, element: usize, frame: usize) -> (Option<usize>, Place) {
        let marker = &self.elements[element].markers[frame];
        let center = marker.body.map_or_else(Vector3::zeros, |body| self.bodies[body].center_of_mass);
        (marker.body, Place { origin: marker.position + center, rotation: marker.rotation })
    }
}

/// Where a shape is on its body. As of the frames of elements: what is given in ground is meant at the start as the scene has it.
#[must_use]
pub fn place_of_shape(body: &BodyRecord, shape: &ShapeRecord) -> Place {
    let (origin, attitude) = (Vector3::from(body.position), rotation(&body.orientation));
    let axes = |axis: Option<[f64; 3]>, x_axis: Option<[f64; 3]>| triad(axis, x_axis).unwrap_or_else(Matrix3::identity);
    let own = match &shape.placement.value {
        Placement::Absent => Place { origin: Vector3::zeros(), rotation: Matrix3::identity() },
        Placement::Local(frames) => match frames.first() {
            Some(frame) => Place { origin: frame.position.into(), rotation: axes(frame.axis, frame.x_axis) },
            None => Place { origin: Vector3::zeros(), rotation: Matrix3::identity() },
        },
        Placement::Global { points, axes: z_axes, x_axes } => {
            let point = points.first().map_or(origin, |point| Vector3::from(*point));
            let axes = axes(z_axes.first().copied(), x_axes.first().copied());
            Place { origin: attitude.tr_mul(&(point - origin)), rotation: attitude.tr_mul(&axes) }
        }
    };
    match body.fixed {
        true => Place { origin: origin + attitude * own.origin, rotation: attitude * own.rotation },
        false => own,
    }
}

/// The record of each body that can move, in the order of the model, with its number among all.
pub fn movable_records(scene: &Scene) -> impl Iterator<Item = (usize, &BodyRecord)> {
    scene.bodies.iter().enumerate().filter(|(_, body)| !body.fixed)
}
