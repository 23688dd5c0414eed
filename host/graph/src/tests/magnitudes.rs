//! What values are made of: no less than they are, and what cancels is still there.

use rustc_hash::FxHashMap;

use super::{Random, value, values};
use crate::{Graph, Node, magnitudes};

#[test]
fn what_cancels_counts() {
    let mut g = Graph::default();
    let [a, b, c] = std::array::from_fn(|k| g.input(k));
    // (a - b) c, and a b - b a by way of numbers that are the same: nothing is left of the values.
    let difference = g.sub(a, b);
    let product = g.mul(difference, c);
    let (sine, square) = (g.sin(product), g.mul(product, product));
    let root = g.sqrt(square);
    let shifted = g.add(product, c);
    let share = g.div(product, shifted);
    let found = magnitudes(&mut g, &[product, sine, root, share], &FxHashMap::default());
    let inputs = [3.0, 3.0, -0.1];
    assert_eq!(values(&g, &[product, sine, root], &inputs), [0.0; 3]);
    let sizes = values(&g, &found, &inputs);
    // (3 + 3) 0.1; 0.6 over 0.1.
    for (size, expected) in sizes.iter().zip([0.6, 0.6, 0.6, 6.0]) {
        assert!((size - expected).abs() < 1e-14, "{sizes:?}");
    }
}

#[test]
fn given_sizes_stand_for_nodes() {
    let mut g = Graph::default();
    let [a, b, size] = std::array::from_fn(|k| g.input(k));
    let seven = g.constant(-7.0);
    let product = g.mul(a, seven);
    let sum = g.sub(product, b);
    let found = magnitudes(&mut g, &[sum, a], &FxHashMap::from_iter([(a, size)]));
    assert_eq!(values(&g, &found, &[1e-20, -2.0, 3.0]), [23.0, 3.0]);
}

#[test]
fn magnitudes_are_those_of_changes_at_least() {
    // A change of every input by a share of its size changes no value by more than a few times this share of its magnitude.
    let mut random = Random(911);
    for _ in 0..300 {
        let mut g = Graph::default();
        let mut nodes: Vec<Node> = (0..4).map(|k| g.input(k)).collect();
        nodes.push(g.constant(-0.75));
        let mut depth = 0;
        while depth < 12 {
            let mut any = || nodes[((random.next() + 1.0) / 2.0 * nodes.len() as f64) as usize % nodes.len()];
            let (a, b) = (any(), any());
            let node = match ((random.next() + 1.0) * 6.0) as usize {
                0 => g.add(a, b),
                1 | 2 => g.sub(a, b),
                3 | 4 => g.mul(a, b),
                5 => g.div(a, b),
                6 => g.sin(a),
                7 => g.cos(a),
                8 => g.tanh(a),
                9 => g.atan2(a, b),
                10 => g.powi(a, 3),
                _ => g.select(a, b, a, b),
            };
            nodes.push(node);
            depth += 1;
        }
        let outputs: Vec<Node> = nodes[nodes.len() - 6..].to_vec();
        let sizes = magnitudes(&mut g, &outputs, &FxHashMap::default());
        let inputs = random.vector(4);
        let (found, sizes) = (values(&g, &outputs, &inputs), values(&g, &sizes, &inputs));
        for (value, size) in found.iter().zip(&sizes) {
            assert!(value.is_nan() || *size >= value.abs() * (1.0 - 1e-12), "{value:e} {size:e}");
        }
        let share = 1e-9;
        let moved: Vec<f64> = inputs.iter().map(|x| x * (1.0 + share * random.next())).collect();
        for ((before, after), size) in found.iter().zip(values(&g, &outputs, &moved)).zip(&sizes) {
            let change = (after - before).abs();
            // Functions of functions add up; jumps of choices and of angles are no small changes.
            let jumps = change > 1e-3 * before.abs().max(1e-3);
            assert!(change.is_nan() || jumps || change <= 1e4 * share * size, "{change:e} {size:e}");
        }
    }
}

#[test]
fn a_number_has_its_own() {
    let mut g = Graph::default();
    let x = g.input(0);
    let size = g.abs(x);
    assert_eq!([-2.5, 0.0, 4.0].map(|number| value(&g, size, &[number])), [2.5, 0.0, 4.0]);
}
