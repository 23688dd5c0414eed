//! [`Verifier`]: runs scenes and judges them.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::balance::{self, Reports};
use super::case::{Case, Checked, Measured, Rung};
use super::coverage::{Element, collect};
use super::numbers;
use crate::catalog::{Catalog, Request, SearchPath};
use crate::diagnostics::{Diagnostic, render};
use crate::model::{Channel, Model};
use crate::pool;
use crate::results::{CheckResult, Status};
use crate::scene::{AuditTolerance, CheckRecord, Reference, Scene, read};
use crate::session::{RunOptions, RunReport, Session, requests, search_path};
use crate::statics;

/// Relative tolerances at which a scene is run to show how its errors and its work depend on them, largest first.
pub const LADDER: [f64; 5] = [1e-4, 1e-6, 1e-8, 1e-10, 1e-12];

/// How scenes are verified.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// Files and folders in which libraries are looked for first.
    pub plugins: Vec<PathBuf>,
    /// Folder for private copies of libraries; the user's cache folder where absent.
    pub library_copies: Option<PathBuf>,
    /// Runs each scene at the tolerances of [`LADDER`], too.
    pub ladder: bool,
}

/// Runs scenes and judges them. Libraries are loaded once for all scenes that name the same ones.
pub struct Verifier {
    settings: Settings,
    catalogs: Vec<(Vec<Request>, SearchPath, Arc<Catalog>)>,
    elements: Vec<Element>,
}

/// A scene that was read, with its libraries; or why there is nothing to run.
struct Begun {
    path: PathBuf,
    case: Case,
    ready: Result<(Scene, Arc<Catalog>), String>,
}

/// The scene files of a folder, sorted; folders inside it are not looked into.
///
/// # Errors
/// When the folder cannot be read.
pub fn scenes_in(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut scenes = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|ending| ending == "toml") && path.is_file() {
            scenes.push(path);
        }
    }
    scenes.sort();
    Ok(scenes)
}

impl Verifier {
    /// Nothing is loaded yet.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self { settings, catalogs: Vec::new(), elements: Vec::new() }
    }

    /// The elements of all libraries loaded so far, by name.
    #[must_use]
    pub fn elements(&self) -> &[Element] {
        &self.elements
    }

    /// Runs a scene and judges it. Whatever goes wrong is in the case.
    pub fn verify(&mut self, path: &Path) -> Case {
        let begun = self.begin(path);
        finish(&self.settings, begun)
    }

    /// Runs scenes and judges them, `jobs` at the same time (0 = as many as there are processors). Cases are in the order of
    /// the scenes and do not depend on `jobs`; `told` hears of each when it has ended, from any thread.
    pub fn verify_all(&mut self, paths: &[PathBuf], jobs: usize, told: &(dyn Fn(&Case) + Sync)) -> Vec<Case> {
        // Libraries are loaded by one thread, once for all scenes that share them.
        let begun: Vec<Begun> = paths.iter().map(|path| self.begin(path)).collect();
        let settings = &self.settings;
        pool::each(begun, jobs, |begun| {
            let case = finish(settings, begun);
            told(&case);
            case
        })
    }

    /// Reads a scene and loads its libraries.
    fn begin(&mut self, path: &Path) -> Begun {
        let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let name = part(path.file_stem());
        let mut case = Case {
            title: name.clone(),
            file: part(path.file_name()),
            name,
            elements: Vec::new(),
            analysis: None,
            text: String::new(),
            source: String::new(),
            outcome: Err(String::new()),
        };
        let scene = match read(path, &[]) {
            Ok((scene, _)) => scene,
            Err(rejected) => {
                case.source = rejected.source.text.to_string();
                return Begun {
                    path: path.into(),
                    ready: Err(render(&rejected.diagnostics, &rejected.source, false)),
                    case,
                };
            }
        };
        case.source = scene.source.text.to_string();
        if !scene.title.is_empty() {
            case.title = scene.title.clone();
        }
        if let Some(verification) = &scene.verification {
            case.text = verification.text.clone();
            case.elements = verification.elements.iter().map(|name| name.value.clone()).collect();
            let asked = verification.analysis.as_ref();
            case.analysis = asked.and_then(|asked| asked.question.get("analysis")?.as_str()).map(String::from);
        }
        let ready = match scene.checks.is_empty() && case.analysis.is_none() {
            true => Err("the scene has no [[check]], and names no analysis in [verification]".into()),
            false => self.catalog(path, &scene).map(|catalog| (scene, catalog)),
        };
        Begun { path: path.into(), case, ready }
    }

    /// The libraries that a scene names.
    fn catalog(&mut self, path: &Path, scene: &Scene) -> Result<Arc<Catalog>, String> {
        let requests = requests(scene);
        let search = search_path(scene, path, &self.settings.plugins);
        if let Some((.., known)) = self.catalogs.iter().find(|(r, s, _)| *r == requests && *s == search) {
            return Ok(Arc::clone(known));
        }
        let mut catalog = match &self.settings.library_copies {
            Some(folder) => Catalog::new().with_copies_in(folder),
            None => Catalog::new(),
        };
        let mut diagnostics: Vec<Diagnostic> = Vec::new();
        for (library, request) in scene.plugins.libraries.iter().zip(&requests) {
            if let Err(error) = catalog.add_request(request, &search) {
                diagnostics.push(error.diagnostic().at(library.span.clone(), "asked for here"));
            }
        }
        if !diagnostics.is_empty() {
            return Err(render(&diagnostics, &scene.source, false));
        }
        collect(&mut self.elements, &catalog);
        let catalog = Arc::new(catalog);
        self.catalogs.push((requests, search, Arc::clone(&catalog)));
        Ok(catalog)
    }
}

/// Runs and judges what was begun.
fn finish(settings: &Settings, begun: Begun) -> Case {
    let Begun { path, mut case, ready } = begun;
    case.outcome = ready.and_then(|(scene, catalog)| {
        let verification = scene.verification.as_ref();
        let analysis = verification.and_then(|record| Some((record.analysis.as_ref()?, &record.numbers)));
        let Some((asked, wanted)) = analysis else { return measure(settings, &scene, &catalog) };
        named_elements(&scene, &open(&scene, &catalog)?)?;
        let mut judged = numbers::judge(settings, &path, &scene, asked, wanted)?;
        if !scene.checks.is_empty() {
            let run = measure(settings, &scene, &catalog)?;
            judged = Measured { checks: [judged.checks, run.checks].concat(), ..run };
        }
        Ok(judged)
    });
    case
}

/// The elements that a scene says it verifies are in it.
fn named_elements(scene: &Scene, session: &Session) -> Result<(), String> {
    for name in scene.verification.iter().flat_map(|verification| &verification.elements) {
        let named = |element: &crate::model::Instance| format!("{}/{}", element.library, element.class.name);
        if !session.model.elements.iter().any(|element| named(element) == name.value) {
            return Err(format!("[verification] names `{}`, but the scene has no such element", name.value));
        }
    }
    Ok(())
}

fn measure(settings: &Settings, scene: &Scene, catalog: &Catalog) -> Result<Measured, String> {
    let session = open(scene, catalog)?;
    named_elements(scene, &session)?;
    let report = run(session)?;
    let mut measured = Measured {
        time_unit: report.summary.time_unit.clone(),
        method: report.summary.method.clone(),
        engine: formulation(&report.summary.engine).to_string(),
        tolerance: report.summary.tolerance,
        checks: scene.checks.iter().zip(&report.checks).map(|(record, result)| checked(record, result)).collect(),
        balance: None,
        work: report.summary.work(),
        ladder: Vec::new(),
    };
    // A run of its own: what it reports in addition would be counted as work.
    let session = open_with(scene, catalog, Some(balance::channels))?;
    let reports = Reports::of(&session);
    measured.balance = reports.judge(&run(session)?);
    if settings.ladder {
        let at = |tolerance| rung(scene, catalog, tolerance);
        // Tolerances beyond reach are left out: that is no failure of the scene, which is judged at its own.
        measured.ladder = LADDER.into_iter().filter_map(at).collect();
    }
    Ok(measured)
}

fn open(scene: &Scene, catalog: &Catalog) -> Result<Session, String> {
    open_with(scene, catalog, None)
}

/// With channels behind those that the scene asks for.
fn open_with(
    scene: &Scene,
    catalog: &Catalog,
    further_channels: Option<fn(&Model) -> Vec<Channel>>,
) -> Result<Session, String> {
    let options = RunOptions { jobs: 1, further_channels, equilibrium: Some(statics::start), ..RunOptions::default() };
    Session::with_catalog(scene.clone(), Vec::new(), catalog, &options).map_err(|error| error.render(false))
}

/// Runs to the end, or says why not.
fn run(session: Session) -> Result<RunReport, String> {
    let report = session.run(None, Box::new(|_| ()), &Arc::default()).map_err(|error| error.render(false))?;
    let summary = &report.summary;
    if summary.status != Status::Completed {
        let (reached, unit) = (summary.t_end_reached, &summary.time_unit);
        return Err(format!("{} at t = {reached} {unit}: {}", summary.status.words(), summary.reason));
    }
    Ok(report)
}

/// The scene at another tolerance; `None` where it does not reach its end.
fn rung(scene: &Scene, catalog: &Catalog, tolerance: f64) -> Option<Rung> {
    let mut scene = scene.clone();
    scene.simulation.tolerance = Some(tolerance);
    // What a tolerance leads to is shown, not judged.
    scene.simulation.audit_tolerance = Some(AuditTolerance::None);
    let report = run(open(&scene, catalog).ok()?).ok()?;
    let largest = report.checks.iter().map(|check| check.largest).collect();
    Some(Rung { tolerance, largest, work: report.summary.work() })
}

fn checked(record: &CheckRecord, result: &CheckResult) -> Checked {
    let reference = match &record.reference {
        Reference::Formula(formula) => formula.text().to_string(),
        Reference::Csv { path, column } => format!("{}: {column}", path.value.display()),
    };
    Checked {
        name: result.name.clone(),
        kind: result.kind.to_string(),
        value: record.value.text().to_string(),
        reference,
        unit: result.unit.clone(),
        tolerance: result.tolerance,
        largest: result.largest,
        at: result.at,
        passed: result.passed,
        problem: result.problem.clone(),
        errors: result.series.iter().map(|(t, value, reference)| (*t, (value - reference).abs())).collect(),
    }
}

/// The engine without the word whether machine code was made, which depends on how busy the machine is, and changes no result.
fn formulation(engine: &str) -> &str {
    engine.strip_prefix("compiled, ").or_else(|| engine.strip_prefix("interpreted, ")).unwrap_or(engine)
}
