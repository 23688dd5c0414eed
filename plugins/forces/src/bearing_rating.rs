//! A rolling bearing in a joint: it acts on nothing, but takes the joint's reaction and speed and compares them with the ratings of a
//! deep-groove ball bearing. It warns of loads beyond its static rating, beyond half its dynamic rating, and of too high a speed.
//!
//! ## Equations
//! F_r and F_a are the parts of the joint's reaction across its axis z_i and along it, w = z_i . (omega_j - omega_i):
//!
//! ```text
//! P0 = max(F_r, 0.6 F_r + 0.5 F_a)                      S0 = C0 / P0                                     (1)
//! P  = max(F_r, 0.56 F_r + Y F_a)                       Y = Y(f0 F_a / C0)                               (2)
//! n' = |w| / (2 pi)                                     D' = n' (P / C)^3 / 10^6                         (3)
//! L10 = (C / P)^3 millions of turns,  in all n / D  turns for the load as it went                        (4)
//! ```
//!
//! (1): ISO 76, radial ball bearings. (2) and L10: ISO 281, table of factors for deep-groove bearings of normal clearance; its Y lies between
//! 2.3 and 1, linear between the values of the table, and the greater of the two forms is the one that applies. (3): turns n, and
//! the share D of the life that is used, by Palmgren and Miner's linear rule.
//!
//! ## Signs
//! `load` is P and `static_load` P0, not negative; `turns` and `life_used` count from the start, in either direction.
//!
//! Margins of its checks are positive while all is well: the static load as C0 / `static_safety` - P0; (2) holds up to P = C / 2; the speed is judged
//! as `limiting_speed` - |w|. Torques across the axis are not looked at: one bearing carries none. Shared between redundant joints, a
//! reaction is not unique, and neither is what is reported here (ODY0322).
//!
//! ## Singular cases
//! Without load, the life is endless: D' = 0.
//!
//! ## Example
//! ```toml
//! title = "A pulley on its bearing"
//!
//! [plugins]
//! libraries = ["odyn-joints", "odyn-forces"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 1
//! output_step = 0.1
//!
//! [[body]]
//! name = "pulley"
//! mass = 40
//! inertia = [1, 1, 1]
//! angular_velocity = [0, 50, 0]
//!
//! [[joint]]
//! name = "hub"
//! type = "revolute"
//! bodies = ["ground", "pulley"]
//! point = [0, 0, 0]
//! axis = [0, 1, 0]
//!
//! [[force]]
//! name = "bearing"
//! type = "bearing-rating"
//! joints = ["hub"]
//! params = { use = "6204", static_safety = 1.5 }
//!
//! [[output]]
//! name = "load"
//! quantity = "value"
//! of = "bearing"
//! channel = "load"
//! ```

use element_api::prelude::*;

/// f0 F_a / C0 and Y of ISO 281 for deep-groove ball bearings of normal clearance.
const AXIAL: [[f64; 2]; 9] = [
    [0.172, 2.30],
    [0.345, 1.99],
    [0.689, 1.71],
    [1.03, 1.55],
    [1.38, 1.45],
    [2.07, 1.31],
    [3.45, 1.15],
    [5.17, 1.04],
    [6.89, 1.00],
];

/// The element.
#[derive(Debug, Clone)]
pub struct BearingRating {
    parameters: BearingRatingParameters,
    axial: Table,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct BearingRatingParameters {
    /// Basic dynamic load rating, C.
    #[param(unit = "N", above = 0.0, example = 12800.0)]
    pub dynamic_rating: f64,
    /// Basic static load rating, C0.
    #[param(unit = "N", above = 0.0, example = 6600.0)]
    pub static_rating: f64,
    /// Factor of the axial load, f0.
    #[param(unit = "1", above = 0.0, default = 13.0)]
    pub factor: f64,
    /// Angular velocity up to which it may be used.
    #[param(unit = "rad/s", above = 0.0)]
    pub limiting_speed: Option<f64>,
    /// Static safety that is wanted: C0 over P0.
    #[param(unit = "1", above = 0.0, default = 1.0)]
    pub static_safety: f64,
}

/// What is known of the load at an instant.
struct Load<S> {
    statically: S,
    dynamically: S,
    speed: S,
}

impl BearingRating {
    fn load<S: Scalar>(&self, at: &Motion<'_, S>) -> Load<S> {
        let p = &self.parameters;
        let axis = at.frames()[0].z();
        let force = at.reactions[0].force;
        let along = force.dot(&axis);
        let (radial, axial) = (length(force - axis * along), along.abs());
        let y = (axial * (p.factor / p.static_rating)).lookup(&self.axial);
        let speed = axis.dot(&(at.twists[1].angular_velocity - at.twists[0].angular_velocity)).abs();
        Load {
            statically: radial.max(radial * 0.6 + axial * 0.5),
            dynamically: radial.max(radial * 0.56 + y * axial),
            speed,
        }
    }
}

impl Element for BearingRating {
    const NAME: &'static str = "bearing-rating";
    const SUMMARY: &'static str =
        "compares a joint's reaction and speed with the ratings of a ball bearing; acts on nothing";
    const DOC: &'static str = doc_of(include_str!("bearing_rating.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "that of the joint on its first body; its z axis is the joint's"),
        FrameSpec::new("j", "that of the joint on its last body"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    const GLYPH: &'static str = "none";
    const CATALOG: &'static str = include_str!("bearings.csv");
    const REPORT: &'static str = "Deep-groove ball bearing by **ISO 281** and **ISO 76**. `load` is the equivalent dynamic load, `static_load` the \
        equivalent static one; `turns` over `life_used` is the rated life in turns, reached by nine of ten bearings, for the load as it went.";
    type Parameters = BearingRatingParameters;

    fn new(parameters: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { parameters, axial: Table::through(&AXIAL, Interpolation::Linear, Outside::Clamped)? })
    }
}

impl Force for BearingRating {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("load", "N", "equivalent dynamic load P"),
        ChannelSpec::new("static_load", "N", "equivalent static load P0"),
        ChannelSpec::new("turns", "1", "turns since the start"),
        ChannelSpec::new("life_used", "1", "share of the rated life used since the start"),
    ];
    const STATES: &'static [ChannelSpec] =
        &[ChannelSpec::new("turns", "1", "turns"), ChannelSpec::new("millionths", "1", "millionths of the life")];
    const JOINTS: &'static [FrameSpec] = &[FrameSpec::new("joint", "the joint that the bearing makes")];
    const CHECKS: &'static [ChannelSpec] = &[
        ChannelSpec::new("static load", "N", "is loaded beyond its static rating"),
        ChannelSpec::new(
            "dynamic load",
            "N",
            "is loaded beyond half its dynamic rating, where its rated life means nothing",
        ),
        ChannelSpec::new("speed", "rad/s", "turns faster than it may"),
    ];

    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (1), (2)
        let load = self.load(at);
        out.push(load.dynamically);
        out.push(load.statically);
        out.push(at.states[0]);
        out.push(at.states[1] * 1e-6);
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (3)
        let load = self.load(at);
        let turns = load.speed / std::f64::consts::TAU;
        out.push(turns);
        out.push(turns * (load.dynamically / self.parameters.dynamic_rating).powi(3));
    }

    fn checks<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (p, load) = (&self.parameters, self.load(at));
        out.push(S::from(p.static_rating / p.static_safety) - load.statically);
        out.push(S::from(0.5 * p.dynamic_rating) - load.dynamically);
        // Without a limit, nothing is too fast.
        out.push(p.limiting_speed.map_or_else(|| S::from(1.0), |limit| S::from(limit) - load.speed));
    }
}
