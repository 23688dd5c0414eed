//! Analyses of a scene. Reports are JSON as the program writes it; matrices are arrays.

use std::path::PathBuf;

use odyn::analyses::balance::{Question, balanced};
use odyn::analyses::fit::{self, Fit, fitted_scene};
use odyn::analyses::inverse::inverse as efforts;
use odyn::analyses::kinematics::{Drive, kinematics as moved};
use odyn::analyses::linear::Linear;
use odyn::analyses::loads::loads as loads_on;
use odyn::analyses::modes::Modes;
use odyn::analyses::place::{self, Placed};
use odyn::analyses::prescribed::{Motion, amount, quantity};
use odyn::analyses::sensitivity::{Request as Wanted, Sensitivities};
use odyn::analyses::statics as rest;
use odyn::diagnostics::{Diagnostic, codes};
use odyn::scene::{Dimension, Override};
use odyn::session::{RunOptions, Session, SessionError};
use pyo3::prelude::*;

use crate::array::Array;
use crate::error;
use crate::model::{Model, json, restart};
use crate::work::{Desk, beside};

/// What is called with the share done.
type Listener = Option<Py<PyAny>>;

/// What a session gives, or its error.
fn answered<T: Send>(
    py: Python<'_>,
    progress: Listener,
    work: impl FnOnce(&Desk) -> Result<T, SessionError> + Send,
) -> PyResult<T> {
    beside(py, progress.as_ref(), false, work)?.map_err(|error| error::of_session(py, &error))
}

fn refuse(session: &Session, message: String, help: &str) -> SessionError {
    SessionError::one(&session.scene.source, Diagnostic::error(codes::UNKNOWN_WORD, message).help(help))
}

/// Where a scene is looked at.
#[derive(FromPyObject)]
pub(crate) enum At {
    /// A time of its run, in its unit.
    Time(f64),
    /// `start` or `equilibrium`.
    Word(String),
}

/// A scene at the state that is asked for, or at the end of the run in a folder.
fn placed(model: &Model, at: &At, from: Option<&PathBuf>, listen: &dyn Fn(f64)) -> Result<Placed, SessionError> {
    let open = || -> Result<Session, SessionError> {
        let mut session = model.session()?;
        if let Some(from) = from {
            session.stand_at(restart(&session, from)?)?;
        }
        Ok(session)
    };
    let at = match at {
        At::Time(time) => place::At::Time(*time),
        At::Word(word) if word == "start" => place::At::Start,
        At::Word(word) if word == "equilibrium" => place::At::Equilibrium,
        At::Word(word) => {
            let message = format!("`{word}` is no state of a scene");
            return Err(refuse(&open()?, message, "give `start`, `equilibrium` or a time in the scene's unit"));
        }
    };
    place::place(&open, at, &mut |share| listen(share))
}

/// One equilibrium, or all that are found from several starts.
#[pyfunction]
#[pyo3(signature = (model, starts=None, progress=None))]
pub(crate) fn statics(py: Python<'_>, model: &Model, starts: Option<usize>, progress: Listener) -> PyResult<String> {
    answered(py, progress, |desk| {
        let session = model.session()?;
        let listen = desk.interrupting();
        match starts {
            None => Ok(json(&rest::equilibrium(&session, &mut |share| listen(share))?)),
            Some(starts) => Ok(json(&rest::equilibria(&session, starts, &mut |share| listen(share))?)),
        }
    })
}

/// Frequencies, damping, shapes.
#[pyfunction]
#[pyo3(signature = (model, at, start=None, progress=None))]
pub(crate) fn modes(
    py: Python<'_>,
    model: &Model,
    at: At,
    start: Option<PathBuf>,
    progress: Listener,
) -> PyResult<String> {
    answered(py, progress, |desk| {
        let placed = placed(model, &at, start.as_ref(), &desk.interrupting())?;
        let linear = placed.linear(Some(&[]), Some(&[]))?;
        Ok(json(&Modes::of(&placed.session, &linear)?))
    })
}

/// What a linear model is besides its matrices.
#[derive(serde::Serialize)]
struct About<'a> {
    time: f64,
    at_rest: bool,
    states: &'a [String],
    inputs: &'a [odyn::analyses::linear::Port],
    outputs: &'a [odyn::analyses::linear::Port],
    notes: &'a [String],
}

/// A, B, C, D, and what is to be known of them.
#[pyfunction]
#[pyo3(signature = (model, inputs=None, outputs=None, at=At::Word("start".into()), start=None, progress=None))]
pub(crate) fn linearise(
    py: Python<'_>,
    model: &Model,
    inputs: Option<Vec<String>>,
    outputs: Option<Vec<String>>,
    at: At,
    start: Option<PathBuf>,
    progress: Listener,
) -> PyResult<([Array; 4], String)> {
    answered(py, progress, |desk| {
        let placed = placed(model, &at, start.as_ref(), &desk.interrupting())?;
        let linear = placed.linear(inputs.as_deref(), outputs.as_deref())?;
        let matrices = [&linear.a, &linear.b, &linear.c, &linear.d]
            .map(|one| Array::matrix([one.nrows(), one.ncols()], |row, column| one[(row, column)]));
        let Linear { time, at_rest, states, inputs, outputs, notes, .. } = &linear;
        let about = About { time: *time, at_rest: *at_rest, states, inputs, outputs, notes };
        Ok((matrices, json(&about)))
    })
}

/// Places over time, over a range of a quantity, or along the whole motion.
#[pyfunction]
#[pyo3(signature = (model, drive=None, range=None, progress=None))]
pub(crate) fn kinematics(
    py: Python<'_>,
    model: &Model,
    drive: Option<String>,
    range: Option<(String, String, usize)>,
    progress: Listener,
) -> PyResult<String> {
    answered(py, progress, |desk| {
        let session = model.session()?;
        let drive = match (&drive, &range) {
            (None, _) => Drive::Time,
            (Some(name), None) => Drive::Whole(quantity(&session, name)?),
            (Some(name), Some((from, to, count))) => {
                let wanted = quantity(&session, name)?;
                let value = |text: &str| {
                    amount(text, wanted.dimension, wanted.factor).ok_or_else(|| {
                        refuse(
                            &session,
                            format!("`{text}` is no value of `{name}`"),
                            "give a number, or one with a unit",
                        )
                    })
                };
                let (from, to) = (value(from)?, value(to)?);
                if from == to || !(2..=1_000_000).contains(count) {
                    let message = format!("this is no range of `{name}`: two ends that differ, and two places or more");
                    return Err(refuse(&session, message, "write (\"crank.angle\", \"0 deg\", \"360 deg\", 361)"));
                }
                Drive::Over(wanted, [from, to], *count)
            }
        };
        let listen = desk.interrupting();
        Ok(json(&moved(&session, &drive, &mut |share| listen(share))?))
    })
}

/// Efforts of actuators for a motion in a file, at its rows or at times, in the scene's unit.
#[pyfunction]
#[pyo3(signature = (model, motion, by=None, follow=None, times=None, progress=None))]
pub(crate) fn inverse(
    py: Python<'_>,
    model: &Model,
    motion: PathBuf,
    by: Option<Vec<String>>,
    follow: Option<Vec<String>>,
    times: Option<Vec<f64>>,
    progress: Listener,
) -> PyResult<String> {
    answered(py, progress, |desk| {
        let session = model.session()?;
        let motion = Motion::read(&session, &motion, follow.as_deref())?;
        let unit = session.scene.units.factor(Dimension::TIME);
        let times: Option<Vec<f64>> = times.map(|times| times.iter().map(|time| time * unit).collect());
        let listen = desk.interrupting();
        let found = efforts(&session, &motion, by.as_deref(), times.as_deref(), &mut |share| listen(share))?;
        Ok(json(&found))
    })
}

/// Loads on a body at times, in the scene's unit, or where they are largest.
#[pyfunction]
#[pyo3(signature = (model, body, times=None, progress=None))]
pub(crate) fn loads(
    py: Python<'_>,
    model: &Model,
    body: String,
    times: Option<Vec<f64>>,
    progress: Listener,
) -> PyResult<String> {
    answered(py, progress, |desk| {
        let session = model.session()?;
        let listen = desk.listener();
        Ok(json(&loads_on(session, &body, times.as_deref(), &mut |share| listen(share), &desk.stop)?))
    })
}

/// What shakes the ground, a counterweight, and what it leaves.
#[pyfunction]
#[pyo3(signature = (model, turn, turns, harmonics, radius=None, about=[0.0; 3], progress=None))]
#[allow(clippy::too_many_arguments)] // the keywords of a Python function
pub(crate) fn balance(
    py: Python<'_>,
    model: &Model,
    turn: String,
    turns: usize,
    harmonics: usize,
    radius: Option<String>,
    about: [f64; 3],
    progress: Listener,
) -> PyResult<String> {
    answered(py, progress, |desk| {
        let session = model.session()?;
        let length = session.scene.units.factor(Dimension::LENGTH);
        let radius = radius
            .map(|text| {
                amount(&text, Dimension::LENGTH, length).filter(|radius| *radius > 0.0).ok_or_else(|| {
                    refuse(&session, format!("`{text}` is no radius"), "give a positive length, such as \"20 mm\"")
                })
            })
            .transpose()?;
        let about = about.map(|coordinate| coordinate * length);
        let question = Question { turn, turns, harmonics: harmonics.max(1), about };
        let open = |more: Option<&str>| {
            let mut options = model.options();
            options.overrides.extend(more.map(Override::new));
            model.session_with(&options)
        };
        let listen = desk.interrupting();
        Ok(json(&balanced(&session, &open, &question, radius, &mut |share| listen(share))?))
    })
}

/// Derivatives of outputs and figures with respect to numbers of the scene.
#[pyfunction]
#[pyo3(signature = (model, of, to, step=None, jobs=0, progress=None))]
pub(crate) fn sensitivity(
    py: Python<'_>,
    model: &Model,
    of: Vec<String>,
    to: Vec<String>,
    step: Option<f64>,
    jobs: usize,
    progress: Listener,
) -> PyResult<String> {
    answered(py, progress, |desk| {
        let request = Wanted { of, to, step, jobs };
        let found = Sensitivities::of(model.file()?, &apart(model), &request, &desk.listener(), &desk.stop)?;
        Ok(json(&found))
    })
}

/// Numbers of the scene that fit measurements: the report, and the text of the fitted scene.
#[pyfunction]
#[pyo3(signature = (model, measured, vary, columns, noise, figures, iterations=None, jobs=0, progress=None))]
#[allow(clippy::too_many_arguments)] // the keywords of a Python function
pub(crate) fn fitted(
    py: Python<'_>,
    model: &Model,
    measured: Option<PathBuf>,
    vary: Vec<String>,
    columns: Vec<(String, String)>,
    noise: Vec<(String, f64)>,
    figures: Vec<(String, f64, Option<f64>)>,
    iterations: Option<usize>,
    jobs: usize,
    progress: Listener,
) -> PyResult<(String, Option<String>)> {
    answered(py, progress, |desk| {
        let request = fit::Request { vary, columns, noise, figures, most_iterations: iterations, jobs };
        let (path, options) = (model.file()?, apart(model));
        let found = Fit::of(path, measured.as_deref(), &options, &request, &desk.listener(), &desk.stop)?;
        // There is none where a number was set, and is not written.
        Ok((json(&found), fitted_scene(path, &options.overrides, &found).ok()))
    })
}

/// The options of variants: what they share is theirs alone.
fn apart(model: &Model) -> RunOptions {
    RunOptions { common: None, ..model.options() }
}
