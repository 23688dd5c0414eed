//! Values as written: TOML with byte ranges, before anything is known of their meaning.

use super::quantity::Quantity;
use super::slips;
use odyn_diagnostics::{Diagnostic, Source, codes};
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Deepest nesting of tables and lists.
pub(super) const DEEPEST: usize = 100;

/// A value with the byte range it was written at.
#[derive(Clone, Debug, PartialEq)]
pub struct Spanned<T> {
    /// The value.
    pub value: T,
    /// Byte range in the scene's [`Source`].
    pub span: Range<usize>,
}

impl<T> Spanned<T> {
    /// A value at a byte range.
    pub fn new(value: T, span: Range<usize>) -> Self {
        Spanned { value, span }
    }
}

/// A value whose meaning a later room decides.
#[derive(Clone, Debug, PartialEq)]
pub struct RawValue {
    /// Byte range of the value; of the header for a table with a header.
    pub span: Range<usize>,
    /// What is written there.
    pub kind: RawKind,
}

/// Kinds of values.
#[derive(Clone, Debug, PartialEq)]
pub enum RawKind {
    /// A number with a point or exponent; always finite.
    Number(f64),
    /// A whole number.
    Integer(i64),
    /// `true` or `false`.
    Bool(bool),
    /// A number with a unit, of a file.
    Quantity(Quantity),
    /// A text, which may be an expression.
    Text(String),
    /// A list.
    Array(Vec<RawValue>),
    /// A table, inline or with a header.
    Table(RawTable),
}

/// Keys and values in the order of the text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawTable {
    /// Byte range of the header or of the inline table.
    pub span: Range<usize>,
    /// Keys, each once, with their values.
    pub entries: Vec<(Spanned<String>, RawValue)>,
}

impl RawKind {
    /// How a message names the value: `a number`, `a text`, ...
    pub fn describe(&self) -> &'static str {
        match self {
            RawKind::Number(_) => "a number",
            RawKind::Integer(_) => "a whole number",
            RawKind::Bool(_) => "true or false",
            RawKind::Quantity(_) => "a quantity",
            RawKind::Text(_) => "a text",
            RawKind::Array(_) => "a list",
            RawKind::Table(_) => "a table",
        }
    }
}

impl RawValue {
    /// The text, if it is one.
    pub fn as_text(&self) -> Option<&str> {
        match &self.kind {
            RawKind::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The list, if it is one.
    pub fn as_array(&self) -> Option<&[RawValue]> {
        match &self.kind {
            RawKind::Array(items) => Some(items),
            _ => None,
        }
    }

    /// The table, if it is one.
    pub fn as_table(&self) -> Option<&RawTable> {
        match &self.kind {
            RawKind::Table(table) => Some(table),
            _ => None,
        }
    }
}

impl RawTable {
    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&RawValue> {
        self.entry(key).map(|(_, value)| value)
    }

    /// A key as written, with its value.
    pub fn entry(&self, key: &str) -> Option<&(Spanned<String>, RawValue)> {
        self.entries.iter().find(|(own, _)| own.value == key)
    }

    /// True without any key.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    pub(super) fn get_mut(&mut self, key: &str) -> Option<&mut RawValue> {
        self.entries.iter_mut().find(|(own, _)| own.value == key).map(|(_, value)| value)
    }

    /// Sets a key, whether it is there or not.
    pub(super) fn set(&mut self, key: Spanned<String>, value: RawValue) {
        match self.entries.iter_mut().find(|(own, _)| own.value == key.value) {
            Some(entry) => *entry = (key, value),
            None => self.entries.push((key, value)),
        }
    }
}

/// Parses the text of a scene; values that no scene can have (dates, `inf`) go to `diagnostics` and are
/// replaced.
///
/// # Errors
/// All places where it is not TOML, or too deep nesting: then nothing sensible can be read.
pub(super) fn parse_document(source: &Source, diagnostics: &mut Vec<Diagnostic>) -> Result<RawTable, Vec<Diagnostic>> {
    let (document, errors) = DeTable::parse_recoverable(&source.text);
    let document = shallow(DeValue::Table(document.into_inner()), 0).map_err(|deep| vec![deep])?;
    if !errors.is_empty() {
        return Err(syntax_errors(&errors, &source.text));
    }
    let table = convert(&document, 0..0, 0, diagnostics);
    match table.kind {
        RawKind::Table(table) => Ok(table),
        _ => unreachable!("a document is a table"),
    }
}

/// Parses the value of a `--set`: as TOML if it is TOML, else as text. `start` is the offset of the value in
/// the common numbering of the source.
pub(super) fn parse_value(text: &str, start: usize, diagnostics: &mut Vec<Diagnostic>) -> RawValue {
    let as_text = || RawValue { span: start..start + text.len(), kind: RawKind::Text(text.to_owned()) };
    let Ok(value) = DeValue::parse(text) else {
        return as_text();
    };
    let span = value.span();
    match shallow(value.into_inner(), start) {
        Ok(value) => convert(&value, span, start, diagnostics),
        Err(deep) => {
            diagnostics.push(deep);
            as_text()
        }
    }
}

fn syntax_errors(errors: &[toml::de::Error], text: &str) -> Vec<Diagnostic> {
    errors
        .iter()
        .map(|error| {
            let span = error.span().unwrap_or(text.len()..text.len());
            let code = match error.message() {
                message if message.contains("duplicate key") => codes::DUPLICATE_KEY,
                message if message.contains("recurs") => codes::TOO_DEEP,
                _ => codes::SYNTAX,
            };
            let message = error.message().trim();
            let help = slips::remedy(text, &span, message);
            Diagnostic::error(code, message).at(span, "").help_if(help)
        })
        .collect()
}

/// The value, unless it is nested too deeply. The parser limits each key and each bracket to 80 levels, but
/// keys inside of brackets together reach thousands, at which recursion overflows the stack, even that of
/// dropping the value.
fn shallow(value: DeValue<'_>, start: usize) -> Result<DeValue<'_>, Diagnostic> {
    let Some(deep) = too_deep(&value) else {
        return Ok(value);
    };
    dismantle(value);
    Err(Diagnostic::error(codes::TOO_DEEP, "this is nested too deeply")
        .at(shift(deep, start), format!("more than {DEEPEST} levels")))
}

/// A place that is nested deeper than allowed, if there is one.
fn too_deep(value: &DeValue<'_>) -> Option<Range<usize>> {
    let mut open: Vec<(usize, &DeValue<'_>, Range<usize>)> = vec![(0, value, 0..0)];
    while let Some((depth, value, span)) = open.pop() {
        if depth > DEEPEST {
            return Some(span);
        }
        match value {
            DeValue::Table(table) => {
                open.extend(table.iter().map(|(key, inner)| (depth + 1, inner.get_ref(), key.span())))
            }
            DeValue::Array(items) => open.extend(items.iter().map(|inner| (depth + 1, inner.get_ref(), inner.span()))),
            _ => {}
        }
    }
    None
}

/// Drops a value without recursion.
fn dismantle(value: DeValue<'_>) {
    let mut open: Vec<DeValue<'_>> = vec![value];
    while let Some(value) = open.pop() {
        match value {
            DeValue::Table(table) => {
                open.extend(table.into_iter().map(|(_, inner)| inner.into_inner()));
            }
            DeValue::Array(items) => {
                open.extend(items.into_iter().map(toml::Spanned::into_inner));
            }
            _ => {}
        }
    }
}

fn convert_table(table: &DeTable<'_>, span: Range<usize>, start: usize, diagnostics: &mut Vec<Diagnostic>) -> RawTable {
    let mut entries: Vec<(Spanned<String>, RawValue)> = table
        .iter()
        .map(|(key, value)| {
            let key = Spanned::new(key.get_ref().to_string(), shift(key.span(), start));
            let value = convert(value.get_ref(), value.span(), start, diagnostics);
            (key, value)
        })
        .collect();
    // The parser sorts by name; people read by line.
    entries.sort_by_key(|(key, _)| key.span.start);
    RawTable { span, entries }
}

/// Recursion is as deep as the nesting, which [`shallow`] has limited.
fn convert(value: &DeValue<'_>, span: Range<usize>, start: usize, diagnostics: &mut Vec<Diagnostic>) -> RawValue {
    let span = shift(span, start);
    let kind = match value {
        DeValue::String(text) => RawKind::Text(text.to_string()),
        DeValue::Boolean(value) => RawKind::Bool(*value),
        DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(value) => RawKind::Integer(value),
            Err(_) => finite(number.as_str().parse(), &span, diagnostics),
        },
        DeValue::Float(number) => finite(number.as_str().parse(), &span, diagnostics),
        DeValue::Datetime(_) => {
            diagnostics.push(
                Diagnostic::error(codes::WRONG_TYPE, "dates have no meaning in a scene")
                    .at(span.clone(), "this is a date or a time of day")
                    .help("write a text in quotes, or a quantity such as \"5 min\""),
            );
            RawKind::Integer(0)
        }
        DeValue::Array(items) => {
            RawKind::Array(items.iter().map(|item| convert(item.get_ref(), item.span(), start, diagnostics)).collect())
        }
        DeValue::Table(table) => RawKind::Table(convert_table(table, span.clone(), start, diagnostics)),
    };
    RawValue { span, kind }
}

fn finite(
    parsed: Result<f64, std::num::ParseFloatError>,
    span: &Range<usize>,
    diagnostics: &mut Vec<Diagnostic>,
) -> RawKind {
    match parsed {
        Ok(value) if value.is_finite() => RawKind::Number(value),
        _ => {
            diagnostics.push(
                Diagnostic::error(codes::NOT_FINITE, "this is not a finite number")
                    .at(span.clone(), "")
                    .help("where a limit is optional, leave the key out instead"),
            );
            // Errors keep the scene from being used; until then the value must not cause further ones.
            RawKind::Number(1.0)
        }
    }
}

fn shift(span: Range<usize>, start: usize) -> Range<usize> {
    span.start + start..span.end + start
}
