//! [`Outputs`]: what of a scene's outputs a prescribed motion determines.

use crate::analysis::Evaluator;
use crate::driven::Driven;
use crate::linear::Port;
use crate::model::Quantity;
use crate::program::Node;

/// The outputs that a prescribed motion determines.
pub(super) struct Outputs {
    pub(super) ports: Vec<Port>,
    values: Evaluator,
}

impl Outputs {
    pub(super) fn new(driven: &Driven<'_>, along: bool, notes: &mut Vec<String>) -> Self {
        let mut equations = driven.equations.clone();
        let (layout, model) = (&driven.layout, &driven.session.model);
        let (mut nodes, mut ports, mut left_out): (Vec<Node>, Vec<Port>, Vec<&str>) = Default::default();
        for channel in &model.channels {
            let node = equations.observe(&channel.quantity, model, layout);
            let untold = driven.leaves_open(&equations, node);
            // Efforts along quantities belong to no element: balances of reported loads lack them.
            if untold || along && matches!(channel.quantity, Quantity::Balance { .. }) {
                left_out.push(&channel.name);
                continue;
            }
            nodes.push(node);
            let (name, unit) = (channel.name.clone(), channel.unit.clone());
            ports.push(Port { name, unit, factor: channel.factor, value: 0.0 });
        }
        if !left_out.is_empty() {
            notes.push(format!("outputs that a prescribed motion does not tell are left out: {}", left_out.join(", ")));
        }
        Self { values: Evaluator::new(&equations.graph, &nodes), ports }
    }

    pub(super) fn at(&mut self, driven: &Driven<'_>) -> Result<Vec<f64>, String> {
        let found = self.values.run(&driven.inputs, &driven.session.model.sets).map_err(|error| error.to_string())?;
        Ok(found.iter().zip(&self.ports).map(|(value, port)| value / port.factor).collect())
    }
}
