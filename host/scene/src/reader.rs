//! Typed access to tables: every mistake becomes a diagnostic and reading continues.

use super::dimension::Dimension;
use super::expression::{self, ExpressionError};
use super::parameters::Parameters;
use super::quantity::{Names, Quantity, advice, evaluate};
use super::raw::{RawKind, RawTable, RawValue, Spanned};
use super::unit_system::UnitSystem;
use super::{bodies, elements, inputs, outputs, settings, verification};
use odyn_diagnostics::{Diagnostic, Source, codes, help_for};
use std::collections::HashMap;
use std::ops::Range;

/// What is needed to compute a value: units and parameters.
#[derive(Clone, Copy)]
pub(super) struct Scope<'a> {
    /// The text that spans point into.
    pub source: &'a Source,
    /// Units of plain numbers.
    pub units: &'a UnitSystem,
    /// Values of names.
    pub parameters: &'a Parameters,
}

impl Scope<'_> {
    /// The value in SI; the error is `None` if its cause is reported elsewhere.
    pub(super) fn quantity(&self, raw: &RawValue, expected: Dimension) -> Result<f64, Option<Diagnostic>> {
        let number = match &raw.kind {
            RawKind::Number(value) => *value,
            RawKind::Integer(value) => *value as f64,
            RawKind::Quantity(quantity) => {
                let si = quantity.expect(expected, self.units, 0..0);
                return si.map_err(|error| Some(expression_diagnostic(&error, raw, self.source)));
            }
            RawKind::Text(text) => return self.text(text, raw, expected),
            other => {
                let found = other.describe();
                return Err(Some(
                    Diagnostic::error(codes::WRONG_TYPE, format!("expected {expected}, found {found}"))
                        .at(raw.span.clone(), format!("this is {found}"))
                        .help(advice(expected, self.units)),
                ));
            }
        };
        let si = self.units.to_si(number, expected);
        if si.is_finite() {
            return Ok(si);
        }
        Err(Some(Diagnostic::error(codes::NOT_FINITE, "this number is too large").at(raw.span.clone(), "")))
    }

    /// The value in SI with whatever dimension it has; a plain number is one. Errors as [`Scope::quantity`].
    pub(super) fn any_quantity(&self, raw: &RawValue) -> Result<Quantity, Option<Diagnostic>> {
        match &raw.kind {
            RawKind::Number(value) => Ok(Quantity::number(*value)),
            RawKind::Integer(value) => Ok(Quantity::number(*value as f64)),
            RawKind::Quantity(quantity) => Ok(*quantity),
            RawKind::Text(text) => self
                .evaluated(text)
                .map_err(|error| (!error.reported).then(|| expression_diagnostic(&error, raw, self.source))),
            other => {
                let found = other.describe();
                let message = format!("expected a number or a quantity, found {found}");
                let diagnostic = Diagnostic::error(codes::WRONG_TYPE, message);
                Err(Some(diagnostic.at(raw.span.clone(), format!("this is {found}"))))
            }
        }
    }

    fn evaluated(&self, text: &str) -> Result<Quantity, ExpressionError> {
        let is_parameter = |name: &str| self.parameters.value(name).is_some();
        let parsed = expression::parse(text, &is_parameter)?;
        evaluate(&parsed, self.parameters, self.units)
    }

    fn text(&self, text: &str, raw: &RawValue, expected: Dimension) -> Result<f64, Option<Diagnostic>> {
        self.evaluated(text)
            .and_then(|quantity| quantity.expect(expected, self.units, 0..text.len()))
            .and_then(|si| match si.is_finite() {
                true => Ok(si),
                false => Err(ExpressionError::new(codes::NOT_FINITE, 0..text.len(), "this number is too large")),
            })
            .map_err(|error| (!error.reported).then(|| expression_diagnostic(&error, raw, self.source)))
    }
}

/// The error of an expression, at its place inside the text value.
pub(super) fn expression_diagnostic(error: &ExpressionError, raw: &RawValue, source: &Source) -> Diagnostic {
    let span = inner_span(raw, &error.range, source);
    Diagnostic::error(error.code, error.message.as_str()).at(span, error.label.as_str()).help_if(error.help.clone())
}

/// Byte range of a part of a text value. If the text has escapes, its bytes are not those of the source, and
/// the whole value is pointed to.
pub(super) fn inner_span(raw: &RawValue, range: &Range<usize>, source: &Source) -> Range<usize> {
    let text = raw.as_text().unwrap_or_default();
    let found = [0, 1, 3] // quotes around it
        .map(|quotes| raw.span.start + quotes)
        .into_iter()
        .find(|&start| source.slice(start..start + text.len()) == Some(text));
    match found {
        Some(start) if !text.is_empty() => start + range.start..start + range.end,
        _ => raw.span.clone(),
    }
}

/// A name with characters that names don't have.
pub(super) fn unusable(name: &str, span: Range<usize>) -> Diagnostic {
    let message = match name {
        "" => "a name is empty".to_owned(),
        _ => format!("`{name}` cannot be a name"),
    };
    Diagnostic::error(codes::BAD_NAME, message).at(span, "")
}

/// Where a key belongs that stands in a table which has none of its name.
fn home_of(key: &str) -> Option<String> {
    let tables: [(&str, &[&str]); 8] = [
        ("[plugins]", settings::PLUGIN_KEYS),
        ("[simulation]", settings::SIMULATION_KEYS),
        ("[[body]]", bodies::KEYS),
        ("[[joint]]`, `[[force]]` and `[[control]]", elements::KEYS),
        ("[[input]]", inputs::KEYS),
        ("[[output]]", outputs::OUTPUT_KEYS),
        ("[[figure]]", outputs::FIGURE_KEYS),
        ("[[check]]", verification::CHECK_KEYS),
    ];
    let mut homes = tables.into_iter().filter(|(_, keys)| keys.contains(&key)).map(|(table, _)| table);
    // Of what stands in several tables there is nothing to tell.
    let home = homes.next().filter(|_| homes.next().is_none())?;
    Some(format!("`{key}` is a key of `{home}`"))
}

/// A table with the words messages call it by.
#[derive(Clone)]
pub(super) struct Record<'t> {
    /// Its keys.
    pub table: &'t RawTable,
    /// For example ``body `rotor` ``.
    pub what: String,
}

/// Reads values and collects mistakes.
pub(super) struct Reader<'a> {
    /// Units and parameters.
    pub scope: Scope<'a>,
    /// Mistakes so far.
    pub diagnostics: Vec<Diagnostic>,
}

impl Reader<'_> {
    /// Reports keys that are not among the known ones.
    pub(super) fn check_keys(&mut self, record: &Record<'_>, known: &[&str]) {
        for (key, _) in &record.table.entries {
            if known.contains(&key.value.as_str()) {
                continue;
            }
            let message = match record.what.as_str() {
                "" => format!("unknown key or table `{}`", key.value),
                what => format!("unknown key `{}` in {what}", key.value),
            };
            self.diagnostics.push(
                Diagnostic::error(codes::UNKNOWN_KEY, message)
                    .at(key.span.clone(), "")
                    .help_if(home_of(&key.value).or_else(|| help_for(&key.value, known, "keys"))),
            );
        }
    }

    /// Reports a key that must be there.
    pub(super) fn missing(&mut self, record: &Record<'_>, key: &str) {
        self.missing_with(record, key, None);
    }

    /// The same, with advice.
    pub(super) fn missing_with(&mut self, record: &Record<'_>, key: &str, help: Option<&str>) {
        let message = match record.what.as_str() {
            "" => format!("the scene has no `{key}`"),
            what => format!("{what} has no `{key}`"),
        };
        self.diagnostics.push(
            Diagnostic::error(codes::MISSING_KEY, message)
                .at(record.table.span.clone(), format!("`{key}` is missing here"))
                .help_if(help.map(str::to_owned)),
        );
    }

    /// Reports a value of the wrong kind.
    pub(super) fn wrong_type(&mut self, key: &str, expected: &str, raw: &RawValue) {
        let found = raw.kind.describe();
        let text = raw.as_text().map(str::to_ascii_lowercase);
        let axis = key.contains("axis") || key.contains("axes");
        let help = match text.as_deref() {
            Some("x" | "y" | "z") if !axis => None,
            Some("x") => Some("write `[1, 0, 0]`"),
            Some("y") => Some("write `[0, 1, 0]`"),
            Some("z") => Some("write `[0, 0, 1]`"),
            Some("true" | "yes" | "on") => Some("write `true`, in lower case and without quotes"),
            Some("false" | "no" | "off") => Some("write `false`, in lower case and without quotes"),
            _ => None,
        };
        let one = raw.as_text().filter(|_| expected.starts_with("a list of names"));
        let help = help.map(str::to_owned).or_else(|| one.map(|name| format!("write `[\"{name}\"]`")));
        self.diagnostics.push(
            Diagnostic::error(codes::WRONG_TYPE, format!("`{key}` must be {expected}, found {found}"))
                .at(raw.span.clone(), format!("this is {found}"))
                .help_if(help),
        );
    }

    /// Reports a number that breaks a condition.
    pub(super) fn out_of_range(&mut self, message: String, span: Range<usize>, label: &str) {
        self.diagnostics.push(Diagnostic::error(codes::OUT_OF_RANGE, message).at(span, label));
    }

    /// Reports two keys that exclude each other; true if both are there.
    pub(super) fn exclusive(&mut self, record: &Record<'_>, first: &str, second: &str) -> bool {
        let (Some((a, _)), Some((b, _))) = (record.table.entry(first), record.table.entry(second)) else {
            return false;
        };
        self.diagnostics.push(
            Diagnostic::error(codes::CONFLICTING_KEYS, format!("{} has both `{first}` and `{second}`", record.what))
                .at(b.span.clone(), "give only one of them")
                .context(a.span.clone(), "the other one"),
        );
        true
    }

    /// A quantity in SI.
    pub(super) fn quantity(&mut self, raw: &RawValue, dimension: Dimension) -> Option<f64> {
        match self.scope.quantity(raw, dimension) {
            Ok(value) => Some(value),
            Err(diagnostic) => {
                self.diagnostics.extend(diagnostic);
                None
            }
        }
    }

    /// The quantity of an optional key, in SI.
    pub(super) fn optional(&mut self, record: &Record<'_>, key: &str, dimension: Dimension) -> Option<Spanned<f64>> {
        let raw = record.table.get(key)?;
        let value = self.quantity(raw, dimension)?;
        Some(Spanned::new(value, raw.span.clone()))
    }

    /// An optional quantity that must be above zero.
    pub(super) fn positive(&mut self, record: &Record<'_>, key: &str, dimension: Dimension) -> Option<f64> {
        let found = self.optional(record, key, dimension)?;
        if found.value > 0.0 {
            return Some(found.value);
        }
        self.out_of_range(format!("`{key}` must be above zero"), found.span, "");
        None
    }

    /// An optional text.
    pub(super) fn text(&mut self, record: &Record<'_>, key: &str) -> Option<Spanned<String>> {
        let raw = record.table.get(key)?;
        let Some(text) = raw.as_text() else {
            self.wrong_type(key, "a text", raw);
            return None;
        };
        Some(Spanned::new(text.to_owned(), raw.span.clone()))
    }

    /// An optional text that is not empty.
    pub(super) fn word(&mut self, record: &Record<'_>, key: &str) -> Option<Spanned<String>> {
        let text = self.text(record, key)?;
        if !text.value.trim().is_empty() {
            return Some(text);
        }
        self.diagnostics.push(Diagnostic::error(codes::BAD_NAME, format!("`{key}` is empty")).at(text.span, ""));
        None
    }

    /// A text that must be there and not be empty.
    pub(super) fn required_word(&mut self, record: &Record<'_>, key: &str) -> Option<Spanned<String>> {
        if record.table.get(key).is_none() {
            self.missing(record, key);
        }
        self.word(record, key)
    }

    /// An optional whole number of at least `least`.
    pub(super) fn whole(&mut self, record: &Record<'_>, key: &str, least: u64) -> Option<Spanned<u64>> {
        let raw = record.table.get(key)?;
        let value = match raw.kind {
            RawKind::Integer(value) => value,
            // A `--set` may say 1e6.
            RawKind::Number(value) if value.fract() == 0.0 && value.abs() < 1e15 => value as i64,
            _ => {
                self.wrong_type(key, "a whole number", raw);
                return None;
            }
        };
        match u64::try_from(value) {
            Ok(value) if value >= least => Some(Spanned::new(value, raw.span.clone())),
            _ => {
                self.out_of_range(format!("`{key}` must be at least {least}"), raw.span.clone(), "");
                None
            }
        }
    }

    /// `true` or `false`, with a default.
    pub(super) fn flag(&mut self, record: &Record<'_>, key: &str, default: bool) -> bool {
        let Some(raw) = record.table.get(key) else {
            return default;
        };
        if let RawKind::Bool(value) = raw.kind {
            return value;
        }
        self.wrong_type(key, "true or false", raw);
        default
    }

    /// A list.
    pub(super) fn list<'t>(&mut self, raw: &'t RawValue, key: &str, expected: &str) -> Option<&'t [RawValue]> {
        let items = raw.as_array();
        if items.is_none() {
            self.wrong_type(key, expected, raw);
        }
        items
    }

    /// A list of exactly `N` entries.
    pub(super) fn entries<'t, const N: usize>(&mut self, raw: &'t RawValue, key: &str) -> Option<&'t [RawValue; N]> {
        let items = self.list(raw, key, &format!("a list of {N}"))?;
        let exact: Option<&[RawValue; N]> = items.try_into().ok();
        if exact.is_none() {
            self.wrong_length(raw, key, &format!("{N} entries"), items.len());
        }
        exact
    }

    /// Reports a list of the wrong length.
    pub(super) fn wrong_length(&mut self, raw: &RawValue, key: &str, needs: &str, found: usize) {
        self.diagnostics.push(
            Diagnostic::error(codes::WRONG_LENGTH, format!("`{key}` needs {needs}, found {found}"))
                .at(raw.span.clone(), ""),
        );
    }

    /// A list of exactly `N` quantities of one dimension, in SI.
    pub(super) fn quantities<const N: usize>(
        &mut self,
        raw: &RawValue,
        key: &str,
        dimension: Dimension,
    ) -> Option<[f64; N]> {
        let items = self.entries::<N>(raw, key)?;
        let mut values = [0.0; N];
        let mut complete = true;
        for (value, item) in values.iter_mut().zip(items) {
            match self.quantity(item, dimension) {
                Some(found) => *value = found,
                None => complete = false,
            }
        }
        complete.then_some(values)
    }

    /// The vector of an optional key; zero if absent.
    pub(super) fn vector_or_zero(&mut self, record: &Record<'_>, key: &str, dimension: Dimension) -> [f64; 3] {
        record.table.get(key).and_then(|raw| self.quantities(raw, key, dimension)).unwrap_or_default()
    }

    /// A vector of which only the direction matters, made a unit vector.
    pub(super) fn direction(&mut self, raw: &RawValue, key: &str) -> Option<[f64; 3]> {
        let vector = self.quantities(raw, key, Dimension::DIMENSIONLESS)?;
        let unit = normalised(vector);
        if unit.is_none() {
            self.diagnostics.push(
                Diagnostic::error(codes::NO_DIRECTION, format!("`{key}` has no direction, its length is zero"))
                    .at(raw.span.clone(), ""),
            );
        }
        unit
    }

    /// A list of texts.
    pub(super) fn words(&mut self, raw: &RawValue, key: &str) -> Vec<Spanned<String>> {
        let Some(items) = self.list(raw, key, "a list of names") else {
            return Vec::new();
        };
        let mut words = Vec::new();
        for item in items {
            match item.as_text() {
                Some("") => self.diagnostics.push(unusable("", item.span.clone())),
                Some(text) => words.push(Spanned::new(text.to_owned(), item.span.clone())),
                None => self.wrong_type(key, "a list of names", item),
            }
        }
        words
    }

    /// The tables of `[[key]]`.
    pub(super) fn records<'t>(&mut self, root: &'t RawTable, key: &str) -> Vec<Record<'t>> {
        let Some(raw) = root.get(key) else {
            return Vec::new();
        };
        let tables = match &raw.kind {
            RawKind::Array(items) => items.as_slice(),
            RawKind::Table(_) => {
                self.diagnostics.push(
                    Diagnostic::error(codes::WRONG_TYPE, format!("`{key}` must be a list of tables"))
                        .at(raw.span.clone(), "this is a single table")
                        .help(format!("write `[[{key}]]` with double brackets")),
                );
                return Vec::new();
            }
            _ => {
                self.wrong_type(key, &format!("a list of tables `[[{key}]]`"), raw);
                return Vec::new();
            }
        };
        let mut records = Vec::new();
        for item in tables {
            let Some(table) = item.as_table() else {
                self.wrong_type(key, "a list of tables", item);
                continue;
            };
            let name = table.get("name").and_then(RawValue::as_text);
            let what = match name {
                Some(name) if !name.is_empty() => format!("{key} `{name}`"),
                _ => format!("this {key}"),
            };
            records.push(Record { table, what });
        }
        records
    }

    /// The table of `[key]`, if it is there.
    pub(super) fn section<'t>(&mut self, root: &'t RawTable, key: &str) -> Option<Record<'t>> {
        let raw = root.get(key)?;
        let Some(table) = raw.as_table() else {
            self.wrong_type(key, &format!("a table `[{key}]`"), raw);
            return None;
        };
        Some(Record { table, what: format!("`[{key}]`") })
    }

    /// The name of a record: there, not empty, made of letters of ASCII, digits, `_`, `-` and the characters of
    /// `more`.
    pub(super) fn name(&mut self, record: &Record<'_>, more: &str) -> Option<Spanned<String>> {
        if record.table.get("name").is_none() {
            self.missing(record, "name");
        }
        let name = self.text(record, "name")?;
        let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-') || more.contains(c);
        if name.value.is_empty() || !name.value.chars().all(allowed) {
            let blank = if more.contains(' ') { "" } else { ", not blanks" };
            let help = format!("a name has letters from a to z, capital or not, digits, `_` and `-`{blank}");
            self.diagnostics.push(unusable(&name.value, name.span).help(help));
            return None;
        }
        Some(name)
    }
}

/// Names given so far, to find those given twice.
#[derive(Default)]
pub(super) struct NamesTaken {
    places: HashMap<String, Range<usize>>,
}

impl NamesTaken {
    /// Takes a name; reports it if it is taken already.
    pub(super) fn take(&mut self, name: &Spanned<String>, diagnostics: &mut Vec<Diagnostic>) {
        match self.places.get(&name.value) {
            Some(first) => diagnostics.push(
                Diagnostic::error(codes::DUPLICATE_NAME, format!("the name `{}` is given twice", name.value))
                    .at(name.span.clone(), "given again here")
                    .context(first.clone(), "first given here"),
            ),
            None => {
                self.places.insert(name.value.clone(), name.span.clone());
            }
        }
    }
}

/// The unit vector of that direction; `None` for zero.
pub(super) fn normalised<const N: usize>(vector: [f64; N]) -> Option<[f64; N]> {
    // Scaled first: squares of very large or small components leave the range of numbers.
    let largest = vector.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if largest == 0.0 {
        return None;
    }
    let scaled = vector.map(|x| x / largest);
    let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    Some(scaled.map(|x| x / length))
}
