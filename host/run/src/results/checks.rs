//! [`Check`]: values of a run against those they should have.

use std::path::Path;

use serde::Serialize;

use super::compare::common_rows;
use super::{ResultsError, Table, significant};

/// A value, what it should be, and how near. Times in the unit of the table, numbers in units of the columns.
pub struct Check<'a> {
    /// Its name.
    pub name: &'a str,
    /// What kind of quantity is compared, in a word.
    pub kind: &'static str,
    /// Unit of the value; empty if it has none or it is not known.
    pub unit: &'a str,
    /// The value at a row of the table.
    pub value: &'a dyn Fn(usize) -> f64,
    /// What it should be.
    pub reference: Expected<'a>,
    /// Largest allowed magnitude of the difference.
    pub tolerance: f64,
    /// Earlier samples are left out.
    pub from: Option<f64>,
    /// Later samples are left out.
    pub to: Option<f64>,
}

/// Samples outside of a table are reported from this share of them on.
const LEAST_PART: f64 = 0.01;

/// What a value should be.
pub enum Expected<'a> {
    /// Known at every row of the table.
    Formula(&'a dyn Fn(usize) -> f64),
    /// A column of a table with times, which are matched as in [`super::compare`].
    Column {
        /// The file of the table.
        path: &'a Path,
        /// What was read there, or why nothing was.
        table: &'a Result<Table, ResultsError>,
        /// The column.
        column: &'a str,
    },
}

/// How a check came out. Numbers that are not finite become `null` as JSON.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct CheckResult {
    /// Its name.
    pub name: String,
    /// What kind of quantity was compared, in a word.
    pub kind: &'static str,
    /// Unit of the value; may be empty.
    pub unit: String,
    /// Largest magnitude of a difference; NaN if one of them is, or if nothing could be compared.
    pub largest: f64,
    /// The time it is at.
    pub at: f64,
    /// Largest allowed magnitude.
    pub tolerance: f64,
    /// Whether the largest is allowed.
    pub passed: bool,
    /// Number of samples compared.
    pub samples: u64,
    /// Why nothing could be compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
    /// What of the run was compared, where a table covers no more than a part of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Time, value and reference at the samples compared.
    #[serde(skip)]
    pub series: Vec<(f64, f64, f64)>,
}

impl CheckResult {
    /// The same with an empty series.
    #[must_use]
    pub fn without_samples(&self) -> Self {
        let Self { name, kind, unit, largest, at, tolerance, passed, samples, problem, part, series: _ } = self;
        Self {
            name: name.clone(),
            kind,
            unit: unit.clone(),
            largest: *largest,
            at: *at,
            tolerance: *tolerance,
            passed: *passed,
            samples: *samples,
            problem: problem.clone(),
            part: part.clone(),
            series: Vec::new(),
        }
    }
}

impl Check<'_> {
    /// Compares at the samples taken at these times.
    #[must_use]
    pub fn evaluate(&self, times: &[f64]) -> CheckResult {
        let (series, problem) = match self.series(times) {
            Ok(series) if series.is_empty() => (series, Some("there are no samples to compare".into())),
            Ok(series) => (series, None),
            Err(problem) => (Vec::new(), Some(problem)),
        };
        let (largest, at) = largest(&series);
        CheckResult {
            name: self.name.into(),
            kind: self.kind,
            unit: self.unit.into(),
            largest,
            at,
            tolerance: self.tolerance,
            // A NaN is not.
            passed: largest <= self.tolerance,
            samples: series.len() as u64,
            problem,
            part: self.part(times, &series),
            series,
        }
    }

    /// What was compared, where samples that should have been are before or beyond all times of the table.
    fn part(&self, times: &[f64], series: &[(f64, f64, f64)]) -> Option<String> {
        let Expected::Column { path, table: Ok(table), .. } = &self.reference else { return None };
        let ([first, .., last] | [first @ last]) = &table.times[..] else { return None };
        let ((begin, ..), (end, ..)) = (series.first()?, series.last()?);
        let near = |limit: f64| 1e-9 * limit.abs();
        let asked = || times.iter().filter(|t| self.takes(**t));
        let outside = asked().filter(|t| **t < first - near(*first) || **t > last + near(*last)).count();
        (outside as f64 > LEAST_PART * asked().count() as f64).then(|| {
            format!(
                "compared from t = {} to {}, at {} of {} samples: `{}` has no times beyond",
                significant(*begin, 6),
                significant(*end, 6),
                series.len(),
                asked().count(),
                path.display()
            )
        })
    }

    /// Time, value and reference; the error says why there are none.
    fn series(&self, times: &[f64]) -> Result<Vec<(f64, f64, f64)>, String> {
        let sample = |row: usize, reference: f64| (times[row], (self.value)(row), reference);
        let rows = (0..times.len()).filter(|row| self.takes(times[*row]));
        match &self.reference {
            Expected::Formula(reference) => Ok(rows.map(|row| sample(row, reference(row))).collect()),
            Expected::Column { path, table, column: name } => {
                let table = table.as_ref().map_err(ToString::to_string)?;
                let column = table.column(name).ok_or_else(|| {
                    format!("`{}` has no column `{name}`, its columns are {}", path.display(), table.names.join(", "))
                })?;
                let pairs = common_rows(times, &table.times);
                if pairs.is_empty() {
                    return Err(format!("no time of `{}` is a sample of the run", path.display()));
                }
                let taken = pairs.iter().filter(|(row, _)| self.takes(times[*row]));
                Ok(taken.map(|(row, theirs)| sample(*row, column[*theirs])).collect())
            }
        }
    }

    /// Whether samples of this time are compared.
    fn takes(&self, t: f64) -> bool {
        // Limits that went through a conversion of units must not lose their own sample to rounding.
        let near = |limit: f64| 1e-12 * limit.abs();
        self.from.is_none_or(|from| t >= from - near(from)) && self.to.is_none_or(|to| t <= to + near(to))
    }
}

/// The largest magnitude of a difference and its time; the first NaN is larger than everything.
fn largest(series: &[(f64, f64, f64)]) -> (f64, f64) {
    let Some((start, ..)) = series.first() else {
        return (f64::NAN, f64::NAN);
    };
    let mut largest = (0.0, *start);
    for (t, value, reference) in series {
        let apart = (value - reference).abs();
        if apart.is_nan() {
            return (f64::NAN, *t);
        }
        if apart > largest.0 {
            largest = (apart, *t);
        }
    }
    largest
}
