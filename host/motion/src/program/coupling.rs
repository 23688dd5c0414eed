//! Forces that depend on accelerations and reactions: friction driven by a joint's reaction, a controller that reads an
//! acceleration.

use odyn_graph::{Expr, Graph, Node, Rewriting, derivatives_along_each};
use rustc_hash::FxHashMap;

use super::equations::{Equations, Form};
use super::joint::JointEquations;
use super::reactions::{Reactions, Working};
use crate::plan::{Layout, SpanningTree};

/// An acceleration or multiplier that loads depend on, although it follows from them.
#[derive(Debug, Clone)]
pub struct CoupledInput {
    /// Its place among the inputs.
    pub slot: usize,
    /// Derivatives of the loads with respect to it, aligned with [`Equations::loads`] (working form only). Opaque elements
    /// contribute nothing: their derivatives are not known.
    pub slopes: Vec<Node>,
}

impl Equations {
    /// Finds the accelerations and multipliers that the loads, the rates of states and the power depend on.
    pub(super) fn find_coupling(&mut self, layout: &Layout) {
        let slots = self.solved_inputs(&self.loads, layout);
        let slopes = match self.form {
            Form::Reference => vec![Vec::new(); slots.len()],
            Form::Working => {
                let inputs: Vec<Node> = slots.iter().map(|slot| self.graph.input(*slot)).collect();
                derivatives_along_each(&mut self.graph, &self.loads, &inputs)
            }
        };
        self.coupling.extend(slots.into_iter().zip(slopes).map(|(slot, slopes)| CoupledInput { slot, slopes }));
        let mut rates = self.state_rates.clone();
        rates.push(self.power);
        self.solved_in_rates = self.solved_inputs(&rates, layout);
    }

    /// Whether the loads are linear in the accelerations and multipliers that they depend on, as the inertia of elements is: their
    /// derivatives with respect to these do not contain them.
    #[must_use]
    pub fn is_coupling_linear(&self, layout: &Layout) -> bool {
        let slopes: Vec<Node> = self.coupling.iter().flat_map(|input| input.slopes.iter().copied()).collect();
        self.form == Form::Working && self.graph.calls.is_empty() && self.solved_inputs(&slopes, layout).is_empty()
    }

    /// Whether they depend on accelerations of bodies alone, by the inertia of elements alone, and nothing else that is integrated does:
    /// their derivatives are those of a mass matrix.
    #[must_use]
    pub fn is_coupling_inertia(&self, layout: &Layout) -> bool {
        let inertia = self.inertial_alone && self.solved_in_rates.is_empty() && self.is_coupling_linear(layout);
        inertia && self.coupling.iter().all(|input| input.slot < layout.multiplier_slot())
    }

    /// The accelerations and multipliers among the inputs that `nodes` depend on, ascending.
    pub(super) fn solved_inputs(&self, nodes: &[Node], layout: &Layout) -> Vec<usize> {
        let solved = layout.acceleration_slot()..layout.inputs();
        let slot = |node: &Node| match self.graph.expr(*node) {
            Expr::Input(slot) if solved.contains(&(slot as usize)) => Some(slot as usize),
            _ => None,
        };
        let mut slots: Vec<usize> = self.graph.live(nodes).iter().filter_map(slot).collect();
        slots.sort_unstable();
        slots
    }

    /// Whether loads, rates of states or power depend on accelerations or multipliers.
    #[must_use]
    pub fn needs_solution(&self) -> bool {
        !self.coupling.is_empty() || !self.solved_in_rates.is_empty()
    }

    /// The accelerations and multipliers that they depend on, ascending.
    #[must_use]
    pub fn solved_for(&self) -> Vec<usize> {
        let mut slots: Vec<usize> = self.coupling.iter().map(|input| input.slot).collect();
        slots.extend(&self.solved_in_rates);
        slots.sort_unstable();
        slots.dedup();
        slots
    }

    /// Whether they do with any choice of closed contacts.
    #[must_use]
    pub fn may_need_solution(&self) -> bool {
        self.may_need_solution
    }
}

/// The accelerations of bodies and the multipliers that equations in joint coordinates depend on, as functions of the joints'
/// accelerations, of the multipliers of rows that close loops, and of those among themselves that the loads depend on.
pub struct Dependence {
    /// The inputs that the loads depend on, ascending: z.
    pub slots: Vec<usize>,
    /// [`Equations::is_coupling_linear`].
    pub linear: bool,
    /// These, the others of the same bodies and joints, and the inputs that rates of states and power depend on, ascending.
    pub solved: Vec<usize>,
    /// [`Dependence::solved`] by inverse dynamics along the tree.
    pub found: Reactions,
    /// Inputs there that are multipliers of rows that close loops, with these rows; ascending.
    closing: Vec<(usize, usize)>,
}

/// [`Dependence`] written behind a solution of the equations of motion.
pub struct Dependent {
    /// F(z): [`Dependence::solved`] of the solution for z.
    pub solved: Vec<Node>,
    /// Derivatives of z among F(z), for each z one after the other.
    pub slopes: Vec<Node>,
    /// Rates of the states, with what is solved for in place of inputs that are not z.
    pub state_rates: Vec<Node>,
    /// The power, likewise.
    pub power: Node,
}

impl Dependence {
    /// `None` where inverse dynamics along the tree does not lead to what is needed: see [`JointEquations::reactions`].
    #[must_use]
    pub fn new(joint: &JointEquations, working: &Working<'_>, tree: &SpanningTree, length: f64) -> Option<Self> {
        let Working { equations, layout, .. } = working;
        let slots: Vec<usize> = equations.coupling.iter().map(|input| input.slot).collect();
        let mut solved: Vec<usize> = slots.iter().flat_map(|slot| layout.solved_peers(*slot)).collect();
        solved.extend(&equations.solved_in_rates);
        solved.sort_unstable();
        solved.dedup();
        let used = tree.used(layout.row_at.len());
        let closing = (0..layout.rows).filter(|row| !used[layout.element_of_row(*row).0]);
        let closing = closing.map(|row| (layout.multiplier_slot() + row, row)).collect();
        let found = joint.reactions(working, tree, length, &[], &solved)?;
        Some(Self { slots, linear: equations.is_coupling_linear(layout), solved, found, closing })
    }

    /// The places of [`Dependence::slots`] in [`Dependence::solved`].
    pub fn places(&self) -> impl Iterator<Item = usize> {
        self.slots.iter().map(|slot| self.solved.binary_search(slot).expect("slots are among those solved for"))
    }

    /// Writes F(z) and its derivatives behind accelerations and multipliers of `rows` that were solved for in `g`, a copy of the
    /// graph of `joint`.
    #[must_use]
    pub fn write(
        &self,
        g: &mut Graph,
        joint: &JointEquations,
        accelerations: &[Node],
        (rows, multipliers): (&[usize], &[Node]),
    ) -> Dependent {
        let zero = g.constant(0.0);
        let first = joint.coordinates.acceleration_slot;
        let mut replaced: FxHashMap<Node, Node> = FxHashMap::default();
        for node in self.found.graph.live(&self.found.nodes) {
            let Expr::Input(slot) = self.found.graph.expr(node) else { continue };
            let slot = slot as usize;
            if let Some(known) = slot.checked_sub(first).and_then(|column| accelerations.get(column)) {
                replaced.insert(node, *known);
            } else if let Ok(place) = self.closing.binary_search_by_key(&slot, |(slot, _)| *slot) {
                // A row that is not in use has the multiplier zero.
                let row = self.closing[place].1;
                replaced.insert(node, rows.binary_search(&row).map_or(zero, |k| multipliers[k]));
            }
        }
        let solved = Rewriting::new(&self.found.graph, g, replaced).carry_all(g, &self.found.nodes);
        let of_slots: Vec<Node> = self.places().map(|place| solved[place]).collect();
        let inputs: Vec<Node> = self.slots.iter().map(|slot| g.input(*slot)).collect();
        let slopes = derivatives_along_each(g, &of_slots, &inputs).concat();
        let mut replaced: FxHashMap<Node, Node> = FxHashMap::default();
        for (slot, node) in self.solved.iter().zip(&solved).filter(|(slot, _)| !self.slots.contains(slot)) {
            replaced.insert(g.input(*slot), *node);
        }
        let whole = g.clone();
        let mut rewriting = Rewriting::new(&whole, g, replaced);
        let state_rates = rewriting.carry_all(g, &joint.state_rates);
        let power = rewriting.carry(g, joint.power);
        Dependent { solved, slopes, state_rates, power }
    }
}
