//! A clutch that slips and locks: two bodies turn about an axis against each other, held together by a torque up to the clutch's capacity.
//! With the ground as its first body it is a brake.
//!
//! ## Equations
//!
//! One row on velocities that holds up to a limit, the capacity C >= 0, with the torque M on body `j`:
//!
//! | row | equation | |
//! |---|---|---|
//! | spin | w = z_i . (omega_j - omega_i) = 0 | as long as |M| <= C |
//! | capacity | C = `capacity`(t) + input `engagement`, not less than 0 | |
//!
//! While the clutch is locked M is what holds it. Where that reaches C it begins to slip, and while it slips M = -C w / |w|, until w is zero:
//! then it locks again, or slips the other way, whichever the torques of the instant ask for. Steps end where that happens
//! (`events.csv`), also where C falls below what is held, at once or by and by; what is locked does not creep. The heat is C |w|.
//!
//! The input is for what is actuated: a controller, a pedal, the pressure of a cylinder. A normal force or a pressure becomes a torque by
//! the gain of the input: `inputs.engagement = { signal = "cylinder.output", gain = "mu * r_mean * faces" }` (the sum of all friction
//! faces; gain in N m per unit of the signal). A brake that a spring closes and that a signal opens has its `capacity` from the spring, and
//! a negative gain. What the sum has below zero is a pedal that is not touched: it counts as zero.
//!
//! (Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996, ch. 5.)
//!
//! ## Signs
//!
//! The reaction torque on body `j` is M, positive about z_i: it drives the second body along with the first.
//!
//! ## Singular cases
//!
//! Other rotations are free: a joint has to keep the axes together. A number below zero for C, which nothing changes, ends the run with
//! an error. An impact elsewhere lets it slip: in no time its torque gives no impulse. A signal that is made of accelerations or
//! reactions (its own torque among them) is refused: what may be held would depend on what is held. A sensor with a time constant
//! between them is what a real one is.
//!
//! ## Example
//!
//! Two discs that a clutch brings to one speed:
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! t_end = 2
//! output_step = 0.01
//!
//! [[body]]
//! name = "driving"
//! mass = 1
//! inertia = [0.1, 0.1, 0.2]
//! angular_velocity = [0, 0, 30]
//!
//! [[body]]
//! name = "driven"
//! mass = 1
//! inertia = [0.1, 0.1, 0.1]
//!
//! [[joint]]
//! name = "first_bearing"
//! type = "revolute"
//! bodies = ["ground", "driving"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "second_bearing"
//! type = "revolute"
//! bodies = ["ground", "driven"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "clutch"
//! type = "clutch"
//! bodies = ["driving", "driven"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//! params.capacity = "5 * min(t, 1)"
//!
//! [[output]]
//! name = "torque"
//! quantity = "reaction_torque"
//! of = "clutch"
//! on = "driven"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone)]
pub struct Clutch(ClutchParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct ClutchParameters {
    /// The largest torque that it transmits, over time; the input `engagement` is added. 0: the signal alone.
    #[param(unit = "s -> N m", variable = "t")]
    pub capacity: Function,
}

impl Element for Clutch {
    const NAME: &'static str = "clutch";
    const SUMMARY: &'static str = "transmits a torque up to its capacity: slips, and locks";
    const DOC: &'static str = doc_of(include_str!("clutch.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its z axis is the axis of rotation"),
        FrameSpec::new("j", "on the second body"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    type Parameters = ClutchParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Constraint for Clutch {
    const ROWS: &'static [&'static str] = &[];
    const VELOCITY_ROWS: &'static [&'static str] = &["spin"];
    const INPUTS: &'static [InputSpec] =
        &[InputSpec::optional("engagement", "N m", 0.0, "added to `capacity`; a sum below zero is none")];

    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}

    fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(at.spin_about_z(0, 1));
    }

    fn limit<S: Scalar>(&self, _: usize, at: &Motion<'_, S>) -> Option<S> {
        Some(self.0.capacity.at(at.time()) + at.inputs[0])
    }
}
