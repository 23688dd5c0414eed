//! From an element's recording to nodes of the scene's graph.

use element_api::Recording;
use element_api::recording::{Input, Op};

use super::graph::{Graph, Node};

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
        let at = |k: u32| nodes[k as usize];
        let node = match op {
            Op::Constant(k) => graph.constant(recording.constants[k as usize]),
            Op::Input(which) => input(graph, which),
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
            Op::Table(table, a) => graph.table(first_table + table, 0, at(a)),
        };
        nodes.push(node);
    }
    nodes
}
