//! Programs of variants are those that are compiled anew, constants and all; another structure is seen.

use element_api::{Outside, Table};

use super::*;
use crate::Structures;

/// Operations of every kind with these constants; and a table of this slope.
fn graph(constants: [f64; 4], slope: f64) -> (Graph, Vec<Node>) {
    let mut g = Graph::default();
    g.tables.push(Table { breaks: vec![-1.0, 1.0], pieces: vec![[0.0, slope, 0.0, 0.0]], outside: Outside::Clamped });
    let (a, b) = (g.input(0), g.input(1));
    let [c, d, e, f] = constants.map(|value| g.constant(value));
    let scaled = g.mul(a, c);
    let (sine, cosine) = (g.sin(scaled), g.cos(scaled));
    let shifted = g.add(sine, d);
    let turned = g.mul(cosine, e);
    let looked = g.table(0, 0, b);
    let both = g.mul(shifted, looked);
    let chosen = g.select(b, f, both, turned);
    let power = g.powi(chosen, 3);
    (g, vec![power, shifted, d, both])
}

/// All that a program is, but for its number.
fn described(program: &Program) -> String {
    let text = format!("{program:?}");
    text.split_once(", ").unwrap().1.to_string()
}

fn bits(program: &Program, count: usize) -> Vec<u64> {
    let mut found = vec![f64::NAN; count];
    program.run(&[0.7, -0.2], &[], &mut program.workspace(), &mut found).unwrap();
    found.into_iter().map(f64::to_bits).collect()
}

#[test]
fn variants_have_the_program_that_is_compiled_anew() {
    let structures = Structures::default();
    let mut random = Random(11);
    for _ in 0..50 {
        let constants = [0; 4].map(|_| random.between(-3.0, 3.0));
        let (graph, outputs) = graph(constants, random.between(-1.0, 1.0));
        let (anew, known) =
            (Program::compile(&graph, &outputs), structures.during(|| Program::compile(&graph, &outputs)));
        assert_eq!(described(&known), described(&anew));
        assert_eq!(bits(&known, outputs.len()), bits(&anew, outputs.len()));
        assert_ne!(known.id(), anew.id());
    }
    assert!(structures.found() >= 40, "signs make some structures: {}", structures.found());
}

#[test]
fn another_structure_is_compiled_anew() {
    let structures = Structures::default();
    let first = graph([0.3, 1.5, 2.0, 0.4], 1.0);
    structures.during(|| Program::compile(&first.0, &first.1));
    // A factor of one; one of zero; two constants that are one; a sign that moves outwards; fewer outputs; others.
    let others = [[1.0, 1.5, 2.0, 0.4], [0.0, 1.5, 2.0, 0.4], [1.5, 1.5, 2.0, 0.4], [0.3, 1.5, -2.0, 0.4]];
    let mut others: Vec<(Graph, Vec<Node>)> = others.map(|constants| graph(constants, 1.0)).into();
    others.push((first.0.clone(), first.1[..3].to_vec()));
    others.push((first.0.clone(), first.1.iter().rev().copied().collect()));
    for (graph, outputs) in &others {
        let before = structures.found();
        let found = structures.during(|| Program::compile(graph, outputs));
        assert_eq!(structures.found(), before);
        assert_eq!(described(&found), described(&Program::compile(graph, outputs)));
    }
}

#[test]
fn what_is_kept_is_bounded_and_left_behind() {
    let structures = Structures::default();
    let chain = |length: usize| {
        let mut g = Graph::default();
        let start = g.input(0);
        let node = (0..length).fold(start, |node, _| g.tanh(node));
        (g, node)
    };
    let long = chain(900_000);
    structures.during(|| Program::compile(&long.0, &[long.1]));
    assert_eq!(structures.nodes(), 900_001);
    let other = chain(100_001);
    structures.during(|| Program::compile(&other.0, &[other.1]));
    assert_eq!(structures.nodes(), 900_001, "more is not kept");
    // Outside of `during` nothing is looked up.
    let before = structures.found();
    let _ = Program::compile(&long.0, &[long.1]);
    assert_eq!(structures.found(), before);
    structures.during(|| Program::compile(&long.0, &[long.1]));
    assert_eq!(structures.found(), before + 1);
}
