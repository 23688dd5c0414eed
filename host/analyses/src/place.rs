//! [`At`]: the state of a scene that is looked at.

use crate::linear::Linear;
use crate::scene::{Dimension, UnitSystem, number_and_unit, parse_unit};
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
    /// Where a run is at this time, s.
    Seconds(f64),
}

impl At {
    /// `start`, `equilibrium`, or a number, which may have a unit of time.
    #[must_use]
    pub fn read(text: &str) -> Option<Self> {
        match text.trim() {
            "start" => Some(Self::Start),
            "equilibrium" => Some(Self::Equilibrium),
            time => match number_and_unit(time)? {
                (number, "") => Some(Self::Time(number)),
                (number, unit) => match parse_unit(unit).ok()? {
                    (Dimension::TIME, factor) => {
                        Some(number * factor).filter(|time| time.is_finite()).map(Self::Seconds)
                    }
                    _ => None,
                },
            },
        }
    }

    /// The time of a run that is meant, in the scene's unit, if one is.
    #[must_use]
    pub fn time(self, units: &UnitSystem) -> Option<f64> {
        match self {
            Self::Start | Self::Equilibrium => None,
            Self::Time(time) => Some(time),
            Self::Seconds(time) => Some(time / units.factor(Dimension::TIME)),
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
    let time = at.time(&session.scene.units);
    let mut run = session.prepare()?.start()?;
    if let Some(time) = time {
        run.advance(time)?;
    }
    let instant = run.instant()?;
    Ok(Placed { session: open()?, instant, notes: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_may_have_units() {
        let read = |text: &str| At::read(text);
        assert_eq!((read("7"), read(" 7.5e-1 ")), (Some(At::Time(7.0)), Some(At::Time(0.75))));
        assert_eq!((read("0.5 s"), read("250ms")), (Some(At::Seconds(0.5)), Some(At::Seconds(0.25))));
        assert_eq!((read("7 kg"), read("s"), read("inf"), read("begin")), (None, None, None, None));
    }
}
