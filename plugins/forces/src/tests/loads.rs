//! Actuators, given forces and torques, drag, gravity.

use element_api::testkit::{self, Probe, Random, Setting, on_common_axis, turn};
use element_api::{Frame, Vec3};

use super::{
    assert_close, assert_vector, ground, pulled_apart, two_frames_anywhere, two_frames_turning_about_one_axis,
};
use crate::drag::Drag;
use crate::point_gravity::PointGravity;
use crate::rotational_actuator::RotationalActuator;
use crate::translational_actuator::TranslationalActuator;
use crate::uniform_gravity::UniformGravity;
use crate::vector_force::VectorForce;
use crate::vector_torque::VectorTorque;

/// 3 x
const TRIPLE: &str = "{ postfix = [3.0, \"x\", \"mul\"] }";
/// x^2
const SQUARE: &str = "{ postfix = [\"x\", 2.0, \"pow\"] }";

#[test]
fn actuators_fulfil_the_contract() {
    let rotation = format!("of_time = {TRIPLE}\nof_angle = {SQUARE}\nof_speed = [[-5, 2], [5, -2]]\ngain = 4.0");
    for params in ["", &rotation] {
        testkit::check_force::<RotationalActuator>(params);
        testkit::check_internal::<RotationalActuator>(params);
    }
    let translation = rotation.replace("of_angle", "of_length");
    for params in ["", &translation, &format!("{translation}\nalong = \"axis\"")] {
        testkit::check_force::<TranslationalActuator>(params);
        testkit::check_internal::<TranslationalActuator>(params);
    }
}

#[test]
fn power_channels_are_the_power_of_the_wrench() {
    let power = |probe: &Probe, mut setting: Setting| {
        setting.signals = vec![0.5];
        probe.settle(&mut setting);
        let found = probe.force_values(&setting);
        let bodies = setting.twists.iter().zip(found.forces.iter().zip(&found.torques));
        let power: f64 = bodies.map(|(t, (f, m))| f.dot(&t.velocity) + m.dot(&t.angular_velocity)).sum();
        assert!((power - found.channels[2]).abs() < 1e-12 * (1.0 + power.abs()), "{power} {}", found.channels[2]);
        assert!(power != 0.0);
    };
    let mut random = Random::new(31);
    let motor = Probe::force::<RotationalActuator>(&format!("of_angle = {SQUARE}")).expect("accepted");
    let line = Probe::force::<TranslationalActuator>(&format!("of_length = {SQUARE}")).expect("accepted");
    let axis =
        Probe::force::<TranslationalActuator>(&format!("of_length = {SQUARE}\nalong = \"axis\"")).expect("accepted");
    for _ in 0..10 {
        power(&motor, two_frames_turning_about_one_axis(&mut random));
        power(&line, two_frames_anywhere(&mut random));
        power(&axis, two_frames_anywhere(&mut random));
    }
}

#[test]
fn torque_is_the_sum_of_its_functions_and_the_signal() {
    let params = format!("of_time = {TRIPLE}\nof_angle = {SQUARE}\nof_speed = {TRIPLE}\ngain = 4.0");
    let probe = Probe::force::<RotationalActuator>(&params).expect("accepted");
    let mut setting = Setting::at_rest(vec![ground(), on_common_axis(&ground(), 0.5, 0.0)]);
    setting.time = 2.0;
    setting.twists[1].angular_velocity = Vec3::new(0.0, 0.0, 0.1);
    setting.references = vec![0.0];
    setting.signals = vec![10.0, 0.0];
    let found = probe.force_values(&setting);
    let torque = 6.0 + 0.25 + 0.3 + 40.0;
    assert_vector(found.torques[1], [0.0, 0.0, torque]);
    assert_vector(found.torques[0], [0.0, 0.0, -torque]);
    assert_close(found.channels[0], torque);
}

#[test]
fn actuator_pushes_along_the_line_or_along_the_axis() {
    let params = format!("of_time = {TRIPLE}\nof_length = {SQUARE}\nof_speed = {TRIPLE}");
    let mut setting = pulled_apart(2.0, Vec3::new(0.25, 0.0, 7.0));
    setting.frames[1].position.z = 1e-3;
    setting.frames[1].position.x = 0.0;
    setting.frames[1].position.y = 2.0;
    setting.signals = vec![1.0];
    let axis = Probe::force::<TranslationalActuator>(&format!("{params}\nalong = \"axis\"")).expect("accepted");
    let found = axis.force_values(&setting);
    let force = 1e-6 + 21.0 + 1.0;
    assert_vector(found.forces[1], [0.0, 0.0, force]);
    assert_vector(found.torques[0], [-2.0 * force, 0.0, 0.0]);

    let line = Probe::force::<TranslationalActuator>(&params).expect("accepted");
    let mut setting = pulled_apart(2.0, Vec3::new(0.25, 0.0, 7.0));
    setting.signals = vec![1.0];
    let found = line.force_values(&setting);
    assert_vector(found.forces[1], [4.0 + 0.75 + 1.0, 0.0, 0.0]);
    assert_close(found.channels[1], 2.0);
}

#[test]
fn given_forces_and_torques_fulfil_the_contract() {
    for params in ["", "x = 3.0\nz = [[0, 0], [1, 5]]", "x = 3.0\nfollower = true"] {
        testkit::check_force::<VectorForce>(params);
        testkit::check_internal::<VectorForce>(params);
        testkit::check_force::<VectorTorque>(params);
        testkit::check_internal::<VectorTorque>(params);
    }
}

#[test]
fn components_are_along_the_first_frame_or_follow_the_second() {
    let quarter = |axis: Vec3<f64>| turn(axis * std::f64::consts::FRAC_PI_2);
    let i = Frame { position: Vec3::zeros(), rotation: quarter(Vec3::z()) };
    let j = Frame { position: Vec3::new(0.0, 0.0, 1.0), rotation: quarter(Vec3::x()) };
    let mut setting = Setting::at_rest(vec![i, j]);
    setting.time = 2.0;
    setting.signals = vec![0.0, 1.0, 0.0];
    let params = format!("x = {TRIPLE}");
    let follower = format!("{params}\nfollower = true");

    // (6, 1, 0) in axes whose x is the ground's y; then in axes whose y is the ground's z.
    let found = Probe::force::<VectorForce>(&params).expect("accepted").force_values(&setting);
    assert_vector(found.forces[1], [-1.0, 6.0, 0.0]);
    assert_vector(found.torques[0], [6.0, 1.0, 0.0]);
    let found = Probe::force::<VectorForce>(&follower).expect("accepted").force_values(&setting);
    assert_vector(found.forces[1], [6.0, 0.0, 1.0]);
    let found = Probe::force::<VectorTorque>(&params).expect("accepted").force_values(&setting);
    assert_vector(found.torques[1], [-1.0, 6.0, 0.0]);
    assert_vector(found.torques[0], [1.0, -6.0, 0.0]);
    let found = Probe::force::<VectorTorque>(&follower).expect("accepted").force_values(&setting);
    assert_vector(found.torques[1], [6.0, 0.0, 1.0]);
}

#[test]
fn drag_is_quadratic_against_the_motion_through_the_medium() {
    let params = "density = 2.0\ncoefficient = 0.5\narea = 3.0";
    let windy = format!("{params}\nwind = [3, 0, 0]");
    for params in [params, windy.as_str()] {
        testkit::check_force::<Drag>(params);
        testkit::check_internal::<Drag>(params);
    }
    testkit::check_power::<Drag>(params, two_frames_anywhere);

    let setting = pulled_apart(1.0, Vec3::new(3.0, 4.0, 0.0));
    let found = Probe::force::<Drag>(params).expect("accepted").force_values(&setting);
    assert_vector(found.forces[1], [-1.5 * 5.0 * 3.0, -1.5 * 5.0 * 4.0, 0.0]);
    assert_close(found.channels[0], 1.5 * 25.0);
    assert_close(found.dissipation.expect("given"), 1.5 * 125.0);
    let found = Probe::force::<Drag>(&windy).expect("accepted").force_values(&setting);
    assert_vector(found.forces[1], [0.0, -1.5 * 16.0, 0.0]);
    assert_eq!(found.dissipation, None);
    // A medium that turns takes the point along.
    let mut turning = pulled_apart(2.0, Vec3::new(0.0, 6.0, 0.0));
    turning.twists[0].angular_velocity = Vec3::new(0.0, 0.0, 3.0);
    let found = Probe::force::<Drag>(params).expect("accepted").force_values(&turning);
    assert!(found.forces[1].norm() < 1e-29);
}

#[test]
fn attraction_falls_with_the_square_of_the_distance() {
    let params = "gravitational_parameter = 6.0\nmass = 2.0";
    testkit::check_force::<PointGravity>(params);
    testkit::check_internal::<PointGravity>(params);
    testkit::check_power::<PointGravity>(params, two_frames_anywhere);
    let found = Probe::force::<PointGravity>(params).expect("accepted").force_values(&pulled_apart(2.0, Vec3::zeros()));
    assert_vector(found.forces[1], [-3.0, 0.0, 0.0]);
    assert_vector(found.forces[0], [3.0, 0.0, 0.0]);
    assert_close(found.channels[0], 3.0);
    assert_close(found.potential.expect("given"), -6.0);
}

#[test]
fn weight_is_mass_times_acceleration_in_axes_of_the_first_frame() {
    let params = "mass = 2.0\nacceleration = [0, -3, 1]";
    testkit::check_force::<UniformGravity>(params);
    testkit::check_internal::<UniformGravity>(params);
    testkit::check_power::<UniformGravity>(params, two_frames_anywhere);
    let mut setting = pulled_apart(2.0, Vec3::zeros());
    setting.frames[0].rotation = turn(Vec3::z() * std::f64::consts::FRAC_PI_2);
    let found = Probe::force::<UniformGravity>(params).expect("accepted").force_values(&setting);
    assert_vector(found.forces[1], [6.0, 0.0, 2.0]);
    assert_close(found.potential.expect("given"), -12.0);
}
