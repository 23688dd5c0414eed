//! What is decided from the numbers at one place of the motion.

use super::error::SessionError;
use crate::analysis::{Assembly, Constraints, mass_values, sparse_engine};
use crate::diagnostics::{Diagnostic, codes};
use crate::linalg::{Health, KktSolver, LinalgError};
use crate::model::Model;
use crate::plan::{Determinacy, Layout, Plan, Probe, body_scales, poses_of_bodies};
use crate::program::Equations;
use crate::scene::Scene;

/// Why the rank-safe engine is used throughout where a choice of rows is switched off.
const ALL_ROWS: &str = "no choice of rows is wanted";

/// A place of the motion: its time, and the state that was assembled there.
type Place<'a> = (f64, &'a Assembly);
/// Tries the sparse engine on a choice of rows: see [`Plan::decide`].
type SparseHealth<'a> = &'a mut dyn FnMut(&[usize], &[f64]) -> Result<Health, LinalgError>;

/// Decides what to compute, from the numbers at a time and assembled position; `row_choice`: whether rows may be left out.
pub(super) fn decide(
    scene: &Scene,
    model: &Model,
    equations: &Equations,
    layout: &Layout,
    place: Place<'_>,
    row_choice: bool,
) -> Result<Plan, SessionError> {
    let no_choice = (!row_choice).then_some(ALL_ROWS);
    let decide = |probe: &Probe<'_>, health: SparseHealth<'_>| Plan::decide(model, layout, probe, no_choice, health);
    probed(scene, model, equations, layout, place, decide)
}

/// What the joints determine at another place than the one that was decided at.
pub(super) fn determinacy(
    scene: &Scene,
    model: &Model,
    equations: &Equations,
    layout: &Layout,
    place: Place<'_>,
) -> Result<Determinacy, SessionError> {
    let find = |probe: &Probe<'_>, health: SparseHealth<'_>| Determinacy::find(model, layout, probe, health);
    probed(scene, model, equations, layout, place, find)
}

/// Asks about the numbers at a place.
fn probed<T>(
    scene: &Scene,
    model: &Model,
    equations: &Equations,
    layout: &Layout,
    (t, assembly): Place<'_>,
    ask: impl FnOnce(&Probe<'_>, SparseHealth<'_>) -> Result<T, LinalgError>,
) -> Result<T, SessionError> {
    let broken = |error: &dyn std::fmt::Display| {
        SessionError::one(
            &scene.source,
            Diagnostic::error(codes::SINGULAR_MASS, format!("the equations of motion have no solution: {error}")),
        )
    };
    let inputs = crate::analysis::start_inputs(layout, t, assembly);
    let mut rows = Constraints::of_all(equations).map_err(|e| broken(&e))?;
    rows.evaluate(&inputs, &model.sets).map_err(|e| broken(&e))?;
    let (positions, rotations) = poses_of_bodies(&assembly.working, layout.bodies);
    let mass = mass_values(model);
    let probe = Probe {
        rows: &rows.rows,
        structure: &rows.structure,
        mass: &mass,
        jacobian: rows.jacobian(),
        positions: &positions,
        rotations: &rotations,
        length: assembly.scales.length,
        scales: &body_scales(model, assembly.scales.length),
    };
    // The pattern of a choice is analysed once, whatever it is asked about.
    let mut analysed = None;
    let mut sparse_health = |chosen: &[usize], mass: &[f64]| {
        let known = analysed.take().filter(|(rows, _): &(Vec<usize>, _)| rows == chosen);
        let (_, solver) = match known {
            Some(known) => analysed.insert(known),
            None => analysed.insert((chosen.to_vec(), sparse_engine(equations, chosen, layout)?)),
        };
        solver.set_mass(mass)?;
        // The values of the chosen rows, picked from those of all.
        let entries = rows.structure.jacobian.iter().zip(rows.jacobian());
        let picked: Vec<f64> = entries
            .filter(|((row, _), _)| chosen.binary_search(&rows.rows[*row]).is_ok())
            .map(|(_, value)| *value)
            .collect();
        solver.refactor(&picked)
    };
    ask(&probe, &mut sparse_health).map_err(|e| broken(&e))
}
