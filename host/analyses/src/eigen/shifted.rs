//! [`Shifted`]: eigenvectors of a matrix in Hessenberg's form, by inverse iteration.

use nalgebra::{Complex, DMatrix};

use super::ComplexVector;

/// Iterations for a vector.
const ITERATIONS: usize = 4;

/// A matrix H in Hessenberg's form less an eigenvalue, factored once for vectors from the right and from the left. Below each pivot
/// is one entry: rows are exchanged with the next one or not.
pub(super) struct Shifted<'m> {
    /// The rows of H as columns.
    rows: &'m DMatrix<f64>,
    value: Complex<f64>,
    size: f64,
    /// The rows of U, from the diagonal on, one after the other.
    upper: Vec<Complex<f64>>,
    /// For each pivot: whether its row was exchanged with the next, and by how much of it that is less.
    steps: Vec<(bool, Complex<f64>)>,
}

impl<'m> Shifted<'m> {
    /// For an eigenvalue of a matrix of so many rows, which are given as columns, and of a size.
    pub(super) fn new(rows: &'m DMatrix<f64>, value: Complex<f64>, size: f64) -> Self {
        let n = rows.nrows();
        // Not quite the eigenvalue, lest a pivot vanish.
        let shift = value + Complex::new(size * f64::EPSILON * 3.0, size * f64::EPSILON);
        let row = |k: usize, from: usize| {
            let mut row: Vec<Complex<f64>> = rows.column(k).iter().skip(from).map(|x| Complex::new(*x, 0.0)).collect();
            row[k - from] -= shift;
            row
        };
        let mut upper = Vec::with_capacity(n * (n + 1) / 2);
        let mut steps = Vec::with_capacity(n.saturating_sub(1));
        let mut own = row(0, 0);
        for k in 0..n {
            if k + 1 == n {
                upper.push(not_zero(own[0], size));
                break;
            }
            let mut next = row(k + 1, k);
            let exchanged = next[0].norm_sqr() > own[0].norm_sqr();
            if exchanged {
                std::mem::swap(&mut own, &mut next);
            }
            own[0] = not_zero(own[0], size);
            let factor = next[0] / own[0];
            if factor != Complex::ZERO {
                next.iter_mut().zip(&own).for_each(|(next, own)| *next -= factor * own);
            }
            steps.push((exchanged, factor));
            upper.extend_from_slice(&own);
            next.remove(0);
            own = next;
        }
        Self { rows, value, size, upper, steps }
    }

    /// Row `k` of U from the diagonal on.
    fn row(&self, k: usize) -> &[Complex<f64>] {
        let n = self.rows.nrows();
        let from = k * (2 * n + 1 - k) / 2;
        &self.upper[from..from + n - k]
    }

    /// |H v - lambda v|.
    fn miss(&self, vector: &ComplexVector) -> f64 {
        let misses = (0..vector.len()).map(|k| {
            let terms = self.rows.column(k).into_iter().zip(vector.iter()).skip(k.saturating_sub(1));
            (terms.map(|(x, v)| v * *x).sum::<Complex<f64>>() - vector[k] * self.value).norm_sqr()
        });
        misses.sum::<f64>().sqrt()
    }

    /// |H^T w - conj(lambda) w|.
    fn miss_from_left(&self, vector: &ComplexVector) -> f64 {
        let mut miss = vector.map(|entry| -entry * self.value.conj());
        for (k, entry) in vector.iter().enumerate() {
            let from = k.saturating_sub(1);
            miss.iter_mut().zip(self.rows.column(k).iter()).skip(from).for_each(|(miss, x)| *miss += entry * *x);
        }
        miss.norm()
    }

    /// The solution for a right side.
    fn solve(&self, mut vector: ComplexVector) -> ComplexVector {
        let x = vector.as_mut_slice();
        for (k, (exchanged, factor)) in self.steps.iter().enumerate() {
            if *exchanged {
                x.swap(k, k + 1);
            }
            let own = x[k];
            x[k + 1] -= factor * own;
        }
        for k in (0..x.len()).rev() {
            let row = self.row(k);
            let (own, behind) = x.split_at_mut(k + 1);
            let known: Complex<f64> = row[1..].iter().zip(&*behind).map(|(entry, x)| entry * x).sum();
            own[k] = (own[k] - known) / row[0];
        }
        vector
    }

    /// The same with the adjoint matrix.
    fn solve_adjoint(&self, mut vector: ComplexVector) -> ComplexVector {
        let x = vector.as_mut_slice();
        for k in 0..x.len() {
            let row = self.row(k);
            let (own, behind) = x.split_at_mut(k + 1);
            own[k] /= row[0].conj();
            let own = own[k];
            behind.iter_mut().zip(&row[1..]).for_each(|(x, entry)| *x -= entry.conj() * own);
        }
        for (k, (exchanged, factor)) in self.steps.iter().enumerate().rev() {
            let next = x[k + 1];
            x[k] -= factor.conj() * next;
            if *exchanged {
                x.swap(k, k + 1);
            }
        }
        vector
    }

    /// An eigenvector of unit length by inverse iteration, orthogonal to some: the best of the iterates, for where eigenvalues that
    /// coincide have fewer vectors, every other one is none.
    fn iterate(&self, start: &ComplexVector, apart: &[&ComplexVector]) -> Option<ComplexVector> {
        let next = |vector| Some(without(unit(self.solve(without(vector, apart)))?, apart)).and_then(unit);
        best(start, next, |vector| self.miss(vector))
    }

    /// An eigenvector, found from some start; where it can be, orthogonal to those of eigenvalues nearby.
    pub(super) fn vector(&self, start: &ComplexVector, near: &[&ComplexVector]) -> Option<ComplexVector> {
        let plain = self.iterate(start, &[])?;
        if near.is_empty() {
            return Some(plain);
        }
        // Where eigenvalues that coincide have fewer vectors, there is none that is orthogonal.
        let good = |vector: &ComplexVector| self.miss(vector) <= 1e3 * self.miss(&plain) + 1e-13 * self.size;
        Some(self.iterate(start, near).filter(good).unwrap_or(plain))
    }

    /// The vector from the left that goes with one from the right, of unit length.
    pub(super) fn left(&self, right: &ComplexVector) -> Option<ComplexVector> {
        best(right, |vector| unit(self.solve_adjoint(vector)), |vector| self.miss_from_left(vector))
    }
}

/// The iterate that misses least.
fn best(
    start: &ComplexVector,
    next: impl Fn(ComplexVector) -> Option<ComplexVector>,
    miss: impl Fn(&ComplexVector) -> f64,
) -> Option<ComplexVector> {
    let mut vector = next(start.clone())?;
    let mut best = (miss(&vector), vector.clone());
    for _ in 1..ITERATIONS {
        vector = next(vector)?;
        let miss = miss(&vector);
        if miss <= best.0 {
            best = (miss, vector.clone());
        }
    }
    Some(best.1)
}

/// A pivot; one that vanishes is made far less than round-off, which a double eigenvalue makes of it.
fn not_zero(pivot: Complex<f64>, size: f64) -> Complex<f64> {
    if pivot == Complex::ZERO { Complex::new(f64::EPSILON * f64::EPSILON * size, 0.0) } else { pivot }
}

fn without(mut vector: ComplexVector, others: &[&ComplexVector]) -> ComplexVector {
    for other in others {
        let along = other.dotc(&vector);
        vector -= *other * along;
    }
    vector
}

fn unit(vector: ComplexVector) -> Option<ComplexVector> {
    let length = vector.norm();
    (length.is_finite() && length > 0.0).then(|| vector / Complex::new(length, 0.0))
}
