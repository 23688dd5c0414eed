//! What may be sharp is found, with the knots and corners of tables.

use element_api::Table;
use element_api::table::{Interpolation, Outside};

use crate::program::{Knots, Sharp};
use crate::tests::{prepared, scenes};

#[test]
fn knots_next_to_a_number_repeat_with_the_period() {
    let knots = Knots { breaks: vec![0.0, 0.5, 0.75], repeats: Some((0.0, 1.0)) };
    assert_eq!(knots.around(0.6), (0.5, 0.75));
    assert_eq!(knots.around(0.75), (0.75, 1.0));
    let (low, high) = knots.around(-0.1);
    assert!((low + 0.25).abs() < 1e-15 && high.abs() < 1e-15, "{low} {high}");
    assert_eq!(knots.around(12.55), (12.5, 12.75));
    let once = Knots { breaks: vec![1.0, 2.0], repeats: None };
    assert_eq!(once.around(0.0), (f64::NEG_INFINITY, 1.0));
    assert_eq!(once.around(2.0), (2.0, f64::INFINITY));
}

/// A table with jumps that repeats has one value up to the number before a knot, another one from the knot on, whatever round-off
/// the reduction of its argument has.
#[test]
fn knots_that_repeat_are_where_the_table_jumps() {
    for (first, period) in [(0.0, 0.7), (-0.3, 0.037), (1.0, 1.1e-5), (0.1, 3.0)] {
        let points = [[0.0, 1.0], [0.31, 2.0], [0.73, 3.0], [1.0, 1.0]].map(|[x, y]| [first + period * x, y]);
        let table = Table::through(&points, Interpolation::Steps, Outside::Periodic).unwrap();
        let breaks: Vec<f64> = table.kinks().map(|(at, _)| at).collect();
        let knots = Knots { breaks, repeats: Some((table.breaks[0], table.period().unwrap())) };
        let mut at = first - 10.0 * period;
        for _ in 0..3000 {
            let (low, high) = knots.around(at);
            let value = |x: f64| table.derivative(x, 0);
            assert!(low <= at && at < high && high - low < period, "{at}: {low} {high}");
            assert_eq!((value(low), value(high.next_down())), (value(at), value(at)), "{at}");
            assert!(value(high) != value(at) && value(low.next_down()) != value(at), "{at}: {low} {high}");
            at = high;
        }
    }
}

#[test]
fn what_may_be_sharp_is_found_and_geometry_is_not() {
    let found = prepared(&scenes::pendulum(""));
    let (mut equations, layout) = (found.equations, found.plan.layout);
    assert_eq!(Sharp::find(&equations, &layout), Sharp::default());
    let g = &mut equations.graph;
    let (x, t) = (g.input(layout.body_slot(0, 0)), g.input(0));
    let bell = g.exp(x);
    let beat = g.sin(t);
    let carried = g.mul(bell, beat);
    g.tables
        .push(Table::through(&[[0.0, 0.0], [1.0, 2.0], [3.0, 0.0]], Interpolation::Linear, Outside::Clamped).unwrap());
    let over_time = g.table(g.tables.len() as u32 - 1, 0, t);
    let over_way = g.table(g.tables.len() as u32 - 1, 0, x);
    let sum = g.add(carried, over_time);
    equations.loads[0] = g.add(sum, over_way);
    let sharp = Sharp::find(&equations, &layout);
    assert_eq!(sharp.of_motion, [bell, over_way]);
    assert!(sharp.of_time.contains(&beat) && sharp.of_time.contains(&over_time));
    assert_eq!(sharp.knots.len(), 1);
    // Held at its ends, the table has corners at all its points: at every other one of them one of two functions changes its sign.
    let sides: Vec<&Table> = sharp.corners.iter().map(|(_, sides)| sides).collect();
    let [outer, inner] = sides[..] else { panic!("{}", sides.len()) };
    for (x, signs) in [
        (-5.0, [1.0, 1.0]),
        (-0.1, [1.0, 1.0]),
        (0.0, [0.0, 1.0]),
        (0.5, [-1.0, 1.0]),
        (1.0, [-1.0, 0.0]),
        (2.0, [-1.0, -1.0]),
        (3.0, [0.0, -1.0]),
        (3.1, [1.0, -1.0]),
        (50.0, [1.0, -1.0]),
    ] {
        for (sides, sign) in [outer, inner].into_iter().zip(signs) {
            let value = sides.derivative(x, 0);
            assert!(value * sign > 0.0 || (sign == 0.0 && value.abs() < 1e-15), "{value} at {x}");
        }
    }
}
