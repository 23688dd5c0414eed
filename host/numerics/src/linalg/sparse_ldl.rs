//! Sparse `L D L^T` of the saddle point matrix, without pivoting, in an order fixed beforehand.

use super::analysed::analysed;
use super::{BlockCholesky, Clusters, Health, KktSolver, KktStructure, LinalgError, check_length, constraint_order};

/// Ratio of the largest to the smallest entry of the mass matrix's diagonal from which on every solution is refined.
const UNEVEN: f64 = 1e8;
/// Share of a pivot in the magnitudes that it is made of below which solutions are refined.
pub const ROUGH: f64 = 1e-3;

/// Of an unknown or a value. Large scenes run through as many of them as through numbers, which caches do not hold.
type Index = u32;

/// No index: end of a chain in the elimination tree.
const NONE: usize = usize::MAX;

/// Up-looking sparse `K = P^T L D L^T P` (Davis, ACM TOMS Algorithm 849, 2005) with the
/// pattern of `L` computed once.
///
/// No pivot is searched, so the order has to keep pivots away from zero: velocities always
/// have positive ones, constraint rows negative ones once enough of the velocities they touch
/// are eliminated. [`constraint_order`] gives such orders. For rows that are dependent, or
/// nearly so, the pivot of a row is the difference of numbers that almost cancel; the share
/// that is left, `|d_k| / sum of |contributions|`, is reported in [`Health`]. It does not
/// change with units. Where all velocities come first it is `s^2 / (2 - s^2)`, `s` being the
/// sine of the angle between the row and the span of those before it, in the metric of `M`.
#[derive(Debug, Clone)]
pub struct SparseLdl {
    structure: KktStructure,
    mass: BlockCholesky,
    threshold: f64,
    refine: bool,
    /// Whether masses and inertias span so many decades that every solution is refined.
    is_uneven: bool,
    /// Whether the factorisation in force lost digits.
    is_rough: bool,
    /// Unknown at each place: `0..n` velocities, `n..n + m` constraint rows.
    order: Vec<usize>,
    /// Values of `M`, then of `J`.
    values: Vec<f64>,
    /// Lower triangle of the permuted matrix by rows: columns and places in `values`.
    row_starts: Vec<usize>,
    row_entries: Vec<(Index, Index)>,
    /// Columns of `L` with an entry in each row, ascending.
    pattern_starts: Vec<usize>,
    pattern: Vec<Index>,
    /// `L` by columns, diagonal of ones left out, rows ascending.
    column_starts: Vec<usize>,
    rows: Vec<Index>,
    lower: Vec<f64>,
    /// `D`, and its inverse.
    diagonal: Vec<f64>,
    inverse: Vec<f64>,
    factored: bool,
    /// Scratch: end of the filled part of each column of `L`; one dense row; the right side,
    /// the solution, and the residual in the original numbering.
    filled: Vec<usize>,
    row: Vec<f64>,
    right: Vec<f64>,
    solution: Vec<f64>,
    residual: Vec<f64>,
}

impl SparseLdl {
    /// A pivot ratio below this counts as a dependent row, unless
    /// [`SparseLdl::set_threshold`] says otherwise.
    pub const DEFAULT_THRESHOLD: f64 = 1e-9;

    /// Analyses the structure in a given order: a permutation of the `n + m` unknowns, row
    /// `j` of `J` being unknown `n + j`.
    ///
    /// # Errors
    /// [`LinalgError::Pattern`].
    pub fn new(structure: &KktStructure, order: &[usize]) -> Result<Self, LinalgError> {
        structure.validate()?;
        let size = structure.n + structure.m;
        let place_of = invert_permutation(order, size)?;
        let (row_starts, row_entries) = permuted_triangle(structure, &place_of);
        let symbolic = analyse(&row_starts, &row_entries);
        let nonzeros = symbolic.pattern.len();
        Ok(Self {
            mass: BlockCholesky::new(structure.n, &structure.mass),
            threshold: Self::DEFAULT_THRESHOLD,
            refine: false,
            is_uneven: false,
            is_rough: false,
            order: order.to_vec(),
            values: vec![0.0; structure.mass.len() + structure.jacobian.len()],
            row_starts,
            row_entries,
            pattern_starts: symbolic.pattern_starts,
            pattern: symbolic.pattern,
            column_starts: symbolic.column_starts,
            rows: symbolic.rows,
            lower: vec![0.0; nonzeros],
            diagonal: vec![0.0; size],
            inverse: vec![0.0; size],
            factored: false,
            filled: vec![0; size],
            row: vec![0.0; size],
            right: vec![0.0; size],
            solution: vec![0.0; size],
            residual: vec![0.0; size],
            structure: structure.clone(),
        })
    }

    /// Analyses the structure in the order that [`constraint_order`] computes.
    ///
    /// # Errors
    /// [`LinalgError::Pattern`].
    pub fn with_computed_order(structure: &KktStructure, clusters: Option<&Clusters>) -> Result<Self, LinalgError> {
        analysed(structure, clusters, || Self::new(structure, &constraint_order(structure, clusters)?))
    }

    /// Sets the pivot ratio below which a row is counted as dependent in [`Health::rank`].
    pub fn set_threshold(&mut self, threshold: f64) {
        self.threshold = threshold;
    }

    /// Switches one step of iterative refinement per solve on, or leaves it to factorisations with a share of a pivot below
    /// 1e-3 (default). It costs about as much as the solve itself.
    pub fn set_refinement(&mut self, refine: bool) {
        self.refine = refine;
    }

    /// Entries of `L` below its diagonal: the work of a solve. A `refactor` takes the sum of
    /// squares of the column counts.
    pub fn factor_nonzeros(&self) -> usize {
        self.lower.len()
    }

    /// Eliminates row `k` of the permuted matrix; returns its pivot and the sum of the
    /// magnitudes that made it.
    fn factor_row(&mut self, k: usize) -> (f64, f64) {
        let mut pivot = 0.0;
        for &(column, source) in &self.row_entries[self.row_starts[k]..self.row_starts[k + 1]] {
            let (column, value) = (column as usize, self.values[source as usize]);
            if column == k {
                pivot = value;
            } else {
                self.row[column] = value;
            }
        }
        let mut magnitude = pivot.abs();

        // Forward substitution with the rows above, in ascending columns.
        for &j in &self.pattern[self.pattern_starts[k]..self.pattern_starts[k + 1]] {
            let j = j as usize;
            let value = std::mem::take(&mut self.row[j]);
            let start = self.column_starts[j];
            let end = self.filled[j];
            for (&i, &entry) in self.rows[start..end].iter().zip(&self.lower[start..end]) {
                self.row[i as usize] -= entry * value;
            }
            let multiplier = value * self.inverse[j];
            let contribution = multiplier * value;
            pivot -= contribution;
            magnitude += contribution.abs();
            self.lower[end] = multiplier;
            self.filled[j] = end + 1;
        }
        (pivot, magnitude)
    }

    /// `solution := K^-1 right`, `right` in the original numbering and destroyed; adds to
    /// `solution` if `add` is set.
    fn solve_once(&mut self, add: bool) {
        let size = self.order.len();
        for (value, &unknown) in self.row.iter_mut().zip(&self.order) {
            *value = self.right[unknown];
        }
        for j in 0..size {
            let value = self.row[j];
            let range = self.column_starts[j]..self.column_starts[j + 1];
            for (&i, &entry) in self.rows[range.clone()].iter().zip(&self.lower[range]) {
                self.row[i as usize] -= entry * value;
            }
        }
        for j in (0..size).rev() {
            let mut value = self.row[j] * self.inverse[j];
            let range = self.column_starts[j]..self.column_starts[j + 1];
            for (&i, &entry) in self.rows[range.clone()].iter().zip(&self.lower[range]) {
                value -= entry * self.row[i as usize];
            }
            self.row[j] = value;
        }
        for (value, &unknown) in self.row.iter_mut().zip(&self.order) {
            let before = if add { self.solution[unknown] } else { 0.0 };
            self.solution[unknown] = before + *value;
            // `refactor` expects a clean row.
            *value = 0.0;
        }
    }

    /// `residual := b - K solution` with `b = [f; g]`.
    fn compute_residual(&mut self, f: &[f64], g: &[f64]) {
        let n = self.structure.n;
        self.residual[..n].copy_from_slice(f);
        self.residual[n..].copy_from_slice(g);
        let (mass, jacobian) = self.values.split_at(self.structure.mass.len());
        for (&(row, column), &value) in self.structure.mass.iter().zip(mass) {
            self.residual[row] -= value * self.solution[column];
            if row != column {
                self.residual[column] -= value * self.solution[row];
            }
        }
        for (&(row, column), &value) in self.structure.jacobian.iter().zip(jacobian) {
            self.residual[n + row] -= value * self.solution[column];
            self.residual[column] -= value * self.solution[n + row];
        }
    }
}

impl KktSolver for SparseLdl {
    fn set_mass(&mut self, values: &[f64]) -> Result<(), LinalgError> {
        self.factored = false;
        self.mass.factor(values)?;
        self.values[..values.len()].copy_from_slice(values);
        // Round-off of what is heavy drowns what is light: multipliers of light bodies are right after a refinement only.
        let entries = self.structure.mass.iter().zip(values).filter(|((row, column), _)| row == column);
        let sizes = entries.map(|(_, value)| value.abs());
        let (least, most) = sizes.fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(x), b.max(x)));
        self.is_uneven = most > UNEVEN * least;
        Ok(())
    }

    fn refactor(&mut self, jacobian: &[f64]) -> Result<Health, LinalgError> {
        self.factored = false;
        check_length("jacobian", self.structure.jacobian.len(), jacobian.len())?;
        if !self.mass.is_factored() {
            return Err(LinalgError::NotFactored);
        }
        if !jacobian.iter().all(|value| value.is_finite()) {
            return Err(LinalgError::NotFinite { what: "jacobian" });
        }
        let (n, m) = (self.structure.n, self.structure.m);
        self.values[self.structure.mass.len()..].copy_from_slice(jacobian);
        self.filled.copy_from_slice(&self.column_starts[..n + m]);

        let mut rank = m;
        let mut smallest_pivot_ratio = 1.0_f64;
        self.is_rough = false;
        for k in 0..n + m {
            let unknown = self.order[k];
            let is_constraint = unknown >= n;
            let (pivot, magnitude) = self.factor_row(k);
            if !pivot.is_finite() {
                return Err(LinalgError::NotFinite { what: "factor" });
            }
            if pivot == 0.0 && is_constraint {
                return Err(LinalgError::Singular { row: unknown - n });
            }
            if pivot == 0.0 {
                return Err(LinalgError::NotPositiveDefinite { row: unknown });
            }
            // By the law of inertia velocities have positive pivots and rows negative ones;
            // a wrong sign is round-off that swallowed the whole pivot.
            let signed = if is_constraint { -pivot } else { pivot };
            let ratio = (signed / magnitude).max(0.0);
            self.is_rough |= ratio < ROUGH;
            if is_constraint || signed < 0.0 {
                smallest_pivot_ratio = smallest_pivot_ratio.min(ratio);
                rank -= usize::from(is_constraint && ratio < self.threshold);
            }
            self.diagonal[k] = pivot;
            self.inverse[k] = 1.0 / pivot;
        }
        self.factored = true;
        Ok(Health { rank, smallest_pivot_ratio })
    }

    fn solve(&mut self, f: &[f64], g: &[f64], a: &mut [f64], lambda: &mut [f64]) -> Result<(), LinalgError> {
        if !self.factored {
            return Err(LinalgError::NotFactored);
        }
        let (n, m) = (self.structure.n, self.structure.m);
        check_length("f", n, f.len())?;
        check_length("g", m, g.len())?;
        check_length("a", n, a.len())?;
        check_length("lambda", m, lambda.len())?;
        self.right[..n].copy_from_slice(f);
        self.right[n..].copy_from_slice(g);
        self.solve_once(false);
        if self.refine || self.is_rough || self.is_uneven {
            self.compute_residual(f, g);
            self.right.copy_from_slice(&self.residual);
            self.solve_once(true);
        }
        a.copy_from_slice(&self.solution[..n]);
        lambda.copy_from_slice(&self.solution[n..]);
        Ok(())
    }

    fn name(&self) -> &'static str {
        "sparse_ldl"
    }
}

/// Place of each unknown in the order.
fn invert_permutation(order: &[usize], size: usize) -> Result<Vec<usize>, LinalgError> {
    check_length("elimination order", size, order.len())?;
    let mut place_of = vec![NONE; size];
    for (place, &unknown) in order.iter().enumerate() {
        if unknown >= size || place_of[unknown] != NONE {
            let text = format!("the elimination order is no permutation (unknown {unknown})");
            return Err(LinalgError::Pattern(text));
        }
        place_of[unknown] = place;
    }
    Ok(place_of)
}

/// Entries on and below the diagonal of the permuted matrix, by rows, each as column and place
/// in the values (those of `M` first, then those of `J`).
fn permuted_triangle(structure: &KktStructure, place_of: &[usize]) -> (Vec<usize>, Vec<(Index, Index)>) {
    let mass = structure.mass.iter().copied();
    let jacobian = structure.jacobian.iter().map(|&(row, column)| (structure.n + row, column));
    let mut entries: Vec<(Index, Index, Index)> = mass
        .chain(jacobian)
        .zip(0..)
        .map(|((row, column), source)| {
            let (i, j) = (place_of[row] as Index, place_of[column] as Index);
            (i.max(j), i.min(j), source)
        })
        .collect();
    entries.sort_unstable();

    let mut starts = vec![0; place_of.len() + 1];
    for &(row, _, _) in &entries {
        starts[row as usize + 1] += 1;
    }
    accumulate(&mut starts);
    let pairs = entries.iter().map(|&(_, column, source)| (column, source));
    (starts, pairs.collect())
}

struct Symbolic {
    pattern_starts: Vec<usize>,
    pattern: Vec<Index>,
    column_starts: Vec<usize>,
    rows: Vec<Index>,
}

/// Pattern of `L`: row `k` has an entry in every column met when walking up the elimination
/// tree from each entry of row `k` of the matrix (Liu, SIAM J. Matrix Anal. 11, 1990).
fn analyse(row_starts: &[usize], row_entries: &[(Index, Index)]) -> Symbolic {
    let size = row_starts.len() - 1;
    let mut parent = vec![NONE; size];
    let mut visited = vec![NONE; size];
    let mut pattern_starts = vec![0; size + 1];
    let mut pattern = Vec::new();
    let mut column_starts = vec![0; size + 1];
    for k in 0..size {
        visited[k] = k;
        for &(column, _) in &row_entries[row_starts[k]..row_starts[k + 1]] {
            let mut j = column as usize;
            while visited[j] != k {
                visited[j] = k;
                if parent[j] == NONE {
                    parent[j] = k;
                }
                pattern.push(j as Index);
                column_starts[j + 1] += 1;
                j = parent[j];
            }
        }
        pattern[pattern_starts[k]..].sort_unstable();
        pattern_starts[k + 1] = pattern.len();
    }
    accumulate(&mut column_starts);

    let mut rows = vec![0; pattern.len()];
    let mut filled = column_starts.clone();
    for k in 0..size {
        for &j in &pattern[pattern_starts[k]..pattern_starts[k + 1]] {
            let free = &mut filled[j as usize];
            rows[*free] = k as Index;
            *free += 1;
        }
    }
    Symbolic { pattern_starts, pattern, column_starts, rows }
}

/// Turns counts at `k + 1` into starts at `k`.
fn accumulate(counts: &mut [usize]) {
    for k in 1..counts.len() {
        counts[k] += counts[k - 1];
    }
}
