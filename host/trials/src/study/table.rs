//! [`StudyTable`]: what came out of a study, a row per run.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::runner::{Finished, Outcome, Run, Study};
use crate::session::SessionError;

/// Titles and cells, all texts; nothing in it depends on how long anything took.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StudyTable {
    /// `run`, the varied keys, `status`, `problem`, then `figure.NAME [unit]` for the figures of the scene, `final.NAME
    /// [unit]` for the last value of each output, `violation` (largest constraint violation), `energy_error` (relative),
    /// `steps`, `evaluations`.
    pub columns: Vec<String>,
    /// A row per run; cells of what there is not are empty.
    pub rows: Vec<Vec<String>>,
    /// Number of leading columns, and of figures after them: what is worth a look at once.
    #[serde(skip)]
    pub(super) leading: usize,
    #[serde(skip)]
    pub(super) figures: usize,
}

/// What ends the columns.
const WORK: [&str; 4] = ["violation", "energy_error", "steps", "evaluations"];
/// Status of a run that was not begun.
const NOT_BEGUN: &str = "not begun";

impl Study {
    /// The table. A figure or output that only some runs have, or have in that unit, has a column of its own.
    #[must_use]
    pub fn table(&self) -> StudyTable {
        let titles = |run: &Run| match &run.outcome {
            Outcome::Ran(finished) => Some(Arc::new(finished.titles())),
            Outcome::Kept(kept) if !kept.failed => Some(Arc::clone(&kept.titles)),
            Outcome::Kept(_) | Outcome::Failed(_) | Outcome::NotBegun => None,
        };
        let titles: Vec<_> = self.runs.iter().map(titles).collect();
        let all = titles.iter().flatten().fold(Titles::default(), |all, titles| all.and(titles));
        let mut table = StudyTable::empty(self.points.keys(), &all);
        for (k, (run, titles)) in self.runs.iter().zip(&titles).enumerate() {
            let mut row = vec![(self.first + k + 1).to_string()];
            row.extend(self.points.values(self.first + k));
            match &run.outcome {
                Outcome::Ran(finished) => row.extend(finished.cells()),
                Outcome::Kept(kept) => row.extend(kept.cells.iter().cloned()),
                Outcome::Failed(error) => row.extend(failed_cells(error)),
                Outcome::NotBegun => row.extend([NOT_BEGUN.into(), String::new()]),
            }
            table.add(row, titles.as_deref());
        }
        table
    }
}

/// What stands above the figures and outputs of a scene.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Titles {
    pub(super) figures: Vec<String>,
    pub(super) outputs: Vec<String>,
}

impl Titles {
    /// These, then those that only the others are.
    pub(super) fn and(self, others: &Self) -> Self {
        if self == *others {
            return self;
        }
        let union = |mut all: Vec<String>, others: &[String]| {
            for title in others {
                if !all.contains(title) {
                    all.push(title.clone());
                }
            }
            all
        };
        Self { figures: union(self.figures, &others.figures), outputs: union(self.outputs, &others.outputs) }
    }
}

impl Finished {
    /// Titles of its figures and outputs.
    pub(super) fn titles(&self) -> Titles {
        let figures =
            self.summary.figures.iter().map(|figure| titled(&format!("figure.{}", figure.name), &figure.unit));
        let outputs = self.channels.iter().map(|channel| titled(&format!("final.{}", channel.name), &channel.unit));
        Titles { figures: figures.collect(), outputs: outputs.collect() }
    }

    /// Status and everything behind it.
    pub(super) fn cells(&self) -> Vec<String> {
        cells(self)
    }
}

/// `x_p [mm]`
pub(super) fn titled(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.into() } else { format!("{name} [{unit}]") }
}

/// The fewest digits that read back as the same bits; nothing for what is no number.
pub(super) fn number(value: f64) -> String {
    if value.is_finite() { format!("{value}") } else { String::new() }
}

/// Status and problem of a run without results.
pub(super) fn failed_cells(error: &SessionError) -> Vec<String> {
    let said = error.diagnostics.iter().find(|diagnostic| diagnostic.is_error());
    let problem = said.map_or_else(String::new, |said| format!("{}: {}", said.code, said.message));
    vec!["failed".into(), problem]
}

fn cells(finished: &Finished) -> Vec<String> {
    let summary = &finished.summary;
    let failed = summary.checks.iter().filter(|check| !check.passed).map(|check| check.name.as_str());
    let failed = failed.collect::<Vec<_>>().join(", ");
    let problem = match (summary.reason.as_str(), failed.as_str()) {
        ("", "") => String::new(),
        ("", failed) => format!("failed checks: {failed}"),
        (reason, _) => reason.to_string(),
    };
    let mut cells = vec![summary.status.words().to_string(), problem];
    cells.extend(summary.figures.iter().map(|figure| figure.value.map_or_else(String::new, number)));
    cells.extend(finished.last.iter().map(|value| number(*value)));
    let audit = &summary.audit;
    cells.extend([number(audit.position_violation), number(audit.energy_error_relative)]);
    cells.extend([summary.steps.to_string(), summary.evaluations.to_string()]);
    cells
}

impl StudyTable {
    /// A table without rows.
    pub(super) fn empty(keys: &[String], titles: &Titles) -> Self {
        let mut columns = vec!["run".to_string()];
        columns.extend(keys.iter().cloned());
        columns.extend(["status", "problem"].map(String::from));
        let leading = columns.len();
        columns.extend(titles.figures.iter().chain(&titles.outputs).cloned());
        columns.extend(WORK.map(String::from));
        Self { columns, rows: Vec::new(), leading, figures: titles.figures.len() }
    }

    /// Adds a row: the leading cells, and where it has results, those below `titles` and of its work.
    fn add(&mut self, mut row: Vec<String>, titles: Option<&Titles>) {
        let place = self.leading..self.columns.len() - WORK.len();
        let results = row.split_off(self.leading.min(row.len()));
        row.resize(self.columns.len(), String::new());
        if let Some(titles) = titles {
            let titles = || titles.figures.iter().chain(&titles.outputs);
            let (place, mut results) = (&self.columns[place.clone()], results.into_iter());
            if titles().eq(place) {
                row.splice(self.leading.., results);
            } else {
                for (title, cell) in titles().zip(results.by_ref()) {
                    if let Some(column) = place.iter().position(|column| column == title) {
                        row[self.leading + column] = cell;
                    }
                }
                row.splice(self.columns.len() - WORK.len().., results);
            }
            row.resize(self.columns.len(), String::new());
        }
        self.rows.push(row);
    }

    /// Adds the rows of a part with the same keys.
    pub(super) fn append(&mut self, part: &Self) {
        let titles = part.titles();
        part.rows.iter().for_each(|row| self.add(row.clone(), Some(&titles)));
    }

    /// What stands above its figures and outputs.
    pub(super) fn titles(&self) -> Titles {
        let all = &self.columns[self.leading..self.columns.len() - WORK.len()];
        let (figures, outputs) = all.split_at(self.figures);
        Titles { figures: figures.to_vec(), outputs: outputs.to_vec() }
    }

    /// Reads a table with these keys.
    pub(super) fn read(bytes: &[u8], keys: &[String]) -> Result<Self, String> {
        let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(bytes);
        let texts = |record: csv::StringRecord| record.iter().map(str::to_string).collect::<Vec<_>>();
        let rows: Result<Vec<_>, _> = reader.records().map(|record| record.map(texts)).collect();
        let mut rows = rows.map_err(|cause| cause.to_string())?.into_iter();
        let columns = rows.next().ok_or("it is empty")?;
        let bare = Self::empty(keys, &Titles::default()).columns;
        let leading = keys.len() + 3;
        let ends = columns.len().checked_sub(WORK.len()).filter(|end| *end >= leading);
        let whole = |end: usize| columns[..leading] == bare[..leading] && columns[end..] == bare[leading..];
        let end = ends.filter(|end| whole(*end)).ok_or("it has other columns")?;
        let figures = columns[leading..end].iter().take_while(|title| title.starts_with("figure.")).count();
        Ok(Self { columns, rows: rows.collect(), leading, figures })
    }

    /// As CSV.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for record in std::iter::once(&self.columns).chain(&self.rows) {
            writer.write_record(record).expect("writing to memory does not fail");
        }
        let bytes = writer.into_inner().expect("writing to memory does not fail");
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// Values, status and figures (or, where the scene has none, the last values of its first outputs) of the runs that were begun, columns
    /// under each other.
    #[must_use]
    pub fn overview(&self) -> String {
        const MOST_OUTPUTS: usize = 4;
        let shown = self.leading + if self.figures > 0 { self.figures } else { MOST_OUTPUTS };
        let begun = self.rows.iter().filter(|row| row[self.leading - 2] != NOT_BEGUN);
        let rows: Vec<&[String]> =
            std::iter::once(&self.columns).chain(begun).map(|row| &row[..shown.min(row.len())]).collect();
        // What went wrong is long and goes to the end of its line.
        let problem = self.leading - 1;
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let kept = (0..rows[0].len()).filter(|column| *column != problem);
        let kept: Vec<(usize, usize)> = kept.map(|column| (column, width(column))).collect();
        let mut text = String::new();
        for (k, row) in rows.iter().enumerate() {
            let mut line = String::new();
            for (column, width) in &kept {
                line.push_str(&format!("{:>width$}  ", row[*column]));
            }
            if k > 0 {
                line.push_str(&row[problem]);
            }
            text.push_str(line.trim_end());
            text.push('\n');
        }
        text
    }
}
