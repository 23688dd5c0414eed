//! Splines: smoothness, closure, accuracy, refusals.

use std::f64::consts::{PI, TAU};

use crate::table::{Outside, Table};
use crate::testkit::Random;

#[test]
fn tables_go_through_their_points() {
    for (table, points) in [(bumpy_clamped(), bumpy_points(false)), (bumpy_periodic(), bumpy_points(true))] {
        for [x, y] in points {
            assert!((table.derivative(x, 0) - y).abs() < 1e-14, "{:?} at {x}", table.outside);
        }
    }
}

#[test]
fn tables_are_twice_continuously_differentiable_at_their_points() {
    for table in [bumpy_clamped(), bumpy_periodic()] {
        for k in 1..table.pieces.len() {
            for (order, jump) in jumps(&table, k - 1, k).into_iter().enumerate() {
                assert!(jump.abs() < 1e-11, "{:?}, point {k}, order {order}: jump {jump:e}", table.outside);
            }
        }
    }
}

#[test]
fn periodic_tables_close_smoothly() {
    let table = bumpy_periodic();
    for (order, jump) in jumps(&table, table.pieces.len() - 1, 0).into_iter().enumerate() {
        assert!(jump.abs() < 1e-11, "order {order}: jump {jump:e}");
    }
    let period = table.breaks[table.breaks.len() - 1] - table.breaks[0];
    let mut random = Random::new(31);
    for _ in 0..50 {
        let x = random.between(-10.0, 10.0);
        for order in 0..3 {
            let difference = table.derivative(x + 3.0 * period, order) - table.derivative(x, order);
            assert!(difference.abs() < 1e-10, "order {order} at {x}: {difference:e}");
        }
    }
}

#[test]
fn natural_ends_have_no_curvature_and_end_values_are_held() {
    let table = bumpy_clamped();
    let (first, last) = (table.breaks[0], table.breaks[table.breaks.len() - 1]);
    for end in [first, last] {
        assert!(table.derivative(end, 2).abs() < 1e-12);
    }
    assert_eq!(table.derivative(first - 1.0, 0), table.derivative(first, 0));
    assert!((table.derivative(last + 1.0, 0) - table.derivative(last, 0)).abs() < 1e-15);
    for order in 1..4 {
        assert_eq!(table.derivative(first - 1.0, order), 0.0);
        assert_eq!(table.derivative(last + 1.0, order), 0.0);
    }
}

#[test]
fn derivatives_are_those_of_the_values() {
    let mut random = Random::new(32);
    for table in [bumpy_clamped(), bumpy_periodic()] {
        for _ in 0..50 {
            let piece = random.between(0.0, table.pieces.len() as f64) as usize;
            let (left, right) = (table.breaks[piece], table.breaks[piece + 1]);
            let (x, h) = (left + (right - left) * random.between(0.1, 0.9), 1e-5 * (right - left));
            for order in 0..3 {
                let slope = (table.derivative(x + h, order) - table.derivative(x - h, order)) / (2.0 * h);
                let error = (table.derivative(x, order + 1) - slope).abs();
                assert!(error < 1e-4 * (1.0 + slope.abs()), "order {order} at {x}: off by {error:e}");
            }
            assert_eq!(table.derivative(x, 4), 0.0);
        }
    }
}

#[test]
fn straight_lines_are_reproduced() {
    for count in 2..7 {
        let points: Vec<[f64; 2]> = (0..count).map(|k| f64::from(k * k)).map(|x| [x, 3.0 - 2.0 * x]).collect();
        let table = Table::clamped(&points).expect("sound");
        let mut random = Random::new(33);
        for _ in 0..20 {
            let x = random.between(0.0, f64::from((count - 1) * (count - 1)));
            assert!((table.derivative(x, 0) - (3.0 - 2.0 * x)).abs() < 1e-13, "{count} points, at {x}");
            assert!((table.derivative(x, 1) + 2.0).abs() < 1e-12, "{count} points, slope at {x}");
        }
    }
}

#[test]
fn splines_are_reproduced_from_finer_points() {
    // A spline satisfies the conditions that make the spline through any of its points unique.
    let natural = bumpy_clamped();
    let resampled: Vec<[f64; 2]> = finer(&natural).iter().map(|x| [*x, natural.derivative(*x, 0)]).collect();
    let again = Table::clamped(&resampled).expect("sound");
    let closed = bumpy_periodic();
    let resampled: Vec<[f64; 2]> = finer(&closed).iter().map(|x| [*x, closed.derivative(*x, 0)]).collect();
    let closed_again = Table::periodic(&resampled).expect("sound");
    let mut random = Random::new(34);
    for _ in 0..100 {
        let x = random.between(0.0, TAU);
        for order in 0..3 {
            assert!((natural.derivative(x, order) - again.derivative(x, order)).abs() < 1e-9, "order {order} at {x}");
            let error = (closed.derivative(x, order) - closed_again.derivative(x, order)).abs();
            assert!(error < 1e-9, "order {order} at {x}, periodic: {error:e}");
        }
    }
}

#[test]
fn errors_shrink_with_the_fourth_power_of_the_spacing() {
    // Half a sine has natural ends; a full one is periodic.
    let natural = |n: usize| Table::clamped(&samples(n, PI, f64::sin)).expect("sound");
    let periodic = |n: usize| Table::periodic(&samples(n, TAU, |x| (x + 0.3).sin())).expect("sound");
    let errors =
        |n: usize| (largest_error(&natural(n), PI, f64::sin), largest_error(&periodic(n), TAU, |x| (x + 0.3).sin()));
    let (coarse, fine) = (errors(16), errors(32));
    for (name, ratio) in [("natural", coarse.0 / fine.0), ("periodic", coarse.1 / fine.1)] {
        assert!((14.0..18.0).contains(&ratio), "{name}: error divided by {ratio} instead of 16");
    }
    // The spline's error bound 5/384 h^4 max |f''''| (de Boor, ch. V).
    assert!(fine.1 < 1.3 * 5.0 / 384.0 * (TAU / 32.0).powi(4), "{:e}", fine.1);
}

#[test]
fn points_that_make_no_function_are_refused() {
    let refused = [
        (Table::clamped(&[]), "at least 2 points, found 0"),
        (Table::clamped(&[[0.0, 1.0]]), "at least 2 points, found 1"),
        (Table::clamped(&[[0.0, 1.0], [0.0, 2.0]]), "0 is followed by 0"),
        (Table::clamped(&[[0.0, 1.0], [2.0, 2.0], [1.0, 0.0]]), "2 is followed by 1"),
        (Table::clamped(&[[0.0, f64::NAN], [1.0, 1.0]]), "NaN"),
        (Table::clamped(&[[0.0, 1.0], [f64::INFINITY, 1.0]]), "inf"),
        (Table::periodic(&[[0.0, 1.0], [1.0, 2.0], [2.0, 1.0]]), "at least 4 points, found 3"),
        (Table::periodic(&[[0.0, 1.0], [1.0, 2.0], [2.0, 0.0], [3.0, 1.1]]), "first value is 1, the last is 1.1"),
    ];
    for (result, words) in refused {
        let error = result.expect_err(words);
        assert!(error.message.contains(words), "{error}");
    }
}

#[test]
fn an_unsound_table_is_recognised_and_an_empty_one_is_zero() {
    let empty = Table { breaks: Vec::new(), pieces: Vec::new(), outside: Outside::Clamped };
    assert_eq!(empty.derivative(1.0, 0), 0.0);
    assert!(!empty.is_sound());
    assert!(bumpy_clamped().is_sound() && bumpy_periodic().is_sound());
    let mut infinite = bumpy_clamped();
    infinite.pieces[1][3] = f64::INFINITY;
    assert!(!infinite.is_sound());
}

#[test]
fn continuations_survive_their_encoding() {
    for outside in [Outside::Clamped, Outside::Periodic] {
        assert_eq!(Outside::decode(outside.encode()), Some(outside));
    }
    assert_eq!(Outside::decode(2), None);
}

fn bumpy_points(closed: bool) -> Vec<[f64; 2]> {
    let mut points = vec![[0.0, 1.0], [0.4, -2.0], [1.5, 0.5], [2.0, 3.0], [4.5, 2.5], [TAU, -1.0]];
    if closed {
        points[5][1] = 1.0;
    }
    points
}

fn bumpy_clamped() -> Table {
    Table::clamped(&bumpy_points(false)).expect("sound")
}

fn bumpy_periodic() -> Table {
    Table::periodic(&bumpy_points(true)).expect("sound")
}

/// Difference of value, slope and curvature between the end of piece `a` and the beginning of piece `b`.
fn jumps(table: &Table, a: usize, b: usize) -> [f64; 3] {
    let h = table.breaks[a + 1] - table.breaks[a];
    let [c0, c1, c2, c3] = table.pieces[a];
    let [d0, d1, d2, _] = table.pieces[b];
    [
        c0 + h * (c1 + h * (c2 + h * c3)) - d0,
        c1 + h * (2.0 * c2 + 3.0 * h * c3) - d1,
        2.0 * c2 + 6.0 * h * c3 - 2.0 * d2,
    ]
}

/// The break points and two more in each piece.
fn finer(table: &Table) -> Vec<f64> {
    let inner = table.breaks.windows(2).flat_map(|w| {
        let h = w[1] - w[0];
        [w[0], w[0] + 0.3 * h, w[0] + 0.8 * h]
    });
    inner.chain(table.breaks.last().copied()).collect()
}

fn samples(n: usize, span: f64, f: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    (0..=n).map(|k| span * k as f64 / n as f64).map(|x| [x, f(x)]).collect()
}

fn largest_error(table: &Table, span: f64, f: impl Fn(f64) -> f64) -> f64 {
    (0..=2000).map(|k| span * f64::from(k) / 2000.0).map(|x| (table.derivative(x, 0) - f(x)).abs()).fold(0.0, f64::max)
}
