//! Two points coincide: a point of the second body with one of the first, or with a fixed one; on request only in some
//! directions of frame `i`, so that the point moves on a line or in a plane of that frame.
//!
//! ## Equations
//!
//! With d = p_j - p_i (Haug 1989, section 9.4: point rows, dot-2), for each letter of `directions`:
//!
//! | row | equation |
//! |---|---|
//! | x | x_i . d = 0 |
//! | y | y_i . d = 0 |
//! | z | z_i . d = 0 |
//!
//! ## Signs
//!
//! `x`, `y`, `z` are the components of d in the axes of frame `i`, those that are held and those that are free. The reaction
//! force acts on body `j` at the origin of its frame; there is no reaction torque on body `j`.
//!
//! ## Singular cases
//!
//! None. All three directions make the spherical joint, two the point on a line, one the point in a plane.
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
//! name = "pendulum"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.5, 0, 0]
//!
//! [[joint]]
//! name = "tip"
//! type = "point"
//! bodies = ["ground", "pendulum"]
//! point = [0, 0, 0]
//! params.directions = "xyz"
//!
//! [[output]]
//! name = "z"
//! quantity = "position"
//! of = "pendulum"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Along x, y, z of frame i.
    held: [bool; 3],
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct PointParameters {
    /// Directions of frame i in which the point is held.
    #[param(choices = ["x", "y", "z", "xy", "xz", "yz", "xyz"], default = "xyz")]
    pub directions: String,
}

impl Element for Point {
    const NAME: &'static str = "point";
    const SUMMARY: &'static str = "a point of the second body is held, in all directions or some";
    const DOC: &'static str = doc_of(include_str!("point.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its origin is the place of the point, its axes the directions"),
        FrameSpec::new("j", "on the second body; its origin is the point"),
    ];
    type Parameters = PointParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { held: ['x', 'y', 'z'].map(|letter| p.directions.contains(letter)) })
    }
}

impl Constraint for Point {
    const ROWS: &'static [&'static str] = &["x", "y", "z"];
    const COORDINATES: &'static [ChannelSpec] = &crate::SHIFTS;

    fn uses_row(&self, row: usize) -> bool {
        self.held[row]
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let d = shift(at);
        for row in (0..3).filter(|row| self.held[*row]) {
            rows.set(row, d[row]);
        }
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push_vector(shift(at));
    }
}

/// Origin of frame j in frame i, m.
fn shift<S: Scalar>(at: &Configuration<'_, S>) -> Vec3<S> {
    let (i, j) = (&at.frames[0], &at.frames[1]);
    i.rotation.tr_mul(&(j.position - i.position))
}
