//! [`WorkingForm`]: six velocities per body, sparse elimination, and a rank-safe engine where the rank falls.

mod engine;
mod engines;
mod observe;
mod parts;
mod project;
mod solve;

use std::sync::Arc;

pub(super) use engine::clusters;
pub use engine::sparse_engine;
use engine::{Engine, FUNCTIONS, Solution, Source};
pub use parts::WorkingParts;

use element_api::ElementSet;

use super::balance::{Balance, Imbalance, Trial};
use super::constraints::{Constraints, mass_values, structure};
use super::coupling::{BodyCoupling, Solve};
use super::formulation::{AnalysisError, Counters, Entries, Formulation, Group, Observed, Price, Traces};
use super::linearisation::{Linearisation, PREPARATION};
use super::motion::{APPROACH, Engines, Independence, Motion, NEAR_SINGULAR, Used, next_step, shares_of_time};
use super::newton::{ROUND_OFF, project_plainly};
use super::passage::{self, Way};
use crate::linalg::{Clusters, DenseQr, Health, KktSolver, LinalgError, SparseLdl};
use crate::model::Model;
use crate::plan::{ACCURATE_REFINED, Coordinates, Layout, Plan, body_scales};
use crate::program::{Equations, Graph, Node, Row};

/// Numbers per body in the state: r (3), p (4), v (3), omega' (3).
pub const BODY_STATES: usize = 13;

/// Where the pivot ratio falls below this share of its value at the start, the sparse engine's choice of rows, or all of them,
/// may be close to dependent: what counts then is the ratio that masses have no part in. It goes with a squared singular value:
/// 9e-4 stands for 0.03.
pub(super) const SICK_SHARE: f64 = 9e-4;
/// Pivot ratio, in the metric of the masses, from which elimination keeps enough digits: it loses as many as this has.
pub(super) const ACCURATE: f64 = 1e-5;
/// Rank tolerance of the rank-safe engine during the motion; tighter than at planning, so that rows are given up only
/// where they really vanish.
pub(super) const MOTION_RANK_TOLERANCE: f64 = 1e-11;
/// Share of what the equations of motion are made of by which interpolated accelerations and reactions may miss them.
const BALANCED: f64 = 1e-9;
/// Share of a body's own loads by which a solution may miss them before it is refined.
const REFINED: f64 = 1e-11;

/// See the module documentation.
pub struct WorkingForm {
    motion: Motion,
    sets: Vec<Box<dyn ElementSet>>,
    regular: Option<Engine<SparseLdl>>,
    safe: Engine<DenseQr>,
    /// The rows of the sparse engine whatever the masses: all bodies alike.
    alike: Option<SparseLdl>,
    /// Position and time where these were eliminated last, and their pivot ratio.
    alike_at: (Vec<f64>, f64),
    /// Pivot ratio of the sparse engine below which a closer look decides whether it is trusted.
    least_health: f64,
    /// Pivot ratio of the sparse engine at the start.
    start_health: f64,
    /// The same whatever the masses, where the rows were sound last.
    start_independence: f64,
    /// The latter as it was planned.
    planned_independence: f64,
    /// What may lose rank on the way.
    watch: Watch,
    /// Scratch: accelerations and multipliers.
    forces: Vec<f64>,
    balance: Balance,
    force: Vec<f64>,
    key: Vec<f64>,
    /// Forces that depend on what is solved for.
    coupling: Option<BodyCoupling>,
    /// Where the derivatives of the rates come from, until they are asked for; then the derivatives.
    derivatives: Derivatives,
    /// Whether they were asked for since the start, or since all was forgotten.
    derivatives_are_paid: bool,
}

impl WorkingForm {
    /// Prepares programs and engines. The opaque elements of the model move in.
    ///
    /// # Errors
    /// When the linear algebra refuses the model's mass matrix.
    pub fn new(equations: &Equations, model: &mut Model, plan: &Plan, length: f64) -> Result<Self, AnalysisError> {
        let sets = std::mem::take(&mut model.sets);
        Self::of(&WorkingParts::new(equations, model, plan, length), sets)
    }

    /// The same from its parts, with the opaque elements.
    ///
    /// # Errors
    /// As for [`WorkingForm::new`].
    pub(super) fn of(parts: &WorkingParts, sets: Vec<Box<dyn ElementSet>>) -> Result<Self, AnalysisError> {
        let WorkingParts { equations, plan, masses, scales, row_names, length } = parts;
        let (length, start_health) = (*length, plan.sparse_health);
        let layout = plan.layout.clone();
        let all = plan.rows.clone();
        let regular = match plan.always_rank_safe {
            Some(_) => None,
            None => {
                let solver = sparse_engine(equations, &plan.independent_rows, &layout)?;
                Some(Engine::new(equations, masses, &plan.independent_rows, solver)?)
            }
        };
        let structure = structure(equations, &all)?;
        let mut solver = DenseQr::new(&structure, MOTION_RANK_TOLERANCE)?;
        solver.set_measure(scales)?;
        let mut safe = match &regular {
            Some(engine) if engine.dynamics.rows == all => engine.with(masses, solver)?,
            _ => Engine::new(equations, masses, &all, solver)?,
        };
        safe.solver.set_rank_limit(plan.health.rank);
        // What follows from positions holds as they do; a position that follows from velocities drifts away.
        let of_positions = (0..all.len()).filter(|place| !equations.rows[all[*place]].of_velocities);
        safe.solver.set_first_rows(&of_positions.collect::<Vec<_>>())?;
        let watch = if !plan.redundant_rows.is_empty() {
            Watch::Rows
        } else if plan.topology.islands.iter().any(|island| island.loops > 0) {
            Watch::Loops
        } else {
            Watch::Nothing
        };
        let alike = match &regular {
            Some(engine) if watch != Watch::Nothing => {
                let mut alike = sparse_engine(equations, &engine.dynamics.rows, &layout)?;
                alike.set_mass(&engine.dynamics.structure.metric(scales))?;
                Some(alike)
            }
            _ => None,
        };
        let coordinates = Coordinates::of_bodies(&layout);
        Ok(Self {
            force: vec![0.0; layout.velocities()],
            forces: vec![0.0; layout.velocities() + layout.rows],
            balance: Balance::new(masses.clone(), [layout.velocities(), layout.rows], length),
            key: Vec::with_capacity(7 * layout.bodies + 1),
            least_health: start_health * SICK_SHARE,
            watch,
            sets,
            start_health,
            start_independence: plan.independence,
            planned_independence: plan.independence,
            alike,
            alike_at: (Vec::new(), 0.0),
            regular,
            safe,
            coupling: BodyCoupling::new(equations, masses, &layout),
            derivatives: Derivatives::Unknown,
            derivatives_are_paid: false,
            motion: Motion::new(&layout, coordinates, length, Arc::clone(row_names), plan.health),
        })
    }

    /// Operations per evaluation of the right side.
    #[must_use]
    pub fn operations(&self) -> usize {
        match &self.regular {
            Some(engine) => engine.dynamics.program().operations(),
            None => self.safe.dynamics.program().operations(),
        }
    }

    /// Notes position and time of the inputs: what was factored there is in force.
    fn note_position(&mut self) {
        let Motion { inputs, layout, .. } = &self.motion;
        self.key.clear();
        self.key.push(inputs[Layout::TIME]);
        let poses = (0..layout.bodies).map(|body| layout.body_slot(body, 0));
        poses.for_each(|slot| self.key.extend_from_slice(&inputs[slot..slot + 7]));
    }

    /// Factors anew whatever is asked for next.
    fn forget_factors(&mut self) {
        self.safe.factored_at.clear();
        self.alike_at.0.clear();
        if let Some(engine) = &mut self.regular {
            engine.factored_at.clear();
        }
    }
}

/// What may lose rank on the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Watch {
    /// Trees without redundant rows keep their rank.
    Nothing,
    /// Closed loops, all rows in use.
    Loops,
    /// A choice of rows, which may become dependent while all of them together keep their rank.
    Rows,
}

/// The derivatives of the rates. They are written down when first asked for.
enum Derivatives {
    Unknown,
    Possible(Box<Equations>),
    /// With the size of the equations that they were written from.
    Known(Box<Linearisation>, usize),
}

impl Formulation for WorkingForm {
    fn name(&self) -> &'static str {
        if self.regular.is_some() { "sparse" } else { "rank-safe" }
    }

    fn groups(&self) -> &[Group] {
        &self.motion.groups
    }

    fn state_of(&mut self, working: &[f64], state: &mut [f64]) {
        state.copy_from_slice(working);
    }

    fn forget(&mut self, _: &[f64]) {
        self.motion.forget();
        self.start_independence = self.planned_independence;
        self.safe.solver.set_rank_limit(self.motion.at_start.rank);
        self.least_health = self.start_health * SICK_SHARE;
        self.derivatives_are_paid = false;
        self.forget_factors();
        if let Some(coupling) = &mut self.coupling {
            coupling.forget();
        }
    }

    fn set_discrete(&mut self, references: &[f64], discrete: &[f64]) {
        self.motion.layout.write_discrete(&mut self.motion.inputs, references, discrete);
        // A joint's equations may contain them.
        self.forget_factors();
    }

    fn rates(&mut self, t: f64, state: &[f64], rates: &mut [f64]) -> Result<(), AnalysisError> {
        passage::rates(self, t, state, rates)
    }

    fn bound_corrections(&mut self, share: f64) {
        self.motion.most_off = share;
    }

    fn project(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
        passage::project(self, t, state)
    }

    fn certify(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        passage::certify(self, t, state)
    }

    fn next_step(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        next_step(self, t, state)
    }

    fn observe(&mut self, t: f64, state: &[f64], dynamics: bool) -> Result<Observed<'_>, AnalysisError> {
        self.motion.load(t, state);
        let mut imbalance = Imbalance::default();
        if dynamics {
            let used = self.solve_dynamics()?;
            let near = matches!(used, Used::Safe) && self.is_singular(NEAR_SINGULAR);
            if !near || !self.observe_between(t, state)? {
                self.publish(used);
                imbalance = self.certify(used)?;
            }
        }
        Ok(Observed { inputs: &self.motion.inputs, imbalance })
    }

    fn entry_of(&self, slot: usize) -> Option<usize> {
        self.motion.coordinates.entry_of(slot, &self.motion.layout)
    }

    fn written_in_state(&self, equations: &Equations, nodes: &[Node]) -> Option<(Graph, Vec<Node>)> {
        Some((equations.graph.clone(), nodes.to_vec()))
    }

    fn traces(&self) -> Traces {
        let guess = self.coupling.as_ref().and_then(BodyCoupling::guess);
        Traces { guesses: [guess, None], counters: [self.motion.counters, Counters::default()], look: None }
    }

    fn forget_since(&mut self, traces: &Traces) {
        if let Some(coupling) = &mut self.coupling {
            coupling.start_from(&traces.guesses[0]);
        }
        self.motion.counters = traces.counters[0];
    }

    fn offer_jacobian(&mut self, equations: &Equations) {
        // Of opaque elements they are not known.
        if equations.graph.calls.is_empty() {
            self.derivatives = Derivatives::Possible(Box::new(equations.clone()));
        }
    }

    fn leaves_rows_out(&self) -> bool {
        self.watch == Watch::Rows
    }

    fn jacobian(&mut self, t: f64, state: &[f64], found: Entries<'_>) -> Result<bool, AnalysisError> {
        let Some(engine) = self.regular.as_ref().filter(|_| !self.motion.careful) else { return Ok(false) };
        self.derivatives_are_paid = true;
        if let Derivatives::Possible(equations) = &self.derivatives {
            let size = equations.graph.len();
            let known = Linearisation::of_residuals(equations, &self.motion.layout, &engine.dynamics.rows);
            self.derivatives = Derivatives::Known(Box::new(known), size);
        }
        if matches!(self.derivatives, Derivatives::Unknown) {
            return Ok(false);
        }
        self.motion.load(t, state);
        let used = self.solve_dynamics()?;
        self.publish(used);
        let (Used::Regular, Some(engine), Derivatives::Known(known, _)) =
            (used, &mut self.regular, &mut self.derivatives)
        else {
            return Ok(false);
        };
        let solver = &mut engine.solver;
        let mut solve = |loads: &[f64], gammas: &[f64], accelerations: &mut [f64], multipliers: &mut [f64]| {
            Ok(solver.solve(loads, gammas, accelerations, multipliers)?)
        };
        known.fill(&self.motion.inputs, &self.sets, state, engine.dynamics.function(1), &mut solve, found)
    }

    fn price(&self) -> Price {
        // Measured: factorisation and solution take some 100 operations an unknown, each further solution a quarter.
        let unknowns = (self.motion.layout.velocities() + self.motion.layout.rows) as f64;
        let operations = self.operations() as f64;
        let coordinates = &self.motion.coordinates;
        let coupled = self.coupling.as_ref().map_or(0, BodyCoupling::size);
        let directions = (coordinates.directions(&self.motion.layout) + coupled) as f64;
        let jacobian = 3.0 * operations + 25.0 * directions * unknowns;
        let size = match &self.derivatives {
            Derivatives::Unknown => None,
            Derivatives::Possible(equations) => Some(equations.graph.len()),
            Derivatives::Known(_, size) => Some(*size),
        };
        let known = size.is_some();
        let unpaid = size.filter(|_| !self.derivatives_are_paid);
        let preparation = unpaid.map_or(0.0, |size| PREPARATION * size as f64);
        Price { rates: operations + 100.0 * unknowns, jacobian: known.then_some(jacobian), preparation }
    }

    fn programs(&mut self) -> Vec<crate::program::Used<'_>> {
        let spare = self.regular.is_some();
        let mut list = Vec::new();
        if let Some(engine) = &mut self.regular {
            list.extend([&mut engine.dynamics, &mut engine.geometry].map(|program| program.used(false).by_steps()));
        }
        list.extend([self.safe.dynamics.used(spare), self.safe.geometry.used(spare)]);
        list.extend(self.coupling.as_mut().map(BodyCoupling::used));
        list
    }

    fn counters(&self) -> Counters {
        self.motion.counters
    }

    fn trade_sets(&mut self, sets: &mut Vec<Box<dyn ElementSet>>) {
        std::mem::swap(&mut self.sets, sets);
    }

    fn sets_mut(&mut self) -> &mut [Box<dyn ElementSet>] {
        &mut self.sets
    }

    fn sets(&self) -> &[Box<dyn ElementSet>] {
        &self.sets
    }
}
