//! A point of the second body stays on a plane curve of the first that is given as height over distance: a wheel hub above a
//! track, a pin in a slot.
//!
//! ## Equations
//!
//! With (x, y, z) = A_i^T (p_j - p_i) and the height f(x) (Haug 1989, section 3.4, point-follower):
//!
//! | row | equation |
//! |---|---|
//! | curve | y - f(x) = 0 |
//! | z | z = 0 (left out with `planar = false`) |
//!
//! ## Signs
//!
//! `x` is where the point is along the curve's x axis. The reaction force on body `j` is along the normal of the curve, at the
//! origin of its frame, and two-sided: the curve also pulls.
//!
//! ## Singular cases
//!
//! A curve cannot turn back or stand upright (use `cam` for closed curves). Given by points it is a spline where `interpolation`
//! says nothing else (`linear` and `steps` are refused); beyond them it continues straight at the end heights, with a kink there that a moving body
//! cannot pass without a shock: a run that does is `suspect` (ODY0883). Give points well beyond the motion.
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
//! name = "wheel"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.5, 0, 0.25]
//!
//! [[joint]]
//! name = "track"
//! type = "point-on-curve"
//! bodies = ["ground", "wheel"]
//! points = [[0, 0, 0], [0.5, 0, 0.25]]
//! axis = [0, -1, 0]
//! x_axis = [1, 0, 0]
//! params.height = "x^2"
//!
//! [[output]]
//! name = "x"
//! quantity = "coordinate"
//! of = "track"
//! channel = "x"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone)]
pub struct PointOnCurve(PointOnCurveParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct PointOnCurveParameters {
    /// Height over distance.
    #[param(unit = "m -> m", variable = "x")]
    pub height: Function,
    /// The point is also held in the plane of the curve.
    #[param(default = true)]
    pub planar: bool,
}

impl Element for PointOnCurve {
    const NAME: &'static str = "point-on-curve";
    const SUMMARY: &'static str = "a point of the second body stays on a curve y = f(x) of the first";
    const DOC: &'static str = doc_of(include_str!("point_on_curve.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the body with the curve; its x axis is the distance, its y axis the height"),
        FrameSpec::new("j", "on the second body; its origin is the point"),
    ];
    type Parameters = PointOnCurveParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Constraint for PointOnCurve {
    const ROWS: &'static [&'static str] = &["curve", "z"];
    const COORDINATES: &'static [ChannelSpec] =
        &[ChannelSpec::new("x", "m", "where the point is along the curve's x axis")];

    fn uses_row(&self, row: usize) -> bool {
        row == 0 || self.0.planar
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        let d = j.position - i.position;
        rows.push(i.y().dot(&d) - self.0.height.at(i.x().dot(&d)));
        if self.0.planar {
            blocks::no_offset_along(i.z(), i, j, rows);
        }
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.frames[0].x().dot(&(at.frames[1].position - at.frames[0].position)));
    }
}
