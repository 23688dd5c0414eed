//! From an element's recording to nodes of the scene's graph.

use element_api::recording::{Input, Op};
use element_api::{Outside, Recording, Table};

use super::graph::{Graph, Node};

/// An operation of a checked recording other than an input, as a node. `at` gives the nodes of earlier operations;
/// `first_table` is where the recording's tables begin in the graph.
///
/// # Panics
/// For an input: only the caller knows what it stands for.
pub fn operation(graph: &mut Graph, recording: &Recording, op: Op, first_table: u32, at: impl Fn(u32) -> Node) -> Node {
    match op {
        Op::Constant(k) => graph.constant(recording.constants[k as usize]),
        Op::Input(which) => unreachable!("{which:?} is provided by the caller"),
        Op::Add(a, b) => graph.add(at(a), at(b)),
        Op::Sub(a, b) => graph.sub(at(a), at(b)),
        Op::Mul(a, b) => graph.mul(at(a), at(b)),
        Op::Div(a, b) => graph.div(at(a), at(b)),
        Op::Neg(a) => graph.neg(at(a)),
        Op::Sqrt(a) => graph.sqrt(at(a)),
        Op::Sin(a) => graph.sin(at(a)),
        Op::Cos(a) => graph.cos(at(a)),
        Op::Atan2(a, b) => graph.atan2(at(a), at(b)),
        Op::Exp(a) => graph.exp(at(a)),
        Op::Ln(a) => graph.ln(at(a)),
        Op::Tanh(a) => graph.tanh(at(a)),
        Op::Powi(a, n) => graph.powi(at(a), n),
        Op::Powf(a, k) => graph.powf(at(a), recording.constants[k as usize]),
        Op::Select(a, b, x, y) => graph.select(at(a), at(b), at(x), at(y)),
        Op::Table(table, a) => lookup(graph, first_table + table, at(a)),
    }
}

/// Jumps of a table that are written as choices; one with more is looked up, since all choices are made in every evaluation.
const MOST_CHOICES: usize = 32;

/// A table at a node. Where its value jumps, it becomes a choice by `select` between continuous parts, so that the jump is a
/// switch like any other. A periodic table has no last jump and stays whole, as does one with very many.
fn lookup(graph: &mut Graph, table: u32, at: Node) -> Node {
    let whole = &graph.tables[table as usize];
    let jumps: Vec<f64> = match whole.outside {
        Outside::Clamped => whole.kinks().filter(|(_, order)| *order == 0).map(|(x, _)| x).collect(),
        Outside::Periodic => Vec::new(),
    };
    if jumps.is_empty() || jumps.len() > MOST_CHOICES || graph.value(at).is_some() {
        return graph.table(table, 0, at);
    }
    let places = jumps.iter().filter_map(|x| whole.breaks.iter().position(|b| b == x));
    let bounds: Vec<usize> = std::iter::once(0).chain(places).chain([whole.pieces.len()]).collect();
    let parts: Vec<Table> = bounds
        .windows(2)
        .map(|w| Table {
            breaks: whole.breaks[w[0]..=w[1]].to_vec(),
            pieces: whole.pieces[w[0]..w[1]].to_vec(),
            outside: Outside::Clamped,
        })
        .collect();
    let parts: Vec<Node> = parts
        .into_iter()
        .map(|part| match part.pieces.as_slice() {
            [[value, 0.0, 0.0, 0.0]] => graph.constant(*value),
            _ => {
                graph.tables.push(part);
                graph.table(graph.tables.len() as u32 - 1, 0, at)
            }
        })
        .collect();
    choice(graph, at, &jumps, &parts)
}

/// The part that holds at a node: number k up to `jumps[k]`, the last one from the last jump on.
fn choice(graph: &mut Graph, at: Node, jumps: &[f64], parts: &[Node]) -> Node {
    if jumps.is_empty() {
        return parts[0];
    }
    let middle = jumps.len() / 2;
    let below = choice(graph, at, &jumps[..middle], &parts[..=middle]);
    let above = choice(graph, at, &jumps[middle + 1..], &parts[middle + 1..]);
    let jump = graph.constant(jumps[middle]);
    graph.select(at, jump, below, above)
}

/// Writes the operations of a checked recording into the graph and gives the node of each.
///
/// `input` provides what the element asks for.
///
/// # Panics
/// When the recording was not checked ([`Recording::check`]).
pub fn import(graph: &mut Graph, recording: &Recording, mut input: impl FnMut(&mut Graph, Input) -> Node) -> Vec<Node> {
    let first_table = graph.tables.len() as u32;
    graph.tables.extend(recording.tables.iter().cloned());
    let mut nodes: Vec<Node> = Vec::with_capacity(recording.ops.len());
    for raw in &recording.ops {
        let op = Op::decode(*raw).expect("recordings are checked when the model is built");
        let node = match op {
            Op::Input(which) => input(graph, which),
            other => operation(graph, recording, other, first_table, |k| nodes[k as usize]),
        };
        nodes.push(node);
    }
    nodes
}
