//! [`Keeper`]: the checkpoints of a run. Its legs go from each to the next.
//!
//! At each checkpoint a step ends, all rows up to there and then the checkpoint are brought to the disk, and the run continues as
//! if it had been read back: from the text just written, with everything made anew. So a leg depends on the checkpoint
//! before it and on the scene alone, and a run that is resumed gives the same bytes as one that never was killed.
//! What methods remember from step to step is not carried on, other than the size of the steps: each leg costs a start.

use std::path::{Path, PathBuf};

use super::checkpoint::{Carried, Checkpoint, FORMAT, Identity, Work};
use super::error::SessionError;
use super::leg::LegEnd;
use super::opened::Session;
use super::samplings::Samplings;
use crate::catalog::fault_code;
use crate::diagnostics::{Code, Diagnostic, codes};
use crate::results::{ResultsError, Summary, Written};
use crate::scene::Simulation;

/// Keeps a run, so that it can be resumed.
pub(super) struct Keeper {
    folder: PathBuf,
    /// What is kept.
    pub(super) point: Checkpoint,
    /// Times at which it is kept, s, then the end of the run.
    ends: Vec<f64>,
    /// Whether there was something to resume.
    is_resumed: bool,
}

impl Keeper {
    /// That of a run into a folder, if it asks for one; takes the checkpoint that the session is resumed from.
    ///
    /// # Errors
    /// Islands that are to be integrated apart.
    pub(super) fn of(session: &mut Session, folder: Option<&Path>) -> Result<Option<Self>, SessionError> {
        let resumed = session.begins.checkpoint.take();
        let simulation = &session.scene.simulation;
        let Some(folder) = folder.filter(|_| simulation.checkpoint_every.is_some() || resumed.is_some()) else {
            return Ok(None);
        };
        // Left to the program, these take common steps.
        let asked = session.apart;
        session.apart = Some(asked.unwrap_or(false));
        if session.runs_apart() {
            let message = "a run with checkpoints cannot integrate islands apart";
            let diagnostic = Diagnostic::error(codes::CONFLICTING_KEYS, message)
                .help("leave out `--islands apart`, or `--checkpoint`");
            return Err(SessionError::one(&session.scene.source, diagnostic));
        }
        let is_resumed = resumed.is_some();
        let mut point = resumed.unwrap_or_else(|| at_start(session));
        point.resumed += u64::from(is_resumed);
        let whole = Simulation { t_start: point.t_start, ..simulation.clone() };
        let mut ends = whole.checkpoint_times(&session.scene.units);
        ends.push(whole.t_end);
        Ok(Some(Self { folder: folder.to_path_buf(), point, ends, is_resumed }))
    }

    /// The end of the next leg, s.
    pub(super) fn next(&self) -> f64 {
        self.ends[usize::try_from(self.point.taken).unwrap_or(usize::MAX).min(self.ends.len() - 1)]
    }

    /// The files of the run, with what is there of them. The start is a checkpoint, too.
    ///
    /// # Errors
    /// Files that can't be written, or are not those that the checkpoint belongs to.
    pub(super) fn open(&mut self, session: &Session, summary: &mut Summary) -> Result<Samplings, SessionError> {
        summary.resumed = self.point.resumed;
        if self.is_resumed {
            summary.mobility = self.point.mobility;
        } else {
            self.point.mobility = summary.mobility;
        }
        let mut samplings = match self.is_resumed {
            true => Samplings::go_on(session, &self.folder, &self.point.kept(), summary)
                .map_err(|error| session.files_error(&error))?,
            false => session.samplings(Some(&self.folder), summary)?,
        };
        self.write(&mut samplings).map_err(|error| session.files_error(&error))?;
        Ok(samplings)
    }

    /// Keeps the end of a leg, whose state it takes.
    ///
    /// # Errors
    /// An element whose memory is not to be had, or files that can't be written: the code, and what to tell.
    pub(super) fn keep(&mut self, end: &mut LegEnd, samplings: &mut Samplings) -> Result<(), (Code, SessionError)> {
        let session = &end.session;
        let point = &mut self.point;
        point.taken += 1;
        point.carried = end.carried.take().map(|carried| Carried { steps_tried: point.work.steps_tried(), ..carried });
        let state = std::mem::replace(&mut end.state, Err(String::new()));
        point.state = Some(state.map_err(|message| cannot_save(session, &message))?);
        self.write(samplings).map_err(|error| (error.code(), session.files_error(&error)))
    }

    /// Brings rows and checkpoint to the disk, and reads back what was written.
    fn write(&mut self, samplings: &mut Samplings) -> Result<(), ResultsError> {
        let point = &mut self.point;
        *point = samplings.checkpoint(|written| {
            (point.table, point.motion, point.events) = (written.table, written.motion, written.events);
            let text = point.to_text()?;
            let back = Checkpoint::from_text(&text).map_err(std::io::Error::other)?;
            Ok((text, back))
        })?;
        Ok(())
    }
}

/// An element whose memory is not to be had.
fn cannot_save(session: &Session, message: &str) -> (Code, SessionError) {
    let code = message.split_once(": ").map_or(codes::PLUGIN_MISBEHAVED, |(_, reason)| fault_code(reason));
    let diagnostic = Diagnostic::error(code, format!("no checkpoint can be written: {message}"))
        .help("run without --checkpoint; the rows up to here are kept");
    (code, SessionError::one(&session.scene.source, diagnostic))
}

/// The start of a run.
fn at_start(session: &Session) -> Checkpoint {
    Checkpoint {
        format: FORMAT,
        taken: 0,
        resumed: 0,
        t_start: session.begins.time,
        mobility: 0,
        table: Written::default(),
        motion: None,
        events: None,
        identity: Identity::of(&session.scene.source, &session.libraries),
        origin: session.origin.clone(),
        work: Work::default(),
        began: session.begins.state.clone(),
        carried: None,
        state: session.begins.state.clone(),
    }
}
