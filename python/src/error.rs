//! Errors and warnings as Python has them.

use odyn::diagnostics::{Diagnostic, Source};
use odyn::session::SessionError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

/// `odyn._errors`.
static ERRORS: PyOnceLock<Py<PyModule>> = PyOnceLock::new();

/// What `odyn._errors.Diagnostic` is made of: code, severity, message, file, line, column, advice.
pub(crate) type Parts = (&'static str, &'static str, String, Option<String>, Option<usize>, Option<usize>, Vec<String>);

/// Diagnostics in the parts that Python makes its own of.
pub(crate) fn parts(diagnostics: &[Diagnostic], source: &Source) -> Vec<Parts> {
    let one = |diagnostic: &Diagnostic| {
        let place = diagnostic.span().map(|span| source.locate(span.start));
        let line = place.as_ref().map(|place| place.line);
        let column = place.as_ref().map(|place| place.column);
        let (code, severity) = (diagnostic.code.code, diagnostic.severity.word());
        (
            code,
            severity,
            diagnostic.message.clone(),
            place.map(|place| place.name),
            line,
            column,
            diagnostic.help.clone(),
        )
    };
    diagnostics.iter().map(one).collect()
}

/// `odyn.Error` of a session.
pub(crate) fn of_session(py: Python<'_>, error: &SessionError) -> PyErr {
    let made = || {
        let module = ERRORS.get_or_try_init(py, || py.import("odyn._errors").map(Bound::unbind))?;
        let text = error.render(false);
        let arguments = (text.trim_end(), parts(&error.diagnostics, &error.source), error.exit_code());
        module.bind(py).getattr("error_of")?.call1(arguments)
    };
    match made() {
        Ok(error) => PyErr::from_value(error),
        Err(error) => error,
    }
}

/// `odyn.Error` of a diagnostic that points into no text.
pub(crate) fn of_diagnostic(py: Python<'_>, diagnostic: Diagnostic) -> PyErr {
    of_session(py, &SessionError::one(&Source::new("", ""), diagnostic))
}
