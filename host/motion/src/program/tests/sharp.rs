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

/// Of a spline through points of a sine, and of its derivatives: the denser the points, the closer it is to a smooth function.
#[test]
fn knots_are_where_a_curve_is_bent_by_more_than_a_share_of_its_range() {
    for (count, order, share, expected) in [
        (31, 0, 1e-7, 25..=31),
        (1001, 0, 1e-7, 0..=10),
        (1001, 0, 1e-12, 900..=1001),
        (1001, 2, 1e-7, 900..=1001),
        (10_001, 0, 1e-12, 0..=10),
        (10_001, 1, 1e-12, 9000..=10_001),
    ] {
        let found = prepared(&scenes::pendulum(""));
        let (mut equations, layout) = (found.equations, found.plan.layout);
        let at = |k: u32| 10.0 * f64::from(k) / f64::from(count - 1);
        let points: Vec<[f64; 2]> = (0..count).map(|k| [at(k), (2.0 * at(k)).sin()]).collect();
        let g = &mut equations.graph;
        g.tables.push(Table::through(&points, Interpolation::Spline, Outside::Clamped).unwrap());
        let (table, t) = (g.tables.len() as u32 - 1, g.input(0));
        equations.loads[0] = g.table(table, order, t);
        let sharp = Sharp::find(&equations, &layout, share);
        let knots = sharp.knots.first().map_or(0, |(_, knots)| knots.breaks.len());
        assert!(expected.contains(&knots), "{count} points, order {order}, {share}: {knots} knots");
    }
}

/// As those that a function of two variables is made of.
#[test]
fn tables_over_one_argument_are_watched_together() {
    let found = prepared(&scenes::pendulum(""));
    let (mut equations, layout) = (found.equations, found.plan.layout);
    let g = &mut equations.graph;
    let x = g.input(layout.body_slot(0, 0));
    let mut sum = x;
    for points in [[[0.0, 0.0], [1.0, 2.0], [3.0, 0.0]], [[0.0, 1.0], [2.0, 2.0], [4.0, 0.0]]] {
        g.tables.push(Table::through(&points, Interpolation::Linear, Outside::Clamped).unwrap());
        let curve = g.table(g.tables.len() as u32 - 1, 0, x);
        sum = g.add(sum, curve);
    }
    equations.loads[0] = sum;
    let corners = Sharp::find(&equations, &layout, 1e-11).corners;
    assert_eq!(corners.len(), 2);
    for at in [0.0, 1.0, 2.0, 3.0, 4.0] {
        let changes = |sides: &Table| sides.derivative(at - 0.1, 0) * sides.derivative(at + 0.1, 0) < 0.0;
        assert_eq!(corners.iter().filter(|(_, sides)| changes(sides)).count(), 1, "{at}");
    }
}

#[test]
fn what_may_be_sharp_is_found_and_geometry_is_not() {
    let found = prepared(&scenes::pendulum(""));
    let (mut equations, layout) = (found.equations, found.plan.layout);
    assert_eq!(Sharp::find(&equations, &layout, 1e-11), Sharp::default());
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
    let sharp = Sharp::find(&equations, &layout, 1e-11);
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
