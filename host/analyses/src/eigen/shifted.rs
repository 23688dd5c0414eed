//! [`Shifted`]: eigenvectors of a matrix in Hessenberg's form, by inverse iteration.

use nalgebra::{Complex, DMatrix};

use super::split::{Split, add, add_real, dots, product, scale_and_add};

/// Iterations for a vector, at least and at most: the first finds it, the second takes out what else the start has of others.
const LEAST: usize = 2;
const MOST: usize = 4;
/// What a vector may miss by as round-off, times that of the matrix: the shift is a third of it off the eigenvalue.
const ROUND_OFF: f64 = 10.0;

/// A matrix H in Hessenberg's form less an eigenvalue, factored once for vectors from the right and from the left. Below each pivot
/// is one entry: rows are exchanged with the next one or not.
pub(super) struct Shifted<'m> {
    /// The rows of H as columns.
    rows: &'m DMatrix<f64>,
    value: Complex<f64>,
    size: f64,
    /// The rows of U, from the diagonal on, one after the other.
    upper: Split,
    /// For each pivot: whether its row was exchanged with the next, and by how much of it that is less.
    steps: Vec<(bool, Complex<f64>)>,
}

impl<'m> Shifted<'m> {
    /// For a matrix of so many rows, which are given as columns, and of a size.
    pub(super) fn new(rows: &'m DMatrix<f64>, size: f64) -> Self {
        let n = rows.nrows();
        let upper = Split::with_capacity(n * (n + 1) / 2);
        Self { rows, value: Complex::ZERO, size, upper, steps: Vec::with_capacity(n) }
    }

    /// Less this eigenvalue.
    pub(super) fn at(&mut self, value: Complex<f64>) -> &Self {
        let n = self.rows.nrows();
        self.value = value;
        self.upper.clear();
        self.steps.clear();
        // Not quite the eigenvalue, lest a pivot vanish.
        let shift = value + Complex::new(self.size * f64::EPSILON * 3.0, self.size * f64::EPSILON);
        let Some(last) = n.checked_sub(1) else { return self };
        // What is left of the row that is not taken yet, from its entry `k` on.
        let entries = self.rows.as_slice();
        let mut own = Split { re: entries[..n].to_vec(), im: vec![0.0; n] };
        own.set(0, own.get(0) - shift);
        for k in 0..last {
            let next = &entries[(k + 1) * n + k..(k + 2) * n];
            let (below, behind) = (Complex::from(next[0]), &next[1..]);
            let exchanged = below.norm_sqr() > own.get(k).norm_sqr();
            let factor = if exchanged {
                let factor = own.get(k) / below;
                self.upper.push(below);
                self.upper.push(behind[0] - shift);
                self.upper.extend_real(&behind[1..]);
                add_real(own.part_mut(k + 1), -factor, behind);
                own.set(k + 1, own.get(k + 1) + factor * shift);
                factor
            } else {
                let pivot = not_zero(own.get(k), self.size);
                let factor = below / pivot;
                self.upper.push(pivot);
                self.upper.extend(own.part(k + 1));
                scale_and_add(own.part_mut(k + 1), -factor, behind);
                own.set(k + 1, own.get(k + 1) - shift);
                factor
            };
            self.steps.push((exchanged, factor));
        }
        self.upper.push(not_zero(own.get(last), self.size));
        self
    }

    /// Pivot `k`, and its row of U behind it.
    fn row(&self, k: usize) -> (Complex<f64>, [&[f64]; 2]) {
        let n = self.rows.nrows();
        let at = k * (2 * n + 1 - k) / 2;
        (self.upper.get(at), [&self.upper.re[at + 1..at + n - k], &self.upper.im[at + 1..at + n - k]])
    }

    /// |H v - lambda v|.
    fn miss(&self, vector: &Split) -> f64 {
        let misses = (0..vector.len()).map(|k| {
            let from = k.saturating_sub(1);
            let [re, im] = dots(&self.rows.column(k).as_slice()[from..], vector.part(from));
            (Complex::new(re, im) - vector.get(k) * self.value).norm_sqr()
        });
        misses.sum::<f64>().sqrt()
    }

    /// The solution for a right side.
    fn solve(&self, x: &mut Split) {
        for (k, (exchanged, factor)) in self.steps.iter().enumerate() {
            if *exchanged {
                x.swap(k, k + 1);
            }
            x.set(k + 1, x.get(k + 1) - factor * x.get(k));
        }
        for k in (0..x.len()).rev() {
            let (pivot, row) = self.row(k);
            let known = product(row, x.part(k + 1));
            x.set(k, (x.get(k) - known) / pivot);
        }
    }

    /// The same with the transposed matrix: conjugates of it, for conjugates of right sides, are solutions with the adjoint one.
    fn solve_transposed(&self, x: &mut Split) {
        for k in 0..x.len() {
            let (pivot, row) = self.row(k);
            let own = x.get(k) / pivot;
            x.set(k, own);
            add(x.part_mut(k + 1), -own, row);
        }
        for (k, (exchanged, factor)) in self.steps.iter().enumerate().rev() {
            x.set(k, x.get(k) - factor * x.get(k + 1));
            if *exchanged {
                x.swap(k, k + 1);
            }
        }
    }

    /// An eigenvector of unit length by inverse iteration, orthogonal to some, and what it misses by.
    fn iterate(&self, start: &Split, apart: &[&Split]) -> Option<(Split, f64)> {
        let next = |mut vector: Split| {
            self.solve(&mut vector);
            let length = vector.normalise()?;
            if apart.is_empty() {
                return Some((vector, 1.0 / length));
            }
            let vector = without(vector, apart)?;
            let miss = self.miss(&vector);
            Some((vector, miss))
        };
        self.best(without(start.clone(), apart)?, next)
    }

    /// An eigenvector, found from some start; where it can be, orthogonal to those of eigenvalues nearby.
    pub(super) fn vector(&self, start: &Split, near: &[&Split]) -> Option<Split> {
        let (plain, _) = self.iterate(start, &[])?;
        if near.is_empty() {
            return Some(plain);
        }
        // Where eigenvalues that coincide have fewer vectors, there is none that is orthogonal.
        let good = |found: &(Split, f64)| found.1 <= 1e3 * self.miss(&plain) + 1e-13 * self.size;
        Some(self.iterate(start, near).filter(good).map(|(vector, _)| vector).unwrap_or(plain))
    }

    /// The vector from the left that goes with one from the right, of unit length.
    pub(super) fn left(&self, right: &Split) -> Option<Split> {
        let next = |mut vector: Split| {
            self.solve_transposed(&mut vector);
            let length = vector.normalise()?;
            Some((vector, 1.0 / length))
        };
        self.best(right.clone().conjugate(), next).map(|(vector, _)| vector.conjugate())
    }

    /// Of iterates, each given with what it misses by, the one that misses least, but for round-off: for where eigenvalues that
    /// coincide have fewer vectors, every other one is none. A vector of unit length that grows by a factor gives one that misses
    /// by its inverse, of the matrix less the shift.
    fn best(&self, start: Split, next: impl Fn(Split) -> Option<(Split, f64)>) -> Option<(Split, f64)> {
        let round_off = ROUND_OFF * f64::EPSILON * self.size;
        let mut best = next(start)?;
        let mut last = best.0.clone();
        for k in 1..MOST {
            if k >= LEAST && best.1 <= round_off {
                break;
            }
            let (vector, miss) = next(last)?;
            last = vector.clone();
            if miss <= best.1.max(round_off) {
                best = (vector, miss);
            }
        }
        Some(best)
    }

    /// At most by a little more than the least singular value of the matrix, found from some start.
    pub(super) fn least_singular_value(&self, start: &Split) -> Option<f64> {
        let (mut vector, mut least) = (start.clone(), f64::INFINITY);
        vector.normalise()?;
        for _ in 0..MOST {
            self.solve(&mut vector);
            least = least.min(1.0 / vector.normalise()?);
            vector = vector.conjugate();
            self.solve_transposed(&mut vector);
            least = least.min(1.0 / vector.normalise()?);
            vector = vector.conjugate();
        }
        Some(least)
    }
}

/// A pivot; one that vanishes is made far less than round-off, which a double eigenvalue makes of it.
fn not_zero(pivot: Complex<f64>, size: f64) -> Complex<f64> {
    if pivot == Complex::ZERO { Complex::new(f64::EPSILON * f64::EPSILON * size, 0.0) } else { pivot }
}

/// Of unit length.
fn without(mut vector: Split, others: &[&Split]) -> Option<Split> {
    for other in others {
        let along = other.conjugate_product(&vector);
        add(vector.part_mut(0), -along, other.part(0));
    }
    vector.normalise()?;
    Some(vector)
}
