//! Hard stops of a rotation: frame j turns about z of frame i between `lower` and `upper`, counted over many turns.
//!
//! ## Equations
//!
//! With the angle phi of frame j against frame i about z, two unilateral rows, each with a torque that only pushes:
//!
//! | row | equation | |
//! |---|---|---|
//! | lower | phi - lower >= 0 | unilateral |
//! | upper | upper - phi >= 0 | unilateral |
//!
//! What strikes a stop with the angular velocity w leaves it with e w, e being the coefficient of restitution; when what is left
//! of the bouncing is smaller than the tolerance of the run, it stays. The angle at the start is the one between the stops: half a turn
//! is 180 deg where they are at -90 and 200 deg, and -180 deg where they are at -180 and 0 deg. Stops more than a turn apart leave a
//! choice; there it is the one nearest to zero, and with one stop the one within half a turn of zero, or of a stop that is beyond zero.
//!
//! (Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996.)
//!
//! ## Signs
//!
//! The reaction torque on body `j` is about z_i: positive at the lower stop, negative at the upper one.
//!
//! ## Singular cases
//!
//! The angle is not defined where z_j is opposite to z_i: a joint has to keep the axes together.
//!
//! ## Example
//!
//! A door that falls shut:
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! gravity = [0, -9.81, 0]
//! t_end = 2
//! output_step = 0.01
//!
//! [[body]]
//! name = "flap"
//! mass = 2
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.3, 0, 0]
//!
//! [[joint]]
//! name = "hinge"
//! type = "revolute"
//! bodies = ["ground", "flap"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "frame"
//! type = "rotational-stop"
//! bodies = ["ground", "flap"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//! params.lower = "-90 deg"
//! params.restitution = 0.3
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
pub struct RotationalStop(RotationalStopParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct RotationalStopParameters {
    /// The lower end; not given: none.
    #[param(unit = "rad", example = -0.5)]
    pub lower: Option<f64>,
    /// The upper end; not given: none.
    #[param(unit = "rad", example = 1.0)]
    pub upper: Option<f64>,
    /// Coefficient of restitution, 0 to 1.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    pub restitution: f64,
}

impl Element for RotationalStop {
    const NAME: &'static str = "rotational-stop";
    const SUMMARY: &'static str = "hard stops of a rotation, with restitution";
    const DOC: &'static str = doc_of(include_str!("rotational_stop.rs"));
    const EXEMPT: &'static [(&'static str, &'static str)] =
        &[("free-motion", "its two rows are two ends, which are never both met")];
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    const ANGLES: usize = 1;
    type Parameters = RotationalStopParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        crate::refuse_no_ends(p.lower, p.upper)?;
        Ok(Self(p))
    }
}

impl Constraint for RotationalStop {
    const ROWS: &'static [&'static str] = &["lower", "upper"];

    fn unilateral(&self, _: usize) -> Option<f64> {
        Some(self.0.restitution)
    }

    fn uses_row(&self, row: usize) -> bool {
        [self.0.lower, self.0.upper][row].is_some()
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let angle = at.angle_about_z_between(0, 0, 1, self.0.lower, self.0.upper);
        if let Some(lower) = self.0.lower {
            rows.set(0, angle - lower);
        }
        if let Some(upper) = self.0.upper {
            rows.set(1, -angle + upper);
        }
    }
}
