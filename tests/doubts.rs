//! What is valid and most probably not meant is warned of, what a run could not know before at its end; and the same scene as it is meant is not.

use odyn::diagnostics::codes;
use odyn::results::{Status, Summary};
use odyn::session::Session;

use crate::support::open_text;

/// The codes of what is said of a scene before it runs.
fn said(text: &str) -> Vec<&'static str> {
    open_text(text, &[]).warnings.iter().map(|warning| warning.code.code).collect()
}

fn run(text: &str, sets: &[&str]) -> Summary {
    let session: Session = open_text(text, sets);
    session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}")).summary
}

fn found(summary: &Summary, code: odyn::diagnostics::Code) -> Vec<&String> {
    summary.warnings.iter().filter(|text| text.starts_with(code.code)).collect()
}

/// A pendulum of 1 m about this axis with this gravity, and what follows.
fn pendulum(axis: &str, gravity: &str, more: &str) -> String {
    format!(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\nt_end = 1\noutput_step = 0.1\ngravity = {gravity}\n\
         [[body]]\nname = \"bob\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\nposition = [1, 0, 0]\n\
         [[joint]]\nname = \"hinge\"\ntype = \"revolute\"\nbodies = [\"ground\", \"bob\"]\npoint = [0, 0, 0]\n{axis}\n\
         [[output]]\nname = \"angle\"\nquantity = \"coordinate\"\nof = \"hinge\"\n{more}"
    )
}

const Y: &str = "axis = [0, 1, 0]";
const EARTH: &str = "[0, 0, -9.81]";

#[test]
fn mass_that_elements_bring_has_no_weight_unless_they_are_given_gravity() {
    let mass = |keys: &str| {
        pendulum(
            Y,
            EARTH,
            &format!("[[force]]\nname = \"load\"\ntype = \"added-mass\"\nbodies = [\"bob\"]\nparams = {{ {keys} }}\n"),
        )
    };
    assert_eq!(said(&mass("mass = 5")), [codes::WEIGHTLESS.code]);
    for keys in ["mass = 5, gravity = [0, 0, -9.81]", "mass = 5, gravity = [0, 0, 0]", "apparent_mass = [1, 1, 1]"] {
        assert_eq!(said(&mass(keys)), [] as [&str; 0], "{keys}");
    }
    assert_eq!(said(&mass("mass = 5").replace(EARTH, "[0, 0, 0]")), [] as [&str; 0]);
}

#[test]
fn a_body_that_nothing_holds_falls_and_an_inertia_of_another_unit_stands() {
    let hook = "[[body]]\nname = \"hook\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [1, 0, 1]\n";
    assert_eq!(said(&pendulum(Y, EARTH, hook)), [codes::LOOSE_BODY.code]);
    let held = format!(
        "{hook}[[joint]]\nname = \"weld\"\ntype = \"bracket\"\nbodies = [\"bob\", \"hook\"]\npoint = [1, 0, 0]\n"
    );
    assert_eq!(said(&pendulum(Y, EARTH, &held)), [] as [&str; 0]);
    assert_eq!(said(&pendulum(Y, "[0, 0, 0]", hook)), [] as [&str; 0]);
    let of = |inertia: &str| said(&pendulum(Y, EARTH, "").replace("[0.1, 0.1, 0.1]", inertia));
    assert_eq!(of("[4000, 4000, 4000]"), [codes::OTHER_UNIT.code]);
    assert_eq!(of("[400, 400, 400]"), [] as [&str; 0]);
    assert_eq!(of("[\"4000 g mm^2\", \"4000 g mm^2\", \"4000 g mm^2\"]"), [] as [&str; 0]);
}

#[test]
fn a_joint_beside_a_particle_is_warned_of() {
    let of_particle = |point: &str| {
        said(
            &pendulum(Y, EARTH, "")
                .replace("inertia = [0.1, 0.1, 0.1]", "particle = true")
                .replace("point = [0, 0, 0]", point),
        )
    };
    assert_eq!(of_particle("point = [0, 0, 0]"), [codes::TORQUE_ON_PARTICLE.code]);
    assert_eq!(of_particle("point = [1, 0, 0]"), [] as [&str; 0]);
}

#[test]
fn a_run_in_which_nothing_moved_says_so() {
    for (axis, gravity) in [("", EARTH), (Y, "[0, 0, 0]"), (Y, "[0, -9.81, 0]"), (Y, "[9.81, 0, 0]")] {
        for formulation in ["joint", "cartesian"] {
            let summary = run(&pendulum(axis, gravity, ""), &[&format!("simulation.formulation={formulation}")]);
            assert_eq!(summary.status, Status::Completed);
            assert_eq!(found(&summary, codes::NOTHING_MOVED).len(), 1, "{axis} {gravity} {:?}", summary.warnings);
        }
    }
    let moves = run(&pendulum(Y, EARTH, ""), &[]);
    assert_eq!(found(&moves, codes::NOTHING_MOVED).len(), 0);
    // Half a nanometre, as all that falls for so short.
    let short = run(&pendulum(Y, EARTH, ""), &["simulation.t_end=1e-5", "simulation.output_step=1e-6"]);
    assert_eq!(found(&short, codes::NOTHING_MOVED).len(), 0, "{:?}", short.warnings);
    // What drives back to where it began, and what cannot move.
    let spun = pendulum(Y, "[0, 0, 0]", "").replace(
        "position",
        "angular_velocity = [0, 6.283185307179586, 0]\nvelocity = [0, 0, -6.283185307179586]\nposition",
    );
    assert_eq!(found(&run(&spun, &[]), codes::NOTHING_MOVED).len(), 0);
    let held = pendulum(
        Y,
        EARTH,
        "[[joint]]\nname = \"pin\"\ntype = \"bracket\"\nbodies = [\"ground\", \"bob\"]\npoint = [0, 0, 0]\n",
    );
    assert_eq!(found(&run(&held, &[]), codes::NOTHING_MOVED).len(), 0);
}

#[test]
fn a_characteristic_that_a_motor_leaves_is_warned_of_unless_it_ends_level() {
    let motor = |points: &str| {
        let keys = format!("params.of_speed = {{ points = {points}, interpolation = \"linear\" }}");
        pendulum(
            Y,
            "[0, 0, 0]",
            &format!(
                "[[force]]\nname = \"motor\"\ntype = \"rotational-actuator\"\nbodies = [\"ground\", \"bob\"]\n{Y}\n{keys}\n"
            ),
        )
    };
    let left = run(&motor("[[0, 20], [5, 10]]"), &["simulation.t_end=2"]);
    let said = found(&left, codes::LEFT_GRID);
    assert!(said.len() == 1 && said[0].contains("the values of `of_speed` end at 0 and 5 rad/s"), "{said:?}");
    for points in ["[[0, 20], [50, 10]]", "[[-1, 20], [0, 20], [5, 10], [6, 10]]"] {
        assert_eq!(
            found(&run(&motor(points), &["simulation.t_end=2"]), codes::LEFT_GRID),
            [] as [&String; 0],
            "{points}"
        );
    }
}

/// The energy of an undamped oscillator that a loose tolerance lets die: however loose, that is no result.
#[test]
fn a_balance_of_energy_that_is_off_by_more_than_a_hundredth_is_suspect_at_any_tolerance() {
    let spring = "[[force]]\nname = \"spring\"\ntype = \"rotational-spring-damper\"\nbodies = [\"ground\", \"bob\"]\naxis = [0, 1, 0]\n\
                  params = { stiffness = 800, free_angle = 0.3 }\n";
    let text = pendulum(Y, "[0, 0, 0]", spring);
    let summary = run(
        &text,
        &["simulation.t_end=500", "simulation.output_step=50", "simulation.tolerance=1e-2", "simulation.method=radau5"],
    );
    assert_eq!(summary.status, Status::Suspect);
    assert_eq!(run(&text, &["simulation.t_end=5", "simulation.tolerance=1e-5"]).status, Status::Completed);
}
