//! [`Closing`]: how accelerations and multipliers z follow that are solved for together with what depends on them, z = F(z).

use std::ops::Range;

use super::formulation::AnalysisError;
use crate::linalg::FullPivLu;

/// Share of the largest pivot up to which a pivot is zero.
const TOLERANCE: f64 = 1e-14;

/// I - F_z factored: where F changes by r as z stays, z follows with (I - F_z) dz = r.
pub(super) struct Closing {
    matrix: FullPivLu,
    units: Vec<f64>,
    scaled: Vec<f64>,
}

impl Closing {
    /// For so many accelerations and multipliers.
    pub(super) fn new(n: usize) -> Self {
        Self { matrix: FullPivLu::new(n, TOLERANCE), units: vec![1.0; n], scaled: vec![0.0; n] }
    }

    /// Where F_z is written, column by column, before each factorisation.
    pub(super) fn slopes_mut(&mut self) -> &mut [f64] {
        self.matrix.entries_mut()
    }

    /// Factors what was written, in units of z that make it comparable; `false` where that is not finite.
    pub(super) fn factor(&mut self, units: Vec<f64>) -> Result<bool, AnalysisError> {
        self.units = units;
        let n = self.units.len();
        let entries = self.matrix.entries_mut();
        for (column, along) in entries.chunks_exact_mut(n).zip(&self.units) {
            column.iter_mut().zip(&self.units).for_each(|(entry, of)| *entry *= -(along / of));
        }
        entries.iter_mut().step_by(n + 1).for_each(|entry| *entry += 1.0);
        let is_finite = entries.iter().all(|x| x.is_finite());
        if is_finite {
            self.matrix.factor()?;
        }
        Ok(is_finite)
    }

    /// Whether z was determined where it was factored last.
    pub(super) fn is_regular(&self) -> bool {
        self.matrix.rank() == self.units.len()
    }

    /// A change of F becomes what z follows it with.
    pub(super) fn solve(&mut self, change: &mut [f64]) -> Result<(), AnalysisError> {
        let scaled = change.iter().zip(&self.units).map(|(change, unit)| change / unit);
        self.scaled.iter_mut().zip(scaled).for_each(|(slot, value)| *slot = value);
        self.matrix.solve(&self.scaled, change)?;
        change.iter_mut().zip(&self.units).for_each(|(change, unit)| *change *= unit);
        Ok(())
    }
}

/// The units of z in which the largest acceleration and the largest multiplier are one, whatever those of the scene are.
pub(super) fn units(slots: &[usize], solved: &[Range<usize>; 2], inputs: &[f64]) -> Vec<f64> {
    let sizes = solved.each_ref().map(|all| largest(&inputs[all.clone()]));
    let sizes = if sizes.iter().all(|size| *size > f64::MIN_POSITIVE) { sizes } else { [1.0; 2] };
    slots.iter().map(|slot| sizes[usize::from(*slot >= solved[1].start)]).collect()
}

/// The acceleration or multiplier of a slot, of a solution with these rows in use, ascending.
pub(super) fn solved_at(
    slot: usize,
    solved: &[Range<usize>; 2],
    (rows, accelerations, multipliers): (&[usize], &[f64], &[f64]),
) -> f64 {
    match slot.checked_sub(solved[1].start) {
        None => accelerations[slot - solved[0].start],
        // A row that is not in use has the multiplier zero.
        Some(row) => rows.binary_search(&row).map_or(0.0, |k| multipliers[k]),
    }
}

/// The largest magnitude, and more than zero.
pub(super) fn largest(list: &[f64]) -> f64 {
    list.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()))
}
