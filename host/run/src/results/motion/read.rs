//! [`Motion`]: a motion read back.

use std::path::Path;

use super::super::ResultsError;
use super::{LOAD, MotionHeader, POSE};

/// Bytes of a file that are read.
const LONGEST: u64 = 2 << 30;

/// A motion that was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// What it shows.
    pub header: MotionHeader,
    /// Times of the samples, in the unit of the header.
    pub times: Vec<f64>,
    /// Seven numbers per body that can move, sample after sample: position of its frame's origin, m, and Euler parameters body ->
    /// ground, scalar first.
    pub poses: Vec<f32>,
    /// Six numbers per load, sample after sample: force, N, and torque about its frame's origin, N m; ground axes.
    pub loads: Vec<f32>,
}

impl Motion {
    /// Reads a file. A last record that is not whole is left out.
    ///
    /// # Errors
    /// [`ResultsError::Read`]; [`ResultsError::NotAMotion`] where the file is none, or too large (2 GB).
    pub fn read(path: &Path) -> Result<Self, ResultsError> {
        let unread = |cause| ResultsError::Read { path: path.to_path_buf(), cause };
        let wrong = |reason: String| ResultsError::NotAMotion { path: path.to_path_buf(), reason };
        if path.metadata().map_err(unread)?.len() > LONGEST {
            return Err(wrong(format!("it is longer than {} GB", LONGEST >> 30)));
        }
        Self::from_bytes(&std::fs::read(path).map_err(unread)?).map_err(wrong)
    }

    /// The same from the bytes of a file.
    ///
    /// # Errors
    /// What is wrong with them, in words.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let end = bytes.iter().position(|byte| *byte == b'\n').ok_or("its first line does not end")?;
        let header: MotionHeader = serde_json::from_slice(&bytes[..end])
            .map_err(|error| format!("its first line is not understood: {error}"))?;
        if let Some(fault) = header.fault() {
            return Err(fault.into());
        }
        let (poses_of_record, loads_of_record) = (POSE * header.moving(), LOAD * header.loads.len());
        let records = bytes[end + 1..].chunks_exact(header.record_size());
        let count = records.len();
        let mut motion = Self {
            header,
            times: Vec::with_capacity(count),
            poses: Vec::with_capacity(count * poses_of_record),
            loads: Vec::with_capacity(count * loads_of_record),
        };
        for record in records {
            let (time, numbers) = record.split_at(8);
            motion.times.push(time.try_into().map_or(f64::NAN, f64::from_le_bytes));
            let number = |bytes: &[u8]| bytes.try_into().map_or(f32::NAN, f32::from_le_bytes);
            let (poses, loads) = numbers.split_at(4 * poses_of_record);
            motion.poses.extend(poses.chunks_exact(4).map(number));
            motion.loads.extend(loads.chunks_exact(4).map(number));
        }
        Ok(motion)
    }

    /// The pose of a body that can move, counted among these, at a sample: position and Euler parameters.
    #[must_use]
    pub fn pose(&self, sample: usize, moving: usize) -> Option<[f32; POSE]> {
        let at = (sample * self.header.moving() + moving) * POSE;
        self.poses.get(at..at + POSE)?.try_into().ok().filter(|_| moving < self.header.moving())
    }

    /// A load at a sample: force and torque.
    #[must_use]
    pub fn load(&self, sample: usize, load: usize) -> Option<[f32; LOAD]> {
        let at = (sample * self.header.loads.len() + load) * LOAD;
        self.loads.get(at..at + LOAD)?.try_into().ok().filter(|_| load < self.header.loads.len())
    }
}
