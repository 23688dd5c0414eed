//! [`Run`]: what a run gave.

use std::path::PathBuf;

use odyn::results::{Event, report};
use odyn::session::RunReport;
use pyo3::prelude::*;

use crate::array::Array;
use crate::error;
use crate::model::json;

/// A column: name, unit, quantity, place, size of the unit in SI, whether rigid bodies determine it.
type Column = (String, String, String, String, f64, bool);

/// What happened to a contact, SI: time, element, kind, row, rates before and after, impulse, energy lost.
type Happened = (f64, String, &'static str, String, f64, f64, f64, f64);

/// What a run gave. Times and samples are in units of their columns.
#[pyclass(frozen, module = "odyn._odyn")]
pub(crate) struct Run {
    /// All but times and columns.
    report: RunReport,
    times: Py<Array>,
    columns: Vec<Py<Array>>,
}

impl Run {
    pub(crate) fn new(py: Python<'_>, mut report: RunReport) -> PyResult<Self> {
        let taken = |values: Vec<f64>| Py::new(py, Array::list(values));
        let times = taken(std::mem::take(&mut report.times))?;
        let columns = std::mem::take(&mut report.columns).into_iter().map(taken).collect::<PyResult<_>>()?;
        Ok(Self { report, times, columns })
    }

    /// The whole report again.
    fn whole(&self) -> RunReport {
        let columns = self.columns.iter().map(|column| column.get().values().to_vec()).collect();
        RunReport { times: self.times.get().values().to_vec(), columns, ..self.report.clone() }
    }
}

#[pymethods]
impl Run {
    /// Times of the samples.
    #[getter]
    fn times(&self, py: Python<'_>) -> Py<Array> {
        self.times.clone_ref(py)
    }

    /// The samples of all channels.
    #[getter]
    fn columns(&self, py: Python<'_>) -> Vec<Py<Array>> {
        self.columns.iter().map(|column| column.clone_ref(py)).collect()
    }

    /// What the columns are.
    #[getter]
    fn channels(&self) -> Vec<Column> {
        let all = self.report.channels.iter().cloned();
        all.map(|one| (one.name, one.unit, one.quantity, one.place, one.factor, one.unique)).collect()
    }

    /// The word of `summary.json`.
    #[getter]
    fn status(&self) -> &'static str {
        use odyn::results::Status;
        match self.report.summary.status {
            Status::Running => "running",
            Status::Completed => "completed",
            Status::Suspect => "suspect",
            Status::StoppedEarly => "stopped_early",
            Status::Failed => "failed",
        }
    }

    /// Why it ended or is suspect.
    #[getter]
    fn reason(&self) -> &str {
        &self.report.summary.reason
    }

    /// Exit code that the program would have.
    #[getter]
    fn exit_code(&self) -> i32 {
        self.report.exit_code()
    }

    /// Everything about the run but its samples, as JSON.
    fn summary(&self) -> String {
        json(&self.report.summary)
    }

    /// The text at the end of a run.
    fn text(&self) -> PyResult<String> {
        Ok(report(&self.report.summary, None, false))
    }

    /// What happened to contacts, in order.
    fn events(&self) -> Vec<Happened> {
        let one = |event: &Event| {
            let [before, after] = event.rates;
            let (element, row) = (event.element.clone(), event.row.clone());
            (event.time, element, event.kind.name(), row, before, after, event.impulse, event.lost)
        };
        self.report.events.iter().map(one).collect()
    }

    /// Writes table, columns, events and summary into a folder.
    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let whole = self.whole();
        py.detach(|| whole.write(&folder)).map_err(|error| error::of_diagnostic(py, error.diagnostic()))
    }
}
