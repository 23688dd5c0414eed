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
/// With R = A_i^T A_j, w the axial vector of (R - R^T) / 2 and s = (3 - tr R) / 4 = sin^2(angle / 2), it is f(s) w,
/// where f = angle / sin(angle) = asin(x) / (x sqrt(1 - x^2)) at x^2 = s, a power series in s without roots near zero:
/// value and derivatives are exact there. Valid below half a turn.
///
/// Source: Bauchau & Trainelli, The vectorial parameterization of rotation, Nonlinear Dynamics 32 (2003).
#[must_use]
pub fn rotation_vector<S: Scalar>(i: &Frame<S>, j: &Frame<S>) -> Vec3<S> {
    /// Largest s for which the series is used; its twelve terms are exact to rounding there.
    const SMALL: f64 = 0.02;
    let r = i.rotation.tr_mul(&j.rotation);
    let w = Vec3::new(r[(2, 1)] - r[(1, 2)], r[(0, 2)] - r[(2, 0)], r[(1, 0)] - r[(0, 1)]) * S::from(0.5);
    let trace = r[(0, 0)] + r[(1, 1)] + r[(2, 2)];
    let s = (S::from(3.0) - trace) * 0.25;
    // f = sum c_n s^n with c_0 = 1, c_n = c_(n-1) 2n / (2n + 1), by Horner's rule.
    let series = (1..12).rev().fold(S::one(), |sum, n| {
        let n = f64::from(n);
        S::one() + sum * s * (2.0 * n / (2.0 * n + 1.0))
    });
    // sin and cos of the angle; where the series is used, those at its end, so that nothing here is singular.
    let small = S::from(SMALL);
    let sine = S::select(s, small, S::from(4.0 * SMALL * (1.0 - SMALL)), w.dot(&w)).sqrt();
    let cosine = S::select(s, small, S::from(1.0 - 2.0 * SMALL), (trace - 1.0) * 0.5);
    w * S::select(s, small, series, sine.atan2(cosine) / sine)
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

/// (1 - (t/2) cot(t/2)) / t^2 of x = t^2: the sum of |B_2n| x^(n-1) / (2n)!, B the Bernoulli numbers.
fn tangent_factor<S: Scalar>(x: S) -> S {
    const SMALL: f64 = 0.25;
    const SERIES: [f64; 8] = [
        1.0 / 12.0,
        1.0 / 720.0,
        1.0 / 30_240.0,
        1.0 / 1_209_600.0,
        1.0 / 47_900_160.0,
        691.0 / 1_307_674_368_000.0,
        1.0 / 74_724_249_600.0,
        3617.0 / 10_670_622_842_880_000.0,
    ];
    let series = SERIES.iter().rev().fold(S::zero(), |sum, c| sum * x + *c);
    let large = S::select(x, S::from(SMALL), S::from(SMALL), x);
    let half = large.sqrt() * 0.5;
    S::select(x, S::from(SMALL), series, (S::one() - half * half.cos() / half.sin()) / large)
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
