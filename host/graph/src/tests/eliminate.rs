//! Elimination operation by operation against dense factorisations.

use nalgebra::{DMatrix, DVector};

use super::*;

/// M = A A^T + I of a random band, rows with few entries; all numbers are inputs of the program.
fn system(random: &mut Random, n: usize, m: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let band = DMatrix::from_fn(n, n, |i, j| if i >= j && i - j < 3 { random.next() } else { 0.0 });
    let mass = &band * band.transpose() + DMatrix::identity(n, n);
    let rows = DMatrix::from_fn(m, n, |_, _| if random.next() > -0.6 { random.next() } else { 0.0 });
    (mass, rows)
}

/// What is not zero in the lower triangle of a matrix, by columns, each an input: (row, column, node).
fn lower(matrix: &DMatrix<f64>, mut input: impl FnMut(f64) -> Node) -> Vec<(usize, usize, Node)> {
    let places = (0..matrix.ncols()).flat_map(|column| (column..matrix.nrows()).map(move |row| (row, column)));
    let entries = places.filter(|at| matrix[*at] != 0.0);
    entries.map(|(row, column)| (row, column, input(matrix[(row, column)]))).collect()
}

#[test]
fn solutions_and_pivots_are_those_of_dense_matrices() {
    let mut random = Random(501);
    for (n, m) in [(1, 0), (3, 1), (6, 0), (7, 4), (12, 6)] {
        let (mass, rows) = system(&mut random, n, m);
        let mut graph = Graph::default();
        let mut numbers: Vec<f64> = Vec::new();
        let mut input = |graph: &mut Graph, value: f64| {
            numbers.push(value);
            graph.input(numbers.len() - 1)
        };
        let entries = lower(&mass, |value| input(&mut graph, value));
        let jacobian: Vec<Vec<(usize, Node)>> = (0..m)
            .map(|k| (0..n).filter(|j| rows[(k, *j)] != 0.0).map(|j| (j, input(&mut graph, rows[(k, j)]))).collect())
            .collect();
        let right: Vec<f64> = random.vector(n + m);
        let nodes: Vec<Node> = right.iter().map(|value| input(&mut graph, *value)).collect();
        let elimination = Elimination::new(&mut graph, n, &entries, &jacobian);
        let (a, lambda) = elimination.solve(&mut graph, &nodes[..n], &nodes[n..]);
        let outputs: Vec<Node> = a.into_iter().chain(lambda).chain(elimination.row_pivots.clone()).collect();
        let program = Program::compile(&graph, &outputs);
        let mut found = vec![f64::NAN; outputs.len()];
        program.run(&numbers, &[], &mut program.workspace(), &mut found).unwrap();

        let mut whole = DMatrix::zeros(n + m, n + m);
        whole.view_mut((0, 0), (n, n)).copy_from(&mass);
        whole.view_mut((n, 0), (m, n)).copy_from(&rows);
        whole.view_mut((0, n), (n, m)).copy_from(&rows.transpose());
        let expected = whole.lu().solve(&DVector::from_vec(right)).unwrap();
        for (ours, theirs) in found.iter().zip(&expected) {
            assert!((ours - theirs).abs() < 1e-11 * expected.amax(), "{ours} {theirs}");
        }
        // The product of the pivots of the rows is the determinant of J M^-1 J^T.
        let schur = &rows * mass.try_inverse().unwrap() * rows.transpose();
        let product: f64 = found[n + m..].iter().product();
        assert!((product - schur.determinant()).abs() < 1e-10 * product.abs());
    }
}

#[test]
fn a_band_is_eliminated_without_fill() {
    // A chain: entries next to the diagonal only. Operations per unknown stay the same.
    let count = |n: usize| {
        let mut graph = Graph::default();
        let mut entries = Vec::new();
        for k in 0..n {
            entries.push((k, k, graph.input(3 * k)));
            if k + 1 < n {
                entries.push((k + 1, k, graph.input(3 * k + 1)));
            }
        }
        let right: Vec<Node> = (0..n).map(|k| graph.input(3 * k + 2)).collect();
        let elimination = Elimination::new(&mut graph, n, &entries, &[]);
        let (a, _) = elimination.solve(&mut graph, &right, &[]);
        Program::compile(&graph, &a).operations()
    };
    assert_eq!(count(40) - count(30), count(30) - count(20));
}

/// So many pairs of columns that hang on the first column, each closed by a row that is blind to the first.
fn closed_pairs(count: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut random = Random(77);
    let (n, m) = (1 + 2 * count, count);
    let mut factor = DMatrix::identity(n, n);
    let mut rows = DMatrix::zeros(m, n);
    for k in 0..count {
        let (a, b) = (1 + 2 * k, 2 + 2 * k);
        for (i, j) in [(0, a), (0, b), (a, b)] {
            factor[(i, j)] = random.next();
        }
        (rows[(k, a)], rows[(k, b)]) = (1.0 + random.next().abs(), random.next());
    }
    (&factor * factor.transpose(), rows)
}

/// Work of an elimination whose rows say, or do not, that they are blind to the first column; and how far the solution is off.
fn star(count: usize, says_so: bool) -> (usize, f64) {
    let (mass, rows) = closed_pairs(count);
    let (n, m) = (mass.nrows(), rows.nrows());
    let mut graph = Graph::default();
    let mut numbers: Vec<f64> = Vec::new();
    let mut input = |graph: &mut Graph, value: f64| {
        numbers.push(value);
        graph.input(numbers.len() - 1)
    };
    let entries = lower(&mass, |value| input(&mut graph, value));
    // An entry that vanishes is written down all the same.
    let touched = |k: usize| [0, 1 + 2 * k, 2 + 2 * k];
    let jacobian: Vec<Vec<(usize, Node)>> =
        (0..m).map(|k| touched(k).map(|j| (j, input(&mut graph, rows[(k, j)]))).to_vec()).collect();
    let right: Vec<f64> = (0..n + m).map(|k| 1.0 + (k % 3) as f64).collect();
    let nodes: Vec<Node> = right.iter().map(|value| input(&mut graph, *value)).collect();
    let is_blind = |_: usize, column: usize| says_so && column == 0;
    let elimination = Elimination::with_blind_rows(&mut graph, n, &entries, &jacobian, is_blind);
    let (a, lambda) = elimination.solve(&mut graph, &nodes[..n], &nodes[n..]);
    let program = Program::compile(&graph, &[a, lambda].concat());
    let mut found = vec![f64::NAN; n + m];
    program.run(&numbers, &[], &mut program.workspace(), &mut found).unwrap();
    let mut whole = DMatrix::zeros(n + m, n + m);
    whole.view_mut((0, 0), (n, n)).copy_from(&mass);
    whole.view_mut((n, 0), (m, n)).copy_from(&rows);
    whole.view_mut((0, n), (n, m)).copy_from(&rows.transpose());
    let expected = whole.lu().solve(&DVector::from_vec(right)).unwrap();
    let off = found.iter().zip(&expected).map(|(ours, theirs)| (ours - theirs).abs()).fold(0.0, f64::max);
    (program.operations(), off / expected.amax())
}

#[test]
fn loops_that_hang_on_one_body_are_eliminated_without_fill() {
    for says_so in [false, true] {
        for count in [1, 5, 12] {
            assert!(star(count, says_so).1 < 1e-10, "{count} loops, blind rows: {says_so}");
        }
    }
    let count = |n: usize| star(n, true).0;
    assert_eq!(count(40) - count(30), count(30) - count(20));
    assert!(star(40, false).0 > 4 * count(40), "rows that wait for the first column all meet");
}
