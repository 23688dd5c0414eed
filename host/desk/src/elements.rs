//! Sections of elements: what their libraries say, the extremes of what they report, their checks.

use serde_json::Value;

use crate::page::html::{Side, code, escape, markdown, table};
use crate::results::significant;
use crate::source::Source;

/// Digits of a number for people.
const DIGITS: usize = 6;

/// A section for each element that has one; nothing where none has.
pub(crate) fn sections(source: &Source, several: bool) -> String {
    let all = source.summary.get("elements").and_then(Value::as_array).into_iter().flatten();
    // What has no text of its own is among the warnings, where a check did not hold.
    all.filter(|element| !text(element, "text").is_empty()).map(|element| section(source, element, several)).collect()
}

fn section(source: &Source, element: &Value, several: bool) -> String {
    let of = if several { format!(" of {}", escape(&source.name)) } else { String::new() };
    let mut out = format!(
        "<section><h2>{}{of}</h2>\n<p class=\"small\">{}, from the library {}</p>\n{}",
        code(text(element, "element")),
        code(text(element, "type")),
        escape(text(element, "library")),
        markdown(text(element, "text"), 2)
    );
    let time = escape(source.text("time_unit"));
    let at = |entry: &Value, key: &str| {
        let number = number(entry, key);
        if time.is_empty() || entry.get(key).is_none_or(Value::is_null) { number } else { format!("{number} {time}") }
    };
    let checks: Vec<Vec<String>> = list(element, "checks")
        .map(|check| {
            let holds = check.get("holds").and_then(Value::as_bool).unwrap_or(false);
            let unique = check.get("unique").and_then(Value::as_bool).unwrap_or(true);
            let verdict = match (holds, unique) {
                (true, true) => "<span class=\"good\">holds</span>",
                (true, false) => "<span class=\"bad\">holds, from a reaction that is not unique</span>",
                (false, _) => "<span class=\"bad\">does not hold</span>",
            };
            vec![
                escape(text(check, "name")),
                if holds { String::new() } else { escape(text(check, "words")) },
                number(check, "margin"),
                escape(text(check, "unit")),
                at(check, "at"),
                at(check, "first"),
                verdict.into(),
            ]
        })
        .collect();
    let head = [
        ("Check", Side::Left),
        ("", Side::Left),
        ("smallest margin", Side::Right),
        ("unit", Side::Word),
        ("at", Side::Right),
        ("first violated at", Side::Right),
        ("", Side::Word),
    ];
    out.push_str(&table(&head, &checks));
    let values: Vec<Vec<String>> = list(element, "values")
        .map(|value| {
            vec![
                code(text(value, "name")),
                number(value, "smallest"),
                at(value, "smallest_at"),
                number(value, "largest"),
                at(value, "largest_at"),
                escape(text(value, "unit")),
            ]
        })
        .collect();
    let head = [
        ("Value", Side::Left),
        ("smallest", Side::Right),
        ("at", Side::Right),
        ("largest", Side::Right),
        ("at", Side::Right),
        ("unit", Side::Word),
    ];
    out.push_str(&table(&head, &values));
    out.push_str("</section>\n");
    out
}

fn list<'a>(value: &'a Value, key: &str) -> impl Iterator<Item = &'a Value> {
    value.get(key).and_then(Value::as_array).into_iter().flatten()
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value.get(key).and_then(Value::as_str).unwrap_or_default()
}

fn number(value: &Value, key: &str) -> String {
    match value.get(key) {
        None => String::new(),
        Some(value) => value.as_f64().map_or_else(|| "&ndash;".into(), |x| significant(x, DIGITS)),
    }
}
