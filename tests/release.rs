//! Joints that let go: against closed forms, in both coordinates, by every method that chooses its steps.

use odyn::results::{Event, EventKind};
use odyn::session::{RunOptions, RunReport, Session};

use crate::contacts::{every_way_agrees, run, try_run};
use crate::support::{Scratch, column, open_text, options};

const G: f64 = 9.81;

fn head(t_end: f64) -> String {
    format!(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\", \"odyn-controls\"]\n[simulation]\ngravity = [0, 0, -9.81]\n\
         tolerance = 1e-11\nt_end = {t_end:?}\noutput_step = 0.01\n"
    )
}

fn body(name: &str, mass: f64, inertia: f64, place: [f64; 3]) -> String {
    format!("[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = [{inertia:?}, {inertia:?}, {inertia:?}]\nposition = {place:?}\n")
}

fn hinge(name: &str, bodies: [&str; 2], point: [f64; 3], more: &str) -> String {
    format!("[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nbodies = {bodies:?}\npoint = {point:?}\naxis = [0, 1, 0]\n{more}\n")
}

fn output(name: &str, quantity: &str, of: &str, component: &str) -> String {
    let component = if component.is_empty() { String::new() } else { format!("component = \"{component}\"\n") };
    format!("[[output]]\nname = \"{name}\"\nquantity = \"{quantity}\"\nof = \"{of}\"\n{component}")
}

/// A particle on a cord of 1 m that is let go from an angle.
const START: f64 = 1.2;

fn pendulum(release: &str, t_end: f64) -> String {
    let (x, z) = (START.sin(), -START.cos());
    head(t_end)
        + &format!(
            "[[body]]\nname = \"bob\"\nmass = 2\nparticle = true\nposition = [{x:?}, 0, {z:?}]\n[[joint]]\nname = \"cord\"\n\
             type = \"distance-rod\"\nbodies = [\"ground\", \"bob\"]\npoints = [[0, 0, 0], [{x:?}, 0, {z:?}]]\nparams.length = 1\n\
             release = {release}\n"
        )
        + &output("x", "position", "bob", "x")
        + &output("z", "position", "bob", "z")
        + &output("vx", "velocity", "bob", "x")
        + &output("vz", "velocity", "bob", "z")
        + &output("T", "reaction_force", "cord", "magnitude")
}

fn released(report: &RunReport) -> Vec<&Event> {
    report.events.iter().filter(|event| event.kind == EventKind::Releases).collect()
}

/// The time that a pendulum takes from rest at [`START`] to an angle: with sin(a/2) = k sin(u), by the midpoint rule, which converges
/// like no other for what is smooth and periodic; the quarter that is not whole by Gauss.
fn time_to(angle: f64) -> f64 {
    let k = (START / 2.0).sin();
    let u = ((angle / 2.0).sin() / k).asin();
    // From u to pi / 2, by Simpson with many places.
    let (n, from, to) = (20_000, u, std::f64::consts::FRAC_PI_2);
    let h = (to - from) / f64::from(n);
    let f = |u: f64| 1.0 / (1.0 - (k * u.sin()).powi(2)).sqrt();
    let sum: f64 = (0..n).map(|i| {
        let a = from + h * f64::from(i);
        h / 6.0 * (f(a) + 4.0 * f(a + h / 2.0) + f(a + h))
    }).sum();
    sum / G.sqrt()
}

/// After the release at an angle, the bob flies on a parabola from where it was.
#[track_caller]
fn flies_from(report: &RunReport, angle: f64) {
    let event = released(report)[0].time;
    assert!((event - time_to(angle)).abs() < 1e-9, "{event} {}", time_to(angle));
    let speed = -(2.0 * G * (angle.cos() - START.cos())).sqrt();
    let mut flown = 0;
    for (k, t) in report.times.iter().enumerate() {
        let at = |name| column(report, name)[k];
        if *t < event {
            assert!(at("T") > 1.0);
            continue;
        }
        let d = t - event;
        let x = angle.sin() + speed * angle.cos() * d;
        let z = -angle.cos() + speed * angle.sin() * d - G / 2.0 * d * d;
        assert!((at("x") - x).abs() < 1e-9 && (at("z") - z).abs() < 1e-9, "{t}: {} {x}, {} {z}", at("x"), at("z"));
        assert!((at("vx") - speed * angle.cos()).abs() < 1e-9);
        assert_eq!(at("T"), 0.0);
        flown += 1;
    }
    assert!(flown > 10);
}

#[test]
fn a_bob_that_is_released_at_an_angle_flies_on_a_parabola() {
    let angle = -0.5_f64;
    let text = pendulum(&format!("{{ when = \"x\", below = {:?} }}", angle.sin()), 1.0);
    let report = every_way_agrees(&text, 1e-8);
    flies_from(&report, angle);
    let told = &report.summary.releases;
    assert_eq!((told.len(), told[0].joint.as_str()), (1, "cord"));
    assert!(told[0].by.starts_with("x = -0.479425539 m"), "{told:?}");
}

#[test]
fn a_cord_breaks_at_its_tension() {
    // T = m g (3 cos a - 2 cos a0)
    let text = pendulum("{ when = \"T\", above = \"40 N\" }", 1.0);
    let angle = ((40.0 / (2.0 * G) + 2.0 * START.cos()) / 3.0).acos();
    flies_from(&every_way_agrees(&text, 1e-8), angle);
}

#[test]
fn a_joint_may_let_go_at_the_start_and_need_not_at_all() {
    for release in ["{ at = 0 }", "{ when = \"T\", above = 1 }", "{ when = \"T\", below = 100 }"] {
        let report = every_way_agrees(&pendulum(release, 0.5), 1e-10);
        assert_eq!(released(&report)[0].time, 0.0);
        for (z, t) in column(&report, "z").iter().zip(&report.times) {
            assert!((z + START.cos() + G / 2.0 * t * t).abs() < 1e-10);
        }
        assert!(column(&report, "T").iter().all(|load| *load == 0.0));
    }
    let held = run(&pendulum("{ when = \"T\", above = 1000 }", 1.0), &[]);
    assert!(held.events.is_empty() && held.summary.releases.is_empty());
    let plain = run(&pendulum("{ when = \"T\", above = 1000 }", 1.0).replace("release = ", "#"), &[]);
    for (a, b) in held.columns.iter().zip(&plain.columns) {
        assert!(crate::support::difference(a, b) < 1e-8);
    }
}

#[test]
fn it_lets_go_at_a_time() {
    let report = every_way_agrees(&pendulum("{ at = \"400 ms\" }", 1.0), 1e-8);
    assert!((released(&report)[0].time - 0.4).abs() < 1e-14);
}
