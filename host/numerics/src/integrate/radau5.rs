//! Implicit Runge-Kutta method of order 5 for stiff problems.

use nalgebra::Complex;

use super::enclosure::{Interpolation, is_continuous};
use super::events::{Events, Next};
use super::jacobian::Jacobian;
use super::lu::Lu;
use super::rivals::Defender;
use super::run::{Run, Trouble, all_finite};
use super::{Accepted, IntegrateError, Integrator, Options, Outcome, Span, StopReason, System};

/// Stages of the method.
const STAGES: usize = 3;
/// Iterations of Newton's method before a step is given up.
const MOST_ITERATIONS: usize = 7;
/// The same for steps of a fixed size, which cannot be made smaller.
const MOST_ITERATIONS_FIXED: usize = 50;
/// Relative accuracy of the iterations in steps of a fixed size.
const FIXED_ACCURACY: f64 = 1e-13;
/// Rate of convergence up to which the Jacobian is kept for the next step.
const KEEP_JACOBIAN: f64 = 1e-3;
/// Ratios of step sizes within which step size and factorisation are kept.
const KEEP_STEP: [f64; 2] = [1.0, 1.2];
/// Limits of the ratio of step sizes.
const RATIO: [f64; 2] = [0.2, 8.0];
const SAFETY: f64 = 0.9;
/// Weight of the tolerance in the error test, `0.1 tol^(2/3)`: the error estimate is of order 3, the result of order 5
/// (program RADAU5).
const TEST_FACTOR: f64 = 0.1;
/// Error of the interpolation in tolerances, as the error test estimates it, up to which samples are interpolated.
const INTERPOLATED_ERROR: f64 = 1.0;
/// Relative change of the state by the last iteration up to which it does for sums, too: their rates bend more than the others,
/// and where one iteration solves all the rest, it does not solve these.
const SUMS_ACCURACY: f64 = 1e-7;
/// Share of a step within which it is made to end at a sample rather than beside it.
const NEAR_SAMPLE: f64 = 0.01;
/// Least error that the predictive control remembers, in units of the error test.
const LEAST_REMEMBERED_ERROR: f64 = 1e-2;

/// Share of a step by which its interpolation may be continued: its error goes with the distance from the end.
const REACH: f64 = 1e-3;

/// Abscissae `(4 - sqrt 6)/10`, `(4 + sqrt 6)/10`, 1.
const C: [f64; STAGES] = [0.155_051_025_721_682_2, 0.644_948_974_278_317_8, 1.0];
/// The method's matrix: `(88 - 7 sqrt 6)/360` ... `1/9`.
const A: [[f64; STAGES]; STAGES] = [
    [0.196_815_477_223_660_4, -0.065_535_425_850_198_4, 0.023_770_974_348_220_15],
    [0.394_424_314_739_087_3, 0.292_073_411_665_228_5, -0.041_548_752_125_997_93],
    [0.376_403_062_700_467_27, 0.512_485_826_188_421_6, 1.0 / 9.0],
];
/// `T^-1 A^-1 T` is block diagonal: one real eigenvalue, one complex pair.
const T: [[f64; STAGES]; STAGES] = [
    [9.123_239_487_089_295E-2, -0.141_255_295_020_954_2, -3.002_919_410_514_742_4E-2],
    [0.241_717_932_707_107, 0.204_129_352_293_799_93, 0.382_942_112_757_261_9],
    [0.966_048_182_615_093, 1.0, 0.0],
];
const T_INVERSE: [[f64; STAGES]; STAGES] = [
    [4.325_579_890_063_155, 0.339_199_251_815_809_87, 0.541_770_539_935_874_9],
    [-4.178_718_591_551_905, -0.327_682_820_761_062_4, 0.476_623_554_500_550_45],
    [-0.502_872_634_945_786_9, 2.571926949855605, -0.596_039_204_828_224_9],
];
/// Shares of a step at which the equations are evaluated.
const SEEN: [f64; STAGES + 1] = [0.0, C[0], C[1], C[2]];
/// The real eigenvalue of `A^-1`.
const GAMMA: f64 = 3.637_834_252_744_496;
/// The complex one: `ALPHA + i BETA`.
const ALPHA: f64 = 2.681_082_873_627_752;
const BETA: f64 = 3.050_430_199_247_410_5;
/// Weights of the error estimate, `-(13 + 7 sqrt 6)/3`, `(-13 + 7 sqrt 6)/3`, `-1/3`.
const E: [f64; STAGES] = [-10.048_809_399_827_414, 1.382_142_733_160_748, -1.0 / 3.0];

/// Radau IIA of order 5 after Hairer & Wanner, "Solving Ordinary Differential Equations II", 2nd ed. 1996, section IV.8
/// and the program RADAU5: simplified Newton iterations in transformed variables (a real and a complex linear system),
/// Jacobian and factorisation used again where they serve, predictive step control after Gustafsson.
///
/// Deviations from the book:
/// - the new state is projected, and the derivative there starts the next step;
/// - norms come from the system, and the error test aims at its tolerance only if [`System::tolerance`] is known;
/// - the interpolation is of order 3 only, as the error estimate is; where that estimate is above the tolerance, steps end
///   at samples instead.
///
/// With [`Options::fixed_step`] the error is not looked at.
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
    y_end: Vec<f64>,
    y_new: Vec<f64>,
    argument: Vec<f64>,
    error: Vec<f64>,
}

/// What a step carries to the next.
struct Control {
    /// Step size of the factorisation in force.
    factored: Option<f64>,
    jacobian_is_current: bool,
    has_jacobian: bool,
    /// Size of the step whose collocation polynomial starts the iterations.
    polynomial_of: Option<f64>,
    /// `theta / (1 - theta)` of Newton's method.
    convergence: f64,
    theta: f64,
    iterations: usize,
    /// Step size and error of the last accepted step.
    last: Option<(f64, f64)>,
    /// Step size and error, in tolerances, of the last step: for the interpolation.
    last_estimate: Option<(f64, f64)>,
    rejected: bool,
    /// Error test and tolerance, both as shares of the tolerance.
    test: f64,
    /// Largest error of Newton's method, as a share of the error test.
    newton: f64,
    most_iterations: usize,
}

impl Control {
    fn new(tolerance: Option<f64>) -> Self {
        let relative = tolerance.map_or(1e-6, |tol| TEST_FACTOR * tol.powf(2.0 / 3.0));
        Self {
            factored: None,
            jacobian_is_current: false,
            has_jacobian: false,
            polynomial_of: None,
            convergence: 1.0,
            theta: 2.0 * KEEP_JACOBIAN,
            iterations: 0,
            last: None,
            last_estimate: None,
            rejected: false,
            test: tolerance.map_or(1.0, |tol| (relative / tol).max(1.0)),
            most_iterations: MOST_ITERATIONS,
            newton: (10.0 * f64::EPSILON / relative).max(relative.sqrt().min(0.03)),
        }
    }

    /// Ratio of the size of the next step to that of one with this error (section IV.8, eq. 8.21).
    fn ratio(&self, error: f64) -> f64 {
        let iterations = self.iterations as f64;
        let most = MOST_ITERATIONS as f64;
        let safety = SAFETY.min(SAFETY * (1.0 + 2.0 * most) / (iterations + 2.0 * most));
        (safety / error.max(1e-10).powf(0.25)).clamp(RATIO[0], RATIO[1])
    }

    /// The same after a step that was accepted: not more than its predecessor suggests (eq. 8.28).
    fn ratio_after_acceptance(&mut self, h: f64, error: f64) -> f64 {
        let mut ratio = self.ratio(error);
        if let Some((last_h, last_error)) = self.last {
            let growth = (error * error / last_error).max(1e-40).powf(0.25) / SAFETY;
            ratio = ratio.min((h / last_h / growth).clamp(RATIO[0], RATIO[1]));
        }
        self.last = Some((h, error.max(LEAST_REMEMBERED_ERROR)));
        if self.rejected { ratio.min(1.0) } else { ratio }
    }

    /// The equations switched: nothing that is known of the last steps holds for the next.
    fn start_anew(&mut self) {
        self.has_jacobian = false;
        self.polynomial_of = None;
        self.last = None;
        self.last_estimate = None;
    }

    /// The iterations failed; where the Jacobian is one of another state, a new one is taken.
    fn slow(&mut self, share: f64) -> Fault {
        self.theta = 1.0;
        self.factored = None;
        Fault::Slow(share)
    }

    /// Whether samples inside a step of this size will be good.
    fn interpolates(&self, h: f64) -> bool {
        self.last_estimate.is_none_or(|(last, error)| error * (h / last).powi(4) <= INTERPOLATED_ERROR)
    }
}

/// Why a step was not made.
enum Fault {
    /// Newton's method converges too slowly: try again with this share of the step.
    Slow(f64),
    Trouble(Trouble),
}

impl From<Trouble> for Fault {
    fn from(trouble: Trouble) -> Self {
        Self::Trouble(trouble)
    }
}

impl Integrator for Radau5 {
    fn name(&self) -> &'static str {
        "radau5"
    }

    fn may_use_jacobian(&self) -> bool {
        true
    }

    fn integrate(
        &mut self,
        system: &mut dyn System,
        y: &mut [f64],
        span: &Span<'_>,
        options: &Options,
    ) -> Result<Outcome, IntegrateError> {
        Run::through(system, y, span, options, |run, y| self.whole_run(run, y))
    }
}

impl Radau5 {
    fn whole_run(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        run.sample_start(y)?;
        if run.t == run.span.t_end {
            return Ok(());
        }
        let first = run.options.first_step;
        self.continue_run(run, y, first, None).map(|_| ())
    }

    /// From an accepted state, whose samples are taken, to the end; `first_step` is chosen here if absent. Where the defender
    /// gives up, the run is not at its end: then the step for the method to follow is returned.
    pub(super) fn continue_run(
        &mut self,
        run: &mut Run<'_>,
        y: &mut [f64],
        first_step: Option<f64>,
        defender: Option<Defender>,
    ) -> Result<Option<f64>, Trouble> {
        self.allocate(y.len());
        self.start_derivative(run, y)?;
        let mut control = Control::new(run.system.tolerance());
        if let Some(h) = run.options.fixed_step {
            return self.fixed_steps(run, y, &mut control, h).map(|()| None);
        }
        let h = first_step.unwrap_or_else(|| self.first_step(run, y, &control));
        self.adaptive_steps(run, y, &mut control, h, defender)
    }

    fn allocate(&mut self, n: usize) {
        self.real.resize(n);
        self.complex.resize(n);
        self.jacobian.resize(n);
        self.pair.clear();
        self.pair.resize(n, Complex::new(0.0, 0.0));
        let groups = [&mut self.z, &mut self.w, &mut self.f, &mut self.polynomial];
        let single = [&mut self.start, &mut self.y_end, &mut self.y_new, &mut self.argument, &mut self.error];
        for work in groups.into_iter().flatten().chain(single) {
            work.clear();
            work.resize(n, 0.0);
        }
    }

    fn adaptive_steps(
        &mut self,
        run: &mut Run<'_>,
        y: &mut [f64],
        control: &mut Control,
        first_step: f64,
        mut defender: Option<Defender>,
    ) -> Result<Option<f64>, Trouble> {
        let mut h = first_step;
        let mut events = Events::new(run, REACH);
        // Where the next step ends because of a switch.
        let mut end_at: Option<f64> = None;
        while run.t < run.span.t_end {
            run.check_step_limit()?;
            h = h.min(run.longest_step(y));
            let t_new = end_at.take().unwrap_or_else(|| self.step_end(run, control, h));
            let t_new = events.end_of_step(run, t_new, &SEEN);
            let tried = t_new - run.t;
            if tried <= 0.0 {
                return Err(Trouble::Stop(StopReason::StepTooSmall { step: h }));
            }
            let reason = match self.try_step(run, y, t_new, control) {
                Ok(error) if error <= 1.0 => {
                    let start = run.t;
                    if events.watches_anything() {
                        let at =
                            |share: f64, out: &mut [f64]| continued(&self.polynomial, &self.y_new, share - 1.0, out);
                        let step = Interpolation { start, h: tried, degree: STAGES, seen: &SEEN, at: &at };
                        if let Some(again) = events.missed(run, y, &step)? {
                            (h, end_at) = (again.h, again.end_at);
                            // The polynomial is no longer that of the last step.
                            control.polynomial_of = None;
                            continue;
                        }
                    }
                    self.finish_step(run, y, t_new, control)?;
                    let ratio = control.ratio_after_acceptance(tried, error);
                    control.rejected = false;
                    // A step shortened for a sample or the end says little against the size asked for.
                    let wanted =
                        if tried < 0.999 * h { (tried * ratio).max(h.min(tried * RATIO[1])) } else { tried * ratio };
                    let kept = (KEEP_STEP[0]..=KEEP_STEP[1]).contains(&(wanted / tried));
                    h = if kept && control.theta <= KEEP_JACOBIAN { tried } else { wanted };
                    let (polynomial, end) = (&self.polynomial, &self.y_end);
                    match events.accepted(run, y, start, |share, out| continued(polynomial, end, share - 1.0, out))? {
                        Next::Plain => {}
                        Next::EndAt(time) => end_at = Some(time),
                        Next::Passed(size) => h = size,
                        Next::Resumed(size) => h = h.max(size),
                        Next::Crossed(size) => {
                            control.start_anew();
                            self.start_derivative(run, y)?;
                            h = size.min(self.first_step(run, y, control));
                        }
                        Next::Jumped(size) if run.t < run.span.t_end => {
                            control.start_anew();
                            let before = self.start.clone();
                            self.start_derivative(run, y)?;
                            let continuous = is_continuous(run, y, tried, &before, &self.start);
                            h = if continuous { size } else { size.min(self.first_step(run, y, control)) };
                        }
                        Next::Jumped(_) => {}
                    }
                    let given_up = defender.as_mut().and_then(|defender| defender.see(run, &self.jacobian.matrix));
                    if given_up.is_some() && run.t < run.span.t_end {
                        return Ok(given_up);
                    }
                    continue;
                }
                Ok(error) => {
                    h = tried * if control.last.is_none() { 0.1 } else { control.ratio(error).min(0.9) };
                    end_at = events.rejected(run, y, &self.start, t_new, &self.y_new)?;
                    StopReason::StepTooSmall { step: h }
                }
                Err(Fault::Slow(share)) => {
                    h = tried * share;
                    control.factored = None;
                    if self.predict(y, tried, control) {
                        end_at = events.rejected(run, y, &self.start, t_new, &self.y_new)?;
                    }
                    StopReason::NoConvergence { step: tried }
                }
                Err(Fault::Trouble(Trouble::EndAt(time))) => {
                    run.counters.rejected += 1;
                    run.counters.recoveries.sample_step += 1;
                    h = time - run.t;
                    continue;
                }
                Err(Fault::Trouble(Trouble::Retry(reason))) => {
                    h = tried * super::explicit::RECOVERY_FACTOR;
                    reason
                }
                Err(Fault::Trouble(trouble)) => return Err(trouble),
            };
            run.reject(&reason);
            control.rejected = true;
            if h < run.smallest_step() {
                return Err(Trouble::Stop(reason));
            }
        }
        Ok(None)
    }

    fn fixed_steps(&mut self, run: &mut Run<'_>, y: &mut [f64], control: &mut Control, h: f64) -> Result<(), Trouble> {
        // Without an error test, the iterations go on nearly to round-off.
        control.newton = run.system.tolerance().map_or(1e-6, |tol| (FIXED_ACCURACY / tol).min(1e-2)) / control.test;
        control.most_iterations = MOST_ITERATIONS_FIXED;
        let count = run.fixed_steps(h);
        let mut events = Events::new(run, REACH);
        for k in 0..count {
            run.check_step_limit()?;
            let t_new = run.fixed_step_end(k, count);
            let made = self.solve_step(run, y, t_new, control).and_then(|()| Ok(self.end_of_step(run, t_new)?));
            match made {
                Ok(()) => {
                    let at = |share: f64, out: &mut [f64]| continued(&self.polynomial, &self.y_new, share - 1.0, out);
                    let (start, h) = (run.t, t_new - run.t);
                    events.note_missed(run, &Interpolation { start, h, degree: STAGES, seen: &SEEN, at: &at })?;
                    self.finish_step(run, y, t_new, control)?;
                }
                Err(fault) => {
                    run.counters.rejected += 1;
                    return Err(match fault {
                        Fault::Trouble(trouble) => trouble,
                        Fault::Slow(_) => Trouble::Stop(StopReason::NoConvergence { step: t_new - run.t }),
                    });
                }
            }
        }
        Ok(())
    }

    /// End of the next step: a sample inside it, if interpolation would not do.
    fn step_end(&self, run: &Run<'_>, control: &Control, h: f64) -> f64 {
        let t_new = run.step_end(h);
        let size = t_new - run.t;
        let Some(time) = run.sample_between(run.t + NEAR_SAMPLE * size, run.t + 2.0 * size) else { return t_new };
        // A sample hit but for round-off is hit.
        if (time - t_new).abs() <= NEAR_SAMPLE * size {
            return time;
        }
        if control.interpolates(size) {
            return t_new;
        }
        // Two equal steps rather than a long and a tiny one.
        if time < t_new { time } else { run.t + 0.5 * (time - run.t) }
    }

    /// A step up to, but not including, what makes it final. Returns its error, 1 = what the error test allows.
    fn try_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64, control: &mut Control) -> Result<f64, Fault> {
        self.solve_step(run, y, t_new, control)?;
        let error = self.error_of_step(run, y, t_new - run.t, control)?;
        if error > 1.0 {
            return Ok(error);
        }
        let in_tolerances = error * control.test;
        control.last_estimate = Some((t_new - run.t, in_tolerances));
        if in_tolerances > INTERPOLATED_ERROR {
            // Close to the start of the step the interpolation is good in any case.
            if let Some(time) = run.sample_between(run.t + NEAR_SAMPLE * (t_new - run.t), t_new) {
                return Err(Trouble::EndAt(time).into());
            }
        }
        self.end_of_step(run, t_new)?;
        Ok(error)
    }

    fn start_derivative(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<(), Trouble> {
        run.rhs(run.t, y, &mut self.start, 0.0)?;
        if all_finite(&self.start) {
            return Ok(());
        }
        Err(Trouble::Stop(StopReason::NotFinite { step: 0.0 }))
    }

    /// A step in which the state changes, by its first derivative, by what the error test allows.
    fn first_step(&mut self, run: &mut Run<'_>, y: &[f64], control: &Control) -> f64 {
        let length = run.span.t_end - run.span.t_start;
        let speed = run.system.error_norm(y, y, &self.start) / control.test;
        let step = if speed > 0.0 { 1.0 / speed } else { f64::INFINITY };
        step.clamp(1e-10 * length, 1e-3 * length)
    }

    /// Jacobian and factorisations for a step of size `h`, as far as they are not in force.
    fn prepare(&mut self, run: &mut Run<'_>, y: &[f64], h: f64, control: &mut Control) -> Result<(), Fault> {
        if !control.has_jacobian || (control.theta > KEEP_JACOBIAN && !control.jacobian_is_current) {
            // Newton's method failed with that of an earlier state.
            run.counters.recoveries.fresh_jacobian += usize::from(control.has_jacobian && control.theta >= 1.0);
            self.jacobian.take(run, y, &self.start)?;
            control.has_jacobian = true;
            control.jacobian_is_current = true;
            control.factored = None;
        }
        if control.factored.is_some_and(|factored| (factored - h).abs() <= 1e-12 * h) {
            return Ok(());
        }
        run.counters.factorisations += 1;
        let regular = self.real.factor(GAMMA / h, &self.jacobian.matrix)
            && self.complex.factor(Complex::new(ALPHA / h, BETA / h), &self.jacobian.matrix);
        control.factored = regular.then_some(h);
        if regular { Ok(()) } else { Err(Fault::Slow(0.5)) }
    }

    /// The new state, not yet projected, and the increments `z` of the stages: `z_i = h sum_j a_ij f(t + c_j h, y + z_j)`.
    fn solve_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64, control: &mut Control) -> Result<(), Fault> {
        let (t, h) = (run.t, t_new - run.t);
        self.prepare(run, y, h, control)?;
        self.guess(h, control);
        control.convergence = control.convergence.max(f64::EPSILON).powf(0.8);
        control.theta = KEEP_JACOBIAN;
        let (mut last, mut last_rate) = (0.0, 0.0);
        for iteration in 1..=control.most_iterations {
            run.counters.newton_iterations += 1;
            for (i, c) in C.iter().enumerate() {
                for ((argument, start), z) in self.argument.iter_mut().zip(y).zip(&self.z[i]) {
                    *argument = start + z;
                }
                run.rhs(t + c * h, &self.argument, &mut self.f[i], h)?;
            }
            let sums = run.system.sums_from();
            let change = self.correct(run, y, h) / control.test;
            if !change.is_finite() {
                control.theta = 1.0;
                return Err(Trouble::Retry(StopReason::NotFinite { step: h }).into());
            }
            if iteration > 1 {
                let rate: f64 = change / last;
                control.theta = if iteration == 2 { rate } else { (rate * last_rate).sqrt() };
                last_rate = rate;
                if control.theta >= 0.99 {
                    return Err(control.slow(0.5));
                }
                control.convergence = control.theta / (1.0 - control.theta);
                let left = control.most_iterations.saturating_sub(1 + iteration) as i32;
                let expected = control.convergence * change * control.theta.powi(left) / control.newton;
                if expected >= 1.0 && control.convergence * change > control.newton {
                    let share = 0.8 * expected.clamp(1e-4, 20.0).powf(-1.0 / f64::from(4 + left));
                    return Err(control.slow(share));
                }
            }
            last = change.max(f64::MIN_POSITIVE);
            if control.convergence * change <= control.newton {
                control.iterations = iteration;
                if change * control.test * run.system.tolerance().unwrap_or(1.0) > SUMS_ACCURACY && sums < y.len() {
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
        Err(control.slow(0.5))
    }

    /// Increments of sums, which the iterations are not judged by: those that their rates at the stages give.
    fn sum_up(&mut self, from: usize, h: f64) {
        for (z, row) in self.z.iter_mut().zip(&A) {
            for (k, sum) in z[from..].iter_mut().enumerate() {
                *sum = h * row.iter().zip(&self.sum_rates).map(|(a, rates)| a * rates[k]).sum::<f64>();
            }
        }
    }

    /// The end of a step of size `h` as the last one predicts it, into `y_new`; false where there is none.
    fn predict(&mut self, y: &[f64], h: f64, control: &Control) -> bool {
        let Some(last) = control.polynomial_of else { return false };
        for (k, value) in self.y_new.iter_mut().enumerate() {
            *value = y[k] + rise(&self.polynomial, k, h / last);
        }
        true
    }

    /// Starts the iterations: the polynomial of the last step, continued.
    fn guess(&mut self, h: f64, control: &Control) {
        let Some(last) = control.polynomial_of else {
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
        for k in 0..n {
            let f = [self.f[0][k], self.f[1][k], self.f[2][k]];
            let side = |i: usize| T_INVERSE[i][0] * f[0] + T_INVERSE[i][1] * f[1] + T_INVERSE[i][2] * f[2];
            let (w1, w2, w3) = (self.w[0][k], self.w[1][k], self.w[2][k]);
            self.error[k] = side(0) - gamma * w1;
            self.pair[k] = Complex::new(side(1) - alpha * w2 + beta * w3, side(2) - alpha * w3 - beta * w2);
        }
        self.real.solve(&mut self.error);
        self.complex.solve(&mut self.pair);
        for k in 0..n {
            self.f[0][k] = self.error[k];
            self.f[1][k] = self.pair[k].re;
            self.f[2][k] = self.pair[k].im;
            for (w, f) in self.w.iter_mut().zip(&self.f) {
                w[k] += f[k];
            }
        }
        transform(&T, &self.w, &mut self.z);
        // Mean square over the transformed corrections, each in the system's norm.
        let squares: f64 = self.f.iter().map(|f| run.system.error_norm(y, y, f).powi(2)).sum();
        (squares / STAGES as f64).sqrt()
    }

    /// Error of the step, 1 = what the test allows: `(gamma/h - J)^-1 (f(t, y) + sum e_i z_i / h)`, once more through the
    /// right side where that is too much after a rejection or at the start (eq. 8.19, 8.20).
    fn error_of_step(&mut self, run: &mut Run<'_>, y: &[f64], h: f64, control: &Control) -> Result<f64, Trouble> {
        for k in 0..y.len() {
            self.f[0][k] = (E[0] * self.z[0][k] + E[1] * self.z[1][k] + E[2] * self.z[2][k]) / h;
            self.error[k] = self.f[0][k] + self.start[k];
        }
        self.real.solve(&mut self.error);
        let mut size = run.system.error_norm(y, &self.y_new, &self.error) / control.test;
        if size > 1.0 && (control.last.is_none() || control.rejected) {
            for (k, argument) in self.argument.iter_mut().enumerate() {
                *argument = y[k] + self.error[k];
            }
            run.rhs(run.t, &self.argument, &mut self.f[1], h)?;
            for (k, error) in self.error.iter_mut().enumerate() {
                *error = self.f[0][k] + self.f[1][k];
            }
            self.real.solve(&mut self.error);
            size = run.system.error_norm(y, &self.y_new, &self.error) / control.test;
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

    /// Makes the step final: samples, `accept`, `step_done`.
    fn finish_step(
        &mut self,
        run: &mut Run<'_>,
        y: &mut [f64],
        t_new: f64,
        control: &mut Control,
    ) -> Result<(), Trouble> {
        let (t, h) = (run.t, t_new - run.t);
        y.copy_from_slice(&self.y_new);
        self.y_end.copy_from_slice(y);
        let (polynomial, end) = (&self.polynomial, &self.y_end);
        let accepted = run.finish_step(t_new, y, &mut self.argument, |time, out| {
            continued(polynomial, end, (time - t) / h - 1.0, out);
        })?;
        control.polynomial_of = Some(h);
        control.jacobian_is_current = false;
        self.start.copy_from_slice(&self.f[2]);
        if accepted == Accepted::Changed && t_new < run.span.t_end {
            self.start_derivative(run, y)?;
        }
        Ok(())
    }
}

/// The state at the share `s` of the step after its end (negative inside it).
fn continued(polynomial: &[Vec<f64>; STAGES], end: &[f64], s: f64, out: &mut [f64]) {
    out.iter_mut().enumerate().for_each(|(k, value)| *value = end[k] + rise(polynomial, k, s));
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
