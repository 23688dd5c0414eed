//! The classical method of Runge and Kutta, order 4, with steps of one size.

use super::interpolation::hermite;
use super::run::{Run, Trouble, all_finite};
use super::steps::{Fault, Stepper, steps_of_one_size};
use super::{Integrator, StopReason};

/// Classical Runge-Kutta method (Kutta 1901), order 4, without error control; samples by cubic
/// Hermite interpolation. Needs [`super::Options::fixed_step`]. For comparisons and tests.
#[derive(Debug, Clone, Default)]
pub struct Rk4 {
    stages: [Vec<f64>; 5],
    argument: Vec<f64>,
    y_old: Vec<f64>,
    y_new: Vec<f64>,
    /// Size of the step made last.
    h: f64,
}

impl Integrator for Rk4 {
    fn name(&self) -> &'static str {
        "rk4"
    }

    fn needs_fixed_step(&self) -> bool {
        true
    }

    fn steps(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        let single = [&mut self.argument, &mut self.y_old, &mut self.y_new];
        for work in self.stages.iter_mut().chain(single) {
            work.clear();
            work.resize(y.len(), 0.0);
        }
        run.options.fixed_step.map_or(Ok(()), |h| steps_of_one_size(self, run, y, h))
    }
}

impl Stepper for Rk4 {
    fn reach(&self) -> f64 {
        0.0
    }

    fn seen(&self) -> &[f64] {
        &[0.0, 0.5, 1.0]
    }

    fn start(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<(), Trouble> {
        run.start_rates(y, &mut self.stages[0])
    }

    fn make_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Fault> {
        let (t, h) = (run.t, t_new - run.t);
        self.h = h;
        self.y_old.copy_from_slice(y);
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
            return Err(Trouble::Stop(StopReason::NotFinite { step: h }).into());
        }
        run.project(t_new, &mut self.y_new, h)?;
        Ok(run.rhs(t_new, &self.y_new, f_new, h)?)
    }

    fn go_on(&mut self, _h: f64) {
        self.stages.swap(0, 4);
    }

    fn y_new(&self) -> &[f64] {
        &self.y_new
    }

    fn rates(&self) -> [&[f64]; 2] {
        [&self.stages[0], &self.stages[4]]
    }

    fn degree(&self) -> usize {
        3
    }

    fn interpolate(&self, share: f64, out: &mut [f64]) {
        hermite(share, self.h, [&self.y_old, &self.y_new], self.rates(), out);
    }
}
