//! Runs whose forces follow curves, against closed forms.

use super::*;
use crate::results::Remedy;

/// A body of 2 kg that a force pulls along z.
fn pulled(keys: &str, params: &str) -> String {
    settings(&format!("t_end = 2; output_step = 0.05; {keys}"))
        + "[[body]]\nname = \"a\"\nmass = 2\ninertia = [1, 1, 1]\n"
        + &format!("[[force]]\nname = \"pull\"\ntype = \"pull\"\nbodies = [\"a\"]\nparams = {{ {params} }}\n")
        + &output("v", "quantity = \"velocity\"; of = \"a\"; component = \"z\"")
}

#[test]
fn steps_of_time_are_met_where_they_are() {
    let points = "of_time = { points = [[0.31, 1], [0.62, 5], [0.63, -8], [1.37, 0]], interpolation = \"steps\" }";
    // The integral of the force, by hand.
    let expected = |t: f64| {
        let part = |from: f64, to: f64, force: f64| force * (t.min(to) - from).max(0.0);
        0.5 * (part(0.0, 0.62, 1.0) + part(0.62, 0.63, 5.0) + part(0.63, 1.37, -8.0))
    };
    for keys in ["method = \"dop853\"", "method = \"radau5\"", "method = \"auto\"; tolerance = 1e-6"] {
        let report = run(&pulled(keys, points));
        assert_eq!(report.summary.status, Status::Completed, "{keys}");
        let error = off(&report, "v", expected);
        assert!(error < 1e-9, "{keys}: off by {error:e}");
    }
}

#[test]
fn a_force_may_step_with_the_speed() {
    // 4 N up to 0.5 m/s, reached at 0.25 s; 1 N from there on.
    let points = "of_speed = { points = [[-1, 4], [0.5, 1]], interpolation = \"steps\" }";
    for keys in ["method = \"dop853\"", "method = \"radau5\""] {
        let report = run(&pulled(keys, points));
        assert_eq!(report.summary.status, Status::Completed, "{keys}");
        assert!(report.summary.recoveries[Remedy::Event] > 0);
        let expected = |t: f64| if t < 0.25 { 2.0 * t } else { 0.5 + 0.5 * (t - 0.25) };
        let error = off(&report, "v", expected);
        assert!(error < 1e-9, "{keys}: off by {error:e}");
    }
}

#[test]
fn a_jump_in_four_points_does_what_the_points_say() {
    let points = "[[0, 0], [0.4, 0], [0.42, 10], [1, 10]]";
    let at_end = |word: &str| {
        let report = run(&pulled("", &format!("of_time = {{ points = {points}, interpolation = \"{word}\" }}")));
        *column(&report, "v").last().unwrap()
    };
    // The integral up to 2 s: the area under the rise is half its width times 10, by symmetry also for the cubic.
    for word in ["monotone", "linear"] {
        assert!((at_end(word) - 0.5 * (0.1 + 15.8)).abs() < 1e-9, "{word}: {}", at_end(word));
    }
    assert!((at_end("steps") - 0.5 * 15.8).abs() < 1e-9);
    assert!(at_end("spline") > 12.0);
}
