#![allow(clippy::unwrap_used)] // in a test, the panic is the message

use super::{DoubleDouble as Number, Ended, Expansion, Taylor};
use crate::random::Random;

/// The number that a decimal of at most 40 digits stands for.
fn decimal(text: &str) -> Number {
    let (whole, fraction) = text.trim_start_matches('-').split_once('.').unwrap_or((text, ""));
    let digits = whole.bytes().chain(fraction.bytes()).filter(u8::is_ascii_digit);
    let ten = Number::from(10.0);
    let value = digits.fold(Number::ZERO, |value, digit| value * ten + Number::from(f64::from(digit - b'0')));
    let value = fraction.bytes().fold(value, |value, _| value / ten);
    if text.starts_with('-') { -value } else { value }
}

#[track_caller]
fn assert_near(found: Number, text: &str) {
    let wanted = decimal(text);
    let error = (found - wanted).abs().to_f64() / wanted.abs().to_f64();
    assert!(error < 2e-30, "{found:?} instead of {text}: off by {error:e}");
}

#[test]
fn known_digits() {
    let at = |x: f64| Number::from(x);
    assert_near(at(2.0).sqrt(), "1.4142135623730950488016887242096980785697");
    assert_near(at(1.0) / at(3.0), "0.3333333333333333333333333333333333333333");
    assert_near(at(0.7).sin_cos().0, "0.644217687237691019706798090282512161274");
    assert_near(at(0.7).sin_cos().1, "0.764842187284488454864872359873962915851");
    assert_near(at(12345.678).sin_cos().0, "-0.70408131375338158541456649062671536417");
    assert_near(at(-1e6).sin_cos().1, "0.936752127533144786938532535074918775708");
    assert_near(at(0.7).exp(), "2.013752707470476432195964519184246838532");
    assert_near(at(100.25).exp(), "34516107331259239871361985995265746750923963.2");
    assert_near(at(-33.3).exp(), "0.00000000000000345138774437421628181003648619033063");
    assert_near(at(0.7).ln(), "-0.35667494393873244235395440410727451457");
    assert_near(at(1e10).ln(), "23.0258509299404568401799145468436420760110149");
    assert_near(at(0.01).tanh(), "0.00999966667999946054747492153204477123479250466");
    assert_near(at(-3.3).tanh(), "-0.997282960099142081610332662913108126902");
    assert_near(at(0.3).atan2(at(-0.7)), "2.73670086730470980557968231094974469606");
    assert_near(at(-2.5).atan2(at(0.1)), "-1.5308176396716065756008448311773957263");
    assert_near(at(2.5).powf(0.3), "1.316382204334237400112084292978802255039");
}

/// Identities that hold for exact numbers hold to the last digits, whatever the arguments.
#[test]
fn identities() {
    let mut random = Random(7);
    for _ in 0..2000 {
        let number = |random: &mut Random| Number::from(random.next()) + Number::from(1e-17 * random.next());
        let (a, b, c) = (number(&mut random), number(&mut random), number(&mut random));
        let near = |x: Number, y: Number, what: &str| {
            let error = (x - y).abs().to_f64();
            assert!(error < 1e-29, "{what}: {x:?} and {y:?} are apart by {error:e}");
        };
        near((a + b) * c, a * c + b * c, "distribution");
        near(a / b * b, a, "quotient");
        near((a + b) - a, b, "difference");
        let (sine, cosine) = (a + b).sin_cos();
        let ((sa, ca), (sb, cb)) = (a.sin_cos(), b.sin_cos());
        near(sine, sa * cb + ca * sb, "sine of a sum");
        near(cosine, ca * cb - sa * sb, "cosine of a sum");
        near(sa.atan2(ca), a, "angle");
        near((a + b).exp(), a.exp() * b.exp(), "exponential of a sum");
        near(a.exp().ln(), a, "logarithm");
        near((a * a).sqrt(), a.abs(), "root");
        let e = (a + a).exp();
        near(a.tanh(), (e - Number::ONE) / (e + Number::ONE), "hyperbolic tangent");
    }
}

#[test]
fn what_is_no_number_stays_none() {
    assert!(!Number::from(-1.0).sqrt().is_finite());
    assert!(!(Number::ONE / Number::ZERO).is_finite());
    assert!(!Number::from(800.0).exp().is_finite());
    assert_eq!(Number::from(-800.0).exp(), Number::ZERO);
}

/// x'' = -x inside of |x| < 1/2 and a free flight outside, to the left of which x is larger than the circle would be.
struct Ditch {
    order: usize,
    inside: bool,
    position: Vec<Number>,
}

const KINDS: [usize; 2] = [0, 1];
const EDGE: f64 = 0.5;

impl Expansion for Ditch {
    fn expand(&mut self, _: Number, state: &[Number], coefficients: &mut [Vec<Number>]) {
        coefficients[0].copy_from_slice(state);
        self.inside = state[0] < Number::from(EDGE);
        for k in 0..self.order {
            let [x, v] = [coefficients[k][0], coefficients[k][1]];
            let next = Number::from((k + 1) as f64);
            coefficients[k + 1][0] = v / next;
            coefficients[k + 1][1] = if self.inside { -x / next } else { Number::ZERO };
        }
        self.position = coefficients.iter().map(|list| list[0]).collect();
    }
    fn conditions(&self, told: &mut dyn FnMut(&[Number], bool)) {
        let mut function: Vec<Number> = self.position.iter().map(|c| -*c).collect();
        function[0] += Number::from(EDGE);
        told(&function, self.inside);
    }
    fn settle(&mut self, _: Number, _: Number, _: &mut [Number]) -> Result<(), String> {
        Ok(())
    }
    fn rates(&mut self, _: Number, state: &[Number], rates: &mut [Number]) {
        rates[0] = state[1];
        rates[1] = if state[0] < Number::from(EDGE) { -state[0] } else { Number::ZERO };
    }
    fn kinds(&self) -> &[usize] {
        &KINDS
    }
    fn units(&self) -> &[f64] {
        &[1.0; 2]
    }
    fn least(&self, _: usize, _: f64) -> f64 {
        0.0
    }
}

fn solve(order: usize, tolerance: f64, start: [f64; 2], times: &[f64]) -> Result<Vec<Number>, Ended> {
    let mut system = Ditch { order, inside: true, position: Vec::new() };
    let mut found = Vec::new();
    let method = Taylor { order, tolerance, longest: 100.0, most_steps: 1000 };
    let start = start.map(Number::from).to_vec();
    method.solve(&mut system, 0.0, start, times, |_, sampled| found.push(sampled.state[0]), |_| true)?;
    Ok(found)
}

#[test]
fn a_circle_has_the_sine() {
    let times: Vec<f64> = (0..200).map(|k| 0.31 * f64::from(k)).collect();
    let found = solve(30, 1e-28, [0.0, 0.25], &times).unwrap();
    for (t, x) in times.iter().zip(found) {
        let error = (x - Number::from(0.25) * Number::from(*t).sin_cos().0).abs().to_f64();
        assert!(error < 1e-28, "off by {error:e} at t = {t}");
    }
}

/// It leaves at t = asin(1/2) with a velocity of cos(t): switches are met to all digits.
#[test]
fn switches_are_met() {
    let found = solve(30, 1e-28, [0.0, 1.0], &[0.25, 2.0]).unwrap();
    let leaves = Number::from(0.5).atan2(Number::from(0.75).sqrt());
    let exact = Number::from(EDGE) + Number::from(0.75).sqrt() * (Number::from(2.0) - leaves);
    let error = (found[1] - exact).abs().to_f64();
    assert!(error < 1e-26, "off by {error:e}");
}

#[test]
fn too_many_steps_are_told() {
    let ended = solve(4, 1e-28, [0.0, 0.25], &[100.0]).unwrap_err();
    assert_eq!(ended.why, "it took too many steps");
}
