//! What can be written on the command line behind the commands that run a scene. The texts here are the program's help.

use std::path::{Path, PathBuf};

use clap::Args;

use odyn::analyses::statics;
use odyn::scene::{AuditTolerance, Override};
use odyn::session::{Afterwards, RunOptions};

/// A scene and what the command line changes of it.
#[derive(Debug, Args)]
pub(super) struct SceneArgs {
    /// Scene file
    pub(super) scene: PathBuf,
    /// Change a parameter, a setting, or a key of a body or element; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) sets: Vec<String>,
    /// Relative tolerance of the integration
    #[arg(long, visible_alias = "tolerance", value_name = "X", value_parser = positive, allow_negative_numbers = true)]
    pub(super) tol: Option<f64>,
    /// End of the simulated time: in the scene's unit, or with its own such as "0.2 s"
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub(super) t_end: Option<String>,
    /// Method of integration: dop853 (default) and dopri5 (explicit), auto (dop853 or radau5, whichever costs less, also on the way),
    /// radau5 (implicit, for stiff scenes), radau9 (the same at tight tolerances), rk4 (needs --fixed-step)
    #[arg(long, value_name = "NAME")]
    pub(super) method: Option<String>,
    /// Equal steps of this size (at most) without error control, with any method: in the scene's unit, or with its own such as "10 us"
    #[arg(long, value_name = "TIME", allow_negative_numbers = true)]
    pub(super) fixed_step: Option<String>,
    /// How the equations of motion are written and evaluated
    #[arg(long, value_name = "NAME")]
    pub(super) engine: Option<String>,
    /// Coordinates of the equations of motion: auto, cartesian or joint
    #[arg(long, value_name = "NAME")]
    pub(super) formulation: Option<String>,
    /// Parts of the scene that share nothing: together (common steps), apart (each its own steps, method and coordinates; errors
    /// up to the tolerance in each) or auto (default: apart where eight or more of them switch, as contacts do)
    #[arg(long, value_name = "NAME")]
    pub(super) islands: Option<String>,
    /// Do without these savings, in place of the scene's own list: kinematic, row-choice, affine-loops, on-demand, audit, events. Results are the same, found by more work
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) without: Vec<String>,
    /// Library of elements, or folder to look for libraries in; may be repeated
    #[arg(long = "plugin", value_name = "PATH")]
    pub(super) plugins: Vec<PathBuf>,
    /// End the program, with exit code 4, when a call into a library takes longer. Without it such a call is reported after 10 s,
    /// with the element it was made for, and waited for
    #[arg(long, value_name = "SECONDS", value_parser = patience)]
    pub(super) watchdog: Option<f64>,
    /// Print JSON
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct RunArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Folder of the results [default: results/NAME of the scene file]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Write report.html into that folder at the end: verdict, motion, plots, table
    #[arg(long)]
    pub(super) report: bool,
    /// Go on from where the run with this folder of results ended
    #[arg(long, value_name = "DIR")]
    pub(super) from: Option<PathBuf>,
    /// Write a checkpoint each time so much simulated time has passed: in the scene's unit, or with its own such as
    /// every="0.5 s". `odyn resume` continues from the last one. Steps end at checkpoints, and each costs about as much as the start of the run
    #[arg(long, value_name = "every=TIME", value_parser = every)]
    pub(super) checkpoint: Option<String>,
    /// Also write `motion.bin`: where all bodies are at the output times, and what acts on them, for pictures
    #[arg(long)]
    pub(super) motion: bool,
    /// Run once more by another method, at a tenth of the tolerance and with steps no longer than between samples (with half the
    /// step where that is fixed), and report the largest difference in each output: an estimate of its error. More than the
    /// tolerance explains is `suspect`
    #[arg(long)]
    pub(super) verify: bool,
    /// Tell how many digits of each output are certain: the scene is computed once more by power series in numbers of 31 digits, so
    /// that errors of the steps and round-off both show. Also written as `digits.csv`. Where that cannot be, the digits are
    /// estimated by a run in other coordinates at a much smaller tolerance, and the reason is given
    #[arg(long)]
    pub(super) digits: bool,
    /// Threads for islands that run apart; as many as there are processors if left out. Results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) jobs: Option<u16>,
    /// Largest constraint violation and energy error that the audit lets pass, or `none`. Beyond it, results are `suspect`. If left
    /// out: 1e-8 for constraints and their rates, 1e4 times the tolerance but at least 1e-6 for energies, 1e-3 for all where steps
    /// are fixed
    #[arg(long, value_name = "X|none", value_parser = audit_tolerance, allow_negative_numbers = true)]
    pub(super) audit_tol: Option<AuditTolerance>,
    /// Run again whenever the scene or a library that it loads changes, until Ctrl-C. A library that was built again is loaded
    /// beside the old one
    #[arg(long)]
    pub(super) watch: bool,
    /// Refuse scenes with warnings
    #[arg(long)]
    pub(super) strict: bool,
    /// Also show how the scene is computed
    #[arg(short, long)]
    pub(super) verbose: bool,
    /// Print errors only
    #[arg(short, long, conflicts_with = "verbose")]
    pub(super) quiet: bool,
}

#[derive(Debug, Args)]
pub(super) struct ResumeArgs {
    /// Folder of the results of the run
    #[arg(value_name = "DIR")]
    pub(super) folder: PathBuf,
    /// Library of elements, or folder to look for libraries in, besides those of the run; may be repeated
    #[arg(long = "plugin", value_name = "PATH")]
    pub(super) plugins: Vec<PathBuf>,
    /// End the program, with exit code 4, when a call into a library takes longer. Without it such a call is reported after 10 s,
    /// with the element it was made for, and waited for
    #[arg(long, value_name = "SECONDS", value_parser = patience)]
    pub(super) watchdog: Option<f64>,
    /// Print JSON
    #[arg(long)]
    pub(super) json: bool,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
}

#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Refuse scenes with warnings
    #[arg(long)]
    pub(super) strict: bool,
}

impl RunArgs {
    /// What is done with the run once it is at its end.
    pub(super) fn afterwards(&self) -> Afterwards {
        Afterwards { verify: self.verify, digits: self.digits, report: self.report }
    }

    /// The options as the library takes them.
    pub(super) fn options(&self) -> RunOptions {
        let mut options = self.scene.options(self.audit_tol);
        let every = self.checkpoint.iter().map(|every| Override::new(format!("simulation.checkpoint_every={every}")));
        options.overrides.extend(every);
        options.afterwards = self.afterwards();
        options.overrides.extend((self.motion || self.report).then(|| Override::new("simulation.motion=true")));
        options
    }
}

impl SceneArgs {
    /// The options as the library takes them. An option with a key of its own stands for a `--set` behind all others.
    pub(super) fn options(&self, audit_tolerance: Option<AuditTolerance>) -> RunOptions {
        let mut overrides: Vec<Override> = self.sets.iter().map(Override::new).collect();
        let tolerance = self.tol.map(|value| format!("{value:e}"));
        let settings = [
            ("tolerance", tolerance.as_ref()),
            ("t_end", self.t_end.as_ref()),
            ("method", self.method.as_ref()),
            ("fixed_step", self.fixed_step.as_ref()),
            ("engine", self.engine.as_ref()),
            ("formulation", self.formulation.as_ref()),
            ("islands", self.islands.as_ref()),
        ];
        for (key, value) in settings {
            overrides.extend(value.map(|value| Override::new(format!("simulation.{key}={value}"))));
        }
        if !self.without.is_empty() {
            let names: Vec<String> = self.without.iter().map(|name| format!("{:?}", name.trim())).collect();
            overrides.push(Override::new(format!("simulation.without=[{}]", names.join(", "))));
        }
        let watchdog = super::failure::watchdog(self.watchdog, self.json);
        RunOptions {
            overrides,
            plugins: self.plugins.clone(),
            audit_tolerance,
            watchdog: Some(watchdog),
            equilibrium: Some(statics::start),
            ..RunOptions::default()
        }
    }

    /// Where results go unless the user says otherwise: `results/compressor` for `scenes/compressor.toml`.
    pub(super) fn default_output(&self) -> PathBuf {
        let stem = self.scene.file_stem().unwrap_or(self.scene.as_os_str());
        Path::new("results").join(stem)
    }
}

/// What follows `every=`.
fn every(text: &str) -> Result<String, String> {
    match text.strip_prefix("every=").map(str::trim) {
        Some(time) if !time.is_empty() => Ok(time.into()),
        _ => Err("write every=TIME, such as every=0.5s".into()),
    }
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("not a positive number".into()),
    }
}

/// So many of something, one or more.
pub(super) fn whole(text: &str) -> Result<std::num::NonZeroUsize, String> {
    text.parse().map_err(|_| "not a whole number of 1 or more".into())
}

/// A limit of the audit, or none.
pub(super) fn audit_tolerance(text: &str) -> Result<AuditTolerance, String> {
    match text {
        "none" => Ok(AuditTolerance::None),
        number => positive(number).map(AuditTolerance::Limit).map_err(|error| format!("{error}, nor `none`")),
    }
}

/// Seconds that a clock can count.
pub(super) fn patience(text: &str) -> Result<f64, String> {
    positive(text).and_then(|seconds| if seconds <= 1e9 { Ok(seconds) } else { Err("longer than 1e9 s".into()) })
}

pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value >= 0.0 && value.is_finite() => Ok(value),
        _ => Err("neither zero nor a positive number".into()),
    }
}
