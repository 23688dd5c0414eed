//! What can be written behind `sensitivity` and `fit`. The texts here are the program's help.

use std::path::PathBuf;

use clap::Args;

use super::scene_args::{SceneArgs, positive};

pub(super) const SENSITIVITY_HELP: &str = "\
Whatever `--set` can set: parameters, masses, lengths, initial states, parameters of elements. The scene is prepared and run anew at
values around each number; all these runs take the same steps, so that their differences keep 8 to 12 digits, and how many is
reported. Where contacts close and equations switch, each run ends its steps at its own events; samples that an event passes
between the runs have no derivative. Written as sensitivity.json and sensitivity.csv (over time).

Examples:
  odyn sensitivity scenes/compressor.toml --to crank.radius,rod.length
  odyn sensitivity pendulum.toml --of angle --to rod.mass,rod.position.x --formulation cartesian
  odyn sensitivity ball.toml --of height --to floor.params.restitution --json

The exit code is 7 where a derivative has fewer than two certain digits.";

pub(super) const FIT_HELP: &str = "\
Least squares by Levenberg's and Marquardt's method within bounds. Samples are taken at the measured times. Combinations of numbers
that the measurements do not determine are named. Written as fit.json and fit.csv (measured, fitted, what is left).

Examples:
  odyn fit pendulum.toml measured.csv --vary rod.length=0.3m:0.5m,pivot.params.damping=0:
  odyn fit car.toml drive.csv --vary k=10:100 --columns \"accel=a_body\" --noise accel=0.02
  odyn fit scenes/compressor.toml --vary friction=0.001:0.1 --figure \"mean speed=0.3142:0.001\"
  odyn fit car.toml drive.csv --vary k=10:100 --write car-fitted.toml

The exit code is 7 where measurements leave something open, or the minimum was not reached.";

#[derive(Debug, Args)]
pub(super) struct SensitivityArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Outputs and figures of the scene; all if left out
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) of: Vec<String>,
    /// Numbers of the scene, by their keys as for --set; an entry of a list is `rotor.velocity.x` or `rotor.inertia.2`
    #[arg(long, value_name = "KEY,...", value_delimiter = ',', required = true)]
    pub(super) to: Vec<String>,
    /// Step of the differences, as a share of each number; found if left out
    #[arg(long, value_name = "X", value_parser = positive, allow_negative_numbers = true)]
    pub(super) step: Option<f64>,
    /// Runs at the same time; as many as there are processors if left out
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) jobs: Option<u16>,
    /// Folder of the results [default: results/NAME-sensitivity of the scene file]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
}

#[derive(Debug, Args)]
pub(super) struct FitArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Table of what was measured: a column `t`, and one for each output, its unit in brackets if it is another than that of the scene's
    /// times or of the output: `t [ms]`, `x [cm]`
    pub(super) measured: Option<PathBuf>,
    /// Numbers to vary, by their keys as for --set, with bounds: KEY=MIN:MAX; may be repeated. A bound may be left out
    #[arg(long, value_name = "KEY=MIN:MAX,...", value_delimiter = ',', required = true)]
    pub(super) vary: Vec<String>,
    /// Columns to use, with their outputs; all columns, by their own names, if left out
    #[arg(long, value_name = "MEASURED=OUTPUT,...", value_delimiter = ',')]
    pub(super) columns: Vec<String>,
    /// Standard deviation of the noise of columns, in the unit of their outputs; estimated if left out
    #[arg(long, value_name = "COLUMN=VALUE,...", value_delimiter = ',')]
    pub(super) noise: Vec<String>,
    /// A figure of the scene with its measured value, and the standard deviation of that; may be repeated
    #[arg(long = "figure", value_name = "NAME=VALUE[:NOISE]")]
    pub(super) figures: Vec<String>,
    /// Iterations at most
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) iterations: Option<u16>,
    /// Runs at the same time; as many as there are processors if left out
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) jobs: Option<u16>,
    /// Write the fitted scene to this file; it belongs into the folder of the scene where that names other files
    #[arg(long, value_name = "FILE")]
    pub(super) write: Option<PathBuf>,
    /// Folder of the results [default: results/NAME-fit of the scene file]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
}
