//! [`Model`]: a scene with what is set of it.

use std::path::{Path, PathBuf};

use odyn::analyses::statics;
use odyn::diagnostics::{Diagnostic, Source, codes};
use odyn::scene::{AuditTolerance, Document, Override, Rejected};
use odyn::session::{Common, Restart, RunOptions, Session, SessionError};
use pyo3::prelude::*;
use serde::Serialize;

use crate::error::{self, Parts};
use crate::run::Run;
use crate::work::beside;

/// A scene with what is set of it. It does not change; what it gives is opened anew each time, with libraries that are loaded once.
#[pyclass(frozen, module = "odyn._odyn")]
#[derive(Clone)]
pub(crate) struct Model {
    /// Where the scene is, or would be.
    path: PathBuf,
    /// Whether it is there.
    in_file: bool,
    document: Document,
    overrides: Vec<String>,
    plugins: Vec<PathBuf>,
    audit: Option<AuditTolerance>,
    common: Common,
}

/// A report as text and as JSON, with the warnings of the scene.
type Told = (String, String, Vec<Parts>);

#[pymethods]
impl Model {
    /// Reads a scene, from its text where that is given.
    #[new]
    #[pyo3(signature = (path, text=None, plugins=Vec::new()))]
    fn open(py: Python<'_>, path: PathBuf, text: Option<String>, plugins: Vec<PathBuf>) -> PyResult<Self> {
        let in_file = text.is_none();
        let read = match text {
            Some(text) => Document::parse(Source::new(path.display().to_string(), text)),
            None => Document::open(&path),
        };
        let document = read.map_err(|rejected| error::of_session(py, &SessionError::from(*rejected)))?;
        let model =
            Self { path, in_file, document, overrides: Vec::new(), plugins, audit: None, common: Common::default() };
        model.readable(py)
    }

    /// The same with further `KEY=VALUE` texts, behind those it has.
    fn set(&self, py: Python<'_>, texts: Vec<String>) -> PyResult<Self> {
        let mut changed = self.clone();
        changed.overrides.extend(texts);
        changed.readable(py)
    }

    /// The same with another limit of the audit: a number, or `None` for none.
    fn audited(&self, limit: Option<f64>) -> Self {
        Self { audit: Some(limit.map_or(AuditTolerance::None, AuditTolerance::Limit)), ..self.clone() }
    }

    /// The scene file.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// The text of the scene.
    #[getter]
    fn text(&self) -> String {
        self.document.source().text.to_string()
    }

    /// Further libraries and folders.
    #[getter]
    fn plugins(&self) -> Vec<PathBuf> {
        self.plugins.clone()
    }

    /// What is set of it, as `KEY=VALUE`.
    #[getter]
    fn overrides(&self) -> Vec<String> {
        self.overrides.clone()
    }

    /// Mobility, redundant rows, reactions that are not unique.
    fn check(&self, py: Python<'_>) -> PyResult<Told> {
        self.told(py, Session::check_report)
    }

    /// How the scene would be computed.
    fn plan(&self, py: Python<'_>) -> PyResult<Told> {
        self.told(py, Session::plan_report)
    }

    /// Integrates the scene, into a folder where one is given, from the state in `start` where that is given.
    #[pyo3(signature = (folder=None, start=None, jobs=0, progress=None))]
    fn run(
        &self,
        py: Python<'_>,
        folder: Option<PathBuf>,
        start: Option<PathBuf>,
        jobs: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Run> {
        let options = RunOptions { jobs, ..self.options() };
        let report = beside(py, progress.as_ref(), true, |desk| {
            let mut session = self.session_with(&options)?;
            if let Some(start) = &start {
                session.go_on_from(restart(&session, start)?)?;
            }
            session.run(folder.as_deref(), Box::new(desk.listener()), &desk.stop)
        })?;
        Run::new(py, report.map_err(|error| error::of_session(py, &error))?)
    }
}

impl Model {
    /// Reads the scene with what is set of it, so that mistakes are reported where they are made.
    fn readable(self, py: Python<'_>) -> PyResult<Self> {
        match self.document.clone().scene(&self.options().overrides) {
            Ok(_) => Ok(self),
            Err(rejected) => Err(error::of_session(py, &SessionError::from(Rejected::clone(&rejected)))),
        }
    }

    /// The options of a run.
    pub(crate) fn options(&self) -> RunOptions {
        RunOptions {
            overrides: self.overrides.iter().map(Override::new).collect(),
            plugins: self.plugins.clone(),
            audit_tolerance: self.audit,
            common: Some(self.common.clone()),
            equilibrium: Some(statics::start),
            ..RunOptions::default()
        }
    }

    /// The scene, opened.
    pub(crate) fn session(&self) -> Result<Session, SessionError> {
        self.session_with(&self.options())
    }

    /// The same with other options.
    pub(crate) fn session_with(&self, options: &RunOptions) -> Result<Session, SessionError> {
        Session::of_document(&self.path, &self.document, options)
    }

    /// The scene file, for what reads it itself.
    ///
    /// # Errors
    /// There is none, or it has changed since it was loaded.
    pub(crate) fn file(&self) -> Result<&Path, SessionError> {
        let refuse = |message: String, help: &str| {
            SessionError::one(self.document.source(), Diagnostic::error(codes::UNREADABLE, message).help(help))
        };
        if !self.in_file {
            let message = "the scene is a text, and this analysis reads scene files".to_owned();
            return Err(refuse(message, "write the text to a file and load that, or leave out `folder`"));
        }
        match std::fs::read_to_string(&self.path) {
            Ok(text) if *text == *self.document.source().text => Ok(&self.path),
            Ok(_) => Err(refuse(format!("`{}` has changed since it was loaded", self.path.display()), "load it again")),
            Err(error) => Err(refuse(format!("cannot read `{}`: {error}", self.path.display()), "load it again")),
        }
    }

    fn told<T: Serialize + std::fmt::Display + Send>(
        &self,
        py: Python<'_>,
        report: fn(&Session) -> T,
    ) -> PyResult<Told> {
        let found = beside(py, None, false, |_| {
            let session = self.session()?;
            let report = report(&session);
            Ok((report.to_string(), json(&report), parts_of(&session)))
        })?;
        found.map_err(|error: SessionError| error::of_session(py, &error))
    }
}

/// The warnings of a scene.
pub(crate) fn parts_of(session: &Session) -> Vec<Parts> {
    error::parts(&session.warnings, &session.scene.source)
}

/// The state that a run left in a folder.
pub(crate) fn restart(session: &Session, folder: &Path) -> Result<Restart, SessionError> {
    Restart::read(folder).map_err(|diagnostic| SessionError::one(&session.scene.source, *diagnostic))
}

/// JSON of plain structs; numbers that are not finite are `null`.
pub(crate) fn json<T: Serialize>(value: &T) -> String {
    serde_json::to_string(value).unwrap_or_else(|error| format!("{{\"error\": \"{error}\"}}"))
}
