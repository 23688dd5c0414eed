//! A motor that turns exactly as prescribed: the angle between two bodies about a joint's axis is a given function of time. The joint
//! itself (revolute, cylindrical, ...) is a separate element.
//!
//! ## Equations
//!
//! With the angle phi of frame `j` against frame `i` about their common z axis (Haug 1989, section 9.5, driving constraints):
//!
//! | row | equation |
//! |---|---|
//! | about z | phi ahead of angle(t) = 0, rad |
//!
//! The difference is taken within half a turn: it needs no count of turns and is smooth over any number.
//!
//! ## Signs
//!
//! `angle` = angle(t), positive to the left about z_i. The reaction torque on body `j` about z_i is the motor's torque on it,
//! and times the angular velocity the power that the motor gives.
//!
//! ## Singular cases
//!
//! The z axes must be kept parallel by another joint. At the start the body is turned to angle(t_start), modulo a turn; give a
//! start that agrees, or assembly has to move it. A function with a kink asks for an infinite torque
//! there: points are joined by a spline where `interpolation` says nothing else, `linear` and `steps` are refused, and beyond
//! the points the angle is held.
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
//! name = "crank"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.5, 0, 0]
//!
//! [[joint]]
//! name = "bearing"
//! type = "revolute"
//! bodies = ["ground", "crank"]
//! point = [0, 0, 0]
//! axis = [0, 1, 0]
//!
//! [[joint]]
//! name = "motor"
//! type = "rotation-driver"
//! bodies = ["ground", "crank"]
//! point = [0, 0, 0]
//! axis = [0, 1, 0]
//! params.angle = "0.2 sin(5 t)"
//!
//! [[output]]
//! name = "torque"
//! quantity = "reaction_torque"
//! of = "motor"
//! on = "crank"
//! component = "y"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone)]
pub struct RotationDriver(RotationDriverParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct RotationDriverParameters {
    /// Angle over time.
    #[param(unit = "s -> rad", variable = "t")]
    pub angle: Function,
}

impl Element for RotationDriver {
    const NAME: &'static str = "rotation-driver";
    const SUMMARY: &'static str = "turns a body about a joint axis by a given function of time";
    const DOC: &'static str = doc_of(include_str!("rotation_driver.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    type Parameters = RotationDriverParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl RotationDriver {
    /// Rotation beyond the prescribed one, rad.
    fn deviation<S: Scalar>(&self, at: &Configuration<'_, S>) -> S {
        blocks::ahead_of(blocks::turn_about_z(&at.frames[0], &at.frames[1]), self.0.angle.at(at.time))
    }
}

impl Constraint for RotationDriver {
    const ROWS: &'static [&'static str] = &["about z"];
    const COORDINATES: &'static [ChannelSpec] = &[crate::ANGLE];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(self.deviation(at));
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.0.angle.at(at.time) + self.deviation(at));
    }
}
