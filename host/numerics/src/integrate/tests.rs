//! Orders, identities and work of the methods, and the protocol of a run.

#![allow(clippy::unwrap_used)]

mod begun;
mod events;
mod factors;
mod fixtures;
mod given;
mod kinematic;
mod lanes;
mod onset;
mod stiff;
mod stops;
mod summed;
mod turns;

use super::*;
use fixtures::*;

fn run(
    method: &mut dyn Integrator,
    probe: &mut Probe,
    y: &mut [f64],
    t_end: f64,
    samples: &[f64],
    options: &Options,
) -> Outcome {
    let span = Span { t_start: 0.0, t_end, sample_times: samples };
    method.integrate(probe, y, &span, options).unwrap()
}

fn fixed(h: f64) -> Options {
    Options { fixed_step: Some(h), ..Options::default() }
}

/// Errors at the end, and the largest at samples, with fixed steps over `0..t_end`.
fn errors(method: &mut dyn Integrator, t_end: f64, h: f64) -> (f64, f64) {
    let times: Vec<f64> = (1..40).map(|k| t_end * k as f64 / 40.0).collect();
    let mut probe = Probe::new(smooth, 3, 1.0);
    let mut y = smooth_solution(0.0).to_vec();
    let outcome = run(method, &mut probe, &mut y, t_end, &times, &fixed(h));
    assert!(matches!(outcome.status, Status::Completed));
    assert_eq!(outcome.counters.samples, times.len());
    let at_samples = probe.samples.iter().map(|(t, y)| distance(y, &smooth_solution(*t)));
    (distance(&y, &smooth_solution(t_end)), at_samples.fold(0.0, f64::max))
}

fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

#[test]
fn tableau_fulfils_its_order_conditions() {
    use super::dop853_tableau::{A, A_DENSE, B, C, E3, E5, Row};
    let moment = |row: Row, power: i32| -> f64 { row.iter().map(|&(j, a)| a * C[j].powi(power)).sum() };
    for (i, row) in A.iter().enumerate().chain(A_DENSE.iter().enumerate().map(|(i, row)| (i + 13, row))) {
        assert!((moment(row, 0) - C[i]).abs() < 1e-13, "row sum of stage {i}");
        assert!(row.iter().all(|&(j, _)| j < i), "stage {i} is explicit");
        // All stages that carry weight have order 3 at least.
        if i > 4 {
            assert!((moment(row, 1) - C[i].powi(2) / 2.0).abs() < 1e-13, "stage {i}");
            assert!((moment(row, 2) - C[i].powi(3) / 3.0).abs() < 1e-13, "stage {i}");
        }
    }
    for power in 0..8 {
        let expected = 1.0 / f64::from(power + 1);
        assert!((moment(B, power) - expected).abs() < 1e-13, "power {power}");
        // Lower-order weights agree with B up to their own order, and not beyond.
        assert_eq!(moment(E5, power).abs() < 1e-13, power < 5, "power {power}");
        assert_eq!(moment(E3, power).abs() < 1e-13, power < 3, "power {power}");
    }
}

#[test]
fn dop853_has_order_eight() {
    let mut method = dop853();
    for h in [0.5, 0.25] {
        let (coarse, fine) = (errors(&mut method, 4.0, h).0, errors(&mut method, 4.0, h / 2.0).0);
        let p = order(coarse, fine);
        assert!((7.5..9.5).contains(&p), "order {p} at {h}");
    }
}

#[test]
fn dop853_interpolates_with_order_seven() {
    // One step from exact values: the error inside goes with the eighth power, one more than
    // the order, the error at the end with the ninth.
    let mut method = dop853();
    for h in [0.5, 0.25] {
        let (coarse, fine) = (errors(&mut method, h, h), errors(&mut method, h / 2.0, h / 2.0));
        let (end, inside) = (order(coarse.0, fine.0), order(coarse.1, fine.1));
        assert!((7.5..8.8).contains(&inside), "order {inside} inside {h}");
        assert!(end > 8.4, "order {end} at the end of {h}");
    }
}

#[test]
fn rk4_has_order_four_at_ends_and_samples() {
    let mut method = Rk4::default();
    let (coarse, fine) = (errors(&mut method, 4.0, 0.05), errors(&mut method, 4.0, 0.025));
    let (end, inside) = (order(coarse.0, fine.0), order(coarse.1, fine.1));
    assert!((3.8..4.3).contains(&end), "{end}");
    assert!((3.8..4.3).contains(&inside), "{inside}");
}

fn arenstorf_run(tolerance: f64, samples: &[f64]) -> (f64, Counters, Probe) {
    let mut probe = Probe::new(arenstorf, 4, tolerance);
    let mut y = ARENSTORF_START.to_vec();
    let mut method = dop853();
    let outcome = run(&mut method, &mut probe, &mut y, ARENSTORF_PERIOD, samples, &Options::default());
    assert!(matches!(outcome.status, Status::Completed));
    (distance(&y, &ARENSTORF_START), outcome.counters, probe)
}

#[test]
fn error_is_proportional_to_the_tolerance() {
    // The orbit is unstable: errors are thousands of tolerances, but in proportion.
    let errors: Vec<f64> = (7..=12).map(|digits| arenstorf_run(10f64.powi(-digits), &[]).0).collect();
    for pair in errors.windows(2) {
        let gain = (pair[0] / pair[1]).log10();
        assert!((0.5..2.5).contains(&gain), "{errors:?}");
    }
    let mean_gain = (errors[0] / errors[5]).log10() / 5.0;
    assert!((0.8..1.3).contains(&mean_gain), "{errors:?}");
}

#[test]
fn work_on_the_arenstorf_orbit_is_pinned() {
    // Independent implementation (DOP853 of scipy, with other limits of step control) at the same tolerances:
    // 84 steps, 1406 evaluations, error 6.71e-4; 176 steps, 2870 evaluations, 1.28e-6.
    let (error, counters, probe) = arenstorf_run(1e-7, &[]);
    assert_eq!((counters.steps, counters.rejected, counters.evaluations), (99, 19, 1399));
    assert!(error < 6.71e-4, "{error:e}");
    assert_eq!(counters.projections, counters.steps);
    assert_eq!(counters.recoveries, Recoveries::default());
    let sizes = probe.steps.iter().map(|(_, h, _)| *h);
    assert_eq!(counters.h_min, sizes.clone().fold(f64::INFINITY, f64::min));
    assert_eq!(counters.h_max, sizes.fold(0.0, f64::max));

    let (error, counters, _) = arenstorf_run(1e-10, &[]);
    assert_eq!((counters.steps, counters.rejected, counters.evaluations), (209, 5, 2565));
    assert!(error < 1.5e-6, "{error:e}");
}

#[test]
fn evaluations_are_eleven_a_try_one_a_step_three_an_interpolation() {
    let (_, plain, _) = arenstorf_run(1e-8, &[]);
    // One at the start and one for the choice of the first step.
    assert_eq!(plain.evaluations, 2 + 11 * (plain.steps + plain.rejected) + plain.steps);

    // Many samples in one step cost as much as one; samples at both ends cost nothing.
    let times = [0.0, 0.0001, 0.0001, 0.0002, ARENSTORF_PERIOD];
    let (_, sampled, probe) = arenstorf_run(1e-8, &times);
    assert_eq!(probe.sample_times(), times);
    assert_eq!(sampled.evaluations, plain.evaluations + 3);
    assert_eq!(sampled.steps, plain.steps, "samples do not change the steps");
    assert_eq!(probe.samples[1], probe.samples[2]);
}

#[test]
fn samples_at_the_ends_of_steps_are_the_steps_own_states() {
    for name in ["auto", "rk4"] {
        let mut method = by_name(name).unwrap();
        let times = [0.0, 0.25, 0.3, 0.5, 1.0];
        let mut probe = Probe::new(smooth, 3, 1e-9);
        let mut y = smooth_solution(0.0).to_vec();
        run(method.as_mut(), &mut probe, &mut y, 1.0, &times, &fixed(0.25));
        assert_eq!(probe.sample_times(), times, "{name}");
        assert_eq!(probe.samples[0].1, smooth_solution(0.0));
        for (sample, step) in [(1, 0), (3, 1), (4, 3)] {
            assert_eq!(probe.samples[sample].1, probe.steps[step].2, "{name}");
        }
        assert_eq!(probe.samples[4].1, y);
        assert_eq!(probe.steps.last().unwrap().0, 1.0, "the end is reached exactly");
    }
}

#[test]
fn interpolation_costs_at_most_a_digit_and_a_half() {
    // Known of this pair: nothing controls the error between the ends of long steps.
    let times: Vec<f64> = (0..=200).map(|k| f64::from(k) * 0.05).collect();
    for tolerance in [1e-8, 1e-10, 1e-12] {
        let mut probe = Probe::new(smooth, 3, tolerance);
        let mut y = smooth_solution(0.0).to_vec();
        run(&mut dop853(), &mut probe, &mut y, 10.0, &times, &Options::default());
        assert_eq!(probe.sample_times(), times);
        let error = |t: f64, y: &[f64]| distance(y, &smooth_solution(t));
        let inside = probe.samples.iter().map(|(t, y)| error(*t, y)).fold(0.0, f64::max);
        let at_ends = probe.steps.iter().map(|(t, _, y)| error(*t, y)).fold(0.0, f64::max);
        assert!(at_ends < 10.0 * tolerance, "{at_ends:e}");
        assert!(inside < 50.0 * tolerance, "{inside:e} {at_ends:e}");
    }
}

#[test]
fn no_tiny_step_is_left_at_the_end() {
    for t_end in [1.0, 1.7, 2.3, 3.01, 4.6] {
        let mut probe = Probe::new(oscillator, 2, 1e-6);
        let options = Options { max_step: Some(0.5), first_step: Some(0.5), ..Options::default() };
        run(&mut dop853(), &mut probe, &mut [1.0, 0.0], t_end, &[], &options);
        let sizes: Vec<f64> = probe.steps.iter().map(|(_, h, _)| *h).collect();
        let [.., second_last, last] = sizes[..] else { panic!("{sizes:?}") };
        assert!((second_last - last).abs() < 1e-12 || last > 0.5 - 1e-12, "{sizes:?}");
        assert!(sizes.iter().all(|&h| h < 0.506), "{sizes:?}");
    }
}

#[test]
fn step_sizes_obey_options_and_hints() {
    let largest = |options: &Options, hint: f64| {
        let mut probe = Probe::new(oscillator, 2, 1e-3);
        probe.hint = hint;
        let outcome = run(&mut dop853(), &mut probe, &mut [1.0, 0.0], 20.0, &[], options);
        (outcome.counters.h_max, probe.steps[0].1)
    };
    let free = largest(&Options::default(), f64::INFINITY);
    assert!(free.0 > 1.0, "{free:?}");
    let limited = Options { max_step: Some(0.2), ..Options::default() };
    assert!(largest(&limited, f64::INFINITY).0 <= 0.2 * 1.01);
    assert!(largest(&Options::default(), 0.1).0 <= 0.1 * 1.01);
    let first = Options { first_step: Some(0.125), ..Options::default() };
    assert_eq!(largest(&first, f64::INFINITY).1, 0.125);
}

#[test]
fn the_system_can_stop_the_run() {
    for (name, options) in [("dop853", Options::default()), ("rk4", fixed(0.05))] {
        let mut probe = Probe::new(oscillator, 2, 1e-9);
        probe.stop_at = 2.0;
        let times: Vec<f64> = (0..50).map(|k| f64::from(k) * 0.1).collect();
        let mut y = [1.0, 0.0];
        let mut method = by_name(name).unwrap();
        let outcome = run(method.as_mut(), &mut probe, &mut y, 10.0, &times, &options);
        let Status::StoppedEarly { t, reason: StopReason::Requested } = outcome.status else {
            panic!("{name}: {:?}", outcome.status)
        };
        assert!((2.0..4.0).contains(&t));
        assert_eq!(probe.sample_times(), times[..probe.samples.len()]);
        assert!(times[probe.samples.len()] > t && probe.samples.last().unwrap().0 <= t);
        assert!(distance(&y, &[t.cos(), -t.sin()]) < 1e-5, "y is the state at t");

        // A wish to stop at the very end stops nothing.
        let mut probe = Probe::new(oscillator, 2, 1e-9);
        probe.stop_at = 1.0;
        let outcome = run(method.as_mut(), &mut probe, &mut [1.0, 0.0], 1.0, &[], &options);
        assert!(matches!(outcome.status, Status::Completed));
    }
}

#[test]
fn recoverable_failure_stops_before_the_wall_and_keeps_samples() {
    let mut probe = Probe::new(oscillator, 2, 1e-9);
    probe.wall = 1.0;
    let times = [0.0, 0.3, 0.6, 0.9, 1.2];
    let mut y = [1.0, 0.0];
    let outcome = run(&mut dop853(), &mut probe, &mut y, 2.0, &times, &Options::default());
    let Status::StoppedEarly { t, reason: StopReason::Failed { cause, .. } } = outcome.status else {
        panic!("{:?}", outcome.status)
    };
    assert!(t < 1.0 && t > 1.0 - 1e-12, "got as near as possible: {t}");
    assert_eq!(cause.to_string(), "there is a wall at 1");
    assert_eq!(probe.sample_times(), times[..4]);
    assert_eq!(outcome.counters.recoveries.smaller_step, outcome.counters.rejected);
    assert!(distance(&y, &[t.cos(), -t.sin()]) < 1e-8);

    // Without another step size to try, the last good state is that of the last step.
    let mut probe = Probe::new(oscillator, 2, 1e-9);
    probe.wall = 1.0;
    for name in ["dop853", "rk4"] {
        let mut method = by_name(name).unwrap();
        let outcome = run(method.as_mut(), &mut probe, &mut [1.0, 0.0], 2.0, &[], &fixed(0.3));
        let Status::StoppedEarly { t, .. } = outcome.status else { panic!("{name}") };
        assert!((t - 6.0 / 7.0).abs() < 1e-15, "{name}: {t}");
        assert_eq!((outcome.counters.steps, outcome.counters.rejected), (3, 1));
    }
}

#[test]
fn not_a_number_stops_the_run_and_keeps_samples() {
    let broken: Rhs = |t, y, dy| {
        oscillator(t, y, dy);
        if t > 1.0 {
            dy[1] = f64::NAN;
        }
    };
    let mut probe = Probe::new(broken, 2, 1e-9);
    let times = [0.5, 0.99, 1.5];
    let outcome = run(&mut dop853(), &mut probe, &mut [1.0, 0.0], 2.0, &times, &Options::default());
    let Status::StoppedEarly { t, reason: StopReason::NotFinite { .. } } = outcome.status else {
        panic!("{:?}", outcome.status)
    };
    assert!(t <= 1.0 && t > 1.0 - 1e-12, "{t}");
    assert_eq!(probe.sample_times(), times[..2]);
    assert_eq!(outcome.counters.recoveries.not_finite, outcome.counters.rejected);

    let mut probe = Probe::new(broken, 2, 1e-9);
    let outcome = run(&mut Rk4::default(), &mut probe, &mut [1.0, 0.0], 2.0, &times, &fixed(0.1));
    assert!(matches!(outcome.status, Status::StoppedEarly { reason: StopReason::NotFinite { .. }, .. }));
    assert_eq!(probe.sample_times(), times[..2]);
}

#[test]
fn a_pole_ends_the_run_at_the_pole() {
    // y' = y^2, y = 1 / (1 - t)
    let mut probe = Probe::new(|_, y, dy| dy[0] = y[0] * y[0], 1, 1e-9);
    let outcome = run(&mut dop853(), &mut probe, &mut [1.0], 2.0, &[0.5, 1.5], &Options::default());
    let Status::StoppedEarly { t, reason } = outcome.status else { panic!("{:?}", outcome.status) };
    assert!((t - 1.0).abs() < 1e-6, "{t} {reason}");
    assert_eq!(probe.samples.len(), 1);
}

#[test]
fn fatal_failure_is_an_error_with_its_cause_and_time() {
    let mut probe = Probe::new(oscillator, 2, 1e-9);
    (probe.wall, probe.fatal) = (1.0, true);
    let span = Span { t_start: 0.0, t_end: 2.0, sample_times: &[0.1] };
    let mut y = [1.0, 0.0];
    let error = dop853().integrate(&mut probe, &mut y, &span, &Options::default()).unwrap_err();
    let IntegrateError::System { t, cause } = error else { panic!("{error}") };
    assert!((1.0..2.0).contains(&t));
    assert_eq!(cause.to_string(), "there is a wall at 1");
    assert_eq!((probe.samples.len(), &y[..]), (1, &probe.steps.last().unwrap().2[..]));
}

#[test]
fn limit_of_steps_is_a_status() {
    let mut probe = Probe::new(arenstorf, 4, 1e-9);
    let options = Options { max_steps: 20, ..Options::default() };
    let mut y = ARENSTORF_START;
    let outcome = run(&mut dop853(), &mut probe, &mut y, 10.0, &[], &options);
    assert!(matches!(outcome.status, Status::StoppedEarly { reason: StopReason::StepLimit { limit: 20, .. }, .. }));
    assert_eq!(outcome.counters.steps + outcome.counters.rejected, 20);
}

/// Steps of one size are only many; those in front of a jump are tiny, and that is said.
#[test]
fn a_limit_that_was_used_up_in_no_time_is_told_apart() {
    let crept = |derivative: fn(f64, &[f64], &mut [f64])| {
        let mut probe = Probe::new(derivative, 1, 1e-9);
        let options = Options { max_steps: 2000, max_step: Some(1e-3), ..Options::default() };
        match run(&mut dop853(), &mut probe, &mut [1.0], 10.0, &[], &options).status {
            Status::StoppedEarly { reason: StopReason::StepLimit { crept, .. }, .. } => crept,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(crept(|_, y, f| f[0] = -y[0]), None);
    // Dry friction written as a function of the speed: at rest after 0.2.
    let since = crept(|_, y, f| f[0] = -5.0 * y[0].signum());
    assert!(since.is_some_and(|since| since < 1e-3), "{since:?}");
}

#[test]
fn projection_keeps_the_radius_to_round_off() {
    let to_circle: fn(&mut [f64]) = |y| {
        let radius = y[0].hypot(y[1]);
        y.iter_mut().for_each(|value| *value /= radius);
    };
    for (name, options) in [("dop853", Options::default()), ("rk4", fixed(0.2))] {
        let drift = |projection: Option<fn(&mut [f64])>| {
            let mut probe = Probe::new(oscillator, 2, 1e-4);
            probe.projection = projection;
            let mut method = by_name(name).unwrap();
            let outcome = run(method.as_mut(), &mut probe, &mut [1.0, 0.0], 50.0, &[], &options);
            assert_eq!(outcome.counters.projections, outcome.counters.steps);
            let miss = |(_, _, y): &(f64, f64, Vec<f64>)| (y[0].hypot(y[1]) - 1.0).abs();
            probe.steps.iter().map(miss).fold(0.0, f64::max)
        };
        assert!(drift(None) > 1e-6, "{name}");
        assert!(drift(Some(to_circle)) < 3e-16, "{name}");
    }
}

#[test]
fn changes_of_memory_cost_one_evaluation_a_step() {
    for (name, options) in [("dop853", Options::default()), ("rk4", fixed(0.1))] {
        let counters = |accepted: Accepted| {
            let mut probe = Probe::new(oscillator, 2, 1e-9);
            probe.accepted = accepted;
            let mut method = by_name(name).unwrap();
            let outcome = run(method.as_mut(), &mut probe, &mut [1.0, 0.0], 5.0, &[], &options);
            assert_eq!(probe.accepts, outcome.counters.steps);
            outcome.counters
        };
        let (kept, changed) = (counters(Accepted::Unchanged), counters(Accepted::Changed));
        assert_eq!(kept.steps, changed.steps);
        // Nothing follows the last step.
        assert_eq!(changed.evaluations - kept.evaluations, kept.steps - 1, "{name}");
    }
}

/// A force that changes sign with each step: the derivative at the end of a step is not that
/// at the start of the next one.
struct Switching {
    sign: f64,
    first_stages: Vec<f64>,
}

impl System for Switching {
    fn dim(&self) -> usize {
        1
    }

    fn rhs(&mut self, _t: f64, _y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        dy[0] = self.sign;
        Ok(())
    }

    fn error_norm(&mut self, _y0: &[f64], _y1: &[f64], error: &[f64]) -> f64 {
        error[0].abs()
    }

    fn accept(&mut self, _t: f64, _y: &mut [f64]) -> Result<Accepted, Failure> {
        self.sign = -self.sign;
        Ok(Accepted::Changed)
    }

    fn step_done(&mut self, _t: f64, y: &[f64], _h: f64) -> Flow {
        self.first_stages.push(y[0]);
        Flow::Continue
    }
}

#[test]
fn changed_memory_acts_from_the_next_step_on() {
    for name in ["dop853", "rk4"] {
        let mut system = Switching { sign: 1.0, first_stages: Vec::new() };
        let span = Span { t_start: 0.0, t_end: 4.0, sample_times: &[] };
        let mut y = [0.0];
        by_name(name).unwrap().integrate(&mut system, &mut y, &span, &fixed(1.0)).unwrap();
        assert!(distance(&system.first_stages, &[1.0, 0.0, 1.0, 0.0]) < 1e-14, "{name}");
    }
}

#[test]
fn runs_on_one_method_do_not_know_each_other() {
    let mut method = dop853();
    let mut results = Vec::new();
    for _ in 0..2 {
        let mut probe = Probe::new(arenstorf, 4, 1e-8);
        let mut y = ARENSTORF_START;
        run(&mut method, &mut probe, &mut y, 3.0, &[1.0], &Options::default());
        results.push((y, probe.samples));
        let mut other = Probe::new(oscillator, 2, 1e-8);
        run(&mut method, &mut other, &mut [1.0, 0.0], 3.0, &[1.0], &Options::default());
    }
    assert_eq!(results[0], results[1]);
}

#[test]
fn predictive_control_is_an_option() {
    let counters = |beta: f64| {
        let mut probe = Probe::new(arenstorf, 4, 1e-9);
        let options = Options { beta: Some(beta), ..Options::default() };
        run(&mut dop853(), &mut probe, &mut ARENSTORF_START.clone(), 17.0, &[], &options).counters
    };
    assert!(counters(0.04).rejected < counters(0.0).rejected);
}

#[test]
fn an_empty_interval_has_samples_only() {
    for name in names() {
        let mut probe = Probe::new(oscillator, 2, 1e-9);
        let mut method = by_name(name).unwrap();
        let outcome = run(method.as_mut(), &mut probe, &mut [1.0, 0.0], 0.0, &[0.0], &fixed(0.1));
        assert!(matches!(outcome.status, Status::Completed));
        assert_eq!(probe.samples, [(0.0, vec![1.0, 0.0])]);
        assert_eq!((outcome.counters.evaluations, outcome.counters.steps), (0, 0));
    }
}

#[test]
fn a_state_at_rest_takes_few_steps() {
    let mut probe = Probe::new(|_, _, dy| dy.fill(0.0), 2, 1e-9);
    let outcome = run(&mut dop853(), &mut probe, &mut [0.0, 0.0], 1.0, &[], &Options::default());
    assert!(outcome.counters.steps < 15, "{:?}", outcome.counters);
    assert_eq!(outcome.counters.rejected, 0);
}

#[test]
fn faulty_calls_are_refused_before_any_evaluation() {
    let fault = |y: &[f64], t_end: f64, samples: &[f64], options: &Options| {
        let mut probe = Probe::new(oscillator, 2, 1e-9);
        probe.wall = f64::NEG_INFINITY;
        probe.fatal = true;
        let span = Span { t_start: 0.0, t_end, sample_times: samples };
        let error = dop853().integrate(&mut probe, &mut y.to_vec(), &span, options).unwrap_err();
        assert!(matches!(error, IntegrateError::Invalid(_)), "{error}");
        error.to_string()
    };
    let good = Options::default();
    let y = [1.0, 0.0];
    assert!(fault(&[1.0], 1.0, &[], &good).contains("1 entries, the system 2"));
    assert!(fault(&[f64::NAN, 0.0], 1.0, &[], &good).contains("not finite"));
    assert!(fault(&y, -1.0, &[], &good).contains("no interval"));
    assert!(fault(&y, f64::NAN, &[], &good).contains("no interval"));
    assert!(fault(&y, 1.0, &[0.5, 0.2], &good).contains("0.2 is out of order"));
    assert!(fault(&y, 1.0, &[1.5], &good).contains("1.5"));
    assert!(fault(&y, 1.0, &[f64::NAN], &good).contains("NaN"));
    assert!(fault(&y, 1.0, &[], &fixed(0.0)).contains("fixed step"));
    let negative = Options { max_step: Some(-1.0), ..Options::default() };
    assert!(fault(&y, 1.0, &[], &negative).contains("largest step"));
    let unsafe_options = Options { safety: 1.5, ..Options::default() };
    assert!(fault(&y, 1.0, &[], &unsafe_options).contains("safety"));

    let mut probe = Probe::new(oscillator, 2, 1e-9);
    let span = Span { t_start: 0.0, t_end: 1.0, sample_times: &[] };
    let error = Rk4::default().integrate(&mut probe, &mut [1.0, 0.0], &span, &good).unwrap_err();
    assert!(error.to_string().contains("rk4 needs a fixed step"));
}

#[test]
fn every_name_has_its_method() {
    for name in names() {
        let method = by_name(name).unwrap();
        assert_eq!(method.name(), name);
    }
    assert!(by_name("euler").is_none());
}
