//! What can be written on the command line behind `odyn export`. The texts here are the program's help.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::scene_args::positive;

#[derive(Debug, Subcommand)]
pub(super) enum ExportCommand {
    /// As glTF 2.0 in one binary file: bodies with their shapes, or with lines to their joints, in motion
    #[command(after_help = "\
The run must have written its motion: `motion = true` in [simulation], or --motion. Nothing else of it is needed. What is above, as
gravity tells, is the y axis of the file.

Examples:
  odyn run scenes/compressor.toml --motion
  odyn export glb results/compressor
  odyn export glb results/compressor -o compressor.glb --speed 0.02")]
    Glb(GlbArgs),
}

#[derive(Debug, Args)]
pub(super) struct GlbArgs {
    /// Folder of the results of the run
    #[arg(value_name = "DIR")]
    pub(super) folder: PathBuf,
    /// The file [default: motion.glb in that folder]
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// How fast the animation goes, 1 = as fast as the motion
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = positive, allow_negative_numbers = true)]
    pub(super) speed: f64,
}
