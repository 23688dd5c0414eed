//! Joint friction.

use element_api::testkit::{self, Probe, Random, Setting, on_common_axis};
use element_api::{Reaction, Vec3};

use super::{assert_close, ground, two_frames_turning_about_one_axis};
use crate::contact_friction::ContactFriction;
use crate::joint_friction::JointFriction;

const ROTATION: &str = "kind = \"rotation\"\nmu = 0.1\nradius = 0.02\ntransition_speed = 0.01";
const TRANSLATION: &str = "kind = \"translation\"\nmu = 0.3\ntransition_speed = 0.01";

#[test]
fn joint_friction_fulfils_the_contract() {
    let stribeck = "mu_static = 0.5\nstribeck_speed = 0.2\nviscous = 3.0\npreload = 2.0";
    for params in [
        ROTATION.to_owned(),
        format!("{ROTATION}\n{stribeck}\nthrust_radius = 0.03"),
        TRANSLATION.to_owned(),
        format!("{TRANSLATION}\n{stribeck}\nguide_length = 0.1"),
    ] {
        testkit::check_force::<JointFriction>(&params);
        testkit::check_internal::<JointFriction>(&params);
        testkit::check_power::<JointFriction>(&params, |random: &mut Random| {
            let mut setting = two_frames_turning_about_one_axis(random);
            setting.reactions = vec![Reaction { force: random.vector(5.0), torque: random.vector(1.0) }];
            setting
        });
    }
}

#[test]
fn contact_friction_fulfils_the_contract() {
    let params = "radius = 0.3\nmu = 0.4\ntransition_speed = 0.5";
    testkit::check_force::<ContactFriction>(params);
    testkit::check_internal::<ContactFriction>(params);
}

#[test]
fn contact_friction_is_mu_times_the_normal_force_against_the_sliding() {
    let probe = Probe::force::<ContactFriction>("radius = 0.5\nmu = 0.3\ntransition_speed = 0.01").expect("accepted");
    let mut setting = Setting::at_rest(vec![ground(), on_common_axis(&ground(), 0.5, 0.0)]);
    // The centre moves along x with 2, the contact point with 2 - 0.5 * 1.
    setting.twists[1].velocity = Vec3::new(2.0, 0.0, 0.0);
    setting.twists[1].angular_velocity = Vec3::new(0.0, 1.0, 7.0);
    setting.reactions = vec![Reaction { force: Vec3::new(9.0, 9.0, 40.0), torque: Vec3::zeros() }];
    let found = probe.force_values(&setting);
    assert_close(found.forces[1].x, -0.3 * 40.0);
    assert_close(found.forces[0].x, 0.3 * 40.0);
    assert_close(found.torques[1].y, 0.5 * 0.3 * 40.0);
    assert_close(found.channels[2], 1.5);
    assert_close(found.dissipation.expect("given"), 0.3 * 40.0 * 1.5);
}

/// Frames at one place; the second turns and slides fast, and the joint pushes.
fn loaded(force: [f64; 3], torque: [f64; 3]) -> Setting {
    let mut setting = Setting::at_rest(vec![ground(), on_common_axis(&ground(), 0.0, 0.0)]);
    setting.twists[1].angular_velocity = Vec3::new(0.0, 0.0, 50.0);
    setting.twists[1].velocity = Vec3::new(0.0, 0.0, -2.0);
    setting.reactions = vec![Reaction { force: force.into(), torque: torque.into() }];
    setting
}

#[test]
fn pin_friction_is_mu_times_radius_times_radial_load_against_the_turning() {
    let probe = Probe::force::<JointFriction>(ROTATION).expect("accepted");
    let found = probe.force_values(&loaded([30.0, 40.0, 1000.0], [9.0, 9.0, 9.0]));
    assert_close(found.torques[1].z, -0.1 * 0.02 * 50.0);
    assert_close(found.torques[0].z, 0.1 * 0.02 * 50.0);
    assert_eq!(found.forces[1], Vec3::zeros());
    assert_close(found.channels[0], -0.1 * 50.0);
    assert_close(found.channels[1], 50.0);
    assert_close(found.channels[2], 0.02 * 50.0);
    assert_close(found.dissipation.expect("given"), 0.1 * 50.0 * 0.02 * 50.0);

    let probe = Probe::force::<JointFriction>(&format!("{ROTATION}\nthrust_radius = 0.03")).expect("accepted");
    let found = probe.force_values(&loaded([30.0, 40.0, -1000.0], [9.0, 9.0, 9.0]));
    assert_close(found.torques[1].z, -0.1 * (0.02 * 50.0 + 0.03 * 1000.0));
}

#[test]
fn slider_friction_is_mu_times_normal_force_against_the_sliding() {
    let probe =
        Probe::force::<JointFriction>(&format!("{TRANSLATION}\nguide_length = 0.5\npreload = 7.0\nviscous = 2.0"))
            .expect("accepted");
    let found = probe.force_values(&loaded([30.0, 40.0, 1000.0], [3.0, 4.0, 1000.0]));
    let normal = 50.0 + 2.0 * 5.0 / 0.5 + 7.0;
    assert_close(found.forces[1].z, 0.3 * normal + 2.0 * 2.0);
    assert_close(found.channels[1], normal);
}

#[test]
fn friction_falls_from_static_to_sliding_and_is_smooth_at_rest() {
    let params = "kind = \"translation\"\nmu = 0.2\nmu_static = 0.5\nstribeck_speed = 0.1\ntransition_speed = 1e-4";
    let probe = Probe::force::<JointFriction>(params).expect("accepted");
    let friction = |speed: f64| {
        let mut setting = loaded([10.0, 0.0, 0.0], [0.0; 3]);
        setting.twists[1].velocity = Vec3::new(0.0, 0.0, speed);
        probe.force_values(&setting).channels[0]
    };
    assert_eq!(friction(0.0), 0.0);
    assert!((friction(1e-3) + 0.5 * 10.0).abs() < 1e-3);
    assert_close(friction(0.1), -10.0 * (0.2 + 0.3 * (-1.0_f64).exp()));
    assert_close(friction(-1.0), 10.0 * 0.2);
    // No load, no friction, nothing singular.
    let found = probe.force_values(&loaded([0.0; 3], [0.0; 3]));
    assert!(found.forces[1].norm() < 1e-29);
}

#[test]
fn radius_belongs_to_rotation() {
    let error = |params: &str| format!("{:?}", Probe::force::<JointFriction>(params).expect_err("refused"));
    assert!(error("kind = \"rotation\"\nmu = 0.1").contains("rotation needs the pin's radius"));
    assert!(error("kind = \"translation\"\nmu = 0.1\nradius = 1.0").contains("only"));
}
