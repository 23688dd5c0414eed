//! A shaft in a sleeve: the bodies share an axis, turn about it and slide along it independently.
//!
//! ## Equations
//!
//! With d = p_j - p_i (Haug 1989, section 9.4: parallel-2 and parallel-1):
//!
//! | row | equation |
//! |---|---|
//! | x | x_i . d = 0 |
//! | y | y_i . d = 0 |
//! | about y | x_i . z_j = 0 |
//! | about x | y_i . z_j = 0 |
//!
//! ## Signs
//!
//! `angle` as in the revolute joint; `displacement` = z_i . d, positive when body `j` moves along z_i.
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
//! name = "sleeve"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//! angular_velocity = [0, 0, 10]
//!
//! [[joint]]
//! name = "shaft"
//! type = "cylindrical"
//! bodies = ["ground", "sleeve"]
//! axis = [0, 0, 1]
//!
//! [[output]]
//! name = "fall"
//! quantity = "coordinate"
//! of = "shaft"
//! channel = "displacement"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Cylindrical;

impl Element for Cylindrical {
    const NAME: &'static str = "cylindrical";
    const SUMMARY: &'static str = "rotation about and sliding along the common z axis";
    const DOC: &'static str = doc_of(include_str!("cylindrical.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const ANGLES: usize = 1;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Cylindrical {
    const ROWS: &'static [&'static str] = &["x", "y", "about y", "about x"];
    const COORDINATES: &'static [ChannelSpec] = &[crate::ANGLE, crate::DISPLACEMENT];
    const MOBILITY: Option<usize> = Some(2);

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::on_z_axis(i, j, rows);
        blocks::parallel_z(i, j, rows);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.angle_about_z(0, 0, 1));
        out.push(blocks::displacement_along_z(&at.frames[0], &at.frames[1]));
    }

    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        Pose::screw_z(q[0], q[1])
    }
}
