//! The law of a stop: nothing until it is touched, then a power of the depth, with damping that vanishes with the
//! depth.
//!
//! ```text
//! F = F0 (x / d)^n (1 + lambda x')    for x > 0, else 0                 (1)
//! V = F0 d (x / d)^(n+1) / (n + 1)    P_dissipated = F0 (x / d)^n lambda x'^2    (2)
//! ```
//!
//! Source: Hunt & Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975).
//! For n > 1 force and slope are continuous at the touch.

use element_api::prelude::*;

/// A stop; lengths may as well be angles, forces torques.
#[derive(Debug, Clone, Copy)]
pub struct Contact {
    /// Force at the depth `depth`, F0.
    pub load: f64,
    /// Depth of `load`, d.
    pub depth: f64,
    /// Exponent n.
    pub exponent: f64,
    /// Damping lambda, s/m.
    pub damping: f64,
}

/// Depths (as shares of d) below this are no contact: powers and their derivatives stay finite.
const TOUCH: f64 = 1e-30;

impl Contact {
    /// (x / d)^e where there is contact, otherwise zero.
    fn power<S: Scalar>(&self, x: S, e: f64) -> S {
        let share = x / self.depth;
        let touch = S::from(TOUCH);
        S::select(touch, share, S::select(touch, share, share, touch).powf(e), S::zero())
    }

    /// (1)
    pub fn force<S: Scalar>(&self, x: S, rate: S) -> S {
        self.power(x, self.exponent) * (rate * self.damping + 1.0) * self.load
    }

    /// V of (2)
    pub fn potential<S: Scalar>(&self, x: S) -> S {
        self.power(x, self.exponent + 1.0) * (self.load * self.depth / (self.exponent + 1.0))
    }

    /// P of (2)
    pub fn dissipation<S: Scalar>(&self, x: S, rate: S) -> S {
        self.power(x, self.exponent) * rate * rate * (self.load * self.damping)
    }
}

/// Two stops of one coordinate, either of which may be missing.
#[derive(Debug, Clone, Copy)]
pub struct Stops {
    /// The law of both.
    pub contact: Contact,
    /// Coordinate at which the lower stop is touched.
    pub lower: Option<f64>,
    /// Coordinate at which the upper stop is touched.
    pub upper: Option<f64>,
}

impl Stops {
    /// Stops that leave room between them.
    pub fn new(contact: Contact, lower: Option<f64>, upper: Option<f64>) -> Result<Self, ParamError> {
        match (lower, upper) {
            (None, None) => Err(ParamError::new("", "needs `lower`, `upper`, or both")),
            (Some(low), Some(high)) if low >= high => {
                Err(ParamError::new("upper", format!("must be above `lower`: {high} is not above {low}")))
            }
            _ => Ok(Self { contact, lower, upper }),
        }
    }

    /// Adds up what `law` gives for the depth in each stop and its rate; the sign is +1 for the lower stop, which
    /// drives the coordinate up, -1 for the upper one.
    fn total<S: Scalar>(&self, coordinate: S, rate: S, law: impl Fn(&Contact, S, S, f64) -> S) -> S {
        let low = self.lower.map(|at| law(&self.contact, -coordinate + at, -rate, 1.0));
        let high = self.upper.map(|at| law(&self.contact, coordinate - at, rate, -1.0));
        low.into_iter().chain(high).fold(S::zero(), |sum, part| sum + part)
    }

    /// Force towards larger coordinates.
    pub fn force<S: Scalar>(&self, coordinate: S, rate: S) -> S {
        self.total(coordinate, rate, |contact, x, v, sign| contact.force(x, v) * sign)
    }

    /// Potential energy, J.
    pub fn potential<S: Scalar>(&self, coordinate: S) -> S {
        self.total(coordinate, S::zero(), |contact, x, _, _| contact.potential(x))
    }

    /// Dissipated power, W.
    pub fn dissipation<S: Scalar>(&self, coordinate: S, rate: S) -> S {
        self.total(coordinate, rate, |contact, x, v, _| contact.dissipation(x, v))
    }
}
