//! [`Motion`]: a prescribed motion of named quantities over time, from a table.
//!
//! The header of a motion file names columns with their units: `t [ms], crank.angle [deg], x_p [mm]`. A name is that of an
//! `[[output]]`, or of a joint's coordinate (`joint.channel`, or `joint` where it has one). `name'` and `name''` are its first and
//! second derivative. Between the rows
//!
//! - positions alone are joined by the cubic spline with continuous second derivatives and without a knot at the second and the last
//!   but one row (de Boor, A Practical Guide to Splines, ch. IV: not-a-knot);
//! - positions with both derivatives by the quintic polynomials that have these values at both ends (Hermite);
//! - positions with velocities likewise, accelerations at the rows being those of the spline through the velocities.
//!
//! All three are twice continuously differentiable.

use std::path::Path;

use crate::analysis::{Evaluator, start_inputs};
use crate::diagnostics::{Diagnostic, codes, help_for};
use crate::linear::refuse;
use crate::model::{Level, Model, Quantity};
use crate::scene::{
    Dimension, column_of_times, counts_cycles, name_and_unit, number_and_unit, parse_unit, with_commas,
};
use crate::session::{Session, SessionError};

/// A quantity with its unit.
#[derive(Debug, Clone)]
pub struct Wanted {
    /// Its name, as it was written.
    pub name: String,
    /// What it is.
    pub quantity: Quantity,
    /// Its dimension.
    pub dimension: Dimension,
    /// The unit in which it is shown.
    pub unit: String,
    /// One of these in SI.
    pub factor: f64,
}

/// Value, first and second derivative with respect to time.
pub type Derivatives = [f64; 3];

/// A motion of quantities over time, SI.
#[derive(Debug, Clone)]
pub struct Motion {
    /// What is prescribed.
    pub wanted: Vec<Wanted>,
    /// The times of the rows, s, ascending.
    pub times: Vec<f64>,
    /// Per quantity, its values and derivatives at the rows.
    nodes: Vec<Vec<Derivatives>>,
    /// Whether the pieces of each are cubic: positions alone were given.
    cubic: Vec<bool>,
}

/// The quantity behind a name: an output of the scene, or a joint's coordinate.
///
/// # Errors
/// The names that there are.
pub fn quantity(session: &Session, name: &str) -> Result<Wanted, SessionError> {
    let model = &session.model;
    if let Some(channel) = model.channels.iter().find(|channel| channel.name == name) {
        return Ok(Wanted {
            name: name.into(),
            quantity: channel.quantity.clone(),
            dimension: channel.dimension,
            unit: channel.unit.clone(),
            factor: channel.factor,
        });
    }
    if let Some(found) = coordinate(model, name) {
        let (element, coordinate) = found;
        let own = &model.elements[element].class.channels[coordinate];
        let (dimension, _) = parse_unit(&own.unit).unwrap_or((Dimension::DIMENSIONLESS, 1.0));
        let units = &session.scene.units;
        return Ok(Wanted {
            name: name.into(),
            quantity: Quantity::Coordinate { element, coordinate, level: Level::Position },
            dimension,
            unit: units.label(dimension),
            factor: units.factor(dimension),
        });
    }
    let mut known: Vec<String> = model.channels.iter().map(|channel| channel.name.clone()).collect();
    for element in model.elements.iter().filter(|element| element.class.kind.word() == "joint") {
        known.extend(element.class.channels.iter().map(|channel| format!("{}.{}", element.name, channel.name)));
    }
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    let help = help_for(name, &known, "outputs and coordinates")
        .unwrap_or_else(|| "name an [[output]], or a joint's coordinate as `joint.channel`".into());
    let message = format!("there is no output or joint coordinate `{name}`");
    Err(refuse(session, Diagnostic::error(codes::UNKNOWN_TARGET, message).help(help)))
}

/// A number with a unit of its own (`30 deg`), or in that of a quantity; SI. `None` where it is neither.
#[must_use]
pub fn amount(text: &str, dimension: Dimension, factor: f64) -> Option<f64> {
    let (value, unit) = number_and_unit(text)?;
    let factor = match unit {
        "" => factor,
        unit if dimension.angle != 0 && counts_cycles(unit) => return None,
        unit => parse_unit(unit).ok().filter(|(found, _)| found.compatible(dimension))?.1,
    };
    Some(value * factor).filter(|value| value.is_finite())
}

/// The values of quantities of positions where a scene starts, SI.
///
/// # Errors
/// An element that fails.
pub fn values_at_start(session: &Session, wanted: &[Wanted]) -> Result<Vec<f64>, SessionError> {
    let (layout, model) = (&session.plan.layout, &session.model);
    let mut equations = session.equations.clone();
    let nodes: Vec<_> = wanted.iter().map(|one| equations.observe(&one.quantity, model, layout)).collect();
    let inputs = start_inputs(layout, session.time_of_start(), &session.assembly);
    let found = Evaluator::new(&equations.graph, &nodes).run(&inputs, &[]).map(<[f64]>::to_vec);
    found.map_err(|error| refuse(session, Diagnostic::error(codes::MOTION_NOT_FINITE, error.to_string())))
}

/// Element and coordinate of `joint.channel`, or of a joint with one coordinate.
fn coordinate(model: &Model, name: &str) -> Option<(usize, usize)> {
    model.elements.iter().enumerate().filter(|(_, one)| one.class.kind.word() == "joint").find_map(|(index, one)| {
        let channels = &one.class.channels;
        if one.name == name && channels.len() == 1 {
            return Some((index, 0));
        }
        let rest = name.strip_prefix(one.name.as_str())?.strip_prefix('.')?;
        channels.iter().position(|channel| channel.name == rest).map(|channel| (index, channel))
    })
}

/// A header cell: name, number of primes, unit.
fn cell(text: &str) -> (String, usize, Option<String>) {
    let (name, unit) = name_and_unit(text);
    let bare = name.trim_end_matches('\'');
    (bare.to_owned(), name.len() - bare.len(), unit.map(str::to_owned))
}

impl Motion {
    /// Times at a spacing, s, from the first to the last row, both included.
    #[must_use]
    pub fn spaced(&self, every: f64) -> Vec<f64> {
        let (first, last) = (self.times[0], self.times[self.times.len() - 1]);
        let count = ((last - first) / every * (1.0 + 1e-12)).floor() as usize;
        let mut times: Vec<f64> = (0..=count).map(|k| (first + k as f64 * every).min(last)).collect();
        if last - times[times.len() - 1] > 1e-9 * every {
            times.push(last);
        }
        times
    }

    /// Reads a motion file; `follow` names the quantities that are taken of it, all where it is `None`.
    ///
    /// # Errors
    /// What is wrong with the file, with its line; unknown names; units that do not fit.
    pub fn read(session: &Session, path: &Path, follow: Option<&[String]>) -> Result<Self, SessionError> {
        let wrong = |message: String| {
            let diagnostic = Diagnostic::error(codes::CANNOT_READ_RESULTS, format!("{}: {message}", path.display()));
            let help = "the first line names the columns with their units, `t [s], crank.angle [deg]`; every other line has a number per column";
            refuse(session, diagnostic.help(help))
        };
        let text = std::fs::read_to_string(path).map_err(|error| wrong(error.to_string()))?;
        Self::parse(session, &text, follow, &wrong)
    }

    fn parse(
        session: &Session,
        text: &str,
        follow: Option<&[String]>,
        wrong: &dyn Fn(String) -> SessionError,
    ) -> Result<Self, SessionError> {
        let text = with_commas(text);
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| wrong(error.to_string()))?.clone();
        let cells: Vec<(String, usize, Option<String>)> = header.iter().map(cell).collect();
        if let Some(k) =
            (0..cells.len()).find(|k| cells[..*k].iter().any(|one| (&one.0, one.1) == (&cells[*k].0, cells[*k].1)))
        {
            return Err(wrong(format!("two columns are called `{}`", &header[k])));
        }
        let time = column_of_times(&header.iter().collect::<Vec<_>>());
        let time = time.ok_or_else(|| wrong("no column is called `t` or `time`".into()))?;
        if let Some(name) = follow.and_then(|names| names.iter().find(|name| !cells.iter().any(|one| one.0 == **name)))
        {
            return Err(wrong(format!("it has no column `{name}`")));
        }
        let factor_of = |k: usize, dimension: Dimension, own: f64| -> Result<f64, SessionError> {
            let Some(unit) = &cells[k].2 else { return Ok(own) };
            let (found, factor) =
                parse_unit(unit).map_err(|error| wrong(format!("`{}`: {}", &header[k], error.message)))?;
            if dimension.angle != 0 && counts_cycles(unit) {
                let head = &header[k];
                return Err(wrong(format!(
                    "`{head}` counts cycles, and {dimension} was expected: give it in turns (`turn/s`)"
                )));
            }
            if found.compatible(dimension) {
                return Ok(factor);
            }
            Err(wrong(format!("`{}` is in `{unit}`, and {dimension} was expected", &header[k])))
        };
        let units = &session.scene.units;
        let mut factors = vec![None; cells.len()];
        factors[time] = Some(factor_of(time, Dimension::TIME, units.factor(Dimension::TIME))?);
        // Per quantity the columns of value, first and second derivative.
        let mut columns: Vec<[Option<usize>; 3]> = Vec::new();
        let mut wanted: Vec<Wanted> = Vec::new();
        for (k, (name, primes, _)) in cells.iter().enumerate() {
            if k == time || follow.is_some_and(|names| !names.contains(name)) {
                continue;
            }
            if *primes > 2 {
                return Err(wrong(format!("`{}` is a third derivative or a higher one", &header[k])));
            }
            let at = match wanted.iter().position(|one| one.name == *name) {
                Some(at) => at,
                None => {
                    wanted.push(quantity(session, name)?);
                    columns.push([None; 3]);
                    wanted.len() - 1
                }
            };
            let mut dimension = wanted[at].dimension;
            for _ in 0..*primes {
                dimension = dimension.over(Dimension::TIME).unwrap_or(dimension);
            }
            let own = if *primes == 0 { wanted[at].factor } else { units.factor(dimension) };
            factors[k] = Some(factor_of(k, dimension, own)?);
            columns[at][*primes] = Some(k);
        }
        if let Some(at) = columns.iter().position(|one| one[0].is_none() || one[2].is_some() && one[1].is_none()) {
            let name = &wanted[at].name;
            return Err(wrong(format!("`{name}` needs its values, and with `{name}''` also `{name}'`")));
        }
        if wanted.is_empty() {
            return Err(wrong("it prescribes nothing: it has no column beside the time".into()));
        }
        let mut table: Vec<Vec<f64>> = vec![Vec::new(); cells.len()];
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record).map_err(|error| wrong(error.to_string()))? {
            let line = record.position().map_or(0, csv::Position::line);
            for (k, field) in record.iter().enumerate() {
                let Some(factor) = factors[k] else { continue };
                let number = field.parse::<f64>().ok().filter(|number| number.is_finite());
                let number = number.ok_or_else(|| wrong(format!("line {line}: `{field}` is not a finite number")))?;
                if k == time && table[k].last().is_some_and(|last| number * factor <= *last) {
                    return Err(wrong(format!("line {line}: times must increase")));
                }
                table[k].push(number * factor);
            }
        }
        let times = table[time].clone();
        let fewest = if columns.iter().all(|one| one[2].is_some()) { 1 } else { 4 };
        if times.len() < fewest {
            return Err(wrong(format!("it has {} rows, and needs at least {fewest}", times.len())));
        }
        let column = |k: Option<usize>| k.map(|k| table[k].clone());
        let (mut nodes, mut cubic) = (Vec::new(), Vec::new());
        for own in &columns {
            let values = column(own[0]).unwrap_or_default();
            let (slopes, seconds) = match (column(own[1]), column(own[2])) {
                (Some(slopes), Some(seconds)) => (slopes, seconds),
                (Some(slopes), None) => {
                    let seconds = spline_slopes(&times, &slopes);
                    (slopes, seconds)
                }
                (None, _) => {
                    let slopes = spline_slopes(&times, &values);
                    let seconds = second_derivatives(&times, &values, &slopes);
                    (slopes, seconds)
                }
            };
            nodes.push((0..times.len()).map(|k| [values[k], slopes[k], seconds[k]]).collect());
            cubic.push(own[1].is_none());
        }
        Ok(Self { wanted, times, nodes, cubic })
    }

    /// A motion given by its values and both derivatives at some times, SI.
    #[must_use]
    pub fn through(wanted: Vec<Wanted>, times: Vec<f64>, nodes: Vec<Vec<Derivatives>>) -> Self {
        let cubic = vec![false; wanted.len()];
        Self { wanted, times, nodes, cubic }
    }

    /// What is prescribed at a time within the rows, SI.
    #[must_use]
    pub fn at(&self, time: f64) -> Vec<Derivatives> {
        (0..self.wanted.len()).map(|k| self.one(k, time)).collect()
    }

    fn one(&self, k: usize, time: f64) -> Derivatives {
        let (times, nodes) = (&self.times, &self.nodes[k]);
        let after = times.partition_point(|at| *at <= time);
        if after == 0 {
            return nodes[0];
        }
        if after == times.len() || times[after - 1] == time {
            return nodes[after - 1];
        }
        let (from, to) = (nodes[after - 1], nodes[after]);
        let h = times[after] - times[after - 1];
        let x = (time - times[after - 1]) / h;
        if self.cubic[k] { cubic(from, to, h, x) } else { quintic(from, to, h, x) }
    }
}

/// The cubic polynomial with these values and slopes at both ends of a stretch h, at the share x of it.
fn cubic(from: Derivatives, to: Derivatives, h: f64, x: f64) -> Derivatives {
    let (a, b) = (h * from[1], h * to[1]);
    let rise = to[0] - from[0];
    let (c2, c3) = (3.0 * rise - 2.0 * a - b, a + b - 2.0 * rise);
    [
        from[0] + x * (a + x * (c2 + x * c3)),
        (a + x * (2.0 * c2 + x * 3.0 * c3)) / h,
        (2.0 * c2 + x * 6.0 * c3) / (h * h),
    ]
}

/// The quintic one, with these second derivatives too.
fn quintic(from: Derivatives, to: Derivatives, h: f64, x: f64) -> Derivatives {
    let (v0, v1, a0, a1) = (h * from[1], h * to[1], h * h * from[2], h * h * to[2]);
    let rise = to[0] - from[0] - v0 - 0.5 * a0;
    let (speed, bend) = (v1 - v0 - a0, a1 - a0);
    let c3 = 10.0 * rise - 4.0 * speed + 0.5 * bend;
    let c4 = -15.0 * rise + 7.0 * speed - bend;
    let c5 = 6.0 * rise - 3.0 * speed + 0.5 * bend;
    [
        from[0] + x * (v0 + x * (0.5 * a0 + x * (c3 + x * (c4 + x * c5)))),
        (v0 + x * (a0 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))) / h,
        (a0 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))) / (h * h),
    ]
}

/// Slopes at the knots of the twice continuously differentiable cubic spline without a knot at the second and the last but one of at
/// least four points. The system is tridiagonal once the ends are eliminated, and diagonally dominant.
fn spline_slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let h: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let d: Vec<f64> = (0..n - 1).map(|k| (y[k + 1] - y[k]) / h[k]).collect();
    // lower[k] s[k-1] + diagonal[k] s[k] + upper[k] s[k+1] = right[k]
    let (mut lower, mut diagonal, mut upper, mut right) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let end = |h0: f64, h1: f64, d0: f64, d1: f64| {
        let both = h0 + h1;
        (h1, both, ((h0 + 2.0 * both) * h1 * d0 + h0 * h0 * d1) / both)
    };
    (diagonal[0], upper[0], right[0]) = end(h[0], h[1], d[0], d[1]);
    (diagonal[n - 1], lower[n - 1], right[n - 1]) = end(h[n - 2], h[n - 3], d[n - 2], d[n - 3]);
    for k in 1..n - 1 {
        (lower[k], diagonal[k], upper[k]) = (h[k], 2.0 * (h[k - 1] + h[k]), h[k - 1]);
        right[k] = 3.0 * (h[k] * d[k - 1] + h[k - 1] * d[k]);
    }
    for k in 1..n {
        let share = lower[k] / diagonal[k - 1];
        diagonal[k] -= share * upper[k - 1];
        right[k] -= share * right[k - 1];
    }
    let mut slopes = vec![0.0; n];
    for k in (0..n).rev() {
        let next = slopes.get(k + 1).copied().unwrap_or(0.0);
        slopes[k] = (right[k] - upper[k] * next) / diagonal[k];
    }
    slopes
}

/// Second derivatives at the knots of a spline with these slopes.
fn second_derivatives(x: &[f64], y: &[f64], slopes: &[f64]) -> Vec<f64> {
    let node = |k: usize| [y[k], slopes[k], 0.0];
    (0..x.len())
        .map(|k| {
            let left = k.min(x.len() - 2);
            let h = x[left + 1] - x[left];
            cubic(node(left), node(left + 1), h, if k == left { 0.0 } else { 1.0 })[2]
        })
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn cycles_are_no_radians() {
        let rate = |text: &str| amount(text, Dimension::ANGULAR_VELOCITY, 2.0);
        assert_eq!((rate("1.5"), rate("3 rad/s"), rate("1 Hz")), (Some(3.0), Some(3.0), None));
        assert_eq!(amount("2 Hz", Dimension::DIMENSIONLESS.over(Dimension::TIME).expect("a rate"), 1.0), Some(2.0));
    }

    /// A cubic is its own spline, ends included; a spline is twice continuously differentiable.
    #[test]
    fn splines_are_exact_for_cubics_and_smooth_for_others() {
        let x = [0.0, 0.3, 0.7, 1.0, 1.6, 2.0];
        let cubic_of = |t: f64| 1.0 + t * (2.0 + t * (-3.0 + t * 0.5));
        let y: Vec<f64> = x.iter().map(|t| cubic_of(*t)).collect();
        let slopes = spline_slopes(&x, &y);
        let seconds = second_derivatives(&x, &y, &slopes);
        for (k, t) in x.iter().enumerate() {
            assert!((slopes[k] - (2.0 + t * (-6.0 + 1.5 * t))).abs() < 1e-12, "{t}");
            assert!((seconds[k] - (-6.0 + 3.0 * t)).abs() < 1e-11, "{t}");
        }
        let y: Vec<f64> = x.iter().map(|t| (3.0 * t).sin()).collect();
        let slopes = spline_slopes(&x, &y);
        for k in 1..x.len() - 1 {
            let node = |k: usize| [y[k], slopes[k], 0.0];
            let before = cubic(node(k - 1), node(k), x[k] - x[k - 1], 1.0)[2];
            let after = cubic(node(k), node(k + 1), x[k + 1] - x[k], 0.0)[2];
            assert!((before - after).abs() < 1e-11, "{k}: {before} {after}");
        }
    }

    /// A quintic is its own interpolation, with its derivatives.
    #[test]
    fn quintics_have_the_derivatives_of_both_ends() {
        let f = |t: f64| {
            let powers: Vec<f64> = (0..6).map(|k| t.powi(k)).collect();
            let value: f64 = powers.iter().zip([1.0, -2.0, 0.5, 3.0, -1.0, 0.7]).map(|(p, c)| p * c).sum();
            let slope = -2.0 + t + 9.0 * t * t - 4.0 * t.powi(3) + 3.5 * t.powi(4);
            [value, slope, 1.0 + 18.0 * t - 12.0 * t * t + 14.0 * t.powi(3)]
        };
        for x in [0.0, 0.25, 0.8, 1.0] {
            let (found, expected) = (quintic(f(0.5), f(1.2), 0.7, x), f(0.5 + 0.7 * x));
            (0..3).for_each(|k| assert!((found[k] - expected[k]).abs() < 1e-12, "{x} {k}"));
        }
    }
}
