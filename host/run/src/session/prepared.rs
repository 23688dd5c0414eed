//! [`Prepared`]: a scene with everything that is chosen before time starts.

use super::common::Common;
use super::error::{SessionError, start_error};
use super::guards::Watching;
use super::leg::Leg;
use super::opened::Session;
use super::options::DEFAULT_METHOD;
use super::run::Run;
use super::samplings::Rows;
use super::simulation::Simulation;
use super::sink::Sink;
use super::tier::Tier;
use crate::analysis::Formulation;
use crate::integrate::{Integrator, Kinematic, Options};
use crate::results::AuditLimits;

/// Positions that are off by this share of the scene's size behind a step with error control are no error of the step, but rows that
/// jump, and velocities those of rows with a kink; or by so many tolerances, where that is more.
pub(super) const JUMP: f64 = 1e-4;
const JUMP_OVER_TOLERANCE: f64 = 1e4;

/// That share at a tolerance.
pub(super) fn jump(tolerance: f64) -> f64 {
    JUMP.max(JUMP_OVER_TOLERANCE * tolerance)
}

/// What a run is made with.
struct Setup {
    engine: String,
    method: Box<dyn Integrator>,
    formulation: Box<dyn Formulation>,
    fixed_step: Option<f64>,
}

/// A scene whose coordinates, method and engine are chosen: all that can be settled before time starts.
///
/// It gives one [`Run`], since opaque elements, with their private memories, move into it.
pub struct Prepared {
    pub(super) session: Session,
    setup: Setup,
}

impl Session {
    /// Chooses the method and writes the equations in the form that it wants.
    ///
    /// # Errors
    /// An unknown method, engine or formulation; a method without a step size; masses that admit no motion.
    pub fn prepare(mut self) -> Result<Prepared, SessionError> {
        let setup = self.setup()?;
        Ok(Prepared { session: self, setup })
    }

    /// The engine's name.
    pub(super) fn engine(&self) -> &str {
        self.scene.simulation.engine.as_ref().map_or("auto", |engine| engine.value.as_str())
    }

    fn setup(&mut self) -> Result<Setup, SessionError> {
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
        self.contacts_fit(fixed_step.is_some())?;
        let engine = self.engine().to_string();
        let offer_jacobian = method.may_use_jacobian();
        let formulation = if self.equations.loads_switch() {
            // Steps begin where all contacts are open and nothing slides.
            let open = self.equations.in_mode(&[], &self.plan.layout);
            self.formulation_with(open, offer_jacobian)?.0
        } else {
            let mut formulation = self.formulation(&engine)?;
            if offer_jacobian {
                formulation.offer_jacobian(&self.equations);
            }
            formulation
        };
        Ok(Setup { engine, method, formulation, fixed_step })
    }
}

impl Prepared {
    /// The same as [`Session::prepare`].
    ///
    /// # Errors
    /// See there.
    pub fn new(session: Session) -> Result<Self, SessionError> {
        session.prepare()
    }

    /// What was prepared: scene, model, plan.
    #[must_use]
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Name of the method of integration.
    #[must_use]
    pub fn method(&self) -> &'static str {
        self.setup.method.name()
    }

    /// Name of the formulation of the equations of motion.
    #[must_use]
    pub fn formulation(&self) -> &'static str {
        self.setup.formulation.name()
    }

    /// Places the system at its start. The run keeps its samples. All islands of the scene take common steps.
    ///
    /// # Errors
    /// Where the motion cannot start, or machine code is asked for and cannot be had.
    pub fn start(self) -> Result<Run<'static>, SessionError> {
        let rows = Rows::Kept(Box::new(self.session.no_samplings()));
        self.started(rows)
    }

    /// The same; the samples go to a sink, in SI units, and are not kept.
    ///
    /// # Errors
    /// See [`Prepared::start`].
    pub fn start_into<'a>(self, sink: Box<dyn Sink + 'a>) -> Result<Run<'a>, SessionError> {
        self.started(Rows::Sent(sink))
    }

    /// The whole run at its start.
    fn started(self, rows: Rows<'_>) -> Result<Run<'_>, SessionError> {
        let leg = Leg { to: self.session.scene.simulation.t_end, first_sample: 0, carried: None };
        let mut run = self.begin(rows, leg)?;
        run.watch_start()?;
        Ok(run)
    }

    /// A run before its first step; [`Run::watch_start`] follows.
    pub(super) fn begin(self, rows: Rows<'_>, leg: Leg) -> Result<Run<'_>, SessionError> {
        let Self { mut session, setup } = self;
        let Setup { engine, method, formulation, fixed_step } = setup;
        let tolerance = session.tolerance();
        let (t_start, t_end) = (session.begins.time, leg.to);
        let layout = session.plan.layout.clone();
        let Session { equations, model, assembly, scene, .. } = &mut session;
        let mut system = Simulation::new(equations, model, &layout, assembly, formulation, tolerance, rows)
            .map_err(|e| start_error(scene, model, &e))?;
        let mut watching = Watching::find(&mut session.equations, system.counted_angles(), &layout, tolerance);
        if session.pruning.events && fixed_step.is_none() {
            system.end_steps_at(&session.equations, watching.conditions());
        }
        let limits = AuditLimits::belonging_to(tolerance, session.has_fixed_steps());
        system.bound_energy_of_steps(limits.energy);
        // Determined motions are found by these corrections, from a guess.
        if fixed_step.is_none() && !session.determined {
            system.bound_corrections(jump(tolerance));
        }
        if !session.pruning.on_demand {
            system.solve_at_samples();
        }
        if !session.pruning.audit {
            system.watch_every_state();
        }
        // What is due where another run ended was sampled by that.
        let continues = leg.carried.is_some() || session.begins.state.is_some();
        system.clocks().set(t_start, continues);
        if continues {
            system.memories_continue();
        }
        if fixed_step.is_none() {
            system.may_creep(t_start);
        }
        // Steps of a fixed size ask for the next instant; of motions that are determined it is a largest one.
        if fixed_step.is_none() || session.determined {
            watching.periods = (system.clocks().periods().collect(), t_end);
        }
        let state = system.start(t_start, &session.assembly).map_err(|e| session.cannot_start(e, t_start))?;
        system.examine_contacts(t_start, &state).map_err(|e| session.bad_contact(&e))?;
        watching.contacts = session.equations.contacts.clone();
        watching.frictions = session.equations.frictions.clone();
        watching.releases = session.equations.releases.clone();
        watching.rows = system
            .watch_rows_left_out(&session.equations, t_start, &state)
            .map_err(|e| start_error(&session.scene, &session.model, &e))?;
        let bounded = system.guard(&mut session.equations, &watching);
        session.equations.graph.rest();
        system
            .anticipate_rest(&session.equations, &session.model, (t_start, &state), t_end - t_start)
            .map_err(|e| start_error(&session.scene, &session.model, &e))?;
        if session.determined {
            system.anticipate_drives(&session.equations, (t_start, &state), t_end - t_start);
        }
        if let Some(carried) = &leg.carried {
            system.carry_on(carried);
        }
        system.count_samples_from(leg.first_sample);
        let sample_times: Vec<f64> = session.sample_times().iter().map(|time| time.si).collect();
        let due = sample_times.partition_point(|time| *time <= t_end);
        if matches!(engine.as_str(), "auto" | "compiled") {
            let shared = session.options.common.as_ref().map(Common::code);
            system.set_tier(Tier::automatic(t_start, t_end).sharing(shared), due);
            system.take_shared_code(t_start);
        }
        if engine == "compiled" {
            // What stands in for something else waits until it turns out to be run often.
            system.compile_now(t_start).map_err(|e| session.no_machine_code(&e))?;
        }
        let simulation = &session.scene.simulation;
        // What cannot be enclosed is at least looked at as often as the user looks.
        let ahead = &sample_times[leg.first_sample.min(due)..due];
        let between = ahead.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let longest = Some(between).filter(|longest| bounded && *longest > 0.0);
        let carried = leg.carried.as_ref();
        let options = Options {
            first_step: carried.map_or(simulation.first_step, |carried| carried.step),
            max_step: [simulation.max_step, longest].into_iter().flatten().reduce(f64::min),
            max_steps: simulation.max_steps.map_or(Options::default().max_steps, |n| n as usize),
            steps_before: carried.map_or(0, |carried| carried.steps_tried as usize),
            fixed_step,
            steps: session.options.steps.clone(),
            ..Options::default()
        };
        Ok(Run::new(session, system, method, state, options, sample_times))
    }
}
