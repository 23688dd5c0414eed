//! Contacts that strike, rest and open: against closed forms, in both coordinates, by every method that chooses its steps.

use std::fs;
use std::path::Path;

use nalgebra::{Rotation3, Unit, Vector3};
use odyn::results::{EVENTS_FILE, Event, EventKind};
use odyn::session::{RunReport, Session};

use crate::support::{Scratch, column, difference, options};

/// Runs the text of a scene; a folder, where its results go.
pub(crate) fn try_run(text: &str, sets: &[&str], folder: Option<&Path>) -> Result<RunReport, String> {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", text);
    let session = Session::open(&path, &options(sets, &[])).map_err(|error| error.to_string())?;
    session.run(folder, Box::new(|_| ()), &Default::default()).map_err(|error| error.to_string())
}

#[track_caller]
pub(crate) fn run(text: &str, sets: &[&str]) -> RunReport {
    let report = try_run(text, sets, None).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(report.exit_code(), 0, "{} {:?}", report.summary.reason, report.summary.audit);
    report
}

fn impacts(report: &RunReport) -> Vec<&Event> {
    report.events.iter().filter(|event| event.kind == EventKind::Impact).collect()
}

/// All ways that choose their steps agree on what happens, and when, and on the motion.
#[track_caller]
pub(crate) fn every_way_agrees(text: &str, tolerance: f64) -> RunReport {
    let first = run(text, &[]);
    assert!(!first.events.is_empty());
    for sets in [
        &["simulation.formulation=\"cartesian\""][..],
        &["simulation.method=\"dopri5\""],
        &["simulation.method=\"radau5\""],
        &["simulation.method=\"auto\"", "simulation.engine=\"interpreted\""],
        &["simulation.formulation=\"cartesian\"", "simulation.method=\"radau5\""],
    ] {
        let other = run(text, sets);
        let what = |report: &RunReport| -> Vec<_> {
            report.events.iter().map(|event| (event.element.clone(), event.kind)).collect()
        };
        assert_eq!(what(&first), what(&other), "{sets:?}");
        for (a, b) in first.events.iter().zip(&other.events) {
            assert!((a.time - b.time).abs() < tolerance, "{sets:?}: {a:?} {b:?}");
        }
        for (channel, (a, b)) in first.channels.iter().zip(first.columns.iter().zip(&other.columns)) {
            let off = difference(a, b);
            assert!(off < tolerance, "{sets:?}: `{}` differs by {off:.1e}", channel.name);
        }
    }
    first
}

/// Pendulums whose balls touch at rest; the first one falls.
fn cradle() -> String {
    let mut text = String::from(
        "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\ngravity = [0, -9.81, 0]\nt_end = 4\noutput_step = 0.01\n\
         tolerance = 1e-10\n",
    );
    for k in 0..5 {
        let (pivot, angle) = (0.1 * f64::from(k), if k == 0 { -0.5_f64 } else { 0.0 });
        let (x, y) = (pivot + angle.sin(), -angle.cos());
        text += &format!(
            "[[body]]\nname = \"ball_{k}\"\nmass = 1\ninertia = [1e-3, 1e-3, 1e-3]\nposition = [{x:?}, {y:?}, 0]\n\
             [[joint]]\nname = \"string_{k}\"\ntype = \"revolute\"\nbodies = [\"ground\", \"ball_{k}\"]\npoint = [{pivot:?}, 0, 0]\n\
             axis = [0, 0, 1]\n[[output]]\nname = \"v{k}\"\nquantity = \"velocity\"\nof = \"ball_{k}\"\ncomponent = \"x\"\n"
        );
        if k > 0 {
            text += &format!(
                "[[joint]]\nname = \"click_{k}\"\ntype = \"ball-contact\"\nbodies = [\"ball_{}\", \"ball_{k}\"]\n\
                 frames = [{{ position = [0, 0, 0] }}, {{ position = [0, 0, 0] }}]\nparams.radius_i = 0.05\n\
                 params.radius_j = 0.05\nparams.restitution = 1.0\n",
                k - 1
            );
        }
    }
    text
}

#[test]
fn in_newtons_cradle_the_last_ball_leaves_with_the_speed_of_the_first() {
    let report = every_way_agrees(&cradle(), 1e-8);
    let speed = (2.0 * 9.81 * (1.0 - 0.5_f64.cos()) / 1.001).sqrt();
    let all = impacts(&report);
    // Swing after swing, each ball strikes the next at once.
    assert_eq!(all.len(), 4 * 4);
    for (number, swing) in all.chunks(4).enumerate() {
        let forth = number % 2 == 0;
        for (k, event) in swing.iter().enumerate() {
            assert_eq!(event.element, format!("click_{}", if forth { k + 1 } else { 4 - k }));
            assert_eq!(event.time, swing[0].time);
            assert!((event.rates[0] + speed).abs() < 1e-8, "{event:?}");
            assert!(event.lost.abs() < 1e-14);
        }
        assert!((swing[3].rates[1] - speed).abs() < 1e-8);
    }
    let audit = &report.summary.audit;
    assert!(audit.impacts == 16 && audit.lost_in_impacts < 1e-12 && audit.energy_error_relative < 1e-9, "{audit:?}");
}

/// A plank that touches the floor below its middle and at its end while it comes down turning, all turned about y by an angle; with a body far
/// away, or without.
fn plank(angle: f64, far: bool) -> String {
    let turned = |x: f64, z: f64| [x * angle.cos() + z * angle.sin(), 0.0, z * angle.cos() - x * angle.sin()];
    let [velocity, up, place] = [turned(0.0, -1.0), turned(0.0, 1.0), turned(0.0, 0.5)];
    let mut text = format!(
        "[plugins]\nlibraries = [\"joints\"]\n[simulation]\nt_end = 0.01\noutput_step = 0.01\n\
         [[body]]\nname = \"plank\"\nmass = 1\ninertia = [0.3, 0.3, 0.3]\nposition = {place:?}\n\
         orientation = {{ axis = [0, 1, 0], angle = {angle:?} }}\n\
         velocity = {velocity:?}\nangular_velocity = [0, 0.25, 0]\n\
         [[joint]]\nname = \"plane\"\ntype = \"planar\"\nbodies = [\"ground\", \"plank\"]\npoint = {place:?}\naxis = [0, 1, 0]\n\
         [[output]]\nname = \"spin\"\nquantity = \"angular_velocity\"\nof = \"plank\"\ncomponent = \"y\"\n"
    );
    for (name, x) in [("near", -0.1), ("end", 1.0)] {
        text += &format!(
            "[[joint]]\nname = {name:?}\ntype = \"plane-contact\"\nbodies = [\"ground\", \"plank\"]\n\
             frames = [{{ axis = {up:?} }}, {{ position = [{x:?}, 0, -0.5] }}]\nparams = {{ restitution = 0.5 }}\n"
        );
    }
    if far {
        text += "[[body]]\nname = \"far\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [10, 0, 3]\n";
    }
    text
}

#[test]
fn the_order_of_impacts_depends_on_nothing_that_has_no_part_in_them() {
    // Rates of the two points by the velocities of the plank, and these by impulses, that which takes more energy first.
    let (points, inverse) = ([-0.1, 1.0], [1.0, 1.0 / 0.3]);
    let (mut speed, mut spin) = (-1.0, 0.25);
    loop {
        let blow = |x: f64| (speed - x * spin) / (inverse[0] + inverse[1] * x * x).sqrt();
        let [near, end] = points.map(blow);
        if near.min(end) > -1e-12 {
            break;
        }
        let x = if near < end { points[0] } else { points[1] };
        let impulse = -1.5 * (speed - x * spin) / (inverse[0] + inverse[1] * x * x);
        (speed, spin) = (speed + inverse[0] * impulse, spin - inverse[1] * x * impulse);
    }
    for (angle, far) in [(0.0, false), (0.0, true), (0.8, false), (0.8, true)] {
        let report = run(&plank(angle, far), &[]);
        let found = *column(&report, "spin").last().expect("a sample");
        assert!((found - spin).abs() < 1e-9, "{angle} {far}: {found} {spin}");
    }
}

const BLOCK: &str = r#"
[plugins]
libraries = ["odyn-joints"]

[simulation]
gravity = [0, -9.81, 0]
t_end = 3
output_step = 0.01
tolerance = 1e-10

[parameters]
b = 0.1
h = 0.4
m = 1
phi = 0.1
I = "m / 3 * (b^2 + h^2)"

[[body]]
name = "block"
mass = "m"
inertia = ["I", "I", "I"]
position = ["b * cos(phi) - h * sin(phi)", "b * sin(phi) + h * cos(phi)", 0]
orientation = { axis = [0, 0, 1], angle = "phi" }

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
frames = [{ position = [0, 0, 0], axis = [0, 1, 0] }, { position = ["-b", "-h", 0] }]
params.rough = true

[[joint]]
name = "right"
type = "plane-contact"
bodies = ["ground", "block"]
frames = [{ position = [0, 0, 0], axis = [0, 1, 0] }, { position = ["b", "-h", 0] }]
params.rough = true

[[output]]
name = "phi"
quantity = "coordinate"
of = "plane"
channel = "angle"
"#;

#[test]
fn a_rocking_block_loses_what_housner_says() {
    let report = every_way_agrees(BLOCK, 1e-8);
    let all = impacts(&report);
    assert!(all.len() > 8);
    // The block turns about one corner, then about the other: Housner (1963), w' / w = 1 - 3/2 sin^2(alpha).
    let ratio = 1.0 - 1.5 * 0.01 / 0.17;
    for pair in all.windows(2) {
        assert_ne!(pair[0].element, pair[1].element);
        assert!((pair[1].rates[0] / pair[0].rates[0] - ratio).abs() < 1e-8, "{pair:?}");
        assert!(pair[0].rates[1].abs() < 1e-12);
    }
    // Each time one corner closes, the other opens.
    let switch = |event: &&Event| matches!(event.kind, EventKind::Closes | EventKind::Opens) && event.time > 0.0;
    let switches = report.events.iter().filter(switch);
    assert_eq!(switches.count(), 2 * all.len());
}

/// A ball on a table that is driven up and down.
const TABLE: &str = r#"
[plugins]
libraries = ["odyn-joints"]

[simulation]
gravity = [0, 0, -9.81]
t_end = 2
output_step = 0.01
tolerance = 1e-10

[[body]]
name = "table"
mass = 5
inertia = [1, 1, 1]

[[body]]
name = "ball"
mass = 0.2
inertia = [1e-4, 1e-4, 1e-4]
position = [0, 0, 0.03]
velocity = [0, 0, 1]

[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "table"]
point = [0, 0, 0]
axis = [0, 0, 1]

[[joint]]
name = "drive"
type = "displacement-driver"
bodies = ["ground", "table"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.displacement = "0.05 * sin(20 * t)"

[[joint]]
name = "contact"
type = "plane-contact"
bodies = ["table", "ball"]
frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0] }]
params.radius = 0.03
params.restitution = 0.4

[[output]]
name = "z"
quantity = "position"
of = "ball"
component = "z"

[[output]]
name = "N"
quantity = "reaction_force"
of = "contact"
on = "ball"
component = "z"
"#;

#[test]
fn a_ball_leaves_a_table_where_it_falls_faster_than_the_ball() {
    let report = every_way_agrees(TABLE, 1e-8);
    assert_eq!((report.events[0].kind, report.events[0].time), (EventKind::Closes, 0.0));
    let released = (9.81_f64 / 20.0).asin() / 20.0;
    let opens = &report.events[1];
    assert_eq!(opens.kind, EventKind::Opens);
    assert!((opens.time - released).abs() < 1e-9, "{opens:?}, expected {released}");
    let carried = report.times.iter().zip(column(&report, "N")).filter(|(t, _)| **t > 0.0 && **t < released);
    for (t, force) in carried {
        assert!((force - 0.2 * (9.81 - 20.0 * (20.0 * t).sin())).abs() < 1e-9, "{t}: {force}");
    }
    // Driven contacts do work: the balance of energies knows it.
    assert!(report.summary.audit.energy_error_relative < 1e-9, "{:?}", report.summary.audit);
}

/// Balls above each other, with a gap between them, that fall and come to rest on each other.
fn stack() -> String {
    let mut text = String::from(
        "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 2\noutput_step = 0.01\n",
    );
    for k in 0..3 {
        let below = if k == 0 { "ground".to_string() } else { format!("ball_{}", k - 1) };
        let (kind, frame, radii) = match k {
            0 => ("plane-contact", ", axis = [0, 0, 1]", "params.radius = 0.1"),
            _ => ("ball-contact", "", "params.radius_i = 0.1\nparams.radius_j = 0.1"),
        };
        text += &format!(
            "[[body]]\nname = \"ball_{k}\"\nmass = {}\ninertia = [1e-3, 1e-3, 1e-3]\nposition = [0, 0, {:?}]\n\
             [[joint]]\nname = \"guide_{k}\"\ntype = \"translational\"\nbodies = [\"ground\", \"ball_{k}\"]\npoint = [0, 0, 0]\n\
             axis = [0, 0, 1]\n[[joint]]\nname = \"contact_{k}\"\ntype = \"{kind}\"\nbodies = [\"{below}\", \"ball_{k}\"]\n\
             frames = [{{ position = [0, 0, 0]{frame} }}, {{ position = [0, 0, 0] }}]\n{radii}\nparams.restitution = 0.5\n\
             [[output]]\nname = \"N{k}\"\nquantity = \"reaction_force\"\nof = \"contact_{k}\"\non = \"ball_{k}\"\ncomponent = \"z\"\n",
            k + 1,
            0.3 + 0.25 * f64::from(k)
        );
    }
    text
}

#[test]
fn a_stack_comes_to_rest_and_carries_its_weight() {
    let report = every_way_agrees(&stack(), 1e-8);
    let last = |name: &str| *column(&report, name).last().unwrap();
    for (name, mass) in [("N0", 6.0), ("N1", 5.0), ("N2", 3.0)] {
        assert!((last(name) - 9.81 * mass).abs() < 1e-10, "{name} = {}", last(name));
    }
    // All that the balls had is lost.
    let audit = &report.summary.audit;
    let had = 9.81 * (0.2 + 2.0 * 0.25 + 3.0 * 0.3);
    assert!((audit.lost_in_impacts - had).abs() < 1e-6 * had, "{audit:?}, had {had}");
    assert!(audit.kinetic_energy < 1e-20 && audit.energy_error_relative < 1e-8);
}

#[test]
fn bouncing_comes_to_an_end_at_every_tolerance() {
    let scene = fs::read_to_string(crate::support::root().join("scenes/verification/plane-contact.toml")).unwrap();
    for tolerance in ["1e-4", "1e-7", "1e-13"] {
        let report = run(&scene, &[&format!("simulation.tolerance={tolerance}")]);
        assert!(report.summary.checks_passed(), "{tolerance}");
        assert!(impacts(&report).len() < 80, "{tolerance}");
    }
}

#[test]
fn what_contacts_do_not_go_with_is_refused() {
    let table = |change: (&str, &str)| TABLE.replace(change.0, change.1);
    for (text, sets, parts) in [
        (
            table(("0, 0.03]", "0, 0.02]")),
            &[][..],
            ["ODY0501", "`contact` is unilateral, and its row `gap` is -0.01 m"],
        ),
        (
            TABLE.into(),
            &["simulation.fixed_step=0.01"],
            ["ODY0320", "steps of a fixed size cannot end where contacts close"],
        ),
        (TABLE.into(), &["simulation.engine=\"reference\""], ["ODY0320", "`reference` knows no unilateral rows"]),
    ] {
        let error = try_run(&text, sets, None).unwrap_err();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
    // A driver that runs into a stop.
    let stop = "[[joint]]\nname = \"end\"\ntype = \"translational-stop\"\nbodies = [\"ground\", \"table\"]\npoint = [0, 0, 0]\n\
                axis = [0, 0, 1]\nparams.upper = 0.02\n";
    let report = try_run(&format!("{TABLE}{stop}"), &[], None).unwrap();
    assert_eq!(report.exit_code(), 6);
    let reason = &report.summary.reason;
    assert!(reason.contains("`end: upper` closes, but joints and drivers determine how it moves"), "{reason}");
    let reached = (0.4_f64).asin() / 20.0;
    assert!((report.summary.t_end_reached - reached).abs() < 1e-9);
}

#[test]
fn events_are_in_a_file_of_the_results() {
    let folder = Scratch::new();
    let report = try_run(BLOCK, &[], Some(folder.path())).unwrap();
    let text = fs::read_to_string(folder.path().join(EVENTS_FILE)).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "time,element,kind,row,rate_before,rate_after,impulse,energy_lost");
    assert_eq!(lines[1], "0,left,closes,gap,,,,");
    assert_eq!(lines.len(), report.events.len() + 1);
    // Results without contacts have none.
    let other = Scratch::new();
    let text = BLOCK.replace("plane-contact", "point-in-plane").replace("params.rough = true", "");
    let _ = try_run(&text, &["block.angular_velocity=[0, 0, 0]"], Some(other.path()));
    assert!(!other.path().join(EVENTS_FILE).exists());
}

#[test]
fn a_run_is_brought_back_with_its_contacts() {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", BLOCK);
    let start = || Session::open(&path, &options(&[], &[])).unwrap().prepare().unwrap().start().unwrap();
    let mut whole = start();
    whole.advance(1.0).unwrap();
    let saved = whole.save().unwrap();
    whole.advance(3.0).unwrap();
    let mut again = start();
    again.restore(&saved).unwrap();
    again.advance(3.0).unwrap();
    let of = |run: &odyn::session::Run<'_>| *run.samples().columns[0].last().unwrap();
    assert_eq!(of(&whole).to_bits(), of(&again).to_bits());
}

/// However often a run is looked at, or brought back, at one instant: nothing has happened there for that.
#[test]
fn a_run_may_be_brought_back_to_one_instant_over_and_over() {
    let scratch = Scratch::new();
    let relay =
        "[[control]]\nname = \"on\"\ntype = \"relay\"\ninputs = { input = 1 }\nparams = { lower = 0, upper = 2 }\n";
    let text = BLOCK.replace("libraries = [", "libraries = [\"odyn-controls\", ") + relay;
    let path = scratch.file("scene.toml", &text);
    let start = || Session::open(&path, &options(&[], &[])).unwrap().prepare().unwrap().start().unwrap();
    let mut run = start();
    run.advance(1.0).unwrap();
    let saved = run.save().unwrap();
    let mut once = start();
    once.restore(&saved).unwrap();
    let here = once.instant().unwrap();
    for _ in 0..60 {
        run.advance(1.0).unwrap();
        assert_eq!(run.instant().unwrap(), here);
    }
    for _ in 0..60 {
        run.restore(&saved).unwrap();
        run.advance(1.0).unwrap();
    }
    run.advance(3.0).unwrap();
    once.restore(&saved).unwrap();
    once.advance(1.0).unwrap();
    once.advance(3.0).unwrap();
    let of = |run: &odyn::session::Run<'_>| run.samples().columns[0].last().unwrap().to_bits();
    assert_eq!(of(&run), of(&once));
}

/// A ball on the floor, lifted by a force that jumps in time.
const LIFTED: &str = r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]

[simulation]
gravity = [0, 0, -10]
t_end = 1
output_step = 0.05

[[body]]
name = "ball"
mass = 1
inertia = [0.01, 0.01, 0.01]

[[joint]]
name = "floor"
type = "plane-contact"
bodies = ["ground", "ball"]
frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0] }]

[[force]]
name = "lift"
type = "vector-force"
bodies = ["ground", "ball"]
params.z = "15 * max(0, min(1, (t - 0.5) * 1e30)) - 30 * max(0, min(1, (t - 0.7) * 1e30))"

[[output]]
name = "z"
quantity = "position"
of = "ball"
component = "z"

[[output]]
name = "N"
quantity = "reaction_force"
of = "floor"
on = "ball"
component = "z"
"#;

#[test]
fn a_force_that_jumps_opens_a_contact_at_once() {
    let report = every_way_agrees(LIFTED, 1e-10);
    let kinds: Vec<EventKind> = report.events.iter().map(|event| event.kind).collect();
    assert_eq!(kinds, [EventKind::Closes, EventKind::Opens, EventKind::Impact, EventKind::Closes]);
    // Upwards with 5 m/s^2 for 0.2 s, then with -25 m/s^2.
    let struck = 0.7 + (1.0 + 6.0_f64.sqrt()) / 25.0;
    assert!((report.events[1].time - 0.5).abs() < 1e-12 && (report.events[2].time - struck).abs() < 1e-12);
    for (t, z) in report.times.iter().zip(column(&report, "z")) {
        let flown = t - 0.7;
        let expected = match *t {
            t if t <= 0.5 => 0.0,
            t if t <= 0.7 => 2.5 * (t - 0.5).powi(2),
            t if t < struck => 0.1 + flown - 12.5 * flown * flown,
            _ => 0.0,
        };
        assert!((z - expected).abs() < 1e-13, "{t}: {z}, expected {expected}");
    }
    assert!((column(&report, "N").last().unwrap() - 25.0).abs() < 1e-12);
}

/// A table of 10 kg on legs at these places, half a metre below its centre, which slides along x.
pub(crate) fn table(legs: &[[f64; 2]], spin: f64, leg: &str) -> String {
    let mut text = format!(
        "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 0.1\noutput_step = 0.01\n\
         [[body]]\nname = \"table\"\nmass = 10\ninertia = [1, 1, 1.5]\nposition = [0, 0, 0.5]\nvelocity = [1, 0, 0]\n\
         angular_velocity = [0, 0, {spin:?}]\n"
    );
    for (k, [x, y]) in legs.iter().enumerate() {
        text += &format!(
            "[[joint]]\nname = \"leg_{k}\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"table\"]\n\
             frames = [{{ position = [0, 0, 0] }}, {{ position = [{x:?}, {y:?}, -0.5] }}]\n{leg}\n\
             [[output]]\nname = \"n_{k}\"\nquantity = \"reaction_force\"\nof = \"leg_{k}\"\non = \"table\"\ncomponent = \"z\"\n"
        );
    }
    text
}

const FOUR: [[f64; 2]; 4] = [[-0.5, -0.4], [0.5, -0.4], [0.5, 0.4], [-0.5, 0.4]];

#[test]
fn loads_of_four_legs_are_not_unique_and_the_report_says_so() {
    for sets in [&[][..], &["simulation.formulation=\"cartesian\""]] {
        let scratch = Scratch::new();
        let report = try_run(&table(&FOUR, 0.0, ""), sets, Some(scratch.path())).unwrap();
        assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
        assert!(report.channels.iter().all(|channel| !channel.unique));
        assert_eq!(report.summary.not_unique.len(), 4);
        assert!(report.summary.warnings[0].contains("`n_0`, `n_1`, `n_2`, `n_3` not unique"));
        let sum: f64 = report.columns.iter().map(|column| column.last().unwrap()).sum();
        assert!((sum - 98.1).abs() < 1e-10);
        let columns = fs::read_to_string(scratch.path().join("channels.json")).unwrap();
        assert_eq!(columns.matches("\"unique\": false").count(), 4);
    }
    let report = run(&table(&FOUR[..3], 0.0, ""), &[]);
    // The centre is over the edge between two legs: the third carries nothing, all are determined.
    assert!(report.channels.iter().all(|channel| channel.unique) && report.summary.warnings.is_empty());
}

/// A ladder on a rough floor against a wall: a wall that is told to be smooth holds as one of which nothing is said.
#[test]
fn friction_without_a_limit_leaves_nothing_open() {
    let ladder = |wall: &str| {
        let body = "position = [0.42261826174069944, 0, 0.9063077870366499]\norientation = { axis = [0, 1, 0], angle = 1.1344640137963142 }";
        let output = |name: &str, of: &str, component: &str| {
            format!(
                "[[output]]\nname = \"{name}\"\nquantity = \"reaction_force\"\nof = \"{of}\"\ncomponent = \"{component}\"\n"
            )
        };
        format!(
            "plugins.libraries = [\"joints\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 0.1\noutput_step = 0.1\n\
             [[body]]\nname = \"ladder\"\nmass = 10\ninertia = [0.1, 3.3, 3.3]\n{body}\n\
             [[joint]]\nname = \"floor\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"ladder\"]\nparams.mu = 0.4\n\
             frames = [{{ position = [0, 0, 0], axis = [0, 0, 1] }}, {{ position = [1, 0, 0] }}]\n\
             [[joint]]\nname = \"wall\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"ladder\"]\n{wall}\n\
             frames = [{{ position = [0, 0, 0], axis = [1, 0, 0] }}, {{ position = [-1, 0, 0] }}]\n\
             [[joint]]\nname = \"plane\"\ntype = \"planar\"\nbodies = [\"ground\", \"ladder\"]\npoint = [0, 0, 0]\naxis = [0, 1, 0]\n{}{}{}",
            output("normal", "floor", "z"),
            output("friction", "floor", "x"),
            output("push", "wall", "x")
        )
    };
    for (wall, not_unique) in [("", 0), ("params.mu = 0.0", 0), ("params.mu = 0.2", 3)] {
        let report = run(&ladder(wall), &[]);
        assert_eq!(report.summary.not_unique.len(), not_unique, "{wall} {:?}", report.summary.not_unique);
        if not_unique == 0 {
            let expected = 5.0 * 9.81 * 0.42261826174069944 / 0.9063077870366499;
            assert!((column(&report, "push")[0].abs() - expected).abs() < 1e-9, "{wall} {:?}", column(&report, "push"));
        }
    }
}

#[test]
fn a_motion_that_depends_on_loads_that_are_not_unique_is_suspect() {
    let friction = "params.mu = 0.3";
    // The friction of a table that slides without turning does not depend on how its legs share the weight.
    let sliding = run(&table(&FOUR, 0.0, friction), &[]);
    assert_eq!(sliding.summary.not_unique.len(), 4);
    let turning = try_run(&table(&FOUR, 2.0, friction), &[], None).unwrap();
    assert_eq!(turning.exit_code(), 7);
    assert!(turning.summary.reason.contains("loads of `leg_0`"), "{}", turning.summary.reason);
    let three = run(&table(&[[-0.5, -0.4], [0.5, -0.4], [0.0, 0.5]], 2.0, friction), &[]);
    assert!(three.summary.not_unique.is_empty() && three.summary.warnings.is_empty());
}

/// A driver presses a block against a wall: nothing can give way. The run went round in circles without an end.
#[test]
fn a_drive_that_presses_bodies_against_a_wall_ends_the_run() {
    let slide = |name: &str, x: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [{x:?}, 0, 0]\n\
             [[joint]]\nname = \"{name}_slide\"\ntype = \"translational\"\nbodies = [\"ground\", \"{name}\"]\n\
             point = [{x:?}, 0, 0]\naxis = [1, 0, 0]\n"
        )
    };
    let text = |wall: f64, restitution: f64| {
        String::from(
            "title = \"press\"\nplugins.libraries = [\"odyn-joints\"]\n[simulation]\nt_end = 1\noutput_step = 0.1\n",
        ) + &slide("ram", 0.0)
            + &slide("block", 0.1)
            + &format!(
                "[[joint]]\nname = \"drive\"\ntype = \"displacement-driver\"\nbodies = [\"ground\", \"ram\"]\naxis = [1, 0, 0]\n\
                 params.displacement = \"0.5 t^2\"\n\
                 [[joint]]\nname = \"push\"\ntype = \"plane-contact\"\nbodies = [\"ram\", \"block\"]\n\
                 frames = [{{ position = [0, 0, 0], axis = [1, 0, 0] }}, {{ position = [0, 0, 0] }}]\nparams.restitution = {restitution:?}\n\
                 [[joint]]\nname = \"wall\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"block\"]\n\
                 frames = [{{ position = [{wall:?}, 0, 0], axis = [-1, 0, 0] }}, {{ position = [0, 0, 0] }}]\n\
                 params.restitution = {restitution:?}\n"
            )
    };
    for formulation in ["joint", "cartesian"] {
        for restitution in [0.0, 0.3] {
            let sets = [&format!("simulation.formulation=\"{formulation}\"")[..]];
            let report = try_run(&text(0.3, restitution), &sets, None).unwrap();
            let summary = &report.summary;
            // Where the ram has pushed the block to the wall: 0.3 = t^2 / 2.
            assert_eq!(report.exit_code(), 6, "{}", summary.reason);
            assert!((summary.t_end_reached - 0.6_f64.sqrt()).abs() < 1e-4, "{}", summary.t_end_reached);
            assert!(["push", "wall"].iter().any(|name| summary.reason.contains(name)), "{}", summary.reason);
            // Where the wall is further away than the ram goes, it is none.
            assert_eq!(try_run(&text(3.0, restitution), &sets, None).unwrap().exit_code(), 0);
        }
    }
}

/// A wheel on top of a hump, straight on from which there is no hump to touch; a door on two hinges that has nothing to do with it has
/// redundant rows, for which the motion is looked at further on.
#[test]
fn redundant_rows_beside_a_contact_that_ends_ahead_are_chosen_all_the_same() {
    let hump = r#"
[plugins]
libraries = ["joints"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 0.2
output_step = 0.1
[[body]]
name = "wheel"
mass = 2
inertia = [0.01, 0.01, 0.01]
position = [0, 4, 1]
velocity = [1, 0, 0]
[[joint]]
name = "plane"
type = "planar"
bodies = ["ground", "wheel"]
point = [0, 4, 1]
axis = [0, 1, 0]
[[joint]]
name = "hump"
type = "rail-contact"
bodies = ["ground", "wheel"]
points = [[0, 4, 0], [0, 4, 1]]
axis = [0, -1, 0]
x_axis = [1, 0, 0]
params = { height = "sqrt(0.81 - x^2)", from = -0.72, to = 0.855, wheel_radius = 0.1, unilateral = true }
[[output]]
name = "x"
quantity = "position"
of = "wheel"
component = "x"
"#;
    let door = "[[body]]\nname = \"door\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [0.3, 0, -5]\n".to_owned();
    let hinge = |k: usize| {
        format!(
            "[[joint]]\nname = \"hinge-{k}\"\ntype = \"revolute\"\nbodies = [\"ground\", \"door\"]\npoint = [0, {k}, -5]\naxis = [0, 1, 0]\n"
        )
    };
    let both = run(&format!("{hump}{door}{}{}", hinge(0), hinge(1)), &[]);
    assert_eq!(both.summary.redundant_rows, 5);
    let off = difference(column(&both, "x"), column(&run(hump, &[]), "x"));
    assert!(off < 1e-9, "{off:.1e}");
}

/// A ball on the floor, under which a platform starts: z = 0.1 + a t^2 / 2.
fn lift(acceleration: f64, contacts: [&str; 2]) -> String {
    let mut text = format!(
        "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\ngravity = [0, 0, -9.81]\ntolerance = 1e-9\nt_end = 1\noutput_step = 0.1\n\
         [[body]]\nname = \"ball\"\nmass = 1\ninertia = [0.004, 0.004, 0.004]\nposition = [0, 0, 0.1]\n\
         [[body]]\nname = \"lift\"\nmass = 3\ninertia = [0.1, 0.1, 0.1]\n\
         [[joint]]\nname = \"guide\"\ntype = \"translational\"\nbodies = [\"ground\", \"lift\"]\naxis = [0, 0, 1]\n\
         [[joint]]\nname = \"drive\"\ntype = \"displacement-driver\"\nbodies = [\"ground\", \"lift\"]\naxis = [0, 0, 1]\n\
         params.displacement = \"{:?} t^2\"\n\
         [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"ball\"\ncomponent = \"z\"\n",
        0.5 * acceleration
    );
    for on in contacts {
        text += &format!(
            "[[joint]]\nname = \"on-{on}\"\ntype = \"plane-contact\"\nbodies = [\"{on}\", \"ball\"]\nparams.radius = 0.1\n\
             frames = [{{ position = [0, 0, 0], axis = [0, 0, 1] }}, {{ position = [0, 0, 0] }}]\n\
             [[output]]\nname = \"n-{on}\"\nquantity = \"reaction_force\"\nof = \"on-{on}\"\non = \"ball\"\ncomponent = \"z\"\n"
        );
    }
    text
}

#[test]
fn a_platform_that_starts_under_a_ball_lifts_it_off_the_floor() {
    for acceleration in [2.0, 4.08, 6.0] {
        for contacts in [["ground", "lift"], ["lift", "ground"]] {
            for formulation in ["joint", "cartesian"] {
                let sets = [&format!("simulation.formulation=\"{formulation}\"")[..]];
                let report = run(&lift(acceleration, contacts), &sets);
                let what = format!("{acceleration} {contacts:?} {formulation}");
                assert!(report.summary.not_unique.is_empty(), "{what}: {:?}", report.summary.not_unique);
                let rows = report.times.iter().zip(column(&report, "z"));
                let off = rows.map(|(t, z)| (z - 0.1 - 0.5 * acceleration * t * t).abs()).fold(0.0, f64::max);
                assert!(off < 1e-9, "{what}: {off:.1e}");
                let carried = column(&report, "n-lift");
                assert!(carried.iter().all(|n| (n - 9.81 - acceleration).abs() < 1e-7), "{what}: {carried:?}");
                assert!(column(&report, "n-ground").iter().all(|n| n.abs() < 1e-9), "{what}");
            }
        }
    }
}

/// A wheel under a load that a backstop holds, with levers that turn by so much (1 - cos 2t) and take it along by their pawls.
fn ratchet(levers: &[f64], backstop_first: bool) -> String {
    let freewheel = |name: &str, on: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"freewheel\"\nbodies = [\"{on}\", \"wheel\"]\naxis = [0, 0, 1]\n"
        )
    };
    let mut text = String::from(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\ntolerance = 1e-9\nt_end = 1\noutput_step = 0.05\n\
         [[body]]\nname = \"wheel\"\nmass = 1\ninertia = [0.05, 0.05, 0.05]\n\
         [[joint]]\nname = \"shaft\"\ntype = \"revolute\"\nbodies = [\"ground\", \"wheel\"]\naxis = [0, 0, 1]\n\
         [[force]]\nname = \"load\"\ntype = \"vector-torque\"\nbodies = [\"ground\", \"wheel\"]\nparams.z = -0.4\n\
         [[output]]\nname = \"angle\"\nquantity = \"coordinate\"\nof = \"shaft\"\n",
    );
    let mut pawls: Vec<String> = Vec::new();
    for (k, most) in levers.iter().enumerate() {
        text += &format!(
            "[[body]]\nname = \"lever-{k}\"\nmass = 1\ninertia = [0.01, 0.01, 0.01]\n\
             [[joint]]\nname = \"pin-{k}\"\ntype = \"revolute\"\nbodies = [\"ground\", \"lever-{k}\"]\naxis = [0, 0, 1]\n\
             [[joint]]\nname = \"drive-{k}\"\ntype = \"rotation-driver\"\nbodies = [\"ground\", \"lever-{k}\"]\naxis = [0, 0, 1]\n\
             params.angle = \"{most:?} * (1 - cos(2 * t))\"\n"
        );
        pawls.push(freewheel(&format!("pawl-{k}"), &format!("lever-{k}")));
    }
    pawls.insert(if backstop_first { 0 } else { pawls.len() }, freewheel("backstop", "ground"));
    text + &pawls.concat()
}

#[test]
fn the_fastest_of_several_levers_turns_a_ratchet() {
    for levers in [&[0.5][..], &[0.5, 0.6], &[0.6, 0.5], &[0.4, 0.6, 0.5]] {
        for backstop_first in [true, false] {
            let report = run(&ratchet(levers, backstop_first), &[]);
            let what = format!("{levers:?} {backstop_first}");
            assert!(report.summary.not_unique.is_empty(), "{what}: {:?}", report.summary.not_unique);
            let most = levers.iter().copied().fold(0.0, f64::max);
            let rows = report.times.iter().zip(column(&report, "angle"));
            let off = rows.map(|(t, angle)| (angle - most * (1.0 - (2.0 * t).cos())).abs()).fold(0.0, f64::max);
            assert!(off < 1e-7, "{what}: {off:.1e}");
        }
    }
}

/// A chassis on sprung feet that lands unevenly on the ground, with the corners where these are.
fn chassis(corners: &[[f64; 2]], friction: f64, speed: f64) -> String {
    let mut text = format!(
        r#"
        [plugins]
        libraries = ["odyn-joints", "odyn-forces"]
        [simulation]
        gravity = [0, 0, -9.81]
        t_end = 1
        output_step = 0.01
        [[body]]
        name = "chassis"
        mass = 20
        inertia = [1, 1.6, 2.4]
        position = [0, 0, 0.32]
        velocity = [{speed}, 0, 0]
        orientation = {{ axis = [2, 3, 0], angle = 0.036 }}
        [[output]]
        name = "x"
        quantity = "position"
        of = "chassis"
        component = "x"
        [[output]]
        name = "y"
        quantity = "position"
        of = "chassis"
        component = "y"
        [[output]]
        name = "vx"
        quantity = "velocity"
        of = "chassis"
        component = "x"
        "#
    );
    let turn = Rotation3::from_axis_angle(&Unit::new_normalize(Vector3::new(2.0, 3.0, 0.0)), 0.036);
    for (k, [x, y]) in corners.iter().enumerate() {
        let foot = turn * Vector3::new(*x, *y, -0.3);
        text.push_str(&format!(
            r#"
            [[body]]
            name = "foot{k}"
            mass = 1
            inertia = [0.001, 0.001, 0.001]
            position = [{}, {}, {}]
            velocity = [{speed}, 0, 0]
            orientation = {{ axis = [2, 3, 0], angle = 0.036 }}
            [[joint]]
            name = "guide{k}"
            type = "translational"
            bodies = ["chassis", "foot{k}"]
            frames = [{{ position = [{x}, {y}, -0.3], axis = [0, 0, 1] }}, {{ position = [0, 0, 0], axis = [0, 0, 1] }}]
            [[force]]
            name = "spring{k}"
            type = "translational-spring-damper"
            bodies = ["chassis", "foot{k}"]
            frames = [{{ position = [{x}, {y}, 0] }}, {{ position = [0, 0, 0] }}]
            params = {{ stiffness = 2e4, damping = 200, free_length = 0.3 }}
            [[joint]]
            name = "tread{k}"
            type = "plane-contact"
            bodies = ["ground", "foot{k}"]
            frames = [{{ position = [0, 0, 0], axis = [0, 0, 1] }}, {{ position = [0, 0, 0] }}]
            params.mu = {friction}
            "#,
            foot.x,
            foot.y,
            0.32 + foot.z,
        ));
    }
    text
}

/// Feet that hardly move against each other stick and slide over and over, for speeds that no tolerance resolves: where they creep instead, the chassis comes to
/// where it does at a tolerance a thousand times finer, which it did not in a minute before, or not at all ("do not settle").
#[test]
fn sprung_feet_with_friction_come_to_rest_where_they_do_at_a_finer_tolerance() {
    let three = [[0.4, 0.0], [-0.4, 0.3], [-0.4, -0.3]];
    let four = [[0.4, 0.3], [0.4, -0.3], [-0.4, -0.3], [-0.4, 0.3]];
    for (corners, friction, speed) in
        [(&three[..], 0.1, 0.0), (&three, 0.5, 0.0), (&three, 1.0, 0.5), (&four, 0.1, 0.0), (&four, 0.5, 0.5)]
    {
        let text = chassis(corners, friction, speed);
        let [rough, fine] = ["1e-6", "1e-9"].map(|tolerance| {
            let report = run(&text, &[&format!("simulation.tolerance={tolerance}")]);
            let creeps = report.events.iter().filter(|event| event.kind == EventKind::Creeps).count();
            let is_told = report.summary.warnings.iter().any(|warning| warning.starts_with("ODY0334"));
            assert_eq!(creeps > 0, is_told, "{:?}", report.summary.warnings);
            assert!(creeps >= corners.len() || tolerance == "1e-9", "mu {friction}, {tolerance}: {creeps}");
            assert!(report.summary.steps < 6000, "{}", report.summary.steps);
            report
        });
        for name in ["x", "y"] {
            let pairs = column(&rough, name).iter().zip(column(&fine, name));
            let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 2e-5, "mu {friction}: `{name}` differs by {off:.1e}");
        }
        let speeds = column(&fine, "vx");
        assert!(speeds[speeds.len() - 1].abs() < 1e-4, "{speeds:?}");
    }
}

/// How long they creep depends on how long the run has lasted, not on when it began.
#[test]
fn feet_creep_alike_whenever_a_run_begins() {
    let text = chassis(&[[0.4, 0.0], [-0.4, 0.3], [-0.4, -0.3]], 0.1, 0.0);
    let of = |start: f64| {
        let sets = [format!("simulation.t_start={start}"), format!("simulation.t_end={}", start + 1.0)];
        run(&text, &["simulation.tolerance=1e-6", &sets[0], &sets[1]])
    };
    let work = |report: &RunReport| report.summary.steps + report.summary.rejected;
    let plain = of(0.0);
    for start in [-0.35, -0.8, 1e4] {
        let moved = of(start);
        assert!(work(&moved) < 2 * work(&plain), "{start}: {} steps", work(&moved));
        for name in ["x", "y"] {
            let [a, b] = [&plain, &moved].map(|report| *column(report, name).last().unwrap());
            assert!((a - b).abs() < 1e-7, "{start}: `{name}` is {b}, not {a}");
        }
    }
}

/// What is known of frictions that creep, and when that is tried without, is saved with a run.
#[test]
fn a_run_is_brought_back_while_its_feet_creep() {
    let scratch = Scratch::new();
    let text = chassis(&[[0.4, 0.0], [-0.4, 0.3], [-0.4, -0.3]], 0.1, 0.0);
    let path = scratch.file("scene.toml", &text);
    let start = || {
        let session = Session::open(&path, &options(&["simulation.tolerance=1e-6"], &[])).unwrap();
        session.prepare().unwrap().start().unwrap()
    };
    let mut whole = start();
    whole.advance(0.6).unwrap();
    let saved = whole.save().unwrap();
    whole.advance(1.0).unwrap();
    let mut again = start();
    again.restore(&saved).unwrap();
    again.advance(1.0).unwrap();
    let of = |run: &odyn::session::Run<'_>| -> Vec<u64> {
        run.samples().columns.iter().map(|column| column[column.len() - 1].to_bits()).collect()
    };
    assert_eq!(of(&whole), of(&again));
    let report = whole.finish().unwrap();
    let creeps = report.events.iter().filter(|event| event.kind == EventKind::Creeps).map(|event| event.time);
    assert!(creeps.fold(f64::INFINITY, f64::min) < 0.6, "it creeps where it is saved");
}

/// A part of 10 mg on the table, that a force begins to push, and one on a shaker; a block of so much lies on a floor of its own beside them.
fn light_beside(mass: f64) -> String {
    let contact = |name: &str, below: &str, body: &str, law: &str| {
        format!(
            "[[joint]]\nname = {name:?}\ntype = \"plane-contact\"\nbodies = [{below:?}, {body:?}]\n\
             frames = [{{ position = [0, 0, 0], axis = [0, 0, 1] }}, {{ position = [0, 0, 0] }}]\nparams = {{ {law} }}\n"
        )
    };
    let mut text = format!(
        "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 1\noutput_step = 0.1\n\
         [[body]]\nname = \"block\"\nmass = {mass:?}\ninertia = [{mass:?}, {mass:?}, {mass:?}]\nposition = [5, 0, 0]\n\
         [[body]]\nname = \"pushed\"\nmass = 1e-5\nparticle = true\n\
         [[body]]\nname = \"shaker\"\nmass = 1\ninertia = [1, 1, 1]\n\
         [[body]]\nname = \"shaken\"\nmass = 1e-5\nparticle = true\n\
         [[joint]]\nname = \"rail\"\ntype = \"translational\"\nbodies = [\"ground\", \"shaker\"]\naxis = [0, 0, 1]\n\
         [[joint]]\nname = \"drive\"\ntype = \"displacement-driver\"\nbodies = [\"ground\", \"shaker\"]\naxis = [0, 0, 1]\n\
         params.displacement = \"0.01 * (1 - cos(40 * t))\"\n\
         [[force]]\nname = \"push\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"pushed\"]\nparams.x = \"1e-4 * t\"\n"
    );
    text += &contact("floor", "ground", "block", "radius = 0");
    text += &contact("table", "ground", "pushed", "mu = 0.3");
    text += &contact("plate", "shaker", "shaken", "radius = 0");
    for (body, component) in [("pushed", "x"), ("shaken", "z")] {
        text += &format!(
            "[[output]]\nname = \"{body}\"\nquantity = \"position\"\nof = \"{body}\"\ncomponent = \"{component}\"\n"
        );
    }
    text
}

/// What of a reaction is round-off was a share of the largest in the scene: beside 10 t a part stuck that was pushed, and beside 1000 t one on
/// a shaker never left it.
#[test]
fn what_rests_elsewhere_holds_nothing_that_is_light() {
    for islands in ["together", "apart"] {
        let set = format!("simulation.islands={islands:?}");
        let [light, heavy] = [1e-5, 1e6].map(|mass| run(&light_beside(mass), &[&set]));
        let opens = |report: &RunReport| report.events.iter().filter(|event| event.kind == EventKind::Opens).count();
        assert!(opens(&light) >= 6 && opens(&light) == opens(&heavy), "{}, {}", opens(&light), opens(&heavy));
        for name in ["pushed", "shaken"] {
            let off = difference(column(&light, name), column(&heavy, name));
            assert!(off < 1e-9, "{islands}: `{name}` differs by {off:.1e}");
        }
        assert!((column(&heavy, "pushed").last().expect("a sample") - 0.585_745_690).abs() < 1e-8);
    }
}

/// A carriage on a rail, driven through a screw of this lead, m/rad, that comes to an end stop; a body beside it makes the scene large.
fn axis_with_a_stop(lead: f64, far: f64) -> String {
    format!(
        r#"
[plugins]
libraries = ["joints"]
[simulation]
t_end = 0.02
output_step = 0.01
tolerance = 1e-9
[[body]]
name = "carriage"
mass = 20
inertia = [0.1, 0.1, 0.1]
velocity = [{speed:?}, 0, 0]
[[body]]
name = "motor"
mass = 1
inertia = [1e-4, 1e-4, 1e-4]
position = [0.5, 0, 0]
angular_velocity = [300, 0, 0]
[[body]]
name = "beside"
mass = 1
inertia = [1, 1, 1]
position = [{far:?}, 0, 0]
[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "carriage"]
axis = [1, 0, 0]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "motor"]
point = [0.5, 0, 0]
axis = [1, 0, 0]
[[joint]]
name = "drive"
type = "coupler"
bodies = ["ground", "motor", "ground", "carriage"]
axis = [1, 0, 0]
params = {{ first = "rotation", second = "translation", lead = {lead:?} }}
[[joint]]
name = "end"
type = "translational-stop"
bodies = ["ground", "carriage"]
axis = [1, 0, 0]
params = {{ upper = {upper:?}, restitution = 0.5 }}
[[output]]
name = "v"
quantity = "velocity"
of = "carriage"
component = "x"
"#,
        speed = 300.0 * lead,
        upper = 3.0 * lead,
    )
}

/// What an axis with a fine screw moves by is small beside the scene: "joints and drivers determine how it moves, and nothing can give way".
#[test]
fn a_stop_on_an_axis_with_a_fine_screw_gives_way() {
    for (lead, far) in [(1e-3, 0.5), (1e-5, 0.5), (1e-5, 5.0), (1e-4, 50.0)] {
        for way in ["joint", "cartesian"] {
            let report = run(&axis_with_a_stop(lead, far), &[&format!("simulation.formulation={way:?}")]);
            let after = *column(&report, "v").last().expect("a sample");
            assert!((after + 150.0 * lead).abs() < 1e-6 * lead, "{lead} {far} {way}: {after}");
        }
    }
}
