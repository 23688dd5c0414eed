//! Derivatives by differences, with their own doubt: near a kink or in a steep place no step is small enough, and the
//! answer is `None`.

/// Steps that are tried, one after the other. The error of the five-point differences is about step^4 and
/// rounding / step.
const STEPS: [f64; 4] = [2e-3, 4e-4, 8e-5, 1.6e-5];
/// Two steps must agree to this, relative to 1 + size of derivative and values.
const AGREEMENT: f64 = 2.5e-9;
/// Allowed deviation of derivatives from their differences, relative to the same.
pub(super) const DIFFERENCE: f64 = 1e-8;

/// Central differences: weights of f(k h) and the divisor, in powers of h.
struct Formula {
    weights: &'static [(f64, f64)],
    divisor: f64,
    power: i32,
}

/// (f(-2h) - 8 f(-h) + 8 f(h) - f(2h)) / 12 h
const FIRST: Formula =
    Formula { weights: &[(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)], divisor: 12.0, power: 1 };
/// (-f(-2h) + 16 f(-h) - 30 f(0) + 16 f(h) - f(2h)) / 12 h^2
const SECOND: Formula =
    Formula { weights: &[(-2.0, -1.0), (-1.0, 16.0), (0.0, -30.0), (1.0, 16.0), (2.0, -1.0)], divisor: 12.0, power: 2 };

/// First derivatives at 0 of functions whose values have the given sizes.
pub(super) fn slopes(f: impl Fn(f64) -> Vec<f64>, sizes: &[f64]) -> Vec<Option<f64>> {
    settled(&FIRST, &f, sizes, &STEPS)
}

/// Second derivatives at 0. Rounding forbids the smallest steps.
pub(super) fn curvatures(f: impl Fn(f64) -> Vec<f64>, sizes: &[f64]) -> Vec<Option<f64>> {
    settled(&SECOND, &f, sizes, &[4e-3, 2e-3])
}

fn settled(formula: &Formula, f: &dyn Fn(f64) -> Vec<f64>, sizes: &[f64], steps: &[f64]) -> Vec<Option<f64>> {
    let mut found = vec![None; sizes.len()];
    let mut before = formula.apply(f, steps[0], sizes.len());
    for step in &steps[1..] {
        let here = formula.apply(f, *step, sizes.len());
        for (k, slot) in found.iter_mut().enumerate() {
            let agree = (here[k] - before[k]).abs() <= AGREEMENT * (1.0 + here[k].abs() + sizes[k]);
            if slot.is_none() && agree {
                *slot = Some(here[k]);
            }
        }
        if found.iter().all(Option::is_some) {
            break;
        }
        before = here;
    }
    found
}

impl Formula {
    fn apply(&self, f: &dyn Fn(f64) -> Vec<f64>, step: f64, count: usize) -> Vec<f64> {
        let mut sum = vec![0.0; count];
        let divisor = self.divisor * step.powi(self.power);
        for (at, weight) in self.weights {
            for (total, value) in sum.iter_mut().zip(f(at * step)) {
                *total += weight * value / divisor;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests;
