//! [`Coupling`]: accelerations, reactions and the forces that depend on them, solved together.
//!
//! With z the accelerations and multipliers that the loads Q depend on, and P the choice of them among all,
//!
//! z = P S(Q(z), gamma),  S the solution of [M Phi_q^T; Phi_q 0],
//!
//! is solved by Newton's method with the exact derivatives Q_z: (I - P S(Q_z, 0)) dz = P S(Q(z), gamma) - z. The reference
//! engine iterates z <- P S(Q(z), gamma) instead: the twin.

use std::ops::Range;

use element_api::ElementSet;

use super::formulation::{AnalysisError, Counters};
use crate::linalg::FullPivLu;
use crate::plan::Layout;
use crate::program::{Equations, Node, Program, Used, Workspace};

/// Iterations before a scene counts as having no solution.
pub(super) const MOST_ITERATIONS: usize = 60;
/// Change of z at which it counts as found, as a share of what the same body's accelerations or the same joint's multipliers
/// are at most: a light body's reactions count beside a heavy one's.
pub(super) const CLOSE: f64 = 1e-13;
/// The same as a share of the largest of all, accepted where round-off prevents a smaller change.
pub(super) const CLOSE_ENOUGH: f64 = 1e-10;

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
}

/// See the module documentation.
pub(super) struct Coupling {
    slots: Vec<usize>,
    /// The slots of the body's accelerations or the joint's multipliers that each of `slots` belongs to.
    peers: Vec<Range<usize>>,
    acceleration_slot: usize,
    multiplier_slot: usize,
    loads: usize,
    program: Program,
    workspace: Workspace,
    /// Loads; state rates; power; then the loads' derivatives, input by input.
    outputs: Vec<f64>,
    rates: usize,
    z: Vec<f64>,
    found: Vec<f64>,
    step: Vec<f64>,
    matrix: FullPivLu,
    side_accelerations: Vec<f64>,
    side_multipliers: Vec<f64>,
    /// Whether `z` holds a solution to start from.
    started: bool,
}

impl Coupling {
    /// What must be solved together; `None` when the loads, state rates and power depend on nothing that is solved for.
    pub(super) fn new(equations: &Equations, layout: &Layout) -> Option<Self> {
        if equations.coupling.is_empty() && !equations.rates_need_solution(layout) {
            return None;
        }
        let mut nodes: Vec<Node> = equations.loads.clone();
        nodes.extend(&equations.state_rates);
        nodes.push(equations.power);
        nodes.extend(equations.coupling.iter().flat_map(|input| input.slopes.iter().copied()));
        let program = Program::compile(&equations.graph, &nodes);
        let n = equations.coupling.len();
        let peers = equations.coupling.iter().map(|input| layout.solved_peers(input.slot));
        Some(Self {
            peers: peers.collect(),
            slots: equations.coupling.iter().map(|input| input.slot).collect(),
            acceleration_slot: layout.acceleration_slot(),
            multiplier_slot: layout.multiplier_slot(),
            loads: equations.loads.len(),
            workspace: program.workspace(),
            outputs: vec![0.0; nodes.len()],
            program,
            rates: equations.state_rates.len() + 1,
            z: vec![0.0; n],
            found: vec![0.0; n],
            step: vec![0.0; n],
            matrix: FullPivLu::new(n, 1e-14),
            side_accelerations: vec![0.0; layout.velocities()],
            side_multipliers: vec![0.0; layout.rows],
            started: false,
        })
    }

    /// Starts from nothing next time.
    pub(super) fn forget(&mut self) {
        self.started = false;
    }

    /// The program, with how often it was run.
    pub(super) fn used(&mut self) -> Used<'_> {
        Used { runs: self.workspace.runs(), program: &mut self.program, spare: false }
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
        let n = self.slots.len();
        if !self.started {
            self.z.fill(0.0);
        }
        let mut best = f64::INFINITY;
        for iteration in 0..MOST_ITERATIONS {
            self.slots.iter().zip(&self.z).for_each(|(slot, value)| inputs[*slot] = *value);
            self.run(inputs, sets)?;
            engine.solve(&self.outputs[..self.loads], true, accelerations, multipliers)?;
            for (k, slot) in self.slots.iter().enumerate() {
                self.found[k] = self.pick(*slot, engine.rows(), accelerations, multipliers);
            }
            self.publish(inputs, engine.rows(), accelerations, multipliers);
            let Change { own: change, whole } = self.change(inputs);
            if change.is_nan() {
                break;
            }
            if change <= CLOSE || (whole <= CLOSE_ENOUGH && change >= best) {
                self.started = true;
                if n < self.solved_inputs_in_rates() {
                    // State rates and power may use more of the solution than the loads.
                    self.run(inputs, sets)?;
                }
                return Ok(());
            }
            best = best.min(change);
            counters.coupling_iterations += 1;
            if !self.started && iteration == 0 {
                self.z.copy_from_slice(&self.found);
                continue;
            }
            self.newton(engine)?;
        }
        self.started = false;
        Err(AnalysisError::NoCommonSolution)
    }

    /// One step of Newton's method from `z`.
    fn newton(&mut self, engine: &mut dyn Solve) -> Result<(), AnalysisError> {
        let n = self.slots.len();
        let slopes_at = self.loads + self.rates;
        for k in 0..n {
            let slopes = &self.outputs[slopes_at + k * self.loads..slopes_at + (k + 1) * self.loads];
            let multipliers = &mut self.side_multipliers[..engine.rows().len()];
            engine.solve(slopes, false, &mut self.side_accelerations, multipliers)?;
            for i in 0..n {
                let multipliers = &self.side_multipliers[..engine.rows().len()];
                let response = self.pick(self.slots[i], engine.rows(), &self.side_accelerations, multipliers);
                self.matrix.entries_mut()[i + n * k] = f64::from(u8::from(i == k)) - response;
            }
        }
        for k in 0..n {
            self.found[k] -= self.z[k];
        }
        let finite = self.matrix.entries_mut().iter().all(|x| x.is_finite());
        if finite {
            self.matrix.factor()?;
            self.matrix.solve(&self.found, &mut self.step)?;
        } else {
            self.step.copy_from_slice(&self.found);
        }
        self.z.iter_mut().zip(&self.step).for_each(|(z, step)| *z += step);
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

    fn pick(&self, slot: usize, rows: &[usize], accelerations: &[f64], multipliers: &[f64]) -> f64 {
        if slot < self.multiplier_slot {
            return accelerations[slot - self.acceleration_slot];
        }
        // A row that is not in use has the multiplier zero.
        rows.binary_search(&(slot - self.multiplier_slot)).map_or(0.0, |k| multipliers[k])
    }

    /// Largest difference of `found` from `z`; `inputs` hold the solution.
    fn change(&self, inputs: &[f64]) -> Change {
        let most = [self.acceleration_slot..self.multiplier_slot, self.multiplier_slot..inputs.len()]
            .map(|slots| largest(&inputs[slots]));
        let mut change = Change { own: 0.0, whole: 0.0 };
        for (k, (found, z)) in self.found.iter().zip(&self.z).enumerate().filter(|(_, (found, z))| found != z) {
            let difference = (found - z).abs();
            let own = difference / largest(&inputs[self.peers[k].clone()]);
            let whole = difference / most[usize::from(self.slots[k] >= self.multiplier_slot)];
            if own.is_nan() {
                return Change { own, whole };
            }
            change = Change { own: change.own.max(own), whole: change.whole.max(whole) };
        }
        change
    }

    fn publish(&self, inputs: &mut [f64], rows: &[usize], accelerations: &[f64], multipliers: &[f64]) {
        inputs[self.acceleration_slot..self.multiplier_slot].copy_from_slice(accelerations);
        inputs[self.multiplier_slot..].fill(0.0);
        for (row, value) in rows.iter().zip(multipliers) {
            inputs[self.multiplier_slot + row] = *value;
        }
    }

    /// Number of solved inputs that the program uses.
    fn solved_inputs_in_rates(&self) -> usize {
        self.program.input_count(self.acceleration_slot..usize::MAX)
    }
}

fn largest(list: &[f64]) -> f64 {
    list.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()))
}
