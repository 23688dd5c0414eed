//! Differences settle where a function is smooth on the scale of some step, and say so where it is not.

use super::{curvatures, slopes};

#[test]
fn smooth_functions_are_differentiated_whatever_their_scale() {
    for rate in [0.1, 1.0, 30.0, 100.0] {
        let f = |h: f64| vec![(1.0 + rate * h).sin(), 1e9 * (rate * h).exp()];
        let found = slopes(f, &[1.0, 1e9]);
        let (first, second) = (rate * 1.0_f64.cos(), 1e9 * rate);
        let [Some(a), Some(b)] = found[..] else { panic!("{rate}: {found:?}") };
        assert!((a - first).abs() < 1e-8 * (1.0 + first), "{rate}: {a} {first}");
        assert!((b - second).abs() < 1e-8 * (1e9 + second), "{rate}: {b} {second}");
    }
    let found = curvatures(|h| vec![(1.0 + 3.0 * h).sin(), h * h], &[1.0, 0.0]);
    let [Some(a), Some(b)] = found[..] else { panic!("{found:?}") };
    assert!((a + 9.0 * 1.0_f64.sin()).abs() < 1e-8 * 10.0 && (b - 2.0).abs() < 1e-8, "{found:?}");
}

#[test]
fn a_kink_is_no_obstacle_beyond_a_small_distance() {
    assert!(slopes(|h| vec![(h - 1e-3).abs()], &[1e-3])[0].is_some_and(|slope| (slope + 1.0).abs() < 1e-8));
    assert_eq!(slopes(|h| vec![(h - 1e-5).abs()], &[1e-5]), [None]);
}

#[test]
fn what_is_not_smooth_has_no_derivative() {
    let fast = |h: f64| vec![(1e7 * h + 1.0).sin(), 3.0 * h];
    let found = slopes(fast, &[1.0, 1.0]);
    assert!(found[0].is_none() && found[1].is_some(), "{found:?}");
    assert_eq!(slopes(|_| vec![f64::NAN], &[1.0]), [None]);
    assert_eq!(curvatures(|h| vec![h.abs()], &[1.0]), [None]);
}
