//! Which storage a factorisation has.

use super::sparse::SparseColumns;
use super::whole::WholeColumns;

/// The columns of a [`super::PivotedQr`], then its reflectors and `R`.
#[derive(Debug, Clone)]
pub(super) enum Stored {
    Whole(WholeColumns),
    Sparse(SparseColumns),
}

/// Has whichever storage it is do something.
macro_rules! by {
    ($self:expr, $stored:ident => $whole:expr, $sparse:expr) => {
        match $self {
            Stored::Whole($stored) => $whole,
            Stored::Sparse($stored) => $sparse,
        }
    };
    ($self:expr, $stored:ident => $either:expr) => {
        by!($self, $stored => $either, $either)
    };
}

impl Stored {
    pub(super) fn whole(rows: usize, columns: usize) -> Self {
        Self::Whole(WholeColumns::new(rows, columns))
    }

    pub(super) fn sparse(rows: usize, columns: usize) -> Self {
        Self::Sparse(SparseColumns::new(rows, columns))
    }

    pub(super) fn clear(&mut self) {
        by!(self, stored => stored.clear());
    }

    pub(super) fn set(&mut self, row: usize, column: usize, value: f64) {
        by!(self, stored => stored.set(row, column, value));
    }

    pub(super) fn vanish(&mut self, column: usize) {
        by!(self, stored => stored.vanish(column));
    }

    pub(super) fn divide(&mut self, column: usize, by: f64) {
        by!(self, stored => stored.divide(column, by));
    }

    /// All columns are scaled; the first is about to be taken.
    pub(super) fn begin(&mut self) {
        by!(self, stored => stored.begin());
    }

    /// Length of what remains of a column below row `k`.
    pub(super) fn length(&self, column: usize, k: usize) -> f64 {
        by!(self, stored => stored.length(column, k), stored.length(column))
    }

    /// Annihilates a column whose remainder has this length below row `k` and updates those that remain. Gives the factor of the
    /// reflector and adds the columns that changed, with what they have in row `k` now.
    pub(super) fn reflect(
        &mut self,
        (k, column): (usize, usize),
        length: f64,
        remaining: &[usize],
        changed: &mut Vec<(usize, f64)>,
    ) -> f64 {
        by!(self, stored => stored.reflect(k, column, length, remaining, changed), stored.reflect(column, length, changed))
    }

    pub(super) fn apply_q(&mut self, pivots: &[usize], tau: &[f64], x: &mut [f64]) {
        by!(self, stored => stored.apply_q(pivots, tau, x));
    }

    pub(super) fn apply_q_transposed(&mut self, pivots: &[usize], tau: &[f64], x: &mut [f64]) {
        by!(self, stored => stored.apply_q_transposed(pivots, tau, x));
    }

    pub(super) fn diagonal(&self, k: usize, column: usize) -> f64 {
        by!(self, stored => stored.diagonal(k, column), stored.diagonal(column))
    }

    pub(super) fn product(&self, k: usize, column: usize, x: &[f64]) -> f64 {
        by!(self, stored => stored.product(k, column, x), stored.product(column, x))
    }

    pub(super) fn add(&self, k: usize, column: usize, factor: f64, x: &mut [f64]) {
        by!(self, stored => stored.add(k, column, factor, x), stored.add(column, factor, x));
    }
}
