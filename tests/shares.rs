//! Reactions that are shared: by redundant joints, and by parts of the ground.

use std::collections::BTreeSet;

use odyn::analyses::place::{At, place};
use odyn::session::{Restart, RunReport, Session};

use crate::contacts::run;
use crate::support::{Scratch, column, leg, open_text, options};

fn not_unique(report: &RunReport) -> BTreeSet<&str> {
    report.summary.not_unique.iter().map(String::as_str).collect()
}

/// A beam that is clamped at one end and has a ball joint at its centre of mass.
const PROPPED: &str = r#"
[plugins]
libraries = ["joints"]
[simulation]
gravity = [0, 0, -10]
t_end = 0.1
output_step = 0.1
[[body]]
name = "beam"
mass = 1
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "clamp"
type = "bracket"
bodies = ["ground", "beam"]
point = [-1, 0, 0]
[[joint]]
name = "prop"
type = "spherical"
bodies = ["ground", "beam"]
point = [0, 0, 0]
[[output]]
name = "clamp_on_ground"
quantity = "reaction_torque"
of = "clamp"
on = "ground"
component = "y"
[[output]]
name = "clamp_on_beam"
quantity = "reaction_torque"
of = "clamp"
on = "beam"
component = "y"
[[output]]
name = "prop_on_ground"
quantity = "reaction_torque"
of = "prop"
on = "ground"
component = "y"
"#;

/// Moments on the ground are about the origin of the frame there, wherever the centre of mass of the body is.
#[test]
fn a_moment_on_the_ground_is_as_open_as_that_on_the_body() {
    let clamped = BTreeSet::from(["clamp_on_beam", "clamp_on_ground"]);
    assert_eq!(not_unique(&run(PROPPED, &[])), clamped);
    // A ball bears no moment, whatever it shares.
    let off = PROPPED.replace("point = [0, 0, 0]", "point = [0.5, 0, 0]");
    assert_eq!(not_unique(&run(&off, &[])), clamped);
}

/// A planar four-bar linkage on a frame that a motor turns about an axis in its plane.
fn tilted(angle: &str) -> String {
    let mut text = format!(
        r#"
[plugins]
libraries = ["joints"]
[simulation]
gravity = [0, 0, -10]
t_end = 1
output_step = 0.5
[[joint]]
name = "tilt"
type = "revolute"
bodies = ["ground", "frame"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[joint]]
name = "motor"
type = "rotation-driver"
bodies = ["ground", "frame"]
point = [0, 0, 0]
axis = [1, 0, 0]
params.angle = "{angle}"
"#
    );
    for (name, place) in [("frame", [0.0, 0.0]), ("a", [0.2, 0.5]), ("b", [1.0, 1.0]), ("c", [1.8, 0.5])] {
        text += &format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [{}, {}, 0]\n",
            place[0], place[1]
        );
        text += "velocity = [\"free\", \"free\", \"free\"]\nangular_velocity = [\"free\", \"free\", \"free\"]\n";
    }
    for (name, i, j, point) in [
        ("A", "frame", "a", [0.0, 0.0]),
        ("B", "a", "b", [0.4, 1.0]),
        ("C", "b", "c", [1.6, 1.0]),
        ("D", "c", "frame", [2.0, 0.0]),
    ] {
        text += &format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nbodies = [\"{i}\", \"{j}\"]\npoint = [{}, {}, 0]\n",
            point[0], point[1]
        );
    }
    for quantity in ["force", "torque"] {
        for component in ["x", "y", "z"] {
            text += &format!(
                "[[output]]\nname = \"{quantity}_{component}\"\nquantity = \"reaction_{quantity}\"\nof = \"D\"\non = \"c\"\ncomponent = \"{component}\"\n"
            );
        }
    }
    text
}

/// What is open is along the hinges, and turns with them: components that are unique at the start are not later.
#[test]
fn what_is_open_turns_with_the_bodies() {
    for angle in ["0.5 * pi * t", "0.3 * pi * t^2"] {
        let text = tilted(angle);
        let [joint, cartesian] =
            ["joint", "cartesian"].map(|name| run(&text, &[&format!("simulation.formulation={name}")]));
        let open = BTreeSet::from(["force_y", "force_z", "torque_x", "torque_y", "torque_z"]);
        assert_eq!((not_unique(&joint), not_unique(&cartesian)), (open.clone(), open), "{angle}");
        let apart = |name: &str| (column(&joint, name)[1] - column(&cartesian, name)[1]).abs();
        assert!(apart("force_y") > 0.1 && apart("torque_z") > 0.1 && apart("force_x") < 1e-8, "{angle}");
    }
    // At rest, and in its own plane, it is as it was.
    let still = run(&tilted("0"), &[]);
    assert_eq!(not_unique(&still), BTreeSet::from(["force_z", "torque_x", "torque_y"]));
}

/// Two weights on guides of their own, with a rope between them.
const GUIDES: &str = r#"
[plugins]
libraries = ["joints"]
[simulation]
gravity = [0, 0, -10]
t_end = 0.1
output_step = 0.1
[[body]]
name = "wall"
fixed = true
position = [1, 0, 0]
[[body]]
name = "left"
mass = 1
inertia = [0.1, 0.1, 0.1]
[[body]]
name = "right"
mass = 3
inertia = [0.1, 0.1, 0.1]
position = [1, 0, 0]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "left"]
[[joint]]
name = "rail"
type = "translational"
bodies = ["wall", "right"]
point = [1, 0, 0]
[[joint]]
name = "rope"
type = "coupler"
bodies = ["ground", "left", "wall", "right"]
points = [[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0]]
params = { first = "translation", second = "translation", ratio = -1.0 }
[[output]]
name = "load"
quantity = "reaction_force"
of = "rope"
on = "ground"
component = "z"
"#;

/// Fixed bodies are parts of the ground, and what an element does to several of them is known as a whole only.
#[test]
fn the_load_on_a_fixed_body_is_that_of_elements_that_take_hold_of_it_alone() {
    let open = |of: &str, on: &str| {
        let text = GUIDES
            .replace("of = \"rope\"", &format!("of = \"{of}\""))
            .replace("on = \"ground\"", &format!("on = \"{on}\""));
        let scratch = Scratch::new();
        Session::open(&scratch.file("scene.toml", text), &options(&[], &[]))
            .map(|_| ())
            .map_err(|error| error.to_string())
    };
    for (of, on) in [("rope", "ground"), ("rope", "left"), ("rail", "wall"), ("rail", "ground"), ("guide", "ground")] {
        assert_eq!(open(of, on), Ok(()), "{of} on {on}");
    }
    let stranger = open("guide", "wall").unwrap_err();
    assert!(stranger.contains("ODY0316") && stranger.contains("does not act on `wall`"), "{stranger}");
    let several = open("rope", "wall").unwrap_err();
    assert!(several.contains("ODY0316") && several.contains("and of other fixed bodies"), "{several}");
    let both = run(GUIDES, &[]);
    assert!(column(&both, "load").iter().all(|load| (load + 30.0).abs() < 1e-9), "{:?}", column(&both, "load"));
}

/// What is looked at may be the end of a run that has come to the scene's end; a run does not continue from there.
#[test]
fn the_end_of_a_run_is_a_place_to_look_at() {
    let scratch = Scratch::new();
    scratch.file("scene.toml", PROPPED);
    leg(&scratch, "simulation.t_end=0.1", "run", None);
    let state = || Restart::read(&scratch.path().join("run")).unwrap();
    let mut session = open_text(PROPPED, &[]);
    assert!(session.stand_at(state()).is_ok());
    let error = session.go_on_from(state()).unwrap_err().to_string();
    assert!(error.contains("ODY0804"), "{error}");
    let open = || {
        let mut session = open_text(PROPPED, &[]);
        session.stand_at(state())?;
        Ok(session)
    };
    let instant = place(&open, At::Start, &mut |_| ()).unwrap_or_else(|error| panic!("{error}")).instant;
    assert!((instant.time - 0.1).abs() < 1e-15, "{}", instant.time);
}
