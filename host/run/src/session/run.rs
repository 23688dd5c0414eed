//! [`Run`]: a scene in motion, and the one loop that steps it.

use std::cell::OnceCell;
use std::time::Instant;

use super::error::SessionError;
use super::opened::Session;
use super::outcome::RunReport;
use super::samplings::Rows;
use super::saved::Saved;
use super::simulation::Simulation;
use super::summary::{Ended, stopped};
use crate::analysis::{AnalysisError, Scales};
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::integrate::{self, IntegrateError, Integrator, Options, Outcome, Span, Status, StopReason, System as _};
use crate::results::significant;
use crate::scene::Dimension;

/// What integrates while frictions in a plane creep, or slide so slowly that it is stiff, where no method is asked for.
const WHILE_SLIDING: &str = "auto";

/// Times this many roundings apart are the same.
const SAME_TIME: f64 = 8.0 * f64::EPSILON;

/// How many times the step tried last is gone along the motion to see what is not finite there.
const FURTHER: [f64; 3] = [1.0, 1e3, 1e6];

/// A scene in motion: advanced as far as is wanted, given new values of its inputs, asked for its outputs, saved and brought back.
///
/// Times, inputs and outputs are in the units of the scene; the unit of an input is that of its `[[input]]`.
///
/// # Inputs
/// An `[[input]]` of the scene is a signal that elements take by its name. It stays as it is until [`Run::set_input`] gives it
/// another value. A step ends at every time that is advanced to, so that a change is exact: no step goes across it.
///
/// # What a run depends on
/// Every [`Run::advance`] starts the method anew, with the size of the last steps, and depends on what [`Run::save`] saves and
/// on nothing else. So a run that is brought back gives the same digits as one that never was, also in another process.
/// Where it stops on the way does change its digits, by less than its tolerance.
///
/// # Example
/// A wheel is driven by a torque that the program gives:
/// ```
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # use odyn_catalog::Catalog;
/// # use odyn_diagnostics::Source;
/// # use odyn_scene::parse;
/// # use odyn_run::session::{RunOptions, Session};
/// # mod torque {
/// #     use element_api::prelude::*;
/// #     pub struct Torque;
/// #     impl Element for Torque {
/// #         const NAME: &'static str = "torque";
/// #         const SUMMARY: &'static str = "a torque about z, by a signal";
/// #         const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("on", "the body")];
/// #         type Parameters = NoParameters;
/// #         fn new(_: NoParameters) -> Result<Self, ParamError> { Ok(Self) }
/// #     }
/// #     impl Force for Torque {
/// #         const INPUTS: &'static [InputSpec] = &[InputSpec::required("signal", "N m", "the torque")];
/// #         fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
/// #             let zero = S::from(0.0);
/// #             out.torque(0, Vec3::new(zero, zero, at.inputs[0]));
/// #         }
/// #     }
/// # }
/// let text = r#"
///     [simulation]
///     t_end = 4
///     output_step = 0.5
///     [[body]]
///     name = "wheel"
///     mass = 1
///     inertia = [1, 1, 2]
///     [[input]]
///     name = "motor.torque"
///     unit = "N m"
///     [[force]]
///     name = "motor"
///     type = "torque"
///     bodies = ["wheel"]
///     inputs.signal = "motor.torque"
///     [[output]]
///     name = "omega"
///     quantity = "angular_velocity"
///     of = "wheel"
///     component = "z"
/// "#;
/// # let mut catalog = Catalog::new();
/// # catalog.add_library(element_api::manifest::Library {
/// #     package: "torques".into(), version: "1.0.0".into(), about: "torques".into(),
/// #     classes: vec![element_api::adapt::force::<torque::Torque>()],
/// # })?;
/// # let (scene, warnings) = parse(Source::new("scene.toml", text), &[]).map_err(|rejected| format!("{rejected:?}"))?;
/// # let session = Session::with_catalog(scene, warnings, &catalog, &RunOptions::default())?;
/// // From a file: Session::open(path, &RunOptions::default())?
/// let mut run = session.prepare()?.start()?;
/// run.advance(1.0)?;
/// assert_eq!(run.output("omega")?, 0.0);
/// run.set_input("motor.torque", 6.0)?;
/// run.advance(2.0)?;
/// assert!((run.output("omega")? - 3.0).abs() < 1e-12);
///
/// let saved = run.save()?;
/// run.set_input("motor.torque", -6.0)?;
/// run.advance(3.0)?;
/// assert!(run.output("omega")?.abs() < 1e-12);
/// // Back, and on with the torque as it was.
/// run.restore(&saved)?;
/// run.advance(3.0)?;
/// assert!((run.output("omega")? - 6.0).abs() < 1e-12);
/// assert_eq!(run.samples().times, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]);
///
/// let error = run.set_input("motor.torqe", 1.0).unwrap_err();
/// assert!(error.to_string().contains("did you mean `motor.torque`?"));
/// # Ok(())
/// # }
/// ```
pub struct Run<'a> {
    pub(super) session: Session,
    pub(super) system: Simulation<'a>,
    pub(super) method: Box<dyn Integrator>,
    /// What takes its place while frictions in a plane creep, or slide where that is stiff, where none was asked for.
    pub(super) while_sliding: Option<Box<dyn Integrator>>,
    /// What is integrated, at the last accepted time.
    pub(super) state: Vec<f64>,
    /// That time, s.
    pub(super) time: f64,
    options: Options,
    /// All times at which samples are wanted, s.
    pub(super) sample_times: Vec<f64>,
    /// Work of all integrations so far.
    pub(super) counters: integrate::Counters,
    /// How the last one ended.
    pub(super) outcome: Result<Status, IntegrateError>,
    /// The method does not continue from the start, or something has changed since.
    pub(super) interrupted: bool,
    /// The outputs at this time, SI, if they are known.
    outputs: Option<Vec<f64>>,
    /// See [`Session::fingerprint`].
    fingerprint: OnceCell<String>,
    /// Time spent on integration, s.
    integration_time: f64,
}

/// The rows of a run, in the scene's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunSamples<'a> {
    /// Times, ascending.
    pub times: &'a [f64],
    /// One column per output, in the order of the scene.
    pub columns: &'a [Vec<f64>],
}

impl<'a> Run<'a> {
    pub(super) fn new(
        session: Session,
        system: Simulation<'a>,
        method: Box<dyn Integrator>,
        state: Vec<f64>,
        options: Options,
        sample_times: Vec<f64>,
    ) -> Self {
        let is_asked_for = session.scene.simulation.method.is_some() || options.fixed_step.is_some();
        let while_sliding = if is_asked_for { None } else { session.options.methods.make(WHILE_SLIDING) };
        Self {
            time: session.begins.time,
            session,
            system,
            method,
            while_sliding,
            state,
            options,
            sample_times,
            counters: integrate::Counters::default(),
            outcome: Ok(Status::Completed),
            interrupted: false,
            outputs: None,
            fingerprint: OnceCell::new(),
            integration_time: 0.0,
        }
    }

    /// What is run: scene, model, plan.
    #[must_use]
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The time, in the scene's unit.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time / self.unit_of_time()
    }

    /// The end of the scene, in the scene's unit of time.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.session.scene.simulation.t_end / self.unit_of_time()
    }

    /// Goes on to a time, in the scene's unit. A step ends there. Samples are taken at the times that the scene asks for; one at
    /// the time advanced to is taken before anything can change there.
    ///
    /// # Errors
    /// A time that has passed or is beyond the scene's end. A motion that cannot continue: the run then is at the last time that is
    /// good, and can be brought back.
    pub fn advance(&mut self, t: f64) -> Result<(), SessionError> {
        let (unit, last) = (self.unit_of_time(), self.session.scene.simulation.t_end);
        let near = |a: f64, b: f64| a == b || (a - b).abs() < SAME_TIME * a.abs().max(b.abs());
        let to = if near(t * unit, last) { last } else { t * unit };
        if !to.is_finite() || to > last || to < self.time && !near(to, self.time) {
            let number = |time: f64| significant(time, 9);
            let (label, now, end) = (self.session.scene.units.label(Dimension::TIME), self.time(), self.end());
            let message = format!("cannot advance to {} {label}", number(t));
            let help = format!("the run is at {} {label}, the scene ends at {} {label}", number(now), number(end));
            return Err(self.refuse(Diagnostic::error(codes::OUT_OF_RANGE, message).help(help)));
        }
        let ahead = self.sample_times.partition_point(|time| *time < to);
        let mut next = self.sample_times[ahead.saturating_sub(1)..].iter().copied().take(2);
        let to = next.find(|time| near(*time, to)).unwrap_or(to);
        self.go_to(to.max(self.time));
        match stopped(&self.session, &self.outcome) {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    /// Integrates up to a time, s. What came of it is in `outcome`.
    pub(super) fn go_to(&mut self, to: f64) {
        let started = Instant::now();
        self.outputs = None;
        self.outcome = self.integrate(to);
        // Also where an error ended it, the state is that of the last accepted time.
        self.time = self.system.now();
        if matches!(self.outcome, Ok(Status::Completed)) {
            // Where a function of time jumps at the end, the last step ends just before.
            self.time = self.time.max(to);
        }
        self.integration_time += started.elapsed().as_secs_f64();
        self.interrupted = true;
    }

    fn integrate(&mut self, to: f64) -> Result<Status, IntegrateError> {
        if self.interrupted {
            let begun = self.system.begin_anew(self.time, &self.state);
            begun.map_err(|error| self.system_error(error))?;
            self.system.meet_anew();
            self.system.measure_states_anew();
            self.options.first_step = self.system.carried().step.or(self.session.scene.simulation.first_step);
        }
        self.sample_before_contacts()?;
        loop {
            if self.system.has_events()
                && let Some(ended) = self.meet_contacts(to)?
            {
                return Ok(ended);
            }
            let settled = self.system.settle_anew(self.time, &mut self.state);
            settled.map_err(|error| self.system_error(error))?;
            self.system.compile_hot(self.time);
            let ahead = &self.sample_times[self.system.samples().min(self.sample_times.len())..];
            let due = ahead.partition_point(|time| *time <= to);
            let span = Span { t_start: self.time, t_end: to, sample_times: &ahead[..due] };
            let sliding = self.while_sliding.as_mut().filter(|_| self.system.slides_in_plane());
            let method = sliding.unwrap_or(&mut self.method);
            let outcome = method.integrate(&mut self.system, &mut self.state, &span, &self.options)?;
            if outcome.counters.stiff_from.is_some() {
                self.system.was_stiff((outcome.counters.steps + outcome.counters.rejected) as u64);
            }
            self.options.steps_before += outcome.counters.steps + outcome.counters.rejected;
            self.counters += outcome.counters;
            match outcome.status {
                Status::StoppedEarly { reason: StopReason::Event, t } => {
                    // Beyond a jump of functions of time, where the last step ended before one.
                    self.time = t;
                    self.system.pass_to(t);
                    self.options.first_step = None;
                }
                status => return Ok(status),
            }
        }
    }

    /// Names of the inputs, in the order of the scene.
    pub fn inputs(&self) -> impl Iterator<Item = &str> {
        self.session.model.inputs.iter().map(|input| input.name.as_str())
    }

    /// The value of an input, in its unit.
    ///
    /// # Errors
    /// The scene has no such input.
    pub fn input(&self, name: &str) -> Result<f64, SessionError> {
        let input = self.find_input(name)?;
        Ok(self.system.given(input) / self.session.model.inputs[input].factor)
    }

    /// Gives an input another value from this time on, in its unit. Positions and velocities stay as they are; forces and
    /// accelerations jump. What that changes of a potential energy counts as work done.
    ///
    /// # Errors
    /// The scene has no such input; a value that is not finite; an element that fails.
    pub fn set_input(&mut self, name: &str, value: f64) -> Result<(), SessionError> {
        let input = self.find_input(name)?;
        let si = value * self.session.model.inputs[input].factor;
        if !si.is_finite() {
            let message = format!("the value of the input `{name}` is not a finite number");
            return Err(self.refuse(Diagnostic::error(codes::NOT_FINITE, message)));
        }
        if si == self.system.given(input) {
            return Ok(());
        }
        self.outputs = None;
        self.interrupted = true;
        let given = self.system.give(input, si, self.time, &mut self.state);
        given.map_err(|error| self.failed(error))
    }

    /// The value of an output at this time, in its unit.
    ///
    /// # Errors
    /// The scene has no such output; accelerations or reactions that are asked for and have no solution here.
    pub fn output(&mut self, name: &str) -> Result<f64, SessionError> {
        let channels = &self.session.model.channels;
        let Some(place) = channels.iter().position(|channel| channel.name == name) else {
            return Err(self.unknown("output", name, channels.iter().map(|channel| channel.name.as_str())));
        };
        let factor = channels[place].factor;
        if self.outputs.is_none() {
            let found = self.system.channels(self.time, &self.state).map(<[f64]>::to_vec);
            self.outputs = Some(found.map_err(|error| self.failed(error))?);
            // Whatever was looked up for this is no part of the run.
            self.interrupted = true;
        }
        Ok(self.outputs.as_ref().map_or(f64::NAN, |values| values[place] / factor))
    }

    /// The samples taken so far; none where a sink takes them.
    #[must_use]
    pub fn samples(&self) -> RunSamples<'_> {
        match self.system.rows_taken() {
            Rows::Kept(rows) => RunSamples { times: &rows.taken, columns: &rows.columns },
            Rows::Sent(_) => RunSamples { times: &[], columns: &[] },
        }
    }

    /// Everything that the future of the run depends on.
    ///
    /// # Errors
    /// An opaque element that cannot save its memory.
    pub fn save(&mut self) -> Result<Saved, SessionError> {
        let mut system = self.system.save(self.time, &self.state).map_err(|error| self.failed(error))?;
        system.carried.steps_tried = self.options.steps_before as u64;
        // Whatever was looked up for this is no part of the run.
        self.interrupted = true;
        Ok(Saved {
            fingerprint: self.fingerprint().to_owned(),
            formulation: self.system.formulation().name().to_owned(),
            time: self.time,
            state: self.state.clone(),
            system,
        })
    }

    /// Brings the run back to what was saved of it, or of another run of the same scene. Samples and events behind it are dropped; where
    /// those before it were not taken by this run, its samples and events begin there. Counters of work continue.
    ///
    /// # Errors
    /// What was saved of another scene, or with other libraries; an opaque element that refuses its memory.
    pub fn restore(&mut self, saved: &Saved) -> Result<(), SessionError> {
        let same = saved.fingerprint == self.fingerprint()
            && saved.formulation == self.system.formulation().name()
            && saved.state.len() == self.state.len()
            && self.system.fits(&saved.system);
        if !same {
            let message = "what was saved belongs to another scene, or to other libraries";
            let diagnostic = Diagnostic::error(codes::CANNOT_GO_ON, message);
            return Err(self.refuse(diagnostic.help("a run can be brought back to what was saved of the same scene")));
        }
        self.system.restore(&saved.system).map_err(|error| self.failed(error))?;
        self.time = saved.time;
        self.state.copy_from_slice(&saved.state);
        if self.system.released() != saved.system.carried.released {
            self.be_released(&saved.system.carried.released)?;
            self.system.restore(&saved.system).map_err(|error| self.failed(error))?;
        }
        self.system.set_now(saved.time);
        self.options.steps_before = saved.system.carried.steps_tried as usize;
        if let Rows::Kept(rows) = self.system.rows_taken_mut() {
            rows.go_back(saved.system.samples, saved.system.events);
        }
        (self.outcome, self.outputs, self.interrupted) = (Ok(Status::Completed), None, true);
        Ok(())
    }

    /// Ends the run: its samples with a summary, audit, figures and checks, as of a run by itself. One that has not reached the
    /// scene's end is reported as interrupted.
    ///
    /// # Errors
    /// An element that failed.
    pub fn finish(self) -> Result<RunReport, SessionError> {
        let mut summary = self.session.summary(self.method.name(), self.system.formulation().name());
        let time = self.time;
        let to = self.session.scene.simulation.t_end;
        let (session, ended, rows) = self.into_ended(to);
        session.note_work(&mut summary, &ended, false);
        summary.t_end_reached = time / session.scene.units.factor(Dimension::TIME);
        summary.wall_time_s = session.load_time + session.compile_time + ended.integration_time;
        let failed = session.conclude(&mut summary, ended.outcome, &mut None);
        session.judge(&mut summary);
        session.warn_of_elements(&mut summary);
        session.warn_of_rest(&mut summary);
        session.warn_of_step(&mut summary);
        let mut samplings = match rows {
            Rows::Kept(samplings) => *samplings,
            Rows::Sent(_) => session.no_samplings(),
        };
        let judged = session.judge_reactions(&mut summary, &mut samplings, ended.state.as_ref().ok());
        judged.map_err(|error| session.files_error(&error))?;
        session.judge_outputs(&mut summary, &samplings);
        let checks = session.evaluate(&mut summary, &samplings, &session.tables());
        failed.map_or(Ok(samplings.report(summary, checks)), Err)
    }

    /// Sizes typical of what moves, from the start.
    pub(super) fn scales(&self) -> &Scales {
        self.system.scales()
    }

    /// Judges errors by the sizes of a larger scene. To be called before [`Run::watch_start`], if at all.
    pub(super) fn widen_scales(&mut self, whole: &Scales) {
        self.system.widen_scales(whole);
    }

    /// Takes note of energies and violations at the start; to be called once, before the first step.
    ///
    /// # Errors
    /// Equations without a finite value.
    pub(super) fn watch_start(&mut self) -> Result<(), SessionError> {
        let watched = self.system.watch(self.time, &self.state);
        watched.map_err(|error| self.session.cannot_start(error, self.time))
    }

    /// What is left behind, with the session and the rows, of a run that was to reach a time, s.
    pub(super) fn into_ended(mut self, to: f64) -> (Session, Ended, Rows<'a>) {
        let outcome = std::mem::replace(&mut self.outcome, Ok(Status::Completed)).map(|status| match status {
            Status::Completed if self.time < to => Status::StoppedEarly { t: self.time, reason: StopReason::Requested },
            status => status,
        });
        if outcome.is_ok() {
            self.system.watch_end(self.time, &self.state);
        }
        let not_finite = self.not_finite(&outcome);
        let cause = self.cause(&outcome);
        let state = match &outcome {
            Err(error) => Err(error.to_string()),
            Ok(_) => {
                let state = self.system.restart(&self.session.model, self.time, &self.state);
                state.map_err(|error| self.session.without_state(&error))
            }
        };
        self.system.leave_code();
        let counters = self.counters;
        let ended = Ended {
            outcome: outcome.map(|status| Outcome { status, counters }),
            audit: *self.system.audit(),
            counters: self.system.counters(),
            made: *self.system.tier().made(),
            integration_time: self.integration_time,
            not_finite,
            cause,
            state,
            carried: self.system.carried(),
        };
        self.session.model.sets = self.system.lend_sets();
        (self.session, ended, self.system.into_rows())
    }

    /// See [`Ended::not_finite`].
    fn not_finite(&mut self, outcome: &Result<Status, IntegrateError>) -> Vec<Vec<f64>> {
        let Ok(Status::StoppedEarly { t, reason }) = outcome else { return Vec::new() };
        let step = match reason {
            StopReason::NotFinite { step } | StopReason::Failed { step, not_finite: true, .. } => *step,
            // What ends where conditions on unknowns are no numbers any more is met in many ways.
            StopReason::Failed { step, .. }
            | StopReason::StepTooSmall { step }
            | StopReason::NoConvergence { step }
                if !self.session.equations.graph.solved.is_empty() =>
            {
                *step
            }
            _ => return Vec::new(),
        };
        let inputs = |system: &mut Simulation<'_>, time: f64, state: &[f64]| system.working_inputs(time, state).ok();
        let mut found: Vec<Vec<f64>> =
            [*t, t + step].iter().filter_map(|time| inputs(&mut self.system, *time, &self.state)).collect();
        let mut rates = vec![0.0; self.state.len()];
        if self.system.rhs(*t, &self.state, &mut rates).is_ok() {
            for ahead in FURTHER.map(|times| times * step) {
                let state: Vec<f64> = self.state.iter().zip(&rates).map(|(y, rate)| y + ahead * rate).collect();
                found.extend(inputs(&mut self.system, t + ahead, &state));
            }
        }
        found
    }

    fn unit_of_time(&self) -> f64 {
        self.session.scene.units.factor(Dimension::TIME)
    }

    fn fingerprint(&self) -> &str {
        self.fingerprint.get_or_init(|| self.session.fingerprint())
    }

    fn find_input(&self, name: &str) -> Result<usize, SessionError> {
        let place = self.inputs().position(|input| input == name);
        place.ok_or_else(|| self.unknown("input", name, self.inputs()))
    }

    /// There is nothing of that name.
    fn unknown<'n>(&self, what: &str, name: &str, known: impl Iterator<Item = &'n str>) -> SessionError {
        let names: Vec<&str> = known.collect();
        let help = match suggest(name, names.iter().copied()) {
            Some(nearest) => format!("did you mean `{nearest}`?"),
            None if names.is_empty() => format!("the scene has no [[{what}]]"),
            None => format!("known are {}", names.join(", ")),
        };
        self.refuse(Diagnostic::error(codes::UNKNOWN_TARGET, format!("there is no {what} `{name}`")).help(help))
    }

    pub(super) fn refuse(&self, diagnostic: Diagnostic) -> SessionError {
        SessionError::one(&self.session.scene.source, diagnostic)
    }

    /// Something could not be evaluated at this time.
    pub(super) fn failed(&self, error: AnalysisError) -> SessionError {
        let error = IntegrateError::System { t: self.time, cause: Box::new(error) };
        self.session.integration_error(&error)
    }
}
