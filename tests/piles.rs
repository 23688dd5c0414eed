//! Many bodies of which any may touch any other: what does not touch takes no part in the equations.

use nalgebra::{Rotation3, Vector3};
use odyn::analysis::Evaluator;

use crate::contacts::{run, try_run};
use crate::support::{Scratch, column, difference, open_text};

/// Half the width of the trough, m.
const WALLS: [f64; 2] = [0.3, 0.2];

/// Balls that fall into a trough with a floor and four walls, each a little beside the others.
fn balls(count: usize, friction: &str) -> String {
    let mut text = String::from(
        "[plugins]\nlibraries = [\"joints\"]\n\
         [simulation]\ngravity = [0, 0, -9.81]\nt_end = 0.25\noutput_step = 0.01\ntolerance = 1e-9\n",
    );
    let contact = |kind: &str, bodies: [String; 2], frames: &str, radii: &str| {
        format!(
            "[[joint]]\nname = \"{}-{}\"\ntype = \"{kind}\"\nbodies = {bodies:?}\nframes = {frames}\n\
             params = {{ {radii}, restitution = 0.4{friction} }}\n",
            bodies[0], bodies[1]
        )
    };
    let ball = |k: usize| format!("ball{k}");
    for k in 0..count {
        let [x, y, z] = [0.11 * (k % 3) as f64 - 0.12, 0.03 * (k % 2) as f64, 0.06 + 0.11 * (k / 3) as f64];
        text += &format!(
            "[[body]]\nname = \"{}\"\nmass = {:?}\ninertia = [2e-4, 2e-4, 2e-4]\nposition = [{x:?}, {y:?}, {z:?}]\n\
             velocity = [{:?}, 0.2, 0]\nangular_velocity = [1, 3, {:?}]\n",
            ball(k),
            0.2 + 0.1 * (k % 3) as f64,
            0.9 - 0.5 * k as f64,
            k as f64,
        );
        let sides = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        for (number, [u, v]) in sides.into_iter().enumerate() {
            let up = if number == 0 { 1 } else { 0 };
            let frames = format!(
                "[{{ position = [{:?}, {:?}, 0], axis = [{:?}, {:?}, {up}] }}, {{ position = [0, 0, 0] }}]",
                WALLS[0] * u,
                WALLS[1] * v,
                -u,
                -v,
            );
            let wall = contact("plane-contact", ["ground".into(), ball(k)], &frames, "radius = 0.05");
            text += &wall.replacen("ground-", &format!("side{number}-"), 1);
        }
        for other in 0..k {
            let frames = "[{ position = [0, 0, 0] }, { position = [0, 0, 0] }]";
            text += &contact("ball-contact", [ball(other), ball(k)], frames, "radius_i = 0.05, radius_j = 0.05");
        }
        for component in ["x", "y", "z"] {
            text += &format!(
                "[[output]]\nname = \"{}.{component}\"\nquantity = \"position\"\nof = \"{}\"\ncomponent = \"{component}\"\n",
                ball(k),
                ball(k)
            );
        }
    }
    text
}

/// The equations with a choice of closed contacts are those of the whole scene where all others have no reaction and do not slide.
#[test]
fn what_does_not_touch_takes_no_part() {
    let session = open_text(&balls(4, ", mu = 0.3"), &[]);
    let (whole, layout) = (&session.equations, &session.plan.layout);
    let contacts = whole.contacts.len();
    assert_eq!((contacts, whole.coupling.len()), (26, 26));
    // Nothing; two that slide; one of them that sticks.
    for (closed, coupled) in [(vec![], 0), (vec![3, 7], 2), (vec![3, 7, contacts + 7], 1)] {
        let mode = whole.in_mode(&closed, layout);
        assert_eq!(mode.coupling.len(), coupled, "{closed:?}");
        let mut inputs: Vec<f64> = (0..layout.inputs()).map(|slot| (1.0 + slot as f64).sin()).collect();
        for row in (0..layout.rows).filter(|row| !mode.is_enforced(*row)) {
            inputs[layout.multiplier_slot() + row] = 0.0;
        }
        for (number, friction) in whole.frictions.iter().enumerate() {
            let slides = friction.contact.is_some_and(|contact| closed.contains(&contact));
            if !slides || closed.contains(&(contacts + number)) {
                let first = layout.discrete_slot() + friction.direction_at;
                // Nor creeps.
                inputs[first..first + friction.rows.len() + usize::from(friction.rows.len() > 1)].fill(0.0);
            }
        }
        let [all, own] = [whole, &mode].map(|equations| {
            let nodes = [&equations.loads[..], &[equations.power]].concat();
            let mut evaluator = Evaluator::new(&equations.graph, &nodes);
            (evaluator.run(&inputs, &[]).unwrap().to_vec(), evaluator.program().operations())
        });
        assert_eq!(all.0, own.0, "{closed:?}");
        assert!(4 * own.1 < all.1, "{closed:?}: {} of {}", own.1, all.1);
    }
}

#[test]
fn balls_in_a_trough_move_alike_in_both_coordinates() {
    for (friction, tolerance) in [("", 1e-7), (", mu = 0.2", 1e-6)] {
        let text = balls(4, friction);
        let [one, other] =
            ["joint", "cartesian"].map(|way| run(&text, &[&format!("simulation.formulation=\"{way}\"")]));
        assert!(one.events.len() > 8, "{}", one.events.len());
        for (channel, (a, b)) in one.channels.iter().zip(one.columns.iter().zip(&other.columns)) {
            let off = difference(a, b);
            assert!(off < tolerance, "{friction}: `{}` differs by {off:.1e}", channel.name);
        }
    }
}

/// Balls that bounce and come to rest on a plane, each for itself.
fn bouncing(count: usize) -> String {
    let mut text = String::from(
        "[plugins]\nlibraries = [\"joints\"]\n\
         [simulation]\ngravity = [0, 0, -9.81]\nt_end = 1\noutput_step = 0.02\ntolerance = 1e-8\n",
    );
    for k in 0..count {
        let radius = 0.04 + 0.003 * k as f64;
        text += &format!(
            "[[body]]\nname = \"ball{k}\"\nmass = {:?}\ninertia = [2e-4, 2e-4, 2e-4]\nposition = [{:?}, 0, {:?}]\n\
             velocity = [{:?}, 0.2, 0]\nangular_velocity = [1, 3, {k}]\n\
             [[joint]]\nname = \"floor{k}\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"ball{k}\"]\n\
             frames = [{{ position = [0, 0, 0], axis = [0, 0, 1] }}, {{ position = [0, 0, 0] }}]\n\
             params = {{ radius = {radius:?}, restitution = {:?}, mu = {:?} }}\n",
            0.2 + 0.1 * (k % 3) as f64,
            0.3 * k as f64,
            radius + 0.02 + 0.007 * (k * 5 % count) as f64,
            0.4 - 0.1 * (k % 4) as f64,
            0.1 * (k % 7) as f64,
            0.05 * (k % 5) as f64,
        );
        for component in ["x", "z"] {
            text += &format!(
                "[[output]]\nname = \"ball{k}.{component}\"\nquantity = \"position\"\nof = \"ball{k}\"\ncomponent = \"{component}\"\n",
            );
        }
    }
    text
}

/// Where many islands switch, the switches of one are no work of the others, and what happens is the same.
#[test]
fn many_that_switch_by_themselves_take_steps_of_their_own() {
    let text = bouncing(12);
    let [own, common] = ["auto", "together"].map(|word| run(&text, &[&format!("simulation.islands=\"{word}\"")]));
    assert_eq!((own.summary.islands.len(), common.summary.islands.len()), (12, 0));
    assert!(own.events.len() > 60 && own.events.len() == common.events.len());
    for (a, b) in own.events.iter().zip(&common.events) {
        assert_eq!((&a.element, a.kind), (&b.element, b.kind));
        assert!((a.time - b.time).abs() < 1e-10, "{a:?} {b:?}");
    }
    for (channel, (a, b)) in own.channels.iter().zip(own.columns.iter().zip(&common.columns)) {
        let off = difference(a, b);
        assert!(off < 1e-10, "`{}` differs by {off:.1e}", channel.name);
    }
    // Each of them is an evaluation of all bodies, where they take common steps.
    let [own, common] = [own.summary.evaluations, 12 * common.summary.evaluations];
    assert!(3 * own < common, "{own} of one ball, {common} where all take part");
}

/// Few islands, and those of a run that is kept, take common steps.
#[test]
fn few_that_switch_take_common_steps_and_so_do_those_that_are_kept() {
    assert!(run(&bouncing(7), &[]).summary.islands.is_empty());
    assert_eq!(run(&bouncing(8), &[]).summary.islands.len(), 8);
    let scratch = Scratch::new();
    let kept = try_run(&bouncing(8), &["simulation.checkpoint_every=0.5"], Some(&scratch.path().join("kept"))).unwrap();
    assert_eq!((kept.exit_code(), kept.summary.islands.len(), kept.summary.checkpoints), (0, 0, 1));
}

/// A radius, a mass, a position, a velocity and an angular velocity.
type Ball = (f64, f64, [f64; 3], [f64; 3], [f64; 3]);

/// Balls that come to hold each other on a floor between four walls, 0.13 m from its middle.
fn heap(law: &str, t_end: f64, all: &[Ball]) -> String {
    let mut text = format!(
        "[plugins]\nlibraries = [\"joints\"]\n\
         [simulation]\ngravity = [0, 0, -9.81]\nt_end = {t_end:?}\noutput_step = 0.02\ntolerance = 1e-8\n"
    );
    for (k, (radius, mass, place, velocity, spin)) in all.iter().enumerate() {
        let moment = 0.4 * mass * radius * radius;
        text += &format!(
            "[[body]]\nname = \"b{k}\"\nmass = {mass:?}\ninertia = [{moment:?}, {moment:?}, {moment:?}]\n\
             position = {place:?}\nvelocity = {velocity:?}\nangular_velocity = {spin:?}\n"
        );
        for (number, [u, v, up]) in [[0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]].into_iter().enumerate() {
            text += &format!(
                "[[joint]]\nname = \"side{number}-{k}\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"b{k}\"]\n\
                 frames = [{{ position = [{:?}, {:?}, 0], axis = [{}, {}, {up}] }}, {{ position = [0, 0, 0] }}]\n\
                 params = {{ radius = {radius:?}, {law} }}\n",
                0.13 * f64::from(u),
                0.13 * f64::from(v),
                -u,
                -v,
            );
        }
        for (other, (radius_i, ..)) in all[..k].iter().enumerate() {
            text += &format!(
                "[[joint]]\nname = \"k{other}-{k}\"\ntype = \"ball-contact\"\nbodies = [\"b{other}\", \"b{k}\"]\n\
                 frames = [{{ position = [0, 0, 0] }}, {{ position = [0, 0, 0] }}]\n\
                 params = {{ radius_i = {radius_i:?}, radius_j = {radius:?}, {law} }}\n"
            );
        }
        for component in ["x", "y", "z"] {
            text += &format!(
                "[[output]]\nname = \"b{k}.{component}\"\nquantity = \"position\"\nof = \"b{k}\"\ncomponent = \"{component}\"\n"
            );
        }
    }
    text
}

/// A ball that rolls on the floor along a wall, and is held by others: what it presses floor and wall with is open, and friction
/// sticks only if that is shared such that it can. Before, it slid to and fro without end.
#[test]
fn balls_that_hold_each_other_stick_where_normal_forces_can_be_shared_so_that_they_do() {
    let all = [
        (0.03, 0.16, [-0.044, 0.063, 0.05], [0.3, 0.16, 0.05], [0.0, -0.7, -2.5]),
        (0.034, 0.29, [0.026, -0.053, 0.054], [-0.28, 0.17, 0.03], [-0.3, -1.7, 1.8]),
        (0.034, 0.11, [-0.085, -0.002, 0.054], [-0.21, 0.26, 0.05], [0.7, -1.0, -0.5]),
        (0.041, 0.4, [0.048, 0.044, 0.061], [-0.28, 0.22, 0.04], [-2.4, 0.2, -1.0]),
    ];
    let text = heap("mu = 0.3, restitution = 0.2", 0.5, &all);
    let [one, other] = ["joint", "cartesian"].map(|way| run(&text, &[&format!("simulation.formulation=\"{way}\"")]));
    for report in [&one, &other] {
        assert!(report.summary.steps < 2500, "{}", report.summary.steps);
    }
    for (channel, (a, b)) in one.channels.iter().zip(one.columns.iter().zip(&other.columns)) {
        let off = difference(a, b);
        assert!(off < 1e-8, "`{}` differs by {off:.1e}", channel.name);
    }
}

/// A homogeneous ball in the right angle of a floor and a wall, pulled along both with g: friction at the floor and at the wall rolls it about
/// the line through its contacts, r / sqrt(2) from its centre, x = g t^2 / 2 / (1 + 2 * 2 / 5). What acts along that line is open, and
/// the least of it would have one contact pull.
#[test]
fn a_ball_rolls_along_an_edge_whatever_the_friction_of_its_sides() {
    let laws = ["mu = 0.3", "mu = 2", "rough = true"];
    let turned = Rotation3::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7));
    for (floor, wall) in laws.iter().flat_map(|floor| laws.map(|wall| (*floor, wall))) {
        for turn in [Rotation3::identity(), turned] {
            let list = |v: [f64; 3]| format!("{:?}", (turn * Vector3::from(v)).as_slice());
            let side = |name: &str, normal: [f64; 3], law: &str| {
                format!(
                    "[[joint]]\nname = \"{name}\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"ball\"]\n\
                     frames = [{{ position = [0, 0, 0], axis = {} }}, {{ position = [0, 0, 0] }}]\n\
                     params = {{ radius = 0.05, {law} }}\n",
                    list(normal)
                )
            };
            let text = format!(
                "[plugins]\nlibraries = [\"joints\"]\n\
                 [simulation]\ngravity = {}\nt_end = 0.5\noutput_step = 0.1\ntolerance = 1e-9\n\
                 [[body]]\nname = \"ball\"\nmass = 0.4\ninertia = [4e-4, 4e-4, 4e-4]\nposition = {}\n{}{}\
                 [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"ball\"\ncomponent = \"x\"\n\
                 [[output]]\nname = \"y\"\nquantity = \"position\"\nof = \"ball\"\ncomponent = \"y\"\n\
                 [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"ball\"\ncomponent = \"z\"\n",
                list([1.0, -2.0, -9.0]),
                list([0.0, 0.05, 0.05]),
                side("floor", [0.0, 0.0, 1.0], floor),
                side("wall", [0.0, 1.0, 0.0], wall),
            );
            for formulation in ["joint", "cartesian"] {
                let report = run(&text, &[&format!("simulation.formulation=\"{formulation}\"")]);
                let last = |name: &str| column(&report, name).last().copied().unwrap_or(f64::NAN);
                let place = turn.inverse() * Vector3::new(last("x"), last("y"), last("z"));
                let off = (place - Vector3::new(0.5 * 0.25 / 1.8, 0.05, 0.05)).norm();
                assert!(off < 1e-12, "{floor}, {wall}, {formulation}: {off:.1e}");
                assert!(report.summary.steps < 16, "{floor}, {wall}, {formulation}: {} steps", report.summary.steps);
            }
        }
    }
}
