//! [`project_plainly`]: positions by Newton's method, and velocities, brought to the constraints, in any coordinates.

use super::formulation::AnalysisError;
use super::motion::{Engines, NEAR_SINGULAR};

/// Violations below this share of the scene's size are round-off.
pub(super) const ROUND_OFF: f64 = 4.0 * f64::EPSILON;
/// Newton corrections per projection before the constraints count as lost.
const MOST_CORRECTIONS: usize = 12;

/// Brings positions and velocities to the constraints; with `keep_away`, refused next to a singular position.
///
/// # Errors
/// See [`AnalysisError`].
pub(super) fn project_plainly<F: Engines>(
    form: &mut F,
    t: f64,
    state: &mut [f64],
    keep_away: bool,
) -> Result<(), AnalysisError> {
    form.motion().normalise(state);
    if form.rows() == 0 {
        return Ok(());
    }
    if form.motion().careful {
        form.motion_mut().load(t, state);
        form.before_corrections()?;
    }
    project_positions(form, t, state, keep_away)?;
    form.correct_velocities()?;
    form.motion().change_velocities(state);
    Ok(())
}

/// Brings positions to the constraints; with `keep_away`, refused next to a singular position. Without it they are corrected once
/// more than usual: what is left of violations goes into the positions divided by the distance.
///
/// # Errors
/// See [`AnalysisError`].
fn project_positions<F: Engines>(
    form: &mut F,
    t: f64,
    state: &mut [f64],
    keep_away: bool,
) -> Result<(), AnalysisError> {
    let length = form.motion().length;
    let mut again = !keep_away;
    for correction in 0..MOST_CORRECTIONS {
        form.motion_mut().load(t, state);
        let (violation, row) = form.correct_positions(!keep_away)?;
        if keep_away && violation.is_finite() && form.motion().corrected_safely && form.is_singular(NEAR_SINGULAR) {
            return Err(AnalysisError::NextToSingular);
        }
        if !violation.is_finite() {
            return Err(AnalysisError::NotFinite { what: format!("constraint {}", form.motion().row_name(row)) });
        }
        if keep_away && correction == 0 && violation > form.motion().most_off * length {
            let what = form.motion().row_name(row);
            return Err(AnalysisError::LeftConstraints { what, violation: violation / length });
        }
        if keep_away && violation <= ROUND_OFF * length {
            return Ok(());
        }
        form.motion_mut().counters.position_corrections += 1;
        let size = form.motion().move_along(state);
        // Quadratic convergence: the next violation is about size^2 / length.
        let converged = (size / length).powi(2) <= ROUND_OFF;
        if converged && !std::mem::take(&mut again) {
            form.motion_mut().load(t, state);
            return Ok(());
        }
    }
    form.motion_mut().load(t, state);
    let (violation, row) = form.correct_positions(false)?;
    // Near-singular positions stall at a small violation; far ones mean that the branch is lost.
    if violation > 1e-9 * length {
        return Err(AnalysisError::LeftConstraints {
            what: form.motion().row_name(row),
            violation: violation / length,
        });
    }
    Ok(())
}
