//! [`Bernstein`]: polynomials by coefficients that bound them.

use std::sync::OnceLock;

use super::Interval;

/// Highest degree.
const MOST: usize = 8;

/// Polynomials of one degree on the stretch 0..1, each by its coefficients in the basis of Bernstein: its values lie between
/// the smallest and the largest of them, and at the ends they are its values (Farouki, "The Bernstein polynomial basis: A
/// centennial retrospective", 2012).
#[derive(Debug, Clone, Default)]
pub struct Bernstein {
    degree: usize,
    /// One polynomial after the other, `degree + 1` coefficients each.
    coefficients: Vec<f64>,
}

impl Bernstein {
    /// The degree of all of them.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Makes them polynomials through points: `at` gives, for a share of the stretch, the value of each of the `count`
    /// polynomials in the slice. It is asked for `degree + 1` shares, the ends among them.
    ///
    /// # Panics
    /// Above degree 8.
    pub fn interpolate(&mut self, degree: usize, count: usize, mut at: impl FnMut(f64, &mut [f64])) {
        assert!(degree <= MOST, "polynomials of degree {degree} are not provided for");
        self.degree = degree;
        let size = degree + 1;
        self.coefficients.clear();
        self.coefficients.resize(count * size, 0.0);
        let mut values = vec![0.0; count];
        let inverse = inverse_collocation(degree);
        for node in 0..size {
            at(share(node, degree), &mut values);
            for (polynomial, value) in self.coefficients.chunks_exact_mut(size).zip(&values) {
                for (coefficient, row) in polynomial.iter_mut().zip(inverse) {
                    *coefficient += row[node] * value;
                }
            }
        }
    }

    /// The range of polynomial number `k`.
    #[must_use]
    pub fn range(&self, k: usize) -> Interval {
        range(&self.coefficients[k * (self.degree + 1)..(k + 1) * (self.degree + 1)])
    }

    /// The range of its derivative along the stretch.
    #[must_use]
    pub fn slope(&self, k: usize) -> Interval {
        let own = &self.coefficients[k * (self.degree + 1)..(k + 1) * (self.degree + 1)];
        let slopes = own.windows(2).map(|pair| self.degree as f64 * (pair[1] - pair[0]));
        let (low, high) = slopes.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        if low <= high { Interval::new(low, high) } else { Interval::ZERO }
    }

    /// The values at the start, or at the end.
    #[must_use]
    pub fn end(&self, k: usize, last: bool) -> f64 {
        self.coefficients[k * (self.degree + 1) + if last { self.degree } else { 0 }]
    }

    /// The value in the middle of the stretch (de Casteljau).
    #[must_use]
    pub fn middle(&self, k: usize) -> f64 {
        let size = self.degree + 1;
        let mut own = [0.0; MOST + 1];
        own[..size].copy_from_slice(&self.coefficients[k * size..(k + 1) * size]);
        for last in (1..size).rev() {
            (0..last).for_each(|j| own[j] = 0.5 * (own[j] + own[j + 1]));
        }
        own[0]
    }

    /// The same polynomials on both halves of the stretch (de Casteljau): the first half goes to `first`, the second one stays
    /// here.
    pub fn halve(&mut self, first: &mut Self) {
        let size = self.degree + 1;
        first.degree = self.degree;
        first.coefficients.clear();
        first.coefficients.resize(self.coefficients.len(), 0.0);
        for (own, left) in self.coefficients.chunks_exact_mut(size).zip(first.coefficients.chunks_exact_mut(size)) {
            for (k, left) in left.iter_mut().enumerate() {
                *left = own[0];
                for j in 0..size - 1 - k {
                    own[j] = 0.5 * (own[j] + own[j + 1]);
                }
            }
            // What is left in place, from the last column upwards, belongs to the second half.
        }
    }
}

fn range(coefficients: &[f64]) -> Interval {
    let (low, high) = coefficients.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    if coefficients.iter().any(|x| x.is_nan()) { Interval::ALL } else { Interval::new(low, high) }
}

/// The share of the stretch of one of `degree + 1` nodes: Chebyshev points, the ends included.
fn share(node: usize, degree: usize) -> f64 {
    if degree == 0 {
        return 0.0;
    }
    0.5 * (1.0 - (std::f64::consts::PI * node as f64 / degree as f64).cos())
}

/// Inverse of the matrix B_k(share of node): coefficients from values.
type Inverse = [[f64; MOST + 1]; MOST + 1];

/// It depends on the degree alone.
fn inverse_collocation(degree: usize) -> &'static Inverse {
    static KNOWN: [OnceLock<Inverse>; MOST + 1] = [const { OnceLock::new() }; MOST + 1];
    KNOWN[degree].get_or_init(|| invert_collocation(degree))
}

fn invert_collocation(degree: usize) -> Inverse {
    let size = degree + 1;
    let mut matrix = nalgebra::DMatrix::zeros(size, size);
    for node in 0..size {
        let s = share(node, degree);
        let mut choose = 1.0;
        for k in 0..size {
            matrix[(node, k)] = choose * s.powi(k as i32) * (1.0 - s).powi((degree - k) as i32);
            choose *= (degree - k) as f64 / (k + 1) as f64;
        }
    }
    let mut inverse = [[0.0; MOST + 1]; MOST + 1];
    if let Some(found) = matrix.try_inverse() {
        for (k, row) in inverse.iter_mut().enumerate().take(size) {
            row.iter_mut().take(size).enumerate().for_each(|(node, x)| *x = found[(k, node)]);
        }
    }
    inverse
}
