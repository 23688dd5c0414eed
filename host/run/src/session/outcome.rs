//! [`RunReport`]: what a run gives.

use std::path::Path;

use crate::diagnostics::{Exit, codes};
use crate::results::{ChannelInfo, CheckResult, Event, Events, Folder, ResultsError, Status, Summary};

/// What a run gives.
#[derive(Debug, Clone)]
pub struct RunReport {
    /// How it went.
    pub summary: Summary,
    /// Times of the samples, scene units.
    pub times: Vec<f64>,
    /// Samples of each channel, scene units.
    pub columns: Vec<Vec<f64>>,
    /// What the times are.
    pub time: ChannelInfo,
    /// What each column is.
    pub channels: Vec<ChannelInfo>,
    /// What happened to contacts, in this part of the run where it was resumed.
    pub events: Vec<Event>,
    /// The checks of the scene with their samples, in its order.
    pub checks: Vec<CheckResult>,
}

impl RunReport {
    /// Writes a run without a folder into one: table, columns, summary and events with the bytes that a run into the folder leaves.
    /// The state at the end and the motion are not among what is kept of a run.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn write(&self, folder: &Path) -> Result<(), ResultsError> {
        // The samples are in units of their columns already.
        let as_they_are: Vec<ChannelInfo> =
            self.channels.iter().map(|channel| ChannelInfo { factor: 1.0, ..channel.clone() }).collect();
        let mut summary = self.summary.clone();
        let mut files = Folder::create(folder, &self.time, &as_they_are, None, &summary)?;
        files.write_channels(&self.time, &self.channels)?;
        if !self.events.is_empty() {
            let mut events = Events::default();
            events.begin(folder, self.time.factor)?;
            self.events.iter().try_for_each(|event| events.take(event))?;
            events.finish()?;
        }
        let mut row = vec![0.0; self.columns.len()];
        for (k, time) in self.times.iter().enumerate() {
            row.iter_mut().zip(&self.columns).for_each(|(value, column)| *value = column[k]);
            files.row(*time, &row)?;
        }
        files.finish(&mut summary)
    }

    /// Exit code of the program for this run.
    #[must_use]
    pub fn exit_code(&self) -> i32 {
        match self.summary.status {
            Status::Suspect => Exit::Audit as i32,
            Status::Completed if !self.summary.checks_passed() => Exit::Audit as i32,
            Status::Completed => 0,
            Status::StoppedEarly if self.summary.code == Some(codes::INTERRUPTED) => Exit::Interrupted as i32,
            _ => Exit::Integration as i32,
        }
    }
}
