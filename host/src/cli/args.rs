//! What can be written on the command line. The texts here are the program's help.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use super::analyses_args::{LineariseArgs, ModesArgs, StaticsArgs};
use super::deferred::Deferred;
use super::export_args::ExportCommand;
use super::fit_args::{FIT_HELP, FitArgs, SENSITIVITY_HELP, SensitivityArgs};
use super::motion_args::{self, BalanceArgs, InverseArgs, KinematicsArgs, LoadsArgs};
use super::scene_args::{CheckArgs, ResumeArgs, RunArgs, SceneArgs, not_negative, positive};
use super::store_args::{AddArgs, ListArgs, PackArgs, RemoveArgs, VerifyInstalledArgs};
use super::study_args::{STUDY_HELP, StudyCommand};
use super::workshop_args::{CheckPluginArgs, NewPluginArgs};

const AFTER_HELP: &str = "\
Results go to standard output, everything else to standard error. `odyn help COMMAND` has examples.

Exit codes:
  0    done
  2    the command line is wrong
  3    the scene or its model has mistakes
  4    a plugin is missing, unfit or failed
  5    the joints cannot be assembled
  6    the integration ended before its end (results up to there are written)
  7    the end was reached, but the audit, a check, a comparison or a verification found more than is allowed
  8    files cannot be read or written
  130  interrupted (results up to there are written)";

/// Multibody dynamics with joints and forces from plugins.
#[derive(Debug, Parser)]
#[command(name = "odyn", version, after_help = AFTER_HELP)]
pub(super) struct Arguments {
    /// Load all libraries into this process; otherwise those that are not trusted get a process of their own
    #[arg(long, global = true)]
    pub(super) in_process: bool,
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Integrate a scene and write its results
    #[command(after_help = "\
Examples:
  odyn run scenes/compressor.toml
  odyn run scenes/compressor.toml -o results/heavy --set piston.mass=0.04
  odyn run scenes/compressor.toml --tol 1e-11 --t-end \"50 ms\"
  odyn run scenes/compressor.toml --audit-tol 1e-9 --json -q
  odyn run scenes/compressor.toml --verify
  odyn run scenes/compressor.toml --digits
  odyn run scenes/compressor.toml --motion
  odyn run scenes/compressor.toml --t-end \"10 s\" --checkpoint every=1s
  odyn run pendulum.toml --watch

Ctrl-C ends the run after the current step with valid results, a second one at once.")]
    Run(Deferred<RunArgs>),
    /// Continue a run that was killed or interrupted, from its last checkpoint
    #[command(after_help = "\
The run must have been started with --checkpoint. Scene, options and libraries are those that it was started with, as its folder
tells; if one of them has changed since, the run is refused. Rows after the last checkpoint are computed again. The table
is the same, byte for byte, as that of a run with the same checkpoints that was left alone. --verify, --digits and --report are among
the options, also where the run was killed while it was judged.

Examples:
  odyn run scenes/compressor.toml --t-end \"10 s\" --checkpoint every=1s -o results/long
  odyn resume results/long

The exit codes are those of `odyn run`; 0 also where the run had reached its end, 7 where its results were suspect then.")]
    Resume(Deferred<ResumeArgs>),
    /// Run a scene with other values, again and again, and tabulate what comes out
    #[command(after_help = STUDY_HELP)]
    Study(StudyCommand),
    /// Find where a scene is at rest, and whether it stays there
    #[command(after_help = "\
Loads and reactions are in balance there, velocities are zero, element states at rest; what is prescribed is held as at the start.
Stability is that of small motions; directions that meet no resistance are listed with the bodies that take part.

Examples:
  odyn statics scenes/benchmarks/chain_N10.toml
  odyn statics pendulum.toml --all 20
  odyn statics car.toml -o results/car-rest
  odyn run car.toml --from results/car-rest

The exit code is 5 where no equilibrium was found, with the cause.")]
    Statics(Deferred<StaticsArgs>),
    /// Eigenvalues of small motions: frequencies, damping, shapes, energies
    #[command(after_help = "\
Derivatives are exact. Of a state that is not at rest, the linearisation is that of the instant, and the verdict is `frozen` where
coefficients change along the motion; what turns as one is seen in axes that turn with it.

Examples:
  odyn modes scenes/benchmarks/chain_N10.toml --at equilibrium
  odyn modes rotor.toml --set rotor.speed=3000rpm --json
  odyn modes rotor.toml --over rotor.speed=0rpm:6000rpm:31    (a Campbell diagram)
  odyn modes scenes/compressor.toml --at 20
  odyn modes car.toml --from results/car-rest")]
    Modes(Deferred<ModesArgs>),
    /// A linear model for control: A, B, C, D from inputs of the scene to outputs
    #[command(after_help = "\
z' = A z + B u, y = C z + D u for small changes; time in s, z in SI, u and y in the units of the scene's inputs and outputs. Written as
linear.npz (NumPy), A.csv, ..., linear.json.

Examples:
  odyn linearise scene.toml --inputs motor.torque --outputs angle,speed
  odyn linearise scene.toml --at equilibrium -o results/model")]
    Linearise(Deferred<LineariseArgs>),
    /// Derivatives of outputs and figures with respect to numbers of a scene
    #[command(after_help = SENSITIVITY_HELP)]
    Sensitivity(Deferred<SensitivityArgs>),
    /// Find numbers of a scene from measurements, with confidence intervals
    #[command(after_help = FIT_HELP)]
    Fit(Deferred<FitArgs>),
    /// The forces and torques of actuators that cause a prescribed motion
    #[command(after_help = motion_args::INVERSE)]
    Inverse(Deferred<InverseArgs>),
    /// Places, ratios, limits and dead points of a driven mechanism, whatever its masses
    #[command(after_help = motion_args::KINEMATICS)]
    Kinematics(Deferred<KinematicsArgs>),
    /// All loads on one body at chosen times or at its peaks, in balance, as input for finite elements
    #[command(after_help = motion_args::LOADS)]
    Loads(Deferred<LoadsArgs>),
    /// Shaking force and moment on the ground by harmonics, and the counterweight that makes them least
    #[command(after_help = motion_args::BALANCE)]
    Balance(Deferred<BalanceArgs>),
    /// Check a scene: mobility, redundant joint equations, reactions that are not unique, warnings
    #[command(after_help = "\
Examples:
  odyn check scenes/compressor.toml
  odyn check scenes/compressor.toml --strict
  odyn check scenes/compressor.toml --set rod.length=40mm --json")]
    Check(Deferred<CheckArgs>),
    /// Show how a scene would be computed: topology, what is skipped and why, operation counts
    #[command(after_help = "\
Examples:
  odyn plan scenes/compressor.toml
  odyn plan scenes/compressor.toml --engine reference --json")]
    Plan(Deferred<SceneArgs>),
    /// Show the element types that libraries provide
    Elements {
        #[command(subcommand)]
        command: ElementsCommand,
    },
    /// Make, examine, pack, install and show libraries of elements
    Plugin {
        #[command(subcommand)]
        command: PluginCommand,
    },
    /// Run scenes with checks, judge them, and write the verification manual
    #[command(after_help = "\
Each scene is compared with the references of its [[check]]s, and the loads that it reports with the motion of every body
(Newton-Euler). In a folder, every element of its libraries needs a scene that verifies it.

Examples:
  odyn verify
  odyn verify --quick
  odyn verify my-scenes --plugin target/release -o results/my-manual
  odyn verify scenes/verification/revolute.toml

The exit code is 7 if a scene fails or an element has no scene.")]
    Verify(Deferred<VerifyArgs>),
    /// Run the numerical stress suite: scenes that are hard to compute, with bounds for what must come out
    #[command(after_help = "\
The suite is a file of trials: scenes with changes, and what is expected of each: bounds on violations, energy and checks; a
refusal or an early end with a message that names the cause; results equal to those of another trial. The table shows, of each,
the measure nearest to its bound; stress.html shows all of them.

Examples:
  odyn stress
  odyn stress --full
  odyn stress bennett doors
  odyn stress --suite my-suite.toml --plugin target/release -o results/my-manual

The short form takes some seconds, the full one some minutes. The exit code is 7 if a bound is broken or anything else is
not as expected.")]
    Stress(Deferred<StressArgs>),
    /// Measure error against time and work, for all methods and tolerances, and draw the curves
    #[command(after_help = "\
The scenes' [[check]]s tell what is measured: the error of a run is the largest difference of a check of kind `position` or
`orientation` (of any check where there are none of these) from its reference. The outputs of a scene without checks are measured
against a reference that is computed once and kept as NAME.reference.csv; their errors are shares of an output's peak, or of what
is natural for its dimension in the scene where that is more. Times are medians. At the end, the best time at errors of 1e-3, 1e-6
and 1e-9 of every method, and other programs' times over ours. Writes bench.csv, index.html and a drawing of each scene's curves
(NAME.svg).

Examples:
  odyn bench
  odyn bench --quick
  odyn bench my-scenes --methods dop853 --tols 1e-6,1e-9 --repeats 9
  odyn bench my-scene.toml --t-end 50ms
  odyn bench scenes/benchmarks/A04.toml --peers results/peers.csv -o results/a04

Methods without error control get step sizes instead of tolerances. The exit code is 7 if no run of a scene reaches its end.")]
    Bench(Deferred<BenchArgs>),
    /// Write one HTML file that shows runs: verdict, motion, plots, table, and how they were computed
    #[command(after_help = "\
The file needs no network and no other file: it can be sent. Motion is shown where a run wrote it (`odyn run --motion`). Of several
runs the plots are laid over each other, with their differences from the first.

Examples:
  odyn report results/compressor
  odyn report results/before results/after -o comparison.html
  odyn run scenes/compressor.toml --report     (at the end of a run)")]
    Report(Deferred<super::report::ReportArgs>),
    /// Edit a scene in the browser, with messages, mechanism and runs beside the text
    #[command(after_help = "\
Prints an address for browsers on this machine; nothing is sent elsewhere, and only SCENE is written, when you save.

Examples:
  odyn studio scenes/compressor.toml")]
    Studio(Deferred<super::studio::StudioArgs>),
    /// Compare two tables of results: largest difference in each common column
    #[command(after_help = "\
Rows are matched by time, columns by name. Differences are divided by the largest value of the column in B. With --tol, a table
without rows or columns that B has does not pass; what only A has is left out.

Examples:
  odyn compare results/compressor/results.csv scenes/reference/compressor.csv
  odyn compare before/results.csv after/results.csv --tol 1e-9")]
    Compare(Deferred<CompareArgs>),
    /// Write the motion of a run in a form that other programs show, or a scene as a program for other places
    Export {
        #[command(subcommand)]
        command: ExportCommand,
    },
    /// Run a scene in real time, its inputs and outputs exchanged with a controller
    #[command(after_help = "\
Steps are those of `odyn export c`: explicit, of a fixed size, the same number of operations in each, so that what cannot be exported
(contacts with impacts, memories of elements) is refused. At each tick the newest inputs are taken, the motion is computed up to the
next tick, and its outputs are sent at once, to whoever sent the last packet. Where no packet came the inputs are held, which is counted.
The report (hil.txt, hil.json) has overruns, percentiles of lateness and computing time, and the worst of each. Exit code 0 at the end,
130 after Ctrl-C, 6 where a step cannot be computed. What packets hold: --describe, and the book, \"Real time\".

Examples:
  odyn hil scenes/hil/cart.toml --rate 1kHz --udp 9000 --for \"60 s\"
  odyn hil scenes/hil/cart.toml --describe
  python3 scenes/hil/controller.py --udp 9000
  odyn hil scenes/hil/cart.toml --rate \"500 Hz\" --shm odyn --method dopri5 --substeps 2 --wait --endless")]
    Hil(Deferred<super::hil_args::HilArgs>),
    /// Write a mechanism of another program (URDF, MJCF) as a scene
    #[command(after_help = super::import::HELP)]
    Import(Deferred<super::import::ImportArgs>),
    /// Explain a message by its code, or a remedy of a run's report by its name
    #[command(after_help = "\
Examples:
  odyn explain ODY0203
  odyn explain rank-safe
  odyn explain          (all codes and remedies)
  odyn explain --markdown > messages.md")]
    Explain(Deferred<ExplainArgs>),
    /// Write the JSON schema of scene files, with all elements that were found, for editors; or the same for people
    #[command(after_help = "\
With a scene, the schema has the elements of the libraries that the scene names; without, those of all libraries that can be
found, as `odyn plugin list` shows them. An editor with a TOML language server (taplo, Even Better TOML) takes it from the
first line of the scene:

  #:schema ./odyn.schema.json

and then completes keys, types and parameters, shows what they mean, and marks mistakes.

Examples:
  odyn schema -o odyn.schema.json
  odyn schema --plugin ../my-plugin/target/release -o odyn.schema.json
  odyn schema scenes/compressor.toml > odyn.schema.json
  odyn schema --markdown > scene.md")]
    Schema(Deferred<super::schema::SchemaArgs>),
    /// Print the script with which a shell completes the command line
    #[command(after_help = "\
Examples:
  odyn completions bash > ~/.local/share/bash-completion/completions/odyn
  odyn completions zsh > ~/.zfunc/_odyn
  odyn completions fish > ~/.config/fish/completions/odyn.fish
  odyn completions powershell >> $PROFILE")]
    Completions(Deferred<CompletionsArgs>),
    /// Print the manual page, or write it and those of all commands into a folder
    #[command(after_help = "\
Examples:
  odyn man | man -l -
  odyn man -o ~/.local/share/man/man1")]
    Man(Deferred<ManArgs>),
}

#[derive(Debug, Subcommand)]
pub(super) enum ElementsCommand {
    /// List all element types
    #[command(after_help = "\
Examples:
  odyn elements list
  odyn elements list --plugin ../my-plugin/target/release --json")]
    List(Deferred<PlacesArgs>),
    /// Show frames, rows, channels and parameters of an element type
    #[command(after_help = "\
Examples:
  odyn elements describe revolute
  odyn elements describe odyn-forces/translational-spring-damper --json")]
    Describe(Deferred<DescribeArgs>),
    /// The name of an element type, as `describe` takes it
    #[command(external_subcommand)]
    Named(Vec<String>),
}

#[derive(Debug, Subcommand)]
pub(super) enum PluginCommand {
    /// List all libraries that can be found, without running them
    #[command(after_help = "\
Examples:
  odyn plugin list
  odyn plugin list --plugin ../my-plugin/target/release

  odyn plugin list --pins

Looked into are, in this order, --plugin, the project's .odyn/plugins (in the working folder or above), the folders of the
environment variable ODYN_PLUGIN_PATH, the user's installed libraries, and the folder of this program. A scene adds its own
with `[plugins] path`, behind --plugin, and its project is the one that its own folder is in. --pins prints lines for `[plugins]`
of a scene, with version and SHA-256.")]
    List(Deferred<ListArgs>),
    /// Put a library, the descriptions of its elements, documentation and licence into one file to give away
    #[command(after_help = "\
The file is NAME-VERSION-TARGET.odynplugin, a tar.gz with a plugin.toml that has the SHA-256 of every other file. README.md and
licence texts beside the Cargo.toml of the library are taken along. The library is loaded, to ask for its descriptions. The
same files give the same bytes.

Examples:
  odyn plugin pack target/release/libacme_wobble.so
  odyn plugin pack target/release/libacme_wobble.so --docs docs --licence LICENSE-MIT -o wobble.odynplugin")]
    Pack(Deferred<PackArgs>),
    /// Install a library from the file that `odyn plugin pack` made
    #[command(after_help = "\
Hashes, target and names of the files are checked, then the library is loaded for trial, in a process of its own.
Versions stay side by side; a version is never replaced by another build of it.

Examples:
  odyn plugin add acme-wobble-1.2.0-x86_64-unknown-linux-gnu.odynplugin
  odyn plugin add wobble.odynplugin --project .")]
    Add(Deferred<AddArgs>),
    /// Remove an installed library
    #[command(after_help = "\
Examples:
  odyn plugin remove acme-wobble
  odyn plugin remove acme-wobble@1.2.0 --project .")]
    Remove(Deferred<RemoveArgs>),
    /// Compare the files of installed libraries with what was installed, without running them
    #[command(after_help = "\
Looked into are the project that the working folder is in, and the user's installed libraries. The exit code is 4 if a file is
missing, changed or strange.

Examples:
  odyn plugin verify
  odyn plugin verify acme-wobble --project .")]
    Verify(Deferred<VerifyInstalledArgs>),
    /// Make a crate for elements of one's own: sources, tests, a scene, a manifest
    #[command(after_help = "\
Examples:
  odyn plugin new acme-wobble
  odyn plugin new acme-spring --kind force
  odyn plugin new ../acme-compressor --kind library --api ../odyn/element-api
  odyn plugin new damper --kind force --into ../acme-compressor

The crate builds, passes its tests and runs its scene as it is. NAME is a folder that does not exist yet; its last part becomes the
name of the crate, and, but for a library, of its element.")]
    New(Deferred<NewPluginArgs>),
    /// Examine the elements of a library with the test kit, through its binary interface
    #[command(after_help = "\
Derivatives, invariance, action and reaction, power, NaN, states, determinism, threads, panics: what any element must fulfil, and
what an evaluation costs. Required parameters that are not given get a value inside their range.

Examples:
  odyn plugin check target/release/libacme_wobble.so
  odyn plugin check target/release/libacme_wobble.so --params length=25cm --params wobble.tilt=\"10 deg\"
  odyn plugin check target/release/libacme_wobble.so --params examples.toml --element wobble --json
  odyn plugin check target/release/libacme_field.so --except field.frame-invariance

The exit code is 4 if the library cannot be loaded, 7 if an element lacks something.")]
    Check(Deferred<CheckPluginArgs>),
}

/// Where to look for libraries.
#[derive(Debug, Args)]
pub(super) struct PlacesArgs {
    /// Library of elements, or folder to look for libraries in; may be repeated
    #[arg(long = "plugin", value_name = "PATH")]
    pub(super) plugins: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct DescribeArgs {
    /// Element type, with or without its package
    pub(super) name: String,
    #[command(flatten)]
    pub(super) places: PlacesArgs,
}

#[derive(Debug, Args)]
pub(super) struct VerifyArgs {
    /// Scene files, or folders of such
    #[arg(value_name = "SCENE|DIR", default_value = "scenes/verification")]
    pub(super) scenes: Vec<PathBuf>,
    /// Folder of the manual
    #[arg(short, long, value_name = "DIR", default_value = "results/verification")]
    pub(super) output: PathBuf,
    /// Run each scene at its own tolerance only: the manual shows no errors over the tolerance
    #[arg(long)]
    pub(super) quick: bool,
    /// Tell elements that no scene verifies, but let them pass
    #[arg(long)]
    pub(super) allow_gaps: bool,
    /// Scenes at the same time; as many as there are processors if left out. The report and the manual do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) jobs: Option<u16>,
    /// Library of elements, or folder to look for libraries in; may be repeated
    #[arg(long = "plugin", value_name = "PATH")]
    pub(super) plugins: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct StressArgs {
    /// Trials to run, with those they are compared with; all if left out
    #[arg(value_name = "NAME")]
    pub(super) names: Vec<String>,
    /// The file of trials
    #[arg(long, value_name = "FILE", default_value = "scenes/stress/suite.toml")]
    pub(super) suite: PathBuf,
    /// Every trial, and for as long as its scene says; else shorter runs where that is given
    #[arg(long)]
    pub(super) full: bool,
    /// Folder of the page
    #[arg(short, long, value_name = "DIR", default_value = "results/verification")]
    pub(super) output: PathBuf,
    /// Trials at the same time; as many as there are processors if left out. Outcomes do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) jobs: Option<u16>,
    /// Library of elements, or folder to look for libraries in; may be repeated
    #[arg(long = "plugin", value_name = "PATH")]
    pub(super) plugins: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct BenchArgs {
    /// Scene files, or folders of such
    #[arg(value_name = "SCENE|DIR", default_value = "scenes/benchmarks")]
    pub(super) scenes: Vec<PathBuf>,
    /// Folder of the table and the page
    #[arg(short, long, value_name = "DIR", default_value = "results/bench")]
    pub(super) output: PathBuf,
    /// Methods of integration; all if left out
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) methods: Vec<String>,
    /// Relative tolerances; 1e-4 to 1e-12 if left out
    #[arg(long, value_name = "X,...", value_delimiter = ',', value_parser = positive)]
    pub(super) tols: Vec<f64>,
    /// Runs of which times are the medians
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) repeats: u32,
    /// A run that takes longer has failed
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = positive)]
    pub(super) limit: f64,
    /// End of the simulated time: in the scene's unit, or with its own such as "0.2 s"
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub(super) t_end: Option<String>,
    /// The default method at two tolerances, each run once
    #[arg(long, conflicts_with_all = ["methods", "tols", "repeats"])]
    pub(super) quick: bool,
    /// Table of measurements of other programs, in the form of bench.csv; may be repeated
    #[arg(long, value_name = "FILE")]
    pub(super) peers: Vec<PathBuf>,
    /// Date to note in table and page
    #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
    pub(super) date: String,
    /// Library of elements, or folder to look for libraries in; may be repeated
    #[arg(long = "plugin", value_name = "PATH")]
    pub(super) plugins: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    /// Table to judge
    pub(super) a: PathBuf,
    /// Table to judge it by
    pub(super) b: PathBuf,
    /// Largest relative difference that passes; beyond it, or where A lacks rows or columns of B, the exit code is 7
    #[arg(long, value_name = "X", value_parser = not_negative, allow_negative_numbers = true)]
    pub(super) tol: Option<f64>,
    /// With --tol, judge what both tables have, whatever else B has
    #[arg(long, requires = "tol")]
    pub(super) allow_missing: bool,
    /// Print JSON
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct ExplainArgs {
    /// Code of a message, such as ODY0203, or name of a remedy, such as rank-safe; all if left out
    pub(super) code: Option<String>,
    /// All codes and remedies with their explanations, as a page in Markdown
    #[arg(long, conflicts_with = "code")]
    pub(super) markdown: bool,
}

#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// The shell
    pub(super) shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// Folder for odyn.1 and a page of each command
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
}
