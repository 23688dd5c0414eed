//! [`Session`]: a scene that was opened, with all that was found out and decided about it.

use super::checkpoint::{Checkpoint, Origin};
use super::error::SessionError;
use super::options::{ENGINES, RunOptions, tolerance};
use super::restart::Restart;
use crate::analysis::Assembly;
use crate::catalog::{Catalog, LibraryInfo};
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::model::Model;
use crate::plan::{Plan, Pruning};
use crate::program::Equations;
use crate::results::{MotionHeader, ResultsError};
use crate::scene::Scene;

/// A scene ready to run.
pub struct Session {
    /// The scene as written.
    pub scene: Scene,
    /// What the user should know.
    pub warnings: Vec<Diagnostic>,
    /// Libraries in use.
    pub libraries: Vec<LibraryInfo>,
    /// The resolved scene.
    pub model: Model,
    /// The equations, in working coordinates.
    pub equations: Equations,
    /// What was decided.
    pub plan: Plan,
    /// The start.
    pub assembly: Assembly,
    /// Where the start is a singular position, or next to one: time and state of the place ahead where ranks were found.
    pub(super) ahead: Option<(f64, Assembly)>,
    pub(super) options: RunOptions,
    /// Where the elements come from, for the islands.
    pub(super) catalog: Catalog,
    /// Whether islands take steps of their own, where that is said.
    pub(super) apart: Option<bool>,
    /// Where its run begins.
    pub(super) begins: Beginning,
    /// The scene file and the options, where it was opened from a file.
    pub(super) origin: Option<Origin>,
    /// Savings that are allowed.
    pub(super) pruning: Pruning,
    /// The time determines the motion: it is found, not integrated.
    pub(super) determined: bool,
    /// What a picture of the motion shows, where the run writes one.
    pub(super) shown: Option<MotionHeader>,
    /// Reading, loading, resolving, s.
    pub load_time: f64,
    /// Writing the equations, planning, assembling, s.
    pub compile_time: f64,
}

/// Where a run begins.
pub(super) struct Beginning {
    /// s.
    pub(super) time: f64,
    /// The time from which samples are counted, s: of a run in legs, the start of the first.
    pub(super) sampled_from: f64,
    /// The state that it continues from; none at the start of the scene.
    pub(super) state: Option<Restart>,
    /// The checkpoint that it is resumed from.
    pub(super) checkpoint: Option<Checkpoint>,
}

impl Session {
    /// Time and state where ranks are found.
    pub(super) fn place_of_ranks(&self) -> (f64, &Assembly) {
        match &self.ahead {
            Some((t, place)) => (*t, place),
            None => (self.begins.time, &self.assembly),
        }
    }

    /// Relative tolerance.
    pub(super) fn tolerance(&self) -> f64 {
        tolerance(&self.scene)
    }

    pub(super) fn unknown_word(&self, word: &str, method: bool) -> SessionError {
        let (what, names, written): (_, Vec<&str>, _) = if method {
            (
                "method",
                self.options.methods.list().iter().map(|method| method.name).collect(),
                &self.scene.simulation.method,
            )
        } else {
            ("engine", ENGINES.iter().map(|(name, _)| *name).collect(), &self.scene.simulation.engine)
        };
        let mut diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("there is no {what} `{word}`"));
        if let Some(written) = written {
            diagnostic = diagnostic.at(written.span.clone(), "unknown");
        }
        let nearest = suggest(word, names.iter().copied()).map(|nearest| format!("did you mean `{nearest}`?"));
        let known = format!("known are {}", names.join(", "));
        SessionError::one(&self.scene.source, diagnostic.help_if(nearest).help(known))
    }

    pub(super) fn no_step(&self, method: &str) -> SessionError {
        let mut diagnostic =
            Diagnostic::error(codes::UNKNOWN_METHOD, format!("the method `{method}` needs a step size"));
        if let Some(written) = &self.scene.simulation.method {
            diagnostic = diagnostic.at(written.span.clone(), "has no error control");
        }
        let help = "give it as `fixed_step` in [simulation], or use a method that chooses its steps: auto";
        SessionError::one(&self.scene.source, diagnostic.help(help))
    }

    pub(super) fn no_machine_code(&self, error: &crate::program::MachineError) -> SessionError {
        let mut diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("no engine `compiled`: {error}"));
        if let Some(written) = &self.scene.simulation.engine {
            diagnostic = diagnostic.at(written.span.clone(), "asked for here");
        }
        SessionError::one(&self.scene.source, diagnostic.help("`interpreted` gives the same results"))
    }

    pub(super) fn files_error(&self, error: &ResultsError) -> SessionError {
        let diagnostic = error.diagnostic();
        let kept = matches!(error, ResultsError::Write { .. }).then(|| "the rows up to here are kept".to_owned());
        SessionError::one(&self.scene.source, diagnostic.help_if(kept))
    }
}
