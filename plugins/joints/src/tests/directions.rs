//! Free and blocked directions.

use element_api::testkit::{Random, on_common_axis, turn};
use element_api::{Constraint, Frame, Vec3};

use super::{assert_satisfied, rows};
use crate::bracket::Bracket;
use crate::cam::Cam;
use crate::constant_velocity::ConstantVelocity;
use crate::cylindrical::Cylindrical;
use crate::distance_rod::DistanceRod;
use crate::ground::Ground;
use crate::parallel_axes::ParallelAxes;
use crate::planar::Planar;
use crate::point::Point;
use crate::point_in_plane::PointInPlane;
use crate::point_on_curve::PointOnCurve;
use crate::point_on_line::PointOnLine;
use crate::position::Position;
use crate::revolute::Revolute;
use crate::rotation_driver::RotationDriver;
use crate::screw::Screw;
use crate::spherical::Spherical;
use crate::translational::Translational;
use crate::universal::Universal;

/// Frame j in frame i: shifts along x, y, z (m), rotations about x, y, z (rad).
const DIRECTIONS: [&str; 6] = ["x", "y", "z", "about x", "about y", "about z"];

#[test]
fn each_joint_leaves_its_directions_free_and_blocks_the_others_by_the_row_of_that_name() {
    let turns = ["about x", "about y", "about z"];
    check_directions::<Ground>("", &[]);
    check_directions::<Bracket>("", &[]);
    check_directions::<Revolute>("", &["about z"]);
    check_directions::<Cylindrical>("", &["z", "about z"]);
    check_directions::<Translational>("", &["z"]);
    check_directions::<Spherical>("", &turns);
    check_directions::<Point>("", &turns);
    check_directions::<Planar>("", &["x", "y", "about z"]);
    check_directions::<ParallelAxes>("", &["x", "y", "z", "about z"]);
    check_directions::<PointOnLine>("", &["z", "about x", "about y", "about z"]);
    check_directions::<PointInPlane>("", &["x", "y", "about x", "about y", "about z"]);
    check_directions::<RotationDriver>("angle = 0", &["x", "y", "z", "about x", "about y"]);
    check_directions::<Position>("x = 0\ny = 0\nz = 0\nabout_x = 0\nabout_y = 0\nabout_z = 0", &[]);
}

/// From frames on each other, a small motion in a free direction leaves all rows zero; in a blocked direction it changes
/// the row of that name by its size, and only that row.
fn check_directions<T: Constraint>(params: &str, free: &[&str]) {
    let i = Random::new(9).frame();
    for (k, direction) in DIRECTIONS.iter().enumerate() {
        let step = Vec3::ith(k % 3, 0.01);
        let j = if k < 3 {
            Frame { position: i.position + i.rotation * step, ..i }
        } else {
            Frame { rotation: i.rotation * turn(step), ..i }
        };
        for (name, value) in T::ROWS.iter().zip(rows::<T>(params, vec![i, j])) {
            // sin 0.01 differs from 0.01 by 2e-7.
            let expected = if name == direction { 0.01 } else { 0.0 };
            let what = format!("{} moved {direction}: row `{name}` is {value:e}", T::NAME);
            assert!((value.abs() - expected).abs() < 1e-6, "{what}");
        }
        assert_eq!(free.contains(direction), !T::ROWS.contains(direction), "{}: {direction}", T::NAME);
    }
}

#[test]
fn only_the_directions_asked_for_are_held() {
    let i = Random::new(10).frame();
    let at = |x: f64, y: f64, z: f64| Frame { position: i.position + i.rotation * Vec3::new(x, y, z), ..i };
    assert_satisfied::<Point>("directions = 'x'", vec![i, at(0.0, 2.0, 3.0)]);
    assert_satisfied::<Point>("directions = 'xz'", vec![i, at(0.0, 2.0, 0.0)]);
    let found = rows::<Point>("directions = 'yz'", vec![i, at(1.0, 2.0, 3.0)]);
    assert!((found[0] - 2.0).abs() < 1e-14 && (found[1] - 3.0).abs() < 1e-14 && found.len() == 2, "{found:?}");
    assert_satisfied::<Position>("y = 2\nabout_z = 0", vec![i, at(1.0, 2.0, 3.0)]);
}

#[test]
fn large_free_motions_satisfy_the_rows() {
    let mut random = Random::new(7);
    for _ in 0..20 {
        let i = random.frame();
        let (angle, distance) = (random.between(-3.0, 3.0), random.between(-5.0, 5.0));
        let anyhow = Frame { rotation: turn(random.vector(3.0)), ..i };
        let on_axis = |angle: f64, distance: f64| on_common_axis(&i, angle, distance);
        assert_satisfied::<Revolute>("", vec![i, on_axis(angle, 0.0)]);
        assert_satisfied::<Cylindrical>("", vec![i, on_axis(angle, distance)]);
        assert_satisfied::<Translational>("", vec![i, on_axis(0.0, distance)]);
        assert_satisfied::<Spherical>("", vec![i, anyhow]);
        assert_satisfied::<Point>("", vec![i, anyhow]);
        assert_satisfied::<Bracket>("", vec![i, i]);
        assert_satisfied::<Ground>("", vec![i, i]);
        assert_satisfied::<Screw>("pitch = 0.2", vec![i, on_axis(angle, 0.2 * angle / std::f64::consts::TAU)]);
        assert_satisfied::<Screw>("pitch = 0", vec![i, on_axis(angle, 0.0)]);
        assert_satisfied::<PointOnLine>("", vec![i, Frame { position: on_axis(0.0, distance).position, ..anyhow }]);
        let place = i.position + i.rotation * Vec3::new(distance, angle, 0.0);
        assert_satisfied::<PointInPlane>("", vec![i, Frame { position: place, ..anyhow }]);
        assert_satisfied::<Planar>("", vec![i, Frame { position: place, ..on_axis(angle, 0.0) }]);
        let length = (distance * distance + angle * angle).sqrt();
        assert_satisfied::<DistanceRod>(&format!("length = {length}"), vec![i, Frame { position: place, ..anyhow }]);
    }
}

#[test]
fn constant_velocity_holds_for_every_bend_about_an_axis_across_the_shafts_and_for_no_twist() {
    let mut random = Random::new(11);
    for _ in 0..20 {
        let i = random.frame();
        let bend = Vec3::new(random.between(-1.5, 1.5), random.between(-1.5, 1.5), 0.0);
        let bent = Frame { rotation: i.rotation * turn(bend), ..i };
        assert_satisfied::<ConstantVelocity>("", vec![i, bent]);
        let twisted = Frame { rotation: bent.rotation * turn(Vec3::new(0.0, 0.0, 0.1)), ..bent };
        assert!(rows::<ConstantVelocity>("", vec![i, twisted])[3].abs() > 0.04);
    }
}

#[test]
fn universal_holds_while_the_pins_are_perpendicular() {
    let i = Random::new(12).frame();
    let across = turn(Vec3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0));
    let at = |tilt: f64, turned: f64, swing: f64| Frame {
        rotation: i.rotation
            * turn(Vec3::new(0.0, 0.0, turned))
            * turn(Vec3::new(0.0, tilt, 0.0))
            * across
            * turn(Vec3::new(0.0, 0.0, swing)),
        ..i
    };
    for (turned, swing) in [(0.3, 2.0), (-2.5, 0.1), (3.0, -1.0)] {
        assert_satisfied::<Universal>("", vec![i, at(0.0, turned, swing)]);
        let found = rows::<Universal>("", vec![i, at(0.2, turned, swing)]);
        assert!((found[3] + 0.2_f64.sin()).abs() < 1e-14, "{found:?}");
    }
}

#[test]
fn curves_are_followed() {
    let i = Random::new(13).frame();
    let at = |x: f64, y: f64| Frame { position: i.position + i.rotation * Vec3::new(x, y, 0.0), ..i };
    // 1 + 0.1 cos 2 phi, and points of it every 30 deg.
    let oval = |phi: f64| 1.0 + 0.1 * (2.0 * phi).cos();
    let expression = "radius = { postfix = [1, 0.1, 2, 'x', 'mul', 'cos', 'mul', 'add'] }";
    let points: Vec<String> =
        (0..=12).map(|k| f64::from(30 * k).to_radians()).map(|phi| format!("[{phi}, {}]", oval(phi))).collect();
    let points =
        format!("radius = {{ points = [{}], periodic = true, interpolation = \"spline\" }}", points.join(", "));
    for k in -12..12 {
        let phi = f64::from(15 * k).to_radians();
        let place = at(oval(phi) * phi.cos(), oval(phi) * phi.sin());
        assert_satisfied::<Cam>(expression, vec![i, place]);
        let off = rows::<Cam>(&points, vec![i, place])[0];
        // The spline's error between points that are 0.5 rad apart: 5/384 h^4 max |R''''| = 1.6e-3; at the points none.
        assert!(off.abs() < if k % 2 == 0 { 1e-13 } else { 2e-3 }, "{phi}: {off:e}");
    }
    assert_satisfied::<PointOnCurve>("height = { postfix = ['x', 'x', 'mul'] }", vec![i, at(1.5, 2.25)]);
    let beside = Frame { position: at(1.0, 1.0).position + i.z() * 0.5, ..i };
    let curve = "height = { postfix = ['x', 'x', 'mul'] }\nplanar =";
    assert!((rows::<PointOnCurve>(&format!("{curve} true"), vec![i, beside])[1] - 0.5).abs() < 1e-14);
    assert_satisfied::<PointOnCurve>(&format!("{curve} false"), vec![i, beside]);
}
