//! Steps that end where the right side switches: as accurate as smooth ones, and few.

use super::*;
use crate::interval::{Interval, Range};

/// A mass between a spring and a force of constant size towards the middle: u'' = -u - 2 sign(u).
fn relay(_t: f64, y: &[f64], dy: &mut [f64]) {
    dy[0] = y[1];
    dy[1] = -y[0] - if y[0] < 0.0 { -2.0 } else { 2.0 };
}

fn position(_t: f64, y: &[f64], values: &mut [f64]) {
    values[0] = y[0];
}

/// From the middle with speed 1 it comes back after this time with speed -1.
fn half_period() -> f64 {
    2.0 * 0.5_f64.atan()
}

fn relay_solution(t: f64) -> [f64; 2] {
    let halves = (t / half_period()).floor();
    let s = t - halves * half_period();
    let sign = if halves % 2.0 == 0.0 { 1.0 } else { -1.0 };
    [sign * (2.0 * s.cos() + s.sin() - 2.0), sign * (s.cos() - 2.0 * s.sin())]
}

/// Largest error at samples and the end, and the work.
fn relay_run(method: &mut dyn Integrator, tolerance: f64, located: bool) -> (f64, Counters) {
    let mut system = Probe::new(relay, 2, tolerance);
    system.switching = located.then_some((1, position as Rhs));
    let mut y = vec![0.0, 1.0];
    let t_end = 10.3;
    let samples: Vec<f64> = (0..=206).map(|k| (0.05 * f64::from(k)).min(t_end)).collect();
    let span = Span { t_start: 0.0, t_end, sample_times: &samples };
    let outcome = method.integrate(&mut system, &mut y, &span, &Options::default()).unwrap();
    assert!(matches!(outcome.status, Status::Completed), "{:?}", outcome.status);
    assert_eq!(system.samples.len(), samples.len());
    let worst = system.samples.iter().map(|(t, y)| distance(y, &relay_solution(*t))).fold(0.0, f64::max);
    (worst.max(distance(&y, &relay_solution(t_end))), outcome.counters)
}

/// Eleven switches from 0 to 10.3, the first of them at a half period.
const SWITCHES: usize = 11;

#[test]
fn every_method_ends_steps_at_a_switch() {
    for (name, bound) in [("dop853", 1e-8), ("dopri5", 1e-7), ("radau5", 1e-6), ("auto", 1e-8)] {
        let mut method = by_name(name).unwrap();
        let (error, counters) = relay_run(method.as_mut(), 1e-10, true);
        let (plain, without) = relay_run(method.as_mut(), 1e-10, false);
        println!(
            "{name}: {error:.1e} {} events, {} rejected, {} evaluations; without {plain:.1e}, {} rejected, {}",
            counters.events, counters.rejected, counters.evaluations, without.rejected, without.evaluations
        );
        assert!(error < bound, "{name}: {error:e}");
        assert_eq!((counters.events, counters.chatters), (SWITCHES, 0), "{name}");
        assert_eq!(without.events, 0, "{name}");
        assert!(counters.evaluations < without.evaluations, "{name}");
    }
}

/// Two of them, and their positions.
fn twins(t: f64, y: &[f64], dy: &mut [f64]) {
    let (first, second) = dy.split_at_mut(2);
    relay(t, &y[..2], first);
    relay(t, &y[2..], second);
}

fn positions(_t: f64, y: &[f64], values: &mut [f64]) {
    values.copy_from_slice(&[y[0], y[2]]);
}

#[test]
fn switches_as_near_to_each_other_as_round_off_are_crossed() {
    for (name, bound) in [("dop853", 1e-8), ("dopri5", 1e-7), ("radau5", 1e-6), ("radau9", 1e-6), ("auto", 1e-8)] {
        for apart in [0.0, 1e-16, 3e-15, 1e-14, 3e-14, 1e-13, 3e-13, 1e-12, 1e-11, 1e-9] {
            let mut system = Probe::new(twins, 4, 1e-10);
            system.switching = Some((2, positions as Rhs));
            let mut y = vec![0.0, 1.0, apart, 1.0];
            let span = Span { t_start: 0.0, t_end: 10.3, sample_times: &[] };
            let options = Options { max_steps: 20_000, ..Options::default() };
            let outcome = by_name(name).unwrap().integrate(&mut system, &mut y, &span, &options).unwrap();
            assert!(matches!(outcome.status, Status::Completed), "{name}, {apart:e}: {:?}", outcome.status);
            let error = distance(&y[..2], &relay_solution(10.3)).max(distance(&y[2..], &y[..2]) - 100.0 * apart);
            assert!(error < bound, "{name}, {apart:e}: {error:e}");
        }
    }
}

#[test]
fn conditions_that_are_round_off_are_no_switches() {
    fn with_round_off(_t: f64, y: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&[y[0], ((y[0] + 1e6) - 1e6) - y[0], ((1e4 - y[1]) - 1e4) + y[1]]);
    }
    let mut worst = 0;
    for name in ["dop853", "dopri5", "radau5", "radau9", "auto"] {
        let counters = [(1, position as Rhs), (3, with_round_off as Rhs)].map(|switching| {
            let mut system = Probe::new(relay, 2, 1e-9);
            system.switching = Some(switching);
            let mut y = vec![0.0, 1.0];
            let span = Span { t_start: 0.0, t_end: 10.3, sample_times: &[] };
            by_name(name).unwrap().integrate(&mut system, &mut y, &span, &Options::default()).unwrap().counters
        });
        println!("{name}: {counters:?}");
        worst = worst.max(counters[1].events.abs_diff(counters[0].events));
    }
    assert!(worst <= 4, "{worst}");
}

#[test]
fn locating_a_jump_takes_a_fraction_of_the_steps_across_it() {
    let (error, counters) = relay_run(&mut dop853(), 1e-10, true);
    let (_, without) = relay_run(&mut dop853(), 1e-10, false);
    assert!(error < 1e-9, "{error:e}");
    assert!(4 * counters.evaluations < without.evaluations, "{} {}", counters.evaluations, without.evaluations);
}

#[test]
fn states_at_switches_are_on_the_far_side() {
    let mut system = Probe::new(relay, 2, 1e-9);
    system.switching = Some((1, position as Rhs));
    let mut y = vec![0.0, 1.0];
    let span = Span { t_start: 0.0, t_end: 1.5, sample_times: &[] };
    let outcome = dop853().integrate(&mut system, &mut y, &span, &Options::default()).unwrap();
    assert_eq!(outcome.counters.events, 1);
    let there = system.steps.iter().find(|(t, ..)| (t - half_period()).abs() < 1e-9);
    let (_, _, state) = there.expect("a step ends at the switch");
    assert!(state[0] < 0.0 && state[0] > -1e-9, "{state:?}");
    // No step is across it.
    assert!(system.steps.iter().all(|(t, h, _)| *t <= half_period() + 1e-9 || t - h >= half_period() - 1e-12));
}

#[test]
fn nothing_is_looked_at_without_rejected_steps() {
    fn never(_t: f64, _y: &[f64], _values: &mut [f64]) {
        panic!("conditions are evaluated");
    }
    let mut system = Probe::new(smooth, 3, 1e-6);
    system.switching = Some((1, never as Rhs));
    let mut y = smooth_solution(0.0).to_vec();
    let span = Span { t_start: 0.0, t_end: 5.0, sample_times: &[1.0] };
    let options = Options { max_step: Some(0.1), ..Options::default() };
    let outcome = dop853().integrate(&mut system, &mut y, &span, &options).unwrap();
    assert_eq!((outcome.counters.rejected, outcome.counters.events), (0, 0));
}

/// A square wave that begins at 4, with half periods of this length.
fn square_wave<const NANOSECONDS: u64>(t: f64, y: &[f64], dy: &mut [f64]) {
    oscillator(t, y, dy);
    let on = if wave::<NANOSECONDS>(t) < 0.0 { -1.0 } else { 1.0 };
    dy[2] = if t < 4.0 { 0.0 } else { on };
}

fn wave<const NANOSECONDS: u64>(t: f64) -> f64 {
    (std::f64::consts::PI * t / (1e-9 * NANOSECONDS as f64)).sin()
}

/// Ten and a half periods of a wave: what was done, and by how much the end is off.
fn through_a_wave<const NANOSECONDS: u64>(tolerance: f64) -> (Counters, f64) {
    let mut system = Probe::new(square_wave::<NANOSECONDS>, 3, tolerance);
    system.switching = Some((1, |t, _, values| values[0] = wave::<NANOSECONDS>(t)));
    let mut y = vec![1.0, 0.0, 0.0];
    let half = 1e-9 * NANOSECONDS as f64;
    let t_end = 4.0 + 21.0 * half;
    let span = Span { t_start: 0.0, t_end, sample_times: &[] };
    let outcome = dop853().integrate(&mut system, &mut y, &span, &Options::default()).unwrap();
    println!("{:?}", outcome.counters);
    (outcome.counters, distance(&y, &[t_end.cos(), -t_end.sin(), half]))
}

#[test]
fn too_many_switches_are_left_to_error_control() {
    // A million times faster than the oscillator beside it.
    let (Counters { events, chatters, .. }, off) = through_a_wave::<1_000>(1e-10);
    assert!(chatters > 0 && events < 21, "{events} {chatters}");
    // As accurate as error control is by itself there.
    assert!(off < 1e-5, "{off:e}");
    // A thousand times faster only: what goes away from its switches is followed.
    let (Counters { events, chatters, .. }, off) = through_a_wave::<1_000_000>(1e-7);
    assert!(chatters == 0 && events == 21, "{events} {chatters}");
    assert!(off < 1e-8, "{off:e}");
}

/// A ball that drops on a stiff spring.
fn ball(_t: f64, y: &[f64], dy: &mut [f64]) {
    dy[0] = y[1];
    dy[1] = -GRAVITY - if y[0] < 0.0 { STOP * y[0] } else { 0.0 };
}

const GRAVITY: f64 = 9.81;
/// Stiffness over mass, 1/s^2.
const STOP: f64 = 5e5;

#[test]
fn short_contacts_after_long_flights_are_found() {
    // Free flight lets steps grow without limit; their ends, deep in the spring, must not count as sizes of anything.
    let height = 0.5_f64;
    let (speed, rate) = ((2.0 * GRAVITY * height).sqrt(), STOP.sqrt());
    let contact = 2.0 * (std::f64::consts::PI - (speed * rate / GRAVITY).atan()) / rate;
    let period = 2.0 * speed / GRAVITY + contact;
    for (name, bound) in [("dop853", 1e-9), ("dopri5", 1e-8), ("auto", 1e-9)] {
        let mut system = Probe::new(ball, 2, 1e-11);
        system.switching = Some((1, position as Rhs));
        let mut y = vec![height, 0.0];
        let span = Span { t_start: 0.0, t_end: 20.0 * period, sample_times: &[] };
        let outcome = by_name(name).unwrap().integrate(&mut system, &mut y, &span, &Options::default()).unwrap();
        let energy = |y: &[f64]| 0.5 * y[1] * y[1] + GRAVITY * y[0] + 0.5 * STOP * y[0].min(0.0).powi(2);
        let start = GRAVITY * height;
        let worst = system.steps.iter().map(|(_, _, y)| (energy(y) / start - 1.0).abs()).fold(0.0, f64::max);
        println!("{name}: {worst:.1e} {:?}", outcome.counters);
        assert_eq!((outcome.counters.events, outcome.counters.chatters), (40, 0), "{name}");
        assert!(worst < bound, "{name}: {worst:e}");
        assert!((y[0] - height).abs() < bound, "{name}: {y:?}");
    }
}

/// Falls, and no further than up to a time next to zero.
fn until_zero(t: f64, _y: &[f64], dy: &mut [f64]) {
    dy[0] = if t > NEXT_TO_ZERO { f64::NAN } else { t };
}

const NEXT_TO_ZERO: f64 = -1e-300;

#[test]
fn no_stage_is_behind_the_end_of_its_step() {
    for name in ["dop853", "dopri5", "radau5", "radau9"] {
        let mut system = Probe::new(until_zero, 1, 1e-8);
        let mut y = vec![0.5];
        let span = Span { t_start: -1.0, t_end: NEXT_TO_ZERO, sample_times: &[] };
        let options = Options { first_step: Some(1.0), ..Options::default() };
        let outcome = by_name(name).unwrap().integrate(&mut system, &mut y, &span, &options).unwrap();
        assert!(matches!(outcome.status, Status::Completed), "{name}: {:?}", outcome.status);
        assert!(y[0].abs() < 1e-14 && outcome.counters.rejected == 0, "{name}: {y:?}, {:?}", outcome.counters);
    }
}

/// y' = sin f with a bell f over time, which is exactly zero away from it.
struct Bell;

impl Bell {
    const AT: f64 = 10.12;
    const WIDTH: f64 = 0.01;

    fn value(t: f64) -> f64 {
        (-((t - Self::AT) / Self::WIDTH).powi(2)).exp()
    }
}

impl System for Bell {
    fn dim(&self) -> usize {
        1
    }
    fn rhs(&mut self, t: f64, _: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        dy[0] = Self::value(t).sin();
        Ok(())
    }
    fn error_norm(&mut self, _: &[f64], _: &[f64], error: &[f64]) -> f64 {
        error[0].abs() / 1e-10
    }
    fn guards(&self) -> Guards {
        Guards { of_time: vec![Guard::Feature, Guard::Feature], ..Guards::default() }
    }
    fn enclose(
        &mut self,
        _: Watched,
        t: Range,
        _: &dyn Fn(usize) -> Range,
        _: &dyn Fn(usize) -> bool,
        found: &mut [Range],
    ) {
        let share = (t.value - Interval::point(Self::AT)).scaled(1.0 / Self::WIDTH);
        let bell = (-share.square()).rising(f64::exp);
        let slope = bell * share.scaled(-2.0 / Self::WIDTH) * t.slope;
        found[0] = Range::new(bell, slope, Self::value(t.middle));
        found[1] = Range::new(bell.sin(), slope * bell.cos(), Self::value(t.middle).sin());
    }
    fn values(&mut self, _: Watched, t: f64, _: &dyn Fn(usize) -> f64, found: &mut [f64]) {
        found.copy_from_slice(&[Self::value(t), Self::value(t).sin()]);
    }
}

#[test]
fn pulses_beside_what_is_exactly_zero_are_felt() {
    let mut y = [0.0];
    let span = Span { t_start: 0.0, t_end: 20.0, sample_times: &[] };
    let outcome = dop853().integrate(&mut Bell, &mut y, &span, &Options::default()).unwrap();
    // The integral of sin(exp(-x^2)), by its series.
    let terms = [(1.0, 1.0), (3.0, -6.0), (5.0, 120.0), (7.0, -5040.0), (9.0, 362_880.0), (11.0, -39_916_800.0)];
    let known = Bell::WIDTH * terms.iter().map(|(n, f)| (std::f64::consts::PI / n).sqrt() / f).sum::<f64>();
    assert!((y[0] - known).abs() < 1e-9, "{} for {known}", y[0]);
    assert_eq!((outcome.counters.unproven, outcome.counters.open), (0, None));
}
