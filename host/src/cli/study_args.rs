//! What can be written on the command line behind `odyn study`. The texts here are the program's help.

use std::path::PathBuf;

use clap::{ArgMatches, Args, Command, Error, FromArgMatches, Subcommand, ValueEnum};

use odyn::scene::AuditTolerance;
use odyn::study::{MOST_SHARDS, Shard};

use super::deferred::Deferred;
use super::scene_args::{SceneArgs, audit_tolerance};

pub(super) const STUDY_HELP: &str = "\
Every combination of the varied values, or every point of --lhs, --sobol or --csv, is a run, the one that `odyn run` would do
with the same --set; the table has the scene's figures, the last value of each output, status, audit and work of every run, and
is the same however many runs go on at the same time, and in however many shards. Runs that fail are told in the table; the
others stay.

Examples:
  odyn study scenes/compressor.toml --vary crank.radius=8mm:10mm:11
  odyn study scenes/compressor.toml --vary rod.length=40mm,42mm,45mm --vary piston.mass=0.03:0.05:5 --jobs 2
  odyn study scenes/compressor.toml --vary simulation.tolerance=1e-6,1e-8,1e-10 --results -o results/tolerances
  odyn study scenes/compressor.toml --lhs 10000 --seed 1 --vary crank.radius=8mm:10mm --vary rod.length=40mm:45mm
  odyn study scenes/compressor.toml --vary crank.radius=8mm:10mm:11 --series x_p,theta --samples 200
  odyn study scenes/compressor.toml --csv points.csv --shard 17/64 --resume -o results/points
  odyn study scenes/compressor.toml --csv points.csv --emit slurm --shards 64 -o results/points
  odyn study merge results/points

The exit code is that of the first run that has one, and 130 where the study was interrupted. That of a shard is 0 as soon as its part is complete, whatever its rows say;
`odyn study merge` has the code of the study.";

/// A study, or what is done with its parts.
#[derive(Debug)]
pub(super) enum StudyCommand {
    Points(Box<StudyArgs>),
    Merge(MergeArgs),
}

/// What stands in place of a scene.
#[derive(Debug, Subcommand)]
enum StudyPart {
    /// Make one table of the parts that the shards of a study left: the same bytes as those of the study in one
    #[command(after_help = "\
All parts must be there, as they were written, and of one study.

Examples:
  odyn study merge results/points
  odyn study merge results/points --json

The exit code is that of the first run that has one, and 130 where the study was interrupted.")]
    Merge(MergeArgs),
}

// By hand, since a derived command with a subcommand has no arguments that must be there without it.
impl Args for StudyCommand {
    fn augment_args(command: Command) -> Command {
        let command = StudyPart::augment_subcommands(Deferred::<StudyArgs>::augment_args(command));
        command.args_conflicts_with_subcommands(true).subcommand_negates_reqs(true).subcommand_required(false)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for StudyCommand {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        if matches.subcommand().is_some() {
            let StudyPart::Merge(args) = StudyPart::from_arg_matches(matches)?;
            return Ok(Self::Merge(args));
        }
        StudyArgs::from_arg_matches(matches).map(|args| Self::Points(Box::new(args)))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl StudyCommand {
    /// Whether JSON is asked for.
    pub(super) fn json(&self) -> bool {
        match self {
            Self::Points(args) => args.scene.json,
            Self::Merge(args) => args.json,
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct MergeArgs {
    /// Folder of the study
    #[arg(value_name = "DIR")]
    pub(super) folder: PathBuf,
    /// Print the table as JSON
    #[arg(long)]
    pub(super) json: bool,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
}

#[derive(Debug, Args)]
pub(super) struct StudyArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Values to vary: KEY=FROM:TO:COUNT or KEY=A,B,...; may be repeated, the last one changes fastest. With --lhs or --sobol, the
    /// range KEY=FROM:TO, or a list of which each value has its share
    #[arg(long, value_name = "KEY=VALUES", required_unless_present = "csv")]
    pub(super) vary: Vec<String>,
    /// N points of a Latin hypercube in the ranges: in each range, every N-th part has one point
    #[arg(long, value_name = "N", conflicts_with = "sobol")]
    pub(super) lhs: Option<usize>,
    /// The first N points of a Sobol' sequence in the ranges
    #[arg(long, value_name = "N")]
    pub(super) sobol: Option<usize>,
    /// Other seeds give other points: of --lhs (1 if left out), or another shift of the sequence of --sobol (none if left out)
    #[arg(long, value_name = "S", conflicts_with = "csv")]
    pub(super) seed: Option<u64>,
    /// Points from a table: keys in its first line, below them a line of values for each run
    #[arg(long, value_name = "FILE", conflicts_with_all = ["vary", "lhs", "sobol"])]
    pub(super) csv: Option<PathBuf>,
    /// Do part I of N only, by itself, on whichever machine. When all of its runs have ended, its rows are written as
    /// part-0000I-of-0000N.csv; `odyn study merge` makes the table of all parts
    #[arg(long, value_name = "I/N", conflicts_with = "emit")]
    pub(super) shard: Option<Shard>,
    /// Run nothing, but write a script into the folder that makes a scheduler do the shards: slurm (for sbatch) or hq (HyperQueue)
    #[arg(long, value_name = "SCHEDULER", requires = "shards")]
    pub(super) emit: Option<Scheduler>,
    /// Number of shards of that script
    #[arg(long, value_name = "N", requires = "emit", value_parser = clap::value_parser!(u32).range(1..=MOST_SHARDS as i64))]
    pub(super) shards: Option<u32>,
    /// Runs at the same time; as many as there are processors if left out
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) jobs: Option<u16>,
    /// Folder of the table [default: results/NAME-study for the scene file NAME.toml]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Also keep the results of every run, in folders run-1, run-2, ... there
    #[arg(long)]
    pub(super) results: bool,
    /// Also keep these outputs of every run over time, in one table: names separated by commas, or `*` for all; a row has the number
    /// of the run, the time and the outputs
    #[arg(long, value_name = "OUTPUTS")]
    pub(super) series: Vec<String>,
    /// Of the series, keep the first sample and every N-th from there; all samples if left out
    #[arg(long, value_name = "N", requires = "series", conflicts_with = "samples")]
    pub(super) every: Option<usize>,
    /// Of the series, keep N samples, spread evenly from the first to the last
    #[arg(long, value_name = "N", requires = "series")]
    pub(super) samples: Option<usize>,
    /// Continue a study that was stopped or killed in this folder: runs that were finished, or failed, are not done again
    #[arg(long)]
    pub(super) resume: bool,
    /// With --resume, do runs again that failed
    #[arg(long, requires = "resume")]
    pub(super) retry_failed: bool,
    /// Largest constraint violation and energy error that the audit of a run lets pass, or `none`; as for `odyn run`
    #[arg(long, value_name = "X|none", value_parser = audit_tolerance, allow_negative_numbers = true)]
    pub(super) audit_tol: Option<AuditTolerance>,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
}

/// Programs that share out jobs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Scheduler {
    Slurm,
    Hq,
}
