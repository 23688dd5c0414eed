//! Machine code: the interpreter's numbers, bit for bit, whatever the lists are cut into.

#[path = "../../../testing/machine.rs"]
mod twins;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::*;
use twins::{By, assert_same, by_machine, makers};

#[test]
fn random_programs_give_the_same_bits() {
    let mut random = Random(23);
    for round in 0..40 {
        let (graph, nodes) = tape::random_graph(&mut random, 5, 40 + 20 * round);
        let outputs: Vec<Node> = (0..12).map(|_| nodes[random.below(nodes.len())]).collect();
        let program = Program::compile(&graph, &outputs);
        for maker in makers(&[1 + random.below(120)]) {
            let machine = by_machine(&program, maker);
            let (mut a, mut b) = (program.workspace(), machine.workspace());
            let (mut expected, mut found) = (vec![0.0; outputs.len()], vec![0.0; outputs.len()]);
            for _ in 0..5 {
                let inputs: Vec<f64> = random.vector(5).iter().map(|x| 3.0 * x).collect();
                program.run(&inputs, &[], &mut a, &mut expected).unwrap();
                machine.run(&inputs, &[], &mut b, &mut found).unwrap();
                assert_same(&found, &expected);
            }
        }
    }
}

#[test]
fn many_outputs_of_programs_without_functions_are_all_written() {
    let mut random = Random(31);
    for round in 0..40 {
        let mut g = Graph::default();
        let mut nodes: Vec<Node> = (0..6).map(|slot| g.input(slot)).collect();
        nodes.push(g.constant(0.7));
        for _ in 0..30 * (1 + round % 8) {
            let [a, b, c, d] = [0; 4].map(|_| nodes[random.below(nodes.len())]);
            nodes.push(match random.below(7) {
                0 => g.add(a, b),
                1 => g.sub(a, b),
                2 | 3 => g.mul(a, b),
                4 => g.div(a, b),
                5 => g.select(a, b, c, d),
                _ => g.neg(a),
            });
        }
        // Some twice, some inputs and constants.
        let outputs: Vec<Node> = (0..1 + 9 * (round % 13)).map(|_| nodes[random.below(nodes.len())]).collect();
        let program = Program::compile(&g, &outputs);
        for maker in makers(&[1 + random.below(120)]) {
            let machine = by_machine(&program, maker);
            let (mut a, mut b) = (program.workspace(), machine.workspace());
            for _ in 0..3 {
                let inputs = random.vector(6);
                let (mut expected, mut found) = (vec![0.0; outputs.len()], vec![f64::MAX; outputs.len()]);
                program.run(&inputs, &[], &mut a, &mut expected).unwrap();
                machine.run(&inputs, &[], &mut b, &mut found).unwrap();
                assert_same(&found, &expected);
            }
        }
    }
}

#[test]
fn programs_made_together_give_the_same_bits_whichever_is_dropped_first() {
    let mut random = Random(29);
    let mut programs: Vec<Program> = Vec::new();
    for round in 0..12 {
        let (graph, nodes) = tape::random_graph(&mut random, 5, 300 / (1 + round % 4));
        // Some copy inputs, some have no outputs at all.
        let outputs: Vec<Node> = (0..round % 5).map(|_| nodes[random.below(nodes.len())]).collect();
        programs.push(Program::compile(&graph, &outputs));
    }
    let all: Vec<&Program> = programs.iter().collect();
    let codes = match MachineCode::compile_all(&all, Maker::here(), &AtomicBool::new(false)) {
        Ok(codes) => codes,
        Err(error) => return assert!(!MachineCode::can_assemble(), "{error}"),
    };
    let mut machines: Vec<Program> = Vec::new();
    for (program, code) in programs.iter().zip(codes) {
        let alone = MachineCode::compile(program, Maker::here(), &AtomicBool::new(false)).unwrap();
        assert!(code.bytes().abs_diff(alone.bytes()) < 16 * (program.lists().count() + 1));
        let mut machine = program.clone();
        machine.install(Arc::new(code));
        machines.push(machine);
    }
    while let Some(machine) = machines.pop() {
        let program = &programs[machines.len()];
        let (mut expected, mut found) = (vec![0.0; program.output_count()], vec![0.0; program.output_count()]);
        let inputs = random.vector(5);
        program.run(&inputs, &[], &mut program.workspace(), &mut expected).unwrap();
        machine.run(&inputs, &[], &mut machine.workspace(), &mut found).unwrap();
        assert_same(&found, &expected);
    }
}

#[test]
fn angles_far_away_and_no_angles_among_others_give_the_same_bits() {
    let mut random = Random(41);
    for count in 1..12 {
        let mut g = Graph::default();
        let angles: Vec<Node> = (0..count).map(|slot| g.input(slot)).collect();
        let mut nodes: Vec<Node> = angles.iter().flat_map(|angle| [g.sin(*angle), g.cos(*angle)]).collect();
        // Something besides the sines, which are not for those who make pieces.
        nodes.push(g.add(nodes[0], nodes[1]));
        let program = Program::compile(&g, &nodes);
        for special in [0.0, -0.0, 1.6e6, -1e9, 1e300, f64::INFINITY, f64::NAN] {
            let mut inputs = random.vector(count);
            inputs[random.below(count)] = special;
            let mut expected = vec![0.0; nodes.len()];
            program.run(&inputs, &[], &mut program.workspace(), &mut expected).unwrap();
            for maker in makers(&[3]) {
                let machine = by_machine(&program, maker);
                let mut found = vec![f64::MAX; nodes.len()];
                machine.run(&inputs, &[], &mut machine.workspace(), &mut found).unwrap();
                assert_same(&found, &expected);
            }
        }
    }
}

#[test]
fn every_operation_gives_the_same_bits_at_every_kind_of_number() {
    let kinds = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.3,
        -2.7,
        1e-310,
        -1e308,
        f64::MIN_POSITIVE,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];
    let mut g = Graph::default();
    g.tables.push(element_api::Table::clamped(&[[-1.0, 0.0], [0.2, 1.0], [1.0, 0.5]]).unwrap());
    let (a, b) = (g.input(0), g.input(1));
    let (c, d) = (g.input(2), g.input(3));
    let mut nodes = vec![g.add(a, b), g.sub(a, b), g.mul(a, b), g.div(a, b), g.neg(a), g.sqrt(a), g.sin(a), g.cos(a)];
    nodes.extend([g.atan2(a, b), g.exp(a), g.ln(a), g.tanh(a), g.powf(a, 1.5), g.powf(a, -0.5), g.select(a, b, c, d)]);
    nodes.extend((-11..=11).map(|n| g.powi(a, n)));
    nodes.extend((0..4).map(|order| g.table(0, order, a)));
    let program = Program::compile(&g, &nodes);
    for maker in makers(&[7]) {
        let machine = by_machine(&program, maker);
        let (mut expected, mut found) = (vec![0.0; nodes.len()], vec![0.0; nodes.len()]);
        for x in kinds {
            for y in kinds {
                let inputs = [x, y, 5.0, 7.0];
                program.run(&inputs, &[], &mut program.workspace(), &mut expected).unwrap();
                machine.run(&inputs, &[], &mut machine.workspace(), &mut found).unwrap();
                assert_same(&found, &expected);
            }
        }
    }
}

#[test]
fn what_is_no_longer_wanted_is_not_made() {
    let mut g = Graph::default();
    let a = g.input(0);
    let node = g.tanh(a);
    let program = Program::compile(&g, &[node]);
    let told = AtomicBool::new(true);
    for maker in makers(&[7]) {
        let made = match maker {
            By::Assembler => MachineCode::compile(&program, Maker::Assembler, &told),
            By::Cranelift(piece) => MachineCode::in_pieces(&program, &told, piece),
        };
        assert!(matches!(made, Err(MachineError::Cancelled)));
    }
}
