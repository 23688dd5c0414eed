//! What values are made of: sums of the magnitudes of their terms, as further nodes of the graph.

use rustc_hash::FxHashMap;

use super::graph::{Expr, Graph, Node};

/// Numbers that differ by less than this share of what they are made of are one but for round-off.
const TIE: f64 = 1e-14;

/// For each of `outputs` the sum of the magnitudes of its terms: where terms cancel, the value is known to round-off of this.
/// `sizes` gives the magnitudes of some nodes; other inputs and results of opaque elements have their own. Not less than the
/// magnitude of the value; infinite, or none, where a small change of an operand changes the value without limit.
pub fn magnitudes(graph: &mut Graph, outputs: &[Node], sizes: &FxHashMap<Node, Node>) -> Vec<Node> {
    let mut known = sizes.clone();
    for node in graph.ancestors(outputs, |node| sizes.contains_key(&node)) {
        if !known.contains_key(&node) {
            let size = graph.magnitude(node, &known);
            known.insert(node, size);
        }
    }
    outputs.iter().map(|node| known[node]).collect()
}

impl Graph {
    /// |a|
    pub fn abs(&mut self, a: Node) -> Node {
        let (zero, negative) = (self.constant(0.0), self.neg(a));
        self.select(a, zero, negative, a)
    }

    /// The magnitude of a node whose operands have theirs.
    fn magnitude(&mut self, node: Node, known: &FxHashMap<Node, Node>) -> Node {
        let of = |a: Node| known[&a];
        match self.expr(node) {
            Expr::Constant(_) | Expr::Input(_) | Expr::Call { .. } => self.abs(node),
            Expr::Add(a, b) | Expr::Sub(a, b) => self.add(of(a), of(b)),
            Expr::Neg(a) => of(a),
            Expr::Mul(a, b) => self.mul(of(a), of(b)),
            Expr::Div(a, b) => {
                let bottom = self.abs(b);
                let own = self.div(of(a), bottom);
                if self.value(b).is_some() {
                    return own;
                }
                // |a / b| times what b is made of, over |b|.
                let value = self.abs(node);
                let share = self.div(of(b), bottom);
                let more = self.mul(value, share);
                self.add(own, more)
            }
            Expr::Sqrt(a) => self.sqrt(of(a)),
            // They are neither more than 1 nor more than their argument.
            Expr::Sin(a) | Expr::Tanh(a) => {
                let one = self.constant(1.0);
                self.select(of(a), one, of(a), one)
            }
            Expr::Cos(_) => self.constant(1.0),
            Expr::Atan2(y, x) => {
                let value = self.abs(node);
                let (left, right) = (self.abs(x), self.abs(y));
                let (left, right) = (self.mul(left, of(y)), self.mul(right, of(x)));
                let (xx, yy) = (self.mul(x, x), self.mul(y, y));
                let (top, bottom) = (self.add(left, right), self.add(xx, yy));
                let change = self.div(top, bottom);
                self.add(value, change)
            }
            Expr::Powi(a, n) if n > 0 => self.powi(of(a), n),
            Expr::Powf(a, bits) if f64::from_bits(bits) > 0.0 => self.powf(of(a), f64::from_bits(bits)),
            Expr::Powi(a, n) => self.by_share(node, a, of(a), f64::from(n)),
            Expr::Powf(a, bits) => self.by_share(node, a, of(a), f64::from_bits(bits)),
            Expr::Exp(a) => {
                let one = self.constant(1.0);
                let change = self.add(one, of(a));
                self.mul(node, change)
            }
            Expr::Ln(a) => {
                let (value, argument) = (self.abs(node), self.abs(a));
                let change = self.div(of(a), argument);
                self.add(value, change)
            }
            Expr::Select(a, b, c, d) => {
                // Where a and b are one but for round-off it is not known which it is: at the place where it switches, at which steps
                // end and begin.
                let (gap, made_of) = (self.sub(a, b), self.add(of(a), of(b)));
                let (gap, share) = (self.abs(gap), self.constant(TIE));
                let allowed = self.mul(share, made_of);
                let (larger, chosen) = (self.select(of(c), of(d), of(d), of(c)), self.select(a, b, of(c), of(d)));
                self.select(gap, allowed, larger, chosen)
            }
            Expr::Table { table, order, at } => {
                let (value, slope) = (self.abs(node), self.table(table, order + 1, at));
                let slope = self.abs(slope);
                let change = self.mul(slope, of(at));
                self.add(value, change)
            }
        }
    }

    /// That of a power of `a`: its value, changed by the exponent times what `a` is made of as a share of it.
    fn by_share(&mut self, node: Node, a: Node, size: Node, exponent: f64) -> Node {
        let (value, argument) = (self.abs(node), self.abs(a));
        let (share, factor) = (self.div(size, argument), self.constant(exponent.abs()));
        let (change, one) = (self.mul(factor, share), self.constant(1.0));
        let change = self.add(one, change);
        self.mul(value, change)
    }
}
