//! The words of requested outputs.

use nalgebra::Vector3;

use super::*;
use crate::diagnostics::Code;

fn scene(outputs: &str) -> String {
    let joint = |name: &str, kind: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"ground\", \"a\"]\nparams = {{ pitch = 1 }}\n"
        )
    };
    "[units]\nlength = \"mm\"\n".to_string()
        + &with_body("com = [1, 0, 0]\n")
        + "[[body]]\nname = \"wall\"\nfixed = true\n"
        + &joint("screw", "screw")
        + "[[joint]]\nname = \"hinge\"\ntype = \"hinge\"\nbodies = [\"a\", \"ground\"]\n"
        + "[[force]]\nname = \"strut\"\ntype = \"strut\"\nbodies = [\"a\", \"ground\"]\npoints = [[1, 0, 0], [0, 0, 0]]\n\
           params = { stiffness = 1 }\n[[input]]\nname = \"gust\"\nunit = \"kN\"\n"
        + outputs
}

/// The channel that the keys of one output ask for.
#[track_caller]
fn channel(keys: &str) -> Channel {
    let model = model(&scene(&format!("[[output]]\nname = \"o\"\n{}\n", keys.replace("; ", "\n"))));
    model.channels[0].clone()
}

#[track_caller]
fn refused(keys: &str) -> (Code, String) {
    let text = scene(&format!("[[output]]\nname = \"o\"\n{}\n", keys.replace("; ", "\n")));
    let source = crate::tests::scene(&text).source.text;
    let found = resolved(&text).err().unwrap();
    assert_eq!(found.len(), 1, "{found:#?}");
    (found[0].code, found[0].span().map_or(String::new(), |span| source[span].to_string()))
}

/// What is switched off is in the scene, and what there is not is called by what it is.
#[test]
fn elements_that_are_switched_off_are_said_to_be() {
    let said = |keys: &str| {
        let output = format!("[[output]]\nname = \"o\"\n{}\n", keys.replace("; ", "\n"));
        let text = scene(&output).replace("name = \"hinge\"", "name = \"hinge\"\nenabled = false");
        let found = resolved(&text).err().unwrap();
        assert_eq!(found.len(), 1, "{found:#?}");
        (found[0].message.clone(), found[0].help.join("; "))
    };
    let (message, help) = said("quantity = \"coordinate\"; of = \"hinge\"");
    assert_eq!(message, "the joint `hinge` is switched off");
    assert!(help.contains("`enabled = false` (line "), "{help}");
    assert_eq!(said("quantity = \"value\"; of = \"hinge\"").0, "the joint `hinge` is switched off");
    assert_eq!(said("quantity = \"coordinate\"; of = \"hing\"").0, "there is no joint `hing`");
    assert_eq!(said("quantity = \"value\"; of = \"lqr2\"").0, "there is no element `lqr2`");
}

#[test]
fn points_are_counted_from_the_centre_of_mass() {
    let found = channel("quantity = \"velocity\"; of = \"a\"; component = \"y\"; point = [3, 0, 2]");
    let point = Vector3::new(2e-3, 0.0, 2e-3);
    let Quantity::Point { body: 0, point: given, level: Level::Velocity, axes: Axes::Ground, component: 1 } =
        found.quantity
    else {
        panic!("{found:?}")
    };
    assert!((given - point).amax() < 1e-18);
    assert_eq!((found.name.as_str(), found.unit.as_str(), found.factor), ("o", "mm/s", 1e-3));
    // Without a point: the origin of the body frame.
    let found = channel("quantity = \"position\"; of = \"a\"; component = \"x\"; frame = \"a\"");
    let Quantity::Point { point, axes: Axes::Body(0), .. } = found.quantity else { panic!("{found:?}") };
    assert!((point - Vector3::new(-1e-3, 0.0, 0.0)).amax() < 1e-18);
}

#[test]
fn every_quantity_has_a_channel_with_its_unit() {
    for (keys, unit) in [
        ("quantity = \"acceleration\"; of = \"a\"; component = \"z\"", "mm/s^2"),
        ("quantity = \"orientation\"; of = \"a\"; component = \"e0\"", "1"),
        ("quantity = \"angular_velocity\"; of = \"a\"; component = \"z\"", "rad/s"),
        ("quantity = \"angular_acceleration\"; of = \"a\"; component = \"z\"", "rad/s^2"),
        ("quantity = \"coordinate\"; of = \"hinge\"", "rad"),
        ("quantity = \"coordinate_rate\"; of = \"screw\"; channel = \"advance\"", "mm/s"),
        ("quantity = \"coordinate_acceleration\"; of = \"hinge\"", "rad/s^2"),
        ("quantity = \"value\"; of = \"strut\"; channel = \"rate\"", "mm/s"),
        ("quantity = \"input\"; of = \"gust\"", "kN"),
        ("quantity = \"balance_force\"; of = \"a\"; component = \"x\"", "mN"),
        ("quantity = \"balance_torque\"; of = \"a\"; component = \"x\"", "uN m"),
    ] {
        assert_eq!(channel(keys).unit, unit, "{keys}");
    }
    let energies =
        ["kinetic_energy", "potential_energy", "total_energy"].map(|word| channel(&format!("quantity = \"{word}\"")));
    assert_eq!(
        energies.map(|c| c.quantity),
        [Quantity::KineticEnergy, Quantity::PotentialEnergy, Quantity::TotalEnergy]
    );
    assert_eq!(super::super::channels::QUANTITIES.len(), 20, "a new quantity needs a line here");
}

#[test]
fn loads_act_on_the_body_named_last_unless_told_otherwise() {
    let load = |keys: &str| match channel(keys).quantity {
        Quantity::Load { element, frame, torque, .. } => (element, frame, torque),
        other => panic!("{other:?}"),
    };
    // Joints come first: screw 0, hinge 1, strut 2.
    assert_eq!(load("quantity = \"reaction_force\"; of = \"screw\"; component = \"x\""), (0, 1, false));
    assert_eq!(load("quantity = \"reaction_torque\"; of = \"hinge\"; component = \"x\""), (1, 1, true));
    assert_eq!(load("quantity = \"reaction_torque\"; of = \"hinge\"; component = \"x\"; on = \"a\""), (1, 0, true));
    assert_eq!(load("quantity = \"force\"; of = \"strut\"; component = \"x\"; on = \"ground\""), (2, 1, false));
    let place = channel("quantity = \"reaction_force\"; of = \"hinge\"; component = \"x\"; on = \"a\"").place;
    assert_eq!(place, "force of hinge on a at its frame there, components along the axes of ground");
}

#[test]
fn words_that_mean_nothing_are_refused_where_they_stand() {
    for (keys, code, place) in [
        ("quantity = \"speed\"; of = \"a\"", codes::UNKNOWN_QUANTITY, "\"speed\""),
        ("quantity = \"position\"; of = \"b\"; component = \"x\"", codes::UNKNOWN_BODY, "\"b\""),
        ("quantity = \"position\"; of = \"wall\"; component = \"x\"", codes::UNKNOWN_TARGET, "\"wall\""),
        ("quantity = \"position\"; of = \"a\"; component = \"w\"", codes::UNKNOWN_COMPONENT, "\"w\""),
        ("quantity = \"orientation\"; of = \"a\"; component = \"x\"", codes::UNKNOWN_COMPONENT, "\"x\""),
        ("quantity = \"position\"; of = \"a\"", codes::MISSING_KEY, "\"position\""),
        ("quantity = \"position\"; component = \"x\"", codes::MISSING_KEY, "\"position\""),
        ("quantity = \"position\"; of = \"a\"; component = \"x\"; frame = \"wall\"", codes::UNKNOWN_TARGET, "\"wall\""),
        ("quantity = \"coordinate\"; of = \"strut\"", codes::UNKNOWN_TARGET, "\"strut\""),
        ("quantity = \"coordinate\"; of = \"screw\"", codes::UNKNOWN_CHANNEL, "\"coordinate\""),
        ("quantity = \"coordinate\"; of = \"screw\"; channel = \"angel\"", codes::UNKNOWN_CHANNEL, "\"angel\""),
        ("quantity = \"force\"; of = \"hinge\"; component = \"x\"", codes::UNKNOWN_TARGET, "\"hinge\""),
    ] {
        assert_eq!(refused(keys), (code, place.to_string()), "{keys}");
    }
}

#[test]
fn of_an_element_of_another_kind_the_right_words_are_named() {
    let help = |keys: &str| {
        let text = format!("[[output]]\nname = \"o\"\n{}\n", keys.replace("; ", "\n"));
        let found = resolved(&scene(&text)).err().unwrap();
        format!("{}: {}", found[0].message, found[0].help.join("; "))
    };
    assert_eq!(
        help("quantity = \"reaction_force\"; of = \"strut\"; component = \"x\""),
        "`strut` is a force, of which there is no `reaction_force`: its loads are `force` and `torque`"
    );
    let of_joint = help("quantity = \"torque\"; of = \"hinge\"; component = \"x\"");
    assert!(of_joint.contains("is a joint") && of_joint.contains("`reaction_torque`"), "{of_joint}");
}

#[test]
fn a_body_that_an_element_does_not_touch_bears_no_load_of_it() {
    let outputs = "[[body]]\nname = \"far\"\nmass = 1\ninertia = [1, 1, 1]\n\
                   [[output]]\nname = \"o\"\nquantity = \"force\"\nof = \"strut\"\ncomponent = \"x\"\non = \"far\"\n";
    let found = resolved(&scene(outputs)).err().unwrap();
    assert_eq!((found.len(), found[0].code), (1, codes::UNKNOWN_TARGET));
}

#[test]
fn outputs_of_an_element_that_failed_cause_no_second_message() {
    let text = with_body("")
        + "[[joint]]\nname = \"j\"\ntype = \"hing\"\nbodies = [\"ground\", \"a\"]\n\
           [[output]]\nname = \"o\"\nquantity = \"coordinate\"\nof = \"j\"\n";
    let found = resolved(&text).err().unwrap();
    assert_eq!(found.iter().map(|d| d.code).collect::<Vec<_>>(), [codes::UNKNOWN_TYPE]);
}
