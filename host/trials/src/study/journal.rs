//! [`Journal`]: what has come out of a study that is not at its end, written as runs end.
//!
//! A line per entry, with its SHA-256 before it: first what the study is, then a row for every run that was integrated, or failed
//! for a reason of its own; with a row go the series of its run. A last line without an end is what a kill left of it, and is not
//! counted.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::head::Head;
use super::runner::{Finished, Outcome, Study};
use super::series::{self, Curves};
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
    /// Only on its way into the journal and out of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) series: Option<Curves>,
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
    /// Length of the file.
    end: u64,
    /// Those of the last run.
    titles: Option<Arc<Titles>>,
    places: Places,
    error: Option<ResultsError>,
}

/// Runs that need not be done again, by their numbers.
pub(super) type KeptRuns = BTreeMap<usize, Kept>;

/// Where the series of runs are, by their numbers.
pub(super) type Places = BTreeMap<usize, Place>;

/// A line with the series of a run.
#[derive(Debug, Clone)]
pub(super) struct Place {
    at: u64,
    bytes: usize,
    pub(super) titles: Arc<Vec<String>>,
}

/// What is known of a journal once no run is added any more.
#[derive(Debug)]
pub(super) struct Closed {
    /// Open still: another program that ends the same shard may remove it.
    pub(super) file: File,
    pub(super) places: Places,
}

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
        let refused = |what: String, help: &str| {
            let message = format!("cannot resume the study in {}: {what}", folder.display());
            Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help(help))
        };
        let anew = format!("to begin anew, remove `{}`, or write elsewhere with `-o DIR`", path.display());
        let mut read = Found::default();
        let whole = entries(&mut file, |entry, at, bytes| read.take(entry, head, at, bytes));
        let whole = whole.map_err(failed)?.map_err(|what| refused(format!("`{name}` {what}"), &anew))?;
        let (mut kept, titles, places) = read.runs().map_err(|what| refused(what, &anew))?;
        if !resume && !kept.is_empty() {
            let message =
                format!("{} holds a study that has not ended: {} runs are finished", folder.display(), kept.len());
            let help = format!("`--resume` continues it; {anew}");
            return Err(Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help(help)));
        }
        let keep = if kept.is_empty() { 0 } else { whole };
        file.set_len(keep).and_then(|()| file.seek(SeekFrom::Start(keep))).map_err(failed)?;
        let titles = titles.filter(|_| !kept.is_empty());
        let mut open = Open { file, end: keep, titles, places, error: None };
        if kept.is_empty() {
            open.append(&Entry::Head(head.clone())).map_err(failed)?;
        }
        let journal = Self { path: path.to_path_buf(), open: Mutex::new(open) };
        if retry {
            // Their lines stay; the ones that follow count.
            kept.retain(|_, run| !run.failed);
        }
        Ok((journal, kept))
    }

    /// Adds a run that was integrated, and takes its series. A run that was interrupted is not: it is to be done again.
    ///
    /// The first error is remembered, and `true` returned: the study should end.
    pub(super) fn add(&self, run: usize, fingerprint: &str, finished: &mut Finished) -> bool {
        if finished.summary.code == Some(codes::INTERRUPTED) {
            return false;
        }
        let (fingerprint, exit_code) = (fingerprint.into(), finished.exit_code);
        let cells = finished.cells();
        let (titles, series) = (Arc::new(finished.titles()), finished.series.take());
        self.put(Kept { run, fingerprint, exit_code, cells, failed: false, series, titles })
    }

    /// Adds a run that has no results, unless something outside may have caused that.
    pub(super) fn add_failed(&self, run: usize, fingerprint: &str, error: &SessionError) -> bool {
        let outside = [codes::CANNOT_WRITE, codes::UNREADABLE];
        if error.diagnostics.iter().any(|diagnostic| outside.contains(&diagnostic.code)) {
            return false;
        }
        let (fingerprint, exit_code, cells) = (fingerprint.into(), error.exit_code(), failed_cells(error));
        self.put(Kept { run, fingerprint, exit_code, cells, failed: true, series: None, titles: Arc::default() })
    }

    fn put(&self, kept: Kept) -> bool {
        let mut guard = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let open = &mut *guard;
        let write = || {
            if !kept.failed && open.titles.as_ref() != Some(&kept.titles) {
                open.append(&Entry::Titles(Titles::clone(&kept.titles)))?;
                open.titles = Some(Arc::clone(&kept.titles));
            }
            let (run, titles) = (kept.run, kept.series.as_ref().map(|series| series.titles.clone()));
            let at = open.end;
            open.append(&Entry::Run(kept))?;
            if let Some(titles) = titles {
                let place = Place { at, bytes: (open.end - at) as usize, titles: shared(&open.places, titles) };
                open.places.insert(run, place);
            }
            Ok(())
        };
        if let Err(cause) = write() {
            open.error.get_or_insert(ResultsError::write(&self.path, cause));
        }
        open.error.is_some()
    }

    /// What went wrong, if anything did; where the series are, if nothing.
    pub(super) fn close(self) -> Result<Closed, Box<Diagnostic>> {
        let open = self.open.into_inner().unwrap_or_else(PoisonError::into_inner);
        // Others may write it from now on; where that cannot be, they wait until the file is closed.
        let _ = open.file.unlock();
        let closed = Closed { file: open.file, places: open.places };
        open.error.map_or(Ok(closed), |error| Err(Box::new(error.diagnostic())))
    }
}

impl Open {
    /// Writes a line in one piece.
    fn append(&mut self, entry: &Entry) -> io::Result<()> {
        let text = serde_json::to_string(entry)?;
        let line = format!("{} {text}\n", checksum(text.as_bytes()));
        self.file.write_all(line.as_bytes())?;
        self.end += line.len() as u64;
        Ok(())
    }
}

/// Titles, in one copy where runs have the same.
fn shared(places: &Places, titles: Vec<String>) -> Arc<Vec<String>> {
    match places.values().next_back() {
        Some(last) if *last.titles == titles => Arc::clone(&last.titles),
        _ => Arc::new(titles),
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
        if self.shard.is_some() && !ended {
            return Ok(None);
        }
        fs::create_dir_all(folder).map_err(|cause| ResultsError::write(folder, cause))?;
        let series = series::file(folder, self.shard);
        // Rows come last, those of a part with the checksum of its series: a table with series of another study is never there.
        match (&self.closed, self.head.series()) {
            (Some(closed), true) => series::write(&series, closed)?,
            _ => series::remove(&series)?,
        }
        let rows = self.table().csv();
        let (path, journal) = match self.shard {
            None => {
                let path = folder.join(STUDY_FILE);
                replace(&path, rows.as_bytes(), false)?;
                (path, folder.join(JOURNAL_FILE))
            }
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

/// Reads all whole lines, each with its place and length, and gives where they end; or what is wrong with one.
fn entries(
    file: &mut File,
    mut take: impl FnMut(Entry, u64, usize) -> Result<(), String>,
) -> io::Result<Result<u64, String>> {
    let mut reader = BufReader::with_capacity(1 << 16, file);
    let (mut line, mut end) = (Vec::new(), 0);
    for number in 1.. {
        line.clear();
        let bytes = reader.read_until(b'\n', &mut line)?;
        if !line.ends_with(b"\n") {
            break;
        }
        let taken = entry(&line).map_err(|what| format!("{what} {number}")).and_then(|entry| take(entry, end, bytes));
        if let Err(what) = taken {
            return Ok(Err(what));
        }
        end += bytes as u64;
    }
    Ok(Ok(end))
}

/// What a line says, or what is wrong with it.
fn entry(line: &[u8]) -> Result<Entry, &'static str> {
    const DAMAGED: &str = "is damaged at line";
    let line = std::str::from_utf8(line).map_err(|_| DAMAGED)?;
    let (sum, text) = line.trim_end_matches('\n').split_once(' ').ok_or(DAMAGED)?;
    if checksum(text.as_bytes()) != sum {
        return Err(DAMAGED);
    }
    serde_json::from_str(text).map_err(|_| "is that of another odyn, at line")
}

/// The series in a line of a journal.
pub(super) fn read_entry(mut file: &File, place: &Place) -> io::Result<Curves> {
    let mut line = vec![0; place.bytes];
    file.seek(SeekFrom::Start(place.at))?;
    file.read_exact(&mut line)?;
    let series = match entry(&line) {
        Ok(Entry::Run(Kept { series, .. })) => series,
        _ => None,
    };
    series.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "the journal was changed while the study ran"))
}

/// The runs of a journal, while it is read.
#[derive(Default)]
struct Found {
    kept: KeptRuns,
    titles: Option<Arc<Titles>>,
    places: Places,
    difference: Option<String>,
}

impl Found {
    fn take(&mut self, entry: Entry, head: &Head, at: u64, bytes: usize) -> Result<(), String> {
        match entry {
            Entry::Head(was) => self.difference = was.difference(head),
            Entry::Titles(found) => self.titles = Some(Arc::new(found)),
            Entry::Run(mut run) => {
                if let Some(series) = run.series.take() {
                    let titles = shared(&self.places, series.titles);
                    self.places.insert(run.run, Place { at, bytes, titles });
                }
                if !run.failed {
                    run.titles = self.titles.clone().ok_or("has no titles")?;
                }
                self.kept.insert(run.run, run);
            }
        }
        Ok(())
    }

    /// The runs, the last titles, the places of series. A journal without runs belongs to nobody.
    fn runs(mut self) -> Result<(KeptRuns, Option<Arc<Titles>>, Places), String> {
        if self.kept.values().all(|run| run.failed) {
            self.kept.clear();
        }
        match self.difference.filter(|_| !self.kept.is_empty()) {
            Some(difference) => Err(difference),
            None => Ok((self.kept, self.titles, self.places)),
        }
    }
}
