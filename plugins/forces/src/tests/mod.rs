//! Closed-form values, power balance, action and reaction of the force elements; one file per family.

mod at_rest;
mod elastic;
mod friction;
mod inertia;
mod loads;
mod springs;
mod stops;

use element_api::documentation::{manual_page, scenes_of};
use element_api::testkit::{Random, Setting, on_common_axis, turn};
use element_api::{Frame, Vec3};

#[test]
fn every_element_has_a_complete_manual_page() {
    for class in crate::library().classes {
        let descriptor = class.descriptor();
        let page = manual_page(&descriptor.doc);
        let mut rest = page.as_str();
        for heading in ["## Equations", "## Signs", "## Singular cases", "## Example"] {
            let at = rest.find(heading).unwrap_or_else(|| panic!("{}: no `{heading}`", descriptor.name));
            assert!(!rest[..at].trim().is_empty(), "{}: nothing before `{heading}`", descriptor.name);
            rest = &rest[at + heading.len()..];
        }
        let scenes = scenes_of(&page);
        assert_eq!(scenes.len(), 1, "{}", descriptor.name);
        assert!(scenes[0].contains(&format!("type = \"{}\"", descriptor.name)), "{}", descriptor.name);
    }
}

fn assert_close(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-13 * (1.0 + expected.abs()), "found {value}, expected {expected}");
}

fn assert_vector(value: Vec3<f64>, expected: [f64; 3]) {
    let expected = Vec3::from(expected);
    assert!((value - expected).norm() < 1e-12 * (1.0 + expected.norm()), "found {value}, expected {expected}");
}

fn ground() -> Frame<f64> {
    Frame { position: Vec3::zeros(), rotation: turn(Vec3::zeros()) }
}

/// The second origin on the ground's x axis, moving with `velocity`.
fn pulled_apart(distance: f64, velocity: Vec3<f64>) -> Setting {
    let mut setting = Setting::at_rest(vec![ground(), Frame { position: Vec3::new(distance, 0.0, 0.0), ..ground() }]);
    setting.twists[1].velocity = velocity;
    setting
}

/// At least a metre apart: differences are inaccurate where the length is small.
fn two_frames_anywhere(random: &mut Random) -> Setting {
    let (i, mut j) = (random.frame(), random.frame());
    j.position.x += 3.0;
    let mut setting = Setting::at_rest(vec![i, j]);
    setting.twists = vec![random.twist(), random.twist()];
    setting
}

/// Frames with a common z axis, turning about it at different speeds.
fn two_frames_turning_about_one_axis(random: &mut Random) -> Setting {
    let i = random.frame();
    let mut setting = Setting::at_rest(vec![i, on_common_axis(&i, random.between(-3.0, 3.0), 0.0)]);
    setting.twists = vec![random.twist(), random.twist()];
    setting.twists[0].angular_velocity = i.z() * random.between(-2.0, 2.0);
    setting.twists[1].angular_velocity = i.z() * random.between(-2.0, 2.0);
    setting
}

/// Frames anywhere, less than `angle` per component turned against each other.
fn two_frames_turned_up_to(angle: f64) -> impl Fn(&mut Random) -> Setting {
    move |random| {
        let i = random.frame();
        let j = Frame { position: i.position + random.vector(1.0), rotation: i.rotation * turn(random.vector(angle)) };
        let mut setting = Setting::at_rest(vec![i, j]);
        setting.twists = vec![random.twist(), random.twist()];
        setting
    }
}
