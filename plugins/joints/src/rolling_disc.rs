//! A thin disc rolls on a plane without slip, upright or inclined: a wheel, a coin, a unicycle.
//!
//! ## Equations
//!
//! With d = p_j - p_i, c = z_i . z_j, s = sqrt(1 - c^2), the radius r, and the point of contact at e = -r (z_i - c z_j) / s from the
//! centre (Haug 1989, section 11.6; Neimark & Fufaev 1972, chapter 2):
//!
//! | row | equation |
//! |---|---|
//! | height | z_i . d - r s = 0 |
//! | along x | x_i . (v_j + omega_j x e - v_i - omega_i x (d + e)) = 0 |
//! | along y | y_i . (v_j + omega_j x e - v_i - omega_i x (d + e)) = 0 |
//!
//! The first constrains positions, the others velocities only.
//!
//! ## Signs
//!
//! The disc is on the side of the plane that z_i points to. The reaction force on body `j` is that at the contact; its torque is
//! about the origin of frame `j`, the centre. The contact is two-sided (the plane also pulls), and does no work.
//!
//! ## Singular cases
//!
//! A disc that lies flat (c = 1 or -1) touches the plane everywhere: the run stops with this joint named.
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
//! inertia = [0.01, 0.01, 0.02]
//! position = [0, 0, 0.2]
//! orientation = { axis = [1, 0, 0], angle = "90 deg" }
//! velocity = [1, 0, 0]
//! angular_velocity = [0, 5, 0]
//!
//! [[joint]]
//! name = "road"
//! type = "rolling-disc"
//! bodies = ["ground", "wheel"]
//! frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0], axis = [0, 0, 1] }]
//! params.radius = "20 cm"
//!
//! [[output]]
//! name = "normal"
//! quantity = "reaction_force"
//! of = "road"
//! on = "wheel"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct RollingDisc(RollingDiscParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct RollingDiscParameters {
    /// Radius of the disc.
    #[param(unit = "m", above = 0.0)]
    pub radius: f64,
}

impl Element for RollingDisc {
    const NAME: &'static str = "rolling-disc";
    const SUMMARY: &'static str = "a thin disc rolls on a plane of the first body without slip";
    const DOC: &'static str = doc_of(include_str!("rolling_disc.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new(
            "i",
            "on the first body; its origin lies in the plane, its z axis is the normal towards the disc",
        ),
        FrameSpec::new("j", "on the second body; its origin is the centre of the disc, its z axis that of the disc"),
    ];
    type Parameters = RollingDiscParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl RollingDisc {
    /// Sine of the angle between the normal and the disc's axis, and the point of contact from the centre.
    fn contact<S: Scalar>(&self, i: &Frame<S>, j: &Frame<S>) -> (S, Vec3<S>) {
        let c = i.z().dot(&j.z());
        let across = i.z() - j.z() * c;
        let s = length(across);
        (s, across * (S::from(-self.0.radius) / s))
    }
}

impl Constraint for RollingDisc {
    const ROWS: &'static [&'static str] = &["height"];
    const VELOCITY_ROWS: &'static [&'static str] = &["along x", "along y"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        let (s, _) = self.contact(i, j);
        rows.push(blocks::displacement_along_z(i, j) - s * self.0.radius);
    }

    fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let (_, contact) = self.contact(i, j);
        let reach = j.position - i.position + contact;
        let slip = at.relative_velocity(0, 1) + at.twists[1].angular_velocity.cross(&contact)
            - at.twists[0].angular_velocity.cross(&reach);
        rows.push(i.x().dot(&slip));
        rows.push(i.y().dot(&slip));
    }
}
