//! [`Leg`]: a part of a run, from one time to another.

use std::sync::atomic::{AtomicBool, Ordering};

use super::checkpoint::Carried;
use super::error::SessionError;
use super::opened::Session;
use super::restart::Restart;
use super::samplings::Samplings;
use super::sink::Sink;
use crate::integrate::Flow;
use crate::results::{Event, Summary};

/// A part of a run, from where its session begins.
pub(super) struct Leg {
    /// Its end, s.
    pub(super) to: f64,
    /// Number of its first sample.
    pub(super) first_sample: usize,
    /// What is left by the leg before it.
    pub(super) carried: Option<Carried>,
}

/// Those who hear of a run while it is under way.
pub(super) struct Told<'t> {
    /// Takes the rows.
    pub(super) samplings: &'t mut Samplings,
    /// Start and end of the whole run, s.
    pub(super) span: [f64; 2],
    /// Told the share of it that is done, 0 to 1.
    pub(super) progress: &'t mut (dyn FnMut(f64) + Send),
    /// Ends the run after the step under way.
    pub(super) stop: &'t AtomicBool,
}

/// How a leg ended.
pub(super) struct LegEnd {
    pub(super) session: Session,
    pub(super) summary: Summary,
    pub(super) failed: Option<SessionError>,
    /// The state there, or why there is none.
    pub(super) state: Result<Restart, String>,
    /// What another leg takes over besides; nothing where islands are apart.
    pub(super) carried: Option<Carried>,
    /// The islands with what they did, where these are apart.
    pub(super) islands: Vec<(Session, Summary)>,
}

impl Told<'_> {
    /// The same for a while.
    pub(super) fn lent(&mut self) -> Told<'_> {
        Told { samplings: self.samplings, span: self.span, progress: self.progress, stop: self.stop }
    }

    /// The share of the run that is done.
    pub(super) fn share(&self, t: f64) -> f64 {
        let [from, to] = self.span;
        (t - from) / (to - from)
    }

    /// Whether to continue.
    pub(super) fn flow(&self) -> Flow {
        if self.stop.load(Ordering::Relaxed) { Flow::Stop } else { Flow::Continue }
    }
}

impl Sink for &mut Told<'_> {
    fn sample(&mut self, number: usize, values: &[f64]) -> std::io::Result<()> {
        self.samplings.take(number, values)
    }

    fn takes_pictures(&self) -> bool {
        self.samplings.takes_pictures()
    }

    fn picture(&mut self, number: usize, values: &[f64]) -> std::io::Result<()> {
        self.samplings.picture(number, values)
    }

    fn event(&mut self, event: &Event) -> std::io::Result<()> {
        self.samplings.event(event)
    }

    fn step(&mut self, t: f64) -> Flow {
        let share = self.share(t);
        (self.progress)(share);
        self.flow()
    }
}
