//! `odyn inverse`, `odyn kinematics`

use std::fmt::Write as _;

use odyn::analyses::folder;
use odyn::analyses::inverse::{self, Inverse};
use odyn::analyses::kinematics::{self, Drive, Kinematics};
use odyn::analyses::linear::Port;
use odyn::analyses::prescribed::{self, Motion};
use odyn::diagnostics::{Diagnostic, codes};
use odyn::results::{ResultsError, significant};
use odyn::scene::Dimension;
use odyn::session::Session;

use super::analyses::{folder as folder_of, listener, warn, write};
use super::exit;
use super::failure::Failure;
use super::motion_args::{InverseArgs, KinematicsArgs};
use super::terminal::{self, Progress};

/// `odyn inverse`
pub(super) fn inverse(args: &InverseArgs) -> Result<u8, Failure> {
    let session = Session::open(&args.scene.scene, &args.scene.options(None))?;
    warn(&session, args.quiet);
    let motion = Motion::read(&session, &args.motion, args.follow.as_deref())?;
    let progress = Progress::new();
    let mut listen = listener(&progress, args.quiet || args.scene.json);
    let times = args.every.map(|every| spaced(&motion, session.scene.units.to_si(every, Dimension::TIME)));
    let found = inverse::inverse(&session, &motion, args.by.as_deref(), times.as_deref(), &mut listen)?;
    drop(listen);
    drop(progress);
    let folder = args.output.clone().unwrap_or_else(|| folder_of(&args.scene, "inverse"));
    let efforts: Vec<(&Port, &[f64])> =
        found.actuators.iter().zip(&found.efforts).map(|(port, values)| (port, values.as_slice())).collect();
    let mut all = efforts.clone();
    let names: Vec<&str> = found.actuators.iter().map(|port| port.name.as_str()).collect();
    all.extend(
        (found.outputs.iter().zip(&found.values))
            .filter(|(port, _)| !names.contains(&port.name.as_str()))
            .map(|(port, values)| (port, values.as_slice())),
    );
    folder::write(&folder, &session, "inverse", &found.times, &all, &found.notes)
        .map_err(|error| ResultsError::write(&folder, error))?;
    write(&folder, "efforts.csv", folder::with_units(&session, &found.times, &efforts).as_bytes())?;
    let json = terminal::json(&found);
    write(&folder, "inverse.json", json.as_bytes())?;
    found.start.write(&folder)?;
    terminal::answer(args.scene.json, args.quiet, &json, || {
        let mut text = told(&found);
        let _ = writeln!(
            text,
            "results: {} (with efforts.csv for curves of scenes, state.toml)",
            folder.join("results.csv").display()
        );
        let _ = writeln!(text, "to show it: odyn report {}", folder.display());
        text
    })?;
    Ok(exit::DONE)
}

/// From the first to the last row, both included.
fn spaced(motion: &Motion, every: f64) -> Vec<f64> {
    let (first, last) = (motion.times[0], motion.times[motion.times.len() - 1]);
    let count = ((last - first) / every * (1.0 + 1e-12)).floor() as usize;
    let mut times: Vec<f64> = (0..=count).map(|k| (first + k as f64 * every).min(last)).collect();
    if last - times[times.len() - 1] > 1e-9 * every {
        times.push(last);
    }
    times
}

fn told(found: &Inverse) -> String {
    let mut text = format!(
        "{} at {} for {}; loads balance to {:.1e}\n",
        terminal::counted(found.actuators.len(), "effort"),
        terminal::counted(found.times.len(), "time"),
        terminal::counted(found.freedoms, "freedom"),
        found.balance
    );
    for note in &found.notes {
        let _ = writeln!(text, "note: {note}");
    }
    for (port, values) in found.actuators.iter().zip(&found.efforts) {
        let (least, most) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        let square = values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64;
        let _ = writeln!(
            text,
            "  {}: {} to {} {}, root mean square {}",
            port.name,
            significant(least, 7),
            significant(most, 7),
            port.unit,
            significant(square.sqrt(), 7)
        );
    }
    text
}

/// `odyn kinematics`
pub(super) fn kinematics(args: &KinematicsArgs) -> Result<u8, Failure> {
    let session = Session::open(&args.scene.scene, &args.scene.options(None))?;
    warn(&session, args.quiet);
    let drive = match &args.drive {
        None => Drive::Time,
        Some(text) => drive(&session, text)?,
    };
    let progress = Progress::new();
    let mut listen = listener(&progress, args.quiet || args.scene.json);
    let found = kinematics::kinematics(&session, &drive, &mut listen)?;
    drop(listen);
    drop(progress);
    let folder = args.output.clone().unwrap_or_else(|| folder_of(&args.scene, "kinematics"));
    let json = terminal::json(&found);
    write(&folder, "kinematics.json", json.as_bytes())?;
    let columns: Vec<(&Port, &[f64])> =
        found.columns.iter().zip(&found.values).map(|(port, values)| (port, values.as_slice())).collect();
    let si: Vec<f64> = found.places.iter().map(|place| place * found.over.factor).collect();
    if matches!(drive, Drive::Time) {
        folder::write(&folder, &session, "kinematics", &si, &columns, &found.notes)
            .map_err(|error| ResultsError::write(&folder, error))?;
    } else {
        write(&folder, "kinematics.csv", folder::over(&found.over, &found.places, &columns).as_bytes())?;
    }
    terminal::answer(args.scene.json, args.quiet, &json, || {
        let mut text = told_kinematics(&found);
        let name = if matches!(drive, Drive::Time) { "results.csv" } else { "kinematics.csv" };
        let _ = writeln!(text, "results: {} (with kinematics.json)", folder.join(name).display());
        text
    })?;
    Ok(exit::DONE)
}

/// `NAME`, or `NAME=FROM:TO:COUNT`.
fn drive(session: &Session, text: &str) -> Result<Drive, Failure> {
    let (name, range) = match text.split_once('=') {
        Some((name, range)) => (name.trim(), Some(range)),
        None => (text.trim(), None),
    };
    let wanted = prescribed::quantity(session, name)?;
    let Some(range) = range else { return Ok(Drive::Whole(wanted)) };
    let parts: Vec<&str> = range.split(':').collect();
    let value = |text: &str| prescribed::amount(text, wanted.dimension, wanted.factor);
    if let [from, to, count] = parts[..]
        && let (Some(from), Some(to)) = (value(from), value(to))
        && let Ok(count) = count.trim().parse::<usize>()
        && (2..=1_000_000).contains(&count)
        && from != to
    {
        return Ok(Drive::Over(wanted, [from, to], count));
    }
    let message = format!("`--drive {text}` is no range of `{name}`");
    let help = "write NAME=FROM:TO:COUNT, such as \"crank.angle=0 deg:360 deg:361\", with two places or more";
    Err(Failure::new(Diagnostic::error(codes::UNKNOWN_WORD, message).help(help)).exit(exit::USAGE))
}

fn told_kinematics(found: &Kinematics) -> String {
    let over = &found.over;
    let number = |value: f64| significant(value, 9);
    let mut text = format!("{} places over {} [{}]\n", found.places.len(), over.name, over.unit);
    for note in &found.notes {
        let _ = writeln!(text, "note: {note}");
    }
    for one in &found.extents {
        let _ = writeln!(
            text,
            "  {}: {} to {} {} (at {} = {} and {})",
            one.name,
            number(one.values[0]),
            number(one.values[1]),
            one.unit,
            over.name,
            number(one.at[0]),
            number(one.at[1])
        );
    }
    if !found.dead_points.is_empty() {
        text += "dead points, where a quantity turns back and would not drive the mechanism:\n";
    }
    for dead in &found.dead_points {
        let of = |name: &str| {
            let k = found.extents.iter().position(|one| one.name == name)?;
            Some(format!("{} = {} {}", name, number(dead.values[k]), found.extents[k].unit))
        };
        let at = of(&over.name).filter(|_| dead.of != over.name).map_or_else(String::new, |at| format!(" at {at}"));
        let _ = writeln!(text, "  {}{at}", of(&dead.of).unwrap_or_default());
    }
    text
}
