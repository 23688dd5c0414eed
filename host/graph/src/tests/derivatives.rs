//! Derivatives of every operation against differences and against jets, twice over.

use element_api::recorded::{input, record};
use element_api::recording::{Input, Role};
use element_api::{Jet, Scalar, Table};

use super::{Random, value, values};
use crate::{Graph, Node, Program, Seeds, Tangents, derivatives, derivatives_along_each, import};

/// Every operation, and compositions of them, for x > 0 and any y.
fn every<S: Scalar>(x: S, y: S) -> Vec<(&'static str, S)> {
    let table = Table::periodic(&[[0.0, 1.0], [0.3, 2.0], [0.7, -1.0], [1.0, 1.0]]).unwrap();
    vec![
        ("x + y", x + y),
        ("x - y", x - y),
        ("-x", -x),
        ("x y", x * y),
        ("x x", x * x),
        ("y / x", y / x),
        ("3 / x", S::from(3.0) / x),
        ("sqrt", x.sqrt()),
        ("sin", (x * y).sin()),
        ("cos", (x * y).cos()),
        ("atan2(y, x)", y.atan2(x)),
        ("atan2(y, -x)", y.atan2(-x)),
        ("atan2(y, 1)", y.atan2(S::one())),
        ("exp", y.exp()),
        ("ln", x.ln()),
        ("tanh", y.tanh()),
        ("y^0", y.powi(0)),
        ("y^1", y.powi(1)),
        ("y^2", y.powi(2)),
        ("y^3", y.powi(3)),
        ("x^-1", x.powi(-1)),
        ("x^-2", x.powi(-2)),
        ("x^1.7", x.powf(1.7)),
        ("x^-0.3", x.powf(-0.3)),
        ("select, first", S::select(y, x + 9.0, x * x * y, y * y)),
        ("select, second", S::select(x + 9.0, y, x * x * y, y * y * x)),
        ("abs", (y * 3.0).abs()),
        ("table", (y * 0.8).lookup(&table)),
        ("of a table", (x * y).lookup(&table).exp() * x),
        ("all together", (x * y).sin().atan2((x / (y * y + 1.0)).sqrt()) * (x - y).tanh().powi(2)),
    ]
}

/// [`every`], recorded and imported: names and nodes; x and y are the inputs 0 and 1.
pub(super) fn imported() -> (Graph, Vec<(&'static str, Node)>) {
    let mut names = Vec::new();
    let recording = record(|| {
        let results = every(input(Input::Coordinate(0)), input(Input::Coordinate(1)));
        names = results.iter().map(|(name, _)| *name).collect();
        results.into_iter().enumerate().map(|(k, (_, value))| (Role::Channel(k as u32), value)).collect()
    });
    let mut graph = Graph::default();
    // A table that is there already must not be taken for the recording's own.
    graph.tables.push(Table::clamped(&[[0.0, 0.0], [1.0, 7.0]]).unwrap());
    let nodes = import(&mut graph, &recording, |g, which| match which {
        Input::Coordinate(k) => g.input(k as usize),
        other => panic!("{other:?} is not used"),
    });
    (graph, names.into_iter().zip(recording.outputs.iter().map(|o| nodes[o.node as usize])).collect())
}

/// Differentiates along constants.
fn along(graph: &mut Graph, nodes: &[Node], direction: [f64; 2]) -> Vec<Node> {
    let seeds: Seeds = (0..2).map(|k| (graph.input(k), graph.constant(direction[k]))).collect();
    derivatives(graph, nodes, &seeds)
}

fn close(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance * (1.0 + expected.abs())
}

#[test]
fn an_imported_recording_has_the_values_of_the_plain_functions() {
    let (graph, list) = imported();
    let mut random = Random(7);
    for _ in 0..50 {
        let (x, y) = (random.between(0.5, 2.0), random.between(-2.0, 2.0));
        for ((name, node), (_, plain)) in list.iter().zip(every(x, y)) {
            assert!(close(value(&graph, *node, &[x, y]), plain, 1e-15), "{name} at {x}, {y}");
        }
    }
}

#[test]
fn first_and_second_derivatives_are_those_of_jets() {
    let (mut graph, list) = imported();
    let nodes: Vec<Node> = list.iter().map(|(_, node)| *node).collect();
    let mut random = Random(11);
    for _ in 0..30 {
        let (x, y) = (random.between(0.5, 2.0), random.between(-2.0, 2.0));
        let [dx, dy] = [random.next(), random.next()];
        let first = along(&mut graph, &nodes, [dx, dy]);
        let second = along(&mut graph, &first, [dx, dy]);
        let (first, second) = (values(&graph, &first, &[x, y]), values(&graph, &second, &[x, y]));
        for (k, (name, jet)) in every(Jet::new(x, dx, 0.0), Jet::new(y, dy, 0.0)).into_iter().enumerate() {
            assert!(close(first[k], jet.first, 1e-13), "{name}: {} is not {}", first[k], jet.first);
            assert!(close(second[k], jet.second, 1e-12), "{name}: {} is not {}", second[k], jet.second);
        }
    }
}

#[test]
fn partial_derivatives_are_limits_of_differences() {
    let (mut graph, list) = imported();
    let nodes: Vec<Node> = list.iter().map(|(_, node)| *node).collect();
    let mut random = Random(13);
    for _ in 0..30 {
        let at = [random.between(0.5, 2.0), random.between(-2.0, 2.0)];
        for k in 0..2 {
            let direction = std::array::from_fn(|j| f64::from(j == k));
            let slopes = along(&mut graph, &nodes, direction);
            let slopes = values(&graph, &slopes, &at);
            let h = 1e-5;
            let shifted = |sign: f64| [at[0] + sign * h * direction[0], at[1] + sign * h * direction[1]];
            let (after, before) = (values(&graph, &nodes, &shifted(1.0)), values(&graph, &nodes, &shifted(-1.0)));
            for (n, (name, _)) in list.iter().enumerate() {
                let difference = (after[n] - before[n]) / (2.0 * h);
                assert!(close(slopes[n], difference, 1e-6), "{name}, d{k}: {} is not {difference}", slopes[n]);
            }
        }
    }
}

#[test]
fn the_third_derivative_of_a_table_is_its_last() {
    let mut g = Graph::default();
    let table = Table::clamped(&[[0.0, 1.0], [1.0, 3.0], [2.0, -1.0], [3.0, 0.0]]).unwrap();
    g.tables.push(table.clone());
    let x = g.input(0);
    let mut node = g.table(0, 0, x);
    for order in 1..=3 {
        let one = g.constant(1.0);
        node = derivatives(&mut g, &[node], &Seeds::from_iter([(x, one)]))[0];
        assert_eq!(value(&g, node, &[1.3]), table.derivative(1.3, order));
    }
    let one = g.constant(1.0);
    let fourth = derivatives(&mut g, &[node], &Seeds::from_iter([(x, one)]))[0];
    assert!(g.is_zero(fourth));
}

#[test]
fn a_seeded_node_is_a_variable_of_its_own() {
    let mut g = Graph::default();
    let (x, y) = (g.input(0), g.input(1));
    let u = g.mul(x, y);
    let uu = g.mul(u, u);
    let f = g.add(uu, x);
    let one = g.constant(1.0);
    // df/du = 2 u with x held.
    let slope = derivatives(&mut g, &[f], &Seeds::from_iter([(u, one)]))[0];
    assert_eq!(value(&g, slope, &[3.0, 0.5]), 3.0);
    // u' given as x^2: f' = 2 u x^2 + x'.
    let xx = g.mul(x, x);
    let slope = derivatives(&mut g, &[f], &Seeds::from_iter([(u, xx), (x, one)]))[0];
    assert_eq!(value(&g, slope, &[3.0, 0.5]), 2.0 * 1.5 * 9.0 + 1.0);
}

#[test]
fn what_does_not_depend_on_the_seeds_has_the_derivative_zero() {
    let (mut graph, list) = imported();
    let nodes: Vec<Node> = list.iter().map(|(_, node)| *node).collect();
    let other = graph.input(9);
    let one = graph.constant(1.0);
    let size = graph.len();
    let slopes = derivatives(&mut graph, &nodes, &Seeds::from_iter([(other, one)]));
    assert!(slopes.iter().all(|node| graph.is_zero(*node)));
    assert!(graph.len() <= size + 1, "and costs no operation");
}

#[test]
fn derivatives_share_the_operations_of_what_they_come_from() {
    let mut g = Graph::default();
    let x = g.input(0);
    let exponential = g.exp(x);
    let one = g.constant(1.0);
    assert_eq!(derivatives(&mut g, &[exponential], &Seeds::from_iter([(x, one)])), [exponential]);
    let root = g.sqrt(x);
    let slope = derivatives(&mut g, &[root], &Seeds::from_iter([(x, one)]))[0];
    // 0.5 / sqrt(x): one more operation.
    assert_eq!(Program::compile(&g, &[root, slope]).operations(), 2);
}

#[test]
fn derivatives_along_each_variable_are_those_along_one_after_the_other() {
    let graph = || {
        let mut graph = Graph::default();
        let inputs: Vec<Node> = (0..6).map(|slot| graph.input(slot)).collect();
        let mut random = Random(7);
        let mut nodes = inputs.clone();
        for _ in 0..200 {
            let [a, b] = [(); 2].map(|()| nodes[random.below(nodes.len())]);
            let made = match random.below(6) {
                0 => graph.add(a, b),
                1 => graph.sub(a, b),
                2 => graph.mul(a, b),
                3 => graph.sin(a),
                4 => graph.sqrt(b),
                _ => graph.select(a, b, a, b),
            };
            nodes.push(made);
        }
        // Some twice, one that is a variable, one that nothing moves.
        let zero = graph.constant(3.0);
        let outputs = [&nodes[150..], &nodes[170..180], &[inputs[2], zero]].concat();
        (graph, inputs, outputs)
    };
    let (mut together, inputs, outputs) = graph();
    let columns = derivatives_along_each(&mut together, &outputs, &inputs);
    let (mut apart, _, _) = graph();
    let unit = apart.constant(1.0);
    for (variable, column) in inputs.iter().zip(columns) {
        let expected = derivatives(&mut apart, &outputs, &Seeds::from_iter([(*variable, unit)]));
        assert!(expected.iter().any(|node| !apart.is_zero(*node)));
        assert_eq!(column, expected);
    }
    assert_eq!(together.len(), apart.len());
}

/// Functions that are infinitely steep where a choice holds their argument: they do not change there.
fn cut(g: &mut Graph) -> Vec<Node> {
    let (y, zero, one, minus) = (g.input(0), g.constant(0.0), g.constant(1.0), g.constant(-1.0));
    let positive = g.select(zero, y, y, zero);
    let three = g.constant(3.0);
    let scaled = g.mul(positive, three);
    let negated = g.neg(y);
    let other = g.select(negated, zero, y, zero);
    // The sine is held within -1 and 1: asin is atan2(s, sqrt(1 - s^2)).
    let least = g.select(minus, y, y, minus);
    let sine = g.select(least, one, least, one);
    let square = g.mul(sine, sine);
    let left = g.sub(one, square);
    let cosine = g.sqrt(left);
    let angle = g.atan2(sine, cosine);
    let root = g.sqrt(scaled);
    let power = g.powf(other, 0.3);
    let fifth = g.powi(root, 5);
    vec![root, power, angle, fifth]
}

#[test]
fn what_a_choice_holds_has_no_slope_however_steep_it_is() {
    let mut g = Graph::default();
    let functions = cut(&mut g);
    let (y, one) = (g.input(0), g.constant(1.0));
    let seeds = Seeds::from_iter([(y, one)]);
    let first = derivatives(&mut g, &functions, &seeds);
    let second = derivatives(&mut g, &first, &seeds);
    let mut tangents = Tangents::new(&mut g.clone(), &functions, std::slice::from_ref(&seeds));
    for (at, held) in
        [(-3.0, [true; 4]), (0.0, [true, true, false, true]), (0.4, [false; 4]), (3.0, [false, false, true, false])]
    {
        let mut lanes = vec![0.0; functions.len()];
        tangents.run(&[at], &[], |_, function, value| lanes[function] = value).unwrap();
        for (k, is_held) in held.into_iter().enumerate() {
            let [slope, bend] = [values(&g, &first, &[at])[k], values(&g, &second, &[at])[k]];
            assert_eq!((slope == 0.0, bend == 0.0 || !is_held), (is_held, true), "{k} at {at}: {slope}, {bend}");
            assert!(
                slope.is_finite() && bend.is_finite() && (lanes[k] - slope).abs() <= 1e-13 * slope.abs(),
                "{k} at {at}"
            );
        }
    }
    let slope = values(&g, &first, &[0.4])[0];
    assert!((slope - 0.5 * (3.0_f64 / 0.4).sqrt()).abs() < 1e-15, "{slope}");
}
