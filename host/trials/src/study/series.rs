//! [`Series`]: outputs over time that a study keeps of every run, at some of its samples.
//!
//! In the journal they are in the line of their run; at the end they are a table with a row per run and sample, `series.csv`, or
//! `series-00017-of-00064.csv` of a shard. At no time is more of them in memory than those of the runs under way.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::journal::{Closed, read_entry};
use super::shard::Shard;
use super::table::{number, titled};
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::results::{ChannelInfo, ResultsError, replace_with};
use crate::session::RunReport;

/// Name of the table of series in the folder of a study.
pub const SERIES_FILE: &str = "series.csv";

/// Which outputs, at which samples of a run; nothing between samples is made up.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Series {
    /// Names of outputs; all of them where there are none.
    outputs: Vec<String>,
    take: Taken,
}

/// Samples that are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Taken {
    /// The first one, and every so-manieth from there; 1: all.
    Every(usize),
    /// So many, spread evenly, the first and the last among them; all where a run has no more.
    Spread(usize),
}

impl Series {
    /// Outputs as they are listed, `x_p, theta`; `*` for all.
    ///
    /// # Errors
    /// No output, one that is there twice; no sample.
    pub fn parse(outputs: &[impl AsRef<str>], take: Taken) -> Result<Self, Diagnostic> {
        let names = outputs.iter().flat_map(|list| list.as_ref().split(','));
        let mut names: Vec<String> = names.map(|name| name.trim().to_string()).collect();
        if names.iter().any(String::is_empty) || names.is_empty() {
            return Err(bad("a series is of outputs, and one has no name".into())
                .help("write `--series x_p,theta`, or `--series '*'` for all"));
        }
        if let Some(k) = (1..names.len()).find(|k| names[..*k].contains(&names[*k])) {
            return Err(bad(format!("`{}` is a series twice", names[k])).help("name each output once"));
        }
        if names.iter().any(|name| name == "*") {
            names.clear();
        }
        match take {
            Taken::Every(0) => Err(bad("every 0th sample is none".into()).help("1 keeps all of them")),
            Taken::Spread(0 | 1) => {
                Err(bad("a series has two samples or more".into())
                    .help("the last values are in the table of the study"))
            }
            Taken::Every(_) | Taken::Spread(_) => Ok(Self { outputs: names, take }),
        }
    }

    /// That these can be kept of runs with `known` outputs, if any are known.
    ///
    /// # Errors
    /// An output that is not there; no journal that would keep them.
    pub(super) fn check<'a>(
        &self,
        journal: bool,
        known: Option<impl Iterator<Item = &'a str> + Clone>,
    ) -> Result<(), Box<Diagnostic>> {
        if !journal {
            let help = "give the study a folder for its journal";
            return Err(Box::new(bad("series are kept in the journal of a study, and it has none".into()).help(help)));
        }
        let Some(known) = known else { return Ok(()) };
        let Some(unknown) = self.outputs.iter().find(|name| !known.clone().any(|one| one == name.as_str())) else {
            return Ok(());
        };
        let nearest = suggest(unknown, known.clone()).map(|nearest| format!("did you mean `{nearest}`?"));
        let all = || format!("known are {}", known.collect::<Vec<_>>().join(", "));
        Err(Box::new(
            Diagnostic::error(codes::UNKNOWN_CHANNEL, format!("there is no output `{unknown}` to keep over time"))
                .help(nearest.unwrap_or_else(all)),
        ))
    }

    /// Those of a run.
    pub(super) fn of(&self, run: usize, report: &RunReport) -> Curves {
        let wanted = |channel: &ChannelInfo| self.outputs.is_empty() || self.outputs.contains(&channel.name);
        let kept: Vec<(&ChannelInfo, &Vec<f64>)> =
            report.channels.iter().zip(&report.columns).filter(|(channel, _)| wanted(channel)).collect();
        let mut titles = vec![titled(ChannelInfo::TIME, &report.time.unit)];
        titles.extend(kept.iter().map(|(channel, _)| titled(&channel.name, &channel.unit)));
        let mut rows = String::new();
        for sample in self.take.of(report.times.len()) {
            rows.push_str(&format!("{},{}", run + 1, number(report.times[sample])));
            for (_, column) in &kept {
                rows.push(',');
                rows.push_str(&number(column[sample]));
            }
            rows.push('\n');
        }
        Curves { titles, rows }
    }
}

impl Taken {
    /// Those of so many.
    pub(super) fn of(self, samples: usize) -> impl Iterator<Item = usize> {
        let (count, place): (usize, Box<dyn Fn(usize) -> usize>) = match self {
            Self::Every(step) => (samples.div_ceil(step), Box::new(move |k| k * step)),
            Self::Spread(count) if count >= samples => (samples, Box::new(|k| k)),
            // To the nearest one; there are more samples than are kept, so none is taken twice.
            Self::Spread(count) => (count, Box::new(move |k| (2 * k * (samples - 1) + count - 1) / (2 * (count - 1)))),
        };
        (0..count).map(place)
    }
}

fn bad(message: String) -> Diagnostic {
    Diagnostic::error(codes::BAD_SERIES, message)
}

/// The series of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Curves {
    /// What stands above its cells, but for the number of the run.
    pub(super) titles: Vec<String>,
    /// Lines of the table, each with the number of the run and a cell per title.
    pub(super) rows: String,
}

/// Titles of several runs or parts: those of the first, then what only the others have.
fn union<'a>(all: impl Iterator<Item = &'a [String]>) -> Vec<String> {
    let mut titles: Vec<String> = Vec::new();
    for title in all.flatten() {
        if !titles.contains(title) {
            titles.push(title.clone());
        }
    }
    titles
}

/// The first line of a table.
fn header(titles: &[String]) -> io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(std::iter::once("run").chain(titles.iter().map(String::as_str)))?;
    writer.into_inner().map_err(|error| error.into_error())
}

/// Copies lines with `titles` under a header with `all` titles. Their cells are numbers, so commas are between them only.
fn copy(mut lines: impl BufRead, titles: &[String], all: &[String], to: &mut impl Write) -> io::Result<()> {
    if titles == all {
        return io::copy(&mut lines, to).map(drop);
    }
    let from: Vec<Option<usize>> = all.iter().map(|title| titles.iter().position(|own| own == title)).collect();
    for line in lines.lines() {
        let line = line?;
        let cells: Vec<&str> = line.split(',').collect();
        to.write_all(cells[0].as_bytes())?;
        for place in &from {
            to.write_all(b",")?;
            to.write_all(place.and_then(|place| cells.get(place + 1)).unwrap_or(&"").as_bytes())?;
        }
        to.write_all(b"\n")?;
    }
    Ok(())
}

/// Where the series of a study, or of a part of it, are.
pub(super) fn file(folder: &Path, shard: Option<Shard>) -> PathBuf {
    shard.map_or_else(|| folder.join(SERIES_FILE), |shard| shard.series_file(folder))
}

/// Writes those of the runs that a journal has, in their order.
pub(super) fn write(path: &Path, journal: &Closed) -> Result<(), ResultsError> {
    let all = union(journal.places.values().map(|place| place.titles.as_slice()));
    replace_with(path, true, |file| {
        let mut to = BufWriter::new(file);
        to.write_all(&header(&all)?)?;
        for place in journal.places.values() {
            let curves = read_entry(&journal.file, place)?;
            copy(curves.rows.as_bytes(), &curves.titles, &all, &mut to)?;
        }
        to.flush()
    })
}

/// Makes one table of those of all parts.
pub(super) fn merge(folder: &Path, parts: &[Shard]) -> Result<PathBuf, ResultsError> {
    let path = folder.join(SERIES_FILE);
    let open = |shard: &Shard| -> io::Result<(Vec<String>, BufReader<File>)> {
        let mut lines = BufReader::with_capacity(1 << 16, File::open(shard.series_file(folder))?);
        let mut first = Vec::new();
        lines.read_until(b'\n', &mut first)?;
        let mut reader = csv::Reader::from_reader(first.as_slice());
        Ok((reader.headers()?.iter().skip(1).map(str::to_string).collect(), lines))
    };
    let failed = |cause| ResultsError::write(&path, cause);
    let titles: Vec<Vec<String>> =
        parts.iter().map(|shard| open(shard).map(|(titles, _)| titles)).collect::<io::Result<_>>().map_err(failed)?;
    let all = union(titles.iter().map(Vec::as_slice));
    replace_with(&path, true, |file| {
        let mut to = BufWriter::new(file);
        to.write_all(&header(&all)?)?;
        for shard in parts {
            let (titles, lines) = open(shard)?;
            copy(lines, &titles, &all, &mut to)?;
        }
        to.flush()
    })?;
    Ok(path)
}

/// Removes a table of series that another study left: beside a new table, it would be taken for its.
pub(super) fn remove(path: &Path) -> Result<(), ResultsError> {
    match fs::remove_file(path) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => Err(ResultsError::write(path, cause)),
        _ => Ok(()),
    }
}
