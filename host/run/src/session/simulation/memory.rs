//! What a simulation is besides the state that is integrated: saved, brought back, carried on, given from outside.

use super::super::checkpoint::Carried;
use super::super::restart::Restart;
use super::super::samplings::Rows;
use super::super::saved::SystemState;
use super::Simulation;
use crate::analysis::{AnalysisError, Group, Scales};
use crate::model::{Instance, Model};
use crate::results::{Audit, AuditRecord};

impl<'a> Simulation<'a> {
    /// Takes over what an earlier stretch of the same run has left, besides the state.
    pub(in crate::session) fn carry_on(&mut self, carried: &Carried) {
        let [length, speed, spin, energy] = carried.scales;
        let own = self.scales;
        self.scales.widen(&Scales { length, way: carried.way, speed, spin, energy, ..own });
        self.state_sizes.carry_on(&carried.state_sizes);
        self.audit = Audit::from(&carried.audit);
        self.contacts_were(&carried.closed, &carried.pressed, &carried.creep);
        self.open_loads_were(&carried.open_loads);
        if let Some(margins) = &mut self.margins {
            margins.carry_on(&carried.margins);
        }
    }

    /// See [`Simulation::carry_on`].
    pub(in crate::session) fn carried(&self) -> Carried {
        let Scales { length, way, speed, spin, energy, .. } = self.scales;
        // The last step may have been cut to end where it had to; the one before it then says more.
        let step = self.last_steps[0].max(self.last_steps[1]);
        Carried {
            scales: [length, speed, spin, energy],
            way,
            state_sizes: self.state_sizes.largest().to_vec(),
            audit: AuditRecord::from(&self.audit),
            step: (step > 0.0).then_some(step),
            steps_tried: 0,
            closed: self.closed_contacts().to_vec(),
            pressed: self.pressed(),
            creep: self.creep(),
            released: self.released(),
            open_loads: self.open_loads().to_vec(),
            margins: self.margins.as_ref().map(|margins| margins.found().to_vec()).unwrap_or_default(),
        }
    }

    /// Everything that its future depends on, at an accepted state.
    ///
    /// # Errors
    /// An opaque element that cannot save its memory.
    pub(in crate::session) fn save(&mut self, t: f64, state: &[f64]) -> Result<SystemState, AnalysisError> {
        let working = self.working_state(t, state)?;
        let mut memories = Vec::new();
        for (set, instance) in self.with_memories() {
            let memory = self.formulation.sets()[set].save(instance);
            memories.push((set, instance, memory.map_err(|fault| AnalysisError::Element { set, fault })?));
        }
        Ok(SystemState {
            working,
            references: self.references.clone(),
            discrete: self.discrete.clone(),
            memories,
            carried: self.carried(),
            watched: self.watched,
            largest_kinetic: self.largest_kinetic,
            samples: self.samples,
            events: self.events,
            last_steps: self.last_steps,
        })
    }

    /// Elements with private memories: their set, their number in it.
    fn with_memories(&self) -> Vec<(usize, usize)> {
        let told = self.told.iter().map(|told| (told.set, told.instance));
        told.chain(self.partners.iter().map(|partner| (partner.set, partner.instance))).collect()
    }

    /// The last accepted time, s.
    pub(in crate::session) fn now(&self) -> f64 {
        self.now
    }

    /// Noise of states is measured again from here on.
    pub(in crate::session) fn measure_states_anew(&mut self) {
        self.floor.forget_states();
    }

    /// Is at a later time, where nothing else has changed.
    pub(in crate::session) fn pass_to(&mut self, t: f64) {
        self.now = t;
    }

    /// Is at another time.
    pub(in crate::session) fn set_now(&mut self, t: f64) {
        self.now = t;
        self.clocks.set(t, true);
    }

    /// Whether something saved has as much of everything.
    pub(in crate::session) fn fits(&self, saved: &SystemState) -> bool {
        let own = |memory: &(usize, usize, Vec<u8>)| (memory.0, memory.1);
        saved.references.len() == self.references.len()
            && saved.discrete.len() == self.discrete.len()
            && saved.carried.state_sizes.len() == self.layout.states
            && saved.working.len() == 13 * self.layout.bodies + self.layout.states + 1
            && saved.memories.iter().map(own).eq(self.with_memories())
    }

    /// Is again what it was when it was saved.
    ///
    /// # Errors
    /// An opaque element that refuses its memory.
    pub(in crate::session) fn restore(&mut self, saved: &SystemState) -> Result<(), AnalysisError> {
        for (set, instance, memory) in &saved.memories {
            let loaded = self.formulation.sets_mut()[*set].load(*instance, memory);
            loaded.map_err(|fault| AnalysisError::Element { set: *set, fault })?;
        }
        let [length, speed, spin, energy] = saved.carried.scales;
        self.scales = Scales { length, way: saved.carried.way, speed, spin, energy, ..self.scales };
        self.state_sizes.carry_on(&saved.carried.state_sizes);
        self.audit = Audit::from(&saved.carried.audit);
        self.contacts_were(&saved.carried.closed, &saved.carried.pressed, &saved.carried.creep);
        self.open_loads_were(&saved.carried.open_loads);
        if let Some(margins) = &mut self.margins {
            margins.carry_on(&saved.carried.margins);
        }
        self.forget_bounds();
        self.meet_anew();
        self.references.copy_from_slice(&saved.references);
        self.discrete.copy_from_slice(&saved.discrete);
        (self.watched, self.largest_kinetic) = (saved.watched, saved.largest_kinetic);
        (self.samples, self.events, self.last_steps) = (saved.samples, saved.events, saved.last_steps);
        self.formulation.forget(&saved.working);
        self.tell_discrete();
        Ok(())
    }

    /// Forgets what was learned on the way, so that what follows depends on time, state and memories alone; to be called between
    /// steps, before others.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn begin_anew(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let working = self.working_state(t, state)?;
        self.formulation.forget(&working);
        self.turning.forget();
        self.tell_discrete();
        self.formulation.next_step(t, state)?;
        self.remedies = self.formulation.counters().remedies();
        Ok(())
    }

    /// Gives a signal from outside another value, SI, at an accepted state. A potential that it changes is work done by whoever
    /// changes it.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn give(
        &mut self,
        input: usize,
        value: f64,
        t: f64,
        state: &mut [f64],
    ) -> Result<(), AnalysisError> {
        let slot = self.layout.given_slot(input);
        let is_stored = self.energy.evaluator.program().uses_inputs(slot..slot + 1);
        let before = if is_stored { self.potential(t, state)? } else { 0.0 };
        self.discrete[self.layout.given_at + input] = value;
        self.tell_discrete();
        if is_stored {
            let change = self.potential(t, state)? - before;
            state.last_mut().into_iter().for_each(|work| *work += change);
        }
        Ok(())
    }

    /// The value of a signal from outside, SI.
    pub(in crate::session) fn given(&self, input: usize) -> f64 {
        self.discrete[self.layout.given_at + input]
    }

    /// The channels at an accepted state, SI, in the order of the model.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn channels(&mut self, t: f64, state: &[f64]) -> Result<&[f64], AnalysisError> {
        self.report.at(self.formulation.as_mut(), &mut self.observed, t, state)?;
        Ok(&self.report.outputs()[..self.channels])
    }

    /// What each entry of the state is.
    pub(in crate::session) fn groups(&self) -> &[Group] {
        self.formulation.groups()
    }

    /// Samples that were taken so far.
    pub(in crate::session) fn samples(&self) -> usize {
        self.samples
    }

    /// The next sample has this number.
    pub(in crate::session) fn count_samples_from(&mut self, number: usize) {
        self.samples = number;
    }

    /// Where its rows go.
    pub(in crate::session) fn rows_taken(&self) -> &Rows<'a> {
        &self.rows_taken
    }

    /// See [`Simulation::rows_taken`].
    pub(in crate::session) fn rows_taken_mut(&mut self) -> &mut Rows<'a> {
        &mut self.rows_taken
    }

    /// The rows that were kept, and the simulation without them.
    pub(in crate::session) fn into_rows(self) -> Rows<'a> {
        self.rows_taken
    }

    /// Potential energy, J.
    pub(super) fn potential(&mut self, t: f64, state: &[f64]) -> Result<f64, AnalysisError> {
        Ok(self.energy.at(self.formulation.as_mut(), &mut self.observed, t, state)?[1])
    }

    /// The formulations hear of references, discrete states and signals from outside.
    pub(super) fn tell_discrete(&mut self) {
        self.formulation.set_discrete(&self.references, &self.discrete);
    }

    /// Everything that changes during a run, as it is at an accepted state.
    ///
    /// # Errors
    /// An opaque element that cannot save its memory.
    pub(in crate::session) fn restart(
        &mut self,
        model: &Model,
        t: f64,
        state: &[f64],
    ) -> Result<Restart, AnalysisError> {
        let mut restart = self.place(model, t, state)?;
        let sets = self.formulation.sets();
        let with_memory = |element: &&Instance| element.class.opaque || sets[element.set].communicates();
        for element in model.elements.iter().filter(with_memory) {
            let memory = self.formulation.sets()[element.set].save(element.index as usize);
            let memory = memory.map_err(|fault| AnalysisError::Element { set: element.set, fault })?;
            if !memory.is_empty() {
                restart.memories.push((element.name.clone(), memory));
            }
        }
        Ok(restart)
    }

    /// The same without private memories.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn place(&mut self, model: &Model, t: f64, state: &[f64]) -> Result<Restart, AnalysisError> {
        let working = self.working_state(t, state)?;
        let mut restart = Restart::new(model, t, working, &self.references, &self.discrete);
        restart.released = self.released().into_iter().map(|k| model.elements[k].name.clone()).collect();
        Ok(restart)
    }

    /// Per body r, p, v, omega'; then element states; then work.
    pub(super) fn working_state(&mut self, t: f64, state: &[f64]) -> Result<Vec<f64>, AnalysisError> {
        let inputs = self.formulation.observe(t, state, false)?.inputs;
        let bodies = (0..self.layout.bodies).flat_map(|body| {
            let slot = self.layout.body_slot(body, 0);
            &inputs[slot..slot + 13]
        });
        let elements_and_work = &state[state.len() - self.layout.states - 1..];
        Ok(bodies.chain(elements_and_work).copied().collect())
    }
}
