//! [`Session::run`]: a scene by itself, from its start to results and their files.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::crew::Crew;
use super::error::SessionError;
use super::keeper::Keeper;
use super::leg::{Leg, Told};
use super::opened::Session;
use super::outcome::RunReport;
use crate::results::{SUMMARY_FILE, Status, Summary};

impl Session {
    /// Runs the scene. With a folder, results are written there as they come; `progress` receives the share done; `stop`
    /// ends the run after the step under way, with valid results. With checkpoints (`checkpoint_every` in `[simulation]`), a
    /// run into a folder can be resumed if it is killed: [`super::Checkpoint`]. At the end the last one is removed, unless there is
    /// something to do [afterwards](super::RunOptions::afterwards).
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
        let started = Instant::now();
        let tables = self.read_ahead();
        if folder.is_some() && self.scene.simulation.motion {
            self.shown = Some(self.picture()?);
        }
        let mut keeper = Keeper::of(&mut self, folder)?;
        let before = keeper.as_ref().map_or(0.0, |keeper| keeper.point.work.wall_time_s);
        let span =
            [keeper.as_ref().map_or(self.begins.time, |keeper| keeper.point.t_start), self.scene.simulation.t_end];
        if let Some(keeper) = &keeper {
            self.place_at(&keeper.point)?;
        }
        let mut crew = Crew::new(self)?;
        let mut base = crew.summary();
        let mut samplings = match &mut keeper {
            Some(keeper) => keeper.open(crew.session(), &mut base)?,
            None => crew.session().samplings(folder, &base)?,
        };
        let mut since = started;
        let mut end = loop {
            let to = keeper.as_ref().map_or(span[1], Keeper::next);
            let carried = keeper.as_ref().and_then(|keeper| keeper.point.carried.clone());
            let leg = Leg { to, first_sample: samplings.taken.len(), carried };
            let told = Told { samplings: &mut samplings, span, progress: &mut progress, stop };
            let mut end = crew.go(leg, base.clone(), since, told).map_err(|error| not_begun(error, &base, folder))?;
            let Some(keeper) = &mut keeper else { break end };
            keeper.point.work.add(&mut end.summary);
            if end.summary.status != Status::Completed || to == span[1] {
                break end;
            }
            keeper.point.work.wall_time_s = before + started.elapsed().as_secs_f64();
            if let Err((code, error)) = keeper.keep(&mut end, &mut samplings) {
                fail(&mut end.summary, &error);
                end.summary.code = Some(code);
                end.failed = Some(error);
                break end;
            }
            since = Instant::now();
            let mut again = end.session.again()?;
            again.place_at(&keeper.point)?;
            crew = Crew::new(again)?;
        };
        let (session, summary) = (&end.session, &mut end.summary);
        if let Some(keeper) = &keeper {
            keeper.point.work.tell(summary);
            summary.checkpoints = keeper.point.taken;
        }
        match end.islands.as_slice() {
            [] => session.judge(summary),
            islands => session.judge_apart(summary, islands),
        }
        let judged = session.judge_reactions(summary, &mut samplings, end.state.as_ref().ok());
        session.judge_outputs(summary, &samplings);
        session.warn_of_elements(summary);
        session.warn_of_rest(summary);
        session.warn_of_step(summary);
        let checks = session.evaluate(summary, &samplings, &tables);
        summary.wall_time_s = before + session.load_time + session.compile_time + started.elapsed().as_secs_f64();
        let closed = samplings.close(folder, summary, end.state.as_ref().ok(), session.options.afterwards);
        if let Some(error) = end.failed {
            return Err(error);
        }
        judged.and(closed).map_err(|error| session.files_error(&error))?;
        Ok(samplings.report(end.summary, checks))
    }
}

fn fail(summary: &mut Summary, error: &SessionError) {
    let first = error.diagnostics.first();
    summary.fail(first.map(|first| first.message.clone()).unwrap_or_default(), first.map(|first| first.code));
}

/// Ends the summary in the folder of a run that does not begin: it would count as running for ever.
fn not_begun(error: SessionError, summary: &Summary, folder: Option<&Path>) -> SessionError {
    if let Some(folder) = folder {
        let mut summary = summary.clone();
        fail(&mut summary, &error);
        // That this file cannot be written, too, is less than why the run does not begin.
        let _ = summary.write(&folder.join(SUMMARY_FILE));
    }
    error
}
