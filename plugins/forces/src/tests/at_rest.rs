//! Derivatives where lengths, angles and speeds vanish: coincident frames at rest, the place where most scenes start.

use element_api::testkit::{Options, Random, Setting, examine_force_with};
use element_api::{Force, Frame};

use crate::beam::Beam;
use crate::bump_stop::BumpStop;
use crate::bushing::Bushing;
use crate::drag::Drag;
use crate::field::Field;
use crate::joint_friction::JointFriction;
use crate::point_gravity::PointGravity;
use crate::rotational_actuator::RotationalActuator;
use crate::rotational_bump_stop::RotationalBumpStop;
use crate::rotational_spring_damper::RotationalSpringDamper;
use crate::translational_actuator::TranslationalActuator;
use crate::translational_spring_damper::TranslationalSpringDamper;

/// All checks, in settings with the second frame at `place` of the first, without motion, signals and reactions.
fn examine_at<T: Force>(params: &str, place: [f64; 3]) {
    let at_rest = |random: &mut Random| {
        let i = random.frame();
        Setting::at_rest(vec![i, Frame { position: i.point(place), ..i }])
    };
    examine_force_with::<T>(params, &Options { anywhere: Some(&at_rest), ..Options::default() }).assert_sound();
}

#[test]
fn everything_is_smooth_without_deformation_and_motion() {
    let origin = [0.0; 3];
    let beam =
        "length = 0.5\nyoung = 20.0\nshear = 8.0\narea = 3.0\niy = 2.0\niz = 3.0\ntorsion = 4.0\ndamping_time = 0.1";
    examine_at::<Beam>(beam, [0.5, 0.0, 0.0]);
    let bushing = "stiffness = [3, 5, 7]\nrotational_stiffness = [2, 4, 6]\nrotational_damping = [1, 2, 3]";
    examine_at::<Bushing>(bushing, origin);
    examine_at::<Field>("translation = [2, 0, 0, 0, 2, 0, 0, 0, 2]\ncoupling = [1, 2, 3, 4, 5, 6, 7, 8, 9]", origin);
    examine_at::<TranslationalSpringDamper>("stiffness = 3.0", origin);
    examine_at::<RotationalSpringDamper>("stiffness = 3.0\ndamping = 1.0\npreload = 1.0", origin);
    examine_at::<RotationalActuator>("of_time = 1.0\ngain = 2.0", origin);
    examine_at::<TranslationalActuator>("along = \"axis\"\nof_time = 1.0\ngain = 2.0", origin);
    examine_at::<Drag>("coefficient = 1.0\narea = 1.0", origin);
    for exponent in ["1.0", "1.5", "2.0"] {
        let stops = format!("lower = -1.0\nupper = 1.0\ndepth = 0.1\ndamping = 0.4\nexponent = {exponent}");
        examine_at::<BumpStop>(&format!("{stops}\nforce = 2.0"), origin);
        examine_at::<RotationalBumpStop>(&format!("{stops}\ntorque = 2.0"), origin);
    }
    for kind in ["kind = \"rotation\"\nradius = 0.1\nthrust_radius = 0.1", "kind = \"translation\"\nguide_length = 0.1"]
    {
        examine_at::<JointFriction>(&format!("{kind}\nmu = 0.1\nmu_static = 0.2\ntransition_speed = 0.1"), origin);
    }
}

#[test]
fn ends_of_line_elements_may_be_exchanged() {
    let options = Options { symmetric: Some(true), ..Options::default() };
    let spring = "stiffness = 30.0\ndamping = 4.0\nfree_length = 0.5\npreload = 1.5";
    examine_force_with::<TranslationalSpringDamper>(spring, &options).assert_sound();
    let actuator = "of_time = 3.0\nof_length = [[-5, 1], [5, 2]]";
    examine_force_with::<TranslationalActuator>(actuator, &options).assert_sound();
    examine_force_with::<PointGravity>("gravitational_parameter = 6.0\nmass = 2.0", &options).assert_sound();
}
