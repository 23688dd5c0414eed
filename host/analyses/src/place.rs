//! [`At`]: the state of a scene that is looked at.

use crate::linear::Linear;
use crate::session::{Instant, Session, SessionError};
use crate::statics;

/// Which state of a scene is looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum At {
    /// Where it starts.
    #[default]
    Start,
    /// The equilibrium that [`statics::equilibrium`] finds.
    Equilibrium,
    /// Where a run is at this time, in the scene's unit.
    Time(f64),
}

impl At {
    /// `start`, `equilibrium`, or a number.
    #[must_use]
    pub fn read(text: &str) -> Option<Self> {
        match text.trim() {
            "start" => Some(Self::Start),
            "equilibrium" => Some(Self::Equilibrium),
            number => number.parse().ok().filter(|time: &f64| time.is_finite()).map(Self::Time),
        }
    }
}

/// A scene, and the instant at which it is to be looked at.
pub struct Placed {
    /// The scene.
    pub session: Session,
    /// The instant.
    pub instant: Instant,
    /// What is to be known of that place: what friction does at an equilibrium, and which elements are used beyond what they are made for.
    pub notes: Vec<String>,
}

impl Placed {
    /// The scene linearised there, with these notes beside its own.
    ///
    /// # Errors
    /// As [`Linear::at`].
    pub fn linear(&self, inputs: Option<&[String]>, outputs: Option<&[String]>) -> Result<Linear, SessionError> {
        let mut linear = Linear::at(&self.session, &self.instant, inputs, outputs)?;
        linear.notes.extend_from_slice(&self.notes);
        Ok(linear)
    }
}

/// A scene at the state that is asked for. `open` gives the scene: twice where it has to run first, since a run takes
/// what it runs.
///
/// # Errors
/// Those of `open`; no equilibrium; a run that does not get there.
pub fn place(
    open: &dyn Fn() -> Result<Session, SessionError>,
    at: At,
    progress: &mut dyn FnMut(f64),
) -> Result<Placed, SessionError> {
    let session = open()?;
    if at == At::Equilibrium {
        let found = statics::equilibrium(&session, progress)?;
        return Ok(Placed { session, instant: found.instant, notes: found.notes });
    }
    let mut run = session.prepare()?.start()?;
    if let At::Time(time) = at {
        run.advance(time)?;
    }
    let instant = run.instant()?;
    Ok(Placed { session: open()?, instant, notes: Vec::new() })
}
