//! The matrices of implicit steps: eliminated ahead as far as that pays, and densely.

use nalgebra::Complex;

use super::fixtures::{Probe, Rhs, distance};
use crate::integrate::fill::{Fill, Work};
use crate::integrate::jacobian::Columns;
use crate::integrate::lu::{Lu, Number};
use crate::integrate::{Counters, Options, Price, Span, by_name};
use crate::random::Random;

/// A matrix given column by column.
fn columns(matrix: &[f64], n: usize) -> Columns {
    let mut found = Columns::default();
    found.clear(n);
    matrix.iter().enumerate().for_each(|(at, value)| found.put(at % n, at / n, *value));
    found
}

/// What `shift - J` leaves of a right side, as a share of it, with the solution by its factors; `None` where these are refused.
fn left<T: Number + Default>(jacobian: &[f64], n: usize, shift: T, fill: &Fill) -> Option<f64> {
    let mut lu = Lu::<T>::default();
    let mut noise = Random(5);
    // The second time with everything that the first leaves behind.
    lu.factor(shift + shift, fill, true);
    if !lu.factor(shift, fill, false) {
        return None;
    }
    let right: Vec<T> = (0..n).map(|_| T::from_real(noise.next())).collect();
    let mut x = right.clone();
    lu.solve(&mut x, fill);
    let row = |i: usize| {
        (0..n).fold(shift * x[i] - right[i], |sum, j| sum - T::from_real(jacobian[i + n * j]) * x[j]).norm1()
    };
    Some((0..n).map(row).fold(0.0, f64::max))
}

/// The unknowns eliminated ahead; both matrices are solved with these, and without.
fn solved(jacobian: &[f64], n: usize) -> usize {
    let mut fill = Fill::default();
    fill.resize(n);
    assert!(fill.take(&columns(jacobian, n)));
    assert!(!fill.take(&columns(jacobian, n)), "nothing new");
    let ahead = fill.ahead();
    for _ in 0..2 {
        let real = left(jacobian, n, 30.0, &fill).unwrap();
        let complex = left(jacobian, n, Complex::new(25.0, 30.0), &fill).unwrap();
        assert!(real < 1e-11 && complex < 1e-11, "{real:e} {complex:e}");
        fill.leave_dense(&columns(jacobian, n));
    }
    ahead
}

/// Positions whose rates are velocities, accelerations that depend on all of them, work done.
fn mechanism(velocities: usize, depends: impl Fn(usize, usize) -> bool) -> (Vec<f64>, usize) {
    let (n, mut noise) = (2 * velocities + 1, Random(9));
    let mut jacobian = vec![0.0; n * n];
    for i in 0..velocities {
        jacobian[i + n * (velocities + i)] = 1.0;
        for j in (0..velocities).filter(|j| depends(i, *j)) {
            jacobian[velocities + i + n * j] = 100.0 * noise.next();
            jacobian[velocities + i + n * (velocities + j)] = noise.next();
        }
        jacobian[2 * velocities + n * i] = noise.next();
    }
    (jacobian, n)
}

#[test]
fn positions_are_eliminated_ahead() {
    let (jacobian, n) = mechanism(20, |_, _| true);
    assert_eq!(solved(&jacobian, n), 21);
}

#[test]
fn halves_give_what_the_whole_matrix_gives() {
    // Positions in another order than velocities, one with a rate that is no velocity, one that nothing depends on.
    let (mut jacobian, n) = mechanism(7, |i, j| (i + 2 * j) % 3 > 0);
    for (position, velocity, slope) in [(0, 9, 1.0), (2, 7, -0.5)] {
        (0..n).for_each(|k| jacobian[position + n * k] = 0.0);
        jacobian[position + n * velocity] = slope;
    }
    (0..n).for_each(|k| jacobian[k + n * 4] = 0.0);
    (jacobian[5 + n * 5], jacobian[5 + n]) = (-3.0, 0.25);
    let mut fill = Fill::default();
    fill.resize(n);
    fill.take(&columns(&jacobian, n));
    assert_eq!((fill.halves.pairs.len(), fill.halves.sums.len(), fill.order.len()), (6, 1, 8));
    let solution = |fill: &Fill, shift: Complex<f64>| {
        let mut lu = Lu::default();
        assert!(lu.factor(shift, fill, true));
        let mut x: Vec<_> = (0..n).map(|k| Complex::new(1.0 + k as f64, 0.5 - k as f64)).collect();
        lu.solve(&mut x, fill);
        x
    };
    for shift in [Complex::new(25.0, 30.0), Complex::new(3e3, -4e3), Complex::new(0.0, 7.0)] {
        let halved = solution(&fill, shift);
        let mut whole = fill.clone();
        whole.leave_dense(&columns(&jacobian, n));
        assert_eq!(whole.ahead(), 0);
        for (a, b) in halved.iter().zip(solution(&whole, shift)) {
            assert!((a - b).norm() < 1e-12 * (1.0 + b.norm()), "{a} {b}");
        }
    }
}

#[test]
fn of_long_structures_little_is_left() {
    let (jacobian, n) = mechanism(150, |i, j| i.abs_diff(j) < 6);
    let head = solved(&jacobian, n);
    assert!(head > 270, "{head}");
}

#[test]
fn full_matrices_are_dense() {
    // Pivoting is needed: the first diagonal entry of 2 - J is zero.
    let jacobian = [2.0, -1.0, 0.5, 3.0, 0.25, -2.0, 1.0, 4.0, -1.5];
    let mut fill = Fill::default();
    fill.resize(3);
    fill.take(&columns(&jacobian, 3));
    assert_eq!(fill.ahead(), 0);
    assert!(left(&jacobian, 3, 2.0, &fill).unwrap() < 1e-14);
    assert!(left(&jacobian, 3, Complex::new(2.0, 0.75), &fill).unwrap() < 1e-14);
    fill.take(&columns(&[0.0; 9], 3));
    assert!(left(&[0.0; 9], 3, 0.0, &fill).is_none(), "singular");
}

#[test]
fn a_diagonal_without_pivots_is_refused_and_left_to_pivoting() {
    let (mut jacobian, n) = mechanism(100, |i, j| i.abs_diff(j) < 2);
    // A row that loses its diagonal with this shift, and comes first.
    for k in 0..n {
        (jacobian[3 + n * k], jacobian[k + n * 3]) = (0.0, 0.0);
    }
    (jacobian[3 + n * 3], jacobian[3 + n * 103], jacobian[103 + n * 3]) = (30.0, 1.0, 1.0);
    let mut fill = Fill::default();
    fill.resize(n);
    fill.take(&columns(&jacobian, n));
    assert!(fill.head > 20);
    assert!(left(&jacobian, n, 30.0, &fill).is_none());
    fill.leave_dense(&columns(&jacobian, n));
    assert!(left(&jacobian, n, 30.0, &fill).unwrap() < 1e-10);
}

#[test]
fn entries_that_come_later_change_the_order() {
    let (jacobian, n) = mechanism(30, |i, j| i.abs_diff(j) < 2);
    let mut fill = Fill::default();
    fill.resize(n);
    fill.take(&columns(&jacobian, n));
    let (more, _) = mechanism(30, |i, j| i.abs_diff(j) < 9);
    assert!(fill.take(&columns(&more, n)));
    assert!(left(&more, n, 30.0, &fill).unwrap() < 1e-11);
    assert!(!fill.take(&columns(&jacobian, n)));
    assert!(left(&jacobian, n, 30.0, &fill).unwrap() < 1e-11);
}

#[test]
fn work_is_counted_as_it_is_eliminated() {
    let work = |velocities: usize, depends: fn(usize, usize) -> bool| {
        let (jacobian, n) = mechanism(velocities, depends);
        let mut fill = Fill::default();
        fill.resize(n);
        fill.take(&columns(&jacobian, n));
        fill.work(0)
    };
    assert_eq!(work(30, |_, _| true), Work { factorisation: 9000.0, solution: 900.0 });
    let [few, many] = [100, 200].map(|velocities| work(velocities, |i, j| i.abs_diff(j) < 2));
    assert!(many.factorisation < 2.1 * few.factorisation && many.solution < 2.1 * few.solution, "{few:?} {many:?}");
    assert!(many.factorisation < 1e-3 * work(200, |_, _| true).factorisation, "{many:?}");
}

/// Pendulums, one slower than the next, that all pull at each other: positions, then velocities.
fn pendulums(_t: f64, y: &[f64], dy: &mut [f64]) {
    let n = y.len() / 2;
    let (angles, speeds) = y.split_at(n);
    let mean = angles.iter().sum::<f64>() / n as f64;
    dy[..n].copy_from_slice(speeds);
    for (k, (rate, angle)) in dy[n..].iter_mut().zip(angles).enumerate() {
        *rate = -(1.0 + k as f64 / n as f64) * angle.sin() - mean.sin();
    }
}

fn pendulums_jacobian(_t: f64, y: &[f64], matrix: &mut [f64]) {
    let n = y.len() / 2;
    let mean = y[..n].iter().sum::<f64>() / n as f64;
    for i in 0..n {
        matrix[i + 2 * n * (n + i)] = 1.0;
        for j in 0..n {
            matrix[n + i + 2 * n * j] = -mean.cos() / n as f64;
        }
        matrix[n + i + 2 * n * i] -= (1.0 + i as f64 / n as f64) * y[i].cos();
    }
}

/// A wave on a string of masses at stiff springs with dampers along it, its first end held: positions, then velocities.
fn string(_t: f64, y: &[f64], dy: &mut [f64]) {
    let n = y.len() / 2;
    let (places, speeds) = y.split_at(n);
    dy[..n].copy_from_slice(speeds);
    for k in 0..n {
        let stretch = |of: &[f64], k: usize| if k == 0 { of[0] } else { of[k] - of[k - 1] };
        let pull = |k: usize| STIFF * stretch(places, k) + DAMPED * stretch(speeds, k);
        dy[n + k] = (if k + 1 < n { pull(k + 1) } else { 0.0 }) - pull(k);
    }
}

const STIFF: f64 = 1e6;
const DAMPED: f64 = 1e4;

fn string_jacobian(_t: f64, y: &[f64], matrix: &mut [f64]) {
    let n = y.len() / 2;
    for k in 0..n {
        matrix[k + 2 * n * (n + k)] = 1.0;
        let mut put = |column: usize, share: f64| {
            matrix[n + k + 2 * n * column] = share * STIFF;
            matrix[n + k + 2 * n * (n + column)] = share * DAMPED;
        };
        put(k, if k + 1 < n { -2.0 } else { -1.0 });
        if k > 0 {
            put(k - 1, 1.0);
        }
        if k + 1 < n {
            put(k + 1, 1.0);
        }
    }
}

/// The end of a motion from `start`, and the work it took.
fn motion(name: &str, (rhs, jacobian): (Rhs, Rhs), start: &[f64], tolerance: f64, t_end: f64) -> (Vec<f64>, Counters) {
    let mut probe = Probe::new(rhs, start.len(), tolerance);
    probe.jacobian = Some(jacobian);
    let evaluation = 10.0 * start.len() as f64;
    probe.price = Some(Price { evaluation, jacobian: Some(10.0 * evaluation), preparation: 0.0 });
    let mut y = start.to_vec();
    let span = Span { t_start: 0.0, t_end, sample_times: &[] };
    let outcome = by_name(name).unwrap().integrate(&mut probe, &mut y, &span, &Options::default()).unwrap();
    (y, outcome.counters)
}

#[test]
fn factors_of_large_matrices_serve_for_more_steps() {
    let share_of_steps = |n: usize| {
        let start: Vec<f64> = (0..2 * n).map(|k| if k < n { 0.3 + 0.2 * (k % 5) as f64 } else { 0.0 }).collect();
        let (exact, _) = motion("dop853", (pendulums, pendulums_jacobian), &start, 1e-11, 20.0);
        let (found, work) = motion("radau5", (pendulums, pendulums_jacobian), &start, 1e-6, 20.0);
        let off = distance(&found, &exact);
        assert!(off < 2e-5, "{n}: off by {off:e}, {work:?}");
        work.factorisations as f64 / work.steps as f64
    };
    let [small, large] = [8, 100].map(share_of_steps);
    assert!(large < 0.5 * small, "{large} {small}");
}

#[test]
fn auto_knows_that_matrices_of_long_structures_take_little() {
    let n = 150;
    let start: Vec<f64> = (0..2 * n).map(|k| if k < n { 1e-3 * k as f64 } else { 0.0 }).collect();
    let (found, work) = motion("auto", (string, string_jacobian), &start, 1e-6, 0.05);
    assert!(work.stiff_from.is_some_and(|t| t < 0.01), "{work:?}");
    let (implicit, _) = motion("radau5", (string, string_jacobian), &start, 1e-9, 0.05);
    let off = distance(&found, &implicit);
    assert!(off < 1e-3, "off by {off:e}");
}
