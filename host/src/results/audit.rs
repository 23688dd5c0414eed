//! [`Audit`]: what can be checked about a run without knowing its solution.

use serde::Serialize;

/// Energies that move count at least this share of the energy that is stored: of a smaller one, round-off of the stored one
/// would be an error.
const RESOLVED: f64 = 1e-6;

/// Largest violations and the energy balance over the accepted steps. Energies belong to all of them; violations to all in
/// Cartesian coordinates, to every eighth and the last in joint coordinates (all `--without audit`).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Audit {
    /// Largest violation of any constraint row, as a displacement over the size of the scene.
    pub position_violation: f64,
    /// Largest violation of the rate of any constraint row, over the largest speed.
    pub velocity_violation: f64,
    /// Largest error of the energy balance, kinetic + potential - work done, over the largest energy that moved (or a
    /// millionth of the largest potential energy, if that is more).
    pub energy_error_relative: f64,
    /// Kinetic energy at the end, J.
    pub kinetic_energy: f64,
    /// Potential energy at the end, J.
    pub potential_energy: f64,
    /// Work done so far by everything without a potential, J; dissipation counts negative.
    pub work: f64,
    #[serde(skip)]
    start: Option<[f64; 2]>,
    #[serde(skip)]
    largest: f64,
    #[serde(skip)]
    error: f64,
    #[serde(skip)]
    worst_row: Option<usize>,
}

impl Audit {
    /// Takes energies and work (J) after a step.
    pub fn energy(&mut self, kinetic: f64, potential: f64, work: f64) {
        let [kinetic_start, potential_start] = *self.start.get_or_insert([kinetic, potential]);
        (self.kinetic_energy, self.potential_energy, self.work) = (kinetic, potential, work);
        let change = (kinetic - kinetic_start) + (potential - potential_start) - work;
        let stored = RESOLVED * potential.abs().max(potential_start.abs());
        self.largest = self.largest.max(kinetic).max((potential - potential_start).abs()).max(work.abs()).max(stored);
        self.error = larger(self.error, change.abs());
        self.energy_error_relative = if self.largest > 0.0 { self.error / self.largest } else { 0.0 };
    }

    /// Takes the worst violations after a step, and the row of the worst position.
    pub fn violation(&mut self, position: f64, velocity: f64, row: Option<usize>) {
        if position.is_nan() || position > self.position_violation {
            self.worst_row = row;
        }
        self.position_violation = larger(self.position_violation, position);
        self.velocity_violation = larger(self.velocity_violation, velocity);
    }

    /// The audit of a scene whose parts were integrated apart: energies and work added up; of violations the worst; the errors
    /// of the energy balance added up, over the largest energy that moved in any part.
    #[must_use]
    pub fn together<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        let mut whole = Self::default();
        for part in parts {
            whole.position_violation = larger(whole.position_violation, part.position_violation);
            whole.velocity_violation = larger(whole.velocity_violation, part.velocity_violation);
            whole.kinetic_energy += part.kinetic_energy;
            whole.potential_energy += part.potential_energy;
            whole.work += part.work;
            whole.error += part.error;
            whole.largest = larger(whole.largest, part.largest);
        }
        whole.energy_error_relative = if whole.largest == 0.0 { 0.0 } else { whole.error / whole.largest };
        whole
    }

    /// The row with the worst violation of a position.
    #[must_use]
    pub fn worst_row(&self) -> Option<usize> {
        self.worst_row
    }

    /// The largest of the three measures.
    #[must_use]
    pub fn worst(&self) -> f64 {
        larger(larger(self.position_violation, self.velocity_violation), self.energy_error_relative)
    }
}

/// The larger of two numbers; NaN wins.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
