//! Bounds contain what they are bounds of, and close in on it.

use element_api::Jet;
use element_api::prelude::*;

use super::{Enclosed, Interval};

const FORMULAS: usize = 10;

fn tables() -> Vec<Table> {
    let points = [[-2.0, 0.3], [-1.1, -0.4], [0.2, 0.5], [0.7, 0.1], [2.0, 0.3]];
    let kinds = [Interpolation::Spline, Interpolation::Monotone, Interpolation::Linear];
    let made = |outside, kind| Table::through(&points, kind, outside).expect("the points are good");
    [Outside::Clamped, Outside::Periodic].iter().flat_map(|outside| kinds.map(|kind| made(*outside, kind))).collect()
}

fn function<S: Scalar>(number: usize, tables: &[Table], x: S) -> S {
    match number {
        0 => x.sin() * x.cos() + x.tanh(),
        1 => x.exp() / (x * x + 2.0),
        2 => -(x.powi(3) + x.powi(-2)),
        3 => ((x * x + 1.0).powf(1.5) - x).sqrt(),
        4 => (x * x + 0.3).ln() * x.atan(),
        5 => Scalar::atan2(S::from(2.0), x) + (x * 0.4).asin(),
        6 => x.abs().min(x.cos()).max(x * 0.2),
        7 => (x * 3.0).tan(),
        8 => S::select(x, S::from(0.3), x * x, S::from(0.09)),
        9 => (x * 0.5).powf(66.0) - (x * 0.4).powf(67.0),
        _ => x.lookup(&tables[number - FORMULAS]),
    }
}

fn holds(interval: Interval, x: f64) -> bool {
    let slack = 1e-12 * (1.0 + x.abs());
    x.is_nan() || (interval.low - slack <= x && x <= interval.high + slack)
}

#[test]
fn bounds_contain_values_and_derivatives_and_jumps_of_the_slope() {
    let tables = tables();
    for number in 0..FORMULAS + tables.len() {
        for k in 0_u32..400 {
            let width = [1.5, 0.2, 0.01, 0.0][k as usize % 4];
            let low = -2.3 + 4.6 * (0.618_034 * f64::from(k)).fract();
            let on = function(number, &tables, Enclosed::variable(low, low + width));
            let places = (0..=50).map(|n| low + width * f64::from(n) / 50.0);
            let jets: Vec<Jet> = places.map(|at| function(number, &tables, Jet::new(at, 1.0, 0.0))).collect();
            for jet in &jets {
                let contained =
                    holds(on.value, jet.value) && holds(on.first, jet.first) && holds(on.second, jet.second);
                assert!(contained, "{number} from {low} over {width}: {jet:?} in {on:?}");
            }
            // Four kinks at most: what the second derivative does not make of the slope, jumps do.
            let rise = jets[50].first - jets[0].first;
            let most = on.second.high.max(0.0) * width + 4.0 * on.jump.high;
            assert!(
                rise.is_nan() || !on.value.is_bounded() || rise <= most + 1e-9,
                "{number} from {low} over {width}: {rise} in {on:?}"
            );
        }
    }
}

#[test]
fn bounds_close_in() {
    let tables = tables();
    for number in (0..FORMULAS + tables.len()).filter(|number| ![2, 7].contains(number)) {
        for (width, at_most) in [(1e-2, 0.6), (1e-4, 6e-3)] {
            let low = -1.7;
            let on = function(number, &tables, Enclosed::variable(low, low + width));
            let loose = [on.value, on.first, on.second].map(|bound| bound.high - bound.low);
            assert!(loose.iter().all(|loose| *loose <= at_most), "{number}: {loose:?}");
            assert_eq!(on.jump, Interval::ZERO, "{number}");
        }
    }
}
