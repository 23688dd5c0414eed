//! Contacts on curves: the place is found from any start, on every side, and its row is the distance to where the bodies touch.

use std::f64::consts::{PI, TAU};

use element_api::testkit::{Random, Setting, on_common_axis};
use element_api::{Constraint, Frame, Vec3};

use super::probe;
use crate::ellipse_contact::EllipseContact;
use crate::profile_contact::ProfileContact;

const TRIALS: usize = 400;

/// The row and the unknowns, each in [0, 2 pi), with the second frame in the plane of the first, turned by `angle`.
#[track_caller]
fn found<T: Constraint>(params: &str, random: &mut Random, at: Vec3<f64>, angle: f64) -> (f64, Vec<f64>) {
    let probe = probe::<T>(params);
    let i = random.frame();
    let turned = on_common_axis(&i, angle, 0.0);
    let j = Frame { position: i.position + i.rotation * at, ..turned };
    let mut setting = Setting::at_rest(vec![i, j]);
    probe.settle(&mut setting);
    assert!(probe.solve_unknowns(&mut setting), "{params}: no place is found, {at:?}, {angle}");
    let values = probe.joint_values(&setting);
    (values.residual()[0], values.coordinates().iter().map(|angle| angle.rem_euclid(TAU)).collect())
}

#[track_caller]
fn same_angle(found: f64, expected: f64, what: &str) {
    assert!(((found - expected + PI).rem_euclid(TAU) - PI).abs() < 1e-7, "{what}: {found}, not {expected}");
}

/// Point, outer unit normal of an ellipse at an eccentric angle.
fn ellipse(a: f64, b: f64, u: f64) -> (Vec3<f64>, Vec3<f64>) {
    (Vec3::new(a * u.cos(), b * u.sin(), 0.0), Vec3::new(b * u.cos(), a * u.sin(), 0.0).normalize())
}

fn about_z(v: Vec3<f64>, angle: f64) -> Vec3<f64> {
    let (sin, cos) = angle.sin_cos();
    Vec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z)
}

/// A start, among them the far side and midway.
fn start(random: &mut Random, place: f64, trial: usize) -> f64 {
    match trial % 4 {
        0 => place + PI,
        1 => place + 0.5 * PI,
        2 => place - 0.5 * PI,
        _ => random.between(-7.0, 7.0),
    }
}

/// Ellipses of all sizes and shapes, r(phi) as a function, against a face: the support function of an ellipse.
#[test]
fn a_flat_face_touches_the_near_side_from_any_start() {
    let mut random = Random::new(31);
    for trial in 0..TRIALS {
        let unit = 10_f64.powf(random.between(-3.0, 3.0));
        let (a, b) = (unit * random.between(0.5, 1.0), unit * random.between(0.5, 1.0));
        let (angle, apart, aside) =
            (random.between(-PI, PI), random.between(-0.2, 2.0) * unit, random.between(-1.0, 1.0));
        let e = about_z(Vec3::x(), angle);
        let support = (a * e.x).hypot(b * e.y);
        let place = (b * b * e.y).atan2(a * a * e.x);
        let at = e * (support + apart) + about_z(Vec3::y(), angle) * (aside * unit);
        let start = start(&mut random, place, trial);
        let params = format!("follower = 'flat'\nunilateral = true\nstart = {start:?}\n{}", oval(a, b));
        let (gap, places) = found::<ProfileContact>(&params, &mut random, at, angle);
        assert!((gap - apart).abs() < 1e-9 * unit, "{params}: {gap}, not {apart}");
        same_angle(places[0], place, &params);
        // Where they stay together, its x axis may point at the cam.
        let params = params.replace("unilateral = true", "");
        let (_, places) = found::<ProfileContact>(&params, &mut random, e * support, angle + PI);
        same_angle(places[0], place, &params);
    }
}

/// a b / sqrt((b cos phi)^2 + (a sin phi)^2)
fn oval(a: f64, b: f64) -> String {
    format!(
        "radius = {{ postfix = [{:?}, {b:?}, 'x', 'cos', 'mul', 2, 'pow', {a:?}, 'x', 'sin', 'mul', 2, 'pow', 'add', 'sqrt', 'div'] }}",
        a * b
    )
}

#[test]
fn a_roller_touches_the_near_side_from_any_start() {
    let mut random = Random::new(32);
    for trial in 0..TRIALS {
        let unit = 10_f64.powf(random.between(-3.0, 3.0));
        let (a, b) = (unit * random.between(0.4, 1.0), unit * random.between(0.4, 1.0));
        let roller = unit * random.between(0.0, 1.0);
        let (point, normal) = ellipse(a, b, random.between(-PI, PI));
        let touching = point + normal * roller;
        let away = random.between(0.9, 3.0);
        let place = point.y.atan2(point.x);
        let start = start(&mut random, place, trial);
        let params = format!("roller_radius = {roller:?}\nunilateral = true\nstart = {start:?}\n{}", oval(a, b));
        let angle = random.between(-PI, PI);
        let (gap, places) = found::<ProfileContact>(&params, &mut random, touching * away, angle);
        let apart = (away - 1.0) * normal.dot(&touching);
        assert!((gap - apart).abs() < 1e-9 * unit, "{params}: {gap}, not {apart}");
        same_angle(places[0], place, &params);
    }
}

#[test]
fn ellipses_touch_on_their_near_sides_from_any_start() {
    let mut random = Random::new(33);
    for trial in 0..TRIALS {
        let unit = 10_f64.powf(random.between(-3.0, 3.0));
        let [a, b, c, d] = std::array::from_fn(|_| unit * 10_f64.powf(random.between(-1.2, 0.0)));
        let (u, angle) = (random.between(-PI, PI), random.between(-PI, PI));
        let (point, normal) = ellipse(a, b, u);
        // Where the second has the opposite normal, in its own axes.
        let back = about_z(-normal, -angle);
        let v = (d * back.y).atan2(c * back.x);
        let touching = point - about_z(ellipse(c, d, v).0, angle);
        let away = random.between(1.0, 3.0);
        let starts = [start(&mut random, u, trial), start(&mut random, v, trial / 4)];
        for settings in ["unilateral = true", ""] {
            let [first, other] = starts;
            let params = format!(
                "a_i = {a:?}\nb_i = {b:?}\na_j = {c:?}\nb_j = {d:?}\nstart_i = {first:?}\nstart_j = {other:?}\n{settings}"
            );
            let (gap, places) = found::<EllipseContact>(&params, &mut random, touching * away, angle);
            let apart = (away - 1.0) * normal.dot(&touching);
            assert!((gap - apart).abs() < 1e-9 * unit, "{params}: {gap}, not {apart}");
            same_angle(places[0], u, &params);
            same_angle(places[1], v, &params);
        }
    }
}

/// One that does not fit into the other, as they are turned, has no place in it.
#[test]
fn discs_run_in_those_into_which_they_fit() {
    // The smaller one on the wall of the larger one below its centre, turned by an angle.
    let has_place = |a: f64, b: f64, angle: f64| {
        let text = format!("a_i = 0.5\nb_i = 0.2\na_j = {a:?}\nb_j = {b:?}\nstart_i = -1.5\nstart_j = -1.5");
        let probe = probe::<EllipseContact>(&text);
        let (sin, cos) = angle.sin_cos();
        let i = Random::new(7).frame();
        let low = (a * a * sin * sin + b * b * cos * cos).sqrt();
        let place = Vec3::new((a * a - b * b) * sin * cos / low, low - 0.2, 0.0);
        let j = Frame { position: i.position + i.rotation * place, ..on_common_axis(&i, angle, 0.0) };
        let mut setting = Setting::at_rest(vec![i, j]);
        probe.settle(&mut setting);
        probe.solve_unknowns(&mut setting) && probe.joint_values(&setting).residual()[0].abs() < 1e-9
    };
    // The least radius of curvature of the larger one is 0.2^2 / 0.5 = 0.08.
    for angle in [0.0, 0.4, 1.5] {
        assert!(has_place(0.0799, 0.0799, angle) && !has_place(0.0801, 0.0801, angle), "{angle}");
    }
    // The same shape, 0.3 times as large: to be turned by 0.403 rad.
    for angle in [0.0, 0.39, -0.39] {
        assert!(has_place(0.15, 0.06, angle), "{angle}");
    }
    assert!(!has_place(0.15, 0.06, 0.42) && !has_place(0.15, 0.06, -0.42));
}

/// A disc in a ring, and the ring about the disc.
#[test]
fn discs_that_never_part_run_in_each_other() {
    let mut random = Random::new(34);
    for trial in 0..TRIALS {
        let (a, b) = (random.between(0.5, 1.0), random.between(0.5, 1.0));
        let fitting = 0.9 * (a * a / b).min(b * b / a);
        let (r, u, angle) = (fitting * random.between(0.1, 1.0), random.between(-PI, PI), random.between(-PI, PI));
        let (point, normal) = ellipse(a, b, u);
        let ring =
            format!("a_i = {a:?}\nb_i = {b:?}\na_j = {r:?}\nb_j = {r:?}\nstart_i = {:?}", start(&mut random, u, trial));
        let (gap, places) = found::<EllipseContact>(&ring, &mut random, point - normal * r, angle);
        assert!(gap.abs() < 1e-9, "{ring}: {gap}");
        same_angle(places[0], u, &ring);
        let disc =
            format!("a_j = {a:?}\nb_j = {b:?}\na_i = {r:?}\nb_i = {r:?}\nstart_j = {:?}", start(&mut random, u, trial));
        let (gap, places) = found::<EllipseContact>(&disc, &mut random, about_z(normal * r - point, angle), angle);
        assert!(gap.abs() < 1e-9, "{disc}: {gap}");
        same_angle(places[1], u, &disc);
    }
}
