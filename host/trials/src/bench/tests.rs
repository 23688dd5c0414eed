use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use super::reference::Reference;
use super::report::median;
use super::runner::error_of;
use super::*;
use crate::results::CheckResult;
use crate::session::{RunOptions, Session};

/// Free fall, whose parabola every method follows exactly, and a body that nothing holds.
const FALL: &str = "
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.1
[[body]]
name = \"stone\"
mass = 1
inertia = [1, 2, 3]
velocity = [0, 0, 2]
[[output]]
name = \"z\"
quantity = \"position\"
of = \"stone\"
component = \"z\"
[[output]]
name = \"v\"
quantity = \"velocity\"
of = \"stone\"
component = \"z\"
[[check]]
name = \"speed\"
kind = \"velocity\"
value = \"v\"
reference = \"5\"
tolerance = 1
";

const HEIGHT: &str = "
[[check]]
name = \"height\"
kind = \"position\"
value = \"z\"
reference = \"2 * t - 9.81 / 2 * t^2 + 0.25\"
tolerance = 1
";

/// A file of its own for a test, removed at its end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str, text: &str) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("odyn-bench-tests-{}-{number}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join(name);
        fs::write(&path, text).unwrap();
        Self(path)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(self.0.parent().unwrap());
    }
}

fn settings(methods: &[&str]) -> Settings {
    Settings {
        methods: methods.iter().map(ToString::to_string).collect(),
        tolerances: vec![1e-4, 1e-9],
        repeats: 3,
        ..Settings::default()
    }
}

fn measured(point: &Point) -> Measured {
    *point.outcome.as_ref().unwrap_or_else(|reason| panic!("{reason}"))
}

#[test]
fn coordinates_are_measured_before_anything_else() {
    let scene = Scratch::new("fall.toml", &(FALL.to_string() + HEIGHT));
    let problem = Runner::new(settings(&["auto"])).measure(&scene.0, |_| ());
    assert_eq!((problem.name.as_str(), problem.measured.as_slice()), ("fall", ["z".to_string()].as_slice()));
    assert_eq!((problem.unit.as_str(), problem.points.len()), ("m", 2));
    for point in &problem.points {
        // A quarter of a metre off, however the speed is off by more.
        assert!((measured(point).error - 0.25).abs() < 1e-12, "{point:?}");
    }
    let scene = Scratch::new("speed.toml", FALL);
    let problem = Runner::new(settings(&["auto"])).measure(&scene.0, |_| ());
    assert!((measured(&problem.points[0]).error - 12.81).abs() < 1e-9, "5 against 2 - 9.81");
}

#[test]
fn every_method_runs_and_the_work_is_that_of_the_run() {
    let scene = Scratch::new("fall.toml", &(FALL.to_string() + HEIGHT));
    let mut told = Vec::new();
    let problem = Runner::new(settings(&["dop853", "rk4"])).measure(&scene.0, |point| told.push(point.clone()));
    assert_eq!(problem.points, told);
    let settings: Vec<Setting> = problem.points.iter().map(|point| point.setting).collect();
    let steps = [Setting::Step(1.0 / 250.0), Setting::Step(1.0 / 1000.0)];
    assert_eq!(settings, [Setting::Tolerance(1e-4), Setting::Tolerance(1e-9), steps[0], steps[1]]);
    let fixed = measured(&problem.points[3]);
    assert_eq!((fixed.work.steps, fixed.work.rejected, fixed.repeats), (Some(1000), Some(0), 3));
    assert!(fixed.times.total >= fixed.times.integrate && fixed.times.integrate > 0.0);
}

#[test]
fn what_cannot_be_measured_has_failed_with_a_reason() {
    let reason_of = |name: &str, text: &str, settings: Settings, points: usize| {
        let scene = Scratch::new(name, text);
        let problem = Runner::new(settings).measure(&scene.0, |_| ());
        assert!(!problem.solved() && problem.points.len() == points);
        problem.points[0].outcome.clone().unwrap_err()
    };
    let reason = |name: &str, text: &str, settings: Settings| reason_of(name, text, settings, 2);
    let none = reason("none.toml", &FALL[..FALL.find("[[output]]").unwrap()], settings(&["auto"]));
    assert!(none.contains("neither [[output]] nor [[check]]"), "{none}");
    // A scene that cannot be opened fails once.
    let text = "[simulation]\nt_end = 1\noutput_step = 0.1\n[[bodi]]\n";
    let broken = reason_of("broken.toml", text, settings(&["auto", "rk4"]), 1);
    assert!(broken.contains("bodi"), "{broken}");
    let csv = FALL.replace("reference = \"5\"", "reference = { csv = \"nowhere.csv\", column = \"v\" }");
    let missing = reason("missing.toml", &csv, settings(&["auto"]));
    assert!(missing.contains("nowhere.csv"), "{missing}");
    let steps = "t_end = 1\nmax_step = 1e-6";
    let slow = Settings { limit: std::time::Duration::from_millis(1), ..settings(&["auto"]) };
    let late = reason("late.toml", &FALL.replace("t_end = 1", steps), slow);
    assert!(late.contains("over the limit of 0.001 s"), "{late}");
}

#[test]
fn errors_that_are_not_numbers_are_no_errors() {
    let check = |kind, largest| CheckResult { kind, largest, unit: "m".into(), ..CheckResult::default() };
    assert_eq!(error_of(&[check("position", 1e-3), check("position", 2e-3)]).unwrap(), (2e-3, "m".into()));
    assert!(error_of(&[check("position", 1e-3), check("position", f64::NAN)]).is_err());
    let angle = CheckResult { unit: "rad".into(), ..check("orientation", 5.0) };
    assert_eq!(error_of(&[check("position", 1e-3), angle]).unwrap(), (5.0, String::new()));
}

#[test]
fn medians() {
    assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
    assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
    assert!(median(Vec::new()).is_nan());
}

/// A report with a run, a failed one and one of another program.
fn report() -> Report {
    let run = Measured {
        error: 1.25e-7,
        energy_error: 3e-9,
        work: Work { steps: Some(10), rejected: Some(1), evaluations: Some(120), factorisations: Some(130) },
        times: Times { load: 0.01, compile: 0.002, machine_code: 0.001, integrate: 0.0005, total: 0.0125 },
        repeats: 5,
    };
    let unknown = f64::NAN;
    let times = Times { load: unknown, compile: unknown, machine_code: unknown, integrate: 0.25, total: unknown };
    let peer = Measured { error: 1e-3, energy_error: f64::NAN, times, ..Measured::default() };
    let point = |solver: &str, method: &str, setting, outcome| Point {
        problem: "swing".into(),
        solver: solver.into(),
        method: method.into(),
        setting,
        outcome,
    };
    let problem = Problem {
        reference: String::new(),
        name: "swing".into(),
        title: "Swing <1>".into(),
        measured: vec!["x".into()],
        unit: "m".into(),
        start_up: Some(0.03),
        points: vec![
            point("odyn", "one", Setting::Tolerance(1e-6), Ok(run)),
            point("odyn", "one", Setting::Tolerance(1e-9), Err("stopped: a, \"b\"".into())),
        ],
    };
    Report {
        machine: Machine { processor: "P".into(), cores: 2, ..Machine::default() },
        date: "today".into(),
        problems: vec![problem],
        peers: vec![point("other", "two", Setting::Step(1e-3), Ok(peer))],
    }
}

#[test]
fn tables_are_read_back_as_they_were_written() {
    let report = report();
    let text = write(&report);
    assert!(text.contains("# today\n") && text.lines().filter(|line| line.starts_with('#')).count() == 2);
    let file = Scratch::new("bench.csv", &text);
    let points = read(&file.0).unwrap();
    assert_eq!(points.len(), 3);
    for (read, written) in points.iter().zip(report.points()) {
        // NaN is not equal to itself: compare as text.
        assert_eq!(format!("{read:?}"), format!("{written:?}"));
    }
    let few = Scratch::new("few.csv", "problem,solver,method,setting,value,status\nswing,o,m,step,0.1,too slow\n");
    assert_eq!(read(&few.0).unwrap()[0].outcome, Err("too slow".into()));
    for (text, told) in [
        ("problem,solver\n", "no column is called `method`"),
        ("problem,solver,method,setting,value,status\nswing,o,m,pace,1,ok\n", "line 2: `setting` is `pace`"),
        ("problem,solver,method,setting,value,status\nswing,o,m,step,x,ok\n", "`value` is `x`, not a number"),
    ] {
        let file = Scratch::new("wrong.csv", text);
        let message = read(&file.0).unwrap_err();
        assert!(message.contains(told), "{message}");
    }
}

/// Runs of one problem: program, method, error, time.
fn timed(name: &str, runs: &[(&str, &str, f64, f64)]) -> Vec<Point> {
    let point = |&(solver, method, error, integrate): &(&str, &str, f64, f64)| Point {
        problem: name.into(),
        solver: solver.into(),
        method: method.into(),
        setting: Setting::Tolerance(1e-6),
        outcome: Ok(Measured { error, times: Times { integrate, ..Times::default() }, ..Measured::default() }),
    };
    runs.iter().map(point).collect()
}

#[test]
fn programs_are_compared_at_equal_errors() {
    let ours =
        [("odyn", "a", 1e-4, 1.0), ("odyn", "a", 1e-7, 3.0), ("odyn", "b", 5e-7, 2.0), ("odyn", "b", 1e-10, 8.0)];
    let theirs = [("other", "x", 1e-3, 4.0), ("other", "x", 9e-7, 32.0), ("fast", "y", 1e-12, 2.0)];
    let mut report = Report {
        problems: vec![Problem { name: "p".into(), points: timed("p", &ours), ..Problem::default() }],
        peers: timed("p", &theirs),
        ..Report::default()
    };
    let best = report.best(&report.problems[0]);
    let times: Vec<_> = best.iter().map(|best| (best.method.as_str(), best.times)).collect();
    assert_eq!(times[0], ("a", [Some(1.0), Some(3.0), None]));
    assert_eq!(times[1], ("b", [Some(2.0), Some(2.0), Some(8.0)]));
    assert_eq!(times[2], ("x", [Some(4.0), Some(32.0), None]));
    let ratios = report.ratios();
    let [other, fast] = &ratios[..] else { panic!("{ratios:?}") };
    // 4 / 1 and 32 / 2.
    assert!((other.mean - 8.0).abs() < 1e-12, "{other:?}");
    assert_eq!((other.compared, other.only_ours, other.only_theirs), (2, 1, 0));
    assert_eq!(other.least, Some((4.0, "p".into(), 1e-3)));
    assert_eq!((fast.compared, fast.least.clone()), (3, Some((0.25, "p".into(), 1e-9))));
    // What is less accurate, failed or of another problem is no time.
    report.problems[0].points = timed("p", &[("odyn", "a", 1e-2, 1.0)]);
    report.problems.push(Problem { name: "q".into(), points: timed("q", &ours), ..Problem::default() });
    let other = report.ratios().remove(0);
    assert!(other.mean.is_nan());
    assert_eq!((other.compared, other.only_ours, other.only_theirs), (0, 0, 2));
}

#[cfg(feature = "manual")]
#[test]
fn the_page_has_curves_numbers_and_failures() {
    let page = report().page();
    assert!(page.contains("Swing &lt;1&gt;") && !page.contains("Swing <1>"));
    // Two drawings of our one point, one of the peer's, which has no evaluations.
    assert_eq!(page.matches("<circle").count(), 3);
    for text in [
        "odyn one",
        "other two",
        "1.25e-7",
        "<span class=\"bad\">failed</span> stopped",
        "today",
        "Other programs",
        "500 (swing",
    ] {
        assert!(page.contains(text), "{text}");
    }
    let drawing = report().drawing(&report().problems[0]).unwrap();
    // Two more of each series in the key.
    assert_eq!(drawing.matches("<circle").count(), 5);
    assert!(drawing.contains(&report().machine.line()));
    assert!(drawing.starts_with("<svg xmlns=") && drawing.ends_with("</text>\n</svg>\n"), "{drawing}");
    let mut failed = report();
    failed.problems[0].points.remove(0);
    failed.peers.clear();
    assert!(failed.page().contains("No run came to its end."));
    assert!(failed.drawing(&failed.problems[0]).is_none());
}

/// A body that tumbles about its middle axis; `spin` in rad/s.
fn tumbling(spin: f64) -> String {
    let outputs = ["x", "y", "z"].map(|axis| {
        format!(
            "[[output]]\nname = \"{axis}\"\nquantity = \"angular_velocity\"\nof = \"stone\"\ncomponent = \"{axis}\"\n"
        )
    });
    let body = FALL[..FALL.find("[[output]]").unwrap()].replace("t_end = 1", "t_end = 10");
    format!("{body}angular_velocity = [0.01, {spin:?}, 0.02]\n{}", outputs.concat())
}

#[test]
fn a_scene_without_checks_is_measured_against_a_computed_reference() {
    let scene = Scratch::new("tumble.toml", &tumbling(5.0));
    let folder = scene.0.parent().unwrap().join("kept");
    let settings = || Settings { references: Some(folder.clone()), ..settings(&["dop853"]) };
    let problem = Runner::new(settings()).measure(&scene.0, |_| ());
    assert_eq!(problem.measured, ["x", "y", "z"]);
    let [loose, tight] = [0, 1].map(|k| measured(&problem.points[k]).error);
    assert!(loose < 1e-2 && tight < 1e-6 && loose > 100.0 * tight, "{loose:e} {tight:e}");
    assert!(problem.reference.contains("numbers of 31 digits, which agree to 1.1e-16"), "{}", problem.reference);

    // What was kept is used again, and the errors are those of before; no error is less than the reference is known.
    let kept = folder.join("tumble.reference.csv");
    let text = fs::read_to_string(&kept).unwrap();
    let again = Runner::new(settings()).measure(&scene.0, |_| ());
    assert_eq!([0, 1].map(|k| measured(&again.points[k]).error), [loose, tight]);
    let mut lines: Vec<&str> = text.lines().collect();
    lines[2] = "# 0.5";
    fs::write(&kept, lines.join("\n") + "\n").unwrap();
    let coarse = Runner::new(settings()).measure(&scene.0, |_| ());
    assert_eq!(measured(&coarse.points[1]).error, 0.5);

    // Another scene has another reference.
    fs::write(&scene.0, tumbling(4.0)).unwrap();
    let other = Runner::new(settings()).measure(&scene.0, |_| ());
    assert!(measured(&other.points[1]).error < 1e-6);
    assert_ne!(fs::read_to_string(&kept).unwrap(), text);
    let shorter = Settings { t_end: Some("1 s".into()), ..settings() };
    Runner::new(shorter).measure(&scene.0, |_| ());
    assert_eq!(fs::read_to_string(&kept).unwrap().lines().count(), 6 + 11);
}

#[test]
fn more_digits_are_no_reference_where_they_end_early_or_disagree() {
    let scene = Scratch::new("tumble.toml", &tumbling(5.0));
    let session = || Session::open(&scene.0, &RunOptions::default()).unwrap();
    let precise = |go_on: bool| session().precise().unwrap().solve(&|| go_on);
    let run = session().run(None, Box::new(|_| ()), &Arc::default()).unwrap();
    let found = Reference::precise(&precise(true), &run, &[0.0; 3]).unwrap();
    assert!(found.accuracy < 1e-15 && found.error(&run).unwrap() < 1e-6, "{found:?}");
    assert_eq!(Reference::precise(&precise(false), &run, &[0.0; 3]).unwrap_err(), "interrupted");
    fs::write(&scene.0, tumbling(5.001)).unwrap();
    let reason = Reference::precise(&precise(true), &run, &[0.0; 3]).unwrap_err();
    assert!(reason.contains("numbers of 31 digits and a run in doubles are apart"), "{reason}");
}

#[test]
fn computations_that_part_are_no_reference() {
    let run = |text: &str| {
        let scene = Scratch::new("tumble.toml", text);
        let session = Session::open(&scene.0, &RunOptions::default()).unwrap();
        session.run(None, Box::new(|_| ()), &Arc::default()).unwrap()
    };
    let (first, second) = (run(&tumbling(5.0)), run(&tumbling(5.00001)));
    let reason = Reference::new(&first, &second, &[0.0; 3], "one and another").unwrap_err();
    assert!(reason.contains("one and another are apart by more than 1e-6") && reason.contains("--t-end"), "{reason}");
    assert!(Reference::new(&first, &first, &[0.0; 3], "the same twice").unwrap().accuracy == 0.0);
}
