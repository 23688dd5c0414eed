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

use super::formulation::{AnalysisError, Counters, Guess};
use crate::linalg::FullPivLu;
use crate::plan::Layout;
use crate::program::{Equations, Node, Program, Used, Workspace};

/// Share of the largest pivot of I - F_z up to which a pivot is zero.
pub(super) const CLOSED: f64 = 1e-14;
/// Iterations before a scene counts as having no solution.
pub(super) const MOST_ITERATIONS: usize = 60;
/// Change of z at which it counts as found, as a share of what the same body's accelerations or the same joint's multipliers
/// are at most: a light body's reactions count beside a heavy one's.
pub(super) const CLOSE: f64 = 1e-13;
/// The same as a share of the largest of all, accepted where round-off prevents a smaller change.
pub(super) const CLOSE_ENOUGH: f64 = 1e-10;

/// Accelerations below this share of those that loads would cause one by one are taken as if they were as large: at rest, where loads
/// and reactions cancel, nothing but round-off is left to be a share of.
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
    accelerations: Range<usize>,
    multipliers: Range<usize>,
    z: Vec<f64>,
    step: Vec<f64>,
    matrix: FullPivLu,
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
    /// The largest acceleration that a load by itself would cause; zero where that is not known.
    unbalanced: f64,
}

impl Coupling {
    /// For inputs at these slots.
    pub(super) fn new(slots: Vec<usize>, linear: bool, layout: &Layout) -> Self {
        let n = slots.len();
        let [accelerations, multipliers] = layout.solved();
        Self {
            peers: slots.iter().map(|slot| layout.solved_peers(*slot)).collect(),
            slots,
            accelerations,
            multipliers,
            z: vec![0.0; n],
            step: vec![0.0; n],
            matrix: FullPivLu::new(n, CLOSED),
            started: false,
            linear,
            iteration: 0,
            best: f64::INFINITY,
            least: [f64::INFINITY; 2],
            found: vec![f64::NAN; n],
            unbalanced: 0.0,
        }
    }

    /// Steps of difference quotients along each of z, as shares of the whole solution that the inputs hold: where z is but a small part
    /// of that, what a step of its own size changes of F is round-off. Where F is not linear, of the largest of z.
    pub(super) fn steps(&self, inputs: &[f64], share: f64) -> Vec<f64> {
        let of_z = largest(&self.z);
        let [accelerations, multipliers] =
            [&self.accelerations, &self.multipliers].map(|all| largest(&inputs[all.clone()]));
        let size = |slot: &usize| match (self.linear, *slot >= self.multipliers.start) {
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
        let regular = self.matrix.rank() == self.slots.len();
        // A step from far off leaves its own round-off, which is a share of what it was and nothing of what is solved for.
        let falls = plain.iter().zip(&self.least).any(|(now, least)| *now < FALLS * least);
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
        if !self.started && self.iteration == 1 {
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
        let n = self.slots.len();
        let sizes = units(&self.slots, &[self.accelerations.clone(), self.multipliers.clone()], inputs);
        slopes(inputs, self.matrix.entries_mut())?;
        let entries = self.matrix.entries_mut();
        for (column, along) in entries.chunks_exact_mut(n).zip(&sizes) {
            column.iter_mut().zip(&sizes).for_each(|(entry, of)| *entry *= -(along / of));
        }
        entries.iter_mut().step_by(n + 1).for_each(|entry| *entry += 1.0);
        if entries.iter().all(|x| x.is_finite()) {
            let difference: Vec<f64> = self.step.iter().zip(&sizes).map(|(step, size)| step / size).collect();
            self.matrix.factor()?;
            self.matrix.solve(&difference, &mut self.step)?;
            self.step.iter_mut().zip(&sizes).for_each(|(step, size)| *step *= size);
        }
        self.z.iter_mut().zip(&self.step).for_each(|(z, step)| *z += step);
        Ok(())
    }

    /// Largest difference of F(z) from z; `inputs` hold the solution.
    fn change(&self, inputs: &[f64]) -> Change {
        let mut most = [&self.accelerations, &self.multipliers].map(|slots| largest(&inputs[slots.clone()]));
        most[0] = most[0].max(CANCELLED * self.unbalanced);
        let mut change = Change { own: 0.0, whole: 0.0, plain: [0.0; 2] };
        for (k, (slot, z)) in self.slots.iter().zip(&self.z).enumerate() {
            let difference = (inputs[*slot] - z).abs();
            if difference == 0.0 {
                continue;
            }
            let kind = usize::from(*slot >= self.multipliers.start);
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

/// The units of z in which the largest acceleration and the largest multiplier are one, whatever those of the scene are.
pub(super) fn units(slots: &[usize], solved: &[Range<usize>; 2], inputs: &[f64]) -> Vec<f64> {
    let sizes = solved.each_ref().map(|all| largest(&inputs[all.clone()]));
    let sizes = if sizes.iter().all(|size| *size > f64::MIN_POSITIVE) { sizes } else { [1.0; 2] };
    slots.iter().map(|slot| sizes[usize::from(*slot >= solved[1].start)]).collect()
}

fn largest(list: &[f64]) -> f64 {
    list.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()))
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
            coupling: Coupling::new(slots, equations.is_coupling_linear(layout), layout),
            loads: equations.loads.len(),
            workspace: program.workspace(),
            outputs: vec![0.0; nodes.len()],
            program,
            rates: equations.state_rates.len() + 1,
            side_accelerations: vec![0.0; layout.velocities()],
            side_multipliers: vec![0.0; layout.rows],
            masses: masses.chunks_exact(9).flat_map(|m| [m[0], m[1], m[2], m[3], m[6], m[8]]).collect(),
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
            let slots = coupling.slots.clone();
            let (first, rows) = (coupling.accelerations.start, coupling.multipliers.start);
            let slopes = |_: &mut [f64], matrix: &mut [f64]| {
                let lambda = &mut side_multipliers[..engine.rows().len()];
                let of_loads = outputs[*loads + *rates..].chunks_exact(*loads);
                for (slopes, column) in of_loads.zip(matrix.chunks_exact_mut(slots.len())) {
                    engine.solve(slopes, false, side_accelerations, lambda)?;
                    for (slot, entry) in slots.iter().zip(column) {
                        *entry = match slot.checked_sub(rows) {
                            None => side_accelerations[slot - first],
                            // A row that is not in use has the multiplier zero.
                            Some(row) => engine.rows().binary_search(&row).map_or(0.0, |k| lambda[k]),
                        };
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

    fn run(&mut self, inputs: &[f64], sets: &[Box<dyn ElementSet>]) -> Result<(), AnalysisError> {
        self.program
            .run(inputs, sets, &mut self.workspace, &mut self.outputs)
            .map_err(|(set, fault)| AnalysisError::Element { set, fault })
    }

    fn publish(&self, inputs: &mut [f64], rows: &[usize], accelerations: &[f64], multipliers: &[f64]) {
        inputs[self.coupling.accelerations.clone()].copy_from_slice(accelerations);
        let slots = self.coupling.multipliers.clone();
        inputs[slots.clone()].fill(0.0);
        for (row, value) in rows.iter().zip(multipliers) {
            inputs[slots.start + row] = *value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second of two multipliers, of which these count.
    fn of_one(z: f64, multipliers: Range<usize>) -> Coupling {
        let mut coupling = Coupling {
            slots: vec![1],
            peers: std::iter::once(1..2).collect(),
            accelerations: 2..3,
            multipliers,
            z: vec![0.0],
            step: vec![0.0],
            matrix: FullPivLu::new(1, 1e-14),
            started: false,
            linear: true,
            iteration: 0,
            best: f64::INFINITY,
            least: [f64::INFINITY; 2],
            found: vec![f64::NAN],
            unbalanced: 0.0,
        };
        coupling.start_from(&Some(vec![z]));
        coupling
    }

    /// Iterations until z agrees with F(z), whose derivative `slope` gives for the inputs and the size of the steps along z.
    fn iterations(coupling: &mut Coupling, solution: impl Fn(f64) -> f64, slope: impl Fn(f64, f64) -> f64) -> usize {
        let mut inputs = [1.0, 0.0, 1.0];
        coupling.begin(&mut inputs);
        loop {
            let z = inputs[1];
            inputs[1] = solution(z);
            let step = coupling.steps(&inputs, 1e-7)[0];
            let slopes = |_: &mut [f64], matrix: &mut [f64]| {
                matrix[0] = slope(z, step);
                Ok(())
            };
            let agrees = coupling.advance(&mut inputs, &mut Counters::default(), slopes);
            if agrees.expect("a solution") {
                return coupling.iteration;
            }
        }
    }

    /// Where F is nothing to round-off, z is not compared with it without end.
    #[test]
    fn a_solution_that_is_nothing_is_found() {
        let mut coupling = of_one(1e-3, 1..2);
        // F(z) = 0.06 z, as the difference of what is larger.
        let count = iterations(&mut coupling, |z| (1.0 + 0.06 * z) - 1.0, |_, _| 0.06);
        assert!(coupling.z[0].abs() < 1e-15 && count < 10, "{:e}, {count}", coupling.z[0]);
    }

    /// What is added to something larger does not follow steps of a solution that is nothing, and the rest by itself follows them too far.
    #[test]
    fn a_solution_that_is_nothing_is_found_where_only_a_part_follows_it() {
        let mut coupling = of_one(1.001e-17, 1..2);
        let solution = |z: f64| (1.0 + 0.74 * z) - 1.0 + (1.58e-17 - 0.58 * z);
        let count = iterations(&mut coupling, solution, |_, _| 0.74 - 0.58);
        assert!((coupling.z[0] - 1e-17).abs() < 1e-19 && count < 10, "{:e}, {count}", coupling.z[0]);
    }

    /// What is but a small part of the solution is not differentiated along steps of its own size.
    #[test]
    fn difference_quotients_are_not_round_off_where_a_solution_is_small() {
        let solution = |z: f64| (1.0 + 1e-9 - 3.0 * z) - 1.0;
        let mut coupling = of_one(1e-9, 0..2);
        let count = iterations(&mut coupling, solution, |z, step| (solution(z + step) - solution(z)) / step);
        assert!((coupling.z[0] - 2.5e-10).abs() < 1e-15 && count < 6, "{:e}, {count}", coupling.z[0]);
    }

    /// Where the rest of a solution is far off with the first guess, that guess is no small part of the whole.
    #[test]
    fn a_first_guess_is_not_taken_for_a_solution() {
        let exact = 35.0 / 3.0;
        let mut coupling = of_one(0.0, 0..2);
        coupling.forget();
        let mut inputs = [0.0; 3];
        coupling.begin(&mut inputs);
        for _ in 0..MOST_ITERATIONS {
            inputs = [3e11 * (inputs[1] - exact), 17.5 - 0.5 * inputs[1], 1.0];
            let slopes = |_: &mut [f64], matrix: &mut [f64]| {
                matrix[0] = -0.5;
                Ok(())
            };
            if coupling.advance(&mut inputs, &mut Counters::default(), slopes).expect("a solution") {
                break;
            }
        }
        assert!((inputs[1] - exact).abs() < 1e-12, "{inputs:?}");
    }

    /// An acceleration and a multiplier that depend on each other are found whatever their units are.
    #[test]
    fn units_do_not_matter() {
        for unit in [1.0, 1e12, 1e-12] {
            // a = 1 + 3 x / u, x = u (2 + a / 2): x = -5 u.
            let mut coupling = of_one(0.0, 2..3);
            (coupling.slots, coupling.peers, coupling.accelerations) = (vec![1, 2], vec![1..2, 2..3], 0..2);
            (coupling.z, coupling.step, coupling.found) = (vec![0.0; 2], vec![0.0; 2], vec![f64::NAN; 2]);
            coupling.matrix = FullPivLu::new(2, 1e-14);
            coupling.forget();
            let mut inputs = [0.0; 3];
            coupling.begin(&mut inputs);
            loop {
                let [_, a, x] = inputs;
                inputs = [1.0, 1.0 + 3.0 * x / unit, unit * (2.0 + a / 2.0)];
                let slopes = |_: &mut [f64], matrix: &mut [f64]| {
                    matrix.copy_from_slice(&[0.0, unit / 2.0, 3.0 / unit, 0.0]);
                    Ok(())
                };
                if coupling.advance(&mut inputs, &mut Counters::default(), slopes).expect("a solution") {
                    break;
                }
            }
            assert!((inputs[2] / unit + 5.0).abs() < 1e-11, "{unit:e}: {inputs:?}");
        }
    }
}
