//! [`SecondOrder`]: a system as one of second order with constraints, for methods made for these.

use super::Failure;

/// Equations of motion with multipliers, constraints on positions:
///
/// M a + Phi_q^T lambda - Q = 0,  Phi(t, q) = 0,
///
/// with velocities v, one per direction in which q may move, and accelerations a = v'. Positions may be rotations: q moves by
/// an increment along its directions, not by a sum. A state y of the [`super::System`] holds positions and velocities, in
/// whatever way, and sums that nothing depends on (the work done).
pub trait SecondOrder {
    /// Number n of velocities.
    fn velocities(&self) -> usize;

    /// Number m of multipliers, one per constraint in use.
    fn multipliers(&self) -> usize;

    /// First entry of the state that is a sum; all later ones are, too.
    fn sums_from(&self) -> usize;

    /// The n velocities in a state; the accelerations, if `y` holds the rates of a state.
    fn velocities_of(&self, y: &[f64], velocities: &mut [f64]);

    /// `y`: the state with the positions of `y0` moved by `increment` (n; Lie group: q0 exp(increment)), and the velocities
    /// `velocities`. Sums are those of `y0`. `[hot]`
    fn place(&self, y0: &[f64], increment: &[f64], velocities: &[f64], y: &mut [f64]);

    /// What is left of both equations, `forces` (n) and `rows` (m), for given accelerations and multipliers; and all rates of
    /// the state with them, `dy`. `[hot]`
    ///
    /// # Errors
    /// See [`Failure`].
    fn residual(
        &mut self,
        at: &Instant<'_>,
        forces: &mut [f64],
        rows: &mut [f64],
        dy: &mut [f64],
    ) -> Result<(), Failure>;

    /// Factors the matrix of Newton's method where `residual` was called last, or an approximation of it:
    ///
    /// \[mass_share M + damping_share C + K, Phi_q^T; Phi_q, 0\], C and K the derivatives of M a + Phi_q^T lambda - Q along
    /// velocities and positions.
    ///
    /// # Errors
    /// See [`Failure`].
    fn factor(&mut self, mass_share: f64, damping_share: f64) -> Result<(), Failure>;

    /// Solves with the matrix factored last: the `moves` (n) along the positions and `changes` (m) of the multipliers that
    /// take the residual away, to first order. `[hot]`
    ///
    /// # Errors
    /// See [`Failure`].
    fn solve(&mut self, forces: &[f64], rows: &[f64], moves: &mut [f64], changes: &mut [f64]) -> Result<(), Failure>;
}

/// A time with a state, its accelerations (n) and multipliers (m).
#[derive(Debug, Clone, Copy)]
pub struct Instant<'a> {
    /// Time.
    pub t: f64,
    /// State of the system.
    pub y: &'a [f64],
    /// Rates of the velocities.
    pub accelerations: &'a [f64],
    /// Of the constraints in use.
    pub multipliers: &'a [f64],
}
