//! Ranges of numbers, and of polynomials: what is proved of a whole stretch instead of looked at in places.
//!
//! - **Takes**: numbers, coefficients, operations.
//! - **Gives**: [`Interval`]s that contain every result; [`Bernstein`] polynomials with the range they have on a stretch.
//! - **May touch**: nothing else.
//! - **Must not know**: where the numbers come from.
//!
//! Moore, Kearfott & Cloud, "Introduction to Interval Analysis", 2009. Bounds are rounded to nearest, not outwards: what is
//! decided here has margins far above round-off.

mod bernstein;

pub use bernstein::Bernstein;

/// All numbers from `low` to `high`, both included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The smallest of them.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

impl Interval {
    /// All numbers: what is known of nothing.
    pub const ALL: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };
    /// The number zero.
    pub const ZERO: Self = Self { low: 0.0, high: 0.0 };

    /// From one number to another that is not smaller; all numbers where one of them is none.
    #[must_use]
    pub fn new(low: f64, high: f64) -> Self {
        if low <= high { Self { low, high } } else { Self::ALL }
    }

    /// One number alone; all numbers where it is none.
    #[must_use]
    pub fn point(x: f64) -> Self {
        Self::new(x, x)
    }

    /// Between two numbers, in whichever order.
    #[must_use]
    pub fn between(a: f64, b: f64) -> Self {
        if a <= b { Self::new(a, b) } else { Self::new(b, a) }
    }

    /// Whether it is one number.
    #[must_use]
    pub fn is_point(self) -> bool {
        self.low == self.high
    }

    /// Whether a number is in it.
    #[must_use]
    pub fn contains(self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }

    /// Difference of the ends.
    #[must_use]
    pub fn width(self) -> f64 {
        self.high - self.low
    }

    /// The largest magnitude in it.
    #[must_use]
    pub fn magnitude(self) -> f64 {
        self.high.abs().max(self.low.abs())
    }

    /// The smallest one that contains both.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// What is in both; this one where there is nothing, which only round-off does where both contain a result.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        let (low, high) = (self.low.max(other.low), self.high.min(other.high));
        if low <= high { Self { low, high } } else { self }
    }

    /// Larger by this much at both ends.
    #[must_use]
    pub fn widened(self, by: f64) -> Self {
        Self::new(self.low - by, self.high + by)
    }

    /// a factor times all of it.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        self * Self::point(factor)
    }

    /// The square of each number.
    #[must_use]
    pub fn square(self) -> Self {
        let (a, b) = (self.low * self.low, self.high * self.high);
        if self.contains(0.0) { Self::new(0.0, a.max(b)) } else { Self::between(a, b) }
    }

    /// A function that does not fall.
    #[must_use]
    pub fn rising(self, f: impl Fn(f64) -> f64) -> Self {
        Self::new(f(self.low), f(self.high))
    }

    /// Square root; of negative numbers nothing is known.
    #[must_use]
    pub fn sqrt(self) -> Self {
        if self.high < 0.0 { Self::ALL } else { Self::new(self.low.max(0.0).sqrt(), self.high.sqrt()) }
    }

    /// Natural logarithm; of negative numbers nothing is known.
    #[must_use]
    pub fn ln(self) -> Self {
        if self.high <= 0.0 { Self::ALL } else { Self::new(self.low.max(0.0).ln(), self.high.ln()) }
    }

    /// Whole power.
    #[must_use]
    pub fn powi(self, n: i32) -> Self {
        if n < 0 {
            return Self::point(1.0) / self.powi(-n);
        }
        self.whole_power(|x| x.powi(n), n % 2 == 0)
    }

    /// A positive whole power.
    fn whole_power(self, power: impl Fn(f64) -> f64, is_even: bool) -> Self {
        let ends = Self::between(power(self.low), power(self.high));
        if is_even && self.contains(0.0) { Self::new(0.0, ends.high) } else { ends }
    }

    /// Real power of a number that is not negative, or whole power of any: those that are too high for [`Self::powi`] come as such.
    #[must_use]
    pub fn powf(self, exponent: f64) -> Self {
        if self.low < 0.0 && exponent.fract() == 0.0 {
            return match exponent < 0.0 {
                true => Self::point(1.0) / self.powf(-exponent),
                false => self.whole_power(|x| x.powf(exponent), exponent % 2.0 == 0.0),
            };
        }
        if self.high < 0.0 {
            return Self::ALL;
        }
        Self::between(self.low.max(0.0).powf(exponent), self.high.powf(exponent))
    }

    /// Cosine.
    #[must_use]
    pub fn cos(self) -> Self {
        self.wave(f64::cos, 0.0)
    }

    /// Sine.
    #[must_use]
    pub fn sin(self) -> Self {
        self.wave(f64::sin, 0.5)
    }

    /// A cosine whose first maximum is at this multiple of pi.
    fn wave(self, f: impl Fn(f64) -> f64, first: f64) -> Self {
        use std::f64::consts::PI;
        if self.width().is_nan() || self.width() >= 2.0 * PI {
            return Self::new(-1.0, 1.0);
        }
        let ends = Self::between(f(self.low), f(self.high));
        // Extremes inside, by their numbers: even ones are maxima, odd ones minima.
        let (least, most) = ((self.low / PI - first).ceil(), (self.high / PI - first).floor());
        let has = |odd: bool| {
            let k = if (least.rem_euclid(2.0) != 0.0) == odd { least } else { least + 1.0 };
            k <= most
        };
        Self { low: if has(true) { -1.0 } else { ends.low }, high: if has(false) { 1.0 } else { ends.high } }
    }

    /// Angle of the points (x, self), in -pi to pi; all angles where the points surround the origin or cross the negative
    /// half of the axis.
    #[must_use]
    pub fn atan2(self, x: Self) -> Self {
        use std::f64::consts::PI;
        if x.low <= 0.0 && self.contains(0.0) {
            return Self::new(-PI, PI);
        }
        // Seen from the origin, the extremes are at corners: below the axis those of its mirror image, above it by quadrant.
        if self.high <= 0.0 && self.low < 0.0 {
            return -(-self).atan2(x);
        }
        let first = if self.low < 0.0 || x.high >= 0.0 { self.low } else { self.high };
        let last = if x.low >= 0.0 { self.high } else { self.low };
        let first_at = if self.low < 0.0 { x.low } else { x.high };
        Self::new(first.atan2(first_at), last.atan2(x.low))
    }
}

impl std::ops::Add for Interval {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::new(self.low + other.low, self.high + other.high)
    }
}

impl std::ops::Sub for Interval {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::new(self.low - other.high, self.high - other.low)
    }
}

impl std::ops::Neg for Interval {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}

impl std::ops::Mul for Interval {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let all = [self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high];
        if (all[0] + all[1] + all[2] + all[3]).is_finite() {
            let low = |a: f64, b: f64| if a < b { a } else { b };
            let high = |a: f64, b: f64| if a > b { a } else { b };
            return Self {
                low: low(low(all[0], all[1]), low(all[2], all[3])),
                high: high(high(all[0], all[1]), high(all[2], all[3])),
            };
        }
        // Zero times anything is zero, that of an unbounded range included.
        if self == Self::ZERO || other == Self::ZERO {
            return Self::ZERO;
        }
        let product = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let all = [
            product(self.low, other.low),
            product(self.low, other.high),
            product(self.high, other.low),
            product(self.high, other.high),
        ];
        let (low, high) = all.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        if all.iter().any(|x| x.is_nan()) { Self::ALL } else { Self { low, high } }
    }
}

impl std::ops::Div for Interval {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        if other.contains(0.0) {
            return if self == Self::ZERO && other != Self::ZERO { Self::ZERO } else { Self::ALL };
        }
        self * Self::between(1.0 / other.low, 1.0 / other.high)
    }
}

/// A value and its slope along a stretch, for everything on the stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// All values.
    pub value: Interval,
    /// All slopes with respect to the share of the stretch; of a value that jumps, all numbers.
    pub slope: Interval,
    /// The value in the middle of the stretch; no number where it is not known.
    pub middle: f64,
}

impl Range {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self { value: Interval::ALL, slope: Interval::ALL, middle: f64::NAN };

    /// What is known of a value in three ways: all values, all slopes, and the value in the middle, from which it goes no farther than
    /// the slopes lead in half of the stretch (mean value form). Differences of values that change alike stay sharp by it.
    #[must_use]
    pub fn new(value: Interval, slope: Interval, middle: f64) -> Self {
        let half = 0.5 * slope.magnitude();
        let (low, high) = (value.low.max(middle - half), value.high.min(middle + half));
        // Empty by round-off only, or where something is no number.
        let value = if low <= high { Interval { low, high } } else { value };
        Self { value, slope, middle }
    }

    /// A value that stays as it is.
    #[must_use]
    pub fn still(x: f64) -> Self {
        Self { value: Interval::point(x), slope: Interval::ZERO, middle: x }
    }

    /// A value that goes evenly from one number to another.
    #[must_use]
    pub fn even(from: f64, to: f64) -> Self {
        Self { value: Interval::between(from, to), slope: Interval::point(to - from), middle: 0.5 * (from + to) }
    }

    /// Whether the value only rises or only falls.
    #[must_use]
    pub fn is_monotone(self) -> bool {
        self.slope.low >= 0.0 || self.slope.high <= 0.0
    }

    /// The values, where those at the ends of the stretch are known: mean value form from both ends; those between the ends
    /// where the value only rises or falls.
    #[must_use]
    pub fn between(self, first: f64, last: f64) -> Interval {
        if self.is_monotone() {
            return self.value.intersection(Interval::between(first, last));
        }
        let share = Interval::new(0.0, 1.0);
        let from_first = Interval::point(first) + self.slope * share;
        let from_last = Interval::point(last) - self.slope * share;
        self.value.intersection(from_first).intersection(from_last)
    }
}

#[cfg(test)]
mod tests;
