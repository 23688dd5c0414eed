//! A wobble plate: a follower rides on the face of a plate, whose height goes up and down around its axis. With one wave
//! it is a tilted plate that drives the piston of a pump; with more, a face cam.
//!
//! ## Equations
//! With (x, y, z) = A_i^T (p_j - p_i), the follower as seen from the plate, one row:
//! ```text
//! z - amplitude cos(waves atan2(y, x)) = 0
//! ```
//!
//! ## Signs
//! The x axis of the plate points to a crest. The reaction is the force along z between plate and follower, and the
//! torque that it takes to turn the plate. The plate also pulls: it is a groove, not a bare face.
//!
//! ## Singular cases
//! A follower on the axis of the plate is on no side of it.

#![forbid(unsafe_code)]

use element_api::prelude::*;

element_api::export_plugin! { about: "A wobble plate", joints: [Wobble] }

// ANCHOR: parameters
/// Its parameters, as a scene gives them.
#[derive(Parameters)]
pub struct WobbleParameters {
    /// Half of the stroke.
    #[param(unit = "m", above = 0.0)]
    amplitude: f64,
    /// Strokes per turn.
    #[param(default = 1, min = 1.0)]
    waves: i64,
}
// ANCHOR_END: parameters

// ANCHOR: element
/// The joint.
pub struct Wobble {
    amplitude: f64,
    waves: f64,
}

impl Element for Wobble {
    const NAME: &'static str = "wobble";
    const SUMMARY: &'static str = "a follower on the wavy face of a plate";
    const DOC: &'static str = doc_of(include_str!("lib.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("plate", "on the plate; z is its axis, x points to a crest"),
        FrameSpec::new("follower", "its origin rides on the face"),
    ];
    type Parameters = WobbleParameters;

    fn new(p: WobbleParameters) -> Result<Self, ParamError> {
        Ok(Self { amplitude: p.amplitude, waves: p.waves as f64 })
    }
}
// ANCHOR_END: element

// ANCHOR: equation
impl Constraint for Wobble {
    const ROWS: &'static [&'static str] = &["height"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (plate, follower) = (&at.frames[0], &at.frames[1]);
        let d = follower.position - plate.position;
        let angle = plate.y().dot(&d).atan2(plate.x().dot(&d));
        rows.push(plate.z().dot(&d) - (angle * self.waves).cos() * self.amplitude);
    }
}
// ANCHOR_END: equation

#[cfg(test)]
mod tests;
