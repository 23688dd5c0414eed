//! [`Lu`]: dense LU with row pivoting, real or complex, for the matrices of implicit steps.

use nalgebra::{Complex, ComplexField};

/// A scalar with an absolute value that is cheap to compare.
pub(super) trait Number: ComplexField<RealField = f64> + Copy {}
impl Number for f64 {}
impl Number for Complex<f64> {}

/// `P A = L U`, row by row. Zero factors are skipped, so that sparse matrices cost less. Allocates only in
/// [`Lu::resize`].
#[derive(Debug, Clone)]
pub(super) struct Lu<T> {
    n: usize,
    entries: Vec<T>,
    /// The row swapped with each row.
    swaps: Vec<usize>,
}

impl<T> Default for Lu<T> {
    fn default() -> Self {
        Self { n: 0, entries: Vec::new(), swaps: Vec::new() }
    }
}

impl<T: Number> Lu<T> {
    /// Room for an `n x n` matrix.
    pub(super) fn resize(&mut self, n: usize) {
        self.n = n;
        self.entries.clear();
        self.entries.resize(n * n, T::zero());
        self.swaps.clear();
        self.swaps.resize(n, 0);
    }

    /// Factors `shift I - J`, with `J` column by column. False if that is singular, or not finite.
    pub(super) fn factor(&mut self, shift: T, jacobian: &[f64]) -> bool {
        let n = self.n;
        for i in 0..n {
            for j in 0..n {
                let diagonal = if i == j { shift } else { T::zero() };
                self.entries[n * i + j] = diagonal - T::from_real(jacobian[i + n * j]);
            }
        }
        (0..n).all(|k| self.eliminate(k))
    }

    fn eliminate(&mut self, k: usize) -> bool {
        let n = self.n;
        let size = |i: usize| self.entries[n * i + k].norm1();
        let mut pivot = k;
        for i in k + 1..n {
            if size(i) > size(pivot) {
                pivot = i;
            }
        }
        let largest = size(pivot);
        if largest == 0.0 || !largest.is_finite() {
            return false;
        }
        self.swaps[k] = pivot;
        if pivot != k {
            for j in 0..n {
                self.entries.swap(n * k + j, n * pivot + j);
            }
        }
        let (above, below) = self.entries.split_at_mut(n * (k + 1));
        let row = &above[n * k..];
        let inverse = T::one() / row[k];
        for target in below.chunks_exact_mut(n) {
            if target[k].is_zero() {
                continue;
            }
            let factor = target[k] * inverse;
            target[k] = factor;
            for (entry, of_pivot) in target[k + 1..].iter_mut().zip(&row[k + 1..]) {
                *entry -= factor * *of_pivot;
            }
        }
        true
    }

    /// `x := A^-1 x`
    pub(super) fn solve(&self, x: &mut [T]) {
        let n = self.n;
        for (k, swap) in self.swaps.iter().enumerate() {
            x.swap(k, *swap);
        }
        for i in 1..n {
            let mut sum = x[i];
            for (entry, value) in self.entries[n * i..n * i + i].iter().zip(x.iter()) {
                sum -= *entry * *value;
            }
            x[i] = sum;
        }
        for i in (0..n).rev() {
            let mut sum = x[i];
            for (entry, value) in self.entries[n * i + i + 1..n * (i + 1)].iter().zip(&x[i + 1..]) {
                sum -= *entry * *value;
            }
            x[i] = sum / self.entries[n * i + i];
        }
    }
}
