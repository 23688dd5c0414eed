//! `odyn import`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use odyn::diagnostics::{Diagnostic, codes, counted, shown};
use odyn::import::{self, Base, Imported, Options};
use odyn::results::replace;
use odyn::scene::{number_and_unit, parse_unit};

use super::exit;
use super::failure::Failure;
use super::scene_args::positive;
use super::terminal;

/// Behind `odyn help import`.
pub(super) const HELP: &str = "\
URDF and MJCF are read. Links become bodies with their shapes, joints become joints, with springs, dampers, rotors, dry friction and
stops beside them; MJCF's `connect` and `weld` close loops. What the file says beside that (contacts, motors, sensors, ...) is listed,
here and at the top of the scene, first what is probably misspelt. Mass is taken from shapes where it is not given. The scene needs the standard libraries.

Examples:
  odyn import arm.urdf -o arm.toml
  odyn import arm.urdf --pose shoulder=0.4 --pose elbow=-30deg -o arm.toml
  odyn import walker.urdf --base free --density 2700 -o walker.toml
  odyn import hand.xml --no-limits > hand.toml

The exit code is 8 where the file cannot be read as one of the two; nothing is written then.";

#[derive(Debug, Args)]
pub(super) struct ImportArgs {
    /// URDF or MJCF file
    pub(super) file: PathBuf,
    /// Scene to write; standard output if left out
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write over a file that is there
    #[arg(long)]
    force: bool,
    /// Whether the first link of a URDF stands on the ground
    #[arg(long, value_enum, default_value = "fixed")]
    base: BaseArg,
    /// Density of links without mass, kg/m^3
    #[arg(long, value_name = "X", default_value_t = 1000.0, value_parser = positive, allow_negative_numbers = true)]
    density: f64,
    /// Coordinate of a joint at the start, such as 0.4 (rad, m), 30deg or 5cm; may be repeated
    #[arg(long, value_name = "JOINT=VALUE", value_parser = coordinate, allow_hyphen_values = true)]
    pose: Vec<(String, f64)>,
    /// Its rate, rad/s or m/s; may be repeated
    #[arg(long, value_name = "JOINT=VALUE", value_parser = coordinate, allow_hyphen_values = true)]
    speed: Vec<(String, f64)>,
    /// Leave out the stops at limits of joints
    #[arg(long)]
    no_limits: bool,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum BaseArg {
    /// It is part of the ground
    Fixed,
    /// It moves freely
    Free,
}

/// `JOINT=VALUE`, the value with a unit or without.
fn coordinate(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected JOINT=VALUE")?;
    let (number, unit) = number_and_unit(value).ok_or_else(|| format!("`{value}` is not a number with a unit"))?;
    let factor = if unit.is_empty() { 1.0 } else { parse_unit(unit).map_err(|error| error.message)?.1 };
    let product = number * factor;
    if product.is_finite() { Ok((name.to_owned(), product)) } else { Err(format!("`{value}` is not finite")) }
}

/// Writes a file of another program as a scene.
pub(super) fn import(args: &ImportArgs) -> Result<u8, Failure> {
    let options = Options {
        base: match args.base {
            BaseArg::Fixed => Base::Fixed,
            BaseArg::Free => Base::Free,
        },
        density: args.density,
        pose: BTreeMap::from_iter(args.pose.iter().cloned()),
        speeds: BTreeMap::from_iter(args.speed.iter().cloned()),
        limits: !args.no_limits,
    };
    let folder = args.output.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
    let imported = import::read(&args.file, folder, &options)
        .map_err(|refused| Failure::of_source(exit::FILES, refused.diagnostics, &refused.source))?;
    match &args.output {
        None => terminal::print(&imported.scene)?,
        Some(file) if file.exists() && !args.force => {
            let message = format!("{} is there already", shown(&file.display().to_string()));
            let help = "it may have changes of yours: write elsewhere, or over it with --force";
            return Err(Failure::new(Diagnostic::error(codes::CANNOT_WRITE, message).help(help)).exit(exit::FILES));
        }
        Some(file) => replace(file, imported.scene.as_bytes(), false)?,
    }
    eprint!("{}", report(&imported, args.output.as_deref()));
    Ok(exit::DONE)
}

/// What was made, and what was not.
fn report(imported: &Imported, file: Option<&Path>) -> String {
    let bodies = if imported.bodies == 1 { "1 body".to_owned() } else { format!("{} bodies", imported.bodies) };
    let coordinates = counted(imported.joints.len(), "joint");
    let file = file.map_or(String::new(), |file| format!("{}: ", shown(&file.display().to_string())));
    let mut text = format!("{file}{bodies}, {coordinates} with a coordinate\n");
    if !imported.left_out.is_empty() {
        text.push_str("not carried over, or decided on the way:\n");
        text.extend(imported.left_out.iter().map(|what| format!("  - {}\n", shown(what))));
    }
    text
}
