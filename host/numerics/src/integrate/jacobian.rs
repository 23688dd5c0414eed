//! [`Jacobian`]: the derivatives that implicit methods need, exact where the system knows them.

use super::StopReason;
use super::fill::Fill;
use super::run::{Run, Trouble, all_finite};

/// `f_y` at the start of a step.
#[derive(Debug, Clone, Default)]
pub(super) struct Jacobian {
    /// `f_y`, column by column.
    pub(super) matrix: Vec<f64>,
    /// How `shift I - f_y` is eliminated.
    pub(super) fill: Fill,
    /// Whether that has changed since it was last eliminated.
    pub(super) fill_is_new: bool,
    argument: Vec<f64>,
    rates: Vec<f64>,
}

impl Jacobian {
    /// Room for `n` entries of the state.
    pub(super) fn resize(&mut self, n: usize) {
        self.matrix.clear();
        self.matrix.resize(n * n, 0.0);
        self.fill.resize(n);
        self.fill_is_new = true;
        for work in [&mut self.argument, &mut self.rates] {
            work.clear();
            work.resize(n, 0.0);
        }
    }

    /// Its matrices are eliminated with row pivoting throughout from now on.
    pub(super) fn leave_dense(&mut self) {
        self.fill.leave_dense(&self.matrix);
        self.fill_is_new = true;
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
        finite_or_retry(&self.matrix)?;
        self.fill_is_new |= self.fill.take(&self.matrix);
        Ok(())
    }
}

fn finite_or_retry(x: &[f64]) -> Result<(), Trouble> {
    if all_finite(x) {
        return Ok(());
    }
    Err(Trouble::Retry(StopReason::NotFinite { step: 0.0 }))
}
