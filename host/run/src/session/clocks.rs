//! [`Clocks`]: when elements sample.

use std::ops::Range;

use crate::model::Model;
use crate::plan::Layout;

/// Share of a period by which a step may end before a sampling instant and still be at it.
const EARLY: f64 = 1e-9;
/// The same as a share of the time: steps end at the number before the instant, and far from zero that is further away.
const BEFORE: f64 = 4.0 * f64::EPSILON;
/// Share of the time by which a jump and a whole multiple of a period that are meant to be the same may differ: 0.7 and 7 * 0.1.
const BEHIND: f64 = 4.0 * f64::EPSILON;

/// The elements that sample at the start and at whole multiples of their periods.
#[derive(Debug, Clone, Default)]
pub(super) struct Clocks {
    list: Vec<Clock>,
    /// The run continues another one.
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

impl Clock {
    /// The last multiple of the period that this time is at or after, or is only just before.
    fn count(&self, t: f64) -> f64 {
        ((t + self.early(t)) / self.period).floor()
    }

    /// Whether the next multiple is reached.
    fn is_due(&self, t: f64) -> bool {
        t >= self.next * self.period - self.early(t)
    }

    /// The multiple of the period that it samples at now, s, if it does.
    fn instant(&self, t: f64) -> Option<f64> {
        self.is_due(t).then(|| self.count(t) * self.period)
    }

    /// Time by which a step may end before a sampling instant and still be at it, s.
    fn early(&self, t: f64) -> f64 {
        (EARLY * self.period).max(BEFORE * t.abs())
    }
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

    /// When the first of them samples next, behind a time, s.
    pub(super) fn next_instant(&self, t: f64) -> f64 {
        let instants = self.list.iter().map(|clock| (clock.count(t) + 1.0) * clock.period);
        // Times so late that neighbouring multiples are the same number have none between them.
        instants.filter(|instant| *instant > t).fold(f64::INFINITY, f64::min)
    }

    /// Sets them to a time from which a run begins, where all of them are due; `carried`: they were sampled before.
    pub(super) fn set(&mut self, t: f64, carried: bool) {
        self.carried = carried;
        for clock in &mut self.list {
            clock.next = clock.count(t) + if carried { 1.0 } else { 0.0 };
        }
    }

    /// Whether what is due at the time that they are set to was sampled before.
    pub(super) fn are_carried(&self) -> bool {
        self.carried
    }

    /// The whole multiple of its period at which the element with these discrete states samples now, s, if it does.
    pub(super) fn instant(&self, memory: &Range<usize>, t: f64) -> Option<f64> {
        self.list.iter().find(|clock| clock.memory == *memory)?.instant(t)
    }

    /// When what is due at the end of a step looks at functions of time: just behind the sampling instant. A function that jumps there
    /// has done so, although steps end at the number before.
    pub(super) fn behind(&self, t: f64) -> f64 {
        let instants = self.list.iter().filter_map(|clock| clock.instant(t));
        instants.reduce(f64::max).map_or(t, |instant| instant.max(t) + BEHIND * t.abs())
    }

    /// Whether the element with these discrete states has sampled at this time, passed to [`Clocks::hold`].
    pub(super) fn has_sampled(&self, memory: &Range<usize>, t: f64) -> bool {
        let clock = self.list.iter().find(|clock| clock.memory == *memory);
        clock.is_some_and(|clock| (t - (clock.next - 1.0) * clock.period).abs() <= clock.early(t))
    }

    /// At the end of a step: what is to become of the discrete states, `new` after it and `old` before. Elements that do not sample
    /// now keep theirs.
    pub(super) fn hold(&mut self, t: f64, old: &[f64], new: &mut [f64]) {
        for clock in &mut self.list {
            if clock.is_due(t) {
                clock.next = clock.count(t) + 1.0;
            } else {
                new[clock.memory.clone()].copy_from_slice(&old[clock.memory.clone()]);
            }
        }
    }

    /// The discrete states of elements that sample at the time that the clocks are set to.
    pub(super) fn due(&self, t: f64) -> impl Iterator<Item = Range<usize>> {
        let due = self.list.iter().filter(move |clock| clock.is_due(t));
        due.map(|clock| clock.memory.clone())
    }
}

/// The whole multiples of periods next to a time: the largest that is not above it, the smallest above it and before `end`, where
/// steps end in any case.
pub(super) fn around(periods: &[f64], end: f64, t: f64) -> (f64, f64) {
    let mut found = (f64::NEG_INFINITY, f64::INFINITY);
    for period in periods {
        let mut k = (t / period).floor();
        // Times so late that neighbouring multiples are the same number have none between them.
        while k + 1.0 > k && (k + 1.0) * period <= t {
            k += 1.0;
        }
        while k - 1.0 < k && k * period > t {
            k -= 1.0;
        }
        found = (found.0.max(k * period), found.1.min((k + 1.0) * period));
    }
    if found.1 < end * (1.0 - f64::EPSILON) { found } else { (found.0, f64::INFINITY) }
}
