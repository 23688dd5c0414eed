//! [`Folder`]: the files of a run.

use std::fs;
use std::path::{Path, PathBuf};

use super::summary::replace;
use super::{
    ChannelInfo, CsvWriter, EVENTS_FILE, MotionHeader, MotionWriter, ResultsError, Summary, Written, channels,
};

/// Name of the table.
pub const RESULTS_FILE: &str = "results.csv";
/// Name of the metadata of its columns.
pub const CHANNELS_FILE: &str = "channels.json";
/// Name of the summary.
pub const SUMMARY_FILE: &str = "summary.json";
/// Name of the state at the end of a run, from which another continues.
pub const STATE_FILE: &str = "state.toml";
/// Name of what a run that was killed is resumed from.
pub const CHECKPOINT_FILE: &str = "checkpoint.toml";

/// Digits of the outputs that are certain, where that is asked for.
pub const DIGITS_FILE: &str = "digits.csv";
/// Where all bodies were at the samples, where that is asked for.
pub const MOTION_FILE: &str = "motion.bin";

/// The folder of results of a run that continues. Files of former results with the same names are replaced, all others are
/// left alone.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    table: CsvWriter,
    motion: Option<MotionWriter>,
}

/// How far the files of a run are written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Kept {
    /// The table.
    pub table: Written,
    /// The motion, where it is written.
    pub motion: Option<Written>,
    /// The events, where there may be some: not by [`Folder`], see [`super::Events::sync`].
    pub events: Option<Written>,
}

impl Folder {
    /// Makes the folder where it is missing, and the files: first the summary, which replaces that of a former run in one move and says
    /// `running`, so that no table is ever without one, nor beside a finished one of another run. Everything else of a former run is removed
    /// then; the metadata of the columns are replaced where they differ.
    ///
    /// # Errors
    /// [`ResultsError::Write`]; also where another run is writing there.
    pub fn create(
        path: &Path,
        time: &ChannelInfo,
        channels: &[ChannelInfo],
        motion: Option<&MotionHeader>,
        summary: &Summary,
    ) -> Result<Self, ResultsError> {
        fs::create_dir_all(path).map_err(|cause| ResultsError::write(path, cause))?;
        let table = path.join(RESULTS_FILE);
        let claimed = CsvWriter::claim(&table)?;
        sweep(path);
        summary.write(&path.join(SUMMARY_FILE))?;
        for name in [CHECKPOINT_FILE, STATE_FILE, MOTION_FILE, DIGITS_FILE] {
            remove(&path.join(name))?;
        }
        channels::write(&path.join(CHANNELS_FILE), time, channels)?;
        let table = CsvWriter::begin(&table, claimed, channels)?;
        let motion = motion.map(|header| MotionWriter::create(&path.join(MOTION_FILE), header)).transpose()?;
        Ok(Self { path: path.to_path_buf(), table, motion })
    }

    /// Writes the metadata of the columns anew.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn write_channels(&self, time: &ChannelInfo, channels: &[ChannelInfo]) -> Result<(), ResultsError> {
        channels::write(&self.path.join(CHANNELS_FILE), time, channels)
    }

    /// Continues in the folder of a run that was ended, with what was `kept` of its files.
    ///
    /// # Errors
    /// [`ResultsError`]; also where another run is writing there, or the table is not the one of the checkpoint.
    pub fn go_on(
        path: &Path,
        channels: &[ChannelInfo],
        motion: Option<&MotionHeader>,
        kept: &Kept,
        summary: &Summary,
    ) -> Result<Self, ResultsError> {
        let table = path.join(RESULTS_FILE);
        let claimed = CsvWriter::claim(&table)?;
        sweep(path);
        let table = CsvWriter::go_on(&table, claimed, channels, &kept.table)?;
        let motion = match (motion, &kept.motion) {
            (Some(header), Some(kept)) => Some(MotionWriter::go_on(&path.join(MOTION_FILE), header, kept)?),
            _ => None,
        };
        summary.write(&path.join(SUMMARY_FILE))?;
        Ok(Self { path: path.to_path_buf(), table, motion })
    }

    /// Brings all rows to the disk; returns what is there. For [`Folder::checkpoint`].
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn sync(&mut self) -> Result<Kept, ResultsError> {
        let motion = self.motion.as_mut().map(MotionWriter::sync).transpose()?;
        Ok(Kept { table: self.table.sync()?, motion, events: None })
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

    /// Whether the motion is written.
    #[must_use]
    pub fn takes_motion(&self) -> bool {
        self.motion.is_some()
    }

    /// Writes a record of the motion: the time in its unit, then poses and loads, SI.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn record(&mut self, time: f64, values: &[f64]) -> Result<(), ResultsError> {
        self.motion.as_mut().map_or(Ok(()), |motion| motion.record(time, values))
    }

    /// Rows so far.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.table.rows()
    }

    /// Completes the table, then replaces the summary, which gets the table's checksum.
    ///
    /// # Errors
    /// [`ResultsError::Write`]. If the table cannot be completed, the summary still says `running`.
    pub fn finish(mut self, summary: &mut Summary) -> Result<(), ResultsError> {
        self.table.flush()?;
        self.motion.as_mut().map_or(Ok(()), MotionWriter::flush)?;
        summary.results_sha256 = Some(self.table.written().sha256);
        summary.write(&self.path.join(SUMMARY_FILE))
    }
}

/// Removes what a run that was killed while it replaced a file left beside it. Should that fail, nothing is the worse for it.
fn sweep(path: &Path) {
    let names = [SUMMARY_FILE, CHECKPOINT_FILE, CHANNELS_FILE, STATE_FILE, EVENTS_FILE];
    let is_left = |name: &str| name.ends_with(".tmp") && names.iter().any(|own| name.starts_with(&format!("{own}.")));
    let entries = fs::read_dir(path).into_iter().flatten().flatten();
    for entry in entries.filter(|entry| entry.file_name().to_str().is_some_and(is_left)) {
        let _ = fs::remove_file(entry.path());
    }
}

/// Removes a file, if it is there.
pub(crate) fn remove(path: &Path) -> Result<(), ResultsError> {
    match fs::remove_file(path) {
        Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => Err(ResultsError::write(path, cause)),
        _ => Ok(()),
    }
}
