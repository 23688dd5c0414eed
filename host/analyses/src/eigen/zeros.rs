//! [`Parted`]: a matrix in Hessenberg's form, its zero eigenvalues first.

use nalgebra::DMatrix;

use super::form::Turn;
use super::shifted::Shifted;
use super::split::Split;
use crate::linalg::{PivotedQr, SingularValues};

/// Multiples of what is zero from which on estimates of the least singular value, and pivots, are beyond doubt.
const CLEAR: (f64, f64) = (10.0, 1e3);

/// Q^T A Q = [Z X; 0 H], Q orthogonal: Z has no entry on its diagonal or below, H is of Hessenberg's form and has no zero eigenvalues.
pub(super) struct Parted {
    /// Q^T A Q.
    pub(super) form: DMatrix<f64>,
    /// The rows of Z.
    pub(super) zeros: usize,
    /// How often there was a null space: the largest number of zeros that have one vector in common.
    pub(super) rounds: usize,
    /// An orthonormal basis of the null space of A.
    pub(super) null: DMatrix<f64>,
    /// Q: the first, where there is one, times the second.
    turns: (Option<DMatrix<f64>>, Turn),
}

impl Parted {
    /// Of a matrix of a size, whose singular values up to a limit are zero.
    pub(super) fn of(matrix: &DMatrix<f64>, size: f64, limit: f64) -> Option<Self> {
        let n = matrix.nrows();
        let (mut whole, mut turn, mut zeros) = (matrix.clone(), None::<DMatrix<f64>>, 0);
        let (mut null, mut rounds) = (DMatrix::zeros(n, 0), 0);
        loop {
            let mut form = whole.clone();
            let to_form = Turn::to_form(&mut form, zeros);
            let left = n - zeros;
            let found = if left == 0 || is_regular(&form, zeros, size, limit) {
                None
            } else {
                let rest = whole.view((zeros, zeros), (left, left)).into_owned();
                Some(null_space_first(&rest, size, limit)?).filter(|(count, _)| *count > 0)
            };
            let Some((count, basis)) = found else {
                return Some(Self { form, zeros, rounds, null, turns: (turn, to_form) });
            };
            let turned = whole.columns(zeros, left) * &basis;
            whole.columns_mut(zeros, left).copy_from(&turned);
            let turned = basis.transpose() * whole.rows(zeros, left);
            whole.rows_mut(zeros, left).copy_from(&turned);
            whole.view_mut((zeros, zeros), (left, count)).fill(0.0);
            let all = turn.get_or_insert_with(|| DMatrix::identity(n, n));
            let turned = all.columns(zeros, left) * &basis;
            all.columns_mut(zeros, left).copy_from(&turned);
            if zeros == 0 {
                null = basis.columns(0, count).into_owned();
            }
            zeros += count;
            rounds += 1;
        }
    }

    /// Q times vectors, as columns: their real parts, then their imaginary parts.
    pub(super) fn back<'v>(&self, vectors: impl Iterator<Item = &'v Split> + Clone) -> DMatrix<f64> {
        let parts = vectors.clone().map(|vector| &vector.re).chain(vectors.map(|vector| &vector.im));
        let entries: Vec<f64> = parts.flatten().copied().collect();
        let n = self.form.nrows();
        let mut all = DMatrix::from_vec(n, entries.len() / n, entries);
        self.turns.1.apply(&mut all);
        match &self.turns.0 {
            Some(turn) => turn * all,
            None => all,
        }
    }
}

/// Whether the rest of a form behind its zeros has no singular value near to zero, as its factors at zero say.
fn is_regular(form: &DMatrix<f64>, zeros: usize, size: f64, limit: f64) -> bool {
    let rows = form.view_range(zeros.., zeros..).transpose();
    let mut shifted = Shifted::new(&rows, size);
    let least = shifted.at(0.0.into()).least_singular_value(&Split::start(rows.nrows()));
    least.is_some_and(|least| least > CLEAR.0 * limit)
}

/// An orthogonal matrix whose first columns, so many, are a basis of the null space of one. Where there is a gap in what a pivoted
/// factorisation leaves, that decides, and where not, all singular values.
fn null_space_first(matrix: &DMatrix<f64>, size: f64, limit: f64) -> Option<(usize, DMatrix<f64>)> {
    if let Some(null) = clear_null_space(matrix, size, limit) {
        let mut basis = DMatrix::identity(matrix.nrows(), matrix.nrows());
        let count = null.ncols();
        null.qr().q_tr_mul(&mut basis);
        return Some((count, basis.transpose()));
    }
    let values = SingularValues::of(matrix)?;
    let (rank, n) = (values.rank(limit), matrix.nrows());
    let mut basis = DMatrix::zeros(n, n);
    basis.columns_mut(0, n - rank).copy_from(&values.null_space(limit));
    basis.columns_mut(n - rank, rank).copy_from(&values.right().columns_range(..rank));
    Some((n - rank, basis))
}

fn clear_null_space(matrix: &DMatrix<f64>, size: f64, limit: f64) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let mut qr = PivotedQr::new(n, n, limit / size);
    qr.set_lengths(&vec![size; n]).ok()?;
    qr.clear();
    for (column, entries) in matrix.column_iter().enumerate() {
        entries.iter().enumerate().for_each(|(row, entry)| qr.set(row, column, *entry));
    }
    qr.factor().ok()?;
    let count = n - qr.rank();
    let dropped = qr.largest_dropped_ratio() * (count as f64).sqrt();
    let is_clear = qr.smallest_pivot_ratio() * size > CLEAR.1 * limit && dropped * size <= limit;
    is_clear.then(|| qr.null_space().ok()).flatten().map(|null| DMatrix::from_vec(n, count, null))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests {
    use super::super::tests::random;
    use super::*;

    /// Of a rank, with singular values between one and `least`.
    fn of_rank(n: usize, rank: usize, least: f64) -> DMatrix<f64> {
        let [u, v] = [1, 2].map(|seed| random(n, n + seed).qr().q());
        let values =
            DMatrix::from_fn(n, n, |i, j| if i == j && i < rank { least.powf(i as f64 / rank as f64) } else { 0.0 });
        u * values * v
    }

    #[test]
    fn null_spaces_are_those_of_all_singular_values() {
        for (n, rank) in [(1, 0), (5, 4), (40, 40), (40, 33), (90, 80)] {
            let a = of_rank(n, rank, 1e-4);
            let (size, limit) = (a.norm().max(1.0), 1e-12);
            let null = clear_null_space(&a, size, limit).unwrap();
            let (count, basis) = null_space_first(&a, size, limit).unwrap();
            let plain = SingularValues::of(&a).unwrap().null_space(limit);
            assert_eq!([null.ncols(), count, plain.ncols()], [n - rank; 3]);
            assert!((basis.transpose() * &basis - DMatrix::identity(n, n)).norm() < 1e-13);
            let first = basis.columns(0, count);
            assert!((&plain - first * (first.transpose() * &plain)).norm() < 1e-10, "{n} {rank}");
            assert!((&a * first).norm() < 1e-14 * n as f64);
        }
    }

    #[test]
    fn where_pivots_leave_a_doubt_all_singular_values_decide() {
        // The least of them is a little above the limit, or below.
        for (least, count) in [(2e-11, 0), (1.3e-12, 0), (7e-13, 1)] {
            let mut a = of_rank(12, 11, 0.5);
            let values = SingularValues::of(&a).unwrap();
            let [right, left] = [&a, &a.transpose()].map(|a| SingularValues::of(a).unwrap().null_space(1e-13));
            a += left * right.transpose() * least;
            assert!(values.values()[10] > 0.4);
            assert!(count == 1 || clear_null_space(&a, 1.0, 1e-12).is_none());
            assert_eq!(null_space_first(&a, 1.0, 1e-12).unwrap().0, count);
        }
    }

    #[test]
    fn zeros_come_first_those_without_vectors_too() {
        // Five free masses in a plane, turned: five double zeros, five vectors; and what does not move freely.
        let (n, free) = (40, 5);
        let mut a = random(n, 3);
        a.view_mut((0, 0), (n, 2 * free)).fill(0.0);
        (0..free).for_each(|k| a[(k, free + k)] = 1.0);
        let q = random(n, 4).qr().q();
        let a = &q * a * q.transpose();
        let parted = Parted::of(&a, a.norm(), 1e-12 * a.norm()).unwrap();
        assert_eq!((parted.zeros, parted.rounds, parted.null.ncols()), (2 * free, 2, free));
        assert!((&a * &parted.null).norm() < 1e-13 * a.norm());
        let columns: Vec<Split> = (0..n)
            .map(|k| Split { re: (0..n).map(|i| f64::from(u8::from(i == k))).collect(), im: vec![0.0; n] })
            .collect();
        let turn = parted.back(columns.iter()).columns(0, n).into_owned();
        assert!((&turn * &parted.form * turn.transpose() - &a).norm() < 1e-13 * a.norm());
        for k in 0..n {
            let below = k + usize::from(k >= 2 * free) + 1;
            assert!(parted.form.column(k).iter().skip(below).all(|entry| *entry == 0.0), "{k}");
        }
        assert!((0..2 * free).all(|k| parted.form[(k, k)] == 0.0));
    }
}
