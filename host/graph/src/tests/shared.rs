//! Code made for one program does what another one of its structure does, whatever the constants; and no others have it.

use super::*;
use crate::{Maker, SharedCode, Used};

/// Operations of every kind of two inputs and these constants, one of them as an exponent.
fn program(constants: [f64; 3], exponent: f64) -> Program {
    let mut g = Graph::default();
    let (a, b) = (g.input(0), g.input(1));
    let [c, d, e] = constants.map(|value| g.constant(value));
    let scaled = g.mul(a, c);
    let turned = g.sin(scaled);
    let shifted = g.add(turned, d);
    let squares = g.mul(shifted, shifted);
    let power = g.powf(squares, exponent);
    let later = g.cos(power);
    let chosen = g.select(b, e, later, power);
    Program::compile(&g, &[chosen, shifted, d])
}

fn outputs(program: &Program) -> Vec<u64> {
    let mut found = [f64::NAN; 3];
    program.run(&[0.7, -0.2], &[], &mut program.workspace(), &mut found).unwrap();
    found.map(f64::to_bits).to_vec()
}

fn used(program: &mut Program, runs: u64) -> Vec<Used<'_>> {
    vec![Used { program, runs, spare: false, stepped: false, sampled: false }]
}

#[test]
fn programs_of_one_structure_share_their_code() {
    let (shared, maker) = (SharedCode::default(), Maker::here());
    let mut first = program([0.3, 1.5, -2.0], 1.5);
    let needed = maker.runs_that_pay(first.listed()).ceil() as u64;
    shared.learn(maker, used(&mut first, needed - 1));
    assert!(shared.find(&first).is_none(), "it has not been run often enough");
    // The runs of all add up.
    shared.learn(maker, used(&mut program([5.0, 6.0, 7.0], 1.5), 1));
    for constants in [[0.3, 1.5, -2.0], [0.4, -1.5, 3.0], [1e300, f64::NAN, f64::INFINITY]] {
        let interpreted = program(constants, 1.5);
        let mut compiled = interpreted.clone();
        compiled.install(shared.find(&interpreted).unwrap());
        assert_eq!(outputs(&compiled), outputs(&interpreted), "{constants:?}");
    }
    assert!(shared.find(&program([0.3, 1.5, -2.0], 2.5)).is_none(), "an exponent is part of the operation");
    // A factor of one, or two constants that are one, leave other operations.
    assert!(shared.find(&program([1.0, 1.5, -2.0], 1.5)).is_none());
    assert!(shared.find(&program([1.5, 1.5, -2.0], 1.5)).is_none());
}

#[test]
fn not_more_is_kept_than_comes_again() {
    let (shared, maker) = (SharedCode::default(), Maker::here());
    let chain = |length: usize| {
        let mut g = Graph::default();
        let mut node = g.input(0);
        for _ in 0..length {
            node = g.tanh(node);
        }
        Program::compile(&g, &[node])
    };
    for length in 1..=300 {
        shared.learn(maker, used(&mut chain(length), 1_000_000));
    }
    assert!(shared.find(&chain(1)).is_some());
    assert!(shared.find(&chain(300)).is_none());
}
