//! [`Table`]: a function given by points.

mod interpolation;

use serde::{Deserialize, Serialize};

use crate::params::ParamError;
pub use interpolation::Interpolation;

/// A piecewise cubic function of one variable.
///
/// How smooth it is depends on the [`Interpolation`] that made it; [`Table::kinks`] gives the places where it is not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Break points, strictly increasing, n + 1 of them.
    pub breaks: Vec<f64>,
    /// Coefficients of the n pieces, in powers of (x - left break), lowest first.
    pub pieces: Vec<[f64; 4]>,
    /// What the function is outside its range.
    pub outside: Outside,
}

/// Continuation of a [`Table`] outside its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outside {
    /// The end value is held. The first derivative jumps to zero there.
    Clamped,
    /// The range repeats.
    Periodic,
}

impl Outside {
    /// The form that crosses the interface.
    #[must_use]
    pub fn encode(self) -> u32 {
        match self {
            Self::Clamped => 0,
            Self::Periodic => 1,
        }
    }

    /// The continuation behind its number.
    #[must_use]
    pub fn decode(code: u32) -> Option<Self> {
        match code {
            0 => Some(Self::Clamped),
            1 => Some(Self::Periodic),
            _ => None,
        }
    }
}

/// A jump of a derivative counts from this part of the terms that it is the difference of; below, it is round-off.
const ROUND_OFF: f64 = 1e-10;

impl Table {
    /// The function through `points` that `interpolation` makes. At a point of [`Interpolation::Steps`] it has the value
    /// of that point already.
    ///
    /// The points of a periodic function span one period: the last repeats the first one.
    ///
    /// # Errors
    /// Arguments that do not increase, numbers that are not finite, fewer points than [`Interpolation::fewest`], or a
    /// period whose first and last value differ by more than 1e-9 of the largest.
    pub fn through(points: &[[f64; 2]], interpolation: Interpolation, outside: Outside) -> Result<Self, ParamError> {
        check(points, interpolation.fewest(outside))?;
        let mut points = points.to_vec();
        if outside == Outside::Periodic {
            close(&mut points)?;
        }
        let (breaks, pieces) = interpolation.pieces(&points, outside);
        Ok(Self { breaks, pieces, outside })
    }

    /// The natural cubic spline through `points`, its end values held outside: [`Table::through`] with
    /// [`Interpolation::Spline`].
    ///
    /// # Errors
    /// As [`Table::through`].
    pub fn clamped(points: &[[f64; 2]]) -> Result<Self, ParamError> {
        Self::through(points, Interpolation::Spline, Outside::Clamped)
    }

    /// The periodic cubic spline through `points`: [`Table::through`] with [`Interpolation::Spline`].
    ///
    /// # Errors
    /// As [`Table::through`].
    pub fn periodic(points: &[[f64; 2]]) -> Result<Self, ParamError> {
        Self::through(points, Interpolation::Spline, Outside::Periodic)
    }

    /// The cubic pieces with these slopes at points that are checked, end values held.
    pub(crate) fn hermite(points: &[[f64; 2]], slopes: &[f64]) -> Self {
        let breaks = points.iter().map(|p| p[0]).collect();
        Self { breaks, pieces: interpolation::hermite(points, slopes), outside: Outside::Clamped }
    }

    /// The break points at which the function is not twice continuously differentiable, in increasing order, each with
    /// the lowest order of derivative that jumps there: 0 (the value), 1 or 2.
    ///
    /// Computed from the pieces, so it holds for any table; a jump below 1e-10 of the terms that it is the difference of
    /// counts as round-off. The ends of a held range are among them where the slope (or the curvature) does not vanish.
    /// A periodic table has its kinks again every [`Table::period`]; its last break point, which is the first one of the
    /// next period, is not listed.
    pub fn kinks(&self) -> impl Iterator<Item = (f64, u32)> + '_ {
        let count = if self.is_sound() { self.pieces.len() } else { 0 };
        let last = match self.outside {
            _ if count == 0 => 0,
            Outside::Clamped => count + 1,
            Outside::Periodic => count,
        };
        (0..last).filter_map(move |k| {
            let before = match (k, self.outside) {
                (0, Outside::Clamped) => None,
                (0, Outside::Periodic) => Some(count - 1),
                _ => Some(k - 1),
            };
            let (left, right) = (before.map(|piece| self.ends(piece)), (k < count).then(|| self.ends(k)));
            let at = |order: usize| {
                // A held end keeps its value; slope and curvature are zero.
                let held = |value: f64| if order == 0 { value } else { 0.0 };
                let (l, r) = (left.map(|ends| ends[order].last), right.map(|ends| ends[order].first));
                let (l, r) = (l.or(r.map(held))?, r.or(l.map(held))?);
                let terms = [left, right].into_iter().flatten().map(|ends| ends[order].terms).fold(0.0, f64::max);
                Some((l - r).abs() > ROUND_OFF * terms)
            };
            let order = (0..3).find(|order| at(*order) == Some(true))?;
            Some((self.breaks[k], order as u32))
        })
    }

    /// After how much of the argument the function repeats; `None` if its end values are held.
    #[must_use]
    pub fn period(&self) -> Option<f64> {
        let (first, last) = (self.breaks.first()?, self.breaks.last()?);
        (self.outside == Outside::Periodic).then_some(last - first)
    }

    /// The value at the end of the last piece; of a periodic table, that of the first point.
    pub(crate) fn end(&self) -> f64 {
        match self.outside {
            Outside::Clamped => self.breaks.last().map_or(0.0, |last| self.derivative(*last, 0)),
            Outside::Periodic => self.pieces.first().map_or(0.0, |piece| piece[0]),
        }
    }

    /// Value, slope and curvature at the ends of a piece.
    fn ends(&self, piece: usize) -> [Ends; 3] {
        let h = self.breaks[piece + 1] - self.breaks[piece];
        let [c0, c1, c2, c3] = self.pieces[piece];
        [
            [c0, h * c1, h * h * c2, h * h * h * c3],
            [c1, 2.0 * h * c2, 3.0 * h * h * c3, 0.0],
            [2.0 * c2, 6.0 * h * c3, 0.0, 0.0],
        ]
        .map(|terms| Ends {
            first: terms[0],
            last: terms.iter().sum(),
            terms: terms.iter().map(|term| term.abs()).sum(),
        })
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

    /// The derivative inside the range as a table, with the same break points. Outside of a held range it has its end values, where the
    /// derivative is zero. Contract 1.2.
    #[must_use]
    pub fn slope(&self) -> Self {
        let pieces = self.pieces.iter().map(|[_, c1, c2, c3]| [*c1, 2.0 * c2, 3.0 * c3, 0.0]).collect();
        Self { breaks: self.breaks.clone(), pieces, outside: self.outside }
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

/// A derivative at the left and the right end of a piece, and the sum of the magnitudes of its terms.
#[derive(Clone, Copy)]
struct Ends {
    first: f64,
    last: f64,
    terms: f64,
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

/// Makes the last value of a period the first one.
fn close(points: &mut [[f64; 2]]) -> Result<(), ParamError> {
    let (first, last) = (points[0][1], points[points.len() - 1][1]);
    let largest = points.iter().fold(0.0_f64, |a, p| a.max(p[1].abs()));
    if (last - first).abs() > 1e-9 * largest {
        return Err(ParamError::new(
            "",
            format!("a periodic curve must end where it began: the first value is {first}, the last is {last}"),
        ));
    }
    points[points.len() - 1][1] = first;
    Ok(())
}
