//! [`Study`]: the runs, one after the other or on several threads.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::head::Head;
use super::journal::{Closed, JOURNAL_FILE, Journal, Kept, KeptRuns};
use super::points::Points;
use super::series::{self, Curves, Series};
use super::shard::{self, Shard};
use crate::diagnostics::{Diagnostic, codes};
use crate::pool;
use crate::results::{ChannelInfo, Summary};
use crate::scene::{Document, Rejected};
use crate::session::{Common, RunOptions, Session, SessionError};

/// More runs than this are taken for a mistake.
pub const MOST_RUNS: usize = 1_000_000;

/// What is run.
#[derive(Debug, Clone, Default)]
pub struct StudyOptions {
    /// What every run has in common.
    pub common: RunOptions,
    /// What is varied: the values of all runs.
    pub points: Points,
    /// The part of the runs that is done; all of them where absent.
    pub shard: Option<Shard>,
    /// Runs at the same time; 0 = as many as the machine has processors. Results do not depend on it.
    pub jobs: usize,
    /// Folder in which every run leaves its results, as `run-1`, `run-2`, ...; no files where absent.
    pub folder: Option<PathBuf>,
    /// Folder of the journal, in which the rows of finished runs are kept until the end, and of the table; none where absent.
    pub journal: Option<PathBuf>,
    /// Outputs of every run that are kept over time, in the journal and then beside the table.
    pub series: Option<Series>,
    /// Runs that the journal has are not done again.
    pub resume: bool,
    /// But those of them that failed are.
    pub retry_failed: bool,
}

/// All runs of a study, or of a shard of it.
#[derive(Debug)]
pub struct Study {
    /// The values of all runs, also those of other shards.
    pub points: Points,
    /// The part of them that was done; all where absent.
    pub shard: Option<Shard>,
    /// Number of the first of `runs`, from zero.
    pub first: usize,
    /// The runs, in their order, whichever ended first.
    pub runs: Vec<Run>,
    pub(super) head: Head,
    /// Where their series are.
    pub(super) closed: Option<Closed>,
}

/// One run.
#[derive(Debug)]
pub struct Run {
    /// How it ended.
    pub outcome: Outcome,
}

/// How a run ended.
#[derive(Debug)]
pub enum Outcome {
    /// It was integrated, to its end or not.
    Ran(Box<Finished>),
    /// It was integrated, or failed, before the study was resumed.
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
    /// Until the journal has them.
    pub(super) series: Option<Curves>,
}

impl Study {
    /// Runs a scene with all points, or those of a shard. `told` hears of every run that ended, with its number from zero, in any
    /// order, from any thread; `stop` ends the runs under way after their steps and begins no others.
    ///
    /// # Errors
    /// A journal that can't be written, is damaged or belongs to another study, scene or library; a folder with parts of another
    /// study, of which this would be a shard; series without a journal, or of outputs that the first run does not have. What goes wrong in a run is in the run.
    pub fn run(
        scene: &Path,
        options: &StudyOptions,
        told: &(dyn Fn(usize, &Run) + Sync),
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, Box<Diagnostic>> {
        let document = Document::open(scene);
        let scene = Varied::new(scene, &document, options);
        let first = scene.first();
        if let Some(series) = &options.series {
            let known = first.as_ref().map(|first| first.model.channels.as_slice());
            series.check(options.journal.is_some(), known.map(|all| all.iter().map(|one| one.name.as_str())))?;
        }
        let head = scene.head(first.as_ref());
        let opened = options.journal.as_deref().map(|folder| {
            let journal = match options.shard {
                Some(shard) => {
                    shard::check_others(folder, shard, &head)?;
                    shard.journal_file(folder)
                }
                None => folder.join(JOURNAL_FILE),
            };
            Journal::open(&journal, &head, options.resume, options.retry_failed)
        });
        let (journal, kept) =
            opened.transpose()?.map_or((None, KeptRuns::new()), |(journal, kept)| (Some(journal), kept));
        if let Some((number, run)) = kept.iter().find(|(_, run)| !run.failed) {
            check_fingerprint(&scene, *number, &run.fingerprint)?;
        }
        let one = |number: usize| {
            if let Some(kept) = kept.get(&number) {
                return Run { outcome: Outcome::Kept(kept.clone()) };
            }
            let (mut run, fingerprint) = scene.common.during(|| single(&scene, number, stop));
            let add = |journal: &Journal| match &mut run.outcome {
                Outcome::Ran(finished) => journal.add(number, &fingerprint, finished),
                // What fails while everything is stopped may do so because of that.
                Outcome::Failed(error) if !stop.load(Ordering::Relaxed) => {
                    journal.add_failed(number, &fingerprint, error)
                }
                Outcome::Failed(_) | Outcome::Kept(_) | Outcome::NotBegun => false,
            };
            if journal.as_ref().is_some_and(add) {
                stop.store(true, Ordering::Relaxed);
            }
            told(number, &run);
            run
        };
        let count = options.points.len();
        let numbers = options.shard.map_or(0..count, |shard| shard.range(count));
        let first = numbers.start;
        let runs = pool::each(numbers.collect(), options.jobs, one);
        let closed = journal.map(Journal::close).transpose()?;
        Ok(Self { points: options.points.clone(), shard: options.shard, first, runs, head, closed })
    }

    /// The table of series in a folder that this was written to, if there are some: a row per run and sample, with the number of the
    /// run, the time and the outputs. Runs that failed have no rows.
    #[must_use]
    pub fn series_file(&self, folder: &Path) -> Option<PathBuf> {
        self.head.series().then(|| series::file(folder, self.shard))
    }

    /// Runs that were finished, or failed, before the study was resumed.
    #[must_use]
    pub fn kept(&self) -> usize {
        self.runs.iter().filter(|run| matches!(run.outcome, Outcome::Kept(_))).count()
    }

    /// Exit code of the program: 130 if some runs were not begun, else that of the first run that has one.
    #[must_use]
    pub fn exit_code(&self) -> i32 {
        let code = |run: &Run| match &run.outcome {
            Outcome::Ran(finished) => finished.exit_code,
            Outcome::Kept(kept) => kept.exit_code,
            Outcome::Failed(error) => error.exit_code(),
            Outcome::NotBegun => 130,
        };
        // Whatever some of them came to, an interrupted study is not complete.
        let not_begun = self.runs.iter().find(|run| matches!(run.outcome, Outcome::NotBegun));
        not_begun.map(code).or_else(|| self.runs.iter().map(code).find(|code| *code != 0)).unwrap_or(0)
    }

    /// The study, if any run got as far as being integrated.
    ///
    /// # Errors
    /// Why the first run did not, if none did.
    pub fn any_results(self) -> Result<Self, SessionError> {
        let failed = |run: &Run| matches!(run.outcome, Outcome::Failed(_));
        if self.runs.is_empty() || !self.runs.iter().all(failed) {
            return Ok(self);
        }
        let Self { points, shard, first, runs, head, closed } = self;
        let error = runs.into_iter().find_map(|run| match run.outcome {
            Outcome::Failed(error) => Some(error),
            _ => None,
        });
        error.map_or(Ok(Self { points, shard, first, runs: Vec::new(), head, closed }), Err)
    }
}

impl Shard {
    /// The file of its rows, where the shard is complete in a folder.
    ///
    /// # Errors
    /// Files that cannot be read or do not belong to each other; a part of another study than this one.
    pub fn finished(
        self,
        scene: &Path,
        options: &StudyOptions,
        folder: &Path,
    ) -> Result<Option<PathBuf>, Box<Diagnostic>> {
        let Some((record, _)) = shard::read_part(folder, self)? else { return Ok(None) };
        let document = Document::open(scene);
        let scene = Varied::new(scene, &document, options);
        match record.study.difference(&scene.head(scene.first().as_ref())) {
            None => shard::check_series(folder, &record).map(|()| Some(self.rows_file(folder))),
            Some(difference) => {
                let message = format!("part {self} in {} is of another study: {difference}", folder.display());
                let help = "write elsewhere with `-o DIR`, or do it anew without `--resume`";
                Err(Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help(help)))
            }
        }
    }
}

/// The scene of a study, read once.
struct Varied<'a> {
    path: &'a Path,
    document: &'a Result<Document, Box<Rejected>>,
    /// What the runs have in common.
    options: RunOptions,
    common: Common,
    study: &'a StudyOptions,
}

impl<'a> Varied<'a> {
    fn new(path: &'a Path, document: &'a Result<Document, Box<Rejected>>, study: &'a StudyOptions) -> Self {
        let mut options = study.common.clone();
        let common = options.common.get_or_insert_default().clone();
        // The runs share the processors; none takes several.
        options.jobs = 1;
        Self { path, document, options, common, study }
    }

    /// The scene of the first run, where it can be opened. That is worth it where studies are compared.
    fn first(&self) -> Option<Session> {
        let compared = self.study.journal.is_some() || self.study.shard.is_some();
        if compared && !self.study.points.is_empty() { self.open(0).ok() } else { None }
    }

    /// What the study is.
    fn head(&self, first: Option<&Session>) -> Head {
        let fingerprint = first.map(Session::fingerprint);
        Head::of(self.path, self.study, fingerprint.unwrap_or_default())
    }

    /// The scene of a run.
    fn open(&self, number: usize) -> Result<Session, SessionError> {
        let document = self.document.as_ref().map_err(|rejected| Rejected::clone(rejected))?;
        let mut options = self.options.clone();
        options.overrides.extend(self.study.points.changes(number));
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
fn single(scene: &Varied<'_>, number: usize, stop: &Arc<AtomicBool>) -> (Run, String) {
    if stop.load(Ordering::Relaxed) {
        return (Run { outcome: Outcome::NotBegun }, String::new());
    }
    let folder = scene.study.folder.as_ref().map(|folder| folder.join(format!("run-{}", number + 1)));
    let session = scene.open(number);
    let fingerprint = session.as_ref().map(Session::fingerprint).unwrap_or_default();
    let report = session.and_then(|session| session.run(folder.as_deref(), Box::new(|_| ()), stop));
    let outcome = match report {
        Err(error) => Outcome::Failed(error),
        Ok(report) => Outcome::Ran(Box::new(Finished {
            exit_code: report.exit_code(),
            series: scene.study.series.as_ref().map(|series| series.of(number, &report)),
            last: report.columns.iter().map(|column| column.last().copied().unwrap_or(f64::NAN)).collect(),
            channels: report.channels,
            summary: report.summary,
        })),
    };
    (Run { outcome }, fingerprint)
}
