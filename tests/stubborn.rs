//! Elements that do not come back, recurse for ever, or give what is no number while a scene runs.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

use odyn::catalog::{Late, Watchdog};
use odyn::results::Table;
use odyn::session::{RunOptions, Session};

use crate::fixtures::{build, file};
use crate::support::{self, Scratch, options};

/// The folder that a test hands its child.
const FOLDER: &str = "ODYN_TEST_FOLDER";

/// Two dampers, of which the second is stubborn.
const SCENE: &str = include_str!("fixtures/stubborn-plugin/scene.toml");

fn scene(scratch: &Path, params: &str) -> (PathBuf, RunOptions) {
    let path = scratch.join("scene.toml");
    fs::write(&path, SCENE.replace("PARAMS", params)).unwrap();
    (path, options(&[], &[build("stubborn-plugin")]))
}

/// The element waits for a file that is made when it is asked to be late.
#[track_caller]
fn told(place: &str) -> Late {
    let scratch = Scratch::new();
    let awaited = scratch.path().join("awaited");
    let params = format!("does = 'wait', place = '{place}', after = 0, file = '{}'", awaited.display());
    let (path, mut options) = scene(scratch.path(), &params);
    let (tell, told) = mpsc::channel();
    let watchdog = Watchdog::start(Duration::from_millis(20), move |late| {
        let _ = tell.send(late.clone());
        // Loading may be slow, too: only the wait is ended by this.
        if late.function != "loading the library" {
            fs::write(&awaited, "").unwrap();
        }
    });
    options.watchdog = Some(watchdog);
    let session = Session::open(&path, &options).unwrap_or_else(|error| panic!("{error}"));
    session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"));
    drop(options);
    told.iter().find(|late: &Late| late.function != "loading the library").expect("it waits for being told")
}

#[test]
fn a_call_that_does_not_come_back_is_told_with_its_element() {
    for (place, function) in [("new", "create"), ("wrench", "record"), ("accept", "accept")] {
        let late = told(place);
        // Opaque elements are called once when they are recorded.
        let found = (late.library.as_str(), late.element.as_str(), late.instance.as_deref(), late.function);
        assert_eq!(found, ("stubborn-plugin", "stubborn", Some("it"), function));
        assert!(late.seconds >= 0.02);
    }
}

#[test]
fn a_late_call_in_words() {
    let late = |element: &str, instance: Option<&str>| Late {
        library: "lib".into(),
        element: element.into(),
        instance: instance.map(Into::into),
        function: "evaluate",
        seconds: 10.04,
    };
    let words = " has not come back from `evaluate` for 10.0 s";
    assert_eq!(late("rod", Some("it")).to_string(), format!("`it` (lib/rod){words}"));
    assert_eq!(late("rod", None).to_string(), format!("`lib/rod`{words}"));
    assert_eq!(late("", None).to_string(), format!("`lib`{words}"));
}

/// Runs the scene with its results where a parent wants them.
fn run_as_child(params: &str) {
    let folder = PathBuf::from(std::env::var_os(FOLDER).expect("the parent's folder"));
    let (path, options) = scene(&folder, params);
    let session = Session::open(&path, &options).unwrap_or_else(|error| panic!("{error}"));
    let _ = session.run(Some(&folder.join("out")), Box::new(|_| ()), &Default::default());
}

/// Its own process; what it leaves is looked at.
fn child(test: &str, scratch: &Path) -> std::process::Output {
    // The library is built by the parent, once.
    assert!(file(&build("stubborn-plugin"), "stubborn-plugin").is_file());
    support::child(test, FOLDER, scratch.as_os_str())
}

#[test]
#[ignore = "ends its process; run by another test"]
fn child_that_recurses() {
    run_as_child("does = 'recurse', after = 60");
}

/// Nothing can catch that: the guard page behind the stack ends the process. Results stay readable.
#[test]
fn recursion_without_end_ends_the_process_but_spoils_no_results() {
    let scratch = Scratch::new();
    let output = child("stubborn::child_that_recurses", scratch.path());
    assert!(!output.status.success());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("has overflowed its stack"), "{message}");
    let table = Table::read(&scratch.path().join("out/results.csv")).unwrap();
    assert_eq!(table.names, ["x"]);
    let summary = fs::read_to_string(scratch.path().join("out/summary.json")).unwrap();
    assert!(summary.contains("\"running\""), "{summary}");
}

#[test]
fn what_is_no_number_ends_the_run_with_results() {
    let scratch = Scratch::new();
    let (path, options) = scene(scratch.path(), "does = 'nan', after = 60");
    let session = Session::open(&path, &options).unwrap_or_else(|error| panic!("{error}"));
    let out = scratch.path().join("out");
    let report = session.run(Some(&out), Box::new(|_| ()), &Default::default()).unwrap();
    assert_eq!(report.exit_code(), 6, "{}", report.summary.reason);
    assert!(report.summary.reason.contains("finite"), "{}", report.summary.reason);
    let table = Table::read(&out.join("results.csv")).unwrap();
    assert_eq!(table.times.len(), report.times.len());
    assert!(table.columns.iter().flatten().all(|x| x.is_finite()), "{table:?}");
}
