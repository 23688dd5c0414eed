//! [`SolvedProgram`]: quantities with accelerations and reactions, found along the tree.

use super::balance::{Imbalance, worst_body};
use super::evaluator::Evaluator;
use crate::program::Reactions;

/// Share of the magnitudes that a row's pivot is made of below which its multiplier is not well determined.
const LEAST_PIVOT: f64 = 1e-8;
/// Share of a body's own loads by which it may miss its equations of motion; beyond it, a solution that can be refined is sought.
const BALANCED: f64 = 1e-10;

/// See the module documentation.
pub struct SolvedProgram {
    pub(super) evaluator: Evaluator,
    /// Number of quantities; what follows says how well they are known.
    wanted: usize,
    /// What the terms of the bodies' equations add up to, six per body.
    sizes: Vec<f64>,
}

impl SolvedProgram {
    /// Prepares the evaluation.
    #[must_use]
    pub(super) fn new(reactions: &Reactions) -> Self {
        let mut nodes = reactions.nodes.clone();
        nodes.extend(reactions.left.iter().chain(&reactions.squares).chain(reactions.pivots.iter().flatten()));
        Self {
            evaluator: Evaluator::new(&reactions.graph, &nodes),
            wanted: reactions.nodes.len(),
            sizes: vec![0.0; reactions.left.len()],
        }
    }

    /// The quantities at the inputs that the program was run for last.
    #[must_use]
    pub fn outputs(&self) -> &[f64] {
        &self.evaluator.outputs()[..self.wanted]
    }

    /// The program, with how often it was run.
    pub fn used(&mut self) -> crate::program::Used<'_> {
        self.evaluator.used(false)
    }

    /// How well the equations of motion hold there; `None` where too badly, or where a multiplier is not well determined.
    pub(super) fn judge(&mut self, length: f64) -> Option<Imbalance> {
        let columns = self.sizes.len();
        let (left, rest) = self.evaluator.outputs()[self.wanted..].split_at(columns);
        let (squares, pivots) = rest.split_at(columns);
        if !pivots.chunks_exact(2).all(|row| row[0] >= LEAST_PIVOT * row[1] && row[0] > 0.0) {
            return None;
        }
        self.sizes.iter_mut().zip(squares).for_each(|(size, square)| *size = square.sqrt());
        let worst = worst_body(left, &self.sizes, length);
        (worst.share <= BALANCED).then_some(worst)
    }
}
