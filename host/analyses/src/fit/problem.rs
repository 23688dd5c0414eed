//! [`Fitting`]: residuals and their derivatives, by runs of the scene.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::DMatrix;

use super::data::Data;
use super::levenberg::{Bounds, Problem};
use crate::diagnostics::{Diagnostic, Exit, Source, codes};
use crate::pool;
use crate::scene::{Dimension, Override};
use crate::sensitivity::runs::{Done, Kind, Nominal, Variants, Way};
use crate::sensitivity::{Parameter, Stencil, base};
use crate::session::{Session, SessionError};

/// Steps of differences on the way, as shares of the parameters: where runs take given steps, and where they take their own.
const ON_THE_WAY: [f64; 2] = [1e-4, 1e-3];
/// Tolerance of runs that take their own steps.
const OWN_STEPS: f64 = 1e-12;
/// Steps of the differences at the minimum; for each parameter the one is taken at which orders 4 and 6 differ least.
const AT_THE_END: [f64; 2] = [1e-3, 1e-4];
/// Relative difference of orders 4 and 6 at which no other step is tried.
const GOOD: f64 = 1e-7;

/// Samples are taken at the measured times, and where figures are fitted at the scene's own times as well, for these alone.
pub(super) fn place_samples(variants: &mut Variants, data: &Data, session: &Session) {
    if data.columns.is_empty() {
        return;
    }
    let unit = session.scene.units.factor(Dimension::TIME);
    let [from, to] = [session.time_of_start(), session.scene.simulation.t_end];
    let mut times: Vec<f64> = data.times.iter().map(|time| (time * unit).clamp(from, to)).collect();
    let mut own = Vec::new();
    if !data.targets.is_empty() {
        own.extend(session.scene.simulation.sample_times(&session.scene.units).iter().map(|time| time.si));
        times.extend(&own);
    }
    times.sort_by(f64::total_cmp);
    times.dedup();
    if !own.is_empty() {
        let place = |time: &f64| times.partition_point(|other| other < time);
        variants.of_figures = Some(own.iter().map(place).collect());
    }
    variants.times = Some(times);
}

/// Derivatives by one parameter, and by how much orders 4 and 6 differ.
type Column = (Vec<f64>, Vec<f64>);

/// A run that residuals were taken from.
struct Known {
    at: Vec<f64>,
    /// None where events ended steps.
    steps: Option<Arc<[f64]>>,
}

/// See the module documentation.
pub(super) struct Fitting<'a> {
    variants: &'a Variants,
    data: &'a Data,
    parameters: &'a [Parameter],
    bounds: &'a [Bounds],
    jobs: usize,
    progress: &'a (dyn Fn(f64) + Sync),
    kind: Kind,
    way: Way,
    tight: Way,
    /// Standard deviation of each measured number.
    pub(super) noise: Vec<f64>,
    /// What steps of differences are shares of where parameters are nearer to 0 than that.
    pub(super) least: Vec<f64>,
    known: Vec<Known>,
    runs: AtomicUsize,
    /// Why the last trial could not be run.
    pub(super) reason: Option<String>,
    failed: Option<SessionError>,
}

impl<'a> Fitting<'a> {
    /// # Errors
    /// The scene does not run at the start.
    pub(super) fn begin(
        variants: &'a Variants,
        data: &'a Data,
        parameters: &'a [Parameter],
        bounds: &'a [Bounds],
        start: &[f64],
        jobs: usize,
        progress: &'a (dyn Fn(f64) + Sync),
    ) -> Result<Self, SessionError> {
        let nominal: Nominal = variants.nominal(&changes(parameters, start))?;
        let own = matches!(nominal.kind, Kind::Located);
        let tight = Way { tolerance: Some(OWN_STEPS), ..nominal.way.clone() };
        let way = if own { tight.clone() } else { nominal.way.clone() };
        Ok(Self {
            variants,
            data,
            parameters,
            bounds,
            jobs,
            progress,
            kind: nominal.kind,
            way,
            tight,
            noise: Vec::new(),
            least: vec![0.0; start.len()],
            known: Vec::new(),
            runs: AtomicUsize::new(1),
            reason: None,
            failed: None,
        })
    }

    pub(super) fn runs(&self) -> usize {
        self.runs.load(Ordering::Relaxed)
    }

    pub(super) fn how(&self) -> &'static str {
        self.kind.words()
    }

    /// Why there are no residuals.
    pub(super) fn failure(&mut self) -> SessionError {
        self.failed.take().unwrap_or_else(|| SessionError::new(&Source::new("", ""), Vec::new()))
    }

    fn run(&self, at: &[f64], way: &Way) -> Result<Done, SessionError> {
        let runs = self.runs.fetch_add(1, Ordering::Relaxed) as f64;
        // How many there will be is not known.
        (self.progress)(runs / (runs + 40.0));
        let done = self.variants.run(&changes(self.parameters, at), way)?;
        let wanted = self.variants.times.as_ref().map_or(done.report.times.len(), Vec::len);
        if done.report.times.len() == wanted {
            return Ok(done);
        }
        let message = "the parameters change the end of the run, so that it does not have the measured times";
        Err(SessionError::one(self.variants.document.source(), Diagnostic::error(codes::BAD_OVERRIDE, message)))
    }

    /// What the scene gives for the measured numbers.
    fn values(&self, done: &Done) -> Vec<f64> {
        let report = &done.report;
        let sample = |time: f64| {
            let after = report.times.partition_point(|own| *own < time);
            let near = [after.saturating_sub(1), after.min(report.times.len() - 1)];
            if (report.times[near[0]] - time).abs() < (report.times[near[1]] - time).abs() { near[0] } else { near[1] }
        };
        let samples: Vec<usize> = self.data.times.iter().map(|time| sample(*time)).collect();
        let columns = self.data.columns.iter().map(|column| &report.columns[column.output]);
        let columns = columns.flat_map(|column| samples.iter().map(|k| column[*k]));
        let figures = self.data.targets.iter().map(|one| report.summary.figures[one.figure].value.unwrap_or(f64::NAN));
        columns.chain(figures).collect()
    }

    /// Derivatives at parameters: by each, entries one after the other, with the difference of orders 4 and 6 where they are fine.
    fn derivatives(&self, at: &[f64], share: f64, fine: bool) -> Result<Vec<Column>, SessionError> {
        let mut way = if fine { self.tight.clone() } else { self.way.clone() };
        let mut share = share;
        if self.kind == Kind::Frozen {
            let known = self.known.iter().rev().find(|known| known.at == at).map(|known| known.steps.clone());
            let steps = match known {
                Some(steps) => steps,
                None => Some(self.run(at, &self.way)?).filter(|done| !done.met_events()).map(|done| done.steps),
            };
            way = match steps {
                Some(steps) => Way { steps: Some(steps), ..self.way.clone() },
                None => self.tight.clone(),
            };
            // Runs of their own steps differ by more than round-off.
            share = if way.steps.is_none() { share.max(ON_THE_WAY[1]) } else { share };
        }
        let count = |stencil: Stencil| if fine { stencil.places().len() } else { stencil.fewest() };
        let step = |k: usize| share * base(at[k].abs().max(self.least[k]));
        let one = |(k, place): (usize, f64)| -> Result<Vec<f64>, SessionError> {
            let mut next = at.to_vec();
            next[k] += place * step(k);
            let done = match self.run(&next, &way) {
                Err(error) if self.kind == Kind::Frozen && error.exit == Exit::Integration => {
                    self.run(&next, &self.tight)
                }
                done => done,
            };
            let values = self.values(&done?);
            Ok(values)
        };
        let places = |k: usize, stencil: Stencil| {
            stencil.places()[..count(stencil)].iter().map(move |place| (k, *place)).collect::<Vec<_>>()
        };
        // Beyond a bound the scene may not run; then on the other side.
        let side = |k: usize| {
            let room = 3.0 * step(k);
            match (at[k] - self.bounds[k].low < room, self.bounds[k].high - at[k] < room) {
                (true, false) => Stencil::Forward,
                (false, true) => Stencil::Backward,
                _ => Stencil::Central,
            }
        };
        let jobs: Vec<(usize, f64)> = (0..at.len()).flat_map(|k| places(k, side(k))).collect();
        let mut done = pool::each(jobs, self.jobs, one).into_iter();
        (0..at.len())
            .map(|k| {
                let mut stencil = side(k);
                let mut values: Result<Vec<Vec<f64>>, SessionError> = done.by_ref().take(count(stencil)).collect();
                for other in [Stencil::Forward, Stencil::Backward] {
                    if values.is_err() && stencil == Stencil::Central {
                        let again: Result<_, _> = pool::each(places(k, other), self.jobs, one).into_iter().collect();
                        if let Ok(again) = again {
                            (stencil, values) = (other, Ok(again));
                        }
                    }
                }
                let values = values?;
                let rows: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
                let order = |order: usize| {
                    (0..rows[0].len()).map(|row| stencil.derivative(order, &rows, row, step(k))).collect::<Vec<f64>>()
                };
                if !fine {
                    return Ok((order(0), Vec::new()));
                }
                let (best, other) = (order(2), order(1));
                let differs = best.iter().zip(&other).map(|(a, b)| (a - b).abs()).collect();
                Ok((best, differs))
            })
            .collect()
    }

    /// The derivatives of all residuals, and the relative error of each column of them.
    ///
    /// # Errors
    /// The scene does not run next to the parameters.
    pub(super) fn fine_jacobian(&self, at: &[f64]) -> Result<(DMatrix<f64>, Vec<f64>), SessionError> {
        let norm = |values: &[f64]| {
            values.iter().zip(&self.noise).map(|(value, noise)| (value / noise).powi(2)).sum::<f64>().sqrt()
        };
        let doubt = |(values, errors): &Column| norm(errors) / norm(values);
        let mut best = self.derivatives(at, AT_THE_END[0], true)?;
        for share in &AT_THE_END[1..] {
            if best.iter().map(doubt).fold(0.0, f64::max) <= GOOD {
                break;
            }
            for (best, found) in best.iter_mut().zip(self.derivatives(at, *share, true)?) {
                if doubt(&found) < doubt(best) {
                    *best = found;
                }
            }
        }
        Ok((self.matrix(&best), best.iter().map(doubt).collect()))
    }

    fn matrix(&self, columns: &[Column]) -> DMatrix<f64> {
        DMatrix::from_fn(self.noise.len(), columns.len(), |row, k| columns[k].0[row] / self.noise[row])
    }
}

impl Problem for Fitting<'_> {
    type Error = SessionError;

    fn residuals(&mut self, at: &[f64]) -> Result<Option<Vec<f64>>, SessionError> {
        let done = match self.run(at, &self.way) {
            Ok(done) => done,
            Err(error) if error.exit == Exit::Interrupted => return Err(error),
            Err(error) => {
                self.reason = error.diagnostics.iter().find(|one| one.is_error()).map(|one| one.message.clone());
                self.failed = Some(error);
                return Ok(None);
            }
        };
        let values = self.values(&done);
        if values.iter().any(|value| !value.is_finite()) {
            self.reason = Some("a figure has no value".into());
            return Ok(None);
        }
        let steps = (!done.met_events()).then(|| Arc::clone(&done.steps));
        self.known.push(Known { at: at.to_vec(), steps });
        let kept = self.known.len().saturating_sub(4);
        self.known.drain(..kept);
        let measured = self.data.values();
        let residual =
            values.iter().zip(&measured).zip(&self.noise).map(|((value, measured), noise)| (value - measured) / noise);
        Ok(Some(residual.collect()))
    }

    fn jacobian(&mut self, at: &[f64]) -> Result<DMatrix<f64>, SessionError> {
        let own = self.kind == Kind::Located;
        Ok(self.matrix(&self.derivatives(at, ON_THE_WAY[usize::from(own)], false)?))
    }
}

fn changes(parameters: &[Parameter], at: &[f64]) -> Vec<Override> {
    parameters.iter().zip(at).map(|(parameter, value)| parameter.set(*value)).collect()
}
