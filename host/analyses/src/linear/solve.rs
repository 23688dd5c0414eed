//! The equations of motion at one state, solved for many right sides.

use nalgebra::{DMatrix, DVector};

use crate::linalg::SparseLu;

/// Solves for `n` accelerations and multipliers, which may be of very different sizes, with a step of refinement. `None` where the
/// system is singular.
pub(super) fn solve(mut system: DMatrix<f64>, mut right: DMatrix<f64>, n: usize) -> Option<DMatrix<f64>> {
    if system.is_empty() {
        return Some(right);
    }
    let mut columns = natural_units(&system, n);
    for (k, unit) in columns.iter().enumerate() {
        system.row_mut(k).scale_mut(*unit);
        system.column_mut(k).scale_mut(*unit);
        right.row_mut(k).scale_mut(*unit);
    }
    for _ in 0..3 {
        for k in 0..columns.len() {
            let scale = power(system.row(k).amax())?;
            system.row_mut(k).iter_mut().for_each(|entry| *entry *= scale);
            right.row_mut(k).iter_mut().for_each(|entry| *entry *= scale);
        }
        for k in 0..columns.len() {
            let scale = power(system.column(k).amax())?;
            columns[k] *= scale;
            system.column_mut(k).iter_mut().for_each(|entry| *entry *= scale);
        }
    }
    let lu = SparseLu::of(&system)?;
    let mut found = lu.solve(&right);
    found += lu.solve(&left(&right, &system, &found));
    found.row_iter_mut().zip(columns.iter()).for_each(|(mut row, scale)| row *= *scale);
    found.iter().all(|value| value.is_finite()).then_some(found)
}

/// `right - system found` of a system with few entries.
fn left(right: &DMatrix<f64>, system: &DMatrix<f64>, found: &DMatrix<f64>) -> DMatrix<f64> {
    let places = (0..system.ncols()).flat_map(|column| (0..system.nrows()).map(move |row| (row, column)));
    let entries: Vec<((usize, usize), f64)> =
        places.map(|place| (place, system[place])).filter(|(_, value)| *value != 0.0).collect();
    let mut left = right.clone();
    for (mut left, found) in left.column_iter_mut().zip(found.column_iter()) {
        entries.iter().for_each(|((row, column), value)| left[*row] -= value * found[*column]);
    }
    left
}

/// Units, powers of two, in which masses are near one and the largest entry of each row of joints is: beside rows of order one, light
/// bodies would be lost in round-off.
fn natural_units(system: &DMatrix<f64>, n: usize) -> DVector<f64> {
    let mut units = DVector::from_element(system.nrows(), 1.0);
    for k in 0..system.nrows() {
        let size = if k < n {
            system[(k, k)].abs().sqrt()
        } else {
            (0..n).map(|column| (system[(k, column)] * units[column]).abs()).fold(0.0, f64::max)
        };
        units[k] = power(size).unwrap_or(1.0);
    }
    units
}

/// A power of two that brings a size near one.
fn power(size: f64) -> Option<f64> {
    (size > 0.0 && size.is_finite()).then(|| (-size.log2()).round().exp2())
}
