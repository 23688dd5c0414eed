//! Elements that no library provides, one for each thing an element may do.

use element_api::prelude::*;

const PAIR: &[FrameSpec] = &[FrameSpec::new("i", "first body"), FrameSpec::new("j", "second body")];
const SINGLE: &[FrameSpec] = &[FrameSpec::new("on", "the body")];
const ANGLE: &[ChannelSpec] = &[ChannelSpec::new("angle", "rad", "rotation about z")];

/// How far a weld holds its second frame along z of the first, m.
pub const WELD_STEP: f64 = 0.125;

/// Names and frames of an element without parameters.
macro_rules! plain_element {
    ($type:ident, $name:literal, $frames:expr) => {
        pub struct $type;
        impl Element for $type {
            const NAME: &'static str = $name;
            const SUMMARY: &'static str = $name;
            const FRAMES: &'static [FrameSpec] = $frames;
            type Parameters = NoParameters;
            fn new(_: NoParameters) -> Result<Self, ParamError> {
                Ok(Self)
            }
        }
    };
}

/// Common z axis and common point, recorded or called at run time.
pub struct Hinge<const OPAQUE: bool>;

impl<const OPAQUE: bool> Element for Hinge<OPAQUE> {
    const NAME: &'static str = if OPAQUE { "opaque-hinge" } else { "hinge" };
    const SUMMARY: &'static str = "hinge";
    const FRAMES: &'static [FrameSpec] = PAIR;
    const ANGLES: usize = 1;
    const OPAQUE: bool = OPAQUE;
    type Parameters = NoParameters;
    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl<const OPAQUE: bool> Constraint for Hinge<OPAQUE> {
    const ROWS: &'static [&'static str] = &["x", "y", "z", "about y", "about x"];
    const COORDINATES: &'static [ChannelSpec] = ANGLE;
    const MOBILITY: Option<usize> = Some(1);
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::coincident(&at.frames[0], &at.frames[1], rows);
        blocks::parallel_z(&at.frames[0], &at.frames[1], rows);
    }
    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        Pose::screw_z(q[0], S::zero())
    }
    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.angle_about_z(0, 0, 1));
    }
}

/// Advances along z as it turns and as time goes by: rows with angle and time in them.
pub struct Screw<const OPAQUE: bool> {
    pitch: f64,
    speed: f64,
    held: bool,
}

#[derive(Parameters)]
pub struct ScrewParameters {
    /// Advance per angle.
    #[param(unit = "m/rad")]
    pitch: f64,
    /// Further advance per time.
    #[param(unit = "m/s", default = 0.0)]
    speed: f64,
    /// Whether the axes are held parallel.
    #[param(default = true)]
    held: bool,
}

impl<const OPAQUE: bool> Element for Screw<OPAQUE> {
    const NAME: &'static str = if OPAQUE { "opaque-screw" } else { "screw" };
    const SUMMARY: &'static str = "screw";
    const FRAMES: &'static [FrameSpec] = PAIR;
    const ANGLES: usize = 1;
    const OPAQUE: bool = OPAQUE;
    type Parameters = ScrewParameters;
    fn new(p: ScrewParameters) -> Result<Self, ParamError> {
        Ok(Self { pitch: p.pitch, speed: p.speed, held: p.held })
    }
}

impl<const OPAQUE: bool> Constraint for Screw<OPAQUE> {
    const ROWS: &'static [&'static str] = &["x", "y", "advance", "about y", "about x"];
    const COORDINATES: &'static [ChannelSpec] =
        &[ChannelSpec::new("angle", "rad", "rotation about z"), ChannelSpec::new("advance", "m", "along z")];
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::on_z_axis(i, j, rows);
        let advance = i.z().dot(&(j.position - i.position));
        rows.push(advance - at.angle_about_z(0, 0, 1) * self.pitch - at.time * self.speed);
        if self.held {
            blocks::parallel_z(i, j, rows);
        }
    }
    fn uses_row(&self, row: usize) -> bool {
        self.held || row < 3
    }
    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        out.push(at.angle_about_z(0, 0, 1));
        out.push(i.z().dot(&(j.position - i.position)));
    }
}

plain_element!(Ball, "ball", PAIR);

impl Constraint for Ball {
    const ROWS: &'static [&'static str] = &["x", "y", "z"];
    const MOBILITY: Option<usize> = Some(0);
    const TURNS_FREELY: bool = true;
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::coincident(&at.frames[0], &at.frames[1], rows);
    }
}

plain_element!(Weld, "weld", PAIR);

impl Constraint for Weld {
    const ROWS: &'static [&'static str] = &["x", "y", "z", "about y", "about x", "about z"];
    const COORDINATES: &'static [ChannelSpec] = &[ChannelSpec::new("gap", "m", "along z, zero")];
    const MOBILITY: Option<usize> = Some(0);
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        // Held with a step and a quarter turn between the frames, which its mobility gives.
        let (i, j) = (&at.frames[0], &at.frames[1]);
        let d = j.position - i.position;
        rows.push(i.x().dot(&d));
        rows.push(i.y().dot(&d));
        rows.push(i.z().dot(&d) - WELD_STEP);
        rows.push(i.x().dot(&j.z()));
        rows.push(i.y().dot(&j.z()));
        rows.push(i.x().dot(&j.x()));
    }
    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        out.push(i.z().dot(&(j.position - i.position)) - WELD_STEP);
    }
    fn pose<S: Scalar>(&self, _: &[S]) -> Pose<S> {
        Pose::screw_z(S::from(std::f64::consts::FRAC_PI_2), S::from(WELD_STEP))
    }
}

plain_element!(Slide, "slide", PAIR);

impl Constraint for Slide {
    const ROWS: &'static [&'static str] = &["x", "y", "about y", "about x", "about z"];
    const MOBILITY: Option<usize> = Some(1);
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::on_z_axis(&at.frames[0], &at.frames[1], rows);
        blocks::same_orientation(&at.frames[0], &at.frames[1], rows);
    }
    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        Pose::screw_z(S::zero(), q[0])
    }
}

/// Turns the second frame at a given speed: one row that depends on time.
pub struct Drive {
    speed: f64,
    jerk: f64,
}

#[derive(Parameters)]
pub struct DriveParameters {
    /// Angle per time.
    #[param(unit = "rad/s")]
    speed: f64,
    /// Angle per cubed time, six times.
    #[param(unit = "rad/s^3", default = 0.0)]
    jerk: f64,
}

impl Element for Drive {
    const NAME: &'static str = "drive";
    const SUMMARY: &'static str = "turns at a given speed";
    const FRAMES: &'static [FrameSpec] = PAIR;
    const ANGLES: usize = 1;
    type Parameters = DriveParameters;
    fn new(p: DriveParameters) -> Result<Self, ParamError> {
        Ok(Self { speed: p.speed, jerk: p.jerk })
    }
}

impl Constraint for Drive {
    const ROWS: &'static [&'static str] = &["angle"];
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let sped_up = at.time * at.time * at.time * (self.jerk / 6.0);
        rows.push(at.angle_about_z(0, 0, 1) - at.time * self.speed - sped_up);
    }
}

/// Spring and damper between two points, recorded or called at run time.
pub struct Strut<const OPAQUE: bool> {
    stiffness: f64,
    damping: f64,
    free_length: f64,
}

#[derive(Parameters)]
pub struct StrutParameters {
    /// Force per elongation.
    #[param(unit = "N/m", min = 0.0)]
    stiffness: f64,
    /// Force per speed.
    #[param(unit = "N s/m", min = 0.0, default = 0.0)]
    damping: f64,
    /// Length without force.
    #[param(unit = "m", above = 0.0, default = 1.0)]
    free_length: f64,
}

impl<const OPAQUE: bool> Element for Strut<OPAQUE> {
    const NAME: &'static str = if OPAQUE { "opaque-strut" } else { "strut" };
    const SUMMARY: &'static str = "strut";
    const FRAMES: &'static [FrameSpec] = PAIR;
    const OPAQUE: bool = OPAQUE;
    type Parameters = StrutParameters;
    fn new(p: StrutParameters) -> Result<Self, ParamError> {
        Ok(Self { stiffness: p.stiffness, damping: p.damping, free_length: p.free_length })
    }
}

impl<const OPAQUE: bool> Strut<OPAQUE> {
    /// Direction from i to j, elongation, rate of the length.
    fn line<S: Scalar>(&self, at: &Motion<'_, S>) -> (Vec3<S>, S, S) {
        let d = at.frames()[1].position - at.frames()[0].position;
        let l = length(d);
        (d / l, l - self.free_length, (d / l).dot(&at.relative_velocity(0, 1)))
    }
}

impl<const OPAQUE: bool> Force for Strut<OPAQUE> {
    const CHANNELS: &'static [ChannelSpec] =
        &[ChannelSpec::new("tension", "N", "pull"), ChannelSpec::new("rate", "m/s", "of the length")];
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let (direction, elongation, rate) = self.line(at);
        out.force_pair(0, 1, direction * (-(elongation * self.stiffness + rate * self.damping)));
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (_, elongation, rate) = self.line(at);
        out.push(elongation * self.stiffness + rate * self.damping);
        out.push(rate);
    }
    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(self.line(at).1.powi(2) * (0.5 * self.stiffness))
    }
    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(self.line(at).2.powi(2) * self.damping)
    }
}

plain_element!(Friction, "friction", PAIR);

/// Torque against the relative spin, with neither potential nor dissipation given.
impl Force for Friction {
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.torque_pair(0, 1, at.frames()[0].z() * (at.spin_about_z(0, 1) * -0.3));
    }
}

/// x' = (1 - x) / tau, started at 3.
pub struct Lag {
    tau: f64,
}

#[derive(Parameters)]
pub struct LagParameters {
    /// Time constant.
    #[param(unit = "s", above = 0.0)]
    tau: f64,
}

impl Element for Lag {
    const NAME: &'static str = "lag";
    const SUMMARY: &'static str = "a first-order lag";
    const FRAMES: &'static [FrameSpec] = SINGLE;
    type Parameters = LagParameters;
    fn new(p: LagParameters) -> Result<Self, ParamError> {
        Ok(Self { tau: p.tau })
    }
}

impl Force for Lag {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("x", "1", "the state")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("x", "1", "the state")];
    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.states[0]);
    }
    fn initial_states(&self) -> Vec<f64> {
        vec![3.0]
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push((S::one() - at.states[0]) / self.tau);
    }
}

plain_element!(Tally, "tally", SINGLE);

/// Counts accepted steps, and remembers the largest height at the end of one.
impl Force for Tally {
    const CHANNELS: &'static [ChannelSpec] =
        &[ChannelSpec::new("steps", "1", "accepted"), ChannelSpec::new("top", "m", "largest y so far")];
    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        at.memory.iter().for_each(|m| out.push(*m));
    }
    fn initial_memory(&self) -> Vec<f64> {
        vec![0.0, -1e3]
    }
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0] + 1.0);
        out.push(at.memory[1].max(at.frames()[0].position.y));
    }
}

/// Returns what it was given, one channel per number.
pub struct Echo(EchoParameters);

#[derive(Parameters)]
pub struct EchoParameters {
    /// A number with a unit and both bounds.
    #[param(unit = "N/m", min = 0.0, below = 100.0)]
    number: f64,
    /// A number with a default.
    #[param(unit = "rad", default = 0.25)]
    angle: f64,
    /// A whole number.
    #[param(min = 1.0, max = 3.0, default = 2)]
    count: i64,
    /// A switch.
    #[param(default = false)]
    on: bool,
    /// A word.
    #[param(default = "none")]
    word: String,
    /// Three numbers.
    #[param(unit = "m")]
    vector: Option<[f64; 3]>,
    /// Any number of numbers.
    #[param(unit = "s")]
    list: Option<Vec<f64>>,
    /// Pairs.
    #[param(unit = "m -> N")]
    curve: Option<Vec<[f64; 2]>>,
}

impl Element for Echo {
    const NAME: &'static str = "echo";
    const SUMMARY: &'static str = "returns what it was given";
    const FRAMES: &'static [FrameSpec] = SINGLE;
    type Parameters = EchoParameters;
    fn new(p: EchoParameters) -> Result<Self, ParamError> {
        if p.word == "forbidden" {
            return Err(ParamError::new("word", "must not be said"));
        }
        Ok(Self(p))
    }
}

impl Force for Echo {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("number", "N/m", ""),
        ChannelSpec::new("angle", "rad", ""),
        ChannelSpec::new("count", "1", ""),
        ChannelSpec::new("on", "1", ""),
        ChannelSpec::new("letters", "1", "of the word"),
        ChannelSpec::new("vector", "m", "1 x + 10 y + 100 z"),
        ChannelSpec::new("list", "s", "sum"),
        ChannelSpec::new("curve", "N", "argument + 10 value of the last pair"),
    ];
    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    fn channels<S: Scalar>(&self, _: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let p = &self.0;
        let vector = p.vector.map_or(-1.0, |v| v[0] + 10.0 * v[1] + 100.0 * v[2]);
        let curve = p.curve.as_ref().and_then(|c| c.last()).map_or(-1.0, |pair| pair[0] + 10.0 * pair[1]);
        let list = p.list.as_ref().map_or(-1.0, |l| l.iter().sum());
        let on = f64::from(u8::from(p.on));
        let numbers = [p.number, p.angle, p.count as f64, on, p.word.len() as f64, vector, list, curve];
        numbers.into_iter().for_each(|x| out.push(S::from(x)));
    }
}

/// Units that are not those of SI, or none.
pub struct InMillimetres(InMillimetresParameters);

#[derive(Parameters)]
pub struct InMillimetresParameters {
    /// Force per elongation.
    #[param(unit = "N/mm")]
    stiffness: f64,
    /// Force over a displacement.
    #[param(unit = "mm -> N")]
    force: Option<Function>,
}

impl Element for InMillimetres {
    const NAME: &'static str = "in-millimetres";
    const SUMMARY: &'static str = "declares units that numbers do not come in";
    const FRAMES: &'static [FrameSpec] = SINGLE;
    type Parameters = InMillimetresParameters;
    fn new(p: InMillimetresParameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Force for InMillimetres {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("pull", "Newton", "of the spring")];
    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    fn channels<S: Scalar>(&self, _: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let force = self.0.force.as_ref().map_or(S::zero(), |force| force.at(S::one()));
        out.push(force + self.0.stiffness);
    }
}

plain_element!(Forgetful, "forgetful", PAIR);

impl Constraint for Forgetful {
    const ROWS: &'static [&'static str] = &["x", "y"];
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(at.frames[1].position.x);
    }
}

pub struct Panics;

impl Element for Panics {
    const NAME: &'static str = "panics";
    const SUMMARY: &'static str = "panics while it is created";
    const FRAMES: &'static [FrameSpec] = SINGLE;
    type Parameters = NoParameters;
    fn new(_: NoParameters) -> Result<Self, ParamError> {
        panic!("cannot be made");
    }
}

impl Force for Panics {
    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
}

plain_element!(NoRows, "no-rows", PAIR);

impl Constraint for NoRows {
    const ROWS: &'static [&'static str] = &[];
    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}
}
