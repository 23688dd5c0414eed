//! [`Rewriting`]: the operations of one graph written into another one, with some of its nodes replaced.

use rustc_hash::FxHashMap;

use super::graph::{Call, Expr, Graph, Node};

/// Carries nodes of an old graph over to a new one. Everything is simplified anew, so that what the replacements make
/// constant folds away.
pub struct Rewriting<'g> {
    old: &'g Graph,
    new_of: FxHashMap<Node, Node>,
    calls: FxHashMap<u32, u32>,
}

impl<'g> Rewriting<'g> {
    /// Starts with the tables of the old graph. `replaced` gives what stands for some of its nodes.
    pub fn new(old: &'g Graph, new: &mut Graph, replaced: FxHashMap<Node, Node>) -> Self {
        new.tables.clone_from(&old.tables);
        Self { old, new_of: replaced, calls: FxHashMap::default() }
    }

    /// The new node for an old one. Inputs that were not replaced keep their slots.
    pub fn carry(&mut self, new: &mut Graph, node: Node) -> Node {
        if let Some(known) = self.new_of.get(&node) {
            return *known;
        }
        let needed = self.old.ancestors(&[node], |node| self.new_of.contains_key(&node));
        for old in needed {
            if !self.new_of.contains_key(&old) {
                let made = self.one(new, old);
                self.new_of.insert(old, made);
            }
        }
        self.new_of[&node]
    }

    /// The new nodes for several old ones.
    pub fn carry_all(&mut self, new: &mut Graph, nodes: &[Node]) -> Vec<Node> {
        nodes.iter().map(|node| self.carry(new, *node)).collect()
    }

    /// The new node for an old one that was carried over or replaced.
    pub fn known(&self, node: Node) -> Node {
        self.new_of[&node]
    }

    /// Whether there is a new node for an old one.
    pub fn knows(&self, node: Node) -> bool {
        self.new_of.contains_key(&node)
    }

    /// Says what stands for an old node.
    pub fn replace(&mut self, node: Node, new: Node) {
        self.new_of.insert(node, new);
    }

    /// A node whose operands are carried over.
    pub(super) fn one(&mut self, g: &mut Graph, node: Node) -> Node {
        let at = |node: Node| self.new_of[&node];
        match self.old.expr(node) {
            Expr::Constant(bits) => g.constant(f64::from_bits(bits)),
            Expr::Input(slot) => g.input(slot as usize),
            Expr::Add(a, b) => g.add(at(a), at(b)),
            Expr::Sub(a, b) => g.sub(at(a), at(b)),
            Expr::Mul(a, b) => g.mul(at(a), at(b)),
            Expr::Div(a, b) => g.div(at(a), at(b)),
            Expr::Neg(a) => g.neg(at(a)),
            Expr::Sqrt(a) => g.sqrt(at(a)),
            Expr::Sin(a) => g.sin(at(a)),
            Expr::Cos(a) => g.cos(at(a)),
            Expr::Atan2(a, b) => g.atan2(at(a), at(b)),
            Expr::Exp(a) => g.exp(at(a)),
            Expr::Ln(a) => g.ln(at(a)),
            Expr::Tanh(a) => g.tanh(at(a)),
            Expr::Powi(a, n) => g.powi(at(a), n),
            Expr::Powf(a, exponent) => g.powf(at(a), f64::from_bits(exponent)),
            Expr::Select(a, b, c, d) => g.select(at(a), at(b), at(c), at(d)),
            Expr::Table { table, order, at: a } => g.table(table, order, at(a)),
            Expr::Call { call, result } => {
                let call = self.call(g, call);
                g.call_result(call as usize, result as usize)
            }
        }
    }

    fn call(&mut self, g: &mut Graph, call: u32) -> u32 {
        if let Some(known) = self.calls.get(&call) {
            return *known;
        }
        let old = &self.old.calls[call as usize];
        let arguments = old.arguments.iter().map(|node| self.new_of[node]).collect();
        g.calls.push(Call { arguments, ..old.clone() });
        let number = (g.calls.len() - 1) as u32;
        self.calls.insert(call, number);
        number
    }
}
