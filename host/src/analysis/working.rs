//! [`WorkingForm`]: six velocities per body, sparse elimination, and a rank-safe engine where the rank falls.

use element_api::ElementSet;

use super::balance::{Balance, Imbalance, Trial};
use super::constraints::{Constraints, mass_values, structure};
use super::coupling::{BodyCoupling, Solve};
use super::formulation::{AnalysisError, Counters, Formulation, Group, Observed, Price};
use super::linearisation::{Linearisation, Terms, work};
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
/// Violations below this share of the scene's size are round-off.
pub(super) const ROUND_OFF: f64 = 4.0 * f64::EPSILON;
/// Share of what the equations of motion are made of by which interpolated accelerations and reactions may miss them.
const BALANCED: f64 = 1e-9;
/// Share of a body's own loads by which a solution may miss them before it is refined.
const REFINED: f64 = 1e-11;
/// Newton corrections per projection before the constraints count as lost.
pub(super) const MOST_CORRECTIONS: usize = 12;

/// A choice of rows with the engine that solves for them.
struct Engine<S> {
    /// Jacobian, gamma, Phi_t of the rows; then loads, state rates, power.
    dynamics: Constraints,
    /// Jacobian, values, Phi_t of the rows.
    geometry: Constraints,
    solver: S,
    multipliers: Vec<f64>,
    right: Vec<f64>,
    /// Position and time of the factorisation in force.
    factored_at: Vec<f64>,
    health: Health,
}

/// The index of each function in [`Engine::dynamics`] and [`Engine::geometry`].
const FUNCTIONS: usize = 2;

impl<S: KktSolver> Engine<S> {
    fn new(equations: &Equations, masses: &[f64], rows: &[usize], solver: S) -> Result<Self, AnalysisError> {
        let gamma: fn(&Row) -> _ = |row| row.gamma;
        let time: fn(&Row) -> _ = |row| row.time;
        let value: fn(&Row) -> _ = |row| row.value;
        let mut further = equations.loads.clone();
        further.extend(&equations.state_rates);
        further.push(equations.power);
        let mut engine = Self {
            dynamics: Constraints::new(equations, rows, &[gamma, time], &further)?,
            geometry: Constraints::new(equations, rows, &[value, time], &[])?,
            solver,
            multipliers: vec![0.0; rows.len()],
            right: vec![0.0; rows.len()],
            factored_at: Vec::new(),
            health: Health { rank: 0, smallest_pivot_ratio: 0.0 },
        };
        engine.solver.set_mass(masses)?;
        Ok(engine)
    }

    /// The same rows by another solver.
    fn with<T: KktSolver>(&self, masses: &[f64], solver: T) -> Result<Engine<T>, AnalysisError> {
        let mut engine = Engine {
            dynamics: self.dynamics.clone(),
            geometry: self.geometry.clone(),
            multipliers: self.multipliers.clone(),
            right: self.right.clone(),
            factored_at: Vec::new(),
            health: Health { rank: 0, smallest_pivot_ratio: 0.0 },
            solver,
        };
        engine.solver.set_mass(masses)?;
        Ok(engine)
    }

    /// Accelerations, multipliers, state rates and power from the functions evaluated and the factorisation in force.
    fn solve_motion(
        &mut self,
        coupling: Option<&mut BodyCoupling>,
        inputs: &mut [f64],
        sets: &[Box<dyn ElementSet>],
        solution: Solution<'_>,
        counters: &mut Counters,
    ) -> Result<(), AnalysisError> {
        let Solution { accelerations, rates } = solution;
        match coupling {
            None => {
                let (loads, further) = self.dynamics.further(FUNCTIONS).split_at(accelerations.len());
                rates.copy_from_slice(further);
                self.solver.solve(loads, self.dynamics.function(0), accelerations, &mut self.multipliers)?;
            }
            Some(coupling) => {
                self.right.fill(0.0);
                let mut solver = Solver { dynamics: &self.dynamics, solver: &mut self.solver, zero: &self.right };
                coupling.solve(inputs, sets, &mut solver, accelerations, &mut self.multipliers, counters)?;
                rates.copy_from_slice(coupling.rates());
            }
        }
        Ok(())
    }

    /// Adds the solution for what `balance` says is left of the equations.
    fn refine(&mut self, balance: &Balance, accelerations: &mut [f64]) -> Result<(), LinalgError> {
        let (f, g) = balance.left(self.multipliers.len());
        let (mut da, mut dlambda) = (vec![0.0; f.len()], vec![0.0; g.len()]);
        self.solver.solve(f, g, &mut da, &mut dlambda)?;
        accelerations.iter_mut().zip(&da).for_each(|(a, d)| *a += d);
        self.multipliers.iter_mut().zip(&dlambda).for_each(|(lambda, d)| *lambda += d);
        Ok(())
    }

    /// Factors the Jacobian unless the one of this very position is in force.
    fn factor(&mut self, from: Source, key: &[f64], counters: &mut Counters) -> Result<Health, LinalgError> {
        if self.factored_at == key {
            counters.reused += 1;
            return Ok(self.health);
        }
        self.factored_at.clear();
        let jacobian = match from {
            Source::Dynamics => self.dynamics.jacobian(),
            Source::Geometry => self.geometry.jacobian(),
        };
        counters.factorisations += 1;
        self.health = self.solver.refactor(jacobian)?;
        self.factored_at.extend_from_slice(key);
        Ok(self.health)
    }
}

/// Where the solution of the equations of motion goes.
struct Solution<'a> {
    accelerations: &'a mut [f64],
    /// Rates of the element states, then the power.
    rates: &'a mut [f64],
}

/// An engine as the coupling sees it.
struct Solver<'a, S> {
    dynamics: &'a Constraints,
    solver: &'a mut S,
    zero: &'a [f64],
}

impl<S: KktSolver> Solve for Solver<'_, S> {
    fn solve(
        &mut self,
        loads: &[f64],
        with_gamma: bool,
        accelerations: &mut [f64],
        multipliers: &mut [f64],
    ) -> Result<(), AnalysisError> {
        let right = if with_gamma { self.dynamics.function(0) } else { self.zero };
        Ok(self.solver.solve(loads, right, accelerations, multipliers)?)
    }
    fn rows(&self) -> &[usize] {
        &self.dynamics.rows
    }
}

#[derive(Clone, Copy)]
enum Source {
    Dynamics,
    Geometry,
}

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

/// What the form in coordinates of bodies is made of.
pub struct WorkingParts {
    equations: Equations,
    plan: Plan,
    masses: Vec<f64>,
    /// As [`body_scales`].
    scales: Vec<f64>,
    /// Joint and row of every row.
    pub(super) row_names: Vec<String>,
    length: f64,
    start_health: f64,
}

impl WorkingParts {
    /// The equations of a planned model. `start_health`: the pivot ratio of the sparse engine at the start; `length`: that of the
    /// scene, m.
    #[must_use]
    pub fn new(equations: &Equations, model: &Model, plan: &Plan, length: f64, start_health: f64) -> Self {
        let mut equations = equations.clone();
        equations.graph.rest();
        let row_name = |row: usize| {
            let (element, k) = plan.layout.element_of_row(row);
            model.elements[element].row_name(k)
        };
        Self {
            equations,
            plan: plan.clone(),
            masses: mass_values(model),
            scales: body_scales(model, length),
            row_names: (0..plan.layout.rows).map(row_name).collect(),
            length,
            start_health,
        }
    }
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
        self.inputs[Layout::TIME] = t;
        self.key.clear();
        self.key.push(t);
        for body in 0..self.layout.bodies {
            let from = BODY_STATES * body;
            let to = self.layout.body_slot(body, 0);
            self.inputs[to..to + BODY_STATES].copy_from_slice(&state[from..from + BODY_STATES]);
            self.key.extend_from_slice(&state[from..from + 7]);
        }
        let states = BODY_STATES * self.layout.bodies;
        let slot = self.layout.state_slot();
        self.inputs[slot..slot + self.layout.states].copy_from_slice(&state[states..states + self.layout.states]);
    }

    /// Accelerations and multipliers at the inputs' state: [M Phi_q^T; Phi_q 0] [a; lambda] = [Q; gamma].
    fn solve_dynamics(&mut self) -> Result<Used, AnalysisError> {
        if let Some(engine) = &mut self.regular {
            engine.dynamics.evaluate(&self.inputs, &self.sets)?;
            let health = engine.factor(Source::Dynamics, &self.key, &mut self.counters);
            if self.is_trusted(Source::Dynamics, &health)
                && let Some(engine) = &mut self.regular
            {
                let solution = Solution { accelerations: &mut self.accelerations, rates: &mut self.rates };
                let coupling = self.coupling.as_mut();
                engine.solve_motion(coupling, &mut self.inputs, &self.sets, solution, &mut self.counters)?;
                return Ok(Used::Regular);
            }
        }
        self.counters.rank_safe += u64::from(self.regular.is_some());
        let engine = &mut self.safe;
        engine.dynamics.evaluate(&self.inputs, &self.sets)?;
        engine.factor(Source::Dynamics, &self.key, &mut self.counters)?;
        let solution = Solution { accelerations: &mut self.accelerations, rates: &mut self.rates };
        engine.solve_motion(self.coupling.as_mut(), &mut self.inputs, &self.sets, solution, &mut self.counters)?;
        if self.coupling.is_none() {
            let loads = &engine.dynamics.further(FUNCTIONS)[..self.accelerations.len()];
            self.balance.take_motion(&engine.dynamics, loads, &self.accelerations, &engine.multipliers);
            self.balance.accept()?;
        }
        Ok(Used::Safe)
    }

    /// The smallest move (in the metric of the mass) that changes the rows by minus their residual: M d + Phi_q^T mu = 0,
    /// Phi_q d = -residual. Left in `accelerations`. Returns which residual was worst and by how much. Unless `finely`,
    /// residuals of positions that are round-off are left alone.
    fn solve_correction(&mut self, velocity: bool, finely: bool) -> Result<(f64, Option<usize>), AnalysisError> {
        self.force.fill(0.0);
        if let Some(engine) = &mut self.regular {
            engine.geometry.evaluate(&self.inputs, &self.sets)?;
            let worst = residual(engine, velocity, &self.layout, &self.inputs, self.length);
            // A residual that is not a number is for the caller to report, with its row.
            if !velocity && ((!finely && worst.0 <= ROUND_OFF * self.length) || !worst.0.is_finite()) {
                self.accelerations.fill(0.0);
                return Ok(worst);
            }
            let health = engine.factor(Source::Geometry, &self.key, &mut self.counters);
            if self.is_trusted(Source::Geometry, &health)
                && let Some(engine) = &mut self.regular
            {
                engine.solver.solve(&self.force, &engine.right, &mut self.accelerations, &mut engine.multipliers)?;
                self.corrected_safely = false;
                return Ok(worst);
            }
        }
        self.corrected_safely = true;
        let engine = &mut self.safe;
        engine.geometry.evaluate(&self.inputs, &self.sets)?;
        let worst = residual(engine, velocity, &self.layout, &self.inputs, self.length);
        if !velocity && !worst.0.is_finite() {
            return Ok(worst);
        }
        engine.factor(Source::Geometry, &self.key, &mut self.counters)?;
        engine.solver.solve(&self.force, &engine.right, &mut self.accelerations, &mut engine.multipliers)?;
        Ok(worst)
    }

    /// Whether the sparse engine is trusted with what it factored last. Far from singular positions a pivot ratio that has not
    /// fallen by far is enough; where it has, or next to them, what counts is the ratio that masses have no part in, and how many
    /// digits elimination keeps. Next to a singular position that is a ratio of whole rows: a small one at the start may be that
    /// of rows that have nothing to do with it.
    fn is_trusted(&mut self, from: Source, health: &Result<Health, LinalgError>) -> bool {
        let Ok(health) = health else { return false };
        let ratio = health.smallest_pivot_ratio;
        if self.watch == Watch::Nothing || !self.careful && ratio >= self.least_health {
            return ratio >= ACCURATE_REFINED;
        }
        let least = if self.careful { self.start_independence.max(1.0) } else { self.start_independence };
        ratio >= ACCURATE_REFINED && self.independence(from) >= SICK_SHARE * least
    }

    /// Pivot ratio of the rows in use where they were evaluated last, whatever the masses.
    fn independence(&mut self, from: Source) -> f64 {
        let (Some(engine), Some(alike)) = (&self.regular, &mut self.alike) else { return 1.0 };
        let jacobian = match from {
            Source::Dynamics => engine.dynamics.jacobian(),
            Source::Geometry => engine.geometry.jacobian(),
        };
        let (key, ratio) = &mut self.alike_at;
        if *key != self.key {
            self.counters.factorisations += 1;
            *ratio = alike.refactor(jacobian).map_or(0.0, |health| health.smallest_pivot_ratio);
            key.clone_from(&self.key);
        }
        *ratio
    }

    /// Newton's method on the positions; with `keep_away`, refused next to a singular position. Without it they are corrected
    /// once more than usual: what is left of violations goes into the positions divided by the distance.
    fn project_positions(&mut self, t: f64, state: &mut [f64], keep_away: bool) -> Result<(), AnalysisError> {
        let mut again = !keep_away;
        for _ in 0..MOST_CORRECTIONS {
            self.load(t, state);
            let (violation, row) = self.solve_correction(false, !keep_away)?;
            if keep_away && violation.is_finite() && self.corrected_safely && self.is_singular(NEAR_SINGULAR) {
                return Err(AnalysisError::NextToSingular);
            }
            if !violation.is_finite() {
                return Err(AnalysisError::NotFinite { what: format!("constraint {}", self.row_name(row)) });
            }
            if keep_away && violation <= ROUND_OFF * self.length {
                return Ok(());
            }
            self.counters.position_corrections += 1;
            let size = self.move_bodies(state);
            // Quadratic convergence: the next violation is about size^2 / length.
            let converged = (size / self.length).powi(2) <= ROUND_OFF;
            if converged && !std::mem::take(&mut again) {
                self.load(t, state);
                return Ok(());
            }
        }
        self.load(t, state);
        let (violation, row) = self.solve_correction(false, false)?;
        // Near-singular positions stall at a small violation; far ones mean that the branch is lost.
        if violation > 1e-9 * self.length {
            let violation = violation / self.length;
            return Err(AnalysisError::LeftConstraints { what: self.row_name(row), violation });
        }
        Ok(())
    }

    /// Accelerations and multipliers next to a singular position into the inputs; `false` where the velocity does not lead
    /// through it, and nothing is done.
    fn observe_between(&mut self, t: f64, state: &[f64]) -> Result<bool, AnalysisError> {
        // They follow each other among the inputs.
        let slots = self.layout.acceleration_slot()..self.layout.inputs();
        let (mut passage, mut forces) = (std::mem::take(&mut self.passage), std::mem::take(&mut self.forces));
        let passed = passage.interpolate(self, t, state, &mut forces, |form, t, place, forces| {
            form.project_plainly(t, place, false)?;
            form.load(t, place);
            let used = form.solve_dynamics()?;
            form.publish(used);
            forces.copy_from_slice(&form.inputs[slots.clone()]);
            Ok(())
        });
        (self.passage, self.forces) = (passage, forces);
        self.load(t, state);
        if !passed? {
            // As it was before.
            self.solve_dynamics()?;
            return Ok(false);
        }
        self.inputs[slots].copy_from_slice(&self.forces);
        if self.unbalanced()? > BALANCED {
            // Reactions may have a pole there. What is solved for next to it is the better for that.
            self.solve_dynamics()?;
            return Ok(false);
        }
        self.counters.interpolated += 1;
        Ok(true)
    }

    /// How far accelerations and multipliers in the inputs miss all equations, see [`Balance::of_all`].
    fn unbalanced(&mut self) -> Result<f64, AnalysisError> {
        let dynamics = &mut self.safe.dynamics;
        dynamics.evaluate(&self.inputs, &self.sets)?;
        let (a, lambda) = self.inputs[self.layout.acceleration_slot()..].split_at(self.layout.velocities());
        self.balance.take(dynamics, &dynamics.further(FUNCTIONS)[..a.len()], a, lambda);
        Ok(self.balance.of_all())
    }

    /// How far what was solved for and published misses the equations of motion of a body, forces that depend on the solution
    /// evaluated with it. Where it misses them by more than round-off, the solution is refined once.
    fn certify(&mut self, used: Used) -> Result<Imbalance, AnalysisError> {
        let found = self.left_of_bodies(used, Balance::take_motion)?;
        if found.share <= REFINED {
            return Ok(found);
        }
        self.left_of_bodies(used, Balance::take)?;
        match (used, &mut self.regular) {
            (Used::Regular, Some(engine)) => engine.refine(&self.balance, &mut self.accelerations)?,
            _ => self.safe.refine(&self.balance, &mut self.accelerations)?,
        }
        self.publish(used);
        self.left_of_bodies(used, Balance::take_motion)
    }

    fn left_of_bodies(
        &mut self,
        used: Used,
        take: fn(&mut Balance, &Constraints, &[f64], &[f64], &[f64]),
    ) -> Result<Imbalance, AnalysisError> {
        let (dynamics, lambda) = match (used, &self.regular) {
            (Used::Regular, Some(engine)) => (&engine.dynamics, &engine.multipliers),
            _ => (&self.safe.dynamics, &self.safe.multipliers),
        };
        let loads = match &mut self.coupling {
            Some(coupling) => coupling.loads(&self.inputs, &self.sets)?,
            None => &dynamics.further(FUNCTIONS)[..self.accelerations.len()],
        };
        take(&mut self.balance, dynamics, loads, &self.accelerations, lambda);
        Ok(self.balance.of_bodies())
    }

    /// Whether the constraints themselves (not only the sparse engine's choice of rows) have lost rank, or nearly so,
    /// where the rank-safe engine factored last.
    fn is_singular(&self, share: f64) -> bool {
        let health = self.safe.health;
        health.rank < self.start.rank || health.smallest_pivot_ratio < share * self.start.smallest_pivot_ratio
    }

    /// Accelerations and multipliers into the inputs.
    fn publish(&mut self, used: Used) {
        let slot = self.layout.acceleration_slot();
        self.inputs[slot..slot + self.accelerations.len()].copy_from_slice(&self.accelerations);
        let slot = self.layout.multiplier_slot();
        self.inputs[slot..slot + self.layout.rows].fill(0.0);
        let (rows, multipliers) = match (used, &self.regular) {
            (Used::Regular, Some(engine)) => (&engine.dynamics.rows, &engine.multipliers),
            _ => (&self.safe.dynamics.rows, &self.safe.multipliers),
        };
        for (row, value) in rows.iter().zip(multipliers) {
            self.inputs[slot + row] = *value;
        }
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

    /// Moves all bodies by the correction in `accelerations`; gives its size, m.
    fn move_bodies(&self, state: &mut [f64]) -> f64 {
        let mut size = 0.0_f64;
        for body in 0..self.layout.bodies {
            let d = &self.accelerations[6 * body..6 * body + 6];
            move_body(&mut state[BODY_STATES * body..BODY_STATES * body + 7], d);
            for k in 0..3 {
                size = size.max(d[k].abs()).max(d[3 + k].abs() * self.length);
            }
        }
        size
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

/// Puts minus the residual of positions or velocities into `engine.right`; gives the worst violation.
fn residual<S>(
    engine: &mut Engine<S>,
    velocity: bool,
    layout: &Layout,
    inputs: &[f64],
    length: f64,
) -> (f64, Option<usize>) {
    if velocity {
        rate_residual(&engine.geometry, layout, inputs, &mut engine.right);
    } else {
        engine.right.copy_from_slice(engine.geometry.function(0));
    }
    let worst = engine.geometry.worst(&engine.right, length);
    engine.right.iter_mut().for_each(|x| *x = -*x);
    worst
}

/// Phi_q [v; omega'] + Phi_t.
fn rate_residual(geometry: &Constraints, layout: &Layout, inputs: &[f64], right: &mut [f64]) {
    right.copy_from_slice(geometry.function(1));
    for ((row, column), value) in geometry.structure.jacobian.iter().zip(geometry.jacobian()) {
        right[*row] += value * inputs[layout.body_slot(column / 6, 7 + column % 6)];
    }
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

/// One cluster per body, and one per joint.
pub(super) fn clusters(layout: &Layout, rows: &[usize]) -> Clusters {
    Clusters {
        velocities: (0..layout.velocities()).map(|k| k / 6).collect(),
        rows: rows.iter().map(|row| layout.element_of_row(*row).0).collect(),
    }
}

/// The sparse engine for a choice of rows: one cluster per body and per joint.
///
/// # Errors
/// When the patterns are inconsistent, which would be a defect of the equations.
pub fn sparse_engine(equations: &Equations, rows: &[usize], layout: &Layout) -> Result<SparseLdl, LinalgError> {
    let structure = structure(equations, rows)?;
    SparseLdl::with_computed_order(&structure, Some(&clusters(layout, rows)))
}

impl Refusing for WorkingForm {
    fn passage(&mut self) -> &mut Passage {
        &mut self.passage
    }

    fn counted(&mut self) -> &mut Counters {
        &mut self.counters
    }

    fn is_careful(&self) -> bool {
        self.careful
    }

    fn normalise(&self, state: &mut [f64]) {
        for body in 0..self.layout.bodies {
            normalise(&mut state[BODY_STATES * body + 3..BODY_STATES * body + 7]);
        }
    }

    fn project_plainly(&mut self, t: f64, state: &mut [f64], keep_away: bool) -> Result<(), AnalysisError> {
        self.normalise(state);
        if self.layout.rows == 0 {
            return Ok(());
        }
        self.project_positions(t, state, keep_away)?;
        self.load(t, state);
        self.solve_correction(true, false)?;
        for body in 0..self.layout.bodies {
            for k in 0..6 {
                state[BODY_STATES * body + 7 + k] += self.accelerations[6 * body + k];
            }
        }
        Ok(())
    }

    fn miss(&mut self, t: f64, state: &[f64]) -> Result<(f64, String), AnalysisError> {
        self.load(t, state);
        self.safe.geometry.evaluate(&self.inputs, &self.sets)?;
        let (violation, row) = self.safe.geometry.worst(self.safe.geometry.function(0), self.length);
        Ok((violation / self.length, self.row_name(row)))
    }

    fn try_rates(&mut self, t: f64, state: &[f64], rates: &[f64]) -> Result<(), AnalysisError> {
        self.load(t, state);
        let dynamics = &mut self.safe.dynamics;
        dynamics.evaluate(&self.inputs, &self.sets)?;
        let bodies = BODY_STATES * self.layout.bodies;
        let of_bodies = |entries: &[f64]| -> Vec<f64> {
            entries[..bodies].chunks_exact(BODY_STATES).flat_map(|body| &body[7..13]).copied().collect()
        };
        let (velocities, accelerations) = (of_bodies(state), of_bodies(rates));
        let (loads, further) = dynamics.further(FUNCTIONS).split_at(accelerations.len());
        let work = self.layout.states;
        let driven = rates[bodies + work] - further[work];
        let trial = Trial {
            structure: &dynamics.structure,
            values: (self.balance.mass(), dynamics.jacobian()),
            gamma: dynamics.function(0),
            velocities: &velocities,
            accelerations: &accelerations,
            loads,
            driven: self.coupling.is_none().then_some(driven),
        };
        trial.accept(|row| self.row_names[row].clone())
    }

    fn rates_plainly(
        &mut self,
        t: f64,
        state: &[f64],
        rates: &mut [f64],
        keep_away: bool,
    ) -> Result<(), AnalysisError> {
        self.load(t, state);
        let used = self.solve_dynamics()?;
        if matches!(used, Used::Safe) && keep_away && self.is_singular(NEAR_SINGULAR) {
            return Err(AnalysisError::NextToSingular);
        }
        let (times, multipliers) = match (used, &self.regular) {
            (Used::Regular, Some(engine)) => (engine.dynamics.function(1), &engine.multipliers),
            _ => (self.safe.dynamics.function(1), &self.safe.multipliers),
        };
        for body in 0..self.layout.bodies {
            let y = &state[BODY_STATES * body..BODY_STATES * (body + 1)];
            let dy = &mut rates[BODY_STATES * body..BODY_STATES * (body + 1)];
            dy[..3].copy_from_slice(&y[7..10]);
            let p_rate = parameter_rates([y[3], y[4], y[5], y[6]], [y[10], y[11], y[12]]);
            dy[3..7].copy_from_slice(&p_rate);
            dy[7..13].copy_from_slice(&self.accelerations[6 * body..6 * body + 6]);
        }
        let states = BODY_STATES * self.layout.bodies;
        rates[states..states + self.layout.states].copy_from_slice(&self.rates[..self.layout.states]);
        // Constraints that depend on time do work too: the power of -Phi_q^T lambda is lambda . Phi_t.
        let driven: f64 = times.iter().zip(multipliers).map(|(time, lambda)| time * lambda).sum();
        rates[states + self.layout.states] = self.rates[self.layout.states] + driven;
        Ok(())
    }
}

impl Passing for WorkingForm {
    fn fastest(&self, state: &[f64]) -> f64 {
        let bodies = state[..BODY_STATES * self.layout.bodies].chunks_exact(BODY_STATES);
        let speeds = bodies.flat_map(|y| y[7..13].iter().enumerate());
        speeds.fold(0.0, |most, (k, speed)| most.max(speed.abs() / if k < 3 { self.length } else { 1.0 }))
    }

    fn shift(&self, state: &[f64], s: f64, moved: &mut [f64]) {
        moved.copy_from_slice(state);
        for body in moved[..BODY_STATES * self.layout.bodies].chunks_exact_mut(BODY_STATES) {
            let (pose, velocity) = body.split_at_mut(7);
            let d = [0, 1, 2, 3, 4, 5].map(|k| s * velocity[k]);
            move_body(pose, &d);
        }
    }

    fn share(&mut self, t: f64, state: &[f64]) -> Result<f64, AnalysisError> {
        self.load(t, state);
        self.safe.geometry.evaluate(&self.inputs, &self.sets)?;
        let health = self.safe.factor(Source::Geometry, &self.key, &mut self.counters)?;
        let lost = health.rank < self.start.rank;
        Ok(if lost { 0.0 } else { health.smallest_pivot_ratio / self.start.smallest_pivot_ratio })
    }
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
        let slot = self.layout.reference_slot();
        self.inputs[slot..slot + references.len()].copy_from_slice(references);
        let slot = self.layout.discrete_slot();
        self.inputs[slot..slot + discrete.len()].copy_from_slice(discrete);
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

    fn time_derivative(&self, t: f64, slopes: &mut [f64]) -> bool {
        let Derivatives::Known(known, _) = &self.derivatives else { return false };
        let exact = known.slopes(t).filter(|_| !self.careful);
        exact.map(|exact| slopes.copy_from_slice(exact)).is_some()
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
