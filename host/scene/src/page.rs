//! The reference of the scene format as a page, Markdown: the JSON schema, which has the keys of the reader, written for people.

use serde_json::Value;

use super::dimension::Dimension;
use super::expression::FUNCTIONS;
use super::schema::{DIMENSION, ORDER};
use super::units::{KNOWN, Known, PREFIXES};

const HEAD: &str = "\
# The scene format

This page is made by `odyn schema --markdown` from the tables that the reader of scenes and the JSON schema share; the tests
hold them together. A scene is a TOML file of UTF-8 text with the tables below; `[name]` stands once, `[[name]]` as often as
there are things of this kind. A key without which the scene is refused is marked \\*. Every other key may be left out, and no
key may stand that is not here.

In the column *value*, a name of a physical quantity (length, time, moment of inertia) is a number in the scene's units, or a
text with a unit or an expression: `0.4`, `\"40 cm\"`, `\"2 * crank.radius\"`. *Plain number* is the same without a unit,
*quantity* one whose kind depends on the place, and `3 × length` a list of three. *Function*, *points* and *grid* are those of
[Functions and signals](functions.md). [Units and expressions](units.md) has more.
";

/// Keys of an inner table that are written in one line.
const MOST_IN_LINE: usize = 6;

/// The page for a schema of scenes: that of the records alone, or with the elements of libraries.
#[must_use]
pub fn page(schema: &Value) -> String {
    let mut page = HEAD.to_owned();
    let tables: Vec<(&str, &Value)> = properties(schema).collect();
    let known: Vec<String> = tables.iter().map(|(name, table)| header(name, table)).collect();
    page.push_str(&key_table(schema, &known));
    let mut written: Vec<(&str, &Value)> = Vec::new();
    for ((name, value), header) in tables.iter().zip(&known) {
        let Some(record) = record(value) else { continue };
        page.push_str(&format!("\n## `{header}`\n\n{}\n", sentence(value)));
        let like = written.iter().find(|(_, other)| extends(record, other));
        let own: Value = match like {
            Some((other, same)) => {
                page.push_str(&format!(
                    "\nThe keys of `{other}`{}\n",
                    if adds(record, same) { ", and these:" } else { "." }
                ));
                beyond(record, same)
            }
            None => record.clone(),
        };
        page.push_str(&key_table(&own, &[]));
        page.push_str(&details(&own));
        for (key, table, meaning) in
            properties(&own).filter_map(|(key, value)| Some((key, own_section(value)?, sentence(value))))
        {
            page.push_str(&format!(
                "\n### `[[{name}.{key}]]`\n\n{meaning}\n{}{}",
                key_table(table, &[]),
                details(table)
            ));
        }
        written.push((header, record));
        page.push_str(&elements(name, record));
    }
    page + &units() + &functions()
}

/// The keys of a table, in the order in which it lists them.
fn properties(table: &Value) -> impl Iterator<Item = (&str, &Value)> {
    let names = table[ORDER].as_array().into_iter().flatten().filter_map(Value::as_str);
    names.filter_map(|name| Some((name, table["properties"].get(name)?)))
}

/// `[name]`, `[[name]]`, or the name of a key.
fn header(name: &str, value: &Value) -> String {
    match (value["type"].as_str(), record(value)) {
        (Some("array"), Some(_)) => format!("[[{name}]]"),
        (_, Some(_)) => format!("[{name}]"),
        _ => name.to_owned(),
    }
}

/// The table with keys of a `[name]` or `[[name]]`.
fn record(value: &Value) -> Option<&Value> {
    [value, &value["items"]].into_iter().find(|table| table["properties"].is_object())
}

/// The table of entries of a list that have too many keys for a line.
fn own_section(value: &Value) -> Option<&Value> {
    let table = Some(&value["items"]).filter(|_| value["type"] == "array")?;
    (properties(table).count() > MOST_IN_LINE).then_some(table)
}

fn sentence(value: &Value) -> &str {
    value["description"].as_str().unwrap_or_default()
}

/// Whether a table has all keys of another one. What a type of elements adds is listed apart.
fn extends(table: &Value, other: &Value) -> bool {
    let same = |(key, value): (&str, &Value)| {
        table["properties"].get(key).is_some_and(|own| key == "type" || key == "params" || own == value)
    };
    properties(other).all(same)
}

fn adds(table: &Value, other: &Value) -> bool {
    properties(table).any(|(key, _)| other["properties"].get(key).is_none())
}

fn beyond(table: &Value, other: &Value) -> Value {
    let own: Vec<&str> =
        properties(table).map(|(key, _)| key).filter(|key| other["properties"].get(*key).is_none()).collect();
    let mut beyond = table.clone();
    beyond[ORDER] = own.into();
    beyond
}

fn is_required(table: &Value, key: &str) -> bool {
    table["required"].as_array().is_some_and(|keys| keys.iter().any(|one| one == key))
}

/// Keys with value and meaning; `headers` are the names to show instead of the keys, if there are any.
fn key_table(table: &Value, headers: &[String]) -> String {
    if properties(table).next().is_none() {
        return String::new();
    }
    let mut text = "\n| key | value | meaning |\n|---|---|---|\n".to_owned();
    for (k, (key, value)) in properties(table).enumerate() {
        let name = headers.get(k).map_or(key, String::as_str);
        let mark = if is_required(table, key) { " \\*" } else { "" };
        text.push_str(&format!("| `{name}`{mark} | {} | {} |\n", kind_and_default(value), sentence(value)));
    }
    text
}

/// The kind of a value, in a few words, and what it is if left out. Parameters of elements tell that beside their unit.
fn kind_and_default(value: &Value) -> String {
    match (&value["default"], sentence(value).contains("default ")) {
        (Value::Null, _) | (_, true) => kind(value),
        (default, false) => format!("{}; `{default}` if left out", kind(value)),
    }
}

/// The kind of a value, in a few words.
fn kind(value: &Value) -> String {
    let choices = ["anyOf", "oneOf"].into_iter().find_map(|word| value[word].as_array());
    if let Some(choices) = choices {
        let is_table_of = |key: &str| choices.iter().any(|choice| choice["properties"][key].is_object());
        if is_table_of("points") {
            let number = choices.iter().any(|choice| choice["properties"].is_null() && choice["items"].is_null());
            return if number { "function".to_owned() } else { "points".to_owned() };
        }
        if is_table_of("z") {
            return "grid".to_owned();
        }
        let mut words: Vec<String> = choices.iter().map(kind).collect();
        words.dedup();
        return words.join(" or ");
    }
    if value["properties"].is_object() {
        return "table".to_owned();
    }
    if let Some(only) = value["const"].as_str() {
        return format!("`\"{only}\"`");
    }
    if value["$ref"].is_string() {
        return "table of quantities and of such tables".to_owned();
    }
    match value["type"].as_str() {
        Some("array") => match (value["minItems"].as_u64(), value["maxItems"].as_u64()) {
            (Some(least), Some(most)) if least == most => format!("{least} × {}", bracketed(kind(&value["items"]))),
            _ if record(value).is_some() => "list of tables".to_owned(),
            _ => format!("list of {}", bracketed(kind(&value["items"]))),
        },
        Some("object") => "table".to_owned(),
        Some("boolean") => "`true` or `false`".to_owned(),
        Some("integer") => "whole number".to_owned() + &bounds(value),
        Some("string") => words(value),
        _ => match value[DIMENSION].as_str() {
            Some(dimension) => dimension.to_owned() + &bounds(value),
            // Parameters of elements tell their range beside their unit.
            None => "quantity".to_owned(),
        },
    }
}

fn bracketed(kind: String) -> String {
    if kind.contains(" or ") || kind.contains('×') { format!("({kind})") } else { kind }
}

fn bounds(value: &Value) -> String {
    let bounds =
        [("minimum", "at least"), ("exclusiveMinimum", "above"), ("maximum", "at most"), ("exclusiveMaximum", "below")];
    let bound = |(key, word): (&str, &str)| value.get(key).map(|bound| format!(", {word} {bound}"));
    bounds.into_iter().filter_map(bound).collect()
}

/// A text, or the words that it can be, where they explain themselves.
fn words(value: &Value) -> String {
    match value["enum"].as_array() {
        Some(words) if documented(value).is_none() && !words.is_empty() => {
            let words: Vec<String> =
                words.iter().filter_map(Value::as_str).map(|word| format!("`\"{word}\"`")).collect();
            words.join(", ")
        }
        Some(words) if !words.is_empty() => "word, below".to_owned(),
        _ if value[DIMENSION].is_string() => format!("unit of {}", value[DIMENSION].as_str().unwrap_or_default()),
        _ if value["pattern"].as_str().is_some_and(|pattern| pattern.ends_with("+$")) => "name".to_owned(),
        _ => "text".to_owned(),
    }
}

/// Words with their sentences.
fn documented(value: &Value) -> Option<impl Iterator<Item = (&str, &str)>> {
    let words = value["enum"].as_array()?.iter().filter_map(Value::as_str);
    let docs = value["x-taplo"]["docs"]["enumValues"].as_array()?.iter().filter_map(Value::as_str);
    Some(words.zip(docs))
}

/// What does not fit into a row: words with their sentences, and the keys of inner tables.
fn details(table: &Value) -> String {
    let mut text = String::new();
    for (key, value) in properties(table).filter(|(key, _)| !["type", "params"].contains(key)) {
        if let Some(words) = documented(value).or_else(|| documented(&value["items"])) {
            let lines = words.map(|(word, doc)| format!("- `\"{word}\"`: {doc}\n"));
            text.push_str(&format!("\n`{key}` is one of:\n\n{}", lines.collect::<String>()));
        }
        let inner = if own_section(value).is_some() { Vec::new() } else { inner_tables(value) };
        if !inner.is_empty() {
            let lines = inner.iter().map(|table| format!("- {}\n", one_line(table)));
            let one_of = if inner.len() > 1 { ", one of these ways" } else { "" };
            text.push_str(&format!("\n`{key}` as a table{one_of}:\n\n{}", lines.collect::<String>()));
        }
    }
    text
}

/// The tables with keys of their own that a value can hold.
fn inner_tables(value: &Value) -> Vec<&Value> {
    if value["properties"].is_object() {
        return vec![value];
    }
    let choices = ["anyOf", "oneOf"].into_iter().filter_map(|word| value[word].as_array()).flatten();
    choices.chain(value.get("items")).flat_map(inner_tables).collect()
}

/// Keys with value and meaning; neighbours that have these in common stand together.
fn one_line(table: &Value) -> String {
    let mut groups: Vec<(Vec<String>, String)> = Vec::new();
    for (key, value) in properties(table) {
        let name = format!("`{key}`{}", if is_required(table, key) { " \\*" } else { "" });
        let meaning = format!("({}): {}", kind(value), sentence(value).trim_end_matches('.'));
        match groups.last_mut() {
            Some((names, same)) if *same == meaning => names.push(name),
            _ => groups.push((vec![name], meaning)),
        }
    }
    groups.iter().map(|(names, meaning)| format!("{} {meaning}", names.join(", "))).collect::<Vec<_>>().join("; ")
}

/// The types of elements of one kind, each with its bodies, signals and parameters.
fn elements(kind_of_element: &str, record: &Value) -> String {
    let mut text = String::new();
    let docs: Vec<(&str, &str)> = documented(&record["properties"]["type"]).into_iter().flatten().collect();
    for case in record["allOf"].as_array().into_iter().flatten() {
        let Some(name) = case["if"]["properties"]["type"]["enum"][0].as_str() else { continue };
        let summary = docs.iter().find(|(word, _)| *word == name).map_or("", |(_, doc)| *doc);
        text.push_str(&format!("\n#### {kind_of_element} `{name}`\n\n{summary}\n"));
        let of_type = &case["then"]["properties"];
        let frames = &of_type["bodies"]["description"];
        if let Some(frames) = frames.as_str().filter(|frames| !frames.is_empty()) {
            let frames = frames.split("\n\n").enumerate().map(|(k, frame)| format!("{}. {frame}\n", k + 1));
            text.push_str(&format!("\nBodies:\n\n{}", frames.collect::<String>()));
        }
        text.push_str(&key_table(&of_type["inputs"], &[]).replacen("| key |", "| signal |", 1));
        text.push_str(&key_table(&of_type["params"], &[]).replacen("| key |", "| parameter |", 1));
    }
    if !text.is_empty() {
        let more = "`odyn elements describe NAME` has the manual page of each: equations, signs, singular cases, what it reports.";
        text = format!("\n### Types of `[[{kind_of_element}]]`\n\n{more}\n{text}");
    }
    text
}

fn units() -> String {
    let prefixes: Vec<String> = PREFIXES.iter().map(|(symbol, size)| format!("`{symbol}` {size:e}")).collect();
    let row = |known: &Known| {
        let prefixed = if known.prefixed { "yes" } else { "" };
        let (dimension, size) = (known.dimension, known.factor);
        let si = if dimension == Dimension::DIMENSIONLESS { String::new() } else { dimension.si_unit() };
        format!("| `{}` | {} | {} | {prefixed} |\n", known.symbol, dimension.noun(), format!("{size} {si}").trim_end())
    };
    let rows: String = KNOWN.iter().map(row).collect();
    format!(
        "\n## Symbols of units\n\n| symbol | unit of | in SI | prefixes |\n|---|---|---|---|\n{rows}\nPrefixes: {}.\n",
        prefixes.join(", ")
    )
}

fn functions() -> String {
    let names = FUNCTIONS.iter().map(|(name, _, arguments)| match (arguments.start, arguments.end) {
        (_, usize::MAX) => format!("`{name}(x, y, ...)`"),
        (2, _) => format!("`{name}(x, y)`"),
        _ => format!("`{name}(x)`"),
    });
    let names: Vec<String> = names.collect();
    format!("\n## Functions of expressions\n\n{}; and the number `pi`.\n", names.join(", "))
}
