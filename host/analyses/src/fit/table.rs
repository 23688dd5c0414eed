//! A fit as text and CSV.

use std::fmt::Write as _;

use super::{Direction, Fit, FittedColumn};
use crate::linear::Port;
use crate::results::significant;

impl Fit {
    /// Measured and fitted values of each column over time, with what is left.
    #[must_use]
    pub fn csv(&self) -> String {
        let columns: Vec<_> = self.columns.iter().filter(|column| column.output != "figure").collect();
        let mut text = String::from("t");
        for column in &columns {
            let _ = write!(text, ",{0} measured,{0} fitted,{0} residual", column.name.replace([',', '"'], " "));
        }
        text.push('\n');
        for (k, time) in self.times.iter().enumerate() {
            let _ = write!(text, "{time:?}");
            for column in &columns {
                let [measured, fitted] = [column.measured[k], column.fitted[k]];
                let _ = write!(text, ",{measured:?},{fitted:?},{:?}", fitted - measured);
            }
            text.push('\n');
        }
        text
    }

    /// The same as columns: measured and fitted of each, then what is left of it.
    #[must_use]
    pub fn curves(&self) -> Vec<(Port, Vec<f64>)> {
        let columns = self.columns.iter().filter(|column| column.output != "figure");
        let of = |column: &FittedColumn| {
            let port = |what: &str| Port {
                name: format!("{} {what}", column.name),
                unit: column.unit.clone(),
                factor: 1.0,
                value: 0.0,
            };
            let left = column.fitted.iter().zip(&column.measured).map(|(fitted, measured)| fitted - measured);
            [
                (port("measured"), column.measured.clone()),
                (port("fitted"), column.fitted.clone()),
                (port("residual"), left.collect()),
            ]
        };
        columns.flat_map(of).collect()
    }

    /// What people read.
    #[must_use]
    pub fn overview(&self) -> String {
        let mut text =
            format!("{} after {} iterations and {} runs; {}\n", self.status, self.iterations, self.runs, self.how);
        for one in &self.parameters {
            let unit = if one.unit.is_empty() { String::new() } else { format!(" {}", one.unit) };
            let shown = |value: f64| significant(value, digits(value, one.error));
            let interval = match () {
                () if one.at_bound => "at its bound".to_owned(),
                () if one.undetermined => "not determined".to_owned(),
                () if one.error.is_nan() => "no interval".to_owned(),
                () => format!("+- {}, 95 % in {} .. {}", significant(one.error, 2), shown(one.low), shown(one.high)),
            };
            let _ = writeln!(
                text,
                "  {} = {}{unit}  ({interval}; began at {})",
                one.key,
                shown(one.value),
                significant(one.start, 6)
            );
        }
        for one in &self.undetermined {
            let _ = writeln!(text, "not determined: {}", one.words());
        }
        for (i, row) in self.correlation.iter().enumerate() {
            for (k, value) in row.iter().enumerate().skip(i + 1).filter(|(_, value)| value.abs() > 0.5) {
                let [a, b] = [&self.parameters[i].key, &self.parameters[k].key];
                let _ = writeln!(text, "correlation of {a} and {b}: {}", significant(*value, 3));
            }
        }
        for one in &self.columns {
            let how = if one.estimated { "estimated" } else { "given" };
            let unit = if one.unit.is_empty() { String::new() } else { format!(" {}", one.unit) };
            let [rms, noise] = [significant(one.rms, 4), significant(one.noise, 4)];
            if one.output == "figure" {
                let [fitted, measured] = [one.fitted[0], one.measured[0]].map(|value| significant(value, 7));
                let _ = writeln!(text, "  {}: {fitted}, wanted {measured} (noise {noise}, {how})", one.name);
            } else {
                let _ = writeln!(
                    text,
                    "  {}: {rms}{unit} left of {} points (noise {noise}{unit}, {how})",
                    one.name,
                    one.measured.len()
                );
            }
        }
        if self.columns.iter().any(|column| !column.estimated) && self.freedoms > 0 {
            let [chi, share] =
                [self.chi_square, self.chi_square / self.freedoms as f64].map(|value| significant(value, 4));
            let _ = writeln!(
                text,
                "chi-square {chi} at {} degrees of freedom: {share} each, 1 where model and noise are right",
                self.freedoms
            );
        }
        self.notes.iter().for_each(|note| {
            let _ = writeln!(text, "note: {note}");
        });
        let sets: Vec<String> = self.sets.iter().map(|set| format!("--set \"{set}\"")).collect();
        let _ = writeln!(text, "the fitted scene: {}", sets.join(" "));
        text
    }
}

impl Direction {
    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        let part = |(key, share): &(String, f64)| format!("{key} {:+} %", significant_number(*share));
        let parts: Vec<String> = self.parts.iter().map(part).collect();
        let how = if self.deviation.is_finite() {
            format!("to {} %", significant(100.0 * self.deviation, 2))
        } else {
            "at all: it changes nothing of what was measured".to_owned()
        };
        match parts.as_slice() {
            [one] => format!("{one} alone is not known {how}"),
            _ => format!("{} together is not known {how}", parts.join(", "))
                .replace("is not known to", "is known only to"),
        }
        .replace("alone is not known to", "alone is known only to")
    }
}

fn significant_number(share: f64) -> f64 {
    (share * 1000.0).round() / 1000.0
}

/// Digits of a value with this error that are worth printing.
fn digits(value: f64, error: f64) -> usize {
    if error.is_nan() || error == 0.0 || value == 0.0 {
        return 9;
    }
    ((value.abs() / error).log10().max(0.0).ceil() as usize + 2).min(12)
}
