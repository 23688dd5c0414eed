//! The frame of a page, tables, escaping, Markdown.

use crate::diagnostics::shown;
use pulldown_cmark::{Event, HeadingLevel, Options, Parser, Tag, TagEnd, html};

const STYLE: &str = include_str!("style.css");

/// A whole page. `body` is HTML, `title` is text.
pub fn page(title: &str, body: &str) -> String {
    page_with(title, body, "")
}

/// What a page may load that is a file of its own: nothing but itself.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:";

/// The same with a class of its body.
pub fn page_with(title: &str, body: &str, class: &str) -> String {
    page_under(POLICY, title, body, class)
}

/// The same for a page that may load what a content security policy allows.
pub fn page_under(policy: &str, title: &str, body: &str, class: &str) -> String {
    let title = escape(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body class=\"{class}\">\n{body}</body>\n</html>\n"
    )
}

/// A text as HTML, also for the value of an attribute.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in shown(text).chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// A text as code.
pub fn code(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("<code>{}</code>", escape(text)) }
}

/// `ok` or `FAILED`.
pub fn verdict(passed: bool) -> &'static str {
    if passed { "<span class=\"good\">ok</span>" } else { "<span class=\"bad\">FAILED</span>" }
}

/// Which way the cells of a column are set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Words.
    Left,
    /// One word, not broken.
    Word,
    /// Numbers.
    Right,
}

/// A table of cells that are HTML already; empty without rows.
pub fn table(head: &[(&str, Side)], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let class = |side: Side| match side {
        Side::Left => "",
        Side::Word => " class=\"w\"",
        Side::Right => " class=\"n\"",
    };
    let mut out = String::from("<div class=\"wide\"><table>\n<thead><tr>");
    for (title, side) in head {
        out.push_str(&format!("<th{}>{}</th>", class(*side), escape(title)));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        out.push_str("<tr>");
        for (cell, (_, side)) in row.iter().zip(head) {
            out.push_str(&format!("<td{}>{cell}</td>", class(*side)));
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table></div>\n");
    out
}

/// Markdown as HTML, with its headings `lower` levels lower. HTML inside it is shown, not interpreted.
pub fn markdown(text: &str, lower: usize) -> String {
    let events = Parser::new_ext(text, Options::ENABLE_TABLES);
    let moved = events.map(|event| match event {
        Event::Start(Tag::Heading { level, classes, attrs, id }) => {
            Event::Start(Tag::Heading { level: lowered(level, lower), classes, attrs, id })
        }
        Event::End(TagEnd::Heading(level)) => Event::End(TagEnd::Heading(lowered(level, lower))),
        Event::Html(text) | Event::InlineHtml(text) => Event::Text(text),
        // Of a library's text: nothing that acts when it is clicked, nothing that is fetched.
        Event::Start(Tag::Link { link_type, dest_url, title, id }) => {
            let harmless = dest_url.starts_with('#') || is_page(&dest_url);
            let dest_url = if harmless { dest_url } else { "#".into() };
            Event::Start(Tag::Link { link_type, dest_url, title, id })
        }
        Event::Start(Tag::Image { link_type, title, id, .. }) => {
            Event::Start(Tag::Image { link_type, dest_url: "".into(), title, id })
        }
        other => other,
    });
    let mut out = String::new();
    html::push_html(&mut out, moved);
    out
}

/// Whether an address leads to a page, not to a script.
fn is_page(address: &str) -> bool {
    let scheme = address.split(['/', '?', '#']).next().and_then(|start| start.split_once(':'));
    scheme.is_none_or(|(scheme, _)| ["http", "https", "mailto"].iter().any(|one| scheme.eq_ignore_ascii_case(one)))
}

fn lowered(level: HeadingLevel, by: usize) -> HeadingLevel {
    HeadingLevel::try_from((level as usize + by).min(6)).unwrap_or(HeadingLevel::H6)
}
