//! Exact derivatives along directions, against differences of what they are derivatives of.

use odyn::export::{Machine, Twin};

use super::{PENDULUM, Random, machine, of_text};
use crate::support::open;

/// What is differentiated, at a place.
fn values(twin: &mut Twin, time: f64, state: &[f64], inputs: &[f64]) -> Vec<f64> {
    inputs.iter().enumerate().for_each(|(number, value)| twin.set_input(number, *value));
    twin.set(time, state);
    let mut rates = vec![0.0; state.len()];
    twin.rates(time, state, &mut rates).unwrap();
    [rates, twin.outputs().to_vec()].concat()
}

/// Differences of order 4 along a direction, and the derivatives, after so many steps.
fn compared(name: &str, machine: Machine, steps: usize) {
    let machine = machine.with_derivatives().unwrap();
    let mut twin = Twin::new(machine.clone());
    for _ in 0..steps {
        twin.step(machine.step).unwrap();
    }
    let (n, time, state) = (machine.dim(), twin.time(), twin.state().to_vec());
    let inputs: Vec<f64> = machine.inputs.iter().map(|port| port.start).collect();
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for direction in 0..2 * machine.seeds() {
        // Each axis alone, then all at once.
        let alone = |k: usize| if k == direction { 1.0 } else { 0.0 };
        let seed: Vec<f64> =
            (0..machine.seeds()).map(|k| if direction < machine.seeds() { alone(k) } else { random.next() }).collect();
        let mut at = |h: f64| {
            let moved: Vec<f64> = state.iter().zip(&seed[1..]).map(|(x, d)| x + h * d).collect();
            let given: Vec<f64> = inputs.iter().zip(&seed[1 + n..]).map(|(x, d)| x + h * d).collect();
            values(&mut twin, time + h * seed[0], &moved, &given)
        };
        let h = 1e-4;
        let [a, b, c, d] = [at(h), at(-h), at(2.0 * h), at(-2.0 * h)];
        let here = at(0.0);
        let slopes = twin.derivatives(&seed).unwrap();
        let found = [slopes.rates, slopes.outputs].concat();
        assert_eq!(found.len(), here.len());
        let scale = found.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
        for k in 0..found.len() {
            let difference = (8.0 * (a[k] - b[k]) - (c[k] - d[k])) / (12.0 * h);
            let size = found[k].abs().max(1e-3 * scale).max(here[k].abs());
            assert!(
                (found[k] - difference).abs() < 1e-6 * size,
                "{name}, direction {direction}, quantity {k}: {} by the chain rule, {difference} by differences",
                found[k]
            );
        }
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    compared("compressor", machine(open("compressor.toml", &[]), None, "rk4"), 10);
    compared("speed control", machine(open("compressor-speed-control.toml", &[]), None, "rk4"), 10);
    compared("bricard", machine(open("benchmarks/A04.toml", &[]), None, "rk4"), 10);
    compared("pendulum", machine(of_text(PENDULUM), Some(1e-3), "rk4"), 100);
    compared("bumper", machine(open("verification/bump-stop.toml", &[]), None, "rk4"), 40);
    compared("source", machine(open("verification/signal-source.toml", &[]), None, "rk4"), 33);
}
