//! Kinematics of driven mechanisms, loads on one body, shaking forces: against closed forms, and against what runs and CalculiX show.

use std::f64::consts::PI;
use std::path::Path;
use std::process::Command;

use odyn::analyses::balance::{Balanced, Question, balance, balanced};
use odyn::analyses::folder;
use odyn::analyses::kinematics::{Drive, Kinematics, kinematics};
use odyn::analyses::linear::Port;
use odyn::analyses::loads::{Case, Consistent, Loads, Watch};
use odyn::analyses::prescribed::quantity;
use odyn::analyses::shown;
use odyn::session::Session;

use crate::support::{Scratch, open_text, options, root};

/// Crank 0.2 m, rod 0.5 m, piston along x; it starts at its outer dead centre.
const SLIDER_CRANK: &str = r#"
[plugins]
libraries = ["joints"]
[simulation]
t_end = 1
output_step = 0.05
[[body]]
name = "crank"
mass = 1
inertia = [0.01, 0.01, 0.02]
position = [0.1, 0, 0]
[[body]]
name = "rod"
mass = 2
inertia = [0.01, 0.1, 0.1]
position = [0.45, 0, 0]
[[body]]
name = "piston"
mass = 3
inertia = [0.01, 0.01, 0.01]
position = [0.7, 0, 0]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "pin"
type = "revolute"
bodies = ["crank", "rod"]
point = [0.2, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "wrist"
type = "revolute"
bodies = ["rod", "piston"]
point = [0.7, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "piston"]
point = [0.7, 0, 0]
axis = [1, 0, 0]
[[output]]
name = "x"
quantity = "position"
of = "piston"
component = "x"
"#;

const DRIVER: &str = r#"
[[joint]]
name = "motor"
type = "rotation-driver"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.angle = "3 t + 2 t^2"
"#;

/// Place of the piston with its first and second derivative by the angle of the crank.
fn piston(angle: f64) -> [f64; 3] {
    let (r, l) = (0.2_f64, 0.5_f64);
    let (s, c) = angle.sin_cos();
    let w = (l * l - r * r * s * s).sqrt();
    let slope = -r * s - r * r * s * c / w;
    let bend = -r * c - r * r * ((c * c - s * s) / w + r * r * s * s * c * c / (w * w * w));
    [r * c + w, slope, bend]
}

fn found(session: &Session, drive: &Drive) -> Kinematics {
    kinematics(session, drive, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"))
}

fn column<'a>(found: &'a Kinematics, name: &str) -> &'a [f64] {
    let k = found.columns.iter().position(|port| port.name == name).unwrap();
    &found.values[k]
}

#[test]
fn a_slider_crank_moves_as_its_closed_form() {
    let session = open_text(SLIDER_CRANK, &[]);
    let angle = quantity(&session, "bearing.angle").unwrap();
    for range in [[0.0, 4.0 * PI], [2.0 * PI, 0.3]] {
        let over = found(&session, &Drive::Over(angle.clone(), range, 73));
        for (k, place) in over.places.iter().enumerate() {
            let expected = piston(*place);
            for (name, expected) in ["x", "x'", "x''"].iter().zip(expected) {
                let value = column(&over, name)[k];
                assert!((value - expected).abs() < 1e-11, "{name} at {place}: {value} {expected}");
            }
        }
    }
    // Its own driver, over time.
    let session = open_text(&format!("{SLIDER_CRANK}{DRIVER}"), &[]);
    let over = found(&session, &Drive::Time);
    for (k, t) in over.places.iter().enumerate() {
        let ([x, slope, bend], speed) = (piston(3.0 * t + 2.0 * t * t), 3.0 + 4.0 * t);
        assert!((column(&over, "x")[k] - x).abs() < 1e-11, "{t}");
        assert!((column(&over, "x'")[k] - slope * speed).abs() < 1e-10, "{t}");
        assert!((column(&over, "x''")[k] - (bend * speed * speed + slope * 4.0)).abs() < 1e-9, "{t}");
    }
}

#[test]
fn all_its_motion_has_the_dead_centres() {
    let session = open_text(SLIDER_CRANK, &[]);
    let whole = found(&session, &Drive::Whole(quantity(&session, "bearing.angle").unwrap()));
    assert!(whole.closed, "{:?}", whole.notes);
    let x = whole.extents.iter().find(|one| one.name == "x").unwrap();
    assert!((x.values[0] - 0.3).abs() < 1e-12 && (x.values[1] - 0.7).abs() < 1e-12, "{x:?}");
    let dead: Vec<f64> = whole.dead_points.iter().filter(|one| one.of == "x").map(|one| one.values[1]).collect();
    assert_eq!(dead.len(), 2, "{:?}", whole.dead_points);
    assert!(whole.dead_points.iter().all(|one| one.of == "x"), "the crank turns fully: {:?}", whole.dead_points);
    for angle in dead {
        assert!((angle / PI - (angle / PI).round()).abs() < 1e-7, "{angle}");
    }
    for (k, angle) in whole.places.iter().enumerate() {
        let [x, slope, _] = piston(*angle);
        assert!((column(&whole, "x")[k] - x).abs() < 1e-11 && (column(&whole, "x'")[k] - slope).abs() < 1e-10);
    }
    // Where the piston drives and stands still, nothing has a ratio to it.
    let angle = "[[output]]\nname = \"angle\"\nquantity = \"coordinate\"\nof = \"bearing\"\nchannel = \"angle\"\n";
    let session = open_text(&format!("{SLIDER_CRANK}{angle}"), &[]);
    let by_piston = found(&session, &Drive::Whole(quantity(&session, "x").expect("an output")));
    let start = (0..by_piston.places.len()).max_by(|a, b| by_piston.places[*a].total_cmp(&by_piston.places[*b]));
    assert!(column(&by_piston, "angle'")[start.expect("places")].is_nan(), "{:?}", column(&by_piston, "angle'"));
    let ports: Vec<(&Port, &[f64])> =
        by_piston.columns.iter().zip(by_piston.values.iter().map(Vec::as_slice)).collect();
    let text = folder::over(&by_piston.over, &by_piston.places, &ports);
    assert!(text.contains(",\n") && !text.contains("NaN"), "{text}");
    // It does not drive away from there.
    let drive = Drive::Over(quantity(&session, "x").expect("an output"), [0.7, 0.6], 4);
    let error = kinematics(&session, &drive, &mut |_| ()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("at a dead point") && !error.contains("leave this free"), "{error}");
    // The piston cannot drive it beyond the dead centre.
    let drive = Drive::Over(quantity(&session, "x").unwrap(), [0.6, 0.75], 4);
    let error = kinematics(&session, &drive, &mut |_| ()).unwrap_err();
    assert!(error.to_string().contains("dead point") && error.exit_code() == 5, "{error}");
    // Said where it is: the crank begins at 60 degrees.
    let turned = [
        (
            "position = [0.1, 0, 0]",
            "position = [0.05, 0.0866025403784, 0]\norientation = { axis = [0, 0, 1], angle = 1.0471975512 }",
        ),
        (
            "position = [0.45, 0, 0]",
            "position = [0.334520788, 0.0866025404, 0]\norientation = { axis = [0, 0, 1], angle = -0.3537416059 }",
        ),
        ("position = [0.7, 0, 0]", "position = [0.569041576, 0, 0]"),
        ("point = [0.2, 0, 0]", "point = [0.1, 0.1732050807569, 0]"),
        ("point = [0.7, 0, 0]", "point = [0.569041576, 0, 0]"),
    ];
    let turned = turned.iter().fold(SLIDER_CRANK.to_owned(), |text, (from, to)| text.replace(from, to));
    let session = open_text(&turned, &[]);
    let drive = Drive::Over(quantity(&session, "x").unwrap(), [0.6, 0.75], 4);
    let error = kinematics(&session, &drive, &mut |_| ()).unwrap_err();
    assert!(error.to_string().contains("at x = 0.7 m: the motion leads no further"), "{error}");
}

/// A crank of 1 m, a coupler and a rocker of 3 m, 4 m apart.
fn four_bar() -> String {
    let h = (9.0_f64 - 2.25).sqrt();
    let mut text = String::from("[plugins]\nlibraries = [\"joints\"]\n[simulation]\nt_end = 1\noutput_step = 0.1\n");
    let points =
        [("crank", [0.0, 0.0], [1.0, 0.0]), ("coupler", [1.0, 0.0], [2.5, h]), ("rocker", [4.0, 0.0], [2.5, h])];
    for (name, from, to) in points {
        text += &format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [{:?}, {:?}, 0]\n",
            0.5 * (from[0] + to[0]),
            0.5 * (from[1] + to[1])
        );
    }
    let joints = [
        ("A", "ground", "crank", [0.0, 0.0]),
        ("B", "crank", "coupler", [1.0, 0.0]),
        ("C", "coupler", "rocker", [2.5, h]),
        ("D", "ground", "rocker", [4.0, 0.0]),
    ];
    for (name, i, j, [x, y]) in joints {
        text += &format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nbodies = [\"{i}\", \"{j}\"]\npoint = [{x:?}, {y:?}, 0]\naxis = [0, 0, 1]\n"
        );
    }
    text
}

#[test]
fn a_rocker_swings_between_its_limits() {
    let session = open_text(&four_bar(), &[]);
    let whole = found(&session, &Drive::Whole(quantity(&session, "A.angle").unwrap()));
    assert!(whole.closed, "{:?}", whole.notes);
    // Crank and coupler in line: law of cosines at D. Angles of the rocker are from its start.
    let at = |side: f64| PI - ((16.0 + 9.0 - side * side) / 24.0_f64).acos();
    let start = PI - (1.5_f64 / 3.0).acos();
    let rocker = whole.extents.iter().find(|one| one.name == "D.angle").unwrap();
    let expected = [at(4.0) - start, at(2.0) - start];
    for (found, expected) in rocker.values.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-12, "{rocker:?} {expected:?}");
    }
    assert_eq!(whole.dead_points.iter().filter(|one| one.of == "D.angle").count(), 2);
    assert_eq!(whole.dead_points.iter().filter(|one| one.of == "A.angle").count(), 0);
    // As a drive the rocker turns back there: the path is the same.
    let other = found(&session, &Drive::Whole(quantity(&session, "D.angle").unwrap()));
    let crank = other.extents.iter().find(|one| one.name == "A.angle").unwrap();
    assert!(other.closed && (crank.values[1] - crank.values[0] - 2.0 * PI).abs() < 1e-12, "{crank:?}");
    // The last place of a cycle is the first, a turn later.
    assert!((whole.places.last().unwrap() - whole.places[0] - 2.0 * PI).abs() < 1e-12, "{:?}", whole.places);
}

/// A pin on a wave, y = A (cos(2 (x - 0.4)) - cos 0.8): its crests and troughs lie before and behind the start.
#[test]
fn dead_points_behind_the_start_are_as_exact_as_those_before() {
    let text = r#"
[plugins]
libraries = ["joints"]
[simulation]
t_end = 1
output_step = 0.1
[[body]]
name = "slide"
mass = 1
inertia = [1, 1, 1]
[[body]]
name = "pin"
mass = 1
inertia = [1, 1, 1]
[[joint]]
name = "along"
type = "translational"
bodies = ["ground", "slide"]
axis = [1, 0, 0]
[[joint]]
name = "across"
type = "translational"
bodies = ["slide", "pin"]
axis = [0, 1, 0]
[[joint]]
name = "track"
type = "point-on-curve"
bodies = ["ground", "pin"]
params.height = "0.3 * (cos(2 * (x - 0.4)) - cos(0.8))"
"#;
    let session = open_text(text, &[]);
    let whole = found(&session, &Drive::Whole(quantity(&session, "along.displacement").unwrap()));
    let along = whole.extents.iter().position(|one| one.name == "along.displacement").unwrap();
    let dead: Vec<f64> =
        whole.dead_points.iter().filter(|one| one.of == "across.displacement").map(|one| one.values[along]).collect();
    let behind = dead.iter().filter(|x| **x < 0.0).count();
    assert!(behind > 5 && dead.len() - behind > 5, "{dead:?}");
    for x in dead {
        let halves = 2.0 * (x - 0.4) / PI;
        assert!((halves - halves.round()).abs() < 1e-9, "{x}");
    }
}

#[test]
fn mechanisms_without_a_drive_are_refused() {
    let session = open_text(SLIDER_CRANK, &[]);
    let error = kinematics(&session, &Drive::Time, &mut |_| ()).unwrap_err();
    assert!(error.to_string().contains("--drive"), "{error}");
}

/// Two bars in space: boxes of 1 x 0.1 x 0.06 m, so that finite elements have the same mass.
const BARS: &str = r#"
[plugins]
libraries = ["joints"]
[parameters]
m = "2 kg"
[simulation]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.1
[[body]]
name = "upper"
mass = "m"
inertia = ["m * (0.1 m)^2 / 12 + m * (0.06 m)^2 / 12", "m * (1 m)^2 / 12 + m * (0.06 m)^2 / 12", "m * (1 m)^2 / 12 + m * (0.1 m)^2 / 12"]
position = [0.5, 0, 0]
angular_velocity = [0, 0, 3]
[[body]]
name = "lower"
mass = 1
inertia = [0.01, 0.1, 0.1]
position = [1.5, 0, 0]
angular_velocity = [0, 2, 3]
[[joint]]
name = "shoulder"
type = "universal"
bodies = ["ground", "upper"]
frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [-0.5, 0, 0], axis = [0, 1, 0] }]
[[joint]]
name = "elbow"
type = "spherical"
bodies = ["upper", "lower"]
point = [1, 0, 0]
"#;

fn loads_of(open: &dyn Fn() -> Session, body: &str, times: &[f64]) -> Loads {
    let mut watch = Watch::new(&open(), body).unwrap_or_else(|error| panic!("{error}"));
    let mut run = open().prepare().unwrap().start().unwrap();
    let cases: Vec<Case> = times
        .iter()
        .map(|time| {
            run.advance(*time).unwrap();
            watch.at(&run.instant().unwrap(), "asked for").unwrap()
        })
        .collect();
    watch.loads.cases = cases;
    watch.loads
}

#[test]
fn loads_on_each_body_are_in_balance() {
    let compressor = || crate::support::open("compressor.toml", &[]);
    for body in ["block", "rotor", "conrod", "piston"] {
        let found = loads_of(&compressor, body, &[0.0, 31.25, 150.0, 183.5]);
        for case in &found.cases {
            assert!(case.left.iter().all(|left| *left < 1e-12), "{body} at {}: {:?}", case.time, case.left);
            let most = case.wrenches.iter().flat_map(|one| one.force).fold(0.0, |a: f64, b| a.max(b.abs()));
            assert!(most > 0.0, "{body}");
        }
    }
    // Forces are the round-off of the torques here.
    let shafts = || crate::support::open("verification/constant-velocity.toml", &[]);
    let found = loads_of(&shafts, "input", &[0.0, 0.79, 1.5]);
    assert!(found.cases.iter().all(|case| case.left.iter().all(|left| *left < 1e-12)), "{:?}", found.cases);
    let peaks = odyn::analyses::loads::peaks(&found, &found.cases);
    assert!(peaks.iter().all(|case| !case.why.contains("force")), "{peaks:?}");
    let found = loads_of(&|| open_text(BARS, &[]), "upper", &[0.0, 0.4, 1.0]);
    assert!(found.cases.iter().all(|case| case.left.iter().all(|left| *left < 1e-12)), "{:?}", found.cases);
}

/// The mass that elements bring acts on the body through them, and is none of its own: 10 N on 2 kg and an inertance of 3 kg.
#[test]
fn the_mass_of_elements_is_none_of_the_body() {
    for (element, own) in [
        ("type = \"inerter\"\npoints = [[-1, 0, 0], [0, 0, 0]]\nparams.inertance = 3", 4.0),
        ("type = \"added-mass\"\npoint = [0, 0, 0]\nparams.mass = 3", 4.0),
    ] {
        let bodies = if element.contains("inerter") { "[\"ground\", \"slide\"]" } else { "[\"slide\"]" };
        let text = format!(
            "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\nt_end = 1\noutput_step = 0.1\n\
             [[body]]\nname = \"slide\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\n\
             [[joint]]\nname = \"guide\"\ntype = \"translational\"\nbodies = [\"ground\", \"slide\"]\naxis = [1, 0, 0]\n\
             [[force]]\nname = \"mass\"\nbodies = {bodies}\n{element}\n\
             [[force]]\nname = \"pull\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"slide\"]\nparams.x = \"10\"\n"
        );
        let found = loads_of(&|| open_text(&text, &[]), "slide", &[0.0, 0.5]);
        assert_eq!(found.mass, 2.0);
        assert!((found.inertia[0][0] - 0.1).abs() < 1e-15, "{:?}", found.inertia);
        for case in &found.cases {
            assert!(case.left.iter().all(|left| *left < 1e-12), "{element}: {:?}", case.left);
            assert!((case.inertia.force[0] + own).abs() < 1e-9, "{element}: {:?}", case.inertia);
        }
    }
}

/// A scissor lift on a slide: all that holds the roller meets at its centre of mass, so that every moment on it is round-off.
#[test]
fn moments_of_round_off_are_in_balance() {
    let (c, s) = (0.6_f64.cos(), 0.6_f64.sin());
    let mut text = String::from(
        "[plugins]\nlibraries = [\"joints\"]\n[simulation]\ngravity = [1, 2, -9.81]\nt_end = 1\noutput_step = 0.1\nengine = \"reference\"\n",
    );
    let bodies = [("p", c / 2.0, s / 2.0), ("q", c / 2.0, s / 2.0), ("roller", c, 0.0), ("table", c / 2.0, s + 0.1)];
    for (name, x, z) in bodies.into_iter().chain([("shoe", c, s)]) {
        text += &format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [{x:?}, 0, {z:?}]\n");
    }
    let joints = [
        ("middle", "revolute", "p", "q", c / 2.0, s / 2.0),
        ("foot", "revolute", "ground", "p", 0.0, 0.0),
        ("pin", "revolute", "roller", "q", c, 0.0),
        ("hinge", "revolute", "table", "q", 0.0, s),
        ("top", "revolute", "shoe", "p", c, s),
        ("track", "translational", "ground", "roller", c, 0.0),
        ("rail", "translational", "table", "shoe", c, s),
        ("drive", "displacement-driver", "ground", "roller", c, 0.0),
    ];
    for (name, kind, i, j, x, z) in joints {
        let axis = if kind == "revolute" { [0, 1, 0] } else { [1, 0, 0] };
        text += &format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"{i}\", \"{j}\"]\npoint = [{x:?}, 0, {z:?}]\naxis = {axis:?}\n"
        );
    }
    text += "params.displacement = \"0.05 * sin(3 * t)\"\n";
    let found = loads_of(&|| open_text(&text, &[]), "roller", &[0.2, 0.5, 1.0]);
    for case in &found.cases {
        assert!(case.left.iter().all(|left| *left < 1e-12), "at {}: {:?}", case.time, case.left);
    }
}

/// The values of the lines that follow a keyword in a step of a deck.
fn lines<'a>(step: &'a str, keyword: &str) -> Vec<Vec<&'a str>> {
    let after = step.split(keyword).nth(1).unwrap_or("");
    let own = after.lines().skip(1).take_while(|line| !line.starts_with('*'));
    own.map(|line| line.split(',').map(str::trim).collect()).collect()
}

/// What is read back from the deck is in balance with the inertia of a box of 10 x 1 x 1 elements, by CalculiX where it is there.
#[test]
fn decks_for_finite_elements_are_in_balance() {
    let found = loads_of(&|| open_text(BARS, &[]), "upper", &[0.4, 1.0]);
    let (head, steps) = found.calculix(Consistent::Metres, "EALL", 900_001);
    for (case, step) in found.cases.iter().zip(&steps) {
        let mut force = [0.0; 3];
        for line in lines(step, "*CLOAD") {
            let (node, direction, value) =
                (line[0].parse::<usize>().unwrap(), line[1].parse::<usize>().unwrap(), line[2].parse::<f64>().unwrap());
            if node % 2 == 1 {
                force[direction - 1] += value;
            }
        }
        let fields = lines(step, "*DLOAD");
        let gravity: Vec<f64> = fields[0][2..].iter().map(|x| x.parse().unwrap()).collect();
        (0..3).for_each(|k| force[k] += found.mass * gravity[0] * gravity[k + 1]);
        let size = found.mass * gravity[0];
        assert!(force.iter().all(|left| left.abs() < 1e-10 * size), "{force:?} at {}", case.time);
        assert_eq!((fields[0][1], fields[1][1]), ("GRAV", "CENTRIF"));
    }
    if Command::new("ccx").arg("-v").output().is_err() {
        eprintln!("no ccx here: the deck was read back only");
        return;
    }
    let scratch = Scratch::new();
    let mut text = String::from("*NODE, NSET=NALL\n");
    let number = |i: usize, j: usize, k: usize| 1 + i + 11 * (j + 2 * k);
    for (i, j, k) in (0..11).flat_map(|i| [(i, 0, 0), (i, 1, 0), (i, 0, 1), (i, 1, 1)]) {
        let (x, y, z) = (-0.5 + 0.1 * i as f64, -0.05 + 0.1 * j as f64, -0.03 + 0.06 * k as f64);
        text += &format!("{}, {x:.9}, {y:.9}, {z:.9}\n", number(i, j, k));
    }
    text += "*ELEMENT, TYPE=C3D8, ELSET=EALL\n";
    for i in 0..10 {
        let corners = [(i, 0), (i + 1, 0), (i + 1, 1), (i, 1)];
        let nodes: Vec<String> =
            [0, 1].iter().flat_map(|k| corners.map(|(i, j)| number(i, j, *k).to_string())).collect();
        text += &format!("{}, {}\n", i + 1, nodes.join(", "));
    }
    let section = |i: usize| [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(j, k)| number(i, j, k).to_string()).join(", ");
    for (name, i) in [("N_SHOULDER", 0), ("N_ELBOW", 10), ("N_EULER", 5)] {
        text += &format!("*NSET, NSET={name}\n{}\n", section(i));
    }
    text += &head;
    let density = found.mass / (1.0 * 0.1 * 0.06);
    text += &format!(
        "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1E11, 0.3\n*DENSITY\n{density:.12e}\n*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n"
    );
    for (case, step) in found.cases.iter().zip(&steps) {
        scratch.file("job.inp", format!("{text}{step}"));
        let output = Command::new("ccx").args(["-i", "job"]).current_dir(scratch.path()).output().unwrap();
        let held = reactions(&std::fs::read_to_string(scratch.path().join("job.dat")).unwrap_or_default());
        assert_eq!(held.len(), 2, "{}", String::from_utf8_lossy(&output.stdout));
        let size = case.wrenches.iter().flat_map(|one| one.force).fold(0.0, |a: f64, b| a.max(b.abs()));
        // CalculiX counts the share of the distributed loads of the nodes that are held, of the middle section: hats of two elements.
        let (share, yy, zz) = (0.1 * found.mass, 0.1 * 0.1 / 12.0, 0.06 * 0.06 / 12.0);
        let w = case.spin;
        let turned = [share * w[1] * w[2] * (zz - yy), -share * w[0] * w[2] * zz, share * w[0] * w[1] * yy];
        for k in 0..3 {
            let (force, moment) = (held[0][k] - share * case.field[k], held[1][k] - case.euler[k] - turned[k]);
            assert!(force.abs() < 2e-6 * size && moment.abs() < 2e-6 * size, "{k}: {held:?} beside {size}, {case:?}");
        }
    }
}

/// Forces of `job.dat`: lines of a node number and three values.
fn reactions(data: &str) -> Vec<[f64; 3]> {
    data.lines()
        .filter_map(|line| {
            let parts: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
            (parts.len() == 4).then(|| [parts[1], parts[2], parts[3]])
        })
        .collect()
}

/// A wheel with a mass off its axis, turning steadily.
const WHEEL: &str = r#"
[plugins]
libraries = ["joints"]
[simulation]
t_end = 1
output_step = 0.01
[[body]]
name = "wheel"
mass = 10
inertia = [0.2, 0.2, 0.4]
point_masses = [{ mass = 0.5, position = [0.06, 0.08, 0.02] }]
angular_velocity = [0, 0, 50]
[[joint]]
name = "axle"
type = "revolute"
bodies = ["ground", "wheel"]
point = [0, 0, 0.02]
axis = [0, 0, 1]
"#;

#[test]
fn an_unbalanced_wheel_is_balanced_opposite() {
    let scratch = Scratch::new();
    let path = scratch.file("wheel.toml", WHEEL);
    an_unbalanced_wheel(&path);
    // The joint counts the angle of the ground against the wheel.
    let path = scratch.file("turned.toml", WHEEL.replace("[\"ground\", \"wheel\"]", "[\"wheel\", \"ground\"]"));
    an_unbalanced_wheel(&path);
}

fn an_unbalanced_wheel(path: &Path) {
    let open = |sets: &[&str]| Session::open(path, &options(sets, &[]));
    let question = Question { turn: "axle.angle".into(), turns: 2, harmonics: 3, about: [0.0, 0.0, 0.0] };
    for (turns, harmonics) in [(0, 3), (2, 0)] {
        let none = Question { turn: "axle.angle".into(), turns, harmonics, about: [0.0; 3] };
        let refused = balance(&|| open(&[]), &none, &mut |_| ()).map(|_| ()).unwrap_err();
        assert!(refused.to_string().contains("cannot be 0"), "{refused}");
    }
    let found = balance(&|| open(&[]), &question, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"));
    let expected = 0.5 * 0.1 * 2500.0;
    let first = &found.shaking.harmonics[1];
    assert!(
        (first.force[0] / expected - 1.0).abs() < 1e-9 && (first.force[1] / expected - 1.0).abs() < 1e-9,
        "{first:?}"
    );
    assert!((first.moment[0] / (expected * 0.02) - 1.0).abs() < 1e-9, "{first:?}");
    let (weight, left) = found.counterweight(&open(&[]).unwrap(), &question, Some(0.2)).unwrap();
    assert!((weight.unbalance - 0.05).abs() < 1e-10 && (weight.mass - 0.25).abs() < 1e-9, "{weight:?}");
    assert!((weight.position[0] + 0.12).abs() < 1e-9 && (weight.position[1] + 0.16).abs() < 1e-9, "{weight:?}");
    assert!(
        left.force_rms < 1e-8 * expected && left.moment_rms < 1e-8 * expected,
        "{} {}",
        left.force_rms,
        left.moment_rms
    );
    // The masses that it has stay: with the counterweight it runs quietly.
    let after = balance(&|| open(&[&weight.set]), &question, &mut |_| ()).unwrap().shaking;
    assert!(after.force_rms < 1e-8 * expected, "{}", after.force_rms);
    // What is reported goes forwards, whichever way it turns.
    let all = Balanced { before: found.shaking, counterweight: weight, predicted: left, after };
    let (angles, _) = shown::shaking(&all);
    assert!(angles[0] == 0.0 && angles.windows(2).all(|pair| pair[0] < pair[1]), "{angles:?}");
}

/// Its harmonics are shown, and there is no counterweight that would be better than none.
#[test]
fn a_balanced_wheel_takes_no_counterweight() {
    let scratch = Scratch::new();
    let text = WHEEL.replace("point_masses = [{ mass = 0.5, position = [0.06, 0.08, 0.02] }]\n", "");
    let path = scratch.file("wheel.toml", text);
    let open = |set: Option<&str>| Session::open(&path, &options(&Vec::from_iter(set), &[]));
    let question = Question { turn: "axle.angle".into(), turns: 2, harmonics: 3, about: [0.0; 3] };
    let found = balanced(&open(None).unwrap(), &open, &question, None, &mut |_| ()).unwrap();
    assert_eq!((found.counterweight.mass, found.counterweight.set.as_str()), (0.0, ""));
    assert!(found.before.harmonics.len() == 4 && found.before.force_peak < 1e-9, "{:?}", found.before.harmonics);
    assert_eq!((found.predicted.force_rms, found.after.force_rms), (found.before.force_rms, found.before.force_rms));
    let notes = shown::balance(&found).notes;
    assert_eq!(notes, ["no counterweight on wheel makes the force less"]);
}

/// A rotor that has been at these angles before, turning backwards: the last turn is the one from 5.71 to 8 rad/s.
#[test]
fn the_last_turns_are_those_after_the_last_reversal() {
    let text = "[plugins]\nlibraries = [\"joints\"]\n[simulation]\nt_end = 8\noutput_step = 0.01\n\
                [[body]]\nname = \"rotor\"\nmass = 5\ninertia = [0.02, 0.02, 0.03]\nposition = [0.004, 0, 0]\n\
                [[joint]]\nname = \"axle\"\ntype = \"revolute\"\nbodies = [\"ground\", \"rotor\"]\npoint = [0, 0, 0]\n\
                [[joint]]\nname = \"motor\"\ntype = \"rotation-driver\"\nbodies = [\"ground\", \"rotor\"]\npoint = [0, 0, 0]\n\
                params.angle = \"-12 * t + 1.25 * t^2\"\n";
    let question = Question { turn: "axle.angle".into(), turns: 1, harmonics: 2, about: [0.0; 3] };
    let scratch = Scratch::new();
    let path = scratch.file("rotor.toml", text);
    let found = balance(&|| Session::open(&path, &options(&[], &[])), &question, &mut |_| ()).expect("it turns");
    let shaking = &found.shaking;
    assert!((5.7..8.0).contains(&shaking.speed), "{}", shaking.speed);
    assert!(shaking.times.iter().all(|time| (7.08..=8.0).contains(time)), "{:?}", shaking.times);
    // m e (omega^4 + alpha^2)^(1/2)
    let most = 5.0 * 0.004 * 64.0_f64.hypot(2.5);
    assert!((shaking.force_peak / most - 1.0).abs() < 0.05, "{}", shaking.force_peak);
}

#[test]
fn the_compressor_shakes_less_as_predicted() {
    let path = root().join("scenes/compressor.toml");
    let open = |sets: &[&str]| Session::open(Path::new(&path), &options(sets, &[]));
    let question = Question { turn: "main_bearing.angle".into(), turns: 2, harmonics: 6, about: [0.0; 3] };
    let found = balance(&|| open(&[]), &question, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"));
    let (weight, left) = found.counterweight(&open(&[]).unwrap(), &question, Some(0.008)).unwrap();
    let after = balance(&|| open(&[&weight.set]), &question, &mut |_| ()).unwrap().shaking;
    let before = &found.shaking;
    assert!(after.force_rms < 0.5 * before.force_rms, "{} {}", after.force_rms, before.force_rms);
    assert!((after.force_rms / left.force_rms - 1.0).abs() < 0.02, "{} {}", after.force_rms, left.force_rms);
    for k in 0..3 {
        let (expected, shown) = (left.harmonics[k].force, after.harmonics[k].force);
        let size = before.harmonics[1].force[0];
        (0..3).for_each(|c| assert!((expected[c] - shown[c]).abs() < 0.01 * size, "{k} {c}: {expected:?} {shown:?}"));
    }
}

/// A particle on a rail, whose rotations the rail holds, is free to fall beside what is driven: -g t^2 / 2.
#[test]
fn particles_that_joints_keep_from_turning_are_counted_as_they_move() {
    let text = "[plugins]\nlibraries = [\"joints\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 1\noutput_step = 0.1\n\
                [[body]]\nname = \"shaft\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [1, 0, 0]\n\
                [[joint]]\nname = \"hinge\"\ntype = \"revolute\"\nbodies = [\"ground\", \"shaft\"]\npoint = [1, 0, 0]\naxis = [0, 0, 1]\n\
                [[joint]]\nname = \"motor\"\ntype = \"rotation-driver\"\nbodies = [\"ground\", \"shaft\"]\npoint = [1, 0, 0]\n\
                axis = [0, 0, 1]\nparams.angle = \"3*t\"\n\
                [[body]]\nname = \"load\"\nmass = 50\nparticle = true\n\
                [[joint]]\nname = \"rail\"\ntype = \"translational\"\nbodies = [\"ground\", \"load\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
                [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"load\"\ncomponent = \"z\"\n";
    let session = open_text(text, &[]);
    assert_eq!(session.plan.mobility, 1);
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    assert_eq!(report.exit_code(), 0);
    let fallen = crate::support::column(&report, "z");
    let off = report.times.iter().zip(fallen).map(|(t, z)| (z + 0.5 * 9.81 * t * t).abs()).fold(0.0, f64::max);
    assert!(off < 1e-10, "{off:e}");
    // Two particles that keep each other from turning, and no more.
    let pair = text.replace("bodies = [\"ground\", \"load\"]", "bodies = [\"ballast\", \"load\"]")
        + "[[body]]\nname = \"ballast\"\nmass = 1\nparticle = true\n";
    assert_eq!(open_text(&pair, &[]).plan.mobility, 4);
    // What turns with a shaft would have to take a torque.
    let carried = text.replace("bodies = [\"ground\", \"load\"]", "bodies = [\"shaft\", \"load\"]");
    let error = open_text(&carried, &[]).run(None, Box::new(|_| ()), &Default::default()).unwrap_err().to_string();
    assert!(error.contains("ODY0606") && error.contains("`load`"), "{error}");
}

/// Parallelogram of links of 1 m and 2 m, upright at the start: at right angles to that all are in line, and it might fold as well.
const PARALLELOGRAM: &str = r#"
[plugins]
libraries = ["joints"]
[simulation]
t_end = 1
output_step = 0.1
[[body]]
name = "crank"
mass = 1
inertia = [0.01, 0.01, 0.01]
position = [0, 1, 0]
[[body]]
name = "coupler"
mass = 1
inertia = [0.01, 0.01, 0.01]
position = [2, 1, 0]
[[body]]
name = "rocker"
mass = 1
inertia = [0.01, 0.01, 0.01]
position = [2, 1, 0]
[[joint]]
name = "A"
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "B"
type = "revolute"
bodies = ["crank", "coupler"]
point = [0, 1, 0]
axis = [0, 0, 1]
[[joint]]
name = "C"
type = "revolute"
bodies = ["coupler", "rocker"]
point = [2, 1, 0]
axis = [0, 0, 1]
[[joint]]
name = "D"
type = "revolute"
bodies = ["ground", "rocker"]
point = [2, 0, 0]
axis = [0, 0, 1]
[[output]]
name = "rocker"
quantity = "coordinate"
of = "D"
[[output]]
name = "height"
quantity = "position"
of = "coupler"
component = "y"
"#;

/// Next to change points a place is known to the root of round-off only, and ratios not at all: there they are limits from both sides.
#[test]
fn a_parallelogram_passes_its_change_points() {
    let session = open_text(PARALLELOGRAM, &[]);
    let drive = quantity(&session, "A.angle").unwrap();
    let found = kinematics(&session, &Drive::Over(drive, [0.0, 2.0 * PI], 37), &mut |_| ()).unwrap();
    let columns = ["rocker", "rocker'", "rocker''", "height", "height'", "height''"].map(|name| column(&found, name));
    for (k, angle) in found.places.iter().enumerate() {
        let (sine, cosine) = angle.sin_cos();
        for (column, expected) in columns.iter().zip([*angle, 1.0, 0.0, cosine, -sine, -cosine]) {
            assert!((column[k] - expected).abs() < 1e-7, "{angle}: {} is not {expected}", column[k]);
        }
    }
}

/// A bob on a spring 100 km from the origin, pushed by a force of which a frame is at the origin, or beside it.
fn pushed_far_away(place: &str) -> String {
    format!(
        "[plugins]\nlibraries = [\"forces\"]\n[simulation]\nt_end = 5\noutput_step = 0.1\ntolerance = 1e-8\n\
         [[body]]\nname = \"bob\"\nmass = 1\nparticle = true\nposition = [100001, 0, 0]\nvelocity = [0, 1, 0.3]\n\
         [[force]]\nname = \"spring\"\ntype = \"translational-spring-damper\"\nbodies = [\"ground\", \"bob\"]\n\
         points = [[100000, 0, 0], [100001, 0, 0]]\nparams = {{ stiffness = 10, free_length = 0.8 }}\n\
         [[force]]\nname = \"push\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"bob\"]\n{place}params.x = 1e-3\n\
         [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"bob\"\ncomponent = \"z\"\n"
    )
}

/// Where the ground takes the reaction of a force has no part in the motion, nor in the size that errors are compared with.
#[test]
fn a_place_that_has_no_say_is_no_part_of_the_size_of_a_scene() {
    let [there, beside] = ["", "point = [100001, 0, 0]\n"].map(|place| {
        let report = crate::contacts::run(&pushed_far_away(place), &[]);
        (report.summary.steps, crate::support::column(&report, "z").to_vec())
    });
    assert_eq!(there, beside);
}

/// A satellite with a wheel that turns fast and a panel on a spring whose angle is counted.
const SATELLITE: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
t_end = 100
output_step = 10
tolerance = 1e-6
[[body]]
name = "bus"
mass = 400
inertia = [80, 90, 100]
angular_velocity = [0, 0.01, 0]
velocity = [0, 0, 0]
[[body]]
name = "wheel"
mass = 5
inertia = [0.06, 0.06, 0.1]
angular_velocity = [0, 0.01, 300]
[[body]]
name = "panel"
mass = 30
inertia = [40, 2, 42]
position = [0, 3, 0]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["bus", "wheel"]
[[joint]]
name = "hinge"
type = "revolute"
bodies = ["bus", "panel"]
point = [0, 1, 0]
[[force]]
name = "spring"
type = "SPRING"
bodies = ["bus", "panel"]
point = [0, 1, 0]
params = PARAMS
[[output]]
name = "z"
quantity = "angular_velocity"
of = "panel"
component = "x"
"#;

/// Steps follow the angles that are counted, not what turns beside them: there were 30 000 steps, one for each radian of the wheel.
#[test]
fn a_wheel_does_not_choose_the_steps_of_an_angle_that_is_counted_elsewhere() {
    let with = |kind: &str, params: &str| {
        crate::contacts::run(&SATELLITE.replace("SPRING", kind).replace("PARAMS", params), &[])
    };
    let counted = with("rotational-spring-damper", "{ stiffness = 20 }");
    let bushing = with("bushing", "{ stiffness = [0, 0, 0], rotational_stiffness = [0, 0, 20] }");
    assert!(counted.summary.steps < bushing.summary.steps + 20, "{}", counted.summary.steps);
    let [one, other] = [&counted, &bushing].map(|report| crate::support::column(report, "z"));
    assert!(crate::support::difference(one, other) < 1e-6);
}

/// The place of a particle, computed, and the same place written: one, though they are a rounding apart.
#[test]
fn a_rounding_apart_is_not_beside_a_particle() {
    let text = "[plugins]\nlibraries = [\"forces\"]\n[parameters]\na = 0.1\n[simulation]\nt_end = 1\noutput_step = 0.1\n\
                [[body]]\nname = \"p\"\nmass = 1\nparticle = true\nposition = [\"3 * a\", 0, 0]\n\
                [[force]]\nname = \"s\"\ntype = \"translational-spring-damper\"\nbodies = [\"ground\", \"p\"]\n\
                points = [[0, 0, 0], [0.3, 0, 0]]\nparams = { stiffness = 100, free_length = 0.2 }\n";
    crate::contacts::run(text, &["simulation.formulation=\"joint\""]);
}
