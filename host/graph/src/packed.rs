//! [`Exprs`]: operations in twelve bytes each. Graphs of large scenes have millions of them.

use super::graph::{Expr, Node};

/// What an operation does; the rest is in its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
enum Kind {
    Constant,
    Input,
    Add,
    Sub,
    Mul,
    Div,
    Neg,
    Sqrt,
    Sin,
    Cos,
    Atan2,
    Exp,
    Ln,
    Tanh,
    Powi,
    Table,
    Call,
    /// Its numbers are among the wide ones.
    Powf,
    /// Its numbers are among the wide ones.
    Select,
}

/// An operation whose numbers are no more than two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Packed {
    kind: Kind,
    /// Of the derivative of a table.
    order: u16,
    numbers: [u32; 2],
}

/// A list of operations.
#[derive(Debug, Clone, Default)]
pub(super) struct Exprs {
    list: Vec<Packed>,
    /// The numbers of those that have more than two.
    wide: Vec<[u32; 4]>,
}

/// Where to look for an operation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Key {
    pub(super) hash: u32,
    /// What it is equal to in a list, where its numbers are no more than two.
    packed: Option<Packed>,
}

fn halves(bits: u64) -> [u32; 2] {
    [bits as u32, (bits >> 32) as u32]
}

fn whole([low, high]: [u32; 2]) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

impl Packed {
    /// An operation, if its numbers are no more than two; else what it does, and its numbers.
    #[inline(always)]
    fn of(expr: &Expr) -> Result<Self, (Kind, [u32; 4])> {
        let (mut order, none) = (0, 0);
        let (kind, numbers) = match *expr {
            Expr::Constant(bits) => (Kind::Constant, halves(bits)),
            Expr::Input(slot) => (Kind::Input, [slot, none]),
            Expr::Add(a, b) => (Kind::Add, [a.0, b.0]),
            Expr::Sub(a, b) => (Kind::Sub, [a.0, b.0]),
            Expr::Mul(a, b) => (Kind::Mul, [a.0, b.0]),
            Expr::Div(a, b) => (Kind::Div, [a.0, b.0]),
            Expr::Neg(a) => (Kind::Neg, [a.0, none]),
            Expr::Sqrt(a) => (Kind::Sqrt, [a.0, none]),
            Expr::Sin(a) => (Kind::Sin, [a.0, none]),
            Expr::Cos(a) => (Kind::Cos, [a.0, none]),
            Expr::Atan2(a, b) => (Kind::Atan2, [a.0, b.0]),
            Expr::Exp(a) => (Kind::Exp, [a.0, none]),
            Expr::Ln(a) => (Kind::Ln, [a.0, none]),
            Expr::Tanh(a) => (Kind::Tanh, [a.0, none]),
            Expr::Powi(a, n) => (Kind::Powi, [a.0, n.cast_unsigned()]),
            Expr::Table { table, order: own, at } => {
                order = u16::try_from(own).expect("derivatives of tables are of low order");
                (Kind::Table, [at.0, table])
            }
            Expr::Call { call, result } => (Kind::Call, [call, result]),
            Expr::Powf(a, bits) => {
                let [low, high] = halves(bits);
                return Err((Kind::Powf, [a.0, low, high, none]));
            }
            Expr::Select(a, b, c, d) => return Err((Kind::Select, [a.0, b.0, c.0, d.0])),
        };
        Ok(Self { kind, order, numbers })
    }

    /// The last node that it uses directly; none of what uses no node, and of calls.
    #[inline]
    fn near(self, wide: &[[u32; 4]]) -> Option<u32> {
        let [a, b] = self.numbers;
        match self.kind {
            Kind::Constant | Kind::Input | Kind::Call => None,
            Kind::Add | Kind::Sub | Kind::Mul | Kind::Div | Kind::Atan2 => Some(a.max(b)),
            Kind::Powf => Some(wide[a as usize][0]),
            Kind::Select => wide[a as usize].into_iter().max(),
            _ => Some(a),
        }
    }

    /// Calls `visit` with the nodes that it uses directly; `false` for calls, whose arguments are elsewhere.
    #[inline(always)]
    fn operands(self, wide: &[[u32; 4]], mut visit: impl FnMut(Node)) -> bool {
        let [a, b] = self.numbers;
        match self.kind {
            Kind::Constant | Kind::Input => {}
            Kind::Add | Kind::Sub | Kind::Mul | Kind::Div | Kind::Atan2 => {
                visit(Node(a));
                visit(Node(b));
            }
            Kind::Call => return false,
            Kind::Powf => visit(Node(wide[a as usize][0])),
            Kind::Select => wide[a as usize].into_iter().for_each(|node| visit(Node(node))),
            _ => visit(Node(a)),
        }
        true
    }

    #[inline]
    fn expr(self, wide: &[[u32; 4]]) -> Expr {
        let [first, second] = self.numbers;
        let (a, b) = (Node(first), Node(second));
        match self.kind {
            Kind::Constant => Expr::Constant(whole(self.numbers)),
            Kind::Input => Expr::Input(first),
            Kind::Add => Expr::Add(a, b),
            Kind::Sub => Expr::Sub(a, b),
            Kind::Mul => Expr::Mul(a, b),
            Kind::Div => Expr::Div(a, b),
            Kind::Neg => Expr::Neg(a),
            Kind::Sqrt => Expr::Sqrt(a),
            Kind::Sin => Expr::Sin(a),
            Kind::Cos => Expr::Cos(a),
            Kind::Atan2 => Expr::Atan2(a, b),
            Kind::Exp => Expr::Exp(a),
            Kind::Ln => Expr::Ln(a),
            Kind::Tanh => Expr::Tanh(a),
            Kind::Powi => Expr::Powi(a, second.cast_signed()),
            Kind::Table => Expr::Table { table: second, order: u32::from(self.order), at: a },
            Kind::Call => Expr::Call { call: first, result: second },
            Kind::Powf => {
                let [a, low, high, _] = wide[first as usize];
                Expr::Powf(Node(a), whole([low, high]))
            }
            Kind::Select => {
                let [a, b, c, d] = wide[first as usize].map(Node);
                Expr::Select(a, b, c, d)
            }
        }
    }
}

/// Multiplies and folds: all bits of the numbers have their say in each bit of the result.
#[inline]
fn hash(kind: Kind, order: u16, [low, high]: [u32; 2]) -> u32 {
    const ODD: u64 = 0x9e37_79b9_7f4a_7c15;
    let what = u64::from(kind as u8) << 56 | u64::from(order) << 40;
    let first = (whole([low, high]) ^ what).wrapping_mul(ODD);
    ((first ^ first >> 32).wrapping_mul(ODD) >> 32) as u32
}

impl Key {
    #[inline(always)]
    pub(super) fn of(expr: &Expr) -> Self {
        match Packed::of(expr) {
            Ok(packed) => Self { hash: hash(packed.kind, packed.order, packed.numbers), packed: Some(packed) },
            Err((kind, [a, b, c, d])) => {
                let parts = [hash(kind, 1, [c, d]), hash(kind, 0, [a, b])];
                Self { hash: hash(kind, 0, parts), packed: None }
            }
        }
    }

    /// The last node that the operation uses directly; none of what uses no node, and of calls.
    #[inline]
    pub(super) fn near(&self, expr: &Expr) -> Option<u32> {
        match (self.packed, *expr) {
            (Some(packed), _) => packed.near(&[]),
            (None, Expr::Select(a, b, c, d)) => Some(a.max(b).max(c).max(d).0),
            (None, Expr::Powf(a, _)) => Some(a.0),
            (None, _) => None,
        }
    }
}

impl Exprs {
    pub(super) fn len(&self) -> usize {
        self.list.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    #[inline]
    pub(super) fn get(&self, at: usize) -> Expr {
        self.list[at].expr(&self.wide)
    }

    /// The number that an operation is, if it is one.
    #[inline]
    pub(super) fn value(&self, at: usize) -> Option<f64> {
        let packed = self.list[at];
        (packed.kind == Kind::Constant).then(|| f64::from_bits(whole(packed.numbers)))
    }

    /// Whether an operation is a number or a negation.
    #[inline]
    pub(super) fn simplifies(&self, at: usize) -> bool {
        matches!(self.list[at].kind, Kind::Constant | Kind::Neg)
    }

    /// Whether an operation of the list is this one, to which the key belongs.
    #[inline]
    pub(super) fn is(&self, at: usize, key: &Key, expr: &Expr) -> bool {
        match key.packed {
            Some(packed) => self.list[at] == packed,
            None => self.get(at) == *expr,
        }
    }

    /// Calls `visit` with the nodes that an operation uses directly; `false` for calls, whose arguments are elsewhere.
    #[inline(always)]
    pub(super) fn operands(&self, at: usize, visit: impl FnMut(Node)) -> bool {
        self.list[at].operands(&self.wide, visit)
    }

    /// As [`Key::near`] of an operation of the list.
    #[inline]
    pub(super) fn near(&self, at: usize) -> Option<u32> {
        self.list[at].near(&self.wide)
    }

    pub(super) fn push(&mut self, key: &Key, expr: &Expr) {
        let packed = key.packed.unwrap_or_else(|| {
            let (kind, numbers) = Packed::of(expr).expect_err("its numbers are more than two");
            self.wide.push(numbers);
            Packed { kind, order: 0, numbers: [(self.wide.len() - 1) as u32, 0] }
        });
        self.list.push(packed);
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = Expr> + '_ {
        self.list.iter().map(|packed| packed.expr(&self.wide))
    }

    /// Keeps so many.
    pub(super) fn truncate(&mut self, len: usize) {
        let is_wide = |packed: &&Packed| matches!(packed.kind, Kind::Powf | Kind::Select);
        if let Some(first) = self.list[len..].iter().find(is_wide) {
            self.wide.truncate(first.numbers[0] as usize);
        }
        self.list.truncate(len);
    }

    /// Room for more.
    pub(super) fn reserve(&mut self, more: usize) {
        self.list.reserve(more);
    }

    pub(super) fn shrink_to_fit(&mut self) {
        self.list.shrink_to_fit();
        self.wide.shrink_to_fit();
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    /// Each operation comes back as it was, and none is taken for another one.
    #[test]
    fn operations_come_back() {
        let (a, b, c, d) = (Node(7), Node(u32::MAX - 2), Node(0), Node(41));
        let all = [
            Expr::Constant((-1.5_f64).to_bits()),
            Expr::Constant(f64::NAN.to_bits()),
            Expr::Input(7),
            Expr::Add(a, b),
            Expr::Sub(a, b),
            Expr::Sub(b, a),
            Expr::Mul(a, b),
            Expr::Div(a, b),
            Expr::Neg(a),
            Expr::Sqrt(a),
            Expr::Sin(a),
            Expr::Cos(a),
            Expr::Atan2(a, b),
            Expr::Exp(a),
            Expr::Ln(a),
            Expr::Tanh(a),
            Expr::Powi(a, -3),
            Expr::Powf(a, 0.3_f64.to_bits()),
            Expr::Powf(a, 0.7_f64.to_bits()),
            Expr::Select(a, b, c, d),
            Expr::Select(a, b, d, c),
            Expr::Table { table: 7, order: 2, at: a },
            Expr::Table { table: 7, order: 3, at: a },
            Expr::Call { call: 7, result: 1 },
        ];
        let mut list = Exprs::default();
        all.iter().for_each(|expr| list.push(&Key::of(expr), expr));
        assert_eq!(list.iter().collect::<Vec<_>>(), all);
        let mut hashes: Vec<u32> = all.iter().map(|expr| Key::of(expr).hash).collect();
        hashes.sort_unstable();
        hashes.dedup();
        assert_eq!(hashes.len(), all.len());
        for (at, expr) in all.iter().enumerate() {
            let key = Key::of(expr);
            assert_eq!(list.near(at), key.near(expr));
            let (mut found, known) = (Vec::new(), RefCell::new(Vec::new()));
            assert_eq!(list.operands(at, |node| found.push(node)), !matches!(expr, Expr::Call { .. }));
            expr.with_operands(|node| {
                known.borrow_mut().push(node);
                node
            });
            assert_eq!(found, known.into_inner());
            assert_eq!(list.simplifies(at), matches!(expr, Expr::Constant(_) | Expr::Neg(_)));
            assert!((0..all.len()).all(|other| list.is(other, &key, expr) == (other == at)));
        }
        assert_eq!(size_of::<Packed>(), 12);
        for len in (0..=all.len()).rev() {
            list.truncate(len);
            let wide = all[..len].iter().filter(|expr| matches!(expr, Expr::Powf(..) | Expr::Select(..))).count();
            assert_eq!((list.iter().collect::<Vec<_>>(), list.wide.len()), (all[..len].to_vec(), wide));
        }
    }
}
