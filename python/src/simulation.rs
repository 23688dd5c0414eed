//! [`Simulation`]: a scene that is stepped from outside.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use odyn::session::{self, SessionError};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::array::Array;
use crate::error;
use crate::model::Model;
use crate::work::{GLANCE, beside};

/// A scene in motion, advanced as far as is wanted.
#[pyclass(frozen, module = "odyn._odyn")]
pub(crate) struct Simulation {
    run: Mutex<session::Run<'static>>,
    /// What Ctrl-C raised during an advance.
    raised: Arc<Mutex<Option<PyErr>>>,
}

/// A simulation at one of its times.
#[pyclass(frozen, module = "odyn._odyn")]
pub(crate) struct Saved(session::Saved);

#[pymethods]
impl Saved {
    /// The same as bytes, every bit of it.
    fn content(&self, py: Python<'_>) -> PyResult<Py<PyBytes>> {
        let written = postcard::to_stdvec(&self.0).map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(PyBytes::new(py, &written).unbind())
    }

    /// What [`Saved::content`] gave.
    #[staticmethod]
    fn of_content(content: &[u8]) -> PyResult<Self> {
        postcard::from_bytes(content)
            .map(Self)
            .map_err(|error| PyValueError::new_err(format!("no saved simulation: {error}")))
    }
}

#[pymethods]
impl Simulation {
    /// Places a scene at its start.
    #[new]
    fn start(py: Python<'_>, model: &Model) -> PyResult<Self> {
        let started = beside(py, None, false, |_| model.session()?.prepare()?.start())?;
        let mut run = started.map_err(|error| error::of_session(py, &error))?;
        let raised = Arc::new(Mutex::new(None));
        run.end_when(interrupts(Arc::clone(&raised)));
        Ok(Self { run: Mutex::new(run), raised })
    }

    /// The time.
    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |run| Ok(run.time()))
    }

    /// The end of the scene.
    #[getter]
    fn end(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |run| Ok(run.end()))
    }

    /// Goes on to a time.
    fn advance(&self, py: Python<'_>, t: f64) -> PyResult<()> {
        let done = self.with(py, |run| run.advance(t));
        match self.raised.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(raised) => Err(raised),
            None => done,
        }
    }

    /// Names of the inputs.
    #[getter]
    fn inputs(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.with(py, |run| Ok(run.inputs().map(String::from).collect()))
    }

    /// Names and units of the outputs.
    #[getter]
    fn outputs(&self, py: Python<'_>) -> PyResult<Vec<(String, String)>> {
        self.with(py, |run| {
            let channels = &run.session().model.channels;
            Ok(channels.iter().map(|one| (one.name.clone(), one.unit.clone())).collect())
        })
    }

    /// The value of an input.
    fn input(&self, py: Python<'_>, name: &str) -> PyResult<f64> {
        self.with(py, |run| run.input(name))
    }

    /// Gives an input another value.
    fn set_input(&self, py: Python<'_>, name: &str, value: f64) -> PyResult<()> {
        self.with(py, |run| run.set_input(name, value))
    }

    /// The value of an output.
    fn output(&self, py: Python<'_>, name: &str) -> PyResult<f64> {
        self.with(py, |run| run.output(name))
    }

    /// Everything that the future depends on.
    fn save(&self, py: Python<'_>) -> PyResult<Saved> {
        self.with(py, |run| run.save()).map(Saved)
    }

    /// Back to what was saved.
    fn restore(&self, py: Python<'_>, saved: &Saved) -> PyResult<()> {
        self.with(py, |run| run.restore(&saved.0))
    }

    /// Times and columns of the samples so far.
    fn samples(&self, py: Python<'_>) -> PyResult<(Array, Vec<Array>)> {
        self.with(py, |run| {
            let samples = run.samples();
            Ok((Array::list(samples.times.to_vec()), samples.columns.iter().cloned().map(Array::list).collect()))
        })
    }
}

/// Looks at Ctrl-C now and then, and keeps what it raises.
fn interrupts(raised: Arc<Mutex<Option<PyErr>>>) -> Box<dyn FnMut() -> bool + Send> {
    let mut looked = Instant::now();
    Box::new(move || {
        if looked.elapsed() < GLANCE {
            return false;
        }
        let seen = Python::attach(|py| py.check_signals()).err();
        looked = Instant::now();
        let ends = seen.is_some();
        if ends {
            *raised.lock().unwrap_or_else(PoisonError::into_inner) = seen;
        }
        ends
    })
}

impl Simulation {
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        act: impl FnOnce(&mut session::Run<'static>) -> Result<T, SessionError> + Send,
    ) -> PyResult<T> {
        let act = || act(&mut self.run.lock().unwrap_or_else(PoisonError::into_inner));
        py.detach(act).map_err(|error| error::of_session(py, &error))
    }
}
