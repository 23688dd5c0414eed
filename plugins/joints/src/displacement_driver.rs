//! An actuator that extends exactly as prescribed: the displacement of one body along the axis of another is a given function of
//! time. The joint itself (translational, cylindrical, ...) is a separate element.
//!
//! ## Equations
//!
//! With d = p_j - p_i (Haug 1989, section 9.5, driving constraints):
//!
//! | row | equation |
//! |---|---|
//! | z | z_i . d - displacement(t) = 0, m |
//!
//! ## Signs
//!
//! `displacement` = z_i . d. The reaction force on body `j` along z_i is the actuator's force on it, and times the rate of
//! the displacement the power that it gives.
//!
//! ## Singular cases
//!
//! None. A function with a kink asks for an infinite force there: points are joined by a spline where `interpolation` says
//! nothing else, `linear` and `steps` are refused, and beyond the points the displacement is held.
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
//! name = "slider"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//!
//! [[joint]]
//! name = "guide"
//! type = "translational"
//! bodies = ["ground", "slider"]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "actuator"
//! type = "displacement-driver"
//! bodies = ["ground", "slider"]
//! axis = [0, 0, 1]
//! params.displacement = "0.01 sin(20 t)"
//!
//! [[output]]
//! name = "force"
//! quantity = "reaction_force"
//! of = "actuator"
//! on = "slider"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone)]
pub struct DisplacementDriver(DisplacementDriverParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct DisplacementDriverParameters {
    /// Displacement over time.
    #[param(unit = "s -> m", variable = "t")]
    pub displacement: Function,
}

impl Element for DisplacementDriver {
    const NAME: &'static str = "displacement-driver";
    const SUMMARY: &'static str = "moves a body along a joint axis by a given function of time";
    const DOC: &'static str = doc_of(include_str!("displacement_driver.rs"));
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    type Parameters = DisplacementDriverParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Constraint for DisplacementDriver {
    const ROWS: &'static [&'static str] = &["z"];
    const COORDINATES: &'static [ChannelSpec] = &[crate::DISPLACEMENT];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let reached = blocks::displacement_along_z(&at.frames[0], &at.frames[1]);
        rows.push(reached - self.0.displacement.at(at.time));
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(blocks::displacement_along_z(&at.frames[0], &at.frames[1]));
    }
}
