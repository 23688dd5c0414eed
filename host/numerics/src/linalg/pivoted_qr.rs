//! Householder QR with column pivoting for matrices of unknown rank, dense or sparse.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::{LinalgError, check_length, two_norm};

mod sparse;
mod stored;
mod whole;

use stored::Stored;

/// A column whose length is at or below this share of the longest one is taken as zero: it
/// consists of round-off, and scaling it to unit length would invent a direction.
const NEGLIGIBLE_COLUMN: f64 = 1e-14;

/// Share of a column that has to be left for it to be taken, in sparse storage, for the few entries that it has; and share of the
/// largest remainder, where less is left of all. The nearer to one, the more surely rows that depend on others, but for the distance
/// from their manifold, come last.
const CLEARLY_INDEPENDENT: f64 = 1e-3;
const NEARLY_AS_LARGE: f64 = 0.5;

/// Cost of a dense factorisation, rows times squared columns, from which on, and entries, as a share of all, up to which what is
/// zero is not stored.
const HEAVY: f64 = 2e6;
const FEW_ENTRIES: f64 = 0.1;

/// `S A D P = Q R` of a matrix `A` (`rows x columns`).
///
/// `D` scales every column to unit length, `P` puts the column with the largest remainder
/// first (Businger & Golub 1965), and the factorisation stops where every remainder is at or
/// below the tolerance: that is the rank. Remainders are down-dated, and recomputed where
/// cancellation would spoil them, after Drmac & Bujanovic (ACM TOMS 35, 2008; LAPACK dgeqp3).
/// `S` orders rows so that the errors of each are round-off of that row, however much rows differ in size.
///
/// With sparse storage, of the columns that are clearly independent, and then of those with nearly the largest remainder, the one
/// with the fewest entries left is taken, as in sparse LU factorisations (Duff, Erisman & Reid 1986, section 5.4).
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
    stored: Stored,
    /// Factor of each reflector `I - tau v v^T`.
    tau: Vec<f64>,
    /// Lengths that columns are scaled by; their own where empty.
    lengths: Vec<f64>,
    /// `D`, by column of `A`.
    scale: Vec<f64>,
    /// `P`: column of `A` at each place.
    order: Vec<usize>,
    /// The inverse of it.
    place: Vec<usize>,
    /// Columns of the second and of the first group that may be clearly independent, with the entries that they had in open rows when
    /// they were last changed.
    cheap: [BinaryHeap<Reverse<(usize, usize)>>; 2],
    /// Length of what remains of each column, down-dated.
    remainder: Vec<f64>,
    /// The same when it was last computed from the entries.
    remainder_computed: Vec<f64>,
    rank: usize,
    smallest_pivot: f64,
    largest_dropped: f64,
    factored: bool,
    /// Columns that the last reflector changed, with what it left in its row.
    changed: Vec<(usize, f64)>,
    /// Scratch of length `rows`, and of length `columns`.
    tall: Vec<f64>,
    wide: Vec<f64>,
}

impl PivotedQr {
    /// Dense storage for matrices of one size; `tolerance` is the share of the largest pivot at or
    /// below which a remainder counts as zero, see [`super::DEFAULT_RANK_TOLERANCE`].
    pub fn new(rows: usize, columns: usize, tolerance: f64) -> Self {
        Self::stored(rows, columns, tolerance, Stored::whole(rows, columns))
    }

    /// As [`PivotedQr::new`], for matrices with few entries: what a factorisation costs goes with the entries of `R`.
    pub fn sparse(rows: usize, columns: usize, tolerance: f64) -> Self {
        Self::stored(rows, columns, tolerance, Stored::sparse(rows, columns))
    }

    /// Whichever of the two costs less for matrices with so many entries.
    pub fn with_entries(rows: usize, columns: usize, entries: usize, tolerance: f64) -> Self {
        let whole = rows as f64 * columns as f64;
        let is_sparse = whole * columns as f64 >= HEAVY && entries as f64 <= FEW_ENTRIES * whole;
        if is_sparse { Self::sparse(rows, columns, tolerance) } else { Self::new(rows, columns, tolerance) }
    }

    fn stored(rows: usize, columns: usize, tolerance: f64, stored: Stored) -> Self {
        Self {
            rows,
            columns,
            tolerance,
            rank_limit: usize::MAX,
            in_first_group: vec![true; columns],
            stored,
            tau: vec![0.0; rows.min(columns)],
            lengths: Vec::new(),
            scale: vec![1.0; columns],
            order: (0..columns).collect(),
            place: (0..columns).collect(),
            cheap: Default::default(),
            remainder: vec![0.0; columns],
            remainder_computed: vec![0.0; columns],
            rank: 0,
            smallest_pivot: 1.0,
            largest_dropped: 0.0,
            factored: false,
            changed: Vec::new(),
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

    /// Begins a matrix without entries, to be filled by [`PivotedQr::set`] and consumed by [`PivotedQr::factor`]. A large matrix
    /// that is never begun takes no memory.
    pub fn clear(&mut self) {
        self.factored = false;
        self.stored.clear();
    }

    /// Sets an entry of `A`, each once.
    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.stored.set(row, column, value);
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

    /// Factors what was filled in since [`PivotedQr::clear`].
    ///
    /// # Errors
    /// [`LinalgError::NotFinite`]; [`LinalgError::NotFactored`] if the matrix was not filled
    /// anew. A rank below `columns` is a finding, not an error.
    pub fn factor(&mut self) -> Result<(), LinalgError> {
        if self.factored {
            return Err(LinalgError::NotFactored);
        }
        self.scale_columns()?;
        self.stored.begin();
        self.cheap.iter_mut().for_each(BinaryHeap::clear);
        (0..self.columns).for_each(|column| self.offer(column));
        self.rank = 0;
        (self.smallest_pivot, self.largest_dropped) = (1.0, 0.0);

        // Columns have length one (or zero) unless lengths were given, so the largest pivot is one too, or near one.
        while self.rank < self.rows.min(self.columns).min(self.rank_limit) {
            let k = self.rank;
            let Some(place) = self.choose_pivot(k) else {
                break;
            };
            let column = self.order[place];
            let length = self.length(column, k);
            if length <= self.tolerance {
                // The down-dated length was too optimistic; look again with the true one.
                self.remainder[column] = length;
                self.remainder_computed[column] = length;
                continue;
            }
            self.order.swap(k, place);
            (self.place[column], self.place[self.order[place]]) = (k, place);
            self.reflect(k, length);
            self.smallest_pivot = self.smallest_pivot.min(length);
            self.rank += 1;
        }
        let rank = self.rank;
        let dropped = self.dependent_columns().iter().map(|column| self.length(*column, rank));
        self.largest_dropped = dropped.fold(self.largest_dropped, f64::max);
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
            let value = self.product(rank, column, &x[..rank]);
            miss = miss.max((value - self.scale[column] * g[column]).abs());
        }
        self.apply_q(x);
        Ok(miss)
    }

    /// Basis of `A y = 0`: `columns x (columns - rank)`, column-major. Vector `k` has a one on
    /// dependent column `k`, and zeros on the other dependent columns, so it shows how that
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
            let dependent = self.order[self.rank + k];
            let mut z = vec![0.0; self.rank];
            self.add(self.rank, dependent, 1.0, &mut z);
            self.solve_r11(&mut z);
            let vector = &mut basis[k * self.columns..(k + 1) * self.columns];
            for (&column, &value) in self.order.iter().zip(&z) {
                vector[column] = -value * self.scale[column] / self.scale[dependent];
            }
            vector[dependent] = 1.0;
        }
        Ok(basis)
    }

    /// Orthonormal basis of `A^T x = 0`: `rows x (rows - rank)`, column-major. `[report]`, allocates.
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`].
    pub fn complement(&mut self) -> Result<Vec<f64>, LinalgError> {
        self.check_factored()?;
        let mut basis = vec![0.0; self.rows * (self.rows - self.rank)];
        for k in self.rank..self.rows {
            let at = (k - self.rank) * self.rows;
            basis[at + k] = 1.0;
            self.apply_q(&mut basis[at..at + self.rows]);
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
        self.stored.apply_q(&self.order[..self.rank], &self.tau, x);
    }

    /// `x := Q^T S x` (`x`: `rows`).
    pub(super) fn apply_q_transposed(&mut self, x: &mut [f64]) {
        self.stored.apply_q_transposed(&self.order[..self.rank], &self.tau, x);
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
            let known = self.product(k, column, &x[..k]);
            x[k] = (self.scale[column] * g[column] - known) / self.diagonal(k);
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
            let length = self.length(column, 0);
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
            if negligible {
                self.stored.vanish(column);
            } else {
                self.stored.divide(column, unit);
            }
            self.scale[column] = if negligible { 1.0 } else { 1.0 / unit };
            self.remainder[column] = if negligible { 0.0 } else { length / unit };
            self.remainder_computed[column] = self.remainder[column];
            (self.order[column], self.place[column]) = (column, column);
        }
        Ok(())
    }

    /// Place of the column to take next, first group first; `None` if no remainder is above the tolerance.
    fn choose_pivot(&mut self, k: usize) -> Option<usize> {
        [true, false].into_iter().find_map(|first_group| {
            let cheap = self.cheapest(k, first_group);
            cheap.or_else(|| {
                let places =
                    || (k..self.columns).filter(|place| self.in_first_group[self.order[*place]] == first_group);
                let largest = self.largest(places())?;
                let Stored::Sparse(stored) = &self.stored else { return Some(largest) };
                let enough = NEARLY_AS_LARGE * self.remainder[self.order[largest]];
                let nearly = places().filter(|place| self.remainder[self.order[*place]] > enough.max(self.tolerance));
                nearly.min_by_key(|place| (stored.entries_left(self.order[*place]), self.order[*place]))
            })
        })
    }

    /// Of the columns of a group that are clearly independent, in sparse storage, the place of the one with the fewest entries.
    fn cheapest(&mut self, k: usize, first_group: bool) -> Option<usize> {
        let Stored::Sparse(stored) = &self.stored else { return None };
        let cheap = &mut self.cheap[usize::from(first_group)];
        while let Some(Reverse((entries, column))) = cheap.peek() {
            let place = self.place[*column];
            if place >= k && *entries == stored.entries_left(*column) && self.remainder[*column] >= CLEARLY_INDEPENDENT
            {
                return Some(place);
            }
            cheap.pop();
        }
        None
    }

    /// Leaves out, in sparse storage, what is left of a column that cannot be taken: it depends on those before it but for round-off,
    /// which would go through the rest of the factorisation with an entry in ever more rows.
    fn give_up(&mut self, column: usize) {
        let Stored::Sparse(stored) = &mut self.stored else { return };
        let most = if self.in_first_group[column] { self.tolerance } else { self.tolerance.max(NEGLIGIBLE_COLUMN) };
        if self.remainder[column] <= most {
            self.largest_dropped = self.largest_dropped.max(self.remainder[column]);
            stored.give_up(column);
        }
    }

    /// Puts a column among the cheap ones, with the entries that it has now.
    fn offer(&mut self, column: usize) {
        if let Stored::Sparse(stored) = &self.stored
            && self.remainder[column] >= CLEARLY_INDEPENDENT
        {
            let group = usize::from(self.in_first_group[column]);
            self.cheap[group].push(Reverse((stored.entries_left(column), column)));
        }
    }

    /// The first of the places with the largest remainder above the tolerance.
    fn largest(&self, places: impl Iterator<Item = usize>) -> Option<usize> {
        let (mut best, mut best_length) = (None, self.tolerance);
        for place in places {
            let length = self.remainder[self.order[place]];
            if length > best_length {
                (best, best_length) = (Some(place), length);
            }
        }
        best
    }

    /// Annihilates the column at place `k` below its diagonal and updates those to its right.
    fn reflect(&mut self, k: usize, length: f64) {
        let mut changed = std::mem::take(&mut self.changed);
        changed.clear();
        let (column, remaining) = (self.order[k], &self.order[k + 1..]);
        self.tau[k] = self.stored.reflect((k, column), length, remaining, &mut changed);
        for (column, head) in &changed {
            self.down_date(*column, k, *head);
            self.offer(*column);
            self.give_up(*column);
        }
        self.changed = changed;
    }

    /// Takes what a reflector left in row `k` off the length of what remains of a column.
    fn down_date(&mut self, column: usize, k: usize, head: f64) {
        let old = self.remainder[column];
        if old == 0.0 {
            return;
        }
        let share = (head / old).abs();
        let left_over = (1.0 - share * share).max(0.0);
        let since_computed = old / self.remainder_computed[column];
        if left_over * since_computed * since_computed <= f64::EPSILON.sqrt() {
            self.remainder[column] = self.length(column, k + 1);
            self.remainder_computed[column] = self.remainder[column];
        } else {
            self.remainder[column] = old * left_over.sqrt();
        }
    }

    /// `z := R11^-1 z` (`z`: `rank`).
    fn solve_r11(&self, z: &mut [f64]) {
        for k in (0..self.rank).rev() {
            z[k] /= self.diagonal(k);
            let value = z[k];
            self.add(k, self.order[k], -value, z);
        }
    }

    /// Length of what remains of a column below row `k`.
    fn length(&self, column: usize, k: usize) -> f64 {
        self.stored.length(column, k)
    }

    /// Diagonal entry of `R`.
    pub(super) fn diagonal(&self, k: usize) -> f64 {
        self.stored.diagonal(k, self.order[k])
    }

    /// Product of the first `k` entries of a column of `R`, those above its diagonal or in all rows of `R11`, with a vector.
    pub(super) fn product(&self, k: usize, column: usize, x: &[f64]) -> f64 {
        self.stored.product(k, column, x)
    }

    /// `x += factor` times the same entries.
    pub(super) fn add(&self, k: usize, column: usize, factor: f64, x: &mut [f64]) {
        self.stored.add(k, column, factor, x);
    }

    /// Factor that scales a column of `A` to unit length.
    pub(super) fn column_scale(&self, column: usize) -> f64 {
        self.scale[column]
    }
}
