//! Evaluation of a recorded element with plain numbers: its recording, operation by operation.
//!
//! Runs do not need it, they make programs of recordings; a test kit does. Derivatives are exact: jets along motions.

use element_api::Jet;
use element_api::descriptor::Kind;
use element_api::recording::{Input, Recording, Role};
use element_api::scalar::Scalar;
use element_api::set::{Layout, Wanted};
use nalgebra::{Matrix3, Vector3};

/// An instance with what is needed to evaluate it.
pub struct Recorded<'a> {
    pub recording: &'a Recording,
    pub kind: Kind,
    pub layout: Layout,
    /// The rows that it has.
    pub rows: &'a [usize],
}

impl Recorded<'_> {
    /// Results as [`Layout`] says; `results` are NaN before.
    pub fn evaluate(&self, inputs: &[f64], wanted: Wanted, results: &mut [f64]) {
        let plain = self.run(|input| inputs[self.place(input)]);
        if self.kind != Kind::Joint {
            for (role, value) in plain {
                if let Some(slot) = self.slot(role) {
                    results[slot] = value;
                }
            }
            return;
        }
        let (n, frames) = (self.layout.values, self.layout.frames);
        let put = |results: &mut [f64], values: Vec<(Role, f64)>, place: &dyn Fn(usize) -> usize| {
            for (role, value) in values {
                if let Some(slot) = self.slot(role).filter(|slot| *slot < n) {
                    results[place(slot)] = value;
                }
            }
        };
        for (role, value) in &plain {
            if let Role::Angle(k) = role {
                results[n * (3 + 6 * frames) + *k as usize] = *value;
            }
        }
        put(results, plain, &|row| row);
        let along = |rates: &[[Vector3<f64>; 2]], time: f64, part: fn(Jet) -> f64| {
            let values = self.run(|input| self.moved(input, inputs, rates, time));
            values.into_iter().map(|(role, jet)| (role, part(jet))).collect::<Vec<_>>()
        };
        if wanted.jacobian {
            for direction in 0..6 * frames {
                let mut rates = vec![[Vector3::zeros(); 2]; frames];
                rates[direction / 6][direction % 6 / 3] = Vector3::ith(direction % 3, 1.0);
                put(results, along(&rates, 0.0, |jet| jet.first), &|row| n + row * 6 * frames + direction);
            }
            let still = vec![[Vector3::zeros(); 2]; frames];
            put(results, along(&still, 1.0, |jet| jet.first), &|row| n * (1 + 6 * frames) + row);
        }
        if wanted.second {
            let frame = |part: &[f64]| {
                let vector = |at: usize| Vector3::new(part[at], part[at + 1], part[at + 2]);
                [vector(12), Matrix3::from_row_slice(&part[3..12]).tr_mul(&vector(15))]
            };
            let rates: Vec<_> = inputs[self.layout.frames_at()..].chunks_exact(18).map(frame).collect();
            put(results, along(&rates, 1.0, |jet| jet.second), &|row| n * (2 + 6 * frames) + row);
        }
    }

    fn run<S: Scalar>(&self, read: impl Fn(Input) -> S) -> Vec<(Role, S)> {
        self.recording.evaluate(|input| match input {
            // The pose of a mobility is no result here.
            Input::Coordinate(_) => S::zero(),
            input => read(input),
        })
    }

    /// Where an input is among the numbers of [`Layout`].
    fn place(&self, input: Input) -> usize {
        let l = &self.layout;
        let states = 1 + l.angles;
        let memory = states + l.states;
        let signals = memory + l.memory;
        let joint = |joint: u32| signals + l.signals + 6 * joint as usize;
        let frame = |frame: u32, at: u32| l.frames_at() + 18 * frame as usize + at as usize;
        match input {
            Input::Time | Input::Coordinate(_) => 0,
            // Behind the states, the last one first.
            Input::Unknown(k) => memory - 1 - k as usize,
            Input::AngleReference(k) => 1 + k as usize,
            Input::State(k) => states + k as usize,
            Input::Discrete(k) => memory + k as usize,
            Input::Signal(k) => signals + k as usize,
            Input::ReactionForce { joint: k, component } => joint(k) + component as usize,
            Input::ReactionTorque { joint: k, component } => joint(k) + 3 + component as usize,
            Input::Position { frame: k, component } => frame(k, component),
            Input::Rotation { frame: k, row, column } => frame(k, 3 + 3 * row + column),
            Input::Velocity { frame: k, component } => frame(k, 12 + component),
            Input::AngularVelocity { frame: k, component } => frame(k, 15 + component),
        }
    }

    /// An input along a motion of constant velocity and constant rotation rate about the frame's own axes.
    fn moved(&self, input: Input, inputs: &[f64], rates: &[[Vector3<f64>; 2]], time: f64) -> Jet {
        let value = inputs[self.place(input)];
        match input {
            Input::Time => Jet::new(value, time, 0.0),
            Input::Position { frame, component } => Jet::new(value, rates[frame as usize][0][component as usize], 0.0),
            Input::Rotation { frame, row, column } => {
                let at = self.place(Input::Rotation { frame, row: 0, column: 0 });
                let spin = rates[frame as usize][1].cross_matrix();
                let first = Matrix3::from_row_slice(&inputs[at..at + 9]) * spin;
                let entry = (row as usize, column as usize);
                Jet::new(value, first[entry], (first * spin)[entry])
            }
            _ => Jet::from(value),
        }
    }

    /// Where a result of a force or control element is; of a joint, which value it is.
    fn slot(&self, role: Role) -> Option<usize> {
        let l = &self.layout;
        let memory = 6 * l.frames + l.states;
        let channels = memory + l.memory;
        let energies = channels + l.values;
        Some(match role {
            Role::Residual(row) => self.rows.iter().position(|used| *used == row as usize)?,
            Role::Coordinate(k) => self.rows.len() + k as usize,
            Role::Force(k) => k as usize,
            Role::Torque(k) => 3 * l.frames + k as usize,
            Role::StateRate(k) if self.kind != Kind::Joint => 6 * l.frames + k as usize,
            // In the place of the rates of flexible velocities, as elements in Rust give them.
            Role::FlexibleForce(k) => 6 * l.frames + self.recording.flexible() + k as usize,
            Role::Condition(k) if self.kind != Kind::Joint => memory - 1 - k as usize,
            Role::NextDiscrete(k) if self.kind != Kind::Joint => memory + k as usize,
            Role::Channel(k) if self.kind != Kind::Joint => channels + k as usize,
            Role::Potential => energies,
            Role::Dissipation => energies + 1,
            Role::Angle(k) if self.kind != Kind::Joint => energies + 2 + k as usize,
            _ => return None,
        })
    }
}
