//! Bump stops.

use element_api::testkit::{self, Probe, Random, Setting, on_common_axis};
use element_api::{Frame, Vec3};

use super::{assert_close, ground, two_frames_anywhere, two_frames_turning_about_one_axis};
use crate::bump_stop::BumpStop;
use crate::rotational_bump_stop::RotationalBumpStop;

const STOPS: &str = "lower = -0.2\nupper = 0.3\ndepth = 0.1\ndamping = 0.4";

#[test]
fn bump_stop_fulfils_the_contract() {
    for more in ["exponent = 1.0", "exponent = 1.5", "exponent = 3.0"] {
        let params = format!("{STOPS}\nforce = 20.0\n{more}");
        testkit::check_force::<BumpStop>(&params);
        testkit::check_internal::<BumpStop>(&params);
        let params = format!("{STOPS}\ntorque = 20.0\n{more}");
        testkit::check_force::<RotationalBumpStop>(&params);
        testkit::check_internal::<RotationalBumpStop>(&params);
    }
    // Differences need room around a touch.
    let params = format!("{STOPS}\nforce = 20.0\nexponent = 3.0");
    testkit::check_power::<BumpStop>(&params, away_from_touch(two_frames_anywhere));
    let params = format!("{STOPS}\ntorque = 20.0\nexponent = 3.0");
    testkit::check_power::<RotationalBumpStop>(&params, two_frames_turning_about_one_axis);
}

/// Settings whose displacement along z is farther than a hundredth from both stops.
fn away_from_touch(setting: impl Fn(&mut Random) -> Setting) -> impl Fn(&mut Random) -> Setting {
    move |random| loop {
        let setting = setting(random);
        let (i, j) = (&setting.frames[0], &setting.frames[1]);
        let s = i.z().dot(&(j.position - i.position));
        if (s - 0.3).abs() > 0.01 && (s + 0.2).abs() > 0.01 {
            return setting;
        }
    }
}

fn at(displacement: f64, speed: f64) -> Setting {
    let mut setting =
        Setting::at_rest(vec![ground(), Frame { position: Vec3::new(0.5, 0.0, displacement), ..ground() }]);
    setting.twists[1].velocity = Vec3::new(7.0, 0.0, speed);
    setting
}

#[test]
fn force_is_a_power_of_the_depth_and_grows_with_the_speed_of_approach() {
    let probe = Probe::force::<BumpStop>(&format!("{STOPS}\nforce = 20.0\nexponent = 2.0")).expect("accepted");
    for (place, speed, expected) in [
        (0.0, 1.0, 0.0),
        (0.3, 1.0, 0.0),
        (-0.2, 1.0, 0.0),
        (0.4, 0.0, -20.0),
        (0.5, 1.0, -80.0 * 1.4),
        (0.5, -1.0, -80.0 * 0.6),
        (-0.25, -1.0, 5.0 * 1.4),
    ] {
        let found = probe.force_values(&at(place, speed));
        assert_close(found.forces[1].z, expected);
        assert_close(found.channels[0], expected);
        assert_close(found.channels[1], place);
        // The pair acts along one line: the force on i has a moment about its own origin.
        assert_close(found.torques[0].y, expected * 0.5);
    }
    assert_close(probe.force_values(&at(0.5, 0.0)).potential.expect("given"), 20.0 * 0.1 * 8.0 / 3.0);
    assert_close(probe.force_values(&at(0.5, 3.0)).dissipation.expect("given"), 80.0 * 0.4 * 9.0);
}

#[test]
fn force_is_smooth_at_the_touch() {
    let probe = Probe::force::<BumpStop>(&format!("{STOPS}\nforce = 20.0\nexponent = 1.5")).expect("accepted");
    let force = |x: f64| probe.force_values(&at(0.3 + x, 0.0)).channels[0];
    for step in [1e-4, 1e-6, 1e-8] {
        // Slope of x^1.5 at the touch: the root of the step, no jump.
        assert!((force(step) / step).abs() < 1.5 * 20.0 / 0.1_f64.powf(1.5) * step.sqrt());
        assert_eq!(force(-step), 0.0);
    }
}

#[test]
fn rotation_stops_after_more_than_a_turn() {
    let probe = Probe::force::<RotationalBumpStop>("upper = 7.0\ntorque = 20.0\ndepth = 0.1\nexponent = 1.0")
        .expect("accepted");
    let mut setting = Setting::at_rest(vec![ground(), on_common_axis(&ground(), 7.05, 0.0)]);
    setting.references = vec![6.5];
    assert!((probe.force_values(&setting).torques[1].z + 10.0).abs() < 1e-11);
    setting.references = vec![0.5];
    assert_eq!(probe.force_values(&setting).torques[1].z, 0.0);
}

#[test]
fn stops_need_a_place_and_room_between_them() {
    let error = |params: &str| format!("{:?}", Probe::force::<BumpStop>(params).expect_err("refused"));
    assert!(error("force = 1.0\ndepth = 1.0").contains("needs `lower`, `upper`, or both"));
    assert!(error("force = 1.0\ndepth = 1.0\nlower = 1.0\nupper = 1.0").contains("must be above `lower`"));
}
