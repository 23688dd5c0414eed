//! [`Session::run`]: from the start to results.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::begin::Ended;
use super::error::{Exit, SessionError};
use super::open::Session;
use super::restart::Restart;
use super::simulation::Progress;
use super::tier::Made;
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::integrate::{self, IntegrateError, Outcome, StopReason};
use crate::model::{Channel, Quantity, fault_code};
use crate::results::{
    ChannelInfo, CheckResult, Crossing, Figure, FigureResult, Folder, LibraryUsed, RESULTS_FILE, Remedy, ResultsError,
    Samples, Status, Summary, Table, Take, Written, significant,
};
use crate::scene::{Dimension, SampleTime, Scene};

/// Relative tolerance where the scene gives none.
const DEFAULT_TOLERANCE: f64 = 1e-10;

/// Relative tolerance of a scene.
pub(super) fn tolerance(scene: &Scene) -> f64 {
    scene.simulation.tolerance.unwrap_or(DEFAULT_TOLERANCE)
}

/// Method where the scene gives none. `auto` costs no more, and much less on stiff scenes, but there keeps to the tolerance
/// only, while some scenes check the far smaller errors that the explicit method's tiny steps happen to have.
pub const DEFAULT_METHOD: &str = "dop853";

/// Engines and what each does.
pub const ENGINES: &[(&str, &str)] = &[
    ("auto", "interpreted at first, machine code as soon as that pays; the same results, bit for bit"),
    ("compiled", "machine code from the first step on: six velocities per body, pruned operations, sparse elimination"),
    ("interpreted", "the same without machine code"),
    ("reference", "the paper's Eq. (6): seven coordinates per body, dense; slow, for comparison"),
];

/// What a run gives.
#[derive(Debug, Clone)]
pub struct RunReport {
    /// How it went.
    pub summary: Summary,
    /// Times of the samples, scene units.
    pub times: Vec<f64>,
    /// Samples of each channel, scene units.
    pub columns: Vec<Vec<f64>>,
    /// What each column is.
    pub channels: Vec<ChannelInfo>,
    /// The checks of the scene with their samples, in its order.
    pub checks: Vec<CheckResult>,
}

impl RunReport {
    /// Exit code of the program for this run.
    #[must_use]
    pub fn exit_code(&self) -> i32 {
        match self.summary.status {
            Status::Suspect => Exit::Audit as i32,
            Status::Completed if !self.summary.checks_passed() => Exit::Audit as i32,
            Status::Completed => 0,
            Status::StoppedEarly if self.summary.code == Some(codes::INTERRUPTED) => 130,
            _ => Exit::Integration as i32,
        }
    }
}

/// The samples of a run, where they go.
pub(super) struct Samplings {
    folder: Option<Folder>,
    pub(super) times: Vec<SampleTime>,
    channels: Vec<ChannelInfo>,
    pub(super) taken: Vec<f64>,
    columns: Vec<Vec<f64>>,
    /// Why a row could not be written.
    pub(super) error: Option<ResultsError>,
}

impl Samplings {
    pub(super) fn take(&mut self, number: usize, values: &[f64]) -> Result<(), std::io::Error> {
        let time = self.times[number].scene;
        self.taken.push(time);
        for ((column, channel), value) in self.columns.iter_mut().zip(&self.channels).zip(values) {
            column.push(channel.from_si(*value));
        }
        let Some(folder) = &mut self.folder else { return Ok(()) };
        folder.row(time, values).map_err(|error| {
            let told = std::io::Error::other(error.to_string());
            self.error = Some(error);
            told
        })
    }

    /// Completes the files, if there are any: the table, the summary, and the state from which another run goes on.
    pub(super) fn close(
        &mut self,
        path: Option<&Path>,
        summary: &mut Summary,
        end: Option<&Restart>,
    ) -> Result<(), ResultsError> {
        let (Some(folder), Some(path)) = (self.folder.take(), path) else { return Ok(()) };
        if let Some(end) = end {
            end.write(path)?;
        }
        folder.finish(summary)
    }

    /// Continues a table with what was `kept` of it.
    pub(super) fn go_on(
        session: &Session,
        path: &Path,
        kept: &Written,
        summary: &Summary,
    ) -> Result<Self, ResultsError> {
        let mut samplings = session.no_samplings();
        samplings.folder = Some(Folder::go_on(path, &samplings.channels, kept, summary)?);
        let table = Table::read(&path.join(RESULTS_FILE))?;
        (samplings.taken, samplings.columns) = (table.times, table.columns);
        Ok(samplings)
    }

    /// Brings all rows to the disk, then the text of a checkpoint made for what is there. Returns what else
    /// `make` gives.
    pub(super) fn checkpoint<T>(
        &mut self,
        make: impl FnOnce(Written) -> std::io::Result<(String, T)>,
    ) -> Result<T, ResultsError> {
        let folder = self.folder.as_mut().expect("runs with checkpoints have a folder");
        let written = folder.sync()?;
        let (text, made) = make(written).map_err(|cause| folder.no_checkpoint(cause))?;
        folder.checkpoint(&text)?;
        Ok(made)
    }

    /// The report of the run.
    pub(super) fn report(self, summary: Summary, checks: Vec<CheckResult>) -> RunReport {
        RunReport { summary, times: self.taken, columns: self.columns, channels: self.channels, checks }
    }
}

impl Session {
    /// Runs the scene. With a folder, results are written there as they come; `progress` is told the share done; `stop`
    /// ends the run after the step under way, with valid results. With checkpoints (`checkpoint_every` in `[simulation]`), a
    /// run into a folder can be resumed if it is killed: [`super::Checkpoint`].
    ///
    /// # Errors
    /// An unknown method or engine, files that can't be written, an element that fails. A run that merely stops early is
    /// not an error: the report says so.
    pub fn run(
        mut self,
        folder: Option<&Path>,
        mut progress: Box<dyn FnMut(f64) + Send + '_>,
        stop: &Arc<AtomicBool>,
    ) -> Result<RunReport, SessionError> {
        if let Some(path) = folder
            && self.has_checkpoints()
        {
            return self.run_chain(path, progress, stop);
        }
        if self.runs_apart() {
            return self.run_apart(folder, progress, stop);
        }
        let started = Instant::now();
        let means = self.means()?;
        let mut summary = self.summary(means.method(), means.formulation());
        let mut samplings = self.samplings(folder, &summary)?;
        let (t_start, t_end) = (self.scene.simulation.t_start, self.scene.simulation.t_end);
        let share = move |t: f64| (t - t_start) / (t_end - t_start);
        let mut reached = t_start;
        let (ended, restart) = {
            let told: Progress<'_> = Box::new(|t| {
                reached = t;
                progress(share(t));
            });
            let take = |number: usize, values: &[f64]| samplings.take(number, values);
            let mut begun = self.begin(means, Box::new(take), told, stop)?;
            begun.watch_start().map_err(|e| start_error(&self.scene, &e))?;
            summary.compile_time_s += started.elapsed().as_secs_f64();
            let ended = begun.integrate();
            let restart = begun.restart(&self.model, &ended);
            (ended, restart)
        };
        self.note_work(&mut summary, &ended);
        summary.t_end_reached = reached / self.scene.units.factor(Dimension::TIME);
        let failed = self.conclude(&mut summary, ended.outcome, &mut samplings.error);
        self.judge(&mut summary);
        let checks = self.evaluate(&mut summary, &samplings);
        summary.wall_time_s = self.load_time + self.compile_time + started.elapsed().as_secs_f64();
        let closed = samplings.close(folder, &mut summary, restart.as_ref());
        if let Some(error) = failed {
            return Err(error);
        }
        closed.map_err(|e| self.files_error(&e))?;
        Ok(samplings.report(summary, checks))
    }

    /// Where the samples go, and the files that begin now.
    pub(super) fn samplings(&self, folder: Option<&Path>, summary: &Summary) -> Result<Samplings, SessionError> {
        let mut samplings = self.no_samplings();
        if let Some(path) = folder {
            let unit = self.scene.units.factor(Dimension::TIME);
            let time = ChannelInfo::time(&self.scene.units.label(Dimension::TIME), unit);
            let folder = Folder::create(path, &time, &samplings.channels, summary);
            samplings.folder = Some(folder.map_err(|e| self.files_error(&e))?);
        }
        Ok(samplings)
    }

    /// Where the samples go, without files.
    fn no_samplings(&self) -> Samplings {
        let times = self.scene.simulation.sample_times(&self.scene.units);
        let channels: Vec<ChannelInfo> = self.model.channels.iter().map(|c| self.channel_info(c)).collect();
        Samplings {
            columns: vec![Vec::with_capacity(times.len()); channels.len()],
            taken: Vec::with_capacity(times.len()),
            error: None,
            folder: None,
            times,
            channels,
        }
    }

    /// Writes the counters and the audit of an integration into a summary.
    pub(super) fn note_work(&self, summary: &mut Summary, ended: &Ended) {
        let counters = &ended.counters;
        summary.audit = ended.audit;
        summary.evaluations = counters.evaluations;
        summary.factorisations = counters.factorisations;
        summary.position_corrections = counters.position_corrections;
        summary.coupling_iterations = counters.coupling_iterations;
        summary.integration_time_s = ended.integration_time;
        let goes_on = self.stretch.as_ref().is_some_and(|stretch| stretch.carried.is_some());
        let taken = [
            (Remedy::RankSafe, counters.rank_safe),
            (Remedy::StageProjection, counters.stage_projections),
            (Remedy::Passage, counters.interpolated),
            (Remedy::PlaceAhead, u64::from(self.ahead.is_some() && !goes_on)),
            (Remedy::Contradiction, counters.contradictions),
        ];
        taken.into_iter().for_each(|(remedy, count)| summary.recoveries[remedy] = count);
        // Before the outcome is told, which has no more to say than that something is none.
        summary.reason = ended.not_finite.iter().find_map(|inputs| self.culprit(inputs)).unwrap_or_default();
        note_machine_code(summary, &ended.made, self.scene.units.factor(Dimension::TIME));
    }

    /// Figures and checks of the samples, written into a summary; the checks with their samples.
    pub(super) fn evaluate(&self, summary: &mut Summary, samplings: &Samplings) -> Vec<CheckResult> {
        summary.rows = samplings.taken.len() as u64;
        summary.figures = self.figures(samplings);
        let checks = self.checks(&samplings.taken, &samplings.columns);
        summary.checks = checks.iter().map(CheckResult::without_samples).collect();
        checks
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
        SessionError::one(Exit::Scene, &self.scene.source, diagnostic.help_if(nearest).help(known))
    }

    pub(super) fn no_step(&self, method: &str) -> SessionError {
        let mut diagnostic =
            Diagnostic::error(codes::UNKNOWN_METHOD, format!("the method `{method}` needs a step size"));
        if let Some(written) = &self.scene.simulation.method {
            diagnostic = diagnostic.at(written.span.clone(), "has no error control");
        }
        let help = "give it as `fixed_step` in [simulation], or use a method that chooses its steps: auto";
        SessionError::one(Exit::Scene, &self.scene.source, diagnostic.help(help))
    }

    pub(super) fn no_machine_code(&self, error: &crate::program::MachineError) -> SessionError {
        let mut diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("no engine `compiled`: {error}"));
        if let Some(written) = &self.scene.simulation.engine {
            diagnostic = diagnostic.at(written.span.clone(), "asked for here");
        }
        SessionError::one(Exit::Scene, &self.scene.source, diagnostic.help("`interpreted` gives the same results"))
    }

    pub(super) fn files_error(&self, error: &ResultsError) -> SessionError {
        SessionError::one(Exit::Files, &self.scene.source, error.diagnostic())
    }

    fn channel_info(&self, channel: &Channel) -> ChannelInfo {
        let unique = match &channel.quantity {
            Quantity::Load { element, frame, torque, axes, component } => {
                let component = matches!(axes, crate::model::Axes::Ground).then_some(*component);
                self.plan.is_unique(*element, *frame, *torque, component)
            }
            _ => true,
        };
        let record = self.scene.outputs.iter().find(|record| record.name.value == channel.name);
        ChannelInfo {
            name: channel.name.clone(),
            unit: channel.unit.clone(),
            quantity: record.map_or(String::new(), |record| record.quantity.value.clone()),
            place: channel.place.clone(),
            factor: channel.factor,
            unique,
        }
    }

    /// What is known before the first step.
    pub(super) fn summary(&self, method: &str, engine: &str) -> Summary {
        let units = &self.scene.units;
        Summary {
            status: Status::Running,
            scene: self.scene.source.name.clone(),
            title: self.scene.title.clone(),
            odyn_version: env!("CARGO_PKG_VERSION").into(),
            method: method.into(),
            engine: engine.into(),
            tolerance: self.tolerance(),
            t_end: self.scene.simulation.t_end / units.factor(Dimension::TIME),
            time_unit: units.label(Dimension::TIME),
            load_time_s: self.load_time,
            compile_time_s: self.compile_time,
            mobility: self.plan.mobility as u64,
            redundant_rows: self.plan.redundant_rows.len() as u64,
            not_unique: self
                .model
                .channels
                .iter()
                .map(|channel| self.channel_info(channel))
                .filter(|info| !info.unique)
                .map(|info| info.name)
                .collect(),
            redundant_row_names: self.plan.redundant_rows.iter().map(|row| row.name.clone()).collect(),
            audit_limits: self.audit_limits(),
            chosen_velocities: self.chosen_velocities(),
            libraries: self
                .libraries
                .iter()
                .map(|library| LibraryUsed {
                    package: library.package.clone(),
                    version: library.version.clone(),
                    sha256: library.sha256.clone(),
                })
                .collect(),
            warnings: self.warnings.iter().map(|w| format!("{}: {}", w.code, w.message)).collect(),
            ..Summary::default()
        }
    }

    /// Writes the end of the integration into the summary; an error where there is more to say than that it stopped.
    pub(super) fn conclude(
        &self,
        summary: &mut Summary,
        outcome: Result<Outcome, IntegrateError>,
        files: &mut Option<ResultsError>,
    ) -> Option<SessionError> {
        match outcome {
            Ok(outcome) => {
                let counters = &outcome.counters;
                summary.steps = counters.steps as u64;
                summary.rejected = counters.rejected as u64;
                summary.projections = counters.projections as u64;
                summary.jacobians = counters.jacobians as u64;
                summary.newton_iterations = counters.newton_iterations as u64;
                summary.enclosures = counters.enclosed as u64;
                summary.unproven = counters.unproven as u64;
                summary.newton_factorisations = counters.factorisations as u64;
                let recoveries = &counters.recoveries;
                let taken = [
                    (Remedy::SmallerStep, recoveries.smaller_step),
                    (Remedy::NotFinite, recoveries.not_finite),
                    (Remedy::NoConvergence, recoveries.no_convergence),
                    (Remedy::SampleStep, recoveries.sample_step),
                    (Remedy::FreshJacobian, recoveries.fresh_jacobian),
                    (Remedy::MethodSwitch, counters.switches),
                    (Remedy::Event, counters.events),
                    (Remedy::Chatter, counters.chatters),
                    (Remedy::WithinStep, counters.stepped_over),
                    (Remedy::Missed, counters.missed),
                ];
                taken.into_iter().for_each(|(remedy, count)| summary.recoveries[remedy] = count as u64);
                summary.stiff_from = counters.stiff_from.map(|t| t / self.scene.units.factor(Dimension::TIME));
                match outcome.status {
                    integrate::Status::Completed => summary.status = Status::Completed,
                    integrate::Status::StoppedEarly { reason, .. } => {
                        summary.status = Status::StoppedEarly;
                        // That of a user who interrupts is no remedy.
                        let forced = !matches!(reason, StopReason::Requested);
                        summary.recoveries[Remedy::EarlyEnd] = u64::from(forced);
                        summary.code = Some(code_of(&reason));
                        let culprit = std::mem::take(&mut summary.reason);
                        summary.reason = match culprit.is_empty() {
                            true => reason.to_string(),
                            false => format!("{culprit}: {reason}"),
                        };
                        if summary.code == Some(codes::PROJECTION_FAILED)
                            && let Some(masses) = self.masses_far_apart()
                        {
                            summary.reason.push_str(&masses);
                        }
                    }
                }
                None
            }
            Err(error) => {
                summary.status = Status::Failed;
                summary.reason = error.to_string();
                if let Some(error) = files.take() {
                    summary.code = Some(error.code());
                    return Some(self.files_error(&error));
                }
                let diagnostic = self
                    .element_fault(&error)
                    .or_else(|| self.particle_fault(&error))
                    .unwrap_or_else(|| Diagnostic::error(codes::MOTION_NOT_FINITE, error.to_string()));
                summary.code = Some(diagnostic.code);
                let exit = if diagnostic.code.starts_with("ODY04") { Exit::Plugin } else { Exit::Integration };
                Some(SessionError::one(exit, &self.scene.source, diagnostic.help("results up to this time are valid")))
            }
        }
    }

    /// A particle that was made to turn, or a thin rod about its axis.
    fn particle_fault(&self, error: &IntegrateError) -> Option<Diagnostic> {
        let IntegrateError::System { cause, .. } = error else { return None };
        let cause = cause.downcast_ref::<crate::analysis::AnalysisError>()?;
        use crate::analysis::AnalysisError::{TorqueOnParticle, TorqueOnThin};
        let (body, place, help) = match cause {
            TorqueOnParticle { body } => (
                body,
                "has no rotation and no inertia",
                "attach joints and forces at its position and so that they only push, or give it an inertia",
            ),
            TorqueOnThin { body } => (
                body,
                "has a principal moment of inertia that is zero",
                "give the body the moment of inertia about this axis that it has, however small, or hold it by a joint that takes \
                 the torque",
            ),
            _ => return None,
        };
        let record = self.scene.bodies.iter().find(|record| record.name.value == *body)?;
        let diagnostic = Diagnostic::error(codes::TORQUE_ON_PARTICLE, cause.to_string());
        Some(diagnostic.at(record.name.span.clone(), place).help(help))
    }

    /// The element behind a failure, with its place in the scene.
    fn element_fault(&self, error: &IntegrateError) -> Option<Diagnostic> {
        let IntegrateError::System { t, cause } = error else { return None };
        let cause = cause.downcast_ref::<crate::analysis::AnalysisError>()?;
        let crate::analysis::AnalysisError::Element { set, fault } = cause else { return None };
        let unit = self.scene.units.factor(Dimension::TIME);
        let label = self.scene.units.label(Dimension::TIME);
        let mut diagnostic = Diagnostic::error(
            fault_code(&fault.message),
            format!("an element failed at t = {} {label}: {}", significant(t / unit, 6), fault.message),
        );
        let instance = self.model.elements.iter().find(|e| e.set == *set && e.index as usize == fault.instance)?;
        let record = self.scene.elements.iter().find(|record| record.name.value == instance.name)?;
        let text = format!("`{}` ({}/{})", instance.name, instance.library, instance.class.name);
        diagnostic = diagnostic.at(record.name.span.clone(), text);
        Some(diagnostic.help("this is a defect of the library; its author will want this message"))
    }

    /// The scene's derived figures.
    fn figures(&self, samplings: &Samplings) -> Vec<FigureResult> {
        let names: Vec<String> = samplings.channels.iter().map(|c| c.name.clone()).collect();
        let samples = Samples { times: &samplings.taken, columns: &samplings.columns, names: &names };
        let unit = self.scene.units.factor(Dimension::TIME);
        let mut results = Vec::new();
        for record in &self.scene.figures {
            let find =
                |name: &str| names.iter().position(|n| n == name).ok_or_else(|| format!("there is no output `{name}`"));
            let figure = || -> Result<(Figure, usize), String> {
                let channel = find(&record.channel.value)?;
                let take = match record.take {
                    crate::scene::Take::Peak => Take::Peak,
                    crate::scene::Take::Min => Take::Min,
                    crate::scene::Take::Max => Take::Max,
                    crate::scene::Take::Final => Take::Final,
                    crate::scene::Take::Mean => Take::Mean,
                    crate::scene::Take::Rms => Take::Rms,
                    crate::scene::Take::At => {
                        let at = record.at.as_ref().ok_or("needs `where` and `equals`")?;
                        let own = find(&at.channel.value)?;
                        let info = &samplings.channels[own];
                        let (dimension, _) = crate::scene::parse_unit(&info.unit).map_err(|e| e.message)?;
                        let value = |raw| self.scene.quantity(raw, dimension).map_err(|d| d.message);
                        Take::At(Crossing {
                            channel: own,
                            equals: info.from_si(value(&at.equals)?),
                            period: at.period.as_ref().map(value).transpose()?.map(|p| info.from_si(p)),
                        })
                    }
                };
                let over = record.over.as_ref().map(|name| find(&name.value)).transpose()?;
                let from = record.from.map(|t| t / unit);
                Ok((Figure { channel, take, absolute: record.absolute, over, from }, channel))
            };
            let computed = figure().and_then(|(figure, channel)| {
                let value = figure.compute(&samples).map_err(|error| error.to_string())?;
                Ok((value, channel))
            });
            let own_unit = |channel: usize| {
                if record.over.is_some() { String::new() } else { samplings.channels[channel].unit.clone() }
            };
            let (value, unit, problem) = match computed {
                Ok((value, channel)) if record.unit.is_empty() => (Some(value), own_unit(channel), None),
                Ok((value, _)) => (Some(value), record.unit.clone(), None),
                Err(problem) => (None, record.unit.clone(), Some(problem)),
            };
            results.push(FigureResult {
                name: record.name.value.clone(),
                value,
                published: record.published,
                unit,
                note: record.note.clone(),
                problem,
            });
        }
        results
    }
}

/// Writes into the summary what was compiled. `unit` is the scene's unit of time, s.
fn note_machine_code(summary: &mut Summary, made: &Made, unit: f64) {
    summary.machine_code_programs = made.programs;
    summary.machine_code_bytes = made.bytes;
    summary.machine_code_time_s = made.seconds;
    summary.machine_code_from = made.since.map(|t| t / unit);
    // The reference form's name says what counts there.
    if !summary.engine.starts_with("reference") {
        let how = if made.programs > 0 { "compiled" } else { "interpreted" };
        summary.engine = format!("{how}, {}", summary.engine);
    }
}

pub(super) fn start_error(scene: &crate::scene::Scene, error: &dyn std::fmt::Display) -> SessionError {
    let diagnostic = Diagnostic::error(codes::SINGULAR_MASS, format!("the motion cannot start: {error}"))
        .help("check masses, inertias and the equations of the elements");
    SessionError::one(Exit::Integration, &scene.source, diagnostic)
}

fn code_of(reason: &StopReason) -> &'static str {
    match reason {
        StopReason::Requested => codes::INTERRUPTED,
        StopReason::StepLimit { .. } => codes::TOO_MANY_STEPS,
        StopReason::StepTooSmall { .. } | StopReason::NoConvergence { .. } => codes::STEP_TOO_SMALL,
        StopReason::NotFinite { .. } | StopReason::Failed { not_finite: true, .. } => codes::MOTION_NOT_FINITE,
        StopReason::Failed { cause, .. } if is_contradiction(cause.as_ref()) => codes::CONFLICTING_CONSTRAINTS,
        StopReason::Failed { .. } => codes::PROJECTION_FAILED,
    }
}

/// Whether joints that contradict each other ended the run.
fn is_contradiction(cause: &(dyn std::error::Error + Send + Sync + 'static)) -> bool {
    matches!(cause.downcast_ref(), Some(crate::analysis::AnalysisError::Contradiction { .. }))
}
