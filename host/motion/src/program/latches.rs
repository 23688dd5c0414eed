//! [`Latch`]: memories of elements that jump at instants: relays, counters of events, forces that let go.
//!
//! A discrete state that changes between steps is a switch where its next value is made, by `select`, of what stays as it is during a
//! step: then it is as it was until one of the conditions changes, and steps can end there. One that follows what moves (the largest
//! value so far) has no such instant, and changes after every accepted step.

use std::sync::Arc;

use element_api::recorded::{Recorded, input, record};
use element_api::recording::{Input, Op, Role};
use element_api::{Recording, Scalar};
use odyn_graph::{Expr, Graph, Node, operation};

use super::equations::Equations;
use crate::model::{Instance, Model};
use crate::plan::Layout;

/// The memory of an element that has such states, as a function of what they take, with the conditions decided by the caller.
#[derive(Debug, Clone)]
pub struct Latch {
    /// Which element.
    pub element: usize,
    /// The first of its states among all discrete ones.
    pub first: usize,
    /// Which of its states jump at instants; the others change after every accepted step, and at these.
    pub switches: Vec<bool>,
    /// Both sides of each condition a < b.
    pub conditions: Vec<(Node, Node)>,
    /// Whether a condition can change during a step.
    pub moves: Vec<bool>,
    /// Whether it is what decides on the release of a force: its state is one until then, and zero behind it.
    pub releases: bool,
    /// What it takes.
    pub inputs: Vec<Node>,
    /// A graph of its own, whose inputs are these and then, for each condition, a negative number where it is taken to hold; gives both
    /// sides of all conditions, those inside of others as the caller has them, then the next states.
    pub own: Arc<(Graph, Vec<Node>)>,
}

/// What is written down of an element's next states while they are imported.
struct Writing<'a> {
    recording: &'a Recording,
    /// The node of each operation, where there is one.
    nodes: &'a [Option<Node>],
    graph: &'a Graph,
    layout: &'a Layout,
}

impl Writing<'_> {
    fn op(&self, k: u32) -> Op {
        Op::decode(self.recording.ops[k as usize]).expect("recordings are checked when the model is built")
    }

    fn moves(&self, k: u32) -> bool {
        self.nodes[k as usize].is_none_or(|node| moves(self.graph, node, self.layout))
    }

    /// The operations that some of them need, themselves included, ascending.
    fn cone(&self, results: &[u32]) -> Vec<u32> {
        let mut wanted = vec![false; self.recording.ops.len()];
        let mut open = results.to_vec();
        while let Some(k) = open.pop() {
            if !std::mem::replace(&mut wanted[k as usize], true) {
                open.extend(self.op(k).operands());
            }
        }
        (0..wanted.len() as u32).filter(|k| wanted[*k as usize]).collect()
    }

    /// Which of the results jump by conditions and are else as they were.
    fn switches(&self, results: &[u32]) -> Vec<bool> {
        // Whether each operation moves within a step in another way than by jumps, whether it depends on conditions, and whether it
        // depends on more than the element's own memory.
        let [mut follows, mut jumps, mut foreign] = [(); 3].map(|()| vec![false; self.recording.ops.len()]);
        for k in self.cone(results) {
            let op = self.op(k);
            let among = |list: &[bool]| op.operands().any(|k| list[k as usize]);
            let (follow, jump) = match op {
                Op::Input(_) => (self.moves(k), false),
                Op::Select(a, b, x, y) => {
                    let of_others = foreign[a as usize] || foreign[b as usize];
                    (follows[x as usize] || follows[y as usize], of_others || among(&jumps))
                }
                _ => (among(&follows), among(&jumps)),
            };
            let takes = matches!(op, Op::Input(input) if !matches!(input, Input::Discrete(_))) || among(&foreign);
            (follows[k as usize], jumps[k as usize], foreign[k as usize]) = (follow, jump, takes);
        }
        results.iter().map(|k| jumps[*k as usize] && !follows[*k as usize]).collect()
    }

    /// The latch of an element; `None` where none of its states jumps at instants.
    fn latch(&self, element: usize, first: usize, states: usize) -> Option<Latch> {
        let results = (0..states as u32).map(|k| self.recording.output(Role::NextDiscrete(k)));
        let results: Vec<u32> = results.collect::<Option<_>>()?;
        let switches = self.switches(&results);
        let jumping: Vec<u32> = results.iter().zip(&switches).filter(|(_, jumps)| **jumps).map(|(k, _)| *k).collect();
        let sides = |a: u32, b: u32| Some((self.nodes[a as usize]?, self.nodes[b as usize]?));
        // The same condition may be written down several times. One that nothing jumps by is no matter of an instant.
        let (mut conditions, mut moves) = (Vec::new(), Vec::new());
        for k in self.cone(&jumping) {
            let Op::Select(a, b, ..) = self.op(k) else { continue };
            if !conditions.contains(&sides(a, b)?) {
                conditions.push(sides(a, b)?);
                moves.push(self.moves(a) || self.moves(b));
            }
        }
        let listed = self.cone(&results);
        let count = listed.iter().filter(|k| matches!(self.op(**k), Op::Input(_))).count();
        let (mut inputs, mut g) = (Vec::new(), Graph::default());
        g.tables.extend(self.recording.tables.iter().cloned());
        let zero = g.constant(0.0);
        let (mut own, mut outputs) = (vec![zero; self.recording.ops.len()], vec![zero; 2 * conditions.len()]);
        for k in listed {
            own[k as usize] = match self.op(k) {
                Op::Input(_) => {
                    inputs.push(self.nodes[k as usize]?);
                    g.input(inputs.len() - 1)
                }
                Op::Select(a, b, x, y) => {
                    let of = |k: u32| own[k as usize];
                    match conditions.iter().position(|known| Some(*known) == sides(a, b)) {
                        Some(number) => {
                            outputs[2 * number..2 * number + 2].copy_from_slice(&[of(a), of(b)]);
                            let decided = g.input(count + number);
                            g.select(decided, zero, of(x), of(y))
                        }
                        None => g.select(of(a), of(b), of(x), of(y)),
                    }
                }
                other => operation(&mut g, self.recording, other, 0, |k| own[k as usize]),
            };
        }
        outputs.extend(results.iter().map(|k| own[*k as usize]));
        let own = Arc::new((g, outputs));
        (!jumping.is_empty()).then_some(Latch {
            element,
            first,
            switches,
            conditions,
            moves,
            releases: false,
            inputs,
            own,
        })
    }
}

/// Whether a node can change during a step.
fn moves(graph: &Graph, node: Node, layout: &Layout) -> bool {
    let still = layout.reference_slot()..layout.acceleration_slot();
    graph.ancestors(&[node], |_| false).into_iter().any(|below| match graph.expr(below) {
        Expr::Input(slot) => !still.contains(&(slot as usize)),
        Expr::Call { .. } => true,
        _ => false,
    })
}

impl Equations {
    /// Takes note of an element's memory, the nodes of whose operations are given, if it jumps at instants.
    pub(super) fn add_latch(&mut self, element: usize, instance: &Instance, nodes: &[Option<Node>], layout: &Layout) {
        let recording = &instance.recording;
        if recording.initial_discrete.is_empty() || recording.sample_period().is_some() || instance.class.opaque {
            return;
        }
        let writing = Writing { recording, nodes, graph: &self.graph, layout };
        let latch = writing.latch(element, layout.discrete_at[element], recording.initial_discrete.len());
        self.latches.extend(latch);
    }

    /// Whether a force element still acts: a number that is one until it lets go, and zero behind that; `None` where it never does.
    pub(super) fn acts(&mut self, element: usize, model: &Model, layout: &Layout) -> Option<Node> {
        let slot = layout.acts_at(element, model)?;
        Some(self.graph.input(layout.discrete_slot() + slot))
    }

    /// A value of a force element as long as it acts, and zero behind that.
    pub(super) fn while_it_acts(&mut self, value: Node, acts: Option<Node>) -> Node {
        self.choose_while_it_acts(value, 0.0, acts)
    }

    /// The same, and another number behind that.
    pub(super) fn choose_while_it_acts(&mut self, value: Node, behind: f64, acts: Option<Node>) -> Node {
        let Some(acts) = acts else { return value };
        let (half, behind) = (self.graph.constant(0.5), self.graph.constant(behind));
        self.graph.select(half, acts, value, behind)
    }

    /// What decides on the releases of forces, once everything is written.
    pub(super) fn add_releases_of_forces(&mut self, model: &Model, layout: &Layout) {
        for (element, instance) in model.elements.iter().enumerate() {
            let (Some(release), Some(first)) = (&instance.release, layout.acts_at(element, model)) else { continue };
            let value = match &release.quantity {
                Some(quantity) => self.observe(quantity, model, layout),
                None => self.graph.input(Layout::TIME),
            };
            let recording = record(|| {
                let (value, acts) = (input(Input::Signal(0)), input(Input::Discrete(0)));
                let gone = Recorded::Constant(0.0);
                if let (None, Some(at)) = (&release.quantity, release.above) {
                    // At that time already.
                    return vec![(Role::NextDiscrete(0), Scalar::select(value, at.into(), acts, gone))];
                }
                let below = release.below.map_or(acts, |bound| Scalar::select(value, bound.into(), gone, acts));
                let next = release.above.map_or(below, |bound| Scalar::select(bound.into(), value, gone, below));
                vec![(Role::NextDiscrete(0), next)]
            });
            let acts = self.graph.input(layout.discrete_slot() + first);
            let nodes = recording.ops.iter().map(|op| match Op::decode(*op)? {
                Op::Input(Input::Signal(_)) => Some(value),
                Op::Input(_) => Some(acts),
                Op::Constant(k) => Some(self.graph.constant(recording.constants[k as usize])),
                _ => None,
            });
            let nodes: Vec<Option<Node>> = nodes.collect();
            let writing = Writing { recording: &recording, nodes: &nodes, graph: &self.graph, layout };
            let latch = writing.latch(element, first, 1).map(|latch| Latch { releases: true, ..latch });
            self.next_discrete[first] = acts;
            self.latches.extend(latch);
        }
    }

    /// Whether something happens at instants at which steps end: rows come and go, memories jump.
    #[must_use]
    pub fn has_events(&self) -> bool {
        self.switches_rows() || !self.latches.is_empty()
    }

    /// Both sides of the conditions by which memories jump.
    pub fn latch_conditions(&self) -> impl Iterator<Item = (Node, Node)> + '_ {
        let moving = self.latches.iter().flat_map(|latch| latch.conditions.iter().zip(&latch.moves));
        moving.filter(|(_, moves)| **moves).map(|(sides, _)| *sides)
    }
}
