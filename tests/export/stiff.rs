//! Steps of a Rosenbrock method: its order conditions, and stiff scenes at steps at which explicit methods fail.

use odyn::export::{Method, Twin};

use super::{errors_fall, machine};
use crate::support::open;

/// The coefficients meet the conditions of order 4 for systems that do not depend on time and those of stiff accuracy (Hairer & Wanner
/// 1996, table IV.7.1): in the form with Jacobians, b = m Gamma, alpha = a Gamma, Gamma = (1/gamma I - C)^-1.
#[test]
fn the_coefficients_meet_the_conditions_of_order_four() {
    let method = Method::named("rodas").unwrap();
    let implicit = method.implicit.unwrap();
    let s = method.b.len();
    let full = |rows: &[&[f64]], i: usize, j: usize| rows[i].get(j).copied().unwrap_or(0.0);
    // Gamma, lower triangular, row by row.
    let mut gamma: Vec<Vec<f64>> = Vec::new();
    for i in 0..s {
        let entry = |j: usize| {
            let unit = if i == j { 1.0 } else { 0.0 };
            let sum: f64 = gamma.iter().enumerate().map(|(k, row)| full(implicit.coupling, i, k) * row[j]).sum();
            (unit + sum) * implicit.gamma
        };
        gamma.push((0..s).map(entry).collect());
    }
    let times_gamma = |row: &dyn Fn(usize) -> f64, j: usize| -> f64 { (0..s).map(|k| row(k) * gamma[k][j]).sum() };
    let b: Vec<f64> = (0..s).map(|j| times_gamma(&|k| method.b[k], j)).collect();
    let alpha: Vec<Vec<f64>> =
        (0..s).map(|i| (0..s).map(|j| times_gamma(&|k| full(method.a, i, k), j)).collect()).collect();
    let beta = |i: usize, j: usize| alpha[i][j] + gamma[i][j];
    let sum = |term: &dyn Fn(usize) -> f64| (0..s).map(term).sum::<f64>();
    let a_of = |i: usize| sum(&|j| alpha[i][j]);
    let b_of = |i: usize| sum(&|j| beta(i, j));
    let conditions = [
        ("b", sum(&|i| b[i]), 1.0),
        ("b beta", sum(&|i| b[i] * b_of(i)), 1.0 / 2.0),
        ("b alpha^2", sum(&|i| b[i] * a_of(i).powi(2)), 1.0 / 3.0),
        ("b beta beta", sum(&|i| b[i] * sum(&|j| beta(i, j) * b_of(j))), 1.0 / 6.0),
        ("b alpha^3", sum(&|i| b[i] * a_of(i).powi(3)), 1.0 / 4.0),
        ("b alpha alpha beta", sum(&|i| b[i] * a_of(i) * sum(&|j| alpha[i][j] * b_of(j))), 1.0 / 8.0),
        ("b beta alpha^2", sum(&|i| b[i] * sum(&|j| beta(i, j) * a_of(j).powi(2))), 1.0 / 12.0),
        ("b beta^3", sum(&|i| b[i] * sum(&|j| beta(i, j) * sum(&|k| beta(j, k) * b_of(k)))), 1.0 / 24.0),
    ];
    for (name, found, expected) in conditions {
        assert!((found - expected).abs() < 1e-13, "{name}: {found} instead of {expected}");
    }
    for i in 0..s {
        assert!((a_of(i) - method.c[i]).abs() < 1e-13, "place of stage {i}: {}", a_of(i));
        assert!((sum(&|j| gamma[i][j]) - implicit.times[i]).abs() < 1e-13, "weight of time in stage {i}");
        assert!((beta(s - 1, i) - b[i]).abs() < 1e-13, "stiff accuracy");
    }
}

/// Where explicit methods need steps as short as the fastest decay, this one does not, and its errors fall with its order.
#[test]
fn a_stiff_scene_is_stepped_as_its_motion_needs() {
    let make = || open("benchmarks/A05.toml", &["simulation.tolerance=1e-11", "simulation.audit_tolerance=none"]);
    let explicit = machine(make(), None, "dopri5");
    let steps = 2000;
    let mut twin = Twin::new(explicit.clone());
    let h = (explicit.t_end - explicit.t_start) / steps as f64;
    let failed = (0..steps).find_map(|_| twin.step(h).err());
    println!("dopri5 in {steps} steps: {failed:?}");
    assert!(failed.is_some(), "the scene is not stiff");
    errors_fall(&machine(make(), None, "rodas"), make(), steps, 2.5);
}

/// Steps that are too long for a scene may end with finite numbers, all of them wrong: steps of half the size show it.
#[test]
fn steps_that_are_too_long_are_found_by_trial() {
    let tried =
        |scene: &str, step: Option<f64>, method: &str, most: usize| machine(open(scene, &[]), step, method).tried(most);
    // Fast vibrations grow slowly there.
    let trial = tried("verification/beam-chain.toml", Some(8.75e-4), "dopri5", 5000);
    println!("{trial:?}");
    assert!(!trial.is_good(), "{trial:?}");
    for (scene, step, method, most) in [
        ("verification/beam-chain.toml", Some(8.75e-4), "rodas", 300),
        ("verification/beam-chain.toml", Some(1e-5), "dopri5", 5000),
        ("compressor.toml", None, "rk4", 5000),
        ("benchmarks/A04.toml", None, "dopri5", 5000),
    ] {
        let trial = tried(scene, step, method, most);
        println!("{scene} {method}: {trial:?}");
        assert!(trial.is_good() && trial.steps >= 300, "{scene} {method}: {trial:?}");
    }
}
