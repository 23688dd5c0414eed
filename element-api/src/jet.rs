//! [`Jet`]: value, first and second derivative along a curve. The oracle of the recorded derivatives, and the way in
//! which opaque elements get exact ones.

use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};

use crate::scalar::Scalar;
use crate::table::Table;

/// A number that carries its first two derivatives with respect to one parameter.
///
/// Source: Griewank & Walther, Evaluating Derivatives, ch. 13 (truncated Taylor arithmetic).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet {
    /// The value.
    pub value: f64,
    /// The first derivative.
    pub first: f64,
    /// The second derivative.
    pub second: f64,
}

impl Jet {
    /// A jet from its three parts.
    #[must_use]
    pub const fn new(value: f64, first: f64, second: f64) -> Self {
        Self { value, first, second }
    }

    /// f(self), from f, f' and f'' at the value.
    fn chain(self, f: f64, df: f64, ddf: f64) -> Self {
        Self::new(f, df * self.first, ddf * self.first * self.first + df * self.second)
    }
}

impl From<f64> for Jet {
    fn from(value: f64) -> Self {
        Self::new(value, 0.0, 0.0)
    }
}

impl Zero for Jet {
    fn zero() -> Self {
        Self::from(0.0)
    }
    fn is_zero(&self) -> bool {
        self.value == 0.0 && self.first == 0.0 && self.second == 0.0
    }
}

impl One for Jet {
    fn one() -> Self {
        Self::from(1.0)
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.value, -self.first, -self.second)
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self::new(self.value + o.value, self.first + o.first, self.second + o.second)
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self::new(self.value - o.value, self.first - o.first, self.second - o.second)
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self::new(
            self.value * o.value,
            self.first * o.value + self.value * o.first,
            self.second * o.value + 2.0 * self.first * o.first + self.value * o.second,
        )
    }
}

impl Div for Jet {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        // q o = self, differentiated once and twice.
        let value = self.value / o.value;
        let first = (self.first - value * o.first) / o.value;
        Self::new(value, first, (self.second - 2.0 * first * o.first - value * o.second) / o.value)
    }
}

impl Add<f64> for Jet {
    type Output = Self;
    fn add(self, o: f64) -> Self {
        self + Self::from(o)
    }
}

impl Sub<f64> for Jet {
    type Output = Self;
    fn sub(self, o: f64) -> Self {
        self - Self::from(o)
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, o: f64) -> Self {
        Self::new(self.value * o, self.first * o, self.second * o)
    }
}

impl Div<f64> for Jet {
    type Output = Self;
    fn div(self, o: f64) -> Self {
        Self::new(self.value / o, self.first / o, self.second / o)
    }
}

impl AddAssign for Jet {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl SubAssign for Jet {
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl MulAssign for Jet {
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

impl DivAssign for Jet {
    fn div_assign(&mut self, o: Self) {
        *self = *self / o;
    }
}

impl Scalar for Jet {
    fn sqrt(self) -> Self {
        let f = self.value.sqrt();
        self.chain(f, 0.5 / f, -0.25 / (f * self.value))
    }
    fn sin(self) -> Self {
        let (s, c) = self.value.sin_cos();
        self.chain(s, c, -s)
    }
    fn cos(self) -> Self {
        let (s, c) = self.value.sin_cos();
        self.chain(c, -s, -c)
    }
    fn atan2(self, x: Self) -> Self {
        // d atan2(y, x) = (x dy - y dx) / (x^2 + y^2), once more by the rules above for the second derivative.
        let slope = |y: Jet, x: Jet| (x.value * y.first - y.value * x.first) / (x.value * x.value + y.value * y.value);
        let squares = x.value * x.value + self.value * self.value;
        let first = slope(self, x);
        let numerator_rate = x.value * self.second - self.value * x.second;
        let square_rate = 2.0 * (x.value * x.first + self.value * self.first);
        Self::new(self.value.atan2(x.value), first, (numerator_rate - first * square_rate) / squares)
    }
    fn exp(self) -> Self {
        let f = self.value.exp();
        self.chain(f, f, f)
    }
    fn ln(self) -> Self {
        let r = 1.0 / self.value;
        self.chain(self.value.ln(), r, -r * r)
    }
    fn tanh(self) -> Self {
        let f = self.value.tanh();
        let df = 1.0 - f * f;
        self.chain(f, df, -2.0 * f * df)
    }
    fn powi(self, n: i32) -> Self {
        let k = f64::from(n);
        let df = if n == 0 { 0.0 } else { k * self.value.powi(n - 1) };
        let ddf = if n == 0 || n == 1 { 0.0 } else { k * (k - 1.0) * self.value.powi(n - 2) };
        self.chain(self.value.powi(n), df, ddf)
    }
    fn powf(self, e: f64) -> Self {
        self.chain(self.value.powf(e), e * self.value.powf(e - 1.0), e * (e - 1.0) * self.value.powf(e - 2.0))
    }
    fn select(a: Self, b: Self, x: Self, y: Self) -> Self {
        if a.value < b.value { x } else { y }
    }
    fn lookup(self, table: &Table) -> Self {
        let d = |order| table.derivative(self.value, order);
        self.chain(d(0), d(1), d(2))
    }
}
