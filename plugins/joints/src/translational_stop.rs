//! Hard stops of a sliding motion: frame j stays between `lower` and `upper` along z of frame i.
//!
//! ## Equations
//!
//! With s = z_i . (p_j - p_i), two unilateral rows, each with a force that only pushes:
//!
//! | row | equation | |
//! |---|---|---|
//! | lower | s - lower >= 0 | unilateral |
//! | upper | upper - s >= 0 | unilateral |
//!
//! What strikes a stop with the velocity v leaves it with e v, e being the coefficient of restitution; when what is left of the
//! bouncing is smaller than the tolerance of the run, it stays. With `force`s instead of stops: `bump-stop`.
//!
//! (Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996.)
//!
//! ## Signs
//!
//! The reaction force on body `j` is along z_i: positive at the lower stop, negative at the upper one.
//!
//! ## Singular cases
//!
//! None by itself; a motion across z is free, unless a joint holds it.
//!
//! ## Example
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! t_end = 1
//! output_step = 0.01
//!
//! [[body]]
//! name = "carriage"
//! mass = 3
//! inertia = [1, 1, 1]
//! velocity = [2, 0, 0]
//!
//! [[joint]]
//! name = "rail"
//! type = "translational"
//! bodies = ["ground", "carriage"]
//! point = [0, 0, 0]
//! axis = [1, 0, 0]
//!
//! [[joint]]
//! name = "ends"
//! type = "translational-stop"
//! bodies = ["ground", "carriage"]
//! point = [0, 0, 0]
//! axis = [1, 0, 0]
//! params.lower = "-0.2 m"
//! params.upper = "0.5 m"
//! params.restitution = 0.7
//!
//! [[output]]
//! name = "x"
//! quantity = "position"
//! of = "carriage"
//! component = "x"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct TranslationalStop(TranslationalStopParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct TranslationalStopParameters {
    /// The lower end; not given: none.
    #[param(unit = "m", example = -0.1)]
    pub lower: Option<f64>,
    /// The upper end; not given: none.
    #[param(unit = "m", example = 0.2)]
    pub upper: Option<f64>,
    /// Coefficient of restitution, 0 to 1.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    pub restitution: f64,
}

impl Element for TranslationalStop {
    const NAME: &'static str = "translational-stop";
    const SUMMARY: &'static str = "hard stops of a sliding motion, with restitution";
    const DOC: &'static str = doc_of(include_str!("translational_stop.rs"));
    const EXEMPT: &'static [(&'static str, &'static str)] =
        &[("free-motion", "its two rows are two ends, which are never both met")];
    const FRAMES: &'static [FrameSpec] = crate::FRAMES;
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1]];
    type Parameters = TranslationalStopParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        crate::refuse_no_ends(p.lower, p.upper)?;
        Ok(Self(p))
    }
}

impl Constraint for TranslationalStop {
    const ROWS: &'static [&'static str] = &["lower", "upper"];

    fn unilateral(&self, _: usize) -> Option<f64> {
        Some(self.0.restitution)
    }

    fn uses_row(&self, row: usize) -> bool {
        [self.0.lower, self.0.upper][row].is_some()
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let s = blocks::displacement_along_z(&at.frames[0], &at.frames[1]);
        if let Some(lower) = self.0.lower {
            rows.set(0, s - lower);
        }
        if let Some(upper) = self.0.upper {
            rows.set(1, -s + upper);
        }
    }
}
