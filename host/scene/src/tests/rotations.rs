//! Six ways to write an orientation.

use super::*;
use std::f64::consts::{FRAC_PI_2, PI};

fn text(orientation: &str) -> String {
    format!("{SIMULATION}[[body]]\nname = \"b\"\nfixed = true\norientation = {orientation}\n")
}

fn orientation(written: &str) -> [f64; 4] {
    accept(&text(written)).bodies[0].orientation
}

/// Columns of A = (2 e0^2 - 1) I + 2 e e^T + 2 e0 [e]x, by components.
fn columns(p: [f64; 4]) -> [[f64; 3]; 3] {
    let [e0, e1, e2, e3] = p;
    [
        [2.0 * (e0 * e0 + e1 * e1) - 1.0, 2.0 * (e1 * e2 + e0 * e3), 2.0 * (e1 * e3 - e0 * e2)],
        [2.0 * (e1 * e2 - e0 * e3), 2.0 * (e0 * e0 + e2 * e2) - 1.0, 2.0 * (e2 * e3 + e0 * e1)],
        [2.0 * (e1 * e3 + e0 * e2), 2.0 * (e2 * e3 - e0 * e1), 2.0 * (e0 * e0 + e3 * e3) - 1.0],
    ]
}

fn same_rotation(a: [f64; 4], b: [f64; 4]) -> bool {
    let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    (dot.abs() - 1.0).abs() < 1e-14
}

#[test]
fn all_ways_give_the_same_rotation() {
    let half = 0.5_f64.sqrt();
    for written in [
        "{ axis = [0, 0, 2], angle = \"90 deg\" }",
        "{ euler_parameters = [\"sqrt(0.5)\", 0, 0, \"sqrt(0.5)\"] }",
        "{ x = [0, 3, 0], y = [-1, 5, 0] }",
        "{ rotation_vector = [0, 0, \"pi/2\"] }",
        "{ euler_zyx = [\"90 deg\", 0, 0] }",
        "{ matrix = [[0, -1, 0], [1, 0, 0], [0, 0, 1]] }",
    ] {
        let found = orientation(written);
        assert!(same_rotation(found, [half, 0.0, 0.0, half]), "{written}: {found:?}");
    }
}

#[test]
fn euler_parameters_of_a_matrix_give_the_matrix_back() {
    // Each of the four Euler parameters is the largest once, and near-half-turns are among them.
    for axis in [[1.0, 0.0, 0.0], [0.1, 1.0, 0.0], [0.0, 0.2, -1.0], [1.0, 1.0, 1.0]] {
        for angle in [0.0, 0.3, FRAC_PI_2, 3.0, PI - 1e-7, 4.0, 6.2] {
            let written = format!("{{ axis = {axis:?}, angle = {angle} }}");
            let expected = columns(orientation(&written));
            let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j: usize| expected[j][i]));
            let found = orientation(&format!("{{ matrix = {rows:?} }}"));
            let length: f64 = found.iter().map(|e| e * e).sum();
            assert!((length - 1.0).abs() < 1e-15);
            for (a, b) in columns(found).iter().flatten().zip(expected.iter().flatten()) {
                assert!((a - b).abs() < 1e-14, "{written}");
            }
        }
    }
}

#[test]
fn angles_turn_about_z_then_the_new_y_then_the_new_x() {
    // Rz(90) Ry(90): the body's x axis points down, its y axis to -x.
    let found = columns(orientation("{ euler_zyx = [\"90 deg\", \"90 deg\", 0] }"));
    for (a, b) in found.iter().flatten().zip([0.0, 0.0, -1.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0]) {
        assert!((a - b).abs() < 1e-15, "{found:?}");
    }
}

#[test]
fn the_second_axis_only_gives_the_plane() {
    let found = columns(orientation("{ x = [0, 0, 1], y = [1, 0, 7] }"));
    assert!(near(found[0][2], 1.0) && near(found[1][0], 1.0) && near(found[2][1], 1.0));
}

#[test]
fn no_rotation_is_the_identity() {
    assert_eq!(orientation("{ rotation_vector = [0, 0, 0] }"), [1.0, 0.0, 0.0, 0.0]);
    let scene = accept(&format!("{SIMULATION}[[body]]\nname = \"b\"\nfixed = true\n"));
    assert_eq!(scene.bodies[0].orientation, [1.0, 0.0, 0.0, 0.0]);
}

#[test]
fn rough_euler_parameters_are_normalised_with_a_warning() {
    let source = Source::new("test.toml", text("{ euler_parameters = [0.707, 0, 0, 0.707] }"));
    let (scene, warnings) = parse(source, &[]).expect("only a warning");
    assert_eq!(warnings.len(), 1);
    assert_eq!((warnings[0].code, warnings[0].is_error()), (codes::NORMALISED, false));
    let half = 0.5_f64.sqrt();
    assert!(same_rotation(scene.bodies[0].orientation, [half, 0.0, 0.0, half]));
    // Rounding to 7 digits is none of our business.
    orientation("{ euler_parameters = [0.7071068, 0, 0, 0.7071068] }");
}

#[test]
fn what_is_no_rotation_is_rejected() {
    for (written, code) in [
        ("{ euler_parameters = [0, 0, 0, 0] }", codes::NOT_A_ROTATION),
        ("{ euler_parameters = [1, 0, 0] }", codes::WRONG_LENGTH),
        ("{ axis = [0, 0, 0], angle = 1 }", codes::NO_DIRECTION),
        ("{ axis = [0, 0, 1] }", codes::CONFLICTING_KEYS),
        ("{ angle = 1 }", codes::CONFLICTING_KEYS),
        ("{ axis = [0, 0, 1], angle = \"1 mm\" }", codes::DIMENSION),
        ("{ axis = [0, 0, 1], angle = 1, matrix = [] }", codes::CONFLICTING_KEYS),
        ("{ x = [1, 0, 0], y = [-2, 0, 0] }", codes::NO_DIRECTION),
        ("{ matrix = [[1, 0, 0], [0, 1, 0], [0, 0, -1]] }", codes::NOT_A_ROTATION),
        ("{ matrix = [[1, 0, 0], [0, 2, 0], [0, 0, 1]] }", codes::NOT_A_ROTATION),
        ("{ matrix = [[1, 0, 0], [0, 1, 0]] }", codes::WRONG_LENGTH),
        ("{ rotation = [0, 0, 1] }", codes::UNKNOWN_KEY),
        ("{ }", codes::MISSING_KEY),
        ("\"upside down\"", codes::WRONG_TYPE),
    ] {
        assert_eq!(reject(&text(written)).codes(), [code], "{written}");
    }
}
