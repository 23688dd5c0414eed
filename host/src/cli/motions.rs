//! `odyn inverse`, `odyn kinematics`

use std::fmt::Write as _;

use odyn::analyses::folder;
use odyn::analyses::inverse::{self, Inverse};
use odyn::analyses::kinematics::{self, Drive, Kinematics};
use odyn::analyses::linear::Port;
use odyn::analyses::prescribed::Motion;
use odyn::analyses::shown;
use odyn::diagnostics::counted;
use odyn::results::significant;
use odyn::scene::Dimension;
use odyn::session::Session;

use super::analyses::{folder_of, listener, page, warn, write};
use super::exit;
use super::failure::Failure;
use super::motion_args::{InverseArgs, KinematicsArgs};
use super::terminal::{self, Progress, word_of};

/// `odyn inverse`
pub(super) fn inverse(args: &InverseArgs) -> Result<u8, Failure> {
    let session = Session::open(&args.scene.scene, &args.scene.options(None))?;
    warn(&session, args.quiet);
    let motion = Motion::read(&session, &args.motion, args.follow.as_deref())?;
    let progress = Progress::new();
    let mut listen = listener(&progress, args.quiet || args.scene.json);
    let times = args.every.map(|every| motion.spaced(session.scene.units.to_si(every, Dimension::TIME)));
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
    page(&folder, &session.scene, &shown::inverse(&found), &found.times, &all)?;
    write(&folder, "efforts.csv", folder::with_units(&session.scene, &found.times, &efforts).as_bytes())?;
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
        let _ = writeln!(text, "to show it: odyn report {}", word_of(&folder));
        text
    })?;
    Ok(exit::DONE)
}

fn told(found: &Inverse) -> String {
    let mut text = format!(
        "{} at {} for {}; loads balance to {:.1e}\n",
        counted(found.actuators.len(), "effort"),
        counted(found.times.len(), "time"),
        counted(found.freedoms, "freedom"),
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
        Some(text) => Drive::read(&session, text)?,
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
    let over_time = matches!(drive, Drive::Time);
    let (shown, places) = shown::kinematics(&found);
    let mut curves = columns.clone();
    if shown.over.as_ref().is_some_and(|over| over.name != found.over.name) {
        curves.insert(0, (&found.over, &found.places));
    }
    page(&folder, &session.scene, &shown, &places, &curves)?;
    if !over_time {
        write(&folder, "kinematics.csv", folder::over(&found.over, &found.places, &columns).as_bytes())?;
    }
    terminal::answer(args.scene.json, args.quiet, &json, || {
        let mut text = told_kinematics(&found);
        let name = if over_time { "results.csv" } else { "kinematics.csv" };
        let _ = writeln!(text, "results: {} (with kinematics.json)", folder.join(name).display());
        let _ = writeln!(text, "to show it: odyn report {}", word_of(&folder));
        text
    })?;
    Ok(exit::DONE)
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
