//! A shaking table: the second body goes up and down along the z axis of the first, as a sine of the time.
//!
//! The row is z_i . (p_j - p_i) - amplitude sin(2 pi frequency t) = 0. It leaves all other directions free.

use std::f64::consts::TAU;

use element_api::prelude::*;

/// The joint.
pub struct Shaker {
    amplitude: f64,
    omega: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Parameters)]
pub struct ShakerParameters {
    /// Largest displacement.
    #[param(unit = "m", min = 0.0)]
    amplitude: f64,
    /// Cycles per time.
    #[param(unit = "1/s", above = 0.0)]
    frequency: f64,
}

impl Element for Shaker {
    const NAME: &'static str = "shaker";
    const SUMMARY: &'static str = "moves a body up and down as a sine of the time";
    const DOC: &'static str = doc_of(include_str!("shaker.rs"));
    const FRAMES: &'static [FrameSpec] =
        &[FrameSpec::new("base", "its z axis is the direction"), FrameSpec::new("table", "its origin is moved")];
    type Parameters = ShakerParameters;

    fn new(p: ShakerParameters) -> Result<Self, ParamError> {
        Ok(Self { amplitude: p.amplitude, omega: TAU * p.frequency })
    }
}

impl Constraint for Shaker {
    const ROWS: &'static [&'static str] = &["along z"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let height = blocks::displacement_along_z(&at.frames[0], &at.frames[1]);
        rows.push(height - (at.time * self.omega).sin() * self.amplitude);
    }
}
