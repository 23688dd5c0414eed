//! Two bodies held together as if they were one: a bracket, a weld, a foundation.
//!
//! Equations, with d = p_j - p_i (Haug 1989, section 9.4; three point rows, three dot-1 rows):
//!
//! | row | equation |
//! |---|---|
//! | x, y, z | A_i^T d = 0 |
//! | about y | x_i . z_j = 0 |
//! | about x | y_i . z_j = 0 |
//! | about z | y_i . x_j = 0 |
//!
//! The rotation rows are also satisfied by half turns about an axis; the start decides, and a motion cannot get there.

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Fixed;

impl Element for Fixed {
    const NAME: &'static str = "fixed";
    const SUMMARY: &'static str = "holds two bodies together; no relative motion";
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Fixed {
    const ROWS: &'static [&'static str] = &["x", "y", "z", "about y", "about x", "about z"];
    const MOBILITY: Option<usize> = Some(0);

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::coincident(i, j, rows);
        blocks::same_orientation(i, j, rows);
    }
}
