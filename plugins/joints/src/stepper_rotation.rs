//! A stepping motor: the angle between two bodies follows a demand in whole steps, at most one in each period; the rotor reaches each
//! step as a system of second order. The joint itself (revolute, cylindrical, ...) is a separate element.
//!
//! ## Equations
//!
//! With the angle phi of frame `j` against frame `i` about their common z axis, the demand u, the step q, the count n of steps taken,
//! two states x and v, the natural frequency w and the damping ratio zeta:
//!
//! | | equation |
//! |---|---|
//! | about z | phi ahead of x = 0, rad |
//! | demand | u = angle(t) + input `demand` |
//! | count | at the start and at whole multiples of T: n + 1 where u > q n + q / 2, n - 1 where u < q n - q / 2 |
//! | states | x' = v, v' = w^2 (q n - x) - 2 zeta w v |
//!
//! The count is memory: it changes at the sampling instants only, where steps of the integration end. Between them x is the response
//! of a linear system of second order to the steps so far. The joint gives whatever torque that takes: the load does not act back on
//! x, so no step is lost; the channel `lag` says how far the rotor is behind, and a motor of p steps per pole pair falls out of step
//! beyond p / 2 steps (Acarnley, Stepping Motors, 4th ed. (2002), chapters 3 and 4).
//!
//! ## Signs
//!
//! `angle` is positive to the left about z_i. The reaction torque on body `j` about z_i is the motor's torque on it, and times the
//! angular velocity the power that the motor gives. `lag` is q n - x, positive while the rotor is behind a field that turns to the left.
//!
//! ## Singular cases
//!
//! The z axes must be kept parallel by another joint. At the start phi and its rate are zero; bodies that are given otherwise are moved
//! by assembly. A demand that moves faster than q / T is followed at q / T.
//!
//! ## Example
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 0.5
//! output_step = 0.01
//!
//! [[body]]
//! name = "arm"
//! mass = 0.1
//! inertia = [1e-4, 1e-4, 1e-4]
//! position = [0.05, 0, 0]
//!
//! [[joint]]
//! name = "bearing"
//! type = "revolute"
//! bodies = ["ground", "arm"]
//! point = [0, 0, 0]
//! axis = [0, 1, 0]
//!
//! [[joint]]
//! name = "motor"
//! type = "stepper-rotation"
//! bodies = ["ground", "arm"]
//! point = [0, 0, 0]
//! axis = [0, 1, 0]
//! params.angle = "90 deg"
//! params.step = "1.8 deg"
//! params.period = "5 ms"
//! params.frequency = 300
//! params.damping = 0.2
//!
//! [[output]]
//! name = "lag"
//! quantity = "value"
//! of = "motor"
//! channel = "lag"
//! ```

use element_api::prelude::*;

use crate::servo::Follower;

/// The joint.
#[derive(Debug, Clone)]
pub struct StepperRotation {
    follower: Follower,
    angle: Option<Function>,
    step: f64,
    period: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct StepperRotationParameters {
    /// Demand over time, to which the signal is added; not given: the signal alone.
    #[param(unit = "s -> rad", variable = "t")]
    pub angle: Option<Function>,
    /// Angle of a step, q.
    #[param(unit = "rad", above = 0.0)]
    pub step: f64,
    /// Time between steps, T.
    #[param(unit = "s", above = 0.0)]
    pub period: f64,
    /// Natural frequency of the rotor about a step.
    #[param(unit = "rad/s", above = 0.0)]
    pub frequency: f64,
    /// Damping ratio; 1: as fast as goes without overshoot.
    #[param(min = 0.0, default = 0.2)]
    pub damping: f64,
}

impl Element for StepperRotation {
    const NAME: &'static str = "stepper-rotation";
    const SUMMARY: &'static str = "turns a body about a joint axis after a demand, in whole steps";
    const DOC: &'static str = doc_of(include_str!("stepper_rotation.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    const ANGLES: usize = 1;
    type Parameters = StepperRotationParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let follower = Follower { frequency: p.frequency, damping: p.damping, limit: None };
        Ok(Self { follower, angle: p.angle, step: p.step, period: p.period })
    }
}

impl StepperRotation {
    /// Where the steps taken so far lead.
    fn commanded<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        at.memory[0] * self.step
    }
}

impl Constraint for StepperRotation {
    const ROWS: &'static [&'static str] = &["about z"];
    const COORDINATES: &'static [ChannelSpec] = &[crate::ANGLE];
    const STATES: &'static [ChannelSpec] =
        &[ChannelSpec::new("reached", "rad", "angle reached"), ChannelSpec::new("speed", "rad/s", "rate of it")];
    const INPUTS: &'static [InputSpec] =
        &[InputSpec::optional("demand", "rad", 0.0, "angle to follow, added to `angle`")];
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("steps", "1", "number of steps taken, those to the right counted negative"),
        ChannelSpec::new("lag", "rad", "how far the rotor is behind the steps taken"),
    ];

    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}

    fn residual_in_motion<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(blocks::ahead_of(blocks::turn_about_z(&at.frames()[0], &at.frames()[1]), at.states[0]));
    }

    fn initial_states(&self) -> Vec<f64> {
        vec![0.0, 0.0]
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        self.follower.rates(at.states, self.commanded(at), out);
    }

    fn initial_memory(&self) -> Vec<f64> {
        vec![0.0]
    }

    fn sample_period(&self) -> Option<f64> {
        Some(self.period)
    }

    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let demand = self.angle.as_ref().map_or(S::zero(), |angle| angle.at(at.time())) + at.inputs[0];
        let (ahead, half) = (demand - self.commanded(at), S::from(0.5 * self.step));
        let forward = S::select(half, ahead, S::one(), S::zero());
        out.push(at.memory[0] + S::select(ahead, -half, -S::one(), forward));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0]);
        out.push(self.commanded(at) - at.states[0]);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.angle_about_z(0, 0, 1));
    }
}
