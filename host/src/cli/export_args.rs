//! What can be written on the command line behind `odyn export`. The texts here are the program's help.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::deferred::Deferred;
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
    Glb(Deferred<GlbArgs>),
    /// As C99 with steps of a fixed size: one struct as memory, no allocation, no state of its own, the same number of operations
    /// in every step
    #[command(after_help = "\
In double the program computes the digits of O-DYN's interpreter. Constraints are met by a fixed number of corrections per step;
where equations switch and where elements sample, steps are divided. What a run decides or iterates on the way (impacts, rows that stick,
friction from reactions, opaque elements) is refused with its name. Parameters of the scene are numbers in the program unless --parameters names them.

Examples:
  odyn export c scenes/compressor.toml -o compressor-c
  make -C compressor-c && compressor-c/compressor > table.csv
  odyn export c scenes/compressor.toml -o compressor-c --method dopri5 --step \"10 us\" --float
  odyn export c scenes/compressor.toml -o compressor-c --tolerance 1e-8
  odyn export c stiff.toml -o stiff-c --method rodas --parameters stiffness,damping")]
    C(Deferred<CArgs>),
    /// As an FMU, of version 2.0 or 3.0 of the Functional Mock-up Interface: sources, and binaries where compilers are there
    #[command(after_help = "\
Co-simulation takes the steps of `odyn export c`; a communication step is divided into equal ones of at most --step, or with --tolerance
into ones whose sizes follow from an estimate of their errors. In model exchange
the coordinates of joints are the states, and an event brings them back to the constraints. Binaries are built by cc (linux64) and
x86_64-w64-mingw32-gcc (win64), each where it is there; the sources are always in the archive. What cannot be exported is refused with
its name, as by `odyn export c`. Parameters of the scene can be set before the initialisation ends, where the equations follow them by
a known law; the others are fixed, and listed with the reasons.

Examples:
  odyn export fmu scenes/compressor.toml -o compressor.fmu
  odyn export fmu scenes/compressor.toml -o compressor.fmu --fmi 2 --cs --outputs theta,omega
  odyn export fmu machine.toml -o machine.fmu --me --inputs torque
  odyn export fmu machine.toml -o machine.fmu --cs --tolerance 1e-6")]
    Fmu(Deferred<FmuArgs>),
}

/// A scene as it is exported.
#[derive(Debug, Args)]
pub(super) struct MachineArgs {
    /// Scene file
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    /// Change a parameter, a setting, or a key of a body or element; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) sets: Vec<String>,
    /// Method of integration: rk4 and dopri5 are explicit, rodas is for stiff scenes [default: rk4; with --tolerance dopri5]
    #[arg(long, value_name = "NAME", value_parser = ["rk4", "dopri5", "rodas"])]
    pub(super) method: Option<String>,
    /// Choose the sizes of steps by an estimate of their errors (dopri5): each is at most this share of the sizes of what moves. The cost of
    /// a step is no longer constant
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    pub(super) tolerance: Option<f64>,
    /// Size of a step, with --tolerance of the longest: in the scene's unit, or with its own such as "10 us" [default: `fixed_step` of the
    /// scene, else a thousandth of its duration]
    #[arg(long, value_name = "TIME", allow_negative_numbers = true)]
    pub(super) step: Option<String>,
    /// Outputs, by the names of `[[output]]`; all if left out
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) outputs: Option<Vec<String>>,
    /// Parameters of the scene that can be set in what is exported, by their names; `all` that can be, or `none` [default: none for C,
    /// all for an FMU]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) parameters: Option<Vec<String>>,
    /// Library of elements, or folder to look for libraries in; may be repeated
    #[arg(long = "plugin", value_name = "PATH")]
    pub(super) plugins: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct CArgs {
    #[command(flatten)]
    pub(super) machine: MachineArgs,
    /// Folder of the files
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,
    /// Numbers of 32 bits
    #[arg(long)]
    pub(super) float: bool,
    /// With a function for exact derivatives of rates and outputs along directions
    #[arg(long)]
    pub(super) derivatives: bool,
    /// Write over a `main.c` that is there with changes
    #[arg(long)]
    pub(super) force: bool,
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

#[derive(Debug, Args)]
pub(super) struct FmuArgs {
    #[command(flatten)]
    pub(super) machine: MachineArgs,
    /// The file
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: PathBuf,
    /// Version of the interface
    #[arg(long, value_name = "2|3", default_value = "3", value_parser = ["2", "3"])]
    pub(super) fmi: String,
    /// Co-simulation [default: both]
    #[arg(long)]
    pub(super) cs: bool,
    /// Model exchange [default: both]
    #[arg(long)]
    pub(super) me: bool,
    /// Inputs, by the names of `[[input]]`; all if left out. The others stay at their values at the start
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) inputs: Option<Vec<String>>,
}
