//! Displacement and rotation of frame j against frame i as six numbers, and the wrench of a load that is conjugate to
//! them: what beam, bushing and field share.
//!
//! ```text
//! e = (u, theta)    u = A_i^T (p_j - p_i) - offset    theta = rotation vector of A_i^T A_j           (1)
//! e' = (u', theta')    u' = A_i^T (v_j - v_i - omega_i x (p_j - p_i))                                (2)
//! load (f, m) with the power f . u' + m . theta':
//!     force on j at p_j: -A_i f    torque on j: -A_i T^-T m    on i the opposite along the same line     (3)
//! ```
//!
//! With f, m = dV/de, (3) is exactly the wrench of the potential V: nothing is lost for large rotations.

use element_api::prelude::*;

/// Six numbers: along x, y, z of frame i, then about x, y, z.
pub type Six<S> = [S; 6];

/// A symmetric matrix that belongs to [`Six`], by rows.
pub type SixBySix = [[f64; 6]; 6];

/// Rotation, rad, beyond which the rotation vector is near half a turn, where it jumps.
const NEARLY: f64 = 2.5;

/// The check of [`room_to_turn`].
pub const TURNED: &[ChannelSpec] = &[ChannelSpec::new(
    "turn",
    "rad",
    "is turned by more than 2.5 rad: at half a turn its rotation jumps to the other side, and its torque with it (give what turns that far \
     no rotational stiffness here, and a `rotational-spring-damper` about its axis)",
)];

/// What is left to a rotation that is nearly half a turn, rad.
pub fn room_to_turn<S: Scalar>(e: &Six<S>) -> S {
    let theta = angular(e);
    S::from(NEARLY) - theta.dot(&theta).sqrt()
}

/// Whether a load depends on rotation, by its stiffness and damping.
pub fn is_turned(matrices: &[&SixBySix]) -> bool {
    matrices.iter().flat_map(|matrix| &matrix[3..]).flatten().any(|entry| *entry != 0.0)
}

/// (1)
pub fn deformation<S: Scalar>(at: &Motion<'_, S>, offset: [f64; 3]) -> Six<S> {
    let (i, j) = (&at.frames()[0], &at.frames()[1]);
    let u = i.rotation.tr_mul(&(j.position - i.position));
    let theta = blocks::rotation_vector(i, j);
    [u.x - offset[0], u.y - offset[1], u.z - offset[2], theta.x, theta.y, theta.z]
}

/// (2), for the deformation `e`.
pub fn rate<S: Scalar>(at: &Motion<'_, S>, e: &Six<S>) -> Six<S> {
    let (i, j) = (&at.frames()[0], &at.frames()[1]);
    let (a, b) = (&at.twists[0], &at.twists[1]);
    let carried = a.angular_velocity.cross(&(j.position - i.position));
    let u = i.rotation.tr_mul(&(b.velocity - a.velocity - carried));
    let spin = i.rotation.tr_mul(&(b.angular_velocity - a.angular_velocity));
    let theta = blocks::rotation_vector_rate(angular(e), spin);
    [u.x, u.y, u.z, theta.x, theta.y, theta.z]
}

/// Force and torque that body j exerts on the element (axes of frame i) for the load conjugate to the deformation `e`.
pub fn exerted<S: Scalar>(e: &Six<S>, load: &Six<S>) -> Six<S> {
    let torque = blocks::conjugate_torque(angular(e), angular(load));
    [load[0], load[1], load[2], torque.x, torque.y, torque.z]
}

/// (3)
pub fn apply<S: Scalar>(at: &Motion<'_, S>, e: &Six<S>, load: &Six<S>, out: &mut Wrenches<'_, S>) {
    let rotation = at.frames()[0].rotation;
    let exerted = exerted(e, load);
    out.force_pair(0, 1, -(rotation * Vec3::new(exerted[0], exerted[1], exerted[2])));
    out.torque_pair(0, 1, -(rotation * angular(&exerted)));
}

/// Matrix times numbers. Zeros of the matrix leave no trace in the recording.
pub fn product<S: Scalar>(matrix: &SixBySix, e: &Six<S>) -> Six<S> {
    std::array::from_fn(|row| {
        let terms = matrix[row].iter().zip(e).filter(|(factor, _)| **factor != 0.0);
        terms.map(|(factor, value)| *value * *factor).fold(S::zero(), |sum, term| sum + term)
    })
}

/// Sum of products.
pub fn dot<S: Scalar>(a: &Six<S>, b: &Six<S>) -> S {
    a.iter().zip(b).map(|(a, b)| *a * *b).fold(S::zero(), |sum, term| sum + term)
}

/// Number by number.
pub fn sum<S: Scalar>(a: &Six<S>, b: &Six<S>) -> Six<S> {
    std::array::from_fn(|k| a[k] + b[k])
}

fn angular<S: Scalar>(e: &Six<S>) -> Vec3<S> {
    Vec3::new(e[3], e[4], e[5])
}
