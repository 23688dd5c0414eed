//! Singular values against eigenvalues of a symmetric matrix, and solutions against what defines them.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::factorisations::factored;
use crate::linalg::SingularValues;
use crate::random::Random;

/// Share of the largest value below which those of the test matrices are zero.
const ZERO: f64 = 1e-12;

fn size(random: &mut Random) -> [usize; 2] {
    let rows = 1 + random.below(12);
    [rows, if random.below(2) == 0 { rows } else { 1 + random.below(12) }]
}

/// A product of random factors: any rank from zero on.
fn of_any_rank(random: &mut Random) -> DMatrix<f64> {
    let [m, n] = size(random);
    let rank = random.below(m.min(n) + 1);
    random.matrix(m, rank) * random.matrix(rank, n)
}

/// A symmetric matrix without full rank, as Gram matrices of dependent rows are.
fn gram(random: &mut Random) -> DMatrix<f64> {
    let [n, _] = size(random);
    let rank = random.below(n) + 1;
    let rows = random.matrix(n, rank);
    &rows * rows.transpose()
}

/// Small integers, many of them zero, in any unit.
fn integers(random: &mut Random) -> DMatrix<f64> {
    let [m, n] = size(random);
    let unit = 10_f64.powi(random.below(600) as i32 - 300);
    DMatrix::from_fn(m, n, |_, _| (random.below(3) as f64 - 1.0) * unit)
}

/// Columns of zeros, rows that are copies.
fn with_copies(random: &mut Random) -> DMatrix<f64> {
    let [m, n] = size(random);
    let mut matrix = random.matrix(m, n);
    for row in 0..m / 2 {
        let copy = matrix.row(random.below(m)).into_owned();
        matrix.set_row(row, &copy);
    }
    (0..n).filter(|k| k % 3 == 1).for_each(|k| matrix.column_mut(k).fill(0.0));
    matrix
}

/// Values that are repeated, zero or small.
fn repeated(random: &mut Random) -> DMatrix<f64> {
    let [m, n] = size(random);
    let [left, right] = [m, n].map(|size| random.matrix(size, size).qr().q());
    let value = |i, j| if i == j { [0.0, 1.0, 1.0, 2.0, 1e-8][random.below(5)] } else { 0.0 };
    left * DMatrix::from_fn(m, n, value) * right
}

/// Rows over eight decades.
fn rows_of_all_sizes(random: &mut Random) -> DMatrix<f64> {
    let mut matrix = of_any_rank(random);
    matrix.row_iter_mut().for_each(|mut row| row *= 10_f64.powf(4.0 * random.next()));
    matrix
}

const KINDS: [fn(&mut Random) -> DMatrix<f64>; 6] =
    [of_any_rank, gram, integers, with_copies, repeated, rows_of_all_sizes];

/// The positive eigenvalues of [0 A; A^T 0] (Golub & Van Loan 2013, section 8.6), falling.
fn oracle(matrix: &DMatrix<f64>) -> Vec<f64> {
    let (m, n) = matrix.shape();
    let mut both = DMatrix::zeros(m + n, m + n);
    both.view_mut((0, m), (m, n)).copy_from(matrix);
    both.view_mut((m, 0), (n, m)).tr_copy_from(matrix);
    let mut values: Vec<f64> = SymmetricEigen::new(both).eigenvalues.iter().copied().collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values.truncate(m.min(n));
    values.resize(n, 0.0);
    values
}

#[test]
fn matrices_of_any_rank_are_decomposed() {
    let mut random = Random(71);
    for kind in KINDS {
        for _ in 0..1000 {
            let matrix = kind(&mut random);
            let found = SingularValues::of(&matrix).unwrap();
            let (values, u, v) = (found.values(), found.left(), found.right());
            let round_off = 5e-15 * matrix.nrows().max(matrix.ncols()) as f64;
            let back = u * DMatrix::from_diagonal(&DVector::from_column_slice(values)) * v.transpose();
            assert!((back - &matrix).amax() <= round_off * found.largest(), "{matrix}");
            assert!((v.tr_mul(v) - DMatrix::identity(v.nrows(), v.nrows())).amax() <= round_off, "{matrix}");
            let sides = DMatrix::from_fn(u.ncols(), u.ncols(), |i, j| f64::from(i == j && values[i] > 0.0));
            assert!((u.tr_mul(u) - sides).amax() <= round_off, "{matrix}");
            assert!(values.is_sorted_by(|a, b| a >= b), "{values:?}");
            // The oracle takes squares of entries: in a unit in which they do not vanish.
            let unit = if matrix.amax() > 0.0 { matrix.amax() } else { 1.0 };
            for (value, expected) in values.iter().zip(oracle(&matrix.unscale(unit))) {
                let off = (value / unit - expected).abs();
                assert!(off <= round_off * found.largest() / unit, "{value} for {expected}: {matrix}");
            }
        }
    }
}

#[test]
fn solutions_are_the_least_of_least_squares() {
    let mut random = Random(73);
    for kind in KINDS {
        for _ in 0..1000 {
            let matrix = kind(&mut random);
            let matrix = &matrix / if matrix.amax() > 0.0 { matrix.amax() } else { 1.0 };
            let [m, n] = [matrix.nrows(), matrix.ncols()];
            let found = SingularValues::of(&matrix).unwrap();
            let least = ZERO * found.largest();
            let qr = factored(&matrix);
            if qr.rank() != found.rank(least) {
                // Rows over decades leave values around the tolerances.
                assert!(std::ptr::fn_addr_eq(kind, KINDS[5]), "{matrix}");
                continue;
            }
            let b = DVector::from_vec(random.vector(m));
            let x = found.solve(&b, least);
            // What is left is across the range; the solution is across the null space, found by an elimination.
            let condition = found.largest() / found.values()[..qr.rank()].last().copied().unwrap_or(1.0);
            let close = 1e-12 * condition;
            assert!(matrix.tr_mul(&(&matrix * &x - &b)).amax() <= close * b.amax(), "{matrix}{b}");
            let null = DMatrix::from_vec(n, n - qr.rank(), qr.null_space().unwrap());
            let null = if null.is_empty() { null } else { null.qr().q() };
            assert!(null.tr_mul(&x).iter().all(|part| part.abs() <= close * x.amax()), "{matrix}{b}");
            let same = found.null_space(least);
            assert_eq!(same.shape(), null.shape());
            assert!(
                (&same * same.transpose() - &null * null.transpose()).iter().all(|off| off.abs() <= close),
                "{matrix}"
            );
        }
    }
}

/// Balls between plates: rows along two axes of a plane in which joints leave one direction. Their block is singular to round-off,
/// however the axes are turned.
#[test]
fn turned_systems_have_their_least_solution() {
    for k in 0..4000 {
        let angle = 0.37 + 1.618_033_988_749_895 * f64::from(k);
        let (s, c) = angle.sin_cos();
        let ways = [[1.0, 0.0], [0.3 * c, c], [0.3 * s, s]];
        // A = W B W^T with W of rank two; what it gives is in its range.
        let b = [[2.0, 0.7 * s], [0.7 * s, 1.0 + c * c]];
        let entry =
            |i: usize, j: usize| -> f64 { (0..4).map(|m| ways[i][m / 2] * b[m / 2][m % 2] * ways[j][m % 2]).sum() };
        let matrix = DMatrix::from_fn(3, 3, entry);
        let right = &matrix * DVector::from_vec(vec![0.4, -1.3, 0.9]);
        let values = SingularValues::of(&matrix).unwrap();
        let found = values.solve(&right, ZERO * values.largest());
        let null = DVector::from_vec(vec![0.0, -s, c]);
        assert!((&matrix * &found - &right).amax() < 1e-12, "{angle}");
        assert!(found.dot(&null).abs() < 1e-12, "{angle}");
    }
}

#[test]
fn small_values_keep_their_digits_between_columns_of_all_sizes() {
    // A D with A well conditioned: each value to its own round-off. A is the Pascal matrix, whose determinant is one.
    let pascal = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 1.0, 1.0, 2.0, 3.0, 1.0, 3.0, 6.0]);
    let scaled = &pascal * DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 1e-9, 1e9]));
    let product: f64 = SingularValues::of(&scaled).unwrap().values().iter().product();
    assert!((product - 1.0).abs() < 1e-13, "{product}");
}

#[test]
fn empty_matrices_and_such_without_numbers_are_answered() {
    for (m, n) in [(0, 0), (0, 3), (3, 0)] {
        let found = SingularValues::of(&DMatrix::zeros(m, n)).unwrap();
        assert_eq!((found.largest(), found.rank(0.0), found.null_space(0.0).shape()), (0.0, 0, (n, n)));
        assert_eq!(found.solve(&DVector::from_element(m, 1.0), 0.0), DVector::zeros(n));
    }
    for wrong in [f64::NAN, f64::INFINITY] {
        assert!(SingularValues::of(&DMatrix::from_element(2, 2, wrong)).is_none());
    }
    let ones = SingularValues::of(&DMatrix::from_element(3, 5, 1.0)).unwrap();
    assert!((ones.largest() - 15_f64.sqrt()).abs() < 1e-15 * 8.0);
    assert_eq!(ones.rank(1e-14), 1);
}
