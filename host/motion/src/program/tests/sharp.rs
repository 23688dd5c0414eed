//! What may be sharp is found, with the knots and corners of tables.

use element_api::Table;
use element_api::table::{Interpolation, Outside};

use crate::program::{Knots, Sharp};
use crate::tests::{prepared, scenes};

#[test]
fn knots_next_to_a_number_repeat_with_the_period() {
    let knots = Knots { breaks: vec![0.0, 0.5, 0.7], period: Some(1.0) };
    assert_eq!(knots.around(0.6), (0.5, 0.7));
    assert_eq!(knots.around(0.7), (0.7, 1.0));
    assert_eq!(knots.around(-0.1), (0.7 - 1.0, 0.0));
    assert_eq!(knots.around(12.55), (12.5, 12.7));
    let once = Knots { breaks: vec![1.0, 2.0], period: None };
    assert_eq!(once.around(0.0), (f64::NEG_INFINITY, 1.0));
    assert_eq!(once.around(2.0), (2.0, f64::INFINITY));
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
