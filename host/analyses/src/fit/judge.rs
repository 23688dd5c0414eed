//! What the measurements say of the parameters: intervals, correlation, directions that they leave open.

use nalgebra::DMatrix;

use super::levenberg::Bounds;
use super::statistics::two_sided;
use super::{Direction, Fit, Fitted, Level, free};
use crate::linalg::SingularValues;
use crate::sensitivity::Parameter;

/// Probability that a parameter is outside of its interval.
const OUTSIDE: f64 = 0.05;
/// Standard deviation, as a share of sizes, from which a parameter or a direction is not determined.
const OPEN: f64 = 1.0;
/// Singular values below this many errors of the derivatives are zero.
const ERRORS: f64 = 10.0;
/// The least error that differences can have.
const LEAST_DOUBT: f64 = 1e-10;
/// A parameter with a larger share in a direction that changes nothing is not determined itself.
const SHARE: f64 = 1e-3;
/// A parameter that is less than this share of its size has changes as shares of the size, not of itself.
const NEAR_ZERO: f64 = 1e-2;
/// Shares below this are not reported.
const LEAST_SHARE: f64 = 0.01;

/// Judges a minimum. `sizes` are typical of the parameters; `jacobian` has the derivatives of residuals over their noise, `doubts` the
/// relative errors of its columns; `levels` of noise that was estimated. `None` where a derivative is not finite.
pub(super) fn judge(
    (parameters, bounds, sizes): (&[Parameter], &[Bounds], &[f64]),
    at: &[f64],
    (jacobian, doubts): (&DMatrix<f64>, &[f64]),
    levels: &[Level],
    residuals: &[f64],
) -> Option<Fit> {
    let count = at.len();
    let free = free(at, bounds);
    let bound = |k: usize| !free.contains(&k);
    let freedoms = residuals.len() - free.len();
    let mut scaled = jacobian.select_columns(&free);
    // By columns of length 1, nothing depends on the units and values of parameters; these may be 0.
    let norms: Vec<f64> = scaled.column_iter().map(|column| column.norm()).collect();
    let lengths: Vec<f64> = norms.iter().map(|norm| if *norm == 0.0 { 1.0 } else { *norm }).collect();
    lengths.iter().enumerate().for_each(|(column, length)| scaled.column_mut(column).unscale_mut(*length));
    let decomposed = SingularValues::of(&scaled)?;
    let mut covariance = DMatrix::<f64>::zeros(free.len(), free.len());
    let mut undetermined = Vec::new();
    let mut open = vec![false; free.len()];
    let size = |place: usize| at[free[place]].abs().max(sizes[free[place]]);
    // Reports a direction with these changes of the free parameters, in their units.
    let mut report = |changes: Vec<f64>, deviation: f64| {
        let relative = |(place, change): (usize, &f64)| {
            let value = at[free[place]].abs();
            change / if value < NEAR_ZERO * size(place) { size(place) } else { value }
        };
        let shares: Vec<f64> = changes.iter().enumerate().map(relative).collect();
        let most = shares.iter().fold(0.0_f64, |most: f64, x| if x.abs() > most.abs() { *x } else { most });
        let parts = free.iter().zip(&shares).map(|(k, share)| (parameters[*k].key.clone(), share / most));
        let parts = parts.filter(|(_, share)| share.abs() >= LEAST_SHARE).collect();
        undetermined.push(Direction { parts, deviation });
    };
    for (value, direction) in decomposed.values().iter().zip(decomposed.right().column_iter()) {
        let error = |(x, k): (&f64, &usize)| x * doubts[*k].max(LEAST_DOUBT);
        let zero = ERRORS * direction.iter().zip(&free).map(error).map(|error| error * error).sum::<f64>().sqrt();
        if *value > zero {
            covariance += direction * direction.transpose() / (value * value);
            continue;
        }
        direction.iter().zip(&mut open).for_each(|(share, open)| *open |= share.abs() > SHARE);
        report(direction.iter().zip(&lengths).map(|(x, length)| x / length).collect(), f64::INFINITY);
    }
    let (covariance, known_from) = with_estimates(&scaled, covariance, levels);
    let relative = |place: usize| 1.0 / (lengths[place] * size(place));
    let shares = DMatrix::from_fn(free.len(), free.len(), |a, b| covariance[(a, b)] * relative(a) * relative(b));
    let spread = SingularValues::of(&shares)?;
    for (variance, direction) in spread.values().iter().zip(spread.right().column_iter()) {
        if *variance >= OPEN * OPEN {
            let changes = direction.iter().enumerate().map(|(place, x)| x * size(place)).collect();
            report(changes, variance.sqrt());
        }
    }
    open.iter_mut().enumerate().for_each(|(place, open)| *open |= shares[(place, place)] >= OPEN * OPEN);
    let quantiles: Vec<f64> = known_from.iter().map(|freedoms| two_sided(OUTSIDE, *freedoms)).collect();
    let nothing_left = !levels.is_empty() && freedoms == 0;
    let place = |k: usize| free.iter().position(|free| *free == k).filter(|place| !open[*place]);
    let fitted = parameters.iter().enumerate().map(|(k, parameter)| {
        let (error, quantile) = match place(k) {
            Some(place) if !nothing_left => (covariance[(place, place)].sqrt() / lengths[place], quantiles[place]),
            _ => (f64::NAN, f64::NAN),
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
    if nothing_left {
        notes.push(
            "as many measured numbers as parameters: nothing is left to estimate the noise from, so there are no intervals; give it"
                .to_owned(),
        );
    }
    Some(Fit {
        status: if undetermined.is_empty() { "converged" } else { "undetermined" },
        parameters: fitted.collect(),
        correlation: (0..count).map(|i| (0..count).map(|k| correlation(i, k)).collect()).collect(),
        undetermined,
        singular_values: decomposed.values().to_vec(),
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
    })
}

/// What noise that was estimated adds to a covariance, since weights are then not those of the noise; and from how many freedoms each
/// variance is known.
fn with_estimates(scaled: &DMatrix<f64>, covariance: DMatrix<f64>, levels: &[Level]) -> (DMatrix<f64>, Vec<f64>) {
    let count = covariance.nrows();
    let mut unsure = DMatrix::<f64>::zeros(count, count);
    let mut spread = vec![0.0_f64; count];
    for level in levels {
        let own = scaled.select_rows(level.rows.iter());
        let said = own.transpose() * own;
        let part = &covariance * &said * &covariance;
        unsure += (&part - &part * &said * &covariance) * (4.0 / level.freedoms);
        spread.iter_mut().enumerate().for_each(|(k, sum)| *sum += part[(k, k)].powi(2) / level.freedoms);
    }
    let freedoms = |k: usize| if spread[k] > 0.0 { covariance[(k, k)].powi(2) / spread[k] } else { f64::INFINITY };
    let known_from = (0..count).map(freedoms).collect();
    (covariance + unsure, known_from)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of two samples with noise of their own: its variance is that of Meier ("Variance of a weighted mean", Biometrics 9, 1953),
    /// C (1 + 4 sum w_i (1 - w_i) / n_i). Of one sample alone it is the usual one.
    #[test]
    fn estimated_weights_add_what_they_add_to_a_weighted_mean() {
        let (counts, noise) = ([8, 15], [0.5, 1.5]);
        let scaled = DMatrix::from_fn(23, 1, |row, _| 1.0 / noise[usize::from(row >= counts[0])]);
        let says: Vec<f64> = (0..2).map(|k| counts[k] as f64 / (noise[k] * noise[k])).collect();
        let variance = 1.0 / (says[0] + says[1]);
        let level = |rows: std::ops::Range<usize>| Level { freedoms: rows.len() as f64 - 0.5, rows: rows.collect() };
        let levels = [level(0..8), level(8..23)];
        let (found, known) = with_estimates(&scaled, DMatrix::from_element(1, 1, variance), &levels);
        let weight: Vec<f64> = says.iter().map(|one| one * variance).collect();
        let term = |k: usize| weight[k] * (1.0 - weight[k]) / levels[k].freedoms;
        let expected = variance * (1.0 + 4.0 * (term(0) + term(1)));
        assert!((found[(0, 0)] / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        let freedoms = 1.0 / (0..2).map(|k| weight[k] * weight[k] / levels[k].freedoms).sum::<f64>();
        assert!((known[0] / freedoms - 1.0).abs() < 1e-12, "{known:?} {freedoms}");
        let alone = Level { freedoms: 22.0, rows: (0..23).collect() };
        let (found, known) = with_estimates(&scaled, DMatrix::from_element(1, 1, variance), &[alone]);
        assert!((found[(0, 0)] / variance - 1.0).abs() < 1e-12 && (known[0] - 22.0).abs() < 1e-9, "{found} {known:?}");
    }
}
