//! Springs and dampers.

use element_api::Vec3;
use element_api::testkit::{self, Probe, Setting, on_common_axis};

use super::{assert_close, ground, pulled_apart, two_frames_anywhere, two_frames_turning_about_one_axis};

use crate::rotational_spring_damper::RotationalSpringDamper;
use crate::translational_spring_damper::TranslationalSpringDamper;

const TRANSLATIONAL: &str = "stiffness = 30.0\ndamping = 4.0\nfree_length = 0.5\npreload = 1.5";
const ROTATIONAL: &str = "stiffness = 30.0\ndamping = 4.0\nfree_angle = 0.5\npreload = 1.5";

#[test]
fn translational_spring_damper_fulfils_the_contract() {
    for params in [TRANSLATIONAL, "stiffness = 30.0", "stiffness = 0.0\ndamping = 2.0"] {
        testkit::check_force::<TranslationalSpringDamper>(params);
        testkit::check_internal::<TranslationalSpringDamper>(params);
        testkit::check_power::<TranslationalSpringDamper>(params, two_frames_anywhere);
    }
}

#[test]
fn rotational_spring_damper_fulfils_the_contract() {
    for params in [ROTATIONAL, "stiffness = 30.0"] {
        testkit::check_force::<RotationalSpringDamper>(params);
        testkit::check_internal::<RotationalSpringDamper>(params);
        testkit::check_power::<RotationalSpringDamper>(params, two_frames_turning_about_one_axis);
    }
}

#[test]
fn tension_is_stiffness_times_elongation_plus_damping_times_rate_plus_preload() {
    let probe = Probe::force::<TranslationalSpringDamper>(TRANSLATIONAL).expect("accepted");
    // Two metres apart, parting at 0.25 m/s along the line and sliding past each other across it.
    let found = probe.force_values(&pulled_apart(2.0, Vec3::new(0.25, 7.0, 0.0)));
    let tension = 30.0 * (2.0 - 0.5) + 4.0 * 0.25 + 1.5;
    assert_close(found.channels[0], tension);
    assert_close(found.channels[1], 2.0);
    assert_close((found.forces[0] - Vec3::new(tension, 0.0, 0.0)).norm(), 0.0);
    assert_close((found.forces[1] + Vec3::new(tension, 0.0, 0.0)).norm(), 0.0);
    assert_close(found.potential.expect("given"), 0.5 * 30.0 * 1.5 * 1.5 + 1.5 * 1.5);
    assert_close(found.dissipation.expect("given"), 4.0 * 0.25 * 0.25);
}

#[test]
fn plain_spring_without_free_length_passes_through_zero_length() {
    let probe = Probe::force::<TranslationalSpringDamper>("stiffness = 30.0").expect("accepted");
    let found = probe.force_values(&pulled_apart(0.0, Vec3::new(1.0, 1.0, 0.0)));
    assert_eq!(found.forces[0], Vec3::zeros());
    assert_eq!(found.channels, vec![0.0, 0.0]);
    assert_eq!(found.potential, Some(0.0));
    let found = probe.force_values(&pulled_apart(1e-200, Vec3::zeros()));
    assert_close(found.forces[0].x / 1e-200, 30.0);
}

#[test]
fn direction_at_zero_length_is_reported_as_not_a_number() {
    for params in [TRANSLATIONAL, "stiffness = 30.0\ndamping = 1.0", "stiffness = 30.0\nfree_length = 1.0"] {
        let probe = Probe::force::<TranslationalSpringDamper>(params).expect("accepted");
        assert!(probe.force_values(&pulled_apart(0.0, Vec3::zeros())).forces[0].x.is_nan(), "{params}");
    }
}

#[test]
fn torque_is_stiffness_times_angle_plus_damping_times_rate_plus_preload() {
    let probe = Probe::force::<RotationalSpringDamper>(ROTATIONAL).expect("accepted");
    let mut setting = Setting::at_rest(vec![ground(), on_common_axis(&ground(), 0.75, 0.0)]);
    setting.twists[1].angular_velocity = Vec3::new(0.0, 0.0, 2.0);
    setting.references = vec![0.0];
    let found = probe.force_values(&setting);
    let torque = 30.0 * 0.25 + 4.0 * 2.0 + 1.5;
    assert_close(found.channels[0], torque);
    assert_close(found.channels[1], 0.75);
    // A positive deflection turns the second body back.
    assert_close((found.torques[1] - Vec3::new(0.0, 0.0, -torque)).norm(), 0.0);
    assert_close((found.torques[0] - Vec3::new(0.0, 0.0, torque)).norm(), 0.0);
    assert_close(found.potential.expect("given"), 0.5 * 30.0 * 0.25 * 0.25 + 1.5 * 0.25);
    assert_close(found.dissipation.expect("given"), 4.0 * 2.0 * 2.0);
}

#[test]
fn torsion_spring_winds_up_over_many_turns() {
    let probe = Probe::force::<RotationalSpringDamper>("stiffness = 2.0").expect("accepted");
    let turns = 100.0 * std::f64::consts::TAU;
    let mut setting = Setting::at_rest(vec![ground(), on_common_axis(&ground(), turns + 0.5, 0.0)]);
    setting.references = vec![turns];
    assert!((probe.force_values(&setting).channels[0] - 2.0 * (turns + 0.5)).abs() < 1e-10);
}

#[test]
fn negative_stiffness_damping_and_length_are_out_of_range() {
    for class in [
        element_api::adapt::force::<TranslationalSpringDamper>(),
        element_api::adapt::force::<RotationalSpringDamper>(),
    ] {
        let bounded: Vec<&str> =
            class.descriptor().params.iter().filter(|p| !p.contains(-1.0)).map(|p| p.name.as_str()).collect();
        let expected: &[&str] = match class.descriptor().name.as_str() {
            "translational-spring-damper" => &["stiffness", "damping", "free_length"],
            _ => &["stiffness", "damping"],
        };
        assert_eq!(bounded, expected);
    }
}

#[test]
fn characteristics_add_to_the_linear_terms() {
    let curves = "force_of_elongation = { postfix = [20.0, \"x\", 3.0, \"pow\", \"mul\"] }\n\
                  force_of_speed = [[-1, -6], [0, 0], [1, 6]]";
    let probe = Probe::force::<TranslationalSpringDamper>(&format!("{TRANSLATIONAL}\n{curves}")).expect("accepted");
    let found = probe.force_values(&pulled_apart(2.0, Vec3::new(0.25, 7.0, 0.0)));
    let tension = 30.0 * 1.5 + 4.0 * 0.25 + 1.5 + 20.0 * 1.5_f64.powi(3) + 6.0 * 0.25;
    assert_close(found.channels[0], tension);
    assert_close(found.forces[0].x, tension);
    assert_eq!((found.potential, found.dissipation), (None, None), "no closed form");

    let curves = "torque_of_deflection = [[-1, -3], [0, 0], [1, 3]]\n\
                  torque_of_speed = { postfix = [0.5, \"x\", \"x\", \"abs\", \"mul\", \"mul\"] }";
    let probe = Probe::force::<RotationalSpringDamper>(&format!("{ROTATIONAL}\n{curves}")).expect("accepted");
    let mut setting = Setting::at_rest(vec![ground(), on_common_axis(&ground(), 0.75, 0.0)]);
    setting.twists[1].angular_velocity = Vec3::new(0.0, 0.0, 2.0);
    setting.references = vec![0.0];
    let found = probe.force_values(&setting);
    let torque = 30.0 * 0.25 + 4.0 * 2.0 + 1.5 + 3.0 * 0.25 + 0.5 * 4.0;
    assert_close(found.channels[0], torque);
    assert_close(found.torques[0].z, torque);
    assert_eq!((found.potential, found.dissipation), (None, None), "no closed form");
}

#[test]
fn characteristics_of_speed_alone_are_dissipated() {
    let damper = "stiffness = 30.0\nforce_of_speed = [[-10, -60], [0, 0], [10, 60]]";
    testkit::check_force::<TranslationalSpringDamper>(damper);
    testkit::check_internal::<TranslationalSpringDamper>(damper);
    testkit::check_power::<TranslationalSpringDamper>(damper, two_frames_anywhere);
    let damper = "stiffness = 30.0\ntorque_of_speed = { postfix = [\"x\", 3.0, \"pow\"] }";
    testkit::check_power::<RotationalSpringDamper>(damper, two_frames_turning_about_one_axis);
}
