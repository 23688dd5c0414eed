//! A tether between two points: slack while they are nearer than its length, taut where they are not.
//!
//! One unilateral row: length - |p_j - p_i| >= 0, with a tension that is not negative. Jerked taut, it gives back the share
//! `restitution` of the speed.

use element_api::prelude::*;

/// The joint.
pub struct Tether(TetherParameters);

/// Its parameters, as a scene gives them.
#[derive(Parameters)]
pub struct TetherParameters {
    /// Largest distance of the two points.
    #[param(unit = "m", above = 0.0)]
    length: f64,
    /// Share of the speed that is given back.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    restitution: f64,
}

impl Element for Tether {
    const NAME: &'static str = "tether";
    const SUMMARY: &'static str = "keeps two points within a distance";
    const DOC: &'static str = doc_of(include_str!("tether.rs"));
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "first end"), FrameSpec::new("j", "second end")];
    type Parameters = TetherParameters;

    fn new(p: TetherParameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Constraint for Tether {
    const ROWS: &'static [&'static str] = &["slack"];

    fn unilateral(&self, _: usize) -> Option<f64> {
        Some(self.0.restitution)
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let apart = length(at.frames()[1].position - at.frames()[0].position);
        rows.push(-apart + self.0.length);
    }
}
