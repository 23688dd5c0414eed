//! Explicit Runge-Kutta method of order 5 with step size control and dense output.

use super::explicit::Explicit;
use super::pair::{Estimate, Pair, Row};

/// Abscissae; stage 6 is the derivative at the end.
pub(super) const C: [f64; 7] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
/// Arguments of the stages.
pub(super) const A: [Row; 6] = [
    &[],
    &[(0, 0.2)],
    &[(0, 3.0 / 40.0), (1, 9.0 / 40.0)],
    &[(0, 44.0 / 45.0), (1, -56.0 / 15.0), (2, 32.0 / 9.0)],
    &[(0, 19372.0 / 6561.0), (1, -25360.0 / 2187.0), (2, 64448.0 / 6561.0), (3, -212.0 / 729.0)],
    &[(0, 9017.0 / 3168.0), (1, -355.0 / 33.0), (2, 46732.0 / 5247.0), (3, 49.0 / 176.0), (4, -5103.0 / 18656.0)],
];
/// Weights, order 5.
pub(super) const B: Row =
    &[(0, 35.0 / 384.0), (2, 500.0 / 1113.0), (3, 125.0 / 192.0), (4, -2187.0 / 6784.0), (5, 11.0 / 84.0)];
/// Their differences from weights of order 4.
pub(super) const E: Row = &[
    (0, 71.0 / 57600.0),
    (2, -71.0 / 16695.0),
    (3, 71.0 / 1920.0),
    (4, -17253.0 / 339200.0),
    (5, 22.0 / 525.0),
    (6, -1.0 / 40.0),
];
/// Coefficient of the interpolation (Shampine, in the program DOPRI5).
const D: [Row; 1] = [&[
    (0, -12715105075.0 / 11282082432.0),
    (2, 87487479700.0 / 32700410799.0),
    (3, -10690763975.0 / 1880347072.0),
    (4, 701980252875.0 / 199316789632.0),
    (5, -1453857185.0 / 822651844.0),
    (6, 69997945.0 / 29380423.0),
]];

static PAIR: Pair = Pair {
    c: &C,
    a: &A,
    b: B,
    error: Estimate::Single(E),
    a_dense: &[],
    d: &D,
    order: 5.0,
    beta: 0.04,
    beta_share: 0.75,
    // Middles of 0..0.2, 0.3..0.8, 0.89..1.
    stability: 3.25,
};

/// Dormand & Prince 5(4) (1980) with dense output of order 4, after Hairer, Norsett & Wanner, "Solving Ordinary
/// Differential Equations I", 2nd ed. 1993, section II.5 and the program DOPRI5. For loose tolerances.
///
/// Six evaluations a step, and one more where the projection moves the new state. Deviations from the book as for
/// [`super::dop853()`]. With [`super::Options::fixed_step`] the error is not looked at.
#[must_use]
pub fn dopri5() -> Explicit {
    Explicit::new("dopri5", &PAIR)
}
