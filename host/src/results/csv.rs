//! [`CsvWriter`]: the table of results, written while a run goes on.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{ChannelInfo, ResultsError};

/// A row that comes later than this after the last write takes everything collected to the file.
const LONGEST_DELAY: Duration = Duration::from_millis(200);
/// Rows are collected up to this many bytes.
const BUFFER: usize = 1 << 16;

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
    rows: u64,
    last_write: Instant,
}

impl CsvWriter {
    /// Creates the file, replacing one of the same name, and writes the header. Its folder must exist.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn create(path: &Path, channels: &[ChannelInfo]) -> Result<Self, ResultsError> {
        let file = File::create(path).map_err(|cause| ResultsError::write(path, cause))?;
        let names = std::iter::once(ChannelInfo::TIME).chain(channels.iter().map(|channel| channel.name.as_str()));
        let mut writer = Self {
            path: path.to_path_buf(),
            file,
            factors: channels.iter().map(|channel| channel.factor).collect(),
            buffer: header(names),
            written: 0,
            rows: 0,
            last_write: Instant::now(),
        };
        writer.buffer.reserve(BUFFER);
        writer.flush()?;
        Ok(writer)
    }

    /// Writes a row: the time in its column's unit, then one value per channel in SI. `[hot, no allocation once warm]`
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

    /// Rows so far, the header not counted.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Brings everything that was collected into the file.
    ///
    /// # Errors
    /// [`ResultsError::Write`]; the file then still ends with a whole row, and the collected rows are given up.
    pub fn flush(&mut self) -> Result<(), ResultsError> {
        let result = self.file.write_all(&self.buffer);
        if let Err(cause) = result {
            // A full disk takes a part of the buffer: back to the last whole row. If even that fails, so be it.
            let _ = self.file.set_len(self.written);
            self.buffer.clear();
            return Err(ResultsError::write(&self.path, cause));
        }
        self.written += self.buffer.len() as u64;
        self.buffer.clear();
        self.last_write = Instant::now();
        Ok(())
    }
}

impl Drop for CsvWriter {
    fn drop(&mut self) {
        // Whoever wants to know calls `flush` first.
        let _ = self.flush();
    }
}

fn header<'a>(names: impl Iterator<Item = &'a str>) -> Vec<u8> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(names).expect("writing to memory does not fail");
    writer.into_inner().expect("writing to memory does not fail")
}

/// Appends the fewest digits that read back as the same bits (Adams 2018, "Ryu: fast float-to-string conversion").
fn append(buffer: &mut Vec<u8>, value: f64) {
    buffer.extend_from_slice(ryu::Buffer::new().format(value).as_bytes());
}
