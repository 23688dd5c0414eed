//! Elements that sample, exported: the bits of the interpreter, the results of runs, valid FMUs.

use odyn::export::c::{Real, package};
use odyn::export::{Choices, Machine, Method, Twin};
use odyn::session::{RunReport, Session};

use super::fmus::judged;
use super::{compare, machine, of_text};
use crate::support::{Scratch, column, open};

/// A pendulum held by a digital controller that takes its set point from outside, and one whose controller measures an acceleration, twice
/// as often: what samples is solved for with the equations of motion. The soft wall is met in between.
pub const HELD: &str = r#"
[plugins]
libraries = ["joints", "forces", "controls"]
[simulation]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.037
tolerance = 1e-11
[[input]]
name = "wanted"
value = "0.4"
[[body]]
name = "bob"
mass = 2
inertia = [0.1, 0.1, 0.1]
position = [0, -1, 0]
[[joint]]
name = "pivot"
type = "revolute"
bodies = ["ground", "bob"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[control]]
name = "feeder"
type = "digital-pid"
inputs = { set_point = "wanted", measured = "a" }
params = { period = "10 ms", kp = 0.2 }
[[control]]
name = "controller"
type = "digital-pid"
inputs = { set_point = "wanted", measured = "phi", feed_forward = "feeder.output" }
params = { period = "20 ms", kp = 60, ki = 40, kd = 12, low = -45, high = 45 }
[[force]]
name = "motor"
type = "rotational-actuator"
bodies = ["ground", "bob"]
point = [0, 0, 0]
axis = [0, 0, 1]
inputs = { signal = "controller.output" }
[[force]]
name = "wall"
type = "rotational-bump-stop"
bodies = ["ground", "bob"]
point = [0, 0, 0]
axis = [0, 0, 1]
params = { upper = 0.3, torque = 20, depth = 0.1, damping = 0.1 }
[[output]]
name = "phi"
quantity = "coordinate"
of = "pivot"
[[output]]
name = "u"
quantity = "value"
of = "controller"
channel = "output"
[[output]]
name = "a"
quantity = "acceleration"
of = "bob"
component = "y"
"#;

/// The largest difference of the outputs from those of a run, at its times, as a share of the largest value.
pub fn off_from_run(session: Session, twin: &mut Twin, steps: usize) -> f64 {
    let report: RunReport = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
    let ports = twin.machine().outputs.clone();
    let columns: Vec<&[f64]> = ports.iter().map(|port| column(&report, &port.name)).collect();
    let mut worst = 0.0_f64;
    for k in 0..report.times.len() {
        if k > 0 {
            let h = (report.times[k] - report.times[k - 1]) / steps as f64;
            (0..steps).for_each(|_| twin.step(h).unwrap());
        }
        for (value, column) in twin.outputs().iter().zip(&columns) {
            let size = column.iter().fold(1e-3_f64, |size, value| size.max(value.abs()));
            let off = (value - column[k]).abs() / size;
            assert!(!off.is_nan());
            worst = worst.max(off);
        }
    }
    worst
}

#[test]
fn what_samples_has_the_bits_of_the_interpreter() {
    let folder = Scratch::new();
    for (scene, step, steps) in [
        ("verification/digital-pid.toml", 0.03, 60),
        ("verification/digital-pid.toml", 0.25, 6),
        ("verification/stepper-rotation.toml", 0.011, 60),
    ] {
        compare(&machine(open(scene, &[]), Some(step), "rk4"), folder.path(), steps);
    }
    for (method, step) in [("rk4", 3.7e-3), ("rodas", 2e-2), ("dopri5", 5e-2)] {
        let machine = machine(of_text(HELD), Some(step), method).with_derivatives().unwrap();
        compare(&machine, folder.path(), 30);
    }
}

#[test]
fn what_samples_gives_the_results_of_runs() {
    let dopri5 = Method::named("dopri5").unwrap();
    for (scene, steps, most) in
        [("verification/digital-pid.toml", 1, 1e-12), ("verification/stepper-rotation.toml", 4, 1e-7)]
    {
        let choices = || Choices { method: dopri5, ..Choices::default() };
        let mut twin = Twin::new(Machine::new(open(scene, &[]), "sampled", choices()).unwrap());
        let off = off_from_run(open(scene, &[]), &mut twin, steps);
        println!("{scene}: {off:.1e}");
        assert!(off < most, "{scene}: {off:e}");
    }
    let mut twin = Twin::new(machine(of_text(HELD), None, "dopri5"));
    let off = off_from_run(of_text(HELD), &mut twin, 40);
    println!("a pendulum that is held: {off:.1e}");
    assert!(off < 1e-5, "{off:e}");
    assert!(twin.located > 0, "the wall was met");
}

/// The run starts between samples, and the set point jumps at samples of both controllers.
#[test]
fn starts_and_jumps_are_sampled_as_in_runs() {
    let jumping = "[[control]]\nname = \"jump\"\ntype = \"signal-source\"\n\
                   params.function = { points = [[0, 0.1], [0.7, 0.4]], interpolation = \"steps\" }\n[[control]]\nname = \"feeder\"";
    let text = HELD.replace("t_end = 1", "t_start = 0.013\nt_end = 1.013");
    let text = text
        .replace("[[control]]\nname = \"feeder\"", jumping)
        .replace("\"wanted\", measured", "\"jump.output\", measured");
    let mut twin = Twin::new(machine(of_text(&text), None, "dopri5"));
    let off = off_from_run(of_text(&text), &mut twin, 40);
    println!("a set point that jumps at a sample: {off:.1e}");
    assert!(off < 1e-5, "{off:e}");
    compare(&machine(of_text(&text), Some(3.7e-3), "rk4"), Scratch::new().path(), 30);
}

/// Neighbouring times are further apart than the share of a period by which samples may be early.
#[test]
fn far_from_time_zero_every_instant_is_sampled_once() {
    let late = || of_text(&HELD.replace("t_end = 1", "t_start = 1e7\nt_end = 10000001"));
    let mut twin = Twin::new(machine(late(), None, "dopri5"));
    let off = off_from_run(late(), &mut twin, 40);
    println!("a pendulum that is held, 1e7 s from zero: {off:.1e}");
    assert!(off < 1e-5, "{off:e}");
    compare(&machine(late(), Some(3.7e-3), "rk4"), Scratch::new().path(), 30);
}

/// What is set before the first step is seen by what samples at the start.
#[test]
fn samples_at_the_start_take_what_was_set() {
    let mut twin = Twin::new(machine(of_text(HELD), Some(1e-3), "rk4"));
    let first = twin.outputs()[1];
    twin.set_input(0, -0.2);
    twin.step(1e-3).unwrap();
    let then = twin.outputs()[1];
    assert!(first > 0.0 && then < 0.0, "{first} {then}");
}

#[test]
fn costs_with_samples_have_a_bound() {
    let cost = |step: f64| package(&machine(of_text(HELD), Some(step), "rk4"), Real::Double).unwrap().cost;
    // Every fourth step ends at a sample; each step has one; each is divided four times.
    let [aligned, other, long] = [5e-3, 6e-3, 75e-3].map(cost);
    assert!(aligned.most < other.most && other.most < long.most, "{} {} {}", aligned.most, other.most, long.most);
    assert!(aligned.step == other.step && other.step == long.step);
}

#[test]
fn a_scene_that_samples_is_a_valid_fmu() {
    judged("digital", &machine(open("verification/digital-pid.toml", &[]), Some(0.037), "dopri5"), 1e-5);
    judged("stepper", &machine(open("verification/stepper-rotation.toml", &[]), Some(0.0137), "dopri5"), 1e-4);
    judged("held", &machine(of_text(HELD), Some(3.7e-3), "dopri5"), 1e-4);
}
