//! [`Twin`]: the steps of an exported program by the interpreter, operation for operation.

use crate::analysis::Quantities;
use crate::machine::Machine;
use crate::plan::Measure;
use crate::program::{Program, Workspace};
use crate::rosenbrock::{Linear, TangentRuns};
use crate::steps::Control;

/// Why a step failed; the same numbers as in the C program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failed {
    /// A pivot is not positive, or the rows are close to dependent.
    Singular = 1,
    /// A rate is not a finite number.
    NotFinite = 2,
    /// The corrections do not bring the state to the constraints.
    OffConstraints = 3,
    /// Rows that are left out contradict the others.
    Contradiction = 4,
    /// Something turns a body about an axis about which it has no moment of inertia.
    TurnsThinAxis = 5,
    /// An angle that is counted over full turns may have turned by half a turn in a step.
    TurnsTooFar = 6,
    /// A parameter is outside of the range in which what follows it is known.
    OutOfRange = 7,
    /// The tolerance cannot be met by steps of a reasonable size.
    StepTooSmall = 8,
}

/// Share of the scene's length by which a row that is left out may be off.
pub(crate) const CONTRADICTION: f64 = 1e-6;
/// The violation that is to be expected after the last correction, as a share of the scene's length.
pub(crate) const OFF_CONSTRAINTS: f64 = 1e-9;
/// Trials to locate a switch.
pub(crate) const TRIALS: usize = 8;
/// The least share of a step by which a switch is crossed, in numbers of 64 and of 32 bits.
pub(crate) const WIDTH: [f64; 2] = [1e-9, 1e-4];
/// An angle that has moved this far from its reference gets a new one, rad.
pub(crate) const NEW_REFERENCE: f64 = 1.0;
/// The most that a counted angle may turn in a step by its rate at the end, rad: less than half a turn.
pub(crate) const MOST_TURN: f64 = 2.5;

/// A program with room for its numbers.
pub(crate) struct Run {
    program: Program,
    workspace: Workspace,
    pub(crate) found: Vec<f64>,
    pub(crate) solved: bool,
}

impl Run {
    pub(crate) fn new(program: &Program, solved: bool) -> Self {
        let (workspace, found) = (program.workspace(), vec![0.0; program.output_count()]);
        Self { program: program.clone(), workspace, found, solved }
    }

    fn of(quantities: Option<&Quantities>) -> Option<Self> {
        quantities.map(|found| Self::new(&found.program, found.solved))
    }

    pub(crate) fn at(&mut self, inputs: &[f64]) -> &[f64] {
        // No opaque element is exported, so that nothing can fail.
        let _ = self.program.run(inputs, &[], &mut self.workspace, &mut self.found);
        &self.found
    }
}

/// See the module documentation.
pub struct Twin {
    pub(crate) machine: Machine,
    /// s; the second number is what is lost of the sum of steps.
    pub(crate) time: [f64; 2],
    pub(crate) state: Vec<f64>,
    inputs: Vec<f64>,
    outputs: Vec<f64>,
    references: Vec<f64>,
    /// Memories of elements that sample.
    pub(crate) memory: Vec<f64>,
    /// By clock, which multiple of its period is next.
    pub(crate) next_samples: Vec<f64>,
    /// Whether the first step was begun, before which what is due at the start samples again.
    pub(crate) begun: bool,
    /// Steps of variable size.
    pub(crate) control: Control,
    pub(crate) parameters: Vec<f64>,
    /// The inputs of programs.
    pub(crate) given: Vec<f64>,
    motion: Run,
    position: Run,
    velocity: Run,
    quantities: Option<Run>,
    angles: Option<Run>,
    pub(crate) switches: Option<Run>,
    watched: Option<Run>,
    pub(crate) samples: Option<Run>,
    pub(crate) tangents: Option<TangentRuns>,
    pub(crate) linear: Option<Linear>,
    /// Of an explicit method, stage by stage.
    pub(crate) slopes: Vec<Vec<f64>>,
    largest_kinetic: f64,
    /// The functions of switches at the start of a step, and where they were furthest on the other side in it.
    pub(crate) first: Vec<f64>,
    pub(crate) last: Vec<f64>,
    /// Switches that were located.
    pub located: usize,
    /// Steps in which more switches fell than are located.
    pub passed: usize,
}

impl Twin {
    /// A machine at its start.
    #[must_use]
    pub fn new(machine: Machine) -> Self {
        let portable = &machine.portable;
        let mut twin = Self {
            time: [machine.t_start, 0.0],
            state: machine.state.clone(),
            inputs: machine.inputs.iter().map(|port| port.start).collect(),
            outputs: vec![0.0; machine.outputs.len()],
            references: machine.references.iter().map(|(_, start)| *start).collect(),
            memory: machine.sampled.start.clone(),
            next_samples: vec![0.0; machine.sampled.clocks.len()],
            begun: false,
            control: Control::of(&machine),
            given: vec![0.0; machine.input_count()],
            motion: Run::new(&portable.motion, false),
            position: Run::new(&portable.position, false),
            velocity: Run::new(&portable.velocity, false),
            quantities: Run::of(machine.quantities.as_ref()),
            angles: Run::of(machine.angles.as_ref()),
            switches: Run::of(machine.switches.as_ref()),
            watched: Run::of(machine.watched.as_ref()),
            samples: Run::of(machine.sampled.next.as_ref()),
            tangents: TangentRuns::of(&machine),
            linear: Linear::of(&machine),
            slopes: vec![vec![0.0; machine.dim()]; machine.method.b.len()],
            largest_kinetic: 0.0,
            first: Vec::new(),
            last: Vec::new(),
            located: 0,
            passed: 0,
            parameters: machine.parameters.settable.iter().map(|parameter| parameter.port.start).collect(),
            machine,
        };
        twin.follow_parameters();
        twin.begin_samples();
        twin
    }

    /// What it runs.
    #[must_use]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time[0]
    }

    /// Positions, velocities, states of elements, work; SI.
    #[must_use]
    pub fn state(&self) -> &[f64] {
        &self.state
    }

    /// Places it elsewhere.
    pub fn set(&mut self, time: f64, state: &[f64]) {
        self.time = [time, 0.0];
        self.state.copy_from_slice(state);
    }

    /// Sets an input, in its unit.
    pub fn set_input(&mut self, number: usize, value: f64) {
        self.inputs[number] = value;
    }

    pub(crate) fn load(&mut self, t: f64, y: &[f64]) {
        let (layout, coordinates) = (&self.machine.layout, &self.machine.portable.coordinates);
        let given = &mut self.given;
        given[0] = t;
        for (range, slot) in &coordinates.inputs {
            given[*slot..slot + range.len()].copy_from_slice(&y[range.clone()]);
        }
        let (slot, from) = (layout.state_slot(), coordinates.motion);
        given[slot..slot + layout.states].copy_from_slice(&y[from..from + layout.states]);
        for ((number, _), value) in self.machine.references.iter().zip(&self.references) {
            given[layout.reference_slot() + number] = *value;
        }
        given[layout.discrete_slot()..][..self.memory.len()].copy_from_slice(&self.memory);
        for (number, (port, value)) in self.machine.inputs.iter().zip(&self.inputs).enumerate() {
            given[layout.given_slot(number)] = value * port.factor;
        }
    }

    /// The rates of a state.
    ///
    /// # Errors
    /// [`Failed`].
    pub fn rates(&mut self, t: f64, y: &[f64], rates: &mut [f64]) -> Result<(), Failed> {
        self.load(t, y);
        let coordinates = &self.machine.portable.coordinates;
        let found = self.motion.at(&self.given);
        let pivots = &found[self.machine.pivots_from()..];
        if let Some(pivot) = pivots.iter().find(|pivot| at_most(**pivot, 0.0) || pivot.is_nan()) {
            return Err(if pivot.is_finite() { Failed::Singular } else { Failed::NotFinite });
        }
        for line in &coordinates.lines {
            rates[line.position] = y[line.velocity];
            rates[line.velocity] = found[line.column];
        }
        for rotation in &coordinates.rotations {
            let (p, v) = (rotation.position, rotation.velocity);
            let turn = turned([y[p], y[p + 1], y[p + 2], y[p + 3]], [y[v], y[v + 1], y[v + 2]]);
            rates[p..p + 4].copy_from_slice(&turn);
            rates[v..v + 3].copy_from_slice(&found[rotation.column..rotation.column + 3]);
        }
        let from = coordinates.columns + self.machine.portable.rows.len();
        rates[coordinates.motion..].copy_from_slice(&found[from..self.machine.pivots_from()]);
        if rates.iter().all(|rate| rate.is_finite()) { Ok(()) } else { Err(Failed::NotFinite) }
    }

    /// Brings a state to the constraints.
    ///
    /// # Errors
    /// [`Failed`].
    pub fn project(&mut self, t: f64, y: &mut [f64]) -> Result<(), Failed> {
        self.normalise(y);
        if self.machine.portable.rows.is_empty() {
            return Ok(());
        }
        let mut size = 0.0;
        for _ in 0..self.machine.corrections {
            self.load(t, y);
            self.position.at(&self.given);
            size = self.move_along(y);
        }
        let share = size / self.machine.portable.length;
        if share * share > OFF_CONSTRAINTS || share.is_nan() {
            return Err(Failed::OffConstraints);
        }
        self.load(t, y);
        let found = self.velocity.at(&self.given);
        let Self { machine, .. } = self;
        let (columns, m) = (machine.portable.coordinates.columns, machine.portable.rows.len());
        let (pivots, others) = found[columns..].split_at(columns + m);
        let (magnitudes, free) = others.split_at(others.len() - m);
        for row in 0..m {
            let kept = pivots[columns + row] >= machine.portable.least_kept * magnitudes[row];
            let independent = free[row] >= machine.portable.least_independence * machine.portable.squares[row];
            if !(kept && independent) {
                return Err(Failed::Singular);
            }
        }
        for line in &machine.portable.coordinates.lines {
            y[line.velocity] += found[line.column];
        }
        for rotation in &machine.portable.coordinates.rotations {
            for k in 0..3 {
                y[rotation.velocity + k] += found[rotation.column + k];
            }
        }
        Ok(())
    }

    fn normalise(&self, y: &mut [f64]) {
        for rotation in &self.machine.portable.coordinates.rotations {
            normalise(&mut y[rotation.position..rotation.position + 4]);
        }
    }

    fn move_along(&self, y: &mut [f64]) -> f64 {
        let (portable, found) = (&self.machine.portable, &self.position.found);
        let mut size = 0.0_f64;
        for line in &portable.coordinates.lines {
            let step = found[line.column];
            y[line.position] += step;
            let step = if line.measure == Measure::Length { step.abs() } else { step.abs() * portable.length };
            if !at_most(step, size) {
                size = step;
            }
        }
        for rotation in &portable.coordinates.rotations {
            let d = [0, 1, 2].map(|k| found[rotation.column + k]);
            let p = rotation.position;
            let by = turned([y[p], y[p + 1], y[p + 2], y[p + 3]], d);
            y[p..p + 4].iter_mut().zip(by).for_each(|(e, step)| *e += step);
            normalise(&mut y[p..p + 4]);
            for step in d.map(|step| step.abs() * portable.length) {
                if !at_most(step, size) {
                    size = step;
                }
            }
        }
        size
    }

    /// A step of the method, brought to the constraints.
    pub(crate) fn advance(&mut self, y: &[f64], h: f64, next: &mut [f64]) -> Result<(), Failed> {
        if let Some(implicit) = self.machine.method.implicit {
            return self.advance_implicitly(implicit, y, h, next);
        }
        let mut slopes = std::mem::take(&mut self.slopes);
        let advanced = self.advance_explicitly(y, h, next, &mut slopes);
        self.slopes = slopes;
        advanced
    }

    fn advance_explicitly(
        &mut self,
        y: &[f64],
        h: f64,
        next: &mut [f64],
        slopes: &mut [Vec<f64>],
    ) -> Result<(), Failed> {
        self.last.clone_from(&self.first);
        let (method, t, n) = (self.machine.method, self.time[0], y.len());
        let mut stage = vec![0.0; n];
        for s in 0..method.b.len() {
            for i in 0..n {
                let mut sum = 0.0;
                for (weight, slope) in method.a[s].iter().zip(slopes.iter()) {
                    sum += weight * slope[i];
                }
                stage[i] = y[i] + h * sum;
            }
            self.rates(t + method.c[s] * h, &stage, &mut slopes[s])?;
            self.reach(t + method.c[s] * h, &stage);
        }
        for i in 0..n {
            let mut sum = 0.0;
            for (weight, slope) in method.b.iter().zip(slopes.iter()) {
                sum += weight * slope[i];
            }
            next[i] = y[i] + h * sum;
        }
        self.project(t + h, next)
    }

    /// Takes the functions of a state where they are furthest on the other side.
    pub(crate) fn reach(&mut self, t: f64, y: &[f64]) {
        if self.switches.is_none() {
            return;
        }
        let found = self.switches(t, y);
        for ((first, last), value) in self.first.iter().zip(&mut self.last).zip(found) {
            if if *first < 0.0 { !at_most(value, *last) } else { value < *last } {
                *last = value;
            }
        }
    }

    pub(crate) fn switches(&mut self, t: f64, y: &[f64]) -> Vec<f64> {
        self.solve_for(t, y, self.switches.as_ref().is_some_and(|run| run.solved));
        self.load(t, y);
        self.switches.as_mut().map(|run| run.at(&self.given).to_vec()).unwrap_or_default()
    }

    /// Accelerations and multipliers into the inputs of programs.
    pub(crate) fn solve_for(&mut self, t: f64, y: &[f64], needed: bool) {
        if !needed {
            return;
        }
        self.load(t, y);
        let found = self.motion.at(&self.given).to_vec();
        let (coordinates, layout) = (&self.machine.portable.coordinates, &self.machine.layout);
        let columns = coordinates.columns;
        self.given[coordinates.acceleration_slot..][..columns].copy_from_slice(&found[..columns]);
        for (row, value) in self.machine.portable.rows.iter().zip(&found[columns..]) {
            self.given[layout.multiplier_slot() + row] = *value;
        }
    }

    pub(crate) fn accept(&mut self, h: f64, next: &[f64]) -> Result<(), Failed> {
        let whole = h + self.time[1];
        let sum = self.time[0] + whole;
        self.time = [sum, whole - (sum - self.time[0])];
        self.state.copy_from_slice(next);
        if !at_most(self.follow() * h, MOST_TURN) {
            return Err(Failed::TurnsTooFar);
        }
        self.watch()
    }

    /// Lets the counted angles follow the state; gives the fastest of their rates, rad/s.
    pub(crate) fn follow(&mut self) -> f64 {
        let Some(mut angles) = self.angles.take() else { return 0.0 };
        let state = self.state.clone();
        self.load(self.time[0], &state);
        let (found, rates) = angles.at(&self.given).split_at(self.references.len());
        for (reference, angle) in self.references.iter_mut().zip(found) {
            if (angle - *reference).abs() > NEW_REFERENCE {
                *reference = *angle;
            }
        }
        let mut fastest = 0.0;
        for rate in rates {
            if !at_most(rate.abs(), fastest) {
                fastest = rate.abs();
            }
        }
        self.angles = Some(angles);
        fastest
    }

    fn watch(&mut self) -> Result<(), Failed> {
        let Some(mut watched) = self.watched.take() else { return Ok(()) };
        let state = self.state.clone();
        self.load(self.time[0], &state);
        let found = watched.at(&self.given).to_vec();
        self.watched = Some(watched);
        let portable = &self.machine.portable;
        for ((_, size), value) in portable.others.iter().zip(&found) {
            if !at_most(value.abs(), CONTRADICTION * portable.length * size) {
                return Err(Failed::Contradiction);
            }
        }
        if let [kinetic, rates @ ..] = &found[portable.others.len()..] {
            if *kinetic > self.largest_kinetic {
                self.largest_kinetic = *kinetic;
            }
            for (axis, about) in self.machine.thin.iter().zip(rates) {
                if !at_most(0.5 * axis.moment * about * about, axis.share * self.largest_kinetic) {
                    return Err(Failed::TurnsThinAxis);
                }
            }
        }
        Ok(())
    }

    /// The outputs where it is, in their units.
    pub fn outputs(&mut self) -> &[f64] {
        let state = self.state.clone();
        self.solve_for(self.time[0], &state, self.machine.solves_for_outputs());
        self.load(self.time[0], &state);
        if let Some(run) = &mut self.quantities {
            let found = run.at(&self.given);
            for ((output, value), port) in self.outputs.iter_mut().zip(found).zip(&self.machine.outputs) {
                *output = value / port.factor;
            }
        }
        &self.outputs
    }
}

/// Whether a number is no larger than another; what is not a number never is.
pub(crate) fn at_most(a: f64, b: f64) -> bool {
    a <= b
}

/// Rates of Euler parameters p of what turns with angular velocity w in its own axes (Haug 1989, eq. 9.3.33).
pub(crate) fn turned([e0, e1, e2, e3]: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 4] {
    [
        0.5 * (-e1 * x - e2 * y - e3 * z),
        0.5 * (e0 * x - e3 * y + e2 * z),
        0.5 * (e3 * x + e0 * y - e1 * z),
        0.5 * (-e2 * x + e1 * y + e0 * z),
    ]
}

fn normalise(p: &mut [f64]) {
    let length = p.iter().map(|e| e * e).sum::<f64>().sqrt();
    p.iter_mut().for_each(|e| *e /= length);
}
