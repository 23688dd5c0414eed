//! A spring whose tension over its elongation is measured: points, joined as the scene wants it (`monotone`, `linear`, `spline`,
//! `steps`; monotone where it does not say).
//!
//! The table is made once, from the points, when the element is created. Outside of its range the end values are held.

use element_api::prelude::*;

/// The force.
pub struct ProgressiveSpring {
    tension: Table,
    free_length: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Parameters)]
pub struct ProgressiveSpringParameters {
    /// Tension over the elongation.
    #[param(unit = "m -> N")]
    tension: Curve,
    /// Distance of the points at elongation zero.
    #[param(unit = "m", above = 0.0)]
    free_length: f64,
}

impl Element for ProgressiveSpring {
    const NAME: &'static str = "progressive-spring";
    const SUMMARY: &'static str = "spring with a measured characteristic";
    const DOC: &'static str = doc_of(include_str!("progressive_spring.rs"));
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "first end"), FrameSpec::new("j", "second end")];
    type Parameters = ProgressiveSpringParameters;

    fn new(p: ProgressiveSpringParameters) -> Result<Self, ParamError> {
        // The table says what is wrong with the points; the scene is to be pointed at.
        let tension = p.tension.table(Outside::Clamped).map_err(|error| ParamError::new("tension", error.message))?;
        Ok(Self { tension, free_length: p.free_length })
    }
}

impl Force for ProgressiveSpring {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("tension", "N", "positive when it pulls")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let d = at.frames()[1].position - at.frames()[0].position;
        let tension = (length(d) - self.free_length).lookup(&self.tension);
        out.force_pair(0, 1, -d * (tension / length(d)));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let d = at.frames()[1].position - at.frames()[0].position;
        out.push((length(d) - self.free_length).lookup(&self.tension));
    }
}
