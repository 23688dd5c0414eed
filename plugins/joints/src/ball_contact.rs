//! Two balls strike each other: they may touch and separate, and never overlap.
//!
//! ## Equations
//!
//! One unilateral row: gap >= 0, normal force >= 0, one of them zero.
//!
//! | row | equation | |
//! |---|---|---|
//! | gap | abs(p_j - p_i) - r_i - r_j >= 0 | unilateral |
//!
//! The contact is smooth. Balls that approach with the velocity v separate with e v, e being the coefficient of restitution. Where
//! several contacts touch at the same time, impacts follow one another, that of the fastest approach first, until none approaches: as
//! in a chain of balls that touch, in which each strikes the next.
//!
//! (Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996; Brogliato, Nonsmooth Mechanics, 2016.)
//!
//! ## Signs
//!
//! The reaction force on body `j` points from the centre of ball `i` to that of ball `j`; its torque about the centre is zero.
//!
//! ## Singular cases
//!
//! A scene in which the balls overlap at the start is refused. Balls around each other (one inside) are not meant.
//!
//! ## Example
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! t_end = 0.5
//! output_step = 0.01
//!
//! [[body]]
//! name = "cue"
//! mass = 0.17
//! inertia = [5.6e-5, 5.6e-5, 5.6e-5]
//! velocity = [2, 0, 0]
//!
//! [[body]]
//! name = "object"
//! mass = 0.17
//! inertia = [5.6e-5, 5.6e-5, 5.6e-5]
//! position = [0.3, 0.02, 0]
//!
//! [[joint]]
//! name = "click"
//! type = "ball-contact"
//! bodies = ["cue", "object"]
//! frames = [{ position = [0, 0, 0] }, { position = [0, 0, 0] }]
//! params.radius_i = "28.6 mm"
//! params.radius_j = "28.6 mm"
//! params.restitution = 0.95
//!
//! [[output]]
//! name = "vx"
//! quantity = "velocity"
//! of = "object"
//! component = "x"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct BallContact(BallContactParameters);

/// What a scene tells it.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct BallContactParameters {
    /// Radius of the ball of the first body.
    #[param(unit = "m", above = 0.0)]
    pub radius_i: f64,
    /// Radius of the ball of the second body; 0: a point.
    #[param(unit = "m", min = 0.0)]
    pub radius_j: f64,
    /// Coefficient of restitution, 0 to 1.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    pub restitution: f64,
}

impl Element for BallContact {
    const NAME: &'static str = "ball-contact";
    const SUMMARY: &'static str = "two balls strike each other, with restitution";
    const DOC: &'static str = doc_of(include_str!("ball_contact.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its origin is the centre of the first ball"),
        FrameSpec::new("j", "on the second body; its origin is the centre of the second ball"),
    ];
    type Parameters = BallContactParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Constraint for BallContact {
    const ROWS: &'static [&'static str] = &["gap"];

    fn unilateral(&self, _: usize) -> Option<f64> {
        Some(self.0.restitution)
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let apart = at.frames[1].position - at.frames[0].position;
        rows.push(length(apart) - self.0.radius_i - self.0.radius_j);
    }
}
