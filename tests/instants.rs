//! Instants at which a decision has little to compare with: everything without acceleration, times far from zero, limits of zero.

use std::f64::consts::PI;

use element_api::testkit::Random;
use odyn::results::{EventKind, Status};
use odyn::session::RunReport;

use crate::contacts::{every_way_agrees, run, try_run};
use crate::support::{bisected, column, difference};

/// A block between two plastic stops of a carriage that is moved by 0.1 sin 9 t; nothing else acts.
const CARRIAGE: &str = r#"
[plugins]
libraries = ["odyn-joints"]

[simulation]
t_end = 2
output_step = 0.01

[[body]]
name = "carriage"
mass = 2
inertia = [0.1, 0.1, 0.1]

[[body]]
name = "block"
mass = 0.3
inertia = [0.1, 0.1, 0.1]
velocity = [0, 0, 0]

[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "carriage"]
point = [0, 0, 0]
axis = [1, 0, 0]

[[joint]]
name = "drive"
type = "displacement-driver"
bodies = ["ground", "carriage"]
point = [0, 0, 0]
axis = [1, 0, 0]
params.displacement = "0.1 * sin(9 * t)"

[[joint]]
name = "slide"
type = "translational"
bodies = ["carriage", "block"]
point = [0, 0, 0]
axis = [1, 0, 0]

[[joint]]
name = "stops"
type = "translational-stop"
bodies = ["carriage", "block"]
point = [0, 0, 0]
axis = [1, 0, 0]
params = { lower = -0.05, upper = 0.05, restitution = 0 }

[[output]]
name = "x"
quantity = "position"
of = "block"
component = "x"
"#;

/// Where the block is at these times: at rest, free, or carried by a stop as long as that pushes.
fn carried(times: &[f64]) -> Vec<f64> {
    let (place, speed) = (|t: f64| 0.1 * (9.0 * t).sin(), |t: f64| 0.9 * (9.0 * t).cos());
    let mut from = (0.0, 0.0, 0.0);
    let mut found = Vec::new();
    let fly = |(start, x, v): (f64, f64, f64), t: f64| x + v * (t - start);
    let mut next = times.iter().copied().peekable();
    while next.peek().is_some() {
        // Free until it meets a stop, to which it comes from between them.
        let apart = |t: f64| (fly(from, t) - place(t)).abs() - 0.05;
        let mut low = from.0 + 1e-3;
        while apart(low + 1e-4) < 0.0 {
            low += 1e-4;
        }
        let met = bisected(low, low + 1e-4, |t| -apart(t));
        while let Some(t) = next.next_if(|t| *t <= met) {
            found.push(fly(from, t));
        }
        let side = (fly(from, met) - place(met)).signum();
        // The stop gives it the speed of the carriage, and pushes while that accelerates away from the stop.
        let pushes = |t: f64| side * (9.0 * t).sin() > 0.0;
        let leaves = if pushes(met) { (9.0 * met / PI).ceil() * PI / 9.0 } else { met };
        while let Some(t) = next.next_if(|t| *t <= leaves) {
            found.push(place(t) + side * 0.05);
        }
        from = (leaves, place(leaves) + side * 0.05, speed(leaves));
    }
    found
}

#[test]
fn a_contact_opens_where_nothing_in_the_scene_accelerates() {
    let report = every_way_agrees(CARRIAGE, 1e-8);
    let opens: Vec<f64> =
        report.events.iter().filter(|event| event.kind == EventKind::Opens).map(|event| event.time).collect();
    assert!(opens.len() > 2);
    assert!(opens.iter().all(|t| (9.0 * t / PI - (9.0 * t / PI).round()).abs() < 1e-9), "{opens:?}");
    let off = |report: &RunReport| difference(column(report, "x"), &carried(&report.times));
    assert!(off(&report) < 1e-9, "{:.1e}", off(&report));
}

/// A ball that loses nothing.
const BALL: &str = r#"
[plugins]
libraries = ["odyn-joints"]

[simulation]
gravity = [0, 0, -9.81]
t_end = 800
output_step = 8.9

[[body]]
name = "ball"
mass = 1
inertia = [0.1, 0.1, 0.1]
position = [0, 0, 1]

[[joint]]
name = "floor"
type = "plane-contact"
bodies = ["ground", "ball"]
frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0] }]
params.restitution = 1

[[output]]
name = "z"
quantity = "position"
of = "ball"
component = "z"
"#;

#[test]
fn contacts_close_when_times_are_known_less_well_than_places() {
    let period = 2.0 * (2.0 / 9.81_f64).sqrt();
    for method in ["dop853", "radau5", "dopri5"] {
        let method = format!("simulation.method={method}");
        for [start, tolerance] in [[0.0, 1e-8], [1e6, 1e-6]] {
            let (from, to) = (format!("simulation.t_start={start:e}"), format!("simulation.t_end={:e}", start + 800.0));
            let report = run(BALL, &[&method, &from, &to]);
            for (t, z) in report.times.iter().zip(column(&report, "z")) {
                let fallen = (t - start + 0.5 * period).rem_euclid(period) - 0.5 * period;
                let expected = 1.0 - 0.5 * 9.81 * fallen * fallen;
                assert!((z - expected).abs() < tolerance, "{method}, {t}: {z}, expected {expected}");
            }
        }
    }
}

/// A stepping motor that follows an angle over the time since the start.
fn stepping(start: f64) -> Vec<f64> {
    let text = format!(
        r#"
[plugins]
libraries = ["odyn-joints"]

[simulation]
t_start = {start:?}
t_end = {:?}
output_step = 0.03125

[[body]]
name = "rotor"
mass = 1
inertia = [0.1, 0.1, 0.1]

[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "rotor"]
point = [0, 0, 0]
axis = [0, 0, 1]

[[joint]]
name = "motor"
type = "stepper-rotation"
bodies = ["ground", "rotor"]
point = [0, 0, 0]
axis = [0, 0, 1]
params = {{ angle = "sin(2 * (t - {start:?}))", step = 0.1, period = 0.03125, frequency = 80 }}

[[output]]
name = "steps"
quantity = "value"
of = "motor"
channel = "steps"
"#,
        start + 3.0
    );
    column(&run(&text, &[]), "steps").to_vec()
}

#[test]
fn samples_are_taken_at_times_far_from_zero() {
    let near = stepping(0.0);
    assert!(near.iter().fold(0.0_f64, |most, steps| most.max(*steps)) > 8.0);
    for start in [-1e6, 1e6, 1e9] {
        assert_eq!(stepping(start), near, "{start}");
    }
}

#[test]
fn a_capacity_that_becomes_negative_holds_nothing() {
    let disc = |name: &str, spin: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nangular_velocity = [0, 0, {spin}]\n\
             [[joint]]\nname = \"bearing_{name}\"\ntype = \"revolute\"\nbodies = [\"ground\", \"{name}\"]\naxis = [0, 0, 1]\n"
        )
    };
    let text = format!(
        "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\nt_end = 3\noutput_step = 0.1\n{}{}\
         [[joint]]\nname = \"clutch\"\ntype = \"clutch\"\nbodies = [\"a\", \"b\"]\naxis = [0, 0, 1]\n\
         params.capacity = \"5 * sin(3 * t)\"\n\
         [[output]]\nname = \"w\"\nquantity = \"angular_velocity\"\nof = \"a\"\ncomponent = \"z\"\n",
        disc("a", 10.0),
        disc("b", 0.0)
    );
    for formulation in ["joint", "cartesian"] {
        let report = try_run(&text, &[&format!("simulation.formulation=\"{formulation}\"")], None).unwrap();
        assert_eq!(report.summary.status, Status::Completed, "{}", report.summary.reason);
        // It slips until both have 5 rad/s, at cos 3t = 0.7. From pi / 3 on the capacity is below zero, and nothing drives them apart.
        for (t, w) in report.times.iter().zip(column(&report, "w")) {
            let exact = (10.0 - 50.0 / 3.0 * (1.0 - (3.0 * t).cos())).max(5.0);
            let exact = if *t > 0.7_f64.acos() / 3.0 { 5.0 } else { exact };
            assert!((w - exact).abs() < 1e-8, "{formulation} {t}: {w}");
        }
    }
}

/// A panel on a hub at one place, which falls onto a stop, and a body as far away as this: it sets the size of the scene, no more.
fn panel(far: f64) -> RunReport {
    let text = format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]

[simulation]
t_end = 4
output_step = 0.05

[[body]]
name = "panel"
mass = 0.5
inertia = [0.01, 0.01, 0.01]
position = [0.3, 0, 0]

[[body]]
name = "far"
mass = 1
inertia = [0.1, 0.1, 0.1]
position = [0, {far:?}, 0]

[[joint]]
name = "hinge"
type = "revolute"
bodies = ["ground", "panel"]
point = [0, 0, 0]
axis = [0, 0, 1]

[[joint]]
name = "stop"
type = "rotational-stop"
bodies = ["ground", "panel"]
point = [0, 0, 0]
axis = [0, 0, 1]
params = {{ lower = -1, restitution = 0.5 }}

[[force]]
name = "motor"
type = "rotational-actuator"
bodies = ["ground", "panel"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.of_time = -0.1

[[output]]
name = "angle"
quantity = "coordinate"
of = "hinge"
channel = "angle"
"#
    );
    run(&text, &[])
}

#[test]
fn an_angle_is_stopped_as_exactly_in_a_large_scene() {
    // -0.1 N m turns 0.055 kg m^2.
    let (a, mut from) = (0.1_f64 / 0.055, 0.0);
    let mut arcs = vec![(0.0, 0.0)];
    let mut speed = (2.0 * a).sqrt();
    from += speed / a;
    while speed > 1e-12 {
        speed *= 0.5;
        arcs.push((from, speed));
        from += 2.0 * speed / a;
    }
    let place = |t: f64| match arcs.iter().rev().find(|(start, _)| *start <= t) {
        _ if t >= from => -1.0,
        Some((0.0, _)) | None => -0.5 * a * t * t,
        Some((start, v)) => -1.0 + v * (t - start) - 0.5 * a * (t - start).powi(2),
    };
    for far in [1.0, 7e6, 1e9] {
        let report = panel(far);
        for (t, angle) in report.times.iter().zip(column(&report, "angle")) {
            assert!((angle - place(*t)).abs() < 1e-8, "{far}, {t}: {angle}, expected {}", place(*t));
        }
    }
}

#[test]
fn particles_have_no_size_of_their_own() {
    // A particle on an elliptic orbit of one micrometre, beside one of a metre.
    let orbit = |length: f64| {
        let text = format!(
            "[plugins]\nlibraries = [\"odyn-forces\"]\n[simulation]\nt_end = 20\noutput_step = 0.5\n\
             [[body]]\nname = \"p\"\nmass = 0.5\nparticle = true\nposition = [{length:e}, 0, 0]\n\
             velocity = [0, {:e}, 0]\n[[force]]\nname = \"pull\"\ntype = \"point-gravity\"\nbodies = [\"ground\", \"p\"]\n\
             params = {{ gravitational_parameter = {:e}, mass = 0.5 }}\n\
             [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"p\"\ncomponent = \"x\"\n",
            1.2 * length,
            length.powi(3)
        );
        let report = run(&text, &["simulation.method=\"radau5\""]);
        column(&report, "x").iter().map(|x| x / length).collect::<Vec<f64>>()
    };
    let metre = orbit(1.0);
    for length in [1e-9, 1e-6, 1e6] {
        let off = difference(&orbit(length), &metre);
        assert!(off < 1e-8, "{length}: {off:.1e}");
    }
}

#[test]
fn the_work_of_drivers_is_known_where_their_motion_is_exact() {
    for angle in ["3 * t", "t^3", "max(0, t - 1)^2", "max(0, t - 1)^3"] {
        let text = format!(
            "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\ngravity = [0, -9.81, 0]\nt_end = 2\noutput_step = 0.1\n\
             [[body]]\nname = \"arm\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [0.3, 0, 0]\n\
             velocity = [\"free\", \"free\", 0]\nangular_velocity = [0, 0, \"free\"]\n\
             [[joint]]\nname = \"hinge\"\ntype = \"revolute\"\nbodies = [\"ground\", \"arm\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
             [[joint]]\nname = \"motor\"\ntype = \"rotation-driver\"\nbodies = [\"ground\", \"arm\"]\npoint = [0, 0, 0]\n\
             axis = [0, 0, 1]\nparams.angle = \"{angle}\"\n\
             [[output]]\nname = \"E\"\nquantity = \"total_energy\"\n"
        );
        for method in ["dop853", "dopri5", "radau5", "radau9"] {
            for formulation in ["joint", "cartesian"] {
                let sets = [format!("simulation.method={method}"), format!("simulation.formulation=\"{formulation}\"")];
                let report = run(&text, &sets.iter().map(String::as_str).collect::<Vec<_>>());
                assert!(report.summary.audit.energy_error_relative < 1e-6, "{angle} by {method}");
            }
        }
    }
}

#[test]
fn results_at_the_start_alone_are_pointed_out() {
    let report = run(BALL, &["simulation.t_end=1", "simulation.output_step=5"]);
    assert_eq!(report.times.len(), 1);
    assert!(report.summary.warnings.iter().any(|warning| warning.contains("ODY0860")), "{:?}", report.summary.warnings);
    assert!(run(BALL, &["simulation.t_end=1", "simulation.output_step=1"]).summary.warnings.is_empty());
}

#[test]
fn a_library_of_the_command_line_that_is_not_there_is_an_error() {
    let scratch = crate::support::Scratch::new();
    let path = scratch.file("scene.toml", BALL);
    let missing = scratch.path().join("nowhere");
    let options = crate::support::options(&[], &[missing]);
    let error = odyn::session::Session::open(&path, &options).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("nowhere"), "{error}");
}

#[test]
fn times_that_are_known_less_well_than_the_tolerance_asks_are_pointed_out() {
    let warns = |start: f64| {
        let sets = [format!("simulation.t_start={start:e}"), format!("simulation.t_end={:e}", start + 3.0)];
        let report = try_run(BALL, &[&sets[0], &sets[1], "simulation.output_step=1"], None).unwrap();
        report.summary.warnings.iter().any(|warning| warning.contains("ODY0861"))
    };
    assert!(!warns(1e6) && warns(1e7) && warns(-1e9));
}

/// A particle slides up a slope at this place, and stays where it stops.
fn slides_up(place: [f64; 3]) -> String {
    let (normal, up) = ([2.0, -1.0, 2.0], [2.0, 2.0, -1.0]);
    let (sin, cos) = 0.6_f64.sin_cos();
    let gravity = [0, 1, 2].map(|k| -9.81 / 3.0 * (sin * up[k] + cos * normal[k]));
    format!(
        "[plugins]\nlibraries = [\"joints\"]\n[simulation]\ngravity = {gravity:?}\nt_end = 1\noutput_step = 0.5\nmax_steps = 5000\n\
         [[body]]\nname = \"block\"\nmass = 1\nparticle = true\nvelocity = {up:?}\nposition = {place:?}\n\
         [[joint]]\nname = \"slope\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"block\"]\npoint = {place:?}\n\
         axis = {normal:?}\nparams.mu = 0.8\n\
         [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"block\"\ncomponent = \"x\"\n"
    )
}

/// By implicit methods the time of sticking differs from run to run by up to some 1e-6 s, at any tolerance: velocities across the
/// sliding, which the tolerance allows, turn the direction of friction in the last instants, and the speed along it ends that much later.
/// The place is right to 1e-10 m all the same.
#[test]
fn contacts_stay_closed_far_from_the_origin() {
    let (sin, cos) = 0.6_f64.sin_cos();
    let time = 3.0 / (9.81 * (sin + 0.8 * cos));
    for share in [0.0, 4.0, 5.0, 8.0] {
        let x = 1.1e5 / 3.0 * share;
        let text = slides_up([x, -0.7 / 1.1 * x, 0.4 / 1.1 * x]);
        for (method, coordinates) in
            [("dop853", "joint"), ("dop853", "cartesian"), ("radau5", "joint"), ("radau5", "cartesian")]
        {
            let sets = [format!("simulation.method={method}"), format!("simulation.formulation={coordinates}")];
            let report = run(&text, &[&sets[0], &sets[1]]);
            let parts = |kind: EventKind| report.events.iter().any(|event| event.kind == kind);
            assert!(!parts(EventKind::Opens) && !parts(EventKind::Impact), "{share} {sets:?}: {:?}", report.events);
            assert!((report.events.last().unwrap().time - time).abs() < 1e-8, "{share} {sets:?}: {:?}", report.events);
            assert!((column(&report, "x")[2] - x - time).abs() < 1e-8, "{share} {sets:?}");
        }
    }
}

/// Nothing has moved before, so that no error is small beside anything.
#[test]
fn a_force_that_sets_in_at_zero_after_a_start_before_it() {
    let text = "[plugins]\nlibraries = [\"forces\"]\n[simulation]\nt_start = -1\nt_end = 1\noutput_step = 0.5\n\
                [[body]]\nname = \"block\"\nmass = 1\nparticle = true\n\
                [[force]]\nname = \"push\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"block\"]\npoint = [0, 0, 0]\n\
                params.x = { points = [[-2, 0], [0, 1]], interpolation = \"steps\" }\n\
                [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"block\"\ncomponent = \"x\"\n";
    for method in ["dop853", "dopri5", "radau5", "radau9", "auto"] {
        for start in ["-1", "-0.3", "-7"] {
            let sets = [format!("simulation.method={method}"), format!("simulation.t_start={start}")];
            let report = run(text, &[&sets[0], &sets[1]]);
            let x = *column(&report, "x").last().unwrap();
            let t = *report.times.last().unwrap();
            assert!((x - 0.5 * t * t).abs() < 1e-12, "{method} from {start}: {x}");
        }
    }
}

/// Forces in steps, of which a thousand or more act one after another, some of them again and again: the velocity is the sum of
/// the impulses. With a first stage on the wrong side of each jump it was off by 3e-6.
#[test]
fn forces_in_a_thousand_steps_leave_the_sum_of_their_impulses() {
    let cart = |points: &str, more: &str| {
        format!(
            "[plugins]\nlibraries = [\"forces\"]\n[simulation]\nt_end = 37\noutput_step = 1\ntolerance = 1e-8\n\
             [[body]]\nname = \"cart\"\nmass = 1\nparticle = true\n\
             [[force]]\nname = \"push\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"cart\"]\npoint = [0, 0, 0]\n\
             params.x = {{ points = [{points}], interpolation = \"steps\"{more} }}\n\
             [[output]]\nname = \"v\"\nquantity = \"velocity\"\nof = \"cart\"\ncomponent = \"x\"\n"
        )
    };
    let mut random = Random::new(7);
    let steps: Vec<[f64; 2]> = (0..1000).map(|k| [0.037 * f64::from(k), random.between(-1.0, 1.0)]).collect();
    let once: Vec<String> = steps.iter().map(|[t, force]| format!("[{t:?}, {force:?}]")).collect();
    let sum: f64 = steps.iter().map(|[_, force]| 0.037 * force).sum();
    let scenes = [
        (cart(&once.join(", "), ""), sum),
        (cart("[0, 1], [0.013, -0.5], [0.037, 1]", ", periodic = true"), 1000.0 * (0.013 - 0.5 * 0.024)),
        (cart("[0, 1], [0.1, -0.4], [0.37, 1]", ", periodic = true"), 100.0 * (0.1 - 0.4 * 0.27)),
    ];
    for (text, expected) in scenes {
        for method in ["dop853", "radau5"] {
            let report = run(&text, &[&format!("simulation.method={method}")]);
            let v = *column(&report, "v").last().unwrap();
            assert!((v - expected).abs() < 1e-10, "{method}: {v} {expected}");
        }
    }
}

/// A table over an angle with more jumps than choices are written for: kinetic energy is the work of each part of a turn.
#[test]
fn a_torque_in_many_steps_over_the_angle_does_the_work_of_each() {
    let mut random = Random::new(8);
    let steps: Vec<[f64; 2]> = (0..60).map(|k| [0.11 * f64::from(k), random.between(-1.0, 2.0)]).collect();
    let points: Vec<String> = steps.iter().map(|[phi, torque]| format!("[{phi:?}, {torque:?}]")).collect();
    let text = format!(
        "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\nt_end = 3\noutput_step = 0.5\ntolerance = 1e-8\n\
         [[body]]\nname = \"rotor\"\nmass = 1\ninertia = [1, 1, 1]\nangular_velocity = [0, 0, 2]\n\
         [[joint]]\nname = \"axle\"\ntype = \"revolute\"\nbodies = [\"ground\", \"rotor\"]\npoint = [0, 0, 0]\n\
         [[force]]\nname = \"drive\"\ntype = \"rotational-actuator\"\nbodies = [\"ground\", \"rotor\"]\npoint = [0, 0, 0]\n\
         params.of_angle = {{ points = [{}], interpolation = \"steps\" }}\n\
         [[output]]\nname = \"phi\"\nquantity = \"coordinate\"\nof = \"axle\"\n\
         [[output]]\nname = \"w\"\nquantity = \"angular_velocity\"\nof = \"rotor\"\ncomponent = \"z\"\n",
        points.join(", ")
    );
    for way in [["joint", "dop853"], ["cartesian", "dop853"], ["joint", "radau5"]] {
        let report =
            run(&text, &[&format!("simulation.formulation={}", way[0]), &format!("simulation.method={}", way[1])]);
        for (phi, w) in column(&report, "phi").iter().zip(column(&report, "w")) {
            let ends = steps[1..].iter().map(|[phi, _]| *phi).chain([f64::INFINITY]);
            let work: f64 =
                steps.iter().zip(ends).map(|([from, torque], to)| torque * (phi.min(to) - from).max(0.0)).sum();
            assert!((0.5 * w * w - 2.0 - work).abs() < 1e-7, "{way:?} at {phi}: {w} {work}");
        }
    }
}

/// Output times in a unit that is no power of ten of a second are rounded: rows at sampling instants have what was held until then.
#[test]
fn rows_at_sampling_instants_have_the_values_before_in_every_unit() {
    for (unit, seconds) in [("s", 1.0), ("min", 60.0), ("h", 3600.0)] {
        let scene = format!(
            r#"
[plugins]
libraries = ["odyn-controls"]
[units]
time = "{unit}"
[simulation]
t_end = {:?}
output_step = {:?}
[[body]]
name = "b"
mass = 1
inertia = [1, 1, 1]
[[control]]
name = "c"
type = "digital-pid"
params = {{ period = "0.1 s", kp = 0, ki = 1 }}
inputs = {{ set_point = 1, measured = 0 }}
[[output]]
name = "sum"
quantity = "value"
of = "c"
channel = "output"
"#,
            100.0 / seconds,
            0.1 / seconds
        );
        let report = run(&scene, &[]);
        let sums = column(&report, "sum");
        for (row, pair) in sums.windows(2).enumerate().skip(1) {
            let step = pair[1] - pair[0];
            assert!((step - 0.1).abs() < 1e-9, "{unit}: row {} is {step} above the one before", row + 1);
        }
    }
}
