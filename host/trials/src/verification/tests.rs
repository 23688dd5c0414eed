//! Tests of what is judged, and of scenes that go wrong. `tests/verification.rs` runs the real scenes.

use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

use element_api::{Descriptor, Kind};

use super::balance::{Reports, channels};
use super::*;
use crate::session::{RunOptions, RunReport, Session};
use crate::tests::{catalog, scene, scenes};

/// A run of a scene with the reports for its balance.
fn reported(text: &str) -> (Reports, RunReport) {
    let options = RunOptions { further_channels: Some(channels), ..RunOptions::default() };
    let session = Session::with_catalog(scene(text), Vec::new(), &catalog(), &options);
    let session = session.unwrap_or_else(|error| panic!("{error}"));
    let reports = Reports::of(&session);
    let report = session.run(None, Box::new(|_| ()), &Arc::default()).unwrap_or_else(|error| panic!("{error}"));
    (reports, report)
}

/// Skew markers off all centres of mass, springs, friction, redundant rows; recorded and opaque.
#[test]
fn reported_loads_balance_the_motion() {
    for text in [scenes::tangle(), scenes::opaque_tangle(), scenes::four_bar(1.0), scenes::pendulum("")] {
        let (reports, report) = reported(&text);
        let balance = reports.judge(&report).unwrap();
        assert!(balance.share < 1e-12 && balance.passed(), "{balance:?} in\n{text}");
    }
}

/// There is no load to measure it by, only products of inertia and speed that cancel.
#[test]
fn round_off_in_a_wheel_that_turns_evenly_is_no_imbalance() {
    let wheel =
        scenes::pendulum("").replace("position = [0.5, 0, 0]", "position = [0, 0, 0]\nangular_velocity = [0, 0, 3]");
    let (reports, mut report) = reported(&wheel);
    let left = column_of(&report, "balance 0");
    report.columns[left][2] = 1e-15;
    assert!(reports.judge(&report).unwrap().passed());
    report.columns[left][2] = 1e-6;
    assert!(!reports.judge(&report).unwrap().passed());
}

fn column_of(report: &RunReport, name: &str) -> usize {
    report.channels.iter().position(|channel| channel.name == name).unwrap()
}

#[test]
fn what_is_left_of_a_body_is_found_with_its_time() {
    let (reports, report) = reported(&scenes::tangle());
    // Per body three components, each a force, a torque and an angular velocity: the second torque of the second body.
    let left = column_of(&report, "balance 0") + 9 + 4;
    for (value, passes) in [(1e-9, true), (1e-3, false), (f64::NAN, false)] {
        let mut doctored = report.clone();
        doctored.columns[left][3] = value;
        let balance = reports.judge(&doctored).unwrap();
        assert_eq!(balance.passed(), passes, "{value}: {balance:?}");
        assert_eq!((balance.body.as_str(), balance.torque, balance.at), ("b", true, report.times[3]), "{value}");
    }
}

#[test]
fn a_body_without_loads_must_keep_its_speed() {
    let (reports, report) =
        reported("[[body]]\nname = \"stone\"\nmass = 1\ninertia = [1, 1, 1]\nvelocity = [1, 2, 3]\n");
    assert_eq!(reports.judge(&report).unwrap().share, 0.0);
    let mut doctored = report;
    doctored.columns[0][5] = 1e-30;
    assert_eq!(reports.judge(&doctored).unwrap().share, f64::INFINITY);
}

fn checked(largest: f64, tolerance: f64) -> Checked {
    Checked { largest, tolerance, passed: largest <= tolerance, ..Checked::default() }
}

#[test]
fn the_worst_check_is_the_one_furthest_beyond_its_tolerance() {
    let worst = |checks: Vec<Checked>| Measured { checks, ..Measured::default() }.worst();
    assert_eq!(worst(vec![checked(4e-3, 1e-2), checked(3e-9, 1e-9), checked(0.0, 1.0)]), 3e-9 / 1e-9);
    assert!(worst(vec![checked(f64::NAN, 1.0), checked(2.0, 1.0)]).is_nan());
    assert_eq!(worst(vec![checked(0.0, 0.0)]), 0.0, "no error passes any tolerance");
}

#[test]
fn an_imbalance_fails_a_case_whose_checks_pass() {
    let measured = |share| Measured {
        checks: vec![checked(1.0, 2.0)],
        balance: Some(Balance { share, ..Balance::default() }),
        ..Measured::default()
    };
    assert!(measured(BALANCE_BOUND).passed());
    assert!(!measured(2.0 * BALANCE_BOUND).passed() && !measured(f64::NAN).passed());
}

fn element(name: &str) -> Element {
    let (library, short) = name.split_once('/').unwrap();
    let descriptor = Descriptor {
        name: short.into(),
        kind: Kind::Joint,
        summary: String::new(),
        doc: String::new(),
        opaque: false,
        angles: 0,
        mobility: None,
        turns_freely: false,
        glyph: String::new(),
        frames: Vec::new(),
        rows: Vec::new(),
        inputs: Vec::new(),
        joints: Vec::new(),
        channels: Vec::new(),
        states: Vec::new(),
        params: Vec::new(),
        exempt: Vec::new(),
        checks: Vec::new(),
        catalog: String::new(),
        report: String::new(),
        parallel_axes: Vec::new(),
        unknowns: Vec::new(),
        values: Vec::new(),
        more_frames: None,
        most_frames: 0,
    };
    Element { name: name.into(), library: library.into(), version: "1".into(), descriptor }
}

#[test]
fn elements_without_a_scene_are_gaps_in_libraries_that_are_verified_at_all() {
    let elements = ["mine/arm", "mine/leg", "theirs/hinge"].map(element);
    let case = Case {
        name: "x".into(),
        file: "x.toml".into(),
        title: "x".into(),
        elements: vec!["mine/leg".into(), "nobody/knows".into()],
        analysis: None,
        text: String::new(),
        source: String::new(),
        outcome: Err("failed: it is not the coverage that tells".into()),
    };
    let coverage = Coverage::of(&[case], &elements);
    assert_eq!(coverage.libraries, ["mine"]);
    assert_eq!(coverage.verified, ["mine/leg"]);
    assert_eq!(coverage.gaps, ["mine/arm"]);
}

/// A folder of its own for a test, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(test: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("odyn-verification-{}-{test}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A stone that is thrown, with checks of its height and its speed.
const THROW: &str = r#"
title = "Throw"
[units]
time = "ms"
[simulation]
gravity = [0, "-9.81 m/s^2", 0]
t_end = 1000
output_step = 100
[[body]]
name = "stone"
mass = 2
inertia = [1, 1, 1]
velocity = [0, "5 m/s", 0]
[[output]]
name = "height"
quantity = "position"
of = "stone"
component = "y"
[[check]]
name = "parabola"
kind = "position"
value = "height"
reference = "5e-3 t - 9.81e-6 t^2 / 2"
tolerance = 1e-12
[[check]]
name = "late"
kind = "position"
value = "height - 0"
reference = 0.095
tolerance = 1e-12
from = 1000
"#;

#[test]
fn a_scene_is_measured_at_its_own_tolerance_and_on_the_ladder() {
    let scratch = Scratch::new("throw");
    let path = scratch.file("throw.toml", THROW);
    let mut verifier = Verifier::new(Settings { ladder: true, ..Settings::default() });
    let case = verifier.verify(&path);
    let measured = case.outcome.clone().unwrap();
    assert!(case.passed(), "{measured:?}");
    assert_eq!((case.name.as_str(), case.title.as_str(), case.source.as_str()), ("throw", "Throw", THROW));
    assert_eq!(measured.time_unit, "ms");
    let [parabola, late] = measured.checks.as_slice() else { panic!("two checks") };
    assert_eq!((parabola.errors.len(), late.errors.len(), late.at), (11, 1, 1000.0));
    assert_eq!(
        (parabola.value.as_str(), parabola.reference.as_str(), late.reference.as_str()),
        ("height", "5e-3 t - 9.81e-6 t^2 / 2", "0.095")
    );
    assert!(measured.balance.unwrap().share < 1e-14);
    let tolerances: Vec<f64> = measured.ladder.iter().map(|rung| rung.tolerance).collect();
    assert_eq!(tolerances, LADDER);
    assert!(measured.ladder.iter().all(|rung| rung.largest.len() == 2 && rung.work.evaluations > 0));
    assert!(verifier.verify(&path) == case, "the same twice");
}

#[test]
fn a_scene_that_goes_wrong_is_a_failed_case_with_the_reason() {
    let scratch = Scratch::new("wrong");
    let without_checks = THROW.split("[[check]]").next().unwrap();
    for (text, reason) in [
        ("title = ", "ODY"),
        (without_checks, "the scene has no [[check]]"),
        (&THROW.replace("[[body]]", "[plugins]\nlibraries = [\"no-such-library\"]\n[[body]]"), "no-such-library"),
        (
            &format!("{THROW}\n[verification]\nelements = [\"odyn-joints/revolute\"]\ntext = \"x\"\n"),
            "names `odyn-joints/revolute`, but the scene has no such element",
        ),
        (&THROW.replace("t_end = 1000", "t_end = 1000\nmax_steps = 2\nmax_step = 1"), "stopped early"),
    ] {
        let path = scratch.file("scene.toml", text);
        let case = Verifier::new(Settings::default()).verify(&path);
        assert!(!case.passed());
        let found = case.outcome.unwrap_err();
        assert!(found.contains(reason), "`{reason}` is not in `{found}`");
    }
    let missing = Verifier::new(Settings::default()).verify(&scratch.0.join("missing.toml"));
    assert!(missing.outcome.unwrap_err().contains("missing.toml"));
}

/// Cases do not depend on how many are run at the same time, and each is reported once.
#[test]
fn cases_are_the_same_however_many_run_at_the_same_time() {
    let scratch = Scratch::new("jobs");
    let wrong = THROW.replace("9.81e-6", "9.80e-6");
    let texts = [THROW, wrong.as_str(), "title = ", THROW, wrong.as_str()];
    let named = texts.iter().enumerate().map(|(k, text)| scratch.file(&format!("scene-{k}.toml"), text));
    let paths: Vec<PathBuf> = named.collect();
    let run = |jobs: usize| {
        let told = std::sync::Mutex::new(Vec::new());
        let note = |case: &Case| told.lock().unwrap().push(case.name.clone());
        let cases = Verifier::new(Settings::default()).verify_all(&paths, jobs, &note);
        let mut told = told.into_inner().unwrap();
        told.sort();
        (cases, told)
    };
    let (one, told) = run(1);
    assert_eq!(told, ["scene-0", "scene-1", "scene-2", "scene-3", "scene-4"]);
    assert_eq!(one.iter().map(Case::passed).collect::<Vec<_>>(), [true, false, false, true, false]);
    for jobs in [2, 5] {
        let (several, told_too) = run(jobs);
        assert!(several == one && told_too == told, "{jobs} at the same time");
    }
}

#[test]
fn a_wrong_answer_fails() {
    let scratch = Scratch::new("answer");
    let path = scratch.file("throw.toml", &THROW.replace("9.81e-6", "9.80e-6"));
    let case = Verifier::new(Settings::default()).verify(&path);
    let measured = case.outcome.clone().unwrap();
    assert!(!case.passed() && !measured.checks[0].passed && measured.checks[1].passed, "{measured:?}");
    // 0.01 m/s^2 over a second.
    assert!((measured.checks[0].largest - 0.005).abs() < 1e-12);
    assert!(measured.ladder.is_empty());
}

/// The stone's loads, a number and a word of them.
const LOADS: &str = r#"
[verification]
elements = []
text = "A stone falls."
analysis = "loads"
options = { body = "stone", at = [500] }
[[verification.number]]
name = "weight"
of = "cases/0/weight/1"
reference = "-2 * 9.81"
tolerance = 1e-12
[[verification.number]]
name = "body"
of = "body"
equals = "stone"
"#;

#[test]
fn an_analysis_is_judged_by_its_numbers() {
    let scratch = Scratch::new("analysis");
    let alone = THROW.split("[[check]]").next().unwrap();
    let verify = |text: &str| Verifier::new(Settings::default()).verify(&scratch.file("scene.toml", text));
    let case = verify(&format!("{alone}{LOADS}"));
    assert!(case.passed(), "{:?}", case.outcome);
    assert_eq!(case.analysis.as_deref(), Some("loads"));
    assert_eq!(case.outcome.unwrap().checks.len(), 2);
    // With checks of a run beside it.
    assert_eq!(verify(&format!("{THROW}{LOADS}")).outcome.unwrap().checks.len(), 4);
    for (from, to) in [("-2 * 9.81", "-2 * 9.80"), ("equals = \"stone\"", "equals = \"rock\"")] {
        let case = verify(&format!("{alone}{}", LOADS.replace(from, to)));
        let checks = case.outcome.as_ref().unwrap().checks.clone();
        assert!(!case.passed() && checks.iter().filter(|check| !check.passed && check.problem.is_some()).count() == 1);
    }
}

#[test]
fn mistakes_in_the_table_of_an_analysis_are_named_with_their_place() {
    let scratch = Scratch::new("analysis-wrong");
    let alone = THROW.split("[[check]]").next().unwrap();
    for (from, to, reason) in [
        ("\"loads\"", "\"load\"", "`load` is no analysis: known are statics, modes"),
        ("at = [500]", "when = [500]", "unknown field `when`"),
        ("at = [500]", "at = \"soon\"", "invalid type"),
        ("body = \"stone\"", "body = \"stones\"", "did you mean `stone`?"),
        ("cases/0/weight/1", "cases/1/weight/1", "no `1` among 1 entries"),
        ("cases/0/weight/1", "cases/0/weights/1", "no `weights` among"),
        ("cases/0/weight/1", "cases/0/weight", "is no number"),
        ("\"-2 * 9.81\"", "\"-2 * height\"", "`height` is neither"),
        ("\"-2 * 9.81\"", "\"-2 * t\"", "does not depend on the time"),
        ("tolerance = 1e-12", "tolerance = -1e-12", "must not be negative"),
        ("tolerance = 1e-12", "", "tolerance"),
        ("equals = \"stone\"", "equals = \"stone\"\ntolerance = 1", "has both `equals` and `tolerance`"),
        ("name = \"body\"", "name = \"weight\"", "weight"),
        ("analysis = \"loads\"", "", "is of an analysis, and `[verification]` names none"),
        ("options = {", "options = 3 #", "a table of options"),
    ] {
        let text = format!("{alone}{}", LOADS.replacen(from, to, 1));
        let case = Verifier::new(Settings::default()).verify(&scratch.file("scene.toml", &text));
        let found = case.outcome.clone().map(|_| String::new()).unwrap_or_else(|reason| reason);
        assert!(found.contains(reason), "`{to}`: `{reason}` is not in `{found}`");
        assert!(to == "body = \"stones\"" || found.contains("scene.toml:"), "no place: {found}");
    }
}

#[test]
fn the_scenes_of_a_folder_come_in_order_and_nothing_else() {
    let scratch = Scratch::new("folder");
    for name in ["b.toml", "a.toml", "a.csv"] {
        scratch.file(name, "");
    }
    fs::create_dir(scratch.0.join("c.toml")).unwrap();
    assert_eq!(scenes_in(&scratch.0).unwrap(), ["a.toml", "b.toml"].map(|name| scratch.0.join(name)));
    assert!(scenes_in(&scratch.0.join("missing")).is_err());
}
