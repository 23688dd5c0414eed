//! The recurrences: a coefficient of a result from those of its operands, and from its own of lower orders.

use odyn_numerics::precise::DoubleDouble;

use super::{Operation, Piece, Place, Series};
use element_api::{Outside, Table};

const ZERO: DoubleDouble = DoubleDouble::ZERO;

/// The coefficients of all places.
#[derive(Debug, Clone)]
pub(super) struct Coefficients {
    numbers: Vec<DoubleDouble>,
    /// Coefficients per place.
    length: usize,
}

fn whole(n: usize) -> DoubleDouble {
    DoubleDouble::from(n as f64)
}

impl Coefficients {
    pub(super) fn new(places: usize, order: usize) -> Self {
        Self { numbers: vec![ZERO; places * (order + 1)], length: order + 1 }
    }

    pub(super) fn of(&self, place: Place) -> &[DoubleDouble] {
        &self.numbers[place * self.length..(place + 1) * self.length]
    }

    pub(super) fn get(&self, place: Place, order: usize) -> DoubleDouble {
        self.numbers[place * self.length + order]
    }

    pub(super) fn set(&mut self, place: Place, order: usize, value: DoubleDouble) {
        self.numbers[place * self.length + order] = value;
    }

    /// The sum of `a[j] b[k - j]` for j from `from` to `to`.
    fn products(&self, a: Place, b: Place, k: usize, from: usize, to: usize) -> DoubleDouble {
        let (a, b) = (self.of(a), self.of(b));
        (from..=to).fold(ZERO, |sum, j| sum + a[j] * b[k - j])
    }

    /// The sum of `j a[j] b[k - j]` for j from 1 to `to`.
    fn weighted(&self, a: Place, b: Place, k: usize, to: usize) -> DoubleDouble {
        let (a, b) = (self.of(a), self.of(b));
        (1..=to).fold(ZERO, |sum, j| sum + whole(j) * a[j] * b[k - j])
    }

    /// Coefficient k of a b.
    fn product(&self, a: Place, b: Place, k: usize) -> DoubleDouble {
        self.products(a, b, k, 0, k)
    }

    /// Coefficient k of a quotient c = a / b: from a = b c.
    fn quotient(&self, c: Place, a: Place, b: Place, k: usize) -> DoubleDouble {
        let known = if k == 0 { ZERO } else { self.products(b, c, k, 1, k) };
        (self.get(a, k) - known) / self.get(b, 0)
    }

    /// Coefficient k > 0 of c with c' = a^' b where a^' is the rate of a: (c = sin a, b = cos a), ...
    fn grown(&self, a: Place, b: Place, k: usize) -> DoubleDouble {
        self.weighted(a, b, k, k) / whole(k)
    }

    fn root(&self, c: Place, a: Place, k: usize) -> DoubleDouble {
        match k {
            0 => self.get(a, 0).sqrt(),
            // A root that is zero throughout has no series of its own to divide by.
            _ if self.get(c, 0) == ZERO && self.of(a)[..=k].iter().all(|c| *c == ZERO) => ZERO,
            _ => (self.get(a, k) - self.products(c, c, k, 1, k - 1)) / (self.get(c, 0) + self.get(c, 0)),
        }
    }

    fn logarithm(&self, c: Place, a: Place, k: usize) -> DoubleDouble {
        match k {
            0 => self.get(a, 0).ln(),
            _ => (self.get(a, k) - self.weighted(c, a, k, k - 1) / whole(k)) / self.get(a, 0),
        }
    }

    /// From a c' = p a' c.
    fn real_power(&self, c: Place, a: Place, p: f64, k: usize) -> DoubleDouble {
        // A power of what is zero throughout has no logarithm.
        if p > 0.0 && self.of(a)[..=k].iter().all(|a| *a == ZERO) {
            return ZERO;
        }
        if k == 0 {
            return self.get(a, 0).powf(p);
        }
        let (of_a, of_c, p) = (self.of(a), self.of(c), DoubleDouble::from(p));
        let sum = (1..=k).fold(ZERO, |sum, j| sum + (p * whole(j) - whole(k - j)) * of_a[j] * of_c[k - j]);
        sum / (whole(k) * of_a[0])
    }

    /// From (x^2 + y^2) c' = x y' - y x'; the square of the distance is known up to k.
    fn angle(&self, c: Place, y: Place, x: Place, k: usize) -> DoubleDouble {
        if k == 0 {
            return self.get(y, 0).atan2(self.get(x, 0));
        }
        let rates = self.weighted(y, x, k, k) - self.weighted(x, y, k, k);
        let known = self.weighted(c, c + 1, k, k - 1);
        (rates - known) / (whole(k) * self.get(c + 1, 0))
    }
}

impl Series {
    /// Coefficient k of one operation.
    pub(super) fn step(&mut self, place: Place, operation: Operation, k: usize) {
        let c = &mut self.coefficients;
        let value = match operation {
            Operation::Add(a, b) => c.get(a, k) + c.get(b, k),
            Operation::Sub(a, b) => c.get(a, k) - c.get(b, k),
            Operation::Mul(a, b) => c.product(a, b, k),
            Operation::Scale(a, constant) => c.get(a, k) * c.get(constant, 0),
            Operation::Div(a, b) => c.quotient(place, a, b, k),
            Operation::Neg(a) => -c.get(a, k),
            Operation::Sqrt(a) => c.root(place, a, k),
            Operation::SinCos(a) => {
                let (sine, cosine) = match k {
                    0 => c.get(a, 0).sin_cos(),
                    _ => (c.grown(a, place + 1, k), -c.grown(a, place, k)),
                };
                c.set(place + 1, k, cosine);
                sine
            }
            Operation::Exp(a) if k == 0 => c.get(a, 0).exp(),
            Operation::Exp(a) => c.grown(a, place, k),
            Operation::Ln(a) => c.logarithm(place, a, k),
            Operation::Tanh(a) => {
                let value = if k == 0 { c.get(a, 0).tanh() } else { c.grown(a, place + 1, k) };
                c.set(place, k, value);
                let one = if k == 0 { DoubleDouble::ONE } else { ZERO };
                let rest = one - c.product(place, place, k);
                c.set(place + 1, k, rest);
                value
            }
            Operation::Atan2(y, x) => {
                let square = c.product(y, y, k) + c.product(x, x, k);
                c.set(place + 1, k, square);
                c.angle(place, y, x, k)
            }
            Operation::Powf(a, p) => c.real_power(place, a, p, k),
            Operation::Select([a, b, first, second], choice) => {
                if k == 0 {
                    self.choices[choice] = c.get(a, 0) < c.get(b, 0);
                }
                c.get(if self.choices[choice] { first } else { second }, k)
            }
            Operation::Table { at, table, order, piece } => {
                if k == 0 {
                    self.pieces[piece] = Piece::of(&self.tables[table], c.get(at, 0), order);
                }
                self.pieces[piece].coefficient(c, place, at, k)
            }
        };
        self.coefficients.set(place, k, value);
    }
}

impl Piece {
    /// The piece of a derivative of a table at an argument, chosen as [`Table::derivative`] does.
    fn of(table: &Table, x: DoubleDouble, order: u32) -> Self {
        let held = |value: f64, origin: f64, range: [f64; 2]| Self {
            powers: [DoubleDouble::from(value), ZERO, ZERO, ZERO],
            origin: DoubleDouble::from(origin),
            range,
        };
        let (Some(&first), Some(&last)) = (table.breaks.first(), table.breaks.last()) else { return Self::default() };
        if table.pieces.is_empty() || order > 3 {
            return held(0.0, 0.0, [f64::NEG_INFINITY, f64::INFINITY]);
        }
        let mut turns = ZERO;
        match table.outside {
            Outside::Periodic => {
                // The period as an exact difference, so that whole turns leave no trace.
                let period = DoubleDouble::from(last) - DoubleDouble::from(first);
                let count = ((x - DoubleDouble::from(first)) / period).to_f64().floor();
                turns = period * DoubleDouble::from(count);
            }
            Outside::Clamped if x < DoubleDouble::from(first) => {
                return held(table.derivative(f64::NEG_INFINITY, order), first, [f64::NEG_INFINITY, 0.0]);
            }
            Outside::Clamped if x > DoubleDouble::from(last) => {
                return held(table.derivative(f64::INFINITY, order), last, [0.0, f64::INFINITY]);
            }
            Outside::Clamped => {}
        }
        let inside = x - turns;
        let after = table.breaks.partition_point(|b| DoubleDouble::from(*b) <= inside);
        let piece = after.clamp(1, table.pieces.len()) - 1;
        let left = table.breaks[piece];
        let [c0, c1, c2, c3] = table.pieces[piece].map(DoubleDouble::from);
        let powers = match order {
            0 => [c0, c1, c2, c3],
            1 => [c1, whole(2) * c2, whole(3) * c3, ZERO],
            2 => [whole(2) * c2, whole(6) * c3, ZERO, ZERO],
            _ => [whole(6) * c3, ZERO, ZERO, ZERO],
        };
        let width = table.breaks[piece + 1] - left;
        Self { powers, origin: DoubleDouble::from(left) + turns, range: [0.0, width] }
    }

    /// Coefficient k of c0 + s (c1 + s (c2 + s c3)); s and the inner sums are at the places that follow.
    fn coefficient(&self, c: &mut Coefficients, place: Place, at: Place, k: usize) -> DoubleDouble {
        let [c0, c1, c2, c3] = self.powers;
        let constant = |value: DoubleDouble| if k == 0 { value } else { ZERO };
        let s = c.get(at, k) - constant(self.origin);
        c.set(place + 1, k, s);
        c.set(place + 2, k, constant(c2) + c3 * s);
        let sum = constant(c1) + c.product(place + 1, place + 2, k);
        c.set(place + 3, k, sum);
        constant(c0) + c.product(place + 1, place + 3, k)
    }
}
