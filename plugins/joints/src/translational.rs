//! A slide: the second body moves along the z axis of the first and keeps its orientation.
//!
//! Equations, with d = p_j - p_i (Haug 1989, section 9.4; parallel-2, parallel-1 and one dot-1 row):
//!
//! | row | equation |
//! |---|---|
//! | x | x_i . d = 0 |
//! | y | y_i . d = 0 |
//! | about y | x_i . z_j = 0 |
//! | about x | y_i . z_j = 0 |
//! | about z | y_i . x_j = 0 |
//!
//! Joint coordinate: `displacement` = z_i . d.
//!
//! The rotation rows are also satisfied by half turns about an axis; the start decides, and a motion cannot get there.

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Translational;

impl Element for Translational {
    const NAME: &'static str = "translational";
    const SUMMARY: &'static str = "slide: translation along the common z axis";
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Translational {
    const ROWS: &'static [&'static str] = &["x", "y", "about y", "about x", "about z"];
    const COORDINATES: &'static [ChannelSpec] =
        &[ChannelSpec::new("displacement", "m", "shift of the second body along z")];
    const MOBILITY: Option<usize> = Some(1);

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::on_z_axis(i, j, rows);
        blocks::same_orientation(i, j, rows);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>) -> Vec<S> {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        vec![i.z().dot(&(j.position - i.position))]
    }

    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        Pose::screw_z(S::zero(), q[0])
    }
}
