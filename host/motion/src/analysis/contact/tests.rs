use nalgebra::{DMatrix, DVector};

use super::smallest;

/// Rows along two axes of a plane in which joints leave one direction: their block is singular to round-off, however the axes are turned.
#[test]
fn singular_systems_have_their_smallest_solution() {
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
        let found = smallest(&matrix, &right);
        let null = DVector::from_vec(vec![0.0, -s, c]);
        assert!((&matrix * &found - &right).amax() < 1e-12, "{angle}");
        assert!(found.dot(&null).abs() < 1e-12, "{angle}");
    }
}
