//! What equations of elements read, [`Configuration`] and [`Motion`], and where they put what they compute, [`Values`] and [`Wrenches`].

use std::cell::Cell;
use std::f64::consts::{PI, TAU};

use crate::blocks;
use crate::geometry::{Frame, Twist, Vec3};
use crate::scalar::Scalar;

/// Where the bodies are: what a constraint may depend on.
#[non_exhaustive]
pub struct Configuration<'a, S> {
    /// The element's frames, in the order of [`Element::FRAMES`](crate::Element::FRAMES).
    pub frames: &'a [Frame<S>],
    /// Time, s.
    pub time: S,
    /// The element's internal unknowns.
    pub(crate) unknowns: &'a [S],
    /// Reference of each multi-turn angle, rad.
    pub(crate) references: &'a [S],
    /// Each multi-turn angle as the equations last computed it; the host takes the next references from here.
    pub(crate) angles: &'a [Cell<Option<S>>],
}

impl<S: Scalar> Configuration<'_, S> {
    /// The element's frames.
    #[must_use]
    pub fn frames(&self) -> &[Frame<S>] {
        self.frames
    }
    /// Time, s.
    #[must_use]
    pub fn time(&self) -> S {
        self.time
    }

    /// The element's internal unknowns, see [`Element::UNKNOWNS`](crate::Element::UNKNOWNS).
    #[must_use]
    pub fn unknowns(&self) -> &[S] {
        self.unknowns
    }

    /// The angle of the point (`cos`, `sin`) in rad, continuous over any number of turns. `k` numbers the element's
    /// angles, 0 .. [`Element::ANGLES`](crate::Element::ANGLES).
    ///
    /// The host keeps, per angle, a reference that changes only after accepted steps; the angle is the one within half a
    /// turn of it: ref + atan2(s cos ref - c sin ref, c cos ref + s sin ref).
    ///
    /// # Panics
    /// When `k` is not below [`Element::ANGLES`](crate::Element::ANGLES).
    #[must_use]
    #[track_caller]
    pub fn angle(&self, k: usize, sin: S, cos: S) -> S {
        assert!(
            k < self.references.len(),
            "angle {k} is used, but the element declares ANGLES = {}",
            self.references.len()
        );
        let reference = self.references[k];
        let (sr, cr) = (reference.sin(), reference.cos());
        let angle = reference + (sin * cr - cos * sr).atan2(cos * cr + sin * sr);
        self.angles[k].set(Some(angle));
        angle
    }

    /// The multi-turn angle by which frame `j` is turned against frame `i` about their common z axis, rad.
    #[must_use]
    #[track_caller]
    pub fn angle_about_z(&self, k: usize, i: usize, j: usize) -> S {
        let (a, b) = (&self.frames[i], &self.frames[j]);
        self.angle(k, b.x().dot(&a.y()), b.x().dot(&a.x()))
    }

    /// The same for an angle that begins between two ends, rad, where there are any: not within half a turn of zero, but of the middle
    /// between the ends, or of the only one if zero is beyond it. More than a turn apart they leave a choice, and it begins as near to
    /// zero as they let it.
    #[must_use]
    #[track_caller]
    pub fn angle_about_z_between(&self, k: usize, i: usize, j: usize, lower: Option<f64>, upper: Option<f64>) -> S {
        let middle = middle(lower, upper);
        if middle == 0.0 {
            return self.angle_about_z(k, i, j);
        }
        let (sin, cos) = blocks::turn_about_z(&self.frames[i], &self.frames[j]);
        let (sm, cm) = middle.sin_cos();
        self.angle(k, sin * cm - cos * sm, cos * cm + sin * sm) + middle
    }
}

/// How near to half a turn off the middle an angle is no matter of one side or the other, rad.
const HALF_TURN: f64 = 4e-6;

/// What an angle between two ends begins within half a turn of, rad; zero where all angles between the ends are so.
fn middle(lower: Option<f64>, upper: Option<f64>) -> f64 {
    match (lower, upper) {
        (Some(lower), Some(upper)) if lower > HALF_TURN - PI && upper <= PI => 0.0,
        (Some(lower), Some(upper)) if upper - lower < TAU - HALF_TURN => 0.5 * (lower + upper),
        // The end that is nearest to zero, if that is beyond it, is well within.
        (Some(lower), Some(upper)) => 0.0_f64.min(upper - PI + HALF_TURN).max(lower + PI - HALF_TURN),
        (lower, upper) => lower.unwrap_or(0.0).max(0.0) + upper.unwrap_or(0.0).min(0.0),
    }
}

/// Where the bodies are and how they move: what a force may depend on.
#[non_exhaustive]
pub struct Motion<'a, S> {
    /// Positions and time.
    pub configuration: Configuration<'a, S>,
    /// Velocities of the frames.
    pub twists: &'a [Twist<S>],
    /// The element's continuous states.
    pub states: &'a [S],
    /// The element's discrete states.
    pub memory: &'a [S],
    /// The signals it takes, in SI units, in the order of its `INPUTS`.
    pub inputs: &'a [S],
    /// Reactions of the joints it depends on, in the order of [`Force::JOINTS`](crate::Force::JOINTS).
    pub reactions: &'a [Reaction<S>],
}

/// What a joint does to the last of its bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reaction<S> {
    /// Force at the origin of the joint's last frame, N, ground frame.
    pub force: Vec3<S>,
    /// Torque, N m, ground frame.
    pub torque: Vec3<S>,
}

impl<S: Scalar> Motion<'_, S> {
    /// The element's frames.
    #[must_use]
    pub fn frames(&self) -> &[Frame<S>] {
        self.configuration.frames
    }
    /// Time, s.
    #[must_use]
    pub fn time(&self) -> S {
        self.configuration.time
    }
    /// The element's internal unknowns, see [`Element::UNKNOWNS`](crate::Element::UNKNOWNS).
    #[must_use]
    pub fn unknowns(&self) -> &[S] {
        self.configuration.unknowns
    }
    /// [`Configuration::angle`].
    ///
    /// # Panics
    /// As there.
    #[must_use]
    #[track_caller]
    pub fn angle(&self, k: usize, sin: S, cos: S) -> S {
        self.configuration.angle(k, sin, cos)
    }
    /// [`Configuration::angle_about_z`].
    ///
    /// # Panics
    /// As [`Configuration::angle`].
    #[must_use]
    #[track_caller]
    pub fn angle_about_z(&self, k: usize, i: usize, j: usize) -> S {
        self.configuration.angle_about_z(k, i, j)
    }
    /// [`Configuration::angle_about_z_between`].
    ///
    /// # Panics
    /// As [`Configuration::angle`].
    #[must_use]
    #[track_caller]
    pub fn angle_about_z_between(&self, k: usize, i: usize, j: usize, lower: Option<f64>, upper: Option<f64>) -> S {
        self.configuration.angle_about_z_between(k, i, j, lower, upper)
    }
    /// Velocity of the point of a frame's body that is at `point` (m, ground frame) now, m/s, ground frame.
    #[must_use]
    #[track_caller]
    pub fn velocity_at(&self, frame: usize, point: Vec3<S>) -> Vec3<S> {
        let twist = &self.twists[frame];
        twist.velocity + twist.angular_velocity.cross(&(point - self.frames()[frame].position))
    }
    /// Velocity of the body of frame `j` against that of frame `i` where both are at `point` (m, ground frame): of a contact, the
    /// sliding and approaching, m/s, ground frame.
    #[must_use]
    #[track_caller]
    pub fn relative_velocity_at(&self, i: usize, j: usize, point: Vec3<S>) -> Vec3<S> {
        self.velocity_at(j, point) - self.velocity_at(i, point)
    }
    /// Angular velocity of frame `j` against frame `i` about the z axis of frame `i`, rad/s.
    #[must_use]
    #[track_caller]
    pub fn spin_about_z(&self, i: usize, j: usize) -> S {
        (self.twists[j].angular_velocity - self.twists[i].angular_velocity).dot(&self.frames()[i].z())
    }
    /// Velocity of the origin of frame `j` against that of frame `i`, m/s, ground frame (not as seen from body i).
    #[must_use]
    #[track_caller]
    pub fn relative_velocity(&self, i: usize, j: usize) -> Vec3<S> {
        self.twists[j].velocity - self.twists[i].velocity
    }
}

/// The rows of a constraint.
pub type Rows<'a, S> = Values<'a, S>;

/// Values to be given one by one, in the order in which they are declared.
#[derive(Debug)]
pub struct Values<'a, S> {
    pub(crate) values: &'a mut [Option<S>],
    pub(crate) next: usize,
    /// What one of them is called in messages.
    pub(crate) what: &'static str,
}

impl<'a, S: Scalar> Values<'a, S> {
    pub(crate) fn new(values: &'a mut [Option<S>], what: &'static str) -> Self {
        Self { values, next: 0, what }
    }

    /// Sets the next value.
    ///
    /// # Panics
    /// When fewer are declared.
    #[track_caller]
    pub fn push(&mut self, value: S) {
        self.set(self.next, value);
        self.next += 1;
    }
    /// Sets three values.
    #[track_caller]
    pub fn push_vector(&mut self, value: Vec3<S>) {
        for component in value.iter() {
            self.push(*component);
        }
    }
    /// Sets the value with this number.
    ///
    /// # Panics
    /// When fewer are declared.
    #[track_caller]
    pub fn set(&mut self, k: usize, value: S) {
        assert!(
            k < self.values.len(),
            "{} {k} is set, but the element declares {} of them",
            self.what,
            self.values.len()
        );
        self.values[k] = Some(value);
    }
}

/// Forces and torques on the bodies of an element; contributions add up.
#[derive(Debug)]
pub struct Wrenches<'a, S> {
    pub(crate) frames: &'a [Frame<S>],
    pub(crate) forces: &'a mut [Vec3<S>],
    pub(crate) torques: &'a mut [Vec3<S>],
}

impl<S: Scalar> Wrenches<'_, S> {
    /// A force (N, ground frame) on the body of a frame, at the frame's origin.
    #[track_caller]
    pub fn force(&mut self, frame: usize, force: Vec3<S>) {
        self.forces[frame] += force;
    }
    /// A torque (N m, ground frame) on the body of a frame.
    #[track_caller]
    pub fn torque(&mut self, frame: usize, torque: Vec3<S>) {
        self.torques[frame] += torque;
    }
    /// A force (N, ground frame) on the body of a frame, at `point` (m, ground frame).
    #[track_caller]
    pub fn force_at(&mut self, frame: usize, point: Vec3<S>, force: Vec3<S>) {
        let lever = point - self.frames[frame].position;
        self.force(frame, force);
        self.torque(frame, lever.cross(&force));
    }
    /// Action and reaction at `point` (m, ground frame): `force` on the body of frame `j`, its opposite on that of frame `i`.
    #[track_caller]
    pub fn force_pair_at(&mut self, i: usize, j: usize, point: Vec3<S>, force: Vec3<S>) {
        self.force_at(j, point, force);
        self.force_at(i, point, -force);
    }
    /// Action and reaction: `force` at the origin of frame `j`, and its opposite on the body of frame `i` along the same
    /// line, so that the pair has no resultant force and no resultant moment. Of a force between the two origins (springs, dampers) the
    /// moment is zero, which the host cannot see: two calls of [`Wrenches::force`] give the same, and cost a part of it.
    #[track_caller]
    pub fn force_pair(&mut self, i: usize, j: usize, force: Vec3<S>) {
        let lever = self.frames[j].position - self.frames[i].position;
        self.force(j, force);
        self.force(i, -force);
        self.torque(i, -lever.cross(&force));
    }
    /// Action and reaction: `torque` on the body of frame `j`, its opposite on that of frame `i`.
    #[track_caller]
    pub fn torque_pair(&mut self, i: usize, j: usize, torque: Vec3<S>) {
        self.torque(j, torque);
        self.torque(i, -torque);
    }
}
