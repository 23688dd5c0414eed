//! `odyn modes`, `odyn linearise`, `odyn statics`

use std::cell::Cell;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use odyn::analyses::files;
use odyn::analyses::folder::{self, Page};
use odyn::analyses::linear::Port;
use odyn::analyses::modes::{Modes, Share, Stability};
use odyn::analyses::place::{self, At, Placed};
use odyn::analyses::shown::{self, named};
use odyn::analyses::statics::{self, Equilibrium};
use odyn::diagnostics::{Diagnostic, codes, render};
use odyn::results::{ResultsError, significant};
use odyn::scene::Scene;
use odyn::session::{Restart, Session};

use super::analyses_args::{LineariseArgs, ModesArgs, PlaceArgs, StaticsArgs};
use super::campbell::campbell;
use super::exit;
use super::failure::Failure;
use super::scene_args::SceneArgs;
use super::terminal::{self, Progress, Stream, word_of};

/// Bodies or elements that are named behind a mode.
const NAMED: usize = 3;

/// `results/NAME-KIND`.
pub(super) fn folder_of(scene: &SceneArgs, kind: &str) -> PathBuf {
    let mut folder = scene.default_output();
    let name = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    folder.set_file_name(format!("{name}-{kind}"));
    folder
}

pub(super) fn write(folder: &Path, name: &str, content: &[u8]) -> Result<(), Failure> {
    files::write(folder, name, content).map_err(|error| ResultsError::write(folder, error).into())
}

/// What `odyn report` shows of an analysis.
pub(super) fn page(
    folder: &Path,
    scene: &Scene,
    page: &Page,
    times: &[f64],
    columns: &[(&Port, &[f64])],
) -> Result<(), Failure> {
    folder::write(folder, scene, page, times, columns).map_err(|error| ResultsError::write(folder, error).into())
}

pub(super) fn warn(session: &Session, quiet: bool) {
    if !quiet {
        eprint!("{}", render(&session.warnings, &session.scene.source, terminal::color(Stream::Error)));
    }
}

/// The progress of something that may take long, unless nobody wants to see it.
pub(super) fn listener(progress: &Progress, hidden: bool) -> Box<dyn FnMut(f64) + Send> {
    if hidden { Box::new(|_| ()) } else { progress.listener() }
}

/// A scene at the state that is asked for.
fn place(args: &PlaceArgs) -> Result<Placed, Failure> {
    let from = args.from.as_deref().map(Restart::read).transpose();
    let from = from.map_err(|diagnostic| Failure::new(*diagnostic).exit(exit::FILES))?;
    let at = At::read(&args.at).ok_or_else(|| {
        let message = format!("`--at {}` is no state of a scene", args.at);
        let help = "give `start`, `equilibrium` or a time: in the scene's unit, or with its own such as `0.2 s`";
        Failure::new(Diagnostic::error(codes::UNKNOWN_WORD, message).help(help)).exit(exit::USAGE)
    })?;
    let warned = Cell::new(args.quiet);
    let open = || {
        let mut session = Session::open(&args.scene.scene, &args.scene.options(None))?;
        if let Some(state) = &from {
            session.stand_at(state.clone())?;
        }
        warn(&session, warned.replace(true));
        Ok(session)
    };
    let progress = Progress::new();
    let mut listen = listener(&progress, args.quiet || args.scene.json);
    Ok(place::place(&open, at, &mut listen)?)
}

/// `odyn modes`
pub(super) fn modes(args: &ModesArgs) -> Result<u8, Failure> {
    if let Some(over) = &args.over {
        return campbell(args, over);
    }
    let placed = place(&args.place)?;
    let linear = placed.linear(Some(&[]), Some(&[]))?;
    let Placed { session, instant, .. } = placed;
    let modes = Modes::of(&session, &linear)?;
    let folder = args.place.output.clone().unwrap_or_else(|| folder_of(&args.place.scene, "modes"));
    let json = terminal::json(&modes);
    write(&folder, "modes.json", json.as_bytes())?;
    write(&folder, "modes.csv", modes.csv().as_bytes())?;
    page(&folder, &session.scene, &shown::modes(&session, &instant, &modes)?, &[], &[])?;
    terminal::answer(args.place.scene.json, args.place.quiet, &json, || {
        let mut text = String::new();
        tell_modes(&mut text, &modes, args.most);
        let _ = writeln!(text, "results: {} (with modes.json: shapes)", folder.join("modes.csv").display());
        let _ = writeln!(text, "to show them in motion: odyn report {}", word_of(&folder));
        text
    })?;
    Ok(exit::DONE)
}

/// Of a mode in which no body moves.
fn named_states(shares: &[Share]) -> String {
    shares.iter().take(NAMED).map(|one| one.name.as_str()).collect::<Vec<_>>().join(", ")
}

fn tell_modes(text: &mut String, modes: &Modes, most: usize) {
    let _ = writeln!(
        text,
        "{} coordinates, {} states at t = {} s: {}",
        modes.coordinates,
        modes.states,
        significant(modes.time, 6),
        modes.stability.words()
    );
    for note in &modes.notes {
        let _ = writeln!(text, "note: {note}");
    }
    if modes.zeros > 0 {
        let _ = writeln!(text, "{} eigenvalues are zero to within round-off: nothing drives back", modes.zeros);
    }
    for neutral in &modes.neutral {
        let _ = writeln!(text, "  {}: {}", neutral.words(), named(&neutral.bodies));
    }
    if modes.modes.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "{:>5} {:>14} {:>12} {:>14}  kinetic energy; potential energy of elements",
        "mode", "f [Hz]", "damping", "T [s]"
    );
    let shown = modes.foremost(most);
    for mode in &shown {
        let number = |value: f64| significant(value, 7);
        let (frequency, damping, constant) = match mode.time_constant {
            None => (
                number(mode.frequency),
                significant(if mode.decided { mode.damping_ratio } else { 0.0 }, 5),
                String::new(),
            ),
            Some(value) => (String::new(), String::new(), number(value)),
        };
        let grows = if mode.decided && mode.real > 0.0 { "  GROWS" } else { "" };
        let stored = if mode.kinetic.is_empty() { named_states(&mode.states) } else { named(&mode.potential) };
        let stored = if stored.is_empty() { stored } else { format!("; {stored}") };
        let _ = writeln!(
            text,
            "{:>5} {frequency:>14} {damping:>12} {constant:>14}  {}{stored}{grows}",
            mode.number,
            named(&mode.kinetic)
        );
    }
    if modes.modes.len() > shown.len() {
        let _ = writeln!(text, "  and {} more", modes.modes.len() - shown.len());
    }
}

/// `odyn linearise`
pub(super) fn linearise(args: &LineariseArgs) -> Result<u8, Failure> {
    let placed = place(&args.place)?;
    let linear = placed.linear(args.inputs.as_deref(), args.outputs.as_deref())?;
    let session = placed.session;
    let folder = args.place.output.clone().unwrap_or_else(|| folder_of(&args.place.scene, "linear"));
    let plain = linear.plain();
    let json = terminal::json(&plain);
    page(&folder, &session.scene, &shown::linearise(&plain), &[], &[])?;
    write(&folder, "linear.json", json.as_bytes())?;
    let names = |ports: &[Port]| ports.iter().map(|port| format!("{} [{}]", port.name, port.unit)).collect::<Vec<_>>();
    let (inputs, outputs) = (names(&linear.inputs), names(&linear.outputs));
    let rates: Vec<String> = linear.states.iter().map(|state| format!("d/dt {state}")).collect();
    write(&folder, "A.csv", files::csv(&linear.a, &rates, &linear.states).as_bytes())?;
    write(&folder, "B.csv", files::csv(&linear.b, &rates, &inputs).as_bytes())?;
    write(&folder, "C.csv", files::csv(&linear.c, &outputs, &linear.states).as_bytes())?;
    write(&folder, "D.csv", files::csv(&linear.d, &outputs, &inputs).as_bytes())?;
    let matrices = [
        ("A", &linear.a),
        ("B", &linear.b),
        ("C", &linear.c),
        ("D", &linear.d),
        ("positions", &linear.positions),
        ("velocities", &linear.velocities),
    ];
    let archive = files::npz(&matrices).map_err(|error: io::Error| ResultsError::write(&folder, error))?;
    write(&folder, "linear.npz", &archive)?;
    terminal::answer(args.place.scene.json, args.place.quiet, &json, || {
        let mut text = format!(
            "{} states ({} coordinates), {} inputs, {} outputs at t = {} s\n",
            linear.states.len(),
            linear.coordinates,
            inputs.len(),
            outputs.len(),
            significant(linear.time, 6)
        );
        linear.notes.iter().for_each(|note| {
            let _ = writeln!(text, "note: {note}");
        });
        let _ = writeln!(text, "results: {} (with A.csv, ..., linear.json)", folder.join("linear.npz").display());
        text
    })?;
    Ok(exit::DONE)
}

/// `odyn statics`
pub(super) fn statics(args: &StaticsArgs) -> Result<u8, Failure> {
    let session = Session::open(&args.scene.scene, &args.scene.options(None))?;
    warn(&session, args.quiet);
    let progress = Progress::new();
    let mut listen = listener(&progress, args.quiet || args.scene.json);
    let found = match args.all {
        Some(starts) => statics::equilibria(&session, starts, &mut listen)?,
        None => {
            let one = statics::equilibrium(&session, &mut listen)?;
            statics::Equilibria { found: vec![one], failed: Vec::new(), starts: 1 }
        }
    };
    drop(listen);
    drop(progress);
    let folder = args.output.clone().unwrap_or_else(|| folder_of(&args.scene, "statics"));
    let json = terminal::json(&found);
    write(&folder, "statics.json", json.as_bytes())?;
    write(&folder, "equilibria.csv", outputs(&found.found).as_bytes())?;
    page(&folder, &session.scene, &shown::statics(&session, &found)?, &[], &[])?;
    if let Some(first) = found.found.first() {
        first.restart(&session).write(&folder)?;
    }
    terminal::answer(args.scene.json, args.quiet, &json, || {
        let mut text = String::new();
        for (number, one) in found.found.iter().enumerate() {
            if found.found.len() > 1 || args.all.is_some() {
                let _ = writeln!(text, "equilibrium {} (from start {}):", number + 1, one.start);
            }
            tell_equilibrium(&mut text, one);
        }
        if args.all.is_some() {
            let _ = writeln!(
                text,
                "{} starts, {} equilibria, {} led nowhere",
                found.starts,
                found.found.len(),
                found.failed.len()
            );
            found.failed.iter().take(NAMED).for_each(|reason| {
                let _ = writeln!(text, "  {reason}");
            });
        }
        let _ = writeln!(text, "results: {} (with equilibria.csv, state.toml)", folder.join("statics.json").display());
        let _ = writeln!(text, "to show it: odyn report {}", word_of(&folder));
        let _ =
            writeln!(text, "to run from there: odyn run {} --from {}", word_of(&args.scene.scene), word_of(&folder));
        text
    })?;
    Ok(exit::DONE)
}

/// One row per equilibrium.
fn outputs(found: &[Equilibrium]) -> String {
    let mut text = String::from("t [s]");
    let names = found.first().map_or(&[][..], |one| &one.outputs);
    names.iter().for_each(|port| {
        let _ = write!(text, ",{} [{}]", port.name, port.unit);
    });
    text.push('\n');
    for one in found {
        let _ = write!(text, "{:?}", one.time);
        one.outputs.iter().for_each(|port| {
            let _ = write!(text, ",{:?}", port.value);
        });
        text.push('\n');
    }
    text
}

fn tell_equilibrium(text: &mut String, one: &Equilibrium) {
    let _ = writeln!(text, "equilibrium after {} steps: {}", one.steps, one.stability.words());
    if one.stability == Stability::Unstable {
        let _ = writeln!(text, "note: a run that begins here leaves it; `--all` looks for others");
    }
    let audit = &one.audit;
    let _ = writeln!(
        text,
        "audit: balance {:.1} of round-off's share (1e-11 of the loads, 1e-13 of the size){}, joints {:.1e}",
        audit.balance,
        if audit.body.is_empty() { String::new() } else { format!(" at {}", audit.body) },
        audit.rows
    );
    if !one.closed.is_empty() {
        let _ = writeln!(text, "closed contacts: {}", one.closed.join(", "));
    }
    for port in &one.outputs {
        let _ = writeln!(text, "  {} = {} {}", port.name, significant(port.value, 10), port.unit);
    }
    tell_modes(text, &one.modes, NAMED);
}
