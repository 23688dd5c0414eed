//! Friction of a bearing that grows with the speed.
//!
//! With omega = z_housing . (omega_rotor - omega_housing): torque on the rotor -c omega z_housing, on the housing the
//! opposite (1); dissipated power c omega^2 (2). Nothing is singular.

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct RollingResistance {
    damping: f64,
}

/// What a scene tells it.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct RollingResistanceParameters {
    /// Torque per speed of the rotor against the housing.
    #[param(unit = "N m s/rad", min = 0.0)]
    pub damping: f64,
}

impl Element for RollingResistance {
    const NAME: &'static str = "rolling-resistance";
    const SUMMARY: &'static str = "bearing friction torque proportional to the speed";
    const FRAMES: &'static [FrameSpec] = crate::SHAFT_FRAMES;
    type Parameters = RollingResistanceParameters;

    fn new(parameters: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { damping: parameters.damping })
    }
}

impl Force for RollingResistance {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("torque", "N m", "torque on the rotor about z")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.torque_pair(0, 1, at.frames()[0].z() * (at.spin_about_z(0, 1) * -self.damping));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>) -> Vec<S> {
        vec![at.spin_about_z(0, 1) * -self.damping]
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let omega = at.spin_about_z(0, 1);
        Some(omega * omega * self.damping)
    }
}
