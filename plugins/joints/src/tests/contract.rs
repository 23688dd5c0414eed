//! What the test kit asks of every joint.

use element_api::Constraint;
use element_api::testkit::check_joint;

use crate::bracket::Bracket;
use crate::cam::Cam;
use crate::constant_velocity::ConstantVelocity;
use crate::coupler::Coupler;
use crate::cylindrical::Cylindrical;
use crate::displacement_driver::DisplacementDriver;
use crate::distance_rod::DistanceRod;
use crate::gear::Gear;
use crate::gear_backlash::GearBacklash;
use crate::ground::Ground;
use crate::knife_edge::KnifeEdge;
use crate::parallel_axes::ParallelAxes;
use crate::perpendicular_axes::PerpendicularAxes;
use crate::planar::Planar;
use crate::point::Point;
use crate::point_in_plane::PointInPlane;
use crate::point_on_curve::PointOnCurve;
use crate::point_on_line::PointOnLine;
use crate::position::Position;
use crate::profile_contact::ProfileContact;
use crate::rack_and_pinion::RackAndPinion;
use crate::rail_contact::RailContact;
use crate::revolute::Revolute;
use crate::rolling_disc::RollingDisc;
use crate::rope::Rope;
use crate::rotation_driver::RotationDriver;
use crate::screw::Screw;
use crate::servo_displacement::ServoDisplacement;
use crate::servo_rotation::ServoRotation;
use crate::spherical::Spherical;
use crate::stepper_rotation::StepperRotation;
use crate::translational::Translational;
use crate::universal::Universal;

#[test]
fn ground_and_bracket() {
    check_joint::<Ground>("");
    check_joint::<Bracket>("");
}

#[test]
fn rolling_and_blades() {
    check_joint::<KnifeEdge>("");
    check_joint::<RollingDisc>("radius = 0.3");
}

#[test]
fn servos() {
    check_joint::<ServoRotation>("frequency = 20.0\nangle = 0.4");
    check_joint::<ServoRotation>("frequency = 20.0\ndamping = 0.3\nrate_limit = 0.5\nstart = 0.2");
    check_joint::<ServoDisplacement>("frequency = 20.0\ndisplacement = 0.4");
    check_joint::<StepperRotation>("frequency = 20.0\nangle = 0.4\nstep = 0.1\nperiod = 0.05");
}

#[test]
fn profiles() {
    let wave = "radius = { postfix = [0.05, 0.005, 2, 'x', 'mul', 'cos', 'mul', 'add'] }";
    check_joint::<ProfileContact>(&format!("{wave}\nroller_radius = 0.01"));
    check_joint::<ProfileContact>(&format!("{wave}\nfollower = 'flat'\nstart = 0.3"));
    check_joint::<RailContact>(
        "height = { postfix = ['x', 'cos'] }\nfrom = -2.0\nto = 2.0\nwheel_radius = 0.1\nstart = 0.3",
    );
}

#[test]
fn gear_with_backlash() {
    check_joint::<GearBacklash>("teeth_1 = 20\nteeth_2 = 40\nplay = 0.1\nrestitution = 0.4");
    check_joint::<GearBacklash>("radius_1 = 0.1\nradius_2 = 0.2\ninternal = true\nplay = 0.1");
}

#[test]
fn revolute() {
    check_joint::<Revolute>("");
}

#[test]
fn cylindrical() {
    check_joint::<Cylindrical>("");
}

#[test]
fn translational() {
    check_joint::<Translational>("");
}

#[test]
fn spherical() {
    check_joint::<Spherical>("");
}

#[test]
fn universal() {
    check_joint::<Universal>("");
}

#[test]
fn planar() {
    check_joint::<Planar>("");
}

#[test]
fn constant_velocity() {
    check_joint::<ConstantVelocity>("");
}

#[test]
fn parallel_and_perpendicular_axes() {
    check_joint::<ParallelAxes>("");
    check_joint::<PerpendicularAxes>("");
}

#[test]
fn screw() {
    for params in ["pitch = 0.7", "pitch = -2.0", "pitch = 0.0"] {
        check_joint::<Screw>(params);
    }
}

#[test]
fn point() {
    for directions in ["x", "y", "z", "xy", "xz", "yz", "xyz"] {
        check_joint::<Point>(&format!("directions = '{directions}'"));
    }
}

#[test]
fn point_in_plane_and_point_on_line() {
    check_joint::<PointInPlane>("");
    check_joint::<PointInPlane>("distance = -0.3");
    check_joint::<PointOnLine>("");
}

#[test]
fn distance_rod() {
    for params in ["length = 0.2", "length = 3.0"] {
        check_joint::<DistanceRod>(params);
    }
}

#[test]
fn rope() {
    for params in
        ["", "'#frames' = 3", "'#frames' = 7", "slack = true\n'#frames' = 4", "slack = true\nrestitution = 0.5"]
    {
        check_joint::<Rope>(&format!("length = 6.0\n{params}"));
    }
}

#[test]
fn gear() {
    for params in
        ["radius_1 = 0.1\nradius_2 = 0.3", "teeth_1 = 40\nteeth_2 = 17", "teeth_1 = 20\nteeth_2 = 30\ninternal = true"]
    {
        check_joint::<Gear>(params);
    }
}

#[test]
fn rack_and_pinion() {
    check_joint::<RackAndPinion>("radius = 1.5");
}

#[test]
fn coupler() {
    for params in [
        "ratio = -0.6",
        "ratio = 3.0\nangle_offset = 0.2",
        "first = 'translation'\nsecond = 'translation'\nratio = 2.0\ndisplacement_offset = 0.1",
        "second = 'translation'\nlead = 0.5\ndisplacement_offset = -1.0",
        "first = 'translation'\nlead = -0.8",
    ] {
        check_joint::<Coupler>(params);
    }
}

#[test]
fn drivers() {
    // 0.3 t^2 - 1 and 2 sin 3 t.
    for function in
        ["1.5", "{ postfix = ['x', 2, 'pow', 0.3, 'mul', 1, 'sub'] }", "{ postfix = [2, 'x', 3, 'mul', 'sin', 'mul'] }"]
    {
        check_joint::<RotationDriver>(&format!("angle = {function}"));
        check_joint::<DisplacementDriver>(&format!("displacement = {function}"));
    }
}

#[test]
fn position() {
    let moving = "{ postfix = ['x', 3, 'mul', 'sin'] }";
    for params in [
        "z = 0.3".to_owned(),
        format!("x = {moving}\ny = 1.0"),
        format!("about_x = {moving}"),
        format!("about_y = {moving}"),
        format!("z = {moving}\nabout_z = {moving}"),
        format!("about_x = 0.0\nabout_z = {moving}"),
        format!("x = 0\ny = 0\nz = {moving}\nabout_x = {moving}\nabout_y = 0.4\nabout_z = {moving}"),
    ] {
        check_joint::<Position>(&params);
    }
}

/// 1 + 0.05 cos 2 phi.
const OVAL: &str = "radius = { postfix = [1, 0.05, 2, 'x', 'mul', 'cos', 'mul', 'add'] }";

#[test]
fn cam() {
    check_joint::<Cam>("radius = 0.5");
    check_joint::<Cam>(OVAL);
    check_joint::<Cam>(&format!("{OVAL}\nplanar = false"));
}

#[test]
fn point_on_curve() {
    for params in ["height = 0.3", "height = { postfix = ['x', 2, 'mul', 'sin'] }", "height = 0.3\nplanar = false"] {
        check_joint::<PointOnCurve>(params);
    }
}

#[test]
fn rows_and_mobility_add_up_to_six() {
    fn check<T: Constraint>() {
        let freedoms = T::MOBILITY.expect("offered") + if T::TURNS_FREELY { 3 } else { 0 };
        assert_eq!(T::ROWS.len() + freedoms, 6, "{}", T::NAME);
    }
    check::<Ground>();
    check::<Bracket>();
    check::<Revolute>();
    check::<Cylindrical>();
    check::<Translational>();
    check::<Universal>();
    check::<Planar>();
    check::<Screw>();
    check::<Spherical>();
    check::<PointOnLine>();
    check::<PointInPlane>();
}

#[test]
fn every_joint_has_a_manual_page_with_an_example() {
    for class in crate::library().classes {
        let page = element_api::documentation::manual_page(&class.descriptor().doc);
        let name = &class.descriptor().name;
        let places: Vec<usize> = ["## Equations", "## Signs", "## Singular cases", "## Example"]
            .iter()
            .map(|title| page.find(title).unwrap_or_else(|| panic!("{name}: no `{title}`")))
            .collect();
        assert!(places.is_sorted(), "{name}: the sections are in another order");
        let scenes = element_api::documentation::scenes_of(&page);
        assert_eq!(scenes.len(), 1, "{name}: one example");
        assert!(scenes[0].contains(&format!("type = \"{name}\"")), "{name}: the example is about something else");
    }
}
