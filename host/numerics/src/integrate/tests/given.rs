//! Steps that are given: those of another run.

use super::fixtures::Probe;
use super::*;

/// A pendulum.
fn pendulum(_: f64, y: &[f64], dy: &mut [f64]) {
    (dy[0], dy[1]) = (y[1], -9.81 * y[0].sin());
}

fn methods() -> [Box<dyn Integrator>; 3] {
    [Box::new(dop853()), Box::new(dopri5()), Box::new(Radau5::default())]
}

/// The end of a run from a start, by these steps or its own, and its steps.
fn end(method: &mut dyn Integrator, start: f64, steps: Option<&[f64]>) -> (f64, Vec<f64>, Outcome) {
    let mut probe = Probe::new(pendulum, 2, 1e-6);
    let options = Options { steps: steps.map(Into::into), ..Options::default() };
    let mut y = vec![start, 0.0];
    let outcome = run(method, &mut probe, &mut y, 3.0, &[0.7, 1.1, 3.0], &options);
    assert!(matches!(outcome.status, Status::Completed));
    (y[0], probe.steps.iter().map(|(t, ..)| *t).collect(), outcome)
}

#[test]
fn a_run_by_its_own_steps_is_itself() {
    for mut method in methods() {
        let (own, steps, first) = end(&mut *method, 1.0, None);
        let (again, same, outcome) = end(&mut *method, 1.0, Some(&steps));
        assert_eq!(steps, same, "{}", method.name());
        assert_eq!(outcome.counters.rejected, 0);
        assert_eq!(outcome.counters.steps, first.counters.steps);
        // Iterations of the implicit method continue to round-off here.
        let close = if method.name() == "radau5" { 1e-6 } else { 0.0 };
        assert!((own - again).abs() <= close, "{} {own} {again}", method.name());
    }
}

/// By its own steps a run jumps where a step more is taken; by given ones its end is a smooth function of its start: differences of
/// orders 2 and 4 tell the same derivative to nine digits, at a tolerance of 1e-6.
#[test]
fn by_given_steps_the_end_is_a_smooth_function_of_the_start() {
    for mut method in methods() {
        let (_, steps, _) = end(&mut *method, 1.0, None);
        let mut at = |start: f64| end(&mut *method, start, Some(&steps)).0;
        let h = 1e-3;
        let rise = |k: f64, at: &mut dyn FnMut(f64) -> f64| (at(1.0 + k * h) - at(1.0 - k * h)) / (2.0 * k * h);
        let [one, two, three] = [1.0, 2.0, 3.0].map(|k| rise(k, &mut at));
        let (four, six) = ((4.0 * one - two) / 3.0, (15.0 * one - 6.0 * two + three) / 10.0);
        assert!((four / six - 1.0).abs() < 1e-9, "{} {four} {six}", method.name());
    }
}

#[test]
fn ends_that_are_not_ahead_are_passed_over_and_the_last_step_ends_with_the_interval() {
    let (_, steps, _) = end(&mut dop853(), 1.0, Some(&[-1.0, 0.0, 0.5, 0.5, 2.0, 4.0]));
    assert_eq!(steps, [0.5, 2.0, 3.0]);
}
