//! [`Crew`]: what is integrated side by side, the scene as a whole or its islands, from one time to another.

use std::time::Instant;

use super::error::SessionError;
use super::islands::{Islands, islands_leg};
use super::leg::{Leg, LegEnd, Told};
use super::opened::Session;
use super::prepared::Prepared;
use super::samplings::Rows;
use crate::results::Summary;

/// See the module documentation.
pub(super) enum Crew {
    /// All takes common steps.
    Whole(Box<Prepared>),
    /// Islands, each with steps of its own.
    Apart(Box<Islands>),
}

impl Crew {
    /// Prepares a scene as it asks to be integrated.
    ///
    /// # Errors
    /// As for [`Session::prepare`].
    pub(super) fn new(session: Session) -> Result<Self, SessionError> {
        Ok(match session.runs_apart() {
            true => Self::Apart(Box::new(session.prepare_islands()?)),
            false => Self::Whole(Box::new(session.prepare()?)),
        })
    }

    /// The scene as a whole.
    pub(super) fn session(&self) -> &Session {
        match self {
            Self::Whole(prepared) => &prepared.session,
            Self::Apart(islands) => &islands.whole,
        }
    }

    /// What is known before the first step.
    pub(super) fn summary(&self) -> Summary {
        match self {
            Self::Whole(prepared) => prepared.session.summary(prepared.method(), prepared.formulation()),
            Self::Apart(islands) => islands.summary(),
        }
    }

    /// Integrates a leg. `summary` is what is known before it; preparations began at `since`.
    ///
    /// # Errors
    /// Where the motion cannot start, or machine code is asked for and cannot be had.
    pub(super) fn go(self, leg: Leg, summary: Summary, since: Instant, told: Told<'_>) -> Result<LegEnd, SessionError> {
        match self {
            Self::Whole(prepared) => whole_leg(*prepared, leg, summary, since, told),
            Self::Apart(islands) => islands_leg(*islands, leg, summary, since, told),
        }
    }
}

fn whole_leg(
    prepared: Prepared,
    leg: Leg,
    mut summary: Summary,
    since: Instant,
    mut told: Told<'_>,
) -> Result<LegEnd, SessionError> {
    let to = leg.to;
    let goes_on = leg.carried.is_some();
    let mut run = prepared.begin(Rows::Sent(Box::new(&mut told)), leg)?;
    run.watch_start()?;
    summary.compile_time_s += since.elapsed().as_secs_f64();
    run.go_to(to);
    summary.t_end_reached = run.time();
    let (session, ended, rows) = run.into_ended(to);
    drop(rows);
    session.note_work(&mut summary, &ended, goes_on);
    let failed = session.conclude(&mut summary, ended.outcome, &mut told.samplings.error);
    Ok(LegEnd { session, summary, failed, state: ended.state, carried: Some(ended.carried), islands: Vec::new() })
}
