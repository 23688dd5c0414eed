//! [`SessionError`]: why there is no result, in words, and the exit code that goes with it.

use crate::diagnostics::{Diagnostic, Source, codes, render, summary};

/// Exit codes of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// The scene or the model has mistakes.
    Scene = 3,
    /// A library can't be had or is broken.
    Plugin = 4,
    /// The joints cannot be assembled.
    Assembly = 5,
    /// The integration ended before its end.
    Integration = 6,
    /// The audit, or a comparison, found more than was allowed.
    Audit = 7,
    /// Files can't be read or written.
    Files = 8,
}

/// Why there is no result.
#[derive(Debug)]
pub struct SessionError {
    /// Exit code of the program.
    pub exit: Exit,
    /// What was found.
    pub diagnostics: Vec<Diagnostic>,
    /// The text their spans point into.
    pub source: Box<Source>,
}

impl SessionError {
    /// One diagnostic.
    #[must_use]
    pub fn one(exit: Exit, source: &Source, diagnostic: Diagnostic) -> Self {
        Self { exit, diagnostics: vec![diagnostic], source: Box::new(source.clone()) }
    }

    /// The text for the user.
    #[must_use]
    pub fn render(&self, color: bool) -> String {
        let mut text = render(&self.diagnostics, &self.source, color);
        if self.diagnostics.len() > 1 {
            text.push_str(&summary(&self.diagnostics));
            text.push('\n');
        }
        text
    }

    /// The exit code of the program.
    #[must_use]
    pub fn exit_code(&self) -> i32 {
        self.exit as i32
    }
}

impl std::fmt::Display for SessionError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for SessionError {}

/// A motion that cannot start.
pub(super) fn start_error(scene: &crate::scene::Scene, error: &dyn std::fmt::Display) -> SessionError {
    let diagnostic = Diagnostic::error(codes::SINGULAR_MASS, format!("the motion cannot start: {error}"))
        .help("check masses, inertias and the equations of the elements");
    SessionError::one(Exit::Integration, &scene.source, diagnostic)
}
