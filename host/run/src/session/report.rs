//! What `odyn check` and `odyn plan` say.

use std::fmt::Write as _;

use element_api::Kind;
use serde::Serialize;

use super::apart::Apart;
use super::guards::Watching;
use super::opened::Session;
use super::savings::{Savings, Skip, plural, right_side, some};
use crate::analysis::{JointPlan, STATES_PER_AUDIT};
use crate::catalog::holes_in_glass;
use crate::program::{MachineCode, Maker, Program, Switches};
use crate::results::{StartVelocity, significant};
use crate::scene::Dimension;
use crate::scene::GROUND;

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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckReport {
    /// Bodies that can move.
    pub bodies: usize,
    /// Unilateral rows, each with its element: they are none of the rows below.
    pub contacts: Vec<String>,
    /// The rows that hold up to a limit.
    pub frictions: Vec<String>,
    /// Joints and forces that may be released during a run.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub releases: Vec<String>,
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
    /// Velocities at the start that the scene gives, without zeros.
    pub given_velocities: Vec<StartVelocity>,
    /// Velocities at the start that neither the scene nor the joints determine: those of least kinetic energy.
    pub chosen_velocities: Vec<StartVelocity>,
}

/// A decision of the plan.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Decision {
    /// What is left out.
    pub what: String,
    /// Why that changes no result.
    pub why: String,
    /// What it saves; may be empty.
    pub saved: String,
    /// The name under which it can be switched off, if it can.
    pub without: Option<&'static str>,
}

/// What `odyn plan` reports.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanReport {
    /// Bodies, elements and loops of each island.
    pub islands: Vec<String>,
    /// How accelerations are solved for.
    pub engine: String,
    /// The coordinates of the equations of motion: `cartesian` or `joint`.
    pub formulation: String,
    /// Why these.
    pub formulation_why: String,
    /// In the coordinates of joints: the joints of the tree, or the bodies that float.
    pub tree: Vec<String>,
    /// Velocities.
    pub velocities: usize,
    /// Unknowns of the system for accelerations and multipliers.
    pub unknowns: usize,
    /// Rows that hold wherever the joints of the tree are.
    pub rows_met: usize,
    /// Operations written down before simplification, for all equations and derivatives.
    pub operations_requested: usize,
    /// Distinct operations that remained.
    pub operations_distinct: usize,
    /// Operations per evaluation of the right side.
    pub operations_per_evaluation: usize,
    /// Size of the machine code for the right side, if it is made, bytes (predicted).
    pub machine_code_bytes: u64,
    /// Time to make it, s (predicted).
    pub machine_code_time_s: f64,
    /// Evaluations after which it has paid for itself (predicted).
    pub machine_code_pays_after: u64,
    /// Elements whose loads or rates switch from one expression to another, with the number of conditions.
    pub switches: Vec<String>,
    /// All conditions at which the equations switch.
    pub conditions: usize,
    /// What is enclosed over every step, so that nothing is stepped over; empty where there is nothing.
    pub enclosed: String,
    /// What is known of time before a step; empty where there is nothing.
    pub known_ahead: String,
    /// What can be neither; it is at least looked at once per output step.
    pub bounded: String,
    /// Unilateral rows, each with its element.
    pub contacts: Vec<String>,
    /// The rows that hold up to a limit.
    pub frictions: Vec<String>,
    /// Joints and forces that may be released during a run.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub releases: Vec<String>,
    /// Elements whose memories jump at instants.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub switching: Vec<String>,
    /// Elements that sample, each with its period.
    pub sampled: Vec<String>,
    /// Opaque elements, called at run time.
    pub opaque: Vec<String>,
    /// Libraries in processes of their own.
    pub behind_glass: Vec<String>,
    /// What is skipped.
    pub skipped: Vec<Decision>,
    /// Savings that are not possible here, and why.
    pub impossible: Vec<String>,
    /// What islands that share nothing cost, each by itself; none for a single one.
    pub apart: Option<Apart>,
}

/// The part of [`PlanReport`] that the formulation decides.
pub(super) struct Solving {
    engine: String,
    pub(super) formulation: String,
    why: String,
    tree: Vec<String>,
    pub(super) velocities: usize,
    unknowns: usize,
    rows_met: usize,
    pub(super) counts: Counts,
    skips: Vec<Skip>,
}

/// Operations of a program.
pub(super) struct Counts {
    /// Run per evaluation.
    pub(super) operations: usize,
}

impl Counts {
    fn of(program: &Program) -> Self {
        Self { operations: program.operations() }
    }
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
            rows: self.plan.rows.len(),
            contacts: self.contact_names(),
            frictions: self.friction_names(),
            releases: self.release_names(),
            rank: self.plan.independent_rows.len(),
            mobility: self.plan.mobility,
            redundant_rows: self.plan.redundant_rows.iter().map(|row| row.name.clone()).collect(),
            non_unique_reactions: self.non_unique(),
            moved_bodies: self.assembly.moves.iter().map(|m| m.body.clone()).collect(),
            given_velocities: self.given_velocities(),
            chosen_velocities: self.chosen_velocities(),
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

    /// How accelerations are solved for.
    pub(super) fn solving(&self) -> Solving {
        let choice = self.choose_formulation();
        let why = choice.as_ref().map_or_else(|error| error.to_string(), |choice| choice.why.clone());
        if let Ok(super::formulation::Choice { joint: Some(joint), .. }) = choice {
            let body = |number: usize| self.model.bodies[number].name.as_str();
            let carried = |hung: &crate::plan::TreeJoint| match hung.element {
                Some(element) => format!("{} by {}", body(hung.child), self.model.elements[element].name),
                None => format!("{} floats", body(hung.child)),
            };
            let velocities = joint.equations.coordinates.columns;
            return Solving {
                engine: match joint.solves_by_bodies() {
                    true => "body by body along the tree (articulated bodies)".into(),
                    false => "elimination operation by operation; rank-safe where the rank falls".into(),
                },
                formulation: "joint".into(),
                why,
                tree: joint.tree.joints.iter().map(carried).collect(),
                velocities,
                unknowns: velocities + joint.independent.len(),
                rows_met: joint.met.len(),
                counts: Counts::of(joint.program()),
                skips: self.joint_skips(&joint),
            };
        }
        let plan = &self.plan;
        let velocities = plan.layout.velocities();
        Solving {
            engine: match &plan.always_rank_safe {
                None => "sparse elimination along the topology; rank-safe where the rank falls".into(),
                Some(why) => format!("rank-safe throughout: {why}"),
            },
            formulation: "cartesian".into(),
            why,
            tree: Vec::new(),
            velocities,
            unknowns: velocities + plan.independent_rows.len(),
            rows_met: 0,
            skips: Vec::new(),
            counts: Counts::of(&right_side(&self.equations, &plan.independent_rows)),
        }
    }

    /// What the coordinates of joints make unnecessary.
    fn joint_skips(&self, joint: &JointPlan) -> Vec<Skip> {
        let layout = &self.plan.layout;
        let met_by_tree = self.plan.rows.len() - joint.rows.len() - joint.met.len();
        let (velocities, left) = (layout.velocities(), joint.equations.coordinates.columns);
        let mut skips = vec![Skip {
            what: plural(met_by_tree, "row of the tree's joints", "rows of the tree's joints"),
            why: "the joints' own coordinates meet them; their reactions are found where asked for".into(),
            saved: format!("{} of {velocities} velocities", velocities.saturating_sub(left)),
            switch: None,
        }];
        if !joint.tree.followers.is_empty() {
            skips.push(Skip {
                what: plural(
                    joint.tree.followers.len(),
                    "joint coordinate that follows others",
                    "joint coordinates that follow others",
                ),
                why: "loops close by affine relations between coordinates, as parallelograms do: shown at the start and at places \
                      far from it"
                    .into(),
                saved: "their velocities, the rows that close these loops, and positions where these lose rank".into(),
                switch: Some("affine-loops"),
            });
        }
        if !joint.met.is_empty() {
            skips.push(Skip {
                what: plural(joint.met.len(), "row of other joints", "rows of other joints"),
                why: "they hold wherever the tree's joints are (in a planar mechanism, all across the plane)".into(),
                saved: "their share of every evaluation".into(),
                switch: None,
            });
        }
        if self.pruning.audit {
            skips.push(Skip {
                what: format!(
                    "the violation of all rows in {} of {STATES_PER_AUDIT} accepted states",
                    STATES_PER_AUDIT - 1
                ),
                why: "the tree's joints hold by themselves, and projection judges the other rows at every step".into(),
                saved: "their evaluation in the frames of space".into(),
                switch: Some("audit"),
            });
        }
        skips
    }

    /// What `odyn plan` reports.
    #[must_use]
    pub fn plan_report(&self) -> PlanReport {
        let islands = self.plan.topology.islands.iter().map(|island| {
            let names: Vec<&str> = island.bodies.iter().map(|b| self.model.bodies[*b].name.as_str()).collect();
            format!(
                "{} ({}), {} elements, {}",
                plural(names.len(), "body", "bodies"),
                some(&names),
                island.elements.len(),
                plural(island.loops, "closed loop", "closed loops")
            )
        });
        let opaque = self.model.elements.iter().filter(|e| e.class.opaque);
        let (unit, label) = (self.scene.units.factor(Dimension::TIME), self.scene.units.label(Dimension::TIME));
        let sampled = self.model.elements.iter().filter_map(|e| {
            let period = e.recording.sample_period()?;
            Some(format!("{} (every {} {label})", e.name, significant(period / unit, 6)))
        });
        let away = self.libraries.iter().filter(|library| library.glass);
        let behind_glass: Vec<String> = away.map(|library| library.package.clone()).collect();
        let solving = self.solving();
        let counts = solving.counts;
        let (apart, not_apart) = match self.apart_report(counts.operations) {
            Ok(apart) => (apart, None),
            Err(error) => (None, Some(("islands apart", error.diagnostics[0].message.clone()))),
        };
        let maker = Maker::here();
        let switches = Switches::find(&self.equations, &self.plan.layout);
        let name = |(element, count): &(usize, usize)| {
            format!("{} ({})", self.model.elements[*element].name, plural(*count, "condition", "conditions"))
        };
        let mut equations = self.equations.clone();
        let layout = &self.plan.layout;
        let counted = equations.counted_angles(&self.model, layout);
        let watched = Watching::find(&mut equations, &counted, layout, self.tolerance()).in_words(&equations, layout);
        PlanReport {
            enclosed: watched.within,
            known_ahead: watched.ahead,
            bounded: watched.bounded,
            switches: Switches::by_element(&self.equations, &self.plan.layout).iter().map(name).collect(),
            conditions: switches.conditions.len(),
            islands: islands.collect(),
            engine: solving.engine,
            formulation: solving.formulation,
            formulation_why: solving.why,
            tree: solving.tree,
            velocities: solving.velocities,
            unknowns: solving.unknowns,
            rows_met: solving.rows_met,
            operations_requested: self.equations.graph.requested,
            operations_distinct: self.equations.graph.len(),
            operations_per_evaluation: counts.operations,
            machine_code_bytes: maker.bytes(counts.operations) as u64,
            machine_code_time_s: maker.time(counts.operations),
            machine_code_pays_after: maker.runs_that_pay(counts.operations) as u64,
            contacts: self.contact_names(),
            frictions: self.friction_names(),
            releases: self.release_names(),
            switching: self.latch_names(false),
            sampled: sampled.collect(),
            opaque: opaque
                .map(|e| {
                    let away = behind_glass.iter().any(|library| **library == *e.library);
                    let how = if away { ", each time across processes" } else { "" };
                    format!("{} ({}/{}) is called at run time{how}", e.name, e.library, e.class.name)
                })
                .collect(),
            behind_glass,
            skipped: solving
                .skips
                .iter()
                .chain(&Savings::of(self, counted.len()))
                .map(|skip| Decision {
                    what: skip.what.clone(),
                    why: skip.why.clone(),
                    saved: skip.saved.clone(),
                    without: skip.switch,
                })
                .collect(),
            impossible: not_apart.iter().map(|(name, why)| format!("{name}: {why}")).collect(),
            apart,
        }
    }
}

fn all(names: &[String]) -> String {
    some(&names.iter().map(String::as_str).collect::<Vec<_>>())
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
        if !self.contacts.is_empty() {
            let rows = plural(self.contacts.len(), "unilateral row", "unilateral rows");
            writeln!(f, "besides {rows}, open until they touch: {}", all(&self.contacts))?;
        }
        if !self.frictions.is_empty() {
            let rows = plural(self.frictions.len(), "row", "rows");
            writeln!(f, "besides {rows} that hold up to a limit: {}", all(&self.frictions))?;
        }
        if !self.releases.is_empty() {
            writeln!(f, "as long as nothing is released: {}", all(&self.releases))?;
        }
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
        f.write_str(&super::started::described(&self.given_velocities, &self.chosen_velocities))
    }
}

impl std::fmt::Display for PlanReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (k, island) in self.islands.iter().enumerate() {
            writeln!(f, "island {}: {island}", k + 1)?;
        }
        if let Some(apart) = &self.apart {
            write!(f, "{apart}")?;
        }
        writeln!(f, "coordinates: {}, {} velocities ({})", self.formulation, self.velocities, self.formulation_why)?;
        if !self.tree.is_empty() {
            writeln!(f, "    tree: {}", self.tree.join(", "))?;
        }
        if self.rows_met > 0 {
            let rows = plural(self.rows_met, "row", "rows");
            writeln!(f, "    {rows} of other joints hold wherever the tree is, and are left out")?;
        }
        writeln!(f, "solving: {}; {} unknowns", self.engine, self.unknowns)?;
        writeln!(
            f,
            "operations: {} written, {} distinct after folding and sharing, {} per evaluation",
            self.operations_requested, self.operations_distinct, self.operations_per_evaluation
        )?;
        writeln!(
            f,
            "machine code: about {:.0} kB in {} ms, which pays after {} evaluations; {}",
            self.machine_code_bytes as f64 / 1e3,
            significant(self.machine_code_time_s * 1e3, 2),
            self.machine_code_pays_after,
            if MachineCode::can_assemble() { "made before the first step" } else { "until then interpreted" }
        )?;
        if !self.contacts.is_empty() {
            writeln!(
                f,
                "contacts: {}; steps end where they close and open, and rows are enforced while they are closed",
                all(&self.contacts)
            )?;
        }
        if !self.frictions.is_empty() {
            writeln!(
                f,
                "friction: {}; steps end where they begin to slide and to stick, and rows are enforced while they stick",
                all(&self.frictions)
            )?;
        }
        if !self.releases.is_empty() {
            writeln!(
                f,
                "released: {}; steps end where they let go, and what they do is gone from there",
                all(&self.releases)
            )?;
        }
        if !self.switching.is_empty() {
            writeln!(f, "switching: {}; steps end where their memories jump", all(&self.switching))?;
        }
        if !self.sampled.is_empty() {
            writeln!(f, "sampled: {}; steps end at the samples", self.sampled.join(", "))?;
        }
        for element in &self.opaque {
            writeln!(f, "opaque: {element}; slower than a recorded element")?;
        }
        if !self.behind_glass.is_empty() {
            let holes = holes_in_glass();
            let but = if holes.is_empty() { String::new() } else { format!(" ({holes})") };
            writeln!(f, "behind glass, in processes of their own: {}{but}", self.behind_glass.join(", "))?;
        }
        if self.conditions > 0 {
            writeln!(
                f,
                "switches: {} ({}); steps that they spoil end there (--without events)",
                plural(self.conditions, "condition", "conditions"),
                self.switches.join(", ")
            )?;
        }
        for (what, how) in [
            (&self.enclosed, "enclosed over every step"),
            (&self.known_ahead, "known before every step"),
            (&self.bounded, "neither, so that no step is longer than the output step"),
        ] {
            if !what.is_empty() {
                writeln!(f, "{how}: {what}")?;
            }
        }
        let mut text = String::new();
        for skip in &self.skipped {
            let _ = write!(text, "    {}: {}", skip.what, skip.why);
            if !skip.saved.is_empty() {
                let _ = write!(text, "; saves {}", skip.saved);
            }
            let _ = match skip.without {
                Some(name) => writeln!(text, " (--without {name})"),
                None => writeln!(text),
            };
        }
        if text.is_empty() {
            writeln!(f, "skipped: nothing")?
        } else {
            write!(f, "skipped:\n{text}")?
        }
        for saving in &self.impossible {
            writeln!(f, "not possible: {saving}")?;
        }
        Ok(())
    }
}
