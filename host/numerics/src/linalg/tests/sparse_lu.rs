//! Sparse elimination against dense, and what it costs along a chain.

use nalgebra::DMatrix;

use crate::linalg::SparseLu;
use crate::random::Random;

/// A few entries in each row, some of them zero, without a diagonal that could be relied on.
fn of_few_entries(random: &mut Random) -> DMatrix<f64> {
    let n = 1 + random.below(40);
    let mut matrix = DMatrix::zeros(n, n);
    for row in 0..n {
        matrix[(row, (row + n / 2) % n)] = 0.1 + random.next().abs();
        for _ in 0..random.below(4) {
            matrix[(row, random.below(n))] = (random.below(3) as f64 - 1.0) * (1.0 + random.next().abs());
        }
    }
    matrix
}

/// The saddle point matrix of a chain: bodies with two velocities, held to the one before by a row.
fn chain(bodies: usize, random: &mut Random) -> DMatrix<f64> {
    let n = 2 * bodies;
    let mut matrix = DMatrix::zeros(n + bodies, n + bodies);
    (0..n).for_each(|k| matrix[(k, k)] = 1.0 + random.next().abs());
    for row in 0..bodies {
        for column in (2 * row).saturating_sub(2)..2 * row + 2 {
            let slope = random.next();
            (matrix[(n + row, column)], matrix[(column, n + row)]) = (slope, slope);
        }
    }
    matrix
}

#[test]
fn solutions_are_those_of_dense_elimination() {
    let mut random = Random(81);
    let mut singular = 0;
    for _ in 0..4000 {
        let matrix = of_few_entries(&mut random);
        let n = matrix.nrows();
        let right = random.matrix(n, 3);
        let dense = matrix.clone().full_piv_lu();
        // Beyond this nothing can be said with the digits there are.
        let condition = matrix.clone().try_inverse().map_or(f64::INFINITY, |inverse| inverse.norm() * matrix.norm());
        let Some(sparse) = SparseLu::of(&matrix).filter(|_| condition < 1e10) else {
            assert!(condition > 1e10, "a matrix of condition {condition:.1e} is called singular: {matrix}");
            singular += 1;
            continue;
        };
        let (found, expected) = (sparse.solve(&right), dense.solve(&right).unwrap());
        assert!((&found - &expected).norm() <= 1e-15 * condition * n as f64 * expected.norm(), "{matrix}");
        assert!((&matrix * &found - &right).norm() <= 1e-12 * matrix.norm() * found.norm(), "{matrix}");
    }
    assert!((1000..3500).contains(&singular), "{singular}");
}

#[test]
fn chains_fill_in_proportion() {
    let mut random = Random(83);
    let [one, two] = [60, 120].map(|bodies| SparseLu::of(&chain(bodies, &mut random)).unwrap().entries());
    assert!(two * 10 <= one * 21, "{one} entries, then {two}");
    assert!(one < 20 * 180, "{one}");
}

#[test]
fn what_is_not_finite_or_singular_has_no_factors() {
    assert!(SparseLu::of(&DMatrix::from_row_slice(2, 2, &[1.0, f64::NAN, 0.0, 1.0])).is_none());
    assert!(SparseLu::of(&DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 4.0])).is_none());
    assert!(SparseLu::of(&DMatrix::zeros(0, 0)).is_some());
}
