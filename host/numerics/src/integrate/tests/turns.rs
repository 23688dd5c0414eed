//! Angles that are counted from references: looked at closely only where they may go half a turn.

use super::super::*;
use crate::interval::{Interval, Range};

/// Turns at a constant speed; the reference follows where a step has led farther than 1 rad from it.
struct Wheel {
    reference: f64,
    /// The largest distances from the reference that were reached.
    farthest: f64,
}

impl System for Wheel {
    fn dim(&self) -> usize {
        2
    }
    fn rhs(&mut self, _: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        dy.copy_from_slice(&[y[1], 0.0]);
        Ok(())
    }
    fn error_norm(&mut self, _: &[f64], _: &[f64], error: &[f64]) -> f64 {
        error.iter().fold(0.0, |most: f64, e| most.max(e.abs())) / 1e-6
    }
    fn guards(&self) -> Guards {
        let turns = GuardSet { guards: vec![Guard::Turn], entries: vec![0], proved: true };
        Guards { turns, ..Guards::default() }
    }
    fn enclose(
        &mut self,
        _: Watched,
        _: Range,
        entry: &dyn Fn(usize) -> Range,
        _: &dyn Fn(usize) -> bool,
        found: &mut [Range],
    ) {
        let Range { value, slope, middle } = entry(0);
        let by = Interval::point(self.reference);
        found[0] = Range { value: value - by, slope, middle: middle - self.reference };
    }
    fn values(&mut self, _: Watched, _: f64, entry: &dyn Fn(usize) -> f64, found: &mut [f64]) {
        found[0] = entry(0) - self.reference;
    }
    fn turning(&self, y: &[f64]) -> f64 {
        y[1].abs()
    }
    fn accept(&mut self, _: f64, y: &mut [f64]) -> Result<Accepted, Failure> {
        let off = y[0] - self.reference;
        self.farthest = self.farthest.max(off.abs());
        if off.abs() > 1.0 {
            self.reference = y[0];
        }
        Ok(Accepted::Unchanged)
    }
}

/// A turn from an angle by another one, tried in one step: how far the reference was left behind, steps, steps looked at closely.
fn turned(from: f64, by: f64) -> (f64, usize, usize) {
    let mut system = Wheel { reference: 0.0, farthest: 0.0 };
    let span = Span { t_start: 0.0, t_end: 1.0, sample_times: &[] };
    let options = Options { first_step: Some(1.0), ..Options::default() };
    let mut y = [from, by];
    let outcome = dop853().integrate(&mut system, &mut y, &span, &options).unwrap();
    assert!(matches!(outcome.status, Status::Completed) && (y[0] - from - by).abs() < 1e-12);
    (system.farthest, outcome.counters.steps, outcome.counters.enclosed)
}

#[test]
fn a_step_is_looked_at_where_what_is_left_to_half_a_turn_may_not_do() {
    // Wherever the angle is, and where it is near its reference.
    for (from, by) in [(0.0, 1.4), (1.0, 1.4), (-1.0, -1.4), (0.0, 2.1), (0.2, -1.9), (-0.5, 1.8)] {
        let (farthest, steps, looked_at) = turned(from, by);
        assert_eq!((steps, looked_at), (1, 0), "{from} {by}");
        assert!(farthest < 2.8);
    }
    // Looked at, and found to do.
    for (from, by) in [(1.0, 1.7), (-1.0, 3.0), (0.0, 2.5), (0.3, -2.4)] {
        assert_eq!(turned(from, by).1, 1, "{from} {by}");
        assert!(turned(from, by).2 > 0, "{from} {by}");
    }
    // Too far for one step.
    for (from, by) in [(1.0, 2.0), (0.0, 3.0), (0.0, 40.0), (-0.9, -7.0), (0.5, f64::from(1 << 8))] {
        let (farthest, steps, looked_at) = turned(from, by);
        assert!(steps > 1 && looked_at > 0 && farthest <= 2.8, "{from} {by}: {farthest}");
    }
}
