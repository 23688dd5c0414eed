//! Joints that let go: against closed forms, in both coordinates, by every method that chooses its steps.

use odyn::results::{Event, EventKind};
use odyn::session::RunReport;

use crate::contacts::{every_way_agrees, run};
use crate::support::{column, difference};

pub(crate) const G: f64 = 9.81;

pub(crate) fn head(t_end: f64) -> String {
    format!(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\", \"odyn-controls\"]\n[simulation]\ngravity = [0, 0, -9.81]\n\
         tolerance = 1e-11\nt_end = {t_end:?}\noutput_step = 0.01\n"
    )
}

pub(crate) fn body(name: &str, mass: f64, inertia: f64, place: [f64; 3]) -> String {
    format!(
        "[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = [{inertia:?}, {inertia:?}, {inertia:?}]\nposition = {place:?}\n"
    )
}

fn hinge(name: &str, bodies: [&str; 2], point: [f64; 3], more: &str) -> String {
    format!(
        "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nbodies = {bodies:?}\npoint = {point:?}\naxis = [0, 1, 0]\n{more}\n"
    )
}

pub(crate) fn output(name: &str, quantity: &str, of: &str, component: &str) -> String {
    let component = if component.is_empty() { String::new() } else { format!("component = \"{component}\"\n") };
    format!("[[output]]\nname = \"{name}\"\nquantity = \"{quantity}\"\nof = \"{of}\"\n{component}")
}

/// A particle on a cord of 1 m that is let go from an angle.
const START: f64 = 1.2;

pub(crate) fn pendulum(release: &str, t_end: f64) -> String {
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

pub(crate) fn released(report: &RunReport) -> Vec<&Event> {
    report.events.iter().filter(|event| event.kind == EventKind::Releases).collect()
}

/// The time that a pendulum takes from rest at [`START`] to an angle: with sin(a/2) = k sin(u), by the midpoint rule, which converges
/// like no other for what is smooth and periodic; the quarter that is not whole by Gauss.
pub(crate) fn time_to(angle: f64) -> f64 {
    let k = (START / 2.0).sin();
    let u = ((angle / 2.0).sin() / k).asin();
    // From u to pi / 2, by Simpson with many places.
    let (n, from, to) = (20_000, u, std::f64::consts::FRAC_PI_2);
    let h = (to - from) / f64::from(n);
    let f = |u: f64| 1.0 / (1.0 - (k * u.sin()).powi(2)).sqrt();
    let sum: f64 = (0..n)
        .map(|i| {
            let a = from + h * f64::from(i);
            h / 6.0 * (f(a) + 4.0 * f(a + h / 2.0) + f(a + h))
        })
        .sum();
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
        assert!(difference(a, b) < 1e-8);
    }
}

/// A bound that a signal begins at is passed where the signal goes beyond it, not before.
#[test]
fn what_begins_at_a_bound_has_to_leave_it() {
    let level = format!("{:?}", -START.cos());
    // The bob goes down first, and comes back as high on the other side only.
    let held = run(&pendulum(&format!("{{ when = \"z\", above = {level} }}"), 1.0), &[]);
    assert!(held.events.is_empty(), "{:?}", held.events);
    // It moves at once, from rest.
    for release in [format!("{{ when = \"z\", below = {level} }}"), "{ when = \"vx\", below = 0 }".into()] {
        for method in ["dop853", "radau5"] {
            let report = run(&pendulum(&release, 0.5), &[&format!("simulation.method = \"{method}\"")]);
            let event = released(&report)[0];
            assert!(event.time < 1e-6, "{release}: {event:?}");
            for (z, t) in column(&report, "z").iter().zip(&report.times) {
                assert!((z + START.cos() + G / 2.0 * t * t).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn it_lets_go_at_a_time() {
    let report = every_way_agrees(&pendulum("{ at = \"400 ms\" }", 1.0), 1e-8);
    assert!((released(&report)[0].time - 0.4).abs() < 1e-14);
}

/// Planar bodies on two links, the second of which is lost.
fn double(release: &str) -> String {
    head(1.2)
        + &body("a", 1.0, 0.03, [0.5, 0.0, 0.0])
        + &body("b", 0.7, 0.02, [1.4, 0.0, 0.0])
        + &hinge("first", ["ground", "a"], [0.0; 3], "")
        + &hinge("second", ["a", "b"], [1.0, 0.0, 0.0], &format!("release = {release}"))
        + &["a", "b"]
            .map(|one| {
                output(&format!("x{one}"), "position", one, "x")
                    + &output(&format!("z{one}"), "position", one, "z")
                    + &output(&format!("vx{one}"), "velocity", one, "x")
                    + &output(&format!("vz{one}"), "velocity", one, "z")
                    + &output(&format!("w{one}"), "angular_velocity", one, "y")
            })
            .concat()
        + "[[output]]\nname = \"E\"\nquantity = \"total_energy\"\n"
}

#[test]
fn a_lost_link_flies_with_the_momentum_that_it_had() {
    let report = every_way_agrees(&double("{ at = 0.5 }"), 1e-8);
    let last = report.times.iter().position(|t| *t == 0.5).unwrap();
    let before = |name| column(&report, name)[last];
    for (k, t) in report.times.iter().enumerate().skip(last) {
        let (at, d) = (|name| column(&report, name)[k], t - 0.5);
        assert!((at("xb") - before("xb") - before("vxb") * d).abs() < 1e-10);
        assert!((at("zb") - before("zb") - before("vzb") * d + G / 2.0 * d * d).abs() < 1e-10);
        assert!((at("wb") - before("wb")).abs() < 1e-10);
        // The first link swings on with its own energy.
        let energy = |w: f64, z: f64| 0.5 * (0.03 + 0.25) * w * w + G * z;
        assert!((energy(at("wa"), at("za")) - energy(before("wa"), before("za"))).abs() < 1e-9);
        assert!((at("E") - column(&report, "E")[0]).abs() < 1e-9);
    }
}

#[test]
fn a_four_bar_becomes_an_open_chain() {
    let text = head(1.5)
        + &body("crank", 1.0, 0.03, [0.15, 0.0, 0.2])
        + &body("rod", 2.0, 0.1, [0.7, 0.0, 0.45])
        + &body("rocker", 1.5, 0.05, [1.05, 0.0, 0.25])
        + &hinge("a", ["ground", "crank"], [0.0; 3], "")
        + &hinge("b", ["crank", "rod"], [0.3, 0.0, 0.4], "")
        + &hinge("c", ["rod", "rocker"], [1.1, 0.0, 0.5], "release = { at = 0.6 }")
        + &hinge("d", ["ground", "rocker"], [1.0, 0.0, 0.0], "")
        + &output("w", "angular_velocity", "rocker", "y")
        + &output("z", "position", "rocker", "z")
        + &output("wr", "angular_velocity", "rod", "y")
        + &output("F", "reaction_force", "c", "magnitude")
        + "[[output]]\nname = \"E\"\nquantity = \"total_energy\"\n";
    let report = every_way_agrees(&text, 1e-7);
    let last = report.times.iter().position(|t| *t == 0.6).unwrap();
    let energy = |k: usize| {
        let [w, z] = ["w", "z"].map(|name| column(&report, name)[k]);
        0.5 * (0.05 + 1.5 * (0.05_f64.powi(2) + 0.25_f64.powi(2))) * w * w + 1.5 * G * z
    };
    for k in last..report.times.len() {
        // The rocker is a pendulum by itself.
        assert!((energy(k) - energy(last)).abs() < 1e-9);
        assert!((column(&report, "E")[k] - column(&report, "E")[0]).abs() < 1e-8);
        assert!(k == last || column(&report, "F")[k] == 0.0);
    }
    assert!(column(&report, "F")[last] > 1.0);
}

/// A trebuchet: a beam with its counterweight, a stone on a sling that lets go at an angle of the beam.
#[test]
fn a_trebuchet_throws_as_its_own_equations_say() {
    const LONG: f64 = 4.0;
    const SLING: f64 = 3.0;
    const STONE: f64 = 8.0;
    // Of the beam: mass, centre along it, inertia about the pivot.
    const BEAM: f64 = 600.0;
    const AT: f64 = -0.8;
    const J: f64 = 1500.0 + BEAM * AT * AT;
    let (start, release) = (-0.6_f64, 1.3_f64);
    let rates = |y: [f64; 4]| {
        let [a, b, p, q] = y;
        let (across, along) = (LONG * SLING * STONE * (a - b).cos(), LONG * SLING * STONE * (a - b).sin());
        let [m11, m22] = [J + STONE * LONG * LONG, STONE * SLING * SLING];
        let f1 = -along * q * q - (BEAM * AT + STONE * LONG) * G * a.cos();
        let f2 = along * p * p - STONE * G * SLING * b.cos();
        let det = m11 * m22 - across * across;
        [p, q, (m22 * f1 - across * f2) / det, (m11 * f2 - across * f1) / det]
    };
    let step = |y: [f64; 4], h: f64| {
        let ahead = |k: [f64; 4], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
        let k1 = rates(y);
        let k2 = rates(ahead(k1, h / 2.0));
        let k3 = rates(ahead(k2, h / 2.0));
        let k4 = rates(ahead(k3, h));
        std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    };
    let (mut y, mut t, h) = ([start, std::f64::consts::PI, 0.0, 0.0], 0.0, 1e-4);
    while step(y, h)[0] < release {
        (y, t) = (step(y, h), t + h);
    }
    let rest = crate::support::bisected(0.0, h, |h| release - step(y, h)[0]);
    (y, t) = (step(y, rest), t + rest);
    let tip = [LONG * start.cos(), LONG * start.sin()];
    let stone = [tip[0] - SLING, tip[1]];
    let text = head(1.7)
        + &body("beam", BEAM, 1500.0, [AT * start.cos(), 0.0, AT * start.sin()])
        + &format!(
            "[[body]]\nname = \"stone\"\nmass = {STONE:?}\nparticle = true\nposition = [{:?}, 0, {:?}]\n[[joint]]\nname = \"pivot\"\n\
             type = \"revolute\"\nbodies = [\"ground\", \"beam\"]\npoint = [0, 0, 0]\naxis = [0, -1, 0]\n[[joint]]\nname = \"sling\"\n\
             type = \"distance-rod\"\nbodies = [\"beam\", \"stone\"]\npoints = [[{:?}, 0, {:?}], [{:?}, 0, {:?}]]\nparams.length = {SLING:?}\n\
             release = {{ when = \"pivot.angle\", above = {:?} }}\n",
            stone[0],
            stone[1],
            tip[0],
            tip[1],
            stone[0],
            stone[1],
            release - start
        )
        + &output("x", "position", "stone", "x")
        + &output("z", "position", "stone", "z");
    let report = every_way_agrees(&text, 1e-7);
    assert!((released(&report)[0].time - t).abs() < 1e-9, "{} {t}", released(&report)[0].time);
    let [a, b, p, q] = y;
    for (k, time) in report.times.iter().enumerate().filter(|(_, time)| **time > t) {
        let d = time - t;
        let x = LONG * a.cos() + SLING * b.cos() - (LONG * a.sin() * p + SLING * b.sin() * q) * d;
        let z = LONG * a.sin() + SLING * b.sin() + (LONG * a.cos() * p + SLING * b.cos() * q) * d - G / 2.0 * d * d;
        assert!((column(&report, "x")[k] - x).abs() < 1e-8 && (column(&report, "z")[k] - z).abs() < 1e-8);
    }
}

/// A door on two hinges that share its weight.
pub(crate) fn door(first: &str, second: &str) -> String {
    head(0.8)
        + &body("door", 3.0, 0.2, [0.5, 0.0, 0.0])
        + &hinge("one", ["ground", "door"], [0.0, -0.4, 0.0], first)
        + &hinge("two", ["ground", "door"], [0.0, 0.4, 0.0], second)
        + &output("w", "angular_velocity", "door", "y")
        + &output("ax", "acceleration", "door", "x")
        + &output("az", "acceleration", "door", "z")
        + &output("vz", "velocity", "door", "z")
        + &output("F", "reaction_force", "one", "magnitude")
        + &output("Fx", "reaction_force", "two", "x")
        + &output("Fz", "reaction_force", "two", "z")
        + &output("Mx", "reaction_torque", "two", "x")
}

#[test]
fn of_two_hinges_that_share_a_load_one_takes_it_all() {
    let text = door("release = { at = 0.3 }", "");
    let ways = ["cartesian", "joint"].map(|form| run(&text, &[&format!("simulation.formulation = \"{form}\"")]));
    let plain = run(&door("", ""), &[]);
    for report in &ways {
        for (k, t) in report.times.iter().enumerate().filter(|(_, t)| **t > 0.3) {
            let at = |name| column(report, name)[k];
            assert!((at("w") - column(&plain, "w")[k]).abs() < 1e-9);
            assert!((at("Fx") - 3.0 * at("ax")).abs() < 1e-9 && (at("Fz") - 3.0 * (at("az") + G)).abs() < 1e-9, "{t}");
            // It holds what pulls 0.4 m beside it.
            assert!((at("Mx").abs() - 0.4 * at("Fz").abs()).abs() < 1e-9, "{} {}", at("Mx"), at("Fz"));
            assert_eq!(at("F"), 0.0);
        }
    }
}

#[test]
fn two_let_go_at_one_instant() {
    for second in ["release = { at = 0.3 }", "release = { at = 0.5 }"] {
        let report = every_way_agrees(&door("release = { at = 0.3 }", second), f64::INFINITY);
        let last = if second.contains("0.3") { 0.3 } else { 0.5 };
        assert_eq!(released(&report).len(), 2);
        assert!((released(&report)[1].time - last).abs() < 1e-14);
        let from = report.times.iter().position(|t| *t > last).unwrap();
        let (w, vz) = (column(&report, "w"), column(&report, "vz"));
        for k in from..w.len() {
            assert!((w[k] - w[from]).abs() < 1e-12);
            assert!((vz[k] - vz[from] + G * (report.times[k] - report.times[from])).abs() < 1e-9);
        }
    }
}

/// What one cord held is taken by the other: less than half of the weight before it turns, and the cord slips off its hook.
#[test]
fn what_takes_over_may_let_go_for_it() {
    let cord = |name: &str, x: f64, release: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"distance-rod\"\nbodies = [\"ground\", \"bar\"]\n\
             points = [[{x:?}, 0, 0], [{x:?}, 0, -1]]\nparams.length = 1\nrelease = {release}\n"
        )
    };
    let text = head(0.6)
        + &body("bar", 10.0, 1.0, [0.0, 0.0, -1.0])
        + &cord("left", -0.5, "{ at = 0.2 }")
        + &cord("right", 0.5, "{ when = \"T\", below = 30 }")
        + "[[joint]]\nname = \"plane\"\ntype = \"planar\"\nbodies = [\"ground\", \"bar\"]\npoint = [0, 0, -1]\naxis = [0, 1, 0]\n"
        + &output("T", "reaction_force", "right", "magnitude")
        + &output("z", "position", "bar", "z")
        + &output("w", "angular_velocity", "bar", "y");
    let report = every_way_agrees(&text, 1e-9);
    let [first, second] = released(&report)[..] else { panic!("{:?}", report.events) };
    assert_eq!((first.element.as_str(), second.element.as_str(), first.time), ("left", "right", second.time));
    // m g / (1 + m l^2 / J)
    assert!(second.row.starts_with("T = 28.0285714 N"), "{}", second.row);
    for (t, (z, w)) in report.times.iter().zip(column(&report, "z").iter().zip(column(&report, "w"))) {
        assert!((z + 1.0 + G / 2.0 * (t - 0.2).max(0.0).powi(2)).abs() < 1e-10 && w.abs() < 1e-12);
    }
}

#[test]
fn contacts_and_friction_go_with_their_joint() {
    let ball = head(2.5)
        + &body("ball", 0.2, 2e-4, [0.0, 0.0, 1.05])
        + "[[joint]]\nname = \"clamp\"\ntype = \"bracket\"\nbodies = [\"ground\", \"ball\"]\npoint = [0, 0, 1.05]\nrelease = { at = 0.1 }\n\
           [[joint]]\nname = \"floor\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"ball\"]\n\
           frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0] }]\nparams.radius = 0.05\n\
           params.restitution = 0.5\nparams.mu = 0.3\nrelease = { at = 2 }\n"
        + &output("z", "position", "ball", "z")
        + &output("N", "reaction_force", "floor", "z");
    let report = every_way_agrees(&ball, 1e-8);
    let impact = report.events.iter().find(|event| event.kind == EventKind::Impact).unwrap().time;
    assert!((impact - 0.1 - (2.0 / G).sqrt()).abs() < 1e-10);
    for (t, (z, load)) in report.times.iter().zip(column(&report, "z").iter().zip(column(&report, "N"))) {
        if *t > 2.0 {
            assert!((z - 0.05 + G / 2.0 * (t - 2.0).powi(2)).abs() < 1e-10 && *load == 0.0);
        } else if *t > 1.5 {
            assert!((load - 0.2 * G).abs() < 1e-10);
        }
    }
    let mut clutch = head(1.0);
    for (name, z, w) in [("a", 0.0, 10.0), ("b", 1.0, 0.0)] {
        clutch += &(body(name, 1.0, 0.1, [0.0, 0.0, z]) + &format!("angular_velocity = [0, 0, {w:?}]\n"));
        clutch += &hinge(&format!("of_{name}"), ["ground", name], [0.0, 0.0, z], "").replace("[0, 1, 0]", "[0, 0, 1]");
        clutch += &output(&format!("w{name}"), "angular_velocity", name, "z");
    }
    clutch += "[[joint]]\nname = \"clutch\"\ntype = \"clutch\"\nbodies = [\"a\", \"b\"]\npoint = [0, 0, 0.5]\naxis = [0, 0, 1]\n\
               params.capacity = 2\nrelease = { at = 0.1 }\n";
    let report = every_way_agrees(&clutch, 1e-9);
    for (t, (a, b)) in report.times.iter().zip(column(&report, "wa").iter().zip(column(&report, "wb"))) {
        let turned = 20.0 * t.min(0.1);
        assert!((a - 10.0 + turned).abs() < 1e-10 && (b - turned).abs() < 1e-10);
    }
}

/// Of a wheel that its hinge holds in a plane, too: driven rows beside redundant ones are watched within steps, as long as they hold.
#[test]
fn a_driver_lets_go() {
    let joint = |name: &str, kind: &str, more: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"ground\", \"wheel\"]\npoint = [0, 0, 0]\n\
             axis = [0, 0, 1]\n{more}\n"
        )
    };
    let text = head(1.0)
        + &body("wheel", 1.0, 0.1, [0.5, 0.0, 0.0])
        + &joint("axle", "revolute", "")
        + &joint("guide", "planar", "")
        + &joint("motor", "rotation-driver", "params.angle = \"t^2\"\nrelease = { at = 0.5 }")
        + &output("w", "angular_velocity", "wheel", "z")
        + &output("M", "reaction_torque", "motor", "z");
    let report = every_way_agrees(&text, 1e-8);
    for (t, (w, torque)) in report.times.iter().zip(column(&report, "w").iter().zip(column(&report, "M"))) {
        assert!((w - 2.0 * t.min(0.5)).abs() < 1e-10);
        assert!((torque - if *t <= 0.5 { 0.7 } else { 0.0 }).abs() < 1e-9, "{t} {torque}");
    }
}

/// A weight in a clamp that a signal opens.
fn clamped(release: &str, controls: &str) -> String {
    head(1.0)
        + &body("weight", 1.0, 0.1, [0.0; 3])
        + &format!(
            "[[joint]]\nname = \"clamp\"\ntype = \"bracket\"\nbodies = [\"ground\", \"weight\"]\npoint = [0, 0, 0]\nrelease = {release}\n"
        )
        + controls
        + &output("z", "position", "weight", "z")
}

#[test]
fn signals_that_jump_and_that_sample_let_go() {
    let source =
        |function: &str| format!("[[control]]\nname = \"s\"\ntype = \"signal-source\"\nparams.function = {function}\n");
    let jump = source("{ points = [[0, 0], [0.333, 1], [2, 1]], interpolation = \"steps\" }");
    let sampled = source("\"t\"")
        + "[[control]]\nname = \"c\"\ntype = \"digital-pid\"\ninputs = { set_point = \"s.output\", measured = 0 }\n\
           params.period = \"0.1 s\"\nparams.kp = 4\n";
    // A ramp, a jump, a pulse between two samples, a controller that samples.
    for (release, controls, at) in [
        ("{ when = \"s.output\", above = 0.5 }", source("\"t\""), 0.5),
        ("{ when = \"s.output\", above = 0.5 }", jump, 0.333),
        (
            "{ when = \"s.output\", above = 0.5 }",
            source("\"exp(-((t - 0.4777) * 2000)^2)\""),
            0.4777 - 2_f64.ln().sqrt() / 2000.0,
        ),
        ("{ when = \"c.output\", above = 1.5 }", sampled, 0.4),
    ] {
        let report = every_way_agrees(&clamped(release, &controls), 1e-9);
        assert!((released(&report)[0].time - at).abs() < 1e-12, "{:?} {at}", report.events);
        for (z, t) in column(&report, "z").iter().zip(&report.times) {
            assert!((z + G / 2.0 * (t - at).max(0.0).powi(2)).abs() < 1e-10);
        }
    }
}

#[test]
fn a_place_where_a_signal_jumps_lets_go() {
    // A look-up with steps over the way of a slider.
    let text = head(1.0)
        + &body("slider", 1.0, 0.1, [0.0; 3])
        + "velocity = [1, 0, 0]\n[[joint]]\nname = \"way\"\ntype = \"translational\"\nbodies = [\"ground\", \"slider\"]\npoint = [0, 0, 0]\n\
           axis = [1, 0, 0]\nrelease = { when = \"map.output\", above = 0.5 }\n[[control]]\nname = \"map\"\ntype = \"look-up\"\n\
           inputs = { input = \"x\" }\nparams.function = { points = [[-1, 0], [0.3217, 1], [2, 1]], interpolation = \"steps\" }\n"
        + &output("x", "position", "slider", "x")
        + &output("z", "position", "slider", "z");
    let report = every_way_agrees(&text, 1e-9);
    assert!((released(&report)[0].time - 0.3217).abs() < 1e-10, "{:?}", report.events);
}
