//! [`Runner`]: runs a scene with all methods and tolerances.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::reference::Reference;
use super::report::{Measured, Point, Problem, Setting, Times, Work, median};
use crate::integrate;
use crate::results::{CheckResult, Status};
use crate::scene::{Override, Scene};
use crate::session::{RunOptions, RunReport, Session};
use crate::statics;

/// Relative tolerances unless others are wanted, loosest first.
pub const TOLERANCES: [f64; 5] = [1e-4, 1e-6, 1e-8, 1e-10, 1e-12];

/// Our name in tables of several programs.
pub(super) const SOLVER: &str = "odyn";
/// Once the runs of a point took as long together, they are not repeated further.
const ENOUGH: Duration = Duration::from_secs(5);
/// Methods without error control: the first has this many steps, each next one four times as many.
const FEWEST_STEPS: u32 = 250;
/// Processes started to measure the start-up.
const STARTS: usize = 21;
/// Computations in doubles that a reference is made of: coordinates and tolerance, the best first. The last stand in where a scene has no
/// coordinates of joints, or takes too long in those of bodies.
const COMPUTATIONS: [(&str, &str); 4] =
    [("joint", "1e-13"), ("cartesian", "1e-12"), ("joint", "1e-12"), ("cartesian", "1e-11")];
/// Kinds of checks that are measured coordinates.
const COORDINATES: [&str; 2] = ["position", "orientation"];

/// What is run, and how.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Names of methods of integration.
    pub methods: Vec<String>,
    /// Relative tolerances, loosest first.
    pub tolerances: Vec<f64>,
    /// Runs of which times are the medians, at least 1.
    pub repeats: usize,
    /// A run that takes longer has failed.
    pub limit: Duration,
    /// Files and folders in which libraries are looked for first.
    pub plugins: Vec<PathBuf>,
    /// Folder for private copies of libraries; the user's cache folder where absent.
    pub library_copies: Option<PathBuf>,
    /// The program, to be started for measuring the start-up; not measured where absent.
    pub program: Option<PathBuf>,
    /// End of the simulated time instead of the scene's, as `--t-end` takes it.
    pub t_end: Option<String>,
    /// Folder in which computed references are kept; not kept where absent.
    pub references: Option<PathBuf>,
}

impl Default for Settings {
    /// All methods at [`TOLERANCES`], 5 repeats, 60 s.
    fn default() -> Self {
        Self {
            methods: integrate::names().iter().map(ToString::to_string).collect(),
            tolerances: TOLERANCES.to_vec(),
            repeats: 5,
            limit: Duration::from_secs(60),
            plugins: Vec::new(),
            library_copies: None,
            program: None,
            t_end: None,
            references: None,
        }
    }
}

/// What the error of a run is measured by.
enum Measure {
    /// The scene's checks.
    Checks,
    Computed(Reference),
    /// Nothing, for this reason.
    Nothing(String),
}

/// Runs scenes.
pub struct Runner {
    settings: Settings,
}

impl Runner {
    /// Nothing is run yet.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self { settings }
    }

    /// Runs a scene with every method at every setting; `told` hears of every point. Whatever goes wrong is in the points.
    pub fn measure(&self, path: &Path, mut told: impl FnMut(&Point)) -> Problem {
        let name = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let mut problem = Problem { title: name.clone(), name, ..Problem::default() };
        let (duration, measure) = match self.open(path, Vec::new()) {
            Ok(session) => {
                describe(&mut problem, &session.scene);
                let measure = if session.scene.checks.is_empty() {
                    self.reference(path, &problem.name, &session).map_or_else(Measure::Nothing, Measure::Computed)
                } else {
                    Measure::Checks
                };
                if let Measure::Computed(reference) = &measure {
                    problem.reference = reference.words();
                }
                (session.scene.simulation.t_end - session.scene.simulation.t_start, measure)
            }
            Err(reason) => {
                // All points would say so: the first does.
                let point = Point {
                    problem: problem.name.clone(),
                    solver: SOLVER.into(),
                    method: self.settings.methods.first().cloned().unwrap_or_default(),
                    setting: Setting::Tolerance(self.settings.tolerances.first().copied().unwrap_or(f64::NAN)),
                    outcome: Err(reason),
                };
                told(&point);
                problem.points.push(point);
                return problem;
            }
        };
        problem.start_up = self.settings.program.as_ref().and_then(|program| self.start_up(program, path));
        for method in &self.settings.methods {
            for setting in self.settings_of(method, duration) {
                let outcome = self.point(path, method, setting, &measure).map(|(measured, unit)| {
                    problem.unit = unit;
                    measured
                });
                let point = Point {
                    problem: problem.name.clone(),
                    solver: SOLVER.into(),
                    method: method.clone(),
                    setting,
                    outcome,
                };
                told(&point);
                problem.points.push(point);
            }
        }
        problem
    }

    /// The tolerances, or for a method without error control as many steps.
    fn settings_of(&self, method: &str, duration: f64) -> Vec<Setting> {
        let fixed = integrate::by_name(method).is_some_and(|method| method.needs_fixed_step());
        let steps = (0_u32..).map(|k| f64::from(FEWEST_STEPS) * 4f64.powi(k as i32));
        match fixed {
            false => self.settings.tolerances.iter().map(|tolerance| Setting::Tolerance(*tolerance)).collect(),
            true => steps.take(self.settings.tolerances.len()).map(|n| Setting::Step(duration / n)).collect(),
        }
    }

    fn over_the_limit(&self) -> String {
        format!("over the limit of {} s", self.settings.limit.as_secs_f64())
    }

    /// The reference of a scene, from the folder where it is kept or computed.
    fn reference(&self, path: &Path, name: &str, session: &Session) -> Result<Reference, String> {
        let fingerprint = session.fingerprint();
        let file = self.settings.references.as_ref().map(|folder| folder.join(format!("{name}.reference.csv")));
        if let Some(known) = file.as_ref().and_then(|file| Reference::read(file, &fingerprint)) {
            return Ok(known);
        }
        let reference = self.computed(path, session)?;
        file.map_or(Ok(()), |file| reference.write(&file, &fingerprint))?;
        Ok(reference)
    }

    /// The reference with the most digits that can be had.
    fn computed(&self, path: &Path, session: &Session) -> Result<Reference, String> {
        let deadline = Instant::now() + self.settings.limit;
        let precise = session.precise().map(|precise| precise.solve(&|| Instant::now() < deadline));
        let natural = |run: &RunReport| session.natural_sizes().of(run.summary.audit.largest_energy());
        // The first of the ways that comes to its end, and the first after it that does so too.
        let (mut found, mut reasons) = (Vec::new(), Vec::new());
        let mut no_more = String::new();
        for (formulation, tolerance) in COMPUTATIONS {
            let set = |key: &str, value: &str| Override::new(format!("simulation.{key}={value}"));
            let overrides = [set("method", "auto"), set("formulation", formulation), set("tolerance", tolerance)];
            let how = format!("{formulation} coordinates at {tolerance}");
            match self.run(path, &overrides, Some(Instant::now() + self.settings.limit)) {
                Ok((report, _)) if report.summary.status == Status::Completed => found.push((report, how)),
                // Where results are open, they are no reference.
                Ok((report, _)) => reasons.push(format!("{how}: suspect, {}", report.summary.reason)),
                Err(reason) => reasons.push(format!("{how}: {}", reason.lines().next().unwrap_or_default())),
            }
            match &found[..] {
                [(run, _)] if no_more.is_empty() => {
                    let samples = precise.as_ref().map_err(Clone::clone);
                    match samples.and_then(|samples| Reference::precise(samples, run, &natural(run))) {
                        Ok(reference) => return Ok(reference),
                        Err(_) if Instant::now() >= deadline => no_more = self.over_the_limit(),
                        Err(reason) => no_more = reason,
                    }
                }
                [_, _] => break,
                _ => {}
            }
        }
        let [(first, how), (second, other)] = &found[..] else {
            return Err(format!("no reference can be computed: {}", reasons.join("; ")));
        };
        let alike = how.split(' ').next() == other.split(' ').next();
        let alike = if alike { " (whose equations are the same: what both have wrong is not seen)" } else { "" };
        let how = format!("{how} and {other}{alike}, in doubles (none with more digits: {no_more})");
        Reference::new(first, second, &natural(first), &how)
    }

    fn open(&self, path: &Path, mut overrides: Vec<Override>) -> Result<Session, String> {
        overrides.extend(self.settings.t_end.iter().map(|end| Override::new(format!("simulation.t_end={end}"))));
        let options = RunOptions {
            overrides,
            plugins: self.settings.plugins.clone(),
            library_copies: self.settings.library_copies.clone(),
            // One thread: times are to compare.
            jobs: 1,
            equilibrium: Some(statics::start),
            ..RunOptions::default()
        };
        Session::open(path, &options).map_err(|error| error.render(false))
    }

    /// Runs until the times are known; with the unit of the error.
    fn point(
        &self,
        path: &Path,
        method: &str,
        setting: Setting,
        measure: &Measure,
    ) -> Result<(Measured, String), String> {
        if let Measure::Nothing(reason) = measure {
            return Err(reason.clone());
        }
        let set = |key: &str, value: String| Override::new(format!("simulation.{key}={value}"));
        let accuracy = match setting {
            Setting::Tolerance(tolerance) => set("tolerance", format!("{tolerance:e}")),
            Setting::Step(step) => set("max_step", format!("{step:e} s")),
        };
        let overrides = vec![set("method", method.into()), accuracy];
        let started = Instant::now();
        // The clock is looked at in the first run only, so that the others are not slowed by it.
        let (report, first) = self.run(path, &overrides, Some(started + self.settings.limit))?;
        let (error, unit) = match measure {
            Measure::Computed(reference) => (reference.error(&report)?.max(reference.accuracy), String::new()),
            _ => error_of(&report.checks)?,
        };
        let mut times = vec![first];
        while times.len() < self.settings.repeats && started.elapsed() < ENOUGH {
            times.push(self.run(path, &overrides, None)?.1);
        }
        let middle = |of: fn(&Times) -> f64| median(times.iter().map(of).collect());
        let summary = &report.summary;
        let measured = Measured {
            error,
            energy_error: summary.audit.energy_error_relative,
            work: Work {
                steps: Some(summary.steps),
                rejected: Some(summary.rejected),
                evaluations: Some(summary.evaluations),
                factorisations: Some(summary.factorisations),
            },
            times: Times {
                load: middle(|t| t.load),
                compile: middle(|t| t.compile),
                machine_code: middle(|t| t.machine_code),
                integrate: middle(|t| t.integrate),
                total: middle(|t| t.total),
            },
            repeats: times.len(),
        };
        Ok((measured, unit))
    }

    /// One run, to its end.
    fn run(
        &self,
        path: &Path,
        overrides: &[Override],
        deadline: Option<Instant>,
    ) -> Result<(RunReport, Times), String> {
        let session = self.open(path, overrides.to_vec())?;
        let stop = Arc::new(AtomicBool::new(false));
        let late = Arc::clone(&stop);
        let watch: Box<dyn FnMut(f64) + Send> = match deadline {
            None => Box::new(|_| ()),
            Some(deadline) => Box::new(move |_| {
                if Instant::now() > deadline {
                    late.store(true, Ordering::Relaxed);
                }
            }),
        };
        let report = session.run(None, watch, &stop).map_err(|error| error.render(false))?;
        let summary = &report.summary;
        if stop.load(Ordering::Relaxed) {
            return Err(self.over_the_limit());
        }
        if !summary.status.reached_end() {
            let (reached, unit) = (summary.t_end_reached, &summary.time_unit);
            return Err(format!("{} at t = {reached} {unit}: {}", summary.status.words(), summary.reason));
        }
        let times = Times {
            load: summary.load_time_s,
            compile: summary.compile_time_s,
            machine_code: summary.machine_code_time_s,
            integrate: summary.integration_time_s,
            total: summary.wall_time_s,
        };
        Ok((report, times))
    }

    /// Time of a process that runs the scene with its own settings, besides the integration: the median of many. It begins
    /// before the process and ends after it, and so is more than the time to its first result.
    fn start_up(&self, program: &Path, scene: &Path) -> Option<f64> {
        // The summary in its folder says how long the integration took.
        let folder = std::env::temp_dir().join(format!("odyn-bench-{}", std::process::id()));
        let mut times = Vec::new();
        let begun = Instant::now();
        for _ in 0..STARTS {
            let mut command = Command::new(program);
            command.arg("run").arg(scene).arg("-q").arg("-o").arg(&folder);
            for plugin in &self.settings.plugins {
                command.arg("--plugin").arg(plugin);
            }
            let started = Instant::now();
            let status = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
            let whole = started.elapsed().as_secs_f64();
            let text = std::fs::read_to_string(folder.join("summary.json")).unwrap_or_default();
            let integration = serde_json::from_str::<serde_json::Value>(&text).ok();
            let integration = integration.and_then(|summary| summary.get("integration_time_s")?.as_f64());
            // Other exit codes: a check or the audit found more than the scene allows, which is no matter of time.
            if let (Ok(_), Some(integration)) = (status, integration) {
                times.push(whole - integration);
            }
            if begun.elapsed() > ENOUGH {
                break;
            }
        }
        // Of no use to anyone; a folder that cannot be removed is no failure of the measurement.
        let _ = std::fs::remove_dir_all(&folder);
        (!times.is_empty()).then(|| median(times))
    }
}

/// Title and measured quantities of a scene.
fn describe(problem: &mut Problem, scene: &Scene) {
    if !scene.title.is_empty() {
        problem.title = scene.title.clone();
    }
    let kinds: Vec<&str> = scene.checks.iter().map(|check| check.kind.word()).collect();
    let checks = scene.checks.iter().zip(&kinds).filter(|(_, kind)| is_measured(kind, &kinds));
    problem.measured = checks.map(|(check, _)| check.value.text().to_string()).collect();
    if scene.checks.is_empty() {
        problem.measured = scene.outputs.iter().map(|output| output.name.value.clone()).collect();
    }
}

/// Whether a check of some kind is measured in a scene with checks of these kinds.
fn is_measured(kind: &str, kinds: &[&str]) -> bool {
    COORDINATES.contains(&kind) || !kinds.iter().any(|kind| COORDINATES.contains(kind))
}

/// The largest error of a measured coordinate and its unit, if it is that of all.
pub(super) fn error_of(checks: &[CheckResult]) -> Result<(f64, String), String> {
    let kinds: Vec<&str> = checks.iter().map(|check| check.kind).collect();
    let mut worst = None;
    let mut unit: Option<&str> = None;
    for check in checks.iter().filter(|check| is_measured(check.kind, &kinds)) {
        if let Some(problem) = &check.problem {
            return Err(format!("check `{}`: {problem}", check.name));
        }
        if !check.largest.is_finite() {
            return Err(format!("check `{}`: the error is not a number", check.name));
        }
        worst = Some(check.largest.max(worst.unwrap_or(0.0)));
        unit = match unit {
            None => Some(&check.unit),
            Some(same) if same == check.unit => unit,
            Some(_) => Some(""),
        };
    }
    let worst = worst.ok_or("the scene has no [[check]], so no error can be measured")?;
    Ok((worst, unit.unwrap_or("").to_string()))
}
