//! Functions of one variable: what the element computes from what is written.

use super::*;
use element_api::Function;
use element_api::params::ParamType;
use std::f64::consts::PI;

const MILLI: &str = "length = \"mm\"\ntime = \"ms\"\n";

fn raw(text: &str) -> RawValue {
    RawValue { span: 0..0, kind: RawKind::Text(text.to_owned()) }
}

fn scene(units: &str) -> Scene {
    let parameters = "crank.radius = \"8.5 mm\"\nn = 3\nomega = \"2 rad/s\"\nJ = 4\n";
    accept(&format!("[units]\n{units}\n[parameters]\n{parameters}{SIMULATION}"))
}

/// Value in SI of a function of `t`, or of `x` if it is not one of time, at an argument in SI.
#[track_caller]
fn at(units: &str, text: &str, argument: Dimension, value: Dimension, x: f64) -> f64 {
    let variable = if argument == Dimension::TIME { "t" } else { "x" };
    let function = scene(units).function(&raw(text), variable, argument, value);
    let function = function.unwrap_or_else(|error| panic!("{text}: {error:?}"));
    Function::read_named(&function, "f").unwrap().at(x)
}

#[track_caller]
fn error(units: &str, text: &str, argument: Dimension, value: Dimension) -> Diagnostic {
    let variable = if argument == Dimension::TIME { "t" } else { "x" };
    *scene(units).function(&raw(text), variable, argument, value).expect_err(text)
}

#[test]
fn products_need_no_sign() {
    let t = 0.3_f64;
    for (text, expected) in [
        ("20 sin(2 pi t)", 20.0 * (2.0 * PI * t).sin()),
        ("3 t^2", 3.0 * t * t),
        ("2(t+1)", 2.0 * (t + 1.0)),
        ("2 (t+1)(t-1)", 2.0 * (t * t - 1.0)),
        ("pi t", PI * t),
        ("t pi", PI * t),
        ("t (t + 1)", t * (t + 1.0)),
        ("2 t", 2.0 * t),
        ("-2 t", -2.0 * t),
        ("1/2 t", 0.5 * t),
        ("2^3 t", 8.0 * t),
        ("n t", 3.0 * t),
        ("2 n t", 6.0 * t),
        ("sin(t) cos(t)", t.sin() * t.cos()),
        ("t exp(-n t)", t * (-3.0 * t).exp()),
        ("2 min(t, 1, 0.1)", 0.2),
        ("2e3 t", 2e3 * t),
        ("tanh(2 t)", (2.0 * t).tanh()),
        ("J t", 4.0 * t),
    ] {
        let found = at("", text, Dimension::TIME, Dimension::DIMENSIONLESS, t);
        assert!((found - expected).abs() <= 1e-15 * (1.0 + expected.abs()), "{text}: {found} is not {expected}");
    }
}

#[test]
fn ordinary_expressions_have_such_products_too_but_not_with_parameters() {
    let scene = scene("");
    let value = |text: &str| scene.quantity(&raw(text), Dimension::DIMENSIONLESS);
    for (text, expected) in [("2 pi", 2.0 * PI), ("2 sqrt(4)", 4.0), ("2(1 + 2)", 6.0), ("(1 + 2)(3)", 9.0)] {
        assert!(near(value(text).unwrap(), expected), "{text}");
    }
    let length = scene.quantity(&raw("2 mm (1 + 2)"), Dimension::LENGTH).unwrap();
    assert!(near(length, 6e-3));
    assert_eq!(value("2 n").unwrap_err().code, codes::EXPRESSION_SYNTAX);
    assert_eq!(value("n (2)").unwrap_err().code, codes::EXPRESSION_SYNTAX);
    assert_eq!(value("(2) 3").unwrap_err().code, codes::EXPRESSION_SYNTAX);
}

#[test]
fn every_function_and_operation_arrives() {
    let x = 0.4_f64;
    for (text, expected) in [
        ("sqrt(x)", x.sqrt()),
        ("sin(x)", x.sin()),
        ("cos(x)", x.cos()),
        ("tan(x)", x.tan()),
        ("asin(x)", x.asin()),
        ("acos(x)", x.acos()),
        ("atan(x)", x.atan()),
        ("atan2(x, -1)", x.atan2(-1.0)),
        ("exp(x)", x.exp()),
        ("ln(x)", x.ln()),
        ("tanh(x)", x.tanh()),
        ("abs(-x)", x),
        ("min(x, 1, 2)", x),
        ("max(x, 1, 2)", 2.0),
        ("1 - x", 0.6),
        ("1 + x", 1.4),
        ("1/x", 2.5),
        ("-x", -0.4),
        ("x^2.5", x.powf(2.5)),
        ("2^x", 2f64.powf(x)),
        ("x^x", x.powf(x)),
    ] {
        let found = at("", text, Dimension::DIMENSIONLESS, Dimension::DIMENSIONLESS, x);
        assert!((found - expected).abs() <= 4e-16 * (1.0 + expected.abs()), "{text}: {found} is not {expected}");
    }
}

#[test]
fn without_units_an_expression_is_in_scene_units() {
    // 5 mm at 2 ms.
    assert!(near(at(MILLI, "2.5 t", Dimension::TIME, Dimension::LENGTH, 2e-3), 5e-3));
    assert!(near(at(MILLI, "5", Dimension::TIME, Dimension::LENGTH, 2e-3), 5e-3));
    assert!(near(at(MILLI, "n x^2", Dimension::LENGTH, Dimension::LENGTH, 2e-3), 12e-3));
    // Arguments of functions are in radians, whatever the unit of angles; the amplitude is in degrees.
    let found = at("angle = \"deg\"", "20 sin(pi t)", Dimension::TIME, Dimension::ANGLE, 0.5);
    assert!(near(found, 20.0 * PI / 180.0), "{found}");
}

#[test]
fn with_units_the_variable_is_a_quantity() {
    for (text, argument, value, x, expected) in [
        ("2 m/s * t", Dimension::TIME, Dimension::LENGTH, 0.5, 1.0),
        ("2 m/s t", Dimension::TIME, Dimension::LENGTH, 0.5, 1.0),
        ("20 N sin(omega t)", Dimension::TIME, Dimension::FORCE, 0.5, 20.0 * 1f64.sin()),
        ("20 N sin(2 turn/s t)", Dimension::TIME, Dimension::FORCE, 0.125, 20.0),
        // A plain amplitude in scene units (mm) beside a dimensioned argument.
        ("3 sin(omega t)", Dimension::TIME, Dimension::LENGTH, 0.5, 3e-3 * 1f64.sin()),
        ("crank.radius exp(-t/2 s)", Dimension::TIME, Dimension::LENGTH, 2.0, 8.5e-3 / 1f64.exp()),
        ("x/1 s + 3 mm/s", Dimension::LENGTH, Dimension::VELOCITY, 1.0, 1.003),
        ("6 N/(x + 1 mm) * 1 mm", Dimension::LENGTH, Dimension::FORCE, 2e-3, 2.0),
        ("1 N * 2^(t/1 s)", Dimension::TIME, Dimension::FORCE, 3.0, 8.0),
        ("sqrt(x*1 N/m*1 N)", Dimension::LENGTH, Dimension::FORCE, 4.0, 2.0),
        ("max(x, 1 mm, 2 mm)", Dimension::LENGTH, Dimension::LENGTH, 0.0, 2e-3),
    ] {
        let found = at(MILLI, text, argument, value, x);
        assert!((found - expected).abs() <= 1e-14 * expected.abs(), "{text}: {found} is not {expected}");
    }
    let found = at("angle = \"deg\"", "2 N * sin(x)", Dimension::ANGLE, Dimension::FORCE, PI / 6.0);
    assert!(near(found, 1.0), "an angle converts: {found}");
}

#[test]
fn the_variable_goes_before_a_unit_of_its_name() {
    assert_eq!(at("", "3 t", Dimension::TIME, Dimension::DIMENSIONLESS, 2.0), 6.0);
    assert_eq!(at("", "6 N/t * 1 s", Dimension::TIME, Dimension::FORCE, 2.0), 3.0);
    assert_eq!(at("", "6 N/(t s) * 1 s^2", Dimension::DIMENSIONLESS, Dimension::VELOCITY, 2.0), 6e-3);
    let scene = scene("");
    assert_eq!(scene.quantity(&raw("3 t"), Dimension::MASS).unwrap(), 3000.0, "elsewhere it is a tonne");
}

#[test]
fn constants_need_no_operations() {
    let scene = scene(MILLI);
    let float = |text: &str, value| scene.function(&raw(text), "t", Dimension::TIME, value).unwrap();
    assert_eq!(float("2 n", Dimension::DIMENSIONLESS), toml::Value::Float(6.0));
    assert_eq!(float("3 m", Dimension::LENGTH), toml::Value::Float(3.0));
    let number = RawValue { span: 0..0, kind: RawKind::Integer(4) };
    let found = scene.function(&number, "t", Dimension::TIME, Dimension::LENGTH).unwrap();
    assert_eq!(found, toml::Value::Float(4e-3));
    // What does not depend on the variable is computed once.
    let found = float("t (2 + 3 sqrt(4))", Dimension::DIMENSIONLESS);
    let words = found.get("postfix").and_then(toml::Value::as_array).unwrap();
    assert_eq!(words.last().unwrap().as_str(), Some("mul"));
    assert_eq!(words[words.len() - 2].as_float(), Some(8.0));
}

#[test]
fn wrong_functions_are_refused() {
    let (time, length, force) = (Dimension::TIME, Dimension::LENGTH, Dimension::FORCE);
    for (text, argument, value, code) in [
        ("2 N sin(2 pi t)", time, force, codes::MIXED_DIMENSIONS),
        ("t + 1 mm", time, length, codes::MIXED_DIMENSIONS),
        ("t + 1 s + 1", time, time, codes::NEEDS_UNIT),
        ("2 mm t", time, length, codes::DIMENSION),
        ("(1 mm)^(t/1 s)", time, length, codes::MIXED_DIMENSIONS),
        ("2^t * 1 mm", time, length, codes::MIXED_DIMENSIONS),
        ("sin(tt)", time, length, codes::UNKNOWN_PARAMETER),
        ("2 s^t", time, time, codes::UNIT_SYNTAX),
        ("2 N t", time, length, codes::DIMENSION),
        ("cosh(t)", time, length, codes::EXPRESSION_SYNTAX),
        ("t +", time, length, codes::EXPRESSION_SYNTAX),
        ("t t2", time, length, codes::UNKNOWN_PARAMETER),
        ("2 omga t", time, length, codes::UNKNOWN_PARAMETER),
        ("2 J t", time, length, codes::AMBIGUOUS),
        ("2 t 3", time, length, codes::EXPRESSION_SYNTAX),
        ("t mm", time, length, codes::EXPRESSION_SYNTAX),
        ("t (1/0)", time, length, codes::NO_VALUE),
        ("t ln(0)", time, length, codes::NO_VALUE),
    ] {
        assert_eq!(error("", text, argument, value).code, code, "{text}");
    }
    assert_eq!(error("", "sin(tt)", time, length).help, ["did you mean `t`?"]);
    assert_eq!(error("", "2 omga t", time, length).help, ["did you mean `omega`?"]);
}

#[test]
fn arguments_of_sines_are_angles() {
    let wrong = |text: &str| error("angle = \"deg\"\nlength = \"mm\"", text, Dimension::TIME, Dimension::ANGLE);
    // Cycles are not radians, whatever they are multiplied by, but `2 pi` makes radians of them.
    for text in ["1 deg * sin(1 Hz t)", "1 deg * sin(t * 1 Hz)", "1 deg * cos(2 s * 1 Hz + 0.5 Hz * t)"] {
        let refused = wrong(text);
        assert_eq!(refused.code, codes::NEEDS_UNIT, "{text}");
        assert!(refused.message.contains("cycles") && refused.help[0].contains("`2 pi`"), "{refused:?}");
    }
    let quarter = |text: &str| at("", text, Dimension::TIME, Dimension::DIMENSIONLESS, 0.25);
    for text in ["sin(2 pi * 1 Hz * t)", "sin(1 Hz * t * 2 pi)", "sin(1 turn * 1 Hz * t)", "sin(1 turn/s * t)"] {
        assert!(near(quarter(text), 1.0), "{text}");
    }
    assert!(near(quarter("4 Hz * t"), 1.0), "a number of cycles");
    assert!(near(quarter("sin(2 Hz / 1 Hz * t/1 s)"), 0.5_f64.sin()), "a ratio");
    let refused = wrong("30 deg * sin(360 * t)");
    assert_eq!(refused.message, "expected an angle, found a time");
    assert_eq!(refused.help, ["give the number in front of it a unit: `360 deg/s` for `360`"]);
    for function in ["sin", "cos", "tan"] {
        let refused = wrong(&format!("30 * {function}d(360 * t)"));
        assert!(refused.help[0].contains(&format!("`{function}(360 deg/s * t)`")), "{refused:?}");
    }
}

#[test]
fn plain_angles_that_are_not_radians_are_refused_where_they_could_be_either() {
    let (angle, force) = (Dimension::ANGLE, Dimension::FORCE);
    for (text, argument, value) in
        [("sin(x)", angle, force), ("3 cos(2 x + 1)", angle, force), ("2 atan(t)", Dimension::TIME, angle)]
    {
        assert_eq!(error("angle = \"deg\"", text, argument, value).code, codes::NEEDS_UNIT, "{text}");
        at("", text, argument, value, 0.1);
    }
    let help = |text: &str, argument, value| error("angle = \"deg\"\nlength = \"mm\"", text, argument, value).help;
    assert!(help("sin(x)", angle, Dimension::LENGTH)[0].contains("`1 mm * sin(x)`"));
    assert!(help("sin(x)", angle, Dimension::DIMENSIONLESS)[0].contains("`sin(x + 0 deg)`"));
    // Unmistakable: a multiple of the angle, and a force of the plain number that `atan` gives.
    assert!(near(at("angle = \"deg\"", "2 x", angle, angle, 0.1), 0.2));
    assert!(near(at("angle = \"deg\"", "2 atan(t)", Dimension::TIME, force, 1.0), PI / 2.0));
}

/// The scene's element `f` with a parameter, read as a function of time with values in length.
fn given(value: &str) -> (Scene, RawValue) {
    let text = format!(
        "[units]\n{MILLI}{SIMULATION}[[force]]\nname = \"f\"\ntype = \"f\"\nbodies = [\"a\"]\nparams = {{ f = {value} }}\n"
    );
    let scene = accept(&text);
    let raw = scene.elements[0].params.get("f").unwrap().clone();
    (scene, raw)
}

#[test]
fn points_are_converted() {
    let read = |value: &str| {
        let (scene, raw) = given(value);
        scene.function(&raw, "t", Dimension::TIME, Dimension::LENGTH).unwrap()
    };
    let pairs = |value: &toml::Value| Vec::<[f64; 2]>::read_value(value).unwrap();
    assert_eq!(pairs(&read("[[0, 0], [\"1 s\", 5], [2000, \"1 m\"]]")), [[0.0, 0.0], [1.0, 5e-3], [2.0, 1.0]]);
    let table = read("{ points = [[0, 0], [1, 5], [2, 5], [3, 0]], periodic = true }");
    assert_eq!(table.get("periodic"), Some(&toml::Value::Boolean(true)));
    assert_eq!(pairs(table.get("points").unwrap())[3], [3e-3, 0.0]);
    // As the element reads it: 10 periods later.
    assert!((Function::read_named(&table, "f").unwrap().at(31e-3) - 5e-3).abs() < 1e-12);
    let steps = read("{ points = [[0, 0], [1, 5], [2, 0]], interpolation = \"steps\", periodic = true }");
    assert!(near(Function::read_named(&steps, "f").unwrap().at(5.9e-3), 5e-3));
    let clamped = read("{ points = [[0, 1], [1, 5]] }");
    assert!(near(Function::read_named(&clamped, "f").unwrap().at(7.0), 5e-3));
}

#[test]
fn wrong_functions_are_pointed_at() {
    for (value, code, culprit) in [
        ("[[0, 0], [1, 5], [1, 6]]", codes::OUT_OF_RANGE, "1"),
        ("[[0, 0], [1, 5], [\"0.5 ms\", 6]]", codes::OUT_OF_RANGE, "\"0.5 ms\""),
        ("[[0, 0], [1]]", codes::WRONG_TYPE, "[1]"),
        ("[[0, 0]]", codes::WRONG_LENGTH, "[[0, 0]]"),
        ("[[0, 0], [\"1 mm\", 5]]", codes::DIMENSION, "1 mm"),
        ("{ points = [[0, 0], [1, 0]], periodic = true }", codes::WRONG_LENGTH, "[[0, 0], [1, 0]]"),
        ("{ points = [[0, 0], [1, 0]], period = 1 }", codes::UNKNOWN_KEY, "period"),
        ("{ periodic = true }", codes::MISSING_KEY, "{ periodic = true }"),
        ("{ points = 3 }", codes::WRONG_TYPE, "3"),
        ("{ points = [[0, 0], [1, 0]], periodic = 1 }", codes::WRONG_TYPE, "1"),
        ("{ points = [[0, 0], [1, 0]], interpolation = \"linea\" }", codes::UNKNOWN_WORD, "\"linea\""),
        ("{ points = [[0, 0], [1, 0]], interpolation = 2 }", codes::WRONG_TYPE, "2"),
        (
            "{ points = [[0, 0], [1, 5], [2, 0]], interpolation = \"spline\", periodic = true }",
            codes::WRONG_LENGTH,
            "[[0, 0], [1, 5], [2, 0]]",
        ),
        ("true", codes::WRONG_TYPE, "true"),
        ("\"3 sin(2 pi tt)\"", codes::UNKNOWN_PARAMETER, "tt"),
        ("\"3 mm sin(2 pi t)\"", codes::MIXED_DIMENSIONS, "sin"),
    ] {
        let (scene, raw) = given(value);
        let error = scene.function(&raw, "t", Dimension::TIME, Dimension::LENGTH).expect_err(value);
        assert_eq!(error.code, code, "{value}");
        assert_eq!(scene.source.slice(error.span().unwrap()), Some(culprit), "{value}");
    }
}
