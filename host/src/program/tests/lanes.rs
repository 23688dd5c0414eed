//! Lanes: each one the scalar interpreter's numbers, bit for bit, whatever the others hold.

use super::*;
use crate::tests::{Prepared, prepared, scenes};

/// Runs a program one instance after the other and in lanes; every bit must be the same. A lane that is not a number must
/// be none in both; which of the many is nobody's business.
#[track_caller]
fn assert_same<const L: usize>(program: &Program, mut instance: impl FnMut() -> Vec<f64>) {
    let mut lanes = program.lanes::<L>().expect("a program without opaque calls");
    let mut workspace = program.workspace();
    let outputs = program.output_count();
    let mut found = vec![[f64::NAN; L]; outputs];
    for _ in 0..3 {
        let instances: Vec<Vec<f64>> = (0..L).map(|_| instance()).collect();
        let slots = instances[0].len();
        let inputs: Vec<[f64; L]> = (0..slots).map(|k| std::array::from_fn(|lane| instances[lane][k])).collect();
        program.run_lanes(&inputs, &mut lanes, &mut found);
        for (lane, inputs) in instances.iter().enumerate() {
            let mut expected = vec![f64::NAN; outputs];
            program.run(inputs, &[], &mut workspace, &mut expected).unwrap();
            for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let (a, b) = (found[lane], *expected);
                let same = a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
                assert!(same, "output {k}, lane {lane} of {L}: {a:e} instead of {b:e}");
            }
        }
    }
}

#[test]
fn random_programs_give_the_same_bits_in_every_lane() {
    let mut random = Random(31);
    for round in 0..20 {
        let (graph, nodes) = tape::random_graph(&mut random, 5, 40 + 20 * round);
        let outputs: Vec<Node> = (0..12).map(|_| nodes[random.below(nodes.len())]).collect();
        let program = Program::compile(&graph, &outputs);
        assert_same::<4>(&program, || random.vector(5).iter().map(|x| 3.0 * x).collect());
        assert_same::<8>(&program, || random.vector(5).iter().map(|x| 3.0 * x).collect());
    }
}

/// Everything the equations of a scene contain.
#[test]
fn programs_of_scenes_give_the_same_bits_in_every_lane() {
    for text in [scenes::tangle(), scenes::four_bar(1.1), scenes::four_bar(0.7)] {
        let Prepared { equations, plan, .. } = prepared(&text);
        let program = Program::compile(&equations.graph, &every_output(&equations));
        let mut random = Random(37);
        assert_same::<4>(&program, || Motion::random(&plan.layout, &mut random).start);
        assert_same::<8>(&program, || Motion::random(&plan.layout, &mut random).start);
    }
}

#[test]
fn opaque_elements_have_no_lanes() {
    let Prepared { equations, .. } = prepared(&scenes::opaque_tangle());
    let program = Program::compile(&equations.graph, &every_output(&equations));
    assert!(program.calls() > 0 && program.lanes::<4>().is_none());
}

fn every_output(equations: &Equations) -> Vec<Node> {
    let mut nodes = equations.loads.clone();
    nodes.extend(&equations.state_rates);
    nodes.extend([equations.power, equations.kinetic, equations.potential]);
    for row in &equations.rows {
        nodes.extend([row.value, row.time, row.gamma]);
        nodes.extend(row.jacobian.iter().map(|(_, node)| *node));
    }
    nodes
}
