//! A ball in a socket: the bodies share a point and turn about it in all directions.
//!
//! ## Equations
//!
//! With d = p_j - p_i (Haug 1989, section 9.4): A_i^T d = 0, the rows x, y and z in the axes of frame `i`.
//!
//! ## Signs
//!
//! No joint coordinate. The reaction force acts at the common point; there is no reaction torque.
//!
//! ## Singular cases
//!
//! None. Three angles, whichever they are, would have a singular position somewhere in the range of motion (gimbal lock); the
//! mobility of this joint is a free rotation, which the host describes by Euler parameters.
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
//! name = "pendulum"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.5, 0, 0]
//! angular_velocity = [0, 0, 3]
//!
//! [[joint]]
//! name = "ball"
//! type = "spherical"
//! bodies = ["ground", "pendulum"]
//! point = [0, 0, 0]
//!
//! [[output]]
//! name = "z"
//! quantity = "position"
//! of = "pendulum"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Spherical;

impl Element for Spherical {
    const NAME: &'static str = "spherical";
    const SUMMARY: &'static str = "ball joint: rotation about a common point";
    const DOC: &'static str = doc_of(include_str!("spherical.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its origin is the common point"),
        FrameSpec::new("j", "on the second body; its origin is the common point"),
    ];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Spherical {
    const ROWS: &'static [&'static str] = &["x", "y", "z"];
    const MOBILITY: Option<usize> = Some(0);
    const TURNS_FREELY: bool = true;

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::coincident(&at.frames[0], &at.frames[1], rows);
    }
}
