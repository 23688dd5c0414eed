//! Derivatives of results by numbers of a scene: against closed forms, differentiated by steps in the complex plane where they are
//! analytic, in both formulations, by both kinds of methods, through closed loops, contacts and foreign binaries.

use std::path::{Path, PathBuf};

use nalgebra::Complex;
use odyn::analyses::sensitivity::{OutputSensitivity, Request, Sensitivities};
use odyn::session::SessionError;

use crate::support::{Scratch, options, root};

type C = Complex<f64>;

fn try_of(path: &Path, of: &[&str], to: &[&str], sets: &[&str]) -> Result<Sensitivities, SessionError> {
    let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    let request = Request { of: owned(of), to: owned(to), ..Request::default() };
    Sensitivities::of(path, &options(sets, &[]), &request, &|_| (), &Default::default())
}

#[track_caller]
fn of(path: &Path, of: &[&str], to: &[&str], sets: &[&str]) -> Sensitivities {
    try_of(path, of, to, sets).unwrap_or_else(|error| panic!("{error}"))
}

fn scene(name: &str) -> PathBuf {
    root().join("scenes").join(name)
}

/// What a closed form gives for one parameter changed by a step along the imaginary axis.
fn exact(times: &[f64], form: impl Fn(f64, C) -> C, at: f64) -> Vec<f64> {
    const STEP: f64 = 1e-40;
    times.iter().map(|t| form(*t, C::new(at, STEP)).im / STEP).collect()
}

/// The largest error of a derivative against exact values, as a share of their largest; it has to be within what was estimated.
#[track_caller]
fn compare(times: &[f64], found: &OutputSensitivity, exact: &[f64]) -> f64 {
    assert_eq!(times.len(), exact.len());
    let size = exact.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut worst = 0.0_f64;
    for ((found, estimate), exact) in found.derivative.iter().zip(&found.error).zip(exact) {
        if found.is_finite() {
            worst = worst.max((found - exact).abs() / size);
            // An estimate is no bound; ten times it, with the last digits of what is differenced, is.
            assert!((found - exact).abs() <= 10.0 * estimate + 1e-11 * size, "{found} {exact} {estimate:e}");
        }
    }
    worst
}

const OSCILLATOR: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
t_end = 2
output_step = 0.1
[[body]]
name = "block"
mass = 2
inertia = [1, 1, 1]
position = [0.5, 0, 0]
velocity = [0.3, 0, 0]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "block"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "block"]
frames = [{ position = [-1, 0, 0] }, { position = [0, 0, 0] }]
params = { stiffness = 50, damping = 1.5, free_length = 1 }
[[output]]
name = "x"
quantity = "position"
of = "block"
component = "x"
[[figure]]
name = "end"
channel = "x"
take = "final"
"#;

/// x of the oscillator by mass, stiffness, damping, start, speed at the start.
fn oscillator(t: f64, p: [C; 5]) -> C {
    let [m, k, c, x0, v0] = p;
    let d = c / (m * 2.0);
    let w = (k / m - d * d).sqrt();
    (-d * t).exp() * (x0 * (w * t).cos() + (v0 + d * x0) / w * (w * t).sin())
}

const OF_OSCILLATOR: [(&str, f64); 5] = [
    ("block.mass", 2.0),
    ("spring.params.stiffness", 50.0),
    ("spring.params.damping", 1.5),
    ("block.position.x", 0.5),
    ("block.velocity.x", 0.3),
];

#[test]
fn an_oscillator_in_every_way_has_the_derivatives_of_its_closed_form() {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", OSCILLATOR);
    let keys = OF_OSCILLATOR.map(|(key, _)| key);
    let ways: [&[&str]; 5] = [
        &[],
        &["simulation.formulation=cartesian"],
        &["simulation.method=radau5"],
        &["simulation.method=dopri5"],
        &["simulation.fixed_step=0.002", "simulation.method=rk4"],
    ];
    for sets in ways {
        let found = of(&path, &["x", "end"], &keys, sets);
        assert_eq!(found.status, "certain", "{sets:?} {:?}", found.notes);
        for (place, one) in found.outputs.iter().enumerate() {
            let form = |t: f64, p: C| {
                let mut all = OF_OSCILLATOR.map(|(_, value)| C::from(value));
                all[place] = p;
                oscillator(t, all)
            };
            let exact = exact(&found.times, form, OF_OSCILLATOR[place].1);
            let worst = compare(&found.times, one, &exact);
            assert!(worst < 1e-8, "{sets:?} {} {worst:e}", one.parameter);
            assert!(one.digits > 7.0, "{sets:?} {} {}", one.parameter, one.digits);
            let figure = &found.figures[place];
            assert_eq!(figure.parameter, one.parameter);
            assert_eq!(figure.derivative, *one.derivative.last().unwrap());
        }
    }
}

#[test]
fn units_are_those_of_the_output_over_those_of_the_number() {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", OSCILLATOR);
    let found =
        of(&path, &["x"], &["block.mass", "spring.params.stiffness", "block.position.x"], &["block.mass=2000 g"]);
    let units: Vec<&str> = found.outputs.iter().map(|one| one.unit.as_str()).collect();
    assert_eq!(units, ["m/kg", "m/(N/m)", "1"]);
    assert_eq!(found.parameters[0].value, 2.0);
    let plain = of(&path, &["x"], &["block.mass"], &[]);
    let difference = plain.outputs[0].peak / found.outputs[0].peak - 1.0;
    assert!(difference.abs() < 1e-10, "{difference:e}");
}

/// A pendulum scaled in time: phi(t; l) = f(t / sqrt(l)), so that d phi / d l = -t phi' / (2 l), exactly.
#[test]
fn a_pendulum_by_its_length_is_itself_stretched_in_time() {
    const TEXT: &str = r#"
[plugins]
libraries = ["joints"]
[parameters]
length = 0.8
[simulation]
gravity = [0, -9.81, 0]
t_end = 4
output_step = 0.25
[[body]]
name = "bob"
mass = 1
inertia = ["0.1 * length^2", "0.1 * length^2", "0.1 * length^2"]
position = ["length", 0, 0]
[[joint]]
name = "pivot"
type = "revolute"
bodies = ["ground", "bob"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[output]]
name = "phi"
quantity = "coordinate"
of = "pivot"
[[output]]
name = "rate"
quantity = "angular_velocity"
of = "bob"
component = "z"
"#;
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", TEXT);
    let report = {
        let session = odyn::session::Session::open(&path, &options(&["simulation.tolerance=1e-13"], &[])).unwrap();
        session.run(None, Box::new(|_| ()), &Default::default()).unwrap()
    };
    let rate = &report.columns[report.channels.iter().position(|channel| channel.name == "rate").unwrap()];
    let exact: Vec<f64> = report.times.iter().zip(rate).map(|(t, rate)| -t * rate / (2.0 * 0.8)).collect();
    for formulation in ["joint", "cartesian"] {
        let found = of(&path, &["phi"], &["length"], &[&format!("simulation.formulation={formulation}")]);
        let worst = compare(&found.times, &found.outputs[0], &exact);
        assert!(worst < 1e-8, "{formulation} {worst:e}");
    }
}

/// A ball that falls from h onto a floor and bounces with e: between impacts by parabolas.
#[test]
fn a_bouncing_ball_by_restitution_gravity_and_height() {
    const TEXT: &str = r#"
[plugins]
libraries = ["joints"]
[parameters]
e = 0.8
h = 1.0
g = 9.81
[simulation]
gravity = [0, 0, "-g"]
t_end = 1.5
output_step = 0.05
[[body]]
name = "ball"
particle = true
mass = 0.3
position = [0, 0, "h"]
[[joint]]
name = "floor"
type = "plane-contact"
bodies = ["ground", "ball"]
frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0] }]
params.restitution = "e"
[[output]]
name = "z"
quantity = "position"
of = "ball"
component = "z"
"#;
    let form = |t: f64, [e, h, g]: [C; 3]| {
        let fall = (h * 2.0 / g).sqrt();
        let (mut start, mut speed) = (C::from(0.0), C::from(0.0));
        if t < fall.re {
            return h - g * t * t * 0.5;
        }
        start += fall;
        speed += g * fall * e;
        while t > (start + speed * 2.0 / g).re {
            start += speed * 2.0 / g;
            speed *= e;
        }
        let s = C::from(t) - start;
        speed * s - g * s * s * 0.5
    };
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", TEXT);
    let found = of(&path, &["z"], &["e", "h", "g"], &[]);
    let values = [0.8, 1.0, 9.81];
    for (place, one) in found.outputs.iter().enumerate() {
        let own = |t: f64, p: C| {
            let mut all = values.map(C::from);
            all[place] = p;
            form(t, all)
        };
        let worst = compare(&found.times, one, &exact(&found.times, own, values[place]));
        assert!(worst < 1e-8, "{} {worst:e}", one.parameter);
        assert!(one.passed <= 2, "{one:?}");
    }
    assert!(found.how.contains("own events"));
}

/// A slider-crank driven at a constant rate: x = r cos a + sqrt(l^2 - r^2 sin^2 a), through its closed loop.
#[test]
fn a_piston_by_the_length_of_its_rod_and_the_radius_of_its_crank() {
    const TEXT: &str = r#"
[plugins]
libraries = ["joints"]
[parameters]
r = 0.05
l = 0.17
[simulation]
t_end = 1.2
output_step = 0.05
[[body]]
name = "crank"
mass = 1
inertia = [0.01, 0.01, 0.01]
[[body]]
name = "rod"
mass = 0.5
inertia = [0.01, 0.01, 0.01]
position = ["r", 0, 0]
[[body]]
name = "piston"
mass = 0.4
inertia = [0.01, 0.01, 0.01]
position = ["r + l", 0, 0]
[[joint]]
name = "main"
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
params.angle = "5 t"
[[joint]]
name = "pin"
type = "revolute"
bodies = ["crank", "rod"]
point = ["r", 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "wrist"
type = "spherical"
bodies = ["rod", "piston"]
point = ["r + l", 0, 0]
[[joint]]
name = "bore"
type = "translational"
bodies = ["ground", "piston"]
point = ["r + l", 0, 0]
axis = [1, 0, 0]
[[output]]
name = "x"
quantity = "position"
of = "piston"
component = "x"
"#;
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", TEXT);
    let form = |t: f64, [r, l]: [C; 2]| {
        let (sin, cos) = (5.0 * t).sin_cos();
        r * cos + (l * l - r * r * sin * sin).sqrt()
    };
    for sets in [&["simulation.formulation=joint"][..], &["simulation.formulation=cartesian"]] {
        let found = of(&path, &["x"], &["r", "l"], sets);
        for (place, value) in [0.05, 0.17].into_iter().enumerate() {
            let own = |t: f64, p: C| {
                let mut all = [C::from(0.05), C::from(0.17)];
                all[place] = p;
                form(t, all)
            };
            let worst = compare(&found.times, &found.outputs[place], &exact(&found.times, own, value));
            assert!(worst < 1e-8, "{sets:?} {place} {worst:e}");
        }
    }
}

/// Where there is no closed form, formulations, methods and tolerances are compared with each other.
#[test]
fn formulations_and_methods_agree_on_machines_with_closed_loops() {
    let cases: [(&str, &[&str], &[&str]); 17] = [
        ("compressor.toml", &["crank.radius", "rod.length", "piston.mass"], &["simulation.t_end=60"]),
        (
            "compressor.toml",
            &["bearing_friction.params.damping", "motor.params.breakdown_slip"],
            &["simulation.t_end=60"],
        ),
        ("benchmarks/A01.toml", &[], &["simulation.t_end=2"]),
        ("benchmarks/A02_N1.toml", &[], &["simulation.t_end=1"]),
        ("benchmarks/A03.toml", &[], &["simulation.t_end=0.01"]),
        ("benchmarks/A04.toml", &[], &["simulation.t_end=1"]),
        ("benchmarks/dpend.toml", &[], &["simulation.t_end=2"]),
        ("verification/modal-body.toml", &[], &[]),
        ("verification/bushing.toml", &[], &[]),
        ("verification/gear-planetary.toml", &[], &[]),
        ("verification/coupler.toml", &[], &[]),
        ("verification/screw.toml", &[], &[]),
        ("verification/hydraulic-damper.toml", &[], &[]),
        ("verification/pid-speed.toml", &[], &[]),
        ("verification/rack-and-pinion.toml", &[], &[]),
        ("verification/drag.toml", &[], &[]),
        ("verification/dry-friction.toml", &[], &[]),
    ];
    for (name, keys, sets) in cases {
        let (path, mut compared) = (scene(name), 0);
        let first = odyn::scene::Document::open(&path).unwrap();
        let session = odyn::session::Session::open(&path, &options(sets, &[])).unwrap_or_else(|e| panic!("{name} {e}"));
        let own: Vec<String> = if keys.is_empty() {
            let masses = session.scene.bodies.iter().filter(|body| body.mass.is_some());
            let masses = masses.map(|body| format!("body.{}.mass", body.name.value));
            masses.filter(|key| first.setting(key, &[]).is_ok_and(|found| found.is_some())).take(2).collect()
        } else {
            keys.iter().map(|key| (*key).to_owned()).collect()
        };
        let own: Vec<&str> = own.iter().map(String::as_str).collect();
        let by = |extra: &str| {
            let sets: Vec<&str> = sets.iter().copied().chain([extra]).collect();
            of(&path, &[], &own, &sets)
        };
        let (joint, bodies) = (by("simulation.formulation=joint"), by("simulation.formulation=cartesian"));
        for (a, b) in
            joint.outputs.iter().zip(&bodies.outputs).filter(|(a, b)| a.unique && !a.independent && !b.independent)
        {
            let size = a.peak.abs();
            let errors = a.error.iter().zip(&b.error).map(|(a, b)| a + b);
            let known = a.derivative.iter().zip(&b.derivative).zip(errors);
            for ((a, b), error) in known.filter(|((a, b), _)| a.is_finite() && b.is_finite()) {
                compared += 1;
                assert!((a - b).abs() <= 10.0 * error + 1e-8 * size, "{name} {a} {b} {error:e} {size:e}");
            }
        }
        assert!(compared > 10, "{name}: {compared}");
    }
}

/// A spring of a library that was built outside: a bob on it swings as cos(sqrt(k / m) t).
#[test]
fn a_spring_of_a_stranger_has_the_derivatives_of_its_closed_form() {
    let folder = crate::fixtures::build("good-plugin");
    let scratch = Scratch::new();
    let text = crate::plugins::STRANGERS_SCENE.replace("stranger", "good-plugin");
    let path = scratch.file("scene.toml", text.replace("\"LIBRARIES\"", &format!("'{}'", folder.display())));
    let found = of(&path, &["swing"], &["spring.params.stiffness", "bob.mass"], &[]);
    assert_eq!(found.status, "certain", "{:?}", found.notes);
    let by_stiffness = exact(&found.times, |t, k| ((k / 2.0).sqrt() * t).cos(), 18.0);
    let by_mass = exact(&found.times, |t, m| ((C::from(18.0) / m).sqrt() * t).cos(), 2.0);
    for (one, exact) in found.outputs.iter().zip([by_stiffness, by_mass]) {
        let worst = compare(&found.times, one, &exact);
        assert!(worst < 1e-8, "{} {worst:e}", one.parameter);
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", OSCILLATOR);
    let with = |jobs| {
        let request = Request { to: vec!["block.mass".into()], jobs, ..Request::default() };
        Sensitivities::of(&path, &options(&[], &[]), &request, &|_| (), &Default::default()).unwrap().csv()
    };
    assert_eq!(with(1), with(3));
}

/// Damping below zero is refused by the element: differences are taken on the other side.
#[test]
fn at_the_edge_of_what_is_allowed_differences_are_one_sided() {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", OSCILLATOR);
    let found = of(&path, &["x"], &["spring.params.damping"], &["spring.params.damping=0"]);
    assert_eq!(found.parameters[0].stencil, "forward");
    let form = |t: f64, c: C| oscillator(t, [C::from(2.0), C::from(50.0), c, C::from(0.5), C::from(0.3)]);
    let worst = compare(&found.times, &found.outputs[0], &exact(&found.times, form, 0.0));
    assert!(worst < 1e-8, "{worst:e}");
}

/// A small pendulum without damping: how large steps have to be is not to be seen from a value that is 0, and there is none below it. The first
/// step, of 1e-3 N m s/rad, is a thousand times what lets it creep. What central differences of damped runs say is
/// the reference: extrapolated to 0, to which the motion is a smooth function of the damping.
#[test]
fn at_the_edge_steps_are_made_smaller_too() {
    let scratch = Scratch::new();
    let scene = "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 3\noutput_step = 0.1\n\
                 [[body]]\nname = \"b\"\nmass = 1e-3\ninertia = [1e-7, 1e-7, 1e-7]\nposition = [0.04, 0, -0.03]\n\
                 [[joint]]\nname = \"h\"\ntype = \"revolute\"\nbodies = [\"ground\", \"b\"]\npoint = [0, 0, 0]\naxis = [0, 1, 0]\n\
                 [[force]]\nname = \"d\"\ntype = \"rotational-spring-damper\"\nbodies = [\"ground\", \"b\"]\naxis = [0, 1, 0]\n\
                 params = { stiffness = 0, damping = 0 }\n\
                 [[output]]\nname = \"phi\"\nquantity = \"coordinate\"\nof = \"h\"\nchannel = \"angle\"\n";
    let path = scratch.file("scene.toml", scene);
    let found = of(&path, &["phi"], &["d.params.damping"], &[]);
    assert_eq!((found.status, found.parameters[0].stencil), ("certain", "forward"), "{:?}", found.notes);
    let beside = |damping: &str| {
        let set = format!("d.params.damping={damping}");
        of(&path, &["phi"], &["d.params.damping"], &[&set]).outputs.remove(0).derivative
    };
    let all = ["1e-9", "2e-9", "3e-9"].map(beside);
    let own = &found.outputs[0];
    let largest = own.derivative.iter().fold(0.0_f64, |most, one| most.max(one.abs()));
    assert!(largest > 1e5 && own.digits > 4.0, "{largest} {}", own.digits);
    for (k, one) in own.derivative.iter().enumerate() {
        let expected = 3.0 * all[0][k] - 3.0 * all[1][k] + all[2][k];
        assert!((one - expected).abs() < 1e-4 * largest, "{k}: {one} {expected}");
    }
}

#[test]
fn a_number_that_changes_nothing_has_no_influence_and_one_that_is_not_there_is_refused() {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", OSCILLATOR);
    let found = of(&path, &["x"], &["block.inertia.2"], &[]);
    assert!(found.outputs[0].independent && found.status == "certain", "{found:?}");
    let told = |of: &[&str], to: &[&str]| try_of(&path, of, to, &[]).unwrap_err().to_string();
    assert!(told(&[], &["block.mas"]).contains("gives no value for `block.mas`"));
    assert!(told(&[], &["blok.mass"]).contains("there is no `blok.mass`"));
    assert!(told(&["y"], &["block.mass"]).contains("no output or figure `y`"));
    // What can be named instead.
    assert!(told(&[], &["block.mas"]).contains("did you mean `block.mass`"));
    let text = told(&[], &["block.name"]);
    assert!(
        text.contains("`block.name` is no number: it is the text \"block\"") && text.contains("`block.mass`"),
        "{text}"
    );
    assert!(told(&[], &["block.position"]).contains("numbers in it are `block.position.x`, `block.position.y`"));
    assert!(told(&[], &["block"]).contains("numbers in it are `block.mass`"));
    assert!(
        told(&[], &["simulation.method"]).contains("did you mean")
            || told(&[], &["simulation.method"]).contains("numbers of `simulation` are")
    );
    assert!(told(&[], &["block.mass", "block.mass"]).contains("given twice"));
    assert!(told(&[], &["simulation.output_step"]).contains("changes the times of the samples"));
}

/// A scene in which a switch is passed at one value and not at the next has no derivative, and says so.
#[test]
fn what_is_not_smooth_is_uncertain() {
    let scratch = Scratch::new();
    // Plainly not smooth: a figure that is the largest of two samples that are equal here.
    let text = OSCILLATOR.replace("[[figure]]", "[[figure]]\nname = \"kink\"\nchannel = \"y\"\ntake = \"peak\"\nabs = true\n[[output]]\nname = \"y\"\nquantity = \"position\"\nof = \"block\"\ncomponent = \"y\"\n[[figure]]");
    let text = text
        .replace("axis = [1, 0, 0]", "axis = [1, 1, 0]")
        .replace("position = [0.5, 0, 0]", "position = [0.5, 0.5, 0]");
    let text = text.replace("position = [0.5, 0.5, 0]", "position = [0.5, 0, 0]");
    let path = scratch.file("scene.toml", text);
    // |y| at y = 0, at rest: its derivative by the start has two signs.
    let found = of(
        &path,
        &["kink"],
        &["block.position.y"],
        &["block.velocity=[0,0,0]", "spring.params.stiffness=0", "spring.params.damping=0"],
    );
    assert_eq!((found.status, found.exit_code()), ("uncertain", 7), "{found:?}");
}

#[test]
fn a_figure_without_a_value_has_no_derivative() {
    let scratch = Scratch::new();
    // It is taken where y crosses a value that it never has.
    let figure =
        "[[figure]]\nname = \"never\"\nchannel = \"x\"\ntake = \"at\"\nwhere = \"x\"\nequals = 1e3\n[[figure]]";
    let path = scratch.file("scene.toml", OSCILLATOR.replacen("[[figure]]", figure, 1));
    let found = of(&path, &["never"], &["block.mass"], &[]);
    assert!(found.figures[0].derivative.is_nan() && found.figures[0].digits.is_nan(), "{found:?}");
    assert_eq!((found.status, found.exit_code()), ("uncertain", 7));
    assert!(found.notes.iter().any(|note| note.contains("`never` has no value")), "{:?}", found.notes);
}

#[test]
fn a_number_that_moves_samples_on_one_side_is_refused() {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", OSCILLATOR);
    // An end on a sample: a later one leaves all samples where they are, an earlier one takes the last away.
    let error = try_of(&path, &[], &["simulation.t_end"], &[]).unwrap_err().to_string();
    assert!(error.contains("`simulation.t_end` changes the times of the samples"), "{error}");
    let found = of(&path, &[], &["simulation.t_end"], &["simulation.t_end=2.05"]);
    assert!(found.outputs.iter().all(|output| output.independent), "{found:?}");
}

#[test]
fn differences_that_agree_by_chance_across_a_kink_are_told_from_good_ones() {
    // A force of 1 N, limited to `high`: the limit acts up to the k-th part of a step of 1e-3 above 1, where orders 4 and 6 agree for
    // k = 5 / 3, orders 2 to 6 do not see it beyond 3, and all of them agree below 1, where only the slopes on both sides differ.
    for k in [0.2, 0.6, 1.2, 5.0 / 3.0, 1.7, 2.4, 3.5] {
        let found = limited(1.0 / (1.0 + 1e-3 * k));
        let exact: Vec<f64> = found.times.iter().map(|t| 0.25 * t * t).collect();
        compare(&found.times, &found.outputs[0], &exact);
        assert!(k < 1.0 || found.outputs[0].digits > 9.0, "{k}: {}", found.outputs[0].digits);
    }
}

#[test]
fn at_a_kink_there_is_no_derivative() {
    let found = limited(1.0);
    let output = &found.outputs[0];
    assert_eq!((found.status, found.exit_code()), ("uncertain", 7), "{output:?}");
    // Forwards it is zero, backwards t^2 / 4.
    for ((derivative, error), t) in output.derivative.iter().zip(&output.error).zip(&found.times) {
        assert!((derivative - 0.125 * t * t).abs() < 1e-9 && *error >= 0.1249 * t * t, "{t} {derivative} {error}");
    }
}

/// A block of 2 kg that a force of 1 N pushes, limited to `high`; its place by that limit.
fn limited(high: f64) -> Sensitivities {
    let text = format!(
        "[plugins]\nlibraries = [\"joints\", \"forces\", \"controls\"]\n[simulation]\nt_end = 1\noutput_step = 0.25\n\
             [[body]]\nname = \"block\"\nmass = 2\ninertia = [1, 1, 1]\n\
             [[joint]]\nname = \"slide\"\ntype = \"translational\"\nbodies = [\"ground\", \"block\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n\
             [[control]]\nname = \"limited\"\ntype = \"sensor\"\ninputs.input = 1\nparams.high = {high:?}\n\
             [[force]]\nname = \"push\"\ntype = \"translational-actuator\"\nbodies = [\"ground\", \"block\"]\naxis = [1, 0, 0]\n\
             inputs.signal = \"limited.output\"\nparams.along = \"axis\"\n\
             [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"block\"\ncomponent = \"x\"\n"
    );
    let scratch = Scratch::new();
    of(&scratch.file("scene.toml", text), &["x"], &["limited.params.high"], &[])
}

/// Joints let go where the number says so: at another time in each run, with another value of what decides.
#[test]
fn derivatives_go_on_where_joints_let_go() {
    let [g, m, b, j, a0] = [9.81, 2.0, 0.4, 0.02, 1.2];
    let path = scene("verification/release.toml");
    let found = of(&path, &["z", "px", "py", "w", "lever_spin"], &["t2", "c", "a"], &[]);
    let one = |output: &str, parameter: &str| {
        found
            .outputs
            .iter()
            .find(|one| one.output == output && one.parameter == parameter)
            .expect("one of those asked for")
    };
    let fallen = |t: f64, c: C| {
        let d = (t - b).max(0.0);
        -(c * b / m + g) * d * d / 2.0 - c * d * d * d / (6.0 * m)
    };
    let worst = compare(&found.times, one("z", "c"), &exact(&found.times, fallen, 25.0));
    assert!(worst < 1e-8, "{worst:e}");
    let flies = |from: fn(C) -> C, along: fn(C) -> C| {
        move |t: f64, t2: C| {
            if t < t2.re { C::from(0.0) } else { from(t2 * 2.0) * 0.8 + along(t2 * 2.0) * 1.6 * (C::from(t) - t2) }
        }
    };
    for (output, form) in [("px", flies(|x| x.cos(), |x| -x.sin())), ("py", flies(|x| x.sin(), |x| x.cos()))] {
        let worst = compare(&found.times, one(output, "t2"), &exact(&found.times, form, 0.5));
        assert!(worst < 1e-8, "{output} {worst:e}");
    }
    // It opens on its way, next to t = 0.705.
    let spins = |t: f64, a: C| {
        if t < 0.705 { C::from(0.0) } else { ((a.cos() - f64::cos(a0)) * (2.0 * g / (1.0 + j / m))).sqrt() }
    };
    let worst = compare(&found.times, one("w", "a"), &exact(&found.times, spins, -0.5));
    assert!(worst < 1e-8, "{worst:e}");
    assert!(found.outputs.iter().all(|one| one.passed <= 2), "{:?}", found.notes);
    assert!(one("lever_spin", "t2").independent);
}
