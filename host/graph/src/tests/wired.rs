//! Wired programs: the outputs of the program they were made from, wherever inputs and outputs lie.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::*;

/// Equal bits, or both not a number.
fn assert_same(found: &[f64], wanted: &[f64]) {
    let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
    assert!(found.iter().zip(wanted).all(same), "{found:?} instead of {wanted:?}");
}

/// Program, graph inputs and wiring at random; checks the outputs of a wired program, with code by each of the makers.
fn check(random: &mut Random, round: usize) -> usize {
    const SLOTS: usize = 12;
    let (graph, nodes) = tape::random_graph(random, SLOTS, 40 + 20 * round);
    let outputs: Vec<Node> = (0..12).map(|_| nodes[random.below(nodes.len())]).collect();
    let program = Program::compile(&graph, &outputs);
    // The first slots are given, the others entries in some order.
    let given = random.below(SLOTS);
    let shift = random.below(SLOTS);
    let entry_of = |slot: usize| (slot >= given).then(|| (slot + shift) % SLOTS);
    let sources: Vec<Source> = (0..17)
        .map(|_| match random.below(4) {
            0 => Source::Entry(random.below(SLOTS)),
            1 => Source::Nothing,
            _ => Source::Output(random.below(8)),
        })
        .collect();
    let kept: Vec<usize> = (8..12).collect();
    let Some(plain) = Wired::new(&program, entry_of, &sources, &kept) else {
        // That is for nodes that are outputs twice.
        assert!((8..12).any(|k| outputs[..8].contains(&outputs[k])));
        return 0;
    };
    for slot in 0..SLOTS {
        assert_eq!(plain.program().uses_inputs(slot..slot + 1), program.uses_inputs(slot..slot + 1));
    }
    let mut ways = vec![plain.clone()];
    for maker in [Maker::Assembler, Maker::Compiler] {
        let mut wired = plain.clone();
        let workspace = wired.workspace();
        let program = wired.used(&workspace, false).program;
        if let Ok(code) = MachineCode::compile(program, maker, &AtomicBool::new(false)) {
            program.install(Arc::new(code));
            ways.push(wired);
        }
    }
    for wired in &ways {
        let (mut a, mut b) = (program.workspace(), wired.workspace());
        for _ in 0..3 {
            let inputs: Vec<f64> = random.vector(SLOTS).iter().map(|x| 3.0 * x).collect();
            let mut entries = random.vector(SLOTS);
            (given..SLOTS).for_each(|slot| entries[(slot + shift) % SLOTS] = inputs[slot]);
            let mut expected = vec![0.0; outputs.len()];
            program.run(&inputs, &[], &mut a, &mut expected).unwrap();
            let mut found = vec![f64::MAX; sources.len()];
            wired.run((&inputs, &entries), &[], &mut b, &mut found).unwrap();
            let wanted: Vec<f64> = sources
                .iter()
                .map(|source| match source {
                    Source::Output(output) => expected[*output],
                    Source::Entry(entry) => entries[*entry],
                    Source::Nothing => f64::MAX,
                })
                .collect();
            assert_same(&found, &wanted);
            assert_same(&wired.kept(&b).flatten().copied().collect::<Vec<_>>(), &expected[8..]);
        }
    }
    ways.len()
}

#[test]
fn they_give_the_same_bits_however_they_are_run() {
    let mut random = Random(37);
    let ways: usize = (0..60).map(|round| check(&mut random, round % 30)).sum();
    let least = if MachineCode::can_assemble() { 60 } else { 30 };
    assert!(ways > least, "{ways}");
}

#[test]
fn programs_wired_in_other_ways_share_no_code() {
    let mut random = Random(41);
    let (graph, nodes) = tape::random_graph(&mut random, 5, 200);
    let program = Program::compile(&graph, &nodes[nodes.len() - 6..]);
    let wired = |outputs: &[usize], kept: &[usize]| {
        let sources: Vec<Source> = outputs.iter().map(|output| Source::Output(*output)).collect();
        Wired::new(&program, Some, &sources, kept).unwrap()
    };
    let shared = SharedCode::default();
    let mut first = wired(&[0, 1], &[2]);
    let workspace = first.workspace();
    let program = first.used(&workspace, false).program;
    if let Ok(code) = MachineCode::compile(program, Maker::here(), &AtomicBool::new(false)) {
        program.install(Arc::new(code));
        shared.learn(Maker::here(), vec![Used { runs: 1, ..first.used(&workspace, false) }]);
        let found = |mut wired: Wired| shared.find(wired.used(&workspace, false).program).is_some();
        assert!(found(wired(&[0, 1], &[2])));
        assert!(!found(wired(&[1, 0], &[2])));
        assert!(!found(wired(&[0, 1], &[3])));
    }
}
