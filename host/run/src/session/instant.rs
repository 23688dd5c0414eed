//! [`Instant`]: where a run is, as the equations in coordinates of bodies see it; for analyses of that state.

use super::error::SessionError;
use super::opened::Session;
use super::run::Run;
use crate::analysis::AnalysisError;
use crate::integrate::IntegrateError;

/// A state of a scene with everything that its equations depend on.
#[derive(Debug, Clone, PartialEq)]
pub struct Instant {
    /// s.
    pub time: f64,
    /// The inputs of all programs in coordinates of bodies, laid out by [`crate::plan::Layout`]: accelerations and multipliers
    /// of the motion among them.
    pub inputs: Vec<f64>,
    /// Contacts that are closed, by their number in [`crate::program::Equations::contacts`].
    pub closed: Vec<usize>,
    /// Joints that have let go, by their elements.
    pub released: Vec<usize>,
}

impl Session {
    /// The time at which its run begins, s.
    #[must_use]
    pub fn time_of_start(&self) -> f64 {
        self.begins.time
    }
}

impl Run<'_> {
    /// Where the run is: what its equations are to be examined at.
    ///
    /// # Errors
    /// Accelerations or reactions that have no solution here.
    pub fn instant(&mut self) -> Result<Instant, SessionError> {
        if self.system.has_events() {
            // Which contacts are closed, and what has switched, is found when time advances.
            if self.interrupted {
                self.system.meet_anew();
            }
            let met = self.meet_contacts(self.time).map_err(|error| self.session.integration_error(&error))?;
            if let Some(status) = met {
                self.outcome = Ok(status);
                if let Some(error) = super::summary::stopped(&self.session, &self.outcome) {
                    return Err(error);
                }
            }
        }
        // Whatever is looked up for this is no part of the run.
        self.interrupted = true;
        let (t, session) = (self.time, &self.session);
        let refused =
            |error: AnalysisError| session.integration_error(&IntegrateError::System { t, cause: Box::new(error) });
        let inputs = self.system.solved_inputs(t, &self.state).map_err(refused)?;
        let closed = self.system.closed_that_hold(t, &self.state).map_err(refused)?;
        let released = self.system.released();
        Ok(Instant { time: self.time, inputs, closed, released })
    }
}
