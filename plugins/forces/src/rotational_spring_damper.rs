//! A torsion spring and a damper side by side about a common axis.
//!
//! Equations, with the multi-turn angle phi of frame j against frame i about z (as in a revolute joint) and
//! phi' = z_i . (omega_j - omega_i) (Haug 1989, chapter 11, rotational spring-damper-actuator):
//!
//! ```text
//! n = k (phi - phi0) + c phi' + n0                                            (1)
//! torque on i: n z_i      torque on j: -n z_i                                 (2)
//! V = k (phi - phi0)^2 / 2 + n0 (phi - phi0)      P_dissipated = c phi'^2     (3)
//! ```
//!
//! Sign: `n` is positive when it turns body j back towards smaller angles; the preload n0 is added to it.
//!
//! The z axes must be kept parallel by a joint (revolute, cylindrical): only then is phi' the rate of phi and (3) the
//! energy of (2). Where x_j is parallel to z_i the angle is undefined.

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct RotationalSpringDamper(RotationalSpringDamperParameters);

/// What a scene tells it.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct RotationalSpringDamperParameters {
    /// Torque per angle.
    #[param(unit = "N m/rad", min = 0.0)]
    pub stiffness: f64,
    /// Torque per angular velocity.
    #[param(unit = "N m s/rad", min = 0.0, default = 0.0)]
    pub damping: f64,
    /// Angle at which the spring is relaxed.
    #[param(unit = "rad", default = 0.0)]
    pub free_angle: f64,
    /// Constant torque, added to the spring's.
    #[param(unit = "N m", default = 0.0)]
    pub preload: f64,
}

impl Element for RotationalSpringDamper {
    const NAME: &'static str = "rotational-spring-damper";
    const SUMMARY: &'static str = "torsion spring and damper about the common z axis";
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its z axis is the axis of rotation"),
        FrameSpec::new("j", "on the second body; its z axis is kept parallel by a joint"),
    ];
    const ANGLES: usize = 1;
    type Parameters = RotationalSpringDamperParameters;

    fn new(parameters: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(parameters))
    }
}

impl RotationalSpringDamper {
    fn deflection<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        at.configuration.angle_about_z(0, 0, 1) - self.0.free_angle
    }

    /// (1)
    fn torque<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        self.deflection(at) * self.0.stiffness + at.spin_about_z(0, 1) * self.0.damping + self.0.preload
    }
}

impl Force for RotationalSpringDamper {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("torque", "N m", "positive when it turns the second body towards smaller angles"),
        ChannelSpec::new("angle", "rad", "rotation of the second body about z, counted over many turns"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.torque_pair(0, 1, at.frames()[0].z() * -self.torque(at));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>) -> Vec<S> {
        vec![self.torque(at), at.configuration.angle_about_z(0, 0, 1)]
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let deflection = self.deflection(at);
        Some(deflection * deflection * (0.5 * self.0.stiffness) + deflection * self.0.preload)
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let rate = at.spin_about_z(0, 1);
        Some(rate * rate * self.0.damping)
    }
}
