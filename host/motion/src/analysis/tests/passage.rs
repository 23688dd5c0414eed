//! Interpolation through a singular position against the functions it goes through.

use super::super::passage::{Passage, Passing, Way, try_rates};
use super::*;

/// A point on a line, `(x, v)`, singular at `x = 0.02`. Remembers how near it was asked.
struct Line {
    nearest: f64,
    drives: &'static str,
}

const SINGULAR: f64 = 0.02;

impl Passing for Line {
    fn fastest(&self, state: &[f64]) -> f64 {
        state[1].abs()
    }

    fn shift(&self, state: &[f64], s: f64, moved: &mut [f64]) {
        moved.copy_from_slice(&[state[0] + s * state[1], state[1]]);
    }

    fn share(&mut self, _: f64, state: &[f64]) -> Result<f64, AnalysisError> {
        Ok((state[0] - SINGULAR).abs())
    }

    fn missed(&mut self, _: f64, _: &mut [f64]) -> Result<f64, AnalysisError> {
        Ok(0.0)
    }

    fn drives(&mut self, _: f64, _: &[f64]) -> Result<String, AnalysisError> {
        Ok(self.drives.into())
    }
}

#[test]
fn what_is_smooth_is_found_from_both_sides() {
    for velocity in [-7.0, 0.3] {
        for x in [SINGULAR, SINGULAR + 1e-9, SINGULAR - 0.02, SINGULAR + 0.04] {
            let mut line = Line { nearest: 1.0, drives: "" };
            let mut found = [0.0; 2];
            let mut passage = Passage::new(2, 2);
            let passed = passage.interpolate(&mut line, 3.0, &[x, velocity], &mut found, |line, t, place, answer| {
                line.nearest = line.nearest.min((place[0] - SINGULAR).abs());
                // The nearest singularity in the complex plane is at a distance of 1.
                answer.copy_from_slice(&[1.0 / (1.0 + (place[0] - SINGULAR).powi(2)), t]);
                Ok(())
            });
            assert_eq!(passed.unwrap(), Way::Through);
            let off = (found[0] - 1.0 / (1.0 + (x - SINGULAR).powi(2))).abs();
            assert!(off < 3e-11, "{off:e} at {x}");
            assert!((found[1] - 3.0).abs() < 1e-13, "time {}", found[1]);
            assert!(line.nearest > 0.041, "asked at {}", line.nearest);
        }
    }
}

#[test]
fn what_does_not_move_does_not_pass() {
    let mut found = [0.0; 2];
    let never = |_: &mut Line, _: f64, _: &mut [f64], _: &mut [f64]| panic!("asked");
    let mut line = Line { nearest: 1.0, drives: "" };
    let passed = Passage::new(2, 2).interpolate(&mut line, 0.0, &[SINGULAR, 0.0], &mut found, never);
    assert_eq!(passed.unwrap(), Way::Past);
}

#[test]
fn what_time_alone_bars_is_out_of_reach() {
    let meet = |_: &mut Line, t: f64, _: &mut [f64], _: &mut [f64]| {
        let missed = AnalysisError::LeftConstraints { what: "C: x".into(), violation: 1.0 };
        if t > 3.0 { Err(missed) } else { Ok(()) }
    };
    let never = |_: &mut Line, _: f64, _: &mut [f64], _: &mut [f64]| {
        Err(AnalysisError::LeftConstraints { what: "C: x".into(), violation: 1.0 })
    };
    let mut found = [0.0; 2];
    // Farther away there is time to be made use of; what nothing drives turns.
    for (drives, distance) in [("motor: angle", 1e-2), ("", 1e-6)] {
        let (mut line, state) = (Line { nearest: 1.0, drives }, [SINGULAR - distance, 1.0]);
        let way = Passage::new(2, 2).interpolate(&mut line, 3.0, &state, &mut found, meet);
        assert_eq!(way.unwrap(), Way::Round);
    }
    let (mut line, state) = (Line { nearest: 1.0, drives: "motor: angle" }, [SINGULAR - 1e-6, 1.0]);
    let way = Passage::new(2, 2).interpolate(&mut line, 3.0, &state, &mut found, never);
    assert_eq!(way.unwrap(), Way::Round);
    let error = Passage::new(2, 2).interpolate(&mut line, 3.0, &state, &mut found, meet).unwrap_err();
    assert!(error.to_string().starts_with("motor: angle asks for more than can be reached"), "{error}");
}

#[test]
fn a_flat_four_bar_accelerates_as_its_neighbours_do() {
    // Interpolated next to the flat position, solved where that is sound: a parallelogram with its cranks at an angle q moves
    // like one mass, q'' = -(m_left + m_right) / 2 + m_coupler over (2 J + m_coupler) g cos q.
    let mut stand = stand(&scenes::four_bar(1.1));
    for (angle, bound) in [(0.3, 1e-11), (0.1, 1e-10), (0.03, 2e-8), (1e-3, 2e-8), (1e-7, 2e-8), (-0.02, 2e-8)] {
        let mut state = prepared(&scenes::four_bar(1.1)).assembly.working;
        let (s, c) = f64::sin_cos(angle);
        let (turn, cranks) = (f64::sin_cos(0.5 * angle), [[0.0, 0.0], [1.0, 0.0]]);
        for (body, [x, y]) in cranks.into_iter().enumerate() {
            let at = 13 * body;
            state[at..at + 7].copy_from_slice(&[x + 0.5 * c, y + 0.5 * s, 0.0, turn.1, 0.0, 0.0, turn.0]);
            state[at + 7..at + 13].copy_from_slice(&[-s, c, 0.0, 0.0, 0.0, 2.0]);
        }
        state[26..33].copy_from_slice(&[0.5 + c, s, 0.0, 1.0, 0.0, 0.0, 0.0]);
        state[33..39].copy_from_slice(&[-2.0 * s, 2.0 * c, 0.0, 0.0, 0.0, 0.0]);
        stand.form.next_step(TIME, &state).unwrap();
        let mut rates = vec![0.0; state.len()];
        stand.form.rates(TIME, &state, &mut rates).unwrap();
        let (mass, inertia) = (1.5, 0.1 + 1.5 * 0.25);
        let expected = -2.0 * mass * 9.81 * c / (2.0 * inertia + mass);
        for at in [12, 25] {
            let off = (rates[at] - expected).abs();
            assert!(off < bound, "{angle}: {} is off by {off:e}", rates[at]);
        }
        stand.form.certify(TIME, &state).unwrap();
        // Accelerations that no constraint speaks against, but the power does; and those of one crank.
        let along: Vec<usize> = (0..3).flat_map(|body| (13 * body + 7)..(13 * body + 13)).collect();
        for (entries, blamed) in [(&along[..], "power"), (&[12][..], "joint")] {
            let mut wrong = rates.clone();
            entries.iter().for_each(|at| wrong[*at] += 1e-5 * state[*at]);
            let error = try_rates(&mut stand.form, TIME, &state, &wrong).unwrap_err();
            let AnalysisError::Uncertified { what, share, .. } = &error else { panic!("{error}") };
            assert!((1e-7..1e-4).contains(share) && (blamed == "power") == what.contains("power"), "{angle}: {error}");
        }
        let inputs = stand.inputs(&state);
        let off = (stand.accelerations(&inputs)[5] - expected).abs();
        assert!(off < bound, "{angle}: reported off by {off:e}");
        let mut projected = state.clone();
        stand.form.project(TIME, &mut projected).unwrap();
        assert!(difference(&projected, &state) < bound, "{angle}: moved by {:e}", difference(&projected, &state));
    }
    // Rates and reports, at the two nearest at least.
    assert!(stand.form.counters().interpolated >= 4, "{:?}", stand.form.counters());
}
