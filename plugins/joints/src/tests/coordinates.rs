//! What joint coordinates say.

use std::f64::consts::PI;

use element_api::testkit::{Random, Setting, on_common_axis, turn};
use element_api::{Constraint, Frame, Pose, Vec3};

use super::probe;
use crate::cylindrical::Cylindrical;
use crate::planar::Planar;
use crate::position::Position;
use crate::revolute::Revolute;
use crate::screw::Screw;
use crate::translational::Translational;
use crate::universal::Universal;

/// Joint coordinates at frames at rest.
fn coordinates<T: Constraint>(params: &str, frames: Vec<Frame<f64>>) -> Vec<f64> {
    let probe = probe::<T>(params);
    let mut setting = Setting::at_rest(frames);
    probe.settle(&mut setting);
    probe.joint_values(&setting).coordinates().to_vec()
}

fn assert_near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-13, "{found} instead of {expected}");
    }
}

/// Frame j at a pose in frame i.
fn posed(i: &Frame<f64>, pose: &Pose<f64>) -> Frame<f64> {
    Frame { position: i.position + i.rotation * pose.position, rotation: i.rotation * pose.rotation }
}

#[test]
fn revolute_angle_is_positive_when_the_second_body_turns_to_the_left() {
    let i = Frame { position: Vec3::zeros(), rotation: turn(Vec3::zeros()) };
    assert_near(&coordinates::<Revolute>("", vec![i, on_common_axis(&i, 0.3, 0.0)]), &[0.3]);
}

#[test]
fn translational_coordinate_grows_along_the_first_z_axis() {
    let i = Frame { position: Vec3::new(1.0, 2.0, 3.0), rotation: turn(Vec3::new(0.0, 1.5, 0.0)) };
    assert_near(&coordinates::<Translational>("", vec![i, on_common_axis(&i, 0.0, 0.25)]), &[0.25]);
}

#[test]
fn coordinates_of_a_pose_are_the_coordinates_it_was_made_of() {
    let mut random = Random::new(8);
    for _ in 0..20 {
        let i = random.frame();
        let mut q = || random.between(-3.0, 3.0);
        let q = [q(), q(), q()];
        assert_near(&coordinates::<Cylindrical>("", vec![i, posed(&i, &Cylindrical.pose(&q[..2]))]), &q[..2]);
        assert_near(&coordinates::<Universal>("", vec![i, posed(&i, &Universal.pose(&q[..2]))]), &q[..2]);
        assert_near(&coordinates::<Planar>("", vec![i, posed(&i, &Planar.pose(&q))]), &q);
        assert_near(&coordinates::<Translational>("", vec![i, posed(&i, &Translational.pose(&q[..1]))]), &q[..1]);
    }
}

#[test]
fn screw_counts_its_turns_by_the_displacement() {
    let i = Random::new(14).frame();
    let turned = 10.0 * std::f64::consts::TAU + 0.5;
    let found = coordinates::<Screw>(
        "pitch = 0.002",
        vec![i, on_common_axis(&i, turned, 0.002 * (10.0 + 0.5 / std::f64::consts::TAU))],
    );
    assert!(
        (found[0] - turned).abs() < 1e-11 && (found[1] - 0.002 * turned / std::f64::consts::TAU).abs() < 1e-15,
        "{found:?}"
    );
    let free = coordinates::<Screw>("pitch = 0", vec![i, on_common_axis(&i, 0.5, 0.0)]);
    assert_near(&free, &[0.5, 0.0]);
}

#[test]
fn position_gives_cardan_angles_about_x_new_y_new_z() {
    let mut random = Random::new(15);
    for _ in 0..20 {
        let i = random.frame();
        let d = random.vector(2.0);
        let [a, b, c] = [random.between(-3.0, 3.0), random.between(-1.5, 1.5), random.between(-3.0, 3.0)];
        let rotation = turn(Vec3::new(a, 0.0, 0.0)) * turn(Vec3::new(0.0, b, 0.0)) * turn(Vec3::new(0.0, 0.0, c));
        let j = posed(&i, &Pose { position: d, rotation });
        assert_near(&coordinates::<Position>("x = 0", vec![i, j]), &[d.x, d.y, d.z, a, b, c]);
        // Prescribed as a whole and one by one, the same orientation satisfies the rows.
        let whole = format!("about_x = {a:?}\nabout_y = {b:?}\nabout_z = {c:?}");
        super::assert_satisfied::<Position>(&whole, vec![i, j]);
        super::assert_satisfied::<Position>(&format!("about_x = {a:?}\nabout_z = {c:?}"), vec![i, j]);
        super::assert_satisfied::<Position>(&format!("about_y = {b:?}"), vec![i, j]);
    }
}

/// The rows are as far from zero as the orientation is from what is prescribed, however far that is: no other satisfies them.
#[test]
fn position_tells_a_whole_orientation_from_all_others() {
    let mut random = Random::new(16);
    let axes = [Vec3::x(), Vec3::y(), Vec3::z(), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 1.0)];
    for trial in 0..400 {
        let i = random.frame();
        let [a, b, c] = [(); 3].map(|()| random.between(-3.0, 3.0));
        let target = turn(Vec3::new(a, 0.0, 0.0)) * turn(Vec3::new(0.0, b, 0.0)) * turn(Vec3::new(0.0, 0.0, c));
        let axis = axes.get(trial).copied().unwrap_or_else(|| random.vector(1.0)).normalize();
        let angle = if trial < 10 { PI } else { random.between(0.0, PI) };
        let j = posed(&i, &Pose { position: Vec3::zeros(), rotation: target * turn(axis * angle) });
        let rows = super::rows::<Position>(&format!("about_x = {a:?}\nabout_y = {b:?}\nabout_z = {c:?}"), vec![i, j]);
        let size = rows.iter().map(|row| row * row).sum::<f64>().sqrt();
        assert!((size - angle).abs() < 5e-5, "{size} instead of {angle}, about {axis:?}");
    }
}
