//! Contacts whose reactions rigid bodies do not determine, during a run: events that say so.

use super::Simulation;
use crate::analysis::{AnalysisError, Holder, Indeterminate};
use crate::results::{Event, EventKind};

/// What is reported: components of the force, ground directions; the torque; that the motion depends on it.
const WORDS: [&str; 5] = ["force x", "force y", "force z", "torque", ""];

impl Simulation<'_> {
    /// Tells what is open from here on, once of each; `touching`: the contacts that the places of `open` are among.
    pub(super) fn report_indeterminate(
        &mut self,
        t: f64,
        touching: &[usize],
        open: &Indeterminate,
    ) -> Result<(), AnalysisError> {
        let Some(touch) = &mut self.touch else { return Ok(()) };
        let (first, joints) = (touch.first_friction(), touch.names.len());
        let mut news: Vec<usize> = Vec::new();
        let number = |holder: &Holder| match holder {
            Holder::Contact(place) => touching[*place],
            Holder::Friction(number) => first + number,
            Holder::Row(row) => joints + self.layout.element_of_row(*row).0,
        };
        for (holder, parts) in &open.loads {
            let k = number(holder);
            news.extend((0..parts.len()).filter(|part| parts[*part]).map(|part| k * WORDS.len() + part));
        }
        news.extend(open.moving.iter().map(|holder| number(holder) * WORDS.len() + WORDS.len() - 1));
        news.sort_unstable();
        news.dedup();
        news.retain(|one| !touch.open_loads.contains(one));
        let event = |code: &usize| {
            let (k, part) = (code / WORDS.len(), code % WORDS.len());
            match WORDS[part] {
                "" => touch.event(t, EventKind::Ambiguous, k),
                word => Event { row: word.into(), ..touch.event(t, EventKind::Indeterminate, k) },
            }
        };
        let events: Vec<Event> = news.iter().map(event).collect();
        touch.open_loads.append(&mut news);
        self.send(&events)
    }

    /// What was reported of it.
    pub(in crate::session) fn open_loads(&self) -> &[usize] {
        self.touch.as_ref().map_or(&[], |touch| &touch.open_loads)
    }

    /// What was reported where the run was left.
    pub(in crate::session) fn open_loads_were(&mut self, told: &[usize]) {
        if let Some(touch) = &mut self.touch {
            touch.open_loads = told.to_vec();
        }
    }

    /// Gives events to whoever takes the results.
    pub(super) fn send(&mut self, events: &[Event]) -> Result<(), AnalysisError> {
        for event in events {
            let sent = self.rows_taken.sink().event(event);
            sent.map_err(|error| AnalysisError::Told { message: error.to_string() })?;
            self.events += 1;
        }
        Ok(())
    }
}
