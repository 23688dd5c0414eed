//! The page of an element.

use element_api::descriptor::{Descriptor, Kind, Named};
use element_api::documentation::manual_page;
use element_api::params::ParamSpec;

use super::{INDEX_FILE, Manual, case};
use crate::model::Catalogue;
use crate::page::html::{self, Side, code, escape, markdown, table};
use crate::verification::Element;

/// Name, summary, manual page, tables of what the descriptor says, cases.
pub(super) fn page(manual: &Manual<'_>, element: &Element) -> String {
    let descriptor = &element.descriptor;
    let mut body = format!(
        "<p class=\"small\"><a href=\"{INDEX_FILE}\">Verification manual</a></p>\n<h1>{}</h1>\n\
         <p class=\"small\">{} <code>{}</code>, {} {}</p>\n<p class=\"lead\">{}</p>\n",
        escape(&descriptor.name),
        descriptor.kind.word(),
        escape(&element.name),
        escape(&element.library),
        escape(&element.version),
        escape(&descriptor.summary)
    );
    body.push_str(&markdown(&manual_page(&descriptor.doc), 0));
    body.push_str(&tables(descriptor));
    body.push_str("<h2>Verification</h2>\n");
    let mut verified = false;
    for one in manual.cases_of(&element.name) {
        verified = true;
        body.push_str(&case::section(one));
    }
    if !verified {
        body.push_str("<p class=\"bad\">No scene verifies this element.</p>\n");
    }
    html::page(&format!("{} - verification", element.name), &body)
}

fn tables(descriptor: &Descriptor) -> String {
    let mut out = String::new();
    let mut section = |title: &str, content: String| {
        if !content.is_empty() {
            out.push_str(&format!("<h2>{title}</h2>\n{content}"));
        }
    };
    section("Parameters", parameters(&descriptor.params));
    section("Frames", named(&descriptor.frames));
    section(
        &format!("Further frames, up to {} in all", descriptor.most_frames),
        named(descriptor.more_frames.as_slice()),
    );
    let rows: Vec<Vec<String>> = descriptor.rows.iter().map(|row| vec![escape(row)]).collect();
    section("Constraint rows", table(&[("row", Side::Left)], &rows));
    let inputs: Vec<Vec<String>> = descriptor
        .inputs
        .iter()
        .map(|input| {
            let default = input.default.map_or_else(|| "required".to_string(), |value| code(&value.to_string()));
            vec![code(&input.name), escape(&input.unit), default, markdown_line(&input.doc)]
        })
        .collect();
    let head = [("input", Side::Left), ("unit", Side::Left), ("where nothing is connected", Side::Left), MEANING];
    section("Inputs", table(&head, &inputs));
    section("Joints whose reactions it takes", named(&descriptor.joints));
    let channels = match descriptor.kind {
        Kind::Joint => "Coordinates",
        Kind::Force => "Reported values",
        Kind::Control => "Signals it gives",
    };
    section(channels, named(&descriptor.channels));
    section("Reported values", named(&descriptor.values));
    section("States", named(&descriptor.states));
    section("Checks", named(&descriptor.checks));
    section("Catalogue", catalogue(&descriptor.catalog));
    out
}

/// The rows of recommended parameters.
fn catalogue(text: &str) -> String {
    let Ok(Some(Catalogue { columns, rows })) = Catalogue::read(text) else { return String::new() };
    let names: Vec<String> = columns
        .into_iter()
        .map(|(name, unit)| if unit.is_empty() { name } else { format!("{name} [{unit}]") })
        .collect();
    let head: Vec<(&str, Side)> = names.iter().map(|name| (name.as_str(), Side::Left)).collect();
    let rows: Vec<Vec<String>> = rows.iter().map(|row| row.iter().map(|cell| escape(cell)).collect()).collect();
    table(&head, &rows)
}

const MEANING: (&str, Side) = ("meaning", Side::Left);

fn named(list: &[Named]) -> String {
    let with_unit = list.iter().any(|entry| !entry.unit.is_empty());
    let mut head = vec![("name", Side::Left)];
    head.extend(with_unit.then_some(("unit", Side::Left)));
    head.push(MEANING);
    let row = |entry: &Named| {
        let mut cells = vec![code(&entry.name)];
        cells.extend(with_unit.then(|| escape(&entry.unit)));
        cells.push(markdown_line(&entry.doc));
        cells
    };
    table(&head, &list.iter().map(row).collect::<Vec<_>>())
}

fn parameters(specs: &[ParamSpec]) -> String {
    let head =
        [("parameter", Side::Left), ("value", Side::Left), ("unit", Side::Left), ("default", Side::Left), MEANING];
    let rows = specs.iter().map(|spec| {
        let mut value = vec![escape(spec.kind.text())];
        let range = spec.range_text();
        value.extend((!range.is_empty()).then(|| escape(&range)));
        if !spec.choices.is_empty() {
            value = vec![spec.choices.iter().map(|choice| code(choice)).collect::<Vec<_>>().join(" or ")];
        }
        if !spec.variable.is_empty() {
            value.push(format!("in {}", code(&spec.variable)));
        }
        let default = match (&spec.default, spec.optional) {
            (Some(default), _) => code(&default.to_string()),
            (None, true) => "may be left out".into(),
            (None, false) => "required".into(),
        };
        vec![code(&spec.name), value.join(", "), escape(&spec.unit), default, markdown_line(&spec.doc)]
    });
    table(&head, &rows.collect::<Vec<_>>())
}

/// A sentence of Markdown for a cell.
fn markdown_line(text: &str) -> String {
    let html = markdown(text, 0);
    let line = html.trim_end();
    line.strip_prefix("<p>").and_then(|line| line.strip_suffix("</p>")).unwrap_or(line).to_string()
}
