//! A hinge: the bodies share a point and an axis, and turn about it.
//!
//! ## Equations
//!
//! With d = p_j - p_i (Haug 1989, section 9.4: three point rows, parallel-1):
//!
//! | row | equation |
//! |---|---|
//! | x, y, z | A_i^T d = 0 |
//! | about y | x_i . z_j = 0 |
//! | about x | y_i . z_j = 0 |
//!
//! ## Signs
//!
//! `angle` is the rotation of body `j` against body `i` about z_i by the right-hand rule, zero where the x axes of the frames
//! are parallel: angle = atan2(x_j . y_i, x_j . x_i) + 2 pi k, counted over many turns from k = 0 at the start. Opposite x axes at
//! the start are half a turn, pi, whatever round-off makes of them.
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
//! name = "pendulum"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.5, 0, 0]
//!
//! [[joint]]
//! name = "hinge"
//! type = "revolute"
//! bodies = ["ground", "pendulum"]
//! point = [0, 0, 0]
//! axis = [0, 1, 0]
//!
//! [[output]]
//! name = "angle"
//! quantity = "coordinate"
//! of = "hinge"
//! channel = "angle"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Revolute;

impl Element for Revolute {
    const NAME: &'static str = "revolute";
    const SUMMARY: &'static str = "hinge: rotation about the common z axis";
    const DOC: &'static str = doc_of(include_str!("revolute.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const ANGLES: usize = 1;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Revolute {
    const ROWS: &'static [&'static str] = &["x", "y", "z", "about y", "about x"];
    const COORDINATES: &'static [ChannelSpec] = &[crate::ANGLE];
    const MOBILITY: Option<usize> = Some(1);

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::coincident(i, j, rows);
        blocks::parallel_z(i, j, rows);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.angle_about_z(0, 0, 1));
    }

    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        Pose::screw_z(q[0], S::zero())
    }
}
