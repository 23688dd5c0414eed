//! Many bodies of which any may touch any other: what does not touch takes no part in the equations.

use odyn::analysis::Evaluator;

use crate::contacts::run;
use crate::support::{difference, open_text};

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
                inputs[first..first + friction.rows.len()].fill(0.0);
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
