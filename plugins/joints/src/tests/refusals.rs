//! Parameters that cannot be used.

use element_api::Constraint;
use element_api::set::CreateError;
use element_api::testkit::Probe;

use crate::cam::Cam;
use crate::coupler::Coupler;
use crate::gear::Gear;
use crate::position::Position;
use crate::profile_contact::ProfileContact;
use crate::rail_contact::RailContact;
use crate::rope::Rope;

/// The parameter that is refused, and why.
fn refusal<T: Constraint>(params: &str) -> (String, String) {
    match Probe::joint::<T>(params) {
        Err(CreateError::Parameter(error)) => (error.path, error.message),
        other => panic!("{params}: {other:?}"),
    }
}

fn assert_refused<T: Constraint>(params: &str, path: &str, words: &str) {
    let (found, message) = refusal::<T>(params);
    assert!(found == path && message.contains(words), "{params}: `{found}` {message}");
}

#[test]
fn gear_needs_either_both_radii_or_both_numbers_of_teeth() {
    for params in ["", "radius_1 = 0.1", "teeth_2 = 20", "radius_1 = 0.1\nteeth_2 = 20"] {
        assert_refused::<Gear>(params, "", "give `radius_1` and `radius_2`, or `teeth_1` and `teeth_2`");
    }
}

#[test]
fn coupler_needs_the_factor_of_its_kinds() {
    assert_refused::<Coupler>("", "ratio", "must be given");
    assert_refused::<Coupler>("ratio = 0.0", "ratio", "not be zero");
    assert_refused::<Coupler>("lead = 1.0", "lead", "does not apply to rotation and rotation");
    assert_refused::<Coupler>("first = 'translation'", "lead", "must be given");
    let params = "second = 'translation'\nlead = 0.1\nangle_offset = 1.0";
    assert_refused::<Coupler>(params, "angle_offset", "the second coordinate is a translation");
    assert_refused::<Coupler>("ratio = 1.0\ndisplacement_offset = 1.0", "displacement_offset", "is a rotation");
}

#[test]
fn position_must_prescribe_something() {
    assert_refused::<Position>("", "", "at least one of");
}

#[test]
fn profiles_must_let_a_follower_touch_them_in_one_place() {
    // r = 1 + a cos 2 phi is hollow at phi = 90 deg from a = 1/5 on: its bend there is (r - r'') / r^2.
    let wave = |a: f64| format!("radius = {{ postfix = [1, {a}, 2, 'x', 'mul', 'cos', 'mul', 'add'] }}");
    let with = |a: f64, more: &str| format!("{}\n{more}", wave(a));
    assert!(Probe::joint::<ProfileContact>(&with(0.1, "follower = 'flat'")).is_ok());
    assert_refused::<ProfileContact>(&with(0.3, "follower = 'flat'"), "radius", "is not convex at ");
    // The bend at the hollow place: with r = 0.7 and r'' = 1.2, a radius of 0.98.
    assert!(Probe::joint::<ProfileContact>(&with(0.3, "roller_radius = 0.97")).is_ok());
    assert_refused::<ProfileContact>(
        &with(0.3, "roller_radius = 0.99"),
        "roller_radius",
        "hollow with a radius of 9.8000e-1 m at ",
    );
    assert_refused::<ProfileContact>(&wave(0.1), "roller_radius", "is missing");
    assert_refused::<ProfileContact>(&with(1.5, "roller_radius = 0.1"), "radius", "above zero, at ");
    let open = "radius = { postfix = [1, 0.1, 'x', 'mul', 'add'] }\nroller_radius = 0.1";
    assert_refused::<ProfileContact>(open, "radius", "must repeat after a turn");
    // Closed, with a corner where the cosine changes its sign.
    let kinked = "radius = { postfix = [1, 0.1, 0, 'x', 'cos', 'max', 'mul', 'add'] }\nroller_radius = 0.1";
    assert_refused::<ProfileContact>(kinked, "radius", "has a kink at -90 deg");
    let rail = |more: &str| format!("height = {{ postfix = ['x', 'x', 'mul'] }}\nfrom = -1.0\nto = 1.0\n{more}");
    assert!(Probe::joint::<RailContact>(&rail("wheel_radius = 0.49")).is_ok());
    assert_refused::<RailContact>(
        &rail("wheel_radius = 0.51"),
        "wheel_radius",
        "hollow with a radius of 5.0000e-1 m at 0.0000 m",
    );
    assert_refused::<RailContact>(&rail("wheel_radius = 0.1\nstart = 2.0"), "start", "between `from` and `to`");
}

/// A wheel of 0.4 m, or another one, on this height over x, from -2 m or elsewhere.
fn rail(height: &str, more: &str) -> String {
    let ends = if more.contains("from") { "" } else { "from = -2.0\nto = 2.0\n" };
    let wheel = if more.contains("wheel_radius") { "" } else { "wheel_radius = 0.4\n" };
    format!("height = {{ postfix = [{height}] }}\n{ends}{wheel}{more}")
}

#[test]
fn wheels_do_not_fit_into_inner_corners() {
    let corners = [
        ("'x', 'abs'", "0.0000 m"),
        ("'x', 1.23456, 'sub', 'abs', 0.01, 'mul'", "1.2346 m"),
        ("0, 'x', 'max'", "0.0000 m"),
        ("'x', 'x', 'neg', 'min', 'neg'", "0.0000 m"),
        ("'x', 'x', 'mul', 0.001, 'add', 'sqrt', 'x', 0.5, 'sub', 'abs', 'add', 0.3, 'mul'", "0.5000 m"),
        ("'x', 0.3, 'add', 'abs', 0.5, 'pow'", "-0.3000 m"),
    ];
    for (height, place) in corners {
        let words = format!(
            "an inner corner at {place}: the wheel touches both sides of it. Round it off with a radius above 0.01 m"
        );
        assert_refused::<RailContact>(&rail(height, "wheel_radius = 0.01"), "wheel_radius", &words);
        assert!(Probe::joint::<RailContact>(&rail(height, "wheel_radius = 0.0")).is_ok(), "{height}");
        let outer = format!("{height}, 'neg'");
        assert!(Probe::joint::<RailContact>(&rail(&outer, "wheel_radius = 0.01")).is_ok(), "{outer}");
    }
    // At the ends of the rail a corner has one side.
    assert!(Probe::joint::<RailContact>(&rail("'x', 'abs'", "from = 0.0\nto = 2.0")).is_ok());
    assert!(Probe::joint::<RailContact>(&rail("'x', 'abs'", "from = -2.0\nto = 0.0")).is_ok());
    // What has a switch need not have a corner.
    for smooth in ["'x', 'abs', 3, 'pow', 0.1, 'mul'", "'x', 'x', 'abs', 'mul'", "'x', 'x', 'mul', 'abs'"] {
        assert!(Probe::joint::<RailContact>(&rail(smooth, "")).is_ok(), "{smooth}");
    }
    // Points hold their ends: with a corner, unless the rail ends there.
    let points = "height = [[-1.0, -0.2], [0.0, 0.0], [1.0, 0.2]]\nwheel_radius = 0.1\n";
    assert_refused::<RailContact>(&format!("{points}from = -2.0\nto = 1.0"), "wheel_radius", "corner at -1.0000 m");
    assert!(Probe::joint::<RailContact>(&format!("{points}from = -1.0\nto = 2.0")).is_ok());
    assert!(Probe::joint::<RailContact>(&format!("{points}from = -1.0\nto = 1.0")).is_ok());
}

#[test]
fn no_hollow_is_too_narrow_to_be_seen() {
    // A dip with a radius of width^2 / (2 depth) at its bottom.
    let dip = |depth: f64| format!("'x', 5.0, 'sub', 0.1, 'div', 2, 'pow', 'neg', 'exp', {depth:?}, 'mul'");
    let long = "from = 0.0\nto = 10000.0\n";
    for (depth, radius) in [(-0.2, "2.5000e-2"), (-0.02, "2.5000e-1")] {
        let words = format!("hollow with a radius of {radius} m at 5.0000 m");
        assert_refused::<RailContact>(&rail(&dip(depth), long), "wheel_radius", &words);
    }
    assert!(Probe::joint::<RailContact>(&rail(&dip(-0.02), &format!("{long}wheel_radius = 0.2499"))).is_ok());
    // A kilometre of waves along which the wheel just fits, and with a bound on it that is too loose by a third.
    let waves = "'x', 10, 'mul', 'sin', 0.01, 'mul', 'x', 10, 'mul', 'cos', 0.01, 'mul', 'add'";
    let kilometre = "from = 0.0\nto = 1000.0\n";
    assert!(Probe::joint::<RailContact>(&rail(waves, &format!("{kilometre}wheel_radius = 0.6"))).is_ok());
    assert_refused::<RailContact>(
        &rail(waves, &format!("{kilometre}wheel_radius = 0.8")),
        "wheel_radius",
        "7.0711e-1 m",
    );
    // Half a circle, whose ends are steep.
    let half = "1, 'x', 'x', 'mul', 'sub', 'sqrt'";
    assert!(Probe::joint::<RailContact>(&rail(half, "from = -1.0\nto = 1.0\n")).is_ok());
    for pole in ["1, 'x', 'div'", "-1, 'x', 'x', 'mul', 'div'"] {
        let (name, message) = refusal::<RailContact>(&rail(pole, "wheel_radius = 0.01"));
        assert_eq!(name, "wheel_radius", "{pole}: {message}");
    }
}

#[test]
fn followers_do_not_fit_into_inner_corners_of_cams() {
    let cam = |bump: f64, more: &str| {
        format!(
            "radius = {{ postfix = [0.05, 'x', 2, 'mul', 1, 'sub', 'sin', 'abs', {bump:?}, 'mul', 'add'] }}\n{more}"
        )
    };
    let words = "an inner corner at 0.5000 rad: the roller touches both sides of it";
    assert_refused::<ProfileContact>(&cam(0.02, "roller_radius = 0.02"), "roller_radius", words);
    assert!(Probe::joint::<ProfileContact>(&cam(0.02, "roller_radius = 0.0")).is_ok());
    assert!(Probe::joint::<ProfileContact>(&cam(-0.002, "roller_radius = 0.02")).is_ok());
    assert_refused::<ProfileContact>(&cam(0.002, "follower = 'flat'"), "radius", "an inner corner at 0.5000 rad");
    assert!(Probe::joint::<ProfileContact>(&cam(-0.002, "follower = 'flat'")).is_ok());
}

#[test]
fn cam_must_be_closed_and_around_its_pole() {
    assert_refused::<Cam>("radius = 0.0", "radius", "above zero, at -180 deg it is 0");
    // 1 + 0.1 phi has a step at half a turn, 1 + 0.1 phi^2 a kink.
    let step = "radius = { postfix = [1, 0.1, 'x', 'mul', 'add'] }";
    let kink = "radius = { postfix = [1, 0.1, 'x', 2, 'pow', 'mul', 'add'] }";
    assert_refused::<Cam>(step, "radius", "must repeat after a turn");
    assert_refused::<Cam>(kink, "radius", "has a kink at 180 deg");
}

#[test]
fn rope_bounces_only_with_slack_and_has_two_to_so_many_points() {
    assert_refused::<Rope>("length = 1.0\nrestitution = 0.5", "restitution", "`slack`");
    for count in [1, 65] {
        assert_refused::<Rope>(&format!("length = 1.0\n'#frames' = {count}"), "bodies", "takes 2 to 64 frames");
    }
}
