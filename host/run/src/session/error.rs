//! [`SessionError`]: why there is no result, in words, and the exit code that goes with it.

use crate::analysis::AnalysisError;
use crate::catalog::fault_code;
use crate::diagnostics::{Diagnostic, Exit, Source, codes, render, summary};
use crate::model::Model;
use crate::scene::Scene;

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
    /// One diagnostic, with the exit code of its kind.
    #[must_use]
    pub fn one(source: &Source, diagnostic: Diagnostic) -> Self {
        Self::new(source, vec![diagnostic])
    }

    /// Several diagnostics. Mistakes of the scene count before defects of libraries, and these before what follows from both.
    #[must_use]
    pub fn new(source: &Source, diagnostics: Vec<Diagnostic>) -> Self {
        let exits =
            diagnostics.iter().filter(|diagnostic| diagnostic.is_error()).map(|diagnostic| diagnostic.code.exit);
        Self { exit: exits.min().unwrap_or(Exit::Scene), diagnostics, source: Box::new(source.clone()) }
    }

    /// The same at the end of an integration.
    pub(super) fn of_integration(self) -> Self {
        Self { exit: Exit::Integration, ..self }
    }

    /// The same of an option that cannot be read.
    #[must_use]
    pub fn of_usage(self) -> Self {
        Self { exit: Exit::Usage, ..self }
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

/// The element behind a failure, with its place in the scene; `when` says when it failed.
pub(super) fn fault_of_element(scene: &Scene, model: &Model, error: &AnalysisError, when: &str) -> Option<Diagnostic> {
    let AnalysisError::Element { set, fault } = error else { return None };
    let instance = model.elements.iter().find(|e| e.set == *set && e.index as usize == fault.instance)?;
    let record = scene.elements.iter().find(|record| record.name.value == instance.name)?;
    let who = format!("`{}` ({}/{})", instance.name, instance.library, instance.class.name);
    let code = fault_code(&fault.message);
    let diagnostic =
        Diagnostic::error(code, format!("{who} failed {when}: {}", fault.message)).at(record.name.span.clone(), "");
    if code == codes::FMU_FAILED || code == codes::FMU_WITHOUT_STATE {
        return Some(diagnostic);
    }
    Some(diagnostic.help("this is a defect of the library; its author will want this message"))
}

/// A motion that cannot start.
pub(super) fn start_error(scene: &Scene, model: &Model, error: &AnalysisError) -> SessionError {
    if let Some(fault) = fault_of_element(scene, model, error, "at the start") {
        return SessionError::one(&scene.source, fault);
    }
    let diagnostic = Diagnostic::error(codes::SINGULAR_MASS, format!("the motion cannot start: {error}"))
        .help("check masses, inertias and the equations of the elements");
    SessionError::one(&scene.source, diagnostic).of_integration()
}
