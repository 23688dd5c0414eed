//! [`System`]: the equations of motion for integrators of others.

use std::sync::{Mutex, PoisonError};

use odyn::analysis::Group;
use odyn::session::{RightSide, SessionError};
use pyo3::prelude::*;

use crate::array::Array;
use crate::error;
use crate::model::Model;
use crate::work::beside;

/// y' = f(t, y), SI.
#[pyclass(frozen, module = "odyn._odyn")]
pub(crate) struct System {
    side: Mutex<RightSide>,
}

#[pymethods]
impl System {
    /// The equations of a scene, from its start.
    #[new]
    fn of(py: Python<'_>, model: &Model) -> PyResult<Self> {
        let found = beside(py, None, false, |_| model.session()?.prepare()?.right_side())?;
        Ok(Self { side: Mutex::new(found.map_err(|error| error::of_session(py, &error))?) })
    }

    /// Start and end, s.
    #[getter]
    fn span(&self, py: Python<'_>) -> PyResult<[f64; 2]> {
        self.with(py, |side| Ok(side.span()))
    }

    /// The state at the start.
    #[getter]
    fn start(&self, py: Python<'_>) -> PyResult<Array> {
        self.with(py, |side| Ok(Array::list(side.start().to_vec())))
    }

    /// What each entry of the state is.
    #[getter]
    fn groups(&self, py: Python<'_>) -> PyResult<Vec<&'static str>> {
        let word = |group: &Group| match group {
            Group::Position => "position",
            Group::Parameter => "parameter",
            Group::Velocity => "velocity",
            Group::AngularVelocity => "angular_velocity",
            Group::State => "element_state",
            Group::Work => "work",
        };
        self.with(py, |side| Ok(side.groups().iter().map(word).collect()))
    }

    /// Names and units of the outputs.
    #[getter]
    fn outputs(&self, py: Python<'_>) -> PyResult<Vec<(String, String)>> {
        self.with(py, |side| {
            let channels = &side.session().model.channels;
            Ok(channels.iter().map(|one| (one.name.clone(), one.unit.clone())).collect())
        })
    }

    /// f(t, y).
    fn rates(&self, py: Python<'_>, t: f64, state: Vec<f64>) -> PyResult<Array> {
        self.with(py, |side| side.rates(t, &state).map(Array::list))
    }

    /// df/dy, if elements give derivatives.
    fn jacobian(&self, py: Python<'_>, t: f64, state: Vec<f64>) -> PyResult<Option<Array>> {
        let n = state.len();
        self.with(py, |side| {
            let found = side.jacobian(t, &state)?;
            Ok(found.map(|columns| Array::matrix([n, n], |row, column| columns[row + n * column])))
        })
    }

    /// The state nearby that meets the joints.
    fn project(&self, py: Python<'_>, t: f64, state: Vec<f64>) -> PyResult<Array> {
        self.with(py, |side| side.project(t, &state).map(Array::list))
    }

    /// The outputs at a state.
    fn values(&self, py: Python<'_>, t: f64, state: Vec<f64>) -> PyResult<Vec<f64>> {
        self.with(py, |side| side.outputs(t, &state))
    }

    /// Gives an input another value.
    fn set_input(&self, py: Python<'_>, name: &str, value: f64) -> PyResult<()> {
        self.with(py, |side| side.set_input(name, value))
    }
}

impl System {
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        act: impl FnOnce(&mut RightSide) -> Result<T, SessionError> + Send,
    ) -> PyResult<T> {
        let act = || act(&mut self.side.lock().unwrap_or_else(PoisonError::into_inner));
        py.detach(act).map_err(|error| error::of_session(py, &error))
    }
}
