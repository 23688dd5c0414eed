//! What is pruned before a run: switches, merged bodies, planar motion.

use super::decide::{ALL_ROWS, decide};
use super::error::{Exit, SessionError};
use super::opened::{MergedCase, PlanarCase, Session};
use super::savings::{note_merged, planar_skip};
use crate::analysis::{Assembly, Constraints, mass_values, merge, sparse_engine, start_inputs};
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::linalg::{DenseQr, KktSolver, LinalgError};
use crate::model::Model;
use crate::plan::{Layout, Plan, Pruning, SAVINGS, body_scales, close_to_dependent};
use crate::program::{Equations, Form, Planar};
use crate::scene::Scene;

/// Below this pivot ratio at the start, the sparse engine is not trusted with the rows along the plane.
const LEAST_HEALTH: f64 = 1e-8;
/// Share of the largest pivot below which a row along the plane counts as dependent.
const RANK_TOLERANCE: f64 = 1e-9;

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
        SessionError::one(Exit::Scene, &scene.source, diagnostic)
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
        && layout.states + layout.given_at == 0
        && model.elements.iter().all(|element| !element.class.opaque)
}

impl Session {
    /// Makes bodies that joints without freedom hold together one, and tells the plan.
    ///
    /// # Errors
    /// When the linear algebra refuses the merged scene.
    pub(super) fn merge_bodies(&mut self) -> Result<(), SessionError> {
        if !self.pruning.merged {
            return Ok(());
        }
        let (merging, refused) = merge(&self.equations, &self.model, &self.plan.layout, &self.assembly);
        for joint in refused {
            let name = &self.model.elements[joint.element].name;
            self.plan.impossible.push(("merged", format!("by `{name}`: {}", joint.why)));
        }
        let Some(mut merging) = merging else { return Ok(()) };
        let layout = Layout::new(&merging.model);
        let mut equations = Equations::build(&merging.model, &layout, Form::Working);
        equations.graph.writing = self.equations.graph.writing;
        let (t, place) = self.place_of_ranks();
        let place = place.merged(&merging);
        let mut start_health = 0.0;
        // Opaque elements are asked for numbers.
        std::mem::swap(&mut merging.model.sets, &mut self.model.sets);
        let plan = decide(&self.scene, &merging.model, &equations, &layout, (t, &place), &mut start_health);
        std::mem::swap(&mut merging.model.sets, &mut self.model.sets);
        let mut plan = plan?;
        if !self.pruning.row_choice {
            plan.always_rank_safe = Some(ALL_ROWS.into());
        }
        let assembly = self.assembly.merged(&merging);
        let case = MergedCase { merging, equations, plan, assembly, start_health };
        note_merged(&mut self.plan, &case, &self.model, &self.equations);
        self.merged = Some(case);
        Ok(())
    }

    /// Looks for a plane that the motion stays parallel to, and tells the plan.
    pub(super) fn find_plane(&mut self) {
        if !self.pruning.planar {
            return;
        }
        let ahead = self.ahead.as_ref().map(|(t, place)| match &self.merged {
            Some(case) => (*t, place.merged(&case.merging)),
            None => (*t, place.clone()),
        });
        let t = self.begins.time;
        let Self { equations, model, assembly, plan, .. } = &*self;
        let (equations, model, assembly, plan) = match &self.merged {
            Some(case) => (&case.equations, &case.merging.model, &case.assembly, &case.plan),
            None => (equations, model, assembly, plan),
        };
        let found = planar_case(equations, model, assembly, plan, (t, ahead), self.pruning);
        let told = planar_skip(&found, equations, plan);
        self.planar = found.ok();
        match told {
            Ok(skip) => self.plan.skips.push(skip),
            Err(why) => self.plan.impossible.push(("planar", why)),
        }
    }
}

/// Looks for a plane; the reason in words where there is none.
fn planar_case(
    equations: &Equations,
    model: &Model,
    assembly: &Assembly,
    plan: &Plan,
    (t, ahead): (f64, Option<(f64, Assembly)>),
    pruning: Pruning,
) -> Result<PlanarCase, String> {
    let layout = &plan.layout;
    let planar = Planar::find(equations, model, layout, &assembly.working, assembly.scales.length);
    let planar = planar.map_err(|reason| reason.why)?;
    let start = Assembly { working: planar.start.clone(), ..assembly.clone() };
    let (t, mut place) = ahead.unwrap_or((t, start));
    // What lies across the plane is as it was found to be.
    planar.still.iter().for_each(|at| place.working[*at] = planar.start[*at]);
    let found = plan_along(&planar, model, &place, plan, t).map_err(|error| error.to_string())?;
    let (mut plan, start_health) = found;
    if !pruning.row_choice {
        plan.always_rank_safe = Some(ALL_ROWS.into());
    }
    Ok(PlanarCase { planar, plan, start_health })
}

/// The plan of the rows along the plane. Rows along and across it have no column in common, so that their ranks add up, and
/// a choice of independent rows of all is one of either.
fn plan_along(
    planar: &Planar,
    model: &Model,
    place: &Assembly,
    whole: &Plan,
    t: f64,
) -> Result<(Plan, f64), Box<dyn std::error::Error>> {
    let layout: &Layout = &whole.layout;
    let along = |row: usize| planar.rows.binary_search(&row).is_ok();
    let mut plan = whole.clone();
    plan.independent_rows.retain(|row| along(*row));
    plan.redundant_rows.retain(|redundant| along(redundant.row));
    plan.health.rank = plan.independent_rows.len();
    let inputs = start_inputs(layout, t, place);
    let mass = mass_values(model);
    let numbers = |rows: &[usize]| -> Result<Constraints, Box<dyn std::error::Error>> {
        let mut found = Constraints::new(&planar.equations, model, rows, &[], &[])?;
        found.evaluate(&inputs, &model.sets)?;
        Ok(found)
    };
    if whole.health.smallest_pivot_ratio > 0.0 {
        let found = numbers(&planar.rows)?;
        let mut engine = DenseQr::new(&found.structure, RANK_TOLERANCE)?;
        engine.set_measure(&body_scales(model, place.scales.length))?;
        engine.set_mass(&mass)?;
        plan.health = engine.refactor(found.jacobian())?;
    }
    let found = numbers(&plan.independent_rows)?;
    let mut start_health = 0.0;
    let sparse = |mass: &[f64]| -> Result<f64, LinalgError> {
        let mut engine = sparse_engine(&planar.equations, model, &plan.independent_rows, layout)?;
        engine.set_mass(mass)?;
        Ok(engine.refactor(found.jacobian())?.smallest_pivot_ratio)
    };
    let alike = found.structure.metric(&body_scales(model, place.scales.length));
    let independence = sparse(&alike).unwrap_or(0.0);
    let reason = match sparse(&mass) {
        Ok(ratio) => {
            start_health = ratio;
            (ratio < LEAST_HEALTH).then(|| close_to_dependent(ratio, independence))
        }
        Err(error) => Some(error.to_string()),
    };
    plan.always_rank_safe = reason;
    plan.independence = independence;
    Ok((plan, start_health))
}
