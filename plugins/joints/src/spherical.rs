//! A ball in a socket: the bodies share a point and turn about it in all directions.
//!
//! Equations, with d = p_j - p_i (Haug 1989, section 9.4): A_i^T d = 0, the rows x, y and z. Nothing is singular.
//!
//! No joint coordinates and no mobility: three angles, whichever they are, have a singular position somewhere in the range
//! of motion (gimbal lock), and a mobility must reach every position.

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Spherical;

impl Element for Spherical {
    const NAME: &'static str = "spherical";
    const SUMMARY: &'static str = "ball joint: rotation about a common point";
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

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::coincident(&at.frames[0], &at.frames[1], rows);
    }
}
