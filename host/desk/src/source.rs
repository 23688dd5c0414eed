//! [`Source`]: a folder of results, read.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::results::{
    CHANNELS_FILE, Event, Events, MOTION_FILE, MOTION_FORMAT, RESULTS_FILE, ResultsError, SUMMARY_FILE, Table,
};

/// What a run left in its folder.
pub struct Source {
    /// The folder's own name.
    pub name: String,
    /// `summary.json`.
    pub summary: Value,
    /// The entries of `channels.json`, the time first.
    pub channels: Vec<Value>,
    /// `results.csv`.
    pub table: Table,
    /// `events.csv`, where the run wrote one; times in the unit of the table.
    pub events: Vec<Event>,
    /// `motion.bin`, where the run wrote one.
    pub motion: Option<Vec<u8>>,
    /// The scene file as it is now, where it can be read.
    pub scene: Option<String>,
}

impl Source {
    /// Reads a folder, or the folder that a `results.csv` is in.
    ///
    /// # Errors
    /// Files that are missing, damaged, or do not belong together.
    pub fn read(path: &Path) -> Result<Self, ResultsError> {
        let folder = if path.is_file() { path.parent().unwrap_or(path) } else { path };
        let mut summary = json(&folder.join(SUMMARY_FILE))?;
        let channels_path = folder.join(CHANNELS_FILE);
        let channels = json(&channels_path)?;
        let channels = channels.get("columns").and_then(Value::as_array).cloned().unwrap_or_default();
        let table = Table::read(&folder.join(RESULTS_FILE))?;
        let named = channels.iter().skip(1).filter_map(|channel| channel.get("name")?.as_str());
        if channels.is_empty() || !named.eq(table.names.iter()) {
            return Err(ResultsError::NotATable {
                path: channels_path,
                line: None,
                reason: format!(
                    "its columns are not those of `{RESULTS_FILE}` beside it; run again into an empty folder"
                ),
            });
        }
        let events = Events::of(folder, 1.0)?;
        let scene = summary.get("scene").and_then(Value::as_str).and_then(|scene| fs::read_to_string(scene).ok());
        let whole = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
        let name = whole.file_name().map_or_else(|| folder.display().to_string(), |name| name.to_string_lossy().into());
        let (motion, fault) = motion(&folder.join(MOTION_FILE))?;
        if let (Some(fault), Some(summary)) = (fault, summary.as_object_mut()) {
            let said = format!("`{MOTION_FILE}` shows no motion, which is left out: {fault}; run again to have it");
            let key = if summary.contains_key("analysis") { "notes" } else { "warnings" };
            if let Some(list) = summary.entry(key).or_insert_with(|| Value::Array(Vec::new())).as_array_mut() {
                list.push(said.into());
            }
        }
        Ok(Self { name, summary, channels, table, events, motion, scene })
    }

    /// A text of the summary; empty where it has none.
    pub(crate) fn text(&self, key: &str) -> &str {
        self.summary.get(key).and_then(Value::as_str).unwrap_or_default()
    }

    /// What rows are over: the time, or what an analysis names.
    pub(crate) fn over(&self) -> &str {
        match self.text("over") {
            "" => "time",
            over => over,
        }
    }

    /// The title of the scene, or the name of the folder.
    #[must_use]
    pub fn title(&self) -> &str {
        match self.text("title") {
            "" => &self.name,
            title => title,
        }
    }
}

/// The poses; only a file that begins as one is taken. Otherwise what is wrong with it.
fn motion(path: &Path) -> Result<(Option<Vec<u8>>, Option<&'static str>), ResultsError> {
    match fs::read(path) {
        Ok(bytes) => {
            let begin = format!("{{\"format\":\"{MOTION_FORMAT}\"");
            Ok(match bytes.starts_with(begin.as_bytes()) {
                _ if bytes.is_empty() => (None, Some("it is empty")),
                true if bytes.contains(&b'\n') => (Some(bytes), None),
                true => (None, Some("its first line does not end")),
                false => (None, Some("it does not begin as a run writes it")),
            })
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok((None, None)),
        Err(cause) => Err(ResultsError::Read { path: path.to_path_buf(), cause }),
    }
}

fn json(path: &PathBuf) -> Result<Value, ResultsError> {
    let text = fs::read_to_string(path).map_err(|cause| ResultsError::Read { path: path.clone(), cause })?;
    serde_json::from_str(&text).map_err(|error| ResultsError::NotATable {
        path: path.clone(),
        line: Some(error.line() as u64),
        reason: format!("it is not what a run writes ({error})"),
    })
}
