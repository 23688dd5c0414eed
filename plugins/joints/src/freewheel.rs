//! A one-way clutch: the second body turns about the axis freely in one direction against the first, and not at all in the other.
//!
//! ## Equations
//!
//! One unilateral row on velocities, with a torque that acts only where it is zero:
//!
//! | row | equation | |
//! |---|---|---|
//! | spin | z_i . (omega_j - omega_i) >= 0 | unilateral |
//!
//! It locks without an impact where the second body becomes as slow as the first, and lets go where it would have to hold it back.
//! An impact elsewhere that would turn it the wrong way is passed on at once, without restitution. It has no teeth: it
//! locks at any angle.
//!
//! (Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996.)
//!
//! ## Signs
//!
//! The reaction torque on body `j` is positive about z_i: it drives the second body along, as that of a bicycle's hub, whose
//! sprocket is the first body.
//!
//! ## Singular cases
//!
//! Other rotations are free: a joint has to keep the axes together.
//!
//! ## Example
//!
//! A wheel that is driven half of the time:
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! t_end = 4
//! output_step = 0.02
//!
//! [[body]]
//! name = "sprocket"
//! mass = 1
//! inertia = [0.01, 0.01, 0.01]
//!
//! [[body]]
//! name = "wheel"
//! mass = 2
//! inertia = [0.1, 0.1, 0.2]
//!
//! [[joint]]
//! name = "pedals"
//! type = "rotation-driver"
//! bodies = ["ground", "sprocket"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//! params.angle = "1 - cos(2 * t)"
//!
//! [[joint]]
//! name = "axle"
//! type = "revolute"
//! bodies = ["ground", "sprocket"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "bearing"
//! type = "revolute"
//! bodies = ["ground", "wheel"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "hub"
//! type = "freewheel"
//! bodies = ["sprocket", "wheel"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[output]]
//! name = "w"
//! quantity = "angular_velocity"
//! of = "wheel"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Freewheel;

impl Element for Freewheel {
    const NAME: &'static str = "freewheel";
    const SUMMARY: &'static str = "a one-way clutch: free in one direction of rotation, locked in the other";
    const DOC: &'static str = doc_of(include_str!("freewheel.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the driving body; its z axis is the axis of rotation"),
        FrameSpec::new("j", "on the body that may be faster about it"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Freewheel {
    const ROWS: &'static [&'static str] = &[];
    const VELOCITY_ROWS: &'static [&'static str] = &["spin"];

    fn unilateral(&self, _: usize) -> Option<f64> {
        Some(0.0)
    }

    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}

    fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(at.spin_about_z(0, 1));
    }
}
