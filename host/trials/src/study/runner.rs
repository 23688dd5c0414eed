//! [`Study`]: the runs, one after the other or on several threads.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::journal::{Head, Journal, Kept, KeptRuns};
use super::vary::Vary;
use crate::diagnostics::{Diagnostic, codes};
use crate::pool;
use crate::results::{ChannelInfo, Summary};
use crate::scene::{Document, Rejected};
use crate::session::{RunOptions, Session, SessionError};

/// More runs than this are taken for a mistake.
pub const MOST_RUNS: usize = 1_000_000;

/// What is run.
#[derive(Debug, Clone, Default)]
pub struct StudyOptions {
    /// What every run has in common.
    pub common: RunOptions,
    /// What is varied; the last one changes fastest.
    pub varied: Vec<Vary>,
    /// Runs at the same time; 0 = as many as the machine has processors. Results do not depend on it.
    pub jobs: usize,
    /// Folder in which every run leaves its results, as `run-1`, `run-2`, ...; no files where absent.
    pub folder: Option<PathBuf>,
    /// Folder of the journal, in which the rows of finished runs are kept until the end; none where absent.
    pub journal: Option<PathBuf>,
    /// Runs that the journal has are not done again.
    pub resume: bool,
}

/// All runs of a study.
#[derive(Debug)]
pub struct Study {
    /// The keys that were varied.
    pub keys: Vec<String>,
    /// The runs, in their order, whichever ended first.
    pub runs: Vec<Run>,
}

/// One run.
#[derive(Debug)]
pub struct Run {
    /// Its values, one per key.
    pub values: Vec<String>,
    /// How it ended.
    pub outcome: Outcome,
}

/// How a run ended.
#[derive(Debug)]
pub enum Outcome {
    /// It was integrated, to its end or not.
    Ran(Box<Finished>),
    /// It was integrated before the study was resumed.
    Kept(Kept),
    /// There are no results.
    Failed(SessionError),
    /// It was not begun, because the study was stopped.
    NotBegun,
}

/// What is kept of a run.
#[derive(Debug)]
pub struct Finished {
    /// Status, figures, work, audit.
    pub summary: Summary,
    /// Exit code that the run would have had on its own.
    pub exit_code: i32,
    /// The channels of the scene.
    pub channels: Vec<ChannelInfo>,
    /// Their last values, in the channels' units.
    pub last: Vec<f64>,
}

impl Study {
    /// Runs a scene with every combination of values. `told` hears of every run that ended, in any order, from any thread;
    /// `stop` ends the runs under way after their steps and begins no others.
    ///
    /// # Errors
    /// Too many combinations; a journal that can't be written, is damaged or belongs to another study,
    /// scene or library. What goes wrong in a run is in the run.
    pub fn run(
        scene: &Path,
        options: &StudyOptions,
        told: &(dyn Fn(usize, &Run) + Sync),
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, Box<Diagnostic>> {
        let count = options.varied.iter().try_fold(1_usize, |all, vary| all.checked_mul(vary.values.len()));
        let count = count.filter(|count| *count <= MOST_RUNS).ok_or_else(|| {
            let message = format!("the study has more than {MOST_RUNS} runs");
            Box::new(Diagnostic::error(codes::BAD_OVERRIDE, message).help("vary fewer keys, or with fewer values"))
        })?;
        let opened = options.journal.as_deref().map(|folder| Journal::open(folder, &Head::of(options), options.resume));
        let (journal, kept) =
            opened.transpose()?.map_or((None, KeptRuns::new()), |(journal, kept)| (Some(journal), kept));
        let mut all = options.common.clone();
        all.common.get_or_insert_default();
        // The runs share the processors; none takes several.
        all.jobs = 1;
        let scene = Varied { path: scene, document: &Document::open(scene), options: all, varied: &options.varied };
        if let Some((number, run)) = kept.first_key_value() {
            check_fingerprint(&scene, *number, &run.fingerprint)?;
        }
        let one = |number: usize| {
            if let Some(kept) = kept.get(&number) {
                return Run { values: values(options, number), outcome: Outcome::Kept(kept.clone()) };
            }
            let (run, fingerprint) = single(&scene, options, number, stop);
            if let (Some(journal), Outcome::Ran(finished)) = (&journal, &run.outcome)
                && journal.add(number, &fingerprint, finished)
            {
                stop.store(true, Ordering::Relaxed);
            }
            told(number, &run);
            run
        };
        let keys = options.varied.iter().map(|vary| vary.key.clone()).collect();
        let runs = pool::each((0..count).collect(), options.jobs, one);
        journal.map_or(Ok(()), Journal::close)?;
        Ok(Self { keys, runs })
    }

    /// Runs that were finished before the study was resumed.
    #[must_use]
    pub fn kept(&self) -> usize {
        self.runs.iter().filter(|run| matches!(run.outcome, Outcome::Kept(_))).count()
    }

    /// Exit code of the program: that of the first run that has one, 130 if some were not begun.
    #[must_use]
    pub fn exit_code(&self) -> i32 {
        let code = |run: &Run| match &run.outcome {
            Outcome::Ran(finished) => finished.exit_code,
            Outcome::Kept(kept) => kept.exit_code,
            Outcome::Failed(error) => error.exit_code(),
            Outcome::NotBegun => 130,
        };
        self.runs.iter().map(code).find(|code| *code != 0).unwrap_or(0)
    }

    /// The study, if any run got as far as being integrated.
    ///
    /// # Errors
    /// Why the first run did not, if none did.
    pub fn any_results(self) -> Result<Self, SessionError> {
        let failed = |run: &Run| matches!(run.outcome, Outcome::Failed(_));
        if !self.runs.iter().all(failed) {
            return Ok(self);
        }
        let first = self.runs.into_iter().find_map(|run| match run.outcome {
            Outcome::Failed(error) => Some(error),
            _ => None,
        });
        first.map_or(Ok(Self { keys: self.keys, runs: Vec::new() }), Err)
    }
}

/// The values of a run, one per key.
fn values(options: &StudyOptions, number: usize) -> Vec<String> {
    options.varied.iter().zip(choice(&options.varied, number)).map(|(vary, k)| vary.values[k].clone()).collect()
}

/// The scene of a study, read once.
struct Varied<'a> {
    path: &'a Path,
    document: &'a Result<Document, Box<Rejected>>,
    /// What the runs have in common.
    options: RunOptions,
    varied: &'a [Vary],
}

impl Varied<'_> {
    /// The scene of a run.
    fn open(&self, number: usize) -> Result<Session, SessionError> {
        let document = self.document.as_ref().map_err(|rejected| Rejected::clone(rejected))?;
        let mut options = self.options.clone();
        let choice = choice(self.varied, number);
        options.overrides.extend(self.varied.iter().zip(choice).map(|(vary, k)| vary.change(k)));
        Session::of_document(self.path, document, &options)
    }
}

/// Whether a run that was kept would be the same today.
fn check_fingerprint(scene: &Varied<'_>, number: usize, kept: &str) -> Result<(), Box<Diagnostic>> {
    let what = match scene.open(number) {
        Ok(session) if session.fingerprint() == kept => return Ok(()),
        Ok(_) => "the scene file or a library is not what it was".to_string(),
        Err(error) => format!("run {} cannot be opened any more: {error}", number + 1),
    };
    let message = format!("cannot resume the study: {what}");
    let help = "make it as it was; or begin anew in another folder with `-o DIR`";
    Err(Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help(help)))
}

/// Run number `number`, and the fingerprint of its session.
fn single(scene: &Varied<'_>, options: &StudyOptions, number: usize, stop: &Arc<AtomicBool>) -> (Run, String) {
    let values = values(options, number);
    if stop.load(Ordering::Relaxed) {
        return (Run { values, outcome: Outcome::NotBegun }, String::new());
    }
    let folder = options.folder.as_ref().map(|folder| folder.join(format!("run-{}", number + 1)));
    let session = scene.open(number);
    let fingerprint = session.as_ref().map(Session::fingerprint).unwrap_or_default();
    let report = session.and_then(|session| session.run(folder.as_deref(), Box::new(|_| ()), stop));
    let outcome = match report {
        Err(error) => Outcome::Failed(error),
        Ok(report) => Outcome::Ran(Box::new(Finished {
            exit_code: report.exit_code(),
            last: report.columns.iter().map(|column| column.last().copied().unwrap_or(f64::NAN)).collect(),
            channels: report.channels,
            summary: report.summary,
        })),
    };
    (Run { values, outcome }, fingerprint)
}

/// Which value of each key belongs to a run; the last key changes fastest.
fn choice(varied: &[Vary], number: usize) -> Vec<usize> {
    let mut rest = number;
    let mut choice: Vec<usize> = varied
        .iter()
        .rev()
        .map(|vary| {
            let k = rest % vary.values.len();
            rest /= vary.values.len();
            k
        })
        .collect();
    choice.reverse();
    choice
}
