//! Quantity expressions and parameters.

use super::*;
use std::f64::consts::PI;

/// A scene in mm, ms, kg with a few parameters.
fn scene() -> Scene {
    accept(&format!(
        "[units]\nlength = \"mm\"\ntime = \"ms\"\n[parameters]\n\
         crank.radius = \"8.5 mm\"\nrod = {{ length = \"42 mm\", com = 15.75 }}\n\
         n = 3\nomega = \"3600 rpm\"\nline = \"50 Hz\"\nm = \"2 kg\"\n{SIMULATION}"
    ))
}

fn raw(text: &str) -> RawValue {
    RawValue { span: 0..0, kind: RawKind::Text(text.to_owned()) }
}

fn value(text: &str, expected: Dimension) -> f64 {
    let scene = scene();
    scene.quantity(&raw(text), expected).unwrap_or_else(|error| panic!("{text}: {error:?}"))
}

fn error(text: &str, expected: Dimension) -> Diagnostic {
    let scene = scene();
    scene.quantity(&raw(text), expected).expect_err(text)
}

#[test]
fn quantities_and_arithmetic() {
    for (text, dimension, expected) in [
        ("8.5 mm", Dimension::LENGTH, 8.5e-3),
        ("9mm", Dimension::LENGTH, 9e-3),
        ("3600 rpm", Dimension::ANGULAR_VELOCITY, 120.0 * PI),
        ("crank.radius + rod.length", Dimension::LENGTH, 50.5e-3),
        ("2*(crank.radius + 1 mm)", Dimension::LENGTH, 19e-3),
        ("-0.5*sqrt(2)*rod.length", Dimension::LENGTH, -0.5 * 2f64.sqrt() * 42e-3),
        ("3 mm^2", Dimension::AREA, 3e-6),
        ("3 mm ^2", Dimension::AREA, 3e-6),
        ("(3 mm)^2", Dimension::AREA, 9e-6),
        ("50 1/s", Dimension::FREQUENCY, 50.0),
        ("2 N m/rad", Dimension::ROTATIONAL_STIFFNESS, 2.0),
        ("2 N m", Dimension::ROTATIONAL_STIFFNESS, 2.0),
        ("6 N / (2 mm + 1 mm)", Dimension::STIFFNESS, 2000.0),
        ("6 N/(mm s)", Dimension::new(0, 1, -3, 0), 6000.0),
        ("6 N / 2 mm", Dimension::STIFFNESS, 3000.0),
        ("2 mm * n", Dimension::LENGTH, 6e-3),
        ("60 s / min(2, 3)", Dimension::TIME, 30.0),
        ("m * 1 m/s^2", Dimension::FORCE, 2.0),
        ("sqrt(9 mm^2)", Dimension::LENGTH, 3e-3),
        ("1e-3", Dimension::DIMENSIONLESS, 1e-3),
        ("1_000.5", Dimension::DIMENSIONLESS, 1000.5),
        (".5", Dimension::DIMENSIONLESS, 0.5),
        ("50 %", Dimension::DIMENSIONLESS, 0.5),
        ("90°", Dimension::ANGLE, PI / 2.0),
        ("3·2", Dimension::DIMENSIONLESS, 6.0),
    ] {
        let found = value(text, dimension);
        assert!(near(found, expected), "{text}: {found}");
    }
}

#[test]
fn precedence_is_that_of_mathematics() {
    for (text, expected) in [
        ("1 + 2*3", 7.0),
        ("8/4/2", 1.0),
        ("8 - 4 - 2", 2.0),
        ("-2^2", -4.0),
        ("(-2)^2", 4.0),
        ("2^3^2", 512.0),
        ("2**3", 8.0),
        ("2^-1", 0.5),
        ("2*-3", -6.0),
        ("--1", 1.0),
    ] {
        assert_eq!(value(text, Dimension::DIMENSIONLESS), expected, "{text}");
    }
}

#[test]
fn functions_compute() {
    for (text, expected) in [
        ("sin(30 deg)", 0.5),
        ("cos(pi)", -1.0),
        ("tan(45 deg)", 1.0),
        ("asin(1)", PI / 2.0),
        ("acos(0)", PI / 2.0),
        ("atan(1)", PI / 4.0),
        ("atan2(1 mm, -1 mm)", 0.75 * PI),
        ("ln(exp(2))", 2.0),
        ("abs(-3)", 3.0),
        ("min(3, 1, 2)", 1.0),
        ("max(3, 1, 2)", 3.0),
    ] {
        let found = value(text, Dimension::DIMENSIONLESS);
        assert!((found - expected).abs() < 1e-15, "{text}: {found}");
    }
}

#[test]
fn plain_results_are_taken_in_scene_units() {
    assert!(near(value("0.5", Dimension::LENGTH), 0.5e-3));
    assert!(near(value("n", Dimension::LENGTH), 3e-3));
    assert!(near(value("rod.com", Dimension::LENGTH), 15.75e-3));
    assert!(near(value("2*rod.com", Dimension::LENGTH), 31.5e-3));
    assert!(near(value("pi/2", Dimension::ANGLE), PI / 2.0));
    let integer = RawValue { span: 0..0, kind: RawKind::Integer(3) };
    assert!(near(scene().quantity(&integer, Dimension::TIME).unwrap(), 3e-3));
}

#[test]
fn a_ratio_of_quantities_is_not_a_plain_number() {
    let ratio = "crank.radius/rod.length";
    assert_eq!(error(ratio, Dimension::LENGTH).code, codes::DIMENSION);
    // An angle is a ratio of lengths, in rad whatever the scene's unit of angles is.
    assert!(near(value(ratio, Dimension::ANGLE), 8.5 / 42.0));
    assert!(near(value(ratio, Dimension::DIMENSIONLESS), 8.5 / 42.0));
}

#[test]
fn dimensions_are_checked() {
    for (text, expected, code) in [
        ("9 ms", Dimension::LENGTH, codes::DIMENSION),
        ("50 %", Dimension::LENGTH, codes::DIMENSION),
        ("crank.radius + 1 ms", Dimension::LENGTH, codes::MIXED_DIMENSIONS),
        ("crank.radius + 1", Dimension::LENGTH, codes::NEEDS_UNIT),
        ("min(1 mm, 2)", Dimension::LENGTH, codes::NEEDS_UNIT),
        ("sin(1 mm)", Dimension::DIMENSIONLESS, codes::MIXED_DIMENSIONS),
        ("exp(1 mm)", Dimension::DIMENSIONLESS, codes::MIXED_DIMENSIONS),
        ("2^crank.radius", Dimension::DIMENSIONLESS, codes::MIXED_DIMENSIONS),
        ("sqrt(crank.radius)", Dimension::LENGTH, codes::MIXED_DIMENSIONS),
        ("(1 mm)^100^2", Dimension::LENGTH, codes::MIXED_DIMENSIONS),
        ("2 N m/rad", Dimension::new(2, 1, -2, 1), codes::DIMENSION),
    ] {
        assert_eq!(error(text, expected).code, code, "{text}");
    }
    assert_eq!(error("9 ms", Dimension::LENGTH).message, "expected a length, found a time");
    assert_eq!(error("crank.radius + 1", Dimension::LENGTH).message, "cannot add a length and a plain number");
}

#[test]
fn hertz_are_not_radians() {
    for text in ["50 Hz", "line", "-line"] {
        assert!(value(text, Dimension::FREQUENCY).abs() == 50.0);
        assert_eq!(error(text, Dimension::ANGULAR_VELOCITY).code, codes::NEEDS_UNIT);
    }
    for text in ["2*pi*line", "1 turn * line", "50 turn/s"] {
        assert!(near(value(text, Dimension::ANGULAR_VELOCITY), 100.0 * PI), "{text}");
    }
}

#[test]
fn plain_angles_need_a_unit_unless_angles_are_in_rad() {
    let scene = accept(&format!("[units]\nangle = \"deg\"\n{SIMULATION}"));
    let ask = |text: &str, expected| scene.quantity(&raw(text), expected);
    for text in ["sin(30)", "30 deg + 1", "max(1, 30 deg)"] {
        let error = ask(text, Dimension::ANGLE).expect_err(text);
        assert_eq!(error.code, codes::NEEDS_UNIT, "{text}");
    }
    assert!(near(ask("90", Dimension::ANGLE).unwrap(), PI / 2.0));
    assert!(near(ask("sin(30 deg)", Dimension::DIMENSIONLESS).unwrap(), 0.5));
    assert!(near(ask("asin(0.5)", Dimension::ANGLE).unwrap(), PI / 6.0));
}

#[test]
fn names_of_units_and_parameters_are_kept_apart() {
    // `m` is a parameter of this scene.
    assert_eq!(value("2 m", Dimension::LENGTH), 2.0);
    assert_eq!(value("2 * m", Dimension::MASS), 4.0);
    assert_eq!(value("(2 N)/m", Dimension::ACCELERATION), 1.0);
    assert_eq!(value("2 m/s", Dimension::VELOCITY), 2.0);
    for text in ["2 N/m", "2 N * m", "2 N/(m s)"] {
        assert_eq!(error(text, Dimension::FORCE).code, codes::AMBIGUOUS, "{text}");
    }
}

#[test]
fn wrong_expressions_say_where() {
    for (text, code, range) in [
        ("2 *", codes::EXPRESSION_SYNTAX, 3..3),
        ("2 3", codes::EXPRESSION_SYNTAX, 2..3),
        ("50 1", codes::EXPRESSION_SYNTAX, 3..4),
        ("50 1/n", codes::EXPRESSION_SYNTAX, 3..4),
        ("(1 + 2", codes::EXPRESSION_SYNTAX, 0..1),
        ("1 + 2)", codes::EXPRESSION_SYNTAX, 5..6),
        ("1 + $", codes::EXPRESSION_SYNTAX, 4..5),
        ("mm", codes::EXPRESSION_SYNTAX, 0..2),
        ("2 * mm", codes::EXPRESSION_SYNTAX, 4..6),
        ("°", codes::EXPRESSION_SYNTAX, 0..2),
        ("2 n", codes::EXPRESSION_SYNTAX, 0..3),
        ("2 crank.radius", codes::EXPRESSION_SYNTAX, 0..14),
        ("cosh(1)", codes::EXPRESSION_SYNTAX, 0..4),
        ("sin()", codes::EXPRESSION_SYNTAX, 4..5),
        ("sin(1, 2)", codes::EXPRESSION_SYNTAX, 0..3),
        ("atan2(1)", codes::EXPRESSION_SYNTAX, 0..5),
        ("sin", codes::UNKNOWN_PARAMETER, 0..3),
        ("1..2", codes::EXPRESSION_SYNTAX, 2..3),
        (".", codes::EXPRESSION_SYNTAX, 0..1),
        ("9 parsec", codes::UNKNOWN_UNIT, 2..8),
        ("3 mm^n", codes::UNIT_SYNTAX, 4..5),
        ("crank.raduis", codes::UNKNOWN_PARAMETER, 0..12),
        ("größe", codes::UNKNOWN_PARAMETER, 0..7),
        ("1/0", codes::NO_VALUE, 1..2),
        ("sqrt(-1)", codes::NO_VALUE, 0..4),
        ("ln(0)", codes::NO_VALUE, 0..2),
        ("1e999", codes::NOT_FINITE, 0..5),
        ("1e200*1e200", codes::NO_VALUE, 5..6),
        ("nan", codes::UNKNOWN_PARAMETER, 0..3),
    ] {
        let quoted = format!("'{text}'");
        let whole = with_parameter("", &quoted).replace("[parameters]\n", "[parameters]\nn = 1\ncrank.radius = 1\n");
        let rejected = reject(&whole);
        assert_eq!(rejected.codes(), [code], "{text}");
        let start = whole.find(&quoted).expect("the value") + 1;
        let span = rejected.diagnostics[0].span().expect("a place");
        assert_eq!(span.start - start..span.end - start, range, "{text}");
    }
}

#[test]
fn an_empty_text_is_no_quantity() {
    for text in ["''", "'  '"] {
        let rejected = reject(&with_parameter("", text));
        assert_eq!(rejected.codes(), [codes::EXPRESSION_SYNTAX]);
        assert_eq!(rejected.diagnostics[0].message, "the expression is empty");
    }
}

#[test]
fn a_comma_within_a_number_has_the_remedy() {
    let help = |text: &str| error(text, Dimension::MASS).help.join("; ");
    for (text, number) in [("1,5 kg", "`1.5`"), ("2 * (10,25 kg)", "`10.25`"), ("1_000,5 kg", "`1_000.5`")] {
        assert!(help(text).contains(number), "{text}: {}", help(text));
    }
    for text in ["1.5,5 kg", ",5 kg", "1, 5 kg", "x,5 kg", "x1,5 kg"] {
        assert!(!help(text).contains("decimals"), "{text}: {}", help(text));
    }
}

#[test]
fn unknown_names_have_advice() {
    let help = error("crank.raduis", Dimension::LENGTH).help;
    assert_eq!(help, ["did you mean `crank.radius`?"]);
    let help = error("squrt(2)", Dimension::LENGTH).help;
    assert_eq!(help, ["did you mean `sqrt`?"]);
}

#[test]
fn parameters_refer_to_each_other_in_any_order() {
    let scene = accept(&format!("[parameters]\nc = \"a + b\"\nb = \"2*a\"\na = \"1 mm\"\n{SIMULATION}"));
    let c = scene.parameters.get("c").expect("defined");
    assert!(near(c.value.si, 3e-3));
    assert_eq!(c.value.dimension, Dimension::LENGTH);
    let names: Vec<&str> = scene.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["c", "b", "a"]);
    assert_eq!((scene.parameters.len(), scene.parameters.is_empty()), (3, false));
}

#[test]
fn each_cycle_is_reported_once() {
    let rejected =
        reject(&format!("[parameters]\na = \"b\"\nb = \"c\"\nc = \"a + 1\"\nd = \"d\"\ne = \"a\"\n{SIMULATION}"));
    assert_eq!(rejected.codes(), [codes::PARAMETER_CYCLE; 2]);
    let labels: Vec<&str> = rejected.diagnostics.iter().map(|one| one.labels[0].text.as_str()).collect();
    assert_eq!(labels, ["a needs b needs c needs a", "d needs d"]);
}

#[test]
fn users_of_a_wrong_parameter_are_not_blamed() {
    let rejected = reject(&format!("[parameters]\na = \"1 parsec\"\nb = \"2*a\"\n{SIMULATION}max_step = \"b\"\n"));
    assert_eq!(rejected.codes(), [codes::UNKNOWN_UNIT]);
}

#[test]
fn names_of_parameters_must_fit_expressions() {
    for (line, code, culprit) in [
        ("a-b = 1", codes::BAD_NAME, "a-b"),
        ("1a = 1", codes::BAD_NAME, "1a"),
        ("\"\" = 1", codes::BAD_NAME, "\"\""),
        ("pi = 3", codes::BAD_NAME, "pi"),
        ("sin = 3", codes::BAD_NAME, "sin"),
        ("a = [1]", codes::WRONG_TYPE, "[1]"),
        ("a = true", codes::WRONG_TYPE, "true"),
    ] {
        let rejected = reject(&format!("[parameters]\n{line}\n{SIMULATION}"));
        assert_eq!(rejected.codes(), [code], "{line}");
        assert_eq!(rejected.culprit(), culprit, "{line}");
    }
}

#[test]
fn parameters_that_nothing_uses_are_reported() {
    let text = "[parameters]\nn = 3\nrod = { length = 2, radius = 1, area = \"2 * rod.radius\" }\n\
                [simulation]\nt_end = \"n + rod.area\"\noutput_step = 1\n";
    let (scene, warnings) = parse(Source::new("test.toml", text), &[]).unwrap_or_else(|_| panic!());
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert_eq!(
        (warning.code, warning.message.as_str()),
        (codes::UNUSED_PARAMETER, "nothing uses the parameter `rod.length`")
    );
    assert_eq!(scene.source.slice(warning.span().unwrap()), Some("2"));
}
