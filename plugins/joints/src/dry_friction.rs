//! Dry friction of a translational, revolute or cylindrical joint, with a limit of its own: what it holds stands exactly still.
//!
//! ## Equations
//!
//! Two rows on velocities, each in use if its limit is given, with d = p_j - p_i, the force F and the torque M on body `j`:
//!
//! | row | equation | |
//! |---|---|---|
//! | along z | v = z_i . (v_j - v_i - omega_i x d) = 0 | as long as |F| <= `force` + input `force` |
//! | about z | w = z_i . (omega_j - omega_i) = 0 | as long as |M| <= `torque` + input `torque` |
//!
//! While a row holds, F (M) is what holds it. Where that reaches its limit B the joint begins to slide; then F = -B v / |v| until v is zero.
//! There it sticks again, or slides the other way, whichever the forces of the instant ask for. Steps end where that happens
//! (`events.csv`), also where B falls below what is held. The heat is the sum of B |v|.
//!
//! The inputs are for brakes that are actuated: `params.force = 0` and `inputs.force = { signal = "caliper.output", gain = 0.8 }` is a pair
//! of pads with a coefficient of friction of 0.4 that a signal in N presses. A sum below zero counts as zero: pads do not push.
//!
//! The joint itself is a separate element, which keeps the axes together. `clutch` is the same with a torque over time; `plane-contact`
//! has friction that its own normal force limits; `joint-friction` takes the reaction of a joint, and creeps.
//!
//! (Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996, ch. 5.)
//!
//! ## Signs
//!
//! The reaction on body `j` is F along z_i at the origin of frame j, and M about z_i.
//!
//! ## Singular cases
//!
//! An impact elsewhere lets it slide: in no time its force gives no impulse. Signals that are made of accelerations or reactions are
//! refused, as those of `clutch` are. An input whose parameter is not given acts on nothing, and a warning says so.
//!
//! ## Example
//!
//! A block that slides to a stop:
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! t_end = 1
//! output_step = 0.01
//!
//! [[body]]
//! name = "block"
//! mass = 2
//! inertia = [0.01, 0.01, 0.01]
//! velocity = [0, 0, 1]
//!
//! [[joint]]
//! name = "guide"
//! type = "translational"
//! bodies = ["ground", "block"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "friction"
//! type = "dry-friction"
//! bodies = ["ground", "block"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//! params.force = "4 N"
//!
//! [[output]]
//! name = "v"
//! quantity = "velocity"
//! of = "block"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct DryFriction(DryFrictionParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct DryFrictionParameters {
    /// The largest force along the axis, to which the input `force` is added; not given: none.
    #[param(unit = "N", min = 0.0, example = 4.0)]
    pub force: Option<f64>,
    /// The largest torque about the axis, to which the input `torque` is added; not given: none.
    #[param(unit = "N m", min = 0.0, example = 2.0)]
    pub torque: Option<f64>,
}

impl Element for DryFriction {
    const NAME: &'static str = "dry-friction";
    const SUMMARY: &'static str = "dry friction along and about a joint axis: sticks up to a limit";
    const DOC: &'static str = doc_of(include_str!("dry_friction.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    type Parameters = DryFrictionParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        match (p.force, p.torque) {
            (None, None) => Err(ParamError::new("force", "give `force`, `torque` or both")),
            _ => Ok(Self(p)),
        }
    }
}

impl DryFriction {
    fn limits(&self) -> [Option<f64>; 2] {
        [self.0.force, self.0.torque]
    }
}

impl Constraint for DryFriction {
    const ROWS: &'static [&'static str] = &[];
    const VELOCITY_ROWS: &'static [&'static str] = &["along z", "about z"];
    const INPUTS: &'static [InputSpec] = &[
        InputSpec::optional("force", "N", 0.0, "added to `force`; a sum below zero is none"),
        InputSpec::optional("torque", "N m", 0.0, "added to `torque`; a sum below zero is none"),
    ];

    fn uses_row(&self, row: usize) -> bool {
        self.limits()[row].is_some()
    }

    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}

    fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        let [i, j] = [&at.frames()[0], &at.frames()[1]];
        rows.push(i.z().dot(&at.relative_velocity_at(0, 1, j.position)));
        rows.push(at.spin_about_z(0, 1));
    }

    fn limit<S: Scalar>(&self, row: usize, at: &Motion<'_, S>) -> Option<S> {
        self.limits()[row].map(|limit| at.inputs[row] + limit)
    }
}
