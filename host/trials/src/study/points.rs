//! [`Points`]: the values of all runs of a study.

use std::collections::HashSet;
use std::path::Path;

use super::MOST_RUNS;
use super::vary::Vary;
use crate::diagnostics::{Diagnostic, codes};
use crate::results::checksum;
use crate::scene::{Override, with_commas};

/// The keys that a study varies, and the values they have in each run: all combinations, or those of a table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Points {
    keys: Vec<String>,
    values: Values,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Values {
    /// Every combination; the last key changes fastest.
    Grid(Vec<Vec<String>>),
    /// A row per run.
    Table(Vec<Vec<String>>),
}

impl Default for Values {
    /// One run of the scene as it is.
    fn default() -> Self {
        Self::Grid(Vec::new())
    }
}

impl Points {
    /// Every combination of values, the last key changing fastest.
    ///
    /// # Errors
    /// A key that is there twice; more than [`MOST_RUNS`] combinations.
    pub fn grid(varied: Vec<Vary>) -> Result<Self, Diagnostic> {
        let count = varied.iter().try_fold(1_usize, |all, vary| all.checked_mul(vary.values.len()));
        let (keys, values) = varied.into_iter().map(|vary| (vary.key, vary.values)).unzip();
        Self { keys, values: Values::Grid(values) }.checked(count)
    }

    /// A row of values per run, one per key; texts as in `--set KEY=VALUE`.
    ///
    /// # Errors
    /// A key that is empty or there twice; rows of another length, or with empty values; more than [`MOST_RUNS`] of them.
    pub fn table(keys: Vec<String>, rows: Vec<Vec<String>>) -> Result<Self, Diagnostic> {
        for (k, row) in rows.iter().enumerate() {
            if row.len() != keys.len() {
                let message = format!("point {} has {} values for {} keys", k + 1, row.len(), keys.len());
                return Err(bad(message).help("each point has a value for each key"));
            }
            if let Some(key) = row.iter().position(|value| value.trim().is_empty()) {
                let message = format!("point {} has no value for `{}`", k + 1, keys[key]);
                return Err(bad(message).help("write the value that the scene has, if that is meant"));
            }
        }
        let count = rows.len();
        let keys = keys.iter().map(|key| key.trim().to_string()).collect();
        Self { keys, values: Values::Table(rows) }.checked(Some(count))
    }

    /// Reads a table: keys in the first line, below them a line per run with values as in `--set KEY=VALUE`; between them commas, semicolons
    /// or tabs.
    ///
    /// # Errors
    /// A file that cannot be read, that is no such table, or that has no points; see also [`Points::table`].
    pub fn read(path: &Path) -> Result<Self, Diagnostic> {
        let refused = |what: &dyn std::fmt::Display| {
            let message = format!("cannot read the points in {}: {what}", path.display());
            Diagnostic::error(codes::CANNOT_READ_RESULTS, message)
                .help("write the keys in the first line, and a line of values for each run")
        };
        let text = std::fs::read_to_string(path).map_err(|e| refused(&e))?;
        let keys = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
        // Not by blanks: values have units behind them.
        let text = if keys.contains([';', '\t']) { with_commas(&text) } else { text.as_str().into() };
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
        let texts = |record: &csv::StringRecord| record.iter().map(str::to_string).collect::<Vec<_>>();
        // A mark of the order of bytes, as spreadsheets write it, is no part of the first key.
        let keys = texts(reader.headers().map_err(|e| refused(&e))?);
        let keys = keys.iter().map(|key| key.trim_start_matches('\u{feff}').to_string()).collect();
        let rows: Result<Vec<_>, _> = reader.records().map(|record| record.map(|record| texts(&record))).collect();
        let points = Self::table(keys, rows.map_err(|e| refused(&e))?)?;
        if points.is_empty() {
            return Err(refused(&"there is no line below the keys"));
        }
        Ok(points)
    }

    fn checked(self, count: Option<usize>) -> Result<Self, Diagnostic> {
        if count.is_none_or(|count| count > MOST_RUNS) {
            let message = format!("the study has more than {MOST_RUNS} runs");
            return Err(bad(message).help("vary fewer keys, or with fewer values"));
        }
        let mut seen = HashSet::new();
        for key in &self.keys {
            if key.is_empty() {
                return Err(bad("a key of the points is empty".into()).help("write it as in `--set KEY=VALUE`"));
            }
            if !seen.insert(key) {
                return Err(bad(format!("`{key}` is varied twice")).help("give all its values in one place"));
            }
        }
        Ok(self)
    }

    /// The keys, as in `--set KEY=VALUE`.
    #[must_use]
    pub fn keys(&self) -> &[String] {
        &self.keys
    }

    /// Number of runs.
    #[must_use]
    pub fn len(&self) -> usize {
        match &self.values {
            Values::Grid(all) => all.iter().map(Vec::len).product(),
            Values::Table(rows) => rows.len(),
        }
    }

    /// Whether there is no run at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values of run number `number`, from zero, one per key.
    ///
    /// # Panics
    /// Where there is no such run.
    #[must_use]
    pub fn values(&self, number: usize) -> Vec<String> {
        let all = match &self.values {
            Values::Table(rows) => return rows[number].clone(),
            Values::Grid(all) => all,
        };
        assert!(number < self.len(), "there is no run {number}");
        let mut rest = number;
        let mut values: Vec<String> = all
            .iter()
            .rev()
            .map(|values| {
                let value = values[rest % values.len()].clone();
                rest /= values.len();
                value
            })
            .collect();
        values.reverse();
        values
    }

    /// The changes of the scene that make this run: as arguments of `odyn run --set` they repeat it alone.
    pub fn changes(&self, number: usize) -> impl Iterator<Item = Override> {
        self.keys.iter().zip(self.values(number)).map(|(key, value)| Override::new(format!("{key}={value}")))
    }

    /// The SHA-256 of the keys and all values.
    pub(super) fn checksum(&self) -> String {
        let mut bytes = Vec::new();
        let (Values::Grid(lists) | Values::Table(lists)) = &self.values;
        for list in std::iter::once(&self.keys).chain(lists) {
            // Numbers keep lists, and lengths keep texts apart.
            bytes.extend((list.len() as u64).to_le_bytes());
            for text in list {
                bytes.extend((text.len() as u64).to_le_bytes());
                bytes.extend(text.as_bytes());
            }
        }
        let kind = if matches!(self.values, Values::Grid(_)) { "grid" } else { "table" };
        checksum(&[kind.as_bytes(), &bytes].concat())
    }
}

fn bad(message: String) -> Diagnostic {
    Diagnostic::error(codes::BAD_OVERRIDE, message)
}
