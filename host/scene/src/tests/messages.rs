//! What the user sees, word for word.

use super::*;

#[test]
fn a_mistyped_key() {
    let rejected = reject(&format!("{SIMULATION}\n[[body]]\nname = \"rotor\"\nfixed = true\nvellocity = [0, 0, 0]\n"));
    let expected = "\
error[ODY0102]: unknown key `vellocity` in body `rotor`
 --> test.toml:8:1
  |
8 | vellocity = [0, 0, 0]
  | ^^^^^^^^^
  |
  = help: did you mean `velocity`?

";
    assert_eq!(rejected.rendered(), expected);
}

#[test]
fn a_wrong_dimension_inside_a_text() {
    let text = format!(
        "units.length = \"mm\"\n{SIMULATION}\n[[body]]\nname = \"rotor\"\nfixed = true\ncom = [\"2 * 9 ms\", 0, 0]\n"
    );
    let expected = "\
error[ODY0203]: expected a length, found a time
 --> test.toml:9:9
  |
9 | com = [\"2 * 9 ms\", 0, 0]
  |         ^^^^^^^^ this is a time
  |
  = help: plain numbers are taken in mm here

";
    assert_eq!(reject(&text).rendered(), expected);
}

#[test]
fn the_culprit_of_an_expression() {
    let text = with_parameter("", "\"2*(y.radius + 1 mm)\"");
    let expected = "\
error[ODY0208]: unknown parameter `y.radius`
 --> test.toml:4:9
  |
4 | x = \"2*(y.radius + 1 mm)\"
  |         ^^^^^^^^
  |
  = help: known parameters: `x`

";
    assert_eq!(reject(&text).rendered(), expected);
}

#[test]
fn a_name_given_twice_shows_both_places() {
    let text = format!("{SIMULATION}[[body]]\nname = \"a\"\nfixed = true\n[[body]]\nname = \"a\"\nfixed = true\n");
    let expected = "\
error[ODY0107]: the name `a` is given twice
 --> test.toml:8:8
  |
5 | name = \"a\"
  |        --- first given here
...
8 | name = \"a\"
  |        ^^^ given again here

";
    assert_eq!(reject(&text).rendered(), expected);
}

#[test]
fn a_missing_key_points_to_the_header() {
    let text = format!("{SIMULATION}[[joint]]\ntype = \"revolute\"\nbodies = [\"a\", \"b\"]\n");
    let expected = "\
error[ODY0104]: this joint has no `name`
 --> test.toml:4:1
  |
4 | [[joint]]
  | ^^^^^^^^^ `name` is missing here

";
    assert_eq!(reject(&text).rendered(), expected);
}

#[test]
fn letters_that_no_name_may_have_and_bodies_without_mass_have_the_remedy() {
    let of_body = |keys: &str| reject(&format!("{SIMULATION}[[body]]\n{keys}\n")).rendered();
    let name = of_body("name = \"Körper\"\nfixed = true");
    assert!(name.contains("letters from a to z, capital or not, digits, `_` and `-`, not blanks"), "{name}");
    let mass = of_body("name = \"a\"\ninertia = [1, 1, 1]");
    assert!(mass.contains("no `mass`") && mass.contains("`fixed = true`") && !mass.contains("particle"), "{mass}");
    let inertia = of_body("name = \"a\"\nmass = 1");
    assert!(inertia.contains("`fixed = true`") && inertia.contains("`particle = true`"), "{inertia}");
}

#[test]
fn a_mistake_on_the_command_line_is_shown_there() {
    let text = format!("[parameters]\ncrank.radius = \"8.5 mm\"\n{SIMULATION}max_step = \"crank.radius\"\n");
    let rejected = reject_with(&text, &["crank.radius = 9 parsec"]);
    let expected = "\
error[ODY0201]: unknown unit `parsec`
 --> command line:1:24
  |
1 | --set crank.radius = 9 parsec
  |                        ^^^^^^

";
    assert_eq!(rejected.rendered(), expected);
}

#[test]
fn several_syntax_errors_are_reported_together() {
    let rejected = reject("title = \n[simulation\nt_end = = 3\n");
    assert!(rejected.diagnostics.len() >= 3, "{}", rejected.rendered());
    assert!(rejected.codes().iter().all(|code| *code == codes::SYNTAX));
    for line in 1..=3 {
        let place = format!("--> test.toml:{line}:");
        assert!(rejected.rendered().contains(&place), "line {line}");
    }
}

#[test]
fn a_key_given_twice_has_its_own_code() {
    let rejected = reject("title = \"a\"\ntitle = \"b\"\n");
    assert_eq!(rejected.codes(), [codes::DUPLICATE_KEY]);
    assert!(rejected.rendered().contains("test.toml:2:1"));
}

#[test]
fn all_mistakes_are_collected_in_the_order_of_the_text() {
    let rejected = reject(
        r#"
titel = "x"
[units]
length = "mmm"
[parameters]
a = "b +"
[simulation]
t_end = -1
output_step = 0
[[body]]
name = "ground"
mass = "1 s"
inertia = [1, 2]
com = [0, inf, 0]
[[joint]]
name = "j j"
bodies = "rotor"
axis = [0, 0, 0]
"#,
    );
    let expected = [
        codes::UNKNOWN_KEY,
        codes::UNKNOWN_UNIT,
        codes::EXPRESSION_SYNTAX,
        codes::OUT_OF_RANGE,
        codes::OUT_OF_RANGE,
        codes::BAD_NAME,
        codes::DIMENSION,
        codes::WRONG_LENGTH,
        codes::NOT_FINITE,
        codes::MISSING_KEY,
        codes::BAD_NAME,
        codes::WRONG_TYPE,
        codes::NO_DIRECTION,
    ];
    assert_eq!(rejected.codes(), expected, "{}", rejected.rendered());
    assert_eq!(summary(&rejected.diagnostics), "13 errors");
}

#[test]
fn texts_with_escapes_are_pointed_to_as_a_whole() {
    let rejected = reject(&with_parameter("", "\"1 \\u0070arsec\""));
    assert_eq!(rejected.codes(), [codes::UNKNOWN_UNIT]);
    assert_eq!(rejected.culprit(), "\"1 \\u0070arsec\"");
    let rejected = reject(&with_parameter("", "\"\"\"1 parsec\"\"\""));
    assert_eq!(rejected.culprit(), "parsec");
    let rejected = reject(&with_parameter("", "'1 µm + 1 parsec'"));
    assert_eq!(rejected.culprit(), "parsec");
}
