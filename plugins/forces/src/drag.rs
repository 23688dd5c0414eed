//! Drag of a medium on a body: quadratic in the speed of a point through the medium, against it. The medium rests in
//! frame i (usually the ground), or blows as a uniform wind through it.
//!
//! ## Equations
//! ```text
//! w = v_j - v_i - omega_i x (p_j - p_i) - A_i wind      (1)
//! F = rho cd A |w| w / 2                                (2)
//! force on j at p_j: -F                                 (3)
//! P_dissipated = F . w  without wind                    (4)
//! ```
//!
//! on i the opposite along the same line (Newton's law of resistance; Hoerner, Fluid-Dynamic Drag, 1965, chapter 1).
//! With wind, the work of the force is integrated instead of (4).
//!
//! ## Signs
//! The wind is the velocity of the medium in axes of frame i. `force` is the magnitude of (2).
//!
//! ## Singular cases
//! None: at rest in the medium the force and its derivatives vanish.
//!
//! ## Example
//! ```toml
//! title = "Falling ball"
//!
//! [plugins]
//! libraries = ["odyn-forces"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 1
//! output_step = 0.1
//!
//! [[body]]
//! name = "ball"
//! mass = "58 g"
//! inertia = [4e-5, 4e-5, 4e-5]
//!
//! [[force]]
//! name = "air"
//! type = "drag"
//! bodies = ["ground", "ball"]
//! params.coefficient = 0.55
//! params.area = "35 cm^2"
//! params.wind = [3, 0, 0]
//!
//! [[output]]
//! name = "vz"
//! quantity = "velocity"
//! of = "ball"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct Drag {
    /// rho cd A / 2, kg/m.
    factor: f64,
    /// In axes of frame i, m/s.
    wind: Option<[f64; 3]>,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct DragParameters {
    /// Density of the medium, rho; by default that of air at sea level.
    #[param(unit = "kg/m^3", min = 0.0, default = 1.225)]
    pub density: f64,
    /// Drag coefficient, cd.
    #[param(min = 0.0)]
    pub coefficient: f64,
    /// Reference area, A.
    #[param(unit = "m^2", min = 0.0)]
    pub area: f64,
    /// Velocity of the medium in axes of frame i; none: it rests.
    #[param(unit = "m/s")]
    pub wind: Option<[f64; 3]>,
}

impl Element for Drag {
    const NAME: &'static str = "drag";
    const SUMMARY: &'static str = "quadratic drag of a resting or blowing medium";
    const DOC: &'static str = doc_of(include_str!("drag.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "the medium moves with it; usually on the ground"),
        FrameSpec::new("j", "its origin is the point on which the drag acts"),
    ];
    type Parameters = DragParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { factor: 0.5 * p.density * p.coefficient * p.area, wind: p.wind })
    }
}

impl Drag {
    /// (1) and its length
    fn speed<S: Scalar>(&self, at: &Motion<'_, S>) -> (Vec3<S>, S) {
        let i = &at.frames()[0];
        let d = at.frames()[1].position - i.position;
        let carried = at.relative_velocity(0, 1) - at.twists[0].angular_velocity.cross(&d);
        let w = self.wind.map_or(carried, |wind| carried - i.direction(wind));
        // Without a derivative where it vanishes: that of |w| w is zero there anyway.
        (w, w.dot(&w).max(S::from(1e-60)).sqrt())
    }
}

impl Force for Drag {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("force", "N", "magnitude of the drag"),
        ChannelSpec::new("speed", "m/s", "of the point through the medium"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let (w, speed) = self.speed(at);
        out.force_pair(0, 1, w * (speed * -self.factor));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (_, speed) = self.speed(at);
        out.push(speed * speed * self.factor);
        out.push(speed);
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        if self.wind.is_some() {
            return None;
        }
        let (_, speed) = self.speed(at);
        Some(speed * speed * speed * self.factor)
    }
}
