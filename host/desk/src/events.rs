//! What happened to contacts, to friction that sticks and to joints that let go: one line for each row, the list itself is for the scripts.

use crate::page::html::{Side, escape, table};
use crate::results::{Event, EventKind, significant};
use crate::source::Source;

/// Rows beyond which the table is folded.
const SHOWN: usize = 20;

/// How often each contact struck, closed, opened, stuck and slid; empty where nothing happened.
pub(crate) fn summary(source: &Source, several: bool) -> String {
    let mut rows: Vec<(&Event, Vec<&Event>)> = Vec::new();
    let mut place = std::collections::HashMap::new();
    for event in &source.events {
        let at = *place.entry((&event.element, &event.row)).or_insert(rows.len());
        if at == rows.len() {
            rows.push((event, Vec::new()));
        }
        rows[at].1.push(event);
    }
    if rows.is_empty() {
        return String::new();
    }
    let kinds = [
        (EventKind::Impact, "impacts"),
        (EventKind::Closes, "closes"),
        (EventKind::Opens, "opens"),
        (EventKind::Sticks, "sticks"),
        (EventKind::Slides, "slides"),
        (EventKind::Creeps, "creeps"),
        (EventKind::Releases, "releases"),
        (EventKind::Switches, "switches"),
    ];
    let happened = |kind: EventKind| source.events.iter().any(|event| event.kind == kind);
    let shown: Vec<(EventKind, &str)> = kinds.into_iter().filter(|(kind, _)| happened(*kind)).collect();
    let strikes = happened(EventKind::Impact);
    let lines: Vec<Vec<String>> = rows
        .iter()
        .map(|(name, events)| {
            let times = events.iter().map(|event| event.time);
            let mut line = vec![escape(&name.element), escape(&name.row)];
            line.extend(shown.iter().map(|(kind, _)| {
                let count = events.iter().filter(|event| event.kind == *kind).count();
                if count == 0 { String::new() } else { count.to_string() }
            }));
            if strikes {
                let lost: f64 = events.iter().map(|event| event.lost).sum();
                let struck = events.iter().any(|event| event.kind == EventKind::Impact);
                line.push(if struck { significant(lost, 4) } else { String::new() });
            }
            line.push(significant(times.clone().fold(f64::INFINITY, f64::min), 6));
            line.push(significant(times.fold(f64::NEG_INFINITY, f64::max), 6));
            line
        })
        .collect();
    let unit = source.text("time_unit");
    let (first, last) = (format!("first, {unit}"), format!("last, {unit}"));
    let mut head = vec![("Contact", Side::Word), ("row", Side::Word)];
    head.extend(shown.iter().map(|(_, words)| (*words, Side::Right)));
    if strikes {
        head.push(("lost in impacts, J", Side::Right));
    }
    head.extend([(first.as_str(), Side::Right), (last.as_str(), Side::Right)]);
    let body = table(&head, &lines);
    let name = if several { format!("<h3>{}</h3>\n", escape(&source.name)) } else { String::new() };
    match lines.len() > SHOWN {
        true => format!("{name}<details><summary>{} rows of contacts</summary>\n{body}</details>\n", lines.len()),
        false => name + &body,
    }
}
