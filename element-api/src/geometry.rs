//! What an element sees of the bodies: [`Frame`]s, and in a force [`Twist`]s. Everything is in the ground frame.

use nalgebra::{Matrix3, Vector3};

use crate::scalar::Scalar;

/// Three components of type `S`.
pub type Vec3<S> = Vector3<S>;
/// A 3 x 3 matrix of type `S`.
pub type Mat3<S> = Matrix3<S>;

/// Position and orientation of a marker on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<S> {
    /// Origin, m, ground frame.
    pub position: Vec3<S>,
    /// Rotation marker -> ground: its columns are the marker's axes in the ground frame.
    pub rotation: Mat3<S>,
}

impl<S: Scalar> Frame<S> {
    /// The marker's x axis, unit vector, ground frame.
    #[must_use]
    pub fn x(&self) -> Vec3<S> {
        self.rotation.column(0).into_owned()
    }
    /// The marker's y axis, unit vector, ground frame.
    #[must_use]
    pub fn y(&self) -> Vec3<S> {
        self.rotation.column(1).into_owned()
    }
    /// The marker's z axis, unit vector, ground frame. By convention the axis of a joint.
    #[must_use]
    pub fn z(&self) -> Vec3<S> {
        self.rotation.column(2).into_owned()
    }
    /// A point given in the marker's coordinates, in the ground frame, m.
    #[must_use]
    pub fn point(&self, local: [f64; 3]) -> Vec3<S> {
        self.position + self.direction(local)
    }
    /// A direction given in the marker's coordinates, in the ground frame.
    #[must_use]
    pub fn direction(&self, local: [f64; 3]) -> Vec3<S> {
        self.x() * S::from(local[0]) + self.y() * S::from(local[1]) + self.z() * S::from(local[2])
    }
}

/// Velocity of a marker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist<S> {
    /// Velocity of the origin, m/s, ground frame.
    pub velocity: Vec3<S>,
    /// Angular velocity, rad/s, ground frame.
    pub angular_velocity: Vec3<S>,
}

/// Pose of a joint's second frame in its first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose<S> {
    /// Origin of frame 1 in coordinates of frame 0, m.
    pub position: Vec3<S>,
    /// Rotation frame 1 -> frame 0.
    pub rotation: Mat3<S>,
}

impl<S: Scalar> Pose<S> {
    /// Frame 1 on frame 0.
    #[must_use]
    pub fn identity() -> Self {
        Self { position: Vec3::from_element(S::zero()), rotation: diagonal_one() }
    }
    /// Turned about z by `angle` (rad) and moved along z by `distance` (m).
    #[must_use]
    pub fn screw_z(angle: S, distance: S) -> Self {
        let (s, c, o, l) = (angle.sin(), angle.cos(), S::zero(), S::one());
        Self { position: Vec3::new(o, o, distance), rotation: Mat3::new(c, -s, o, s, c, o, o, o, l) }
    }
}

fn diagonal_one<S: Scalar>() -> Mat3<S> {
    let (o, l) = (S::zero(), S::one());
    Mat3::new(l, o, o, o, l, o, o, o, l)
}

/// The length of a vector; its derivative at zero length is undefined.
#[must_use]
pub fn length<S: Scalar>(v: Vec3<S>) -> S {
    v.dot(&v).sqrt()
}
