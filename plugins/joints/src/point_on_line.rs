//! A point of the second body stays on a straight line of the first: a bead on a wire, a pin in a straight slot.
//!
//! ## Equations
//!
//! With d = p_j - p_i (Haug 1989, section 9.4: two dot-2 rows):
//!
//! | row | equation |
//! |---|---|
//! | x | x_i . d = 0 |
//! | y | y_i . d = 0 |
//!
//! ## Signs
//!
//! The line is the z axis of frame `i`; `displacement` = z_i . d. The reaction force on body `j` is across the line, at the
//! origin of its frame; the body turns freely about the point.
//!
//! ## Singular cases
//!
//! None.
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
//! name = "bead"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//!
//! [[joint]]
//! name = "wire"
//! type = "point-on-line"
//! bodies = ["ground", "bead"]
//! axis = [1, 0, -1]
//!
//! [[output]]
//! name = "travel"
//! quantity = "coordinate"
//! of = "wire"
//! channel = "displacement"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct PointOnLine;

impl Element for PointOnLine {
    const NAME: &'static str = "point-on-line";
    const SUMMARY: &'static str = "a point of the second body stays on the z axis of the first";
    const DOC: &'static str = doc_of(include_str!("point_on_line.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its z axis is the line"),
        FrameSpec::new("j", "on the second body; its origin is the point"),
    ];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for PointOnLine {
    const ROWS: &'static [&'static str] = &["x", "y"];
    const COORDINATES: &'static [ChannelSpec] = &[crate::DISPLACEMENT];
    const MOBILITY: Option<usize> = Some(1);
    const TURNS_FREELY: bool = true;

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::on_z_axis(&at.frames[0], &at.frames[1], rows);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(blocks::displacement_along_z(&at.frames[0], &at.frames[1]));
    }

    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        Pose::screw_z(S::zero(), q[0])
    }
}
