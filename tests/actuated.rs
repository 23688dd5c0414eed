//! Rows whose limit follows a signal: brakes and clutches that something actuates.

use std::fs;

use odyn::analyses::linear::Linear;
use odyn::analyses::modes::Modes;
use odyn::analyses::statics;
use odyn::results::{Event, EventKind};
use odyn::session::RunReport;

use crate::contacts::{every_way_agrees, run, try_run};
use crate::support::{Scratch, column, difference, leg, open_text, root};

fn brakes() -> String {
    fs::read_to_string(root().join("scenes/verification/actuated-brakes.toml")).unwrap()
}

/// What happened to an element behind the start.
fn of<'a>(report: &'a RunReport, element: &str) -> Vec<&'a Event> {
    report.events.iter().filter(|event| event.element == element && event.time > 0.0).collect()
}

/// It sticks, slides, ... at these times.
#[track_caller]
fn happen(report: &RunReport, element: &str, expected: &[(EventKind, f64)], tolerance: f64) {
    let found = of(report, element);
    assert_eq!(found.len(), expected.len(), "{element}: {found:?}");
    for (event, (kind, time)) in found.iter().zip(expected) {
        assert!(
            event.kind == *kind && (event.time - time).abs() < tolerance,
            "{element}: {event:?}, expected at {time}"
        );
    }
}

#[test]
fn brakes_hold_and_let_go_when_their_signals_say_in_every_way() {
    let report = every_way_agrees(&brakes(), 1e-9);
    assert!(report.summary.checks_passed());
    happen(&report, "brake", &[(EventKind::Sticks, 16.0 / 9.0), (EventKind::Slides, 3.5)], 1e-10);
    happen(&report, "pads", &[(EventKind::Sticks, 1.0), (EventKind::Slides, 1.2)], 1e-11);
    let audit = &report.summary.audit;
    let (disc, block) = (54.0 + 98.0 / 3.0 + 3.0 / 32.0, 12.0 + 0.25 * 3.3_f64.powi(2));
    assert!((audit.dissipated - disc - block).abs() < 1e-11, "{audit:?} {disc} {block}");
    assert!(audit.energy_error_relative < 1e-11, "{audit:?}");
}

/// A disc of 0.5 kg m^2 with the speed w0 that 2 N m drive, and a brake on the signal `c.output`.
fn disc(w0: f64, capacity: f64, gain: f64, control: &str) -> String {
    format!(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\", \"odyn-controls\"]\n[simulation]\nt_end = 2\noutput_step = 0.01\n\
         tolerance = 1e-10\n[[body]]\nname = \"disc\"\nmass = 1\ninertia = [0.3, 0.3, 0.5]\nangular_velocity = [0, 0, {w0:?}]\n\
         [[joint]]\nname = \"bearing\"\ntype = \"revolute\"\nbodies = [\"ground\", \"disc\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
         [[joint]]\nname = \"brake\"\ntype = \"clutch\"\nbodies = [\"ground\", \"disc\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
         params.capacity = {capacity:?}\ninputs.engagement = {{ signal = \"c.output\", gain = \"{gain:?} N m\" }}\n\
         [[force]]\nname = \"motor\"\ntype = \"vector-torque\"\nbodies = [\"ground\", \"disc\"]\nparams.z = 2\n\
         [[output]]\nname = \"w\"\nquantity = \"angular_velocity\"\nof = \"disc\"\ncomponent = \"z\"\n\
         [[output]]\nname = \"torque\"\nquantity = \"reaction_torque\"\nof = \"brake\"\non = \"disc\"\ncomponent = \"z\"\n{control}"
    )
}

const CLOCK: &str = "[[control]]\nname = \"clock\"\ntype = \"signal-source\"\nparams.function = \"t\"\n";

#[test]
fn a_sampled_signal_lets_go_at_its_sample() {
    // The capacity is 5 - 3 t, as it was at the last multiple of 0.13 s: less than 2 from t = 1.04 on.
    let sampled = "[[control]]\nname = \"c\"\ntype = \"digital-filter\"\ninputs = { input = \"clock.output\" }\n\
                   params = { period = 0.13, numerator = [1] }\n";
    let report = every_way_agrees(&disc(0.0, 5.0, -3.0, &(CLOCK.to_owned() + sampled)), 1e-9);
    happen(&report, "brake", &[(EventKind::Slides, 1.04)], 1e-12);
    // From there on the torque falls by 0.39 at each sample, down to nothing.
    let at = |w: f64, k: f64, t: f64| w + (2.0 - (5.0 - 3.0 * 0.13 * k).max(0.0)) * (t - 0.13 * k) / 0.5;
    let mut expected = 0.0;
    for k in 8..15 {
        expected = at(expected, f64::from(k), 0.13 * f64::from(k + 1));
    }
    expected = at(expected, 15.0, 2.0);
    let w = column(&report, "w");
    assert!((w[200] - expected).abs() < 1e-9, "{} {expected}", w[200]);
    assert!(report.summary.audit.energy_error_relative < 1e-10, "{:?}", report.summary.audit);
}

#[test]
fn a_relay_brakes_and_lets_go() {
    // From rest with 4 rad/s^2 up to 3 rad/s at 0.75 s; braked with 5 N m by -6 rad/s^2 down to 1 rad/s in 1/3 s; up again in 1/2 s.
    let relay = "[[control]]\nname = \"c\"\ntype = \"relay\"\ninputs = { input = \"w\" }\nparams = { lower = 1, upper = 3, on = 1, off = 0 }\n";
    let report = every_way_agrees(&disc(1e-3, 0.0, 5.0, relay), 1e-9);
    let w = column(&report, "w");
    let first = (3.0 - 1e-3) / 4.0;
    let speed = |t: f64| {
        let s = (t - first).rem_euclid(1.0 / 3.0 + 0.5);
        match t < first {
            true => 1e-3 + 4.0 * t,
            false if s < 1.0 / 3.0 => 3.0 - 6.0 * s,
            false => 1.0 + 4.0 * (s - 1.0 / 3.0),
        }
    };
    for (t, w) in report.times.iter().zip(w) {
        assert!((w - speed(*t)).abs() < 1e-8, "{t}: {w}, expected {}", speed(*t));
    }
}

#[test]
fn a_spring_closes_a_brake_that_a_signal_opens_and_no_capacity_is_below_nothing() {
    // C = max(6 - 12 t, 0): it lets go at 1/3 s, and nothing brakes from 0.5 s on.
    let report = every_way_agrees(&disc(0.0, 6.0, -12.0, &CLOCK.replace("clock", "c")), 1e-9);
    happen(&report, "brake", &[(EventKind::Slides, 1.0 / 3.0)], 1e-10);
    let (w, torque) = (column(&report, "w"), column(&report, "torque"));
    let at_half = 12.0 / 36.0;
    for (k, t) in report.times.iter().enumerate().filter(|(_, t)| **t > 0.5) {
        assert!((w[k] - at_half - 4.0 * (t - 0.5)).abs() < 1e-9 && torque[k] == 0.0, "{t}: {} {}", w[k], torque[k]);
    }
}

#[test]
fn small_and_large_brakes_behave_alike() {
    let text = brakes();
    let (text, _) = text.split_once("[[check]]").unwrap();
    let plain = run(text, &[]);
    for scale in [1e-9, 1e9] {
        let sets = [
            format!("disc.inertia=[{0:e}, {0:e}, {1:e}]", 0.6 * scale, scale),
            format!("disc.mass={scale:e}"),
            format!("parameters.M={:e}", 3.0 * scale),
            format!("brake.inputs.engagement={{ signal = \"pedal.output\", gain = \"{:e} N m\" }}", 12.0 * scale),
        ];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let scaled = run(text, &sets);
        for name in ["w", "v"] {
            let off = difference(column(&plain, name), column(&scaled, name));
            assert!(off < 1e-8, "{scale:e}: {name} differs by {off:e}");
        }
    }
}

#[test]
fn what_a_brake_holds_is_kept_where_a_run_goes_on() {
    let scratch = Scratch::new();
    let text = brakes();
    scratch.file("scene.toml", &text);
    let whole = leg(&scratch, "simulation.t_end = 4.5", "whole", None);
    for end in [0.6, 1.1, 2.5, 3.9] {
        leg(&scratch, &format!("simulation.t_end = {end}"), "first", None);
        let rest = leg(&scratch, "simulation.t_end = 4.5", "second", Some("first"));
        let (w, v) = (column(&rest, "w"), column(&rest, "v"));
        let first = whole.times.len() - w.len();
        assert!(difference(&column(&whole, "w")[first..], w) < 1e-9, "{end}");
        assert!(difference(&column(&whole, "v")[first..], v) < 1e-9, "{end}");
    }
    let legs = leg(&scratch, "simulation.checkpoint_every = 0.37", "legs", None);
    assert!(difference(column(&whole, "w"), column(&legs, "w")) < 1e-9);
}

#[test]
fn signals_that_cannot_be_a_limit_are_refused() {
    let follows = |source: &str| brakes().replace("{ signal = \"pedal.output\", gain = \"12 N m\" }", source);
    let error = try_run(&follows("\"torque\""), &[], None).expect_err("it depends on what it holds");
    assert!(error.contains("what `brake` may hold follows a signal made of accelerations or reactions"), "{error}");
    let error = try_run(&follows("\"w\""), &[], None).expect_err("a speed is no torque");
    assert!(error.contains("N m"), "{error}");
    let lagged = "[[control]]\nname = \"cell\"\ntype = \"sensor\"\ninputs = { input = \"torque\" }\nparams = { gain = -2, time_constant = 0.1 }\n";
    let text =
        follows("{ signal = \"cell.output\", gain = \"1 N m\" }").replace("params.capacity = 0", "params.capacity = 4");
    let (text, _) = text.split_once("[[check]]").unwrap();
    assert_eq!(run(&format!("{text}{lagged}"), &[]).exit_code(), 0);
    // An input of a row that is not in use.
    let text = brakes()
        .replace("inputs = { force = {", "inputs = { torque = {")
        .replace("gain = \"2 * 0.4 N\"", "gain = \"1 N m\"");
    let said: Vec<String> = open_text(&text, &[]).warnings.iter().map(|warning| warning.message.clone()).collect();
    assert!(said.iter().any(|text| text.contains("`pads` does without its input `torque`")), "{said:?}");
}

#[test]
fn a_latch_catches_holds_and_opens_in_every_way() {
    let text = fs::read_to_string(root().join("scenes/verification/latch.toml")).unwrap();
    let report = every_way_agrees(&text, 1e-8);
    assert!(report.summary.checks_passed());
    let audit = &report.summary.audit;
    // Kinetic energies of the door and of the relative motion of the waggons.
    assert!((audit.dissipated - 1.0 - 3.0).abs() < 1e-9 && audit.energy_error_relative < 1e-12, "{audit:?}");
    // It slips as soon as it is pulled by more than it holds.
    let (text, _) = text.split_once("[[check]]").unwrap();
    let report = run(text, &["parameters.C=30"]);
    let slides = of(&report, "latch").into_iter().filter(|event| event.kind == EventKind::Slides);
    assert!(slides.map(|event| event.time).any(|time| (time - 2.0).abs() < 1e-12), "{:?}", report.events);
}

/// A ball of 1 kg, which goes along x at 1 m/s, is caught by one of 2 kg in all six directions at 0.3 s.
fn docking(strength: f64) -> String {
    let mut text = String::from(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-controls\"]\n[simulation]\nt_end = 1\noutput_step = 0.1\ntolerance = 1e-10\n\
         [[control]]\nname = \"port\"\ntype = \"signal-source\"\n\
         params.function = { points = [[0, 0], [0.3, 1]], interpolation = \"steps\" }\n\
         [[body]]\nname = \"station\"\nmass = 2\ninertia = [0.4, 0.4, 0.4]\n\
         [[body]]\nname = \"ship\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [-0.3, 0.5, 1]\nvelocity = [1, 0, 0]\n",
    );
    for (name, axis) in [("x", [1, 0, 0]), ("y", [0, 1, 0]), ("z", [0, 0, 1])] {
        text += &format!(
            "[[joint]]\nname = \"hold_{name}\"\ntype = \"dry-friction\"\nbodies = [\"station\", \"ship\"]\npoint = [-0.3, 0.5, 1]\n\
             axis = {axis:?}\nparams = {{ force = 0, torque = 0 }}\n\
             inputs = {{ force = {{ signal = \"port.output\", gain = \"{strength:?} N\" }}, \
             torque = {{ signal = \"port.output\", gain = \"{strength:?} N m\" }} }}\n"
        );
        for body in ["station", "ship"] {
            text += &format!(
                "[[output]]\nname = \"{body}_{name}\"\nquantity = \"angular_velocity\"\nof = \"{body}\"\ncomponent = \"{name}\"\n\
                 [[output]]\nname = \"{body}_v{name}\"\nquantity = \"velocity\"\nof = \"{body}\"\ncomponent = \"{name}\"\n"
            );
        }
    }
    text
}

#[test]
fn a_docking_port_is_a_plastic_impact_in_the_limit() {
    // H = mu d x v about the common centre, and what turns together has J + mu d^2 across d.
    let (mu, inertia, square) = (2.0 / 3.0, 0.5, 0.25 + 1.0);
    let common = inertia + mu * square;
    let lost = 0.5 * mu * inertia / common;
    for strength in [1e3, 1e4] {
        for formulation in ["joint", "cartesian"] {
            let report = run(&docking(strength), &[&format!("simulation.formulation=\"{formulation}\"")]);
            assert_eq!(report.exit_code(), 0);
            let found = report.summary.audit.dissipated;
            assert!((found - lost).abs() < 1.0 / strength, "{strength:e}: {found}, expected {lost}");
            let at_end = |name: &str| *column(&report, name).last().unwrap();
            let spin = [0.0, mu / common, -0.5 * mu / common];
            for (axis, expected) in ["x", "y", "z"].into_iter().zip(spin) {
                let (station, ship) = (at_end(&format!("station_{axis}")), at_end(&format!("ship_{axis}")));
                assert!((station - ship).abs() < 1e-12, "{axis}: {station} {ship}");
                assert!(
                    (station - expected).abs() < 3.0 / strength,
                    "{strength:e} {axis}: {station}, expected {expected}"
                );
            }
            let momentum = 2.0 * at_end("station_vx") + at_end("ship_vx");
            assert!((momentum - 1.0).abs() < 1e-10, "{momentum}");
        }
    }
}

#[test]
fn a_brake_that_is_off_holds_nothing_in_analyses_of_the_start() {
    let spring = "[[force]]\nname = \"spring\"\ntype = \"rotational-spring-damper\"\nbodies = [\"ground\", \"disc\"]\n\
                  point = [0, 0, 0]\naxis = [0, 0, 1]\nparams.stiffness = 50\n\
                  [[control]]\nname = \"c\"\ntype = \"signal-source\"\nparams.function = \"t - 1\"\n";
    let text = disc(0.0, 0.0, 1.0, spring).replace("params.z = 2", "params.z = 0");
    let frequencies = |sets: &[&str]| -> Vec<f64> {
        let instant = open_text(&text, sets).prepare().unwrap().start().unwrap().instant().unwrap();
        let session = open_text(&text, sets);
        let linear = Linear::at(&session, &instant, Some(&[]), Some(&[])).unwrap_or_else(|error| panic!("{error}"));
        Modes::of(&session, &linear).unwrap().modes.iter().map(|mode| mode.imaginary).collect()
    };
    let found = frequencies(&[]);
    assert!(found.len() == 1 && (found[0].abs() - 10.0).abs() < 1e-9, "{found:?}");
    assert_eq!(frequencies(&["brake.params.capacity=2"]), [0.0; 0]);
    let held = |sets: &[&str]| statics::equilibrium(&open_text(&text, sets), &mut |_| ()).unwrap().friction.len();
    assert_eq!((held(&[]), held(&["brake.params.capacity=2"])), (0, 1));
}

/// A brake of 10 N m that holds 5 N m, of 2, 20 and 1 N m from 1, 2 and 3 s on. Steps end just before a limit jumps, whatever the sum of
/// their beginning and their size is rounded to.
#[test]
fn a_brake_gives_way_where_its_limit_jumps() {
    let scene = r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
t_end = 4
output_step = 0.05
[[body]]
name = "disc"
mass = 1
inertia = [1, 1, 2]
[[joint]]
name = "axle"
type = "revolute"
bodies = ["ground", "disc"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "brake"
type = "clutch"
bodies = ["ground", "disc"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.capacity = { points = [[0, 10], [1, 2], [2, 20], [3, 1]], interpolation = "steps" }
[[force]]
name = "load"
type = "vector-torque"
bodies = ["ground", "disc"]
params.z = "5"
[[output]]
name = "w"
quantity = "angular_velocity"
of = "disc"
component = "z"
"#;
    for (end, expected) in [(3.0, 0.0), (4.0, 2.0), (5.0, 4.0), (8.0, 10.0), (40.0, 74.0)] {
        for method in ["dop853", "dopri5", "radau5"] {
            let sets = [format!("simulation.t_end={end:?}"), format!("simulation.method={method:?}")];
            let report = run(scene, &sets.each_ref().map(String::as_str));
            let w = *column(&report, "w").last().unwrap();
            assert!((w - expected).abs() < 1e-8 * expected + 1e-9, "{method} to {end}: {w}");
        }
    }
}

/// A wheel of 2 kg m^2 at 10 rad/s that 1 N m drives, and a brake that reaches 30 N m within 20 ms, by a table over time.
const RAMP: &str = r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
t_end = 2
output_step = 0.1
[[body]]
name = "wheel"
mass = 1
inertia = [1, 1, 2]
angular_velocity = [0, 0, 10]
[[joint]]
name = "axle"
type = "revolute"
bodies = ["ground", "wheel"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "brake"
type = "clutch"
bodies = ["ground", "wheel"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.capacity = { points = [[0, 0], [0.5, 0], [0.52, 30], [4, 30]], interpolation = "linear" }
[[force]]
name = "motor"
type = "rotational-actuator"
bodies = ["ground", "wheel"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.of_time = "1 N m"
"#;

#[test]
fn heat_of_a_brake_on_a_steep_ramp_is_what_the_wheel_and_the_motor_lose() {
    // The angle until it stands: without the brake, on the ramp (15 (s/20 ms) N m on average), with all of it.
    let angle = 5.0 + 0.25 * 0.5_f64.powi(2) + (10.25 * 0.02 + 0.25 * 4e-4 - 125.0 * 8e-6) + 10.11_f64.powi(2) / 29.0;
    for formulation in ["joint", "cartesian"] {
        for (method, tolerance) in [
            ("dop853", 1e-6),
            ("dop853", 1e-8),
            ("dop853", 1e-10),
            ("dop853", 1e-12),
            ("dopri5", 1e-8),
            ("radau5", 1e-8),
        ] {
            let keys = [
                format!("simulation.formulation=\"{formulation}\""),
                format!("simulation.method=\"{method}\""),
                format!("simulation.tolerance={tolerance:?}"),
            ];
            let report = run(RAMP, &keys.each_ref().map(String::as_str));
            assert_eq!(report.exit_code(), 0);
            let audit = &report.summary.audit;
            let off = [audit.dissipated - 100.0 - angle, audit.work_in - angle].map(f64::abs);
            let allowed = 1e-6 * angle + audit.dissipated_error;
            assert!(off.iter().all(|off| *off < allowed), "{keys:?}: {off:?} {audit:?}");
            assert!(audit.dissipated_error < 0.01 * angle, "{keys:?}: {audit:?}");
        }
    }
}
