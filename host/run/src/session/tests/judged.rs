//! Runs that reach their end and are not to be believed.

use super::*;
use crate::diagnostics::{Source, codes};
use crate::scene::AuditTolerance;

/// A rod that swings, in steps of this size.
fn in_steps(h: f64, keys: &str) -> String {
    scenes::pendulum(&settings(&format!(
        "gravity = [0, -9.81, 0]; t_end = 9; output_step = 1; method = \"rk4\"; fixed_step = {h:?}; {keys}"
    )))
}

#[test]
fn coarse_steps_are_suspect_without_being_asked() {
    let report = run(&in_steps(3.0, ""));
    let summary = &report.summary;
    assert_eq!((summary.status, report.exit_code()), (Status::Suspect, Exit::Audit as i32));
    assert_eq!(summary.t_end_reached, 9.0, "nothing is left out");
    assert!(summary.code.is_some_and(|code| code.code.starts_with("ODY07")), "{:?}", summary.code);
    for words in ["the balance of energies is off by", "(t = ", "more than 0.001", "try smaller steps (`fixed_step`)"] {
        assert!(summary.reason.contains(words), "{words}: {}", summary.reason);
    }
    assert!(
        summary.warnings.iter().any(|warning| warning.starts_with("ODY0702: the balance")),
        "{:?}",
        summary.warnings
    );
    // Small steps are not, nor is error control.
    assert_eq!(run(&in_steps(0.01, "")).exit_code(), 0);
    assert_eq!(run(&in_steps(3.0, "").replace("method = \"rk4\"\nfixed_step = 3.0", "")).exit_code(), 0);
}

#[test]
fn a_fixed_step_that_does_not_fill_the_run_is_told() {
    let told = |h: f64, keys: &str| {
        let warnings = run(&in_steps(h, keys)).summary.warnings;
        warnings.into_iter().filter(|warning| warning.starts_with(codes::OTHER_STEP.code)).collect::<Vec<_>>()
    };
    assert_eq!(
        told(0.004, "t_start = 0.002"),
        [
            "ODY0862: 2250 steps were taken, of 0.00399911 s on average, not of 0.004 s: equal steps end with the run, at each \
          checkpoint, and where elements sample"
        ]
    );
    // 9 / 0.01 is 900 but for round-off.
    for (h, keys) in [(0.01, ""), (0.0225, ""), (9.0, ""), (0.001, "t_start = 0.3")] {
        assert_eq!(told(h, keys), [""; 0], "{h}");
    }
}

#[test]
fn judging_is_switched_off_and_on_by_scene_and_options() {
    let run_with = |keys: &str, audit_tolerance| {
        let options = RunOptions { audit_tolerance, ..RunOptions::default() };
        let session = Session::with_catalog(scene(&in_steps(0.4, keys)), Vec::new(), &catalog(), &options).unwrap();
        let report = session.run(None, Box::new(|_| ()), &Arc::default()).unwrap();
        (report.summary.status, report.summary.audit_limits.map(|limits| limits.energy))
    };
    assert_eq!(run_with("", None), (Status::Suspect, Some(1e-3)));
    assert_eq!(run_with("audit_tolerance = \"none\"", None), (Status::Completed, None));
    assert_eq!(run_with("audit_tolerance = 2", None), (Status::Completed, Some(2.0)));
    assert_eq!(run_with("audit_tolerance = \"none\"", Some(AuditTolerance::Limit(0.1))), (Status::Suspect, Some(0.1)));
    assert_eq!(run_with("audit_tolerance = 0.1", Some(AuditTolerance::None)), (Status::Completed, None));
}

#[test]
fn a_violation_names_its_joint_and_the_time() {
    let text =
        scenes::four_bar(1.0).replace("t_end = 1", "t_end = 1\naudit_tolerance = 1e-300\nformulation = \"cartesian\"");
    let report = run(&text);
    assert_eq!((report.summary.status, report.exit_code()), (Status::Suspect, Exit::Audit as i32));
    let reasons = &report.summary.warnings;
    let violated = reasons.iter().find(|warning| warning.contains("constraints are violated by")).unwrap();
    assert!(["A", "B", "C", "D"].iter().any(|joint| violated.contains(&format!(" in {joint}: "))), "{violated}");
}

#[test]
fn islands_that_run_apart_are_judged_together() {
    let far = scenes::pendulum("")
        .replace("\"rod\"", "\"other\"")
        .replace("\"pivot\"", "\"other_pivot\"")
        .replace("[0.5, 0, 0]", "[0.5, 5, 0]")
        .replace("point = [0, 0, 0]", "point = [0, 5, 0]");
    let report = run(&(in_steps(3.0, "islands = \"apart\"") + &far));
    assert_eq!((report.summary.status, report.exit_code()), (Status::Suspect, Exit::Audit as i32));
    assert_eq!(report.summary.islands.len(), 2);
}

#[test]
fn tolerances_that_control_nothing_are_refused() {
    let text = |tolerance: &str| scenes::pendulum(&settings(&format!("t_end = 1; output_step = 1; {tolerance}")));
    let read = |tolerance: &str| crate::scene::parse(Source::new("scene.toml", text(tolerance)), &[]);
    let refused = read("tolerance = 100").unwrap_err();
    assert_eq!(refused.diagnostics[0].code, codes::OUT_OF_RANGE);
    assert!(read("tolerance = 0.1").is_ok());
}
