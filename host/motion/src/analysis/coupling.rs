//! [`Coupling`]: accelerations, reactions and the forces that depend on them, solved together.
//!
//! With z the accelerations and multipliers that the loads Q depend on, and P the choice of them among all,
//!
//! z = F(z) = P S(Q(z), gamma),  S the solution of [M Phi_q^T; Phi_q 0],
//!
//! is solved by Newton's method with the exact derivatives: (I - F_z) dz = F(z) - z. In coordinates of bodies F_z = P S(Q_z, 0)
//! column by column ([`BodyCoupling`]); in those of joints it is written down. The reference engine iterates z <- F(z) instead:
//! the twin.

use std::ops::Range;

use element_api::ElementSet;

use super::closing::{Closing, largest, solved_at, units};
use super::evaluator::Evaluator;
use super::formulation::{AnalysisError, Counters, Guess};
use crate::plan::Layout;
use crate::program::{Equations, Graph, Node, Program, Used, Workspace, sizes_of_terms};

/// Iterations before a scene counts as having no solution.
pub(super) const MOST_ITERATIONS: usize = 60;
/// Change of z at which it counts as found, as a share of what the same body's accelerations or the same joint's multipliers
/// are at most: a light body's reactions count beside a heavy one's.
pub(super) const CLOSE: f64 = 1e-13;
/// The same as a share of the largest of all, accepted where round-off prevents a smaller change.
pub(super) const CLOSE_ENOUGH: f64 = 1e-10;

/// Accelerations below this share of those that loads would cause one by one, or gravity, are taken as if they were as large: at rest,
/// where loads and reactions cancel, nothing but round-off is left to be a share of.
const CANCELLED: f64 = 1e-3;

/// Iterations after which nothing is gained any more where Newton's steps are exact.
const EXACT_STEPS: usize = 3;
/// Share of the smallest difference so far below which another is a gain, and more than round-off after an exact step.
const FALLS: f64 = 0.1;

/// Solves the equations of motion for given loads and right side of the constraints.
pub(super) trait Solve {
    /// Accelerations and multipliers (one per row in use) for `loads` and, unless only a change of loads is asked about,
    /// the constraints' right side.
    fn solve(
        &mut self,
        loads: &[f64],
        with_gamma: bool,
        accelerations: &mut [f64],
        multipliers: &mut [f64],
    ) -> Result<(), AnalysisError>;
    /// Rows in use, ascending.
    fn rows(&self) -> &[usize];
}

/// What an iteration changed: see [`CLOSE`] and [`CLOSE_ENOUGH`].
struct Change {
    own: f64,
    whole: f64,
    /// The largest difference of accelerations, and of multipliers, as it is.
    plain: [f64; 2],
}

/// Newton's method for z. Whoever uses it solves the equations of motion between [`Coupling::begin`] and the calls of
/// [`Coupling::advance`], until these agree.
pub(super) struct Coupling {
    slots: Vec<usize>,
    /// The slots of the body's accelerations or the joint's multipliers that each of `slots` belongs to.
    peers: Vec<Range<usize>>,
    /// Accelerations and multipliers among the inputs.
    solved: [Range<usize>; 2],
    z: Vec<f64>,
    step: Vec<f64>,
    closing: Closing,
    /// Whether `z` holds a solution to start from.
    started: bool,
    /// Whether F is linear. Newton's step then is exact unless I - F_z is singular, and what is left of the difference is round-off of
    /// F: where all accelerations vanish, no share of them. Where F is nothing, steps of z become smaller without end and change nothing
    /// of F, or only those of its parts that are not added to what is larger: these converge, but as slowly as they do alone.
    linear: bool,
    iteration: usize,
    /// The smallest change so far.
    best: f64,
    /// The smallest differences so far, of accelerations and of multipliers.
    least: [f64; 2],
    /// F(z) of the last iteration.
    found: Vec<f64>,
    /// The largest acceleration that a load by itself would cause; that of gravity where loads are not known.
    unbalanced: f64,
}

impl Coupling {
    /// For inputs at these slots, in a scene with this acceleration of gravity, m/s^2.
    pub(super) fn new(slots: Vec<usize>, linear: bool, layout: &Layout, gravity: f64) -> Self {
        let n = slots.len();
        Self {
            peers: slots.iter().map(|slot| layout.solved_peers(*slot)).collect(),
            slots,
            solved: layout.solved(),
            z: vec![0.0; n],
            step: vec![0.0; n],
            closing: Closing::new(n),
            started: false,
            linear,
            iteration: 0,
            best: f64::INFINITY,
            least: [f64::INFINITY; 2],
            found: vec![f64::NAN; n],
            unbalanced: gravity,
        }
    }

    /// Steps of difference quotients along each of z, as shares of the whole solution that the inputs hold: where z is but a small part
    /// of that, what a step of its own size changes of F is round-off. Where F is not linear, of the largest of z.
    pub(super) fn steps(&self, inputs: &[f64], share: f64) -> Vec<f64> {
        let of_z = largest(&self.z);
        let [accelerations, multipliers] = self.solved.each_ref().map(|all| largest(&inputs[all.clone()]));
        let size = |slot: &usize| match (self.linear, *slot >= self.solved[1].start) {
            (false, _) => of_z,
            (true, true) => multipliers,
            (true, false) => accelerations,
        };
        let step = |size: f64| if size > f64::MIN_POSITIVE { share * size } else { share };
        self.slots.iter().map(|slot| step(size(slot))).collect()
    }

    /// Starts from nothing next time.
    pub(super) fn forget(&mut self) {
        self.started = false;
    }

    /// What the next solution starts from; `None`: from nothing.
    pub(super) fn guess(&self) -> Guess {
        self.started.then(|| self.z.clone())
    }

    /// Starts from there next time.
    pub(super) fn start_from(&mut self, guess: &Guess) {
        self.started = guess.is_some();
        if let Some(guess) = guess {
            self.z.copy_from_slice(guess);
        }
    }

    /// Writes the first guess of z into the inputs.
    pub(super) fn begin(&mut self, inputs: &mut [f64]) {
        if !self.started {
            self.z.fill(0.0);
        }
        (self.iteration, self.best, self.least) = (0, f64::INFINITY, [f64::INFINITY; 2]);
        self.write(inputs);
    }

    fn write(&self, inputs: &mut [f64]) {
        self.slots.iter().zip(&self.z).for_each(|(slot, value)| inputs[*slot] = *value);
    }

    /// Compares z with F(z), which the inputs hold with the rest of the solution for z; `true` where they agree. Otherwise the next
    /// guess is written into the inputs. `slopes` gives F_z, column by column, for inputs with F(z).
    pub(super) fn advance(
        &mut self,
        inputs: &mut [f64],
        counters: &mut Counters,
        slopes: impl FnOnce(&mut [f64], &mut [f64]) -> Result<(), AnalysisError>,
    ) -> Result<bool, AnalysisError> {
        let Change { own: change, whole, plain } = self.change(inputs);
        let regular = self.closing.is_regular();
        // A step from far off leaves its own round-off, which is a share of what it was and nothing of what is solved for. Below round-off
        // of all that is solved for nothing is gained: where F vanishes (a contact that slides is about to open) it falls with z without end.
        let falls = whole > f64::EPSILON && plain.iter().zip(&self.least).any(|(now, least)| *now < FALLS * least);
        let same = self.slots.iter().zip(&self.found).all(|(slot, was)| inputs[*slot] == *was);
        // What is no number has not settled.
        let settles = |share: f64| same || (change >= share * self.best && !falls);
        let exact = self.linear && regular && self.iteration > EXACT_STEPS && settles(FALLS);
        // The first guess of all is none that Newton's method has come to.
        let is_newtons = self.iteration > usize::from(!self.started);
        if change <= CLOSE || (whole <= CLOSE_ENOUGH && is_newtons && settles(1.0)) || exact {
            self.started = true;
            return Ok(true);
        }
        self.best = self.best.min(change);
        self.least = std::array::from_fn(|kind| self.least[kind].min(plain[kind]));
        self.iteration += 1;
        if change.is_nan() || self.iteration == MOST_ITERATIONS {
            self.started = false;
            return Err(AnalysisError::NoCommonSolution);
        }
        counters.coupling_iterations += 1;
        self.found.iter_mut().zip(&self.slots).for_each(|(found, slot)| *found = inputs[*slot]);
        let found = self.found.iter().copied();
        // What z changes of F is round-off where nothing of it changes; Newton's method would come near in ever smaller steps.
        if same || !self.started && self.iteration == 1 {
            self.z.iter_mut().zip(found).for_each(|(z, found)| *z = found);
        } else {
            self.step.iter_mut().zip(found.zip(&self.z)).for_each(|(step, (found, z))| *step = found - z);
            self.newton(inputs, slopes)?;
        }
        self.write(inputs);
        Ok(false)
    }

    /// One step of Newton's method from `z`, for the difference that `step` holds.
    fn newton(
        &mut self,
        inputs: &mut [f64],
        slopes: impl FnOnce(&mut [f64], &mut [f64]) -> Result<(), AnalysisError>,
    ) -> Result<(), AnalysisError> {
        slopes(inputs, self.closing.slopes_mut())?;
        if self.closing.factor(units(&self.slots, &self.solved, inputs))? {
            self.closing.solve(&mut self.step)?;
        }
        self.z.iter_mut().zip(&self.step).for_each(|(z, step)| *z += step);
        Ok(())
    }

    /// Largest difference of F(z) from z; `inputs` hold the solution.
    fn change(&self, inputs: &[f64]) -> Change {
        let mut most = self.solved.each_ref().map(|slots| largest(&inputs[slots.clone()]));
        most[0] = most[0].max(CANCELLED * self.unbalanced);
        let mut change = Change { own: 0.0, whole: 0.0, plain: [0.0; 2] };
        for (k, (slot, z)) in self.slots.iter().zip(&self.z).enumerate() {
            let difference = (inputs[*slot] - z).abs();
            if difference == 0.0 {
                continue;
            }
            let kind = usize::from(*slot >= self.solved[1].start);
            let own = difference / largest(&inputs[self.peers[k].clone()]);
            let whole = difference / most[kind];
            if own.is_nan() {
                return Change { own, whole, ..change };
            }
            change.plain[kind] = change.plain[kind].max(difference);
            change = Change { own: change.own.max(own), whole: change.whole.max(whole), ..change };
        }
        change
    }
}

/// [`Coupling`] in coordinates of bodies.
pub(super) struct BodyCoupling {
    coupling: Coupling,
    loads: usize,
    program: Program,
    workspace: Workspace,
    /// Loads; state rates; power; then the loads' derivatives, input by input.
    outputs: Vec<f64>,
    rates: usize,
    side_accelerations: Vec<f64>,
    side_multipliers: Vec<f64>,
    /// Whether state rates and power may use more of the solution than the loads.
    more_in_rates: bool,
    /// Mass or moment of inertia that each load acts on by itself.
    masses: Vec<f64>,
    /// What the loads are made of, as [`sizes_of_terms`] writes it and, once it was asked for, as a program.
    terms: (Graph, Vec<Node>),
    made_of: Option<Evaluator>,
}

impl BodyCoupling {
    /// What must be solved together, with the masses of [`mass_values`](super::mass_values); `None` when the loads, state rates and power depend on nothing that is solved for.
    pub(super) fn new(equations: &Equations, masses: &[f64], layout: &Layout) -> Option<Self> {
        if !equations.needs_solution() {
            return None;
        }
        let mut nodes: Vec<Node> = equations.loads.clone();
        nodes.extend(&equations.state_rates);
        nodes.push(equations.power);
        nodes.extend(equations.coupling.iter().flat_map(|input| input.slopes.iter().copied()));
        let program = Program::compile(&equations.graph, &nodes);
        let slots: Vec<usize> = equations.coupling.iter().map(|input| input.slot).collect();
        Some(Self {
            more_in_rates: slots.len() < program.input_count(layout.acceleration_slot()..usize::MAX),
            coupling: Coupling::new(slots, equations.is_coupling_linear(layout), layout, 0.0),
            loads: equations.loads.len(),
            workspace: program.workspace(),
            outputs: vec![0.0; nodes.len()],
            program,
            rates: equations.state_rates.len() + 1,
            side_accelerations: vec![0.0; layout.velocities()],
            side_multipliers: vec![0.0; layout.rows],
            masses: masses.chunks_exact(9).flat_map(|m| [m[0], m[1], m[2], m[3], m[6], m[8]]).collect(),
            terms: sizes_of_terms(equations),
            made_of: None,
        })
    }

    /// How many accelerations and multipliers are solved for together with the loads.
    pub(super) fn size(&self) -> usize {
        self.coupling.slots.len()
    }

    /// Starts from nothing next time.
    pub(super) fn forget(&mut self) {
        self.coupling.forget();
    }

    /// As [`Coupling::guess`].
    pub(super) fn guess(&self) -> Guess {
        self.coupling.guess()
    }

    /// As [`Coupling::start_from`].
    pub(super) fn start_from(&mut self, guess: &Guess) {
        self.coupling.start_from(guess);
    }

    /// The program, with how often it was run.
    pub(super) fn used(&mut self) -> Used<'_> {
        Used::new(&mut self.program, self.workspace.runs(), false)
    }

    /// Rates of the element states, then the power, as of the last solution.
    pub(super) fn rates(&self) -> &[f64] {
        &self.outputs[self.loads..self.loads + self.rates]
    }

    /// Finds accelerations and multipliers that agree with the forces they cause. The inputs' slots of accelerations and
    /// multipliers hold them afterwards.
    pub(super) fn solve(
        &mut self,
        inputs: &mut [f64],
        sets: &[Box<dyn ElementSet>],
        engine: &mut dyn Solve,
        accelerations: &mut [f64],
        multipliers: &mut [f64],
        counters: &mut Counters,
    ) -> Result<(), AnalysisError> {
        self.coupling.begin(inputs);
        loop {
            self.run(inputs, sets)?;
            let alone = self.outputs[..self.loads].iter().zip(&self.masses).map(|(load, mass)| load.abs() / mass);
            self.coupling.unbalanced = alone.filter(|a| a.is_finite()).fold(0.0, f64::max);
            engine.solve(&self.outputs[..self.loads], true, accelerations, multipliers)?;
            self.publish(inputs, engine.rows(), accelerations, multipliers);
            let Self { coupling, outputs, loads, rates, side_accelerations, side_multipliers, .. } = self;
            let (slots, solved) = (coupling.slots.clone(), coupling.solved.clone());
            let slopes = |_: &mut [f64], matrix: &mut [f64]| {
                let lambda = &mut side_multipliers[..engine.rows().len()];
                let of_loads = outputs[*loads + *rates..].chunks_exact(*loads);
                for (slopes, column) in of_loads.zip(matrix.chunks_exact_mut(slots.len())) {
                    engine.solve(slopes, false, side_accelerations, lambda)?;
                    for (slot, entry) in slots.iter().zip(column) {
                        *entry = solved_at(*slot, &solved, (engine.rows(), side_accelerations, lambda));
                    }
                }
                Ok(())
            };
            if coupling.advance(inputs, counters, slopes)? {
                break;
            }
        }
        if self.more_in_rates {
            self.run(inputs, sets)?;
        }
        Ok(())
    }

    /// The loads with the solution that the inputs hold.
    pub(super) fn loads(&mut self, inputs: &[f64], sets: &[Box<dyn ElementSet>]) -> Result<&[f64], AnalysisError> {
        self.run(inputs, sets)?;
        Ok(&self.outputs[..self.loads])
    }

    /// The sum of the magnitudes of the terms of each load with the solution that the inputs hold: those with accelerations cancel where an
    /// element brings inertia, those with positions where it is stiff.
    pub(super) fn made_of(&mut self, inputs: &[f64], sets: &[Box<dyn ElementSet>]) -> Result<&[f64], AnalysisError> {
        let (graph, nodes) = &self.terms;
        self.made_of.get_or_insert_with(|| Evaluator::new(graph, nodes)).run(inputs, sets)
    }

    fn run(&mut self, inputs: &[f64], sets: &[Box<dyn ElementSet>]) -> Result<(), AnalysisError> {
        self.program
            .run(inputs, sets, &mut self.workspace, &mut self.outputs)
            .map_err(|(set, fault)| AnalysisError::Element { set, fault })
    }

    fn publish(&self, inputs: &mut [f64], rows: &[usize], accelerations: &[f64], multipliers: &[f64]) {
        let [first, slots] = self.coupling.solved.clone();
        inputs[first].copy_from_slice(accelerations);
        inputs[slots.clone()].fill(0.0);
        for (row, value) in rows.iter().zip(multipliers) {
            inputs[slots.start + row] = *value;
        }
    }
}

#[cfg(test)]
mod tests;
