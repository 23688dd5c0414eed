//! A servo that turns a body about a joint's axis after a demand, as fast as it can: the angle between two bodies follows a given
//! function of time, a signal, or their sum, as a system of second order. The joint itself (revolute, cylindrical, ...) is a
//! separate element.
//!
//! ## Equations
//!
//! With the angle phi of frame `j` against frame `i` about their common z axis, the demand u, two states x and v, the natural
//! frequency w, the damping ratio zeta, and the largest rate L (where one is given):
//!
//! | | equation |
//! |---|---|
//! | about z | phi ahead of x = 0, rad |
//! | demand | u = angle(t) + input `demand` |
//! | states | x' = min(max(v, -L), L), v' = w^2 (u - x) - 2 zeta w v |
//!
//! The joint gives whatever torque that takes: the load does not act back on x. The difference of phi and x is taken within half a
//! turn. (Haug 1989, section 9.5, with a state in the place of time; Franklin, Powell & Emami-Naeini, Feedback Control of Dynamic
//! Systems, section 3.3, for the response.)
//!
//! ## Signs
//!
//! `angle` is positive to the left about z_i. The reaction torque on body `j` about z_i is the servo's torque on it, and times the
//! angular velocity the power that the servo gives.
//!
//! ## Singular cases
//!
//! The z axes must be kept parallel by another joint. At the start phi is `start` and its rate zero; bodies that are given
//! otherwise are moved by assembly. A demand that jumps makes the torque jump, no more: v lies between. At the limit v continues
//! beyond L until the demand is near, which takes the place of a ramp.
//!
//! ## Example
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 1
//! output_step = 0.05
//!
//! [[body]]
//! name = "arm"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.5, 0, 0]
//!
//! [[joint]]
//! name = "bearing"
//! type = "revolute"
//! bodies = ["ground", "arm"]
//! point = [0, 0, 0]
//! axis = [0, 1, 0]
//!
//! [[joint]]
//! name = "servo"
//! type = "servo-rotation"
//! bodies = ["ground", "arm"]
//! point = [0, 0, 0]
//! axis = [0, 1, 0]
//! params.angle = "30 deg"
//! params.frequency = 20
//! params.damping = 0.8
//!
//! [[output]]
//! name = "torque"
//! quantity = "reaction_torque"
//! of = "servo"
//! on = "arm"
//! component = "y"
//! ```

use element_api::prelude::*;

use crate::servo::Follower;

/// The joint.
#[derive(Debug, Clone)]
pub struct ServoRotation {
    follower: Follower,
    angle: Option<Function>,
    start: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct ServoRotationParameters {
    /// Demand over time, to which the signal is added; not given: the signal alone.
    #[param(unit = "s -> rad", variable = "t")]
    pub angle: Option<Function>,
    /// Natural frequency.
    #[param(unit = "rad/s", above = 0.0)]
    pub frequency: f64,
    /// Damping ratio; 1: as fast as goes without overshoot.
    #[param(min = 0.0, default = 1.0)]
    pub damping: f64,
    /// Largest rate; not given: none.
    #[param(unit = "rad/s", above = 0.0)]
    pub rate_limit: Option<f64>,
    /// Angle at the start.
    #[param(unit = "rad", default = 0.0)]
    pub start: f64,
}

impl Element for ServoRotation {
    const NAME: &'static str = "servo-rotation";
    const SUMMARY: &'static str = "turns a body about a joint axis after a demand, as a system of second order";
    const DOC: &'static str = doc_of(include_str!("servo_rotation.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    const ANGLES: usize = 1;
    type Parameters = ServoRotationParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let follower = Follower { frequency: p.frequency, damping: p.damping, limit: p.rate_limit };
        Ok(Self { follower, angle: p.angle, start: p.start })
    }
}

impl Constraint for ServoRotation {
    const ROWS: &'static [&'static str] = &["about z"];
    const COORDINATES: &'static [ChannelSpec] = &[crate::ANGLE];
    const STATES: &'static [ChannelSpec] = &[
        ChannelSpec::new("reached", "rad", "angle reached"),
        ChannelSpec::new("speed", "rad/s", "rate of it, before the limit"),
    ];
    const INPUTS: &'static [InputSpec] =
        &[InputSpec::optional("demand", "rad", 0.0, "angle to follow, added to `angle`")];

    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}

    fn residual_in_motion<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(blocks::ahead_of(blocks::turn_about_z(&at.frames()[0], &at.frames()[1]), at.states[0]));
    }

    fn initial_states(&self) -> Vec<f64> {
        vec![self.start, 0.0]
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let demand = self.angle.as_ref().map_or(S::zero(), |function| function.at(at.time()));
        self.follower.rates(at.states, demand + at.inputs[0], out);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.angle_about_z(0, 0, 1));
    }
}
