//! `odyn loads`

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use odyn::analyses::loads::{Consistent, Loads, loads as loads_of};
use odyn::analyses::place::At;
use odyn::analyses::shown;
use odyn::diagnostics::{Diagnostic, codes, counted};
use odyn::results::{SUMMARY_FILE, checksum_of_file, significant};
use odyn::scene::Override;
use odyn::session::{RunOptions, Session};

use super::analyses::{folder_of, listener, page, warn, write};
use super::exit;
use super::failure::Failure;
use super::motion_args::{LoadsArgs, LoadsFormat, LoadsUnits};
use super::terminal::{self, Progress};

/// What is left of all loads, as a share of their sizes, that is round-off.
const ROUND_OFF: f64 = 1e-9;

/// The scene with its options: as named, or as the summary of a folder of results has it, with a note where that is not the
/// scene of the run any more.
fn scene(args: &LoadsArgs) -> Result<(PathBuf, RunOptions, Option<String>), Failure> {
    let mut options = args.scene.options(None);
    let named = &args.scene.scene;
    if !named.is_dir() {
        return Ok((named.clone(), options, None));
    }
    let path = named.join(SUMMARY_FILE);
    let wrong = |reason: String| {
        let message = format!("{} is no folder of results: {reason}", named.display());
        let help = "name a scene, or the folder that `odyn run` left";
        Failure::new(Diagnostic::error(codes::CANNOT_READ_RESULTS, message).help(help)).exit(exit::FILES)
    };
    let text = std::fs::read_to_string(&path).map_err(|error| wrong(error.to_string()))?;
    let summary: serde_json::Value = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
    let scene = summary.get("scene").and_then(serde_json::Value::as_str);
    let scene = scene.ok_or_else(|| wrong(format!("{SUMMARY_FILE} names no scene")))?;
    let sets = summary.get("overrides").and_then(serde_json::Value::as_array).into_iter().flatten();
    let mut overrides: Vec<Override> = sets.filter_map(|one| one.as_str()).map(Override::new).collect();
    overrides.append(&mut options.overrides);
    options.overrides = overrides;
    let scene = PathBuf::from(scene);
    let noted = summary.get("scene_sha256").and_then(serde_json::Value::as_str);
    let is = checksum_of_file(&scene).ok();
    let changed = noted.zip(is).filter(|(was, is)| was != is).map(|_| {
        let (scene, results) = (scene.display(), named.display());
        format!("{scene} was changed since the run in {results}: these are the loads of the scene as it is now")
    });
    Ok((scene, options, changed))
}

/// The times that were asked for; `None`: those of the outputs, for peaks.
fn times(args: &LoadsArgs) -> Result<Option<Vec<At>>, Failure> {
    if args.at.trim() == "peaks" {
        return Ok(None);
    }
    let is_time = |at: &At| matches!(at, At::Time(time) | At::Seconds(time) if time.is_finite());
    let times = args.at.split(',').map(|text| At::read(text).filter(is_time)).collect::<Option<_>>();
    times.map(Some).ok_or_else(|| {
        let message = format!("`--at {}` is neither `peaks` nor times", args.at);
        let help = "give times, separated by commas: in the scene's unit, or with their own such as \"0.2 s\"";
        Failure::new(Diagnostic::error(codes::UNKNOWN_WORD, message).help(help)).exit(exit::USAGE)
    })
}

/// `odyn loads`
pub(super) fn loads(args: &LoadsArgs) -> Result<u8, Failure> {
    let asked = times(args)?;
    let (path, options, changed) = scene(args)?;
    let session = Session::open(&path, &options)?;
    warn(&session, args.quiet);
    let progress = Progress::new();
    let mut listen = listener(&progress, args.quiet || args.scene.json);
    let scene = session.scene.clone();
    let asked: Option<Vec<f64>> = asked.map(|all| all.into_iter().filter_map(|at| at.time(&scene.units)).collect());
    let mut found = loads_of(session, &args.body, asked.as_deref(), &mut listen, &AtomicBool::new(false))?;
    found.notes.splice(0..0, changed);
    drop(listen);
    drop(progress);
    let folder = args.output.clone().unwrap_or_else(|| folder_of(&args.scene, "loads"));
    let units = if args.units == LoadsUnits::M { Consistent::Metres } else { Consistent::Millimetres };
    let json = terminal::json(&found);
    write(&folder, "loads.json", json.as_bytes())?;
    page(&folder, &scene, &shown::loads(&found), &[], &[])?;
    write(&folder, "loads.csv", found.csv(units).as_bytes())?;
    if args.format == LoadsFormat::Calculix {
        let (head, steps) = found.calculix(units, &args.elset, args.first_node);
        write(&folder, "head.inp", head.as_bytes())?;
        for (k, step) in steps.iter().enumerate() {
            write(&folder, &step_file(k), step.as_bytes())?;
        }
        // Steps of an earlier call with more instants would be read as steps of this one.
        (steps.len()..)
            .map(|k| folder.join(step_file(k)))
            .take_while(|old| std::fs::remove_file(old).is_ok())
            .for_each(drop);
    }
    let worst = found.left();
    terminal::answer(args.scene.json, args.quiet, &json, || {
        let mut text = told(&found, worst);
        let name =
            if args.format == LoadsFormat::Calculix { "head.inp, step-1.inp, ..., loads.csv" } else { "loads.csv" };
        let _ = writeln!(text, "results: {} ({name}, loads.json)", folder.display());
        text
    })?;
    Ok(if worst <= ROUND_OFF { exit::DONE } else { exit::AUDIT })
}

/// The file of the loads at an instant, counted from 0.
fn step_file(instant: usize) -> String {
    format!("step-{}.inp", instant + 1)
}

fn told(found: &Loads, worst: f64) -> String {
    let size = |of: &[f64; 3]| of.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut text = format!("loads on {} at {}", found.body, counted(found.cases.len(), "time"));
    let _ = match worst {
        worst if worst <= ROUND_OFF => writeln!(text, "; in balance to {worst:.1e} of their sizes"),
        _ => writeln!(text, "; NOT in balance: {worst:.1e} of their sizes is left"),
    };
    for note in &found.notes {
        let _ = writeln!(text, "note: {note}");
    }
    for case in &found.cases {
        let _ = writeln!(text, "t = {} s: {}", significant(case.time, 9), case.why);
        let mut row = |name: &str, force: &[f64; 3], moment: &[f64; 3]| {
            let [force, moment] = [force, moment].map(|of| significant(size(of), 6));
            let _ = writeln!(text, "  {name:<24} {force:>14} N {moment:>14} N m");
        };
        for (attachment, wrench) in found.attachments.iter().zip(&case.wrenches) {
            row(&attachment.element, &wrench.force, &wrench.moment);
        }
        row("weight", &case.weight, &[0.0; 3]);
        row("inertia", &case.inertia.force, &case.inertia.moment);
    }
    text
}
