//! [`ChannelInfo`]: what a column of the table is.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::summary::write_where_new;
use super::{CHANNELS_FILE, RESULTS_FILE, ResultsError};

/// One column of the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelInfo {
    /// Column name.
    pub name: String,
    /// Unit of the column; empty for a pure number.
    pub unit: String,
    /// What is measured, as a word of scene files such as `reaction_force`; may be empty.
    pub quantity: String,
    /// On which body, at which point, in which frame, in words; may be empty.
    pub place: String,
    /// One unit of the column in SI, positive.
    #[serde(rename = "si_per_unit")]
    pub factor: f64,
    /// False if rigid bodies do not determine the value (a reaction shared by redundant joints).
    pub unique: bool,
}

impl ChannelInfo {
    /// Name of the column of times.
    pub const TIME: &'static str = "t";

    /// The column of times; `factor` is one of its units in s.
    #[must_use]
    pub fn time(unit: &str, factor: f64) -> Self {
        Self {
            name: Self::TIME.into(),
            unit: unit.into(),
            quantity: "time".into(),
            place: String::new(),
            factor,
            unique: true,
        }
    }

    /// A value in SI, in the unit of the column.
    #[must_use]
    pub fn from_si(&self, value: f64) -> f64 {
        value / self.factor
    }
}

/// Writes the metadata of all columns as JSON, in the order of the table.
pub(super) fn write(path: &Path, time: &ChannelInfo, channels: &[ChannelInfo]) -> Result<(), ResultsError> {
    #[derive(Serialize)]
    struct File<'a> {
        columns: Vec<&'a ChannelInfo>,
    }
    write_where_new(path, &File { columns: std::iter::once(time).chain(channels).collect() })
}

/// The metadata beside the table of a run, the time first; none beside another table, or where the file is not what a run writes.
pub(super) fn beside(table: &Path) -> Option<Vec<ChannelInfo>> {
    #[derive(Deserialize)]
    struct File {
        columns: Vec<ChannelInfo>,
    }
    let text = std::fs::read_to_string(table.with_file_name(CHANNELS_FILE)).ok()?;
    let is_of_run = table.file_name().is_some_and(|name| name == RESULTS_FILE);
    serde_json::from_str::<File>(&text).ok().filter(|_| is_of_run).map(|file| file.columns)
}
