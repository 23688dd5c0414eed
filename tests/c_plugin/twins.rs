//! The elements of the C library, written in Rust.

use super::*;

/// `rod` of the C library.
pub struct Rod {
    length: f64,
    amplitude: f64,
    rate: f64,
}

#[derive(Parameters)]
pub struct RodParameters {
    /// Distance of the two points.
    #[param(unit = "m", above = 0.0)]
    length: f64,
    /// By how much it swings.
    #[param(unit = "m", default = 0.0, min = 0.0)]
    amplitude: f64,
    /// How fast it swings.
    #[param(unit = "rad/s")]
    rate: Option<f64>,
}

const TWO_ENDS: &[FrameSpec] = &[FrameSpec::new("i", "first end"), FrameSpec::new("j", "second end")];

impl Element for Rod {
    const NAME: &'static str = "rod";
    const SUMMARY: &'static str = "massless rod between two points";
    const FRAMES: &'static [FrameSpec] = TWO_ENDS;
    type Parameters = RodParameters;

    fn new(p: RodParameters) -> Result<Self, ParamError> {
        if p.amplitude >= p.length {
            return Err(ParamError::new("amplitude", "must be smaller than the length"));
        }
        Ok(Self { length: p.length, amplitude: p.amplitude, rate: p.rate.unwrap_or(1.0) })
    }
}

impl Constraint for Rod {
    const ROWS: &'static [&'static str] = &["distance"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let d = at.frames[1].position - at.frames[0].position;
        let swing = (at.time * self.rate).sin() * self.amplitude;
        rows.push(length(d) - (swing + self.length));
    }
}

/// `strut` of the C library.
pub struct Strut {
    damping: f64,
    delay: f64,
    start: f64,
    bump: Table,
    straight: Table,
    law: Function,
}

#[derive(Parameters)]
pub struct StrutParameters {
    /// Force per speed.
    #[param(unit = "N s/m", default = 0.0, min = 0.0)]
    damping: f64,
    /// Time constant of the filter.
    #[param(unit = "s", above = 0.0)]
    delay: f64,
    /// Length behind the filter at the start.
    #[param(unit = "m")]
    start: f64,
    /// Force over length, four points.
    #[param(unit = "m -> N", example = vec![[0.0, 0.0], [1.0, 0.0], [1.5, 4.0], [2.0, 5.0]])]
    bump: Vec<[f64; 2]>,
    /// Force over length.
    #[param(unit = "m -> N", variable = "l")]
    law: Function,
}

impl Element for Strut {
    const NAME: &'static str = "strut";
    const SUMMARY: &'static str = "spring behind a filter";
    const FRAMES: &'static [FrameSpec] = TWO_ENDS;
    type Parameters = StrutParameters;

    fn new(p: StrutParameters) -> Result<Self, ParamError> {
        let bump = Table::clamped(&p.bump)?;
        let straight = Table::through(&p.bump, Interpolation::Linear, Outside::Clamped)?;
        Ok(Self { damping: p.damping, delay: p.delay, start: p.start, bump, straight, law: p.law })
    }
}

impl Strut {
    fn pull<S: Scalar>(&self, at: &Motion<'_, S>) -> (Vec3<S>, S, S) {
        let d = at.frames()[1].position - at.frames()[0].position;
        let far = length(d);
        let along = d * (S::one() / far);
        let speed = at.relative_velocity(0, 1).dot(&along);
        let law = self.law.at(at.states[0]) + (at.states[0].lookup(&self.bump) + at.states[0].lookup(&self.straight));
        (along, law + speed * self.damping, far)
    }
}

impl Force for Strut {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("pull", "N", "force towards each other")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("filtered", "m", "length behind the filter")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let (along, pull, _) = self.pull(at);
        out.force_pair(0, 1, along * -pull);
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.pull(at).1);
    }
    fn initial_states(&self) -> Vec<f64> {
        vec![self.start]
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push((self.pull(at).2 - at.states[0]) * (1.0 / self.delay));
    }
}

/// `called-hinge` of the C library, recorded.
pub struct Hinge;

impl Element for Hinge {
    const NAME: &'static str = "called-hinge";
    const SUMMARY: &'static str = "hinge that is called with numbers";
    const FRAMES: &'static [FrameSpec] = TWO_ENDS;
    const ANGLES: usize = 1;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Hinge {
    const ROWS: &'static [&'static str] = &["x", "y", "z", "about y", "about x"];
    const COORDINATES: &'static [ChannelSpec] = &[ChannelSpec::new("angle", "rad", "rotation about z")];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::coincident(&at.frames[0], &at.frames[1], rows);
        blocks::parallel_z(&at.frames[0], &at.frames[1], rows);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.angle_about_z(0, 0, 1));
    }
}

/// `called-drag` of the C library, recorded.
pub struct Drag {
    factor: f64,
}

#[derive(Parameters)]
pub struct DragParameters {
    /// Force per speed.
    #[param(unit = "N s/m", min = 0.0)]
    factor: f64,
}

impl Element for Drag {
    const NAME: &'static str = "called-drag";
    const SUMMARY: &'static str = "linear drag that is called with numbers";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("body", "where it pulls")];
    type Parameters = DragParameters;

    fn new(p: DragParameters) -> Result<Self, ParamError> {
        Ok(Self { factor: p.factor })
    }
}

impl Force for Drag {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("steps", "", "accepted steps")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force(0, at.twists[0].velocity * S::from(-self.factor));
    }
    fn channels<S: Scalar>(&self, _: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(S::zero());
    }
    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(at.twists[0].velocity.dot(&at.twists[0].velocity) * self.factor)
    }
}

/// `blade` of the C library.
pub struct Blade;

impl Element for Blade {
    const NAME: &'static str = "blade";
    const SUMMARY: &'static str = "a point does not move across its blade";
    const FRAMES: &'static [FrameSpec] = TWO_ENDS;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Blade {
    const ROWS: &'static [&'static str] = &[];
    const VELOCITY_ROWS: &'static [&'static str] = &["across"];

    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}

    fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        let d = at.frames()[1].position - at.frames()[0].position;
        let carried = at.twists[0].angular_velocity.cross(&d);
        rows.push(at.frames()[1].z().dot(&(at.relative_velocity(0, 1) - carried)));
    }
}

/// `wind` of the C library.
pub struct Wind(f64);

#[derive(Parameters)]
pub struct WindParameters {
    /// Between two samples.
    #[param(unit = "s", above = 0.0, example = 0.25)]
    period: f64,
}

impl Element for Wind {
    const NAME: &'static str = "wind";
    const SUMMARY: &'static str = "drag that holds what it measured";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("body", "where it pulls")];
    const EXEMPT: &'static [(&'static str, &'static str)] = &[("frame-invariance", "it blows along x of the ground")];
    type Parameters = WindParameters;

    fn new(p: WindParameters) -> Result<Self, ParamError> {
        Ok(Self(p.period))
    }
}

impl Force for Wind {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("held", "m/s", "speed at the last sample")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force(0, Vec3::new(-at.memory[0], S::zero(), S::zero()));
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0]);
    }
    fn initial_memory(&self) -> Vec<f64> {
        vec![0.0]
    }
    fn sample_period(&self) -> Option<f64> {
        Some(self.0)
    }
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.twists[0].velocity.x);
    }
}
