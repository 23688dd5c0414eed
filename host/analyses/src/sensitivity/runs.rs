//! [`Variants`]: a scene that is run again and again with other numbers, by steps of its own or by those of another run.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::catalog::Catalog;
use crate::diagnostics::{Diagnostic, Exit, codes};
use crate::results::{Remedy, Status};
use crate::scene::{Dimension, Document, OutputTimes, Override, Scene, Spanned};
use crate::session::{DEFAULT_METHOD, RunOptions, RunReport, Session, SessionError, catalog_of_scene};

/// Methods that can follow the steps of another run.
const FOLLOWING: [&str; 3] = ["dop853", "dopri5", "radau5"];
/// Method for the steps of a run in which `auto` took turns.
const IMPLICIT: &str = "radau5";

/// A scene file with what its variants have in common.
pub(crate) struct Variants {
    pub(crate) document: Document,
    pub(crate) options: RunOptions,
    catalog: Catalog,
    /// Times of the samples, s; the scene's own where absent.
    pub(crate) times: Option<Vec<f64>>,
    /// Which of these samples figures are taken from; all where absent.
    pub(crate) of_figures: Option<Vec<usize>>,
    pub(crate) stop: Arc<AtomicBool>,
}

/// How a variant is computed.
#[derive(Debug, Clone, Default)]
pub(crate) struct Way {
    pub(crate) tolerance: Option<f64>,
    pub(crate) fixed_step: Option<f64>,
    pub(crate) method: Option<String>,
    pub(crate) formulation: Option<String>,
    /// Ends of the steps to take.
    pub(crate) steps: Option<Arc<[f64]>>,
}

/// A run that reached its end.
pub(crate) struct Done {
    pub(crate) report: RunReport,
    /// Ends of its steps, s.
    pub(crate) steps: Arc<[f64]>,
    /// The scene's unit of time, s.
    pub(crate) unit_of_time: f64,
}

impl Done {
    /// Whether contacts, switches or anything else ended steps, so that others have to meet them themselves.
    pub(crate) fn met_events(&self) -> bool {
        const ENDING: [Remedy; 4] = [Remedy::Event, Remedy::Chatter, Remedy::WithinStep, Remedy::Missed];
        let summary = &self.report.summary;
        !self.report.events.is_empty() || ENDING.into_iter().any(|remedy| summary.recoveries[remedy] > 0)
    }
}

impl Variants {
    pub(crate) fn open(path: &Path, options: &RunOptions, stop: &Arc<AtomicBool>) -> Result<Self, SessionError> {
        let mut options = options.clone();
        options.common.get_or_insert_default();
        // Variants share the processors; none takes several.
        options.jobs = 1;
        let document = Document::open(path).map_err(|rejected| SessionError::from(*rejected))?;
        let catalog = catalog_of_scene(path, &options)?;
        Ok(Self { document, options, catalog, times: None, of_figures: None, stop: Arc::clone(stop) })
    }

    /// A session of the scene with changes.
    pub(crate) fn session(&self, changes: &[Override], way: &Way) -> Result<Session, SessionError> {
        let mut options = self.options.clone();
        options.overrides.extend(changes.iter().cloned());
        options.steps = way.steps.clone();
        let read = self.document.clone().scene(&options.overrides).map_err(|rejected| SessionError::from(*rejected));
        let (mut scene, warnings) = read?;
        self.settle(&mut scene, way);
        Session::with_catalog(scene, warnings, &self.catalog, &options)
    }

    fn settle(&self, scene: &mut Scene, way: &Way) {
        let word = |word: &str| Spanned::new(word.to_owned(), 0..0);
        let settings = &mut scene.simulation;
        settings.tolerance = way.tolerance.or(settings.tolerance);
        settings.fixed_step = way.fixed_step.or(settings.fixed_step);
        if let Some(method) = &way.method {
            settings.method = Some(word(method));
        }
        if let Some(formulation) = &way.formulation {
            settings.formulation = Some(word(formulation));
        }
        // Steps of one kind for all that moves.
        settings.islands = Some(word("together"));
        settings.checkpoint_every = None;
        settings.motion = false;
        if let Some(times) = &self.times {
            settings.output = OutputTimes::Times(times.clone());
        }
    }

    /// Runs the scene with changes to its end.
    ///
    /// # Errors
    /// Why it cannot be opened, or did not get there.
    pub(crate) fn run(&self, changes: &[Override], way: &Way) -> Result<Done, SessionError> {
        let session = self.session(changes, way)?;
        let [from, to] = [session.time_of_start(), session.scene.simulation.t_end];
        let source = session.scene.source.clone();
        let with_figures = self.of_figures.as_ref().map(|samples| (session.scene.clone(), samples));
        let unit_of_time = session.scene.units.factor(Dimension::TIME);
        let mut steps = Vec::new();
        let progress = |share: f64| steps.push(from + share * (to - from));
        let mut report = session.run(None, Box::new(progress), &self.stop)?;
        if let Some((scene, samples)) = with_figures {
            report.summary.figures = report.figures_at(&scene, samples);
        }
        if report.summary.status.reached_end() {
            return Ok(Done { report, steps: steps.into(), unit_of_time });
        }
        let summary = &report.summary;
        let code = summary.code.unwrap_or(codes::STEP_TOO_SMALL);
        let message = format!(
            "the run ended at t = {} {}: {}",
            odyn_run::results::significant(summary.t_end_reached, 6),
            summary.time_unit,
            summary.reason
        );
        let mut error = SessionError::one(&source, Diagnostic::error(code, message));
        error.exit = if summary.code == Some(codes::INTERRUPTED) { Exit::Interrupted } else { Exit::Integration };
        Err(error)
    }

    /// The scene's own run, and how its variants are computed at a share of its tolerance (or of its step, where that is fixed).
    ///
    /// # Errors
    /// That of the run.
    pub(crate) fn nominal(&self, changes: &[Override]) -> Result<Nominal, SessionError> {
        let session = self.session(changes, &Way::default())?;
        let settings = &session.scene.simulation;
        let name = settings.method.as_ref().map_or(DEFAULT_METHOD, |method| method.value.as_str()).to_owned();
        let needs_step = self.options.methods.make(&name).is_some_and(|method| method.needs_fixed_step());
        let fixed = settings.fixed_step.or(settings.max_step.filter(|_| needs_step));
        let tolerance = settings.tolerance;
        let switching = session.equations.has_events();
        drop(session);
        let own = self.run(changes, &Way::default())?;
        let summary = &own.report.summary;
        let kinematic = summary.method == "kinematic";
        let happened = |remedy: Remedy| summary.recoveries[remedy] > 0;
        let events = switching || own.met_events();
        let method = match name.as_str() {
            "auto" if happened(Remedy::MethodSwitch) => IMPLICIT,
            "auto" => DEFAULT_METHOD,
            other => other,
        };
        let kind = match fixed {
            Some(step) => Kind::Fixed(step),
            None if kinematic => Kind::Found,
            None if events || !FOLLOWING.contains(&method) => Kind::Located,
            None => Kind::Frozen,
        };
        let formulation = Some(summary.engine.clone()).filter(|name| ["joint", "cartesian"].contains(&name.as_str()));
        let way = Way { method: Some(method.to_owned()), formulation, ..Way::default() };
        Ok(Nominal { done: own, kind, way, tolerance: tolerance.unwrap_or(1e-10) })
    }

    /// Why variants have to take steps of their own.
    fn not_frozen(&self) -> SessionError {
        let message = "steps are ended by events at a smaller tolerance";
        let mut error = SessionError::one(self.document.source(), Diagnostic::error(codes::STEP_TOO_SMALL, message));
        error.exit = Exit::Integration;
        error
    }

    /// A level of accuracy at which variants are computed.
    ///
    /// # Errors
    /// That of the run whose steps are followed, with [`Exit::Integration`] where that cannot be.
    pub(crate) fn level(
        &self,
        nominal: &Nominal,
        changes: &[Override],
        tolerance: f64,
        share_of_step: f64,
    ) -> Result<Way, SessionError> {
        let mut way = nominal.way.clone();
        match nominal.kind {
            Kind::Fixed(step) => way.fixed_step = Some(step * share_of_step),
            Kind::Found | Kind::Located => way.tolerance = Some(tolerance),
            Kind::Frozen => {
                way.tolerance = Some(tolerance);
                let done = self.run(changes, &way)?;
                if done.met_events() {
                    // Larger steps did not notice them.
                    return Err(self.not_frozen());
                }
                way.steps = Some(done.steps);
            }
        }
        Ok(way)
    }
}

/// How a run's dependence on numbers is smooth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Kind {
    /// All variants take the same steps.
    Frozen,
    /// Steps of one size, s.
    Fixed(f64),
    /// Positions are found at each time.
    Found,
    /// Each variant takes its own steps, and ends them at its own events.
    Located,
}

impl Kind {
    /// In words, for reports.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Frozen => "differences of runs that all take the steps of one (frozen step sequence)",
            Self::Fixed(_) => "differences of runs with steps of one size",
            Self::Found => "differences of positions that are found at each time",
            Self::Located => "differences of runs that each end steps at their own events",
        }
    }
}

/// The scene's own run.
pub(crate) struct Nominal {
    pub(crate) done: Done,
    pub(crate) kind: Kind,
    pub(crate) way: Way,
    pub(crate) tolerance: f64,
}

impl Nominal {
    /// Whether the audit doubts it.
    pub(crate) fn suspect(&self) -> Option<&str> {
        let summary = &self.done.report.summary;
        (summary.status == Status::Suspect).then_some(summary.reason.as_str())
    }
}
