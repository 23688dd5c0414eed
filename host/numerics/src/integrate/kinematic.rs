//! Motions that the time determines: found, not integrated.
//!
//! A system without freedom (a mechanism with as many drivers as it would have freedoms) is where its manifold is at each
//! time: [`super::System::project`] finds the state from any state nearby. What is left to integrate are sums that nothing depends
//! on, such as the work done. A step visits the nodes of a Gauss-Lobatto rule; at each the state is extrapolated, projected,
//! and its rates evaluated:
//!
//! y_new = y + h (b_0 f(t_0, Y_0) + ... + b_5 f(t_5, Y_5)), then projected.
//!
//! The move of that projection is the error of the rule in what is known anyway: it shows how good the sums are, whether a
//! node jumped to another branch of the motion, and how long the next step may be. Errors do not add up over steps, other
//! than those of the sums.

use super::events::Events;
use super::interpolation::{Interpolation, hermite};
use super::run::{Run, Trouble, all_finite, final_trouble_of};
use super::steps::{RECOVERY_FACTOR, why_none};
use super::{Accepted, Integrator, Options, StopReason};

/// Nodes of a step, both ends included.
const NODES: usize = 6;
/// Gauss-Lobatto nodes in 0..1 (Abramowitz & Stegun 1964, table 25.6): the zeros of P_5' and the ends.
const C: [f64; NODES] =
    [0.0, 0.117_472_338_035_267_65, 0.357_384_241_759_677_4, 0.642_615_758_240_322_5, 0.882_527_661_964_732_3, 1.0];
/// Their weights; exact for polynomials of degree 9.
const B: [f64; NODES] = [
    1.0 / 30.0,
    0.189_237_478_148_923_5,
    0.277_429_188_517_743_2,
    0.277_429_188_517_743_2,
    0.189_237_478_148_923_5,
    1.0 / 30.0,
];
/// Weights of the rule through four of the nodes, degree 3.
const ROUGH: [f64; NODES] = [ROUGH_END, 0.0, 0.5 - ROUGH_END, 0.5 - ROUGH_END, 0.0, ROUGH_END];
/// `(1/12 - b^2) / (1/2 - 2 b^2)` with the inner nodes at `1/2 -+ b`.
const ROUGH_END: f64 = (1.0 / 12.0 - ROUGH_NODE * ROUGH_NODE) / (0.5 - 2.0 * ROUGH_NODE * ROUGH_NODE);
const ROUGH_NODE: f64 = C[3] - 0.5;
/// Share of the largest sum by which the two rules may differ.
const ROUGH_ALLOWED: f64 = 1e-5;
/// The same in what the tolerance allows.
const ROUGH_OF_RESOLUTION: f64 = 1e5;
/// The error of a step goes with this power of its size.
const ERROR_ORDER: f64 = 11.0;
/// Share of the interval that is tried first, unless given.
const FIRST_SHARE: f64 = 0.01;

/// See the module documentation. Steps are looked at from node to node and do not end at switches, so that their loop is not
/// that of the methods that integrate (`steps.rs`). It has no use for
/// [`Options::fixed_step`]: the step size then is the largest one.
#[derive(Debug, Clone, Default)]
pub struct Kinematic {
    /// States at the nodes.
    states: [Vec<f64>; NODES],
    /// Their rates.
    rates: [Vec<f64>; NODES],
    y_new: Vec<f64>,
    error: Vec<f64>,
    /// Largest magnitudes of the sums.
    sums: Vec<f64>,
}

impl Integrator for Kinematic {
    fn name(&self) -> &'static str {
        "kinematic"
    }

    fn steps(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        let scratch = [&mut self.y_new, &mut self.error];
        for work in self.states.iter_mut().chain(&mut self.rates).chain(scratch) {
            work.clear();
            work.resize(y.len(), 0.0);
        }
        self.sums = vec![0.0; y.len() - run.system.sums_from()];
        run.sample_start(y)?;
        if run.t == run.span.t_end {
            return Ok(());
        }
        run.rhs(run.t, y, &mut self.rates[0], 0.0)?;
        let mut events = Events::new(run, 0.0);
        let limit = run.options.fixed_step.unwrap_or(f64::INFINITY);
        let first = run.options.first_step.unwrap_or(FIRST_SHARE * (run.span.t_end - run.span.t_start));
        let (mut h, mut turned_at) = (first, None);
        // A time that no step led to yet, and why.
        let mut barred: Option<(f64, StopReason)> = None;
        while run.t < run.span.t_end {
            run.check_step_limit()?;
            barred = barred.filter(|(time, _)| run.t < *time);
            h = h.min(run.longest_step(y)).min(limit);
            let t_new = run.step_end(h);
            let t_new = events.end_of_step(run, t_new, &C);
            let tried = t_new - run.t;
            let reason = match self.try_step(run, y, t_new) {
                Ok(error) if error <= 1.0 => {
                    if let Some(again) = self.missed(run, y, tried, &mut events)? {
                        h = again;
                        continue;
                    }
                    self.add_nodes(run, t_new)?;
                    self.finish_step(run, y, t_new)?;
                    h = tried * factor(run.options, error);
                    if let Some(wanted) = events.beyond_break(run) {
                        h = h.max(wanted);
                        if t_new < run.t && run.t < run.span.t_end {
                            if let Some(beyond) = self.turned(run, y)? {
                                run.t = t_new;
                                run.add_nothing();
                                self.finish_step(run, y, beyond)?;
                            }
                            run.rhs(run.t, y, &mut self.rates[0], 0.0)?;
                        }
                    }
                    continue;
                }
                Ok(error) => {
                    h = tried * factor(run.options, error).min(1.0);
                    StopReason::StepTooSmall { step: h }
                }
                Err(Trouble::Retry(reason)) => {
                    h = tried * RECOVERY_FACTOR;
                    reason
                }
                Err(trouble) => return Err(trouble),
            };
            run.reject(&reason);
            if h < run.smallest_step() {
                // Nothing is integrated that could be hard to follow: a kink is right ahead that nothing told of, or there is no way.
                let tried = turned_at == Some(run.t);
                let beyond = if tried { None } else { self.turned(run, y).unwrap_or(None) };
                let Some(beyond) = beyond else { return Err(Trouble::Stop(why_none(reason, barred))) };
                run.add_nothing();
                self.finish_step(run, y, beyond)?;
                run.rhs(run.t, y, &mut self.rates[0], 0.0)?;
                (h, turned_at) = (first, Some(run.t));
            } else if matches!(reason, StopReason::Failed { .. }) {
                barred = Some((t_new, reason));
            }
        }
        Ok(())
    }
}

impl Kinematic {
    /// A step up to, but not including, what makes it final. Returns its error, 1 = tolerance.
    fn try_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<f64, Trouble> {
        let (t, h) = (run.t, t_new - run.t);
        let bad = |h: f64| Trouble::Retry(StopReason::NotFinite { step: h });
        self.states[0].copy_from_slice(y);
        for (k, share) in C.iter().enumerate().skip(1) {
            self.extrapolate(k, h);
            let time = if k + 1 == NODES { t_new } else { t + share * h };
            run.project(time, &mut self.states[k], h)?;
            run.rhs(time, &self.states[k], &mut self.rates[k], h)?;
            if !all_finite(&self.rates[k]) {
                return Err(bad(h));
            }
        }
        for (i, sum) in self.y_new.iter_mut().enumerate() {
            *sum = y[i] + h * B.iter().zip(&self.rates).map(|(b, rates)| b * rates[i]).sum::<f64>();
        }
        self.error.copy_from_slice(&self.y_new);
        run.project(t_new, &mut self.y_new, h)?;
        for (error, value) in self.error.iter_mut().zip(&self.y_new) {
            *error -= value;
        }
        let error = run.system.error_norm(y, &self.y_new, &self.error).max(self.error_of_sums(run, h));
        if error.is_finite() { Ok(error) } else { Err(bad(h)) }
    }

    /// Error of the sums, 1 = what is allowed: the difference from a rule of degree 3 at four of the nodes, as a share of the
    /// largest sum so far. It overestimates the error of the rule of degree 9 by far.
    fn error_of_sums(&mut self, run: &mut Run<'_>, h: f64) -> f64 {
        let from = run.system.sums_from();
        let mut worst = 0.0_f64;
        for (k, largest) in (from..self.y_new.len()).zip(&mut self.sums) {
            let sum = |weights: &[f64; NODES]| {
                h * weights.iter().zip(&self.rates).map(|(b, rates)| b * rates[k]).sum::<f64>()
            };
            let moved: f64 = h * B.iter().zip(&self.rates).map(|(b, rates)| b * rates[k].abs()).sum::<f64>();
            *largest = largest.max(self.y_new[k].abs()).max(moved);
            let allowed = ROUGH_ALLOWED * *largest + ROUGH_OF_RESOLUTION * run.system.resolution(k);
            if allowed > 0.0 {
                worst = worst.max((sum(&B) - sum(&ROUGH)).abs() / allowed);
            }
        }
        worst
    }

    /// Where functions of time have a kink, the state is off on its far side by what no step would make up for: a step of no length brings
    /// it there. Returns where that step ends, none if there is no kink.
    fn turned(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<Option<f64>, Trouble> {
        // What a table does behind its last point begins just behind it.
        let beyond = (run.t + run.smallest_step()).min(run.span.t_end);
        // Where rates jump without a kink, the state on the far side is that much further, however slow all is.
        let failed = |failure| final_trouble_of(failure, beyond);
        self.y_new.copy_from_slice(y);
        run.system.project(beyond, &mut self.y_new).map_err(failed)?;
        let (far, share) = (&mut self.rates[1], beyond - run.t);
        run.system.rhs(beyond, &self.y_new, far).map_err(failed)?;
        for ((value, was), rate) in self.y_new.iter_mut().zip(y).zip(&*far) {
            *value = if rate.is_finite() { was + share * rate } else { *was };
        }
        self.error.copy_from_slice(&self.y_new);
        run.system.project_across(beyond, &mut self.y_new).map_err(failed)?;
        run.counters.projections += 2;
        run.counters.evaluations += 1;
        for (error, is) in self.error.iter_mut().zip(&self.y_new) {
            *error -= is;
        }
        Ok(Some(beyond).filter(|_| run.system.error_norm(y, &self.y_new, &self.error) > 1.0))
    }

    /// The size of the step to be tried instead of one that missed something between its nodes.
    fn missed(&self, run: &mut Run<'_>, y: &[f64], h: f64, events: &mut Events) -> Result<Option<f64>, Trouble> {
        if !events.watches_anything() {
            return Ok(None);
        }
        for k in 1..NODES {
            let (start, size) = (run.t + C[k - 1] * h, (C[k] - C[k - 1]) * h);
            let states = [self.states[k - 1].as_slice(), self.states[k].as_slice()];
            let at = |s: f64, out: &mut [f64]| hermite(s, size, states, [&self.rates[k - 1], &self.rates[k]], out);
            let felt = |number: usize, out: &mut [f64]| out.copy_from_slice(states[number]);
            let end = run.t + C[k] * h;
            let step = Interpolation { start, h: size, end, degree: 3, at: &at, seen: &[0.0, 1.0], felt: &felt };
            if events.missed(run, y, &step)?.is_some() {
                events.forget();
                let shorter = RECOVERY_FACTOR * h;
                return Ok(Some(shorter).filter(|h| *h > run.smallest_step()));
            }
        }
        Ok(None)
    }

    /// The state at node `k` from the two before it: the cubic through their values and rates; a straight line at first.
    fn extrapolate(&mut self, k: usize, h: f64) {
        let (known, later) = self.states.split_at_mut(k);
        let out = &mut later[0];
        if k == 1 {
            for (i, value) in out.iter_mut().enumerate() {
                *value = known[0][i] + C[1] * h * self.rates[0][i];
            }
            return;
        }
        let step = C[k - 1] - C[k - 2];
        let s = (C[k] - C[k - 2]) / step;
        let y = [known[k - 2].as_slice(), known[k - 1].as_slice()];
        hermite(s, step * h, y, [&self.rates[k - 2], &self.rates[k - 1]], out);
    }

    /// Gives the nodes of the step made last: see [`Run::add_node`].
    fn add_nodes(&mut self, run: &mut Run<'_>, t_new: f64) -> Result<(), Trouble> {
        if !run.system.sums_up() {
            return Ok(());
        }
        let (t, h) = (run.t, t_new - run.t);
        for (k, share) in C.iter().enumerate() {
            let time = if k + 1 == NODES { t_new } else { t + share * h };
            run.add_node(time, &self.states[k], h, [B[k], B[k] - ROUGH[k]])?;
        }
        Ok(())
    }

    /// Makes the step final: samples, `accept`, `step_done`, rates at the start of the next step.
    fn finish_step(&mut self, run: &mut Run<'_>, y: &mut [f64], t_new: f64) -> Result<(), Trouble> {
        let (t, h) = (run.t, t_new - run.t);
        y.copy_from_slice(&self.y_new);
        let (states, rates) = (&self.states, &self.rates);
        let accepted = run.finish_step(t_new, y, &mut self.error, |time, out| {
            let share = (time - t) / h;
            let k = (1..NODES).find(|k| share < C[*k]).unwrap_or(NODES - 1);
            let step = C[k] - C[k - 1];
            let s = (share - C[k - 1]) / step;
            hermite(s, step * h, [&states[k - 1], &states[k]], [&rates[k - 1], &rates[k]], out);
        })?;
        if accepted == Accepted::Changed && t_new < run.span.t_end {
            return run.rhs(t_new, y, &mut self.rates[0], 0.0);
        }
        self.rates.swap(0, NODES - 1);
        Ok(())
    }
}

/// Ratio of step sizes after a step with an error, 1 = tolerance.
fn factor(options: &Options, error: f64) -> f64 {
    let ratio = options.safety * error.powf(-1.0 / ERROR_ORDER);
    ratio.clamp(options.min_factor, options.max_factor)
}
