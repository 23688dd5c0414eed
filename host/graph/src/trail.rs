//! [`Trail`]: graphs of variants are written along those of the first one.
//!
//! Variants of one scene write the same operations in the same order, mostly, with other constants. Where each is in the graph was found
//! out when the first variant was written, and is looked up, not found again, as long as what is written is what was written then. It
//! is looked at step by step: an operation has to be the same operation of the same nodes; a constant has to be one that is
//! new, or that is there already at the same node, as it was then. From the first step on that differs, a graph is written as ever.
//! So a graph is what it would be without this, node by node.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rustc_hash::FxHashMap;

use super::graph::{Expr, Node};
use super::structures::Structures;

/// What was written in a graph, and where that is in it.
#[derive(Debug)]
pub(super) struct Steps {
    /// Tells them from all others, also those of another variant's graph of the same number.
    id: u64,
    /// The graph that it began as a copy of, and after how many steps of that.
    origin: Option<Place>,
    list: Vec<(Expr, Node)>,
}

impl Steps {
    /// None yet.
    fn from(origin: Option<Place>) -> Self {
        static STEPS: AtomicU64 = AtomicU64::new(0);
        Self { id: STEPS.fetch_add(1, Ordering::Relaxed), origin, list: Vec::new() }
    }

    pub(super) fn len(&self) -> usize {
        self.list.len()
    }
}

/// Steps, by their id, and how many of them there were when a copy was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place {
    id: u64,
    steps: usize,
}

/// How a graph is written: see the module documentation.
#[derive(Debug, Default)]
pub(super) enum Trail {
    /// By itself.
    #[default]
    None,
    /// As the first of its number: what is written is kept for others.
    First { number: usize, steps: Steps, kept: Structures },
    /// Along the first.
    Along { steps: Arc<Steps>, at: usize, constants: FxHashMap<u64, Node> },
}

impl Trail {
    /// That of an empty graph.
    pub(super) fn of_empty() -> Self {
        Self::begin(None, Some(FxHashMap::default()))
    }

    /// That of a copy of the graph that this is the trail of.
    pub(super) fn of_copy(&self) -> Self {
        match self {
            Self::None => Self::None,
            Self::First { steps, .. } => Self::begin(Some(Place { id: steps.id, steps: steps.len() }), None),
            Self::Along { steps, at, constants } => {
                Self::begin(Some(Place { id: steps.id, steps: *at }), Some(constants.clone()))
            }
        }
    }

    /// `constants` are those of a graph whose nodes so far are known to be those of the first.
    fn begin(origin: Option<Place>, constants: Option<FxHashMap<u64, Node>>) -> Self {
        let Some((number, kept, steps)) = Structures::next_graph() else { return Self::None };
        match (steps, constants) {
            (Some(steps), Some(constants)) if steps.origin == origin => Self::Along { steps, at: 0, constants },
            (Some(_), _) => Self::None,
            (None, _) => Self::First { number, steps: Steps::from(origin), kept },
        }
    }

    /// Whether the graph is written along another one.
    pub(super) fn is_along(&self) -> bool {
        matches!(self, Self::Along { .. })
    }

    /// Where an expression is, of which the graph has so far `exprs`, by node; `None` from where on it is to be found out.
    #[inline]
    pub(super) fn follow(&mut self, expr: &Expr, end: usize, existing: impl Fn(Node) -> Expr) -> Option<Node> {
        let Self::Along { steps, at, constants, .. } = self else { return None };
        let found = match (steps.list.get(*at), expr) {
            (Some((Expr::Constant(_), node)), Expr::Constant(bits)) => {
                let is_new = node.0 as usize == end;
                let fits = if is_new { !constants.contains_key(bits) } else { existing(*node) == *expr };
                if is_new && fits {
                    constants.insert(*bits, *node);
                }
                fits.then_some(*node)
            }
            (Some((known, node)), expr) => (known == expr).then_some(*node),
            (None, _) => None,
        };
        match found {
            Some(node) => {
                *at += 1;
                Some(node)
            }
            None => {
                *self = Self::None;
                None
            }
        }
    }

    /// Keeps where an expression was found to be, if this is kept for others.
    #[inline]
    pub(super) fn note(&mut self, expr: Expr, node: Node) {
        if let Self::First { steps, .. } = self {
            steps.list.push((expr, node));
        }
    }
}

impl Drop for Trail {
    fn drop(&mut self) {
        if let Self::First { number, steps, kept } = self {
            let list = std::mem::take(&mut steps.list);
            kept.keep_steps(*number, Steps { list, ..*steps });
        }
    }
}
