//! Integrations that end where a quantity becomes negative.

use super::super::*;

/// A body that falls: y'' = -1; the integration ends where its height, how far it is below a ceiling, or what is left of a time
/// becomes negative.
struct Fall {
    accepted: Vec<f64>,
    until: f64,
}

impl System for Fall {
    fn dim(&self) -> usize {
        2
    }
    fn rhs(&mut self, _: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        dy.copy_from_slice(&[y[1], -1.0]);
        Ok(())
    }
    fn error_norm(&mut self, _: &[f64], _: &[f64], error: &[f64]) -> f64 {
        error.iter().fold(0.0, |most: f64, e| most.max(e.abs())) / 1e-10
    }
    fn stops(&self) -> usize {
        3
    }
    fn stopping(&mut self, t: f64, y: &[f64], values: &mut [f64]) -> Result<(), Failure> {
        values.copy_from_slice(&[y[0], 1.0 - y[0], self.until - t]);
        Ok(())
    }
    fn step_done(&mut self, t: f64, _: &[f64], _: f64) -> Flow {
        self.accepted.push(t);
        Flow::Continue
    }
}

/// Where it ends from a height and a speed: time, height, and whether for a stop.
fn end_of(method: &str, height: f64, speed: f64, t_end: f64) -> (f64, f64, bool) {
    end_until(100.0, method, height, speed, t_end)
}

/// The same with an end of the time.
fn end_until(until: f64, method: &str, height: f64, speed: f64, t_end: f64) -> (f64, f64, bool) {
    let mut system = Fall { accepted: Vec::new(), until };
    let mut y = [height, speed];
    let span = Span { t_start: 0.0, t_end, sample_times: &[] };
    let outcome = by_name(method).unwrap().integrate(&mut system, &mut y, &span, &Options::default()).unwrap();
    let stopped = matches!(outcome.status, Status::StoppedEarly { reason: StopReason::Event, .. });
    let last = system.accepted.last().copied().unwrap_or(0.0);
    assert!(stopped || last == t_end);
    (last, y[0], stopped)
}

#[test]
fn they_end_there_to_round_off() {
    for method in ["dop853", "dopri5", "radau5", "radau9", "auto"] {
        let (t, y, stopped) = end_of(method, 0.5, 0.0, 10.0);
        assert!(stopped && (t - 1.0).abs() < 1e-12 && y.abs() < 1e-12, "{method}: {t} {y}");
        // A start at zero, on the way up, is none; what comes down again ends where it was.
        let (t, y, stopped) = end_of(method, 0.0, 0.1, 10.0);
        assert!(stopped && (t - 0.2).abs() < 1e-12 && y.abs() < 1e-12, "{method}: {t} {y}");
        // The first of two: the ceiling.
        let (t, y, stopped) = end_of(method, 0.5, 2.0, 10.0);
        let expected = 2.0 - 3.0_f64.sqrt();
        assert!(stopped && (t - expected).abs() < 1e-12 && (y - 1.0).abs() < 1e-12, "{method}: {t} {y}");
        // None of them.
        assert!(!end_of(method, 0.5, 0.0, 0.9).2, "{method}");
    }
}

#[test]
fn a_start_on_the_way_down_ends_at_once() {
    let (t, y, stopped) = end_of("dop853", 0.0, -0.1, 1.0);
    assert!(stopped && t < 1e-11 && y.abs() < 1e-12, "{t} {y}");
}

#[test]
fn what_is_just_below_zero_may_rise() {
    let (t, y, stopped) = end_of("dop853", -1e-15, 0.1, 1.0);
    assert!(stopped && (t - 0.2).abs() < 1e-12 && y.abs() < 1e-12, "{t} {y}");
}

/// What rests, so that steps may have any size, under a load over time; a support holds it up to a limit.
struct Rest {
    speed: f64,
    phase: f64,
    limit: f64,
    size: f64,
}

impl System for Rest {
    fn dim(&self) -> usize {
        1
    }
    fn rhs(&mut self, _: f64, _: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        dy.fill(0.0);
        Ok(())
    }
    fn error_norm(&mut self, _: &[f64], _: &[f64], _: &[f64]) -> f64 {
        0.0
    }
    fn stops(&self) -> usize {
        1
    }
    fn stopping(&mut self, t: f64, _: &[f64], values: &mut [f64]) -> Result<(), Failure> {
        values[0] = self.size * (self.limit - (self.speed * t + self.phase).sin());
        Ok(())
    }
}

#[test]
fn what_rests_stops_at_the_first_load_beyond_its_limit() {
    let mut missed = Vec::new();
    for method in ["dop853", "radau5"] {
        for k in 0..1000 {
            let share = |number: usize| (number * k % 997) as f64 / 997.0;
            let speed = 0.3 * 100.0_f64.powf(share(31));
            let (phase, limit) = (-6.0 * share(17) - 0.2, 0.1 + 0.89 * share(59));
            let mut system = Rest { speed, phase, limit, size: 1e4_f64.powf(share(43) - 0.5) };
            let span = Span { t_start: 0.0, t_end: 10.0, sample_times: &[] };
            let outcome =
                by_name(method).unwrap().integrate(&mut system, &mut [0.0], &span, &Options::default()).unwrap();
            let first = limit.asin();
            let turns = ((phase - first) / std::f64::consts::TAU).ceil();
            let expected = (first + turns * std::f64::consts::TAU - phase) / speed;
            let starts_beyond = phase.sin() > limit;
            let found = match outcome.status {
                Status::StoppedEarly { reason: StopReason::Event, t } => t,
                _ => f64::INFINITY,
            };
            let is_right = (expected >= 10.0 && found.is_infinite()) || (found - expected).abs() < 1e-9;
            if !is_right && !starts_beyond {
                missed.push(format!("{method} {k}: {found} in place of {expected}, limit {limit}, speed {speed}"));
            }
        }
    }
    assert!(missed.is_empty(), "{} missed:\n{}", missed.len(), missed.join("\n"));
}

/// What rises behind a stop is looked at as it is before that.
#[test]
fn what_is_just_below_zero_does_not_hide_another_stop() {
    for method in ["dop853", "dopri5", "radau5"] {
        let (t, y, stopped) = end_until(1e-11, method, -5e-14, 1e-3, 1.0);
        assert!(stopped && (t - 1e-11).abs() < 1e-14 && y < 0.0, "{method}: {t:e} {y:e}");
    }
}

/// What slows down, and the more so as soon as it goes backwards; the integration ends at a time.
struct Turning {
    until: f64,
}

impl System for Turning {
    fn dim(&self) -> usize {
        1
    }
    fn rhs(&mut self, _: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        dy[0] = -3.0 + 2.0 * y[0].min(0.0);
        Ok(())
    }
    fn error_norm(&mut self, _: &[f64], _: &[f64], error: &[f64]) -> f64 {
        error[0].abs() / 1e-10
    }
    fn conditions(&self) -> usize {
        1
    }
    fn switching(&mut self, _: f64, y: &[f64], values: &mut [f64]) -> Result<(), Failure> {
        values[0] = y[0];
        Ok(())
    }
    fn stops(&self) -> usize {
        1
    }
    fn stopping(&mut self, t: f64, _: &[f64], values: &mut [f64]) -> Result<(), Failure> {
        values[0] = self.until - t;
        Ok(())
    }
}

/// A step that ends short of a switch is continued across it, but not across a stop before the switch.
#[test]
fn they_end_there_short_of_a_switch_too() {
    for method in ["dop853", "dopri5", "radau5", "radau9", "auto"] {
        for between in (0..400).map(|k| 0.5 * 0.95_f64.powi(k)) {
            let mut system = Turning { until: 0.5 };
            let span = Span { t_start: 0.0, t_end: 1.5, sample_times: &[] };
            let mut y = [3.0 * (0.5 + between)];
            let outcome = by_name(method).unwrap().integrate(&mut system, &mut y, &span, &Options::default()).unwrap();
            let Status::StoppedEarly { reason: StopReason::Event, t } = outcome.status else { panic!("{method}") };
            assert!((t - 0.5).abs() < 1e-12 && (y[0] - 3.0 * between).abs() < 1e-11, "{method} {between:e}: {t} {y:?}");
        }
    }
}
