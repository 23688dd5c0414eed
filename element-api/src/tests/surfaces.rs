//! Functions of two variables: through their points, between the corners, smooth.

use crate::surface::Surface;
use crate::table::Interpolation::{self, Linear, Monotone, Spline, Steps};
use crate::table::{Outside, Table};
use crate::testkit::Random;

const KINDS: [Interpolation; 3] = [Monotone, Linear, Spline];

fn rising(random: &mut Random, count: usize) -> Vec<f64> {
    let mut x = random.between(-3.0, 3.0);
    (0..count)
        .map(|_| {
            x += 10.0_f64.powf(random.between(-2.0, 1.0));
            x
        })
        .collect()
}

/// Values over several decades, some of them equal.
fn rough(random: &mut Random, count: usize) -> Vec<f64> {
    let value = |random: &mut Random| match random.between(0.0, 1.0) {
        part if part < 0.3 => 0.0,
        _ => random.between(-1.0, 1.0) * 10.0_f64.powf(random.between(-3.0, 2.0)),
    };
    (0..count).map(|_| value(random)).collect()
}

#[test]
fn surfaces_go_through_their_points_and_are_held_outside() {
    let mut random = Random::new(81);
    for kind in KINDS {
        for (columns, rows) in [(2, 2), (2, 5), (6, 3), (4, 4)] {
            let (x, y) = (rising(&mut random, columns), rising(&mut random, rows));
            let values = rough(&mut random, columns * rows);
            let size = values.iter().fold(0.0_f64, |a, z| a.max(z.abs()));
            let surface = Surface::through(&x, &y, &values, kind).expect("sound");
            for i in 0..columns {
                for j in 0..rows {
                    let error = (surface.at(x[i], y[j]) - values[i * rows + j]).abs();
                    assert!(error <= 1e-12 * size, "{kind:?}: off by {error:e}");
                }
            }
            for (at, nearest) in [((-1e3, 1e3), (x[0], y[rows - 1])), ((1e3, y[0]), (x[columns - 1], y[0]))] {
                let error = (surface.at(at.0, at.1) - surface.at(nearest.0, nearest.1)).abs();
                assert!(error <= 1e-12 * size, "{kind:?}");
            }
        }
    }
}

#[test]
fn cells_lie_between_their_corners_unless_they_are_splines() {
    let mut random = Random::new(82);
    for trial in 0..60 {
        let (columns, rows) = (2 + trial % 5, 2 + trial % 4);
        let (x, y) = (rising(&mut random, columns), rising(&mut random, rows));
        let values = rough(&mut random, columns * rows);
        let size = values.iter().fold(0.0_f64, |a, z| a.max(z.abs()));
        for kind in [Monotone, Linear] {
            let surface = Surface::through(&x, &y, &values, kind).expect("sound");
            for i in 1..columns {
                for j in 1..rows {
                    let corners = [(i - 1, j - 1), (i - 1, j), (i, j - 1), (i, j)].map(|(i, j)| values[i * rows + j]);
                    let low = corners.iter().copied().fold(f64::INFINITY, f64::min);
                    let high = corners.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                    for k in 0..100 {
                        let (s, t) = (f64::from(k % 10) / 9.0, f64::from(k / 10) / 9.0);
                        let z = surface.at(x[i - 1] + s * (x[i] - x[i - 1]), y[j - 1] + t * (y[j] - y[j - 1]));
                        let slack = 1e-10 * size;
                        assert!(z >= low - slack && z <= high + slack, "{kind:?}: {z} not in {low} .. {high}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_product_of_two_functions_is_the_product_of_their_tables() {
    let (x, y) = ([0.0, 0.4, 1.0, 2.5], [-1.0, 0.0, 0.5]);
    let (f, g) = ([1.0, 2.0, 2.5, 4.0], [2.0, 3.0, 5.0]);
    let values: Vec<f64> = f.iter().flat_map(|f| g.map(|g| f * g)).collect();
    let points = |x: &[f64], f: &[f64]| -> Vec<[f64; 2]> { x.iter().zip(f).map(|(x, f)| [*x, *f]).collect() };
    for kind in [Linear, Spline] {
        let surface = Surface::through(&x, &y, &values, kind).expect("sound");
        let table = |x: &[f64], f: &[f64]| Table::through(&points(x, f), kind, Outside::Clamped).expect("sound");
        let (f, g) = (table(&x, &f), table(&y, &g));
        for k in 0..200 {
            let (x, y) = (-0.5 + 0.02 * f64::from(k), -1.5 + 0.013 * f64::from(k));
            assert!((surface.at(x, y) - f.derivative(x, 0) * g.derivative(y, 0)).abs() < 1e-13, "{kind:?}");
        }
    }
    // Along the lines of a grid of a plane, monotone is the plane; so it is everywhere.
    let plane: Vec<f64> = x.iter().flat_map(|x| y.map(|y| 3.0 + x - 2.0 * y)).collect();
    for kind in KINDS {
        let surface = Surface::through(&x, &y, &plane, kind).expect("sound");
        for k in 0..100 {
            let (x, y) = (0.025 * f64::from(k), -1.0 + 0.015 * f64::from(k));
            assert!((surface.at(x, y) - (3.0 + x - 2.0 * y)).abs() < 1e-13, "{kind:?} at {x}, {y}");
        }
    }
}

#[test]
fn monotone_surfaces_have_continuous_slopes() {
    let mut random = Random::new(83);
    let (x, y) = ([0.0, 1.0, 1.5, 3.0], [0.0, 0.5, 2.0]);
    for _ in 0..20 {
        let values = rough(&mut random, 12);
        let size = values.iter().fold(0.0_f64, |a, z| a.max(z.abs()));
        let surface = Surface::through(&x, &y, &values, Monotone).expect("sound");
        let h = 1e-6;
        for k in 0..20 {
            let along = 0.02 + 0.147 * f64::from(k);
            for [at, step] in [[[1.0, along], [h, 0.0]], [[1.5, along], [h, 0.0]], [[along, 0.5], [0.0, h]]] {
                let z = |k: f64| surface.at(at[0] + k * step[0], at[1] + k * step[1]);
                let (left, right) = ((z(0.0) - z(-1.0)) / h, (z(1.0) - z(0.0)) / h);
                assert!((left - right).abs() < 1e-3 * size, "{left} and {right} at {at:?}");
            }
        }
    }
}

#[test]
fn grids_that_make_no_function_are_refused() {
    let line = [0.0, 1.0];
    for (x, y, values, kind, path, words) in [
        (&line[..], &line[..], &[1.0, 2.0, 3.0][..], Linear, "values", "needs 2 x 2 = 4 numbers, found 3"),
        (&[1.0, 0.0], &line, &[1.0; 4], Linear, "x", "1 is followed by 0"),
        (&line, &[0.0, 0.0], &[1.0; 4], Monotone, "y", "0 is followed by 0"),
        (&line[..1], &line, &[1.0; 2], Spline, "x", "at least 2 points"),
        (&line, &line, &[1.0, 2.0, f64::NAN, 0.0], Spline, "x", "NaN"),
        (&line, &line, &[1.0; 4], Steps, "interpolation", "not joined by steps"),
    ] {
        let error = Surface::through(x, y, values, kind).expect_err(words);
        assert!(error.path == path && error.message.contains(words), "{error}");
    }
}

#[test]
fn surfaces_are_read_from_what_scenes_give() {
    use crate::params::ParamType;
    let (x, y, values) = ([0.0, 1.0, 3.0], [-1.0, 2.0], [1.0, 2.0, 4.0, -3.0, 0.5, 7.0]);
    for kind in KINDS {
        let surface = Surface::through(&x, &y, &values, kind).expect("sound");
        let written = surface.write();
        assert_eq!(written["z"][1][0].as_float(), Some(4.0));
        assert_eq!(Surface::read_named(&written, "map"), Ok(surface));
    }
    for (text, words) in [
        ("p = 3", "must be a grid"),
        ("p = { x = [0, 1], y = [0, 1], z = [[0, 1]] }", "needs in `z` 2 lists of 2 numbers"),
        ("p = { x = [0, 1], y = [1, 1], z = [[0, 1], [0, 1]] }", "`y` arguments must increase"),
        ("p = { x = [0, 1], y = [0, 1], z = [[0, 1], [0, 1]], interpolation = \"steps\" }", "not joined by steps"),
    ] {
        let table: toml::Table = text.parse().expect("TOML");
        let error = Surface::read_named(&table["p"], "p").expect_err(text);
        assert!(error.path == "p" && error.message.contains(words), "{text}: {error}");
    }
}
