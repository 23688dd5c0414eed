//! A plate on a table: the second body slides on the x-y plane of frame `i` and turns about its normal.
//!
//! ## Equations
//!
//! With d = p_j - p_i (Haug 1989, section 9.4: dot-2, parallel-1):
//!
//! | row | equation |
//! |---|---|
//! | z | z_i . d = 0 |
//! | about y | x_i . z_j = 0 |
//! | about x | y_i . z_j = 0 |
//!
//! ## Signs
//!
//! `x` = x_i . d and `y` = y_i . d, the place of origin `j` in frame `i`; `angle` as in the revolute joint. The reaction force
//! is normal to the plane and two-sided: the joint also pulls.
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
//! velocity = [1, 0, 0]
//!
//! [[joint]]
//! name = "table"
//! type = "planar"
//! bodies = ["ground", "plate"]
//! axis = [0, 0, 1]
//!
//! [[output]]
//! name = "normal"
//! quantity = "reaction_force"
//! of = "table"
//! on = "plate"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Planar;

impl Element for Planar {
    const NAME: &'static str = "planar";
    const SUMMARY: &'static str = "motion in the x-y plane of the first body";
    const DOC: &'static str = doc_of(include_str!("planar.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const ANGLES: usize = 1;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Planar {
    const ROWS: &'static [&'static str] = &["z", "about y", "about x"];
    const COORDINATES: &'static [ChannelSpec] = &[crate::SHIFTS[0], crate::SHIFTS[1], crate::ANGLE];
    const MOBILITY: Option<usize> = Some(3);

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::no_offset_along(i.z(), i, j, rows);
        blocks::parallel_z(i, j, rows);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        let d = j.position - i.position;
        out.push(i.x().dot(&d));
        out.push(i.y().dot(&d));
        out.push(at.angle_about_z(0, 0, 1));
    }

    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        Pose { position: Vec3::new(q[0], q[1], S::zero()), ..Pose::screw_z(q[2], S::zero()) }
    }
}
