//! [`Verified`]: how far a run is from the same run by another method and with other steps.

use serde::Serialize;

use super::compare::difference;
use super::text::{Side, aligned, significant};
use super::{ColumnDifference, Samples};

/// The largest differences of the outputs of two runs of a scene, the second of which is sharper.
///
/// They estimate the errors of the first run, those of the second being smaller. What both share they don't see: a model that is
/// wrong, or what steps of both pass over.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Verified {
    /// What was different: `radau5 instead of dop853, tolerance 1e-11 instead of 1e-10, steps up to 0.1 s`.
    pub how: String,
    /// Last time that both runs have, in the unit of the table.
    pub t_last: f64,
    /// Why the second run ended before its end; else empty.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub problem: String,
    /// The largest difference in each output, over the times that both runs have.
    pub outputs: Vec<ColumnDifference>,
    /// Largest difference that the tolerance explains, as a share of the size of an output; `None` where nothing is judged.
    pub limit: Option<f64>,
    /// Outputs that differ by more, the worst first.
    pub beyond: Vec<String>,
}

impl Verified {
    /// Compares the samples of two runs, taken at the same times as far as they go. Differences are judged by `limit` as shares
    /// of the larger of an output's peak and its entry in `sizes`, which is what it is made of.
    #[must_use]
    pub fn new(
        how: String,
        run: &Samples<'_>,
        sharper: &Samples<'_>,
        problem: String,
        limit: Option<f64>,
        sizes: &[f64],
    ) -> Self {
        let rows = run.times.len().min(sharper.times.len());
        let pairs: Vec<(usize, usize)> = (0..rows).map(|row| (row, row)).collect();
        let columns = run.names.iter().zip(run.columns.iter().zip(sharper.columns));
        let outputs = columns.filter(|_| rows > 0).map(|(name, (a, b))| difference(name, a, b, &pairs, run.times));
        let outputs: Vec<ColumnDifference> = outputs.collect();
        let t_last = rows.checked_sub(1).map_or(f64::NAN, |last| run.times[last]);
        let share = |(one, size): (&ColumnDifference, &f64)| {
            if one.absolute == 0.0 { 0.0 } else { one.absolute / one.peak_b.max(*size) }
        };
        let mut beyond: Vec<(f64, String)> = outputs
            .iter()
            .zip(sizes)
            .map(|(one, size)| (share((one, size)), one.name.clone()))
            .filter(|(share, _)| limit.is_some_and(|limit| *share > limit))
            .collect();
        beyond.sort_by(|a, b| b.0.total_cmp(&a.0));
        let beyond = beyond.into_iter().map(|(_, name)| name).collect();
        Self { how, t_last, problem, outputs, limit, beyond }
    }

    /// The output that is furthest beyond the limit, if one is.
    #[must_use]
    pub fn worst_beyond(&self) -> Option<&ColumnDifference> {
        let worst = self.beyond.first()?;
        self.outputs.iter().find(|output| output.name == *worst)
    }

    /// As reported at the end of a run. `unit` is that of the times.
    pub(super) fn report(&self, unit: &str) -> String {
        let head = format!("verified with {}; largest differences, which estimate the errors of this run:\n", self.how);
        let titles = ["output", "difference", "of its peak", "at t", ""];
        let mut rows = vec![titles.map(String::from).to_vec()];
        for output in &self.outputs {
            rows.push(vec![
                output.name.clone(),
                significant(output.absolute, 3),
                significant(output.relative, 3),
                significant(output.t, 7),
                if self.beyond.contains(&output.name) { "BEYOND".into() } else { String::new() },
            ]);
        }
        let table = aligned(&[Side::Left, Side::Right, Side::Right, Side::Right, Side::Left], &rows);
        let end = if self.problem.is_empty() {
            String::new()
        } else {
            let last = significant(self.t_last, 7);
            format!("  compared up to t = {last} {unit} only: the second run ended early ({})\n", self.problem)
        };
        head + &table + &end
    }
}
