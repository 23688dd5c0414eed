//! [`AuditLimits`]: what the audit of a run may find before its results are suspect.

use serde::{Deserialize, Serialize};

use super::Audit;

/// Limit on violations of constraints and of their rates, with error control. Projection keeps them near round-off, whatever
/// the tolerance is.
const CONSTRAINTS: f64 = 1e-8;
/// Least limit on errors of energies, with error control.
const ENERGY: f64 = 1e-6;
/// Limit on errors of energies over the tolerance: what errors of single steps may add up to.
const ENERGY_OVER_TOLERANCE: f64 = 1e4;
/// Largest limit on errors of energies, however loose the tolerance is: a balance that is off by more says nothing.
const MOST_ENERGY: f64 = 1e-2;
/// Limit on imbalances of loads, whatever the steps are: what accelerations and reactions of one instant are solved to.
const LOADS: f64 = 1e-6;
/// Limit on everything else where steps are fixed and nothing controls their errors.
const FIXED_STEPS: f64 = 1e-3;

/// Largest measures of an [`Audit`] that are no reason to doubt the results.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AuditLimits {
    /// Of violations of constraints and of their rates.
    pub constraints: f64,
    /// Of the error of the energy balance, in accepted states and at samples.
    pub energy: f64,
    /// Of the imbalance of a body's loads.
    #[serde(default = "loads")]
    pub loads: f64,
}

fn loads() -> f64 {
    LOADS
}

impl AuditLimits {
    /// The same limit for all measures.
    #[must_use]
    pub fn all(limit: f64) -> Self {
        Self { constraints: limit, energy: limit, loads: limit }
    }

    /// The limits that belong to a relative tolerance, or to steps of a fixed size.
    #[must_use]
    pub fn belonging_to(tolerance: f64, fixed_steps: bool) -> Self {
        if fixed_steps {
            return Self { loads: LOADS, ..Self::all(FIXED_STEPS) };
        }
        let energy = (ENERGY_OVER_TOLERANCE * tolerance).clamp(ENERGY, MOST_ENERGY);
        Self { constraints: CONSTRAINTS, energy, loads: LOADS }
    }
}

/// What is measured of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Violation of a constraint.
    Position,
    /// Violation of the rate of a constraint.
    Velocity,
    /// Balance of energies in accepted states.
    Energy,
    /// Balance of energies at samples.
    SampleEnergy,
    /// Balance of a body's loads at samples.
    Loads,
}

/// A measure beyond its limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Excess {
    /// What was measured.
    pub measure: Measure,
    /// What was found; NaN counts as beyond any limit.
    pub found: f64,
    /// What is allowed.
    pub limit: f64,
    /// Time of what was found, s.
    pub at: f64,
    /// The constraint row, where one is to blame.
    pub row: Option<usize>,
}

impl Audit {
    /// The measures beyond their limits, the worst first.
    #[must_use]
    pub fn beyond(&self, limits: &AuditLimits) -> Vec<Excess> {
        let [position_row, velocity_row] = self.worst_rows();
        let excess = |measure, found, limit, at, row| Excess { measure, found, limit, at, row };
        let all = [
            excess(
                Measure::Position,
                self.position_violation,
                limits.constraints,
                self.position_violation_at,
                position_row,
            ),
            excess(
                Measure::Velocity,
                self.velocity_violation,
                limits.constraints,
                self.velocity_violation_at,
                velocity_row,
            ),
            excess(Measure::Energy, self.energy_error_relative, limits.energy, self.energy_error_at, None),
            excess(
                Measure::SampleEnergy,
                self.sample_energy_error_relative,
                limits.energy,
                self.sample_energy_error_at,
                None,
            ),
            excess(Measure::Loads, self.load_imbalance, limits.loads, self.load_imbalance_at, None),
        ];
        let mut beyond: Vec<Excess> =
            all.into_iter().filter(|one| one.found.is_nan() || one.found > one.limit).collect();
        beyond.sort_by(|a, b| (b.found / b.limit).total_cmp(&(a.found / a.limit)));
        beyond
    }
}
