//! [`Turn`]: the orthogonal transformation of a matrix to Hessenberg's form.

use nalgebra::{DMatrix, DVector};

/// Reflections that are applied together.
const TOGETHER: usize = 32;

/// An orthogonal matrix, as products of reflections I - V T V^T, V with so many rows that they end with the matrix's.
///
/// Golub & Van Loan, "Matrix Computations", 4th ed. 2013, section 7.4.2, with the reflections of several columns kept for the rest of the
/// matrix until it takes them all as products of matrices (Dongarra, Hammarling & Sorensen 1989, doi:10.1016/0377-0427(89)90367-1).
pub(super) struct Turn {
    blocks: Vec<[DMatrix<f64>; 2]>,
}

impl Turn {
    /// Turns a matrix, which below its first diagonal is zero in the columns before `from`, so that all columns are: Q^T A Q, where Q
    /// leaves the first rows, `from` and the one after them, as they are.
    pub(super) fn to_form(a: &mut DMatrix<f64>, from: usize) -> Self {
        let n = a.nrows();
        let mut blocks = Vec::new();
        let mut k = from;
        while k + 2 < n {
            let (rows, width) = (n - k - 1, TOGETHER.min(n - 2 - k));
            let (mut v, mut t) = (DMatrix::zeros(rows, width), DMatrix::zeros(width, width));
            // A V T, for products from the right.
            let mut moved = DMatrix::zeros(n, width);
            for i in 0..width {
                let j = k + i;
                let mut column = a.column(j).into_owned();
                if i > 0 {
                    let before = v.columns(0, i);
                    column.gemv(-1.0, &moved.columns(0, i), &before.row(i - 1).transpose(), 1.0);
                    let mut below = column.rows_mut(k + 1, rows);
                    let along = t.view((0, 0), (i, i)).tr_mul(&before.tr_mul(&below));
                    below.gemv(-1.0, &before, &along, 1.0);
                }
                let (tau, left) = reflection(&mut column.as_mut_slice()[j + 1..]);
                let own = column.rows(j + 1, n - j - 1);
                let mut by_own = times(&a.as_slice()[(j + 1) * n..], own.as_slice(), n);
                t[(i, i)] = tau;
                if i > 0 {
                    let along = v.view((i, 0), (rows - i, i)).tr_mul(&own);
                    by_own.gemv(-1.0, &moved.columns(0, i), &along, 1.0);
                    let across = t.view((0, 0), (i, i)) * along * -tau;
                    t.view_mut((0, i), (i, 1)).copy_from(&across);
                }
                moved.set_column(i, &(by_own * tau));
                v.view_mut((i, i), (rows - i, 1)).copy_from(&own);
                a.view_mut((0, j), (j + 1, 1)).copy_from(&column.rows(0, j + 1));
                a.view_mut((j + 1, j), (n - j - 1, 1)).fill(0.0);
                a[(j + 1, j)] = left;
            }
            let behind = n - k - width;
            let across = v.rows(width - 1, behind).transpose();
            a.columns_mut(k + width, behind).gemm(-1.0, &moved, &across, 1.0);
            let mut part = a.view_mut((k + 1, k + width), (rows, behind));
            let along = t.transpose() * (v.transpose() * &part);
            part.gemm(-1.0, &v, &along, 1.0);
            blocks.push([v, t]);
            k += width;
        }
        Self { blocks }
    }

    /// Q X.
    pub(super) fn apply(&self, x: &mut DMatrix<f64>) {
        for [v, t] in self.blocks.iter().rev() {
            let mut part = x.rows_mut(x.nrows() - v.nrows(), v.nrows());
            let along = t * (v.transpose() * &part);
            part.gemm(-1.0, v, &along, 1.0);
        }
    }
}

/// Makes the v of I - tau v v^T, which leaves of a vector that is not empty its first entry only, of it; gives tau and that entry.
fn reflection(x: &mut [f64]) -> (f64, f64) {
    let largest = x[1..].iter().fold(0.0_f64, |largest, entry| largest.max(entry.abs()));
    let first = std::mem::replace(&mut x[0], 1.0);
    if largest == 0.0 {
        return (0.0, first);
    }
    let largest = largest.max(first.abs());
    let share = first / largest;
    let squares: f64 = x[1..].iter().map(|entry| (entry / largest) * (entry / largest)).sum();
    let length = -(share * share + squares).sqrt().copysign(share);
    x[1..].iter_mut().for_each(|entry| *entry /= first - length * largest);
    ((length - share) / length, length * largest)
}

/// A matrix of so many rows, column by column, times a vector.
fn times(columns: &[f64], x: &[f64], rows: usize) -> DVector<f64> {
    let mut product = DVector::zeros(rows);
    let of_four = columns.chunks_exact(4 * rows);
    let (left, of_left) = (of_four.remainder(), &x[x.len() - x.len() % 4..]);
    for (four, x) in of_four.zip(x.chunks_exact(4)) {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| &four[k * rows..(k + 1) * rows]);
        for ((((sum, a), b), c), d) in product.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *sum += a * x[0] + b * x[1] + (c * x[2] + d * x[3]);
        }
    }
    for (column, x) in left.chunks_exact(rows).zip(of_left) {
        product.iter_mut().zip(column).for_each(|(sum, entry)| *sum += entry * x);
    }
    product
}

#[cfg(test)]
mod tests {
    use super::super::tests::random;
    use super::*;

    fn is_form(form: &DMatrix<f64>) -> bool {
        (0..form.ncols()).all(|k| form.column(k).iter().skip(k + 2).all(|entry| *entry == 0.0))
    }

    #[test]
    fn forms_are_those_of_single_reflections() {
        for n in [1, 2, 3, 4, 32, 33, 34, 35, 67, 120] {
            let a = random(n, n);
            let mut form = a.clone();
            let turn = Turn::to_form(&mut form, 0);
            let mut q = DMatrix::identity(n, n);
            turn.apply(&mut q);
            assert!(is_form(&form), "{n}");
            assert!((&q * q.transpose() - DMatrix::identity(n, n)).norm() < 1e-13, "{n}");
            assert!((&q * &form * q.transpose() - &a).norm() < 1e-14 * n as f64 * a.norm(), "{n}");
            // The form is unique but for signs.
            let plain = a.clone().hessenberg().unpack_h();
            assert!((form.abs() - plain.abs()).norm() < 1e-10 * a.norm(), "{n}");
        }
    }

    #[test]
    fn what_is_a_form_already_in_the_first_columns_stays() {
        let (n, from) = (50, 7);
        let mut a = random(n, n);
        (0..from).for_each(|k| a.view_mut((k + 1, k), (n - k - 1, 1)).fill(0.0));
        let mut form = a.clone();
        let turn = Turn::to_form(&mut form, from);
        let mut q = DMatrix::identity(n, n);
        turn.apply(&mut q);
        assert!(is_form(&form));
        assert_eq!(form.columns(0, from), a.columns(0, from));
        assert_eq!(q.columns(0, from + 1), DMatrix::identity(n, n).columns(0, from + 1));
        assert!((&q * &form * q.transpose() - &a).norm() < 1e-13 * a.norm());
    }

    #[test]
    fn reflections_neither_vanish_nor_overflow() {
        for size in [1e-300, 1.0, 1e300] {
            let mut axis = [3.0 * size, 0.0, -4.0 * size];
            let (tau, left) = reflection(&mut axis);
            assert!((left / size + 5.0).abs() < 1e-14, "{left}");
            // (I - tau v v^T) x
            let along = tau * (3.0 - 4.0 * axis[2]);
            assert!((4.0 + along * axis[2]).abs() < 1e-14);
        }
        assert_eq!(reflection(&mut [7.0, 0.0]), (0.0, 7.0));
    }
}
