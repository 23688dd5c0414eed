//! The checks of a scene on the samples of its run.

use std::collections::HashMap;

use super::opened::Session;
use crate::results::{Check, CheckResult, Expected};
use crate::scene::{Formula, Reference};

impl Session {
    /// Makes all checks of the scene; times and columns in scene units, columns in the order of the model's channels.
    pub(super) fn checks(&self, times: &[f64], columns: &[Vec<f64>]) -> Vec<CheckResult> {
        let place: HashMap<&str, usize> =
            self.model.channels.iter().enumerate().map(|(k, channel)| (channel.name.as_str(), k)).collect();
        let at_row = |formula: &Formula, row: usize| {
            formula.evaluate(&|name| match name {
                "t" => Some(times[row]),
                _ => place.get(name).map(|k| columns[*k][row]),
            })
        };
        let mut results = Vec::new();
        for record in &self.scene.checks {
            let closed_form: &dyn Fn(usize) -> f64 = &|row| match &record.reference {
                Reference::Formula(formula) => at_row(formula, row),
                Reference::Csv { .. } => f64::NAN,
            };
            let reference = match &record.reference {
                Reference::Formula(_) => Expected::Formula(closed_form),
                Reference::Csv { path, column } => {
                    Expected::Column { path: self.scene.source.beside(&path.value), column }
                }
            };
            let output = place.get(record.value.text().trim()).map(|k| &self.model.channels[*k]);
            let check = Check {
                name: &record.name.value,
                kind: record.kind.word(),
                unit: output.map_or("", |channel| channel.unit.as_str()),
                value: &|row| at_row(&record.value, row),
                reference,
                tolerance: record.tolerance,
                from: record.from,
                to: record.to,
            };
            results.push(check.evaluate(times));
        }
        results
    }
}
