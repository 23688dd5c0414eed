//! What is summed up along the steps.

use super::*;
use crate::integrate::{Kinematic, Radau5, Radau9, Rk4};

/// A pendulum, and the integral of a power of its motion.
fn rates(t: f64, y: &[f64], dy: &mut [f64]) {
    (dy[0], dy[1], dy[2]) = (y[1], -y[0].sin(), power(t, y));
}

fn power(t: f64, y: &[f64]) -> f64 {
    y[1].powi(2) * (1.5 + t.cos())
}

fn go(method: &mut dyn Integrator, tolerance: f64, options: &Options) -> (f64, [f64; 2]) {
    let mut system = Probe { summed: Some(power), ..Probe::new(rates, 3, tolerance) };
    let mut y = [2.0, 0.0, 0.0];
    let span = Span { t_start: 0.0, t_end: 7.0, sample_times: &[0.0, 3.3, 7.0] };
    let outcome = method.integrate(&mut system, &mut y, &span, options).expect("nothing is wrong");
    assert!(matches!(outcome.status, Status::Completed));
    (y[2], system.sums)
}

#[test]
fn sums_are_what_the_method_makes_of_the_same_rate_in_the_state() {
    for tolerance in [1e-4, 1e-8] {
        let options = Options::default();
        let methods: [(&mut dyn Integrator, f64); 4] = [
            (&mut dop853(), 1e-13),
            (&mut dopri5(), 1e-13),
            // Rates within the iterations are those of the iteration before.
            (&mut Radau5::default(), tolerance),
            (&mut Radau9::default(), tolerance),
        ];
        for (method, off) in methods {
            let (state, [sum, difference]) = go(method, tolerance, &options);
            assert!((sum - state).abs() < off * sum, "{} {tolerance}: {sum} or {state}", method.name());
            assert!(difference > 0.0 && difference < 0.05 * sum, "{} {tolerance}: {difference}", method.name());
        }
    }
}

#[test]
fn where_a_method_gives_no_nodes_its_interpolation_does() {
    let (exact, _) = go(&mut dop853(), 1e-13, &Options::default());
    let of = |h| go(&mut Rk4::default(), 1.0, &Options { fixed_step: Some(h), ..Options::default() }).1;
    let [coarse, fine] = [0.1, 0.05].map(|h| (of(h)[0] - exact).abs());
    assert!((3.5..4.6).contains(&order(coarse, fine)), "{coarse:e} {fine:e}");
    assert!(coarse < of(0.1)[1]);
}

#[test]
fn sums_along_motions_that_are_known_are_of_the_rule_of_the_steps() {
    let mut system =
        Probe { summed: Some(|t, _| (3.0 * t).sin().powi(2)), ..Probe::new(|_, _, dy| dy[0] = 1.0, 1, 1e-8) };
    let span = Span { t_start: 0.0, t_end: 2.0, sample_times: &[] };
    let options = Options { max_step: Some(0.25), ..Options::default() };
    Kinematic::default().integrate(&mut system, &mut [0.0], &span, &options).expect("nothing is wrong");
    let [sum, difference] = system.sums;
    assert!((sum - (1.0 - 12.0_f64.sin() / 12.0)).abs() < 1e-10 && difference < 1e-2, "{:?}", system.sums);
}
