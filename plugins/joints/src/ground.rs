//! A foundation: the body stands still on the ground (or on whatever body is named first). The same rows as `bracket`.
//!
//! ## Equations
//!
//! With d = p_j - p_i between the ground frame `i` and the body frame `j` (Haug 1989, section 9.4: three point rows, three dot-1 rows):
//!
//! | row | equation |
//! |---|---|
//! | x, y, z | A_i^T d = 0 |
//! | about y | x_i . z_j = 0 |
//! | about x | y_i . z_j = 0 |
//! | about z | y_i . x_j = 0 |
//!
//! ## Signs
//!
//! No joint coordinate. The reaction is the full force and torque of body `i` on body `j`, in the axes that the output names.
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
//! name = "machine"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.5, 0, 1]
//!
//! [[joint]]
//! name = "foundation"
//! type = "ground"
//! bodies = ["ground", "machine"]
//! point = [0, 0, 0]
//!
//! [[output]]
//! name = "load"
//! quantity = "reaction_force"
//! of = "foundation"
//! on = "machine"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Ground;

impl Element for Ground {
    const NAME: &'static str = "ground";
    const SUMMARY: &'static str = "holds a body to the ground; no motion";
    const DOC: &'static str = doc_of(include_str!("ground.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("ground", "on the ground, usually; any body can carry it"),
        FrameSpec::new("body", "on the body that stands still; on the first frame"),
    ];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Ground {
    const ROWS: &'static [&'static str] = &["x", "y", "z", "about y", "about x", "about z"];
    const MOBILITY: Option<usize> = Some(0);

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::welded(&at.frames[0], &at.frames[1], rows);
    }
}
