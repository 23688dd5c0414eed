//! The program with a library that does not come back, or breaks it.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // in a test, the panic is the message

// Builds libraries as strangers do.
#[allow(dead_code)] // each test program uses a part
#[path = "../../tests/fixtures.rs"]
mod fixtures;
mod support;

use support::{Ran, Scratch};

/// Two dampers, of which the second is stubborn.
const SCENE: &str = include_str!("../../tests/fixtures/stubborn-plugin/scene.toml");

/// Runs the scene with these parameters of the stubborn one.
fn run(scratch: &Scratch, params: &str, options: &str) -> Ran {
    scratch.file("scene.toml", &SCENE.replace("PARAMS", params));
    let libraries = fixtures::build("stubborn-plugin");
    let mut command = scratch.command(&format!("run scene.toml -o out {options}"));
    Ran(command.arg("--plugin").arg(libraries).output().unwrap())
}

#[test]
fn an_endless_call_is_ended_by_the_watchdog() {
    let scratch = Scratch::new("endless");
    let ran = run(&scratch, "does = 'wait', file = 'never', after = 60", "--watchdog 0.5").ends_with(4);
    assert!(ran.err().contains("error[ODY0412]: `it` (stubborn-plugin/stubborn) has not come back"), "{}", ran.err());
    assert!(ran.err().contains("from `evaluate`"), "{}", ran.err());
    assert_eq!(scratch.json("out/summary.json")["status"], "running");
    let json = run(&scratch, "does = 'wait', file = 'never', place = 'new', after = 0", "--watchdog 0.5 --json");
    let json = json.ends_with(4).json();
    assert_eq!((&json["exit_code"], &json["diagnostics"][0]["code"]), (&4.into(), &"ODY0412".into()));
}

/// Ends by that signal, after the element was named.
#[cfg(unix)]
#[track_caller]
fn crashes(test: &str, params: &str, number: i32, told: &str) {
    use std::os::unix::process::ExitStatusExt;
    let scratch = Scratch::new(test);
    let ran = run(&scratch, params, "");
    let error = ran.err();
    assert_eq!(ran.0.status.signal(), Some(number), "{error}");
    let named = format!("error[ODY0413]: `it` (stubborn-plugin/stubborn) crashed in {told}");
    assert!(error.contains(&named), "{error}");
    assert_eq!(error.matches("ODY0413").count(), 1, "{error}");
}

#[cfg(unix)]
#[test]
fn a_crash_names_the_element() {
    crashes("read", "does = 'read', after = 60", 11, "`evaluate`, SIGSEGV: an invalid access");
    crashes("abort", "does = 'abort', place = 'accept', after = 3", 6, "`accept`, SIGABRT: it ended itself");
}

/// The handler has a stack of its own; the standard library's words, and its signal, come behind.
#[cfg(unix)]
#[test]
fn recursion_without_end_names_the_element() {
    crashes(
        "recurse",
        "does = 'recurse', after = 60",
        6,
        "`evaluate`, SIGSEGV: an invalid access to memory, or recursion",
    );
}

/// On other threads, too: those of a study.
#[cfg(unix)]
#[test]
fn a_crash_within_a_study_names_the_element() {
    use std::os::unix::process::ExitStatusExt;
    let scratch = Scratch::new("crash-study");
    scratch.file("scene.toml", &SCENE.replace("PARAMS", "does = 'recurse', after = 60"));
    let libraries = fixtures::build("stubborn-plugin");
    let mut command = scratch.command("study scene.toml --vary a.mass=1:2:4 --jobs 2 -o out");
    let ran = Ran(command.arg("--plugin").arg(libraries).output().unwrap());
    assert!(ran.0.status.signal().is_some(), "{}", ran.err());
    assert!(ran.err().contains("`it` (stubborn-plugin/stubborn) crashed in"), "{}", ran.err());
}
