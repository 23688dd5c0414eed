//! What is decided from the numbers at one place of the motion.

use super::error::SessionError;
use crate::analysis::{Assembly, Constraints, mass_values, sparse_engine};
use crate::diagnostics::{Diagnostic, codes};
use crate::linalg::KktSolver;
use crate::model::Model;
use crate::plan::{Layout, Plan, Probe, body_scales, poses_of_bodies};
use crate::program::Equations;
use crate::scene::Scene;

/// Why the rank-safe engine is used throughout where a choice of rows is switched off.
const ALL_ROWS: &str = "no choice of rows is wanted";

/// Decides what to compute, from the numbers at a time and assembled position; `row_choice`: whether rows may be left out.
pub(super) fn decide(
    scene: &Scene,
    model: &Model,
    equations: &Equations,
    layout: &Layout,
    (t, assembly): (f64, &Assembly),
    row_choice: bool,
) -> Result<Plan, SessionError> {
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
    let no_choice = (!row_choice).then_some(ALL_ROWS);
    // The pattern of a choice is analysed once, whatever it is asked about.
    let mut analysed = None;
    Plan::decide(model, layout, &probe, no_choice, |chosen, mass| {
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
    })
    .map_err(|e| broken(&e))
}
