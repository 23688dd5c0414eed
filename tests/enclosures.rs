//! Nothing is stepped over: contacts that come and go within a step, pulses in time, barriers in space, turns, contradictions.
//!
//! Each scene is run by every method with error control, in both coordinates, with the steps that these choose, and once, in
//! coordinates of bodies, with steps so short that nothing can hide in them. They have to agree; grids of cases stand beside each other so
//! that no single one is lucky.

use odyn::diagnostics::codes;
use odyn::results::{Remedy, Status};
use odyn::session::{RunReport, Session};

use crate::support::{Scratch, options};

const METHODS: [&str; 4] = ["dop853", "dopri5", "radau5", "auto"];
const COORDINATES: [&str; 2] = ["joint", "cartesian"];

/// A body of 1 kg that slides along x from the origin.
fn cart(speed: &str, force: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
t_end = 10
output_step = 1
[[body]]
name = "cart"
mass = 1
inertia = [0.1, 0.1, 0.1]
velocity = [{speed}, 0, 0]
[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "cart"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[force]]
name = "force"
bodies = ["ground", "cart"]
{force}
[[output]]
name = "x"
quantity = "position"
of = "cart"
component = "x"
"#
    )
}

/// A wheel of 0.1 kg m^2 about z under a torque over time.
fn wheel(torque: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
t_end = 10
output_step = 1
[[body]]
name = "wheel"
mass = 1
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "wheel"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[force]]
name = "motor"
type = "rotational-actuator"
bodies = ["ground", "wheel"]
axis = [0, 0, 1]
params.of_time = {torque}
[[output]]
name = "angle"
quantity = "coordinate"
of = "bearing"
channel = "angle"
"#
    )
}

#[track_caller]
fn run(scene: &str, sets: &[&str]) -> RunReport {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", scene);
    let session = Session::open(&path, &options(sets, &[])).unwrap_or_else(|error| panic!("{error}"));
    session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Runs a scene in all ways and holds its output against that with short steps, to this share of its peak.
#[track_caller]
fn agree(what: &str, scene: &str, bound: f64) {
    let known =
        run(scene, &["simulation.formulation=cartesian", "simulation.max_step=0.0007", "simulation.tolerance=1e-11"]);
    let peak = known.columns[0].iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    for coordinates in COORDINATES {
        let coordinates = format!("simulation.formulation={coordinates}");
        for method in METHODS {
            let found = run(scene, &[&coordinates, &format!("simulation.method={method}")]);
            assert_eq!(found.summary.status, Status::Completed, "{what}, {coordinates}, {method}");
            let pairs = known.columns[0].iter().zip(&found.columns[0]);
            let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off <= bound * peak, "{what}, {coordinates}, {method}: off by {off:.1e} of {peak:.3}");
        }
    }
}

#[test]
fn grazing_contacts_are_felt() {
    // Thrown up against a stop which is just in reach: the speed, and how far the ball would go beyond the stop.
    for (speed, overlap) in [(3.1, 1e-5), (5.0, 1e-3), (7.3, 0.03), (9.7, 0.1), (13.0, 3e-3)] {
        let upper = speed * speed / (2.0 * 9.81) - overlap;
        let force = format!(
            "type = \"bump-stop\"\naxis = [1, 0, 0]\nparams = {{ upper = {upper:?}, force = \"5 kN\", depth = \"2 cm\" }}"
        );
        let scene = cart(&format!("{speed:?}"), &force)
            .replace("t_end = 10\noutput_step = 1", "t_end = 1.5\noutput_step = 0.05\ngravity = [-9.81, 0, 0]");
        agree(&format!("{overlap} m beyond at {speed} m/s"), &scene, 1e-7);
    }
}

#[test]
fn pulses_in_time_are_felt() {
    for (what, force) in [
        ("bell of 50 ms", "\"10 exp(-((t - 5.03) / 0.05)^2)\""),
        ("bell of 3 ms", "\"90 exp(-((t - 8.301) / 0.003)^2)\""),
        ("two bells", "\"10 exp(-((t - 2.2) / 0.01)^2) - 10 exp(-((t - 6.1) / 0.004)^2)\""),
        ("resonance", "\"10 / (1 + ((t - 7.77) / 0.01)^2)\""),
        ("triangle of 20 ms", "\"max(0, 10 - 1000 abs(t - 3.3))\""),
        ("table", "[[0, 0], [6.1, 0], [6.12, 10], [6.14, 0], [10, 0]]"),
    ] {
        let force =
            format!("type = \"translational-actuator\"\npoints = [[-50, 0, 0], [0, 0, 0]]\nparams.of_time = {force}");
        agree(what, &cart("1.0", &force), 1e-7);
    }
}

/// A first step over the whole run has a stage in the middle of the pulse, of which neither the new state nor the error takes notice
/// where the stage has no weight.
#[test]
fn pulses_at_stages_are_felt() {
    // Of dop853, then of dopri5.
    for share in [0.0526, 0.0789, 0.11835, 0.28165, 0.25, 0.6513, 0.8571, 0.2, 0.3, 0.8] {
        let force = format!(
            "type = \"translational-actuator\"\npoints = [[-50, 0, 0], [0, 0, 0]]\nparams.of_time = \"9 exp(-((t - {}) / 0.01)^2)\"",
            10.0 * share
        );
        let scene = cart("0.001", &force).replace("t_end = 10\n", "t_end = 10\nfirst_step = 10\n");
        agree(&format!("bell at {share} of the step"), &scene, 1e-7);
    }
}

/// A body that goes along a curve of this height from the origin, in the plane z = 0.
fn track(height: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
t_end = 10
output_step = 1
gravity = [0, -9.81, 0]
[[body]]
name = "cart"
mass = 1
inertia = [0.1, 0.1, 0.1]
velocity = [3, 0, 0]
[[joint]]
name = "track"
type = "point-on-curve"
bodies = ["ground", "cart"]
points = [[0, 0, 0], [0, 0, 0]]
axis = [0, 0, 1]
x_axis = [1, 0, 0]
params.height = {height}
[[output]]
name = "x"
quantity = "position"
of = "cart"
component = "x"
"#
    )
}

#[test]
fn hills_far_from_the_start_are_felt() {
    for (what, height) in [
        ("bell", "\"0.2 exp(-(x - 15)^2)\""),
        ("hollow", "\"-0.2 exp(-((x - 15) / 0.5)^2)\""),
        ("ramp", "\"0.1 (1 + tanh((x - 15) / 0.3))\""),
        ("plateau", "\"0.2 / (1 + ((x - 15) / 0.5)^16)\""),
        ("high power", "\"0.2 (x / 20)^16\""),
        (
            "curve of points",
            "{ points = [[0, 0], [15, 0], [15.1, 0.2], [15.2, 0], [40, 0]], interpolation = \"monotone\" }",
        ),
        // Radau's first iteration from no guess does not see them.
        (
            "curve of points, near",
            "{ points = [[0, 0], [5, 0], [5.1, 0.2], [5.2, 0], [40, 0]], interpolation = \"monotone\" }",
        ),
        (
            "curve of points, steep",
            "{ points = [[0, 0], [7, 0], [7.05, 0.1], [7.1, 0], [40, 0]], interpolation = \"monotone\" }",
        ),
    ] {
        agree(what, &track(height), 1e-6);
    }
}

/// A crank whose angle is prescribed, and a bar that swings on it.
fn swung(angle: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
t_end = 12
output_step = 0.5
gravity = [0, -9.81, 0]
[[body]]
name = "crank"
mass = 1
inertia = [0.1, 0.1, 0.1]
position = [0.5, 0, 0]
[[body]]
name = "bar"
mass = 1
inertia = [0.1, 0.1, 0.1]
position = [1, -0.5, 0]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "drive"
type = "rotation-driver"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.angle = {angle}
[[joint]]
name = "pin"
type = "revolute"
bodies = ["crank", "bar"]
point = [1, 0, 0]
axis = [0, 0, 1]
[[output]]
name = "x"
quantity = "position"
of = "bar"
component = "x"
"#
    )
}

#[test]
fn pulses_of_drivers_are_felt() {
    for (what, angle) in [
        ("bell of 10 ms", "\"exp(-((t - 10.12) / 0.01)^2)\""),
        ("bell of 100 ms", "\"0.3 exp(-((t - 6.05) / 0.1)^2)\""),
    ] {
        agree(what, &swung(angle), 1e-6);
        let report = run(&swung(angle), &[]);
        assert_eq!(report.summary.unproven, 0, "{what}");
        assert!(!report.summary.warnings.iter().any(|warning| warning.contains("ODY0608")), "{what}");
    }
}

/// The angle of a point on the cut, whose range is all angles however short the step.
#[test]
fn functions_that_cannot_be_enclosed_are_said() {
    let force = "type = \"translational-actuator\"\npoints = [[-50, 0, 0], [0, 0, 0]]\nparams.of_time = \"atan2(exp(-((t - 2) / 0.01)^2), -1)\"";
    let summary = run(&cart("1.0", force), &[]).summary;
    assert_eq!(summary.status, Status::Completed, "{}", summary.reason);
    let said = |warning: &&String| {
        warning.starts_with("ODY0608: a function of time could not be shown to be without pulses from t = ")
    };
    assert_eq!(summary.warnings.iter().filter(said).count(), 1, "{:?}", summary.warnings);
}

#[test]
fn barriers_in_space_are_felt() {
    for (what, force) in [
        ("bell of 1 cm", "\"20 exp(-((l - 53.303) / 0.01)^2)\""),
        ("bell of 1 mm that throws back", "\"-900 exp(-((l - 53.303) / 0.001)^2)\""),
        ("resonance", "\"2 / (1 + ((l - 53.303) / 0.01)^2)\""),
        ("triangle", "\"-max(0, 20 - 2000 abs(l - 53.303))\""),
        // Pulses that functions make which only step, or which are smooth by themselves.
        ("two steps", "\"5 (tanh((l - 53.303) / 0.002) - tanh((l - 53.313) / 0.002))\""),
        ("two angles", "\"3 (atan((l - 53.303) / 0.002) - atan((l - 53.313) / 0.002))\""),
        ("two roots", "\"5 ((l - 53.3) / sqrt((l - 53.3)^2 + 1e-6) - (l - 53.31) / sqrt((l - 53.31)^2 + 1e-6))\""),
        ("two logistic functions", "\"10 / (1 + exp((53.303 - l) / 0.001)) / (1 + exp((l - 53.313) / 0.001))\""),
        ("slope of a step", "\"20 (1 - tanh((l - 53.303) / 0.01)^2)\""),
        ("inverse of a hyperbolic cosine", "\"20 / (exp((l - 53.303) / 0.05) + exp((53.303 - l) / 0.05))\""),
        ("inverse distance", "\"0.05 / sqrt((l - 53.303)^2 + 1e-6)\""),
        ("negative power", "\"1e-5 ((l - 53.303)^2 + 1e-5)^(-1.5)\""),
        ("high power", "\"20 cos(l - 53.303)^20000\""),
    ] {
        let force =
            format!("type = \"translational-actuator\"\npoints = [[-50, 0, 0], [0, 0, 0]]\nparams.of_length = {force}");
        agree(what, &cart("1.0", &force), 1e-6);
    }
}

#[test]
fn no_turn_is_lost() {
    for (what, torque, angle) in [
        ("growing torque", "\"6 t\"", Some(10_000.0)),
        ("constant torque", "30.0", Some(15_000.0)),
        ("back and forth", "\"300 cos(3 t)\"", None),
    ] {
        for coordinates in COORDINATES {
            for (method, first) in METHODS.iter().flat_map(|method| [(method, 1e-3), (method, 1.0)]) {
                let sets = [
                    format!("simulation.formulation={coordinates}"),
                    format!("simulation.method={method}"),
                    format!("simulation.first_step={first}"),
                ];
                let sets = sets.each_ref().map(String::as_str);
                let found = run(&wheel(torque), &sets).columns[0][10];
                // phi'' = 3000 cos(3 t)
                let known = angle.unwrap_or(3000.0 / 9.0 * (1.0 - f64::cos(30.0)));
                assert!((found - known).abs() < 1e-6 * known.abs(), "{what}, {sets:?}: {found} rad, not {known}");
            }
        }
    }
}

#[test]
fn steps_of_a_fixed_size_that_lose_turns_or_miss_contacts_say_so() {
    for method in ["rk4", "dop853", "radau5"] {
        let method = format!("simulation.method={method}");
        let report = run(&wheel("30.0"), &[&method, "simulation.fixed_step=0.5"]);
        assert_eq!(
            (report.summary.status, report.summary.code),
            (Status::Suspect, Some(codes::MISSED_WITHIN_STEP)),
            "{method}"
        );
        let force =
            "type = \"bump-stop\"\naxis = [1, 0, 0]\nparams = { upper = 2.686, force = \"5 kN\", depth = \"2 cm\" }";
        let scene = cart("7.3", force)
            .replace("t_end = 10\noutput_step = 1", "t_end = 1.8\noutput_step = 0.9\ngravity = [-9.81, 0, 0]");
        let report = run(&scene, &[&method, "simulation.fixed_step=0.6"]);
        // What radau5 asks of its Newton iteration has no solution: it ends.
        let judged = (report.summary.status, report.exit_code());
        let expected = if method.ends_with("radau5") { (Status::StoppedEarly, 6) } else { (Status::Suspect, 7) };
        assert_eq!(judged, expected, "{method}");
        let fine = run(&scene, &[&method, "simulation.fixed_step=0.001"]);
        assert_eq!(fine.summary.recoveries[Remedy::Missed], 0, "{method}");
    }
}

/// Two drivers of one hinge that ask for angles which differ by 10 mrad for a moment.
fn drivers(width: f64) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
t_end = 2
output_step = 0.1
[[body]]
name = "rotor"
mass = 1
inertia = [0.1, 0.1, 0.1]
[[body]]
name = "arm"
mass = 1
inertia = [0.1, 0.1, 0.1]
position = [1, 0, 0]
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "rotor"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "elbow"
type = "revolute"
bodies = ["rotor", "arm"]
point = [0.5, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "one"
type = "rotation-driver"
bodies = ["ground", "rotor"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.angle = "0.2 sin(5 t)"
[[joint]]
name = "other"
type = "rotation-driver"
bodies = ["ground", "rotor"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.angle = "0.2 sin(5 t) + 0.01 exp(-((t - 1.0123) / {width:?})^2)"
"#
    )
}

#[test]
fn contradictions_of_some_milliseconds_end_the_run() {
    for width in [0.002, 0.00002] {
        let whole = drivers(width);
        // Without the arm, the motion is determined by time alone.
        let (head, rest) = whole.split_once("[[body]]\nname = \"arm\"").unwrap();
        let (_, rest) = rest.split_once("axis = [0, 0, 1]\n").unwrap();
        let (_, rest) = rest.split_once("axis = [0, 0, 1]\n").unwrap();
        let bearing = "[[joint]]\nname = \"bearing\"\ntype = \"revolute\"\nbodies = [\"ground\", \"rotor\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n";
        let alone = format!("{head}{bearing}{rest}");
        for (scene, methods) in [(&whole, &METHODS[..]), (&alone, &METHODS[..1])] {
            for (coordinates, method) in COORDINATES.iter().flat_map(|c| methods.iter().map(move |m| (c, m))) {
                let sets = [format!("simulation.formulation={coordinates}"), format!("simulation.method={method}")];
                let summary = run(scene, &sets.each_ref().map(String::as_str)).summary;
                let told = (summary.status, summary.code);
                assert_eq!(
                    told,
                    (Status::StoppedEarly, Some(codes::CONFLICTING_CONSTRAINTS)),
                    "{width} s, {sets:?}: {}",
                    summary.reason
                );
                // From there on the angles differ by more than the limit; the last state from which a step was tried lies before, by
                // no more than that step.
                let end = summary.t_end_reached;
                assert!((1.0123 - 7.0 * width - 1e-3..1.0123).contains(&end), "{sets:?}: {end}");
            }
        }
    }
}

#[test]
fn what_neither_switches_nor_depends_on_time_is_not_enclosed() {
    let spring = "type = \"translational-spring-damper\"\npoints = [[-50, 0, 0], [0, 0, 0]]\nparams = { stiffness = 40, free_length = 50 }";
    let report = run(&cart("1.0", spring), &[]);
    assert_eq!(report.summary.enclosures, 0);
    let stop = "type = \"bump-stop\"\naxis = [1, 0, 0]\nparams = { upper = 2.686, force = \"5 kN\", depth = \"2 cm\" }";
    assert!(run(&cart("1.0", stop), &[]).summary.enclosures > 0);
}

/// Whole powers of what may be negative, above those that are products: half of the pulses were stepped over.
#[test]
fn pulses_of_high_powers_are_felt_on_both_sides() {
    // Bells of a width of a hundredth: the root of 2 pi / n each, less a quarter of an n-th.
    let n = 1e4_f64;
    let one = (2.0 * std::f64::consts::PI / n).sqrt() * (1.0 - 0.25 / n);
    for (power, known) in [("10000", 10.0 * one), ("10001", 0.0)] {
        let text = format!(
            "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\nt_end = \"10 pi\"\noutput_step = \"pi\"\ntolerance = 1e-8\n\
             [[body]]\nname = \"a\"\nmass = 1\nparticle = true\n\
             [[force]]\nname = \"f\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"a\"]\nparams.x = \"sin(t)^{power}\"\n\
             [[output]]\nname = \"v\"\nquantity = \"velocity\"\nof = \"a\"\ncomponent = \"x\"\n"
        );
        let found = *run(&text, &[]).columns[0].last().expect("a sample");
        assert!((found - known).abs() < 1e-6, "{power}: {found}, not {known}");
    }
}
