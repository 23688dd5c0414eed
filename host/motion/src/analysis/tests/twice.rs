//! Operations in twice the precision, for what round-off does in one.

use crate::program::{Expr, Graph, Node};

/// A number as the sum of two (Dekker 1971).
#[derive(Debug, Clone, Copy)]
struct Twice(f64, f64);

fn sum(a: f64, b: f64) -> Twice {
    let whole = a + b;
    let part = whole - a;
    Twice(whole, (a - (whole - part)) + (b - part))
}

fn product(a: f64, b: f64) -> Twice {
    let whole = a * b;
    Twice(whole, a.mul_add(b, -whole))
}

impl Twice {
    fn add(self, other: Self) -> Self {
        let (high, low) = (sum(self.0, other.0), sum(self.1, other.1));
        let high = sum(high.0, high.1 + low.0);
        sum(high.0, high.1 + low.1)
    }

    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }

    fn mul(self, other: Self) -> Self {
        let whole = product(self.0, other.0);
        sum(whole.0, whole.1 + self.0 * other.1 + self.1 * other.0)
    }

    fn div(self, other: Self) -> Self {
        let mut quotient = Self(self.0 / other.0, 0.0);
        for _ in 0..2 {
            let left = self.add(other.mul(quotient).neg());
            quotient = quotient.add(Self(left.0 / other.0, 0.0));
        }
        quotient
    }
}

/// The values of nodes. Sines and cosines are those of single precision: what is measured is what comes after them.
pub(super) fn evaluate_twice(graph: &Graph, nodes: &[Node], inputs: &[f64]) -> Vec<f64> {
    let mut values: Vec<Twice> = Vec::with_capacity(graph.len());
    for k in 0..graph.len() as u32 {
        let of = |node: Node| values[node.0 as usize];
        let value = match graph.expr(Node(k)) {
            Expr::Constant(bits) => Twice(f64::from_bits(bits), 0.0),
            Expr::Input(slot) => Twice(inputs[slot as usize], 0.0),
            Expr::Add(a, b) => of(a).add(of(b)),
            Expr::Sub(a, b) => of(a).add(of(b).neg()),
            Expr::Mul(a, b) => of(a).mul(of(b)),
            Expr::Div(a, b) => of(a).div(of(b)),
            Expr::Neg(a) => of(a).neg(),
            Expr::Sin(a) => Twice(of(a).0.sin(), 0.0),
            Expr::Cos(a) => Twice(of(a).0.cos(), 0.0),
            other => panic!("not written for {other:?}"),
        };
        values.push(value);
    }
    nodes.iter().map(|node| values[node.0 as usize].0).collect()
}
