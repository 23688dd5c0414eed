//! `[[joint]]`, `[[force]]` and `[[control]]`. What a type needs is not known here: neither the type, nor its
//! parameters, nor the number of bodies and frames are checked.

use super::bodies::check_not_ground;
use super::dimension::Dimension;
use super::raw::{RawKind, RawTable, RawValue, Spanned};
use super::reader::{NamesTaken, Reader, Record};
use super::record::{ElementKind, ElementRecord, InputRecord, InputSource, LocalFrame, Placement};
use super::release::{self, RELEASE_KEY};
use super::rotation::{are_parallel, parallel};
use odyn_diagnostics::{Diagnostic, codes, help_for, suggest};

pub(super) const KEYS: &[&str] = &[
    "name", "type", "bodies", "point", "points", "axis", "axes", "x_axis", "x_axes", "frames", "params", "inputs",
    "enabled",
];

/// Key of elements that depend on reactions, which no joint does.
pub(super) const JOINTS_KEY: &str = "joints";

/// Keys of a frame in the frame of a body.
pub(super) const FRAME_KEYS: &[&str] = &["position", "axis", "x_axis"];

/// Keys that place an element in ground, each with the one that gives it per frame.
const GLOBAL_KEYS: [(&str, &str); 3] = [("point", "points"), ("axis", "axes"), ("x_axis", "x_axes")];

/// Reads all elements; one without usable name or type is left out, which has been reported.
pub(super) fn read(root: &RawTable, names: &mut NamesTaken, reader: &mut Reader<'_>) -> Vec<ElementRecord> {
    let mut elements = Vec::new();
    for kind in [ElementKind::Joint, ElementKind::Force, ElementKind::Control] {
        for record in reader.records(root, kind.key()) {
            elements.extend(read_element(kind, &record, names, reader));
        }
    }
    elements.shrink_to_fit();
    elements
}

fn read_element(
    kind: ElementKind,
    record: &Record<'_>,
    names: &mut NamesTaken,
    reader: &mut Reader<'_>,
) -> Option<ElementRecord> {
    check_keys(kind, record, reader);
    let name = reader.name(record, "");
    if let Some(name) = &name {
        check_not_ground(name, reader);
        names.take(name, &mut reader.diagnostics);
    }
    let type_name = reader.required_word(record, "type");
    let bodies = match record.table.get("bodies") {
        Some(raw) => Spanned::new(reader.words(raw, "bodies"), raw.span.clone()),
        None => {
            // A force that reads a joint's reaction acts between the bodies of that joint.
            let follows = kind == ElementKind::Force && record.table.get("joints").is_some();
            if kind != ElementKind::Control && !follows {
                reader.missing(record, "bodies");
            }
            Spanned::new(Vec::new(), record.table.span.clone())
        }
    };
    let joints = match record.table.get("joints") {
        Some(raw) if kind != ElementKind::Joint => reader.words(raw, "joints"),
        _ => Vec::new(),
    };
    let inputs = match record.table.get("inputs") {
        Some(raw) => read_inputs(raw, reader),
        None => Vec::new(),
    };
    let release = if kind == ElementKind::Control { None } else { release::read(record, reader) };
    let placement = read_placement(record, reader);
    let params = read_params(record, reader);
    let enabled = reader.flag(record, "enabled", true);
    Some(ElementRecord {
        kind,
        name: name?,
        type_name: type_name?,
        bodies,
        joints,
        inputs,
        release,
        placement,
        params,
        span: record.table.span.clone(),
        enabled,
    })
}

/// Keys of an input that is a signal times a quantity.
pub(super) const SCALED_KEYS: &[&str] = &["signal", "gain"];

/// Joints and controls have no use for a key that forces have: the ones take no reactions, the others hold nothing.
fn check_keys(kind: ElementKind, record: &Record<'_>, reader: &mut Reader<'_>) {
    let (foreign, help) = match kind {
        ElementKind::Joint => (JOINTS_KEY, "a joint takes no reactions; `[[force]]` and `[[control]]` do"),
        ElementKind::Control => (RELEASE_KEY, "joints and forces let go; a control acts on no body"),
        ElementKind::Force => ("", ""),
    };
    let (misplaced, entries): (Vec<_>, Vec<_>) =
        record.table.entries.iter().cloned().partition(|(key, _)| key.value == foreign);
    for (key, _) in misplaced {
        let message = format!("{} cannot have `{foreign}`", record.what);
        reader.diagnostics.push(Diagnostic::error(codes::UNKNOWN_KEY, message).at(key.span, "").help(help));
    }
    let own = [JOINTS_KEY, RELEASE_KEY].into_iter().filter(|key| *key != foreign);
    let known: Vec<&str> = KEYS.iter().copied().chain(own).collect();
    // What is like none of the keys is most probably a parameter.
    let is_like_none = |key: &str| !known.contains(&key) && suggest(key, known.iter().copied()).is_none();
    let (parameters, entries): (Vec<_>, Vec<_>) = entries.into_iter().partition(|(key, _)| is_like_none(&key.value));
    for (Spanned { value: key, span }, _) in parameters {
        let message = format!("unknown key `{key}` in {}", record.what);
        let of_type = record.table.get("type").and_then(RawValue::as_text).unwrap_or("TYPE");
        let help = match key.as_str() {
            "parameters" | "parameter" | "properties" => "parameters stand under `params`".to_owned(),
            _ => format!(
                "if it is a parameter, it stands under `params`: `params.{key}`; `odyn elements describe {of_type}` lists them"
            ),
        };
        let keys = help_for(&key, &known, "keys");
        reader.diagnostics.push(Diagnostic::error(codes::UNKNOWN_KEY, message).at(span, "").help(help).help_if(keys));
    }
    let table = RawTable { span: record.table.span.clone(), entries };
    reader.check_keys(&Record { table: &table, what: record.what.clone() }, &known);
}

/// A text that could be the name of a signal is one, unless it has a value as an expression.
fn read_inputs(raw: &RawValue, reader: &mut Reader<'_>) -> Vec<InputRecord> {
    let Some(table) = raw.as_table() else {
        reader.wrong_type("inputs", "a table such as `{ speed = \"omega\" }`", raw);
        return Vec::new();
    };
    let mut inputs = Vec::new();
    for (name, value) in &table.entries {
        let source = match &value.kind {
            RawKind::Number(_) | RawKind::Integer(_) => InputSource::Value(value.clone()),
            RawKind::Text(text) if is_signal_name(text) && reader.scope.any_quantity(value).is_err() => {
                InputSource::Reference(text.clone())
            }
            RawKind::Text(_) => InputSource::Value(value.clone()),
            RawKind::Table(_) => match read_scaled(&name.value, value, reader) {
                Some(source) => source,
                None => continue,
            },
            _ => {
                reader.wrong_type(&name.value, "the name of a signal or a constant", value);
                continue;
            }
        };
        inputs.push(InputRecord { name: name.clone(), source: Spanned::new(source, value.span.clone()) });
    }
    inputs
}

/// A signal times a quantity: `{ signal = "pid.output", gain = "20 N" }`.
fn read_scaled(name: &str, raw: &RawValue, reader: &mut Reader<'_>) -> Option<InputSource> {
    let record = Record { table: raw.as_table()?, what: format!("the input `{name}`") };
    reader.check_keys(&record, SCALED_KEYS);
    let signal = reader.required_word(&record, "signal");
    let Some(gain) = record.table.get("gain") else {
        reader.missing(&record, "gain");
        return None;
    };
    if !matches!(gain.kind, RawKind::Number(_) | RawKind::Integer(_) | RawKind::Text(_)) {
        reader.wrong_type("gain", "a quantity", gain);
        return None;
    }
    Some(InputSource::Scaled { signal: signal?, gain: gain.clone() })
}

/// Names of outputs and elements, and `ELEMENT.CHANNEL`, that start like a name and not like a number.
fn is_signal_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.'))
}

fn read_params(record: &Record<'_>, reader: &mut Reader<'_>) -> RawTable {
    let empty = RawTable { span: record.table.span.clone(), entries: Vec::new() };
    let Some(raw) = record.table.get("params") else {
        return empty;
    };
    match raw.as_table() {
        Some(table) => table.clone(),
        None => {
            reader.wrong_type("params", "a table such as `{ stiffness = \"20 N/mm\" }`", raw);
            empty
        }
    }
}

fn read_placement(record: &Record<'_>, reader: &mut Reader<'_>) -> Spanned<Placement> {
    let global: Vec<&str> = GLOBAL_KEYS
        .iter()
        .flat_map(|(one, many)| [*one, *many])
        .filter(|key| record.table.get(key).is_some())
        .collect();
    if let Some(raw) = record.table.get("frames") {
        for key in &global {
            reader.exclusive(record, key, "frames");
        }
        let frames = read_frames(raw, record, reader);
        return Spanned::new(Placement::Local(frames), raw.span.clone());
    }
    let Some(first) = global.first().and_then(|key| record.table.get(key)) else {
        return Spanned::new(Placement::Absent, record.table.span.clone());
    };
    for (one, many) in GLOBAL_KEYS {
        reader.exclusive(record, one, many);
    }
    let points =
        each(record, GLOBAL_KEYS[0], reader, |raw, key, reader| reader.quantities(raw, key, Dimension::LENGTH));
    let axes = each(record, GLOBAL_KEYS[1], reader, |raw, key, reader| reader.direction(raw, key));
    let x_axes = each(record, GLOBAL_KEYS[2], reader, |raw, key, reader| reader.direction(raw, key));
    check_parallel(record, &axes, &x_axes, reader);
    Spanned::new(Placement::Global { points, axes, x_axes }, first.span.clone())
}

/// The vector of the first key, or the list of vectors of the second.
fn each(
    record: &Record<'_>,
    (one, many): (&str, &str),
    reader: &mut Reader<'_>,
    read: impl Fn(&RawValue, &str, &mut Reader<'_>) -> Option<[f64; 3]>,
) -> Vec<[f64; 3]> {
    if let Some(raw) = record.table.get(one) {
        return read(raw, one, reader).into_iter().collect();
    }
    let Some(raw) = record.table.get(many) else {
        return Vec::new();
    };
    let Some(items) = reader.list(raw, many, "a list of vectors") else {
        return Vec::new();
    };
    if items.is_empty() {
        reader.wrong_length(raw, many, "one vector per frame", 0);
    }
    if !items.is_empty() && items.iter().all(|item| item.as_array().is_none()) {
        let message = format!("`{many}` must be a list of vectors, one per frame, found one vector");
        reader.diagnostics.push(
            Diagnostic::error(codes::WRONG_TYPE, message)
                .at(raw.span.clone(), "this is one vector")
                .help(format!("`{one}` is the key of one vector for all frames")),
        );
        return Vec::new();
    }
    let bodies = record.table.get("bodies").and_then(RawValue::as_array).map_or(0, <[_]>::len);
    if items.len() == 1 && bodies > 1 {
        let message = format!("{} has 1 of `{many}` for {bodies} bodies", record.what);
        reader.diagnostics.push(
            Diagnostic::error(codes::BAD_PLACEMENT, message)
                .at(raw.span.clone(), format!("give {bodies}, one per body"))
                .help(format!("`{one}` is the key of one vector for all frames")),
        );
    }
    items.iter().filter_map(|item| read(item, many, reader)).collect()
}

/// Each x axis against the z axis of the same frame, one vector standing for all frames.
fn check_parallel(record: &Record<'_>, axes: &[[f64; 3]], x_axes: &[[f64; 3]], reader: &mut Reader<'_>) {
    let of_frame = |list: &[[f64; 3]], frame: usize| match list {
        [only] => Some(*only),
        _ => list.get(frame).copied(),
    };
    for frame in 0..axes.len().max(x_axes.len()) {
        let (Some(z), Some(x)) = (of_frame(axes, frame), of_frame(x_axes, frame)) else {
            continue;
        };
        if !are_parallel(z, x) {
            continue;
        }
        let found = ["x_axis", "x_axes"].into_iter().find_map(|key| Some((key, record.table.get(key)?)));
        if let Some((key, raw)) = found {
            reader.diagnostics.push(parallel(key, "axis", raw));
        }
        return;
    }
}

fn read_frames(raw: &RawValue, record: &Record<'_>, reader: &mut Reader<'_>) -> Vec<LocalFrame> {
    let expected = ("frames", "a list of tables, one per body");
    let Some(items) = reader.list(raw, expected.0, expected.1) else {
        return Vec::new();
    };
    let what = |index: usize| format!("frame {} of {}", index + 1, record.what);
    items.iter().enumerate().filter_map(|(index, item)| read_frame(item, what(index), expected, reader)).collect()
}

/// A frame in the frame of a body. `key` and `expected` are reported where it is no table.
pub(super) fn read_frame(
    raw: &RawValue,
    what: String,
    (key, expected): (&str, &str),
    reader: &mut Reader<'_>,
) -> Option<LocalFrame> {
    let Some(table) = raw.as_table() else {
        reader.wrong_type(key, expected, raw);
        return None;
    };
    let frame = Record { table, what };
    reader.check_keys(&frame, FRAME_KEYS);
    let position = reader.vector_or_zero(&frame, "position", Dimension::LENGTH);
    let axis = table.get("axis").and_then(|raw| reader.direction(raw, "axis"));
    let x_axis = table.get("x_axis").and_then(|raw| reader.direction(raw, "x_axis"));
    if let (Some(z), Some(x), Some(raw)) = (axis, x_axis, table.get("x_axis"))
        && are_parallel(z, x)
    {
        reader.diagnostics.push(parallel("x_axis", "axis", raw));
    }
    Some(LocalFrame { position, axis, x_axis, span: raw.span.clone() })
}
