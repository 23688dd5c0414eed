//! The generalized-alpha method for systems of second order with constraints on positions (index 3).
//!
//! Arnold & Bruels 2007 (Multibody System Dynamics 18), in the Lie group form of Bruels & Cardona 2010 (Journal of
//! Computational and Nonlinear Dynamics 5):
//!
//! q_1 = q_0 exp(h v_0 + (1/2 - beta) h^2 a_0 + beta h^2 a_1),
//! v_1 = v_0 + (1 - gamma) h a_0 + gamma h a_1,
//! (1 - alpha_m) a_1 + alpha_m a_0 = (1 - alpha_f) v'_1 + alpha_f v'_0,
//!
//! where q_1, v'_1 and the multipliers meet the equations of motion and the constraints at the end of the step. The a are not
//! the accelerations v', but belong to a time earlier by (alpha_f - alpha_m) h; started there, the method has order 2 in
//! positions and velocities, and in multipliers as soon as the start is forgotten (Arnold, Bruels & Cardona 2015, Numerische
//! Mathematik 129). Velocities meet the constraints to within the error of the method: nothing is projected.

use super::enclosure::Interpolation;
use super::events::Events;
use super::rk4::hermite;
use super::run::{Run, Trouble, all_finite};
use super::second_order::{Instant, SecondOrder};
use super::{IntegrateError, Integrator, Options, Outcome, Span, StopReason, System};

/// Spectral radius at infinite frequency.
const RHO: f64 = 0.9;
/// Chung & Hulbert 1993.
const ALPHA_M: f64 = (2.0 * RHO - 1.0) / (RHO + 1.0);
const ALPHA_F: f64 = RHO / (RHO + 1.0);
const GAMMA: f64 = 0.5 + ALPHA_F - ALPHA_M;
const BETA: f64 = 0.25 * (GAMMA + 0.5) * (GAMMA + 0.5);

/// Newton's method has converged when what is left is predicted to be smaller, on the scale of [`System::size`].
const CLOSE: f64 = 1e-12;
/// Corrections below this that get no smaller are round-off.
const ROUND_OFF: f64 = 1e-8;
/// Corrections that shrink by less count as divergence.
const SLOWEST: f64 = 0.9;
/// Iterations before a step counts as diverged.
const MOST_ITERATIONS: usize = 20;
/// Iterations in a step after which the matrix is factored anew for the next one.
const MANY_ITERATIONS: usize = 4;

/// Generalized-alpha method, order 2, spectral radius 0.9, without error control; samples by cubic Hermite interpolation.
/// Needs [`Options::fixed_step`] and [`System::second_order`]. For comparisons: it is what many multibody programs use. The
/// matrix of Newton's method is kept over as many steps as it converges well.
#[derive(Debug, Clone, Default)]
pub struct GeneralizedAlpha {
    /// Rates of the state at both ends of a step.
    rates: [Vec<f64>; 2],
    y_new: Vec<f64>,
    y_moved: Vec<f64>,
    difference: Vec<f64>,
    /// v_0, and the a_0 of the method.
    velocities: Vec<f64>,
    delayed: Vec<f64>,
    /// v' at both ends.
    accelerations: [Vec<f64>; 2],
    /// At the end of the step.
    increment: Vec<f64>,
    velocities_new: Vec<f64>,
    multipliers: Vec<f64>,
    /// Multipliers at the start of the step.
    multipliers_before: Vec<f64>,
    /// Residual and correction.
    forces: Vec<f64>,
    rows: Vec<f64>,
    moves: Vec<f64>,
    changes: Vec<f64>,
    /// Step size that the matrix was factored for; none if it is to be factored.
    factored_for: Option<f64>,
}

/// How an attempt at the equations of a step ended.
enum Solved {
    After(usize),
    Diverged,
}

impl Integrator for GeneralizedAlpha {
    fn name(&self) -> &'static str {
        "generalized-alpha"
    }

    fn needs_fixed_step(&self) -> bool {
        true
    }

    fn needs_second_order(&self) -> bool {
        true
    }

    fn integrate(
        &mut self,
        system: &mut dyn System,
        y: &mut [f64],
        span: &Span<'_>,
        options: &Options,
    ) -> Result<Outcome, IntegrateError> {
        let invalid = |what: &str| IntegrateError::Invalid(format!("the method generalized-alpha needs {what}"));
        let fixed_step = options.fixed_step.ok_or_else(|| invalid("a fixed step"))?;
        let form = system.second_order().ok_or_else(|| invalid("equations of second order with constraints"))?;
        self.prepare(y.len(), form.velocities(), form.multipliers());
        Run::through(system, y, span, options, |run, y| self.steps(run, y, fixed_step))
    }
}

/// The form of second order, which [`GeneralizedAlpha::integrate`] made sure of.
fn form_of<'a>(run: &'a mut Run<'_>) -> Result<&'a mut dyn SecondOrder, Trouble> {
    let gone = || IntegrateError::Invalid("the system ceased to be of second order".into());
    run.system.second_order().ok_or_else(|| Trouble::Abort(gone()))
}

impl GeneralizedAlpha {
    /// The multipliers at the last accepted state, one per constraint in use.
    #[must_use]
    pub fn multipliers(&self) -> &[f64] {
        &self.multipliers
    }

    fn prepare(&mut self, dim: usize, n: usize, m: usize) {
        let [f_old, f_new] = &mut self.rates;
        let [start, end] = &mut self.accelerations;
        let of_state = [f_old, f_new, &mut self.y_new, &mut self.y_moved, &mut self.difference];
        let of_velocities = [&mut self.velocities, &mut self.velocities_new, &mut self.delayed, start, end];
        let of_steps = [&mut self.increment, &mut self.forces, &mut self.moves];
        let sized = of_state.into_iter().map(|work| (work, dim));
        let sized = sized.chain(of_velocities.into_iter().chain(of_steps).map(|work| (work, n)));
        let of_rows = [&mut self.multipliers, &mut self.multipliers_before, &mut self.rows, &mut self.changes];
        for (work, size) in sized.chain(of_rows.into_iter().map(|work| (work, m))) {
            work.clear();
            work.resize(size, 0.0);
        }
        self.factored_for = None;
    }

    fn steps(&mut self, run: &mut Run<'_>, y: &mut [f64], fixed_step: f64) -> Result<(), Trouble> {
        run.sample_start(y)?;
        let count = run.fixed_steps(fixed_step);
        if count == 0 {
            return Ok(());
        }
        self.start(run, y, run.fixed_step_end(0, count) - run.t)?;
        let mut events = Events::new(run, 0.0);
        for k in 0..count {
            run.check_step_limit()?;
            let (t, t_new) = (run.t, run.fixed_step_end(k, count));
            if let Err(trouble) = self.step(run, y, t_new) {
                run.counters.rejected += 1;
                return Err(trouble);
            }
            // The old state is kept for the interpolation.
            self.y_moved.copy_from_slice(y);
            y.copy_from_slice(&self.y_new);
            let ([f_old, f_new], h) = (&self.rates, t_new - t);
            let (y_old, y_new) = (&self.y_moved, &self.y_new);
            {
                let at = |share: f64, out: &mut [f64]| hermite(share, h, [y_old, y_new], [f_old, f_new], out);
                events.note_missed(run, &Interpolation { start: t, h, degree: 3, seen: &[0.0, 1.0], at: &at })?;
            }
            // Memory that changes between steps leaves the method's own past as it is: what jumps is smoothed over some steps.
            run.finish_step(t_new, y, &mut self.difference, |time, out| {
                hermite((time - t) / h, h, [y_old, y_new], [f_old, f_new], out);
            })?;
            self.rates.swap(0, 1);
            self.accelerations.swap(0, 1);
        }
        Ok(())
    }

    /// v'_0 and a_0 = v'(t_0 - (alpha_f - alpha_m) h), by a difference forwards, so that nothing before the start is asked for.
    fn start(&mut self, run: &mut Run<'_>, y: &[f64], h: f64) -> Result<(), Trouble> {
        let ahead = (ALPHA_F - ALPHA_M) * h;
        let t = run.t;
        run.rhs(t, y, &mut self.rates[0], 0.0)?;
        for ((moved, value), rate) in self.y_moved.iter_mut().zip(y).zip(&self.rates[0]) {
            *moved = value + ahead * rate;
        }
        run.rhs(t + ahead, &self.y_moved, &mut self.rates[1], 0.0)?;
        let form = form_of(run)?;
        form.velocities_of(&self.rates[0], &mut self.accelerations[0]);
        form.velocities_of(&self.rates[1], &mut self.delayed);
        for (delayed, now) in self.delayed.iter_mut().zip(&self.accelerations[0]) {
            *delayed = 2.0 * now - *delayed;
        }
        Ok(())
    }

    /// From `y` at the time of the run to `y_new` at `t_new`.
    fn step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Trouble> {
        let h = t_new - run.t;
        form_of(run)?.velocities_of(y, &mut self.velocities);
        // Equal steps differ by round-off, which a matrix may be off by.
        let kept = self.factored_for.is_some_and(|known| (known - h).abs() <= 1e-6 * h);
        let solved = match self.solve(run, y, t_new, !kept)? {
            Solved::Diverged if kept => {
                run.counters.recoveries.fresh_jacobian += 1;
                self.solve(run, y, t_new, true)?
            }
            solved => solved,
        };
        let Solved::After(iterations) = solved else {
            return Err(Trouble::Stop(StopReason::NoConvergence { step: h }));
        };
        self.multipliers_before.copy_from_slice(&self.multipliers);
        self.factored_for = (iterations <= MANY_ITERATIONS).then_some(h);
        let sums = form_of(run)?.sums_from();
        for (k, sum) in self.y_new.iter_mut().enumerate().skip(sums) {
            *sum = y[k] + 0.5 * h * (self.rates[0][k] + self.rates[1][k]);
        }
        let [now, next] = &self.accelerations;
        for (k, delayed) in self.delayed.iter_mut().enumerate() {
            *delayed = ((1.0 - ALPHA_F) * next[k] + ALPHA_F * now[k] - ALPHA_M * *delayed) / (1.0 - ALPHA_M);
        }
        Ok(())
    }

    /// Newton's method for v'_1 and the multipliers, from those of the step before.
    fn solve(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64, anew: bool) -> Result<Solved, Trouble> {
        let h = t_new - run.t;
        let damping_share = GAMMA / (BETA * h);
        let mass_share = (1.0 - ALPHA_M) / ((1.0 - ALPHA_F) * BETA * h * h);
        self.predict(h);
        self.multipliers.copy_from_slice(&self.multipliers_before);
        form_of(run)?.place(y, &self.increment, &self.velocities_new, &mut self.y_new);
        let mut last = f64::INFINITY;
        for iteration in 1..=MOST_ITERATIONS {
            run.counters.evaluations += 1;
            run.counters.newton_iterations += 1;
            if anew && iteration == 1 {
                run.counters.jacobians += 1;
                run.counters.factorisations += 1;
            }
            let form = form_of(run)?;
            self.correct(form, t_new, anew && iteration == 1, [mass_share, damping_share]).map_err(|failure| {
                // No other step size is tried.
                match super::run::trouble_of(failure, t_new, h) {
                    Trouble::Retry(reason) => Trouble::Stop(reason),
                    trouble => trouble,
                }
            })?;
            form.place(y, &self.increment, &self.velocities_new, &mut self.y_moved);
            if !all_finite(&self.y_moved) {
                let reason = StopReason::NotFinite { step: h };
                return if anew { Err(Trouble::Stop(reason)) } else { Ok(Solved::Diverged) };
            }
            for ((difference, moved), new) in self.difference.iter_mut().zip(&self.y_moved).zip(&self.y_new) {
                *difference = moved - new;
            }
            std::mem::swap(&mut self.y_new, &mut self.y_moved);
            let size = run.system.size(y, &self.difference);
            let ratio = if last.is_finite() { size / last } else { 1.0 };
            let left = if ratio < 1.0 { size * ratio / (1.0 - ratio) } else { size };
            if left <= CLOSE || (ratio >= SLOWEST && last <= ROUND_OFF && size <= ROUND_OFF) {
                return Ok(Solved::After(iteration));
            }
            if iteration > 1 && (ratio.is_nan() || ratio >= SLOWEST) {
                return Ok(Solved::Diverged);
            }
            last = size;
        }
        Ok(Solved::Diverged)
    }

    /// The end of the step if v' and the multipliers stayed as they are.
    fn predict(&mut self, h: f64) {
        let [now, next] = &mut self.accelerations;
        next.copy_from_slice(now);
        for (k, v) in self.velocities.iter().enumerate() {
            let old = self.delayed[k];
            let new = (now[k] - ALPHA_M * old) / (1.0 - ALPHA_M);
            self.velocities_new[k] = v + h * ((1.0 - GAMMA) * old + GAMMA * new);
            self.increment[k] = h * v + h * h * ((0.5 - BETA) * old + BETA * new);
        }
    }

    /// One correction. The derivative of exp along the increment is taken for the identity, which it is but for h.
    fn correct(
        &mut self,
        form: &mut dyn SecondOrder,
        t: f64,
        factor: bool,
        [mass_share, damping_share]: [f64; 2],
    ) -> Result<(), super::Failure> {
        let accelerations = &mut self.accelerations[1];
        let at = Instant { t, y: &self.y_new, accelerations, multipliers: &self.multipliers };
        form.residual(&at, &mut self.forces, &mut self.rows, &mut self.rates[1])?;
        if factor {
            form.factor(mass_share, damping_share)?;
        }
        form.solve(&self.forces, &self.rows, &mut self.moves, &mut self.changes)?;
        for (k, moved) in self.moves.iter().enumerate() {
            self.increment[k] += moved;
            self.velocities_new[k] += damping_share * moved;
            accelerations[k] += mass_share * moved;
        }
        self.multipliers.iter_mut().zip(&self.changes).for_each(|(multiplier, change)| *multiplier += change);
        Ok(())
    }
}
