//! A propeller: thrust and torque grow with the square of its speed.
//!
//! With n turns per second against the air, the diameter D and the density rho, the thrust is k_T rho n^2 D^4 and the
//! torque k_Q rho n^2 D^5, against the rotation.

use std::f64::consts::TAU;

use element_api::prelude::*;

/// The force.
pub struct Propeller {
    /// Thrust per n |n|, N s^2; negative for a left-handed propeller.
    thrust: f64,
    /// Torque per n |n|, N m s^2.
    torque: f64,
}

// ANCHOR: parameters
/// Its parameters, as a scene gives them.
#[derive(Parameters)]
pub struct PropellerParameters {
    /// Diameter.
    #[param(unit = "m", above = 0.0)]
    diameter: f64,
    /// k_T, from a test or a handbook.
    #[param(min = 0.0)]
    thrust_coefficient: f64,
    /// k_Q, from a test or a handbook.
    #[param(min = 0.0)]
    torque_coefficient: f64,
    /// Density of the air.
    #[param(unit = "kg/m^3", min = 0.0, default = 1.225)]
    density: f64,
    /// The hand of its screw: `right` pushes along z when it turns to the left about z.
    #[param(choices = ["right", "left"], default = "right")]
    hand: String,
}
// ANCHOR_END: parameters

impl Element for Propeller {
    const NAME: &'static str = "propeller";
    const SUMMARY: &'static str = "thrust and torque of a propeller";
    const DOC: &'static str = doc_of(include_str!("propeller.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("air", "the body that the air goes with, usually the ground"),
        FrameSpec::new("propeller", "its z axis is that of the propeller"),
    ];
    const EXEMPT: &'static [(&'static str, &'static str)] =
        &[("third-law", "the reaction of the air goes into the air, not onto the body that it goes with")];
    type Parameters = PropellerParameters;

    fn new(p: PropellerParameters) -> Result<Self, ParamError> {
        let sign = if p.hand == "left" { -1.0 } else { 1.0 };
        let thrust = sign * p.thrust_coefficient * p.density * p.diameter.powi(4);
        Ok(Self { thrust, torque: p.torque_coefficient * p.density * p.diameter.powi(5) })
    }
}

impl Propeller {
    /// n |n|, 1/s^2.
    fn square<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        let spin = at.spin_about_z(1, 0) * (-1.0 / TAU);
        spin * spin.abs()
    }
}

// ANCHOR: channels
impl Force for Propeller {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("thrust", "N", "force along z"),
        ChannelSpec::new("torque", "N m", "torque that turns it, about z"),
        ChannelSpec::new("power", "W", "power that it takes"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let (axis, square) = (at.frames()[1].z(), self.square(at));
        // What the air gets in return is not simulated: no pair of forces.
        out.force(1, axis * (square * self.thrust));
        out.torque(1, axis * (square * -self.torque));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let square = self.square(at);
        out.push(square * self.thrust);
        out.push(square * self.torque);
        out.push(square * self.torque * at.spin_about_z(1, 0) * -1.0);
    }
}
// ANCHOR_END: channels
