//! What the test kit asks of every element; what does not apply says its `EXEMPT`.

use element_api::testkit::{check_control, check_force, check_joint};

use crate::{Deadbeat, Differential, Lag, Maxwell, ProgressiveSpring, Propeller, Rope, Shaker, Tether, Thermostat};

#[test]
fn joints() {
    check_joint::<Shaker>("amplitude = 0.1\nfrequency = 0.2");
    check_joint::<Differential>("");
    check_joint::<Tether>("length = 2.0\nrestitution = 0.5");
}

#[test]
fn forces() {
    check_force::<Maxwell>("stiffness = 20.0\ndamping = 3.0\nfree_length = 0.5");
    check_force::<ProgressiveSpring>("tension = [[-5, -9], [0, 0], [1, 2], [5, 20]]\nfree_length = 0.5");
    check_force::<Rope>("stiffness = 20.0\nfree_length = 0.5");
    check_force::<Deadbeat>("mass = 2.0\nstep = 0.1");
}

#[test]
fn the_force_of_the_air_comes_from_outside() {
    let params = "diameter = 0.5\nthrust_coefficient = 0.1\ntorque_coefficient = 0.05";
    check_force::<Propeller>(params);
    check_force::<Propeller>(&format!("{params}\nhand = 'left'"));
}

#[test]
fn controls() {
    check_control::<Lag>("time_constant = 0.1");
    check_control::<Thermostat>("low = -0.5\nhigh = 0.5");
}
