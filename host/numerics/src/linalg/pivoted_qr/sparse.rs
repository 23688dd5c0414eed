//! Columns with the entries that are not zero.

use super::super::{block_cholesky::find_root, two_norm_of};

/// Sparse storage of a [`super::PivotedQr`].
///
/// The row that a reflector leaves an entry in is the one with the largest entry of its column, which keeps the errors of each row
/// round-off of that row as sorting does (Cox & Higham, BIT 38, 1998), and keeps the reflector within the rows of the column. Rows
/// that have been left so take part in nothing further. What is zero is left out, so cost goes with the entries of `R`.
#[derive(Debug, Clone)]
pub(super) struct SparseColumns {
    /// By column: entries in open rows; below the pivot in those that have been taken.
    open: Vec<Vec<(usize, f64)>>,
    /// By column: entries of `R` above the diagonal, by pivot.
    upper: Vec<Vec<(usize, f64)>>,
    /// By column: that entry of `R`, if it has been taken.
    diagonal: Vec<f64>,
    /// By pivot: the row that is left.
    left: Vec<usize>,
    /// Groups of rows (see [`find_root`]), and by root the columns that may have an entry in a row of the group.
    group: Vec<usize>,
    members: Vec<Vec<usize>>,
    /// Whether a column has been taken or given up.
    taken: Vec<bool>,
    /// Whether a row has been left, or a column is in hand.
    is_left: Vec<bool>,
    in_hand: Vec<bool>,
    /// Scratch by row: entries of a column, and whether there are any.
    work: Vec<f64>,
    present: Vec<bool>,
}

impl SparseColumns {
    pub(super) fn new(rows: usize, columns: usize) -> Self {
        Self {
            open: vec![Vec::new(); columns],
            upper: vec![Vec::new(); columns],
            diagonal: vec![0.0; columns],
            left: Vec::new(),
            group: (0..rows).collect(),
            members: vec![Vec::new(); rows],
            taken: vec![false; columns],
            is_left: vec![false; rows],
            in_hand: vec![false; columns],
            work: vec![0.0; rows],
            present: vec![false; rows],
        }
    }

    pub(super) fn clear(&mut self) {
        self.open.iter_mut().chain(&mut self.upper).for_each(Vec::clear);
        self.left.clear();
        self.taken.fill(false);
        self.is_left.fill(false);
    }

    pub(super) fn set(&mut self, row: usize, column: usize, value: f64) {
        if value != 0.0 {
            self.open[column].push((row, value));
        }
    }

    pub(super) fn length(&self, column: usize) -> f64 {
        two_norm_of(self.open[column].iter().map(|(_, value)| *value))
    }

    pub(super) fn divide(&mut self, column: usize, by: f64) {
        self.open[column].iter_mut().for_each(|(_, value)| *value /= by);
    }

    /// What is left of a column is not changed any more.
    pub(super) fn give_up(&mut self, column: usize) {
        self.taken[column] = true;
        self.open[column].clear();
    }

    /// Entries that a column has in open rows.
    pub(super) fn entries_left(&self, column: usize) -> usize {
        self.open[column].len()
    }

    pub(super) fn vanish(&mut self, column: usize) {
        self.open[column].clear();
    }

    /// Notes which columns have an entry in each row.
    pub(super) fn begin(&mut self) {
        self.members.iter_mut().for_each(Vec::clear);
        self.group.iter_mut().enumerate().for_each(|(row, group)| *group = row);
        for (column, entries) in self.open.iter().enumerate() {
            for (row, _) in entries {
                self.members[*row].push(column);
            }
        }
    }

    /// Annihilates a column but for one row and updates the columns that share a row with it; gives the factor of the reflector.
    pub(super) fn reflect(&mut self, column: usize, length: f64, changed: &mut Vec<(usize, f64)>) -> f64 {
        let mut reflector = std::mem::take(&mut self.open[column]);
        let at = (0..reflector.len()).fold(
            0,
            |best, at| {
                if reflector[at].1.abs() > reflector[best].1.abs() { at } else { best }
            },
        );
        let (left, alpha) = reflector.swap_remove(at);
        let beta = if alpha < 0.0 { length } else { -length };
        let tau = (beta - alpha) / beta;
        reflector.iter_mut().for_each(|(_, value)| *value /= alpha - beta);
        self.taken[column] = true;
        self.is_left[left] = true;
        self.diagonal[column] = beta;
        let pivot = self.left.len();
        self.left.push(left);
        for other in self.join(left, &reflector) {
            let head = self.update(other, left, tau, &reflector);
            if head != 0.0 {
                self.upper[other].push((pivot, head));
            }
            changed.push((other, head));
        }
        self.open[column] = reflector;
        tau
    }

    /// The columns that may share one of these rows; from now on all of these rows may have an entry in each.
    fn join(&mut self, left: usize, reflector: &[(usize, f64)]) -> Vec<usize> {
        let mut joined = Vec::new();
        let root = find_root(&mut self.group, left);
        for row in std::iter::once(left).chain(reflector.iter().map(|(row, _)| *row)) {
            let own = find_root(&mut self.group, row);
            self.group[own] = root;
            for column in std::mem::take(&mut self.members[own]) {
                if !self.taken[column] && !self.in_hand[column] {
                    self.in_hand[column] = true;
                    joined.push(column);
                }
            }
        }
        joined.iter().for_each(|column| self.in_hand[*column] = false);
        self.members[root].clone_from(&joined);
        joined
    }

    /// Applies a reflector to a column; gives the entry in the row that is left.
    fn update(&mut self, column: usize, left: usize, tau: f64, reflector: &[(usize, f64)]) -> f64 {
        for (row, value) in &self.open[column] {
            self.work[*row] = *value;
            self.present[*row] = true;
        }
        let along: f64 = reflector.iter().map(|(row, value)| value * self.work[*row]).sum();
        let product = tau * (self.work[left] + along);
        let head = self.work[left] - product;
        self.present[left] = true;
        let entries = &mut self.open[column];
        for (row, value) in reflector {
            self.work[*row] -= product * value;
            if !self.present[*row] {
                entries.push((*row, 0.0));
            }
        }
        let work = &self.work;
        entries.retain_mut(|(row, value)| {
            *value = work[*row];
            *row != left && *value != 0.0
        });
        for row in reflector.iter().map(|(row, _)| *row).chain([left]) {
            (self.work[row], self.present[row]) = (0.0, false);
        }
        for (row, _) in &self.open[column] {
            (self.work[*row], self.present[*row]) = (0.0, false);
        }
        head
    }

    fn apply_reflector(&self, k: usize, column: usize, tau: f64, x: &mut [f64]) {
        let left = self.left[k];
        let along: f64 = self.open[column].iter().map(|(row, value)| value * x[*row]).sum();
        let product = tau * (x[left] + along);
        x[left] -= product;
        self.open[column].iter().for_each(|(row, value)| x[*row] -= product * value);
    }

    /// Rows in the order in which `Q` has them: left ones by pivot, then the others.
    fn row_order(&self) -> impl Iterator<Item = usize> + '_ {
        let others = self.is_left.iter().enumerate().filter(|(_, left)| !**left).map(|(row, _)| row);
        self.left.iter().copied().chain(others)
    }

    /// `x := S^T Q x`
    pub(super) fn apply_q(&mut self, pivots: &[usize], tau: &[f64], x: &mut [f64]) {
        let mut work = std::mem::take(&mut self.work);
        self.row_order().zip(&*x).for_each(|(row, value)| work[row] = *value);
        x.copy_from_slice(&work);
        work.fill(0.0);
        self.work = work;
        for (k, column) in pivots.iter().enumerate().rev() {
            self.apply_reflector(k, *column, tau[k], x);
        }
    }

    /// `x := Q^T S x`
    pub(super) fn apply_q_transposed(&mut self, pivots: &[usize], tau: &[f64], x: &mut [f64]) {
        for (k, column) in pivots.iter().enumerate() {
            self.apply_reflector(k, *column, tau[k], x);
        }
        let mut work = std::mem::take(&mut self.work);
        work.copy_from_slice(x);
        self.row_order().zip(&mut *x).for_each(|(row, value)| *value = work[row]);
        work.fill(0.0);
        self.work = work;
    }

    pub(super) fn diagonal(&self, column: usize) -> f64 {
        self.diagonal[column]
    }

    pub(super) fn product(&self, column: usize, x: &[f64]) -> f64 {
        self.upper[column].iter().map(|(pivot, value)| value * x[*pivot]).sum()
    }

    pub(super) fn add(&self, column: usize, factor: f64, x: &mut [f64]) {
        self.upper[column].iter().for_each(|(pivot, value)| x[*pivot] += factor * value);
    }
}
