//! How steps begin: every one is announced before its errors are asked about, and the first is no shorter than time can tell.

use super::fixtures::{Probe, Rhs, distance, smooth};
use crate::integrate::{Accepted, Failure, Flow, Options, Span, Status, System, by_name};

/// Records the steps that are announced, and counts the errors asked about in each.
struct Announced {
    probe: Probe,
    /// Beginning and size, and the questions about errors from there on.
    steps: Vec<(f64, f64, usize)>,
    now: f64,
}

impl System for Announced {
    fn dim(&self) -> usize {
        self.probe.dim()
    }

    fn rhs(&mut self, t: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        self.probe.rhs(t, y, dy)
    }

    fn begin_step(&mut self, t: f64, y: &[f64], h: f64) {
        assert!(y.iter().all(|value| value.is_finite()) && h > 0.0);
        self.steps.push((t, h, 0));
    }

    fn error_norm(&mut self, y0: &[f64], y1: &[f64], error: &[f64]) -> f64 {
        if let Some((t, _, asked)) = self.steps.last_mut() {
            assert_eq!(*t, self.now, "errors are those of steps from the last accepted state");
            *asked += 1;
        }
        self.probe.error_norm(y0, y1, error)
    }

    fn accept(&mut self, t: f64, _y: &mut [f64]) -> Result<Accepted, Failure> {
        let (from, h, asked) = self.steps[self.steps.len() - 1];
        assert!((from + h - t).abs() <= 1e-15 * t.abs() && asked > 0, "{from} {h} {t} {asked}");
        Ok(Accepted::Unchanged)
    }

    fn step_done(&mut self, t: f64, _y: &[f64], _h: f64) -> Flow {
        self.now = t;
        Flow::Continue
    }
}

#[test]
fn every_step_is_announced_with_its_size() {
    for name in ["dop853", "dopri5", "radau5", "radau9", "auto"] {
        let mut system = Announced { probe: Probe::new(smooth, 3, 1e-8), steps: Vec::new(), now: 0.0 };
        let span = Span { t_start: 0.0, t_end: 7.0, sample_times: &[] };
        let mut y = [1.0, 1.0, 0.0];
        let outcome = by_name(name).unwrap().integrate(&mut system, &mut y, &span, &Options::default()).unwrap();
        assert_eq!(system.steps.len(), outcome.counters.steps + outcome.counters.rejected, "{name}");
    }
}

#[test]
fn a_state_of_round_off_begins_as_one_of_zero() {
    // A mass of 1 kg that a force of 1 kN pulls from where it is, far from time zero. A hundredth of round-off is no step.
    let pulled: Rhs = |_, y, dy| dy.copy_from_slice(&[y[1], 1e3 * (1.0 - y[0])]);
    let run = |from: f64, start: f64| {
        let mut probe = Probe::new(pulled, 2, 1e-11);
        let mut y = [from, 0.0];
        let span = Span { t_start: start, t_end: start + 1.0, sample_times: &[] };
        let outcome = by_name("dop853").unwrap().integrate(&mut probe, &mut y, &span, &Options::default()).unwrap();
        assert!(matches!(outcome.status, Status::Completed), "{from} {start} {:?}", outcome.status);
        let exact = 1.0 - 1e3_f64.sqrt().cos();
        // Times of the size of the start have so many digits.
        assert!((y[0] - exact).abs() < 1e-8 + 1e2 * f64::EPSILON * start, "{from} {start} {}", y[0] - exact);
        outcome.counters.steps
    };
    for start in [0.0, 1.0, 1e6] {
        let steps = [0.0, 1e-15, 1e-13, 1e-11].map(|from| run(from, start));
        assert!(steps.iter().all(|more| *more <= steps[0] + 12), "{start}: {steps:?}");
    }
}

/// Something at rest, and in its place but for round-off, begins to move.
#[test]
fn a_state_that_is_round_off_does_not_decide_how_long_the_first_step_is() {
    let falling: Rhs = |_, y, dy| dy.copy_from_slice(&[y[1], 1.0]);
    for name in ["dop853", "dopri5", "radau5", "radau9", "auto"] {
        for [place, tolerance] in [[1e-17, 1e-11], [-3e-17, 1e-12], [1e-16, 1e-13]] {
            let mut probe = Probe::new(falling, 2, tolerance);
            let mut y = [place, 0.0];
            let span = Span { t_start: 1.0, t_end: 3.0, sample_times: &[] };
            let outcome = by_name(name).unwrap().integrate(&mut probe, &mut y, &span, &Options::default()).unwrap();
            assert!(
                matches!(outcome.status, Status::Completed),
                "{name} {place:e} {tolerance:e}: {:?}",
                outcome.status
            );
            assert!(distance(&y, &[2.0, 2.0]) < 100.0 * tolerance, "{name} {place:e} {tolerance:e}: {y:?}");
            assert!(outcome.counters.steps < 40, "{name}: {:?}", outcome.counters);
        }
    }
}
