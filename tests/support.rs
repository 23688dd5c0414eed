//! Doors to scenes and results.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicU32, Ordering};

use element_api::manifest::Library;
use odyn::catalog::Catalog;
use odyn::diagnostics::Source;
use odyn::scene::{Override, parse};
use odyn::session::{Restart, RunOptions, RunReport, Session, SessionError};

/// The root of the source tree.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a member of the workspace")
}

/// A folder below `target` that outlives the tests.
pub fn kept(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// A folder of its own for a test, removed at its end.
pub struct Scratch(PathBuf);

impl Scratch {
    pub fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("odyn-tests-{}-{number}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Writes a file and gives its path.
    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, content).unwrap();
        path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Runs an ignored test in a process of its own, with a variable in its environment.
pub fn child(test: &str, variable: &str, value: &OsStr) -> Output {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", test, "--ignored", "--nocapture", "--test-threads=1"]).env(variable, value);
    command.output().unwrap()
}

/// Where a function falls through zero between two places.
pub fn bisected(mut low: f64, mut high: f64, falls: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if falls(middle) > 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// What the command line would add to a scene: `--set` texts and `--plugin` folders.
pub fn options(sets: &[&str], plugins: &[PathBuf]) -> RunOptions {
    RunOptions {
        overrides: sets.iter().map(|text| Override::new(*text)).collect(),
        plugins: plugins.to_vec(),
        library_copies: Some(kept("library-copies")),
        equilibrium: Some(odyn::analyses::statics::start),
        ..RunOptions::default()
    }
}

/// Runs `scene.toml` of a folder with one more setting, its results in a folder there; on from where another one ended, if any.
#[track_caller]
pub fn leg(scratch: &Scratch, set: &str, folder: &str, from: Option<&str>) -> RunReport {
    let mut session = Session::open(&scratch.path().join("scene.toml"), &options(&[set], &[])).unwrap();
    if let Some(from) = from {
        session.go_on_from(Restart::read(&scratch.path().join(from)).unwrap()).unwrap();
    }
    session.run(Some(&scratch.path().join(folder)), Box::new(|_| ()), &Default::default()).unwrap()
}

/// A scene of `scenes/`, ready to run.
#[track_caller]
pub fn open(scene: &str, sets: &[&str]) -> Session {
    let path = root().join("scenes").join(scene);
    Session::open(&path, &options(sets, &[])).unwrap_or_else(|error| panic!("{error}"))
}

/// The text of a scene, ready to run.
#[track_caller]
pub fn open_text(text: &str, sets: &[&str]) -> Session {
    let scratch = Scratch::new();
    Session::open(&scratch.file("scene.toml", text), &options(sets, &[])).unwrap_or_else(|error| panic!("{error}"))
}

/// Runs a scene of `scenes/`.
#[track_caller]
pub fn run(scene: &str, sets: &[&str]) -> RunReport {
    finish(open(scene, sets))
}

/// Runs the text of a scene with elements that are linked in.
#[track_caller]
pub fn run_linked(text: &str, library: Library) -> RunReport {
    let report = try_run_linked(text, library).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(report.exit_code(), 0, "{} {:?}", report.summary.reason, report.summary.audit);
    report
}

/// The same, with why there is no result.
#[track_caller]
pub fn try_run_linked(text: &str, library: Library) -> Result<RunReport, SessionError> {
    let mut catalog = Catalog::new();
    catalog.add_library(library).unwrap();
    let (scene, warnings) =
        parse(Source::new("scene.toml", text), &[]).unwrap_or_else(|rejected| panic!("{:?}", rejected.diagnostics));
    let session = Session::with_catalog(scene, warnings, &catalog, &RunOptions::default());
    session?.run(None, Box::new(|_| ()), &Default::default())
}

#[track_caller]
fn finish(session: Session) -> RunReport {
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"));
    let summary = &report.summary;
    assert_eq!(report.exit_code(), 0, "{} {:?}", summary.reason, summary.audit);
    report
}

/// A column of results.
#[track_caller]
pub fn column<'a>(report: &'a RunReport, name: &str) -> &'a [f64] {
    let k = report.channels.iter().position(|channel| channel.name == name);
    &report.columns[k.unwrap_or_else(|| panic!("no channel `{name}`"))]
}

/// A column that stays below this is zero but for rounding.
const ROUNDING: f64 = 1e-9;

/// The largest difference of two columns as a share of the largest value of the second (or as it is, where that is zero).
pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len(), "as many samples");
    let peak = b.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
    // `max` would lose what is not a number.
    let largest = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, |x: f64, y| if y <= x { x } else { y });
    if peak > ROUNDING { largest / peak } else { largest }
}

/// Asserts that two runs have the same columns to within a share of each one's peak.
#[track_caller]
pub fn assert_same_motion(a: &RunReport, b: &RunReport, tolerance: f64) {
    assert_eq!(a.times, b.times);
    for channel in &b.channels {
        let off = difference(column(a, &channel.name), column(b, &channel.name));
        assert!(off <= tolerance, "`{}` differs by {off:.2e} of its peak, allowed {tolerance:e}", channel.name);
    }
}
