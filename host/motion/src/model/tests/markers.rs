//! Where elements are attached, and the bodies they are attached to.

use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::tests::Random;

/// A body in any place, with a centre of mass off its frame.
const ELSEWHERE: &str =
    "com = [0.1, -0.2, 0.3]\nposition = [1, 2, 3]\norientation = { axis = [1, 1, 0.5], angle = 0.8 }\n";

fn ball(placement: &str) -> String {
    with_body(ELSEWHERE) + "[[joint]]\nname = \"j\"\ntype = \"ball\"\nbodies = [\"ground\", \"a\"]\n" + placement
}

fn markers(placement: &str) -> (Model, Vec<Marker>) {
    let model = model(&ball(placement));
    let markers = model.elements[0].markers.clone();
    (model, markers)
}

/// Origin and axes of a marker in the ground frame.
fn on_ground(model: &Model, marker: &Marker) -> (Vector3<f64>, Matrix3<f64>) {
    match marker.body {
        None => (marker.position, marker.rotation),
        Some(body) => {
            let body = &model.bodies[body];
            let a = rotation(&body.orientation);
            (body.position + a * marker.position, a * marker.rotation)
        }
    }
}

fn is_triad(m: &Matrix3<f64>) -> bool {
    (m.tr_mul(m) - Matrix3::identity()).amax() < 1e-15 && (m.determinant() - 1.0).abs() < 1e-15
}

#[test]
fn a_global_point_and_axis_are_one_place_on_both_bodies() {
    let (model, markers) = markers("point = [0.4, 0.5, 0.6]\naxis = [1, -2, 2]\nx_axis = [0, 3, 1]\n");
    assert_eq!((markers[0].body, markers[1].body), (None, Some(0)));
    for marker in &markers {
        let (origin, axes) = on_ground(&model, marker);
        assert!((origin - Vector3::new(0.4, 0.5, 0.6)).amax() < 1e-15);
        assert!((axes.column(2) - Vector3::new(1.0, -2.0, 2.0) / 3.0).amax() < 1e-15 && is_triad(&axes));
        // x is the hint without its part along z.
        assert!(axes.column(0).dot(&Vector3::new(0.0, 3.0, 1.0)) > 0.0);
        let hint = Vector3::new(0.0, 3.0, 1.0);
        assert!(axes.column(1).dot(&hint).abs() < 1e-15);
    }
}

#[test]
fn points_and_axes_may_differ_from_frame_to_frame() {
    let (model, markers) = markers("points = [[1, 0, 0], [0, 1, 0]]\naxes = [[1, 0, 0], [0, 1, 0]]\n");
    for (marker, unit) in markers.iter().zip([Vector3::x(), Vector3::y()]) {
        let (origin, axes) = on_ground(&model, marker);
        assert!((origin - unit).amax() < 1e-15 && (axes.column(2) - unit).amax() < 1e-15 && is_triad(&axes));
    }
}

#[test]
fn local_frames_are_given_on_each_body() {
    let (model, markers) =
        markers("frames = [{ position = [1, 0, 0] }, { position = [0.5, 0, 0], axis = [0, 1, 0] }]\n");
    assert_eq!((markers[0].position, markers[0].rotation), (Vector3::x(), Matrix3::identity()));
    // On a body: from its frame to its centre of mass.
    assert!((markers[1].position - Vector3::new(0.4, 0.2, -0.3)).amax() < 1e-15);
    assert_eq!(markers[1].rotation.column(2), Vector3::y());
    let origin = on_ground(&model, &markers[1]).0;
    let body = &model.bodies[0];
    let frame = body.position - rotation(&body.orientation) * body.center_of_mass;
    assert!((frame - Vector3::new(1.0, 2.0, 3.0)).amax() < 1e-15);
    assert!((origin - frame - rotation(&body.orientation) * Vector3::new(0.5, 0.0, 0.0)).amax() < 1e-15);
}

#[test]
fn without_a_placement_markers_are_the_body_frames() {
    let (model, markers) = markers("");
    assert_eq!((markers[0].position, markers[0].rotation), (Vector3::zeros(), Matrix3::identity()));
    assert_eq!((markers[1].position, markers[1].rotation), (-model.bodies[0].center_of_mass, Matrix3::identity()));
}

#[test]
fn an_axis_without_a_point_leaves_the_origins_on_the_body_frames() {
    let (model, markers) = markers("axis = [0, 1, 0]\n");
    assert_eq!(on_ground(&model, &markers[0]).0, Vector3::zeros());
    assert!((on_ground(&model, &markers[1]).0 - Vector3::new(1.0, 2.0, 3.0)).amax() < 1e-15);
}

#[test]
fn default_triads_are_right_handed_whatever_the_axis() {
    let mut random = Random(211);
    let mut axes: Vec<[f64; 3]> = (0..50).map(|_| std::array::from_fn(|_| random.next())).collect();
    axes.extend([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [0.9, 1e-9, 0.43588989]]);
    for axis in axes {
        let (model, markers) = markers(&format!("axis = {axis:?}\n"));
        let z = Vector3::from(axis).normalize();
        let both = markers.iter().map(|marker| on_ground(&model, marker).1).collect::<Vec<_>>();
        assert!(is_triad(&both[0]) && (both[0].column(2) - z).amax() < 1e-15);
        assert!((both[1] - both[0]).amax() < 1e-15, "the same on both bodies");
        // x is the direction across z nearest to the ground's x, or to its y.
        let hint = if z.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        assert!(both[0].column(1).dot(&hint).abs() < 1e-15 && both[0].column(0).dot(&hint) > 0.0);
    }
}

#[test]
fn a_fixed_body_is_a_place_on_the_ground() {
    let text = with_body("position = [1, 0, 0]\n")
        + "[[body]]\nname = \"wall\"\nfixed = true\nposition = [0, 5, 0]\norientation = { axis = [0, 0, 1], angle = 1 }\n\
           [[joint]]\nname = \"j\"\ntype = \"ball\"\nbodies = [\"wall\", \"a\"]\n\
           frames = [{ position = [2, 0, 0] }, { position = [0, 0, 0] }]\n";
    let model = model(&text);
    assert_eq!(model.bodies.len(), 1);
    let marker = &model.elements[0].markers[0];
    let expected = Vector3::new(2.0 * 1.0_f64.cos(), 5.0 + 2.0 * 1.0_f64.sin(), 0.0);
    assert!(marker.body.is_none() && (marker.position - expected).amax() < 1e-15);
}

#[test]
fn bodies_are_described_about_their_centres_of_mass() {
    let text = "[units]\nlength = \"mm\"\nmass = \"g\"\n[[body]]\nname = \"a\"\nmass = 500\n\
                inertia = [1e6, 2e6, 3e6, 1e5, 2e5, 3e5]\ncom = [10, 0, 0]\nposition = [0, 20, 0]\n\
                orientation = { axis = [0, 0, 1], angle = \"90 deg\" }\nvelocity = [\"free\", 5, \"free\"]\n\
                angular_velocity = [\"free\", \"free\", \"60 rpm\"]\n";
    let body = &model(text).bodies[0];
    assert!((body.mass - 0.5).abs() < 1e-16);
    let j = Matrix3::new(1.0, 0.1, 0.3, 0.1, 2.0, 0.2, 0.3, 0.2, 3.0) * 1e-3;
    assert!((body.inertia - j).amax() < 1e-18);
    assert!((body.position - Vector3::new(0.0, 0.03, 0.0)).amax() < 1e-16);
    assert_eq!((body.velocity[0], body.velocity[1].map(|v| (v * 1e3).round())), (None, Some(5.0)));
    assert!((body.angular_velocity[2].unwrap() - std::f64::consts::TAU).abs() < 1e-15);
}

#[test]
fn elements_switched_off_are_left_out_but_their_neighbours_keep_their_sets() {
    let joint = |name: &str, more: &str| {
        format!("[[joint]]\nname = \"{name}\"\ntype = \"ball\"\nbodies = [\"ground\", \"a\"]\n{more}")
    };
    let friction = "[[force]]\nname = \"f\"\ntype = \"friction\"\nbodies = [\"ground\", \"a\"]\n";
    let text = with_body("") + &joint("one", "") + &joint("off", "enabled = false\n") + &joint("two", "") + friction;
    let model = model(&text);
    let of = |k: usize| (model.elements[k].name.as_str(), model.elements[k].set, model.elements[k].index);
    assert_eq!((model.elements.len(), model.sets.len()), (3, 2));
    assert_eq!([of(0), of(1), of(2)], [("one", 0, 0), ("two", 0, 1), ("f", 1, 0)]);
    assert_eq!(model.elements[1].row_name(2), "two: z");
}

#[test]
fn a_joint_has_the_rows_its_parameters_choose() {
    let rows = |params: &str| {
        let text = with_body("")
            + &format!("[[joint]]\nname = \"j\"\ntype = \"screw\"\nbodies = [\"ground\", \"a\"]\nparams = {params}\n");
        let instance = model(&text).elements[0].clone();
        (instance.rows.clone(), instance.value_count(), instance.row_name(2))
    };
    assert_eq!(rows("{ pitch = 0.1 }"), (vec![0, 1, 2, 3, 4], 7, "j: advance".into()));
    assert_eq!(rows("{ pitch = 0.1, held = false }"), (vec![0, 1, 2], 5, "j: advance".into()));
}
