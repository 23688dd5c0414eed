//! The folder of an analysis that gives quantities over time: `results.csv`, `channels.json` and `summary.json`, as `odyn report` and
//! `odyn compare` read them.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use odyn_run::results::{CHANNELS_FILE, ChannelInfo, RESULTS_FILE, SUMMARY_FILE};
use serde::Serialize;

use crate::files;
use crate::linear::Port;
use crate::scene::Dimension;
use crate::session::Session;

/// What `summary.json` says.
#[derive(Serialize)]
struct Summary<'a> {
    status: &'static str,
    reason: &'static str,
    analysis: &'a str,
    scene: &'a str,
    title: &'a str,
    time_unit: String,
    rows: usize,
    notes: &'a [String],
}

#[derive(Serialize)]
struct Channels {
    columns: Vec<ChannelInfo>,
}

/// Writes a table over times in s, whose columns are in the units of their ports; `analysis` is the name of the command.
///
/// # Errors
/// What the system says, with the path.
pub fn write(
    folder: &Path,
    session: &Session,
    analysis: &str,
    times: &[f64],
    columns: &[(&Port, &[f64])],
    notes: &[String],
) -> io::Result<()> {
    let units = &session.scene.units;
    let (unit, factor) = (units.label(Dimension::TIME), units.factor(Dimension::TIME));
    let info = |port: &Port| ChannelInfo {
        name: port.name.clone(),
        unit: port.unit.clone(),
        quantity: String::new(),
        place: String::new(),
        factor: port.factor,
        unique: true,
    };
    let mut infos = vec![ChannelInfo::time(&unit, factor)];
    infos.extend(columns.iter().map(|(port, _)| info(port)));
    let summary = Summary {
        status: "completed",
        reason: "",
        analysis,
        scene: &session.scene.source.name,
        title: &session.scene.title,
        time_unit: unit,
        rows: times.len(),
        notes,
    };
    let json = |value: &dyn Fn() -> serde_json::Result<String>| value().map_err(io::Error::other);
    let text = table(times, factor, columns, &|port| port.name.clone(), "t");
    files::write(folder, RESULTS_FILE, text.as_bytes())?;
    let channels = Channels { columns: infos };
    files::write(folder, CHANNELS_FILE, json(&|| serde_json::to_string_pretty(&channels))?.as_bytes())?;
    files::write(folder, SUMMARY_FILE, json(&|| serde_json::to_string_pretty(&summary))?.as_bytes())
}

/// The same table with units in its header, as curves of scenes and motion files have them.
#[must_use]
pub fn with_units(session: &Session, times: &[f64], columns: &[(&Port, &[f64])]) -> String {
    let units = &session.scene.units;
    let time = format!("t [{}]", units.label(Dimension::TIME));
    table(times, units.factor(Dimension::TIME), columns, &|port| format!("{} [{}]", port.name, port.unit), &time)
}

/// A table over places of another quantity, in its unit, with units in its header.
#[must_use]
pub fn over(drive: &Port, places: &[f64], columns: &[(&Port, &[f64])]) -> String {
    let first = files::cell(&format!("{} [{}]", drive.name, drive.unit));
    table(places, 1.0, columns, &|port| format!("{} [{}]", port.name, port.unit), &first)
}

fn table(
    times: &[f64],
    factor: f64,
    columns: &[(&Port, &[f64])],
    named: &dyn Fn(&Port) -> String,
    time: &str,
) -> String {
    let mut text = String::from(time);
    columns.iter().for_each(|(port, _)| text.push_str(&format!(",{}", files::cell(&named(port)))));
    text.push('\n');
    for (row, time) in times.iter().enumerate() {
        let _ = write!(text, "{:?}", time / factor);
        columns.iter().for_each(|(_, values)| {
            let _ = write!(text, ",{:?}", values[row]);
        });
        text.push('\n');
    }
    text
}
