//! [`WorkingParts`]: what the form in coordinates of bodies is made of.

use std::sync::Arc;

use super::*;

/// What the form in coordinates of bodies is made of.
pub struct WorkingParts {
    pub(in crate::analysis) equations: Equations,
    pub(in crate::analysis) plan: Plan,
    pub(in crate::analysis) masses: Vec<f64>,
    /// As [`body_scales`].
    pub(in crate::analysis) scales: Vec<f64>,
    /// Joint and row of every row.
    pub(in crate::analysis) row_names: Arc<[String]>,
    pub(in crate::analysis) length: f64,
}

impl WorkingParts {
    /// The equations of a planned model, whose graph they [share](odyn_graph::Graph::share) if it is. `length`: that of the scene, m.
    #[must_use]
    pub fn new(equations: &Equations, model: &Model, plan: &Plan, length: f64) -> Self {
        let row_name = |row: usize| {
            let (element, k) = plan.layout.element_of_row(row);
            model.elements[element].row_name(k)
        };
        Self {
            equations: equations.resting(),
            plan: plan.clone(),
            masses: mass_values(model),
            scales: body_scales(model, length),
            row_names: (0..plan.layout.rows).map(row_name).collect(),
            length,
        }
    }
}
