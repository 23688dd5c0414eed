//! The frame of a page, tables, escaping, Markdown.

use crate::diagnostics::shown;
use pulldown_cmark::{Event, HeadingLevel, Options, Parser, Tag, TagEnd, html};

const STYLE: &str = "\
:root{color-scheme:light dark;--line:#8886;--faint:#8881;--good:#1a7f37;--bad:#c62828}
@media(prefers-color-scheme:dark){:root{--good:#4cc38a;--bad:#ff7b72}}
body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem}
h1{margin-bottom:.2rem}h2{margin-top:2.2rem;border-bottom:1px solid var(--line)}
h3{margin-top:1.6rem}.lead{font-size:1.1rem;margin-top:0}.small{font-size:.875rem;opacity:.8}
.wide{overflow-x:auto}table{border-collapse:collapse;margin:.8rem 0;font-size:.9rem}
th,td{padding:.25rem .7rem .25rem 0;text-align:left;vertical-align:top;border-bottom:1px solid var(--line)}
th{font-weight:600}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}.n,.w{white-space:nowrap}
code,pre{font:.875em/1.45 ui-monospace,monospace}code{background:var(--faint);padding:0 .2em;border-radius:3px}
pre{background:var(--faint);padding:.7rem 1rem;overflow-x:auto;border-radius:4px}pre code{background:none;padding:0}
.good{color:var(--good)}.bad{color:var(--bad);font-weight:600}
figure{margin:1.2rem 0}figcaption{font-size:.875rem}svg{display:block;width:100%;height:auto}
.key{list-style:none;display:flex;flex-wrap:wrap;gap:.1rem 1.2rem;padding:0;margin:.2rem 0;font-size:.875rem}
.key i{display:inline-block;width:1.4rem;height:0;border-top:3px solid;vertical-align:middle;margin-right:.4rem}
";

/// A whole page. `body` is HTML, `title` is text.
pub(crate) fn page(title: &str, body: &str) -> String {
    let title = escape(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
    )
}

/// A text as HTML, also for the value of an attribute.
pub(crate) fn escape(text: &str) -> String {
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
pub(crate) fn code(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("<code>{}</code>", escape(text)) }
}

/// `ok` or `FAILED`.
pub(crate) fn verdict(passed: bool) -> &'static str {
    if passed { "<span class=\"good\">ok</span>" } else { "<span class=\"bad\">FAILED</span>" }
}

/// Which way the cells of a column are set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// Words.
    Left,
    /// One word, not broken.
    Word,
    /// Numbers.
    Right,
}

/// A table of cells that are HTML already; empty without rows.
pub(crate) fn table(head: &[(&str, Side)], rows: &[Vec<String>]) -> String {
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
pub(crate) fn markdown(text: &str, lower: usize) -> String {
    let events = Parser::new_ext(text, Options::ENABLE_TABLES);
    let moved = events.map(|event| match event {
        Event::Start(Tag::Heading { level, classes, attrs, id }) => {
            Event::Start(Tag::Heading { level: lowered(level, lower), classes, attrs, id })
        }
        Event::End(TagEnd::Heading(level)) => Event::End(TagEnd::Heading(lowered(level, lower))),
        Event::Html(text) | Event::InlineHtml(text) => Event::Text(text),
        other => other,
    });
    let mut out = String::new();
    html::push_html(&mut out, moved);
    out
}

fn lowered(level: HeadingLevel, by: usize) -> HeadingLevel {
    HeadingLevel::try_from((level as usize + by).min(6)).unwrap_or(HeadingLevel::H6)
}
