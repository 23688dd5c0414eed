//! Putting a joint together: from any setting to one that satisfies its rows.

use nalgebra::{DMatrix, DVector, Dyn, SVD};

use crate::testkit::{Probe, Setting};

/// Rows must come this close to zero, m or rad.
const ASSEMBLED: f64 = 1e-12;
/// Most steps; convergence is quadratic near the goal.
const MOST_STEPS: usize = 100;
/// Most iterations of a singular value decomposition; a few per column are usual.
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
    let svd = decomposed(matrix(rows), true, true)?;
    let cut = RANK * svd.singular_values.max();
    svd.solve(residual, cut).ok().map(|step| -step)
}

/// The singular value decomposition, singular values in falling order; `None` for what is not finite, which no iteration ends
/// on, and where the iteration takes too long.
fn decomposed(matrix: DMatrix<f64>, u: bool, v: bool) -> Option<SVD<f64, Dyn, Dyn>> {
    if !matrix.iter().all(|x| x.is_finite()) {
        return None;
    }
    SVD::try_new(matrix, u, v, 5.0 * f64::EPSILON, MOST_SWEEPS)
}

/// The singular values of rows; `None` where they cannot be had.
pub(super) fn singular_values(rows: &[Vec<f64>]) -> Option<DVector<f64>> {
    decomposed(matrix(rows), false, false).map(|svd| svd.singular_values)
}

/// Rows as a matrix.
pub(super) fn matrix(rows: &[Vec<f64>]) -> DMatrix<f64> {
    let columns = rows.first().map_or(0, Vec::len);
    DMatrix::from_fn(rows.len(), columns, |row, column| rows[row][column])
}

/// Number of independent rows.
pub(super) fn rank(rows: &[Vec<f64>]) -> usize {
    if rows.is_empty() {
        return 0;
    }
    let Some(singular) = singular_values(rows) else { return 0 };
    let cut = RANK * singular.max();
    singular.iter().filter(|value| **value > cut).count()
}

/// An orthonormal basis of the motions (six numbers per frame) that leave linearised rows unchanged.
pub(super) fn free_directions(rows: &[Vec<f64>], columns: usize) -> Vec<DVector<f64>> {
    // Rows of zeros make the decomposition give all right singular vectors.
    let mut square = DMatrix::zeros(rows.len().max(columns), columns);
    square.rows_mut(0, rows.len()).copy_from(&DMatrix::from_fn(rows.len(), columns, |row, column| rows[row][column]));
    let Some(svd) = decomposed(square, false, true) else { return Vec::new() };
    let cut = RANK * svd.singular_values.max();
    let Some(directions) = svd.v_t else { return Vec::new() };
    let free = (0..columns).filter(|k| svd.singular_values[*k] <= cut);
    free.map(|k| directions.row(k).transpose()).collect()
}

#[cfg(test)]
mod tests;
