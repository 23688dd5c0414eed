use super::description::{Causality, Storage, Version};
use super::unit::Unit;
use super::*;

const TWO: &str = include_str!("../../../tests/fmu/two.xml");
const THREE: &str = include_str!("../../../tests/fmu/three.xml");

#[test]
fn descriptions_of_both_versions_say_the_same() {
    let [two, three] = [TWO, THREE].map(|text| Description::read(text).unwrap());
    assert_eq!((two.version, three.version), (Version::Two, Version::Three));
    for (a, b) in two.variables.iter().zip(&three.variables) {
        assert_eq!(
            (&a.name, a.reference, a.storage, a.causality, &a.start),
            (&b.name, b.reference, b.storage, b.causality, &b.start)
        );
    }
    assert_eq!(two.variables.len(), 9);
    assert_eq!((two.step, two.keeps_state, two.only_once, two.any_step), (Some(0.01), true, false, true));
    let described = class::describe(&two);
    assert_eq!(described.channels[1].name, "steps_1");
    assert!(described.params.iter().any(|spec| spec.name == "parameters.label"));
}

/// A description with units, of version 2 and 3.
fn with_units(units: &str, types: &str, variable: &str) -> Result<Description, Unusable> {
    Description::read(&format!(
        "<fmiModelDescription fmiVersion=\"3.0\" modelName=\"m\" instantiationToken=\"t\"><CoSimulation modelIdentifier=\"m\"/>\
         <UnitDefinitions>{units}</UnitDefinitions><TypeDefinitions>{types}</TypeDefinitions><ModelVariables>{variable}</ModelVariables>\
         </fmiModelDescription>"
    ))
}

#[test]
fn units_become_those_of_si() {
    let units = "<Unit name=\"mm/min\"><BaseUnit m=\"1\" s=\"-1\" factor=\"1.6666666666666667e-05\"/></Unit>\
                 <Unit name=\"degC\"><BaseUnit K=\"1\" offset=\"273.15\"/></Unit>\
                 <Unit name=\"Nm\"><BaseUnit kg=\"1\" m=\"2\" s=\"-2\"/></Unit>\
                 <Unit name=\"odd\"><BaseUnit m=\"1\" factor=\"2\" offset=\"3\"/></Unit>";
    let types = "<Float64Type name=\"Torque\" unit=\"Nm\"/>";
    let unit = |attributes: &str| {
        let variable =
            format!("<Float64 name=\"x\" valueReference=\"1\" causality=\"input\" start=\"0\" {attributes}/>");
        with_units(units, types, &variable).unwrap().variables[0].unit.clone()
    };
    let feed = unit("unit=\"mm/min\"");
    assert_eq!(feed.si, "m s^-1");
    assert!((feed.to_si(60.0) - 1e-3).abs() < 1e-18 && (feed.of_si(1e-3) - 60.0).abs() < 1e-12);
    assert_eq!(unit("declaredType=\"Torque\"").si, "kg m^2 s^-2");
    assert_eq!(unit("unit=\"degC\""), Unit::unknown());
    assert_eq!(unit(""), Unit::unknown());
    let odd = unit("unit=\"odd\"");
    assert_eq!((odd.to_si(1.0), odd.of_si(5.0)), (5.0, 1.0));
    assert_eq!(unit("unit=\"odd\" relativeQuantity=\"true\"").to_si(1.0), 2.0);
    // Not defined, but known to scenes.
    let speed = unit("unit=\"rpm\"");
    assert_eq!(speed.si, "s^-1 rad");
    assert!((speed.to_si(30.0) - std::f64::consts::PI).abs() < 1e-15);
    assert_eq!(unit("unit=\"furlong\""), Unit::unknown());
    let error = with_units("<Unit name=\"u\"><BaseUnit m=\"one\"/></Unit>", "", "").unwrap_err();
    assert!(
        error.damaged && error.message.contains("line 1, column ") && error.message.contains("`m`"),
        "{}",
        error.message
    );
}

#[test]
fn arrays_and_others_are_left_alone() {
    let variables = "<Float64 name=\"a\" valueReference=\"1\" causality=\"input\" start=\"0 0\"><Dimension start=\"2\"/></Float64>\
                     <Binary name=\"b\" valueReference=\"2\" causality=\"input\"/><Clock name=\"c\" valueReference=\"3\" causality=\"input\"/>\
                     <Float32 name=\"d\" valueReference=\"4\" causality=\"output\"/><Float64 name=\"e\" valueReference=\"5\" causality=\"local\"/>";
    let found = with_units("", "", variables).unwrap();
    assert_eq!(found.variables.len(), 1);
    assert_eq!((found.variables[0].storage, found.variables[0].causality), (Storage::Float32, Causality::Output));
}

/// Whatever a byte of it is changed to, an archive is read or refused.
#[test]
fn damaged_archives_are_refused_and_never_panic() {
    let mut archive = Vec::new();
    // One stored file, its lengths and checksum those of "abc".
    let head = |signature: &[u8], more: &[u8]| {
        let mut bytes = signature.to_vec();
        bytes.extend([20, 0, 0, 0, 0, 0, 0, 0, 0x21, 0, 0xc2, 0x41, 0x24, 0x35, 3, 0, 0, 0, 3, 0, 0, 0, 1, 0, 0, 0]);
        bytes.extend(more);
        bytes.push(b'a');
        bytes
    };
    archive.extend(head(b"PK\x03\x04", &[]));
    archive.extend(b"abc");
    let directory = archive.len() as u8;
    archive.extend(head(b"PK\x01\x02\x14\0", &[0; 14]));
    archive.extend(b"PK\x05\x06\0\0\0\0\x01\0\x01\0\x2f\0\0\0");
    archive.extend([directory, 0, 0, 0, 0, 0]);
    let read = |bytes: &[u8]| {
        let archive = archive::Archive::read(bytes)?;
        archive.entries.iter().map(|entry| archive.content(entry)).collect::<Result<Vec<_>, _>>()
    };
    assert_eq!(read(&archive).unwrap(), [b"abc"]);
    for place in 0..archive.len() {
        for value in [0, 1, 0x7f, 0x80, 0xff] {
            let mut bytes = archive.clone();
            bytes[place] = value;
            let _ = read(&bytes);
            let _ = Fmu::open(&bytes);
        }
        assert!(read(&archive[..place]).is_err());
    }
}
