//! What can be written behind `modes`, `linearise` and `statics`. The texts here are the program's help.

use std::path::PathBuf;

use clap::Args;

use super::scene_args::SceneArgs;

/// A scene and a state of it.
#[derive(Debug, Args)]
pub(super) struct PlaceArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// State to look at: `start`, `equilibrium` (found as `odyn statics` does), or a time of the run: in the scene's unit, or with its own
    /// such as "0.2 s"
    #[arg(long, value_name = "start|equilibrium|TIME", default_value = "start", allow_hyphen_values = true)]
    pub(super) at: String,
    /// Look at the state that a run, or `odyn statics`, left in this folder of results
    #[arg(long, value_name = "DIR")]
    pub(super) from: Option<PathBuf>,
    /// Folder of the results
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
}

#[derive(Debug, Args)]
pub(super) struct ModesArgs {
    #[command(flatten)]
    pub(super) place: PlaceArgs,
    /// Modes at several values of a key, KEY=FROM:TO:COUNT or KEY=A,B,..., followed from one to the next: a Campbell diagram
    #[arg(long, value_name = "KEY=VALUES", conflicts_with = "from")]
    pub(super) over: Option<String>,
    /// Print so many modes, slowest first, and behind them what grows; the files have all of them
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub(super) most: usize,
}

#[derive(Debug, Args)]
pub(super) struct LineariseArgs {
    #[command(flatten)]
    pub(super) place: PlaceArgs,
    /// Inputs, by the names of `[[input]]`; all if left out
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) inputs: Option<Vec<String>>,
    /// Outputs, by the names of `[[output]]`; all if left out
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) outputs: Option<Vec<String>>,
}

#[derive(Debug, Args)]
pub(super) struct StaticsArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Look for further equilibria from so many starts, the scene's own, others beside unstable equilibria along what grows, and others drawn at random among what the joints allow
    #[arg(long, value_name = "STARTS", num_args = 0..=1, default_missing_value = "20")]
    pub(super) all: Option<usize>,
    /// Folder of the results [default: results/NAME-statics of the scene file]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
}
