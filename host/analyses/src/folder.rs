//! The folder of an analysis: `results.csv`, `channels.json` and `summary.json` as `odyn report` and `odyn compare` read them, and where
//! something moves, `motion.bin`.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use odyn_run::results::{
    CHANNELS_FILE, ChannelInfo, MOTION_FILE, MotionHeader, MotionWriter, RESULTS_FILE, SUMMARY_FILE,
};
use serde::Serialize;

use crate::files;
use crate::linear::Port;
use crate::scene::{Dimension, Scene};

/// A table of answers.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Shown {
    /// What it shows.
    pub title: String,
    /// Its columns.
    pub head: Vec<String>,
    /// Its rows.
    pub rows: Vec<Vec<String>>,
}

/// A stretch of the motion that is shown by itself: a mode, an equilibrium.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Part {
    /// What it is.
    pub name: String,
    /// Where it begins.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
}

/// Poses over a time that counts parts.
#[derive(Debug, Clone)]
pub struct Moves {
    /// What is shown.
    pub header: MotionHeader,
    /// Times with seven numbers for each body that moves.
    pub records: Vec<(f64, Vec<f64>)>,
    /// What may be chosen.
    pub parts: Vec<Part>,
}

/// What is reported of an analysis, first to last.
#[derive(Debug, Clone, Default)]
pub struct Page {
    /// The name of the command.
    pub analysis: &'static str,
    /// The answer in a sentence.
    pub words: String,
    /// Whether nothing speaks against it.
    pub good: bool,
    /// What has to be known.
    pub notes: Vec<String>,
    /// The answers.
    pub tables: Vec<Shown>,
    /// What moves.
    pub moves: Option<Moves>,
    /// What rows are over, where that is no time.
    pub over: Option<Port>,
    /// Kinds of the columns, in their order; those of one kind and unit share a plot. Nothing for what is missing.
    pub kinds: Vec<&'static str>,
}

/// What `summary.json` says.
#[derive(Serialize)]
struct Summary<'a> {
    status: &'static str,
    reason: &'static str,
    analysis: &'a str,
    words: &'a str,
    good: bool,
    scene: &'a str,
    title: &'a str,
    over: &'a str,
    time_unit: &'a str,
    rows: usize,
    notes: &'a [String],
    tables: &'a [Shown],
    parts: &'a [Part],
}

#[derive(Serialize)]
struct Channels {
    columns: Vec<ChannelInfo>,
}

/// Writes a table over times in s (over places, in their unit, where the page says so), whose columns are in the units of their ports.
///
/// # Errors
/// What the system says, with the path.
pub fn write(folder: &Path, scene: &Scene, page: &Page, times: &[f64], columns: &[(&Port, &[f64])]) -> io::Result<()> {
    let units = &scene.units;
    let (mut unit, mut factor) = (units.label(Dimension::TIME), units.factor(Dimension::TIME));
    let mut divided = factor;
    if let Some(over) = &page.over {
        (unit, factor, divided) = (over.unit.clone(), over.factor, 1.0);
    }
    let info = |(k, port): (usize, &Port)| ChannelInfo {
        name: port.name.clone(),
        unit: port.unit.clone(),
        quantity: page.kinds.get(k).map(|kind| (*kind).into()).unwrap_or_default(),
        place: String::new(),
        factor: port.factor,
        unique: true,
    };
    // The motion of parts has a time of its own.
    let own: Vec<f64>;
    let mut times = times;
    if let Some(moves) = &page.moves {
        own = moves.records.iter().map(|(time, _)| *time).collect();
        (times, unit, factor, divided) = (&own, String::new(), 1.0, 1.0);
    }
    let mut infos = vec![ChannelInfo::time(&unit, factor)];
    infos.extend(columns.iter().map(|(port, _)| *port).enumerate().map(info));
    let summary = Summary {
        status: "completed",
        reason: "",
        analysis: page.analysis,
        words: &page.words,
        good: page.good,
        scene: &scene.source.name,
        title: &scene.title,
        over: page.over.as_ref().map_or("", |over| &over.name),
        time_unit: &unit,
        rows: times.len(),
        notes: &page.notes,
        tables: &page.tables,
        parts: page.moves.as_ref().map_or(&[], |moves| &moves.parts),
    };
    let json = |value: &dyn Fn() -> serde_json::Result<String>| value().map_err(io::Error::other);
    let text = table(times, divided, columns, &|port| port.name.clone(), "t", "NaN");
    files::write(folder, RESULTS_FILE, text.as_bytes())?;
    let channels = Channels { columns: infos };
    files::write(folder, CHANNELS_FILE, json(&|| serde_json::to_string_pretty(&channels))?.as_bytes())?;
    files::write(folder, SUMMARY_FILE, json(&|| serde_json::to_string_pretty(&summary))?.as_bytes())?;
    let path = folder.join(MOTION_FILE);
    let Some(moves) = &page.moves else {
        // What another analysis left there is not of this one.
        return match std::fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        };
    };
    let failed = |error: odyn_run::results::ResultsError| io::Error::other(error.to_string());
    let mut writer = MotionWriter::create(&path, &moves.header).map_err(failed)?;
    for (time, poses) in &moves.records {
        writer.record(*time, poses).map_err(failed)?;
    }
    writer.flush().map_err(failed)
}

/// The same table with units in its header, as curves of scenes and motion files have them.
#[must_use]
pub fn with_units(scene: &Scene, times: &[f64], columns: &[(&Port, &[f64])]) -> String {
    let units = &scene.units;
    let time = format!("t [{}]", units.label(Dimension::TIME));
    table(times, units.factor(Dimension::TIME), columns, &|port| format!("{} [{}]", port.name, port.unit), &time, "NaN")
}

/// A table over places of another quantity, in its unit, with units in its header. Empty where there is no value.
#[must_use]
pub fn over(drive: &Port, places: &[f64], columns: &[(&Port, &[f64])]) -> String {
    let first = files::cell(&format!("{} [{}]", drive.name, drive.unit));
    table(places, 1.0, columns, &|port| format!("{} [{}]", port.name, port.unit), &first, "")
}

fn table(
    times: &[f64],
    factor: f64,
    columns: &[(&Port, &[f64])],
    named: &dyn Fn(&Port) -> String,
    time: &str,
    missing: &str,
) -> String {
    let mut text = String::from(time);
    columns.iter().for_each(|(port, _)| text.push_str(&format!(",{}", files::cell(&named(port)))));
    text.push('\n');
    for (row, time) in times.iter().enumerate() {
        let _ = write!(text, "{:?}", time / factor);
        columns.iter().for_each(|(_, values)| {
            let _ = match values[row] {
                value if value.is_nan() => write!(text, ",{missing}"),
                value => write!(text, ",{value:?}"),
            };
        });
        text.push('\n');
    }
    text
}
