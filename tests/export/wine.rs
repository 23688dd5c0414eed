//! The library for Windows, called by a small master under Wine: the digits of the interpreter.

use std::fs;
use std::path::Path;
use std::process::Command;

use odyn::export::Twin;
use odyn::export::fmu::{Fmu, Kinds, TARGETS, Version, build};

use super::{machine, same};
use crate::support::{Scratch, open};

/// Calls an FMU of version 2.0 as an importing tool does: `master LIBRARY GUID FIRST COUNT STEP STEPS`.
const MASTER: &str = r#"
#include <stdio.h>
#include <stdlib.h>
#include <windows.h>

typedef void (*any)(void);
static any function(HMODULE library, const char *name) {
    any found = (any)GetProcAddress(library, name);
    if (found == NULL) {
        fprintf(stderr, "no %s\n", name);
        exit(2);
    }
    return found;
}
#define CALL(name, type) ((type)function(library, name))

int main(int argc, char **argv) {
    HMODULE library = LoadLibraryA(argc > 6 ? argv[1] : "");
    const unsigned first = argc > 6 ? (unsigned)atoi(argv[3]) : 0;
    const int count = argc > 6 ? atoi(argv[4]) : 0, steps = argc > 6 ? atoi(argv[6]) : 0;
    const double step = argc > 6 ? strtod(argv[5], NULL) : 0.0;
    void *callbacks[5] = {0}, *it;
    int k;
    if (library == NULL) {
        fprintf(stderr, "the library cannot be loaded\n");
        return 2;
    }
    it = CALL("fmi2Instantiate", void *(*)(const char *, int, const char *, const char *, void *, int, int))(
        "master", 1, argv[2], "", callbacks, 0, 0);
    if (it == NULL
        || CALL("fmi2SetupExperiment", int (*)(void *, int, double, double, int, double))(it, 0, 0.0, 0.0, 0, 0.0) != 0
        || CALL("fmi2EnterInitializationMode", int (*)(void *))(it) != 0
        || CALL("fmi2ExitInitializationMode", int (*)(void *))(it) != 0) {
        return 3;
    }
    for (k = 0; k < steps; ++k) {
        if (CALL("fmi2DoStep", int (*)(void *, double, double, int))(it, k * step, step, 1) != 0) {
            return 4;
        }
    }
    for (k = 0; k < count; ++k) {
        const unsigned reference = first + (unsigned)k;
        double value;
        if (CALL("fmi2GetReal", int (*)(void *, const unsigned *, size_t, double *))(it, &reference, 1, &value) != 0) {
            return 5;
        }
        printf("%.17g\n", value);
    }
    CALL("fmi2FreeInstance", void (*)(void *))(it);
    return 0;
}
"#;

/// The program that runs programs for Windows.
fn wine() -> Option<&'static str> {
    let known = ["wine64", "wine", "/usr/lib/wine/wine64"];
    let found = known.into_iter().find(|program| Command::new(program).arg("--version").output().is_ok());
    if found.is_none() {
        println!("left out: there is no `wine`");
    }
    found
}

#[test]
fn the_library_for_windows_has_the_digits_of_the_interpreter() {
    const STEPS: usize = 20;
    let Some(wine) = wine() else { return };
    // Without functions of the C library of Windows.
    let machine = machine(open("benchmarks/chain_N10.toml", &[]), None, "rk4");
    let kinds = Kinds { co_simulation: true, model_exchange: false };
    let fmu = Fmu::new(&machine, Version::Two, kinds).unwrap();
    let folder = Scratch::new();
    let Some(binary) = build(&fmu, &TARGETS[1], folder.path()).unwrap() else {
        println!("left out: there is no `{}`", TARGETS[1].compilers[0]);
        return;
    };
    fs::write(folder.path().join("machine.dll"), &binary.content).unwrap();
    let master = folder.file("master.c", MASTER);
    let output = Command::new(TARGETS[1].compilers[0])
        .args(["-std=c99", "-Wall", "-Wno-cast-function-type", "-o"])
        .arg(folder.path().join("master.exe"))
        .arg(&master)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let guid = fmu.files[0].1.split("guid=\"").nth(1).unwrap().split('"').next().unwrap().to_string();
    let mut twin = Twin::new(machine.clone());
    for _ in 0..STEPS {
        twin.step(machine.step).unwrap();
    }
    let found = run(
        wine,
        folder.path(),
        &guid,
        1 + machine.inputs.len(),
        machine.outputs.len() + machine.dim(),
        machine.step,
        STEPS,
    );
    same("outputs and state under Wine", &found, &[&twin.outputs().to_vec()[..], twin.state()].concat());
}

fn run(wine: &str, folder: &Path, guid: &str, first: usize, count: usize, step: f64, steps: usize) -> Vec<f64> {
    let output = Command::new(wine)
        .current_dir(folder)
        .env("WINEPREFIX", folder.join("prefix"))
        .env("WINEDEBUG", "-all")
        .env_remove("DISPLAY")
        .args(["master.exe", "machine.dll", guid])
        .args([first.to_string(), count.to_string(), format!("{step:?}"), steps.to_string()])
        .output()
        .unwrap();
    let (text, wrong) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{text} {wrong} {}", output.status);
    text.split_whitespace().map(|word| word.parse().unwrap()).collect()
}
