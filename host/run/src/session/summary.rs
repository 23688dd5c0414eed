//! The summary of a run: what is known before it, what was done, and how it ended.

use std::ops::Range;

use element_api::params::ParamSpec;

use super::checkpoint::Carried;
use super::error::{SessionError, fault_of_element, start_error};
use super::opened::Session;
use super::restart::Restart;
use super::savings::needs_solver;
use super::tier::Made;
use crate::analysis::{AnalysisError, Counters};
use crate::diagnostics::{Code, Diagnostic, codes};
use crate::integrate::{self, IntegrateError, Outcome, StopReason};
use crate::model::{Channel, Quantity};
use crate::plan::Plan;
use crate::results::{Audit, ChannelInfo, LibraryUsed, Remedy, ResultsError, Status, Summary, checksum, significant};
use crate::scene::{Dimension, ElementKind, ElementRecord, InputSource, OutputRecord, Spanned, parse_unit};

/// Elements that are named where several may be the cause.
const MOST_NAMED: usize = 6;

/// What an integration leaves behind.
pub(super) struct Ended {
    pub(super) outcome: Result<Outcome, IntegrateError>,
    pub(super) audit: Audit,
    pub(super) counters: Counters,
    pub(super) made: Made,
    /// With its samples, s.
    pub(super) integration_time: f64,
    /// Where something was not finite: the inputs of the working form at the last accepted state, behind it by the step tried last, and
    /// further on along the motion.
    pub(super) not_finite: Vec<Vec<f64>>,
    /// Points that came together, or an internal unknown, that may be why it did not continue.
    pub(super) cause: Option<String>,
    /// The state at the end, or why there is none.
    pub(super) state: Result<Restart, String>,
    /// What another leg of the run takes over besides the state.
    pub(super) carried: Carried,
}

impl Session {
    /// Writes the counters and the audit of an integration into a summary; `goes_on`: it was not the first leg of its run.
    pub(super) fn note_work(&self, summary: &mut Summary, ended: &Ended, goes_on: bool) {
        let counters = &ended.counters;
        summary.audit = ended.audit;
        summary.elements = self.element_records(&ended.carried.margins);
        summary.evaluations = counters.evaluations;
        summary.factorisations = counters.factorisations;
        summary.position_corrections = counters.position_corrections;
        summary.coupling_iterations = counters.coupling_iterations;
        summary.integration_time_s = ended.integration_time;
        let taken = [
            (Remedy::RankSafe, counters.rank_safe),
            (Remedy::StageProjection, counters.stage_projections),
            (Remedy::Passage, counters.interpolated),
            (Remedy::PlaceAhead, u64::from(self.ahead.is_some() && !goes_on)),
            (Remedy::Contradiction, counters.contradictions),
        ];
        taken.into_iter().for_each(|(remedy, count)| summary.recoveries[remedy] = count);
        // Before the outcome is reported, which has no more to say than that something is none.
        let culprit = || ended.not_finite.iter().find_map(|inputs| self.culprit(inputs));
        let stopped = match ended.outcome.as_ref().map(|outcome| &outcome.status) {
            Ok(integrate::Status::StoppedEarly { reason, .. }) => !matches!(reason, StopReason::Requested),
            Ok(integrate::Status::Completed) | Err(_) => false,
        };
        let turned = || self.turned(&ended.audit).filter(|_| stopped);
        summary.reason = ended.cause.clone().or_else(culprit).or_else(turned).unwrap_or_default();
        note_machine_code(summary, &ended.made, self.scene.units.factor(Dimension::TIME));
    }

    /// Whether reactions that are not unique leave the values of a channel as they are.
    pub(super) fn is_unique(&self, channel: &Channel, plan: &Plan) -> bool {
        match &channel.quantity {
            Quantity::Load { element, frame, torque, axes, component } => {
                plan.is_unique_in(*axes, *element, *frame, *torque, *component)
            }
            Quantity::Value { element, channel } => {
                !plan.undetermined.iter().any(|open| open.element == *element && open.channels[*channel])
            }
            _ => true,
        }
    }

    pub(super) fn channel_info(&self, (number, channel): (usize, &Channel)) -> ChannelInfo {
        let unique = self.is_unique(channel, &self.plan);
        // They are those of the scene, in its order; then what is taken besides.
        let is_it = |record: &&OutputRecord| record.name.value == channel.name;
        let outputs = &self.scene.outputs;
        let record = outputs.get(number).filter(is_it).or_else(|| outputs.iter().find(is_it));
        ChannelInfo {
            name: channel.name.clone(),
            unit: channel.unit.clone(),
            quantity: record.map_or(String::new(), |record| record.quantity.value.clone()),
            place: channel.place.clone(),
            factor: channel.factor,
            unique,
        }
    }

    /// What is known before the first step.
    pub(super) fn summary(&self, method: &str, engine: &str) -> Summary {
        self.summary_of(checksum(self.scene.source.text.as_bytes()), method, engine)
    }

    /// The same where the checksum of the text is known.
    pub(super) fn summary_of(&self, scene_sha256: String, method: &str, engine: &str) -> Summary {
        let units = &self.scene.units;
        Summary {
            status: Status::Running,
            scene: self.scene.source.name.clone(),
            scene_sha256,
            overrides: self.options.overrides.iter().map(|change| change.text.clone()).collect(),
            title: self.scene.title.clone(),
            odyn_version: env!("CARGO_PKG_VERSION").into(),
            method: method.into(),
            engine: engine.into(),
            tolerance: self.tolerance(),
            t_end: self.scene.simulation.t_end / units.factor(Dimension::TIME),
            time_unit: units.label(Dimension::TIME),
            load_time_s: self.load_time,
            compile_time_s: self.compile_time,
            mobility: self.plan.mobility as u64,
            redundant_rows: self.plan.redundant_rows.len() as u64,
            not_unique: self
                .model
                .channels
                .iter()
                .enumerate()
                .map(|channel| self.channel_info(channel))
                .filter(|info| !info.unique)
                .map(|info| info.name)
                .collect(),
            redundant_row_names: self.plan.redundant_rows.iter().map(|row| row.name.clone()).collect(),
            audit_limits: self.audit_limits(),
            chosen_velocities: self.chosen_velocities(),
            libraries: self
                .libraries
                .iter()
                .map(|library| LibraryUsed {
                    package: library.package.clone(),
                    version: library.version.clone(),
                    sha256: library.sha256.clone(),
                })
                .collect(),
            warnings: self.warnings.iter().map(|w| format!("{}: {}", w.code, w.message)).collect(),
            ..Summary::default()
        }
    }

    /// Writes the end of the integration into the summary; an error where there is more to say than that it stopped.
    pub(super) fn conclude(
        &self,
        summary: &mut Summary,
        outcome: Result<Outcome, IntegrateError>,
        files: &mut Option<ResultsError>,
    ) -> Option<SessionError> {
        match outcome {
            Ok(outcome) => {
                let counters = &outcome.counters;
                summary.steps = counters.steps as u64;
                summary.rejected = counters.rejected as u64;
                summary.projections = counters.projections as u64;
                summary.jacobians = counters.jacobians as u64;
                summary.newton_iterations = counters.newton_iterations as u64;
                summary.enclosures = counters.enclosed as u64;
                summary.unproven = counters.unproven as u64;
                summary.warnings.extend(counters.open.map(|stretch| self.left_open(stretch)));
                summary.newton_factorisations = counters.factorisations as u64;
                let recoveries = &counters.recoveries;
                let taken = [
                    (Remedy::SmallerStep, recoveries.smaller_step),
                    (Remedy::NotFinite, recoveries.not_finite),
                    (Remedy::NoConvergence, recoveries.no_convergence),
                    (Remedy::SampleStep, recoveries.sample_step),
                    (Remedy::FreshJacobian, recoveries.fresh_jacobian),
                    (Remedy::MethodSwitch, counters.switches),
                    (Remedy::Event, counters.events),
                    (Remedy::Chatter, counters.chatters),
                    (Remedy::WithinStep, counters.stepped_over),
                    (Remedy::Missed, counters.missed),
                ];
                taken.into_iter().for_each(|(remedy, count)| summary.recoveries[remedy] = count as u64);
                summary.stiff_from = counters.stiff_from.map(|t| t / self.scene.units.factor(Dimension::TIME));
                match outcome.status {
                    integrate::Status::Completed => summary.status = Status::Completed,
                    integrate::Status::StoppedEarly { reason, .. } => {
                        summary.status = Status::StoppedEarly;
                        // That of a user who interrupts is no remedy.
                        let forced = !matches!(reason, StopReason::Requested);
                        summary.recoveries[Remedy::EarlyEnd] = u64::from(forced);
                        summary.code = Some(code_of(&reason));
                        let culprit = std::mem::take(&mut summary.reason);
                        summary.reason = match culprit.is_empty() {
                            true => reason.to_string(),
                            false => format!("{culprit}: {reason}"),
                        };
                        if summary.code == Some(codes::PROJECTION_FAILED)
                            && !is_out_of_reach(&reason)
                            && let Some(masses) = self.masses_far_apart()
                        {
                            summary.reason.push_str(&masses);
                        }
                        if summary.code == Some(codes::TOO_MANY_STEPS) {
                            let stiff = summary.stiff_from.is_some() && summary.method != "auto";
                            summary.reason.push_str(&self.many_steps(&reason, stiff));
                        }
                    }
                }
                None
            }
            Err(error) => {
                let reason = error.to_string();
                let (code, error) = match files.take() {
                    Some(error) => (Some(error.code()), self.files_error(&error)),
                    None => {
                        let error = self.integration_error(&error);
                        (error.diagnostics.first().map(|first| first.code), error)
                    }
                };
                summary.fail(reason, code);
                Some(error)
            }
        }
    }

    /// What can be done where steps are used up.
    fn many_steps(&self, reason: &StopReason, stiff: bool) -> String {
        if let StopReason::StepLimit { crept: Some(since), .. } = reason {
            let units = &self.scene.units;
            let since = significant(since / units.factor(Dimension::TIME), 2);
            let label = units.label(Dimension::TIME);
            let named = self.jumps_with_speed();
            let named = if named.is_empty() { named } else { format!(" (here {named})") };
            return format!(
                "; half of them went into the last {since} {label}: something jumps there, or switches to and fro. A force that jumps with a \
                 speed{named} needs a finite width, or is to be friction (`dry-friction`, `joint-friction`, `mu` of a contact), \
                 which can stick"
            );
        }
        match stiff {
            true => "; stability limits the steps, not accuracy: `--method auto` takes few".into(),
            false => "; raise `max_steps` if the motion is that fast, or look for the element that makes it so".into(),
        }
    }

    /// Functions of a speed that jump by how they are written: tables with steps, and quotients by a magnitude.
    fn jumps_with_speed(&self) -> String {
        let speeds = [Dimension::VELOCITY, Dimension::ANGULAR_VELOCITY];
        let of_speed = |spec: &ParamSpec| {
            let argument = spec.unit.split_once("->").map(|(argument, _)| parse_unit(argument.trim()));
            matches!(argument, Some(Ok((dimension, _))) if speeds.contains(&dimension))
        };
        let mut named = Vec::new();
        for record in self.scene.elements.iter().filter(|record| record.enabled) {
            let Some(instance) = self.model.elements.iter().find(|one| one.name == record.name.value) else { continue };
            for spec in instance.class.params.iter().filter(|spec| of_speed(spec)) {
                let given = record.params.entries.iter().find(|(key, _)| key.value == spec.name);
                let text = given.and_then(|(_, value)| self.scene.source.slice(value.span.clone())).unwrap_or_default();
                if text.contains("steps") || text.contains('/') && (text.contains("abs") || text.contains("sqrt")) {
                    named.push(format!("`{}` of `{}`", spec.name, record.name.value));
                }
            }
        }
        named.truncate(MOST_NAMED);
        named.join(", ")
    }

    /// A stretch of time, s, on which a pulse could hide.
    fn left_open(&self, stretch: [f64; 2]) -> String {
        let units = &self.scene.units;
        let [from, to] = stretch.map(|t| significant(t / units.factor(Dimension::TIME), 6));
        format!(
            "{}: a function of time could not be shown to be without pulses from t = {from} to {to} {}: if it has one there, limit \
             the steps (`max_step`) to less than its width",
            codes::LEFT_OPEN,
            units.label(Dimension::TIME)
        )
    }

    /// What ended an integration, in words.
    pub(super) fn integration_error(&self, error: &IntegrateError) -> SessionError {
        let diagnostic = self
            .element_fault(error)
            .or_else(|| self.particle_fault(error))
            .unwrap_or_else(|| Diagnostic::error(codes::MOTION_NOT_FINITE, error.to_string()));
        let held = match diagnostic.code == codes::TORQUE_ON_PARTICLE {
            true => "results up to this time are not valid: it took a part of the torque",
            false => "results up to this time are valid",
        };
        SessionError::one(&self.scene.source, diagnostic.help(held))
    }

    /// The motion cannot start at this time, s: by the fault of an element, or of its equations.
    pub(super) fn cannot_start(&self, error: AnalysisError, t: f64) -> SessionError {
        let mut general = start_error(&self.scene, &self.model, &error);
        if matches!(error, AnalysisError::NoCommonSolution) {
            for (place, help) in self.reaction_takers().into_iter().chain(self.signal_takers()) {
                general.diagnostics =
                    general.diagnostics.into_iter().map(|one| one.at(place.clone(), "").help(help.clone())).collect();
            }
        }
        let error = IntegrateError::System { t, cause: Box::new(error) };
        let fault = self.element_fault(&error).or_else(|| self.particle_fault(&error));
        fault.map_or(general, |diagnostic| SessionError::one(&self.scene.source, diagnostic))
    }

    /// Forces that take reactions of joints: where the first stands, and all of them with their coefficients of friction.
    fn reaction_takers(&self) -> Option<(Range<usize>, String)> {
        let forces =
            self.scene.elements.iter().filter(|record| record.kind == ElementKind::Force && !record.joints.is_empty());
        let first = forces.clone().next()?;
        let named = |record: &ElementRecord| {
            let mu = record.params.entries.iter().find(|(key, _)| key.value == "mu");
            let mu = mu.and_then(|(_, value)| self.scene.source.slice(value.span.clone()));
            let mu = mu.map_or_else(String::new, |mu| format!(" with mu = {mu}"));
            format!("`{}`{mu}", record.name.value)
        };
        let names: Vec<String> = forces.take(MOST_NAMED).map(named).collect();
        Some((
            first.name.span.clone(),
            format!(
                "what depends on reactions: {}; look whether the friction is meant to be so large",
                names.join(", ")
            ),
        ))
    }

    /// Elements that take accelerations and reactions as signals: where the first of these stands, and all of them.
    fn signal_takers(&self) -> Option<(Range<usize>, String)> {
        let mut taken = Vec::new();
        for element in &self.model.elements {
            let Some(record) = self.scene.elements.iter().find(|record| record.name.value == element.name) else {
                continue;
            };
            for (source, input) in element.inputs.iter().zip(&element.class.inputs) {
                let solved = source.quantity().is_some_and(|quantity| needs_solver(quantity, &self.model));
                let given = record.inputs.iter().find(|given| given.name.value == input.name).filter(|_| solved);
                let Some(given) = given else { continue };
                let (InputSource::Reference(signal)
                | InputSource::Scaled { signal: Spanned { value: signal, .. }, .. }) = &given.source.value
                else {
                    continue;
                };
                taken.push((given.source.span.clone(), format!("`{}` takes `{signal}`", element.name)));
            }
        }
        let (first, _) = taken.first()?;
        let names: Vec<&str> = taken.iter().take(MOST_NAMED).map(|(_, text)| text.as_str()).collect();
        Some((
            first.clone(),
            format!(
                "signals made of accelerations or reactions of the same instant: {}; what follows them may not cancel the inertia that \
                 it moves: change a gain, or put a `sensor` with a time constant between",
                names.join(", ")
            ),
        ))
    }

    /// A particle that was made to turn, or a thin rod about its axis.
    fn particle_fault(&self, error: &IntegrateError) -> Option<Diagnostic> {
        let IntegrateError::System { cause, .. } = error else { return None };
        let cause = cause.downcast_ref::<crate::analysis::AnalysisError>()?;
        use crate::analysis::AnalysisError::{TorqueOnParticle, TorqueOnThin};
        let (body, place, help) = match cause {
            TorqueOnParticle { body } => (
                body,
                "has no rotation and no inertia",
                "attach joints and forces at its position and so that they only push, or give it an inertia",
            ),
            TorqueOnThin { body } => (
                body,
                "has a principal moment of inertia that is zero",
                "give the body the moment of inertia about this axis that it has, no less than 1e-7 of its largest one, or hold it by a \
                 joint that takes the torque",
            ),
            _ => return None,
        };
        let record = self.scene.bodies.iter().find(|record| record.name.value == *body)?;
        let diagnostic = Diagnostic::error(codes::TORQUE_ON_PARTICLE, cause.to_string());
        Some(diagnostic.at(record.name.span.clone(), place).help(help))
    }

    /// Why there is no state to continue from: the element, a colon, its reason.
    pub(super) fn without_state(&self, error: &AnalysisError) -> String {
        let AnalysisError::Element { set, fault } = error else { return error.to_string() };
        let instance = self.model.elements.iter().find(|e| e.set == *set && e.index as usize == fault.instance);
        instance.map_or_else(|| error.to_string(), |instance| format!("`{}`: {}", instance.name, fault.message))
    }

    /// The element behind a failure, with its place in the scene.
    fn element_fault(&self, error: &IntegrateError) -> Option<Diagnostic> {
        let IntegrateError::System { t, cause } = error else { return None };
        let cause = cause.downcast_ref::<crate::analysis::AnalysisError>()?;
        let unit = self.scene.units.factor(Dimension::TIME);
        let when = format!("at t = {} {}", significant(t / unit, 6), self.scene.units.label(Dimension::TIME));
        fault_of_element(&self.scene, &self.model, cause, &when)
    }
}

/// Writes into the summary what was compiled. `unit` is the scene's unit of time, s.
fn note_machine_code(summary: &mut Summary, made: &Made, unit: f64) {
    summary.machine_code_programs = made.programs;
    summary.machine_code_bytes = made.bytes;
    summary.machine_code_time_s = made.seconds;
    summary.machine_code_from = made.since.map(|t| t / unit);
    // The reference form's name says what counts there.
    if !summary.engine.starts_with("reference") {
        let how = if made.programs > 0 { "compiled" } else { "interpreted" };
        summary.engine = format!("{how}, {}", summary.engine);
    }
}

/// Why an integration did not reach the time that it was to reach, if it did not.
pub(super) fn stopped(session: &Session, outcome: &Result<integrate::Status, IntegrateError>) -> Option<SessionError> {
    match outcome {
        Ok(integrate::Status::Completed) => None,
        Ok(integrate::Status::StoppedEarly { t, reason }) => {
            let units = &session.scene.units;
            let (time, label) = (t / units.factor(Dimension::TIME), units.label(Dimension::TIME));
            let message = format!("the run stops at {} {label}: {reason}", significant(time, 6));
            let diagnostic = Diagnostic::error(code_of(reason), message).help("results up to this time are valid");
            Some(SessionError::one(&session.scene.source, diagnostic).of_integration())
        }
        Err(error) => Some(session.integration_error(error)),
    }
}

fn code_of(reason: &StopReason) -> Code {
    match reason {
        StopReason::Requested => codes::INTERRUPTED,
        StopReason::StepLimit { .. } => codes::TOO_MANY_STEPS,
        StopReason::StepTooSmall { .. } | StopReason::NoConvergence { .. } => codes::STEP_TOO_SMALL,
        StopReason::NotFinite { .. } | StopReason::Failed { not_finite: true, .. } => codes::MOTION_NOT_FINITE,
        // The session meets events itself.
        StopReason::Event => codes::INTERRUPTED,
        StopReason::Failed { cause, .. } if is_contradiction(cause.as_ref()) => codes::CONFLICTING_CONSTRAINTS,
        StopReason::Failed { .. } => codes::PROJECTION_FAILED,
    }
}

/// Whether a drive that asks for more than can be reached ended the run, which masses have no part in.
fn is_out_of_reach(reason: &StopReason) -> bool {
    let StopReason::Failed { cause, .. } = reason else { return false };
    matches!(cause.downcast_ref(), Some(AnalysisError::OutOfReach { .. }))
}

/// Whether joints that contradict each other ended the run.
fn is_contradiction(cause: &(dyn std::error::Error + Send + Sync + 'static)) -> bool {
    use crate::analysis::AnalysisError::{Contradiction, Jammed};
    matches!(cause.downcast_ref(), Some(Contradiction { .. } | Jammed { .. }))
}
