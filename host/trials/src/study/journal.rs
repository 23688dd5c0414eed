//! [`Journal`]: what has come out of a study that is not at its end, written as runs end.
//!
//! A line per entry, with its SHA-256 before it: first what the study is, then a row for every run that was integrated, or failed
//! for a reason of its own. A last line without an end is what a kill left of it, and is not counted.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::head::Head;
use super::runner::{Finished, Outcome, Study};
use super::shard::write_part;
use super::table::{Titles, failed_cells};
use crate::diagnostics::{Diagnostic, codes};
use crate::results::{ResultsError, checksum, replace};
use crate::session::SessionError;

/// Name of the table of a study in its folder.
pub const STUDY_FILE: &str = "study.csv";
/// Name of the journal beside it, while there are runs to come.
pub const JOURNAL_FILE: &str = "study.journal";

/// A run that ended before the study was resumed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    /// Its number, from zero.
    run: usize,
    /// See [`crate::session::Session::fingerprint`].
    pub(super) fingerprint: String,
    /// Exit code that the run would have had on its own.
    pub(super) exit_code: i32,
    /// Its cells of the table, from the status on.
    pub(super) cells: Vec<String>,
    /// It was not integrated: there are no results.
    #[serde(default)]
    pub(super) failed: bool,
    /// What stands above the cells that depend on the scene.
    #[serde(skip)]
    pub(super) titles: Arc<Titles>,
}

#[derive(Serialize, Deserialize)]
enum Entry {
    Head(Head),
    Titles(Titles),
    Run(Kept),
}

/// The file, open.
pub(super) struct Journal {
    path: PathBuf,
    open: Mutex<Open>,
}

struct Open {
    file: File,
    /// Those of the last run.
    titles: Option<Arc<Titles>>,
    error: Option<ResultsError>,
}

/// Runs that need not be done again, by their numbers.
pub(super) type KeptRuns = BTreeMap<usize, Kept>;

impl Journal {
    /// The journal with this path, and the runs that it has, without those that failed if these are to be tried again. Without
    /// `resume` there must be none. Where all have failed there are none: the mistake may have been in what they share.
    ///
    /// # Errors
    /// A file that can't be written; one that was damaged; one of another study; one with runs that are not to be resumed.
    pub(super) fn open(
        path: &Path,
        head: &Head,
        resume: bool,
        retry: bool,
    ) -> Result<(Self, KeptRuns), Box<Diagnostic>> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let name = path.file_name().unwrap_or_default().display();
        let failed = |cause: io::Error| Box::new(ResultsError::write(path, cause).diagnostic());
        fs::create_dir_all(folder).map_err(failed)?;
        let options = || OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        let mut file = options().map_err(failed)?;
        if let Err(fs::TryLockError::WouldBlock) = file.try_lock() {
            return Err(failed(io::Error::new(io::ErrorKind::WouldBlock, "another study writes it")));
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let refused = |what: String, help: &str| {
            let message = format!("cannot resume the study in {}: {what}", folder.display());
            Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help(help))
        };
        let anew = format!("to begin anew, remove `{}`, or write elsewhere with `-o DIR`", path.display());
        let (found, whole) = entries(&bytes).map_err(|what| refused(format!("`{name}` {what}"), &anew))?;
        let (mut kept, titles) = runs(found, head).map_err(|what| refused(what, &anew))?;
        if !resume && !kept.is_empty() {
            let message =
                format!("{} holds a study that has not ended: {} runs are finished", folder.display(), kept.len());
            let help = format!("`--resume` continues it; {anew}");
            return Err(Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help(help)));
        }
        let keep = if kept.is_empty() { 0 } else { whole as u64 };
        file.set_len(keep).and_then(|()| file.seek(SeekFrom::Start(keep))).map_err(failed)?;
        let titles = titles.filter(|_| !kept.is_empty());
        let journal = Self { path: path.to_path_buf(), open: Mutex::new(Open { file, titles, error: None }) };
        if kept.is_empty() {
            let mut open = journal.open.lock().unwrap_or_else(PoisonError::into_inner);
            append(&mut open.file, &Entry::Head(head.clone())).map_err(failed)?;
        }
        if retry {
            // Their lines stay; the ones that follow count.
            kept.retain(|_, run| !run.failed);
        }
        Ok((journal, kept))
    }

    /// Adds a run that was integrated. A run that was interrupted is not: it is to be done again.
    ///
    /// The first error is remembered, and `true` returned: the study should end.
    pub(super) fn add(&self, run: usize, fingerprint: &str, finished: &Finished) -> bool {
        if finished.summary.code == Some(codes::INTERRUPTED) {
            return false;
        }
        let (fingerprint, exit_code) = (fingerprint.into(), finished.exit_code);
        let cells = finished.cells();
        self.put(Kept { run, fingerprint, exit_code, cells, failed: false, titles: Arc::new(finished.titles()) })
    }

    /// Adds a run that has no results, unless something outside may have caused that.
    pub(super) fn add_failed(&self, run: usize, fingerprint: &str, error: &SessionError) -> bool {
        let outside = [codes::CANNOT_WRITE, codes::UNREADABLE];
        if error.diagnostics.iter().any(|diagnostic| outside.contains(&diagnostic.code)) {
            return false;
        }
        let (fingerprint, exit_code, cells) = (fingerprint.into(), error.exit_code(), failed_cells(error));
        self.put(Kept { run, fingerprint, exit_code, cells, failed: true, titles: Arc::default() })
    }

    fn put(&self, kept: Kept) -> bool {
        let mut guard = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let open = &mut *guard;
        let write = || {
            if !kept.failed && open.titles.as_ref() != Some(&kept.titles) {
                append(&mut open.file, &Entry::Titles(Titles::clone(&kept.titles)))?;
                open.titles = Some(Arc::clone(&kept.titles));
            }
            append(&mut open.file, &Entry::Run(kept))
        };
        if let Err(cause) = write() {
            open.error.get_or_insert(ResultsError::write(&self.path, cause));
        }
        open.error.is_some()
    }

    /// What went wrong, if anything did.
    pub(super) fn close(self) -> Result<(), Box<Diagnostic>> {
        let open = self.open.into_inner().unwrap_or_else(PoisonError::into_inner);
        open.error.map_or(Ok(()), |error| Err(Box::new(error.diagnostic())))
    }
}

impl Study {
    /// Writes the table into the folder, in one move. Of a study, the table of what there is; of a shard the part, once all of
    /// its runs have ended, and nothing before. The journal is removed once no run is left to be done.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn write(&self, folder: &Path) -> Result<Option<PathBuf>, ResultsError> {
        let ended = self.has_ended();
        fs::create_dir_all(folder).map_err(|cause| ResultsError::write(folder, cause))?;
        let rows = self.table().csv();
        let (path, journal) = match self.shard {
            None => {
                let path = folder.join(STUDY_FILE);
                replace(&path, rows.as_bytes(), false)?;
                (path, folder.join(JOURNAL_FILE))
            }
            Some(_) if !ended => return Ok(None),
            Some(shard) => {
                let path = write_part(folder, shard, &self.head, rows.as_bytes(), self.exit_code())?;
                (path, shard.journal_file(folder))
            }
        };
        if ended {
            match fs::remove_file(&journal) {
                Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
                    return Err(ResultsError::write(&journal, cause));
                }
                _ => {}
            }
        }
        Ok(Some(path))
    }

    /// Whether no run is left to be done.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        let ended = |outcome: &Outcome| match outcome {
            Outcome::Ran(finished) => finished.summary.code != Some(codes::INTERRUPTED),
            Outcome::Kept(_) | Outcome::Failed(_) => true,
            Outcome::NotBegun => false,
        };
        self.runs.iter().all(|run| ended(&run.outcome))
    }
}

/// Writes a line in one piece.
fn append(file: &mut File, entry: &Entry) -> io::Result<()> {
    let text = serde_json::to_string(entry)?;
    file.write_all(format!("{} {text}\n", checksum(text.as_bytes())).as_bytes())
}

/// The entries of all whole lines, and where these end.
fn entries(bytes: &[u8]) -> Result<(Vec<Entry>, usize), String> {
    let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
    let lines = bytes[..whole].split_inclusive(|byte| *byte == b'\n');
    let entry = |(k, line): (usize, &[u8])| {
        let damaged = || format!("is damaged at line {}", k + 1);
        let line = std::str::from_utf8(line).map_err(|_| damaged())?;
        let (sum, text) = line.trim_end_matches('\n').split_once(' ').ok_or_else(damaged)?;
        if checksum(text.as_bytes()) != sum {
            return Err(damaged());
        }
        serde_json::from_str(text).map_err(|_| format!("is that of another odyn (line {})", k + 1))
    };
    Ok((lines.enumerate().map(entry).collect::<Result<_, _>>()?, whole))
}

/// The runs, and the last titles. A journal without runs belongs to nobody.
fn runs(entries: Vec<Entry>, head: &Head) -> Result<(KeptRuns, Option<Arc<Titles>>), String> {
    let (mut kept, mut titles, mut difference) = (KeptRuns::new(), None, None);
    for entry in entries {
        match entry {
            Entry::Head(was) => difference = was.difference(head),
            Entry::Titles(found) => titles = Some(Arc::new(found)),
            Entry::Run(run) => {
                let titles = if run.failed { None } else { Some(titles.clone().ok_or("its journal has no titles")?) };
                kept.insert(run.run, Kept { titles: titles.unwrap_or_default(), ..run });
            }
        }
    }
    if kept.values().all(|run| run.failed) {
        kept.clear();
    }
    match difference.filter(|_| !kept.is_empty()) {
        Some(difference) => Err(difference),
        None => Ok((kept, titles)),
    }
}
