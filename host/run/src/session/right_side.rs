//! [`RightSide`]: the equations of motion of a scene as a function of time and state, for integrators that are not ours.

use super::error::SessionError;
use super::opened::Session;
use super::prepared::Prepared;
use super::run::Run;
use crate::analysis::Group;
use crate::diagnostics::{Diagnostic, codes};
use crate::integrate::{Failure, IntegrateError, System as _};

/// y' = f(t, y) in the coordinates of a prepared scene, in SI: positions, velocities, states of elements, and last the work done by
/// whatever has no potential.
///
/// Joints that are rows hold by their accelerations; what an integrator lets drift, [`RightSide::project`] brings back. Angles that
/// count turns are followed from call to call: from one to the next, none may turn by half a turn.
pub struct RightSide {
    run: Run<'static>,
}

impl Prepared {
    /// The equations of motion of the scene, at its start.
    ///
    /// # Errors
    /// What is no function of time and state: contacts, elements with a memory or with states that change between steps only; a motion
    /// that cannot start.
    pub fn right_side(self) -> Result<RightSide, SessionError> {
        if let Some(reason) = memory(self.session()) {
            let help = "step it with `Run::advance`, which meets contacts and samples where they are due (in Python, `simulation()`)";
            let diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, reason).help(help);
            return Err(SessionError::one(&self.session().scene.source, diagnostic));
        }
        let mut run = self.start()?;
        // States come from outside, and may be off by as much as they like.
        run.system.bound_corrections(f64::INFINITY);
        Ok(RightSide { run })
    }
}

/// Why the motion of a scene depends on more than its state, if it does.
fn memory(session: &Session) -> Option<String> {
    let what = "the equations of motion are no function of time and state";
    if let Some(contact) = session.equations.contacts.first() {
        let (element, row) = session.plan.layout.element_of_row(contact.row);
        let name = session.model.elements[element].row_name(row);
        return Some(format!("{what}: the contact `{name}` closes and opens"));
    }
    if let Some(one) = session.equations.releases.first() {
        return Some(format!("{what}: `{}` lets go", session.model.elements[one.element].name));
    }
    if session.equations.switches_rows() {
        return Some(format!("{what}: rows stick and slide"));
    }
    if session.plan.layout.given_at > 0 {
        return Some(format!("{what}: elements have states that change between steps only"));
    }
    let opaque = session.model.elements.iter().find(|element| element.class.opaque)?;
    Some(format!("{what}: `{}` is opaque, and may have a memory of its own", opaque.name))
}

impl RightSide {
    /// The scene.
    #[must_use]
    pub fn session(&self) -> &Session {
        self.run.session()
    }

    /// Start and end of the scene, s.
    #[must_use]
    pub fn span(&self) -> [f64; 2] {
        [self.run.time, self.session().scene.simulation.t_end]
    }

    /// The state at the start.
    #[must_use]
    pub fn start(&self) -> &[f64] {
        &self.run.state
    }

    /// What each entry of the state is.
    #[must_use]
    pub fn groups(&self) -> &[Group] {
        self.run.system.groups()
    }

    /// f(t, y); t in s.
    ///
    /// # Errors
    /// A state of another size; equations without a finite value.
    pub fn rates(&mut self, t: f64, y: &[f64]) -> Result<Vec<f64>, SessionError> {
        self.follow(t, y)?;
        let mut rates = vec![0.0; y.len()];
        let found = self.run.system.rhs(t, y, &mut rates);
        found.map_err(|failure| self.failed(t, failure))?;
        Ok(rates)
    }

    /// The exact derivatives of f with respect to y, column by column; `None` where elements give none.
    ///
    /// # Errors
    /// As [`RightSide::rates`].
    pub fn jacobian(&mut self, t: f64, y: &[f64]) -> Result<Option<Vec<f64>>, SessionError> {
        self.follow(t, y)?;
        let n = y.len();
        let mut matrix = vec![0.0; n * n];
        let found = self.run.system.jacobian(t, y, &mut |row, column, value| matrix[row + n * column] = value);
        let exact = found.map_err(|failure| self.failed(t, failure))?;
        Ok(exact.then_some(matrix))
    }

    /// The state nearby that meets all joints, positions and velocities.
    ///
    /// # Errors
    /// As [`RightSide::rates`]; none is found.
    pub fn project(&mut self, t: f64, y: &[f64]) -> Result<Vec<f64>, SessionError> {
        self.follow(t, y)?;
        let mut nearby = y.to_vec();
        let found = self.run.system.project(t, &mut nearby);
        found.map_err(|failure| self.failed(t, failure))?;
        Ok(nearby)
    }

    /// The outputs of the scene at a state, in their units and order.
    ///
    /// # Errors
    /// As [`RightSide::rates`].
    pub fn outputs(&mut self, t: f64, y: &[f64]) -> Result<Vec<f64>, SessionError> {
        self.follow(t, y)?;
        match self.run.system.channels(t, y).map(<[f64]>::to_vec) {
            Ok(values) => {
                let channels = &self.session().model.channels;
                Ok(values.iter().zip(channels).map(|(value, channel)| value / channel.factor).collect())
            }
            Err(error) => Err(self.run.failed(error)),
        }
    }

    /// Gives an input another value from now on, in its unit.
    ///
    /// # Errors
    /// As [`Run::set_input`].
    pub fn set_input(&mut self, name: &str, value: f64) -> Result<(), SessionError> {
        self.run.set_input(name, value)
    }

    /// Lets references of angles follow, and forgets what else calls before have left.
    fn follow(&mut self, t: f64, y: &[f64]) -> Result<(), SessionError> {
        let expected = self.run.state.len();
        if y.len() != expected || !t.is_finite() || y.iter().any(|entry| !entry.is_finite()) {
            let message = format!("the state has {expected} finite numbers, and {} are given", y.len());
            return Err(self.run.refuse(Diagnostic::error(codes::OUT_OF_RANGE, message)));
        }
        let followed = self.run.system.follow_angles(t, y).and_then(|()| self.run.system.begin_anew(t, y));
        followed.map_err(|error| self.run.failed(error))
    }

    fn failed(&self, t: f64, failure: Failure) -> SessionError {
        let (Failure::Recoverable(cause)
        | Failure::NotFinite(cause)
        | Failure::Forbidden(cause)
        | Failure::Fatal(cause)) = failure;
        self.session().integration_error(&IntegrateError::System { t, cause })
    }
}
