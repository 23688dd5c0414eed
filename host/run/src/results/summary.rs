//! [`Summary`]: everything about a run besides its samples, as `summary.json`.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Serialize, Serializer};

use super::text::significant;
use super::{Audit, AuditLimits, CheckResult, Digits, ElementRecord, Recoveries, Remedy, ResultsError, Verified};
use crate::diagnostics::Code;

/// How a run stands.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Not ended, or killed without a chance to say so; the table has whole rows up to some time.
    #[default]
    Running,
    /// The end was reached.
    Completed,
    /// The end was reached, and the audit or a verification found more than is allowed: results are not to be trusted as they
    /// are.
    Suspect,
    /// Ended before, with valid results up to `t_end_reached`.
    StoppedEarly,
    /// Ended by an error; results up to `t_end_reached` are valid.
    Failed,
}

impl Status {
    /// As printed.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Running => "running",
            Self::Completed => "completed",
            Self::Suspect => "suspect",
            Self::StoppedEarly => "stopped early",
            Self::Failed => "failed",
        }
    }

    /// Whether the end was reached, however the results were judged.
    #[must_use]
    pub fn reached_end(self) -> bool {
        matches!(self, Self::Completed | Self::Suspect)
    }
}

/// The content of `summary.json`. Numbers that are not finite become `null` there.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Summary {
    /// How the run stands.
    pub status: Status,
    /// Why it ended, or why it is suspect; empty where it was completed.
    pub reason: String,
    /// Code of the reason, if it has one.
    #[serde(serialize_with = "in_letters")]
    pub code: Option<Code>,
    /// The scene file as named by the user.
    pub scene: String,
    /// SHA-256 of its text.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub scene_sha256: String,
    /// What was set on the command line instead, as `KEY=VALUE`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub overrides: Vec<String>,
    /// Title of the scene; may be empty.
    pub title: String,
    /// Version of the program.
    pub odyn_version: String,
    /// Method of integration.
    pub method: String,
    /// Formulation and evaluation of the equations.
    pub engine: String,
    /// Relative tolerance of the integration.
    pub tolerance: f64,
    /// Requested end, in `time_unit`.
    pub t_end: f64,
    /// Time of the last accepted state, in `time_unit`.
    pub t_end_reached: f64,
    /// Unit of times in the table.
    pub time_unit: String,
    /// Rows of the table.
    pub rows: u64,
    /// SHA-256 of `results.csv` in hexadecimal digits, once it is complete: reading the table back checks it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub results_sha256: Option<String>,
    /// Accepted steps.
    pub steps: u64,
    /// Steps tried and not accepted.
    pub rejected: u64,
    /// What was done where the plain way did not get on.
    pub recoveries: Recoveries,
    /// Evaluations of the right side.
    pub evaluations: u64,
    /// Factorisations of the system for accelerations and multipliers.
    pub factorisations: u64,
    /// Jacobians of the right side, by implicit methods.
    pub jacobians: u64,
    /// Factorisations of the matrices of implicit steps.
    pub newton_factorisations: u64,
    /// Iterations of Newton's method in implicit steps.
    pub newton_iterations: u64,
    /// Time from which on stability limited explicit steps, in `time_unit`; with `auto`, where an implicit method first took
    /// over because it was likely to cost less.
    pub stiff_from: Option<f64>,
    /// Projections onto the constraints.
    pub projections: u64,
    /// Newton corrections of positions.
    pub position_corrections: u64,
    /// Iterations for forces that depend on reactions or accelerations.
    pub coupling_iterations: u64,
    /// Steps over which switches, functions of time and turns were enclosed.
    pub enclosures: u64,
    /// Pieces of these steps on which the enclosure was too wide to decide, and the ends of the piece did.
    pub unproven: u64,
    /// Checkpoints that were written.
    pub checkpoints: u64,
    /// How often the run was resumed from one.
    pub resumed: u64,
    /// The differences from a run at a sharper tolerance, where they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verified: Option<Verified>,
    /// Digits of the outputs that are certain, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub digits: Option<Digits>,
    /// Where islands were integrated apart: how each went, in their order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub islands: Vec<IslandWork>,
    /// Reading the scene, loading libraries, resolving, assembly, s.
    pub load_time_s: f64,
    /// Recording, differentiating, compiling, s.
    pub compile_time_s: f64,
    /// Programs that were turned into machine code, before the first step or during the run.
    pub machine_code_programs: u64,
    /// Size of the machine code, bytes.
    pub machine_code_bytes: u64,
    /// Making the machine code, s; part of `compile_time_s` if it was made before the first step, else beside the run.
    pub machine_code_time_s: f64,
    /// Time of the first step that ran machine code, in `time_unit`.
    pub machine_code_from: Option<f64>,
    /// Integration with its samples, s.
    pub integration_time_s: f64,
    /// From start to end, s.
    pub wall_time_s: f64,
    /// Degrees of freedom at the assembled position.
    pub mobility: u64,
    /// Number of joint equations that follow from others.
    pub redundant_rows: u64,
    /// Their joints and rows.
    pub redundant_row_names: Vec<String>,
    /// Outputs that rigid bodies do not determine: reactions that redundant joints share.
    pub not_unique: Vec<String>,
    /// Velocities at the start that neither the scene nor the joints determine: those of least kinetic energy were taken.
    pub chosen_velocities: Vec<StartVelocity>,
    /// Joints that have let go, in the order of their times.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub releases: Vec<Released>,
    /// What was checked.
    pub audit: Audit,
    /// What the audit may find before results are suspect; `None` where it is not judged.
    pub audit_limits: Option<AuditLimits>,
    /// Figures of the scene.
    pub figures: Vec<FigureResult>,
    /// Checks of the scene, without their samples.
    pub checks: Vec<CheckResult>,
    /// What elements themselves have to say, and how far their conditions held.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub elements: Vec<ElementRecord>,
    /// Libraries whose elements were used.
    pub libraries: Vec<LibraryUsed>,
    /// Warnings, one line each.
    pub warnings: Vec<String>,
}

/// How an island went that was integrated apart.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct IslandWork {
    /// Its bodies.
    pub bodies: Vec<String>,
    /// How it stands.
    pub status: Status,
    /// Why it ended, unless it was completed; else empty.
    pub reason: String,
    /// Time of its last accepted state, in `time_unit`; later ones than the earliest of all islands are not in the table.
    pub t_end_reached: f64,
    /// Method of integration.
    pub method: String,
    /// Formulation and evaluation of its equations.
    pub engine: String,
    /// Accepted steps.
    pub steps: u64,
    /// Steps tried and not accepted.
    pub rejected: u64,
    /// Evaluations of the right side.
    pub evaluations: u64,
    /// Jacobians of the right side, by implicit methods.
    pub jacobians: u64,
    /// Time from which on stability limited explicit steps, as in [`Summary::stiff_from`].
    pub stiff_from: Option<f64>,
    /// What was checked, its energies by themselves.
    pub audit: Audit,
    /// Integration with its samples, s.
    pub integration_time_s: f64,
}

/// Work done by a run, without its times.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Accepted steps.
    pub steps: u64,
    /// Steps tried and not accepted.
    pub rejected: u64,
    /// Evaluations of the right side.
    pub evaluations: u64,
    /// Factorisations of the system for accelerations and multipliers.
    pub factorisations: u64,
    /// Evaluations for which the rank-safe engine was called in, and those next to a singular position.
    pub rank_safe: u64,
    /// Steps that end where the equations switch.
    pub events: u64,
}

/// A component of the velocity of a body at the start.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct StartVelocity {
    /// The body.
    pub body: String,
    /// `velocity`, of the origin of the body frame, or `angular velocity`.
    pub quantity: &'static str,
    /// Axis of the ground: `x`, `y`, `z`.
    pub component: &'static str,
    /// The number, in `unit`.
    pub value: f64,
    /// Unit of the scene.
    pub unit: String,
}

impl std::fmt::Display for StartVelocity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { body, quantity, component, value, unit } = self;
        write!(f, "{body}: {quantity} {component} = {} {unit}", significant(*value, 4))
    }
}

/// A joint that has let go during the run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Released {
    /// The joint.
    pub joint: String,
    /// When, in `time_unit`.
    pub time: f64,
    /// What decided, with its value: `tension = 30 N`.
    pub by: String,
}

/// A figure of the scene as it came out.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct FigureResult {
    /// Its name.
    pub name: String,
    /// The number, in `unit`; `None` if there is none.
    pub value: Option<f64>,
    /// The published number, in `unit`.
    pub published: Option<f64>,
    /// Unit of both.
    pub unit: String,
    /// Remark of the scene; may be empty.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// Why there is no number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

impl FigureResult {
    /// Difference from the published number as a share of it; `None` if one of them is missing, or the published number
    /// is zero.
    #[must_use]
    pub fn relative_difference(&self) -> Option<f64> {
        let (value, published) = (self.value?, self.published?);
        (published != 0.0).then(|| (value - published) / published.abs())
    }
}

/// A library whose elements were used.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct LibraryUsed {
    /// Name of its package.
    pub package: String,
    /// Version of its package.
    pub version: String,
    /// SHA-256 of its file; `None` if it is linked in.
    pub sha256: Option<String>,
}

impl Summary {
    /// The work done.
    #[must_use]
    pub fn work(&self) -> Work {
        Work {
            steps: self.steps,
            rejected: self.rejected,
            evaluations: self.evaluations,
            factorisations: self.factorisations,
            rank_safe: self.recoveries[Remedy::RankSafe] + self.recoveries[Remedy::Passage],
            events: self.recoveries[Remedy::Event],
        }
    }

    /// Makes it that of a run that failed.
    pub(crate) fn fail(&mut self, reason: String, code: Option<Code>) {
        (self.status, self.reason, self.code) = (Status::Failed, reason, code);
    }

    /// Writes the summary in one move: a reader sees the former file or this one, never a part.
    ///
    /// # Errors
    /// [`ResultsError::Write`]; the former file is then untouched.
    pub fn write(&self, path: &Path) -> Result<(), ResultsError> {
        write_whole(path, self)
    }

    /// As indented JSON, with a newline at the end.
    #[must_use]
    pub fn to_json(&self) -> String {
        json(self)
    }

    /// All counters of work, with their names in `summary.json`, for runs that are made of several.
    pub fn counts(&mut self) -> Vec<(&'static str, &mut u64)> {
        let work = [
            ("steps", &mut self.steps),
            ("rejected", &mut self.rejected),
            ("evaluations", &mut self.evaluations),
            ("factorisations", &mut self.factorisations),
            ("jacobians", &mut self.jacobians),
            ("newton_factorisations", &mut self.newton_factorisations),
            ("newton_iterations", &mut self.newton_iterations),
            ("projections", &mut self.projections),
            ("position_corrections", &mut self.position_corrections),
            ("coupling_iterations", &mut self.coupling_iterations),
            ("enclosures", &mut self.enclosures),
            ("unproven", &mut self.unproven),
            ("machine_code_programs", &mut self.machine_code_programs),
        ];
        work.into_iter().chain(self.recoveries.counts()).collect()
    }

    /// Adds the counters of a part of the run.
    pub fn add_counts(&mut self, part: &Self) {
        let mut part = part.clone();
        for ((_, sum), (_, count)) in self.counts().into_iter().zip(part.counts()) {
            *sum += *count;
        }
    }

    /// Whether all checks of the scene passed; true without checks.
    #[must_use]
    pub fn checks_passed(&self) -> bool {
        self.checks.iter().all(|check| check.passed)
    }

    /// Whether the audit kept its limits; true where it is not judged.
    #[must_use]
    pub fn audit_passed(&self) -> bool {
        self.audit_limits.is_none_or(|limits| self.audit.beyond(&limits).is_empty())
    }

    /// Notes a reason to doubt the results, with its code: in the warnings, and where the end was reached, in the status.
    pub fn suspect(&mut self, code: Code, reason: &str) {
        self.warnings.push(format!("{code}: {reason}"));
        match self.status {
            Status::Completed => {
                (self.status, self.code, self.reason) = (Status::Suspect, Some(code), reason.to_owned());
            }
            Status::Suspect => self.reason = format!("{}; {reason}", self.reason),
            _ => {}
        }
    }
}

/// A code as it is written.
fn in_letters<S: Serializer>(code: &Option<Code>, serializer: S) -> Result<S::Ok, S::Error> {
    code.map(|code| code.code).serialize(serializer)
}

/// Indented JSON with a newline at the end, of plain structs.
pub(super) fn json<T: Serialize>(value: &T) -> String {
    let mut text = serde_json::to_string_pretty(value).expect("plain structs with text keys have a JSON form");
    text.push('\n');
    text
}

/// Writes a value as JSON beside its place, then moves it there.
pub(super) fn write_whole<T: Serialize>(path: &Path, value: &T) -> Result<(), ResultsError> {
    replace(path, json(value).as_bytes(), false)
}

/// The same; a file that says so already is left as it is.
pub(super) fn write_where_new<T: Serialize>(path: &Path, value: &T) -> Result<(), ResultsError> {
    let text = json(value);
    if fs::read(path).is_ok_and(|there| there == text.as_bytes()) {
        return Ok(());
    }
    replace(path, text.as_bytes(), false)
}

/// Writes a file beside its place, then moves it there. What is to be `durable` is on the disk when this returns, so that
/// even a computer that loses its power has the former file or this one.
///
/// # Errors
/// [`ResultsError::Write`]; the former file is then untouched.
pub fn replace(path: &Path, content: &[u8], durable: bool) -> Result<(), ResultsError> {
    replace_with(path, durable, |file| file.write_all(content))
}

/// The same with content that `write` gives piece by piece.
///
/// # Errors
/// [`ResultsError::Write`], also for what `write` says; the former file is then untouched.
pub fn replace_with(
    path: &Path,
    durable: bool,
    write: impl FnOnce(&mut fs::File) -> std::io::Result<()>,
) -> Result<(), ResultsError> {
    // A pipe or a terminal is written to.
    if fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir()) {
        let opened = fs::OpenOptions::new().write(true).open(path);
        return opened.and_then(|mut file| write(&mut file)).map_err(|cause| ResultsError::write(path, cause));
    }
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.tmp", std::process::id()));
    let beside: PathBuf = path.with_file_name(name);
    let written = || -> std::io::Result<()> {
        let mut file = fs::File::create(&beside)?;
        write(&mut file)?;
        if durable {
            file.sync_all()?;
            fs::rename(&beside, path)?;
        } else {
            take_place(&beside, path)?;
        }
        // The move itself; only Unix opens folders.
        #[cfg(unix)]
        if durable && let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            fs::File::open(folder)?.sync_all()?;
        }
        Ok(())
    };
    written().map_err(|cause| {
        // Nothing is left behind; the first cause is the one to tell.
        let _ = fs::remove_file(&beside);
        ResultsError::write(path, cause)
    })
}

/// Moves a file to a place in one move, whatever file is there: that one and this change places, and it is removed then. What is
/// renamed onto a file, some file systems bring to the disk at once; the next run, which removes it, would wait for that.
fn take_place(from: &Path, place: &Path) -> std::io::Result<()> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        let is_file = fs::symlink_metadata(place).is_ok_and(|data| data.is_file());
        // Not all file systems can do this.
        if is_file && renameat_with(CWD, from, CWD, place, RenameFlags::EXCHANGE).is_ok() {
            // The place has what belongs there, whatever becomes of the former file.
            let _ = fs::remove_file(from);
            return Ok(());
        }
    }
    fs::rename(from, place)
}
