//! Steps of a [`Twin`]: divided where elements sample and where equations switch, of a fixed size or of one that follows from an
//! estimate of the error.

use crate::analysis::Group;
use crate::machine::Machine;
use crate::sampled::EARLY;
use crate::twin::{Failed, TRIALS, Twin, at_most};

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
            let before = self.state.clone();
            let mut taken = left;
            if is_controlled {
                taken = self.next_size(left);
                trials += 1;
                if trials > MOST_TRIALS {
                    return Err(Failed::StepTooSmall);
                }
            }
            self.linearise();
            let mut next = vec![0.0; before.len()];
            let advanced = self.advance(&before, taken, &mut next);
            match is_controlled {
                true => {
                    if let Judged::Again = self.judged(advanced, taken, &next)? {
                        continue;
                    }
                }
                false => advanced?,
            }
            if self.switches.is_some() {
                let first = self.switches(self.time[0], &before);
                let last = self.switches(self.time[0] + taken, &next);
                if changed(&first, &last) {
                    if splits < self.machine.located {
                        taken = self.locate(&before, &first, &last, taken, &mut next)?;
                        splits += 1;
                        self.located += 1;
                    } else {
                        self.passed += 1;
                    }
                } else if is_controlled {
                    splits = 0;
                }
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

    /// The shortest step known to end behind a switch, by false position with weights (the Illinois algorithm), a fixed number of
    /// trials.
    fn locate(&mut self, y: &[f64], first: &[f64], last: &[f64], whole: f64, next: &mut [f64]) -> Result<f64, Failed> {
        let (mut a, mut b) = (0.0, whole);
        let (mut low, mut high) = (first.to_vec(), last.to_vec());
        let (mut weight_low, mut weight_high) = (1.0, 1.0);
        let mut side = 0;
        let mut trial = vec![0.0; y.len()];
        for _ in 0..TRIALS {
            let mut share = 2.0;
            for k in 0..low.len() {
                if (first[k] < 0.0) != (high[k] < 0.0) {
                    let (u, v) = (weight_low * low[k], weight_high * high[k]);
                    let root = u / (u - v);
                    if root > 0.0 && root < share {
                        share = root;
                    }
                }
            }
            // Functions that jump, or are zero on one side, tell no place.
            if share > 1.0 {
                share = 0.5;
            }
            share = share.clamp(1e-3, 0.999);
            let x = a + (b - a) * share;
            self.advance(y, x, &mut trial)?;
            let found = self.switches(self.time[0] + x, &trial);
            if changed(first, &found) {
                b = x;
                high = found;
                next.copy_from_slice(&trial);
                weight_high = 1.0;
                if side == 1 {
                    weight_low *= 0.5;
                }
                side = 1;
            } else {
                a = x;
                low = found;
                weight_low = 1.0;
                if side == -1 {
                    weight_high *= 0.5;
                }
                side = -1;
            }
        }
        Ok(b)
    }
}

/// Whether a number is smaller than another; what is not a number never is.
fn below(a: f64, b: f64) -> bool {
    a < b
}

fn changed(first: &[f64], last: &[f64]) -> bool {
    first.iter().zip(last).any(|(a, b)| (*a < 0.0) != (*b < 0.0))
}
