//! Elements with kinetic energy.

use element_api::testkit::{self, Probe, Random, Setting};
use element_api::{Frame, Vec3};

use super::{ground, two_frames_anywhere};
use crate::added_mass::AddedMass;
use crate::inerter::Inerter;
use crate::modal_body::ModalBody;
use crate::rotational_inerter::RotationalInerter;

#[test]
fn an_inerter_fulfils_the_contract() {
    let options = testkit::Options { anywhere: Some(&two_frames_anywhere), ..testkit::Options::default() };
    testkit::examine_force_with::<Inerter>("inertance = 3.0", &options).assert_sound();
    testkit::examine_force_with::<Inerter>("inertance = 3.0\nguided = true", &options).assert_sound();
}

#[test]
fn a_rotational_inerter_fulfils_the_contract() {
    testkit::check_force::<RotationalInerter>("inertance = 3.0");
}

#[test]
fn an_added_mass_fulfils_the_contract() {
    for params in ["mass = 2.0", "apparent_mass = [1.0, 2.0, 3.0]\ninertia = [0.1, 0.2, 0.3]"] {
        testkit::check_force::<AddedMass>(params);
    }
}

/// Two ends of a rod of 3 kg and 2 m along x, and a mode along y that takes them along.
const ROD: &str = "
    '#frames' = 2
    points = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0]
    matrices = [
        1, 1, 1, 1e2, 7, 1, 0.5, -1e2, 7, 7, 1, 1e2,
        2, 2, 1, 30, 8, 2, 0.5, -30, 8, 8, 1, 30,
        6, 2, 0, 30, 12, 2, 0, 30, 8, 6, 0, -30, 12, 8, 0, -30, 6, 6, 0.1, 40, 12, 6, 0, 20, 12, 12, 0.1, 40,
        3, 3, 1, 0, 9, 3, 0.5, 0, 9, 9, 1, 0,
        13, 2, 0.2, 0, 13, 8, 0.2, 0, 13, 13, 1, 50,
    ]
";

fn bent(random: &mut Random) -> Setting {
    let first = random.frame();
    let turn = element_api::testkit::turn(random.vector(0.05));
    let far = first.position + first.rotation * (Vec3::new(2.0, 0.0, 0.0) + random.vector(0.1));
    let mut setting = Setting::at_rest(vec![first, Frame { position: far, rotation: first.rotation * turn }]);
    setting.twists = vec![random.twist(), random.twist()];
    setting.states = vec![random.between(-0.1, 0.1), random.between(-1.0, 1.0)];
    setting
}

#[test]
fn a_modal_body_fulfils_the_contract() {
    let options = testkit::Options { anywhere: Some(&bent), ..testkit::Options::default() };
    testkit::examine_force_with::<ModalBody>(ROD, &options).assert_sound();
    testkit::examine_force_with::<ModalBody>(&format!("{ROD}\ndamping = 0.1"), &options).assert_sound();
    let stiffened = format!(
        "{ROD}\ngeometric = [7, 7, 0.3, 0.1, 0, 0, 0.2, 0.2, 0.1, 0, 0, 8, 8, 1, 0, 0.2, 0.1, 0.3, 0.4, 0, 0.1, 0.2, \
         13, 8, 0.2, 0, 0, 0, 0.1, 0, 0.1, 0, 0.3, 13, 13, 2, 0.5, 1, 0, 1, 1, 0.2, 0.3, 0.1]"
    );
    testkit::examine_force_with::<ModalBody>(&stiffened, &options).assert_sound();
    let heavy = testkit::Options { internal: false, invariant: false, ..options };
    testkit::examine_force_with::<ModalBody>(&format!("{stiffened}\ngravity = [1.0, -2.0, 3.0]"), &heavy)
        .assert_sound();
    testkit::examine_force_with::<ModalBody>(&format!("{ROD}\ngravity = [1.0, -2.0, 3.0]"), &heavy).assert_sound();
}

#[test]
fn a_modal_body_that_is_not_deformed_is_a_rigid_one() {
    let probe = Probe::force::<ModalBody>(&format!("{ROD}\ngravity = [0.0, 0.0, -10.0]")).expect("it is sound");
    let far = Frame { position: Vec3::new(2.0, 0.0, 0.0), ..ground() };
    let mut setting = Setting::at_rest(vec![ground(), far]);
    setting.states = vec![0.0, 0.0];
    let found = probe.force_values(&setting);
    // 3 kg, its centre in the middle.
    let force = found.forces[0] + found.forces[1];
    let moment = found.torques[0] + found.torques[1] + Vec3::new(2.0, 0.0, 0.0).cross(&found.forces[1]);
    assert!((force - Vec3::new(0.0, 0.0, -30.0)).norm() < 1e-12, "{force}");
    assert!((moment - Vec3::new(0.0, 30.0, 0.0)).norm() < 1e-12, "{moment}");
    assert!(found.potential.unwrap_or(f64::NAN).abs() < 1e-12);
}

#[test]
fn matrices_that_are_none_of_a_body_are_refused() {
    for (from, to, expected) in [
        ("2.0, 0.0, 0.0]", "2.0, 0.1, 0.0]", "the stiffness resists a rigid motion about z"),
        ("2.0, 0.0, 0.0]", "2.0, 0.0]", "needs three numbers per interface, found 5"),
        ("3, 3, 1, 0,", "3, 3, 2, 0,", "the mass of a rigid body is the same in all directions"),
        ("13, 8, 0.2, 0, 13, 13, 1, 50", "13, 8, 0.2, 1, 13, 13, 1, 1e9", "resists a rigid motion along y in row 13"),
        ("13, 13, 1, 50", "13, 13, 1, -50", "the stiffness gives negative energy"),
        ("13, 13, 1, 50", "13, 13, 1", "needs row, column, mass, stiffness of each entry"),
        ("13, 13, 1, 50", "13, 13.5, 1, 50", "row and column are whole numbers from 1"),
        ("13, 13, 1, 50", "2, 1, 1, 50, 1, 2, 1, 50", "has the entry 2, 1 twice"),
        ("'#frames' = 2", "'#frames' = 3", "are 3, `points` has 2 interfaces"),
        ("points", "amplitudes = [1.0, 2.0]\npoints", "needs 1 numbers, one per mode; found 2"),
    ] {
        let error = Probe::force::<ModalBody>(&ROD.replacen(from, to, 1)).map(|_| ()).expect_err(expected);
        assert!(format!("{error:?}").contains(expected), "{expected}: {error:?}");
    }
}

/// A reduction leaves 1e-15 of the largest entries where a mode has nothing in common with an interface, printing 4e-8 of each entry.
#[test]
fn matrices_that_are_a_bodys_but_for_round_off_are_taken() {
    for (from, to) in [
        ("13, 2, 0.2, 0, 13, 8, 0.2, 0, 13, 13, 1, 50", "13, 2, 0.2, 2e-10, 13, 8, 0.2, -1e-10, 13, 13, 1, 1e9"),
        ("-1e2, 7, 7, 1, 1e2", "-100.00001, 7, 7, 1, 99.999996"),
    ] {
        let found = Probe::force::<ModalBody>(&ROD.replacen(from, to, 1)).map(|_| ());
        assert!(found.is_ok(), "{to}: {found:?}");
    }
}
