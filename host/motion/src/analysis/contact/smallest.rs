//! Systems that may be singular: the smallest of their solutions, found by blocks.

use nalgebra::{DMatrix, DVector};

use super::RANK_TOLERANCE;
use crate::linalg::{FullPivLu, SingularValues, connected_blocks};

/// Pivots above this share of the largest are those of a matrix that is not singular.
const REGULAR: f64 = 1e-5;

/// The smallest solution of a system that may be singular, by its blocks.
pub(super) fn smallest(matrix: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let of_block = |matrix: &DMatrix<f64>, right: &DVector<f64>| {
        only_one(matrix, right).unwrap_or_else(|| smallest_of_many(matrix, right))
    };
    let blocks = blocks(matrix);
    if blocks.len() == 1 {
        return of_block(matrix, right);
    }
    let mut found = DVector::zeros(right.len());
    for own in blocks {
        let part = of_block(&block(matrix, &own), &DVector::from_fn(own.len(), |i, _| right[own[i]]));
        own.iter().zip(part.iter()).for_each(|(place, value)| found[*place] = *value);
    }
    found
}

/// The unknowns of a square matrix, those together that have to do with each other: what rests apart is decided by itself.
pub(super) fn blocks(matrix: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let n = matrix.nrows();
    let entries = matrix.iter().enumerate().filter(|(_, value)| **value != 0.0).map(|(at, _)| (at % n, at / n));
    connected_blocks(n, entries)
}

/// The block of some unknowns.
pub(super) fn block(matrix: &DMatrix<f64>, own: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(own.len(), own.len(), |i, j| matrix[(own[i], own[j])])
}

/// The solution of a system, where it is clearly not singular.
pub(super) fn only_one(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let n = right.len();
    let mut lu = FullPivLu::new(n, REGULAR);
    lu.entries_mut().copy_from_slice(matrix.as_slice());
    lu.factor().ok()?;
    if lu.rank() < n {
        return None;
    }
    let mut x = DVector::zeros(n);
    lu.solve(right.as_slice(), x.as_mut_slice()).ok()?;
    Some(x)
}

/// The twin of [`only_one`], for any rank.
pub(super) fn smallest_of_many(matrix: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let found = SingularValues::of(matrix);
    found
        .map_or_else(|| DVector::zeros(matrix.ncols()), |values| values.solve(right, RANK_TOLERANCE * values.largest()))
}
