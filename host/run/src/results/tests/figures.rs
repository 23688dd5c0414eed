//! Figures of functions whose figures are known.

use crate::results::{Crossing, Figure, FigureError, Samples, Take};
use std::f64::consts::{PI, SQRT_2, TAU};

/// Samples of functions of time.
struct Run {
    times: Vec<f64>,
    columns: Vec<Vec<f64>>,
    names: Vec<String>,
}

impl Run {
    fn new(start: f64, step: f64, number: usize, functions: &[&dyn Fn(f64) -> f64]) -> Self {
        let times: Vec<f64> = (0..number).map(|k| start + step * k as f64).collect();
        let columns = functions.iter().map(|f| times.iter().map(|t| f(*t)).collect()).collect();
        let names = (0..functions.len()).map(|k| format!("f{k}")).collect();
        Self { times, columns, names }
    }

    fn figure(&self, figure: Figure) -> Result<f64, FigureError> {
        figure.compute(&Samples { times: &self.times, columns: &self.columns, names: &self.names })
    }

    fn take(&self, take: Take) -> f64 {
        self.figure(figure(take)).unwrap()
    }
}

fn figure(take: Take) -> Figure {
    Figure { channel: 0, take, absolute: false, over: None, from: None }
}

fn at(equals: f64, period: Option<f64>) -> Take {
    Take::At(Crossing { channel: 1, equals, period })
}

#[track_caller]
fn assert_near(value: f64, exact: f64, error: f64) {
    assert!((value - exact).abs() <= error, "{value} is not {exact}, off by {:e}", value - exact);
}

#[test]
fn extremes_keep_their_sign() {
    let run = Run::new(0.0, 0.25, 9, &[&|t| (t - 1.0).powi(2) - 3.0]);
    assert_eq!(run.take(Take::Peak), -3.0);
    assert_eq!(run.take(Take::Min), -3.0);
    assert_eq!(run.take(Take::Max), -2.0);
    assert_eq!(run.take(Take::Final), -2.0);
    assert_eq!(run.figure(Figure { absolute: true, ..figure(Take::Peak) }).unwrap(), 3.0);
    assert_eq!(run.figure(Figure { absolute: true, ..figure(Take::Max) }).unwrap(), 2.0);
}

#[test]
fn means_are_weighted_by_time_not_by_samples() {
    let mut run = Run::new(0.0, 1.0, 4, &[&|t| t]);
    // The mean of t over 0..4 is 2, however the samples lie.
    run.times = vec![0.0, 0.1, 0.2, 4.0];
    run.columns = vec![run.times.clone()];
    assert_near(run.take(Take::Mean), 2.0, 1e-15);
}

#[test]
fn the_root_mean_square_of_a_sine_is_its_amplitude_over_root_two() {
    let run = Run::new(0.0, TAU / 360.0, 721, &[&|t| 5.0 * t.sin()]);
    assert_near(run.take(Take::Rms), 5.0 / SQRT_2, 1e-12);
    assert_near(run.take(Take::Mean), 0.0, 1e-12);
}

#[test]
fn a_single_sample_is_its_own_mean() {
    let run = Run::new(3.0, 1.0, 1, &[&|t| -t]);
    assert_eq!(run.take(Take::Mean), -3.0);
    assert_eq!(run.take(Take::Rms), 3.0);
}

#[test]
fn a_quotient_takes_the_same_figure_of_both() {
    let run = Run::new(0.0, 0.5, 9, &[&|t| -6.0 * t, &|t| 2.0 * t]);
    let ratio = Figure { over: Some(1), ..figure(Take::Peak) };
    assert_eq!(run.figure(ratio).unwrap(), -3.0);
    assert_eq!(run.figure(Figure { absolute: true, ..ratio }).unwrap(), 3.0);
}

#[test]
fn a_zero_divisor_is_an_error_with_its_name() {
    let run = Run::new(0.0, 0.5, 9, &[&|t| t, &|_| 0.0]);
    let error = run.figure(Figure { over: Some(1), ..figure(Take::Max) }).unwrap_err();
    assert_eq!(error.to_string(), "the same figure of `f1` is zero and cannot divide");
}

#[test]
fn earlier_samples_are_left_out() {
    let run = Run::new(0.0, 0.1, 11, &[&|t| -t]);
    let late = |take| run.figure(Figure { from: Some(0.3), ..figure(take) }).unwrap();
    // The sample at 3 * 0.1, which is a little more than 0.3, belongs to the rest.
    assert_near(late(Take::Max), -0.3, 1e-15);
    assert_near(late(Take::Mean), -0.65, 1e-15);
    let error = run.figure(Figure { from: Some(2.0), ..figure(Take::Max) }).unwrap_err();
    assert_eq!(error.to_string(), "there are no samples from t = 2");
}

#[test]
fn a_start_that_rounds_above_its_sample_keeps_it() {
    let run = Run::new(0.0, 1.0, 4, &[&|t| t]);
    let from = f64::from_bits(1.0_f64.to_bits() + 1);
    assert_eq!(run.figure(Figure { from: Some(from), ..figure(Take::Min) }).unwrap(), 1.0);
}

#[test]
fn no_samples_at_all_is_an_error() {
    let run = Run::new(0.0, 1.0, 0, &[&|t| t]);
    assert_eq!(run.figure(figure(Take::Final)).unwrap_err().to_string(), "there are no samples");
}

#[test]
fn polynomials_of_degree_five_are_read_exactly_at_a_crossing() {
    let quintic = |t: f64| t.powi(5) - 2.0 * t.powi(3) + t - 4.0;
    let run = Run::new(0.0, 0.5, 8, &[&quintic, &|t| 2.0 * t]);
    // 2 t = 2.6 at t = 1.3.
    assert_near(run.take(at(2.6, None)), quintic(1.3), 1e-13);
}

#[test]
fn the_crossing_of_a_curve_converges_with_the_sixth_power_of_the_step() {
    let error = |number: usize| {
        let step = 6.0 / number as f64;
        let run = Run::new(0.0, step, number + 1, &[&|t| t, &|t| t.exp()]);
        (run.take(at(20.0, None)) - 20.0_f64.ln()).abs()
    };
    // The root moves within its interval from grid to grid, so the order is taken over a factor of 16.
    let order = (error(20) / error(320)).log2() / 4.0;
    assert!(order > 5.0, "order {order}");
    assert!(error(320) < 1e-11);
}

#[test]
fn the_last_of_many_crossings_is_taken() {
    let run = Run::new(0.0, 0.05, 401, &[&|t| t, &|t| t.sin()]);
    // The zeros of sin up to 20: the last is 6 pi.
    assert_near(run.take(at(0.0, None)), 6.0 * PI, 1e-8);
    // Earlier than the end of the samples: 0.99 is passed last on the way down from the peak at 4.5 pi.
    assert_near(run.take(at(0.99, None)), 5.0 * PI - 0.99_f64.asin(), 1e-8);
}

#[test]
fn turns_are_counted_modulo_the_period() {
    // An angle that speeds up, seen over 15 turns.
    let angle = |t: f64| 9.0 * t + 0.01 * t * t;
    let time_of = |angle: f64| (-9.0 + (81.0 + 0.04 * angle).sqrt()) / 0.02;
    let run = Run::new(0.0, 0.02, 501, &[&|t| t, &angle]);
    let turns = (angle(10.0) / TAU).floor();
    assert_near(run.take(at(0.0, Some(TAU))), time_of(turns * TAU), 1e-11);
    let half = ((angle(10.0) - PI) / TAU).floor();
    assert_near(run.take(at(PI, Some(TAU))), time_of(PI + half * TAU), 1e-11);
    // Values that differ by whole periods are the same.
    assert_near(run.take(at(PI - 3.0 * TAU, Some(TAU))), time_of(PI + half * TAU), 1e-11);
}

#[test]
fn turning_backwards_crosses_too() {
    let run = Run::new(0.0, 0.02, 501, &[&|t| t, &|t| -9.0 * t]);
    let turns = (90.0 / TAU).floor();
    assert_near(run.take(at(0.0, Some(TAU))), turns * TAU / 9.0, 1e-12);
}

#[test]
fn of_several_periods_within_a_step_the_last_is_taken() {
    let run = Run::new(0.0, 1.0, 8, &[&|t| t, &|t| 3.5 * t]);
    assert_near(run.take(at(0.0, Some(1.0))), 24.0 / 3.5, 1e-13);
    let back = Run::new(0.0, 1.0, 8, &[&|t| t, &|t| -3.5 * t]);
    assert_near(back.take(at(0.0, Some(1.0))), 24.0 / 3.5, 1e-13);
}

#[test]
fn a_crossing_on_a_sample_is_found_once_and_exactly() {
    let run = Run::new(0.0, 0.25, 9, &[&|t| t * t, &|t| t - 1.0]);
    assert_eq!(run.take(at(0.0, None)), 1.0);
    // At the last sample, at the first, and nowhere else.
    assert_eq!(run.take(at(1.0, None)), 4.0);
    assert_eq!(run.take(at(-1.0, None)), 0.0);
    assert_eq!(run.take(at(-1.0, Some(10.0))), 0.0);
}

#[test]
fn whole_turns_on_samples_are_never_lost_to_rounding() {
    // Samples exactly at multiples of the period as computed, whose quotient rounds to either side.
    for period in [0.1, 0.3, 0.7, TAU, 360.0, 1.0 / 3.0] {
        for turns in 1..200 {
            let end = period * f64::from(turns);
            let run = Run::new(0.0, 1.0, 2, &[&|t| t, &|t| end - (1.0 - t) * 0.4 * period]);
            let time = run.take(at(0.0, Some(period)));
            assert_near(time, 1.0, 1e-12);
        }
    }
}

#[test]
fn a_channel_that_rests_on_the_value_counts_to_its_end() {
    let run = Run::new(0.0, 1.0, 5, &[&|t| t, &|_| 2.0]);
    assert_eq!(run.take(at(2.0, None)), 4.0);
}

#[test]
fn a_missing_crossing_says_what_was_looked_for_and_where() {
    let run = Run::new(0.0, 0.5, 9, &[&|t| t, &|t| t.sin()]);
    let late = Figure { from: Some(1.0), ..figure(at(2.0, None)) };
    assert_eq!(run.figure(late).unwrap_err().to_string(), "`f1` does not cross 2 between t = 1 and t = 4");
    let periodic = figure(at(2.0, Some(4.0)));
    let text = run.figure(periodic).unwrap_err().to_string();
    assert_eq!(text, "`f1` does not cross 2 (modulo 4) between t = 0 and t = 4");
}

#[test]
fn a_sample_that_is_not_finite_is_named() {
    let run = Run::new(0.0, 0.5, 9, &[&|t| if t == 1.5 { f64::NAN } else { t }, &|t| t]);
    for take in [Take::Peak, Take::Mean, Take::Final, at(0.25, None)] {
        let text = run.figure(figure(take)).unwrap_err().to_string();
        assert_eq!(text, "`f0` is not finite at t = 1.5");
    }
    let late = Figure { from: Some(2.0), ..figure(Take::Peak) };
    assert_eq!(run.figure(late).unwrap(), 4.0);
}
