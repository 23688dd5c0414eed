//! `[verification]` and `[[check]]`.

use super::dimension::Dimension;
use super::formula::Formula;
use super::raw::{RawKind, RawTable, RawValue, Spanned};
use super::reader::{NamesTaken, Reader, Record};
use super::record::{
    AnalysisRecord, CheckKind, CheckRecord, Expected, NumberRecord, OutputRecord, Reference, VerificationRecord,
};
use odyn_diagnostics::{Diagnostic, codes, help_for};
use serde_json::Value;
use std::collections::HashSet;
use std::path::PathBuf;

pub(super) const CHECK_KEYS: &[&str] = &["name", "kind", "value", "reference", "tolerance", "from", "to"];

pub(super) const VERIFICATION_KEYS: &[&str] = &["elements", "text", "analysis", "options", "number"];

pub(super) const NUMBER_KEYS: &[&str] = &["name", "of", "reference", "tolerance", "equals", "unit"];

pub(super) const KINDS: [CheckKind; 8] = [
    CheckKind::Position,
    CheckKind::Velocity,
    CheckKind::Acceleration,
    CheckKind::Orientation,
    CheckKind::ReactionForce,
    CheckKind::ReactionTorque,
    CheckKind::Energy,
    CheckKind::Other,
];

/// Reads `[verification]`.
pub(super) fn read_verification(root: &RawTable, reader: &mut Reader<'_>) -> Option<VerificationRecord> {
    let record = reader.section(root, "verification")?;
    reader.check_keys(&record, VERIFICATION_KEYS);
    let elements = match record.table.get("elements") {
        Some(raw) => reader.words(raw, "elements"),
        None => {
            reader.missing(&record, "elements");
            Vec::new()
        }
    };
    let analysis = read_analysis(&record, reader);
    let mut names = NamesTaken::default();
    let mut numbers = Vec::new();
    for number in reader.records(record.table, "number") {
        numbers.extend(read_number(&number, &mut names, reader));
    }
    for key in ["options", "number"] {
        if let Some((key, _)) = record.table.entry(key).filter(|_| record.table.get("analysis").is_none()) {
            let message = format!("`{}` is of an analysis, and `[verification]` names none", key.value);
            let mistake = Diagnostic::error(codes::MISSING_KEY, message).at(key.span.clone(), "");
            reader.diagnostics.push(mistake.help("add `analysis`, such as `analysis = \"modes\"`"));
        }
    }
    if analysis.is_some() && record.table.get("number").is_none() {
        reader.missing(&record, "number");
    }
    let text = reader.required_word(&record, "text")?;
    Some(VerificationRecord { elements, text: text.value, analysis, numbers, span: record.table.span.clone() })
}

fn read_analysis(record: &Record<'_>, reader: &mut Reader<'_>) -> Option<AnalysisRecord> {
    let name = reader.word(record, "analysis")?;
    let mut question = serde_json::Map::new();
    question.insert("analysis".into(), name.value.into());
    if let Some(raw) = record.table.get("options") {
        let Some(table) = raw.as_table() else {
            reader.wrong_type("options", "a table of options", raw);
            return None;
        };
        for (key, value) in &table.entries {
            question.insert(key.value.clone(), plain(&key.value, value, reader)?);
        }
    }
    Some(AnalysisRecord { question: question.into(), span: name.span })
}

/// A value as it is written.
fn plain(key: &str, raw: &RawValue, reader: &mut Reader<'_>) -> Option<Value> {
    match &raw.kind {
        RawKind::Number(number) => Some((*number).into()),
        RawKind::Integer(number) => Some((*number).into()),
        RawKind::Bool(flag) => Some((*flag).into()),
        RawKind::Text(text) => Some(text.clone().into()),
        RawKind::Array(list) => list.iter().map(|one| plain(key, one, reader)).collect(),
        RawKind::Quantity(_) | RawKind::Table(_) => {
            reader.wrong_type(key, "a number, a text, or a list of these", raw);
            None
        }
    }
}

fn read_number(record: &Record<'_>, names: &mut NamesTaken, reader: &mut Reader<'_>) -> Option<NumberRecord> {
    reader.check_keys(record, NUMBER_KEYS);
    let name = reader.required_word(record, "name");
    if let Some(name) = &name {
        names.take(name, &mut reader.diagnostics);
    }
    let of = reader.required_word(record, "of");
    let unit = reader.text(record, "unit").map(|unit| unit.value).unwrap_or_default();
    let expected = if record.table.get("equals").is_some() {
        for key in ["reference", "tolerance"] {
            reader.exclusive(record, "equals", key);
        }
        Expected::Word(reader.word(record, "equals")?.value)
    } else {
        for key in ["reference", "tolerance"] {
            if record.table.get(key).is_none() {
                reader.missing(record, key);
            }
        }
        let raw = record.table.get("reference");
        let reference = raw.and_then(|raw| read_formula(raw, &HashSet::new(), reader));
        if let (Some(reference), Some(raw)) = (&reference, raw)
            && !reference.names().is_empty()
        {
            let message = "the number of an analysis does not depend on the time".to_owned();
            reader.diagnostics.push(Diagnostic::error(codes::UNKNOWN_PARAMETER, message).at(raw.span.clone(), ""));
            return None;
        }
        let tolerance = not_negative(record, reader);
        Expected::Value { reference: reference?, tolerance: tolerance? }
    };
    Some(NumberRecord { name: name?, of: of?, expected, unit })
}

fn not_negative(record: &Record<'_>, reader: &mut Reader<'_>) -> Option<f64> {
    let tolerance = reader.optional(record, "tolerance", Dimension::DIMENSIONLESS)?;
    if tolerance.value < 0.0 {
        reader.out_of_range("`tolerance` must not be negative".to_owned(), tolerance.span.clone(), "");
    }
    Some(tolerance.value)
}

/// Reads all checks.
pub(super) fn read_checks(root: &RawTable, outputs: &[OutputRecord], reader: &mut Reader<'_>) -> Vec<CheckRecord> {
    let outputs: HashSet<&str> = outputs.iter().map(|output| output.name.value.as_str()).collect();
    let mut names = NamesTaken::default();
    let mut checks = Vec::new();
    for record in reader.records(root, "check") {
        checks.extend(read_check(&record, &outputs, &mut names, reader));
    }
    checks
}

fn read_check(
    record: &Record<'_>,
    outputs: &HashSet<&str>,
    names: &mut NamesTaken,
    reader: &mut Reader<'_>,
) -> Option<CheckRecord> {
    reader.check_keys(record, CHECK_KEYS);
    for key in ["name", "kind", "value", "reference", "tolerance"] {
        if record.table.get(key).is_none() {
            reader.missing(record, key);
        }
    }
    let name = reader.word(record, "name");
    if let Some(name) = &name {
        names.take(name, &mut reader.diagnostics);
    }
    let kind = read_kind(record, reader);
    let value = record.table.get("value").and_then(|raw| read_formula(raw, outputs, reader));
    let reference = record.table.get("reference").and_then(|raw| read_reference(raw, outputs, reader));
    let tolerance = not_negative(record, reader);
    let mut time = |key: &str| {
        let si = reader.optional(record, key, Dimension::TIME)?;
        Some(Spanned::new(reader.scope.units.from_si(si.value, Dimension::TIME), si.span))
    };
    let (from, to) = (time("from"), time("to"));
    if let (Some(from), Some(to)) = (&from, &to)
        && to.value < from.value
    {
        reader.out_of_range("`to` must not be before `from`".to_owned(), to.span.clone(), "");
    }
    Some(CheckRecord {
        name: name?,
        kind: kind?,
        value: value?,
        reference: reference?,
        tolerance: tolerance?,
        from: from.map(|time| time.value),
        to: to.map(|time| time.value),
        span: record.table.span.clone(),
    })
}

fn read_kind(record: &Record<'_>, reader: &mut Reader<'_>) -> Option<CheckKind> {
    let word = reader.word(record, "kind")?;
    let found = KINDS.into_iter().find(|kind| kind.word() == word.value);
    if found.is_none() {
        let known = KINDS.map(CheckKind::word);
        reader.diagnostics.push(
            Diagnostic::error(codes::UNKNOWN_WORD, format!("`kind` cannot be `{}`", word.value))
                .at(word.span, "")
                .help_if(help_for(&word.value, &known, "words")),
        );
    }
    found
}

fn read_formula(raw: &RawValue, outputs: &HashSet<&str>, reader: &mut Reader<'_>) -> Option<Formula> {
    match Formula::read(raw, outputs, &reader.scope) {
        Ok(formula) => Some(formula),
        Err(diagnostic) => {
            reader.diagnostics.extend(diagnostic);
            None
        }
    }
}

fn read_reference(raw: &RawValue, outputs: &HashSet<&str>, reader: &mut Reader<'_>) -> Option<Reference> {
    let Some(table) = raw.as_table() else {
        return read_formula(raw, outputs, reader).map(Reference::Formula);
    };
    let record = Record { table, what: "this reference".to_owned() };
    reader.check_keys(&record, &["csv", "column"]);
    let path = reader.required_word(&record, "csv");
    let column = reader.required_word(&record, "column");
    let path = path?;
    Some(Reference::Csv { path: Spanned::new(PathBuf::from(path.value), path.span), column: column?.value })
}
