//! Mechanisms whose motion is prescribed, with what runs find on the way: contacts, element states, internal unknowns. Runs and closed
//! forms say what must come out.

use std::fs;

use odyn::analyses::inverse::{Inverse, inverse};
use odyn::analyses::kinematics::{Drive, kinematics};
use odyn::analyses::prescribed::{Motion, quantity};
use odyn::results::Status;
use odyn::session::{Session, SessionError};

use crate::fed_back::{Begin, PENDULUM, fed_back, turn};
use crate::support::{column, open_text, options, root};

/// What kinematics says over time of a scene that drives itself is what its run does: servos, cams, profiles, drivers, whatever it is.
#[test]
fn kinematics_over_time_is_what_runs_do() {
    let (mut judged, mut wrong) = (Vec::new(), Vec::new());
    for entry in fs::read_dir(root().join("scenes/verification")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|kind| kind != "toml") {
            continue;
        }
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        // Thousands of turns are followed in steps of a third of a radian.
        if name == "many-turns" {
            continue;
        }
        let sets = ["simulation.tolerance=1e-11"];
        let session = Session::open(&path, &options(&sets, &[])).unwrap_or_else(|error| panic!("{error}"));
        let Ok(found) = kinematics(&session, &Drive::Time, &mut |_| ()) else { continue };
        let run = session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(found.places.len(), run.times.len(), "{name}");
        for (k, port) in found.columns.iter().enumerate() {
            let Some(channel) = run.channels.iter().find(|channel| channel.name == port.name) else { continue };
            let size = found.values[k].iter().fold(1e-6, |most: f64, value| most.max(value.abs()));
            let off = (column(&run, &channel.name).iter().zip(&found.values[k]))
                .map(|(run, found)| (run - found).abs() / size)
                .fold(0.0, |most: f64, off| if off <= most { most } else { off });
            if off.is_nan() || off > 1e-8 {
                wrong.push(format!("{name}, {}: {off:e}", port.name));
            }
        }
        judged.push(name);
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    for name in ["servo-rotation", "servo-displacement", "ellipse-contact", "profile-contact", "cam"] {
        assert!(judged.iter().any(|one| one == name), "`{name}` is not among {judged:?}");
    }
}

const LAG: &str = r#"
[[control]]
name = "gauge"
type = "sensor"
inputs = { input = "c0" }
params.time_constant = 0.05
[[control]]
name = "filter"
type = "transfer-function"
inputs = { input = "gauge.output" }
params.numerator = [3, 8]
params.denominator = [0.02, 1]
[[force]]
name = "follows"
type = "rotational-actuator"
bodies = ["ground", "rod"]
axis = [0, 0, 1]
inputs = { signal = "filter.output" }
"#;

const DAMPER: &str = r#"
[[force]]
name = "damper"
type = "hydraulic-damper"
bodies = ["ground", "rod"]
points = [[0.1, -0.6, 0], [0.5, 0, 0]]
params.area = 0.001
params.laminar_1 = 3e7
params.laminar_2 = 1e7
params.turbulent_2 = 4e11
"#;

/// An arm on another one that a servo turns.
const ON_A_SERVO: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.1
[[body]]
name = "base"
mass = 3
inertia = [0.1, 0.1, 0.2]
position = [0.2, 0, 0]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "base"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "servo"
type = "servo-rotation"
bodies = ["ground", "base"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.angle = 0.8
params.frequency = 9
params.damping = 0.6
[[body]]
name = "arm"
mass = 1.5
inertia = [0.01, 0.1, 0.1]
position = [0.7, 0, 0]
[[joint]]
name = "elbow"
type = "revolute"
bodies = ["base", "arm"]
point = [0.4, 0, 0]
axis = [0, 0, 1]
"#;

/// States begin as the scene gives them: the motion, and the efforts, are known from there on only.
#[test]
fn efforts_along_states_and_unknowns_reproduce_the_motion() {
    let z = [0, 0, 1];
    let pivot = [turn("pivot.angle", ["ground", "rod"], z, 0.6)];
    let lag = PENDULUM.replace("\"forces\"]", "\"forces\", \"controls\"]").to_owned() + LAG;
    let damper = PENDULUM.to_owned() + DAMPER;
    let elbow = [turn("elbow.angle", ["base", "arm"], z, 0.4)];
    for (name, text, drives, h, begin) in [
        ("pendulum that a slow controller pulls", lag.as_str(), &pivot, 5e-4, Begin::Continued),
        ("pendulum with a hydraulic damper", &damper, &pivot, 4e-4, Begin::Before),
        ("arm on a servo", ON_A_SERVO, &elbow, 5e-4, Begin::Continued),
    ] {
        let off = fed_back(name, text, drives, 2.0, (0.4, h), &[], begin);
        assert!(off < 1e-9, "{name}: {off:e}");
    }
}

/// What efforts given back miss is due to the table that gives them: where its spline begins without curvature, with the step of a
/// servo, it grows as the third power of the spacing of its points; and the efforts at these points are those of any other spacing.
#[test]
fn what_efforts_given_back_along_states_miss_is_due_to_their_table() {
    let elbow = [turn("elbow.angle", ["base", "arm"], [0, 0, 1], 0.4)];
    let off = |h: f64| fed_back("arm on a servo", ON_A_SERVO, &elbow, 2.0, (0.4, h), &[], Begin::There);
    let [coarse, medium, fine] = [2e-3, 1e-3, 5e-4].map(off);
    for (coarse, fine) in [(coarse, medium), (medium, fine)] {
        let order = (coarse / fine).log2();
        assert!((order - 3.0).abs() < 0.03, "{coarse:e} {fine:e}: {order}");
    }
    let swing = |t: f64| [0.4 * (1.0 - (2.0 * t).cos()), 0.8 * (2.0 * t).sin(), 1.6 * (2.0 * t).cos()];
    let session = open_text(ON_A_SERVO, &[]);
    let efforts = |h: f64| {
        let times: Vec<f64> = (0..=(0.4 / h).round() as i32).map(|k| f64::from(k) * h).collect();
        let found = asked(&session, &[("elbow.angle", &swing)], &["elbow.angle"], &times);
        found.unwrap_or_else(|error| panic!("{error}")).efforts.remove(0)
    };
    let (coarse, fine) = (efforts(1e-2), efforts(5e-4));
    let most = fine.iter().fold(0.0_f64, |most, effort| most.max(effort.abs()));
    for (k, effort) in coarse.iter().enumerate() {
        let off = (effort - fine[20 * k]).abs() / most;
        assert!(off < 1e-10, "{k}: {off:e}");
    }
}

/// A block on a table, held in a plane; the table is where `table` says.
fn block(mu: f64, table: &str, height: f64, more: &str) -> String {
    format!(
        "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 0.4\noutput_step = 0.05\n\
         tolerance = 1e-12\n\
         [[body]]\nname = \"table\"\nmass = 5\ninertia = [1, 1, 1]\n\
         [[joint]]\nname = \"leg\"\ntype = \"translational\"\nbodies = [\"ground\", \"table\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
         [[joint]]\nname = \"lift\"\ntype = \"displacement-driver\"\nbodies = [\"ground\", \"table\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
         params.displacement = \"{table}\"\n\
         [[body]]\nname = \"block\"\nmass = 2\nparticle = true\nposition = [0, 0, {height:?}]\nvelocity = [0.5, 0, 0]\n\
         [[joint]]\nname = \"wall\"\ntype = \"point-in-plane\"\nbodies = [\"ground\", \"block\"]\naxis = [0, 1, 0]\n\
         [[joint]]\nname = \"rests\"\ntype = \"plane-contact\"\nbodies = [\"table\", \"block\"]\n\
         frames = [{{ position = [0, 0, 0], axis = [0, 0, 1] }}, {{ position = [0, 0, 0] }}]\nparams.mu = {mu:?}\n\
         [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"block\"\ncomponent = \"x\"\n\
         [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"block\"\ncomponent = \"z\"\n\
         [[output]]\nname = \"N\"\nquantity = \"reaction_force\"\nof = \"rests\"\non = \"block\"\ncomponent = \"z\"\n{more}"
    )
}

type Wish = dyn Fn(f64) -> [f64; 3];

fn asked(session: &Session, wishes: &[(&str, &Wish)], by: &[&str], times: &[f64]) -> Result<Inverse, SessionError> {
    let wanted = wishes.iter().map(|(name, _)| quantity(session, name).unwrap()).collect();
    let nodes = wishes.iter().map(|(_, wish)| times.iter().map(|t| wish(*t)).collect()).collect();
    let by: Vec<String> = by.iter().map(|name| (*name).to_owned()).collect();
    inverse(session, &Motion::through(wanted, times.to_vec(), nodes), Some(&by), None, &mut |_| ())
}

fn refused(session: &Session, wishes: &[(&str, &Wish)], by: &[&str], times: &[f64]) -> String {
    let error = asked(session, wishes, by, times).map(|_| ()).expect_err("refused");
    assert_eq!(error.exit_code(), 5, "{error}");
    error.to_string()
}

/// Pushed over a table with friction: the contact holds the block up, and friction follows its reaction. The push given back moves it so.
#[test]
fn a_block_pushed_over_a_table_leans_on_it() {
    let (mu, g) = (0.3, 9.81);
    // The table rises and sinks, so that the weight changes.
    let lift = "0.05 * (1 - cos(3 * t))";
    let push = |t: f64| [0.5 * t + 0.1 * (1.0 - (2.0 * t).cos()), 0.5 + 0.2 * (2.0 * t).sin(), 0.4 * (2.0 * t).cos()];
    let normal = |t: f64| 2.0 * (g + 0.45 * (3.0 * t).cos());
    let times: Vec<f64> = (-16..=416).map(|k| 1e-3 * f64::from(k)).collect();
    let text = block(mu, lift, 0.0, "");
    let found =
        asked(&open_text(&text, &[]), &[("x", &push)], &["x"], &times).unwrap_or_else(|error| panic!("{error}"));
    assert!(
        found.notes.iter().any(|note| note.contains("hold the mechanism as joints do: rests")),
        "{:?}",
        found.notes
    );
    for (k, t) in times.iter().enumerate() {
        let expected = 2.0 * push(*t)[2] + mu * normal(*t);
        assert!((found.efforts[0][k] - expected).abs() < 1e-9 * expected.abs(), "{t}: {}", found.efforts[0][k]);
        assert!((found.values[2][k] - normal(*t)).abs() < 1e-9 * normal(*t), "{t}: {}", found.values[2][k]);
    }
    let pairs: Vec<String> = times.iter().zip(&found.efforts[0]).map(|(t, u)| format!("[{t:?}, {u:?}]")).collect();
    let pushed = format!(
        "[[force]]\nname = \"push\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"block\"]\n\
         params.x = {{ points = [{}], interpolation = \"spline\" }}\n",
        pairs.join(", ")
    );
    let run = open_text(&block(mu, lift, 0.0, &pushed), &[]).run(None, Box::new(|_| ()), &Default::default()).unwrap();
    for (t, x) in run.times.iter().zip(column(&run, "x")) {
        assert!((x - push(*t)[0]).abs() < 1e-10, "{t}: {x}");
    }
}

/// Lifted off a table: while it stands, the table carries it, and the lift nothing; from the first acceleration on the lift all of it.
#[test]
fn contacts_push_and_do_not_pull() {
    let g = 9.81;
    let text = block(0.0, "0", 0.0, "").replace("[0.5, 0, 0]", "[0, 0, 0]");
    let session = open_text(&text, &[]);
    let still = |_: f64| [0.0; 3];
    let times = [0.0, 0.1, 0.2];
    let found = asked(&session, &[("x", &still), ("z", &still)], &["x", "z"], &times).unwrap();
    assert!(found.efforts.iter().flatten().all(|effort| effort.abs() < 1e-9), "{:?}", found.efforts);
    assert!((found.values[2][1] - 2.0 * g).abs() < 1e-9, "{:?}", found.values);
    let lift = |t: f64| [0.5 * t * t, t, 1.0];
    let found = asked(&session, &[("x", &still), ("z", &lift)], &["x", "z"], &times).unwrap();
    assert!(found.efforts[1].iter().all(|effort| (effort - 2.0 * (g + 1.0)).abs() < 1e-9), "{:?}", found.efforts);
    assert!(found.values[2].iter().all(|normal| *normal == 0.0), "{:?}", found.values);
    // Into the table; onto it with a speed; away under it.
    let down = |t: f64| [-0.1 * t * t, -0.2 * t, -0.2];
    let message = refused(&session, &[("x", &still), ("z", &down)], &["x", "z"], &times);
    assert!(message.contains("goes through `rests"), "{message}");
    let strike = |t: f64| [0.2 - t, -1.0, 0.0];
    let above = open_text(&block(0.0, "0", 0.2, "").replace("[0.5, 0, 0]", "[0, 0, 0]"), &[]);
    let message = refused(&above, &[("x", &still), ("z", &strike)], &["x", "z"], &times);
    assert!(message.contains("runs into `rests") && message.contains("impulse"), "{message}");
    let message = refused(&above, &[("x", &still)], &["x"], &times);
    assert!(message.contains("leave this free: `block` moves along"), "{message}");
    let shaken = open_text(&block(0.0, "0.2 * (1 - cos(8 * t))", 0.0, "").replace("[0.5, 0, 0]", "[0, 0, 0]"), &[]);
    let times: Vec<f64> = (0..40).map(|k| 0.01 * f64::from(k)).collect();
    let message = refused(&shaken, &[("x", &still)], &["x"], &times);
    assert!(message.contains("`rests: gap` would have to pull"), "{message}");
}

/// Kinematics goes by joints and drivers: stops do not end it, and it says where they would; where it leans on a contact, it follows it.
#[test]
fn kinematics_says_which_contacts_it_leans_on_and_goes_through() {
    let stop = "[[joint]]\nname = \"frame\"\ntype = \"rotational-stop\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
                params.upper = 1\n";
    let session = open_text(&(PENDULUM.to_owned() + stop), &[]);
    let drive = Drive::read(&session, "pivot.angle=0:2:21").unwrap();
    let found = kinematics(&session, &drive, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"));
    let note = found.notes.iter().find(|note| note.contains("goes through `frame")).unwrap();
    assert!(note.contains("10 places") && note.contains("= 1.1 and 2 rad"), "{note}");
    let session = open_text(&block(0.3, "0.05 * sin(4 * t)", 0.0, ""), &[]);
    // Nothing drives it along x.
    let error = kinematics(&session, &Drive::Time, &mut |_| ()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("leave this free: `block` moves along"), "{error}");
    let held =
        "[[joint]]\nname = \"side\"\ntype = \"point-in-plane\"\nbodies = [\"ground\", \"block\"]\naxis = [1, 0, 0]\n";
    let text = block(0.3, "0.05 * sin(4 * t)", 0.0, held).replace("[0.5, 0, 0]", "[0, 0, 0.2]");
    let session = open_text(&text, &[]);
    let found = kinematics(&session, &Drive::Time, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"));
    let k = found.columns.iter().position(|column| column.name == "z").unwrap();
    for (t, z) in found.places.iter().zip(&found.values[k]) {
        assert!((z - 0.05 * (4.0 * t).sin()).abs() < 1e-12, "{t}: {z}");
    }
    assert!(found.notes.iter().any(|note| note.contains("as joints do: rests")), "{:?}", found.notes);
}

/// What changes only between the steps of a run, or with an effort that is asked for, has no answer.
#[test]
fn what_only_a_run_can_tell_is_refused_by_name() {
    let path = root().join("scenes/verification/stepper-rotation.toml");
    let session = Session::open(&path, &options(&[], &[])).unwrap();
    let error = kinematics(&session, &Drive::Time, &mut |_| ()).map(|_| ()).expect_err("refused");
    let message = error.to_string();
    assert!(message.contains("what `stepping` does: it has a memory") && error.exit_code() == 5, "{message}");
    let slow = PENDULUM.replace("\"forces\"]", "\"forces\", \"controls\"]").to_owned()
        + &LAG.replace("c0", "torque")
        + "[[input]]\nname = \"torque\"\n";
    let session = open_text(&slow, &[]);
    let message = refused(&session, &[("pivot.angle", &|t| [t * t, 2.0 * t, 2.0])], &["torque"], &[0.0, 0.1]);
    assert!(message.contains("the actuator `torque` acts by way of a state"), "{message}");
}

/// The lift of a roller on an oval cam stops four times in a turn, where the place of the contact is a quarter turn on from zero: at zero,
/// an internal unknown has no size of its own.
#[test]
fn the_whole_motion_of_a_cam_has_the_dead_points_of_its_profile() {
    for (size, direction) in [(1.0, [0.0, 0.0, 1.0]), (1e-3, [0.3, -0.5, 0.8]), (200.0, [-0.7, 0.1, 0.2])] {
        // Axes of the plane from its normal.
        let z = nalgebra::Vector3::from(direction).normalize();
        let x = z.cross(&nalgebra::Vector3::x()).normalize();
        let y = z.cross(&x);
        let list = |v: nalgebra::Vector3<f64>| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
        let frame = format!("axis = {}, x_axis = {}", list(z), list(x));
        let scene = format!(
            "[plugins]\nlibraries = [\"joints\"]\n[simulation]\nt_end = 1\noutput_step = 0.1\n\
             [[body]]\nname = \"cam\"\nmass = 1\ninertia = [1, 1, 1]\n\
             [[body]]\nname = \"roller\"\nmass = 1\ninertia = [1, 1, 1]\nposition = {}\n\
             [[joint]]\nname = \"shaft\"\ntype = \"revolute\"\nbodies = [\"ground\", \"cam\"]\naxis = {}\n\
             [[joint]]\nname = \"slide\"\ntype = \"translational\"\nbodies = [\"ground\", \"roller\"]\naxis = {}\n\
             [[joint]]\nname = \"contact\"\ntype = \"profile-contact\"\nbodies = [\"cam\", \"roller\"]\n\
             frames = [{{ {frame} }}, {{ {frame} }}]\n\
             params = {{ radius = \"{:?} + {:?} * cos(2 * phi)\", roller_radius = {:?}, start = 1.5707963 }}\n\
             [[output]]\nname = \"lift\"\nquantity = \"coordinate\"\nof = \"slide\"\n",
            list(y * (0.43 * size)),
            list(z),
            list(y),
            0.4 * size,
            0.02 * size,
            0.05 * size
        );
        let session = open_text(&scene, &[]);
        let drive = Drive::read(&session, "shaft.angle").unwrap();
        let found = kinematics(&session, &drive, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"));
        assert!(found.closed, "{size}: {:?}", found.notes);
        let lifts: Vec<f64> = found.dead_points.iter().map(|dead| dead.values[0] / size).collect();
        assert_eq!(lifts.len(), 4, "{size}: {lifts:?}");
        for lift in lifts {
            assert!((lift - 0.43).abs().min((lift - 0.47).abs()) < 1e-12, "{size}: {lift}");
        }
        let [low, high] = found.extents[0].values;
        assert!((high - low - 0.04 * size).abs() < 1e-12 * size, "{size}: from {low} to {high}");
    }
}

/// A crank that begins smoothly, by a law of motion in whose rate terms cancel.
fn smooth_start(angle: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["joints"]
[simulation]
gravity = [0, -9.81, 0]
t_end = 3
output_step = 0.05
[[body]]
name = "crank"
mass = 1
inertia = [0.01, 0.01, 0.01]
com = [0.05, 0, 0]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "motor"
type = "rotation-driver"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.angle = "{angle}"
[[output]]
name = "speed"
quantity = "angular_velocity"
of = "crank"
component = "z"
"#
    )
}

/// The rate of `t - sin(t)` is known to a step of 1.1e-16: as much as it is itself where the motion begins. Such a step is no motion
/// that steps would have to follow.
#[test]
fn what_begins_smoothly_is_driven_from_the_first_step_on() {
    type Rate = fn(f64) -> f64;
    let laws: [(&str, Rate); 6] = [
        ("t - sin(t)", |t| 2.0 * (0.5 * t).sin().powi(2)),
        ("pi * t / 3 - sin(2 * pi * t / 3) / 2", |t| {
            2.0 * std::f64::consts::FRAC_PI_3 * (std::f64::consts::FRAC_PI_3 * t).sin().powi(2)
        }),
        ("6 * (t - tanh(t))", |t| 6.0 * t.tanh().powi(2)),
        ("t - atan(t)", |t| t * t / (1.0 + t * t)),
        // After a rest.
        ("max(0, t - 0.5)^2", |t| 2.0 * (t - 0.5).max(0.0)),
        ("max(0, t - 0.5) - sin(max(0, t - 0.5))", |t| 2.0 * (0.5 * (t - 0.5).max(0.0)).sin().powi(2)),
    ];
    for (angle, rate) in laws {
        for formulation in ["joint", "cartesian"] {
            let session = open_text(&smooth_start(angle), &[&format!("simulation.formulation={formulation}")]);
            let run = session.run(None, Box::new(|_| ()), &Default::default());
            let run = run.unwrap_or_else(|error| panic!("{angle}, {formulation}: {error}"));
            assert_eq!(run.summary.status, Status::Completed, "{angle}, {formulation}");
            for (t, speed) in run.times.iter().zip(column(&run, "speed")) {
                assert!((speed - rate(*t)).abs() < 1e-14 * 6.0, "{angle}, {formulation}: {speed:e} at {t}");
            }
        }
    }
}
