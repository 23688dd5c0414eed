//! A bevel differential: two side shafts turn by opposite angles as seen from the cage between them.
//!
//! With the angles of the side shafts against the cage about the common z axis, the row is angle_left + angle_right = 0.
//! The shafts need bearings of their own (revolute joints); this joint only ties the three rotations.

use element_api::prelude::*;

/// The joint.
pub struct Differential;

impl Element for Differential {
    const NAME: &'static str = "differential";
    const SUMMARY: &'static str = "ties the rotations of two shafts and the cage between them";
    const DOC: &'static str = doc_of(include_str!("differential.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("cage", "its z axis is the common one"),
        FrameSpec::new("left", "on the first shaft, z as that of the cage"),
        FrameSpec::new("right", "on the second shaft, z as that of the cage"),
    ];
    // One angle is counted over many turns; see `angle_about_z`.
    const ANGLES: usize = 1;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Differential {
    const ROWS: &'static [&'static str] = &["rotation"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let left = at.angle_about_z(0, 0, 1);
        // Compared within half a turn, so that no two large numbers are subtracted.
        rows.push(blocks::ahead_of(blocks::turn_about_z(&at.frames[0], &at.frames[2]), -left));
    }
}
