//! [`project_positions`]: Newton's method on the constraints on positions, in any coordinates.

use super::formulation::AnalysisError;
use super::passage::Refusing;

/// Violations below this share of the scene's size are round-off.
pub(super) const ROUND_OFF: f64 = 4.0 * f64::EPSILON;
/// Newton corrections per projection before the constraints count as lost.
const MOST_CORRECTIONS: usize = 12;

/// A formulation whose positions are corrected.
pub(super) trait Correcting: Refusing {
    /// Writes time and state into the inputs of programs.
    fn load(&mut self, t: f64, state: &[f64]);
    /// Length of the scene, m.
    fn length(&self) -> f64;
    /// Finds the smallest move (in the metric of the mass) that meets the rows to first order. Gives the worst violation, m, and its
    /// row. Unless `finely`, violations that are round-off are left alone.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn correct_positions(&mut self, finely: bool) -> Result<(f64, Option<usize>), AnalysisError>;
    /// Whether that was found by the rank-safe engine, next to a singular position.
    fn was_next_to_singular(&self) -> bool;
    /// Moves along it; gives its size, m.
    fn move_along(&self, state: &mut [f64]) -> f64;
    /// Joint and row.
    fn name_of(&self, row: Option<usize>) -> String;
}

/// Brings positions to the constraints; with `keep_away`, refused next to a singular position. Without it they are corrected once
/// more than usual: what is left of violations goes into the positions divided by the distance.
///
/// # Errors
/// See [`AnalysisError`].
pub(super) fn project_positions<F: Correcting>(
    form: &mut F,
    t: f64,
    state: &mut [f64],
    keep_away: bool,
) -> Result<(), AnalysisError> {
    let length = form.length();
    let mut again = !keep_away;
    for _ in 0..MOST_CORRECTIONS {
        form.load(t, state);
        let (violation, row) = form.correct_positions(!keep_away)?;
        if keep_away && violation.is_finite() && form.was_next_to_singular() {
            return Err(AnalysisError::NextToSingular);
        }
        if !violation.is_finite() {
            return Err(AnalysisError::NotFinite { what: format!("constraint {}", form.name_of(row)) });
        }
        if keep_away && violation <= ROUND_OFF * length {
            return Ok(());
        }
        form.counted().position_corrections += 1;
        let size = form.move_along(state);
        // Quadratic convergence: the next violation is about size^2 / length.
        let converged = (size / length).powi(2) <= ROUND_OFF;
        if converged && !std::mem::take(&mut again) {
            form.load(t, state);
            return Ok(());
        }
    }
    form.load(t, state);
    let (violation, row) = form.correct_positions(false)?;
    // Near-singular positions stall at a small violation; far ones mean that the branch is lost.
    if violation > 1e-9 * length {
        return Err(AnalysisError::LeftConstraints { what: form.name_of(row), violation: violation / length });
    }
    Ok(())
}
