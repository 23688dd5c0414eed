//! [`At`]: the state of a scene that is looked at.

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

/// A scene, and the instant at which it is to be looked at. `open` gives the scene: twice where it has to run first, since a run takes
/// what it runs.
///
/// # Errors
/// Those of `open`; no equilibrium; a run that does not get there.
pub fn place(
    open: &dyn Fn() -> Result<Session, SessionError>,
    at: At,
    progress: &mut dyn FnMut(f64),
) -> Result<(Session, Instant), SessionError> {
    let session = open()?;
    if at == At::Equilibrium {
        let found = statics::equilibrium(&session, progress)?;
        return Ok((session, found.instant));
    }
    let mut run = session.prepare()?.start()?;
    if let At::Time(time) = at {
        run.advance(time)?;
    }
    let instant = run.instant()?;
    Ok((open()?, instant))
}
