//! Friction at the contact of a ball, or a point, on a plane, driven by the contact's own reaction. It sticks by creeping: no
//! state, no switching.
//!
//! ## Equations
//! With the reaction force F of the contact on body j, the contact point c = p_j - r z_i and the sliding velocity
//!
//! ```text
//! N = |z_i . F|                                                                  (1)
//! v = v_j(c) - v_i(c), its part across z_i                                        (2)
//! Q = -mu N tanh(|v| / v_t) v / |v|     on j at c, on i the opposite              (3)
//! P_dissipated = -Q . v
//! ```
//!
//! (Coulomb; tanh stands for the sign, so that the force is smooth.) Where the contact is open there is no reaction and no friction.
//!
//! ## Signs
//! `friction_x` and `friction_y` are the components of Q along x and y of frame i; `sliding_speed` is |v|.
//!
//! ## Singular cases
//! The normal is z of the contact's first frame, and the radius is given here again: it is for `plane-contact` with a ball
//! of that `radius` or a point. Other joints are not refused, and get what (1) to (3) make of their reaction: a `ball-contact`
//! has its normal along the line of centres, which z need not be, a `plane-contact` with `half_axes` touches elsewhere, and
//! where the reaction is across z there is no friction at all. Contacts have a friction of their own, `mu`.
//! At rest a load below mu N is not held but creeps, with |v| < v_t for loads up to three quarters of mu N. Impacts are without
//! friction: an impulse of friction is not computed; a contact that does not slide at all is `rough` in `plane-contact`. Very
//! heavy friction has no unique solution (Painleve's paradox): the run then stops and says so.
//!
//! ## Example
//! A ball that slides, and begins to roll:
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints", "odyn-forces"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 0.2
//! output_step = 0.01
//!
//! [[body]]
//! name = "ball"
//! mass = 1
//! inertia = [0.001, 0.001, 0.001]
//! position = [0, 0, 0.05]
//! velocity = [2, 0, 0]
//!
//! [[joint]]
//! name = "lane"
//! type = "plane-contact"
//! bodies = ["ground", "ball"]
//! frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0] }]
//! params.radius = "5 cm"
//!
//! [[force]]
//! name = "friction"
//! type = "contact-friction"
//! joints = ["lane"]
//! params.radius = "5 cm"
//! params.mu = 0.2
//!
//! [[output]]
//! name = "v"
//! quantity = "velocity"
//! of = "ball"
//! component = "x"
//! ```

use element_api::prelude::*;

/// Shares of the transition speed below which sliding has no direction.
const STILL: f64 = 1e-8;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct ContactFriction(ContactFrictionParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct ContactFrictionParameters {
    /// Radius of the ball; 0: a point.
    #[param(unit = "m", min = 0.0, default = 0.0)]
    pub radius: f64,
    /// Coefficient of friction.
    #[param(min = 0.0)]
    pub mu: f64,
    /// Sliding speed at which friction has built up, v_t.
    #[param(unit = "m/s", above = 0.0, default = 0.001)]
    pub transition_speed: f64,
}

impl Element for ContactFriction {
    const NAME: &'static str = "contact-friction";
    const SUMMARY: &'static str = "Coulomb friction of a ball on a plane, from the contact's own reaction";
    const DOC: &'static str = doc_of(include_str!("contact_friction.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "that of the contact on its first body; its z axis is the normal of the plane"),
        FrameSpec::new("j", "that of the contact on its last body, the centre of the ball"),
    ];
    type Parameters = ContactFrictionParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

/// Friction on the second body, where it acts, and the sliding velocity.
struct Sliding<S: Scalar> {
    friction: Vec3<S>,
    at: Vec3<S>,
    velocity: Vec3<S>,
}

impl ContactFriction {
    fn sliding<S: Scalar>(&self, at: &Motion<'_, S>) -> Sliding<S> {
        let normal = at.frames()[0].z();
        let point = at.frames()[1].position - normal * S::from(self.0.radius);
        let velocity = at.relative_velocity_at(0, 1, point);
        let velocity = velocity - normal * normal.dot(&velocity);
        let share = velocity * S::from(1.0 / self.0.transition_speed);
        let fast = (share.dot(&share) + STILL * STILL).sqrt();
        let pressed = normal.dot(&at.reactions[0].force).abs();
        Sliding { friction: share * (-(pressed * self.0.mu * (fast.tanh() / fast))), at: point, velocity }
    }
}

impl Force for ContactFriction {
    const JOINTS: &'static [FrameSpec] = &[FrameSpec::new("contact", "whose reaction is the normal force")];
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("friction_x", "N", "force on the second body along x of the first frame"),
        ChannelSpec::new("friction_y", "N", "the same along y"),
        ChannelSpec::new("sliding_speed", "m/s", "of the second body on the first"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let found = self.sliding(at);
        out.force_pair_at(0, 1, found.at, found.friction);
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let found = self.sliding(at);
        out.push(at.frames()[0].x().dot(&found.friction));
        out.push(at.frames()[0].y().dot(&found.friction));
        out.push((found.velocity.dot(&found.velocity) + 1e-60).sqrt());
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let found = self.sliding(at);
        Some(-found.friction.dot(&found.velocity))
    }
}
