//! Newton's method for what depends on what is solved for.

use super::*;

/// The second of two multipliers, of which these count.
fn of_one(z: f64, multipliers: Range<usize>) -> Coupling {
    let mut coupling = Coupling {
        slots: vec![1],
        peers: std::iter::once(1..2).collect(),
        solved: [2..3, multipliers],
        z: vec![0.0],
        step: vec![0.0],
        closing: Closing::new(1),
        started: false,
        linear: true,
        iteration: 0,
        best: f64::INFINITY,
        least: [f64::INFINITY; 2],
        found: vec![f64::NAN],
        unbalanced: 0.0,
    };
    coupling.start_from(&Some(vec![z]));
    coupling
}

/// Iterations until z agrees with F(z), whose derivative `slope` gives for the inputs and the size of the steps along z.
fn iterations(coupling: &mut Coupling, solution: impl Fn(f64) -> f64, slope: impl Fn(f64, f64) -> f64) -> usize {
    let mut inputs = [1.0, 0.0, 1.0];
    coupling.begin(&mut inputs);
    loop {
        let z = inputs[1];
        inputs[1] = solution(z);
        let step = coupling.steps(&inputs, 1e-7)[0];
        let slopes = |_: &mut [f64], matrix: &mut [f64]| {
            matrix[0] = slope(z, step);
            Ok(())
        };
        let agrees = coupling.advance(&mut inputs, &mut Counters::default(), slopes);
        if agrees.expect("a solution") {
            return coupling.iteration;
        }
    }
}

/// Where F is nothing to round-off, z is not compared with it without end.
#[test]
fn a_solution_that_is_nothing_is_found() {
    let mut coupling = of_one(1e-3, 1..2);
    // F(z) = 0.06 z, as the difference of what is larger.
    let count = iterations(&mut coupling, |z| (1.0 + 0.06 * z) - 1.0, |_, _| 0.06);
    assert!(coupling.z[0].abs() < 1e-15 && count < 10, "{:e}, {count}", coupling.z[0]);
}

/// What is added to something larger does not follow steps of a solution that is nothing, and the rest by itself follows them too far.
#[test]
fn a_solution_that_is_nothing_is_found_where_only_a_part_follows_it() {
    let mut coupling = of_one(1.001e-17, 1..2);
    let solution = |z: f64| (1.0 + 0.74 * z) - 1.0 + (1.58e-17 - 0.58 * z);
    let count = iterations(&mut coupling, solution, |_, _| 0.74 - 0.58);
    assert!((coupling.z[0] - 1e-17).abs() < 1e-19 && count < 10, "{:e}, {count}", coupling.z[0]);
}

/// The same beside larger multipliers, where each step leaves a fortieth of a solution that is nothing.
#[test]
fn a_solution_that_is_nothing_is_found_beside_others() {
    let mut coupling = of_one(1e-15, 0..2);
    let solution = |z: f64| (1.0 - 0.0268 * z) - 1.0 - 0.0639 * z;
    let count = iterations(&mut coupling, solution, |_, _| -0.0268 - 0.0639);
    assert!(coupling.z[0].abs() < 1e-15 && count < 10, "{:e}, {count}", coupling.z[0]);
}

/// What is but a small part of the solution is not differentiated along steps of its own size.
#[test]
fn difference_quotients_are_not_round_off_where_a_solution_is_small() {
    let solution = |z: f64| (1.0 + 1e-9 - 3.0 * z) - 1.0;
    let mut coupling = of_one(1e-9, 0..2);
    let count = iterations(&mut coupling, solution, |z, step| (solution(z + step) - solution(z)) / step);
    assert!((coupling.z[0] - 2.5e-10).abs() < 1e-15 && count < 6, "{:e}, {count}", coupling.z[0]);
}

/// Where the rest of a solution is far off with the first guess, that guess is no small part of the whole.
#[test]
fn a_first_guess_is_not_taken_for_a_solution() {
    let exact = 35.0 / 3.0;
    let mut coupling = of_one(0.0, 0..2);
    coupling.forget();
    let mut inputs = [0.0; 3];
    coupling.begin(&mut inputs);
    for _ in 0..MOST_ITERATIONS {
        inputs = [3e11 * (inputs[1] - exact), 17.5 - 0.5 * inputs[1], 1.0];
        let slopes = |_: &mut [f64], matrix: &mut [f64]| {
            matrix[0] = -0.5;
            Ok(())
        };
        if coupling.advance(&mut inputs, &mut Counters::default(), slopes).expect("a solution") {
            break;
        }
    }
    assert!((inputs[1] - exact).abs() < 1e-12, "{inputs:?}");
}

/// An acceleration and a multiplier that depend on each other are found whatever their units are.
#[test]
fn units_do_not_matter() {
    for unit in [1.0, 1e12, 1e-12] {
        // a = 1 + 3 x / u, x = u (2 + a / 2): x = -5 u.
        let mut coupling = of_one(0.0, 2..3);
        (coupling.slots, coupling.peers, coupling.solved[0]) = (vec![1, 2], vec![1..2, 2..3], 0..2);
        (coupling.z, coupling.step, coupling.found) = (vec![0.0; 2], vec![0.0; 2], vec![f64::NAN; 2]);
        coupling.closing = Closing::new(2);
        coupling.forget();
        let mut inputs = [0.0; 3];
        coupling.begin(&mut inputs);
        loop {
            let [_, a, x] = inputs;
            inputs = [1.0, 1.0 + 3.0 * x / unit, unit * (2.0 + a / 2.0)];
            let slopes = |_: &mut [f64], matrix: &mut [f64]| {
                matrix.copy_from_slice(&[0.0, unit / 2.0, 3.0 / unit, 0.0]);
                Ok(())
            };
            if coupling.advance(&mut inputs, &mut Counters::default(), slopes).expect("a solution") {
                break;
            }
        }
        assert!((inputs[2] / unit + 5.0).abs() < 1e-11, "{unit:e}: {inputs:?}");
    }
}
