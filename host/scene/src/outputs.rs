//! `[[output]]` and `[[figure]]`.

use super::dimension::Dimension;
use super::raw::{RawTable, Spanned};
use super::reader::{NamesTaken, Reader, Record};
use super::record::{Crossing, FigureRecord, OutputRecord, Take};
use odyn_diagnostics::{Diagnostic, codes, help_for};

pub(super) const OUTPUT_KEYS: &[&str] = &["name", "quantity", "of", "component", "on", "point", "frame", "channel"];

pub(super) const FIGURE_KEYS: &[&str] =
    &["name", "channel", "take", "abs", "where", "equals", "period", "over", "from", "published", "unit", "note"];

pub(super) const TAKES: [(&str, Take); 7] = [
    ("at", Take::At),
    ("peak", Take::Peak),
    ("min", Take::Min),
    ("max", Take::Max),
    ("final", Take::Final),
    ("mean", Take::Mean),
    ("rms", Take::Rms),
];

/// The column of times.
const TIME_NAME: &str = "t";

/// Characters of figure names besides those of all names: they are printed, never referred to.
const FIGURE_NAME: &str = " .,:;/|()[]+=*^%'°";

/// Reads all outputs; `names` are those of signals.
pub(super) fn read_outputs(root: &RawTable, names: &mut NamesTaken, reader: &mut Reader<'_>) -> Vec<OutputRecord> {
    let mut outputs = Vec::new();
    for record in reader.records(root, "output") {
        outputs.extend(read_output(&record, names, reader));
    }
    outputs
}

fn read_output(record: &Record<'_>, names: &mut NamesTaken, reader: &mut Reader<'_>) -> Option<OutputRecord> {
    reader.check_keys(record, OUTPUT_KEYS);
    let name = reader.name(record, ".");
    if let Some(name) = &name {
        names.take(name, &mut reader.diagnostics);
        if name.value == TIME_NAME {
            reader.diagnostics.push(
                Diagnostic::error(codes::BAD_NAME, format!("an output cannot be called `{TIME_NAME}`"))
                    .at(name.span.clone(), "the column of times in the results has this name")
                    .help("choose another name, for example `torque`"),
            );
        }
    }
    let quantity = reader.required_word(record, "quantity");
    let of = reader.word(record, "of");
    let component = reader.word(record, "component");
    let on = reader.word(record, "on");
    let point = record.table.get("point").and_then(|raw| {
        let vector = reader.quantities(raw, "point", Dimension::LENGTH)?;
        Some(Spanned::new(vector, raw.span.clone()))
    });
    let frame = reader.word(record, "frame");
    let channel = reader.word(record, "channel");
    Some(OutputRecord {
        name: name?,
        quantity: quantity?,
        of,
        component,
        on,
        point,
        frame,
        channel,
        span: record.table.span.clone(),
    })
}

/// Reads all figures.
pub(super) fn read_figures(root: &RawTable, reader: &mut Reader<'_>) -> Vec<FigureRecord> {
    let mut names = NamesTaken::default();
    let mut figures = Vec::new();
    for record in reader.records(root, "figure") {
        figures.extend(read_figure(&record, &mut names, reader));
    }
    figures
}

fn read_figure(record: &Record<'_>, names: &mut NamesTaken, reader: &mut Reader<'_>) -> Option<FigureRecord> {
    reader.check_keys(record, FIGURE_KEYS);
    let name = reader.name(record, FIGURE_NAME);
    if let Some(name) = &name {
        names.take(name, &mut reader.diagnostics);
    }
    let channel = reader.required_word(record, "channel");
    let take = read_take(record, reader);
    let at = read_crossing(record, take, reader);
    let absolute = reader.flag(record, "abs", false);
    let over = reader.word(record, "over");
    let from = reader.optional(record, "from", Dimension::TIME);
    let published = reader.optional(record, "published", Dimension::DIMENSIONLESS);
    let unit = reader.text(record, "unit");
    let note = reader.text(record, "note");
    Some(FigureRecord {
        name: name?,
        channel: channel?,
        take: take?,
        absolute,
        at,
        over,
        from: from.map(|time| time.value),
        published: published.map(|number| number.value),
        unit: unit.unwrap_or_else(|| Spanned::new(String::new(), record.table.span.clone())),
        note: note.map(|text| text.value).unwrap_or_default(),
        span: record.table.span.clone(),
    })
}

fn read_take(record: &Record<'_>, reader: &mut Reader<'_>) -> Option<Take> {
    let word = reader.required_word(record, "take")?;
    let found = TAKES.iter().find(|(known, _)| *known == word.value);
    if found.is_none() {
        let known = TAKES.map(|(word, _)| word);
        reader.diagnostics.push(
            Diagnostic::error(codes::UNKNOWN_WORD, format!("`take` cannot be `{}`", word.value))
                .at(word.span, "")
                .help_if(help_for(&word.value, &known, "words")),
        );
    }
    found.map(|(_, take)| *take)
}

/// `where`, `equals` and `period` belong together, and to `take = "at"`.
fn read_crossing(record: &Record<'_>, take: Option<Take>, reader: &mut Reader<'_>) -> Option<Crossing> {
    let needed = take == Some(Take::At);
    if take.is_some() && !needed {
        for key in ["where", "equals", "period"] {
            if let Some((written, _)) = record.table.entry(key) {
                reader.diagnostics.push(
                    Diagnostic::error(
                        codes::CONFLICTING_KEYS,
                        format!("`{key}` has a meaning only with `take = \"at\"`"),
                    )
                    .at(written.span.clone(), ""),
                );
            }
        }
        return None;
    }
    if needed {
        for key in ["where", "equals"] {
            if record.table.get(key).is_none() {
                reader.missing(record, key);
            }
        }
    }
    Some(Crossing {
        channel: reader.word(record, "where")?,
        equals: record.table.get("equals")?.clone(),
        period: record.table.get("period").cloned(),
    })
}
