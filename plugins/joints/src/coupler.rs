//! A linear relation between two joint coordinates, each a rotation or a translation: a belt, a chain, a lever, a spindle
//! drive, gears seen from afar. The bodies are guided by joints of their own; this joint only ties the coordinates.
//!
//! ## Equations
//!
//! q_1 and q_2 are the rotation about z of frame `j` against frame `i` of each pair, or the displacement z_i . (p_j - p_i).
//!
//! | first, second | row "relation" |
//! |---|---|
//! | translation, translation | q_2 - (ratio q_1 + displacement_offset) = 0, m |
//! | rotation, rotation | q_2 ahead of ratio q_1 + angle_offset = 0, rad |
//! | rotation, translation | q_1 ahead of (q_2 - displacement_offset) / lead = 0, times lead, m |
//! | translation, rotation | q_2 ahead of q_1 / lead + angle_offset = 0, rad |
//!
//! "Ahead of" is a difference within half a turn; only q_1 of two rotations is counted over many turns, so that no two large
//! numbers are subtracted. Source: linear combination of two coordinates, as the gears of Haug 1989, section 3.4.
//!
//! ## Signs
//!
//! `ratio` = q_2 / q_1 for coordinates of one kind, negative when they move in opposite senses. `lead` is the displacement per
//! angle, whichever of the two comes first.
//!
//! ## Singular cases
//!
//! None. At the start the angles are taken modulo a turn, q_1 of two rotations in (-pi, pi].
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
//! name = "left"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//!
//! [[body]]
//! name = "right"
//! mass = 2.0
//! inertia = [0.1, 0.1, 0.1]
//!
//! [[joint]]
//! name = "guide_1"
//! type = "translational"
//! bodies = ["ground", "left"]
//!
//! [[joint]]
//! name = "guide_2"
//! type = "translational"
//! bodies = ["ground", "right"]
//!
//! [[joint]]
//! name = "rope"
//! type = "coupler"
//! bodies = ["ground", "left", "ground", "right"]
//! params = { first = "translation", second = "translation", ratio = -1.0 }
//!
//! [[output]]
//! name = "a"
//! quantity = "acceleration"
//! of = "left"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Coupler {
    /// Whether the first and the second coordinate are rotations.
    rotations: (bool, bool),
    /// Ratio or lead, SI.
    factor: f64,
    /// m or rad.
    offset: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct CouplerParameters {
    /// Kind of the first coordinate.
    #[param(choices = ["rotation", "translation"], default = "rotation")]
    pub first: String,
    /// Kind of the second coordinate.
    #[param(choices = ["rotation", "translation"], default = "rotation")]
    pub second: String,
    /// Second coordinate by first, for coordinates of one kind; not zero.
    #[param(example = 2.0)]
    pub ratio: Option<f64>,
    /// Displacement by angle, for a rotation and a translation; not zero.
    #[param(unit = "m/rad")]
    pub lead: Option<f64>,
    /// Second coordinate where the first is zero, if it is a rotation.
    #[param(unit = "rad", default = 0.0)]
    pub angle_offset: f64,
    /// Second coordinate where the first is zero, if it is a translation.
    #[param(unit = "m", default = 0.0)]
    pub displacement_offset: f64,
}

impl Element for Coupler {
    const NAME: &'static str = "coupler";
    const SUMMARY: &'static str = "linear relation of two rotations or translations";
    const DOC: &'static str = doc_of(include_str!("coupler.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("first_i", "first pair, on the body that guides; z is the axis of rotation or translation"),
        FrameSpec::new("first_j", "first pair, on the body that moves"),
        FrameSpec::new("second_i", "second pair, on the body that guides; z is the axis of rotation or translation"),
        FrameSpec::new("second_j", "second pair, on the body that moves"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[0, 1], [2, 3]];
    const ANGLES: usize = 1;
    type Parameters = CouplerParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let (first, second) = (p.first == "rotation", p.second == "rotation");
        let (ratio, lead) = (("ratio", p.ratio), ("lead", p.lead));
        let ((name, factor), (other, surplus)) = if first == second { (ratio, lead) } else { (lead, ratio) };
        let refused = |name: &str, why: &str| Err(ParamError::new(name, why));
        if surplus.is_some() {
            return refused(other, &format!("does not apply to {} and {}", p.first, p.second));
        }
        let Some(factor) = factor.filter(|factor| *factor != 0.0) else {
            return refused(name, "must be given, and not be zero");
        };
        if (if second { p.displacement_offset } else { p.angle_offset }) != 0.0 {
            let name = if second { "displacement_offset" } else { "angle_offset" };
            return refused(name, &format!("does not apply: the second coordinate is a {}", p.second));
        }
        Ok(Self { rotations: (first, second), factor, offset: p.angle_offset + p.displacement_offset })
    }
}

impl Constraint for Coupler {
    const ROWS: &'static [&'static str] = &["relation"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let f = at.frames;
        let displacement = |k: usize| blocks::displacement_along_z(&f[k], &f[k + 1]);
        let turn = |k: usize| blocks::turn_about_z(&f[k], &f[k + 1]);
        rows.push(match self.rotations {
            (false, false) => displacement(2) - displacement(0) * self.factor - self.offset,
            (true, true) => blocks::ahead_of(turn(2), at.angle_about_z(0, 0, 1) * self.factor + self.offset),
            (true, false) => blocks::ahead_of(turn(0), (displacement(2) - self.offset) / self.factor) * self.factor,
            (false, true) => blocks::ahead_of(turn(2), displacement(0) / self.factor + self.offset),
        });
    }
}
