//! The rank-safe engine, and the plain twin of every faster one.

use super::{BlockCholesky, Health, KktSolver, KktStructure, LinalgError, PivotedQr, add_scaled, check_length, dot};

/// Dense null space method in the metric of the mass matrix.
///
/// With `M = L L^T`, `b = L^T a`, `B = L^-1 J^T` (`n x m`), `h = L^-1 f` the system reads
/// `b + B lambda = h`, `B^T b = g`: `b` is the point nearest to `h` on the plane
/// `B^T b = g`. The QR factorisation `B D P = Q [R11 R12; 0 0]` gives
///
/// ```text
/// R11^T c = (P^T D g)_1        b = Q [c; (Q^T h)_2]        L^T a = b
/// R11 z = (Q^T h)_1 - c        lambda = D P [z; 0]
/// ```
///
/// Dependent rows get a multiplier of zero and are not enforced; they hold by themselves if
/// `g` is consistent, which [`DenseQr::dependent_residuals`] checks. `a` is unique whatever
/// the rank. Cost: `O(n m^2)`.
#[derive(Debug, Clone)]
pub struct DenseQr {
    structure: KktStructure,
    mass: BlockCholesky,
    qr: PivotedQr,
    /// Mass block and constraint row, for each pair that shares an entry of `J`.
    touched: Vec<(usize, usize)>,
    /// `J b - g` of the dependent rows, by place behind the rank.
    residuals: Vec<f64>,
    /// Scratch of length `n`: `h`, then `b`.
    work: Vec<f64>,
    /// Scratch of length `n`: `c`.
    constrained: Vec<f64>,
}

impl DenseQr {
    /// Prepares the engine; `tolerance` as in [`PivotedQr::new`].
    ///
    /// # Errors
    /// [`LinalgError::Pattern`].
    pub fn new(structure: &KktStructure, tolerance: f64) -> Result<Self, LinalgError> {
        structure.validate()?;
        let mass = BlockCholesky::new(structure.n, &structure.mass);
        let mut block_of = vec![0; structure.n];
        for block in 0..mass.block_count() {
            for &unknown in mass.unknowns(block) {
                block_of[unknown] = block;
            }
        }
        let mut touched: Vec<(usize, usize)> =
            structure.jacobian.iter().map(|&(row, column)| (block_of[column], row)).collect();
        touched.sort_unstable();
        touched.dedup();
        Ok(Self {
            mass,
            qr: PivotedQr::new(structure.n, structure.m, tolerance),
            touched,
            residuals: vec![0.0; structure.m],
            work: vec![0.0; structure.n],
            constrained: vec![0.0; structure.n],
            structure: structure.clone(),
        })
    }

    /// Names the rows to keep where rows depend on each other, see
    /// [`PivotedQr::set_first_group`]. Takes effect with the next `refactor`.
    ///
    /// # Errors
    /// [`LinalgError::Pattern`] for a row out of range.
    pub fn set_first_rows(&mut self, rows: &[usize]) -> Result<(), LinalgError> {
        self.qr.set_first_group(rows)
    }

    /// Finds at most this many independent rows, from the next `refactor` on. Rows that depend on others on their
    /// manifold seem independent, by as little as the distance, off it.
    pub fn set_rank_limit(&mut self, limit: usize) {
        self.qr.set_rank_limit(limit);
    }

    /// Judges each row of `J` by the length given for it in the metric of `M^-1`, instead of its own, see
    /// [`PivotedQr::set_lengths`].
    ///
    /// # Errors
    /// A slice of the wrong length.
    pub fn set_row_lengths(&mut self, lengths: &[f64]) -> Result<(), LinalgError> {
        self.qr.set_lengths(lengths)
    }

    /// Rows of `J` found independent, in pivot order.
    pub fn independent_rows(&self) -> &[usize] {
        self.qr.independent_columns()
    }

    /// Rows of `J` that depend on the independent ones.
    pub fn dependent_rows(&self) -> &[usize] {
        self.qr.dependent_columns()
    }

    /// Largest remainder among the dependent rows, see [`PivotedQr::largest_dropped_ratio`].
    pub fn largest_dropped_ratio(&self) -> f64 {
        self.qr.largest_dropped_ratio()
    }

    /// Basis of `J^T lambda = 0`: `m x (m - rank)`, column-major; vector `k` has a one on
    /// dependent row `k`. See [`PivotedQr::null_space`]. `[report]`, allocates.
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`].
    pub fn null_space(&self) -> Result<Vec<f64>, LinalgError> {
        self.qr.null_space()
    }

    /// For each row, whether its multiplier is not determined by the system. `tolerance` as in
    /// [`PivotedQr::free_unknowns`]. `[report]`, allocates.
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`].
    pub fn non_unique_multipliers(&self, tolerance: f64) -> Result<Vec<bool>, LinalgError> {
        self.qr.free_unknowns(tolerance)
    }

    /// `J a - g` of each row in [`DenseQr::dependent_rows`] after the last solve, in the unit
    /// of `g`: zero up to round-off unless the constraints contradict each other.
    pub fn dependent_residuals(&self) -> &[f64] {
        &self.residuals[..self.qr.dependent_columns().len()]
    }

    /// Largest of [`DenseQr::dependent_residuals`], each row scaled to unit length in the
    /// metric of the mass matrix, and relative to the length of the enforced part of `g`
    /// scaled likewise (or absolute, if that is zero).
    pub fn consistency_residual(&self) -> f64 {
        let largest = self
            .dependent_rows()
            .iter()
            .zip(&self.residuals)
            .map(|(&row, &residual)| (residual * self.qr.column_scale(row)).abs())
            .fold(0.0, f64::max);
        let enforced = super::two_norm(&self.constrained[..self.qr.rank()]);
        if enforced > 0.0 { largest / enforced } else { largest }
    }
}

impl KktSolver for DenseQr {
    fn set_mass(&mut self, values: &[f64]) -> Result<(), LinalgError> {
        self.qr.invalidate();
        self.mass.factor(values)
    }

    fn refactor(&mut self, jacobian: &[f64]) -> Result<Health, LinalgError> {
        check_length("jacobian", self.structure.jacobian.len(), jacobian.len())?;
        if !self.mass.is_factored() {
            return Err(LinalgError::NotFactored);
        }
        // B = L^-1 J^T
        let n = self.structure.n;
        let columns = self.qr.entries_mut();
        columns.fill(0.0);
        for (&(row, column), &value) in self.structure.jacobian.iter().zip(jacobian) {
            columns[column + n * row] = value;
        }
        for &(block, row) in &self.touched {
            self.mass.solve_lower_block(block, &mut columns[n * row..n * (row + 1)]);
        }
        self.qr.factor()?;
        Ok(Health { rank: self.qr.rank(), smallest_pivot_ratio: self.qr.smallest_pivot_ratio() })
    }

    fn solve(&mut self, f: &[f64], g: &[f64], a: &mut [f64], lambda: &mut [f64]) -> Result<(), LinalgError> {
        self.qr.check_factored()?;
        check_length("f", self.structure.n, f.len())?;
        check_length("g", self.structure.m, g.len())?;
        check_length("a", self.structure.n, a.len())?;
        check_length("lambda", self.structure.m, lambda.len())?;
        let rank = self.qr.rank();

        // Q^T h
        self.work.copy_from_slice(f);
        self.mass.solve_lower(&mut self.work);
        self.qr.apply_q_transposed(&mut self.work);

        // R11^T c = (P^T D g)_1, and what the dependent rows make of c
        self.qr.solve_independent_transposed(g, &mut self.constrained);
        for (k, &row) in self.qr.dependent_columns().iter().enumerate() {
            let entries = &self.qr.column(rank + k)[..rank];
            let value = dot(entries, &self.constrained[..rank]);
            self.residuals[k] = value / self.qr.column_scale(row) - g[row];
        }

        // R11 z = (Q^T h)_1 - c
        add_scaled(&mut self.work[..rank], -1.0, &self.constrained[..rank]);
        self.qr.solve_independent(&self.work, lambda);

        // L^T a = Q [c; (Q^T h)_2]
        self.work[..rank].copy_from_slice(&self.constrained[..rank]);
        self.qr.apply_q(&mut self.work);
        self.mass.solve_upper(&mut self.work);
        a.copy_from_slice(&self.work);
        Ok(())
    }

    fn name(&self) -> &'static str {
        "dense_qr"
    }
}
