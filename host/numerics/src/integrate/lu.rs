//! [`Lu`]: elimination of the matrices of implicit steps, real or complex.

use nalgebra::{Complex, ComplexField};

use super::fill::Fill;

/// Share of the shift below which a pivot of the head is not relied on.
const LEAST_PIVOT: f64 = 1e-3;

/// A scalar with an absolute value that is cheap to compare. Rows keep parts of their numbers side by side (all real ones, then
/// all imaginary ones), with which operations on whole rows are vectors.
pub(super) trait Number: ComplexField<RealField = f64> + Copy {
    /// Real numbers that make one.
    const PARTS: usize;

    /// The number at `k` of a row of `n`.
    fn get(row: &[f64], n: usize, k: usize) -> Self;

    /// Puts the number at `k` of a row of `n`.
    fn put(self, row: &mut [f64], n: usize, k: usize);

    /// `target := target - factor row`, from number `from` on, both of `n`.
    fn take_from(self, target: &mut [f64], row: &[f64], n: usize, from: usize);
}

impl Number for f64 {
    const PARTS: usize = 1;

    fn get(row: &[f64], _: usize, k: usize) -> Self {
        row[k]
    }

    fn put(self, row: &mut [f64], _: usize, k: usize) {
        row[k] = self;
    }

    fn take_from(self, target: &mut [f64], row: &[f64], _: usize, from: usize) {
        target[from..].iter_mut().zip(&row[from..]).for_each(|(entry, other)| *entry -= self * other);
    }
}

impl Number for Complex<f64> {
    const PARTS: usize = 2;

    fn get(row: &[f64], n: usize, k: usize) -> Self {
        Self::new(row[k], row[n + k])
    }

    fn put(self, row: &mut [f64], n: usize, k: usize) {
        (row[k], row[n + k]) = (self.re, self.im);
    }

    fn take_from(self, target: &mut [f64], row: &[f64], n: usize, from: usize) {
        let (re, im) = target.split_at_mut(n);
        let (other_re, other_im) = row.split_at(n);
        let others = other_re[from..].iter().zip(&other_im[from..n]);
        for ((re, im), (other_re, other_im)) in re[from..].iter_mut().zip(&mut im[from..n]).zip(others) {
            *re -= self.re * other_re - self.im * other_im;
            *im -= self.re * other_im + self.im * other_re;
        }
    }
}

/// `shift I - J`, eliminated in the order of a [`Fill`]: the head row by row with pivots on the diagonal, what is left as
/// `P A = L U` with row pivoting, where zero factors are skipped. Allocates where the fill is new only.
#[derive(Debug, Clone, Default)]
pub(super) struct Lu<T> {
    /// By place: factors of the rows of the head that were taken from this one, as [`Fill::before`].
    lower: Vec<Vec<T>>,
    /// By place of the head: entries after the diagonal, as [`Fill::after`]; the inverse of the pivot.
    upper: Vec<Vec<T>>,
    inverses: Vec<T>,
    /// The dense rest.
    rest: usize,
    rows: Vec<f64>,
    /// The row swapped with each row.
    swaps: Vec<usize>,
    /// One row; zero between uses.
    row: Vec<T>,
}

impl<T: Number> Lu<T> {
    /// Room for the matrices of a fill.
    fn resize(&mut self, fill: &Fill) {
        self.lower = fill.before.iter().map(|places| vec![T::zero(); places.len()]).collect();
        self.upper = fill.after.iter().map(|places| vec![T::zero(); places.len()]).collect();
        self.inverses = vec![T::zero(); fill.head];
        self.rest = fill.order.len() - fill.head;
        self.rows = vec![0.0; T::PARTS * self.rest * self.rest];
        self.swaps = vec![0; self.rest];
        self.row = vec![T::zero(); fill.order.len()];
    }

    /// Factors `shift I - J`, with `J` column by column. False if that is singular, or not finite, or has a small pivot in the
    /// head. `is_new` tells that the fill is not that of the last call.
    pub(super) fn factor(&mut self, shift: T, jacobian: &[f64], fill: &Fill, is_new: bool) -> bool {
        if is_new || self.row.len() != fill.order.len() {
            self.resize(fill);
        }
        let (head, rest) = (fill.head, self.rest);
        let least = LEAST_PIVOT * shift.norm1();
        for (place, entries) in fill.entries.iter().enumerate() {
            self.row[place] = shift;
            for (column, index) in entries {
                self.row[*column as usize] -= T::from_real(jacobian[*index as usize]);
            }
            for (k, factor) in fill.before[place].iter().zip(&mut self.lower[place]) {
                let k = *k as usize;
                *factor = std::mem::replace(&mut self.row[k], T::zero()) * self.inverses[k];
                for (column, entry) in fill.after[k].iter().zip(&self.upper[k]) {
                    self.row[*column as usize] -= *factor * *entry;
                }
            }
            if place < head {
                let pivot = std::mem::replace(&mut self.row[place], T::zero());
                for (column, entry) in fill.after[place].iter().zip(&mut self.upper[place]) {
                    *entry = std::mem::replace(&mut self.row[*column as usize], T::zero());
                }
                // Not a number is no pivot either.
                if pivot.norm1() >= least {
                    self.inverses[place] = T::one() / pivot;
                } else {
                    return false;
                }
            } else {
                let to = &mut self.rows[T::PARTS * rest * (place - head)..][..T::PARTS * rest];
                for (k, entry) in self.row[head..].iter_mut().enumerate() {
                    std::mem::replace(entry, T::zero()).put(to, rest, k);
                }
            }
        }
        (0..rest).all(|k| self.eliminate(k))
    }

    /// Row `i` of the rest.
    fn row(&self, i: usize) -> &[f64] {
        &self.rows[T::PARTS * self.rest * i..][..T::PARTS * self.rest]
    }

    fn eliminate(&mut self, k: usize) -> bool {
        let n = self.rest;
        let size = |i: usize| T::get(self.row(i), n, k).norm1();
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
        let length = T::PARTS * n;
        if pivot != k {
            let (above, below) = self.rows.split_at_mut(length * pivot);
            above[length * k..length * (k + 1)].swap_with_slice(&mut below[..length]);
        }
        let (above, below) = self.rows.split_at_mut(length * (k + 1));
        let row = &above[length * k..];
        let inverse = T::one() / T::get(row, n, k);
        for target in below.chunks_exact_mut(length) {
            let entry = T::get(target, n, k);
            if entry.is_zero() {
                continue;
            }
            let factor = entry * inverse;
            factor.put(target, n, k);
            factor.take_from(target, row, n, k + 1);
        }
        true
    }

    /// `x := A^-1 x`
    pub(super) fn solve(&mut self, x: &mut [T], fill: &Fill) {
        let (head, n) = (fill.head, self.rest);
        let mut y = std::mem::take(&mut self.row);
        for (place, unknown) in fill.order.iter().enumerate() {
            let taken = fill.before[place].iter().zip(&self.lower[place]);
            y[place] = taken.fold(x[*unknown], |sum, (k, factor)| sum - *factor * y[*k as usize]);
        }
        let rest = &mut y[head..];
        for (k, swap) in self.swaps.iter().enumerate() {
            rest.swap(k, *swap);
        }
        for i in 1..n {
            let row = self.row(i);
            rest[i] = (0..i).fold(rest[i], |sum, k| sum - T::get(row, n, k) * rest[k]);
        }
        for i in (0..n).rev() {
            let row = self.row(i);
            let sum = (i + 1..n).fold(rest[i], |sum, k| sum - T::get(row, n, k) * rest[k]);
            rest[i] = sum / T::get(row, n, i);
        }
        for place in (0..head).rev() {
            let taken = fill.after[place].iter().zip(&self.upper[place]);
            let sum = taken.fold(y[place], |sum, (k, entry)| sum - *entry * y[*k as usize]);
            y[place] = sum * self.inverses[place];
        }
        for (value, unknown) in y.iter_mut().zip(&fill.order) {
            x[*unknown] = std::mem::replace(value, T::zero());
        }
        self.row = y;
    }
}
