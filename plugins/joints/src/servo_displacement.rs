//! A servo that moves a body along a joint's axis after a demand, as fast as it can: the distance between two bodies follows a given
//! function of time, a signal, or their sum, as a system of second order. The joint itself (translational, cylindrical, ...) is a
//! separate element.
//!
//! ## Equations
//!
//! With the displacement d of the origin of frame `j` from frame `i` along z_i, the demand u, two states x and v, the natural
//! frequency w, the damping ratio zeta, and the largest rate L (where one is given):
//!
//! | | equation |
//! |---|---|
//! | z | d - x = 0, m |
//! | demand | u = displacement(t) + input `demand` |
//! | states | x' = min(max(v, -L), L), v' = w^2 (u - x) - 2 zeta w v |
//!
//! The joint gives whatever force that takes: the load does not act back on x. (Haug 1989, section 9.5, with a state in the place of time; Franklin, Powell & Emami-Naeini, Feedback Control of Dynamic
//! Systems, section 3.3, for the response.)
//!
//! ## Signs
//!
//! `displacement` is positive along z_i. The reaction force on body `j` along z_i is the servo's force on it, and times the
//! velocity the power that the servo gives.
//!
//! ## Singular cases
//!
//! Where the origins are not kept on z_i by another joint, the servo holds `j` in a plane across it. At the start d is `start` and its rate zero; bodies that are given
//! otherwise are moved by assembly. A demand that jumps makes the force jump, no more: v lies between. At the limit v continues
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
//! name = "slide"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//!
//! [[joint]]
//! name = "guide"
//! type = "translational"
//! bodies = ["ground", "slide"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "servo"
//! type = "servo-displacement"
//! bodies = ["ground", "slide"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//! params.displacement = "30 mm"
//! params.frequency = 20
//! params.damping = 0.8
//!
//! [[output]]
//! name = "force"
//! quantity = "reaction_force"
//! of = "servo"
//! on = "slide"
//! component = "z"
//! ```

use element_api::prelude::*;

use crate::servo::Follower;

/// The joint.
#[derive(Debug, Clone)]
pub struct ServoDisplacement {
    follower: Follower,
    displacement: Option<Function>,
    start: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct ServoDisplacementParameters {
    /// Demand over time, to which the signal is added; not given: the signal alone.
    #[param(unit = "s -> m", variable = "t")]
    pub displacement: Option<Function>,
    /// Natural frequency.
    #[param(unit = "rad/s", above = 0.0)]
    pub frequency: f64,
    /// Damping ratio; 1: as fast as goes without overshoot.
    #[param(min = 0.0, default = 1.0)]
    pub damping: f64,
    /// Largest rate; not given: none.
    #[param(unit = "m/s", above = 0.0)]
    pub rate_limit: Option<f64>,
    /// Displacement at the start.
    #[param(unit = "m", default = 0.0)]
    pub start: f64,
}

impl Element for ServoDisplacement {
    const NAME: &'static str = "servo-displacement";
    const SUMMARY: &'static str = "moves a body along a joint axis after a demand, as a system of second order";
    const DOC: &'static str = doc_of(include_str!("servo_displacement.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    type Parameters = ServoDisplacementParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let follower = Follower { frequency: p.frequency, damping: p.damping, limit: p.rate_limit };
        Ok(Self { follower, displacement: p.displacement, start: p.start })
    }
}

impl Constraint for ServoDisplacement {
    const ROWS: &'static [&'static str] = &["z"];
    const COORDINATES: &'static [ChannelSpec] = &[crate::DISPLACEMENT];
    const STATES: &'static [ChannelSpec] = &[
        ChannelSpec::new("reached", "m", "displacement reached"),
        ChannelSpec::new("speed", "m/s", "rate of it, before the limit"),
    ];
    const INPUTS: &'static [InputSpec] =
        &[InputSpec::optional("demand", "m", 0.0, "displacement to follow, added to `displacement`")];

    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}

    fn residual_in_motion<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(blocks::displacement_along_z(&at.frames()[0], &at.frames()[1]) - at.states[0]);
    }

    fn initial_states(&self) -> Vec<f64> {
        vec![self.start, 0.0]
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let demand = self.displacement.as_ref().map_or(S::zero(), |function| function.at(at.time()));
        self.follower.rates(at.states, demand + at.inputs[0], out);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(blocks::displacement_along_z(&at.frames[0], &at.frames[1]));
    }
}
