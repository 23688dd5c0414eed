//! Derivatives of outputs and figures with respect to numbers of the scene.
//!
//! - **Takes**: a scene file, the outputs and figures asked for, the numbers by their `--set` keys.
//! - **Gives**: [`Sensitivities`]: derivatives over time with an estimate of the error of each.
//! - **Must not know**: how a scene is run, the terminal.
//!
//! The scene is prepared anew at p + k h, k = -3 to 3: read, recorded, assembled. So whatever follows the number follows it here:
//! constants that foreign libraries compute, joint frames, the assembled start, element states. All these runs take the steps of one
//! run (internal differentiation: Bock 1981, "Numerical treatment of inverse problems in chemical reaction kinetics"), so that the
//! discrete result is a smooth function of p and its differences lose no more digits than round-off makes them. Where equations
//! switch or contacts close, each run takes its own steps at a tolerance of 1e-13 and ends them at its own events.
//!
//! A derivative is the difference of order 6; its error is estimated as
//!
//! |D6 - D4| + |D2 - D2'|
//!
//! with D2' from the steps of a run at a hundred times the tolerance (10 times where runs take their own steps, the double step where
//! it is fixed): the first is what differences leave out and round-off, the second what the steps leave out. Of several h, each output
//! takes that with the least first term. A kink at p itself is in none of them: where the slopes on both sides of p differ by more than
//! that, half of what they differ by is the error.
//!
//! | file | content |
//! |---|---|
//! | `parameter.rs` | a number of a scene with its unit |
//! | `runs.rs` | variants of a scene, by given steps or their own |
//! | `stencil.rs` | differences of orders 2, 4, 6 |
//! | `search.rs` | which h |
//! | `table.rs` | what came out, as text and CSV |

mod parameter;
pub(crate) mod runs;
mod search;
mod stencil;
mod table;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde::Serialize;

pub use self::parameter::Parameter;
use self::runs::{Kind, Variants};
pub(crate) use self::search::base;
use self::search::{Found, Search};
pub(crate) use self::stencil::Stencil;
use crate::diagnostics::{Diagnostic, Exit, codes, suggest};
use crate::results::ChannelInfo;
use crate::scene::Dimension;
use crate::session::{RunOptions, Session, SessionError};

/// A derivative with fewer digits is not certain.
const LEAST_DIGITS: f64 = 2.0;
/// A derivative that changes an output by less than this share of it, for a change of the number by its size, is taken for none where
/// its error is of the same size.
const NO_EFFECT: f64 = 1e-8;

/// What is wanted.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// Names of outputs and figures; all of them where empty.
    pub of: Vec<String>,
    /// Keys of numbers, as for `--set`.
    pub to: Vec<String>,
    /// h as a share of each number (of one unit, where it is zero); found where absent.
    pub step: Option<f64>,
    /// Runs at the same time; 0 = as many as there are processors. Results do not depend on it.
    pub jobs: usize,
}

/// Derivatives of a scene's results. Numbers that are not known are NaN, `null` in JSON.
#[derive(Debug, Clone, Serialize)]
pub struct Sensitivities {
    /// `certain`, or `uncertain` where a derivative has fewer than two certain digits.
    pub status: &'static str,
    /// How they were obtained.
    pub how: String,
    /// Relative tolerance of the runs that were differenced, or nothing where steps are fixed.
    pub tolerance: Option<f64>,
    /// Unit of the times.
    pub time_unit: String,
    /// Times of the samples.
    pub times: Vec<f64>,
    /// What was differenced by.
    pub parameters: Vec<Differenced>,
    /// One per figure and parameter.
    pub figures: Vec<FigureSensitivity>,
    /// One per output and parameter.
    pub outputs: Vec<OutputSensitivity>,
    /// What numbers do not say by themselves.
    pub notes: Vec<String>,
}

/// A number that was varied.
#[derive(Debug, Clone, Serialize)]
pub struct Differenced {
    /// Its key.
    pub key: String,
    /// Its value, in its unit.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// The step h, in its unit.
    pub step: f64,
    /// `central`; `forward` or `backward` where the scene does not allow values on the other side.
    pub stencil: &'static str,
    /// Runs that were made for it.
    pub runs: usize,
}

/// The derivative of a figure.
#[derive(Debug, Clone, Serialize)]
pub struct FigureSensitivity {
    /// The figure.
    pub figure: String,
    /// The parameter's key.
    pub parameter: String,
    /// Value of the figure.
    pub value: f64,
    /// The derivative.
    pub derivative: f64,
    /// Estimate of its error.
    pub error: f64,
    /// Unit of both.
    pub unit: String,
    /// Relative change of the figure for one of the parameter: (p / y) dy/dp.
    pub logarithmic: f64,
    /// Digits of the derivative that are certain.
    pub digits: f64,
    /// Zero to within its error.
    pub independent: bool,
}

/// The derivative of an output at all samples.
#[derive(Debug, Clone, Serialize)]
pub struct OutputSensitivity {
    /// The output.
    pub output: String,
    /// The parameter's key.
    pub parameter: String,
    /// Unit of the derivative.
    pub unit: String,
    /// The derivative at each sample; NaN where an event passes the sample between the runs.
    pub derivative: Vec<f64>,
    /// Estimate of its error at each sample.
    pub error: Vec<f64>,
    /// The derivative of largest magnitude, and its time.
    pub peak: f64,
    /// See `peak`.
    pub peak_time: f64,
    /// (p / y) dy/dp at the last sample.
    pub logarithmic: f64,
    /// p times the largest derivative, over the largest value of the output.
    pub relative_peak: f64,
    /// Digits of the derivative that are certain, at all samples, against its largest value.
    pub digits: f64,
    /// Zero to within its error.
    pub independent: bool,
    /// Samples without a derivative.
    pub passed: usize,
    /// False where rigid bodies do not determine the output.
    pub unique: bool,
}

impl Sensitivities {
    /// Differentiates the results of a scene.
    ///
    /// # Errors
    /// A scene that does not run, numbers that it does not have, outputs that it does not have; values next to a number at which it does
    /// not run.
    pub fn of(
        path: &Path,
        options: &RunOptions,
        request: &Request,
        progress: &(dyn Fn(f64) + Sync),
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, SessionError> {
        let variants = Variants::open(path, options, stop)?;
        let session = variants.session(&[], &runs::Way::default())?;
        let wanted = Wanted::find(&request.of, &session)?;
        let place = |error: Box<Diagnostic>| SessionError::one(&session.scene.source, *error);
        let mut parameters = Vec::new();
        for key in &request.to {
            let changes = &variants.options.overrides;
            let parameter = Parameter::read(key, &variants.document, changes, &session).map_err(place)?;
            if let Some(number) = parameters.iter().position(|one: &Parameter| one.key == parameter.key) {
                return Err(place(Box::new(twice(&parameters[number].key))));
            }
            parameters.push(parameter);
        }
        let mut nominal = variants.nominal(&[])?;
        let energy = nominal.done.report.summary.audit.largest_energy();
        let natural = session.natural_sizes().of(energy);
        let natural: Vec<f64> = wanted.outputs.iter().map(|output| natural[*output]).collect();
        let times = nominal.done.report.times.clone();
        let (natural, times) = (natural.as_slice(), times.as_slice());
        let search = Search { variants: &variants, wanted: &wanted, request, natural, times, progress };
        let found = match search.all(&nominal, &parameters) {
            Err(error) if nominal.kind == Kind::Frozen && error.exit == Exit::Integration => {
                // Steps of another run are too long for one of the variants: each takes its own.
                nominal.kind = Kind::Located;
                search.all(&nominal, &parameters)?
            }
            found => found?,
        };
        Ok(assemble(&nominal, &session, (&wanted, natural), &parameters, found))
    }

    /// Exit code of the program.
    #[must_use]
    pub fn exit_code(&self) -> i32 {
        if self.status == "certain" { Exit::Done as i32 } else { Exit::Audit as i32 }
    }
}

fn twice(key: &str) -> Diagnostic {
    Diagnostic::error(codes::BAD_OVERRIDE, format!("`{key}` is given twice"))
}

/// Outputs and figures that are asked for, by their places.
#[derive(Debug, Clone, Default)]
pub(crate) struct Wanted {
    pub(crate) outputs: Vec<usize>,
    pub(crate) figures: Vec<usize>,
}

impl Wanted {
    /// # Errors
    /// The scene has none of a name, or nothing at all.
    pub(crate) fn find(names: &[String], session: &Session) -> Result<Self, SessionError> {
        let outputs: Vec<&str> = session.model.channels.iter().map(|channel| channel.name.as_str()).collect();
        let figures: Vec<&str> = session.scene.figures.iter().map(|figure| figure.name.value.as_str()).collect();
        let refuse = |diagnostic| SessionError::one(&session.scene.source, diagnostic);
        if names.is_empty() {
            let all = Self { outputs: (0..outputs.len()).collect(), figures: (0..figures.len()).collect() };
            if outputs.is_empty() {
                let error = Diagnostic::error(codes::UNKNOWN_CHANNEL, "the scene has no output to differentiate");
                return Err(refuse(error.help("add an `[[output]]`")));
            }
            return Ok(all);
        }
        let mut wanted = Self::default();
        for name in names.iter().map(|name| name.trim()) {
            let output = outputs.iter().position(|one| *one == name);
            let figure = figures.iter().position(|one| *one == name);
            wanted.outputs.extend(output);
            wanted.figures.extend(figure);
            if output.or(figure).is_none() {
                let error = Diagnostic::error(codes::UNKNOWN_CHANNEL, format!("there is no output or figure `{name}`"));
                let all = outputs.iter().chain(&figures).copied();
                let nearest = suggest(name, all).map(|nearest| format!("did you mean `{nearest}`?"));
                return Err(refuse(error.help_if(nearest)));
            }
        }
        Ok(wanted)
    }
}

/// Puts together what was found for each parameter.
fn assemble(
    nominal: &runs::Nominal,
    session: &Session,
    (wanted, natural): (&Wanted, &[f64]),
    parameters: &[Parameter],
    found: Vec<Found>,
) -> Sensitivities {
    let report = &nominal.done.report;
    let samples = report.times.len();
    let mut all = Sensitivities {
        status: "certain",
        how: nominal.kind.words().to_owned(),
        tolerance: found.first().and_then(|found| found.tolerance),
        time_unit: session.scene.units.label(Dimension::TIME),
        times: report.times.clone(),
        parameters: Vec::new(),
        figures: Vec::new(),
        outputs: Vec::new(),
        notes: Vec::new(),
    };
    if let Some(reason) = nominal.suspect() {
        all.notes.push(format!("the run itself is suspect: {reason}"));
    }
    for (parameter, found) in parameters.iter().zip(found) {
        let p = parameter.value;
        let size = |derivative: f64| if p == 0.0 { derivative } else { derivative * p.abs() };
        for (k, figure) in wanted.figures.iter().enumerate() {
            let (figure, at) = (&report.summary.figures[*figure], wanted.outputs.len() * samples + k);
            let (derivative, error) = (found.derivative[at], found.error[at]);
            let value = figure.value.unwrap_or(f64::NAN);
            all.figures.push(FigureSensitivity {
                figure: figure.name.clone(),
                parameter: parameter.key.clone(),
                value,
                derivative,
                error,
                unit: parameter.unit_of_derivative(&figure.unit),
                logarithmic: p / value * derivative,
                digits: digits(derivative.abs(), error),
                independent: is_none(size(derivative), size(error), value),
            });
        }
        for (k, output) in wanted.outputs.iter().enumerate() {
            let at = k * samples..(k + 1) * samples;
            let (derivative, error) = (found.derivative[at.clone()].to_vec(), found.error[at].to_vec());
            let report =
                (&report.channels[*output], report.columns[*output].as_slice(), report.times.as_slice(), natural[k]);
            all.outputs.push(of_output(report, parameter, derivative, error));
        }
        all.parameters.push(Differenced {
            key: parameter.key.clone(),
            value: p,
            unit: parameter.unit.clone(),
            step: found.step,
            stencil: found.stencil.words(),
            runs: found.runs,
        });
        all.notes.extend(found.notes);
    }
    for figure in wanted.figures.iter().map(|figure| &report.summary.figures[*figure]) {
        if figure.value.is_none() {
            all.notes.push(format!("`{}` has no value in this run, and so no derivative", figure.name));
        }
    }
    let doubtful_output =
        |one: &OutputSensitivity| !one.independent && (one.digits.is_nan() || one.digits < LEAST_DIGITS);
    let doubtful_figure =
        |one: &FigureSensitivity| !one.independent && (one.digits.is_nan() || one.digits < LEAST_DIGITS);
    let doubtful = all.outputs.iter().filter(|one| doubtful_output(one)).map(|one| (&one.output, &one.parameter));
    let doubtful: Vec<String> = doubtful
        .chain(all.figures.iter().filter(|one| doubtful_figure(one)).map(|one| (&one.figure, &one.parameter)))
        .map(|(of, to)| format!("`{of}` by `{to}`"))
        .collect();
    if !doubtful.is_empty() {
        all.status = "uncertain";
        let names = doubtful.join(", ");
        all.notes
            .push(format!("fewer than two digits are certain of {names}: what is differenced is not smooth there, or only for steps (`--step`) of another size than were tried"));
    }
    all
}

fn of_output(
    (channel, column, times, natural): (&ChannelInfo, &[f64], &[f64], f64),
    parameter: &Parameter,
    derivative: Vec<f64>,
    error: Vec<f64>,
) -> OutputSensitivity {
    let largest = |values: &[f64]| values.iter().filter(|x| x.is_finite()).fold(0.0_f64, |most, x| most.max(x.abs()));
    let (size, worst, value) = (largest(&derivative), largest(&error), largest(column));
    let at = derivative.iter().position(|x| x.abs() == size).unwrap_or(0);
    let (p, last) = (parameter.value, derivative.len().wrapping_sub(1));
    let passed = derivative.iter().filter(|x| !x.is_finite()).count();
    let by_p = if p == 0.0 { 1.0 } else { p.abs() };
    OutputSensitivity {
        output: channel.name.clone(),
        parameter: parameter.key.clone(),
        unit: parameter.unit_of_derivative(&channel.unit),
        peak: derivative.get(at).copied().unwrap_or(f64::NAN),
        peak_time: times.get(at).copied().unwrap_or(f64::NAN),
        logarithmic: match (derivative.get(last), column.get(last)) {
            (Some(derivative), Some(value)) => p / value * derivative,
            _ => f64::NAN,
        },
        relative_peak: p * size / value,
        digits: digits(size, worst),
        independent: 2 * passed <= derivative.len() && is_none(size * by_p, worst * by_p, value.max(natural)),
        passed,
        unique: channel.unique,
        derivative,
        error,
    }
}

/// Certain digits of a number of this size with this error.
fn digits(size: f64, error: f64) -> f64 {
    match (size, error) {
        _ if size.is_nan() => f64::NAN,
        (0.0, 0.0) => 0.0,
        (_, 0.0) => 16.0,
        _ => (-(error / size).log10()).clamp(0.0, 16.0),
    }
}

/// Whether a change is none to within its error.
fn is_none(change: f64, error: f64, value: f64) -> bool {
    change == 0.0 && error == 0.0 || change.abs() <= 10.0 * error && (change.abs() + error) <= NO_EFFECT * value.abs()
}
