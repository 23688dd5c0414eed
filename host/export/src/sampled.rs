//! [`Sampled`]: memories that change at whole multiples of a period (digital controllers, stepping motors), and nowhere else.

use std::ops::Range;

use crate::analysis::Quantities;
use crate::model::Model;
use crate::plan::Layout;
use crate::twin::Twin;

/// Share of a period by which a sample may be early: in numbers of 64 bits, as in runs; of 32 bits.
pub(crate) const EARLY: [f64; 2] = [1e-9, 1e-3];

/// Share of the time by which functions are looked at behind a sampling instant, likewise.
pub(crate) const BEHIND: [f64; 2] = [4.0 * f64::EPSILON, 4.0 * f32::EPSILON as f64];

/// See the module documentation.
#[derive(Debug, Clone, Default)]
pub struct Sampled {
    /// The memories before the first sample.
    pub start: Vec<f64>,
    /// When which of them change.
    pub clocks: Vec<Clock>,
    /// All memories behind a sample.
    pub next: Option<Quantities>,
}

/// An element that samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Clock {
    /// s
    pub period: f64,
    /// Its memories among all; those of the next clock begin where they end.
    pub memory: Range<usize>,
}

impl Sampled {
    /// When the elements of a model sample.
    pub(crate) fn clocks_of(model: &Model, layout: &Layout) -> Vec<Clock> {
        let elements = model.elements.iter().enumerate();
        let clock = |(number, element): (usize, &crate::model::Instance)| {
            let (period, memory) = (element.recording.sample_period()?, layout.discrete_of(number));
            (!memory.is_empty()).then_some(Clock { period, memory })
        };
        elements.filter_map(clock).collect()
    }

    /// The most sampling instants at which a step of this size is divided, where steps begin at `start`, s: none where each instant
    /// is the end of a step.
    pub(crate) fn divisions(&self, step: f64, start: f64) -> usize {
        let whole = |number: f64| (number - number.round()).abs() <= 1e-9 * number.abs().max(1.0);
        let inside = |clock: &Clock| {
            let falls_at_ends = clock.period >= 0.5 * step && whole(clock.period / step) && whole(start / step);
            if falls_at_ends { 0 } else { most(step, clock.period) }
        };
        self.clocks.iter().map(inside).sum()
    }

    /// The most sampling instants in a step of this size, s.
    pub(crate) fn instants(&self, step: f64) -> usize {
        self.clocks.iter().map(|clock| most(step, clock.period)).sum()
    }
}

fn most(step: f64, period: f64) -> usize {
    (step / period - EARLY[0]).ceil().max(1.0) as usize
}

impl Twin {
    /// To the memories before the first sample; what is due samples.
    pub(crate) fn begin_samples(&mut self) {
        let sampled = &self.machine.sampled;
        self.memory.copy_from_slice(&sampled.start);
        for clock in 0..sampled.clocks.len() {
            self.next_samples[clock] = self.count(clock);
        }
        self.sample();
    }

    /// Which multiple of its period a clock is at.
    fn count(&self, clock: usize) -> f64 {
        (self.time[0] / self.machine.sampled.clocks[clock].period + EARLY[0]).floor()
    }

    fn is_due(&self, clock: usize) -> bool {
        self.time[0] >= (self.next_samples[clock] - EARLY[0]) * self.machine.sampled.clocks[clock].period
    }

    /// What is due samples; whether something was.
    pub(crate) fn sample(&mut self) -> bool {
        let clocks = self.next_samples.len();
        let due = (0..clocks).filter(|clock| self.is_due(*clock));
        let instants = due.map(|clock| self.count(clock) * self.machine.sampled.clocks[clock].period);
        let Some(instant) = instants.reduce(f64::max) else { return false };
        // Behind the instant: a function of time that jumps there has done so.
        let behind = instant.max(self.time[0]) + BEHIND[0] * self.time[0].abs();
        let state = self.state.clone();
        self.solve_for(behind, &state, self.samples.as_ref().is_some_and(|run| run.solved));
        self.load(behind, &state);
        let found = self.samples.as_mut().map(|run| run.at(&self.given).to_vec()).unwrap_or_default();
        for clock in 0..clocks {
            if self.is_due(clock) {
                let memory = self.machine.sampled.clocks[clock].memory.clone();
                let after = self.count(clock) + 1.0;
                let next = self.next_samples[clock] + 1.0;
                // Far from zero the quotient is not known to a whole number.
                self.next_samples[clock] = if after > next { after } else { next };
                self.memory[memory.clone()].copy_from_slice(&found[memory]);
            }
        }
        true
    }

    /// Time until something samples next, s; infinite where nothing does.
    pub(crate) fn until_sample(&self) -> f64 {
        let mut least = f64::INFINITY;
        for (next, clock) in self.next_samples.iter().zip(&self.machine.sampled.clocks) {
            let until = next * clock.period - self.time[0];
            if until < least {
                least = until;
            }
        }
        least
    }
}
