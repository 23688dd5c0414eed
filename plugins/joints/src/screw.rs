//! A nut on a spindle: the second body turns about the common axis and moves along it by the pitch in every turn.
//!
//! ## Equations
//!
//! With d = p_j - p_i, the displacement s = z_i . d and the pitch h in m per turn (Haug 1989, section 9.4: screw joint):
//!
//! | row | equation |
//! |---|---|
//! | x | x_i . d = 0 |
//! | y | y_i . d = 0 |
//! | about y | x_i . z_j = 0 |
//! | about x | y_i . z_j = 0 |
//! | thread | h / (2 pi) (angle of j about z_i, ahead of 2 pi s / h) = 0, in m; with h = 0: s = 0 |
//!
//! The angle in the last row is the difference within half a turn, so it needs no count of turns and is smooth over any number.
//!
//! ## Signs
//!
//! A positive pitch is a right-hand thread: turning body `j` to the left about z_i moves it along z_i. `displacement` = s;
//! `angle` = 2 pi s / h, counted over many turns, zero where s is zero (h = 0: as in the revolute joint). A torque T along the
//! axis balances the axial force 2 pi T / h.
//!
//! ## Singular cases
//!
//! With pitch 0 it is the revolute joint. The rotation rows are also satisfied by opposite z axes; the start decides, and a motion cannot get there. At the start the nut is put on the nearest thread.
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
//! name = "nut"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//!
//! [[joint]]
//! name = "spindle"
//! type = "screw"
//! bodies = ["ground", "nut"]
//! axis = [0, 0, 1]
//! params.pitch = "5 mm"
//!
//! [[output]]
//! name = "angle"
//! quantity = "coordinate"
//! of = "spindle"
//! channel = "angle"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Screw {
    lead: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct ScrewParameters {
    /// Displacement in one turn; positive for a right-hand thread.
    #[param(unit = "m")]
    pub pitch: f64,
}

impl Element for Screw {
    const NAME: &'static str = "screw";
    const SUMMARY: &'static str = "nut on a spindle: rotation and displacement in proportion";
    const DOC: &'static str = doc_of(include_str!("screw.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const ANGLES: usize = 1;
    type Parameters = ScrewParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        // m per rad.
        Ok(Self { lead: p.pitch / std::f64::consts::TAU })
    }
}

impl Screw {
    /// Rotation beyond that of the thread, rad; for a pitch that is not zero.
    fn slip<S: Scalar>(&self, at: &Configuration<'_, S>) -> S {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::ahead_of(blocks::turn_about_z(i, j), blocks::displacement_along_z(i, j) / self.lead)
    }
}

impl Constraint for Screw {
    const ROWS: &'static [&'static str] = &["x", "y", "about y", "about x", "thread"];
    const COORDINATES: &'static [ChannelSpec] = &[crate::ANGLE, crate::DISPLACEMENT];
    const MOBILITY: Option<usize> = Some(1);

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::on_z_axis(i, j, rows);
        blocks::parallel_z(i, j, rows);
        if self.lead == 0.0 {
            rows.push(blocks::displacement_along_z(i, j));
        } else {
            rows.push(self.slip(at) * self.lead);
        }
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        let displacement = blocks::displacement_along_z(&at.frames[0], &at.frames[1]);
        if self.lead == 0.0 {
            out.push(at.angle_about_z(0, 0, 1));
        } else {
            out.push(displacement / self.lead + self.slip(at));
        }
        out.push(displacement);
    }

    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        Pose::screw_z(q[0], q[0] * self.lead)
    }
}
