//! What the plan says of what is saved.

use element_api::Kind;

use crate::model::Model;
use crate::plan::Plan;
use crate::program::{Equations, Node, Program};
use crate::scene::Scene;

/// The right side with a choice of rows.
pub(super) fn right_side(equations: &Equations, rows: &[usize]) -> Program {
    let mut nodes: Vec<Node> = equations.loads.clone();
    nodes.extend(&equations.state_rates);
    for row in rows.iter().map(|row| &equations.rows[*row]) {
        nodes.push(row.gamma);
        nodes.extend(row.jacobian.iter().map(|(_, node)| *node));
    }
    Program::compile(&equations.graph, &nodes)
}

/// Adds to the plan that the motion is found at each time.
pub(super) fn note_determined(plan: &mut Plan, determined: bool) {
    if determined {
        plan.skip(
            "integration of the motion",
            "no freedom is left: positions, velocities and reactions follow from the time",
        );
        let states = 13 * plan.layout.bodies;
        plan.saving(format!("the error control of {states} states: 5 evaluations a step, 12 with the default method"));
        plan.switched_by("kinematic");
    }
}

/// Adds to the plan what the equations and the requested outputs make unnecessary.
pub(super) fn note_skips(plan: &mut Plan, scene: &Scene, model: &Model, equations: &Equations) {
    let fixed = scene.bodies.iter().filter(|body| body.fixed).count();
    if fixed > 0 {
        plan.skip(plural(fixed, "body", "bodies"), "fixed: part of the ground");
        plan.saving(format!("{} velocities", 6 * fixed));
    }
    let off = scene.elements.iter().filter(|element| !element.enabled).count();
    if off > 0 {
        plan.skip(plural(off, "element", "elements"), "switched off in the scene");
        plan.saving("all of their operations");
    }
    note_constants(plan, model, equations);
    if equations.coupling.is_empty() && !equations.rows.is_empty() {
        plan.skip("iterations between forces and reactions", "no force depends on a reaction or an acceleration");
        plan.saving("2 or more solutions per evaluation");
    }
    let dynamics = model.channels.iter().any(|channel| needs_solver(&channel.quantity, model));
    if !dynamics && !model.channels.is_empty() {
        plan.skip("accelerations and reactions at output times", "no output asks for them");
        plan.saving(plural(scene.simulation.sample_times(&scene.units).len(), "solution", "solutions"));
        plan.switched_by("on-demand");
    }
    if !equations.rows.is_empty() {
        let reactions = model.elements.iter().filter(|e| e.class.kind == Kind::Joint).count();
        let asked = asked_reactions(model);
        if asked < reactions {
            plan.skip(
                format!("reactions of {} of {reactions} joints", reactions - asked),
                "no output asks for them; their multipliers are still solved for",
            );
            plan.saving(format!("{} components per output time", 6 * (reactions - asked)));
        }
    }
}

/// Constants and zeros among the derivatives of the constraints.
fn note_constants(plan: &mut Plan, model: &Model, equations: &Equations) {
    let (graph, rows) = (&equations.graph, &equations.rows);
    let entries = || rows.iter().flat_map(|row| &row.jacobian);
    let constant = entries().filter(|(_, node)| graph.value(*node).is_some()).count();
    if constant > 0 {
        plan.skip("derivatives that are constant", "folded when written down");
        plan.saving(format!("{constant} of {} entries of the Jacobian", entries().count()));
    }
    let possible: usize = model
        .elements
        .iter()
        .map(|element| {
            let mut bodies: Vec<usize> = element.markers.iter().filter_map(|marker| marker.body).collect();
            bodies.sort_unstable();
            bodies.dedup();
            6 * bodies.len() * element.rows.len()
        })
        .sum();
    if entries().count() < possible {
        plan.skip("derivatives that are zero", "no part of the Jacobian, nor of its factors");
        plan.saving(format!("{} of {possible} entries of the Jacobian", possible - entries().count()));
    }
    let still = rows.iter().filter(|row| graph.is_zero(row.gamma)).count();
    if still > 0 {
        plan.skip("gamma of some rows", "zero for every motion");
        plan.saving(format!("{still} of {} rows", rows.len()));
    }
    if !rows.is_empty() && rows.iter().all(|row| graph.is_zero(row.time)) {
        plan.skip("derivatives with respect to time", "no constraint depends on it");
        plan.saving(plural(rows.len(), "row", "rows"));
    }
}

fn asked_reactions(model: &Model) -> usize {
    use crate::model::Quantity;
    let mut joints: Vec<usize> = model
        .channels
        .iter()
        .filter_map(|channel| match &channel.quantity {
            Quantity::Load { element, .. } if model.elements[*element].class.kind == Kind::Joint => Some(*element),
            _ => None,
        })
        .collect();
    joints.sort_unstable();
    joints.dedup();
    joints.len()
}

/// Whether a quantity needs accelerations or multipliers.
fn needs_solver(quantity: &crate::model::Quantity, model: &Model) -> bool {
    use crate::model::{Level, Quantity};
    match quantity {
        Quantity::Point { level, .. } | Quantity::Angular { level, .. } | Quantity::Coordinate { level, .. } => {
            *level == Level::Acceleration
        }
        Quantity::Load { element, .. } => model.elements[*element].class.kind == Kind::Joint,
        _ => false,
    }
}

/// Names that are shown of a list.
const SHOWN: usize = 12;

/// A list of names; the first and the last of a long one.
pub(super) fn some(names: &[&str]) -> String {
    match names {
        [first @ .., last] if names.len() > SHOWN => format!("{}, ..., {last}", first[..SHOWN - 1].join(", ")),
        _ => names.join(", "),
    }
}

pub(super) fn plural(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}
