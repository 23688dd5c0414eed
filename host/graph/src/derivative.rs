//! Exact derivatives of the graph, as further nodes of the graph.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rustc_hash::FxHashMap;

use super::graph::{Expr, FEW, Graph, Node};
use super::solved::follow_solved;

/// Nodes whose derivative is given: the direction of differentiation. Whatever does not depend on them is constant.
pub type Seeds = FxHashMap<Node, Node>;

/// Nodes that may depend on seeds, each with the places of its operands among them: what several directions share.
#[derive(Debug, Clone)]
pub struct Below {
    /// Ascending.
    nodes: Vec<Node>,
    /// The place behind the last one for an operand that is not among them, which is constant.
    operands: Vec<[u32; 4]>,
}

impl Below {
    /// Everything that `outputs` depend on; what `stop` says is listed but not entered, nor are unknowns that are found from
    /// conditions.
    #[must_use]
    pub fn new(graph: &Graph, outputs: &[Node], stop: impl Fn(Node) -> bool) -> Self {
        let mut solved: Vec<Node> = graph.solved.iter().flat_map(|solved| solved.unknowns.iter().copied()).collect();
        solved.sort_unstable();
        let nodes = graph.ancestors(outputs, |node| solved.binary_search(&node).is_ok() || stop(node));
        let nowhere = nodes.len() as u32;
        // Of small graphs from a table of all nodes.
        let end = nodes.last().map_or(0, |node| node.0 as usize + 1);
        let mut places_of = vec![nowhere; if end < FEW { end } else { 0 }];
        if !places_of.is_empty() {
            nodes.iter().zip(0..).for_each(|(node, place)| places_of[node.0 as usize] = place);
        }
        let place_of = |node: Node| match places_of.get(node.0 as usize) {
            Some(place) => *place,
            None => nodes.binary_search(&node).map_or(nowhere, |place| place as u32),
        };
        let operands = nodes.iter().map(|node| {
            let (mut places, mut count) = ([nowhere; 4], 0);
            // Opaque results are differentiated by whoever knows what they mean.
            if !matches!(graph.expr(*node), Expr::Call { .. }) {
                graph.operands(*node, |operand| {
                    places[count] = place_of(operand);
                    count += 1;
                });
            }
            places
        });
        Self { operands: operands.collect(), nodes }
    }

    /// Whether a node is one of them.
    #[must_use]
    pub fn contains(&self, node: Node) -> bool {
        self.place(node).is_some()
    }

    pub(super) fn place(&self, node: Node) -> Option<usize> {
        self.nodes.binary_search(&node).ok()
    }
}

/// The derivatives of `outputs` along a direction, by the chain rule from the seeds upwards (Griewank & Walther, ch. 3,
/// forward mode). A seeded node counts as a variable of its own: what it was computed from is not looked at.
pub fn derivatives(graph: &mut Graph, outputs: &[Node], seeds: &Seeds) -> Vec<Node> {
    let below = Below::new(graph, outputs, |node| seeds.contains_key(&node));
    derivatives_among(graph, &below, outputs, seeds)
}

/// The same with all nodes that may depend on the seeds at hand. Of unknowns that are found from conditions, the derivatives are
/// those of the implicit function.
pub fn derivatives_among(graph: &mut Graph, below: &Below, outputs: &[Node], seeds: &Seeds) -> Vec<Node> {
    let zero = graph.constant(0.0);
    let mut found = vec![zero; below.nodes.len() + 1];
    let mut is_seed = vec![false; below.nodes.len()];
    for (node, seed) in seeds {
        if let Some(place) = below.place(*node) {
            (found[place], is_seed[place]) = (*seed, true);
        }
    }
    follow_solved(graph, below, seeds, &mut found, &mut is_seed);
    for (place, node) in below.nodes.iter().enumerate().filter(|(place, _)| !is_seed[*place]) {
        let slopes = below.operands[place].map(|at| found[at as usize]);
        if slopes != [zero; 4] {
            found[place] = one(graph, *node, zero, slopes);
        }
    }
    outputs.iter().map(|node| below.place(*node).map_or(zero, |place| found[place])).collect()
}

/// Which of the nodes that may depend on seeds read each of them.
struct Readers {
    /// By place: where its readers begin; then where the last one's end.
    starts: Vec<u32>,
    /// Places, one node's readers after the other's.
    places: Vec<u32>,
}

impl Readers {
    fn new(below: &Below) -> Self {
        let nowhere = below.nodes.len();
        let reads = || {
            let by_reader = below.operands.iter().zip(0_u32..);
            by_reader.flat_map(|(at, reader)| at.iter().map(move |read| (*read as usize, reader)))
        };
        let mut starts = vec![0; nowhere + 2];
        reads().for_each(|(read, _)| starts[read + 1] += 1);
        starts.truncate(nowhere + 1);
        (0..nowhere).for_each(|place| starts[place + 1] += starts[place]);
        let mut places = vec![0; starts[nowhere] as usize];
        let mut next = starts.clone();
        for (read, reader) in reads().filter(|(read, _)| *read != nowhere) {
            places[next[read] as usize] = reader;
            next[read] += 1;
        }
        Self { starts, places }
    }

    fn of(&self, place: usize) -> &[u32] {
        &self.places[self.starts[place] as usize..self.starts[place + 1] as usize]
    }
}

/// The derivatives of `outputs` along each of the variables alone, one list for each: the same nodes as one call of [`derivatives`] for
/// each makes, by work that grows with what depends on a variable instead of with everything.
pub fn derivatives_along_each(graph: &mut Graph, outputs: &[Node], variables: &[Node]) -> Vec<Vec<Node>> {
    let unit = graph.constant(1.0);
    if !graph.solved.is_empty() {
        let along = |variable: &Node| derivatives(graph, outputs, &Seeds::from_iter([(*variable, unit)]));
        return variables.iter().map(along).collect();
    }
    let zero = graph.constant(0.0);
    if variables.is_empty() {
        return Vec::new();
    }
    let below = Below::new(graph, outputs, |_| false);
    let readers = Readers::new(&below);
    let mut found = vec![zero; below.nodes.len() + 1];
    let mut was_seen = vec![false; below.nodes.len()];
    let mut columns = Vec::with_capacity(variables.len());
    for variable in variables {
        let mut reached = Vec::new();
        let mut open = BinaryHeap::new();
        if let Some(place) = below.place(*variable) {
            found[place] = unit;
            reached.push(place);
            open.extend(readers.of(place).iter().map(|reader| Reverse(*reader)));
        }
        // Operands come before what reads them.
        while let Some(Reverse(reader)) = open.pop() {
            let place = reader as usize;
            if std::mem::replace(&mut was_seen[place], true) {
                continue;
            }
            reached.push(place);
            let slopes = below.operands[place].map(|at| found[at as usize]);
            found[place] = one(graph, below.nodes[place], zero, slopes);
            if found[place] != zero {
                open.extend(readers.of(place).iter().map(|reader| Reverse(*reader)));
            }
        }
        columns.push(outputs.iter().map(|node| below.place(*node).map_or(zero, |place| found[place])).collect());
        for place in reached {
            (found[place], was_seen[place]) = (zero, false);
        }
    }
    columns
}

/// The derivative of a node of whose operands at least one is not constant, from theirs.
fn one(g: &mut Graph, node: Node, zero: Node, d: [Node; 4]) -> Node {
    match g.expr(node) {
        Expr::Constant(_) | Expr::Input(_) | Expr::Call { .. } => zero,
        Expr::Add(..) => g.add(d[0], d[1]),
        Expr::Sub(..) => g.sub(d[0], d[1]),
        Expr::Neg(_) => g.neg(d[0]),
        Expr::Mul(a, b) => {
            let left = g.mul(d[0], b);
            let right = g.mul(a, d[1]);
            g.add(left, right)
        }
        Expr::Div(_, b) => {
            // (a' - (a/b) b') / b, with the quotient already there.
            let shift = g.mul(node, d[1]);
            let top = g.sub(d[0], shift);
            g.div(top, b)
        }
        Expr::Sqrt(_) => {
            let half = g.constant(0.5);
            let top = g.mul(half, d[0]);
            let slope = g.div(top, node);
            zero_where_cut(g, d[0], slope)
        }
        Expr::Sin(a) => {
            let c = g.cos(a);
            g.mul(c, d[0])
        }
        Expr::Cos(a) => {
            let s = g.sin(a);
            let product = g.mul(s, d[0]);
            g.neg(product)
        }
        Expr::Atan2(y, x) => {
            let (p, q) = (g.mul(x, d[0]), g.mul(y, d[1]));
            let top = g.sub(p, q);
            let (xx, yy) = (g.mul(x, x), g.mul(y, y));
            let bottom = g.add(xx, yy);
            g.div(top, bottom)
        }
        Expr::Exp(_) => g.mul(node, d[0]),
        Expr::Ln(a) => g.div(d[0], a),
        Expr::Tanh(_) => {
            let one = g.constant(1.0);
            let square = g.mul(node, node);
            let slope = g.sub(one, square);
            g.mul(slope, d[0])
        }
        Expr::Powi(a, n) => {
            let factor = g.constant(f64::from(n));
            // There is no power below the least one; a library may send it.
            let power = match n.checked_sub(1) {
                Some(below) => g.powi(a, below),
                None => g.div(node, a),
            };
            let slope = g.mul(factor, power);
            g.mul(slope, d[0])
        }
        Expr::Powf(a, bits) => {
            let exponent = f64::from_bits(bits);
            let factor = g.constant(exponent);
            let power = g.powf(a, exponent - 1.0);
            let slope = g.mul(factor, power);
            let slope = g.mul(slope, d[0]);
            if exponent < 1.0 { zero_where_cut(g, d[0], slope) } else { slope }
        }
        Expr::Select(a, b, ..) => g.select(a, b, d[2], d[3]),
        Expr::Table { table, order, at } => {
            let slope = g.table(table, order + 1, at);
            g.mul(slope, d[0])
        }
    }
}

/// How many operations deep choices are looked for.
const DEPTH: usize = 6;

/// A branch that is taken where `a < b`, or where not, and in which a derivative is zero.
type Cut = (Node, Node, bool);

/// Steepness times a derivative, zero wherever the choices in that derivative make it so: the root of `max(x, 0)` does not change where
/// that is zero, though the root is infinitely steep there.
fn zero_where_cut(g: &mut Graph, derivative: Node, slope: Node) -> Node {
    let zero = g.constant(0.0);
    cuts(g, derivative, zero, DEPTH).into_iter().fold(slope, |slope, (a, b, below)| match below {
        true => g.select(a, b, zero, slope),
        false => g.select(a, b, slope, zero),
    })
}

/// The choices that make a derivative zero, as far as so many products and sums show it.
fn cuts(g: &Graph, derivative: Node, zero: Node, depth: usize) -> Vec<Cut> {
    let Some(depth) = depth.checked_sub(1) else { return Vec::new() };
    let cuts = |node| cuts(g, node, zero, depth);
    match g.expr(derivative) {
        Expr::Select(a, b, x, y) if x == zero || y == zero => {
            let mut own = vec![(a, b, x == zero)];
            own.extend(cuts(if x == zero { y } else { x }));
            own
        }
        Expr::Mul(x, y) => [cuts(x), cuts(y)].concat(),
        Expr::Neg(x) | Expr::Div(x, _) => cuts(x),
        Expr::Add(x, y) | Expr::Sub(x, y) => {
            let others = cuts(y);
            cuts(x).into_iter().filter(|cut| others.contains(cut)).collect()
        }
        _ => Vec::new(),
    }
}
