//! Memories that jump at instants, during a run: where steps must end for it, and what they are from there on.
//!
//! Each condition is on one of two sides, and stays on it within a step. Where it comes to its bound a step ends, the condition goes
//! over to the other side, and what it decides is asked for anew until nothing changes any more. So it is of no consequence on which
//! side round-off leaves the signal.

use std::ops::Range;

use super::contacts::Touch;
use super::{Part, Simulation};
use crate::analysis::{AnalysisError, Evaluator, Formulation};
use crate::model::Model;
use crate::plan::Layout;
use crate::program::{Equations, Latch, Node, Used};
use crate::results::{Event, EventKind, significant};

/// What a condition is off its bound, as a share of the size of both sides, below which it is at it.
const AT: f64 = 1e-11;
/// The same beyond which a condition that went over has left its bound.
const OFF: f64 = 4.0 * AT;
/// How far a condition that has not left its bound since may come back before it goes over again; steps end where it is twice as much.
const BACK: f64 = 1e-13;
/// How far ahead it is looked for a jump, as a share of the last step, and in roundings of the time; four times as far each time.
const JUMP: f64 = 1e-12;
const ROUNDINGS: f64 = 16.0;
const LOOKS: i32 = 6;
/// The least of it, s: what begins with everything at zero is as far beyond its bound as it will be.
const NEXT: f64 = 1e-100;
/// Rounds of changes at one instant, beside one for each memory, and changes without leaving a bound, before it is said that they have no
/// end.
const MOST_ROUNDS: usize = 50;
const MOST_BACK: u32 = 50;

/// What memories that jump did at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::session) enum Jumped {
    /// Some are others now.
    Yes,
    No,
    /// None, although steps end here once more.
    Stuck,
}

/// One element's memory.
struct One {
    latch: Latch,
    own: Evaluator,
    /// Where what it takes begins among what all take.
    first: usize,
    /// Whether each condition holds; nothing where that is not known yet.
    holds: Vec<bool>,
    /// What both sides of each are of the size of.
    sizes: Vec<f64>,
    /// Whether it has been off its bound since it went over. Until then it has to go beyond it.
    was_off: Vec<bool>,
    /// How far beyond its bound each was where it went over, as such a share; zero or less.
    began: Vec<f64>,
    name: String,
    /// What decides on its release, its unit and that in SI; of a force.
    released_by: Option<(String, String, f64)>,
    /// The value of that where it did, SI.
    decided: f64,
}

impl One {
    fn new(latch: &Latch, first: usize, model: &Model) -> Self {
        let element = &model.elements[latch.element];
        let by = element.release.as_ref().filter(|_| latch.releases);
        Self {
            own: Evaluator::new(&latch.own.0, &latch.own.1),
            first,
            holds: Vec::new(),
            sizes: vec![0.0; latch.conditions.len()],
            was_off: vec![false; latch.conditions.len()],
            began: vec![0.0; latch.conditions.len()],
            name: element.name.clone(),
            released_by: by.map(|release| (release.name.clone(), release.unit.clone(), release.factor)),
            decided: f64::NAN,
            latch: latch.clone(),
        }
    }

    /// Where its states are among all discrete ones.
    fn states(&self) -> Range<usize> {
        self.latch.first..self.latch.first + self.latch.switches.len()
    }

    /// Both sides of all conditions and the next states, where conditions hold or not as given.
    fn ask(&mut self, taken: &[f64], holds: &[bool]) -> Result<(Vec<[f64; 2]>, Vec<f64>), AnalysisError> {
        let mut inputs = taken[self.first..self.first + self.latch.inputs.len()].to_vec();
        inputs.extend(holds.iter().map(|holds| if *holds { -1.0 } else { 1.0 }));
        let found = self.own.run(&inputs, &[])?;
        let (sides, next) = found.split_at(2 * self.latch.conditions.len());
        let sides: Vec<[f64; 2]> = sides.as_chunks().0.to_vec();
        match sides.iter().flatten().chain(next).any(|x| x.is_nan()) {
            true => Err(AnalysisError::NotFinite { what: format!("what the memory of `{}` depends on", self.name) }),
            false => Ok((sides, next.to_vec())),
        }
    }

    /// Whether its conditions hold by what they are, where they are not at their bounds or cannot move.
    fn plainly(&mut self, taken: &[f64]) -> Result<(), AnalysisError> {
        // Conditions inside of others are known first.
        for _ in 0..=self.holds.len() {
            let before = self.holds.clone();
            let (sides, _) = self.ask(taken, &before)?;
            for (k, [small, large]) in sides.iter().enumerate() {
                self.sizes[k] = self.sizes[k].max(small.abs()).max(large.abs());
                let apart = (large - small).abs();
                if apart > AT * self.sizes[k] || !self.latch.moves[k] {
                    self.holds[k] = small < large;
                    self.was_off[k] |= apart > OFF * self.sizes[k];
                }
            }
            if self.holds == before {
                break;
            }
        }
        Ok(())
    }

    /// Where a run begins. One that continues has what is at its bound on the side that leaves the memory as it is, if there is one.
    fn begin(&mut self, taken: &[f64], discrete: &[f64], continues: bool) -> Result<(), AnalysisError> {
        let count = self.latch.conditions.len();
        (self.holds, self.was_off, self.began) = (vec![false; count], vec![false; count], vec![0.0; count]);
        for _ in 0..=count {
            let holds = self.holds.clone();
            let (sides, _) = self.ask(taken, &holds)?;
            self.holds = sides.iter().map(|[small, large]| small < large).collect();
            if self.holds == holds {
                break;
            }
        }
        self.plainly(taken)?;
        let at_bounds: Vec<usize> = (0..count).filter(|k| self.latch.moves[*k] && !self.was_off[*k]).collect();
        for k in at_bounds.into_iter().filter(|_| continues) {
            if self.jumps(taken, discrete)? {
                self.holds[k] = !self.holds[k];
                if self.jumps(taken, discrete)? {
                    self.holds[k] = !self.holds[k];
                }
            }
        }
        Ok(())
    }

    /// Whether what jumps has to do so now.
    fn jumps(&mut self, taken: &[f64], discrete: &[f64]) -> Result<bool, AnalysisError> {
        let holds = self.holds.clone();
        let (_, next) = self.ask(taken, &holds)?;
        let own = &discrete[self.states()];
        Ok(next.iter().zip(own).zip(&self.latch.switches).any(|((next, now), switches)| *switches && next != now))
    }

    /// What is left until each condition goes over.
    fn left(&mut self, taken: &[f64], left: &mut [f64]) -> Result<(), AnalysisError> {
        let holds = self.holds.clone();
        let (sides, _) = self.ask(taken, &holds)?;
        for (k, ([small, large], left)) in sides.into_iter().zip(left).enumerate() {
            let size = self.sizes[k].max(small.abs()).max(large.abs());
            let size = if size > 0.0 { size } else { 1.0 };
            let ahead = (if holds[k] { large - small } else { small - large }) / size;
            *left = match self.latch.moves[k] {
                true => {
                    self.was_off[k] |= ahead > OFF;
                    if self.was_off[k] { ahead } else { ahead - self.began[k] + 2.0 * BACK }
                }
                false if (small < large) == holds[k] => 1.0,
                false => -1.0,
            };
        }
        Ok(())
    }

    /// The conditions that go over. Gives how many did, and how many of these had not left their bounds.
    fn go_over(&mut self, taken: &[f64]) -> Result<(usize, u32), AnalysisError> {
        let mut left = vec![0.0; self.holds.len()];
        self.left(taken, &mut left)?;
        let (mut over, mut back) = (0, 0);
        for (k, left) in left.into_iter().enumerate() {
            if left > if self.was_off[k] { AT } else { BACK } {
                continue;
            }
            self.holds[k] = !self.holds[k];
            if self.latch.moves[k] {
                // What was ahead of the bound on the one side is beyond it on the other.
                let ahead = if self.was_off[k] { left } else { left + self.began[k] - 2.0 * BACK };
                self.began[k] = (-ahead).min(0.0);
                back += u32::from(!self.was_off[k]);
                self.was_off[k] = false;
            }
            over += 1;
        }
        Ok((over, back))
    }

    /// Whether a condition is beyond its bound.
    fn is_beyond(&mut self, taken: &[f64]) -> Result<bool, AnalysisError> {
        let mut left = vec![0.0; self.holds.len()];
        self.left(taken, &mut left)?;
        Ok(left.iter().any(|left| *left < -AT))
    }
}

/// The memories of a scene that jump at instants.
pub(super) struct Latched {
    list: Vec<One>,
    /// What all of them take.
    taken: Part,
    /// Time of the last instant, how often steps ended there, and how often conditions went over since one of them left its bound.
    met_at: f64,
    at_once: u32,
    back: u32,
    /// The memories are those of an earlier stretch, not of the start of the scene.
    continues: bool,
    /// Where states that follow the motion are, and what they were before the last step.
    followed: Vec<(usize, f64)>,
}

impl Latched {
    /// `None` where a scene has none.
    pub(super) fn new(
        equations: &Equations,
        model: &Model,
        layout: &Layout,
        formulation: &dyn Formulation,
    ) -> Option<Self> {
        let mut nodes: Vec<Node> = Vec::new();
        let one = |latch: &Latch| {
            let first = nodes.len();
            nodes.extend(&latch.inputs);
            One::new(latch, first, model)
        };
        let list: Vec<One> = equations.latches.iter().map(one).collect();
        if list.is_empty() {
            return None;
        }
        let taken = Part::near(formulation, equations, &nodes, layout);
        Some(Self { list, taken, met_at: f64::NAN, at_once: 0, back: 0, continues: false, followed: Vec::new() })
    }

    pub(super) fn used(&mut self) -> impl Iterator<Item = Used<'_>> {
        self.taken.used()
    }

    /// Number of conditions.
    pub(super) fn count(&self) -> usize {
        self.list.iter().map(|one| one.latch.conditions.len()).sum()
    }

    /// On which side conditions are has to be found anew.
    pub(super) fn forget(&mut self) {
        self.met_at = f64::NAN;
        self.list.iter_mut().for_each(|one| one.holds.clear());
    }

    /// At the end of a step: what becomes of these states, `new` by their equations and `old` before.
    pub(super) fn hold(&self, old: &[f64], new: &mut [f64]) {
        for one in &self.list {
            new[one.states()].copy_from_slice(&old[one.states()]);
        }
    }
}

impl Simulation<'_> {
    /// What is met next is to depend on time, state and memories alone, not on how often it was looked at this instant before.
    pub(in crate::session) fn meet_anew(&mut self) {
        self.latched.iter_mut().for_each(Latched::forget);
        self.touch.iter_mut().for_each(Touch::forget_meeting);
    }

    /// The run continues another one.
    pub(in crate::session) fn memories_continue(&mut self) {
        self.latched.iter_mut().for_each(|latched| latched.continues = true);
    }

    /// What memories that jump take, at a state.
    fn taken(&mut self, t: f64, state: &[f64]) -> Result<Vec<f64>, AnalysisError> {
        let Some(latched) = &mut self.latched else { return Ok(Vec::new()) };
        Ok(latched.taken.at(self.formulation.as_mut(), &mut self.observed, t, state)?.to_vec())
    }

    /// What is left until each of their conditions goes over.
    pub(super) fn left_until_jumps(&mut self, t: f64, state: &[f64], left: &mut [f64]) -> Result<(), AnalysisError> {
        if left.is_empty() {
            return Ok(());
        }
        let taken = self.taken(t, state)?;
        let mut rest = left;
        for one in self.latched.iter_mut().flat_map(|latched| &mut latched.list) {
            let (own, others) = rest.split_at_mut(one.latch.conditions.len());
            one.left(&taken, own)?;
            rest = others;
        }
        Ok(())
    }

    /// What follows the motion of memories that also jump, after a step, with conditions on the sides that they were on within it.
    pub(super) fn follow_latched(&mut self, t: f64, state: &[f64]) -> Result<Vec<(usize, f64)>, AnalysisError> {
        let follows = |one: &One| one.latch.switches.contains(&false) && !one.holds.is_empty();
        if !self.latched.iter().flat_map(|latched| &latched.list).any(follows) {
            return Ok(Vec::new());
        }
        let taken = self.taken(t, state)?;
        let mut found = Vec::new();
        for one in self.latched.iter_mut().flat_map(|latched| &mut latched.list).filter(|one| follows(one)) {
            let holds = one.holds.clone();
            let (_, next) = one.ask(&taken, &holds)?;
            let states = one.states().zip(next).zip(&one.latch.switches);
            found.extend(states.filter(|(_, jumps)| !**jumps).map(|(state, _)| state));
        }
        if let Some(latched) = &mut self.latched {
            latched.followed = found.iter().map(|(at, _)| (*at, self.discrete[*at])).collect();
        }
        Ok(found)
    }

    /// Lets memories jump that have to at an accepted state. What that changes of a potential energy is work
    /// done by whoever changes it. `comes`: steps have ended here, or begin.
    ///
    /// # Errors
    /// [`AnalysisError::Flutters`]; see [`AnalysisError`].
    pub(in crate::session) fn let_jump(
        &mut self,
        t: f64,
        state: &mut [f64],
        comes: bool,
    ) -> Result<Jumped, AnalysisError> {
        if self.latched.is_none() {
            return Ok(Jumped::No);
        }
        let mut taken = self.taken(t, state)?;
        let mut over = 0;
        let Some(latched) = &mut self.latched else { return Ok(Jumped::No) };
        if comes {
            latched.at_once = if latched.met_at == t { latched.at_once + 1 } else { 0 };
            latched.met_at = t;
        }
        let followed = std::mem::take(&mut latched.followed);
        let mut anew: Vec<(usize, f64)> = Vec::new();
        for one in &mut latched.list {
            if one.holds.is_empty() {
                one.begin(&taken, &self.discrete, latched.continues)?;
                over += 1;
                continue;
            }
            let (own, back) = one.go_over(&taken)?;
            over += own;
            if own > 0 {
                latched.back = if back > 0 { latched.back + back } else { 0 };
                anew.extend(followed.iter().filter(|(at, _)| one.states().contains(at)));
            }
        }
        latched.continues = true;
        let (again, is_endless) = (comes && latched.at_once > 0, latched.back > MOST_BACK);
        if is_endless || latched.at_once > MOST_ROUNDS as u32 {
            return Err(self.flutters(&taken));
        }
        if over == 0 {
            return Ok(if again { Jumped::Stuck } else { Jumped::No });
        }
        let before = self.potential(t, state)?;
        let first = self.discrete.clone();
        if !anew.is_empty() {
            // What follows the motion does so once in a step: from what it was before, with conditions on their new sides.
            anew.iter().for_each(|(at, before)| self.discrete[*at] = *before);
            self.tell_discrete();
            taken = self.taken(t, state)?;
        }
        self.jump_until_rest((t, state), taken, &anew)?;
        if self.discrete == first {
            return Ok(Jumped::No);
        }
        let change = self.potential(t, state)? - before;
        state.last_mut().into_iter().for_each(|work| *work += change);
        self.report_jumps(t, &first)?;
        Ok(Jumped::Yes)
    }

    /// Lets memories jump until none has to; `anew`: states that follow the motion and are to do so with them.
    ///
    /// # Errors
    /// See [`Simulation::let_jump`].
    fn jump_until_rest(
        &mut self,
        (t, state): (f64, &[f64]),
        mut taken: Vec<f64>,
        anew: &[(usize, f64)],
    ) -> Result<(), AnalysisError> {
        // Each may wait for the one before it.
        let most = MOST_ROUNDS + self.latched.as_ref().map_or(0, |latched| latched.list.len());
        for round in 0..=most {
            let (mut changed, mut followed) = (false, Vec::new());
            for one in self.latched.iter_mut().flat_map(|latched| &mut latched.list) {
                if round > 0 {
                    one.plainly(&taken)?;
                }
                let holds = one.holds.clone();
                let (_, next) = one.ask(&taken, &holds)?;
                for (at, (next, jumps)) in one.states().zip(next.into_iter().zip(&one.latch.switches)) {
                    if !jumps {
                        followed.push((at, next));
                    } else if next != self.discrete[at] {
                        (changed, one.decided, self.discrete[at]) = (true, taken[one.first], next);
                    }
                }
            }
            // Not where all is at rest again: what is kept at an edge was kept when the edge was seen.
            if changed || round == 0 {
                let follows = |(at, _): &(usize, f64)| anew.iter().any(|(other, _)| other == at);
                followed.into_iter().filter(follows).for_each(|(at, next)| self.discrete[at] = next);
            }
            self.tell_discrete();
            if !changed {
                return Ok(());
            }
            if round < most {
                taken = self.taken(t, state)?;
            }
        }
        Err(self.flutters(&taken))
    }

    /// Steps end here once more, and nothing is at its bound: what decides jumps itself, a moment later, and no later than `to`. Gives that
    /// time and the state there.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn behind_jump(
        &mut self,
        t: f64,
        to: f64,
        state: &[f64],
    ) -> Result<Option<(f64, Vec<f64>)>, AnalysisError> {
        let step = self.last_steps[0].max(self.last_steps[1]);
        let nearest = (JUMP * step + ROUNDINGS * f64::EPSILON * t.abs()).max(NEXT);
        for look in 0..LOOKS {
            let time = (t + nearest * 4.0_f64.powi(look)).min(to);
            let mut there = self.state_ahead(time - t, t, state)?;
            self.formulation.project(time, &mut there)?;
            let taken = self.taken(time, &there)?;
            for one in self.latched.iter_mut().flat_map(|latched| &mut latched.list) {
                if one.is_beyond(&taken)? {
                    return Ok(Some((time, there)));
                }
            }
            if time == to {
                break;
            }
        }
        Ok(None)
    }

    fn flutters(&mut self, taken: &[f64]) -> AnalysisError {
        let discrete = &self.discrete;
        let (mut names, mut all): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
        for one in self.latched.iter_mut().flat_map(|latched| &mut latched.list) {
            let name = format!("`{}`", one.name);
            if one.was_off.contains(&false) || one.jumps(taken, discrete).unwrap_or(true) {
                names.push(name.clone());
            }
            all.push(name);
        }
        // Where each is at rest with what the others were before, it is all of them together.
        let names = if names.is_empty() { all } else { names };
        AnalysisError::Flutters { elements: names.join(", ") }
    }

    fn report_jumps(&mut self, t: f64, before: &[f64]) -> Result<(), AnalysisError> {
        let Some(latched) = &self.latched else { return Ok(()) };
        let mut events = Vec::new();
        for one in &latched.list {
            for k in (0..one.latch.switches.len()).filter(|k| one.latch.switches[*k]) {
                let (now, was) = (self.discrete[one.latch.first + k], before[one.latch.first + k]);
                if now == was {
                    continue;
                }
                let (kind, row) = match &one.released_by {
                    Some((name, unit, factor)) => {
                        let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
                        let value = significant(one.decided / factor, 9);
                        (EventKind::Releases, format!("{name} = {value}{unit}"))
                    }
                    None if one.latch.switches.len() == 1 => (EventKind::Switches, format!("memory = {now}")),
                    None => (EventKind::Switches, format!("memory {} = {now}", k + 1)),
                };
                let element = one.name.clone();
                events.push(Event { time: t, element, row, kind, rates: [0.0; 2], impulse: 0.0, lost: 0.0 });
            }
        }
        self.send(&events)
    }
}
