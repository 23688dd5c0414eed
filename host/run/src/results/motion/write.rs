//! [`MotionWriter`]: the motion, written during a run.

use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::super::seal::Checksum;
use super::super::{ResultsError, Written};
use super::{MotionHeader, POSE};

/// A record that comes later than this after the last write takes everything collected to the file.
const LONGEST_DELAY: Duration = Duration::from_millis(200);
/// Records are collected up to this many bytes.
const BUFFER: usize = 1 << 16;

/// Writes `motion.bin`: whole records, at every moment a program can see it; what is still collected is written when the writer
/// is dropped.
#[derive(Debug)]
pub struct MotionWriter {
    path: PathBuf,
    file: File,
    /// Whole records that are not in the file yet.
    buffer: Vec<u8>,
    /// Length of the file, which ends with a record.
    written: u64,
    /// Of what is in the file.
    checksum: Checksum,
    records: u64,
    last_write: Instant,
    /// Euler parameters of each body in the last record: of the two sets of a rotation, the next record has the nearer one.
    last: Vec<[f32; 4]>,
    /// Numbers of a record besides the time.
    numbers: usize,
}

impl MotionWriter {
    /// Creates the file, replacing one of the same name.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn create(path: &Path, header: &MotionHeader) -> Result<Self, ResultsError> {
        let failed = |cause| ResultsError::write(path, cause);
        let line = header.line().map_err(|error| failed(error.into()))?;
        let file = File::create(path).map_err(failed)?;
        let mut writer = Self::new(path, file, header);
        writer.buffer = line;
        writer.flush()?;
        Ok(writer)
    }

    /// Continues a file that begins with what was `kept` of it; what is behind that is cut off.
    ///
    /// # Errors
    /// [`ResultsError::Write`], [`ResultsError::Read`]; [`ResultsError::Changed`] if the file is shorter, or not what it was.
    pub fn go_on(path: &Path, header: &MotionHeader, kept: &Written) -> Result<Self, ResultsError> {
        let failed = |cause| ResultsError::write(path, cause);
        let bytes = std::fs::read(path).map_err(|cause| ResultsError::Read { path: path.to_path_buf(), cause })?;
        let (whole, checksum) = kept.part_of(path, &bytes)?;
        let mut file = OpenOptions::new().write(true).open(path).map_err(failed)?;
        file.set_len(kept.bytes).and_then(|()| file.seek(SeekFrom::Start(kept.bytes))).map_err(failed)?;
        let mut writer = Self::new(path, file, header);
        (writer.written, writer.records, writer.checksum) = (kept.bytes, kept.rows, checksum);
        let record = whole.len().checked_sub(header.record_size()).filter(|_| kept.rows > 0).map(|at| &whole[at..]);
        if let Some(record) = record {
            let mut numbers = record[8..].chunks_exact(4).map(|bytes| bytes.try_into().map_or(0.0, f32::from_le_bytes));
            for last in &mut writer.last {
                let pose: [f32; POSE] = std::array::from_fn(|_| numbers.next().unwrap_or(0.0));
                last.copy_from_slice(&pose[3..]);
            }
        }
        Ok(writer)
    }

    fn new(path: &Path, file: File, header: &MotionHeader) -> Self {
        Self {
            path: path.to_path_buf(),
            file,
            buffer: Vec::with_capacity(BUFFER + header.record_size()),
            written: 0,
            checksum: Checksum::default(),
            records: 0,
            last_write: Instant::now(),
            last: vec![[0.0; 4]; header.moving()],
            numbers: (header.record_size() - 8) / 4,
        }
    }

    /// Writes a record: the time in its unit, then poses and loads, SI. `[hot, no allocation once warm]`
    ///
    /// # Errors
    /// [`ResultsError::Write`]; the file then still ends with a whole record.
    ///
    /// # Panics
    /// If the number of values is not that of the header.
    pub fn record(&mut self, time: f64, values: &[f64]) -> Result<(), ResultsError> {
        assert_eq!(values.len(), self.numbers, "seven values per body, six per load");
        let (poses, loads) = values.split_at(POSE * self.last.len());
        self.buffer.extend_from_slice(&time.to_le_bytes());
        let put = |buffer: &mut Vec<u8>, value: f64| {
            // What is beyond the range of the file is not known, either.
            let value = Some(value as f32).filter(|value| value.is_finite()).unwrap_or(f32::NAN);
            buffer.extend_from_slice(&value.to_le_bytes());
        };
        for (pose, last) in poses.chunks_exact(POSE).zip(&mut self.last) {
            let (position, turn) = pose.split_at(3);
            position.iter().for_each(|value| put(&mut self.buffer, *value));
            let along: f64 = turn.iter().zip(&*last).map(|(new, old)| new * f64::from(*old)).sum();
            let sign = if along < 0.0 { -1.0 } else { 1.0 };
            for (value, last) in turn.iter().zip(last) {
                put(&mut self.buffer, sign * value);
                *last = (sign * value) as f32;
            }
        }
        loads.iter().for_each(|value| put(&mut self.buffer, *value));
        self.records += 1;
        let is_due = self.buffer.len() >= BUFFER || self.last_write.elapsed() >= LONGEST_DELAY;
        if is_due { self.flush() } else { Ok(()) }
    }

    /// Brings everything that was collected into the file.
    ///
    /// # Errors
    /// [`ResultsError::Write`]; the file then still ends with a whole record, and the collected ones are given up.
    pub fn flush(&mut self) -> Result<(), ResultsError> {
        if let Err(cause) = self.file.write_all(&self.buffer) {
            // A full disk takes a part of the buffer: back to the last whole record. If even that fails, readers skip it.
            let _ = self.file.set_len(self.written);
            self.buffer.clear();
            return Err(ResultsError::write(&self.path, cause));
        }
        self.written += self.buffer.len() as u64;
        self.checksum.add(&self.buffer);
        self.buffer.clear();
        self.last_write = Instant::now();
        Ok(())
    }

    /// Brings everything that was collected to the disk. Returns what is there.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn sync(&mut self) -> Result<Written, ResultsError> {
        self.flush()?;
        self.file.sync_data().map_err(|cause| ResultsError::write(&self.path, cause))?;
        Ok(Written { rows: self.records, bytes: self.written, sha256: self.checksum.hex() })
    }
}

impl Drop for MotionWriter {
    fn drop(&mut self) {
        // Whoever wants to know calls `flush` first.
        let _ = self.flush();
    }
}
