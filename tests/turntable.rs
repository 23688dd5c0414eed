//! What begins to slide on a table that spins up: the slower it slides, the faster its direction turns after the load, so that the
//! equations are as stiff as can be where sliding begins, and less and less so from there on.

use odyn::results::{EventKind, Status};
use odyn::session::RunReport;

use crate::contacts::run;
use crate::support::{bisected, column};

/// Slides from 1.84 s on.
const TEXT: &str = r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 4
output_step = 0.1
[[body]]
name = "table"
mass = 10
inertia = [1, 1, 2]
[[joint]]
name = "axle"
type = "revolute"
bodies = ["ground", "table"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "motor"
type = "rotation-driver"
bodies = ["ground", "table"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.angle = "0.25 * t^2"
[[body]]
name = "puck"
mass = 0.2
particle = true
position = [0.5, 0, 0]
[[joint]]
name = "on"
type = "plane-contact"
bodies = ["table", "puck"]
frames = [{ axis = [0, 0, 1] }, {}]
params.mu = 0.05
[[output]]
name = "x"
quantity = "position"
of = "puck"
component = "x"
[[output]]
name = "v"
quantity = "velocity"
of = "puck"
component = "x"
"#;

#[test]
fn implicit_methods_follow_what_begins_to_slide() {
    let exact = run(TEXT, &["simulation.tolerance=1e-12", "simulation.method=\"radau9\""]);
    let explicit = run(TEXT, &["simulation.tolerance=1e-9"]);
    let off = |report: &RunReport, other: &RunReport| {
        let one = |name| column(report, name).iter().zip(column(other, name)).map(|(a, b)| (a - b).abs());
        one("x").chain(one("v")).fold(0.0, f64::max)
    };
    assert!(off(&explicit, &exact) < 1e-8, "{:e}", off(&explicit, &exact));
    for formulation in ["joint", "cartesian"] {
        for (method, tolerance) in
            [("radau5", 1e-6), ("radau5", 1e-8), ("radau5", 1e-10), ("radau9", 1e-10), ("auto", 1e-6), ("auto", 1e-10)]
        {
            let sets = [
                format!("simulation.tolerance={tolerance:e}"),
                format!("simulation.method={method:?}"),
                format!("simulation.formulation={formulation:?}"),
            ];
            let report = run(TEXT, &sets.each_ref().map(String::as_str));
            let (off, evaluations) = (off(&report, &exact), report.summary.evaluations);
            assert!(off < 3.0 * tolerance, "{formulation} {method} {tolerance:e}: {off:e}");
            // Explicit steps at 1e-10: 70 000.
            assert!(evaluations < 6000, "{formulation} {method} {tolerance:e}: {evaluations}");
        }
    }
}

/// A surface that moves along y, or turns about z, by a drive, or, as heavy as that is strong, by itself.
fn surface(turns: bool, driven: bool, t_end: f64) -> String {
    let (joint, axis, drive, moves) = match turns {
        true => ("revolute", "[0, 0, 1]", ("rotation-driver", "angle = \"2 * t\""), "angular_velocity = [0, 0, 2]"),
        false => {
            ("translational", "[0, 1, 0]", ("displacement-driver", "displacement = \"t\""), "velocity = [0, 1, 0]")
        }
    };
    let ((drive, how), own) = (drive, if driven { "" } else { moves });
    let drive = format!(
        "[[joint]]\nname = \"drive\"\ntype = \"{drive}\"\nbodies = [\"ground\", \"table\"]\npoint = [0, 0, 0]\naxis = {axis}\nparams.{how}\n"
    );
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
gravity = [0, 0, -9.81]
t_end = {t_end:?}
output_step = 0.01
[[body]]
name = "table"
mass = 1e9
inertia = [1e9, 1e9, 1e9]
{own}
[[joint]]
name = "way"
type = "{joint}"
bodies = ["ground", "table"]
point = [0, 0, 0]
axis = {axis}
{}
"#,
        if driven { drive.as_str() } else { "" }
    )
}

/// What joints keep from following the surface across: a particle in a plane, a ball, an arm on a hinge; where it is, how fast, and what
/// contact and restitution do.
fn kept(what: &str, place: f64, [height, speed]: [f64; 2], load: f64, contact: &str) -> String {
    let (body, joint, point) = match what {
        "particle" => ("particle = true", "type = \"point-in-plane\"", "{}"),
        "ball" => ("inertia = [0.01, 0.01, 0.01]", "type = \"planar\"", "{}"),
        "arm" => {
            let hinge = "type = \"revolute\"\npoint = [0, 0, 0.1]";
            ("inertia = [0.02, 0.02, 0.02]", hinge, "{ position = [0.2, 0, -0.1] }")
        }
        _ => unreachable!("{what}"),
    };
    format!(
        r#"
[[body]]
name = "kept"
mass = 1
{body}
position = [{place:?}, 0, {height:?}]
velocity = [{speed:?}, 0, 0]
[[joint]]
name = "guide"
{joint}
bodies = ["ground", "kept"]
axis = [0, 1, 0]
[[joint]]
name = "on"
type = "plane-contact"
bodies = ["table", "kept"]
frames = [{{ axis = [0, 0, 1] }}, {point}]
{contact}
[[force]]
name = "load"
type = "vector-force"
bodies = ["ground", "kept"]
params.x = {load:?}
[[output]]
name = "x"
quantity = "position"
of = "kept"
component = "x"
[[output]]
name = "z"
quantity = "position"
of = "kept"
component = "z"
[[output]]
name = "v"
quantity = "velocity"
of = "kept"
component = "x"
"#
    )
}

/// Where joints leave but one direction along a surface, which a drive moves across that, nothing that slides ever sticks: friction is against all
/// of the slip. A surface so heavy that it moves by itself says the same, of which no direction is taken away.
#[test]
fn what_joints_keep_from_following_a_driven_surface_slides_on_it() {
    let cases = [
        // Rests along x; begins to move there by less than friction could hold.
        ("particle", false, 0.0, [0.0, 0.0], 1.0, "params.mu = 0.4", 1.0),
        ("particle", false, 0.0, [0.2, 0.5], 0.0, "params = { mu = 0.2, restitution = 0.6 }", 0.3),
        ("particle", false, 0.0, [0.2, 5.0], 0.0, "params = { mu = 0.2, restitution = 0.6 }", 0.3),
        ("particle", false, 0.0, [0.2, 0.5], 0.0, "params = { mu = 0.2 }", 0.3),
        ("ball", false, 0.0, [0.3, 0.3], 0.0, "params = { radius = 0.1, mu = 0.5, restitution = 0.7 }", 0.6),
        ("ball", true, 0.5, [0.3, 0.0], 0.0, "params = { radius = 0.1, mu = 0.3 }", 0.6),
        ("arm", true, 0.3, [0.1, 0.0], 0.0, "params.mu = 0.3", 4.0),
    ];
    for (what, turns, place, motion, load, contact, t_end) in cases {
        let text = |driven: bool| surface(turns, driven, t_end) + &kept(what, place, motion, load, contact);
        let by_itself = run(&text(false), &[]);
        for formulation in ["joint", "cartesian"] {
            let set = format!("simulation.formulation={formulation:?}");
            let driven = run(&text(true), &[&set]);
            assert_eq!(driven.summary.status, Status::Completed, "{what} {contact}: {}", driven.summary.reason);
            for name in ["x", "z", "v"] {
                let pairs = column(&driven, name).iter().zip(column(&by_itself, name));
                let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 1e-7, "{what} {contact} {formulation}: {name} off by {off:e}");
            }
            if what == "arm" {
                // It slides from the start on, all round.
                let kinds: Vec<EventKind> = driven.events.iter().map(|event| event.kind).collect();
                assert_eq!(kinds, [EventKind::Closes, EventKind::Slides], "{:?}", driven.events);
            }
        }
    }
}

/// The first of these by its equation, m v' = F - mu m g v / |(v, 1)| (scipy's DOP853 at 1e-12).
#[test]
fn a_load_that_friction_could_hold_moves_what_slides_across() {
    let text = surface(false, true, 1.0) + &kept("particle", 0.0, [0.0, 0.0], 1.0, "params.mu = 0.4");
    let x = column(&run(&text, &[]), "x").last().copied().unwrap();
    assert!((x - 0.194_056_470_40).abs() < 1e-9, "{x}");
}

/// An impact on a surface that hardly moves across nearly ends the sliding; its direction hardly turns by projection, which took thousands of turns.
#[test]
fn impacts_turn_what_slides_slowly_across() {
    let (mu, restitution, height, speed) = (0.2, 0.6, 0.2, 0.5);
    for across in [1.0, 1e-3, 1e-6] {
        let contact = format!("params = {{ mu = {mu}, restitution = {restitution} }}");
        let text = surface(false, true, 0.3) + &kept("particle", 0.0, [height, speed], 0.0, &contact);
        let text = text.replace("displacement = \"t\"", &format!("displacement = \"{across:e} * t\""));
        let report = run(&text, &[]);
        assert_eq!(report.summary.status, Status::Completed, "{across:e}: {}", report.summary.reason);
        let impulse = (1.0 + restitution) * (2.0 * 9.81 * height).sqrt();
        let expected = bisected(0.0, speed, |v: f64| speed - v - mu * impulse * v / v.hypot(across));
        let found = column(&report, "v").last().copied().unwrap();
        assert!((found - expected).abs() < 1e-8 * speed, "{across:e}: {found:e}, expected {expected:e}");
    }
}
