//! What servos have in common: a second-order follower of a demand.

use element_api::prelude::*;

/// x' = min(max(v, -L), L), v' = w^2 (u - x) - 2 zeta w v.
#[derive(Debug, Clone, Copy)]
pub struct Follower {
    /// Natural frequency w, rad/s.
    pub frequency: f64,
    /// Damping ratio zeta.
    pub damping: f64,
    /// Largest rate L, m/s or rad/s.
    pub limit: Option<f64>,
}

impl Follower {
    /// Rates of x and v that follow the demand u.
    pub fn rates<S: Scalar>(&self, states: &[S], demand: S, out: &mut Values<'_, S>) {
        let (reached, speed) = (states[0], states[1]);
        out.push(self.limit.map_or(speed, |limit| speed.max(S::from(-limit)).min(S::from(limit))));
        let pull = (demand - reached) * (self.frequency * self.frequency);
        out.push(pull - speed * (2.0 * self.damping * self.frequency));
    }
}
