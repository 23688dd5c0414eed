//! [`Failure`]: why a command failed.

use std::time::Duration;

use serde::Serialize;

use odyn::catalog::{CatalogError, Late, Watchdog};
use odyn::diagnostics::{Diagnostic, Source, codes, render, summary};
use odyn::results::ResultsError;
use odyn::session::SessionError;

use super::exit;
use super::terminal::{self, Stream};

/// An exit code with a message for the user.
#[derive(Debug)]
pub(super) struct Failure {
    /// Exit code of the program.
    pub(super) exit: u8,
    diagnostics: Vec<Diagnostic>,
    source: Source,
}

impl Failure {
    /// A failure that has no place in a text.
    pub(super) fn new(diagnostic: Diagnostic) -> Self {
        Self { exit: diagnostic.code.exit as u8, diagnostics: vec![diagnostic], source: Source::new("", "") }
    }

    /// The same with another exit code than that of its message.
    pub(super) fn exit(self, exit: u8) -> Self {
        Self { exit, ..self }
    }

    /// Diagnostics with the text they point into.
    pub(super) fn of_source(exit: u8, diagnostics: Vec<Diagnostic>, source: &Source) -> Self {
        Self { exit, diagnostics, source: source.clone() }
    }

    /// Prints the failure; for programs also on standard output, so that there is always JSON to read.
    pub(super) fn tell(&self, json: bool) {
        if json {
            #[derive(Serialize)]
            struct Failed<'a> {
                status: &'static str,
                exit_code: u8,
                diagnostics: Vec<Message<'a>>,
            }
            let diagnostics = messages(&self.diagnostics, &self.source);
            let failed = Failed { status: "failed", exit_code: self.exit, diagnostics };
            // Standard error gets the same, so a failure here needs no second message.
            let _ = terminal::print_as_it_is(&terminal::json(&failed));
        }
        let mut text = render(&self.diagnostics, &self.source, terminal::color(Stream::Error));
        if self.diagnostics.len() > 1 && self.diagnostics.iter().any(Diagnostic::is_error) {
            text.push_str(&summary(&self.diagnostics));
        }
        eprintln!("{}", text.trim_end());
    }
}

impl From<SessionError> for Failure {
    fn from(error: SessionError) -> Self {
        Self { exit: error.exit as u8, diagnostics: error.diagnostics, source: *error.source }
    }
}

impl From<ResultsError> for Failure {
    fn from(error: ResultsError) -> Self {
        Self::new(error.diagnostic())
    }
}

impl From<CatalogError> for Failure {
    fn from(error: CatalogError) -> Self {
        let exit = if matches!(error, CatalogError::Files { .. }) { exit::FILES } else { exit::PLUGIN };
        Self::new(error.diagnostic()).exit(exit)
    }
}

/// Standard output that takes no more.
impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Self::new(Diagnostic::error(codes::CANNOT_WRITE, format!("cannot write the output: {error}")))
    }
}

/// A file or folder that cannot be written.
pub(super) fn cannot_write(path: &std::path::Path, error: &std::io::Error) -> Failure {
    let message = format!("cannot write `{}`: {error}", path.display());
    Failure::new(Diagnostic::error(codes::CANNOT_WRITE, message))
}

/// A call into a library that has taken so long is reported, s.
const TOLD_AFTER: f64 = 10.0;

/// Watches the calls into libraries. With `limit` (s), one that takes longer ends the program: its thread cannot be ended, nor
/// can results be completed while it may hold them, but those on disk are whole rows. Without, it is reported and waited for: an
/// element that computes for long is not broken, and only the user knows how long that may be. A call that crashes is reported, too.
pub(super) fn watchdog(limit: Option<f64>, json: bool) -> Watchdog {
    #[cfg(unix)]
    odyn::catalog::tell_crashes();
    let patience = Duration::from_secs_f64(limit.unwrap_or(TOLD_AFTER));
    let told = move |late: &Late| {
        if limit.is_some() {
            Failure::new(late_diagnostic(late, true)).tell(json);
            super::end(exit::PLUGIN);
        }
        Failure::new(late_diagnostic(late, false)).tell(false);
    };
    Watchdog::start(patience, told)
}

/// What is reported of a call that does not return.
pub(super) fn late_diagnostic(late: &Late, ends: bool) -> Diagnostic {
    if ends {
        return Diagnostic::error(codes::PLUGIN_HANGS, late.to_string())
            .help("ended as --watchdog asks; rows of results up to there are on disk, but for the last moments");
    }
    Diagnostic::warning(codes::PLUGIN_HANGS, late.to_string())
        .help("waiting; Ctrl-C twice ends the program, --watchdog SECONDS does so by itself")
}

/// A diagnostic for programs.
#[derive(Debug, Serialize)]
pub(super) struct Message<'a> {
    code: &'a str,
    severity: &'static str,
    message: &'a str,
    file: Option<String>,
    line: Option<usize>,
    column: Option<usize>,
    help: &'a [String],
}

/// Diagnostics for programs, with the place of the culprit as a user counts it.
pub(super) fn messages<'a>(diagnostics: &'a [Diagnostic], source: &Source) -> Vec<Message<'a>> {
    let one = |diagnostic: &'a Diagnostic| {
        let place = diagnostic.span().map(|span| source.locate(span.start));
        Message {
            code: diagnostic.code.code,
            severity: diagnostic.severity.word(),
            message: &diagnostic.message,
            line: place.as_ref().map(|place| place.line),
            column: place.as_ref().map(|place| place.column),
            file: place.map(|place| place.name),
            help: &diagnostic.help,
        }
    };
    diagnostics.iter().map(one).collect()
}
