//! [`Data`]: what was measured, in the units of the scene's outputs.

use std::path::Path;

use super::Request;
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::results::Table;
use crate::scene::{Dimension, UnitError, name_and_unit, parse_unit};
use crate::session::Session;

/// What was measured.
#[derive(Debug, Clone, Default)]
pub(crate) struct Data {
    /// Times, in the scene's unit.
    pub(crate) times: Vec<f64>,
    pub(crate) columns: Vec<Measured>,
    pub(crate) targets: Vec<Target>,
}

/// An output over time.
#[derive(Debug, Clone)]
pub(crate) struct Measured {
    pub(crate) column: String,
    /// Number of the output.
    pub(crate) output: usize,
    /// In its unit.
    pub(crate) values: Vec<f64>,
    pub(crate) noise: Option<f64>,
}

/// A figure.
#[derive(Debug, Clone)]
pub(crate) struct Target {
    /// Number of the figure.
    pub(crate) figure: usize,
    pub(crate) value: f64,
    pub(crate) noise: Option<f64>,
}

type Refused = Box<Diagnostic>;

fn refused(message: String) -> Diagnostic {
    Diagnostic::error(codes::NOTHING_TO_COMPARE, message)
}

impl Data {
    /// Reads the table, if there is one, and the figures.
    ///
    /// # Errors
    /// A table that cannot be read; columns without an output, of another dimension, or at times when the scene does not run; figures that the
    /// scene does not have; noise that is none, or of nothing.
    pub(crate) fn read(table: Option<&Path>, request: &Request, session: &Session) -> Result<Self, Refused> {
        let mut data = Self::default();
        if let Some(path) = table {
            let mut table = Table::measured(path).map_err(|error| Box::new(error.diagnostic()))?;
            in_unit_of_scene(&mut table, session)?;
            data.take(&table, request, session)?;
        }
        let figures: Vec<&str> = session.scene.figures.iter().map(|figure| figure.name.value.as_str()).collect();
        for (name, value, noise) in &request.figures {
            let Some(figure) = figures.iter().position(|one| one == name) else {
                let nearest =
                    suggest(name, figures.iter().copied()).map(|nearest| format!("did you mean `{nearest}`?"));
                let error = Diagnostic::error(codes::UNKNOWN_CHANNEL, format!("there is no figure `{name}`"));
                return Err(Box::new(error.help_if(nearest)));
            };
            data.targets.push(Target { figure, value: *value, noise: *noise });
        }
        for (name, noise) in &request.noise {
            if !(noise.is_finite() && *noise > 0.0) {
                return Err(Box::new(refused(format!("the noise of `{name}` is not a positive number"))));
            }
            let Some(column) = data.columns.iter_mut().find(|column| column.column == *name) else {
                return Err(Box::new(refused(format!("there is no column `{name}` to have noise"))));
            };
            column.noise = Some(*noise);
        }
        if data.columns.is_empty() && data.targets.is_empty() {
            let error = refused("there is nothing to fit to".into());
            return Err(Box::new(error.help("give a table with a column for each output, or `--figure NAME=VALUE`")));
        }
        Ok(data)
    }

    fn take(&mut self, table: &Table, request: &Request, session: &Session) -> Result<(), Refused> {
        let unit = session.scene.units.factor(Dimension::TIME);
        let [from, to] = [session.time_of_start(), session.scene.simulation.t_end].map(|time| time / unit);
        let room = 1e-12 * to.abs().max(from.abs());
        if let Some(time) = table.times.iter().find(|time| **time < from - room || **time > to + room) {
            let label = session.scene.units.label(Dimension::TIME);
            let error = refused(format!("t = {time} {label} is measured, the scene runs from {from} to {to} {label}"));
            return Err(Box::new(error.help("times are in the scene's unit; `--t-end` lets the scene run longer")));
        }
        let headers: Vec<(&str, Option<&str>)> = table.names.iter().map(|name| name_and_unit(name)).collect();
        let wanted: Vec<(String, String)> = if request.columns.is_empty() {
            headers.iter().map(|(name, _)| ((*name).to_owned(), (*name).to_owned())).collect()
        } else {
            request.columns.clone()
        };
        let outputs: Vec<&str> = session.model.channels.iter().map(|channel| channel.name.as_str()).collect();
        for (column, output) in wanted {
            let Some(number) = headers.iter().position(|(name, _)| *name == column) else {
                let names: Vec<&str> = headers.iter().map(|(name, _)| *name).collect();
                let help = format!("it has {}", names.join(", "));
                return Err(Box::new(refused(format!("the table has no column `{column}`")).help(help)));
            };
            let Some(place) = outputs.iter().position(|name| *name == output) else {
                let error = Diagnostic::error(codes::UNKNOWN_CHANNEL, format!("the scene has no output `{output}`"));
                let nearest = suggest(&output, outputs.iter().copied());
                let nearest = nearest.map(|nearest| format!("did you mean `{nearest}`?"));
                let help = "name the columns to use with `--columns MEASURED=OUTPUT,...`";
                return Err(Box::new(error.help_if(nearest).help(help)));
            };
            let channel = &session.model.channels[place];
            let factor = match &headers[number].1 {
                None => 1.0,
                Some(unit) => {
                    let (dimension, factor) = parse_unit(unit).map_err(|error| {
                        Box::new(Diagnostic::error(
                            codes::UNKNOWN_UNIT,
                            format!("column `{column}`: {}", error.message),
                        ))
                    })?;
                    if dimension != channel.dimension {
                        let own = if channel.unit.is_empty() { "a plain number" } else { channel.unit.as_str() };
                        let message = format!("column `{column}` is in {unit}, the output `{output}` in {own}");
                        return Err(Box::new(Diagnostic::error(codes::DIMENSION, message)));
                    }
                    factor / channel.factor
                }
            };
            let values: Vec<f64> = table.columns[number].iter().map(|value| value * factor).collect();
            if let Some(k) = values.iter().position(|value| !value.is_finite()) {
                let message = format!("column `{column}` has no finite number at t = {}", table.times[k]);
                return Err(Box::new(Diagnostic::error(codes::NOT_FINITE, message)));
            }
            self.columns.push(Measured { column, output: place, values, noise: None });
        }
        self.times.clone_from(&table.times);
        Ok(())
    }

    /// Numbers that were measured.
    pub(crate) fn points(&self) -> usize {
        self.columns.len() * self.times.len() + self.targets.len()
    }

    /// All of them, columns first.
    pub(crate) fn values(&self) -> Vec<f64> {
        let columns = self.columns.iter().flat_map(|column| column.values.iter().copied());
        columns.chain(self.targets.iter().map(|target| target.value)).collect()
    }
}

/// Brings times with a unit of their own into that of the scene.
fn in_unit_of_scene(table: &mut Table, session: &Session) -> Result<(), Refused> {
    let Some(unit) = table.time_unit.take() else { return Ok(()) };
    let unknown = |error: UnitError| Diagnostic::error(codes::UNKNOWN_UNIT, format!("the times: {}", error.message));
    let (dimension, factor) = parse_unit(&unit).map_err(unknown)?;
    if dimension != Dimension::TIME {
        return Err(Box::new(Diagnostic::error(
            codes::DIMENSION,
            format!("the times are in {unit}, which is no time"),
        )));
    }
    let factor = factor / session.scene.units.factor(Dimension::TIME);
    if factor != 1.0 {
        table.times.iter_mut().for_each(|time| *time *= factor);
    }
    Ok(())
}
