//! Angles over many turns: continuous, and as accurate after 10 000 turns as a number of that size can be.

use std::f64::consts::TAU;

use element_api::testkit::{Random, Setting, on_common_axis, turn};
use element_api::{Constraint, Frame, Vec3};

use super::probe;
use crate::coupler::Coupler;
use crate::gear::Gear;
use crate::rack_and_pinion::RackAndPinion;
use crate::revolute::Revolute;
use crate::rotation_driver::RotationDriver;
use crate::screw::Screw;

/// Rounding of an angle of 6.3e4 rad (half a unit in the last place is 3.6e-12), not of a sum over the steps.
const ROUNDING: f64 = 5e-11;
const STEPS_PER_TURN: i32 = 3;
const TURNS: i32 = 10_000;

/// Goes through 10 000 turns in thirds of a turn, the references following as in a run, and gives every residual (largest
/// row) and every set of coordinates to `see`. `frames` makes the frames from the angle turned.
fn turn_on<T: Constraint>(
    params: &str,
    sign: f64,
    frames: impl Fn(f64) -> Vec<Frame<f64>>,
    mut see: impl FnMut(f64, f64, &[f64]),
) {
    let probe = probe::<T>(params);
    let mut setting = Setting::at_rest(frames(0.0));
    probe.settle(&mut setting);
    for step in 1..=TURNS * STEPS_PER_TURN {
        let angle = sign * TAU * f64::from(step) / f64::from(STEPS_PER_TURN);
        setting.frames = frames(angle);
        setting.time = angle.abs();
        let found = probe.joint_values(&setting);
        let worst = found.residual().iter().fold(0.0_f64, |worst, row| worst.max(row.abs()));
        see(angle, worst, found.coordinates());
        setting.references = found.angles.iter().map(|angle| if angle.is_nan() { 0.0 } else { *angle }).collect();
    }
}

fn base() -> Frame<f64> {
    Frame { position: Vec3::zeros(), rotation: turn(Vec3::zeros()) }
}

/// Frame pairs (carrier, moving) of two coordinates: rotations about and displacements along z.
fn pairs(first: (f64, f64), second: (f64, f64)) -> Vec<Frame<f64>> {
    let mut random = Random::new(16);
    let (a, b) = (random.frame(), random.frame());
    vec![a, on_common_axis(&a, first.0, first.1), b, on_common_axis(&b, second.0, second.1)]
}

#[test]
fn revolute_angle_is_continuous_in_both_directions() {
    for sign in [1.0, -1.0] {
        turn_on::<Revolute>(
            "",
            sign,
            |angle| vec![base(), on_common_axis(&base(), angle, 0.0)],
            |angle, _, q| {
                assert!((q[0] - angle).abs() < ROUNDING, "{} instead of {angle}", q[0]);
            },
        );
    }
}

#[test]
fn gears_stay_in_mesh() {
    for (params, ratio) in [
        ("teeth_1 = 17\nteeth_2 = 40", -17.0 / 40.0),
        ("radius_1 = 0.3\nradius_2 = 0.1", -3.0),
        ("teeth_1 = 31\nteeth_2 = 77\ninternal = true", 31.0 / 77.0),
    ] {
        let frames = |angle: f64| pairs((angle, 0.0), (ratio * angle, 0.0));
        turn_on::<Gear>(params, 1.0, frames, |angle, worst, _| {
            assert!(worst < ROUNDING * f64::max(1.0, ratio.abs()), "{params}: {worst:e} after {angle} rad");
        });
    }
}

#[test]
fn a_gear_that_lost_a_turn_is_seen() {
    // After one turn of the first wheel the second must stand at -17/40 of a turn, not where it began.
    let probe = probe::<Gear>("teeth_1 = 17\nteeth_2 = 40");
    let mut setting = Setting::at_rest(pairs((0.0, 0.0), (0.0, 0.0)));
    setting.references = vec![TAU];
    let found = probe.joint_values(&setting).residual()[0];
    assert!((found.abs() - TAU * 17.0 / 40.0).abs() < 1e-12, "{found}");
}

#[test]
fn a_rack_follows_its_pinion() {
    let frames = |angle: f64| pairs((angle, 0.0), (0.0, 0.05 * angle));
    turn_on::<RackAndPinion>("radius = 0.05", -1.0, frames, |angle, worst, _| {
        assert!(worst < 0.05 * ROUNDING, "{worst:e} after {angle} rad");
    });
}

#[test]
fn couplers_hold_their_relation() {
    let lead = 0.01;
    let rotation = |angle: f64| (angle, 0.0);
    let shift = |angle: f64| (0.0, lead * angle);
    let check = |params: &str, frames: &dyn Fn(f64) -> Vec<Frame<f64>>| {
        turn_on::<Coupler>(params, 1.0, frames, |angle, worst, _| {
            assert!(worst < 2.0 * ROUNDING, "{params}: {worst:e} after {angle} rad");
        });
    };
    check("ratio = -1.7", &|a| pairs(rotation(a), rotation(-1.7 * a)));
    check("second = 'translation'\nlead = 0.01", &|a| pairs(rotation(a), shift(a)));
    check("first = 'translation'\nlead = 0.01", &|a| pairs(shift(a), rotation(a)));
    check("first = 'translation'\nsecond = 'translation'\nratio = 2.0", &|a| pairs(shift(a), shift(2.0 * a)));
}

#[test]
fn a_nut_runs_along_its_spindle() {
    let frames = |angle: f64| vec![base(), on_common_axis(&base(), angle, 0.004 * angle / TAU)];
    turn_on::<Screw>("pitch = 0.004", 1.0, frames, |angle, worst, q| {
        assert!(worst < ROUNDING && (q[0] - angle).abs() < ROUNDING, "{worst:e}, {} after {angle} rad", q[0]);
    });
}

#[test]
fn a_driver_turns_on() {
    // angle = -t; the time is the magnitude of the angle.
    let frames = |angle: f64| vec![base(), on_common_axis(&base(), angle, 0.0)];
    turn_on::<RotationDriver>("angle = { postfix = ['x', 'neg'] }", -1.0, frames, |angle, worst, q| {
        assert!(worst < ROUNDING && (q[0] - angle).abs() < ROUNDING, "{worst:e}, {} after {angle} rad", q[0]);
    });
}
