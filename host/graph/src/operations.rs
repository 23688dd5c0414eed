//! Nodes of operations, simplified while they are made: constants are folded, and what adds nothing makes no node.

use super::graph::{Expr, Graph, Node};

impl Graph {
    /// A number. Negative zero becomes zero: nothing here distinguishes them.
    pub fn constant(&mut self, value: f64) -> Node {
        let value = if value == 0.0 { 0.0 } else { value };
        self.intern(Expr::Constant(value.to_bits()))
    }

    /// An entry of the input vector.
    pub fn input(&mut self, slot: usize) -> Node {
        self.intern(Expr::Input(slot as u32))
    }

    /// A result of an opaque call.
    pub fn call_result(&mut self, call: usize, result: usize) -> Node {
        self.intern(Expr::Call { call: call as u32, result: result as u32 })
    }

    /// a + b
    pub fn add(&mut self, a: Node, b: Node) -> Node {
        self.requested += 1;
        let (a, b) = if a <= b { (a, b) } else { (b, a) };
        if !self.simplifies(a) && !self.simplifies(b) {
            return if self.is_unit_circle(a, b) { self.constant(1.0) } else { self.intern(Expr::Add(a, b)) };
        }
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x + y),
            (Some(0.0), None) => return b,
            (None, Some(0.0)) => return a,
            _ => {}
        }
        match (self.expr(a), self.expr(b)) {
            (Expr::Neg(x), Expr::Neg(y)) => {
                let sum = self.add(x, y);
                self.neg(sum)
            }
            (Expr::Neg(x), _) => self.sub(b, x),
            (_, Expr::Neg(y)) => self.sub(a, y),
            _ => self.intern(Expr::Add(a, b)),
        }
    }

    /// Whether a and b are the squares of sine and cosine of the same angle.
    fn is_unit_circle(&self, a: Node, b: Node) -> bool {
        let square_of = |node: Node| match self.expr(node) {
            Expr::Mul(x, y) if x == y => Some(self.expr(x)),
            _ => None,
        };
        match (square_of(a), square_of(b)) {
            (Some(Expr::Sin(x)), Some(Expr::Cos(y))) | (Some(Expr::Cos(x)), Some(Expr::Sin(y))) => x == y,
            _ => false,
        }
    }

    /// a - b
    pub fn sub(&mut self, a: Node, b: Node) -> Node {
        self.requested += 1;
        if a == b {
            return self.constant(0.0);
        }
        if !self.simplifies(a) && !self.simplifies(b) {
            return self.intern(Expr::Sub(a, b));
        }
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x - y),
            (Some(0.0), None) => return self.neg(b),
            (None, Some(0.0)) => return a,
            _ => {}
        }
        match (self.expr(a), self.expr(b)) {
            (Expr::Neg(x), Expr::Neg(y)) => self.sub(y, x),
            (Expr::Neg(x), _) => {
                let sum = self.add(x, b);
                self.neg(sum)
            }
            (_, Expr::Neg(y)) => self.add(a, y),
            _ => self.intern(Expr::Sub(a, b)),
        }
    }

    /// a b
    pub fn mul(&mut self, a: Node, b: Node) -> Node {
        self.requested += 1;
        let (a, b) = if a <= b { (a, b) } else { (b, a) };
        if !self.simplifies(a) && !self.simplifies(b) {
            return self.intern(Expr::Mul(a, b));
        }
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x * y),
            // There is one node that is zero.
            (Some(0.0), None) => return a,
            (None, Some(0.0)) => return b,
            (Some(x), None) => return self.scaled(x, b),
            (None, Some(y)) => return self.scaled(y, a),
            (None, None) => {}
        }
        match (self.expr(a), self.expr(b)) {
            (Expr::Neg(x), Expr::Neg(y)) => self.mul(x, y),
            (Expr::Neg(x), _) => {
                let product = self.mul(x, b);
                self.neg(product)
            }
            (_, Expr::Neg(y)) => {
                let product = self.mul(a, y);
                self.neg(product)
            }
            _ => self.intern(Expr::Mul(a, b)),
        }
    }

    /// factor x, for x that is not a constant.
    fn scaled(&mut self, factor: f64, x: Node) -> Node {
        if factor == 0.0 {
            return self.constant(0.0);
        }
        if factor == 1.0 {
            return x;
        }
        if factor < 0.0 {
            // The sign moves outwards, so that f x and -f x share their product.
            let positive = self.scaled(-factor, x);
            return self.neg(positive);
        }
        match self.expr(x) {
            Expr::Neg(y) => {
                let product = self.scaled(factor, y);
                self.neg(product)
            }
            Expr::Mul(a, b) => match (self.value(a), self.value(b)) {
                (Some(c), None) => self.scaled(factor * c, b),
                (None, Some(c)) => self.scaled(factor * c, a),
                _ => self.product_with(factor, x),
            },
            _ => self.product_with(factor, x),
        }
    }

    fn product_with(&mut self, factor: f64, x: Node) -> Node {
        let c = self.constant(factor);
        let (a, b) = if c <= x { (c, x) } else { (x, c) };
        self.intern(Expr::Mul(a, b))
    }

    /// a / b
    pub fn div(&mut self, a: Node, b: Node) -> Node {
        self.requested += 1;
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x / y),
            (Some(0.0), None) => return a,
            (None, Some(1.0)) => return a,
            (None, Some(-1.0)) => return self.neg(a),
            _ => {}
        }
        match (self.expr(a), self.expr(b)) {
            (Expr::Neg(x), _) => {
                let quotient = self.div(x, b);
                self.neg(quotient)
            }
            (_, Expr::Neg(y)) => {
                let quotient = self.div(a, y);
                self.neg(quotient)
            }
            _ => self.intern(Expr::Div(a, b)),
        }
    }

    /// -a
    pub fn neg(&mut self, a: Node) -> Node {
        self.requested += 1;
        if let Some(x) = self.value(a) {
            return self.constant(-x);
        }
        match self.expr(a) {
            Expr::Neg(x) => x,
            Expr::Sub(x, y) => self.intern(Expr::Sub(y, x)),
            _ => self.intern(Expr::Neg(a)),
        }
    }

    /// A function of one argument: folded when the argument is a number.
    fn unary(&mut self, a: Node, fold: fn(f64) -> f64, make: fn(Node) -> Expr) -> Node {
        self.requested += 1;
        match self.value(a) {
            Some(x) => self.constant(fold(x)),
            None => self.intern(make(a)),
        }
    }

    /// Square root.
    pub fn sqrt(&mut self, a: Node) -> Node {
        self.unary(a, f64::sqrt, Expr::Sqrt)
    }
    /// Sine.
    pub fn sin(&mut self, a: Node) -> Node {
        self.unary(a, f64::sin, Expr::Sin)
    }
    /// Cosine.
    pub fn cos(&mut self, a: Node) -> Node {
        self.unary(a, f64::cos, Expr::Cos)
    }
    /// Exponential.
    pub fn exp(&mut self, a: Node) -> Node {
        self.unary(a, f64::exp, Expr::Exp)
    }
    /// Natural logarithm.
    pub fn ln(&mut self, a: Node) -> Node {
        self.unary(a, f64::ln, Expr::Ln)
    }
    /// Hyperbolic tangent.
    pub fn tanh(&mut self, a: Node) -> Node {
        self.unary(a, f64::tanh, Expr::Tanh)
    }

    /// Angle of the point (x, y).
    pub fn atan2(&mut self, y: Node, x: Node) -> Node {
        self.requested += 1;
        match (self.value(y), self.value(x)) {
            (Some(a), Some(b)) => self.constant(a.atan2(b)),
            _ => self.intern(Expr::Atan2(y, x)),
        }
    }

    /// Whole power.
    pub fn powi(&mut self, a: Node, n: i32) -> Node {
        self.requested += 1;
        match (n, self.value(a)) {
            (_, Some(x)) => self.constant(x.powi(n)),
            (0, _) => self.constant(1.0),
            (1, _) => a,
            (2, _) => self.mul(a, a),
            _ => self.intern(Expr::Powi(a, n)),
        }
    }

    /// Real power.
    pub fn powf(&mut self, a: Node, exponent: f64) -> Node {
        self.requested += 1;
        match self.value(a) {
            Some(x) => self.constant(x.powf(exponent)),
            None if exponent == 0.0 => self.constant(1.0),
            None if exponent == 1.0 => a,
            None => self.intern(Expr::Powf(a, exponent.to_bits())),
        }
    }

    /// c where a < b, otherwise d.
    pub fn select(&mut self, a: Node, b: Node, c: Node, d: Node) -> Node {
        self.requested += 1;
        if c == d {
            return c;
        }
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => {
                if x < y {
                    c
                } else {
                    d
                }
            }
            _ => self.intern(Expr::Select(a, b, c, d)),
        }
    }

    /// Derivative of some order of a table.
    pub fn table(&mut self, table: u32, order: u32, at: Node) -> Node {
        self.requested += 1;
        if order > 3 {
            return self.constant(0.0);
        }
        match self.value(at) {
            Some(x) => {
                let value = self.tables[table as usize].derivative(x, order);
                self.constant(value)
            }
            None => self.intern(Expr::Table { table, order, at }),
        }
    }
}
