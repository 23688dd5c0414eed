//! Modes of what moves: where the linear model stays the same along the motion they decide, and elsewhere they do not.

use std::path::Path;

use odyn::analyses::linear::Linear;
use odyn::analyses::modes::{Modes, Stability};
use odyn::session::Session;

use crate::support::{Scratch, options, root};

fn modes(path: &Path, sets: &[&str]) -> (Modes, f64) {
    let open = || Session::open(path, &options(sets, &[])).unwrap_or_else(|error| panic!("{error}"));
    let (session, instant) = (open(), open().prepare().unwrap().start().unwrap().instant().unwrap());
    let linear = Linear::at(&session, &instant, None, None).unwrap_or_else(|error| panic!("{error}"));
    (Modes::of(&session, &linear).unwrap(), linear.unsteadiness)
}

/// A pendulum hangs from a shaft that a motor turns. About the axis of the pin it is m l^2 s^2 + c s + m g l - m l^2 W^2: for
/// W > sqrt(g / l) = 4.43 rad/s it does not stay there.
const GOVERNOR: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[parameters]
W = 8
out = 0.0
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.1
[[body]]
name = "shaft"
mass = 1
inertia = [1, 1, 1]
angular_velocity = [0, 0, "W"]
[[body]]
name = "bob"
mass = 2
inertia = [0.001, 0.001, 0.001]
position = ["0.5 * sin(out)", 0, "-0.5 * cos(out)"]
velocity = [0, "W * 0.5 * sin(out)", 0]
angular_velocity = [0, 0, "W"]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "shaft"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "drive"
type = "rotation-driver"
bodies = ["ground", "shaft"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.angle = "W * t"
[[joint]]
name = "pin"
type = "revolute"
bodies = ["shaft", "bob"]
point = [0, 0, 0]
axis = [0, 1, 0]
[[force]]
name = "damper"
type = "rotational-spring-damper"
bodies = ["shaft", "bob"]
point = [0, 0, 0]
axis = [0, 1, 0]
params = { stiffness = 0, damping = 1 }
"#;

#[test]
fn what_turns_about_no_axis_of_symmetry_is_not_called_stable() {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", GOVERNOR);
    for w in ["-30", "0.5", "3", "4.3", "4.6", "8", "100"] {
        for out in ["0", "0.7"] {
            let (found, unsteadiness) = modes(&path, &[&format!("W={w}"), &format!("out={out}")]);
            assert_eq!(found.stability, Stability::Frozen, "{w} {out}: {unsteadiness} {:?}", found.modes);
            let speed: f64 = w.parse().unwrap();
            assert!(unsteadiness > 0.1 * speed.abs(), "{w}: {unsteadiness}");
        }
    }
    let (standing, unsteadiness) = modes(&path, &["W=0"]);
    assert_eq!((standing.stability, unsteadiness), (Stability::Stable, 0.0));
}

/// A disc in a housing on soft, damped mounts. With the rotor first among the bodies of the bearing, its reactions are in axes that turn.
fn rotor(bodies: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["joints", "forces"]
[parameters]
spin = 300
[simulation]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.1
[[body]]
name = "housing"
mass = 2
inertia = [0.3, 0.3, 0.3]
position = [0, 0, 0]
[[body]]
name = "rotor"
mass = 5
inertia = [0.1, 0.1, 0.2]
position = [0, 0, 0]
angular_velocity = [0, 0, "spin"]
[[joint]]
name = "bearing"
type = "revolute"
bodies = [{bodies}]
point = [0, 0, 0]
axis = [0, 0, 1]
[[force]]
name = "mount"
type = "bushing"
bodies = ["ground", "housing"]
point = [0, 0, 0]
params = {{ stiffness = [9e3, 8e3, 7e3], damping = [90, 80, 70], rotational_stiffness = [300, 200, 100], rotational_damping = [3, 2, 1] }}
[[force]]
name = "lift"
type = "vector-force"
bodies = ["ground", "housing"]
point = [0, 0, 0]
params.y = 68.67 # both weights
"#
    )
}

#[test]
fn rotors_of_revolution_are_judged_as_they_turn() {
    let scratch = Scratch::new();
    for (name, bodies) in [("a", r#""housing", "rotor""#), ("b", r#""rotor", "housing""#)] {
        let path = scratch.file(&format!("{name}.toml"), rotor(bodies));
        for spin in ["-2000", "-3", "1e-3", "20", "300"] {
            let (found, unsteadiness) = modes(&path, &[&format!("spin={spin}")]);
            assert!(unsteadiness < 1e-6, "{bodies} {spin}: {unsteadiness}");
            assert_ne!(found.stability, Stability::Frozen);
        }
        let (found, unsteadiness) = modes(&path, &["rotor.inertia.x=0.15"]);
        assert_eq!(found.stability, Stability::Frozen, "{unsteadiness}");
    }
}

#[test]
fn what_travels_straight_on_is_judged_as_it_goes() {
    let path = root().join("scenes/verification/bicycle.toml");
    for (v, expected) in [("2", Stability::Unstable), ("5", Stability::Undecided), ("9", Stability::Unstable)] {
        let (found, unsteadiness) = modes(&path, &[&format!("v={v}")]);
        assert_eq!((found.stability, unsteadiness), (expected, 0.0), "{v}");
    }
}
