//! A rope: pulls when it is longer than its free length, and does nothing when it is slack.
//!
//! `max` is a `select`: the host sees where the equations switch and ends its steps there.

use element_api::prelude::*;

/// The force.
pub struct Rope(RopeParameters);

/// Its parameters, as a scene gives them.
#[derive(Parameters)]
pub struct RopeParameters {
    /// Tension per elongation.
    #[param(unit = "N/m", above = 0.0)]
    stiffness: f64,
    /// Length up to which it is slack.
    #[param(unit = "m", above = 0.0)]
    free_length: f64,
}

impl Element for Rope {
    const NAME: &'static str = "rope";
    const SUMMARY: &'static str = "pulls, but does not push";
    const DOC: &'static str = doc_of(include_str!("rope.rs"));
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "first end"), FrameSpec::new("j", "second end")];
    type Parameters = RopeParameters;

    fn new(p: RopeParameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Rope {
    fn elongation<S: Scalar>(&self, d: Vec3<S>) -> S {
        (length(d) - self.0.free_length).max(S::zero())
    }
}

impl Force for Rope {
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let d = at.frames()[1].position - at.frames()[0].position;
        out.force_pair(0, 1, -d * (self.elongation(d) * self.0.stiffness / length(d)));
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let d = at.frames()[1].position - at.frames()[0].position;
        Some(self.elongation(d).powi(2) * (0.5 * self.0.stiffness))
    }
}
