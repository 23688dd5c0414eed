//! The checks of a scene on the samples of its run.

use std::collections::HashMap;
use std::path::PathBuf;
use std::thread;

use super::common::{Common, ReadTable, Tables};
use super::opened::Session;
use crate::diagnostics::{Diagnostic, codes, help_for};
use crate::results::{Check, CheckResult, Expected, Table};
use crate::scene::{CheckRecord, Formula, Reference, Scene};

/// The tables of checks that are not there, or have no such column, before a run that would have nothing to be compared with at its end.
pub(super) fn missing_tables(scene: &Scene) -> Vec<Diagnostic> {
    let mut columns = HashMap::new();
    let mut missing = |record: &CheckRecord| {
        let Reference::Csv { path, column } = &record.reference else { return None };
        let file = scene.source.beside(&path.value);
        let Some(error) = file.metadata().err() else {
            let names = columns.entry(file.clone()).or_insert_with(|| Table::columns_of(&file)).as_ref()?;
            let known: Vec<&str> = names.iter().map(String::as_str).collect();
            let message = format!(
                "`{}` has no column `{column}`, which the check `{}` compares with",
                path.value.display(),
                record.name.value
            );
            let diagnostic = Diagnostic::warning(codes::BAD_TABLE_FILE, message).at(path.span.clone(), "");
            let help = help_for(column, &known, "columns");
            return (!names.contains(column))
                .then(|| diagnostic.help_if(help).help("a run computes everything, and the check fails"));
        };
        let message =
            format!("cannot read `{}`, which the check `{}` compares with", path.value.display(), record.name.value);
        let diagnostic = Diagnostic::warning(codes::BAD_TABLE_FILE, message).at(path.span.clone(), error.to_string());
        Some(diagnostic.help("the path is relative to the folder of the scene; a run without it computes everything, and the check fails"))
    };
    scene.checks.iter().filter_map(&mut missing).collect()
}

impl Session {
    /// Where the tables are kept that the checks compare with; each is read where it is first asked for.
    pub(super) fn tables(&self) -> Tables {
        self.options.common.as_ref().map(Common::tables).unwrap_or_default()
    }

    /// The same, which begins to read them on another thread, so that they are there at the end of the run. Variants of one scene share
    /// what the first of them has read.
    pub(super) fn read_ahead(&self) -> Tables {
        let tables = self.tables();
        if self.options.common.is_some() {
            return tables;
        }
        let asked = self.asked_tables();
        if !asked.is_empty() {
            let own = tables.clone();
            let read = move || asked.iter().for_each(|(path, columns)| drop(own.read(path, columns)));
            // What no thread reads is read where it is asked for.
            let _ = thread::Builder::new().name("tables".into()).spawn(read);
        }
        tables
    }

    /// The tables that the checks compare with, and the columns that are asked for: each is read once, and no more of it.
    fn asked_tables(&self) -> HashMap<PathBuf, Vec<String>> {
        let mut asked: HashMap<PathBuf, Vec<String>> = HashMap::new();
        for record in &self.scene.checks {
            if let Reference::Csv { path, column } = &record.reference {
                asked.entry(self.scene.source.beside(&path.value)).or_default().push(column.clone());
            }
        }
        asked
    }

    /// Makes all checks of the scene; times and columns in scene units, columns in the order of the model's channels.
    pub(super) fn checks(&self, tables: &Tables, times: &[f64], columns: &[Vec<f64>]) -> Vec<CheckResult> {
        let place: HashMap<&str, usize> =
            self.model.channels.iter().enumerate().map(|(k, channel)| (channel.name.as_str(), k)).collect();
        let at_row = |formula: &Formula, row: usize| {
            formula.evaluate(&|name| match name {
                "t" => Some(times[row]),
                _ => place.get(name).map(|k| columns[*k][row]),
            })
        };
        let read = |(path, columns): (PathBuf, Vec<String>)| {
            let table = tables.read(&path, &columns);
            (path, table)
        };
        let tables: HashMap<PathBuf, ReadTable> = self.asked_tables().into_iter().map(read).collect();
        let mut results = Vec::new();
        for record in &self.scene.checks {
            let closed_form: &dyn Fn(usize) -> f64 = &|row| match &record.reference {
                Reference::Formula(formula) => at_row(formula, row),
                Reference::Csv { .. } => f64::NAN,
            };
            let table = match &record.reference {
                Reference::Csv { path, column } => {
                    tables.get_key_value(&self.scene.source.beside(&path.value)).map(|found| (found, column))
                }
                Reference::Formula(_) => None,
            };
            let reference = table.map_or(Expected::Formula(closed_form), |((path, table), column)| Expected::Column {
                path,
                table,
                column,
            });
            let output = place.get(record.value.text().trim()).copied();
            let check = Check {
                name: &record.name.value,
                kind: record.kind.word(),
                unit: output.map_or("", |k| self.model.channels[k].unit.as_str()),
                value: &|row| output.map_or_else(|| at_row(&record.value, row), |k| columns[k][row]),
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
