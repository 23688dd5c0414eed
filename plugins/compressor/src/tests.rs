//! Closed-form values, action and reaction, refusals of the compressor's elements.

use element_api::set::CreateError;
use element_api::testkit::{self, Probe, Random, Setting, on_common_axis, turn};
use element_api::{Force, Frame, Vec3};

use crate::compression_force::CompressionForce;
use crate::motor_torque::MotorTorque;
use crate::rolling_resistance::RollingResistance;

const INDUCTION: &str = "breakdown_torque = 0.25\nbreakdown_slip = 0.2\nsynchronous_speed = 377.0";
const CURVE: &str = "curve = [[0.0, 0.1], [200.0, 0.18], [300.0, 0.24], [360.0, 0.1], [380.0, -0.02]]";
const FOURIER: &str = "cosine = [45.0, 74.0, -4.5, 2.0]\nsine = [-28.0, 3.0]";

#[test]
fn motor_torque_fulfils_the_contract() {
    for params in [INDUCTION, CURVE] {
        testkit::check_force::<MotorTorque>(params);
        testkit::check_internal::<MotorTorque>(params);
    }
}

#[test]
fn compression_force_fulfils_the_contract() {
    for params in [FOURIER.to_string(), sampled_fourier(36)] {
        testkit::check_force::<CompressionForce>(&params);
        testkit::check_internal::<CompressionForce>(&params);
    }
}

#[test]
fn rolling_resistance_fulfils_the_contract() {
    testkit::check_force::<RollingResistance>("damping = 2.5");
    testkit::check_internal::<RollingResistance>("damping = 2.5");
    testkit::check_power::<RollingResistance>("damping = 2.5", |random: &mut Random| {
        let mut setting = Setting::at_rest(vec![random.frame(), random.frame()]);
        setting.twists = vec![random.twist(), random.twist()];
        setting
    });
}

#[test]
fn motor_torque_is_largest_at_breakdown_slip_and_zero_at_synchronous_speed() {
    let torque = |omega: f64| torque_at_speed::<MotorTorque>(INDUCTION, omega);
    assert_close(torque(377.0), 0.0);
    assert_close(torque(377.0 * 0.8), 0.25);
    assert_close(torque(377.0 * 1.2), -0.25);
    // Standstill: s = 1, T = 2 0.25 0.2 / 1.04.
    assert_close(torque(0.0), 0.1 / 1.04);
    assert!(torque(377.0 * 0.79) < 0.25 && torque(377.0 * 0.81) < 0.25);
}

#[test]
fn motor_torque_follows_its_curve_and_holds_the_ends() {
    let torque = |omega: f64| torque_at_speed::<MotorTorque>(CURVE, omega);
    for (omega, expected) in [(0.0, 0.1), (200.0, 0.18), (300.0, 0.24), (360.0, 0.1), (380.0, -0.02)] {
        assert_close(torque(omega), expected);
    }
    assert_close(torque(-50.0), 0.1);
    assert_close(torque(500.0), -0.02);
}

#[test]
fn rolling_resistance_opposes_the_rotation() {
    assert_close(torque_at_speed::<RollingResistance>("damping = 2.5", 4.0), -10.0);
    assert_close(torque_at_speed::<RollingResistance>("damping = 2.5", -4.0), 10.0);
}

#[test]
fn compression_force_is_the_fourier_sum_of_the_crank_angle() {
    let probe = Probe::force::<CompressionForce>(FOURIER).expect("accepted");
    for step in 0..48 {
        let theta = f64::from(step) * 0.3 - 7.0;
        let found = probe.force_values(&crank(theta));
        assert_close(found.channels[0], fourier(theta));
        // Pressure pushes the piston away from the head, which lies in +x; the cylinder gets the opposite.
        assert_close((found.forces[1] + Vec3::new(fourier(theta), 0.0, 0.0)).norm(), 0.0);
        assert_close((found.forces[0] - Vec3::new(fourier(theta), 0.0, 0.0)).norm(), 0.0);
        assert!(found.forces[2..].iter().chain(&found.torques).all(|v| v.norm() < 1e-11), "{:?}", found.torques);
    }
}

#[test]
fn compression_force_by_curve_converges_to_the_fourier_sum_with_fourth_order() {
    let largest_error = |points: usize| {
        let probe = Probe::force::<CompressionForce>(&sampled_fourier(points)).expect("accepted");
        let error = |theta: f64| (probe.force_values(&crank(theta)).channels[0] - fourier(theta)).abs();
        (0..500).map(|k| error(f64::from(k) * 0.0267 - 6.5)).fold(0.0, f64::max)
    };
    let (coarse, fine) = (largest_error(36), largest_error(72));
    assert!(coarse / fine > 12.0, "{coarse:e} to {fine:e}: not divided by about 16");
    assert!(fine < 1e-2, "{fine:e}");
}

#[test]
fn compression_force_acts_on_the_block_along_the_same_line() {
    let probe = Probe::force::<CompressionForce>(FOURIER).expect("accepted");
    let mut setting = crank(0.4);
    // A cylinder frame beside the piston's path: the couple of the pair must be made up for.
    setting.frames[0].position = Vec3::new(10.0, 0.5, 0.0);
    let found = probe.force_values(&setting);
    let moment = setting.frames[0].position.cross(&found.forces[0]) + found.torques[0];
    assert_close(moment.norm(), 0.0);
    assert_close(found.torques[0].z, 0.5 * fourier(0.4));
}

#[test]
fn parameters_that_contradict_or_are_incomplete_are_refused_by_name() {
    let refused = [
        (refusal::<MotorTorque>(""), "breakdown_torque", "give `curve`, or"),
        (refusal::<MotorTorque>("breakdown_torque = 1.0\nbreakdown_slip = 0.1"), "synchronous_speed", "is missing"),
        (refusal::<MotorTorque>(&format!("{CURVE}\nbreakdown_slip = 0.1")), "breakdown_slip", "one or the other"),
        (refusal::<MotorTorque>("curve = [[0.0, 1.0], [0.0, 2.0]]"), "curve", "must increase"),
        (refusal::<MotorTorque>("curve = [[0.0, 1.0]]"), "curve", "at least 2 points"),
        (refusal::<CompressionForce>(""), "curve", "is missing"),
        (refusal::<CompressionForce>(&format!("{FOURIER}\n{}", sampled_fourier(8))), "curve", "one or the other"),
        (
            refusal::<CompressionForce>("curve = [[0, 1.0], [1, 2.0], [2, 2.0], [3, 1.0]]"),
            "curve",
            "must span one turn",
        ),
        (
            refusal::<CompressionForce>("curve = [[0, 1.0], [1, 2.0], [2, 2.0], [3, 3.0]]"),
            "curve",
            "end where it began",
        ),
    ];
    for (error, path, text) in refused {
        let CreateError::Parameter(error) = error else { panic!("{path}: {error:?}") };
        assert_eq!(error.path, path);
        assert!(error.message.contains(text), "{error}");
    }
}

fn refusal<T: Force>(params: &str) -> CreateError {
    Probe::force::<T>(params).expect_err("these parameters can't be used")
}

fn assert_close(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-12 * (1.0 + expected.abs()), "found {value}, expected {expected}");
}

fn ground() -> Frame<f64> {
    Frame { position: Vec3::zeros(), rotation: turn(Vec3::zeros()) }
}

/// The torque channel when the rotor spins about z in a resting housing; the wrench must be that torque.
fn torque_at_speed<T: Force>(params: &str, omega: f64) -> f64 {
    let probe = Probe::force::<T>(params).expect("accepted");
    let mut setting = Setting::at_rest(vec![ground(), ground()]);
    setting.twists[1].angular_velocity = Vec3::new(0.3, -0.2, omega);
    let found = probe.force_values(&setting);
    let torque = found.channels[0];
    assert_close((found.torques[1] - Vec3::new(0.0, 0.0, torque)).norm(), 0.0);
    assert_close((found.torques[0] + Vec3::new(0.0, 0.0, torque)).norm(), 0.0);
    torque
}

/// Cylinder along +x on the crank axis, piston at x = 50, rotor turned by `theta`.
fn crank(theta: f64) -> Setting {
    let along_x = turn(Vec3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0));
    let cylinder = Frame { position: Vec3::zeros(), rotation: along_x };
    let piston = Frame { position: Vec3::new(50.0, 0.0, 0.0), rotation: along_x };
    Setting::at_rest(vec![cylinder, piston, ground(), on_common_axis(&ground(), theta, 0.0)])
}

/// The sum that [`FOURIER`] describes.
fn fourier(theta: f64) -> f64 {
    let cosines = 45.0 + 74.0 * theta.cos() - 4.5 * (2.0 * theta).cos() + 2.0 * (3.0 * theta).cos();
    cosines - 28.0 * theta.sin() + 3.0 * (2.0 * theta).sin()
}

/// The same sum as a curve of `count` intervals over one turn.
fn sampled_fourier(count: usize) -> String {
    let point = |k: usize| {
        let theta = std::f64::consts::TAU * k as f64 / count as f64;
        format!("[{theta:?}, {:?}]", fourier(theta))
    };
    let points = (0..=count).map(point).collect::<Vec<_>>().join(", ");
    format!("curve = {{ points = [{points}], interpolation = \"spline\" }}")
}
