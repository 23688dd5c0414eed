//! `#[derive(Parameters)]`: the struct is the single source of names, units, defaults, ranges and texts.

use crate::Function;
use crate::params::{ParamError, ParamKind, ParamSpec, Parameters, Table};

#[derive(Debug, PartialEq, crate::Parameters)]
struct Everything {
    /// A number
    /// in two lines.
    #[param(unit = "N/m", min = 0.0, max = 10.0)]
    stiffness: f64,
    /// A number with a default.
    #[param(unit = "m", above = 0.0, below = 2.0, default = 0.5)]
    length: f64,
    /// A whole number.
    #[param(default = 3)]
    count: i64,
    /// A switch.
    #[param(default = false)]
    held: bool,
    /// A text.
    #[param(default = "plain")]
    mode: String,
    /// A vector.
    #[param(unit = "m/s", default = [0.0, 0.0, 1.0])]
    velocity: [f64; 3],
    /// A list.
    #[param(unit = "N", default = vec![1.0, 2.0])]
    weights: Vec<f64>,
    /// A curve.
    #[param(unit = "rad -> N")]
    curve: Vec<[f64; 2]>,
    /// Something that may be left out.
    #[param(unit = "s", min = 0.0)]
    delay: Option<f64>,
    /// A curve that may be left out.
    #[param(unit = "s -> m")]
    path: Option<Vec<[f64; 2]>>,
    /// A text of a list.
    #[param(choices = ["rotation", "translation"], default = "rotation")]
    motion: String,
    /// A function.
    #[param(unit = "s -> rad", variable = "t", default = 0.25)]
    angle: Function,
    /// A function that may be left out.
    #[param(unit = "m -> N")]
    force: Option<Function>,
}

#[derive(Debug, PartialEq, crate::Parameters)]
struct Nothing;

#[test]
fn specs_carry_names_kinds_units_and_texts_in_the_order_of_the_struct() {
    let found: Vec<(String, ParamKind, String, String)> =
        Everything::specs().into_iter().map(|s| (s.name, s.kind, s.unit, s.doc)).collect();
    let expected = [
        ("stiffness", ParamKind::Number, "N/m", "A number in two lines."),
        ("length", ParamKind::Number, "m", "A number with a default."),
        ("count", ParamKind::Integer, "1", "A whole number."),
        ("held", ParamKind::Boolean, "1", "A switch."),
        ("mode", ParamKind::Text, "1", "A text."),
        ("velocity", ParamKind::Vector, "m/s", "A vector."),
        ("weights", ParamKind::List, "N", "A list."),
        ("curve", ParamKind::Curve, "rad -> N", "A curve."),
        ("delay", ParamKind::Number, "s", "Something that may be left out."),
        ("path", ParamKind::Curve, "s -> m", "A curve that may be left out."),
        ("motion", ParamKind::Text, "1", "A text of a list."),
        ("angle", ParamKind::Function, "s -> rad", "A function."),
        ("force", ParamKind::Function, "m -> N", "A function that may be left out."),
    ];
    let expected = expected.map(|(name, kind, unit, doc)| (name.into(), kind, unit.into(), doc.into()));
    assert_eq!(found, expected);
}

#[test]
fn ranges_are_checked_and_told_in_words() {
    let stiffness = spec("stiffness");
    assert_eq!(stiffness.range_text(), ">= 0 and <= 10");
    assert!([0.0, 10.0, 3.0].iter().all(|x| stiffness.contains(*x)));
    assert!([-1e-300, 10.000001, f64::NAN, f64::INFINITY].iter().all(|x| !stiffness.contains(*x)));
    let length = spec("length");
    assert_eq!(length.range_text(), "> 0 and < 2");
    assert!(!length.contains(0.0) && !length.contains(2.0) && length.contains(1.0));
    assert_eq!(spec("weights").range_text(), "");
    assert!(!spec("weights").contains(f64::NAN));
}

#[test]
fn defaults_are_told_and_read_back() {
    let defaults: Table = Everything::specs().into_iter().filter_map(|s| Some((s.name, s.default?))).collect();
    assert_eq!(defaults.len(), 8);
    let mut table = defaults;
    table.extend(parsed("stiffness = 4\ncurve = [[0, 1], [1.5, 2]]"));
    let expected = Everything {
        stiffness: 4.0,
        length: 0.5,
        count: 3,
        held: false,
        mode: "plain".into(),
        velocity: [0.0, 0.0, 1.0],
        weights: vec![1.0, 2.0],
        curve: vec![[0.0, 1.0], [1.5, 2.0]],
        delay: None,
        path: None,
        motion: "rotation".into(),
        angle: Function::constant(0.25),
        force: None,
    };
    assert_eq!(Everything::read(&table), Ok(expected));
}

#[test]
fn only_optional_parameters_may_be_absent() {
    let optional: Vec<String> = Everything::specs().into_iter().filter(|s| s.optional).map(|s| s.name).collect();
    assert_eq!(optional, ["delay", "path", "force"]);
    let error = Everything::read(&parsed("stiffness = 1.0")).expect_err("the others are missing");
    assert_eq!(error, ParamError::new("length", "is missing: a number is needed"));
    let mut table = complete();
    table.extend(parsed("delay = 2\npath = [[0.0, 1.0]]"));
    let read = Everything::read(&table).expect("complete");
    assert_eq!((read.delay, read.path), (Some(2.0), Some(vec![[0.0, 1.0]])));
}

#[test]
fn values_of_another_kind_are_refused_by_name_and_kind() {
    let refused = [
        ("stiffness = \"4\"", "stiffness", "must be a number, found string"),
        ("count = 1.5", "count", "must be a whole number, found float"),
        ("held = 1", "held", "must be a true or false, found integer"),
        ("mode = 1", "mode", "must be a text, found integer"),
        ("velocity = [1.0, 2.0]", "velocity", "must be a list of 3 numbers, found array"),
        ("weights = [1.0, \"x\"]", "weights", "must be a list of numbers, found array"),
        ("curve = [[1.0, 2.0, 3.0]]", "curve", "must be a list of [argument, value] pairs, found array"),
        ("delay = true", "delay", "must be a number, found boolean"),
        ("motion = 1.0", "motion", "must be a text, found float"),
        ("angle = [[0.0, 1.0]]", "angle", "needs at least 2 points, found 1"),
        ("force = { postfix = ['x', 'add'] }", "force", "\"add\" lacks operands"),
        (
            "force = true",
            "force",
            "must be a number, a list of [argument, value] pairs, `{ points = [...], interpolation = \"linear\", periodic = true }`, or an expression",
        ),
    ];
    for (text, path, message) in refused {
        let mut table = complete();
        table.extend(parsed(text));
        assert_eq!(Everything::read(&table), Err(ParamError::new(path, message)), "{text}");
    }
}

#[test]
fn choices_and_variables_are_told() {
    assert_eq!(spec("motion").choices, ["rotation", "translation"]);
    assert_eq!(spec("angle").variable, "t");
    for plain in ["mode", "force", "stiffness"] {
        assert!(spec(plain).choices.is_empty() && spec(plain).variable.is_empty(), "{plain}");
    }
}

#[test]
fn specs_of_an_older_plugin_lack_choices_and_variables() {
    let mut text: Table = Table::try_from(spec("motion")).expect("can be written");
    text.remove("choices");
    text.remove("variable");
    let old: ParamSpec = text.try_into().expect("can be read");
    assert!(old.choices.is_empty() && old.variable.is_empty());
}

#[test]
fn numbers_survive_the_way_through_text_exactly() {
    let numbers = [0.1, 1.0 / 3.0, 1e-300, -2.5e17, f64::MIN_POSITIVE, 4.9e-324, f64::MAX, -0.0];
    for x in numbers {
        let mut table = complete();
        table.insert("stiffness".into(), toml::Value::Float(x));
        let text = toml::to_string(&table).expect("can be written");
        let read = Everything::read(&parsed(&text)).expect("complete");
        assert_eq!(read.stiffness.to_bits(), x.to_bits(), "{x:e} became {:e}", read.stiffness);
    }
}

#[test]
fn a_struct_without_fields_needs_nothing() {
    assert!(Nothing::specs().is_empty());
    assert_eq!(Nothing::read(&Table::new()), Ok(Nothing));
}

#[test]
fn specs_survive_the_way_through_text() {
    for spec in Everything::specs() {
        let text = toml::to_string(&spec).expect("can be written");
        assert_eq!(toml::from_str::<ParamSpec>(&text).expect("can be read"), spec, "{text}");
    }
}

fn parsed(text: &str) -> Table {
    text.parse().expect("TOML")
}

fn complete() -> Table {
    crate::testkit::complete(&Everything::specs(), "stiffness = 1.0\ncurve = [[0.0, 1.0], [1.0, 2.0]]")
}

fn spec(name: &str) -> ParamSpec {
    Everything::specs().into_iter().find(|s| s.name == name).expect("known")
}
