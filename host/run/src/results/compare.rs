//! [`compare`]: how far two tables of results are apart.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::channels::{self, ChannelInfo};
use super::summary::json;
use super::text::{Side, aligned, count, significant};
use super::{ResultsError, Table};

/// Times are equal when they differ by less than this share of the step ...
const SHARE_OF_STEP: f64 = 1e-9;
/// ... plus this share of themselves.
const SHARE_OF_TIME: f64 = 1e-12;

/// The differences of two tables. Numbers that are not finite become `null` as JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The first table.
    pub a: PathBuf,
    /// The second table, which the first is measured by.
    pub b: PathBuf,
    /// Rows with a time that is in both.
    pub rows: u64,
    /// First of these times.
    pub t_first: f64,
    /// Last of these times.
    pub t_last: f64,
    /// Rows only the first has.
    pub rows_only_in_a: u64,
    /// Rows only the second has.
    pub rows_only_in_b: u64,
    /// The common columns, in the order of the first table.
    pub columns: Vec<ColumnDifference>,
    /// Columns only the first has.
    pub columns_only_in_a: Vec<String>,
    /// Columns only the second has.
    pub columns_only_in_b: Vec<String>,
    /// Columns, the time among them, whose numbers in the second table were brought into the unit that they have in the first.
    pub converted: Vec<String>,
}

/// The largest difference in one column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnDifference {
    /// The column.
    pub name: String,
    /// Largest magnitude of a difference; infinite where a value is not a number, or infinite in one table.
    pub absolute: f64,
    /// The time it is at.
    pub t: f64,
    /// Largest finite magnitude in the second table, over all its rows.
    pub peak_b: f64,
    /// `absolute / peak_b`, or `absolute` if the peak is zero.
    pub relative: f64,
}

/// Compares two tables: rows are matched by time, columns by name. Of tables of runs the units are known: those of the second are
/// brought into the units of the first.
///
/// # Errors
/// A table cannot be read, they have no time or no column in common, or a column is of two quantities; see [`ResultsError`].
pub fn compare(a: &Path, b: &Path) -> Result<Comparison, ResultsError> {
    let (first, mut second) = (Table::read(a)?, Table::read(b)?);
    let nothing = |reason: &str| ResultsError::NothingToCompare {
        first: a.to_path_buf(),
        second: b.to_path_buf(),
        reason: reason.into(),
    };
    let converted = in_units_of(a, b, &mut second).map_err(|reason| nothing(&reason))?;
    let pairs = common_rows(&first.times, &second.times);
    let ([(start, _), ..], [.., (end, _)]) = (pairs.as_slice(), pairs.as_slice()) else {
        return Err(nothing("no time is in both"));
    };
    let mut columns = Vec::new();
    for (name, ours) in first.names.iter().zip(&first.columns) {
        if let Some(theirs) = second.column(name) {
            columns.push(difference(name, ours, theirs, &pairs, &first.times));
        }
    }
    if columns.is_empty() {
        return Err(nothing("no column besides the time is in both"));
    }
    let missing = |from: &Table, other: &Table| -> Vec<String> {
        from.names.iter().filter(|name| !other.names.contains(name)).cloned().collect()
    };
    Ok(Comparison {
        a: a.to_path_buf(),
        b: b.to_path_buf(),
        rows: pairs.len() as u64,
        t_first: first.times[*start],
        t_last: first.times[*end],
        rows_only_in_a: (first.times.len() - pairs.len()) as u64,
        rows_only_in_b: (second.times.len() - pairs.len()) as u64,
        columns,
        columns_only_in_a: missing(&first, &second),
        columns_only_in_b: missing(&second, &first),
        converted,
    })
}

/// Brings the numbers of the second table into the units of the first, where both are of runs. Gives the columns that were changed, or
/// the reason why one cannot be.
fn in_units_of(a: &Path, b: &Path, second: &mut Table) -> Result<Vec<String>, String> {
    let (Some(ours), Some(theirs)) = (channels::beside(a), channels::beside(b)) else { return Ok(Vec::new()) };
    let mut converted = Vec::new();
    for other in &theirs {
        let Some(own) = ours.iter().find(|own| own.name == other.name) else { continue };
        if own.quantity != other.quantity {
            let of = |channel: &ChannelInfo| format!("a {} [{}]", channel.quantity.replace('_', " "), channel.unit);
            return Err(format!("`{}` is {} in the first and {} in the second", own.name, of(own), of(other)));
        }
        if own.factor == other.factor {
            continue;
        }
        let values = match second.names.iter().position(|name| *name == other.name) {
            Some(column) => &mut second.columns[column],
            None => &mut second.times,
        };
        values.iter_mut().for_each(|value| *value *= other.factor / own.factor);
        converted.push(own.name.clone());
    }
    Ok(converted)
}

/// Index pairs of rows with equal times. Both lists ascend, so one walk finds them.
pub(super) fn common_rows(a: &[f64], b: &[f64]) -> Vec<(usize, usize)> {
    let step = SHARE_OF_STEP * mean_step(a).min(mean_step(b));
    let step = if step.is_finite() { step } else { 0.0 };
    let mut pairs = Vec::new();
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        let near = step + SHARE_OF_TIME * a[i].abs().max(b[j].abs());
        if (a[i] - b[j]).abs() <= near {
            pairs.push((i, j));
            (i, j) = (i + 1, j + 1);
        } else if a[i] < b[j] {
            i += 1;
        } else {
            j += 1;
        }
    }
    pairs
}

/// Mean distance of times; infinite for a single one.
fn mean_step(times: &[f64]) -> f64 {
    match times {
        [first, .., last] => (last - first) / (times.len() - 1) as f64,
        _ => f64::INFINITY,
    }
}

pub(super) fn difference(
    name: &str,
    a: &[f64],
    b: &[f64],
    pairs: &[(usize, usize)],
    times: &[f64],
) -> ColumnDifference {
    let mut largest = (0.0, times[pairs[0].0]);
    for &(i, j) in pairs {
        // Equal infinities are no difference; anything else with an infinity or NaN is beyond every limit.
        let apart = if a[i] == b[j] { 0.0 } else { (a[i] - b[j]).abs() };
        let apart = if apart.is_nan() { f64::INFINITY } else { apart };
        if apart > largest.0 {
            largest = (apart, times[i]);
        }
    }
    let (absolute, t) = largest;
    let peak_b = b.iter().filter(|value| value.is_finite()).fold(0.0_f64, |peak, value| peak.max(value.abs()));
    let relative = if peak_b > 0.0 { absolute / peak_b } else { absolute };
    ColumnDifference { name: name.into(), absolute, t, peak_b, relative }
}

impl Comparison {
    /// The column with the largest relative difference.
    #[must_use]
    pub fn worst(&self) -> &ColumnDifference {
        let worse = |one: &&ColumnDifference, other: &&ColumnDifference| one.relative.total_cmp(&other.relative);
        self.columns.iter().max_by(worse).expect("a comparison has at least one column")
    }

    /// Columns whose relative difference is above a limit, which must be a number.
    pub fn beyond(&self, limit: f64) -> impl Iterator<Item = &ColumnDifference> {
        self.columns.iter().filter(move |column| column.relative > limit)
    }

    /// What the second table has and the first lacks: rows, then columns by name.
    #[must_use]
    pub fn missing(&self) -> Option<String> {
        let rows = (self.rows_only_in_b > 0).then(|| count(self.rows_only_in_b, "row"));
        let columns = self.columns_only_in_b.iter().map(|name| format!("column {name}"));
        let all: Vec<String> = rows.into_iter().chain(columns).collect();
        (!all.is_empty()).then(|| all.join(", "))
    }

    /// As indented JSON, with a newline at the end.
    #[must_use]
    pub fn to_json(&self) -> String {
        json(self)
    }
}

/// A table for people: one line per column, then what could not be compared.
impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let titles = ["column", "largest difference", "at t", "peak of B", "relative"];
        let mut rows = vec![titles.map(String::from).to_vec()];
        for column in &self.columns {
            rows.push(vec![
                column.name.clone(),
                significant(column.absolute, 3),
                significant(column.t, 7),
                significant(column.peak_b, 7),
                significant(column.relative, 3),
            ]);
        }
        writeln!(f, "A: {}\nB: {}", self.a.display(), self.b.display())?;
        write!(f, "{}", aligned(&[Side::Left, Side::Right, Side::Right, Side::Right, Side::Right], &rows))?;
        let (start, end) = (significant(self.t_first, 7), significant(self.t_last, 7));
        write!(f, "{} compared, t = {start} to {end}", count(self.rows, "row"))?;
        for (number, table) in [(self.rows_only_in_a, "A"), (self.rows_only_in_b, "B")] {
            if number > 0 {
                write!(f, "; {} only in {table}", count(number, "row"))?;
            }
        }
        writeln!(f)?;
        for (names, table) in [(&self.columns_only_in_a, "A"), (&self.columns_only_in_b, "B")] {
            if !names.is_empty() {
                writeln!(f, "columns only in {table}: {}", names.join(", "))?;
            }
        }
        if !self.converted.is_empty() {
            writeln!(f, "in the units of A: {}", self.converted.join(", "))?;
        }
        let worst = self.worst();
        writeln!(f, "largest relative difference: {} ({})", significant(worst.relative, 3), worst.name)
    }
}
