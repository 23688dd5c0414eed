//! Programs: the same numbers as the graph, bit for bit, from as few operations and registers as it takes.

use element_api::Table;
use element_api::params::Table as Parameters;
use element_api::recording::Recording;
use element_api::set::{Batch, CreateError, ElementSet, Fault};

use super::{Random, values};
use crate::{Call, Expr, Graph, Node, Program};

/// A large graph of random operations whose values may be anything, also infinite or not a number.
pub(super) fn random_graph(random: &mut Random, inputs: usize, operations: usize) -> (Graph, Vec<Node>) {
    let mut g = Graph::default();
    g.tables.push(Table::clamped(&[[-1.0, 0.0], [0.2, 1.0], [1.0, 0.5]]).unwrap());
    let mut nodes: Vec<Node> = (0..inputs).map(|k| g.input(k)).collect();
    nodes.extend([0.7, -1.3, 2.0].map(|c| g.constant(c)));
    for _ in 0..operations {
        let mut pick = || nodes[random.below(nodes.len())];
        let (a, b, c, d) = (pick(), pick(), pick(), pick());
        let node = match random.below(19) {
            0..=2 => g.add(a, b),
            3 | 4 => g.sub(a, b),
            5..=7 => g.mul(a, b),
            8 => g.div(a, b),
            9 => g.neg(a),
            10 => g.sqrt(a),
            11 => g.sin(a),
            12 if random.below(2) == 0 => {
                // Both of one angle.
                let cosine = g.cos(a);
                nodes.push(cosine);
                g.sin(a)
            }
            12 => g.cos(a),
            13 => g.atan2(a, b),
            14 => g.tanh(a),
            15 => g.powi(a, random.below(7) as i32 - 3),
            16 => g.powf(a, 1.5),
            17 => g.select(a, b, c, d),
            _ => g.table(0, random.below(3) as u32, a),
        };
        nodes.push(node);
    }
    (g, nodes)
}

/// The value of every node, one after the other, none ever overwritten.
fn direct(graph: &Graph, last: Node, inputs: &[f64]) -> Vec<f64> {
    let mut x: Vec<f64> = Vec::new();
    for k in 0..=last.0 {
        let v = |node: Node| x[node.0 as usize];
        let value = match graph.expr(Node(k)) {
            Expr::Constant(bits) => f64::from_bits(bits),
            Expr::Input(slot) => inputs[slot as usize],
            Expr::Add(a, b) => v(a) + v(b),
            Expr::Sub(a, b) => v(a) - v(b),
            Expr::Mul(a, b) => v(a) * v(b),
            Expr::Div(a, b) => v(a) / v(b),
            Expr::Neg(a) => -v(a),
            Expr::Sqrt(a) => v(a).sqrt(),
            Expr::Sin(a) => crate::turn::sin(v(a)),
            Expr::Cos(a) => crate::turn::cos(v(a)),
            Expr::Atan2(a, b) => v(a).atan2(v(b)),
            Expr::Exp(a) => v(a).exp(),
            Expr::Ln(a) => v(a).ln(),
            Expr::Tanh(a) => v(a).tanh(),
            Expr::Powi(a, n) => v(a).powi(n),
            Expr::Powf(a, bits) => v(a).powf(f64::from_bits(bits)),
            Expr::Select(a, b, c, d) => {
                if v(a) < v(b) {
                    v(c)
                } else {
                    v(d)
                }
            }
            Expr::Table { table, order, at } => graph.tables[table as usize].derivative(v(at), order),
            Expr::Call { .. } => panic!("no calls here"),
        };
        x.push(value);
    }
    x
}

#[test]
fn programs_compute_what_the_graph_says_bit_for_bit() {
    let mut random = Random(17);
    for round in 0..60 {
        let (graph, nodes) = random_graph(&mut random, 5, 40 + 10 * round);
        // Inputs, constants, repeated outputs: whatever comes.
        let mut outputs: Vec<Node> = (0..12).map(|_| nodes[random.below(nodes.len())]).collect();
        if round % 3 == 0 {
            // Few of many nodes: compiled from an excerpt.
            outputs = (0..2).map(|_| nodes[random.below(20)]).collect();
        }
        let program = Program::compile(&graph, &outputs);
        let mut workspace = program.workspace();
        let mut found = vec![0.0; outputs.len()];
        // The same workspace again and again: nothing may be left over from the run before.
        for _ in 0..3 {
            let inputs = random.vector(5);
            program.run(&inputs, &[], &mut workspace, &mut found).unwrap();
            let expected = direct(&graph, *nodes.iter().max().unwrap(), &inputs);
            for (node, value) in outputs.iter().zip(&found) {
                let expected = expected[node.0 as usize];
                assert!(value.to_bits() == expected.to_bits() || (value.is_nan() && expected.is_nan()));
            }
        }
    }
}

#[test]
fn only_what_an_output_needs_is_run() {
    let mut random = Random(19);
    let (graph, nodes) = random_graph(&mut random, 4, 500);
    for _ in 0..20 {
        let outputs: Vec<Node> = (0..3).map(|_| nodes[random.below(nodes.len())]).collect();
        let program = Program::compile(&graph, &outputs);
        let live = graph.ancestors(&outputs, |_| false);
        let operations = live.iter().filter(|n| !matches!(graph.expr(**n), Expr::Constant(_) | Expr::Input(_))).count();
        assert_eq!((program.operations(), program.output_count(), program.calls()), (operations, 3, 0));
        for slot in 0..4 {
            let used = live.iter().any(|n| graph.expr(*n) == Expr::Input(slot));
            assert_eq!(program.uses_inputs(slot as usize..slot as usize + 1), used);
        }
    }
}

#[test]
fn a_program_without_operations_copies() {
    let mut g = Graph::default();
    let (x, c) = (g.input(2), g.constant(4.5));
    assert_eq!(values(&g, &[c, x, c], &[0.0, 0.0, 7.0]), [4.5, 7.0, 4.5]);
    assert!(values(&g, &[], &[]).is_empty());
}

#[test]
fn inputs_and_outputs_are_found_however_they_are_copied() {
    let mut random = Random(29);
    // Long and short stretches of slots, first used in another order.
    let slots: Vec<usize> = (30..45).chain([3, 4, 7]).chain(8..20).collect();
    let inputs = random.vector(50);
    for many in [1_usize, 7, 8, 9, 40] {
        let mut g = Graph::default();
        let x: Vec<Node> = slots.iter().map(|slot| g.input(*slot)).collect();
        let constant = g.constant(2.5);
        let mut outputs = Vec::new();
        for k in 0..many {
            let (a, b) = (x[k % x.len()], x[(7 * k + 3) % x.len()]);
            outputs.push(match k % 5 {
                0 => g.sub(a, b),
                1 => a,
                2 => constant,
                3 => g.sin(a),
                _ => outputs[k / 2],
            });
        }
        let expected = direct(&g, *outputs.iter().chain(&x).max().unwrap(), &inputs);
        let program = Program::compile(&g, &outputs);
        let (mut workspace, mut found) = (program.workspace(), vec![f64::NAN; many]);
        for _ in 0..2 {
            program.run(&inputs, &[], &mut workspace, &mut found).unwrap();
            for (node, value) in outputs.iter().zip(&found) {
                assert_eq!(value.to_bits(), expected[node.0 as usize].to_bits());
            }
        }
    }
}

/// An opaque set whose instance k gives (k + 1) times the sum of its inputs, times the number of the result; it fails when
/// the sum is negative, and leaves a gap where it is zero.
struct Sums;

impl ElementSet for Sums {
    fn add(&mut self, _: &Parameters) -> Result<usize, CreateError> {
        Ok(0)
    }
    fn record(&self, _: usize) -> Result<Recording, Fault> {
        Ok(Recording::default())
    }
    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        let count = batch.instances.len();
        let (given, results) = (batch.inputs.len() / count, out.len() / count);
        for (k, instance) in batch.instances.iter().enumerate() {
            let sum: f64 = batch.inputs[given * k..given * (k + 1)].iter().sum();
            if sum < 0.0 {
                return Err(Fault { instance: *instance as usize, message: "negative".into() });
            }
            for (result, slot) in out[results * k..results * (k + 1)].iter_mut().enumerate() {
                let wanted = match result {
                    0 => true,
                    1 => batch.wanted.jacobian,
                    _ => batch.wanted.second,
                };
                if wanted && sum > 0.0 {
                    *slot = f64::from(instance + 1) * sum * (result + 1) as f64;
                }
            }
        }
        Ok(())
    }
    fn accept(&mut self, _: usize, _: &[f64]) -> Result<(), Fault> {
        Ok(())
    }
    fn save(&self, _: usize) -> Result<Vec<u8>, Fault> {
        Ok(Vec::new())
    }
    fn load(&mut self, _: usize, _: &[u8]) -> Result<(), Fault> {
        Ok(())
    }
}

/// Three instances of two sets, each called with x + y and y; results: value, derivative, second derivative.
fn graph_with_calls() -> (Graph, Node) {
    let mut g = Graph::default();
    let (x, y) = (g.input(0), g.input(1));
    let sum = g.add(x, y);
    for (set, instance) in [(0, 0), (1, 0), (0, 1)] {
        g.calls.push(Call {
            set,
            instance,
            arguments: vec![sum, y],
            results: 3,
            jacobian_from: 1,
            second_from: 2,
            second_to: 3,
        });
    }
    (g, sum)
}

fn run(program: &Program, inputs: &[f64]) -> Result<Vec<f64>, (usize, Fault)> {
    let sets: [Box<dyn ElementSet>; 2] = [Box::new(Sums), Box::new(Sums)];
    let mut found = vec![0.0; program.output_count()];
    program.run(inputs, &sets, &mut program.workspace(), &mut found)?;
    Ok(found)
}

#[test]
fn instances_of_a_set_are_called_together_between_what_feeds_and_what_uses_them() {
    let (mut g, sum) = graph_with_calls();
    let results: Vec<Node> = (0..3).map(|call| g.call_result(call, 0)).collect();
    let double = g.add(results[0], results[2]);
    let used = g.mul(double, sum);
    let program = Program::compile(&g, &[used, results[1], sum]);
    assert_eq!((program.calls(), program.operations()), (2, 3));
    // x = 1, y = 2: the sum of the arguments is 5; 5 + 10 = 15 from set 0, times 3.
    assert_eq!(run(&program, &[1.0, 2.0]), Ok(vec![45.0, 5.0, 3.0]));
    // What is not asked for is not called.
    assert_eq!(Program::compile(&g, &[results[1]]).calls(), 1);
    assert_eq!(Program::compile(&g, &[sum]).calls(), 0);
}

#[test]
fn derivatives_are_wanted_only_where_they_are_used() {
    let (mut g, _) = graph_with_calls();
    let [value, slope, second] = [0, 1, 2].map(|result| g.call_result(0, result));
    // The set leaves out what is not wanted, so a forgotten wish shows as NaN.
    for outputs in [vec![value], vec![slope], vec![second], vec![second, value], vec![slope, value, second]] {
        let found = run(&Program::compile(&g, &outputs), &[1.0, 2.0]).unwrap();
        let expected: Vec<f64> = outputs
            .iter()
            .map(|node| {
                if *node == value {
                    5.0
                } else if *node == slope {
                    10.0
                } else {
                    15.0
                }
            })
            .collect();
        assert_eq!(found, expected);
    }
}

#[test]
fn what_an_opaque_element_does_not_write_is_not_a_number() {
    let (mut g, _) = graph_with_calls();
    let value = g.call_result(0, 0);
    let program = Program::compile(&g, &[value]);
    let sets: [Box<dyn ElementSet>; 2] = [Box::new(Sums), Box::new(Sums)];
    let (mut workspace, mut found) = (program.workspace(), [0.0]);
    program.run(&[1.0, 2.0], &sets, &mut workspace, &mut found).unwrap();
    assert_eq!(found, [5.0]);
    program.run(&[0.0, 0.0], &sets, &mut workspace, &mut found).unwrap();
    assert!(found[0].is_nan(), "not the number of the run before");
}

#[test]
fn a_failing_call_names_its_set() {
    let (mut g, _) = graph_with_calls();
    let value = g.call_result(1, 0);
    let error = run(&Program::compile(&g, &[value]), &[-1.0, 0.0]).unwrap_err();
    assert_eq!(error, (1, Fault { instance: 0, message: "negative".into() }));
}
