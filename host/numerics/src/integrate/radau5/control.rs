//! [`Control`]: step sizes, and when Newton's method continues, is given up, or needs a new matrix.

use super::super::Price;
use super::super::fill::Work;
use super::super::steps::Fault;
use super::MOST_ROUND_OFF;

/// Iterations of Newton's method before a step with three stages is given up; with more, steps are longer (program RADAU).
const MOST_ITERATIONS: usize = 7;
/// The same for steps of a fixed size, which cannot be made smaller.
const MOST_ITERATIONS_FIXED: usize = 50;
/// Relative accuracy of the iterations in steps of a fixed size.
const FIXED_ACCURACY: f64 = 1e-13;
/// Rate of convergence up to which the Jacobian is kept for the next step.
const KEEP_JACOBIAN: f64 = 1e-3;
/// The same where a Jacobian costs much: iterations more cost less then.
const KEEP_EXPENSIVE_JACOBIAN: f64 = 0.03;
/// Iterations for the cost of which a Jacobian with its factors is expensive.
const EXPENSIVE: f64 = 8.0;
/// Ratios of step sizes within which step size and factorisation are kept.
const KEEP_STEP: [f64; 2] = [1.0, 1.2];
/// The same where a factorisation costs much (program RADAU5: 0.99 and 2 for large systems with full matrices): steps that are shorter
/// than they could be take fewer iterations, and predictions that waver need no new factors.
const KEEP_STEP_OF_LARGE: [f64; 2] = [0.95, 2.0];
/// Iterations for the cost of which a factorisation costs much.
const LARGE: f64 = 4.0;
/// Share of a step size at which Newton's method failed below which the steps after it stay: in smooth motion it would fail there again.
const BELOW_FAILED: f64 = 0.6;
/// Accepted steps for which that holds.
const HEEDED: usize = 10;
/// Limits of the ratio of step sizes.
const RATIO: [f64; 2] = [0.2, 8.0];
const SAFETY: f64 = 0.9;
/// Weight of the tolerance in the error test, `0.1 tol^((s+1)/2s)`: with s stages the error estimate is of order s, the result of
/// order 2 s - 1 (programs RADAU5 and RADAU).
const TEST_FACTOR: f64 = 0.1;
/// The same with more than three stages: stiff equations take more of such a method's order, and with this weight the result still
/// meets the tolerance on van der Pol's oscillator.
const TEST_FACTOR_OF_MORE: f64 = 5e-2;
/// What Newton's method may leave, as a share of what RADAU5 and RADAU let it leave. It does not alternate as errors of the method do: along
/// many turns of a rotor it adds up, and where the method is far better than its error estimate, as with five stages, it is all that is
/// seen.
const LEFT: f64 = 0.3;
/// The same of methods with more than three stages.
const LEFT_OF_MORE: f64 = 0.1;
/// Error of the interpolation in tolerances, as the error test estimates it, up to which samples are interpolated.
const INTERPOLATED_ERROR: f64 = 1.0;
/// Least error that the predictive control remembers, in units of the error test.
const LEAST_REMEMBERED_ERROR: f64 = 1e-2;

/// What a step carries to the next.
#[derive(Debug, Clone)]
pub(super) struct Control {
    stages: usize,
    /// Step size of the factorisation in force.
    pub(super) factored: Option<f64>,
    pub(super) jacobian_is_current: bool,
    pub(super) has_jacobian: bool,
    /// Size of the step whose collocation polynomial starts the iterations.
    pub(super) polynomial_of: Option<f64>,
    /// `theta / (1 - theta)` of Newton's method.
    pub(super) convergence: f64,
    pub(super) theta: f64,
    /// Rate of convergence up to which the Jacobian is kept for the next step.
    pub(super) keep_jacobian: f64,
    /// Ratios of step sizes within which step size and factorisation are kept.
    keep_step: [f64; 2],
    pub(super) iterations: usize,
    /// Size of a step, longer than the one before, at which the iterations failed with a Jacobian of its start, and steps accepted since.
    failed: Option<(f64, usize)>,
    /// Step size and error of the last accepted step.
    last: Option<(f64, f64)>,
    /// Step size and error, in tolerances, of the last step: for the interpolation.
    last_estimate: Option<(f64, f64)>,
    pub(super) rejected: bool,
    /// Error test and tolerance, both as shares of the tolerance.
    pub(super) test: f64,
    /// Largest error of Newton's method, as a share of the error test: what it aims at, and what is enough where it comes no further, by
    /// round-off or slowly.
    pub(super) newton: f64,
    pub(super) enough: f64,
    /// What round-off of the state changes in an iteration with the factors in force, as a share of the error test, where that was measured.
    pub(super) round_off: Option<f64>,
    pub(super) most_iterations: usize,
}

fn most_iterations(stages: usize) -> usize {
    MOST_ITERATIONS + (stages - 3) * 5 / 2
}

impl Default for Control {
    fn default() -> Self {
        Self::new(3, None)
    }
}

impl Control {
    /// For a system whose error test stands for this relative tolerance, if it is known.
    pub(super) fn new(stages: usize, tolerance: Option<f64>) -> Self {
        let power = (stages + 1) as f64 / (2 * stages) as f64;
        let (factor, left) = if stages > 3 { (TEST_FACTOR_OF_MORE, LEFT_OF_MORE) } else { (TEST_FACTOR, LEFT) };
        let relative = tolerance.map_or(1e-6, |tol| factor * tol.powf(power));
        let least = 10.0 * f64::EPSILON / relative;
        Self {
            stages,
            factored: None,
            jacobian_is_current: false,
            has_jacobian: false,
            polynomial_of: None,
            convergence: 1.0,
            theta: 2.0 * KEEP_JACOBIAN,
            keep_jacobian: KEEP_JACOBIAN,
            keep_step: KEEP_STEP,
            iterations: 0,
            failed: None,
            last: None,
            last_estimate: None,
            rejected: false,
            test: tolerance.map_or(1.0, |tol| (relative / tol).max(1.0)),
            round_off: None,
            most_iterations: most_iterations(stages),
            newton: least.max(left * relative.powf(1.0 / power - 1.0).min(0.03)),
            enough: least.max(relative.sqrt().min(0.03)),
        }
    }

    /// The estimate of the error goes with the size of a step to the power of one over this.
    fn exponent(&self) -> f64 {
        1.0 / (self.stages + 1) as f64
    }

    /// Ratio of the size of the next step to that of one with this error (section IV.8, eq. 8.21).
    fn ratio(&self, error: f64) -> f64 {
        let iterations = self.iterations as f64;
        let most = most_iterations(self.stages) as f64;
        let safety = SAFETY.min(SAFETY * (1.0 + 2.0 * most) / (iterations + 2.0 * most));
        (safety / error.max(1e-10).powf(self.exponent())).clamp(RATIO[0], RATIO[1])
    }

    /// Keeps Jacobians longer where they cost much against iterations, for a state of `n` numbers.
    pub(super) fn keep_by_price(&mut self, price: Price, n: usize) {
        let dense = Work::dense_step(n);
        let jacobian = price.jacobian.unwrap_or(n as f64 * price.evaluation) + dense.factorisation;
        let iteration = self.stages as f64 * price.evaluation + dense.solution;
        self.keep_jacobian = if jacobian > EXPENSIVE * iteration { KEEP_EXPENSIVE_JACOBIAN } else { KEEP_JACOBIAN };
    }

    /// Keeps factors longer where matrices of which so much is known cost much against iterations.
    pub(super) fn keep_by_work(&mut self, price: Price, matrices: Option<Work>) {
        let iteration = |work: Work| self.stages as f64 * price.evaluation + work.solution;
        let is_large = matrices.is_some_and(|work| work.factorisation > LARGE * iteration(work));
        self.keep_step = if is_large { KEEP_STEP_OF_LARGE } else { KEEP_STEP };
    }

    /// Without an error test, the iterations continue nearly to round-off.
    pub(super) fn iterate_to_round_off(&mut self, tolerance: Option<f64>) {
        self.newton = tolerance.map_or(1e-6, |tol| (FIXED_ACCURACY / tol).min(1e-2)) / self.test;
        self.enough = self.newton;
        self.most_iterations = MOST_ITERATIONS_FIXED;
    }

    /// Size of the step after one of size `tried` that was accepted; `h` was asked for.
    pub(super) fn size_after_acceptance(&mut self, tried: f64, h: f64, error: f64) -> f64 {
        let ratio = self.ratio_after_acceptance(tried, error);
        self.rejected = false;
        if let Some((_, steps)) = &mut self.failed {
            *steps += 1;
        }
        self.failed = self.failed.filter(|(_, steps)| *steps <= HEEDED);
        // Where iterations converge at once, it was round-off that they failed by, whatever the step size.
        let bound = self.failed.filter(|_| self.theta > KEEP_JACOBIAN);
        let ratio = bound.map_or(ratio, |(failed, _)| ratio.min((BELOW_FAILED * failed / tried).max(1.0)));
        // A step shortened for a sample or the end says little against the size asked for.
        let wanted = if tried < 0.999 * h { (tried * ratio).max(h.min(tried * RATIO[1])) } else { tried * ratio };
        let [least, most] = self.keep_step;
        let kept = (least..=most).contains(&(wanted / tried));
        if kept && self.theta <= self.keep_jacobian { tried } else { wanted }
    }

    /// The same after one that is too inaccurate.
    pub(super) fn size_after_rejection(&self, tried: f64, error: f64) -> f64 {
        tried * if self.last.is_none() { 0.1 } else { self.ratio(error).min(0.9) }
    }

    /// Whether the error of a step that seems too large is worth a second look: at the start and after a rejection.
    pub(super) fn doubts_errors(&self) -> bool {
        self.last.is_none() || self.rejected
    }

    /// [`Control::ratio`] after a step that was accepted: not more than its predecessor suggests (eq. 8.28).
    fn ratio_after_acceptance(&mut self, h: f64, error: f64) -> f64 {
        let mut ratio = self.ratio(error);
        if let Some((last_h, last_error)) = self.last {
            let growth = (error * error / last_error).max(1e-40).powf(self.exponent()) / SAFETY;
            ratio = ratio.min((h / last_h / growth).clamp(RATIO[0], RATIO[1]));
        }
        self.last = Some((h, error.max(LEAST_REMEMBERED_ERROR)));
        if self.rejected { ratio.min(1.0) } else { ratio }
    }

    /// The equations switched: nothing that is known of the last steps holds for the next.
    pub(super) fn forget(&mut self) {
        self.has_jacobian = false;
        self.polynomial_of = None;
        self.last = None;
        self.last_estimate = None;
        self.failed = None;
        self.convergence = 1.0;
    }

    /// What is expected of the convergence of a step of this size before it is seen: that of the last step (programs RADAU5 and RADAU), of
    /// one that is longer no better than lets a Jacobian be kept.
    pub(super) fn expect_convergence(&mut self, h: f64) {
        let is_longer = self.polynomial_of.is_some_and(|last| h > KEEP_STEP[1] * last);
        let best = if is_longer { KEEP_JACOBIAN } else { 0.0 };
        self.convergence = self.convergence.max(f64::EPSILON).powf(0.8).max(best);
    }

    /// The iterations failed in a step of this size, with a last change of this share of the error test; where the Jacobian is one of
    /// another state, a new one is taken.
    pub(super) fn slow(&mut self, share: f64, h: f64, change: f64) -> Fault {
        if self.jacobian_is_current && change > MOST_ROUND_OFF && self.polynomial_of.is_some_and(|last| h > last) {
            self.failed = Some((h, 0));
        }
        self.theta = 1.0;
        self.factored = None;
        Fault::Slow(share)
    }

    /// Takes the error of a step that passes the test; whether samples inside it will be good.
    pub(super) fn estimate_of(&mut self, h: f64, error: f64) -> bool {
        let in_tolerances = error * self.test;
        self.last_estimate = Some((h, in_tolerances));
        in_tolerances <= INTERPOLATED_ERROR
    }

    /// Whether samples inside a step of this size will be good.
    pub(super) fn interpolates(&self, h: f64) -> bool {
        self.last_estimate
            .is_none_or(|(last, error)| error * (h / last).powi(self.stages as i32 + 1) <= INTERPOLATED_ERROR)
    }
}
