//! [`Verified`]: how far a run is from the same run at a sharper tolerance.

use serde::Serialize;

use super::compare::difference;
use super::text::{Side, aligned, significant};
use super::{ColumnDifference, Samples};

/// The largest differences of the outputs of two runs of a scene, the second of which is sharper.
///
/// They estimate the errors of the first run as far as errors go with the tolerance, those of the second being some ten times
/// smaller then. What both share they don't see: a model that is wrong, or a motion so sensitive that both are lost.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Verified {
    /// What was sharper: `tolerance 1e-11 instead of 1e-10`.
    pub how: String,
    /// Last time that both runs have, in the unit of the table.
    pub t_last: f64,
    /// Why the second run ended before its end; else empty.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub problem: String,
    /// The largest difference in each output, over the times that both runs have.
    pub outputs: Vec<ColumnDifference>,
}

impl Verified {
    /// Compares the samples of two runs, taken at the same times as far as they go.
    #[must_use]
    pub fn new(how: String, run: &Samples<'_>, sharper: &Samples<'_>, problem: String) -> Self {
        let rows = run.times.len().min(sharper.times.len());
        let pairs: Vec<(usize, usize)> = (0..rows).map(|row| (row, row)).collect();
        let columns = run.names.iter().zip(run.columns.iter().zip(sharper.columns));
        let outputs = columns.filter(|_| rows > 0).map(|(name, (a, b))| difference(name, a, b, &pairs, run.times));
        let outputs = outputs.collect();
        let t_last = rows.checked_sub(1).map_or(f64::NAN, |last| run.times[last]);
        Self { how, t_last, problem, outputs }
    }

    /// As told at the end of a run. `unit` is that of the times.
    pub(super) fn report(&self, unit: &str) -> String {
        let head = format!("verified with {}; largest differences, which estimate the errors of this run:\n", self.how);
        let titles = ["output", "difference", "of its peak", "at t"];
        let mut rows = vec![titles.map(String::from).to_vec()];
        for output in &self.outputs {
            rows.push(vec![
                output.name.clone(),
                significant(output.absolute, 3),
                significant(output.relative, 3),
                significant(output.t, 7),
            ]);
        }
        let table = aligned(&[Side::Left, Side::Right, Side::Right, Side::Right], &rows);
        let end = if self.problem.is_empty() {
            String::new()
        } else {
            let last = significant(self.t_last, 7);
            format!("  compared up to t = {last} {unit} only: the second run ended early ({})\n", self.problem)
        };
        head + &table + &end
    }
}
