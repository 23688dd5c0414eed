//! [`Reference`]: what the outputs of a scene are, where the scene has no `[[check]]` to say it.
//!
//! Power series of two orders in numbers of 31 digits; where they cannot be had, two computations in doubles with different
//! coordinates and tolerances, both much tighter than what is measured. How far they are apart is how well the reference is known;
//! errors below that are not distinguished. The reference is kept as a table beside the results and
//! used again as long as scene, libraries and program are the same.

use std::fs;
use std::path::Path;

use crate::results::{self, Table, significant};
use crate::session::{PreciseSamples, RunReport};

/// Computations that differ by more, as a share of their outputs' sizes, are no reference.
const MOST: f64 = 1e-6;
/// So many times the effect of rounding the start may be what doubles make of a motion, at a tolerance of 1e-12.
const ROUNDED: f64 = 1e6;
/// First line of the file.
const TITLE: &str = "# Reference of `odyn bench`; made anew when scene, libraries or program change";

/// See the module documentation.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reference {
    times: Vec<f64>,
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
    /// By output: its peak, or what is natural for its dimension where that is more; infinite where redundant joints leave it open.
    sizes: Vec<f64>,
    /// Largest difference of the two computations, as a share of those.
    pub(super) accuracy: f64,
    /// The two computations, in words.
    pub(super) how: String,
}

impl Reference {
    /// From two computations. Their differences count as shares of an output's peak, or of what is natural for its dimension
    /// (`natural`) where that is more.
    ///
    /// # Errors
    /// The scene has no output, or they differ too much: from when on, and what helps.
    pub(super) fn new(first: &RunReport, second: &RunReport, natural: &[f64], how: &str) -> Result<Self, String> {
        let mut reference = Self::of(first, natural, how)?;
        reference.accuracy = reference.error(second)?;
        if reference.accuracy <= MOST {
            return Ok(reference);
        }
        Err(reference.parted(first, how, |k, row| reference.share(second, k, row) > MOST))
    }

    /// From a computation with more digits than doubles have. `run` is one in doubles: it has to agree, as far as what rounding the
    /// start makes of it allows.
    ///
    /// # Errors
    /// As for [`Reference::new`]; also where it ended early.
    pub(super) fn precise(precise: &PreciseSamples, run: &RunReport, natural: &[f64]) -> Result<Self, String> {
        if let Some(ended) = &precise.ended {
            return Err(ended.why.clone());
        }
        let columns = precise.columns.iter().map(|column| column.iter().map(|x| x.to_f64()).collect());
        let mut reference = Self::of(&RunReport { columns: columns.collect(), ..run.clone() }, natural, &precise.how)?;
        let doubt = |k: usize, row: usize| precise.doubts[k][row] / reference.sizes[k];
        let places = (0..reference.sizes.len()).flat_map(|k| (0..precise.times.len()).map(move |row| (k, row)));
        // It is kept in doubles.
        let accuracy = places.map(|(k, row)| doubt(k, row)).fold(0.5 * f64::EPSILON, f64::max);
        if accuracy > MOST {
            return Err(reference.parted(run, &precise.how, |k, row| doubt(k, row) > MOST));
        }
        reference.error(run)?;
        let disagrees = |k: usize, row: usize| {
            reference.share(run, k, row) > MOST.max(ROUNDED * precise.starts[k][row] / reference.sizes[k])
        };
        if reference.first(disagrees).is_some() {
            return Err(reference.parted(run, &format!("{} and a run in doubles", precise.how), disagrees));
        }
        reference.accuracy = accuracy;
        Ok(reference)
    }

    /// From one computation, its accuracy unknown.
    fn of(first: &RunReport, natural: &[f64], how: &str) -> Result<Self, String> {
        if first.columns.is_empty() {
            return Err("the scene has neither [[output]] nor [[check]], so no error can be measured".into());
        }
        let sizes = first.channels.iter().zip(&first.columns).zip(natural).map(|((channel, column), natural)| {
            let size = column.iter().fold(*natural, |most, x| most.max(x.abs()));
            match channel.unique {
                // Each computation may choose it.
                false => f64::INFINITY,
                true if size > 0.0 => size,
                true => 1.0,
            }
        });
        let sizes: Vec<f64> = sizes.collect();
        if sizes.iter().all(|size| size.is_infinite()) {
            return Err("no output is determined uniquely, so no error can be measured".into());
        }
        Ok(Self {
            times: first.times.clone(),
            names: first.channels.iter().map(|channel| channel.name.clone()).collect(),
            sizes,
            columns: first.columns.clone(),
            accuracy: 0.0,
            how: how.into(),
        })
    }

    /// The first sample, and the output in it, of which something holds.
    fn first(&self, holds: impl Fn(usize, usize) -> bool) -> Option<(usize, usize)> {
        let apart = |row: usize| (0..self.names.len()).find(|k| holds(*k, row));
        (0..self.times.len()).find_map(|row| apart(row).map(|k| (row, k)))
    }

    /// Says from when on computations are apart.
    fn parted(&self, run: &RunReport, how: &str, apart: impl Fn(usize, usize) -> bool) -> String {
        let (row, k) = self.first(apart).unwrap_or_default();
        let (t, unit, name) = (self.times[row], &run.summary.time_unit, &self.names[k]);
        format!(
            "no reference: {how} are apart by more than {MOST:e} of its size in `{name}` from t = {} {unit} on; measure a shorter \
             time (`--t-end`), or give the scene a [[check]]",
            significant(t, 6)
        )
    }

    /// The difference of an output from the reference at a sample, as a share of its size.
    fn share(&self, report: &RunReport, k: usize, row: usize) -> f64 {
        (report.columns[k][row] - self.columns[k][row]).abs() / self.sizes[k]
    }

    /// The largest error of an output of a run, as a share of its size.
    ///
    /// # Errors
    /// The run has other outputs or samples, or values that are not numbers.
    pub(super) fn error(&self, report: &RunReport) -> Result<f64, String> {
        let names = report.channels.iter().map(|channel| &channel.name);
        if !names.eq(&self.names) || report.times.len() != self.times.len() {
            return Err("it has other outputs or samples than the reference".into());
        }
        let mut worst = 0.0_f64;
        for k in 0..self.names.len() {
            for row in 0..self.times.len() {
                let share = self.share(report, k, row);
                if !share.is_finite() {
                    return Err(format!("output `{}` is not a number", self.names[k]));
                }
                worst = worst.max(share);
            }
        }
        Ok(worst)
    }

    /// What is measured, for people.
    pub(super) fn words(&self) -> String {
        format!(
            "reference: {}, which agree to {} of the outputs' sizes; smaller errors are not distinguished",
            self.how,
            significant(self.accuracy, 2)
        )
    }

    /// Keeps it, with the fingerprint of the run that it belongs to.
    ///
    /// # Errors
    /// The file can't be written.
    pub(super) fn write(&self, path: &Path, fingerprint: &str) -> Result<(), String> {
        let sizes: Vec<String> = self.sizes.iter().map(|size| format!("{size:e}")).collect();
        let mut text =
            format!("{TITLE}\n# {fingerprint}\n# {:e}\n# {}\n# {}\n", self.accuracy, sizes.join(" "), self.how);
        let mut writer = csv::Writer::from_writer(Vec::new());
        let head = std::iter::once("t").chain(self.names.iter().map(String::as_str));
        writer.write_record(head).expect("writing to memory does not fail");
        for (row, t) in self.times.iter().enumerate() {
            let cells = std::iter::once(t).chain(self.columns.iter().map(|column| &column[row]));
            writer.write_record(cells.map(|x| format!("{x:e}"))).expect("writing to memory does not fail");
        }
        let bytes = writer.into_inner().expect("writing to memory does not fail");
        text.push_str(&String::from_utf8_lossy(&bytes));
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(|error| format!("cannot write `{}`: {error}", folder.display()))?;
        }
        results::replace(path, text.as_bytes(), false).map_err(|error| error.to_string())
    }

    /// The one that was kept for this fingerprint, if it can be read.
    pub(super) fn read(path: &Path, fingerprint: &str) -> Option<Self> {
        let text = fs::read_to_string(path).ok()?;
        let mut lines = text.lines();
        let mut next = || lines.next()?.strip_prefix("# ");
        if Some(next()?) != TITLE.strip_prefix("# ") || next()? != fingerprint {
            return None;
        }
        let accuracy = next()?.parse().ok()?;
        let sizes: Vec<f64> = next()?.split(' ').map(|size| size.parse().ok()).collect::<Option<_>>()?;
        let how = next()?.to_string();
        let Table { names, times, columns, .. } = Table::read(path).ok()?;
        (sizes.len() == names.len()).then_some(Self { times, names, columns, sizes, accuracy, how })
    }
}
