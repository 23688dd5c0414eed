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
/// Arithmetic works between scalars and with `f64` on the right (`x * 2.0`); `S::from(2.0)` lifts a constant. What is a method here
/// means the same for all three, to the last bit for `f64` and recordings.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a number that equations are written in",
    label = "not a `Scalar`",
    note = "equations are generic over `S: Scalar`; write `S::from(2.0)` for a constant, and `x * 2.0` with the constant on the right"
)]
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

    /// Tangent of an angle in rad.
    #[must_use]
    fn tan(self) -> Self {
        Scalar::sin(self) / Scalar::cos(self)
    }
    /// Angle in [-pi/2, pi/2] with this sine; the derivative at -1 and 1 is infinite.
    #[must_use]
    fn asin(self) -> Self {
        let cosine = ((Self::one() - self) * (self + 1.0)).sqrt();
        Scalar::atan2(self, cosine)
    }
    /// Angle in [0, pi] with this cosine; the derivative at -1 and 1 is infinite.
    #[must_use]
    fn acos(self) -> Self {
        let sine = ((Self::one() - self) * (self + 1.0)).sqrt();
        Scalar::atan2(sine, self)
    }
    /// Angle in (-pi/2, pi/2) with this tangent.
    #[must_use]
    fn atan(self) -> Self {
        Scalar::atan2(self, Self::one())
    }
    /// Length of the legs `self` and `other` together; has no derivative where both are zero.
    #[must_use]
    fn hypot(self, other: Self) -> Self {
        (self * self + other * other).sqrt()
    }
    /// Whether `self` is below `bound`, for [`select`].
    #[must_use]
    fn below(self, bound: impl Into<Self>) -> Condition<Self> {
        Condition { small: self, large: bound.into() }
    }
    /// Whether `self` is above `bound`, for [`select`].
    #[must_use]
    fn above(self, bound: impl Into<Self>) -> Condition<Self> {
        Condition { small: bound.into(), large: self }
    }

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

/// A comparison that an equation switches by, see [`select`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition<S> {
    small: S,
    large: S,
}

/// `x` where the condition holds, otherwise `y`: `select(depth.above(0.0), contact, S::zero())`. Both are evaluated, so both must be
/// numbers. The host sees where it switches and ends steps there.
#[must_use]
pub fn select<S: Scalar>(condition: Condition<S>, x: S, y: S) -> S {
    S::select(condition.small, condition.large, x, y)
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
