//! [`PreciseState`]: what the entries of a state of [`super::PreciseMotion`] mean, as numbers and as series.

use odyn_graph::Series;

use super::assembly::Assembly;
use crate::plan::{Coordinates, Layout, Measure};
use crate::precise::DoubleDouble;

const ZERO: DoubleDouble = DoubleDouble::ZERO;

/// Kinds of entries: positions and velocities, where lengths are measured by the size of the scene, angles and Euler parameters by one;
/// then each element state. Rotation gives round-off to translation that is none (a shaft in its bearings), and the other way.
const KINDS: usize = 2;

/// See the module documentation.
#[derive(Clone)]
pub(super) struct PreciseState {
    coordinates: Coordinates,
    layout: Layout,
    /// The inputs of programs, of one order.
    pub(super) inputs: Vec<DoubleDouble>,
    /// What stays as it is during a step: references of angles, discrete states, signals from outside.
    kept: Vec<f64>,
    /// Of each entry of a state.
    pub(super) kinds: Vec<usize>,
    /// What one is of each entry: the size of the scene for lengths and velocities.
    pub(super) units: Vec<f64>,
}

impl PreciseState {
    pub(super) fn new(coordinates: &Coordinates, layout: &Layout, length: f64) -> Self {
        let (mut kinds, mut units) = (vec![0; coordinates.motion], vec![1.0; coordinates.motion + layout.states]);
        for line in &coordinates.lines {
            kinds[line.velocity] = 1;
            if line.measure == Measure::Length {
                (units[line.position], units[line.velocity]) = (length, length);
            }
        }
        for rotation in &coordinates.rotations {
            kinds[rotation.velocity..rotation.velocity + 3].fill(1);
        }
        kinds.extend(KINDS..KINDS + layout.states);
        Self {
            inputs: vec![ZERO; coordinates.input_count],
            kept: Vec::new(),
            kinds,
            units,
            coordinates: coordinates.clone(),
            layout: layout.clone(),
        }
    }

    /// The state at the start: `motion`, then the states of elements.
    pub(super) fn start<'a>(
        &mut self,
        motion: impl Iterator<Item = &'a f64>,
        assembly: &'a Assembly,
    ) -> Vec<DoubleDouble> {
        self.kept = [&assembly.references[..], &assembly.discrete].concat();
        let elements = &assembly.working[assembly.working.len() - self.layout.states - 1..][..self.layout.states];
        motion.chain(elements).map(|x| DoubleDouble::from(*x)).collect()
    }

    pub(super) fn rounded(&self, start: &[DoubleDouble]) -> Vec<DoubleDouble> {
        let moved = start.iter().zip(&self.kinds).enumerate().map(|(k, (x, kind))| {
            let least = if *kind == 0 { self.units[k] } else { 0.0 };
            // Up or down, in an order that no mechanism has.
            let sign = if (k * k + k / 2).is_multiple_of(3) { 1.0 } else { -1.0 };
            *x + DoubleDouble::from(sign * 0.5 * f64::EPSILON * x.to_f64().abs().max(least))
        });
        moved.collect()
    }

    pub(super) fn set_reference(&mut self, angle: usize, value: f64) {
        self.kept[angle] = value;
    }

    /// Time and state into the inputs.
    pub(super) fn load(&mut self, t: DoubleDouble, state: &[DoubleDouble]) {
        self.write(t, state);
        let slots = self.layout.reference_slot()..self.layout.acceleration_slot();
        self.inputs[slots].iter_mut().zip(&self.kept).for_each(|(input, x)| *input = DoubleDouble::from(*x));
    }

    /// Their coefficients of an order.
    pub(super) fn load_order(&mut self, t: DoubleDouble, coefficients: &[Vec<DoubleDouble>], k: usize) {
        if k == 0 {
            return self.load(t, &coefficients[0]);
        }
        self.write(if k == 1 { DoubleDouble::ONE } else { ZERO }, &coefficients[k]);
        self.inputs[self.layout.reference_slot()..self.layout.acceleration_slot()].fill(ZERO);
    }

    fn write(&mut self, t: DoubleDouble, state: &[DoubleDouble]) {
        self.inputs[Layout::TIME] = t;
        for (range, slot) in &self.coordinates.inputs {
            self.inputs[*slot..slot + range.len()].copy_from_slice(&state[range.clone()]);
        }
        let (slot, from) = (self.layout.state_slot(), self.coordinates.motion);
        self.inputs[slot..slot + self.layout.states].copy_from_slice(&state[from..]);
    }

    /// Accelerations and multipliers of rows into the inputs.
    pub(super) fn publish(&mut self, solution: &[DoubleDouble], rows: &[usize]) {
        let (accelerations, rest) = solution.split_at(self.coordinates.columns);
        let slot = self.coordinates.acceleration_slot;
        self.inputs[slot..slot + accelerations.len()].copy_from_slice(accelerations);
        for (row, multiplier) in rows.iter().zip(rest) {
            self.inputs[self.layout.multiplier_slot() + row] = *multiplier;
        }
    }

    /// The coefficients of order k + 1 from those of order k and of the rates: accelerations, then element states.
    pub(super) fn grow(&self, coefficients: &mut [Vec<DoubleDouble>], k: usize, rates: &Series) {
        let (known, next) = coefficients.split_at_mut(k + 1);
        let (next, order) = (&mut next[0], DoubleDouble::from((k + 1) as f64));
        let coordinates = &self.coordinates;
        for line in &coordinates.lines {
            next[line.position] = known[k][line.velocity] / order;
            next[line.velocity] = rates.output(line.column, k) / order;
        }
        for rotation in &coordinates.rotations {
            let turn = turn_rates(known, rotation.position, rotation.velocity);
            for (entry, rate) in turn.into_iter().enumerate() {
                next[rotation.position + entry] = rate / order;
            }
            for axis in 0..3 {
                next[rotation.velocity + axis] = rates.output(rotation.column + axis, k) / order;
            }
        }
        for state in 0..self.layout.states {
            next[coordinates.motion + state] = rates.output(coordinates.columns + state, k) / order;
        }
    }

    /// Brings Euler parameters to length 1.
    pub(super) fn normalise(&self, state: &mut [DoubleDouble]) {
        for rotation in &self.coordinates.rotations {
            let p = &mut state[rotation.position..rotation.position + 4];
            let length = p.iter().fold(ZERO, |sum, e| sum + *e * *e).sqrt();
            p.iter_mut().for_each(|e| *e = *e / length);
        }
    }

    /// Moves positions; gives the size of the move, m.
    pub(super) fn move_along(&self, moves: &[DoubleDouble], state: &mut [DoubleDouble], length: f64) -> f64 {
        let mut size = 0.0_f64;
        let mut count = |step: DoubleDouble, scale: f64| {
            let step = step.to_f64().abs() * scale;
            // A step that is not a number must not be passed over.
            if step > size || step.is_nan() {
                size = step;
            }
        };
        for line in &self.coordinates.lines {
            state[line.position] += moves[line.column];
            count(moves[line.column], if line.measure == Measure::Length { 1.0 } else { length });
        }
        for rotation in &self.coordinates.rotations {
            let step = &moves[rotation.column..rotation.column + 3];
            step.iter().for_each(|step| count(*step, length));
            let p = state[rotation.position..rotation.position + 4].to_vec();
            let both = [[p, step.to_vec()].concat()];
            for (entry, rate) in turn_rates(&both, 0, 4).into_iter().enumerate() {
                state[rotation.position + entry] += rate;
            }
        }
        self.normalise(state);
        size
    }

    pub(super) fn change_velocities(&self, changes: &[DoubleDouble], state: &mut [DoubleDouble]) {
        for line in &self.coordinates.lines {
            state[line.velocity] += changes[line.column];
        }
        for rotation in &self.coordinates.rotations {
            (0..3).for_each(|axis| state[rotation.velocity + axis] += changes[rotation.column + axis]);
        }
    }
}

/// The last coefficient of G^T omega' / 2 (Haug 1989, eq. 9.3.33), from those of Euler parameters at one place of the state and of
/// angular velocities at another.
fn turn_rates(coefficients: &[Vec<DoubleDouble>], parameters: usize, velocities: usize) -> [DoubleDouble; 4] {
    let k = coefficients.len() - 1;
    let half = DoubleDouble::from(0.5);
    let product = |e: usize, axis: usize| {
        let term = |j: usize| coefficients[j][parameters + e] * coefficients[k - j][velocities + axis];
        half * (0..=k).fold(ZERO, |sum, j| sum + term(j))
    };
    let [x, y, z] = [0, 1, 2];
    [
        -product(1, x) - product(2, y) - product(3, z),
        product(0, x) - product(3, y) + product(2, z),
        product(3, x) + product(0, y) - product(1, z),
        product(1, y) - product(2, x) + product(0, z),
    ]
}
