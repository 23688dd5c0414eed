//! Functions of two variables, given on a grid: what a scene writes, as `element_api::Surface` reads it, in SI.

use super::dimension::Dimension;
use super::function::interpolation;
use super::raw::{RawTable, RawValue};
use super::reader::Scope;
use element_api::Interpolation;
use odyn_diagnostics::{Diagnostic, codes, help_for};
use toml::Value;

const KEYS: &[&str] = &["x", "y", "z", "interpolation"];
const FORM: &str =
    "write `{ x = [0, 1, 2], y = [0, 1], z = [[0, 1], [1, 2], [2, 3]] }`: in `z` one list per value of x";

/// Reads the grid of the parameter `name`. The error is `None` if its cause is reported elsewhere.
pub(super) fn read(
    raw: &RawValue,
    name: &str,
    [x, y, z]: [Option<Dimension>; 3],
    scope: &Scope<'_>,
) -> Result<Value, Option<Diagnostic>> {
    let Some(table) = raw.as_table() else {
        let message = format!("`{name}` must be a function of two variables, given on a grid");
        let found = format!("this is {}", raw.kind.describe());
        return Err(Some(Diagnostic::error(codes::WRONG_TYPE, message).at(raw.span.clone(), found).help(FORM)));
    };
    if table.get("points").is_some() {
        let message = "a function of two variables cannot be given by the points of a curve";
        let wrong =
            Diagnostic::error(codes::UNKNOWN_KEY, message).at(raw.span.clone(), "this has values over one argument");
        let help = "of a file, name three columns: `columns = [\"speed\", \"throttle\", \"torque\"]`";
        return Err(Some(wrong.help(FORM).help(help)));
    }
    if let Some((key, _)) = table.entries.iter().find(|(key, _)| !KEYS.contains(&key.value.as_str())) {
        let unknown = Diagnostic::error(codes::UNKNOWN_KEY, format!("unknown key `{}` in a grid", key.value));
        return Err(Some(unknown.at(key.span.clone(), "").help_if(help_for(&key.value, KEYS, "keys")).help(FORM)));
    }
    let columns = axis(raw, table, "x", x, scope)?;
    let rows = axis(raw, table, "y", y, scope)?;
    let list = needed(raw, table, "z")?;
    let lists = array(list, "z")?;
    if lists.len() != columns.len() {
        return Err(Some(wrong_length(list, "z", columns.len(), "lists, one per value of x", lists.len())));
    }
    let mut values = Vec::with_capacity(lists.len());
    for one in lists {
        let items = array(one, "an entry of z")?;
        if items.len() != rows.len() {
            return Err(Some(wrong_length(
                one,
                "z",
                rows.len(),
                "values per value of x, one per value of y",
                items.len(),
            )));
        }
        let row = items.iter().map(|item| quantity(item, z, scope).map(Value::Float));
        values.push(Value::Array(row.collect::<Result<_, _>>()?));
    }
    let mut entries = toml::Table::new();
    entries.insert("x".into(), Value::Array(columns));
    entries.insert("y".into(), Value::Array(rows));
    entries.insert("z".into(), Value::Array(values));
    if let Some(word) = table.get("interpolation") {
        let found = interpolation(word)?;
        if found == Interpolation::Steps {
            let message = "values on a grid are not joined by steps";
            let wrong = Diagnostic::error(codes::UNKNOWN_WORD, message).at(word.span.clone(), "");
            return Err(Some(wrong.help("one of monotone, linear, spline")));
        }
        entries.insert("interpolation".into(), Value::String(found.name().into()));
    }
    Ok(Value::Table(entries))
}

/// Arguments in SI, increasing.
fn axis(
    raw: &RawValue,
    table: &RawTable,
    key: &str,
    dimension: Option<Dimension>,
    scope: &Scope<'_>,
) -> Result<Vec<Value>, Option<Diagnostic>> {
    let list = needed(raw, table, key)?;
    let items = array(list, key)?;
    if items.len() < 2 {
        let message = format!("a grid needs at least 2 values of {key}, found {}", items.len());
        return Err(Some(Diagnostic::error(codes::WRONG_LENGTH, message).at(list.span.clone(), "")));
    }
    let mut found = Vec::with_capacity(items.len());
    let mut last = f64::NEG_INFINITY;
    for item in items {
        let value = quantity(item, dimension, scope)?;
        if value <= last {
            let wrong = Diagnostic::error(codes::OUT_OF_RANGE, format!("the values of {key} of a grid must increase"));
            return Err(Some(wrong.at(item.span.clone(), "not above the one before")));
        }
        last = value;
        found.push(Value::Float(value));
    }
    Ok(found)
}

/// A value in SI; without a dimension, of any, where a plain number is SI.
fn quantity(raw: &RawValue, dimension: Option<Dimension>, scope: &Scope<'_>) -> Result<f64, Option<Diagnostic>> {
    match dimension {
        Some(dimension) => scope.quantity(raw, dimension),
        None => scope.any_quantity(raw).map(|quantity| quantity.si),
    }
}

fn needed<'t>(raw: &RawValue, table: &'t RawTable, key: &str) -> Result<&'t RawValue, Option<Diagnostic>> {
    table.get(key).ok_or_else(|| {
        let missing = Diagnostic::error(codes::MISSING_KEY, format!("a function given on a grid needs `{key}`"));
        Some(missing.at(raw.span.clone(), "").help(FORM))
    })
}

fn array<'t>(raw: &'t RawValue, what: &str) -> Result<&'t [RawValue], Option<Diagnostic>> {
    raw.as_array().ok_or_else(|| {
        let message = format!("`{what}` must be a list, found {}", raw.kind.describe());
        Some(Diagnostic::error(codes::WRONG_TYPE, message).at(raw.span.clone(), "").help(FORM))
    })
}

fn wrong_length(raw: &RawValue, key: &str, wanted: usize, what: &str, found: usize) -> Diagnostic {
    let message = format!("`{key}` needs {wanted} {what}, found {found}");
    Diagnostic::error(codes::WRONG_LENGTH, message).at(raw.span.clone(), "").help(FORM)
}
