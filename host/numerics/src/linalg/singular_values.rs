//! [`SingularValues`]: the singular value decomposition of a dense matrix.

use nalgebra::{DMatrix, DVector};

/// Columns at or below this share of the largest entry are zero.
const NOTHING: f64 = f64::EPSILON * f64::EPSILON;
/// Rounds of rotations; matrices with a rank of hundreds take a dozen.
const MOST_SWEEPS: usize = 100;

/// `A = U S V^T` of an `m x n` matrix of any rank, by one-sided Jacobi rotations (Hestenes 1958, doi:10.1137/0106005; Demmel &
/// Veselić 1992, doi:10.1137/0613074): `V` is turned until the columns of `A V = U S` are orthogonal.
///
/// The error of a value is round-off of the largest one, also where others are zero or repeated. `V` is orthonormal and complete,
/// so null spaces of `A` are; those of `A^T` come from the decomposition of `A^T`. Cost: `O(m n^2)` times some ten rounds.
///
/// It stands in for the decomposition of `nalgebra`, which is wrong for some matrices without full rank
/// (<https://github.com/dimforge/nalgebra/issues/1172>).
#[derive(Debug, Clone)]
pub struct SingularValues {
    values: DVector<f64>,
    left: DMatrix<f64>,
    right: DMatrix<f64>,
}

impl SingularValues {
    /// Decomposes a matrix, which may be empty. `None` where a number is not finite, or the rotations do not end.
    #[must_use]
    pub fn of(matrix: &DMatrix<f64>) -> Option<Self> {
        if !matrix.iter().all(|value| value.is_finite()) {
            return None;
        }
        let n = matrix.ncols();
        // A power of two, so that squares neither overflow nor vanish and scaling is exact.
        let scale = matrix.amax().max(f64::MIN_POSITIVE).log2().floor().exp2();
        let mut found = Self { values: DVector::zeros(n), left: matrix.unscale(scale), right: DMatrix::identity(n, n) };
        (0..MOST_SWEEPS).find(|_| !found.sweep())?;
        for k in 0..n {
            let length = found.left.column(k).norm();
            let is_zero = length <= NOTHING;
            found.values[k] = if is_zero { 0.0 } else { length * scale };
            found.left.column_mut(k).iter_mut().for_each(|entry| *entry = if is_zero { 0.0 } else { *entry / length });
        }
        Some(found)
    }

    /// Makes each pair of columns orthogonal once, the longer one first. Gives whether any changed.
    fn sweep(&mut self) -> bool {
        let n = self.right.ncols();
        let close = f64::EPSILON * (self.left.nrows() as f64).sqrt();
        let mut turned = false;
        for p in 0..n {
            for q in p + 1..n {
                let [mut first, mut second] = [p, q].map(|k| self.left.column(k).norm_squared());
                if first < second {
                    std::mem::swap(&mut first, &mut second);
                    self.left.swap_columns(p, q);
                    self.right.swap_columns(p, q);
                    // A pair of what was here and what is there now may have been passed over.
                    turned = true;
                }
                let product = self.left.column(p).dot(&self.left.column(q));
                if second <= NOTHING * NOTHING || product.abs() <= close * (first.sqrt() * second.sqrt()) {
                    continue;
                }
                turned = true;
                let half = (first - second) / (2.0 * product);
                let tangent = half.signum() / (half.abs() + half.hypot(1.0));
                let cosine = tangent.hypot(1.0).recip();
                turn(&mut self.left, [p, q], [cosine, tangent * cosine]);
                turn(&mut self.right, [p, q], [cosine, tangent * cosine]);
            }
        }
        turned
    }

    /// The `n` values, falling; at least `n - m` of them are zero.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        self.values.as_slice()
    }

    /// The largest value; zero for an empty matrix.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.values().first().copied().unwrap_or(0.0)
    }

    /// How many values are larger than `least`.
    #[must_use]
    pub fn rank(&self, least: f64) -> usize {
        self.values().partition_point(|value| *value > least)
    }

    /// `U`, `m x n`: the columns of values that are not zero are orthonormal, the others are zero.
    #[must_use]
    pub fn left(&self) -> &DMatrix<f64> {
        &self.left
    }

    /// `V`, `n x n`, orthonormal.
    #[must_use]
    pub fn right(&self) -> &DMatrix<f64> {
        &self.right
    }

    /// An orthonormal basis, as columns, of what `A` takes to zero: the right vectors of values not larger than `least`.
    #[must_use]
    pub fn null_space(&self, least: f64) -> DMatrix<f64> {
        let rank = self.rank(least);
        self.right.columns_range(rank..).into_owned()
    }

    /// The `x` of least length for which `A x` is nearest to `b`, where values not larger than `least` (zero or more) are zero.
    #[must_use]
    pub fn solve(&self, b: &DVector<f64>, least: f64) -> DVector<f64> {
        let rank = self.rank(least);
        let along = self.left.columns_range(..rank).tr_mul(b).component_div(&self.values.rows(0, rank));
        self.right.columns_range(..rank) * along
    }
}

/// Turns two columns by an angle of this cosine and sine.
fn turn(matrix: &mut DMatrix<f64>, [p, q]: [usize; 2], [cosine, sine]: [f64; 2]) {
    let rows = matrix.nrows();
    let (before, after) = matrix.as_mut_slice().split_at_mut(q * rows);
    for (x, y) in before[p * rows..(p + 1) * rows].iter_mut().zip(&mut after[..rows]) {
        (*x, *y) = (cosine * *x + sine * *y, cosine * *y - sine * *x);
    }
}
