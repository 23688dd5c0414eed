//! [`Simulation`]: the equations of motion as the integrators see them, with samples, audit and memory between steps.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::analysis::{
    AnalysisError, Assembly, CONTRADICTION, Constraints, Counters, Evaluator, Formulation, Group, Imbalance, Scales,
    SecondOrderForm, place, velocities_of,
};
use crate::integrate::{Accepted, Failure, Flow, Guards, Instant, Price, SecondOrder, System, Watched};
use crate::interval::Range;
use crate::linalg::LinalgError;
use crate::model::{Model, Thin};
use crate::plan::Layout;
use crate::program::{Equations, MachineError, Node, Sets, Used};
use crate::results::{Audit, AuditRecord};

use super::checkpoint::Carried;
use super::guards::{Guarded, Watching};
use super::restart::Restart;
use super::tier::Tier;

/// An angle that has moved this far from its reference gets a new one, rad.
const NEW_REFERENCE: f64 = 1.0;

/// The error test controls the ends of steps; results interpolated inside are about this much less accurate (seen: 2 to 27
/// times), and it is results that a tolerance is about.
const INTERPOLATION_MARGIN: f64 = 5.0;

/// Angular velocity of a particle, as a share of the scene's, from which a torque must be acting on it.
const PARTICLE_SPIN: f64 = 1e-6;

/// Errors of the interpolation, in tolerances, beyond which a row that does not hold within a step contradicts others.
const MOST_INTERPOLATED: f64 = 100.0;

/// Rows that are named where they are not met.
const MOST_NAMED: usize = 4;

/// Takes the channels at one sample time, in SI. An error ends the run.
pub type Sink<'a> = Box<dyn FnMut(usize, &[f64]) -> Result<(), std::io::Error> + Send + 'a>;
/// Told the time after each accepted step.
pub type Progress<'a> = Box<dyn FnMut(f64) + Send + 'a>;

/// What is known of the part of the work that is turned into heat.
#[derive(Clone, Copy, PartialEq)]
enum Heat {
    /// It is none.
    None,
    /// It is all of the work.
    All,
    /// Its power is looked at in every accepted state.
    Watched,
}

impl Heat {
    fn of(equations: &Equations) -> Self {
        match (equations.dissipation.is_empty(), equations.supplied.is_empty() && !is_driven(equations)) {
            (true, _) => Self::None,
            (false, true) => Self::All,
            (false, false) => Self::Watched,
        }
    }

    /// Kinetic and potential energy, then the powers that are turned into heat, if they are looked at.
    fn energies(self, equations: &Equations) -> Vec<Node> {
        let mut nodes = vec![equations.kinetic, equations.potential];
        if self == Self::Watched {
            nodes.extend(&equations.dissipation);
        }
        nodes
    }
}

/// Whether constraints depend on time and do work.
fn is_driven(equations: &Equations) -> bool {
    equations.rows.iter().any(|row| !equations.graph.is_zero(row.time))
}

/// A program, and whether accelerations or multipliers must be known for it.
struct Part {
    evaluator: Evaluator,
    needs_dynamics: bool,
    /// Whether it takes the inputs of the formulation, not those of the working form.
    own: bool,
    /// How well the accelerations and multipliers that it took last meet the equations of motion.
    imbalance: Imbalance,
}

impl Part {
    fn new(equations: &Equations, nodes: &[Node], layout: &Layout) -> Self {
        let evaluator = Evaluator::new(&equations.graph, nodes);
        let needs_dynamics = evaluator.program().uses_inputs(layout.acceleration_slot()..layout.inputs());
        Self { evaluator, needs_dynamics, own: false, imbalance: Imbalance::default() }
    }

    /// In the coordinates of the formulation, where that can be.
    fn near(formulation: &dyn Formulation, equations: &Equations, nodes: &[Node], layout: &Layout) -> Self {
        match formulation.own_program(equations, nodes) {
            Some(evaluator) => Self { evaluator, needs_dynamics: false, own: true, imbalance: Imbalance::default() },
            None => Self::new(equations, nodes, layout),
        }
    }

    fn used(&mut self) -> Used<'_> {
        self.evaluator.used(false)
    }

    fn run(&mut self, inputs: &[f64], sets: &[Box<dyn element_api::ElementSet>]) -> Result<&[f64], AnalysisError> {
        self.evaluator.run(inputs, sets)
    }

    /// Its results at a state; `inputs` is room for those of the working form.
    fn at(
        &mut self,
        formulation: &mut dyn Formulation,
        inputs: &mut Vec<f64>,
        t: f64,
        state: &[f64],
    ) -> Result<&[f64], AnalysisError> {
        if self.needs_dynamics || !self.own {
            inputs.clear();
            let observed = formulation.observe(t, state, self.needs_dynamics)?;
            inputs.extend_from_slice(observed.inputs);
            self.imbalance = observed.imbalance;
        }
        if self.own {
            return formulation.run_own(t, state, &mut self.evaluator);
        }
        self.evaluator.run(inputs, formulation.sets())
    }
}

/// An opaque instance that is told about accepted steps.
struct Told {
    set: usize,
    instance: usize,
    inputs: Part,
}

/// See the module documentation.
pub struct Simulation<'a> {
    formulation: Box<dyn Formulation>,
    layout: Layout,
    tolerance: f64,
    scales: Scales,
    /// Largest magnitude of each element state so far.
    state_sizes: Vec<f64>,
    references: Vec<f64>,
    discrete: Vec<f64>,
    accept: Part,
    told: Vec<Told>,
    report: Part,
    energy: Part,
    heat: Heat,
    /// Conditions at which the equations switch, where steps are to end there.
    switches: Option<Part>,
    /// What is watched throughout every step.
    guarded: Option<Guarded>,
    /// The same at a state, where ranges cannot be had: switches and functions, and turns.
    looks: [Option<Part>; 2],
    /// The same motion with constraints on positions, for methods that ask for it.
    second_order: Option<SecondOrderForm>,
    rows: Constraints,
    /// Whether some of them depend on time: then those left out may contradict the others for a moment.
    is_driven: bool,
    /// Joint and row of each of the rows of the scene.
    row_names: Vec<String>,
    audit: Audit,
    /// Accepted states so far.
    watched: u64,
    /// States refused because rows that were left out do not hold there.
    contradictions: u64,
    /// Violations are looked at in one of so many.
    period: u64,
    /// Number of quantities that are reported; `report` has the energies behind them, to audit samples. Not where constraints
    /// are driven: error control does not see how their work grows, and between the ends of steps it is not known well enough.
    channels: usize,
    /// Bodies without rotation.
    particles: Vec<(usize, String)>,
    /// Axes of bodies about which nothing may turn them.
    thin: Vec<(usize, String, Thin)>,
    /// Largest kinetic energy so far, J.
    largest_kinetic: f64,
    sample_state: Vec<f64>,
    /// Room for the inputs of the working form at a state.
    observed: Vec<f64>,
    samples: usize,
    sink: Sink<'a>,
    progress: Progress<'a>,
    stop: Arc<AtomicBool>,
    row_right: Vec<f64>,
    tier: Tier,
    /// Sizes of the last two steps, s.
    last_steps: [f64; 2],
}

impl<'a> Simulation<'a> {
    /// Prepares samples, audit and memory around a formulation. `channels` are the requested quantities.
    ///
    /// # Errors
    /// When the linear algebra refuses the model.
    #[expect(clippy::too_many_arguments, reason = "called once, where everything is at hand")]
    pub fn new(
        equations: &mut Equations,
        model: &Model,
        layout: &Layout,
        assembly: &Assembly,
        formulation: Box<dyn Formulation>,
        tolerance: f64,
        sink: Sink<'a>,
        progress: Progress<'a>,
        stop: Arc<AtomicBool>,
    ) -> Result<Self, AnalysisError> {
        let mut nodes: Vec<Node> =
            model.channels.iter().map(|channel| equations.observe(&channel.quantity, model, layout)).collect();
        let is_driven = is_driven(equations);
        if !is_driven {
            nodes.extend([equations.kinetic, equations.potential]);
        }
        let report = Part::near(formulation.as_ref(), equations, &nodes, layout);
        let mut after: Vec<Node> = equations.angles.clone();
        after.extend(&equations.next_discrete);
        let told = equations.graph.calls.clone();
        let told = told
            .into_iter()
            .map(|call| Told {
                set: call.set,
                instance: call.instance as usize,
                inputs: Part::new(equations, &call.arguments, layout),
            })
            .collect();
        let all: Vec<usize> = (0..layout.rows).collect();
        let rows = Constraints::new(equations, model, &all, &[|row| row.value, |row| row.time], &[])?;
        let heat = Heat::of(equations);
        let mut simulation = Self {
            accept: Part::near(formulation.as_ref(), equations, &after, layout),
            energy: Part::new(equations, &heat.energies(equations), layout),
            heat,
            switches: None,
            guarded: None,
            looks: [None, None],
            second_order: None,
            report,
            told,
            is_driven,
            rows,
            row_names: all
                .iter()
                .map(|row| layout.element_of_row(*row))
                .map(|(e, k)| model.elements[e].row_name(k))
                .collect(),
            period: formulation.states_per_audit(),
            channels: model.channels.len(),
            formulation,
            tolerance,
            scales: assembly.scales,
            state_sizes: vec![0.0; layout.states],
            references: assembly.references.clone(),
            discrete: assembly.discrete.clone(),
            audit: Audit::default(),
            watched: 0,
            contradictions: 0,
            particles: particles(model),
            thin: thin(model),
            largest_kinetic: 0.0,
            sample_state: Vec::new(),
            observed: Vec::with_capacity(layout.inputs()),
            samples: 0,
            sink,
            progress,
            stop,
            row_right: vec![0.0; layout.rows],
            tier: Tier::fixed(),
            last_steps: [0.0; 2],
            layout: layout.clone(),
        };
        simulation.formulation.set_discrete(&assembly.references, &assembly.discrete);
        Ok(simulation)
    }

    /// The state at the start; takes the sizes of first accelerations. [`Simulation::watch`] follows.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub fn start(&mut self, t: f64, assembly: &Assembly) -> Result<Vec<f64>, AnalysisError> {
        let mut state = vec![0.0; self.formulation.groups().len()];
        self.formulation.state_of(&assembly.working, &mut state);
        self.sample_state = state.clone();
        let slot = self.layout.acceleration_slot();
        let inputs = self.formulation.observe(t, &state, true)?.inputs;
        let accelerations = inputs[slot..slot + self.layout.velocities()].to_vec();
        self.scales.anticipate(&accelerations);
        self.formulation.next_step(t, &state)?;
        Ok(state)
    }

    /// Sizes typical of what moves here, so far.
    pub(super) fn scales(&self) -> &Scales {
        &self.scales
    }

    /// Takes speeds that move nothing in this time, s, for round-off, and so their energies, of a body of this mass, kg.
    pub(super) fn anticipate_rest(&mut self, duration: f64, lightest: f64) {
        self.scales.anticipate_rest(duration);
        self.audit.count_from(0.5 * lightest * self.scales.rest_speed(duration).powi(2));
    }

    /// Judges errors and violations by the sizes of a larger scene.
    pub(super) fn widen_scales(&mut self, whole: &Scales) {
        self.scales.widen(whole);
    }

    /// Takes over what an earlier stretch of the same run has left, besides the state.
    pub(super) fn carry_on(&mut self, carried: &Carried) {
        let [length, speed, spin, energy] = carried.scales;
        self.scales.widen(&Scales { length, speed, spin, energy });
        self.state_sizes.copy_from_slice(&carried.state_sizes);
        self.audit = Audit::from(&carried.audit);
    }

    /// See [`Simulation::carry_on`].
    pub(super) fn carried(&self) -> Carried {
        let Scales { length, speed, spin, energy } = self.scales;
        // The last step may have been cut to end where it had to; the one before it then tells more.
        let step = self.last_steps[0].max(self.last_steps[1]);
        Carried {
            scales: [length, speed, spin, energy],
            state_sizes: self.state_sizes.clone(),
            audit: AuditRecord::from(&self.audit),
            step: (step > 0.0).then_some(step),
            steps_tried: 0,
        }
    }

    /// Watches the rows and energies of other equations of the same motion instead: those that were pruned.
    ///
    /// # Errors
    /// When the patterns are inconsistent, which would be a defect of the equations.
    pub fn watch_these(&mut self, equations: &Equations, model: &Model, rows: &[usize]) -> Result<(), AnalysisError> {
        self.rows = Constraints::new(equations, model, rows, &[|row| row.value, |row| row.time], &[])?;
        self.row_right = vec![0.0; rows.len()];
        self.energy = Part::new(equations, &self.heat.energies(equations), &self.layout);
        Ok(())
    }

    /// Offers functions that change their sign where steps had better end.
    pub fn end_steps_at(&mut self, equations: &Equations, conditions: &[Node]) {
        if !conditions.is_empty() {
            self.switches = Some(Part::near(self.formulation.as_ref(), equations, conditions, &self.layout));
        }
    }

    /// Watches what may happen within a step. Gives whether there is something that cannot be watched: what only an opaque element
    /// knows, or what depends on the solution of the equations of motion.
    pub(super) fn guard(&mut self, equations: &mut Equations, watching: &Watching) -> bool {
        let guarded = watching.guard(equations, &self.layout, self.formulation.as_ref());
        let bounded = guarded.is_partial || !equations.graph.calls.is_empty();
        let sets = [(&guarded.guards.within, &guarded.within), (&guarded.guards.turns, &guarded.turns)];
        for (look, (set, bank)) in self.looks.iter_mut().zip(sets) {
            if !set.proved && !bank.nodes.is_empty() {
                *look = Some(Part::near(self.formulation.as_ref(), equations, &bank.nodes, &self.layout));
            }
        }
        self.guarded = Some(guarded);
        bounded
    }

    /// The rows that may come to contradict others for a moment, since they or others are driven and some are left out, each with
    /// how far it may be off.
    ///
    /// # Errors
    /// Equations without a value at the start.
    pub(super) fn rows_to_bound(
        &mut self,
        equations: &Equations,
        t: f64,
        state: &[f64],
    ) -> Result<Vec<(Node, f64)>, AnalysisError> {
        if !self.is_driven || !self.formulation.leaves_rows_out() {
            return Ok(Vec::new());
        }
        let inputs = self.formulation.observe(t, state, false)?.inputs.to_vec();
        self.rows.evaluate(&inputs, self.formulation.sets())?;
        let length = self.scales.length;
        let share = CONTRADICTION.max(MOST_INTERPOLATED * self.tolerance);
        let mut rows = Vec::new();
        // By how many metres a row is off where its value is 1.
        self.rows.violations(&vec![1.0; self.rows.rows.len()], length, |row, metres| {
            let node = equations.rows[row].value;
            if !equations.graph.is_zero(equations.rows[row].time) && metres > 0.0 {
                rows.push((node, share * length / metres));
            }
        });
        Ok(rows)
    }

    /// Offers the equations to methods of second order.
    pub fn offer_second_order(&mut self, mut form: SecondOrderForm) {
        form.set_discrete(&self.references, &self.discrete);
        self.second_order = Some(form);
    }

    /// Solves for accelerations and reactions at every sample, asked for or not.
    pub fn solve_at_samples(&mut self) {
        self.report.needs_dynamics = true;
    }

    /// Looks at the violation of all rows in every accepted state.
    pub fn watch_every_state(&mut self) {
        self.period = 1;
    }

    /// Lets programs be compiled during the run.
    pub fn set_tier(&mut self, tier: Tier) {
        self.tier = tier;
    }

    /// Compiles the programs now, for a run from time `t`.
    ///
    /// # Errors
    /// [`MachineError`] when there is no machine code to be had.
    pub fn compile_now(&mut self, t: f64) -> Result<(), MachineError> {
        let mut tier = std::mem::take(&mut self.tier);
        let result = tier.compile_now(t, self.programs());
        self.tier = tier;
        result
    }

    /// The compiling of programs.
    #[must_use]
    pub fn tier(&self) -> &Tier {
        &self.tier
    }

    /// Everything that is run again and again.
    fn programs(&mut self) -> Vec<Used<'_>> {
        let mut list = self.formulation.programs();
        list.extend([self.rows.used(false), self.energy.used(), self.report.used(), self.accept.used()]);
        list.extend(self.told.iter_mut().map(|told| told.inputs.used()));
        list.extend(
            self.switches.iter_mut().chain(self.looks.iter_mut().flatten()).map(|part| part.evaluator.used(true)),
        );
        list.extend(self.second_order.iter_mut().flat_map(SecondOrderForm::programs));
        list
    }

    /// The audit so far.
    #[must_use]
    pub fn audit(&self) -> &Audit {
        &self.audit
    }

    /// Work done so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        let mut counters = self.formulation.counters();
        let (evaluations, factorisations) = self.second_order.as_ref().map_or((0, 0), SecondOrderForm::work);
        counters.evaluations += evaluations;
        counters.factorisations += factorisations;
        counters.contradictions = self.contradictions;
        counters
    }

    /// Everything that changes during a run, as it is at an accepted state.
    ///
    /// # Errors
    /// An opaque element that cannot save its memory.
    pub fn restart(&mut self, model: &Model, t: f64, state: &[f64]) -> Result<Restart, AnalysisError> {
        let inputs = self.formulation.observe(t, state, false)?.inputs;
        let bodies = (0..self.layout.bodies).flat_map(|body| {
            let slot = self.layout.body_slot(body, 0);
            &inputs[slot..slot + 13]
        });
        let elements_and_work = &state[state.len() - self.layout.states - 1..];
        let working = bodies.chain(elements_and_work).copied().collect();
        let mut restart = Restart::new(model, t, working, &self.references, &self.discrete);
        for element in model.elements.iter().filter(|element| element.class.opaque) {
            let memory = self.formulation.sets()[element.set].save(element.index as usize);
            let memory = memory.map_err(|fault| AnalysisError::Element { set: element.set, fault })?;
            if !memory.is_empty() {
                restart.memories.push((element.name.clone(), memory));
            }
        }
        Ok(restart)
    }

    /// The inputs of programs in the working form, accelerations and multipliers left as they are.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(super) fn working_inputs(&mut self, t: f64, state: &[f64]) -> Result<Vec<f64>, AnalysisError> {
        Ok(self.formulation.observe(t, state, false)?.inputs.to_vec())
    }

    /// The formulation, for its name.
    #[must_use]
    pub fn formulation(&self) -> &dyn Formulation {
        self.formulation.as_ref()
    }

    /// Operations per evaluation of the requested channels.
    #[must_use]
    pub fn report_operations(&self) -> usize {
        self.report.evaluator.program().operations()
    }

    /// Violations at the last accepted state, unless they are known: to be called at the end of the run.
    pub fn watch_end(&mut self, t: f64, state: &[f64]) {
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
    pub fn watch(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        // Copied, since the formulation lends both its inputs and its element sets.
        let mut inputs = std::mem::take(&mut self.observed);
        inputs.clear();
        inputs.extend_from_slice(self.formulation.observe(t, state, self.energy.needs_dynamics)?.inputs);
        let result = self.watch_inputs(&inputs, state);
        self.observed = inputs;
        result
    }

    fn watch_inputs(&mut self, inputs: &[f64], state: &[f64]) -> Result<(), AnalysisError> {
        let sets = self.formulation.sets();
        let energies = self.energy.run(inputs, sets)?;
        let (kinetic, potential) = (energies[0], energies[1]);
        let heat: f64 = energies[2..].iter().sum();
        for body in 0..self.layout.bodies {
            let slot = self.layout.body_slot(body, 0);
            self.scales.grow(&inputs[slot..slot + 13], 1);
        }
        for (body, name) in &self.particles {
            let slot = self.layout.body_slot(*body, 10);
            let spin = inputs[slot..slot + 3].iter().fold(0.0_f64, |most, w| most.max(w.abs()));
            if spin > PARTICLE_SPIN * self.scales.spin_scale() {
                return Err(AnalysisError::TorqueOnParticle { body: name.clone() });
            }
        }
        self.largest_kinetic = self.largest_kinetic.max(kinetic);
        for (body, name, thin) in &self.thin {
            let slot = self.layout.body_slot(*body, 10);
            let about: f64 = (0..3).map(|k| inputs[slot + k] * thin.axis[k]).sum();
            if 0.5 * thin.moment * about * about > thin.share * self.largest_kinetic {
                return Err(AnalysisError::TorqueOnThin { body: name.clone() });
            }
        }
        let work = state.last().copied().unwrap_or(0.0);
        self.audit.energy(inputs[Layout::TIME], kinetic, potential, work);
        match self.heat {
            Heat::Watched => self.audit.heating(inputs[Layout::TIME], heat),
            known => self.audit.heat_is_all(known == Heat::All),
        }
        let number = self.watched;
        self.watched += 1;
        if number.is_multiple_of(self.period) { self.watch_rows(inputs) } else { Ok(()) }
    }

    /// Fails where rows that projection leaves to themselves do not hold any more.
    fn check_rows_left_out(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let inputs = self.formulation.observe(t, state, false)?.inputs;
        self.observed.clear();
        self.observed.extend_from_slice(inputs);
        self.rows.evaluate(&self.observed, self.formulation.sets())?;
        let length = self.scales.length;
        let (worst, _) = self.rows.worst(self.rows.function(0), length);
        if worst <= CONTRADICTION * length {
            return Ok(());
        }
        let mut off: Vec<&str> = Vec::new();
        self.rows.violations(self.rows.function(0), length, |row, violation| {
            if violation.is_nan() || violation > 0.1 * worst {
                off.push(&self.row_names[row]);
            }
        });
        off.truncate(MOST_NAMED);
        self.contradictions += 1;
        Err(AnalysisError::Contradiction { what: off.join(", "), violation: worst / length })
    }

    /// Violations of all rows.
    fn watch_rows(&mut self, inputs: &[f64]) -> Result<(), AnalysisError> {
        self.rows.evaluate(inputs, self.formulation.sets())?;
        let (position, row) = self.rows.worst(self.rows.function(0), self.scales.length);
        self.row_right.copy_from_slice(self.rows.function(1));
        for ((row, column), value) in self.rows.structure.jacobian.iter().zip(self.rows.jacobian()) {
            self.row_right[*row] += value * inputs[self.layout.body_slot(column / 6, 7 + column % 6)];
        }
        let (velocity, rate) = self.rows.worst(&self.row_right, self.scales.length);
        let (length, speed) = (self.scales.length, self.scales.speed_scale());
        self.audit.violation(inputs[Layout::TIME], (position / length, row), (velocity / speed, rate));
        Ok(())
    }

    /// Memory that changes only between steps: references of angles, discrete states, opaque elements.
    fn remember(&mut self, t: f64, state: &[f64]) -> Result<Accepted, AnalysisError> {
        let mut changed = Accepted::Unchanged;
        if !self.accept.evaluator.outputs().is_empty() {
            let found = self.accept.at(self.formulation.as_mut(), &mut self.observed, t, state)?;
            let (angles, discrete) = found.split_at(self.references.len());
            for (reference, angle) in self.references.iter_mut().zip(angles) {
                if (angle - *reference).abs() > NEW_REFERENCE {
                    *reference = *angle;
                    changed = Accepted::Changed;
                }
            }
            if self.discrete != discrete {
                self.discrete.copy_from_slice(discrete);
                changed = Accepted::Changed;
            }
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
        if changed == Accepted::Changed {
            self.formulation.set_discrete(&self.references, &self.discrete);
            if let Some(form) = &mut self.second_order {
                form.set_discrete(&self.references, &self.discrete);
            }
        }
        Ok(changed)
    }

    fn second_order_parts(&mut self) -> Result<(&mut SecondOrderForm, &Sets), Failure> {
        let form = self.second_order.as_mut().ok_or_else(|| Failure::Fatal("no equations of second order".into()))?;
        Ok((form, self.formulation.sets()))
    }

    /// The largest entry of a difference of states, as a share of the size of its group.
    fn largest_share(&mut self, y0: &[f64], y1: &[f64], error: &[f64]) -> f64 {
        let (length, speed, spin) = (self.scales.length, self.scales.speed_scale(), self.scales.spin_scale());
        let states_at = y0.len() - self.state_sizes.len() - 1;
        let mut worst = 0.0_f64;
        for (k, group) in self.formulation.groups().iter().enumerate() {
            let size = match group {
                Group::Position => length,
                Group::Parameter => 1.0,
                Group::Velocity => speed,
                Group::AngularVelocity => spin,
                Group::State => {
                    let size = &mut self.state_sizes[k - states_at];
                    *size = size.max(y0[k].abs()).max(y1[k].abs());
                    if *size > 0.0 { *size } else { 1.0 }
                }
                Group::Work => continue,
            };
            let share = error[k].abs() / size;
            if share.is_nan() || share > worst {
                worst = share;
            }
        }
        worst
    }

    /// The largest angular velocity in a state, rad/s.
    fn fastest(&self, y: &[f64]) -> f64 {
        let speeds = self.formulation.groups().iter().zip(y).filter(|(group, _)| **group == Group::AngularVelocity);
        speeds.fold(0.0, |most, (_, speed)| most.max(speed.abs()))
    }

    fn take_sample(&mut self, t: f64, y: &[f64]) -> Result<(), Failure> {
        let mut state = std::mem::take(&mut self.sample_state);
        state.copy_from_slice(y);
        let result = self.sample_at(t, &mut state);
        self.sample_state = state;
        result
    }

    fn sample_at(&mut self, t: f64, state: &mut [f64]) -> Result<(), Failure> {
        // Interpolated states are off the constraints by the interpolation error, which reactions would amplify.
        self.formulation.project(t, state).map_err(failure)?;
        if self.is_driven && self.formulation.leaves_rows_out() {
            self.check_rows_left_out(t, state).map_err(failure)?;
        }
        self.report.at(self.formulation.as_mut(), &mut self.observed, t, state).map_err(failure)?;
        let Imbalance { share, body } = self.report.imbalance;
        self.audit.imbalance(t, share, body);
        let number = self.samples;
        self.samples += 1;
        let (values, energies) = self.report.evaluator.outputs().split_at(self.channels);
        if let [kinetic, potential] = *energies {
            self.audit.sample_energy(t, kinetic, potential, state.last().copied().unwrap_or(0.0));
        }
        (self.sink)(number, values).map_err(|error| Failure::Fatal(Box::new(error)))
    }
}

fn particles(model: &Model) -> Vec<(usize, String)> {
    let bodies = model.bodies.iter().enumerate();
    bodies.filter(|(_, body)| body.particle).map(|(index, body)| (index, body.name.clone())).collect()
}

fn thin(model: &Model) -> Vec<(usize, String, Thin)> {
    let bodies = model.bodies.iter().enumerate();
    bodies.flat_map(|(index, body)| body.thin.iter().map(move |thin| (index, body.name.clone(), *thin))).collect()
}

/// A smaller step may help against bad numbers, never against a broken element.
fn failure(error: AnalysisError) -> Failure {
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

impl System for Simulation<'_> {
    fn dim(&self) -> usize {
        self.formulation.groups().len()
    }

    fn rhs(&mut self, t: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        self.formulation.rates(t, y, dy).map_err(failure)
    }

    fn error_norm(&mut self, y0: &[f64], y1: &[f64], error: &[f64]) -> f64 {
        self.largest_share(y0, y1, error) / (self.tolerance / INTERPOLATION_MARGIN)
    }

    fn size(&mut self, y: &[f64], difference: &[f64]) -> f64 {
        self.largest_share(y, y, difference)
    }

    fn jacobian(&mut self, t: f64, y: &[f64], matrix: &mut [f64]) -> Result<bool, Failure> {
        self.formulation.jacobian(t, y, matrix).map_err(failure)
    }

    fn time_derivative(&mut self, t: f64, _: &[f64], slopes: &mut [f64]) -> Result<bool, Failure> {
        Ok(self.formulation.time_derivative(t, slopes))
    }

    fn price(&self) -> Price {
        let price = self.formulation.price();
        Price { evaluation: price.rates, jacobian: price.jacobian, preparation: price.preparation }
    }

    fn tolerance(&self) -> Option<f64> {
        Some(self.tolerance / INTERPOLATION_MARGIN)
    }

    fn project(&mut self, t: f64, y: &mut [f64]) -> Result<(), Failure> {
        self.formulation.project(t, y).map_err(failure)?;
        if self.formulation.leaves_rows_out() {
            self.check_rows_left_out(t, y).map_err(failure)?;
        }
        self.formulation.next_step(t, y).map_err(failure)
    }

    fn sums_from(&self) -> usize {
        self.dim() - 1
    }

    fn second_order(&mut self) -> Option<&mut dyn SecondOrder> {
        if self.second_order.is_some() { Some(self) } else { None }
    }

    fn conditions(&self) -> usize {
        self.switches.as_ref().map_or(0, |part| part.evaluator.outputs().len())
    }

    fn switching(&mut self, t: f64, y: &[f64], values: &mut [f64]) -> Result<(), Failure> {
        let Some(part) = &mut self.switches else { return Ok(()) };
        values.copy_from_slice(part.at(self.formulation.as_mut(), &mut self.observed, t, y).map_err(failure)?);
        Ok(())
    }

    fn guards(&self) -> Guards {
        self.guarded.as_ref().map_or_else(Guards::default, |guarded| guarded.guards.clone())
    }

    fn enclose(&mut self, of: Watched, t: Range, entry: &dyn Fn(usize) -> Range, found: &mut [Range]) {
        let Some(guarded) = &mut self.guarded else { return };
        guarded.bank(of).enclose(t, entry, [&self.references, &self.discrete], found);
    }

    fn values(&mut self, of: Watched, t: f64, entry: &dyn Fn(usize) -> f64, found: &mut [f64]) {
        let Some(guarded) = &mut self.guarded else { return };
        guarded.bank(of).values(t, entry, [&self.references, &self.discrete], found);
    }

    fn resolution(&self, entry: usize) -> f64 {
        let size = match self.formulation.groups()[entry] {
            Group::Position => self.scales.length,
            Group::Parameter => 1.0,
            Group::Velocity => self.scales.speed_scale(),
            Group::AngularVelocity => self.scales.spin_scale(),
            Group::State => self.state_sizes[entry + 1 + self.state_sizes.len() - self.dim()],
            Group::Work => self.largest_kinetic,
        };
        self.tolerance * size
    }

    fn turning(&self, y: &[f64]) -> f64 {
        self.formulation.turns_added() * self.fastest(y)
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

    fn max_step_hint(&self, _: f64, y: &[f64]) -> f64 {
        if self.references.is_empty() {
            return f64::INFINITY;
        }
        // Angles must stay within half a turn of their references: at most 1 rad is used up, and two bodies may turn
        // against each other. This looks at the speed at the start only; the step is judged when it is made.
        let fastest = self.fastest(y);
        if fastest > 0.0 { 1.0 / fastest } else { f64::INFINITY }
    }

    fn sample(&mut self, t: f64, y: &[f64]) -> Result<(), Failure> {
        self.take_sample(t, y)
    }

    fn accept(&mut self, t: f64, y: &mut [f64]) -> Result<Accepted, Failure> {
        self.watch(t, y).map_err(failure)?;
        self.remember(t, y).map_err(failure)
    }

    fn step_done(&mut self, t: f64, _: &[f64], h: f64) -> Flow {
        self.last_steps = [self.last_steps[1], h];
        (self.progress)(t);
        let mut tier = std::mem::take(&mut self.tier);
        tier.between_steps(t, || self.programs());
        self.tier = tier;
        if self.stop.load(Ordering::Relaxed) { Flow::Stop } else { Flow::Continue }
    }
}

/// Where the equations were offered ([`Simulation::offer_second_order`]).
impl SecondOrder for Simulation<'_> {
    fn velocities(&self) -> usize {
        self.layout.velocities()
    }

    fn multipliers(&self) -> usize {
        self.second_order.as_ref().map_or(0, |form| form.rows_in_use().len())
    }

    fn sums_from(&self) -> usize {
        self.dim() - 1
    }

    fn velocities_of(&self, y: &[f64], velocities: &mut [f64]) {
        velocities_of(y, velocities);
    }

    fn place(&self, y0: &[f64], increment: &[f64], velocities: &[f64], y: &mut [f64]) {
        place(y0, increment, velocities, y);
    }

    fn residual(
        &mut self,
        at: &Instant<'_>,
        forces: &mut [f64],
        rows: &mut [f64],
        dy: &mut [f64],
    ) -> Result<(), Failure> {
        let (form, sets) = self.second_order_parts()?;
        let solution = (at.accelerations, at.multipliers);
        form.residual((at.t, at.y), solution, sets, (forces, rows), dy).map_err(failure)
    }

    fn factor(&mut self, mass_share: f64, damping_share: f64) -> Result<(), Failure> {
        let (form, sets) = self.second_order_parts()?;
        form.factor(mass_share, damping_share, sets).map_err(failure)
    }

    fn solve(&mut self, forces: &[f64], rows: &[f64], moves: &mut [f64], changes: &mut [f64]) -> Result<(), Failure> {
        let (form, _) = self.second_order_parts()?;
        form.solve((forces, rows), (moves, changes)).map_err(failure)
    }
}
