//! The sparse engine where it can be trusted, the rank-safe one where not.

use super::{Clusters, DenseQr, Health, KktSolver, KktStructure, LinalgError, SparseLdl, SparseRank};

/// Pivot ratio of the sparse engine from which its rows count as independent beyond doubt.
pub const TRUSTED: f64 = 1e-6;

/// Cost of a dense factorisation, columns times squared rows, up to which it takes no time: some milliseconds.
pub const LIGHT: f64 = 2e7;
/// Rows that depend on others must be met by themselves to this share of what they are made of.
const MET: f64 = 1e-10;

/// Solves with [`SparseLdl`] as long as its pivots say that all rows are independent, otherwise with [`DenseQr`], which
/// costs `O(n m^2)` and is made when it is first needed. Where that would take long, [`SparseRank`] chooses rows for
/// [`SparseLdl`] first; the choice makes no difference as long as the other rows are met too, and if they are not, the
/// dense engine decides. All give the same result where they can.
pub struct SparseFirst {
    structure: KktStructure,
    clusters: Clusters,
    mass: Vec<f64>,
    jacobian: Vec<f64>,
    sparse: SparseLdl,
    dense: Option<DenseQr>,
    chosen: Option<Chosen>,
    tolerance: f64,
    scales: Option<Vec<f64>>,
    light: f64,
    first_rows: Option<Vec<usize>>,
    uses_dense: bool,
    few_rows: bool,
}

/// Independent rows, and the engine for them.
struct Chosen {
    rank: SparseRank,
    sparse: SparseLdl,
    g: Vec<f64>,
    lambda: Vec<f64>,
}

impl SparseFirst {
    /// Analyses the structure; `tolerance` is the rank tolerance of the dense engine.
    ///
    /// # Errors
    /// [`LinalgError::Pattern`].
    pub fn new(structure: &KktStructure, clusters: &Clusters, tolerance: f64) -> Result<Self, LinalgError> {
        Ok(Self {
            structure: structure.clone(),
            clusters: clusters.clone(),
            mass: Vec::new(),
            jacobian: Vec::new(),
            sparse: SparseLdl::with_computed_order(structure, Some(clusters))?,
            dense: None,
            chosen: None,
            tolerance,
            scales: None,
            light: LIGHT,
            first_rows: None,
            uses_dense: false,
            few_rows: false,
        })
    }

    /// Whether rows that depend on the chosen ones may be left unmet: right sides of Newton's method contradict each other by the
    /// square of what is left to go. `false` if not called.
    pub fn enforce_few_rows(&mut self, few: bool) {
        self.few_rows = few;
    }

    /// Decides ranks without the mass: see [`DenseQr::set_measure`].
    pub fn set_measure(&mut self, scales: &[f64]) {
        self.scales = Some(scales.to_vec());
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

    /// Sets the cost up to which the dense engine is called without trying anything else; [`LIGHT`] if not called.
    pub fn set_light(&mut self, cost: f64) {
        self.light = cost;
    }

    /// Rows that sparse elimination finds independent, where dense factorisation would take long.
    fn choose(&mut self, jacobian: &[f64]) -> Result<Option<Chosen>, LinalgError> {
        let (n, m) = (self.structure.n as f64, self.structure.m as f64);
        if n * m * m <= self.light {
            return Ok(None);
        }
        let metric = self.scales.as_ref().map(|scales| self.structure.metric(scales));
        let metric = metric.as_ref().unwrap_or(&self.mass);
        let Some(rank) = SparseRank::find(&self.structure, &self.clusters, metric, jacobian)? else {
            return Ok(None);
        };
        let (sparse, _) = rank.engine(&self.structure, &self.clusters, &self.mass, jacobian)?;
        let rows = rank.independent.len();
        Ok(Some(Chosen { rank, sparse, g: vec![0.0; rows], lambda: vec![0.0; rows] }))
    }

    /// Whether the rows that are not enforced are met.
    fn others_are_met(&self, rank: &SparseRank, g: &[f64], a: &[f64]) -> bool {
        let (mut off, mut size) = (vec![0.0; g.len()], vec![0.0; g.len()]);
        for ((row, column), value) in self.structure.jacobian.iter().zip(&self.jacobian) {
            off[*row] += value * a[*column];
            size[*row] += (value * a[*column]).abs();
        }
        rank.dependent.iter().all(|row| (off[*row] - g[*row]).abs() <= MET * (size[*row] + g[*row].abs()))
    }

    fn dense(&mut self) -> Result<&mut DenseQr, LinalgError> {
        if self.dense.is_none() {
            let mut dense = DenseQr::new(&self.structure, self.tolerance)?;
            if let Some(scales) = &self.scales {
                dense.set_measure(scales)?;
            }
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
        self.chosen = None;
        self.uses_dense = !matches!(&sparse, Ok(health) if health.smallest_pivot_ratio >= TRUSTED);
        if !self.uses_dense {
            return sparse;
        }
        self.chosen = self.choose(jacobian)?;
        if let Some(chosen) = &self.chosen {
            self.uses_dense = false;
            self.jacobian = jacobian.to_vec();
            let rank = chosen.rank.independent.len();
            return Ok(Health { rank, smallest_pivot_ratio: chosen.rank.smallest_sine });
        }
        self.dense()?.refactor(jacobian)
    }

    fn solve(&mut self, f: &[f64], g: &[f64], a: &mut [f64], lambda: &mut [f64]) -> Result<(), LinalgError> {
        if let Some(mut chosen) = self.chosen.take() {
            for (own, row) in chosen.g.iter_mut().zip(&chosen.rank.independent) {
                *own = g[*row];
            }
            chosen.sparse.solve(f, &chosen.g, a, &mut chosen.lambda)?;
            if self.few_rows || self.others_are_met(&chosen.rank, g, a) {
                lambda.fill(0.0);
                for (row, value) in chosen.rank.independent.iter().zip(&chosen.lambda) {
                    lambda[*row] = *value;
                }
                self.chosen = Some(chosen);
                return Ok(());
            }
            let jacobian = std::mem::take(&mut self.jacobian);
            self.dense()?.refactor(&jacobian)?;
            self.uses_dense = true;
        }
        if self.uses_dense { self.dense()?.solve(f, g, a, lambda) } else { self.sparse.solve(f, g, a, lambda) }
    }

    fn name(&self) -> &'static str {
        "sparse_first"
    }
}
