//! One scene per message, each pointing at the words that are wrong.

use super::*;
use crate::catalog::Catalog;
use crate::diagnostics::{Code, Severity};
use crate::tests::library;

/// Code, severity, and the words of the scene that each message points at.
#[track_caller]
fn messages(text: &str) -> Vec<(Code, Severity, String)> {
    let source = crate::tests::scene(text).source.text;
    let found = match resolved(text) {
        Ok((_, notes)) => notes,
        Err(found) => found,
    };
    let words = |d: &Diagnostic| d.span().map_or(String::new(), |span| source[span].to_string());
    found.iter().map(|d| (d.code, d.severity, words(d))).collect()
}

/// A scene with one joint, written by its keys.
fn joint(keys: &str) -> String {
    with_body("") + &format!("[[joint]]\nname = \"j\"\n{}\n", keys.replace("; ", "\n"))
}

fn force(keys: &str) -> String {
    with_body("") + &format!("[[force]]\nname = \"f\"\n{}\n", keys.replace("; ", "\n"))
}

#[test]
fn each_mistake_has_one_message_at_its_place() {
    let body = |mass: &str, inertia: &str| format!("[[body]]\nname = \"a\"\nmass = {mass}\ninertia = {inertia}\n");
    let on = "bodies = [\"ground\", \"a\"]";
    let cases = [
        (joint("type = \"ball\"; bodies = [\"ground\", \"aa\"]"), codes::UNKNOWN_BODY, "\"aa\""),
        (joint(&format!("type = \"bal\"; {on}")), codes::UNKNOWN_TYPE, "\"bal\""),
        (joint(&format!("type = \"friction\"; {on}")), codes::WRONG_KIND, "\"friction\""),
        (force(&format!("type = \"ball\"; {on}")), codes::WRONG_KIND, "\"ball\""),
        (joint("type = \"ball\"; bodies = [\"a\", \"a\"]"), codes::SELF_JOINT, "[\"a\", \"a\"]"),
        (joint("type = \"ball\"; bodies = [\"ground\", \"ground\"]"), codes::SELF_JOINT, "[\"ground\", \"ground\"]"),
        (joint("type = \"ball\"; bodies = [\"a\"]"), codes::BODY_COUNT, "[\"a\"]"),
        (
            joint("type = \"ball\"; bodies = [\"a\", \"ground\", \"a\"]"),
            codes::BODY_COUNT,
            "[\"a\", \"ground\", \"a\"]",
        ),
        (body("0", "[1, 1, 1]"), codes::BAD_MASS, "0"),
        (body("-1", "[1, 1, 1]"), codes::BAD_MASS, "-1"),
        (body("1", "[1, 1, -0.1]"), codes::BAD_INERTIA, "[1, 1, -0.1]"),
        (body("1", "[0, 0, 0]"), codes::BAD_INERTIA, "[0, 0, 0]"),
        (body("1", "[1, 1, 1, 2, 0, 0]"), codes::BAD_INERTIA, "[1, 1, 1, 2, 0, 0]"),
        (
            force(&format!("type = \"strut\"; {on}; params = {{ stifness = 1, stiffness = 2 }}")),
            codes::UNKNOWN_ELEMENT_PARAMETER,
            "stifness",
        ),
        (
            force(&format!("type = \"strut\"; {on}; params = {{ damping = 1 }}")),
            codes::MISSING_ELEMENT_PARAMETER,
            "{ damping = 1 }",
        ),
        (
            force(&format!("type = \"strut\"; {on}; params = {{ stiffness = -1 }}")),
            codes::ELEMENT_PARAMETER_RANGE,
            "-1",
        ),
        (
            force("type = \"echo\"; bodies = [\"a\"]; params = { number = 1, word = \"forbidden\" }"),
            codes::ELEMENT_REFUSES,
            "\"forbidden\"",
        ),
        (
            joint(&format!("type = \"ball\"; {on}; points = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]")),
            codes::BAD_PLACEMENT,
            "[[0, 0, 0], [1, 0, 0], [2, 0, 0]]",
        ),
        (
            joint(&format!("type = \"ball\"; {on}; frames = [{{ position = [0, 0, 0] }}]")),
            codes::BAD_PLACEMENT,
            "[{ position = [0, 0, 0] }]",
        ),
        (force("type = \"panics\"; bodies = [\"a\"]"), codes::PLUGIN_PANICKED, "\"panics\""),
        (joint(&format!("type = \"forgetful\"; {on}")), codes::PLUGIN_MISBEHAVED, "\"forgetful\""),
        (joint(&format!("type = \"no-rows\"; {on}")), codes::PLUGIN_MISBEHAVED, "\"no-rows\""),
        ("[[body]]\nname = \"a\"\nfixed = true\n".to_string(), codes::NOTHING_TO_DO, "\"a\""),
    ];
    for (text, code, place) in &cases {
        assert_eq!(messages(text), [(*code, Severity::Error, place.to_string())], "{text}");
    }
}

#[test]
fn units_that_numbers_do_not_come_in_are_refused_once_by_name() {
    let one = force("type = \"in-millimetres\"; bodies = [\"a\"]");
    let another = one.replace("\"f\"", "\"g\"");
    let another = &another[another.find("[[force]]").unwrap()..];
    let output = "[[output]]\nname = \"o\"\nquantity = \"value\"\nof = \"f\"\nchannel = \"pull\"\n";
    let found = resolved(&format!("{one}{another}{output}")).err().unwrap();
    let told: Vec<(&str, &str)> = found.iter().map(|d| (d.message.as_str(), d.help[0].as_str())).collect();
    let of = "`foreign/in-millimetres`: its";
    assert_eq!(
        told,
        [
            (
                &*format!("{of} parameter `stiffness` is declared in `N/mm`, but numbers reach elements in SI"),
                "declare `N/m` and compute in it; scenes may still write `\"5 N/mm\"`"
            ),
            (
                &*format!("{of} parameter `force` is declared in `mm`, but numbers reach elements in SI"),
                "declare `m` and compute in it; scenes may still write `\"5 mm\"`"
            ),
            (
                &*format!("{of} channel `pull` is declared in `Newton`, which can't be read: unknown unit `Newton`"),
                "did you mean `N`?"
            ),
        ]
    );
    assert!(found.iter().all(|d| d.code == codes::PLUGIN_MISBEHAVED && d.span().is_some()));
}

#[test]
fn an_inertia_that_no_body_has_is_used_with_a_warning() {
    let text = "[[body]]\nname = \"a\"\nmass = 1\ninertia = [1, 1, 2.1]\n";
    assert_eq!(messages(text), [(codes::UNREAL_INERTIA, Severity::Warning, "[1, 1, 2.1]".to_string())]);
    let limit = "[[body]]\nname = \"a\"\nmass = 1\ninertia = [1, 1, 2]\n";
    assert_eq!(messages(limit), [], "a flat disc is real");
    // Plates whose moments are rounded to three and four digits, one of them turned by 0.3 rad, and a rod.
    for plate in
        ["[0.335, 0.501, 0.839]", "[0.0833, 0.0833, 0.1667]", "[14.95, 8.494, 23.35, 1.97, 0, 0]", "[2.1, 2.1, 0]"]
    {
        assert_eq!(messages(&limit.replace("[1, 1, 2]", plate)), [], "{plate}");
    }
    let beyond = limit.replace("[1, 1, 2]", "[1, 1, 2.02]");
    assert_eq!(messages(&beyond)[0].0, codes::UNREAL_INERTIA, "more than rounding");
    let said = &resolved(text).unwrap().1[0];
    assert!(format!("{said:?}").contains("1 and 1 kg m^2 together are less than the third, 2.1 kg m^2"), "{said:?}");
    assert_eq!(resolved(text).unwrap().0.bodies[0].inertia[(2, 2)], 2.1, "nothing is repaired");
}

#[test]
fn a_type_of_two_libraries_needs_its_full_name() {
    let mut catalog = crate::tests::catalog();
    catalog.add_library(library("other")).unwrap();
    let scene = |kind: &str| crate::tests::scene(&joint(&format!("type = \"{kind}\"; bodies = [\"ground\", \"a\"]")));
    let found = resolve(&scene("ball"), &catalog, false).err().unwrap();
    assert_eq!(found.iter().map(|d| d.code).collect::<Vec<_>>(), [codes::AMBIGUOUS_TYPE]);
    let (model, _) = resolve(&scene("other/ball"), &catalog, false).unwrap();
    assert_eq!(model.elements[0].library, "other");
    let found = resolve(&scene("ball"), &Catalog::new(), false).err().unwrap();
    assert_eq!(found.iter().map(|d| d.code).collect::<Vec<_>>(), [codes::UNKNOWN_TYPE]);
}

#[test]
fn all_mistakes_are_found_at_once() {
    let text = "[[body]]\nname = \"a\"\nmass = -1\ninertia = [1, 1, -1]\n\
                [[joint]]\nname = \"j\"\ntype = \"bal\"\nbodies = [\"ground\", \"b\"]\n\
                [[force]]\nname = \"f\"\ntype = \"strut\"\nbodies = [\"ground\", \"a\"]\n\
                [[output]]\nname = \"o\"\nquantity = \"speed\"\n";
    let mut found: Vec<Code> = messages(text).iter().map(|(code, ..)| *code).collect();
    found.sort_unstable();
    let mut expected = [
        codes::BAD_MASS,
        codes::BAD_INERTIA,
        codes::UNKNOWN_TYPE,
        codes::UNKNOWN_BODY,
        codes::MISSING_ELEMENT_PARAMETER,
        codes::UNKNOWN_QUANTITY,
    ];
    expected.sort_unstable();
    assert_eq!(found, expected);
}

#[test]
fn a_force_that_is_zero_is_warned_of() {
    let push = "type = \"push\"; bodies = [\"ground\", \"a\"]; params.factor = ";
    assert_eq!(messages(&force(&format!("{push}3; inputs.signal = 1"))), []);
    let zeros = [format!("{push}0; inputs.signal = 1"), format!("{push}3; inputs.signal = 0")];
    for text in zeros.map(|keys| force(&keys)) {
        assert_eq!(messages(&text), [(codes::FORCE_OF_NOTHING, Severity::Warning, "\"f\"".to_string())]);
        let reported = "[[output]]\nname = \"F\"\nquantity = \"force\"\nof = \"f\"\non = \"a\"\ncomponent = \"x\"\n";
        assert_eq!(messages(&(text + reported)), []);
    }
}

#[test]
fn a_control_element_is_no_force() {
    let text = with_body("") + "[[force]]\nname = \"c\"\ntype = \"amplifier\"\nbodies = []\n";
    let found = messages(&text);
    assert_eq!((found.len(), found[0].0, found[0].1), (1, codes::WRONG_KIND, Severity::Error));
}

#[test]
fn a_control_element_that_nothing_takes_is_warned_of() {
    let control = "[[control]]\nname = \"c\"\ntype = \"amplifier\"\ninputs = { in = 1 }\nparams = { factor = 2 }\n";
    let text = with_body("") + control;
    assert_eq!(messages(&text), [(codes::UNUSED_CONTROL, Severity::Warning, "\"c\"".to_string())]);
    let reported = "[[output]]\nname = \"g\"\nquantity = \"value\"\nof = \"c\"\nchannel = \"out\"\n";
    assert_eq!(messages(&(text.clone() + reported)), []);
    let push = force("type = \"push\"; bodies = [\"ground\", \"a\"]; params.factor = 3; inputs.signal = \"c.out\"");
    assert_eq!(messages(&(push + control)), []);
}

#[test]
fn an_input_that_nothing_takes_is_warned_of() {
    let inputs = "[[input]]\nname = \"gust\"\n[[input]]\nname = \"tug\"\n";
    let tug = force("type = \"push\"; bodies = [\"ground\", \"a\"]; params.factor = 3; inputs.signal = \"tug\"");
    let text = tug + inputs;
    assert_eq!(messages(&text), [(codes::UNUSED_INPUT, Severity::Warning, "\"gust\"".to_string())]);
    assert_eq!(messages(&(text + "[[output]]\nname = \"g\"\nquantity = \"input\"\nof = \"gust\"\n")), []);
    // An element means it, and misses its name: that none takes it is not said besides.
    let wrong = force("type = \"push\"; bodies = [\"ground\", \"a\"]; params.factor = 3; inputs.signal = \"gusts\"");
    let found = messages(&(wrong + "[[input]]\nname = \"gust\"\n"));
    assert!(found.iter().all(|(code, ..)| *code != codes::UNUSED_INPUT) && !found.is_empty(), "{found:?}");
}

#[test]
fn products_of_inertia_that_are_too_large_are_named() {
    let found = resolved("[[body]]\nname = \"a\"\nmass = 1\ninertia = [1, 1, 1, 2, 0, 0]\n").err().unwrap();
    assert!(found[0].help[0].starts_with("products of inertia are too large"), "{found:?}");
    let found = resolved("[[body]]\nname = \"a\"\nmass = 1\ninertia = [1, 1, -0.1]\n").err().unwrap();
    assert!(found[0].help[0].contains("thin rod"), "{found:?}");
}

#[test]
fn inertia_in_other_units_than_those_of_the_scene_is_warned_of() {
    let rod = |inertia: &str| {
        format!(
            "[units]\nlength = \"mm\"\n[[body]]\nname = \"a\"\nmass = 1\ninertia = {inertia}\nposition = [100, 0, 0]\n\
             [[joint]]\nname = \"j\"\ntype = \"ball\"\nbodies = [\"ground\", \"a\"]\npoint = [0, 0, 0]\n"
        )
    };
    let warned = |inertia: &str| {
        let (_, notes) = resolved(&rod(inertia)).unwrap();
        notes.iter().any(|note| note.code == codes::OTHER_UNIT)
    };
    // Numbers in kg m^2; a rod of 200 mm, in kg mm^2 and with its units; a lump at the end of a light rod.
    assert!(warned("[1e-5, 3.3e-3, 3.3e-3]"));
    for right in [
        "[10, 3300, 3300]",
        "[\"10 kg mm^2\", \"3.3e-3 kg m^2\", \"3.3e-3 kg m^2\"]",
        "[1e-9, 1e-9, 1e-9]",
        "[1, 1, 1]",
    ] {
        assert!(!warned(right), "{right}");
    }
    assert!(warned("[1e10, 1e10, 1e10]"));
}
