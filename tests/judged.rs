//! Runs that reach their end with results that are not to be believed, and say so.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use odyn::diagnostics::codes;
use odyn::results::{Status, Table};
use odyn::scene::AuditTolerance;
use odyn::session::{Checkpoint, RunOptions, RunReport, Session};

use crate::support::{Scratch, column, difference, open_text, options, root};

#[track_caller]
fn run(text: &str, sets: &[&str]) -> RunReport {
    let session = open_text(text, sets);
    session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A ball thrown up against a stop that it reaches from t = 0.65 s to 0.84 s.
const BALL: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.05
[[body]]
name = "ball"
mass = 1
inertia = [0.01, 0.01, 0.01]
velocity = [0, 0, 7.3]
[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "ball"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[force]]
name = "ceiling"
type = "bump-stop"
bodies = ["ground", "ball"]
axis = [0, 0, 1]
params = { lower = -9, upper = 2.68, force = 5e4, depth = 0.01, exponent = 1 }
[[output]]
name = "energy"
quantity = "total_energy"
[[output]]
name = "z"
quantity = "position"
of = "ball"
component = "z"
"#;

/// A step that is blind to the stop: it has no stages between 0.652 s and 0.857 s. Its ends agree on the energy, the table does not.
#[test]
fn a_stop_that_was_flown_through_shows_in_the_table() {
    let blind = run(BALL, &["simulation.fixed_step=1"]);
    let summary = &blind.summary;
    assert!(summary.audit.energy_error_relative < 1e-12, "{:?}", summary.audit);
    let energy = column(&blind, "energy");
    let jump = energy.iter().fold(0.0_f64, |most, e| most.max((e - energy[0]).abs()));
    assert!(jump > 100.0 && summary.audit.sample_energy_error_relative > 0.5, "{jump} J, {:?}", summary.audit);
    assert_eq!((summary.status, summary.code, blind.exit_code()), (Status::Suspect, Some(codes::AUDIT_SAMPLES), 7));
    assert!(summary.reason.starts_with("in the table, the balance of energies is off by"), "{}", summary.reason);
    // With steps that feel the stop, the ball comes back.
    let seen = run(BALL, &["simulation.max_step=0.01"]);
    assert_eq!((seen.summary.status, seen.exit_code()), (Status::Completed, 0), "{}", seen.summary.reason);
    assert!(column(&seen, "z").last().unwrap() + 0.1 < *column(&blind, "z").last().unwrap());
}

/// A limit lasts when a run is interrupted and resumed, and so does the status.
#[test]
fn limits_and_status_survive_resuming() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", BALL);
    let out = scratch.path().join("out");
    let sets = ["simulation.max_step=0.01", "simulation.checkpoint_every=0.25"];
    let asked = RunOptions { audit_tolerance: Some(AuditTolerance::Limit(1e-300)), ..options(&sets, &[]) };
    let stop = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&stop);
    let session = Session::open(&scene, &asked).unwrap_or_else(|error| panic!("{error}"));
    let progress = move |share: f64| raised.store(share > 0.6, Ordering::Relaxed);
    let part = session.run(Some(&out), Box::new(progress), &stop).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((part.summary.status, part.summary.checkpoints), (Status::StoppedEarly, 2));

    let point = Checkpoint::read(&out).unwrap();
    let (path, opened) = point.opened().unwrap();
    assert_eq!(opened.audit_tolerance, Some(AuditTolerance::Limit(1e-300)));
    let mut session = Session::open(path, &opened).unwrap_or_else(|error| panic!("{error}"));
    session.resume(point).unwrap_or_else(|error| panic!("{error}"));
    let report =
        session.run(Some(&out), Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((report.summary.status, report.summary.resumed, report.exit_code()), (Status::Suspect, 1, 7));
    let text = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&summary["status"], &summary["audit_limits"]["energy"]), (&"suspect".into(), &1e-300.into()));
    assert!(!out.join("checkpoint.toml").exists(), "nothing is left to resume");
    assert_eq!(Table::read(&out.join("results.csv")).unwrap().times.len(), 21);
}

/// A table of 2 kg that a drive shakes, beside a body at rest, so that the motion is integrated.
const SHAKER: &str = r#"
[plugins]
libraries = ["joints"]
[simulation]
t_end = 60
output_step = 0.5
[[body]]
name = "table"
mass = 2
inertia = [1, 1, 1]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "table"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[joint]]
name = "drive"
type = "displacement-driver"
bodies = ["ground", "table"]
point = [0, 0, 0]
axis = [1, 0, 0]
params.displacement = "3.3e-4 * (1 - cos(94.24777960769379 * t))"
[[body]]
name = "probe"
mass = 0.5
particle = true
position = [0, 0, 1]
[[output]]
name = "x"
quantity = "position"
of = "table"
component = "x"
"#;

/// The errors of its work in steps have one sign, and there are thousands of periods.
#[test]
fn a_shaker_is_not_suspect_for_how_long_it_shakes() {
    let report = run(SHAKER, &[]);
    let summary = &report.summary;
    assert_eq!((summary.status, report.exit_code()), (Status::Completed, 0), "{}", summary.reason);
    // Work that is known badly still is.
    let coarse = run(SHAKER, &["simulation.tolerance=1e-4"]);
    assert_eq!((coarse.summary.status, coarse.exit_code()), (Status::Suspect, 7), "{:?}", coarse.summary.audit);
}

/// A force that is not a number is that of an element, and comes from an operation.
#[test]
fn what_is_not_a_number_names_its_element() {
    let motor = |expression: &str| {
        format!(
            "{BALL}[[force]]\nname = \"motor\"\ntype = \"translational-actuator\"\nbodies = [\"ground\", \"ball\"]\n\
             points = [[0, 0, -1], [0, 0, 0]]\nparams.of_time = \"{expression}\"\n"
        )
    };
    let named = "`motor` is not a finite number";
    for (expression, operation) in [
        ("sqrt(t - 1)", "the square root of -1e0"),
        ("1 / t", "1e0 divided by 0e0"),
        // Only behind the last state.
        ("sqrt(0.3 - t)", "the square root of -"),
    ] {
        let report = run(&motor(expression), &[]);
        let summary = &report.summary;
        assert_eq!(
            (summary.status, summary.code),
            (Status::StoppedEarly, Some(codes::MOTION_NOT_FINITE)),
            "{}",
            summary.reason
        );
        assert!(summary.reason.contains(named) && summary.reason.contains(operation), "{}", summary.reason);
        assert!(summary.reason.contains(&format!("look at `of_time = \"{expression}\"`")), "{}", summary.reason);
    }
}

/// A pulse of 0.05 s in 10 s, passed over by the long steps of a body at rest. What moves nothing has no energy to lose.
const PULSE: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
t_end = 10
output_step = 1
[[body]]
name = "cart"
mass = 1
inertia = [0.01, 0.01, 0.01]
[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "cart"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[force]]
name = "hammer"
type = "translational-actuator"
bodies = ["ground", "cart"]
points = [[-1, 0, 0], [0, 0, 0]]
params.of_time = "3 exp(-((t - 6.3) / 0.05)^2)"
[[output]]
name = "x"
quantity = "position"
of = "cart"
component = "x"
"#;

fn verified(sets: &[&str]) -> RunReport {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", PULSE);
    let session = Session::open(&scene, &options(sets, &[])).unwrap_or_else(|error| panic!("{error}"));
    let (second, how) = session.sharper().unwrap();
    let mut report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    report.verify(&how, second.run(None, Box::new(|_| ()), &Default::default()).as_ref());
    report
}

#[test]
fn a_second_run_finds_what_the_first_passed_over() {
    // Fixed steps that are too long for the pulse, whatever error control does.
    let blind = verified(&["simulation.fixed_step=1", "simulation.audit_tolerance=1e-3"]);
    let x = column(&blind, "x").last().unwrap().abs();
    // 3 N for sqrt(pi) 0.05 s, then 3.7 s at that speed.
    let exact = 3.0 * 0.05 * std::f64::consts::PI.sqrt() * 3.7;
    assert!((x - exact).abs() > 1e-2, "{x} of {exact}");
    assert_eq!((blind.summary.status, blind.exit_code()), (Status::Suspect, 7));
    let warnings = &blind.summary.warnings;
    assert!(warnings.iter().any(|one| one.starts_with("ODY0704: a second run (radau5")), "{warnings:?}");
    let seen = verified(&["simulation.max_step=0.02"]);
    assert!((column(&seen, "x").last().unwrap() - exact).abs() < 1e-8);
    assert_eq!((seen.summary.status, seen.exit_code()), (Status::Completed, 0), "{}", seen.summary.reason);
    let how = &seen.summary.verified.as_ref().unwrap().how;
    assert_eq!(how, "radau5 instead of dop853, tolerance 1e-11 instead of 1e-10, steps up to 0.02 s");
}

/// Friction in a loop of revolute joints that all turn about z. What rigid bodies leave open there are forces along z and
/// moments across it: a pin rubs by its radial load, which is unique; a thrust face by its axial load, which is not.
#[test]
fn friction_on_reactions_that_are_not_unique_is_suspect() {
    let squeezer = std::fs::read_to_string(root().join("scenes/benchmarks/A03.toml")).expect("a scene");
    let both = |friction: &str| {
        let load = "[[output]]\nname = \"load\"\nquantity = \"value\"\nof = \"rub\"\nchannel = \"normal_force\"\n";
        let text = format!(
            "{squeezer}\n[[force]]\nname = \"rub\"\ntype = \"joint-friction\"\njoints = [\"O\"]\n{friction}\n{load}"
        );
        ["joint", "cartesian"]
            .map(|form| run(&text, &["simulation.t_end=0.01", &format!("simulation.formulation={form}")]))
    };
    let pin = both("params = { kind = \"rotation\", mu = 0.2, radius = 0.002 }");
    for report in &pin {
        assert_eq!(report.summary.status, Status::Completed, "{}", report.summary.reason);
        assert!(!report.summary.not_unique.contains(&"load".to_owned()));
    }
    let loads = pin.each_ref().map(|report| column(report, "load"));
    assert!(difference(loads[0], loads[1]) < 1e-7, "{:e}", difference(loads[0], loads[1]));
    for report in &both("params = { kind = \"rotation\", mu = 0.2, radius = 0.002, thrust_radius = 0.003 }") {
        assert_eq!(report.summary.status, Status::Suspect);
        assert!(report.summary.reason.starts_with("the load of `rub` depends"), "{}", report.summary.reason);
        assert!(report.summary.not_unique.contains(&"load".to_owned()));
    }
}

/// A rod that a hinge on the first of two slides holds, whose tip rests on the other one; of both slides one moves. With `brake` the hinge
/// has dry friction, and how much of the weight the tip carries is open: between 10 N - 3 N m / 1 m and 10 N + 3 N m / 1 m.
fn leaning(moves: &str, tip: &str, brake: bool, more: &str) -> String {
    let speed = |name: &str| if name == moves { "velocity = [2, 0, 0]" } else { "" };
    let (rod, fixed) = (speed("carriage"), |name: &str| if name == moves { "" } else { "fixed = true" });
    format!(
        r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, 0, -10]
t_end = 0.5
output_step = 0.1
[[body]]
name = "carriage"
mass = 5
inertia = [1, 1, 1]
{}
{}
[[body]]
name = "belt"
mass = 5
inertia = [1, 1, 1]
position = [0, 0, -1]
{}
{}
[[body]]
name = "rod"
mass = 2
inertia = [1, 1, 1]
position = [0.5, 0, 0]
{rod}
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "{moves}"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[joint]]
name = "hinge"
type = "revolute"
bodies = ["carriage", "rod"]
point = [0, 0, 0]
axis = [0, -1, 0]
[[joint]]
name = "brake"
type = "dry-friction"
bodies = ["carriage", "rod"]
point = [0, 0, 0]
axis = [0, -1, 0]
params.torque = 3
enabled = {brake}
[[joint]]
name = "tip"
type = "plane-contact"
bodies = ["belt", "rod"]
frames = [{{ position = [0, 0, 1], axis = [0, 0, 1] }}, {{ position = [0.5, 0, 0] }}]
{tip}
[[output]]
name = "v"
quantity = "velocity"
of = "{moves}"
component = "x"
[[output]]
name = "load"
quantity = "reaction_force"
of = "hinge"
component = "z"
{more}
"#,
        speed("carriage"),
        fixed("carriage"),
        speed("belt"),
        fixed("belt"),
    )
}

/// A belt that slides under the tip: its friction depends on what the hinge takes up at rest. A carriage that carries the hinge: what rubs
/// in its guide does.
#[test]
fn sliding_that_depends_on_what_friction_at_rest_takes_up_is_suspect() {
    let rub = "[[force]]\nname = \"rub\"\ntype = \"joint-friction\"\njoints = [\"guide\"]\n\
               params = { kind = \"translation\", mu = 0.3, transition_speed = 1e-6 }";
    // Slowed down by 0.3 times what the tip presses the belt with; by 0.3 times what the carriage weighs and the hinge carries.
    let cases = [("belt", "params.mu = 0.3", "", "`tip`", 0.6), ("carriage", "", rub, "`rub`", 0.3 * 60.0 / 7.0)];
    for (moves, tip, more, name, slower) in cases {
        for form in ["joint", "cartesian"] {
            let form = format!("simulation.formulation={form}");
            let free = run(&leaning(moves, tip, false, more), &[&form]);
            assert_eq!(free.summary.status, Status::Completed, "{}", free.summary.reason);
            assert!(free.summary.not_unique.is_empty(), "{:?}", free.summary.not_unique);
            let v = *column(&free, "v").last().unwrap();
            assert!((v - (2.0 - 0.5 * slower)).abs() < 1e-8, "{moves}: {v}");
            let braked = run(&leaning(moves, tip, true, more), &[&form]);
            assert_eq!((braked.summary.status, braked.exit_code()), (Status::Suspect, 7), "{moves}");
            assert!(braked.summary.reason.contains(&format!("loads of {name} depend")), "{}", braked.summary.reason);
            assert_eq!(braked.summary.not_unique, ["load"], "{moves}");
        }
    }
}

/// A wheel on a track that is given by points, thrown beyond its last one, where the track arrives with a slope unless it ends level.
fn track(points: &str) -> RunReport {
    let text = format!(
        r#"
[plugins]
libraries = ["joints"]
[simulation]
gravity = [0, 0, 0]
t_end = 1
output_step = 0.05
[[body]]
name = "wheel"
mass = 1.0
inertia = [0.1, 0.1, 0.1]
position = [0.5, 0, 0.25]
velocity = [2, 0, "free"]
[[joint]]
name = "track"
type = "point-on-curve"
bodies = ["ground", "wheel"]
points = [[0, 0, 0], [0.5, 0, 0.25]]
axis = [0, -1, 0]
x_axis = [1, 0, 0]
params.height = {points}
"#
    );
    run(&text, &[])
}

#[test]
fn the_curve_of_a_joint_is_named_where_a_body_passes_its_end() {
    let kinked = track("[[-1, 1], [0, 0], [0.5, 0.25], [0.8, 0.5], [1, 1]]").summary;
    assert_eq!((kinked.status, kinked.code), (Status::Suspect, Some(codes::CURVE_PASSED)));
    let reason = &kinked.reason;
    assert!(reason.starts_with("`track` passes the last point of the curve of `height` at x = 1 m"), "{reason}");
    assert!(reason.contains("give points beyond the motion"), "{reason}");
    let far = track("[[-1, 1], [0, 0], [0.5, 0.25], [0.8, 0.5], [1, 1], [4, 9]]").summary;
    assert_eq!(far.status, Status::Completed, "{}", far.reason);
    let level = "{ points = [[0, 0], [0.5, 0.25], [1, 0.5], [1.2, 0.5]], interpolation = \"monotone\" }";
    let level = track(level).summary;
    assert_eq!(level.status, Status::Completed, "{}", level.reason);
}

/// A stepping motor turns a weight that is off its axis: one iteration of an implicit method solves the motion, and not the work.
#[test]
fn work_is_integrated_as_well_as_the_motion_that_does_it() {
    let text = r#"
[plugins]
libraries = ["joints"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.05
tolerance = 1e-10
[[body]]
name = "rotor"
mass = 3
inertia = [0.1, 0.2, 0.1]
com = [0.05, 0.02, 0]
[[joint]]
name = "hub"
type = "revolute"
bodies = ["ground", "rotor"]
axis = [0, 1, 0]
[[joint]]
name = "motor"
type = "stepper-rotation"
bodies = ["ground", "rotor"]
axis = [0, 1, 0]
params = { angle = "3 * sin(3 * t)", step = 0.03, period = 0.02, frequency = 190, damping = 1 }
"#;
    for method in ["dop853", "radau5", "radau9"] {
        let summary = run(text, &[&format!("simulation.method=\"{method}\"")]).summary;
        assert_eq!(summary.status, Status::Completed, "{method}: {}", summary.reason);
        let off = summary.audit.energy_error_relative;
        assert!(off < 2e-8, "{method}: {off:.1e}");
    }
}

/// A carriage that a driver moves, with a pendulum on it.
fn driven_carriage(displacement: &str, sets: &[&str]) -> RunReport {
    let text = format!(
        r#"
[plugins]
libraries = ["joints"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.05
[[body]]
name = "carriage"
mass = 1.0
inertia = [0.1, 0.1, 0.1]
velocity = ["free", 0, 0]
[[body]]
name = "bob"
mass = 1.0
inertia = [0.1, 0.1, 0.1]
position = [0, 0, -1]
velocity = ["free", 0, 0]
[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "carriage"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[joint]]
name = "hinge"
type = "revolute"
bodies = ["carriage", "bob"]
point = [0, 0, 0]
axis = [0, 1, 0]
[[joint]]
name = "drive"
type = "displacement-driver"
bodies = ["ground", "carriage"]
point = [0, 0, 0]
axis = [1, 0, 0]
params.displacement = "{displacement}"
"#
    );
    run(&text, sets)
}

/// The velocity of a driver that turns back at once is that before with another sign: the balance of energies holds across it.
#[test]
fn a_driver_with_a_kink_is_named() {
    for sets in [
        &["simulation.formulation=joint"][..],
        &["simulation.formulation=cartesian"],
        &["simulation.formulation=joint", "simulation.method=radau5"],
        &["simulation.tolerance=1e-6"],
    ] {
        for displacement in ["0.2 * abs(t - 0.5) - 0.1", "0.2 * min(t, 0.5)"] {
            let summary = driven_carriage(displacement, sets).summary;
            let seen = (summary.status, summary.code);
            assert_eq!(seen, (Status::Suspect, Some(codes::AUDIT_CONSTRAINTS)), "{sets:?}: {}", summary.reason);
            assert!(summary.reason.contains("in drive: ") && summary.reason.contains("(t = 0.5"), "{}", summary.reason);
            assert!(summary.reason.contains("it has a kink there"), "{}", summary.reason);
        }
        let smooth = driven_carriage("0.2 * sqrt((t - 0.5)^2 + 0.0001) - 0.1", sets).summary;
        assert_eq!(smooth.status, Status::Completed, "{sets:?}: {}", smooth.reason);
    }
}

/// Where time determines the motion, nothing is integrated; a kink is the same.
#[test]
fn a_driver_with_a_kink_is_named_where_nothing_is_free() {
    for (angle, at) in [
        ("\"10 min(t, 0.5)\"", "0.5"),
        ("\"3 max(0, t - 0.5)\"", "0.5"),
        ("{ points = [[-1, -2], [0, 0], [0.25, 0.6], [0.5, 1]], interpolation = \"monotone\" }", "0.5"),
        // Right at the start.
        ("\"max(0, sin(3 t))\"", ""),
    ] {
        let text = format!(
            r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
t_end = 2
output_step = 0.1
gravity = [0, -9.81, 0]
[[body]]
name = "crank"
mass = 1
inertia = [0.1, 0.1, 0.1]
position = [0.5, 0, 0]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "drive"
type = "rotation-driver"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.angle = {angle}
"#
        );
        for sets in [&[][..], &["simulation.without=[\"kinematic\"]"], &["simulation.formulation=cartesian"]] {
            let summary = run(&text, sets).summary;
            let seen = (summary.status, summary.code);
            assert_eq!(seen, (Status::Suspect, Some(codes::AUDIT_CONSTRAINTS)), "{angle} {sets:?}: {}", summary.reason);
            assert!(
                summary.reason.contains("in drive: ") && summary.reason.contains(&format!("(t = {at}")),
                "{}",
                summary.reason
            );
            assert!(summary.reason.contains("it has a kink there"), "{angle} {sets:?}: {}", summary.reason);
        }
    }
}

/// A drive that rests and then turns quickly has no kink, however slow the scene has been until then.
#[test]
fn a_drive_that_rests_before_it_turns_has_no_kink() {
    let text = r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
t_end = 10
output_step = 0.05
[[body]]
name = "plate"
mass = 1
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "drive"
type = "rotation-driver"
bodies = ["ground", "plate"]
axis = [0, 0, 1]
params.angle = { points = [[0, 0], [5, 0], [5.001, 1], [10, 1]], interpolation = "monotone" }
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "plate"]
axis = [0, 0, 1]
"#;
    let summary = run(text, &[]).summary;
    assert_eq!((summary.status, summary.method), (Status::Completed, "kinematic".into()), "{}", summary.reason);
    assert!(summary.audit.velocity_violation < 1e-12, "{:?}", summary.audit);
}

/// A weight that is drawn through the sheave from which it hangs: the strand's length is a root there, with a kink.
#[test]
fn a_strand_whose_points_meet_is_named() {
    let mut text = String::from(
        "[plugins]\nlibraries = [\"joints\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 1\noutput_step = 0.01\n[[joint]]\n\
         name = \"rope\"\ntype = \"rope\"\nbodies = [\"light\", \"ground\", \"ground\", \"heavy\"]\n\
         points = [[0, 0, -1], [0, 0, 0], [1, 0, 0], [1, 0, -1]]\nparams.length = 3\n",
    );
    for (name, mass, x) in [("light", 1.0, 0.0), ("heavy", 3.0, 1.0)] {
        text += &format!(
            "[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = [1, 1, 1]\nposition = [{x:?}, 0, -1]\n[[joint]]\n\
             name = \"guide_{name}\"\ntype = \"translational\"\nbodies = [\"ground\", \"{name}\"]\npoint = [{x:?}, 0, -1]\n\
             axis = [0, 0, 1]\n"
        );
    }
    // It arrives there after sqrt(2 h / a), with a of half of gravity.
    let arrives = (2.0 / (0.5 * 9.81_f64)).sqrt();
    let before = run(&text, &["simulation.t_end=0.63"]).summary;
    assert_eq!(before.status, Status::Completed, "{}", before.reason);
    // It goes to and fro there, until there is no step left.
    let through = run(&text, &["simulation.max_steps=300"]).summary;
    assert_eq!(through.status, Status::StoppedEarly, "{}", through.reason);
    assert!(
        through.reason.contains("in rope: ") && through.reason.contains("it has a kink there"),
        "{}",
        through.reason
    );
    assert!((through.audit.velocity_violation_at - arrives).abs() < 1e-4, "{:?}", through.audit);
}

/// A guide whose reactions are unique, beside a door on two hinges: what round-off leaves of the door's redundant rows in the guide is no
/// load that is open.
#[test]
fn friction_beside_redundant_rows_of_others_is_determined() {
    let text = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 0.1
output_step = 0.01
[parameters]
a = "10 deg"
[[body]]
name = "creeping"
mass = 2
inertia = [1, 1, 1]
position = [0, 3, 0]
[[body]]
name = "overhung"
mass = 2
inertia = [1, 1, 1]
position = [0.1, 5, 0]
velocity = [3, 0, 0]
[[body]]
name = "door"
mass = 1
inertia = [1, 1, 1]
position = [0.3, 0, 0]
[[joint]]
name = "slope"
type = "translational"
bodies = ["ground", "creeping"]
point = [0, 3, 0]
axis = ["cos(a)", 0, "-sin(a)"]
x_axis = [0, 1, 0]
[[joint]]
name = "slide"
type = "translational"
bodies = ["ground", "overhung"]
point = [0, 5, 0]
axis = [1, 0, 0]
x_axis = [0, 1, 0]
[[joint]]
name = "lower"
type = "revolute"
bodies = ["ground", "door"]
point = [0, 0, 0]
axis = [0, 1, 0]
[[joint]]
name = "upper"
type = "revolute"
bodies = ["ground", "door"]
point = [0, 1, 0]
axis = [0, 1, 0]
[[force]]
name = "friction"
type = "joint-friction"
joints = ["slide"]
params = { kind = "translation", mu = 0.3, transition_speed = 0.001, guide_length = 0.4 }
"#;
    let report = run(text, &[]);
    assert_eq!((report.summary.status, report.exit_code()), (Status::Completed, 0), "{}", report.summary.reason);
}

/// A hinge about a slanting axis, z of its body, and the axis held once more: torques across it are open, whatever axes they are given in,
/// and that about it is not.
#[test]
fn reactions_in_axes_of_a_body_are_judged_there() {
    let mut text = r#"
[plugins]
libraries = ["joints"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 0.2
output_step = 0.1
[[body]]
name = "a"
mass = 1
inertia = [0.1, 0.2, 0.3]
com = [0.3, 0.1, 0.2]
orientation = { rotation_vector = [0.3, 0.4, 0.5] }
"#
    .to_owned();
    for (name, kind) in [("hinge", "revolute"), ("again", "parallel-axes")] {
        text += &format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"ground\", \"a\"]\n\
             frames = [{{ axis = [0.41, -0.2, 0.86], x_axis = [1, 0, 0] }}, {{ axis = [0, 0, 1], x_axis = [1, 0, 0] }}]\n"
        );
    }
    for (frame, component) in ["a", "ground"].into_iter().flat_map(|frame| ["x", "y", "z"].map(|k| (frame, k))) {
        for quantity in ["reaction_force", "reaction_torque"] {
            text += &format!(
                "[[output]]\nname = \"{quantity}-{component}-{frame}\"\nquantity = \"{quantity}\"\nof = \"hinge\"\n\
                 component = \"{component}\"\nframe = \"{frame}\"\n"
            );
        }
    }
    let torques = ["x-a", "y-a", "x-ground", "y-ground", "z-ground"].map(|name| format!("reaction_torque-{name}"));
    assert_eq!(run(&text, &[]).summary.not_unique, torques);
}
