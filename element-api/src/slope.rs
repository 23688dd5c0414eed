//! [`Dual`]: a number with its derivative, both of any [`Scalar`], for equations that contain the derivative of a function which a scene
//! gives.

use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};

use crate::scalar::Scalar;
use crate::table::{Outside, Table};

/// A value and its derivative with respect to one variable.
///
/// Source: Griewank & Walther, Evaluating Derivatives (2008), section 3.1 (tangents).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Dual<S> {
    pub(crate) value: S,
    pub(crate) slope: S,
}

impl<S: Scalar> Dual<S> {
    /// The variable itself.
    pub(crate) fn variable(value: S) -> Self {
        Self { value, slope: S::one() }
    }

    /// f(self), from f and f' at the value.
    fn chain(self, value: S, derivative: S) -> Self {
        Self { value, slope: derivative * self.slope }
    }
}

impl<S: Scalar> From<f64> for Dual<S> {
    fn from(value: f64) -> Self {
        Self { value: S::from(value), slope: S::zero() }
    }
}

impl<S: Scalar> Zero for Dual<S> {
    fn zero() -> Self {
        Self::from(0.0)
    }
    fn is_zero(&self) -> bool {
        self.value.is_zero() && self.slope.is_zero()
    }
}

impl<S: Scalar> One for Dual<S> {
    fn one() -> Self {
        Self::from(1.0)
    }
}

impl<S: Scalar> Neg for Dual<S> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, slope: -self.slope }
    }
}

impl<S: Scalar> Add for Dual<S> {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { value: self.value + o.value, slope: self.slope + o.slope }
    }
}

impl<S: Scalar> Sub for Dual<S> {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { value: self.value - o.value, slope: self.slope - o.slope }
    }
}

impl<S: Scalar> Mul for Dual<S> {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { value: self.value * o.value, slope: self.slope * o.value + self.value * o.slope }
    }
}

impl<S: Scalar> Div for Dual<S> {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let value = self.value / o.value;
        Self { value, slope: (self.slope - value * o.slope) / o.value }
    }
}

impl<S: Scalar> Add<f64> for Dual<S> {
    type Output = Self;
    fn add(self, o: f64) -> Self {
        Self { value: self.value + o, slope: self.slope }
    }
}

impl<S: Scalar> Sub<f64> for Dual<S> {
    type Output = Self;
    fn sub(self, o: f64) -> Self {
        Self { value: self.value - o, slope: self.slope }
    }
}

impl<S: Scalar> Mul<f64> for Dual<S> {
    type Output = Self;
    fn mul(self, o: f64) -> Self {
        Self { value: self.value * o, slope: self.slope * o }
    }
}

impl<S: Scalar> Div<f64> for Dual<S> {
    type Output = Self;
    fn div(self, o: f64) -> Self {
        Self { value: self.value / o, slope: self.slope / o }
    }
}

impl<S: Scalar> AddAssign for Dual<S> {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<S: Scalar> SubAssign for Dual<S> {
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl<S: Scalar> MulAssign for Dual<S> {
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

impl<S: Scalar> DivAssign for Dual<S> {
    fn div_assign(&mut self, o: Self) {
        *self = *self / o;
    }
}

impl<S: Scalar> Scalar for Dual<S> {
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, S::from(0.5) / root)
    }
    fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }
    fn cos(self) -> Self {
        self.chain(self.value.cos(), -self.value.sin())
    }
    fn atan2(self, x: Self) -> Self {
        let squares = x.value * x.value + self.value * self.value;
        let slope = (x.value * self.slope - self.value * x.slope) / squares;
        Self { value: self.value.atan2(x.value), slope }
    }
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }
    fn ln(self) -> Self {
        self.chain(self.value.ln(), S::one() / self.value)
    }
    fn tanh(self) -> Self {
        let value = self.value.tanh();
        self.chain(value, S::one() - value * value)
    }
    fn powi(self, n: i32) -> Self {
        let derivative = if n == 0 { S::zero() } else { self.value.powi(n - 1) * f64::from(n) };
        self.chain(self.value.powi(n), derivative)
    }
    fn powf(self, exponent: f64) -> Self {
        self.chain(self.value.powf(exponent), self.value.powf(exponent - 1.0) * exponent)
    }
    fn select(a: Self, b: Self, x: Self, y: Self) -> Self {
        let choose = |x: S, y: S| S::select(a.value, b.value, x, y);
        Self { value: choose(x.value, y.value), slope: choose(x.slope, y.slope) }
    }
    fn lookup(self, table: &Table) -> Self {
        let inside = self.value.lookup(&table.slope());
        let (Some(first), Some(last)) = (table.breaks.first(), table.breaks.last()) else {
            return self.chain(self.value.lookup(table), S::zero());
        };
        let slope = match table.outside {
            Outside::Periodic => inside,
            // What is held does not change.
            Outside::Clamped => {
                let below_end = S::select(S::from(*last), self.value, S::zero(), inside);
                S::select(self.value, S::from(*first), S::zero(), below_end)
            }
        };
        self.chain(self.value.lookup(table), slope)
    }
}
