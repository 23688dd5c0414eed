//! A massless rod with a ball joint at each end: two points keep their distance.
//!
//! ## Equations
//!
//! With d = p_j - p_i and the length L (Haug 1989, section 9.4: distance constraint, divided by 2 L so that it is a length and
//! its derivative is the unit vector along the rod):
//!
//! | row | equation |
//! |---|---|
//! | distance | (d . d - L^2) / (2 L) = 0 |
//!
//! ## Signs
//!
//! No joint coordinate. The reaction force acts along the rod, at the points; a rod in tension pulls body `j` towards `i`.
//!
//! ## Singular cases
//!
//! None: the length is above zero. At a stretched position of a mechanism (all points on one line) the mechanism may be
//! singular, not the rod.
//!
//! ## Example
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 0.1
//! output_step = 0.05
//!
//! [[body]]
//! name = "ball"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.4, 0, 0]
//!
//! [[joint]]
//! name = "rod"
//! type = "distance-rod"
//! bodies = ["ground", "ball"]
//! params.length = "40 cm"
//!
//! [[output]]
//! name = "pull"
//! quantity = "reaction_force"
//! of = "rod"
//! on = "ball"
//! component = "x"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct DistanceRod(DistanceRodParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct DistanceRodParameters {
    /// Distance of the two points.
    #[param(unit = "m", above = 0.0)]
    pub length: f64,
}

impl Element for DistanceRod {
    const NAME: &'static str = "distance-rod";
    const SUMMARY: &'static str = "massless rod: two points keep their distance";
    const DOC: &'static str = doc_of(include_str!("distance_rod.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its origin is the first end"),
        FrameSpec::new("j", "on the second body; its origin is the second end"),
    ];
    type Parameters = DistanceRodParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Constraint for DistanceRod {
    const ROWS: &'static [&'static str] = &["distance"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let d = at.frames[1].position - at.frames[0].position;
        rows.push((d.dot(&d) - self.0.length.powi(2)) / (2.0 * self.0.length));
    }
}
