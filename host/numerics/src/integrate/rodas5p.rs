//! Rosenbrock method of order 5 for stiff problems and loose tolerances.

use super::enclosure::{Interpolation, ascending, is_continuous};
use super::events::{Events, Next};
use super::jacobian::Jacobian;
use super::lu::Lu;
use super::run::{Run, Trouble, all_finite};
use super::{Accepted, IntegrateError, Integrator, Options, Outcome, Span, StopReason, System};

/// Stages of the method.
pub(super) const STAGES: usize = 8;
/// Diagonal of the method's matrix.
pub(super) const GAMMA: f64 = 0.211_937_563_194_290_14;
/// Abscissae of the stages; 1 from the sixth on.
pub(super) const C: [f64; STAGES] = [
    0.0,
    0.635_812_689_582_870_4,
    0.409_579_839_339_753_5,
    0.976_930_672_506_071_6,
    0.428_840_360_955_866_4,
    1.0,
    1.0,
    1.0,
];
/// Factors of the derivative with respect to time; 0 from the sixth on.
pub(super) const D: [f64; STAGES] = [
    0.211_937_563_194_290_14,
    -0.423_875_126_388_580_27,
    -0.338_462_712_623_592_4,
    1.804_645_287_288_273_4,
    2.325_825_639_765_069,
    0.0,
    0.0,
    0.0,
];
/// Arguments of the stages. The last three continue the row of the sixth with ones, and so do the weights.
pub(super) const A: [&[f64]; STAGES] = [
    &[],
    &[3.0],
    &[2.849_394_379_747_939, 0.458_422_422_044_639_23],
    &[-6.954_028_509_809_101, 2.489_845_061_869_568, -10.358_996_098_473_584],
    &[2.802_998_627_562_896_4, 0.507_246_473_622_820_6, -0.398_831_254_177_052_4, -0.047_211_872_304_046_41],
    &LAST,
    &[LAST[0], LAST[1], LAST[2], LAST[3], LAST[4], 1.0],
    &[LAST[0], LAST[1], LAST[2], LAST[3], LAST[4], 1.0, 1.0],
];
const LAST: [f64; 5] = [
    -7.502_846_399_306_121,
    2.561_846_144_803_919,
    -11.627_539_656_261_098,
    -0.182_687_676_599_422_56,
    0.030_198_172_008_377_946,
];
/// Weights of the step. The error estimate is the last stage.
pub(super) const B: [f64; STAGES] = [LAST[0], LAST[1], LAST[2], LAST[3], LAST[4], 1.0, 1.0, 1.0];
/// Further terms of the right sides, `sum_j c_ij u_j / h`.
pub(super) const COUPLING: [&[f64]; STAGES] = [
    &[],
    &[-14.155_112_264_123_755],
    &[-17.972_960_358_859_52, -2.859_693_295_451_294],
    &[147.121_502_757_117_16, -1.412_214_027_182_13, 71.689_402_513_023_58],
    &[165.435_170_248_716_76, -0.459_282_345_649_112_6, 42.909_383_369_586_03, -5.961_986_721_573_306],
    &[
        24.854_864_614_690_072,
        -3.000_922_700_283_218_6,
        47.493_111_002_076_8,
        5.581_419_782_155_812_5,
        -0.661_069_182_524_947_1,
    ],
    &[
        30.912_732_140_285_99,
        -3.120_824_334_993_797_4,
        77.799_546_460_708_92,
        34.286_460_282_947_83,
        -19.097_331_116_725_623,
        -28.087_943_162_872_662,
    ],
    &[
        37.802_771_233_905_63,
        -3.257_196_902_907_227_6,
        112.269_188_494_963_27,
        66.934_723_124_404_7,
        -40.066_189_370_910_02,
        -54.667_802_628_779_68,
        -9.488_616_523_096_27,
    ],
];
/// Coefficients of the interpolation.
pub(super) const H: [[f64; STAGES]; 3] = [
    [
        25.948_786_856_663_858,
        -2.557_972_484_584_623_5,
        10.433_815_404_888_879,
        -2.367_925_102_268_520_4,
        0.524_948_541_321_073,
        1.124_108_831_045_040_4,
        0.427_287_619_443_187_4,
        -0.172_022_210_701_554_93,
    ],
    [
        -9.915_688_506_951_71,
        -0.968_994_459_411_515_4,
        3.043_803_724_297_845_3,
        -24.495_224_566_215_796,
        20.176_138_334_709_044,
        15.980_663_614_246_51,
        -6.789_040_303_419_874,
        -6.710_236_069_923_372,
    ],
    [
        11.419_903_575_922_262,
        2.887_964_514_613_699_4,
        72.921_379_959_960_29,
        80.125_118_346_226_43,
        -52.072_871_366_152_654,
        -59.789_936_252_667_29,
        -0.155_826_842_827_519_13,
        4.883_087_185_713_722,
    ],
];

/// Of the interpolation.
const DEGREE: usize = 4;
/// The error estimate goes with `h^5`.
const EXPONENT: f64 = 1.0 / 5.0;
/// Share of a step by which its interpolation may be continued: its error goes with the distance from the end.
const REACH: f64 = 1e-3;
/// Limits of the ratio of step sizes.
const RATIO: [f64; 2] = [0.2, 6.0];
/// Least error that the predictive control remembers.
const LEAST_REMEMBERED_ERROR: f64 = 1e-2;

/// Rodas5P (Steinebach, "Construction of Rosenbrock-Wanner method Rodas5P and numerical benchmarks within the Julia
/// Differential Equations package", BIT 63, 2023), in the form of Hairer & Wanner, "Solving Ordinary Differential Equations
/// II", 2nd ed. 1996, section IV.7 and the program RODAS: order 5(4), stiffly accurate, interpolation of order 4, one
/// Jacobian and one factorisation a step and no iterations.
///
/// Eight evaluations a step, the first of which is at its start. Its work per step is fixed, that of Radau IIA grows where
/// Newton's method is slow; its order is no advantage at tight tolerances, where the Jacobian at every step is the price.
///
/// As with [`super::dop853()`], samples inside a step are less accurate than its ends, by up to a digit and a half.
///
/// Deviations from the book: the new state is projected, and norms come from the system. With [`Options::fixed_step`] the
/// error is not looked at.
#[derive(Debug, Clone, Default)]
pub struct Rodas5p {
    jacobian: Jacobian,
    matrix: Lu<f64>,
    /// `f(t, y)` at the start of the step.
    start: Vec<f64>,
    stages: [Vec<f64>; STAGES],
    argument: Vec<f64>,
    y_new: Vec<f64>,
    y_old: Vec<f64>,
    end: Vec<f64>,
    polynomial: [Vec<f64>; 3],
    /// Whether the interpolation of the step under way is needed, samples or not.
    approaching: bool,
    /// Shares of a step at which the equations are evaluated, ascending.
    seen: Vec<f64>,
}

impl Integrator for Rodas5p {
    fn name(&self) -> &'static str {
        "rodas5p"
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

impl Rodas5p {
    fn whole_run(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        run.sample_start(y)?;
        if run.t == run.span.t_end {
            return Ok(());
        }
        self.allocate(y.len());
        self.start_derivative(run, y)?;
        match run.options.fixed_step {
            Some(h) => self.fixed_steps(run, y, h),
            None => self.adaptive_steps(run, y),
        }
    }

    fn allocate(&mut self, n: usize) {
        self.seen = ascending(&C);
        self.jacobian.resize(n);
        self.matrix.resize(n);
        let single = [&mut self.start, &mut self.argument, &mut self.y_new, &mut self.y_old, &mut self.end];
        for work in self.stages.iter_mut().chain(&mut self.polynomial).chain(single) {
            work.clear();
            work.resize(n, 0.0);
        }
    }

    fn adaptive_steps(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        let mut h = run.options.first_step.unwrap_or_else(|| self.first_step(run, y));
        // Step size and error of the last accepted step.
        let mut last: Option<(f64, f64)> = None;
        let mut rejected = false;
        let mut events = Events::new(run, REACH);
        // Where the next step ends because of a switch.
        let mut end_at: Option<f64> = None;
        while run.t < run.span.t_end {
            run.check_step_limit()?;
            h = h.min(run.longest_step(y));
            let t_new = end_at.take().unwrap_or_else(|| run.step_end(h));
            let t_new = events.end_of_step(run, t_new, &self.seen);
            let tried = t_new - run.t;
            if tried <= 0.0 {
                return Err(Trouble::Stop(StopReason::StepTooSmall { step: h }));
            }
            self.approaching = events.is_pending() || events.watches_anything();
            let reason = match self.try_step(run, y, t_new) {
                Ok(error) if error <= 1.0 => {
                    let start = run.t;
                    if events.watches_anything() {
                        let known = (&self.y_old, &self.y_new, &self.polynomial);
                        let at = |share: f64, out: &mut [f64]| interpolate(known, share, out);
                        let step = Interpolation { start, h: tried, degree: DEGREE, seen: &self.seen, at: &at };
                        if let Some(again) = events.missed(run, y, &step)? {
                            (h, end_at) = (again.h, again.end_at);
                            continue;
                        }
                    }
                    self.finish_step(run, y, t_new)?;
                    let mut ratio = ratio(run, error);
                    // Not more than the predecessor suggests (Gustafsson; Hairer & Wanner II, eq. IV.8.28).
                    if let Some((last_h, last_error)) = last {
                        let growth = (error.max(1e-10).powi(2) / last_error).powf(EXPONENT) / run.options.safety;
                        ratio = ratio.min((tried / last_h / growth).clamp(RATIO[0], RATIO[1]));
                    }
                    last = Some((tried, error.max(LEAST_REMEMBERED_ERROR)));
                    h = tried * if rejected { ratio.min(1.0) } else { ratio };
                    rejected = false;
                    let known = (&self.y_old, &self.y_new, &self.polynomial);
                    match events.accepted(run, y, start, |share, out| interpolate(known, share, out))? {
                        Next::Plain => {}
                        Next::EndAt(time) => end_at = Some(time),
                        Next::Passed(size) => h = size,
                        Next::Resumed(size) => h = h.max(size),
                        Next::Crossed(size) => {
                            last = None;
                            self.start_derivative(run, y)?;
                            h = size.min(self.first_step(run, y));
                        }
                        Next::Jumped(size) if run.t < run.span.t_end => {
                            last = None;
                            let before = self.start.clone();
                            self.start_derivative(run, y)?;
                            let continuous = is_continuous(run, y, tried, &before, &self.start);
                            h = if continuous { size } else { size.min(self.first_step(run, y)) };
                        }
                        Next::Jumped(_) => {}
                    }
                    continue;
                }
                Ok(error) => {
                    h = tried * if last.is_none() { 0.1 } else { ratio(run, error).min(0.9) };
                    end_at = events.rejected(run, y, &self.start, t_new, &self.y_new)?;
                    StopReason::StepTooSmall { step: h }
                }
                Err(Trouble::Retry(reason)) => {
                    h = tried * super::explicit::RECOVERY_FACTOR;
                    reason
                }
                Err(trouble) => return Err(trouble),
            };
            run.reject(&reason);
            rejected = true;
            if h < run.smallest_step() {
                return Err(Trouble::Stop(reason));
            }
        }
        Ok(())
    }

    fn fixed_steps(&mut self, run: &mut Run<'_>, y: &mut [f64], h: f64) -> Result<(), Trouble> {
        let count = run.fixed_steps(h);
        let mut events = Events::new(run, REACH);
        self.approaching = events.watches_anything();
        for k in 0..count {
            run.check_step_limit()?;
            let t_new = run.fixed_step_end(k, count);
            if let Err(trouble) = self.step(run, y, t_new).and_then(|()| self.end_of_step(run, y, t_new)) {
                run.counters.rejected += 1;
                return Err(trouble);
            }
            let known = (&self.y_old, &self.y_new, &self.polynomial);
            let at = |share: f64, out: &mut [f64]| interpolate(known, share, out);
            let (start, h) = (run.t, t_new - run.t);
            events.note_missed(run, &Interpolation { start, h, degree: DEGREE, seen: &self.seen, at: &at })?;
            self.finish_step(run, y, t_new)?;
        }
        Ok(())
    }

    /// A step up to, but not including, what makes it final. Returns its error, 1 = tolerance.
    fn try_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<f64, Trouble> {
        self.step(run, y, t_new)?;
        let error = run.system.error_norm(y, &self.y_new, &self.stages[STAGES - 1]);
        if !error.is_finite() {
            return Err(Trouble::Retry(StopReason::NotFinite { step: t_new - run.t }));
        }
        if error <= 1.0 {
            self.end_of_step(run, y, t_new)?;
        }
        Ok(error)
    }

    fn start_derivative(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<(), Trouble> {
        self.jacobian.forget();
        run.rhs(run.t, y, &mut self.start, 0.0)?;
        if all_finite(&self.start) {
            return Ok(());
        }
        Err(Trouble::Stop(StopReason::NotFinite { step: 0.0 }))
    }

    /// A step in which the state changes, by its first derivative, by the tolerance.
    fn first_step(&mut self, run: &mut Run<'_>, y: &[f64]) -> f64 {
        let length = run.span.t_end - run.span.t_start;
        let speed = run.system.error_norm(y, y, &self.start);
        let step = if speed > 0.0 { 1.0 / speed } else { f64::INFINITY };
        step.clamp(1e-10 * length, 1e-3 * length)
    }

    /// The stages and the new state, not yet projected:
    /// `(1/(gamma h) - J) u_i = f(t + c_i h, y + sum_j a_ij u_j) + sum_j c_ij u_j / h + d_i h f_t`, `y_new = y + sum_i b_i u_i`
    /// (eq. IV.7.25).
    fn step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Trouble> {
        let (t, h) = (run.t, t_new - run.t);
        self.jacobian.update_with_time(run, y, &self.start, h)?;
        run.counters.factorisations += 1;
        if !self.matrix.factor(1.0 / (GAMMA * h), &self.jacobian.matrix) {
            return Err(Trouble::Retry(StopReason::NotFinite { step: h }));
        }
        for i in 0..STAGES {
            let (before, rest) = self.stages.split_at_mut(i);
            let stage = &mut rest[0];
            if i == 0 {
                stage.copy_from_slice(&self.start);
            } else {
                self.argument.copy_from_slice(y);
                add(A[i], before, 1.0, &mut self.argument);
                run.rhs(t + C[i] * h, &self.argument, stage, h)?;
            }
            add(COUPLING[i], before, 1.0 / h, stage);
            for (value, slope) in stage.iter_mut().zip(&self.jacobian.time) {
                *value += D[i] * h * slope;
            }
            self.matrix.solve(stage);
        }
        self.y_new.copy_from_slice(y);
        add(&B, &self.stages, 1.0, &mut self.y_new);
        finite_or_retry(&self.y_new, h)
    }

    /// Projection and derivative at the end; the interpolation if it will be needed.
    fn end_of_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Trouble> {
        let h = t_new - run.t;
        run.project(t_new, &mut self.y_new, h)?;
        finite_or_retry(&self.y_new, h)?;
        run.rhs(t_new, &self.y_new, &mut self.end, h)?;
        finite_or_retry(&self.end, h)?;
        self.y_old.copy_from_slice(y);
        if self.approaching || run.sample_before(t_new).is_some() {
            for (row, polynomial) in H.iter().zip(&mut self.polynomial) {
                polynomial.fill(0.0);
                add(row, &self.stages, 1.0, polynomial);
            }
        }
        Ok(())
    }

    /// Makes the step final: samples, `accept`, `step_done`.
    fn finish_step(&mut self, run: &mut Run<'_>, y: &mut [f64], t_new: f64) -> Result<(), Trouble> {
        let (t, h) = (run.t, t_new - run.t);
        y.copy_from_slice(&self.y_new);
        let known = (&self.y_old, &self.y_new, &self.polynomial);
        let accepted = run.finish_step(t_new, y, &mut self.argument, |time, out| {
            interpolate(known, (time - t) / h, out);
        })?;
        self.jacobian.forget();
        std::mem::swap(&mut self.start, &mut self.end);
        if accepted == Accepted::Changed && t_new < run.span.t_end {
            self.start_derivative(run, y)?;
        }
        Ok(())
    }
}

/// The state at the share `s` of a step: its ends, and the rows of the polynomial between.
fn interpolate((old, new, [p, q, r]): (&Vec<f64>, &Vec<f64>, &[Vec<f64>; 3]), s: f64, out: &mut [f64]) {
    for (k, value) in out.iter_mut().enumerate() {
        let bend = p[k] + s * (q[k] + s * r[k]);
        *value = (1.0 - s) * old[k] + s * (new[k] + (1.0 - s) * bend);
    }
}

/// Ratio of the size of the next step to that of one with this error.
fn ratio(run: &Run<'_>, error: f64) -> f64 {
    (run.options.safety / error.max(1e-10).powf(EXPONENT)).clamp(RATIO[0], RATIO[1])
}

/// `out += factor sum_j row_j vectors_j`
fn add(row: &[f64], vectors: &[Vec<f64>], factor: f64, out: &mut [f64]) {
    for (coefficient, vector) in row.iter().zip(vectors) {
        let coefficient = factor * coefficient;
        out.iter_mut().zip(vector).for_each(|(value, entry)| *value += coefficient * entry);
    }
}

fn finite_or_retry(x: &[f64], h: f64) -> Result<(), Trouble> {
    if all_finite(x) {
        return Ok(());
    }
    Err(Trouble::Retry(StopReason::NotFinite { step: h }))
}
