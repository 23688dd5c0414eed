//! [`Graph`]: every operation once, simplified while it is built.

use std::sync::Arc;

use element_api::Table;

use super::packed::{Exprs, Key};
use super::solved::Solved;

/// A value in the graph. Operands of a node always have smaller numbers than the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Node(
    /// Its place in the order of the graph.
    pub u32,
);

/// What a node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Expr {
    /// A number, by its bits (so that equal numbers are equal nodes).
    Constant(u64),
    /// Entry of the input vector.
    Input(u32),
    /// a + b
    Add(Node, Node),
    /// a - b
    Sub(Node, Node),
    /// a b
    Mul(Node, Node),
    /// a / b
    Div(Node, Node),
    /// -a
    Neg(Node),
    /// Square root.
    Sqrt(Node),
    /// Sine.
    Sin(Node),
    /// Cosine.
    Cos(Node),
    /// Angle of the point (b, a).
    Atan2(Node, Node),
    /// Exponential.
    Exp(Node),
    /// Natural logarithm.
    Ln(Node),
    /// Hyperbolic tangent.
    Tanh(Node),
    /// Whole power.
    Powi(Node, i32),
    /// Real power, the exponent by its bits.
    Powf(Node, u64),
    /// c where a < b, otherwise d.
    Select(Node, Node, Node, Node),
    /// Derivative of some order of a table.
    Table {
        /// Which table.
        table: u32,
        /// Order of the derivative; 0 is the value.
        order: u32,
        /// The argument.
        at: Node,
    },
    /// A result of an opaque element.
    Call {
        /// Which call.
        call: u32,
        /// Which of its results.
        result: u32,
    },
}

/// A call of an opaque element instance.
#[derive(Debug, Clone)]
pub struct Call {
    /// Which set of the model.
    pub set: usize,
    /// Which instance of the set.
    pub instance: u32,
    /// Its inputs, laid out by [`element_api::set::Layout`].
    pub arguments: Vec<Node>,
    /// Number of results.
    pub results: usize,
    /// Results from here on are derivatives.
    pub jacobian_from: usize,
    /// Results from here to `second_to` are second derivatives.
    pub second_from: usize,
    /// End of the second derivatives.
    pub second_to: usize,
}

/// Places of the smallest table of known expressions.
const FEWEST_PLACES: usize = 256;
/// In tables with more places than this, which caches do not hold, expressions go near those that they use: what is built
/// together is looked up together.
const LARGE: usize = 1 << 17;
/// Within so many places, a power of two.
const NEIGHBOURS: usize = 1 << 13;
/// Places there that are tried.
const NEAR_TRIES: usize = 16;
/// Below so many nodes, marking those that are reached is faster than entering them into a table, however few they are.
pub(super) const FEW: usize = 1 << 14;
/// An empty place in the table of known expressions.
const NO_NODE: u32 = u32::MAX;

/// A place in the table of known expressions.
#[derive(Debug, Clone, Copy)]
struct Known {
    /// Of the expression: distinguishes nearly all others without a look at the node.
    hash: u32,
    /// Its number, or [`NO_NODE`].
    node: u32,
}

/// The operations of a scene.
#[derive(Debug, Clone, Default)]
pub struct Graph {
    /// The first nodes, which copies have in common: see [`Graph::share`].
    shared: Arc<Exprs>,
    /// All others.
    exprs: Exprs,
    /// Nodes by what they are, with empty places between; as many entries as a power of two.
    known: Vec<Known>,
    /// Tables that nodes refer to.
    pub tables: Vec<Table>,
    /// Calls that nodes refer to.
    pub calls: Vec<Call>,
    /// Unknowns that are found from conditions, in an order in which each depends on earlier ones only.
    pub solved: Vec<Solved>,
    /// How many operations were asked for, before simplification.
    pub requested: usize,
}

/// The place of an expression in a table of known ones: where it is, if `is_it` says so of a node with its hash, or the empty place
/// where it belongs. The table has empty places.
#[inline]
fn place_of(hash: u32, near: impl Fn() -> Option<u32>, table: &[Known], is_it: impl Fn(u32) -> bool) -> usize {
    let mask = table.len() - 1;
    let fits = |at: usize| {
        let known = table[at];
        known.node == NO_NODE || (known.hash == hash && is_it(known.node))
    };
    let is_large = table.len() > LARGE;
    if is_large && let Some(near) = near() {
        // Nodes are three eighths to three quarters as many as places: they go around once or twice.
        let first = near as usize * 8 / 3 + (hash as usize & (NEIGHBOURS - 1));
        for at in first..first + NEAR_TRIES {
            if fits(at & mask) {
                return at & mask;
            }
        }
    }
    let mut at = ((u64::from(hash) * table.len() as u64) >> 32) as usize;
    // In large tables not along what is full of neighbours; an odd step comes to all places.
    let step = if is_large { hash as usize | 1 } else { 1 };
    while !fits(at) {
        at = (at + step) & mask;
    }
    at
}

impl Expr {
    /// The same operation of other nodes.
    pub(super) fn with_operands(self, node: impl Fn(Node) -> Node) -> Self {
        match self {
            Self::Constant(_) | Self::Input(_) | Self::Call { .. } => self,
            Self::Add(a, b) => Self::Add(node(a), node(b)),
            Self::Sub(a, b) => Self::Sub(node(a), node(b)),
            Self::Mul(a, b) => Self::Mul(node(a), node(b)),
            Self::Div(a, b) => Self::Div(node(a), node(b)),
            Self::Neg(a) => Self::Neg(node(a)),
            Self::Sqrt(a) => Self::Sqrt(node(a)),
            Self::Sin(a) => Self::Sin(node(a)),
            Self::Cos(a) => Self::Cos(node(a)),
            Self::Atan2(a, b) => Self::Atan2(node(a), node(b)),
            Self::Exp(a) => Self::Exp(node(a)),
            Self::Ln(a) => Self::Ln(node(a)),
            Self::Tanh(a) => Self::Tanh(node(a)),
            Self::Powi(a, n) => Self::Powi(node(a), n),
            Self::Powf(a, bits) => Self::Powf(node(a), bits),
            Self::Select(a, b, c, d) => Self::Select(node(a), node(b), node(c), node(d)),
            Self::Table { table, order, at } => Self::Table { table, order, at: node(at) },
        }
    }
}

impl Graph {
    /// An empty graph with room for so many nodes.
    #[must_use]
    pub fn with_room(nodes: usize) -> Self {
        let mut graph = Self::default();
        graph.enlarge(2 * nodes);
        graph
    }

    /// Makes room for so many nodes in all, so that known ones are not entered into larger and larger tables on the way.
    pub fn reserve(&mut self, nodes: usize) {
        if 4 * (nodes + 1) > 3 * self.known.len() {
            self.enlarge(4 * (nodes + 1) / 3 + 1);
        }
    }

    /// The number of distinct nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.shared.len() + self.exprs.len()
    }

    /// All nodes, ascending.
    pub fn nodes(&self) -> impl Iterator<Item = Node> + use<> {
        (0..self.len() as u32).map(Node)
    }

    /// Whether there is no node yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What a node is.
    #[must_use]
    #[inline]
    pub fn expr(&self, node: Node) -> Expr {
        let at = node.0 as usize;
        match at.checked_sub(self.shared.len()) {
            Some(at) => self.exprs.get(at),
            None => self.shared.get(at),
        }
    }

    /// The number a node is, if it is one.
    #[must_use]
    #[inline]
    pub fn value(&self, node: Node) -> Option<f64> {
        let at = node.0 as usize;
        match at.checked_sub(self.shared.len()) {
            Some(at) => self.exprs.value(at),
            None => self.shared.value(at),
        }
    }

    /// Whether a node is a number or a negation: what operations on it are simplified by.
    #[inline]
    pub(super) fn simplifies(&self, node: Node) -> bool {
        let at = node.0 as usize;
        match at.checked_sub(self.shared.len()) {
            Some(at) => self.exprs.simplifies(at),
            None => self.shared.simplifies(at),
        }
    }

    /// Whether a node is the number zero.
    #[must_use]
    pub fn is_zero(&self, node: Node) -> bool {
        self.value(node) == Some(0.0)
    }

    /// The node of an expression, a new one where there is none yet. The table holds numbers and hashes only, since for
    /// large scenes it would otherwise be larger than the graph (open addressing, Knuth, TAOCP 3, 6.4, algorithm L; in large tables
    /// first near what the expression uses).
    #[inline]
    pub(super) fn intern(&mut self, expr: Expr) -> Node {
        self.intern_by(&Key::of(&expr), &expr)
    }

    fn intern_by(&mut self, key: &Key, expr: &Expr) -> Node {
        if 4 * (self.len() + 1) > 3 * self.known.len() {
            self.enlarge((2 * self.known.len()).max(2 * self.len()));
        }
        let shared = self.shared.len();
        let is_it = |node: u32| match (node as usize).checked_sub(shared) {
            Some(at) => self.exprs.is(at, key, expr),
            None => self.shared.is(node as usize, key, expr),
        };
        let at = place_of(key.hash, || key.near(expr), &self.known, is_it);
        let known = self.known[at].node;
        if known != NO_NODE {
            return Node(known);
        }
        let node = self.len() as u32;
        self.known[at] = Known { hash: key.hash, node };
        self.exprs.push(key, expr);
        Node(node)
    }

    /// Frees the table of known expressions; it is made again when a node is to be added.
    pub fn rest(&mut self) {
        self.known = Vec::new();
        self.exprs.shrink_to_fit();
    }

    /// Forgets the nodes from this number on, which were added for a while, and [rests](Graph::rest). Nodes that are shared stay.
    pub fn cut(&mut self, nodes: usize) {
        self.exprs.truncate(nodes.saturating_sub(self.shared.len()).min(self.exprs.len()));
        self.rest();
    }

    /// From now on copies have the nodes so far in common: they cost no time and no memory. To be called where no more than a few
    /// are to come.
    pub fn share(&mut self) {
        if self.shared.is_empty() {
            self.shared = Arc::new(std::mem::take(&mut self.exprs));
        }
    }

    /// A copy that [rests](Graph::rest).
    #[must_use]
    pub fn at_rest(&self) -> Self {
        Self {
            shared: Arc::clone(&self.shared),
            exprs: self.exprs.clone(),
            known: Vec::new(),
            tables: self.tables.clone(),
            calls: self.calls.clone(),
            solved: self.solved.clone(),
            requested: self.requested,
        }
    }

    /// At least so many places, more than there are nodes.
    fn enlarge(&mut self, places: usize) {
        let size = places.next_power_of_two().max(FEWEST_PLACES);
        self.exprs.reserve((3 * size / 4).saturating_sub(self.len()));
        let mut table = vec![Known { hash: 0, node: NO_NODE }; size];
        let mut enter = |hash: u32, node: u32| {
            let at = node as usize;
            let near =
                || at.checked_sub(self.shared.len()).map_or_else(|| self.shared.near(at), |at| self.exprs.near(at));
            let at = place_of(hash, near, &table, |_| false);
            table[at] = Known { hash, node };
        };
        if self.known.is_empty() {
            let all = self.shared.iter().chain(self.exprs.iter());
            all.zip(0..).for_each(|(expr, node)| enter(Key::of(&expr).hash, node));
        } else {
            self.known.iter().filter(|known| known.node != NO_NODE).for_each(|known| enter(known.hash, known.node));
        }
        self.known = table;
    }

    /// The nodes a node uses directly. The arguments of a call count as operands of its results.
    #[inline]
    pub fn operands(&self, node: Node, mut visit: impl FnMut(Node)) {
        let at = node.0 as usize;
        let is_plain = match at.checked_sub(self.shared.len()) {
            Some(at) => self.exprs.operands(at, &mut visit),
            None => self.shared.operands(at, &mut visit),
        };
        if !is_plain && let Expr::Call { call, .. } = self.expr(node) {
            self.calls[call as usize].arguments.iter().copied().for_each(visit);
        }
    }

    /// Everything `outputs` depend on, themselves included, in ascending order. For many outputs, faster than
    /// [`Graph::ancestors`]: it looks at every node below the last output.
    #[must_use]
    pub fn live(&self, outputs: &[Node]) -> Vec<Node> {
        self.marked(outputs, |_| false)
    }

    /// Everything `outputs` depend on, themselves included, in ascending order; `stop` nodes are listed but not entered.
    #[must_use]
    pub fn ancestors(&self, outputs: &[Node], stop: impl Fn(Node) -> bool) -> Vec<Node> {
        let few = outputs.iter().all(|node| (node.0 as usize) < FEW);
        if few { self.marked(outputs, stop) } else { self.entered(outputs, stop) }
    }

    /// Whether nodes have so little in common that one by one they take at most twice the operations of all together: what is
    /// wanted of a few of them only is then best evaluated one by one.
    #[must_use]
    pub fn are_apart(&self, nodes: &[Node]) -> bool {
        const APART: usize = 2;
        let alone: usize = nodes.iter().map(|node| self.ancestors(&[*node], |_| false).len()).sum();
        alone <= APART * self.live(nodes).len()
    }

    /// The same by a mark for every node below the last output.
    fn marked(&self, outputs: &[Node], stop: impl Fn(Node) -> bool) -> Vec<Node> {
        const BITS: usize = u64::BITS as usize;
        let words = outputs.iter().max().map_or(0, |node| node.0 as usize / BITS + 1);
        let mut marked = vec![0_u64; words];
        let mark = |marked: &mut [u64], node: Node| marked[node.0 as usize / BITS] |= 1 << (node.0 as usize % BITS);
        outputs.iter().for_each(|node| mark(&mut marked, *node));
        let mut list = Vec::with_capacity(4 * outputs.len());
        for word in (0..words).rev() {
            // Operands have smaller numbers, in this word or in one before.
            let mut open = marked[word];
            while open != 0 {
                let bit = BITS - 1 - open.leading_zeros() as usize;
                let node = Node((word * BITS + bit) as u32);
                list.push(node);
                if !stop(node) {
                    self.operands(node, |operand| mark(&mut marked, operand));
                }
                open = marked[word] & ((1 << bit) - 1);
            }
        }
        list.reverse();
        list
    }

    /// Nodes, ascending and with all that they depend on, no results of calls among them, as a graph of their own in the same order;
    /// and what some of them are there.
    #[must_use]
    pub(super) fn excerpt(&self, live: &[Node], some: &[Node]) -> (Self, Vec<Node>) {
        let place = |node: Node| Node(live.binary_search(&node).unwrap_or_default() as u32);
        let mut exprs = Exprs::default();
        for node in live {
            let expr = self.expr(*node).with_operands(place);
            exprs.push(&Key::of(&expr), &expr);
        }
        let looks_up = live.iter().any(|node| matches!(self.expr(*node), Expr::Table { .. }));
        let tables = if looks_up { self.tables.clone() } else { Vec::new() };
        (Self { exprs, tables, ..Self::default() }, some.iter().map(|node| place(*node)).collect())
    }

    /// The same by a table of those that were reached.
    pub(super) fn entered(&self, outputs: &[Node], stop: impl Fn(Node) -> bool) -> Vec<Node> {
        let mut seen = rustc_hash::FxHashSet::default();
        let mut open: Vec<Node> = outputs.to_vec();
        while let Some(node) = open.pop() {
            if seen.insert(node) && !stop(node) {
                self.operands(node, |operand| open.push(operand));
            }
        }
        let mut list: Vec<Node> = seen.into_iter().collect();
        list.sort_unstable();
        list
    }
}
