//! Explicit Runge-Kutta method of order 8 with step size control and dense output.

use super::dop853_tableau::{A, A_DENSE, B, C, D, E3, E5, Row};
use super::run::{Run, Trouble, all_finite};
use super::{Accepted, IntegrateError, Integrator, Options, Outcome, Span, Status, StopReason, System};

const STAGES: usize = 12;
/// Derivative at the end of the step.
const END: usize = 12;
const ALL_STAGES: usize = 16;
/// Coefficient vectors of the interpolation polynomial.
const COEFFICIENTS: usize = 8;

/// The error estimate goes with `h^8`.
const ERROR_EXPONENT: f64 = 1.0 / 8.0;
/// Step sizes shrink by this factor when a step fails other than by its error.
const RECOVERY_FACTOR: f64 = 0.25;
/// Middles of the widest gaps between the nodes of the method, as shares of the step, with the half widths of the gaps:
/// 0.118..0.25, 0.333..0.6, 0.651..0.857, 0.857..1. A time to keep away from is best passed there.
const GAPS: [f64; 4] = [0.184, 0.467, 0.754, 0.929];
/// The widest of them.
const WIDEST_GAP: f64 = 0.467;
/// An aimed step may be longer than the one tried by this factor.
const AIMED_STRETCH: f64 = 1.02;
/// Least error that the PI control remembers.
const LEAST_REMEMBERED_ERROR: f64 = 1e-4;

/// Dormand & Prince 8(5,3) after Hairer, Norsett & Wanner, "Solving Ordinary Differential
/// Equations I", 2nd ed. 1993, chapter II and the program DOP853.
///
/// Twelve evaluations a step, the last of which is the first of the next step; three more where
/// a sample time lies inside the step. Deviations from the book:
/// - the new state is projected before its derivative is taken, and the interpolation uses the
///   projected state;
/// - norms come from the system;
/// - steps that fail, or are not finite, are tried again at a quarter of their size; unlucky ones are aimed anew so that
///   the time to keep away from lies between two stages;
/// - the last two steps are made equal.
///
/// Samples inside a step are less accurate than its ends, by a digit to a digit and a half at
/// usual tolerances: the interpolation has order 7, and nothing controls its error. Where that
/// matters, limit the step size or ask for a smaller tolerance.
///
/// With [`Options::fixed_step`] the error is not looked at.
#[derive(Debug, Clone, Default)]
pub struct Dop853 {
    /// Derivatives at the stages, one after the other.
    stages: Vec<f64>,
    /// Coefficients of the interpolation polynomial, one vector after the other.
    polynomial: Vec<f64>,
    argument: Vec<f64>,
    y_new: Vec<f64>,
    error: Vec<f64>,
}

impl Integrator for Dop853 {
    fn name(&self) -> &'static str {
        "dop853"
    }

    fn integrate(
        &mut self,
        system: &mut dyn System,
        y: &mut [f64],
        span: &Span<'_>,
        options: &Options,
    ) -> Result<Outcome, IntegrateError> {
        let mut run = Run::new(system, y, span, options)?;
        self.allocate(y.len());
        let end = match options.fixed_step {
            Some(h) => self.fixed_steps(&mut run, y, h),
            None => self.adaptive_steps(&mut run, y),
        };
        match end {
            Ok(()) => Ok(run.outcome(Status::Completed)),
            Err(trouble) => run.outcome_of(trouble),
        }
    }
}

impl Dop853 {
    fn allocate(&mut self, n: usize) {
        self.stages.clear();
        self.stages.resize(ALL_STAGES * n, 0.0);
        self.polynomial.clear();
        self.polynomial.resize(COEFFICIENTS * n, 0.0);
        for work in [&mut self.argument, &mut self.y_new, &mut self.error] {
            work.clear();
            work.resize(n, 0.0);
        }
    }

    fn adaptive_steps(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        run.sample_start(y)?;
        if run.t == run.span.t_end {
            return Ok(());
        }
        self.start_derivative(run, y)?;
        let mut control = StepControl::new(run.options);
        let mut h = match run.options.first_step {
            Some(h) => h,
            None => self.first_step(run, y)?,
        };
        // The step after an aimed one, where that only prepares for it.
        let mut then = None;
        while run.t < run.span.t_end {
            run.check_step_limit()?;
            h = h.min(run.longest_step(y));
            let t_new = run.step_end(h);
            let tried = t_new - run.t;
            if tried <= 0.0 {
                return Err(Trouble::Stop(StopReason::StepTooSmall { step: h }));
            }
            let reason = match self.try_step(run, y, t_new) {
                Ok(error) if error <= 1.0 => {
                    self.finish_step(run, y, t_new)?;
                    h = tried * control.factor_after_acceptance(error);
                    if let Some(aimed) = then.take() {
                        h = aimed;
                    }
                    continue;
                }
                Ok(error) => {
                    then = None;
                    h = tried * control.factor_after_rejection(error);
                    StopReason::StepTooSmall { step: h }
                }
                Err(Trouble::Retry(reason)) => {
                    (h, then) = match &reason {
                        StopReason::Unlucky { at, .. } => aim(tried, at - run.t),
                        _ => (tried * RECOVERY_FACTOR, None),
                    };
                    reason
                }
                Err(trouble) => return Err(trouble),
            };
            run.reject(&reason);
            control.rejected();
            if h < run.smallest_step() {
                return Err(Trouble::Stop(reason));
            }
        }
        Ok(())
    }

    /// A step up to, but not including, what makes it final. Returns its error, 1 = tolerance;
    /// the work beyond the error is spared where the step will be rejected.
    fn try_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<f64, Trouble> {
        self.step(run, y, t_new)?;
        let error = self.error_of_step(run, y, t_new - run.t)?;
        if error <= 1.0 {
            self.end_of_step(run, y, t_new)?;
        }
        Ok(error)
    }

    fn fixed_steps(&mut self, run: &mut Run<'_>, y: &mut [f64], h: f64) -> Result<(), Trouble> {
        run.sample_start(y)?;
        let count = run.fixed_steps(h);
        if count == 0 {
            return Ok(());
        }
        self.start_derivative(run, y)?;
        for k in 0..count {
            run.check_step_limit()?;
            let t_new = run.fixed_step_end(k, count);
            let result = self.step(run, y, t_new).and_then(|()| self.end_of_step(run, y, t_new));
            if let Err(trouble) = result {
                run.counters.rejected += 1;
                return Err(trouble);
            }
            self.finish_step(run, y, t_new)?;
        }
        Ok(())
    }

    /// `k_0 = f(t, y)`
    fn start_derivative(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<(), Trouble> {
        let n = y.len();
        run.rhs(run.t, y, &mut self.stages[..n], 0.0)?;
        if all_finite(&self.stages[..n]) {
            return Ok(());
        }
        Err(Trouble::Stop(StopReason::NotFinite { step: 0.0 }))
    }

    /// Stages 0 to 11 and the new state, not yet projected:
    /// `k_i = f(t + c_i h, y + h sum_j a_ij k_j)`, `y_new = y + h sum_i b_i k_i`.
    fn step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Trouble> {
        let n = y.len();
        let (t, h) = (run.t, t_new - run.t);
        for i in 1..STAGES {
            combine(A[i], &self.stages, h, y, &mut self.argument);
            let stage = &mut self.stages[i * n..(i + 1) * n];
            run.rhs(t + C[i] * h, &self.argument, stage, h)?;
        }
        combine(B, &self.stages, h, y, &mut self.y_new);
        if all_finite(&self.y_new) {
            return Ok(());
        }
        Err(Trouble::Retry(StopReason::NotFinite { step: h }))
    }

    /// Error of the step, 1 = tolerance (program DOP853): the estimate of order 5, damped by its
    /// ratio to that of order 3, `e5^2 / sqrt(e5^2 + 0.01 e3^2)`.
    fn error_of_step(&mut self, run: &mut Run<'_>, y: &[f64], h: f64) -> Result<f64, Trouble> {
        let mut norm_of = |row: Row| {
            self.error.fill(0.0);
            add_combination(row, &self.stages, h, &mut self.error);
            run.system.error_norm(y, &self.y_new, &self.error)
        };
        let (e5, e3) = (norm_of(E5), norm_of(E3));
        let size = (e5 * e5 + 0.01 * e3 * e3).sqrt();
        if !size.is_finite() {
            return Err(Trouble::Retry(StopReason::NotFinite { step: h }));
        }
        Ok(if size == 0.0 { 0.0 } else { e5 * (e5 / size) })
    }

    /// Projection, derivative at the end, and the interpolation if it will be needed.
    fn end_of_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Trouble> {
        let n = self.y_new.len();
        let h = t_new - run.t;
        run.project(t_new, &mut self.y_new, h)?;
        let end = &mut self.stages[END * n..(END + 1) * n];
        run.rhs(t_new, &self.y_new, end, h)?;
        if !all_finite(&self.y_new) || !all_finite(end) {
            return Err(Trouble::Retry(StopReason::NotFinite { step: h }));
        }
        if run.wants_sample_before(t_new) {
            self.prepare_interpolation(run, y, t_new)?;
        }
        Ok(())
    }

    /// Makes the step final: samples, `accept`, `step_done`, first stage of the next step.
    fn finish_step(&mut self, run: &mut Run<'_>, y: &mut [f64], t_new: f64) -> Result<(), Trouble> {
        let n = y.len();
        let (t, h) = (run.t, t_new - run.t);
        y.copy_from_slice(&self.y_new);
        let polynomial = &self.polynomial;
        let accepted = run.finish_step(t_new, y, &mut self.argument, |time, out| {
            interpolate(polynomial, (time - t) / h, out);
        })?;
        if accepted == Accepted::Changed && t_new < run.span.t_end {
            return self.start_derivative(run, y);
        }
        self.stages.copy_within(END * n..(END + 1) * n, 0);
        Ok(())
    }

    /// Stages 13 to 15 and the polynomial of degree 7 through the step (section II.6). With
    /// `s = (t - t_old) / h` and the rows `r_k` of `polynomial` it reads
    /// `r0 + s (r1 + (1-s) (r2 + s (r3 + (1-s) (r4 + s (r5 + (1-s) (r6 + s r7))))))`.
    fn prepare_interpolation(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Trouble> {
        let n = y.len();
        let (t, h) = (run.t, t_new - run.t);
        for (i, row) in A_DENSE.iter().enumerate() {
            let i = i + END + 1;
            combine(row, &self.stages, h, y, &mut self.argument);
            let stage = &mut self.stages[i * n..(i + 1) * n];
            run.rhs(t + C[i] * h, &self.argument, stage, h)?;
        }
        for (i, &start) in y.iter().enumerate() {
            let rise = self.y_new[i] - start;
            let bend = h * self.stages[i] - rise;
            self.polynomial[i] = start;
            self.polynomial[n + i] = rise;
            self.polynomial[2 * n + i] = bend;
            self.polynomial[3 * n + i] = rise - h * self.stages[END * n + i] - bend;
        }
        for (k, row) in D.iter().enumerate() {
            let coefficient = &mut self.polynomial[(4 + k) * n..(5 + k) * n];
            coefficient.fill(0.0);
            add_combination(row, &self.stages, h, coefficient);
        }
        Ok(())
    }

    /// Starting step size (section II.4): `h^8 max(|y'|, |y''|) = 0.01`, with `y''` from one
    /// explicit Euler step in which the state changes by a hundredth of its size.
    fn first_step(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<f64, Trouble> {
        let n = y.len();
        let (t, length) = (run.t, run.span.t_end - run.span.t_start);
        let longest = run.longest_step(y).min(length);
        let (start, others) = self.stages.split_at_mut(n);

        let size = run.system.error_norm(y, y, y);
        let speed = run.system.error_norm(y, y, start);
        let tiny = 1e-6 * length;
        let guess = if size > 1e-5 && speed > 1e-5 { 0.01 * (size / speed) } else { tiny };
        let h = if guess.is_finite() { guess.min(longest) } else { tiny };

        for (i, argument) in self.argument.iter_mut().enumerate() {
            *argument = y[i] + h * start[i];
        }
        match run.rhs(t + h, &self.argument, &mut others[..n], h) {
            Ok(()) => {}
            // The Euler step left the domain: start well inside.
            Err(Trouble::Retry(_)) => return Ok(RECOVERY_FACTOR * h),
            Err(trouble) => return Err(trouble),
        }
        for (i, error) in self.error.iter_mut().enumerate() {
            *error = others[i] - start[i];
        }
        let acceleration = run.system.error_norm(y, y, &self.error) / h;
        let largest = speed.max(acceleration);
        let predicted = if largest <= 1e-15 { tiny.max(h * 1e-3) } else { (0.01 / largest).powf(ERROR_EXPONENT) };
        let step = predicted.min(100.0 * h).min(longest);
        Ok(if step.is_finite() { step } else { h })
    }
}

/// Step size control (section II.4, program DOP853).
struct StepControl {
    exponent: f64,
    beta: f64,
    safety: f64,
    min_factor: f64,
    max_factor: f64,
    last_error: f64,
    after_rejection: bool,
}

impl StepControl {
    fn new(options: &Options) -> Self {
        Self {
            exponent: ERROR_EXPONENT - 0.2 * options.beta,
            beta: options.beta,
            safety: options.safety,
            min_factor: options.min_factor,
            max_factor: options.max_factor,
            last_error: LEAST_REMEMBERED_ERROR,
            after_rejection: false,
        }
    }

    /// Ratio of the next step size to the one just accepted; no growth right after a rejection.
    fn factor_after_acceptance(&mut self, error: f64) -> f64 {
        let factor = self.safety * self.last_error.powf(self.beta) / error.powf(self.exponent);
        let most = if self.after_rejection { 1.0 } else { self.max_factor };
        self.last_error = error.max(LEAST_REMEMBERED_ERROR);
        self.after_rejection = false;
        factor.max(self.min_factor).min(most)
    }

    /// Ratio of the next step size to the one just rejected.
    fn factor_after_rejection(&self, error: f64) -> f64 {
        (self.safety / error.powf(self.exponent)).max(self.min_factor)
    }

    fn rejected(&mut self) {
        self.after_rejection = true;
    }
}

/// The step that passes over a time at `distance` between two stages, about as long as the one tried; where there is none,
/// a step that ends well before it, and the one to follow.
fn aim(tried: f64, distance: f64) -> (f64, Option<f64>) {
    let passing = GAPS.iter().map(|gap| distance / gap).find(|step| *step <= AIMED_STRETCH * tried);
    match passing {
        Some(step) if step > 0.0 => (step, None),
        // At the very start of the step: no size helps, but a smaller one may.
        Some(_) => (tried * RECOVERY_FACTOR, None),
        None => ((distance - WIDEST_GAP * tried).max(RECOVERY_FACTOR * tried), Some(tried)),
    }
}

/// `out := y + h sum_j a_j k_j`
fn combine(row: Row, stages: &[f64], h: f64, y: &[f64], out: &mut [f64]) {
    out.copy_from_slice(y);
    add_combination(row, stages, h, out);
}

/// `out += h sum_j a_j k_j`
fn add_combination(row: Row, stages: &[f64], h: f64, out: &mut [f64]) {
    let n = out.len();
    for &(j, coefficient) in row {
        let factor = h * coefficient;
        let stage = &stages[j * n..(j + 1) * n];
        for (value, &derivative) in out.iter_mut().zip(stage) {
            *value += factor * derivative;
        }
    }
}

/// Evaluates the polynomial of [`Dop853::prepare_interpolation`] at the share `s` of the step.
fn interpolate(polynomial: &[f64], s: f64, out: &mut [f64]) {
    let n = out.len();
    for (i, value) in out.iter_mut().enumerate() {
        let mut sum = 0.0;
        for k in (1..COEFFICIENTS).rev() {
            // Factors alternate: s outside odd coefficients, 1 - s outside even ones.
            let factor = if k % 2 == 1 { s } else { 1.0 - s };
            sum = factor * (polynomial[k * n + i] + sum);
        }
        *value = polynomial[i] + sum;
    }
}
