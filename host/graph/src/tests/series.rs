//! Power series against the interpreter, against themselves at other places, and where doubles cancel.

use odyn_numerics::precise::DoubleDouble as Number;

use super::derivatives::imported;
use super::*;

const ORDER: usize = 30;

/// The coefficients of all functions along x = sum `path[k][j]` t^j.
fn along(series: &mut Series, path: &[[f64; 3]]) {
    for order in 0..=ORDER {
        let at = |powers: &[f64; 3]| Number::from(powers.get(order).copied().unwrap_or(0.0));
        let inputs: Vec<Number> = path.iter().map(at).collect();
        series.run(order, &inputs);
    }
}

/// Values of all functions at t on that path.
fn values_at(series: &mut Series, path: &[[f64; 3]], t: f64) -> Vec<Number> {
    let t = Number::from(t);
    let at = |[a, b, c]: &[f64; 3]| Number::from(*a) + t * (Number::from(*b) + t * Number::from(*c));
    let inputs: Vec<Number> = path.iter().map(at).collect();
    series.run(0, &inputs);
    series.values().collect()
}

#[test]
fn values_are_those_of_the_interpreter() {
    let (graph, list) = imported();
    let nodes: Vec<Node> = list.iter().map(|(_, node)| *node).collect();
    let mut series = Series::new(&graph, &nodes, 0).unwrap();
    let mut random = Random(3);
    for _ in 0..200 {
        let at = [random.between(0.5, 2.0), random.between(-2.0, 2.0)];
        series.run(0, &at.map(Number::from));
        let plain = values(&graph, &nodes, &at);
        for (((name, _), found), plain) in list.iter().zip(series.values()).zip(plain) {
            let error = (found.to_f64() - plain).abs();
            assert!(error <= 2e-15 * (1.0 + plain.abs()), "{name} at {at:?}: {found:?} is not {plain}");
        }
    }
}

/// The sum of a series is the value at another place, to nearly all digits: so each recurrence is right to every order.
#[test]
fn sums_of_series_are_values_elsewhere() {
    let (graph, list) = imported();
    let nodes: Vec<Node> = list.iter().map(|(_, node)| *node).collect();
    let mut series = Series::new(&graph, &nodes, ORDER).unwrap();
    let mut elsewhere = series.clone();
    let mut random = Random(5);
    let t = 0.01;
    for _ in 0..30 {
        let mut path = |low, high| [random.between(low, high), random.between(-1.0, 1.0), random.between(-1.0, 1.0)];
        let path = [path(0.5, 2.0), path(-2.0, 2.0)];
        along(&mut series, &path);
        let mut holds = true;
        series.conditions(ORDER, |function, positive| {
            let sum = function.iter().rev().fold(Number::ZERO, |sum, c| sum * Number::from(t) + *c);
            holds &= (sum > Number::ZERO) == positive;
        });
        if !holds {
            continue;
        }
        for (k, value) in values_at(&mut elsewhere, &path, t).into_iter().enumerate() {
            let sum =
                (0..=ORDER).rev().fold(Number::ZERO, |sum, order| sum * Number::from(t) + series.output(k, order));
            let error = (sum - value).abs().to_f64() / (1.0 + value.abs().to_f64());
            assert!(error < 1e-27, "{}: {sum:?} is not {value:?} on {path:?}", list[k].0);
        }
    }
}

/// (1 + x) - 1 for a small x: doubles keep nothing of it.
#[test]
fn what_cancels_keeps_its_digits() {
    let mut g = Graph::default();
    let (x, one) = (g.input(0), g.constant(1.0));
    let root = {
        let sum = g.add(one, x);
        g.sqrt(sum)
    };
    let node = g.sub(root, one);
    let mut series = Series::new(&g, &[node], 0).unwrap();
    series.run(0, &[Number::from(1e-12)]);
    // sqrt(1 + x) - 1 = x / 2 - x^2 / 8 + ...
    let exact = 0.5e-12 - 0.125e-24;
    let found = series.values().next().unwrap().to_f64();
    assert!((found / exact - 1.0).abs() < 1e-15, "{found} is not {exact}");
    assert!((value(&g, node, &[1e-12]) / exact - 1.0).abs() > 1e-5, "doubles do not cancel here");
}

/// A differential equation grows term by term: x'' = -x gives the cosine.
#[test]
fn solutions_grow_term_by_term() {
    let mut g = Graph::default();
    let x = g.input(0);
    let rate = g.neg(x);
    let mut series = Series::new(&g, &[rate], ORDER).unwrap();
    let (mut x, mut v) = (vec![Number::ONE], vec![Number::ZERO]);
    for k in 0..ORDER {
        series.run(k, &[x[k]]);
        let next = Number::from((k + 1) as f64);
        x.push(v[k] / next);
        v.push(series.output(0, k) / next);
    }
    let t = Number::from(0.7);
    let sum = x.iter().rev().fold(Number::ZERO, |sum, c| sum * t + *c);
    let error = (sum - t.sin_cos().1).abs().to_f64();
    assert!(error < 1e-30, "{error:e}");
}
