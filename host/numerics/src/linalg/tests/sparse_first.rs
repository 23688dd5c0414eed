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

/// Two chains side by side that are joined at every link: loops with dependent rows.
fn ladder() -> Problem {
    let mut problem = Problem::with_loops();
    for _ in 0..2 {
        problem = problem.with_dependent_row(0.0);
    }
    problem
}

#[test]
fn sparse_rank_equals_dense_rank() {
    let problems = [Problem::chain(12), Problem::with_loops(), ladder(), Problem::chain(9).with_dependent_row(0.0)];
    let mut redundant = 0;
    for problem in &problems {
        let Problem { structure, mass, jacobian, clusters } = problem;
        let found = SparseRank::find(structure, clusters, mass, jacobian).unwrap().unwrap();
        let mut dense = DenseQr::new(structure, DEFAULT_RANK_TOLERANCE).unwrap();
        dense.set_mass(mass).unwrap();
        let health = dense.refactor(jacobian).unwrap();
        assert_eq!(found.independent.len(), health.rank);
        assert_eq!(found.independent.len() + found.dependent.len(), structure.m);
        redundant += found.dependent.len();
        // Within the few powers of ten that a choice of rows can make.
        let ratio = found.smallest_sine / health.smallest_pivot_ratio;
        assert!((1e-3..1e3).contains(&ratio), "{ratio:e}");
        let matrix = problem.dense_jacobian();
        let vectors = found.null_space(structure, clusters, mass, jacobian).unwrap().unwrap();
        for (vector, row) in vectors.iter().zip(&found.dependent) {
            let mut lambda = DVector::zeros(structure.m);
            vector.iter().for_each(|(row, value)| lambda[*row] = *value);
            assert_eq!(lambda[*row], 1.0);
            assert!((matrix.transpose() * &lambda).amax() < 1e-8 * lambda.amax(), "{row}");
        }
    }
    assert_eq!(redundant, 3);
}

#[test]
fn rows_in_doubt_are_looked_at_without_squares() {
    // Seen as a square, a remainder of 1e-4 is neither round-off nor beyond doubt.
    for (problem, dependent) in [
        (Problem::with_loops().with_dependent_row(1e-4), 0),
        // The same row twice: each is in doubt, and one of them depends on the other.
        (Problem::with_loops().with_dependent_row(1e-4).with_dependent_row(1e-4), 1),
        (Problem::with_loops().with_dependent_row(1e-4).with_dependent_row(-3e-5), 1),
        (Problem::with_loops().with_dependent_row(1e-4).with_dependent_row(0.0), 1),
    ] {
        let Problem { structure, mass, jacobian, clusters } = &problem;
        let found = SparseRank::find(structure, clusters, mass, jacobian).unwrap().unwrap();
        let mut dense = DenseQr::new(structure, DEFAULT_RANK_TOLERANCE).unwrap();
        dense.set_mass(mass).unwrap();
        let health = dense.refactor(jacobian).unwrap();
        assert_eq!((found.independent.len(), found.dependent.len()), (health.rank, dependent));
        assert!((1e-6..1e-3).contains(&found.smallest_sine), "{:e}", found.smallest_sine);
        // The engine solves with them.
        let (f, _) = problem.random_sides(3);
        let motion = DVector::from_vec(Random(8).vector(structure.n));
        let g = (problem.dense_jacobian() * motion).as_slice().to_vec();
        let wanted = problem.solve(&mut dense, &f, &g);
        let mut solver = sparse_first(&problem);
        solver.set_mass(mass).unwrap();
        solver.set_light(0.0);
        let reached = problem.solve(&mut solver, &f, &g);
        assert!(!solver.uses_dense());
        assert!((&reached.a - &wanted.a).amax() < 1e-8 * wanted.a.amax());
    }
}

#[test]
fn rows_that_squares_take_for_dependent_are_left_to_the_dense_engine() {
    // Of round-off in squares, with more than round-off left of the vector: shows when the null vector is formed.
    let Problem { structure, mass, jacobian, clusters } = Problem::with_loops().with_dependent_row(1e-6);
    let rank = SparseRank::find(&structure, &clusters, &mass, &jacobian).unwrap().unwrap();
    assert_eq!(rank.dependent.len(), 1);
    assert_eq!(rank.null_space(&structure, &clusters, &mass, &jacobian).unwrap(), None);
}

#[test]
fn a_choice_of_rows_solves_like_the_dense_engine_and_gives_way_where_rows_contradict() {
    let problem = ladder();
    let matrix = problem.dense_jacobian();
    let mut dense = DenseQr::new(&problem.structure, DEFAULT_RANK_TOLERANCE).unwrap();
    dense.set_mass(&problem.mass).unwrap();
    dense.refactor(&problem.jacobian).unwrap();
    let mut solver = sparse_first(&problem);
    solver.set_mass(&problem.mass).unwrap();
    solver.set_light(0.0);
    let (n, m) = (problem.structure.n, problem.structure.m);
    let mut random = Random(5);
    let f = random.vector(n);
    let motion = DVector::from_vec(random.vector(n));
    for (g, consistent) in [((matrix * motion).as_slice().to_vec(), true), (random.vector(m), false)] {
        solver.refactor(&problem.jacobian).unwrap();
        assert!(!solver.uses_dense());
        let (mut a, mut b, mut lambda) = (vec![0.0; n], vec![0.0; n], vec![0.0; m]);
        solver.solve(&f, &g, &mut a, &mut lambda).unwrap();
        assert_eq!(solver.uses_dense(), !consistent);
        dense.solve(&f, &g, &mut b, &mut lambda).unwrap();
        let off = a.iter().zip(&b).fold(0.0_f64, |most, (x, y)| most.max((x - y).abs()));
        assert!(off < 1e-9, "{off:e}");
    }
}
