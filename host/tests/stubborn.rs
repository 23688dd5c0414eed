//! The program with a library in its own process that does not come back, or breaks it.
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
    let mut command = scratch.command(&format!("run scene.toml -o out --in-process {options}"));
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
    crashes_as(test, params, number, &format!("`it` (stubborn-plugin/stubborn) crashed in {told}"));
}

/// The same in these words.
#[cfg(unix)]
#[track_caller]
fn crashes_as(test: &str, params: &str, number: i32, words: &str) {
    use std::os::unix::process::ExitStatusExt;
    let scratch = Scratch::new(test);
    let ran = run(&scratch, params, "");
    let error = ran.err();
    assert_eq!(ran.0.status.signal(), Some(number), "{error}");
    assert!(error.contains(&format!("error[ODY0413]: {words}")), "{error}");
    assert_eq!(error.matches("ODY0413").count(), 1, "{error}");
}

#[cfg(unix)]
#[test]
fn a_crash_names_the_element() {
    crashes("read", "does = 'read', after = 60", 11, "`evaluate`, SIGSEGV: an invalid access");
    crashes("abort", "does = 'abort', place = 'accept', after = 3", 6, "`accept`, SIGABRT: it ended itself");
}

#[cfg(unix)]
#[test]
fn a_crash_at_the_end_names_the_type() {
    crashes_as(
        "destroy",
        "does = 'abort', place = 'drop', after = 0",
        6,
        "`stubborn-plugin/stubborn` crashed in `destroy`, SIGABRT",
    );
}

/// Ends with exit code 4 and these words.
#[cfg(unix)]
#[track_caller]
fn ends_with_4(test: &str, params: &str, words: &str) {
    let scratch = Scratch::new(test);
    let ran = run(&scratch, params, "").ends_with(4);
    assert!(ran.err().contains(words), "{}", ran.err());
    assert_eq!(ran.err().matches("error[").count(), 1, "{}", ran.err());
}

/// `exit(0)` is no way to end a run with success.
#[cfg(unix)]
#[test]
fn a_library_that_exits_does_not_end_the_program_with_success() {
    let it = "error[ODY0413]: `it` (stubborn-plugin/stubborn) ended the program in";
    for (place, after, function) in
        [("new", 0, "create"), ("wrench", 0, "record"), ("wrench", 60, "evaluate"), ("accept", 3, "accept")]
    {
        let params = format!("does = 'exit', place = '{place}', after = {after}");
        ends_with_4(&format!("exit-{place}-{after}"), &params, &format!("{it} `{function}`, by `exit`"));
    }
    // Which of the instances it was is not known there.
    ends_with_4(
        "exit-drop",
        "does = 'exit', place = 'drop', after = 0",
        "`stubborn-plugin/stubborn` ended the program in `destroy`",
    );
    let words = "error[ODY0413]: a library ended the program by `exit`, from a thread of its own";
    ends_with_4("exit-thread", "does = 'exit-thread', after = 60", words);
}

/// Numbers under another rounding mode mean nothing, those of the host neither.
#[test]
fn a_call_that_changes_the_rounding_mode_is_named() {
    for (place, after, function) in [("wrench", 60, "evaluate"), ("accept", 3, "accept"), ("new", 0, "create")] {
        let scratch = Scratch::new(&format!("round-{place}"));
        let ran = run(&scratch, &format!("does = 'round', place = '{place}', after = {after}"), "");
        assert!(!ran.0.status.success(), "{}", ran.err());
        let words = "`stubborn-plugin/stubborn` changed rounding, denormals or traps";
        assert!(ran.err().contains(words), "{}", ran.err());
        assert!(ran.err().contains(&format!("in `{function}`")), "{}", ran.err());
    }
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
    let mut command = scratch.command("study scene.toml --vary a.mass=1:2:4 --jobs 2 -o out --in-process");
    let ran = Ran(command.arg("--plugin").arg(libraries).output().unwrap());
    assert!(ran.0.status.signal().is_some(), "{}", ran.err());
    assert!(ran.err().contains("`it` (stubborn-plugin/stubborn) crashed in"), "{}", ran.err());
}
