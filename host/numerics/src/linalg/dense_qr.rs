//! The rank-safe engine, and the plain twin of every faster one.

use super::{BlockCholesky, Health, KktSolver, KktStructure, LinalgError, PivotedQr, add_scaled, check_length};

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
/// the rank. Cost: `O(n m^2)`; in large systems with few entries that of the entries of `R`, see [`PivotedQr::sparse`].
///
/// Which rows are independent is a question about `J` alone, whatever the masses: with
/// [`DenseQr::set_measure`] a factorisation of `J` with scaled columns answers it, and the one
/// above takes the independent rows as they are, however close to dependent they look in the
/// metric of `M^-1`. Where masses differ by decades, `Q` spreads round-off of heavy unknowns over
/// light ones; one step of refinement takes that away.
#[derive(Debug, Clone)]
pub struct DenseQr {
    structure: KktStructure,
    mass: BlockCholesky,
    qr: PivotedQr,
    tolerance: f64,
    measure: Option<Measure>,
    /// Values of `M`, and of `J` factored last.
    values: (Vec<f64>, Vec<f64>),
    /// Constraint row and mass block, for each pair that shares an entry of `J`.
    touched: Vec<(usize, usize)>,
    /// `J a - g` of the dependent rows, by row.
    residuals: Vec<f64>,
    /// Scratch of length `n`: `h`, then `b`.
    work: Vec<f64>,
    /// Scratch of length `n`: `c`.
    constrained: Vec<f64>,
    /// Scratch of three times `n + m`, for refinement.
    room: Vec<f64>,
}

/// Where ranks are decided without the mass.
#[derive(Debug, Clone)]
struct Measure {
    /// Factor of each column of `J`.
    scales: Vec<f64>,
    qr: PivotedQr,
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
            structure.jacobian.iter().map(|&(row, column)| (row, block_of[column])).collect();
        touched.sort_unstable();
        touched.dedup();
        let entries = touched.iter().map(|(_, block)| mass.unknowns(*block).len()).sum();
        Ok(Self {
            mass,
            qr: PivotedQr::with_entries(structure.n, structure.m, entries, tolerance),
            tolerance,
            measure: None,
            values: (vec![0.0; structure.mass.len()], vec![0.0; structure.jacobian.len()]),
            touched,
            residuals: vec![0.0; structure.m],
            work: vec![0.0; structure.n],
            constrained: vec![0.0; structure.n],
            room: vec![0.0; 3 * (structure.n + structure.m)],
            structure: structure.clone(),
        })
    }

    /// Decides ranks on `J` with each column multiplied by its scale, instead of in the metric of `M^-1`. Scales make
    /// columns comparable: where all unknowns move things by a length, times their scale, what is found has no unit and
    /// depends on no mass. To be called before the settings below.
    ///
    /// # Errors
    /// A slice of the wrong length.
    pub fn set_measure(&mut self, scales: &[f64]) -> Result<(), LinalgError> {
        check_length("scales", self.structure.n, scales.len())?;
        let (structure, tolerance) = (&self.structure, self.tolerance);
        let qr = PivotedQr::with_entries(structure.n, structure.m, structure.jacobian.len(), tolerance);
        self.measure = Some(Measure { scales: scales.to_vec(), qr });
        self.qr.set_tolerance(0.0);
        Ok(())
    }

    /// The factorisation that decides about ranks.
    fn ranks(&self) -> &PivotedQr {
        self.measure.as_ref().map_or(&self.qr, |measure| &measure.qr)
    }

    fn ranks_mut(&mut self) -> &mut PivotedQr {
        self.measure.as_mut().map_or(&mut self.qr, |measure| &mut measure.qr)
    }

    /// Names the rows to keep where rows depend on each other, see
    /// [`PivotedQr::set_first_group`]. Takes effect with the next `refactor`.
    ///
    /// # Errors
    /// [`LinalgError::Pattern`] for a row out of range.
    pub fn set_first_rows(&mut self, rows: &[usize]) -> Result<(), LinalgError> {
        self.ranks_mut().set_first_group(rows)
    }

    /// Finds at most this many independent rows, from the next `refactor` on. Rows that depend on others on their
    /// manifold seem independent, by as little as the distance, off it.
    pub fn set_rank_limit(&mut self, limit: usize) {
        self.ranks_mut().set_rank_limit(limit);
    }

    /// Judges each row of `J` by the length given for it, in the metric in which ranks are decided, instead of its own: see
    /// [`PivotedQr::set_lengths`].
    ///
    /// # Errors
    /// A slice of the wrong length.
    pub fn set_row_lengths(&mut self, lengths: &[f64]) -> Result<(), LinalgError> {
        self.ranks_mut().set_lengths(lengths)
    }

    /// Rows of `J` found independent, in pivot order.
    pub fn independent_rows(&self) -> &[usize] {
        self.ranks().independent_columns()
    }

    /// Rows of `J` that depend on the independent ones.
    pub fn dependent_rows(&self) -> &[usize] {
        self.ranks().dependent_columns()
    }

    /// Largest remainder among the dependent rows, see [`PivotedQr::largest_dropped_ratio`].
    pub fn largest_dropped_ratio(&self) -> f64 {
        self.ranks().largest_dropped_ratio()
    }

    /// Basis of `J^T lambda = 0`: `m x (m - rank)`, column-major; vector `k` has a one on
    /// dependent row `k`. See [`PivotedQr::null_space`]. `[report]`, allocates.
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`].
    pub fn null_space(&self) -> Result<Vec<f64>, LinalgError> {
        self.ranks().null_space()
    }

    /// For each row, whether its multiplier is not determined by the system. `tolerance` as in
    /// [`PivotedQr::free_unknowns`]. `[report]`, allocates.
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`].
    pub fn non_unique_multipliers(&self, tolerance: f64) -> Result<Vec<bool>, LinalgError> {
        self.ranks().free_unknowns(tolerance)
    }

    /// `J a - g` of each row in [`DenseQr::dependent_rows`] after the last solve, in the unit
    /// of `g`: zero up to round-off unless the constraints contradict each other. `[report]`, allocates.
    pub fn dependent_residuals(&self) -> Vec<f64> {
        self.dependent_rows().iter().map(|&row| self.residuals[row]).collect()
    }

    /// Largest of [`DenseQr::dependent_residuals`], each row scaled to unit length in the
    /// metric of the mass matrix, and relative to the length of the enforced part of `g`
    /// scaled likewise (or absolute, if that is zero).
    pub fn consistency_residual(&self) -> f64 {
        let size = |&row: &usize| (self.residuals[row] * self.qr.column_scale(row)).abs();
        let largest = self.dependent_rows().iter().map(size).fold(0.0, f64::max);
        let enforced = super::two_norm(&self.constrained[..self.qr.rank()]);
        if enforced > 0.0 { largest / enforced } else { largest }
    }

    /// One solution with the factors in force.
    fn solve_once(&mut self, f: &[f64], g: &[f64], a: &mut [f64], lambda: &mut [f64]) {
        let rank = self.qr.rank();

        // Q^T h
        self.work.copy_from_slice(f);
        self.mass.solve_lower(&mut self.work);
        self.qr.apply_q_transposed(&mut self.work);

        // R11^T c = (P^T D g)_1, and what the dependent rows make of c
        self.qr.solve_independent_transposed(g, &mut self.constrained);
        for &row in self.qr.dependent_columns() {
            let value = self.qr.product(rank, row, &self.constrained[..rank]);
            self.residuals[row] = value / self.qr.column_scale(row) - g[row];
        }

        // R11 z = (Q^T h)_1 - c
        add_scaled(&mut self.work[..rank], -1.0, &self.constrained[..rank]);
        self.qr.solve_independent(&self.work, lambda);

        // L^T a = Q [c; (Q^T h)_2]
        self.work[..rank].copy_from_slice(&self.constrained[..rank]);
        self.qr.apply_q(&mut self.work);
        self.mass.solve_upper(&mut self.work);
        a.copy_from_slice(&self.work);
    }

    /// Factors `B` with the rows in use.
    fn factor(&mut self) -> Result<(), LinalgError> {
        // B = L^-1 J^T
        self.qr.clear();
        self.work.fill(0.0);
        let mut touched = self.touched.iter().peekable();
        let mut entries = self.structure.jacobian.iter().zip(&self.values.1).peekable();
        for row in 0..self.structure.m {
            while let Some((&(_, column), &value)) = entries.next_if(|((own, _), _)| *own == row) {
                self.work[column] = value;
            }
            while let Some(&(_, block)) = touched.next_if(|(own, _)| *own == row) {
                self.mass.solve_lower_block(block, &mut self.work);
                for &unknown in self.mass.unknowns(block) {
                    self.qr.set(unknown, row, std::mem::take(&mut self.work[unknown]));
                }
            }
        }
        if let Some(measure) = &self.measure {
            self.qr.set_rank_limit(measure.qr.rank());
            self.qr.set_first_group(measure.qr.independent_columns())?;
        }
        self.qr.factor()
    }
}

impl KktSolver for DenseQr {
    fn set_mass(&mut self, values: &[f64]) -> Result<(), LinalgError> {
        self.qr.invalidate();
        if let Some(measure) = &mut self.measure {
            measure.qr.invalidate();
        }
        self.mass.factor(values)?;
        self.values.0.copy_from_slice(values);
        Ok(())
    }

    fn refactor(&mut self, jacobian: &[f64]) -> Result<Health, LinalgError> {
        check_length("jacobian", self.structure.jacobian.len(), jacobian.len())?;
        if !self.mass.is_factored() {
            return Err(LinalgError::NotFactored);
        }
        self.qr.invalidate();
        self.values.1.copy_from_slice(jacobian);
        match &mut self.measure {
            None => self.factor()?,
            Some(Measure { scales, qr }) => {
                qr.clear();
                for (&(row, column), &value) in self.structure.jacobian.iter().zip(jacobian) {
                    qr.set(column, row, value * scales[column]);
                }
                qr.factor()?;
            }
        }
        Ok(Health { rank: self.ranks().rank(), smallest_pivot_ratio: self.ranks().smallest_pivot_ratio() })
    }

    fn solve(&mut self, f: &[f64], g: &[f64], a: &mut [f64], lambda: &mut [f64]) -> Result<(), LinalgError> {
        self.ranks().check_factored()?;
        check_length("f", self.structure.n, f.len())?;
        check_length("g", self.structure.m, g.len())?;
        check_length("a", self.structure.n, a.len())?;
        check_length("lambda", self.structure.m, lambda.len())?;
        // Where only a rank is asked for, nothing more is done.
        if self.qr.check_factored().is_err() {
            self.factor()?;
        }
        self.solve_once(f, g, a, lambda);
        if self.measure.is_some() {
            let (n, size) = (self.structure.n, self.structure.n + self.structure.m);
            let mut room = std::mem::take(&mut self.room);
            let (left, rest) = room.split_at_mut(size);
            let (sizes, found) = rest.split_at_mut(size);
            self.structure.residual((&self.values.0, &self.values.1), (f, g), (a, lambda), [&mut *left, sizes]);
            let (more, further) = found.split_at_mut(n);
            self.solve_once(&left[..n], &left[n..], more, further);
            a.iter_mut().zip(&*more).for_each(|(x, by)| *x += by);
            lambda.iter_mut().zip(&*further).for_each(|(x, by)| *x += by);
            self.room = room;
        }
        Ok(())
    }

    fn name(&self) -> &'static str {
        "dense_qr"
    }
}
