//! [`Law`]: how a number of the equations follows parameters, found from values that it was seen to have.

/// How a number follows parameters. With d_i = p_i - base_i it is exactly the number that was recorded where all parameters are at
/// their base.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// The number at the base.
    pub at: f64,
    /// Which way the terms are put together.
    pub form: Form,
    /// Parameters, by their places, with two numbers each: see [`Form`].
    pub terms: Vec<(usize, [f64; 2])>,
}

/// Ways of following parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// at prod (p / base)^k, k whole: the first number of a term.
    Powers,
    /// at + sum (a d + b d^2)
    Polynomial,
    /// at / (1 + sum (a d + b d^2))
    Reciprocal,
}

/// Difference of a law from a number, as a share of the largest value of that number, that is rounding of how it was computed.
const ROUNDING: f64 = 1e-13;
/// The largest power looked for.
const MOST_POWER: i32 = 6;

/// Values of a number where one parameter alone was changed.
pub(crate) struct Alone<'a> {
    /// Place of the parameter.
    pub(crate) parameter: usize,
    /// The parameter at the base.
    pub(crate) base: f64,
    /// The parameter, and the number there.
    pub(crate) seen: &'a [(f64, f64)],
}

impl Law {
    /// The law of a number that is `at` at the base; `None` where none of those known fits.
    pub(crate) fn of(at: f64, alone: &[Alone<'_>]) -> Option<Self> {
        let forms = [Form::Powers, Form::Polynomial, Form::Reciprocal];
        forms.into_iter().find_map(|form| {
            let terms = alone.iter().map(|one| Some((one.parameter, term(at, form, one)?)));
            Some(Self { at, form, terms: terms.collect::<Option<_>>()? })
        })
    }

    /// The number where parameters have these values. `base`: theirs where it was recorded.
    #[must_use]
    pub fn value(&self, parameters: &[f64], base: &[f64]) -> f64 {
        match self.form {
            Form::Powers => {
                let mut value = self.at;
                for (parameter, [power, _]) in &self.terms {
                    let ratio = parameters[*parameter] / base[*parameter];
                    for _ in 0..power.abs() as i32 {
                        value = if *power > 0.0 { value * ratio } else { value / ratio };
                    }
                }
                value
            }
            Form::Polynomial => self.at + self.sum(parameters, base),
            Form::Reciprocal => self.at / (1.0 + self.sum(parameters, base)),
        }
    }

    fn sum(&self, parameters: &[f64], base: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (parameter, [a, b]) in &self.terms {
            let d = parameters[*parameter] - base[*parameter];
            sum += (a + b * d) * d;
        }
        sum
    }

    /// Whether it gives a number that was seen.
    pub(crate) fn gives(&self, seen: f64, parameters: &[f64], base: &[f64]) -> bool {
        same(self.value(parameters, base), seen, self.at)
    }
}

fn same(a: f64, b: f64, size: f64) -> bool {
    (a - b).abs() <= ROUNDING * size.abs().max(b.abs())
}

/// The numbers of a term for one parameter, if its values are those of the form.
fn term(at: f64, form: Form, one: &Alone<'_>) -> Option<[f64; 2]> {
    let fits = |numbers: [f64; 2]| {
        let law = Law { at, form, terms: vec![(0, numbers)] };
        one.seen.iter().all(|(p, seen)| law.gives(*seen, &[*p], &[one.base])).then_some(numbers)
    };
    if form == Form::Powers {
        return (1..=MOST_POWER).flat_map(|k| [k, -k]).find_map(|k| fits([f64::from(k), 0.0]));
    }
    // What (a d + b d^2) is at a value.
    let sum = |seen: f64| if form == Form::Polynomial { seen - at } else { at / seen - 1.0 };
    let [first, .., last] = one.seen else { return None };
    let slope = |(p, seen): (f64, f64)| (p - one.base, sum(seen) / (p - one.base));
    let ((d, u), (e, v)) = (slope(*first), slope(*last));
    let b = (v - u) / (e - d);
    let straight = fits([v, 0.0]);
    straight.or_else(|| fits([u - b * d, b]))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests {
    use super::*;

    fn law(number: impl Fn(f64) -> f64) -> Option<Law> {
        let seen: Vec<(f64, f64)> = [1.0, 1.5, 2.6, 4.0].map(|p| (p, number(p))).to_vec();
        Law::of(number(2.0), &[Alone { parameter: 0, base: 2.0, seen: &seen }])
    }

    #[test]
    fn numbers_that_follow_are_followed() {
        let known: [(&dyn Fn(f64) -> f64, Form); 6] = [
            (&|p| 3.0 * p, Form::Powers),
            (&|p| -0.7 / (p * p), Form::Powers),
            (&|p| 0.3 + 0.1 * p, Form::Polynomial),
            (&|p| 1.7 - p * p, Form::Polynomial),
            (&|p| 1.0 / (0.3 + p), Form::Reciprocal),
            (&|p| 2.0 / (0.3 + p + 4.0 * p * p), Form::Reciprocal),
        ];
        for (number, form) in known {
            let found = law(number).unwrap();
            assert_eq!(found.form, form);
            for p in [1.2, 2.0, 3.3] {
                let (value, exact) = (found.value(&[p], &[2.0]), number(p));
                assert!((value - exact).abs() < 1e-13 * exact.abs(), "{form:?} at {p}: {value} {exact}");
            }
            assert_eq!(found.value(&[2.0], &[2.0]), number(2.0));
        }
    }

    #[test]
    fn numbers_that_follow_in_another_way_are_not() {
        let unknown: [&dyn Fn(f64) -> f64; 4] =
            [&f64::sin, &|p| p.max(1.9), &|p| (1.0 + p) / (2.0 + p * p), &|p: f64| p.sqrt()];
        for number in unknown {
            assert_eq!(law(number), None);
        }
    }
}
