//! Elements whose states make trouble.

use std::sync::atomic::{AtomicU32, Ordering};

use element_api::prelude::*;

const SINGLE: &[FrameSpec] = &[FrameSpec::new("on", "the body")];
const STATE: &[ChannelSpec] = &[ChannelSpec::new("x", "1", "the state")];

/// x' = `before` where x < 0, `after` + `slope` x elsewhere; started at -0.5.
pub struct Relay(RelayParameters);

#[derive(Parameters)]
pub struct RelayParameters {
    /// Rate below zero.
    #[param(default = 1.0)]
    before: f64,
    /// Rate at zero.
    after: f64,
    /// How the rate continues from there.
    #[param(default = 0.0)]
    slope: f64,
}

impl Element for Relay {
    const NAME: &'static str = "relay";
    const SUMMARY: &'static str = "a rate that switches";
    const FRAMES: &'static [FrameSpec] = SINGLE;
    type Parameters = RelayParameters;
    fn new(p: RelayParameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Force for Relay {
    const CHANNELS: &'static [ChannelSpec] = STATE;
    const STATES: &'static [ChannelSpec] = STATE;
    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.states[0]);
    }
    fn initial_states(&self) -> Vec<f64> {
        vec![-0.5]
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let x = at.states[0];
        out.push(S::select(x, S::zero(), S::from(self.0.before), x * self.0.slope + self.0.after));
    }
}

/// x' = -sqrt(x), started at 1: no number follows after two seconds.
pub struct Drain;

impl Element for Drain {
    const NAME: &'static str = "drain";
    const SUMMARY: &'static str = "a tank that runs empty";
    const FRAMES: &'static [FrameSpec] = SINGLE;
    type Parameters = NoParameters;
    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Force for Drain {
    const CHANNELS: &'static [ChannelSpec] = STATE;
    const STATES: &'static [ChannelSpec] = STATE;
    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.states[0]);
    }
    fn initial_states(&self) -> Vec<f64> {
        vec![1.0]
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(-at.states[0].sqrt());
    }
}

/// x' = 1, but half of that where |x| < `width`; started at -0.45.
pub struct Sill {
    width: f64,
}

#[derive(Parameters)]
pub struct SillParameters {
    /// Half of it.
    width: f64,
}

impl Element for Sill {
    const NAME: &'static str = "sill";
    const SUMMARY: &'static str = "a rate that switches there and back";
    const FRAMES: &'static [FrameSpec] = SINGLE;
    type Parameters = SillParameters;
    fn new(p: SillParameters) -> Result<Self, ParamError> {
        Ok(Self { width: p.width })
    }
}

impl Force for Sill {
    const CHANNELS: &'static [ChannelSpec] = STATE;
    const STATES: &'static [ChannelSpec] = STATE;
    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.states[0]);
    }
    fn initial_states(&self) -> Vec<f64> {
        vec![-0.45]
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let x = at.states[0];
        out.push(S::select(x * x, S::from(self.width * self.width), S::from(0.5), S::one()));
    }
}

/// Panics from a number of evaluations on.
pub struct Fails {
    left: AtomicU32,
}

#[derive(Parameters)]
pub struct FailsParameters {
    /// How many evaluations it survives.
    after: i64,
}

impl Element for Fails {
    const NAME: &'static str = "fails";
    const SUMMARY: &'static str = "works for a while";
    const FRAMES: &'static [FrameSpec] = SINGLE;
    const OPAQUE: bool = true;
    type Parameters = FailsParameters;
    fn new(p: FailsParameters) -> Result<Self, ParamError> {
        Ok(Self { left: AtomicU32::new(p.after as u32) })
    }
}

impl Force for Fails {
    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {
        let left = self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1));
        assert!(left.is_ok(), "worn out");
    }
}
