//! Condensed programs give the same numbers by fewer operations.

use super::*;

/// Operations before and after, and the largest difference of the outputs, as a share of their size.
fn compared(graph: &Graph, outputs: &[Node], inputs: &[f64]) -> (usize, usize, f64) {
    let (shorter, nodes) = condense(graph, outputs).unwrap_or_else(|| (graph.clone(), outputs.to_vec()));
    let (before, after) = (values(graph, outputs, inputs), values(&shorter, &nodes, inputs));
    let off = before.iter().zip(&after).map(|(a, b)| (a - b).abs() / (1.0 + a.abs())).fold(0.0, f64::max);
    (Program::compile(graph, outputs).operations(), Program::compile(&shorter, &nodes).operations(), off)
}

#[test]
fn common_factors_are_taken_out_of_sums() {
    let mut g = Graph::default();
    let [a, b, c, d] = std::array::from_fn(|k| g.input(k));
    // a b + (c - a d) + a c = a (b + c - d) + c
    let (ab, ad, ac) = (g.mul(a, b), g.mul(d, a), g.mul(a, c));
    let left = g.sub(c, ad);
    let sum = g.add(ab, left);
    let sum = g.add(sum, ac);
    let (before, after, off) = compared(&g, &[sum], &[0.3, -1.7, 2.9, 0.4]);
    assert_eq!((before, after), (6, 4));
    assert!(off < 1e-15, "{off:e}");
}

#[test]
fn squares_of_sine_and_cosine_meet_across_a_sum() {
    let mut g = Graph::default();
    let [angle, x, y] = std::array::from_fn(|k| g.input(k));
    let (s, c) = (g.sin(angle), g.cos(angle));
    // s (s x) + y + c (c x) = x + y
    let (sx, cx) = (g.mul(s, x), g.mul(c, x));
    let (ssx, ccx) = (g.mul(s, sx), g.mul(c, cx));
    let sum = g.add(ssx, y);
    let sum = g.add(sum, ccx);
    let (_, after, off) = compared(&g, &[sum], &[0.7, 1.3, -0.2]);
    assert_eq!(after, 1);
    assert!(off < 1e-15, "{off:e}");
}

#[test]
fn pairs_are_shared_whatever_order_they_were_written_in() {
    let mut g = Graph::default();
    let [a, b, c, d] = std::array::from_fn(|k| g.input(k));
    // (a + c) - b, (d - b) + a, -(a - b) d: a - b once
    let (ac, db) = (g.add(a, c), g.sub(d, b));
    let (first, second) = (g.sub(ac, b), g.add(db, a));
    // (a c) d, (a d) c: once
    let (p, q) = (g.mul(a, c), g.mul(a, d));
    let (p, q) = (g.mul(p, d), g.mul(q, c));
    let (before, after, off) = compared(&g, &[first, second, p, q], &[0.3, -1.7, 2.9, 0.4]);
    assert_eq!((before, after), (8, 5));
    assert!(off < 1e-15, "{off:e}");
}

#[test]
fn what_cancels_vanishes() {
    let mut g = Graph::default();
    let [a, b, c] = std::array::from_fn(|k| g.input(k));
    // (a b + c) - (b a - c) with the product written twice in other factors: 2 c
    let (ab, bc) = (g.mul(a, b), g.mul(b, c));
    let (abc, bca) = (g.mul(ab, c), g.mul(bc, a));
    let (left, right) = (g.add(abc, c), g.sub(bca, c));
    let sum = g.sub(left, right);
    let (_, after, off) = compared(&g, &[sum], &[0.3, -1.7, 2.9]);
    assert_eq!(after, 1);
    assert!(off < 1e-15, "{off:e}");
}

#[test]
fn random_programs_keep_their_values() {
    let mut random = Random(701);
    let mut saved = 0;
    for _ in 0..200 {
        let mut g = Graph::default();
        let mut nodes: Vec<Node> = (0..5).map(|k| g.input(k)).collect();
        nodes.push(g.constant(2.0));
        nodes.push(g.constant(-0.75));
        for _ in 0..60 {
            let mut any = || nodes[((random.next() + 1.0) / 2.0 * nodes.len() as f64) as usize % nodes.len()];
            let (a, b) = (any(), any());
            let what = ((random.next() + 1.0) * 4.0) as usize;
            let node = match what {
                0 | 1 => g.add(a, b),
                2 | 3 => g.sub(a, b),
                4 | 5 => g.mul(a, b),
                6 => g.neg(a),
                _ => g.sin(a),
            };
            nodes.push(node);
        }
        let outputs: Vec<Node> = nodes[nodes.len() - 8..].to_vec();
        let (before, after, off) = compared(&g, &outputs, &random.vector(5));
        assert!(after <= before, "{before} {after}");
        assert!(off < 1e-11, "{off:e}");
        saved += before - after;
    }
    assert!(saved > 150, "{saved}");
}

#[test]
fn numbers_that_are_none_are_no_common_factor() {
    let mut g = Graph::default();
    let [a, b] = std::array::from_fn(|k| g.input(k));
    let none = g.constant(f64::NAN);
    let (left, right) = (g.mul(none, a), g.mul(none, b));
    let sum = g.add(left, right);
    let (shorter, nodes) = condense(&g, &[sum]).unwrap_or_else(|| (g.clone(), vec![sum]));
    assert!(value(&shorter, nodes[0], &[1.0, 2.0]).is_nan());
}
