//! What rests under loads over time: steps may have any size there, and nothing but the loads says when rows give way; and what rolls
//! freely until it meets something.

use std::fs;

use odyn::results::EventKind;

use crate::contacts::{every_way_agrees, run};
use crate::support::{column, difference, root};

/// A wheel with a clutch to the ground, which holds 1 N m, under a torque over time.
fn wheel(torque: &str, capacity: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
t_end = 8
output_step = 2
tolerance = 1e-10
[[body]]
name = "wheel"
mass = 1
inertia = [0.3, 0.3, 0.5]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "wheel"]
point = [0, 0, 0]
[[joint]]
name = "clutch"
type = "clutch"
bodies = ["ground", "wheel"]
point = [0, 0, 0]
params.capacity = "{capacity}"
[[force]]
name = "load"
type = "vector-torque"
bodies = ["ground", "wheel"]
params.z = "{torque}"
[[output]]
name = "angle"
quantity = "coordinate"
of = "bearing"
channel = "angle"
"#
    )
}

#[test]
fn a_load_that_passes_a_limit_for_a_moment_is_not_stepped_over() {
    for excess in [0.3, 0.1, 0.03] {
        let (size, speed): (f64, f64) = (1.0 + excess, 5.0);
        let report = every_way_agrees(&wheel(&format!("{size:?}*sin({speed:?}*t - 9)"), "1"), 1e-8);
        let slides: Vec<f64> =
            report.events.iter().filter(|event| event.kind == EventKind::Slides).map(|event| event.time).collect();
        // Either way round, half a turn after the other.
        let first = |turn: f64| (turn * std::f64::consts::PI + (1.0 / size).asin() + 9.0) / speed;
        let expected: Vec<f64> = (-9..).map(|turn| first(f64::from(turn))).skip_while(|t| *t < 0.0).take(2).collect();
        for (found, expected) in slides.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-10, "{excess}: {found} in place of {expected}");
        }
    }
}

#[test]
fn a_limit_that_falls_below_a_load_for_a_moment_is_not_stepped_over() {
    let report = every_way_agrees(&wheel("0.5", "1 + 0.51*sin(3*t)"), 1e-8);
    let slides = report.events.iter().find(|event| event.kind == EventKind::Slides).unwrap();
    let expected = (std::f64::consts::PI + (0.5_f64 / 0.51).asin()) / 3.0;
    assert!((slides.time - expected).abs() < 1e-10, "{} in place of {expected}", slides.time);
}

/// A crank whose end a rod holds in place, so that nothing moves, and a pendulum-like body that is free but not driven.
const STRUCTURE: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
t_end = 4
output_step = 0.1
tolerance = 1e-10
[[body]]
name = "crank"
mass = 3
inertia = [0.2, 0.3, 0.25]
position = [0.3, 0.7, 0.1]
[[body]]
name = "idle"
mass = 2
inertia = [0.2, 0.3, 0.25]
position = [2.3, 0.7, 0.1]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "crank"]
point = [0.1, 0.2, 0.3]
axis = [0.4, -0.5, 0.7]
[[joint]]
name = "rod"
type = "distance-rod"
bodies = ["ground", "crank"]
points = [[1.3, 0.4, 0.2], [0.5, 0.9, -0.2]]
params.length = "sqrt(0.64 + 0.25 + 0.16)"
[[joint]]
name = "pin"
type = "revolute"
bodies = ["ground", "idle"]
point = [2.1, 0.2, 0.3]
axis = [0.1, 0.5, 0.2]
[[force]]
name = "load"
type = "vector-force"
bodies = ["ground", "crank"]
frames = [{ position = [0, 0, 0] }, { position = [0.2, 0.1, 0.3] }]
params = { x = "40*sin(7*t)", y = "-90*sin(9*t)", z = "13*sin(5*t)" }
[[output]]
name = "pull"
quantity = "reaction_force"
of = "bearing"
component = "y"
"#;

#[test]
fn a_structure_under_loads_over_time_is_no_motion_with_an_energy() {
    let all: Vec<_> = ["joint", "cartesian"]
        .iter()
        .flat_map(|form| ["dop853", "radau5"].map(|method| (form, method)))
        .map(|(form, method)| {
            let sets = [format!("simulation.formulation=\"{form}\""), format!("simulation.method=\"{method}\"")];
            run(STRUCTURE, &[&sets[0], &sets[1]])
        })
        .collect();
    for report in &all {
        assert!(report.summary.steps < 100, "{} steps", report.summary.steps);
        for (a, b) in report.columns[0].iter().zip(&all[0].columns[0]) {
            assert!((a - b).abs() < 1e-10, "{a} {b}");
        }
    }
}

/// Three links in space, the last of which a freewheel locks to the one before.
const LOCKED: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [1, 2, -9.81]
t_end = 1
output_step = 0.1
tolerance = 1e-10
[[body]]
name = "upper"
mass = 3
inertia = [0.2, 0.3, 0.25]
position = [0.3, 0.7, 0.1]
[[body]]
name = "middle"
mass = 2
inertia = [0.1, 0.2, 0.15]
position = [0.9, 0.8, 0.2]
[[body]]
name = "lower"
mass = 1
inertia = [0.03, 0.04, 0.05]
position = [1.2, 1.1, 0.4]
[[joint]]
name = "shoulder"
type = "revolute"
bodies = ["ground", "upper"]
point = [0.1, 0.2, 0.3]
axis = [0.4, -0.5, 0.7]
[[joint]]
name = "elbow"
type = "universal"
bodies = ["upper", "middle"]
points = [[0.6, 0.8, 0.1], [0.6, 0.8, 0.1]]
axes = [[1, 0, 0], [0, 1, 0]]
[[joint]]
name = "wrist"
type = "revolute"
bodies = ["middle", "lower"]
point = [1.1, 0.9, 0.3]
axis = [0.2, 0.9, 0.3]
[[joint]]
name = "ratchet"
type = "freewheel"
bodies = ["lower", "middle"]
point = [1.1, 0.9, 0.3]
axis = [0.2, 0.9, 0.3]
[[output]]
name = "angle"
quantity = "coordinate"
of = "wrist"
channel = "angle"
"#;

#[test]
fn what_rows_hold_is_not_searched_for_changes() {
    for sets in [&[][..], &["simulation.method=\"radau5\""], &["simulation.formulation=\"cartesian\""]] {
        let report = run(LOCKED, sets);
        assert!(report.summary.enclosures > 0 && report.summary.unproven == 0, "{}", report.summary.unproven);
    }
}

#[test]
fn steps_of_few_stages_end_where_what_rolls_meets_something() {
    let text = fs::read_to_string(root().join("scenes/stress/barrier.toml")).unwrap();
    for k in 0..24 {
        let speed = format!("parameters.v={:?}", 1.7 + 1e-5 * f64::from(k));
        for method in ["radau5", "radau9"] {
            let method = format!("simulation.method=\"{method}\"");
            let report = run(&text, &["parameters.w=0.003", "parameters.high=1.5", &speed, &method]);
            let speeds = column(&report, "v_x");
            let off = (speeds[0] + speeds[speeds.len() - 1]).abs();
            assert!(off < 1e-9, "{speed} {method}: {off:.1e}");
        }
    }
}

/// A crank turns at 6 rad/s and swings a rocker, which drives a wheel by a freewheel; dry friction holds the wheel while the rocker
/// swings back. The freewheel closes at the dead centre of the rocker, where this stands still as the wheel does.
fn ratchet(drag: f64) -> String {
    let (crank, rod, rocker, base, angle): (f64, f64, f64, f64, f64) = (0.1, 0.4, 0.25, 0.4, 0.3);
    let [ax, ay] = [crank * angle.cos(), crank * angle.sin()];
    let [dx, dy] = [base - ax, -ay];
    let far = dx.hypot(dy);
    let along = (far * far + rod * rod - rocker * rocker) / (2.0 * far);
    let across = (rod * rod - along * along).sqrt();
    let [bx, by] = [ax + (along * dx - across * dy) / far, ay + (along * dy + across * dx) / far];
    let hinge = |name: &str, bodies: [&str; 2], [x, y]: [f64; 2]| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nbodies = {bodies:?}\npoint = [{x:?}, {y:?}, 0]\naxis = [0, 0, 1]\n"
        )
    };
    let body = |name: &str, [x, y]: [f64; 2]| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.02, 0.02, 0.02]\nposition = [{x:?}, {y:?}, 0]\n\
             velocity = [\"free\", \"free\", \"free\"]\nangular_velocity = [\"free\", \"free\", \"free\"]\n"
        )
    };
    let on_base = |name: &str, kind: &str, bodies: [&str; 2], params: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = {bodies:?}\npoint = [{base:?}, 0, 0]\naxis = [0, 0, 1]\n{params}\n"
        )
    };
    let speed = |name: &str, of: &str| {
        format!("[[output]]\nname = \"{name}\"\nquantity = \"angular_velocity\"\nof = \"{of}\"\ncomponent = \"z\"\n")
    };
    [
        "[plugins]\nlibraries = [\"joints\"]\n[simulation]\ngravity = [0, 0, 0]\nt_end = 2.5\noutput_step = 0.01\n".to_owned(),
        body("crank", [0.0, 0.0]),
        body("rod", [0.5 * (ax + bx), 0.5 * (ay + by)]),
        body("rocker", [base, 0.0]),
        body("wheel", [base, 0.0]).replace("angular_velocity = [\"free\", \"free\", \"free\"]\n", ""),
        hinge("shaft", ["ground", "crank"], [0.0, 0.0]),
        hinge("pin", ["crank", "rod"], [ax, ay]),
        hinge("eye", ["rod", "rocker"], [bx, by]),
        hinge("pivot", ["ground", "rocker"], [base, 0.0]),
        hinge("axle", ["ground", "wheel"], [base, 0.0]),
        "[[joint]]\nname = \"motor\"\ntype = \"rotation-driver\"\nbodies = [\"ground\", \"crank\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
             params.angle = \"6 * t\"\n"
            .to_owned(),
        on_base("drag", "dry-friction", ["ground", "wheel"], &format!("params.torque = {drag:?}")),
        on_base("hub", "freewheel", ["rocker", "wheel"], ""),
        speed("rocker", "rocker"),
        speed("wheel", "wheel"),
    ]
    .concat()
}

#[test]
fn a_freewheel_closes_at_a_dead_centre_of_what_drives_it() {
    // Friction that stops the wheel faster than the rocker ever slows down: one follows the other, or stands still.
    for sets in [&[][..], &["simulation.method=\"radau5\""], &["simulation.formulation=\"cartesian\""]] {
        let report = run(&ratchet(5.0), sets);
        assert_eq!(report.exit_code(), 0, "{sets:?}: {}", report.summary.reason);
        let [rocker, wheel] = ["rocker", "wheel"].map(|name| column(&report, name));
        for (t, (rocker, wheel)) in report.times.iter().zip(rocker.iter().zip(wheel)) {
            assert!((wheel - rocker.max(0.0)).abs() < 1e-6, "{sets:?}, t = {t}: {wheel} beside {rocker}");
        }
    }
    // Friction that is slower: the wheel runs on ahead.
    let report = run(&ratchet(0.5), &[]);
    assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
    let [rocker, wheel] = ["rocker", "wheel"].map(|name| column(&report, name));
    assert!(rocker.iter().zip(wheel).all(|(rocker, wheel)| *wheel > rocker - 1e-9 && *wheel > -1e-9));
}

/// A wheel that is driven strikes the tail of a hinged hammer with its pin, and lifts it on, until the hammer flies ahead: its motion is that of the
/// pin, whatever friction there is, and so is the time at which nothing presses any longer. There what friction depends on is
/// nothing beside what it is added to.
#[test]
fn a_lifted_hammer_leaves_its_pin_whatever_the_friction_is() {
    let hammer = |friction: &str| {
        format!(
            r#"
[plugins]
libraries = ["joints"]
[simulation]
gravity = [0, -9.81, 0]
t_end = 0.2
output_step = 0.005
tolerance = 1e-10
[[body]]
name = "wheel"
mass = 3
inertia = [0.05, 0.05, 0.05]
angular_velocity = [0, 0, -5.22]
[[body]]
name = "hammer"
mass = 2
inertia = [0.02, 0.02, 0.02]
position = [0.68, 0, 0]
[[joint]]
name = "pin"
type = "ball-contact"
bodies = ["wheel", "hammer"]
frames = [{{ position = [0.1755, 0.0959, 0] }}, {{ position = [-0.5, 0, 0] }}]
params = {{ radius_i = 0.015, radius_j = 0.015{friction} }}
[[joint]]
name = "shaft"
type = "revolute"
bodies = ["ground", "wheel"]
axis = [0, 0, 1]
[[joint]]
name = "motor"
type = "rotation-driver"
bodies = ["ground", "wheel"]
axis = [0, 0, 1]
params.angle = "-5.22 * t"
[[joint]]
name = "hinge"
type = "revolute"
bodies = ["ground", "hammer"]
point = [0.33, 0, 0]
axis = [0, 0, 1]
[[output]]
name = "height"
quantity = "position"
of = "hammer"
component = "y"
"#
        )
    };
    let leaves = |friction: &str| {
        let report = every_way_agrees(&hammer(friction), 1e-7);
        report.events.iter().find(|event| event.kind == EventKind::Opens).expect("it flies ahead").time
    };
    let smooth = leaves("");
    for friction in [", mu = 0.1", ", mu = 0.23"] {
        let time = leaves(friction);
        assert!((time - smooth).abs() < 1e-9, "{friction}: {time}, without friction {smooth}");
    }
}

/// Three shafts along z, a spring from the first to the second, a freewheel from there to the third, and a torque that begins with zero.
fn train(gravity: f64, further: &str) -> String {
    let shaft = |name: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n\
             [[joint]]\nname = \"bearing_{name}\"\ntype = \"revolute\"\nbodies = [\"ground\", \"{name}\"]\npoint = [0, 0, 0]\n\
             axis = [0, 0, 1]\n[[output]]\nname = \"{name}\"\nquantity = \"angular_velocity\"\nof = \"{name}\"\ncomponent = \"z\"\n"
        )
    };
    let between = |table: &str, kind: &str, bodies: [&str; 2], params: &str| {
        format!(
            "[[{table}]]\nname = \"{kind}\"\ntype = \"{kind}\"\nbodies = {bodies:?}\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n{params}\n"
        )
    };
    [
        format!(
            "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, 0, {gravity:?}]\nt_end = 0.3\n\
             output_step = 0.01\ntolerance = 1e-10\n"
        ),
        ["a", "b", "c"].map(shaft).concat(),
        between("force", "rotational-actuator", ["ground", "a"], "params.of_time = \"sin(3.4 * t)\""),
        between("force", "rotational-spring-damper", ["a", "b"], "params = { stiffness = 5000, damping = 0.026 }"),
        between("joint", "freewheel", ["b", "c"], ""),
        further.to_owned(),
    ]
    .concat()
}

/// Whether a freewheel is about to close does not depend on weights that bearings hold, nor on what falls elsewhere: measured by these, its
/// own accelerations were none for so long that steps ended 59 000 times.
#[test]
fn weights_that_others_hold_say_nothing_of_what_a_freewheel_does() {
    let light = run(&train(0.0, ""), &[]);
    let stone = "[[body]]\nname = \"stone\"\nmass = 1\nparticle = true\nposition = [0, 0, 9]\n";
    for (gravity, further) in [(-1.0, ""), (-9.81, ""), (-9.81, stone)] {
        for formulation in ["joint", "cartesian"] {
            let heavy = run(&train(gravity, further), &[&format!("simulation.formulation=\"{formulation}\"")]);
            for name in ["a", "b", "c"] {
                let off = difference(column(&light, name), column(&heavy, name));
                assert!(off < 1e-9, "{gravity} {formulation}: `{name}` differs by {off:.1e}");
            }
            let [steps, expected] = [&heavy, &light].map(|report| report.summary.steps);
            assert!(steps < expected + expected / 4, "{gravity} {formulation}: {steps} in place of {expected} steps");
        }
    }
}
