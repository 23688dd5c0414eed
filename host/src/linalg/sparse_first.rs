//! The sparse engine where it can be trusted, the rank-safe one where not.

use super::{Clusters, DenseQr, Health, KktSolver, KktStructure, LinalgError, SparseLdl};

/// Pivot ratio of the sparse engine from which its rows count as independent beyond doubt.
pub const TRUSTED: f64 = 1e-6;

/// Solves with [`SparseLdl`] as long as its pivots say that all rows are independent, otherwise with [`DenseQr`], which
/// costs `O(n m^2)` and is made when it is first needed. Both give the same result where both can.
pub struct SparseFirst {
    structure: KktStructure,
    mass: Vec<f64>,
    sparse: SparseLdl,
    dense: Option<DenseQr>,
    tolerance: f64,
    first_rows: Option<Vec<usize>>,
    uses_dense: bool,
}

impl SparseFirst {
    /// Analyses the structure; `tolerance` is the rank tolerance of the dense engine.
    ///
    /// # Errors
    /// [`LinalgError::Pattern`].
    pub fn new(structure: &KktStructure, clusters: &Clusters, tolerance: f64) -> Result<Self, LinalgError> {
        Ok(Self {
            structure: structure.clone(),
            mass: Vec::new(),
            sparse: SparseLdl::with_computed_order(structure, Some(clusters))?,
            dense: None,
            tolerance,
            first_rows: None,
            uses_dense: false,
        })
    }

    /// Names the rows to keep where rows depend on each other: see [`DenseQr::set_first_rows`].
    pub fn set_first_rows(&mut self, rows: &[usize]) {
        self.first_rows = Some(rows.to_vec());
    }

    /// Whether the values factored last are left to the dense engine.
    #[must_use]
    pub fn uses_dense(&self) -> bool {
        self.uses_dense
    }

    fn dense(&mut self) -> Result<&mut DenseQr, LinalgError> {
        if self.dense.is_none() {
            let mut dense = DenseQr::new(&self.structure, self.tolerance)?;
            dense.set_mass(&self.mass)?;
            if let Some(rows) = &self.first_rows {
                dense.set_first_rows(rows)?;
            }
            self.dense = Some(dense);
        }
        self.dense.as_mut().ok_or(LinalgError::NotFactored)
    }
}

impl KktSolver for SparseFirst {
    fn set_mass(&mut self, values: &[f64]) -> Result<(), LinalgError> {
        self.mass = values.to_vec();
        self.dense = None;
        self.sparse.set_mass(values)
    }

    fn refactor(&mut self, jacobian: &[f64]) -> Result<Health, LinalgError> {
        let sparse = self.sparse.refactor(jacobian);
        self.uses_dense = !matches!(&sparse, Ok(health) if health.smallest_pivot_ratio >= TRUSTED);
        if self.uses_dense { self.dense()?.refactor(jacobian) } else { sparse }
    }

    fn solve(&mut self, f: &[f64], g: &[f64], a: &mut [f64], lambda: &mut [f64]) -> Result<(), LinalgError> {
        if self.uses_dense { self.dense()?.solve(f, g, a, lambda) } else { self.sparse.solve(f, g, a, lambda) }
    }

    fn name(&self) -> &'static str {
        "sparse_first"
    }
}
