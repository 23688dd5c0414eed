//! A slide: the second body moves along the z axis of the first and keeps its orientation.
//!
//! ## Equations
//!
//! With d = p_j - p_i (Haug 1989, section 9.4: parallel-2, parallel-1 and one dot-1 row):
//!
//! | row | equation |
//! |---|---|
//! | x | x_i . d = 0 |
//! | y | y_i . d = 0 |
//! | about y | x_i . z_j = 0 |
//! | about x | y_i . z_j = 0 |
//! | about z | y_i . x_j = 0 |
//!
//! ## Signs
//!
//! `displacement` = z_i . d, positive when body `j` moves along z_i, zero where the origins coincide.
//!
//! ## Singular cases
//!
//! The rotation rows are also satisfied by half turns about an axis; the start decides, and a motion cannot get there.
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
//! name = "slider"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//!
//! [[joint]]
//! name = "slide"
//! type = "translational"
//! bodies = ["ground", "slider"]
//! axis = [1, 0, 1]
//!
//! [[output]]
//! name = "travel"
//! quantity = "coordinate"
//! of = "slide"
//! channel = "displacement"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Translational;

impl Element for Translational {
    const NAME: &'static str = "translational";
    const SUMMARY: &'static str = "slide: translation along the common z axis";
    const DOC: &'static str = doc_of(include_str!("translational.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Translational {
    const ROWS: &'static [&'static str] = &["x", "y", "about y", "about x", "about z"];
    const COORDINATES: &'static [ChannelSpec] = &[crate::DISPLACEMENT];
    const MOBILITY: Option<usize> = Some(1);

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::on_z_axis(i, j, rows);
        blocks::same_orientation(i, j, rows);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(blocks::displacement_along_z(&at.frames[0], &at.frames[1]));
    }

    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        Pose::screw_z(S::zero(), q[0])
    }
}
