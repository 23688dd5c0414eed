//! Efforts that inverse dynamics finds, given back to a scene by tables over time.

use std::fmt::Write as _;

use odyn::analyses::inverse::{Inverse, inverse};
use odyn::analyses::prescribed::{Motion, quantity, values_at_start};
use odyn::scene::Dimension;
use odyn::session::Session;

use crate::support::{column, open_text};

/// A coordinate with the actuator that drives it: joint.channel, bodies, axis, how far it goes, and how fast steadily.
pub(crate) struct Drive {
    pub(crate) coordinate: &'static str,
    pub(crate) bodies: [&'static str; 2],
    pub(crate) axis: [i32; 3],
    /// rad or m, rad/s or m/s.
    pub(crate) swing: f64,
    pub(crate) steady: f64,
    pub(crate) force: bool,
}

pub(crate) const fn turn(coordinate: &'static str, bodies: [&'static str; 2], axis: [i32; 3], swing: f64) -> Drive {
    Drive { coordinate, bodies, axis, swing, steady: 0.0, force: false }
}

/// The scene with an output, an input and an actuator for each coordinate; `tables`: efforts over time in place of signals.
fn driven(text: &str, drives: &[Drive], tables: Option<&[String]>) -> String {
    let mut text = text.replacen("libraries = [\"joints\"", "libraries = [\"forces\", \"joints\"", 1);
    text = text.replacen("\"forces\", \"joints\", \"forces\"", "\"forces\", \"joints\"", 1);
    for (k, drive) in drives.iter().enumerate() {
        let (joint, channel) = drive.coordinate.split_once('.').unwrap();
        let [x, y, z] = drive.axis;
        let [i, j] = drive.bodies;
        let _ = write!(
            text,
            "\n[[output]]\nname = \"c{k}\"\nquantity = \"coordinate\"\nof = \"{joint}\"\nchannel = \"{channel}\"\n\
             [[input]]\nname = \"motor{k}\"\n\
             [[force]]\nname = \"drive{k}\"\ntype = \"{}\"\nbodies = [\"{i}\", \"{j}\"]\naxis = [{x}, {y}, {z}]\n\
             inputs = {{ signal = \"motor{k}\" }}\n",
            if drive.force { "translational-actuator" } else { "rotational-actuator" },
        );
        if drive.force {
            text += "params.along = \"axis\"\n";
        }
        if let Some(tables) = tables {
            let _ = writeln!(text, "params.of_time = {{ points = [{}], interpolation = \"spline\" }}", tables[k]);
        }
    }
    text
}

/// Values of the outputs `c0`, ... where a scene starts, SI.
fn at_start(session: &Session, count: usize) -> Vec<f64> {
    let names: Vec<String> = (0..count).map(|k| format!("c{k}")).collect();
    let wanted: Vec<_> = names.iter().map(|name| quantity(session, name).unwrap()).collect();
    values_at_start(session, &wanted).unwrap()
}

/// Swings that begin and end smoothly: value and derivatives at a time.
pub(crate) fn wish(start: f64, drive: &Drive, w: f64, k: usize, t: f64) -> [f64; 3] {
    let (a, w) = (drive.swing, w * (1.0 + 0.3 * k as f64));
    [
        start + drive.steady * t + a * (1.0 - (w * t).cos()),
        drive.steady + a * w * (w * t).sin(),
        a * w * w * (w * t).cos(),
    ]
}

/// The motion of all coordinates, known at these times.
fn motion(session: &Session, drives: &[Drive], start: &[f64], w: f64, times: &[f64]) -> Motion {
    let wanted = (0..drives.len()).map(|k| quantity(session, &format!("c{k}")).unwrap()).collect();
    let nodes = |k: usize| times.iter().map(|t| wish(start[k], &drives[k], w, k, *t)).collect();
    Motion::through(wanted, times.to_vec(), (0..drives.len()).map(nodes).collect())
}

fn efforts(session: &Session, motion: &Motion) -> Inverse {
    inverse(session, motion, None, None, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"))
}

/// How the table of efforts begins. Splines of tables have natural ends (no curvature), which are off by h^2 there.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Begin {
    /// With the efforts of the motion before.
    Before,
    /// With the polynomial through the first efforts: before the begin there is no motion, where states begin there.
    Continued,
    /// With the first effort.
    There,
}

/// Rows before the begin, and behind the end.
const MARGIN: i32 = 16;
/// How many efforts the polynomial goes through.
const THROUGH: usize = 6;

/// The values before the first of some with equal spaces, on the polynomial through the first: their highest difference is constant.
fn before(first: &[f64]) -> Vec<f64> {
    let mut known: Vec<f64> = first[..THROUGH].to_vec();
    for _ in 0..MARGIN {
        let mut next = 0.0;
        let mut binomial = 1.0;
        for (k, value) in known[..THROUGH].iter().enumerate() {
            binomial *= (THROUGH - k) as f64 / (k + 1) as f64;
            next += if k % 2 == 0 { binomial } else { -binomial } * value;
        }
        known.insert(0, next);
    }
    known.truncate(MARGIN as usize);
    known
}

/// Gives the efforts of a motion of some length, known every h, back to the scene, and returns how far its run is off, as a share
/// of the swing.
pub(crate) fn fed_back(
    name: &str,
    text: &str,
    drives: &[Drive],
    w: f64,
    (end, h): (f64, f64),
    sets: &[&str],
    begin: Begin,
) -> f64 {
    let plain = driven(text, drives, None);
    let session = open_text(&plain, sets);
    let start = at_start(&session, drives.len());
    // Beyond the ends, so that those of the spline do not count.
    let steps = (end / h).round() as i32;
    let first = if begin == Begin::Before { -MARGIN } else { 0 };
    let times: Vec<f64> = (first..=steps + MARGIN).map(|k| f64::from(k) * h).collect();
    let found = efforts(&session, &motion(&session, drives, &start, w, &times));
    assert!(found.balance < 1e-11, "{name}: {:e}", found.balance);
    assert_eq!(found.freedoms, drives.len(), "{name}");
    // From the state at zero.
    let from_zero: Vec<f64> = vec![0.0, h];
    let begins = efforts(&session, &motion(&session, drives, &start, w, &from_zero)).start;
    let time = session.scene.units.factor(Dimension::TIME);
    let tables: Vec<String> = (0..drives.len())
        .map(|k| {
            let effort = session.scene.units.factor(if drives[k].force { Dimension::FORCE } else { Dimension::TORQUE });
            let mut pairs: Vec<(f64, f64)> = times.iter().copied().zip(found.efforts[k].iter().copied()).collect();
            if begin == Begin::Continued {
                let earlier = (-MARGIN..0).map(|k| f64::from(k) * h);
                pairs.splice(0..0, earlier.zip(before(&found.efforts[k])));
            }
            pairs.iter().map(|(t, u)| format!("[{:?}, {:?}]", t / time, u / effort)).collect::<Vec<_>>().join(", ")
        })
        .collect();
    let ends = [format!("simulation.t_end={end:?} s"), format!("simulation.output_step={:?} s", end / 10.0)];
    let mut sets = sets.to_vec();
    sets.extend(ends.iter().map(String::as_str));
    sets.extend(["simulation.tolerance=1e-12"]);
    let mut again = open_text(&driven(text, drives, Some(&tables)), &sets);
    again.go_on_from(begins).unwrap_or_else(|error| panic!("{name}: {error}"));
    let run = again.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
    let mut worst = 0.0_f64;
    for (k, drive) in drives.iter().enumerate() {
        let factor = run.channels.iter().find(|channel| channel.name == format!("c{k}")).unwrap().factor;
        for (t, value) in run.times.iter().zip(column(&run, &format!("c{k}"))) {
            let expected = wish(start[k], drive, w, k, t * time)[0];
            let off = (value * factor - expected).abs() / drive.swing;
            worst = if off <= worst { worst } else { off };
        }
    }
    worst
}

pub(crate) const PENDULUM: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.1
[[body]]
name = "rod"
mass = 2
inertia = [0.01, 0.5, 0.5]
position = [0.7, 0, 0]
[[joint]]
name = "pivot"
type = "revolute"
bodies = ["ground", "rod"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[force]]
name = "rubs"
type = "joint-friction"
joints = ["pivot"]
params.kind = "rotation"
params.radius = 0.05
params.mu = 0.2
params.transition_speed = 0.02
"#;
