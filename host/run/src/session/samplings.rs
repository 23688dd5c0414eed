//! [`Samplings`]: the rows of a run in the scene's units, kept in memory and written to its folder.

use std::path::Path;

use super::checkpoint::Checkpoint;
use super::error::SessionError;
use super::opened::Session;
use super::options::Afterwards;
use super::outcome::RunReport;
use super::restart::Restart;
use super::run::Run;
use super::sink::Sink;
use crate::integrate::Flow;
use crate::results::{
    ChannelInfo, CheckResult, Event, Events, Folder, Kept, RESULTS_FILE, ResultsError, Summary, Table,
};
use crate::scene::{Dimension, SampleTime, Simulation, UnitSystem};

/// The samples of a run, where they go.
pub(super) struct Samplings {
    folder: Option<Folder>,
    /// All times at which rows are wanted.
    pub(super) times: Vec<SampleTime>,
    pub(super) channels: Vec<ChannelInfo>,
    /// The column of times.
    time: ChannelInfo,
    /// Numbers of the first row and the first event that were taken.
    first: [usize; 2],
    /// Times of the rows, scene units.
    pub(super) taken: Vec<f64>,
    pub(super) columns: Vec<Vec<f64>>,
    /// What happened to contacts.
    pub(super) events: Events,
    /// Why a row could not be written.
    pub(super) error: Option<ResultsError>,
    /// See [`Run::end_when`].
    asked: Option<Box<dyn FnMut() -> bool + Send>>,
}

impl Run<'_> {
    /// Asks behind every step, from the thread that computes, whether to end there. An advance that ends so fails, and the run is at
    /// its last step, from where it can be advanced. Nothing is asked of a run with a sink, which is told of its steps.
    pub fn end_when(&mut self, asked: Box<dyn FnMut() -> bool + Send>) {
        if let Rows::Kept(rows) = self.system.rows_taken_mut() {
            rows.asked = Some(asked);
        }
    }
}

impl Sink for Samplings {
    fn sample(&mut self, number: usize, values: &[f64]) -> std::io::Result<()> {
        self.take(number, values)
    }

    fn takes_pictures(&self) -> bool {
        self.folder.as_ref().is_some_and(Folder::takes_motion)
    }

    fn picture(&mut self, number: usize, values: &[f64]) -> std::io::Result<()> {
        let time = self.times[number].scene;
        let written = self.folder.as_mut().map_or(Ok(()), |folder| folder.record(time, values));
        self.told(written)
    }

    fn event(&mut self, event: &Event) -> std::io::Result<()> {
        let written = self.events.take(event);
        self.told(written)
    }

    fn step(&mut self, _: f64) -> Flow {
        let ends = self.asked.as_mut().is_some_and(|asked| asked());
        if ends { Flow::Stop } else { Flow::Continue }
    }
}

impl Samplings {
    /// Takes a row.
    pub(super) fn take(&mut self, number: usize, values: &[f64]) -> Result<(), std::io::Error> {
        let time = self.times[number].scene;
        self.taken.push(time);
        for ((column, channel), value) in self.columns.iter_mut().zip(&self.channels).zip(values) {
            column.push(channel.from_si(*value));
        }
        let Some(folder) = &mut self.folder else { return Ok(()) };
        let written = folder.row(time, values);
        self.told(written)
    }

    /// Rows that were taken; where they are written, those that the file has.
    pub(super) fn rows(&self) -> u64 {
        self.folder.as_ref().map_or(self.taken.len() as u64, Folder::rows)
    }

    /// Writes what is known of the columns by now, if there are files.
    pub(super) fn write_channels(&self, units: &UnitSystem) -> Result<(), ResultsError> {
        self.folder.as_ref().map_or(Ok(()), |folder| folder.write_channels(&time_column(units), &self.channels))
    }

    /// Keeps an error that ends the run.
    fn told(&mut self, written: Result<(), ResultsError>) -> std::io::Result<()> {
        written.map_err(|error| {
            let told = std::io::Error::other(error.to_string());
            self.error = Some(error);
            told
        })
    }

    /// Completes the files, if there are any: the table, the summary, and the state from which another run continues.
    pub(super) fn close(
        &mut self,
        path: Option<&Path>,
        summary: &mut Summary,
        end: Option<&Restart>,
        afterwards: Afterwards,
    ) -> Result<(), ResultsError> {
        self.events.finish()?;
        let (Some(folder), Some(path)) = (self.folder.take(), path) else { return Ok(()) };
        if let Some(end) = end {
            end.write(path)?;
        }
        folder.finish(summary)?;
        let ended = summary.status.reached_end() && afterwards == Afterwards::default();
        if ended { Checkpoint::done(path) } else { Ok(()) }
    }

    /// The row and the event of these numbers are the next ones: drops those behind them, and all where those before them were never taken.
    pub(super) fn go_back(&mut self, row: usize, event: usize) {
        let kept = |first: &mut usize, next: usize, taken: usize| {
            let kept = next.checked_sub(*first).filter(|kept| *kept <= taken);
            kept.unwrap_or_else(|| {
                *first = next;
                0
            })
        };
        let [first_row, first_event] = &mut self.first;
        let rows = kept(first_row, row, self.taken.len());
        self.taken.truncate(rows);
        self.columns.iter_mut().for_each(|column| column.truncate(rows));
        let events = kept(first_event, event, self.events.list.len());
        self.events.list.truncate(events);
    }

    /// Continues the files with what was `kept` of them.
    pub(super) fn go_on(session: &Session, path: &Path, kept: &Kept, summary: &Summary) -> Result<Self, ResultsError> {
        let mut samplings = session.no_samplings();
        samplings.folder = Some(Folder::go_on(path, &samplings.channels, session.shown.as_ref(), kept, summary)?);
        if let Some(kept) = &kept.events {
            samplings.events.go_on(path, session.scene.units.factor(Dimension::TIME), kept)?;
        }
        let table = Table::read(&path.join(RESULTS_FILE))?;
        (samplings.taken, samplings.columns) = (table.times, table.columns);
        Ok(samplings)
    }

    /// Brings all rows to the disk, then the text of a checkpoint made for what is there. Returns what else
    /// `make` gives.
    pub(super) fn checkpoint<T>(
        &mut self,
        make: impl FnOnce(Kept) -> std::io::Result<(String, T)>,
    ) -> Result<T, ResultsError> {
        let folder = self.folder.as_mut().expect("runs with checkpoints have a folder");
        let written = Kept { events: self.events.sync()?, ..folder.sync()? };
        let (text, made) = make(written).map_err(|cause| folder.no_checkpoint(cause))?;
        folder.checkpoint(&text)?;
        Ok(made)
    }

    /// The report of the run.
    pub(super) fn report(self, summary: Summary, checks: Vec<CheckResult>) -> RunReport {
        let events = self.events.list;
        let Self { time, taken: times, columns, channels, .. } = self;
        RunReport { summary, times, columns, time, channels, events, checks }
    }
}

impl Session {
    /// Where the samples go, and the files that begin now.
    pub(super) fn samplings(&self, folder: Option<&Path>, summary: &Summary) -> Result<Samplings, SessionError> {
        let mut samplings = self.no_samplings();
        if let Some(path) = folder {
            let time = time_column(&self.scene.units);
            let unit = time.factor;
            let folder = Folder::create(path, &time, &samplings.channels, self.shown.as_ref(), summary);
            samplings.folder = Some(folder.map_err(|e| self.files_error(&e))?);
            if self.equations.has_events() {
                samplings.events.begin(path, unit).map_err(|e| self.files_error(&e))?;
            }
        }
        Ok(samplings)
    }

    /// All times at which samples are wanted.
    pub(super) fn sample_times(&self) -> Vec<SampleTime> {
        let from = Simulation { t_start: self.begins.sampled_from, ..self.scene.simulation.clone() };
        from.sample_times(&self.scene.units)
    }

    /// Where the samples go, without files.
    pub(super) fn no_samplings(&self) -> Samplings {
        let times = self.sample_times();
        let channels: Vec<ChannelInfo> = self.model.channels.iter().enumerate().map(|c| self.channel_info(c)).collect();
        Samplings {
            columns: channels.iter().map(|_| Vec::with_capacity(times.len())).collect(),
            taken: Vec::with_capacity(times.len()),
            events: Events::default(),
            error: None,
            asked: None,
            folder: None,
            first: [0; 2],
            time: time_column(&self.scene.units),
            times,
            channels,
        }
    }
}

/// The first column.
fn time_column(units: &UnitSystem) -> ChannelInfo {
    ChannelInfo::time(&units.label(Dimension::TIME), units.factor(Dimension::TIME))
}

/// Where the rows of a run go.
pub(super) enum Rows<'a> {
    /// They are kept.
    Kept(Box<Samplings>),
    /// Somebody else takes them.
    Sent(Box<dyn Sink + 'a>),
}

impl Rows<'_> {
    /// Who takes them.
    pub(super) fn sink(&mut self) -> &mut dyn Sink {
        match self {
            Self::Kept(samplings) => samplings.as_mut(),
            Self::Sent(sink) => sink.as_mut(),
        }
    }
}
