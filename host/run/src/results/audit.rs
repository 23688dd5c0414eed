//! [`Audit`]: what can be checked about a run without knowing its solution.

use serde::{Deserialize, Serialize};

/// Energies that move count at least this share of the energy that is stored: of a smaller one, round-off of the stored one
/// would be an error.
const RESOLVED: f64 = 1e-6;
/// And at least this share of all work to and fro: its errors in steps that end at the same phases of a vibration have one sign. At the
/// limit of [`super::AuditLimits`] that is a hundred times the tolerance of the work done, where the errors of shakers come to six.
const TO_AND_FRO: f64 = 1e-2;

/// Largest violations and the energy balance over the accepted steps. Energies belong to all of them; violations to all in
/// Cartesian coordinates, to every 32nd and the last in joint coordinates (all `--without audit`).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Audit {
    /// Largest violation of any constraint row, as a displacement over the size of the scene.
    pub position_violation: f64,
    /// The time it is at, s.
    pub position_violation_at: f64,
    /// Largest violation of the rate of any constraint row, over the largest speed.
    pub velocity_violation: f64,
    /// The time it is at, s.
    pub velocity_violation_at: f64,
    /// Largest error of the energy balance, kinetic + potential - work done, over the largest energy that moved (or a
    /// millionth of the largest potential energy, or a hundredth of all work to and fro, if that is more).
    pub energy_error_relative: f64,
    /// The time it is at, s.
    pub energy_error_at: f64,
    /// The same at the samples, whose states are interpolated and brought to the constraints; zero where they are not looked
    /// at.
    pub sample_energy_error_relative: f64,
    /// The time it is at, s.
    pub sample_energy_error_at: f64,
    /// At samples that need accelerations or reactions, the largest of what these leave of the forces on a body, or of the
    /// torques, over the sum of the magnitudes of its own; zero where they are not looked at.
    pub load_imbalance: f64,
    /// The time it is at, s.
    pub load_imbalance_at: f64,
    /// Kinetic energy at the end, J.
    pub kinetic_energy: f64,
    /// Potential energy at the end, J.
    pub potential_energy: f64,
    /// Work done so far by everything without a potential, J; dissipation counts negative.
    pub work: f64,
    /// Part of it that elements turned into heat, J, as far as they report it; not negative. Where other work is done as well, its power
    /// is integrated by the method's own rule over each step.
    pub dissipated: f64,
    /// Estimated error of that integral, J, and so of `work_in`: the sum over the steps of the differences to a rule of lower order. Zero
    /// where all work is heat, or none.
    pub dissipated_error: f64,
    /// Part of it that was lost in impacts, J.
    pub lost_in_impacts: f64,
    /// How many impacts there were.
    pub impacts: u64,
    /// All other work, J, by drives and loads: `work` + `dissipated` + `lost_in_impacts`.
    pub work_in: f64,
    #[serde(skip)]
    start: Option<[f64; 2]>,
    /// Largest kinetic energy, J; infinite where it is not known.
    #[serde(skip)]
    fastest: f64,
    /// Work to and fro, the sum of the magnitudes of what was done in each step, J.
    #[serde(skip)]
    to_and_fro: f64,
    #[serde(skip)]
    largest: f64,
    #[serde(skip)]
    error: f64,
    #[serde(skip)]
    samples: SampleError,
    #[serde(skip)]
    worst_rows: [Option<usize>; 2],
    #[serde(skip)]
    worst_body: Option<usize>,
}

/// The energy balance at the samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct SampleError {
    /// Largest error, J.
    error: f64,
    /// Largest energy that moved, J; in accepted states besides the samples, these come on top.
    largest: f64,
}

/// All of an [`Audit`], so that it can continue in another process.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AuditRecord {
    violations: [f64; 2],
    energies: [f64; 5],
    start: Option<[f64; 2]>,
    largest: f64,
    error: f64,
    #[serde(default)]
    samples: SampleError,
    /// Times of the four measures, s.
    #[serde(default)]
    times: [f64; 4],
    worst_row: Option<usize>,
    worst_rate: Option<usize>,
    /// J.
    #[serde(default)]
    lost_in_impacts: f64,
    #[serde(default)]
    impacts: u64,
    /// Imbalance of loads and its time, s; its body.
    #[serde(default)]
    loads: [f64; 2],
    #[serde(default)]
    worst_body: Option<usize>,
    #[serde(default)]
    dissipated_error: f64,
    #[serde(default = "unknown")]
    fastest: f64,
    #[serde(default)]
    to_and_fro: f64,
}

fn unknown() -> f64 {
    f64::INFINITY
}

impl From<&Audit> for AuditRecord {
    fn from(audit: &Audit) -> Self {
        Self {
            violations: [audit.position_violation, audit.velocity_violation],
            energies: [audit.kinetic_energy, audit.potential_energy, audit.work, audit.dissipated, audit.work_in],
            start: audit.start,
            largest: audit.largest,
            error: audit.error,
            samples: audit.samples,
            times: [
                audit.position_violation_at,
                audit.velocity_violation_at,
                audit.energy_error_at,
                audit.sample_energy_error_at,
            ],
            worst_row: audit.worst_rows[0],
            worst_rate: audit.worst_rows[1],
            lost_in_impacts: audit.lost_in_impacts,
            impacts: audit.impacts,
            loads: [audit.load_imbalance, audit.load_imbalance_at],
            worst_body: audit.worst_body,
            dissipated_error: audit.dissipated_error,
            fastest: audit.fastest,
            to_and_fro: audit.to_and_fro,
        }
    }
}

impl From<&AuditRecord> for Audit {
    fn from(record: &AuditRecord) -> Self {
        let [position_violation, velocity_violation] = record.violations;
        let [kinetic_energy, potential_energy, work, dissipated, work_in] = record.energies;
        let AuditRecord { start, largest, error, samples, times, worst_row, worst_rate, worst_body, .. } = *record;
        let [load_imbalance, load_imbalance_at] = record.loads;
        let [position_violation_at, velocity_violation_at, energy_error_at, sample_energy_error_at] = times;
        Self {
            position_violation,
            position_violation_at,
            velocity_violation,
            velocity_violation_at,
            energy_error_relative: share(error, largest),
            energy_error_at,
            sample_energy_error_relative: share(samples.error, larger(largest, samples.largest)),
            sample_energy_error_at,
            load_imbalance,
            load_imbalance_at,
            kinetic_energy,
            potential_energy,
            work,
            dissipated,
            dissipated_error: record.dissipated_error,
            lost_in_impacts: record.lost_in_impacts,
            impacts: record.impacts,
            work_in,
            start,
            fastest: record.fastest,
            to_and_fro: record.to_and_fro,
            largest,
            error,
            samples,
            worst_rows: [worst_row, worst_rate],
            worst_body,
        }
    }
}

/// An error of the energy balance over the largest energy that moved.
fn share(error: f64, largest: f64) -> f64 {
    if largest > 0.0 { error / largest } else { 0.0 }
}

impl Audit {
    /// Takes smaller energies (J) for none: errors are shares of at least this.
    pub fn count_from(&mut self, energy: f64) {
        self.largest = self.largest.max(energy);
    }

    /// Takes energies and work (J) in an accepted state at time `t` (s).
    pub fn energy(&mut self, t: f64, kinetic: f64, potential: f64, work: f64) {
        self.to_and_fro += self.start.map_or(0.0, |_| (work - self.work).abs());
        let (error, moved) = self.balance(kinetic, potential, work);
        (self.kinetic_energy, self.potential_energy, self.work) = (kinetic, potential, work);
        self.largest = self.largest.max(moved).max(TO_AND_FRO * self.to_and_fro);
        self.fastest = self.fastest.max(kinetic);
        keep(&mut self.error, &mut self.energy_error_at, error, t);
        self.relate();
    }

    /// The largest kinetic energy of all accepted states, J; `None` where it is not known.
    #[must_use]
    pub fn largest_kinetic_energy(&self) -> Option<f64> {
        self.start.map(|_| self.fastest).filter(|energy| energy.is_finite())
    }

    /// Takes energies and work (J) as they are reported at time `t` (s).
    pub fn sample_energy(&mut self, t: f64, kinetic: f64, potential: f64, work: f64) {
        let (error, moved) = self.balance(kinetic, potential, work);
        let grows = moved > self.samples.largest;
        if keep(&mut self.samples.error, &mut self.sample_energy_error_at, error, t) || grows {
            self.samples.largest = self.samples.largest.max(moved);
            self.relate();
        }
    }

    /// Error of the energy balance since the first state, and the largest energy that moved, J.
    fn balance(&mut self, kinetic: f64, potential: f64, work: f64) -> (f64, f64) {
        let [kinetic_start, potential_start] = *self.start.get_or_insert([kinetic, potential]);
        let change = (kinetic - kinetic_start) + (potential - potential_start) - work;
        let stored = RESOLVED * potential.abs().max(potential_start.abs());
        (change.abs(), kinetic.max((potential - potential_start).abs()).max(work.abs()).max(stored))
    }

    /// By how much the energies and work (J) of a state miss the balance with those of the last accepted one, as a share of the
    /// largest energy that moved.
    #[must_use]
    pub fn step_error(&self, kinetic: f64, potential: f64, work: f64) -> f64 {
        let before = self.kinetic_energy + self.potential_energy - self.work;
        let stored = RESOLVED * potential.abs().max(self.potential_energy.abs());
        share((kinetic + potential - work - before).abs(), self.largest.max(kinetic).max(stored))
    }

    /// Errors of energies as shares of what moved so far.
    fn relate(&mut self) {
        self.energy_error_relative = share(self.error, self.largest);
        self.sample_energy_error_relative = share(self.samples.error, self.largest.max(self.samples.largest));
    }

    /// Takes what was turned into heat in a step (J), where other work is done as well, and an estimate of its error of either sign.
    pub fn heated(&mut self, energy: f64, error: f64) {
        self.dissipated = (self.dissipated + energy).max(0.0);
        self.dissipated_error += error.abs();
    }

    /// Says that heat is what [`Audit::heated`] was told, and all else other work. To be called after [`Audit::energy`].
    pub fn heat_is_told(&mut self) {
        self.work_in = self.work + self.dissipated + self.lost_in_impacts;
    }

    /// Takes impacts, with the energy lost in them, J.
    pub fn struck(&mut self, impacts: u64, lost: f64) {
        self.impacts += impacts;
        self.lost_in_impacts += lost;
    }

    /// Says that all work is turned into heat, or none. To be called after [`Audit::energy`].
    pub fn heat_is_all(&mut self, all: bool) {
        let other = self.work + self.lost_in_impacts;
        (self.dissipated, self.work_in) = if all { (-other, 0.0) } else { (0.0, other) };
    }

    /// Takes the worst violations of positions and of rates in an accepted state at time `t` (s), each with its row.
    pub fn violation(&mut self, t: f64, position: (f64, Option<usize>), velocity: (f64, Option<usize>)) {
        if keep(&mut self.position_violation, &mut self.position_violation_at, position.0, t) {
            self.worst_rows[0] = position.1;
        }
        if keep(&mut self.velocity_violation, &mut self.velocity_violation_at, velocity.0, t) {
            self.worst_rows[1] = velocity.1;
        }
    }

    /// Takes what accelerations and reactions of a sample at time `t` (s) leave of the loads of the worst body.
    pub fn imbalance(&mut self, t: f64, share: f64, body: usize) {
        if keep(&mut self.load_imbalance, &mut self.load_imbalance_at, share, t) {
            self.worst_body = Some(body);
        }
    }

    /// The audit of a scene whose parts were integrated apart: energies and work added up; of violations the worst; the errors
    /// of the energy balance added up, over the sum of the largest energies that moved in each.
    #[must_use]
    pub fn together<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        let mut whole = Self::default();
        let (mut worst, mut worst_sample) = (0.0, 0.0);
        for part in parts {
            keep(
                &mut whole.position_violation,
                &mut whole.position_violation_at,
                part.position_violation,
                part.position_violation_at,
            );
            keep(
                &mut whole.velocity_violation,
                &mut whole.velocity_violation_at,
                part.velocity_violation,
                part.velocity_violation_at,
            );
            keep(&mut whole.load_imbalance, &mut whole.load_imbalance_at, part.load_imbalance, part.load_imbalance_at);
            whole.kinetic_energy += part.kinetic_energy;
            whole.fastest += part.fastest;
            whole.to_and_fro += part.to_and_fro;
            whole.start = whole.start.or(part.start);
            whole.potential_energy += part.potential_energy;
            whole.work += part.work;
            whole.dissipated += part.dissipated;
            whole.dissipated_error += part.dissipated_error;
            whole.lost_in_impacts += part.lost_in_impacts;
            whole.impacts += part.impacts;
            whole.work_in += part.work_in;
            // The times are those of the part that contributes most.
            keep(&mut worst, &mut whole.energy_error_at, part.error, part.energy_error_at);
            let samples = part.samples.error;
            keep(&mut worst_sample, &mut whole.sample_energy_error_at, samples, part.sample_energy_error_at);
            whole.error += part.error;
            whole.samples.error += samples;
            whole.largest += part.largest;
            whole.samples.largest += part.samples.largest;
        }
        whole.relate();
        whole
    }

    /// Largest energy that moved so far, J.
    #[must_use]
    pub fn largest_energy(&self) -> f64 {
        self.largest
    }

    /// The rows with the worst violations of a position and of a rate.
    #[must_use]
    pub fn worst_rows(&self) -> [Option<usize>; 2] {
        self.worst_rows
    }

    /// The body with the worst imbalance of loads.
    #[must_use]
    pub fn worst_body(&self) -> Option<usize> {
        self.worst_body
    }

    /// The largest of all measures.
    #[must_use]
    pub fn worst(&self) -> f64 {
        let energy = larger(self.energy_error_relative, self.sample_energy_error_relative);
        larger(larger(self.position_violation, self.velocity_violation), larger(energy, self.load_imbalance))
    }
}

/// The larger of two numbers; NaN wins.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Keeps the larger of a measure and a new value of it, with its time; whether that is the new one. NaN is the largest, the first
/// of them.
fn keep(measure: &mut f64, at: &mut f64, value: f64, t: f64) -> bool {
    let new = !measure.is_nan() && (value.is_nan() || value > *measure);
    if new {
        (*measure, *at) = (value, t);
    }
    new
}
