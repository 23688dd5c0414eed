//! Diagnostics: what the host says to its user, as data.
//!
//! - **Takes**: a code, a sentence and byte ranges of a source text, from any room.
//! - **Gives**: [`Diagnostic`] values, their rendering in the style of a compiler, the table of all codes, and
//!   "did you mean".
//! - **May touch**: nothing; rendering returns a `String`.
//! - **Must not know**: scenes, plugins, mathematics, terminals. This room is a leaf.
//!
//! ```text
//! error[ODY0102]: unknown key `vellocity` in body `rotor`
//!   --> compressor.toml:14:1
//!    |
//! 14 | vellocity = [0, 0, 0]
//!    | ^^^^^^^^^ not a key of a body
//!    |
//!    = help: did you mean `velocity`?
//! ```

pub mod codes;
mod exit;
mod render;
mod shown;
mod source;
mod suggest;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use exit::Exit;
pub use render::{render, summary};
pub use shown::{counted, shown, shown_on_one_line};
pub use source::{Location, Source, line_column};
pub use suggest::{containing, help_for, suggest};

use std::ops::Range;

/// One of the constants of [`codes`]; displayed as `ODY0102`.
pub type Code = &'static codes::Entry;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Nothing can be computed.
    Error,
    /// It can be computed, but probably isn't what was meant.
    Warning,
    /// Worth knowing.
    Note,
}

impl Severity {
    /// The word printed in front of a message: `error`, `warning` or `note`.
    pub fn word(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        }
    }
}

/// A remark attached to a place of the source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// Byte range in the [`Source`]; `None` where there is no place to point to.
    pub span: Option<Range<usize>>,
    /// The remark; may be empty.
    pub text: String,
    /// True for the culprit (underlined `^^^`, gives line and column), false for context (`---`).
    pub primary: bool,
}

/// One message to the user: what is wrong, where, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Stable code, a constant of [`codes`].
    pub code: Code,
    /// How bad it is.
    pub severity: Severity,
    /// One sentence without a final full stop.
    pub message: String,
    /// Places of the source, the culprit first.
    pub labels: Vec<Label>,
    /// Advice, one line each.
    pub help: Vec<String>,
}

impl Diagnostic {
    /// A diagnostic of the given severity without places and advice.
    pub fn new(severity: Severity, code: Code, message: impl Into<String>) -> Self {
        Diagnostic { code, severity, message: message.into(), labels: Vec::new(), help: Vec::new() }
    }

    /// An error without places and advice.
    pub fn error(code: Code, message: impl Into<String>) -> Self {
        Diagnostic::new(Severity::Error, code, message)
    }

    /// A warning without places and advice.
    pub fn warning(code: Code, message: impl Into<String>) -> Self {
        Diagnostic::new(Severity::Warning, code, message)
    }

    /// A note without places and advice.
    pub fn note(code: Code, message: impl Into<String>) -> Self {
        Diagnostic::new(Severity::Note, code, message)
    }

    /// Points at the culprit; `text` may be empty.
    #[must_use]
    pub fn at(mut self, span: Range<usize>, text: impl Into<String>) -> Self {
        self.labels.push(Label { span: Some(span), text: text.into(), primary: true });
        self
    }

    /// Points at another place that explains the culprit.
    #[must_use]
    pub fn context(mut self, span: Range<usize>, text: impl Into<String>) -> Self {
        self.labels.push(Label { span: Some(span), text: text.into(), primary: false });
        self
    }

    /// Adds a line of advice.
    #[must_use]
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help.push(text.into());
        self
    }

    /// Adds a line of advice if there is one, as [`help_for`] returns it.
    #[must_use]
    pub fn help_if(mut self, text: Option<String>) -> Self {
        self.help.extend(text);
        self
    }

    /// True for [`Severity::Error`].
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// Byte range of the culprit: the first primary label that has one.
    pub fn span(&self) -> Option<Range<usize>> {
        self.labels.iter().filter(|label| label.primary).find_map(|label| label.span.clone())
    }
}
