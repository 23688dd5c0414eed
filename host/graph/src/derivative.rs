//! Exact derivatives of the graph, as further nodes of the graph.

use rustc_hash::{FxBuildHasher, FxHashMap};

use super::graph::{Expr, Graph, Node};

/// Nodes whose derivative is given: the direction of differentiation. Whatever does not depend on them is constant.
pub type Seeds = FxHashMap<Node, Node>;

/// The derivatives of `outputs` along a direction, by the chain rule from the seeds upwards (Griewank & Walther, ch. 3,
/// forward mode). A seeded node counts as a variable of its own: what it was computed from is not looked at.
pub fn derivatives(graph: &mut Graph, outputs: &[Node], seeds: &Seeds) -> Vec<Node> {
    let below = graph.ancestors(outputs, |node| seeds.contains_key(&node));
    derivatives_among(graph, &below, outputs, seeds)
}

/// The same with all nodes that may depend on the seeds at hand, ascending: what several directions share.
pub fn derivatives_among(graph: &mut Graph, below: &[Node], outputs: &[Node], seeds: &Seeds) -> Vec<Node> {
    let zero = graph.constant(0.0);
    // Nodes that are not in here are constant.
    let mut known = Seeds::with_capacity_and_hasher(seeds.len() + below.len(), FxBuildHasher);
    known.extend(seeds);
    for node in below {
        if !known.contains_key(node) && !every_operand_constant(graph, *node, zero, &known) {
            let derivative = one(graph, *node, zero, &known);
            known.insert(*node, derivative);
        }
    }
    outputs.iter().map(|node| known.get(node).copied().unwrap_or(zero)).collect()
}

/// The derivative of a node of whose operands at least one is not constant.
fn one(g: &mut Graph, node: Node, zero: Node, known: &FxHashMap<Node, Node>) -> Node {
    let d = |a: Node| known.get(&a).copied().unwrap_or(zero);
    match g.expr(node) {
        // Opaque results are differentiated by whoever knows what they mean.
        Expr::Constant(_) | Expr::Input(_) | Expr::Call { .. } => zero,
        Expr::Add(a, b) => g.add(d(a), d(b)),
        Expr::Sub(a, b) => g.sub(d(a), d(b)),
        Expr::Neg(a) => g.neg(d(a)),
        Expr::Mul(a, b) => {
            let left = g.mul(d(a), b);
            let right = g.mul(a, d(b));
            g.add(left, right)
        }
        Expr::Div(a, b) => {
            // (a' - (a/b) b') / b, with the quotient already there.
            let shift = g.mul(node, d(b));
            let top = g.sub(d(a), shift);
            g.div(top, b)
        }
        Expr::Sqrt(a) => {
            let half = g.constant(0.5);
            let top = g.mul(half, d(a));
            g.div(top, node)
        }
        Expr::Sin(a) => {
            let c = g.cos(a);
            g.mul(c, d(a))
        }
        Expr::Cos(a) => {
            let s = g.sin(a);
            let product = g.mul(s, d(a));
            g.neg(product)
        }
        Expr::Atan2(y, x) => {
            let (p, q) = (g.mul(x, d(y)), g.mul(y, d(x)));
            let top = g.sub(p, q);
            let (xx, yy) = (g.mul(x, x), g.mul(y, y));
            let bottom = g.add(xx, yy);
            g.div(top, bottom)
        }
        Expr::Exp(a) => g.mul(node, d(a)),
        Expr::Ln(a) => g.div(d(a), a),
        Expr::Tanh(a) => {
            let one = g.constant(1.0);
            let square = g.mul(node, node);
            let slope = g.sub(one, square);
            g.mul(slope, d(a))
        }
        Expr::Powi(a, n) => {
            let factor = g.constant(f64::from(n));
            // There is no power below the least one; a library may send it.
            let power = match n.checked_sub(1) {
                Some(below) => g.powi(a, below),
                None => g.div(node, a),
            };
            let slope = g.mul(factor, power);
            g.mul(slope, d(a))
        }
        Expr::Powf(a, bits) => {
            let exponent = f64::from_bits(bits);
            let factor = g.constant(exponent);
            let power = g.powf(a, exponent - 1.0);
            let slope = g.mul(factor, power);
            g.mul(slope, d(a))
        }
        Expr::Select(a, b, x, y) => g.select(a, b, d(x), d(y)),
        Expr::Table { table, order, at } => {
            let slope = g.table(table, order + 1, at);
            g.mul(slope, d(at))
        }
    }
}

fn every_operand_constant(g: &Graph, node: Node, zero: Node, known: &FxHashMap<Node, Node>) -> bool {
    let mut constant = true;
    g.operands(node, |a| constant &= known.get(&a).is_none_or(|d| *d == zero));
    constant
}
