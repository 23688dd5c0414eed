//! [`Audit`]: what can be checked about a run without knowing its solution.

use serde::{Deserialize, Serialize};

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
    /// Part of it that elements turned into heat, J, as far as they tell; not negative. Where other work is done as well, summed
    /// up over the steps by parabolas, to a percent or better.
    pub dissipated: f64,
    /// All other work, J, by drives and loads: `work` + `dissipated`.
    pub work_in: f64,
    #[serde(skip)]
    heat: Heat,
    #[serde(skip)]
    start: Option<[f64; 2]>,
    #[serde(skip)]
    largest: f64,
    #[serde(skip)]
    error: f64,
    #[serde(skip)]
    worst_row: Option<usize>,
}

/// Powers turned into heat at the last two accepted states.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Heat {
    /// Time, s, and power, W; the older first.
    points: [[f64; 2]; 2],
    /// How many of them there are.
    known: u8,
}

impl Heat {
    /// Energy turned into heat, J, since the last state but what was said of it before: the integral of the parabola through
    /// this state and the two before it. Trapezoids with their error, h^3 / 12 f'' (Abramowitz & Stegun 1964, 25.4.2), taken
    /// from the second divided difference.
    fn next(&mut self, t: f64, power: f64) -> f64 {
        let [[t0, p0], [t1, p1]] = self.points;
        let (k, h) = (t1 - t0, t - t1);
        if self.known > 0 && h <= 0.0 {
            self.points[1] = [t, power];
            return 0.0;
        }
        let trapezoid = 0.5 * h * (p1 + power);
        let bend = |size: f64| size.powi(3) / 6.0 * ((power - p1) / h - (p1 - p0) / k) / (k + h);
        let energy = match self.known {
            0 => 0.0,
            1 => trapezoid,
            // The first interval was a trapezoid.
            2 => trapezoid - bend(h) - bend(k),
            _ => trapezoid - bend(h),
        };
        self.points = [[t1, p1], [t, power]];
        self.known = self.known.saturating_add(1);
        energy
    }
}

/// All of an [`Audit`], so that it can go on in another process.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AuditRecord {
    violations: [f64; 2],
    energies: [f64; 5],
    heat: Heat,
    start: Option<[f64; 2]>,
    largest: f64,
    error: f64,
    worst_row: Option<usize>,
}

impl From<&Audit> for AuditRecord {
    fn from(audit: &Audit) -> Self {
        Self {
            violations: [audit.position_violation, audit.velocity_violation],
            energies: [audit.kinetic_energy, audit.potential_energy, audit.work, audit.dissipated, audit.work_in],
            heat: audit.heat,
            start: audit.start,
            largest: audit.largest,
            error: audit.error,
            worst_row: audit.worst_row,
        }
    }
}

impl From<&AuditRecord> for Audit {
    fn from(record: &AuditRecord) -> Self {
        let [position_violation, velocity_violation] = record.violations;
        let [kinetic_energy, potential_energy, work, dissipated, work_in] = record.energies;
        let AuditRecord { heat, start, largest, error, worst_row, .. } = *record;
        let energy_error_relative = share(error, largest);
        Self {
            position_violation,
            velocity_violation,
            energy_error_relative,
            kinetic_energy,
            potential_energy,
            work,
            dissipated,
            work_in,
            heat,
            start,
            largest,
            error,
            worst_row,
        }
    }
}

/// An error of the energy balance over the largest energy that moved.
fn share(error: f64, largest: f64) -> f64 {
    if largest > 0.0 { error / largest } else { 0.0 }
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
        self.energy_error_relative = share(self.error, self.largest);
    }

    /// Takes the power that is turned into heat (W) at the time of an accepted state, where other work is done as well. To be
    /// called after [`Audit::energy`].
    pub fn heating(&mut self, t: f64, power: f64) {
        self.dissipated = (self.dissipated + self.heat.next(t, power)).max(0.0);
        self.work_in = self.work + self.dissipated;
    }

    /// Says that all work is turned into heat, or none. To be called after [`Audit::energy`].
    pub fn heat_is_all(&mut self, all: bool) {
        (self.dissipated, self.work_in) = if all { (-self.work, 0.0) } else { (0.0, self.work) };
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
            whole.dissipated += part.dissipated;
            whole.work_in += part.work_in;
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
