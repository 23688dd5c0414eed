//! [`CsvWriter`]: the table of results, written during a run.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::seal::Checksum;
use super::{ChannelInfo, ResultsError};

/// A row that comes later than this after the last write takes everything collected to the file.
const LONGEST_DELAY: Duration = Duration::from_millis(200);
/// Rows are collected up to this many bytes.
const BUFFER: usize = 1 << 16;
/// Bytes of a full disk that are left to the summary, which says why the table ends.
const LEFT: u64 = 1 << 14;
/// Bytes of the longest number, with its separator.
const LONGEST_NUMBER: usize = 26;

/// How far a table is written: what a checkpoint notes of it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Written {
    /// Rows, the header not counted.
    pub rows: u64,
    /// Bytes up to the end of the last row.
    pub bytes: u64,
    /// SHA-256 of these bytes, in hexadecimal digits.
    pub sha256: String,
}

impl Written {
    /// The part of a file that it was taken of, with its checksum.
    ///
    /// # Errors
    /// [`ResultsError::Changed`] if the file is not that one.
    pub(super) fn part_of<'b>(&self, path: &Path, bytes: &'b [u8]) -> Result<(&'b [u8], Checksum), ResultsError> {
        let wrong = |reason: &str| not_kept(path, reason);
        let part = usize::try_from(self.bytes).ok().and_then(|length| bytes.get(..length));
        let part = part.ok_or_else(|| wrong("it is shorter than at the last checkpoint"))?;
        let mut checksum = Checksum::default();
        checksum.add(part);
        if checksum.hex() == self.sha256 {
            Ok((part, checksum))
        } else {
            Err(wrong("it is not what it was at the last checkpoint: it was damaged, or edited"))
        }
    }
}

/// A file that is not the one of a checkpoint.
fn not_kept(path: &Path, reason: &str) -> ResultsError {
    let help = "put it back as it was, or begin the run anew: `odyn run`";
    ResultsError::Changed { path: path.to_path_buf(), reason: reason.into(), help }
}

/// Writes a plain CSV table: one header line, `t` first, then one line per sample.
///
/// Numbers have the fewest digits that read back as the same bits (`NaN`, `inf`, `-inf` where they are not finite). The
/// file holds whole rows at every moment a program can see it; what is still collected is written when the writer is
/// dropped.
#[derive(Debug)]
pub struct CsvWriter {
    path: PathBuf,
    file: File,
    factors: Vec<f64>,
    /// Whole rows that are not in the file yet.
    buffer: Vec<u8>,
    /// Length of the file, which ends with a row.
    written: u64,
    /// Of what is in the file.
    checksum: Checksum,
    rows: u64,
    last_write: Instant,
}

impl CsvWriter {
    /// Creates the file, replacing one of the same name, and writes the header. Its folder must exist.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn create(path: &Path, channels: &[ChannelInfo]) -> Result<Self, ResultsError> {
        let file = Self::claim(path)?;
        Self::begin(path, file, channels)
    }

    /// Opens the file without changing it, so that no other run can write it meanwhile (Unix only: elsewhere, others could
    /// not read it either).
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub(super) fn claim(path: &Path) -> Result<File, ResultsError> {
        let open = OpenOptions::new().write(true).create(true).truncate(false).open(path);
        let file = open.map_err(|cause| ResultsError::write(path, cause))?;
        #[cfg(unix)]
        if file.metadata().is_ok_and(|data| data.is_file())
            && let Err(std::fs::TryLockError::WouldBlock) = file.try_lock()
        {
            let busy = std::io::Error::new(std::io::ErrorKind::WouldBlock, "another run writes it");
            return Err(ResultsError::write(path, busy));
        }
        Ok(file)
    }

    /// Empties a claimed file and writes the header.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub(super) fn begin(path: &Path, file: File, channels: &[ChannelInfo]) -> Result<Self, ResultsError> {
        // Not `set_len`, which devices refuse.
        File::create(path).map_err(|cause| ResultsError::write(path, cause))?;
        let mut writer = Self::new(path, file, channels);
        writer.buffer = header_of(channels);
        writer.make_room();
        writer.flush()?;
        Ok(writer)
    }

    /// Continues a claimed file that begins with what was `kept` of it; what is behind that is cut off.
    ///
    /// # Errors
    /// [`ResultsError::Write`]; [`ResultsError::Changed`] if the file is shorter, or not what it was.
    pub(super) fn go_on(
        path: &Path,
        mut file: File,
        channels: &[ChannelInfo],
        kept: &Written,
    ) -> Result<Self, ResultsError> {
        let text = std::fs::read(path).map_err(|cause| ResultsError::Read { path: path.to_path_buf(), cause })?;
        let (whole, checksum) = kept.part_of(path, &text)?;
        if !whole.starts_with(&header_of(channels)) {
            return Err(not_kept(path, "its columns are not those of the run"));
        }
        let cut = file.set_len(kept.bytes).and_then(|()| file.seek(SeekFrom::Start(kept.bytes)));
        cut.map_err(|cause| ResultsError::write(path, cause))?;
        let mut writer = Self::new(path, file, channels);
        writer.make_room();
        (writer.written, writer.rows, writer.checksum) = (kept.bytes, kept.rows, checksum);
        Ok(writer)
    }

    fn new(path: &Path, file: File, channels: &[ChannelInfo]) -> Self {
        Self {
            path: path.to_path_buf(),
            file,
            factors: channels.iter().map(|channel| channel.factor).collect(),
            buffer: Vec::new(),
            written: 0,
            checksum: Checksum::default(),
            rows: 0,
            last_write: Instant::now(),
        }
    }

    /// Room for all rows that are collected: the last one may end behind the bytes up to which that is done.
    fn make_room(&mut self) {
        self.buffer.reserve(BUFFER + LONGEST_NUMBER * (self.factors.len() + 1));
    }

    /// Writes a row: the time in its column's unit, then one value per channel in SI. `[hot, no allocation]`
    ///
    /// # Errors
    /// [`ResultsError::Write`]; the file then still ends with a whole row.
    ///
    /// # Panics
    /// If the number of values is not that of the channels.
    pub fn row(&mut self, time: f64, values: &[f64]) -> Result<(), ResultsError> {
        assert_eq!(values.len(), self.factors.len(), "one value per channel");
        append(&mut self.buffer, time);
        for (value, factor) in values.iter().zip(&self.factors) {
            self.buffer.push(b',');
            append(&mut self.buffer, value / factor);
        }
        self.buffer.push(b'\n');
        self.rows += 1;
        if self.buffer.len() >= BUFFER || self.last_write.elapsed() >= LONGEST_DELAY {
            self.flush()?;
        }
        Ok(())
    }

    /// Rows so far, the header not counted, without those that had to be given up.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Brings everything that was collected into the file.
    ///
    /// # Errors
    /// [`ResultsError::Write`]; the file then still ends with a whole row, and the collected rows that do not fit are given up.
    pub fn flush(&mut self) -> Result<(), ResultsError> {
        let result = self.file.write_all(&self.buffer);
        if let Err(cause) = &result {
            // A full disk takes a part of the buffer: back to its last whole row.
            let end = self.file.stream_position().unwrap_or(self.written);
            let left =
                if [ErrorKind::StorageFull, ErrorKind::QuotaExceeded].contains(&cause.kind()) { LEFT } else { 0 };
            let taken = usize::try_from(end.saturating_sub(self.written + left)).unwrap_or(usize::MAX);
            let taken = &self.buffer[..taken.min(self.buffer.len())];
            let kept = taken.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
            let lost = self.buffer[kept..].iter().filter(|byte| **byte == b'\n').count() as u64;
            self.rows = self.rows.saturating_sub(lost);
            self.buffer.truncate(kept);
            // If even that fails, so be it.
            let length = self.written + kept as u64;
            let _ = self.file.set_len(length).and_then(|()| self.file.seek(SeekFrom::Start(length)));
        }
        self.written += self.buffer.len() as u64;
        self.checksum.add(&self.buffer);
        self.buffer.clear();
        self.last_write = Instant::now();
        result.map_err(|cause| ResultsError::write(&self.path, cause))?;
        // A file that was removed takes rows all the same, and nobody will ever see them.
        self.path.metadata().map(|_| ()).map_err(|cause| ResultsError::write(&self.path, cause))
    }

    /// Brings everything that was collected into the file, and the file to the disk. Returns what is there.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn sync(&mut self) -> Result<Written, ResultsError> {
        self.flush()?;
        self.file.sync_data().map_err(|cause| ResultsError::write(&self.path, cause))?;
        Ok(self.written())
    }

    /// What was written so far; rows that are still collected are not among it.
    pub(super) fn written(&self) -> Written {
        Written { rows: self.rows, bytes: self.written, sha256: self.checksum.hex() }
    }
}

impl Drop for CsvWriter {
    fn drop(&mut self) {
        // Whoever wants to know calls `flush` first.
        let _ = self.flush();
    }
}

fn header_of(channels: &[ChannelInfo]) -> Vec<u8> {
    let names = std::iter::once(ChannelInfo::TIME).chain(channels.iter().map(|channel| channel.name.as_str()));
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(names).expect("writing to memory does not fail");
    writer.into_inner().expect("writing to memory does not fail")
}

/// Appends the fewest digits that read back as the same bits (Giulietti 2020, "The Schubfach way to render doubles").
fn append(buffer: &mut Vec<u8>, value: f64) {
    let mut room = zmij::Buffer::new();
    let text = room.format(value);
    // Exponents have no plus sign.
    match Some(text).filter(|_| value.abs() >= 1e16).and_then(|text| text.split_once("e+")) {
        Some((digits, exponent)) => {
            [digits, "e", exponent].iter().for_each(|part| buffer.extend_from_slice(part.as_bytes()))
        }
        None => buffer.extend_from_slice(text.as_bytes()),
    }
}
