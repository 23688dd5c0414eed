//! Islands that run apart: parts of a scene that share nothing, each integrated as a scene of its own, their results put
//! together.
//!
//! Each island has its own formulation, plane, method and steps, and starts from its share of the assembled scene. What they
//! have in common are the sample times and the sizes that errors are judged by: those of the whole scene at its start (its
//! size; the largest speeds and those that first accelerations announce), which then grow with the island's own motion. So an
//! island that rests beside a fast one is not held to its own round-off; and the error of a slow one, which common steps
//! would make far smaller than asked for, comes as close to the tolerance as that of any other.
//!
//! Of a body that follows the time each island on it has a copy with an equal share of its mass: loads, being linear in masses and in what
//! hangs on the body, add up to those of the whole.

use std::collections::{HashSet, VecDeque};
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::error::SessionError;
use super::island_scenes::Slices;
use super::leg::{Leg, LegEnd, Told};
use super::opened::Session;
use super::prepared::Prepared;
use super::restart::Restart;
use super::run::Run;
use super::samplings::Rows::Sent;
use super::sink::Sink;
use crate::analysis::Scales;
use crate::diagnostics::{Diagnostic, codes};
use crate::integrate::Flow;
use crate::plan::Island;
use crate::pool;
use crate::results::{Audit, Event, IslandWork, LOAD, POSE, ResultsError, Status, Summary};

/// A scene falls as fast as sqrt(g L): below this share of it, speeds count as rest, whatever the rounding of resting islands.
const REST: f64 = 1e-3;

/// The place of a value that is not shown.
const NOWHERE: usize = usize::MAX;
/// Largest difference of copies of a body at the end, as a share of the scene's size: they follow the time but for round-off and projection.
const ALIKE: f64 = 1e-6;

/// Islands that are prepared, with the scene that they are parts of.
pub(super) struct Islands {
    pub(super) whole: Session,
    parts: Vec<Prepared>,
}

/// Rows of values of all islands, as they come: a row is complete when all of them have their share of it.
struct Rows {
    /// The places of each island's values among those of the whole.
    places: Vec<Vec<usize>>,
    /// Rows of each island that others have not reached.
    waiting: Vec<VecDeque<Vec<f64>>>,
    /// Islands of which no row waits.
    missing: usize,
    /// Rows that are complete.
    count: usize,
    /// Values of a row.
    values: Vec<f64>,
}

impl Rows {
    fn new(places: Vec<Vec<usize>>, values: usize) -> Self {
        let islands = places.len();
        let waiting = vec![VecDeque::new(); islands];
        Self { places, waiting, missing: islands, count: 0, values: vec![0.0; values] }
    }

    /// Takes the share of an island. Gives the row that it completes, if it does, with its number.
    fn take(&mut self, island: usize, values: &[f64]) -> Option<(usize, &[f64])> {
        if self.waiting[island].is_empty() {
            self.missing -= 1;
        }
        self.waiting[island].push_back(values.to_vec());
        if self.missing > 0 {
            return None;
        }
        self.values.fill(0.0);
        for (places, waiting) in self.places.iter().zip(&mut self.waiting) {
            let row = waiting.pop_front().unwrap_or_default();
            // Energies of the whole scene are sums, and so is what copies of a body bear; all else belongs to one island.
            for (place, value) in places.iter().zip(row) {
                if let Some(sum) = self.values.get_mut(*place) {
                    *sum += value;
                }
            }
            self.missing += usize::from(waiting.is_empty());
        }
        self.count += 1;
        Some((self.count - 1, &self.values))
    }
}

/// What runs in all islands give, as it comes.
struct Gathered<'a> {
    told: Told<'a>,
    channels: Rows,
    /// Poses and loads, where they are taken.
    pictures: Option<Rows>,
    /// Time that each island has reached, s.
    reached: Vec<f64>,
    /// Sum of the shares of all islands that are done.
    done: f64,
}

impl Gathered<'_> {
    fn take(&mut self, island: usize, values: &[f64]) -> Result<(), std::io::Error> {
        let row = self.channels.take(island, values);
        row.map_or(Ok(()), |(number, values)| self.told.samplings.take(number, values))
    }

    fn picture(&mut self, island: usize, values: &[f64]) -> Result<(), std::io::Error> {
        let row = self.pictures.as_mut().and_then(|pictures| pictures.take(island, values));
        row.map_or(Ok(()), |(number, values)| self.told.samplings.picture(number, values))
    }

    fn tell(&mut self, island: usize, t: f64) {
        let [from, to] = self.told.span;
        self.done += (t - self.reached[island]) / (to - from);
        self.reached[island] = t;
        let share = (self.done / self.reached.len() as f64).min(1.0);
        (self.told.progress)(if self.reached.iter().all(|t| *t == to) { 1.0 } else { share });
    }
}

/// Takes what one island gives.
struct Part<'a, 'b> {
    gathered: &'a Mutex<Gathered<'b>>,
    island: usize,
}

impl Sink for Part<'_, '_> {
    fn sample(&mut self, _: usize, values: &[f64]) -> std::io::Result<()> {
        lock(self.gathered).take(self.island, values)
    }

    fn takes_pictures(&self) -> bool {
        lock(self.gathered).pictures.is_some()
    }

    fn picture(&mut self, _: usize, values: &[f64]) -> std::io::Result<()> {
        lock(self.gathered).picture(self.island, values)
    }

    fn event(&mut self, event: &Event) -> std::io::Result<()> {
        lock(self.gathered).told.samplings.event(event)
    }

    fn step(&mut self, t: f64) -> Flow {
        let mut gathered = lock(self.gathered);
        gathered.tell(self.island, t);
        gathered.told.flow()
    }
}

impl Islands {
    /// What is known before the first step.
    pub(super) fn summary(&self) -> Summary {
        // The checksum is that of the text of all.
        let parts = self.summaries("");
        self.whole.summary(&words(&parts, |own| &own.method), &words(&parts, |own| &own.engine))
    }

    /// The same of each island.
    fn summaries(&self, sha256: &str) -> Vec<Summary> {
        let summary = |part: &Prepared| part.session.summary_of(sha256.to_owned(), part.method(), part.formulation());
        self.parts.iter().map(summary).collect()
    }
}

/// Integrates all islands; see [`super::crew::Crew::go`].
pub(super) fn islands_leg(
    islands: Islands,
    leg: Leg,
    mut summary: Summary,
    since: Instant,
    mut told: Told<'_>,
) -> Result<LegEnd, SessionError> {
    let mut summaries = islands.summaries(&summary.scene_sha256);
    let Islands { whole, parts } = islands;
    let topology = &whole.plan.topology.islands;
    let ended = {
        let gathered = Mutex::new(Gathered {
            channels: whole.channels_of_islands(),
            pictures: told.samplings.takes_pictures().then(|| whole.pictures()),
            reached: vec![told.span[0]; topology.len()],
            done: 0.0,
            told: told.lent(),
        });
        let mut runs: Vec<Run<'_>> = Vec::with_capacity(parts.len());
        for (k, part) in parts.into_iter().enumerate() {
            let sink = Part { gathered: &gathered, island: k };
            let leg = Leg { to: leg.to, first_sample: 0, carried: None };
            let run = part.begin(Sent(Box::new(sink)), leg);
            runs.push(run.map_err(|error| whole.in_island(&topology[k], error))?);
        }
        let scales = whole.scales_of(&runs);
        for (run, island) in runs.iter_mut().zip(topology) {
            run.widen_scales(&scales);
            run.watch_start().map_err(|error| whole.in_island(island, error))?;
        }
        summary.compile_time_s += since.elapsed().as_secs_f64();
        let integrating = Instant::now();
        // Islands share nothing, so that it does not matter how many threads there are.
        pool::each(runs.iter_mut().collect(), whole.options.jobs, |run| run.go_to(leg.to));
        summary.integration_time_s = integrating.elapsed().as_secs_f64();
        let end = |run: Run<'_>| {
            let reached = run.time();
            let (session, ended, _) = run.into_ended(leg.to);
            (session, ended, reached)
        };
        runs.into_iter().map(end).collect::<Vec<_>>()
    };
    let (mut sessions, mut failures, mut ends) = (Vec::new(), Vec::new(), Vec::new());
    for ((session, ended, reached), summary) in ended.into_iter().zip(&mut summaries) {
        session.note_work(summary, &ended, false);
        summary.t_end_reached = reached;
        failures.push(session.conclude(summary, ended.outcome, &mut None));
        ends.push(ended.state.ok());
        sessions.push(session);
    }
    whole.sum_up(&mut summary, &summaries);
    let failed = match told.samplings.error.take() {
        Some(error) => Some(whole.not_written(&mut summary, &error)),
        None => whole.first_end(&mut summary, &summaries, failures),
    };
    let failed = failed.or_else(|| whole.torn(&mut summary, &ends));
    let state = whole.end_of(ends).ok_or_else(|| "not all islands have reached the end".to_string());
    let islands = sessions.into_iter().zip(summaries).collect();
    Ok(LegEnd { session: whole, summary, failed, state, carried: None, islands })
}

/// A lock; what a thread that panicked left behind is as good as before, since nobody continues after a panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Session {
    /// The places of the channels of each island among those of the whole.
    fn channels_of_islands(&self) -> Rows {
        let channels = &self.model.channels;
        let mut seen = vec![false; channels.len()];
        let mut place = |number: &usize| match std::mem::replace(&mut seen[*number], true) {
            true if !channels[*number].quantity.adds_up() => NOWHERE,
            _ => *number,
        };
        let islands = self.plan.topology.islands.iter();
        Rows::new(islands.map(|island| island.channels.iter().map(&mut place).collect()).collect(), channels.len())
    }

    /// The places of what is shown of each island among what is shown of the whole.
    fn pictures(&self) -> Rows {
        let (bodies, loads) = (self.model.bodies.len(), self.model.shown_loads());
        let block = |from: usize, size: usize, number: usize| (0..size).map(move |k| from + size * number + k);
        let mut shown = vec![false; bodies];
        let places = self.plan.topology.islands.iter().map(|island| {
            // Of copies one is shown.
            let of_body = |body: &usize| match std::mem::replace(&mut shown[*body], true) {
                true => vec![NOWHERE; POSE],
                false => block(0, POSE, *body).collect(),
            };
            let poses: Vec<usize> = island.bodies.iter().flat_map(of_body).collect();
            let own = loads.iter().enumerate().filter(|(_, load)| island.elements.contains(&load.element));
            let loads = own.flat_map(|(number, _)| block(POSE * bodies, LOAD, number));
            poses.into_iter().chain(loads).collect()
        });
        Rows::new(places.collect(), POSE * bodies + LOAD * loads.len())
    }

    /// Writes the end of an island into that of the whole scene.
    fn give_back(&self, island: &Island, end: &Restart, whole: &mut Restart) {
        for (k, body) in island.bodies.iter().enumerate() {
            whole.working[13 * body..13 * (body + 1)].copy_from_slice(&end.working[13 * k..13 * (k + 1)]);
        }
        let (mut state, mut reference, mut discrete) = (13 * island.bodies.len(), 0, 0);
        for element in &island.elements {
            let own = Slices::of(&self.plan.layout, *element);
            copy(&end.working, &mut state, &mut whole.working[own.states]);
            copy(&end.references, &mut reference, &mut whole.references[own.references]);
            copy(&end.discrete, &mut discrete, &mut whole.discrete[own.discrete]);
        }
        if let (Some(work), Some(own)) = (whole.working.last_mut(), end.working.last()) {
            *work += own;
        }
        whole.memories.extend(end.memories.iter().cloned());
        whole.released.extend(end.released.iter().cloned());
    }

    /// The islands, prepared to be integrated apart.
    ///
    /// # Errors
    /// As for [`Session::prepare`], with the island named.
    pub(super) fn prepare_islands(self) -> Result<Islands, SessionError> {
        let sessions = self.islands()?.into_iter().zip(&self.plan.topology.islands);
        let parts: Result<Vec<Prepared>, SessionError> = sessions
            .map(|(session, island)| session.prepare().map_err(|error| self.in_island(island, error)))
            .collect();
        Ok(Islands { parts: parts?, whole: self })
    }

    /// The sizes of the whole scene at the start.
    fn scales_of(&self, runs: &[Run<'_>]) -> Scales {
        let mut scales = self.assembly.scales;
        scales.grow(&self.assembly.working, self.plan.layout.bodies);
        runs.iter().for_each(|run| scales.widen(run.scales()));
        scales.speed = scales.speed.max(REST * (self.model.gravity.norm() * scales.length).sqrt());
        scales
    }

    /// Adds up the work of all islands; of the audit the worst.
    fn sum_up(&self, summary: &mut Summary, parts: &[Summary]) {
        let sum = |of: fn(&Summary) -> u64| parts.iter().map(of).sum::<u64>();
        let first = |of: fn(&Summary) -> Option<f64>| parts.iter().filter_map(of).min_by(f64::total_cmp);
        summary.engine = words(parts, |part| &part.engine);
        for part in parts {
            summary.add_counts(part);
        }
        summary.machine_code_bytes = sum(|part| part.machine_code_bytes);
        summary.machine_code_time_s = parts.iter().map(|part| part.machine_code_time_s).sum();
        summary.machine_code_from = first(|part| part.machine_code_from);
        summary.stiff_from = first(|part| part.stiff_from);
        // Islands may have elements in common that follow time alone.
        let mut named = HashSet::new();
        let elements = parts.iter().flat_map(|part| &part.elements).filter(|one| named.insert(one.element.as_str()));
        summary.elements = elements.cloned().collect();
        summary.audit = Audit::together(parts.iter().map(|part| &part.audit));
        let islands = self.plan.topology.islands.iter().zip(parts).map(|(island, own)| IslandWork {
            bodies: self.plan.topology.own_bodies(island).map(|body| self.model.bodies[body].name.clone()).collect(),
            status: own.status,
            reason: own.reason.clone(),
            t_end_reached: own.t_end_reached,
            method: own.method.clone(),
            engine: own.engine.clone(),
            steps: own.steps,
            rejected: own.rejected,
            evaluations: own.evaluations,
            jacobians: own.jacobians,
            stiff_from: own.stiff_from,
            audit: own.audit,
            integration_time_s: own.integration_time_s,
        });
        summary.islands = islands.collect();
    }

    /// Writes into the summary how the whole run stands: as the island that ended first, if one did before the end.
    fn first_end(
        &self,
        summary: &mut Summary,
        parts: &[Summary],
        failures: Vec<Option<SessionError>>,
    ) -> Option<SessionError> {
        let ended = (0..parts.len()).filter(|k| parts[*k].status != Status::Completed);
        let first = ended.min_by(|a, b| parts[*a].t_end_reached.total_cmp(&parts[*b].t_end_reached));
        let Some(first) = first else {
            summary.status = Status::Completed;
            summary.t_end_reached = summary.t_end;
            return None;
        };
        let (part, island) = (&parts[first], &self.plan.topology.islands[first]);
        summary.status = part.status;
        summary.code = part.code;
        summary.reason = format!("the island of `{}`: {}", self.name_of(island), part.reason);
        summary.t_end_reached = part.t_end_reached;
        failures.into_iter().nth(first).flatten().map(|error| self.in_island(island, error))
    }

    /// Copies of a body that follows the time must be in one place at the end; writes into the summary that they are not.
    fn torn(&self, summary: &mut Summary, ends: &[Option<Restart>]) -> Option<SessionError> {
        let mut places: Vec<Option<&[f64]>> = vec![None; self.model.bodies.len()];
        for (island, end) in self.plan.topology.islands.iter().zip(ends) {
            let Some(end) = end else { continue };
            for (k, body) in island.bodies.iter().enumerate() {
                let place = &end.working[13 * k..13 * k + 7];
                let first = *places[*body].get_or_insert(place);
                let apart = |at: Range<usize>, sign: f64| {
                    let pairs = first[at.clone()].iter().zip(&place[at]);
                    pairs.map(|(a, b)| (a - sign * b).abs()).fold(0.0, f64::max)
                };
                // Euler parameters of either sign are the same rotation.
                let turned = apart(3..7, 1.0).min(apart(3..7, -1.0));
                if apart(0..3, 1.0) > ALIKE * self.assembly.scales.length || turned > ALIKE {
                    let name = &self.model.bodies[*body].name;
                    let message = format!("`{name}`, which islands have in common, is not in one place at the end");
                    summary.fail(message.clone(), Some(codes::COPIES_DIFFER));
                    let help = "run it with common steps: `islands = \"together\"` in [simulation]";
                    return Some(SessionError::one(
                        &self.scene.source,
                        Diagnostic::error(codes::COPIES_DIFFER, message).help(help),
                    ));
                }
            }
        }
        None
    }

    /// Writes into the summary that a file could not be written.
    fn not_written(&self, summary: &mut Summary, error: &ResultsError) -> SessionError {
        summary.fail(error.to_string(), Some(error.code()));
        summary.t_end_reached = summary.islands.iter().map(|island| island.t_end_reached).fold(summary.t_end, f64::min);
        self.files_error(error)
    }

    /// The state at the end, if all islands have one of the same time.
    fn end_of(&self, ends: Vec<Option<Restart>>) -> Option<Restart> {
        let ends: Vec<Restart> = ends.into_iter().collect::<Option<_>>()?;
        let time = ends.first()?.time;
        if ends.iter().any(|end| end.time != time) {
            return None;
        }
        let working = vec![0.0; self.assembly.working.len()];
        let mut whole = Restart::new(&self.model, time, working, &self.assembly.references, &self.assembly.discrete);
        for (island, end) in self.plan.topology.islands.iter().zip(&ends) {
            self.give_back(island, end, &mut whole);
        }
        Some(whole)
    }

    /// The body that an island is named after.
    pub(super) fn name_of(&self, island: &Island) -> &str {
        let own = self.plan.topology.own_bodies(island).next();
        &self.model.bodies[own.unwrap_or(island.bodies[0])].name
    }

    /// An error that names the island.
    pub(super) fn in_island(&self, island: &Island, error: SessionError) -> SessionError {
        let help = format!("in the island of `{}`, which runs apart", self.name_of(island));
        let diagnostics = error.diagnostics.into_iter().map(|diagnostic| diagnostic.help(help.clone())).collect();
        SessionError { diagnostics, ..error }
    }
}

/// Fills `to` from a list, and moves the place in the list on.
fn copy(from: &[f64], at: &mut usize, to: &mut [f64]) {
    to.copy_from_slice(&from[*at..*at + to.len()]);
    *at += to.len();
}

/// What islands have in common, or the different words one after the other.
fn words(parts: &[Summary], of: fn(&Summary) -> &str) -> String {
    let mut list: Vec<&str> = Vec::new();
    for word in parts.iter().map(of) {
        if !list.contains(&word) {
            list.push(word);
        }
    }
    list.join(" / ")
}
