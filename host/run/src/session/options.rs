//! [`RunOptions`]: what the command line adds to a scene; and the words that scenes choose by.

use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::common::Common;
use super::error::SessionError;
use super::opened::Session;
use super::restart::Restart;
use crate::catalog::Watchdog;
use crate::diagnostics::{Diagnostic, codes};
use crate::integrate::Methods;
use crate::model::{Channel, Model};
use crate::scene::{AuditTolerance, Override, Scene, Spanned};

/// Finds a state to begin at, with what must be said about it, from a scene at the start that it gives.
pub type FindStart = fn(&Session) -> Result<(Restart, Vec<Diagnostic>), SessionError>;

/// What whoever runs a scene does once the run is at its end. Checkpoints keep it for the one who resumes the run, until
/// [`Checkpoint::done`](super::Checkpoint::done).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Afterwards {
    /// Compares it with [`Session::sharper`].
    pub verify: bool,
    /// Judges its digits by [`Session::second`].
    pub digits: bool,
    /// Makes a page of it.
    pub report: bool,
}

/// What the command line adds to a scene.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// `--set` texts, and options that stand for them.
    pub overrides: Vec<Override>,
    /// Files and folders of `--plugin`.
    pub plugins: Vec<PathBuf>,
    /// What the audit may find; the scene's own where absent.
    pub audit_tolerance: Option<AuditTolerance>,
    /// Folder for private copies of libraries; the user's cache folder where absent.
    pub library_copies: Option<PathBuf>,
    /// The methods of integration that scenes may ask for.
    pub methods: Methods,
    /// Threads for islands that run apart; 0 = as many as the machine has processors. Results do not depend on it.
    pub jobs: usize,
    /// Channels to take besides those that a scene asks for, behind them.
    pub further_channels: Option<fn(&Model) -> Vec<Channel>>,
    /// What is had in common with other runs, if anything is. Results do not depend on it.
    pub common: Option<Common>,
    /// Whether sessions are only run, so that what no run asks for need not be written. Results do not depend on it.
    pub runs_only: bool,
    /// Whether what takes longer than to open a scene is looked at, too: parameters that change nothing (ODY0328). Only warnings depend
    /// on it.
    pub thoroughly: bool,
    /// Ends of the steps to take instead of those that error control would choose, s: see [`crate::integrate::Options::steps`]. For
    /// scenes in which no contact closes and nothing switches.
    pub steps: Option<Arc<[f64]>>,
    /// How the equilibrium is found that a scene with `start = "equilibrium"` begins at: `odyn::analyses::statics::start`. Such scenes are
    /// refused where this is absent.
    pub equilibrium: Option<FindStart>,
    /// What is done with the run once it is at its end, by others than [`Session::run`].
    pub afterwards: Afterwards,
    /// Who watches the calls into libraries that are loaded.
    pub watchdog: Option<Watchdog>,
}

/// Relative tolerance where the scene gives none.
pub(super) const DEFAULT_TOLERANCE: f64 = 1e-10;

/// Relative tolerance of a scene.
pub(super) fn tolerance(scene: &Scene) -> f64 {
    scene.simulation.tolerance.unwrap_or(DEFAULT_TOLERANCE)
}

/// Engines and what each does.
pub const ENGINES: &[(&str, &str)] = &[
    ("auto", "machine code where and as soon as it pays, the rest interpreted; the same results, bit for bit"),
    ("compiled", "machine code from the first step on: six velocities per body, pruned operations, sparse elimination"),
    ("interpreted", "the same without machine code"),
    ("reference", "the paper's Eq. (6): seven coordinates per body, dense; slow, for comparison"),
];

/// Method where the scene gives none. `auto` costs no more, and much less on stiff scenes, but there keeps to the tolerance
/// only, while some scenes check the far smaller errors that the explicit method's tiny steps happen to have.
pub const DEFAULT_METHOD: &str = "dop853";

/// Formulations and what each does.
pub const FORMULATIONS: &[(&str, &str)] = &[
    ("auto", "the one with fewer operations per evaluation, as predicted"),
    ("cartesian", "six velocities per body, every joint as constraint rows, sparse elimination"),
    ("joint", "the joints' own coordinates along a spanning tree; rows only for what closes loops"),
];

/// The words for `start` of `[simulation]`: whether it is at equilibrium.
pub(super) const STARTS: [(&str, bool); 2] = [("given", false), ("equilibrium", true)];

/// The words for `islands` of `[simulation]`: whether they run apart, if that is said.
pub(super) const ISLANDS: [(&str, Option<bool>); 3] =
    [("auto", None), ("together", Some(false)), ("apart", Some(true))];

/// What the word of a setting stands for; the first of all where none is given.
pub(super) fn one_of<T: Copy>(
    key: &str,
    word: Option<&Spanned<String>>,
    known: &[(&str, T)],
    scene: &Scene,
) -> Result<T, SessionError> {
    let Some(word) = word else { return Ok(known[0].1) };
    if let Some((_, meant)) = known.iter().find(|(name, _)| *name == word.value) {
        return Ok(*meant);
    }
    let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
    let diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("`{key}` cannot be `{}`", word.value))
        .at(word.span.clone(), "unknown")
        .help(format!("known are {}", names.join(", ")));
    Err(SessionError::one(&scene.source, diagnostic))
}
