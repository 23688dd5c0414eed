//! What the contacts may not fall below: zero, or what of it is round-off.

use serde::{Deserialize, Serialize};

use super::Simulation;
use super::contacts::{LOW, Touch};
use crate::analysis::{AnalysisError, Holder, Meeting, Pattern};
use crate::integrate::STOPPED;

/// How far contacts may be apart and touch, as a share of the tolerance, on the size of the scene.
pub(super) const TOUCHING: f64 = 1e-3;
/// The same where the tolerance is smaller: round-off of positions.
pub(super) const LEAST_TOUCHING: f64 = 1e-12;
/// Round-off of positions far from the origin, as a share of the distance.
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;
/// Share of the reactions of closed contacts below which one is none.
const NO_REACTION: f64 = 1e-9;
/// With each further look at one instant, what is none is larger by this factor, up to the most: what grows faster than times can be told
/// apart, as a torque that sets in late in a run, is past it within them, and leaves nothing to decide there yet.
const LARGER_AGAIN: f64 = 4.0;
const MOST_LARGER: f64 = 1e5;
/// What a decision sees, in forces below which it does not depend on them.
const DECIDED: f64 = 2.0;
/// The same above which a closed contact that pulls is open.
const PULLS: f64 = 1e-6;

/// The largest reaction that each contact has given between meetings. Where a reaction passes through zero, everything in a scene
/// may be without acceleration at that instant (a driver at the middle of its stroke), and what is there leaves no size to
/// compare with.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::session) struct Pressed {
    /// Since the last meeting, by contact.
    now: Vec<f64>,
    /// Between the two meetings before it that were at different times.
    before: Vec<f64>,
}

impl Pressed {
    /// Takes in the reactions of closed contacts, of which there are `count` in all; what is behind them are frictions.
    pub(super) fn note(&mut self, closed: &[usize], count: usize, reactions: &[f64]) {
        self.now.resize(count, 0.0);
        for k in closed.iter().copied().filter(|k| *k < count && reactions[*k].is_finite()) {
            self.now[k] = self.now[k].max(reactions[k].abs());
        }
    }

    /// A meeting; `at_once`: at the time of the last one.
    pub(super) fn meet(&mut self, at_once: bool) {
        if !at_once {
            self.before = std::mem::take(&mut self.now);
        }
    }

    /// The largest reaction of a contact until the last meeting; zero if it was open.
    pub(super) fn of(&self, contact: usize) -> f64 {
        self.before.get(contact).copied().unwrap_or(0.0)
    }
}

impl Touch {
    /// Takes note of the forces below which a decision does not depend on them, where contacts meet, and of what has nothing to do with
    /// each other there.
    pub(super) fn undecided_of(&mut self, meeting: &Meeting, pattern: &Pattern) {
        let first = self.first_friction();
        let number = |holder: Holder| match holder {
            Holder::Contact(place) => Some(meeting.touching[place]),
            Holder::Friction(number) => Some(first + number),
            Holder::Row(_) => None,
        };
        for (holder, force) in meeting.undecided(pattern) {
            number(holder).into_iter().for_each(|k| self.undecided[k] = force);
        }
        for (holder, part) in meeting.parts() {
            number(holder).into_iter().for_each(|k| self.parts[k] = part);
        }
    }

    /// The largest of closed contacts and what sticks, for each of these the largest of what it has to do with.
    fn largest(&self, of: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut by_part = vec![0.0_f64; self.parts.iter().max().map_or(0, |most| most + 1)];
        self.closed.iter().for_each(|k| by_part[self.parts[*k]] = by_part[self.parts[*k]].max(of(*k).abs()));
        self.parts.iter().map(|part| by_part[*part]).collect()
    }

    /// What the value of an open contact, or the speed of a friction behind them, is typically like where places are of the size
    /// `length`, m, and velocities of the size `speed`, m/s: in m and m/s, or rad and rad/s.
    pub(super) fn size_of(&self, k: usize, [length, speed]: [f64; 2]) -> f64 {
        self.gradients[k] * if self.is_place(k) { length } else { speed }
    }

    /// Whether it is a contact whose value is a distance or an angle, not a velocity.
    fn is_place(&self, k: usize) -> bool {
        k < self.first_friction() && !self.contacts.contacts()[k].of_velocities
    }
}

impl Simulation<'_> {
    /// How far contacts may be apart and touch, m.
    pub(super) fn near(&self) -> f64 {
        let of_size = (TOUCHING * self.tolerance).max(LEAST_TOUCHING) * self.scales.length_scale();
        of_size.max(ROUND_OFF * self.scales.far)
    }

    /// As what share of their size places and speeds are the same.
    pub(super) fn same(&self) -> f64 {
        self.tolerance.max(LOW)
    }

    /// The size of speeds, m/s.
    pub(super) fn speed(&self) -> f64 {
        self.scales.speed_scale().max(self.scales.spin_scale() * self.scales.length)
    }

    /// Sets what the contacts may not fall below from here on. Gives closed ones that pull, and frictions that hold more than they
    /// can, the worst first.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn set_levels(&mut self, t: f64, state: &[f64]) -> Result<Option<usize>, AnalysisError> {
        let mut values = vec![0.0; self.stop_count()];
        if let Some(touch) = &mut self.touch {
            touch.levels.fill(0.0);
            touch.sizes.fill(1.0);
        }
        self.stop_values(t, state, &mut values)?;
        let sizes = [self.scales.length_scale(), self.scales.speed_scale()];
        // Nothing is nearer to zero than round-off of what it is a difference of.
        let places = [sizes[0].max(ROUND_OFF * self.scales.far / STOPPED), sizes[1]];
        let Some(touch) = &mut self.touch else { return Ok(None) };
        // Reactions in N: a torque over the gradient of an angle.
        let force = |k: &usize| values[*k] * touch.gradients[*k];
        let left = |k: &usize| touch.left(*k) * touch.gradients[*k];
        // Round-off of one reaction is that of all it is found together with.
        let largest = touch.largest(|k| left(&k));
        let pulls = touch.closed.iter().copied().filter(|k| force(k) < -PULLS * largest[*k]);
        // Of those that share, it is one of which there is least.
        let worst = pulls.min_by(|a, b| left(a).total_cmp(&left(b)));
        let again = LARGER_AGAIN.powi(touch.at_once as i32).min(MOST_LARGER);
        // What may be held in all, where next to nothing is left of it.
        let bound = |k: usize| (touch.bound(k) * touch.gradients[k]).abs();
        let largest = if touch.at_once > 0 { touch.largest(|k| left(&k).abs().max(bound(k))) } else { largest };
        for (k, value) in values.into_iter().take(touch.levels.len()).enumerate() {
            let (size, noise) = match touch.closed.contains(&k) {
                true => {
                    let size = if largest[k] > 0.0 { largest[k] / touch.gradients[k] } else { 1.0 };
                    (size, (NO_REACTION * again * size).max(DECIDED * touch.undecided[k]))
                }
                // Wherever it starts, it may not get deeper.
                false if touch.is_place(k) => (touch.size_of(k, places), f64::NEG_INFINITY),
                false => (touch.size_of(k, sizes), LEAST_TOUCHING * touch.size_of(k, sizes)),
            };
            touch.sizes[k] = size;
            touch.levels[k] = if value > noise { 0.0 } else { value.min(0.0) - noise };
        }
        Ok(worst)
    }
}
