//! What is no TOML: the remedy of each slip that newcomers make.

use super::*;

/// The remedies for a line in place of a mass.
fn remedies(line: &str) -> Vec<String> {
    let text = format!("{SIMULATION}\n[[body]]\nname = \"rod\"\n{line}\n");
    reject(&text).diagnostics.into_iter().flat_map(|one| one.help).collect()
}

#[test]
fn every_slip_has_its_remedy() {
    for (line, remedy) in [
        ("mass = .1", "`0.1`"),
        ("mass = -.1", "`-0.1`"),
        ("mass = 1.", "`1.0`"),
        ("mass = 1.e3", "`1.0e3`"),
        ("com = [0, 1., 2]", "`1.0`"),
        ("mass = 01.5", "`1.5`"),
        ("mass = 1,5", "`1.5`"),
        ("mass = 1 000", "`1000`"),
        ("mass = 1e", "exponent"),
        ("mass = 1.0 kg", "`\"1.0 kg\"`"),
        ("mass = 2*length", "`\"2*length\"`"),
        ("mass = 1/2", "`\"1/2\"`"),
        ("mass = 1.0 // kg", "a remark begins with `#`"),
        ("mass = 1.0;", "`mass = 1.0`"),
        ("mass: 1.0", "`mass = 1.0`"),
        ("mass == 1.0", "`mass = 1.0`"),
        ("mass =", "a value behind the `=`"),
        ("fixed = True", "`true`"),
        ("fixed = yes", "`true`"),
        ("fixed = No", "`false`"),
        ("mass = None", "leave the key out"),
        ("com = (0.5, 0, 0)", "square brackets"),
        ("com = [0.5 0 0]", "between commas"),
        ("com = [0; 0; 1]", "between commas"),
        ("mass = \u{2212}9.81", "the minus sign is `-`"),
        ("text = \u{201c}rod\u{201d}", "straight quotes"),
        ("mass\u{a0}= 1.0", "space bar"),
        ("text = rod", "`\"rod\"`"),
        ("text = \"rod", "a text ends with the quote"),
        ("text = \"C:\\Users\"", "write `/` between folders"),
        ("com = [0, 0, 1\n[[joint]]", "a `]` is missing"),
        ("[[joint]", "`[[joint]]`"),
        ("name = \"again\"", "remove one of the two"),
        ("[simulation]\nt_end = 2", "`[simulation]` stands once"),
        ("orientation = {axis=[0,1,0], angle = 30\u{b0}}", "`\"30\u{b0}\"`"),
    ] {
        let found = remedies(line);
        assert!(found.iter().any(|help| help.contains(remedy)), "{line}: {found:?}");
    }
}

#[test]
fn a_key_that_stands_in_another_table_is_sent_there() {
    let help = |text: &str| reject(text).diagnostics.into_iter().flat_map(|one| one.help).collect::<Vec<_>>();
    assert_eq!(help(&format!("gravity = [0, 0, -9.81]\n{SIMULATION}")), ["`gravity` is a key of `[simulation]`"]);
    assert_eq!(help(&format!("{SIMULATION}\nlibraries = [\"joints\"]\n")), ["`libraries` is a key of `[plugins]`"]);
    assert_eq!(
        remedies("mass = 1\ninertia = [1, 1, 1]\ntolerance = 1e-6")[0].matches("`tolerance` is a key of").count(),
        0
    );
    assert_eq!(remedies("mass = 1\ninertia = [1, 1, 1]\nt_end = 1"), ["`t_end` is a key of `[simulation]`"]);
}

#[test]
fn one_point_in_a_list_is_none_for_two_bodies() {
    let text = |points: &str| {
        format!("{SIMULATION}\n[[force]]\nname = \"f\"\ntype = \"spring\"\nbodies = [\"ground\", \"a\"]\n{points}\n")
    };
    for (many, one) in [("points", "point"), ("axes", "axis"), ("x_axes", "x_axis")] {
        let rejected = reject(&text(&format!("{many} = [[0, 1, 0]]")));
        assert_eq!(rejected.codes(), [codes::BAD_PLACEMENT], "{many}");
        assert!(rejected.rendered().contains(&format!("`{one}` is the key of one vector for all frames")));
        accept(&text(&format!("{many} = [[0, 1, 0], [0, 1, 0]]")));
        accept(&text(&format!("{one} = [0, 1, 0]")));
    }
}
