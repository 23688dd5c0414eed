//! Friction in a joint, driven by the joint's own reaction: of the pin in a hinge (`kind = "rotation"`) or of the
//! slider on its guide (`kind = "translation"`). It sticks by creeping: no state, no switching.
//!
//! ## Equations
//! F and M are force and torque of the joint's reaction, M about the origin of frame j (the guide is part of the second body), their parts
//! across the axis z_i marked _r, along it _z:
//!
//! ```text
//! rotation:     v = r z_i . (omega_j - omega_i)      N = |F_r| + |F_z| r_t / r + N0                      (1)
//! translation:  v = z_i . v_relative                 N = |F_r| + 2 |M_r| / L + N0                        (2)
//! mu(v) = mu_k + (mu_s - mu_k) exp(-(v / v_s)^2)                                                         (3)
//! Q = -(mu(v) N tanh(v / v_t) + c v)                                                                     (4)
//! rotation: torque r Q z_i on j      translation: force Q z_i on j at p_j      P_dissipated = -Q v       (5)
//! ```
//!
//! on i the opposite along the same line. (3): exponential model of Bo & Pavelescu, The friction-speed relation and its
//! influence on the critical velocity of stick-slip motion, Wear 82 (1982); tanh stands for the sign, so that the force
//! is smooth. r_t is the radius of a thrust face, L the length of the guide.
//!
//! ## Signs
//! `friction` is Q, the force at the sliding surface on body j, positive along (about) z of frame i; `speed` is v.
//!
//! ## Singular cases
//! Friction needs a joint whose reaction presses: a hinge, a slider, a ball. That of gears, racks and couplers is a torque
//! about their axes, or what stands for it; the force between teeth is not in it, and N is N0. At rest a load below mu N is
//! not held but creeps, with |v| < v_t for loads up to three quarters of mu N. Where a reaction is not unique (redundant
//! joints), neither are friction and motion: the run is `suspect` (ODY0322). The joint's axis must be the z axis of the
//! frames, which are those of the joint unless the scene says otherwise. Very heavy friction (mu of the order of lever over
//! radius) has no unique solution: Painleve's paradox.
//!
//! ## Example
//! ```toml
//! title = "Block on a slide"
//!
//! [plugins]
//! libraries = ["odyn-joints", "odyn-forces"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 0.2
//! output_step = 0.02
//!
//! [[body]]
//! name = "block"
//! mass = 1
//! inertia = [1, 1, 1]
//! velocity = [2, 0, 0]
//!
//! [[joint]]
//! name = "slide"
//! type = "translational"
//! bodies = ["ground", "block"]
//! point = [0, 0, 0]
//! axis = [1, 0, 0]
//!
//! [[force]]
//! name = "friction"
//! type = "joint-friction"
//! joints = ["slide"]
//! params.kind = "translation"
//! params.mu = 0.3
//!
//! [[output]]
//! name = "v"
//! quantity = "velocity"
//! of = "block"
//! component = "x"
//! ```

use element_api::prelude::*;

use crate::bump_stop::slide;

/// The element.
#[derive(Debug, Clone)]
pub struct JointFriction {
    parameters: JointFrictionParameters,
    /// Radius of the pin; `None`: the joint slides.
    radius: Option<f64>,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct JointFrictionParameters {
    /// Motion of the joint.
    #[param(choices = ["rotation", "translation"])]
    pub kind: String,
    /// Coefficient of friction while sliding, mu_k.
    #[param(min = 0.0)]
    pub mu: f64,
    /// Coefficient of friction at the onset of sliding, mu_s; none: that of sliding.
    #[param(min = 0.0)]
    pub mu_static: Option<f64>,
    /// Sliding speed at which friction has fallen from mu_s towards mu_k, v_s.
    #[param(unit = "m/s", above = 0.0, default = 0.01)]
    pub stribeck_speed: f64,
    /// Sliding speed at which friction has built up, v_t.
    #[param(unit = "m/s", above = 0.0, default = 0.001)]
    pub transition_speed: f64,
    /// Viscous force per sliding speed, c.
    #[param(unit = "N s/m", min = 0.0, default = 0.0)]
    pub viscous: f64,
    /// Normal force that is there without load, as of a seal, N0.
    #[param(unit = "N", min = 0.0, default = 0.0)]
    pub preload: f64,
    /// Radius of the pin, r; for `rotation`.
    #[param(unit = "m", above = 0.0, example = 0.02)]
    pub radius: Option<f64>,
    /// Mean radius of the face that carries axial loads, r_t; for `rotation`.
    #[param(unit = "m", min = 0.0, default = 0.0)]
    pub thrust_radius: f64,
    /// Length of the guide that carries moments, L; none: moments cause no friction; for `translation`.
    #[param(unit = "m", above = 0.0)]
    pub guide_length: Option<f64>,
}

impl Element for JointFriction {
    const NAME: &'static str = "joint-friction";
    const SUMMARY: &'static str = "Coulomb, Stribeck and viscous friction from a joint's own reaction";
    const DOC: &'static str = doc_of(include_str!("joint_friction.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "that of the joint on its first body; its z axis is the joint's"),
        FrameSpec::new("j", "that of the joint on its last body"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    type Parameters = JointFrictionParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let radius = match (p.kind.as_str(), p.radius) {
            ("rotation", None) => return Err(ParamError::new("radius", "is missing: rotation needs the pin's radius")),
            ("rotation", radius) => radius,
            (_, Some(_)) => return Err(ParamError::new("radius", "is for `kind = \"rotation\"` only")),
            (_, None) => None,
        };
        Ok(Self { parameters: p, radius })
    }
}

/// Length of a vector, without a derivative where it vanishes.
fn magnitude<S: Scalar>(v: Vec3<S>) -> S {
    v.dot(&v).max(S::from(1e-60)).sqrt()
}

impl JointFriction {
    /// Sliding speed and normal force, (1) or (2).
    fn sliding<S: Scalar>(&self, at: &Motion<'_, S>) -> (S, S) {
        let p = &self.parameters;
        let axis = at.frames()[0].z();
        let reaction = &at.reactions[0];
        let along = axis.dot(&reaction.force);
        let across = magnitude(reaction.force - axis * along) + p.preload;
        if let Some(radius) = self.radius {
            let thrust = if p.thrust_radius == 0.0 { S::zero() } else { along.abs() * (p.thrust_radius / radius) };
            return (at.spin_about_z(0, 1) * radius, across + thrust);
        }
        let tilting = match p.guide_length {
            None => S::zero(),
            Some(length) => magnitude(reaction.torque - axis * axis.dot(&reaction.torque)) * (2.0 / length),
        };
        (slide(at).1, across + tilting)
    }

    /// (4)
    fn friction<S: Scalar>(&self, speed: S, normal: S) -> S {
        let p = &self.parameters;
        let excess = p.mu_static.map_or(0.0, |mu| mu - p.mu);
        let mu = if excess == 0.0 {
            S::from(p.mu)
        } else {
            (-(speed * speed) / (p.stribeck_speed * p.stribeck_speed)).exp() * excess + p.mu
        };
        -(mu * normal * (speed / p.transition_speed).tanh() + speed * p.viscous)
    }
}

impl Force for JointFriction {
    const JOINTS: &'static [FrameSpec] = &[FrameSpec::new("joint", "whose reaction is the normal force")];
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("friction", "N", "force at the sliding surface on the second body, along or about z"),
        ChannelSpec::new("normal_force", "N", "what presses the surfaces together"),
        ChannelSpec::new("speed", "m/s", "of the second body's surface on the first's, along or about z"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let (speed, normal) = self.sliding(at);
        let friction = at.frames()[0].z() * self.friction(speed, normal);
        match self.radius {
            Some(radius) => out.torque_pair(0, 1, friction * S::from(radius)),
            None => out.force_pair(0, 1, friction),
        }
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (speed, normal) = self.sliding(at);
        out.push(self.friction(speed, normal));
        out.push(normal);
        out.push(speed);
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let (speed, normal) = self.sliding(at);
        Some(-(self.friction(speed, normal) * speed))
    }
}
