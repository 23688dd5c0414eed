//! Rows that depend on each other: found, left out, refused, whatever the units and masses.

use super::*;
use crate::linalg::null_vectors::Search;

#[test]
fn dependent_row_is_found_and_changes_no_acceleration() {
    dependent_row_is_found(Problem::with_loops);
    // Large enough for sparse storage.
    dependent_row_is_found(|| Problem::chain(40));
}

fn dependent_row_is_found(problem: fn() -> Problem) {
    let full = problem();
    let (f, g) = full.random_sides(9);
    let expected = full.solve(&mut full.dense_qr(), &f, &g);

    let redundant = problem().with_dependent_row(0.0);
    let mut g_redundant = g.clone();
    g_redundant.push(g[0] + g[1]);
    let mut engine = redundant.dense_qr();
    let solution = redundant.solve(&mut engine, &f, &g_redundant);

    assert_eq!(solution.health.rank, full.structure.m);
    assert!((&solution.a - &expected.a).amax() < 1e-11 * expected.a.amax().max(1.0));
    assert!(redundant.residual(&f, &g_redundant, &solution) < 1e-10);
    assert!(engine.consistency_residual() < 1e-12);
    assert!(engine.largest_dropped_ratio() < 1e-14);

    // The three rows involved share their reaction, all others are unique.
    let last = full.structure.m;
    let basis = DVector::from_vec(engine.null_space().unwrap());
    assert!((redundant.dense_jacobian().transpose() * &basis).amax() < 1e-12);
    let dependent = engine.dependent_rows()[0];
    assert_eq!(basis[dependent], 1.0);
    for (row, &free) in engine.non_unique_multipliers(1e-9).unwrap().iter().enumerate() {
        assert_eq!(free, [0, 1, last].contains(&row), "row {row}");
        assert!(row == dependent || engine.independent_rows().contains(&row));
    }
}

#[test]
fn preferred_rows_are_kept_where_rows_depend() {
    let redundant = Problem::with_loops().with_dependent_row(0.0);
    let (f, g) = redundant.random_sides(10);
    for rejected in [0, 1, redundant.structure.m - 1] {
        let others: Vec<usize> = (0..redundant.structure.m).filter(|&row| row != rejected).collect();
        let mut engine = redundant.dense_qr();
        engine.set_first_rows(&others).unwrap();
        redundant.solve(&mut engine, &f, &g);
        assert_eq!(engine.dependent_rows(), [rejected]);
    }
}

#[test]
fn contradicting_rows_leave_a_residual() {
    let redundant = Problem::with_loops().with_dependent_row(0.0);
    let (f, mut g) = redundant.random_sides(12);
    let last = redundant.structure.m - 1;
    g[last] = g[0] + g[1] + 0.25;
    let mut engine = redundant.dense_qr();
    let others: Vec<usize> = (0..last).collect();
    engine.set_first_rows(&others).unwrap();
    redundant.solve(&mut engine, &f, &g);
    assert_eq!(engine.dependent_residuals().len(), 1);
    assert!((engine.dependent_residuals()[0] + 0.25).abs() < 1e-12);
    assert!(engine.consistency_residual() > 1e-3);
}

#[test]
fn sparse_ldl_reports_dependent_rows_by_a_tiny_pivot() {
    let problem = Problem::with_loops();
    let mut sound = problem.sparse();
    sound.set_mass(&problem.mass).unwrap();
    let healthy = sound.refactor(&problem.jacobian).unwrap();
    assert!(healthy.smallest_pivot_ratio > 1e-5, "{healthy:?}");

    // The pivot goes with the square of the distance to dependence.
    let ratio = |offset: f64| {
        let problem = Problem::with_loops().with_dependent_row(offset);
        let mut engine = SparseLdl::with_computed_order(&problem.structure, Some(&problem.clusters)).unwrap();
        engine.set_mass(&problem.mass).unwrap();
        engine.refactor(&problem.jacobian).unwrap()
    };
    let (near, nearer) = (ratio(1e-2), ratio(1e-3));
    let quotient = near.smallest_pivot_ratio / nearer.smallest_pivot_ratio;
    assert!((50.0..200.0).contains(&quotient), "{near:?} {nearer:?}");
    let dependent = ratio(1e-7);
    assert!(dependent.smallest_pivot_ratio < SparseLdl::DEFAULT_THRESHOLD);
    assert_eq!(dependent.rank, problem.structure.m);
}

#[test]
fn exactly_dependent_rows_are_reported_or_refused() {
    // Two equal rows on one unit mass: the second pivot cancels without round-off.
    let structure = KktStructure::new(1, 2, vec![(0, 0)], vec![(0, 0), (1, 0)]).unwrap();
    let mut engine = SparseLdl::new(&structure, &[0, 1, 2]).unwrap();
    engine.set_mass(&[1.0]).unwrap();
    let refused = engine.refactor(&[1.0, 1.0]);
    assert_eq!(refused, Err(LinalgError::Singular { row: 1 }));
    let unsolved = engine.solve(&[1.0], &[0.0, 0.0], &mut [0.0], &mut [0.0, 0.0]);
    assert_eq!(unsolved, Err(LinalgError::NotFactored));
}

#[test]
fn decisions_on_rank_do_not_depend_on_units() {
    let problem = Problem::with_loops().with_dependent_row(1e-4);
    let (n, m) = (problem.structure.n, problem.structure.m);
    let row_unit: Vec<f64> = (0..m).map(|row| [1.0, 1e-5, 3e4][row % 3]).collect();
    let unit: Vec<f64> = (0..n).map(|col| if col % 6 < 3 { 1e3 } else { 1.0 }).collect();
    let mut rescaled = Problem::with_loops().with_dependent_row(1e-4);
    for (&(row, column), value) in problem.structure.mass.iter().zip(&mut rescaled.mass) {
        *value *= unit[row] * unit[column];
    }
    let places = &problem.structure.jacobian;
    for (&(row, column), value) in places.iter().zip(&mut rescaled.jacobian) {
        *value *= row_unit[row] * unit[column];
    }
    let (f, g) = problem.random_sides(13);
    let f_rescaled: Vec<f64> = f.iter().zip(&unit).map(|(f, u)| f * u).collect();
    let g_rescaled: Vec<f64> = g.iter().zip(&row_unit).map(|(g, u)| g * u).collect();

    let before = problem.solve(&mut problem.dense_qr(), &f, &g);
    let after = rescaled.solve(&mut rescaled.dense_qr(), &f_rescaled, &g_rescaled);
    assert_eq!(before.health.rank, after.health.rank);
    let change = before.health.smallest_pivot_ratio / after.health.smallest_pivot_ratio;
    assert!((change - 1.0).abs() < 1e-6, "{change}");
    for (k, &u) in unit.iter().enumerate() {
        assert!((before.a[k] - after.a[k] * u).abs() < 1e-9 * before.a.amax());
    }
    for (k, &u) in row_unit.iter().enumerate() {
        let error = (before.lambda[k] - after.lambda[k] * u).abs();
        assert!(error < 1e-6 * before.lambda.amax(), "row {k}: {error}");
    }
    let sparse_before = problem.solve(&mut problem.sparse(), &f, &g).health;
    let sparse_after = rescaled.solve(&mut rescaled.sparse(), &f_rescaled, &g_rescaled).health;
    let change = sparse_before.smallest_pivot_ratio / sparse_after.smallest_pivot_ratio;
    assert!((change - 1.0).abs() < 1e-3, "{change}");
}

#[test]
fn ranks_do_not_depend_on_masses() {
    let scales: Vec<f64> = (0..42).map(|column| if column % 6 < 3 { 1.0 } else { 2.0 }).collect();
    let decided = |body: usize, decades: i32, offset: f64| {
        let mut problem = Problem::with_loops().with_dependent_row(offset);
        for ((row, _), value) in problem.structure.mass.iter().zip(&mut problem.mass) {
            *value *= if row / 6 == body { 10f64.powi(decades) } else { 1.0 };
        }
        let mut engine = problem.dense_qr();
        engine.set_measure(&scales).unwrap();
        engine.set_mass(&problem.mass).unwrap();
        let health = engine.refactor(&problem.jacobian).unwrap();
        let rows = (engine.independent_rows().to_vec(), engine.dependent_rows().to_vec());
        // What is solved with these rows meets them all, whatever the masses.
        let (f, mut g) = Problem::with_loops().random_sides(21);
        let f: Vec<f64> = f.iter().map(|_| 0.0).collect();
        g.push(g[0] + g[1]);
        let (mut a, mut lambda) = (vec![f64::NAN; f.len()], vec![f64::NAN; g.len()]);
        engine.solve(&f, &g, &mut a, &mut lambda).unwrap();
        let miss = problem.dense_jacobian() * DVector::from_vec(a) - DVector::from_vec(g);
        // Round-off of heavy unknowns reaches light ones times the root of the ratio; refinement takes most of it away.
        let bound = if decades.abs() <= 9 { 1e-9 } else { 1e-5 };
        assert!(miss.amax() < bound, "body {body} by 1e{decades}: {:e}", miss.amax());
        (health, rows)
    };
    for offset in [0.0, 1e-6] {
        let usual = decided(0, 0, offset);
        for body in 0..7 {
            for decades in [-18, -9, -4, 4, 9, 18] {
                assert_eq!(decided(body, decades, offset), usual, "body {body} by 1e{decades}");
            }
        }
    }
}

/// Neighbours that share an unknown, each with a row that is the sum of two others with factors of its own: rows far apart are
/// looked at together, and their vectors are those of one at a time.
#[test]
fn null_vectors_of_many_rows_are_those_of_each_alone() {
    let count = 150;
    let (mut jacobian, mut values) = (Vec::new(), Vec::new());
    let (mut row, mut labels) = (0, Vec::new());
    for k in 0..count {
        let at = 3 * k;
        let factor = 0.5 + (k % 7) as f64 / 4.0;
        for entries in [[(at, 1.0), (at + 1, 2.0)], [(at + 1, -1.0), (at + 2, factor)]] {
            entries.into_iter().for_each(|(column, value)| {
                jacobian.push((row, column));
                values.push(value);
            });
            row += 1;
        }
        // Once the first, twice the second.
        for (column, value) in [(at, 1.0), (at + 2, 2.0 * factor)] {
            jacobian.push((row, column));
            values.push(value);
        }
        row += 1;
        if k == 0 {
            // Once the first, once the second.
            jacobian.extend([(row, at), (row, at + 1), (row, at + 2)]);
            values.extend([1.0, 1.0, factor]);
            row += 1;
        }
        labels.resize(row, 2 * k);
        if k + 1 < count {
            labels.push(2 * k + 1);
            jacobian.extend([(row, at + 2), (row, at + 3)]);
            values.extend([1.0, 0.3]);
            row += 1;
        }
    }
    let n = 3 * count;
    let mass: Vec<f64> = (0..n).map(|k| 1.0 + (k % 5) as f64).collect();
    let structure = KktStructure::new(n, row, (0..n).map(|k| (k, k)).collect(), jacobian).unwrap();
    let clusters = Clusters { velocities: (0..n).map(|k| k / 3).collect(), rows: labels };
    let rank = SparseRank::find(&structure, &clusters, &mass, &values).unwrap().unwrap();
    assert_eq!(rank.dependent.len(), count + 1);
    let found = rank.null_space(&structure, &clusters, &mass, &values).unwrap().unwrap();
    let mut search = Search::new(&rank, &structure, &clusters, (&mass, &values)).unwrap();
    for (dependent, vector) in rank.dependent.iter().zip(&found) {
        let alone = search.together(&[*dependent]).unwrap().pop().flatten().unwrap();
        assert!(vector.len() == alone.len() && vector.len() <= 4, "{vector:?} {alone:?}");
        for (a, b) in vector.iter().zip(&alone) {
            assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-12 * b.1.abs(), "{vector:?} {alone:?}");
        }
    }
    // Two of the same rows are not distinguished; neighbours are.
    assert_eq!(search.together(&rank.dependent[..2]).unwrap(), [None, None]);
    assert!(search.together(&rank.dependent[1..3]).unwrap().iter().all(Option::is_some));
}

/// Parts that have nothing in common, in each of which a row is independent or not by less than squares tell: as many as there may be,
/// and what is found of each is what is found of it alone.
#[test]
fn rows_in_doubt_of_many_parts_are_sorted_out_as_those_of_each_alone() {
    let found = |count: usize, from: usize| {
        let (mut jacobian, mut values) = (Vec::new(), Vec::new());
        for k in 0..count {
            let offset = if (from + k).is_multiple_of(3) { 0.0 } else { 1e-5 * (1 + k % 4) as f64 };
            // The third is the first and twice the second, and what these cannot give.
            let rows = [[1.0, 2.0, 0.0], [0.0, -1.0, 0.7], [1.0 + offset, 0.0, 1.4 - offset]];
            for (row, entries) in rows.into_iter().enumerate() {
                for (column, value) in entries.into_iter().enumerate().filter(|(_, value)| *value != 0.0) {
                    jacobian.push((3 * k + row, 3 * k + column));
                    values.push(value);
                }
            }
        }
        let n = 3 * count;
        let structure = KktStructure::new(n, n, (0..n).map(|k| (k, k)).collect(), jacobian).unwrap();
        let clusters = Clusters { velocities: (0..n).collect(), rows: (0..n).collect() };
        SparseRank::find(&structure, &clusters, &vec![1.0; n], &values).unwrap().unwrap()
    };
    let count = 120;
    let all = found(count, 0);
    assert_eq!((all.independent.len(), all.dependent.len()), (2 * count + 2 * count / 3, count / 3));
    assert!(all.dependent.iter().all(|row| (row / 3).is_multiple_of(3)), "{:?}", all.dependent);
    let one = found(1, 1);
    assert_eq!(one.independent.len(), 3);
    // The smallest of them is that of the parts with the smallest offset.
    assert!((all.smallest_sine / one.smallest_sine - 1.0).abs() < 1e-6, "{} {}", all.smallest_sine, one.smallest_sine);
}
