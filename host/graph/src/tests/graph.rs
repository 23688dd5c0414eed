//! Rules by which the graph simplifies, and the proof that none of them changes a value.

use element_api::recorded::{input, record};
use element_api::recording::{Input, Role};
use element_api::{Interpolation, Outside, Scalar, Table};

use super::{Random, value, values};
use crate::{Call, Expr, Graph, Node, import};

/// A graph with three inputs.
fn start() -> (Graph, [Node; 3]) {
    let mut g = Graph::default();
    let inputs = std::array::from_fn(|k| g.input(k));
    (g, inputs)
}

fn curve() -> Table {
    Table::periodic(&[[0.0, 1.0], [0.3, 2.0], [0.7, -1.0], [1.0, 1.0]]).unwrap()
}

/// A table as an element records it, at input 0.
fn looked_up(table: &Table) -> (Graph, Node) {
    let recording = record(|| vec![(Role::Channel(0), input(Input::Coordinate(0)).lookup(table))]);
    let mut graph = Graph::default();
    let nodes = import(&mut graph, &recording, |g, _| g.input(0));
    (graph, nodes[recording.outputs[0].node as usize])
}

#[test]
fn a_table_with_jumps_is_a_choice_of_its_parts() {
    let mut random = Random(11);
    for count in 2..9 {
        let points: Vec<[f64; 2]> =
            (0..count).map(|k| [f64::from(k) + 0.5 * random.between(0.0, 1.0), random.between(0.0, 1.0)]).collect();
        let steps = Table::through(&points, Interpolation::Steps, Outside::Clamped).unwrap();
        // A continuous table with one jump put into it.
        let mut broken = Table::through(&points, Interpolation::Monotone, Outside::Clamped).unwrap();
        broken.pieces.iter_mut().skip(1).for_each(|piece| piece[0] += 3.0);
        for (table, selects) in [(steps, count as usize - 1), (broken, usize::from(count > 2))] {
            let (graph, node) = looked_up(&table);
            let found = graph.nodes().filter(|node| matches!(graph.expr(*node), Expr::Select(..))).count();
            assert_eq!(found, selects, "{points:?}");
            let jumps = points.iter().flat_map(|p| [p[0].next_down(), p[0], p[0].next_up()]);
            for x in (0..200).map(|k| -1.0 + 0.06 * f64::from(k)).chain(jumps) {
                assert_eq!(value(&graph, node, &[x]), table.derivative(x, 0), "at {x}");
            }
        }
    }
    let continuous = Table::clamped(&[[0.0, 1.0], [1.0, 2.0], [2.0, 0.0]]).unwrap();
    // As many choices as this one has jumps would be made in every evaluation.
    let points: Vec<[f64; 2]> = (0..100).map(|k| [f64::from(k), random.between(0.0, 1.0)]).collect();
    let long = Table::through(&points, Interpolation::Steps, Outside::Clamped).unwrap();
    for table in [continuous, long] {
        let (graph, node) = looked_up(&table);
        assert!(matches!(graph.expr(node), Expr::Table { .. }));
    }
}

#[test]
fn neutral_elements_vanish() {
    let (mut g, [x, ..]) = start();
    let [zero, one, minus] = [0.0, 1.0, -1.0].map(|c| g.constant(c));
    assert_eq!((g.add(x, zero), g.add(zero, x), g.sub(x, zero)), (x, x, x));
    assert_eq!((g.mul(x, one), g.mul(one, x), g.div(x, one)), (x, x, x));
    assert_eq!((g.powi(x, 1), g.powf(x, 1.0)), (x, x));
    let negative = g.neg(x);
    assert_eq!((g.sub(zero, x), g.mul(x, minus), g.div(x, minus), g.neg(negative)), (negative, negative, negative, x));
}

#[test]
fn what_is_always_the_same_number_becomes_that_number() {
    let (mut g, [x, y, _]) = start();
    let [zero, one] = [0.0, 1.0].map(|c| g.constant(c));
    assert_eq!((g.mul(x, zero), g.mul(zero, x), g.div(zero, x), g.sub(x, x)), (zero, zero, zero, zero));
    assert_eq!((g.powi(x, 0), g.powf(x, 0.0)), (one, one));
    assert_eq!((g.select(x, y, one, one), g.select(one, zero, x, y), g.select(zero, one, x, y)), (one, y, x));
    g.tables.push(curve());
    assert_eq!(g.table(0, 4, x), zero);
    assert!(g.is_zero(zero) && !g.is_zero(one) && !g.is_zero(x));
}

#[test]
fn signs_move_outwards() {
    let (mut g, [x, y, _]) = start();
    let (nx, ny) = (g.neg(x), g.neg(y));
    let (product, quotient, sum, difference) = (g.mul(x, y), g.div(x, y), g.add(x, y), g.sub(x, y));
    let negative = |g: &mut Graph, node| g.neg(node);
    assert_eq!((g.mul(nx, ny), g.div(nx, ny)), (product, quotient));
    assert_eq!((g.mul(nx, y), g.mul(x, ny)), (negative(&mut g, product), negative(&mut g, product)));
    assert_eq!((g.div(nx, y), g.div(x, ny)), (negative(&mut g, quotient), negative(&mut g, quotient)));
    assert_eq!((g.add(nx, ny), g.sub(nx, y)), (negative(&mut g, sum), negative(&mut g, sum)));
    assert_eq!((g.add(x, ny), g.add(ny, x), g.sub(ny, nx)), (difference, difference, difference));
    assert_eq!((g.sub(x, ny), negative(&mut g, difference)), (sum, g.sub(y, x)));
}

#[test]
fn factors_gather() {
    let (mut g, [x, ..]) = start();
    let [two, three, six] = [2.0, 3.0, 6.0].map(|c| g.constant(c));
    let minus_two = g.constant(-2.0);
    let doubled = g.mul(two, x);
    let whole = g.mul(six, x);
    assert_eq!((g.mul(three, doubled), g.mul(doubled, three)), (whole, whole));
    // A factor and its negative share the product.
    let opposite = g.mul(minus_two, x);
    assert_eq!(opposite, g.neg(doubled));
    let undone = g.constant(0.5);
    assert_eq!(g.mul(undone, doubled), x);
}

#[test]
fn an_operation_exists_once() {
    let (mut g, [x, y, z]) = start();
    let build = |g: &mut Graph| {
        let (xy, yz) = (g.mul(x, y), g.mul(y, z));
        let sum = g.add(xy, yz);
        let root = g.sqrt(sum);
        let angle = g.atan2(root, x);
        g.select(angle, z, root, xy)
    };
    let first = build(&mut g);
    let size = g.len();
    assert_eq!(build(&mut g), first);
    assert_eq!((g.mul(y, x), g.add(x, y)), (g.mul(x, y), g.add(y, x)));
    assert_eq!(g.len(), size + 1, "only x + y is new");
    assert_eq!((g.constant(-0.0), g.input(1)), (g.constant(0.0), y));
}

#[test]
fn constants_fold_in_every_operation() {
    let mut g = Graph::default();
    g.tables.push(curve());
    let (a, b) = (1.7, -0.6);
    let [na, nb] = [a, b].map(|c| g.constant(c));
    let folded = [
        (g.add(na, nb), a + b),
        (g.sub(na, nb), a - b),
        (g.mul(na, nb), a * b),
        (g.div(na, nb), a / b),
        (g.neg(na), -a),
        (g.sqrt(na), a.sqrt()),
        (g.sin(na), a.sin()),
        (g.cos(na), a.cos()),
        (g.atan2(na, nb), a.atan2(b)),
        (g.exp(na), a.exp()),
        (g.ln(na), a.ln()),
        (g.tanh(na), a.tanh()),
        (g.powi(na, -3), a.powi(-3)),
        (g.powf(na, 1.4), a.powf(1.4)),
        (g.table(0, 0, na), curve().derivative(a, 0)),
        (g.table(0, 2, na), curve().derivative(a, 2)),
    ];
    for (node, expected) in folded {
        assert_eq!(g.value(node), Some(expected));
    }
}

/// A number with a bound on its round-off, so that a comparison knows how much cancellation there was.
#[derive(Clone, Copy)]
struct Rounded {
    value: f64,
    error: f64,
}

impl Rounded {
    /// A result whose operands' errors, by the derivatives of the operation, come to `error`.
    fn new(value: f64, error: f64) -> Self {
        Self { value, error: error + 4.0 * f64::EPSILON * value.abs() }
    }
}

/// One random operation, in the graph and in plain numbers; `None` where it would leave the range of tame numbers.
fn operation(g: &mut Graph, known: &[(Node, Rounded)], random: &mut Random) -> Option<(Node, Rounded)> {
    let mut pick = || known[random.below(known.len())];
    let ((a, x), (b, y), (c, u), (d, w)) = (pick(), pick(), pick(), pick());
    let (node, result) = match random.below(17) {
        0 | 1 => (g.add(a, b), Rounded::new(x.value + y.value, x.error + y.error)),
        2 | 3 => (g.sub(a, b), Rounded::new(x.value - y.value, x.error + y.error)),
        4..=6 => {
            let error = x.value.abs() * y.error + y.value.abs() * x.error + x.error * y.error;
            (g.mul(a, b), Rounded::new(x.value * y.value, error))
        }
        7 if y.value.abs() > 0.05 => {
            let error = 2.0 * (x.error + (x.value / y.value).abs() * y.error) / y.value.abs();
            (g.div(a, b), Rounded::new(x.value / y.value, error))
        }
        8 | 9 => (g.neg(a), Rounded { value: -x.value, error: x.error }),
        10 if x.value > 0.05 => (g.sqrt(a), Rounded::new(x.value.sqrt(), x.error / x.value.sqrt())),
        11 => (g.sin(a), Rounded::new(x.value.sin(), x.error)),
        12 => (g.cos(a), Rounded::new(x.value.cos(), x.error)),
        // Away from the jump at pi.
        13 if x.value.abs() > 0.05 => {
            let error = 2.0 * (x.error + y.error) / x.value.hypot(y.value);
            (g.atan2(a, b), Rounded::new(x.value.atan2(y.value), error))
        }
        14 => {
            let n = random.below(6) as i32 - 2;
            if n < 0 && x.value.abs() < 0.05 {
                return None;
            }
            let error = 2.0 * f64::from(n).abs() * x.value.abs().powi(n - 1) * x.error;
            let error = if error.is_finite() { error } else { x.error };
            (g.powi(a, n), Rounded::new(x.value.powi(n), error))
        }
        15 => (g.tanh(a), Rounded::new(x.value.tanh(), x.error)),
        _ if a == b || (x.value - y.value).abs() > x.error + y.error => {
            (g.select(a, b, c, d), if x.value < y.value { u } else { w })
        }
        _ => return None,
    };
    (result.value.abs() < 1e3).then_some((node, result))
}

#[test]
fn simplified_expressions_have_the_value_of_plain_ones() {
    let mut random = Random(3);
    let mut compared = 0;
    for _ in 0..300 {
        let (mut g, nodes) = start();
        let inputs = random.vector(3);
        let exact = |value: f64| Rounded { value, error: 0.0 };
        let mut known: Vec<(Node, Rounded)> = nodes.iter().zip(&inputs).map(|(n, x)| (*n, exact(*x))).collect();
        for c in [0.0, 1.0, -1.0, 2.0, -0.5, 0.3] {
            known.push((g.constant(c), exact(c)));
        }
        for _ in 0..60 {
            known.extend(operation(&mut g, &known, &mut random));
        }
        let all: Vec<Node> = known.iter().map(|(node, _)| *node).collect();
        for (found, (node, plain)) in values(&g, &all, &inputs).into_iter().zip(&known) {
            let off = (found - plain.value).abs();
            assert!(off <= 2.0 * plain.error, "{:?}: {found} is not {}", g.expr(*node), plain.value);
            compared += 1;
        }
    }
    assert!(compared > 10_000, "{compared}");
}

#[test]
fn operands_come_before_their_users() {
    let mut random = Random(5);
    let (mut g, nodes) = start();
    let mut known: Vec<(Node, Rounded)> = nodes.map(|n| (n, Rounded { value: random.next(), error: 0.0 })).to_vec();
    for _ in 0..400 {
        known.extend(operation(&mut g, &known, &mut random));
    }
    for (node, _) in &known {
        g.operands(*node, |operand| assert!(operand < *node));
    }
    let last = known.iter().map(|(node, _)| *node).max().unwrap();
    let list = g.ancestors(&[last], |_| false);
    assert!(list.windows(2).all(|pair| pair[0] < pair[1]) && list.last() == Some(&last));
    for node in &list {
        g.operands(*node, |operand| assert!(list.binary_search(&operand).is_ok()));
    }
}

/// All that outputs depend on is found by looking at every node below, or at what is reached only.
#[test]
fn what_is_live_is_what_is_reached() {
    let mut random = Random(17);
    let (mut g, nodes) = start();
    g.calls.push(Call {
        set: 0,
        instance: 0,
        arguments: nodes.to_vec(),
        results: 2,
        jacobian_from: 2,
        second_from: 2,
        second_to: 2,
    });
    let mut known: Vec<(Node, Rounded)> = nodes.map(|n| (n, Rounded { value: random.next(), error: 0.0 })).to_vec();
    known.push((g.call_result(0, 1), Rounded { value: 0.3, error: 0.0 }));
    for _ in 0..400 {
        known.extend(operation(&mut g, &known, &mut random));
    }
    assert!(g.len() > 200);
    assert!(g.live(&[]).is_empty());
    for first in 0..known.len() {
        let step = 1 + first % 97;
        let outputs: Vec<Node> = known.iter().skip(first).step_by(step).map(|(node, _)| *node).collect();
        for outputs in [&outputs[..], &outputs[..1]] {
            assert_eq!(g.live(outputs), g.entered(outputs, |_| false));
            let stop = |node: Node| node.0 % 5 == 2;
            assert_eq!(g.ancestors(outputs, stop), g.entered(outputs, stop));
        }
    }
}

#[test]
fn ancestors_stop_where_told() {
    let (mut g, [x, y, z]) = start();
    let inner = g.mul(x, y);
    let outer = g.add(inner, z);
    assert_eq!(g.ancestors(&[outer], |node| node == inner), [z, inner, outer]);
    assert_eq!(g.ancestors(&[outer], |_| false), [x, y, z, inner, outer]);
}

#[test]
fn a_selection_keeps_its_condition() {
    let (mut g, [x, y, _]) = start();
    let (nx, ny) = (g.neg(x), g.neg(y));
    let smaller = g.select(x, y, nx, ny);
    assert!(matches!(g.expr(smaller), Expr::Select(..)));
    for (a, b, expected) in [(1.0, 2.0, -1.0), (2.0, 1.0, -1.0), (1.0, 1.0, -1.0)] {
        assert_eq!(value(&g, smaller, &[a, b, 0.0]), expected);
    }
    // Not below itself: the second one.
    let second = g.select(x, x, nx, y);
    assert_eq!(value(&g, second, &[1.0, 2.0, 0.0]), 2.0);
}
