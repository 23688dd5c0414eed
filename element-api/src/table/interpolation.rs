//! How points become the pieces of a [`Table`](super::Table).

use super::Outside;
use crate::params::ParamError;
use std::str::FromStr;

/// What a [`Table`](super::Table) is between its points.
///
/// | | value | slope | curvature | between two points |
/// |---|---|---|---|---|
/// | `monotone` | continuous | continuous | jumps at points | stays between their values |
/// | `linear` | continuous | jumps at points | zero | stays between their values |
/// | `spline` | continuous | continuous | continuous | may leave their values: fit for points of a smooth function |
/// | `steps` | jumps at points | zero | zero | the value of the point before |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Interpolation {
    /// The shape-preserving cubic: it rises where the points rise, falls where they fall, and is level where they are. Its
    /// slopes are those of the parabola through a point and its neighbours, zero at points that are higher or lower than
    /// both, at most three times the smaller slope of the two adjacent chords, and so depend on the nearest points only.
    ///
    /// Source: Fritsch & Carlson, SIAM J. Numer. Anal. 17 (1980) 238, with the limit of de Boor & Swartz, J. Approx.
    /// Theory 21 (1977) 411.
    #[default]
    Monotone,
    /// Straight lines.
    Linear,
    /// The twice continuously differentiable cubic spline: natural ends (no curvature) where end values are held, matching
    /// ends where the function repeats.
    ///
    /// Source: de Boor, A Practical Guide to Splines, ch. IV.
    Spline,
    /// Each value holds from its argument up to the next one.
    Steps,
}

impl Interpolation {
    /// All of them, by the words that scenes use.
    pub const ALL: [(&'static str, Self); 4] =
        [("monotone", Self::Monotone), ("linear", Self::Linear), ("spline", Self::Spline), ("steps", Self::Steps)];

    /// The word that scenes use.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, known)| *known == self).map_or("", |(name, _)| *name)
    }

    /// The one that a parameter names with the key `interpolation`, if it does.
    pub(crate) fn of(table: &toml::Table) -> Result<Option<Self>, ParamError> {
        let Some(value) = table.get("interpolation") else { return Ok(None) };
        value.as_str().and_then(|word| word.parse().ok()).map(Some).ok_or_else(|| {
            let words: Vec<String> = Self::ALL.iter().map(|(name, _)| format!("\"{name}\"")).collect();
            ParamError::new("", format!("has the interpolation {value}: it must be one of {}", words.join(", ")))
        })
    }

    /// The slopes of [`Interpolation::Monotone`] at points that are checked, end values held.
    pub(crate) fn monotone_slopes(points: &[[f64; 2]]) -> Vec<f64> {
        let h: Vec<f64> = points.windows(2).map(|w| w[1][0] - w[0][0]).collect();
        let slope: Vec<f64> = points.windows(2).map(|w| (w[1][1] - w[0][1]) / (w[1][0] - w[0][0])).collect();
        monotone_slopes(&h, &slope)
    }

    /// How many points it needs at least.
    #[must_use]
    pub fn fewest(self, outside: Outside) -> usize {
        match (outside, self) {
            (Outside::Clamped, _) => 2,
            (Outside::Periodic, Self::Spline) => 4,
            (Outside::Periodic, _) => 3,
        }
    }

    /// Break points and pieces through points that are checked: increasing, finite, enough, closed if periodic.
    pub(super) fn pieces(self, points: &[[f64; 2]], outside: Outside) -> (Vec<f64>, Vec<[f64; 4]>) {
        let mut breaks: Vec<f64> = points.iter().map(|p| p[0]).collect();
        let h: Vec<f64> = points.windows(2).map(|w| w[1][0] - w[0][0]).collect();
        let slope: Vec<f64> = points.windows(2).map(|w| (w[1][1] - w[0][1]) / (w[1][0] - w[0][0])).collect();
        let value = |k: usize| points[k][1];
        let pieces = match self {
            Self::Monotone => {
                let d = match outside {
                    Outside::Clamped => monotone_slopes(&h, &slope),
                    Outside::Periodic => periodic_monotone_slopes(&h, &slope),
                };
                hermite(points, &d)
            }
            Self::Linear => (0..h.len()).map(|k| [value(k), slope[k], 0.0, 0.0]).collect(),
            Self::Spline => {
                let m = match outside {
                    Outside::Clamped => natural_second_derivatives(&h, &slope),
                    Outside::Periodic => periodic_second_derivatives(&h, &slope),
                };
                let piece = |k: usize| {
                    let (h, slope) = (h[k], slope[k]);
                    [value(k), slope - h * (2.0 * m[k] + m[k + 1]) / 6.0, m[k] / 2.0, (m[k + 1] - m[k]) / (6.0 * h)]
                };
                (0..h.len()).map(piece).collect()
            }
            Self::Steps => {
                if outside == Outside::Clamped {
                    // The value of the last point holds from there on: a piece, as narrow as numbers allow.
                    let last = breaks[h.len()];
                    breaks.push(last + 4.0 * f64::EPSILON * last.abs().max(h[h.len() - 1]));
                }
                (0..breaks.len() - 1).map(|k| [value(k), 0.0, 0.0, 0.0]).collect()
            }
        };
        (breaks, pieces)
    }
}

/// The cubic pieces with these slopes at the points.
pub(super) fn hermite(points: &[[f64; 2]], slopes: &[f64]) -> Vec<[f64; 4]> {
    let piece = |(ends, d): (&[[f64; 2]], &[f64])| {
        let h = ends[1][0] - ends[0][0];
        let slope = (ends[1][1] - ends[0][1]) / h;
        // Differences to the chord, so that a straight line has no other terms.
        let (left, right) = (d[0] - slope, d[1] - slope);
        [ends[0][1], d[0], -(2.0 * left + right) / h, (left + right) / (h * h)]
    };
    points.windows(2).zip(slopes.windows(2)).map(piece).collect()
}

impl FromStr for Interpolation {
    type Err = ();

    /// # Errors
    /// Other words than those of [`Interpolation::ALL`].
    fn from_str(word: &str) -> Result<Self, ()> {
        Self::ALL.iter().find(|(name, _)| *name == word).map(|(_, interpolation)| *interpolation).ok_or(())
    }
}

/// The slope at a point between chords of widths `h` and slopes `s`: that of the parabola, limited.
fn monotone_slope(h: [f64; 2], s: [f64; 2]) -> f64 {
    // By signs, not by the product, which may underflow.
    let rises = [s[0] > 0.0, s[1] > 0.0];
    if s[0] == 0.0 || s[1] == 0.0 || rises[0] != rises[1] {
        return 0.0;
    }
    let d = (h[1] * s[0] + h[0] * s[1]) / (h[0] + h[1]);
    let most = 3.0 * s[0].abs().min(s[1].abs());
    d.clamp(-most, most)
}

/// The slope at an end: that of the parabola through the last three points, limited by the last chord `s[0]`.
fn monotone_end(h: [f64; 2], s: [f64; 2]) -> f64 {
    let d = ((2.0 * h[0] + h[1]) * s[0] - h[0] * s[1]) / (h[0] + h[1]);
    if s[0] >= 0.0 { d.clamp(0.0, 3.0 * s[0]) } else { d.clamp(3.0 * s[0], 0.0) }
}

fn monotone_slopes(h: &[f64], slope: &[f64]) -> Vec<f64> {
    let n = h.len();
    if n == 1 {
        return vec![slope[0]; 2];
    }
    let mut d = vec![0.0; n + 1];
    d[0] = monotone_end([h[0], h[1]], [slope[0], slope[1]]);
    for k in 1..n {
        d[k] = monotone_slope([h[k - 1], h[k]], [slope[k - 1], slope[k]]);
    }
    d[n] = monotone_end([h[n - 1], h[n - 2]], [slope[n - 1], slope[n - 2]]);
    d
}

fn periodic_monotone_slopes(h: &[f64], slope: &[f64]) -> Vec<f64> {
    let n = h.len();
    (0..=n)
        .map(|k| {
            let (before, here) = ((k + n - 1) % n, k % n);
            monotone_slope([h[before], h[here]], [slope[before], slope[here]])
        })
        .collect()
}

/// Second derivatives m at the points: natural ends m0 = mn = 0, inside
/// h[k-1] m[k-1] + 2 (h[k-1] + h[k]) m[k] + h[k] m[k+1] = 6 (slope[k] - slope[k-1]).
fn natural_second_derivatives(h: &[f64], slope: &[f64]) -> Vec<f64> {
    let n = h.len();
    let mut m = vec![0.0; n + 1];
    if n > 1 {
        let diagonal: Vec<f64> = (1..n).map(|k| 2.0 * (h[k - 1] + h[k])).collect();
        let right: Vec<f64> = (1..n).map(|k| 6.0 * (slope[k] - slope[k - 1])).collect();
        let inner = tridiagonal(&h[1..n - 1], &diagonal, &h[1..n - 1], &right);
        m[1..n].copy_from_slice(&inner);
    }
    m
}

/// The same equations with indices modulo n; the cyclic corner is removed by a rank-one update (Sherman-Morrison).
fn periodic_second_derivatives(h: &[f64], slope: &[f64]) -> Vec<f64> {
    let n = h.len();
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
    m
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
