//! [`Shard`]: a part of a study, done by itself, on whichever machine.
//!
//! A shard has runs that follow each other. When all have ended it is two files or three: `part-00017-of-00064.csv`, its rows of the
//! table, and beside it `part-00017-of-00064.json`, which says what study it is of and what the checksum of the rows is; and where
//! series are kept, `series-00017-of-00064.csv`. All come by a rename, the rows last: what is there is whole.

use std::fmt;
use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::head::Head;
use crate::diagnostics::{Diagnostic, codes};
use crate::results::{ResultsError, checksum, checksum_of_file, replace};

/// Number `index` of `count` parts of a study, from one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    index: usize,
    count: usize,
}

/// More parts than this are taken for a mistake; their names have five digits.
pub const MOST_SHARDS: usize = 99_999;

impl Shard {
    /// None unless 1 <= `index` <= `count` <= [`MOST_SHARDS`].
    #[must_use]
    pub fn new(index: usize, count: usize) -> Option<Self> {
        ((1..=count).contains(&index) && count <= MOST_SHARDS).then_some(Self { index, count })
    }

    /// Its number, from one.
    #[must_use]
    pub fn index(&self) -> usize {
        self.index
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// The runs that it has, of so many, by their numbers from zero. Every run is in one shard, and no shard has two runs more than
    /// another.
    #[must_use]
    pub fn range(&self, runs: usize) -> Range<usize> {
        let end = |index: usize| (runs as u128 * index as u128 / self.count as u128) as usize;
        end(self.index - 1)..end(self.index)
    }

    /// `part-00017-of-00064`
    fn stem(&self) -> String {
        format!("part-{:05}-of-{:05}", self.index, self.count)
    }

    /// Its rows.
    pub(super) fn rows_file(&self, folder: &Path) -> PathBuf {
        folder.join(self.stem() + ".csv")
    }

    /// Its series, where some are kept. The name does not match `part-*.csv`.
    pub(super) fn series_file(&self, folder: &Path) -> PathBuf {
        folder.join(format!("series-{:05}-of-{:05}.csv", self.index, self.count))
    }

    /// Its journal, while it is not complete.
    pub(super) fn journal_file(&self, folder: &Path) -> PathBuf {
        folder.join(self.stem() + ".journal")
    }

    fn record_file(&self, folder: &Path) -> PathBuf {
        folder.join(self.stem() + ".json")
    }

    /// That of a file of rows, by its name.
    fn of_rows_file(name: &str) -> Option<Self> {
        let (index, count) = name.strip_prefix("part-")?.strip_suffix(".csv")?.split_once("-of-")?;
        let shard = Self::new(index.parse().ok()?, count.parse().ok()?)?;
        (shard.stem() + ".csv" == name).then_some(shard)
    }
}

impl FromStr for Shard {
    type Err = String;

    /// Reads `17/64`.
    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse::<usize>().ok();
        let shard = text.split_once('/').and_then(|(index, count)| Self::new(number(index)?, number(count)?));
        shard.ok_or_else(|| {
            format!("write it as 17/64: the number of the part, from 1, and how many there are, at most {MOST_SHARDS}")
        })
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// What stands beside the rows of a shard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    pub(super) study: Head,
    shard: Shard,
    /// SHA-256 of the rows' file.
    sha256: String,
    /// SHA-256 of that of the series.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    series_sha256: Option<String>,
    /// That of its first run that has one, see [`super::Study::exit_code`].
    pub(super) exit_code: i32,
}

/// Writes the two files of a shard.
pub(super) fn write_part(
    folder: &Path,
    shard: Shard,
    study: &Head,
    rows: &[u8],
    exit_code: i32,
) -> Result<PathBuf, ResultsError> {
    let path = shard.rows_file(folder);
    let record = shard.record_file(folder);
    let series = shard.series_file(folder);
    let series_sha256 = study.series().then(|| checksum_of_file(&series)).transpose();
    let series_sha256 = series_sha256.map_err(|cause| ResultsError::write(&series, cause))?;
    // Rows without a record, or with that of others, are no part: none are there while the record changes.
    match fs::remove_file(&path) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => return Err(ResultsError::write(&path, cause)),
        _ => {}
    }
    let sealed = Record { study: study.clone(), shard, sha256: checksum(rows), series_sha256, exit_code };
    let text = serde_json::to_string(&sealed).map_err(|cause| ResultsError::write(&record, cause.into()))?;
    replace(&record, (text + "\n").as_bytes(), true)?;
    replace(&path, rows, true)?;
    Ok(path)
}

/// The rows of a shard, and what stands beside them; nothing if the shard is not complete.
///
/// # Errors
/// Files that cannot be read, or that do not belong to each other.
pub(super) fn read_part(folder: &Path, shard: Shard) -> Result<Option<(Record, Vec<u8>)>, Box<Diagnostic>> {
    let path = shard.rows_file(folder);
    let refused = |what: String| {
        let message = format!("{} is no part of a study: {what}", path.display());
        let help = format!("remove it, and do it again: `odyn study ... --shard {shard}`");
        Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help(help))
    };
    let rows = match fs::read(&path) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(None),
        read => read.map_err(|cause| refused(cause.to_string()))?,
    };
    let record = shard.record_file(folder);
    let name = record.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let text =
        fs::read_to_string(&record).map_err(|cause| refused(format!("cannot read `{name}` beside it: {cause}")))?;
    let record: Record = serde_json::from_str(&text)
        .map_err(|cause| refused(format!("`{name}` beside it cannot be understood: {cause}")))?;
    if record.sha256 != checksum(&rows) || record.shard != shard {
        return Err(refused(format!("it is not what `{name}` beside it says; one of the two was changed")));
    }
    Ok(Some((record, rows)))
}

/// That the series of a shard are those that its record is of.
///
/// # Errors
/// A file that is missing, or was changed.
pub(super) fn check_series(folder: &Path, record: &Record) -> Result<(), Box<Diagnostic>> {
    let Some(noted) = &record.series_sha256 else { return Ok(()) };
    let path = record.shard.series_file(folder);
    let what = match checksum_of_file(&path) {
        Ok(found) if found == *noted => return Ok(()),
        Ok(_) => "they are not what the record of the part says; one of the two was changed".to_string(),
        Err(cause) => cause.to_string(),
    };
    let message = format!("{} has no series of a part: {what}", path.display());
    let help = format!("remove the part, and do it again: `odyn study ... --shard {}`", record.shard);
    Err(Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help(help)))
}

/// That a shard is of the study that the parts in its folder are of.
///
/// # Errors
/// A part of another one, or of another division of this one.
pub(super) fn check_others(folder: &Path, shard: Shard, study: &Head) -> Result<(), Box<Diagnostic>> {
    let refused = |other: Shard, what: String| {
        let message = format!("{} is no folder for this shard: part {other} there {what}", folder.display());
        let help = "write elsewhere with `-o DIR`; or remove the parts that are there";
        Err(Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help(help)))
    };
    // The shard itself is done anew. One of the others stands for all; they are compared with each other when they are merged.
    let others = parts(folder).unwrap_or_default();
    let Some(other) = others.into_iter().find(|other| *other != shard) else { return Ok(()) };
    if other.count != shard.count {
        return refused(other, format!("is one of {}, not of {}", other.count, shard.count));
    }
    match read_part(folder, other)? {
        Some((record, _)) => match record.study.difference(study) {
            Some(difference) => refused(other, format!("is of another study: {difference}")),
            None => Ok(()),
        },
        None => Ok(()),
    }
}

/// The shards that have files of rows in a folder.
pub(super) fn parts(folder: &Path) -> io::Result<Vec<Shard>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        found.extend(entry?.file_name().to_str().and_then(Shard::of_rows_file));
    }
    found.sort_unstable_by_key(|shard| (shard.count, shard.index));
    Ok(found)
}
