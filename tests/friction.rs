//! Rows that hold up to a limit: they stick and slide where closed forms say, in both coordinates, by every method that chooses its
//! steps.

use std::fs;

use odyn::results::{Event, EventKind};
use odyn::session::{RunReport, Session};

use crate::contacts::{every_way_agrees, run, try_run};
use crate::support::{Scratch, column, difference, options, root};

fn scene(name: &str) -> String {
    fs::read_to_string(root().join(format!("scenes/verification/{name}.toml"))).unwrap()
}

/// The time of the event number `k` of an element.
#[track_caller]
fn time(report: &RunReport, element: &str, kind: EventKind, k: usize) -> f64 {
    let own: Vec<&Event> = report.events.iter().filter(|e| e.element == element && e.kind == kind).collect();
    own.get(k).unwrap_or_else(|| panic!("{element}: {:?}", report.events)).time
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() < tolerance, "{found}, expected {expected}");
}

#[test]
fn a_clutch_locks_and_slips_when_its_closed_form_does() {
    // Energies between the ends of large steps are not those of a polynomial.
    let report = every_way_agrees(&scene("clutch").replace("[simulation]", "[simulation]\nmax_step = 0.05"), 1e-9);
    assert!(report.summary.checks_passed());
    near(time(&report, "clutch", EventKind::Sticks, 0), 3.0 - 7.0_f64.sqrt(), 1e-12);
    near(time(&report, "clutch", EventKind::Slides, 1), 3.0, 1e-10);
    let audit = &report.summary.audit;
    // The integral of C (w1 - w2) until it locks, then from t = 3 on, with s = t - 3: (2 - 2 s) 15 s^2.
    let t = 3.0 - 7.0_f64.sqrt();
    let first = 240.0 * t - 390.0 * t.powi(2) + 100.0 * t.powi(3) - 7.5 * t.powi(4);
    let s: f64 = 0.8;
    near(audit.dissipated, first + 10.0 * s.powi(3) - 7.5 * s.powi(4), 1e-9);
    assert!(audit.energy_error_relative < 1e-12, "{audit:?}");
}

#[test]
fn dry_friction_sticks_slides_and_stands_still() {
    let report = every_way_agrees(&scene("dry-friction"), 1e-8);
    assert!(report.summary.checks_passed());
    let sticks = (1.0_f64 / 3.0).asin() / 2.0;
    near(time(&report, "grip", EventKind::Sticks, 0), sticks, 1e-11);
    near(time(&report, "grip", EventKind::Slides, 1), sticks + 2.0_f64.sqrt(), 1e-9);
    near(time(&report, "held", EventKind::Sticks, 0), 0.4, 1e-12);
    near(time(&report, "brake", EventKind::Sticks, 0), 10.0 / 6.0, 1e-12);
}

#[test]
fn what_friction_holds_stays_where_it_is_for_ever() {
    let text = scene("dry-friction");
    let text = text.split_once("[[check]]").unwrap().0.replace("t_end = 4", "t_end = 1e5");
    let text = text.replace("output_step = 0.01", "output_step = 1e4");
    // Without the belt, which continues.
    let report = run(&text, &["grip.params.force=0.0", "belt_drive.params.displacement=\"0 * t\""]);
    let up = column(&report, "up");
    assert!(up[1..].iter().all(|x| x.to_bits() == up[1].to_bits()), "{up:?}");
    near(up[1], 0.4, 1e-12);
}

/// A sphere that slides and spins on a table.
fn ball(set: &str) -> String {
    let text = scene("plane-contact-friction");
    let (head, rest) = text.split_once("[[body]]").unwrap();
    let own = rest.split_once("[[body]]").unwrap().0;
    let outputs = text.split_once("[[output]]").unwrap().1.split_once("name = \"held_x\"").unwrap().0;
    let outputs = outputs.trim_end().trim_end_matches("[[output]]");
    format!("{}[[body]]{own}[[output]]{outputs}{set}", head.replace("t_end = 1\n", "t_end = 0.4\n"))
}

#[test]
fn a_ball_slides_and_then_rolls_exactly() {
    let report = every_way_agrees(&ball(""), 1e-8);
    let u = (1.6_f64.powi(2) + 0.5_f64.powi(2)).sqrt();
    near(time(&report, "table", EventKind::Sticks, 0), 2.0 * u / (7.0 * 0.3 * 9.81), 1e-11);
    let slip = column(&report, "bx").iter().zip(column(&report, "wy_ball")).map(|(v, w)| v - 0.05 * w);
    for (t, slip) in report.times.iter().zip(slip).filter(|(t, _)| **t > 0.2) {
        assert!(slip.abs() < 1e-14, "{t}: {slip}");
    }
    assert!(scene_passes("plane-contact-friction"));
}

fn scene_passes(name: &str) -> bool {
    run(&scene(name), &[]).summary.checks_passed()
}

/// A block on two feet on a slope; its weight points along `down` and into the slope.
fn block(mu: f64, slope: f64, extra: &str) -> String {
    let (x, y) = (9.81 * slope.sin(), -9.81 * slope.cos());
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]

[simulation]
gravity = [{x:?}, {y:?}, 0]
t_end = 1
output_step = 0.01
tolerance = 1e-10

[[body]]
name = "block"
mass = 2
inertia = [0.1, 0.1, 0.1]
position = [0, 0.1, 0]
{extra}

[[joint]]
name = "plane"
type = "planar"
bodies = ["ground", "block"]
point = [0, 0, 0]
axis = [0, 0, 1]

[[joint]]
name = "left"
type = "plane-contact"
bodies = ["ground", "block"]
frames = [{{ position = [0, 0, 0], axis = [0, 1, 0], x_axis = [1, 0, 0] }}, {{ position = [-0.2, -0.1, 0] }}]
params.mu = {mu:?}

[[joint]]
name = "right"
type = "plane-contact"
bodies = ["ground", "block"]
frames = [{{ position = [0, 0, 0], axis = [0, 1, 0], x_axis = [1, 0, 0] }}, {{ position = [0.2, -0.1, 0] }}]
params.mu = {mu:?}

[[output]]
name = "x"
quantity = "position"
of = "block"
component = "x"

[[output]]
name = "v"
quantity = "velocity"
of = "block"
component = "x"
"#
    )
}

#[test]
fn a_block_sticks_below_the_angle_of_friction_and_slides_above() {
    let report = run(&block(0.4, 0.4_f64.atan() - 1e-6, ""), &[]);
    assert!(column(&report, "x").iter().all(|x| x.abs() < 1e-14));
    let slope = 0.4_f64.atan() + 1e-3;
    let report = every_way_agrees(&block(0.4, slope, ""), 1e-8);
    let a = 9.81 * (slope.sin() - 0.4 * slope.cos());
    for (t, x) in report.times.iter().zip(column(&report, "x")) {
        near(*x, 0.5 * a * t * t, 1e-11);
    }
    // Thrown up a slope on which it is held: it stops, and stays.
    // Which of its feet holds it, and how much, rigid bodies do not tell.
    let a = 9.81 * (0.5_f64.sin() + 0.8 * 0.5_f64.cos());
    for sets in [
        &[][..],
        &["simulation.formulation=\"cartesian\""],
        &["simulation.method=\"radau5\""],
        &["simulation.method=\"dopri5\""],
    ] {
        let report = run(&block(0.8, 0.5, "velocity = [-1, 0, 0]"), sets);
        let sticks = report.events.iter().find(|event| event.kind == EventKind::Sticks).unwrap();
        near(sticks.time, 1.0 / a, 1e-10);
        for x in report.times.iter().zip(column(&report, "x")).filter(|(t, _)| **t > 1.0 / a).map(|(_, x)| x) {
            near(*x, -0.5 / a, 1e-10);
        }
    }
}

/// A rod that strikes a plane with its end.
fn rod(mu: f64, restitution: f64, angle: f64, velocity: [f64; 2]) -> String {
    let (x, y) = (0.5 * angle.cos(), 0.5 * angle.sin());
    let [vx, vy] = velocity;
    format!(
        r#"
[plugins]
libraries = ["odyn-joints"]

[simulation]
t_end = 0.5
output_step = 0.01
tolerance = 1e-10

[[body]]
name = "rod"
mass = 1
inertia = [1e-3, "1 / 12", "1 / 12"]
position = [{x:?}, {:?}, 0]
orientation = {{ axis = [0, 0, 1], angle = {angle:?} }}
velocity = [{vx:?}, {vy:?}, 0]

[[joint]]
name = "end"
type = "plane-contact"
bodies = ["ground", "rod"]
frames = [{{ position = [0, 0, 0], axis = [0, 1, 0] }}, {{ position = [-0.5, 0, 0] }}]
params.mu = {mu:?}
params.restitution = {restitution:?}

[[output]]
name = "w"
quantity = "angular_velocity"
of = "rod"
component = "z"
"#,
        y + 0.1
    )
}

#[test]
fn no_impact_with_friction_gains_energy() {
    let (mut seen, mut paradoxes) = (0, 0);
    for mu in [0.05, 0.3, 0.7, 1.5] {
        for e in [0.0, 0.5, 1.0] {
            for angle in [0.3, 0.8, 1.2, 1.9, 2.6] {
                for vx in [-2.0, -0.3, 0.4, 3.0] {
                    let report = try_run(&rod(mu, e, angle, [vx, -1.0]), &[], None).unwrap();
                    // What is left sliding on the plane may have no reaction, or several.
                    paradoxes += u64::from(report.summary.reason.contains("Painleve"));
                    assert!(report.exit_code() == 0 || report.summary.reason.contains("Painleve"));
                    let audit = &report.summary.audit;
                    assert!(audit.energy_error_relative < 1e-10, "{mu} {e} {angle} {vx}: {audit:?}");
                    for event in report.events.iter().filter(|event| event.kind == EventKind::Impact) {
                        assert!(event.lost >= 0.0 && event.impulse > 0.0, "{event:?}");
                        seen += 1;
                    }
                }
            }
        }
    }
    assert!(seen >= 200 && paradoxes < 30, "{seen}, {paradoxes}");
}

#[test]
fn what_friction_does_not_go_with_is_refused() {
    for (sets, parts) in [
        (
            &["simulation.fixed_step=0.01"][..],
            ["ODY0320", "`clutch` holds up to a limit: steps of a fixed size cannot"],
        ),
        (&["simulation.engine=\"reference\""], ["ODY0320", "`reference` knows no rows that slide"]),
    ] {
        let error = try_run(&scene("clutch"), sets, None).unwrap_err();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
    // A capacity below zero that nothing changes.
    let fixed = scene("clutch").replace("params.capacity", "params.capacity = -1 #");
    let report = try_run(fixed.split_once("[[check]]").unwrap().0, &[], None).unwrap();
    assert_eq!(report.exit_code(), 6);
    assert!(report.summary.reason.contains("`clutch: spin` holds is -1"), "{}", report.summary.reason);
    let error = try_run(&ball("").replace("params.mu = \"mu\"", "params.mu = 0.1\nparams.rough = true"), &[], None);
    assert!(error.unwrap_err().contains("does not slide"));
}

/// A brake whose capacity is below zero from 0.1 s to 0.15 s is none then, also where no step ends there. Steps of tolerance 1e-5 went over it,
/// and the brake drove the disc.
#[test]
fn a_capacity_below_zero_between_steps_is_none() {
    let text = "title = \"dip\"\nplugins.libraries = [\"odyn-joints\"]\n[simulation]\nt_end = 0.3\noutput_step = 0.1\n\
                [[body]]\nname = \"disc\"\nmass = 1\ninertia = [1, 1, 1]\nangular_velocity = [0, 0, 1]\n\
                [[joint]]\nname = \"bearing\"\ntype = \"revolute\"\nbodies = [\"ground\", \"disc\"]\naxis = [0, 0, 1]\n\
                [[joint]]\nname = \"brake\"\ntype = \"clutch\"\nbodies = [\"ground\", \"disc\"]\naxis = [0, 0, 1]\n\
                params.capacity = \"100 * (t - 0.1) * (t - 0.15)\"\n\
                [[output]]\nname = \"w\"\nquantity = \"coordinate_rate\"\nof = \"bearing\"\n";
    let impulse = |t: f64| 100.0 * (t * t * t / 3.0 - 0.125 * t * t + 0.015 * t);
    let exact = 1.0 - impulse(0.1) - (impulse(0.3) - impulse(0.15));
    for method in ["dop853", "dopri5", "radau5"] {
        for tolerance in ["1e-10", "1e-5"] {
            let sets = [format!("simulation.tolerance={tolerance}"), format!("simulation.method=\"{method}\"")];
            let report = try_run(text, &sets.each_ref().map(String::as_str), None).unwrap();
            assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
            let off = column(&report, "w")[3] - exact;
            assert!(off.abs() < 1e-9, "{method} at {tolerance}: {off:e}");
        }
    }
}

#[test]
fn a_run_is_brought_back_with_what_slides() {
    for (name, at, end) in
        [("clutch", 0.2, 3.8), ("clutch", 1.0, 3.8), ("dry-friction", 1.7, 4.0), ("plane-contact-friction", 0.1, 1.0)]
    {
        let scratch = Scratch::new();
        let path = scratch.file("scene.toml", scene(name));
        let start = || Session::open(&path, &options(&[], &[])).unwrap().prepare().unwrap().start().unwrap();
        let mut whole = start();
        whole.advance(at).unwrap();
        let saved = whole.save().unwrap();
        whole.advance(end).unwrap();
        let mut again = start();
        again.restore(&saved).unwrap();
        again.advance(end).unwrap();
        let of = |run: &odyn::session::Run<'_>| {
            run.samples().columns.iter().map(|column| column.last().unwrap().to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(of(&whole), of(&again), "{name} at {at}");
    }
}

/// A pendulum with a brake that strikes a stop.
const BRAKED: &str = r#"
[plugins]
libraries = ["odyn-joints"]

[simulation]
gravity = [0, -9.81, 0]
t_end = 3
output_step = 0.01
tolerance = 1e-10

[[body]]
name = "arm"
mass = 1
inertia = [0.01, 0.01, 0.01]
position = [0.5, 0, 0]

[[body]]
name = "flap"
mass = 0.5
inertia = [0.01, 0.01, 0.01]
position = [1.2, 0, 0]

[[joint]]
name = "pivot"
type = "revolute"
bodies = ["ground", "arm"]
point = [0, 0, 0]
axis = [0, 0, 1]

[[joint]]
name = "hinge"
type = "revolute"
bodies = ["arm", "flap"]
point = [1, 0, 0]
axis = [0, 0, 1]

[[joint]]
name = "stiff"
type = "dry-friction"
bodies = ["arm", "flap"]
point = [1, 0, 0]
axis = [0, 0, 1]
params.torque = 0.8

[[joint]]
name = "brake"
type = "clutch"
bodies = ["ground", "arm"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.capacity = "3 * max(0, min(1, t - 1))"

[[joint]]
name = "stop"
type = "rotational-stop"
bodies = ["ground", "arm"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.lower = -1.2
params.restitution = 0.5

[[output]]
name = "arm"
quantity = "coordinate"
of = "pivot"
channel = "angle"

[[output]]
name = "flap"
quantity = "coordinate"
of = "hinge"
channel = "angle"

[[output]]
name = "torque"
quantity = "reaction_torque"
of = "stiff"
on = "flap"
component = "z"
"#;

#[test]
fn impacts_let_what_sticks_slip() {
    let report = every_way_agrees(BRAKED, 1e-7);
    let first = report.events.iter().position(|event| event.kind == EventKind::Impact).unwrap();
    let at = report.events[first].time;
    assert!(report.events.iter().any(|e| e.element == "stiff" && e.kind == EventKind::Slides && e.time == at));
    assert!(column(&report, "torque").iter().all(|torque| torque.abs() <= 0.8 + 1e-12));
    assert!(report.summary.audit.energy_error_relative < 1e-9, "{:?}", report.summary.audit);
}

/// Two balls of 0.2 kg and 3 cm that meet obliquely; `friction` is a parameter of the contact.
fn billiards(friction: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
t_end = 1
output_step = 0.1
tolerance = 1e-11
[[body]]
name = "cue"
mass = 0.2
inertia = [7.2e-5, 7.2e-5, 7.2e-5]
position = [-0.5, -0.036, 0.02]
velocity = [2, 0, 0]
angular_velocity = [3, 10, -20]
[[body]]
name = "object"
mass = 0.2
inertia = [7.2e-5, 7.2e-5, 7.2e-5]
[[joint]]
name = "click"
type = "ball-contact"
bodies = ["cue", "object"]
frames = [{{ position = [0, 0, 0] }}, {{ position = [0, 0, 0] }}]
params = {{ radius_i = 0.03, radius_j = 0.03, restitution = 0.9{friction} }}
"#
    ) + &["cue", "object"]
        .iter()
        .flat_map(|body| ["velocity", "angular_velocity"].map(|quantity| (*body, quantity)))
        .flat_map(|(body, quantity)| ["x", "y", "z"].map(|component| (body, quantity, component)))
        .map(|(body, quantity, component)| {
            format!(
                "[[output]]\nname = \"{body}_{quantity}_{component}\"\nquantity = \"{quantity}\"\nof = \"{body}\"\n\
                 component = \"{component}\"\n"
            )
        })
        .collect::<String>()
}

/// A ball that sticks in an impact gives a seventh of the relative mass times the slip, one that slides mu times the normal impulse.
#[test]
fn balls_that_strike_obliquely_stick_or_slide() {
    use nalgebra::Vector3;
    let (m, r, moment) = (0.2, 0.03, 7.2e-5);
    let (v, spin) = (Vector3::new(2.0, 0.0, 0.0), Vector3::new(3.0, 10.0, -20.0));
    let (y, z) = (0.036_f64, -0.02_f64);
    let n = Vector3::new((0.06_f64.powi(2) - y * y - z * z).sqrt(), y, z) / 0.06;
    // Of the second ball's surface against the first's.
    let slip = -(v - n * n.dot(&v) + spin.cross(&(n * r)));
    let normal = 0.5 * m * 1.9 * n.dot(&v);
    let sticking = slip.norm() / (2.0 / m + 2.0 * r * r / moment);
    for (friction, limit) in
        [("", 0.0), (", mu = 0.05", 0.05 * normal), (", mu = 0.8", 0.8 * normal), (", rough = true", f64::INFINITY)]
    {
        let report = every_way_agrees(&billiards(friction), 1e-9);
        let along = -slip / slip.norm() * sticking.min(limit);
        // On the second ball.
        let impulse = n * normal + along;
        let turn = (-n * r).cross(&along) / moment;
        let expected = [v - impulse / m, spin + (n * r).cross(&-along) / moment, impulse / m, turn];
        let names = ["cue_velocity", "cue_angular_velocity", "object_velocity", "object_angular_velocity"];
        for (name, expected) in names.iter().zip(expected) {
            for (axis, expected) in ["x", "y", "z"].iter().zip(expected.iter()) {
                near(*column(&report, &format!("{name}_{axis}")).last().unwrap(), *expected, 1e-9);
            }
        }
    }
    assert!(sticking > 0.05 * normal && sticking < 0.8 * normal);
}

/// A ball that rolls down another one without sliding leaves it where cos(theta) = 10 / 17 of where it began.
#[test]
fn a_ball_rolls_off_another_one() {
    let text = r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.02
tolerance = 1e-10
[[body]]
name = "ball"
mass = 0.5
inertia = [8e-5, 8e-5, 8e-5]
position = ["0.32 * sin(0.3)", 0, "0.32 * cos(0.3)"]
[[joint]]
name = "touch"
type = "ball-contact"
bodies = ["ground", "ball"]
frames = [{ position = [0, 0, 0] }, { position = [0, 0, 0] }]
params = { radius_i = 0.3, radius_j = 0.02, FRICTION }
[[output]]
name = "vx"
quantity = "velocity"
of = "ball"
component = "x"
[[output]]
name = "wy"
quantity = "angular_velocity"
of = "ball"
component = "y"
"#;
    let report = every_way_agrees(&text.replace("FRICTION", "rough = true"), 1e-7);
    let cos = 10.0 / 17.0 * 0.3_f64.cos();
    let speed = (9.81 * 0.32 * cos).sqrt();
    assert!(report.events.iter().any(|event| event.kind == EventKind::Opens), "{:?}", report.events);
    near(*column(&report, "vx").last().unwrap(), speed * cos, 1e-7);
    near(*column(&report, "wy").last().unwrap(), speed / 0.02, 1e-5);
    // With little friction it slides before, and turns more slowly.
    let sliding = every_way_agrees(&text.replace("FRICTION", "mu = 0.2"), 1e-6);
    time(&sliding, "touch", EventKind::Slides, 0);
    assert!(*column(&sliding, "wy").last().unwrap() < 0.9 * speed / 0.02);
    assert!(sliding.summary.audit.energy_error_relative < 1e-7, "{:?}", sliding.summary.audit);
}

/// A released brake, and one that holds next to nothing, on a rotor at rest that a torque begins to turn late in the run: the limit was passed
/// within what times can be told apart by, and the run ended there.
#[test]
fn a_brake_gives_way_to_a_torque_that_sets_in_late() {
    let text = |capacity: f64, inertia: f64, slope: f64, since: f64, lasts: f64| {
        format!(
            "title = \"late\"\nplugins.libraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\nt_end = {:?}\noutput_step = {:?}\n\
             [[body]]\nname = \"rotor\"\nmass = 1\ninertia = [{inertia:?}, {inertia:?}, {inertia:?}]\n\
             [[joint]]\nname = \"bearing\"\ntype = \"revolute\"\nbodies = [\"ground\", \"rotor\"]\naxis = [0, 0, 1]\n\
             [[joint]]\nname = \"brake\"\ntype = \"clutch\"\nbodies = [\"ground\", \"rotor\"]\naxis = [0, 0, 1]\n\
             params.capacity = {capacity:?}\n\
             [[force]]\nname = \"motor\"\ntype = \"rotational-actuator\"\nbodies = [\"ground\", \"rotor\"]\naxis = [0, 0, 1]\n\
             params.of_time = {{ points = [[0, 0], [{since:?}, 0], [{:?}, {:?}]], interpolation = \"linear\" }}\n\
             [[output]]\nname = \"w\"\nquantity = \"coordinate_rate\"\nof = \"bearing\"\n",
            since + lasts,
            since + lasts,
            since + 20.0,
            20.0 * slope
        )
    };
    for (capacity, inertia, slope, since, lasts) in [
        (0.0, 1e3, 1e4, 50.0, 10.0),
        (1e-3, 1e3, 1e4, 50.0, 10.0),
        (0.0, 1e-3, 10.0, 100.0, 0.1),
        (1e-6, 1e-3, 10.0, 100.0, 0.1),
        (5.0, 1e3, 1e4, 50.0, 10.0),
    ] {
        for method in ["dop853", "radau5"] {
            for formulation in ["joint", "cartesian"] {
                let sets =
                    [format!("simulation.method=\"{method}\""), format!("simulation.formulation=\"{formulation}\"")];
                let report =
                    try_run(&text(capacity, inertia, slope, since, lasts), &sets.each_ref().map(String::as_str), None)
                        .unwrap();
                assert_eq!(report.exit_code(), 0, "{capacity} {inertia}: {}", report.summary.reason);
                // It slides from where the torque is the capacity.
                let slides = lasts - capacity / slope;
                let exact = slope * slides * slides / 2.0 / inertia;
                near(column(&report, "w")[1] / exact, 1.0, 1e-9);
                near(time(&report, "brake", EventKind::Slides, 0), since + capacity / slope, 1e-8);
            }
        }
    }
}

/// A rotor of 2 kg m^2 at 1 rad/s (or less, so that it turns a hundred rad) that a brake stops, or that a motor takes up with another one by way of a freewheel: so late, for how quickly
/// that is done, that the last change of speed is more than times can be told apart by.
#[test]
fn brakes_and_freewheels_act_however_late_and_quickly() {
    let text = |more: &str, (late, until, spin): (f64, f64, f64)| {
        let body = |name: &str, spin: f64| {
            format!(
                "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 2]\nangular_velocity = [0, 0, {spin:?}]\n\
                 [[joint]]\nname = \"bearing_{name}\"\ntype = \"revolute\"\nbodies = [\"ground\", \"{name}\"]\naxis = [0, 0, 1]\n\
                 [[output]]\nname = \"{name}\"\nquantity = \"coordinate_rate\"\nof = \"bearing_{name}\"\n"
            )
        };
        format!(
            "[plugins]\nlibraries = [\"joints\", \"forces\", \"controls\"]\n[simulation]\nt_end = {until:?}\noutput_step = {until:?}\n\
             tolerance = 1e-9\n{}{}{more}[[output]]\nname = \"angle\"\nquantity = \"coordinate\"\nof = \"bearing_b\"\n",
            body("a", 0.0),
            body("b", spin)
        )
        .replace("LATE", &format!("{late:?}"))
    };
    for (late, quick, lasts) in [
        (1.0, 1e6, 1.0),
        (1.0, 1e8, 1.0),
        (1000.0, 1e4, 1.0),
        (86400.0, 5.0, 1.0),
        (86400.0, 100.0, 1.0),
        // Early in a long run, whose last step is known to as much.
        (1.0, 1e6, 3e3),
    ] {
        let (until, spin) = (late + lasts, f64::min(100.0 / late, 1.0));
        let torque = 2.0 * spin * quick;
        let by_time = "signal-source\"\nparams.function = { points = [[0, 0], [LATE, 1]], interpolation = \"steps\" }";
        let by_angle = "relay\"\ninputs.input = \"angle\"\nparams = { lower = 0, upper = 1, on = 1, off = 0 }";
        let brake = |bolt: &str| {
            format!(
                "[[control]]\nname = \"bolt\"\ntype = \"{bolt}\n\
                 [[joint]]\nname = \"brake\"\ntype = \"clutch\"\nbodies = [\"ground\", \"b\"]\naxis = [0, 0, 1]\nparams.capacity = 0\n\
                 inputs.engagement = {{ signal = \"bolt.output\", gain = \"{torque:?} N m\" }}\n"
            )
        };
        let freewheel = format!(
            "[[joint]]\nname = \"freewheel\"\ntype = \"freewheel\"\nbodies = [\"a\", \"b\"]\naxis = [0, 0, 1]\n\
             [[force]]\nname = \"motor\"\ntype = \"rotational-actuator\"\nbodies = [\"ground\", \"a\"]\naxis = [0, 0, 1]\n\
             params.of_time = {{ points = [[0, 0], [LATE, {torque:?}], [{:?}, 0]], interpolation = \"steps\" }}\n",
            late + 2.0 / quick
        );
        let known = 1e-8 + quick * 4.0 * f64::EPSILON * late;
        for formulation in ["joint", "cartesian"] {
            let last = |more: &str| {
                let sets = &[&*format!("simulation.formulation=\"{formulation}\"")];
                let report = run(&text(more, (late, until, spin)), sets);
                ["a", "b", "angle"].map(|name| *column(&report, name).last().unwrap())
            };
            // It stops within 1 / quick, and turns by half as much as it would meanwhile.
            for bolt in [by_time, by_angle].iter().take(if late == 1.0 { 2 } else { 1 }) {
                let [_, b, angle] = last(&brake(bolt));
                near(b, 0.0, 1e-12);
                near(angle, spin * (late + 0.5 / quick), 1e-8);
            }
            // Half of the time takes one of them to the speed of the other, the rest both to half as much again.
            let [a, b, _] = last(&freewheel);
            near(a, b, 1e-12);
            near(b / spin, 1.5, known);
        }
    }
}

/// Two feet on vertical springs under a chassis in a plane, one of which lands first: tied together, they hardly move against each other
/// (8.6e-6 m/s), however fast the chassis turns on them (0.019 rad/s). Taken for an error, ending that motion took impulses of 11 920 N s along
/// the ground and pulled one of the feet down.
#[test]
fn feet_that_are_tied_together_land_one_after_the_other() {
    let mut text = String::from(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n\
         [simulation]\ngravity = [0, 0, -9.81]\nt_end = 0.2\noutput_step = 0.01\n\
         [[body]]\nname = \"c\"\nmass = 200\ninertia = [100, 100, 100]\nposition = [0, 0, 1]\n\
         [[joint]]\nname = \"plane\"\ntype = \"planar\"\nbodies = [\"ground\", \"c\"]\npoint = [0, 0, 1]\naxis = [0, 1, 0]\n\
         [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"c\"\ncomponent = \"x\"\n\
         [[output]]\nname = \"T\"\nquantity = \"reaction_force\"\nof = \"t0\"\ncomponent = \"x\"\n",
    );
    for (k, x, z) in [(0, -0.5, 0.35), (1, 0.5, 0.37)] {
        text += &format!(
            "[[body]]\nname = \"w{k}\"\nmass = 10\ninertia = [0.3, 0.3, 0.5]\nposition = [{x:?}, 0, {z:?}]\n\
             [[joint]]\nname = \"s{k}\"\ntype = \"translational\"\nbodies = [\"c\", \"w{k}\"]\npoint = [{x:?}, 0, {z:?}]\n\
             [[force]]\nname = \"k{k}\"\ntype = \"translational-spring-damper\"\nbodies = [\"c\", \"w{k}\"]\n\
             points = [[{x:?}, 0, 1], [{x:?}, 0, {z:?}]]\nparams = {{ stiffness = 20000, damping = 1500, free_length = 0.7 }}\n\
             [[joint]]\nname = \"t{k}\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"w{k}\"]\n\
             points = [[{x:?}, 0, 0], [{x:?}, 0, {z:?}]]\nparams = {{ radius = 0.3, mu = 0.5 }}\n"
        );
    }
    let of = |tolerance: &str| {
        let report = try_run(&text, &[&format!("simulation.tolerance={tolerance}")], None).unwrap();
        let events = report.events.iter();
        let impacts: Vec<f64> =
            events.filter(|event| event.kind == EventKind::Impact).map(|event| event.impulse).collect();
        let last = |name: &str| *column(&report, name).last().unwrap();
        (last("x"), last("T"), impacts)
    };
    // All impulses of an impact on a foot that is at rest already, where t1 sticks and t0 begins to slide: (0, 10.722) N s.
    for (tolerance, places) in [("1e-6", 1e-6), ("1e-9", 1e-8)] {
        let (x, force, impacts) = of(tolerance);
        near(x, 1.889_075_266e-3, 1e-3 * places);
        near(force, 692.024_307, 1e3 * places);
        assert!(impacts.len() == 2 && impacts.iter().all(|impulse| *impulse > 9.0), "{tolerance}: {impacts:?}");
        near(impacts[1], 10.722_368_6, 1e-5);
    }
}

/// A body on a hinge that a second joint locks, with friction or a freewheel about the hinge, while another swings on it: velocities of
/// round-off are none, wherever all that is.
#[test]
fn what_other_joints_lock_neither_slides_nor_closes() {
    for k in 1..=8 {
        let x = f64::from(k);
        let [a, b, c] = [(1.7 * x + 0.3).sin(), (2.3 * x + 0.1).cos(), (0.9 * x + 1.1).sin()];
        let [px, py, pz] = [0.3 * b, -0.2 * c, 0.5 * a];
        let body = |name: &str, [x, y, z]: [f64; 3], axis: [f64; 3], angle: f64| {
            format!(
                "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [{x:?}, {y:?}, {z:?}]\n\
                 orientation = {{ axis = {axis:?}, angle = {angle:?} }}\n"
            )
        };
        let on = |table: &str, name: &str, kind: &str, bodies: [&str; 2], point: [f64; 3], axis: [f64; 3]| {
            format!(
                "[[{table}]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = {bodies:?}\npoint = {point:?}\naxis = {axis:?}\n"
            )
        };
        let machine = body("b0", [a, b, c], [b, c, a], 0.7 * x)
            + &body("b1", [c, a, b], [c, a, b], 0.4 * x)
            + &on("joint", "hinge", "revolute", ["ground", "b0"], [px, py, pz], [a, b, c])
            + &on(
                "joint",
                "lock",
                "spherical",
                ["b0", "ground"],
                [px + 1.1 * c + 0.2, py - 0.7 * a, pz + 0.4 * b],
                [a, b, c],
            )
            + &on("joint", "swing", "revolute", ["b0", "b1"], [c, b, a], [c, a, b])
            + &on("force", "motor", "rotational-actuator", ["b0", "b1"], [c, b, a], [c, a, b])
            + "params.of_time = 2\n"
            + "[[output]]\nname = \"T\"\nquantity = \"reaction_torque\"\nof = \"held\"\non = \"b0\"\ncomponent = \"magnitude\"\n";
        for (kind, params) in [("dry-friction", "params.torque = 2\n"), ("freewheel", "")] {
            let held = on("joint", "held", kind, ["ground", "b0"], [px, py, pz], [a, b, c]) + params;
            for formulation in ["joint", "cartesian"] {
                let text = format!(
                    "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 0.1\n\
                     output_step = 0.05\nformulation = \"{formulation}\"\n{machine}{held}"
                );
                let report = try_run(&text, &[], None).unwrap();
                assert_eq!(report.exit_code(), 0, "{k} {kind} {formulation}: {}", report.summary.reason);
                assert!(column(&report, "T").iter().all(|torque| *torque == 0.0), "{k} {kind} {formulation}");
            }
        }
    }
}

/// A push that turns, and reaches the limit of friction at 0.42 s: the speed begins as the square of time, and friction turns into its
/// direction the faster the slower it is. Stability limits the steps of `dop853` (46 664 at 1e-12, off by 33 tolerances at the end).
#[test]
fn sliding_in_a_plane_that_begins_slowly_takes_few_steps() {
    let text = "[plugins]\nlibraries = [\"joints\", \"forces\"]\n\
                [simulation]\ngravity = [0, 0, -10]\nt_end = 1\noutput_step = 0.01\n\
                [[body]]\nname = \"puck\"\nmass = 2\nparticle = true\n\
                [[joint]]\nname = \"table\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"puck\"]\npoint = [0, 0, 0]\n\
                axis = [0, 0, 1]\nparams.mu = 0.3\n\
                [[force]]\nname = \"push\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"puck\"]\npoint = [0, 0, 0]\n\
                params.x = \"10 * t / 0.7 * cos(3 * t)\"\nparams.y = \"10 * t / 0.7 * sin(3 * t)\"\n\
                [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"puck\"\ncomponent = \"x\"\n\
                [[output]]\nname = \"vy\"\nquantity = \"velocity\"\nof = \"puck\"\ncomponent = \"y\"\n";
    let exact = run(text, &["simulation.method=radau9", "simulation.tolerance=1e-12"]);
    for (tolerance, most) in [(1e-6, 90), (1e-8, 160), (1e-10, 330), (1e-12, 500)] {
        let report = run(text, &[&format!("simulation.tolerance={tolerance}")]);
        let steps = report.summary.steps + report.summary.rejected;
        assert!(steps < most, "{tolerance}: {steps} steps");
        for name in ["x", "vy"] {
            let off = difference(column(&report, name), column(&exact, name));
            assert!(off < 3.0 * tolerance, "{tolerance}: `{name}` is off by {off:.1e}");
        }
    }
}
