//! Elements that are given curves.

use element_api::params::{ParamKind, ParamType};
use element_api::prelude::*;

/// A force along z over time, and one over the speed.
pub struct Pull(PullParameters);

#[derive(Parameters)]
pub struct PullParameters {
    /// Force over time.
    #[param(unit = "s -> N", variable = "t")]
    of_time: Option<Function>,
    /// Force over speed.
    #[param(unit = "m/s -> N")]
    of_speed: Option<Curve>,
    /// The same, with an author who thinks of splines only.
    #[param(unit = "m/s -> N")]
    of_rate: Option<Vec<[f64; 2]>>,
}

impl Element for Pull {
    const NAME: &'static str = "pull";
    const SUMMARY: &'static str = "force by curves";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("on", "the body")];
    type Parameters = PullParameters;
    fn new(p: PullParameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Force for Pull {
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let mut force = self.0.of_time.as_ref().map_or(S::zero(), |f| f.at(at.time()));
        let speed = at.twists[0].velocity.z;
        if let Some(curve) = &self.0.of_speed {
            force += speed.lookup(&curve.table(Outside::Clamped).expect("sound"));
        }
        if let Some(points) = &self.0.of_rate {
            force += speed.lookup(&Table::clamped(points).expect("sound"));
        }
        out.force(0, Vec3::new(S::zero(), S::zero(), force));
    }
}

/// Leads a point of the second body along z of the first, over time.
pub struct Lead {
    way: Function,
}

#[derive(Parameters)]
pub struct LeadParameters {
    /// Way over time.
    #[param(unit = "s -> m", variable = "t")]
    way: Function,
}

impl Element for Lead {
    const NAME: &'static str = "lead";
    const SUMMARY: &'static str = "leads a point over time";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "first body"), FrameSpec::new("j", "second body")];
    type Parameters = LeadParameters;
    fn new(p: LeadParameters) -> Result<Self, ParamError> {
        Ok(Self { way: p.way })
    }
}

impl Constraint for Lead {
    const ROWS: &'static [&'static str] = &["along z"];
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let d = at.frames[1].position - at.frames[0].position;
        rows.push(at.frames[0].z().dot(&d) - self.way.at(at.time));
    }
}

/// Built when all points were joined by splines.
pub struct Early {
    force: SplineOnly,
}

/// Reads what [`Function`] reads, and ignores what it does not know.
pub struct SplineOnly(Function);

impl ParamType for SplineOnly {
    const KIND: ParamKind = ParamKind::Function;
    fn read_value(value: &toml::Value) -> Option<Self> {
        let points = Vec::<[f64; 2]>::read_value(value.get("points").unwrap_or(value))?;
        Function::through(&points, false).ok().map(Self)
    }
    fn write(&self) -> toml::Value {
        self.0.write()
    }
}

#[derive(Parameters)]
pub struct EarlyParameters {
    /// Force over time.
    #[param(unit = "s -> N", variable = "t")]
    force: SplineOnly,
}

impl Element for Early {
    const NAME: &'static str = "early";
    const SUMMARY: &'static str = "of a library that knows splines only";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("on", "the body")];
    type Parameters = EarlyParameters;
    fn new(p: EarlyParameters) -> Result<Self, ParamError> {
        Ok(Self { force: p.force })
    }
}

impl Force for Early {
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force(0, Vec3::new(S::zero(), S::zero(), self.force.0.at(at.time())));
    }
}
