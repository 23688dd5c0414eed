//! `release` of a `[[joint]]` or a `[[force]]`: when it lets go of its bodies, for good.

use std::ops::Range;

use super::dimension::Dimension;
use super::raw::{RawKind, RawValue, Spanned};
use super::reader::{Reader, Record};
use odyn_diagnostics::{Diagnostic, codes};

/// The key of the element.
pub(super) const RELEASE_KEY: &str = "release";

/// Its keys.
pub(super) const KEYS: &[&str] = &["when", "above", "below", "at"];

/// When an element is released: `{ when = "tension", above = "30 N" }`, `{ at = "1 s" }`.
#[derive(Clone, Debug, PartialEq)]
pub struct ReleaseRecord {
    /// What decides.
    pub when: ReleaseWhen,
    /// Byte range of the table.
    pub span: Range<usize>,
}

/// What decides whether an element is released.
#[derive(Clone, Debug, PartialEq)]
pub enum ReleaseWhen {
    /// The time, s.
    At(f64),
    /// A signal that leaves a range. Bounds are quantities of its dimension: see [`super::Scene::quantity`].
    Signal {
        /// Its name: that of an output or an input, or `ELEMENT.CHANNEL`. Not resolved here.
        name: Spanned<String>,
        /// It is not let past this upwards.
        above: Option<RawValue>,
        /// It is not let past this downwards.
        below: Option<RawValue>,
    },
}

/// Reads the table of an element.
pub(super) fn read(element: &Record<'_>, reader: &mut Reader<'_>) -> Option<ReleaseRecord> {
    let raw = element.table.get(RELEASE_KEY)?;
    let Some(table) = raw.as_table() else {
        reader.wrong_type(
            RELEASE_KEY,
            "a table such as `{ when = \"tension\", above = \"30 N\" }` or `{ at = \"1 s\" }`",
            raw,
        );
        return None;
    };
    let record = Record { table, what: format!("`{RELEASE_KEY}` of {}", element.what) };
    reader.check_keys(&record, KEYS);
    let when = read_when(&record, reader)?;
    Some(ReleaseRecord { when, span: raw.span.clone() })
}

fn read_when(record: &Record<'_>, reader: &mut Reader<'_>) -> Option<ReleaseWhen> {
    let at = reader.optional(record, "at", Dimension::TIME);
    if record.table.get("at").is_some() {
        for key in ["when", "above", "below"] {
            reader.exclusive(record, "at", key);
        }
        return at.map(|at| ReleaseWhen::At(at.value));
    }
    let name = reader.required_word(record, "when");
    let mut bound = |key: &str| {
        let raw = record.table.get(key)?;
        let is_one = matches!(raw.kind, RawKind::Number(_) | RawKind::Integer(_) | RawKind::Text(_));
        if !is_one {
            reader.wrong_type(key, "a quantity", raw);
        }
        is_one.then(|| raw.clone())
    };
    let (above, below) = (bound("above"), bound("below"));
    if record.table.get("above").is_none() && record.table.get("below").is_none() {
        reader.diagnostics.push(
            Diagnostic::error(codes::MISSING_KEY, format!("{} has neither `above` nor `below`", record.what))
                .at(record.table.span.clone(), "")
                .help("above = \"30 N\"   # lets go as soon as the signal exceeds this; `below`: falls short of it"),
        );
        return None;
    }
    let name = name?;
    (above.is_some() || below.is_some()).then_some(ReleaseWhen::Signal { name, above, below })
}
