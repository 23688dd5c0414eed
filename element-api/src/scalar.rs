//! [`Scalar`]: the number type an author's equations are written in.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};

use crate::table::Table;

/// A real number that cannot be looked at.
///
/// Equations are instantiated with `f64` (plain evaluation), [`crate::Jet`] (exact derivatives, the oracle) and
/// [`crate::recorded::Recorded`] (the recording that the host compiles). None of these lets an equation read a value and
/// branch on it; where an equation switches, it says so with [`Scalar::select`], and the host knows the place.
///
/// Arithmetic works between scalars and with `f64` on the right; `S::from(2.0)` lifts a constant.
pub trait Scalar:
    Copy
    + Debug
    + PartialEq
    + 'static
    + Zero
    + One
    + From<f64>
    + Neg<Output = Self>
    + Sub<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// Square root; the derivative at zero is infinite.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Sine of an angle in rad.
    #[must_use]
    fn sin(self) -> Self;
    /// Cosine of an angle in rad.
    #[must_use]
    fn cos(self) -> Self;
    /// Angle of the point (`x`, `self`), in (-pi, pi].
    #[must_use]
    fn atan2(self, x: Self) -> Self;
    /// e to the power of `self`.
    #[must_use]
    fn exp(self) -> Self;
    /// Natural logarithm.
    #[must_use]
    fn ln(self) -> Self;
    /// Hyperbolic tangent, the usual smooth sign.
    #[must_use]
    fn tanh(self) -> Self;
    /// Whole power.
    #[must_use]
    fn powi(self, n: i32) -> Self;
    /// Constant real power of a positive number.
    #[must_use]
    fn powf(self, exponent: f64) -> Self;
    /// `x` where `a < b`, otherwise `y`. Both are evaluated; the host may use `a - b` as an event function.
    #[must_use]
    fn select(a: Self, b: Self, x: Self, y: Self) -> Self;
    /// The value of a table at `self`.
    #[must_use]
    fn lookup(self, table: &Table) -> Self;

    /// Absolute value; switches at zero.
    #[must_use]
    fn abs(self) -> Self {
        Self::select(self, Self::zero(), -self, self)
    }
    /// The smaller of two.
    #[must_use]
    fn min(self, other: Self) -> Self {
        Self::select(self, other, self, other)
    }
    /// The larger of two.
    #[must_use]
    fn max(self, other: Self) -> Self {
        Self::select(self, other, other, self)
    }
    /// Kept between two bounds.
    #[must_use]
    fn clamp(self, low: f64, high: f64) -> Self {
        self.max(Self::from(low)).min(Self::from(high))
    }
}

impl Scalar for f64 {
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn sin(self) -> Self {
        f64::sin(self)
    }
    fn cos(self) -> Self {
        f64::cos(self)
    }
    fn atan2(self, x: Self) -> Self {
        f64::atan2(self, x)
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
    fn ln(self) -> Self {
        f64::ln(self)
    }
    fn tanh(self) -> Self {
        f64::tanh(self)
    }
    fn powi(self, n: i32) -> Self {
        f64::powi(self, n)
    }
    fn powf(self, exponent: f64) -> Self {
        f64::powf(self, exponent)
    }
    fn select(a: Self, b: Self, x: Self, y: Self) -> Self {
        if a < b { x } else { y }
    }
    fn lookup(self, table: &Table) -> Self {
        table.derivative(self, 0)
    }
}
