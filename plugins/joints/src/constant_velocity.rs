//! A constant-velocity (Rzeppa) joint: two shafts meet at a point at any angle, and one turns the other at exactly its own
//! speed.
//!
//! ## Equations
//!
//! With d = p_j - p_i:
//!
//! | row | equation |
//! |---|---|
//! | x, y, z | A_i^T d = 0 |
//! | homokinetic | 2 cos(b / 2) atan2(x_i . y_j - y_i . x_j, x_i . x_j + y_i . y_j) = 0, with the bend b: cos b = z_i . z_j |
//!
//! Derivation. Let e be the Euler parameters of A = A_i^T A_j. Then x_i . y_j - y_i . x_j = A_12 - A_21 = -4 e_0 e_3 and
//! x_i . x_j + y_i . y_j = A_11 + A_22 = 2 (e_0^2 - e_3^2), so that the angle is -2 atan2(e_3, e_0), whatever the signs of e, and
//! the row next to -4 e_3 sign e_0. It says e_3 = 0 (the first of these alone would allow e_0 = 0 as well, where the shafts turn
//! against each other): the rotation that brings frame `i` to frame `j` is about an axis across both shafts z_i and z_j. That axis
//! lies in the plane that halves the angle of the shafts, and the joint is the mirror image of itself in this plane, which
//! makes the speeds about the shafts equal (Hunt, Constant-velocity shaft couplings: a general theory, J. Eng. Ind. 95, 1973).
//! In terms of velocities, with the relative angular velocity w: w . (z_i + z_j) = 0.
//!
//! ## Signs
//!
//! The z axes are the shafts, both in the same sense through the joint. No joint coordinate. The reaction torque is along
//! z_i + z_j.
//!
//! ## Singular cases
//!
//! The row compares how the frames are turned about their shafts: frame `j` has to be frame `i`, turned about an axis across both.
//! Of frames placed by `axes` give `x_axes`, too, as in the example; x axes that are left out are near that of ground, which are
//! other ones in general, and assembly turns the shafts until they fit.
//!
//! At a bend of 180 deg (z_j = -z_i), where the row has no value. Motions pass it, since no step ends there but by chance. No real
//! joint bends that far.
//!
//! ## Example
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 0.1
//! output_step = 0.05
//!
//! [[body]]
//! name = "input"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, -0.5]
//! angular_velocity = [0, 0, 10]
//!
//! [[body]]
//! name = "output"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.3, 0, 0.4]
//!
//! [[joint]]
//! name = "bearing_in"
//! type = "revolute"
//! bodies = ["ground", "input"]
//! point = [0, 0, -1]
//!
//! [[joint]]
//! name = "bearing_out"
//! type = "revolute"
//! bodies = ["ground", "output"]
//! point = [0.6, 0, 0.8]
//! axis = [0.6, 0, 0.8]
//! x_axis = [0.8, 0, -0.6]
//!
//! [[joint]]
//! name = "coupling"
//! type = "constant-velocity"
//! bodies = ["input", "output"]
//! point = [0, 0, 0]
//! axes = [[0, 0, 1], [0.6, 0, 0.8]]
//! x_axes = [[1, 0, 0], [0.8, 0, -0.6]]
//!
//! [[output]]
//! name = "speed"
//! quantity = "coordinate_rate"
//! of = "bearing_out"
//! channel = "angle"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct ConstantVelocity;

impl Element for ConstantVelocity {
    const NAME: &'static str = "constant-velocity";
    const SUMMARY: &'static str = "joins two shafts at any angle; their speeds are equal";
    const DOC: &'static str = doc_of(include_str!("constant_velocity.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first shaft, along its z axis; its origin is the centre of the joint"),
        FrameSpec::new("j", "on the second shaft, likewise; on frame i, or bent from it about an axis across"),
    ];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for ConstantVelocity {
    const ROWS: &'static [&'static str] = &["x", "y", "z", "homokinetic"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::coincident(i, j, rows);
        let angle = (i.x().dot(&j.y()) - i.y().dot(&j.x())).atan2(i.x().dot(&j.x()) + i.y().dot(&j.y()));
        rows.push(angle * ((i.z().dot(&j.z()) + 1.0) * 2.0).sqrt());
    }
}
