//! [`Structures`]: what is found out once for all variants of a scene.
//!
//! Variants differ in numbers, mostly. How a part of a graph becomes a program depends on its operations and on which of its nodes
//! are constants, not on what these are: where all nodes that the outputs depend on are the same operations, the program is one
//! that is known, with other constants. That is looked at node by node, each time; whatever differs is compiled as ever.

use std::cell::RefCell;
use std::hash::BuildHasher;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rustc_hash::{FxBuildHasher, FxHashMap};

use super::graph::{Expr, Graph, Node};
use super::tape::Program;

/// Nodes of all structures beyond which no others are kept, 24 bytes each.
const MOST_NODES: usize = 1_000_000;

/// Programs by the structure of what they were compiled from. Copies share what they hold. Results do not depend on it.
#[derive(Debug, Clone, Default)]
pub struct Structures(Arc<Mutex<Kept>>);

#[derive(Debug, Default)]
struct Kept {
    /// By the hash of their outputs.
    known: FxHashMap<u64, Vec<Arc<Known>>>,
    nodes: usize,
    /// How often a program was known.
    found: u64,
}

/// A structure, with a program that has it.
#[derive(Debug)]
struct Known {
    outputs: Vec<Node>,
    /// All that the outputs depend on, ascending.
    live: Vec<(Node, Expr)>,
    program: Program,
}

thread_local! {
    /// What the work of this thread has in common with others.
    static CURRENT: RefCell<Option<Structures>> = const { RefCell::new(None) };
}

impl Structures {
    /// Does the work of a variant, in which programs of known structures are not compiled again, on this thread.
    pub fn during<T>(&self, work: impl FnOnce() -> T) -> T {
        let before = CURRENT.replace(Some(self.clone()));
        // Also where the work panics.
        let _back = Back(before);
        work()
    }

    /// How often a program was known, so far.
    #[must_use]
    pub fn found(&self) -> u64 {
        self.kept().found
    }

    /// Nodes that are kept, of all structures.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.kept().nodes
    }

    /// The program of these outputs, which is `compiled` where their structure is not known.
    fn program(&self, graph: &Graph, outputs: &[Node], compiled: impl FnOnce() -> Program) -> Program {
        let key = FxBuildHasher.hash_one(outputs);
        let candidates = self.kept().known.get(&key).cloned().unwrap_or_default();
        if let Some(known) = candidates.iter().find(|known| known.fits(graph, outputs)) {
            self.kept().found += 1;
            return known.with_constants_of(graph);
        }
        let program = compiled();
        let live: Vec<(Node, Expr)> = graph.live(outputs).into_iter().map(|node| (node, graph.expr(node))).collect();
        let mut kept = self.kept();
        // What opaque elements are asked for is described outside of the nodes.
        let is_plain = !live.iter().any(|(_, expr)| matches!(expr, Expr::Call { .. }));
        if is_plain && kept.nodes + live.len() <= MOST_NODES {
            kept.nodes += live.len();
            let known = Known { outputs: outputs.to_vec(), live, program: program.clone() };
            kept.known.entry(key).or_default().push(Arc::new(known));
        }
        program
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Known {
    /// Whether the outputs are the same operations of the same nodes, whatever the constants. Then they depend on the same nodes.
    fn fits(&self, graph: &Graph, outputs: &[Node]) -> bool {
        let last = self.live.last().map_or(0, |(node, _)| node.0 as usize);
        let alike = |(node, known): &(Node, Expr)| match (graph.expr(*node), known) {
            (Expr::Constant(_), Expr::Constant(_)) => true,
            (expr, known) => expr == *known,
        };
        self.outputs == outputs && last < graph.len() && self.live.iter().all(alike)
    }

    /// The program with the constants, and the tables, of another graph.
    fn with_constants_of(&self, graph: &Graph) -> Program {
        // Constants lie in the order of their nodes.
        let constants = self.live.iter().filter_map(|(node, _)| graph.value(*node)).collect();
        self.program.with_numbers(constants, graph.tables.clone())
    }
}

/// Puts back what was current before.
struct Back(Option<Structures>);

impl Drop for Back {
    fn drop(&mut self) {
        CURRENT.replace(self.0.take());
    }
}

/// The program of these outputs: a known one with other constants, or `compiled`.
pub(super) fn program(graph: &Graph, outputs: &[Node], compiled: impl FnOnce() -> Program) -> Program {
    match CURRENT.with_borrow(Clone::clone) {
        Some(structures) => structures.program(graph, outputs, compiled),
        None => compiled(),
    }
}
