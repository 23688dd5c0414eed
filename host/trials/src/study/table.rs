//! [`StudyTable`]: what came out of a study, a row per run.

use serde::{Deserialize, Serialize};

use super::runner::{Finished, Outcome, Run, Study};

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

impl Study {
    /// The table.
    #[must_use]
    pub fn table(&self) -> StudyTable {
        let titles = |run: &Run| match &run.outcome {
            Outcome::Ran(finished) => Some(finished.titles()),
            Outcome::Kept(kept) => Some(Titles::clone(&kept.titles)),
            _ => None,
        };
        // All runs have the same figures and outputs.
        let titles = self.runs.iter().find_map(titles).unwrap_or_default();
        let mut columns = vec!["run".to_string()];
        columns.extend(self.keys.iter().cloned());
        columns.extend(["status", "problem"].map(String::from));
        let leading = columns.len();
        columns.extend(titles.figures.iter().chain(&titles.outputs).cloned());
        columns.extend(["violation", "energy_error", "steps", "evaluations"].map(String::from));
        let width = columns.len();
        let row = |(k, run): (usize, &Run)| {
            let mut row = vec![(k + 1).to_string()];
            row.extend(run.values.iter().cloned());
            match &run.outcome {
                Outcome::Ran(finished) => row.extend(finished.cells()),
                Outcome::Kept(kept) => row.extend(kept.cells.iter().cloned()),
                Outcome::Failed(error) => {
                    let said = error.diagnostics.iter().find(|diagnostic| diagnostic.is_error());
                    let problem = said.map_or_else(String::new, |said| format!("{}: {}", said.code, said.message));
                    row.extend(["failed".into(), problem]);
                }
                Outcome::NotBegun => row.push("not begun".into()),
            }
            row.resize(width, String::new());
            row
        };
        let rows = self.runs.iter().enumerate().map(row).collect();
        StudyTable { columns, rows, leading, figures: titles.figures.len() }
    }
}

/// What stands above the figures and outputs of a scene.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Titles {
    pub(super) figures: Vec<String>,
    pub(super) outputs: Vec<String>,
}

impl Finished {
    /// Titles of its figures and outputs.
    pub(super) fn titles(&self) -> Titles {
        let titled = |kind: &str, name: &str, unit: &str| match unit {
            "" => format!("{kind}.{name}"),
            unit => format!("{kind}.{name} [{unit}]"),
        };
        let figures = self.summary.figures.iter().map(|figure| titled("figure", &figure.name, &figure.unit));
        let outputs = self.channels.iter().map(|channel| titled("final", &channel.name, &channel.unit));
        Titles { figures: figures.collect(), outputs: outputs.collect() }
    }

    /// Status and everything behind it.
    pub(super) fn cells(&self) -> Vec<String> {
        cells(self)
    }
}

fn cells(finished: &Finished) -> Vec<String> {
    let summary = &finished.summary;
    let number = |value: f64| if value.is_finite() { format!("{value}") } else { String::new() };
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

    /// Values, status and figures (or, where the scene has none, the last values of its first outputs), columns under each
    /// other.
    #[must_use]
    pub fn overview(&self) -> String {
        const MOST_OUTPUTS: usize = 4;
        let shown = self.leading + if self.figures > 0 { self.figures } else { MOST_OUTPUTS };
        let rows: Vec<&[String]> =
            std::iter::once(&self.columns).chain(&self.rows).map(|row| &row[..shown.min(row.len())]).collect();
        // What went wrong is long and goes to the end of its line.
        let problem = self.leading - 1;
        let kept: Vec<usize> = (0..rows[0].len()).filter(|column| *column != problem).collect();
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let mut text = String::new();
        for (k, row) in rows.iter().enumerate() {
            let mut line = String::new();
            for column in &kept {
                line.push_str(&format!("{:>w$}  ", row[*column], w = width(*column)));
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
