//! Units and unit systems.

use super::*;
use std::f64::consts::PI;

fn size(text: &str) -> (Dimension, f64) {
    parse_unit(text).unwrap_or_else(|error| panic!("{text}: {error:?}"))
}

#[test]
fn base_and_derived_units() {
    for (text, dimension, factor) in [
        ("m", Dimension::LENGTH, 1.0),
        ("mm", Dimension::LENGTH, 1e-3),
        ("µm", Dimension::LENGTH, 1e-6),
        ("\u{3bc}m", Dimension::LENGTH, 1e-6),
        ("kg", Dimension::MASS, 1.0),
        ("t", Dimension::MASS, 1000.0),
        ("min", Dimension::TIME, 60.0),
        ("ms", Dimension::TIME, 1e-3),
        ("kN", Dimension::FORCE, 1000.0),
        ("MPa", Dimension::PRESSURE, 1e6),
        ("mbar", Dimension::PRESSURE, 100.0),
        ("in", Dimension::LENGTH, 0.0254),
        ("lbf", Dimension::FORCE, 4.448_221_615_260_5),
        ("deg", Dimension::ANGLE, PI / 180.0),
        ("rpm", Dimension::ANGULAR_VELOCITY, 2.0 * PI / 60.0),
        ("%", Dimension::DIMENSIONLESS, 0.01),
        ("1", Dimension::DIMENSIONLESS, 1.0),
    ] {
        let (found, value) = size(text);
        assert_eq!(found, dimension, "{text}");
        assert!(near(value, factor), "{text}: {value}");
    }
}

#[test]
fn products_quotients_and_powers() {
    for (text, dimension, factor) in [
        ("N m/rad", Dimension::ROTATIONAL_STIFFNESS, 1.0),
        ("N m s/rad", Dimension::ROTATIONAL_DAMPING, 1.0),
        ("N/mm", Dimension::STIFFNESS, 1000.0),
        ("kg*mm^2", Dimension::INERTIA, 1e-6),
        ("kg·mm²", Dimension::INERTIA, 1e-6),
        ("kg mm**2", Dimension::INERTIA, 1e-6),
        ("kg mm ^2", Dimension::INERTIA, 1e-6),
        ("m/s^2", Dimension::ACCELERATION, 1.0),
        ("m/s/s", Dimension::ACCELERATION, 1.0),
        ("m s^-2", Dimension::ACCELERATION, 1.0),
        ("m s⁻²", Dimension::ACCELERATION, 1.0),
        ("1/s", Dimension::FREQUENCY, 1.0),
        ("kg/(m s^2)", Dimension::PRESSURE, 1.0),
        ("(mm)^3", Dimension::VOLUME, 1e-9),
        (" rev / min ", Dimension::ANGULAR_VELOCITY, PI / 30.0),
    ] {
        let (found, value) = size(text);
        assert_eq!(found, dimension, "{text}");
        assert!(near(value, factor), "{text}: {value}");
    }
}

#[test]
fn wrong_units_say_where() {
    for (text, code, range) in [
        ("", codes::UNIT_SYNTAX, 0..0),
        ("foo", codes::UNKNOWN_UNIT, 0..3),
        ("N foo", codes::UNKNOWN_UNIT, 2..5),
        ("N/", codes::UNIT_SYNTAX, 2..2),
        ("2 m", codes::UNIT_SYNTAX, 0..1),
        ("m 2", codes::UNIT_SYNTAX, 2..3),
        ("N/m s", codes::UNIT_SYNTAX, 1..5),
        ("m^", codes::UNIT_SYNTAX, 1..2),
        ("m^0.5", codes::UNIT_SYNTAX, 1..3),
        ("m^13", codes::UNIT_SYNTAX, 1..4),
        ("(m", codes::UNIT_SYNTAX, 0..1),
        ("m)", codes::UNIT_SYNTAX, 1..2),
        ("m1", codes::UNKNOWN_UNIT, 0..2),
        ("10/s", codes::UNIT_SYNTAX, 0..1),
    ] {
        let error = parse_unit(text).expect_err(text);
        assert_eq!((error.code, error.range), (code, range), "{text}");
    }
}

#[test]
fn unknown_units_have_advice() {
    for (text, meant) in [
        ("Nm", "`N m`"),
        ("kNmm", "`kN mm`"),
        ("sec", "`s`"),
        ("Degrees", "`deg`"),
        ("lb", "`lbm` for a mass"),
        ("Kg", "`kg`"),
        ("RPM", "`rpm`"),
    ] {
        let help = parse_unit(text).expect_err(text).help;
        assert!(help.as_ref().is_some_and(|help| help.contains(meant)), "{text}: {help:?}");
    }
}

#[test]
fn angles_may_be_left_out_but_not_mixed_up() {
    let stiffness = Dimension::ROTATIONAL_STIFFNESS;
    assert!(stiffness.compatible(Dimension::TORQUE));
    assert!(Dimension::ANGULAR_VELOCITY.compatible(Dimension::FREQUENCY));
    assert!(Dimension::ANGLE.compatible(Dimension::DIMENSIONLESS));
    let inverse = Dimension { angle: 1, ..stiffness };
    assert!(!stiffness.compatible(inverse));
    assert!(!Dimension::LENGTH.compatible(Dimension::AREA));
}

#[test]
fn products_and_quotients_of_dimensions_are_inverse() {
    let all = [Dimension::FORCE, Dimension::ANGLE, Dimension::DENSITY, Dimension::POWER];
    for a in all {
        for b in all {
            let product = a.times(b).expect("small powers");
            assert_eq!(product.over(b), Some(a));
        }
        assert_eq!(a.power(3.0).and_then(|cube| cube.power(1.0 / 3.0)), Some(a));
        assert_eq!(a.power(200.0), None);
    }
    assert_eq!(Dimension::LENGTH.power(0.5), None);
}

/// The paper's units: mm, ms, kg.
fn milli() -> UnitSystem {
    accept(&format!("[units]\nlength = \"mm\"\ntime = \"ms\"\n{SIMULATION}")).units
}

#[test]
fn coherent_units_have_their_names() {
    let si = UnitSystem::default();
    let milli = milli();
    for (dimension, in_si, in_milli) in [
        (Dimension::FORCE, "N", "kN"),
        (Dimension::ENERGY, "J", "J"),
        (Dimension::POWER, "W", "kW"),
        (Dimension::PRESSURE, "Pa", "GPa"),
        (Dimension::ACCELERATION, "m/s^2", "mm/ms^2"),
        (Dimension::INERTIA, "kg m^2", "kg mm^2"),
        (Dimension::STIFFNESS, "N/m", "kN/mm"),
        (Dimension::DAMPING, "N s/m", "kN ms/mm"),
        (Dimension::ROTATIONAL_STIFFNESS, "N m/rad", "kN mm/rad"),
        (Dimension::ROTATIONAL_DAMPING, "N m s/rad", "kN mm ms/rad"),
        (Dimension::ANGULAR_VELOCITY, "rad/s", "rad/ms"),
        (Dimension::FREQUENCY, "1/s", "1/ms"),
        (Dimension::MOMENTUM, "kg m/s", "kg mm/ms"),
        (Dimension::DENSITY, "kg/m^3", "kg/mm^3"),
        (Dimension::DIMENSIONLESS, "1", "1"),
    ] {
        assert_eq!(si.label(dimension), in_si);
        assert_eq!(milli.label(dimension), in_milli);
    }
    assert_eq!(si.torque_label(), "N m");
    assert_eq!(milli.torque_label(), "N m");
    for (written, label) in
        [("N m", "N m"), ("kN*mm", "N m"), ("lbf ft", "N m"), ("J", "J"), ("kJ", "J"), ("W h", "J"), ("", "J")]
    {
        assert_eq!(si.label_as(Dimension::TORQUE, written), label, "{written}");
    }
    assert_eq!(si.label_as(Dimension::STIFFNESS, "N/m"), "N/m");
}

#[test]
fn labels_parse_back_to_the_factor() {
    for system in [UnitSystem::default(), milli()] {
        for dimension in [
            Dimension::FORCE,
            Dimension::TORQUE,
            Dimension::POWER,
            Dimension::PRESSURE,
            Dimension::STIFFNESS,
            Dimension::ROTATIONAL_STIFFNESS,
            Dimension::ROTATIONAL_DAMPING,
            Dimension::ANGULAR_ACCELERATION,
            Dimension::DENSITY,
            Dimension::new(-2, 3, -4, 2),
            Dimension::new(1, -1, 2, 0),
        ] {
            let (found, factor) = size(&system.label(dimension));
            assert_eq!(found, dimension);
            assert!(near(factor, system.factor(dimension)), "{}", system.label(dimension));
        }
    }
}

#[test]
fn named_units_hold_for_their_own_dimension_only() {
    let units = "length = \"mm\"\ntime = \"ms\"\nforce = \"N\"\ntorque = \"N mm\"";
    let system = accept(&format!("[units]\n{units}\n{SIMULATION}")).units;
    assert_eq!(system.factor(Dimension::FORCE), 1.0);
    assert_eq!(system.label(Dimension::FORCE), "N");
    assert_eq!(system.torque_label(), "N mm");
    assert_eq!(system.label(Dimension::ENERGY), "mJ");
    assert!(near(system.factor(Dimension::TORQUE), 1e-3));
    assert!(near(system.factor(Dimension::STIFFNESS), 1e6));
    assert_eq!(system.label(Dimension::STIFFNESS), "kN/mm");
}

#[test]
fn conversion_goes_both_ways() {
    let system = milli();
    assert!(near(system.to_si(1.0, Dimension::ACCELERATION), 1000.0));
    let there = system.to_si(8.5, Dimension::LENGTH);
    assert!(near(system.from_si(there, Dimension::LENGTH), 8.5));
}

#[test]
fn wrong_unit_tables_are_rejected() {
    for (line, code, culprit) in [
        ("length = \"ms\"", codes::DIMENSION, "ms"),
        ("length = \"parsec\"", codes::UNKNOWN_UNIT, "parsec"),
        ("length = 5", codes::WRONG_TYPE, "5"),
        ("lenght = \"mm\"", codes::UNKNOWN_KEY, "lenght"),
        ("angle = \"1\"", codes::DIMENSION, "1"),
        ("torque = \"N m\"\nenergy = \"mJ\"", codes::CONFLICTING_KEYS, "energy"),
    ] {
        let rejected = reject(&format!("[units]\n{line}\n{SIMULATION}"));
        assert_eq!(rejected.codes(), [code], "{line}");
        assert_eq!(rejected.culprit(), culprit, "{line}");
    }
}

/// What the derive of parameters takes for SI units, for others and for none.
#[allow(dead_code)] // a part is the derive's
#[path = "../../../../element-api/derive/src/units.rs"]
mod derived;

#[test]
fn the_derive_knows_the_units_of_scenes() {
    use super::super::units::{KNOWN, PREFIXES, is_unit};
    use derived::{Symbol, look_up};
    let prefixes = PREFIXES.iter().map(|(prefix, _)| *prefix).chain([""]);
    for prefix in prefixes {
        for known in KNOWN {
            let symbol = format!("{prefix}{}", known.symbol);
            let found = look_up(&symbol);
            assert_eq!(is_unit(&symbol), !matches!(found, Symbol::Unknown(_)), "{symbol}: {found:?}");
            if let Ok((_, factor)) = crate::parse_unit(&symbol) {
                assert_eq!(factor == 1.0, found == Symbol::Si, "{symbol}: {found:?}");
            }
            if let Symbol::Other(si) = found {
                let dimension = |text: &str| crate::parse_unit(text).map(|(dimension, _)| dimension).ok();
                assert!(si == "1" || dimension(si) == dimension(&symbol), "{symbol} -> {si}");
            }
        }
    }
    assert_eq!(look_up("Nm"), Symbol::Unknown("N m".into()));
}

#[test]
fn heads_of_columns_have_units_in_brackets() {
    let cases = [
        ("x_p [mm]", ("x_p", Some("mm"))),
        (" x_p ", ("x_p", None)),
        ("[mm]", ("[mm]", None)),
        ("a[1] [N m]", ("a[1]", Some("N m"))),
    ];
    for (text, parts) in cases {
        assert_eq!(name_and_unit(text), parts, "{text}");
    }
}

#[test]
fn units_that_are_spelled_out_are_recognised() {
    for (word, symbol) in [
        ("millimeter", "mm"),
        ("Millimetres", "mm"),
        ("milliseconds", "ms"),
        ("kilonewton", "kN"),
        ("megapascal", "MPa"),
    ] {
        let help = parse_unit(word).unwrap_err().help;
        assert_eq!(help, Some(format!("did you mean `{symbol}`?")), "{word}");
    }
    assert!(parse_unit("slug").unwrap_err().help.unwrap().contains("`1 lbf s^2/ft`"));
    let (dimension, kilograms) = parse_unit("lbf s^2/ft").unwrap();
    assert_eq!(dimension, Dimension::MASS);
    assert!((kilograms - 14.5939).abs() < 1e-4);
}
