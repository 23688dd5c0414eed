//! [`Lu`]: elimination of the matrices of implicit steps, real or complex.

#![allow(
    unsafe_code,
    reason = "the only way to call what is compiled for a wider vector unit; the use says why it holds"
)]

use std::ops::Range;

use nalgebra::{Complex, ComplexField};

use super::fill::{Entry, Fill, Through};
use super::halves::{Pair, Quadrature};

/// Columns of the rest that are eliminated at a time.
const PANEL: usize = 4;

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

    /// The sum of products of a row with a row of unknowns, both of `n`, over a range of the numbers.
    fn dot(row: &[f64], unknowns: &[f64], n: usize, range: Range<usize>) -> Self;

    /// `target := target - factor row` for a range of the numbers, both rows of `n`.
    fn take_from(self, target: &mut [f64], row: &[f64], n: usize, range: Range<usize>);

    /// The same with rows that follow each other, one after the other, from number `from` on.
    fn take_panel_from(factors: [Self; PANEL], target: &mut [f64], rows: &[f64], n: usize, from: usize);
}

impl Number for f64 {
    const PARTS: usize = 1;

    fn get(row: &[f64], _: usize, k: usize) -> Self {
        row[k]
    }

    fn put(self, row: &mut [f64], _: usize, k: usize) {
        row[k] = self;
    }

    #[inline(always)]
    fn dot(row: &[f64], unknowns: &[f64], _: usize, range: Range<usize>) -> Self {
        products(&row[range.clone()], &unknowns[range])
    }

    #[inline(always)]
    fn take_from(self, target: &mut [f64], row: &[f64], _: usize, range: Range<usize>) {
        target[range.clone()].iter_mut().zip(&row[range]).for_each(|(entry, other)| *entry -= self * other);
    }

    #[inline(always)]
    fn take_panel_from(factors: [Self; PANEL], target: &mut [f64], rows: &[f64], n: usize, from: usize) {
        let others: [&[f64]; PANEL] = std::array::from_fn(|q| &rows[n * q + from..n * (q + 1)]);
        for (k, entry) in target[from..n].iter_mut().enumerate() {
            let mut left = *entry;
            for (factor, other) in factors.iter().zip(others) {
                left -= factor * other[k];
            }
            *entry = left;
        }
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

    #[inline(always)]
    fn dot(row: &[f64], unknowns: &[f64], n: usize, range: Range<usize>) -> Self {
        let [(re, im), (x, y)] = [row, unknowns].map(|row| row.split_at(n));
        let [re, im, x, y] = [re, im, x, y].map(|part| &part[range.clone()]);
        Self::new(products(re, x) - products(im, y), products(re, y) + products(im, x))
    }

    #[inline(always)]
    fn take_from(self, target: &mut [f64], row: &[f64], n: usize, range: Range<usize>) {
        let (re, im) = target.split_at_mut(n);
        let (other_re, other_im) = row.split_at(n);
        let others = other_re[range.clone()].iter().zip(&other_im[range.clone()]);
        for ((re, im), (other_re, other_im)) in re[range.clone()].iter_mut().zip(&mut im[range]).zip(others) {
            *re -= self.re * other_re - self.im * other_im;
            *im -= self.re * other_im + self.im * other_re;
        }
    }

    #[inline(always)]
    fn take_panel_from(factors: [Self; PANEL], target: &mut [f64], rows: &[f64], n: usize, from: usize) {
        let others_re: [&[f64]; PANEL] = std::array::from_fn(|q| &rows[2 * n * q + from..n * (2 * q + 1)]);
        let others_im: [&[f64]; PANEL] = std::array::from_fn(|q| &rows[n * (2 * q + 1) + from..n * (2 * q + 2)]);
        let (re, im) = target.split_at_mut(n);
        for (k, (re, im)) in re[from..].iter_mut().zip(&mut im[from..n]).enumerate() {
            let (mut left_re, mut left_im) = (*re, *im);
            for ((factor, other_re), other_im) in factors.iter().zip(others_re).zip(others_im) {
                left_re -= factor.re * other_re[k] - factor.im * other_im[k];
                left_im -= factor.re * other_im[k] + factor.im * other_re[k];
            }
            (*re, *im) = (left_re, left_im);
        }
    }
}

/// The sum of products, four at a time.
#[inline(always)]
fn products(a: &[f64], b: &[f64]) -> f64 {
    if a.len() < 4 {
        return a.iter().zip(b).map(|(a, b)| a * b).sum();
    }
    let (a, a_rest) = a.as_chunks::<4>();
    let (b, b_rest) = b.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// `shift I - J`, eliminated in the order of a [`Fill`]: of what is kept the head row by row with pivots on the diagonal, what is
/// left as `P A = L U` with row pivoting, where zero factors are skipped. Allocates where the fill is new only.
#[derive(Debug, Clone, Default)]
pub(super) struct Lu<T> {
    inverse_shift: T,
    /// By place: factors of the rows of the head that were taken from this one, as [`Fill::before`].
    lower: Vec<Vec<T>>,
    /// By place of the head: entries after the diagonal, as [`Fill::after`]; the inverse of the pivot.
    upper: Vec<Vec<T>>,
    inverses: Vec<T>,
    /// The inverses of the pivots of the dense rest.
    pivots: Vec<T>,
    /// The dense rest.
    rest: usize,
    rows: Vec<f64>,
    /// The row swapped with each row.
    swaps: Vec<usize>,
    /// One row; zero between uses.
    row: Vec<T>,
    /// The unknowns of the rest, as a row of it.
    unknowns: Vec<f64>,
}

impl<T: Number> Lu<T> {
    /// Room for the matrices of a fill.
    fn resize(&mut self, fill: &Fill) {
        self.lower = fill.before.iter().map(|places| vec![T::zero(); places.len()]).collect();
        self.upper = fill.after.iter().map(|places| vec![T::zero(); places.len()]).collect();
        self.inverses = vec![T::zero(); fill.head];
        self.rest = fill.order.len() - fill.head;
        self.rows = vec![0.0; T::PARTS * self.rest * self.rest];
        self.unknowns = vec![0.0; T::PARTS * self.rest];
        self.swaps = vec![0; self.rest];
        self.pivots = vec![T::zero(); self.rest];
        self.row = vec![T::zero(); fill.order.len()];
    }

    /// Factors `shift I - J` with the `J` that `fill` took. False if that is singular, or not finite, or has a small pivot in the
    /// head. `is_new` says that the order is not that of the last call.
    pub(super) fn factor(&mut self, shift: T, fill: &Fill, is_new: bool) -> bool {
        if is_new || self.row.len() != fill.order.len() {
            self.resize(fill);
        }
        let (head, rest) = (fill.head, self.rest);
        let least = LEAST_PIVOT * shift.norm1();
        self.inverse_shift = T::one() / shift;
        for (place, values) in fill.values.iter().enumerate() {
            self.row[place] = shift;
            for Entry { column, own, through } in values {
                self.row[*column as usize] -= self.inverse_shift.scale(*through) + T::from_real(*own);
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
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: this machine has what the function was compiled for.
            return unsafe { self.eliminate_widely() };
        }
        self.eliminate()
    }

    /// [`Lu::eliminate`] with vectors of four numbers, which are the same: elimination is nearly all of the work of a dense rest.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn eliminate_widely(&mut self) -> bool {
        self.eliminate()
    }

    /// Row `i` of the rest.
    fn row(&self, i: usize) -> &[f64] {
        &self.rows[T::PARTS * self.rest * i..][..T::PARTS * self.rest]
    }

    /// The rest, a few columns at a time, so that rows are loaded less often. Each entry has its terms taken in the same order
    /// as one by one.
    #[inline(always)]
    fn eliminate(&mut self) -> bool {
        let n = self.rest;
        let length = T::PARTS * n;
        for first in (0..n).step_by(PANEL) {
            let end = (first + PANEL).min(n);
            if !(first..end).all(|k| self.eliminate_column(k, end)) {
                return false;
            }
            let (above, below) = self.rows.split_at_mut(length * end);
            let panel = &mut above[length * first..];
            for k in 1..end - first {
                let (before, own) = panel.split_at_mut(length * k);
                for (q, row) in before.chunks_exact(length).enumerate() {
                    T::get(own, n, first + q).take_from(&mut own[..length], row, n, end..n);
                }
            }
            // Below a panel that is not complete is nothing.
            for target in below.chunks_exact_mut(length) {
                let factors = std::array::from_fn(|q| T::get(target, n, first + q));
                if factors.iter().any(|factor: &T| !factor.is_zero()) {
                    T::take_panel_from(factors, target, panel, n, end);
                }
            }
        }
        true
    }

    /// Column `k`, and what follows from it up to column `end`.
    #[inline(always)]
    fn eliminate_column(&mut self, k: usize, end: usize) -> bool {
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
        self.pivots[k] = inverse;
        for target in below.chunks_exact_mut(length) {
            let entry = T::get(target, n, k);
            if entry.is_zero() {
                continue;
            }
            let factor = entry * inverse;
            factor.put(target, n, k);
            factor.take_from(target, row, n, k + 1..end);
        }
        true
    }

    /// `x := A^-1 x`
    pub(super) fn solve(&mut self, x: &mut [T], fill: &Fill) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: this machine has what the function was compiled for.
            return unsafe { self.solve_widely(x, fill) };
        }
        self.solve_plainly(x, fill);
    }

    /// As [`Lu::eliminate_widely`].
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn solve_widely(&mut self, x: &mut [T], fill: &Fill) {
        self.solve_plainly(x, fill);
    }

    #[inline(always)]
    fn solve_plainly(&mut self, x: &mut [T], fill: &Fill) {
        let (head, n) = (fill.head, self.rest);
        let mut y = std::mem::take(&mut self.row);
        y.iter_mut().zip(&fill.order).for_each(|(value, unknown)| *value = x[*unknown]);
        for Pair { position, .. } in &fill.halves.pairs {
            x[*position] *= self.inverse_shift;
        }
        let mut entries = &fill.through_values[..];
        for Through { position, place, count } in &fill.through {
            let (own, others) = entries.split_at(*count as usize);
            let from = x[*position as usize];
            y[*place as usize..].iter_mut().zip(own).for_each(|(value, entry)| *value += from.scale(*entry));
            entries = others;
        }
        if head > 0 {
            for place in 0..y.len() {
                let taken = fill.before[place].iter().zip(&self.lower[place]);
                y[place] = taken.fold(y[place], |sum, (k, factor)| sum - *factor * y[*k as usize]);
            }
        }
        let rest = &mut y[head..];
        for (k, swap) in self.swaps.iter().enumerate() {
            rest.swap(k, *swap);
        }
        let mut z = std::mem::take(&mut self.unknowns);
        for (i, value) in rest.iter().enumerate() {
            (*value - T::dot(self.row(i), &z, n, 0..i)).put(&mut z, n, i);
        }
        for (i, value) in rest.iter_mut().enumerate().rev() {
            *value = (T::get(&z, n, i) - T::dot(self.row(i), &z, n, i + 1..n)) * self.pivots[i];
            value.put(&mut z, n, i);
        }
        self.unknowns = z;
        for place in (0..head).rev() {
            let taken = fill.after[place].iter().zip(&self.upper[place]);
            let sum = taken.fold(y[place], |sum, (k, entry)| sum - *entry * y[*k as usize]);
            y[place] = sum * self.inverses[place];
        }
        for (value, unknown) in y.iter_mut().zip(&fill.order) {
            x[*unknown] = std::mem::replace(value, T::zero());
        }
        self.row = y;
        for Pair { position, velocity, slope } in &fill.halves.pairs {
            x[*position] += (self.inverse_shift * x[*velocity]).scale(*slope);
        }
        for Quadrature { unknown, row } in &fill.halves.sums {
            let sum = row.iter().fold(x[*unknown], |sum, (k, entry)| sum + x[*k as usize].scale(*entry));
            x[*unknown] = sum * self.inverse_shift;
        }
    }
}
