//! Kernels: the straight line's numbers, bit for bit, with as many operations run and fewer written.

#[path = "../../../testing/kernels.rs"]
mod twins;

use super::*;
use twins::{assert_same, both};

/// The same random operations at every place of a row of places with three inputs each, some of them on numbers of the
/// neighbour, on a constant that differs from place to place and on the time; and sums over all places. Outputs are taken
/// anywhere.
fn repeated(random: &mut Random, places: usize, operations: usize) -> (Graph, Vec<Node>) {
    let mut owners = vec![NO_PLACE];
    owners.extend((0..3 * places).map(|k| (k / 3) as Place));
    let mut g = Graph::with_places(owners);
    let recipe: Vec<[usize; 5]> = (0..operations)
        .map(|k| [random.below(14), random.below(8 + k), random.below(8 + k), random.below(8 + k), 0])
        .collect();
    let time = g.input(0);
    let tick = g.sin(time);
    let mut outputs = Vec::new();
    let mut sum = g.constant(0.0);
    for place in 0..places {
        let input = |g: &mut Graph, place: usize, k: usize| g.input(1 + 3 * (place % places) + k);
        let mut nodes: Vec<Node> = (0..3).map(|k| input(&mut g, place, k)).collect();
        nodes.extend((0..2).map(|k| input(&mut g, place + 1, k)));
        nodes.extend([g.constant(0.5 + 0.1 * place as f64), g.constant(1.7), tick]);
        for [what, a, b, c, _] in &recipe {
            let (a, b, c) = (nodes[*a], nodes[*b], nodes[*c]);
            nodes.push(match what {
                0..=2 => g.add(a, b),
                3 | 4 => g.sub(a, b),
                5..=7 => g.mul(a, b),
                8 => g.div(a, b),
                9 => g.neg(a),
                10 => g.tanh(a),
                11 => g.cos(a),
                12 => g.powi(a, 3),
                _ => g.select(a, b, c, a),
            });
        }
        outputs.extend(nodes.iter().rev().step_by(3).copied());
        for node in nodes.iter().rev().take(2) {
            sum = g.add(sum, *node);
        }
    }
    outputs.extend([sum, tick, time]);
    (g, outputs)
}

#[test]
fn random_programs_with_kernels_give_the_same_bits() {
    let mut random = Random(31);
    let mut kernels = 0;
    for round in 0..60 {
        // Whole numbers of lanes, and not.
        let places = 8 + random.below(20);
        let (mut graph, outputs) = repeated(&mut random, places, 5 + 2 * round);
        let programs = both(&mut graph, &outputs);
        assert_eq!(programs[0].kernel_count(), 0);
        assert_eq!(programs[0].operations(), programs[1].operations());
        kernels += programs[1].kernel_count();
        for _ in 0..3 {
            assert_same(&programs, &random.vector(1 + 3 * places), &[]);
        }
    }
    assert!(kernels > 60, "{kernels}");
}

/// Machine code of what lies between the kernels.
#[cfg(feature = "jit")]
#[test]
fn machine_code_around_kernels_gives_the_same_bits() {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;
    let mut random = Random(41);
    for round in 0..10 {
        let (mut graph, outputs) = repeated(&mut random, 11, 20 + 5 * round);
        let mut programs = both(&mut graph, &outputs);
        let code = MachineCode::compile(&programs[1], Maker::here(), &AtomicBool::new(false)).unwrap();
        programs[1].install(Arc::new(code));
        assert_same(&programs, &random.vector(1 + 3 * 11), &[]);
    }
}
