//! Numbers of twice the precision: what round-off of doubles is measured by.
//!
//! - **Takes**: numbers, operations; systems that expand their solution ([`Expansion`]).
//! - **Gives**: [`DoubleDouble`]s: the same operations and elementary functions with about 31 digits; solutions of differential
//!   equations by power series of them ([`Taylor`]).
//! - **May touch**: nothing else.
//! - **Must not know**: what is computed with them.
//!
//! A number is the unevaluated sum of two doubles that do not overlap (Dekker, "A floating-point technique for extending the
//! available precision", 1971; Hida, Li & Bailey, "Library for double-double and quad-double arithmetic", 2007). Products are
//! split as Dekker does, without fused multiply-add: the same bits on every machine, whether it has that or not. Valid for
//! magnitudes from 1e-270 to 1e290; beyond, digits or all of a number are lost, and what overflows is not finite.

mod functions;
mod taylor;

#[cfg(test)]
mod tests;

pub use taylor::{Ended, Expansion, Sampled, Taylor};

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// The sum of two doubles, the second at most half a unit in the last place of the first.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd)]
pub struct DoubleDouble {
    high: f64,
    low: f64,
}

/// `a + b`, and what rounding it took away (Knuth).
#[inline(always)]
fn sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let part = s - a;
    (s, (a - (s - part)) + (b - part))
}

/// The same for |a| >= |b| (Dekker).
#[inline(always)]
fn sum_ordered(a: f64, b: f64) -> DoubleDouble {
    let high = a + b;
    DoubleDouble { high, low: b - (high - a) }
}

/// A number as the sum of two with half the bits each.
#[inline(always)]
fn halves(a: f64) -> (f64, f64) {
    let shifted = 134_217_729.0 * a;
    let high = shifted - (shifted - a);
    (high, a - high)
}

/// `a b`, and what rounding it took away.
#[inline(always)]
fn product(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
    (p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2)
}

impl DoubleDouble {
    /// 0
    pub const ZERO: Self = Self { high: 0.0, low: 0.0 };
    /// 1
    pub const ONE: Self = Self { high: 1.0, low: 0.0 };
    /// Relative error of a sum, product or quotient, at most: eight units of 2^-106.
    pub const EPSILON: f64 = 1e-31;

    /// The nearest double.
    #[must_use]
    pub fn to_f64(self) -> f64 {
        self.high
    }

    /// Whether it is a number, and not infinite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.high.is_finite() && self.low.is_finite()
    }

    /// The magnitude.
    #[must_use]
    pub fn abs(self) -> Self {
        if self.high < 0.0 { -self } else { self }
    }

    /// The square root; not a number for negative ones.
    #[must_use]
    pub fn sqrt(self) -> Self {
        if self.high == 0.0 {
            return Self::ZERO;
        }
        let root = Self::from(self.high.sqrt());
        root + Self::from((self - root * root).high / (2.0 * root.high))
    }
}

impl From<f64> for DoubleDouble {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (s, s_lost) = sum(self.high, other.high);
        let (t, t_lost) = sum(self.low, other.low);
        let near = sum_ordered(s, s_lost + t);
        sum_ordered(near.high, near.low + t_lost)
    }
}

impl AddAssign for DoubleDouble {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (p, lost) = product(self.high, other.high);
        sum_ordered(p, lost + (self.high * other.low + self.low * other.high))
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * Self::from(first);
        let second = rest.high / other.high;
        let rest = rest - other * Self::from(second);
        sum_ordered(first, second) + Self::from(rest.high / other.high)
    }
}
