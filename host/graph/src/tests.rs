//! The graph simplifies without changing values; derivatives are exact; programs compute what the graph says, however they
//! are run.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message

#[path = "../../testing/random.rs"]
mod random;

mod condense;
mod derivatives;
mod eliminate;
mod graph;
#[cfg(feature = "jit")]
mod machine;
mod magnitudes;
mod ranges;
mod series;
#[cfg(feature = "jit")]
mod shared;
mod solved;
mod structures;
mod tangents;
mod tape;
mod turn;
#[cfg(feature = "jit")]
mod wired;

use super::*;
use random::Random;

/// The numbers of some nodes of a graph without opaque calls.
fn values(graph: &Graph, nodes: &[Node], inputs: &[f64]) -> Vec<f64> {
    let program = Program::compile(graph, nodes);
    let mut found = vec![f64::NAN; nodes.len()];
    program.run(inputs, &[], &mut program.workspace(), &mut found).unwrap();
    found
}

/// The number of one node.
fn value(graph: &Graph, node: Node, inputs: &[f64]) -> f64 {
    values(graph, &[node], inputs)[0]
}
