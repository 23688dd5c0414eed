//! Conditions that can change during a step are found, and no others.

use crate::program::{Equations, Node, Switches};
use crate::tests::{prepared, scenes};

/// The switches of a scene with discrete states in which the first load is replaced.
fn with_load(load: impl Fn(&mut Equations, &Inputs) -> Node) -> (Switches, Inputs) {
    let tally = "[[force]]\nname = \"tally\"\ntype = \"tally\"\nbodies = [\"rod\"]\n";
    let found = prepared(&(scenes::pendulum("") + tally));
    let (mut equations, layout) = (found.equations, found.plan.layout);
    let g = &mut equations.graph;
    let inputs = Inputs {
        x: g.input(layout.body_slot(0, 0)),
        y: g.input(layout.body_slot(0, 1)),
        time: g.input(0),
        memory: g.input(layout.discrete_slot()),
        five: g.constant(5.0),
    };
    assert_eq!(Switches::find(&equations, &layout), Switches::default(), "nothing switches before");
    equations.loads[0] = load(&mut equations, &inputs);
    (Switches::find(&equations, &layout), inputs)
}

struct Inputs {
    x: Node,
    y: Node,
    time: Node,
    memory: Node,
    five: Node,
}

#[test]
fn conditions_on_motion_and_time_are_found_once() {
    let (switches, at) = with_load(|equations, at| {
        let g = &mut equations.graph;
        let by_place = g.select(at.x, at.five, at.y, at.five);
        // The same condition from the other side, inside another expression.
        let mirrored = g.select(at.five, at.x, at.time, at.y);
        let root = g.sin(mirrored);
        let by_time = g.select(at.time, at.five, root, at.x);
        g.add(by_place, by_time)
    });
    assert_eq!(switches.conditions, [(at.x, at.five), (at.time, at.five)]);
}

#[test]
fn what_changes_between_steps_only_is_left_out() {
    let (switches, _) = with_load(|equations, at| {
        let g = &mut equations.graph;
        let doubled = g.add(at.memory, at.memory);
        g.select(doubled, at.five, at.y, at.x)
    });
    assert!(switches.conditions.is_empty());
}

#[test]
fn what_no_load_depends_on_is_left_out() {
    let (switches, _) = with_load(|equations, at| {
        let g = &mut equations.graph;
        g.select(at.x, at.five, at.y, at.five);
        at.y
    });
    assert!(switches.conditions.is_empty());
}
