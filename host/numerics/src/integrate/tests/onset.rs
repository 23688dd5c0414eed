//! Samples within the first step, where the solution is smooth and the right side is not, or neither.

use super::*;

/// A puck of 2 kg that slides from rest against 6 N of dry friction, pushed by 6 + `MORE` N along x and by a force along y that begins at
/// zero: the direction of its velocity, which is none at first, turns from there on.
fn begins_to_slide<const HUNDREDTHS: i32, const ACROSS: i32>(t: f64, v: &[f64], dv: &mut [f64]) {
    let push = [6.0 + f64::from(HUNDREDTHS) / 100.0, f64::from(ACROSS) * t];
    // That direction, from its first one on.
    let across = v[0] * v[1] / (v[0] * v[0] + 1e-30);
    let size = 1.0_f64.hypot(across);
    dv[0] = (push[0] - 6.0 / size) / 2.0;
    dv[1] = (push[1] - 6.0 * across / size) / 2.0;
}

/// A mass that is held by nothing, pushed with t^1.5 and t^0.5.
fn pushed_by_powers(t: f64, _: &[f64], dy: &mut [f64]) {
    dy[0] = t.max(0.0).powf(1.5);
    dy[1] = t.max(0.0).sqrt();
}

/// A mass of 1 kg that meets Hertz's contact with 1 m/s, along y[0].
fn touches(_: f64, y: &[f64], dy: &mut [f64]) {
    dy[0] = y[1];
    dy[1] = -1e4 * y[0].max(0.0).powf(1.5);
}

/// Errors of samples, in tolerances, that are expected of every method's interpolation: the session asks for a fifth of what a scene does.
const WITHIN: f64 = 5.0;

/// The largest error at samples in the first milliseconds, in tolerances, and the work. Those samples are held against ends of steps of
/// runs that end there, at a tolerance that is smaller by a thousand.
fn first_samples(rhs: Rhs, start: [f64; 2], tolerance: f64) -> (f64, Counters) {
    let options = Options::default();
    let times: Vec<f64> = (0..40).map(|k| 1e-6 * 1.25_f64.powi(k)).collect();
    let mut sampled = Probe::new(rhs, 2, tolerance);
    let outcome = run(&mut dop853(), &mut sampled, &mut start.clone(), 0.3, &times, &options);
    assert!(matches!(outcome.status, Status::Completed));
    let mut worst = 0.0_f64;
    for (time, state) in &sampled.samples {
        let mut y = start;
        run(&mut dop853(), &mut Probe::new(rhs, 2, 1e-3 * tolerance), &mut y, *time, &[], &options);
        worst = worst.max(distance(state, &y) / tolerance);
    }
    (worst, outcome.counters)
}

#[test]
fn samples_within_the_first_step_are_as_good_as_its_end() {
    let cases: [(&str, Rhs, [f64; 2]); 7] = [
        ("slides by 0.3 N", begins_to_slide::<30, -12>, [0.0; 2]),
        ("by 1 N", begins_to_slide::<100, 30>, [0.0; 2]),
        ("by 2 N", begins_to_slide::<200, -12>, [0.0; 2]),
        ("by 2 N, turns fast", begins_to_slide::<200, 200>, [0.0; 2]),
        ("by 14 N", begins_to_slide::<1400, 100>, [0.0; 2]),
        ("powers", pushed_by_powers, [0.0; 2]),
        ("Hertz", touches, [0.0, 1.0]),
    ];
    let mut failed = Vec::new();
    for (name, rhs, start) in cases {
        for tolerance in [1e-6, 1e-8, 1e-10] {
            let (worst, counters) = first_samples(rhs, start, tolerance);
            let Counters { steps, rejected, evaluations, .. } = counters;
            println!(
                "{name}, {tolerance:e}: {worst:.2}, {steps} steps, {rejected} rejected, {evaluations} evaluations, {} to samples",
                counters.recoveries.sample_step
            );
            failed.extend((worst > WITHIN).then(|| format!("{name}, {tolerance:e}: {worst:.2}")));
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn smooth_beginnings_are_interpolated() {
    for tolerance in [1e-6, 1e-8, 1e-10] {
        let (worst, counters) = first_samples(oscillator, [1.0, 0.5], tolerance);
        assert_eq!(counters.recoveries.sample_step, 0, "{tolerance:e}");
        assert!(worst < WITHIN, "{tolerance:e}: {worst}");
    }
}
