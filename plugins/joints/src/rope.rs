//! A rope over any number of points, of constant length or wound on drums: a tether, a block and tackle, a winch, a hoist.
//!
//! The rope begins at the first frame's origin and ends at the last one's; in between it runs freely, without friction, through the
//! others' (eyes, or pulleys whose radius and inertia do not count). So it has the same tension everywhere. A body may have several
//! of the points.
//!
//! With `begin_drum`, a radius, the first body is a drum, and the rope begins at the second frame: the place on the frame of the winch
//! where it comes from the drum. With `end_drum` the last body is one, and the rope ends at the last but one. A drum is any body that
//! turns in the winch; a motor, a brake or a `clutch` acts on it, or nothing does.
//!
//! ## Equations
//!
//! With the points p_1 ... p_N, the length L, the strands s_k = |p_{k+1} - p_k| and, of each drum, its radius r and the angle phi by which it
//! is turned against the frame where the rope leaves it, about z of that (over many turns, zero where the axes x are the same):
//!
//! | row | equation | |
//! |---|---|---|
//! | length | L - r_1 phi_1 - r_2 phi_2 - s_1 - ... - s_{N-1} = 0 | always taut |
//! | length | L - r_1 phi_1 - r_2 phi_2 - s_1 - ... - s_{N-1} >= 0 | with `slack`: unilateral, the rope only pulls |
//!
//! A drum that turns to the left about z takes rope in: let z point the other way if yours gives it out then. The rope is without mass and
//! thin: its layers do not change the radius, and a drum gives out as much as it is asked for.
//!
//! With `slack` the value is the slack of the rope. Where it becomes taut with the velocity v there is an impact; what the strands
//! come together with afterwards is e v, e being the coefficient of restitution.
//!
//! ## Signs
//!
//! The joint coordinate `length` is the sum of the strands: what is not wound. The reaction on a point in between is the tension along the
//! two strands that meet there. An output's reaction on a body that has several points is that of all of them together. A drum gets the
//! torque r times the tension, which turns it to the right about z; the opposite torque, and the force, are on the frame of the
//! winch at the place where the rope leaves the drum, which is what the drum's bearings hand on.
//!
//! ## Singular cases
//!
//! A strand has no direction where its two points coincide: a load that is drawn up to its pulley needs a stop before it. Points of
//! one body that follow each other make a strand of constant length. The place where the rope leaves a drum stays where it is on the frame
//! of the winch: a fairlead, a level wind, a first pulley; or the strand behind it is long beside the drum.
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
//!
//! A winch, whose drum turns about the same axis; a load on a drum with the moment of inertia J that nothing holds falls with
//! g / (1 + J / (m r^2)):
//!
//! ```text
//! [[joint]]
//! name = "winch"
//! type = "rope"
//! bodies = ["drum", "ground", "load"]
//! frames = [
//!     { position = [0, 0, 0], axis = [0, -1, 0] },
//!     { position = [0.2, 0, 0], axis = [0, -1, 0] },
//!     { position = [0, 0, 0] },
//! ]
//! params = { length = 1, begin_drum = 0.2 }
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Rope(RopeParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct RopeParameters {
    /// Length of all strands together, where drums are not turned.
    #[param(unit = "m", above = 0.0)]
    pub length: f64,
    /// The rope may hang loose; it then only pulls.
    #[param(default = false)]
    pub slack: bool,
    /// Coefficient of restitution of a rope that becomes taut, 0 to 1.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    pub restitution: f64,
    /// Radius of the drum that is the first body: the rope begins at the second frame, where it leaves the drum.
    #[param(unit = "m", above = 0.0)]
    pub begin_drum: Option<f64>,
    /// Radius of the drum that is the last body: the rope ends at the last frame but one, where it leaves the drum.
    #[param(unit = "m", above = 0.0)]
    pub end_drum: Option<f64>,
}

impl Element for Rope {
    const NAME: &'static str = "rope";
    const SUMMARY: &'static str = "rope over any number of points, of constant length or wound on drums";
    const ANGLES: usize = 2;
    const DOC: &'static str = doc_of(include_str!("rope.rs"));
    const GLYPH: &'static str = "none";
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new(
            "begin",
            "on the first body; its origin is where the rope begins (a drum: its z axis is that of the next one)",
        ),
        FrameSpec::new(
            "next",
            "on the second body; its origin is where the rope goes next (leaves the drum; its z axis is that of the drum)",
        ),
    ];
    const MORE_FRAMES: Option<FrameSpec> = Some(FrameSpec::new(
        "point",
        "its origin is where the rope goes next; the last one's is where it ends, or a drum",
    ));
    type Parameters = RopeParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        if !p.slack && p.restitution != 0.0 {
            return Err(ParamError::new("restitution", "applies to a rope with `slack` only"));
        }
        Ok(Self(p))
    }

    fn with_frames(self, count: usize) -> Result<Self, ParamError> {
        let drums = [self.0.begin_drum, self.0.end_drum].into_iter().flatten().count();
        if count < 2 + drums {
            let words = format!(
                "a rope with {drums} drum{} connects {} bodies or more: each drum, the body on which the rope leaves it, and where \
                 the rope goes",
                if drums == 1 { "" } else { "s" },
                2 + drums
            );
            return Err(ParamError::new("bodies", words));
        }
        Ok(self)
    }
}

impl Constraint for Rope {
    const ROWS: &'static [&'static str] = &["length"];
    const COORDINATES: &'static [ChannelSpec] = &[ChannelSpec::new("length", "m", "sum of the strands")];

    fn unilateral(&self, _: usize) -> Option<f64> {
        self.0.slack.then_some(self.0.restitution)
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(-self.strands(at) - self.wound(at) + self.0.length);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.strands(at));
    }
}

impl Rope {
    /// The sum of the strands, m.
    fn strands<S: Scalar>(&self, at: &Configuration<'_, S>) -> S {
        let frames = at.frames();
        let points = usize::from(self.0.begin_drum.is_some())..frames.len() - usize::from(self.0.end_drum.is_some());
        let pairs = frames[points].windows(2);
        pairs.fold(S::zero(), |sum, pair| sum + length(pair[1].position - pair[0].position))
    }

    /// What drums have taken in, m.
    fn wound<S: Scalar>(&self, at: &Configuration<'_, S>) -> S {
        let last = at.frames().len() - 1;
        let begin = self.0.begin_drum.map(|radius| at.angle_about_z(0, 1, 0) * radius);
        let end = self.0.end_drum.map(|radius| at.angle_about_z(1, last - 1, last) * radius);
        [begin, end].into_iter().flatten().fold(S::zero(), |sum, wound| sum + wound)
    }
}
