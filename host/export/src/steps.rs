//! Steps of a [`Twin`]: divided where elements sample and where equations switch, of a fixed size or of one that follows from an
//! estimate of the error.

use crate::analysis::Group;
use crate::machine::Machine;
use crate::sampled::EARLY;
use crate::twin::{Failed, TRIALS, Twin, WIDTH, at_most};

/// The most trials to get over a stretch of time by steps of variable size.
pub(crate) const MOST_TRIALS: usize = 1_000_000;
/// The shortest step, as a share of the longest.
pub(crate) const LEAST: f64 = 1e-10;
/// The least size of an element's state that errors are measured by, SI.
const SMALLEST: f64 = 1e-6;

/// Sizes that errors are measured by.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sizes {
    /// By entry of the state, which of the sizes; none: its errors do not matter.
    pub(crate) of: Vec<Option<usize>>,
    /// At the least; those from [`Sizes::FIXED`] on grow with what is seen.
    pub(crate) least: Vec<f64>,
}

impl Sizes {
    /// Of lengths and angles; all speeds, all angular velocities and each state of an element have their own.
    pub(crate) const FIXED: usize = 2;

    pub(crate) fn of(machine: &Machine) -> Self {
        let (length, duration) = (machine.portable.length, machine.t_end - machine.t_start);
        let mut sizes = Self { of: Vec::new(), least: vec![length, 1.0, length / duration, 1.0 / duration] };
        for group in &machine.portable.groups {
            sizes.of.push(match group {
                Group::Position => Some(0),
                Group::Parameter => Some(1),
                Group::Velocity => Some(2),
                Group::AngularVelocity => Some(3),
                Group::State => {
                    sizes.least.push(SMALLEST);
                    Some(sizes.least.len() - 1)
                }
                // Nothing depends on it.
                Group::Work => None,
            });
        }
        sizes
    }

    /// Takes the sizes of a state.
    pub(crate) fn grow(&mut self, state: &[f64]) {
        for (size, value) in self.of.iter().zip(state) {
            if let Some(size) = size.filter(|size| *size >= Self::FIXED && value.abs() > self.least[*size]) {
                self.least[size] = value.abs();
            }
        }
    }
}

impl Machine {
    /// By entry of the state, the size that absolute tolerances are shares of, SI.
    pub(crate) fn nominals(&self) -> Vec<f64> {
        let mut sizes = Sizes::of(self);
        sizes.grow(&self.state);
        sizes.of.iter().map(|size| size.map_or(1.0, |size| sizes.least[size])).collect()
    }
}

/// What chooses the sizes of steps.
#[derive(Debug, Clone, Default)]
pub(crate) struct Control {
    sizes: Sizes,
    /// Of the next step, s; zero: not known yet.
    step_size: f64,
    rejected: usize,
}

impl Control {
    pub(crate) fn of(machine: &Machine) -> Self {
        if machine.tolerance.is_none() {
            return Self::default();
        }
        let mut sizes = Sizes::of(machine);
        sizes.grow(&machine.state);
        Self { sizes, ..Self::default() }
    }
}

enum Judged {
    Taken,
    Again,
}

impl Twin {
    /// A step of size `h`, s. Where equations switch and where elements sample, it is divided.
    ///
    /// # Errors
    /// [`Failed`]; state and time are as they were at the last place that was reached.
    pub fn step(&mut self, h: f64) -> Result<(), Failed> {
        if self.next_samples.is_empty() {
            return self.stretch(h);
        }
        if !self.begun {
            self.begin_samples();
            self.begun = true;
        }
        let mut left = h;
        loop {
            self.sample();
            let part = self.until_sample();
            if !below(part, left * (1.0 - EARLY[0])) {
                return self.stretch(left);
            }
            self.stretch(part)?;
            left -= part;
        }
    }

    /// Time in which nothing samples.
    fn stretch(&mut self, h: f64) -> Result<(), Failed> {
        let mut left = h;
        let mut splits = 0;
        let mut trials = 0;
        let is_controlled = self.machine.tolerance.is_some();
        loop {
            let start = self.state.clone();
            let mut taken = left;
            if is_controlled {
                taken = self.next_size(left);
                trials += 1;
                if trials > MOST_TRIALS {
                    return Err(Failed::StepTooSmall);
                }
            }
            self.linearise();
            if self.switches.is_some() {
                self.first = self.switches(self.time[0], &start);
            }
            let mut next = vec![0.0; start.len()];
            let advanced = self.advance(&start, taken, &mut next);
            match is_controlled {
                true => {
                    if let Judged::Again = self.judged(advanced, taken, &next)? {
                        continue;
                    }
                }
                false => advanced?,
            }
            if self.has_switched(self.time[0] + taken, &next) {
                if splits < self.machine.located {
                    let [before, across] = self.locate(&start, taken, &mut next)?;
                    if before > 0.0 {
                        self.accept(before, &next)?;
                        left -= before;
                    }
                    // From there over the switch, by so little that it does not matter which of the stages lie behind it.
                    let across = 2.0 * across + WIDTH[0] * taken;
                    taken = if across < left { across } else { left };
                    self.linearise();
                    let start = self.state.clone();
                    self.first = self.switches(self.time[0], &start);
                    self.advance(&start, taken, &mut next)?;
                    splits += 1;
                    self.located += 1;
                } else {
                    self.passed += 1;
                }
            } else if is_controlled {
                splits = 0;
            }
            self.accept(taken, &next)?;
            if is_controlled {
                self.control.sizes.grow(&next);
            }
            if taken >= left {
                return Ok(());
            }
            left -= taken;
        }
    }

    /// Size of a step where so much time is left, s: none longer than that of the machine, none that turns a counted angle by more
    /// than 1 rad, and no tiny one at the end.
    fn next_size(&mut self, left: f64) -> f64 {
        let mut h = self.control.step_size;
        if !(h > 0.0 && h <= self.machine.step) {
            h = self.machine.step;
        }
        let rate = self.follow();
        if rate * h > 1.0 {
            h = 1.0 / rate;
        }
        match left {
            left if left <= h => left,
            left if left < 2.0 * h => 0.5 * left,
            _ => h,
        }
    }

    /// Judges a step by the difference from the embedded solution.
    fn judged(&mut self, advanced: Result<(), Failed>, h: f64, next: &[f64]) -> Result<Judged, Failed> {
        let n = next.len();
        let (mut share, mut factor) = (0.0, 0.25);
        let mut last = vec![0.0; n];
        let found = advanced.and_then(|()| self.rates(self.time[0] + h, next, &mut last));
        if found.is_ok() {
            let error = self.machine.method.error;
            let stages = self.slopes.len();
            let tolerance = self.machine.tolerance.unwrap_or(1.0);
            for i in 0..n {
                let Some(number) = self.control.sizes.of[i] else { continue };
                let mut sum = 0.0;
                for (weight, slope) in error.iter().zip(&self.slopes) {
                    sum += weight * slope[i];
                }
                sum += error[stages] * last[i];
                let mut size = self.control.sizes.least[number];
                if number >= Sizes::FIXED {
                    size = if self.state[i].abs() > size { self.state[i].abs() } else { size };
                    size = if next[i].abs() > size { next[i].abs() } else { size };
                }
                let part = (h * sum).abs() / (tolerance * size);
                if !at_most(part, share) {
                    share = part;
                }
            }
            // share^(-3/16), by roots that are exact everywhere
            let eighth = share.sqrt().sqrt().sqrt();
            factor = 0.9 / (eighth * eighth.sqrt());
            if !at_most(0.2, factor) {
                factor = 0.2;
            }
            if factor > 5.0 {
                factor = 5.0;
            }
        }
        let control = &mut self.control;
        if found.is_ok() && share <= 1.0 {
            let next = h * factor;
            // A step that was cut does not shorten those that follow.
            if next > control.step_size || !below(h, control.step_size) {
                control.step_size = next;
            }
            return Ok(Judged::Taken);
        }
        control.rejected += 1;
        control.step_size = h * factor;
        if !below(LEAST * self.machine.step, control.step_size) {
            return Err(found.err().unwrap_or(Failed::StepTooSmall));
        }
        Ok(Judged::Again)
    }

    /// Trials that were rejected.
    #[must_use]
    pub fn rejected(&self) -> usize {
        self.control.rejected
    }

    /// Whether something switched in the step that was made last, at its end or in a stage.
    fn has_switched(&mut self, t: f64, y: &[f64]) -> bool {
        self.reach(t, y);
        self.first.iter().zip(&self.last).any(|(a, b)| (*a < 0.0) != (*b < 0.0))
    }

    /// The longest step known to lie before a switch, and its end in `next`; and what is left of the shortest that is known not to, by a
    /// fixed number of trials. What lies behind a switch may be far from what the equations before it give, so that places are
    /// extrapolated from before it as soon as two are known there; until then by false position with weights (the Illinois algorithm).
    fn locate(&mut self, y: &[f64], whole: f64, next: &mut [f64]) -> Result<[f64; 2], Failed> {
        let (mut a, mut b, mut earlier, mut weight) = (0.0, whole, 0.0, 1.0);
        let first = self.first.clone();
        let (mut lower, mut low, mut high) = (first.clone(), first.clone(), self.last.clone());
        let mut known = 1;
        let mut trial = vec![0.0; y.len()];
        for _ in 0..TRIALS {
            let mut share = 2.0;
            for k in 0..low.len() {
                if (first[k] < 0.0) != (high[k] < 0.0) {
                    let (u, v) = if known > 1 {
                        (low[k] * (a - earlier), (lower[k] - low[k]) * (b - a))
                    } else {
                        (weight * low[k], weight * low[k] - high[k])
                    };
                    let root = u / v;
                    if root > 0.0 && root < share {
                        share = root;
                    }
                }
            }
            // Functions that jump, or are zero on one side, tell no place.
            if share > 1.001 {
                share = 0.5;
            }
            share = share.clamp(1e-3, 0.999);
            let x = a + (b - a) * share;
            self.advance(y, x, &mut trial)?;
            if self.has_switched(self.time[0] + x, &trial) {
                b = x;
                high.clone_from(&self.last);
                weight *= 0.5;
            } else {
                earlier = a;
                a = x;
                lower.clone_from(&low);
                low.clone_from(&self.last);
                next.copy_from_slice(&trial);
                known += 1;
            }
        }
        Ok([a, b - a])
    }
}

/// Whether a number is smaller than another; what is not a number never is.
fn below(a: f64, b: f64) -> bool {
    a < b
}
