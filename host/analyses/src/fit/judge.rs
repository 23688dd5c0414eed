//! What the measurements say of the parameters: intervals, correlation, directions that they leave open.

use nalgebra::DMatrix;

use super::levenberg::Bounds;
use super::statistics::two_sided;
use super::{Direction, Fit, Fitted, Noise};
use crate::sensitivity::{Parameter, base};

/// Probability that a parameter is outside of its interval.
const OUTSIDE: f64 = 0.05;
/// Relative standard deviation of a direction above which it is not determined.
const OPEN: f64 = 1.0;
/// Singular values below this many errors of the derivatives are zero.
const ERRORS: f64 = 10.0;
/// The least error that differences can have.
const LEAST_DOUBT: f64 = 1e-10;
/// A parameter with a larger share in a direction that is not determined is not determined itself.
const SHARE: f64 = 1e-3;
/// Shares below this are not told.
const TOLD: f64 = 0.01;

/// Judges a minimum. `jacobian` has the derivatives of residuals over their noise, `doubt` the relative error of its columns.
pub(super) fn judge(
    parameters: &[Parameter],
    bounds: &[Bounds],
    at: &[f64],
    jacobian: &DMatrix<f64>,
    doubt: f64,
    noise: &Noise,
    residuals: &[f64],
) -> Fit {
    let count = at.len();
    let bound = |k: usize| at[k] <= bounds[k].low || at[k] >= bounds[k].high;
    let free: Vec<usize> = (0..count).filter(|k| !bound(*k)).collect();
    let freedoms = residuals.len() - free.len();
    let mut scaled = jacobian.select_columns(&free);
    free.iter().enumerate().for_each(|(column, k)| scaled.column_mut(column).scale_mut(base(at[*k])));
    let svd = scaled.svd(false, true);
    let turned = svd.v_t.unwrap_or_else(|| DMatrix::identity(free.len(), free.len()));
    let largest = svd.singular_values.iter().copied().fold(0.0, f64::max);
    let zero = largest * ERRORS * doubt.max(LEAST_DOUBT);
    let mut covariance = DMatrix::<f64>::zeros(free.len(), free.len());
    let mut undetermined = Vec::new();
    let mut open = vec![false; free.len()];
    for (value, row) in svd.singular_values.iter().zip(turned.row_iter()) {
        let deviation = if *value <= zero { f64::INFINITY } else { 1.0 / value };
        if deviation < OPEN {
            covariance += row.transpose() * row / (value * value);
            continue;
        }
        let most = row.iter().fold(0.0_f64, |most: f64, x| if x.abs() > most.abs() { *x } else { most });
        let shares: Vec<f64> = row.iter().map(|x| x / most).collect();
        shares.iter().zip(&mut open).for_each(|(share, open)| *open |= share.abs() > SHARE);
        let parts = free.iter().zip(&shares).filter(|(_, share)| share.abs() >= TOLD);
        let parts = parts.map(|(k, share)| (parameters[*k].key.clone(), *share)).collect();
        undetermined.push(Direction { parts, deviation });
    }
    let quantile = match (noise.known(), freedoms) {
        (true, _) => two_sided(OUTSIDE, f64::INFINITY),
        (false, 0) => f64::NAN,
        (false, freedoms) => two_sided(OUTSIDE, freedoms as f64),
    };
    let place = |k: usize| free.iter().position(|free| *free == k).filter(|place| !open[*place]);
    let fitted = parameters.iter().enumerate().map(|(k, parameter)| {
        let error = match place(k) {
            Some(place) if quantile.is_finite() => covariance[(place, place)].sqrt() * base(at[k]),
            _ => f64::NAN,
        };
        Fitted {
            key: parameter.key.clone(),
            unit: parameter.unit.clone(),
            start: at[k],
            value: at[k],
            min: bounds[k].low,
            max: bounds[k].high,
            at_bound: bound(k),
            undetermined: !bound(k) && place(k).is_none(),
            error,
            low: at[k] - quantile * error,
            high: at[k] + quantile * error,
        }
    });
    let correlation = |i: usize, k: usize| match (place(i), place(k)) {
        (Some(a), Some(b)) => covariance[(a, b)] / (covariance[(a, a)] * covariance[(b, b)]).sqrt(),
        _ => f64::NAN,
    };
    let mut notes = Vec::new();
    if quantile.is_nan() {
        notes.push(
            "as many measured numbers as parameters: nothing is left to estimate the noise from, so there are no intervals; give it"
                .to_owned(),
        );
    }
    Fit {
        status: if undetermined.is_empty() { "converged" } else { "undetermined" },
        parameters: fitted.collect(),
        correlation: (0..count).map(|i| (0..count).map(|k| correlation(i, k)).collect()).collect(),
        undetermined,
        singular_values: svd.singular_values.iter().copied().collect(),
        columns: Vec::new(),
        chi_square: residuals.iter().map(|r| r * r).sum(),
        freedoms,
        iterations: 0,
        runs: 0,
        shortened: 0,
        how: String::new(),
        notes,
        time_unit: String::new(),
        times: Vec::new(),
        sets: Vec::new(),
    }
}
