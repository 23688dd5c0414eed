//! A rope of constant length over any number of points: a tether, a block and tackle, a cable that goes round a machine.
//!
//! The rope begins at the first frame's origin and ends at the last one's; in between it runs freely, without friction, through the
//! others' (eyes, or pulleys whose radius and inertia do not count). So it has the same tension everywhere. A body may have several
//! of the points. Rope that winds on a drum comes and goes: let it end on a small slide, which a `rack-and-pinion` couples to the drum
//! (or a `displacement-driver` moves), and let the slide be further from the next point than there is rope to be wound.
//!
//! ## Equations
//!
//! With the points p_1 ... p_N, the length L and the strands s_k = |p_{k+1} - p_k|:
//!
//! | row | equation | |
//! |---|---|---|
//! | length | L - s_1 - ... - s_{N-1} = 0 | always taut |
//! | length | L - s_1 - ... - s_{N-1} >= 0 | with `slack`: unilateral, the rope only pulls |
//!
//! With `slack` the value is the slack of the rope. Where it becomes taut with the velocity v there is an impact; what the strands
//! come together with afterwards is e v, e being the coefficient of restitution.
//!
//! ## Signs
//!
//! The joint coordinate `length` is the sum of the strands. The reaction on a point in between is the tension along the two strands
//! that meet there. An output's reaction on a body that has several points is that of all of them together.
//!
//! ## Singular cases
//!
//! A strand has no direction where its two points coincide: a load that is drawn up to its pulley needs a stop before it. Points of
//! one body that follow each other make a strand of constant length.
//!
//! ## Example
//!
//! A block and tackle: the load hangs on two strands, the counterweight on one.
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 0.5
//! output_step = 0.05
//!
//! [[body]]
//! name = "load"
//! mass = 10
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.1, 0, -2]
//!
//! [[body]]
//! name = "weight"
//! mass = 4
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.4, 0, -1]
//!
//! [[joint]]
//! name = "guide"
//! type = "translational"
//! bodies = ["ground", "load"]
//! point = [0.1, 0, -2]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "other_guide"
//! type = "translational"
//! bodies = ["ground", "weight"]
//! point = [0.4, 0, -1]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "tackle"
//! type = "rope"
//! bodies = ["ground", "load", "ground", "weight"]
//! points = [[0.1, 0, 0], [0.1, 0, -2], [0.4, 0, 0], [0.4, 0, -1]]
//! params.length = "3 + sqrt(4.09)"
//!
//! [[output]]
//! name = "z"
//! quantity = "position"
//! of = "load"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Rope(RopeParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct RopeParameters {
    /// Length of all strands together.
    #[param(unit = "m", above = 0.0)]
    pub length: f64,
    /// The rope may hang loose; it then only pulls.
    #[param(default = false)]
    pub slack: bool,
    /// Coefficient of restitution of a rope that becomes taut, 0 to 1.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    pub restitution: f64,
}

impl Element for Rope {
    const NAME: &'static str = "rope";
    const SUMMARY: &'static str = "rope of constant length over any number of points";
    const DOC: &'static str = doc_of(include_str!("rope.rs"));
    const GLYPH: &'static str = "none";
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("begin", "on the first body; its origin is where the rope begins"),
        FrameSpec::new("next", "on the second body; its origin is where the rope goes next"),
    ];
    const MORE_FRAMES: Option<FrameSpec> =
        Some(FrameSpec::new("point", "its origin is where the rope goes next; the last one's is where it ends"));
    type Parameters = RopeParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        if !p.slack && p.restitution != 0.0 {
            return Err(ParamError::new("restitution", "applies to a rope with `slack` only"));
        }
        Ok(Self(p))
    }
}

impl Constraint for Rope {
    const ROWS: &'static [&'static str] = &["length"];
    const COORDINATES: &'static [ChannelSpec] = &[ChannelSpec::new("length", "m", "sum of the strands")];

    fn unilateral(&self, _: usize) -> Option<f64> {
        self.0.slack.then_some(self.0.restitution)
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(-strands(at) + self.0.length);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(strands(at));
    }
}

/// The sum of the strands, m.
fn strands<S: Scalar>(at: &Configuration<'_, S>) -> S {
    let pairs = at.frames().windows(2);
    pairs.fold(S::zero(), |sum, pair| sum + length(pair[1].position - pair[0].position))
}
