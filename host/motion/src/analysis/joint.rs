//! [`JointForm`]: the coordinates of joints along a spanning tree, eliminated operation by operation, and a rank-safe engine
//! where the rank falls.

mod engines;
mod portable;
mod solve;

pub use portable::{Portable, Quantities};

use std::sync::Arc;

use solve::{least_health, least_health_at_start};

use element_api::ElementSet;
use nalgebra::Matrix3;

use super::balance::{Imbalance, Trial};
use super::constraints::mass_entries;
use super::coupling::Coupling;
use super::direct::Direct;
use super::evaluator::Evaluator;
use super::formulation::{
    AnalysisError, Counters, Entries, Formulation, Group, Observed, Price, Traces, angular_velocities,
};
use super::in_bodies::InBodies;
use super::joint_engines::{Function, Look, Safe, Unrolled, motion_nodes, pivot_ratio};
use super::joint_plan::{JointPlan, LEAST_HEALTH};
use super::joint_start::{JointStart, JointState};
use super::linearisation::{Linearisation, PREPARATION};
use super::motion::{APPROACH, Engines, Independence, Motion, SICK_TREE, Used, next_step, normalise, shares_of_time};
use super::newton::ROUND_OFF;
use super::passage;
use super::solved::SolvedProgram;
use super::turns::Turns;
use super::working::{ACCURATE, BODY_STATES, MOTION_RANK_TOLERANCE, SICK_SHARE, WorkingParts};
use crate::linalg::Health;
use crate::model::{Model, euler_parameters};
use crate::plan::{Layout, SpanningTree};
use crate::program::{Equations, Graph, JointEquations, Node, Used as Compiled, Working};

/// Accepted states from one look at the violation of all rows to the next: see [`Formulation::states_per_audit`].
pub const STATES_PER_AUDIT: u64 = 32;

/// See the module documentation.
pub struct JointForm {
    motion: Motion,
    start: JointStart,
    tree: SpanningTree,
    /// The same scene in the coordinates of the bodies, for what is reported.
    bodies: InBodies,
    kinematics: Evaluator,
    turns: Turns,
    body_state: Vec<f64>,
    regular: Option<Unrolled>,
    /// The regular engine's rates, where nothing has to be looked at closely.
    direct: Option<Direct>,
    safe: Safe,
    /// Forces that depend on what is solved for.
    coupling: Option<Coupling>,
    /// What the equations depend on of a solution by the rank-safe engine, once that was called in.
    dependent: Option<Evaluator>,
    /// Size of the gradient of each row in use, 1 for rows in metres.
    row_sizes: Vec<f64>,
    /// Those of the regular engine's rows.
    regular_sizes: Vec<f64>,
    /// Whether rows are left out of the regular engine's choice.
    choice: bool,
    /// Rows of the regular engine.
    independent: Vec<usize>,
    /// Pivot ratio of the regular engine below which a closer look decides whether it is trusted.
    least_health: f64,
    /// The regular engine at the start; independence of the rows where they were sound last.
    first: Look,
    /// [`JointForm::first`] as it was planned.
    planned: Look,
    /// The regular engine where velocities were corrected last.
    last: Look,
    /// Whether it was trusted where a closer look was taken last.
    trusted: bool,
    /// Both are still to be found, where the program of corrections of velocities was run last.
    is_look_due: bool,
    /// Whether angles are counted between bodies that no joint of the tree connects.
    counts_others: bool,
    /// The equations, for their derivatives.
    equations: JointEquations,
    derivatives: Derivatives,
    /// Size of the equations as they were planned.
    size: usize,
    /// Whether derivatives were asked for since the start, or since all was forgotten.
    derivatives_are_paid: bool,
}

/// The derivatives of the rates. They are written down when first asked for.
enum Derivatives {
    Unknown,
    Possible,
    Known(Box<Linearisation>),
}

impl JointForm {
    /// Prepares programs and engines. The opaque elements of the model move in; `bodies` is the same in coordinates of bodies.
    ///
    /// # Errors
    /// When the linear algebra refuses the model.
    pub fn new(
        plan: JointPlan,
        model: &mut Model,
        layout: &Layout,
        bodies: WorkingParts,
    ) -> Result<Self, AnalysisError> {
        let mut joint = plan.equations;
        joint.graph.rest();
        let coordinates = joint.coordinates.clone();
        let mut safe = match plan.all {
            Some(all) => all.anew(&joint, &plan.sizes, MOTION_RANK_TOLERANCE)?,
            None => Safe::new(&joint, &plan.rows, &plan.sizes, plan.length, MOTION_RANK_TOLERANCE)?,
        };
        safe.solver.set_rank_limit(plan.at_start.rank);
        let used = plan.tree.used(model.elements.len());
        let counts_others = model.elements.iter().zip(&used).any(|(element, used)| element.counts_turns() && !used);
        // Rows close to dependent at the start are for the rank-safe engine throughout.
        let start = plan.start;
        let regular = Some(plan.regular).filter(|_| start.kept.min(start.independence) >= LEAST_HEALTH);
        let rows = regular.as_ref().map_or(&[][..], |regular| &regular.rows);
        let sized = plan.rows.iter().zip(&plan.sizes).filter(|(row, _)| rows.contains(row));
        let regular_sizes = sized.map(|(_, size)| *size).collect();
        let plain = regular.as_ref().filter(|_| joint.dependence.is_none());
        let direct = plain
            .and_then(|regular| Direct::new(regular.motion.program(), &joint.coordinates, layout, regular.rows.len()));
        let row_names = Arc::clone(&bodies.row_names);
        // Of opaque elements they are not known.
        let known = joint.graph.calls.is_empty();
        let derivatives = if known { Derivatives::Possible } else { Derivatives::Unknown };
        let mut places = plan.places;
        Ok(Self {
            turns: Turns::new(&mut places, &plan.tree, &joint.coordinates, model),
            start: places,
            tree: plan.tree,
            kinematics: Evaluator::new(&joint.graph, &body_nodes(&joint)),
            body_state: vec![0.0; BODY_STATES * layout.bodies + layout.states + 1],
            coupling: joint
                .dependence
                .as_ref()
                .map(|found| Coupling::new(found.slots.clone(), found.linear, layout, model.gravity.norm())),
            dependent: None,
            choice: plan.independent.len() < plan.rows.len(),
            least_health: least_health_at_start(&plan.independent, &start),
            independent: plan.independent,
            first: start,
            last: start,
            trusted: false,
            is_look_due: false,
            planned: start,
            counts_others,
            row_sizes: plan.sizes,
            regular_sizes,
            derivatives,
            size: joint.size,
            derivatives_are_paid: false,
            equations: joint,
            regular,
            direct,
            safe,
            bodies: InBodies::new(bodies, layout, std::mem::take(&mut model.sets)),
            motion: Motion::new(layout, coordinates, plan.length, row_names, plan.at_start),
        })
    }

    /// Accelerations and multipliers of the regular engine into the inputs.
    fn publish(&mut self) {
        if let Some(regular) = &self.regular {
            let multipliers = &regular.motion.outputs()[self.motion.coordinates.columns..];
            self.motion.publish(&self.safe.rows, &regular.rows, multipliers);
        }
    }

    /// [v; omega'] of all bodies at the inputs' state.
    fn body_velocities(&mut self) -> Result<Vec<f64>, AnalysisError> {
        let outputs = self.kinematics.run(&self.motion.inputs, &self.bodies.sets)?;
        Ok(outputs.chunks_exact(BODY_VALUES).flat_map(|body| &body[12..]).copied().collect())
    }

    /// The state of the bodies.
    fn move_bodies(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        self.motion.load(t, state);
        self.turns.look(state);
        let outputs = self.kinematics.run(&self.motion.inputs, &self.bodies.sets)?;
        for (body, found) in outputs.chunks_exact(BODY_VALUES).enumerate() {
            let y = &mut self.body_state[BODY_STATES * body..BODY_STATES * (body + 1)];
            y[..3].copy_from_slice(&found[..3]);
            let mut p = euler_parameters(&Matrix3::from_row_slice(&found[3..12]));
            self.turns.choose(body, &mut p, &y[3..7]);
            y[3..7].copy_from_slice(&p);
            normalise(&mut y[3..7]);
            y[7..13].copy_from_slice(&found[12..18]);
        }
        let from = BODY_STATES * self.motion.layout.bodies;
        self.body_state[from..].copy_from_slice(&state[self.motion.coordinates.motion..]);
        Ok(())
    }
}

/// What [`body_nodes`] gives of each body.
const BODY_VALUES: usize = 18;

/// r, A, v, omega' of every body.
fn body_nodes(joint: &JointEquations) -> Vec<Node> {
    let of = |body: &crate::program::BodyNodes| {
        let mut nodes = body.r.to_vec();
        nodes.extend(body.a.iter().flatten());
        nodes.extend(body.v);
        nodes.extend(body.w);
        nodes
    };
    joint.bodies.iter().flat_map(of).collect()
}

impl Formulation for JointForm {
    fn name(&self) -> &'static str {
        if self.regular.is_some() { "joint" } else { "joint, rank-safe" }
    }

    fn is_joint(&self) -> bool {
        true
    }

    fn groups(&self) -> &[Group] {
        &self.motion.groups
    }

    fn state_of(&mut self, working: &[f64], state: &mut [f64]) {
        let (mut position, mut velocity) = (0, self.motion.coordinates.motion - self.motion.coordinates.columns);
        for joint in self.start.find(working) {
            // Joints whose coordinates can't be found are not in the tree; a state of another branch is caught by the audit.
            let JointState { positions, velocities } = joint.unwrap_or_default();
            state[position..position + positions.len()].copy_from_slice(&positions);
            state[velocity..velocity + velocities.len()].copy_from_slice(&velocities);
            position += positions.len();
            velocity += velocities.len();
        }
        state[self.motion.coordinates.motion..].copy_from_slice(&working[BODY_STATES * self.motion.layout.bodies..]);
        // Of the two sets of Euler parameters of a rotation, bodies continue from these.
        self.body_state.copy_from_slice(working);
        self.turns.forget();
    }

    fn forget(&mut self, working: &[f64]) {
        self.motion.forget();
        (self.first, self.last) = (self.planned, self.planned);
        self.safe.solver.set_rank_limit(self.motion.at_start.rank);
        self.least_health = least_health_at_start(&self.independent, &self.first);
        (self.trusted, self.is_look_due, self.derivatives_are_paid) = (false, false, false);
        self.body_state.copy_from_slice(working);
        self.turns.forget();
        if let Some(coupling) = &mut self.coupling {
            coupling.forget();
        }
        self.bodies.forget(working);
    }

    fn set_discrete(&mut self, references: &[f64], discrete: &[f64]) {
        self.bodies.set_discrete(references, discrete);
        self.motion.layout.write_discrete(&mut self.motion.inputs, references, discrete);
    }

    fn rates(&mut self, t: f64, state: &[f64], rates: &mut [f64]) -> Result<(), AnalysisError> {
        if self.plain_rates(t, state, rates)? {
            return Ok(());
        }
        passage::rates(self, t, state, rates)
    }

    fn bound_corrections(&mut self, share: f64) {
        self.motion.most_off = share;
    }

    fn project(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
        passage::project(self, t, state)
    }

    fn is_free(&self) -> bool {
        self.safe.rows.is_empty() && self.motion.coordinates.rotations.is_empty()
    }

    fn certify(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        passage::certify(self, t, state)
    }

    fn next_step(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        next_step(self, t, state)
    }

    fn observe(&mut self, t: f64, state: &[f64], dynamics: bool) -> Result<Observed<'_>, AnalysisError> {
        self.move_bodies(t, state)?;
        self.bodies.observe(t, &self.body_state, dynamics)
    }

    fn carry(&self, equations: &Equations, nodes: &[Node]) -> Option<(Graph, Vec<Node>)> {
        self.equations.carry(equations, &self.motion.layout, nodes)
    }

    fn solved_program(&self, equations: &Equations, nodes: &[Node]) -> Option<SolvedProgram> {
        let mass = mass_entries(self.bodies.masses());
        let working = Working { equations, layout: &self.motion.layout, mass: &mass };
        let found = self.equations.reactions(&working, &self.tree, self.motion.length, nodes, &[])?;
        Some(SolvedProgram::new(&found))
    }

    fn run_solved(
        &mut self,
        t: f64,
        state: &[f64],
        program: &mut SolvedProgram,
    ) -> Result<Option<Imbalance>, AnalysisError> {
        self.motion.load(t, state);
        if self.solve_dynamics()? != Used::Regular {
            return Ok(None);
        }
        self.publish();
        program.evaluator.run(&self.motion.inputs, &self.bodies.sets)?;
        Ok(program.judge(self.motion.length))
    }

    fn accelerations(&mut self, t: f64, state: &[f64]) -> Result<Option<Vec<f64>>, AnalysisError> {
        self.motion.load(t, state);
        if self.solve_dynamics()? != Used::Regular {
            return Ok(None);
        }
        let Some((moved, duration)) = self.motion.shortly_after(state) else {
            return Ok(Some(vec![0.0; self.motion.layout.velocities()]));
        };
        let mut found = self.body_velocities()?;
        self.motion.load(t, &moved);
        for (before, after) in found.iter_mut().zip(self.body_velocities()?) {
            *before = (after - *before) / duration;
        }
        Ok(Some(found))
    }

    fn traces(&self) -> Traces {
        self.own_traces()
    }

    fn forget_since(&mut self, traces: &Traces) {
        self.follow(traces);
    }

    fn turning(&self, state: &[f64]) -> f64 {
        let rates = angular_velocities(&self.motion.groups, state);
        // The angles of the tree's own joints are coordinates; between other bodies the rates of joints add up.
        if self.counts_others { rates.sum() } else { 3.0_f64.sqrt() * rates.fold(0.0, f64::max) }
    }

    fn entry_of(&self, slot: usize) -> Option<usize> {
        self.motion.coordinates.entry_of(slot, &self.motion.layout)
    }

    fn own_program(&self, equations: &Equations, nodes: &[Node]) -> Option<Evaluator> {
        let (mut graph, nodes) = self.carry(equations, nodes)?;
        graph.rest();
        Some(Evaluator::of_entries(&graph, &nodes, |slot| self.entry_of(slot)))
    }

    fn run_own<'e>(&mut self, t: f64, state: &[f64], own: &'e mut Evaluator) -> Result<&'e [f64], AnalysisError> {
        self.motion.inputs[Layout::TIME] = t;
        own.run_at((&self.motion.inputs, state), &self.bodies.sets)
    }

    fn jacobian(&mut self, t: f64, state: &[f64], found: Entries<'_>) -> Result<bool, AnalysisError> {
        let Some(regular) = self.regular.as_ref().filter(|_| !self.motion.careful) else { return Ok(false) };
        self.derivatives_are_paid = true;
        if matches!(self.derivatives, Derivatives::Possible) {
            let (joint, layout) = (&self.equations, &self.motion.layout);
            let (graph, nodes) = motion_nodes(joint, &regular.rows, regular.by_bodies);
            let (accelerations, rest) = nodes.split_at(joint.coordinates.columns);
            let (rates, found) = rest[regular.rows.len()..].split_at(layout.states + 1);
            let coupled = joint.dependence.iter().flat_map(|dependence| dependence.places().map(|place| found[place]));
            let nodes = accelerations.iter().chain(rates).copied().chain(coupled).collect();
            self.derivatives = Derivatives::Known(Box::new(Linearisation::of_solution(joint, layout, (graph, nodes))));
        }
        if matches!(self.derivatives, Derivatives::Unknown) {
            return Ok(false);
        }
        self.motion.load(t, state);
        if self.solve_dynamics()? != Used::Regular {
            return Ok(false);
        }
        let Derivatives::Known(known) = &mut self.derivatives else { return Ok(false) };
        known.fill(&self.motion.inputs, &self.bodies.sets, state, &[], &mut |_, _, _, _| Ok(()), found)
    }

    fn price(&self) -> Price {
        let operations = self.regular.as_ref().map_or(0, |regular| regular.motion.program().operations()) as f64;
        let unknowns = (self.motion.coordinates.columns + self.safe.rows.len()) as f64;
        let coupled = self.equations.dependence.as_ref().map_or(0, |found| found.slots.len());
        let directions = (self.motion.coordinates.directions(&self.motion.layout) + coupled) as f64;
        // Measured on chains, where nearly every operation depends on nearly every direction.
        let jacobian = operations * (3.0 + 0.3 * directions);
        let known = !matches!(self.derivatives, Derivatives::Unknown);
        let unpaid = known && !self.derivatives_are_paid;
        let preparation = if unpaid { PREPARATION * self.size as f64 } else { 0.0 };
        let known = known && self.regular.is_some();
        // Besides its operations, an evaluation moves numbers about: measured on scenes of few bodies.
        let rates = operations + 200.0 + 25.0 * unknowns;
        Price { rates, jacobian: known.then_some(jacobian), preparation }
    }

    fn states_per_audit(&self) -> u64 {
        STATES_PER_AUDIT
    }

    fn leaves_rows_out(&self) -> bool {
        self.choice
    }

    fn programs(&mut self) -> Vec<Compiled<'_>> {
        let mut list = Vec::new();
        let spare = self.regular.is_some();
        if let Some(regular) = &mut self.regular {
            match &mut self.direct {
                Some(direct) => list.extend([direct.used().by_steps(), regular.motion.used(false)]),
                None => list.push(regular.motion.used(false).by_steps()),
            }
            let is_free = self.safe.rows.is_empty();
            list.extend([&mut regular.position, &mut regular.velocity].map(|program| program.used(is_free).by_steps()));
        }
        list.push(self.kinematics.used(false));
        list.push(self.safe.terms.used(spare));
        list.extend(self.bodies.programs());
        if let Derivatives::Known(known) = &mut self.derivatives {
            list.push(known.used());
        }
        list
    }

    fn counters(&self) -> Counters {
        // The form in the coordinates of bodies solves for reactions and accelerations at samples.
        self.motion.counters + self.bodies.counters()
    }

    fn trade_sets(&mut self, sets: &mut Vec<Box<dyn ElementSet>>) {
        std::mem::swap(&mut self.bodies.sets, sets);
    }

    fn sets_mut(&mut self) -> &mut [Box<dyn ElementSet>] {
        &mut self.bodies.sets
    }

    fn sets(&self) -> &[Box<dyn ElementSet>] {
        &self.bodies.sets
    }
}
