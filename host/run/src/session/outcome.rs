//! [`RunReport`]: what a run gives.

use crate::diagnostics::{Exit, codes};
use crate::results::{ChannelInfo, CheckResult, Event, Status, Summary};

/// What a run gives.
#[derive(Debug, Clone)]
pub struct RunReport {
    /// How it went.
    pub summary: Summary,
    /// Times of the samples, scene units.
    pub times: Vec<f64>,
    /// Samples of each channel, scene units.
    pub columns: Vec<Vec<f64>>,
    /// What each column is.
    pub channels: Vec<ChannelInfo>,
    /// What happened to contacts, in this part of the run where it was resumed.
    pub events: Vec<Event>,
    /// The checks of the scene with their samples, in its order.
    pub checks: Vec<CheckResult>,
}

impl RunReport {
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
