//! Householder QR with column pivoting for small dense matrices of unknown rank.

use super::{LinalgError, add_scaled, check_length, dot, two_norm};

/// A column whose length is at or below this share of the longest one is taken as zero: it
/// consists of round-off, and scaling it to unit length would invent a direction.
const NEGLIGIBLE_COLUMN: f64 = 1e-14;

/// `S A D P = Q R` of a dense matrix `A` (`rows x columns`, column-major).
///
/// `D` scales every column to unit length, `P` puts the column with the largest remainder
/// first (Businger & Golub 1965), and the factorisation stops where every remainder is at or
/// below the tolerance: that is the rank. Remainders are down-dated, and recomputed where
/// cancellation would spoil them, after Drmac & Bujanovic (ACM TOMS 35, 2008; LAPACK dgeqp3).
/// `S` puts rows with large entries first: errors of each row are then round-off of that row,
/// however much rows differ in size (Powell & Reid 1969; Cox & Higham, BIT 38, 1998).
///
/// Columns may be split in two groups, see [`PivotedQr::set_first_group`].
///
/// With rank `r`, `D` undone and the first `r` columns called independent:
/// - [`PivotedQr::least_squares`] solves `A x ~ b`, `x` zero on the dependent columns;
/// - [`PivotedQr::min_norm_solve`] solves `A^T x = g` on the independent rows, `|x|` minimal;
/// - [`PivotedQr::null_space`] spans `A y = 0`.
#[derive(Debug, Clone)]
pub struct PivotedQr {
    rows: usize,
    columns: usize,
    tolerance: f64,
    /// Largest rank accepted.
    rank_limit: usize,
    /// Group of each column of `A`.
    in_first_group: Vec<bool>,
    /// `A`, then `R` on and above the diagonal and the reflectors below it.
    entries: Vec<f64>,
    /// Factor of each reflector `I - tau v v^T`.
    tau: Vec<f64>,
    /// Lengths that columns are scaled by; their own where empty.
    lengths: Vec<f64>,
    /// `D`, by column of `A`.
    scale: Vec<f64>,
    /// `P`: column of `A` at each place.
    order: Vec<usize>,
    /// `S`: row of `A` at each place; and the size of each row.
    row_order: Vec<usize>,
    row_size: Vec<f64>,
    /// Length of what remains of the column at each place, down-dated.
    remainder: Vec<f64>,
    /// The same when it was last computed from the entries.
    remainder_computed: Vec<f64>,
    rank: usize,
    smallest_pivot: f64,
    largest_dropped: f64,
    factored: bool,
    /// Scratch of length `rows`, and of length `columns`; `row_size` is scratch, too, once rows are sorted.
    tall: Vec<f64>,
    wide: Vec<f64>,
}

impl PivotedQr {
    /// Storage for matrices of one size; `tolerance` is the share of the largest pivot at or
    /// below which a remainder counts as zero, see [`super::DEFAULT_RANK_TOLERANCE`].
    pub fn new(rows: usize, columns: usize, tolerance: f64) -> Self {
        Self {
            rows,
            columns,
            tolerance,
            rank_limit: usize::MAX,
            in_first_group: vec![true; columns],
            entries: Vec::new(),
            tau: vec![0.0; rows.min(columns)],
            lengths: Vec::new(),
            scale: vec![1.0; columns],
            order: (0..columns).collect(),
            row_order: (0..rows).collect(),
            row_size: vec![0.0; rows],
            remainder: vec![0.0; columns],
            remainder_computed: vec![0.0; columns],
            rank: 0,
            smallest_pivot: 1.0,
            largest_dropped: 0.0,
            factored: false,
            tall: vec![0.0; rows],
            wide: vec![0.0; columns],
        }
    }

    /// Names the columns that are taken first: one of the others becomes a pivot only when all
    /// of these are taken or found dependent. Where columns depend on each other, it is thus
    /// one of the *others* that is called dependent. Without this call all are in one group.
    ///
    /// # Errors
    /// [`LinalgError::Pattern`] for a column out of range.
    pub fn set_first_group(&mut self, columns: &[usize]) -> Result<(), LinalgError> {
        if let Some(column) = columns.iter().find(|&&column| column >= self.columns) {
            let text = format!("column {column} of {} in the first group", self.columns);
            return Err(LinalgError::Pattern(text));
        }
        self.in_first_group.fill(false);
        for &column in columns {
            self.in_first_group[column] = true;
        }
        Ok(())
    }

    /// Storage of `A`, column-major: entry `(i, j)` at `i + rows * j`. It is consumed by
    /// [`PivotedQr::factor`], so every entry has to be written before each factorisation. Allocated by the first call:
    /// a large matrix that is never needed costs nothing.
    pub fn entries_mut(&mut self) -> &mut [f64] {
        self.factored = false;
        self.entries.resize(self.rows * self.columns, 0.0);
        &mut self.entries
    }

    /// Replaces the tolerance; with zero every column that has an entry left is accepted.
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    /// Accepts at most this many pivots, the largest ones; for matrices whose rank is known.
    pub fn set_rank_limit(&mut self, limit: usize) {
        self.rank_limit = limit;
    }

    /// Scales each column by the length given for it (positive) instead of its own, so that columns that vanish are noticed.
    ///
    /// # Errors
    /// A slice of the wrong length.
    pub fn set_lengths(&mut self, lengths: &[f64]) -> Result<(), LinalgError> {
        check_length("lengths", self.columns, lengths.len())?;
        self.lengths = lengths.to_vec();
        Ok(())
    }

    /// Factors what [`PivotedQr::entries_mut`] was filled with. Allocates nothing.
    ///
    /// # Errors
    /// [`LinalgError::NotFinite`]; [`LinalgError::NotFactored`] if the matrix was not filled
    /// anew. A rank below `columns` is a finding, not an error.
    pub fn factor(&mut self) -> Result<(), LinalgError> {
        if self.factored {
            return Err(LinalgError::NotFactored);
        }
        self.scale_columns()?;
        self.sort_rows();
        self.rank = 0;
        self.smallest_pivot = 1.0;

        // Columns have length one (or zero) unless lengths were given, so the largest pivot is one too, or near one.
        while self.rank < self.rows.min(self.columns).min(self.rank_limit) {
            let k = self.rank;
            let Some(place) = self.choose_pivot(k) else {
                break;
            };
            let length = two_norm(&self.column(place)[k..]);
            if length <= self.tolerance {
                // The down-dated length was too optimistic; look again with the true one.
                self.remainder[place] = length;
                self.remainder_computed[place] = length;
                continue;
            }
            self.swap_columns(k, place);
            self.reflect(k, length);
            self.smallest_pivot = self.smallest_pivot.min(length);
            self.rank += 1;
        }
        let rank = self.rank;
        self.largest_dropped =
            (rank..self.columns).map(|place| two_norm(&self.column(place)[rank..])).fold(0.0, f64::max);
        self.factored = true;
        Ok(())
    }

    /// Number of independent columns.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Independent columns, in pivot order.
    pub fn independent_columns(&self) -> &[usize] {
        &self.order[..self.rank]
    }

    /// Columns that depend on the independent ones.
    pub fn dependent_columns(&self) -> &[usize] {
        &self.order[self.rank..]
    }

    /// Smallest accepted pivot, columns scaled to unit length; 1 for rank 0.
    pub fn smallest_pivot_ratio(&self) -> f64 {
        self.smallest_pivot
    }

    /// Largest remainder among the dependent columns, columns scaled to unit length. The wider
    /// the gap to [`PivotedQr::smallest_pivot_ratio`], the surer the rank.
    pub fn largest_dropped_ratio(&self) -> f64 {
        self.largest_dropped
    }

    /// Basic least squares solution of `A x ~ b` (`b`: `rows`, `x`: `columns`), zero on the
    /// dependent columns. Returns `|A x - b|`. Allocates nothing.
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`], or a slice of the wrong length.
    pub fn least_squares(&mut self, b: &[f64], x: &mut [f64]) -> Result<f64, LinalgError> {
        self.check_factored()?;
        check_length("right side", self.rows, b.len())?;
        check_length("solution", self.columns, x.len())?;
        let mut tall = std::mem::take(&mut self.tall);
        tall.copy_from_slice(b);
        self.apply_q_transposed(&mut tall);
        self.solve_independent(&tall, x);
        let residual = two_norm(&tall[self.rank..]);
        self.tall = tall;
        Ok(residual)
    }

    /// Solution of `A^T x = g` (`g`: `columns`, `x`: `rows`) of minimal length that satisfies
    /// the independent equations exactly. Returns the largest miss among the dependent
    /// equations, `max |A^T x - g| / |column|`: zero up to round-off if `g` is consistent.
    /// Allocates nothing.
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`], or a slice of the wrong length.
    pub fn min_norm_solve(&mut self, g: &[f64], x: &mut [f64]) -> Result<f64, LinalgError> {
        self.check_factored()?;
        check_length("right side", self.columns, g.len())?;
        check_length("solution", self.rows, x.len())?;
        x.fill(0.0);
        // A^T x = g  <=>  R^T Q^T x = P^T D g; the shortest x has no part beyond R11.
        self.solve_independent_transposed(g, x);
        let rank = self.rank;
        let mut miss = 0.0_f64;
        for place in rank..self.columns {
            let column = self.order[place];
            let value = dot(&self.column(place)[..rank], &x[..rank]);
            miss = miss.max((value - self.scale[column] * g[column]).abs());
        }
        self.apply_q(x);
        Ok(miss)
    }

    /// Basis of `A y = 0`: `columns x (columns - rank)`, column-major. Vector `k` has a one on
    /// dependent column `k`, and zeros on the other dependent columns, so it tells how that
    /// column follows from the independent ones. `[report]`, allocates.
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`].
    pub fn null_space(&self) -> Result<Vec<f64>, LinalgError> {
        self.check_factored()?;
        let count = self.columns - self.rank;
        let mut basis = vec![0.0; self.columns * count];
        for k in 0..count {
            // R11 z = -R12 e_k, y = D P [z; e_k], scaled so that the dependent entry is one.
            let place = self.rank + k;
            let mut z: Vec<f64> = self.column(place)[..self.rank].to_vec();
            self.solve_r11(&mut z);
            let dependent = self.order[place];
            let vector = &mut basis[k * self.columns..(k + 1) * self.columns];
            for (&column, &value) in self.order.iter().zip(&z) {
                vector[column] = -value * self.scale[column] / self.scale[dependent];
            }
            vector[dependent] = 1.0;
        }
        Ok(basis)
    }

    /// Whether each unknown `x_j` of a system `A x = b` is free to change within the null
    /// space: some null vector, measured in units of its column's length, has an entry above
    /// `tolerance` times its largest there. `[report]`, allocates.
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`].
    pub fn free_unknowns(&self, tolerance: f64) -> Result<Vec<bool>, LinalgError> {
        let basis = self.null_space()?;
        let mut free = vec![false; self.columns];
        if self.columns == 0 {
            return Ok(free);
        }
        for vector in basis.chunks_exact(self.columns) {
            let scaled = |column: usize| (vector[column] / self.scale[column]).abs();
            let largest = (0..self.columns).map(scaled).fold(0.0, f64::max);
            for (column, flag) in free.iter_mut().enumerate() {
                *flag |= scaled(column) > tolerance * largest;
            }
        }
        Ok(free)
    }

    /// `x := S^T Q x` (`x`: `rows`).
    pub(super) fn apply_q(&mut self, x: &mut [f64]) {
        for k in (0..self.rank).rev() {
            self.apply_reflector(k, x);
        }
        self.row_size.copy_from_slice(x);
        for (value, &row) in self.row_size.iter().zip(&self.row_order) {
            x[row] = *value;
        }
    }

    /// `x := Q^T S x` (`x`: `rows`).
    pub(super) fn apply_q_transposed(&mut self, x: &mut [f64]) {
        self.row_size.copy_from_slice(x);
        for (value, &row) in x.iter_mut().zip(&self.row_order) {
            *value = self.row_size[row];
        }
        for k in 0..self.rank {
            self.apply_reflector(k, x);
        }
    }

    /// `x := D P [R11^-1 c_1; 0]` for the leading part of `c = Q^T b`.
    pub(super) fn solve_independent(&mut self, c: &[f64], x: &mut [f64]) {
        let rank = self.rank;
        let mut z = std::mem::take(&mut self.wide);
        z[..rank].copy_from_slice(&c[..rank]);
        self.solve_r11(&mut z[..rank]);
        x.fill(0.0);
        for (&column, &value) in self.order.iter().zip(&z[..rank]) {
            x[column] = self.scale[column] * value;
        }
        self.wide = z;
    }

    /// First `rank` entries of `x := R11^-T (P^T D g)`.
    pub(super) fn solve_independent_transposed(&self, g: &[f64], x: &mut [f64]) {
        for k in 0..self.rank {
            let column = self.order[k];
            let entries = self.column(k);
            let known = dot(&entries[..k], &x[..k]);
            x[k] = (self.scale[column] * g[column] - known) / entries[k];
        }
    }

    /// Declares the factorisation void.
    pub(super) fn invalidate(&mut self) {
        self.factored = false;
    }

    pub(super) fn check_factored(&self) -> Result<(), LinalgError> {
        if self.factored {
            return Ok(());
        }
        Err(LinalgError::NotFactored)
    }

    /// Scales columns to unit length, or by the lengths given; negligible ones to zero.
    fn scale_columns(&mut self) -> Result<(), LinalgError> {
        let mut longest = 0.0_f64;
        for column in 0..self.columns {
            let length = two_norm(self.column(column));
            if !length.is_finite() {
                return Err(LinalgError::NotFinite { what: "matrix" });
            }
            self.remainder[column] = length;
            longest = longest.max(length);
        }
        for column in 0..self.columns {
            let length = self.remainder[column];
            let (unit, longest) = self.lengths.get(column).map_or((length, longest), |given| (*given, *given));
            let negligible = length <= NEGLIGIBLE_COLUMN.min(self.tolerance) * longest;
            let first = column * self.rows;
            let entries = &mut self.entries[first..first + self.rows];
            if negligible {
                entries.fill(0.0);
            } else {
                entries.iter_mut().for_each(|value| *value /= unit);
            }
            self.scale[column] = if negligible { 1.0 } else { 1.0 / unit };
            self.remainder[column] = if negligible { 0.0 } else { length / unit };
            self.remainder_computed[column] = self.remainder[column];
            self.order[column] = column;
        }
        Ok(())
    }

    /// Puts rows with large entries first.
    fn sort_rows(&mut self) {
        self.row_size.fill(0.0);
        for column in self.entries.chunks_exact(self.rows.max(1)) {
            self.row_size.iter_mut().zip(column).for_each(|(size, value)| *size = size.max(value.abs()));
        }
        let size = &self.row_size;
        self.row_order.iter_mut().enumerate().for_each(|(place, row)| *row = place);
        self.row_order.sort_unstable_by(|a, b| size[*b].total_cmp(&size[*a]).then(a.cmp(b)));
        for column in self.entries.chunks_exact_mut(self.rows.max(1)) {
            self.row_size.copy_from_slice(column);
            column.iter_mut().zip(&self.row_order).for_each(|(value, row)| *value = self.row_size[*row]);
        }
    }

    /// Place of the column with the largest remainder, first group first; `None` if no
    /// remainder is above the tolerance.
    fn choose_pivot(&self, k: usize) -> Option<usize> {
        let largest_of = |first_group: bool| {
            let mut best = None;
            let mut best_length = self.tolerance;
            for place in k..self.columns {
                let same_group = self.in_first_group[self.order[place]] == first_group;
                if same_group && self.remainder[place] > best_length {
                    best = Some(place);
                    best_length = self.remainder[place];
                }
            }
            best
        };
        largest_of(true).or_else(|| largest_of(false))
    }

    fn swap_columns(&mut self, a: usize, b: usize) {
        if a == b {
            return;
        }
        let (left, right) = self.entries.split_at_mut(b * self.rows);
        left[a * self.rows..(a + 1) * self.rows].swap_with_slice(&mut right[..self.rows]);
        self.order.swap(a, b);
        self.remainder.swap(a, b);
        self.remainder_computed.swap(a, b);
    }

    /// Annihilates column `k` below its diagonal and updates the columns to its right.
    fn reflect(&mut self, k: usize, length: f64) {
        let rows = self.rows;
        let (left, right) = self.entries.split_at_mut((k + 1) * rows);
        let pivot_column = &mut left[k * rows + k..];

        // v = x - beta e_1 with beta = -sign(x_1) |x|, stored with v_1 = 1 understood.
        let alpha = pivot_column[0];
        let beta = if alpha < 0.0 { length } else { -length };
        self.tau[k] = (beta - alpha) / beta;
        for value in &mut pivot_column[1..] {
            *value /= alpha - beta;
        }
        pivot_column[0] = beta;

        let reflector = &pivot_column[1..];
        for (index, column) in right.chunks_exact_mut(rows).enumerate() {
            let tail = &mut column[k..];
            let product = self.tau[k] * (tail[0] + dot(reflector, &tail[1..]));
            tail[0] -= product;
            add_scaled(&mut tail[1..], -product, reflector);

            let place = k + 1 + index;
            let old = self.remainder[place];
            if old == 0.0 {
                continue;
            }
            let share = (tail[0] / old).abs();
            let left_over = (1.0 - share * share).max(0.0);
            let since_computed = old / self.remainder_computed[place];
            if left_over * since_computed * since_computed <= f64::EPSILON.sqrt() {
                self.remainder[place] = two_norm(&tail[1..]);
                self.remainder_computed[place] = self.remainder[place];
            } else {
                self.remainder[place] = old * left_over.sqrt();
            }
        }
    }

    fn apply_reflector(&self, k: usize, x: &mut [f64]) {
        let reflector = &self.column(k)[k + 1..];
        let product = self.tau[k] * (x[k] + dot(reflector, &x[k + 1..]));
        x[k] -= product;
        add_scaled(&mut x[k + 1..], -product, reflector);
    }

    /// `z := R11^-1 z` (`z`: `rank`).
    fn solve_r11(&self, z: &mut [f64]) {
        for k in (0..self.rank).rev() {
            let entries = self.column(k);
            z[k] /= entries[k];
            let value = z[k];
            add_scaled(&mut z[..k], -value, &entries[..k]);
        }
    }

    pub(super) fn column(&self, place: usize) -> &[f64] {
        &self.entries[place * self.rows..(place + 1) * self.rows]
    }

    /// Factor that scales a column of `A` to unit length.
    pub(super) fn column_scale(&self, column: usize) -> f64 {
        self.scale[column]
    }
}
