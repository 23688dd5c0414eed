//! Derivatives as text and CSV.

use std::fmt::Write as _;

use super::{OutputSensitivity, Sensitivities};
use crate::results::significant;

impl Sensitivities {
    /// The derivatives of all outputs over time: a column of derivatives and one of their errors for each output and parameter. Empty
    /// where there is no derivative.
    #[must_use]
    pub fn csv(&self) -> String {
        let cell = |text: String| {
            let quoted = text.contains([',', '"', '\n']);
            if quoted { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
        };
        let name = |one: &OutputSensitivity| format!("d {} / d {}", one.output, one.parameter);
        let mut text = String::from("t");
        for one in &self.outputs {
            let _ = write!(text, ",{},{}", cell(name(one)), cell(format!("error of {}", name(one))));
        }
        text.push('\n');
        for (k, time) in self.times.iter().enumerate() {
            let _ = write!(text, "{time:?}");
            for number in self.outputs.iter().flat_map(|one| [one.derivative[k], one.error[k]]) {
                if number.is_finite() {
                    let _ = write!(text, ",{number:?}");
                } else {
                    text.push(',');
                }
            }
            text.push('\n');
        }
        text
    }

    /// What people read.
    #[must_use]
    pub fn overview(&self) -> String {
        let mut text = format!("{}\n", self.how);
        for one in &self.parameters {
            let unit = if one.unit.is_empty() { String::new() } else { format!(" {}", one.unit) };
            let [value, step] = [significant(one.value, 9), significant(one.step, 2)];
            let _ =
                writeln!(text, "  {} = {value}{unit}: {} runs, h = {step}{unit}, {}", one.key, one.runs, one.stencil);
        }
        let number = |value: f64, digits: f64| significant(value, (digits.floor() as usize).clamp(1, 12));
        if !self.figures.is_empty() {
            let mut rows = vec![row(["figure", "by", "derivative", "unit", "(p/y) dy/dp", "digits"])];
            for one in &self.figures {
                let value = if one.independent { "0".to_owned() } else { number(one.derivative, one.digits) };
                let share = if one.independent { "0".to_owned() } else { significant(one.logarithmic, 5) };
                rows.push(
                    [
                        one.figure.clone(),
                        one.parameter.clone(),
                        value,
                        one.unit.clone(),
                        share,
                        certain(one.digits, one.independent),
                    ]
                    .to_vec(),
                );
            }
            align(&mut text, &rows);
        }
        if !self.outputs.is_empty() {
            let mut rows = vec![row(["output", "by", "largest derivative", "unit", "at t", "at the end", "digits"])];
            for one in &self.outputs {
                let [peak, last] = [one.peak, one.derivative.last().copied().unwrap_or(f64::NAN)];
                let shown = |value: f64| match value {
                    value if !value.is_finite() => "no derivative".to_owned(),
                    _ if one.independent => "0".to_owned(),
                    value => number(value, one.digits),
                };
                let unique = if one.unique { "" } else { " (not unique)" };
                let name = format!("{}{unique}", one.output);
                let time = significant(one.peak_time, 6);
                rows.push(vec![
                    name,
                    one.parameter.clone(),
                    shown(peak),
                    one.unit.clone(),
                    time,
                    shown(last),
                    certain(one.digits, one.independent),
                ]);
            }
            align(&mut text, &rows);
        }
        self.notes.iter().for_each(|note| {
            let _ = writeln!(text, "note: {note}");
        });
        text
    }
}

fn row<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_owned).to_vec()
}

fn certain(digits: f64, independent: bool) -> String {
    if independent { "none".into() } else { format!("{digits:.1}") }
}

/// Rows with columns of one width each.
fn align(text: &mut String, rows: &[Vec<String>]) {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
    for row in rows {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}"));
        let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join("  ").trim_end());
    }
}
