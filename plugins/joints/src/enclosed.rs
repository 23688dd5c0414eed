//! [`Enclosed`]: between which numbers a function and its derivatives lie on a whole stretch of its argument, not at places of it.
//!
//! Interval arithmetic with truncated Taylor series (Moore, Kearfott & Cloud, Introduction to Interval Analysis (2009), chapters 5 and 6;
//! Griewank & Walther, Evaluating Derivatives (2008), chapter 13). Bounds are rounded to nearest, not outwards: what is decided here has
//! margins far above round-off.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use element_api::prelude::*;
use num_traits::{One, Zero};

/// A value that jumps at a break point of a table by less than this share of its terms is round-off.
const ROUND_OFF: f64 = 1e-10;

/// All numbers from `low` to `high`, both included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

impl Interval {
    /// What is known of nothing.
    const ALL: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };
    const ZERO: Self = Self { low: 0.0, high: 0.0 };

    /// All numbers where one of the ends is none.
    pub fn new(low: f64, high: f64) -> Self {
        if low <= high { Self { low, high } } else { Self::ALL }
    }

    fn point(x: f64) -> Self {
        Self::new(x, x)
    }

    /// Between two numbers, in whichever order.
    fn between(a: f64, b: f64) -> Self {
        if a <= b { Self::new(a, b) } else { Self::new(b, a) }
    }

    fn contains(self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }

    /// Whether it ends on both sides.
    pub fn is_bounded(self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }

    /// The largest magnitude in it.
    fn largest(self) -> f64 {
        self.high.abs().max(self.low.abs())
    }

    /// The smallest magnitude in it.
    pub fn smallest(self) -> f64 {
        if self.contains(0.0) { 0.0 } else { self.high.abs().min(self.low.abs()) }
    }

    fn hull(self, o: Self) -> Self {
        Self { low: self.low.min(o.low), high: self.high.max(o.high) }
    }

    fn rising(self, f: fn(f64) -> f64) -> Self {
        Self::new(f(self.low), f(self.high))
    }

    /// What of it is not negative, for functions that are defined there; all numbers where nothing is.
    fn not_negative(self) -> Self {
        Self::new(self.low.max(0.0), self.high)
    }

    fn square(self) -> Self {
        let (smallest, largest) = (self.smallest(), self.largest());
        Self::new(smallest * smallest, largest * largest)
    }

    fn times(self, o: Self) -> Self {
        // Ends are bounds: what is zero stays zero however large the other one becomes.
        let times = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let [a, b] = [self.low, self.high].map(|end| Self::between(times(end, o.low), times(end, o.high)));
        a.hull(b)
    }

    fn inverse(self) -> Self {
        match (self.low, self.high) {
            (0.0, high) if high > 0.0 => Self::new(1.0 / high, f64::INFINITY),
            (low, 0.0) if low < 0.0 => Self::new(f64::NEG_INFINITY, 1.0 / low),
            _ if self.contains(0.0) => Self::ALL,
            (low, high) => Self::new(1.0 / high, 1.0 / low),
        }
    }

    fn powi(self, n: i32) -> Self {
        match n {
            ..0 => self.powi(-n).inverse(),
            0 => Self::point(1.0),
            _ if n % 2 == 0 => Self::new(self.smallest().powi(n), self.largest().powi(n)),
            _ => Self::new(self.low.powi(n), self.high.powi(n)),
        }
    }

    fn powf(self, exponent: f64) -> Self {
        // Whole powers that are too high for products come as real ones, and have a value for negative numbers, too.
        if self.low < 0.0 && exponent.fract() == 0.0 {
            return match exponent % 2.0 == 0.0 {
                _ if exponent < 0.0 => self.powf(-exponent).inverse(),
                true => Self::new(self.smallest().powf(exponent), self.largest().powf(exponent)),
                false => Self::new(self.low.powf(exponent), self.high.powf(exponent)),
            };
        }
        let base = self.not_negative();
        Self::between(base.low.powf(exponent), base.high.powf(exponent))
    }

    fn sin(self) -> Self {
        // Whether a place `top` + 2 pi k lies in it.
        let has = |top: f64| ((self.low - top) / TAU).ceil() <= ((self.high - top) / TAU).floor();
        let ends = Self::between(self.low.sin(), self.high.sin());
        let ends = if self.largest().is_finite() { ends } else { Self::new(-1.0, 1.0) };
        let low = if has(-FRAC_PI_2) { -1.0 } else { ends.low };
        Self::new(low, if has(FRAC_PI_2) { 1.0 } else { ends.high })
    }

    fn cos(self) -> Self {
        (self + Self::point(FRAC_PI_2)).sin()
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self::new(self.low + o.low, self.high + o.high)
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        self.times(o)
    }
}

impl Mul<f64> for Interval {
    type Output = Self;
    fn mul(self, o: f64) -> Self {
        self * Self::point(o)
    }
}

impl Div for Interval {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        self.times(o.inverse())
    }
}

/// A function on a stretch of its argument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enclosed {
    pub value: Interval,
    /// The first derivative; at kinks that of either side.
    pub first: Interval,
    /// The second derivative, likewise.
    pub second: Interval,
    /// By how much the first derivative may jump at a kink as the argument grows; zero among them. All numbers where the value may jump.
    pub jump: Interval,
}

impl Enclosed {
    /// The argument itself, between two numbers.
    pub fn variable(low: f64, high: f64) -> Self {
        Self { first: Interval::point(1.0), ..Self::constant(Interval::new(low, high)) }
    }

    fn constant(value: Interval) -> Self {
        Self { value, first: Interval::ZERO, second: Interval::ZERO, jump: Interval::ZERO }
    }

    /// f(self), from f, f' and f'' at the values.
    fn chain(self, f: Interval, df: Interval, ddf: Interval) -> Self {
        Self {
            value: f,
            first: df * self.first,
            second: ddf * self.first.square() + df * self.second,
            jump: df * self.jump,
        }
    }

    /// Either of two, each somewhere on the stretch.
    fn either(self, o: Self) -> Self {
        Self {
            value: self.value.hull(o.value),
            first: self.first.hull(o.first),
            second: self.second.hull(o.second),
            jump: self.jump.hull(o.jump),
        }
    }

    /// The same with a kink where the derivatives of two functions, which are equal there, follow each other: upwards for 1, downwards for -1.
    fn kinked(self, slopes: Interval, way: f64) -> Self {
        Self { jump: self.jump + Interval::new(0.0, slopes.largest()) * way, ..self }
    }
}

impl From<f64> for Enclosed {
    fn from(value: f64) -> Self {
        Self::constant(Interval::point(value))
    }
}

impl Zero for Enclosed {
    fn zero() -> Self {
        Self::from(0.0)
    }
    fn is_zero(&self) -> bool {
        *self == Self::zero()
    }
}

impl One for Enclosed {
    fn one() -> Self {
        Self::from(1.0)
    }
}

impl Neg for Enclosed {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, first: -self.first, second: -self.second, jump: -self.jump }
    }
}

impl Add for Enclosed {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self {
            value: self.value + o.value,
            first: self.first + o.first,
            second: self.second + o.second,
            jump: self.jump + o.jump,
        }
    }
}

impl Sub for Enclosed {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for Enclosed {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self {
            value: self.value * o.value,
            first: self.first * o.value + self.value * o.first,
            second: self.second * o.value + self.first * o.first * 2.0 + self.value * o.second,
            jump: self.jump * o.value + self.value * o.jump,
        }
    }
}

impl Div for Enclosed {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        // q o = self, differentiated once and twice.
        let value = self.value / o.value;
        let first = (self.first - value * o.first) / o.value;
        let second = (self.second - first * o.first * 2.0 - value * o.second) / o.value;
        Self { value, first, second, jump: (self.jump - value * o.jump) / o.value }
    }
}

impl Add<f64> for Enclosed {
    type Output = Self;
    fn add(self, o: f64) -> Self {
        self + Self::from(o)
    }
}

impl Sub<f64> for Enclosed {
    type Output = Self;
    fn sub(self, o: f64) -> Self {
        self - Self::from(o)
    }
}

impl Mul<f64> for Enclosed {
    type Output = Self;
    fn mul(self, o: f64) -> Self {
        self * Self::from(o)
    }
}

impl Div<f64> for Enclosed {
    type Output = Self;
    fn div(self, o: f64) -> Self {
        self / Self::from(o)
    }
}

impl AddAssign for Enclosed {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl SubAssign for Enclosed {
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl MulAssign for Enclosed {
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

impl DivAssign for Enclosed {
    fn div_assign(&mut self, o: Self) {
        *self = *self / o;
    }
}

impl Scalar for Enclosed {
    fn sqrt(self) -> Self {
        let inside = self.value.not_negative();
        let f = inside.rising(f64::sqrt);
        self.chain(f, f.inverse() * 0.5, (f * inside).inverse() * -0.25)
    }
    fn sin(self) -> Self {
        let (sin, cos) = (self.value.sin(), self.value.cos());
        self.chain(sin, cos, -sin)
    }
    fn cos(self) -> Self {
        let (sin, cos) = (self.value.sin(), self.value.cos());
        self.chain(cos, -sin, -cos)
    }
    fn atan2(self, x: Self) -> Self {
        let (a, b) = (self.value, x.value);
        let squares = a.square() + b.square();
        let first = (b * self.first - a * x.first) / squares;
        let second = b * self.second - a * x.second - first * (b * x.first + a * self.first) * 2.0;
        let smooth = Self {
            value: Interval::ALL,
            first,
            second: second / squares,
            jump: (b * self.jump - a * x.jump) / squares,
        };
        // From pi to -pi across the negative x axis.
        if a.contains(0.0) && b.low <= 0.0 {
            return Self { jump: Interval::ALL, ..smooth };
        }
        let [below, above] = [a.low, a.high].map(|y| Interval::between(y.atan2(b.low), y.atan2(b.high)));
        Self { value: below.hull(above), ..smooth }
    }
    fn exp(self) -> Self {
        let f = self.value.rising(f64::exp);
        self.chain(f, f, f)
    }
    fn ln(self) -> Self {
        let inside = self.value.not_negative();
        let slope = inside.inverse();
        self.chain(inside.rising(f64::ln), slope, -slope.square())
    }
    fn tanh(self) -> Self {
        let f = self.value.rising(f64::tanh);
        let df = Interval::point(1.0) - f.square();
        self.chain(f, df, f * df * -2.0)
    }
    fn powi(self, n: i32) -> Self {
        let (k, a) = (f64::from(n), self.value);
        let df = if n == 0 { Interval::ZERO } else { a.powi(n - 1) * k };
        let ddf = if n == 0 || n == 1 { Interval::ZERO } else { a.powi(n - 2) * (k * (k - 1.0)) };
        self.chain(a.powi(n), df, ddf)
    }
    fn powf(self, e: f64) -> Self {
        let a = self.value;
        self.chain(a.powf(e), a.powf(e - 1.0) * e, a.powf(e - 2.0) * (e * (e - 1.0)))
    }
    fn select(a: Self, b: Self, x: Self, y: Self) -> Self {
        if a.value.high < b.value.low {
            x
        } else if a.value.low > b.value.high {
            y
        } else {
            Self { jump: Interval::ALL, ..x.either(y) }
        }
    }
    fn lookup(self, table: &Table) -> Self {
        let mut found = Lookup { table, pieces: None, jump: Interval::ZERO };
        found.add(self.value);
        let [value, first, second] = found.pieces.unwrap_or([Interval::ZERO; 3]);
        let smooth = self.chain(value, first, second);
        Self { jump: smooth.jump + found.jump * Interval::new(0.0, self.first.largest()), ..smooth }
    }

    fn abs(self) -> Self {
        if self.value.low > 0.0 {
            self
        } else if self.value.high < 0.0 {
            -self
        } else {
            let value = Interval::new(0.0, self.value.largest());
            Self { value, ..self.either(-self) }.kinked(self.first * 2.0, 1.0)
        }
    }
    fn min(self, o: Self) -> Self {
        -(-self).max(-o)
    }
    fn max(self, o: Self) -> Self {
        if self.value.low > o.value.high {
            self
        } else if self.value.high < o.value.low {
            o
        } else {
            let value = Interval::new(self.value.low.max(o.value.low), self.value.high.max(o.value.high));
            Self { value, ..self.either(o) }.kinked(self.first - o.first, 1.0)
        }
    }
}

/// What a table is on a stretch of its argument.
struct Lookup<'a> {
    table: &'a Table,
    /// Value, first and second derivative.
    pieces: Option<[Interval; 3]>,
    /// By how much the first derivative jumps as the argument grows.
    jump: Interval,
}

impl Lookup<'_> {
    fn add(&mut self, at: Interval) {
        let breaks = &self.table.breaks;
        let (Some(&first), Some(&last), false) = (breaks.first(), breaks.last(), self.table.pieces.is_empty()) else {
            return;
        };
        match self.table.outside {
            Outside::Clamped => self.stretch(at),
            Outside::Periodic => {
                let period = last - first;
                let low = at.low - ((at.low - first) / period).floor() * period;
                let high = low + (at.high - at.low);
                if high - low < period {
                    self.stretch(Interval::new(low, high.min(last)));
                    if high >= last {
                        self.stretch(Interval::new(first, high - period));
                    }
                } else {
                    self.stretch(Interval::new(first, last));
                }
            }
        }
    }

    /// Adds a stretch that a periodic table does not repeat on.
    fn stretch(&mut self, at: Interval) {
        let breaks = &self.table.breaks;
        let count = self.table.pieces.len();
        // Break points at the ends of the stretch belong to it.
        let begin = breaks.partition_point(|place| *place < at.low);
        let end = breaks.partition_point(|place| *place <= at.high);
        for k in begin..end {
            self.kink(k);
        }
        for k in begin.saturating_sub(1)..end.min(count) {
            let s = Interval::new((at.low - breaks[k]).max(0.0), (at.high - breaks[k]).min(breaks[k + 1] - breaks[k]));
            self.piece(self.table.pieces[k], s);
        }
        if self.table.outside == Outside::Clamped {
            if at.low < breaks[0] {
                self.piece([self.left(0)[0], 0.0, 0.0, 0.0], Interval::ZERO);
            }
            if at.high > breaks[count] {
                self.piece([self.right(count - 1)[0], 0.0, 0.0, 0.0], Interval::ZERO);
            }
        }
    }

    /// Value and slope at the left end of a piece.
    fn left(&self, piece: usize) -> [f64; 2] {
        let [c0, c1, ..] = self.table.pieces[piece];
        [c0, c1]
    }

    /// The same at the right end.
    fn right(&self, piece: usize) -> [f64; 2] {
        let s = self.table.breaks[piece + 1] - self.table.breaks[piece];
        let [c0, c1, c2, c3] = self.table.pieces[piece];
        [c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2.0 * c2 + s * 3.0 * c3)]
    }

    /// Adds what happens at a break point.
    fn kink(&mut self, k: usize) {
        let count = self.table.pieces.len();
        let repeats = self.table.outside == Outside::Periodic;
        let before = if k > 0 { Some(k - 1) } else { repeats.then_some(count - 1) };
        let after = if k < count { Some(k) } else { repeats.then_some(0) };
        // Held ends keep their value and are level.
        let before = before.map(|piece| self.right(piece));
        let after = after.map(|piece| self.left(piece));
        let [[v, slope], [w, next]] = match (before, after) {
            (Some(before), Some(after)) => [before, after],
            (Some(end), None) => [end, [end[0], 0.0]],
            (None, Some(start)) => [[start[0], 0.0], start],
            (None, None) => return,
        };
        let level = self.table.pieces.first().map_or(0.0, |piece| piece[0].abs());
        let jumps = (v - w).abs() > ROUND_OFF * (v.abs() + w.abs() + level);
        let jump = if jumps { Interval::ALL } else { Interval::between(0.0, next - slope) };
        self.jump = self.jump.hull(jump);
    }

    /// Adds a cubic on a stretch from its left end.
    fn piece(&mut self, [c0, c1, c2, c3]: [f64; 4], s: Interval) {
        let slope = |s: f64| c1 + s * (2.0 * c2 + s * 3.0 * c3);
        let level = -c2 / (3.0 * c3);
        let ends = Interval::between(slope(s.low), slope(s.high));
        let first = if s.contains(level) { ends.hull(Interval::point(slope(level))) } else { ends };
        let second = Interval::between(2.0 * c2 + 6.0 * c3 * s.low, 2.0 * c2 + 6.0 * c3 * s.high);
        // Mean value form.
        let (middle, half) = (0.5 * (s.low + s.high), 0.5 * (s.high - s.low));
        let value =
            Interval::point(c0 + middle * (c1 + middle * (c2 + middle * c3))) + first * Interval::new(-half, half);
        let known = self.pieces.unwrap_or([value, first, second]);
        self.pieces = Some([known[0].hull(value), known[1].hull(first), known[2].hull(second)]);
    }
}

#[cfg(test)]
mod tests;
