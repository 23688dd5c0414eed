//! [`Layout`]: where every number of a model lies in the vectors of the mathematics.

use std::ops::Range;

use crate::model::Model;

/// Input slots per body: r (3), p (4), v (3), omega' (3), and the rates of p (4) for the reference form.
pub const BODY_SLOTS: usize = 17;

/// Counts and offsets. Constant once made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Number of bodies that can move.
    pub bodies: usize,
    /// Number of constraint rows.
    pub rows: usize,
    /// Number of continuous element states, carried values of internal unknowns among them.
    pub states: usize,
    /// Number of multi-turn angle references.
    pub references: usize,
    /// Number of what stays as it is during a step besides: discrete element states and directions of sliding of its rows, then signals
    /// that are given from outside.
    pub discrete: usize,
    /// Number of discrete element states: the first of the signals from outside among them.
    pub given_at: usize,
    /// First row of each element.
    pub row_at: Vec<usize>,
    /// First carried value of each element's internal unknowns among the states, behind its own states.
    pub unknown_at: Vec<usize>,
    /// First continuous state of each element.
    pub state_at: Vec<usize>,
    /// First angle reference of each element.
    pub reference_at: Vec<usize>,
    /// First discrete state of each element.
    pub discrete_at: Vec<usize>,
}

impl Layout {
    /// Counts a model.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let mut layout = Self {
            bodies: model.bodies.len(),
            rows: 0,
            states: 0,
            references: 0,
            discrete: 0,
            given_at: 0,
            row_at: Vec::new(),
            state_at: Vec::new(),
            unknown_at: Vec::new(),
            reference_at: Vec::new(),
            discrete_at: Vec::new(),
        };
        for element in &model.elements {
            layout.row_at.push(layout.rows);
            layout.state_at.push(layout.states);
            layout.reference_at.push(layout.references);
            layout.discrete_at.push(layout.discrete);
            layout.rows += element.rows.len();
            layout.states += element.recording.initial_states.len();
            layout.unknown_at.push(layout.states);
            layout.states += element.recording.unknowns();
            layout.references += element.class.angles;
            layout.discrete += element.recording.initial_discrete.len() + element.recording.sliding_numbers();
            layout.discrete += usize::from(element.may_end());
        }
        layout.given_at = layout.discrete;
        layout.discrete += model.inputs.len();
        layout
    }

    /// Velocities: six per body.
    #[must_use]
    pub fn velocities(&self) -> usize {
        6 * self.bodies
    }

    /// Those among the inputs of programs.
    #[must_use]
    pub fn velocities_in(&self, inputs: &[f64]) -> Vec<f64> {
        (0..self.bodies).flat_map(|body| inputs[self.body_slot(body, 7)..][..6].iter().copied()).collect()
    }

    /// The rows of an element.
    #[must_use]
    pub fn rows_of(&self, element: usize) -> Range<usize> {
        range(&self.row_at, element, self.rows)
    }

    /// The continuous states of an element.
    #[must_use]
    pub fn states_of(&self, element: usize) -> Range<usize> {
        range(&self.state_at, element, self.states)
    }

    /// The element that a continuous state belongs to.
    #[must_use]
    pub fn element_of_state(&self, state: usize) -> usize {
        self.state_at.partition_point(|first| *first <= state) - 1
    }

    /// The angle references of an element.
    #[must_use]
    pub fn references_of(&self, element: usize) -> Range<usize> {
        range(&self.reference_at, element, self.references)
    }

    /// The discrete states of an element.
    #[must_use]
    pub fn discrete_of(&self, element: usize) -> Range<usize> {
        range(&self.discrete_at, element, self.given_at)
    }

    /// The element of a row, and which of its rows it is.
    #[must_use]
    pub fn element_of_row(&self, row: usize) -> (usize, usize) {
        let element = self.row_at.partition_point(|first| *first <= row) - 1;
        // Elements without rows share their offset with the next one; the last of them is the owner.
        (element, row - self.row_at[element])
    }

    /// Where it is among the discrete states whether a force element still acts: the last of its own; `None` where it always does.
    #[must_use]
    pub fn acts_at(&self, element: usize, model: &Model) -> Option<usize> {
        model.elements[element].may_end().then(|| self.discrete_of(element).end - 1)
    }

    /// Slot of the time among the inputs of every program.
    pub const TIME: usize = 0;

    /// Slot of component `k` of a body's r, p, v, omega' and p-rates (in this order).
    #[must_use]
    pub fn body_slot(&self, body: usize, k: usize) -> usize {
        1 + BODY_SLOTS * body + k
    }

    /// First slot of the continuous element states.
    #[must_use]
    pub fn state_slot(&self) -> usize {
        1 + BODY_SLOTS * self.bodies
    }

    /// First slot of the angle references.
    #[must_use]
    pub fn reference_slot(&self) -> usize {
        self.state_slot() + self.states
    }

    /// First slot of the discrete element states, and of the signals from outside behind them.
    #[must_use]
    pub fn discrete_slot(&self) -> usize {
        self.reference_slot() + self.references
    }

    /// Writes what stays as it is during a step into the inputs of programs: angle references; discrete element states and
    /// signals from outside.
    pub fn write_discrete(&self, inputs: &mut [f64], references: &[f64], discrete: &[f64]) {
        inputs[self.reference_slot()..self.discrete_slot()].copy_from_slice(references);
        inputs[self.discrete_slot()..self.acceleration_slot()].copy_from_slice(discrete);
    }

    /// Slot of a signal that is given from outside.
    #[must_use]
    pub fn given_slot(&self, input: usize) -> usize {
        self.discrete_slot() + self.given_at + input
    }

    /// First slot of the accelerations: per body three of the centre of mass and three of omega'.
    #[must_use]
    pub fn acceleration_slot(&self) -> usize {
        self.discrete_slot() + self.discrete
    }

    /// First slot of the Lagrange multipliers.
    #[must_use]
    pub fn multiplier_slot(&self) -> usize {
        self.acceleration_slot() + self.velocities()
    }

    /// The slots of the accelerations, and of the multipliers.
    #[must_use]
    pub fn solved(&self) -> [Range<usize>; 2] {
        [self.acceleration_slot()..self.multiplier_slot(), self.multiplier_slot()..self.inputs()]
    }

    /// The slots that an acceleration's or a multiplier's `slot` shares its body or its joint with.
    #[must_use]
    pub fn solved_peers(&self, slot: usize) -> Range<usize> {
        let rows = self.multiplier_slot();
        if slot < rows {
            let body = slot - (slot - self.acceleration_slot()) % 6;
            return body..body + 6;
        }
        let own = self.rows_of(self.element_of_row(slot - rows).0);
        rows + own.start..rows + own.end
    }

    /// Length of the input vector of every program.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.multiplier_slot() + self.rows
    }
}

/// From the place of an element in a list of firsts to that of the next one.
fn range(firsts: &[usize], element: usize, end: usize) -> Range<usize> {
    firsts[element]..firsts.get(element + 1).copied().unwrap_or(end)
}
