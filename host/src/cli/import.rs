//! `odyn import`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use odyn::diagnostics::{Diagnostic, codes, counted, shown};
use odyn::import::{self, Base, Imported, Measure, Options};
use odyn::results::replace;
use odyn::scene::{Dimension, number_and_unit, parse_unit};

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
    pose: Vec<Given>,
    /// Its rate, such as 2 (rad/s, m/s), 30deg/s or 5cm/s; may be repeated
    #[arg(long, value_name = "JOINT=VALUE", value_parser = rate, allow_hyphen_values = true)]
    speed: Vec<Given>,
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

/// A coordinate of a joint, or its rate, SI; with what it measures, if it has a unit.
#[derive(Debug, Clone)]
struct Given {
    joint: String,
    value: f64,
    measure: Option<Measure>,
}

impl Given {
    /// `JOINT=VALUE`, the value without a unit, or with one of two dimensions: of what turns, and of what slides.
    fn read(text: &str, [turns, slides]: [Dimension; 2], such_as: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or("expected JOINT=VALUE")?;
        let (number, unit) = number_and_unit(value).ok_or_else(|| format!("`{value}` is not a number with a unit"))?;
        let (measure, factor) = match unit {
            "" => (None, 1.0),
            unit => match parse_unit(unit).map_err(|error| error.message)? {
                (dimension, factor) if dimension == turns => (Some(Measure::Angle), factor),
                (dimension, factor) if dimension == slides => (Some(Measure::Length), factor),
                (dimension, _) => {
                    return Err(format!("`{unit}` is the unit of {dimension}; expected such as {such_as}"));
                }
            },
        };
        let product = number * factor;
        if !product.is_finite() {
            return Err(format!("`{value}` is not finite"));
        }
        Ok(Self { joint: name.to_owned(), value: product, measure })
    }
}

fn coordinate(text: &str) -> Result<Given, String> {
    Given::read(text, [Dimension::ANGLE, Dimension::LENGTH], "deg, rad, cm, m")
}

fn rate(text: &str) -> Result<Given, String> {
    Given::read(text, [Dimension::ANGULAR_VELOCITY, Dimension::VELOCITY], "deg/s, rad/s, cm/s, m/s")
}

/// Writes a file of another program as a scene.
pub(super) fn import(args: &ImportArgs) -> Result<u8, Failure> {
    let values = |given: &[Given]| given.iter().map(|one| (one.joint.clone(), one.value)).collect::<BTreeMap<_, _>>();
    let with_unit = args.pose.iter().chain(&args.speed).filter_map(|one| Some((one.joint.clone(), one.measure?)));
    let options = Options {
        base: match args.base {
            BaseArg::Fixed => Base::Fixed,
            BaseArg::Free => Base::Free,
        },
        density: args.density,
        pose: values(&args.pose),
        speeds: values(&args.speed),
        measures: with_unit.collect(),
        limits: !args.no_limits,
    };
    let folder = args.output.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
    let imported = import::read(&args.file, folder, &options)
        .map_err(|refused| Failure::of_source(exit::FILES, refused.diagnostics, &refused.source))?;
    match &args.output {
        Some(file) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
            let [file, folder] = [file.as_path(), folder].map(|path| shown(&path.display().to_string()).into_owned());
            let message = format!("cannot write `{file}`: there is no folder `{folder}`");
            let help = "make the folder, or write elsewhere with `-o FILE`";
            return Err(Failure::new(Diagnostic::error(codes::CANNOT_WRITE, message).help(help)));
        }
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
