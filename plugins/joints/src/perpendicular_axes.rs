//! Two directions stay perpendicular: one rotation is blocked, everything else is free.
//!
//! ## Equations
//!
//! Haug 1989, section 9.4 (dot-1):
//!
//! | row | equation |
//! |---|---|
//! | perpendicular | z_i . z_j = 0 |
//!
//! ## Signs
//!
//! No joint coordinate. The reaction is a torque along z_i x z_j; there is no reaction force.
//!
//! ## Singular cases
//!
//! None: where the row holds, its derivative has length one.
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
//! name = "blade"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//! angular_velocity = [1, 0, 3]
//!
//! [[joint]]
//! name = "guide"
//! type = "perpendicular-axes"
//! bodies = ["ground", "blade"]
//! axes = [[0, 0, 1], [1, 0, 0]]
//!
//! [[output]]
//! name = "spin"
//! quantity = "angular_velocity"
//! of = "blade"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct PerpendicularAxes;

impl Element for PerpendicularAxes {
    const NAME: &'static str = "perpendicular-axes";
    const SUMMARY: &'static str = "the z axes of two bodies stay perpendicular";
    const DOC: &'static str = doc_of(include_str!("perpendicular_axes.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for PerpendicularAxes {
    const ROWS: &'static [&'static str] = &["perpendicular"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::perpendicular(at.frames[0].z(), at.frames[1].z(), rows);
    }
}
