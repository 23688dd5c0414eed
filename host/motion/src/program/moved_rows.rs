//! Rows that states of their joints move, as the time moves those of a driver.
//!
//! With Phi(q, s, t) and s' = f, the rate of a row is Phi_q v + Phi_s f + Phi_t, and gamma is minus its derivative along the motion with
//! all accelerations zero. The model has made sure that f does not depend on velocities, so that no acceleration is lost in it; the
//! states behind f (of a filter, of a controller) move with rates of their own, which may.

use std::sync::Arc;

use odyn_graph::{Node, Seeds, derivatives};

use super::equations::Equations;
use crate::model::Model;
use crate::plan::Layout;

impl Equations {
    /// Completes the derivatives of rows along the motion, once the rates of all states are written down.
    pub(super) fn move_rows_with_states(&mut self, model: &Model, layout: &Layout) {
        let joints: Vec<usize> =
            (0..model.elements.len()).filter(|k| model.elements[*k].is_joint_with_states()).collect();
        if joints.is_empty() {
            return;
        }
        let states: Vec<Node> = (0..layout.states).map(|k| self.graph.input(layout.state_slot() + k)).collect();
        let of_states = Seeds::from_iter(states.into_iter().zip(self.state_rates.iter().copied()));
        let bodies: Vec<usize> = (0..layout.bodies).collect();
        let mut motion = self.motion_seeds(&bodies);
        motion.extend(of_states.iter().map(|(node, rate)| (*node, *rate)));
        for joint in joints {
            let first = layout.row_at[joint];
            let rows = first..first + model.elements[joint].rows.len();
            let values: Vec<Node> = self.rows[rows.clone()].iter().map(|row| row.value).collect();
            let moved = derivatives(&mut self.graph, &values, &of_states);
            let rates = derivatives(&mut self.graph, &values, &motion);
            let second = derivatives(&mut self.graph, &rates, &motion);
            for (k, row) in rows.enumerate().filter(|(k, _)| !self.graph.is_zero(moved[*k])).collect::<Vec<_>>() {
                let time = self.graph.add(self.rows[row].time, moved[k]);
                let row = &mut Arc::make_mut(&mut self.rows)[row];
                (row.time, row.gamma) = (time, self.graph.neg(second[k]));
            }
        }
    }
}
