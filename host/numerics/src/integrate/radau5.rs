//! Implicit Runge-Kutta methods for stiff problems.

mod control;
mod matrices;
mod sums;
mod tableau;

use nalgebra::Complex;

use self::control::Control;
use self::matrices::Matrices;
use self::sums::{product, rise, transform};
use self::tableau::{FIFTH, NINTH, Tableau};
use super::rivals::Defender;
use super::run::{Run, Trouble, all_finite};
use super::steps::{self, Adaptive, End, Fault, Stepper};
use super::{Integrator, StopReason};

/// Relative change of the state by the last iteration up to which it does for sums, too, if it is within the tolerance: their rates bend
/// more than the others, and where one iteration solves all the rest, by a Jacobian of long ago, it does not solve these.
const SUMS_ACCURACY: f64 = 1e-7;
/// Sum of the squares of the weights in a second difference.
const SQUARES: f64 = 6.0;
/// Changes that round-off makes, measured once, within which those of an iteration are round-off.
const ROUND_OFF: f64 = 10.0;
/// Round-off beyond this share of the error test is not taken for a solution.
const MOST_ROUND_OFF: f64 = 0.003;
/// Share of a step within which it is made to end at a sample rather than beside it.
const NEAR_SAMPLE: f64 = 0.01;

/// Share of a step by which its interpolation may be continued: its error goes with the distance from the end.
const REACH: f64 = 1e-3;
/// How many times as long as the last step one may be that starts from its polynomial.
const MOST_CONTINUED: f64 = 10.0;

/// Radau IIA with `S` stages, of order `2 S - 1`, after Hairer & Wanner, "Solving Ordinary Differential Equations II", 2nd ed. 1996, section IV.8
/// and the programs RADAU5 and RADAU: simplified Newton iterations in transformed variables (a real and one or two complex linear
/// systems), Jacobian and factorisation used again where they serve, predictive step control after Gustafsson.
///
/// Deviations from the book:
/// - the new state is projected, and the derivative there starts the next step;
/// - norms come from the system, and the error test aims at its tolerance only if [`super::System::tolerance`] is known;
/// - the interpolation is of order `S` only, as the error estimate is; where that estimate is above the tolerance, steps end
///   at samples instead.
///
/// With [`super::Options::fixed_step`] the error is not looked at.
#[derive(Debug, Clone)]
pub struct Radau<const S: usize> {
    tableau: &'static Tableau<S>,
    matrices: Matrices,
    /// `f(t, y)` at the start of the step.
    start: Vec<f64>,
    /// Increments of the stages.
    z: [Vec<f64>; S],
    /// The same, transformed.
    w: [Vec<f64>; S],
    /// Derivatives at the stages.
    f: [Vec<f64>; S],
    /// Right sides of the transformed systems, then their solutions.
    right: [Vec<f64>; S],
    /// Last changes of the increments.
    changes: [Vec<f64>; S],
    pair: Vec<Complex<f64>>,
    /// Derivatives of sums at the stages.
    sum_rates: [Vec<f64>; S],
    /// Divided differences of the collocation polynomial of the last step, from its end backwards.
    polynomial: [Vec<f64>; S],
    y_new: Vec<f64>,
    argument: Vec<f64>,
    error: Vec<f64>,
    control: Control,
    /// Watches the steps where an explicit method may continue instead, and the step with which it had better.
    defender: Option<Defender>,
    explicit_step: Option<f64>,
}

/// Radau IIA of order 5, three stages.
pub type Radau5 = Radau<3>;

/// Radau IIA of order 9, five stages. At tight tolerances its steps are several times as long.
pub type Radau9 = Radau<5>;

impl Default for Radau5 {
    fn default() -> Self {
        Self::new(&FIFTH)
    }
}

impl Default for Radau9 {
    fn default() -> Self {
        Self::new(&NINTH)
    }
}

impl<const S: usize> Integrator for Radau<S> {
    fn name(&self) -> &'static str {
        self.tableau.name
    }

    fn may_use_jacobian(&self) -> bool {
        true
    }

    fn steps(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        self.whole_run(run, y, run.options.first_step, None).map(|_| ())
    }
}

impl<const S: usize> Radau<S> {
    fn new(tableau: &'static Tableau<S>) -> Self {
        let vectors = || std::array::from_fn(|_| Vec::new());
        Self {
            tableau,
            matrices: Matrices::new(tableau.gamma, tableau.pairs),
            start: Vec::new(),
            z: vectors(),
            w: vectors(),
            f: vectors(),
            right: vectors(),
            changes: vectors(),
            pair: Vec::new(),
            sum_rates: vectors(),
            polynomial: vectors(),
            y_new: Vec::new(),
            argument: Vec::new(),
            error: Vec::new(),
            control: Control::new(S, None),
            defender: None,
            explicit_step: None,
        }
    }

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
        self.control = Control::new(S, run.system.tolerance());
        self.control.keep_by_price(run.system.price(), y.len());
        self.control.keep_by_work(run.system.price(), run.matrices);
        if run.options.steps_are_given() {
            self.control.iterate_to_round_off(run.system.tolerance());
        }
        self.defender = defender;
        self.explicit_step = None;
        let end = steps::steps(self, run, y, first_step)?;
        Ok(self.explicit_step.take().filter(|_| end == End::GaveWay))
    }

    fn allocate(&mut self, n: usize) {
        self.matrices.jacobian.resize(n);
        self.pair.clear();
        self.pair.resize(n, Complex::new(0.0, 0.0));
        let groups = [&mut self.z, &mut self.w, &mut self.f, &mut self.right, &mut self.changes, &mut self.polynomial];
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
            self.matrices.jacobian.take(run, y, &self.start)?;
            self.control.has_jacobian = true;
            self.control.jacobian_is_current = true;
            self.control.factored = None;
        }
        if self.control.factored.is_some_and(|factored| (factored - h).abs() <= 1e-12 * h) {
            return Ok(());
        }
        let known = run.matrices;
        self.control.round_off = None;
        let regular = self.matrices.factor(run, h);
        if run.matrices != known {
            self.control.keep_by_work(run.system.price(), run.matrices);
        }
        self.control.factored = regular.then_some(h);
        if regular { Ok(()) } else { Err(Fault::Slow(0.5)) }
    }

    /// The rates at all stages. None is behind `t_new` by round-off of its time.
    fn evaluate(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Trouble> {
        let (t, h) = (run.t, t_new - run.t);
        for (i, c) in self.tableau.c.iter().enumerate() {
            for ((argument, start), z) in self.argument.iter_mut().zip(y).zip(&self.z[i]) {
                *argument = start + z;
            }
            run.rhs((t + c * h).min(t_new), &self.argument, &mut self.f[i], h)?;
        }
        Ok(())
    }

    /// The new state, not yet projected, and the increments `z` of the stages: `z_i = h sum_j a_ij f(t + c_j h, y + z_j)`.
    fn solve_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Fault> {
        let h = t_new - run.t;
        self.prepare(run, y, h)?;
        self.guess(h);
        self.control.expect_convergence(h);
        self.control.theta = self.control.keep_jacobian;
        let (mut last, mut last_rate, mut best_rate) = (0.0, 0.0, f64::INFINITY);
        for iteration in 1..=self.control.most_iterations {
            run.counters.newton_iterations += 1;
            self.evaluate(run, y, t_new)?;
            let sums = run.system.sums_from();
            let change = self.correct(run, y, h) / self.control.test;
            if !change.is_finite() {
                self.control.theta = 1.0;
                return Err(Trouble::Retry(StopReason::NotFinite { step: h }).into());
            }
            // Whether it stays within what is enough, and by how much shorter a step would serve where it does not come there.
            let (mut stays, mut slow) = (false, None);
            if iteration > 1 {
                let rate: f64 = change / last;
                best_rate = rate.min(best_rate);
                self.control.theta = if iteration == 2 { rate } else { (rate * last_rate).sqrt() };
                last_rate = rate;
                if self.control.theta >= 0.99 {
                    // Round-off comes and goes.
                    stays = change.max(last) <= self.control.enough;
                    slow = (!stays).then_some(0.5);
                } else {
                    self.control.convergence = self.control.theta / (1.0 - self.control.theta);
                    let left = self.control.most_iterations.saturating_sub(1 + iteration) as i32;
                    let reached = self.control.convergence * change;
                    let within_reach = reached * self.control.theta.powi(left);
                    if within_reach >= self.control.enough && reached > self.control.enough {
                        let expected = within_reach / self.control.enough;
                        slow = Some(0.8 * expected.clamp(1e-4, 20.0).powf(-1.0 / f64::from(4 + left)));
                    }
                    stays = within_reach >= self.control.newton && reached <= self.control.enough;
                }
            }
            last = change.max(f64::MIN_POSITIVE);
            let mut found = slow.is_none() && (stays || self.control.convergence * change <= self.control.newton);
            if !found
                && self.is_round_off(
                    run,
                    y,
                    t_new,
                    (change, slow.is_some() || iteration == self.control.most_iterations),
                )?
            {
                // What rates are among round-off tells nothing of the Jacobian.
                found = true;
                self.control.theta = if best_rate < 1.0 { best_rate } else { self.control.keep_jacobian };
            } else if let Some(share) = slow {
                return Err(self.control.slow(share, h, change));
            }
            if found {
                self.control.iterations = iteration;
                let tolerance = run.system.tolerance().unwrap_or(1.0);
                let changed = change * self.control.test * tolerance;
                if changed > SUMS_ACCURACY.min(tolerance) && sums < y.len() {
                    self.evaluate(run, y, t_new)?;
                    for (rates, found) in self.sum_rates.iter_mut().zip(&self.f) {
                        rates.clear();
                        rates.extend_from_slice(&found[sums..]);
                    }
                    self.sum_up(sums, h);
                }
                for ((new, old), z) in self.y_new.iter_mut().zip(y).zip(&self.z[S - 1]) {
                    *new = old + z;
                }
                return Ok(());
            }
        }
        Err(self.control.slow(0.5, h, last))
    }

    /// Increments of sums, which the iterations are not judged by: those that their rates at the stages give.
    fn sum_up(&mut self, from: usize, h: f64) {
        for (z, row) in self.z.iter_mut().zip(&self.tableau.a) {
            for (k, sum) in z[from..].iter_mut().enumerate() {
                *sum = h * row.iter().zip(&self.sum_rates).map(|(a, rates)| a * rates[k]).sum::<f64>();
            }
        }
    }

    /// Starts the iterations: the polynomial of the last step, continued; not of a step that is much shorter, of which nothing would
    /// be left but its round-off, raised to a power. Sums, which the iterations do not correct, would keep that.
    fn guess(&mut self, h: f64) {
        let Some(last) = self.control.polynomial_of.filter(|last| h <= MOST_CONTINUED * last) else {
            self.z.iter_mut().chain(&mut self.w).for_each(|vector| vector.fill(0.0));
            return;
        };
        for (i, c) in self.tableau.c.iter().enumerate() {
            let s = c * h / last;
            for (k, z) in self.z[i].iter_mut().enumerate() {
                *z = rise(&self.tableau.c, &self.polynomial, k, s);
            }
        }
        transform(&self.tableau.t_inverse, &self.z, &mut self.w);
    }

    /// One Newton correction in transformed variables (section IV.8, eq. 8.4). Gives its size in tolerances.
    fn correct(&mut self, run: &mut Run<'_>, y: &[f64], h: f64) -> f64 {
        let Tableau { t, t_inverse, gamma, pairs, .. } = self.tableau;
        transform(t_inverse, &self.f, &mut self.right);
        let gamma = gamma / h;
        self.right[0].iter_mut().zip(&self.w[0]).for_each(|(right, w)| *right -= gamma * w);
        for (number, (alpha, beta)) in pairs.iter().enumerate() {
            let (alpha, beta, at) = (alpha / h, beta / h, 1 + 2 * number);
            let [re, im] = &mut self.right[at..=at + 1] else { continue };
            for ((re, im), (w_re, w_im)) in re.iter_mut().zip(im).zip(self.w[at].iter().zip(&self.w[at + 1])) {
                *re = *re - alpha * w_re + beta * w_im;
                *im = *im - alpha * w_im - beta * w_re;
            }
        }
        let size = self.solve(run, y);
        for (w, change) in self.w.iter_mut().zip(&self.right) {
            w.iter_mut().zip(change).for_each(|(w, change)| *w += change);
        }
        transform(t, &self.w, &mut self.z);
        size
    }

    /// The transformed systems for their right sides. Gives the mean square of the solutions, each in the system's norm.
    fn solve(&mut self, run: &mut Run<'_>, y: &[f64]) -> f64 {
        let Matrices { jacobian, real, complex, .. } = &mut self.matrices;
        run.matrix_work += run.matrices.map_or(0.0, |work| work.solution);
        real.solve(&mut self.right[0], &jacobian.fill);
        for (number, lu) in complex.iter_mut().enumerate() {
            let [re, im] = &mut self.right[1 + 2 * number..=2 + 2 * number] else { continue };
            for (pair, (re, im)) in self.pair.iter_mut().zip(re.iter().zip(im.iter())) {
                *pair = Complex::new(*re, *im);
            }
            lu.solve(&mut self.pair, &jacobian.fill);
            for ((pair, re), im) in self.pair.iter().zip(re).zip(im) {
                (*re, *im) = (pair.re, pair.im);
            }
        }
        let squares: f64 = self.right.iter().map(|change| run.system.error_norm(y, y, change).powi(2)).sum();
        (squares / S as f64).sqrt()
    }

    /// Whether a change is no more than round-off of the rates makes, with the factors in force. That is measured where the iterations
    /// would be given up (`measure`).
    fn is_round_off(
        &mut self,
        run: &mut Run<'_>,
        y: &[f64],
        t_new: f64,
        (change, measure): (f64, bool),
    ) -> Result<bool, Trouble> {
        if measure && change <= MOST_ROUND_OFF && self.control.round_off.is_none() {
            let size = self.round_off(run, y, t_new)? / self.control.test;
            self.control.round_off = Some(if size.is_finite() { size } else { 0.0 });
        }
        Ok(self.control.round_off.is_some_and(|size| change <= (ROUND_OFF * size).min(MOST_ROUND_OFF)))
    }

    /// What round-off of the rates changes in an iteration: by second differences of the rates at the stages, along the last change.
    fn round_off(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<f64, Trouble> {
        let (t, h) = (run.t, t_new - run.t);
        transform(&self.tableau.t, &self.right, &mut self.changes);
        for (i, c) in self.tableau.c.iter().enumerate() {
            let time = (t + c * h).min(t_new);
            for (factor, share) in [(-2.0, 0.0), (1.0, 1.0)] {
                for (k, argument) in self.argument.iter_mut().enumerate() {
                    *argument = y[k] + (self.z[i][k] + share * self.changes[i][k]);
                }
                run.rhs(time, &self.argument, &mut self.error, h)?;
                self.f[i].iter_mut().zip(&self.error).for_each(|(difference, rate)| *difference += factor * rate);
            }
        }
        transform(&self.tableau.t_inverse, &self.f, &mut self.right);
        Ok(self.solve(run, y) / SQUARES.sqrt())
    }

    /// Error of the step, 1 = what the test allows: `(gamma/h - J)^-1 (f(t, y) + sum e_i z_i / h)`, once more through the
    /// right side where that is too much after a rejection or at the start (eq. 8.19, 8.20).
    fn error_of_step(&mut self, run: &mut Run<'_>, y: &[f64], h: f64) -> Result<f64, Trouble> {
        for k in 0..y.len() {
            let z = std::array::from_fn(|i| self.z[i][k]);
            self.f[0][k] = product(&self.tableau.error, &z) / h;
            self.error[k] = self.f[0][k] + self.start[k];
        }
        self.matrices.solve_real(&mut self.error);
        let mut size = run.system.error_norm(y, &self.y_new, &self.error) / self.control.test;
        if size > 1.0 && self.control.doubts_errors() {
            for (k, argument) in self.argument.iter_mut().enumerate() {
                *argument = y[k] + self.error[k];
            }
            run.rhs(run.t, &self.argument, &mut self.f[1], h)?;
            for (k, error) in self.error.iter_mut().enumerate() {
                *error = self.f[0][k] + self.f[1][k];
            }
            self.matrices.solve_real(&mut self.error);
            size = run.system.error_norm(y, &self.y_new, &self.error) / self.control.test;
        }
        if size.is_finite() && all_finite(&self.y_new) {
            return Ok(size.max(run.sums_norm(y, &self.y_new, &self.error, h)));
        }
        Err(Trouble::Retry(StopReason::NotFinite { step: h }))
    }

    /// Projection and derivative at the end, and the polynomial.
    fn end_of_step(&mut self, run: &mut Run<'_>, t_new: f64) -> Result<(), Trouble> {
        let h = t_new - run.t;
        run.project(t_new, &mut self.y_new, h)?;
        run.rhs(t_new, &self.y_new, &mut self.f[S - 1], h)?;
        finite_or_retry(&self.y_new, h)?;
        finite_or_retry(&self.f[S - 1], h)?;
        // Values at the nodes from the end backwards, the start last, where there is no increment.
        let node = |i: usize| if i < S { self.tableau.c[S - 1 - i] } else { 0.0 };
        for k in 0..self.y_new.len() {
            let mut values: [f64; S] = std::array::from_fn(|i| self.z[S - 1 - i][k]);
            for (level, polynomial) in (1..).zip(&mut self.polynomial) {
                for i in 0..=S - level {
                    let next = values.get(i + 1).copied().unwrap_or(0.0);
                    values[i] = (next - values[i]) / (node(i + level) - node(i));
                }
                polynomial[k] = values[0];
            }
        }
        Ok(())
    }
}

impl<const S: usize> Stepper for Radau<S> {
    fn reach(&self) -> f64 {
        REACH
    }

    fn seen(&self) -> &[f64] {
        self.tableau.seen
    }

    fn start(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<(), Trouble> {
        run.start_rates(y, &mut self.start)
    }

    /// The rule of lower order is that through all nodes but the last: they differ by the integral of the polynomial of the highest
    /// degree, which is zero at all but the last and found exactly by the weights.
    fn add_nodes(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Trouble> {
        let (t, h, c, b) = (run.t, t_new - run.t, &self.tableau.c, &self.tableau.a[S - 1]);
        let apart = |i: usize| c.iter().filter(|other| **other != c[i]).map(|other| c[i] - other).product::<f64>();
        for i in 0..S {
            for ((argument, start), z) in self.argument.iter_mut().zip(y).zip(&self.z[i]) {
                *argument = start + z;
            }
            let difference = b[S - 1] * apart(S - 1) / apart(i);
            run.add_node((t + c[i] * h).min(t_new), &self.argument, h, [b[i], difference])?;
        }
        Ok(())
    }

    /// Such a step cannot be made shorter: where its iterations fail, they are begun again with a Jacobian of its start, if they had an older
    /// one, and then from the start of the step.
    fn make_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Fault> {
        while let Err(fault) = self.solve_step(run, y, t_new) {
            let is_slow = matches!(fault, Fault::Slow(_));
            if is_slow && !self.control.jacobian_is_current {
                self.control.theta = 1.0;
            } else if is_slow && self.control.polynomial_of.is_some() {
                self.discard();
            } else {
                return Err(fault);
            }
        }
        Ok(self.end_of_step(run, t_new)?)
    }

    fn go_on(&mut self, h: f64) {
        self.control.polynomial_of = Some(h);
        self.control.jacobian_is_current = false;
        self.start.copy_from_slice(&self.f[S - 1]);
    }

    fn y_new(&self) -> &[f64] {
        &self.y_new
    }

    fn rates(&self) -> [&[f64]; 2] {
        [&self.start, &self.f[S - 1]]
    }

    fn degree(&self) -> usize {
        S
    }

    fn interpolate(&self, share: f64, out: &mut [f64]) {
        for (k, value) in out.iter_mut().enumerate() {
            *value = self.y_new[k] + rise(&self.tableau.c, &self.polynomial, k, share - 1.0);
        }
    }
}

impl<const S: usize> Adaptive for Radau<S> {
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
        let least = run.least_first_step();
        Ok(step.clamp(least, least.max(1e-3 * length)))
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

    /// The polynomial is no longer that of the last step. The first iteration then evaluates all stages at the start, and tells nothing of
    /// what was missed between there and where they come to be.
    fn discard(&mut self) {
        self.control.polynomial_of = None;
        self.control.convergence = 1.0;
    }

    fn forget(&mut self) {
        self.control.forget();
    }

    /// As the last step predicts it.
    fn predict(&mut self, y: &[f64], h: f64) -> bool {
        let Some(last) = self.control.polynomial_of else { return false };
        for (k, value) in self.y_new.iter_mut().enumerate() {
            *value = y[k] + rise(&self.tableau.c, &self.polynomial, k, h / last);
        }
        true
    }

    fn gives_way(&mut self, run: &mut Run<'_>) -> bool {
        self.explicit_step =
            self.defender.as_mut().and_then(|defender| defender.see(run, &self.matrices.jacobian.matrix));
        self.explicit_step.is_some()
    }
}

fn finite_or_retry(x: &[f64], h: f64) -> Result<(), Trouble> {
    if all_finite(x) {
        return Ok(());
    }
    Err(Trouble::Retry(StopReason::NotFinite { step: h }))
}
