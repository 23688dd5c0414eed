//! Sines and cosines: close to those of the standard library, and the same bits alone and together.

use super::*;
use crate::turn::{cos, pairs_together, sin, sin_cos};

#[test]
fn they_err_by_a_unit_in_the_last_place() {
    let mut random = Random(61);
    let close = |found: f64, expected: f64| (found - expected).abs() <= (expected.next_up() - expected).abs();
    for scale in [1e-9, 0.3, 2.0, 30.0, 1e5, 1e12] {
        for x in random.vector(2000) {
            let angle = scale * x;
            let (sine, cosine) = sin_cos(angle);
            assert!(close(sine, angle.sin()) && close(cosine, angle.cos()), "{angle:e}: {sine:e}, {cosine:e}");
            assert!((sin(angle), cos(angle)) == (sine, cosine));
        }
    }
    assert!(sin(f64::INFINITY).is_nan() && cos(f64::NAN).is_nan());
    assert!(sin(-0.0).is_sign_negative());
}

/// Angles of which both are wanted, in an order that pulls them apart; one of which only the cosine is.
fn turns() -> (Graph, Vec<Node>) {
    let mut g = Graph::default();
    let angles: Vec<Node> = (0..9).map(|k| g.input(k)).collect();
    let sines: Vec<Node> = angles[1..].iter().map(|angle| g.sin(*angle)).collect();
    let mut nodes: Vec<Node> = angles.iter().rev().map(|angle| g.cos(*angle)).collect();
    for k in 0..sines.len() {
        let product = g.mul(sines[k], nodes[k]);
        let angle = g.add(product, angles[k]);
        let (sine, cosine) = (g.sin(angle), g.cos(angle));
        nodes.push(g.sub(sine, cosine));
    }
    nodes.extend(sines);
    (g, nodes)
}

#[test]
fn both_of_an_angle_follow_each_other() {
    let (g, nodes) = turns();
    let listed = pairs_together(&g, &g.live(&nodes));
    assert_eq!(listed.len(), g.live(&nodes).len());
    let paired: Vec<Node> = listed.iter().filter(|(_, paired)| *paired).map(|(node, _)| *node).collect();
    assert_eq!(paired.len(), 2 * (8 + 8));
    for pair in paired.chunks(2) {
        let (Expr::Sin(angle), Expr::Cos(same)) = (g.expr(pair[0]), g.expr(pair[1])) else { panic!("no pair") };
        assert_eq!(angle, same);
    }
}

#[test]
fn pairs_give_the_numbers_of_the_graph() {
    let (g, nodes) = turns();
    let inputs: Vec<f64> = (0..9).map(|k| 0.7 * k as f64 - 2.0).collect();
    let found = values(&g, &nodes, &inputs);
    for (k, node) in nodes.iter().enumerate() {
        let alone = values(&g, &[*node], &inputs)[0];
        assert_eq!(found[k].to_bits(), alone.to_bits());
        if let Expr::Cos(angle) = g.expr(*node) {
            assert_eq!(found[k], cos(values(&g, &[angle], &inputs)[0]));
        }
    }
}
