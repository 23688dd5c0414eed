//! FMUs, judged by FMPy: valid, the digits of the interpreter in co-simulation, the results of runs in model exchange.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use odyn::export::fmu::{Fmu, Kinds, TARGETS, Version, build};
use odyn::export::{Machine, Twin};
use odyn::session::RunReport;

use super::{PENDULUM, machine, of_text};
use crate::random::checks::Checks;
use crate::random::mechanism::{Mechanism, Style};
use crate::support::{Scratch, column, open, root};

/// A Python with FMPy; in this variable where it is another one than `python3`.
const PYTHON: &str = "ODYN_FMPY";
/// Steps that are compared.
const STEPS: usize = 40;

pub fn python() -> Option<String> {
    let python = std::env::var(PYTHON).unwrap_or_else(|_| "python3".into());
    let there = Command::new(&python).args(["-c", "import fmpy"]).output().is_ok_and(|output| output.status.success());
    if !there {
        println!("left out: `{python}` has no FMPy; name one that has in {PYTHON}");
    }
    there.then_some(python)
}

/// What the interpreter computes, as a table.
fn table(machine: &Machine) -> String {
    table_of(Twin::new(machine.clone()))
}

fn table_of(mut twin: Twin) -> String {
    let machine = &twin.machine().clone();
    let mut text = String::from("time");
    machine.outputs.iter().for_each(|port| {
        let _ = write!(text, ",{}", port.name);
    });
    for step in 0..=STEPS {
        if step > 0 {
            twin.step(machine.step).unwrap();
        }
        let time = machine.t_start + step as f64 * machine.step;
        let _ = write!(text, "\n{time:?}");
        twin.outputs().iter().for_each(|value| {
            let _ = write!(text, ",{value:?}");
        });
    }
    text + "\n"
}

/// Writes an FMU with the binary of this machine; `false` where there is no compiler.
pub fn written(machine: &Machine, version: Version, kinds: Kinds, folder: &Path, file: &Path) -> bool {
    let fmu = Fmu::new(machine, version, kinds).unwrap_or_else(|error| panic!("{}", error.message));
    let Some(binary) = build(&fmu, &TARGETS[0], folder).unwrap() else { return false };
    fs::write(file, fmu.archive(&[binary]).unwrap()).unwrap();
    true
}

/// Co-simulation has the digits of the interpreter.
const SAME: f64 = 1e-11;

pub fn judged(name: &str, machine: &Machine, tolerance: f64) {
    judged_by(name, machine, &table(machine), (tolerance, SAME), &[]);
}

fn judged_by(name: &str, machine: &Machine, table: &str, (tolerance, equal): (f64, f64), parameters: &[(String, f64)]) {
    let Some(python) = python() else { return };
    let folder = Scratch::new();
    let table = folder.file("table.csv", table);
    let both = Kinds { co_simulation: true, model_exchange: true };
    let ways = [
        (Version::Two, both),
        (Version::Three, both),
        (Version::Two, Kinds { model_exchange: false, ..both }),
        (Version::Three, Kinds { co_simulation: false, ..both }),
    ];
    for (version, kinds) in ways {
        let file = folder.path().join(format!("{name}.fmu"));
        if !written(machine, version, kinds, folder.path(), &file) {
            println!("left out: there is no compiler `cc`");
            return;
        }
        let output = Command::new(&python)
            .arg(root().join("tests/export/judge.py"))
            .args([&file, &table])
            .arg(format!("{tolerance:e}"))
            .arg(format!("{equal:e}"))
            .args(parameters.iter().flat_map(|(name, value)| [format!("parameters.{name}"), format!("{value:e}")]))
            .output()
            .unwrap();
        let (told, wrong) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        println!("{name} {version:?} {kinds:?}\n{told}");
        assert!(output.status.success(), "{name} {version:?} {kinds:?}: {wrong}");
    }
}

#[test]
fn the_compressor_is_a_valid_fmu() {
    judged("compressor", &machine(open("compressor.toml", &[]), None, "dopri5"), 1e-5);
}

#[test]
fn a_mechanism_with_a_redundant_row_is_a_valid_fmu() {
    judged("bricard", &machine(open("benchmarks/A04.toml", &[]), None, "dopri5"), 1e-5);
}

#[test]
fn a_pendulum_with_an_input_is_a_valid_fmu() {
    judged("pendulum", &machine(of_text(PENDULUM), Some(5e-3), "dopri5"), 1e-5);
}

#[test]
fn a_scene_with_switches_is_a_valid_fmu() {
    judged("stop", &machine(open("verification/bump-stop.toml", &[]), None, "dopri5"), 1e-4);
}

/// Parameters are set before the initialisation ends; beyond their ranges they are refused.
#[test]
fn parameters_of_an_fmu_can_be_set() {
    let machine = super::parameters::of_file("verification/bump-stop.toml", 1e-3, "dopri5");
    let given: Vec<(String, f64)> = machine
        .parameters
        .settable
        .iter()
        .map(|one| (one.port.name.clone(), 0.3 * one.range[0] + 0.7 * one.range[1]))
        .collect();
    let mut twin = Twin::new(machine.clone());
    twin.set_parameters(&given.iter().map(|(_, value)| *value).collect::<Vec<f64>>()).unwrap();
    judged_by("settable", &machine, &table_of(twin), (1e-4, SAME), &given);
}

/// Angles over many turns: an importing tool looks at them behind its steps, and at events that follow from how fast they grow.
#[test]
fn counted_angles_are_counted_in_fmus() {
    judged("motor", &machine(open("verification/motor-torque.toml", &[]), Some(0.015), "dopri5"), 1e-5);
}

#[test]
fn a_stiff_scene_is_a_valid_fmu() {
    // Steps of 16 times the fastest decay: how that dies away is not resolved, and makes the difference.
    judged("governor", &machine(open("benchmarks/A05.toml", &[]), Some(2e-3), "rodas"), 2e-3);
}

/// A ball that bounces on a soft floor while it flies, a pendulum against a rubber wall, and a block between stops: what is touched at
/// one time and left at another. Co-simulation and model exchange give what a run gives.
const CONTACTS: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.025
tolerance = 1e-11
[[body]]
name = "ball"
mass = 0.5
inertia = [1e-3, 1.5e-3, 2e-3]
position = [0, 0, 0.3]
velocity = [1, 0.5, 0]
angular_velocity = [3, 1, 2]
[[force]]
name = "floor"
type = "bump-stop"
bodies = ["ground", "ball"]
axis = [0, 0, 1]
params = { lower = 0.05, force = 200, depth = 0.01, damping = 0.3 }
[[body]]
name = "bob"
mass = 1
inertia = [0.02, 0.02, 0.02]
position = [0.5, 1, 0]
[[joint]]
name = "pivot"
type = "revolute"
bodies = ["ground", "bob"]
point = [0, 1, 0]
axis = [0, 1, 0]
[[force]]
name = "wall"
type = "rotational-bump-stop"
bodies = ["ground", "bob"]
point = [0, 1, 0]
axis = [0, 1, 0]
params = { upper = 1, torque = 50, depth = 0.1, damping = 0.1 }
[[output]]
name = "z"
quantity = "position"
of = "ball"
component = "z"
[[output]]
name = "vz"
quantity = "velocity"
of = "ball"
component = "z"
[[output]]
name = "wx"
quantity = "angular_velocity"
of = "ball"
component = "x"
[[output]]
name = "angle"
quantity = "coordinate"
of = "pivot"
"#;

#[test]
fn a_scene_with_contacts_is_what_a_run_gives() {
    let report: RunReport = of_text(CONTACTS).run(None, Box::new(|_| ()), &Default::default()).unwrap();
    assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
    let machine = machine(of_text(CONTACTS), Some(2.5e-4), "dopri5");
    let names: Vec<&str> = machine.outputs.iter().map(|port| port.name.as_str()).collect();
    let times = &report.times;
    let mut text = format!("time,{}", names.join(","));
    for (k, time) in times.iter().enumerate() {
        let _ = write!(text, "\n{time:?}");
        names.iter().for_each(|name| {
            let _ = write!(text, ",{:?}", column(&report, name)[k]);
        });
    }
    // Floor and wall are met and left, each of them.
    let met = |name: &str, at: f64, sign: f64| {
        let inside: Vec<bool> = column(&report, name).iter().map(|x| sign * (x - at) > 0.0).collect();
        inside.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    assert!(met("z", 0.05, -1.0) >= 4, "the ball bounces twice");
    assert!(met("angle", 1.0, 1.0) >= 2, "the wall is met and left");
    let mut twin = Twin::new(machine.clone());
    for _ in 0..4000 {
        twin.step(machine.step).unwrap();
    }
    assert!(twin.located >= 6 && twin.passed == 0, "{} switches located, {} passed", twin.located, twin.passed);
    // Of forces that begin as a power of 1.5 errors fall with the step as its power of 2.5.
    judged_by("contacts", &machine, &(text + "\n"), (2e-5, 2e-5), &[]);
}

/// What importing tools do, and what they should not, by FMPy: see `fuzz.py`.
fn withstands(name: &str, machine: &Machine, seed: u32) {
    let Some(python) = python() else { return };
    let folder = Scratch::new();
    let kinds = Kinds { co_simulation: true, model_exchange: false };
    for version in [Version::Two, Version::Three] {
        let file = folder.path().join(format!("{name}.fmu"));
        if !written(machine, version, kinds, folder.path(), &file) {
            println!("left out: there is no compiler `cc`");
            return;
        }
        let script = root().join("tests/export/fuzz.py");
        let output =
            Command::new(&python).arg(script).arg(&file).args([seed.to_string(), "6".into()]).output().unwrap();
        let (told, wrong) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        println!("{name} {version:?}: {}", told.lines().last().unwrap_or_default());
        assert!(output.status.success(), "{name} {version:?}: {told}{wrong}");
    }
}

#[test]
fn fmus_withstand_what_importers_do() {
    withstands("pendulum", &machine(of_text(PENDULUM), Some(5e-3), "dopri5"), 1);
    withstands("held", &machine(of_text(super::sampled::HELD), Some(7e-3), "rk4"), 2);
    withstands("settable", &super::parameters::of_file("verification/bump-stop.toml", 1e-3, "dopri5"), 3);
    withstands("variable", &super::variable::of(of_text(super::sampled::HELD), Some(0.05), 1e-6), 4);
    withstands("loop", &machine(open("benchmarks/A04.toml", &[]), Some(1e-2), "rodas"), 5);
}

#[test]
fn random_mechanisms_are_valid_fmus() {
    let checks = Checks::new();
    let mut judged = Vec::new();
    for seed in 11..=20 {
        let style = [Style::Spatial, Style::Planar][seed as usize % 2];
        for mechanism in [Mechanism::new(seed, style), Mechanism::furnished(seed, style)] {
            let Some(machine) = super::of_mechanism(&checks, &mechanism) else { continue };
            let machine = Machine { step: 2e-4, ..machine };
            if judged.len() == 4 || !machine.tried(STEPS).is_good() {
                continue;
            }
            println!("{style:?} {seed}: {} states", machine.dim());
            // Communication points are rounded, and motions that lose digits lose these as well.
            judged_by(&format!("random_{seed}"), &machine, &table(&machine), (1e-4, 1e-8), &[]);
            judged.push(seed);
        }
    }
    assert!(judged.len() == 4, "of 20 mechanisms only {judged:?} can be exported");
}

/// A block at a spring, of any size.
const SLIDE: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
t_end = 4
output_step = 0.5
[[body]]
name = "block"
mass = 1
inertia = [#, #, #]
position = [@, 0, 0]
[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "block"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "block"]
points = [[-1@, 0, 0], [@, 0, 0]]
params = { stiffness = 30, damping = 0, free_length = @ }
"#;

/// Importing tools allow errors that are shares of the nominal values of states: in a small machine these are small.
#[test]
fn nominal_values_of_states_are_of_the_size_of_the_machine() {
    let both = Kinds { co_simulation: true, model_exchange: true };
    let nominals = |[size, square]: [&str; 2], version: Version| -> Vec<f64> {
        let text = SLIDE.replace("-1@", &format!("-{size}")).replace('@', size).replace('#', square);
        let fmu = Fmu::new(&machine(of_text(&text), None, "rk4"), version, both).unwrap();
        let found = fmu.files[0].1.split("nominal=\"").skip(1).map(|rest| rest.split('"').next().unwrap().to_owned());
        let found: Vec<String> = found.collect();
        let table = format!("static const double sizes[THE_SCENE_STATES] = {{{}}};", found.join(", "));
        assert!(fmu.sources.iter().any(|(_, text)| text.contains(&table)), "the functions give others: {table}");
        found.iter().map(|text| text.parse().unwrap()).collect()
    };
    for version in [Version::Two, Version::Three] {
        let (large, small) = (nominals(["1.0", "1.0"], version), nominals(["1e-6", "1e-12"], version));
        assert_eq!((large.len(), small.len()), (3, 3), "position, speed, and the work, on which nothing depends");
        for (large, small) in large.iter().zip(&small).take(2) {
            assert!((small / large / 1e-6 - 1.0).abs() < 1e-9 && *large > 0.1 && *large < 10.0, "{small} {large}");
        }
    }
}

/// The same files give the same bytes; another scene has another token.
#[test]
fn archives_are_reproducible() {
    let both = Kinds { co_simulation: true, model_exchange: true };
    let make = |set: &[&str]| {
        let machine = machine(open("compressor.toml", set), None, "rk4");
        Fmu::new(&machine, Version::Three, both).unwrap()
    };
    let [a, b, other] = [make(&[]), make(&[]), make(&["simulation.fixed_step=1 us"])];
    assert_eq!(a.archive(&[]).unwrap(), b.archive(&[]).unwrap());
    let token = |fmu: &Fmu| fmu.files[0].1.split("instantiationToken=\"").nth(1).unwrap()[..38].to_string();
    assert_ne!(token(&a), token(&other));
}
