//! Two directions stay parallel: the bodies may shift anyhow and turn about the common direction only.
//!
//! ## Equations
//!
//! Haug 1989, section 9.4 (parallel-1):
//!
//! | row | equation |
//! |---|---|
//! | about y | x_i . z_j = 0 |
//! | about x | y_i . z_j = 0 |
//!
//! ## Signs
//!
//! No joint coordinate. The reaction is a torque across the axis; there is no reaction force.
//!
//! ## Singular cases
//!
//! The rotation rows are also satisfied by opposite z axes; the start decides, and a motion cannot get there.
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
//! name = "plate"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//! angular_velocity = [0, 0, 5]
//!
//! [[joint]]
//! name = "upright"
//! type = "parallel-axes"
//! bodies = ["ground", "plate"]
//! axis = [0, 0, 1]
//!
//! [[output]]
//! name = "spin"
//! quantity = "angular_velocity"
//! of = "plate"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct ParallelAxes;

impl Element for ParallelAxes {
    const NAME: &'static str = "parallel-axes";
    const SUMMARY: &'static str = "the z axes of two bodies stay parallel";
    const DOC: &'static str = doc_of(include_str!("parallel_axes.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for ParallelAxes {
    const ROWS: &'static [&'static str] = &["about y", "about x"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::parallel_z(&at.frames[0], &at.frames[1], rows);
    }
}
