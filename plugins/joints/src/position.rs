//! Prescribes chosen coordinates of a body, constant or as functions of time: a shaker table, a measured motion, a body held in
//! some directions only.
//!
//! ## Equations
//!
//! With d = p_j - p_i, A = A_i^T A_j, and a function of time for each coordinate that is prescribed:
//!
//! | row | equation |
//! |---|---|
//! | x, y, z | A_i^T d - (x, y, z)(t) = 0, m |
//! | about x | atan2(-A_23, A_33) ahead of about_x(t) = 0, rad |
//! | about y | atan2(A_13, sqrt(A_11^2 + A_12^2)) ahead of about_y(t) = 0, rad |
//! | about z | atan2(-A_12, A_11) ahead of about_z(t) = 0, rad |
//!
//! With all three angles the orientation is prescribed as a whole, T(t) = A_i R_x(about_x) R_y(about_y) R_z(about_z), and the
//! rows are the rotation vector of frame `j` against T (axis times angle, in the axes of T), which is zero there alone. Source:
//! Wittenburg, Dynamics of Multibody Systems (2008), section 2.1 (Bryan angles, also called Cardan angles).
//!
//! ## Signs
//!
//! Coordinates are those of frame `j` in frame `i`; angles turn the body about its x, its new y, its new z axis.
//!
//! ## Singular cases
//!
//! Single angles: about_y stays between -90 and 90 deg, and at its ends (gimbal lock) the other two are undefined. All three
//! together have no singular orientation, and are assembled from any, half a turn away included; the reported coordinates are
//! then those with |about_y| <= 90 deg.
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
//! name = "table"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//!
//! [[joint]]
//! name = "shaker"
//! type = "position"
//! bodies = ["ground", "table"]
//! params = { x = 0.0, y = "0.01 sin(10 t)", z = 0.0, about_x = 0.0, about_y = 0.0, about_z = "3 t" }
//!
//! [[output]]
//! name = "force"
//! quantity = "reaction_force"
//! of = "shaker"
//! on = "table"
//! component = "y"
//! ```

use element_api::prelude::*;

/// Cardan angles of what is beside a target, rad. Digits of a derivative are lost with the square of the distance from the jump.
const ASIDE: [f64; 3] = [0.61e-5, 0.93e-5, 1.37e-5];

/// The joint.
#[derive(Debug, Clone)]
pub struct Position {
    shifts: [Option<Function>; 3],
    angles: [Option<Function>; 3],
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct PositionParameters {
    /// Shift along x of frame i over time; free if left out.
    #[param(unit = "s -> m", variable = "t", example = Function::constant(0.1))]
    pub x: Option<Function>,
    /// Shift along y of frame i over time; free if left out.
    #[param(unit = "s -> m", variable = "t")]
    pub y: Option<Function>,
    /// Shift along z of frame i over time; free if left out.
    #[param(unit = "s -> m", variable = "t")]
    pub z: Option<Function>,
    /// First Cardan angle, about x, over time; free if left out.
    #[param(unit = "s -> rad", variable = "t")]
    pub about_x: Option<Function>,
    /// Second Cardan angle, about y, over time; free if left out.
    #[param(unit = "s -> rad", variable = "t")]
    pub about_y: Option<Function>,
    /// Third Cardan angle, about z, over time; free if left out.
    #[param(unit = "s -> rad", variable = "t")]
    pub about_z: Option<Function>,
}

impl Element for Position {
    const NAME: &'static str = "position";
    const SUMMARY: &'static str = "prescribes chosen coordinates of a body, constant or over time";
    const DOC: &'static str = doc_of(include_str!("position.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its origin and axes are those of the coordinates"),
        FrameSpec::new("j", "on the second body; on frame i when all coordinates are zero"),
    ];
    const ANGLES: usize = 2;
    type Parameters = PositionParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let shifts = [p.x, p.y, p.z];
        let angles = [p.about_x, p.about_y, p.about_z];
        if shifts.iter().chain(&angles).all(Option::is_none) {
            return Err(ParamError::new("", "prescribe at least one of x, y, z, about_x, about_y, about_z"));
        }
        Ok(Self { shifts, angles })
    }
}

impl Constraint for Position {
    const ROWS: &'static [&'static str] = &["x", "y", "z", "about x", "about y", "about z"];
    const COORDINATES: &'static [ChannelSpec] = &[
        crate::SHIFTS[0],
        crate::SHIFTS[1],
        crate::SHIFTS[2],
        ChannelSpec::new("about_x", "rad", "first Cardan angle, counted over many turns"),
        ChannelSpec::new("about_y", "rad", "second Cardan angle"),
        ChannelSpec::new("about_z", "rad", "third Cardan angle, counted over many turns"),
    ];

    fn uses_row(&self, row: usize) -> bool {
        if row < 3 { self.shifts[row].is_some() } else { self.angles[row - 3].is_some() }
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        let shift = i.rotation.tr_mul(&(j.position - i.position));
        for (k, wanted) in self.shifts.iter().enumerate() {
            if let Some(wanted) = wanted {
                rows.set(k, shift[k] - wanted.at(at.time));
            }
        }
        if let [Some(x), Some(y), Some(z)] = &self.angles {
            let target = i.rotation * cardan([x, y, z].map(|angle| angle.at(at.time)));
            let beyond = beyond(target, &j.rotation);
            (0..3).for_each(|k| rows.set(3 + k, beyond[k]));
            return;
        }
        for (k, (turn, wanted)) in turns(i, j).into_iter().zip(&self.angles).enumerate() {
            if let Some(wanted) = wanted {
                rows.set(3 + k, blocks::ahead_of(turn, wanted.at(at.time)));
            }
        }
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        out.push_vector(i.rotation.tr_mul(&(j.position - i.position)));
        let [x, y, z] = turns(i, j);
        out.push(at.angle(0, x.0, x.1));
        out.push(y.0.atan2(y.1));
        out.push(at.angle(1, z.0, z.1));
    }
}

/// Sine and cosine of the three Cardan angles, the first and third times the cosine of the second.
fn turns<S: Scalar>(i: &Frame<S>, j: &Frame<S>) -> [(S, S); 3] {
    let a = i.rotation.tr_mul(&j.rotation);
    let cos_y = (a[(0, 0)] * a[(0, 0)] + a[(0, 1)] * a[(0, 1)]).sqrt();
    [(-a[(1, 2)], a[(2, 2)]), (a[(0, 2)], cos_y), (-a[(0, 1)], a[(0, 0)])]
}

/// The rotation vector of an orientation against a target, less what it is at the target itself, rad: zero there alone.
///
/// Half a turn away there is no rotation vector, as either direction is as good. Rows that are zero at the target alone must jump
/// somewhere (continuous ones have as many zeros of one sign as of the other), but scenes do have bodies half a turn away. So the vector
/// is taken from [`ASIDE`] of the target, and jumps where no scene begins.
fn beyond<S: Scalar>(target: Mat3<S>, orientation: &Mat3<S>) -> Vec3<S> {
    let at = |rotation| Frame { position: Vec3::zeros(), rotation };
    let aside = cardan(ASIDE.map(S::from));
    blocks::rotation_vector(&at(target * aside), &at(*orientation))
        - blocks::rotation_vector(&at(aside), &at(Mat3::identity()))
}

/// R_x R_y R_z.
fn cardan<S: Scalar>(angles: [S; 3]) -> Mat3<S> {
    let ([sx, sy, sz], [cx, cy, cz]) = (angles.map(S::sin), angles.map(S::cos));
    let (o, l) = (S::zero(), S::one());
    Mat3::new(l, o, o, o, cx, -sx, o, sx, cx)
        * Mat3::new(cy, o, sy, o, l, o, -sy, o, cy)
        * Mat3::new(cz, -sz, o, sz, cz, o, o, o, l)
}
