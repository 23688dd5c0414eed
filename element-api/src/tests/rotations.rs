//! The rotation vector and what is conjugate to it, near zero and up to half a turn.

use nalgebra::Matrix3;

use crate::blocks::{conjugate_torque, rotation_vector, rotation_vector_rate};
use crate::testkit::{Random, turn};
use crate::{Frame, Jet, Vec3};

/// Angles at and around the places where the formulas change, rad.
const ANGLES: [f64; 12] = [0.0, 1e-200, 1e-12, 1e-6, 1e-3, 0.2837, 0.2839, 0.4999, 0.5001, 1.0, 2.5, 3.1];

fn frame(rotation: Matrix3<f64>) -> Frame<f64> {
    Frame { position: Vec3::zeros(), rotation }
}

fn cases() -> impl Iterator<Item = (Vec3<f64>, Vec3<f64>, Frame<f64>)> {
    let mut random = Random::new(11);
    ANGLES.into_iter().flat_map(move |angle| {
        (0..5).map(|_| (random.vector(1.0).normalize() * angle, random.vector(1.0), random.frame())).collect::<Vec<_>>()
    })
}

/// Frame j turned by `theta` against frame i, turning on with `spin` (axes of i): the rotation exp(spin t) exp(theta)
/// and its derivatives at t = 0.
fn turning(i: &Frame<f64>, theta: Vec3<f64>, spin: Vec3<f64>) -> [Frame<Jet>; 2] {
    let j = i.rotation * turn(theta);
    let world = (i.rotation * spin).cross_matrix();
    let (first, second) = (world * j, world * world * j);
    let moving = Matrix3::from_fn(|r, c| Jet::new(j[(r, c)], first[(r, c)], second[(r, c)]));
    let zero = Vec3::from_element(Jet::from(0.0));
    [Frame { position: zero, rotation: i.rotation.map(Jet::from) }, Frame { position: zero, rotation: moving }]
}

#[test]
fn rotation_vector_of_a_turn_is_its_vector() {
    for (theta, _, i) in cases() {
        let found = rotation_vector(&i, &frame(i.rotation * turn(theta)));
        // Near half a turn the axial vector is short: rounding grows like 1 / sin.
        assert!((found - theta).norm() < 1e-15 + 2e-15 * theta.norm() / (3.15 - theta.norm()), "{theta} {found}");
    }
}

#[test]
fn derivatives_are_those_of_the_motion_also_at_zero() {
    const H: f64 = 1e-3;
    for (theta, spin, i) in cases().filter(|(theta, ..)| theta.norm() < 3.0) {
        let [a, b] = turning(&i, theta, spin);
        let found = rotation_vector(&a, &b);
        let rate = rotation_vector_rate(theta, spin);
        let rate_at = |t: f64| {
            let later = rotation_vector(&i, &frame(i.rotation * turn(spin * t) * turn(theta)));
            rotation_vector_rate(later, spin)
        };
        let slope = (rate_at(-2.0 * H) - rate_at(-H) * 8.0 + rate_at(H) * 8.0 - rate_at(2.0 * H)) / (12.0 * H);
        for k in 0..3 {
            assert!((found[k].first - rate[k]).abs() < 2e-13, "{theta}: {} {}", found[k].first, rate[k]);
            assert!((found[k].second - slope[k]).abs() < 1e-9, "{theta}: {} {}", found[k].second, slope[k]);
        }
    }
}

#[test]
fn turning_about_the_own_axis_changes_the_angle_only() {
    for (theta, spin, i) in cases().filter(|(theta, ..)| theta.norm() > 0.0) {
        let along = theta.normalize() * spin.x;
        let [a, b] = turning(&i, theta, along);
        let found = rotation_vector(&a, &b);
        let tolerance = 1e-12 / (3.15 - theta.norm());
        assert!((found.map(|x| x.first) - along).norm() < tolerance, "{theta}");
        assert!(found.map(|x| x.second).norm() < 10.0 * tolerance, "{theta} {found:?}");
    }
}

#[test]
fn conjugate_torque_has_the_power_of_the_moment() {
    let mut random = Random::new(12);
    for (theta, spin, _) in cases() {
        let moment = random.vector(1.0);
        let power = conjugate_torque(theta, moment).dot(&spin);
        assert!((power - moment.dot(&rotation_vector_rate(theta, spin))).abs() < 1e-14);
    }
}
