//! [`Folder`]: the three files of a run.

use std::fs;
use std::path::{Path, PathBuf};

use super::{ChannelInfo, CsvWriter, ResultsError, Summary, channels};

/// Name of the table.
pub const RESULTS_FILE: &str = "results.csv";
/// Name of the metadata of its columns.
pub const CHANNELS_FILE: &str = "channels.json";
/// Name of the summary.
pub const SUMMARY_FILE: &str = "summary.json";

/// The folder of results of a run that goes on. Files of former results with the same names are replaced, all others are
/// left alone.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    table: CsvWriter,
}

impl Folder {
    /// Makes the folder where it is missing, and the files: first the summary, which says `running`, so that a finished
    /// one never stands beside the table of another run.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn create(
        path: &Path,
        time: &ChannelInfo,
        channels: &[ChannelInfo],
        summary: &Summary,
    ) -> Result<Self, ResultsError> {
        fs::create_dir_all(path).map_err(|cause| ResultsError::write(path, cause))?;
        summary.write(&path.join(SUMMARY_FILE))?;
        channels::write(&path.join(CHANNELS_FILE), time, channels)?;
        let table = CsvWriter::create(&path.join(RESULTS_FILE), channels)?;
        Ok(Self { path: path.to_path_buf(), table })
    }

    /// Writes a row: the time in its column's unit, then one value per channel in SI.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn row(&mut self, time: f64, values: &[f64]) -> Result<(), ResultsError> {
        self.table.row(time, values)
    }

    /// Rows so far.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.table.rows()
    }

    /// Completes the table, then replaces the summary.
    ///
    /// # Errors
    /// [`ResultsError::Write`]. If the table cannot be completed, the summary still says `running`.
    pub fn finish(mut self, summary: &Summary) -> Result<(), ResultsError> {
        self.table.flush()?;
        summary.write(&self.path.join(SUMMARY_FILE))
    }
}
