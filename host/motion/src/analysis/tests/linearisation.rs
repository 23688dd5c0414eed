//! Exact derivatives of the rates against differences.

use super::*;

/// A pendulum whose angle is prescribed: a row that depends on time.
fn driven() -> String {
    scenes::pendulum("[simulation]\ngravity = [0, -9.81, 0]\nt_end = 1\noutput_step = 0.1\n")
        + "[[joint]]\nname = \"motor\"\ntype = \"drive\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\n\
           axis = [0, 0, 1]\nparams = { speed = 2 }\n"
}

/// The derivative of the rates along a direction of the state, by central differences.
fn difference_along(stand: &mut Stand, state: &[f64], direction: &[f64]) -> Vec<f64> {
    let step = 1e-5;
    let mut rates = |sign: f64| {
        let moved: Vec<f64> = state.iter().zip(direction).map(|(y, d)| y + sign * step * d).collect();
        let mut rates = vec![0.0; state.len()];
        stand.form.rates(TIME, &moved, &mut rates).unwrap();
        rates
    };
    let (after, before) = (rates(1.0), rates(-1.0));
    after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * step)).collect()
}

/// A random direction that keeps the lengths of the Euler parameters.
fn tangent(stand: &Stand, state: &[f64], random: &mut Random) -> Vec<f64> {
    let mut direction: Vec<f64> = state.iter().map(|_| random.next()).collect();
    for body in 0..stand.layout.bodies {
        let at = 13 * body + 3;
        let along: f64 = (at..at + 4).map(|k| state[k] * direction[k]).sum();
        (at..at + 4).for_each(|k| direction[k] -= along * state[k]);
    }
    direction
}

#[test]
fn derivatives_of_the_rates_are_what_differences_say() {
    let mut random = Random(211);
    for text in [scenes::tangle(), scenes::four_bar(1.1), driven(), scenes::coupled_tangle()] {
        let mut stand = stand(&text);
        stand.form.offer_jacobian(&stand.equations);
        let n = stand.state.len();
        for _ in 0..5 {
            let state = stand.consistent(&mut random, 0.05);
            let mut matrix = vec![0.0; n * n];
            assert!(stand.form.jacobian(TIME, &state, &mut |i, j, value| matrix[i + n * j] += value).unwrap());
            for _ in 0..5 {
                let direction = tangent(&stand, &state, &mut random);
                let exact: Vec<f64> = (0..n).map(|i| (0..n).map(|j| matrix[i + n * j] * direction[j]).sum()).collect();
                let found = difference_along(&mut stand, &state, &direction);
                assert!(difference(&exact, &found) < 1e-7, "{:e}", difference(&exact, &found));
            }
        }
    }
}

#[test]
fn nothing_is_offered_where_derivatives_are_unknown() {
    let mut opaque = stand(&scenes::opaque_tangle());
    opaque.form.offer_jacobian(&opaque.equations);
    let state = opaque.state.clone();
    assert!(!opaque.form.jacobian(TIME, &state, &mut |_, _, _| ()).unwrap());
    // And where nobody asked before.
    let mut other = stand(&scenes::tangle());
    let state = other.state.clone();
    assert!(!other.form.jacobian(TIME, &state, &mut |_, _, _| ()).unwrap());
}
