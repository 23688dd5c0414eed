//! Weight of a single body in a uniform field that is fixed to another body: for scenes without gravity of their own,
//! for a body that feels another one (buoyancy, an elevator), or for a tilting table.
//!
//! ## Equations
//! With the acceleration g in axes of frame i and u = A_i^T (p_j - p_i):
//!
//! ```text
//! force on j at p_j: m A_i g      on i the opposite along the same line      (1)
//! V = -m g . u                                                               (2)
//! ```
//!
//! (e.g. Goldstein, Classical Mechanics, section 1.2, for the energy of a pair.) The reaction on i makes (2) the energy
//! of (1) also where i moves; in the ground it has no effect.
//!
//! ## Signs
//! A body falls along g. V is zero where the origins coincide.
//!
//! ## Singular cases
//! None. The origin of frame j should be the centre of mass. The body's own mass is not known to the element: give it
//! again. It comes on top of the scene's `gravity`.
//!
//! ## Example
//! ```toml
//! title = "Throw"
//!
//! [plugins]
//! libraries = ["odyn-forces"]
//!
//! [simulation]
//! t_end = 1
//! output_step = 0.1
//!
//! [[body]]
//! name = "stone"
//! mass = 0.2
//! inertia = [1e-4, 1e-4, 1e-4]
//! velocity = [3, 0, 5]
//!
//! [[force]]
//! name = "weight"
//! type = "uniform-gravity"
//! bodies = ["ground", "stone"]
//! params.mass = 0.2
//! params.acceleration = [0, 0, -9.81]
//!
//! [[output]]
//! name = "z"
//! quantity = "position"
//! of = "stone"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct UniformGravity {
    /// m g in axes of frame i, N.
    weight: [f64; 3],
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct UniformGravityParameters {
    /// Mass at the origin of frame j, m.
    #[param(unit = "kg", min = 0.0)]
    pub mass: f64,
    /// Acceleration of free fall in axes of frame i, g.
    #[param(unit = "m/s^2")]
    pub acceleration: [f64; 3],
}

impl Element for UniformGravity {
    const NAME: &'static str = "uniform-gravity";
    const SUMMARY: &'static str = "weight of one body in a uniform field";
    const DOC: &'static str = doc_of(include_str!("uniform_gravity.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "the field is fixed to it; usually on the ground"),
        FrameSpec::new("j", "its origin is the centre of mass"),
    ];
    type Parameters = UniformGravityParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { weight: p.acceleration.map(|g| p.mass * g) })
    }
}

impl UniformGravity {
    fn weight<S: Scalar>(&self, at: &Motion<'_, S>) -> Vec3<S> {
        at.frames()[0].direction(self.weight)
    }
}

impl Force for UniformGravity {
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force_pair(0, 1, self.weight(at));
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let d = at.frames()[1].position - at.frames()[0].position;
        Some(-self.weight(at).dot(&d))
    }
}
