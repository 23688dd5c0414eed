//! Whether the audit lets the results of a run pass.

use super::decide::determinacy;
use super::opened::Session;
use super::options::DEFAULT_METHOD;
use super::prepared::JUMP;
use super::restart::Restart;
use super::samplings::Samplings;
use super::savings::plural;
use crate::analysis::Assembly;
use crate::diagnostics::{Code, codes};
use crate::model::{Axes, Channel, MAGNITUDE, Quantity, operations_behind, rows};
use crate::results::{
    Audit, AuditLimits, Event, EventKind, Excess, Measure, Released, Remedy, ResultsError, Status, Summary, significant,
};
use crate::scene::{AuditTolerance, Dimension};
use element_api::descriptor::Kind;
use element_api::recording::Op;

/// Bodies that move by less than this share of the scene's size, or of a free fall, during a run are at rest.
const AT_REST: f64 = 1e-9;
/// Steps that differ by this share are the same.
const SAME_STEP: f64 = 1e-9;
/// Name of the method whose steps have no fixed size, but a largest one.
const KINEMATIC: &str = "kinematic";

impl Session {
    /// What the audit may find: as asked for, else what belongs to the tolerance; `None` where it is not to be judged.
    pub(super) fn audit_limits(&self) -> Option<AuditLimits> {
        match self.options.audit_tolerance.or(self.scene.simulation.audit_tolerance) {
            Some(AuditTolerance::None) => None,
            Some(AuditTolerance::Limit(limit)) => Some(AuditLimits::all(limit)),
            None => Some(AuditLimits::belonging_to(self.tolerance(), self.has_fixed_steps())),
        }
    }

    /// Whether steps have a fixed size, so that nothing controls their errors.
    pub(super) fn has_fixed_steps(&self) -> bool {
        let name = self.scene.simulation.method.as_ref().map_or(DEFAULT_METHOD, |method| method.value.as_str());
        let needs_step = || self.options.methods.make(name).is_some_and(|method| method.needs_fixed_step());
        self.scene.simulation.fixed_step.is_some() || needs_step()
    }

    /// Notes in the summary what the audit found beyond its limits.
    pub(super) fn judge(&self, summary: &mut Summary) {
        let audit = summary.audit;
        self.judge_by(summary, &|excess| self.blamed(excess.measure, &audit));
    }

    /// The same where islands were integrated apart: each numbers its rows and bodies by itself.
    pub(super) fn judge_apart(&self, summary: &mut Summary, islands: &[(Self, Summary)]) {
        self.judge_by(summary, &|excess| {
            let of: fn(&Audit) -> f64 = match excess.measure {
                Measure::Position => |audit| audit.position_violation,
                Measure::Velocity => |audit| audit.velocity_violation,
                Measure::Loads => |audit| audit.load_imbalance,
                Measure::Energy | Measure::SampleEnergy => return None,
            };
            let found = |part: &Summary| of(&part.audit).total_cmp(&excess.found).is_eq();
            let (session, part) = islands.iter().find(|(_, part)| found(part))?;
            session.blamed(excess.measure, &part.audit)
        });
    }

    /// Notes outputs of reactions that are not unique, as far as this is seen only while the scene runs, and a motion that depends on
    /// such reactions; `end`: the state at the end, where there is one.
    pub(super) fn judge_reactions(
        &self,
        summary: &mut Summary,
        samplings: &mut Samplings,
        end: Option<&Restart>,
    ) -> Result<(), ResultsError> {
        let turned = end.map_or(Ok(()), |end| self.judge_directions(summary, samplings, end));
        turned.and(self.judge_contacts(summary, samplings))
    }

    /// Notes outputs along directions into which bodies have turned what redundant rows leave open.
    fn judge_directions(
        &self,
        summary: &mut Summary,
        samplings: &mut Samplings,
        end: &Restart,
    ) -> Result<(), ResultsError> {
        let is_load = |channel: &Channel| matches!(channel.quantity, Quantity::Load { .. });
        if self.plan.redundant_rows.is_empty() || !self.model.channels.iter().any(is_load) {
            return Ok(());
        }
        let place = Assembly {
            working: end.working.clone(),
            references: end.references.clone(),
            discrete: end.discrete.clone(),
            ..self.assembly.clone()
        };
        let (scene, layout) = (&self.scene, &self.plan.layout);
        let Ok(there) = determinacy(scene, &self.model, &self.equations, layout, (end.time, &place)) else {
            return Ok(());
        };
        let mut plan = self.plan.clone();
        plan.join(&there);
        let mut outputs = Vec::new();
        for (info, channel) in samplings.channels.iter_mut().zip(&self.model.channels) {
            if info.unique && !self.is_unique(channel, &plan) {
                info.unique = false;
                outputs.push(info.name.clone());
            }
        }
        if outputs.is_empty() {
            return Ok(());
        }
        summary.not_unique.append(&mut outputs);
        samplings.write_channels(&self.scene.units)
    }

    /// Notes what contacts left open: outputs that are not unique, and a motion that depends on such reactions.
    fn judge_contacts(&self, summary: &mut Summary, samplings: &mut Samplings) -> Result<(), ResultsError> {
        if !self.equations.has_events() {
            return Ok(());
        }
        let unit = self.scene.units.factor(Dimension::TIME);
        let events = samplings.events.all()?;
        let released = Event::first(&events, EventKind::Releases).into_iter();
        summary.releases = released.map(|([joint, by], time)| Released { joint, time: time / unit, by }).collect();
        summary.releases.sort_by(|a, b| a.time.total_cmp(&b.time));
        let creeps = Event::first(&events, EventKind::Creeps);
        if let Some(first) = creeps.iter().map(|(_, time)| *time).reduce(f64::min) {
            let names: Vec<String> = creeps.into_iter().map(|([name, _], _)| format!("`{name}`")).collect();
            summary.warnings.push(format!(
                "{}: friction of {} sticks and slides over and over without getting anywhere (from t = {} {} on): it creeps instead, \
                 by no more than errors of velocities",
                codes::FRICTION_CREEPS,
                names.join(", "),
                significant(first / unit, 6),
                self.scene.units.label(Dimension::TIME),
            ));
        }
        let open = Event::first(&events, EventKind::Indeterminate);
        // When the first of these parts of a load was open; all where no part is named.
        let since = |element: usize, part: Option<&str>| {
            let is_it = |[name, row]: &[String; 2]| {
                *name == self.model.elements[element].name && part.is_none_or(|part| row.starts_with(part))
            };
            open.iter().filter(|(names, _)| is_it(names)).map(|(_, time)| *time).reduce(f64::min)
        };
        let (mut outputs, mut from) = (Vec::new(), f64::INFINITY);
        for (info, channel) in samplings.channels.iter_mut().zip(&self.model.channels) {
            let Quantity::Load { element, torque, axes, component, .. } = &channel.quantity else { continue };
            let part = match (torque, axes) {
                (true, _) => "torque",
                (false, Axes::Ground) if *component < MAGNITUDE => ["force x", "force y", "force z"][*component],
                (false, _) => "force",
            };
            if let Some(time) = since(*element, Some(part))
                && info.unique
            {
                info.unique = false;
                outputs.push(info.name.clone());
                from = from.min(time);
            }
        }
        let units = &self.scene.units;
        let at = |time: f64| {
            format!("t = {} {}", significant(time / units.factor(Dimension::TIME), 6), units.label(Dimension::TIME))
        };
        let in_quotes = |names: &[String]| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        if !outputs.is_empty() {
            samplings.write_channels(units)?;
            summary.warnings.push(format!(
                "{}: more contacts are closed from {} on than rigid bodies determine the loads of: {} not unique; sums over the \
                 contacts are",
                codes::REACTIONS_NOT_UNIQUE,
                at(from),
                in_quotes(&outputs)
            ));
            summary.not_unique.append(&mut outputs);
        }
        if summary.audit_limits.is_none() {
            return Ok(());
        }
        let moved = Event::first(&events, EventKind::Ambiguous).into_iter();
        let mut moved: Vec<(String, f64)> = moved.map(|([name, _], time)| (name, time)).collect();
        for element in self.model.elements.iter().filter(|element| element.class.kind == Kind::Force) {
            let since = element.joints.iter().filter_map(|joint| since(*joint, None)).reduce(f64::min);
            moved.extend(since.map(|time| (element.name.clone(), time)));
        }
        if let Some(time) = moved.iter().map(|(_, time)| *time).reduce(f64::min) {
            let mut names: Vec<String> = Vec::new();
            for (name, _) in moved {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
            let reason = format!(
                "loads of {} depend on reactions of contacts that rigid bodies do not determine (from {} on), and the motion with them, or \
                 it is one of several that contacts at rest allow: one of many is computed; let three points carry instead of four, or give the \
                 contacts stiffness (`bump-stop`)",
                in_quotes(&names),
                at(time)
            );
            summary.suspect(codes::REACTION_NOT_UNIQUE, &reason);
        }
        Ok(())
    }

    /// Notes outputs with values that are not finite: the motion does not depend on them, and whoever reads the table does.
    pub(super) fn judge_outputs(&self, summary: &mut Summary, samplings: &Samplings) {
        let unit = self.scene.units.label(Dimension::TIME);
        for (channel, column) in samplings.channels.iter().zip(&samplings.columns) {
            let Some(first) = column.iter().position(|value| !value.is_finite()) else { continue };
            let (count, all) = (column.iter().filter(|value| !value.is_finite()).count(), column.len());
            let at = significant(samplings.taken[first], 6);
            let reason = format!(
                "the output `{}` is not a finite number in {count} of {all} rows, first at t = {at} {unit}",
                channel.name
            );
            match summary.audit_limits {
                Some(_) => summary.suspect(codes::OUTPUT_NOT_FINITE, &reason),
                None => summary.warnings.push(format!("{}: {reason}", codes::OUTPUT_NOT_FINITE)),
            }
        }
    }

    /// Warns of a scene that stood still all the time, though something may move. The status stays.
    pub(super) fn warn_of_rest(&self, summary: &mut Summary) {
        let moves = |channel: &Channel| !matches!(channel.quantity, Quantity::Value { .. } | Quantity::Given { .. });
        let asked = self.scene.simulation.start.is_none()
            && self.scene.verification.as_ref().is_none_or(|verification| verification.analysis.is_none())
            && self.model.channels.iter().any(moves);
        let free = self.plan.mobility > 0 && !self.equations.has_events();
        let Some(energy) = summary.audit.largest_kinetic_energy() else { return };
        let duration = self.scene.simulation.t_end - self.begins.time;
        // In a short run even what falls freely goes less far than a small share of a large scene.
        let gravity = self.model.gravity.norm();
        let falls = if gravity > 0.0 { gravity * duration } else { f64::INFINITY };
        let slow = AT_REST * falls.min(self.assembly.scales.length / duration);
        let mass: f64 = self.model.bodies.iter().map(|body| body.mass).sum();
        if summary.status == Status::Completed && asked && free && energy <= mass * slow * slow {
            let freedoms = plural(self.plan.mobility, "freedom", "freedoms");
            let gravity = if gravity == 0.0 {
                "`gravity` is not given: give it,"
            } else {
                "check the directions of axes and of gravity, or give"
            };
            summary.warnings.push(format!(
                "{}: nothing moved in all the time, though the joints leave {freedoms}: no load acts along what may move; {gravity} loads or \
                 velocities at the start",
                codes::NOTHING_MOVED
            ));
        }
    }

    /// Warns where steps were not as long as the scene asks for: equal ones of that size do not fill the run. The status stays.
    pub(super) fn warn_of_step(&self, summary: &mut Summary) {
        let Some(asked) = self.scene.simulation.fixed_step else { return };
        let unit = self.scene.units.factor(Dimension::TIME);
        let taken = (summary.t_end_reached * unit - self.begins.sampled_from) / summary.steps as f64;
        // Islands that run apart count their steps together; determined motions have no fixed size, but a largest one.
        let counts = summary.status == Status::Completed && summary.islands.is_empty() && summary.method != KINEMATIC;
        if counts && (taken - asked).abs() > SAME_STEP * asked {
            let time = |t: f64| format!("{} {}", significant(t / unit, 6), self.scene.units.label(Dimension::TIME));
            summary.warnings.push(format!(
                "{}: {} of {} on average, not of {}: equal steps end with the run, at each checkpoint, and where elements sample",
                codes::OTHER_STEP,
                plural(summary.steps as usize, "step was taken,", "steps were taken,"),
                time(taken),
                time(asked)
            ));
        }
    }

    /// The row, or the body, where a measure of this scene's audit is worst.
    fn blamed(&self, measure: Measure, audit: &Audit) -> Option<String> {
        match measure {
            Measure::Position => audit.worst_rows()[0].map(|row| self.row_name(row)),
            Measure::Velocity => audit.worst_rows()[1].map(|row| self.row_name(row)),
            Measure::Loads => audit.worst_body().map(|body| self.model.bodies[body].name.clone()),
            Measure::Energy | Measure::SampleEnergy => None,
        }
    }

    fn judge_by(&self, summary: &mut Summary, name: &dyn Fn(&Excess) -> Option<String>) {
        let unit = summary.time_unit.clone();
        let passed: Vec<String> = summary.elements.iter().flat_map(|one| one.passed_ends(&unit)).collect();
        for reason in passed {
            match summary.audit_limits {
                Some(_) => summary.suspect(codes::CURVE_PASSED, &reason),
                None => summary.warnings.push(format!("{}: {reason}", codes::CURVE_PASSED)),
            }
        }
        let beyond = summary.audit_limits.map(|limits| summary.audit.beyond(&limits)).unwrap_or_default();
        for (k, excess) in beyond.iter().enumerate() {
            // One advice is enough: what helps against the worst may well help against the others.
            let advice = if k == 0 { format!("; {}", self.advice(excess)) } else { String::new() };
            summary.suspect(code(excess.measure), &format!("{}{advice}", self.finding(excess, name(excess))));
        }
        if summary.audit_limits.is_some() {
            for open in self.plan.undetermined.iter().filter(|open| open.load) {
                let what = match self.model.elements[open.element].class.kind {
                    Kind::Joint => "release",
                    Kind::Force | Kind::Control => "load",
                };
                let reason = format!(
                    "the {what} of `{}` depends on a reaction that rigid bodies do not determine, and the motion with it: other \
                     coordinates compute another of many motions; free redundant rows with less restrictive joints (`odyn check`)",
                    self.model.elements[open.element].name
                );
                summary.suspect(codes::REACTION_NOT_UNIQUE, &reason);
            }
        }
        let missed = summary.recoveries[Remedy::Missed];
        if missed > 0 && summary.audit_limits.is_some() {
            let steps = if missed == 1 { "1 step".into() } else { format!("{missed} steps") };
            let reason = format!(
                "in {steps} of a fixed size a contact came and went, a pulse passed or an angle turned too far unseen; try smaller steps (`fixed_step`) or a \
                 method that chooses them (`--method dop853`)"
            );
            summary.suspect(codes::MISSED_WITHIN_STEP, &reason);
        }
    }

    /// Joint and row.
    pub(super) fn row_name(&self, row: usize) -> String {
        let (element, k) = self.plan.layout.element_of_row(row);
        self.model.elements[element].row_name(k)
    }

    /// What was found, when and where.
    fn finding(&self, excess: &Excess, blamed: Option<String>) -> String {
        let what = match excess.measure {
            Measure::Position => "constraints are violated by",
            Measure::Velocity => "rates of constraints are violated by",
            Measure::Energy => "the balance of energies is off by",
            Measure::SampleEnergy => "in the table, the balance of energies is off by",
            Measure::Loads => "in the table, the balance of loads is off by",
        };
        let of = match excess.measure {
            Measure::Position => "of the size of the scene",
            Measure::Velocity => "of the largest speed",
            Measure::Energy | Measure::SampleEnergy => "of the largest energy that moved",
            Measure::Loads => "of its own loads",
        };
        let [found, limit] = [excess.found, excess.limit].map(|number| significant(number, 2));
        let units = &self.scene.units;
        let at = significant(excess.at / units.factor(Dimension::TIME), 6);
        let blamed = blamed.map_or_else(String::new, |name| format!(" in {name}"));
        format!("{what} {found} {of}{blamed} (t = {at} {}), more than {limit}", units.label(Dimension::TIME))
    }

    /// Where velocities were turned at a kink of a row, with the advice; `None` where they were not.
    pub(super) fn turned(&self, audit: &Audit) -> Option<String> {
        let beyond = audit.beyond(&AuditLimits::all(JUMP));
        let excess = beyond.iter().find(|excess| excess.measure == Measure::Velocity && !self.has_fixed_steps())?;
        Some(format!("{}; {}", self.finding(excess, self.blamed(excess.measure, audit)), self.advice(excess)))
    }

    /// Whether something in the equations of a row may have a corner: a choice, a table, a root where its argument is zero.
    fn may_have_kinks(&self, row: usize) -> bool {
        let instance = &self.model.elements[self.plan.layout.element_of_row(row).0];
        let kinked = |(_, op): &(u32, Op)| {
            matches!(op, Op::Sqrt(_) | Op::Powf(..) | Op::Atan2(..) | Op::Select(..) | Op::Table(..))
        };
        operations_behind(&instance.recording, rows(&instance.recording)).iter().any(kinked)
    }

    /// What a user may try.
    fn advice(&self, excess: &Excess) -> String {
        if excess.measure == Measure::Loads {
            return "try other coordinates (`--formulation cartesian` or `joint`) or another solver (`--engine reference`), and \
                    examine masses and lengths that differ by many decades"
                .into();
        }
        let is_contact = excess.row.is_some_and(|row| self.equations.contacts.iter().any(|contact| contact.row == row));
        if excess.measure == Measure::Velocity && excess.found > JUMP && is_contact {
            return "a drive presses bodies together there that cannot give way; move the drive less far, give it a limit (a servo, an \
                    actuator), or give the contact a stiffness (`bump-stop`)"
                .into();
        }
        let turned = excess.measure == Measure::Velocity && excess.found > JUMP && !self.has_fixed_steps();
        if turned && excess.row.is_some_and(|row| !self.may_have_kinks(row)) {
            return "velocities are turned at once there, without the impact that this would be, and nothing in the equations of this joint has a \
                    corner: the mechanism passes a singular position (it is stretched, or a joint is bent to its end), or the derivatives that \
                    the joint's library gives are not those of its rows (`odyn plugin check`)"
                .into();
        }
        if turned {
            return "it has a kink there: a function or a curve with a corner (`min`, `max`, `abs`), or points that it measures between and \
                    that meet. Velocities are turned at once, without the impact that this would be; round the corner off \
                    (`servo-rotation` and `servo-displacement` do that), or keep the points apart"
                .into();
        }
        let energy = matches!(excess.measure, Measure::Energy | Measure::SampleEnergy);
        let also = match energy {
            true if self.determined => {
                "; if nothing changes it, look for a kink in what drives the motion (`min`, `max`, `abs`, a table's last point), at which \
                 velocities are turned without the impact that this would be, and examine the elements (`odyn plugin check`)"
            }
            true => "; if nothing changes it, examine the elements (`odyn plugin check`)",
            false if !self.plan.redundant_rows.is_empty() => {
                "; if nothing changes it, rows that follow from others (`odyn check`) do so at the start only: axes of a planar mechanism \
                 must be parallel to nine digits, and sides of a parallelogram as equal"
            }
            false => "",
        };
        if self.has_fixed_steps() {
            return format!("try smaller steps (`fixed_step`) or a method that chooses them (`--method dop853`){also}");
        }
        let tolerance = significant(self.tolerance() / 100.0, 2);
        let method = match self.scene.simulation.method.as_ref().map(|method| method.value.as_str()) {
            Some("radau5" | "radau9") => DEFAULT_METHOD,
            _ => "radau5",
        };
        format!(
            "try smaller steps (`max_step`), a smaller tolerance (`--tol {tolerance}`), another method (`--method {method}`) or \
             `--verify`{also}"
        )
    }
}

fn code(measure: Measure) -> Code {
    match measure {
        Measure::Position | Measure::Velocity => codes::AUDIT_CONSTRAINTS,
        Measure::Energy => codes::AUDIT_ENERGY,
        Measure::SampleEnergy => codes::AUDIT_SAMPLES,
        Measure::Loads => codes::AUDIT_LOADS,
    }
}
