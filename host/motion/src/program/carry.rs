//! Quantities of the working form as functions of the coordinates of joints, without the bodies in between.

use odyn_graph::{Expr, Graph, Node, Rewriting};
use rustc_hash::FxHashMap;

use super::equations::Equations;
use super::joint::JointEquations;
use super::kinematics::{BodyNodes, entries};
use crate::plan::Layout;

/// Nodes from which on room is made for what is carried over.
const LARGE: usize = 100_000;

impl JointEquations {
    /// Whether the equations depend on what the coordinates of joints do not tell of bodies: on Euler parameters.
    #[must_use]
    pub fn take_parameters(&self, layout: &Layout) -> bool {
        let mut nodes = [&self.body_loads[..], &self.state_rates].concat();
        nodes.push(self.power);
        for row in &self.rows {
            nodes.extend([row.value, row.time, row.gamma]);
            nodes.extend(row.jacobian.iter().map(|(_, slope)| *slope));
        }
        let of_bodies = 1..layout.state_slot();
        let inputs = self.graph.live(&nodes).into_iter().filter_map(|node| match self.graph.expr(node) {
            Expr::Input(slot) => Some(slot as usize),
            _ => None,
        });
        inputs.into_iter().any(|slot| of_bodies.contains(&slot))
    }

    /// An empty graph; for large scenes with room for positions, rotations and velocities of the bodies.
    pub(super) fn room_for_bodies(&self) -> Graph {
        if self.graph.len() < LARGE {
            return Graph::default();
        }
        let of = |body: &BodyNodes| body.r.into_iter().chain(entries(&body.a)).chain(body.v).chain(body.w);
        let nodes: Vec<Node> = self.bodies.iter().flat_map(of).collect();
        Graph::with_room(self.graph.live(&nodes).len())
    }

    /// Nodes of the working form in a graph of their own, which takes the inputs of this form. `None` where one of them
    /// depends on more than positions, rotation matrices and velocities of bodies: on Euler parameters, accelerations or
    /// multipliers, or on an opaque element.
    #[must_use]
    pub fn carry(&self, working: &Equations, layout: &Layout, nodes: &[Node]) -> Option<(Graph, Vec<Node>)> {
        if nodes.is_empty() {
            return Some((Graph::default(), Vec::new()));
        }
        let mut g = self.room_for_bodies();
        let mut own = Rewriting::new(&self.graph, &mut g, FxHashMap::default());
        let replaced = carried_bodies(&mut g, &mut own, working, self);
        let mut rewriting = Rewriting::new(&working.graph, &mut g, replaced);
        let carried = rewriting.carry_all(&mut g, nodes);
        let bodies = 1..layout.state_slot();
        let solved = layout.acceleration_slot()..layout.inputs();
        let foreign = |slot: usize| {
            bodies.contains(&slot) || solved.contains(&slot) || slot >= self.coordinates.acceleration_slot
        };
        (!is_open(&g, &carried, foreign)).then_some((g, carried))
    }
}

/// Whether nodes depend on inputs that are foreign to the coordinates of joints, or on an opaque element.
pub(super) fn is_open(g: &Graph, nodes: &[Node], foreign: impl Fn(usize) -> bool) -> bool {
    g.live(nodes).into_iter().any(|node| match g.expr(node) {
        Expr::Input(slot) => foreign(slot as usize),
        Expr::Call { .. } => true,
        _ => false,
    })
}

/// What stands for positions, rotation matrices and velocities of the bodies; `own` carries the nodes of `joint`.
pub(super) fn carried_bodies(
    g: &mut Graph,
    own: &mut Rewriting<'_>,
    working: &Equations,
    joint: &JointEquations,
) -> FxHashMap<Node, Node> {
    let mut replaced: FxHashMap<Node, Node> = FxHashMap::default();
    for (body, here) in working.bodies.iter().zip(&joint.bodies) {
        for (old, node) in entries(&body.a).zip(entries(&here.a)) {
            replaced.insert(old, own.carry(g, node));
        }
        for (old, new) in [(body.r, here.r), (body.v, here.v), (body.w, here.w)] {
            for (old, node) in old.into_iter().zip(new) {
                replaced.insert(old, own.carry(g, node));
            }
        }
    }
    replaced
}
