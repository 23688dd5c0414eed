//! Rows of recommended parameters that a library brings along: `params = { use = "6204" }`.

use element_api::params::{ParamKind, ParamSpec};

use crate::diagnostics::{Diagnostic, codes, help_for};
use crate::scene::{Quantity, RawKind, RawTable, RawValue, name_and_unit, parse_unit};

/// The key of a scene that picks a row.
pub(super) const USE: &str = "use";

/// A catalogue: CSV whose first column names its rows; see `element_api::Element::CATALOG`.
#[derive(Debug, Clone, PartialEq)]
pub struct Catalogue {
    /// Names of the columns with their units, empty where there is none; the first is that of the names of rows.
    pub columns: Vec<(String, String)>,
    /// The rows, as many fields each.
    pub rows: Vec<Vec<String>>,
}

impl Catalogue {
    /// Reads one; `None` for an empty text.
    ///
    /// # Errors
    /// Lines of another length than the first, or two rows of one name, in words.
    pub fn read(text: &str) -> Result<Option<Self>, String> {
        let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
        let Some(head) = lines.next() else { return Ok(None) };
        let columns: Vec<(String, String)> = head
            .split(',')
            .map(name_and_unit)
            .map(|(name, unit)| (name.to_owned(), unit.unwrap_or_default().to_owned()))
            .collect();
        let rows: Vec<Vec<String>> =
            lines.map(|line| line.split(',').map(|field| field.trim().to_owned()).collect()).collect();
        for (k, row) in rows.iter().enumerate() {
            if row.len() != columns.len() {
                let message = format!("the row `{}` of its catalogue has {} fields", row[0], row.len());
                return Err(format!("{message}, the first line {}", columns.len()));
            }
            if rows[..k].iter().any(|other| other[0] == row[0]) {
                return Err(format!("its catalogue has two rows `{}`", row[0]));
            }
        }
        Ok(Some(Self { columns, rows }))
    }
}

/// What a scene takes from a catalogue: parameters with values, as if they were written where the row is named. Nothing where the
/// scene names none, or the element has a parameter of that name.
pub(super) fn chosen(
    params: &RawTable,
    specs: &[ParamSpec],
    catalog: &str,
    type_name: &str,
) -> Result<Vec<(String, RawValue)>, Box<Diagnostic>> {
    let Some(raw) = params.get(USE).filter(|_| is_offered(specs, catalog)) else { return Ok(Vec::new()) };
    let wrong = |code, message: String| Diagnostic::error(code, message).at(raw.span.clone(), "");
    let Some(name) = raw.as_text() else {
        let message = format!("`use` must be the name of a row, a text, found {}", raw.kind.describe());
        return Err(Box::new(wrong(codes::WRONG_TYPE, message)));
    };
    let read = Catalogue::read(catalog).map_err(|problem| {
        Box::new(wrong(codes::PLUGIN_MISBEHAVED, format!("the library of `{type_name}` is at fault: {problem}")))
    })?;
    let Some(Catalogue { columns, rows }) = read else { return Ok(Vec::new()) };
    let Some(row) = rows.iter().find(|row| row[0] == name) else {
        let known: Vec<&str> = rows.iter().map(|row| row[0].as_str()).collect();
        let unknown = wrong(codes::NOT_IN_CATALOG, format!("the catalogue of `{type_name}` has no row `{name}`"));
        return Err(Box::new(unknown.help_if(nearest(name, &known))));
    };
    let mut found = Vec::new();
    for ((column, unit), field) in columns.iter().zip(row).skip(1) {
        let Some(spec) = specs.iter().find(|spec| spec.name == *column).filter(|_| !field.is_empty()) else { continue };
        let kind = value(spec, unit, field).ok_or_else(|| {
            let message =
                format!("the library of `{type_name}` is at fault: `{column}` of the row `{name}` is `{field}`");
            Box::new(wrong(codes::PLUGIN_MISBEHAVED, message))
        })?;
        found.push((column.clone(), RawValue { span: raw.span.clone(), kind }));
    }
    Ok(found)
}

/// Whether `use` picks a row.
pub(super) fn is_offered(specs: &[ParamSpec], catalog: &str) -> bool {
    !catalog.is_empty() && !specs.iter().any(|spec| spec.name == USE)
}

/// Those that begin most alike, else some of them.
fn nearest(name: &str, known: &[&str]) -> Option<String> {
    const SHOWN: usize = 5;
    let alike = |row: &str| row.chars().zip(name.chars()).take_while(|(a, b)| a == b).count();
    let mut list: Vec<&str> = known.iter().copied().filter(|row| alike(row) > 0).collect();
    list.sort_by_key(|row| std::cmp::Reverse(alike(row)));
    list.truncate(SHOWN);
    match list.is_empty() {
        true => help_for(name, known, "rows"),
        false => Some(format!("the nearest are {}; `odyn elements describe` shows all", list.join(", "))),
    }
}

/// A field as a scene would have it. Numbers without a unit are in SI.
fn value(spec: &ParamSpec, unit: &str, field: &str) -> Option<RawKind> {
    let number = || field.parse::<f64>().ok().filter(|number| number.is_finite());
    Some(match spec.kind {
        ParamKind::Number => {
            let unit = if unit.is_empty() { spec.unit.as_str() } else { unit };
            let number = number()?;
            if unit.is_empty() || unit == "1" {
                return Some(RawKind::Number(number));
            }
            let (dimension, factor) = parse_unit(unit).ok()?;
            RawKind::Quantity(Quantity::derived(number * factor, dimension))
        }
        ParamKind::Integer => RawKind::Integer(field.parse().ok()?),
        ParamKind::Boolean => RawKind::Bool(field.parse().ok()?),
        ParamKind::Text => RawKind::Text(field.into()),
        ParamKind::Vector | ParamKind::List | ParamKind::Curve | ParamKind::Function | ParamKind::Surface => {
            return None;
        }
    })
}
