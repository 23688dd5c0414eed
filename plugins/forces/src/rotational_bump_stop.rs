//! Elastic stops that end a rotation: nothing happens while frame j turns about z of frame i between `lower` and
//! `upper`; beyond them a buffer turns it back.
//!
//! ## Equations
//! With the multi-turn angle phi of frame j against frame i about z, phi' = z_i . (omega_j - omega_i), the depths x =
//! phi - upper (x' = phi') and x = lower - phi (x' = -phi'),
//!
//! ```text
//! T = T0 (x / d)^n (1 + lambda x')  where x > 0, else 0                        (1)
//! torque on j about z_i: T of the lower stop - T of the upper stop             (2)
//! V = T0 d (x / d)^(n+1) / (n + 1)      P_dissipated = T0 (x / d)^n lambda x'^2    (3)
//! ```
//!
//! on i the opposite (Hunt & Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech.
//! 42, 1975).
//!
//! ## Signs
//! `torque` is the torque on body j about z of frame i: positive at the lower stop, negative at the upper one.
//!
//! ## Singular cases
//! The z axes must be kept parallel by a joint (revolute, cylindrical). With exponent 1 the torque has a kink at the
//! touch; above 1 it is smooth there. Of the angles that differ by whole turns, phi at the start is the one between the
//! stops: half a turn is 180 deg where they are at -90 and 200 deg, and -180 deg where they are at -180 and 0 deg. Stops
//! more than a turn apart leave a choice; there it is the one nearest to zero, and with one stop the one within half a
//! turn of zero, or of a stop that is beyond zero.
//!
//! ## Example
//! ```toml
//! title = "Door stop"
//!
//! [plugins]
//! libraries = ["odyn-joints", "odyn-forces"]
//!
//! [simulation]
//! t_end = 0.5
//! output_step = 0.01
//!
//! [[body]]
//! name = "door"
//! mass = 20
//! inertia = [8, 8, 1]
//! position = [0.4, 0, 0]
//! angular_velocity = [0, 0, 4]
//!
//! [[joint]]
//! name = "hinge"
//! type = "revolute"
//! bodies = ["ground", "door"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[force]]
//! name = "stop"
//! type = "rotational-bump-stop"
//! bodies = ["ground", "door"]
//! axis = [0, 0, 1]
//! params.upper = "90 deg"
//! params.torque = "100 N m"
//! params.depth = "5 deg"
//!
//! [[output]]
//! name = "phi"
//! quantity = "coordinate"
//! of = "hinge"
//! channel = "angle"
//! ```

use element_api::prelude::*;

use crate::contact::{Contact, Stops};

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct RotationalBumpStop(Stops);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct RotationalBumpStopParameters {
    /// Angle at which the lower stop is touched; none: there is no lower stop.
    #[param(unit = "rad", example = -0.5)]
    pub lower: Option<f64>,
    /// Angle at which the upper stop is touched; none: there is no upper stop.
    #[param(unit = "rad", example = 1.0)]
    pub upper: Option<f64>,
    /// Torque at the depth `depth`, T0.
    #[param(unit = "N m", above = 0.0)]
    pub torque: f64,
    /// Angle behind the touch at which the stop turns back with `torque`, d.
    #[param(unit = "rad", above = 0.0)]
    pub depth: f64,
    /// Exponent of the torque over the depth, n.
    #[param(min = 1.0, default = 1.5)]
    pub exponent: f64,
    /// Share by which the torque grows per speed of approach, lambda.
    #[param(unit = "s/rad", min = 0.0, default = 0.0)]
    pub damping: f64,
}

impl Element for RotationalBumpStop {
    const NAME: &'static str = "rotational-bump-stop";
    const SUMMARY: &'static str = "elastic stops of a rotation about the common z axis";
    const DOC: &'static str = doc_of(include_str!("rotational_bump_stop.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its z axis is the axis of rotation"),
        FrameSpec::new("j", "on the second body; its z axis is kept parallel by a joint"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    const ANGLES: usize = 1;
    type Parameters = RotationalBumpStopParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let contact = Contact { load: p.torque, depth: p.depth, exponent: p.exponent, damping: p.damping };
        Stops::new(contact, p.lower, p.upper).map(Self)
    }
}

impl RotationalBumpStop {
    fn angle<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        at.angle_about_z_between(0, 0, 1, self.0.lower, self.0.upper)
    }

    fn torque<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        self.0.force(self.angle(at), at.spin_about_z(0, 1))
    }
}

impl Force for RotationalBumpStop {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("torque", "N m", "torque on the second body about z"),
        ChannelSpec::new("angle", "rad", "rotation of the second body about z, counted over many turns"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.torque_pair(0, 1, at.frames()[0].z() * self.torque(at));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.torque(at));
        out.push(self.angle(at));
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(self.0.potential(self.angle(at)))
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(self.0.dissipation(self.angle(at), at.spin_about_z(0, 1)))
    }
}
