//! Equilibria: where a scene stays if it is let go from rest.
//!
//! The way there is that of a scene without inertia in a thick fluid: M x' = N^T Q in the motions N that the rows allow, taken in
//! implicit steps whose size grows as loads come to balance, until they are Newton's (pseudo-transient continuation, Kelley & Keyes
//! 1998). A step that loads oppose at its end is taken again, shorter: so it goes down in energy where there is one, and away from
//! saddles. Element states go to where their rates are zero at the same time. What is found is judged by its own equations.
//!
//! Friction that can stick holds where the scene puts it, as far as its limits go (`friction.rs`); what does not hold is taken as none.

mod audit;
mod friction;
mod places;
mod search;
mod step;

use std::collections::VecDeque;

use nalgebra::Vector3;
use serde::Serialize;

use crate::analysis::{Evaluator, start_inputs};
use crate::diagnostics::{Diagnostic, codes};
use crate::linear::{Linear, Port, check_elements, refuse};
use crate::model::{WatchedValue, rotation};
use crate::modes::{Modes, Stability};
use crate::moves;
use crate::session::{Instant, Restart, Session, SessionError};
pub use friction::Held;
use search::{Place, Search};

/// Two equilibria are one where no body differs by more than this share of the scene's size, or by that angle.
const SAME: f64 = 1e-6;

/// Elements beyond what they are made for that are named.
const MOST_BEYOND: usize = 3;

/// How well an equilibrium meets its equations.
#[derive(Debug, Clone, Serialize)]
pub struct Audit {
    /// Largest force or moment that is left on a body, as a share of the loads on it or of what round-off of its place leaves.
    pub balance: f64,
    /// The body.
    pub body: String,
    /// Largest violation of a row, as a share of the scene's size.
    pub rows: f64,
    /// Largest rate of an element state, 1/s and its unit.
    pub states: f64,
}

/// Where a body is.
#[derive(Debug, Clone, Serialize)]
pub struct Pose {
    /// Its name.
    pub body: String,
    /// The origin of the body frame, m, ground axes, as a scene gives it.
    pub position: [f64; 3],
    /// Euler parameters body -> ground, scalar first.
    pub orientation: [f64; 4],
}

/// An equilibrium.
#[derive(Debug, Clone, Serialize)]
pub struct Equilibrium {
    /// s: what is prescribed is held as at this time.
    pub time: f64,
    /// What the eigenvalues of small motions say.
    pub stability: Stability,
    /// Steps taken.
    pub steps: usize,
    /// How well it is met.
    pub audit: Audit,
    /// Where the bodies are.
    pub bodies: Vec<Pose>,
    /// The outputs of the scene.
    pub outputs: Vec<Port>,
    /// Rows whose reactions rigid bodies do not determine, because rows are redundant.
    pub not_unique: Vec<String>,
    /// Unilateral rows that are closed.
    pub closed: Vec<String>,
    /// Frictions that stick, with the share of their limits that this takes, and those that do not hold the scene where it stands.
    pub friction: Vec<Held>,
    /// Small motions about it: neutral directions say which bodies float.
    pub modes: Modes,
    /// From which of the starts; 0 is the scene's own.
    pub start: usize,
    /// What is to be known of the place, besides its small motions. Among the notes of [`Equilibrium::modes`], too.
    #[serde(skip)]
    pub notes: Vec<String>,
    /// The same as the equations see it.
    #[serde(skip)]
    pub instant: Instant,
}

impl Equilibrium {
    /// The state, to continue from.
    #[must_use]
    pub fn restart(&self, session: &Session) -> Restart {
        moves::restart(session, &self.instant.inputs)
    }
}

/// Equilibria that were found, and why there are not more.
#[derive(Debug, Clone, Serialize)]
pub struct Equilibria {
    /// Each once.
    pub found: Vec<Equilibrium>,
    /// Starts that led nowhere, with the reason.
    pub failed: Vec<String>,
    /// Starts in all.
    pub starts: usize,
}

/// The equilibrium nearest downhill from where a scene starts, at its start time.
///
/// # Errors
/// Opaque elements; no equilibrium that was found, with the cause.
pub fn equilibrium(session: &Session, progress: &mut dyn FnMut(f64)) -> Result<Equilibrium, SessionError> {
    let mut search = prepare(session)?;
    let place = search.from(&given(session), true, progress).map_err(|reason| not_found(session, &reason))?;
    settle(session, &search, place, 0)
}

/// The equilibrium as a place to start from, for [`crate::session::RunOptions::equilibrium`]; a warning where it is unstable.
///
/// # Errors
/// As [`equilibrium`].
pub fn start(session: &Session) -> Result<(Restart, Vec<Diagnostic>), SessionError> {
    let found = equilibrium(session, &mut |_| ())?;
    let mut notes = Vec::new();
    if found.stability == Stability::Unstable {
        let message = "the run starts at an unstable equilibrium: round-off decides when and which way it leaves";
        let help = "`odyn statics --all 20` looks for others; a velocity at the start says which way it leaves";
        let word = session.scene.simulation.start.as_ref();
        let place = word.map_or(0..0, |word| word.span.clone());
        notes.push(Diagnostic::warning(codes::UNSTABLE_START, message).at(place, "").help(help));
    }
    Ok((found.restart(session), notes))
}

/// Equilibria from the scene's start and from others: beside those that were found unstable, along what grows there, and every third
/// drawn at random among what the joints allow.
///
/// # Errors
/// As [`equilibrium`]; that none of the starts led to one.
pub fn equilibria(session: &Session, starts: usize, progress: &mut dyn FnMut(f64)) -> Result<Equilibria, SessionError> {
    let mut search = prepare(session)?;
    let mut all = Equilibria { found: Vec::new(), failed: Vec::new(), starts: starts.max(1) };
    let layout = &session.plan.layout;
    let length = session.assembly.scales.length;
    let mut beside: VecDeque<Vec<f64>> = VecDeque::new();
    for number in 0..starts.max(1) {
        progress(number as f64 / starts.max(1) as f64);
        let begin = given(session);
        let begin = match if number % 3 == 0 { None } else { beside.pop_front() } {
            _ if number == 0 => Ok(begin),
            Some(start) => Ok(start),
            None => search.elsewhere(&begin, number as u64),
        };
        let place = begin.and_then(|begin| search.from(&begin, number == 0, &mut |_| ()));
        let place = match place {
            Ok(place) => place,
            Err(reason) => {
                all.failed.push(format!("start {number}: {reason}"));
                continue;
            }
        };
        let same = |other: &Equilibrium| {
            (0..layout.bodies).all(|body| {
                let (a, b) =
                    (&place.inputs[layout.body_slot(body, 0)..], &other.instant.inputs[layout.body_slot(body, 0)..]);
                let apart = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
                let along: f64 = (3..7).map(|k| a[k] * b[k]).sum();
                apart <= SAME * length && 2.0 * (1.0 - along.abs()).max(0.0).sqrt() <= SAME * 10.0
            })
        };
        if !all.found.iter().any(same) {
            let found = settle(session, &search, place, number)?;
            if found.stability == Stability::Unstable {
                beside.extend(search.beside(&found));
            }
            all.found.push(found);
        }
    }
    match all.failed.first().filter(|_| all.found.is_empty()) {
        Some(reason) => Err(not_found(session, reason)),
        None => Ok(all),
    }
}

fn given(session: &Session) -> Vec<f64> {
    start_inputs(&session.plan.layout, session.time_of_start(), &session.assembly)
}

fn prepare(session: &Session) -> Result<Search<'_>, SessionError> {
    check_elements(session, "equilibria")?;
    Ok(Search::new(session))
}

fn not_found(session: &Session, reason: &str) -> SessionError {
    let help = "change the start of the bodies, add what holds them, or look at a run with dampers; `--all 20` tries other starts";
    refuse(session, Diagnostic::error(codes::NO_EQUILIBRIUM, format!("no equilibrium was found: {reason}")).help(help))
}

/// What friction does.
fn say_friction(session: &Session, closed: &[usize], friction: &[Held], notes: &mut Vec<String>) {
    // There is none at contacts that are open.
    if session.equations.frictions.iter().all(|one| one.contact.is_some_and(|contact| !closed.contains(&contact))) {
        return;
    }
    let list = |holds: bool| -> Vec<String> {
        let own = friction.iter().filter(|one| one.holds == holds);
        let percent = |one: &Held| match (one.share.is_finite(), holds) {
            (true, true) => format!("{} ({:.1} % of its limit)", one.name, 100.0 * one.share),
            (true, false) => format!("{} ({:.4} times its limit)", one.name, one.share),
            _ => format!("{} (nothing presses)", one.name),
        };
        own.map(percent).collect()
    };
    let (held, overcome) = (list(true), list(false));
    if !held.is_empty() {
        notes.push(format!(
            "friction holds the scene where it stands: {}; small motions are those of what it leaves, and places next to this rest as well",
            held.join(", ")
        ));
    }
    if !overcome.is_empty() {
        notes.push(format!(
            "friction cannot hold the scene where it stands, and is taken as none here: {}; with it the scene rests in a range of places around this",
            overcome.join(", ")
        ));
    }
    if held.is_empty() && overcome.is_empty() {
        notes.push(
            "friction that could stick is taken as none: with it the scene rests in a range of places around this"
                .into(),
        );
    }
}

/// Elements that are used beyond what they are made for, as a run warns of (ODY0750).
fn beyond(session: &Session, instant: &Instant) -> Result<Vec<String>, SessionError> {
    let (model, equations) = (&session.model, &session.equations);
    let checks = model.watched().into_iter().filter_map(|one| match one.value {
        WatchedValue::Check(k) => Some((equations.watched(&one), &model.elements[one.element], k)),
        _ => None,
    });
    let (nodes, named): (Vec<_>, Vec<_>) = checks.map(|(node, element, k)| (node, (element, k))).unzip();
    let mut margins = Evaluator::new(&equations.graph, &nodes);
    let margins = margins.run(&instant.inputs, &model.sets);
    let margins = margins.map_err(|error| not_found(session, &error.to_string()))?;
    let failed = named.iter().zip(margins).filter(|(_, margin)| **margin < 0.0);
    let mut notes: Vec<String> =
        failed.map(|((element, k), _)| format!("`{}` {}", element.name, element.class.checks[*k].doc)).collect();
    let more = notes.len().saturating_sub(MOST_BEYOND);
    notes.truncate(MOST_BEYOND);
    notes.extend((more > 0).then(|| format!("{more} more elements are used beyond what they are made for")));
    Ok(notes)
}

/// Everything that is reported of a place of balance.
fn settle(session: &Session, search: &Search<'_>, place: Place, number: usize) -> Result<Equilibrium, SessionError> {
    let Place { inputs, closed, steps, audit, not_unique, friction } = place;
    let layout = &session.plan.layout;
    let instant = Instant { time: inputs[0], inputs, closed, released: session.equations.released() };
    let linear = Linear::at_rest(session, &instant)?;
    let mut notes = Vec::new();
    if !not_unique.is_empty() {
        notes.push(format!("reactions that are not unique: {}", not_unique.join(", ")));
    }
    say_friction(session, &instant.closed, &friction, &mut notes);
    notes.extend(beyond(session, &instant)?);
    let mut modes = Modes::of(session, &linear)?;
    modes.notes.extend_from_slice(&notes);
    let bodies = (session.model.bodies.iter().enumerate()).map(|(body, record)| {
        let at = |k: usize| instant.inputs[layout.body_slot(body, k)];
        let orientation = [at(3), at(4), at(5), at(6)];
        let position = Vector3::new(at(0), at(1), at(2)) - rotation(&orientation) * record.center_of_mass;
        Pose { body: record.name.clone(), position: position.into(), orientation }
    });
    Ok(Equilibrium {
        time: instant.time,
        stability: modes.stability,
        steps,
        audit,
        bodies: bodies.collect(),
        outputs: linear.outputs.clone(),
        not_unique,
        closed: (instant.closed.iter().filter(|one| **one < session.equations.contacts.len()))
            .map(|contact| search.contact_name(*contact))
            .collect(),
        friction,
        modes,
        start: number,
        notes,
        instant,
    })
}
