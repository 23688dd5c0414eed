//! Implicit Runge-Kutta method of order 5 for stiff problems.

mod control;
mod tableau;

use nalgebra::Complex;

use self::control::Control;
use self::tableau::{A, ALPHA, BETA, C, E, GAMMA, SEEN, STAGES, T, T_INVERSE};
use super::jacobian::Jacobian;
use super::lu::Lu;
use super::rivals::Defender;
use super::run::{Run, Trouble, all_finite};
use super::steps::{self, Adaptive, End, Fault, Stepper};
use super::{Integrator, StopReason};

/// Relative change of the state by the last iteration up to which it does for sums, too: their rates bend more than the others,
/// and where one iteration solves all the rest, it does not solve these.
const SUMS_ACCURACY: f64 = 1e-7;
/// Share of a step within which it is made to end at a sample rather than beside it.
const NEAR_SAMPLE: f64 = 0.01;

/// Share of a step by which its interpolation may be continued: its error goes with the distance from the end.
const REACH: f64 = 1e-3;

/// Radau IIA of order 5 after Hairer & Wanner, "Solving Ordinary Differential Equations II", 2nd ed. 1996, section IV.8
/// and the program RADAU5: simplified Newton iterations in transformed variables (a real and a complex linear system),
/// Jacobian and factorisation used again where they serve, predictive step control after Gustafsson.
///
/// Deviations from the book:
/// - the new state is projected, and the derivative there starts the next step;
/// - norms come from the system, and the error test aims at its tolerance only if [`super::System::tolerance`] is known;
/// - the interpolation is of order 3 only, as the error estimate is; where that estimate is above the tolerance, steps end
///   at samples instead.
///
/// With [`super::Options::fixed_step`] the error is not looked at.
#[derive(Debug, Clone, Default)]
pub struct Radau5 {
    jacobian: Jacobian,
    real: Lu<f64>,
    complex: Lu<Complex<f64>>,
    /// `f(t, y)` at the start of the step.
    start: Vec<f64>,
    /// Increments of the stages.
    z: [Vec<f64>; STAGES],
    /// The same, transformed.
    w: [Vec<f64>; STAGES],
    /// Derivatives at the stages, then right sides.
    f: [Vec<f64>; STAGES],
    pair: Vec<Complex<f64>>,
    /// Derivatives of sums at the stages.
    sum_rates: [Vec<f64>; STAGES],
    /// Divided differences of the collocation polynomial of the last step, from its end backwards.
    polynomial: [Vec<f64>; STAGES],
    y_new: Vec<f64>,
    argument: Vec<f64>,
    error: Vec<f64>,
    control: Control,
    /// Watches the steps where an explicit method may go on instead, and the step with which it had better.
    defender: Option<Defender>,
    explicit_step: Option<f64>,
}

impl Integrator for Radau5 {
    fn name(&self) -> &'static str {
        "radau5"
    }

    fn may_use_jacobian(&self) -> bool {
        true
    }

    fn steps(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        self.whole_run(run, y, run.options.first_step, None).map(|_| ())
    }
}

impl Radau5 {
    /// From an accepted state to the end, or until the defender gives up: then the step for the method to follow is returned.
    /// `first_step` is chosen here if absent.
    pub(super) fn whole_run(
        &mut self,
        run: &mut Run<'_>,
        y: &mut [f64],
        first_step: Option<f64>,
        defender: Option<Defender>,
    ) -> Result<Option<f64>, Trouble> {
        self.allocate(y.len());
        self.control = Control::new(run.system.tolerance());
        self.control.keep_by_price(run.system.price(), y.len());
        if run.options.fixed_step.is_some() {
            self.control.iterate_to_round_off(run.system.tolerance());
        }
        self.defender = defender;
        self.explicit_step = None;
        let end = steps::steps(self, run, y, first_step)?;
        Ok(self.explicit_step.take().filter(|_| end == End::GaveWay))
    }

    fn allocate(&mut self, n: usize) {
        self.jacobian.resize(n);
        self.pair.clear();
        self.pair.resize(n, Complex::new(0.0, 0.0));
        let groups = [&mut self.z, &mut self.w, &mut self.f, &mut self.polynomial];
        let single = [&mut self.start, &mut self.y_new, &mut self.argument, &mut self.error];
        for work in groups.into_iter().flatten().chain(single) {
            work.clear();
            work.resize(n, 0.0);
        }
    }

    /// Jacobian and factorisations for a step of size `h`, as far as they are not in force.
    fn prepare(&mut self, run: &mut Run<'_>, y: &[f64], h: f64) -> Result<(), Fault> {
        if !self.control.has_jacobian
            || (self.control.theta > self.control.keep_jacobian && !self.control.jacobian_is_current)
        {
            // Newton's method failed with that of an earlier state.
            run.counters.recoveries.fresh_jacobian +=
                usize::from(self.control.has_jacobian && self.control.theta >= 1.0);
            self.jacobian.take(run, y, &self.start)?;
            self.control.has_jacobian = true;
            self.control.jacobian_is_current = true;
            self.control.factored = None;
        }
        if self.control.factored.is_some_and(|factored| (factored - h).abs() <= 1e-12 * h) {
            return Ok(());
        }
        run.counters.factorisations += 1;
        let mut regular = self.factor(h);
        if !regular && self.jacobian.fill.ahead() > 0 {
            // Pivots are searched for then.
            self.jacobian.leave_dense();
            regular = self.factor(h);
        }
        self.control.factored = regular.then_some(h);
        if regular { Ok(()) } else { Err(Fault::Slow(0.5)) }
    }

    /// False where one of the matrices for a step of size `h` is singular, or their elimination broke off.
    fn factor(&mut self, h: f64) -> bool {
        let Jacobian { fill, fill_is_new, .. } = &mut self.jacobian;
        let is_new = std::mem::replace(fill_is_new, false);
        let real = self.real.factor(GAMMA / h, fill, is_new);
        self.complex.factor(Complex::new(ALPHA / h, BETA / h), fill, is_new) && real
    }

    /// The new state, not yet projected, and the increments `z` of the stages: `z_i = h sum_j a_ij f(t + c_j h, y + z_j)`.
    fn solve_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Fault> {
        let (t, h) = (run.t, t_new - run.t);
        self.prepare(run, y, h)?;
        self.guess(h);
        self.control.convergence = self.control.convergence.max(f64::EPSILON).powf(0.8);
        self.control.theta = self.control.keep_jacobian;
        let (mut last, mut last_rate) = (0.0, 0.0);
        for iteration in 1..=self.control.most_iterations {
            run.counters.newton_iterations += 1;
            for (i, c) in C.iter().enumerate() {
                for ((argument, start), z) in self.argument.iter_mut().zip(y).zip(&self.z[i]) {
                    *argument = start + z;
                }
                run.rhs(t + c * h, &self.argument, &mut self.f[i], h)?;
            }
            let sums = run.system.sums_from();
            let change = self.correct(run, y, h) / self.control.test;
            if !change.is_finite() {
                self.control.theta = 1.0;
                return Err(Trouble::Retry(StopReason::NotFinite { step: h }).into());
            }
            if iteration > 1 {
                let rate: f64 = change / last;
                self.control.theta = if iteration == 2 { rate } else { (rate * last_rate).sqrt() };
                last_rate = rate;
                if self.control.theta >= 0.99 {
                    return Err(self.control.slow(0.5));
                }
                self.control.convergence = self.control.theta / (1.0 - self.control.theta);
                let left = self.control.most_iterations.saturating_sub(1 + iteration) as i32;
                let expected = self.control.convergence * change * self.control.theta.powi(left) / self.control.newton;
                if expected >= 1.0 && self.control.convergence * change > self.control.newton {
                    let share = 0.8 * expected.clamp(1e-4, 20.0).powf(-1.0 / f64::from(4 + left));
                    return Err(self.control.slow(share));
                }
            }
            last = change.max(f64::MIN_POSITIVE);
            if self.control.convergence * change <= self.control.newton {
                self.control.iterations = iteration;
                if change * self.control.test * run.system.tolerance().unwrap_or(1.0) > SUMS_ACCURACY && sums < y.len()
                {
                    for (i, c) in C.iter().enumerate() {
                        for ((argument, start), z) in self.argument.iter_mut().zip(y).zip(&self.z[i]) {
                            *argument = start + z;
                        }
                        run.rhs(t + c * h, &self.argument, &mut self.f[i], h)?;
                        self.sum_rates[i].clear();
                        self.sum_rates[i].extend_from_slice(&self.f[i][sums..]);
                    }
                    self.sum_up(sums, h);
                }
                for ((new, old), z) in self.y_new.iter_mut().zip(y).zip(&self.z[2]) {
                    *new = old + z;
                }
                return Ok(());
            }
        }
        Err(self.control.slow(0.5))
    }

    /// Increments of sums, which the iterations are not judged by: those that their rates at the stages give.
    fn sum_up(&mut self, from: usize, h: f64) {
        for (z, row) in self.z.iter_mut().zip(&A) {
            for (k, sum) in z[from..].iter_mut().enumerate() {
                *sum = h * row.iter().zip(&self.sum_rates).map(|(a, rates)| a * rates[k]).sum::<f64>();
            }
        }
    }

    /// Starts the iterations: the polynomial of the last step, continued.
    fn guess(&mut self, h: f64) {
        let Some(last) = self.control.polynomial_of else {
            self.z.iter_mut().chain(&mut self.w).for_each(|vector| vector.fill(0.0));
            return;
        };
        for (i, c) in C.iter().enumerate() {
            let s = c * h / last;
            for (k, z) in self.z[i].iter_mut().enumerate() {
                *z = rise(&self.polynomial, k, s);
            }
        }
        transform(&T_INVERSE, &self.z, &mut self.w);
    }

    /// One Newton correction in transformed variables (section IV.8, eq. 8.4). Gives its size in tolerances.
    fn correct(&mut self, run: &mut Run<'_>, y: &[f64], h: f64) -> f64 {
        let n = y.len();
        let (gamma, alpha, beta) = (GAMMA / h, ALPHA / h, BETA / h);
        let (right, pair) = (&mut self.error[..n], &mut self.pair[..n]);
        let [f1, f2, f3] = self.f.each_mut().map(|f| &mut f[..n]);
        let [w1, w2, w3] = self.w.each_mut().map(|w| &mut w[..n]);
        for k in 0..n {
            let side = |row: &[f64; STAGES]| row[0] * f1[k] + row[1] * f2[k] + row[2] * f3[k];
            right[k] = side(&T_INVERSE[0]) - gamma * w1[k];
            pair[k].re = side(&T_INVERSE[1]) - alpha * w2[k] + beta * w3[k];
            pair[k].im = side(&T_INVERSE[2]) - alpha * w3[k] - beta * w2[k];
        }
        self.real.solve(right, &self.jacobian.fill);
        self.complex.solve(pair, &self.jacobian.fill);
        for k in 0..n {
            (f1[k], f2[k], f3[k]) = (right[k], pair[k].re, pair[k].im);
            w1[k] += f1[k];
            w2[k] += f2[k];
            w3[k] += f3[k];
        }
        transform(&T, &self.w, &mut self.z);
        // Mean square over the transformed corrections, each in the system's norm.
        let squares: f64 = self.f.iter().map(|f| run.system.error_norm(y, y, f).powi(2)).sum();
        (squares / STAGES as f64).sqrt()
    }

    /// Error of the step, 1 = what the test allows: `(gamma/h - J)^-1 (f(t, y) + sum e_i z_i / h)`, once more through the
    /// right side where that is too much after a rejection or at the start (eq. 8.19, 8.20).
    fn error_of_step(&mut self, run: &mut Run<'_>, y: &[f64], h: f64) -> Result<f64, Trouble> {
        for k in 0..y.len() {
            self.f[0][k] = (E[0] * self.z[0][k] + E[1] * self.z[1][k] + E[2] * self.z[2][k]) / h;
            self.error[k] = self.f[0][k] + self.start[k];
        }
        self.real.solve(&mut self.error, &self.jacobian.fill);
        let mut size = run.system.error_norm(y, &self.y_new, &self.error) / self.control.test;
        if size > 1.0 && self.control.doubts_errors() {
            for (k, argument) in self.argument.iter_mut().enumerate() {
                *argument = y[k] + self.error[k];
            }
            run.rhs(run.t, &self.argument, &mut self.f[1], h)?;
            for (k, error) in self.error.iter_mut().enumerate() {
                *error = self.f[0][k] + self.f[1][k];
            }
            self.real.solve(&mut self.error, &self.jacobian.fill);
            size = run.system.error_norm(y, &self.y_new, &self.error) / self.control.test;
        }
        if size.is_finite() && all_finite(&self.y_new) {
            return Ok(size);
        }
        Err(Trouble::Retry(StopReason::NotFinite { step: h }))
    }

    /// Projection and derivative at the end, and the polynomial.
    fn end_of_step(&mut self, run: &mut Run<'_>, t_new: f64) -> Result<(), Trouble> {
        let h = t_new - run.t;
        run.project(t_new, &mut self.y_new, h)?;
        run.rhs(t_new, &self.y_new, &mut self.f[2], h)?;
        finite_or_retry(&self.y_new, h)?;
        finite_or_retry(&self.f[2], h)?;
        for k in 0..self.y_new.len() {
            let (z1, z2, z3) = (self.z[0][k], self.z[1][k], self.z[2][k]);
            let middle = (z1 - z2) / (C[0] - C[1]);
            let first = (z2 - z3) / (C[1] - 1.0);
            let second = (middle - first) / (C[0] - 1.0);
            let third = second - (middle - z1 / C[0]) / C[1];
            for (polynomial, value) in self.polynomial.iter_mut().zip([first, second, third]) {
                polynomial[k] = value;
            }
        }
        Ok(())
    }
}

impl Stepper for Radau5 {
    fn reach(&self) -> f64 {
        REACH
    }

    fn seen(&self) -> &[f64] {
        &SEEN
    }

    fn start(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<(), Trouble> {
        run.start_rates(y, &mut self.start)
    }

    fn make_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Fault> {
        self.solve_step(run, y, t_new)?;
        Ok(self.end_of_step(run, t_new)?)
    }

    fn go_on(&mut self, h: f64) {
        self.control.polynomial_of = Some(h);
        self.control.jacobian_is_current = false;
        self.start.copy_from_slice(&self.f[2]);
    }

    fn y_new(&self) -> &[f64] {
        &self.y_new
    }

    fn rates(&self) -> [&[f64]; 2] {
        [&self.start, &self.f[2]]
    }

    fn degree(&self) -> usize {
        STAGES
    }

    fn interpolate(&self, share: f64, out: &mut [f64]) {
        for (k, value) in out.iter_mut().enumerate() {
            *value = self.y_new[k] + rise(&self.polynomial, k, share - 1.0);
        }
    }
}

impl Adaptive for Radau5 {
    fn try_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<f64, Fault> {
        self.solve_step(run, y, t_new)?;
        let error = self.error_of_step(run, y, t_new - run.t)?;
        if error > 1.0 {
            return Ok(error);
        }
        if !self.control.estimate_of(t_new - run.t, error) {
            // Close to the start of the step the interpolation is good in any case.
            if let Some(time) = run.sample_between(run.t + NEAR_SAMPLE * (t_new - run.t), t_new) {
                return Err(Trouble::EndAt(time).into());
            }
        }
        self.end_of_step(run, t_new)?;
        Ok(error)
    }

    /// A step in which the state changes, by its first derivative, by what the error test allows.
    fn first_step(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<f64, Trouble> {
        let length = run.span.t_end - run.span.t_start;
        let speed = run.system.error_norm(y, y, &self.start) / self.control.test;
        let step = if speed > 0.0 { 1.0 / speed } else { f64::INFINITY };
        Ok(step.clamp(1e-10 * length, 1e-3 * length))
    }

    /// A sample inside the step, if interpolation would not do.
    fn step_end(&self, run: &Run<'_>, h: f64) -> f64 {
        let t_new = run.step_end(h);
        let size = t_new - run.t;
        let Some(time) = run.sample_between(run.t + NEAR_SAMPLE * size, run.t + 2.0 * size) else { return t_new };
        // A sample hit but for round-off is hit.
        if (time - t_new).abs() <= NEAR_SAMPLE * size {
            return time;
        }
        if self.control.interpolates(size) {
            return t_new;
        }
        // Two equal steps rather than a long and a tiny one.
        if time < t_new { time } else { run.t + 0.5 * (time - run.t) }
    }

    fn heeds_samples(&self) -> bool {
        true
    }

    fn size_after_acceptance(&mut self, tried: f64, h: f64, error: f64) -> f64 {
        self.control.size_after_acceptance(tried, h, error)
    }

    fn size_after_rejection(&mut self, tried: f64, error: f64) -> f64 {
        self.control.size_after_rejection(tried, error)
    }

    fn rejected(&mut self) {
        self.control.rejected = true;
    }

    /// The polynomial is no longer that of the last step.
    fn discard(&mut self) {
        self.control.polynomial_of = None;
    }

    fn forget(&mut self) {
        self.control.forget();
    }

    /// As the last step predicts it.
    fn predict(&mut self, y: &[f64], h: f64) -> bool {
        let Some(last) = self.control.polynomial_of else { return false };
        for (k, value) in self.y_new.iter_mut().enumerate() {
            *value = y[k] + rise(&self.polynomial, k, h / last);
        }
        true
    }

    fn gives_way(&mut self, run: &mut Run<'_>) -> bool {
        self.explicit_step = self.defender.as_mut().and_then(|defender| defender.see(run, &self.jacobian.matrix));
        self.explicit_step.is_some()
    }
}

/// The collocation polynomial at the share `s` of the step after its end (negative inside it), less its value there.
fn rise(polynomial: &[Vec<f64>; STAGES], k: usize, s: f64) -> f64 {
    let [first, second, third] = polynomial;
    s * (first[k] + (s - (C[1] - 1.0)) * (second[k] + (s - (C[0] - 1.0)) * third[k]))
}

/// `out_i := sum_j matrix_ij vectors_j`
fn transform(matrix: &[[f64; STAGES]; STAGES], vectors: &[Vec<f64>; STAGES], out: &mut [Vec<f64>; STAGES]) {
    let [a, b, c] = vectors;
    for (row, out) in matrix.iter().zip(out) {
        for (((out, a), b), c) in out.iter_mut().zip(a).zip(b).zip(c) {
            *out = row[0] * a + row[1] * b + row[2] * c;
        }
    }
}

fn finite_or_retry(x: &[f64], h: f64) -> Result<(), Trouble> {
    if all_finite(x) {
        return Ok(());
    }
    Err(Trouble::Retry(StopReason::NotFinite { step: h }))
}
