//! A motor or brake about a common axis: its torque is a sum of given functions of time, angle and speed, and of a
//! signal.
//!
//! ## Equations
//! With the multi-turn angle phi of frame j against frame i about z and omega = z_i . (omega_j - omega_i),
//!
//! ```text
//! T = A(t) + B(phi) + C(omega) + g s + M(omega, u)                           (1)
//! torque on j: T z_i      torque on i: -T z_i                               (2)
//! ```
//!
//! (Newton's third law; A, B, C are `of_time`, `of_angle`, `of_speed`, each zero where it is not given, s is the input
//! `signal`, g the `gain`; M is the `map` of a motor, u the input `command`, as a throttle.) The power T omega is integrated as work done on the scene.
//!
//! ## Signs
//! A positive torque turns body j towards larger angles.
//!
//! ## Singular cases
//! The z axes must be kept parallel by a joint (revolute, cylindrical). Where x_j is parallel to z_i the angle is
//! undefined; it is only used for B.
//!
//! ## Example
//! ```toml
//! title = "Motor with a falling curve"
//!
//! [plugins]
//! libraries = ["odyn-joints", "odyn-forces"]
//!
//! [simulation]
//! t_end = 1
//! output_step = 0.1
//!
//! [[body]]
//! name = "rotor"
//! mass = 1
//! inertia = [0.1, 0.1, 0.1]
//!
//! [[joint]]
//! name = "bearing"
//! type = "revolute"
//! bodies = ["ground", "rotor"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[force]]
//! name = "motor"
//! type = "rotational-actuator"
//! bodies = ["ground", "rotor"]
//! axis = [0, 0, 1]
//! params.of_time = "0.5 N m"
//! params.of_speed = [[0, 2], [50, 1.5], [100, 0]]
//!
//! [[output]]
//! name = "speed"
//! quantity = "coordinate_rate"
//! of = "bearing"
//! channel = "angle"
//! ```

use element_api::prelude::*;

use crate::value;

/// The element.
#[derive(Debug, Clone)]
pub struct RotationalActuator(RotationalActuatorParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct RotationalActuatorParameters {
    /// Torque over time.
    #[param(unit = "s -> N m", variable = "t")]
    pub of_time: Option<Function>,
    /// Torque over the angle.
    #[param(unit = "rad -> N m", variable = "phi")]
    pub of_angle: Option<Function>,
    /// Torque over the angular velocity.
    #[param(unit = "rad/s -> N m", variable = "omega")]
    pub of_speed: Option<Function>,
    /// Torque over angular velocity (x) and the input `command` (y), held outside of the grid.
    #[param(unit = "rad/s, -> N m")]
    pub map: Option<Surface>,
    /// Torque per unit (SI) of the signal.
    #[param(unit = "N m", default = 1.0)]
    pub gain: f64,
}

impl Element for RotationalActuator {
    const NAME: &'static str = "rotational-actuator";
    const SUMMARY: &'static str = "torque about the common z axis as functions of time, angle, speed and of a signal";
    const DOC: &'static str = doc_of(include_str!("rotational_actuator.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body (stator); its z axis is the axis of rotation"),
        FrameSpec::new("j", "on the second body (rotor); its z axis is kept parallel by a joint"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    const ANGLES: usize = 1;
    type Parameters = RotationalActuatorParameters;

    fn new(parameters: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(parameters))
    }
}

impl RotationalActuator {
    /// (1)
    fn torque<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        let angle = at.angle_about_z(0, 0, 1);
        value(&self.0.of_time, at.time())
            + value(&self.0.of_angle, angle)
            + value(&self.0.of_speed, at.spin_about_z(0, 1))
            + at.inputs[0] * self.0.gain
            + self.0.map.as_ref().map_or_else(S::zero, |map| map.at(at.spin_about_z(0, 1), at.inputs[1]))
    }
}

impl Force for RotationalActuator {
    const INPUTS: &'static [InputSpec] = &[
        InputSpec::optional("signal", "", 0.0, "times `gain` it is added to the torque"),
        InputSpec::optional("command", "", 0.0, "second argument of `map`"),
    ];
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("torque", "N m", "positive when it turns the second body towards larger angles"),
        ChannelSpec::new("angle", "rad", "rotation of the second body about z, counted over many turns"),
        ChannelSpec::new("power", "W", "done on the bodies"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.torque_pair(0, 1, at.frames()[0].z() * self.torque(at));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let torque = self.torque(at);
        out.push(torque);
        out.push(at.angle_about_z(0, 0, 1));
        out.push(torque * at.spin_about_z(0, 1));
    }
}
