//! A wheel on a rail: a round disc on the second body touches an open profile of the first, given by its height over the way along it
//! (points of a file, or a function): track with dips and joints, a hump, the head of a rail in a cross-section. The place of the contact
//! is found. The disc slides without friction; it stays in contact, or may part (`unilateral = true`). The plane motion is held by other
//! joints.
//!
//! ## Equations
//!
//! In the x-y plane of frame i, with the profile p(x) = o_i + x x_i + h(x) y_i, its upper normal n across it, c the origin of frame j and R the
//! radius of the disc. The place x is an internal unknown (Shabana, Zaazaa & Sugiyama, Railroad Vehicle Dynamics (2008), chapter 3):
//!
//! | | equation |
//! |---|---|
//! | condition | x_i . (c - p - R n / abs(n)) = 0 |
//! | row `gap` | n . (c - p) / abs(n) - R = 0 |
//!
//! A disc that touches at x has its centre at p + R n / abs(n). These centres are a curve above the profile that does not turn back, since the
//! disc fits into it: over every c there is one place, and the row, the height of c above this curve times the cosine of the slope, has
//! the sign of the distance, however far apart the bodies are. Where they touch it is the distance.
//!
//! With `unilateral` the row is positive while the bodies are apart and never negative; where it closes with a velocity they strike, with the
//! coefficient of restitution.
//!
//! ## Signs
//!
//! The rail's material lies below the profile, against y_i. The row's reaction pushes the bodies apart. The coordinate `place` is x: where the
//! bodies touch, or would if the disc came down along y_i.
//!
//! ## Singular cases
//!
//! The profile lies between `from` and `to`. Where the contact leaves it the run ends, and the message names the joint and its unknown
//! `place`. The disc must fit into the profile: where this is hollow with a radius below R, or has an inner corner, the joint is refused, because
//! the disc would touch in two places. This is proved from bounds of the slope and its changes on whole stretches of the profile; where it
//! cannot be shown (kilometres of steep waves into which the disc barely fits), the joint is refused, too. Outer corners are allowed, and a
//! point (R = 0) fits everywhere. Points are joined by a cubic spline, so that forces are continuous; `linear` and `monotone` are refused. They hold
//! their end values, with a corner where they do not end level: let `from` and `to` be within them.
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
//! output_step = 0.01
//!
//! [[body]]
//! name = "wheel"
//! mass = 1.0
//! inertia = [0.01, 0.01, 0.01]
//! position = [0, 0, 0.2]
//! velocity = [1, 0, 0]
//!
//! [[joint]]
//! name = "plane"
//! type = "planar"
//! bodies = ["ground", "wheel"]
//! axis = [0, 1, 0]
//!
//! [[joint]]
//! name = "contact"
//! type = "rail-contact"
//! bodies = ["ground", "wheel"]
//! points = [[0, 0, 0], [0, 0, 0.2]]
//! axis = [0, -1, 0]
//! x_axis = [1, 0, 0]
//! params.height = "0.1 * cos(x)"
//! params.from = -0.5
//! params.to = 5
//! params.wheel_radius = 0.1
//!
//! [[output]]
//! name = "height"
//! quantity = "position"
//! of = "wheel"
//! component = "z"
//! ```

use element_api::prelude::*;

use crate::profile::{Follower, Profile};

/// The joint.
#[derive(Debug, Clone)]
pub struct RailContact {
    profile: Profile,
    ends: [f64; 2],
    wheel: f64,
    start: f64,
    restitution: Option<f64>,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct RailContactParameters {
    /// Height of the profile over the way along it.
    #[param(unit = "m -> m", variable = "x", example = Function::constant(0.05))]
    pub height: Function,
    /// Where the profile begins.
    #[param(unit = "m", example = -2.0)]
    pub from: f64,
    /// Where it ends.
    #[param(unit = "m", example = 2.0)]
    pub to: f64,
    /// Radius of the disc; 0: a point.
    #[param(unit = "m", min = 0.0)]
    pub wheel_radius: f64,
    /// Place on the profile from which the contact is looked for at the start.
    #[param(unit = "m", default = 0.0)]
    pub start: f64,
    /// The bodies may part; where they come together they strike.
    #[param(default = false)]
    pub unilateral: bool,
    /// Coefficient of restitution of a unilateral contact, 0 to 1.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    pub restitution: f64,
}

impl Element for RailContact {
    const NAME: &'static str = "rail-contact";
    const SUMMARY: &'static str = "a wheel touches a rail whose profile is given, without friction";
    const DOC: &'static str = doc_of(include_str!("rail_contact.rs"));
    const GLYPH: &'static str = "none";
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the rail; the profile is in its x-y plane, the material against y"),
        FrameSpec::new("j", "on the wheel; its origin is the centre"),
    ];
    const UNKNOWNS: &'static [ChannelSpec] =
        &[ChannelSpec::new("place", "m", "where along the profile the bodies touch")];
    type Parameters = RailContactParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let refused = |name: &str, why: String| Err(ParamError::new(name, why));
        if p.from >= p.to {
            return refused("to", "must be above `from`".into());
        }
        if !(p.from..=p.to).contains(&p.start) {
            return refused("start", "must lie on the profile, between `from` and `to`".into());
        }
        let profile = Profile::Graph(p.height);
        if let Some(misfit) = profile.misfit(Follower::Round(p.wheel_radius), p.from, p.to) {
            return refused("wheel_radius", misfit.round(p.wheel_radius, "the wheel", "m"));
        }
        let restitution = p.unilateral.then_some(p.restitution);
        Ok(Self { profile, ends: [p.from, p.to], wheel: p.wheel_radius, start: p.start, restitution })
    }

    fn initial_unknowns(&self) -> Vec<f64> {
        vec![self.start]
    }

    fn conditions<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let x = at.unknowns()[0];
        let along = i.x().dot(&(j.position - self.profile.place(i, x).centre(self.wheel)));
        // Beyond its ends there is no profile, and no number.
        let [from, to] = self.ends;
        let before_end = select(x.above(to), (-(x - to)).sqrt(), along);
        out.push(select(x.below(from), (x - from).sqrt(), before_end));
    }
}

impl Constraint for RailContact {
    const ROWS: &'static [&'static str] = &["gap"];
    const COORDINATES: &'static [ChannelSpec] = Self::UNKNOWNS;

    fn unilateral(&self, _: usize) -> Option<f64> {
        self.restitution
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let place = self.profile.place(i, at.unknowns()[0]);
        rows.push(place.normal.dot(&(j.position - place.point)) / length(place.normal) - self.wheel);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.unknowns()[0]);
    }
}
