//! Numbers of a scene from measurements.
//!
//! - **Takes**: a scene file, a table of measured outputs and values of figures, the numbers to vary with their bounds.
//! - **Gives**: [`Fit`]: the numbers with confidence intervals, how they hang together, and which combinations of them the
//!   measurements do not determine.
//! - **Must not know**: how a scene is run, the terminal.
//!
//! The sum of the squares of (output - measured) / noise is minimised by Levenberg's and Marquardt's method within bounds. Samples are
//! taken at the measured times. Derivatives are those of [`crate::sensitivity`]: differences of runs that take the steps of the run
//! that they are for. Where the noise of a column is not given, it is estimated from what is left of it, and the fit repeated with it.
//!
//! At the minimum, J has the derivatives of all residuals, each of its columns scaled to length 1, J = U S V^T. A direction of V whose
//! singular value is 0 to within the errors of the columns that it takes part of is not determined: it is reported as a combination of
//! parameters, and these have no interval. The others have the covariance V S^-2 V^T. A direction in which they are known to no better
//! than their sizes is reported, too, and a parameter that is has no interval; the intervals of those beside it have its part. Intervals
//! at 95 % are t sqrt(diag(V S^-2 V^T)) (Seber & Wild,
//! "Nonlinear regression", 1989, section 5.1), t of Student's distribution, or of the normal one where all noise is given. With C that
//! covariance and A_i what the column i alone says (the sum of all A_i is C^-1), noise that was estimated from n_i freedoms, the rows less
//! the trace of their part of J C J^T, adds
//! 4 / n_i C (A_i - A_i C A_i) C to C, and the freedoms of t are C_kk^2 / sum_i ((C A_i C)_kk^2 / n_i) for the parameter k (Kenward & Roger, "Small
//! sample inference for fixed effects from restricted maximum likelihood", Biometrics 53, 1997; Satterthwaite 1946). With one column
//! alone these are the usual ones.
//!
//! | file | content |
//! |---|---|
//! | `data.rs` | what was measured |
//! | `levenberg.rs` | the minimum |
//! | `problem.rs` | residuals and derivatives, by runs |
//! | `judge.rs` | intervals, directions that are not determined |
//! | `statistics.rs` | quantiles |
//! | `scene.rs` | the text of the scene with what was found |
//! | `table.rs` | what came out, as text and CSV |

mod data;
mod judge;
mod levenberg;
mod problem;
mod scene;
mod statistics;
mod table;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::DMatrix;
use serde::Serialize;

use self::data::Data;
use self::judge::judge;
use self::levenberg::{Bounds, Problem as _, minimise};
use self::problem::Fitting;
pub use self::scene::fitted_scene;
use crate::diagnostics::{Diagnostic, Exit, codes};
use crate::linalg::SingularValues;
use crate::scene::Dimension;
use crate::sensitivity::runs::{Variants, Way};
use crate::sensitivity::{Parameter, base};
use crate::session::{RunOptions, SessionError};

/// Iterations of one search, unless the request says otherwise.
const MOST_ITERATIONS: usize = 50;
/// Fits with estimates of noise, and the relative change of these at which no further one is made.
const MOST_FITS: usize = 6;
const SAME_NOISE: f64 = 0.01;
/// A parameter whose change by its size changes what is fitted by less than this share changes nothing.
const NO_EFFECT: f64 = 1e-9;
/// Freedoms per measured number below which there are none to estimate noise from.
const NO_FREEDOMS: f64 = 1e-6;
/// Singular values, of columns of length 1, below which parameters that are differentiated by on the way take nothing.
const NO_DIRECTION: f64 = 1e-6;
/// Nearer to 0 than what changes the measured by this share of it, steps of differences do not become smaller with a parameter.
const NEAR_ZERO: f64 = 1e-4;

/// What is wanted.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// `KEY=MIN:MAX` each; a side, or both with the `=`, may be left out.
    pub vary: Vec<String>,
    /// Columns of the table with their outputs; all, by their own names, where empty.
    pub columns: Vec<(String, String)>,
    /// Standard deviation of the noise of columns, in the unit of their outputs.
    pub noise: Vec<(String, f64)>,
    /// Figures: name, value, standard deviation.
    pub figures: Vec<(String, f64, Option<f64>)>,
    /// Iterations at most; 50 where absent.
    pub most_iterations: Option<usize>,
    /// Runs at the same time; 0 = as many as there are processors. Results do not depend on it.
    pub jobs: usize,
}

/// A fit. Numbers that are not known are NaN, `null` in JSON.
#[derive(Debug, Clone, Serialize)]
pub struct Fit {
    /// `converged`; `undetermined`, where the measurements leave combinations of parameters open; `not converged`.
    pub status: &'static str,
    /// The parameters.
    pub parameters: Vec<Fitted>,
    /// Correlation of their errors, by rows.
    pub correlation: Vec<Vec<f64>>,
    /// Combinations that are not determined.
    pub undetermined: Vec<Direction>,
    /// Singular values of the derivatives of all residuals, those by each parameter scaled to length 1; largest first.
    pub singular_values: Vec<f64>,
    /// What was fitted to.
    pub columns: Vec<FittedColumn>,
    /// The sum of the squares of residuals, each over its noise.
    pub chi_square: f64,
    /// Measured numbers less parameters.
    pub freedoms: usize,
    /// Iterations, of all fits.
    pub iterations: usize,
    /// Runs of the scene.
    pub runs: usize,
    /// Steps that were shortened because the scene does not run at their end.
    pub shortened: usize,
    /// How derivatives were obtained.
    pub how: String,
    /// What numbers do not say by themselves.
    pub notes: Vec<String>,
    /// Unit of the times.
    pub time_unit: String,
    /// Measured times.
    pub times: Vec<f64>,
    /// `--set` texts for the fitted scene.
    pub sets: Vec<String>,
}

/// A parameter that was varied.
#[derive(Debug, Clone, Serialize)]
pub struct Fitted {
    /// Its key.
    pub key: String,
    /// Its unit.
    pub unit: String,
    /// Where it began.
    pub start: f64,
    /// Where it ended.
    pub value: f64,
    /// Its bounds.
    pub min: f64,
    /// See `min`.
    pub max: f64,
    /// It ended at one of them, and has no interval.
    pub at_bound: bool,
    /// It is part of a combination that changes nothing, or known to no better than its size, and has no interval.
    pub undetermined: bool,
    /// Standard error.
    pub error: f64,
    /// Ends of the interval at 95 %.
    pub low: f64,
    /// See `low`.
    pub high: f64,
}

/// A combination of parameters that is not determined.
#[derive(Debug, Clone, Serialize)]
pub struct Direction {
    /// Keys with their relative changes, the largest 1; of numbers near 0, as shares of their sizes.
    pub parts: Vec<(String, f64)>,
    /// Standard deviation along it as a share of sizes; infinite (`null`) where it changes nothing.
    pub deviation: f64,
}

/// What was fitted to.
#[derive(Debug, Clone, Serialize)]
pub struct FittedColumn {
    /// The column or figure.
    pub name: String,
    /// Its output, or `figure`.
    pub output: String,
    /// Its unit.
    pub unit: String,
    /// Standard deviation of its noise.
    pub noise: f64,
    /// Whether that was estimated.
    pub estimated: bool,
    /// Root of the mean square of what is left.
    pub rms: f64,
    /// Measured values.
    pub measured: Vec<f64>,
    /// Those of the fitted scene.
    pub fitted: Vec<f64>,
}

impl Fit {
    /// Fits a scene to measurements.
    ///
    /// # Errors
    /// A scene that does not run at the start; what [`Request`] names and there is not; fewer measured numbers than parameters; a
    /// parameter that changes nothing.
    pub fn of(
        path: &Path,
        table: Option<&Path>,
        options: &RunOptions,
        request: &Request,
        progress: &(dyn Fn(f64) + Sync),
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, SessionError> {
        let mut variants = Variants::open(path, options, stop)?;
        let session = variants.session(&[], &Way::default())?;
        let place = |error: Box<Diagnostic>| SessionError::one(&session.scene.source, *error);
        let refuse = |message: String| Box::new(Diagnostic::error(codes::BAD_OVERRIDE, message));
        let usage = |message: String, help: String| place(Box::new(refuse(message).help(help))).of_usage();
        let data = Data::read(table, request, &session).map_err(place)?;
        let (mut parameters, mut bounds, mut start) = (Vec::new(), Vec::new(), Vec::new());
        for text in &request.vary {
            let (key, range) = text.split_once('=').map_or((text.as_str(), ":"), |(key, range)| (key, range));
            let parameter = Parameter::read(key, &variants.document, &variants.options.overrides, &session);
            let parameter = parameter.map_err(place)?;
            if parameters.iter().any(|one: &Parameter| one.key == parameter.key) {
                return Err(place(refuse(format!("`{key}` is given twice"))));
            }
            let Some((low, high)) = range.split_once(':') else {
                let help = format!("write `--vary {key}=MIN:MAX`");
                return Err(usage(format!("`--vary {text}` has no two bounds"), help));
            };
            let side = |text: &str, none: f64| match text.trim() {
                "" => Ok(none),
                text => parameter.value_of(text, &session).map_err(place),
            };
            let own = Bounds { low: side(low, f64::NEG_INFINITY)?, high: side(high, f64::INFINITY)? };
            if own.low >= own.high {
                let help = format!("write the smaller one first: `--vary {key}=MIN:MAX`");
                return Err(usage(format!("`--vary {text}`: the bounds leave no room"), help));
            }
            let inside = parameter.value > own.low && parameter.value < own.high;
            let middle =
                if own.low.is_finite() && own.high.is_finite() { 0.5 * (own.low + own.high) } else { parameter.value };
            start.push(if inside { parameter.value } else { middle.clamp(own.low, own.high) });
            parameters.push(parameter);
            bounds.push(own);
        }
        if parameters.is_empty() {
            return Err(place(refuse("there is nothing to vary".into())));
        }
        if data.points() < parameters.len() {
            let (points, count) = (data.points(), parameters.len());
            let message = format!("{points} measured numbers cannot determine {count} parameters");
            return Err(place(Box::new(Diagnostic::error(codes::NOTHING_TO_COMPARE, message))));
        }
        problem::place_samples(&mut variants, &data, &session);
        let mut fitting = Fitting::begin(&variants, &data, &parameters, &bounds, &start, request.jobs, progress)?;
        let fit = Search { data: &data, parameters: &parameters, bounds: &bounds, request };
        let mut found = fit.search(&mut fitting, &start, &place)?;
        found.time_unit = session.scene.units.label(Dimension::TIME);
        for (column, measured) in found.columns.iter_mut().zip(&data.columns) {
            let channel = &session.model.channels[measured.output];
            (column.output, column.unit) = (channel.name.clone(), channel.unit.clone());
        }
        for (column, target) in found.columns.iter_mut().skip(data.columns.len()).zip(&data.targets) {
            column.name.clone_from(&session.scene.figures[target.figure].name.value);
        }
        Ok(found)
    }

    /// Exit code of the program.
    #[must_use]
    pub fn exit_code(&self) -> i32 {
        match self.status {
            "converged" => Exit::Done as i32,
            _ => Exit::Audit as i32,
        }
    }
}

struct Search<'a> {
    data: &'a Data,
    parameters: &'a [Parameter],
    bounds: &'a [Bounds],
    request: &'a Request,
}

impl Search<'_> {
    fn search(
        &self,
        fitting: &mut Fitting<'_>,
        start: &[f64],
        place: &dyn Fn(Box<Diagnostic>) -> SessionError,
    ) -> Result<Fit, SessionError> {
        let mut sizes = self.sizes(start);
        let mut noise = Noise::first(self.data);
        fitting.noise = noise.of_points(self.data);
        let mut residuals = fitting.residuals(start)?.ok_or_else(|| fitting.failure())?;
        fitting.least = start.iter().zip(&sizes).map(|(at, size)| if *at == 0.0 { *size } else { 0.0 }).collect();
        let first = fitting.jacobian(start)?;
        let measured = self.data.values();
        let level: f64 = measured.iter().zip(&fitting.noise).map(|(y, noise)| (y / noise).powi(2)).sum::<f64>().sqrt();
        for (k, parameter) in self.parameters.iter().enumerate() {
            if first.column(k).norm() * base(sizes[k]) <= NO_EFFECT * level {
                let message = format!("`{}` changes nothing of what is fitted", parameter.key);
                let error = Diagnostic::error(codes::BAD_OVERRIDE, message);
                return Err(place(Box::new(error.help("leave it out, or begin at another value with `--set`"))));
            }
            let natural = level.max(1.0) / first.column(k).norm();
            if sizes[k] == 0.0 {
                sizes[k] = natural;
            }
            fitting.least[k] = sizes[k].min(NEAR_ZERO * natural);
        }
        let most = self.request.most_iterations.unwrap_or(MOST_ITERATIONS);
        let (mut iterations, mut shortened, mut at) = (0, 0, start.to_vec());
        let mut converged = false;
        for _ in 0..MOST_FITS {
            let minimum = minimise(fitting, &at, residuals, &sizes, self.bounds, most)?;
            iterations += minimum.iterations;
            shortened += minimum.shortened;
            (at, residuals, converged) = (minimum.at, minimum.residuals, minimum.converged);
            let taken = hat_diagonal(&minimum.jacobian, &free(&at, self.bounds));
            let (changed, next) = noise.estimated(self.data, &residuals, &taken);
            residuals.iter_mut().zip(&fitting.noise).for_each(|(residual, noise)| *residual *= noise);
            noise = next;
            fitting.noise = noise.of_points(self.data);
            residuals.iter_mut().zip(&fitting.noise).for_each(|(residual, noise)| *residual /= noise);
            if changed <= SAME_NOISE || !noise.unknown_several() {
                break;
            }
        }
        let (jacobian, doubts) = fitting.fine_jacobian(&at)?;
        let taken = hat_diagonal(&jacobian, &free(&at, self.bounds));
        let mut fit = judge(
            (self.parameters, self.bounds, &sizes),
            &at,
            (&jacobian, &doubts),
            &noise.levels(self.data, &taken),
            &residuals,
        )
        .ok_or_else(|| {
            let message = "what is fitted has no derivative at the minimum";
            place(Box::new(Diagnostic::error(codes::MOTION_NOT_FINITE, message)))
        })?;
        if !converged {
            fit.status = "not converged";
            fit.notes.push(format!("the minimum was not reached in {iterations} iterations"));
        }
        if shortened > 0 {
            let reason = fitting.reason.clone().unwrap_or_default();
            fit.notes.push(format!(
                "{shortened} steps were shortened, because the scene does not run at their end: {reason}"
            ));
        }
        (fit.iterations, fit.shortened, fit.runs) = (iterations, shortened, fitting.runs());
        fit.how = fitting.how().to_owned();
        for ((fitted, start), parameter) in fit.parameters.iter_mut().zip(start).zip(self.parameters) {
            fitted.start = *start;
            fit.sets.push(parameter.set(fitted.value).text);
        }
        fit.times.clone_from(&self.data.times);
        fit.columns = noise.columns(self.data, &residuals);
        Ok(fit)
    }

    /// Sizes typical of the parameters: where they begin, a thousandth of their range at least; 0 where that says nothing.
    fn sizes(&self, start: &[f64]) -> Vec<f64> {
        let size = |(at, bounds): (&f64, &Bounds)| {
            let range = bounds.high - bounds.low;
            let least = if range.is_finite() { 1e-3 * range } else { 0.0 };
            at.abs().max(least)
        };
        start.iter().zip(self.bounds).map(size).collect()
    }
}

/// The parameters that are not at a bound.
fn free(at: &[f64], bounds: &[Bounds]) -> Vec<usize> {
    (0..at.len()).filter(|k| at[*k] > bounds[*k].low && at[*k] < bounds[*k].high).collect()
}

/// Which share of each measured number the free parameters take: the diagonal of J (J^T J)^-1 J^T, whose sum is the number of parameters
/// that are determined. Zeros where J is not finite.
fn hat_diagonal(jacobian: &DMatrix<f64>, free: &[usize]) -> Vec<f64> {
    let mut scaled = jacobian.select_columns(free);
    for mut column in scaled.column_iter_mut() {
        let norm = column.norm();
        column.unscale_mut(if norm > 0.0 { norm } else { 1.0 });
    }
    let mut taken = vec![0.0; jacobian.nrows()];
    let Some(decomposed) = SingularValues::of(&scaled) else { return taken };
    for (value, direction) in decomposed.values().iter().zip(decomposed.right().column_iter()) {
        if *value > NO_DIRECTION {
            let own = &scaled * direction / *value;
            taken.iter_mut().zip(own.iter()).for_each(|(taken, own)| *taken += own * own);
        }
    }
    taken
}

/// Noise that was estimated: for which residuals, and from how many freedoms.
#[derive(Debug, Clone)]
struct Level {
    rows: Vec<usize>,
    freedoms: f64,
}

/// Standard deviations of noise: of each column, then of all figures whose own is not given as a share of their values.
#[derive(Debug, Clone)]
struct Noise {
    /// Of each column, and whether it was given.
    columns: Vec<(f64, bool)>,
    figures: f64,
    unknown_figures: bool,
}

impl Noise {
    /// As given, or the spread of what was measured.
    fn first(data: &Data) -> Self {
        let spread = |values: &[f64]| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let spread = (values.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt();
            let largest = values.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
            if spread > 1e-9 * largest {
                spread
            } else if largest > 0.0 {
                largest
            } else {
                1.0
            }
        };
        let columns =
            data.columns.iter().map(|one| (one.noise.unwrap_or_else(|| spread(&one.values)), one.noise.is_some()));
        let unknown_figures = data.targets.iter().any(|target| target.noise.is_none());
        Self { columns: columns.collect(), figures: 0.01, unknown_figures }
    }

    fn of_points(&self, data: &Data) -> Vec<f64> {
        let columns = self.columns.iter().flat_map(|(noise, _)| std::iter::repeat_n(*noise, data.times.len()));
        let of_target = |target: &data::Target| {
            let size = if target.value == 0.0 { 1.0 } else { target.value.abs() };
            target.noise.unwrap_or(self.figures * size)
        };
        columns.chain(data.targets.iter().map(of_target)).collect()
    }

    /// Whether more than one is not known, so that their ratio decides about the minimum.
    fn unknown_several(&self) -> bool {
        let columns = self.columns.iter().filter(|(_, given)| !given).count();
        let all = self.columns.len() + usize::from(self.unknown_figures);
        columns + usize::from(self.unknown_figures) > 0 && all > 1
    }

    /// What is estimated: each column, then all figures together. Of each measured number the parameters take a share, `taken`.
    fn levels(&self, data: &Data, taken: &[f64]) -> Vec<Level> {
        let rows = data.times.len();
        let level = |rows: Vec<usize>| {
            let freedoms = rows.iter().map(|row| 1.0 - taken[*row]).sum::<f64>();
            Level { freedoms: freedoms.max(NO_FREEDOMS * rows.len() as f64), rows }
        };
        let columns = (self.columns.iter().enumerate()).filter(|(_, (_, given))| !given);
        let columns = columns.map(|(k, _)| level((k * rows..(k + 1) * rows).collect()));
        let first = self.columns.len() * rows;
        let unknown = data.targets.iter().enumerate().filter(|(_, target)| target.noise.is_none());
        let unknown: Vec<usize> = unknown.map(|(k, _)| first + k).collect();
        columns.chain((!unknown.is_empty()).then(|| level(unknown))).collect()
    }

    /// What is not given, from residuals over the present noise; and by which share it changes. What has no freedoms left stays.
    fn estimated(&self, data: &Data, residuals: &[f64], taken: &[f64]) -> (f64, Self) {
        let mut next = self.clone();
        let mut changed = 0.0_f64;
        let mut levels = self.levels(data, taken).into_iter();
        let mut estimate = |noise: &mut f64, largest: f64| {
            let Some(level) = levels.next() else { return };
            if level.freedoms > NO_FREEDOMS * level.rows.len() as f64 {
                let mean = level.rows.iter().map(|row| residuals[*row].powi(2)).sum::<f64>() / level.freedoms;
                let wanted = (*noise * mean.sqrt()).max(1e-13 * largest);
                changed = changed.max((wanted / *noise - 1.0).abs());
                *noise = wanted;
            }
        };
        for (k, (noise, _)) in next.columns.iter_mut().enumerate().filter(|(_, (_, given))| !given) {
            estimate(noise, data.columns[k].values.iter().fold(f64::MIN_POSITIVE, |most, y| most.max(y.abs())));
        }
        if self.unknown_figures {
            estimate(&mut next.figures, 1.0);
        }
        (changed, next)
    }

    fn columns(&self, data: &Data, residuals: &[f64]) -> Vec<FittedColumn> {
        let (rows, noise) = (data.times.len(), self.of_points(data));
        let fitted = |from: usize, measured: &[f64]| -> Vec<f64> {
            measured.iter().enumerate().map(|(k, y)| y + residuals[from + k] * noise[from + k]).collect()
        };
        let rms = |from: usize, count: usize| {
            let left = (from..from + count).map(|k| (residuals[k] * noise[k]).powi(2)).sum::<f64>();
            (left / count.max(1) as f64).sqrt()
        };
        let columns =
            data.columns.iter().zip(&self.columns).enumerate().map(|(k, (column, (own, given)))| FittedColumn {
                name: column.column.clone(),
                output: String::new(),
                unit: String::new(),
                noise: *own,
                estimated: !given,
                rms: rms(k * rows, rows),
                measured: column.values.clone(),
                fitted: fitted(k * rows, &column.values),
            });
        let first = data.columns.len() * rows;
        let figures = data.targets.iter().enumerate().map(|(k, target)| FittedColumn {
            name: String::new(),
            output: "figure".into(),
            unit: String::new(),
            noise: noise[first + k],
            estimated: target.noise.is_none(),
            rms: rms(first + k, 1),
            measured: vec![target.value],
            fitted: fitted(first + k, &[target.value]),
        });
        columns.chain(figures).collect()
    }
}
