//! Sines and cosines: close to those of the standard library, and the same bits alone and together.

use super::*;
use crate::turn::{all, cos, pairs_together, sin, sin_cos};

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

fn angles() -> impl Iterator<Item = f64> {
    let mut state = 1_u64;
    let random = (0..400_000).map(move |_| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    });
    let sizes = [1e-12, 1e-3, 1.0, 7.0, 100.0, 1e4, 1e6, 3.1e6, 1e9, 1e22];
    let near = (0..2000).flat_map(|k| {
        let quarter = f64::from(k) * std::f64::consts::FRAC_PI_2;
        [quarter, quarter.next_up(), quarter.next_down(), -quarter]
    });
    random.enumerate().map(move |(k, x)| x * sizes[k % sizes.len()]).chain(near)
}

#[test]
fn they_are_within_a_unit_in_the_last_place_of_libm() {
    let mut others = 0;
    for angle in angles() {
        let (sine, cosine) = sin_cos(angle);
        let (s, c) = libm::sincos(angle);
        for (own, known) in [(sine, s), (cosine, c)] {
            let unit = known.abs().next_up() - known.abs();
            assert!((own - known).abs() <= 1.01 * unit, "{angle}: {own} instead of {known}");
            others += usize::from(own != known);
        }
    }
    assert!(others < 9000, "{others} of 816000 differ");
}

#[test]
fn what_is_no_angle_has_none() {
    for angle in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let (sine, cosine) = sin_cos(angle);
        assert!(sine.is_nan() && cosine.is_nan());
        let (mut sines, mut cosines) = ([0.0; 5], [0.0; 5]);
        all(&[1.0, angle, 2.0, 3.0, 4.0], &mut sines, &mut cosines);
        assert!(sines[1].is_nan() && sines[0] == sin(1.0) && cosines[4] == cos(4.0));
    }
}

#[test]
fn lanes_have_the_bits_of_one() {
    let list: Vec<f64> = angles().collect();
    for size in 1..20 {
        for chunk in list.chunks(size).take(2000) {
            let (mut sines, mut cosines) = (vec![0.0; chunk.len()], vec![0.0; chunk.len()]);
            all(chunk, &mut sines, &mut cosines);
            for ((angle, sine), cosine) in chunk.iter().zip(&sines).zip(&cosines) {
                let (s, c) = sin_cos(*angle);
                assert_eq!((s.to_bits(), c.to_bits()), (sine.to_bits(), cosine.to_bits()), "{angle}");
            }
        }
    }
}
