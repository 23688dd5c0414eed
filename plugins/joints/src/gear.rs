//! Two toothed wheels in mesh. Each turns in a bearing of its own on a carrier; this joint only ties the two rotations. The
//! carrier may be the ground, a housing, or a body that turns itself (planetary gears); the two wheels may have two carriers,
//! and axes at any angle (bevel gears).
//!
//! ## Equations
//!
//! With the angles phi_1, phi_2 of the wheels against their carriers about z, and radii or numbers of teeth n_1, n_2
//! (Haug 1989, section 3.4):
//!
//! | row | equation |
//! |---|---|
//! | mesh | phi_2 ahead of -(n_1 / n_2) phi_1 = 0, in rad; + instead of - for an internal gear |
//!
//! that is, r_1 phi_1 + r_2 phi_2 = 0 (external), r_1 phi_1 - r_2 phi_2 = 0 (internal, a pinion in a ring). phi_1 is counted
//! over many turns. phi_2 is compared within half a turn, so that no two large numbers are subtracted. Of the radii only the ratio
//! counts: whether their sum (internal: their difference) is the distance of the axes is not looked at, and nothing moves an axis.
//!
//! ## Signs
//!
//! All z axes point to the same side. The joint gives each wheel the torque of the tooth force, and its counterpart to the
//! carrier; the tooth force itself is not in the reactions of the bearings. What the carrier carries in all is the same.
//!
//! ## Singular cases
//!
//! None. At the start phi_1 is taken in (-pi, pi] and phi_2 modulo a turn: frames that are on each other at the start are in
//! mesh as they are.
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
//! name = "small"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//! angular_velocity = [0, 0, 30]
//!
//! [[body]]
//! name = "large"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.3, 0, 0]
//!
//! [[joint]]
//! name = "bearing_1"
//! type = "revolute"
//! bodies = ["ground", "small"]
//!
//! [[joint]]
//! name = "bearing_2"
//! type = "revolute"
//! bodies = ["ground", "large"]
//! point = [0.3, 0, 0]
//!
//! [[joint]]
//! name = "mesh"
//! type = "gear"
//! bodies = ["ground", "small", "ground", "large"]
//! points = [[0, 0, 0], [0, 0, 0], [0.3, 0, 0], [0.3, 0, 0]]
//! params.teeth_1 = 20
//! params.teeth_2 = 40
//!
//! [[output]]
//! name = "speed"
//! quantity = "coordinate_rate"
//! of = "bearing_2"
//! channel = "angle"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Gear {
    /// phi_2 / phi_1.
    ratio: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct GearParameters {
    /// Radius of the first wheel's pitch circle.
    #[param(unit = "m", above = 0.0)]
    pub radius_1: Option<f64>,
    /// Radius of the second wheel's pitch circle.
    #[param(unit = "m", above = 0.0)]
    pub radius_2: Option<f64>,
    /// Number of teeth of the first wheel, instead of the radii.
    #[param(min = 1.0, example = 20)]
    pub teeth_1: Option<i64>,
    /// Number of teeth of the second wheel, instead of the radii.
    #[param(min = 1.0, example = 40)]
    pub teeth_2: Option<i64>,
    /// The second wheel is a ring around the first, or the first around the second.
    #[param(default = false)]
    pub internal: bool,
}

/// phi_2 / phi_1 of two wheels in mesh, from their radii or their numbers of teeth.
pub(crate) fn ratio(radii: [Option<f64>; 2], teeth: [Option<i64>; 2], internal: bool) -> Result<f64, ParamError> {
    let size = match (radii, teeth) {
        ([Some(first), Some(second)], [None, None]) => first / second,
        ([None, None], [Some(first), Some(second)]) => first as f64 / second as f64,
        _ => {
            let message = "give `radius_1` and `radius_2`, or `teeth_1` and `teeth_2`";
            return Err(ParamError::new("", message));
        }
    };
    Ok(if internal { size } else { -size })
}

impl Element for Gear {
    const NAME: &'static str = "gear";
    const SUMMARY: &'static str = "two wheels in mesh, on carriers that may move; external or internal";
    const DOC: &'static str = doc_of(include_str!("gear.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("carrier_1", "on the body that carries the first wheel; its z axis is that of the bearing"),
        FrameSpec::new("gear_1", "on the first wheel; on the frame before at the start"),
        FrameSpec::new("carrier_2", "on the body that carries the second wheel; its z axis is that of the bearing"),
        FrameSpec::new("gear_2", "on the second wheel; on the frame before at the start"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1], [2, 3]];
    const ANGLES: usize = 1;
    type Parameters = GearParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        ratio([p.radius_1, p.radius_2], [p.teeth_1, p.teeth_2], p.internal).map(|ratio| Self { ratio })
    }
}

impl Constraint for Gear {
    const ROWS: &'static [&'static str] = &["mesh"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let second = blocks::turn_about_z(&at.frames[2], &at.frames[3]);
        rows.push(blocks::ahead_of(second, at.angle_about_z(0, 0, 1) * self.ratio));
    }
}
