//! What tables are between their points, and where they are not smooth.

use std::f64::consts::{PI, TAU};

use crate::params::ParamType;
use crate::table::Interpolation::{self, Linear, Monotone, Spline, Steps};
use crate::table::Outside::{Clamped, Periodic};
use crate::table::{Outside, Table};
use crate::testkit::Random;
use crate::{Curve, Function};

/// A jump from 0 to 10 within a fiftieth of the range.
const JUMP: [[f64; 2]; 4] = [[0.0, 0.0], [0.4, 0.0], [0.42, 10.0], [1.0, 10.0]];

fn through(points: &[[f64; 2]], interpolation: Interpolation, outside: Outside) -> Table {
    Table::through(points, interpolation, outside).expect("sound")
}

/// Points over several decades of spacing and size, some of them level; closed if periodic.
fn rough_points(random: &mut Random, outside: Outside) -> Vec<[f64; 2]> {
    let mut x = random.between(-5.0, 5.0);
    let mut y = 0.0;
    let mut points = Vec::new();
    for _ in 0..12 {
        points.push([x, y]);
        x += 10.0_f64.powf(random.between(-3.0, 1.0));
        if random.between(0.0, 1.0) > 0.25 {
            y += random.between(-1.0, 1.0) * 10.0_f64.powf(random.between(-3.0, 2.0));
        }
    }
    if outside == Periodic {
        points[11][1] = points[0][1];
    }
    points
}

/// Smallest and largest value on a fine grid between two points.
fn range(table: &Table, from: f64, to: f64) -> (f64, f64) {
    let at = |k: u32| (from + (to - from) * f64::from(k) / 200.0).min(to.next_down());
    let values = (0..=200).map(|k| table.derivative(at(k), 0));
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)))
}

#[test]
fn all_interpolations_go_through_their_points() {
    let mut random = Random::new(71);
    for outside in [Clamped, Periodic] {
        for (name, interpolation) in Interpolation::ALL {
            let points = rough_points(&mut random, outside);
            let table = through(&points, interpolation, outside);
            assert!(table.is_sound(), "{name}");
            let size = points.iter().fold(0.0_f64, |a, p| a.max(p[1].abs()));
            for [x, y] in points {
                let error = (table.derivative(x, 0) - y).abs();
                assert!(error <= 1e-11 * size, "{name}, {outside:?}: off by {error:e} at {x}");
            }
        }
    }
}

#[test]
fn only_a_spline_leaves_the_values_of_neighbouring_points() {
    let (low, high) = range(&through(&JUMP, Spline, Clamped), 0.0, 1.0);
    assert!(low < -30.0 && high > 60.0, "{low} .. {high}");
    let mut random = Random::new(72);
    for outside in [Clamped, Periodic] {
        for trial in 0..300 {
            let points = if trial == 0 { JUMP.to_vec() } else { rough_points(&mut random, outside) };
            if outside == Periodic && trial == 0 {
                continue;
            }
            let steepest = points.windows(2).map(|w| ((w[1][1] - w[0][1]) / (w[1][0] - w[0][0])).abs());
            // A period that is subtracted rounds the argument.
            let round_off = if outside == Periodic { 1e-14 * (1.0 + points[11][0].abs()) } else { 0.0 };
            let round_off = round_off * steepest.fold(0.0, f64::max);
            for interpolation in [Monotone, Linear, Steps] {
                let table = through(&points, interpolation, outside);
                for pair in points.windows(2) {
                    let [[a, y], [b, z]] = [pair[0], pair[1]];
                    let (low, high) = range(&table, a, b);
                    let slack = 1e-13 * (y.abs() + z.abs()) + round_off;
                    let within = low >= y.min(z) - slack && high <= y.max(z) + slack;
                    assert!(within, "{interpolation:?}: {low} .. {high} between {y} and {z}");
                }
            }
        }
    }
}

#[test]
fn a_monotone_table_rises_and_falls_with_its_points() {
    let mut random = Random::new(73);
    for _ in 0..200 {
        let points = rough_points(&mut random, Clamped);
        let table = through(&points, Monotone, Clamped);
        for pair in points.windows(2) {
            let chord = pair[1][1] - pair[0][1];
            let slope = (chord / (pair[1][0] - pair[0][0])).abs();
            for k in 1..100 {
                let x = pair[0][0] + (pair[1][0] - pair[0][0]) * f64::from(k) / 100.0;
                let found = table.derivative(x, 1) * if chord < 0.0 { -1.0 } else { 1.0 };
                assert!(found >= -1e-11 * slope, "slope {found:e} between {:?} and {:?}", pair[0], pair[1]);
            }
        }
    }
}

#[test]
fn values_far_away_do_not_matter_to_a_monotone_table() {
    let mut random = Random::new(74);
    let points = rough_points(&mut random, Clamped);
    let mut other = points.clone();
    other[9][1] += 1e3;
    let (table, other) = (through(&points, Monotone, Clamped), through(&other, Monotone, Clamped));
    assert_eq!(table.pieces[..7], other.pieces[..7]);
    assert_ne!(table.pieces[7], other.pieces[7]);
}

#[test]
fn straight_lines_are_reproduced_by_all_but_steps() {
    let points: Vec<[f64; 2]> = (0..6).map(|k| f64::from(k * k)).map(|x| [x, 3.0 - 2.0 * x]).collect();
    for interpolation in [Monotone, Linear, Spline] {
        let table = through(&points, interpolation, Clamped);
        for k in 0..=100 {
            let x = 0.25 * f64::from(k);
            assert!((table.derivative(x, 0) - (3.0 - 2.0 * x)).abs() < 1e-12, "{interpolation:?} at {x}");
        }
        let ends: Vec<_> = table.kinks().collect();
        assert_eq!(ends, [(0.0, 1), (25.0, 1)], "{interpolation:?}");
    }
}

#[test]
fn errors_shrink_with_the_powers_of_the_spacing_that_the_literature_gives() {
    // A rising function without level places, on points of uneven spacing.
    let f = |x: f64| x + 0.3 * (2.0 * x).sin();
    let error = |n: u32, interpolation| {
        let at = |k: u32| PI * f64::from(k) / f64::from(n);
        let points: Vec<[f64; 2]> = (0..=n).map(|k| at(k) + 0.1 * (at(k)).sin()).map(|x| [x, f(x)]).collect();
        let table = through(&points, interpolation, Clamped);
        (0..=3000)
            .map(|k| PI * f64::from(k) / 3000.0)
            .map(|x| (table.derivative(x, 0) - f(x)).abs())
            .fold(0.0, f64::max)
    };
    for (interpolation, power) in [(Monotone, 3.0), (Linear, 2.0), (Steps, 1.0)] {
        let found = (error(64, interpolation) / error(128, interpolation)).log2();
        assert!((found - power).abs() < 0.25, "{interpolation:?}: order {found} instead of {power}");
    }
}

#[test]
fn steps_hold_each_value_up_to_the_next_point() {
    let points = [[0.0, 1.0], [1.0, 3.0], [2.5, -1.0]];
    let table = through(&points, Steps, Clamped);
    for (x, y) in [
        (-9.0, 1.0),
        (0.0, 1.0),
        (1.0_f64.next_down(), 1.0),
        (1.0, 3.0),
        (2.5_f64.next_down(), 3.0),
        (2.5, -1.0),
        (9.0, -1.0),
    ] {
        assert_eq!(table.derivative(x, 0), y, "at {x}");
        assert_eq!(table.derivative(x, 1), 0.0, "at {x}");
    }
    assert_eq!(table.kinks().collect::<Vec<_>>(), [(1.0, 0), (2.5, 0)]);
    let table = through(&[[0.0, 1.0], [1.0, 3.0], [2.5, 1.0]], Steps, Periodic);
    for (x, y) in [(0.5, 1.0), (2.4, 3.0), (2.5, 1.0), (3.6, 3.0), (-0.1, 3.0)] {
        assert_eq!(table.derivative(x, 0), y, "at {x}");
    }
    assert_eq!(table.kinks().collect::<Vec<_>>(), [(0.0, 0), (1.0, 0)]);
    assert_eq!(table.period(), Some(2.5));
}

/// What `kinks` must give, by looking at both sides of each break point.
fn kinks_by_looking(table: &Table) -> Vec<(f64, u32)> {
    let step = |x: f64| 1e-9 * x.abs().max(1.0);
    let count = table.breaks.len() - usize::from(table.outside == Periodic);
    let order = |x: f64| {
        let size = |order: u32| {
            let near = [-2.0, -1.0, 1.0, 2.0].map(|k| table.derivative(x + k * step(x), order).abs());
            near.into_iter().fold(1.0, f64::max)
        };
        (0..3).find(|order| {
            let (left, right) = (table.derivative(x - step(x), *order), table.derivative(x + step(x), *order));
            (left - right).abs() > 1e-5 * size(*order)
        })
    };
    // The last piece of held steps is too narrow to be looked at.
    let narrow = |k: usize| k > 0 && table.breaks[k] - table.breaks[k - 1] < 1e-6;
    (0..count).filter(|k| !narrow(*k)).filter_map(|k| Some((table.breaks[k], order(table.breaks[k])?))).collect()
}

#[test]
fn kinks_are_where_a_look_at_both_sides_finds_them() {
    // Points a few tenths apart, so that looking is not fooled by steep slopes.
    let mut random = Random::new(75);
    let mut found = [0; 3];
    for outside in [Clamped, Periodic] {
        for (name, interpolation) in Interpolation::ALL {
            for _ in 0..20 {
                let count = 4 + random.between(0.0, 5.0) as usize;
                let mut points: Vec<[f64; 2]> = (0..count)
                    .map(|k| [k as f64 + random.between(0.0, 0.5), random.between(-2.0, 2.0).round()])
                    .collect();
                if outside == Periodic {
                    points[count - 1][1] = points[0][1];
                }
                let table = through(&points, interpolation, outside);
                let kinks: Vec<_> = table.kinks().collect();
                assert_eq!(kinks, kinks_by_looking(&table), "{name}, {outside:?}: {points:?}");
                for (_, order) in kinks {
                    found[order as usize] += 1;
                }
            }
        }
    }
    assert!(found.iter().all(|count| *count > 50), "{found:?}");
}

#[test]
fn round_off_is_no_kink() {
    let mut random = Random::new(76);
    for outside in [Clamped, Periodic] {
        for _ in 0..500 {
            let points = rough_points(&mut random, outside);
            let inner: Vec<_> = match outside {
                Clamped => points[1..points.len() - 1].iter().map(|p| p[0]).collect(),
                Periodic => points.iter().map(|p| p[0]).collect(),
            };
            let spline = through(&points, Spline, outside);
            assert!(spline.kinks().all(|(x, _)| !inner.contains(&x)), "{outside:?}: {points:?}");
            assert!(through(&points, Monotone, outside).kinks().all(|(x, order)| order == 2 || !inner.contains(&x)));
        }
    }
    let level = through(&[[0.0, 5.0], [1.0, 5.0], [2.0, 5.0]], Monotone, Clamped);
    assert_eq!(level.kinks().count(), 0);
}

#[test]
fn an_unsound_table_has_no_kinks() {
    let broken = Table { breaks: vec![0.0], pieces: vec![[1.0; 4]; 3], outside: Clamped };
    assert_eq!((broken.kinks().count(), broken.period()), (0, None));
}

#[test]
fn a_period_of_two_pieces_is_enough_except_for_a_spline() {
    let points = [[0.0, 1.0], [1.0, 2.0], [TAU, 1.0]];
    for (name, interpolation) in Interpolation::ALL {
        let table = Table::through(&points, interpolation, Periodic);
        assert_eq!(table.is_err(), interpolation == Spline, "{name}");
        assert!(Table::through(&points[..2], interpolation, Periodic).is_err(), "{name}");
        assert_eq!((name.parse(), interpolation.name()), (Ok(interpolation), name));
    }
    assert_eq!("cubic".parse::<Interpolation>(), Err(()));
    assert_eq!(Interpolation::default(), Monotone);
}

fn toml_of(text: &str) -> toml::Value {
    let table: toml::Table = format!("x = {text}").parse().expect("TOML");
    table["x"].clone()
}

#[test]
fn a_function_of_a_scene_has_the_interpolation_that_it_names() {
    let read = |text: &str| Function::read_named(&toml_of(text), "f");
    let points = "[[0, 0], [0.4, 0], [0.42, 10], [1, 10]]";
    for (name, interpolation) in Interpolation::ALL {
        let function = read(&format!("{{ points = {points}, interpolation = \"{name}\" }}")).expect("sound");
        let table = through(&JUMP, interpolation, Clamped);
        for k in -2..=12 {
            let x = 0.1 * f64::from(k) + 0.01;
            assert_eq!(function.at(x), table.derivative(x, 0), "{name} at {x}");
        }
        // The last value of a spline is computed.
        let again = Function::read_value(&function.write()).expect("sound");
        assert_eq!(function.write()["interpolation"].as_str(), Some(name));
        assert!(
            (0..100).map(|k| 0.02 * f64::from(k) - 0.5).all(|x| (again.at(x) - function.at(x)).abs() < 1e-11),
            "{name}"
        );
        let closed =
            format!("{{ points = [[0, 1], [1, 3], [2, -1], [3, 1]], interpolation = \"{name}\", periodic = true }}");
        let closed = read(&closed).expect("sound");
        assert_eq!(Function::read_value(&closed.write()), Some(closed), "{name}, periodic");
    }
    assert_eq!(read(points).expect("sound").at(0.2), 0.0, "monotone is the default");
    for (text, words) in [
        ("\"cubic\"", "has the interpolation \"cubic\": it must be one of \"monotone\""),
        ("3", "has the interpolation 3"),
    ] {
        let error = read(&format!("{{ points = {points}, interpolation = {text} }}")).expect_err(text);
        assert!(error.path == "f" && error.message.contains(words), "{error}");
    }
}

#[test]
fn a_curve_of_a_scene_has_points_and_may_name_an_interpolation() {
    let read = |text: &str| Curve::read_named(&toml_of(text), "c");
    let plain = read("[[0, 1], [1, 3]]").expect("sound");
    assert_eq!(plain, Curve { points: vec![[0.0, 1.0], [1.0, 3.0]], interpolation: None });
    let steps = read("{ points = [[0, 1], [1, 3]], interpolation = \"steps\" }").expect("sound");
    assert_eq!(steps.table(Clamped).expect("sound").derivative(0.9, 0), 1.0);
    for curve in [plain, steps] {
        assert_eq!(Curve::read_value(&curve.write()), Some(curve));
    }
    for text in
        ["3", "[[0, 1, 2]]", "{ interpolation = \"steps\" }", "{ points = [[0, 1], [1, 3]], interpolation = 1 }"]
    {
        assert_eq!(read(text).expect_err(text).path, "c");
    }
}
