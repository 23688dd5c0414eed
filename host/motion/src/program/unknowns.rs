//! Internal unknowns of elements: nodes that their conditions are solved for, and the rates of the values that are carried.
//!
//! The value of an unknown y is carried as a state with the rate y' = -g_y^-1 dg/dt, so that an integrator keeps its order; what
//! rows and loads take is that value after Newton steps on g(y) = 0 ([`Graph::solve`]), which is exact whatever the error of the
//! carried one, and its derivatives are those of the implicit function.

use element_api::Recording;
use element_api::recording::{Input, Op, Role};
use odyn_graph::{Expr, Graph, Node, Rewriting, derivatives, operation};
use rustc_hash::FxHashMap;

use super::equations::{Equations, own_input};
use super::kinematics::FrameNodes;
use crate::model::{Instance, conditions, operations_behind};
use crate::plan::Layout;

/// The operations that the conditions on unknowns are made of, ascending.
fn operations(recording: &Recording) -> Vec<(u32, Op)> {
    operations_behind(recording, conditions(recording))
}

/// What the conditions on unknowns take besides these.
pub(super) fn inputs_of_conditions(recording: &Recording) -> Vec<Input> {
    let inputs = operations(recording).into_iter().filter_map(|(_, op)| match op {
        Op::Input(Input::Unknown(_)) => None,
        Op::Input(input) => Some(input),
        _ => None,
    });
    inputs.collect()
}

/// Writes down the unknowns of a recording, whose values are carried from a slot on.
pub(super) fn add(
    graph: &mut Graph,
    recording: &Recording,
    slot: usize,
    first_table: u32,
    given: &FxHashMap<Input, Node>,
) {
    let list = operations(recording);
    let count = recording.unknowns();
    graph.solve(slot, count, |g, unknowns| {
        let mut nodes: FxHashMap<u32, Node> = FxHashMap::default();
        for (k, op) in &list {
            let node = match op {
                Op::Input(Input::Unknown(unknown)) => unknowns[*unknown as usize],
                Op::Input(input) => given[input],
                other => operation(g, recording, *other, first_table, |k| nodes[&k]),
            };
            nodes.insert(*k, node);
        }
        let condition = |k: usize| recording.output(Role::Condition(k as u32)).expect("as many as unknowns");
        (0..count).map(|k| nodes[&condition(k)]).collect()
    });
}

impl Equations {
    /// Writes down the unknowns of a joint.
    pub(super) fn add_unknowns_of_joint(
        &mut self,
        index: usize,
        element: &Instance,
        frames: &[FrameNodes],
        layout: &Layout,
    ) {
        let recording = &element.recording;
        if recording.unknowns() == 0 {
            return;
        }
        let first_table = self.graph.tables.len() as u32;
        self.graph.tables.extend(recording.tables.iter().cloned());
        let inputs = inputs_of_conditions(recording).into_iter();
        let given = inputs.map(|input| (input, own_input(&mut self.graph, input, index, frames, layout))).collect();
        add(&mut self.graph, recording, layout.state_slot() + layout.unknown_at[index], first_table, &given);
    }

    /// The rates of all carried values, along the motion with the accelerations that are solved for.
    pub(super) fn add_rates_of_unknowns(&mut self, layout: &Layout) {
        if self.graph.solved.is_empty() {
            return;
        }
        let bodies: Vec<usize> = (0..self.bodies.len()).collect();
        let mut seeds = self.motion_seeds(&bodies);
        for (b, body) in self.bodies.iter().enumerate() {
            let slot = layout.acceleration_slot() + 6 * b;
            for (k, velocity) in body.v.into_iter().chain(body.w).enumerate() {
                seeds.insert(velocity, self.graph.input(slot + k));
            }
        }
        let first = layout.state_slot();
        let carried: Vec<(usize, Node)> = self.unknowns(layout).collect();
        for (state, rate) in self.state_rates.iter().enumerate() {
            if carried.iter().all(|(other, _)| *other != state) {
                seeds.insert(self.graph.input(first + state), *rate);
            }
        }
        let nodes: Vec<Node> = carried.iter().map(|(_, node)| *node).collect();
        let rates = derivatives(&mut self.graph, &nodes, &seeds);
        for ((state, _), rate) in carried.into_iter().zip(rates) {
            self.state_rates[state] = rate;
        }
    }

    /// All unknowns, each with the number of the state that carries its value.
    fn unknowns(&self, layout: &Layout) -> impl Iterator<Item = (usize, Node)> + '_ {
        let first = layout.state_slot();
        let each = self.graph.solved.iter();
        each.flat_map(move |solved| solved.unknowns.iter().enumerate().map(move |(k, y)| (solved.slot - first + k, *y)))
    }

    /// Nodes with the carried values of unknowns in their place: shorter, with narrower ranges, and off by the error of a step.
    #[must_use]
    pub fn of_carried(&mut self, nodes: &[Node]) -> Vec<Node> {
        if self.graph.solved.is_empty() {
            return nodes.to_vec();
        }
        let mut replaced = FxHashMap::default();
        for solved in self.graph.solved.clone() {
            for (k, unknown) in solved.unknowns.into_iter().enumerate() {
                replaced.insert(unknown, self.graph.input(solved.slot + k));
            }
        }
        let whole = self.graph.clone();
        Rewriting::new(&whole, &mut self.graph, replaced).carry_all(&mut self.graph, nodes)
    }

    /// The first element with conditions on unknowns that depend on accelerations or reactions, by way of a signal.
    #[must_use]
    pub fn unknowns_of_solution(&self, layout: &Layout) -> Option<usize> {
        let solved = layout.acceleration_slot()..layout.inputs();
        let found = self.graph.solved.iter().find(|unknowns| {
            self.graph.live(&unknowns.conditions).into_iter().any(|node| match self.graph.expr(node) {
                Expr::Input(slot) => solved.contains(&(slot as usize)),
                _ => false,
            })
        });
        found.map(|unknowns| layout.element_of_state(unknowns.slot - layout.state_slot()))
    }
}
