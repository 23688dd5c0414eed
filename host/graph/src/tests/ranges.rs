//! Ranges of nodes contain their values and slopes, of all operations.

use element_api::Table;
use element_api::table::{Interpolation, Outside};
use odyn_numerics::interval::Range;

use crate::{Graph, Node, Program, Ranges};

/// Along these straight lines run the three inputs, from 0 to 1.
const LINES: [[f64; 2]; 4] = [[0.3, 1.1], [-0.8, 0.9], [2.0, 1.4], [-3.0, 3.5]];

fn every_operation(g: &mut Graph) -> Vec<Node> {
    let [x, y, z, w] = [0, 1, 2, 3].map(|slot| g.input(slot));
    g.tables.push(
        Table::through(&[[-2.0, 1.0], [0.0, 0.5], [0.4, 3.0], [2.0, -1.0]], Interpolation::Spline, Outside::Clamped)
            .unwrap(),
    );
    g.tables.push(
        Table::through(&[[0.0, 0.0], [0.5, 1.0], [0.7, -2.0], [1.0, 0.0]], Interpolation::Linear, Outside::Periodic)
            .unwrap(),
    );
    g.tables
        .push(Table::through(&[[-1.0, 0.0], [0.5, 1.0], [1.5, 4.0]], Interpolation::Steps, Outside::Clamped).unwrap());
    let half = g.constant(0.5);
    let zero = g.constant(0.0);
    let mut nodes = Vec::new();
    let minus = g.neg(y);
    nodes.push(g.select(y, zero, minus, y));
    nodes.push(g.select(x, half, y, z));
    nodes.push(g.select(x, y, x, y));
    for table in 0..3 {
        nodes.extend((0..2).map(|order| g.table(table, order, w)));
    }
    let (sum, difference) = (g.add(x, y), g.sub(z, w));
    let (product, square) = (g.mul(sum, difference), g.mul(w, w));
    nodes.extend([sum, difference, product, square, g.div(y, z), g.div(y, w), g.sqrt(z), g.ln(z), g.exp(y), g.tanh(w)]);
    nodes.extend([g.sin(w), g.cos(w), g.atan2(y, x), g.atan2(y, minus), g.powi(y, 3), g.powi(z, -2), g.powf(z, 1.5)]);
    let (sine, cosine) = (g.sin(square), g.cos(product));
    let mixed = g.mul(sine, cosine);
    nodes.push(g.add(mixed, product));
    nodes
}

#[test]
fn values_and_slopes_lie_in_their_ranges_whatever_the_piece() {
    let mut g = Graph::default();
    let nodes = every_operation(&mut g);
    let program = Program::compile(&g, &nodes);
    let mut workspace = program.workspace();
    let mut at = |s: f64| {
        let inputs = LINES.map(|[from, to]| from + s * (to - from));
        let mut found = vec![0.0; nodes.len()];
        program.run(&inputs, &[], &mut workspace, &mut found).unwrap();
        found
    };
    let mut ranges = Ranges::new(&g, &nodes);
    let slots = ranges.inputs().to_vec();
    for pieces in [1, 3, 20, 300] {
        for piece in 0..pieces {
            let ends = [piece, piece + 1].map(|k| f64::from(k) / f64::from(pieces));
            let input = |place: usize| {
                let [from, to] = LINES[slots[place]];
                Range::even(from + ends[0] * (to - from), from + ends[1] * (to - from))
            };
            let mut found = vec![Range::UNKNOWN; nodes.len()];
            ranges.evaluate(input, |_| true, &mut found);
            let (first, last) = (at(ends[0]), at(ends[1]));
            let mut before = first.clone();
            for k in 1..=20 {
                let now = at(ends[0] + f64::from(k) / 20.0 * (ends[1] - ends[0]));
                for (n, range) in found.iter().enumerate() {
                    let slack = 1e-9 * (1.0 + now[n].abs());
                    assert!(
                        range.value.widened(slack).contains(now[n]),
                        "{:?}: {} in {range:?}",
                        g.expr(nodes[n]),
                        now[n]
                    );
                    let between = range.between(first[n], last[n]);
                    assert!(
                        between.widened(slack).contains(now[n]),
                        "{:?}: {} in {between:?}",
                        g.expr(nodes[n]),
                        now[n]
                    );
                    let slope = 20.0 * (now[n] - before[n]);
                    let slack = 1e-6 * (1.0 + slope.abs());
                    assert!(
                        range.slope.widened(slack).contains(slope),
                        "{:?}: slope {slope} in {range:?}",
                        g.expr(nodes[n])
                    );
                }
                before = now;
            }
            // What is smooth is known sharply on a short piece.
            if pieces == 300 {
                let last = found.last().unwrap();
                assert!(last.between(first[nodes.len() - 1], before[nodes.len() - 1]).width() < 0.2, "{last:?}");
            }
        }
    }
}

#[test]
fn a_difference_of_what_changes_alike_stays_sharp() {
    let mut g = Graph::default();
    // Two ways of about 1 m that change by 0.01 m, and differ by a tenth of that, as a divisor.
    let [x, y] = [g.input(0), g.input(1)];
    let [longer, shorter] = [g.sin(x), g.sin(y)];
    let apart = g.sub(longer, shorter);
    let one = g.constant(1.0);
    let quotient = g.div(one, apart);
    let mut ranges = Ranges::new(&g, &[apart, quotient]);
    let mut found = [Range::UNKNOWN; 2];
    let input = |place: usize| if place == 0 { Range::even(0.501, 0.511) } else { Range::even(0.5, 0.51) };
    ranges.evaluate(input, |_| true, &mut found);
    let exact = |x: f64| (x + 1e-3).sin() - x.sin();
    // From the values alone it would be known to lie between -0.008 and 0.01, and nothing of the quotient.
    let [apart, quotient] = found.map(|range| range.value);
    for k in 0..=10 {
        let value = exact(0.5 + 1e-3 * f64::from(k));
        assert!(apart.contains(value) && quotient.contains(1.0 / value), "{apart:?} {quotient:?} {value}");
    }
    assert!(apart.width() < 2e-4, "{apart:?}");
}

#[test]
fn only_what_is_wanted_is_evaluated() {
    let mut g = Graph::default();
    let nodes = every_operation(&mut g);
    let mut ranges = Ranges::new(&g, &nodes);
    let slots = ranges.inputs().to_vec();
    let over = |from: f64, to: f64| {
        let slots = slots.clone();
        move |place: usize| {
            let [start, end] = LINES[slots[place]];
            Range::even(start + from * (end - start), start + to * (end - start))
        }
    };
    let mut all = vec![Range::UNKNOWN; nodes.len()];
    ranges.evaluate(over(0.25, 0.5), |_| true, &mut all);
    for one in 0..nodes.len() {
        // What is left from another piece has no part in it.
        ranges.evaluate(over(0.5, 1.0), |_| true, &mut vec![Range::UNKNOWN; nodes.len()]);
        let mut found = vec![Range::UNKNOWN; nodes.len()];
        ranges.evaluate(over(0.25, 0.5), |k| k == one, &mut found);
        for (k, range) in found.iter().enumerate() {
            let expected = if k == one { all[k] } else { Range::UNKNOWN };
            assert!(format!("{range:?}") == format!("{expected:?}"), "{k}: {range:?} {expected:?}");
        }
    }
}
