//! Modes of what moves: where the linear model stays the same along the motion, in axes of the ground or in others that turn, they decide,
//! and elsewhere they do not.

use std::path::Path;

use nalgebra::Complex;
use odyn::analyses::eigen::spectrum;
use odyn::analyses::linear::Linear;
use odyn::analyses::modes::{Mode, Modes, Stability};
use odyn::session::Session;

use crate::support::{Scratch, options, root};

fn modes(path: &Path, sets: &[&str]) -> (Modes, f64) {
    let open = || Session::open(path, &options(sets, &[])).unwrap_or_else(|error| panic!("{error}"));
    let (session, instant) = (open(), open().prepare().unwrap().start().unwrap().instant().unwrap());
    let linear = Linear::at(&session, &instant, None, None).unwrap_or_else(|error| panic!("{error}"));
    let modes = Modes::of(&session, &linear).unwrap();
    // Eigenvalues that are known from looking ahead are those of the model as it is seen at last.
    let own: Vec<_> = spectrum(&linear.a).unwrap().pairs.iter().map(|pair| [pair.value.re, pair.value.im]).collect();
    assert_eq!(modes.modes.iter().map(|mode| [mode.real, mode.imaginary]).collect::<Vec<_>>(), own);
    (modes, linear.unsteadiness)
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

/// Whether each root of s^2 + b s + c is an eigenvalue.
fn assert_roots(found: &Modes, [b, c]: [f64; 2], what: &str) {
    let root = Complex::new(b * b / 4.0 - c, 0.0).sqrt();
    for expected in [-root - b / 2.0, root - b / 2.0].into_iter().filter(|root| root.im >= 0.0) {
        let off = |mode: &Mode| (Complex::new(mode.real, mode.imaginary) - expected).norm();
        let nearest = found.modes.iter().map(off).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-9 * expected.norm(), "{what}: {expected} {nearest:.1e} {:?}", found.modes);
    }
}

#[test]
fn a_governor_is_judged_in_axes_that_turn_with_it() {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", GOVERNOR);
    let (m, l, g, moment, damping) = (2.0, 0.5, 9.81, 0.001, 1.0);
    let inertia = m * l * l + moment;
    for (w, hangs) in
        [(-30.0, false), (0.5, true), (3.0, true), (4.3, true), (4.6, false), (8.0, false), (100.0, false)]
    {
        let (found, unsteadiness) = modes(&path, &[&format!("W={w}")]);
        assert_eq!(unsteadiness, 0.0, "{w}");
        let expected = if hangs { Stability::Stable } else { Stability::Unstable };
        assert_eq!(found.stability, expected, "{w}: {:?}", found.modes);
        assert_roots(&found, [damping / inertia, m * l * (g - l * w * w) / inertia], &format!("{w}"));
        // Swung out as far as its speed has it, it stays.
        if !hangs {
            let out = f64::acos(g / (l * w * w));
            let (found, unsteadiness) = modes(&path, &[&format!("W={w}"), &format!("out={out:?}")]);
            assert_eq!((found.stability, unsteadiness), (Stability::Stable, 0.0), "{w}: {:?}", found.modes);
            let back = m * l * l * w * w * out.sin().powi(2);
            assert_roots(&found, [damping / inertia, back / inertia], &format!("{w} swung out"));
        }
    }
    let (standing, unsteadiness) = modes(&path, &["W=0"]);
    assert_eq!((standing.stability, unsteadiness), (Stability::Stable, 0.0));
}

#[test]
fn what_does_not_turn_as_one_is_not_called_stable() {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", GOVERNOR);
    for w in ["-30", "0.5", "3", "8", "100"] {
        let (found, unsteadiness) = modes(&path, &[&format!("W={w}"), "out=0.7"]);
        assert_eq!(found.stability, Stability::Frozen, "{w}: {unsteadiness} {:?}", found.modes);
        assert!(unsteadiness > 0.05, "{w}: {unsteadiness}");
    }
    // Cranks of equal length that pass their upper dead centre, where nothing accelerates along the path.
    let (found, _) = modes(&root().join("scenes/benchmarks/A02_N1.toml"), &[]);
    assert_eq!(found.stability, Stability::Frozen);
}

/// A mass on springs in axes of a shaft that a motor turns, at its centre: (s^2 - W^2 + kx/m) (s^2 - W^2 + ky/m) + 4 W^2 s^2 = 0 across the
/// shaft (Ziegler 1977, "Principles of Structural Stability", ch. 3).
#[test]
fn a_shaft_with_two_stiffnesses_is_unstable_between_its_critical_speeds() {
    let scratch = Scratch::new();
    let (machine, _) = GOVERNOR.split_once("[[joint]]\nname = \"pin\"").unwrap();
    let scene = machine
        .replace("position = [\"0.5 * sin(out)\", 0, \"-0.5 * cos(out)\"]", "position = [0, 0, 0]")
        .replace("velocity = [0, \"W * 0.5 * sin(out)\", 0]", "velocity = [0, 0, 0]");
    let soft = "[[force]]\nname = \"soft\"\ntype = \"bushing\"\nbodies = [\"shaft\", \"bob\"]\npoint = [0, 0, 0]\n\
                params = { stiffness = [50, 200, 1000], damping = [0, 0, 0], rotational_stiffness = [3, 4, 5], \
                rotational_damping = [0, 0, 0] }\n";
    let path = scratch.file("scene.toml", format!("{scene}{soft}").replace("[0, 0, -9.81]", "[0, 0, 0]"));
    for (w, stable) in [(1.0_f64, true), (4.9, true), (5.1, false), (9.9, false), (10.1, true), (40.0, true)] {
        let (found, unsteadiness) = modes(&path, &[&format!("W={w}")]);
        assert_eq!(unsteadiness, 0.0, "{w}");
        let expected = if stable { Stability::Undamped } else { Stability::Unstable };
        assert_eq!(found.stability, expected, "{w}: {:?}", found.modes);
        let (x, y) = (25.0 - w * w, 100.0 - w * w);
        let half = (x + y + 4.0 * w * w) / 2.0;
        let root = (half * half - x * y).sqrt();
        for square in [half - root, half + root] {
            assert_roots(&found, [0.0, square], &format!("{w}"));
        }
    }
}

/// Two masses on a rod that points to the centre of its orbit.
const DUMBBELL: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[parameters]
R = 7e6
L = 50
mu = 3.986e14
inner = "R - L / 2"
outer = "R + L / 2"
n = "sqrt(mu * (1 / inner^2 + 1 / outer^2) / (2 * R))"
[simulation]
t_end = 10
output_step = 1
[[body]]
name = "a"
particle = true
mass = 100
position = ["inner", 0, 0]
velocity = [0, "n * inner", 0]
[[body]]
name = "b"
particle = true
mass = 100
position = ["outer", 0, 0]
velocity = [0, "n * outer", 0]
[[joint]]
name = "rod"
type = "distance-rod"
bodies = ["a", "b"]
points = [["inner", 0, 0], ["outer", 0, 0]]
params.length = "L"
[[force]]
name = "on-a"
type = "point-gravity"
bodies = ["ground", "a"]
points = [[0, 0, 0], ["inner", 0, 0]]
params = { gravitational_parameter = "mu", mass = 100 }
[[force]]
name = "on-b"
type = "point-gravity"
bodies = ["ground", "b"]
points = [[0, 0, 0], ["outer", 0, 0]]
params = { gravitational_parameter = "mu", mass = 100 }
"#;

/// In axes that turn with its orbit a short dumbbell swings with sqrt(3) n in its plane and 2 n across (Kane, Likins & Levinson 1983,
/// "Spacecraft Dynamics", ch. 3), and its centre, in and across the plane, with n.
#[test]
fn a_satellite_swings_about_its_orbit() {
    let scratch = Scratch::new();
    let (found, unsteadiness) = modes(&scratch.file("scene.toml", DUMBBELL), &[]);
    assert_eq!((found.stability, unsteadiness, found.zeros), (Stability::Undecided, 0.0, 2));
    let n = (3.986e14_f64 / 7e6_f64.powi(3)).sqrt();
    assert!((found.turning[2] - n).abs() < 1e-9 * n, "{:?}", found.turning);
    let found: Vec<f64> = found.modes.iter().map(|mode| mode.imaginary / n).collect();
    assert_eq!(found.len(), 4);
    for (found, expected) in found.iter().zip([1.0, 1.0, 3.0_f64.sqrt(), 2.0]) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
}

/// A coin that rolls in a circle, as in the verification manual; about that motion, Euler's equations in axes that turn with its lean,
/// linearised by themselves, have these eigenvalues beside zeros.
#[test]
fn a_coin_that_rolls_in_a_circle_is_judged_in_axes_that_turn_with_it() {
    let scene = std::fs::read_to_string(root().join("scenes/verification/rolling-disc.toml")).unwrap();
    let ((_, scene), scratch) = (scene.split_once("[plugins]").unwrap(), Scratch::new());
    let (coin, _) = scene.split_once("[[body]]\nname = \"wheel\"").unwrap();
    let path = scratch.file("scene.toml", format!("[plugins]{coin}"));
    for (lean, square, stability) in
        [(1.1, 7.288_512_32_f64.powi(2), Stability::Undecided), (1.5, -5.877_575_38_f64.powi(2), Stability::Unstable)]
    {
        let (found, unsteadiness) = modes(&path, &[&format!("b={lean}")]);
        assert_eq!((found.stability, unsteadiness), (stability, 0.0), "{:?}", found.modes);
        let nearest = found.modes.iter().map(|mode| (mode.real.powi(2) - mode.imaginary.powi(2) + square).abs());
        assert!(nearest.fold(f64::INFINITY, f64::min) < 1e-7, "{lean}: {:?}", found.modes);
    }
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

/// A crank that a motor turns: no freedom is left, and reactions turn with it.
#[test]
fn what_has_no_freedom_left_has_no_modes_and_is_linearised() {
    let scratch = Scratch::new();
    let (machine, _) = GOVERNOR.split_once("[[joint]]\nname = \"pin\"").unwrap();
    let welded = "[[joint]]\nname = \"weld\"\ntype = \"bracket\"\nbodies = [\"shaft\", \"bob\"]\npoint = [0, 0, 0]\n";
    let scene = format!("{machine}{welded}");
    let path = scratch.file("scene.toml", scene);
    let (found, unsteadiness) = modes(&path, &["out=0.7"]);
    assert_eq!((found.modes.len(), unsteadiness), (0, 0.0));
    assert_ne!(found.stability, Stability::Frozen);
}

/// Ziegler's column: two links on springs, pushed along the second one. It flutters from P = 2 on; the stiff clamp of the tip leaves
/// eigenvalues less certain than that.
const COLUMN: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[parameters]
P = 2.2
[simulation]
t_end = 1
output_step = 0.1
[[body]]
name = "first"
mass = 1
inertia = [0.01, 0.01, 0.01]
com = [1, 0, 0]
[[body]]
name = "second"
mass = 1
inertia = [0.01, 0.01, 0.01]
com = [1, 0, 0]
position = [1, 0, 0]
[[body]]
name = "tip"
mass = 0.001
inertia = [1e-5, 1e-5, 1e-5]
position = [2, 0, 0]
[[joint]]
name = "foot"
type = "revolute"
bodies = ["ground", "first"]
point = [0, 0, 0]
[[joint]]
name = "knee"
type = "revolute"
bodies = ["first", "second"]
point = [1, 0, 0]
[[force]]
name = "foot_spring"
type = "rotational-spring-damper"
bodies = ["ground", "first"]
point = [0, 0, 0]
params.stiffness = 1
[[force]]
name = "knee_spring"
type = "rotational-spring-damper"
bodies = ["first", "second"]
point = [1, 0, 0]
params.stiffness = 1
[[force]]
name = "clamp"
type = "bushing"
bodies = ["second", "tip"]
point = [2, 0, 0]
params = { stiffness = [2e7, 2e7, 2e7], rotational_stiffness = [2e7, 2e7, 2e7] }
[[force]]
name = "thrust"
type = "vector-force"
bodies = ["ground", "second"]
point = [2, 0, 0]
axis = [0, 0, 1]
x_axis = [1, 0, 0]
params = { x = "-P", follower = true }
"#;

#[test]
fn growth_within_round_off_is_not_decided() {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", COLUMN);
    let slowest = |sets: &[&str]| {
        let modes = modes(&path, sets).0;
        let grows = modes.modes.iter().take(2).map(|mode| mode.real).fold(f64::NEG_INFINITY, f64::max);
        (modes.stability, grows, modes.modes[0].uncertainty)
    };
    let (stability, grows, uncertainty) = slowest(&["P=2.2"]);
    assert!((grows - 0.32).abs() < 1e-4 && grows < uncertainty, "{grows} {uncertainty}");
    assert_eq!(stability, Stability::Undecided);
    assert_eq!(slowest(&["P=3"]).0, Stability::Unstable);
    assert_eq!(slowest(&["P=1.5"]).0, Stability::Undamped);
}

const NOTHING: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
t_end = 1
output_step = 0.1
"#;

/// A particle circles on a spring; beside it a rotor spins that it has nothing to do with. The particle swings with sqrt(k/m + 3 W^2) in
/// axes that turn with it.
#[test]
fn a_fast_rotor_elsewhere_does_not_hide_what_turns() {
    let scratch = Scratch::new();
    let orbit = r#"
[parameters]
W = 1
spin = 30
[[body]]
name = "bob"
particle = true
mass = 1
position = [1, 0, 0]
velocity = [0, "W", 0]
[[body]]
name = "rotor"
mass = 1
inertia = [1, 1, 1]
angular_velocity = [0, 0, "spin"]
[[joint]]
name = "rail"
type = "point-in-plane"
bodies = ["ground", "bob"]
points = [[0, 0, 0], [1, 0, 0]]
axis = [0, 0, 1]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "rotor"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "bob"]
points = [[0, 0, 0], [1, 0, 0]]
params = { stiffness = "10 * W^2", free_length = 0.9 }
"#;
    let path = scratch.file("scene.toml", format!("{NOTHING}{orbit}"));
    for (w, spin) in [(1.0, 0.0), (1.0, 30.0), (1.0, 1e4), (1e-3, 1.0)] {
        let (found, unsteadiness) = modes(&path, &[&format!("W={w}"), &format!("spin={spin}")]);
        assert_eq!(unsteadiness, 0.0, "{w} {spin}");
        assert!((found.turning[2] - w).abs() < 1e-9 * w, "{w} {spin}: {:?}", found.turning);
        let expected = 13.0_f64.sqrt() * w;
        assert!((found.modes[0].imaginary - expected).abs() < 1e-7 * expected, "{w} {spin}: {:?}", found.modes);
    }
}

/// A gyroscope in regular precession stays so, however much faster it spins: with n about its axis in all, C n W - A W^2 cos(b) = m g l, both about the tip.
#[test]
fn a_gyroscope_is_judged_in_axes_that_precess_with_it() {
    let scratch = Scratch::new();
    let gyroscope = r#"
[parameters]
n = 500
b = 1
A = 0.003
C = 0.005
l = 0.01
W = "m * 9.81 * l * 2 / (C * n + sqrt((C * n)^2 - 4 * (A + m * l^2) * cos(b) * m * 9.81 * l))"
m = 1
[[body]]
name = "top"
mass = "m"
inertia = ["A", "A", "C"]
com = [0, 0, "l"]
orientation = { axis = [1, 0, 0], angle = "-b" }
angular_velocity = [0, "(n - W * cos(b)) * sin(b)", "W + (n - W * cos(b)) * cos(b)"]
[[joint]]
name = "tip"
type = "spherical"
bodies = ["ground", "top"]
point = [0, 0, 0]
"#;
    let scene = NOTHING.replace("t_end", "gravity = [0, 0, -9.81]\nt_end");
    let path = scratch.file("scene.toml", format!("{scene}{gyroscope}"));
    for n in [150.0, 500.0, 2500.0] {
        let (found, unsteadiness) = modes(&path, &[&format!("n={n}")]);
        assert!(unsteadiness < 1e-3 && found.turning[2] > 0.0, "{n}: {unsteadiness} {:?}", found.turning);
        assert!(!matches!(found.stability, Stability::Unstable | Stability::Frozen), "{n}: {:?}", found.modes);
    }
}

/// Blades of a rotor about a horizontal axis feel gravity along themselves once a turn, as Mathieu's equation has it; a pendulum whose
/// pivot shakes, too.
#[test]
fn what_changes_with_gravity_or_a_drive_is_frozen() {
    let scratch = Scratch::new();
    let upright = GOVERNOR.replace("gravity = [0, 0, -9.81]", "gravity = [0, -9.81, 0]");
    let path = scratch.file("blade.toml", upright);
    for w in ["2", "10", "40"] {
        let (found, unsteadiness) = modes(&path, &[&format!("W={w}"), "out=1.5707963267948966"]);
        assert_eq!(found.stability, Stability::Frozen, "{w}: {unsteadiness}");
    }
    let shaken = r#"
[parameters]
amplitude = 0.05
[[body]]
name = "car"
mass = 1
inertia = [1, 1, 1]
[[body]]
name = "rod"
mass = 1
inertia = [0.001, 0.001, 0.001]
position = [0, 0, 1]
[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "car"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "drive"
type = "displacement-driver"
bodies = ["ground", "car"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.displacement = "amplitude * sin(100 * t)"
[[joint]]
name = "pin"
type = "revolute"
bodies = ["car", "rod"]
point = [0, 0, 0]
axis = [0, 1, 0]
"#;
    let scene = NOTHING.replace("t_end", "gravity = [0, 0, -9.81]\nt_end");
    let path = scratch.file("shaken.toml", format!("{scene}{shaken}"));
    assert_eq!(modes(&path, &[]).0.stability, Stability::Frozen);
    assert_eq!(modes(&path, &["amplitude=0"]).0.stability, Stability::Unstable);
    // Without a motion to begin with, loads that depend on time do the same.
    let cut = |text: &str, from: &str, to: &str| {
        let (before, rest) = text.split_once(from).unwrap();
        format!("{before}{to}{}", rest.split_once(to).unwrap().1)
    };
    let bare = cut(COLUMN, "[[body]]\nname = \"tip\"", "[[joint]]\nname = \"foot\"");
    let bare = cut(&bare, "[[force]]\nname = \"clamp\"", "[[force]]\nname = \"thrust\"");
    let path = scratch.file("pushed.toml", bare.replace("x = \"-P\"", "x = \"-1 - P * sin(11 * t)\""));
    assert_eq!(modes(&path, &["P=0.5"]).0.stability, Stability::Frozen);
    assert_eq!(modes(&path, &["P=0"]).0.stability, Stability::Undamped);
}

/// The same machine is the same machine on a carriage, and in flight.
#[test]
fn what_turns_and_travels_is_judged_as_if_it_only_turned() {
    let scratch = Scratch::new();
    let body = r#"
[parameters]
v = 0
[[body]]
name = "book"
mass = 0.2
inertia = [1e-4, 4e-4, 4.5e-4]
velocity = [0, 0, "v"]
angular_velocity = [0, 15, 0]
"#;
    let path = scratch.file("scene.toml", format!("{NOTHING}{body}"));
    let expected = ((4.5 - 4.0) * (4.0 - 1.0) / (1.0 * 4.5) * 225.0_f64).sqrt();
    for v in ["0", "3", "300"] {
        let (found, unsteadiness) = modes(&path, &[&format!("v={v}")]);
        assert_eq!((found.stability, unsteadiness), (Stability::Unstable, 0.0), "{v}: {:?}", found.modes);
        let largest = found.modes.iter().map(|mode| mode.real).fold(0.0, f64::max);
        assert!((largest - expected).abs() < 1e-7 * expected, "{v}: {largest} {expected}");
    }
}

/// A ball a micrometre above the ground: it strikes before any later instant that its model could be compared with.
#[test]
fn what_could_not_be_compared_is_said_to_be_unknown() {
    let text = r#"
[plugins]
libraries = ["joints"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.1
[[body]]
name = "ball"
mass = 1
inertia = [0.1, 0.1, 0.1]
position = [0, 0, 1.000001]
velocity = [0, 0, -1]
[[joint]]
name = "floor"
type = "plane-contact"
bodies = ["ground", "ball"]
points = [[0, 0, 0], [0, 0, 0.000001]]
axis = [0, 0, 1]
"#;
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", text);
    let open = || Session::open(&path, &options(&[], &[])).unwrap_or_else(|error| panic!("{error}"));
    let (session, instant) = (open(), open().prepare().unwrap().start().unwrap().instant().unwrap());
    let linear = Linear::at(&session, &instant, None, None).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(Modes::of(&session, &linear).unwrap().stability, Stability::Frozen);
    let said = |words: &str| linear.notes.iter().any(|note| note.contains(words));
    assert!(said("is not known: no later instant could be compared") && !said("inf while"), "{:?}", linear.notes);
}
