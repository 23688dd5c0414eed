//! [`Table`]: a function given by points, smooth enough for accurate integration.

use crate::params::ParamError;

/// A piecewise cubic function of one variable, twice continuously differentiable inside its range.
///
/// Source: de Boor, A Practical Guide to Splines, ch. IV (not-a-knot is not offered: natural ends for a clamped table,
/// matching ends for a periodic one).
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Break points, strictly increasing, n + 1 of them.
    pub breaks: Vec<f64>,
    /// Coefficients of the n pieces, in powers of (x - left break), lowest first.
    pub pieces: Vec<[f64; 4]>,
    /// What the function is outside its range.
    pub outside: Outside,
}

/// Continuation of a [`Table`] outside its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outside {
    /// The end value is held. The first derivative jumps to zero there.
    Clamped,
    /// The range repeats.
    Periodic,
}

impl Table {
    /// The natural cubic spline through `points`, its end values held outside.
    ///
    /// # Errors
    /// Fewer than two points, arguments that do not increase, or numbers that are not finite.
    pub fn clamped(points: &[[f64; 2]]) -> Result<Self, ParamError> {
        check(points, 2)?;
        let h: Vec<f64> = points.windows(2).map(|w| w[1][0] - w[0][0]).collect();
        let slope: Vec<f64> = points.windows(2).map(|w| (w[1][1] - w[0][1]) / (w[1][0] - w[0][0])).collect();
        let n = h.len();
        // Second derivatives m at the points: natural ends m0 = mn = 0, inside
        // h[k-1] m[k-1] + 2 (h[k-1] + h[k]) m[k] + h[k] m[k+1] = 6 (slope[k] - slope[k-1]).
        let mut m = vec![0.0; n + 1];
        if n > 1 {
            let diagonal: Vec<f64> = (1..n).map(|k| 2.0 * (h[k - 1] + h[k])).collect();
            let right: Vec<f64> = (1..n).map(|k| 6.0 * (slope[k] - slope[k - 1])).collect();
            let inner = tridiagonal(&h[1..n - 1], &diagonal, &h[1..n - 1], &right);
            m[1..n].copy_from_slice(&inner);
        }
        Ok(Self::from_second_derivatives(points, &m, Outside::Clamped))
    }

    /// The periodic cubic spline through `points`; the last point repeats the first one, a period later.
    ///
    /// # Errors
    /// Fewer than four points, arguments that do not increase, numbers that are not finite, or first and last value that
    /// differ by more than 1e-9 of the largest.
    pub fn periodic(points: &[[f64; 2]]) -> Result<Self, ParamError> {
        check(points, 4)?;
        let n = points.len() - 1;
        let largest = points.iter().fold(0.0_f64, |a, p| a.max(p[1].abs()));
        if (points[n][1] - points[0][1]).abs() > 1e-9 * largest {
            return Err(ParamError::new(
                "",
                format!(
                    "a periodic curve must end where it began: the first value is {}, the last is {}",
                    points[0][1], points[n][1]
                ),
            ));
        }
        let mut points = points.to_vec();
        points[n][1] = points[0][1];
        let h: Vec<f64> = points.windows(2).map(|w| w[1][0] - w[0][0]).collect();
        let slope: Vec<f64> = points.windows(2).map(|w| (w[1][1] - w[0][1]) / (w[1][0] - w[0][0])).collect();
        // The same equations with indices modulo n; the cyclic corner is removed by a rank-one update (Sherman-Morrison).
        let before = |k: usize| (k + n - 1) % n;
        let mut diagonal: Vec<f64> = (0..n).map(|k| 2.0 * (h[before(k)] + h[k])).collect();
        let right: Vec<f64> = (0..n).map(|k| 6.0 * (slope[k] - slope[before(k)])).collect();
        let corner = h[n - 1];
        let gamma = -diagonal[0];
        diagonal[0] -= gamma;
        diagonal[n - 1] -= corner * corner / gamma;
        let lower = &h[..n - 1];
        let x = tridiagonal(lower, &diagonal, lower, &right);
        let mut u = vec![0.0; n];
        u[0] = gamma;
        u[n - 1] = corner;
        let z = tridiagonal(lower, &diagonal, lower, &u);
        let factor = (x[0] + corner * x[n - 1] / gamma) / (1.0 + z[0] + corner * z[n - 1] / gamma);
        let mut m: Vec<f64> = (0..n).map(|k| x[k] - factor * z[k]).collect();
        m.push(m[0]);
        Ok(Self::from_second_derivatives(&points, &m, Outside::Periodic))
    }

    fn from_second_derivatives(points: &[[f64; 2]], m: &[f64], outside: Outside) -> Self {
        let pieces = (0..points.len() - 1)
            .map(|k| {
                let h = points[k + 1][0] - points[k][0];
                let slope = (points[k + 1][1] - points[k][1]) / h;
                [points[k][1], slope - h * (2.0 * m[k] + m[k + 1]) / 6.0, m[k] / 2.0, (m[k + 1] - m[k]) / (6.0 * h)]
            })
            .collect();
        Self { breaks: points.iter().map(|p| p[0]).collect(), pieces, outside }
    }

    /// The derivative of the given order at `x` (order 0: the value). Orders above 3 are zero.
    ///
    /// A table without pieces is zero everywhere.
    #[must_use]
    pub fn derivative(&self, x: f64, order: u32) -> f64 {
        let (Some(&first), Some(&last)) = (self.breaks.first(), self.breaks.last()) else { return 0.0 };
        if self.pieces.is_empty() || order > 3 {
            return 0.0;
        }
        let x = match self.outside {
            Outside::Periodic => {
                let period = last - first;
                x - ((x - first) / period).floor() * period
            }
            Outside::Clamped if x < first || x > last => {
                if order > 0 {
                    return 0.0;
                }
                x.clamp(first, last)
            }
            Outside::Clamped => x,
        };
        let piece = self.breaks.partition_point(|b| *b <= x).clamp(1, self.pieces.len()) - 1;
        let s = x - self.breaks[piece];
        let [c0, c1, c2, c3] = self.pieces[piece];
        match order {
            0 => c0 + s * (c1 + s * (c2 + s * c3)),
            1 => c1 + s * (2.0 * c2 + s * (3.0 * c3)),
            2 => 2.0 * c2 + s * (6.0 * c3),
            _ => 6.0 * c3,
        }
    }

    /// Whether break points and pieces fit together and are finite, so that evaluation cannot go wrong.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.breaks.len() == self.pieces.len() + 1
            && !self.pieces.is_empty()
            && self.breaks.iter().all(|b| b.is_finite())
            && self.breaks.windows(2).all(|w| w[0] < w[1])
            && self.pieces.iter().flatten().all(|c| c.is_finite())
    }
}

fn check(points: &[[f64; 2]], fewest: usize) -> Result<(), ParamError> {
    if points.len() < fewest {
        return Err(ParamError::new("", format!("needs at least {fewest} points, found {}", points.len())));
    }
    if let Some(p) = points.iter().flatten().find(|v| !v.is_finite()) {
        return Err(ParamError::new("", format!("contains {p}, which is not a finite number")));
    }
    for pair in points.windows(2) {
        if pair[1][0] <= pair[0][0] {
            return Err(ParamError::new(
                "",
                format!("arguments must increase: {} is followed by {}", pair[0][0], pair[1][0]),
            ));
        }
    }
    Ok(())
}

/// Thomas' algorithm for a diagonally dominant system.
fn tridiagonal(lower: &[f64], diagonal: &[f64], upper: &[f64], right: &[f64]) -> Vec<f64> {
    let n = diagonal.len();
    let (mut d, mut x) = (diagonal.to_vec(), right.to_vec());
    for k in 1..n {
        let w = lower[k - 1] / d[k - 1];
        d[k] -= w * upper[k - 1];
        x[k] -= w * x[k - 1];
    }
    for k in (0..n).rev() {
        if k + 1 < n {
            x[k] -= upper[k] * x[k + 1];
        }
        x[k] /= d[k];
    }
    x
}
