//! Two bodies held together as if they were one: a bracket, a weld, a bolted flange.
//!
//! ## Equations
//!
//! With d = p_j - p_i between bodies `i` and `j` (Haug 1989, section 9.4: three point rows, three dot-1 rows):
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
//! name = "lever"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.5, 0, 0]
//!
//! [[body]]
//! name = "weight"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [1, 0, 0]
//!
//! [[joint]]
//! name = "hinge"
//! type = "revolute"
//! bodies = ["ground", "lever"]
//! point = [0, 0, 0]
//! axis = [0, 1, 0]
//!
//! [[joint]]
//! name = "weld"
//! type = "bracket"
//! bodies = ["lever", "weight"]
//! point = [0.75, 0, 0]
//!
//! [[output]]
//! name = "grip"
//! quantity = "reaction_torque"
//! of = "weld"
//! on = "weight"
//! component = "y"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Bracket;

impl Element for Bracket {
    const NAME: &'static str = "bracket";
    const SUMMARY: &'static str = "holds two bodies together; no relative motion";
    const DOC: &'static str = doc_of(include_str!("bracket.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Bracket {
    const ROWS: &'static [&'static str] = &["x", "y", "z", "about y", "about x", "about z"];
    const MOBILITY: Option<usize> = Some(0);

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::welded(&at.frames[0], &at.frames[1], rows);
    }
}
