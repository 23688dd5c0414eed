//! Unknowns that conditions are solved for: values, and derivatives of the implicit function against differences.

use super::*;

/// g = (y0^2 + y1 - x0, y0 y1 - x1), carried in inputs 2 and 3.
fn system() -> (Graph, Vec<Node>) {
    let mut graph = Graph::default();
    let (x0, x1) = (graph.input(0), graph.input(1));
    let unknowns = graph
        .solve(2, 2, |g, y| {
            let square = g.mul(y[0], y[0]);
            let sum = g.add(square, y[1]);
            let product = g.mul(y[0], y[1]);
            vec![g.sub(sum, x0), g.sub(product, x1)]
        })
        .to_vec();
    (graph, unknowns)
}

/// The solution near (2, 1), by many steps.
fn solved(x: [f64; 2]) -> [f64; 2] {
    let (graph, unknowns) = system();
    let mut y = [2.0, 1.0];
    for _ in 0..20 {
        let found = values(&graph, &unknowns, &[x[0], x[1], y[0], y[1]]);
        y = [found[0], found[1]];
    }
    y
}

#[test]
fn carried_values_that_are_a_little_off_give_the_solution() {
    let (graph, unknowns) = system();
    let exact = solved([5.1, 2.1]);
    assert!((exact[0] * exact[0] + exact[1] - 5.1).abs() < 1e-15 && (exact[0] * exact[1] - 2.1).abs() < 1e-15);
    for off in [1e-4, -3e-4] {
        let found = values(&graph, &unknowns, &[5.1, 2.1, exact[0] + off, exact[1] - off]);
        assert!((found[0] - exact[0]).abs() < 1e-14 && (found[1] - exact[1]).abs() < 1e-14, "{found:?} {exact:?}");
    }
}

#[test]
fn first_and_second_derivatives_are_those_of_the_implicit_function() {
    let (mut graph, unknowns) = system();
    let one = graph.constant(1.0);
    let seeds = Seeds::from_iter([(graph.input(0), one)]);
    let first = derivatives(&mut graph, &unknowns, &seeds);
    let second = derivatives(&mut graph, &first, &seeds);
    // A carried value is no variable of the function.
    let carried = Seeds::from_iter([(graph.input(2), one)]);
    let by_carried = derivatives(&mut graph, &unknowns, &carried);
    assert!(by_carried.iter().all(|slope| graph.is_zero(*slope)));
    let (x, h) = ([5.1, 2.1], 1e-4);
    let at = |shift: f64| solved([x[0] + shift, x[1]]);
    let (here, before, after) = (at(0.0), at(-h), at(h));
    let inputs = [x[0], x[1], here[0], here[1]];
    for k in 0..2 {
        let slope = (after[k] - before[k]) / (2.0 * h);
        let bend = (after[k] - 2.0 * here[k] + before[k]) / (h * h);
        assert!((value(&graph, first[k], &inputs) - slope).abs() < 1e-8, "{k}");
        assert!((value(&graph, second[k], &inputs) - bend).abs() < 1e-5, "{k}");
    }
}

/// Whatever operations have an unknown as their operand depend on it, also where they are made simpler.
#[test]
fn what_has_an_unknown_of_either_sign_has_the_same_derivatives() {
    // e^(-y) + y = x, with e^(-y) in two ways.
    let solve = |by_negation: bool| {
        let mut graph = Graph::default();
        let x = graph.input(0);
        let power = |g: &mut Graph, y: Node| match by_negation {
            true => {
                let minus = g.neg(y);
                g.exp(minus)
            }
            false => {
                let (one, power) = (g.constant(1.0), g.exp(y));
                g.div(one, power)
            }
        };
        let unknown = graph.solve(1, 1, |g, y| {
            let power = power(g, y[0]);
            let sum = g.add(power, y[0]);
            vec![g.sub(sum, x)]
        })[0];
        let value = power(&mut graph, unknown);
        let one = graph.constant(1.0);
        let seeds = Seeds::from_iter([(x, one)]);
        let mut nodes = vec![unknown, value];
        nodes.extend(graph.solved[0].matrix.clone());
        nodes.extend(derivatives(&mut graph, &[unknown, value], &seeds));
        let first = nodes[3..].to_vec();
        nodes.extend(derivatives(&mut graph, &first, &seeds));
        (graph, nodes)
    };
    let (negated, divided) = (solve(true), solve(false));
    let (x, y) = (1.2 + (-1.2_f64).exp(), 1.2);
    // Two steps leave the fourth power of what the carried value is off by.
    for off in [0.0, 1e-3] {
        let [found, others] = [&negated, &divided].map(|(graph, nodes)| values(graph, nodes, &[x, y + off]));
        for (k, (found, other)) in found.iter().zip(&others).enumerate() {
            assert!((found - other).abs() < 1e-12, "{k}: {found} and {other}");
        }
    }
    let slope = 1.0 / (1.0 - (-y).exp());
    let found = values(&negated.0, &negated.1, &[x, y]);
    let bend = -(-y).exp() * slope.powi(3);
    let known = [y, (-y).exp(), 1.0 / slope, slope, -(-y).exp() * slope, bend];
    for (found, known) in found.iter().zip(known) {
        assert!((found - known).abs() < 1e-12, "{found} is not {known}");
    }
}

#[test]
fn eight_unknowns_are_solved_by_determinants() {
    let mut random = Random(7);
    let n = 8;
    let matrix: Vec<f64> = (0..n * n).map(|k| random.next() + if k % (n + 1) == 0 { 3.0 } else { 0.0 }).collect();
    let mut graph = Graph::default();
    let given: Vec<Node> = (0..n).map(|k| graph.input(k)).collect();
    let unknowns = graph
        .solve(n, n, |g, y| {
            let row = |g: &mut Graph, i: usize| {
                let mut sum = g.neg(given[i]);
                for (j, y) in y.iter().enumerate() {
                    let entry = g.constant(matrix[n * i + j]);
                    let part = g.mul(entry, *y);
                    sum = g.add(sum, part);
                }
                sum
            };
            (0..n).map(|i| row(g, i)).collect()
        })
        .to_vec();
    let right = random.vector(n);
    let found = values(&graph, &unknowns, &[&right[..], &vec![0.0; n]].concat());
    for (i, right) in right.iter().enumerate() {
        let sum: f64 = (0..n).map(|j| matrix[n * i + j] * found[j]).sum();
        assert!((sum - right).abs() < 1e-12, "{i}: {sum} {right}");
    }
}
