//! Sines and cosines of programs: both of one angle at once.
//!
//! By `libm`, whose functions are the same on every machine and err by less than one unit in the last place; a sine alone has
//! the bits of the sine that comes with a cosine, so that it makes no difference which of them a program needs.

use rustc_hash::FxHashMap;

use super::graph::{Expr, Graph, Node};

/// Sine and cosine.
#[inline]
pub(super) fn sin_cos(angle: f64) -> (f64, f64) {
    libm::sincos(angle)
}

/// The sine of [`sin_cos`].
pub(super) fn sin(angle: f64) -> f64 {
    sin_cos(angle).0
}

/// The cosine of [`sin_cos`].
pub(super) fn cos(angle: f64) -> f64 {
    sin_cos(angle).1
}

/// Nodes in their order, but a sine and a cosine of the same number one right after the other, where the first of them was;
/// these with `true`.
pub(super) fn pairs_together(graph: &Graph, nodes: &[Node]) -> Vec<(Node, bool)> {
    let mut of_angle: FxHashMap<Node, [Option<Node>; 2]> = FxHashMap::default();
    for node in nodes {
        match graph.expr(*node) {
            Expr::Sin(angle) => of_angle.entry(angle).or_default()[0] = Some(*node),
            Expr::Cos(angle) => of_angle.entry(angle).or_default()[1] = Some(*node),
            _ => {}
        }
    }
    let mut ordered = Vec::with_capacity(nodes.len());
    for node in nodes {
        let (Expr::Sin(angle) | Expr::Cos(angle)) = graph.expr(*node) else {
            ordered.push((*node, false));
            continue;
        };
        match of_angle.get_mut(&angle) {
            Some([sine, cosine]) if sine.is_some() && cosine.is_some() => {
                ordered.extend([sine.take(), cosine.take()].into_iter().flatten().map(|node| (node, true)));
            }
            // The second of a pair is there already.
            Some([None, None]) => {}
            _ => ordered.push((*node, false)),
        }
    }
    ordered
}
