//! What is looked at in accepted states: energies, violations, memory that changes between steps.

use super::{Heat, Margins, Part, Simulation};
use crate::analysis::{AnalysisError, CONTRADICTION, Group};
use crate::integrate::Accepted;
use crate::plan::Layout;
use crate::program::{Equations, Node, Used};

/// An angle that has moved this far from its reference gets a new one, rad.
const NEW_REFERENCE: f64 = 1.0;

/// Angular velocity of a particle, as a share of the scene's, from which a torque must be acting on it.
const PARTICLE_SPIN: f64 = 1e-6;

/// Angular velocity about an axis without moment of inertia, in tolerances of one that would hold all energy, up to which it is errors of
/// steps: seen was half a tolerance in five seconds.
const SPUN: f64 = 100.0;

/// Errors of the interpolation, in tolerances, beyond which a row that does not hold within a step contradicts others.
const MOST_INTERPOLATED: f64 = 100.0;

/// Share of what contradicts below which rows are not looked at closely: their gradients may differ by this from those at the start.
const FAR_FROM_CONTRADICTION: f64 = 1e-3;

/// An angle by which bodies may turn between two looks at them, rad: of their two sets of Euler parameters, which are half a turn of
/// their own apart, one that continues the last is recognised well within half a turn.
const TURNED: f64 = 1.0;

/// Rows that are named where they are not met.
const MOST_NAMED: usize = 4;

/// The values of all rows, in the coordinates of the formulation: those of a tree's joints are zero there.
pub(super) struct RowValues {
    part: Part,
    /// By how many metres each is off where its value is 1, at the start.
    metres: Vec<f64>,
}

impl RowValues {
    pub(super) fn used(&mut self) -> impl Iterator<Item = Used<'_>> {
        self.part.used()
    }
}

/// How fast the angles turn that are counted.
#[derive(Default)]
pub(super) struct Turning {
    /// When they were looked at last, s, where a method did not begin since.
    seen: Option<f64>,
    /// Their values there.
    angles: Vec<f64>,
    /// The largest of their rates since the time before, rad/s.
    pub(super) rate: Option<f64>,
}

impl Turning {
    fn look(&mut self, t: f64, angles: &[f64]) {
        let pairs = self.angles.iter().zip(angles);
        let change = pairs.fold(0.0_f64, |most, (before, now)| most.max((now - before).abs()));
        self.rate = self.seen.filter(|seen| *seen < t).map(|seen| change / (t - seen));
        self.seen = Some(t);
        self.angles.clear();
        self.angles.extend_from_slice(angles);
    }

    pub(super) fn forget(&mut self) {
        (self.seen, self.rate) = (None, None);
    }
}

impl Simulation<'_> {
    /// Violations at the last accepted state, unless they are known: to be called at the end of the run.
    pub(in crate::session) fn watch_end(&mut self, t: f64, state: &[f64]) {
        if self.watched % self.period != 1 % self.period {
            let known = self.formulation.observe(t, state, false).map(|observed| observed.inputs.to_vec());
            if known.and_then(|inputs| self.watch_rows(&inputs)).is_err() {
                self.audit.violation(t, (f64::NAN, None), (f64::NAN, None));
            }
        }
    }

    /// Energies, and now and then violations, at an accepted state: to be called at the start, then by the integrator.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn watch(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let rows_are_due = self.watched.is_multiple_of(self.period);
        if let Some(rate) = self.kink.take() {
            self.audit.violation(t, (0.0, None), rate);
        }
        if self.view.is_some() {
            self.watch_motion(t, state, &[])?;
        }
        if self.view.is_none() || rows_are_due || self.turned > TURNED && self.takes_parameters() {
            // Copied, since the formulation lends both its inputs and its element sets.
            let mut inputs = std::mem::take(&mut self.observed);
            inputs.clear();
            inputs.extend_from_slice(self.formulation.observe(t, state, false)?.inputs);
            let result = if self.view.is_none() { self.watch_motion(t, state, &inputs) } else { Ok(()) };
            let result = result.and_then(|()| if rows_are_due { self.watch_rows(&inputs) } else { Ok(()) });
            (self.observed, self.turned) = (inputs, 0.0);
            result?;
        }
        self.look_at_margins(t, state)
    }

    /// Whether anything that is looked at in states may take Euler parameters of bodies, so that these are to continue from one look to
    /// the next. Among the formulation's own coordinates there are none but those of the state.
    fn takes_parameters(&self) -> bool {
        let mut parts = [&self.report, &self.accept].into_iter().chain(self.margins.as_ref().map(Margins::part));
        !self.told.is_empty() || parts.any(|part| !part.own && part.solved.is_none())
    }

    /// Energies and speeds at an accepted state; `inputs` are those of the working form, where there is no view.
    fn watch_motion(&mut self, t: f64, state: &[f64], inputs: &[f64]) -> Result<(), AnalysisError> {
        let mut velocities = std::mem::take(&mut self.velocities);
        let found = match &mut self.view {
            Some(view) => {
                // It takes no inputs of the working form.
                let found = view.at(self.formulation.as_mut(), &mut Vec::new(), t, state)?;
                let (energies, speeds) = found.split_at(found.len() - 6 * self.layout.bodies);
                velocities.clear();
                velocities.extend_from_slice(speeds);
                energies
            }
            None => {
                self.gather_velocities(inputs, &mut velocities);
                if self.energy.needs_dynamics || self.energy.own {
                    self.energy.at(self.formulation.as_mut(), &mut self.observed, t, state)?
                } else {
                    self.energy.run(inputs, self.formulation.sets())?
                }
            }
        };
        let energies = (found[0], found[1]);
        let result = self.take_motion(t, state, energies, &velocities);
        self.velocities = velocities;
        result
    }

    /// Velocities and angular velocities of the bodies from inputs of the working form.
    fn gather_velocities(&self, inputs: &[f64], velocities: &mut Vec<f64>) {
        velocities.clear();
        for body in 0..self.layout.bodies {
            velocities.extend_from_slice(&inputs[self.layout.body_slot(body, 7)..][..6]);
        }
    }

    /// What elements want looked at, at an accepted state or a sample.
    pub(super) fn look_at_margins(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let Some(margins) = &mut self.margins else { return Ok(()) };
        margins.look(self.formulation.as_mut(), &mut self.observed, t, state)
    }

    fn take_motion(
        &mut self,
        t: f64,
        state: &[f64],
        (kinetic, potential): (f64, f64),
        velocities: &[f64],
    ) -> Result<(), AnalysisError> {
        let fastest = self.scales.grow_to(velocities);
        self.scales.way = self.scales.way.max(self.sizes.way(&self.began, state));
        self.turned += fastest * (t - self.now).abs();
        let spin_of = |body: usize| &velocities[6 * body + 3..][..3];
        for (body, name) in &self.particles {
            let spin = spin_of(*body).iter().fold(0.0_f64, |most, w| most.max(w.abs()));
            if spin > PARTICLE_SPIN * self.scales.spin_scale() {
                return Err(AnalysisError::TorqueOnParticle { body: name.clone() });
            }
        }
        self.largest_kinetic = self.largest_kinetic.max(kinetic);
        let errors = (SPUN * self.tolerance).powi(2);
        for (body, name, thin) in &self.thin {
            let spin = spin_of(*body);
            let about: f64 = (0..3).map(|k| spin[k] * thin.axis[k]).sum();
            if 0.5 * thin.moment * about * about > thin.share.max(errors) * self.largest_kinetic {
                return Err(AnalysisError::TorqueOnThin { body: name.clone() });
            }
        }
        let work = state.last().copied().unwrap_or(0.0);
        self.audit.energy(t, kinetic, potential, work);
        match self.heat {
            Heat::Summed => self.audit.heat_is_told(),
            known => self.audit.heat_is_all(known == Heat::All),
        }
        self.watched += 1;
        Ok(())
    }

    /// Where a remedy was called in since the last accepted state: fails unless the equations hold at the end of the step, and the
    /// energies over it.
    pub(super) fn certify(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        if self.formulation.counters().remedies() == self.remedies {
            return Ok(());
        }
        self.formulation.certify(t, state)?;
        if self.is_driven {
            // Error control does not see how the work of driven constraints grows.
            return Ok(());
        }
        let found = self.energy.at(self.formulation.as_mut(), &mut self.observed, t, state)?;
        let share = self.audit.step_error(found[0], found[1], state.last().copied().unwrap_or(0.0));
        if share > self.energy_limit || share.is_nan() {
            let what = "the balance of energies over the step".into();
            return Err(AnalysisError::Uncertified { remedy: "a passage or a rank-safe solution", what, share });
        }
        Ok(())
    }

    /// Prepares to look at the rows that are left out, if any are. Gives those that may come to contradict others for a moment,
    /// since they or others are driven, each with its number and how far it may be off.
    ///
    /// # Errors
    /// Equations without a value at the start.
    pub(in crate::session) fn watch_rows_left_out(
        &mut self,
        equations: &Equations,
        t: f64,
        state: &[f64],
    ) -> Result<Vec<(usize, Node, f64)>, AnalysisError> {
        let mut driven = Vec::new();
        if !self.formulation.leaves_rows_out() {
            return Ok(driven);
        }
        let inputs = self.formulation.observe(t, state, false)?.inputs.to_vec();
        self.rows.evaluate(&inputs, self.formulation.sets())?;
        let length = self.scales.length;
        let share = CONTRADICTION.max(MOST_INTERPOLATED * self.tolerance);
        let (mut nodes, mut metres) = (Vec::new(), Vec::new());
        self.rows.violations(&vec![1.0; self.rows.rows.len()], length, |row, off| {
            nodes.push(equations.rows[row].value);
            metres.push(off);
            if self.is_driven && !equations.graph.is_zero(equations.rows[row].time) && off > 0.0 {
                driven.push((row, equations.rows[row].value, share * length / off));
            }
        });
        self.values =
            Some(RowValues { part: Part::near(self.formulation.as_ref(), equations, &nodes, &self.layout), metres });
        Ok(driven)
    }

    /// Fails where rows that projection leaves to themselves do not hold any more.
    pub(super) fn check_rows_left_out(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        if let Some(RowValues { part, metres }) = &mut self.values {
            let values = part.at(self.formulation.as_mut(), &mut self.observed, t, state)?;
            let limit = FAR_FROM_CONTRADICTION * CONTRADICTION * self.scales.length;
            if values.iter().zip(metres).all(|(value, metres)| value.abs() * *metres <= limit) {
                return Ok(());
            }
        }
        let inputs = self.formulation.observe(t, state, false)?.inputs;
        self.observed.clear();
        self.observed.extend_from_slice(inputs);
        self.rows.evaluate(&self.observed, self.formulation.sets())?;
        let length = self.scales.length;
        let (worst, _) = self.rows.worst(self.rows.values(), length);
        if worst <= CONTRADICTION * length {
            return Ok(());
        }
        let mut off: Vec<&str> = Vec::new();
        self.rows.violations(self.rows.values(), length, |row, violation| {
            if violation.is_nan() || violation > 0.1 * worst {
                off.push(&self.row_names[row]);
            }
        });
        off.truncate(MOST_NAMED);
        self.contradictions += 1;
        Err(AnalysisError::Contradiction { what: off.join(", "), violation: worst / length })
    }

    /// Brings the end of a step to the constraints. Velocities that were off by more than a step with error control leaves are not its
    /// error but a kink of a row, at which they are turned without the impact that this would be: a violation of its rate.
    pub(super) fn project_end(&mut self, t: f64, y: &mut [f64]) -> Result<(), AnalysisError> {
        self.kink = None;
        if self.formulation.is_free() || self.most_off.is_infinite() {
            return self.formulation.project(t, y);
        }
        self.before.clear();
        self.before.extend_from_slice(y);
        let passed = self.formulation.counters().interpolated;
        self.formulation.project(t, y)?;
        // What is interpolated past a singular position changes with the way there.
        if self.formulation.counters().interpolated == passed {
            let before = std::mem::take(&mut self.before);
            self.kink = self.turned_by(t, &before, y)?;
            self.before = before;
        }
        Ok(())
    }

    /// By how much of the speeds in the scene velocities differ from those of `before`, if that is too much, and the row that they
    /// violated most.
    fn turned_by(&mut self, t: f64, before: &[f64], y: &[f64]) -> Result<Option<(f64, Option<usize>)>, AnalysisError> {
        let [speed, spin] = self.speeds();
        let size = |group: &Group| match group {
            Group::Velocity => Some(speed),
            Group::AngularVelocity => Some(spin),
            Group::Position | Group::Parameter | Group::State | Group::Work => None,
        };
        let entries = || self.formulation.groups().iter().zip(before.iter().zip(y));
        let shares = entries().filter_map(|(group, (was, is))| Some((is - was).abs() / size(group)?));
        let share = shares.fold(0.0, f64::max);
        if share <= self.most_off {
            return Ok(None);
        }
        let off: Vec<f64> =
            entries().map(|(group, (was, is))| if size(group).is_some() { *was } else { *is }).collect();
        let inputs = self.formulation.observe(t, &off, false)?.inputs.to_vec();
        let [_, (_, row)] = self.look_at_rows(&inputs)?;
        Ok(Some((share, row)))
    }

    /// Violations of all rows.
    fn watch_rows(&mut self, inputs: &[f64]) -> Result<(), AnalysisError> {
        let [(position, row), (velocity, rate)] = self.look_at_rows(inputs)?;
        let (length, speed) = (self.scales.length, self.scales.speed_scale());
        self.audit.violation(inputs[Layout::TIME], (position / length, row), (velocity / speed, rate));
        Ok(())
    }

    /// The worst value of a row, and the worst rate, each with its row.
    fn look_at_rows(&mut self, inputs: &[f64]) -> Result<[(f64, Option<usize>); 2], AnalysisError> {
        self.rows.evaluate(inputs, self.formulation.sets())?;
        self.row_right.copy_from_slice(self.rows.rates_in_time());
        let mut velocities = std::mem::take(&mut self.velocities);
        self.gather_velocities(inputs, &mut velocities);
        self.velocities = velocities;
        for ((row, column), value) in self.rows.structure.jacobian.iter().zip(self.rows.jacobian()) {
            self.row_right[*row] += value * self.velocities[*column];
        }
        Ok(self.rows.worst_of([self.rows.values(), &self.row_right], self.scales.length))
    }

    /// What elements sample at the start of a run.
    ///
    /// # Errors
    /// Equations without a value there.
    pub(super) fn sample_at_start(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let due: Vec<_> = self.clocks.due(t).collect();
        self.begin_partners(t, state)?;
        if due.is_empty() {
            return Ok(());
        }
        let found = self.accept.at(self.formulation.as_mut(), &mut self.observed, t, state)?;
        let discrete = &found[self.counted.len()..];
        for memory in due {
            self.discrete[memory.clone()].copy_from_slice(&discrete[memory]);
        }
        self.tell_discrete();
        // They take what the others have sampled just now.
        self.begin_partners_once(t, state)?;
        self.clocks.set(t, true);
        Ok(())
    }

    /// Memory that changes only between steps: references of angles, discrete states, opaque elements.
    pub(super) fn remember(&mut self, t: f64, state: &[f64]) -> Result<Accepted, AnalysisError> {
        let (mut changed, mut turned) = (Accepted::Unchanged, false);
        let behind = self.clocks.behind(t);
        let communicated = self.communicate(t)?;
        if !self.accept.evaluator.outputs().is_empty() {
            let found = self.accept.at(self.formulation.as_mut(), &mut self.observed, behind, state)?;
            let (angles, discrete) = found.split_at(self.counted.len());
            let mut held = std::mem::take(&mut self.held);
            held.clear();
            held.extend_from_slice(discrete);
            self.clocks.hold(t, &self.discrete, &mut held);
            if let Some(latched) = &self.latched {
                latched.hold(&self.discrete, &mut held);
            }
            self.turning.look(t, angles);
            for (number, angle) in self.counted.iter().zip(angles) {
                let reference = &mut self.references[*number];
                if (angle - *reference).abs() > NEW_REFERENCE {
                    *reference = *angle;
                    turned = true;
                }
            }
            if turned && self.turns_act {
                changed = Accepted::Changed;
            }
            for (at, next) in self.follow_latched(behind, state)? {
                held[at] = next;
            }
            if self.discrete != held {
                self.discrete.copy_from_slice(&held);
                changed = Accepted::Changed;
            }
            self.held = held;
        }
        if communicated {
            self.give_to_partners(t, behind, state)?;
            changed = Accepted::Changed;
        }
        if !self.told.is_empty() {
            let solve = self.told.iter().any(|told| told.inputs.needs_dynamics);
            let inputs = self.formulation.observe(t, state, solve)?.inputs.to_vec();
            for told in &mut self.told {
                let arguments = told.inputs.run(&inputs, self.formulation.sets())?;
                self.formulation.sets_mut()[told.set]
                    .accept(told.instance, arguments)
                    .map_err(|fault| AnalysisError::Element { set: told.set, fault })?;
            }
            changed = Accepted::Changed;
        }
        if turned || changed == Accepted::Changed {
            self.tell_discrete();
        }
        Ok(changed)
    }

    /// Lets references of angles that count turns follow to a state, as an accepted one does.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn follow_angles(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        if self.counted.is_empty() {
            return Ok(());
        }
        self.remember(t, state).map(|_| ())
    }
}
