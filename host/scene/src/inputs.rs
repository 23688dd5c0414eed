//! `[[input]]`: signals that are given from outside while a scene runs.

use super::dimension::Dimension;
use super::raw::{RawKind, RawTable, RawValue};
use super::reader::{NamesTaken, Reader, Record};
use super::record::ExternalInput;
use super::units::parse_unit;
use odyn_diagnostics::Diagnostic;

pub(super) const KEYS: &[&str] = &["name", "value", "unit"];

/// Reads all inputs; `names` are those of signals.
pub(super) fn read(root: &RawTable, names: &mut NamesTaken, reader: &mut Reader<'_>) -> Vec<ExternalInput> {
    let mut inputs = Vec::new();
    for record in reader.records(root, "input") {
        inputs.extend(read_input(&record, names, reader));
    }
    inputs
}

/// A value and the unit that further ones are given in.
struct Given {
    /// SI.
    value: f64,
    dimension: Dimension,
    unit: String,
    factor: f64,
}

fn read_input(record: &Record<'_>, names: &mut NamesTaken, reader: &mut Reader<'_>) -> Option<ExternalInput> {
    reader.check_keys(record, KEYS);
    let name = reader.name(record, ".");
    if let Some(name) = &name {
        names.take(name, &mut reader.diagnostics);
    }
    let value = record.table.get("value");
    let given = match record.table.get("unit") {
        Some(unit) => in_unit(unit, value, record, reader),
        None => in_scene_units(value, reader),
    };
    let Given { value, dimension, unit, factor } = given?;
    Some(ExternalInput { name: name?, value, dimension, unit, factor })
}

/// With a unit of its own, in which plain numbers are taken.
fn in_unit(raw: &RawValue, value: Option<&RawValue>, record: &Record<'_>, reader: &mut Reader<'_>) -> Option<Given> {
    let unit = reader.word(record, "unit")?.value;
    let (dimension, factor) = match parse_unit(&unit) {
        Ok(known) => known,
        Err(error) => {
            let diagnostic = Diagnostic::error(error.code, error.message).at(raw.span.clone(), "");
            reader.diagnostics.push(diagnostic.help_if(error.help));
            return None;
        }
    };
    let value = match value.map(|value| (value, &value.kind)) {
        None => 0.0,
        Some((_, RawKind::Number(number))) => factor * number,
        Some((_, RawKind::Integer(number))) => factor * *number as f64,
        // Also a text that has no unit in it is a plain number.
        Some((value, _)) => match reader.scope.any_quantity(value) {
            Ok(plain) if plain.dimension == Dimension::DIMENSIONLESS => factor * plain.si,
            _ => reader.quantity(value, dimension)?,
        },
    };
    Some(Given { value, dimension, unit, factor })
}

/// Without: the dimension is that of the value.
fn in_scene_units(raw: Option<&RawValue>, reader: &mut Reader<'_>) -> Option<Given> {
    let (value, dimension) = match raw.map(|value| reader.scope.any_quantity(value)) {
        None => (0.0, Dimension::DIMENSIONLESS),
        Some(Ok(quantity)) => (quantity.si, quantity.dimension),
        Some(Err(diagnostic)) => {
            reader.diagnostics.extend(diagnostic);
            return None;
        }
    };
    let units = reader.scope.units;
    let written = raw.and_then(RawValue::as_text).unwrap_or_default();
    Some(Given { value, dimension, unit: units.label_as(dimension, written), factor: units.factor(dimension) })
}
