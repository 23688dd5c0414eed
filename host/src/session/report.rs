//! What `odyn check` and `odyn plan` say.

use std::fmt::Write as _;

use element_api::Kind;
use serde::Serialize;

use super::open::Session;
use crate::model::Model;
use crate::plan::Plan;
use crate::program::{Equations, Node, Program, costs};
use crate::scene::{GROUND, Scene};

/// A reaction that rigid bodies do not determine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct NonUnique {
    /// The joint.
    pub joint: String,
    /// The body it acts on.
    pub on: String,
    /// Components, such as `force z` or `torque x`.
    pub components: Vec<String>,
}

/// What `odyn check` finds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CheckReport {
    /// Bodies that can move.
    pub bodies: usize,
    /// Joints.
    pub joints: usize,
    /// Force elements.
    pub forces: usize,
    /// Constraint rows.
    pub rows: usize,
    /// Independent ones among them.
    pub rank: usize,
    /// Degrees of freedom.
    pub mobility: usize,
    /// Joint and row of each redundant one.
    pub redundant_rows: Vec<String>,
    /// Reactions that are not unique.
    pub non_unique_reactions: Vec<NonUnique>,
    /// Bodies that assembly moved.
    pub moved_bodies: Vec<String>,
}

/// A decision of the plan.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Decision {
    /// What is left out.
    pub what: String,
    /// Why that changes no result.
    pub why: String,
}

/// What `odyn plan` tells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanReport {
    /// Bodies, elements and loops of each island.
    pub islands: Vec<String>,
    /// How accelerations are solved for.
    pub engine: String,
    /// Unknowns of the system for accelerations and multipliers.
    pub unknowns: usize,
    /// Operations written down before simplification, for all equations and derivatives.
    pub operations_requested: usize,
    /// Distinct operations that remained.
    pub operations_distinct: usize,
    /// Operations per evaluation of the right side.
    pub operations_per_evaluation: usize,
    /// Kernels among them: what many bodies or joints repeat, written once.
    pub kernels: usize,
    /// Operations written down for the right side, those of a kernel once.
    pub operations_written: usize,
    /// Size of the machine code for the right side, if it is made, bytes (predicted).
    pub machine_code_bytes: u64,
    /// Time to make it, s (predicted).
    pub machine_code_time_s: f64,
    /// Evaluations after which it has paid for itself (predicted).
    pub machine_code_pays_after: u64,
    /// Opaque elements, called at run time.
    pub opaque: Vec<String>,
    /// What is skipped.
    pub skipped: Vec<Decision>,
}

impl Session {
    /// What `odyn check` finds.
    #[must_use]
    pub fn check_report(&self) -> CheckReport {
        let count = |kind| self.model.elements.iter().filter(|e| e.class.kind == kind).count();
        CheckReport {
            bodies: self.model.bodies.len(),
            joints: count(Kind::Joint),
            forces: count(Kind::Force),
            rows: self.plan.layout.rows,
            rank: self.plan.independent_rows.len(),
            mobility: self.plan.mobility,
            redundant_rows: self.plan.redundant_rows.iter().map(|row| row.name.clone()).collect(),
            non_unique_reactions: self.non_unique(),
            moved_bodies: self.assembly.moves.iter().map(|m| m.body.clone()).collect(),
        }
    }

    fn non_unique(&self) -> Vec<NonUnique> {
        let mut list = Vec::new();
        for reaction in self.plan.reactions.iter().filter(|r| !r.is_unique()) {
            let instance = &self.model.elements[reaction.element];
            let axis = ["x", "y", "z"];
            let named = |unique: &[bool; 3], what: &str| -> Vec<String> {
                (0..3).filter(|k| !unique[*k]).map(|k| format!("{what} {}", axis[k])).collect()
            };
            let mut components = named(&reaction.force, "force");
            components.extend(named(&reaction.torque, "torque"));
            let body = instance.markers[reaction.frame].body;
            list.push(NonUnique {
                joint: instance.name.clone(),
                on: body.map_or(GROUND.into(), |b| self.model.bodies[b].name.clone()),
                components,
            });
        }
        list
    }

    /// What `odyn plan` tells.
    #[must_use]
    pub fn plan_report(&self) -> PlanReport {
        let rows = self.plan.independent_rows.iter().map(|row| &self.equations.rows[*row]);
        let mut nodes: Vec<Node> = self.equations.loads.clone();
        nodes.extend(&self.equations.state_rates);
        for row in rows {
            nodes.push(row.gamma);
            nodes.extend(row.jacobian.iter().map(|(_, node)| *node));
        }
        let islands = self.plan.topology.islands.iter().map(|island| {
            let names: Vec<&str> = island.bodies.iter().map(|b| self.model.bodies[*b].name.as_str()).collect();
            format!(
                "{} ({}), {} elements, {}",
                plural(names.len(), "body", "bodies"),
                names.join(", "),
                island.elements.len(),
                plural(island.loops, "closed loop", "closed loops")
            )
        });
        let engine = match &self.plan.always_rank_safe {
            None => "sparse elimination along the topology; rank-safe where the rank falls".into(),
            Some(why) => format!("rank-safe throughout: {why}"),
        };
        let opaque = self.model.elements.iter().filter(|e| e.class.opaque);
        let program = Program::compile(&self.equations.graph, &nodes);
        let (operations, compiled) = (program.operations(), program.straight_operations());
        PlanReport {
            islands: islands.collect(),
            engine,
            unknowns: self.plan.layout.velocities() + self.plan.independent_rows.len(),
            operations_requested: self.equations.graph.requested,
            operations_distinct: self.equations.graph.len(),
            operations_per_evaluation: operations,
            kernels: program.kernel_count(),
            operations_written: program.written_operations(),
            machine_code_bytes: (costs::CODE * compiled as f64) as u64,
            machine_code_time_s: costs::COMPILING * compiled as f64,
            machine_code_pays_after: costs::runs_that_pay() as u64,
            opaque: opaque.map(|e| format!("{} ({}/{})", e.name, e.library, e.class.name)).collect(),
            skipped: self
                .plan
                .skips
                .iter()
                .map(|skip| Decision { what: skip.what.clone(), why: skip.why.clone() })
                .collect(),
        }
    }
}

/// Adds to the plan what the equations and the requested outputs make unnecessary.
pub(super) fn note_skips(plan: &mut Plan, scene: &Scene, model: &Model, equations: &Equations) {
    let fixed = scene.bodies.iter().filter(|body| body.fixed).count();
    if fixed > 0 {
        plan.skip(plural(fixed, "body", "bodies"), "fixed: part of the ground, no unknowns");
    }
    let off = scene.elements.iter().filter(|element| !element.enabled).count();
    if off > 0 {
        plan.skip(plural(off, "element", "elements"), "switched off in the scene");
    }
    let constant = equations
        .rows
        .iter()
        .filter(|row| row.jacobian.iter().all(|(_, node)| equations.graph.value(*node).is_some()))
        .count();
    if constant > 0 {
        plan.skip(format!("derivatives of {}", plural(constant, "row", "rows")), "constant: folded when written down");
    }
    let still = equations.rows.iter().filter(|row| equations.graph.is_zero(row.gamma)).count();
    if still > 0 {
        plan.skip(format!("gamma of {}", plural(still, "row", "rows")), "zero for every motion");
    }
    if !equations.rows.is_empty() && equations.rows.iter().all(|row| equations.graph.is_zero(row.time)) {
        plan.skip("derivatives with respect to time", "no constraint depends on it");
    }
    if equations.coupling.is_empty() && !equations.rows.is_empty() {
        plan.skip("iterations between forces and reactions", "no force depends on a reaction or an acceleration");
    }
    let dynamics = model.channels.iter().any(|channel| needs_solver(&channel.quantity, model));
    if !dynamics && !model.channels.is_empty() {
        plan.skip("accelerations and reactions at output times", "no output asks for them");
    }
    if !equations.rows.is_empty() {
        let reactions = model.elements.iter().filter(|e| e.class.kind == Kind::Joint).count();
        let asked = asked_reactions(model);
        if asked < reactions {
            plan.skip(
                format!("reactions of {} of {reactions} joints", reactions - asked),
                "no output asks for them; their multipliers are still solved for",
            );
        }
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

fn plural(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

impl std::fmt::Display for CheckReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(
            f,
            "{}, {}, {}",
            plural(self.bodies, "body", "bodies"),
            plural(self.joints, "joint", "joints"),
            plural(self.forces, "force element", "force elements")
        )?;
        writeln!(
            f,
            "mobility {}: {} velocities, {} constraint rows of rank {}",
            self.mobility,
            6 * self.bodies,
            self.rows,
            self.rank
        )?;
        if self.redundant_rows.is_empty() {
            writeln!(f, "no redundant rows: every reaction is unique")?;
        } else {
            writeln!(f, "{}:", plural(self.redundant_rows.len(), "redundant row", "redundant rows"))?;
            for row in &self.redundant_rows {
                writeln!(f, "    {row}")?;
            }
            writeln!(f, "reactions that rigid bodies do not determine (axes of the ground):")?;
            for reaction in &self.non_unique_reactions {
                writeln!(f, "    {} on {}: {}", reaction.joint, reaction.on, reaction.components.join(", "))?;
            }
            writeln!(f, "every other reaction component is unique")?;
        }
        if !self.moved_bodies.is_empty() {
            writeln!(f, "moved by assembly: {}", self.moved_bodies.join(", "))?;
        }
        Ok(())
    }
}

impl std::fmt::Display for PlanReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (k, island) in self.islands.iter().enumerate() {
            writeln!(f, "island {}: {island}", k + 1)?;
        }
        writeln!(f, "solving: {}; {} unknowns", self.engine, self.unknowns)?;
        writeln!(
            f,
            "operations: {} written, {} distinct after folding and sharing, {} per evaluation",
            self.operations_requested, self.operations_distinct, self.operations_per_evaluation
        )?;
        if self.kernels > 0 {
            writeln!(
                f,
                "kernels: {} hold what bodies and joints repeat, so that {} operations are written for one evaluation",
                self.kernels, self.operations_written
            )?;
        }
        writeln!(
            f,
            "machine code: about {:.0} kB in {:.1} ms, which pays after {} evaluations; until then interpreted",
            self.machine_code_bytes as f64 / 1e3,
            self.machine_code_time_s * 1e3,
            self.machine_code_pays_after
        )?;
        for element in &self.opaque {
            writeln!(f, "opaque: {element} is called at run time; slower than a recorded element")?;
        }
        let mut text = String::new();
        for skip in &self.skipped {
            let _ = writeln!(text, "    {}: {}", skip.what, skip.why);
        }
        if text.is_empty() { writeln!(f, "skipped: nothing") } else { write!(f, "skipped:\n{text}") }
    }
}
