//! LU with complete pivoting for small dense square systems that may be singular.

use super::{LinalgError, check_length, two_norm};

/// `P A Q = L U` of a dense square matrix `A` (`n x n`, column-major).
///
/// Nothing is scaled: whoever knows the units of rows and columns divides by them before. (Scaling by the entries alone,
/// by their largest or by a mean, was tried: next to constraint rows of order one it leaves small masses small and takes
/// light bodies for missing ones, or it lets entries that are round-off or nearly so decide about the scale.)
///
/// The pivot of each step is the largest entry that remains; the factorisation stops where that
/// is at or below the tolerance times the first pivot, which gives the rank.
#[derive(Debug, Clone)]
pub struct FullPivLu {
    n: usize,
    tolerance: f64,
    /// `A`, then `L` below the diagonal (ones left out) and `U`.
    entries: Vec<f64>,
    /// Row, and column, of `A` at each place.
    row_order: Vec<usize>,
    column_order: Vec<usize>,
    rank: usize,
    smallest_pivot: f64,
    factored: bool,
    work: Vec<f64>,
}

impl FullPivLu {
    /// Storage for matrices of size `n`; `tolerance` is the share of the largest pivot at or
    /// below which a pivot counts as zero, see [`super::DEFAULT_RANK_TOLERANCE`].
    pub fn new(n: usize, tolerance: f64) -> Self {
        Self {
            n,
            tolerance,
            entries: vec![0.0; n * n],
            row_order: (0..n).collect(),
            column_order: (0..n).collect(),
            rank: 0,
            smallest_pivot: 1.0,
            factored: false,
            work: vec![0.0; n],
        }
    }

    /// Storage of `A`, column-major: entry `(i, j)` at `i + n * j`. It is consumed by
    /// [`FullPivLu::factor`], so every entry has to be written before each factorisation.
    pub fn entries_mut(&mut self) -> &mut [f64] {
        self.factored = false;
        &mut self.entries
    }

    /// Factors what [`FullPivLu::entries_mut`] was filled with. Allocates nothing.
    ///
    /// # Errors
    /// [`LinalgError::NotFinite`]; [`LinalgError::NotFactored`] if the matrix was not filled
    /// anew. A rank below `n` is a finding, not an error.
    pub fn factor(&mut self) -> Result<(), LinalgError> {
        if self.factored {
            return Err(LinalgError::NotFactored);
        }
        if !self.entries.iter().all(|value| value.is_finite()) {
            return Err(LinalgError::NotFinite { what: "matrix" });
        }
        for place in 0..self.n {
            self.row_order[place] = place;
            self.column_order[place] = place;
        }
        self.rank = 0;
        self.smallest_pivot = 1.0;
        let mut first_pivot = 0.0_f64;
        while self.rank < self.n {
            let k = self.rank;
            let (row, column, size) = self.largest_entry(k);
            first_pivot = first_pivot.max(size);
            if size <= self.tolerance * first_pivot {
                break;
            }
            self.smallest_pivot = self.smallest_pivot.min(size / first_pivot);
            self.swap(k, row, column);
            self.eliminate(k);
            self.rank += 1;
        }
        self.factored = true;
        Ok(())
    }

    /// Number of accepted pivots.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Smallest accepted pivot over the largest one; 1 for rank 0.
    pub fn smallest_pivot_ratio(&self) -> f64 {
        self.smallest_pivot
    }

    /// Equations that follow from the others.
    pub fn dependent_rows(&self) -> &[usize] {
        &self.row_order[self.rank..]
    }

    /// Unknowns that the equations leave open; [`FullPivLu::solve`] sets them to zero.
    pub fn free_columns(&self) -> &[usize] {
        &self.column_order[self.rank..]
    }

    /// Solves `A x = b`, with the free unknowns at zero. Returns how badly the dependent
    /// equations are missed, relative to the right side: zero up to round-off if the
    /// system is consistent. Allocates nothing.
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`], or a slice of the wrong length.
    pub fn solve(&mut self, b: &[f64], x: &mut [f64]) -> Result<f64, LinalgError> {
        if !self.factored {
            return Err(LinalgError::NotFactored);
        }
        check_length("right side", self.n, b.len())?;
        check_length("solution", self.n, x.len())?;
        let (n, rank) = (self.n, self.rank);
        for (value, &row) in self.work.iter_mut().zip(&self.row_order) {
            *value = b[row];
        }
        let right_size = two_norm(&self.work);

        for k in 0..rank {
            let value = self.work[k];
            for i in k + 1..n {
                self.work[i] -= self.entries[i + n * k] * value;
            }
        }
        let miss = two_norm(&self.work[rank..]);

        for k in (0..rank).rev() {
            self.work[k] /= self.entries[k + n * k];
            let value = self.work[k];
            for i in 0..k {
                self.work[i] -= self.entries[i + n * k] * value;
            }
        }
        x.fill(0.0);
        for (&column, &value) in self.column_order[..rank].iter().zip(&self.work) {
            x[column] = value;
        }
        Ok(if right_size > 0.0 { miss / right_size } else { 0.0 })
    }

    /// Row, column and size of the largest entry from place `k` on.
    fn largest_entry(&self, k: usize) -> (usize, usize, f64) {
        let mut best = (k, k, 0.0);
        for column in k..self.n {
            for row in k..self.n {
                let size = self.entries[row + self.n * column].abs();
                if size > best.2 {
                    best = (row, column, size);
                }
            }
        }
        best
    }

    fn swap(&mut self, k: usize, row: usize, column: usize) {
        let n = self.n;
        if row != k {
            for j in 0..n {
                self.entries.swap(k + n * j, row + n * j);
            }
            self.row_order.swap(k, row);
        }
        if column != k {
            for i in 0..n {
                self.entries.swap(i + n * k, i + n * column);
            }
            self.column_order.swap(k, column);
        }
    }

    fn eliminate(&mut self, k: usize) {
        let n = self.n;
        let (left, right) = self.entries.split_at_mut(n * (k + 1));
        let pivot_column = &mut left[n * k..];
        let pivot = pivot_column[k];
        for value in &mut pivot_column[k + 1..] {
            *value /= pivot;
        }
        for column in right.chunks_exact_mut(n) {
            let factor = column[k];
            if factor != 0.0 {
                super::add_scaled(&mut column[k + 1..], -factor, &pivot_column[k + 1..]);
            }
        }
    }
}
