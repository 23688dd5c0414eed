//! Bars and ropes.

use element_api::prelude::*;

element_api::export_plugin! { about: "Bars and ropes", joints: [Rod] }

/// Keeps two points at a fixed distance.
pub struct Rod {
    length: f64,
}

/// Parameters of [`Rod`].
#[derive(Parameters)]
pub struct RodParameters {
    /// Distance of the two points.
    #[param(unit = "m", above = 0.0)]
    length: f64,
}

impl Element for Rod {
    const NAME: &'static str = "rod";
    const SUMMARY: &'static str = "massless rod between two points";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "first end"), FrameSpec::new("j", "second end")];
    type Parameters = RodParameters;

    fn new(p: RodParameters) -> Result<Self, ParamError> {
        Ok(Self { length: p.length })
    }
}

impl Constraint for Rod {
    const ROWS: &'static [&'static str] = &["distance"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let d = at.frames[1].position - at.frames[0].position;
        rows.push(length(d) - self.length);
    }
}
