//! Putting a joint together: from any setting to one that satisfies its rows.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::testkit::{Probe, Setting};

/// Rows must come this close to zero, m or rad.
const ASSEMBLED: f64 = 1e-12;
/// Most steps; convergence is quadratic near the goal.
const MOST_STEPS: usize = 100;
/// Most iterations for eigenvalues; a few per column are usual.
const MOST_SWEEPS: usize = 10_000;
/// Singular values below this part of the largest count as zero.
pub(super) const RANK: f64 = 1e-9;

impl Probe {
    /// Moves the frames, at the setting's time, until the joint's rows are zero: Gauss-Newton steps of least length
    /// (pseudo-inverse), none longer than half a metre or radian. Angle references follow. Gives whether it arrived where the
    /// rows have derivatives.
    ///
    /// # Panics
    /// For a force or control element, or when the setting does not fit.
    pub fn assemble(&self, setting: &mut Setting) -> bool {
        for _ in 0..MOST_STEPS {
            let found = self.joint_values(setting);
            self.refer(setting);
            let (rows, residual) = (&found.jacobian[..found.rows], DVector::from_column_slice(found.residual()));
            if residual.amax() <= ASSEMBLED * (1.0 + size(setting)) {
                // A row may be zero where it has no direction: a length of nothing.
                return rows.iter().flatten().all(|derivative| derivative.is_finite());
            }
            let Some(mut step) = least_step(rows, &residual) else { return false };
            let longest = step.amax();
            if longest > 0.5 {
                step *= 0.5 / longest;
            }
            *setting = setting.moved(step.as_slice());
        }
        false
    }
}

/// Size of the numbers that rows are made of.
fn size(setting: &Setting) -> f64 {
    let positions = setting.frames.iter().map(|frame| frame.position.amax());
    positions.chain(setting.references.iter().map(|angle| angle.abs())).fold(0.0, f64::max)
}

/// The shortest step that makes linearised rows zero; `None` when numbers are not finite.
fn least_step(rows: &[Vec<f64>], residual: &DVector<f64>) -> Option<DVector<f64>> {
    if !residual.iter().all(|x| x.is_finite()) {
        return None;
    }
    let decomposed = Decomposed::of(&matrix(rows))?;
    let mut step = DVector::zeros(decomposed.right.nrows());
    for k in 0..decomposed.rank(RANK) {
        step -= decomposed.right.column(k) * (decomposed.left.column(k).dot(residual) / decomposed.values[k]);
    }
    Some(step)
}

/// Singular values, falling, with their vectors: the positive eigenvalues of `[0 A; A^T 0]` (Golub & Van Loan 2013, section 8.6).
/// The singular value decomposition of `nalgebra` is wrong for some rows that depend on each other
/// (<https://github.com/dimforge/nalgebra/issues/1172>).
struct Decomposed {
    values: DVector<f64>,
    left: DMatrix<f64>,
    right: DMatrix<f64>,
}

impl Decomposed {
    /// `None` for what is not finite, which no iteration ends on, and where the iteration takes too long.
    fn of(rows: &DMatrix<f64>) -> Option<Self> {
        if !rows.iter().all(|x| x.is_finite()) {
            return None;
        }
        let (m, n) = rows.shape();
        let mut both = DMatrix::zeros(m + n, m + n);
        both.view_mut((0, m), (m, n)).copy_from(rows);
        both.view_mut((m, 0), (n, m)).tr_copy_from(rows);
        let eigen = SymmetricEigen::try_new(both, f64::EPSILON, MOST_SWEEPS)?;
        let mut order: Vec<usize> = (0..m + n).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        order.truncate(m.min(n));
        let vectors = eigen.eigenvectors.select_columns(&order) * std::f64::consts::SQRT_2;
        Some(Self {
            values: DVector::from_iterator(order.len(), order.iter().map(|k| eigen.eigenvalues[*k].max(0.0))),
            left: vectors.rows(0, m).into_owned(),
            right: vectors.rows(m, n).into_owned(),
        })
    }

    /// How many values are above a part of the largest.
    fn rank(&self, part: f64) -> usize {
        self.values.iter().filter(|value| **value > part * self.values[0]).count()
    }
}

/// Rows as a matrix.
pub(super) fn matrix(rows: &[Vec<f64>]) -> DMatrix<f64> {
    let columns = rows.first().map_or(0, Vec::len);
    DMatrix::from_fn(rows.len(), columns, |row, column| rows[row][column])
}

/// Number of independent rows.
pub(super) fn rank(rows: &[Vec<f64>]) -> usize {
    rank_at(rows, RANK)
}

/// The same for rows that are known up to a part of their size only.
pub(super) fn rank_at(rows: &[Vec<f64>], part: f64) -> usize {
    if rows.is_empty() {
        return 0;
    }
    Decomposed::of(&matrix(rows)).map_or(0, |decomposed| decomposed.rank(part))
}

/// An orthonormal basis of the motions (six numbers per frame) that leave linearised rows unchanged.
pub(super) fn free_directions(rows: &[Vec<f64>], columns: usize) -> Vec<DVector<f64>> {
    let rows = DMatrix::from_fn(rows.len(), columns, |row, column| rows[row][column]);
    let Some(decomposed) = Decomposed::of(&rows) else { return Vec::new() };
    let held = decomposed.right.columns_range(..decomposed.rank(RANK));
    // The projector on what is free: its eigenvalues are zeros and ones.
    let free = SymmetricEigen::new(DMatrix::identity(columns, columns) - held * held.transpose());
    let directions = free.eigenvalues.iter().zip(free.eigenvectors.column_iter());
    directions.filter(|(value, _)| **value > 0.5).map(|(_, direction)| direction.into_owned()).collect()
}

#[cfg(test)]
mod tests;
