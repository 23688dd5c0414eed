//! [`check`]: what the solver says of a text, as `odyn check` and `odyn plan` do, and where everything is at the start.

use std::path::Path;

use odyn_diagnostics::{Diagnostic, Source};
use odyn_run::session::{RunOptions, Session, SessionError};
use serde::Serialize;
use serde_json::{Value, json};

/// A message for the editor. Offsets count UTF-16 units, as browsers do.
#[derive(Serialize)]
struct Message<'a> {
    code: &'a str,
    severity: &'static str,
    message: &'a str,
    /// What is said at the place itself.
    label: &'a str,
    help: &'a [String],
    from: usize,
    to: usize,
    /// `None`: it has no place in the text.
    line: Option<usize>,
}

/// Everything about a text that the page shows while it is written.
pub(crate) fn check(place: &Path, text: &str, options: &RunOptions) -> Value {
    let session = match Session::open_text(place, text.to_owned(), options) {
        Ok(session) => session,
        Err(error) => return refused(&error),
    };
    let messages = messages(&session.warnings, &session.scene.source);
    let report = session.check_report();
    let mut answer = json!({
        "ok": true,
        "messages": messages,
        "mobility": report.mobility,
        "redundant": report.redundant_rows,
        "report": report.to_string(),
        "plan": session.plan_report().to_string(),
    });
    match session.start_picture() {
        Ok((header, poses)) => answer["picture"] = json!({ "header": header, "poses": poses }),
        Err(error) => answer["messages"] = error_messages(&error),
    }
    answer
}

/// The answer for a text that cannot be run.
pub(crate) fn refused(error: &SessionError) -> Value {
    json!({ "ok": false, "messages": error_messages(error) })
}

fn error_messages(error: &SessionError) -> Value {
    json!(messages(&error.diagnostics, &error.source))
}

fn messages<'a>(diagnostics: &'a [Diagnostic], source: &Source) -> Vec<Message<'a>> {
    let text = &source.text;
    let units = |offset: usize| {
        let offset = (0..=offset.min(text.len())).rev().find(|k| text.is_char_boundary(*k)).unwrap_or(0);
        text[..offset].encode_utf16().count()
    };
    let one = |diagnostic: &'a Diagnostic| {
        let span = diagnostic.span().filter(|span| span.start <= text.len());
        let own = diagnostic.labels.iter().find(|label| label.primary);
        Message {
            code: diagnostic.code.code,
            severity: diagnostic.severity.word(),
            message: &diagnostic.message,
            label: own.map_or("", |label| label.text.as_str()),
            help: &diagnostic.help,
            from: span.as_ref().map_or(0, |span| units(span.start)),
            to: span.as_ref().map_or(0, |span| units(span.end)),
            line: span.map(|span| source.locate(span.start).line),
        }
    };
    diagnostics.iter().map(one).collect()
}
