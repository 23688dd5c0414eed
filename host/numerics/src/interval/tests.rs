//! Ranges contain what they should, and are sharp where they can be.

use super::*;

/// Many numbers of an interval.
fn numbers(of: Interval) -> impl Iterator<Item = f64> {
    (0..=200).map(move |k| of.low + (of.high - of.low) * f64::from(k) / 200.0)
}

fn intervals() -> Vec<Interval> {
    [(-2.0, -0.5), (-1.0, 2.0), (0.25, 3.0), (-4.0, 5.0), (1.5, 1.5), (3.0, 9.5), (-0.1, 0.0)]
        .map(|(low, high)| Interval::new(low, high))
        .to_vec()
}

/// A function of intervals, and of numbers.
type One = (&'static str, fn(Interval) -> Interval, fn(f64) -> f64);
type Two = (&'static str, fn(Interval, Interval) -> Interval, fn(f64, f64) -> f64);

#[test]
fn functions_of_one_number_are_enclosed_and_reached() {
    let functions: [One; 11] = [
        ("square", Interval::square, |x| x * x),
        ("sine", Interval::sin, f64::sin),
        ("cosine", Interval::cos, f64::cos),
        ("cube", |x| x.powi(3), |x| x.powi(3)),
        ("fourth power", |x| x.powi(4), |x| x.powi(4)),
        ("even power as a real one", |x| x.powf(66.0), |x| x.powf(66.0)),
        ("odd power as a real one", |x| x.powf(67.0), |x| x.powf(67.0)),
        ("negative", |x| -x, |x| -x),
        ("scaled", |x| x.scaled(-1.5), |x| -1.5 * x),
        ("exponential", |x| x.rising(f64::exp), f64::exp),
        ("inverse square", |x| (x + Interval::point(20.0)).powi(-2), |x| (x + 20.0).powi(-2)),
    ];
    for (name, of_interval, of_number) in functions {
        for x in intervals() {
            let range = of_interval(x).widened(1e-12);
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for value in numbers(x).map(of_number) {
                assert!(range.contains(value), "{name} of {x:?}: {value} is not in {range:?}");
                (low, high) = (low.min(value), high.max(value));
            }
            // As sharp as the numbers looked at can tell.
            let slack = 2e-3 * (1.0 + range.magnitude());
            assert!(
                low - range.low < slack && range.high - high < slack,
                "{name} of {x:?}: {range:?}, {low} to {high}"
            );
        }
    }
}

#[test]
fn functions_of_two_numbers_are_enclosed() {
    let functions: [Two; 5] = [
        ("sum", |a, b| a + b, |a, b| a + b),
        ("difference", |a, b| a - b, |a, b| a - b),
        ("product", |a, b| a * b, |a, b| a * b),
        ("quotient", |a, b| a / b, |a, b| a / b),
        ("angle", Interval::atan2, f64::atan2),
    ];
    for (name, of_intervals, of_numbers) in functions {
        for x in intervals() {
            for y in intervals() {
                let range = of_intervals(x, y).widened(1e-12);
                for a in numbers(x).step_by(20) {
                    for b in numbers(y).step_by(20).filter(|b| name != "quotient" || *b != 0.0) {
                        assert!(
                            range.contains(of_numbers(a, b)),
                            "{name} of {x:?} and {y:?} at {a} and {b}: {range:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn nothing_is_known_of_what_is_no_number() {
    assert_eq!(Interval::point(f64::NAN), Interval::ALL);
    assert_eq!(Interval::point(1.0) / Interval::new(-1.0, 1.0), Interval::ALL);
    assert_eq!(Interval::new(-2.0, -1.0).sqrt(), Interval::ALL);
    assert_eq!(Interval::ZERO * Interval::ALL, Interval::ZERO);
}

/// x - 2 x^3 + 0.3 x^7 on 0..1.
fn polynomial(x: f64) -> f64 {
    x - 2.0 * x.powi(3) + 0.3 * x.powi(7)
}

#[test]
fn polynomials_lie_within_their_ranges_on_every_piece() {
    let mut whole = Bernstein::default();
    whole.interpolate(7, 2, |s, values| values.copy_from_slice(&[polynomial(s), 5.0 - s]));
    assert!((whole.end(0, true) - polynomial(1.0)).abs() < 1e-13 && (whole.end(1, false) - 5.0).abs() < 1e-13);
    let mut pieces = vec![(0.0, 1.0, whole)];
    for _ in 0..4 {
        let mut halves = Vec::new();
        for (from, to, mut piece) in pieces {
            let mut left = Bernstein::default();
            piece.halve(&mut left);
            let middle = 0.5 * (from + to);
            halves.extend([(from, middle, left), (middle, to, piece)]);
        }
        pieces = halves;
        for (from, to, piece) in &pieces {
            let (range, slope) = (piece.range(0).widened(1e-12), piece.slope(0).widened(1e-11));
            let width: f64 = to - from;
            for s in numbers(Interval::new(*from, *to)) {
                assert!(range.contains(polynomial(s)));
                let derivative = 1.0 - 6.0 * s * s + 2.1 * s.powi(6);
                assert!(slope.contains(width * derivative));
            }
            // Second order: the surplus falls with the square of the width.
            let values: Vec<f64> = numbers(Interval::new(*from, *to)).map(polynomial).collect();
            let true_width = values.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b))
                - values.iter().fold(f64::INFINITY, |a, b| a.min(*b));
            assert!(range.width() < true_width + 8.0 * width * width, "{} for {true_width}", range.width());
        }
    }
}

/// What is exactly zero stays so: beside nothing else, round-off would be all there is.
#[test]
fn waves_of_a_point_are_those_of_numbers() {
    for x in [0.0, 0.3, -2.0, 700.0] {
        let point = Interval::point(x);
        assert_eq!((point.sin(), point.cos()), (Interval::point(x.sin()), Interval::point(x.cos())));
    }
    let (sine, half) = (Interval::new(1.0, 2.0).sin(), Interval::new(-2.0, 0.0).sin());
    assert_eq!((sine.low, sine.high, half.low, half.high), (1.0_f64.sin(), 1.0, -1.0, 0.0));
}

#[test]
fn slopes_make_ranges_sharp() {
    // x (1 - x) on a short piece: the product of ranges is wide, the mean value form is not.
    let range = Range { value: Interval::new(0.15, 0.35), slope: Interval::new(0.01, 0.03), middle: f64::NAN };
    assert_eq!(range.between(0.24, 0.26), Interval::new(0.24, 0.26));
    let bent = Range { value: Interval::new(0.0, 1.0), slope: Interval::new(-0.1, 0.1), middle: f64::NAN };
    let found = bent.between(0.5, 0.5);
    assert!(found.low >= 0.4 && found.high <= 0.6);
}
