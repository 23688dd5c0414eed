//! Checks of values whose errors are known.

use super::Scratch;
use crate::results::{Check, CheckResult, Expected, Status, Summary, Table, report};

const TIMES: [f64; 5] = [0.0, 0.1, 0.2, 0.30000000000000004, 0.4];

fn check<'a>(value: &'a dyn Fn(usize) -> f64, reference: Expected<'a>) -> Check<'a> {
    Check { name: "c", kind: "position", unit: "mm", value, reference, tolerance: 0.5, from: None, to: None }
}

#[test]
fn the_largest_error_counts_with_its_time() {
    let value = |row: usize| [1.0, 1.25, 0.25, 1.5, 1.0][row];
    let found = check(&value, Expected::Formula(&|_| 1.0)).evaluate(&TIMES);
    assert_eq!((found.largest, found.at, found.passed, found.samples), (0.75, 0.2, false, 5));
    assert_eq!((found.name.as_str(), found.kind, found.unit.as_str()), ("c", "position", "mm"));
    assert_eq!(found.series[2], (0.2, 0.25, 1.0));
    assert_eq!(found.without_samples(), CheckResult { series: Vec::new(), ..found });
    // The tolerance itself is allowed.
    let wide = Check { tolerance: 0.75, ..check(&value, Expected::Formula(&|_| 1.0)) };
    assert!(wide.evaluate(&TIMES).passed);
    let exact = Check { tolerance: 0.0, ..check(&value, Expected::Formula(&value)) };
    assert!(exact.evaluate(&TIMES).passed);
}

#[test]
fn limits_of_time_belong_to_it() {
    let value = |row: usize| row as f64;
    let limited = Check { from: Some(0.1), to: Some(0.3), ..check(&value, Expected::Formula(&|_| 0.0)) };
    let found = limited.evaluate(&TIMES);
    assert_eq!((found.samples, found.largest, found.series[0].0), (3, 3.0, 0.1));
}

#[test]
fn what_is_not_a_number_fails() {
    for value in [f64::NAN, f64::INFINITY] {
        let value = move |row: usize| if row == 3 { value } else { 0.0 };
        let found = check(&value, Expected::Formula(&|_| 0.0)).evaluate(&TIMES);
        assert!(!found.passed && found.at == TIMES[3] && found.problem.is_none());
        // Infinities of both are no agreement.
        assert!(!check(&value, Expected::Formula(&value)).evaluate(&TIMES).passed);
    }
    let none = Check { from: Some(1.0), ..check(&|_| 0.0, Expected::Formula(&|_| 0.0)) }.evaluate(&TIMES);
    assert!(!none.passed && none.largest.is_nan());
    assert_eq!(none.problem.as_deref(), Some("there are no samples to compare"));
}

#[test]
fn tables_are_matched_by_time() {
    let scratch = Scratch::new("checks");
    let path = scratch.file("ref.csv", "# source\nt,x,y\n0,1,0\n0.15,9,0\n0.3,1.25,0\n0.4,1,0\n0.5,9,0\n");
    let table = Table::read(&path);
    let column = |column| Expected::Column { path: &path, table: &table, column };
    let value = |row: usize| [1.0, 7.0, 7.0, 1.5, 1.0][row];
    let found = check(&value, column("x")).evaluate(&TIMES);
    assert_eq!((found.samples, found.largest, found.at, found.passed), (3, 0.25, TIMES[3], true));
    let limited = Check { to: Some(0.25), ..check(&value, column("x")) }.evaluate(&TIMES);
    assert_eq!((limited.samples, limited.largest), (1, 0.0));

    assert_eq!(found.part, None);
    let longer: Vec<f64> = (0..11).map(|k| 0.1 * f64::from(k)).collect();
    let found = check(&|_| 1.0, column("x")).evaluate(&longer);
    let part = "compared from t = 0 to 0.5, at 4 of 11 samples: `";
    assert!(found.part.as_ref().is_some_and(|text| text.starts_with(part)), "{found:?}");
    let limited = Check { to: Some(0.5), ..check(&|_| 1.0, column("x")) }.evaluate(&longer);
    assert_eq!(limited.part, None);
    assert_eq!(Table::columns_of(&path), Some(vec!["x".to_owned(), "y".to_owned()]));

    let lost = check(&value, column("z")).evaluate(&TIMES);
    assert!(!lost.passed && lost.problem.unwrap().ends_with("has no column `z`, its columns are x, y"));
    let (path, none) = (scratch.join("none.csv"), Table::read(&scratch.join("none.csv")));
    let missing = Expected::Column { path: &path, table: &none, column: "x" };
    let missing = check(&value, missing).evaluate(&TIMES);
    assert!(!missing.passed && missing.problem.unwrap().starts_with("cannot read"));
    let apart = check(&value, column("x")).evaluate(&[7.0, 8.0]);
    assert!(!apart.passed && apart.problem.unwrap().contains("no time of"));
}

#[test]
fn checks_are_told_and_kept() {
    let good = CheckResult {
        name: "angle".into(),
        kind: "position",
        unit: "rad".into(),
        largest: 1.234e-11,
        at: 1.5,
        tolerance: 1e-9,
        passed: true,
        samples: 3,
        ..CheckResult::default()
    };
    let bad = CheckResult {
        name: "force".into(),
        largest: f64::NAN,
        at: f64::NAN,
        passed: false,
        problem: Some("there are no samples to compare".into()),
        ..good.clone()
    };
    let summary = Summary { status: Status::Completed, checks: vec![good.clone()], ..Summary::default() };
    assert!(summary.checks_passed() && Summary::default().checks_passed());
    let summary = Summary { checks: vec![good, bad], ..summary };
    assert!(!summary.checks_passed());
    let expected = "  check  largest error  tolerance  at t\n  \
                    angle       1.23e-11       1e-9   1.5  rad  ok\n  \
                    force            NaN       1e-9   NaN  rad  FAILED\n  \
                    force: there are no samples to compare\n";
    let text = report(&summary, None, false);
    assert!(text.contains(expected), "{text}");
    assert!(report(&summary, None, true).contains("\x1b[1;31mFAILED\x1b[0m\n"));
    let json: serde_json::Value = serde_json::from_str(&summary.to_json()).unwrap();
    assert_eq!(json["checks"][0]["largest"], 1.234e-11);
    assert_eq!(json["checks"][1]["passed"], false);
    assert!(json["checks"][1]["largest"].is_null() && json["checks"][0].get("series").is_none());
}
