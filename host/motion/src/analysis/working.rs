//! [`WorkingForm`]: six velocities per body, sparse elimination, and a rank-safe engine where the rank falls.

mod engine;
mod observe;
mod parts;
mod passing;
mod project;
mod solve;

pub(super) use engine::clusters;
pub use engine::sparse_engine;
use engine::{Engine, FUNCTIONS, Solution, Source};
pub use parts::WorkingParts;

use element_api::ElementSet;

use super::assembly::load;
use super::balance::{Balance, Imbalance, Trial};
use super::constraints::{Constraints, mass_values, structure};
use super::coupling::{BodyCoupling, Solve};
use super::formulation::{AnalysisError, Counters, Formulation, Group, Observed, Price, Traces};
use super::linearisation::{Linearisation, Terms, work};
use super::newton::{Correcting, ROUND_OFF, project_positions};
use super::passage::{self, Passage, Passing, Refusing};
use crate::linalg::{Clusters, DenseQr, Health, KktSolver, LinalgError, SparseLdl};
use crate::model::Model;
use crate::plan::{Coordinates, Layout, Plan, body_scales};
use crate::program::{Equations, Graph, Node, Row};

/// Numbers per body in the state: r (3), p (4), v (3), omega' (3).
pub const BODY_STATES: usize = 13;

/// Where the pivot ratio falls below this share of its value at the start, the sparse engine's choice of rows, or all of them,
/// may be close to dependent: what counts then is the ratio that masses have no part in. It goes with a squared singular value:
/// 9e-4 stands for 0.03.
pub(super) const SICK_SHARE: f64 = 9e-4;
/// A plain pivot ratio below which nothing is left but round-off.
pub(super) const SICK_TREE: f64 = 1e-12;
/// Pivot ratio, in the metric of the masses, from which elimination keeps enough digits: it loses as many as this has.
pub(super) const ACCURATE: f64 = 1e-5;
/// The same where solutions are refined once.
const ACCURATE_REFINED: f64 = 1e-10;
/// Share of the rank-safe engine's pivot ratio at the start below which nothing is solved, but interpolated: see
/// [`Passage`].
pub(super) const NEAR_SINGULAR: f64 = 0.03;
/// Share of the smallest singular value at the start below which stages are brought to the constraints before they are
/// evaluated. Two reasons, both about states off the constraints, where the stages of a method are by its local error. At a
/// singular position the acceleration there has a pole, (offset) / (distance), which a method would approach with ever
/// smaller steps. And redundant rows contradict each other there, so that it makes a difference which of them are solved.
/// On the constraints neither is the case.
pub(super) const APPROACH: f64 = 0.5;
/// Rank tolerance of the rank-safe engine during the motion; tighter than at planning, so that rows are given up only
/// where they really vanish.
pub(super) const MOTION_RANK_TOLERANCE: f64 = 1e-11;
/// Share of what the equations of motion are made of by which interpolated accelerations and reactions may miss them.
const BALANCED: f64 = 1e-9;
/// Share of a body's own loads by which a solution may miss them before it is refined.
const REFINED: f64 = 1e-11;

/// See the module documentation.
pub struct WorkingForm {
    layout: Layout,
    sets: Vec<Box<dyn ElementSet>>,
    groups: Vec<Group>,
    inputs: Vec<f64>,
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
    /// Rank and pivot ratio of the rank-safe engine at the start.
    start: Health,
    /// [`WorkingForm::start`] and [`WorkingForm::start_independence`] as they were planned.
    planned: (Health, f64),
    /// Whether the correction solved last went through the rank-safe engine.
    corrected_safely: bool,
    accelerations: Vec<f64>,
    /// What may lose rank on the way.
    watch: Watch,
    /// Take the step under way with care, see [`APPROACH`].
    careful: bool,
    passage: Passage,
    /// Scratch: accelerations and multipliers.
    forces: Vec<f64>,
    balance: Balance,
    force: Vec<f64>,
    key: Vec<f64>,
    row_names: Vec<String>,
    length: f64,
    counters: Counters,
    /// Forces that depend on what is solved for.
    coupling: Option<BodyCoupling>,
    /// Where the derivatives of the rates come from, until they are asked for; then the derivatives.
    derivatives: Derivatives,
    /// Whether they were asked for since the start, or since all was forgotten.
    derivatives_are_paid: bool,
    /// Rates of the element states and power at the state solved last.
    rates: Vec<f64>,
}

impl WorkingForm {
    /// Prepares programs and engines. The opaque elements of the model move in.
    ///
    /// # Errors
    /// When the linear algebra refuses the model's mass matrix.
    pub fn new(
        equations: &Equations,
        model: &mut Model,
        plan: &Plan,
        length: f64,
        start_health: f64,
    ) -> Result<Self, AnalysisError> {
        let sets = std::mem::take(&mut model.sets);
        Self::of(&WorkingParts::new(equations, model, plan, length, start_health), sets)
    }

    /// The same from its parts, with the opaque elements.
    ///
    /// # Errors
    /// As for [`WorkingForm::new`].
    pub(super) fn of(parts: &WorkingParts, sets: Vec<Box<dyn ElementSet>>) -> Result<Self, AnalysisError> {
        let WorkingParts { equations, plan, masses, scales, row_names, length, start_health } = parts;
        let (length, start_health) = (*length, *start_health);
        let layout = plan.layout.clone();
        let all: Vec<usize> = (0..layout.rows).collect();
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
        let dim = BODY_STATES * layout.bodies + layout.states + 1;
        Ok(Self {
            groups: groups(&layout),
            inputs: vec![0.0; layout.inputs()],
            accelerations: vec![0.0; layout.velocities()],
            force: vec![0.0; layout.velocities()],
            careful: false,
            passage: Passage::new(dim, dim.max(layout.velocities() + layout.rows)),
            forces: vec![0.0; layout.velocities() + layout.rows],
            balance: Balance::new(masses.clone(), [layout.velocities(), layout.rows], length),
            key: Vec::with_capacity(7 * layout.bodies + 1),
            least_health: start_health * SICK_SHARE,
            watch,
            sets,
            start_health,
            start_independence: plan.independence,
            alike,
            alike_at: (Vec::new(), 0.0),
            start: plan.health,
            planned: (plan.health, plan.independence),
            corrected_safely: false,
            regular,
            safe,
            row_names: row_names.clone(),
            length,
            coupling: BodyCoupling::new(equations, &layout),
            derivatives: Derivatives::Unknown,
            derivatives_are_paid: false,
            rates: vec![0.0; layout.states + 1],
            layout,
            counters: Counters::default(),
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

    /// Writes time and state into the inputs of the programs.
    fn load(&mut self, t: f64, state: &[f64]) {
        load(&self.layout, t, state, &mut self.inputs);
        self.key.clear();
        self.key.push(t);
        let bodies = state[..BODY_STATES * self.layout.bodies].chunks_exact(BODY_STATES);
        bodies.for_each(|body| self.key.extend_from_slice(&body[..7]));
    }

    /// Whether the constraints themselves (not only the sparse engine's choice of rows) have lost rank, or nearly so,
    /// where the rank-safe engine factored last.
    fn is_singular(&self, share: f64) -> bool {
        let health = self.safe.health;
        health.rank < self.start.rank || health.smallest_pivot_ratio < share * self.start.smallest_pivot_ratio
    }

    /// Factors anew whatever is asked for next.
    fn forget_factors(&mut self) {
        self.safe.factored_at.clear();
        self.alike_at.0.clear();
        if let Some(engine) = &mut self.regular {
            engine.factored_at.clear();
        }
    }

    /// Changes the opaque elements for others.
    pub(super) fn trade_sets(&mut self, sets: &mut Vec<Box<dyn ElementSet>>) {
        std::mem::swap(&mut self.sets, sets);
    }

    fn row_name(&self, row: Option<usize>) -> String {
        row.and_then(|row| self.row_names.get(row)).cloned().unwrap_or_default()
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

/// Which engine solved.
#[derive(Clone, Copy)]
enum Used {
    Regular,
    Safe,
}

/// Moves a body's (r, p) by (dr, dpi'): p + G^T dpi' / 2, normalised (Haug 1989, eq. 9.3.33).
pub(super) fn move_body(pose: &mut [f64], d: &[f64]) {
    for k in 0..3 {
        pose[k] += d[k];
    }
    let rate = parameter_rates([pose[3], pose[4], pose[5], pose[6]], [d[3], d[4], d[5]]);
    for k in 0..4 {
        pose[3 + k] += rate[k];
    }
    normalise(&mut pose[3..7]);
}

pub(super) fn normalise(p: &mut [f64]) {
    let length = p.iter().map(|e| e * e).sum::<f64>().sqrt();
    p.iter_mut().for_each(|e| *e /= length);
}

/// G^T omega' / 2 (Haug 1989, eq. 9.3.33).
pub(super) fn parameter_rates([e0, e1, e2, e3]: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 4] {
    [
        0.5 * (-e1 * x - e2 * y - e3 * z),
        0.5 * (e0 * x - e3 * y + e2 * z),
        0.5 * (e3 * x + e0 * y - e1 * z),
        0.5 * (-e2 * x + e1 * y + e0 * z),
    ]
}

fn groups(layout: &Layout) -> Vec<Group> {
    let mut groups = Vec::new();
    for _ in 0..layout.bodies {
        groups.extend([Group::Position; 3]);
        groups.extend([Group::Parameter; 4]);
        groups.extend([Group::Velocity; 3]);
        groups.extend([Group::AngularVelocity; 3]);
    }
    groups.extend(std::iter::repeat_n(Group::State, layout.states));
    groups.push(Group::Work);
    groups
}

impl Formulation for WorkingForm {
    fn name(&self) -> &'static str {
        if self.regular.is_some() { "sparse" } else { "rank-safe" }
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn state_of(&mut self, working: &[f64], state: &mut [f64]) {
        state.copy_from_slice(working);
    }

    fn forget(&mut self, _: &[f64]) {
        (self.start, self.start_independence) = self.planned;
        self.safe.solver.set_rank_limit(self.start.rank);
        self.least_health = self.start_health * SICK_SHARE;
        (self.careful, self.corrected_safely, self.derivatives_are_paid) = (false, false, false);
        self.forget_factors();
        if let Some(coupling) = &mut self.coupling {
            coupling.forget();
        }
    }

    fn set_discrete(&mut self, references: &[f64], discrete: &[f64]) {
        self.layout.write_discrete(&mut self.inputs, references, discrete);
        // A joint's equations may contain them.
        self.forget_factors();
    }

    fn rates(&mut self, t: f64, state: &[f64], rates: &mut [f64]) -> Result<(), AnalysisError> {
        passage::rates(self, t, state, rates)
    }

    fn project(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
        passage::project(self, t, state)
    }

    fn certify(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        passage::certify(self, t, state)
    }

    fn next_step(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        self.load(t, state);
        let mut independence = 0.0;
        self.careful = match &mut self.regular {
            Some(_) if self.watch == Watch::Nothing => false,
            Some(engine) => {
                engine.geometry.evaluate(&self.inputs, &self.sets)?;
                let health = engine.factor(Source::Geometry, &self.key, &mut self.counters);
                let ratio = health.map_or(0.0, |health| health.smallest_pivot_ratio);
                // It may have fallen because of masses.
                self.least_health = SICK_SHARE * self.start_health.min(ratio / (APPROACH * APPROACH));
                independence = self.independence(Source::Geometry);
                independence < APPROACH * APPROACH * self.start_independence
            }
            None => self.layout.rows > self.start.rank,
        };
        if self.careful {
            // On the constraints the rank is what it is; a scene that starts in a singular position may gain some.
            self.safe.solver.set_rank_limit(usize::MAX);
            self.safe.factored_at.clear();
            self.safe.geometry.evaluate(&self.inputs, &self.sets)?;
            self.safe.factor(Source::Geometry, &self.key, &mut self.counters)?;
            self.start.rank = self.start.rank.max(self.safe.health.rank);
            self.safe.solver.set_rank_limit(self.start.rank);
            if self.watch == Watch::Loops && !self.is_singular(APPROACH) && independence > SICK_TREE {
                // All rows are in use and independent: their order in the sparse engine is to blame.
                self.start_independence = independence;
                self.careful = false;
            }
        }
        Ok(())
    }

    fn observe(&mut self, t: f64, state: &[f64], dynamics: bool) -> Result<Observed<'_>, AnalysisError> {
        self.load(t, state);
        let mut imbalance = Imbalance::default();
        if dynamics {
            let used = self.solve_dynamics()?;
            let near = matches!(used, Used::Safe) && self.is_singular(NEAR_SINGULAR);
            if !near || !self.observe_between(t, state)? {
                self.publish(used);
                imbalance = self.certify(used)?;
            }
        }
        Ok(Observed { inputs: &self.inputs, imbalance })
    }

    fn entry_of(&self, slot: usize) -> Option<usize> {
        Coordinates::of_bodies(&self.layout).entry_of(slot, &self.layout)
    }

    fn written_in_state(&self, equations: &Equations, nodes: &[Node]) -> Option<(Graph, Vec<Node>)> {
        Some((equations.graph.clone(), nodes.to_vec()))
    }

    fn traces(&self) -> Traces {
        let guess = self.coupling.as_ref().and_then(BodyCoupling::guess);
        Traces { guesses: [guess, None], counters: [self.counters, Counters::default()], look: None }
    }

    fn forget_since(&mut self, traces: &Traces) {
        if let Some(coupling) = &mut self.coupling {
            coupling.start_from(&traces.guesses[0]);
        }
        self.counters = traces.counters[0];
    }

    fn offer_jacobian(&mut self, equations: &Equations) {
        if Terms::of_bodies(equations, &self.layout).is_some() {
            self.derivatives = Derivatives::Possible(Box::new(equations.clone()));
        }
    }

    fn leaves_rows_out(&self) -> bool {
        self.watch == Watch::Rows
    }

    fn jacobian(&mut self, t: f64, state: &[f64], matrix: &mut [f64]) -> Result<bool, AnalysisError> {
        let Some(engine) = self.regular.as_ref().filter(|_| !self.careful) else { return Ok(false) };
        self.derivatives_are_paid = true;
        if let Derivatives::Possible(equations) = &self.derivatives {
            let size = equations.graph.len();
            let terms = Terms::of_bodies(equations, &self.layout);
            let known = terms.map(|terms| Linearisation::new(&terms, &self.layout, &engine.dynamics.rows));
            self.derivatives = known.map_or(Derivatives::Unknown, |known| Derivatives::Known(Box::new(known), size));
        }
        if matches!(self.derivatives, Derivatives::Unknown) {
            return Ok(false);
        }
        self.load(t, state);
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
        known.fill(&self.inputs, &self.sets, state, engine.dynamics.function(1), &mut solve, matrix)?;
        Ok(true)
    }

    fn price(&self) -> Price {
        // Measured: factorisation and solution take some 100 operations an unknown, each further solution a quarter.
        let unknowns = (self.layout.velocities() + self.layout.rows) as f64;
        let operations = self.operations() as f64;
        let coordinates = Coordinates::of_bodies(&self.layout);
        let directions = coordinates.directions(&self.layout) as f64;
        let jacobian = 3.0 * operations + 25.0 * directions * unknowns;
        let size = match &self.derivatives {
            Derivatives::Unknown => None,
            Derivatives::Possible(equations) => Some(equations.graph.len()),
            Derivatives::Known(_, size) => Some(*size),
        };
        let known = size.is_some();
        let unpaid = size.filter(|_| !self.derivatives_are_paid);
        let preparation = unpaid.map_or(0.0, |size| 50.0 * work(&coordinates, size, &self.layout) as f64);
        Price { rates: operations + 100.0 * unknowns, jacobian: known.then_some(jacobian), preparation }
    }

    fn programs(&mut self) -> Vec<crate::program::Used<'_>> {
        let spare = self.regular.is_some();
        let mut list = Vec::new();
        if let Some(engine) = &mut self.regular {
            list.extend([engine.dynamics.used(false), engine.geometry.used(false)]);
        }
        list.extend([self.safe.dynamics.used(spare), self.safe.geometry.used(spare)]);
        list.extend(self.coupling.as_mut().map(BodyCoupling::used));
        list
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn sets_mut(&mut self) -> &mut [Box<dyn ElementSet>] {
        &mut self.sets
    }

    fn sets(&self) -> &[Box<dyn ElementSet>] {
        &self.sets
    }
}
