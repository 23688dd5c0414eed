//! [`Event`]: what happened to contacts, as rows of `events.csv`.

use std::borrow::Cow;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::Written;
use super::error::ResultsError;
use super::seal::Checksum;

/// Name of the file in a folder of results.
pub const EVENTS_FILE: &str = "events.csv";

/// The first line of the file.
const HEADER: &str = "time,element,kind,row,rate_before,rate_after,impulse,energy_lost";

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EventKind {
    /// A contact struck.
    Impact,
    /// A contact stays closed from here on.
    Closes,
    /// A closed contact opens.
    Opens,
    /// A row that holds up to a limit sticks from here on.
    Sticks,
    /// It begins to slide, or to slide the other way.
    Slides,
    /// From here on it creeps: friction is viscous below the errors of velocities, since it stuck and slid over and over.
    Creeps,
    /// A joint or a force lets go of its bodies, for good; the row says what decided.
    Releases,
    /// The memory of an element jumps; the row says to what.
    Switches,
    /// From here on rigid bodies do not determine its reaction; the row says which part. Told once.
    Indeterminate,
    /// From here on it slides with a limit that depends on such a reaction, and the motion on it. Told once.
    Ambiguous,
}

impl EventKind {
    /// Its name in the file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Impact => "impact",
            Self::Closes => "closes",
            Self::Opens => "opens",
            Self::Sticks => "sticks",
            Self::Slides => "slides",
            Self::Creeps => "creeps",
            Self::Releases => "releases",
            Self::Switches => "switches",
            Self::Indeterminate => "indeterminate",
            Self::Ambiguous => "ambiguous",
        }
    }
}

/// What happened to a unilateral row at an instant, SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// s
    pub time: f64,
    /// The element's name.
    pub element: String,
    /// The row's name.
    pub row: String,
    /// What.
    pub kind: EventKind,
    /// Rate of the row before and after an impact: m/s for a distance.
    pub rates: [f64; 2],
    /// Impulse along the row: N s for a distance.
    pub impulse: f64,
    /// Energy lost in it, J.
    pub lost: f64,
}

impl Event {
    /// The row without the value that it may have at the event (`force = 25 N`), which differs from run to run.
    #[must_use]
    pub fn name_of_row(&self) -> &str {
        self.row.split_once(" = ").map_or(&self.row, |(name, _)| name)
    }

    /// Elements and rows that something happened to, each with the first time, s.
    #[must_use]
    pub fn first(events: &[Self], kind: EventKind) -> Vec<([String; 2], f64)> {
        let mut found: Vec<([String; 2], f64)> = Vec::new();
        for Self { element, row, time, .. } in events.iter().filter(|event| event.kind == kind) {
            match found.iter_mut().find(|([of, at], _)| of == element && at == row) {
                Some((_, first)) => *first = first.min(*time),
                None => found.push(([element.clone(), row.clone()], *time)),
            }
        }
        found
    }
}

/// Events of a run, in memory and, where it has a folder, in its file.
#[derive(Debug, Default)]
pub struct Events {
    /// All so far.
    pub list: Vec<Event>,
    file: Option<PathBuf>,
    /// One scene unit of time, s.
    unit: f64,
}

impl Events {
    /// Begins the file of a folder; `unit` is the scene's unit of time, s.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn begin(&mut self, folder: &Path, unit: f64) -> Result<(), ResultsError> {
        let path = folder.join(EVENTS_FILE);
        std::fs::write(&path, format!("{HEADER}\n")).map_err(|cause| ResultsError::write(&path, cause))?;
        (self.file, self.unit) = (Some(path), unit);
        Ok(())
    }

    /// Continues the file of a folder with what was `kept` of it.
    ///
    /// # Errors
    /// [`ResultsError::Read`], [`ResultsError::Write`]; [`ResultsError::Changed`] if the file is not the one of the checkpoint.
    pub fn go_on(&mut self, folder: &Path, unit: f64, kept: &Written) -> Result<(), ResultsError> {
        let path = folder.join(EVENTS_FILE);
        let bytes = std::fs::read(&path).map_err(|cause| ResultsError::Read { path: path.clone(), cause })?;
        let (part, _) = kept.part_of(&path, &bytes)?;
        super::replace(&path, part, false)?;
        (self.file, self.unit) = (Some(path), unit);
        Ok(())
    }

    /// Brings the file, if there is one, to the disk. Returns what is there.
    ///
    /// # Errors
    /// [`ResultsError::Read`], [`ResultsError::Write`].
    pub fn sync(&mut self) -> Result<Option<Written>, ResultsError> {
        self.finish()?;
        let Some(path) = &self.file else { return Ok(None) };
        let bytes = std::fs::read(path).map_err(|cause| ResultsError::Read { path: path.clone(), cause })?;
        let synced = std::fs::File::open(path).and_then(|file| file.sync_data());
        synced.map_err(|cause| ResultsError::write(path, cause))?;
        let mut checksum = Checksum::default();
        checksum.add(&bytes);
        let lines = bytes.iter().filter(|byte| **byte == b'\n').count() as u64;
        Ok(Some(Written { rows: lines.saturating_sub(1), bytes: bytes.len() as u64, sha256: checksum.hex() }))
    }

    /// Puts all in the order of their times: those of islands come as these continue.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn finish(&mut self) -> Result<(), ResultsError> {
        self.list.sort_by(|a, b| a.time.total_cmp(&b.time));
        let Some(path) = &self.file else { return Ok(()) };
        let text = std::fs::read_to_string(path).map_err(|cause| ResultsError::write(path, cause))?;
        let time = |line: &&str| line.split(',').next().and_then(|word| word.parse::<f64>().ok());
        let mut lines: Vec<&str> = text.lines().skip(1).collect();
        if lines.is_sorted_by(|a, b| time(a) <= time(b)) {
            return Ok(());
        }
        lines.sort_by(|a, b| time(a).partial_cmp(&time(b)).unwrap_or(std::cmp::Ordering::Equal));
        let text: String = std::iter::once(HEADER).chain(lines).map(|line| format!("{line}\n")).collect();
        super::replace(path, text.as_bytes(), false)
    }

    /// Those of a folder of results, whose unit of time is `unit`, s; none where it has no such file.
    ///
    /// # Errors
    /// [`ResultsError::Read`], [`ResultsError::NotATable`].
    pub fn of(folder: &Path, unit: f64) -> Result<Vec<Event>, ResultsError> {
        let path = folder.join(EVENTS_FILE);
        if path.exists() { read(&path, unit) } else { Ok(Vec::new()) }
    }

    /// All so far, also what a run that is continued has in its file.
    ///
    /// # Errors
    /// [`ResultsError::Read`], [`ResultsError::NotATable`].
    pub fn all(&self) -> Result<Cow<'_, [Event]>, ResultsError> {
        match &self.file {
            Some(path) => read(path, self.unit).map(Cow::Owned),
            None => Ok(Cow::Borrowed(&self.list)),
        }
    }

    /// Takes one more.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn take(&mut self, event: &Event) -> Result<(), ResultsError> {
        self.list.push(event.clone());
        let Some(path) = &self.file else { return Ok(()) };
        let Event { time, element, row, kind, rates: [before, after], impulse, lost } = event;
        let mut fields = vec![number(time / self.unit), element.clone(), kind.name().into(), row.clone()];
        let numbers = [*before, *after, *impulse, *lost];
        fields.extend(numbers.map(|x| if *kind == EventKind::Impact { number(x) } else { String::new() }));
        let mut line = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
        let line = line
            .write_record(&fields)
            .map_err(std::io::Error::from)
            .and_then(|()| line.into_inner().map_err(|error| std::io::Error::other(error.to_string())));
        let open = || std::fs::OpenOptions::new().append(true).open(path);
        let written = line.and_then(|line| open()?.write_all(&line));
        written.map_err(|cause| ResultsError::write(path, cause))
    }
}

/// The fewest digits that read back as the same bits; with an exponent where they would stand behind a row of zeros, or before one.
fn number(x: f64) -> String {
    match x == 0.0 || (1e-5..1e16).contains(&x.abs()) {
        true => x.to_string(),
        false => format!("{x:e}"),
    }
}

/// A line of the file.
#[derive(Deserialize)]
struct Line {
    time: f64,
    element: String,
    kind: EventKind,
    row: String,
    rate_before: Option<f64>,
    rate_after: Option<f64>,
    impulse: Option<f64>,
    energy_lost: Option<f64>,
}

/// All events of a file, but for a last line that was not written to its end.
fn read(path: &Path, unit: f64) -> Result<Vec<Event>, ResultsError> {
    let text = std::fs::read_to_string(path).map_err(|cause| ResultsError::Read { path: path.into(), cause })?;
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let event = |line: Result<Line, csv::Error>| match line {
        Ok(line) => Ok(Event {
            time: line.time * unit,
            element: line.element,
            row: line.row,
            kind: line.kind,
            rates: [line.rate_before, line.rate_after].map(Option::unwrap_or_default),
            impulse: line.impulse.unwrap_or_default(),
            lost: line.energy_lost.unwrap_or_default(),
        }),
        Err(error) => Err(ResultsError::NotATable {
            path: path.into(),
            line: error.position().map(csv::Position::line),
            reason: format!("it is not what a run writes ({error})"),
        }),
    };
    csv::Reader::from_reader(whole.as_bytes()).deserialize().map(event).collect()
}
