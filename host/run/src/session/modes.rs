//! Equations for a choice of closed contacts, made where they are first needed: the same coordinates, other rows.

use super::decide::decide;
use super::error::SessionError;
use super::opened::Session;
use super::run::Run;
use super::simulation::{Jumped, Mode, Part};
use crate::analysis::{AnalysisError, Assembly, Constraints, Formulation};
use crate::diagnostics::{Diagnostic, codes};
use crate::integrate::{IntegrateError, Status, StopReason};
use crate::plan::Plan;
use crate::program::Equations;
use crate::results::significant;
use crate::scene::{Dimension, ElementRecord, Placement, Spanned};

impl Session {
    /// Refuses what unilateral rows do not go with.
    ///
    /// # Errors
    /// Names the method or the engine.
    pub(super) fn contacts_fit(&self, fixed_step: bool) -> Result<(), SessionError> {
        if let Some(latch) = self.equations.latches.first().filter(|_| fixed_step) {
            let name = &self.model.elements[latch.element].name;
            let what = match latch.releases {
                true => format!("`{name}` may be released: steps of a fixed size cannot end where a force lets go"),
                false => format!("`{name}` switches: steps of a fixed size cannot end where its memory jumps"),
            };
            let diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, what);
            return Err(SessionError::one(
                &self.scene.source,
                diagnostic.help("use a method that chooses its steps: auto"),
            ));
        }
        if !self.equations.switches_rows() {
            return Ok(());
        }
        let engine = self.scene.simulation.engine.as_ref().filter(|engine| engine.value == "reference");
        let (what, help) = match (fixed_step, engine) {
            (true, _) => (
                match self.equations.contacts.is_empty() {
                    true if self.equations.frictions.is_empty() => {
                        "steps of a fixed size cannot end where a joint lets go"
                    }
                    true => "steps of a fixed size cannot end where it begins to slide and to stick",
                    false => "steps of a fixed size cannot end where contacts close and open",
                },
                "use a method that chooses its steps: auto",
            ),
            (_, Some(_)) if self.equations.switching_rows().next().is_none() => {
                ("the engine `reference` knows no joints that let go", "use `auto`")
            }
            (_, Some(_)) if self.equations.contacts.is_empty() => {
                ("the engine `reference` knows no rows that slide", "use `auto`")
            }
            (_, Some(_)) => ("the engine `reference` knows no unilateral rows", "use `auto`"),
            _ => return Ok(()),
        };
        let first = self.equations.switching_rows().next().map(|row| self.plan.layout.element_of_row(row).0);
        let element = first.or_else(|| self.equations.releases.first().map(|one| one.element)).unwrap_or_default();
        let name = &self.model.elements[element].name;
        let is = match first {
            None => "may be released",
            Some(_) if self.equations.contacts.is_empty() => "holds up to a limit",
            Some(_) => "is unilateral",
        };
        let diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("`{name}` {is}: {what}"));
        Err(SessionError::one(&self.scene.source, diagnostic.help(help)))
    }

    /// The unilateral rows, each with its element.
    pub(super) fn contact_names(&self) -> Vec<String> {
        let rows = self.equations.contacts.iter().map(|contact| contact.row);
        rows.map(|row| self.row_name(row)).collect()
    }

    /// The joints and forces that may be released.
    pub(super) fn release_names(&self) -> Vec<String> {
        let joints = self.equations.releases.iter().map(|one| self.model.elements[one.element].name.clone());
        joints.chain(self.latch_names(true)).collect()
    }

    /// The elements whose memories jump at instants; `releases`: the forces that may be released.
    pub(super) fn latch_names(&self, releases: bool) -> Vec<String> {
        let latches = self.equations.latches.iter().filter(|latch| latch.releases == releases);
        latches.map(|latch| self.model.elements[latch.element].name.clone()).collect()
    }

    /// The rows that hold up to a limit, each with its element.
    pub(super) fn friction_names(&self) -> Vec<String> {
        let frictions = self.equations.frictions.iter();
        frictions.flat_map(|friction| &friction.rows).map(|row| self.row_name(*row)).collect()
    }

    /// Why contacts do not let a run start, with the place of the element.
    pub(super) fn bad_contact(&self, error: &AnalysisError) -> SessionError {
        let AnalysisError::Penetrates { element, row, value } = error else {
            return super::error::start_error(&self.scene, &self.model, error);
        };
        let units = &self.scene.units;
        let dimension = if self.turns_only(element, row) { Dimension::ANGLE } else { Dimension::LENGTH };
        let value = significant(units.from_si(*value, dimension), 4);
        let message = format!(
            "`{element}` is unilateral, and its row `{row}` is {value} {} at the start: on the wrong side",
            units.label(dimension)
        );
        let mut diagnostic = Diagnostic::error(codes::CANNOT_ASSEMBLE, message);
        let record = self.scene.elements.iter().find(|record| record.name.value == *element);
        if let Some(record) = record {
            diagnostic = diagnostic.at(record.name.span.clone(), "its bodies overlap, or are beyond its ends");
        }
        let one_place = |record: &ElementRecord| match &record.placement.value {
            Placement::Global { points, .. } => points.len() == 1 && record.bodies.value.len() > 1,
            _ => false,
        };
        let help = if record.is_some_and(one_place) {
            "`point` puts the frames of both bodies at one place, wherever these are: give `points`, one for each body, or `frames`; a \
             unilateral row has to be positive or zero at the start"
        } else {
            "move one of its bodies, or change its frames and sizes: a unilateral row has to be positive or zero at the start"
        };
        SessionError::one(&self.scene.source, diagnostic.help(help))
    }

    /// Whether a row of an element depends on how its bodies are turned, and not on where they are.
    fn turns_only(&self, element: &str, row: &str) -> bool {
        self.equations.rows.iter().enumerate().any(|(number, equation)| {
            let (index, k) = self.plan.layout.element_of_row(number);
            let instance = &self.model.elements[index];
            let is_it = instance.name == element && instance.row(k) == row;
            is_it && !equation.jacobian.is_empty() && equation.jacobian.iter().all(|(column, _)| column % 6 >= 3)
        })
    }

    /// The equations with these contacts closed at an assembled place, in coordinates of joints or of bodies as the run's are. The
    /// opaque elements of the model move in.
    fn mode(
        &mut self,
        closed: &[usize],
        coordinates: &str,
        place: (f64, Assembly),
        offer_jacobian: bool,
    ) -> Result<(Mode, Equations), SessionError> {
        let layout = self.plan.layout.clone();
        let equations = self.equations.in_mode(closed, &layout);
        let plan = self.decided(&equations, (place.0, &place.1))?;
        let rows =
            Constraints::of_all(&equations).map_err(|e| super::error::start_error(&self.scene, &self.model, &e))?;
        let was = (std::mem::replace(&mut self.plan, plan), self.ahead.replace(place));
        let asked = self.scene.simulation.formulation.replace(Spanned::new(coordinates.to_owned(), 0..0));
        let made = self.formulation_with(equations, offer_jacobian);
        self.scene.simulation.formulation = asked;
        (self.plan, self.ahead) = was;
        let (formulation, mut equations) = made?;
        let pressing = (!closed.is_empty()).then(|| {
            let nodes = equations.pressing(&layout);
            Part::near(formulation.as_ref(), &equations, &nodes, &layout)
        });
        Ok((Mode { closed: closed.to_vec(), formulation, rows, pressing, has_jacobian: offer_jacobian }, equations))
    }

    /// What is decided from equations at a place.
    fn decided(&self, equations: &Equations, place: (f64, &Assembly)) -> Result<Plan, SessionError> {
        let decide_with = |choice: bool| decide(&self.scene, &self.model, equations, &self.plan.layout, place, choice);
        let plan = decide_with(self.pruning.row_choice)?;
        match blind(equations, plan.redundant_rows.iter().map(|row| row.row)) {
            true => decide_with(false),
            false => Ok(plan),
        }
    }

    /// Begins where these joints have let go, by their names; those of elements that are not here are left out.
    ///
    /// # Errors
    /// A joint that the scene never releases.
    pub(super) fn begin_released(&mut self, names: &[String]) -> Result<(), SessionError> {
        let named = |k: &usize| names.contains(&self.model.elements[*k].name);
        let gone: Vec<usize> = (0..self.model.elements.len()).filter(named).collect();
        if let Some(kept) = gone.iter().find(|k| self.model.elements[**k].release.is_none()) {
            let name = &self.model.elements[*kept].name;
            let message = format!("`{name}` had let go where the run to continue from ended, and has no `release` now");
            let diagnostic = Diagnostic::error(codes::CANNOT_GO_ON, message);
            return Err(SessionError::one(&self.scene.source, diagnostic.help("give it back, or start anew")));
        }
        if gone != self.equations.released() {
            self.equations.let_go(&gone);
            self.plan = self.decided(&self.equations, (self.begins.time, &self.assembly))?;
            self.ahead = None;
        }
        Ok(())
    }

    /// The equations of motion with others in place of the session's, which come back with them.
    ///
    /// # Errors
    /// See [`Session::formulation`].
    pub(super) fn formulation_with(
        &mut self,
        equations: Equations,
        offer_jacobian: bool,
    ) -> Result<(Box<dyn Formulation>, Equations), SessionError> {
        let engine = self.engine().to_string();
        let own = std::mem::replace(&mut self.equations, equations);
        let formulation = self.formulation(&engine);
        let equations = std::mem::replace(&mut self.equations, own);
        let mut formulation = formulation?;
        if offer_jacobian {
            formulation.offer_jacobian(&equations);
        }
        Ok((formulation, equations))
    }
}

/// Whether rows that are left out may come not to hold, unseen: those on velocities are not seen by positions; and a contact that follows
/// from such rows does so in this position, not in those that they lead to.
pub(super) fn blind(equations: &Equations, mut left_out: impl Iterator<Item = usize>) -> bool {
    let is_contact = |row: usize| equations.contacts.iter().any(|contact| contact.row == row);
    let rolls = || equations.enforced().any(|row| equations.rows[row].of_velocities);
    left_out.any(|row| equations.rows[row].of_velocities || is_contact(row) && rolls())
}

impl Run<'_> {
    /// What the scene gives is seen before contacts strike at once.
    pub(super) fn sample_before_contacts(&mut self) -> Result<(), IntegrateError> {
        let due = |run: &Self| run.sample_times.get(run.system.samples()) == Some(&run.time);
        if !self.system.has_contacts() || !due(self) {
            return Ok(());
        }
        let strikes = self.system.strikes_at(self.time, &self.state);
        if strikes.map_err(|error| self.system_error(error))? {
            while due(self) {
                self.system.sample_now(self.time, &self.state)?;
                self.counters.samples += 1;
            }
        }
        Ok(())
    }

    pub(super) fn system_error(&self, error: AnalysisError) -> IntegrateError {
        IntegrateError::System { t: self.time, cause: Box::new(error) }
    }

    /// Lets contacts that touch strike, close and open, and memories jump, before the first step and where one ended for them; the run
    /// goes up to a time, s. `None`: on with the next step.
    pub(super) fn meet_contacts(&mut self, to: f64) -> Result<Option<Status>, IntegrateError> {
        match self.try_to_meet(to) {
            Ok(()) => Ok(None),
            Err(Met::Analysis(cause @ AnalysisError::Element { .. })) => {
                Err(IntegrateError::System { t: self.time, cause: Box::new(cause) })
            }
            Err(Met::Analysis(cause)) => {
                let reason = StopReason::Failed { step: 0.0, not_finite: false, cause: Box::new(cause) };
                Ok(Some(Status::StoppedEarly { t: self.time, reason }))
            }
            Err(Met::Integration(cause)) => Err(cause),
            Err(Met::Session(cause)) => Err(IntegrateError::System { t: self.time, cause: cause.to_string().into() }),
        }
    }

    fn try_to_meet(&mut self, to: f64) -> Result<(), Met> {
        let mut again = self.system.was_met_at(self.time);
        if self.system.let_jump(self.time, &mut self.state, true)? == Jumped::Stuck
            && let Some((t, state)) = self.system.behind_jump(self.time, to, &self.state)?
        {
            self.pass_jump(t, state)?;
        }
        if !self.system.has_contacts() {
            return Ok(());
        }
        loop {
            self.settle_contacts(to)?;
            if self.system.let_jump(self.time, &mut self.state, false)? == Jumped::Yes {
                continue;
            }
            let due = self.system.due_releases(self.time, &self.state, std::mem::take(&mut again))?;
            if due.is_empty() {
                return Ok(());
            }
            // What they held is taken over by others, which may let go for that.
            let mut gone = self.system.released();
            gone.extend(due.iter().map(|(element, _)| element));
            self.let_go(&gone)?;
            self.system.report_releases(self.time, &due)?;
        }
    }

    /// On at a moment later, behind a place where a signal jumps.
    fn pass_jump(&mut self, t: f64, state: Vec<f64>) -> Result<(), Met> {
        while self.sample_times.get(self.system.samples()).is_some_and(|due| *due <= t) {
            self.system.sample_now(self.time, &self.state).map_err(Met::Integration)?;
            self.counters.samples += 1;
        }
        (self.time, self.state) = (t, state);
        self.system.pass_to(t);
        self.system.let_jump(t, &mut self.state, false)?;
        Ok(())
    }

    /// Goes on without the rows of these joints, and of no others.
    fn let_go(&mut self, gone: &[usize]) -> Result<(), Met> {
        self.session.equations.let_go(gone);
        self.make_mode(&[])?;
        Ok(self.system.forget_released(&mut self.session.equations, &self.session.model)?)
    }

    /// The joints that had let go where the run was saved have done so, and no others.
    pub(super) fn be_released(&mut self, gone: &[usize]) -> Result<(), SessionError> {
        if self.system.released() == gone {
            return Ok(());
        }
        self.let_go(gone).map_err(|problem| match problem {
            Met::Analysis(error) => self.failed(error),
            Met::Session(error) => error,
            Met::Integration(error) => self.session.integration_error(&error),
        })
    }

    fn settle_contacts(&mut self, to: f64) -> Result<(), Met> {
        let t = self.time;
        let mut closed = self.system.meet((t, to), &mut self.state)?;
        self.system.want_jacobian(self.wants_jacobian());
        loop {
            if !self.system.adopt(&closed, t, &self.state)? {
                self.make_mode(&closed)?;
            }
            self.system.begin_anew(t, &self.state)?;
            self.system.bring_to_rows(t, &mut self.state)?;
            match self.system.set_levels(t, &self.state)? {
                None => return Ok(()),
                Some(pulls) => self.system.release(pulls, &mut closed),
            }
        }
    }

    /// Whether what integrates may ask for a Jacobian; while friction slides, whether it is likely to.
    fn wants_jacobian(&self) -> bool {
        self.method.may_use_jacobian() || self.while_sliding.is_some() && self.system.may_be_stiff()
    }

    fn make_mode(&mut self, closed: &[usize]) -> Result<(), Met> {
        let t = self.time;
        let state = self.system.place(&self.session.model, t, &self.state)?;
        let mut place = self.session.assembly.clone();
        (place.working, place.references, place.discrete) = (state.working, state.references, state.discrete);
        self.session.model.sets = self.system.lend_sets();
        let coordinates = if self.system.formulation().is_joint() { "joint" } else { "cartesian" };
        let made = self.session.mode(closed, coordinates, (t, place), self.wants_jacobian());
        match made {
            Ok((mode, equations)) => Ok(self.system.take_mode(mode, &equations, t, &self.state)?),
            Err(error) => {
                self.system.return_sets(std::mem::take(&mut self.session.model.sets));
                Err(Met::Session(error))
            }
        }
    }
}

/// Why contacts could not be met.
enum Met {
    Analysis(AnalysisError),
    Integration(IntegrateError),
    Session(SessionError),
}

impl From<AnalysisError> for Met {
    fn from(error: AnalysisError) -> Self {
        Self::Analysis(error)
    }
}
