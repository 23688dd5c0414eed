//! [`Clocks`]: when elements sample.

use std::ops::Range;

use crate::model::Model;
use crate::plan::Layout;

/// Share of a period by which a step may end before a sampling instant and still be at it.
const EARLY: f64 = 1e-9;

/// The elements that sample at whole multiples of their periods.
#[derive(Debug, Clone, Default)]
pub(super) struct Clocks {
    list: Vec<Clock>,
    /// The run continues from another one.
    carried: bool,
}

#[derive(Debug, Clone)]
struct Clock {
    /// s
    period: f64,
    /// The discrete states of the element, among all.
    memory: Range<usize>,
    /// Which multiple of the period is next.
    next: f64,
}

impl Clocks {
    /// Those of a model.
    pub(super) fn of(model: &Model, layout: &Layout) -> Self {
        let elements = model.elements.iter().enumerate();
        let list = elements.filter_map(|(number, element)| {
            let period = element.recording.sample_period()?;
            let first = layout.discrete_at[number];
            let memory = first..first + element.recording.initial_discrete.len();
            Some(Clock { period, memory, next: 0.0 })
        });
        Self { list: list.collect(), carried: false }
    }

    /// Their periods, s.
    pub(super) fn periods(&self) -> impl Iterator<Item = f64> {
        self.list.iter().map(|clock| clock.period)
    }

    /// Sets them to a time from which a run begins; `carried`: what is due at that time was sampled before.
    pub(super) fn set(&mut self, t: f64, carried: bool) {
        self.carried = carried;
        for clock in &mut self.list {
            let periods = t / clock.period;
            clock.next = if carried { (periods + EARLY).floor() + 1.0 } else { (periods - EARLY).ceil() };
        }
    }

    /// Whether what is due at the time that they are set to was sampled before.
    pub(super) fn are_carried(&self) -> bool {
        self.carried
    }

    /// The whole multiple of its period at which the element with these discrete states samples now, s, if it does.
    pub(super) fn instant(&self, memory: &Range<usize>, t: f64) -> Option<f64> {
        let clock = self.list.iter().find(|clock| clock.memory == *memory)?;
        (t >= (clock.next - EARLY) * clock.period).then(|| (t / clock.period + EARLY).floor() * clock.period)
    }

    /// Whether the element with these discrete states has sampled at this time, which was given to [`Clocks::hold`].
    pub(super) fn has_sampled(&self, memory: &Range<usize>, t: f64) -> bool {
        let clock = self.list.iter().find(|clock| clock.memory == *memory);
        clock.is_some_and(|clock| (t - (clock.next - 1.0) * clock.period).abs() <= EARLY * clock.period)
    }

    /// At the end of a step: what is to become of the discrete states, `new` after it and `old` before. Elements that do not sample
    /// now keep theirs.
    pub(super) fn hold(&mut self, t: f64, old: &[f64], new: &mut [f64]) {
        for clock in &mut self.list {
            if t >= (clock.next - EARLY) * clock.period {
                clock.next = (t / clock.period + EARLY).floor() + 1.0;
            } else {
                new[clock.memory.clone()].copy_from_slice(&old[clock.memory.clone()]);
            }
        }
    }

    /// The discrete states of elements that sample at the time that the clocks are set to.
    pub(super) fn due(&self, t: f64) -> impl Iterator<Item = Range<usize>> {
        let due = self.list.iter().filter(move |clock| t >= (clock.next - EARLY) * clock.period);
        due.map(|clock| clock.memory.clone())
    }
}

/// The whole multiples of periods next to a time: the largest that is not above it, the smallest above it and before `end`, where
/// steps end in any case.
pub(super) fn around(periods: &[f64], end: f64, t: f64) -> (f64, f64) {
    let mut found = (f64::NEG_INFINITY, f64::INFINITY);
    for period in periods {
        let mut k = (t / period).floor();
        while (k + 1.0) * period <= t {
            k += 1.0;
        }
        while k * period > t {
            k -= 1.0;
        }
        found = (found.0.max(k * period), found.1.min((k + 1.0) * period));
    }
    if found.1 < end * (1.0 - f64::EPSILON) { found } else { (found.0, f64::INFINITY) }
}
