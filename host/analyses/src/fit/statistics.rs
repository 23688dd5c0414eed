//! Quantiles of Student's distribution.

/// The number that a Student-t variable with these degrees of freedom exceeds in magnitude with this probability; that of the normal
/// distribution for infinitely many.
///
/// The probability is the regularised incomplete beta function I_x(nu/2, 1/2) at x = nu / (nu + t^2) (Abramowitz & Stegun 1964,
/// 26.7.1); t by bisection.
#[must_use]
pub(crate) fn two_sided(probability: f64, freedoms: f64) -> f64 {
    let freedoms = freedoms.min(1e6);
    let exceeds = |t: f64| incomplete_beta(0.5 * freedoms, 0.5, freedoms / (freedoms + t * t));
    let (mut low, mut high) = (0.0, 1.0);
    while exceeds(high) > probability && high < 1e12 {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if exceeds(middle) > probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// I_x(a, b), by its continued fraction (26.5.8) on the side where that converges fast.
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    let front = (a * x.ln() + b * (-x).ln_1p() - ln_beta(a, b)).exp();
    if x < (a + 1.0) / (a + b + 2.0) {
        front * fraction(a, b, x) / a
    } else {
        1.0 - front * fraction(b, a, 1.0 - x) / b
    }
}

/// The continued fraction, by the method of Lentz (1976).
fn fraction(a: f64, b: f64, x: f64) -> f64 {
    let not_zero = |value: f64| if value.abs() < 1e-300 { 1e-300 } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / not_zero(1.0 - (a + b) * x / (a + 1.0));
    let mut value = d;
    for k in 1..10_000 {
        let m = f64::from(k);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let mut change = 1.0;
        for term in [even, odd] {
            d = 1.0 / not_zero(1.0 + term * d);
            c = not_zero(1.0 + term / c);
            change = c * d;
            value *= change;
        }
        if (change - 1.0).abs() < 1e-15 {
            break;
        }
    }
    value
}

fn ln_beta(a: f64, b: f64) -> f64 {
    ln_gamma(a) + ln_gamma(b) - ln_gamma(a + b)
}

/// Stirling's series (6.1.41), after the argument was raised to 15 or more.
fn ln_gamma(mut x: f64) -> f64 {
    let mut product = 1.0;
    while x < 15.0 {
        product *= x;
        x += 1.0;
    }
    let inverse = 1.0 / (x * x);
    let series = (1.0 / 12.0 - inverse * (1.0 / 360.0 - inverse * (1.0 / 1260.0 - inverse / 1680.0))) / x;
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * std::f64::consts::PI).ln() + series - f64::ln(product)
}

#[cfg(test)]
mod tests {
    use super::two_sided;

    /// Abramowitz & Stegun, table 26.10.
    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (freedoms, t) in [(1.0, 12.706), (2.0, 4.303), (5.0, 2.571), (10.0, 2.228), (30.0, 2.042), (120.0, 1.980)] {
            assert!((two_sided(0.05, freedoms) - t).abs() < 5e-4, "{freedoms}: {}", two_sided(0.05, freedoms));
        }
        assert!((two_sided(0.05, f64::INFINITY) - 1.959_964).abs() < 5e-6);
        assert!((two_sided(0.01, 10.0) - 3.169).abs() < 5e-4);
    }
}
