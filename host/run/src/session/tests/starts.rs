//! Starts that are refused, or warned of: what is said names the cause.

use super::*;
use crate::diagnostics::codes;

/// A four-bar linkage in the plane y = 0; one of its hinges has no `axis`.
fn four_bar(without: &str) -> String {
    let mut text = "[units]\nlength = \"mm\"\nangle = \"deg\"\n".to_owned()
        + &settings("gravity = [0, 0, -9810]; t_end = 0.1; output_step = 0.1");
    for (name, place) in [("crank", [0, 0, 50]), ("coupler", [100, 0, 110]), ("rocker", [200, 0, 60])] {
        text += &format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [100, 100, 100]\nposition = {place:?}\n");
    }
    for (name, bodies, point) in [
        ("A", ["ground", "crank"], [0, 0, 0]),
        ("B", ["crank", "coupler"], [0, 0, 100]),
        ("C", ["coupler", "rocker"], [200, 0, 120]),
        ("D", ["ground", "rocker"], [200, 0, 0]),
    ] {
        let axis = if name == without { "" } else { "axis = [0, 1, 0]\n" };
        text +=
            &format!("[[joint]]\nname = \"{name}\"\ntype = \"hinge\"\nbodies = {bodies:?}\npoint = {point:?}\n{axis}");
    }
    text
}

/// Why a session does not open.
fn refused(text: &str) -> String {
    let opened = Session::with_catalog(scene(text), Vec::new(), &catalog(), &RunOptions::default());
    opened.map(|_| ()).unwrap_err().to_string()
}

#[test]
fn a_joint_of_a_locked_loop_without_an_axis_is_named() {
    for joint in ["A", "C", "D"] {
        let session = open(&four_bar(joint));
        let found: Vec<_> = session.warnings.iter().filter(|warning| warning.code == codes::LOCKED_LOOP).collect();
        let [warning] = &found[..] else { panic!("{joint}: {found:?}") };
        let remedy = format!("`{joint}` has no `axis`; without one, its axis is z of the ground");
        assert_eq!(warning.help.first(), Some(&remedy), "{warning:?}");
        let place = session.scene.source.slice(warning.span().unwrap()).unwrap();
        assert_eq!(place.trim_matches('"'), joint);
    }
}

#[test]
fn a_drive_without_an_axis_is_named_with_the_rate_of_an_angle() {
    let drive = "[[joint]]\nname = \"motor\"\ntype = \"drive\"\nbodies = [\"ground\", \"crank\"]\npoint = [0, 0, 0]\n\
                 params = { speed = 360 }\n";
    let said = refused(&(four_bar("") + drive));
    assert!(said.contains("ODY0502") && said.contains("row `angle` stays off by") && said.contains(" deg/s"), "{said}");
    assert!(said.contains("`motor` has no `axis`; without one, its axis is z of the ground"), "{said}");
}

#[test]
fn a_drive_that_begins_elsewhere_says_by_how_much() {
    let text = "[units]\nangle = \"deg\"\n".to_owned()
        + &settings("t_end = 0.1; output_step = 0.1")
        + "[[body]]\nname = \"crank\"\nmass = 1\ninertia = [1, 1, 1]\norientation = { axis = [0, 1, 0], angle = 40 }\n"
        + "[[joint]]\nname = \"A\"\ntype = \"hinge\"\nbodies = [\"ground\", \"crank\"]\naxis = [0, 1, 0]\n"
        + "[[joint]]\nname = \"motor\"\ntype = \"drive\"\nbodies = [\"ground\", \"crank\"]\nparams = { speed = 10 }\n\
           frames = [{ axis = [0, 1, 0], x_axis = [1, 0, 0] }, { axis = [0, 1, 0], x_axis = [1, 0, 0] }]\n";
    let said = refused(&text);
    assert!(
        said.contains("ODY0504") && said.contains("`motor` prescribes a motion, which at the start is 40 deg away"),
        "{said}"
    );
}

/// No place and no time is to blame for it.
#[test]
fn a_tolerance_below_the_digits_of_numbers_is_named() {
    let session = open(
        &(settings("t_end = 1; output_step = 1; tolerance = 1e-16")
            + "[[body]]\nname = \"a\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [1, 0, 0]\n"),
    );
    let [warning] = &session.warnings[..] else { panic!("{:?}", session.warnings) };
    assert_eq!(warning.code, codes::OUT_OF_RANGE);
    assert!(warning.message.contains("a tolerance of 1e-16 is below what numbers can hold"), "{warning:?}");
}

#[test]
fn a_drive_that_takes_nothing_anywhere_does_not_contradict_rest() {
    let warned = |speed: &str| {
        let text = scenes::pendulum(&settings("t_end = 1; output_step = 1")).replacen(
            "[[body]]",
            "[[body]]\nvelocity = [0, 0, 0]\nangular_velocity = [0, 0, 0]",
            1,
        ) + "[[joint]]\nname = \"motor\"\ntype = \"drive\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n"
            + &format!("params = {{ speed = {speed} }}\n");
        open(&text).warnings.iter().any(|warning| warning.code == codes::INCONSISTENT_VELOCITIES)
    };
    // exp(-128), as `exp(-200 (t - 0.8)^2)` begins, and what can be seen.
    assert!(!warned("9.9e-55"));
    assert!(warned("1e-9"));
}
