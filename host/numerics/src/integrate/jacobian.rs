//! [`Jacobian`]: the derivatives that implicit methods need, exact where the system knows them.

use super::StopReason;
use super::run::{Run, Trouble, all_finite};

/// `f_y` and `f_t` at the start of a step.
#[derive(Debug, Clone, Default)]
pub(super) struct Jacobian {
    /// `f_y`, column by column.
    pub(super) matrix: Vec<f64>,
    /// `f_t`.
    pub(super) time: Vec<f64>,
    argument: Vec<f64>,
    rates: Vec<f64>,
    known: bool,
}

impl Jacobian {
    /// Room for `n` entries of the state; nothing is known.
    pub(super) fn resize(&mut self, n: usize) {
        self.known = false;
        self.matrix.clear();
        self.matrix.resize(n * n, 0.0);
        for work in [&mut self.time, &mut self.argument, &mut self.rates] {
            work.clear();
            work.resize(n, 0.0);
        }
    }

    /// Derivatives at another state are wanted from now on.
    pub(super) fn forget(&mut self) {
        self.known = false;
    }

    /// `f_y` at the accepted state `y`, where `f` is `start`: the system's own, or differences of its right side.
    pub(super) fn take(&mut self, run: &mut Run<'_>, y: &[f64], start: &[f64]) -> Result<(), Trouble> {
        run.counters.jacobians += 1;
        if !run.jacobian(run.t, y, &mut self.matrix)? {
            let n = y.len();
            self.argument.copy_from_slice(y);
            for (j, value) in y.iter().enumerate() {
                // Along the motion: away from a switch that was just passed.
                let step = (f64::EPSILON * value.abs().max(1e-5)).sqrt().copysign(start[j]);
                self.argument[j] = value + step;
                let step = self.argument[j] - value;
                run.rhs(run.t, &self.argument, &mut self.rates, step.abs())?;
                self.argument[j] = *value;
                let column = &mut self.matrix[n * j..n * (j + 1)];
                for ((entry, rate), start) in column.iter_mut().zip(&self.rates).zip(start) {
                    *entry = (rate - start) / step;
                }
            }
        }
        finite_or_retry(&self.matrix)
    }

    /// Both derivatives, unless they are known already, for a step of size `h`.
    pub(super) fn update_with_time(
        &mut self,
        run: &mut Run<'_>,
        y: &[f64],
        start: &[f64],
        h: f64,
    ) -> Result<(), Trouble> {
        if self.known {
            return Ok(());
        }
        self.take(run, y, start)?;
        if !run.time_derivative(run.t, y, &mut self.time)? {
            // As in the program RODAS; inside the step.
            let step = (f64::EPSILON * run.t.abs().max(1e-5)).sqrt().min(h);
            let step = (run.t + step) - run.t;
            run.rhs(run.t + step, y, &mut self.rates, step)?;
            for ((slope, rate), start) in self.time.iter_mut().zip(&self.rates).zip(start) {
                *slope = (rate - start) / step;
            }
        }
        finite_or_retry(&self.time)?;
        self.known = true;
        Ok(())
    }
}

fn finite_or_retry(x: &[f64]) -> Result<(), Trouble> {
    if all_finite(x) {
        return Ok(());
    }
    Err(Trouble::Retry(StopReason::NotFinite { step: 0.0 }))
}
