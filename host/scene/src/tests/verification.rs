//! `[verification]`, `[[check]]` and their formulas.

use super::*;

const OUTPUTS: &str = "[[output]]\nname = \"phi\"\nquantity = \"coordinate\"\n\
                       [[output]]\nname = \"rod.x\"\nquantity = \"position\"\n\
                       [[output]]\nname = \"a-b\"\nquantity = \"position\"\n\
                       [[output]]\nname = \"N\"\nquantity = \"force\"\n";

fn with_check(units: &str, keys: &str) -> String {
    format!(
        "[units]\n{units}\n[parameters]\nlength = \"8 mm\"\nk = 3\nalpha = \"30 deg\"\nboth = 1\n{SIMULATION}{OUTPUTS}\
         [[output]]\nname = \"both\"\nquantity = \"q\"\n\
         [[check]]\nname = \"angle, first swing\"\nkind = \"position\"\ntolerance = 1e-9\n{keys}\n"
    )
}

#[track_caller]
fn formula(units: &str, text: &str) -> Formula {
    accept(&with_check(units, &format!("reference = 0\nvalue = \"{text}\""))).checks.remove(0).value
}

/// The value at t = 0.5, phi = 2, rod.x = 7, a-b = 11, N = 13.
fn value(units: &str, text: &str) -> f64 {
    let known = [("t", 0.5), ("phi", 2.0), ("rod.x", 7.0), ("a-b", 11.0), ("N", 13.0)];
    formula(units, text).evaluate(&|name| known.iter().find(|(own, _)| *own == name).map(|(_, value)| *value))
}

#[test]
fn formulas_compute_in_scene_units() {
    let mm = "length = \"mm\"";
    for (text, expected) in [
        ("0.5 cos(3 t)", 0.5 * 1.5f64.cos()),
        ("phi", 2.0),
        ("2 phi t", 2.0),
        ("rod.x - 1", 6.0),
        ("2 rod.x^2", 98.0),
        ("a-b", 11.0),
        ("2 N", 26.0),
        ("length", 8.0),
        ("k length", 24.0),
        ("length + 1 cm", 18.0),
        ("sin(alpha)", 0.5),
        ("tanh(t) + atan2(1, 1) + min(3, phi, 4) - max(t, 0.25)", 0.5f64.tanh() + std::f64::consts::FRAC_PI_4 + 1.5),
        ("phi^t", 2f64.sqrt()),
        ("exp(ln(phi)) sqrt(4) abs(-1) tan(0) + asin(1) - acos(0)", 0.0),
        ("-phi/4", -0.5),
        ("pi atan(1)", std::f64::consts::PI * std::f64::consts::FRAC_PI_4),
    ] {
        let found = value(mm, text);
        assert!((found - expected).abs() < 1e-14 * (1.0 + expected.abs()), "{text}: {found} is not {expected}");
    }
}

#[test]
fn what_has_no_value_is_not_a_number() {
    assert!(formula("", "1 + phi").evaluate(&|_| None).is_nan());
    // Not even where `f64::min` would forget it.
    assert!(formula("", "min(1, phi)").evaluate(&|_| Some(f64::NAN)).is_nan());
    assert!(formula("", "max(phi, 1)").evaluate(&|_| Some(f64::NAN)).is_nan());
}

#[test]
fn names_are_the_time_and_outputs() {
    assert_eq!(formula("", "k phi + t rod.x + phi").names(), ["phi", "t", "rod.x"]);
    assert_eq!(formula("", "k phi").text(), "k phi");
}

#[test]
fn mistakes_in_a_check() {
    for (keys, code, culprit) in [
        ("value = \"phy\"\nreference = 0", codes::UNKNOWN_PARAMETER, "phy"),
        ("value = \"phi\"\nreference = \"2 both\"", codes::AMBIGUOUS, "both"),
        ("value = \"phi\"\nreference = \"2 *\"", codes::EXPRESSION_SYNTAX, ""),
        ("value = \"phi\"\nreference = \"cosh(t)\"", codes::EXPRESSION_SYNTAX, "cosh"),
        ("value = [1]\nreference = 0", codes::WRONG_TYPE, "[1]"),
        ("value = \"phi\"", codes::MISSING_KEY, "[[check]]"),
        ("reference = 0", codes::MISSING_KEY, "[[check]]"),
        ("value = \"phi\"\nreference = { csv = \"a.csv\" }", codes::MISSING_KEY, "{ csv = \"a.csv\" }"),
        (
            "value = \"phi\"\nreference = { csv = \"a.csv\", colum = \"x\", column = \"x\" }",
            codes::UNKNOWN_KEY,
            "colum",
        ),
        ("value = \"phi\"\nreference = 0\nfrom = 2\nto = 1", codes::OUT_OF_RANGE, "1"),
        ("value = \"phi\"\nreference = 0\nfrom = \"1 mm\"", codes::DIMENSION, "1 mm"),
        ("value = \"phi\"\nreference = 0\nunit = \"mm\"", codes::UNKNOWN_KEY, "unit"),
    ] {
        let rejected = reject(&with_check("", keys));
        assert_eq!(rejected.codes(), [code], "{keys}");
        assert_eq!(rejected.culprit(), culprit, "{keys}");
    }
    let good = with_check("", "value = \"phi\"\nreference = 0");
    for (old, new, code, culprit) in [
        ("\"position\"\ntolerance", "\"positon\"\ntolerance", codes::UNKNOWN_WORD, "\"positon\""),
        ("1e-9", "-1e-9", codes::OUT_OF_RANGE, "-1e-9"),
        ("1e-9", "\"1 mm\"", codes::DIMENSION, "1 mm"),
        ("tolerance = 1e-9\n", "", codes::MISSING_KEY, "[[check]]"),
        ("name = \"angle, first swing\"", "name = \"\"", codes::BAD_NAME, "\"\""),
    ] {
        assert!(good.contains(old));
        let rejected = reject(&good.replace(old, new));
        assert_eq!(rejected.codes(), [code], "{new}");
        assert_eq!(rejected.culprit(), culprit, "{new}");
    }
    let help = &reject(&with_check("", "value = \"phy\"\nreference = 0")).diagnostics[0].help;
    assert_eq!(help, &["did you mean `phi`?"]);
    let twice = format!(
        "{good}[[check]]\nname = \"angle, first swing\"\nkind = \"other\"\nvalue = 1\nreference = 1\ntolerance = 0\n"
    );
    assert_eq!(reject(&twice).codes(), [codes::DUPLICATE_NAME]);
}

#[test]
fn angles_must_be_unmistakable_where_they_are_not_radians() {
    let degrees = "angle = \"deg\"";
    for text in ["sin(alpha)", "phi - 30 deg"] {
        let rejected = reject(&with_check(degrees, &format!("reference = 0\nvalue = \"{text}\"")));
        assert_eq!(rejected.codes(), [codes::NEEDS_UNIT], "{text}");
    }
    assert_eq!(value(degrees, "phi - 30"), -28.0);
}

#[test]
fn a_check_is_read() {
    let keys =
        "value = \"phi\"\nreference = { csv = \"ref/pendulum.csv\", column = \"phi\" }\nfrom = \"1 s\"\nto = 2000";
    let check = accept(&with_check("time = \"ms\"", keys)).checks.remove(0);
    assert_eq!(check.name.value, "angle, first swing");
    assert_eq!((check.kind, check.tolerance), (CheckKind::Position, 1e-9));
    assert_eq!((check.from, check.to), (Some(1000.0), Some(2000.0)));
    let Reference::Csv { path, column } = check.reference else { panic!("a table") };
    assert_eq!((path.value.to_str(), column.as_str()), (Some("ref/pendulum.csv"), "phi"));
    let words = "velocity acceleration orientation reaction-force reaction-torque energy other";
    for word in words.split(' ') {
        let text =
            with_check("", "value = 1\nreference = 1").replace("kind = \"position\"", &format!("kind = \"{word}\""));
        assert_eq!(accept(&text).checks[0].kind.word(), word);
    }
}

#[test]
fn checks_are_set_from_the_command_line() {
    let text = with_check("", "value = 1\nreference = 1").replace("angle, first swing", "angle");
    assert_eq!(accept_with(&text, &["angle.tolerance=0.25"]).checks[0].tolerance, 0.25);
}

#[test]
fn a_page_of_the_manual_is_read() {
    let scene =
        accept(&format!("{SIMULATION}[verification]\nelements = [\"odyn-joints/revolute\"]\ntext = \"Why.\"\n"));
    let verification = scene.verification.unwrap();
    assert_eq!(verification.elements[0].value, "odyn-joints/revolute");
    assert_eq!(verification.text, "Why.");
    assert!(accept(SIMULATION).verification.is_none());
    for (keys, code) in [
        ("elements = []", codes::MISSING_KEY),
        ("text = \"Why.\"", codes::MISSING_KEY),
        ("elements = \"a\"\ntext = \"Why.\"", codes::WRONG_TYPE),
        ("elements = []\ntext = \"\"", codes::BAD_NAME),
        ("elements = []\ntext = \"Why.\"\nauthor = 1", codes::UNKNOWN_KEY),
    ] {
        assert_eq!(reject(&format!("{SIMULATION}[verification]\n{keys}\n")).codes(), [code], "{keys}");
    }
}
