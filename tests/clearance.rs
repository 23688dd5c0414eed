//! Joints with clearance: a pin in a hollow that is wider by next to nothing, in the slider-crank of the literature (Flores & Ambrosio,
//! "Kinematics and Dynamics of Multibody Systems with Imperfect Joints", 2008).

use crate::contacts::{every_way_agrees, run};
use crate::support::column;

/// A crank turned at 600 rpm, whose rod has its pin in the slider with a clearance; at the start the pin is in the middle.
const CRANK: &str = r#"
[plugins]
libraries = ["odyn-joints"]

[simulation]
gravity = [0, -9.81, 0]
tolerance = 1e-10
t_end = 0.02
output_step = 0.0002

[parameters]
clearance = 5e-4
e = 0
w = "20 * pi"

[[body]]
name = "crank"
mass = 0.3
inertia = [1e-4, 1e-4, 1e-4]
com = [0.025, 0, 0]
angular_velocity = [0, 0, "w"]

[[body]]
name = "rod"
mass = 0.21
inertia = [1e-4, 1e-4, 1e-4]
position = [0.05, 0, 0]
com = [0.06, 0, 0]
velocity = ["free", "free", "free"]
angular_velocity = [0, 0, "free"]

[[body]]
name = "slider"
mass = 0.14
inertia = [1e-4, 1e-4, 1e-4]
position = [0.17, 0, 0]

[[joint]]
name = "shaft"
type = "revolute"
bodies = ["ground", "crank"]
axis = [0, 0, 1]

[[joint]]
name = "motor"
type = "rotation-driver"
bodies = ["ground", "crank"]
axis = [0, 0, 1]
params.angle = "w * t"

[[joint]]
name = "crank_pin"
type = "revolute"
bodies = ["crank", "rod"]
point = [0.05, 0, 0]
axis = [0, 0, 1]

[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "slider"]
point = [0.17, 0, 0]
axis = [1, 0, 0]

[[joint]]
name = "pin"
type = "ball-contact"
bodies = ["slider", "rod"]
frames = [{ position = [0, 0, 0] }, { position = [0.12, 0, 0] }]
params.radius_i = "0.01 + clearance"
params.radius_j = 0.01
params.inside = true
params.restitution = "e"

[[output]]
name = "x"
quantity = "position"
of = "slider"
component = "x"

[[output]]
name = "v"
quantity = "velocity"
of = "slider"
component = "x"
"#;

#[test]
fn a_slider_crank_with_clearance_is_the_same_in_every_way() {
    let report = every_way_agrees(CRANK, 1e-6);
    // The row of a pin in the middle has no gradient; nothing is judged by that one when it has gone to the wall.
    assert!(report.summary.audit.impacts > 0);
    every_way_agrees(&CRANK.replace("e = 0\n", "e = 0.5\n"), 1e-6);
}

#[test]
fn friction_in_a_small_clearance_is_proved_to_be_watched() {
    let rubbing = CRANK.replace("params.inside = true", "params.inside = true\nparams.mu = 0.1");
    for clearance in ["1e-4", "1e-5"] {
        let report = run(&rubbing, &[&format!("parameters.clearance={clearance}")]);
        let summary = &report.summary;
        // The way of the pin in the hollow is the difference of two that are a thousand times as long: by values alone a fourth of the steps
        // and more is left unproven.
        assert!(summary.enclosures > 100 && 20 * summary.unproven < summary.enclosures, "{summary:?}");
    }
}

/// A disc falls from the very middle of a ring that is a decimetre wider.
const DISC: &str = r#"
[plugins]
libraries = ["odyn-joints"]

[simulation]
gravity = [0, -9.81, 0]
t_end = 0.1
output_step = 0.01

[[body]]
name = "disc"
mass = 1
inertia = [0.005, 0.005, 0.01]

[[joint]]
name = "ring"
type = "ball-contact"
bodies = ["ground", "disc"]
frames = [{ position = [0, 0, 0] }, { position = [0, 0, 0] }]
params.radius_i = 0.2
params.radius_j = 0.1
params.inside = true

[[output]]
name = "load"
quantity = "reaction_force"
of = "ring"
component = "magnitude"

[[output]]
name = "torque"
quantity = "reaction_torque"
of = "ring"
component = "z"
"#;

#[test]
fn what_floats_in_the_middle_of_its_hollow_has_no_load_with_friction_either() {
    for friction in ["", "params.mu = 0.05", "params.rough = true"] {
        let text = DISC.replace("params.inside = true", &format!("params.inside = true\n{friction}"));
        for formulation in ["joint", "cartesian"] {
            let report = run(&text, &[&format!("simulation.formulation=\"{formulation}\"")]);
            for name in ["load", "torque"] {
                let values = column(&report, name);
                assert!(values.len() == 11 && values.iter().all(|value| *value == 0.0), "{friction}: {values:?}");
            }
        }
    }
}
