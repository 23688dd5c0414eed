//! Contacts whose reactions rigid bodies do not determine, during a run: events that say so.

use super::Simulation;
use crate::analysis::{AnalysisError, Indeterminate};
use crate::results::{Event, EventKind};

impl Simulation<'_> {
    /// Tells what is open from here on; `touching`: the contacts that the places of `open` are among.
    pub(super) fn report_indeterminate(
        &mut self,
        t: f64,
        touching: &[usize],
        open: &Indeterminate,
    ) -> Result<(), AnalysisError> {
        let Some(touch) = &self.touch else { return Ok(()) };
        let first = touch.first_friction();
        let frictions = open.frictions.iter().map(|number| first + number);
        let all = open.contacts.iter().map(|place| touching[*place]).chain(frictions);
        let mut events: Vec<Event> = all.map(|k| touch.event(t, EventKind::Indeterminate, k)).collect();
        let moving = open.moving.iter().map(|number| first + number);
        events.extend(moving.map(|k| touch.event(t, EventKind::Ambiguous, k)));
        self.send(&events)
    }

    /// Gives events to whoever takes the results.
    pub(super) fn send(&mut self, events: &[Event]) -> Result<(), AnalysisError> {
        for event in events {
            let sent = self.rows_taken.sink().event(event);
            sent.map_err(|error| AnalysisError::Told { message: error.to_string() })?;
        }
        Ok(())
    }
}
