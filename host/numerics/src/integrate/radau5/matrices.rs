//! [`Matrices`]: the linear systems of implicit steps.

use nalgebra::Complex;

use super::super::jacobian::Jacobian;
use super::super::lu::Lu;
use super::super::run::Run;

/// The Jacobian `J`, and `gamma / h I - J` and `(alpha + i beta) / h I - J`, factored.
#[derive(Debug, Clone)]
pub(super) struct Matrices {
    gamma: f64,
    /// `(alpha, beta)` of each pair of eigenvalues.
    pairs: &'static [(f64, f64)],
    pub(super) jacobian: Jacobian,
    pub(super) real: Lu<f64>,
    /// One for each pair of eigenvalues.
    pub(super) complex: Vec<Lu<Complex<f64>>>,
}

impl Matrices {
    pub(super) fn new(gamma: f64, pairs: &'static [(f64, f64)]) -> Self {
        let complex = vec![Lu::default(); pairs.len()];
        Self { gamma, pairs, jacobian: Jacobian::default(), real: Lu::default(), complex }
    }

    /// Factors all of them for a step of size `h`. False where one is singular.
    pub(super) fn factor(&mut self, run: &mut Run<'_>, h: f64) -> bool {
        run.counters.factorisations += 1;
        let regular = self.eliminate(run, h);
        if regular || self.jacobian.fill.ahead() == 0 {
            return regular;
        }
        // Pivots are searched for then.
        self.jacobian.leave_dense();
        self.eliminate(run, h)
    }

    /// The same; false also where an elimination without row pivoting broke off.
    fn eliminate(&mut self, run: &mut Run<'_>, h: f64) -> bool {
        let Jacobian { fill, fill_is_new, .. } = &mut self.jacobian;
        let is_new = std::mem::replace(fill_is_new, false);
        if is_new {
            run.matrices = Some(fill.work(self.pairs.len()));
        }
        run.matrix_work += run.matrices.map_or(0.0, |work| work.factorisation);
        let mut regular = self.real.factor(self.gamma / h, fill, is_new);
        for (lu, (alpha, beta)) in self.complex.iter_mut().zip(self.pairs) {
            regular &= lu.factor(Complex::new(alpha / h, beta / h), fill, is_new);
        }
        regular
    }

    /// `x := (gamma / h I - J)^-1 x`
    pub(super) fn solve_real(&mut self, x: &mut [f64]) {
        self.real.solve(x, &self.jacobian.fill);
    }
}
