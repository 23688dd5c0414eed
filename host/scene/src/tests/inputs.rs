//! `[[input]]`: signals from outside.

use super::*;

fn text(keys: &str) -> String {
    format!("[units]\nforce = \"kN\"\n[parameters]\ngust = \"3 kN\"\n{SIMULATION}[[input]]\nname = \"wind\"\n{keys}\n")
}

#[test]
fn an_input_has_a_value_and_the_unit_of_those_to_come() {
    let force = Dimension::FORCE;
    for (keys, value, dimension, unit, factor) in [
        ("", 0.0, Dimension::DIMENSIONLESS, "1", 1.0),
        ("value = 2", 2.0, Dimension::DIMENSIONLESS, "1", 1.0),
        ("value = \"500 N\"", 500.0, force, "kN", 1e3),
        ("value = \"2*gust\"", 6e3, force, "kN", 1e3),
        ("value = \"3 N m\"", 3.0, Dimension::TORQUE, "N m", 1.0),
        ("value = \"3 J\"", 3.0, Dimension::ENERGY, "J", 1.0),
        ("unit = \"N\"", 0.0, force, "N", 1.0),
        ("unit = \"N\"\nvalue = 4", 4.0, force, "N", 1.0),
        ("unit = \"MN\"\nvalue = 0.5", 5e5, force, "MN", 1e6),
        ("unit = \"N\"\nvalue = \"gust / 3\"", 1e3, force, "N", 1.0),
        // A text without a unit is the number that it says.
        ("unit = \"MN\"\nvalue = \"0.5\"", 5e5, force, "MN", 1e6),
        ("unit = \"N\"\nvalue = \"2 * 2\"", 4.0, force, "N", 1.0),
    ] {
        let scene = accept(&text(keys));
        let [input] = scene.inputs.as_slice() else { panic!("{keys}: {:?}", scene.inputs) };
        assert!(near(input.value, value), "{keys}: {}", input.value);
        assert_eq!(
            (input.name.value.as_str(), input.dimension, input.unit.as_str()),
            ("wind", dimension, unit),
            "{keys}"
        );
        assert!(near(input.factor, factor), "{keys}: {}", input.factor);
    }
}

#[test]
fn mistakes_in_inputs_are_told() {
    for (keys, code) in [
        ("value = \"3 parsec\"", codes::UNKNOWN_UNIT),
        ("unit = \"parsec\"", codes::UNKNOWN_UNIT),
        ("unit = \"N\"\nvalue = \"3 m\"", codes::DIMENSION),
        ("unit = 3", codes::WRONG_TYPE),
        ("value = [3]", codes::WRONG_TYPE),
        ("valeu = 3", codes::UNKNOWN_KEY),
        // Elements take both by their names.
        ("[[output]]\nname = \"wind\"\nquantity = \"kinetic_energy\"", codes::DUPLICATE_NAME),
    ] {
        assert_eq!(reject(&text(keys)).codes(), [code], "{keys}");
    }
    assert_eq!(reject(&format!("{SIMULATION}[[input]]\nvalue = 3\n")).codes(), [codes::MISSING_KEY]);
    let set = accept_with(&text("value = 1\nunit = \"kN\""), &["wind.value=2", "input.wind.unit=N"]);
    assert!(near(set.inputs[0].value, 2.0) && set.inputs[0].unit == "N");
}
