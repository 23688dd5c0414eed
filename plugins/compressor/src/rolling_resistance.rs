//! Friction of a bearing that grows with the speed.
//!
//! ## Equations
//! With the speed omega = z_housing . (omega_rotor - omega_housing):
//! ```text
//! torque on the rotor -c omega z_housing, on the housing the opposite   (1)
//! dissipated power c omega^2                                            (2)
//! ```
//! c is `damping`; this is viscous friction, the linear law of the paper's compressor.
//!
//! ## Signs
//! The torque always opposes the rotation; the channel `torque` is that on the rotor about z, so it has the opposite sign of omega.
//!
//! ## Singular cases
//! None. The z axes must be kept parallel by a bearing.
//!
//! ## Example
//! ```toml
//! title = "A rotor runs down"
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
//! angular_velocity = [0, 0, 100]
//!
//! [[joint]]
//! name = "bearing"
//! type = "revolute"
//! bodies = ["ground", "rotor"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[force]]
//! name = "friction"
//! type = "rolling-resistance"
//! bodies = ["ground", "rotor"]
//! axis = [0, 0, 1]
//! params.damping = "0.01 N m s/rad"
//!
//! [[output]]
//! name = "speed"
//! quantity = "angular_velocity"
//! of = "rotor"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct RollingResistance {
    damping: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct RollingResistanceParameters {
    /// Torque per speed of the rotor against the housing.
    #[param(unit = "N m s/rad", min = 0.0)]
    pub damping: f64,
}

impl Element for RollingResistance {
    const NAME: &'static str = "rolling-resistance";
    const SUMMARY: &'static str = "bearing friction torque proportional to the speed";
    const DOC: &'static str = doc_of(include_str!("rolling_resistance.rs"));
    const FRAMES: &'static [FrameSpec] = crate::SHAFT_FRAMES;
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
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

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.spin_about_z(0, 1) * -self.damping);
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let omega = at.spin_about_z(0, 1);
        Some(omega * omega * self.damping)
    }
}
