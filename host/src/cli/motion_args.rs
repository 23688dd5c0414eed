//! What can be written behind `inverse`, `kinematics`, `loads` and `balance`. The texts here are the program's help.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;

use super::scene_args::SceneArgs;

/// Behind the help of `odyn inverse`.
pub(super) const INVERSE: &str = "\
The motion file is CSV: `t [s], crank.angle [deg]`, then a number per column. Positions alone are joined by a spline; columns name' and
name'' give velocities and accelerations. More actuators than freedoms share by least norm, and this is said.

Examples:
  odyn inverse robot.toml --motion path.csv
  odyn inverse robot.toml --motion path.csv --by shoulder.torque,elbow.torque -o results/path
  odyn inverse scenes/benchmarks/A04.toml --motion fold.csv --by P1.angle
  odyn run scene.toml --from results/path

The exit code is 5 where the motion cannot be, or the actuators cannot cause it, with the cause.";

/// Behind the help of `odyn kinematics`.
pub(super) const KINEMATICS: &str = "\
Examples:
  odyn kinematics scenes/verification/cam.toml
  odyn kinematics scenes/compressor.toml --drive main_bearing.angle
  odyn kinematics scenes/compressor.toml --drive \"main_bearing.angle=0 deg:360 deg:361\"

The exit code is 5 where the mechanism cannot follow, or is not determined, with the cause.";

/// Behind the help of `odyn loads`.
pub(super) const LOADS: &str = "\
SCENE is a scene, or the folder of results of its run. Loads are in the frame of the body: reactions of joints, force elements,
weight, inertia. For CalculiX: reference nodes with *RIGID BODY on node sets of yours, *CLOAD, *DLOAD GRAV and CENTRIF.

Examples:
  odyn loads scenes/compressor.toml --body conrod
  odyn loads scenes/compressor.toml --body block --at 150,160.5 --format calculix --units mm
  odyn loads results/compressor --body conrod --format calculix

The exit code is 7 where what is left of all loads is more than round-off.";

/// Behind the help of `odyn balance`.
pub(super) const BALANCE: &str = "\
The counterweight that least squares gives is put into the scene and run again: the outcome is reported beside the prediction.

Examples:
  odyn balance scenes/compressor.toml --turn main_bearing.angle
  odyn balance scenes/compressor.toml --turn main_bearing.angle --turns 1 --harmonics 4 --radius \"12 mm\"";

#[derive(Debug, Args)]
pub(super) struct InverseArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Motion file: CSV whose header names the time and the prescribed quantities with their units, "t [s], crank.angle [deg]". A
    /// name is that of an output or of a joint's coordinate; name' and name'' are its first and second derivative
    #[arg(long, value_name = "FILE")]
    pub(super) motion: PathBuf,
    /// Take these quantities of the motion file only
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) follow: Option<Vec<String>>,
    /// Actuators: inputs of the scene, or quantities along which a force or torque acts [default: all inputs; without any, the
    /// prescribed quantities themselves]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) by: Option<Vec<String>>,
    /// Efforts at this spacing instead of at the rows of the motion file, in the scene's unit of time
    #[arg(long, value_name = "TIME", value_parser = super::scene_args::positive, allow_negative_numbers = true)]
    pub(super) every: Option<f64>,
    /// Folder of the results [default: results/NAME-inverse of the scene file]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
}

#[derive(Debug, Args)]
pub(super) struct KinematicsArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// What drives the mechanism, an output or `joint.channel`: over a range of values (with units, "0 deg:360 deg:361"), or without
    /// one along the whole motion, with its limits and dead points. Left out: the scene's own drivers, over time
    #[arg(long, value_name = "NAME[=FROM:TO:COUNT]")]
    pub(super) drive: Option<String>,
    /// Folder of the results [default: results/NAME-kinematics of the scene file]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
}

/// How loads are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum LoadsFormat {
    /// loads.csv: one row per load
    Csv,
    /// head.inp and a step-N.inp per instant for CalculiX, and loads.csv
    Calculix,
}

/// Units of a finite-element model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum LoadsUnits {
    /// m, N, kg, s
    M,
    /// mm, N, t, s
    Mm,
}

#[derive(Debug, Args)]
pub(super) struct LoadsArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// The body
    #[arg(long, value_name = "NAME")]
    pub(super) body: String,
    /// Times, in the scene's unit or with their own such as "0.2 s", or `peaks`: where a force or moment on the body is largest among the output times
    #[arg(long, value_name = "peaks|TIME,...", default_value = "peaks", allow_hyphen_values = true)]
    pub(super) at: String,
    /// What is written
    #[arg(long, value_enum, default_value = "csv")]
    pub(super) format: LoadsFormat,
    /// Units of the finite-element model
    #[arg(long, value_enum, default_value = "mm")]
    pub(super) units: LoadsUnits,
    /// Element set of the mesh that has the body's mass
    #[arg(long, value_name = "NAME", default_value = "EALL", value_parser = set_name)]
    pub(super) elset: String,
    /// Number of the first reference node: above those of the mesh
    #[arg(long, value_name = "N", default_value_t = 900_001, value_parser = node)]
    pub(super) first_node: usize,
    /// Folder of the results [default: results/NAME-loads of the scene file]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
}

#[derive(Debug, Args)]
pub(super) struct BalanceArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// The joint's angle that turns, `joint.channel`; a counterweight sits on its second body
    #[arg(long, value_name = "NAME")]
    pub(super) turn: String,
    /// Whole turns that are looked at, the last ones of the run
    #[arg(long, value_name = "N", default_value = "2", value_parser = super::scene_args::whole, allow_negative_numbers = true)]
    pub(super) turns: NonZeroUsize,
    /// Harmonics of the turning: those that are reported, and that the counterweight makes least
    #[arg(long, value_name = "N", default_value = "8", value_parser = super::scene_args::whole, allow_negative_numbers = true)]
    pub(super) harmonics: NonZeroUsize,
    /// Radius of the counterweight, such as "20 mm" [default: where its mass is a tenth of that of the
    /// body, or nearer where that would add more than a tenth to the moment of inertia]
    #[arg(long, value_name = "LENGTH")]
    pub(super) radius: Option<String>,
    /// Point of moments, ground axes, in the scene's unit of length
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', num_args = 3, default_values_t = [0.0, 0.0, 0.0], allow_hyphen_values = true)]
    pub(super) about: Vec<f64>,
    /// Folder of the results [default: results/NAME-balance of the scene file]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    pub(super) quiet: bool,
}

/// A name of a set, as CalculiX reads it.
fn set_name(text: &str) -> Result<String, String> {
    let is_usable = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    let begins = text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    if begins && text.len() <= 80 && text.chars().all(is_usable) {
        return Ok(text.to_owned());
    }
    Err("not a name of a set: a letter, then letters, digits, `_`, `-` and `.`, 80 at most".into())
}

/// A number of a node.
fn node(text: &str) -> Result<usize, String> {
    let node = text.parse().ok().filter(|node| (1..=1_000_000_000).contains(node));
    node.ok_or_else(|| "not a number of a node: a whole number from 1 to 1000000000".into())
}
