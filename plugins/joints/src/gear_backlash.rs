//! Two toothed wheels in mesh with play between the teeth. As `gear`, but one flank or the other pushes, and between them the
//! wheels run freely. Each turns in a bearing of its own on a carrier.
//!
//! ## Equations
//!
//! With the angles phi_1, phi_2 of the wheels against their carriers about z, radii or numbers of teeth n_1, n_2, and psi, what
//! phi_2 is ahead of -(n_1 / n_2) phi_1 (+ instead of - for an internal gear), two unilateral rows, each with a torque that only
//! pushes:
//!
//! | row | equation | |
//! |---|---|---|
//! | behind | play / 2 + psi >= 0, rad | unilateral |
//! | ahead | play / 2 - psi >= 0, rad | unilateral |
//!
//! Flanks that strike each other with the rate w of psi part with -e w, e being the coefficient of restitution; when what is left of
//! the bouncing is smaller than the tolerance of the run, they stay together. phi_1 is counted over many turns, psi is within half a
//! turn.
//!
//! (Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996, on rattling gears.)
//!
//! ## Signs
//!
//! All z axes point to the same side. The reaction torque on `gear_2` about z is positive where the wheel is behind and is pushed
//! on, negative where it is ahead and is held back.
//!
//! ## Singular cases
//!
//! None. A play of zero is `gear`. At the start phi_1 is taken in (-pi, pi] and phi_2 modulo a turn: frames that are on each other
//! are in the middle of the play.
//!
//! ## Example
//!
//! A wheel that is struck by the teeth of another:
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
//! type = "gear-backlash"
//! bodies = ["ground", "small", "ground", "large"]
//! points = [[0, 0, 0], [0, 0, 0], [0.3, 0, 0], [0.3, 0, 0]]
//! params.teeth_1 = 20
//! params.teeth_2 = 40
//! params.play = "0.5 deg"
//! params.restitution = 0.4
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
pub struct GearBacklash {
    /// phi_2 / phi_1.
    ratio: f64,
    /// Half the play of the second wheel, rad.
    half: f64,
    restitution: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct GearBacklashParameters {
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
    /// How far the second wheel can turn between the flanks while the first stands still.
    #[param(unit = "rad", above = 0.0, max = 3.0)]
    pub play: f64,
    /// Coefficient of restitution, 0 to 1.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    pub restitution: f64,
}

impl Element for GearBacklash {
    const NAME: &'static str = "gear-backlash";
    const SUMMARY: &'static str = "two wheels in mesh with play between the teeth, with restitution";
    const DOC: &'static str = doc_of(include_str!("gear_backlash.rs"));
    const EXEMPT: &'static [(&'static str, &'static str)] =
        &[("free-motion", "its two rows are the two flanks of a tooth, which never both touch")];
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("carrier_1", "on the body that carries the first wheel; its z axis is that of the bearing"),
        FrameSpec::new("gear_1", "on the first wheel; on the frame before at the start"),
        FrameSpec::new("carrier_2", "on the body that carries the second wheel; its z axis is that of the bearing"),
        FrameSpec::new("gear_2", "on the second wheel; on the frame before at the start"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1], [2, 3]];
    const ANGLES: usize = 1;
    type Parameters = GearBacklashParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let ratio = crate::gear::ratio([p.radius_1, p.radius_2], [p.teeth_1, p.teeth_2], p.internal)?;
        Ok(Self { ratio, half: 0.5 * p.play, restitution: p.restitution })
    }
}

impl Constraint for GearBacklash {
    const ROWS: &'static [&'static str] = &["behind", "ahead"];

    fn unilateral(&self, _: usize) -> Option<f64> {
        Some(self.restitution)
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let second = blocks::turn_about_z(&at.frames[2], &at.frames[3]);
        let psi = blocks::ahead_of(second, at.angle_about_z(0, 0, 1) * self.ratio);
        rows.push(psi + self.half);
        rows.push(-psi + self.half);
    }
}
