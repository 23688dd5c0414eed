//! Derivatives as numbers against derivatives as nodes.

use super::derivatives::imported;
use super::*;

/// Derivatives along all directions, by direction and function: as numbers, and as nodes.
fn both(graph: &Graph, functions: &[Node], directions: &[Seeds], inputs: &[f64]) -> [Vec<Vec<f64>>; 2] {
    let mut found = vec![vec![0.0; functions.len()]; directions.len()];
    let mut tangents = Tangents::new(&mut graph.clone(), functions, directions);
    // The second run starts from what the first left.
    for _ in 0..2 {
        found.iter_mut().for_each(|row| row.fill(0.0));
        tangents.run(inputs, &[], |direction, function, value| found[direction][function] = value).unwrap();
    }
    let mut graph = graph.clone();
    let written = directions.iter().map(|seeds| {
        let slopes = derivatives(&mut graph, functions, seeds);
        values(&graph, &slopes, inputs)
    });
    let written = written.collect();
    [found, written]
}

fn assert_close(found: &[Vec<f64>], written: &[Vec<f64>]) {
    for (direction, (found, written)) in found.iter().zip(written).enumerate() {
        for (function, (a, b)) in found.iter().zip(written).enumerate() {
            assert!((a - b).abs() <= 1e-13 * (1.0 + b.abs()), "{function} along {direction}: {a} is not {b}");
        }
    }
}

#[test]
fn every_operation_has_the_derivatives_that_are_written_down() {
    let (mut graph, list) = imported();
    let functions: Vec<Node> = list.iter().map(|(_, node)| *node).collect();
    let (x, y) = (graph.input(0), graph.input(1));
    let (one, two, minus) = (graph.constant(1.0), graph.constant(2.0), graph.constant(-0.7));
    let of = |list: &[(Node, Node)]| Seeds::from_iter(list.iter().copied());
    let directions = [of(&[(x, one)]), of(&[(y, one)]), of(&[(x, two), (y, minus)])];
    let mut random = Random(17);
    for _ in 0..30 {
        let at = [random.between(0.5, 2.0), random.between(-2.0, 2.0)];
        let [found, written] = both(&graph, &functions, &directions, &at);
        assert_close(&found, &written);
    }
}

#[test]
fn many_directions_each_of_which_moves_little() {
    let mut g = Graph::default();
    let mut random = Random(23);
    let inputs: Vec<Node> = (0..30).map(|k| g.input(k)).collect();
    let functions: Vec<Node> = inputs
        .windows(3)
        .map(|near| {
            let product = g.mul(near[0], near[1]);
            let sine = g.sin(near[2]);
            let sum = g.add(product, sine);
            g.div(sum, near[1])
        })
        .collect();
    let one = g.constant(1.0);
    let directions: Vec<Seeds> = inputs.iter().map(|input| Seeds::from_iter([(*input, one)])).collect();
    let at: Vec<f64> = inputs.iter().map(|_| random.between(0.5, 2.0)).collect();
    let [found, written] = both(&g, &functions, &directions, &at);
    assert_close(&found, &written);
    // A direction touches three functions of four operations or fewer; eight lie next to each other.
    let tangents = Tangents::new(&mut g, &functions, &directions);
    assert!(tangents.work() < 2 * 4 * 8 * (30 + 4 * 2), "{}", tangents.work());
}

#[test]
fn seeds_may_be_values_and_what_is_seeded_is_a_variable() {
    let mut g = Graph::default();
    let (x, y, one) = (g.input(0), g.input(1), g.constant(1.0));
    let sine = g.sin(x);
    let cosine = g.cos(x);
    let turned = g.neg(cosine);
    let product = g.mul(sine, y);
    let function = g.mul(product, cosine);
    let directions = [Seeds::from_iter([(sine, turned), (cosine, sine)]), Seeds::from_iter([(y, one)])];
    let [found, written] = both(&g, &[function, product, x], &directions, &[0.4, 3.0]);
    assert_close(&found, &written);
}

#[test]
fn what_is_not_chosen_is_not_looked_at() {
    let mut g = Graph::default();
    let (x, zero, one) = (g.input(0), g.constant(0.0), g.constant(1.0));
    let root = g.sqrt(x);
    let square = g.mul(x, x);
    let function = g.select(zero, x, root, square);
    let directions = [Seeds::from_iter([(x, one)])];
    let [found, _] = both(&g, &[function], &directions, &[0.0]);
    assert_eq!(found, [[0.0]]);
}
