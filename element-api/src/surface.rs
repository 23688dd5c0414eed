//! [`Surface`]: a function of two variables given on a grid.

use crate::params::{ParamError, ParamKind, ParamType};
use crate::scalar::Scalar;
use crate::table::{Interpolation, Outside, Table};

/// A function of two variables through the values on a grid, held outside of it (at the nearest point of the grid's
/// rectangle).
///
/// As a parameter, a scene gives it as `{ x = [...], y = [...], z = [[...], ...], interpolation = "linear" }` with one list in `z` per
/// value of x, or from a file: `{ file = "map.csv" }`. Where the scene names no interpolation, it is as for [`crate::Function`].
/// The host warns when a run leaves the grid. Contract 1.2.
///
/// It is a sum of products f(x, y) = sum over k of a_k(x) b_k(y) of [`Table`]s, so that it is recorded like any equation. An
/// evaluation looks up twice (`monotone`: four times) as many tables as there are values of y: let y be the variable with
/// fewer of them.
///
/// | | between the points |
/// |---|---|
/// | `monotone` | bicubic, smooth to the first derivative; in each cell of the grid between the values at its four corners |
/// | `linear` | bilinear in each cell, with kinks at its edges; between the values at its corners |
/// | `spline` | bicubic, smooth to the second derivative, natural at the edges; may leave the values of the grid |
///
/// Sources: tensor products of splines: de Boor, A Practical Guide to Splines, ch. XVII. `monotone` takes along each line of
/// the grid the slopes of [`Interpolation::Monotone`] and the mixed derivative zero, in the form of bicubic Hermite
/// interpolation; where a coefficient of a cell in Bernstein form would leave the values at its corners, the mixed derivative
/// is chosen as small as keeps it there, and the two slopes at that point are reduced alike where none does. (A cell lies
/// within its coefficients: Farin, Curves and Surfaces for CAGD, ch. 16. Carlson & Fritsch, SIAM J. Numer. Anal. 22 (1985) 386
/// ask for more, that it be monotone.)
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Factors of x and of y.
    terms: Vec<[Table; 2]>,
    /// Arguments and values as they were given.
    x: Vec<f64>,
    y: Vec<f64>,
    values: Vec<f64>,
    interpolation: Interpolation,
}

/// Values on a grid, x first: `z(i, j)` at `x[i]`, `y[j]`.
struct Grid<'a> {
    x: &'a [f64],
    y: &'a [f64],
    values: &'a [f64],
}

/// Slopes along x and y, and the mixed derivative, at the points of a grid.
struct Derivatives {
    x: Vec<f64>,
    y: Vec<f64>,
    xy: Vec<f64>,
}

impl Surface {
    /// The function with `values[i * y.len() + j]` at `x[i]`, `y[j]`.
    ///
    /// # Errors
    /// Arguments that do not increase, numbers that are not finite, fewer than two values of an argument, a number of values
    /// that is not the product, or [`Interpolation::Steps`], which are not offered.
    pub fn through(x: &[f64], y: &[f64], values: &[f64], interpolation: Interpolation) -> Result<Self, ParamError> {
        let (columns, rows) = (x.len(), y.len());
        if values.len() != columns * rows {
            let message = format!("needs {columns} x {rows} = {} numbers, found {}", columns * rows, values.len());
            return Err(ParamError::new("values", message));
        }
        let at = |name: &str| {
            let name = name.to_owned();
            move |error: ParamError| ParamError::new(name, error.message)
        };
        let grid = Grid { x, y, values };
        // Checks arguments and values.
        for j in 0..rows {
            Table::through(&grid.along_x(j), Interpolation::Linear, Outside::Clamped).map_err(at("x"))?;
        }
        for i in 0..columns {
            Table::through(&grid.along_y(i), Interpolation::Linear, Outside::Clamped).map_err(at("y"))?;
        }
        let terms = match interpolation {
            Interpolation::Steps => {
                let message = "a grid is not joined by steps: use \"monotone\", \"linear\" or \"spline\"";
                return Err(ParamError::new("interpolation", message));
            }
            Interpolation::Monotone => grid.bicubic(),
            Interpolation::Linear | Interpolation::Spline => (0..rows)
                .map(|j| {
                    let factor = Table::through(&grid.along_x(j), interpolation, Outside::Clamped)?;
                    Ok([factor, Table::through(&unit(y, j), interpolation, Outside::Clamped)?])
                })
                .collect::<Result<_, ParamError>>()?,
        };
        Ok(Self { terms, x: x.to_vec(), y: y.to_vec(), values: values.to_vec(), interpolation })
    }

    /// The value at (x, y).
    #[must_use]
    pub fn at<S: Scalar>(&self, x: S, y: S) -> S {
        self.terms.iter().fold(S::zero(), |sum, [a, b]| sum + x.lookup(a) * y.lookup(b))
    }
}

impl ParamType for Surface {
    const KIND: ParamKind = ParamKind::Surface;

    fn read_value(value: &toml::Value) -> Option<Self> {
        Self::read_named(value, "").ok()
    }

    fn read_named(value: &toml::Value, name: &str) -> Result<Self, ParamError> {
        let about = |error: ParamError| {
            let of = if error.path.is_empty() { String::new() } else { format!("`{}` ", error.path) };
            ParamError::new(name, format!("{of}{}", error.message))
        };
        let list = |key: &str| value.get(key).and_then(Vec::<f64>::read_value);
        let rows = || value.get("z")?.as_array()?.iter().map(Vec::<f64>::read_value).collect::<Option<Vec<_>>>();
        let (Some(x), Some(y), Some(z)) = (list("x"), list("y"), rows()) else {
            return Err(ParamError::new(name, format!("must be a {}", Self::KIND.text())));
        };
        if z.len() != x.len() || z.iter().any(|row| row.len() != y.len()) {
            let message = format!("needs in `z` {} lists of {} numbers, one per value of x", x.len(), y.len());
            return Err(ParamError::new(name, message));
        }
        let interpolation = value.as_table().map_or(Ok(None), Interpolation::of).map_err(about)?.unwrap_or_default();
        Self::through(&x, &y, &z.concat(), interpolation).map_err(about)
    }

    fn write(&self) -> toml::Value {
        let rows = self.values.chunks(self.y.len().max(1)).map(|row| row.to_vec().write());
        let mut entry = toml::Table::new();
        entry.insert("x".into(), self.x.write());
        entry.insert("y".into(), self.y.write());
        entry.insert("z".into(), toml::Value::Array(rows.collect()));
        entry.insert("interpolation".into(), self.interpolation.name().into());
        toml::Value::Table(entry)
    }
}

/// One at number `k`, zero at all others.
fn unit(y: &[f64], k: usize) -> Vec<[f64; 2]> {
    y.iter().enumerate().map(|(j, y)| [*y, f64::from(u8::from(j == k))]).collect()
}

impl Grid<'_> {
    fn z(&self, i: usize, j: usize) -> f64 {
        self.values[i * self.y.len() + j]
    }

    fn along_x(&self, j: usize) -> Vec<[f64; 2]> {
        self.x.iter().enumerate().map(|(i, x)| [*x, self.z(i, j)]).collect()
    }

    fn along_y(&self, i: usize) -> Vec<[f64; 2]> {
        self.y.iter().enumerate().map(|(j, y)| [*y, self.z(i, j)]).collect()
    }

    /// The terms of bicubic Hermite interpolation that stays between the corners of each cell.
    fn bicubic(&self) -> Vec<[Table; 2]> {
        let (columns, rows) = (self.x.len(), self.y.len());
        let slopes = self.derivatives();
        let mut terms = Vec::with_capacity(2 * rows);
        for j in 0..rows {
            let column = |of: &[f64]| -> Vec<f64> { (0..columns).map(|i| of[i * rows + j]).collect() };
            let points =
                |of: &[f64]| -> Vec<[f64; 2]> { self.x.iter().zip(column(of)).map(|(x, v)| [*x, v]).collect() };
            let zero: Vec<[f64; 2]> = self.y.iter().map(|y| [*y, 0.0]).collect();
            let one: Vec<f64> = (0..rows).map(|k| f64::from(u8::from(k == j))).collect();
            let value = Table::hermite(&points(self.values), &column(&slopes.x));
            terms.push([value, Table::hermite(&unit(self.y, j), &vec![0.0; rows])]);
            let slope = Table::hermite(&points(&slopes.y), &column(&slopes.xy));
            terms.push([slope, Table::hermite(&zero, &one)]);
        }
        terms
    }

    fn derivatives(&self) -> Derivatives {
        let (columns, rows) = (self.x.len(), self.y.len());
        let mut found =
            Derivatives { x: vec![0.0; columns * rows], y: vec![0.0; columns * rows], xy: vec![0.0; columns * rows] };
        for j in 0..rows {
            let slopes = Interpolation::monotone_slopes(&self.along_x(j));
            slopes.into_iter().enumerate().for_each(|(i, slope)| found.x[i * rows + j] = slope);
        }
        for i in 0..columns {
            let slopes = Interpolation::monotone_slopes(&self.along_y(i));
            found.y[i * rows..(i + 1) * rows].copy_from_slice(&slopes);
        }
        for i in 0..columns {
            for j in 0..rows {
                let k = i * rows + j;
                let share = self.largest_share(i, j, found.x[k], found.y[k]);
                (found.x[k], found.y[k]) = (share * found.x[k], share * found.y[k]);
                let (low, high) = self.mixed(i, j, found.x[k], found.y[k]);
                // Bounds that have crossed by round-off leave zero.
                found.xy[k] = if low <= high { 0.0_f64.clamp(low, high) } else { 0.5 * (low + high) };
            }
        }
        found
    }

    /// The largest part of two slopes that leaves room for a mixed derivative.
    fn largest_share(&self, i: usize, j: usize, dx: f64, dy: f64) -> f64 {
        let fits = |share: f64| {
            let (low, high) = self.mixed(i, j, share * dx, share * dy);
            low <= high
        };
        if fits(1.0) {
            return 1.0;
        }
        // The shares that fit are an interval from zero.
        let (mut fit, mut not) = (0.0, 1.0);
        for _ in 0..50 {
            let middle = 0.5 * (fit + not);
            *(if fits(middle) { &mut fit } else { &mut not }) = middle;
        }
        fit
    }

    /// The bounds of the mixed derivative at a point with given slopes: in each of its cells the coefficient in Bernstein form
    /// z + sx hx dx / 3 + sy hy dy / 3 + sx sy hx hy dxy / 9 lies between the values at the corners.
    fn mixed(&self, i: usize, j: usize, dx: f64, dy: f64) -> (f64, f64) {
        let neighbours = |k: usize, list: &[f64]| -> Vec<(usize, f64)> {
            let all = [k.checked_sub(1), Some(k + 1).filter(|k| *k < list.len())];
            all.into_iter().flatten().map(|other| (other, list[other] - list[k])).collect()
        };
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for (other_i, hx) in neighbours(i, self.x) {
            for (other_j, hy) in neighbours(j, self.y) {
                let corners = [self.z(i, j), self.z(other_i, j), self.z(i, other_j), self.z(other_i, other_j)];
                let least = corners.iter().copied().fold(f64::INFINITY, f64::min);
                let most = corners.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let plain = corners[0] + hx * dx / 3.0 + hy * dy / 3.0;
                let bounds = [least, most].map(|bound| 9.0 * (bound - plain) / (hx * hy));
                low = low.max(bounds[0].min(bounds[1]));
                high = high.min(bounds[0].max(bounds[1]));
            }
        }
        (low, high)
    }
}
