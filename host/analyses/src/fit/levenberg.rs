//! [`minimise`]: Levenberg's and Marquardt's method within bounds.
//!
//! Steps solve (J^T J + mu D) s = -J^T r with D the largest diagonal of J^T J so far, mu by the gain of each step (Nielsen 1999;
//! Madsen, Nielsen & Tingleff, "Methods for non-linear least squares problems", 2nd ed. 2004, algorithm 3.16). Parameters at a bound
//! that the residuals would push beyond stay there for the step; the others are cut at theirs (projected steps: Kanzow, Yamashita &
//! Fukushima 2004), and the rest takes the step that is best with that.

use nalgebra::{DMatrix, DVector};

/// Where a parameter may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// Damping at the start, as a share of the largest diagonal.
const FIRST_DAMPING: f64 = 1e-3;
/// A step whose expected gain is below this share of the variance changes no parameter by more than a ten-thousandth of its error.
const LEAST_GAIN: f64 = 1e-8;
/// Relative change of all parameters below which there is none.
const LEAST_CHANGE: f64 = 1e-11;
/// Steps tried one after the other without gain.
const MOST_TRIALS: usize = 30;

/// What is minimised: half the sum of the squares of residuals.
pub(crate) trait Problem {
    /// Why something could not be computed at all, and there is no way on.
    type Error;

    /// The residuals at these parameters; `None` where they cannot be computed.
    ///
    /// # Errors
    /// There is no use in continuing.
    fn residuals(&mut self, at: &[f64]) -> Result<Option<Vec<f64>>, Self::Error>;

    /// Their derivatives at the parameters of the last residuals that were accepted.
    ///
    /// # Errors
    /// There is no use in continuing.
    fn jacobian(&mut self, at: &[f64]) -> Result<DMatrix<f64>, Self::Error>;
}

/// How a search ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Minimum {
    pub(crate) at: Vec<f64>,
    pub(crate) residuals: Vec<f64>,
    /// The last derivatives, times sizes: at the minimum, where it converged.
    pub(crate) jacobian: DMatrix<f64>,
    pub(crate) iterations: usize,
    /// Steps that were shortened because the residuals could not be computed at their end.
    pub(crate) shortened: usize,
    pub(crate) converged: bool,
}

/// Searches from a start, where residuals have to exist. `sizes` are typical of the parameters.
///
/// # Errors
/// Those of the problem.
pub(crate) fn minimise<P: Problem>(
    problem: &mut P,
    start: &[f64],
    residuals: Vec<f64>,
    sizes: &[f64],
    bounds: &[Bounds],
    most_iterations: usize,
) -> Result<Minimum, P::Error> {
    let count = start.len();
    let jacobian = DMatrix::zeros(residuals.len(), count);
    let mut minimum =
        Minimum { at: start.to_vec(), residuals, jacobian, iterations: 0, shortened: 0, converged: false };
    let (mut damping, mut growth) = (FIRST_DAMPING, 2.0);
    let mut scale = DVector::zeros(count);
    while minimum.iterations < most_iterations {
        minimum.iterations += 1;
        minimum.jacobian = problem.jacobian(&minimum.at)?;
        let jacobian = &mut minimum.jacobian;
        sizes.iter().enumerate().for_each(|(k, size)| jacobian.column_mut(k).scale_mut(*size));
        let residuals = DVector::from_column_slice(&minimum.residuals);
        let gradient = jacobian.tr_mul(&residuals);
        let square = jacobian.tr_mul(jacobian);
        for k in 0..count {
            scale[k] = f64::max(scale[k], square[(k, k)]);
        }
        let largest = scale.max();
        let at_bound = |k: usize| {
            let (at, bounds) = (minimum.at[k], bounds[k]);
            at <= bounds.low && gradient[k] > 0.0 || at >= bounds.high && gradient[k] < 0.0
        };
        let free: Vec<usize> = (0..count).filter(|k| !at_bound(*k)).collect();
        let freedoms = minimum.residuals.len().saturating_sub(count).max(1) as f64;
        let variance = residuals.norm_squared() / freedoms;
        let mut trials = 0;
        loop {
            trials += 1;
            let room = |k: usize| [bounds[k].low, bounds[k].high].map(|bound| (bound - minimum.at[k]) / sizes[k]);
            let step = damped(&square, &gradient, &free, (damping, &|k| scale[k].max(1e-9 * largest)), &room);
            let mut next = minimum.at.clone();
            for k in 0..count {
                next[k] = (next[k] + sizes[k] * step[k]).clamp(bounds[k].low, bounds[k].high);
                // What goes to a bound is there, without round-off.
                let [low, high] = room(k);
                next[k] = if step[k] <= low {
                    bounds[k].low
                } else if step[k] >= high {
                    bounds[k].high
                } else {
                    next[k]
                };
            }
            let taken = DVector::from_fn(count, |k, _| (next[k] - minimum.at[k]) / sizes[k]);
            let expected = -taken.dot(&gradient) - 0.5 * (&minimum.jacobian * &taken).norm_squared();
            let cut = (0..count).any(|k| taken[k] != 0.0 && (next[k] <= bounds[k].low || next[k] >= bounds[k].high));
            if cut && expected <= 0.0 && trials < MOST_TRIALS {
                // Of steps that are short enough, what is left within the bounds goes downhill.
                damping *= growth;
                growth *= 2.0;
                continue;
            }
            if 2.0 * expected <= LEAST_GAIN * variance || taken.amax() <= LEAST_CHANGE {
                minimum.converged = true;
                return Ok(minimum);
            }
            let found = problem.residuals(&next)?;
            let failed = found.is_none();
            let gain = found.as_ref().map_or(-1.0, |found| {
                let after: f64 = found.iter().map(|r| r * r).sum();
                0.5 * (residuals.norm_squared() - after) / expected
            });
            if let (Some(found), true) = (found, gain > 0.0) {
                (minimum.at, minimum.residuals) = (next, found);
                damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
                growth = 2.0;
                break;
            }
            minimum.shortened += usize::from(failed);
            damping *= if failed { 10.0 } else { growth };
            growth *= 2.0;
            if trials >= MOST_TRIALS {
                // Nothing is gained by any step: as near as the residuals can tell, unless they were not to be had.
                minimum.converged = !failed;
                return Ok(minimum);
            }
        }
    }
    Ok(minimum)
}

/// The damped step of the free parameters; the others have none. Those that would go beyond their `room` go to its end, and the rest
/// takes the step that is best with that.
fn damped(
    square: &DMatrix<f64>,
    gradient: &DVector<f64>,
    free: &[usize],
    (damping, scale): (f64, &dyn Fn(usize) -> f64),
    room: &dyn Fn(usize) -> [f64; 2],
) -> DVector<f64> {
    let mut step = DVector::zeros(gradient.len());
    let mut free = free.to_vec();
    while !free.is_empty() {
        let held = square * &step;
        let mut matrix = square.select_rows(&free).select_columns(&free);
        let mut side = DVector::zeros(free.len());
        for (row, k) in free.iter().enumerate() {
            matrix[(row, row)] += damping * scale(*k);
            side[row] = -gradient[*k] - held[*k];
        }
        let Some(factors) = matrix.cholesky() else { return DVector::zeros(gradient.len()) };
        let solved = factors.solve(&side);
        let beyond = |(row, k): (usize, &usize)| {
            let [low, high] = room(*k);
            (solved[row] < low || solved[row] > high).then(|| (*k, solved[row].clamp(low, high)))
        };
        let beyond: Vec<(usize, f64)> = free.iter().enumerate().filter_map(beyond).collect();
        if beyond.is_empty() {
            free.iter().zip(solved.iter()).for_each(|(k, value)| step[*k] = *value);
            break;
        }
        beyond.iter().for_each(|(k, value)| step[*k] = *value);
        free.retain(|k| !beyond.iter().any(|(other, _)| other == k));
    }
    step
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Rosenbrock {
        forbidden: f64,
    }

    impl Problem for Rosenbrock {
        type Error = ();
        fn residuals(&mut self, at: &[f64]) -> Result<Option<Vec<f64>>, ()> {
            let inside = at[0] < self.forbidden;
            Ok(inside.then(|| vec![10.0 * (at[1] - at[0] * at[0]), 1.0 - at[0], 0.0]))
        }
        fn jacobian(&mut self, at: &[f64]) -> Result<DMatrix<f64>, ()> {
            Ok(DMatrix::from_row_slice(3, 2, &[-20.0 * at[0], 10.0, -1.0, 0.0, 0.0, 0.0]))
        }
    }

    fn search(forbidden: f64, bounds: [Bounds; 2]) -> Minimum {
        let mut problem = Rosenbrock { forbidden };
        let start = [-1.2, 1.0];
        let residuals = problem.residuals(&start).unwrap_or_default().unwrap_or_default();
        minimise(&mut problem, &start, residuals, &[1.0, 1.0], &bounds, 100).unwrap_or_else(|()| unreachable!())
    }

    const WIDE: Bounds = Bounds { low: -5.0, high: 5.0 };

    #[test]
    fn the_valley_of_rosenbrock_is_walked_to_its_end() {
        let found = search(10.0, [WIDE, WIDE]);
        assert!(found.converged && found.shortened == 0, "{found:?}");
        assert!((found.at[0] - 1.0).abs() < 1e-6 && (found.at[1] - 1.0).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_bound_holds_and_the_rest_is_minimised() {
        let found = search(10.0, [Bounds { low: -5.0, high: 0.5 }, WIDE]);
        assert!(found.converged, "{found:?}");
        // To a ten-thousandth of the error that a residual of 0.5 stands for.
        assert!(found.at[0] == 0.5 && (found.at[1] - 0.25).abs() < 1e-5, "{found:?}");
    }

    #[test]
    fn steps_into_the_forbidden_are_shortened() {
        let found = search(1.0 + 1e-9, [WIDE, WIDE]);
        assert!((found.at[0] - 1.0).abs() < 1e-4, "{found:?}");
    }
}
