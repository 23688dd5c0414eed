//! Attraction of a body by a point, falling with the square of the distance: a satellite and its planet.
//!
//! ## Equations
//! With d = p_j - p_i, r = |d|, mu the gravitational parameter of what sits at the origin of frame i (G times its
//! mass), m the mass at the origin of frame j:
//!
//! ```text
//! force on j: -mu m d / r^3      force on i: mu m d / r^3      (1)
//! V = -mu m / r                                                (2)
//! ```
//!
//! (Newton, Principia, 1687, book III; e.g. Goldstein, Classical Mechanics, section 3.7.)
//!
//! ## Signs
//! The force attracts; V is zero at infinity.
//!
//! ## Singular cases
//! At r = 0 the results are not numbers. The origin of frame j should be the centre of mass of its body: the gradient
//! of gravity over an extended body is left out. The body's own mass is not known to the element: give it again.
//!
//! ## Example
//! ```toml
//! title = "Low Earth orbit"
//!
//! [plugins]
//! libraries = ["odyn-forces"]
//!
//! [simulation]
//! t_end = "10 min"
//! output_step = "1 min"
//!
//! [[body]]
//! name = "satellite"
//! mass = 100
//! inertia = [10, 10, 10]
//! position = ["7000 km", 0, 0]
//! velocity = [0, 7546.05, 0]
//!
//! [[force]]
//! name = "earth"
//! type = "point-gravity"
//! bodies = ["ground", "satellite"]
//! points = [[0, 0, 0], ["7000 km", 0, 0]]
//! params.gravitational_parameter = 3.986004418e14
//! params.mass = 100
//!
//! [[output]]
//! name = "x"
//! quantity = "position"
//! of = "satellite"
//! component = "x"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct PointGravity {
    /// mu m, N m^2.
    strength: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct PointGravityParameters {
    /// Gravitational parameter of the centre, mu = G times its mass.
    #[param(unit = "m^3/s^2", min = 0.0)]
    pub gravitational_parameter: f64,
    /// Mass at the origin of frame j, m.
    #[param(unit = "kg", min = 0.0)]
    pub mass: f64,
}

impl Element for PointGravity {
    const NAME: &'static str = "point-gravity";
    const SUMMARY: &'static str = "inverse-square attraction between two points";
    const DOC: &'static str = doc_of(include_str!("point_gravity.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "its origin is the attracting centre"),
        FrameSpec::new("j", "its origin is the attracted mass"),
    ];
    type Parameters = PointGravityParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { strength: p.gravitational_parameter * p.mass })
    }
}

fn between<S: Scalar>(at: &Motion<'_, S>) -> Vec3<S> {
    at.frames()[1].position - at.frames()[0].position
}

impl Force for PointGravity {
    const CHANNELS: &'static [ChannelSpec] =
        &[ChannelSpec::new("force", "N", "attraction"), ChannelSpec::new("distance", "m", "of the two points")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let d = between(at);
        let square = d.dot(&d);
        // Along the line of the origins: no torque on either frame.
        let pull = d * (S::from(self.strength) / (square * square.sqrt()));
        out.force(0, pull);
        out.force(1, -pull);
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let d = between(at);
        let square = d.dot(&d);
        out.push(S::from(self.strength) / square);
        out.push(square.sqrt());
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(-(S::from(self.strength) / length(between(at))))
    }
}
