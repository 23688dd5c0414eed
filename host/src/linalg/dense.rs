//! LU with complete pivoting for small dense square systems that may be singular.

use super::{LinalgError, check_length, two_norm};

/// Most sweeps of scaling; they stop by themselves when nothing changes any more.
const SCALING_SWEEPS: usize = 10;

/// An entry at or below this share of the largest one in its row and in its column is taken as
/// round-off and has no say in the scaling.
const NEGLIGIBLE_ENTRY: f64 = 1e-14;

/// `P R A C Q = L U` of a dense square matrix `A` (`n x n`, column-major).
///
/// `R` and `C` are diagonal scalings by powers of two that bring the entries near one: each
/// sweep divides rows, then columns, by the geometric mean of their entries (the idea of
/// Curtis & Reid, IMA J. Appl. Math. 10, 1972). Pivots of unknowns with different units thus
/// become comparable. Dividing by the *largest* entry, as is usual, would not do for saddle
/// point matrices: next to constraint rows of order one it leaves small masses small, and a
/// light body is taken for a missing one.
///
/// The pivot of each step is the largest entry that remains; the factorisation stops where that
/// is at or below the tolerance times the first pivot, which gives the rank.
#[derive(Debug, Clone)]
pub struct FullPivLu {
    n: usize,
    tolerance: f64,
    /// `A`, then `L` below the diagonal (ones left out) and `U`.
    entries: Vec<f64>,
    row_scale: Vec<f64>,
    column_scale: Vec<f64>,
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
            row_scale: vec![1.0; n],
            column_scale: vec![1.0; n],
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
        self.equilibrate();
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

    /// Smallest accepted pivot over the largest one, of the scaled matrix; 1 for rank 0.
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
    /// equations are missed, relative to the scaled right side: zero up to round-off if the
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
            *value = self.row_scale[row] * b[row];
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
            x[column] = self.column_scale[column] * value;
        }
        Ok(if right_size > 0.0 { miss / right_size } else { 0.0 })
    }

    /// Chooses `R` and `C` and applies them to the entries.
    fn equilibrate(&mut self) {
        self.row_scale.fill(1.0);
        self.column_scale.fill(1.0);
        self.drop_negligible();
        for _ in 0..SCALING_SWEEPS {
            let rows_changed = self.scale_rows();
            let columns_changed = self.scale_columns();
            if !rows_changed && !columns_changed {
                break;
            }
        }
    }

    /// Sets round-off to zero: it would be blown up to the size of an entry by the scaling.
    fn drop_negligible(&mut self) {
        let n = self.n;
        // `row_scale` holds the largest entry of each row for a moment.
        self.row_scale.fill(0.0);
        for column in self.entries.chunks_exact(n.max(1)) {
            for (largest, value) in self.row_scale.iter_mut().zip(column) {
                *largest = largest.max(value.abs());
            }
        }
        for column in self.entries.chunks_exact_mut(n.max(1)) {
            let column_largest = column.iter().fold(0.0_f64, |l, v| l.max(v.abs()));
            for (&row_largest, value) in self.row_scale.iter().zip(column.iter_mut()) {
                if value.abs() <= NEGLIGIBLE_ENTRY * row_largest.min(column_largest) {
                    *value = 0.0;
                }
            }
        }
        self.row_scale.fill(1.0);
    }

    /// One half of a sweep; tells whether anything changed.
    fn scale_rows(&mut self) -> bool {
        let n = self.n;
        let mut changed = false;
        for row in 0..n {
            let factor = inverse_mean(self.entries[row..].iter().step_by(n));
            if factor == 1.0 {
                continue;
            }
            for value in self.entries[row..].iter_mut().step_by(n) {
                *value *= factor;
            }
            self.row_scale[row] *= factor;
            changed = true;
        }
        changed
    }

    /// The other half.
    fn scale_columns(&mut self) -> bool {
        let n = self.n;
        let mut changed = false;
        for column in 0..n {
            let entries = &mut self.entries[n * column..n * (column + 1)];
            let factor = inverse_mean(entries.iter());
            if factor == 1.0 {
                continue;
            }
            for value in entries {
                *value *= factor;
            }
            self.column_scale[column] *= factor;
            changed = true;
        }
        changed
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

/// Power of two near the inverse of the geometric mean of the nonzero entries; 1 if there is
/// none. Works on the binary exponents, which spares the logarithms.
fn inverse_mean<'a>(entries: impl Iterator<Item = &'a f64>) -> f64 {
    let mut sum = 0;
    let mut count = 0;
    for &value in entries {
        if value != 0.0 {
            sum += binary_exponent(value);
            count += 1;
        }
    }
    if count == 0 {
        return 1.0;
    }
    // Rounded towards zero, so that repeated sweeps come to rest.
    2.0_f64.powi(-(sum / count))
}

/// Exponent `e` of `|x| = (1..2) 2^e`; the least one for subnormal numbers.
fn binary_exponent(x: f64) -> i32 {
    const MANTISSA_BITS: u32 = 52;
    const EXPONENT_MASK: u64 = 0x7ff;
    const BIAS: i32 = 1023;
    ((x.to_bits() >> MANTISSA_BITS) & EXPONENT_MASK) as i32 - BIAS
}
