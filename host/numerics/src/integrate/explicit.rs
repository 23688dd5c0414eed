//! What explicit Runge-Kutta pairs share: stages, error test, step control, interpolation, stiffness detection.

use std::ops::Range;

use super::pair::{Estimate, Pair, Row};
use super::rivals::{Signs, Suspect, Suspicion};
use super::run::{Run, Trouble, all_finite};
use super::steps::{self, Adaptive, End, Fault, RECOVERY_FACTOR, Stepper};
use super::stiffness::Stiffness;
use super::sums::{combine, interpolate, whole_lanes};
use super::{Integrator, Options, StopReason};

/// Least error that the PI control remembers.
const LEAST_REMEMBERED_ERROR: f64 = 1e-4;
/// Share of the border of stability from which on it is stability that limits a step: the step control makes the sizes vary
/// about a mean somewhat inside the border. Up to there the interpolation is trusted.
const NEAR_BORDER: f64 = 0.75;

/// How far the interpolation of a step in doubt may be from the states of its own stages, in errors that are allowed: its error is a
/// tenth to two thirds of that where a solution is smooth, or begins as a broken power or with friction.
const FAR_FROM_STAGES: f64 = 10.0;

/// Share of a step by which its interpolation may be continued: its error, which goes at least with the square of the distance
/// from the end, is a few percent there of what it is inside.
const REACH: f64 = 0.08;

/// The method of a [`Pair`]. With [`Options::fixed_step`] the error is not looked at. Deviations from the book: see
/// [`super::dop853()`].
#[derive(Debug, Clone)]
pub struct Explicit {
    name: &'static str,
    pair: &'static Pair,
    /// Entries of the state. All vectors here have more, up to whole lanes; these are zero.
    n: usize,
    /// Derivatives at the stages, one after the other.
    stages: Vec<f64>,
    /// Coefficients of the interpolation polynomial, one vector after the other.
    polynomial: Vec<f64>,
    /// The state at the start of the step.
    start: Vec<f64>,
    /// The states at which the stages of the step were evaluated, one after the other; the first is that at its start.
    arguments: Vec<f64>,
    /// Room for one more.
    argument: Vec<f64>,
    y_new: Vec<f64>,
    error: Vec<f64>,
    stiffness: Stiffness,
    control: StepControl,
    /// Watches the steps where an implicit method may continue instead, and why it had better.
    suspicion: Option<Suspicion>,
    suspect: Option<Suspect>,
    signs: Signs,
    /// Whether the interpolation of the step under way is needed, samples or not.
    approaching: bool,
    /// The stages that have a weight, and the shares of a step at which they are, ascending.
    weighty: Vec<usize>,
    seen: Vec<f64>,
    /// The stages that sums over a step have a weight for: in it, and in its rougher rule.
    summed: Vec<(usize, [f64; 2])>,
    /// Time from which on the equations are others, and their solution need not be smooth: that of the last switch, or of a beginning that
    /// was found not to be.
    switch: Option<f64>,
    /// Time at which the run begins, where no size of a step is known: its solution need not be smooth there.
    beginning: Option<f64>,
}

impl Integrator for Explicit {
    fn name(&self) -> &'static str {
        self.name
    }

    fn steps(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        self.whole_run(run, y, run.options.first_step, None).map(|_| ())
    }
}

impl Explicit {
    /// The method of a pair, under a name.
    #[must_use]
    pub fn new(name: &'static str, pair: &'static Pair) -> Self {
        let weighty = pair.weighty();
        Self {
            name,
            pair,
            n: 0,
            stages: Vec::new(),
            polynomial: Vec::new(),
            start: Vec::new(),
            arguments: Vec::new(),
            argument: Vec::new(),
            y_new: Vec::new(),
            error: Vec::new(),
            stiffness: Stiffness::default(),
            control: StepControl::new(&Options::default(), pair),
            suspicion: None,
            suspect: None,
            signs: Signs { step: 0.0, share: 0.0, slowness: 0.0 },
            approaching: false,
            seen: weighty.iter().map(|stage| pair.c[*stage]).collect(),
            weighty,
            summed: pair.summed(),
            switch: None,
            beginning: None,
        }
    }

    /// From an accepted state to the end, or until an implicit method is suspected to be cheaper; `first_step` is chosen here
    /// if absent.
    pub(super) fn whole_run(
        &mut self,
        run: &mut Run<'_>,
        y: &mut [f64],
        first_step: Option<f64>,
        suspicion: Option<Suspicion>,
    ) -> Result<Option<Suspect>, Trouble> {
        self.allocate(y.len());
        self.control = StepControl::new(run.options, self.pair);
        self.suspicion = suspicion;
        self.suspect = None;
        self.beginning = first_step.is_none().then_some(run.t);
        let end = steps::steps(self, run, y, first_step)?;
        Ok(self.suspect.take().filter(|_| end == End::GaveWay))
    }

    fn end(&self) -> usize {
        self.pair.a.len()
    }

    fn allocate(&mut self, n: usize) {
        self.n = n;
        self.switch = None;
        self.stiffness = Stiffness::default();
        let one = whole_lanes(n);
        let (stages, coefficients) = (self.pair.c.len() * one, (4 + self.pair.d.len()) * one);
        let arguments = self.end() * one;
        for (work, length) in [
            (&mut self.stages, stages),
            (&mut self.arguments, arguments),
            (&mut self.polynomial, coefficients),
            (&mut self.start, one),
            (&mut self.argument, one),
            (&mut self.y_new, one),
            (&mut self.error, one),
        ] {
            work.clear();
            work.resize(length, 0.0);
        }
    }

    /// Where the derivative at a stage lies.
    fn stage(&self, number: usize) -> Range<usize> {
        let from = number * whole_lanes(self.n);
        from..from + self.n
    }

    /// The stages of the step and the new state, not yet projected:
    /// `k_i = f(t + c_i h, y + h sum_j a_ij k_j)`, `y_new = y + h sum_i b_i k_i`. Functions of time may jump behind `t_new`, which
    /// round-off of the sum must not reach.
    fn stages_of_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Trouble> {
        let (n, one) = (self.n, whole_lanes(self.n));
        let (t, h) = (run.t, t_new - run.t);
        self.start[..n].copy_from_slice(y);
        self.arguments[..n].copy_from_slice(y);
        for i in 1..self.end() {
            let argument = &mut self.arguments[i * one..][..one];
            combine(self.pair.a[i], &self.stages, h, Some(&self.start), argument);
            let argument = &argument[..n];
            run.rhs((t + self.pair.c[i] * h).min(t_new), argument, &mut self.stages[i * one..][..n], h)?;
        }
        combine(self.pair.b, &self.stages, h, Some(&self.start), &mut self.y_new);
        if all_finite(&self.y_new) {
            return Ok(());
        }
        Err(Trouble::Retry(StopReason::NotFinite { step: h }))
    }

    /// The state at which a stage of the step was evaluated.
    fn state_of_stage(&self, stage: usize) -> &[f64] {
        if stage < self.end() { &self.arguments[self.stage(stage)] } else { &self.y_new[..self.n] }
    }

    /// Error of the step, 1 = tolerance. With two estimates (program DOP853): that of order 5, damped by its ratio to that
    /// of order 3, `e5^2 / sqrt(e5^2 + 0.01 e3^2)`, which is that of order 8 only where the solution is smooth.
    fn error_of_step(&mut self, run: &mut Run<'_>, y: &[f64], h: f64) -> Result<f64, Trouble> {
        let mut norms_of = |row: Row| {
            combine(row, &self.stages, h, None, &mut self.error);
            let (y_new, error) = (&self.y_new[..y.len()], &self.error[..y.len()]);
            [run.system.error_norm(y, y_new, error), run.sums_norm(y, y_new, error, h)]
        };
        let (error, size) = match self.pair.error {
            Estimate::Single(row) => {
                let [error, sums] = norms_of(row);
                (error.max(sums), error)
            }
            Estimate::FiveAndThree(row5, row3) => {
                let (e5, e3) = (norms_of(row5), norms_of(row3));
                let [size, of_sums] = [0, 1].map(|k| (e5[k] * e5[k] + 0.01 * e3[k] * e3[k]).sqrt());
                let in_doubt = self.in_doubt(run, h);
                let damped = |e5: f64, size: f64| if in_doubt || size == 0.0 { e5 } else { e5 * (e5 / size) };
                (damped(e5[0], size).max(damped(e5[1], of_sums)), size)
            }
        };
        if size.is_finite() {
            return Ok(error);
        }
        Err(Trouble::Retry(StopReason::NotFinite { step: h }))
    }

    /// Farther than where the switch is, as seen from the start, nothing that is smooth from there on need be.
    fn in_doubt(&self, run: &Run<'_>, h: f64) -> bool {
        self.switch.is_some_and(|switch| h > run.t - switch)
    }

    /// The derivative at the end of the step, if the error test needs it.
    fn end_derivative(&mut self, run: &mut Run<'_>, t_new: f64) -> Result<(), Trouble> {
        let h = t_new - run.t;
        let end = self.stage(self.end());
        let end = &mut self.stages[end];
        run.rhs(t_new, &self.y_new[..self.n], end, h)?;
        if all_finite(end) { Ok(()) } else { Err(Trouble::Retry(StopReason::NotFinite { step: h })) }
    }

    /// Projection, derivative at the end, and the interpolation if it will be needed.
    fn end_of_step(&mut self, run: &mut Run<'_>, t_new: f64) -> Result<(), Trouble> {
        let h = t_new - run.t;
        // The error's place is free by now.
        self.error.copy_from_slice(&self.y_new);
        run.project(t_new, &mut self.y_new[..self.n], h)?;
        if !all_finite(&self.y_new) {
            return Err(Trouble::Retry(StopReason::NotFinite { step: h }));
        }
        if !self.pair.error.uses_end() || run.options.steps_are_given() || self.error != self.y_new {
            self.end_derivative(run, t_new)?;
        }
        let limited = !run.options.steps_are_given() && self.is_limited_by_stability(run, h);
        if let Some(time) = run.sample_before(t_new) {
            if limited {
                return Err(Trouble::EndAt(time));
            }
            self.prepare_interpolation(run, t_new)?;
            if !run.options.steps_are_given() && self.interpolation_fails(run, h) {
                return Err(Trouble::EndAt(time));
            }
        } else if self.approaching {
            self.prepare_interpolation(run, t_new)?;
        }
        Ok(())
    }

    /// Estimates `h |lambda|` from the last two stages, both at the end of the step (Hairer & Wanner, "Solving Ordinary
    /// Differential Equations II", 2nd ed. 1996, section IV.2). Where it comes near the border of stability, parts of the
    /// solution that have died out keep errors which the error test tolerates but the interpolation amplifies.
    fn is_limited_by_stability(&mut self, run: &mut Run<'_>, h: f64) -> bool {
        let ranges = [0, self.end() - 1, self.end()].map(|number| self.stage(number));
        let [start, last, end] = ranges.map(|range| &self.stages[range]);
        let argument = &self.arguments[self.stage(self.end() - 1)];
        let (y_new, error) = (&self.y_new[..self.n], &mut self.error[..self.n]);
        for (i, error) in error.iter_mut().enumerate() {
            *error = y_new[i] - argument[i];
        }
        let distance = run.system.size(y_new, error);
        for (i, error) in error.iter_mut().enumerate() {
            *error = end[i] - last[i];
        }
        let change = run.system.size(y_new, error);
        let product = if distance > 0.0 { h * change / distance } else { 0.0 };
        if self.suspicion.is_some() {
            // How much the derivative changes along the step.
            for ((error, end), start) in error.iter_mut().zip(end).zip(start) {
                *error = end - start;
            }
            let along = run.system.size(y_new, error);
            let speed = run.system.size(y_new, start).max(run.system.size(y_new, end));
            let slowness = if along > 0.0 { product * speed / along } else { 0.0 };
            self.signs = Signs { step: h, share: product / self.pair.stability, slowness };
        }
        let limited = product > NEAR_BORDER * self.pair.stability;
        self.stiffness.see(limited);
        limited
    }

    /// Further stages and the polynomial through the step (Hairer, Norsett & Wanner, section II.6). With
    /// `s = (t - t_old) / h` and the rows `r_k` of `polynomial` it reads
    /// `r0 + s (r1 + (1-s) (r2 + s (r3 + (1-s) (r4 + s (r5 + ...)))))`.
    fn prepare_interpolation(&mut self, run: &mut Run<'_>, t_new: f64) -> Result<(), Trouble> {
        let n = whole_lanes(self.n);
        let (t, h) = (run.t, t_new - run.t);
        let end = self.end();
        for (i, row) in self.pair.a_dense.iter().enumerate() {
            let i = i + end + 1;
            combine(row, &self.stages, h, Some(&self.start), &mut self.argument);
            let stage = self.stage(i);
            run.rhs(t + self.pair.c[i] * h, &self.argument[..self.n], &mut self.stages[stage], h)?;
        }
        let (first, rest) = self.polynomial.split_at_mut(n);
        let (rises, rest) = rest.split_at_mut(n);
        let (bends, rest) = rest.split_at_mut(n);
        first.copy_from_slice(&self.start);
        let ends = self.start.iter().zip(&self.y_new);
        let rates = self.stages[..n].iter().zip(&self.stages[end * n..][..n]);
        let found = rises.iter_mut().zip(bends).zip(rest);
        for (((start, new), (rate, new_rate)), ((rise, bend), last)) in ends.zip(rates).zip(found) {
            *rise = new - start;
            *bend = h * rate - *rise;
            *last = *rise - h * new_rate - *bend;
        }
        for (k, row) in self.pair.d.iter().enumerate() {
            let coefficient = &mut self.polynomial[(4 + k) * n..(5 + k) * n];
            combine(row, &self.stages, h, None, coefficient);
        }
        Ok(())
    }

    /// Whether the interpolation of a step in doubt is no solution: it is held against the states at which its further stages were
    /// evaluated, which are of an order less and take no evaluations. Where friction in a plane begins to slide these stages meet
    /// directions of velocities that are nearly zero, and their errors exceed those of the end by up to a hundred. Steps from there on are
    /// in doubt.
    fn interpolation_fails(&mut self, run: &mut Run<'_>, h: f64) -> bool {
        let begins = self.beginning == Some(run.t);
        if !begins && !self.in_doubt(run, h) {
            return false;
        }
        let n = self.n;
        let mut at = vec![0.0; n];
        let fails = (self.end() + 1..self.pair.c.len()).any(|stage| {
            combine(self.pair.a_dense[stage - self.end() - 1], &self.stages, h, Some(&self.start), &mut self.argument);
            self.interpolate(self.pair.c[stage], &mut at);
            at.iter_mut().zip(&self.argument).for_each(|(at, state)| *at -= state);
            let apart = run.system.error_norm(&self.start[..n], &self.y_new[..n], &at);
            apart.is_nan() || apart > FAR_FROM_STAGES
        });
        if fails && begins {
            self.switch = self.beginning;
        }
        fails
    }
}

impl Stepper for Explicit {
    fn reach(&self) -> f64 {
        REACH
    }

    fn seen(&self) -> &[f64] {
        &self.seen
    }

    fn felt(&self, number: usize, out: &mut [f64]) {
        out.copy_from_slice(self.state_of_stage(self.weighty[number]));
    }

    /// `k_0 = f(t, y)`
    fn start(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<(), Trouble> {
        run.start_rates(y, &mut self.stages[..self.n])
    }

    fn make_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Fault> {
        self.stages_of_step(run, y, t_new)?;
        Ok(self.end_of_step(run, t_new)?)
    }

    fn go_on(&mut self, _h: f64) {
        let end = self.stage(self.end());
        self.stages.copy_within(end, 0);
    }

    fn y_new(&self) -> &[f64] {
        &self.y_new[..self.n]
    }

    fn rates(&self) -> [&[f64]; 2] {
        [&self.stages[..self.n], &self.stages[self.stage(self.end())]]
    }

    fn degree(&self) -> usize {
        3 + self.pair.d.len()
    }

    fn interpolate(&self, share: f64, out: &mut [f64]) {
        interpolate(&self.polynomial, 4 + self.pair.d.len(), share, out);
    }

    fn add_nodes(&mut self, run: &mut Run<'_>, _y: &[f64], t_new: f64) -> Result<(), Trouble> {
        let (t, h) = (run.t, t_new - run.t);
        self.summed.iter().try_for_each(|(stage, weights)| {
            run.add_node((t + self.pair.c[*stage] * h).min(t_new), self.state_of_stage(*stage), h, *weights)
        })
    }

    fn always_interpolates(&self) -> bool {
        false
    }

    fn expect_interpolation(&mut self, needed: bool) {
        self.approaching = needed;
    }
}

impl Adaptive for Explicit {
    fn try_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<f64, Fault> {
        self.stages_of_step(run, y, t_new)?;
        if self.pair.error.uses_end() {
            self.end_derivative(run, t_new)?;
        }
        let error = self.error_of_step(run, y, t_new - run.t)?;
        if error <= 1.0 {
            self.end_of_step(run, t_new)?;
        }
        Ok(error)
    }

    /// Starting step size (section II.4): `h^order max(|y'|, |y''|) = 0.01`, with `y''` from one
    /// explicit Euler step in which the state changes by a hundredth of its size, or of what the error test allows where it is smaller
    /// (round-off where the state begins at zero).
    fn first_step(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<f64, Trouble> {
        let n = self.n;
        let (t, length) = (run.t, run.span.t_end - run.span.t_start);
        let longest = run.longest_step(y).min(length);
        let (start, others) = self.stages.split_at_mut(whole_lanes(n));
        let (start, argument, error) = (&start[..n], &mut self.argument[..n], &mut self.error[..n]);

        let size = run.system.error_norm(y, y, y);
        let speed = run.system.error_norm(y, y, start);
        let tiny = 1e-6 * length;
        let guess = if size > 1e-5 && speed > 1e-5 { 0.01 * (size.max(1.0) / speed) } else { tiny };
        let h = if guess.is_finite() { guess.max(run.least_first_step()).min(longest) } else { tiny };

        for (i, argument) in argument.iter_mut().enumerate() {
            *argument = y[i] + h * start[i];
        }
        match run.rhs(t + h, argument, &mut others[..n], h) {
            Ok(()) => {}
            // The Euler step left the domain: start well inside.
            Err(Trouble::Retry(_)) => return Ok(RECOVERY_FACTOR * h),
            Err(trouble) => return Err(trouble),
        }
        for (i, error) in error.iter_mut().enumerate() {
            *error = others[i] - start[i];
        }
        let acceleration = run.system.error_norm(y, y, error) / h;
        let largest = speed.max(acceleration);
        let predicted =
            if largest <= 1e-15 { tiny.max(h * 1e-3) } else { (0.01 / largest).powf(1.0 / self.pair.order) };
        let step = predicted.min(100.0 * h).max(run.least_first_step()).min(longest);
        Ok(if step.is_finite() { step } else { h })
    }

    fn size_after_acceptance(&mut self, tried: f64, _h: f64, error: f64) -> f64 {
        tried * self.control.factor_after_acceptance(error)
    }

    fn size_after_rejection(&mut self, tried: f64, error: f64) -> f64 {
        tried * self.control.factor_after_rejection(error)
    }

    fn rejected(&mut self) {
        self.control.after_rejection = true;
    }

    fn forget(&mut self) {
        self.control.forget();
    }

    fn doubt_from(&mut self, t: f64) {
        self.switch = Some(t);
    }

    fn gives_way(&mut self, run: &mut Run<'_>) -> bool {
        match &mut self.suspicion {
            Some(suspicion) => {
                self.suspect = suspicion.see(run, self.signs, &self.y_new[..self.n], &self.stages[..self.n]);
            }
            None if self.stiffness.is_found() => {
                run.counters.stiff_from.get_or_insert(run.t);
            }
            None => {}
        }
        self.suspect.is_some()
    }
}

/// Step size control (section II.4, program DOP853).
#[derive(Debug, Clone)]
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
    fn new(options: &Options, pair: &Pair) -> Self {
        let beta = options.beta.unwrap_or(pair.beta);
        Self {
            exponent: 1.0 / pair.order - pair.beta_share * beta,
            beta,
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

    /// Nothing is known of the steps before.
    fn forget(&mut self) {
        self.last_error = LEAST_REMEMBERED_ERROR;
        self.after_rejection = false;
    }
}
