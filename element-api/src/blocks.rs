//! Building blocks: most joints are a few of these.
//!
//! Source: Haug, Computer Aided Kinematics and Dynamics of Mechanical Systems (1989), sections 9.4.2-9.4.4. Each sets
//! the next rows of the constraint.

use crate::element::Rows;
use crate::geometry::{Frame, Vec3};
use crate::scalar::Scalar;

/// Two points coincide: three rows, p_j - p_i in the axes of frame `i`, m.
///
/// Rows in the axes of a frame keep their meaning however the mechanism stands in the ground frame.
pub fn coincident<S: Scalar>(i: &Frame<S>, j: &Frame<S>, rows: &mut Rows<'_, S>) {
    let d = j.position - i.position;
    rows.push_vector(i.rotation.tr_mul(&d));
}

/// Two directions are perpendicular (Haug's dot-1): one row, a . b.
pub fn perpendicular<S: Scalar>(a: Vec3<S>, b: Vec3<S>, rows: &mut Rows<'_, S>) {
    rows.push(a.dot(&b));
}

/// The vector between the frames' origins is perpendicular to `a` (Haug's dot-2): one row, a . (p_j - p_i), m.
pub fn no_offset_along<S: Scalar>(a: Vec3<S>, i: &Frame<S>, j: &Frame<S>, rows: &mut Rows<'_, S>) {
    rows.push(a.dot(&(j.position - i.position)));
}

/// The z axes are parallel (Haug's parallel-1): two rows, x_i . z_j and y_i . z_j.
///
/// Also satisfied by opposite axes; the start decides which.
pub fn parallel_z<S: Scalar>(i: &Frame<S>, j: &Frame<S>, rows: &mut Rows<'_, S>) {
    perpendicular(i.x(), j.z(), rows);
    perpendicular(i.y(), j.z(), rows);
}

/// The second origin lies on the z axis of the first frame (with [`parallel_z`], Haug's parallel-2): two rows, m.
pub fn on_z_axis<S: Scalar>(i: &Frame<S>, j: &Frame<S>, rows: &mut Rows<'_, S>) {
    no_offset_along(i.x(), i, j, rows);
    no_offset_along(i.y(), i, j, rows);
}

/// All axes are parallel: three rows. Valid while the frames are less than a quarter turn apart.
pub fn same_orientation<S: Scalar>(i: &Frame<S>, j: &Frame<S>, rows: &mut Rows<'_, S>) {
    parallel_z(i, j, rows);
    perpendicular(i.y(), j.x(), rows);
}

/// The rotation of frame `j` against frame `i` as a rotation vector (axis times angle), rad, in the axes of frame `i`.
///
/// With R = A_i^T A_j, w the axial vector of (R - R^T) / 2, c = cos^2(angle / 2) and u = tan^2(angle / 2), it is w G(u) / c,
/// G(u) = atan(sqrt(u)) / sqrt(u). As c = c (c + s) = c^2 + w^2 / 4, s = 1 - c, it keeps its digits near half a turn, too. The angle
/// is halved three times more, tan(a / 2) = tan(a) / (1 + sqrt(1 + tan^2 a)), until twelve terms of the power series of G are
/// exact to rounding. There is no root near zero, so that value and derivatives are exact there, and nothing switches. Valid
/// below half a turn.
///
/// Source: Bauchau & Trainelli, The vectorial parameterization of rotation, Nonlinear Dynamics 32 (2003).
#[must_use]
pub fn rotation_vector<S: Scalar>(i: &Frame<S>, j: &Frame<S>) -> Vec3<S> {
    let r = i.rotation.tr_mul(&j.rotation);
    let w = Vec3::new(r[(2, 1)] - r[(1, 2)], r[(0, 2)] - r[(2, 0)], r[(1, 0)] - r[(0, 1)]) * S::from(0.5);
    let trace = r[(0, 0)] + r[(1, 1)] + r[(2, 2)];
    let rough = (trace + 1.0) * 0.25;
    let c = rough * rough + w.dot(&w) * 0.25;
    let mut f = S::one() / c;
    let mut u = (S::from(3.0) - trace) * 0.25 * f;
    for _ in 0..3 {
        let half = S::one() / ((u + 1.0).sqrt() + 1.0);
        f = f * half * 2.0;
        u *= half * half;
    }
    let series = (0..12).rev().fold(S::zero(), |sum, n| S::from(1.0 / f64::from(2 * n + 1)) - sum * u);
    w * (f * series)
}

/// The torque (N m, axes of frame `i`) whose power is `moment` . theta', theta being the [`rotation_vector`] of frame
/// `j` against frame `i`: the torque on body `j` of a potential V(theta) is minus this for the moment dV/dtheta,
/// exactly, and on body `i` the opposite.
///
/// It is T^-T m, with T^-1 the matrix that gives theta' from the relative angular velocity: m + theta x m / 2 + k theta
/// x (theta x m), k = (1 - (t/2) cot(t/2)) / t^2, t = |theta| (Bauchau & Trainelli 2003). Valid below a full turn.
#[must_use]
pub fn conjugate_torque<S: Scalar>(theta: Vec3<S>, moment: Vec3<S>) -> Vec3<S> {
    let once = theta.cross(&moment);
    moment + once * S::from(0.5) + theta.cross(&once) * tangent_factor(theta.dot(&theta))
}

/// The rate of the [`rotation_vector`] theta, rad/s, for the angular velocity `spin` of frame `j` against frame `i` in
/// the axes of frame `i`: T^-1 spin of [`conjugate_torque`].
#[must_use]
pub fn rotation_vector_rate<S: Scalar>(theta: Vec3<S>, spin: Vec3<S>) -> Vec3<S> {
    // The transpose of T^-1(theta) is T^-1(-theta).
    conjugate_torque(-theta, spin)
}

/// k = (1 - (t/2) cot(t/2)) / t^2 of x = t^2: q(t^2 / 4) / 4 with q(z) = (1 - h) / z, h(y) = y cot y at y^2 = z. From the power
/// series of q at an eighth of the angle, with Bernoulli's numbers (Abramowitz & Stegun 1964, 4.3.70), by doubling it three
/// times: h(2y) = h(y) - y^2 / h(y). Nothing switches; exact to rounding below a full turn.
fn tangent_factor<S: Scalar>(x: S) -> S {
    const SERIES: [f64; 9] = [
        1.0 / 3.0,
        1.0 / 45.0,
        2.0 / 945.0,
        1.0 / 4725.0,
        2.0 / 93_555.0,
        1382.0 / 638_512_875.0,
        4.0 / 18_243_225.0,
        3617.0 / 162_820_783_125.0,
        87_734.0 / 38_979_295_480_125.0,
    ];
    let mut z = x / 256.0;
    let mut q = SERIES.iter().rev().fold(S::zero(), |sum, c| sum * z + *c);
    for _ in 0..3 {
        q = (q + S::one() / (S::one() - z * q)) * 0.25;
        z = z * 4.0;
    }
    q * 0.25
}

/// The frames are one: six rows, [`coincident`] and [`same_orientation`].
pub fn welded<S: Scalar>(i: &Frame<S>, j: &Frame<S>, rows: &mut Rows<'_, S>) {
    coincident(i, j, rows);
    same_orientation(i, j, rows);
}

/// Shift of the second origin along the z axis of the first frame, z_i . (p_j - p_i), m.
#[must_use]
pub fn displacement_along_z<S: Scalar>(i: &Frame<S>, j: &Frame<S>) -> S {
    i.z().dot(&(j.position - i.position))
}

/// Sine and cosine of the angle by which frame `j` is turned against frame `i` about their common z axis:
/// x_j . y_i and x_j . x_i.
#[must_use]
pub fn turn_about_z<S: Scalar>(i: &Frame<S>, j: &Frame<S>) -> (S, S) {
    (j.x().dot(&i.y()), j.x().dot(&i.x()))
}

/// By how much the angle with this sine and cosine is ahead of `target`, rad, in (-pi, pi]: atan2(s cos target - c sin
/// target, c cos target + s sin target). A common factor of sine and cosine does no harm.
///
/// Whole turns drop out. A row made of it needs no count of turns, stays smooth however far the angle has turned, and
/// can be assembled from any number of turns; its rounding is that of `target`, 4e-12 rad after 10 000 turns.
#[must_use]
pub fn ahead_of<S: Scalar>(turn: (S, S), target: S) -> S {
    let ((sin, cos), (st, ct)) = (turn, (target.sin(), target.cos()));
    (sin * ct - cos * st).atan2(cos * ct + sin * st)
}
