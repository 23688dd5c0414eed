//! What a scene writes is what the element is given, in SI units.

use element_api::params::{ParamSpec, ParamType};
use element_api::recording::{Op, Role};
use element_api::{Function, Kind};

use super::*;
use crate::diagnostics::Code;

/// The numbers that an `echo` was given, in the order of its channels: number, angle, count, on, letters, vector, list, curve.
#[track_caller]
fn told(units: &str, params: &str) -> Vec<f64> {
    let text = format!(
        "{units}{}[[force]]\nname = \"e\"\ntype = \"echo\"\nbodies = [\"a\"]\nparams = {params}\n",
        with_body("")
    );
    let model = model(&text);
    let recording = &model.elements[0].recording;
    (0..8)
        .map(|k| {
            let output = recording.outputs.iter().find(|o| o.role == Role::Channel(k)).unwrap();
            let Some(Op::Constant(at)) = Op::decode(recording.ops[output.node as usize]) else {
                panic!("not a constant")
            };
            recording.constants[at as usize]
        })
        .collect()
}

#[test]
fn defaults_fill_what_is_not_given() {
    assert_eq!(told("", "{ number = 7 }"), [7.0, 0.25, 2.0, 0.0, 4.0, -1.0, -1.0, -1.0]);
}

#[test]
fn everything_given_arrives() {
    let params = "{ number = 0, angle = -1, count = 3, on = true, word = \"hello!\", vector = [1, 2, 3], list = [4, 5], \
                  curve = [[0, 0], [1, 2]] }";
    assert_eq!(told("", params), [0.0, -1.0, 3.0, 1.0, 6.0, 321.0, 9.0, 21.0]);
}

#[test]
fn plain_numbers_are_in_the_units_of_the_scene_and_texts_in_their_own() {
    let units =
        "[units]\nlength = \"mm\"\ntime = \"ms\"\nangle = \"deg\"\nforce = \"N\"\n[parameters]\nk = \"4 N/mm\"\n";
    let close = |found: &[f64], expected: [f64; 8]| {
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-15 * (1.0 + b.abs()))
    };
    // 3e-5 kg/ms^2 = 30 N/m (a unit of force holds for forces, not for products with it); defaults are in SI and stay.
    let found = told(
        units,
        "{ number = 3e-5, vector = [1000, 2000, 3000], list = [500, \"1 s\"], curve = [[0, 0], [2000, 5]] }",
    );
    assert!(close(&found, [30.0, 0.25, 2.0, 0.0, 4.0, 321.0, 1.5, 52.0]), "{found:?}");
    let found = told(units, "{ number = \"k/100\", angle = 180, curve = [[\"0 m\", 0], [\"1 m\", \"1 kN\"]] }");
    assert!(close(&found, [40.0, std::f64::consts::PI, 2.0, 0.0, 4.0, -1.0, -1.0, 10_001.0]), "{found:?}");
}

/// Code, and the text of the scene it points at.
#[track_caller]
fn refused(params: &str) -> Vec<(Code, String)> {
    let text =
        with_body("") + &format!("[[force]]\nname = \"e\"\ntype = \"echo\"\nbodies = [\"a\"]\nparams = {params}\n");
    let source = crate::tests::scene(&text).source.text;
    let found = resolved(&text).err().unwrap();
    found.iter().map(|d| (d.code, d.span().map_or(String::new(), |span| source[span].to_string()))).collect()
}

#[test]
fn ranges_hold_at_their_bounds() {
    // min is inclusive, below exclusive.
    assert_eq!(told("", "{ number = 0 }")[0], 0.0);
    assert_eq!(told("", "{ number = 99.999 }")[0], 99.999);
    for (params, place) in
        [("{ number = 100 }", "100"), ("{ number = -1e-9 }", "-1e-9"), ("{ number = 1, count = 4 }", "4")]
    {
        assert_eq!(refused(params), [(codes::ELEMENT_PARAMETER_RANGE, place.to_string())]);
    }
}

/// Libraries in C and files of elements may have no unit and no text.
#[test]
fn a_range_without_unit_and_text_is_all_that_is_said() {
    let said = |spec: &ParamSpec| {
        let text = with_body("") + "[[force]]\nname = \"e\"\ntype = \"t\"\nbodies = [\"a\"]\nparams = { p = -1 }\n";
        let (scene, mut found) = (crate::tests::scene(&text), Vec::new());
        let specs = (std::slice::from_ref(spec), "");
        crate::model::parameters::resolve(&scene, &scene.elements[0], specs, "t", Kind::Force, &mut found);
        (found[0].labels[0].text.clone(), found[0].help.clone())
    };
    let bare = ParamSpec::new::<f64>("p", "", "").above(0.0);
    assert_eq!(said(&bare), ("must be > 0".to_string(), Vec::new()));
    let whole = ParamSpec::new::<f64>("p", "m", "A length.").above(0.0);
    assert_eq!(said(&whole), ("must be > 0 (in m)".to_string(), vec!["A length.".to_string()]));
}

#[test]
fn values_of_another_kind_are_refused_where_they_stand() {
    for (value, place) in [
        ("count = 1.5", "1.5"),
        ("on = 1", "1"),
        ("word = 3", "3"),
        ("vector = [1, 2]", "[1, 2]"),
        ("list = 3", "3"),
        ("curve = [[0, 0], [1]]", "[1]"),
    ] {
        assert_eq!(refused(&format!("{{ number = 1, {value} }}")), [(codes::WRONG_TYPE, place.to_string())], "{value}");
    }
}

#[test]
fn values_of_another_dimension_are_refused() {
    for (value, place) in [
        ("number = \"3 N\"", "3 N"),
        ("number = 1, vector = [0, \"1 s\", 0]", "1 s"),
        ("number = 1, curve = [[0, 0], [\"1 N\", 0]]", "1 N"),
    ] {
        assert_eq!(refused(&format!("{{ {value} }}")), [(codes::DIMENSION, place.to_string())], "{value}");
    }
}

#[test]
fn all_mistakes_of_an_element_are_reported_at_once() {
    let found = refused("{ angel = 1, count = 9, on = 2 }");
    let mut found: Vec<Code> = found.iter().map(|(code, _)| *code).collect();
    found.sort_unstable();
    let mut expected = [
        codes::UNKNOWN_ELEMENT_PARAMETER,
        codes::MISSING_ELEMENT_PARAMETER,
        codes::ELEMENT_PARAMETER_RANGE,
        codes::WRONG_TYPE,
    ];
    expected.sort_unstable();
    assert_eq!(found, expected);
}

/// What a function parameter becomes, and the codes with their places.
fn function(value: &str, spec: &ParamSpec) -> (Option<toml::Value>, Vec<(Code, String)>) {
    let text = with_body("")
        + &format!("[[force]]\nname = \"e\"\ntype = \"t\"\nbodies = [\"a\"]\nparams = {{ p = {value} }}\n");
    let scene = crate::tests::scene(&text);
    let mut found = Vec::new();
    let table = crate::model::parameters::resolve(
        &scene,
        &scene.elements[0],
        (std::slice::from_ref(spec), ""),
        "t",
        Kind::Force,
        &mut found,
    );
    let place = |d: &Diagnostic| d.span().map_or(String::new(), |span| scene.source.text[span].to_string());
    (table.get("p").cloned(), found.iter().map(|d| (d.code, place(d))).collect())
}

#[test]
fn functions_are_read_in_their_variable_and_units() {
    let spec = ParamSpec::new::<Function>("p", "s -> N", "A force.").variable("t").min(0.0);
    let at = |value: &str, t: f64| {
        let (value, found) = function(value, &spec);
        assert_eq!(found, []);
        Function::read_named(&value.unwrap(), "p").unwrap().at(t)
    };
    assert_eq!(at("\"3 kN/s t\"", 2.0), 6000.0);
    assert_eq!(at("\"-3 t\"", 2.0), -6.0, "the range of an expression is nobody's to know");
    assert_eq!(at("[[0, 0], [1, \"1 kN\"]]", 2.0), 1000.0);
    let unnamed = ParamSpec::new::<Function>("p", "m -> N", "A force.");
    let (value, _) = function("\"2 x\"", &unnamed);
    assert_eq!(Function::read_named(&value.unwrap(), "p").unwrap().at(3.0), 6.0);
}

#[test]
fn constants_and_points_of_functions_are_in_the_range() {
    let spec = ParamSpec::new::<Function>("p", "s -> N", "A force.").variable("t").above(0.0);
    for (value, place) in [
        ("0", "0"),
        ("\"-1 kN\"", "\"-1 kN\""),
        ("[[0, 1], [1, -2]]", "[1, -2]"),
        ("{ points = [[0, 1], [1, 0]] }", "[1, 0]"),
    ] {
        assert_eq!(function(value, &spec).1, [(codes::ELEMENT_PARAMETER_RANGE, place.to_string())], "{value}");
    }
    assert_eq!(function("\"3 mm t\"", &spec).1, [(codes::DIMENSION, "3 mm t".to_string())]);
    assert_eq!(function("\"3 N\"", &spec).1, []);
}

#[test]
fn words_are_one_of_the_choices() {
    let spec = ParamSpec::new::<String>("p", "", "What it drives.").choices(&["rotation", "translation"]);
    assert_eq!(function("\"rotation\"", &spec), (Some(toml::Value::String("rotation".into())), Vec::new()));
    assert_eq!(function("\"rotaton\"", &spec).1, [(codes::UNKNOWN_WORD, "\"rotaton\"".to_string())]);
}
