//! Forces that depend on accelerations and reactions: friction driven by a joint's reaction, a controller that reads an
//! acceleration.

use odyn_graph::{Expr, Node, Seeds, derivatives};

use super::equations::{Equations, Form};
use crate::plan::Layout;

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
    /// Finds the accelerations and multipliers that the loads depend on.
    pub(super) fn find_coupling(&mut self, layout: &Layout) {
        let slots = self.solved_inputs(&self.loads, layout);
        let one = self.graph.constant(1.0);
        for slot in slots {
            let slopes = match self.form {
                Form::Reference => Vec::new(),
                Form::Working => {
                    let input = self.graph.input(slot);
                    let loads = self.loads.clone();
                    derivatives(&mut self.graph, &loads, &Seeds::from_iter([(input, one)]))
                }
            };
            self.coupling.push(CoupledInput { slot, slopes });
        }
    }

    /// The accelerations and multipliers among the inputs that `nodes` depend on, ascending.
    fn solved_inputs(&self, nodes: &[Node], layout: &Layout) -> Vec<usize> {
        let solved = layout.acceleration_slot()..layout.inputs();
        let slot = |node: &Node| match self.graph.expr(*node) {
            Expr::Input(slot) if solved.contains(&(slot as usize)) => Some(slot as usize),
            _ => None,
        };
        let mut slots: Vec<usize> = self.graph.ancestors(nodes, |_| false).iter().filter_map(slot).collect();
        slots.sort_unstable();
        slots
    }

    /// Whether the rates of states or the power depend on accelerations or multipliers, so that they can be evaluated only
    /// after these are known.
    #[must_use]
    pub fn rates_need_solution(&self, layout: &Layout) -> bool {
        let mut nodes = self.state_rates.clone();
        nodes.push(self.power);
        !self.solved_inputs(&nodes, layout).is_empty()
    }
}
