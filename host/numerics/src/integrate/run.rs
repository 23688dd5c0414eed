//! What all methods share: checks, counting, sampling, and the protocol at the end of a step.

use super::fill::Work;
use super::{
    Accepted, Counters, Entries, Failure, Flow, IntegrateError, Options, Outcome, Span, Status, StopReason, System,
    Watched,
};

/// A stretch longer than the step by this much is taken as one step.
const LAST_STEP_STRETCH: f64 = 1.01;

/// A step this many times the spacing of floating-point times is too small.
const SMALLEST_STEP: f64 = 10.0 * f64::EPSILON;
/// Share of the interval below which no step is begun with.
const LEAST_FIRST_STEP: f64 = 1e-10;
/// Share of a number by which its first 15 digits may be off.
const FIFTEEN_DIGITS: f64 = 5e-15;
/// Share of the interval below which a step is short enough for sums: where a motion begins, or is none but for round-off, all of a
/// sum is that of a step, and none would be short enough to know it well.
const SHORT_FOR_SUMS: f64 = 1e-3;

/// How many times as much time the first half of all steps took as the second, where steps have become tiny.
const CREEPING: f64 = 100.0;

/// A run in progress: the system, and the bookkeeping around it. Methods call the system through it where it has a way to,
/// so that work is counted and failures are distinguished the same way everywhere.
pub struct Run<'a> {
    /// What is integrated.
    pub system: &'a mut dyn System,
    /// As given.
    pub options: &'a Options,
    /// As given.
    pub span: &'a Span<'a>,
    /// Work done so far.
    pub counters: Counters,
    /// Time of the last accepted state.
    pub t: f64,
    /// What all matrices of an implicit step take, once they are known.
    pub(super) matrices: Option<Work>,
    /// What they have taken so far.
    pub(super) matrix_work: f64,
    /// Number of samples taken so far.
    next_sample: usize,
    /// The earliest time at which a state cannot be, as far as known.
    barrier: Option<f64>,
    /// The time at which half of all steps that are allowed were used up.
    half_way: Option<f64>,
    /// Of the step that is about to become final, the integral of [`System::rate_summed`] and its difference to that of a rule of lower
    /// order, as far as the method gives them.
    summed: Option<[f64; 2]>,
    /// Equal steps that are under way.
    equal: Option<Equal>,
}

/// Equal steps from one time to another: their number, and that of those that were begun.
#[derive(Debug, Clone, Copy)]
struct Equal {
    from: f64,
    to: f64,
    count: usize,
    begun: usize,
}

/// Nodes of Gauss's rule of degree 5 in 0..1, their weights, and what these differ by from those of the midpoint alone.
const GAUSS: [[f64; 3]; 3] = [
    [0.112_701_665_379_258_3, 5.0 / 18.0, 5.0 / 18.0],
    [0.5, 4.0 / 9.0, -5.0 / 9.0],
    [0.887_298_334_620_741_7, 5.0 / 18.0, 5.0 / 18.0],
];

/// How a step that was tried may end, other than well.
pub enum Trouble {
    /// Smaller steps may help; the reason why the run stops if they cannot.
    Retry(StopReason),
    /// The step had better end at this time, which lies inside it: a sample wanted there.
    EndAt(f64),
    /// The run ends with an outcome.
    Stop(StopReason),
    /// The run ends with an error.
    Abort(IntegrateError),
}

impl<'a> Run<'a> {
    /// [`System::sums_norm`] of a step of size `h`, unless it is short enough in any case.
    pub(super) fn sums_norm(&mut self, y0: &[f64], y1: &[f64], error: &[f64], h: f64) -> f64 {
        let short = SHORT_FOR_SUMS * (self.span.t_end - self.span.t_start);
        if h > short { self.system.sums_norm(y0, y1, error) } else { 0.0 }
    }

    /// Checks everything that a caller may have got wrong.
    ///
    /// # Errors
    /// [`IntegrateError::Invalid`].
    pub(super) fn new(
        system: &'a mut dyn System,
        y: &[f64],
        span: &'a Span<'a>,
        options: &'a Options,
    ) -> Result<Self, IntegrateError> {
        if let Some(fault) = fault_of(system.dim(), y, span, options) {
            return Err(IntegrateError::Invalid(fault));
        }
        Ok(Self {
            system,
            options,
            span,
            counters: Counters::default(),
            t: span.t_start,
            matrices: None,
            matrix_work: 0.0,
            next_sample: 0,
            half_way: None,
            barrier: None,
            summed: None,
            equal: None,
        })
    }

    /// Ends the run, well or in trouble.
    ///
    /// # Errors
    /// The error of [`Trouble::Abort`].
    pub(super) fn end(self, result: Result<(), Trouble>) -> Result<Outcome, IntegrateError> {
        let reason = match result {
            Ok(()) => return Ok(Outcome { status: Status::Completed, counters: self.counters }),
            Err(Trouble::Retry(reason) | Trouble::Stop(reason)) => reason,
            Err(Trouble::EndAt(_)) => StopReason::StepTooSmall { step: 0.0 },
            Err(Trouble::Abort(error)) => return Err(error),
        };
        Ok(Outcome { status: Status::StoppedEarly { t: self.t, reason }, counters: self.counters })
    }

    /// `f(t, y)` within a step of size `h`; `h` is zero at an accepted state.
    ///
    /// # Errors
    /// [`Trouble`], as the system says.
    pub fn rhs(&mut self, t: f64, y: &[f64], dy: &mut [f64], h: f64) -> Result<(), Trouble> {
        self.counters.evaluations += 1;
        self.system.rhs(t, y, dy).map_err(|failure| trouble_of(failure, t, h))
    }

    /// `f(t, y)` at the last accepted state, from which steps are to start.
    ///
    /// # Errors
    /// [`Trouble`], as the system says; [`Trouble::Stop`] where an entry is not finite.
    pub fn start_rates(&mut self, y: &[f64], dy: &mut [f64]) -> Result<(), Trouble> {
        self.rhs(self.t, y, dy, 0.0)?;
        if all_finite(dy) { Ok(()) } else { Err(Trouble::Stop(StopReason::NotFinite { step: 0.0 })) }
    }

    /// Brings the new state of a step of size `h` back to its manifold.
    ///
    /// # Errors
    /// [`Trouble`], as the system says.
    pub fn project(&mut self, t: f64, y: &mut [f64], h: f64) -> Result<(), Trouble> {
        self.counters.projections += 1;
        let result = self.system.project(t, y);
        let is_barrier = self.barrier == Some(t);
        match result {
            Ok(()) => {
                self.barrier = self.barrier.filter(|_| !is_barrier);
                Ok(())
            }
            // Seen again, by other steps: there is no way beyond.
            Err(Failure::Forbidden(cause)) if is_barrier => {
                Err(Trouble::Stop(StopReason::Failed { step: h, not_finite: false, cause }))
            }
            Err(failure) => {
                if matches!(failure, Failure::Forbidden(_)) {
                    self.barrier = Some(self.barrier.map_or(t, |barrier| barrier.min(t)));
                }
                Err(trouble_of(failure, t, h))
            }
        }
    }

    /// A step's end, not beyond a time at which no state can be.
    pub(super) fn before_barrier(&self, t_new: f64) -> f64 {
        self.barrier.filter(|barrier| *barrier > self.t).map_or(t_new, |barrier| barrier.min(t_new))
    }

    /// Takes the samples at the start.
    ///
    /// # Errors
    /// [`Trouble`], as the system says.
    pub fn sample_start(&mut self, y: &[f64]) -> Result<(), Trouble> {
        while self.pending_sample() == Some(self.t) {
            self.sample(self.t, y)?;
        }
        Ok(())
    }

    /// The next sample wanted before `t`, not at it.
    pub fn sample_before(&self, t: f64) -> Option<f64> {
        self.pending_sample().filter(|time| *time < t)
    }

    /// The latest time that is the same as `t` but for round-off, of times that are given by their first 15 digits as well.
    fn same_time(&self, t: f64) -> f64 {
        (t + self.smallest_step().max(FIFTEEN_DIGITS * t.abs())).min(self.span.t_end)
    }

    /// The first sample wanted after `from` and before `to`, not at them.
    pub fn sample_between(&self, from: f64, to: f64) -> Option<f64> {
        let wanted = &self.span.sample_times[self.next_sample..];
        wanted.iter().copied().find(|time| *time > from).filter(|time| *time < to)
    }

    /// `f_y(t, y)` at an accepted state, column by column, if the system offers it.
    ///
    /// # Errors
    /// [`Trouble`], as the system says.
    pub fn jacobian(&mut self, t: f64, y: &[f64], found: Entries<'_>) -> Result<bool, Trouble> {
        self.system.jacobian(t, y, found).map_err(|failure| trouble_of(failure, t, 0.0))
    }

    /// The values of all conditions; false where they are not to be had, or not finite.
    ///
    /// # Errors
    /// [`Trouble::Abort`], where the system can't continue at all.
    pub fn switching(&mut self, t: f64, y: &[f64], values: &mut [f64]) -> Result<bool, Trouble> {
        match self.system.switching(t, y, values) {
            Ok(()) => Ok(all_finite(values)),
            Err(failure @ Failure::Fatal(_)) => Err(trouble_of(failure, t, 0.0)),
            Err(_) => Ok(false),
        }
    }

    /// The same at a state inside a step, brought back to the manifold.
    ///
    /// # Errors
    /// As [`Run::switching`].
    pub fn switching_inside(&mut self, t: f64, y: &mut [f64], values: &mut [f64]) -> Result<bool, Trouble> {
        match self.system.bring_back(t, y) {
            Ok(()) => self.switching(t, y, values),
            Err(failure @ Failure::Fatal(_)) => Err(trouble_of(failure, t, 0.0)),
            Err(_) => Ok(false),
        }
    }

    /// The values of all quantities that must not become negative.
    ///
    /// # Errors
    /// [`Trouble`], as the system says.
    pub fn stopping(&mut self, t: f64, y: &[f64], values: &mut [f64]) -> Result<(), Trouble> {
        self.system.stopping(t, y, values).map_err(|failure| trouble_of(failure, t, 0.0))
    }

    /// The values of all guards; false where they are not to be had.
    ///
    /// # Errors
    /// [`Trouble::Abort`], where the system can't continue at all.
    pub fn look(&mut self, of: Watched, t: f64, y: &[f64], values: &mut [f64]) -> Result<bool, Trouble> {
        match self.system.look(of, t, y, values) {
            Ok(()) => Ok(all_finite(values)),
            Err(failure @ Failure::Fatal(_)) => Err(trouble_of(failure, t, 0.0)),
            Err(_) => Ok(false),
        }
    }

    /// Finishes the step from the last accepted state to `t`, `y`: samples, `accept`,
    /// `step_done`. `interpolate` writes the state at a time inside the step.
    ///
    /// # Errors
    /// [`Trouble`]; never one that a smaller step would help against.
    pub fn finish_step(
        &mut self,
        t: f64,
        y: &mut [f64],
        scratch: &mut [f64],
        mut interpolate: impl FnMut(f64, &mut [f64]),
    ) -> Result<Accepted, Trouble> {
        self.sum_up(t - self.t, scratch, &mut interpolate)?;
        // A sample that is later by no more than round-off of time is taken here: no step could lead there.
        let last = self.same_time(t);
        while let Some(time) = self.pending_sample().filter(|&time| time <= last) {
            if time < t {
                interpolate(time, scratch);
                self.sample(time, scratch)?;
            } else {
                self.sample(time, y)?;
            }
        }
        let h = t - self.t;
        self.counters.h_min = if self.counters.steps == 0 { h } else { self.counters.h_min.min(h) };
        self.counters.h_max = self.counters.h_max.max(h);
        self.counters.steps += 1;
        self.t = t;
        let accepted = self.system.accept(t, y).map_err(|failure| final_trouble_of(failure, t))?;
        match self.system.step_done(t, y, h) {
            // Nothing is left to stop at the end.
            Flow::Stop if t < self.span.t_end => Err(Trouble::Stop(StopReason::Requested)),
            _ => Ok(accepted),
        }
    }

    /// Takes a node of the rule by which a method integrates over the step that is about to become final, of size `h`: its time, the state
    /// there, and its weights in the integral and in the difference to a rule of lower order, as shares of the step. See
    /// [`System::sums_up`].
    ///
    /// # Errors
    /// [`Trouble`], as the system says; never one that a smaller step would help against.
    pub(super) fn add_node(&mut self, t: f64, y: &[f64], h: f64, weights: [f64; 2]) -> Result<(), Trouble> {
        let rate = self.system.rate_summed(t, y).map_err(|failure| final_trouble_of(failure, t))?;
        let summed = self.summed.get_or_insert_default();
        summed.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += h * weight * rate);
        Ok(())
    }

    /// Nothing is summed up over the step that is about to become final.
    pub(super) fn add_nothing(&mut self) {
        self.summed = Some([0.0; 2]);
    }

    /// Ends the sum over a step from the last accepted state; by the interpolation, where the method gave no nodes of its own.
    fn sum_up(
        &mut self,
        h: f64,
        scratch: &mut [f64],
        mut interpolate: impl FnMut(f64, &mut [f64]),
    ) -> Result<(), Trouble> {
        if !self.system.sums_up() {
            return Ok(());
        }
        if self.summed.is_none() {
            for [share, weight, difference] in GAUSS {
                let time = self.t + share * h;
                interpolate(time, scratch);
                self.add_node(time, scratch, h, [weight, difference])?;
            }
        }
        let [integral, difference] = self.summed.take().unwrap_or_default();
        self.system.sum_up(integral, difference);
        Ok(())
    }

    /// Counts a step that was not accepted.
    pub fn reject(&mut self, reason: &StopReason) {
        self.counters.rejected += 1;
        match reason {
            StopReason::Failed { not_finite: false, .. } => self.counters.recoveries.smaller_step += 1,
            StopReason::Failed { .. } | StopReason::NotFinite { .. } => self.counters.recoveries.not_finite += 1,
            StopReason::NoConvergence { .. } => self.counters.recoveries.no_convergence += 1,
            _ => {}
        }
    }

    /// Fails when the limit of steps is used up.
    ///
    /// # Errors
    /// [`Trouble::Stop`].
    pub fn check_step_limit(&mut self) -> Result<(), Trouble> {
        let limit = self.options.max_steps;
        let taken = self.options.steps_before + self.counters.steps + self.counters.rejected;
        if taken < limit / 2 {
            return Ok(());
        }
        let half_way = *self.half_way.get_or_insert(self.t);
        if taken < limit {
            return Ok(());
        }
        let (before, since) = (half_way - self.span.t_start, self.t - half_way);
        let crept = (before > CREEPING * since).then_some(since);
        Err(Trouble::Stop(StopReason::StepLimit { limit, crept }))
    }

    /// End of a step of about `h` from here: `t_end` if that is near, half the way if less than
    /// two steps are left, so that no tiny step remains.
    pub fn step_end(&self, h: f64) -> f64 {
        let left = self.span.t_end - self.t;
        if left <= LAST_STEP_STRETCH * h {
            self.span.t_end
        } else if left < 2.0 * h {
            self.t + 0.5 * left
        } else {
            self.t + h
        }
    }

    /// Upper limit of the next step, by option and by the system.
    pub fn longest_step(&self, y: &[f64]) -> f64 {
        let hint = self.system.max_step_hint(self.t, y);
        self.options.max_step.map_or(hint, |longest| longest.min(hint))
    }

    /// End of the next of equal steps, at most of size `h`, that fill the interval up to its end, or to where the system has a step end before
    /// that ([`System::next_end`]), and so on from there. `None` where the interval ends.
    pub fn next_equal_end(&mut self, h: f64) -> Option<f64> {
        let last = self.span.t_end;
        let mut equal = match self.equal.filter(|equal| equal.begun < equal.count) {
            Some(equal) => equal,
            None if self.t >= last => return None,
            None => {
                let (from, end) = (self.t, self.system.next_end(self.t));
                let to = if end < last - self.smallest_step() { end } else { last };
                // A quotient that is a whole number but for round-off of the times is that number.
                let round_off = 4.0 * f64::EPSILON * from.abs().max(to.abs());
                let count = ((to - from - round_off) / h).ceil().max(1.0) as usize;
                Equal { from, to, count, begun: 0 }
            }
        };
        equal.begun += 1;
        self.equal = Some(equal);
        let Equal { from, to, count, begun } = equal;
        // Free of accumulated round-off.
        Some(if begun < count { from + begun as f64 / count as f64 * (to - from) } else { to })
    }

    /// The shortest step to begin with: what asks for a shorter one is round-off of the state, and the error of the step decides.
    pub fn least_first_step(&self) -> f64 {
        (LEAST_FIRST_STEP * (self.span.t_end - self.span.t_start)).max(self.smallest_step())
    }

    /// Step size below which time does not advance properly.
    pub fn smallest_step(&self) -> f64 {
        SMALLEST_STEP * self.span.t_start.abs().max(self.span.t_end.abs())
    }

    fn pending_sample(&self) -> Option<f64> {
        self.span.sample_times.get(self.next_sample).copied()
    }

    fn sample(&mut self, t: f64, y: &[f64]) -> Result<(), Trouble> {
        self.next_sample += 1;
        self.counters.samples += 1;
        self.system.sample(t, y).map_err(|failure| final_trouble_of(failure, t))
    }
}

/// Trouble in a step that can be tried again.
pub(super) fn trouble_of(failure: Failure, t: f64, step: f64) -> Trouble {
    match failure {
        Failure::Recoverable(cause) | Failure::Forbidden(cause) => {
            Trouble::Retry(StopReason::Failed { step, not_finite: false, cause })
        }
        Failure::NotFinite(cause) => Trouble::Retry(StopReason::Failed { step, not_finite: true, cause }),
        Failure::Fatal(cause) => Trouble::Abort(IntegrateError::System { t, cause }),
    }
}

/// Trouble that no other step size would avoid.
pub(super) fn final_trouble_of(failure: Failure, t: f64) -> Trouble {
    match trouble_of(failure, t, 0.0) {
        Trouble::Retry(reason) => Trouble::Stop(reason),
        other => other,
    }
}

/// Whether all entries are finite.
pub fn all_finite(x: &[f64]) -> bool {
    // A number that is not finite makes no number of the product with zero; without a way out, several at a time.
    let (fours, rest) = x.as_chunks::<4>();
    let mut zeros = [0.0; 4];
    for four in fours {
        zeros.iter_mut().zip(four).for_each(|(zero, x)| *zero += 0.0 * x);
    }
    rest.iter().zip(&mut zeros).for_each(|(x, zero)| *zero += 0.0 * x);
    zeros == [0.0; 4]
}

/// First mistake in the arguments, if any.
fn fault_of(dim: usize, y: &[f64], span: &Span<'_>, options: &Options) -> Option<String> {
    if y.len() != dim {
        return Some(format!("the state has {} entries, the system {dim}", y.len()));
    }
    if !all_finite(y) {
        return Some("the initial state is not finite".to_string());
    }
    let (start, end) = (span.t_start, span.t_end);
    if !start.is_finite() || !end.is_finite() || start > end {
        return Some(format!("{start} to {end} is no interval of time"));
    }
    let mut last = start;
    for &time in span.sample_times {
        if !(time >= last && time <= end) {
            return Some(format!("sample time {time} is out of order, or not in {start} to {end}"));
        }
        last = time;
    }
    let steps =
        [("first step", options.first_step), ("largest step", options.max_step), ("fixed step", options.fixed_step)];
    for (what, step) in steps {
        if step.is_some_and(|h| h.is_nan() || h <= 0.0) {
            return Some(format!("the {what} must be positive"));
        }
    }
    let factors = [
        ("safety", options.safety, 0.0, 1.0),
        ("min_factor", options.min_factor, 0.0, 1.0),
        ("max_factor", options.max_factor, 1.0, f64::INFINITY),
    ];
    for (what, value, low, high) in factors {
        if !(value > low && value <= high) {
            return Some(format!("{what} = {value} is not above {low} and up to {high}"));
        }
    }
    if let Some(beta) = options.beta.filter(|beta| !(0.0..1.0).contains(beta)) {
        return Some(format!("beta = {beta} is not in 0..1"));
    }
    None
}
