//! What rates of states are made of, where their values are nothing.

use crate::program::{Program, RateSizes};
use crate::tests::{prepared, scenes};

/// Sizes and paces for a pendulum with a quantity that is followed; `inputs` are written over zeros by slot.
fn sizes(followed: &str, fill: impl Fn(&crate::plan::Layout, &mut [f64])) -> (f64, f64) {
    let text = scenes::pendulum("[simulation]\ngravity = [0, -10, 0]\nt_end = 1\noutput_step = 1\n")
        + &format!("[[output]]\nname = \"signal\"\n{followed}\n")
        + "[[control]]\nname = \"slow\"\ntype = \"follower\"\nparams.factor = 0.1\ninputs.in = \"signal\"\n";
    let found = prepared(&text);
    let layout = &found.plan.layout;
    let RateSizes { graph, nodes } = RateSizes::new(&found.equations, &found.model, layout);
    let mut inputs = vec![0.0; RateSizes::inputs(layout)];
    inputs[layout.body_slot(0, 3)] = 1.0;
    fill(layout, &mut inputs);
    let given = layout.inputs();
    inputs[given..].copy_from_slice(&[1e-30, 2.0, 3.0, 4.0]);
    let program = Program::compile(&graph, &nodes);
    let mut results = vec![f64::NAN; nodes.len()];
    program.run(&inputs, &found.model.sets, &mut program.workspace(), &mut results).unwrap();
    (results[0], results[1])
}

/// The rod, 1.2 kg, hangs at rest by a force of 12 N along y.
fn hanging(layout: &crate::plan::Layout, inputs: &mut [f64]) {
    inputs[layout.body_slot(0, 1)] = -0.5;
    inputs[layout.multiplier_slot() + 1] = 12.0;
}

#[test]
fn motion_counts_with_the_sizes_it_is_given() {
    let of = |quantity: &str| sizes(&format!("quantity = \"{quantity}\"\nof = \"rod\"\ncomponent = \"z\""), hanging);
    for (quantity, size) in [("position", 2.0), ("velocity", 3.0)] {
        let (made, pace) = of(quantity);
        assert!((size * 10.0..10.0 * size * 10.0).contains(&made), "{quantity}: {made}");
        assert!((pace - 10.0).abs() < 1e-12, "{pace}");
    }
    let parameter = sizes("quantity = \"orientation\"\nof = \"rod\"\ncomponent = \"e1\"", hanging).0;
    assert!((parameter - 10.0).abs() < 1e-12, "{parameter}");
}

#[test]
fn accelerations_and_reactions_that_are_nothing_count_with_what_cancels() {
    // 10 m/s^2 from weight and from the hinge, over 0.1 s; 12 N.
    let (made, _) = sizes("quantity = \"acceleration\"\nof = \"rod\"\ncomponent = \"z\"", hanging);
    assert!((100.0..3000.0).contains(&made), "{made}");
    let (made, _) = sizes("quantity = \"reaction_force\"\nof = \"pivot\"\ncomponent = \"z\"", hanging);
    assert!((120.0..3600.0).contains(&made), "{made}");
}
