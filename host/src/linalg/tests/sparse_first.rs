//! The engine that chooses, against the one that it chooses from.

use super::*;

fn sparse_first(problem: &Problem) -> SparseFirst {
    SparseFirst::new(&problem.structure, &problem.clusters, DEFAULT_RANK_TOLERANCE).unwrap()
}

#[test]
fn independent_rows_are_solved_without_the_dense_engine() {
    for problem in [Problem::chain(6), Problem::chain(40)] {
        let (f, g) = problem.random_sides(4);
        let dense = problem.solve(&mut problem.dense_qr(), &f, &g);
        let mut engine = sparse_first(&problem);
        let found = problem.solve(&mut engine, &f, &g);
        let scale = dense.a.amax().max(dense.lambda.amax());
        assert!((&found.a - &dense.a).amax() < 1e-11 * scale && (&found.lambda - &dense.lambda).amax() < 1e-11 * scale);
        assert!(!engine.uses_dense() && found.health.smallest_pivot_ratio >= TRUSTED);
    }
}

#[test]
fn dependent_rows_are_left_to_the_dense_engine() {
    let redundant = Problem::with_loops().with_dependent_row(0.0);
    let (f, mut g) = Problem::with_loops().random_sides(9);
    g.push(g[0] + g[1]);
    let dense = redundant.solve(&mut redundant.dense_qr(), &f, &g);
    let mut engine = sparse_first(&redundant);
    let found = redundant.solve(&mut engine, &f, &g);
    assert!(engine.uses_dense());
    assert_eq!((found.health.rank, &found.a), (dense.health.rank, &dense.a));
}

#[test]
fn rows_to_keep_are_kept_by_both() {
    let redundant = Problem::with_loops().with_dependent_row(0.0);
    // The last row contradicts the first two, which are to be kept.
    let (f, mut g) = Problem::with_loops().random_sides(9);
    g.push(g[0] + g[1] + 1.0);
    let mut engine = sparse_first(&redundant);
    engine.set_first_rows(&(0..redundant.structure.m - 1).collect::<Vec<_>>());
    let found = redundant.solve(&mut engine, &f, &g);
    let reached = redundant.dense_jacobian() * &found.a;
    assert!((0..g.len() - 1).all(|row| (reached[row] - g[row]).abs() < 1e-11));
    assert!((reached[g.len() - 1] - g[g.len() - 1] + 1.0).abs() < 1e-10);
}

#[test]
fn a_matrix_that_is_never_filled_takes_no_memory() {
    // 80 GB if it did.
    let mut large = PivotedQr::new(100_000, 100_000, DEFAULT_RANK_TOLERANCE);
    large.set_rank_limit(5);
    assert_eq!(large.rank(), 0);
}
