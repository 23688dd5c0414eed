//! [`Runs`]: runs in the background, with progress, and what they left. Results lie in a temporary folder as long as they are
//! among the last few.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use odyn_desk::{Scripts, Source, data, report};
use odyn_run::results::ResultsError;
use odyn_run::session::{RunOptions, Session};
use serde_json::{Value, json};

use crate::check::refused;

/// How many runs are kept, the last ones.
const KEPT: usize = 8;

/// All runs of a studio.
pub(crate) struct Runs {
    folder: tempfile::TempDir,
    known: Mutex<BTreeMap<u64, Arc<Run>>>,
    next: AtomicU64,
}

/// One run.
struct Run {
    folder: PathBuf,
    /// What is run, whatever the scene file has.
    text: String,
    stop: Arc<AtomicBool>,
    /// Bits of the share done.
    share: AtomicU64,
    began: Instant,
    /// How it ended, for the page.
    end: Mutex<Option<Value>>,
}

impl Runs {
    pub(crate) fn new() -> std::io::Result<Self> {
        let folder = tempfile::Builder::new().prefix("odyn-studio-").tempdir()?;
        Ok(Self { folder, known: Mutex::default(), next: AtomicU64::new(1) })
    }

    fn known(&self) -> MutexGuard<'_, BTreeMap<u64, Arc<Run>>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn find(&self, number: u64) -> Option<Arc<Run>> {
        self.known().get(&number).cloned()
    }

    /// Begins a run of a text and gives its number.
    pub(crate) fn begin(&self, place: &Path, text: String, options: &RunOptions) -> u64 {
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        let run = Arc::new(Run {
            folder: self.folder.path().join(format!("run-{number}")),
            text,
            stop: Arc::default(),
            share: AtomicU64::new(0f64.to_bits()),
            began: Instant::now(),
            end: Mutex::new(None),
        });
        let mut known = self.known();
        known.insert(number, Arc::clone(&run));
        // Those that are still under way are kept whatever their number.
        let ended: Vec<u64> = known.iter().filter(|(_, run)| run.end().is_some()).map(|(number, _)| *number).collect();
        for old in ended.iter().take(known.len().saturating_sub(KEPT)) {
            if let Some(run) = known.remove(old) {
                // What cannot be removed now goes with the folder of all.
                let _ = std::fs::remove_dir_all(&run.folder);
            }
        }
        drop(known);
        let (place, options) = (place.to_path_buf(), options.clone());
        thread::spawn(move || {
            let work = || run.work(&place, &options);
            let end = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).unwrap_or_else(|_| {
                let message = "the run ended by a defect of the program; the terminal of `odyn studio` has more";
                json!({ "ok": false, "messages": [{ "severity": "error", "code": "", "message": message, "label": "", "help": [],
                                                     "from": 0, "to": 0, "line": null }] })
            });
            *run.end.lock().unwrap_or_else(PoisonError::into_inner) = Some(end);
        });
        number
    }

    /// How far a run is, or how it ended.
    pub(crate) fn state(&self, number: u64) -> Option<Value> {
        let run = self.find(number)?;
        let share = f64::from_bits(run.share.load(Ordering::Relaxed));
        Some(match run.end() {
            Some(end) => json!({ "done": true, "share": share, "end": end }),
            None => json!({ "done": false, "share": share, "seconds": run.began.elapsed().as_secs_f64() }),
        })
    }

    /// Lets a run end after the step under way.
    pub(crate) fn stop(&self, number: u64) -> Option<()> {
        self.find(number)?.stop.store(true, Ordering::Relaxed);
        Some(())
    }

    /// Lets all runs end.
    pub(crate) fn stop_all(&self) {
        self.known().values().for_each(|run| run.stop.store(true, Ordering::Relaxed));
    }

    fn sources(&self, numbers: &[u64]) -> Result<Vec<Source>, ResultsError> {
        let runs = numbers.iter().filter_map(|number| Some((*number, self.find(*number)?)));
        runs.map(|(number, run)| {
            let source = Source::read(&run.folder)?;
            Ok(Source { name: format!("Run {number}"), scene: Some(run.text.clone()), ..source })
        })
        .collect()
    }

    /// The data of runs, as scripts of pages read them; `None` where a run has left no table.
    pub(crate) fn data(&self, numbers: &[u64]) -> Option<String> {
        self.sources(numbers).ok().filter(|sources| !sources.is_empty()).map(|sources| data(&sources))
    }

    /// The report of runs.
    pub(crate) fn report(&self, numbers: &[u64]) -> Option<String> {
        let sources = self.sources(numbers).ok().filter(|sources| !sources.is_empty());
        sources.map(|sources| report(&sources, Scripts::BuiltIn))
    }
}

impl Run {
    fn end(&self) -> Option<Value> {
        self.end.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn work(&self, place: &Path, options: &RunOptions) -> Value {
        let session = match Session::open_text(place, self.text.clone(), options) {
            Ok(mut session) => {
                session.scene.simulation.motion = true;
                session
            }
            Err(error) => return refused(&error),
        };
        let progress = |share: f64| self.share.store(share.to_bits(), Ordering::Relaxed);
        match session.run(Some(&self.folder), Box::new(progress), &self.stop) {
            Ok(outcome) => {
                let summary = &outcome.summary;
                let failed = summary.checks.iter().filter(|check| !check.passed).map(|check| &check.name);
                json!({
                    "ok": true,
                    "status": summary.status.words(),
                    "sound": outcome.exit_code() == 0,
                    "reason": summary.reason,
                    "failed_checks": failed.collect::<Vec<_>>(),
                    "text": odyn_run::results::report(summary, None, false),
                    "seconds": self.began.elapsed().as_secs_f64(),
                })
            }
            Err(error) => refused(&error),
        }
    }
}
