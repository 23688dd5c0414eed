//! LU with complete pivoting for small dense square systems that may be singular.

#![allow(
    unsafe_code,
    reason = "the only way to call what is compiled for a wider vector unit; the use says why it holds"
)]

use super::{LinalgError, check_length, two_norm};

/// Entries of a column that are looked at side by side.
const LANES: usize = 8;

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
        self.eliminate_all();
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

    fn eliminate_all(&mut self) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: this machine has what the function was compiled for.
            return unsafe { self.eliminate_widely() };
        }
        self.eliminate();
    }

    /// [`FullPivLu::eliminate`] with vectors of four numbers, which are the same.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn eliminate_widely(&mut self) {
        self.eliminate();
    }

    #[inline(always)]
    fn eliminate(&mut self) {
        let n = self.n;
        let mut pivot = Pivot::none(0);
        for (column, entries) in self.entries.chunks_exact(n.max(1)).enumerate() {
            pivot.look(column, 0, entries, largest(entries));
        }
        let mut first_pivot = 0.0_f64;
        while self.rank < n {
            let k = self.rank;
            first_pivot = first_pivot.max(pivot.size);
            if pivot.size <= self.tolerance * first_pivot {
                break;
            }
            self.smallest_pivot = self.smallest_pivot.min(pivot.size / first_pivot);
            self.swap(k, pivot.row, pivot.column);
            pivot = self.eliminate_column(k);
            self.rank += 1;
        }
    }

    /// Takes the pivot of place `k` out of what remains, and finds the next one on the way.
    #[inline(always)]
    fn eliminate_column(&mut self, k: usize) -> Pivot {
        let n = self.n;
        let (left, right) = self.entries.split_at_mut(n * (k + 1));
        let pivot_column = &mut left[n * k..];
        let pivot = pivot_column[k];
        for value in &mut pivot_column[k + 1..] {
            *value /= pivot;
        }
        let mut next = Pivot::none(k + 1);
        for (number, column) in right.chunks_exact_mut(n).enumerate() {
            let factor = column[k];
            let rest = &mut column[k + 1..];
            let most = if factor == 0.0 { largest(rest) } else { add_scaled(rest, -factor, &pivot_column[k + 1..]) };
            next.look(k + 1 + number, k + 1, rest, most);
        }
        next
    }

    /// Row and column of `A` at each place.
    #[cfg(test)]
    pub(super) fn orders(&self) -> (&[usize], &[usize]) {
        (&self.row_order, &self.column_order)
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
}

/// The largest entry so far: of equal ones the first, column by column.
struct Pivot {
    row: usize,
    column: usize,
    size: f64,
}

impl Pivot {
    /// Nothing of what remains from place `k` on has been looked at.
    fn none(k: usize) -> Self {
        Self { row: k, column: k, size: 0.0 }
    }

    /// Looks at the rest of a column, from row `first` on, with its largest magnitude.
    #[inline(always)]
    fn look(&mut self, column: usize, first: usize, rest: &[f64], most: f64) {
        if most > self.size
            && let Some(row) = rest.iter().position(|entry| entry.abs() == most)
        {
            *self = Self { row: first + row, column, size: most };
        }
    }
}

/// The largest magnitude; what is no number does not count.
#[inline(always)]
fn largest(entries: &[f64]) -> f64 {
    let (whole, rest) = entries.as_chunks::<LANES>();
    let mut most = [0.0_f64; LANES];
    for entries in whole {
        most.iter_mut().zip(entries).for_each(|(most, entry)| *most = larger(*most, entry.abs()));
    }
    rest.iter().chain(&most).fold(0.0, |most, entry| larger(most, entry.abs()))
}

/// `y += factor x`, with [`largest`] of the result.
#[inline(always)]
fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) -> f64 {
    let (ys, y_rest) = y.as_chunks_mut::<LANES>();
    let (xs, x_rest) = x.as_chunks::<LANES>();
    let mut most = [0.0_f64; LANES];
    for (y, x) in ys.iter_mut().zip(xs) {
        for k in 0..LANES {
            y[k] += factor * x[k];
            most[k] = larger(most[k], y[k].abs());
        }
    }
    super::add_scaled(y_rest, factor, x_rest);
    y_rest.iter().chain(&most).fold(0.0, |most, entry| larger(most, entry.abs()))
}

#[inline(always)]
fn larger(most: f64, size: f64) -> f64 {
    if size > most { size } else { most }
}
