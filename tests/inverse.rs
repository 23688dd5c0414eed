//! Inverse dynamics: efforts that are found for a motion, given back to the scene over time, reproduce it.

use std::fs;
use std::path::Path;

use odyn::analyses::inverse::inverse;
use odyn::analyses::prescribed::{Motion, quantity};
use odyn::analysis::Evaluator;
use odyn::model::{Axes, Level, Quantity};
use odyn::session::Session;

use crate::fed_back::{Begin, Drive, PENDULUM, fed_back, turn, wish};
use crate::support::{Scratch, open_text, options, root};

fn benchmark(name: &str) -> String {
    fs::read_to_string(root().join(format!("scenes/benchmarks/{name}.toml"))).unwrap()
}

/// As many rows as its motion needs: a ball at the piston pin. Friction of the piston on its guide, and of the crank in its bearing.
const SLIDER_CRANK: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.1
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
type = "cylindrical"
bodies = ["crank", "rod"]
point = [0.2, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "ball"
type = "spherical"
bodies = ["rod", "piston"]
point = [0.7, 0, 0]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "piston"]
point = [0.7, 0, 0]
axis = [1, 0, 0]
[[force]]
name = "rubs"
type = "joint-friction"
joints = ["guide"]
params.kind = "translation"
params.mu = 0.15
params.guide_length = 0.1
params.transition_speed = 0.02
[[force]]
name = "rubs_too"
type = "joint-friction"
joints = ["bearing"]
params.kind = "rotation"
params.radius = 0.02
params.mu = 0.1
params.transition_speed = 0.02
"#;

/// A block on a guide with friction that sticks, driven one way.
const BLOCK: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.1
[[body]]
name = "block"
mass = 2
inertia = [0.01, 0.01, 0.01]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "block"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[joint]]
name = "friction"
type = "dry-friction"
bodies = ["ground", "block"]
point = [0, 0, 0]
axis = [1, 0, 0]
params.force = "4 N"
"#;

#[test]
fn efforts_given_back_over_time_reproduce_the_motion() {
    let z = [0, 0, 1];
    let crank = |mut drive: Drive, steady: f64| {
        drive.steady = steady;
        drive
    };
    let pivot = [turn("pivot.angle", ["ground", "rod"], z, 0.7)];
    let off = fed_back("pendulum with friction", PENDULUM, &pivot, 2.0, (0.4, 1e-3), &[], Begin::Before);
    assert!(off < 1e-9, "pendulum with friction: {off:e}");
    let bob = [turn("pivot.angle", ["ground", "bob"], z, 0.5)];
    let two = [turn("shoulder.angle", ["ground", "upper"], z, 0.4), turn("elbow.angle", ["upper", "lower"], z, 0.3)];
    let bricard = [turn("P1.angle", ["ground", "rod1"], [0, 1, 0], 0.3)];
    let link = [turn("A0.angle", ["ground", "link0"], z, 0.5)];
    for (name, drives, h) in [
        ("A01", &bob[..], 2e-3),
        ("dpend", &two[..], 1e-3),
        ("A04", &bricard[..], 2e-3),
        ("A02_N1", &link[..], 2e-3),
        ("A02_N2", &link[..], 2e-3),
    ] {
        let off = fed_back(name, &benchmark(name), drives, 2.0, (0.4, h), &[], Begin::Before);
        assert!(off < 1e-9, "{name}: {off:e}");
    }
    let slow = [crank(turn("bearing.angle", ["ground", "crank"], z, 0.3), 1.0)];
    let off = fed_back("slider-crank with friction", SLIDER_CRANK, &slow, 2.0, (0.4, 1e-3), &[], Begin::Before);
    assert!(off < 1e-9, "slider-crank with friction: {off:e}");
    let push = [Drive {
        coordinate: "guide.displacement",
        bodies: ["ground", "block"],
        axis: [1, 0, 0],
        swing: 0.1,
        steady: 0.5,
        force: true,
    }];
    let off = fed_back("block with dry friction", BLOCK, &push, 2.0, (0.4, 2e-3), &[], Begin::Before);
    assert!(off < 1e-9, "block with dry friction: {off:e}");
}

#[test]
fn efforts_given_back_to_machines_reproduce_the_motion() {
    let z = [0, 0, 1];
    let squeezer = [turn("O.angle", ["ground", "K1"], z, 0.3)];
    let off = fed_back("squeezer", &benchmark("A03"), &squeezer, 30.0, (0.02, 1e-4), &[], Begin::Before);
    assert!(off < 1e-9, "squeezer: {off:e}");
    let mut rotor = turn("main_bearing.angle", ["block", "rotor"], z, 0.1);
    rotor.steady = 10.0;
    let compressor = fs::read_to_string(root().join("scenes/compressor.toml")).unwrap();
    let off = fed_back("compressor", &compressor, &[rotor], 20.0, (0.04, 1e-4), &[], Begin::Before);
    assert!(off < 1e-9, "compressor: {off:e}");
    let names: [(&'static str, [&'static str; 2]); 10] = [
        ("joint1.angle", ["ground", "rod1"]),
        ("joint2.angle", ["rod1", "rod2"]),
        ("joint3.angle", ["rod2", "rod3"]),
        ("joint4.angle", ["rod3", "rod4"]),
        ("joint5.angle", ["rod4", "rod5"]),
        ("joint6.angle", ["rod5", "rod6"]),
        ("joint7.angle", ["rod6", "rod7"]),
        ("joint8.angle", ["rod7", "rod8"]),
        ("joint9.angle", ["rod8", "rod9"]),
        ("joint10.angle", ["rod9", "rod10"]),
    ];
    let chain: Vec<Drive> = names.iter().map(|(name, bodies)| turn(name, *bodies, z, 0.05)).collect();
    let off = fed_back("chain", &benchmark("chain_N10"), &chain, 1.0, (0.1, 2e-3), &[], Begin::Before);
    assert!(off < 1e-9, "chain: {off:e}");
}

fn refused(session: &Session, motion: &Motion, by: &[&str]) -> String {
    let by: Vec<String> = by.iter().map(|name| (*name).to_owned()).collect();
    let error = inverse(session, motion, Some(&by), None, &mut |_| ()).map(|_| ()).expect_err("refused");
    assert_eq!(error.exit_code(), 5, "{error}");
    error.to_string()
}

/// A motion of one coordinate at some values, at rest.
fn held(session: &Session, name: &str, value: f64) -> Motion {
    Motion::through(vec![quantity(session, name).unwrap()], vec![0.0], vec![vec![[value, 0.0, 0.0]]])
}

#[test]
fn more_actuators_than_freedoms_share_by_least_norm() {
    let drives = [turn("P1.angle", ["ground", "rod1"], [0, 1, 0], 0.3)];
    let session = open_text(&benchmark("A04"), &[]);
    let motion = Motion::through(
        vec![quantity(&session, "P1.angle").unwrap()],
        vec![0.3, 0.4],
        vec![[0.3, 0.4].iter().map(|t| wish(0.0, &drives[0], 2.0, 0, *t)).collect()],
    );
    let names = |list: &[&str]| -> Vec<String> { list.iter().map(|name| (*name).to_owned()).collect() };
    let solve = |motion: &Motion, list: &[&str]| {
        inverse(&session, motion, Some(&names(list)), None, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"))
    };
    let (one, other) = (solve(&motion, &["P1.angle"]), solve(&motion, &["P2.angle"]));
    let both = solve(&motion, &["P1.angle", "P2.angle"]);
    assert!(one.notes.iter().all(|note| !note.contains("least sum")), "{:?}", one.notes);
    assert!(both.notes.iter().any(|note| note.contains("least sum of squares")), "{:?}", both.notes);
    // c / a1 and c / a2 alone; a c / |a|^2 together.
    for k in 0..2 {
        let (a, b) = (1.0 / one.efforts[0][k], 1.0 / other.efforts[0][k]);
        let expected = [a / (a * a + b * b), b / (a * a + b * b)];
        for (found, expected) in [both.efforts[0][k], both.efforts[1][k]].iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
    }
}

#[test]
fn what_no_actuator_moves_is_named() {
    // The elbow's weight without a torque there.
    let session = open_text(&benchmark("dpend"), &[]);
    let wanted: Vec<_> = ["shoulder.angle", "elbow.angle"].map(|name| quantity(&session, name).unwrap()).into();
    let motion = Motion::through(wanted, vec![0.0], vec![vec![[0.3, 0.0, 0.0]], vec![[0.4, 0.0, 0.0]]]);
    let message = refused(&session, &motion, &["shoulder.angle"]);
    assert!(message.contains("no actuator moves this: `lower` "), "{message}");
    let message = refused(&session, &held(&session, "shoulder.angle", 0.3), &["shoulder.angle"]);
    assert!(message.contains("leave this free: `lower`"), "{message}");
    // At its dead centre the piston does not move the crank; elsewhere it does.
    let slider_crank = SLIDER_CRANK.replace("gravity = [0, -9.81, 0]", "gravity = [-1, -9.81, 0]");
    let session = open_text(&slider_crank, &[]);
    let message = refused(&session, &held(&session, "bearing.angle", 0.0), &["guide.displacement"]);
    assert!(message.contains("no actuator moves this: `"), "{message}");
    let by = ["guide.displacement".to_owned()];
    inverse(&session, &held(&session, "bearing.angle", 0.3), Some(&by), None, &mut |_| ()).unwrap();
    // Velocities cannot be prescribed by themselves, nor what the joints contradict.
    let message = refused(&session, &held(&session, "guide.displacement", 0.5), &["bearing.angle"]);
    assert!(message.contains("cannot be reached"), "{message}");
}

/// A wheel that turns a hundred million times as fast as what is prescribed, as what a prescribed motion hardly determines does.
#[test]
fn a_motion_that_cannot_be_followed_to_its_end_is_refused() {
    let wheel = |name: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\n[[joint]]\nname = \"{name}_hub\"\ntype = \"revolute\"\n"
        ) + &format!("bodies = [\"ground\", \"{name}\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n")
    };
    let text = "[plugins]\nlibraries = [\"joints\"]\n[simulation]\nt_end = 1\noutput_step = 1\n".to_owned()
        + &wheel("slow")
        + &wheel("fast")
        + "[[joint]]\nname = \"gear\"\ntype = \"coupler\"\nbodies = [\"ground\", \"slow\", \"ground\", \"fast\"]\npoint = [0, 0, 0]\n"
        + "axis = [0, 0, 1]\nparams.ratio = 1e8\n";
    let session = open_text(&text, &[]);
    let quantity = vec![quantity(&session, "slow_hub.angle").unwrap()];
    let motion = Motion::through(quantity, vec![0.0, 1.0], vec![vec![[0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]]);
    let message = refused(&session, &motion, &["slow_hub.angle"]);
    assert!(message.contains("leads no further") && message.contains("bodies move by"), "{message}");
}

#[test]
fn motion_files_have_units_and_derivatives() {
    let session = open_text(&benchmark("A04"), &[]);
    let scratch = Scratch::new();
    let read = |text: &str| Motion::read(&session, &scratch.file("motion.csv", text), None);
    let motion = read("t [ms],P1.angle [deg],P1.angle' [deg/s]\n0,0,0\n100,9,180\n200,36,360\n300,81,540\n").unwrap();
    let [value, slope, bend] = motion.at(0.15)[0];
    let degrees = |x: f64| x.to_degrees();
    // 900 t^2 degrees.
    let off = [degrees(value) - 20.25, degrees(slope) - 270.0, degrees(bend) - 1800.0];
    assert!(off.iter().all(|off| off.abs() < 1e-9), "{off:?}");
    for (text, words) in [
        ("t,P1.angle [mm]\n0,0\n1,1\n2,2\n3,3\n", "an angle"),
        ("t,P1.angel\n0,0\n1,1\n2,2\n3,3\n", "did you mean `P1.angle`"),
        ("x,P1.angle\n0,0\n", "`t` or `time`"),
        ("t,P1.angle\n0,0\n1,x\n", "line 3"),
        ("t,P1.angle\n0,0\n0,1\n", "must increase"),
        ("t,P1.angle\n0,0\n1,1\n", "at least 4"),
        ("t,P1.angle'\n0,0\n1,1\n2,2\n3,3\n", "needs its values"),
    ] {
        let message = read(text).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains(words), "{text}: {message}");
    }
}

/// Values of quantities at an instant of a run.
fn seen(session: &Session, inputs: &[f64], quantities: &[Quantity]) -> Vec<f64> {
    let mut equations = session.equations.clone();
    let nodes: Vec<_> =
        quantities.iter().map(|one| equations.observe(one, &session.model, &session.plan.layout)).collect();
    Evaluator::new(&equations.graph, &nodes).run(inputs, &[]).unwrap().to_vec()
}

/// The largest effort, as a share of the loads, along the coordinates of all joints for the motion that a scene begins with by
/// itself. `None`: these do not determine it, or it is refused for what only a run can tell.
fn needless(path: &Path) -> Option<f64> {
    let open = || Session::open(path, &options(&[], &[])).ok();
    let session = open()?;
    let mut run = open()?.prepare().ok()?.start().ok()?;
    let inputs = run.instant().ok()?.inputs;
    let (mut names, mut coordinates, mut loads) = (Vec::new(), Vec::new(), Vec::new());
    for (element, instance) in session.model.elements.iter().enumerate() {
        let kind = instance.class.kind.word();
        if kind == "control" {
            continue;
        }
        for (coordinate, channel) in instance.class.channels.iter().enumerate().filter(|_| kind == "joint") {
            names.push(format!("{}.{}", instance.name, channel.name));
            coordinates.extend(
                [Level::Position, Level::Velocity, Level::Acceleration].map(|level| Quantity::Coordinate {
                    element,
                    coordinate,
                    level,
                }),
            );
        }
        for frame in 0..instance.markers.len() {
            loads.extend([false, true].into_iter().flat_map(|torque| {
                (0..3).map(move |component| Quantity::Load { element, frame, torque, axes: Axes::Ground, component })
            }));
        }
    }
    let weight: f64 = session.model.bodies.iter().map(|body| body.mass * (session.model.gravity.norm() + 1e-3)).sum();
    let size = seen(&session, &inputs, &loads).iter().fold(weight, |size, load| size.max(load.abs()));
    let values = seen(&session, &inputs, &coordinates);
    let wanted: Vec<_> = names.iter().map(|name| quantity(&session, name).ok()).collect::<Option<_>>()?;
    let nodes = values.chunks(3).map(|one| vec![[one[0], one[1], one[2]]]).collect();
    let motion = Motion::through(wanted, vec![inputs[0]], nodes);
    match inverse(&session, &motion, Some(&names), None, &mut |_| ()) {
        Ok(found) => {
            let most = (found.actuators.iter().zip(&found.efforts))
                .fold(0.0_f64, |most, (port, efforts)| most.max((efforts[0] * port.factor).abs()));
            Some(most / size)
        }
        Err(error) => {
            let message = error.to_string();
            let told = [
                "depends on a",
                "has a memory",
                "need the derivatives",
                "changes with",
                "leave this free",
                "no function of",
            ];
            assert!(told.iter().any(|words| message.contains(words)), "{}: {message}", path.display());
            None
        }
    }
}

/// The motion that a scene begins with needs no effort beside its own loads: whatever the elements of the scene are.
#[test]
fn what_scenes_do_by_themselves_needs_no_effort() {
    let (mut judged, mut wrong) = (0, Vec::new());
    for folder in ["benchmarks", "verification"] {
        for entry in fs::read_dir(root().join("scenes").join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            // The long ones of their families.
            if path.extension().is_none_or(|kind| kind != "toml") || ["chain_N100", "A02_N40"].contains(&name.as_str())
            {
                continue;
            }
            let Some(share) = needless(&path) else { continue };
            judged += 1;
            if share >= 1e-9 || share.is_nan() {
                wrong.push(format!("{name}: {share:e} of the loads"));
            }
        }
    }
    assert!(wrong.is_empty(), "of {judged}: {wrong:#?}");
    assert!(judged >= 30, "{judged}");
}
