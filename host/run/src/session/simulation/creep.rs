//! [`Creep`]: frictions in a plane that stick and slide over and over without getting anywhere, and creep instead.
//!
//! Feet that are tied together by what stands on them hardly move against each other, and which of them sticks depends on speeds far below
//! the errors of velocities: Coulomb's law then has an event every few steps, or no solution that can be told from others. Where the last
//! [`MANY`] changes of a friction together, or [`MANY_STEPS`] steps in which it slid, got it no further than positions are known, or nothing
//! that meets all conditions was found, it and what has to do with it follow the law with viscous friction below the size of errors of
//! velocities (see `program/sliding.rs`), which has no events. Coulomb's law is tried again each time after twice as long: what has come to
//! rest sticks from then on. What would stick creeps by no more than these errors add up to.

use serde::{Deserialize, Serialize};

use super::Simulation;
use super::contacts::INSTANT;
use super::frictions::Sliding;
use crate::analysis::{Meeting, Pattern};

/// Changes that are looked at together, and how many of them are forgotten where it is tried without.
const MANY: usize = 24;
const FORGOTTEN: usize = 12;
/// Steps that are looked at together while it slides.
const MANY_STEPS: u32 = 1000;
/// What share of them it gets faster in at least, and slower in, where that is noise.
const UP_AND_DOWN: u32 = 8;
/// Steps between two events, tried or made, from which on Jacobians are worth a program.
const SHORT_STEPS: u64 = 500;
/// For how long it creeps first, in spans of the changes before.
const FIRST_WAIT: f64 = 2.0;
/// The same as a share of the run so far where it was not changes that called for it.
const LEAST_WAIT: f64 = 1e-3;

/// What is known of how a friction changes.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct Changes {
    /// When it last began to stick or to slide, how far it slid since then, m, and how fast it began to, m/s^2.
    at: f64,
    way: f64,
    begins: f64,
    /// Speed at the last step, m/s, its time, and the numbers of steps since then in which it fell and rose.
    speed: f64,
    seen: f64,
    steps: [u32; 2],
    /// Duration and way of the changes before.
    before: Vec<[f64; 2]>,
}

/// See the module documentation.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::session) struct Creep {
    /// By friction; empty where none can creep.
    changes: Vec<Changes>,
    /// Those that do, and those that were reported to.
    creeping: Vec<usize>,
    told: Vec<usize>,
    /// Below this speed their friction is viscous, m/s.
    speed: f64,
    /// Whether steps were short for what slides.
    stiff: bool,
    /// One that slid in many steps without getting anywhere: it creeps from the end of the next step on.
    stalled: Option<usize>,
    /// When it is tried without, and how long that was put off.
    until: f64,
    wait: f64,
    /// When the run began.
    #[serde(default)]
    began: f64,
}

impl Creep {
    /// Of so many frictions, in a run that begins at this time.
    pub(super) fn of(count: usize, began: f64) -> Self {
        let at_start = Changes { at: began, seen: began, ..Changes::default() };
        Self { changes: vec![at_start; count], began, ..Self::default() }
    }

    /// Whether any may.
    pub(super) fn is_possible(&self) -> bool {
        !self.changes.is_empty()
    }

    /// Whether any does.
    pub(super) fn creeps(&self) -> bool {
        !self.creeping.is_empty()
    }

    /// The speed of one that creeps, m/s.
    pub(super) fn speed_of(&self, number: usize) -> Option<f64> {
        self.creeping.contains(&number).then_some(self.speed)
    }

    /// What is left until it is tried without, as a share of how long it lasts; positive where nothing creeps.
    pub(super) fn left(&self, t: f64) -> f64 {
        if self.creeping.is_empty() && self.stalled.is_none() { 1.0 } else { (self.until - t) / self.wait }
    }

    /// Takes note of speeds at the end of a step, m/s; ways are none below a least, m.
    pub(super) fn note(&mut self, t: f64, speeds: impl Iterator<Item = f64>, least: f64) {
        for (number, (one, speed)) in self.changes.iter_mut().zip(speeds).enumerate() {
            let step = t - one.seen;
            one.way += step * speed.max(one.speed);
            if one.seen == one.at {
                one.way += one.begins * step * step / 6.0;
            }
            one.seen = t;
            let before = std::mem::replace(&mut one.speed, speed.max(0.0));
            one.steps[usize::from(speed > before)] += u32::from(speed > 0.0);
            let [falls, rises] = one.steps;
            if falls + rises >= MANY_STEPS && self.creeping.is_empty() {
                // What begins or ends slowly gets faster or slower all the time.
                if one.way < least && falls.min(rises) > MANY_STEPS / UP_AND_DOWN {
                    (self.stalled, self.until) = (Some(number), t + step);
                    self.wait = self.wait.max(step);
                }
                (one.steps, one.way) = ([0; 2], 0.0);
            }
        }
    }

    /// One that slid in many steps without getting anywhere until now.
    pub(super) fn take_stalled(&mut self, t: f64) -> Option<usize> {
        self.stalled.take_if(|_| self.until <= t)
    }

    /// One begins to stick, or to slide with this acceleration, m/s^2. Whether it changes too often without sliding by so much, m.
    fn change(&mut self, number: usize, t: f64, begins: f64, least: f64) -> bool {
        let Some(one) = self.changes.get_mut(number) else { return false };
        one.before.push([t - one.at, one.way]);
        if one.before.len() > MANY {
            one.before.remove(0);
        }
        let before = std::mem::take(&mut one.before);
        *one = Changes { at: t, seen: t, begins, before, ..Changes::default() };
        let way: f64 = one.before.iter().map(|[_, way]| way).sum();
        one.before.len() == MANY && way < least
    }

    /// Lets these creep from here on, if they do not yet.
    fn begin(&mut self, numbers: &[usize], t: f64, speed: f64) -> bool {
        let before = self.creeping.len();
        for number in numbers.iter().filter(|number| **number < self.changes.len()) {
            if !self.creeping.contains(number) {
                self.creeping.push(*number);
            }
        }
        if self.creeping.len() == before {
            return false;
        }
        let span = |one: &Changes| one.before.iter().map(|[duration, _]| duration).sum::<f64>();
        let spans = numbers.iter().filter_map(|number| self.changes.get(*number)).map(span);
        let first = FIRST_WAIT * spans.fold(0.0, f64::max);
        self.wait = (2.0 * self.wait).max(first).max(LEAST_WAIT * (t - self.began)).max(INSTANT * t.abs());
        self.wait = self.wait.max(f64::MIN_POSITIVE);
        (self.speed, self.until) = (speed, t + self.wait);
        true
    }

    /// Tries without, where it is time to.
    fn end(&mut self, t: f64) {
        if self.until <= t && !self.creeping.is_empty() {
            self.creeping.clear();
            self.until = f64::MAX;
            for one in &mut self.changes {
                one.before.drain(..FORGOTTEN.min(one.before.len()));
            }
        }
    }

    /// Lets them be tried without at once; `false` where none creeps.
    fn try_without(&mut self, t: f64) -> bool {
        self.until = if self.creeps() { t } else { self.until };
        self.creeps()
    }

    /// Those that creep and were not reported to.
    pub(super) fn untold(&mut self) -> Vec<usize> {
        let new = self.creeping.iter().copied().filter(|number| !self.told.contains(number)).collect();
        self.told.clone_from(&self.creeping);
        new
    }
}

impl Simulation<'_> {
    /// Whether frictions in a plane slide, or creep.
    pub(in crate::session) fn slides_in_plane(&self) -> bool {
        let Some(touch) = &self.touch else { return false };
        let frictions = touch.contacts.frictions();
        touch.sliding(&self.discrete).iter().any(|(number, _)| frictions[*number].rows.len() > 1)
    }

    /// Whether frictions creep, which is stiff, or slide where that was stiff.
    pub(in crate::session) fn may_be_stiff(&self) -> bool {
        self.touch.as_ref().is_some_and(|touch| touch.creep.creeps() || touch.creep.stiff)
    }

    /// A method took so many steps, tried or made, and found that stability limits explicit ones: for what slides, if anything does.
    pub(in crate::session) fn was_stiff(&mut self, steps: u64) {
        if steps > SHORT_STEPS
            && self.slides_in_plane()
            && let Some(touch) = &mut self.touch
        {
            touch.creep.stiff = touch.creep.is_possible();
        }
    }

    /// Tries without creeping, where it is time to.
    pub(super) fn end_creeping(&mut self, t: f64) {
        if let Some(touch) = &mut self.touch {
            touch.creep.end(t);
        }
    }

    /// Lets these frictions creep; `false` where none does that did not before.
    pub(super) fn let_creep(&mut self, numbers: &[usize], t: f64) -> bool {
        let speed = self.tolerance * self.speed();
        let Some(touch) = &mut self.touch else { return false };
        let in_plane = |number: &usize| touch.contacts.frictions()[*number].rows.len() > 1;
        let numbers: Vec<usize> = numbers.iter().copied().filter(in_plane).collect();
        touch.creep.begin(&numbers, t, speed)
    }

    /// Tries without creeping before it is time to; `false` where nothing creeps. What creeps ever faster towards where friction presses as
    /// hard as what it slows (Painleve) does not get there: its reactions grow beyond all bounds, and an impact ends the sliding by Coulomb's law.
    pub(super) fn try_without_creeping(&mut self, t: f64) -> bool {
        self.touch.as_mut().is_some_and(|touch| touch.creep.try_without(t))
    }

    /// Takes note of what begins to stick and to slide; those that creep from here on, since they did so over and over.
    pub(super) fn chattering(
        &mut self,
        t: f64,
        (meeting, pattern): (&Meeting, &Pattern),
        gains: impl Fn(usize) -> f64,
        slid: &Sliding,
    ) -> Vec<usize> {
        let least = self.same() * self.scales.length_scale();
        let Some(touch) = &mut self.touch else { return Vec::new() };
        let first = touch.first_friction();
        let mut found = Vec::new();
        for grip in &meeting.grips {
            let number = grip.number;
            let direction =
                |list: &Sliding| list.iter().find(|(other, _)| *other == number).map(|(_, direction)| *direction);
            let (was, is) = (direction(slid), direction(&pattern.sliding));
            let (stuck, sticks) = (touch.told.contains(&(first + number)), pattern.sticking.contains(&number));
            let changes = match (was, is) {
                (Some([x, y]), Some([u, v])) => x * u + y * v < 0.0,
                (Some(_), None) => sticks,
                (None, Some(_)) => stuck,
                (None, None) => false,
            };
            if changes && grip.creeps.is_none() && touch.creep.change(number, t, gains(number), least) {
                found.extend(meeting.coupled(number));
            }
        }
        found
    }
}
