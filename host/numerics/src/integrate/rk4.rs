//! The classical method of Runge and Kutta, order 4, with steps of one size.

use super::enclosure::Interpolation;
use super::events::Events;
use super::run::{Run, Trouble, all_finite};
use super::{Accepted, IntegrateError, Integrator, Options, Outcome, Span, StopReason, System};

/// Classical Runge-Kutta method (Kutta 1901), order 4, without error control; samples by cubic
/// Hermite interpolation. Needs [`Options::fixed_step`]. For comparisons and tests.
#[derive(Debug, Clone, Default)]
pub struct Rk4 {
    stages: [Vec<f64>; 5],
    argument: Vec<f64>,
    y_new: Vec<f64>,
}

impl Integrator for Rk4 {
    fn name(&self) -> &'static str {
        "rk4"
    }

    fn needs_fixed_step(&self) -> bool {
        true
    }

    fn integrate(
        &mut self,
        system: &mut dyn System,
        y: &mut [f64],
        span: &Span<'_>,
        options: &Options,
    ) -> Result<Outcome, IntegrateError> {
        let Some(fixed_step) = options.fixed_step else {
            return Err(IntegrateError::Invalid("the method rk4 needs a fixed step".to_string()));
        };
        Run::through(system, y, span, options, |run, y| {
            for work in self.stages.iter_mut().chain([&mut self.argument, &mut self.y_new]) {
                work.clear();
                work.resize(y.len(), 0.0);
            }
            self.steps(run, y, fixed_step)
        })
    }
}

impl Rk4 {
    fn steps(&mut self, run: &mut Run<'_>, y: &mut [f64], fixed_step: f64) -> Result<(), Trouble> {
        run.sample_start(y)?;
        let count = run.fixed_steps(fixed_step);
        if count == 0 {
            return Ok(());
        }
        run.rhs(run.t, y, &mut self.stages[0], 0.0)?;
        let mut events = Events::new(run, 0.0);
        for k in 0..count {
            run.check_step_limit()?;
            let (t, t_new) = (run.t, run.fixed_step_end(k, count));
            let h = t_new - t;
            if let Err(trouble) = self.step(run, t, y, t_new) {
                run.counters.rejected += 1;
                return Err(trouble);
            }
            {
                let (y_old, y_new, f_old, f_new) = (&*y, &self.y_new, &self.stages[0], &self.stages[4]);
                let at = |share: f64, out: &mut [f64]| hermite(share, h, [y_old, y_new], [f_old, f_new], out);
                events.note_missed(run, &Interpolation { start: t, h, degree: 3, seen: &[0.0, 0.5, 1.0], at: &at })?;
            }
            // The old state is kept in `argument` for the interpolation.
            self.argument.copy_from_slice(y);
            y.copy_from_slice(&self.y_new);
            let [f_old, scratch, _, _, f_new] = &mut self.stages;
            let (y_old, y_new) = (&self.argument, &self.y_new);
            let accepted = run.finish_step(t_new, y, scratch, |time, out| {
                hermite((time - t) / h, h, [y_old, y_new], [f_old, f_new], out);
            })?;
            self.stages.swap(0, 4);
            if accepted == Accepted::Changed && k + 1 < count {
                run.rhs(t_new, y, &mut self.stages[0], 0.0)?;
            }
        }
        Ok(())
    }

    /// From `t`, `y` and `stages[0] = f(t, y)` to `y_new` and `stages[4] = f(t_new, y_new)`.
    fn step(&mut self, run: &mut Run<'_>, t: f64, y: &[f64], t_new: f64) -> Result<(), Trouble> {
        let h = t_new - t;
        // k_i = f(t + c_i h, y + c_i h k_{i-1})
        for (stage, c) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
            for (i, argument) in self.argument.iter_mut().enumerate() {
                *argument = y[i] + c * h * self.stages[stage - 1][i];
            }
            run.rhs(t + c * h, &self.argument, &mut self.stages[stage], h)?;
        }
        let [k0, k1, k2, k3, f_new] = &mut self.stages;
        for (i, y_new) in self.y_new.iter_mut().enumerate() {
            *y_new = y[i] + h / 6.0 * (k0[i] + 2.0 * (k1[i] + k2[i]) + k3[i]);
        }
        if !all_finite(&self.y_new) {
            return Err(Trouble::Stop(StopReason::NotFinite { step: h }));
        }
        run.project(t_new, &mut self.y_new, h)?;
        run.rhs(t_new, &self.y_new, f_new, h)
    }
}

/// Cubic that has the values and derivatives of both ends of a step of size `h`, at the share
/// `s` of it.
pub(super) fn hermite(s: f64, h: f64, y: [&[f64]; 2], f: [&[f64]; 2], out: &mut [f64]) {
    for (i, value) in out.iter_mut().enumerate() {
        let rise = y[1][i] - y[0][i];
        let start_bend = h * f[0][i] - rise;
        let end_bend = rise - h * f[1][i];
        let bend = (1.0 - s) * start_bend + s * end_bend;
        *value = y[0][i] + s * (rise + (1.0 - s) * bend);
    }
}
