//! What the test kit asks of every joint, and a value by hand.

use element_api::testkit::{Options, Probe, Random, Setting, examine_joint_with};

use crate::Wobble;

#[test]
fn the_joint_fulfils_the_contract() {
    // Beyond what is asked of every joint, its author claims that nothing depends on time.
    let claims = Options { scleronomic: Some(true), ..Options::default() };
    examine_joint_with::<Wobble>("amplitude = 0.1", &claims).assert_sound();
    examine_joint_with::<Wobble>("amplitude = 0.1\nwaves = 3", &claims).assert_sound();
}

#[test]
fn the_follower_is_at_the_bottom_half_a_turn_from_the_crest() {
    let wobble = Probe::joint::<Wobble>("amplitude = 0.1").expect("an amplitude that is allowed");
    let plate = Random::new(1).frame();
    let mut follower = plate;
    follower.position = plate.point([-0.5, 0.0, -0.1]);
    let row = wobble.joint_values(&Setting::at_rest(vec![plate, follower])).residual()[0];
    assert!(row.abs() < 1e-15, "{row}");
}
