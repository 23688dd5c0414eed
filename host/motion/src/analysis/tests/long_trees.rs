//! Long chains in the coordinates of joints: work, and round-off.

use super::joint::{chain, joint_plan};
use super::twice::evaluate_twice;
use super::*;
use crate::analysis::joint_engines::{Safe, Solving, Unrolled};
use crate::program::{FAR, JointEquations, Projecting};

/// Operations of the accelerations of a chain.
fn operations(rods: usize) -> usize {
    let (_, planned) = joint_plan(&chain(rods));
    Unrolled::new(&planned.equations, &[], Default::default(), 1.0, Solving::Articulated).motion.program().operations()
}

#[test]
fn operations_of_a_chain_grow_like_its_length() {
    let [short, middle, long] = [6, 10, 14].map(operations);
    assert!(long - middle <= (middle - short) * 101 / 100, "{short} {middle} {long}");
    // From here on references are changed on the way, and no mass matrix is written: the same in each hundred of links.
    let [first, second, third] = [100, 200, 300].map(operations);
    assert!((third - second).abs_diff(second - first) * 100 <= second - first, "{first} {second} {third}");
    assert_eq!((second - first) / 100, 514);
}

#[test]
fn a_long_chain_needs_no_mass_matrix_and_has_the_one_of_all_pairs() {
    let (Prepared { model, equations, plan, .. }, mut planned) = joint_plan(&chain(90));
    assert!(!planned.equations.mass_is_written());
    let nodes = planned.equations.graph.len();
    let by_pairs = JointEquations::build_by(&equations, &model, &plan.layout, &planned.tree, Projecting::Pairs);
    assert!(by_pairs.mass_is_written());
    assert!(by_pairs.graph.len() > 10 * nodes, "{} {nodes}", by_pairs.graph.len());
    let mut bodies = Unrolled::new(&planned.equations, &[], Default::default(), 1.0, Solving::Fewest).motion;
    planned.equations.write_mass();
    let mut whole = [&planned.equations, &by_pairs].map(|written| Safe::new(written, &[], &[], 1.0, 1e-11).unwrap());
    let mut random = Random(417);
    let columns = planned.equations.coordinates.columns;
    for _ in 0..3 {
        let inputs = random.vector(planned.equations.coordinates.input_count);
        let found = bodies.run(&inputs, &model.sets).unwrap()[..columns].to_vec();
        for safe in &mut whole {
            safe.factor(&inputs, &model.sets, &mut Counters::default()).unwrap();
            safe.solve_motion().unwrap();
            let off = difference(&found, &safe.accelerations);
            assert!(off < 1e-9, "{off:e}");
        }
    }
}

/// The largest error of the accelerations, as a share of the largest, of a chain with references that change beyond `far`
/// sizes: stretched, then wound up.
fn round_off(rods: usize, far: f64) -> [f64; 2] {
    let (Prepared { model, equations, plan, .. }, planned) = joint_plan(&chain(rods));
    let how = Projecting::Fewest;
    let written = JointEquations::build_about(&equations, &model, &plan.layout, &planned.tree, how, far);
    let mut graph = written.graph.clone();
    let nodes = written.articulated(&mut graph).unwrap().accelerations;
    let mut evaluator = Evaluator::new(&graph, &nodes);
    let mut random = Random(419);
    [0.0, 1.0].map(|bend| {
        let mut inputs = random.vector(written.coordinates.input_count);
        for line in &written.coordinates.lines {
            inputs[written.coordinates.slot_of(line.position)] *= bend;
        }
        let found = evaluator.run(&inputs, &model.sets).unwrap();
        let exact = evaluate_twice(&graph, &nodes, &inputs);
        let largest = exact.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        found.iter().zip(&exact).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / largest
    })
}

#[test]
fn changing_references_keep_round_off_of_long_chains_small() {
    // Seen, stretched and wound up: 5.7e-11 and 2.4e-12 about one reference, 7.6e-13 and 6.6e-14 about changing ones; with
    // four times the length 8.6e-9 and 5.1e-12, and 2.1e-11 and 1.2e-13.
    let [one, changing] = [f64::INFINITY, FAR].map(|far| round_off(160, far));
    assert!(changing[0] < 2e-12 && changing[1] < 2e-13, "{changing:?}");
    assert!(one[0] > 20.0 * changing[0] && one[1] > 10.0 * changing[1], "{one:?} {changing:?}");
    let [one, changing] = [f64::INFINITY, FAR].map(|far| round_off(640, far));
    assert!(changing[0] < 6e-11 && changing[1] < 4e-13, "{changing:?}");
    assert!(one[0] > 100.0 * changing[0] && one[1] > 10.0 * changing[1], "{one:?} {changing:?}");
}
