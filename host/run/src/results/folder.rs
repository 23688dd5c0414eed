//! [`Folder`]: the three files of a run.

use std::fs;
use std::path::{Path, PathBuf};

use super::summary::replace;
use super::{ChannelInfo, CsvWriter, ResultsError, Summary, Written, channels};

/// Name of the table.
pub const RESULTS_FILE: &str = "results.csv";
/// Name of the metadata of its columns.
pub const CHANNELS_FILE: &str = "channels.json";
/// Name of the summary.
pub const SUMMARY_FILE: &str = "summary.json";
/// Name of the state at the end of a run, from which another goes on.
pub const STATE_FILE: &str = "state.toml";
/// Name of what a run that was killed is resumed from.
pub const CHECKPOINT_FILE: &str = "checkpoint.toml";

/// The folder of results of a run that goes on. Files of former results with the same names are replaced, all others are
/// left alone.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    table: CsvWriter,
}

impl Folder {
    /// Makes the folder where it is missing, and the files: first the summary, which says `running`, so that a finished
    /// one never stands beside the table of another run. State and checkpoint of a former run are removed.
    ///
    /// # Errors
    /// [`ResultsError::Write`]; also where another run is writing there.
    pub fn create(
        path: &Path,
        time: &ChannelInfo,
        channels: &[ChannelInfo],
        summary: &Summary,
    ) -> Result<Self, ResultsError> {
        fs::create_dir_all(path).map_err(|cause| ResultsError::write(path, cause))?;
        let table = path.join(RESULTS_FILE);
        let claimed = CsvWriter::claim(&table)?;
        for name in [CHECKPOINT_FILE, STATE_FILE] {
            remove(&path.join(name))?;
        }
        summary.write(&path.join(SUMMARY_FILE))?;
        channels::write(&path.join(CHANNELS_FILE), time, channels)?;
        let table = CsvWriter::begin(&table, claimed, channels)?;
        Ok(Self { path: path.to_path_buf(), table })
    }

    /// Continues in the folder of a run that was ended, with what was `kept` of its table.
    ///
    /// # Errors
    /// [`ResultsError`]; also where another run is writing there, or the table is not the one of the checkpoint.
    pub fn go_on(
        path: &Path,
        channels: &[ChannelInfo],
        kept: &Written,
        summary: &Summary,
    ) -> Result<Self, ResultsError> {
        let table = path.join(RESULTS_FILE);
        let table = CsvWriter::go_on(&table, CsvWriter::claim(&table)?, channels, kept)?;
        summary.write(&path.join(SUMMARY_FILE))?;
        Ok(Self { path: path.to_path_buf(), table })
    }

    /// Brings all rows to the disk; returns what is there. For [`Folder::checkpoint`].
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn sync(&mut self) -> Result<Written, ResultsError> {
        self.table.sync()
    }

    /// A checkpoint that there is no text for.
    pub(crate) fn no_checkpoint(&self, cause: std::io::Error) -> ResultsError {
        ResultsError::write(&self.path.join(CHECKPOINT_FILE), cause)
    }

    /// Replaces the checkpoint in one move, and brings it to the disk.
    ///
    /// # Errors
    /// [`ResultsError::Write`]; the former checkpoint is then untouched.
    pub fn checkpoint(&self, text: &str) -> Result<(), ResultsError> {
        replace(&self.path.join(CHECKPOINT_FILE), text.as_bytes(), true)
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

    /// Completes the table, then replaces the summary, which gets the table's checksum. The checkpoint of a run that reached its end is removed then.
    ///
    /// # Errors
    /// [`ResultsError::Write`]. If the table cannot be completed, the summary still says `running`.
    pub fn finish(mut self, summary: &mut Summary) -> Result<(), ResultsError> {
        self.table.flush()?;
        summary.results_sha256 = Some(self.table.written().sha256);
        summary.write(&self.path.join(SUMMARY_FILE))?;
        if summary.status.reached_end() { remove(&self.path.join(CHECKPOINT_FILE)) } else { Ok(()) }
    }
}

/// Removes a file, if it is there.
fn remove(path: &Path) -> Result<(), ResultsError> {
    match fs::remove_file(path) {
        Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => Err(ResultsError::write(path, cause)),
        _ => Ok(()),
    }
}
