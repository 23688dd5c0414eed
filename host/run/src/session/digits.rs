//! How many digits of a run are certain: its samples held against those of a computation with more digits, or, where that cannot
//! be had, against one in doubles that is as different as it can be.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::error::SessionError;
use super::opened::Session;
use super::outcome::RunReport;
use super::precise::{Precise, PreciseSamples};
use super::sharper::NaturalSizes;
use crate::precise::DoubleDouble;
use crate::results::{Digits, OutputDigits};

/// Where the second computation has no more digits than doubles, the difference counts for so much: it is off itself, by less than the run.
const ITSELF: f64 = 2.0;

/// The second computation that a run is held against; from [`Session::second`].
pub struct Second {
    way: Way,
    sizes: NaturalSizes,
}

enum Way {
    Precise(Box<Precise>),
    /// In doubles: how, and why not with more digits.
    Doubles {
        session: Box<Session>,
        how: String,
        reason: String,
    },
}

impl Session {
    /// A second computation of the scene, to tell which digits of a run are certain. To be asked for before [`Session::run`].
    ///
    /// # Errors
    /// As for [`Session::open`].
    pub fn second(&self) -> Result<Second, SessionError> {
        let way = match self.precise() {
            Ok(precise) => Way::Precise(Box::new(precise)),
            Err(reason) => {
                let (session, how) = self.much_sharper()?;
                Way::Doubles { session: Box::new(session), how, reason }
            }
        };
        Ok(Second { way, sizes: self.natural_sizes() })
    }
}

impl Second {
    /// Computes it, and reports which digits of a run are certain in its summary.
    pub fn judge(self, run: &mut RunReport, stop: &Arc<AtomicBool>) {
        let natural = self.sizes.of(run.summary.audit.largest_energy());
        let digits = match self.way {
            Way::Precise(precise) => precisely(run, &precise.solve(&|| !stop.load(Ordering::Relaxed)), &natural),
            Way::Doubles { session, how, reason } => {
                let second = session.run(None, Box::new(|_| ()), stop);
                in_doubles(run, second, &natural, how, reason)
            }
        };
        run.summary.digits = Some(digits);
    }
}

fn precisely(run: &RunReport, second: &PreciseSamples, natural: &[f64]) -> Digits {
    let rows = run.times.len().min(second.times.len());
    let mut digits = Digits {
        how: second.how.clone(),
        precise: true,
        reason: second.ended.as_ref().map_or(String::new(), |ended| ended.why.clone()),
        t_last: rows.checked_sub(1).map_or(f64::NAN, |last| run.times[last]),
        ..Digits::default()
    };
    let largest = |column: &[f64]| column.iter().fold(0.0_f64, |most, x| if *x <= most { most } else { *x });
    for (k, channel) in run.channels.iter().enumerate() {
        let known = second.columns[k].iter().zip(second.doubts[k].iter().zip(&second.starts[k]));
        let error = |(value, (exact, (doubt, start))): (&f64, (&DoubleDouble, (&f64, &f64)))| {
            (DoubleDouble::from(*value) - *exact).abs().to_f64() + doubt + start
        };
        let errors: Vec<f64> = run.columns[k].iter().zip(known).map(error).collect();
        let peak = largest(&second.columns[k].iter().map(|x| x.to_f64().abs()).collect::<Vec<f64>>());
        let output = OutputDigits::new(&channel.name, channel.unique, &errors, &run.times, (peak, natural[k]));
        if channel.unique {
            digits.accuracy = digits.accuracy.max(largest(&second.doubts[k]) / output.size);
            digits.start = digits.start.max(largest(&second.starts[k]) / output.size);
        }
        digits.outputs.push(output);
    }
    digits
}

fn in_doubles(
    run: &RunReport,
    second: Result<RunReport, SessionError>,
    natural: &[f64],
    how: String,
    reason: String,
) -> Digits {
    let (times, columns, problem) = match second {
        Ok(other) => (other.times, other.columns, other.summary.reason),
        Err(error) => (Vec::new(), vec![Vec::new(); run.columns.len()], error.to_string()),
    };
    let rows = run.times.len().min(times.len());
    let t_last = rows.checked_sub(1).map_or(f64::NAN, |last| run.times[last]);
    let reason = if problem.is_empty() { reason } else { format!("{reason}; the second computation: {problem}") };
    let outputs = run.channels.iter().enumerate().map(|(k, channel)| {
        let errors: Vec<f64> = run.columns[k].iter().zip(&columns[k]).map(|(a, b)| ITSELF * (a - b).abs()).collect();
        let peak = columns[k].iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        OutputDigits::new(&channel.name, channel.unique, &errors, &run.times, (peak, natural[k]))
    });
    Digits { how, precise: false, reason, t_last, outputs: outputs.collect(), ..Digits::default() }
}
