//! Motions that the time determines.

use super::*;
use crate::integrate::Kinematic;

/// On the curve (sin t, cos 2 t), with the area under its speed as a sum beside it.
fn rates(t: f64, y: &[f64], dy: &mut [f64]) {
    // Faster on another branch.
    dy[0] = t.cos() + (y[0] - t.sin());
    dy[1] = -2.0 * (2.0 * t).sin();
    // A sum that the state says nothing about.
    dy[2] = y[0] * dy[0];
}

struct Driven {
    probe: Probe,
    /// Another branch is nearest to states further off than this.
    reach: f64,
}

impl System for Driven {
    fn dim(&self) -> usize {
        3
    }
    fn rhs(&mut self, t: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        self.probe.rhs(t, y, dy)
    }
    fn error_norm(&mut self, y0: &[f64], y1: &[f64], error: &[f64]) -> f64 {
        self.probe.error_norm(y0, y1, &[error[0], error[1], 0.0])
    }
    fn project(&mut self, t: f64, y: &mut [f64]) -> Result<(), Failure> {
        let exact = t.sin();
        let off = (y[0] - exact).abs();
        y[0] = if off > self.reach { exact + 5.0 } else { exact };
        y[1] = (2.0 * t).cos();
        Ok(())
    }
    fn sample(&mut self, t: f64, y: &[f64]) -> Result<(), Failure> {
        self.probe.sample(t, y)
    }
    fn accept(&mut self, t: f64, y: &mut [f64]) -> Result<Accepted, Failure> {
        self.probe.accept(t, y)
    }
    fn step_done(&mut self, t: f64, y: &[f64], h: f64) -> Flow {
        self.probe.step_done(t, y, h)
    }
}

fn go(tolerance: f64, reach: f64, options: &Options) -> (Outcome, [f64; 3], Driven) {
    let mut system = Driven { probe: Probe::new(rates, 3, tolerance), reach };
    let mut y = [0.0, 1.0, 0.0];
    let span = Span { t_start: 0.0, t_end: 10.0, sample_times: &[0.0, 3.3, 10.0] };
    let outcome = Kinematic::default().integrate(&mut system, &mut y, &span, options).unwrap();
    (outcome, y, system)
}

#[test]
fn what_is_known_is_exact_and_sums_are_as_good_as_asked() {
    for tolerance in [1e-4, 1e-8, 1e-12] {
        let (outcome, y, system) = go(tolerance, f64::INFINITY, &Options::default());
        assert!(matches!(outcome.status, Status::Completed));
        assert_eq!((y[0], y[1]), (10.0_f64.sin(), 20.0_f64.cos()));
        let off = (y[2] - 0.5 * y[0] * y[0]).abs();
        assert!(off < 20.0 * tolerance.max(1e-15), "{tolerance}: {off:e}");
        assert_eq!(system.probe.sample_times(), [0.0, 3.3, 10.0]);
        let counters = &outcome.counters;
        assert_eq!(counters.evaluations, 1 + 5 * (counters.steps + counters.rejected));
        assert_eq!(counters.projections, 6 * (counters.steps + counters.rejected));
    }
}

#[test]
fn the_rule_is_of_order_ten() {
    let error = |h: f64| {
        let options = Options { max_step: Some(h), first_step: Some(h), ..Options::default() };
        let (_, y, _) = go(1e3, f64::INFINITY, &options);
        (y[2] - 0.5 * y[0] * y[0]).abs()
    };
    let found = order(error(2.0), error(1.0));
    assert!((9.0..12.5).contains(&found), "{found}");
}

#[test]
fn a_jump_to_another_branch_is_no_step() {
    let options = Options { first_step: Some(2.0), ..Options::default() };
    let (outcome, y, _) = go(1e-3, 0.001, &options);
    assert!(outcome.counters.rejected > 0);
    assert_eq!(y[0], 10.0_f64.sin());
}

#[test]
fn a_time_that_cannot_be_passed_ends_the_run() {
    let mut system = Driven { probe: Probe::new(rates, 3, 1e-6), reach: f64::INFINITY };
    system.probe.wall = 4.0;
    let mut y = [0.0, 1.0, 0.0];
    let span = Span { t_start: 0.0, t_end: 10.0, sample_times: &[] };
    let outcome = Kinematic::default().integrate(&mut system, &mut y, &span, &Options::default()).unwrap();
    let Status::StoppedEarly { t, reason: StopReason::Failed { .. } } = outcome.status else { panic!() };
    assert!(t < 4.0 && t > 3.9, "{t}");
    assert_eq!(y[0], t.sin());
}
