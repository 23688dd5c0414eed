//! Graphs of variants that are written along the first are what they are when each is written by itself, node by node.

use super::*;
use crate::{Expr, Structures};

/// Writes graphs: operations drawn with `seed` on nodes drawn likewise, on constants that are given, with copies on the way that are
/// gone on with. From `turn` operations on with another seed.
fn write(seed: u64, constants: &[f64], turn: usize) -> Vec<Graph> {
    let mut random = Random(seed);
    let mut graphs = vec![(Graph::default(), Vec::new())];
    for operation in 0..400 {
        if operation == turn {
            random = Random(seed ^ 0xABCD);
        }
        let which = random.below(graphs.len());
        let (g, nodes): &mut (Graph, Vec<Node>) = &mut graphs[which];
        if nodes.len() < 4 {
            nodes.push(g.input(nodes.len()));
            continue;
        }
        let mut any = || nodes[random.below(nodes.len())];
        let (a, b, c, d) = (any(), any(), any(), any());
        let node = match random.below(12) {
            0 | 1 => g.constant(constants[random.below(constants.len())]),
            2 | 3 => g.add(a, b),
            4 => g.sub(a, b),
            5 | 6 => g.mul(a, b),
            7 => g.div(a, b),
            8 => g.neg(a),
            9 => g.sin(a),
            10 => g.powi(a, random.below(4) as i32),
            _ => g.select(a, b, c, d),
        };
        nodes.push(node);
        if random.below(100) == 0 {
            let copy = if random.below(2) == 0 { g.clone() } else { g.at_rest() };
            let nodes = nodes.clone();
            graphs.push((copy, nodes));
        }
        if random.below(150) == 0 {
            graphs[which].0.share();
        }
    }
    graphs.into_iter().map(|(graph, _)| graph).collect()
}

fn nodes(graphs: &[Graph]) -> Vec<Vec<Expr>> {
    graphs.iter().map(|graph| graph.nodes().map(|node| graph.expr(node)).collect()).collect()
}

#[test]
fn variants_are_written_as_by_themselves() {
    let mut along = 0;
    for seed in 1..60 {
        let structures = Structures::default();
        let mut random = Random(seed);
        for variant in 0..12 {
            // Numbers that are special, or that coincide, make other graphs.
            let special = [0.0, 1.0, -1.0, 0.5, 2.0];
            let constants: Vec<f64> = (0..6)
                .map(|_| if variant % 3 == 2 { special[random.below(5)] } else { random.between(0.1, 3.0) })
                .collect();
            let turn = if variant % 4 == 3 { random.below(400) } else { usize::MAX };
            let by_itself = nodes(&write(seed, &constants, turn));
            let (found, followed) = structures.during(|| {
                let graphs = write(seed, &constants, turn);
                (nodes(&graphs), graphs.iter().filter(|graph| graph.is_along()).count())
            });
            assert_eq!(found, by_itself, "seed {seed}, variant {variant}");
            along += followed;
        }
    }
    assert!(along > 500, "graphs are followed to their end: {along}");
}

#[test]
fn a_constant_that_meets_another_one_is_seen() {
    let structures = Structures::default();
    let write = |[first, second]: [f64; 2]| {
        structures.during(|| {
            let mut g = Graph::default();
            let (x, y) = (g.input(0), g.input(1));
            let (a, b) = (g.constant(first), g.constant(second));
            let (ax, by) = (g.mul(a, x), g.mul(b, y));
            let sum = g.add(ax, by);
            (nodes(&[g.clone()]), a == b, value(&g, sum, &[1.0, 10.0]))
        })
    };
    write([2.0, 3.0]);
    assert_eq!(write([4.0, 5.0]).2, 54.0);
    let (met, same, found) = write([4.0, 4.0]);
    assert!(same && found == 44.0 && met[0].len() == 6, "{met:?}");
    // And the other way round: what was one is two.
    let structures = Structures::default();
    let write = |[first, second]: [f64; 2]| {
        structures.during(|| {
            let mut g = Graph::default();
            (g.constant(first), g.constant(second), g.len())
        })
    };
    assert_eq!(write([7.0, 7.0]).2, 1);
    assert_eq!(write([7.0, 8.0]).2, 2);
    assert_eq!(write([9.0, 9.0]).2, 1);
}

/// Variants that are written at the same time, on several threads, do not mix: what one has copied is no copy of the other's graph.
#[test]
fn copies_belong_to_the_graph_that_they_were_made_of() {
    let structures = Structures::default();
    // Equally many steps, then a copy that is gone on with.
    let begin = |of_one: bool| {
        let mut g = Graph::default();
        let (x, y) = (g.input(0), g.input(1));
        let z = if of_one { g.sin(x) } else { g.mul(x, y) };
        (g, z)
    };
    let go_on = |g: &Graph| {
        let mut copy = g.clone();
        let x = copy.input(0);
        let sine = copy.sin(x);
        let found = copy.add(sine, x);
        (nodes(&[copy.clone()]), value(&copy, found, &[0.5, 2.0]))
    };
    let first = structures.during(|| {
        let first = begin(false);
        // Meanwhile another one begins, and is done with its copy before.
        let other = structures.during(|| {
            let other = begin(true);
            go_on(&other.0);
            other
        });
        (first, other)
    });
    drop(first);
    let alone = go_on(&begin(false).0);
    for _ in 0..2 {
        assert_eq!(structures.during(|| go_on(&begin(false).0)), alone);
    }
}

#[test]
fn steps_that_are_kept_are_bounded() {
    let structures = Structures::default();
    let write = |length: usize| {
        structures.during(|| {
            let mut g = Graph::default();
            let start = g.input(0);
            (0..length).fold(start, |node, _| g.tanh(node));
        });
    };
    write(1_000_001);
    assert_eq!(structures.steps(), 0);
    write(10);
    write(20);
    assert_eq!(structures.steps(), 11, "the first one is kept");
    structures.during(|| (0..2000).for_each(|_| drop(Graph::default())));
    structures.during(|| {
        for _ in 0..2000 {
            Graph::default().input(0);
        }
    });
    assert!(structures.steps() <= 1011, "{}", structures.steps());
}
