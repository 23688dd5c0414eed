//! The inertia of a geared rotor, or of any flywheel whose angle is in proportion to that between two bodies: to rotation about the
//! common z axis it is a moment of inertia of `inertance`, which neither body carries ("armature" of robots).
//!
//! ## Equations
//! With omega the angular velocity of frame j against frame i about z, and b the inertance (of a rotor J behind a gear of the ratio n:
//! n^2 J), the kinetic energy is
//!
//! ```text
//! T = b omega^2 / 2      omega = z_i . (omega_j - omega_i)      (1)
//! ```
//!
//! The torque is b omega' against the relative acceleration. That the rotor also turns with body `i`, and about which axis, is left out:
//! its share in T is smaller by the ratio n (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 9.6).
//!
//! ## Signs
//! The quantity `torque` at frame j is what the inerter does to body j: against omega'. Channels are omega and T.
//!
//! ## Singular cases
//! None. Bodies may be as light as they are beside b; a joint has to keep the axes together.
//!
//! ## Example
//! ```toml
//! title = "Arm with a geared motor, falling"
//!
//! [plugins]
//! libraries = ["odyn-forces", "odyn-joints"]
//!
//! [simulation]
//! gravity = [0, -9.81, 0]
//! t_end = 1
//! output_step = 0.01
//!
//! [[body]]
//! name = "arm"
//! mass = 2
//! inertia = [0.01, 0.06, 0.06]
//! position = [0.3, 0, 0]
//!
//! [[joint]]
//! name = "shoulder"
//! type = "revolute"
//! bodies = ["ground", "arm"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[force]]
//! name = "rotor"
//! type = "rotational-inerter"
//! bodies = ["ground", "arm"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//! params.inertance = "100^2 * 2e-5"
//!
//! [[output]]
//! name = "angle"
//! quantity = "coordinate"
//! of = "shoulder"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct RotationalInerter {
    inertance: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct RotationalInerterParameters {
    /// Torque per relative angular acceleration, b; of a rotor J behind a gear of the ratio n: n^2 J.
    #[param(unit = "kg m^2", min = 0.0)]
    pub inertance: f64,
}

impl Element for RotationalInerter {
    const NAME: &'static str = "rotational-inerter";
    const SUMMARY: &'static str = "torque in proportion to the relative angular acceleration about the common z axis";
    const DOC: &'static str = doc_of(include_str!("rotational_inerter.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its z axis is the axis of rotation"),
        FrameSpec::new("j", "on the second body; its z axis is kept parallel by a joint"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    type Parameters = RotationalInerterParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { inertance: p.inertance })
    }
}

impl RotationalInerter {
    /// (1)
    fn energy<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        let rate = at.spin_about_z(0, 1);
        rate * rate * (0.5 * self.inertance)
    }
}

impl Force for RotationalInerter {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("rate", "rad/s", "angular velocity of the second body about z, against the first"),
        ChannelSpec::new("energy", "J", "kinetic energy"),
    ];

    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.spin_about_z(0, 1));
        out.push(self.energy(at));
    }

    fn kinetic<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(self.energy(at))
    }
}
