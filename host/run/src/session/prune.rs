//! What is pruned before a run.

use super::error::SessionError;
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::model::Model;
use crate::plan::{Plan, Pruning, SAVINGS};
use crate::program::Equations;
use crate::scene::Scene;

/// The savings that a scene allows.
pub(super) fn allowed(scene: &Scene) -> Result<Pruning, SessionError> {
    let names = &scene.simulation.without;
    Pruning::without(names.iter().map(|name| name.value.as_str())).map_err(|k| {
        let known: Vec<&str> = SAVINGS.iter().map(|(name, _)| *name).collect();
        let nearest = suggest(&names[k].value, known.iter().copied()).map(|n| format!("did you mean `{n}`?"));
        let diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("there is no saving `{}`", names[k].value))
            .at(names[k].span.clone(), "cannot be switched off")
            .help_if(nearest)
            .help(format!("known are {}", known.join(", ")));
        SessionError::one(&scene.source, diagnostic)
    })
}

/// Whether the time determines the motion: something is driven, no freedom is left, and elements have no states of their own.
/// A method that the scene names is used all the same.
pub(super) fn is_determined(
    scene: &Scene,
    model: &Model,
    equations: &Equations,
    plan: &Plan,
    pruning: Pruning,
) -> bool {
    let layout = &plan.layout;
    pruning.kinematic
        && equations.rows.iter().any(|row| !equations.graph.is_zero(row.time))
        && scene.simulation.method.is_none()
        && plan.mobility == 0
        && equations.rows.iter().all(|row| !row.of_velocities)
        && !equations.has_events()
        && layout.states + layout.given_at == 0
        && model.elements.iter().all(|element| !element.class.opaque && element.recording.sample_period().is_none())
}
