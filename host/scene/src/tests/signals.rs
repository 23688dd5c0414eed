//! `inputs` and `joints` of force and control elements.

use super::*;

fn element(kind: &str, keys: &str) -> String {
    format!(
        "[parameters]\nspeed = \"1500 rpm\"\na = 1\nb = 2\n{SIMULATION}[[{kind}]]\nname = \"e\"\ntype = \"t\"\n{keys}\n"
    )
}

#[test]
fn a_name_is_a_signal_unless_it_has_a_value() {
    let inputs = "inputs = { a = \"omega\", b = \"pid.output\", c = \"rod-1.x\", d = \"s\", e = \"_x\", \
                  f = 3, g = 2.5, h = \"1500 rpm\", i = \"speed\", j = \"2*speed\", k = \"pi\", l = \"3\", m = \"a-b\" }";
    let scene = accept(&element("control", inputs));
    let inputs = &scene.elements[0].inputs;
    let names: String = inputs.iter().map(|input| input.name.value.as_str()).collect();
    assert_eq!(names, "abcdefghijklm", "in the order of the text");
    for input in &inputs[..5] {
        assert!(matches!(input.source.value, InputSource::Reference(_)), "{input:?}");
    }
    assert_eq!(inputs[1].source.value, InputSource::Reference("pid.output".to_owned()));
    assert_eq!(scene.source.slice(inputs[1].source.span.clone()), Some("\"pid.output\""));
    for input in &inputs[5..] {
        assert!(matches!(input.source.value, InputSource::Value(_)), "{input:?}");
    }
}

#[test]
fn values_have_any_dimension() {
    let inputs =
        "inputs = { a = 3, b = \"1500 rpm\", c = \"speed/2\", d = \"pi\", e = \"3 parsec\", f = \"2 + unknown\" }";
    let scene = accept(&element("force", &format!("bodies = [\"x\"]\n{inputs}")));
    let value = |k: usize| match &scene.elements[0].inputs[k].source.value {
        InputSource::Value(raw) => scene.any_quantity(raw),
        other => panic!("{other:?}"),
    };
    let pi = std::f64::consts::PI;
    assert_eq!(value(0).unwrap(), (3.0, Dimension::DIMENSIONLESS));
    for (k, expected) in [(1, 50.0 * pi), (2, 25.0 * pi)] {
        let (si, dimension) = value(k).unwrap();
        assert!(near(si, expected) && dimension == Dimension::ANGULAR_VELOCITY);
    }
    assert_eq!(value(3).unwrap(), (pi, Dimension::DIMENSIONLESS));
    assert_eq!(value(4).unwrap_err().code, codes::UNKNOWN_UNIT);
    assert_eq!(value(5).unwrap_err().code, codes::UNKNOWN_PARAMETER);
    let list = RawValue { span: 0..0, kind: RawKind::Array(Vec::new()) };
    assert_eq!(scene.any_quantity(&list).unwrap_err().code, codes::WRONG_TYPE);
}

#[test]
fn a_force_of_a_joint_needs_no_bodies() {
    let scene = accept(&element("force", "joints = [\"bearing\", \"rail\"]"));
    let joints: Vec<&str> = scene.elements[0].joints.iter().map(|name| name.value.as_str()).collect();
    assert_eq!(joints, ["bearing", "rail"]);
    assert!(scene.elements[0].bodies.value.is_empty());
    assert!(accept(&element("control", "joints = [\"bearing\"]")).elements[0].inputs.is_empty());
    assert_eq!(reject(&element("force", "")).codes(), [codes::MISSING_KEY]);
}

#[test]
fn mistakes_in_signals() {
    for (kind, keys, code, culprit) in [
        ("control", "inputs = 3", codes::WRONG_TYPE, "3"),
        ("control", "inputs = { a = [1] }", codes::WRONG_TYPE, "[1]"),
        ("control", "inputs = { a = true }", codes::WRONG_TYPE, "true"),
        ("control", "joints = \"bearing\"", codes::WRONG_TYPE, "\"bearing\""),
        ("control", "input = { a = 1 }", codes::UNKNOWN_KEY, "input"),
        ("joint", "bodies = [\"x\"]\njoints = [\"b\"]", codes::UNKNOWN_KEY, "joints"),
    ] {
        let rejected = reject(&element(kind, keys));
        assert_eq!(rejected.codes(), [code], "{keys}");
        assert_eq!(rejected.culprit(), culprit, "{keys}");
    }
    let rejected = reject(&element("joint", "bodies = [\"x\"]\njoints = [\"b\"]"));
    assert_eq!(rejected.diagnostics[0].message, "joint `e` cannot have `joints`");
}

#[test]
fn a_signal_may_be_multiplied_by_a_quantity() {
    let scene =
        accept(&element("force", "joints = [\"j\"]\ninputs = { a = { signal = \"pid.output\", gain = \"2*speed\" } }"));
    let InputSource::Scaled { signal, gain } = &scene.elements[0].inputs[0].source.value else { panic!() };
    assert_eq!(signal.value, "pid.output");
    assert!(near(scene.any_quantity(gain).unwrap().0, 100.0 * std::f64::consts::PI));
    let refused = |input: &str| reject(&element("control", &format!("inputs = {{ a = {input} }}"))).codes();
    assert_eq!(refused("{ signal = \"b\" }"), [codes::MISSING_KEY]);
    assert_eq!(refused("{ gain = 2 }"), [codes::MISSING_KEY]);
    assert_eq!(refused("{ signal = \"b\", gain = [2] }"), [codes::WRONG_TYPE]);
    assert_eq!(refused("{ signal = \"b\", gian = 2, gain = 3 }"), [codes::UNKNOWN_KEY]);
}
