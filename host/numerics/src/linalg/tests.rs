//! Identities of the engines, and comparison with each other and with nalgebra.

#![allow(clippy::unwrap_used)]

mod factorisations;
mod ranks;
mod singular_values;
mod sparse_first;
mod sparse_lu;

use nalgebra::{DMatrix, DVector};

use super::*;
use crate::random::Random;

impl Random {
    fn matrix(&mut self, rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |_, _| self.next())
    }
}

/// A system with its values; dense copies serve as oracle.
struct Problem {
    structure: KktStructure,
    mass: Vec<f64>,
    jacobian: Vec<f64>,
    clusters: Clusters,
}

impl Problem {
    /// Six velocities per body, mass matrix of a scalar and a 3 x 3 block, and joints
    /// `(body, other body or ground, rows)` that are blind to common motions.
    fn mechanism(bodies: usize, joints: &[(usize, Option<usize>, usize)], seed: u64) -> Self {
        let mut random = Random(seed);
        let mut structure = KktStructure { n: 6 * bodies, ..KktStructure::default() };
        let mut clusters = Clusters::default();
        let mut mass = Vec::new();
        let mut frames = Vec::new();
        for body in 0..bodies {
            clusters.velocities.extend([body; 6]);
            let factor = random.matrix(3, 3);
            let inertia = &factor * factor.transpose() + DMatrix::identity(3, 3) * 0.5;
            let first = 6 * body;
            for k in 0..3 {
                structure.mass.push((first + k, first + k));
                mass.push(1.5);
            }
            for j in 0..3 {
                for i in j..3 {
                    structure.mass.push((first + 3 + i, first + 3 + j));
                    mass.push(inertia[(i, j)]);
                }
            }
            frames.push(random.matrix(6, 6) * 0.3 + DMatrix::identity(6, 6));
        }
        let mut jacobian = Vec::new();
        for (joint, &(body, other, rows)) in joints.iter().enumerate() {
            let directions = random.matrix(rows, 6);
            let mut parts = vec![(body, &directions * &frames[body])];
            if let Some(other) = other {
                parts.push((other, -&directions * &frames[other]));
            }
            parts.sort_by_key(|part| part.0);
            for k in 0..rows {
                clusters.rows.push(joint);
                for (touched, block) in &parts {
                    for column in 0..6 {
                        structure.jacobian.push((structure.m, 6 * touched + column));
                        jacobian.push(block[(k, column)]);
                    }
                }
                structure.m += 1;
            }
        }
        structure.validate().unwrap();
        Self { structure, mass, jacobian, clusters }
    }

    /// Open chain hanging from the ground, five rows per joint.
    fn chain(bodies: usize) -> Self {
        let joints: Vec<_> = (0..bodies).map(|b| (b, b.checked_sub(1), 5)).collect();
        Self::mechanism(bodies, &joints, 7)
    }

    /// Tree, two loops (one through the ground), a second joint between the same bodies.
    fn with_loops() -> Self {
        let joints = [
            (0, None, 5),
            (1, Some(0), 5),
            (2, Some(1), 4),
            (3, Some(2), 3),
            (3, Some(0), 2),
            (4, Some(1), 4),
            (4, None, 1),
            (4, Some(1), 1),
            (5, Some(6), 5),
        ];
        Self::mechanism(7, &joints, 11)
    }

    /// Appends a row that is the sum of the first two, plus `offset` times noise.
    fn with_dependent_row(mut self, offset: f64) -> Self {
        let mut random = Random(99);
        let dense = self.dense_jacobian();
        let row = self.structure.m;
        for column in 0..self.structure.n {
            let sum = dense[(0, column)] + dense[(1, column)];
            if sum != 0.0 {
                self.structure.jacobian.push((row, column));
                self.jacobian.push(sum + offset * random.next());
            }
        }
        self.structure.m += 1;
        self.clusters.rows.push(usize::MAX);
        self
    }

    fn dense_jacobian(&self) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.structure.m, self.structure.n);
        for (&place, &value) in self.structure.jacobian.iter().zip(&self.jacobian) {
            dense[place] = value;
        }
        dense
    }

    fn dense_mass(&self) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.structure.n, self.structure.n);
        for (&(row, column), &value) in self.structure.mass.iter().zip(&self.mass) {
            dense[(row, column)] = value;
            dense[(column, row)] = value;
        }
        dense
    }

    fn dense_qr(&self) -> DenseQr {
        DenseQr::new(&self.structure, DEFAULT_RANK_TOLERANCE).unwrap()
    }

    fn sparse(&self) -> SparseLdl {
        SparseLdl::with_computed_order(&self.structure, Some(&self.clusters)).unwrap()
    }

    fn solve(&self, engine: &mut dyn KktSolver, f: &[f64], g: &[f64]) -> Solution {
        engine.set_mass(&self.mass).unwrap();
        let health = engine.refactor(&self.jacobian).unwrap();
        let mut a = vec![f64::NAN; self.structure.n];
        let mut lambda = vec![f64::NAN; self.structure.m];
        engine.solve(f, g, &mut a, &mut lambda).unwrap();
        let (a, lambda) = (DVector::from_vec(a), DVector::from_vec(lambda));
        Solution { health, a, lambda }
    }

    fn random_sides(&self, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let mut random = Random(seed);
        let f = random.vector(self.structure.n);
        (f, random.vector(self.structure.m))
    }

    /// Largest miss of both block rows of the system.
    fn residual(&self, f: &[f64], g: &[f64], solution: &Solution) -> f64 {
        let (mass, jacobian) = (self.dense_mass(), self.dense_jacobian());
        let top = mass * &solution.a + jacobian.transpose() * &solution.lambda - DVector::from_column_slice(f);
        let bottom = jacobian * &solution.a - DVector::from_column_slice(g);
        top.amax().max(bottom.amax())
    }
}

struct Solution {
    health: Health,
    a: DVector<f64>,
    lambda: DVector<f64>,
}

#[test]
fn dense_qr_solves_the_system_like_a_plain_lu() {
    let problem = Problem::with_loops();
    let (n, m) = (problem.structure.n, problem.structure.m);
    let (f, g) = problem.random_sides(3);
    let solution = problem.solve(&mut problem.dense_qr(), &f, &g);

    let mut whole = DMatrix::zeros(n + m, n + m);
    let jacobian = problem.dense_jacobian();
    whole.view_mut((0, 0), (n, n)).copy_from(&problem.dense_mass());
    whole.view_mut((n, 0), (m, n)).copy_from(&jacobian);
    whole.view_mut((0, n), (n, m)).copy_from(&jacobian.transpose());
    let right = DVector::from_iterator(n + m, f.iter().chain(&g).copied());
    let oracle = whole.lu().solve(&right).unwrap();

    assert_eq!(solution.health.rank, m);
    let scale = oracle.amax();
    assert!((&solution.a - oracle.rows(0, n)).amax() < 1e-11 * scale);
    assert!((&solution.lambda - oracle.rows(n, m)).amax() < 1e-11 * scale);
    assert!(problem.residual(&f, &g, &solution) < 1e-13 * scale);
}

#[test]
fn sparse_ldl_equals_dense_qr() {
    // The last one is large enough for sparse storage.
    for problem in [Problem::with_loops(), Problem::chain(6), Problem::chain(40)] {
        let (f, g) = problem.random_sides(4);
        let dense = problem.solve(&mut problem.dense_qr(), &f, &g);
        let scale = dense.a.amax().max(dense.lambda.amax());
        let plain = SparseLdl::with_computed_order(&problem.structure, None).unwrap();
        for mut engine in [problem.sparse(), plain] {
            let sparse = problem.solve(&mut engine, &f, &g);
            assert_eq!(sparse.health.rank, problem.structure.m);
            assert!((&sparse.a - &dense.a).amax() < 1e-11 * scale);
            assert!((&sparse.lambda - &dense.lambda).amax() < 1e-11 * scale);
        }
    }
}

#[test]
fn engines_are_reusable_with_new_values() {
    let problem = Problem::with_loops();
    let mut other = Problem::mechanism(7, &[], 5);
    other.structure = problem.structure.clone();
    other.jacobian = problem.jacobian.iter().rev().map(|v| v + 0.1).collect();
    let (f, g) = problem.random_sides(6);
    let engines: [Box<dyn KktSolver>; 2] = [Box::new(problem.dense_qr()), Box::new(problem.sparse())];
    for mut engine in engines {
        let first = problem.solve(engine.as_mut(), &f, &g);
        let second = other.solve(engine.as_mut(), &f, &g);
        let again = problem.solve(engine.as_mut(), &f, &g);
        assert!(other.residual(&f, &g, &second) < 1e-9);
        assert_eq!(first.a, again.a, "{} keeps no history", engine.name());
        assert_eq!(first.lambda, again.lambda);
    }
}

#[test]
fn every_leading_block_of_the_computed_order_is_regular() {
    let branching = [
        (0, None, 5),
        (1, Some(0), 6),
        (2, Some(0), 5),
        (3, Some(2), 1),
        (4, Some(2), 5),
        (4, Some(3), 4),
        (5, Some(4), 3),
    ];
    let problems = [Problem::with_loops(), Problem::chain(4), Problem::mechanism(6, &branching, 23)];
    for problem in problems {
        let n = problem.structure.n;
        let jacobian = problem.dense_jacobian();
        for clusters in [Some(&problem.clusters), None] {
            let order = constraint_order(&problem.structure, clusters).unwrap();
            let (mut velocities, mut rows) = (Vec::new(), Vec::new());
            for &unknown in &order {
                if unknown < n {
                    velocities.push(unknown);
                    continue;
                }
                rows.push(unknown - n);
                let block = jacobian.select_rows(&rows).select_columns(&velocities);
                assert_eq!(SingularValues::of(&block).unwrap().rank(1e-9), rows.len(), "rows {rows:?}");
            }
            assert_eq!((velocities.len(), rows.len()), (n, problem.structure.m));
        }
    }
}

#[test]
fn rows_over_separate_components_get_an_order() {
    // One row over three bodies of which no other row joins the third.
    let structure = KktStructure::new(
        3,
        3,
        vec![(0, 0), (1, 1), (2, 2)],
        vec![(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)],
    )
    .unwrap();
    let clusters = Clusters { velocities: vec![0, 1, 2], rows: vec![0, 0, 1] };
    let mut order = constraint_order(&structure, Some(&clusters)).unwrap();
    order.sort_unstable();
    assert_eq!(order, [0, 1, 2, 3, 4, 5]);
}

#[test]
fn factor_of_a_chain_grows_like_its_length() {
    let nonzeros = |bodies: usize, clustered: bool| {
        let problem = Problem::chain(bodies);
        let clusters = clustered.then_some(&problem.clusters);
        SparseLdl::with_computed_order(&problem.structure, clusters).unwrap().factor_nonzeros()
    };
    // Body block 3, rows on body 5 * 6, rows among themselves 10, and after the elimination of
    // the far body: joint on body 5 * 6, body filled 15 instead of 3.
    assert_eq!(nonzeros(1, true), 3 + 30 + 10);
    let per_body = nonzeros(2, true) - nonzeros(1, true);
    assert_eq!(per_body, 15 + 30 + 10 + 30);
    for bodies in [10, 100, 1000] {
        let expected = nonzeros(1, true) + (bodies - 1) * per_body;
        assert_eq!(nonzeros(bodies, true), expected);
    }
    // The order without knowledge of bodies has more fill, but grows alike.
    let (short, long) = (nonzeros(100, false), nonzeros(1000, false));
    assert!(long < 11 * short, "{short} {long}");
}

#[test]
fn chain_of_a_thousand_links_is_solved_to_round_off() {
    let problem = Problem::chain(1000);
    let (f, g) = problem.random_sides(8);
    let mut engine = problem.sparse();
    engine.set_mass(&problem.mass).unwrap();
    engine.refactor(&problem.jacobian).unwrap();
    let mut a = vec![0.0; problem.structure.n];
    let mut lambda = vec![0.0; problem.structure.m];
    engine.solve(&f, &g, &mut a, &mut lambda).unwrap();

    let mut miss = g.clone();
    for (&(row, column), &value) in problem.structure.jacobian.iter().zip(&problem.jacobian) {
        miss[row] -= value * a[column];
    }
    let scale = two_norm(&a);
    assert!(two_norm(&miss) < 1e-12 * scale, "{}", two_norm(&miss) / scale);
}

#[test]
fn refinement_repairs_a_poor_order() {
    // The row hardly touches the velocity before it, so its pivot is -1e-10.
    let structure = KktStructure::new(2, 1, vec![(0, 0), (1, 1)], vec![(0, 0), (0, 1)]).unwrap();
    let jacobian = [1e-5, 1.0];
    let mut engine = SparseLdl::new(&structure, &[0, 2, 1]).unwrap();
    engine.set_mass(&[1.0, 3.0]).unwrap();
    engine.refactor(&jacobian).unwrap();
    let miss = |engine: &mut SparseLdl| {
        let (mut a, mut lambda) = ([0.0; 2], [0.0]);
        engine.solve(&[0.3, 0.7], &[0.9], &mut a, &mut lambda).unwrap();
        (3.0 * a[1] + lambda[0] - 0.7).abs().max((dot(&jacobian, &a) - 0.9).abs())
    };
    let plain = miss(&mut engine);
    engine.set_refinement(true);
    let refined = miss(&mut engine);
    assert!(plain > 1e-9, "{plain:e}");
    assert!(refined < 1e-14, "{refined:e}");
}

#[test]
fn without_rows_both_engines_divide_by_the_mass() {
    let problem = Problem::mechanism(2, &[], 15);
    let (f, g) = problem.random_sides(16);
    for solution in [problem.solve(&mut problem.dense_qr(), &f, &g), problem.solve(&mut problem.sparse(), &f, &g)] {
        assert!(
            problem
                .dense_mass()
                .lu()
                .solve(&DVector::from_vec(f.clone()))
                .is_some_and(|oracle| (oracle - &solution.a).amax() < 1e-13)
        );
        assert_eq!((solution.health.rank, solution.health.smallest_pivot_ratio), (0, 1.0));
    }
}

#[test]
fn bad_input_is_an_error_and_spoils_the_factor() {
    let problem = Problem::chain(2);
    let (f, g) = problem.random_sides(17);
    let engines: [Box<dyn KktSolver>; 2] = [Box::new(problem.dense_qr()), Box::new(problem.sparse())];
    for mut engine in engines {
        assert_eq!(engine.refactor(&problem.jacobian), Err(LinalgError::NotFactored));
        problem.solve(engine.as_mut(), &f, &g);
        let mut jacobian = problem.jacobian.clone();
        jacobian[3] = f64::NAN;
        let error = engine.refactor(&jacobian).unwrap_err();
        assert!(matches!(error, LinalgError::NotFinite { .. }));
        let mut a = vec![0.0; problem.structure.n];
        let mut lambda = vec![0.0; problem.structure.m];
        let error = engine.solve(&f, &g, &mut a, &mut lambda);
        assert_eq!(error, Err(LinalgError::NotFactored));
        assert!(matches!(engine.refactor(&[1.0]), Err(LinalgError::Length { .. })));

        let mut mass = problem.mass.clone();
        mass[1] = -1.0;
        let error = engine.set_mass(&mass);
        assert_eq!(error, Err(LinalgError::NotPositiveDefinite { row: 1 }));
        assert_eq!(engine.refactor(&problem.jacobian), Err(LinalgError::NotFactored));
    }
    assert!(SparseLdl::new(&problem.structure, &[0; 22]).is_err());
}

#[test]
fn structures_with_faults_are_refused() {
    let diagonal = vec![(0, 0), (1, 1)];
    let fault = |mass: Vec<(usize, usize)>, jacobian: Vec<(usize, usize)>| {
        KktStructure::new(2, 1, mass, jacobian).unwrap_err().to_string()
    };
    assert!(fault(vec![(0, 0), (0, 1), (1, 1)], vec![]).contains("(0, 1) of the mass"));
    assert!(fault(vec![(0, 0)], vec![]).contains("(1, 1) of the mass is missing"));
    assert!(fault(vec![(1, 1), (0, 0)], vec![]).contains("out of order"));
    assert!(fault(diagonal.clone(), vec![(1, 0)]).contains("out of range"));
    assert!(fault(diagonal.clone(), vec![(0, 1), (0, 0)]).contains("out of order"));
    assert!(fault(diagonal, vec![(0, 1), (0, 1)]).contains("out of order"));
}

#[test]
fn mass_blocks_need_not_be_neighbours() {
    // Unknowns 0 and 2 are coupled, 1 stands alone.
    let pattern = [(0, 0), (2, 0), (1, 1), (2, 2)];
    let mut factor = BlockCholesky::new(3, &pattern);
    assert_eq!(factor.block_count(), 2);
    assert_eq!(factor.unknowns(0), [0, 2]);
    factor.factor(&[4.0, 2.0, 9.0, 5.0]).unwrap();
    let mut x = vec![8.0, 18.0, 14.0];
    factor.solve_lower(&mut x);
    factor.solve_upper(&mut x);
    // M x = b with x = (0.75, 2, 2.5): 4*0.75 + 2*2.5 = 8, 9*2 = 18, 2*0.75 + 5*2.5 = 14
    let error: Vec<f64> = x.iter().zip([0.75, 2.0, 2.5]).map(|(x, e)| x - e).collect();
    assert!(two_norm(&error) < 1e-14);

    let singular = factor.factor(&[4.0, 2.0, 9.0, 1.0]);
    assert_eq!(singular, Err(LinalgError::NotPositiveDefinite { row: 2 }));
}
