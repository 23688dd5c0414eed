//! A Maxwell element: a spring and a dashpot one behind the other, along the line between two points.
//!
//! The state is the length s that the dashpot has given way. With the distance l, the tension is k (l - l0 - s), and
//! s' = tension / c.

use element_api::prelude::*;

/// The force.
pub struct Maxwell(MaxwellParameters);

/// Its parameters, as a scene gives them.
#[derive(Parameters)]
pub struct MaxwellParameters {
    /// Tension per elongation of the spring.
    #[param(unit = "N/m", above = 0.0)]
    stiffness: f64,
    /// Tension per speed of the dashpot.
    #[param(unit = "N s/m", above = 0.0)]
    damping: f64,
    /// Distance of the points without tension at the start.
    #[param(unit = "m", above = 0.0)]
    free_length: f64,
}

impl Element for Maxwell {
    const NAME: &'static str = "maxwell";
    const SUMMARY: &'static str = "spring and dashpot one behind the other";
    const DOC: &'static str = doc_of(include_str!("maxwell.rs"));
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "first end"), FrameSpec::new("j", "second end")];
    type Parameters = MaxwellParameters;

    fn new(p: MaxwellParameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Maxwell {
    fn tension<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        let d = at.frames()[1].position - at.frames()[0].position;
        (length(d) - self.0.free_length - at.states[0]) * self.0.stiffness
    }
}

impl Force for Maxwell {
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("creep", "m", "length that the dashpot has given way")];
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("tension", "N", "positive when it pulls")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let d = at.frames()[1].position - at.frames()[0].position;
        out.force_pair(0, 1, -d * (self.tension(at) / length(d)));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.tension(at));
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.tension(at) / self.0.damping);
    }

    // With both, the audit can balance the energy: stored in the spring, turned into heat in the dashpot.
    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(self.tension(at).powi(2) * (0.5 / self.0.stiffness))
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(self.tension(at).powi(2) * (1.0 / self.0.damping))
    }
}
