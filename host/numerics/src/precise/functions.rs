//! Elementary functions: an argument near zero, the series there, and for inverse functions one step of Newton's method from
//! the double.

use super::{DoubleDouble, product, sum_ordered};

/// Pi / 2 as a sum of three doubles.
const QUARTER: [f64; 3] = [std::f64::consts::FRAC_PI_2, 6.123_233_995_736_766e-17, -1.497_384_904_859_169_8e-33];
/// The logarithm of 2 likewise.
const LN_2: [f64; 3] = [std::f64::consts::LN_2, 2.319_046_813_846_299_6e-17, 5.707_708_438_416_212e-34];
/// Terms of a series of x^n / n! in every second power, up to pi / 4: the next is below 1e-33.
const TERMS: usize = 15;

/// `x` less `count` times a number that is the sum of three.
fn less(x: DoubleDouble, count: f64, parts: [f64; 3]) -> DoubleDouble {
    parts.into_iter().fold(x, |rest, part| {
        let (whole, lost) = product(count, part);
        rest - sum_ordered(whole, lost)
    })
}

/// The sum of `first` and what follows it in a series in which each term is the one before times `square / (n (n - 1))`, n the
/// power it has: that of `first` is `power`.
fn series(first: DoubleDouble, square: DoubleDouble, power: usize) -> DoubleDouble {
    let (mut term, mut sum) = (first, first);
    for n in (power + 2..).step_by(2).take(TERMS) {
        term = term * square / DoubleDouble::from((n * (n - 1)) as f64);
        sum += term;
    }
    sum
}

impl DoubleDouble {
    /// Sine and cosine of an angle, rad. Errors are below 1e-31, and below 1e-31 of the angle times the quarter turns it has where
    /// these are more than 2^50.
    #[must_use]
    pub fn sin_cos(self) -> (Self, Self) {
        let turns = (self.high * std::f64::consts::FRAC_2_PI).round();
        let x = less(self, turns, QUARTER);
        let square = x * x;
        let (sine, cosine) = (series(x, -square, 1), series(Self::ONE, -square, 0));
        match turns.rem_euclid(4.0) as u8 {
            0 => (sine, cosine),
            1 => (cosine, -sine),
            2 => (-sine, -cosine),
            _ => (-cosine, sine),
        }
    }

    /// The exponential; relative errors are below 1e-30.
    #[must_use]
    pub fn exp(self) -> Self {
        if self.high > 709.0 {
            return Self::from(f64::INFINITY);
        }
        if self.high < -709.0 {
            return Self::ZERO;
        }
        let twos = (self.high / LN_2[0]).round();
        let x = less(self, twos, LN_2);
        let square = x * x;
        let value = series(Self::ONE, square, 0) + series(x, square, 1);
        // In two factors, the first of which may be beyond the smallest number.
        let half = (twos / 2.0).trunc();
        let scaled = |x: Self, twos: f64| x * Self::from(2.0_f64.powi(twos as i32));
        scaled(scaled(value, half), twos - half)
    }

    /// The natural logarithm; errors are below 1e-31 of it, or of 1 where it is less.
    #[must_use]
    pub fn ln(self) -> Self {
        let near = Self::from(self.high.ln());
        let excess = self * (-near).exp() - Self::ONE;
        near + (excess - Self::from(0.5 * excess.high * excess.high))
    }

    /// The hyperbolic tangent; relative errors are below 1e-30.
    #[must_use]
    pub fn tanh(self) -> Self {
        if self.high.abs() < 0.5 {
            let sine = series(self, self * self, 1);
            return sine / (Self::ONE + sine * sine).sqrt();
        }
        let small = (Self::from(-2.0) * self.abs()).exp();
        let value = (Self::ONE - small) / (Self::ONE + small);
        if self.high < 0.0 { -value } else { value }
    }

    /// The angle of the point (`x`, `self`), rad, from -pi to pi; zero for the origin. Errors are below 1e-31.
    #[must_use]
    pub fn atan2(self, x: Self) -> Self {
        if self.high == 0.0 && x.high == 0.0 {
            return Self::from(self.high.atan2(x.high));
        }
        let near = Self::from(self.high.atan2(x.high));
        let (sine, cosine) = near.sin_cos();
        let across = (self * cosine - x * sine) / (self * self + x * x).sqrt();
        near + across
    }

    /// The power with a real exponent of a positive number.
    #[must_use]
    pub fn powf(self, exponent: f64) -> Self {
        (self.ln() * Self::from(exponent)).exp()
    }
}
