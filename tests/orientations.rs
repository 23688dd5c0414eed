//! Euler parameters as signals: what small turns do to them is part of every derivative. A wheel that a torque -g e3 drives back,
//! e3 = sin(phi / 2): I phi'' = -g sin(phi / 2). And angles that begin at half a turn.

use std::f64::consts::PI;

use odyn::analyses::inverse::inverse;
use odyn::analyses::kinematics::{Drive, kinematics};
use odyn::analyses::linear::Linear;
use odyn::analyses::modes::{Modes, Stability};
use odyn::analyses::prescribed::{Motion, quantity};
use odyn::analyses::statics::equilibrium;
use odyn::results::Status;
use odyn::session::Session;

use crate::support::{Scratch, open_text, options};

const INERTIA: f64 = 0.1;
const GAIN: f64 = 8.0;
const ANGLE: f64 = 0.4;

/// `close`: what turns it.
fn wheel(close: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
t_end = 1
output_step = 0.1
[[body]]
name = "wheel"
mass = 1
inertia = [0.3, 0.3, {INERTIA}]
orientation = {{ axis = [0, 0, 1], angle = {ANGLE} }}
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "wheel"]
frames = [{{ axis = [0, 0, 1] }}, {{ axis = [0, 0, 1] }}]
[[output]]
name = "e3"
quantity = "orientation"
of = "wheel"
component = "e3"
[[output]]
name = "spin"
quantity = "coordinate_rate"
of = "bearing"
{close}"#
    )
}

fn driven_back() -> String {
    wheel(&format!(
        "[[force]]\nname = \"back\"\ntype = \"rotational-actuator\"\nbodies = [\"ground\", \"wheel\"]\naxis = [0, 0, 1]\n\
         params.gain = -{GAIN}\ninputs = {{ signal = \"e3\" }}\n"
    ))
}

#[test]
fn what_follows_them_drives_back() {
    let session = open_text(&driven_back(), &[]);
    let rest = equilibrium(&session, &mut |_| ()).unwrap();
    assert_eq!(rest.stability, Stability::Undamped, "{:?}", rest.modes);
    let linear = Linear::at(&session, &rest.instant, Some(&[]), None).unwrap();
    let found = Modes::of(&session, &linear).unwrap();
    let (frequency, expected) = (found.modes[0].frequency, (GAIN / (2.0 * INERTIA)).sqrt() / std::f64::consts::TAU);
    assert!((frequency - expected).abs() < 1e-12, "{frequency} {expected}");
    // Newton's steps, and no creeping.
    assert!(rest.steps < 60, "{}", rest.steps);
}

#[test]
fn outputs_of_linear_models_follow_small_turns() {
    let session = open_text(&wheel(""), &[]);
    let at = open_text(&wheel(""), &[]).prepare().unwrap().start().unwrap().instant().unwrap();
    let linear = Linear::at(&session, &at, None, None).unwrap();
    // e3 by the coordinate, and the rate of the angle by the coordinate's rate, which has the same unit.
    let ratio = linear.c[(0, 0)] / linear.c[(1, 1)];
    assert!((ratio - 0.5 * (ANGLE / 2.0).cos()).abs() < 1e-15, "{ratio}");
}

#[test]
fn mechanisms_carry_them_along() {
    let session = open_text(&wheel(""), &[]);
    let angle = quantity(&session, "bearing.angle").unwrap();
    let over = kinematics(&session, &Drive::Over(angle, [0.0, 2.0], 9), &mut |_| ()).unwrap();
    for (name, of) in [("e3'", (|x: f64| 0.5 * x.cos()) as fn(f64) -> f64), ("e3''", |x| -0.25 * x.sin())] {
        let column = over.columns.iter().position(|port| port.name == name).unwrap();
        for (place, value) in over.places.iter().zip(&over.values[column]) {
            assert!((value - of(0.5 * place)).abs() < 1e-12, "{name} at {place}: {value}");
        }
    }
}

#[test]
fn they_can_be_prescribed() {
    let session = open_text(&wheel(""), &[]);
    // phi = 0.4 + 0.3 t^2.
    let times: Vec<f64> = (0..9).map(|k| f64::from(k) / 8.0).collect();
    let nodes = times.iter().map(|t| {
        let (half, rate) = (0.5 * (ANGLE + 0.3 * t * t), 0.3 * t);
        [half.sin(), half.cos() * rate, half.cos() * 0.3 - half.sin() * rate * rate]
    });
    let motion = Motion::through(vec![quantity(&session, "e3").unwrap()], times.clone(), vec![nodes.collect()]);
    let by = ["bearing.angle".to_owned()];
    let found = inverse(&session, &motion, Some(&by), None, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"));
    for (k, t) in times.iter().enumerate() {
        let torque = found.efforts[0][k];
        assert!((torque - 0.6 * INERTIA).abs() < 1e-11, "{torque} at {t}");
    }
}

/// A hinge whose frames are opposite, with a spring that is relaxed there: round-off has it begin at pi or at -pi, by its orientation,
/// and in coordinates of bodies or of the joint.
#[test]
fn half_a_turn_at_the_start_is_positive() {
    for step in 0..24 {
        let (a, b) = (0.37 * f64::from(step), 1.91 * f64::from(step));
        let axis = [a.sin() * b.cos(), a.sin() * b.sin(), a.cos()];
        let across = [a.cos() * b.cos(), a.cos() * b.sin(), -a.sin()];
        let frames = format!(
            "bodies = [\"ground\", \"wheel\"]\npoints = [[0, 0, 0], [0, 0, 0]]\naxes = [{axis:?}, {axis:?}]\n\
             x_axes = [{:?}, {across:?}]\n",
            across.map(|x| -x)
        );
        let text = format!(
            "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\nt_end = 1\noutput_step = 0.5\n[[body]]\nname = \"wheel\"\n\
             mass = 1\ninertia = [1, 2, 2.5]\norientation = {{ axis = [1, {b}, {a}], angle = {a} }}\n[[joint]]\nname = \"hinge\"\n\
             type = \"revolute\"\n{frames}[[force]]\nname = \"spring\"\ntype = \"rotational-spring-damper\"\n{frames}\
             params.stiffness = 5\nparams.free_angle = \"180 deg\"\n[[output]]\nname = \"angle\"\nquantity = \"coordinate\"\n\
             of = \"hinge\"\n[[output]]\nname = \"torque\"\nquantity = \"value\"\nof = \"spring\"\nchannel = \"torque\"\n"
        );
        for formulation in ["cartesian", "joint"] {
            let set = format!("simulation.formulation=\"{formulation}\"");
            let run = open_text(&text, &[&set]).run(None, Box::new(|_| ()), &Default::default()).unwrap();
            assert!(run.columns[0].iter().all(|angle| (angle - PI).abs() < 1e-12), "{step}: {:?}", run.columns[0]);
            assert!(run.columns[1].iter().all(|torque| torque.abs() < 1e-11), "{step}: {:?}", run.columns[1]);
        }
    }
}

/// A body in some orientation, and another that is prescribed as a whole, in degrees.
fn prescribed(axis: [f64; 3], angle: f64, wanted: [f64; 3]) -> String {
    let [x, y, z] = wanted;
    format!(
        "[plugins]\nlibraries = [\"joints\"]\n[units]\nangle = \"deg\"\n[simulation]\nt_end = 1\noutput_step = 0.5\n[[body]]\n\
         name = \"table\"\nmass = 1\ninertia = [1, 2, 2.5]\norientation = {{ axis = {axis:?}, angle = {angle:?} }}\n[[joint]]\n\
         name = \"shaker\"\ntype = \"position\"\nbodies = [\"ground\", \"table\"]\nframes = [{{}}, {{}}]\n\
         params = {{ x = 0, y = 0, z = 0, about_x = {x:?}, about_y = {y:?}, about_z = {z:?} }}\n"
    )
}

/// Bodies that are far from an orientation that is prescribed as a whole are refused with how far they are, half a turn included, and
/// never taken for assembled half a turn away.
#[test]
fn a_body_far_from_its_prescribed_orientation_is_told_how_far() {
    let scratch = Scratch::new();
    let mut far = Vec::new();
    for angle in [60.0, 90.0, 100.0, 150.0, 170.0, 175.0, 179.9, 180.0] {
        far.extend(
            [[angle, 0.0, 0.0], [0.0, angle, 0.0], [0.0, 0.0, angle]]
                .map(|wanted| ([1.0, 0.0, 0.0], 0.0, wanted, angle)),
        );
        for axis in [[0.0, 0.0, 1.0], [1.0, -1.0, 0.0], [1.0, 2.0, 3.0], [-1.0, -1.0, 1.0]] {
            far.push((axis, angle, [0.0; 3], angle));
        }
    }
    // Half a turn about axes in no plane of others.
    far.push(([1.0, 0.0, 0.0], 0.0, [180.0, 0.0, 90.0], 180.0));
    far.push(([1.0, 0.0, 0.0], 0.0, [180.0, 45.0, 0.0], 180.0));
    for (axis, angle, wanted, expected) in far {
        let file = scratch.file("far.toml", prescribed(axis, angle, wanted));
        let error = Session::open(&file, &options(&[], &[])).err().map(|error| error.to_string()).unwrap_or_default();
        let by = format!("moved by 0 m and {expected} deg to meet the joints");
        assert!(error.contains(&by), "{axis:?} {angle} {wanted:?}: {error}");
    }
    let near = open_text(&prescribed([0.0, 1.0, 0.0], 170.0, [0.0, 180.0, 0.0]), &[]);
    let run = near.run(None, Box::new(|_| ()), &Default::default()).expect("it is near enough");
    assert_eq!(run.summary.status, Status::Completed);
}

/// Stops count from the turn that is between them: a body half a turn and more away from zero begins where they say.
#[test]
fn stops_begin_between_their_ends() {
    let begins = |table: &str, ends: &str, angle: f64| {
        let kind = if table == "joint" { "rotational-stop" } else { "rotational-bump-stop" };
        let more = if table == "joint" { "" } else { ", torque = 100, depth = 1" };
        let text = format!(
            "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[units]\nangle = \"deg\"\n[simulation]\nt_end = 0.1\noutput_step = 0.05\n\
             [[body]]\nname = \"arm\"\nmass = 1\ninertia = [1, 2, 2.5]\norientation = {{ axis = [0, 0, 1], angle = {angle:?} }}\n\
             [[joint]]\nname = \"hinge\"\ntype = \"revolute\"\nbodies = [\"ground\", \"arm\"]\nframes = [{{}}, {{}}]\n\
             [[{table}]]\nname = \"stop\"\ntype = \"{kind}\"\nbodies = [\"ground\", \"arm\"]\nframes = [{{}}, {{}}]\n\
             params = {{ {ends}{more} }}\n[[output]]\nname = \"spin\"\nquantity = \"coordinate_rate\"\nof = \"hinge\"\n"
        );
        let scratch = Scratch::new();
        let session = Session::open(&scratch.file("stop.toml", text), &options(&[], &[]));
        let run = session.and_then(|session| session.run(None, Box::new(|_| ()), &Default::default()));
        run.is_ok_and(|run| run.events.is_empty() && run.columns[0].iter().all(|spin| spin.abs() < 1e-12))
    };
    for table in ["joint", "force"] {
        for (ends, angles) in [
            ("lower = 100, upper = 300", &[101.0, 180.0, 200.0, -160.0, -61.0][..]),
            ("lower = -300, upper = -100", &[-101.0, 160.0, 180.0]),
            ("lower = -180, upper = 0", &[-180.0, 180.0, -90.0, 0.0]),
            ("lower = 0, upper = 360", &[0.0, 90.0, 180.0, 200.0, 359.0]),
            ("lower = -400, upper = 10", &[0.0, 9.0, 20.0, 200.0, -170.0]),
            ("lower = 100", &[100.5, 180.0, -160.0]),
            ("upper = -190", &[-191.0, 90.0]),
        ] {
            for angle in angles {
                assert!(begins(table, ends, *angle), "{table} {ends}: {angle}");
            }
        }
        for (ends, angle) in
            [("lower = -90, upper = 90", 100.0), ("lower = 100, upper = 300", 90.0), ("lower = -90", -100.0)]
        {
            assert!(!begins(table, ends, angle), "{table} {ends}: {angle}");
        }
    }
}

/// Bodies that turn by 10 rad and more from one output to the next, on joints of all ways to turn: about an axis in either order, about two,
/// about three, as a screw, as a gear.
fn turning(step: f64) -> String {
    let body = |name: &str, at: [f64; 3], spin: &str| {
        let of = |e: &str| {
            format!(
                "[[output]]\nname = \"{name}_{e}\"\nquantity = \"orientation\"\nof = \"{name}\"\ncomponent = \"{e}\"\n"
            )
        };
        let outputs: String = ["e0", "e1", "e2", "e3"].map(of).concat();
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1.2, 1.5]\nposition = {at:?}\n{spin}\
             orientation = {{ axis = [1, 2, 3], angle = 2.5 }}\n{outputs}"
        )
    };
    let joint = |name: &str, kind: &str, bodies: &str, at: [f64; 3], more: &str| {
        format!("[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = {bodies}\npoint = {at:?}\n{more}\n")
    };
    format!(
        "[plugins]\nlibraries = [\"joints\", \"forces\", \"controls\"]\n[simulation]\nt_end = 2\noutput_step = {step:?}\n\
         [[control]]\nname = \"on\"\ntype = \"signal-source\"\n\
         params.function = {{ points = [[0, 0], [1.1, 1]], interpolation = \"steps\" }}\n"
    ) + &[
        body("rotor", [0.0; 3], "angular_velocity = [0, 0, 40]\n"),
        joint("hinge", "revolute", "[\"rotor\", \"ground\"]", [0.0; 3], "axis = [0, 0, 1]"),
        // It stops on the way.
        joint("brake", "clutch", "[\"rotor\", \"ground\"]", [0.0; 3], "axis = [0, 0, 1]\nparams.capacity = 0")
            + "inputs.engagement = { signal = \"on.output\", gain = \"200 N m\" }\n",
        body("pinion", [1.0, 0.0, 0.0], ""),
        joint("bearing", "revolute", "[\"ground\", \"pinion\"]", [1.0, 0.0, 0.0], "axis = [0, 0, 1]"),
        "[[joint]]\nname = \"mesh\"\ntype = \"gear\"\nbodies = [\"ground\", \"rotor\", \"ground\", \"pinion\"]\naxis = [0, 0, 1]\n\
         points = [[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0]]\nparams = { radius_1 = 0.7, radius_2 = 0.3 }\n"
            .to_owned(),
        body("nut", [0.0, 3.0, 0.0], "angular_velocity = [30, 0, 0]\n"),
        joint("thread", "screw", "[\"ground\", \"nut\"]", [0.0, 3.0, 0.0], "axis = [1, 0, 0]\nparams.pitch = 0.01"),
        body("cross", [5.0, 0.0, 0.0], "angular_velocity = [0, 25, 0]\n"),
        joint("pins", "universal", "[\"ground\", \"cross\"]", [5.0, 0.0, 0.0], "axes = [[0, 1, 0], [0, 0, 1]]"),
        body("top", [5.0, 0.0, 0.0], "angular_velocity = [21, 3, 0]\n"),
        joint("ball", "spherical", "[\"cross\", \"top\"]", [5.0, 0.0, 0.0], ""),
    ]
    .concat()
}

/// Whatever the coordinates, and however far bodies turn between two looks at them: of the two sets of Euler parameters it is that which
/// continues from the start.
#[test]
fn euler_parameters_continue_however_far_bodies_turn() {
    let run = |step: f64, set: &str| {
        let sets = ["simulation.tolerance=1e-10", set];
        let report = open_text(&turning(step), &sets).run(None, Box::new(|_| ()), &Default::default());
        report.unwrap_or_else(|error| panic!("{set}: {error}"))
    };
    let exact = run(0.25, "simulation.formulation=cartesian");
    assert_eq!(exact.summary.status, Status::Completed, "{}", exact.summary.reason);
    for (step, set) in [
        (0.25, "simulation.formulation=joint"),
        (1.0, "simulation.formulation=joint"),
        (2.0, "simulation.formulation=joint"),
        (1.0, "simulation.method=radau5"),
        (1.0, "simulation.formulation=cartesian"),
    ] {
        let found = run(step, set);
        let every = (step / 0.25) as usize;
        for (channel, (found, exact)) in found.channels.iter().zip(found.columns.iter().zip(&exact.columns)) {
            for (k, found) in found.iter().enumerate() {
                let off = (found - exact[every * k]).abs();
                assert!(off < 1e-6, "{set}, {step} s: `{}` at {} s is off by {off:e}", channel.name, step * k as f64);
            }
        }
    }
    // The first turns by 40 rad in 1 s.
    let angle = |axis: [f64; 3], angle: f64| {
        let size = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        let [x, y, z] = axis.map(|x| x / size * (0.5 * angle).sin());
        nalgebra::Quaternion::new((0.5 * angle).cos(), x, y, z)
    };
    let expected = angle([0.0, 0.0, 1.0], 40.0) * angle([1.0, 2.0, 3.0], 2.5);
    let at = [expected.w, expected.i, expected.j, expected.k];
    for (e, at) in at.into_iter().enumerate() {
        assert!((exact.columns[e][4] - at).abs() < 1e-6, "{at} {}", exact.columns[e][4]);
    }
}
