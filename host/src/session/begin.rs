//! [`Begun`]: a run that lacks nothing but its steps.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::checkpoint::Carried;
use super::error::SessionError;
use super::guards::Watching;
use super::open::Session;
use super::restart::Restart;
use super::run::{DEFAULT_METHOD, start_error, tolerance};
use super::simulation::{Progress, Simulation, Sink};
use super::tier::{Made, Tier};
use crate::analysis::{AnalysisError, Counters, Formulation, Scales, SecondOrderForm};
use crate::integrate::{self, IntegrateError, Integrator, Kinematic, Options, Outcome, Span, StopReason};
use crate::model::Model;
use crate::results::Audit;

/// What a run is made with.
pub(super) struct Means {
    engine: String,
    method: Box<dyn Integrator>,
    formulation: Box<dyn Formulation>,
    second_order: Option<SecondOrderForm>,
    fixed_step: Option<f64>,
}

impl Means {
    /// Name of the method.
    pub(super) fn method(&self) -> &'static str {
        self.method.name()
    }

    /// Name of the formulation.
    pub(super) fn formulation(&self) -> &'static str {
        self.formulation.name()
    }
}

/// A run before its first step.
pub(super) struct Begun<'a> {
    system: Simulation<'a>,
    method: Box<dyn Integrator>,
    state: Vec<f64>,
    options: Options,
    t_start: f64,
    t_end: f64,
    sample_times: Vec<f64>,
}

/// What an integration leaves behind.
pub(super) struct Ended {
    pub(super) outcome: Result<Outcome, IntegrateError>,
    pub(super) audit: Audit,
    pub(super) counters: Counters,
    pub(super) made: Made,
    /// With its samples, s.
    pub(super) integration_time: f64,
    /// Time of the last accepted state, s; where an error ended the run, the end asked for.
    time: f64,
    /// Where something was not finite: the inputs of the working form at the last accepted state, and behind it by the step tried
    /// last.
    pub(super) not_finite: Vec<Vec<f64>>,
}

impl Session {
    /// Relative tolerance.
    pub(super) fn tolerance(&self) -> f64 {
        tolerance(&self.scene)
    }

    /// The engine's name.
    fn engine(&self) -> &str {
        self.scene.simulation.engine.as_ref().map_or("auto", |engine| engine.value.as_str())
    }

    /// The method and the equations in the form that it wants.
    ///
    /// # Errors
    /// An unknown method, engine or formulation; a method without a step size; masses that admit no motion.
    pub(super) fn means(&mut self) -> Result<Means, SessionError> {
        let name = self.scene.simulation.method.as_ref().map_or(DEFAULT_METHOD, |m| m.value.as_str());
        let mut method = self.options.methods.make(name).ok_or_else(|| self.unknown_word(name, true))?;
        if self.determined {
            method = Box::new(Kinematic::default());
        }
        // A method without error control takes the longest step it may.
        let longest = self.scene.simulation.max_step.filter(|_| method.needs_fixed_step());
        let fixed_step = self.scene.simulation.fixed_step.or(longest);
        if method.needs_fixed_step() && fixed_step.is_none() {
            return Err(self.no_step(method.name()));
        }
        let engine = self.engine().to_string();
        let mut formulation = self.formulation(&engine)?;
        if method.may_use_jacobian() {
            formulation.offer_jacobian(self.merged.as_ref().map_or(&self.equations, |case| &case.equations));
        }
        let second_order = match self.method_of_second_order()? {
            Some(_) => Some(SecondOrderForm::new(&self.equations, &self.model, &self.plan)),
            None => None,
        };
        let second_order = second_order.transpose().map_err(|e| start_error(&self.scene, &e))?;
        Ok(Means { engine, method, formulation, second_order, fixed_step })
    }

    /// Places the system at its start. `sink` takes samples, `told` the times of accepted steps.
    ///
    /// # Errors
    /// Where the motion cannot start, or machine code is asked for and cannot be had.
    pub(super) fn begin<'a>(
        &mut self,
        means: Means,
        sink: Sink<'a>,
        told: Progress<'a>,
        stop: &Arc<AtomicBool>,
    ) -> Result<Begun<'a>, SessionError> {
        let Means { engine, method, formulation, second_order, fixed_step } = means;
        let tolerance = self.tolerance();
        let simulation = &self.scene.simulation;
        let (t_start, t_end) = (simulation.t_start, simulation.t_end);
        let layout = self.plan.layout.clone();
        let mut system = Simulation::new(
            &mut self.equations,
            &self.model,
            &layout,
            &self.assembly,
            formulation,
            tolerance,
            sink,
            told,
            Arc::clone(stop),
        )
        .map_err(|e| start_error(&self.scene, &e))?;
        // Merged bodies are watched as the scene has them.
        if let Some(case) = self.planar.as_ref().filter(|_| engine != "reference" && self.merged.is_none()) {
            system
                .watch_these(&case.planar.equations, &self.model, &case.planar.rows)
                .map_err(|e| start_error(&self.scene, &e))?;
        }
        let mut watching = Watching::find(&mut self.equations, &layout);
        if self.pruning.events && fixed_step.is_none() {
            system.end_steps_at(&self.equations, watching.conditions());
        }
        if let Some(form) = second_order {
            system.offer_second_order(form);
        }
        if !self.pruning.on_demand {
            system.solve_at_samples();
        }
        if !self.pruning.audit {
            system.watch_every_state();
        }
        let state = system.start(t_start, &self.assembly).map_err(|e| start_error(&self.scene, &e))?;
        watching.rows =
            system.rows_to_bound(&self.equations, t_start, &state).map_err(|e| start_error(&self.scene, &e))?;
        let bounded = system.guard(&mut self.equations, &watching);
        self.equations.graph.rest();
        let lightest = self.model.bodies.iter().map(|body| body.mass).reduce(f64::min).unwrap_or(0.0);
        system.anticipate_rest(t_end - t_start, lightest);
        let carried = self.stretch.as_ref().and_then(|stretch| stretch.carried.as_ref());
        if let Some(carried) = carried {
            system.carry_on(carried);
        }
        match engine.as_str() {
            "auto" => system.set_tier(Tier::automatic(t_start, t_end)),
            "compiled" => {
                // What stands in for something else waits until it turns out to be run often.
                system.set_tier(Tier::automatic(t_start, t_end));
                system.compile_now(t_start).map_err(|e| self.no_machine_code(&e))?;
            }
            _ => {}
        }
        let sample_times = match &self.stretch {
            Some(stretch) => stretch.sample_times.clone(),
            None => simulation.sample_times(&self.scene.units).iter().map(|time| time.si).collect(),
        };
        // What cannot be enclosed is at least looked at as often as the user looks.
        let between = sample_times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let longest = Some(between).filter(|longest| bounded && *longest > 0.0);
        let options = Options {
            first_step: carried.map_or(simulation.first_step, |carried| carried.step),
            max_step: [simulation.max_step, longest].into_iter().flatten().reduce(f64::min),
            max_steps: simulation.max_steps.map_or(Options::default().max_steps, |n| n as usize),
            steps_before: carried.map_or(0, |carried| carried.steps_tried as usize),
            fixed_step,
            ..Options::default()
        };
        Ok(Begun { system, method, state, options, t_start, t_end, sample_times })
    }
}

impl Begun<'_> {
    /// Sizes typical of what moves, from the start.
    pub(super) fn scales(&self) -> &Scales {
        self.system.scales()
    }

    /// Judges errors by the sizes of a larger scene. To be called before [`Begun::watch_start`], if at all.
    pub(super) fn widen_scales(&mut self, whole: &Scales) {
        self.system.widen_scales(whole);
    }

    /// Energies and violations at the start; to be called once, before [`Begun::integrate`].
    ///
    /// # Errors
    /// Equations without a finite value.
    pub(super) fn watch_start(&mut self) -> Result<(), AnalysisError> {
        self.system.watch(self.t_start, &self.state)
    }

    /// All steps.
    pub(super) fn integrate(&mut self) -> Ended {
        let span = Span { t_start: self.t_start, t_end: self.t_end, sample_times: &self.sample_times };
        let started = Instant::now();
        let outcome = self.method.integrate(&mut self.system, &mut self.state, &span, &self.options);
        let integration_time = started.elapsed().as_secs_f64();
        let time = match &outcome {
            Ok(Outcome { status: integrate::Status::StoppedEarly { t, .. }, .. }) => *t,
            _ => self.t_end,
        };
        if outcome.is_ok() {
            self.system.watch_end(time, &self.state);
        }
        let not_finite = self.not_finite(&outcome);
        let (audit, counters, made) = (*self.system.audit(), self.system.counters(), *self.system.tier().made());
        Ended { outcome, audit, counters, made, integration_time, time, not_finite }
    }

    /// See [`Ended::not_finite`].
    fn not_finite(&mut self, outcome: &Result<Outcome, IntegrateError>) -> Vec<Vec<f64>> {
        let Ok(Outcome { status: integrate::Status::StoppedEarly { t, reason }, .. }) = outcome else {
            return Vec::new();
        };
        let step = match reason {
            StopReason::NotFinite { step } | StopReason::Failed { step, not_finite: true, .. } => *step,
            _ => return Vec::new(),
        };
        [*t, t + step].iter().filter_map(|time| self.system.working_inputs(*time, &self.state).ok()).collect()
    }

    /// What the next stretch of the run takes over besides the state.
    pub(super) fn carried(&self) -> Carried {
        self.system.carried()
    }

    /// The state at the end; none after an error, or where an element refuses to tell its own.
    pub(super) fn restart(&mut self, model: &Model, ended: &Ended) -> Option<Restart> {
        self.state(model, ended).ok()
    }

    /// The state at the end, or why there is none.
    pub(super) fn state(&mut self, model: &Model, ended: &Ended) -> Result<Restart, String> {
        if let Err(error) = &ended.outcome {
            return Err(error.to_string());
        }
        self.system.restart(model, ended.time, &self.state).map_err(|error| error.to_string())
    }
}
