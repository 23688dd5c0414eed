//! `--set K=V`: changes of a scene from the command line, applied to the tables before they are read.

use super::raw::{RawKind, RawTable, RawValue, Spanned, parse_value};
use super::schema::{self, Key};
use super::units::{number_and_unit, parse_unit};
use odyn_diagnostics::{Diagnostic, Source, codes, suggest};

/// One `--set`: `crank.radius=9mm`, `simulation.t_end=50`, `rotor.mass=0.05`, `rotor.velocity.x=2`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Override {
    /// Key, `=`, value, as on the command line; checked by [`super::parse`].
    pub text: String,
}

impl Override {
    /// An override as written behind `--set`.
    pub fn new(text: impl Into<String>) -> Self {
        Override { text: text.into() }
    }
}

/// Tables whose keys can be set directly, even if the table is not there.
const SECTIONS: [&str; 4] = ["parameters", "simulation", "units", "plugins"];
/// Lists of named tables.
const LISTS: [&str; 8] = ["body", "joint", "force", "control", "input", "output", "figure", "check"];
/// More levels than any key of a scene has.
const MOST_SEGMENTS: usize = 16;

/// A parameter with a unit in the scene that was set to a plain number.
pub(super) struct Stripped {
    name: String,
    /// What is to be said of it.
    remedy: String,
}

/// Applies all overrides in their order. Their texts are added to the source, so that what is wrong with a
/// value is shown where it was written: on the command line. Gives the parameters that lost their units, which is wrong where
/// they are used.
pub(super) fn apply(
    root: &mut RawTable,
    overrides: &[Override],
    source: &mut Source,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<Stripped> {
    const OPTION: &str = "--set ";
    let mut stripped = Vec::new();
    for one in overrides {
        let start = source.add("command line", format!("{OPTION}{}", one.text)) + OPTION.len();
        let Some((key, value)) = one.text.split_once('=') else {
            diagnostics.push(
                bad("there is no `=` between key and value".to_owned())
                    .at(start..start + one.text.len(), "")
                    .help("write `--set crank.radius=9mm`"),
            );
            continue;
        };
        let path: Vec<&str> = key.split('.').map(str::trim).collect();
        let span = start..start + key.len();
        if path.iter().any(|segment| segment.is_empty()) || path.len() > MOST_SEGMENTS {
            diagnostics.push(bad(format!("`{}` is not a key", key.trim())).at(span, ""));
            continue;
        }
        let blanks = value.len() - value.trim_start().len();
        let value_start = span.end + 1 + blanks;
        let value = parse_value(value.trim(), value_start, diagnostics);
        stripped.extend(without_unit(root, &path, &value, one));
        if let Err(error) = set(root, &path, value, span) {
            diagnostics.push(error);
        }
    }
    stripped
}

/// What an override makes of a parameter that has a unit, where it gives a number without one.
fn without_unit(root: &RawTable, path: &[&str], value: &RawValue, one: &Override) -> Option<Stripped> {
    let path = path.strip_prefix(&["parameters"]).unwrap_or(path);
    let given = match value.kind {
        RawKind::Number(number) => number,
        RawKind::Integer(number) => number as f64,
        _ => return None,
    };
    let parameters = root.get("parameters")?.as_table()?.get(path.first()?)?;
    let before = path[1..].iter().try_fold(parameters, |raw, segment| raw.as_table()?.get(segment))?;
    let (_, unit) = number_and_unit(before.as_text()?).filter(|(_, unit)| parse_unit(unit).is_ok())?;
    let name = path.join(".");
    let remedy = format!("`--set {}` gives `{name}` no unit: write `--set \"{name}={given} {unit}\"`", one.text);
    Some(Stripped { name, remedy })
}

/// Where numbers without a unit are found where one is needed, and the parameters in that line lost theirs to overrides, says so.
pub(super) fn explain(stripped: &[Stripped], source: &Source, diagnostics: &mut [Diagnostic]) {
    let codes = [codes::DIMENSION, codes::MIXED_DIMENSIONS, codes::NEEDS_UNIT];
    for diagnostic in diagnostics.iter_mut().filter(|diagnostic| codes.contains(&diagnostic.code)) {
        let Some(at) = diagnostic.span().and_then(|span| source.text.get(..span.start)).map(str::len) else { continue };
        let begin = source.text[..at].rfind('\n').map_or(0, |newline| newline + 1);
        let line = source.text[begin..].lines().next().unwrap_or_default();
        let is_part = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.');
        let words = || line.split(|c| !is_part(c));
        for one in stripped.iter().filter(|one| words().any(|word| word == one.name)) {
            diagnostic.help.push(one.remedy.clone());
        }
    }
}

fn bad(message: String) -> Diagnostic {
    Diagnostic::error(codes::BAD_OVERRIDE, message)
}

/// What the first segment of a key can mean.
#[derive(Clone, Copy)]
enum Target {
    /// A key of the scene itself or of a table with a header.
    Section,
    /// A parameter, without `parameters.` in front.
    Parameter,
    /// A named table: list and index.
    Named(&'static str, usize),
}

fn set(root: &mut RawTable, path: &[&str], value: RawValue, span: std::ops::Range<usize>) -> Result<(), Diagnostic> {
    let (table, rest, list) = match find_target(root, path, &span)? {
        Target::Section if path.len() == 1 => (root, path, ""),
        Target::Section => (section(root, path[0], &span), &path[1..], path[0]),
        Target::Parameter => (section(root, "parameters", &span), path, ""),
        Target::Named(list, index) => {
            let skipped = if path[0] == list { 2 } else { 1 };
            (named(root, list, index), &path[skipped..], list)
        }
    };
    let whole = path.join(".");
    begin_list(table, rest, list, &whole, &span)?;
    set_inside(table, rest, value, &span)
        .map_err(|at| bad(format!("`{at}` in `{whole}` is not a table")).at(span.clone(), ""))
}

/// What can stand in a section, or in a table of a list.
fn keys_of(table: &str) -> Vec<Key> {
    match table {
        "simulation" => schema::simulation_keys(),
        "body" => schema::body_keys(),
        "joint" | "force" | "control" => schema::element_keys(table),
        "input" => schema::input_keys(),
        "output" => schema::output_keys(),
        "figure" => schema::figure_keys(),
        "check" => schema::check_keys(),
        _ => Vec::new(),
    }
}

/// Where an entry of a list is set that the scene leaves out, the others are what they are then: puts such a list there.
fn begin_list(
    table: &mut RawTable,
    path: &[&str],
    list: &str,
    whole: &str,
    span: &std::ops::Range<usize>,
) -> Result<(), Diagnostic> {
    let [key, _, ..] = path else { return Ok(()) };
    if table.get(key).is_some() {
        return Ok(());
    }
    let keys = keys_of(list);
    let schema = keys.iter().find(|(known, ..)| known == key).map(|(_, schema, _)| schema);
    let Some(schema) = schema.filter(|schema| schema["type"] == "array") else { return Ok(()) };
    let Some(left_out) = schema["default"].as_array() else {
        let before = whole.split(key).next().unwrap_or_default();
        let message = format!("`{whole}` cannot be set alone: the scene has no `{before}{key}`");
        return Err(bad(message)
            .at(span.clone(), "")
            .help(format!("set all of it: `--set \"{before}{key}=[...]\"`, or write it in the scene")));
    };
    let entry = |value: &serde_json::Value| {
        let kind =
            value.as_str().map_or(RawKind::Integer(value.as_i64().unwrap_or(0)), |word| RawKind::Text(word.into()));
        RawValue { span: span.clone(), kind }
    };
    let list = RawValue { span: span.clone(), kind: RawKind::Array(left_out.iter().map(entry).collect()) };
    table.set(Spanned::new((*key).to_owned(), span.clone()), list);
    Ok(())
}

/// Sets a key of nested tables, which are created as needed; the error is the segment that is no table.
fn set_inside<'p>(
    table: &mut RawTable,
    path: &[&'p str],
    value: RawValue,
    span: &std::ops::Range<usize>,
) -> Result<(), &'p str> {
    match path {
        [] => Ok(()),
        [key] => {
            table.set(Spanned::new((*key).to_owned(), span.clone()), value);
            Ok(())
        }
        [first, rest @ ..] => {
            if table.get(first).is_none() {
                table.set(Spanned::new((*first).to_owned(), span.clone()), empty_table(span));
            }
            match table.get_mut(first).map(|raw| &mut raw.kind) {
                Some(RawKind::Table(inner)) => set_inside(inner, rest, value, span),
                Some(RawKind::Array(items)) => set_entry(items, rest, value, span).ok_or(*first)?,
                _ => Err(first),
            }
        }
    }
}

/// Sets an entry of a list, or of a list in it; `None` if there is no such entry.
fn set_entry<'p>(
    items: &mut [RawValue],
    path: &[&'p str],
    value: RawValue,
    span: &std::ops::Range<usize>,
) -> Option<Result<(), &'p str>> {
    let item = items.get_mut(entry(path.first()?)?)?;
    match (&mut item.kind, &path[1..]) {
        (_, []) => *item = value,
        (RawKind::Table(inner), rest) => return Some(set_inside(inner, rest, value, span)),
        (RawKind::Array(inner), rest) => return set_entry(inner, rest, value, span),
        _ => return None,
    }
    Some(Ok(()))
}

/// Number of an entry of a list, from 0: `x`, `y`, `z` or that number.
fn entry(segment: &str) -> Option<usize> {
    let axis = ["x", "y", "z"].iter().position(|axis| *axis == segment);
    axis.or_else(|| segment.parse().ok())
}

/// What the scene has at a key that [`apply`] would set; `Ok(None)` where it gives none.
pub(super) fn get<'t>(
    root: &'t RawTable,
    key: &str,
    span: std::ops::Range<usize>,
) -> Result<Option<&'t RawValue>, Diagnostic> {
    let path: Vec<&str> = key.split('.').map(str::trim).collect();
    if path.iter().any(|segment| segment.is_empty()) || path.len() > MOST_SEGMENTS {
        return Err(bad(format!("`{key}` is not a key")));
    }
    let (table, rest) = match find_target(root, &path, &span)? {
        Target::Section if path.len() == 1 => (Some(root), &path[..]),
        Target::Section => (root.get(path[0]).and_then(RawValue::as_table), &path[1..]),
        Target::Parameter => (root.get("parameters").and_then(RawValue::as_table), &path[..]),
        Target::Named(list, index) => {
            let item = root.get(list).and_then(RawValue::as_array).and_then(|items| items.get(index));
            (item.and_then(RawValue::as_table), &path[if path[0] == list { 2 } else { 1 }..])
        }
    };
    let found = rest.split_first().and_then(|(first, rest)| {
        let start = table?.get(first)?;
        rest.iter().try_fold(start, |raw, segment| match &raw.kind {
            RawKind::Table(inner) => inner.get(segment),
            RawKind::Array(items) => items.get(entry(segment)?),
            _ => None,
        })
    });
    Ok(found)
}

fn empty_table(span: &std::ops::Range<usize>) -> RawValue {
    RawValue { span: span.clone(), kind: RawKind::Table(RawTable { span: span.clone(), entries: Vec::new() }) }
}

/// The table of a section, created if it isn't there or isn't one (which is reported when it is read).
fn section<'t>(root: &'t mut RawTable, key: &str, span: &std::ops::Range<usize>) -> &'t mut RawTable {
    if root.get(key).is_none_or(|raw| raw.as_table().is_none()) {
        root.set(Spanned::new(key.to_owned(), span.clone()), empty_table(span));
    }
    match root.get_mut(key).map(|raw| &mut raw.kind) {
        Some(RawKind::Table(table)) => table,
        _ => unreachable!("the table has just been put there"),
    }
}

fn named<'t>(root: &'t mut RawTable, list: &str, index: usize) -> &'t mut RawTable {
    let item = match root.get_mut(list).map(|raw| &mut raw.kind) {
        Some(RawKind::Array(items)) => items.get_mut(index),
        _ => None,
    };
    match item.map(|raw| &mut raw.kind) {
        Some(RawKind::Table(table)) => table,
        _ => unreachable!("find_target found this table"),
    }
}

fn find_target(root: &RawTable, path: &[&str], span: &std::ops::Range<usize>) -> Result<Target, Diagnostic> {
    let whole = path.join(".");
    let first = path[0];
    if SECTIONS.contains(&first) && path.len() > 1 || path == ["title"] {
        if first == "parameters" && !is_parameter(root, &path[1..]) {
            return Err(unknown(root, &whole, span));
        }
        return Ok(Target::Section);
    }
    // `body.rotor.mass`: unmistakable.
    if let Some(list) = LISTS.into_iter().find(|list| *list == first)
        && path.len() > 2
        && let Some(index) = find_named(root, list, path[1])
    {
        return Ok(Target::Named(list, index));
    }
    let mut found: Vec<Target> = Vec::new();
    if is_parameter(root, path) {
        found.push(Target::Parameter);
    }
    if path.len() > 1 {
        found.extend(LISTS.into_iter().filter_map(|list| Some(Target::Named(list, find_named(root, list, first)?))));
    }
    match found.as_slice() {
        [only] => Ok(*only),
        [] => Err(unknown(root, &whole, span)),
        [one, another, ..] => {
            let prefix = |target: &Target| match target {
                Target::Named(list, _) => *list,
                _ => "parameters",
            };
            Err(bad(format!("`{whole}` can mean more than one thing")).at(span.clone(), "").help(format!(
                "write `{}.{whole}` or `{}.{whole}`",
                prefix(one),
                prefix(another)
            )))
        }
    }
}

fn is_parameter(root: &RawTable, path: &[&str]) -> bool {
    let mut table = root.get("parameters").and_then(RawValue::as_table);
    for (index, segment) in path.iter().enumerate() {
        let Some(value) = table.and_then(|table| table.get(segment)) else {
            return false;
        };
        if index + 1 == path.len() {
            return value.as_table().is_none();
        }
        table = value.as_table();
    }
    false
}

/// Index of the table of that name in a list of tables.
fn find_named(root: &RawTable, list: &str, name: &str) -> Option<usize> {
    root.get(list)?.as_array()?.iter().position(|item| {
        let own = item.as_table().and_then(|table| table.get("name"));
        own.and_then(RawValue::as_text) == Some(name)
    })
}

fn unknown(root: &RawTable, whole: &str, span: &std::ops::Range<usize>) -> Diagnostic {
    let candidates = candidates(root, whole);
    let help = suggest(whole, candidates.iter().map(String::as_str))
        .map(|found| format!("did you mean `{found}`?"))
        .unwrap_or_else(|| "set a parameter, `simulation.t_end`, or `NAME.KEY` of a body or element".to_owned());
    bad(format!("there is no `{whole}` to set")).at(span.clone(), "").help(help)
}

/// Everything that can be set and is there.
fn candidates(root: &RawTable, whole: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    if let Some(table) = root.get("parameters").and_then(RawValue::as_table) {
        leaves(table, "", &mut found);
        if whole.starts_with("parameters.") {
            found = found.iter().map(|name| format!("parameters.{name}")).collect();
        }
    }
    for key in SECTIONS {
        if let Some(table) = root.get(key).and_then(RawValue::as_table) {
            let keys = table.entries.iter();
            found.extend(keys.map(|(own, _)| format!("{key}.{}", own.value)));
        }
    }
    // A mistyped name keeps its key: `rotr.mass` is near to `rotor.mass`.
    let key = whole.split_once('.').map_or("", |(_, key)| key);
    for list in LISTS {
        let items = root.get(list).and_then(RawValue::as_array);
        for item in items.unwrap_or_default() {
            let name = item.as_table().and_then(|table| table.get("name"));
            if let Some(name) = name.and_then(RawValue::as_text) {
                found.push(format!("{name}.{key}"));
            }
        }
    }
    found
}

/// All values that are no tables and no lists, by their keys.
pub(super) fn values(root: &RawTable) -> Vec<(String, RawValue)> {
    let mut found = Vec::new();
    for key in SECTIONS {
        // Parameters need no prefix.
        let prefix = if key == "parameters" { "" } else { key };
        if let Some(raw) = root.get(key).filter(|raw| raw.as_table().is_some()) {
            values_inside(raw, prefix, &mut found);
        }
    }
    for item in LISTS.iter().filter_map(|list| root.get(list)?.as_array()).flatten() {
        let name = item.as_table().and_then(|table| table.get("name"));
        if let Some(name) = name.and_then(RawValue::as_text) {
            values_inside(item, name, &mut found);
        }
    }
    found
}

fn values_inside(raw: &RawValue, path: &str, found: &mut Vec<(String, RawValue)>) {
    let longer = |segment: &str| if path.is_empty() { segment.to_owned() } else { format!("{path}.{segment}") };
    match &raw.kind {
        RawKind::Table(table) => {
            table.entries.iter().for_each(|(key, value)| values_inside(value, &longer(&key.value), found));
        }
        RawKind::Array(items) => {
            let axes = ["x", "y", "z"];
            for (k, item) in items.iter().enumerate() {
                let number = k.to_string();
                let segment = if items.len() == axes.len() { axes[k] } else { number.as_str() };
                values_inside(item, &longer(segment), found);
            }
        }
        _ => found.push((path.to_owned(), raw.clone())),
    }
}

fn leaves(table: &RawTable, prefix: &str, found: &mut Vec<String>) {
    for (key, value) in &table.entries {
        let name = format!("{prefix}{}", key.value);
        match value.as_table() {
            Some(inner) => leaves(inner, &format!("{name}."), found),
            None => found.push(name),
        }
    }
}
