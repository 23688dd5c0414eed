//! A quantity as a row that prescribes it.

use odyn_graph::Expr;

use super::equations::{Equations, Row};
use crate::model::{Model, Quantity};
use crate::plan::{BODY_SLOTS, Layout};

/// Of a body's slots those of position and Euler parameters.
const OF_POSITION: usize = 7;

impl Equations {
    /// The row whose value is a quantity, SI, with its exact derivatives: what prescribes that quantity once its value is set
    /// against a wish. Its time derivative and `gamma` are those of the quantity alone.
    ///
    /// `None` where the quantity depends on more than positions and the time: on velocities, accelerations, reactions, element
    /// states or signals.
    pub fn prescribe(&mut self, quantity: &Quantity, model: &Model, layout: &Layout) -> Option<Row> {
        let value = self.observe(quantity, model, layout);
        let of_positions = |slot: usize| {
            let body = slot.checked_sub(1).filter(|_| slot < layout.state_slot());
            let reference = (layout.reference_slot()..layout.discrete_slot()).contains(&slot);
            slot == Layout::TIME || reference || body.is_some_and(|at| at % BODY_SLOTS < OF_POSITION)
        };
        let foreign = self.graph.live(&[value]).into_iter().any(|node| match self.graph.expr(node) {
            Expr::Input(slot) => !of_positions(slot as usize),
            _ => false,
        });
        if foreign {
            return None;
        }
        let bodies: Vec<usize> = (0..layout.bodies).collect();
        self.traced_rows(&[value], &bodies).pop()
    }
}
