//! A torsion spring and a damper side by side about a common axis, linear, with given characteristics, or both.
//!
//! ## Equations
//! With the multi-turn angle phi of frame j against frame i about z (as in a revolute joint) and
//! phi' = z_i . (omega_j - omega_i) (Haug, Computer Aided Kinematics and Dynamics of Mechanical Systems, 1989, chapter
//! 11, rotational spring-damper-actuator):
//!
//! ```text
//! n = k (phi - phi0) + c phi' + n0 + F(phi - phi0) + D(phi')                  (1)
//! torque on i: n z_i      torque on j: -n z_i                                 (2)
//! V = k (phi - phi0)^2 / 2 + n0 (phi - phi0)                                  (3)
//! P_dissipated = c phi'^2 + D(phi') phi'                                      (4)
//! ```
//!
//! F and D are the characteristics `torque_of_deflection` and `torque_of_speed`; without them they are zero. With F
//! there is no closed form (3): the work of the element is integrated instead.
//!
//! ## Signs
//! `n` is positive when it turns body j back towards smaller angles; the preload n0 is added to it.
//!
//! ## Singular cases
//! The z axes must be kept parallel by a joint (revolute, cylindrical): only then is phi' the rate of phi and (3) the
//! energy of (2). Where x_j is parallel to z_i the angle is undefined.
//!
//! ## Example
//! ```toml
//! title = "Torsion pendulum"
//!
//! [plugins]
//! libraries = ["odyn-joints", "odyn-forces"]
//!
//! [simulation]
//! t_end = 0.5
//! output_step = 0.1
//!
//! [[body]]
//! name = "disc"
//! mass = 1
//! inertia = [0.5, 0.5, 1]
//! angular_velocity = [0, 0, 2]
//!
//! [[joint]]
//! name = "bearing"
//! type = "revolute"
//! bodies = ["ground", "disc"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[force]]
//! name = "spring"
//! type = "rotational-spring-damper"
//! bodies = ["ground", "disc"]
//! axis = [0, 0, 1]
//! params.stiffness = "10 N m/rad"
//! params.damping = "0.5 N m s/rad"
//!
//! [[output]]
//! name = "phi"
//! quantity = "coordinate"
//! of = "bearing"
//! channel = "angle"
//! ```

use element_api::prelude::*;

use crate::value;

/// The element.
#[derive(Debug, Clone)]
pub struct RotationalSpringDamper(RotationalSpringDamperParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
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
    /// Additional torque over the deflection phi - phi0.
    #[param(unit = "rad -> N m", variable = "phi")]
    pub torque_of_deflection: Option<Function>,
    /// Additional torque over the angular velocity.
    #[param(unit = "rad/s -> N m", variable = "omega")]
    pub torque_of_speed: Option<Function>,
}

impl Element for RotationalSpringDamper {
    const NAME: &'static str = "rotational-spring-damper";
    const SUMMARY: &'static str = "torsion spring and damper about the common z axis";
    const DOC: &'static str = doc_of(include_str!("rotational_spring_damper.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its z axis is the axis of rotation"),
        FrameSpec::new("j", "on the second body; its z axis is kept parallel by a joint"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    const ANGLES: usize = 1;
    type Parameters = RotationalSpringDamperParameters;

    fn new(parameters: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(parameters))
    }
}

impl RotationalSpringDamper {
    fn deflection<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        at.angle_about_z(0, 0, 1) - self.0.free_angle
    }

    /// (1)
    fn torque<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        let deflection = self.deflection(at);
        let spring = deflection * self.0.stiffness + self.0.preload + value(&self.0.torque_of_deflection, deflection);
        spring + self.resistance(at.spin_about_z(0, 1))
    }

    /// The part of (1) that depends on the rate.
    fn resistance<S: Scalar>(&self, rate: S) -> S {
        rate * self.0.damping + value(&self.0.torque_of_speed, rate)
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

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.torque(at));
        out.push(at.angle_about_z(0, 0, 1));
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        if self.0.torque_of_deflection.is_some() {
            return None;
        }
        let deflection = self.deflection(at);
        Some(deflection * deflection * (0.5 * self.0.stiffness) + deflection * self.0.preload)
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        // Without (3) the host integrates the power of the whole element.
        if self.0.torque_of_deflection.is_some() {
            return None;
        }
        let rate = at.spin_about_z(0, 1);
        Some(self.resistance(rate) * rate)
    }
}
