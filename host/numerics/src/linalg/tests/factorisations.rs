//! Identities of the dense factorisations, and comparison with nalgebra.

use nalgebra::{DMatrix, DVector};

use super::Random;
use crate::linalg::*;

/// Random matrix of a given rank with columns of very different lengths.
fn matrix_of_rank(rows: usize, columns: usize, rank: usize, random: &mut Random) -> DMatrix<f64> {
    let mut matrix = random.matrix(rows, rank) * random.matrix(rank, columns);
    for (column, mut entries) in matrix.column_iter_mut().enumerate() {
        entries *= 10f64.powi(column as i32 % 5 - 2);
    }
    matrix
}

/// Dense and sparse storage.
const STORED: [fn(usize, usize, f64) -> PivotedQr; 2] = [PivotedQr::new, PivotedQr::sparse];

pub(super) fn factored(matrix: &DMatrix<f64>) -> PivotedQr {
    factored_by(STORED[0], matrix)
}

fn factored_by(stored: fn(usize, usize, f64) -> PivotedQr, matrix: &DMatrix<f64>) -> PivotedQr {
    let mut qr = stored(matrix.nrows(), matrix.ncols(), DEFAULT_RANK_TOLERANCE);
    fill(&mut qr, matrix);
    qr.factor().unwrap();
    qr
}

/// The column of `R` at a place.
fn upper(qr: &PivotedQr, place: usize) -> Vec<f64> {
    let mut column = vec![0.0; qr.rank()];
    if place < qr.rank() {
        qr.add(place, qr.independent_columns()[place], 1.0, &mut column);
        column[place] = qr.diagonal(place);
    } else {
        qr.add(qr.rank(), qr.dependent_columns()[place - qr.rank()], 1.0, &mut column);
    }
    column
}

fn fill(qr: &mut PivotedQr, matrix: &DMatrix<f64>) {
    qr.clear();
    for (column, entries) in matrix.column_iter().enumerate() {
        entries.iter().enumerate().for_each(|(row, value)| qr.set(row, column, *value));
    }
}

#[test]
fn pivoted_qr_reproduces_the_matrix() {
    let mut random = Random(31);
    for (rows, columns, rank) in [(8, 5, 5), (8, 5, 3), (5, 9, 5), (6, 6, 2), (4, 3, 0)] {
        let matrix = matrix_of_rank(rows, columns, rank, &mut random);
        let falling =
            |qr: &PivotedQr| (1..rank).all(|k| qr.diagonal(k).abs() <= qr.diagonal(k - 1).abs() * (1.0 + 1e-12));
        assert!(falling(&factored(&matrix)), "pivots fall");
        for stored in STORED {
            let mut qr = factored_by(stored, &matrix);
            assert_eq!(qr.rank(), rank);
            let order = [qr.independent_columns(), qr.dependent_columns()].concat();
            let mut last_pivot = f64::INFINITY;
            for (place, &column) in order.iter().enumerate() {
                // Q [r; 0] is the scaled column.
                let mut x = vec![0.0; rows];
                x[..rank].copy_from_slice(&upper(&qr, place));
                qr.apply_q(&mut x);
                let scaled = matrix.column(column) * qr.column_scale(column);
                assert!((DVector::from_vec(x) - scaled).amax() < 1e-13);
                if place < rank {
                    let pivot = qr.diagonal(place).abs();
                    last_pivot = last_pivot.min(pivot);
                }
            }
            if rank > 0 {
                assert_eq!(qr.smallest_pivot_ratio(), last_pivot);
            }
        }
    }
}

/// The Jacobian of loops along a chain, transposed: each column has entries in the rows of its own and the next link.
fn chain_of_loops(links: usize, random: &mut Random) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(3 * links + 3, 2 * links);
    for column in 0..2 * links {
        for row in 0..6 {
            matrix[(column / 2 * 3 + row, column)] = random.next();
        }
    }
    matrix
}

#[test]
fn sparse_storage_finds_the_ranks_and_solutions_of_dense_storage() {
    let mut random = Random(67);
    let mut matrix = chain_of_loops(30, &mut random);
    // Columns that depend on others of their link and of the next, and rows of all sizes.
    for column in (8..50).step_by(10) {
        let sum = matrix.column(column + 1) + 2.0 * matrix.column(column - 2);
        matrix.set_column(column, &sum);
    }
    for (row, mut entries) in matrix.row_iter_mut().enumerate() {
        entries *= 10f64.powi(row as i32 % 7 - 3);
    }
    let (b, g) = (random.vector(93), matrix.transpose() * DVector::from_vec(random.vector(93)));
    let solve = |qr: &mut PivotedQr| {
        assert_eq!(qr.rank(), 55);
        let (mut x, mut y) = (vec![0.0; 60], vec![0.0; 93]);
        let left = qr.least_squares(b.as_slice(), &mut x).unwrap();
        assert!(qr.min_norm_solve(g.as_slice(), &mut y).unwrap() < 1e-12);
        let basis = DMatrix::from_vec(60, 5, qr.null_space().unwrap());
        assert!((&matrix * &basis).amax() < 1e-12 * matrix.amax() * basis.amax());
        // A x is unique, whichever columns are called dependent.
        (&matrix * DVector::from_vec(x), DVector::from_vec(y), left)
    };
    let [mut dense, mut sparse] = STORED.map(|stored| factored_by(stored, &matrix));
    let (found, expected) = (solve(&mut sparse), solve(&mut dense));
    assert!((&found.0 - &expected.0).amax() < 1e-10 * expected.0.amax());
    assert!((&found.1 - &expected.1).amax() < 1e-10 * expected.1.amax());
    assert!((found.2 - expected.2).abs() < 1e-10 * expected.2);
    let entries: usize = (0..60).map(|place| upper(&sparse, place).iter().filter(|x| **x != 0.0).count()).sum();
    assert!(entries < 60 * 6, "{entries} entries in R: as many rows stay open as two links share");
}

/// Rows off their manifold: columns that depend on others but for a little come last, whatever they have for entries.
#[test]
fn a_limit_of_rank_leaves_out_what_is_nearly_dependent() {
    let mut random = Random(71);
    let mut matrix = chain_of_loops(30, &mut random);
    for column in (8..50).step_by(10) {
        let sum = matrix.column(column + 1) + 2.0 * matrix.column(column - 2) + 1e-7 * matrix.column(column);
        matrix.set_column(column, &sum);
    }
    for stored in STORED {
        let mut qr = stored(93, 60, 1e-12);
        fill(&mut qr, &matrix);
        qr.set_rank_limit(55);
        qr.factor().expect("finite");
        assert_eq!(qr.rank(), 55);
        assert!(qr.smallest_pivot_ratio() > 1e-3, "{:e}", qr.smallest_pivot_ratio());
        let dropped = qr.largest_dropped_ratio();
        assert!(dropped < 1e-6 && dropped > 1e-9, "{dropped:e}");
    }
}

#[test]
fn the_complement_is_orthonormal_and_orthogonal_to_all_columns() {
    let mut random = Random(91);
    let mut matrix = chain_of_loops(20, &mut random);
    // One column follows from two others.
    let sum = matrix.column(3) + 2.0 * matrix.column(4);
    matrix.set_column(7, &sum);
    for stored in STORED {
        let mut qr = factored_by(stored, &matrix);
        assert!(qr.rank() < matrix.ncols());
        let basis = DMatrix::from_vec(matrix.nrows(), matrix.nrows() - qr.rank(), qr.complement().unwrap());
        let gram = basis.transpose() * &basis - DMatrix::identity(basis.ncols(), basis.ncols());
        assert!(gram.amax() < 1e-13, "{:e}", gram.amax());
        let along = matrix.transpose() * &basis;
        assert!(along.amax() < 1e-13 * matrix.amax(), "{:e}", along.amax());
    }
}

#[test]
fn down_dated_lengths_survive_cancellation() {
    // Columns that agree to 1e-7 lose half their digits in the first step; the pivots must
    // still be the largest true remainders (Drmac & Bujanovic's failure of older codes).
    let mut random = Random(37);
    let base = random.vector(12);
    let matrix = DMatrix::from_fn(12, 8, |row, column| base[row] + 1e-7 * 3f64.powi(-(column as i32)) * random.next());
    let mut qr = PivotedQr::new(12, 8, 1e-14);
    fill(&mut qr, &matrix);
    qr.factor().unwrap();
    for k in 1..qr.rank() {
        let pivot = qr.diagonal(k).abs();
        for place in k + 1..qr.rank() {
            let remainder = two_norm(&upper(&qr, place)[k..]);
            assert!(remainder <= pivot * (1.0 + 1e-6), "{k} {place}");
        }
    }
    assert_eq!(qr.rank(), 8);
}

#[test]
fn least_squares_leaves_a_residual_normal_to_the_columns() {
    let mut random = Random(41);
    for rank in [3, 5] {
        let matrix = matrix_of_rank(9, 5, rank, &mut random);
        let b = random.vector(9);
        let mut x = vec![f64::NAN; 5];
        let mut qr = factored(&matrix);
        let length = qr.least_squares(&b, &mut x).unwrap();
        let residual = &matrix * DVector::from_vec(x.clone()) - DVector::from_vec(b);
        assert!((residual.norm() - length).abs() < 1e-12);
        assert!((matrix.transpose() * residual).amax() < 1e-10);
        assert!(qr.dependent_columns().iter().all(|&column| x[column] == 0.0));
    }
}

#[test]
fn min_norm_solution_is_the_pseudo_inverse() {
    let mut random = Random(43);
    for rank in [3, 5] {
        let matrix = matrix_of_rank(9, 5, rank, &mut random);
        let g = matrix.transpose() * DVector::from_vec(random.vector(9));
        let mut x = vec![f64::NAN; 9];
        let miss = factored(&matrix).min_norm_solve(g.as_slice(), &mut x).unwrap();
        let oracle = SingularValues::of(&matrix.transpose()).unwrap().solve(&g, 1e-10);
        assert!(miss < 1e-12);
        assert!((DVector::from_vec(x.clone()) - oracle).amax() < 1e-10);

        // An inconsistent right side shows, if some column is dependent.
        let mut qr = factored(&matrix);
        let wrong: Vec<f64> = g.iter().map(|value| value + value.abs()).collect();
        let miss = qr.min_norm_solve(&wrong, &mut x).unwrap();
        assert_eq!(miss > 1e-3, rank < 5, "{miss}");
    }
}

#[test]
fn null_space_is_complete() {
    let mut random = Random(47);
    let matrix = matrix_of_rank(7, 6, 4, &mut random);
    let qr = factored(&matrix);
    let basis = DMatrix::from_vec(6, 2, qr.null_space().unwrap());
    assert!((&matrix * &basis).amax() < 1e-11 * matrix.amax());
    assert_eq!(SingularValues::of(&basis).unwrap().rank(1e-9), 2);
}

#[test]
fn round_off_columns_are_no_directions() {
    let mut matrix = Random(53).matrix(5, 3);
    matrix.column_mut(1).scale_mut(1e-17);
    let qr = factored(&matrix);
    assert_eq!((qr.rank(), qr.dependent_columns()), (2, &[1][..]));
}

#[test]
fn matrices_are_consumed_by_their_factorisation() {
    let mut qr = factored(&DMatrix::identity(2, 2));
    assert_eq!(qr.factor(), Err(LinalgError::NotFactored));
    qr.clear();
    qr.set(0, 0, f64::INFINITY);
    assert!(matches!(qr.factor(), Err(LinalgError::NotFinite { .. })));
    assert_eq!(qr.null_space(), Err(LinalgError::NotFactored));
    assert!(qr.set_first_group(&[2]).is_err());
}

fn lu_of(matrix: &DMatrix<f64>) -> FullPivLu {
    let mut lu = FullPivLu::new(matrix.nrows(), DEFAULT_RANK_TOLERANCE);
    lu.entries_mut().copy_from_slice(matrix.as_slice());
    lu.factor().unwrap();
    lu
}

/// Order of rows, order of columns and entries of `L` and `U`, one entry after the other.
fn plainly_factored(mut a: DMatrix<f64>) -> (Vec<usize>, Vec<usize>, DMatrix<f64>) {
    let n = a.nrows();
    let (mut rows, mut columns): (Vec<usize>, Vec<usize>) = ((0..n).collect(), (0..n).collect());
    for k in 0..n {
        let mut best = (k, k);
        for column in k..n {
            for row in k..n {
                if a[(row, column)].abs() > a[best].abs() {
                    best = (row, column);
                }
            }
        }
        a.swap_rows(k, best.0);
        rows.swap(k, best.0);
        a.swap_columns(k, best.1);
        columns.swap(k, best.1);
        for row in k + 1..n {
            a[(row, k)] /= a[(k, k)];
            for column in k + 1..n {
                let factor = a[(k, column)];
                a[(row, column)] += -factor * a[(row, k)];
            }
        }
    }
    (rows, columns, a)
}

#[test]
fn full_pivoting_lu_equals_its_plain_twin_bit_for_bit() {
    let mut random = Random(61);
    // Around the lanes in which columns are looked at; of equal entries the first counts.
    for n in [1, 2, 3, 7, 8, 9, 15, 16, 17, 40] {
        for steps in [0.0, 4.0] {
            let entry = |x: f64| if steps > 0.0 { (steps * x).round() / steps } else { x };
            let mut matrix = random.matrix(n, n).map(entry);
            (0..n).for_each(|k| matrix[(k, k)] += 0.75 + k as f64 * 0.01);
            let (rows, columns, entries) = plainly_factored(matrix.clone());
            let mut lu = lu_of(&matrix);
            assert_eq!(lu.rank(), n);
            assert_eq!(lu.orders(), (&rows[..], &columns[..]), "{n}, {steps}");
            assert!(lu.entries_mut().iter().zip(entries.iter()).all(|(own, plain)| own.to_bits() == plain.to_bits()));
        }
    }
}

#[test]
fn full_pivoting_lu_equals_nalgebra() {
    let mut random = Random(59);
    for n in [1, 2, 5, 12] {
        let matrix = random.matrix(n, n);
        let b = DVector::from_vec(random.vector(n));
        let mut x = vec![f64::NAN; n];
        let mut lu = lu_of(&matrix);
        let miss = lu.solve(b.as_slice(), &mut x).unwrap();
        let oracle = matrix.full_piv_lu().solve(&b).unwrap();
        assert_eq!((lu.rank(), miss), (n, 0.0));
        assert!((DVector::from_vec(x) - &oracle).amax() < 1e-12 * oracle.amax());
    }
}

#[test]
fn singular_consistent_systems_have_a_basic_solution() {
    let mut random = Random(61);
    let matrix = matrix_of_rank(8, 8, 5, &mut random);
    assert_eq!(SingularValues::of(&matrix).unwrap().rank(1e-9), 5);
    let b = &matrix * DVector::from_vec(random.vector(8));
    let mut lu = lu_of(&matrix);
    let mut x = vec![f64::NAN; 8];
    let miss = lu.solve(b.as_slice(), &mut x).unwrap();
    assert_eq!((lu.rank(), lu.dependent_rows().len()), (5, 3));
    assert!(lu.free_columns().iter().all(|&column| x[column] == 0.0));
    assert!((&matrix * DVector::from_vec(x.clone()) - &b).amax() < 1e-11 * b.amax());
    assert!(miss < 1e-12);

    let miss = lu.solve(&random.vector(8), &mut x).unwrap();
    assert!(miss > 1e-3, "contradiction shows: {miss}");
}

/// Units in which masses are one and the largest entry of each constraint row is: what the owner of a saddle point system
/// multiplies its rows and columns by, since the factorisation itself scales nothing.
fn natural_units(masses: &[f64], jacobian: &DMatrix<f64>) -> DVector<f64> {
    let coordinates: Vec<f64> = masses.iter().map(|mass| 1.0 / mass.sqrt()).collect();
    let largest =
        |row: usize| (0..masses.len()).map(|k| (coordinates[k] * jacobian[(row, k)]).abs()).fold(0.0, f64::max);
    let rows = (0..jacobian.nrows()).map(|row| 1.0 / largest(row));
    DVector::from_vec(coordinates.iter().copied().chain(rows).collect())
}

#[test]
fn light_bodies_are_not_missing_bodies() {
    // A system of saddle point form with masses of 1e-12 beside rows of order one, and one
    // dependent row: in natural units the rank is that of the same system with masses of one.
    let mut random = Random(67);
    let mut jacobian = random.matrix(4, 6);
    let sum = jacobian.row(0) + jacobian.row(1);
    jacobian.set_row(3, &sum);
    for masses in [[1.0; 6], [1e-11, 1e-9, 1e-11, 1e-10, 1e-12, 1e-11], [1e-11, 1e-9, 1e-11, 5.0, 1e3, 1e-11]] {
        let mut matrix = DMatrix::zeros(10, 10);
        for (k, &mass) in masses.iter().enumerate() {
            matrix[(k, k)] = mass;
        }
        matrix.view_mut((6, 0), (4, 6)).copy_from(&jacobian);
        matrix.view_mut((0, 6), (6, 4)).copy_from(&jacobian.transpose());
        let unit = natural_units(&masses, &jacobian);
        let mut lu = lu_of(&DMatrix::from_fn(10, 10, |i, j| unit[i] * matrix[(i, j)] * unit[j]));
        assert_eq!(lu.rank(), 9, "{masses:?}");
        assert!(lu.smallest_pivot_ratio() > 100.0 * DEFAULT_RANK_TOLERANCE, "{}", lu.smallest_pivot_ratio());

        // Accelerations and multipliers of such bodies are solved for with a small backward error, equation by equation.
        let b = &matrix * DVector::from_vec(random.vector(10)).component_mul(&unit);
        let mut x = vec![f64::NAN; 10];
        lu.solve(b.component_mul(&unit).as_slice(), &mut x).unwrap();
        let x = DVector::from_vec(x).component_mul(&unit);
        let size = matrix.abs() * x.abs() + b.abs();
        for (row, error) in (&matrix * x - b).iter().enumerate() {
            assert!(error.abs() <= 1e-13 * size[row], "row {row}");
        }
    }
}

#[test]
fn empty_and_zero_matrices_are_solved() {
    let mut lu = lu_of(&DMatrix::zeros(0, 0));
    assert_eq!((lu.rank(), lu.solve(&[], &mut [])), (0, Ok(0.0)));
    let mut lu = lu_of(&DMatrix::zeros(2, 2));
    let mut x = [f64::NAN; 2];
    assert_eq!((lu.rank(), lu.solve(&[0.0, 3.0], &mut x)), (0, Ok(1.0)));
    assert_eq!(x, [0.0, 0.0]);
    assert_eq!(factored(&DMatrix::zeros(0, 3)).rank(), 0);
}

#[test]
fn rows_of_all_sizes_are_solved_to_round_off_of_each() {
    // Rows over twenty decades, large ones last: without sorting, reflections would spread round-off of the large ones over the
    // small ones. The solution is exact in integers and powers of two.
    let sizes: Vec<f64> = (0..8).map(|row| 2f64.powi(9 * row - 40)).collect();
    let mut random = Random(61);
    let whole = DMatrix::from_fn(8, 4, |_, _| (8.0 * random.next()).round());
    let x = [3.0, -5.0, 7.0, 2.0];
    let mut qr = PivotedQr::new(8, 4, 0.0);
    fill(&mut qr, &DMatrix::from_fn(8, 4, |row, column| sizes[row] * whole[(row, column)]));
    qr.factor().unwrap();
    // Rows in the way of each other by a rest that no unknown takes away: it is left where it weighs least.
    let b: Vec<f64> = (0..8).map(|row| sizes[row] * (0..4).map(|k| whole[(row, k)] * x[k]).sum::<f64>()).collect();
    let mut found = vec![f64::NAN; 4];
    qr.least_squares(&b, &mut found).unwrap();
    for (found, x) in found.iter().zip(x) {
        assert!((found - x).abs() < 1e-13, "{found} for {x}");
    }
}
