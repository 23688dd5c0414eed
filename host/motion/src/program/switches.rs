//! [`Switches`]: where the equations of motion switch from one expression to another.
//!
//! An equation depends on the motion other than smoothly only through `select` (abs, min and max are made of it), so that
//! the conditions a < b of all selects tell when that happens. Jumps of tables are selects by then; corners are not among
//! them.

use odyn_graph::{Expr, Graph, Node};
use rustc_hash::FxHashSet;

use super::equations::Equations;
use crate::plan::Layout;

/// See the module documentation.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Switches {
    /// Both sides of each condition a < b that can change during a step, in the order of the graph; none twice.
    pub conditions: Vec<(Node, Node)>,
}

impl Switches {
    /// Looks for the switches that accelerations and rates of states depend on.
    #[must_use]
    pub fn find(equations: &Equations, layout: &Layout) -> Self {
        let graph = &equations.graph;
        if !has_selects(graph) {
            return Self::default();
        }
        let mut roots = equations.loads.clone();
        roots.extend(&equations.state_rates);
        roots.extend(equations.releases.iter().map(|one| one.value));
        roots.extend(equations.latch_conditions().flat_map(|(a, b)| [a, b]));
        roots.extend(equations.rows.iter().map(|row| row.gamma));
        Self { conditions: conditions(graph, &graph.live(&roots), &moving(graph, layout)) }
    }

    /// The elements of the model whose loads or rates depend on such conditions, each with the number of these.
    #[must_use]
    pub fn by_element(equations: &Equations, layout: &Layout) -> Vec<(usize, usize)> {
        let graph = &equations.graph;
        if !has_selects(graph) {
            return Vec::new();
        }
        let moving = moving(graph, layout);
        let mut found = Vec::new();
        for (index, element) in equations.elements.iter().enumerate() {
            let mut own: Vec<Node> =
                element.loads.iter().flat_map(|load| load.force.into_iter().chain(load.torque)).collect();
            let end = layout.state_at.get(index + 1).copied().unwrap_or(layout.states);
            own.extend(&equations.state_rates[layout.state_at[index]..end]);
            let rows = layout.rows_of(index);
            own.extend(equations.frictions.iter().filter(|one| rows.contains(&one.rows[0])).map(|one| one.limit));
            let count = conditions(graph, &graph.ancestors(&own, |_| false), &moving).len();
            if count > 0 {
                found.push((index, count));
            }
        }
        found
    }
}

fn has_selects(graph: &Graph) -> bool {
    graph.nodes().any(|node| matches!(graph.expr(node), Expr::Select(..)))
}

/// Whether each node can change during a step: what depends on nothing but angle references and discrete states cannot.
fn moving(graph: &Graph, layout: &Layout) -> Vec<bool> {
    let still = layout.reference_slot()..layout.acceleration_slot();
    let mut moving: Vec<bool> = Vec::with_capacity(graph.len());
    for node in graph.nodes() {
        let moves = match graph.expr(node) {
            Expr::Input(slot) => !still.contains(&(slot as usize)),
            _ => {
                let mut moves = false;
                graph.operands(node, |operand| moves |= moving[operand.0 as usize]);
                moves
            }
        };
        moving.push(moves);
    }
    moving
}

/// The conditions among nodes that are given in ascending order; a < b and b < a are one.
fn conditions(graph: &Graph, nodes: &[Node], moving: &[bool]) -> Vec<(Node, Node)> {
    let mut known = FxHashSet::default();
    let mut found = Vec::new();
    for node in nodes {
        let Expr::Select(a, b, ..) = graph.expr(*node) else { continue };
        let moves = moving[a.0 as usize] || moving[b.0 as usize];
        if moves && known.insert((a.min(b), a.max(b))) {
            found.push((a, b));
        }
    }
    found
}
