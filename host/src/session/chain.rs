//! Runs with checkpoints: stretches, each from one checkpoint to the next.
//!
//! At each checkpoint a step ends, all rows up to there and then the checkpoint are brought to the disk, and the run goes on as
//! if it had been read back: from the text just written, with everything made anew. So a stretch depends on the checkpoint
//! before it and on the scene alone, and a run that is resumed gives the same bytes as one that never was killed.
//! What methods remember from step to step is not carried on, other than the size of the steps: each stretch costs a start.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::begin::Means;
use super::checkpoint::{Carried, Checkpoint};
use super::error::{Exit, SessionError};
use super::open::Session;
use super::restart::Restart;
use super::run::{RunReport, Samplings, start_error};
use super::simulation::Progress;
use crate::diagnostics::{Diagnostic, codes};
use crate::results::{ResultsError, Status, Summary};
use crate::scene::{Dimension, Simulation};

/// What a stretch of a run has that a whole run has not.
pub(super) struct Stretch {
    /// Times of its samples, s: after its start, up to its end.
    pub(super) sample_times: Vec<f64>,
    /// What is left by the stretch before it.
    pub(super) carried: Option<Carried>,
}

/// How a stretch ended.
struct StretchEnd {
    summary: Summary,
    failed: Option<SessionError>,
    state: Result<Restart, String>,
    carried: Carried,
}

impl Session {
    /// Whether the run is made of stretches.
    pub(super) fn has_checkpoints(&self) -> bool {
        self.scene.simulation.checkpoint_every.is_some() || self.resumed_from.is_some()
    }

    /// Runs all stretches that are left; see [`Session::run`].
    pub(super) fn run_chain(
        mut self,
        folder: &Path,
        mut progress: Box<dyn FnMut(f64) + Send + '_>,
        stop: &Arc<AtomicBool>,
    ) -> Result<RunReport, SessionError> {
        if self.runs_apart() {
            let message = "a run with checkpoints cannot integrate islands apart";
            let diagnostic = Diagnostic::error(codes::CONFLICTING_KEYS, message)
                .help("leave out `--islands apart`, or `--checkpoint`");
            return Err(SessionError::one(Exit::Scene, &self.scene.source, diagnostic));
        }
        let started = Instant::now();
        let resumed = self.resumed_from.take();
        let is_resumed = resumed.is_some();
        let mut point = resumed.unwrap_or_else(|| Checkpoint::at_start(&self));
        point.resumed += u64::from(is_resumed);
        let before = point.work.wall_time_s;
        let whole = Simulation { t_start: point.t_start, ..self.scene.simulation.clone() };
        let mut ends = whole.checkpoint_times(&self.scene.units);
        ends.push(whole.t_end);

        let mut means = self.go_on_to(&point)?;
        self.scene.simulation = whole.clone();
        let mut base = self.summary(means.method(), means.formulation());
        base.resumed = point.resumed;
        let mut samplings =
            if is_resumed { self.samplings_of(folder, &point, &base)? } else { self.samplings(Some(folder), &base)? };
        // The start is a checkpoint, too.
        self.write(&mut samplings, &mut point).map_err(|error| self.files_error(&error))?;

        let (mut summary, failed, state) = loop {
            let to = ends[usize::try_from(point.taken).unwrap_or(usize::MAX).min(ends.len() - 1)];
            self.scene.simulation.t_start = point.state.as_ref().map_or(point.t_start, |state| state.time);
            self.scene.simulation.t_end = to;
            let share = |t: f64| progress((t - whole.t_start) / (whole.t_end - whole.t_start));
            let mut end = self.run_stretch(means, &point, &base, &mut samplings, Box::new(share), stop)?;
            point.work.add(&mut end.summary);
            if end.summary.status != Status::Completed || to == whole.t_end {
                break (end.summary, end.failed, end.state.ok());
            }
            point.work.wall_time_s = before + started.elapsed().as_secs_f64();
            point.taken += 1;
            point.carried = Some(Carried { steps_tried: point.work.steps_tried(), ..end.carried });
            let state = end.state.map_err(|message| (codes::PLUGIN_MISBEHAVED, self.cannot_save(&message)));
            let written = state.and_then(|state| {
                point.state = Some(state);
                self.write(&mut samplings, &mut point).map_err(|error| (error.code(), self.files_error(&error)))
            });
            if let Err((code, error)) = written {
                let mut summary = end.summary;
                summary.status = Status::Failed;
                summary.reason = error.diagnostics.first().map(|first| first.message.clone()).unwrap_or_default();
                summary.code = Some(code);
                break (summary, Some(error), None);
            }
            self = self.again(&whole)?;
            means = self.go_on_to(&point)?;
        };
        self.scene.simulation = whole;
        point.work.tell(&mut summary);
        summary.checkpoints = point.taken;
        self.judge(&mut summary);
        let checks = self.evaluate(&mut summary, &samplings);
        summary.wall_time_s = before + self.load_time + self.compile_time + started.elapsed().as_secs_f64();
        let closed = samplings.close(Some(folder), &mut summary, state.as_ref());
        if let Some(error) = failed {
            return Err(error);
        }
        closed.map_err(|error| self.files_error(&error))?;
        Ok(samplings.report(summary, checks))
    }

    /// Places the session at a checkpoint.
    fn go_on_to(&mut self, point: &Checkpoint) -> Result<Means, SessionError> {
        if let Some(state) = &point.state {
            self.go_on_from(state.clone())?;
            if let (Some(_), Some(work), Some(was)) =
                (&point.carried, self.assembly.working.last_mut(), state.working.last())
            {
                // The audit goes on.
                *work = *was;
            }
        }
        self.means()
    }

    /// The same scene, opened anew.
    fn again(&self, whole: &Simulation) -> Result<Self, SessionError> {
        let mut scene = self.scene.clone();
        scene.simulation = Simulation { t_start: self.opened_at, ..whole.clone() };
        let mut again = Self::prepare(scene, Vec::new(), &self.catalog, &self.options, None, Instant::now())?;
        again.origin.clone_from(&self.origin);
        Ok(again)
    }

    /// The rows that are there, and the files that go on.
    fn samplings_of(&self, folder: &Path, point: &Checkpoint, summary: &Summary) -> Result<Samplings, SessionError> {
        let samplings = Samplings::go_on(self, folder, &point.table, summary);
        samplings.map_err(|error| self.files_error(&error))
    }

    /// Brings rows and checkpoint to the disk, and reads back what was written.
    fn write(&self, samplings: &mut Samplings, point: &mut Checkpoint) -> Result<(), ResultsError> {
        *point = samplings.checkpoint(|written| {
            point.table = written;
            let text = point.to_text()?;
            let back = Checkpoint::from_text(&text).map_err(std::io::Error::other)?;
            Ok((text, back))
        })?;
        Ok(())
    }

    /// From a checkpoint to the next.
    fn run_stretch(
        &mut self,
        means: Means,
        point: &Checkpoint,
        base: &Summary,
        samplings: &mut Samplings,
        mut progress: Box<dyn FnMut(f64) + Send + '_>,
        stop: &Arc<AtomicBool>,
    ) -> Result<StretchEnd, SessionError> {
        let beginning = Instant::now();
        let first = samplings.taken.len();
        let to = self.scene.simulation.t_end;
        let sample_times = samplings.times[first..].iter().map(|time| time.si).take_while(|time| *time <= to).collect();
        self.stretch = Some(Stretch { sample_times, carried: point.carried.clone() });
        let mut reached = self.scene.simulation.t_start;
        let mut summary = base.clone();
        let (ended, state, carried) = {
            let told: Progress<'_> = Box::new(|t| {
                reached = t;
                progress(t);
            });
            let take = |number: usize, values: &[f64]| samplings.take(first + number, values);
            let mut begun = self.begin(means, Box::new(take), told, stop)?;
            begun.watch_start().map_err(|e| start_error(&self.scene, &e))?;
            summary.compile_time_s += beginning.elapsed().as_secs_f64();
            let ended = begun.integrate();
            let state = begun.state(&self.model, &ended);
            (ended, state, begun.carried())
        };
        self.note_work(&mut summary, &ended);
        summary.t_end_reached = reached / self.scene.units.factor(Dimension::TIME);
        let failed = self.conclude(&mut summary, ended.outcome, &mut samplings.error);
        Ok(StretchEnd { summary, failed, state, carried })
    }

    /// An element whose memory is not to be had.
    fn cannot_save(&self, message: &str) -> SessionError {
        let diagnostic =
            Diagnostic::error(codes::PLUGIN_MISBEHAVED, format!("no checkpoint can be written: {message}"))
                .help("run without --checkpoint; the rows up to here are kept");
        SessionError::one(Exit::Plugin, &self.scene.source, diagnostic)
    }
}
