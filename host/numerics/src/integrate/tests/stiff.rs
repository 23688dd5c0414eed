//! The implicit method, the explicit pair of order 5, stiffness detection, and the choice between methods.

use super::*;

/// Van der Pol's oscillator, `y1'' = ((1 - y1^2) y1' - y1) / 1e-6`.
fn van_der_pol(_t: f64, y: &[f64], dy: &mut [f64]) {
    dy[0] = y[1];
    dy[1] = ((1.0 - y[0] * y[0]) * y[1] - y[0]) / 1e-6;
}

fn van_der_pol_jacobian(_t: f64, y: &[f64], matrix: &mut [f64]) {
    matrix.copy_from_slice(&[0.0, (-2.0 * y[0] * y[1] - 1.0) / 1e-6, 1.0, (1.0 - y[0] * y[0]) / 1e-6]);
}

/// At t = 2 from (2, 0): Mazzia & Magherini, "Test Set for Initial Value Problem Solvers", 2008, problem vdpol.
const VAN_DER_POL_END: [f64; 2] = [1.706167732170469, -0.8928097010248125];

/// Robertson's reaction (Hairer & Wanner II, eq. IV.1.4).
fn robertson(_t: f64, y: &[f64], dy: &mut [f64]) {
    let (slow, fast, both) = (0.04 * y[0], 3e7 * y[1] * y[1], 1e4 * y[1] * y[2]);
    dy[0] = both - slow;
    dy[1] = slow - both - fast;
    dy[2] = fast;
}

/// At t = 40 from (1, 0, 0), to the digits that runs with tolerances 1e-11 and 1e-12 agree in.
const ROBERTSON_END: [f64; 3] = [0.7158270688, 9.185534765e-6, 0.2841637457];

/// `y' = -1e4 (y - cos t) - sin t` with the solution cos t (after Prothero & Robinson 1974), and an oscillator beside it.
pub fn prothero(t: f64, y: &[f64], dy: &mut [f64]) {
    dy[0] = -1e4 * (y[0] - t.cos()) - t.sin();
    dy[1] = y[2];
    dy[2] = -y[1];
}

pub fn prothero_solution(t: f64) -> [f64; 3] {
    [t.cos(), t.cos(), -t.sin()]
}

pub fn van_der_pol_run(name: &str, tolerance: f64, exact: bool) -> (f64, Counters) {
    let mut probe = Probe::new(van_der_pol, 2, tolerance);
    probe.jacobian = exact.then_some(van_der_pol_jacobian);
    let mut y = [2.0, 0.0];
    let mut method = by_name(name).unwrap();
    let outcome = run(method.as_mut(), &mut probe, &mut y, 2.0, &[], &Options::default());
    assert!(matches!(outcome.status, Status::Completed), "{:?}", outcome.status);
    (distance(&y, &VAN_DER_POL_END), outcome.counters)
}

#[test]
fn dopri5_fulfils_its_order_conditions() {
    use crate::integrate::dopri5::{A, B, C, E};
    let moment = |row: &[(usize, f64)], power: i32| -> f64 { row.iter().map(|&(j, a)| a * C[j].powi(power)).sum() };
    for (i, row) in A.iter().enumerate() {
        assert!((moment(row, 0) - C[i]).abs() < 1e-14, "row sum of stage {i}");
    }
    for power in 0..5 {
        assert!((moment(B, power) - 1.0 / f64::from(power + 1)).abs() < 1e-15, "power {power}");
        assert_eq!(moment(E, power).abs() < 1e-15, power < 4, "power {power}");
    }
}

#[test]
fn dopri5_has_order_five_and_interpolates_with_order_four() {
    let mut method = dopri5();
    let (coarse, fine) = (errors(&mut method, 4.0, 0.1), errors(&mut method, 4.0, 0.05));
    let end = order(coarse.0, fine.0);
    assert!((4.7..5.6).contains(&end), "{end}");
    // One step: one order more.
    let (coarse, fine) = (errors(&mut method, 0.2, 0.2), errors(&mut method, 0.1, 0.1));
    let inside = order(coarse.1, fine.1);
    assert!((4.6..5.6).contains(&inside), "{inside}");
}

#[test]
fn dopri5_on_the_arenstorf_orbit_is_pinned() {
    let mut probe = Probe::new(arenstorf, 4, 1e-7);
    let mut y = ARENSTORF_START.to_vec();
    let outcome = run(&mut dopri5(), &mut probe, &mut y, ARENSTORF_PERIOD, &[], &Options::default());
    let counters = outcome.counters;
    assert!(distance(&y, &ARENSTORF_START) < 1e-2);
    // One at the start, one for the first step, six a try: the last of a step is the first of the next.
    assert_eq!(counters.evaluations, 2 + 6 * (counters.steps + counters.rejected));
    assert_eq!((counters.steps, counters.rejected), (252, 5));
}

#[test]
fn projection_costs_dopri5_one_evaluation_a_step() {
    let counters = |projection: Option<fn(&mut [f64])>| {
        let mut probe = Probe::new(oscillator, 2, 1e-5);
        probe.projection = projection;
        run(&mut dopri5(), &mut probe, &mut [1.0, 0.0], 10.0, &[], &Options::default()).counters
    };
    let (free, held) = (
        counters(None),
        counters(Some(|y| {
            let radius = y[0].hypot(y[1]);
            y.iter_mut().for_each(|value| *value /= radius);
        })),
    );
    assert_eq!(free.evaluations, 2 + 6 * (free.steps + free.rejected));
    assert_eq!(held.evaluations, 2 + 6 * (held.steps + held.rejected) + held.steps);
}

#[test]
fn radau5_has_order_five_and_interpolates_with_order_three() {
    let mut method = Radau5::default();
    let (coarse, fine) = (errors(&mut method, 4.0, 0.2), errors(&mut method, 4.0, 0.1));
    let end = order(coarse.0, fine.0);
    assert!((4.7..5.5).contains(&end), "{end}");
    let (coarse, fine) = (errors(&mut method, 0.4, 0.4), errors(&mut method, 0.2, 0.2));
    let inside = order(coarse.1, fine.1);
    assert!((3.6..4.6).contains(&inside), "{inside}");
}

/// The same with an entry that changes nothing but the pattern: the first row is not that of a position any more.
fn van_der_pol_jacobian_unhalved(t: f64, y: &[f64], matrix: &mut [f64]) {
    van_der_pol_jacobian(t, y, matrix);
    matrix[0] = f64::MIN_POSITIVE;
}

#[test]
fn halved_matrices_give_the_steps_of_whole_ones() {
    for name in ["radau5", "radau9"] {
        let end = |jacobian: fn(f64, &[f64], &mut [f64])| {
            let mut probe = Probe::new(van_der_pol, 2, 1e-8);
            probe.jacobian = Some(jacobian);
            let mut y = [2.0, 0.0];
            let mut method = by_name(name).unwrap();
            let outcome = run(method.as_mut(), &mut probe, &mut y, 2.0, &[], &Options::default());
            (y, outcome.counters)
        };
        let ((halved, work), (whole, other)) = (end(van_der_pol_jacobian), end(van_der_pol_jacobian_unhalved));
        assert_eq!((work.steps, work.newton_iterations), (other.steps, other.newton_iterations), "{name}");
        let difference = distance(&halved, &whole);
        assert!(difference < 1e-11, "{name}: {difference:e}");
    }
}

#[test]
fn radau9_has_order_nine_and_interpolates_with_order_five() {
    let mut method = Radau9::default();
    let (coarse, fine) = (errors(&mut method, 4.0, 4.0 / 6.0), errors(&mut method, 4.0, 0.5));
    let end = order(coarse.0, fine.0) / order(4.0 / 6.0, 0.5);
    assert!((8.5..9.6).contains(&end), "{end}");
    let (coarse, fine) = (errors(&mut method, 4.0, 1.0), errors(&mut method, 4.0, 0.5));
    let inside = order(coarse.1, fine.1);
    assert!((5.6..7.0).contains(&inside), "{inside}");
}

#[test]
fn radau9_takes_a_fraction_of_the_steps_at_tight_tolerances() {
    for (tolerance, fraction) in [(1e-6, 2), (1e-8, 4), (1e-10, 6), (1e-12, 8)] {
        let (error, counters) = van_der_pol_run("radau9", tolerance, true);
        assert!(error < tolerance, "{tolerance:e} {error:e}");
        let (other, fifth) = van_der_pol_run("radau5", tolerance, true);
        assert!(fraction * counters.steps < fifth.steps, "{counters:?} {fifth:?}");
        let pays = counters.evaluations < fifth.evaluations || error < 0.1 * other && tolerance == 1e-6;
        assert!(pays, "{error:e} {other:e} {counters:?} {fifth:?}");
    }
}

#[test]
fn radau5_solves_van_der_pol_to_its_tolerance() {
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        let (error, counters) = van_der_pol_run("radau5", tolerance, true);
        assert!(error < tolerance, "{tolerance:e} {error:e}");
        // Reused Jacobians and factorisations.
        assert!(counters.jacobians < counters.steps && counters.factorisations < counters.steps + counters.rejected);
    }
}

#[test]
fn work_of_radau5_on_van_der_pol_is_pinned() {
    // The program RADAU5 at 1e-4 in the test set's report: 272 steps tried, 248 accepted, 2251 evaluations, 166 Jacobians,
    // 263 factorisations (another first step and absolute tolerance).
    let counted = |tolerance: f64, exact: bool| {
        let c = van_der_pol_run("radau5", tolerance, exact).1;
        assert_eq!(c.projections, c.steps);
        [c.steps, c.rejected, c.evaluations, c.jacobians, c.factorisations, c.newton_iterations]
    };
    assert_eq!(counted(1e-4, true), [244, 41, 2486, 159, 257, 747]);
    assert_eq!(counted(1e-6, true), [481, 8, 4160, 300, 408, 1226]);
    // Differences instead of the exact Jacobian cost one evaluation a column.
    let [steps, _, evaluations, jacobians, ..] = counted(1e-6, false);
    assert_eq!((steps, evaluations), (481, 4760));
    assert!(evaluations > 4000 + 2 * jacobians);
}

#[test]
fn radau5_solves_robertson_to_its_tolerance() {
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let mut probe = Probe::new(robertson, 3, tolerance);
        probe.absolute = 1e-6;
        let mut y = [1.0, 0.0, 0.0];
        let outcome = run(&mut Radau5::default(), &mut probe, &mut y, 40.0, &[], &Options::default());
        assert!(matches!(outcome.status, Status::Completed));
        let error = (0..3).map(|k| (y[k] / ROBERTSON_END[k] - 1.0).abs()).fold(0.0, f64::max);
        assert!(error < tolerance, "{tolerance:e} {error:e}");
        // A linear invariant, kept to round-off.
        assert!((y.iter().sum::<f64>() - 1.0).abs() < 1e-11);
        assert!(outcome.counters.steps < 150, "{:?}", outcome.counters);
    }
}

#[test]
fn samples_of_stiff_problems_are_good_whatever_the_method() {
    let times: Vec<f64> = (0..=100).map(|k| f64::from(k) * 0.03).collect();
    for name in ["radau5", "dop853", "dopri5", "auto"] {
        for tolerance in [1e-5, 1e-7, 1e-9] {
            let mut probe = Probe::new(prothero, 3, tolerance);
            let mut y = prothero_solution(0.0);
            y[0] += 0.5;
            let mut method = by_name(name).unwrap();
            let outcome = run(method.as_mut(), &mut probe, &mut y, 3.0, &times, &Options::default());
            assert_eq!(probe.sample_times(), times, "{name}");
            let error = |t: f64, y: &[f64]| distance(y, &prothero_solution(t));
            // The first sample holds the deviation that dies out.
            let worst = probe.samples[1..].iter().map(|(t, y)| error(*t, y)).fold(0.0, f64::max);
            assert!(worst < 3.0 * tolerance, "{name} {tolerance:e} {worst:e}");
            let counters = outcome.counters;
            assert_eq!(
                counters.stiff_from.is_some(),
                !name.starts_with("ra") && !name.starts_with("ro"),
                "{name} {tolerance:e}"
            );
            // Explicit steps stay below 6.1 / 1e4 on the average, implicit ones need not.
            assert_eq!(counters.steps > 4000, name.starts_with("dop"), "{name} {counters:?}");
        }
    }
}

#[test]
fn auto_switches_where_stability_limits_the_steps_and_says_when() {
    let mut probe = Probe::new(prothero, 3, 1e-7);
    let mut y = prothero_solution(0.0);
    y[0] += 0.5;
    let counters = run(&mut Auto::default(), &mut probe, &mut y, 3.0, &[], &Options::default()).counters;
    let from = counters.stiff_from.unwrap();
    assert!((15.0 * 1e-4..0.05).contains(&from), "{from}");
    assert!(probe.steps.iter().any(|(t, _, _)| *t == from), "at the end of a step");
    assert!(counters.jacobians > 0 && counters.steps < 200, "{counters:?}");
    assert!(distance(&y, &prothero_solution(3.0)) < 1e-7);
}

/// As [`prothero`], but stiff only from t = 1 to 2.
fn stiff_for_a_while(t: f64, y: &[f64], dy: &mut [f64]) {
    let rate = 1.0 + 1e4 * (0.5 * (20.0 * (t - 1.0)).tanh() - 0.5 * (20.0 * (t - 2.0)).tanh());
    dy[0] = -rate * (y[0] - t.cos()) - t.sin();
    dy[1] = y[2];
    dy[2] = -y[1];
}

#[test]
fn auto_goes_back_where_stiffness_ends() {
    for tolerance in [1e-5, 1e-8, 1e-10] {
        let counters = |name: &str| {
            let mut probe = Probe::new(stiff_for_a_while, 3, tolerance);
            let mut y = prothero_solution(0.0);
            let mut method = by_name(name).unwrap();
            let counters = run(method.as_mut(), &mut probe, &mut y, 10.0, &[], &Options::default()).counters;
            assert!(distance(&y, &prothero_solution(10.0)) < 20.0 * tolerance, "{name} {tolerance:e}");
            counters
        };
        let (auto, explicit, implicit) = (counters("auto"), counters("dop853"), counters("radau5"));
        assert_eq!(auto.switches, 2, "{tolerance:e} {auto:?}");
        assert!((0.7..1.3).contains(&auto.stiff_from.unwrap()), "{auto:?}");
        assert!(5 * auto.evaluations < explicit.evaluations, "{auto:?} {explicit:?}");
        assert!(auto.jacobians < implicit.jacobians, "{auto:?} {implicit:?}");
    }
}

#[test]
fn nothing_that_is_not_stiff_is_taken_for_it() {
    for tolerance in [1e-3, 1e-5, 1e-8, 1e-11] {
        for (name, explicit) in [("auto", "dop853"), ("dopri5", "dopri5")] {
            let counters = |name: &str, rhs: Rhs, start: &[f64]| {
                let mut probe = Probe::new(rhs, start.len(), tolerance);
                let mut y = start.to_vec();
                run(by_name(name).unwrap().as_mut(), &mut probe, &mut y, 20.0, &[], &Options::default()).counters
            };
            let oscillating = counters(name, oscillator, &[1.0, 0.0]);
            assert_eq!(oscillating.stiff_from, None, "{name} {tolerance:e} {oscillating:?}");
            assert_eq!(oscillating, counters(explicit, oscillator, &[1.0, 0.0]));
            let orbit = counters(name, arenstorf, &ARENSTORF_START);
            assert_eq!((orbit.stiff_from, orbit.jacobians), (None, 0), "{name} {tolerance:e}");
        }
    }
}

#[test]
fn radau5_fails_as_the_others_do() {
    let mut probe = Probe::new(oscillator, 2, 1e-9);
    probe.wall = 1.0;
    let times = [0.0, 0.3, 0.6, 0.9, 1.2];
    let mut y = [1.0, 0.0];
    let outcome = run(&mut Radau5::default(), &mut probe, &mut y, 2.0, &times, &Options::default());
    let Status::StoppedEarly { t, reason: StopReason::Failed { .. } } = outcome.status else {
        panic!("{:?}", outcome.status)
    };
    assert!(t < 1.0 && t > 1.0 - 1e-12, "got as near as possible: {t}");
    assert_eq!(probe.sample_times(), times[..4]);
    assert!(outcome.counters.recoveries.smaller_step > 0);
    assert!(distance(&y, &[t.cos(), -t.sin()]) < 1e-7);

    // y' = y^2, y = 1 / (1 - t)
    let mut probe = Probe::new(|_, y, dy| dy[0] = y[0] * y[0], 1, 1e-9);
    let outcome = run(&mut Radau5::default(), &mut probe, &mut [1.0], 2.0, &[0.5, 1.5], &Options::default());
    let Status::StoppedEarly { t, .. } = outcome.status else { panic!("{:?}", outcome.status) };
    assert!((t - 1.0).abs() < 1e-4, "{t}");
    assert_eq!(probe.samples.len(), 1);

    let mut probe = Probe::new(|_, _, dy| dy[0] = f64::NAN, 1, 1e-9);
    let outcome = run(&mut Radau5::default(), &mut probe, &mut [1.0], 2.0, &[], &Options::default());
    assert!(matches!(outcome.status, Status::StoppedEarly { reason: StopReason::NotFinite { .. }, .. }));
}

#[test]
fn radau5_keeps_projections_memory_and_stops() {
    let mut probe = Probe::new(oscillator, 2, 1e-5);
    probe.projection = Some(|y| {
        let radius = y[0].hypot(y[1]);
        y.iter_mut().for_each(|value| *value /= radius);
    });
    probe.accepted = Accepted::Changed;
    probe.stop_at = 5.0;
    let outcome = run(&mut Radau5::default(), &mut probe, &mut [1.0, 0.0], 10.0, &[], &Options::default());
    let Status::StoppedEarly { t, reason: StopReason::Requested } = outcome.status else {
        panic!("{:?}", outcome.status)
    };
    assert!((5.0..6.0).contains(&t), "{t}");
    assert!(probe.steps.iter().all(|(_, _, y)| (y[0].hypot(y[1]) - 1.0).abs() < 3e-16));
    assert_eq!(probe.accepts, outcome.counters.steps);
}

/// On its way along a cosine, it is held to it by a rate that comes and goes: up to 1e7 in every other half turn.
fn held_now_and_then(t: f64, y: &[f64], dy: &mut [f64]) {
    let rate = 1e7 * t.sin().max(0.0).powi(4);
    dy[0] = -rate * (y[0] - t.cos()) - t.sin();
}

#[test]
fn auto_is_as_quick_to_suspect_stiffness_that_comes_again_and_again() {
    let counters = |turns: f64| {
        let mut probe = Probe::new(held_now_and_then, 1, 1e-8);
        let mut y = vec![1.0];
        let t_end = turns * std::f64::consts::TAU;
        let outcome = run(&mut Auto::default(), &mut probe, &mut y, t_end, &[], &Options::default());
        assert!((y[0] - t_end.cos()).abs() < 1e-6, "{y:?}");
        outcome.counters
    };
    let (few, many) = (counters(2.0), counters(12.0));
    println!("{few:?}\n{many:?}");
    assert!(many.switches >= 5 * few.switches.max(4), "{few:?} {many:?}");
    assert!(many.evaluations < 8 * few.evaluations, "{few:?} {many:?}");
}

#[test]
fn every_remedy_is_taken_and_counted() {
    // A rate of 1000 1/s next to a slow motion: samples between the ends of steps that stability limits.
    let mut probe = Probe::new(|t, y, dy| dy[0] = -1000.0 * (y[0] - t.cos()), 1, 1e-6);
    let times: Vec<f64> = (0..100).map(|k| 0.0101 * f64::from(k)).collect();
    let mut y = [1.0];
    let outcome = run(by_name("dop853").unwrap().as_mut(), &mut probe, &mut y, 1.0, &times, &Options::default());
    let sampled = outcome.counters.recoveries;
    assert!(sampled.sample_step > 0, "{:?}", outcome.counters);
    assert_eq!((sampled.smaller_step, sampled.not_finite, sampled.no_convergence), (0, 0, 0));

    // y' = y^2: the equations of a long implicit step have no solution.
    let mut probe = Probe::new(|_, y, dy| dy[0] = y[0] * y[0], 1, 1e-6);
    let options = Options { first_step: Some(0.9), ..Options::default() };
    let outcome = run(&mut Radau5::default(), &mut probe, &mut [1.0], 0.95, &[], &options);
    assert!(outcome.counters.recoveries.no_convergence > 0, "{:?}", outcome.counters);
}

#[test]
fn auto_continues_where_no_step_that_advances_the_time_is_stable() {
    // Decay at 1e9 1/s for 3e6 s: stable steps are shorter than times can be told apart.
    let mut probe = Probe::new(|t, y, dy| dy[0] = -1e9 * (y[0] - (1e-6 * t).cos()), 1, 1e-8);
    let mut y = [1.0];
    let outcome = run(&mut Auto::default(), &mut probe, &mut y, 3e6, &[], &Options::default());
    assert!(matches!(outcome.status, Status::Completed), "{:?}", outcome.status);
    assert!((y[0] - 3.0_f64.cos()).abs() < 1e-7 && outcome.counters.steps < 1000, "{y:?} {:?}", outcome.counters);
    // What grows beyond all bounds has no step for either method.
    let mut probe = Probe::new(|_, y, dy| dy[0] = y[0] * y[0], 1, 1e-8);
    let outcome = run(&mut Auto::default(), &mut probe, &mut [1.0], 2.0, &[], &Options::default());
    let Status::StoppedEarly { t, .. } = outcome.status else { panic!("{:?}", outcome.status) };
    assert!((t - 1.0).abs() < 1e-3, "{t}");
}

/// A stiff spring 100 m from the origin, whose end moves like sin t, as its mass does: places are known to 1e-14 m, the force to 1e-4 N, and
/// with a damping of 1e4 N s/m the speed to 1e-8 m/s.
fn far_spring(t: f64, y: &[f64], dy: &mut [f64]) {
    let stretch = (1e2 + y[0]) - (1e2 + t.sin());
    dy[0] = y[1];
    dy[1] = -1e10 * stretch - 1e4 * (y[1] - t.cos()) - t.sin();
}

#[test]
fn iterations_end_at_round_off_of_stiff_forces() {
    let mut probe = Probe::new(far_spring, 2, 1e-10);
    probe.jacobian = Some(|_, _, matrix| matrix.copy_from_slice(&[0.0, -1e10, 1.0, -1e4]));
    let mut y = [0.0, 1.0];
    let outcome = run(&mut Radau9::default(), &mut probe, &mut y, 10.0, &[], &Options::default());
    let error = distance(&y, &[10.0_f64.sin(), 10.0_f64.cos()]);
    assert!(matches!(outcome.status, Status::Completed), "{:?}", outcome.status);
    assert!(error < 2e-7 && outcome.counters.steps < 200, "{error:e} {:?}", outcome.counters);
}
