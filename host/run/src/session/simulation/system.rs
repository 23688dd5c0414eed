//! The hooks of the integrators.

use super::Simulation;
use super::contacts::Touch;
use crate::analysis::{AnalysisError, Group, Imbalance};
use crate::integrate::{Accepted, Entries, Failure, Flow, Guards, IntegrateError, Price, System, Watched};
use crate::interval::Range;
use crate::linalg::LinalgError;
use crate::program::Equations;
use crate::session::prepared::jump;

/// The error test controls the ends of steps; results interpolated inside are about this much less accurate (seen: 2 to 27
/// times), and it is results that a tolerance is about.
const INTERPOLATION_MARGIN: f64 = 5.0;

/// A smaller step may help against bad numbers, never against a broken element.
pub(super) fn failure(error: AnalysisError) -> Failure {
    match &error {
        AnalysisError::Element { .. }
        | AnalysisError::TorqueOnParticle { .. }
        | AnalysisError::TorqueOnThin { .. }
        | AnalysisError::Linalg(LinalgError::Length { .. } | LinalgError::Pattern(_)) => {
            Failure::Fatal(Box::new(error))
        }
        AnalysisError::NotFinite { .. } => Failure::NotFinite(Box::new(error)),
        // Equations that contradict each other at a time do so whatever led there.
        AnalysisError::Contradiction { .. } => Failure::Forbidden(Box::new(error)),
        _ => Failure::Recoverable(Box::new(error)),
    }
}

/// Error of the work done in a step that is allowed, as a share of the largest energy so far: a tenth of what the audit lets
/// pass ([`crate::results::AuditLimits`]).
const WORK: f64 = 1e-7;
/// The same over the tolerance, where that is more.
const WORK_OVER_TOLERANCE: f64 = 1e3;

impl Simulation<'_> {
    /// The sizes of speeds (m/s) and angular velocities (rad/s) that errors of steps are judged by.
    pub(super) fn speeds(&self) -> [f64; 2] {
        let (speed, spin) = (self.scales.speed_scale(), self.scales.spin_scale());
        let [slow, calm] = self.floor.of_speeds(speed).map(|least| least / self.allowed());
        [speed.max(slow), spin.max(calm)]
    }

    /// Takes differences of velocities for round-off where they are no more than that of the functions of time that drive a scene which
    /// they determine ([`super::floor::Floor::drive`]), from the state at the start `t` on for `duration`.
    pub(in crate::session) fn anticipate_drives(&mut self, equations: &Equations, start: (f64, &[f64]), duration: f64) {
        self.floor.drive(equations, start, (duration, self.scales.length), self.formulation.as_mut());
    }

    /// The largest entry of a difference of states, as a share of the size of its group; for the state of an element of its own
    /// size, which counts as no less than has the tolerance at its round-off ([`super::floor`]).
    fn largest_share(&mut self, y0: &[f64], y1: &[f64], error: &[f64]) -> f64 {
        let (length, allowed) = (self.scales.length_scale(), self.allowed());
        let [speed, spin] = self.speeds();
        let states_at = y0.len() - self.layout.states - 1;
        let mut worst = self.sizes.largest_share([length, speed, spin], &error[..states_at]);
        let [from, to, errors] = [y0, y1, error].map(|list| &list[states_at..y0.len() - 1]);
        for (k, (error, size)) in errors.iter().zip(self.state_sizes.between(from, to)).enumerate() {
            let share = error.abs() / size;
            if share.is_nan() {
                worst = share;
            } else if share > worst {
                let round_off = self.floor.of(k, self.formulation.as_mut(), &self.scales);
                worst = worst.max(error.abs() / size.max(round_off / allowed));
            }
        }
        worst
    }

    /// The error of a step that is allowed, as a share of the sizes of groups.
    fn allowed(&self) -> f64 {
        self.tolerance / INTERPOLATION_MARGIN
    }

    /// The largest angular velocity in a state, rad/s.
    fn fastest(&self, y: &[f64]) -> f64 {
        let speeds = self.formulation.groups().iter().zip(y).filter(|(group, _)| **group == Group::AngularVelocity);
        speeds.fold(0.0, |most, (_, speed)| most.max(speed.abs()))
    }

    fn take_sample(&mut self, t: f64, y: &[f64]) -> Result<(), Failure> {
        if self.formulation.is_free() {
            return self.sample_at(t, y);
        }
        // Interpolated states are off the constraints by the interpolation error, which reactions would amplify.
        let mut state = std::mem::take(&mut self.sample_state);
        state.copy_from_slice(y);
        let result = self.bring_back(t, &mut state).and_then(|()| self.sample_at(t, &state));
        self.sample_state = state;
        result
    }

    /// Takes a sample at an accepted state, before anything changes there.
    ///
    /// # Errors
    /// Why it could not be taken.
    pub(in crate::session) fn sample_now(&mut self, t: f64, y: &[f64]) -> Result<(), IntegrateError> {
        self.take_sample(t, y).map_err(|failure| match failure {
            Failure::Recoverable(cause)
            | Failure::NotFinite(cause)
            | Failure::Forbidden(cause)
            | Failure::Fatal(cause) => IntegrateError::System { t, cause },
        })
    }

    /// Takes a sample at a state on the constraints.
    fn sample_at(&mut self, t: f64, state: &[f64]) -> Result<(), Failure> {
        if self.is_driven && self.formulation.leaves_rows_out() {
            self.check_rows_left_out(t, state).map_err(failure)?;
        }
        self.report.at(self.formulation.as_mut(), &mut self.observed, t, state).map_err(failure)?;
        self.look_at_margins(t, state).map_err(failure)?;
        let Imbalance { share, body } = self.report.imbalance;
        self.audit.imbalance(t, share, body);
        let number = self.samples;
        self.samples += 1;
        let (values, energies) = self.report.outputs().split_at(self.channels);
        if let [kinetic, potential] = *energies {
            self.audit.sample_energy(t, kinetic, potential, state.last().copied().unwrap_or(0.0));
        }
        self.rows_taken.sink().sample(number, values).map_err(|error| Failure::Fatal(Box::new(error)))?;
        self.take_picture(number, t, state)
    }
}

/// A rate of a counted angle may grow by this factor from one step to the next.
const GAINS: f64 = 2.0;

impl System for Simulation<'_> {
    fn dim(&self) -> usize {
        self.formulation.groups().len()
    }

    fn rhs(&mut self, t: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        self.formulation.rates(t, y, dy).map_err(failure)
    }

    fn begin_step(&mut self, t: f64, y: &[f64], h: f64) {
        self.floor.begin_step(t, y, h);
        self.state_sizes.take(&y[y.len() - self.layout.states - 1..]);
    }

    fn error_norm(&mut self, y0: &[f64], y1: &[f64], error: &[f64]) -> f64 {
        self.largest_share(y0, y1, error) / self.allowed()
    }

    fn size(&mut self, y: &[f64], difference: &[f64]) -> f64 {
        self.largest_share(y, y, difference)
    }

    fn jacobian(&mut self, t: f64, y: &[f64], found: Entries<'_>) -> Result<bool, Failure> {
        self.formulation.jacobian(t, y, found).map_err(failure)
    }

    fn price(&self) -> Price {
        let price = self.formulation.price();
        Price { evaluation: price.rates, jacobian: price.jacobian, preparation: price.preparation }
    }

    fn tolerance(&self) -> Option<f64> {
        Some(self.allowed())
    }

    fn project(&mut self, t: f64, y: &mut [f64]) -> Result<(), Failure> {
        self.project_end(t, y).map_err(failure)?;
        self.settle_after_step(t, y).map_err(failure)?;
        if self.formulation.leaves_rows_out() {
            self.check_rows_left_out(t, y).map_err(failure)?;
        }
        self.certify(t, y).map_err(failure)?;
        self.formulation.next_step(t, y).map_err(failure)
    }

    /// Corrections are bounded, whether or not they are elsewhere.
    fn project_across(&mut self, t: f64, y: &mut [f64]) -> Result<(), Failure> {
        let elsewhere = self.most_off;
        self.bound_corrections(jump(self.tolerance));
        let turned = self.project(t, y);
        self.bound_corrections(elsewhere);
        turned
    }

    fn bring_back(&mut self, t: f64, y: &mut [f64]) -> Result<(), Failure> {
        if self.formulation.is_free() { Ok(()) } else { self.formulation.project(t, y).map_err(failure) }
    }

    fn sums_norm(&mut self, y0: &[f64], y1: &[f64], error: &[f64]) -> f64 {
        let [from, to, error] = [y0, y1, error].map(|list| list.last().map_or(0.0, |work| work.abs()));
        let energy = self.largest_kinetic.max(self.least_energy).max(from).max(to);
        if energy > 0.0 { error / (energy * WORK.max(WORK_OVER_TOLERANCE * self.tolerance)) } else { 0.0 }
    }

    fn sums_from(&self) -> usize {
        self.dim() - 1
    }

    fn sums_up(&self) -> bool {
        self.powers.is_some()
    }

    fn rate_summed(&mut self, t: f64, y: &[f64]) -> Result<f64, Failure> {
        let Some(powers) = &mut self.powers else { return Ok(0.0) };
        let solves = powers.needs_dynamics || powers.solved.is_some();
        // The motion does not depend on what is looked at.
        let traces = solves.then(|| self.formulation.traces());
        let found = powers.at(self.formulation.as_mut(), &mut self.observed, t, y).map_err(failure)?;
        let heat = found.iter().sum();
        traces.iter().for_each(|traces| self.formulation.forget_since(traces));
        Ok(heat)
    }

    fn sum_up(&mut self, integral: f64, difference: f64) {
        self.audit.heated(integral, difference);
    }

    fn conditions(&self) -> usize {
        self.switches.as_ref().map_or(0, |part| part.evaluator.outputs().len())
    }

    fn switching(&mut self, t: f64, y: &[f64], values: &mut [f64]) -> Result<(), Failure> {
        let Some(part) = &mut self.switches else { return Ok(()) };
        values.copy_from_slice(part.at(self.formulation.as_mut(), &mut self.observed, t, y).map_err(failure)?);
        Ok(())
    }

    fn stops(&self) -> usize {
        self.stop_count()
    }

    fn stopping(&mut self, t: f64, y: &[f64], values: &mut [f64]) -> Result<(), Failure> {
        self.stop_values(t, y, values).map_err(failure)
    }

    fn guards(&self) -> Guards {
        self.guarded.as_ref().map_or_else(Guards::default, |guarded| guarded.guards.clone())
    }

    fn enclose(
        &mut self,
        of: Watched,
        t: Range,
        entry: &dyn Fn(usize) -> Range,
        wanted: &dyn Fn(usize) -> bool,
        found: &mut [Range],
    ) {
        let Some(guarded) = &mut self.guarded else { return };
        let still = self.touch.as_ref().map_or_else(Default::default, Touch::still);
        guarded.bank(of).enclose(t, entry, [&self.references, &self.discrete], &still, wanted, found);
    }

    fn values(&mut self, of: Watched, t: f64, entry: &dyn Fn(usize) -> f64, found: &mut [f64]) {
        let Some(guarded) = &mut self.guarded else { return };
        let still = self.touch.as_ref().map_or_else(Default::default, Touch::still);
        guarded.bank(of).values(t, entry, [&self.references, &self.discrete], &still, found);
    }

    fn entry_size(&self, entry: usize) -> f64 {
        match self.formulation.groups()[entry] {
            Group::Position => self.scales.length_scale(),
            Group::Parameter => 1.0,
            Group::Velocity => self.scales.speed_scale(),
            Group::AngularVelocity => self.scales.spin_scale(),
            Group::State => self.state_sizes.largest()[entry + 1 + self.layout.states - self.dim()],
            Group::Work => self.largest_kinetic.max(self.least_energy),
        }
    }

    fn resolution(&self, entry: usize) -> f64 {
        self.tolerance * self.entry_size(entry)
    }

    fn turning(&self, y: &[f64]) -> f64 {
        self.formulation.turning(y)
    }

    fn look(&mut self, of: Watched, t: f64, y: &[f64], values: &mut [f64]) -> Result<(), Failure> {
        let look = match of {
            Watched::Within => &mut self.looks[0],
            Watched::Turns => &mut self.looks[1],
            // Its ranges are always to be had.
            Watched::Time => return Ok(()),
        };
        let Some(part) = look else { return Ok(()) };
        values.copy_from_slice(part.at(self.formulation.as_mut(), &mut self.observed, t, y).map_err(failure)?);
        Ok(())
    }

    fn next_end(&self, t: f64) -> f64 {
        self.clocks.next_instant(t)
    }

    fn max_step_hint(&self, _: f64, y: &[f64]) -> f64 {
        if self.counted.is_empty() {
            return f64::INFINITY;
        }
        // Angles must stay within half a turn of their references: at most 1 rad is used up, and two bodies may turn
        // against each other. This looks at the speed at the start only, of what is counted that of the step before with room to gain; the
        // step is judged when it is made.
        let fastest = self.fastest(y).min(self.turning.rate.map_or(f64::INFINITY, |rate| GAINS * rate));
        if fastest > 0.0 { 1.0 / fastest } else { f64::INFINITY }
    }

    fn sample(&mut self, t: f64, y: &[f64]) -> Result<(), Failure> {
        self.take_sample(t, y)
    }

    fn accept(&mut self, t: f64, y: &mut [f64]) -> Result<Accepted, Failure> {
        self.remedies = self.formulation.counters().remedies();
        self.watch(t, y).map_err(failure)?;
        self.watch_contacts(t, y).map_err(failure)?;
        let changed = self.remember(t, y).map_err(failure)?;
        if changed == Accepted::Changed {
            self.settle_anew(t, y).map_err(failure)?;
        }
        Ok(changed)
    }

    fn step_done(&mut self, t: f64, _: &[f64], h: f64) -> Flow {
        self.last_steps = [self.last_steps[1], h];
        self.now = t;
        let flow = self.rows_taken.sink().step(t);
        if self.tier.counts_step() {
            let mut tier = std::mem::take(&mut self.tier);
            let samples = self.samples_in_all.saturating_sub(self.samples);
            tier.between_steps(t, samples, || self.programs());
            self.tier = tier;
        }
        flow
    }
}
