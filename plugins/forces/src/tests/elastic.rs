//! Beam, bushing, field: elastic connections in six directions.

use element_api::testkit::{self, Probe, Random, Setting, turn};
use element_api::{Frame, Mat3, Vec3};

use super::{assert_close, assert_vector, ground, two_frames_turned_up_to};
use crate::beam::Beam;
use crate::bushing::Bushing;
use crate::field::Field;

const BEAM: &str = "length = 0.5\nyoung = 200.0\nshear = 80.0\narea = 0.3\niy = 0.02\niz = 0.03\ntorsion = 0.04";
const BUSHING: &str = "stiffness = [3, 5, 7]\nrotational_stiffness = [2, 4, 6]";
const DAMPED: &str = "damping = [1, 2, 3]\nrotational_damping = [0.5, 0.6, 0.7]";
const FIELD: &str = "translation = [9, 1, 2, 1, 8, 3, 2, 3, 7]\ncoupling = [1, 2, 3, 4, 5, 6, 7, 8, 9]\n\
                     rotation = [20, 1, 2, 1, 30, 3, 2, 3, 40]";
const FIELD_MORE: &str = "translation_damping = [9, 1, 2, 1, 8, 3, 2, 3, 7]\n\
                          rotation_damping = [2, 0, 1, 0, 3, 0, 1, 0, 4]\n\
                          coupling_damping = [0.1, 0.2, 0, 0, 0, 0.3, 0, 0, 0]\noffset = [0.1, 0.2, 0.3]\n\
                          preload_force = [1, 2, 3]\npreload_torque = [4, 5, 6]";

#[test]
fn beam_fulfils_the_contract() {
    for more in ["", "ky = 0.8\nkz = 0.6", "ky = 0.8\ndamping_time = 0.1"] {
        let params = format!("{BEAM}\n{more}");
        testkit::check_force::<Beam>(&params);
        testkit::check_internal::<Beam>(&params);
        for angle in [0.05, 0.4, 1.2] {
            testkit::check_power::<Beam>(&params, two_frames_turned_up_to(angle));
        }
    }
}

#[test]
fn bushing_fulfils_the_contract() {
    for params in [BUSHING.to_owned(), format!("{BUSHING}\n{DAMPED}")] {
        testkit::check_force::<Bushing>(&params);
        testkit::check_internal::<Bushing>(&params);
        for angle in [0.05, 0.4, 1.2] {
            testkit::check_power::<Bushing>(&params, two_frames_turned_up_to(angle));
        }
    }
}

#[test]
fn field_fulfils_the_contract() {
    for params in [FIELD.to_owned(), format!("{FIELD}\n{FIELD_MORE}")] {
        testkit::check_force::<Field>(&params);
        testkit::check_internal::<Field>(&params);
        for angle in [0.05, 0.4, 1.2] {
            testkit::check_power::<Field>(&params, two_frames_turned_up_to(angle));
        }
    }
}

/// Frame j of a beam of 0.5 m along x, displaced and turned from its place.
fn bent(u: [f64; 3], theta: [f64; 3]) -> Setting {
    let j = Frame { position: Vec3::new(0.5, 0.0, 0.0) + Vec3::from(u), rotation: turn(Vec3::from(theta)) };
    Setting::at_rest(vec![ground(), j])
}

#[test]
fn cantilever_under_a_tip_force_bends_as_in_the_textbook() {
    // Deflection P L^3 / (3 E I) + P L / (k G A), slope P L^2 / (2 E I), in both planes, without moment at the tip.
    let params = format!("{BEAM}\nky = 0.8\nkz = 0.6");
    let probe = Probe::force::<Beam>(&params).expect("accepted");
    let (l, ga) = (0.5_f64, 80.0 * 0.3);
    // So small that nothing of second order is left.
    let load = 1e-12;
    let deflection = |ei: f64, k: f64| load * (l.powi(3) / (3.0 * ei) + l / (k * ga));
    let slope = |ei: f64| load * l * l / (2.0 * ei);
    let (iz, iy) = (200.0 * 0.03, 200.0 * 0.02);
    let found = probe.force_values(&bent([0.0, deflection(iz, 0.8), 0.0], [0.0, 0.0, slope(iz)]));
    assert!(
        (found.channels[1] - load).abs() < 1e-12 * load && found.channels[5].abs() < 1e-12 * load,
        "{:?}",
        found.channels
    );
    // A positive rotation about y lowers the tip: z falls along x.
    let found = probe.force_values(&bent([0.0, 0.0, deflection(iy, 0.6)], [0.0, -slope(iy), 0.0]));
    assert!(
        (found.channels[2] - load).abs() < 1e-12 * load && found.channels[4].abs() < 1e-12 * load,
        "{:?}",
        found.channels
    );
    // The clamp carries force and moment: P and P L at the first end.
    assert!((found.torques[0].y + load * l).abs() < 1e-9 * load, "{}", found.torques[0]);
    assert_vector(found.forces[0] / load, [0.0, 0.0, 1.0]);
}

#[test]
fn axial_load_and_torsion_are_proportional() {
    let probe = Probe::force::<Beam>(BEAM).expect("accepted");
    let found = probe.force_values(&bent([0.01, 0.0, 0.0], [0.2, 0.0, 0.0]));
    assert_close(found.channels[0], 200.0 * 0.3 / 0.5 * 0.01);
    assert_close(found.channels[3], 80.0 * 0.04 / 0.5 * 0.2);
    assert_vector(found.forces[1], [-200.0 * 0.3 / 0.5 * 0.01, 0.0, 0.0]);
    assert_close(found.potential.expect("given"), 0.5 * (120.0 * 1e-4 + 6.4 * 0.04));
}

/// What a pull adds to the stiffness of the second end: the geometric stiffness matrix, N (6 / 5 L, 1 / 10, 2 L / 15).
#[test]
fn a_pull_stiffens_a_beam_by_its_geometric_stiffness() {
    let probe = Probe::force::<Beam>(BEAM).expect("accepted");
    let (l, pull) = (0.5, 200.0 * 0.3 / 0.5 * 0.01);
    let small = 1e-9;
    let load = |x: f64, at: usize| {
        let (mut u, mut theta) = ([x, 0.0, 0.0], [0.0; 3]);
        if at < 3 {
            u[at] = small
        } else {
            theta[at - 3] = small
        }
        let found = probe.force_values(&bent(u, theta)).channels;
        std::array::from_fn::<f64, 6, _>(|k| found[k] / small)
    };
    let added = |at: usize| {
        let (with, without) = (load(0.01, at), load(0.0, at));
        std::array::from_fn::<f64, 6, _>(|k| with[k] - without[k])
    };
    // The chord is longer by a hundredth.
    let chord = pull / (l + 0.01) + pull / (5.0 * l);
    for (at, row, expected) in [
        (1, 1, chord),
        (2, 2, chord),
        (1, 5, -pull / 10.0),
        (5, 1, -pull / 10.0),
        (2, 4, pull / 10.0),
        (4, 2, pull / 10.0),
        (4, 4, pull * 2.0 * l / 15.0),
        (5, 5, pull * 2.0 * l / 15.0),
    ] {
        assert!((added(at)[row] - expected).abs() < 1e-6 * expected.abs(), "{at} {row}: {} {expected}", added(at)[row]);
    }
}

#[test]
fn shear_factors_tend_to_the_beam_without_shear() {
    let slender = Probe::force::<Beam>(BEAM).expect("accepted");
    let stiff = Probe::force::<Beam>(&format!("{BEAM}\nky = 1e12\nkz = 1e12")).expect("accepted");
    let setting = bent([0.01, 0.02, 0.03], [0.04, 0.05, 0.06]);
    for (a, b) in slender.force_values(&setting).channels.iter().zip(&stiff.force_values(&setting).channels) {
        assert!((a - b).abs() < 1e-10 * b.abs(), "{a} {b}");
    }
}

#[test]
fn bushing_loads_are_stiffness_times_deformation_plus_damping_times_rate() {
    let probe = Probe::force::<Bushing>(&format!("{BUSHING}\n{DAMPED}")).expect("accepted");
    let mut setting = Setting::at_rest(vec![ground(), Frame { position: Vec3::new(0.1, 0.2, 0.3), ..ground() }]);
    setting.twists[1].velocity = Vec3::new(1.0, 1.0, 1.0);
    setting.twists[1].angular_velocity = Vec3::new(1.0, 2.0, 3.0);
    let found = probe.force_values(&setting);
    assert_vector(found.forces[1], [-(0.3 + 1.0), -(1.0 + 2.0), -(2.1 + 3.0)]);
    // Parallel frames: rotation vector zero, its rate the angular velocity.
    assert_vector(found.torques[1], [-0.5, -1.2, -2.1]);
    for (channel, expected) in found.channels.iter().zip([1.3, 3.0, 5.1, 0.5, 1.2, 2.1, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0]) {
        assert_close(*channel, expected);
    }
    assert_close(found.dissipation.expect("given"), 1.0 + 2.0 + 3.0 + 0.5 + 0.6 * 4.0 + 0.7 * 9.0);
}

#[test]
fn bushing_turned_far_about_one_axis_pulls_back_in_proportion() {
    let probe = Probe::force::<Bushing>(BUSHING).expect("accepted");
    for angle in [1e-9, 0.1, 1.0, 3.0] {
        let setting =
            Setting::at_rest(vec![ground(), Frame { rotation: turn(Vec3::new(0.0, angle, 0.0)), ..ground() }]);
        let found = probe.force_values(&setting);
        assert_vector(found.torques[1] / angle, [0.0, -4.0, 0.0]);
        assert_close(found.channels[10], angle);
    }
}

#[test]
fn field_with_diagonal_blocks_is_a_bushing() {
    let field = "translation = [3, 0, 0, 0, 5, 0, 0, 0, 7]\nrotation = [2, 0, 0, 0, 4, 0, 0, 0, 6]\n\
                 translation_damping = [1, 0, 0, 0, 2, 0, 0, 0, 3]\n\
                 rotation_damping = [0.5, 0, 0, 0, 0.6, 0, 0, 0, 0.7]";
    let field = Probe::force::<Field>(field).expect("accepted");
    let bushing = Probe::force::<Bushing>(&format!("{BUSHING}\n{DAMPED}")).expect("accepted");
    let mut random = Random::new(21);
    for _ in 0..10 {
        let mut setting = two_frames_turned_up_to(1.0)(&mut random);
        field.settle(&mut setting);
        assert_eq!(field.force_values(&setting), bushing.force_values(&setting));
    }
}

#[test]
fn field_loads_are_rows_times_deformation() {
    let probe = Probe::force::<Field>(&format!("{FIELD}\noffset = [0.1, 0.2, 0.3]\npreload_torque = [4, 5, 6]"))
        .expect("accepted");
    let place = Vec3::new(0.1, 0.2, 0.3) + Vec3::new(1.0, 2.0, 3.0);
    let found = probe.force_values(&Setting::at_rest(vec![ground(), Frame { position: place, ..ground() }]));
    let u = Vec3::new(1.0, 2.0, 3.0);
    let translation = Mat3::new(9.0, 1.0, 2.0, 1.0, 8.0, 3.0, 2.0, 3.0, 7.0);
    let coupling = Mat3::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0);
    assert_vector(found.forces[1], (-(translation * u)).into());
    assert_vector(found.torques[1], (-(coupling.transpose() * u + Vec3::new(4.0, 5.0, 6.0))).into());
}

#[test]
fn matrices_without_an_energy_are_refused_by_name() {
    let cases = [
        ("translation = [9, 1, 2, 1, 8, 3, 2, 4, 7]", "translation", "entry (2, 3) is 3, (3, 2) is 4"),
        ("rotation = [9, 1]", "rotation", "needs 9 numbers"),
        ("rotation_damping = [1, 0, 0, 0, -1, 0, 0, 0, 1]", "", "negative in some direction"),
        ("rotation_damping = [1, 2, 0, 2, 1, 0, 0, 0, 1]", "", "negative in some direction"),
        ("coupling_damping = [1, 0, 0, 0, 0, 0, 0, 0, 0]", "", "negative in some direction"),
    ];
    for (params, path, message) in cases {
        let error = format!("{:?}", Probe::force::<Field>(params).expect_err("refused"));
        assert!(error.contains(&format!("path: \"{path}\"")) && error.contains(message), "{error}");
    }
    for params in
        ["coupling = [1, 2, 3, 4, 5, 6, 7, 8, 9]", "translation_damping = [1, 1, 0, 1, 1, 0, 0, 0, 0]", FIELD_MORE]
    {
        assert!(Probe::force::<Field>(params).is_ok(), "{params}");
    }
}
