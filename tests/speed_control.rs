//! The closed loop of `scenes/compressor-speed-control.toml`: sensor, controller, actuator, machine.

use crate::support::{column, run};

#[test]
fn the_controller_holds_the_mean_speed_within_the_limits_of_the_motor() {
    let report = run("compressor-speed-control.toml", &[]);
    let (theta, torque) = (column(&report, "theta"), column(&report, "T_motor"));
    let index = |time: f64| report.times.iter().position(|t| *t >= time).unwrap();
    let (from, to) = (index(200.0), report.times.len() - 1);
    // Over many turns; one turn's ripple is shared out over more than ten.
    let mean = (theta[to] - theta[from]) / (report.times[to] - report.times[from]);
    let set_point = 3200.0 * std::f64::consts::TAU / 60e3;
    assert!((mean / set_point - 1.0).abs() < 3e-3, "mean speed {mean} rad/ms, set point {set_point}");
    assert!(torque.iter().all(|torque| (0.0..=0.246).contains(torque)));
    // The error is in SI units: set point minus what the sensor reads.
    let (error, reading) = (column(&report, "speed_error"), column(&report, "omega_measured"));
    assert!(error.iter().zip(reading).all(|(error, reading)| (error + reading - 1e3 * set_point).abs() < 1e-9));
}

#[test]
fn a_stronger_controller_fights_the_ripple_up_to_the_limits() {
    let sets = ["speed_controller.params.kp=0.01", "speed_controller.params.ki=0.2"];
    let report = run("compressor-speed-control.toml", &sets);
    let (theta, torque) = (column(&report, "theta"), column(&report, "T_motor"));
    assert!(torque.contains(&0.0) && torque.contains(&0.246), "both limits are reached");
    // What is cut off at the limits is no longer symmetric, so the mean is held less well, but nothing winds up.
    let (half, last) = (report.times.len() / 2, report.times.len() - 1);
    let mean = (theta[last] - theta[half]) / (report.times[last] - report.times[half]);
    assert!((mean * 60e3 / std::f64::consts::TAU / 3200.0 - 1.0).abs() < 0.03, "mean speed {mean} rad/ms");
}
