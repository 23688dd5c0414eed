//! [`StateSizes`]: what errors of the states of elements are compared with.
//!
//! A state counts by the largest magnitude that it has had. The flexible coordinates of an element are one displacement of it, with one
//! strain energy, and their velocities one motion with one kinetic energy: a mode that hardly has a share in them ([`LEAST_SHARE`]) counts by
//! that share, since one that nothing excites is zero but for round-off and has no size of its own.

use crate::model::{Model, flexible_diagonals};
use crate::plan::Layout;

/// Share of the amplitude that would have all of the energy; in the energy it is its square.
const LEAST_SHARE: f64 = 1e-3;

/// See the module documentation.
pub(super) struct StateSizes {
    /// The largest magnitude of each state at the beginnings of steps so far, or where the first step led that was tried from zero.
    largest: Vec<f64>,
    /// States with one energy, by their numbers, with their weights: `weight * state` is the square root of twice an energy.
    families: Vec<Vec<(usize, f64)>>,
    /// For one step.
    sizes: Vec<f64>,
}

impl StateSizes {
    pub(super) fn new(model: &Model, layout: &Layout) -> Self {
        let mut families = Vec::new();
        for (number, element) in model.elements.iter().enumerate() {
            let n = element.recording.flexible();
            if n == 0 {
                continue;
            }
            let first = layout.states_of(number).start;
            for (diagonal, first) in flexible_diagonals(element, &model.bodies).into_iter().zip([first, first + n]) {
                let weights = diagonal.into_iter().map(f64::sqrt).enumerate();
                let family = weights.filter(|(_, weight)| weight.is_normal()).map(|(k, weight)| (first + k, weight));
                families.push(family.collect());
            }
        }
        Self { largest: vec![0.0; layout.states], families, sizes: vec![0.0; layout.states] }
    }

    pub(super) fn largest(&self) -> &[f64] {
        &self.largest
    }

    /// What an earlier stretch of the run has found.
    pub(super) fn carry_on(&mut self, largest: &[f64]) {
        self.largest.copy_from_slice(largest);
    }

    /// States from which the run continues: where a step led that was rejected has no say in what follows.
    pub(super) fn take(&mut self, states: &[f64]) {
        for (largest, state) in self.largest.iter_mut().zip(states) {
            *largest = largest.max(state.abs());
        }
    }

    /// Sizes in a step from the states `from` to the states `to`; one where there is none. `[hot, no allocation]`
    pub(super) fn between(&mut self, from: &[f64], to: &[f64]) -> &[f64] {
        for (k, size) in self.sizes.iter_mut().enumerate() {
            let known = self.largest[k].max(from[k].abs());
            *size = known.max(to[k].abs());
            if known == 0.0 {
                // What begins as a power of time is no less than its error after any step, however small: where the first step tried
                // would bring it is its size.
                self.largest[k] = *size;
            }
        }
        for family in &self.families {
            let most = family.iter().fold(0.0_f64, |most, (k, weight)| most.max(weight * self.sizes[*k]));
            for (k, weight) in family {
                self.sizes[*k] = self.sizes[*k].max(LEAST_SHARE * most / weight);
            }
        }
        self.sizes.iter_mut().filter(|size| **size == 0.0).for_each(|size| *size = 1.0);
        &self.sizes
    }
}
