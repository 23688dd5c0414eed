//! Linear algebra behind the equations of motion.
//!
//! - **Takes**: sparsity patterns and slices of numbers aligned with them.
//! - **Gives**: the solution of the saddle point system below, by whichever engine was
//!   constructed; ranks, null spaces, and the small dense solvers used for assembly.
//! - **May touch**: nothing but its own storage, all of it allocated by the constructors.
//! - **Must not know**: bodies, joints, time, files.
//!
//! The system solved everywhere is
//!
//! ```text
//! [ M  J^T ] [ a      ]   [ f ]
//! [ J   0  ] [ lambda ] = [ g ]
//! ```
//!
//! with `M` (`n x n`) symmetric positive definite, sparse, constant or rarely changed, and `J`
//! (`m x n`) sparse with a fixed pattern whose values change with every call. The rows of `J`
//! may be dependent. Where rows carry different units every decision about rank is taken on
//! rows scaled to unit length, so a change of units changes no decision.
//!
//! | file | content |
//! |---|---|
//! | `dense_qr.rs` | rank-safe engine, the plain twin of everything faster; sparse storage where much is zero |
//! | `sparse_first.rs` | the sparse engine where it can be trusted, the rank-safe one where not |
//! | `sparse_ldl.rs` | engine whose cost grows like the size of a chain or tree |
//! | `sparse_rank.rs`, `null_vectors.rs` | dependent rows found by sparse elimination, and what they are made of |
//! | `analysed.rs` | patterns that are asked for again are analysed once |
//! | `constraint_order.rs` | elimination orders in which the sparse engine needs no pivoting |
//! | `pivoted_qr.rs` | Householder QR with column pivoting, in dense or sparse storage (`pivoted_qr/`): rank, least squares, minimum norm |
//! | `singular_values.rs` | singular values and vectors of dense matrices of any rank: least squares of least norm, null spaces |
//! | `sparse_lu.rs` | LU with threshold pivoting for general matrices with few entries |
//! | `dense.rs` | LU with complete pivoting for square systems that may be singular |
//! | `block_cholesky.rs` | Cholesky factor of the mass matrix, block by block |

use std::ops::Range;

mod analysed;
mod block_cholesky;
mod constraint_order;
mod dense;
mod dense_qr;
mod null_vectors;
mod pivoted_qr;
mod singular_values;
mod sparse_first;
mod sparse_ldl;
mod sparse_lu;
mod sparse_rank;

#[cfg(test)]
mod tests;

pub use block_cholesky::{BlockCholesky, connected_blocks};
pub use constraint_order::{Clusters, constraint_order};
pub use dense::FullPivLu;
pub use dense_qr::DenseQr;
pub use pivoted_qr::PivotedQr;
pub use singular_values::SingularValues;
pub use sparse_first::{LIGHT, SparseFirst, TRUSTED};
pub use sparse_ldl::SparseLdl;
pub use sparse_lu::SparseLu;
pub use sparse_rank::{NullVector, SparseRank};

/// Rank tolerance of the dense factorisations: a pivot at or below this share of the largest
/// one counts as zero. Rows are scaled to unit length before, so the number has no unit.
pub const DEFAULT_RANK_TOLERANCE: f64 = 1e-10;

/// An engine for the saddle point system, bound to one [`KktStructure`] by its constructor.
///
/// The order of calls is `set_mass`, `refactor`, `solve`; each keeps its effect until it is
/// called again, but a new mass matrix needs a `refactor` before the next `solve`.
/// `refactor` and `solve` are hot: they allocate nothing (sparse storage of a rank-safe engine, on large systems, does).
pub trait KktSolver: Send {
    /// Takes the values of `M`, aligned with [`KktStructure::mass`].
    ///
    /// # Errors
    /// [`LinalgError::NotPositiveDefinite`], or a slice of the wrong length.
    fn set_mass(&mut self, values: &[f64]) -> Result<(), LinalgError>;

    /// Factors the matrix with the values of `J`, aligned with [`KktStructure::jacobian`].
    /// `[hot]`
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`] without a mass matrix, [`LinalgError::NotFinite`],
    /// [`LinalgError::Singular`] if the engine cannot go past a zero pivot. Near rank
    /// deficiency is not an error, see [`Health`].
    fn refactor(&mut self, jacobian: &[f64]) -> Result<Health, LinalgError>;

    /// Solves for `a` (length `n`) and `lambda` (length `m`), both overwritten. `[hot]`
    ///
    /// # Errors
    /// [`LinalgError::NotFactored`] before a successful `refactor`, or a slice of the wrong
    /// length.
    fn solve(&mut self, f: &[f64], g: &[f64], a: &mut [f64], lambda: &mut [f64]) -> Result<(), LinalgError>;

    /// Short name for reports.
    fn name(&self) -> &'static str;
}

/// Sizes and sparsity patterns of the saddle point system; values travel separately, as slices
/// aligned with the patterns.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct KktStructure {
    /// Number of columns of `M` and `J`: accelerations.
    pub n: usize,
    /// Number of rows of `J`: constraints.
    pub m: usize,
    /// `(row, column)` of the lower triangle of `M` with its whole diagonal, sorted by column,
    /// then row.
    pub mass: Vec<(usize, usize)>,
    /// `(row, column)` of `J`, sorted by row, then column.
    pub jacobian: Vec<(usize, usize)>,
}

impl KktStructure {
    /// Builds and checks a structure.
    ///
    /// # Errors
    /// See [`KktStructure::validate`].
    pub fn new(
        n: usize,
        m: usize,
        mass: Vec<(usize, usize)>,
        jacobian: Vec<(usize, usize)>,
    ) -> Result<Self, LinalgError> {
        let structure = Self { n, m, mass, jacobian };
        structure.validate()?;
        Ok(structure)
    }

    /// The entries of a row of `J`, by their places in the pattern.
    #[must_use]
    pub fn row(&self, row: usize) -> Range<usize> {
        let place = |row: usize| self.jacobian.partition_point(|(k, _)| *k < row);
        place(row)..place(row + 1)
    }

    /// Values of a mass matrix, aligned with the pattern, with which unknowns that move things by a length, times their scale,
    /// count alike: a diagonal of `1 / scale^2`.
    #[must_use]
    pub fn metric(&self, scales: &[f64]) -> Vec<f64> {
        let value = |&(row, column): &(usize, usize)| if row == column { scales[row].powi(-2) } else { 0.0 };
        self.mass.iter().map(value).collect()
    }

    /// What is left of both block rows of the system, `b - K x` for `b = (f, g)` and `x = (a, lambda)`, and what it is made of:
    /// the sums of the magnitudes of its terms. Both `n + m` long. `[hot]`
    pub fn residual(&self, values: (&[f64], &[f64]), b: (&[f64], &[f64]), x: (&[f64], &[f64]), out: [&mut [f64]; 2]) {
        let [(motion_left, left), (motion_sizes, sizes)] = out.map(|out| out.split_at_mut(self.n));
        self.residual_of_motion(values, b.0, x, [motion_left, motion_sizes]);
        for ((left, size), g) in left.iter_mut().zip(sizes.iter_mut()).zip(b.1) {
            (*left, *size) = (*g, g.abs());
        }
        for (&(row, column), value) in self.jacobian.iter().zip(values.1) {
            let term = value * x.0[column];
            left[row] -= term;
            sizes[row] += term.abs();
        }
    }

    /// The first block row of [`KktStructure::residual`], `n` long. `[hot]`
    pub fn residual_of_motion(&self, values: (&[f64], &[f64]), f: &[f64], x: (&[f64], &[f64]), out: [&mut [f64]; 2]) {
        let [left, sizes] = out;
        for ((left, size), f) in left.iter_mut().zip(sizes.iter_mut()).zip(f) {
            (*left, *size) = (*f, f.abs());
        }
        let mut take = |row: usize, term: f64| {
            left[row] -= term;
            sizes[row] += term.abs();
        };
        for (&(row, column), value) in self.mass.iter().zip(values.0) {
            take(row, value * x.0[column]);
            if row != column {
                take(column, value * x.0[row]);
            }
        }
        for (&(row, column), value) in self.jacobian.iter().zip(values.1) {
            take(column, value * x.1[row]);
        }
    }

    /// Checks ranges, sorting, absence of duplicates and presence of the whole diagonal.
    ///
    /// # Errors
    /// [`LinalgError::Pattern`] naming the first entry at fault.
    pub fn validate(&self) -> Result<(), LinalgError> {
        let mut diagonal = vec![false; self.n];
        for &(row, column) in &self.mass {
            if row >= self.n || column > row {
                return Err(pattern_error("mass", row, column, "is not in the triangle"));
            }
            diagonal[column] |= row == column;
        }
        for pair in self.mass.windows(2) {
            if (pair[0].1, pair[0].0) >= (pair[1].1, pair[1].0) {
                let (row, column) = pair[1];
                return Err(pattern_error("mass", row, column, "is out of order"));
            }
        }
        if let Some(column) = diagonal.iter().position(|&present| !present) {
            return Err(pattern_error("mass", column, column, "is missing"));
        }
        for &(row, column) in &self.jacobian {
            if row >= self.m || column >= self.n {
                return Err(pattern_error("jacobian", row, column, "is out of range"));
            }
        }
        for pair in self.jacobian.windows(2) {
            if pair[0] >= pair[1] {
                let (row, column) = pair[1];
                return Err(pattern_error("jacobian", row, column, "is out of order"));
            }
        }
        Ok(())
    }
}

/// What a factorisation found out about the rank of `J`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Health {
    /// Number of rows of `J` found independent, at the engine's tolerance.
    pub rank: usize,
    /// How close the weakest row is to being dependent on others: 1 = orthogonal, 0 =
    /// dependent; independent of units. 1 if there is no row.
    ///
    /// [`DenseQr`]: smallest accepted pivot over the largest one (rows below the tolerance
    /// lower `rank` instead). [`SparseLdl`]: smallest of all rows, and of the size of a
    /// *square* of the ratio of [`DenseQr`].
    pub smallest_pivot_ratio: f64,
}

/// What can go wrong in this room.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinalgError {
    /// A slice does not fit the structure.
    #[error("{what}: expected {expected} values, found {found}")]
    Length {
        /// Which argument.
        what: &'static str,
        /// Length that fits.
        expected: usize,
        /// Length given.
        found: usize,
    },
    /// A pattern, order or cluster list breaks its rules.
    #[error("invalid pattern: {0}")]
    Pattern(String),
    /// The mass matrix has no Cholesky factor.
    #[error("the mass matrix is not positive definite (row {row})")]
    NotPositiveDefinite {
        /// Row of `M` at which the factorisation stopped.
        row: usize,
    },
    /// An engine without pivoting met a pivot that is exactly zero.
    #[error("the system is singular: constraint row {row} has a zero pivot")]
    Singular {
        /// Row of `J`.
        row: usize,
    },
    /// A NaN or an infinity came in or arose.
    #[error("{what} has a value that is not finite")]
    NotFinite {
        /// Which argument or factor.
        what: &'static str,
    },
    /// A solve was asked for without a valid factorisation.
    #[error("there is no valid factorisation to solve with")]
    NotFactored,
}

fn pattern_error(matrix: &str, row: usize, column: usize, fault: &str) -> LinalgError {
    LinalgError::Pattern(format!("entry ({row}, {column}) of the {matrix} {fault}"))
}

fn check_length(what: &'static str, expected: usize, found: usize) -> Result<(), LinalgError> {
    if expected == found {
        return Ok(());
    }
    Err(LinalgError::Length { what, expected, found })
}

/// Euclidean norm, safe against overflow and underflow; NaN or infinite if an entry is.
fn two_norm(x: &[f64]) -> f64 {
    two_norm_of(x.iter().copied())
}

/// The same of numbers wherever they stand.
fn two_norm_of(x: impl Iterator<Item = f64> + Clone) -> f64 {
    let mut largest = 0.0_f64;
    for value in x.clone() {
        if !value.is_finite() {
            return f64::NAN;
        }
        largest = largest.max(value.abs());
    }
    if largest == 0.0 {
        return 0.0;
    }
    let sum: f64 = x.map(|v| (v / largest) * (v / largest)).sum();
    largest * sum.sqrt()
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(&a, &b)| a * b).sum()
}

/// `y += factor x`
fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    for (target, &value) in y.iter_mut().zip(x) {
        *target += factor * value;
    }
}
