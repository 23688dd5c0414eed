//! [`Rewriting`]: the operations of one graph written into another one, with some of its nodes replaced.

use rustc_hash::FxHashMap;

use super::graph::{Call, Expr, Graph, Node};

/// No new node yet.
const UNKNOWN: Node = Node(u32::MAX);
/// Not yet, but about to be made.
const WANTED: Node = Node(u32::MAX - 1);

/// Carries nodes of an old graph over to a new one. Everything is simplified anew, so that what the replacements make
/// constant folds away.
pub struct Rewriting<'g> {
    old: &'g Graph,
    /// By old node; [`UNKNOWN`] where there is none yet.
    new_of: Vec<Node>,
    calls: FxHashMap<u32, u32>,
    /// Room for what [`Rewriting::carry`] needs.
    needed: Vec<Node>,
}

impl<'g> Rewriting<'g> {
    /// Starts with the tables of the old graph. `replaced` gives what stands for some of its nodes.
    pub fn new(old: &'g Graph, new: &mut Graph, replaced: FxHashMap<Node, Node>) -> Self {
        new.tables.clone_from(&old.tables);
        let mut new_of = vec![UNKNOWN; old.len()];
        replaced.into_iter().for_each(|(node, new)| new_of[node.0 as usize] = new);
        Self { old, new_of, calls: FxHashMap::default(), needed: Vec::new() }
    }

    /// The new node for an old one. Inputs that were not replaced keep their slots.
    pub fn carry(&mut self, new: &mut Graph, node: Node) -> Node {
        if self.knows(node) {
            return self.known(node);
        }
        let (graph, new_of) = (self.old, &mut self.new_of);
        let mut needed = std::mem::take(&mut self.needed);
        needed.push(node);
        new_of[node.0 as usize] = WANTED;
        let mut entered = 0;
        while let Some(old) = needed.get(entered).copied() {
            entered += 1;
            graph.operands(old, |operand| {
                let place = &mut new_of[operand.0 as usize];
                if *place == UNKNOWN {
                    *place = WANTED;
                    needed.push(operand);
                }
            });
        }
        // Operands have smaller numbers.
        needed.sort_unstable();
        for old in needed.drain(..) {
            self.new_of[old.0 as usize] = self.one(new, old);
        }
        self.needed = needed;
        self.known(node)
    }

    /// The new nodes for several old ones.
    pub fn carry_all(&mut self, new: &mut Graph, nodes: &[Node]) -> Vec<Node> {
        nodes.iter().map(|node| self.carry(new, *node)).collect()
    }

    /// The new node for an old one that was carried over or replaced.
    ///
    /// # Panics
    /// Where there is none.
    #[must_use]
    pub fn known(&self, node: Node) -> Node {
        let known = self.new_of[node.0 as usize];
        assert!(known < WANTED, "a node that was not carried over");
        known
    }

    /// Whether there is a new node for an old one.
    #[must_use]
    pub fn knows(&self, node: Node) -> bool {
        self.new_of[node.0 as usize] < WANTED
    }

    /// Says what stands for an old node.
    pub fn replace(&mut self, node: Node, new: Node) {
        self.new_of[node.0 as usize] = new;
    }

    /// A node whose operands are carried over.
    pub(super) fn one(&mut self, g: &mut Graph, node: Node) -> Node {
        let at = |node: Node| self.known(node);
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
        let arguments = old.arguments.iter().map(|node| self.known(*node)).collect();
        g.calls.push(Call { arguments, ..old.clone() });
        let number = (g.calls.len() - 1) as u32;
        self.calls.insert(call, number);
        number
    }
}
