//! An electric motor between a housing and its rotor, whose torque depends on the speed: by a measured curve, or by the law of an
//! induction motor.
//!
//! ## Equations
//! With the speed omega = z_housing . (omega_rotor - omega_housing), the torque T is either a curve T(omega), by
//! default a monotone cubic, held constant outside its range, or that of an induction motor near its synchronous speed omega_s (Kloss' formula, e.g.
//! Fitzgerald, Kingsley & Umans, Electric Machinery, ch. 6):
//! ```text
//! s = 1 - omega / omega_s                                               (1)
//! T = 2 T_m s_m s / (s^2 + s_m^2)                                       (2)
//! torque on the rotor T z_housing, on the housing -T z_housing          (3)
//! ```
//! T_m is the breakdown (largest) torque, reached at the slip s = s_m. The power T omega is integrated as work done on the scene.
//!
//! ## Signs
//! Positive torque drives the rotor to the left about z; for a motor that turns the other way, turn the frames' z axes around.
//!
//! ## Singular cases
//! None, since s_m > 0. At the ends of a curve the slope jumps to zero. The z axes must be kept parallel by a bearing.
//!
//! ## Example
//! ```toml
//! title = "A motor starts"
//!
//! [plugins]
//! libraries = ["odyn-joints", "odyn-compressor"]
//!
//! [simulation]
//! t_end = 0.1
//! output_step = 0.01
//!
//! [[body]]
//! name = "rotor"
//! mass = 1
//! inertia = [1e-3, 1e-3, 1e-3]
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
//! type = "motor-torque"
//! bodies = ["ground", "rotor"]
//! axis = [0, 0, 1]
//! params.breakdown_torque = "2 N m"
//! params.breakdown_slip = 0.2
//! params.synchronous_speed = "3000 rpm"
//!
//! [[output]]
//! name = "torque"
//! quantity = "value"
//! of = "motor"
//! channel = "torque"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone)]
pub struct MotorTorque {
    law: Law,
}

/// Its parameters: either the curve, or all three of the others.
#[derive(Debug, Clone, Parameters)]
pub struct MotorTorqueParameters {
    /// Torque over the speed of the rotor against the housing.
    #[param(unit = "rad/s -> N m")]
    pub curve: Option<Curve>,
    /// Largest torque, T_m.
    #[param(unit = "N m", min = 0.0, example = 10.0)]
    pub breakdown_torque: Option<f64>,
    /// Slip at the largest torque, s_m.
    #[param(unit = "1", above = 0.0, example = 0.2)]
    pub breakdown_slip: Option<f64>,
    /// Speed without torque, omega_s.
    #[param(unit = "rad/s", above = 0.0, example = 100.0)]
    pub synchronous_speed: Option<f64>,
}

#[derive(Debug, Clone)]
enum Law {
    Curve(Table),
    Induction { breakdown_torque: f64, breakdown_slip: f64, synchronous_speed: f64 },
}

impl Element for MotorTorque {
    const NAME: &'static str = "motor-torque";
    const SUMMARY: &'static str = "motor torque on a rotor as a function of its speed";
    const DOC: &'static str = doc_of(include_str!("motor_torque.rs"));
    const FRAMES: &'static [FrameSpec] = crate::SHAFT_FRAMES;
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    type Parameters = MotorTorqueParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let closed_form = [
            ("breakdown_torque", p.breakdown_torque),
            ("breakdown_slip", p.breakdown_slip),
            ("synchronous_speed", p.synchronous_speed),
        ];
        if let Some(curve) = p.curve {
            if let Some((name, _)) = closed_form.iter().find(|(_, value)| value.is_some()) {
                return Err(ParamError::new(*name, "is given together with `curve`: give one or the other"));
            }
            return Ok(Self { law: Law::Curve(crate::named(curve.table(Outside::Clamped), "curve")?) });
        }
        let needed = |(name, value): (&str, Option<f64>)| {
            value.ok_or_else(|| {
                let message =
                    "is missing: give `curve`, or `breakdown_torque`, `breakdown_slip` and `synchronous_speed`";
                ParamError::new(name, message)
            })
        };
        let [torque, slip, speed] = closed_form;
        let law = Law::Induction {
            breakdown_torque: needed(torque)?,
            breakdown_slip: needed(slip)?,
            synchronous_speed: needed(speed)?,
        };
        Ok(Self { law })
    }
}

impl MotorTorque {
    fn torque<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        let omega = at.spin_about_z(0, 1);
        match &self.law {
            Law::Curve(table) => omega.lookup(table),
            Law::Induction { breakdown_torque, breakdown_slip, synchronous_speed } => {
                let slip = S::one() - omega / *synchronous_speed;
                slip * (2.0 * breakdown_torque * breakdown_slip) / (slip * slip + breakdown_slip * breakdown_slip)
            }
        }
    }
}

impl Force for MotorTorque {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("torque", "N m", "torque on the rotor about z")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.torque_pair(0, 1, at.frames()[0].z() * self.torque(at));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.torque(at));
    }
}
