//! What the plan says of what is saved.

use element_api::Kind;

use super::opened::Session;
use crate::model::Model;
use crate::plan::{Layout, Plan};
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

/// Work that is not done, and why that changes no result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Skip {
    /// What is left out.
    pub(super) what: String,
    /// Why it may be left out.
    pub(super) why: String,
    /// What that saves, as a number with its unit in words; may be empty.
    pub(super) saved: String,
    /// The name under which it can be switched off (see [`crate::plan::SAVINGS`]), if it can.
    pub(super) switch: Option<&'static str>,
}

/// What of a session is not computed.
#[derive(Default)]
pub(super) struct Savings {
    pub(super) list: Vec<Skip>,
}

impl Savings {
    /// What equations, requested outputs and freedoms make unnecessary; so many of the angles are counted.
    pub(super) fn of(session: &Session, counted: usize) -> Vec<Skip> {
        let mut savings = Self::default();
        note_redundancy(&mut savings, &session.plan);
        note_skips(&mut savings, &session.scene, &session.model, &session.equations);
        note_determined(&mut savings, session);
        note_angles(&mut savings, &session.plan.layout, counted);
        savings.list
    }

    fn skip(&mut self, what: impl Into<String>, why: impl Into<String>) {
        self.list.push(Skip { what: what.into(), why: why.into(), saved: String::new(), switch: None });
    }

    /// Adds what the entry made last saves.
    fn saving(&mut self, saved: impl Into<String>) {
        if let Some(last) = self.list.last_mut() {
            last.saved = saved.into();
        }
    }

    /// Adds the switch of the entry made last.
    fn switched_by(&mut self, switch: &'static str) {
        if let Some(last) = self.list.last_mut() {
            last.switch = Some(switch);
        }
    }
}

fn note_redundancy(savings: &mut Savings, plan: &Plan) {
    if !plan.redundant_rows.is_empty() {
        let count = plan.redundant_rows.len();
        savings.skip(
            plural(count, "constraint row", "constraint rows"),
            "dependent on the others at the assembled position; taken up again where the rank changes",
        );
        savings.saving(format!("{count} of {} unknown multipliers", plan.layout.rows));
        savings.switched_by("row-choice");
    }
}

/// The motion is found at each time.
fn note_determined(savings: &mut Savings, session: &Session) {
    if session.determined {
        savings.skip(
            "integration of the motion",
            "no freedom is left: positions, velocities and reactions follow from the time",
        );
        let states = 13 * session.plan.layout.bodies;
        savings
            .saving(format!("the error control of {states} states: 5 evaluations a step, 12 with the default method"));
        savings.switched_by("kinematic");
    }
}

/// Angles whose turns nobody asks for.
fn note_angles(savings: &mut Savings, layout: &Layout, counted: usize) {
    let others = layout.references - counted;
    if others > 0 {
        savings.skip(
            format!("turns of {}", plural(others, "joint angle", "joint angles")),
            "no load, memory or output depends on how often they have turned",
        );
        savings.saving("their evaluation in every accepted state, and their enclosure over every step");
    }
}

/// What the equations and the requested outputs make unnecessary.
fn note_skips(savings: &mut Savings, scene: &Scene, model: &Model, equations: &Equations) {
    let fixed = scene.bodies.iter().filter(|body| body.fixed).count();
    if fixed > 0 {
        savings.skip(plural(fixed, "body", "bodies"), "fixed: part of the ground");
        savings.saving(format!("{} velocities", 6 * fixed));
    }
    let off = scene.elements.iter().filter(|element| !element.enabled).count();
    if off > 0 {
        savings.skip(plural(off, "element", "elements"), "switched off in the scene");
        savings.saving("all of their operations");
    }
    note_constants(savings, model, equations);
    if equations.coupling.is_empty() && !equations.rows.is_empty() {
        savings.skip("iterations between forces and reactions", "no force depends on a reaction or an acceleration");
        savings.saving("2 or more solutions per evaluation");
    }
    let dynamics = model.channels.iter().any(|channel| needs_solver(&channel.quantity, model))
        || taken_reactions(model).next().is_some();
    if !dynamics && !model.channels.is_empty() {
        savings.skip("accelerations and reactions at output times", "no output asks for them");
        savings.saving(plural(scene.simulation.sample_times(&scene.units).len(), "solution", "solutions"));
        savings.switched_by("on-demand");
    }
    if !equations.rows.is_empty() {
        let reactions = model.elements.iter().filter(|e| e.class.kind == Kind::Joint).count();
        let asked = asked_reactions(model);
        if asked < reactions {
            savings.skip(
                format!("reactions of {} of {reactions} joints", reactions - asked),
                "no output asks for them; their multipliers are still solved for",
            );
            savings.saving(format!("{} components per output time", 6 * (reactions - asked)));
        }
    }
}

/// Constants and zeros among the derivatives of the constraints.
fn note_constants(savings: &mut Savings, model: &Model, equations: &Equations) {
    let (graph, rows) = (&equations.graph, &equations.rows);
    let entries = || rows.iter().flat_map(|row| &row.jacobian);
    let constant = entries().filter(|(_, node)| graph.value(*node).is_some()).count();
    if constant > 0 {
        savings.skip("derivatives that are constant", "folded when written down");
        savings.saving(format!("{constant} of {} entries of the Jacobian", entries().count()));
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
        savings.skip("derivatives that are zero", "no part of the Jacobian, nor of its factors");
        savings.saving(format!("{} of {possible} entries of the Jacobian", possible - entries().count()));
    }
    let still = rows.iter().filter(|row| graph.is_zero(row.gamma)).count();
    if still > 0 {
        savings.skip("gamma of some rows", "zero for every motion");
        savings.saving(format!("{still} of {} rows", rows.len()));
    }
    if !rows.is_empty() && rows.iter().all(|row| graph.is_zero(row.time)) {
        savings.skip("derivatives with respect to time", "no constraint depends on it");
        savings.saving(plural(rows.len(), "row", "rows"));
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
        .chain(taken_reactions(model))
        .collect();
    joints.sort_unstable();
    joints.dedup();
    joints.len()
}

/// The joints whose reactions elements take that are looked at while the scene runs.
fn taken_reactions(model: &Model) -> impl Iterator<Item = usize> {
    let of = |watched: crate::model::Watched| model.elements[watched.element].joints.clone();
    model.watched().into_iter().flat_map(of)
}

/// Whether a quantity needs accelerations or multipliers.
pub(super) fn needs_solver(quantity: &crate::model::Quantity, model: &Model) -> bool {
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
