//! [`merge`]: one table of all shards of a study.

use std::path::{Path, PathBuf};

use super::head::Head;
use super::journal::STUDY_FILE;
use super::series;
use super::shard;
use super::table::{StudyTable, Titles};
use crate::diagnostics::{Diagnostic, codes};
use crate::results::replace;

/// The table of a whole study, made of its parts.
#[derive(Debug)]
pub struct Merged {
    /// Where it is.
    pub path: PathBuf,
    /// The table.
    pub table: StudyTable,
    /// Where the series are, if the study keeps some.
    pub series: Option<PathBuf>,
    /// Number of parts.
    pub parts: usize,
    /// As [`super::Study::exit_code`] of the whole study.
    pub exit_code: i32,
}

/// Makes the table of a study of the parts in a folder, all of which must be there, and writes it into the folder: the same bytes
/// as those of the study in one.
///
/// # Errors
/// Parts that are missing, damaged, of several studies or of several divisions of one; a table that can't be written.
pub fn merge(folder: &Path) -> Result<Merged, Box<Diagnostic>> {
    let refused = |what: String, help: &str| {
        let message = format!("cannot merge the parts in {}: {what}", folder.display());
        Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help(help))
    };
    let found = shard::parts(folder).map_err(|cause| {
        let unread = refused(cause.to_string(), "name the folder of the study");
        Box::new(Diagnostic { code: codes::CANNOT_READ_RESULTS, ..*unread })
    })?;
    let (Some(first), Some(last)) = (found.first(), found.last()) else {
        let help = "parts are written by `odyn study ... --shard 1/4 -o DIR`, each when all of its runs have ended";
        return Err(refused("there are none".into(), help));
    };
    let count = first.count();
    if count != last.count() {
        let what = format!("there are parts of {count} and parts of {}", last.count());
        return Err(refused(what, "remove those of one division"));
    }
    let missing: Vec<usize> = (1..=count).filter(|index| !found.iter().any(|shard| shard.index() == *index)).collect();
    if !missing.is_empty() {
        let help = "a part that was interrupted continues with its command and `--resume`";
        return Err(refused(format!("{} of {count} are missing: {}", missing.len(), ranges(&missing)), help));
    }
    let mut whole: Option<(Head, i32)> = None;
    let mut parts = Vec::with_capacity(count);
    for shard in &found {
        let shard = *shard;
        let (record, rows) = shard::read_part(folder, shard)?
            .ok_or_else(|| refused(format!("part {shard} was removed meanwhile"), "do it again"))?;
        shard::check_series(folder, &record)?;
        let (study, exit_code) = whole.get_or_insert_with(|| (record.study.clone(), 0));
        if let Some(difference) = record.study.difference(study) {
            let what = format!("part {shard} is of another study than part {first}: {difference}");
            return Err(refused(what, "do one of them again; parts of one study have a folder of their own"));
        }
        if *exit_code == 0 {
            *exit_code = record.exit_code;
        }
        let table = StudyTable::read(&rows, study.keys())
            .map_err(|what| refused(format!("part {shard}: {what}"), "do it again"))?;
        parts.push((shard, table));
    }
    let Some((study, exit_code)) = whole else { return Err(refused("there are none".into(), "do the study again")) };
    let titles: Titles = parts.iter().fold(Titles::default(), |all, (_, part)| all.and(&part.titles()));
    let mut table = StudyTable::empty(study.keys(), &titles);
    for (shard, part) in &parts {
        table.append(part);
        if table.rows.len() != shard.range(study.runs()).end {
            return Err(refused(format!("part {shard} does not have the runs that it should"), "do it again"));
        }
    }
    let written = match study.series() {
        true => series::merge(folder, &found).map(Some),
        false => series::remove(&series::file(folder, None)).map(|()| None),
    };
    let series = written.map_err(|error| Box::new(error.diagnostic()))?;
    let path = folder.join(STUDY_FILE);
    replace(&path, table.csv().as_bytes(), true).map_err(|error| Box::new(error.diagnostic()))?;
    Ok(Merged { path, table, series, parts: count, exit_code })
}

/// `1, 3-7, 9`
fn ranges(numbers: &[usize]) -> String {
    let mut all: Vec<(usize, usize)> = Vec::new();
    for number in numbers {
        match all.last_mut() {
            Some((_, last)) if *last + 1 == *number => *last = *number,
            _ => all.push((*number, *number)),
        }
    }
    let text =
        |(first, last): &(usize, usize)| if first == last { first.to_string() } else { format!("{first}-{last}") };
    all.iter().map(text).collect::<Vec<_>>().join(", ")
}
