//! Curves say what they do between and beyond their points.

use super::*;
use crate::diagnostics::{Code, Severity};

const JUMP: &str = "[[0, 0], [0.4, 0], [0.42, 10], [1, 10]]";

/// What is said of a force, or of a joint, with a parameter: severity, code, message.
fn said(kind: &str, type_name: &str, params: &str) -> Vec<(Severity, Code, String)> {
    diagnosed("", kind, type_name, params).into_iter().map(|d| (d.severity, d.code, d.message)).collect()
}

/// The same, whole, in a scene with these units.
fn diagnosed(units: &str, kind: &str, type_name: &str, params: &str) -> Vec<Diagnostic> {
    let bodies = if kind == "joint" { "[\"ground\", \"a\"]" } else { "[\"a\"]" };
    let text = units.to_owned()
        + &with_body("")
        + &format!("[[{kind}]]\nname = \"e\"\ntype = \"{type_name}\"\nbodies = {bodies}\nparams = {{ {params} }}\n");
    let source = crate::tests::scene(&text).source.text;
    let found = match resolved(&text) {
        Ok((_, notes)) => notes,
        Err(found) => found,
    };
    for diagnostic in &found {
        let place = &source[diagnostic.span().unwrap()];
        assert!(params.contains(place) && place.contains("[0"), "points at {place}");
    }
    found
}

fn codes_of(kind: &str, type_name: &str, params: &str) -> Vec<(Severity, Code)> {
    said(kind, type_name, params).into_iter().map(|(severity, code, _)| (severity, code)).collect()
}

#[test]
fn a_spline_that_leaves_its_points_says_how_far() {
    let spline = format!("{{ points = {JUMP}, interpolation = \"spline\" }}");
    let found = said("force", "pull", &format!("of_time = {spline}"));
    let [(Severity::Warning, codes::CURVE_LEAVES_POINTS, message)] = &found[..] else { panic!("{found:?}") };
    assert_eq!(
        message,
        "`e`: the curve of `of_time` reaches 65.26 N between its points at 0.42 s and 1 s, where it is 10 N and 10 N"
    );
    // A table that the element makes of its points.
    let found = said("force", "pull", &format!("of_rate = {JUMP}"));
    assert!(found[0].2.contains("the curve of `of_rate` reaches 65.26 N between its points at 0.42 m/s"), "{found:?}");
    // Within the range of all points, but far from the two beside it: a friction curve.
    let friction = "[[0, 0], [0.01, 10], [0.1, 6], [1, 6], [5, 6]]";
    let found = said("force", "pull", &format!("of_rate = {friction}"));
    assert_eq!(found.len(), 1, "{found:?}");
}

#[test]
fn curves_that_keep_to_their_points_are_passed_over() {
    for params in [
        format!("of_time = {JUMP}"),
        format!("of_speed = {JUMP}"),
        format!("of_time = {{ points = {JUMP}, interpolation = \"linear\" }}"),
        format!("of_speed = {{ points = {JUMP}, interpolation = \"steps\" }}"),
        "of_time = 3".into(),
        "of_time = \"5 sin(t)\"".into(),
    ] {
        assert_eq!(codes_of("force", "pull", &params), [], "{params}");
    }
    let sine = |count: usize| {
        let points: Vec<String> = (0..=count)
            .map(|k| k as f64 / count as f64)
            .map(|x| format!("[{x:?}, {:?}]", (6.4 * x + 0.1).sin()))
            .collect();
        format!("of_rate = [{}]", points.join(", "))
    };
    assert_eq!(codes_of("force", "pull", &sine(16)), []);
    assert_eq!(codes_of("force", "pull", &sine(5)), [(Severity::Warning, codes::CURVE_LEAVES_POINTS)]);
}

#[test]
fn joints_follow_splines_and_refuse_kinks() {
    let level = "[[0, 0], [0.5, 0.1], [1.5, 0.3], [2, 0.3]]";
    let smooth = |word: &str| format!("way = {{ points = {level}, interpolation = \"{word}\" }}");
    assert_eq!(codes_of("joint", "lead", &smooth("monotone")), []);
    for word in ["linear", "steps"] {
        assert_eq!(codes_of("joint", "lead", &smooth(word)), [(Severity::Error, codes::CURVE_NOT_SMOOTH)], "{word}");
    }
    // Where nothing is written, a spline: the crest of these points is beyond them.
    let crest = "[[0, 0], [0.5, 1], [1.5, 1.1], [2, 0]]";
    assert_eq!(codes_of("joint", "lead", &format!("way = {crest}")), [(Severity::Warning, codes::CURVE_LEAVES_POINTS)]);
    assert_eq!(codes_of("force", "pull", &format!("of_time = {crest}")), []);
}

/// No remedy is one that joints refuse, and none leads from one message to the other and back.
#[test]
fn remedies_for_curves_of_joints_are_what_joints_take() {
    let crest = "way = [[0, 0], [0.5, 1], [1.5, 1.1], [2, 0]]";
    let [swings] = &diagnosed("", "joint", "lead", crest)[..] else { panic!() };
    assert!(
        swings.help[0].contains("\"monotone\"` stays between the points; joints follow no \"linear\""),
        "{swings:?}"
    );
    let bent = "way = { points = [[0, 0], [0.5, 1], [1.5, 1.1], [2, 0]], interpolation = \"linear\" }";
    let [refused] = &diagnosed("", "joint", "lead", bent)[..] else { panic!() };
    assert!(refused.help[0].starts_with("`interpolation = \"monotone\"` has no kinks"), "{refused:?}");
    assert!(refused.help.iter().all(|line| !line.contains("leave `interpolation` out")), "{refused:?}");
}

#[test]
fn numbers_of_curves_are_in_the_units_of_the_scene() {
    let units = "[units]\nlength = \"mm\"\ntime = \"ms\"\n";
    let found = diagnosed(units, "force", "pull", &format!("of_rate = {JUMP}"));
    assert!(found[0].message.contains("between its points at 0.42 mm/ms and 1 mm/ms"), "{found:?}");
    let found = diagnosed(units, "joint", "lead", "way = [[0, 0], [0.4, 1], [0.8, 2]]");
    assert_eq!(
        found[0].message,
        "`e`: the curve of `way` ends at t = 0.8 ms, where the speed jumps from 2.5 to 0 mm/ms"
    );
    // Round-off beside the other numbers is zero.
    let label = |found: &[Diagnostic]| found[0].labels.iter().map(|label| label.text.clone()).collect::<String>();
    let found = diagnosed("", "joint", "lead", "way = [[0, -1e-17], [0.5, 1], [1.5, 1.1], [2, 0]]");
    assert!(label(&found).starts_with("points from 0 to 1.1 m, the curve through them from 0 to "), "{found:?}");
}

#[test]
fn a_driver_that_arrives_at_its_last_point_with_a_speed_is_told_of() {
    // The run ends at 1 s.
    let found = said("joint", "lead", "way = [[0, 0], [0.4, 1], [0.8, 2]]");
    let [(Severity::Warning, codes::CURVE_NOT_SMOOTH, message)] = &found[..] else { panic!("{found:?}") };
    assert_eq!(message, "`e`: the curve of `way` ends at t = 0.8 s, where the speed jumps from 2.5 to 0 m/s");
    assert_eq!(codes_of("joint", "lead", "way = [[0, 0], [0.4, 1], [1, 2.5]]"), []);
    assert_eq!(codes_of("joint", "lead", "way = [[0.5, 0], [0.7, 1], [1, 2.5]]").len(), 1, "it begins late");
}

#[test]
fn a_library_that_knows_splines_only_is_told_of() {
    let bent = "[[0, 0], [0.1, 3], [0.3, 4], [1, 5]]";
    let asked = |word: &str| format!("force = {{ points = {bent}, interpolation = \"{word}\" }}");
    let ignored = codes::INTERPOLATION_IGNORED;
    assert_eq!(codes_of("force", "early", &asked("linear"))[0], (Severity::Error, ignored));
    assert_eq!(codes_of("force", "early", &format!("force = {bent}"))[0], (Severity::Warning, ignored));
    assert!(codes_of("force", "early", &asked("spline")).iter().all(|(_, code)| *code != ignored));
    // Where all interpolations are the same, there is nothing to tell.
    assert_eq!(codes_of("force", "early", "force = [[0, 0], [1, 2], [3, 6]]"), []);
}

/// Which curve a table was made of is seen by its points; two curves may have the same ones.
#[test]
fn curves_with_the_same_points_may_be_joined_in_different_ways() {
    for words in [["linear", "steps"], ["steps", "linear"], ["monotone", "linear"], ["steps", "monotone"]] {
        let [first, second] = words.map(|word| format!("{{ points = {JUMP}, interpolation = \"{word}\" }}"));
        assert_eq!(codes_of("force", "pull", &format!("of_time = {first}, of_speed = {second}")), [], "{words:?}");
        let other = second.replace("10]]", "12]]");
        assert_eq!(codes_of("force", "pull", &format!("of_time = {first}, of_speed = {other}")), [], "{words:?}");
    }
    // What is to be said of the second is said of the second.
    let spline = format!("of_time = {{ points = {JUMP}, interpolation = \"linear\" }}, of_rate = {JUMP}");
    let found = said("force", "pull", &spline);
    assert!(found.len() == 1 && found[0].2.contains("the curve of `of_rate`"), "{found:?}");
}

/// The run ends at 1 s.
#[test]
fn curves_over_time_that_do_not_cover_the_run_are_reported() {
    let left = (Severity::Warning, codes::CURVE_BESIDE_RUN);
    let found = said("force", "pull", "of_time = [[0, 0], [0.1, 10], [0.2, 20], [0.3, 25]]");
    assert_eq!(found.iter().map(|(severity, code, _)| (*severity, *code)).collect::<Vec<_>>(), [left]);
    assert_eq!(
        found[0].2,
        "`e`: the curve of `of_time` ends at t = 0.3, and the run at 1 s: from there on it is held at 25 N"
    );
    for meant in [
        "[[0, 0], [0.1, 10], [0.2, 20], [0.3, 0]]",
        "[[0, 0], [0.1, 10], [0.2, 20], [0.3, 20]]",
        "[[0, 0], [0.1, 10]]",
        "[[0, 0], [0.1, 10], [0.2, 20], [0.97, 25]]",
        "{ points = [[0, 0], [0.1, 10], [0.2, 20], [0.3, 25]], periodic = true }",
    ] {
        let found = codes_of("force", "pull", &format!("of_time = {meant}"));
        assert!(!found.contains(&left), "{meant}: {found:?}");
    }
    // Milliseconds, taken for seconds.
    for (kind, type_name, param) in [("force", "pull", "of_time"), ("joint", "lead", "way")] {
        let found = said(kind, type_name, &format!("{param} = [[0, 0], [250, 1], [500, 2], [1000, 4]]"));
        let of_unit = format!("`e`: the run is 0.1 % of the curve of `{param}`, which goes from t = 0 to 1000 s");
        assert!(
            found.iter().any(|(_, code, message)| *code == codes::CURVE_BESIDE_RUN && *message == of_unit),
            "{found:?}"
        );
    }
}
