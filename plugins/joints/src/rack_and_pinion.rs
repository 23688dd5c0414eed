//! A toothed wheel rolls on a toothed bar without slip. Wheel and bar are guided by joints of their own on a carrier (the
//! ground, a housing); this joint only ties the displacement of the bar to the rotation of the wheel.
//!
//! ## Equations
//!
//! With the displacement s = z_k . (p_l - p_k) of the rack frame `l` against its carrier frame `k`, and the angle phi of the
//! pinion against its carrier frame about z (Haug 1989, section 3.4):
//!
//! | row | equation |
//! |---|---|
//! | mesh | r (phi ahead of s / r) = 0, in m; that is, s = r phi |
//!
//! The difference of the angles is taken within half a turn: it needs no count of turns and is smooth over any number.
//!
//! ## Signs
//!
//! Turning the pinion to the left about its z axis moves the rack along its own z axis. Seen along z of the pinion towards the
//! eye, with the rack below the wheel, choose z of the rack to the right; with the rack above it, to the left. The joint gives
//! the pinion the torque of the tooth force, and the carrier its counterpart; the tooth force itself is not in the reaction of
//! the pinion's bearing. What the carrier carries in all is the same.
//!
//! ## Singular cases
//!
//! None. At the start the rack is put on the nearest place that fits the angle, modulo one turn.
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
//! name = "pinion"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//!
//! [[body]]
//! name = "rack"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, -0.1, 0]
//!
//! [[joint]]
//! name = "bearing"
//! type = "revolute"
//! bodies = ["ground", "pinion"]
//! axis = [0, 1, 0]
//!
//! [[joint]]
//! name = "guide"
//! type = "translational"
//! bodies = ["ground", "rack"]
//! point = [0, -0.1, 0]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "mesh"
//! type = "rack-and-pinion"
//! bodies = ["ground", "pinion", "ground", "rack"]
//! axes = [[0, 1, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1]]
//! params.radius = "10 cm"
//!
//! [[output]]
//! name = "speed"
//! quantity = "coordinate_rate"
//! of = "bearing"
//! channel = "angle"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct RackAndPinion(RackAndPinionParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct RackAndPinionParameters {
    /// Radius of the pinion's pitch circle.
    #[param(unit = "m", above = 0.0)]
    pub radius: f64,
}

impl Element for RackAndPinion {
    const NAME: &'static str = "rack-and-pinion";
    const SUMMARY: &'static str = "a rack moves by the radius times the angle of its pinion";
    const DOC: &'static str = doc_of(include_str!("rack_and_pinion.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("pinion_carrier", "on the body that carries the pinion; its z axis is that of the bearing"),
        FrameSpec::new("pinion", "on the pinion; on the frame before at the start"),
        FrameSpec::new("rack_carrier", "on the body that guides the rack; its z axis is the path of the rack"),
        FrameSpec::new("rack", "on the rack; on the frame before at the start"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1], [2, 3]];
    type Parameters = RackAndPinionParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Constraint for RackAndPinion {
    const ROWS: &'static [&'static str] = &["mesh"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let f = at.frames;
        let rolled = blocks::displacement_along_z(&f[2], &f[3]) / self.0.radius;
        rows.push(blocks::ahead_of(blocks::turn_about_z(&f[0], &f[1]), rolled) * self.0.radius);
    }
}
