//! [`Table`]: a CSV table of numbers read back.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use odyn_scene::{column_of_times, unit_of_times, with_commas};
use serde::Deserialize;

use super::seal::checksum_of_file;
use super::{RESULTS_FILE, ResultsError, SUMMARY_FILE};

/// Numbers of a table that are kept, all columns together; 8 bytes each.
const MOST_NUMBERS: usize = 100_000_000;
/// Bytes of a file that are read.
const LONGEST: u64 = 2 << 30;
/// Files up to this many bytes are taken into memory as a whole.
const SHORT: u64 = 64 << 20;

/// Columns of numbers over times.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Times, not descending.
    pub times: Vec<f64>,
    /// Names of the other columns, all different, in the order of the file.
    pub names: Vec<String>,
    /// Their values, each as long as `times`.
    pub columns: Vec<Vec<f64>>,
    /// The unit of the times where their column names one, `t [ms]`; only what [`Table::measured`] gives has one.
    pub time_unit: Option<String>,
}

impl Table {
    /// Reads a table: lines that start with `#` and empty lines are skipped; the first other line has the names, one of
    /// them `t` or `time`; every further line has a number per column. Between them are commas; or semicolons, tabs or blanks, in tables
    /// of up to 64 MB. In a folder of results, a last line without an end is
    /// skipped: a run that is killed may leave a part of one.
    ///
    /// The `results.csv` of a run that has ended is what its run wrote: `summary.json` beside it has the checksum.
    ///
    /// # Errors
    /// [`ResultsError::Read`] or [`ResultsError::NotATable`] with the line of the first mistake, or a table that is too large
    /// to be kept (1e8 numbers, 2 GB); [`ResultsError::Changed`] where it is not what its run wrote.
    pub fn read(path: &Path) -> Result<Self, ResultsError> {
        Self::read_at_most(path, MOST_NUMBERS, LONGEST)
    }

    /// The same of what was measured: the name of the times may have a unit behind it, in brackets.
    ///
    /// # Errors
    /// As for [`Table::read`].
    pub fn measured(path: &Path) -> Result<Self, ResultsError> {
        Self::read_any(path, MOST_NUMBERS, LONGEST, &|_| true)
    }

    /// The same; columns that are not `wanted` stay empty where the table is a plain one.
    ///
    /// # Errors
    /// As for [`Table::read`]; mistakes in columns that are not wanted may go unseen.
    pub fn read_columns(path: &Path, wanted: impl Fn(&str) -> bool) -> Result<Self, ResultsError> {
        Self::read_wanted(path, MOST_NUMBERS, LONGEST, &wanted)
    }

    /// The same as [`Table::read`] with other bounds on its numbers and bytes.
    pub(super) fn read_at_most(path: &Path, most: usize, longest: u64) -> Result<Self, ResultsError> {
        Self::read_wanted(path, most, longest, &|_| true)
    }

    /// The names of the columns beside the times; `None` where that is not found out by the beginning of the file.
    #[must_use]
    pub fn columns_of(path: &Path) -> Option<Vec<String>> {
        const BEGINNING: u64 = 8 << 10;
        let mut bytes = Vec::new();
        File::open(path).ok()?.take(BEGINNING).read_to_end(&mut bytes).ok()?;
        let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(&bytes[..], |end| &bytes[..=end]);
        let text = with_commas(std::str::from_utf8(whole).ok()?).into_owned();
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::Headers).from_reader(text.as_bytes());
        let mut names: Vec<String> = reader.headers().ok()?.iter().map(str::to_owned).collect();
        names.remove(key_column(&names).ok()?);
        Some(names)
    }

    fn read_wanted(
        path: &Path,
        most: usize,
        longest: u64,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Self, ResultsError> {
        let table = Self::read_any(path, most, longest, wanted)?;
        match &table.time_unit {
            Some(unit) => Err(not_a_table(
                path,
                None,
                format!(
                    "its times have a unit of their own, `{unit}`; here they are in that of the other table, under `t` alone"
                ),
            )),
            None => Ok(table),
        }
    }

    fn read_any(path: &Path, most: usize, longest: u64, wanted: &dyn Fn(&str) -> bool) -> Result<Self, ResultsError> {
        let open = || {
            let mut file = File::open(path)?;
            let of_run = path.file_name().is_some_and(|name| name == RESULTS_FILE);
            let is_told = of_run && path.with_file_name(SUMMARY_FILE).exists();
            let told = if is_told { whole_lines(&mut file)? } else { u64::MAX };
            Ok(file.take(longest.min(told)))
        };
        let unreadable = |cause| ResultsError::Read { path: path.to_path_buf(), cause };
        if let Some(noted) = noted_checksum(path)?
            && noted != checksum_of_file(path).map_err(unreadable)?
        {
            return Err(changed(
                path,
                format!("its checksum is not the one in `{SUMMARY_FILE}`: it was damaged, or edited"),
            ));
        }
        let mut file = open().map_err(unreadable)?;
        let cut = file.limit() == longest;
        let length = file.get_ref().metadata().ok().filter(fs::Metadata::is_file).map_or(u64::MAX, |data| data.len());
        if length < SHORT.min(longest) {
            // One more, so that the end of the file is seen without room for what follows.
            let mut text = String::with_capacity(length as usize + 1);
            if file.read_to_string(&mut text).is_ok() {
                let text = with_commas(&text);
                return match Self::of_plain(&text, most, wanted) {
                    Some(table) => Ok(table),
                    None => Self::of_any(path, text.as_bytes(), most),
                };
            }
            file = open().map_err(unreadable)?;
        }
        let table = Self::of_any(path, &mut file, most)?;
        if cut && file.limit() == 0 {
            return Err(not_a_table(path, None, format!("it is longer than {longest:e} bytes")));
        }
        Ok(table)
    }

    /// A table without quotes or mistakes; `None` where there is more to be said of it.
    fn of_plain(text: &str, most: usize, wanted: &dyn Fn(&str) -> bool) -> Option<Self> {
        let ends_line = |(at, _): (usize, &str)| text[at + 1..].starts_with('\n');
        if text.contains('"') || text.starts_with('\u{feff}') || !text.match_indices('\r').all(ends_line) {
            return None;
        }
        let lines = text.split('\n').map(|line| line.strip_suffix('\r').unwrap_or(line));
        let mut lines = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
        let names: Vec<String> = lines.next()?.split(',').map(|name| name.trim().to_owned()).collect();
        let key = key_column(&names).ok()?;
        let takes: Vec<bool> = names.iter().enumerate().map(|(k, name)| k == key || wanted(name)).collect();
        let mut columns = vec![Vec::new(); names.len()];
        let mut kept = 0;
        for line in lines {
            kept += names.len();
            if kept > most {
                return None;
            }
            let mut rest = line;
            for (k, column) in columns.iter_mut().enumerate() {
                // Fields are short: byte by byte is faster than what searches long texts.
                let end = rest.bytes().position(|byte| byte == b',').unwrap_or(rest.len());
                if takes[k] {
                    column.push(rest[..end].trim_ascii().parse::<f64>().ok()?);
                }
                match (end == rest.len(), k + 1 == takes.len()) {
                    (true, true) => rest = "",
                    (false, false) => rest = &rest[end + 1..],
                    // A field is missing, or there is one too many.
                    _ => return None,
                }
            }
            check_order(&columns[key]).ok()?;
        }
        Some(Self::of_columns(names, key, columns))
    }

    /// Any table, or what is wrong with it.
    fn of_any(path: &Path, text: impl Read, most: usize) -> Result<Self, ResultsError> {
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::Headers).from_reader(text);
        let header = reader.headers().map_err(|error| csv_error(path, error))?;
        let names: Vec<String> = header.iter().map(str::to_owned).collect();
        let key = key_column(&names).map_err(|reason| not_a_table(path, None, reason))?;
        let mut columns = vec![Vec::new(); names.len()];
        let mut record = csv::ByteRecord::new();
        let mut kept = 0;
        while reader.read_byte_record(&mut record).map_err(|error| csv_error(path, error))? {
            let line = record.position().map(csv::Position::line);
            kept += names.len();
            if kept > most {
                return Err(not_a_table(path, line, format!("it has more than {most:e} numbers")));
            }
            for ((field, name), column) in record.iter().zip(&names).zip(&mut columns) {
                let Ok(field) = std::str::from_utf8(field) else {
                    return Err(not_a_table(path, line, "it is not UTF-8 text".into()));
                };
                let field = field.trim();
                let number = field.parse::<f64>().map_err(|_| {
                    let comma = field.replace(',', ".").parse::<f64>().is_ok();
                    let decimals = if comma { "; decimals follow a point, `1.5`" } else { "" };
                    not_a_table(path, line, format!("`{name}` is `{field}`, not a number{decimals}"))
                });
                column.push(number?);
            }
            check_order(&columns[key]).map_err(|reason| not_a_table(path, line, reason))?;
        }
        Ok(Self::of_columns(names, key, columns))
    }

    /// The table of these columns, the one with the times among them.
    fn of_columns(mut names: Vec<String>, key: usize, mut columns: Vec<Vec<f64>>) -> Self {
        let time_unit = unit_of_times(&names.remove(key)).flatten().map(str::to_owned);
        Self { times: columns.remove(key), names, columns, time_unit }
    }

    /// The values of a column.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let index = self.names.iter().position(|own| own == name)?;
        Some(&self.columns[index])
    }
}

/// The checksum that a run noted of its table; `None` if it is no table of a run, or the run has not ended.
fn noted_checksum(path: &Path) -> Result<Option<String>, ResultsError> {
    #[derive(Deserialize)]
    struct Noted {
        results_sha256: Option<String>,
    }
    let summary = path.with_file_name(SUMMARY_FILE);
    if path.file_name().is_none_or(|name| name != RESULTS_FILE) || !summary.exists() {
        return Ok(None);
    }
    let damaged = |reason: String| {
        let reason = format!("its checksum can't be had from `{SUMMARY_FILE}` beside it: {reason}");
        changed(path, reason)
    };
    let text = std::fs::read_to_string(&summary).map_err(|error| damaged(error.to_string()))?;
    let noted: Noted = serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
    Ok(noted.results_sha256)
}

/// Bytes up to the end of the last line that has one.
fn whole_lines(file: &mut File) -> io::Result<u64> {
    let mut block = [0; 4096];
    let mut end = file.seek(SeekFrom::End(0))?;
    while end > 0 {
        let start = end.saturating_sub(block.len() as u64);
        let part = &mut block[..(end - start) as usize];
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(part)?;
        if let Some(at) = part.iter().rposition(|byte| *byte == b'\n') {
            end = start + at as u64 + 1;
            break;
        }
        end = start;
    }
    file.rewind()?;
    Ok(end)
}

/// Which column has the times; the error says what is wrong with the names.
fn key_column(names: &[String]) -> Result<usize, String> {
    if let Some(name) = names.iter().enumerate().find_map(|(k, name)| names[..k].contains(name).then_some(name)) {
        return Err(format!("two columns are called `{name}`"));
    }
    column_of_times(names).ok_or_else(|| match names {
        [] => "it is empty".into(),
        _ => "no column is called `t` or `time`".into(),
    })
}

/// Whether the last time follows on the one before; the error says what is wrong.
fn check_order(times: &[f64]) -> Result<(), String> {
    match times {
        [.., now] if !now.is_finite() => Err(format!("{now} is not a time")),
        [.., before, now] if now < before => Err(format!("the time goes back from {before} to {now}")),
        _ => Ok(()),
    }
}

/// A table that is not what it was at the end of its run.
fn changed(path: &Path, reason: String) -> ResultsError {
    let help = "run again; or, where it was edited on purpose, copy it to a folder without `summary.json`";
    ResultsError::Changed { path: path.to_path_buf(), reason, help }
}

fn not_a_table(path: &Path, line: Option<u64>, reason: String) -> ResultsError {
    ResultsError::NotATable { path: path.to_path_buf(), line, reason }
}

fn csv_error(path: &Path, error: csv::Error) -> ResultsError {
    let line = error.position().map(csv::Position::line);
    match error.into_kind() {
        csv::ErrorKind::Io(cause) => ResultsError::Read { path: path.to_path_buf(), cause },
        csv::ErrorKind::Utf8 { .. } => not_a_table(path, line, "it is not UTF-8 text".into()),
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            not_a_table(path, line, format!("{len} columns instead of {expected_len}"))
        }
        other => not_a_table(path, line, format!("{other:?}")),
    }
}
