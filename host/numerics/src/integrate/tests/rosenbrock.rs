//! The Rosenbrock method: its coefficients against the order conditions, orders, and work on stiff problems.

use super::stiff::{prothero, prothero_solution, van_der_pol_run};
use super::*;
use crate::integrate::rodas5p::{A, B, C, COUPLING, D, GAMMA, H, STAGES};

type Matrix = [[f64; STAGES]; STAGES];
type Vector = [f64; STAGES];

/// Coefficients of the method as the theory writes it.
struct Theory {
    alpha: Matrix,
    /// `alpha + Gamma`
    beta: Matrix,
    gamma: Matrix,
}

/// From the form that is computed to that of the theory (Hairer & Wanner II, eq. IV.7.24 and 7.25): with
/// `U = Gamma K`, `COUPLING = I/gamma - Gamma^-1` and `A = alpha Gamma^-1`.
fn theory() -> Theory {
    let lower = |rows: &[&[f64]; STAGES]| -> Matrix {
        std::array::from_fn(|i| std::array::from_fn(|j| rows[i].get(j).copied().unwrap_or(0.0)))
    };
    let coupling = lower(&COUPLING);
    // Gamma^-1 is lower triangular: solved row by row.
    let inverse: Matrix =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j)) / GAMMA - coupling[i][j]));
    let mut gamma = [[0.0; STAGES]; STAGES];
    for i in 0..STAGES {
        gamma[i] = std::array::from_fn(|j| {
            let known: f64 = (0..i).map(|k| inverse[i][k] * gamma[k][j]).sum();
            (f64::from(u8::from(i == j)) - known) / inverse[i][i]
        });
    }
    let alpha = product(&lower(&A), &gamma);
    let beta = std::array::from_fn(|i| std::array::from_fn(|j| alpha[i][j] + gamma[i][j]));
    Theory { alpha, beta, gamma }
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..STAGES).map(|k| a[i][k] * b[k][j]).sum()))
}

fn apply(a: &Matrix, x: &Vector) -> Vector {
    std::array::from_fn(|i| (0..STAGES).map(|k| a[i][k] * x[k]).sum())
}

fn times(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|i| a[i] * b[i])
}

/// The elementary weights of the trees up to order 5 with what they must be (section IV.7, table 7.1): a node with several
/// branches is reached through alpha, one with a single branch through beta. `order` of each, the vector that the weights
/// are applied to, and its sum.
fn conditions(theory: &Theory) -> Vec<(u32, Vector, f64)> {
    let one = [1.0; STAGES];
    let a1 = apply(&theory.alpha, &one);
    let b1 = apply(&theory.beta, &one);
    let a = |x: &Vector| apply(&theory.alpha, x);
    let b = |x: &Vector| apply(&theory.beta, x);
    let (a2, a3, a4) = (times(&a1, &a1), times(&a1, &times(&a1, &a1)), times(&times(&a1, &a1), &times(&a1, &a1)));
    let (bb, ab) = (b(&b1), a(&b1));
    vec![
        (1, one, 1.0),
        (2, b1, 1.0 / 2.0),
        (3, a2, 1.0 / 3.0),
        (3, bb, 1.0 / 6.0),
        (4, a3, 1.0 / 4.0),
        (4, times(&a1, &ab), 1.0 / 8.0),
        (4, b(&a2), 1.0 / 12.0),
        (4, b(&bb), 1.0 / 24.0),
        (5, a4, 1.0 / 5.0),
        (5, times(&a2, &ab), 1.0 / 10.0),
        (5, times(&ab, &ab), 1.0 / 20.0),
        (5, times(&a1, &a(&a2)), 1.0 / 15.0),
        (5, times(&a1, &a(&bb)), 1.0 / 30.0),
        (5, b(&a3), 1.0 / 20.0),
        (5, b(&times(&a1, &ab)), 1.0 / 40.0),
        (5, b(&b(&a2)), 1.0 / 60.0),
        (5, b(&b(&bb)), 1.0 / 120.0),
    ]
}

/// The weights of `sum_i w_i u_i` in terms of the `k_i`: `w Gamma`.
fn weights(theory: &Theory, w: &Vector) -> Vector {
    std::array::from_fn(|j| (0..STAGES).map(|i| w[i] * theory.gamma[i][j]).sum())
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[test]
fn coefficients_fulfil_the_order_conditions() {
    let theory = theory();
    for i in 0..STAGES {
        let (row, shift): (f64, f64) = (theory.alpha[i].iter().sum(), theory.gamma[i].iter().sum());
        assert!((row - C[i]).abs() < 1e-13, "abscissa {i}: {row}");
        assert!((shift - D[i]).abs() < 1e-13, "factor of time {i}: {shift}");
        assert!((theory.gamma[i][i] - GAMMA).abs() < 1e-15);
    }
    let mut embedded = B;
    embedded[STAGES - 1] = 0.0;
    let (step, embedded) = (weights(&theory, &B), weights(&theory, &embedded));
    let mut beyond = 0.0_f64;
    for (order, vector, sum) in conditions(&theory) {
        let off = (dot(&step, &vector) - sum).abs();
        assert!(off < 2e-13, "order {order}: {off:e}");
        let off = (dot(&embedded, &vector) - sum).abs();
        if order < 5 {
            assert!(off < 2e-13, "embedded, order {order}: {off:e}");
        } else {
            beyond = beyond.max(off);
        }
    }
    assert!(beyond > 1e-4, "the estimate is of order 4, not 5: {beyond:e}");
    // Stiffly accurate: the weights are the last row of beta, so that stiff parts vanish at infinity.
    for (j, (last, weight)) in theory.beta[STAGES - 1].iter().zip(&step).enumerate() {
        assert!((last - weight).abs() < 1e-13, "{j}");
    }
}

#[test]
fn interpolation_fulfils_the_conditions_of_order_four_inside_the_step() {
    let theory = theory();
    for s in [0.1_f64, 0.35, 0.5, 0.8, 1.0] {
        let w = std::array::from_fn(|i| s * (B[i] + (1.0 - s) * (H[0][i] + s * (H[1][i] + s * H[2][i]))));
        let weights = weights(&theory, &w);
        for (order, vector, sum) in conditions(&theory).into_iter().filter(|(order, ..)| *order < 5) {
            let off = (dot(&weights, &vector) - sum * s.powi(order as i32)).abs();
            assert!(off < 2e-13, "order {order} at {s}: {off:e}");
        }
    }
}

#[test]
fn rodas5p_has_order_five_and_interpolates_with_order_four() {
    let mut method = Rodas5p::default();
    // Differences of the right side limit the accuracy of the derivatives: steps are not too short.
    let (coarse, fine) = (errors(&mut method, 4.0, 0.2), errors(&mut method, 4.0, 0.1));
    let end = order(coarse.0, fine.0);
    assert!((4.6..5.8).contains(&end), "{end}");
    let (coarse, fine) = (errors(&mut method, 0.4, 0.4), errors(&mut method, 0.2, 0.2));
    let inside = order(coarse.1, fine.1);
    assert!((4.5..5.6).contains(&inside), "{inside}");
}

#[test]
fn rodas5p_solves_stiff_problems_to_loose_tolerances_with_pinned_work() {
    let counted = |tolerance: f64| {
        let (error, c) = van_der_pol_run("rodas5p", tolerance, true);
        assert!(error < 3.0 * tolerance, "{tolerance:e} {error:e}");
        assert_eq!((c.newton_iterations, c.factorisations), (0, c.steps + c.rejected));
        [c.steps, c.rejected, c.evaluations, c.jacobians]
    };
    assert_eq!(
        [counted(1e-3), counted(1e-4), counted(1e-6)],
        [[138, 26, 1425, 138], [217, 23, 2115, 217], [623, 14, 5706, 623]]
    );
}

#[test]
fn stiffness_costs_no_order_where_the_solution_is_smooth() {
    // Prothero & Robinson's problem: methods that only have their classical order lose most of it here.
    let error = |h: f64| {
        let mut probe = Probe::new(prothero, 3, 1.0);
        let mut y = prothero_solution(0.0).to_vec();
        run(&mut Rodas5p::default(), &mut probe, &mut y, 2.0, &[], &fixed(h));
        (y[0] - prothero_solution(2.0)[0]).abs()
    };
    assert!(error(0.1) < 1e-7, "{:e}", error(0.1));
}
