//! [`Coordinates`]: what the entries of a state mean, and where they lie.

use std::ops::Range;

use super::layout::Layout;
use crate::model::{Body, Model, NO_ARM};

/// Share of a scene's size below which an arm is none.
const SHORTEST_ARM: f64 = 1e-3;
/// Typical arms beyond which the size of a scene says nothing about its bodies: a row of a thousand loops is long, each is not.
const FARTHEST: f64 = 100.0;

/// What the unit of a coordinate is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// m
    Length,
    /// rad
    Angle,
}

/// A coordinate whose rate is its velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Line {
    /// Place in the state.
    pub position: usize,
    /// Place of its velocity in the state.
    pub velocity: usize,
    /// Number of its velocity among all.
    pub column: usize,
    /// What it is.
    pub measure: Measure,
}

/// A rotation by Euler parameters, with three components of the angular velocity in the axes of what turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rotation {
    /// Place of the four Euler parameters in the state, scalar first.
    pub position: usize,
    /// Place of the angular velocity in the state.
    pub velocity: usize,
    /// Number of the first component among all velocities.
    pub column: usize,
}

/// The coordinates that equations of motion are written in. A state holds positions and velocities in whatever order, then
/// the states of elements, then the work done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Coordinates {
    /// Coordinates whose rate is their velocity.
    pub lines: Vec<Line>,
    /// Rotations in all directions.
    pub rotations: Vec<Rotation>,
    /// Number of velocities.
    pub columns: usize,
    /// Entries of the state before the states of elements.
    pub motion: usize,
    /// Parts of the state and where they lie among the inputs of programs, both ascending.
    pub inputs: Vec<(Range<usize>, usize)>,
    /// Input slot of each velocity, by column.
    pub velocity_slots: Vec<usize>,
    /// First input slot of the accelerations.
    pub acceleration_slot: usize,
    /// Length of the input vector of every program.
    pub input_count: usize,
}

/// The same as [`Coordinates::scales`] for the velocities of bodies: a rotation moves what is farthest from the centre of mass of
/// all that a body's elements hold. `length`: that of the scene, m.
#[must_use]
pub fn body_scales(model: &Model, length: f64) -> Vec<f64> {
    let mut arms = vec![0.0_f64; model.bodies.len()];
    for marker in model.elements.iter().flat_map(|element| &element.markers) {
        if let Some(body) = marker.body {
            arms[body] = arms[body].max(marker.position.norm());
        }
    }
    let round_off = |body: &Body| NO_ARM * (length + body.position.norm() + body.center_of_mass.norm());
    let mut held: Vec<f64> =
        arms.iter().zip(&model.bodies).filter(|(arm, body)| **arm > round_off(body)).map(|(arm, _)| *arm).collect();
    held.sort_unstable_by(f64::total_cmp);
    let length = held.get(held.len() / 2).map_or(length, |typical| length.min(FARTHEST * typical));
    let scales = |arm: &f64| {
        // Held at its centre only: no rotation moves anything. A rod moves, on an average of squares, by its half length over the
        // root of three.
        let arm = if *arm > SHORTEST_ARM * length { arm / 3.0_f64.sqrt() } else { length };
        [1.0, 1.0, 1.0, 1.0 / arm, 1.0 / arm, 1.0 / arm]
    };
    arms.iter().flat_map(scales).collect()
}

impl Coordinates {
    /// What the unit of each velocity is, by column, times a second.
    #[must_use]
    pub fn measures(&self) -> Vec<Measure> {
        let mut measures = vec![Measure::Angle; self.columns];
        self.lines.iter().for_each(|line| measures[line.column] = line.measure);
        measures
    }

    /// Position and Euler parameters of every body.
    #[must_use]
    pub fn of_bodies(layout: &Layout) -> Self {
        let mut coordinates = Self {
            columns: layout.velocities(),
            motion: 13 * layout.bodies,
            acceleration_slot: layout.acceleration_slot(),
            input_count: layout.inputs(),
            lines: Vec::new(),
            rotations: Vec::new(),
            inputs: Vec::new(),
            velocity_slots: Vec::new(),
        };
        for body in 0..layout.bodies {
            let (at, column) = (13 * body, 6 * body);
            let line =
                |k| Line { position: at + k, velocity: at + 7 + k, column: column + k, measure: Measure::Length };
            coordinates.lines.extend((0..3).map(line));
            coordinates.rotations.push(Rotation { position: at + 3, velocity: at + 10, column: column + 3 });
            coordinates.inputs.push((at..at + 13, layout.body_slot(body, 0)));
            coordinates.velocity_slots.extend((0..6).map(|k| layout.body_slot(body, 7 + k)));
        }
        coordinates
    }

    /// Coordinates of joints: for each joint the measures of its coordinates, and whether a rotation follows. Their inputs
    /// follow those of the layout: positions, velocities, accelerations.
    #[must_use]
    pub fn of_joints(joints: &[(Vec<Measure>, bool)], layout: &Layout) -> Self {
        let numbers =
            |f: fn(usize, bool) -> usize| joints.iter().map(|(m, rotates)| f(m.len(), *rotates)).sum::<usize>();
        let positions = numbers(|lines, rotates| lines + 4 * usize::from(rotates));
        let columns = numbers(|lines, rotates| lines + 3 * usize::from(rotates));
        let first = layout.inputs();
        let motion = positions + columns;
        let mut coordinates = Self {
            columns,
            motion,
            acceleration_slot: first + motion,
            input_count: first + motion + columns,
            lines: Vec::new(),
            rotations: Vec::new(),
            inputs: vec![(0..motion, first)],
            velocity_slots: (0..columns).map(|column| first + positions + column).collect(),
        };
        let (mut position, mut column) = (0, 0);
        for (measures, rotates) in joints {
            for measure in measures {
                let velocity = positions + column;
                coordinates.lines.push(Line { position, velocity, column, measure: *measure });
                position += 1;
                column += 1;
            }
            if *rotates {
                coordinates.rotations.push(Rotation { position, velocity: positions + column, column });
                position += 4;
                column += 3;
            }
        }
        coordinates
    }

    /// Directions in which the rates can change, time left out: positions, velocities, element states.
    #[must_use]
    pub fn directions(&self, layout: &Layout) -> usize {
        2 * self.columns + layout.states
    }

    /// The entry of the state that an input slot is a copy of, if it is one.
    #[must_use]
    pub fn entry_of(&self, slot: usize, layout: &Layout) -> Option<usize> {
        let states = layout.state_slot();
        if (states..states + layout.states).contains(&slot) {
            return Some(self.motion + slot - states);
        }
        let before = self.inputs.partition_point(|(_, first)| *first <= slot);
        let (range, first) = self.inputs[..before].last()?;
        Some(range.start + slot - first).filter(|entry| range.contains(entry))
    }

    /// By velocity: the reciprocal of the speed, m/s, that a unit of it gives things in a scene of a size, m. Slopes of joint
    /// equations multiplied by these compare with each other, whatever the units and masses.
    #[must_use]
    pub fn scales(&self, length: f64) -> Vec<f64> {
        let scale = |measure| if measure == Measure::Length { 1.0 } else { 1.0 / length };
        self.measures().into_iter().map(scale).collect()
    }

    /// The input slot of an entry of the state.
    ///
    /// # Panics
    /// For a state of an element.
    #[must_use]
    pub fn slot_of(&self, entry: usize) -> usize {
        let before = self.inputs.partition_point(|(range, _)| range.start <= entry);
        let part = self.inputs[..before].last().filter(|(range, _)| range.contains(&entry));
        part.map(|(range, slot)| slot + entry - range.start).expect("an entry of the motion")
    }
}
