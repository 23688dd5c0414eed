//! FMUs, judged by FMPy: valid, the digits of the interpreter in co-simulation, the results of runs in model exchange.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use odyn::export::fmu::{Fmu, Kinds, TARGETS, Version, build};
use odyn::export::{Machine, Twin};

use super::{PENDULUM, machine, of_text};
use crate::support::{Scratch, open, root};

/// A Python with FMPy; in this variable where it is another one than `python3`.
const PYTHON: &str = "ODYN_FMPY";
/// Steps that are compared.
const STEPS: usize = 40;

fn python() -> Option<String> {
    let python = std::env::var(PYTHON).unwrap_or_else(|_| "python3".into());
    let there = Command::new(&python).args(["-c", "import fmpy"]).output().is_ok_and(|output| output.status.success());
    if !there {
        println!("left out: `{python}` has no FMPy; name one that has in {PYTHON}");
    }
    there.then_some(python)
}

/// What the interpreter computes, as a table.
fn table(machine: &Machine) -> String {
    let mut twin = Twin::new(machine.clone());
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
fn written(machine: &Machine, version: Version, kinds: Kinds, folder: &Path, file: &Path) -> bool {
    let fmu = Fmu::new(machine, version, kinds).unwrap_or_else(|error| panic!("{}", error.message));
    let Some(binary) = build(&fmu, &TARGETS[0], folder).unwrap() else { return false };
    fs::write(file, fmu.archive(&[binary]).unwrap()).unwrap();
    true
}

fn judged(name: &str, machine: &Machine, tolerance: f64) {
    let Some(python) = python() else { return };
    let folder = Scratch::new();
    let table = folder.file("table.csv", table(machine));
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
