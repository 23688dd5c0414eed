//! What every joint and every force element must fulfil.

use nalgebra::DMatrix;

use crate::element::{Constraint, Force};
use crate::geometry::{Frame, Vec3};
use crate::params::Parameters;
use crate::recording::Role;
use crate::testkit::{ForceValues, Probe, Random, Setting, complete};

/// Number of random settings of each check.
const TRIES: u64 = 20;
/// Step of the five-point differences; their error is about step^4 and rounding / step^2.
const STEP: f64 = 2e-3;
/// Allowed deviation of derivatives from their differences, relative to 1 + size.
const DIFFERENCE: f64 = 1e-8;
/// Allowed rounding, relative to 1 + size.
const ROUNDING: f64 = 1e-12;

/// Checks a joint at random settings:
/// - the recording gives what the equations give with plain numbers;
/// - derivatives are the differences of the values, first and second;
/// - rows and coordinates do not change when the whole world is moved (the ground frame is nobody's);
/// - a mobility satisfies all rows, and leaves exactly the freedom that the rows leave.
///
/// # Panics
/// When one of them does not hold.
pub fn check_joint<T: Constraint>(params: &str) {
    let probe = Probe::joint::<T>(params).expect("the parameters are accepted");
    let mut random = Random::new(1);
    for _ in 0..TRIES {
        let setting = probe.random_setting(&mut random);
        let found = probe.joint_values(&setting);
        if !probe.descriptor.opaque {
            check_recording(&probe, &setting, &found.values, &found.angles);
        }
        let values_at = |s: &Setting| probe.joint_values(s).values;
        for frame in 0..setting.frames.len() {
            for direction in 0..6 {
                let slopes = slope(|h| values_at(&setting.displaced(frame, direction, h)));
                for (row, expected) in slopes.into_iter().enumerate() {
                    let what = format!("value {row}, frame {frame}, direction {direction}");
                    close(found.jacobian[row][6 * frame + direction], expected, DIFFERENCE, &what);
                }
            }
        }
        let at_time = |h: f64| values_at(&Setting { time: setting.time + h, ..setting.clone() });
        for (row, expected) in slope(at_time).into_iter().enumerate() {
            close(found.time_derivative[row], expected, DIFFERENCE, &format!("time derivative of value {row}"));
        }
        for (row, expected) in curvature(|h| values_at(&setting.after(h))).into_iter().enumerate() {
            close(found.second[row], expected, DIFFERENCE, &format!("second derivative of value {row}"));
        }
        let elsewhere = probe.joint_values(&setting.carried_by(&random.frame())).values;
        for (row, (moved, value)) in elsewhere.iter().zip(&found.values).enumerate() {
            close(*moved, *value, ROUNDING, &format!("value {row} after moving the world"));
        }
    }
    if let Some(count) = T::MOBILITY {
        check_mobility::<T>(&probe, params, count);
    }
}

fn check_mobility<T: Constraint>(probe: &Probe, params: &str, count: usize) {
    let element = T::Parameters::read(&complete(&T::Parameters::specs(), params))
        .and_then(T::new)
        .expect("the parameters are accepted");
    let mut random = Random::new(2);
    for _ in 0..TRIES {
        let base = random.frame();
        let q: Vec<f64> = (0..count).map(|_| random.between(-3.0, 3.0)).collect();
        let pose = element.pose(&q);
        let other =
            Frame { position: base.position + base.rotation * pose.position, rotation: base.rotation * pose.rotation };
        let mut setting = Setting::at_rest(vec![base, other]);
        probe.settle(&mut setting);
        let found = probe.joint_values(&setting);
        for (row, value) in found.residual().iter().enumerate() {
            close(*value, 0.0, ROUNDING, &format!("row {row} at the pose of {q:?}"));
        }
        // The freedoms the rows leave to frame 1 are as many as the mobility has.
        let rows: Vec<f64> = found.jacobian[..found.rows].iter().flat_map(|row| row[6..12].to_vec()).collect();
        let rank = DMatrix::from_row_slice(found.rows, 6, &rows).rank(1e-9);
        assert_eq!(rank + count, 6, "the rows leave {} freedoms, the mobility has {count}", 6 - rank);
        for (role, value) in probe.recorded(&setting, &q) {
            match role {
                Role::PosePosition(k) => close(value, pose.position[k as usize], ROUNDING, "recorded pose"),
                Role::PoseRotation(k) => {
                    close(value, pose.rotation[(k as usize / 3, k as usize % 3)], ROUNDING, "recorded pose");
                }
                _ => {}
            }
        }
    }
}

/// Checks a force element at random settings: the recording gives what the equations give with plain numbers, and moving
/// the whole world carries forces and torques along and changes nothing else.
///
/// # Panics
/// When one of them does not hold.
pub fn check_force<T: Force>(params: &str) {
    let probe = Probe::force::<T>(params).expect("the parameters are accepted");
    let mut random = Random::new(3);
    for _ in 0..TRIES {
        let setting = probe.random_setting(&mut random);
        let found = probe.force_values(&setting);
        if !probe.descriptor.opaque {
            check_recording(&probe, &setting, &numbers(&found), &found.angles);
        }
        let world = random.frame();
        let mut carried = found.clone();
        for vector in carried.forces.iter_mut().chain(&mut carried.torques) {
            *vector = world.rotation * *vector;
        }
        let moved = probe.force_values(&setting.carried_by(&world));
        for (value, expected) in numbers(&moved).into_iter().zip(numbers(&carried)) {
            close(value, expected, ROUNDING, "result after moving the world");
        }
    }
}

/// Checks that action equals reaction: no resultant force, no resultant moment, at random settings.
///
/// # Panics
/// When there is one.
pub fn check_internal<T: Force>(params: &str) {
    let probe = Probe::force::<T>(params).expect("the parameters are accepted");
    let mut random = Random::new(4);
    for _ in 0..TRIES {
        let setting = probe.random_setting(&mut random);
        let found = probe.force_values(&setting);
        let size: f64 = found.forces.iter().chain(&found.torques).map(|v| v.norm()).sum();
        let force: Vec3<f64> = found.forces.iter().sum();
        let levers = setting.frames.iter().zip(&found.forces).map(|(frame, force)| frame.position.cross(force));
        let moment: Vec3<f64> = levers.sum::<Vec3<f64>>() + found.torques.iter().sum::<Vec3<f64>>();
        close(force.norm() / (1.0 + size), 0.0, ROUNDING, "resultant force");
        close(moment.norm() / (1.0 + size), 0.0, ROUNDING, "resultant moment");
    }
}

/// Checks the power balance: the wrench's power is -dV/dt - dissipation, and the dissipation is not negative, at the
/// settings that `setting` makes (some force elements are made for aligned axes only).
///
/// # Panics
/// When it does not hold, or the element gives neither potential nor dissipation.
pub fn check_power<T: Force>(params: &str, setting: impl Fn(&mut Random) -> Setting) {
    let probe = Probe::force::<T>(params).expect("the parameters are accepted");
    let mut random = Random::new(5);
    for _ in 0..TRIES {
        let mut setting = setting(&mut random);
        probe.settle(&mut setting);
        let found = probe.force_values(&setting);
        assert!(found.potential.or(found.dissipation).is_some(), "neither potential nor dissipation");
        let powers = setting.twists.iter().zip(found.forces.iter().zip(&found.torques));
        let power: f64 = powers.map(|(t, (f, m))| f.dot(&t.velocity) + m.dot(&t.angular_velocity)).sum();
        let potential = |h: f64| vec![probe.force_values(&setting.after(h)).potential.unwrap_or(0.0)];
        let stored = slope(potential)[0];
        let dissipation = found.dissipation.unwrap_or(0.0);
        assert!(dissipation >= 0.0, "dissipation is {dissipation}");
        close(power, -stored - dissipation, DIFFERENCE, "power of the wrench");
    }
}

/// The recording's results against `expected` (without angles) and `angles`.
fn check_recording(probe: &Probe, setting: &Setting, expected: &[f64], angles: &[f64]) {
    let coordinates = vec![0.0; probe.descriptor.mobility.unwrap_or(0)];
    let mut values = Vec::new();
    for (role, value) in probe.recorded(setting, &coordinates) {
        match role {
            Role::Angle(k) => close(value, angles[k as usize], ROUNDING, "recorded angle"),
            Role::PosePosition(_) | Role::PoseRotation(_) => {}
            _ => values.push(value),
        }
    }
    assert_eq!(values.len(), expected.len(), "{}: number of recorded results", probe.descriptor.name);
    for (k, (value, expected)) in values.iter().zip(expected).enumerate() {
        close(*value, *expected, ROUNDING, &format!("recorded result {k}"));
    }
}

/// The results of a force in the order in which they are recorded, angles left out.
fn numbers(found: &ForceValues) -> Vec<f64> {
    let vectors = found.forces.iter().chain(&found.torques).flat_map(|v| v.iter().copied());
    let lists = [&found.rates, &found.memory, &found.channels].into_iter().flatten().copied();
    vectors.chain(lists).chain(found.potential).chain(found.dissipation).collect()
}

fn close(value: f64, expected: f64, tolerance: f64, what: &str) {
    let scale = 1.0 + expected.abs();
    assert!((value - expected).abs() <= tolerance * scale, "{what}: found {value:e}, expected {expected:e}");
}

/// First derivative at 0 by five points: (f(-2h) - 8 f(-h) + 8 f(h) - f(2h)) / 12 h.
fn slope(f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    combine(&f, &[(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)], 12.0 * STEP)
}

/// Second derivative at 0 by five points: (-f(-2h) + 16 f(-h) - 30 f(0) + 16 f(h) - f(2h)) / 12 h^2.
fn curvature(f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    combine(&f, &[(-2.0, -1.0), (-1.0, 16.0), (0.0, -30.0), (1.0, 16.0), (2.0, -1.0)], 12.0 * STEP * STEP)
}

fn combine(f: &impl Fn(f64) -> Vec<f64>, points: &[(f64, f64)], divisor: f64) -> Vec<f64> {
    let mut sum: Vec<f64> = Vec::new();
    for (at, weight) in points {
        let values = f(at * STEP);
        sum.resize(values.len(), 0.0);
        for (total, value) in sum.iter_mut().zip(values) {
            *total += weight * value / divisor;
        }
    }
    sum
}
