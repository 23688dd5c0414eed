//! [`Digits`]: how many digits of the outputs of a run are certain.

use std::path::Path;

use serde::Serialize;

use super::ResultsError;
use super::summary::replace;
use super::text::{Side, aligned, significant};
use crate::diagnostics::{Code, codes};

/// Digits of a double that mean anything, at most.
const MOST: u32 = 16;
/// Share of what is natural for an output below which its peak is round-off.
const NOTHING: f64 = 1e-12;

/// The digits of the outputs of a run that are certain, and what they were held against.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Digits {
    /// The second computation, in words: `power series of order 32 and 26 in numbers of 31 digits`.
    pub how: String,
    /// Whether that has more digits than doubles. If not, what is reported is an estimate.
    pub precise: bool,
    /// Why it has not, or why it ended early; else empty.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub reason: String,
    /// How well it is known itself: the largest difference of two such computations, as a share of an output's size.
    pub accuracy: f64,
    /// What the last digits of the start make of it: the largest difference of a computation whose start is off by as much as
    /// doubles round it (half a unit in the last place of an angle of 1 rad, a length of the scene's size, a velocity), as a share
    /// of an output's size.
    pub start: f64,
    /// The last time that both computations have, in the unit of the table.
    pub t_last: f64,
    /// By output.
    pub outputs: Vec<OutputDigits>,
}

/// What is certain of an output.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct OutputDigits {
    /// The column.
    pub name: String,
    /// Digits that are certain at all times, counted from the first of `size`; `None` where redundant joints leave the output open.
    pub certain: Option<u32>,
    /// Largest error, with that of the second computation.
    pub error: f64,
    /// The time it is at.
    pub t: f64,
    /// Peak of the output; what is natural for its dimension, where the peak is round-off of that.
    pub size: f64,
    /// The time from which on no digit is certain; `None` where some always are.
    pub none_from: Option<f64>,
}

impl OutputDigits {
    /// Of an output with these largest errors at these times, a peak and what is natural for it. Where redundant joints leave it
    /// open, nothing is reported.
    #[must_use]
    pub fn new(name: &str, unique: bool, errors: &[f64], times: &[f64], (peak, natural): (f64, f64)) -> Self {
        let size = if peak > NOTHING * natural { peak } else { natural };
        let size = if size > 0.0 { size } else { 1.0 };
        let rows = || errors.iter().zip(times);
        let worst = rows().fold((0.0, f64::NAN), |worst: (f64, f64), (error, t)| {
            // An error that is not a number is the worst.
            if worst.1.is_nan() || error.is_nan() || *error > worst.0 { (*error, *t) } else { worst }
        });
        let digits = |error: f64| match 2.0 * error / size {
            share if share < 1.0 => MOST.min((-share.log10()).floor().max(0.0) as u32),
            _ => 0,
        };
        let none_from = rows().find(|(error, _)| digits(**error) == 0).map(|(_, t)| *t).filter(|_| unique);
        let certain = (unique && !errors.is_empty()).then(|| digits(worst.0));
        Self { name: name.into(), certain, error: worst.0, t: worst.1, size, none_from }
    }
}

impl Digits {
    /// The message that explains what is missing, if something is.
    #[must_use]
    pub fn code(&self) -> Option<Code> {
        if !self.precise {
            return Some(codes::DIGITS_ESTIMATED);
        }
        let nothing = self.outputs.iter().any(|output| output.certain == Some(0));
        (nothing || !self.reason.is_empty()).then_some(codes::NO_DIGITS)
    }

    /// As reported at the end of a run. `unit` is that of the times.
    pub(super) fn report(&self, unit: &str) -> String {
        let certain = if self.precise { "certain digits" } else { "digits, estimated" };
        let mut out = format!("{certain}, by {}", self.how);
        if self.precise && !self.t_last.is_nan() {
            let [accuracy, start] = [self.accuracy, self.start].map(|share| significant(share, 2));
            out.push_str(&format!(
                " (itself known to {accuracy} of the sizes; the last digits of the start make {start})"
            ));
        }
        out.push('\n');
        let code = self.code().map_or(String::new(), |code| format!(" ({code})"));
        if self.t_last.is_nan() {
            out.push_str(&format!(
                "  none are known, since the second computation has no samples: {}{code}\n",
                self.reason
            ));
            return out;
        }
        let titles = ["output", "digits", "of its size", "error", "at t", ""];
        let mut rows = vec![titles.map(String::from).to_vec()];
        for output in &self.outputs {
            let none = |t: f64| format!("none from t = {} {unit} on", significant(t, 7));
            rows.push(vec![
                output.name.clone(),
                output.certain.map_or("open".into(), |digits| digits.to_string()),
                significant(output.size, 3),
                significant(output.error, 2),
                significant(output.t, 7),
                output.none_from.map_or(String::new(), none),
            ]);
        }
        let sides = [Side::Left, Side::Right, Side::Right, Side::Right, Side::Right, Side::Left];
        out.push_str(&aligned(&sides, &rows));
        if !self.reason.is_empty() {
            let last = significant(self.t_last, 7);
            out.push_str(&match self.precise {
                true => format!("  reported up to t = {last} {unit} only: {}{code}\n", self.reason),
                false => format!("  no more digits than those of doubles could be had: {}{code}\n", self.reason),
            });
        }
        out
    }

    /// Writes them as a table, a row per output.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), ResultsError> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let failed = |error: csv::Error| ResultsError::write(path, std::io::Error::other(error));
        let head = ["output", "certain_digits", "size", "error", "t_of_error", "none_from", "precise", "t_last"];
        writer.write_record(head).map_err(failed)?;
        for output in &self.outputs {
            let number = |x: f64| if x.is_finite() { format!("{x:e}") } else { String::new() };
            let certain = output.certain.map_or(String::new(), |digits| digits.to_string());
            let none_from = output.none_from.map_or(String::new(), number);
            let [size, error, t] = [output.size, output.error, output.t].map(number);
            let precise = self.precise.to_string();
            let row = [output.name.clone(), certain, size, error, t, none_from, precise, number(self.t_last)];
            writer.write_record(row).map_err(failed)?;
        }
        let bytes = writer.into_inner().map_err(|error| ResultsError::write(path, error.into_error()))?;
        replace(path, &bytes, false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_samples_it_is_said_why_there_are_no_digits() {
        let output = OutputDigits::new("x", true, &[], &[], (f64::NAN, 1.0));
        let reason = "interrupted".to_owned();
        let digits = Digits { precise: true, reason, t_last: f64::NAN, outputs: vec![output], ..Digits::default() };
        let told = digits.report("s");
        assert!(told.contains("none are known") && told.contains("interrupted (ODY0706)"), "{told}");
        assert!(!told.contains("NaN") && !told.contains("of its size"), "{told}");
    }
}
