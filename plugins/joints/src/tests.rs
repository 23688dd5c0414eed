//! What each joint leaves free, what it blocks, and what its coordinates say.

use element_api::Constraint;
use element_api::testkit::{self, Probe, Random, Setting, on_common_axis, turn};
use element_api::{Frame, Vec3};

use crate::cylindrical::Cylindrical;
use crate::fixed::Fixed;
use crate::revolute::Revolute;
use crate::spherical::Spherical;
use crate::translational::Translational;

/// Frame j in frame i: shifts along x, y, z (m), rotations about x, y, z (rad).
const DIRECTIONS: [&str; 6] = ["x", "y", "z", "about x", "about y", "about z"];

#[test]
fn fixed_fulfils_the_contract() {
    testkit::check_joint::<Fixed>("");
}

#[test]
fn revolute_fulfils_the_contract() {
    testkit::check_joint::<Revolute>("");
}

#[test]
fn cylindrical_fulfils_the_contract() {
    testkit::check_joint::<Cylindrical>("");
}

#[test]
fn translational_fulfils_the_contract() {
    testkit::check_joint::<Translational>("");
}

#[test]
fn spherical_fulfils_the_contract() {
    testkit::check_joint::<Spherical>("");
}

#[test]
fn each_joint_leaves_its_directions_free_and_blocks_the_others_by_the_row_of_that_name() {
    check_directions::<Fixed>(&[]);
    check_directions::<Revolute>(&["about z"]);
    check_directions::<Cylindrical>(&["z", "about z"]);
    check_directions::<Translational>(&["z"]);
    check_directions::<Spherical>(&["about x", "about y", "about z"]);
}

#[test]
fn large_free_motions_satisfy_the_rows() {
    let mut random = Random::new(7);
    for _ in 0..20 {
        let i = random.frame();
        let (angle, distance) = (random.between(-3.0, 3.0), random.between(-5.0, 5.0));
        assert_satisfied::<Revolute>(i, on_common_axis(&i, angle, 0.0));
        assert_satisfied::<Cylindrical>(i, on_common_axis(&i, angle, distance));
        assert_satisfied::<Translational>(i, on_common_axis(&i, 0.0, distance));
        assert_satisfied::<Spherical>(i, Frame { rotation: turn(random.vector(3.0)), ..i });
        assert_satisfied::<Fixed>(i, i);
    }
}

#[test]
fn cylindrical_coordinates_are_the_angle_and_the_displacement() {
    let mut random = Random::new(8);
    let probe = Probe::joint::<Cylindrical>("").expect("no parameters");
    for _ in 0..20 {
        let i = random.frame();
        let (angle, distance) = (random.between(-3.0, 3.0), random.between(-5.0, 5.0));
        let mut setting = Setting::at_rest(vec![i, on_common_axis(&i, angle, distance)]);
        probe.settle(&mut setting);
        let coordinates = probe.joint_values(&setting).coordinates().to_vec();
        assert!((coordinates[0] - angle).abs() < 1e-13, "{angle}: {coordinates:?}");
        assert!((coordinates[1] - distance).abs() < 1e-13, "{distance}: {coordinates:?}");
    }
}

#[test]
fn translational_coordinate_grows_along_the_first_z_axis() {
    let i = Frame { position: Vec3::new(1.0, 2.0, 3.0), rotation: turn(Vec3::new(0.0, 1.5, 0.0)) };
    let probe = Probe::joint::<Translational>("").expect("no parameters");
    let found = probe.joint_values(&Setting::at_rest(vec![i, on_common_axis(&i, 0.0, 0.25)]));
    assert!((found.coordinates()[0] - 0.25).abs() < 1e-15);
}

#[test]
fn revolute_angle_is_positive_when_the_second_body_turns_to_the_left() {
    let i = Frame { position: Vec3::zeros(), rotation: turn(Vec3::zeros()) };
    let probe = Probe::joint::<Revolute>("").expect("no parameters");
    let mut setting = Setting::at_rest(vec![i, on_common_axis(&i, 0.3, 0.0)]);
    setting.references = vec![0.0];
    assert!((probe.joint_values(&setting).coordinates()[0] - 0.3).abs() < 1e-15);
}

#[test]
fn revolute_angle_is_continuous_over_ten_thousand_turns_in_both_directions() {
    let probe = Probe::joint::<Revolute>("").expect("no parameters");
    for sign in [1.0, -1.0] {
        let mut reference = 0.0;
        let steps_per_turn = 3;
        for step in 1..=10_000 * steps_per_turn {
            let angle = sign * std::f64::consts::TAU * f64::from(step) / f64::from(steps_per_turn);
            let i = Frame { position: Vec3::zeros(), rotation: turn(Vec3::zeros()) };
            let mut setting = Setting::at_rest(vec![i, on_common_axis(&i, angle, 0.0)]);
            setting.references = vec![reference];
            reference = probe.joint_values(&setting).angles[0];
            // Rounding of an angle of 6e4 rad, not of a sum over the steps.
            assert!((reference - angle).abs() < 1e-10, "after {step} steps: {reference} instead of {angle}");
        }
    }
}

#[test]
fn rows_and_mobility_add_up_to_six() {
    assert_eq!(Fixed::ROWS.len() + Fixed::MOBILITY.expect("offered"), 6);
    assert_eq!(Revolute::ROWS.len() + Revolute::MOBILITY.expect("offered"), 6);
    assert_eq!(Cylindrical::ROWS.len() + Cylindrical::MOBILITY.expect("offered"), 6);
    assert_eq!(Translational::ROWS.len() + Translational::MOBILITY.expect("offered"), 6);
    assert_eq!(Spherical::MOBILITY, None);
}

fn assert_satisfied<T: Constraint>(i: Frame<f64>, j: Frame<f64>) {
    let probe = Probe::joint::<T>("").expect("no parameters");
    let mut setting = Setting::at_rest(vec![i, j]);
    probe.settle(&mut setting);
    for (row, value) in probe.joint_values(&setting).residual().iter().enumerate() {
        assert!(value.abs() < 1e-13, "{}: row {row} is {value:e}", T::NAME);
    }
}

/// From frames on each other, a small motion in a free direction leaves all rows zero; in a blocked direction it changes
/// the row of that name by its size, and only that row.
fn check_directions<T: Constraint>(free: &[&str]) {
    let probe = Probe::joint::<T>("").expect("no parameters");
    let i = Random::new(9).frame();
    for (k, direction) in DIRECTIONS.iter().enumerate() {
        let step = Vec3::ith(k % 3, 0.01);
        let j = if k < 3 {
            Frame { position: i.position + i.rotation * step, ..i }
        } else {
            Frame { rotation: i.rotation * turn(step), ..i }
        };
        let mut setting = Setting::at_rest(vec![i, j]);
        probe.settle(&mut setting);
        for (name, value) in T::ROWS.iter().zip(probe.joint_values(&setting).residual()) {
            // sin 0.01 differs from 0.01 by 2e-7.
            let expected = if name == direction { 0.01 } else { 0.0 };
            let what = format!("{} moved {direction}: row `{name}` is {value:e}", T::NAME);
            assert!((value.abs() - expected).abs() < 1e-6, "{what}");
        }
        assert_eq!(free.contains(direction), !T::ROWS.contains(direction), "{}: {direction}", T::NAME);
    }
}
